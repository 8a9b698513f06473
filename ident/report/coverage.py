"""What a version knows of its vehicle: one line a term, with data or absent, and the words of quality of its points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ident.report.figures import equations
from ident.report.values import number
from sim.boat import catalogue
from sim.boat.catalogue import Term
from sim.boat.database import Version, axis_columns
from sim.boat.parts import parts_of, vehicle_terms
from sim.boat.vehicle import Vehicle

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class TermCoverage:
    """What a version has of one term.

    Attributes
    ----------
    symbol, group, part, equation, multiplier : Of the term; ``part`` counts them where there are several.
    tests : That identify it.
    measured, mirror, symmetry : Numbers of values by where they are from; all zero for an absent term.
    ranges : What the runs cover along each axis.
    quality, worst_points : Worst word of quality, and the number of values that have it.
    worst : Largest disagreement of runs of one value, in standard errors.
    rules, notes : How it goes on beyond the values, and what to know before trusting that.
    """

    symbol: str
    group: str
    part: str
    equation: str
    multiplier: str
    tests: str
    measured: int = 0
    mirror: int = 0
    symmetry: int = 0
    ranges: tuple[str, ...] = ()
    quality: str = ""
    worst_points: int = 0
    worst: float = 0.0
    rules: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    absent: bool = True


@dataclass(frozen=True)
class QualityWord:
    """A word of quality of a version.

    Attributes
    ----------
    word, meaning : As the campaign states them.
    factor : Of the standard errors; None where the commit does not say.
    points : Number of values whose worst word it is.
    """

    word: str
    factor: float | None
    meaning: str
    points: int


def _ranges(term: Term, rows: pd.DataFrame) -> list[str]:
    """What the runs cover along each axis, in database units."""
    ranges = []
    for name in term.axes:
        axis = catalogue.axes()[name]
        values = sorted(rows[axis.column].unique())
        unit = "" if axis.unit == "1" else f" {axis.unit}"
        if len(values) == 1:
            text = f"{number(values[0])}{unit} only"
        elif name == "D0":
            text = ", ".join(number(v) for v in values) + unit
        else:
            text = f"{number(values[0])} to {number(values[-1])}{unit} ({len(values)})"
        ranges.append(f"{name}: {text}")
    return ranges


def _notes(term: Term, rows: pd.DataFrame) -> list[str]:
    """What a reader should know before trusting the coefficient off its points."""
    columns = {a: c for c, a in axis_columns().items()}
    single = [a for a in term.axes if rows[columns[a]].nunique() == 1]
    notes = [f"one {a} only: used at every {a}" for a in single]
    if {"alpha", "beta"} <= set(term.axes) - set(single):
        both = (rows[columns["alpha"]] != 0.0) & (rows[columns["beta"]] != 0.0)
        if not both.any():
            notes.append("no run has alpha and beta together: superposed")
    if (rows["origin"] == "published").any():
        notes.append("given by the source as a coefficient, not by runs")
    elif not (rows["origin"] == "measured").any():
        notes.append("all from the partner plane's runs by the mirror")
    return notes


def coverage(vehicle: Vehicle, rows: pd.DataFrame, factors: dict[str, float]) -> list[TermCoverage]:
    """Every term of the vehicle's set, with data or absent.

    Parameters
    ----------
    vehicle : Decides the terms.
    rows : Database rows of it.
    factors : Of the standard errors, by word of quality, rising.
    """
    # Without the long texts of a version.
    rows = rows[["coefficient", "part", *axis_columns(), "origin", "quality", "worst_residual"]]
    return [_of_term(term, vehicle, rows[rows["coefficient"] == term.name], factors) for term in vehicle_terms(vehicle)]


def _of_term(term: Term, vehicle: Vehicle, rows: pd.DataFrame, factors: dict[str, float]) -> TermCoverage:
    parts = parts_of(term, vehicle)
    part = parts[0] if len(parts) == 1 else f"{rows['part'].nunique()} of {len(parts)} sections"
    named = (term.name, term.group, part, equations(term), term.multiplier or "1", " ".join(term.tests))
    if rows.empty:
        return TermCoverage(*named)
    origin = rows["origin"].value_counts()
    # In the order of the vocabulary: of words with one factor a set has any order.
    words = [q for q in factors if q in set(rows["quality"])]
    return TermCoverage(
        *named,
        measured=int(origin.get("measured", 0) + origin.get("published", 0)),
        mirror=int(origin.get("mirror", 0)),
        symmetry=int(origin.get("symmetry", 0)),
        ranges=tuple(_ranges(term, rows)),
        quality=words[-1] if words else "",
        worst_points=int((rows["quality"] == words[-1]).sum()) if words else 0,
        worst=float(rows["worst_residual"].max()),
        rules=tuple(f"{a}: {r}" for a, r in term.extrapolation.items()),
        notes=tuple(_notes(term, rows)),
        absent=False,
    )


def quality_words(commit: Version, rows: pd.DataFrame) -> list[QualityWord]:
    """Words of quality by rising factor, with the number of values behind each.

    Parameters
    ----------
    commit : That wrote the rows; holds the campaign's vocabulary.
    rows : Database rows.
    """
    known = commit.stored("quality", {})
    counts = rows["quality"].value_counts()
    words = sorted({*known, *(q for q in counts.index if q)}, key=lambda w: known.get(w, {}).get("factor", 1.0))
    words.sort(key=lambda w: (known.get(w, {}).get("factor", 1.0), list(known).index(w) if w in known else 0))
    return [
        QualityWord(w, said.get("factor"), said.get("meaning", "not in the commit's vocabulary"), int(counts.get(w, 0)))
        for w in words
        for said in [known.get(w, {})]
    ]
