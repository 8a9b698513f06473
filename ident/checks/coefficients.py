"""Coefficients, identified or published, against the sign and size that every boat's have."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ident.checks.findings import Evidence, Finding, Rule, check, printed_place
from sim.boat.parts import vehicle_terms

if TYPE_CHECKING:
    from ident.identification.identify import Identification

# In these the size is one of a boat; with a dimension only the sign is judged.
_DIMENSIONLESS = ("rho/2 L", "rho/2 Ld", "")


def constant_values(identified: Identification) -> pd.DataFrame:
    """Coefficients without an axis: columns coefficient, part, value, stderr; of any part of the boat."""
    errors = np.sqrt(np.diag(identified.covariance))
    every = zip(identified.nodes, identified.values, errors, strict=True)
    rows = [(n.name, n.part, float(v), float(e)) for n, v, e in every if not n.point]
    return pd.DataFrame(rows, columns=["coefficient", "part", "value", "stderr"])


def tabulated_values(identified: Identification) -> pd.DataFrame:
    """Coefficients with axes, a row a point: columns coefficient, part, value, stderr."""
    errors = np.sqrt(np.diag(identified.covariance))
    every = zip(identified.nodes, identified.values, errors, strict=True)
    rows = [(n.name, n.part, float(v), float(e)) for n, v, e in every if n.point]
    return pd.DataFrame(rows, columns=["coefficient", "part", "value", "stderr"])


@cache
def _ranges() -> dict[str, tuple[float, float, str]]:
    """Coefficient -> lowest and highest value, and why."""
    with (files("ident") / "data" / "possible_coefficients.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {n: (float(r["low"]), float(r["high"]), r["basis"]) for r in rows for n in r["coefficient"].split()}


@check("coefficient")
def values_a_boat_may_have(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Coefficients beyond their range by more than their errors explain: a sign, a unit of a rate, another row's."""
    values, vehicle, runs = evidence.constants, evidence.vehicle, evidence.runs
    if values is None or vehicle is None:
        return
    norms = {t.name: t.norm for t in vehicle_terms(vehicle)}
    thrust = bool(((runs["n"].fillna(0.0) != 0.0) & (runs["part"] == "hull") & runs["X"].notna()).any())
    tables = [t for t in (values, evidence.tabulated) if t is not None and len(t)]
    of_range = [t[t["coefficient"].isin(list(_ranges()))] for t in tables]
    for row in (row for t in of_range for row in t.to_dict("records")):
        name, part = str(row["coefficient"]), str(row["part"])
        value, error = float(row["value"]), float(row["stderr"])
        low, high, basis = _ranges()[name]
        if norms.get(name, "") not in _DIMENSIONLESS:
            low, high = -np.inf, 0.0 if high <= 0.0 else np.inf
        place = printed_place(runs, [name], part)
        # What is published is meant as it stands: its error excuses no sign.
        slack = 0.0 if place[1] else rule.limits["errors"] * error
        # What is left of the resistance beside a thrust says nothing.
        if (low - slack <= value <= high + slack) or (thrust and name.startswith("X_")):
            continue
        what = f"{name} ({part}) = {value:.4g} +- {error:.2g}, boats and ships have {low:g} to {high:g}: {basis}"
        yield rule.finding(place[0], place[1], ["value"] if place[1] else [name], what)


@check("fluid")
def water_or_air(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A density that neither water nor the air of a wind tunnel has."""
    body = evidence.body
    if body is None or evidence.campaign is None:
        return
    limits = rule.limits
    density = evidence.campaign.header.fluid.density_kgpm3
    water = limits["water_low"] <= density <= limits["water_high"]
    if not water and not limits["air_low"] <= density <= limits["air_high"]:
        what = f"density_kgpm3 = {density:g}, which neither water nor air has: every coefficient is off by its ratio"
        yield rule.finding("campaign.toml", [], ["density_kgpm3"], what)
