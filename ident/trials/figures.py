"""The plots of a trial report: time histories with their events, the track, the residuals."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ident.output import whole
from ident.text import in_figure, in_file_name
from ident.trials.maneuvers import control_of
from ident.trials.trial import Trial

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LABELS = {
    "psi": ("heading", "deg"),
    "theta": ("pitch", "deg"),
    "phi": ("heel", "deg"),
    "U": ("speed", "m/s"),
    "u": ("speed ahead", "m/s"),
    "z": ("depth", "m"),
    "r": ("yaw rate", "deg/s"),
}
_MEASURED, _SMOOTH, _CONTROL = "#9a9a9a", "#1f4e79", "#b5541c"


def _angle(one: Trial) -> str:
    return "psi" if one.maneuver.horizontal else "phi" if one.maneuver.kind == "roll_decay" else "theta"


def _base(one: Trial, name: str) -> float:
    if name not in ("psi", "theta") or name != _angle(one):
        return 0.0
    return float(one.paths[name](one.start.time)) if one.start.angle is None else one.start.angle


def _history(axes: Axes, one: Trial, name: str) -> None:
    """Samples and smooth path of a channel over the time from the execute."""
    record, path = one.recording.channels[name], one.paths[name]
    unit = 180.0 / math.pi if record.unit.startswith("rad") else 1.0
    base = _base(one, name)
    axes.plot(
        record.abscissa - one.start.time, unit * (record.value - base), ".", ms=2.5, color=_MEASURED, label="samples"
    )
    grid = np.linspace(max(one.start.time, float(path.knots[4])), float(path.knots[-5]), 1500)
    axes.plot(grid - one.start.time, unit * (path(grid) - base), color=_SMOOTH, lw=1.2, label="smooth path")
    word, shown = _LABELS.get(name, (name, record.unit))
    change = " from the course at the execute" if base else ""
    axes.set_ylabel(f"{word}{change} [{shown}]", fontsize=8)
    axes.axvline(0.0, color="0.6", lw=0.6)


def _zigzag_events(axes: Axes, one: Trial) -> None:
    """Rudder, check lines, executes and overshoots."""
    control = control_of(one.recording, one.maneuver.kind == "vertical_zigzag")
    if control is not None:
        t = control.abscissa - one.start.time
        axes.step(
            t,
            np.degrees(control.value),
            where="post",
            color=_CONTROL,
            lw=0.9,
            label="rudder" if one.maneuver.horizontal else "planes",
        )
    check = one.maneuver.check or 0.0
    for side in (1.0, -1.0):
        axes.axhline(side * check, color="0.6", lw=0.6, ls="--")
    name = _angle(one)
    last = float(one.paths[name].knots[-5]) - one.start.time
    for k in (1, 2, 3):
        over, at = one.metrics.get(f"overshoot_{k}_deg"), one.metrics.get(f"execute_{k + 1}_s")
        if at is None:
            continue
        there = math.degrees(float(one.paths[name](at.value + one.start.time)) - _base(one, name))
        sense = math.copysign(1.0, there)
        axes.plot([at.value], [there], "o", ms=4, mfc="white", color=_SMOOTH)
        if over is not None:
            text = f"{over.value:.2f} $\\pm$ {over.sigma:.2g} deg"
            axes.annotate(
                text,
                (at.value, sense * (check + over.value)),
                xytext=(4, 4 * sense),
                # Towards the end of the record to the left, so that it stays inside.
                ha="right" if at.value > 0.75 * last else "left",
                textcoords="offset points",
                fontsize=7,
                va="bottom" if sense > 0 else "top",
            )
    axes.margins(y=0.12)


def _track(axes: Axes, one: Trial) -> None:
    """Track along and across the course at the execute, with advance, transfer and diameter."""
    start, paths = one.start, one.paths
    grid = np.linspace(start.time, min(float(paths[k].knots[-5]) for k in ("north", "east")), 1500)
    if "psi" in paths:
        base = float(paths["psi"](start.time)) if start.angle is None else start.angle
    else:
        base = math.atan2(float(paths["east"](start.time, 1)), float(paths["north"](start.time, 1)))
    n0, e0 = float(paths["north"](start.time)), float(paths["east"](start.time))
    c, s = math.cos(base), math.sin(base)

    def turned(north: Any, east: Any) -> tuple[Any, Any]:
        return s * (n0 - north) * 1.0 + c * (east - e0), c * (north - n0) + s * (east - e0)

    north, east = one.recording.channels["north"], one.recording.channels["east"]
    axes.plot(*turned(north.value, east.value), ".", ms=2.5, color=_MEASURED)
    across, along = turned(paths["north"](grid), paths["east"](grid))
    axes.plot(across, along, color=_SMOOTH, lw=1.2)
    side = math.copysign(1.0, across[int(np.argmax(np.abs(across)))])
    metric = one.metrics
    by = "heading" if "advance_90_heading_m" in metric else "course"
    a, t, d = (metric.get(f"{k}_{by}_m") for k in ("advance_90", "transfer_90", "tactical_diameter_180"))
    if a and t:
        axes.plot([0.0, side * t.value], [a.value, a.value], color=_CONTROL, lw=0.8)
        axes.plot([0.0, 0.0], [0.0, a.value], color=_CONTROL, lw=0.8)
        axes.annotate(
            f"advance {a.value:.1f} $\\pm$ {a.sigma:.2g} m",
            (0.0, 0.5 * a.value),
            rotation=90,
            fontsize=7,
            ha="right" if side > 0 else "left",
            va="center",
        )
        axes.annotate(
            f"transfer {t.value:.1f} $\\pm$ {t.sigma:.2g} m",
            (0.5 * side * t.value, a.value),
            fontsize=7,
            ha="center",
            va="bottom",
        )
    if d:
        low = float(np.min(along))
        axes.plot([0.0, side * d.value], [low, low], color=_CONTROL, lw=0.8)
        axes.annotate(
            f"tactical diameter {d.value:.1f} $\\pm$ {d.sigma:.2g} m",
            (0.5 * side * d.value, low),
            fontsize=7,
            ha="center",
            va="top",
            xytext=(0, -3),
            textcoords="offset points",
        )
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.1)
    axes.set_xlabel("across the first course, to starboard [m]", fontsize=8)
    axes.set_ylabel("along the first course [m]", fontsize=8)


def _residuals(axes: Axes, one: Trial, name: str) -> None:
    """Samples less smooth path: what is taken for noise."""
    record, path = one.recording.channels[name], one.paths[name]
    inside = (record.abscissa >= max(one.start.time, path.knots[4])) & (record.abscissa <= path.knots[-5])
    unit = 180.0 / math.pi if record.unit.startswith("rad") else 1.0
    rest = unit * (record.value[inside] - path(record.abscissa[inside]))
    axes.plot(record.abscissa[inside] - one.start.time, rest, ".", ms=2.0, color=_MEASURED)
    axes.axhspan(-2.0 * unit * path.sigma, 2.0 * unit * path.sigma, color=_SMOOTH, alpha=0.12, lw=0)
    word, shown = _LABELS.get(name, (name, record.unit))
    axes.set_ylabel(f"{word}: samples\nless path [{shown}]", fontsize=8)
    axes.set_xlabel("time from the execute [s]", fontsize=8)
    axes.tick_params(labelsize=8)


def trial_figure(one: Trial, folder: Path) -> Path:
    """Draw a trial: angle with rudder and overshoots, speed, residuals, and the track where there is one.

    Parameters
    ----------
    one : The measured trial.
    folder : Where the PNG is written, named after the record.

    Raises
    ------
    InputError
        When it cannot be written.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    main = _angle(one) if _angle(one) in one.paths else ""
    others = [n for n in ("U", "u", "z", "phi", "theta") if n in one.paths and n != main][:2]
    track = {"north", "east"} <= set(one.paths)
    rows = [*([main] if main else []), *others]
    figure = pyplot.figure(
        figsize=(11.0 if track else 7.5, 1.6 + 2.1 * max(len(rows) + bool(main), 2)), layout="constrained"
    )
    grid = figure.add_gridspec(
        max(len(rows) + bool(main), 1),
        2 if track and rows else 1,
        height_ratios=[2.2 if r == main else 1.0 for r in [*rows, *(["rest"] if main else [])]] or [1.0],
    )
    first = None
    for i, name in enumerate(rows):
        axes = figure.add_subplot(grid[i, 0], sharex=first)
        first = first or axes
        _history(axes, one, name)
        if name == main and "zigzag" in one.maneuver.kind:
            _zigzag_events(axes, one)
        axes.tick_params(labelsize=8)
        if i == 0:
            axes.legend(
                fontsize=7, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, frameon=False, ncols=3
            )
    if main:
        _residuals(figure.add_subplot(grid[len(rows), 0], sharex=first), one, main)
    if track:
        axes = figure.add_subplot(grid[:, 1] if rows else grid[0, 0])
        _track(axes, one)
        axes.tick_params(labelsize=8)
    title = one.spec.name or Path(one.recording.file).name
    loading = f", {one.spec.loading}" if one.spec.loading else ""
    figure.suptitle(in_figure(f"{title}: {one.maneuver}{loading}"), fontsize=10)
    path = folder / f"{in_file_name(Path(one.recording.file).stem)}_trial.png"
    with whole(path) as part:
        figure.savefig(part, dpi=130)
    pyplot.close(figure)
    return path
