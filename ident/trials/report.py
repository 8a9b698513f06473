"""One trial or a folder of them: tables, JSON, CSV, scatter of runs, port against starboard."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ident.text import on_screen
from ident.trials.criteria import Criterion, criteria
from ident.trials.measure import Value
from ident.trials.spec import TrialFile, load_spec
from ident.trials.stated import quoted
from ident.trials.trial import Trial, measure_trial, side_of
from sim.files.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

# What lies beside records in a folder and is none.
_NO_RECORDS = {".toml", ".png", ".md", ".json", ".pdf", ".html", ".py", ".docx"}
# Metrics of a turn whose sign is that of its side.
_OF_THE_SIDE = ("drift_angle_", "yaw_rate_steady", "heel_")


@dataclass(frozen=True)
class Trials:
    """Measured trials of one file or of a folder, and what was refused.

    Attributes
    ----------
    trials : Each measured record.
    refused : (file, message) of each that was refused; a single file raises instead.
    folder : Whether a folder was asked for.
    """

    trials: tuple[Trial, ...]
    refused: tuple[tuple[str, str], ...]
    folder: bool

    def to_dict(self) -> dict[str, Any]:
        """For a machine to read: one trial, or ``trials``, ``scatter`` and ``refused`` of a folder."""
        if not self.folder:
            one = self.trials[0]
            return one.to_dict() | {"criteria": [c.to_dict() for c in _criteria(one)]}
        return {
            "trials": [t.to_dict() | {"criteria": [c.to_dict() for c in _criteria(t)]} for t in self.trials],
            "scatter": [s.to_dict() for s in scatter(self.trials)],
            "refused": [{"file": f, "what": what} for f, what in self.refused],
        }


def _criteria(one: Trial) -> list[Criterion]:
    return criteria(one.maneuver, one.metrics, one.spec.length_m)


def measure_all(path: Path, spec: TrialFile) -> Trials:
    """Measure a record, or every record of a folder.

    Parameters
    ----------
    path : A file, or a folder; a file ``NAME.toml`` beside ``NAME.csv`` states what is said of that one.
    spec : What is said of every record.

    Raises
    ------
    InputError
        For a file that is refused, or a folder of which nothing can be measured.
    """
    if not path.is_dir():
        return Trials((measure_trial(path, spec),), (), False)
    there = (p for p in path.iterdir() if p.is_file() and not p.name.startswith((".", "~")))
    files = sorted(p for p in there if p.suffix.lower() not in _NO_RECORDS)
    if not files:
        raise InputError(str(path), "no record", "a folder with tables of recorded maneuvers")
    trials, refused = [], []
    for one in files:
        beside = one.with_suffix(".toml")
        try:
            stated = load_spec(beside).model_dump(exclude_unset=True) if beside.is_file() else {}
            both = TrialFile.model_validate(spec.model_dump(exclude_unset=True) | stated)
            trials.append(measure_trial(one, both, every_key=False))
        except InputError as error:
            refused.append((str(one), f"{error.where}: {error.found}; allowed: {error.allowed}"))
    if not trials:
        raise InputError(refused[0][0], refused[0][1], "a folder with a record that can be measured")
    return Trials(tuple(trials), tuple(refused), True)


@dataclass(frozen=True)
class Scatter:
    """One metric over the runs of one maneuver to one side.

    Attributes
    ----------
    maneuver, side, metric, unit : Which.
    runs : How many.
    mean : Of the runs.
    scatter : Standard deviation of a run; None for one run.
    stated : Root mean square of the runs' standard errors.
    port_less_starboard : Difference of the sides' means, where both were run: with the port side's rows. Of drift, heel
        and yaw rate in a turn, which have the sign of the side, the port side's are mirrored first.
    """

    maneuver: str
    side: str
    metric: str
    runs: int
    mean: float
    scatter: float | None
    stated: float
    unit: str
    port_less_starboard: Value | None = None

    def to_dict(self) -> dict[str, Any]:
        """For a machine to read; ``port_less_starboard`` where both sides were run."""
        row = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "port_less_starboard"}
        gap = self.port_less_starboard
        return row if gap is None else row | {"port_less_starboard": {"value": gap.value, "sigma": gap.sigma}}


def scatter(trials: tuple[Trial, ...]) -> list[Scatter]:
    """Mean and scatter of each metric over the runs of one maneuver to one side, beside their stated errors."""
    groups: dict[tuple[str, str], dict[str, list[Value]]] = {}
    for one in trials:
        group = groups.setdefault((str(one.maneuver), side_of(one)), {})
        for name, value in one.metrics.items():
            group.setdefault(name, []).append(value)
    rows = []
    for (maneuver, side), metrics in groups.items():
        for name, values in metrics.items():
            x = np.array([v.value for v in values])
            stated = float(np.sqrt(np.mean([v.sigma**2 for v in values])))
            spread = float(x.std(ddof=1)) if len(x) > 1 else None
            other = groups.get((maneuver, "starboard"), {}).get(name) if side == "port" else None
            gap = _port_less_starboard(values, other, stated, name.startswith(_OF_THE_SIDE)) if other else None
            rows.append(Scatter(maneuver, side, name, len(x), float(x.mean()), spread, stated, values[0].unit, gap))
    return rows


def _port_less_starboard(port: list[Value], starboard: list[Value], stated: float, mirrored: bool) -> Value:
    """Difference of the means, its error by the scatter of the runs and at least that which is stated.

    What has the sign of its side is ``mirrored`` first: a boat that turns alike to both sides has no difference.
    """
    x, y = (np.array([v.value for v in side]) for side in (port, starboard))
    x = -x if mirrored else x
    spread = [float(a.var(ddof=1)) if len(a) > 1 else stated**2 for a in (x, y)]
    error = math.sqrt(max(spread[0], stated**2) / len(x) + max(spread[1], stated**2) / len(y))
    return Value(float(x.mean() - y.mean()), error, port[0].unit)


def write_csv(done: Trials, path: Path) -> None:
    """Write every metric as a row: file, maneuver, metric, value, sigma, unit.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    import csv

    from ident.output import whole

    with whole(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(["file", "maneuver", "metric", "value", "sigma", "unit"])
        for one in done.trials:
            for name, v in one.metrics.items():
                table.writerow([one.recording.file, str(one.maneuver), name, repr(v.value), repr(v.sigma), v.unit])


def rounded(value: float, sigma: float) -> tuple[str, str]:
    """Value and error with the digits that the error leaves: two of the error."""
    places = max(0, 1 - math.floor(math.log10(sigma))) if sigma > 0.0 else 6
    return f"{value:.{min(places, 6)}f}", f"{sigma:.{min(places, 6)}f}"


def show(done: Trials, console: Console) -> None:
    """Print metrics with errors, criteria, assumptions and findings."""
    for one in done.trials:
        _show_one(one, console)
    if done.folder:
        _show_scatter(done, console)
    for file, what in done.refused:
        console.print(f"[red]refused[/] {on_screen(f'{file}: {what}')}", highlight=False)


def _show_one(one: Trial, console: Console) -> None:
    from rich.markup import escape
    from rich.table import Table

    table = Table("metric", "value", "+-", "unit", title=on_screen(f"{Path(one.recording.file).name}: {one.maneuver}"))
    for name, v in one.metrics.items():
        table.add_row(name, *rounded(v.value, v.sigma), v.unit)
    console.print(table)
    for c in _criteria(one):
        word = {True: "[green]met[/]", False: "[red]not met[/]", None: "undecided, within two standard errors"}[c.met]
        console.print(f"IMO MSC.137(76) {c.paragraph}: {c.metric} below {c.limit:.4g}: {word}", highlight=False)
    for key, value in quoted(one.spec).items():
        console.print(f"{key}: {escape(str(value))}", highlight=False)
    console.print("assumed:", highlight=False)
    for text in one.assumed:
        console.print(f"  {escape(text)}", highlight=False)
    for f in one.findings:
        place = f"row {f.shown_rows}, {', '.join(f.columns)}"
        console.print(f"[yellow]{f.severity}[/] {escape(place)}: {escape(f.what)}", highlight=False)
        console.print(f"  {escape(f.remedy)}", highlight=False)


def _show_scatter(done: Trials, console: Console) -> None:
    from rich.table import Table

    rows = [r for r in scatter(done.trials) if r.runs > 1 or r.port_less_starboard is not None]
    if not rows:
        return
    table = Table("maneuver", "side", "metric", "runs", "mean", "scatter", "stated", "port - starboard", title="Runs")
    for r in rows:
        gap = r.port_less_starboard
        shown = "" if gap is None else " +- ".join(rounded(gap.value, gap.sigma))
        spread = "-" if r.scatter is None else f"{r.scatter:.3g}"
        table.add_row(r.maneuver, r.side, r.metric, str(r.runs), f"{r.mean:.5g}", spread, f"{r.stated:.2g}", shown)
    console.print(table)
