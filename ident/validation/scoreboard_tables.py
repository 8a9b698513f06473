"""The scoreboard printed: one table of errors, one of cases without a reference, and their means."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ident.text import on_screen
from ident.validation.board import Scoreboard
from sim.boat.database import version_words

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

# Metrics of a case without reference that are printed; the JSON has them all.
_METRICS = 4


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _ratio(value: float | None) -> str:
    return "-" if value is None else f"[{'green' if value <= 1 else 'red'}]{value:.2f}[/]"


def _errors_table(board: Scoreboard) -> Table:
    from rich.table import Table

    table = Table(
        *("case", "reference", "channel", "RMSE", "parent", "measured only", "published", "ratio", "to parent"),
        *("unit", "trained"),
        title=f"Scoreboard, {version_words(board.database)}",
    )
    for case, source, channel, compared in board.comparisons:
        error = compared.error
        rmse = (error.rmse, compared.parent_rmse, compared.measured_only_rmse, error.published_model_rmse)
        table.add_row(
            *[on_screen(name) for name in (case.name, source, channel)],
            *[_number(value) for value in rmse],
            *[_ratio(value) for value in (error.ratio, compared.ratio_to_parent)],
            on_screen(error.unit),
            "yes" if case.trained else "no",
        )
    return table


def _metrics_table(board: Scoreboard) -> Table:
    """Cases that no reference stands against, and so do not count."""
    from rich.table import Table

    table = Table("case", "simulated", title="Without a reference series: flown, not counted")
    for case in board.cases:
        if case.validation is None or case.errors:
            continue
        known = [(name, m.simulated) for name, m in case.validation.metrics.items() if m.simulated is not None]
        text = ", ".join(f"{name} {_number(value)}" for name, value in known[:_METRICS])
        more = f", {len(known) - _METRICS} more in --json" if len(known) > _METRICS else ""
        table.add_row(on_screen(case.name), (on_screen(text) or "-") + more)
    return table


def show(board: Scoreboard, console: Console) -> None:
    """Print the scoreboard as tables."""
    console.print(_errors_table(board))
    without = _metrics_table(board)
    if without.row_count:
        console.print(without)
    for case in board.cases:
        if case.failed is not None:
            console.print(f"[red]{on_screen(case.name)} not flown: {on_screen(case.failed)}[/]", highlight=False)
    for name, trained in board.trained_on.items():
        console.print(on_screen(f"{name} trained on: {', '.join(trained) or 'no maneuver'}"), highlight=False)
    to_published, to_parent = board.mean_ratio, board.mean_ratio_to_parent
    for kind, published, parent in (
        ("trained", to_published.trained, to_parent.trained),
        ("untrained", to_published.untrained, to_parent.untrained),
    ):
        shown, beside = ("no case" if mean is None else f"{mean:.2f}" for mean in (published, parent))
        text = f"geometric mean of the ratios, {kind} cases: {shown}"
        console.print(f"{text}; to the parent version: {beside}", highlight=False)
    at = board.worst_ratio
    if at:
        place = f"{at.case} {at.source} {at.channel}"
        console.print(f"worst ratio: {at.ratio:.2f} ({on_screen(place)})", highlight=False)
