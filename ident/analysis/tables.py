"""Stability printed: one row a speed and depth."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ident.analysis.result import StabilityMap
from ident.text import on_screen

if TYPE_CHECKING:
    from rich.console import Console


def show(states: StabilityMap, console: Console) -> None:
    """Print the results as a table."""
    from rich.table import Table

    table = Table(
        *("U [m/s]", "D0 [m]", "Gv", "Gh", "neutral point v, h [L]", "critical speed stern, sail [m/s]"),
        *("vertical [1/s]", "horizontal [1/s]"),
        title=on_screen(f"{states.title}, database version {states.version}"),
    )

    def speed(value: float | None) -> str:
        return "none" if value is None else f"{value:.2f}"

    def root(values: list[tuple[float, float]]) -> str:
        if not values:
            return "-"
        real, imaginary = values[0]
        return f"{real:+.4f}" + (f" +-{abs(imaginary):.4f}i" if imaginary else "")

    def number(value: float | None) -> str:
        return "-" if value is None else f"{value:+.3f}"

    for s in states:
        points = f"{number(s.neutral_point_vertical)}, {number(s.neutral_point_horizontal)}"
        critical = f"{speed(s.critical_speed_stern)}, {speed(s.critical_speed_sail)}"
        signs = [f"[{'green' if (g or 0.0) > 0 else 'red'}]{number(g)}[/]" for g in (s.g_vertical, s.g_horizontal)]
        table.add_row(f"{s.speed:.3f}", f"{s.depth:g}", *signs, points, critical, root(s.vertical), root(s.horizontal))
    console.print(table)
    about = " or ".join(dict.fromkeys(s.about for s in states))
    console.print(f"last two columns: least stable root about straight level motion, {about}")
