"""Checks of propellers: the energy that a thrust takes, the slope of its curve, side loads, what propels the boat."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ident.checks.findings import Array, Evidence, Finding, Rule, check, kept, printed_place, rows_of, together
from sim.boat.parts import vehicle_terms


def ideal_efficiency(advance: Array, thrust: Array, share: float = 1.0) -> Array:
    """Efficiency that no propeller exceeds: that of an actuator disk, 2 / (1 + sqrt(1 + share C_T)).

    Parameters
    ----------
    advance : J above zero.
    thrust : K_T, not below zero; C_T = 8 K_T / (pi J^2).
    share : Of the thrust that is the propeller's own: below 1 in a duct that thrusts too.

    References
    ----------
    Carlton (2018), Marine Propellers and Propulsion, 8.2: Rankine and Froude's momentum theory.

    Examples
    --------
    >>> float(ideal_efficiency(np.array([1.0]), np.array([0.375 * np.pi])).round(9)[0])
    0.666666667
    """
    return np.asarray(2.0 / (1.0 + np.sqrt(1.0 + share * 8.0 * thrust / (math.pi * advance**2))))


@check("open_water")
def energy_of_the_wake(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The best efficiency over that of an actuator disk: above one it comes from nothing."""
    runs, limits = evidence.runs, rule.limits
    ahead = runs[(runs["test"] == "open_water") & (runs["J"] > 0.0) & (runs["KT"] > 0.0) & (runs["KQ"] > 0.0)]
    ahead = ahead[kept(ahead, "KT") & kept(ahead, "KQ")]
    for file, group in ahead.groupby("file", sort=False):
        j, kt, kq = (group[c].to_numpy(float) for c in ("J", "KT", "KQ"))
        efficiency = j * kt / (2.0 * math.pi * kq)
        share = efficiency / ideal_efficiency(j, kt)
        ducted = efficiency / ideal_efficiency(j, kt, limits["ducted"])
        worst, best = int(share.argmax()), float(share.max())
        if limits["ideal_low"] <= best <= limits["ideal_high"]:
            continue
        impossible = bool((ducted > 1.0).any())
        what = f"efficiency {efficiency[worst]:.3g} at J = {j[worst]:g} in run {group['run_id'].iloc[worst]} is "
        what += f"{best:.2g} of an actuator disk's, propellers have {limits['ideal_low']:g} to {limits['ideal_high']:g}"
        what += ": KT, KQ or J of another row, curve or unit?"
        yield rule.finding(str(file), rows_of(group), ["KT", "KQ"], what, "" if impossible else "warning")


@check("open_water")
def energy_at_rest(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The power that the thrust without advance takes at the least, T sqrt(T / (2 rho A)), over that of the torque.

    In coefficients K_T^1.5 / (pi sqrt(2 pi) K_Q): what stands in one column by another factor is seen here, where both
    are largest.
    """
    runs, limits = evidence.runs, rule.limits
    held = runs[(runs["test"] == "open_water") & (runs["J"] == 0.0) & (runs["KT"] > 0.0) & (runs["KQ"] > 0.0)]
    held = held[kept(held, "KT") & kept(held, "KQ")]
    for file, group in held.groupby("file", sort=False):
        merit = float((group["KT"] ** 1.5 / group["KQ"]).median()) / (math.pi * math.sqrt(2.0 * math.pi))
        if limits["rest_low"] <= merit <= limits["rest_high"]:
            continue
        first = group.iloc[0]
        what = f"KT = {first['KT']:.4g} with KQ = {first['KQ']:.4g} at J = 0: an actuator disk would need {merit:.2g} "
        what += f"of that power, propellers have {limits['rest_low']:g} to {limits['rest_high']:g}: "
        what += "a factor in KT or KQ?"
        # A duct may thrust as much as the propeller in it.
        impossible = merit * math.sqrt(limits["ducted"]) > 1.0
        yield rule.finding(str(file), rows_of(group), ["KT", "KQ"], what, "" if impossible else "warning")


@check("open_water")
def propulsion_beyond_the_curve(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The advance at the propulsion point, (1 - w_T) U / (n D), at an end of the curve: its own J lies beyond."""
    runs, vehicle, table = evidence.runs, evidence.vehicle, evidence.constants
    if vehicle is None or vehicle.propeller is None or table is None:
        return
    wake = table.loc[table["coefficient"] == "w_T", "value"]
    points = runs[(runs["test"] == "self_propulsion") & (runs["n"].fillna(0.0) != 0.0)]
    curve = runs[(runs["test"] == "open_water") & runs["J"].notna() & kept(runs, "KT")]
    if wake.empty or points.empty or curve["J"].nunique() < 3:
        return
    point = points.iloc[0]
    advance = (1.0 - float(wake.iloc[0])) * float(point["U"]) / (abs(float(point["n"])) * vehicle.diameter)
    for end in (float(curve["J"].min()), float(curve["J"].max())):
        if math.isclose(advance, end, rel_tol=1e-6, abs_tol=1e-9):
            what = f"the thrust of run {point['run_id']} is beyond the open-water curve, which ends at J = {end:g}: "
            what += "the wake fraction is that of the end; rows that are missing, n, or a resistance of another size?"
            yield rule.finding(str(point["file"]), rows_of(points.iloc[:1]), ["n"], what, "warning")


@check("open_water")
def one_advance_below_zero(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A single J below zero in a curve of positive ones, or no J above zero: nobody measures that."""
    tested = evidence.runs[evidence.runs["test"] == "open_water"]
    for file, group in tested.groupby("file", sort=False):
        astern = group[group["J"] < 0.0]
        ahead = int((group["J"] > 0.0).sum())
        if len(astern) == 1 and ahead >= rule.limits["ahead"]:
            what = f"J = {astern['J'].iloc[0]:g} in run {astern['run_id'].iloc[0]}, all others ahead: its sign?"
            yield rule.finding(str(file), rows_of(astern), ["J"], what, "warning")
        if len(astern) >= rule.limits["ahead"] and not ahead:
            what = f"J of {len(astern)} runs is below zero and of none above: a curve of way astern alone, or the sign?"
            yield rule.finding(str(file), rows_of(astern), ["J"], what)


@check("open_water")
def one_value_at_two_advances(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The same KT or KQ at two J: a value of the row beside it."""
    tested = evidence.runs[evidence.runs["test"] == "open_water"]
    for file, group in tested.groupby("file", sort=False):
        for name in ("KT", "KQ"):
            given = group[kept(group, name) & (group[name] != 0.0)].drop_duplicates(["J", name])
            twice = given[given.duplicated(name, keep=False)]
            if not twice.empty:
                advances = ", ".join(f"{j:g}" for j in twice["J"])
                what = f"{name} = {twice[name].iloc[0]:g} at J = {advances}: of the row beside it?"
                yield rule.finding(str(file), rows_of(twice), [name], what, "warning")


@check("open_water")
def thrust_over_advance(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The mean slope of KT over J, which the pitch hardly changes: J of another unit, or one column shifted."""
    runs, limits = evidence.runs, rule.limits
    ahead = runs[(runs["test"] == "open_water") & (runs["J"] >= 0.0) & kept(runs, "KT")]
    for file, group in ahead.groupby("file", sort=False):
        j, kt = group["J"].to_numpy(float), group["KT"].to_numpy(float)
        if np.unique(j).size < 3:
            continue
        slope = float(np.polyfit(j, kt, 1)[0])
        # One that rises is another finding.
        if slope < 0.0 and not limits["slope_low"] <= -slope <= limits["slope_high"]:
            what = f"KT falls by {-slope:.3g} over a unit of J, propellers have {limits['slope_low']:g} to "
            what += f"{limits['slope_high']:g}: the unit of J, or KT of another row?"
            yield rule.finding(str(file), rows_of(group), ["J", "KT"], what, "warning")


@check("open_water")
def published_thrust_over_advance(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """KT = k_0 + k_1 J + k_2 J^2 as published: it comes to zero, and falls as much as of other propellers till then."""
    table, limits = evidence.constants, rule.limits
    if table is None:
        return
    known = {str(n): float(v) for n, v in zip(table["coefficient"], table["value"], strict=True)}
    names = ["k_0", "k_1", "k_2"]
    if not all(n in known for n in names):
        return
    roots = np.roots([known[n] for n in reversed(names)])
    ends = [float(r.real) for r in roots if abs(r.imag) < 1e-9 and r.real > 0.0]
    slope = known["k_0"] / min(ends) if ends else math.nan
    if limits["slope_low"] <= slope <= limits["slope_high"]:
        return
    of = ", ".join(f"{n} = {known[n]:g}" for n in names)
    what = f"{of}: KT falls by {slope:.3g} over a unit of J, propellers have {limits['slope_low']:g} to "
    what += f"{limits['slope_high']:g}"
    what = what if ends else f"{of}: a thrust with no end, however fast the propeller advances"
    yield rule.finding(*printed_place(evidence.runs, names), ["value"], what, "warning" if ends else "")


@check("side_force")
def force_over_the_angle(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Side loads of a propeller over the angle of the flow at the stern and the load of its disk, 1/2 rho U^2 A."""
    body, vehicle, runs = evidence.body, evidence.vehicle, evidence.runs
    if body is None or vehicle is None or vehicle.propeller is None:
        return
    disk = 0.25 * math.pi * vehicle.diameter**2
    side = runs[(runs["test"] == "propeller_side_force") & (runs["U"].fillna(0.0) > 0.0)]
    for force, rate, angle in (("Y", "r", "beta"), ("Z", "q", "alpha")):
        given = side[kept(side, force) & (side[force] != 0.0)]
        turned = (given[rate].fillna(0.0) * 0.5 * body.length / given["U"]).abs()
        flow = turned.where(turned > 0.0, np.sin(given[angle].fillna(0.0)).abs())
        size = given[force].abs() / (0.5 * body.density * given["U"] ** 2 * disk * flow.where(flow > 0.0))
        for file, group in given.groupby(together(given), sort=False):
            median = float(size[group.index].median())
            if not math.isfinite(median) or rule.limits["low"] <= median <= rule.limits["high"]:
                continue
            far = not rule.limits["none"] <= median <= rule.limits["most"]
            what = f"{force} of the propeller is {median:.3g} times 1/2 rho U^2 of its disk and the angle of the flow "
            what += f"at the stern, propellers have {rule.limits['low']:g} to {rule.limits['high']:g}: the unit of "
            what += f"{rate}, {angle} or {force}?"
            yield rule.finding(str(file), rows_of(group), [force, rate], what, "error" if far else "")


@check("side_force")
def acts_at_the_propeller(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Moment of the propeller's side load over the load: N = x Y and M = -x Z of where the propeller is."""
    body, vehicle, runs = evidence.body, evidence.vehicle, evidence.runs
    if body is None or vehicle is None or vehicle.propeller is None:
        return
    place = vehicle.propeller.position
    # Behind the hull, where nothing says.
    stern = vehicle.particulars.centre_of_buoyancy.value[0] - 0.5 * body.length
    x = (place.value[0] if place is not None else stern) / body.length
    side = runs[runs["test"] == "propeller_side_force"]
    for force, moment, sense in (("Y", "N", 1.0), ("Z", "M", -1.0)):
        given = side[kept(side, force) & kept(side, moment) & (side[force] != 0.0) & (side[moment] != 0.0)]
        lever = sense * given[moment] / given[force] / body.length
        for file, group in given.groupby(together(given), sort=False):
            at = float(lever[group.index].median())
            if abs(at - x) <= rule.limits["lever"]:
                continue
            what = f"{moment} over {force} of the propeller is that of a load at x = {at:.2g} L, and it is at "
            what += f"{x:.2g} L: the sign or unit of {moment} or {force}, or [moment_point]?"
            far = abs(at - x) > rule.limits["ahead"]
            yield rule.finding(str(file), rows_of(group), [moment, force], what, "error" if far else "")


@check("essential")
def what_the_propeller_is_measured_for(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Runs at the propulsion point of which none has revolutions: they leave no wake fraction."""
    campaign, runs = evidence.campaign, evidence.runs
    if campaign is None or "w_T" not in {t.name for t in vehicle_terms(campaign.vehicle)}:
        return
    points = runs[runs["test"] == "self_propulsion"]
    if "coefficient" in runs and bool((runs["coefficient"] == "w_T").any()):
        return
    if len(points) and not bool((points["n"].fillna(0.0) != 0.0).any()):
        what = f"none of {len(points)} runs at the propulsion point has revolutions: no wake fraction w_T, "
        what += "and the boat's speed comes from thrust in undisturbed water"
        yield rule.finding(str(points["file"].iloc[0]), rows_of(points), ["n"], what, "warning")
