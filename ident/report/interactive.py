"""Interactive figures of a version: tables to turn, slices over speed and depth, versions side by side.

Drawn with plotly, whose script is written into the page: it needs no network.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ident.output import whole
from ident.report.values import Run, number, term_anchor
from sim.boat import catalogue
from sim.boat.catalogue import Term
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import Vehicle
from sim.files.extras import library
from sim.files.frames import PROGRAM

if TYPE_CHECKING:
    import plotly.graph_objects as go

_COLOURS = ("#1f4e9c", "#d1263b", "#2a9d8f")
# Axes that a slice holds rather than runs along.
_HELD = ("U", "D0")
# Runs named beside a point.
_RUNS = 6


@dataclass(frozen=True)
class Drawn:
    """One version to draw: its number, the vehicle's rows, and the runs behind them by name."""

    number: int
    rows: pd.DataFrame
    runs: dict[str, Run]


def plotly() -> Any:
    """The plotting library.

    Raises
    ------
    InputError
        When the extra is not installed.
    """
    return library("plotly.graph_objects", "report", "--interactive")


def _title(name: str) -> str:
    axis = catalogue.axes()[name]
    return f"{name} [{axis.unit}]" if axis.unit != "1" else f"{name} [-]"


def _column(name: str) -> str:
    return catalogue.axes()[name].column


def _along(term: Term, rows: pd.DataFrame) -> tuple[str, list[str]]:
    """The axis a slice runs along, and the varying axes it holds."""
    varying = [a for a in term.axes if rows[_column(a)].nunique() > 1]
    free = [a for a in varying if a not in _HELD] or varying
    chosen = max(free, key=lambda a: rows[_column(a)].nunique())
    return chosen, [a for a in varying if a != chosen]


def _hover(one: Drawn, rows: pd.DataFrame) -> list[str]:
    """What stands beside a point: error, method, runs with file and row."""
    runs = one.runs
    texts = []
    for row in rows.to_dict("records"):
        names = row["runs"].split()
        lines = [f"{runs[n].name} ({runs[n].file} row {runs[n].row})" for n in names[:_RUNS]]
        if len(names) > _RUNS:
            lines.append(f"and {len(names) - _RUNS} more runs")
        words = [w for w in (row["origin"], row["estimated_by"], row["quality"]) if w]
        head = f"version {one.number}: {number(row['value'])} \u00b1 {number(row['stderr'], 2)}"
        texts.append("<br>".join([head, ", ".join(words), *lines]))
    return texts


def _slices(go: Any, term: Term, shown: Sequence[Drawn]) -> go.Figure:
    """Value over one axis, with standard errors; a slider holds speed, depth and what else varies."""
    every = pd.concat([d.rows for d in shown])
    along, held = _along(term, every)
    columns = [_column(a) for a in held]
    places = every[columns].drop_duplicates().sort_values(columns) if held else pd.DataFrame(index=[0])
    figure, steps = go.Figure(), []
    for k, (_, place) in enumerate(places.iterrows()):
        first = len(figure.data)
        for i, one in enumerate(shown):
            here = one.rows[(one.rows[columns] == place).all(axis=1)] if held else one.rows
            for part, group in here.groupby("part", sort=False):
                group = group.sort_values(_column(along))
                figure.add_trace(
                    go.Scatter(
                        x=group[_column(along)].tolist(),
                        y=group["value"].tolist(),
                        error_y={"array": group["stderr"].tolist(), "thickness": 1},
                        text=_hover(one, group),
                        hoverinfo="text",
                        mode="lines+markers",
                        name=f"version {one.number}, {part}",
                        line={"color": _COLOURS[i % len(_COLOURS)]},
                        visible=k == 0,
                    )
                )
        label = ", ".join(f"{a} {number(place[_column(a)])} {catalogue.axes()[a].unit}" for a in held)
        steps.append((label, first, len(figure.data)))
    if len(steps) > 1:
        figure.update_layout(sliders=[_slider(steps, len(figure.data))])
    figure.update_layout(xaxis_title=_title(along), yaxis_title=f"{term.name} [-]", showlegend=True)
    return figure


def _slider(steps: list[tuple[str, int, int]], traces: int) -> dict[str, Any]:
    return {
        "currentvalue": {"prefix": "at "},
        "pad": {"t": 50},
        "steps": [
            {"label": label, "method": "update", "args": [{"visible": [first <= t < last for t in range(traces)]}]}
            for label, first, last in steps
        ],
    }


def _turned(go: Any, term: Term, shown: Sequence[Drawn]) -> go.Figure | None:
    """The table over two axes, to turn; the other axes at their last value, flow angles at zero."""
    every = pd.concat([d.rows for d in shown])
    along, held = _along(term, every)
    if not held:
        return None
    second = "D0" if "D0" in held else held[-1]
    at = {a: 0.0 if a not in _HELD and (every[_column(a)] == 0.0).any() else every[_column(a)].max() for a in held}
    figure = go.Figure()
    for i, one in enumerate(shown):
        here = one.rows
        for a in held:
            if a != second:
                here = here[here[_column(a)] == at[a]]
        for (_, _), group in here.groupby(["part", _column(second)], sort=False):
            group = group.sort_values(_column(along))
            figure.add_trace(
                go.Scatter3d(
                    x=group[_column(along)].tolist(),
                    y=group[_column(second)].tolist(),
                    z=group["value"].tolist(),
                    text=_hover(one, group),
                    hoverinfo="text",
                    mode="lines+markers",
                    marker={"size": 3},
                    line={"color": _COLOURS[i % len(_COLOURS)], "width": 4},
                    showlegend=False,
                )
            )
    rest = ", ".join(f"{a} = {number(v)} {catalogue.axes()[a].unit}" for a, v in at.items() if a != second)
    scene = {"xaxis_title": _title(along), "yaxis_title": _title(second), "zaxis_title": f"{term.name} [-]"}
    figure.update_layout(scene=scene, title=rest, height=560)
    return figure


def term_figures(vehicle: Vehicle, shown: Sequence[Drawn]) -> dict[str, list[dict[str, Any]]]:
    """Interactive figures by term, as plotly writes them: slices, then the table to turn where two axes vary.

    Parameters
    ----------
    vehicle : Decides the terms.
    shown : Versions to draw in one figure.

    Raises
    ------
    InputError
        When the extra is not installed.
    """
    go = plotly()
    made: dict[str, list[dict[str, Any]]] = {}
    for term in vehicle_terms(vehicle):
        of_term = [replace(d, rows=d.rows[d.rows["coefficient"] == term.name]) for d in shown]
        of_term = [d for d in of_term if not d.rows.empty]
        if not of_term or all(pd.concat([d.rows for d in of_term])[_column(a)].nunique() < 2 for a in term.axes):
            continue
        figures = [_slices(go, term, of_term), _turned(go, term, of_term)]
        made[term.name] = [json.loads(f.to_json()) for f in figures if f is not None]
    return made


def write_interactive(vehicle: Vehicle, shown: Sequence[Drawn], path: Path, report: str) -> Path:
    """Write the page with the interactive figures.

    Parameters
    ----------
    vehicle : Decides the terms.
    shown : Versions to draw; the first is the report's.
    path : Page to write.
    report : File name of the report beside it, whose terms are linked.

    Returns
    -------
    ``path``.

    Raises
    ------
    InputError
        When the extra is not installed, or the page cannot be written.
    """
    figures = term_figures(vehicle, shown)
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    # No text of a file may end the script it stands in.
    data = json.dumps(figures).replace("<", "\\u003c")
    page = Environment(loader=PackageLoader("ident", "report"), autoescape=True, undefined=StrictUndefined)
    versions = ", ".join(str(d.number) for d in shown)
    text = page.get_template("interactive.html.j2").render(
        vehicle=vehicle,
        versions=versions,
        frame=str(PROGRAM),
        report=report,
        anchors={name: term_anchor(name) for name in figures},
        data=Markup(data),
        library=Markup(get_plotlyjs()),
    )
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")
    return path
