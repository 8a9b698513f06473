"""Coefficients beside each other and beside the boat's own size: a unit in one load of one test alone."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from ident.checks.findings import HULL, Evidence, Finding, Rule, check, printed_place
from ident.checks.lines import SLOPES
from ident.checks.physics import slope
from ident.checks.resistance import spheroid_diameter
from sim.boat.parts import vehicle_terms

# Value and standard error.
Known = Mapping[str, tuple[float, float]]
# Sizes of the boat among what is known, as parts of its length.
_SIZES = ("mass", "diameter", "draught", "propeller", "rudder_aspect")
# Norms of what is without a dimension.
_PRIME = ("rho/2 L", "")


@dataclass(frozen=True)
class Proportion:
    """One row of ``data/coefficient_proportions.csv``.

    Attributes
    ----------
    names : Coefficients of which the first known is judged.
    over : What it is divided by: sums and products of coefficients and of the boat's ``mass``, ``diameter``,
        ``draught``, ``propeller`` (its diameter) and ``rudder_aspect``, of which the first known is taken; nothing
        where the value itself is judged.
    low, high : Between which the quotient is.
    severity : Of a finding.
    sets : Term sets whose terms of that name are meant; all where there is none.
    printed : Whether it is asked of published values alone.
    basis : Where the limits are from.
    """

    names: tuple[str, ...]
    over: tuple[str, ...]
    low: float
    high: float
    severity: str
    sets: tuple[str, ...]
    printed: bool
    basis: str


@cache
def proportions() -> tuple[Proportion, ...]:
    """The rows of ``data/coefficient_proportions.csv``."""
    with (files("ident") / "data" / "coefficient_proportions.csv").open(encoding="utf-8") as stream:
        return tuple(
            Proportion(
                tuple(r["coefficient"].split()),
                tuple(r["over"].split()),
                float(r["low"]),
                float(r["high"]),
                r["severity"],
                tuple(r["sets"].split()),
                r["printed"] == "yes",
                r["basis"],
            )
            for r in csv.DictReader(stream)
        )


def evaluated(text: str, known: Known) -> tuple[float, float] | None:
    """Value and standard error of a sum of products of what is known; None where one is not.

    Examples
    --------
    >>> evaluated("X_udot-Z_wdot", {"X_udot": (-1.0, 0.0), "Z_wdot": (-31.0, 3.0)})
    (30.0, 3.0)
    >>> evaluated("mass*diameter*diameter", {"mass": (2.0, 0.0), "diameter": (0.1, 0.0)})
    (0.020000000000000004, 0.0)
    """
    total, variance = 0.0, 0.0
    for sign, product in re.findall(r"([+-]?)([^+-]+)", text):
        value, relative = -1.0 if sign == "-" else 1.0, 0.0
        for name in product.split("*"):
            if name not in known:
                return None
            one, error = known[name]
            value *= one
            relative = math.hypot(relative, error / one) if one else math.inf
        total += value
        variance += (value * relative) ** 2 if value else 0.0
    return total, math.sqrt(variance)


def _of_runs(evidence: Evidence) -> dict[str, tuple[float, float]]:
    """Slopes of the runs over an angle in prime form, for a boat whose coefficients have axes."""
    body, runs = evidence.body, evidence.runs
    assert body is not None
    hull = runs[runs["part"].isin(HULL)]
    found = {n: slope(hull[hull["test"] == test], angle, load, body) for test, angle, load, n in SLOPES}
    return {n: (v, 0.0) for n, v in found.items() if math.isfinite(v)}


def _known(evidence: Evidence) -> dict[str, tuple[float, float]]:
    """What is identified or published of hull and planes in 1/2 rho L^n, and the boat's size in the same form."""
    body, vehicle = evidence.body, evidence.vehicle
    assert body is not None
    assert vehicle is not None
    known: dict[str, tuple[float, float]] = {}
    if body.mass is not None:
        known["mass"] = body.mass / (0.5 * body.density * body.length**3), 0.0
        known["diameter"] = spheroid_diameter(body) / body.length, 0.0
    if body.draught is not None:
        known["draught"] = body.draught / body.length, 0.0
    if vehicle.propeller is not None:
        known["propeller"] = vehicle.diameter / body.length, 0.0
    if vehicle.rudder is not None:
        known["rudder_aspect"] = float(vehicle.rudder.height.value) ** 2 / float(vehicle.rudder.area.value), 0.0
    norms = {t.name: t.norm for t in vehicle_terms(vehicle)}
    if vehicle.terms_of.tabulated:
        known |= _of_runs(evidence)
    # Of a table the largest value.
    for table in (evidence.tabulated, evidence.constants):
        of_norm = table[table["coefficient"].map(norms).isin(_PRIME)] if table is not None and len(table) else None
        if of_norm is not None:
            of_norm = of_norm.sort_values("value", key=np.abs)
            rows = zip(of_norm["coefficient"], of_norm["value"], of_norm["stderr"], strict=True)
            known |= {str(n): (float(v), float(e)) for n, v, e in rows}
    return known


@check("proportion")
def coefficients_beside_each_other(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Quotients of coefficients, and of coefficients over the boat's size, beyond what boats have."""
    vehicle = evidence.vehicle
    if evidence.body is None or vehicle is None or evidence.runs.empty:
        return
    known = _known(evidence)
    for row in proportions():
        name = next((n for n in row.names if n in known), "")
        over, base = next(((o, e) for o in row.over if (e := evaluated(o, known)) is not None), ("", (1.0, 0.0)))
        if not name or (row.over and not over) or (row.sets and vehicle.term_set not in row.sets):
            continue
        place = printed_place(evidence.runs, [name])
        place = (evidence.body.file, []) if name in _SIZES else place
        if row.printed and not place[1]:
            continue
        # What is published is meant as it stands: its error excuses no sign and no unit.
        severity = beyond(row, known[name], base, rule.limits | ({"errors": 0.0} if place[1] else {}))
        if not severity:
            continue
        value = known[name][0]
        quotient = f" over {over.replace('*', ' ')} = {base[0]:.4g} is {value / base[0]:.3g}" if over else ""
        what = f"{name} = {value:.4g}{quotient}, boats have {row.low:g} to {row.high:g}: {row.basis}"
        yield rule.finding(place[0], place[1], ["value"] if place[1] else [name], what, severity)


def beyond(row: Proportion, value: tuple[float, float], base: tuple[float, float], limits: Mapping[str, float]) -> str:
    """Severity of a quotient beyond its limits by more than its errors explain; nothing inside.

    An error where it is beyond by the factor ``gross`` too; where a row is an error, a warning within
    the factor ``near``.
    """
    if not base[0] or not all(map(math.isfinite, (*value, *base))):
        return ""
    quotient, relative = value[0] / base[0], base[1] / abs(base[0])
    # A base that may be zero has no quotient.
    if limits["errors"] * relative >= 1.0:
        return ""
    of_value = value[1] / abs(value[0]) if value[0] else 0.0
    slack = limits["errors"] * math.hypot(value[1] / base[0], quotient * relative)
    # A large value with a large error is large all the same: towards zero errors are added, away from it they multiply.
    stretch = 1.0 + limits["errors"] * math.hypot(of_value, relative)
    low = row.low * stretch if row.low < 0.0 else row.low - slack
    high = row.high * stretch if row.high > 0.0 else row.high + slack
    if low <= quotient <= high:
        return ""
    edge = row.low if quotient < row.low else row.high
    away = quotient / edge if edge else math.inf
    if row.severity == "error" and 1.0 / limits["near"] <= away <= limits["near"]:
        return "warning"
    within = 1.0 / limits["gross"] <= away <= limits["gross"]
    return row.severity if within or away <= 0.0 or not edge else "error"
