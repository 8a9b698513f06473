"""Checks of runs against physics: sizes, levers, inertia, scale, propeller curves."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from functools import cache
from importlib.resources import files

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.checks.findings import (
    NONE,
    Array,
    Body,
    Evidence,
    Finding,
    Rule,
    check,
    declared,
    kept,
    milder,
    prime,
    together,
)
from ident.identification.solver import Solver, check_levers
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.boat.parts import vehicle_terms

# Load component that answers each acceleration, and the moment of each cross force.
_ANSWERS = dict(zip(ACCELERATIONS, OUTPUTS, strict=True))
_IN_PLANE = {"drift_horizontal": ("beta", "Y", "N", 1.0), "drift_vertical": ("alpha", "Z", "M", -1.0)}


@cache
def _sizes() -> list[dict[str, str]]:
    with (files("ident") / "data" / "prime_sizes.csv").open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def slope(runs: pd.DataFrame, over: str, output: str, body: Body) -> float:
    """Least-squares slope of a dimensionless load over an angle [1/rad]; NaN without three angles."""
    y = prime(runs, output, body).where(kept(runs, output))
    x = runs[over].where(y.notna())
    if x.nunique() < 3:
        return math.nan
    x, y = x - x.mean(), y - y.mean()
    return float((x * y).sum() / (x * x).sum())


@check("size")
def prime_sizes(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Dimensionless resistance and slopes over the flow angles, file by file."""
    body = evidence.body
    if body is None:
        return
    planes = [p.name for p in evidence.vehicle.planes] if evidence.vehicle else []
    for size in _sizes():
        parts = planes if size["over"] == "plane" else ["", "hull"]
        runs = evidence.runs[(evidence.runs["test"] == size["test"]) & evidence.runs["part"].isin(parts)]
        if size["test"] == "towing":
            # Beside a thrust the sign says nothing.
            runs = runs[runs["n"].fillna(0.0) == 0.0]
        low, high, output = float(size["low"]), float(size["high"]), size["output"]
        for file, group in runs.groupby(together(runs), sort=False):
            values = prime(group, output, body).where(kept(group, output))
            value = slope(group, size["over"], output, body) if size["over"] else float(values.median())
            if size["sign"] and value * float(size["sign"]) < -low:
                what = f"{size['quantity']} is {value:.3g}: it pulls the body along, as no water does"
                yield rule.finding(str(file), [], [output], what + "; the sign of the load, or of the angle?")
                continue
            value = abs(value)
            # A plane whose force along one axis is small is turned the other way, not too small.
            if not value > 0.0 or ((low <= value or bool(planes and parts == planes)) and value <= high):
                continue
            powers = [10.0**p for p in range(-4, 5) if p and low <= value / 10.0**p <= high]
            off = f"; {' or '.join(f'{p:g}' for p in powers)} times too large would be in it" if powers else ""
            what = f"{size['quantity']} is {value:.3g}, boats and ships have {low:g} to {high:g}{off}"
            yield rule.finding(str(file), [], [output], what)


@check("size")
def published_sizes(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Published coefficients: the ranges of the slopes, and no coefficient of order one in 1/2 rho L^n."""
    runs = evidence.runs
    if "coefficient" not in runs or "value" not in runs or evidence.vehicle is None:
        return
    ranges = {s["coefficient"]: (float(s["low"]), float(s["high"])) for s in _sizes() if s["coefficient"]}
    norms = {t.name: t.norm for t in vehicle_terms(evidence.vehicle)}
    given = runs[runs["coefficient"].isin(list(norms)) & kept(runs, "value") & (runs["value"] != 0.0)]
    for _, run in given[given["coefficient"].map(norms) == "rho/2 L"].iterrows():
        name, value = str(run["coefficient"]), abs(float(run["value"]))
        low, high = ranges.get(name, (0.0, rule.limits["published"]))
        if low <= value <= high:
            continue
        what = f"{name} = {run['value']:.4g} in 1/2 rho L^n, boats and ships have {low:g} to {high:g}: "
        what += "a value with a dimension, of another normalisation, per degree, or times a power of ten?"
        yield rule.finding(str(run["file"]), [int(run["row"])], ["value"], what)


# -- levers ------------------------------------------------------------------------------


@check("levers")
def plane_levers(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Moments of a plane or propeller against its forces and where it is."""
    body, vehicle = evidence.body, evidence.vehicle
    if body is None or vehicle is None:
        return
    places = {p.name: np.asarray(p.position) for p in vehicle.planes}
    for (part, file), group in evidence.runs.groupby(["part", "file"], sort=False):
        if part not in places:
            continue
        forces = group[["X", "Y", "Z"]].fillna(0.0).to_numpy()
        moments = group[["K", "M", "N"]].to_numpy()
        made = np.cross(places[str(part)], forces)
        wrong = np.abs(moments - made)
        allowed = rule.limits["share"] * body.length * np.linalg.norm(forces, axis=1)
        given = np.column_stack([kept(group, o) for o in "KMN"])
        bad = given & (wrong > allowed[:, None]) & (moments != 0.0)
        if bad.any():
            row, column = np.unravel_index(int(np.where(bad, wrong / allowed[:, None], 0.0).argmax()), bad.shape)
            name = "KMN"[column]
            what = f"{name} = {moments[row, column]:.4g} of run {group['run_id'].iloc[row]}, but force and place of "
            what += f"{part} give {made[row, column]:.4g}; {int(bad.any(axis=1).sum())} of {len(group)} runs"
            columns = [o for o, any_ in zip("KMN", bad.any(axis=0), strict=True) if any_]
            known = bool(declared(evidence, group[bad.any(axis=1)]).all())
            # No word for the quality of a run says that its loads act elsewhere: a unit does.
            sure = given & (np.abs(made) > allowed[:, None])
            severity = "error" if _other_unit(moments, made, sure, rule.limits["unit"]) else milder(rule, known)
            yield rule.finding(str(file), group["row"][bad.any(axis=1)], columns, what, severity)


def _other_unit(moments: Array, made: Array, sure: NDArray[np.bool_], factor: float) -> bool:
    """Whether moments about some axis are, in the median, so many times what forces and places make, or a part."""
    for column in range(3):
        of = sure[:, column] & (moments[:, column] != 0.0)
        if of.any():
            ratio = float(np.median(np.abs(moments[of, column] / made[of, column])))
            if not 1.0 / factor <= ratio <= factor:
                return True
    return False


@check("levers")
def hull_levers(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Hull moments against lift on the hull plus the Munk moment; propeller levers."""
    body = evidence.body
    if body is None:
        return
    runs = evidence.runs
    mass = body.mass if body.mass is not None else math.inf
    for moment, force, angle in (("N", "Y", "beta"), ("M", "Z", "alpha")):
        still = (runs[["p", "q", "r", *ACCELERATIONS]].fillna(0.0) == 0.0).all(axis=1)
        hull = runs["part"].isin(["hull", ""]) & (
            runs["test"] == f"drift_{'horizontal' if angle == 'beta' else 'vertical'}"
        )
        swung = 0.5 * mass * runs["U"] ** 2 * np.sin(2.0 * runs[angle].fillna(0.0)).abs()
        largest = rule.limits["hull"] * body.length * runs[force].abs() + rule.limits["munk"] * swung
        floor = (
            rule.limits["share"]
            * body.length
            * runs.groupby(["file", "test"])[force].transform(lambda loads: loads.abs().max())
        )
        propeller = runs["part"] == "propeller"
        beyond = runs[moment].abs() > np.where(
            propeller, rule.limits["hull"] * body.length * runs[force].abs(), largest + floor
        )
        bad = beyond & kept(runs, moment) & kept(runs, force) & ((hull & still) | propeller)
        for file, group in runs[bad].groupby("file", sort=False):
            first = group.iloc[0]
            lever = first[moment] / first[force] if first[force] else math.inf
            what = (
                f"{moment} = {first[moment]:.4g} with {force} = {first[force]:.4g} in run {first['run_id']}: a lever "
            )
            what += f"of {abs(lever):.3g} m on a body of {body.length:g} m, more than its Munk moment explains"
            yield rule.finding(str(file), group["row"], [moment, force], what)


@check("levers")
def section_levers(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Levers of sections in the runs against those of the vehicle file."""
    if evidence.campaign is None:
        return
    solver = Solver(evidence.campaign)
    check_levers(solver)
    runs = evidence.runs
    rows = {name: k for k, name in reversed(list(enumerate(runs["run_id"])))} if solver.warnings else {}
    for one in solver.warnings:
        of_section = runs.iloc[rows[one.subject]]
        yield rule.finding(str(of_section["file"]), [of_section["row"]], ["x", "y", "z"], one.message)


@check("angle_name")
def drift_or_rudder(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A drift angle whose load acts where only a stern plane's does."""
    body = evidence.body
    if body is None:
        return
    for test, (angle, force, moment, sense) in _IN_PLANE.items():
        runs = evidence.runs[(evidence.runs["test"] == test) & evidence.runs["part"].isin(["hull", ""])]
        for file, group in runs.groupby("file", sort=False):
            lift = slope(group, angle, force, body)
            lever = sense * slope(group, angle, moment, body) / lift if lift else math.nan
            if rule.limits["stern"] < lever < rule.limits["aft"]:
                what = f"{force} over {angle} acts at x = {lever:.2f} L, where a stern plane is: "
                what += f"is {angle} the plane angle?"
                yield rule.finding(str(file), group["row"], [angle], what)


# -- inertia -----------------------------------------------------------------------------


def apparent_inertia(evidence: Evidence) -> Iterator[tuple[str, str, pd.DataFrame, float]]:
    """File, acceleration, runs and apparent added inertia -load/acceleration of the whole body.

    Loads of parts in one state are added; least squares through the origin over the
    accelerations, with every run of its file accelerated along one axis only. What the two sides of an
    oscillation have in common is no load of the acceleration, nor is the resistance of a boat with way on.
    """
    if "apparent inertia" not in evidence.memo:
        evidence.memo["apparent inertia"] = list(_apparent_inertia(evidence.runs))
    yield from evidence.memo["apparent inertia"]


def _apparent_inertia(runs: pd.DataFrame) -> Iterator[tuple[str, str, pd.DataFrame, float]]:
    moving = runs[list(ACCELERATIONS)].fillna(0.0) != 0.0
    for acceleration, output in _ANSWERS.items():
        alone = runs[moving[acceleration] & (moving.sum(axis=1) == 1) & kept(runs, output)]
        alone = alone.assign(**{output: _of_acceleration(alone, acceleration, output)})
        for file, group in alone[alone[output].notna()].groupby("file", sort=False):
            # Repeated runs of a part are one load of it; the parts make the whole.
            parts = group.groupby([acceleration, group["D0"].fillna(0.0), "part"])[output].mean()
            whole = parts.groupby(level=[0, 1]).sum().reset_index()
            whole = whole if group["part"].nunique() > 1 else group
            x, y = whole[acceleration].to_numpy(float), whole[output].to_numpy(float)
            if not x @ x > 0.0:
                continue
            yield str(file), acceleration, group, -float(x @ y / (x @ x))


def _of_acceleration(runs: pd.DataFrame, acceleration: str, output: str) -> pd.Series:
    """A load less what the opposed instants of an oscillation have in common; NaN where resistance is in it."""
    cycle = runs["file"].astype(str) + "/" + runs["run_id"].astype(str).str.extract(r"^(.*)[+-]a$")[0]
    opposed = cycle.notna() & (cycle.groupby(cycle).transform("size") == 2)
    load = runs[output] - runs.groupby(cycle)[output].transform("mean").where(opposed, 0.0)
    way = (acceleration == "udot") & (runs["U"].fillna(0.0) > 0.0) & ~opposed
    if not opposed.any():
        return load.mask(way)
    # A body that swings about an axis on a straight path has the load of its angle in it.
    ends = runs.loc[opposed, ["alpha", "beta"]].fillna(0.0).groupby(cycle[opposed])
    swung = ((ends.transform("max") - ends.transform("min")) > NONE).any(axis=1)
    return load.mask(way | swung.reindex(runs.index, fill_value=False))


@check("inertia_sign")
def loads_along_acceleration(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Acceleration tests whose load pushes along the acceleration."""
    for file, acceleration, group, inertia in apparent_inertia(evidence):
        output = _ANSWERS[acceleration]
        single = group[(group[output] * group[acceleration] > 0.0) & (group["part"].nunique() == 1)]
        if inertia < 0.0:
            what = f"{output} goes with {acceleration}: an added inertia of {inertia:.4g}, below zero"
            yield rule.finding(file, group["row"], [output, acceleration], what)
        elif not single.empty:
            what = f"{output} pushes along {acceleration} in run {single['run_id'].iloc[0]}, against the other runs"
            yield rule.finding(file, single["row"], [output, acceleration], what)


@check("inertia_left_in")
def mass_in_the_loads(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Apparent added inertia near that of body plus water."""
    body = evidence.body
    if body is None or body.mass is None:
        return
    inertia = body.inertia or (math.nan,) * 3
    of_body = dict(zip(ACCELERATIONS, (*(body.mass,) * 3, *inertia), strict=True))
    for file, acceleration, group, apparent in apparent_inertia(evidence):
        ratio = apparent / of_body[acceleration]
        if not ratio > rule.limits[acceleration[0]]:
            continue
        output, rest = _ANSWERS[acceleration], ratio - 1.0
        kind = "mass" if acceleration[0] in "uvw" else "moment of inertia"
        what = f"{output} over {acceleration} is {ratio:.2f} of the body's own {kind}; "
        if (
            rest >= (rule.limits["least"] if acceleration[0] in "vwqr" else 0.0)
            and rest <= rule.limits[acceleration[0]]
        ):
            what += (
                f"with it subtracted {rest:.2f} is left, as for added inertia: the model's own inertia is in the load"
            )
        else:
            what += "no slender body has that added inertia: scale, unit or inertia of the rig?"
        yield rule.finding(file, group["row"], [output, acceleration], what)


@check("scale")
def one_length(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Tested length at full scale against the vehicle's."""
    body, tested = evidence.body, evidence.tested_length
    if body is None or tested is None or abs(tested / body.length - 1.0) <= rule.limits["share"]:
        return
    ratio = tested / body.length
    forces, moments = ratio**2, ratio**3
    what = f"loads of a body of {tested:.5g} m, particulars of one of {body.length:.5g} m: "
    what += f"dimensionless forces off by a factor {forces:.3g}, moments by {moments:.3g}, masses by {moments:.3g}"
    yield rule.finding(body.file, [], ["length"], what)


# -- propeller ---------------------------------------------------------------------------


def _plausible(j: np.ndarray, kt: np.ndarray, kq: np.ndarray, rule: Rule) -> bool:
    """True for KT and KQ a propeller can have: KT at the lowest J and the best efficiency."""
    efficiency = float(np.max(j * kt / (2.0 * np.pi * kq)))
    low = rule.limits["kt_low"] <= kt[int(np.argmin(j))] <= rule.limits["kt_high"]
    return bool(low and rule.limits["eta_low"] <= efficiency <= rule.limits["eta_high"])


@check("open_water")
def thrust_that_rises(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """KT and KQ of one curve fall as the propeller advances; a torque turns with the thrust."""
    runs = evidence.runs
    ahead = runs[(runs["J"] >= 0.0) & (runs["test"] == "open_water")]
    for file, group in ahead.groupby("file", sort=False):
        curve = group.sort_values("J")
        for name in ("KT", "KQ"):
            given = curve[kept(curve, name)]
            value, error = given[name].to_numpy(float), given[f"s_{name}"].fillna(0.0).to_numpy(float)
            if not len(value):
                continue
            slack = rule.limits["rises"] * float(np.abs(value).max()) + 3.0 * error[1:]
            rises = np.flatnonzero(value[1:] > np.minimum.accumulate(value)[:-1] + slack)
            turns = (given["KT"] > 0.0) & (given["KQ"] <= 0.0) & (name == "KQ")
            against = np.flatnonzero(turns)
            if not len(rises) and not len(against):
                continue
            at = given.iloc[int(rises[0]) + 1 if len(rises) else int(against[0])]
            how = "more than at a lower J" if len(rises) else "against the torque that its thrust needs"
            what = f"{name} = {at[name]:.4g} at J = {at['J']:g} in run {at['run_id']}, {how}"
            yield rule.finding(str(file), [int(at["row"])], [name], what)


@check("open_water")
def thrust_off_the_curve(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """KT and KQ between their neighbours in J: a curve of a propeller has no step."""
    runs = evidence.runs
    ahead = runs[(runs["J"] >= 0.0) & (runs["test"] == "open_water")]
    for file, group in ahead.groupby("file", sort=False):
        for name in ("KT", "KQ"):
            given = group[kept(group, name)].sort_values("J")
            j, value = given["J"].to_numpy(float), given[name].to_numpy(float)
            if len(j) < 4 or np.unique(j).size < len(j):
                continue
            # A parabola through the four nearest others, which a propeller's curve is within a few per cent.
            off = np.array([value[i] - _through_others(j, value, i) for i in range(len(j))])
            error = given[f"s_{name}"].fillna(0.0).to_numpy(float)
            far = np.abs(off) > rule.limits["step"] * np.abs(value).max() + 3.0 * error
            if far.any():
                worst = int(np.abs(off).argmax())
                at = given.iloc[worst]
                what = f"{name} = {at[name]:.4g} at J = {at['J']:g} in run {at['run_id']} (or a neighbour's), "
                what += f"{off[worst]:+.2g} off the curve through the others"
                yield rule.finding(str(file), [int(at["row"])], [name], what, "warning")


def _through_others(j: np.ndarray, value: np.ndarray, i: int) -> float:
    """A parabola through the four points nearest to one of them, at it; a straight line through three."""
    near = np.argsort(np.abs(j - j[i]), kind="stable")
    near = near[near != i][:4]
    apart = j[near] - j[i]
    # Advances that are one to all digits leave a mean.
    powers = np.vander(apart / (np.abs(apart).max() or 1.0), 3 if len(near) > 3 else 2)
    return float(np.linalg.lstsq(powers, value[near], rcond=None)[0][-1])


@check("open_water")
def one_advance(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Speed and revolutions beside the advance coefficient: J = U/(nD), whatever the size of the model."""
    runs = evidence.runs
    spun = runs[
        (runs["test"] == "open_water") & (runs["n"].fillna(0.0) != 0.0) & runs["U"].notna() & (runs["J"] != 0.0)
    ]
    for file, group in spun.groupby("file", sort=False):
        diameter = (group["U"] / group["n"] / group["J"]).to_numpy(float)
        usual = float(np.median(diameter))
        off = np.abs(diameter / usual - 1.0) > rule.limits["advance"]
        if off.any():
            at = group.iloc[int(off.argmax())]
            what = f"U/(n J) is {diameter[off][0]:.4g} m at J = {at['J']:g}, the diameter in most rows {usual:.4g} m"
            yield rule.finding(str(file), group["row"][off], ["J", "U", "n"], what)


@check("open_water")
def propeller_factors(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """KT and KQ against bollard thrust and efficiency, with factors of ten that would mend them."""
    runs = evidence.runs
    curve = runs[runs["J"].notna() & (runs["KT"] > 0.0) & (runs["KQ"] > 0.0)]
    for file, group in curve.groupby("file", sort=False):
        j, kt, kq = (group[c].to_numpy(float) for c in ("J", "KT", "KQ"))
        if group["J"].max() <= 0.0 or _plausible(j, kt, kq, rule):
            continue
        powers = [(a, b) for a in range(-1, 4) for b in range(-1, 4) if _plausible(j, kt / 10.0**a, kq / 10.0**b, rule)]
        best = float(np.max(j * kt / (2.0 * np.pi * kq)))
        what = f"KT = {kt[int(np.argmin(j))]:.4g} at J = {j.min():g}, best efficiency {best:.2g}"
        if powers:
            a, b = min(powers, key=lambda p: abs(p[0]) + abs(p[1]))
            names = [f"{n} x {10.0**p:g}" for n, p in (("KT", a), ("KQ", b)) if p]
            what += f": the columns are {' and '.join(names)}"
        else:
            what += ": no propeller, whatever power of ten is taken out"
        yield rule.finding(str(file), group["row"], ["KT", "KQ"], what)
