"""Checks for zero readings left in the loads: constants that neither symmetry nor the square of the speed allows."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pandas as pd

from ident.checks.findings import (
    HULL,
    Array,
    Body,
    Evidence,
    Finding,
    Rule,
    check,
    declared,
    dynamic,
    kept,
    milder,
    rows_of,
    together,
)
from ident.checks.resistance import reynolds_tested, straight_ahead
from sim.boat.catalogue import ACCELERATIONS
from sim.hull.slender import friction

# Test -> motion that alone makes the loads that symmetry forbids without it.
_ODD = {"drift_horizontal": "beta", "rotating_arm": "r"}
_STATES = ("alpha", "beta", "p", "q", "r", *ACCELERATIONS)


@check("zero_reading")
def constant_beside_an_odd_load(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Y, K, N = b x + c x|x| + d x^3 in prime form, and a constant load beside them."""
    body = evidence.body
    if body is None:
        return
    for test, motion in _ODD.items():
        others = [s for s in _STATES if s != motion]
        runs = evidence.runs
        alone = (runs[others].fillna(0.0).abs() < math.radians(0.1)).all(axis=1)
        runs = runs[(runs["test"] == test) & alone & runs["part"].isin(HULL) & (runs["U"].fillna(0.0) > 0.0)]
        runs = runs.assign(**{motion: runs[motion].fillna(0.0)})
        for file, group in runs.groupby(together(runs), sort=False):
            for output in "YN":
                found = _left(group[kept(group, output)], motion, output, body, rule)
                if found:
                    known = bool(declared(evidence, group).all())
                    yield rule.finding(str(file), rows_of(group), [output], found, milder(rule, known))


def _left(group: pd.DataFrame, motion: str, output: str, body: Body, rule: Rule) -> str:
    """What was found of a constant in an odd load, in words; nothing where there is none, or too few runs."""
    x = group[motion].to_numpy(float) * (body.length / group["U"].to_numpy(float) if motion == "r" else 1.0)
    sizes = np.unique(np.abs(x).round(6))
    # Both sides show a constant by themselves; one side only beside a curve that leaves degrees of freedom.
    sides = x.size > 0 and x.min() < 0.0 < x.max()
    if x.size < 5 or (sizes.size < 5 and not (sides and sizes.size >= 2)):
        return ""
    load, pressure = group[output].to_numpy(float), dynamic(group, body).to_numpy(float)
    curve = [x, x * np.abs(x), x**3][: max(1, min(3, sizes.size - 2))]
    design = np.column_stack([*curve, 1.0 / pressure])
    error = group[f"s_{output}"].fillna(0.0).to_numpy(float) / pressure
    value, sigma = _last(design, load / pressure, error)
    largest = float(np.abs(load).max())
    if not abs(value) > max(rule.limits["share"] * largest, rule.limits["errors"] * sigma):
        return ""
    return (
        f"{output} has a constant of {value:.4g} +- {sigma:.2g} N{'' if output in 'XYZ' else ' m'} beside what grows "
        f"with {motion}, {100.0 * abs(value) / largest:.2g} % of the largest"
    )


def _last(design: Array, values: Array, error: Array) -> tuple[float, float]:
    """The last unknown of a least-squares fit and its standard error, from stated errors and scatter."""
    scale = np.abs(design).max(axis=0)
    if not (np.isfinite(design).all() and np.isfinite(values).all() and (scale > 0.0).all()):
        return 0.0, math.inf
    inverse = np.linalg.pinv(design / scale)
    found = inverse @ values
    left = values - design / scale @ found
    free = len(values) - design.shape[1]
    spread = math.sqrt(float(left @ left) / free) if free > 0 else math.inf
    sigma = np.maximum(error, spread)
    return float(found[-1] / scale[-1]), float(np.sqrt((inverse[-1] ** 2) @ sigma**2) / scale[-1])


@check("zero_reading")
def means_of_oscillations(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Y, K and N that the two sides of a sway, roll or yaw have in common: the mean, which symmetry leaves nothing."""
    runs = evidence.runs[evidence.runs["part"].isin(HULL)]
    phases = runs["run_id"].astype(str).str.extract(r"^(?P<cycle>.*)[+-]a$")["cycle"]
    ends = runs[phases.notna() & (runs[["alpha", "beta"]].fillna(0.0).abs() < math.radians(0.1)).all(axis=1)]
    ends = ends.assign(cycle=phases[ends.index])
    ends = ends[(ends[["udot", "wdot", "qdot"]].fillna(0.0) == 0.0).all(axis=1)]
    if ends.empty:
        return
    swung = runs[runs["run_id"].astype(str).str.contains(r"[+-][av]$")]
    for file, group in ends.groupby(together(ends), sort=False):
        for output in "YKN":
            given = group[kept(group, output)]
            sides = given.groupby("cycle")[output]
            common = sides.mean()[sides.size() == 2].abs()
            largest = float(swung.loc[together(swung) == file, output].abs().max())
            if common.empty or not largest > 0.0 or float(common.max()) <= rule.limits["mean"] * largest:
                continue
            worst = str(common.idxmax())
            error = float(given.loc[given["cycle"] == worst, f"s_{output}"].fillna(0.0).mean())
            if float(common.max()) <= rule.limits["errors"] * error / math.sqrt(2.0):
                continue
            what = f"{output} of oscillation {worst} has {common.max():.4g} on both sides, "
            what += f"{100.0 * common.max() / largest:.2g} % of the largest: a mean, or a second harmonic, that a "
            what += "symmetric hull does not have"
            rows = given.loc[given["cycle"] == worst, "row"].unique()
            yield rule.finding(str(file), rows if given["file"].nunique() == 1 else [], [output], what)


@check("zero_reading")
def constant_beside_the_square_of_the_speed(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """X, Z and M straight ahead at several speeds: c U^2, X with the friction line, and a constant beside it."""
    body, campaign = evidence.body, evidence.campaign
    if body is None or campaign is None:
        return
    runs = straight_ahead(evidence.runs, math.radians(0.1))
    # Waves that the boat makes do not go with the square of its speed.
    runs = runs[runs["D0"].fillna(0.0) > rule.limits["deep"] * body.length]
    for key, group in runs.groupby([together(runs), runs["D0"].round(6)], sort=False):
        speed = group["U"].to_numpy(float)
        if np.unique(speed.round(6)).size < 3 or speed.max() < rule.limits["speeds"] * speed.min():
            continue
        for output in "XZM":
            given = group[kept(group, output)]
            found = _beside_square(given, output, body, campaign.header.scale.ratio, rule) if len(given) > 2 else ""
            if found:
                yield rule.finding(str(key[0]), rows_of(given), [output, "U"], found)


def _beside_square(group: pd.DataFrame, output: str, body: Body, ratio: float, rule: Rule) -> str:
    speed, load = group["U"].to_numpy(float), group[output].to_numpy(float)
    plate = np.array([friction(max(re, 1e3)) for re in reynolds_tested(speed, body, ratio)])
    error = group[f"s_{output}"].fillna(0.0).to_numpy(float) / speed**2
    # A resistance is between the friction line and the square of the speed: a constant is one beside both.
    found = []
    for growth in (np.ones(speed.size), plate)[: 2 if output == "X" else 1]:
        found.append(_last(np.column_stack([growth, 1.0 / speed**2]), load / speed**2, error))
    value, sigma = min(found, key=lambda one: abs(one[0]))
    smallest = float(np.abs(load[speed == speed.min()]).max())
    one_sign = all(v * value > 0.0 for v, _ in found)
    if not one_sign or not abs(value) > max(rule.limits["least"] * smallest, rule.limits["errors"] * sigma):
        return ""
    unit = "N" if output in "XYZ" else "N m"
    return (
        f"{output} straight ahead has a constant of {value:.4g} +- {sigma:.2g} {unit} beside what grows with U^2, "
        f"{100.0 * abs(value) / smallest:.3g} % of the load at the lowest speed"
    )
