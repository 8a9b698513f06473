"""Checks of the resistance: against the friction of a plate, and straight ahead in every file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from ident.checks.findings import HULL, Array, Body, Evidence, Finding, Rule, check, kept, prime, rows_of, together
from sim.boat.catalogue import ACCELERATIONS
from sim.files.constants import constant
from sim.hull.slender import friction

_TESTS = ("towing", "drift_horizontal", "drift_vertical")
# Degrees of drift or incidence within which X is the resistance.
_AHEAD = math.radians(2.6)


def straight_ahead(runs: pd.DataFrame, widest: float = _AHEAD) -> pd.DataFrame:
    """Runs of the hull without drift, incidence, turn, acceleration or revolutions, whose X is used."""
    still = (runs[["p", "q", "r", *ACCELERATIONS, "n"]].fillna(0.0) == 0.0).all(axis=1)
    ahead = (runs[["alpha", "beta"]].fillna(0.0).abs() <= widest).all(axis=1)
    plane = runs["plane"].fillna(0.0) == 0.0
    moving = runs["U"].fillna(0.0) > 0.0
    return runs[runs["test"].isin(_TESTS) & runs["part"].isin(HULL) & still & ahead & plane & moving & kept(runs, "X")]


def spheroid_diameter(body: Body) -> float:
    """Diameter of the prolate spheroid of the body's length and volume [m]; of bodies with a known mass."""
    assert body.mass is not None
    return math.sqrt(6.0 * body.mass / body.density / (math.pi * body.length))


def wetted_surface(body: Body) -> float:
    """Surface of the prolate spheroid of the body's length and volume, about the least there is [m^2].

    Exact for a slender one, pi^2/4 L d; a hull with a parallel body, a sail and planes has more.
    """
    return 0.25 * math.pi**2 * body.length * spheroid_diameter(body)


def reynolds_tested(speed: Array, body: Body, ratio: float) -> Array:
    """Reynolds numbers over the length at the tested size, of speeds at full scale [m/s] and the scale's ratio."""
    return speed * body.length / constant("sea_water_viscosity") / ratio**1.5


@check("friction")
def resistance_over_friction(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Resistance below that of a flat plate of the same surface, or many times it, at the tested size."""
    body, campaign = evidence.body, evidence.campaign
    if body is None or body.mass is None or campaign is None:
        return
    if campaign.header.fluid.density_kgpm3 < rule.limits["water"]:
        return
    limits, ratio = rule.limits, campaign.header.scale.ratio
    runs = straight_ahead(evidence.runs)
    for file, group in runs.groupby(together(runs), sort=False):
        reynolds = reynolds_tested(group["U"].to_numpy(float), body, ratio)
        if not (reynolds > limits["reynolds"]).all():
            continue
        plate = np.array([friction(re) for re in reynolds])
        # A small model may keep its boundary layer laminar.
        least = np.where(reynolds < limits["turbulent"], limits["blasius"] / np.sqrt(reynolds), limits["least"] * plate)
        resistance = -prime(group, "X", body).to_numpy(float) * body.length**2 / wetted_surface(body)
        share = resistance / plate
        low, high = bool((resistance < least).all()), bool((share > limits["most"]).all())
        # The sign is the check `size`'s.
        if not (low or high) or not (resistance > 0.0).all():
            continue
        words = "less than the friction of a flat plate of that surface" if low else "more than a streamlined boat has"
        what = f"X is {float(np.median(share)):.2g} times the ITTC friction of the least surface of that length and "
        what += f"volume, {words}: the unit of speed or X, scale, density, or thrust in X?"
        none = low and bool((resistance < limits["none"] * plate).all())
        yield rule.finding(str(file), rows_of(group), ["X", "U"], what, "error" if none else "")


@check("between_tests")
def same_resistance(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """X straight ahead, from the towing test and from drift tests: what differs is a speed, a unit, a thrust."""
    body = evidence.body
    if body is None:
        return
    runs = straight_ahead(evidence.runs)
    values: list[tuple[str, str, pd.DataFrame, float]] = []
    for key, group in runs.groupby([together(runs), "test"], sort=False):
        file, test = str(key[0]), str(key[1])
        values.append((file, test, group, float(prime(group, "X", body).median())))
    if len(values) < 2:
        return
    base = max(values, key=lambda one: (one[1] == "towing", len(one[2])))
    for file, test, group, value in values:
        size = max(abs(value), abs(base[3]))
        if not size > 0.0 or abs(value - base[3]) <= rule.limits["share"] * size:
            continue
        error = (prime(group.assign(X=group["s_X"]), "X", body)).median()
        if abs(value - base[3]) <= rule.limits["errors"] * (error if math.isfinite(error) else 0.0):
            continue
        factor = value / base[3] if base[3] else math.inf
        what = f"X straight ahead is {value:.3g} (prime form) in {test} of {file}, {base[3]:.3g} in {base[1]} of "
        what += f"{base[0]}: a factor {factor:.2g}; the unit of speed or X?"
        far = not 1.0 / rule.limits["factor"] < factor < rule.limits["factor"]
        yield rule.finding(file, rows_of(group), ["X", "U"], what, "error" if far else "")


@check("between_tests")
def same_resistance_at_one_speed(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """X straight ahead at one speed and depth, from the towing test and from the drift tests of the same campaign.

    One model in one facility has one resistance, to what a degree or two of drift adds: a zero not taken off is seen
    long before it is half of X.
    """
    body = evidence.body
    if body is None:
        return
    runs = straight_ahead(evidence.runs)
    size = prime(runs, "X", body)
    error = prime(runs.assign(X=runs["s_X"].fillna(0.0)), "X", body)
    towed = runs["test"] == "towing"
    beside: dict[Any, tuple[float, float]] = {}
    for _, drifting in runs[~towed].groupby(["U", "D0"], sort=False):
        speed, depth = float(drifting["U"].iloc[0]), float(drifting["D0"].iloc[0])
        deep = (runs["D0"] - depth).abs() <= rule.limits["depth"] * abs(depth)
        same = runs.index[towed & deep & np.isclose(runs["U"], speed, rtol=1e-6)]
        if len(same):
            known = float(size[same].median()), float(error[same].median())
            beside |= dict.fromkeys(drifting.index, known)
    tested = runs.loc[list(beside)]
    for (file, test), group in tested.groupby([together(tested), "test"], sort=False):
        base, sigma = (pd.Series([beside[k][i] for k in group.index], group.index) for i in (0, 1))
        off, usual = float((size[group.index] - base).median()), float(base.abs().median())
        spread = math.hypot(float(error[group.index].median()), float(sigma.median()))
        if usual <= 0.0 or abs(off) <= max(rule.limits["ahead"] * usual, rule.limits["errors"] * spread):
            continue
        what = f"X of {test} straight ahead is off that of towing at the same speed by {100.0 * off / usual:+.3g} % of "
        what += "the resistance: a zero that was not taken off, or a thrust?"
        yield rule.finding(str(file), rows_of(group), ["X"], what)
