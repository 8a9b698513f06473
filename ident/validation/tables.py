"""A validation printed: errors, metrics, and what the flight used beyond its data."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ident.text import on_screen
from ident.validation.result import Validation
from ident.validation.sweep import SweepPoint
from sim.boat.database import axis_columns, version_words

if TYPE_CHECKING:
    from rich.console import Console


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def show(done: Validation, console: Console) -> None:
    """Print errors, metrics and use beyond the data as tables."""
    from rich.table import Table

    console.print(f"[bold]{on_screen(done.case.title)}[/], {version_words(done.database)}")
    if done.errors:
        table = Table("reference", "channel", "RMSE", "published model", "ratio", "unit", title="Errors")
        for source, channels in done.errors.items():
            for channel, e in channels.items():
                text = "-" if e.ratio is None else f"[{'green' if e.ratio <= 1 else 'red'}]{e.ratio:.2f}[/]"
                numbers = [_number(e.rmse), _number(e.published_model_rmse)]
                table.add_row(on_screen(source), channel, *numbers, text, on_screen(e.unit))
        console.print(table)
    if done.metrics:
        labels = list(next(iter(done.metrics.values())))
        table = Table("metric", *map(on_screen, labels), title="Metrics (ITTC)")
        for metric, values in done.metrics.items():
            table.add_row(on_screen(metric), *[_number(values[c]) for c in labels])
        console.print(table)
    _show_grid(done.grid or [], console)
    _show_outside(done, console)
    for note in done.notes:
        console.print(note, highlight=False)
    for one in done.saturated:
        share = f"{100.0 * one.share_of_time:.0f} % of the time"
        console.print(f"[red]{one.actuator}: at the limit of {one.limit:g} {one.unit} for {share}[/]")
    limited = done.simulation.trim.limited if done.simulation.trim else ()
    if limited:
        console.print(f"[red]at the start at their limit: {', '.join(limited)}[/]")
    end = float(done.simulation["t"][-1])
    if not done.complete:
        console.print(f"[red]the simulation left the finite numbers after {end:.1f} s; errors are up to there[/]")
    elif end < done.case.run.duration_s - done.case.run.record_s:
        console.print(f"the run ended at {done.simulation.end[0]:.1f} s by an event of the case", highlight=False)
    if float(done.simulation["D0"].min()) < 0.0:
        console.print("[red]the sail top left the water; the model holds for a fully submerged boat only[/]")
    if not done.case.tolerance and all(p.tolerance is None for p in done.case.published):
        console.print("the case states no tolerance")
    else:
        verdict = "[green]within[/]" if done.passed else "[red]outside[/]"
        console.print(f"{verdict} the tolerances of the case file")


def _show_grid(grid: list[SweepPoint], console: Console) -> None:
    from rich.table import Table

    if not grid:
        return
    keys = ("speed_mps", "depth_m", "n_rps", "pitch_deg", "heel_deg", "dV_deg", "dH_deg", "ballast_kg", "trim_tank_m")
    table = Table(*keys, "remark", title="Self-propulsion")
    for point in grid:
        remark = point.reason or ", ".join(f"{k} at its limit" for k in point.limited)
        table.add_row(*[_number(getattr(point, k)) for k in keys], remark)
    console.print(table)


def _show_outside(done: Validation, console: Console) -> None:
    from rich.table import Table

    units = {axis: column for column, axis in axis_columns().items()}
    rows: dict[tuple[str, float], list[str]] = {}
    for use in done.outside_tables:
        rows.setdefault((use.axis, round(use.fraction_of_time, 3)), []).append(use.term)
    if rows:
        table = Table("axis", "share of time", "terms", title="Used outside their data")
        for (axis, share), terms in sorted(rows.items(), key=lambda r: -r[0][1]):
            table.add_row(units.get(axis, axis), f"{100 * share:.1f} %", " ".join(terms))
        console.print(table)
    single: dict[str, list[str]] = {}
    for term, axes in done.constant_axes.items():
        for axis in axes:
            single.setdefault(axis, []).append(term)
    for axis, terms in single.items():
        console.print(
            f"measured at one {units.get(axis, axis)} only, used at every other: {' '.join(terms)}", highlight=False
        )
