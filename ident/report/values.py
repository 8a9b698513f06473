"""Every value of a version as the report prints it: axes, error, interval, and the file and row it came from."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import pandas as pd

from ident.fitting.notes import stored_unused
from ident.report.figures import Picture, equations
from sim.boat import catalogue
from sim.boat.catalogue import Term
from sim.boat.database import Version, axis_columns
from sim.files.columns import records

# Half width of the interval of a normal distribution that holds 95 %, in standard errors.
_HALF_95 = NormalDist().inv_cdf(0.975)
_ORIGINS = {
    "measured": "from runs",
    "published": "published as a coefficient",
    "mirror": "port/starboard image of the other side's runs",
    "symmetry": "zero by port/starboard symmetry",
    "estimated": "no run",
}


# Columns that a value is printed from, beside its axes.
_SHOWN = ("part", "value", "stderr", "origin", "estimated_by", "quality", "calibration", "runs")


@dataclass(frozen=True)
class Run:
    """One captive run behind values of a version.

    Attributes
    ----------
    name, anchor : Its ``run_id`` and where it stands in the page.
    file, row : Where it was read from; row 0 when the version does not say.
    source : What the run's file says of its origin.
    terms : Symbols of the terms it decides.
    unused : Loads that were left out, with the reason.
    """

    name: str
    anchor: str
    file: str
    row: int
    source: str
    terms: tuple[str, ...]
    unused: tuple[str, ...]


@dataclass(frozen=True)
class Value:
    """One tabulated value, in database units, as text.

    Attributes
    ----------
    part : Part of the boat that carries the load.
    axes : Place on each axis of the term, in order.
    value, stderr, low, high : Value, standard error and 95 % interval (normal distribution).
    method : How it came about: runs, mirror, symmetry, a published value or a named estimate.
    quality : Most doubtful word of its runs.
    calibration : Group that multiplied it; empty in captive versions.
    runs : Runs it came from.
    place : Among the version's rows of the vehicle, in their order.
    """

    part: str
    axes: tuple[str, ...]
    value: str
    stderr: str
    low: str
    high: str
    method: str
    quality: str
    calibration: str
    runs: tuple[Run, ...]
    place: int


@dataclass(frozen=True)
class TermPage:
    """What the report says of one term: what it multiplies, its values, where it is drawn.

    Attributes
    ----------
    symbol, anchor, equation, load : Symbol, place in the page, equation numbers, and the load it stands for.
    note : Of the term table.
    axes : Headings of the axes with their units.
    values : Every tabulated value.
    figures : Anchor and title of each figure that draws it.
    """

    symbol: str
    anchor: str
    equation: str
    load: str
    note: str
    axes: tuple[str, ...]
    values: tuple[Value, ...]
    figures: tuple[tuple[str, str], ...]


def term_anchor(symbol: str) -> str:
    """Place of a term in the page, of letters that need no escape in an address.

    >>> term_anchor("Y_r|r|")
    'term-Y_r-r-'
    """
    return "term-" + re.sub(r"[^A-Za-z0-9_]", "-", symbol)


def number(x: float, digits: int = 5) -> str:
    """A number for people: significant digits, a minus sign, no signed zero.

    >>> number(-0.0000000001234)
    '\u22121.234e\u221210'
    >>> number(-0.0)
    '0'
    """
    return f"{x + 0.0:.{digits}g}".replace("-", "\N{MINUS SIGN}")


def runs_of(rows: pd.DataFrame, commit: Version) -> dict[str, Run]:
    """Every run that a version used or left out, by name.

    Parameters
    ----------
    rows : Database rows of the vehicle.
    commit : The commit that wrote them.
    """
    terms: dict[str, dict[str, None]] = {}
    for symbol, text in zip(rows["coefficient"], rows["runs"], strict=True):
        for name in text.split():
            terms.setdefault(name, {})[symbol] = None
    unused: dict[str, dict[str, list[str]]] = {}
    for one in stored_unused(commit):
        unused.setdefault(one.run_id, {}).setdefault(one.reason, []).append(one.output)
    stored = commit.stored("runs", {}) or {"files": [], "sources": [], "runs": {}}
    made: dict[str, Run] = {}
    for name in dict.fromkeys([*stored["runs"], *terms, *unused]):
        file, row, source = stored["runs"].get(name, (-1, 0, -1))
        made[name] = Run(
            name,
            f"run-{len(made) + 1}",
            stored["files"][file] if file >= 0 else "",
            row,
            stored["sources"][source] if source >= 0 else "",
            tuple(terms.get(name, ())),
            tuple(f"{' '.join(outputs)}: {reason}" for reason, outputs in unused.get(name, {}).items()),
        )
    return made


def _load(term: Term) -> str:
    """What a coefficient stands for, as an equation."""
    size = {"rho/2 L": f"\u00bd\u03c1L^{term.power}", "rho D": f"\u03c1D^{term.power}"}.get(term.norm, "")
    words = [w for w in (size, term.name, term.multiplier.replace("*", "\u00b7")) if w]
    return f"{term.output or term.name} = {' '.join(words)}" if term.output else f"{term.name}, the value itself"


def _method(row: Any) -> str:
    words = [_ORIGINS.get(row["origin"], row["origin"])]
    if row["estimated_by"]:
        words.append(f"estimated by {row['estimated_by']}")
    return "; ".join(words)


def _values(term: Term, rows: pd.DataFrame, runs: dict[str, Run]) -> Iterable[Value]:
    columns = [catalogue.axes()[a].column for a in term.axes]
    for place, row in zip(rows.index, records(rows, [*columns, *_SHOWN]), strict=True):
        half = _HALF_95 * row["stderr"]
        yield Value(
            part=row["part"],
            axes=tuple(number(row[c]) for c in columns),
            value=number(row["value"]),
            stderr=number(row["stderr"], 2),
            low=number(row["value"] - half, 4),
            high=number(row["value"] + half, 4),
            method=_method(row),
            quality=row["quality"],
            calibration=row["calibration"],
            runs=tuple(runs[name] for name in row["runs"].split()),
            place=int(place),
        )


def term_pages(
    terms: Sequence[Term], rows: pd.DataFrame, pictures: Sequence[Picture], runs: dict[str, Run]
) -> list[TermPage]:
    """A page for each term that has values.

    Parameters
    ----------
    terms : Of the vehicle's set.
    rows : Its database rows.
    pictures : Figures of the report.
    runs : From ``runs_of``.
    """
    headings = {
        name: f"{name} [{axis.unit}]" if axis.unit != "1" else f"{name} [-]" for name, axis in catalogue.axes().items()
    }
    drawn: dict[str, list[tuple[str, str]]] = {}
    for picture in pictures:
        for symbol in picture.caption.split(", "):
            drawn.setdefault(symbol, []).append((picture.anchor, picture.title))
    order = ["part", *axis_columns()]
    pages = []
    # Put in order together: those of a term stay as they would be by themselves.
    rows = rows[list(dict.fromkeys(["coefficient", *order, *_SHOWN]))].sort_values(order, kind="stable")
    for term in terms:
        of_term = rows[rows["coefficient"] == term.name]
        if of_term.empty:
            continue
        pages.append(
            TermPage(
                term.name,
                term_anchor(term.name),
                equations(term),
                _load(term),
                term.note,
                tuple(headings[a] for a in term.axes),
                tuple(_values(term, of_term, runs)),
                tuple(drawn.get(term.name, ())),
            )
        )
    return pages
