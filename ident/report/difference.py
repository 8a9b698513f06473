"""What changed between two versions, as a figure."""

from __future__ import annotations

from pathlib import Path

from ident.database.compare import Change, Difference
from ident.output import whole
from ident.text import in_figure
from sim.files.frames import PROGRAM

# Coefficients of one figure: more are not legible; those that changed most are drawn.
_MOST = 40
# Height of one bar, and of title and axis [inch].
_BAR, _ROOM = 0.2, 1.6


def draw_difference(difference: Difference, path: Path, of: str) -> Path:
    """Draw how far each coefficient moved, in its standard errors and over its largest value.

    Parameters
    ----------
    difference : From ``DatabaseVersion.diff``.
    path : PNG, SVG or PDF to write.
    of : Name of the database, for the title.

    Returns
    -------
    ``path``.

    Raises
    ------
    sim.files.errors.InputError
        When it cannot be written.
    """
    from matplotlib.figure import Figure

    changes = sorted(difference.changes, key=lambda c: (-c.largest_change_in_stderr, -c.largest_relative_change))
    drawn = changes[:_MOST][::-1]
    figure = Figure(figsize=(9.5, _ROOM + _BAR * max(len(drawn), 4)), layout="constrained")
    errors, shares = figure.subplots(1, 2, sharey=True)
    place = range(len(drawn))
    errors.barh(place, [c.largest_change_in_stderr for c in drawn], color="#1f4e9c")
    shares.barh(place, [100.0 * c.largest_relative_change for c in drawn], color="#6a994e")
    errors.set_yticks(place, [in_figure(_label(c)) for c in drawn], fontsize=7)
    errors.set_xlabel("largest change, in standard errors [-]")
    shares.set_xlabel("largest change over the largest value [%]")
    for axes in (errors, shares):
        axes.grid(axis="x", alpha=0.3)
    left_out = f"; the {len(drawn)} that moved most of {len(changes)}" if len(changes) > len(drawn) else ""
    vehicles = ", ".join(dict.fromkeys(c.vehicle for c in changes)) or "no change"
    title = f"{vehicles}: version {difference.first} to {difference.second} of {of}{left_out}"
    figure.suptitle(f"{in_figure(title)}\ndimensionless coefficients; {in_figure(str(PROGRAM))}", fontsize=9)
    with whole(path) as part:
        figure.savefig(part, dpi=120)
    return path


def _label(change: Change) -> str:
    words = [f"{n} {what}" for n, what in ((change.added, "new"), (change.removed, "gone")) if n]
    return f"{change.coefficient} ({', '.join(words)})" if words else change.coefficient
