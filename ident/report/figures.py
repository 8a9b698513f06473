"""Figures of the coefficient report: every tabulated value against its axes.

One figure a group and part. Where a coefficient is tabulated over speed and depth a row
of panels is one coefficient to one scale, a column one speed and a line one depth, as the source plots
them. Colour is the quality word, in all figures the same; hollow points are mirror images.
"""

from __future__ import annotations

import base64
import contextlib
import io
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.drawing import Margins, begun, fixed_labels, place_panels, scientific
from ident.text import in_figure
from sim.boat import catalogue
from sim.boat.catalogue import Term
from sim.boat.database import axis_columns
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import Vehicle
from sim.files.frames import PROGRAM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Places = NDArray[np.int64]
# From trustworthy (blue, green) to doubtful (red, black); assigned by rising factor.
_PALETTE = (
    *("#1f4e9c", "#2a9d8f", "#7fb2e5", "#6a994e", "#c9a227", "#8c6d1f"),
    *("#f28e2b", "#a0522d", "#e377c2", "#d1263b", "#8e44ad", "#2b2b2b"),
)
_MARKERS = "osD^vP*X"
_SYMMETRY = "#777777"
_COLUMNS = 3
_LEGEND_COLUMNS = 6
_STYLE: Any = {
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.grid": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "svg.hashsalt": "ident",
}


@dataclass(frozen=True)
class Panel:
    """One set of axes: a coefficient (or several constants) with its rows."""

    title: str
    ylabel: str
    x: str | None
    line: str | None
    column: float | None
    rows: pd.DataFrame
    labels: str = ""


@dataclass(frozen=True)
class Picture:
    """A finished figure: anchor, title, caption and the image as a ``data:`` address."""

    anchor: str
    title: str
    caption: str
    image: str


def quality_colours(words: Iterable[str]) -> dict[str, str]:
    """Colour of each quality word; ``words`` in the order of rising factor."""
    return {word: _PALETTE[i % len(_PALETTE)] for i, word in enumerate(words)}


def equations(term: Term) -> str:
    """Equation numbers of a term, as printed in titles."""
    return "Eq. " + ", ".join(term.equation.split())


def _column(axis: str) -> str:
    return catalogue.axes()[axis].column


def _varying(term: Term, rows: pd.DataFrame) -> list[str]:
    return [a for a in term.axes if rows[_column(a)].nunique() > 1]


def _panels(term: Term, rows: pd.DataFrame) -> list[tuple[str, Panel]]:
    """Panels of one tabulated coefficient, with the abscissa that decides the figure."""
    varying = _varying(term, rows)
    free = [a for a in varying if a not in ("U", "D0")]
    panels = []
    for x in free or (["D0"] if "D0" in varying else [term.axes[0]]):
        # Along one axis the others stand at zero: the runs of a pure motion.
        others = [_column(a) for a in free if a != x]
        along = rows[(rows[others] == 0.0).all(axis=1)] if others else rows
        line = next((a for a in ("D0", "U") if a in varying and a != x), None)
        title = f"{term.name}   {equations(term)}"
        if x in free and "U" in varying:
            line = "D0" if "D0" in varying else None
            for speed, part in along.groupby(_column("U")):
                head = f"{title}   U = {float(str(speed)):.4g} m/s"
                panels.append((x, Panel(head, term.name, x, line, float(str(speed)), part)))
        else:
            panels.append(("", Panel(title, term.name, x, line, None, along)))
    return panels


def _constants(terms: Sequence[Term], rows: pd.DataFrame) -> list[tuple[Term, str, Panel]]:
    """Panels of coefficients without axes: bars over the parts, or over the symbols."""
    panels = []
    by_key: dict[tuple[str, str, str], list[Term]] = {}
    for term in terms:
        symbol = term.name if term.part == "section" or not term.output else ""
        by_key.setdefault((term.group, term.output, symbol), []).append(term)
    for (_, output, symbol), members in by_key.items():
        part = rows[rows["coefficient"].isin([t.name for t in members])]
        if symbol:
            head, labels = (
                f"{symbol}   {equations(members[0])}",
                "part" if members[0].part == "section" else "coefficient",
            )
        else:
            numbers = dict.fromkeys(n for t in members for n in t.equation.split())
            head, labels = f"{output}   Eq. {', '.join(numbers)}", "coefficient"
        panels.append((members[0], "", Panel(head, symbol or output, None, None, None, part, labels)))
    return panels


def _group(terms: Sequence[Term], rows: pd.DataFrame) -> dict[tuple[str, str, str], list[Panel]]:
    """Panels by figure: (group, part, abscissa)."""
    figures: dict[tuple[str, str, str], list[Panel]] = {}
    tabulated = [t for t in terms if t.axes]
    for term in tabulated:
        of_term = rows[rows["coefficient"] == term.name]
        for part, group in of_term.groupby("part", sort=False):
            for x, panel in _panels(term, group):
                figures.setdefault((term.group, str(part), x), []).append(panel)
    present = set(rows["coefficient"])
    for term, x, panel in _constants([t for t in terms if not t.axes and t.name in present], rows):
        part_name = "sections" if term.part == "section" else term.part
        figures.setdefault((term.group, part_name, x), []).append(panel)
    return figures


def _line_values(panels: list[Panel]) -> dict[str, list[float]]:
    values: dict[str, set[float]] = {}
    for panel in panels:
        if panel.line:
            values.setdefault(panel.line, set()).update(panel.rows[_column(panel.line)])
    return {axis: sorted(at) for axis, at in values.items()}


def _shade(i: int, count: int) -> str:
    """Grey of a line: the deepest (or fastest) is the darkest."""
    return str(round(0.75 - 0.6 * (i + 1) / max(count, 1), 3))


@dataclass(frozen=True)
class _Columns:
    """What is drawn of the rows of a panel, as arrays: a group of a table takes longer to take than to draw."""

    value: Array
    stderr: Array
    origin: NDArray[np.object_]
    colour: NDArray[np.object_]

    @classmethod
    def of(cls, rows: pd.DataFrame, colours: dict[str, str]) -> _Columns:
        """The columns of rows, and the colour of each by its quality."""
        value, stderr = (rows[c].to_numpy(float) for c in ("value", "stderr"))
        colour = np.array([colours.get(q, _SYMMETRY) for q in rows["quality"].tolist()], dtype=object)
        return cls(value, stderr, rows["origin"].to_numpy(object), colour)


def _points(axes: Axes, x: Array, of: _Columns, places: Places, marker: str) -> None:
    """Points, filled when measured and hollow when mirrored."""
    edges: Any = of.colour[places].tolist()
    faces = [e if o == "measured" else "white" for e, o in zip(edges, of.origin[places], strict=True)]
    axes.scatter(
        x[places], of.value[places], s=15, marker=marker, facecolors=faces, edgecolors=edges, linewidths=0.9, zorder=3
    )


def _error_bars(axes: Axes, x: Array, of: _Columns) -> None:
    """Standard errors of all lines of a panel, and crosses where symmetry says zero."""
    zero = of.origin == "symmetry"
    if zero.any():
        axes.plot(x[zero], of.value[zero], "x", color=_SYMMETRY, markersize=4.5, zorder=4)
    if not zero.all():
        low, high = (of.value - of.stderr)[~zero], (of.value + of.stderr)[~zero]
        axes.vlines(x[~zero], low, high, colors=of.colour[~zero].tolist(), linewidth=0.9, zorder=3)


def _draw_curve(axes: Axes, panel: Panel, lines: dict[str, list[float]], colours: dict[str, str]) -> None:
    assert panel.x is not None
    axis = catalogue.axes()[panel.x]
    of, x = _Columns.of(panel.rows, colours), panel.rows[axis.column].to_numpy(float)
    known = lines.get(panel.line or "", [0.0])
    line = panel.rows[_column(panel.line)].to_numpy(float) if panel.line else np.zeros(len(x))
    for i, at in enumerate(known):
        places = np.flatnonzero(line == at)
        if not places.size:
            continue
        places = places[np.argsort(x[places])]
        shade = _shade(i, len(known) if panel.line else 0)
        axes.plot(x[places], of.value[places], "-", color=shade, linewidth=1.0, zorder=2)
        measured = places[of.origin[places] != "symmetry"]
        if measured.size:
            _points(axes, x, of, measured, _MARKERS[i % len(_MARKERS)])
    _error_bars(axes, x, of)
    unit = "" if axis.unit == "1" else f" [{axis.unit}]"
    axes.set_xlabel(f"{axis.name}{unit}")
    axes.set_ylabel(f"{panel.ylabel} [-]")
    low, high = axes.get_ylim()
    if low < 0.0 < high:
        axes.axhline(0.0, color="#aaaaaa", linewidth=0.7, zorder=1)
    scientific(axes.xaxis, axes.yaxis)
    # Ticks are most of the time of a panel.
    axes.locator_params(axis="both", nbins=4)


def _draw_bars(axes: Axes, panel: Panel, colours: dict[str, str]) -> None:
    rows = panel.rows.reset_index(drop=True)
    place = list(range(len(rows)))
    axes.barh(
        place,
        rows["value"],
        xerr=rows["stderr"],
        color=[colours.get(q, _SYMMETRY) for q in rows["quality"]],
        error_kw={"elinewidth": 0.9, "capsize": 2},
        height=0.65 if len(rows) > 1 else 0.2,
    )
    axes.set_yticks(place, [in_figure(p) for p in rows[panel.labels]])
    axes.set_ylim(len(rows) - 0.4 if len(rows) > 1 else 0.6, -0.6)
    axes.axvline(0.0, color="#aaaaaa", linewidth=0.7)
    axes.set_xlabel(f"{panel.ylabel} [-]" if panel.labels == "part" else "value [-]")
    scientific(axes.xaxis)
    axes.locator_params(axis="x", nbins=5)


def _legend(panels: list[Panel], lines: dict[str, list[float]], colours: dict[str, str]) -> list[Any]:
    """Handles of the lines, quality words and origins that stand in a figure."""
    from matplotlib.lines import Line2D

    handles = []
    for axis, values in lines.items():
        unit = catalogue.axes()[axis].unit
        for i, value in enumerate(values):
            marker, shade = _MARKERS[i % len(_MARKERS)], _shade(i, len(values))
            label = f"{axis} = {value:.4g} {unit}"
            handles.append(Line2D([], [], color=shade, marker=marker, markersize=4, linewidth=1, label=label))
    rows = pd.concat([p.rows for p in panels])
    for word, colour in colours.items():
        if (rows["quality"] == word).any():
            handles.append(Line2D([], [], color=colour, marker="o", linestyle="", markersize=5, label=in_figure(word)))
    if (rows["origin"] == "mirror").any():
        style = {"color": "#444444", "markerfacecolor": "white", "linestyle": ""}
        handles.append(Line2D([], [], marker="o", markersize=5, label="port/starboard mirror", **style))  # type: ignore[arg-type]
    if (rows["origin"] == "symmetry").any():
        handles.append(Line2D([], [], marker="x", color=_SYMMETRY, linestyle="", label="zero by symmetry"))
    return handles


def _grid(panels: list[Panel]) -> tuple[int, int, list[tuple[int, int]]]:
    """Rows, columns and the place of each panel."""
    speeds = sorted({p.column for p in panels if p.column is not None})
    if not speeds:
        columns = 2 if len(panels) == 4 else min(_COLUMNS, len(panels))
        return -(-len(panels) // columns), columns, [divmod(i, columns) for i in range(len(panels))]
    names = list(dict.fromkeys(p.ylabel for p in panels))
    return len(names), len(speeds), [(names.index(p.ylabel), speeds.index(p.column)) for p in panels]  # type: ignore[arg-type]


def _share_labels(grid: Any, panels: list[Panel], places: list[tuple[int, int]]) -> None:
    """Label the abscissa once a column of speeds, the ordinate (to one scale) and the sections once a row."""
    lowest: dict[int, int] = {}
    rows: dict[int, list[Axes]] = {}
    for panel, (row, column) in zip(panels, places, strict=True):
        lowest[column] = max(row, lowest.get(column, 0))
        if panel.column is not None:
            rows.setdefault(row, []).append(grid[row, column])
        if panel.labels == "part" and column:
            grid[row, column].tick_params(labelleft=False)
    for panel, (row, column) in zip(panels, places, strict=True):
        if panel.column is not None and row < lowest[column]:
            grid[row, column].set_xlabel("")
            grid[row, column].tick_params(labelbottom=False)
    for first, *others in rows.values():
        limits = [axes.get_ylim() for axes in (first, *others)]
        first.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
        for axes in others:
            axes.set_ylim(first.get_ylim())
            axes.set_ylabel("")
            axes.tick_params(labelleft=False)
            axes.yaxis.get_offset_text().set_visible(False)


def _frame(rows: int, columns: int, panels: list[Panel], entries: int) -> tuple[Figure, Any]:
    """A figure with room for titles, labels and legend; lengths in inches."""
    from matplotlib.figure import Figure

    # Fixed margins: an automatic layout costs more time than all the drawing.
    bars = max((len(p.rows) for p in panels if p.x is None), default=0)
    left, between = (1.4, 1.3) if bars > 1 else (0.75, 0.75)
    if all(p.labels == "part" for p in panels) or panels[0].column is not None:
        between = 0.3
    gap = 0.45 if panels[0].column is not None else 0.8
    tall, top, bottom = max(1.75, 0.24 * bars), 0.75, 0.65 + 0.22 * -(-entries // _LEGEND_COLUMNS)
    width = left + 0.15 + 2.9 * columns + between * (columns - 1)
    height = top + bottom + tall * rows + gap * (rows - 1)
    figure = Figure(figsize=(width, height))
    place_panels(figure, rows, columns, Margins(left=left, top=top, bottom=bottom, between=between, gap=gap))
    return figure, figure.subplots(rows, columns, squeeze=False)


def _draw(panels: list[Panel], title: str, stamp: str, colours: dict[str, str]) -> str:
    """One figure as an SVG ``data:`` address."""
    import matplotlib as mpl

    rows, columns, places = _grid(panels)
    lines = _line_values(panels)
    with mpl.rc_context(_STYLE):
        handles = _legend(panels, lines, colours)
        figure, grid = _frame(rows, columns, panels, len(handles))
        for axes in grid.flat:
            axes.set_visible(False)
        for panel, place in zip(panels, places, strict=True):
            axes = grid[place]
            axes.set_visible(True)
            # The power of ten stands at the left, so the title goes to the right.
            axes.set_title(in_figure(panel.title), loc="right", y=1.0)
            fixed_labels(axes, 0.42, 0.27)
            if panel.x is None:
                _draw_bars(axes, panel, colours)
            else:
                _draw_curve(axes, panel, lines, colours)
        _share_labels(grid, panels, places)
        height = figure.get_figheight()
        figure.legend(handles=handles, loc="lower center", ncols=min(len(handles), _LEGEND_COLUMNS), frameon=False)
        figure.suptitle(f"{in_figure(title)}\n{in_figure(stamp)}", fontsize=9.5, y=1.0 - 0.1 / height)
        stream = io.BytesIO()
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(stream.getvalue()).decode()


@contextlib.contextmanager
def figures_begun(
    vehicle: Vehicle, rows: pd.DataFrame, colours: dict[str, str], version: int, workers: int = 1
) -> Iterator[Callable[[], list[Picture]]]:
    """Every coefficient of one vehicle, drawn by other processes while this one does something else.

    Parameters
    ----------
    vehicle : Decides the terms and the order of its parts.
    rows : Its database rows.
    colours : From ``quality_colours``.
    version : Database version, printed on each figure with vehicle and frame.
    workers : Processes that draw; 0 for all cores. The pictures do not depend on it.

    Yields
    ------
    A function that gives one picture a group, part and abscissa.
    """
    order = {name: i for i, name in enumerate(vehicle.part_names())}
    # What is shown, without the long texts of a version, which would be taken and sent with every panel.
    rows = rows[["coefficient", "part", "output", *axis_columns(), "value", "stderr", "origin", "quality"]]
    rows = rows.sort_values("part", key=lambda part: part.map(order), kind="stable")
    stamp = f"{vehicle.name}, database version {version}; program frame: {PROGRAM}"
    named, jobs = [], []
    for (group, part, x), panels in _group(vehicle_terms(vehicle), rows).items():
        title = group.capitalize() if part in ("hull", "propeller", "sections") else f"{group.capitalize()}: {part}"
        if x and x != "delta":
            title += f" against {x}"
        anchor = "fig-" + "-".join(w for w in (group, part, x) if w).replace(" ", "-").lower()
        caption = ", ".join(dict.fromkeys(name for panel in panels for name in panel.rows["coefficient"]))
        named.append((anchor, title, caption))
        jobs.append((panels, title, stamp, colours))
    with begun(_draw, jobs, workers) as images:
        yield lambda: [Picture(*words, image) for words, image in zip(named, images(), strict=True)]


def draw_figures(
    vehicle: Vehicle, rows: pd.DataFrame, colours: dict[str, str], version: int, workers: int = 1
) -> list[Picture]:
    """Every coefficient of one vehicle, drawn; parameters as of ``figures_begun``."""
    with figures_begun(vehicle, rows, colours, version, workers) as pictures:
        return pictures()
