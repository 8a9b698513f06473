"""Checks against potential flow: the Munk moment, reciprocal added inertia; and which way the loads of a turn act."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np
import pandas as pd

from ident.checks.findings import HULL, Body, Evidence, Finding, Rule, check, kept, printed_place, rows_of, together
from ident.checks.physics import apparent_inertia, slope
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.boat.parts import vehicle_terms
from sim.hull.slender import spheroid

# An angle of flow below this is none [rad].
_STRAIGHT = math.radians(0.5)
# Test, angle, force, moment, sense in which the Munk moment turns the bow away from the flow; added mass across.
_PLANES = (
    ("drift_horizontal", "beta", "Y", "N", -1.0, "vdot", "v"),
    ("drift_vertical", "alpha", "Z", "M", 1.0, "wdot", "w"),
)


def munk(
    body: Body, limits: Mapping[str, float], across: float | None = None, along: float = 0.0
) -> tuple[float, bool]:
    """Munk moment over the angle, (m_across - m_along) in prime form, and whether it rests on measured added mass.

    Parameters
    ----------
    body : For length, density and displaced mass.
    limits : Of the check ``munk``: ``lightest`` and ``heaviest``, shares of the body's mass between which a measured
        added mass is believed.
    across, along : Measured added masses [kg]; without the first, those of the spheroid of the same volume and length.
    """
    unit = 0.5 * body.density * body.length**3
    assert body.mass is not None
    if across is not None and limits["lightest"] * body.mass < across < limits["heaviest"] * body.mass:
        return (across - along) / unit, True
    volume = body.mass / body.density
    diameter = math.sqrt(6.0 * volume / (math.pi * body.length))
    if diameter >= body.length:
        return 0.0, False
    k_along, k_across, _ = spheroid(body.length, diameter)
    return (k_across - k_along) * body.mass / unit, False


@check("munk")
def moments_against_the_munk_moment(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A moment of the other sign than potential flow gives, by more than the whole side force at the stern."""
    body = evidence.body
    if body is None or body.mass is None:
        return
    masses = {a: mass for _, a, _, mass in apparent_inertia(evidence)}
    for test, angle, force, moment, sense, across, velocity in _PLANES:
        potential, measured = munk(body, rule.limits, masses.get(across), max(masses.get("udot", 0.0), 0.0))
        certain = rule.limits["measured" if measured else "spheroid"] * potential
        for file, rows, lift, turn in _slopes(evidence, test, angle, force, moment, velocity):
            away = sense * turn
            most = rule.limits["most"] * potential + rule.limits["bow"] * abs(lift)
            if measured and away > most:
                what = f"{moment} over {angle} is {turn:.3g} (prime form, per radian) with {force} of {lift:.3g}: more "
                what += f"than potential flow ({sense * potential:.3g}) and a part of {force} at the bow turn it by; "
                what += "moment point, or the unit of speed or moment?"
                yield rule.finding(file, rows, [moment, angle], what, "warning")
                continue
            if away >= certain - rule.limits["stern"] * abs(lift) - rule.limits["share"] * abs(turn):
                continue
            what = (
                f"{moment} over {angle} is {turn:.3g} (prime form, per radian) with {force} of {lift:.3g}: potential "
            )
            what += f"flow turns the bow away from the flow ({sense * potential:.3g}), and all of {force} at the stern "
            what += f"would leave {sense * (certain - rule.limits['stern'] * abs(lift)):.2g}"
            yield rule.finding(file, rows, [moment, angle], what)


def _slopes(
    evidence: Evidence, test: str, angle: str, force: str, moment: str, velocity: str
) -> Iterator[tuple[str, list[int], float, float]]:
    """File, rows, and slopes of force and moment over an angle: of the runs of each file, and as published."""
    body, runs = evidence.body, evidence.runs
    assert body is not None
    of_test = runs[(runs["test"] == test) & runs["part"].isin(HULL)]
    for file, group in of_test.groupby(together(of_test), sort=False):
        lift, turn = slope(group, angle, force, body), slope(group, angle, moment, body)
        if math.isfinite(lift) and math.isfinite(turn):
            yield str(file), rows_of(group), lift, turn
    if of_test.empty and evidence.constants is not None and evidence.vehicle is not None:
        known = hull_constants(evidence)
        names = [next((n for n in (f"{o}_{velocity}", f"{o}_u{velocity}") if n in known), "") for o in (force, moment)]
        if all(names):
            yield "published coefficients", [], known[names[0]][0], known[names[1]][0]


def hull_constants(evidence: Evidence) -> dict[str, tuple[float, float]]:
    """Coefficients of the hull in 1/2 rho L^n with their standard errors."""
    assert evidence.constants is not None
    assert evidence.vehicle is not None
    norms = {t.name: t.norm for t in vehicle_terms(evidence.vehicle)}
    table = evidence.constants
    table = table[table["part"].isin(HULL) & table["coefficient"].map(norms).eq("rho/2 L")]
    return {
        str(n): (float(v), float(e))
        for n, v, e in zip(table["coefficient"], table["value"], table["stderr"], strict=True)
    }


# Force, moment, acceleration across, sense of the lever: N = x Y, M = -x Z.
_ACROSS = (("Y", "N", "vdot", 1.0), ("Z", "M", "wdot", -1.0))


@check("added_lever")
def centre_of_the_added_mass(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """N_vdot over Y_vdot, M_wdot over Z_wdot: the water that is moved across has its centre near the buoyancy's."""
    if evidence.constants is None or evidence.vehicle is None:
        return
    known, particulars = hull_constants(evidence), evidence.vehicle.particulars
    centre = particulars.centre_of_buoyancy.value[0] / particulars.length.value
    for force, moment, acceleration, sense in _ACROSS:
        names = [f"{moment}_{acceleration}", f"{force}_{acceleration}"]
        if not all(n in known for n in names) or not known[names[1]][0] < 0.0:
            continue
        (turn, error), (push, _) = (known[n] for n in names)
        lever = sense * turn / push
        off = abs(lever - centre)
        if off <= max(rule.limits["share"], rule.limits["errors"] * error / abs(push)):
            continue
        what = f"{names[0]} = {turn:.3g} with {names[1]} = {push:.3g}: the added mass would have its centre at "
        what += f"x = {lever:.2g} L, and the centre of buoyancy is at {centre:.2g} L; moment point, or the unit or "
        what += f"sign of {moment}?"
        far = off > rule.limits["far"]
        yield rule.finding(*printed_place(evidence.runs, names), names, what, "error" if far else "")


@check("reciprocal")
def added_inertia_both_ways(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """N_vdot and Y_rdot are one number, as M_wdot and Z_qdot are: the energy of the water has one value."""
    if evidence.constants is None or evidence.vehicle is None:
        return
    known = hull_constants(evidence)
    names = {(i, j): f"{OUTPUTS[i]}_{ACCELERATIONS[j]}" for i in range(6) for j in range(6)}
    for i, j in combinations(range(6), 2):
        pair = [names[i, j], names[j, i]]
        if not all(n in known for n in pair):
            continue
        (one, s_one), (other, s_other) = known[pair[0]], known[pair[1]]
        direct = [known.get(names[k, k], (math.nan, 0.0))[0] for k in (i, j)]
        size = math.sqrt(abs(direct[0] * direct[1])) if np.isfinite(direct).all() else math.nan
        allowed = rule.limits["share"] * (size if math.isfinite(size) else max(abs(one), abs(other)) / 0.3)
        if abs(one - other) <= max(allowed, rule.limits["errors"] * math.hypot(s_one, s_other)):
            continue
        what = f"{pair[0]} = {one:.3g} and {pair[1]} = {other:.3g}, which are one number about one point"
        yield rule.finding(*printed_place(evidence.runs, pair), pair, what)


@check("turning")
def turns_pushed_at_the_stern(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Y_r below or Z_q above zero: what acts on a turning hull acts behind its middle."""
    if evidence.constants is None or evidence.vehicle is None:
        return
    known = hull_constants(evidence)
    for force, rate, velocity, sense in (("Y", "r", "v", 1.0), ("Z", "q", "w", -1.0)):
        turn = next((n for n in (f"{force}_u{rate}", f"{force}_{rate}") if n in known), "")
        lift = next((n for n in (f"{force}_{velocity}", f"{force}_u{velocity}") if n in known), "")
        if not turn or not lift:
            continue
        value, error = known[turn]
        if sense * value < -max(rule.limits["share"] * abs(known[lift][0]), rule.limits["errors"] * error):
            what = f"{turn} = {value:.3g} with {lift} = {known[lift][0]:.3g}: the load of the turn would act ahead of "
            what += "the moment point, where a hull and its stern planes have it behind"
            yield rule.finding(*printed_place(evidence.runs, [turn]), [turn], what)


def _over_a_rate(runs: pd.DataFrame, rate: str, output: str, body: Body) -> Iterator[tuple[str, list[int], float]]:
    """File, rows and slope of a load over a rate, in prime form, of boats with way on and no angle of flow."""
    others = [r for r in "pqr" if r != rate]
    straight = (runs[["alpha", "beta"]].fillna(0.0).abs() < _STRAIGHT).all(axis=1)
    alone = (runs[[*others, *ACCELERATIONS]].fillna(0.0) == 0.0).all(axis=1) & (runs[rate].fillna(0.0) != 0.0)
    chosen = runs[straight & alone & runs["part"].isin(HULL) & kept(runs, output) & (runs["U"] > 0.0)]
    for file, group in chosen.groupby(together(chosen), sort=False):
        x = (group[rate] * body.length / group["U"]).to_numpy(float)
        size = 0.5 * body.density * body.length ** (2 if output in "XYZ" else 3) * group["U"].to_numpy(float) ** 2
        y = group[output].to_numpy(float) / size
        # What does not change its sign with the rate is no slope; on one side alone it cannot be told apart.
        if x.min() < 0.0 < x.max():
            (_, found), *_ = np.linalg.lstsq(np.column_stack([np.ones(x.size), x]), y, rcond=None)
            yield str(file), rows_of(group), float(found)


@check("turning")
def turns_of_tabulated_boats(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Runs in a turn of boats whose coefficients have axes: moments that drive it on, side forces that act ahead."""
    body, vehicle = evidence.body, evidence.vehicle
    if body is None or vehicle is None or not vehicle.terms_of.tabulated:
        return
    for rate, output in (("p", "K"), ("q", "M"), ("r", "N")):
        for file, rows, found in _over_a_rate(evidence.runs, rate, output, body):
            if found > 0.0:
                what = f"{output} over {rate} is {found:.3g} (prime form): it drives the turn on, as no water does"
                yield rule.finding(file, rows, [output, rate], what, "error")
    for (test, angle, force, *_), rate, sense in zip(_PLANES, "rq", (1.0, -1.0), strict=True):
        of_test = evidence.runs[(evidence.runs["test"] == test) & evidence.runs["part"].isin(HULL)]
        lift = slope(of_test, angle, force, body)
        for file, rows, found in _over_a_rate(evidence.runs, rate, force, body):
            if sense * found < -rule.limits["share"] * abs(lift):
                what = f"{force} over {rate} is {found:.3g}, over {angle} {lift:.3g} (prime form): it acts ahead of "
                what += "the moment point, where a hull and its stern planes have it behind"
                yield rule.finding(file, rows, [force, rate], what)
