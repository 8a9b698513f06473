"""Checks of planes and sail: which way a deflected plane lifts, and where the loads act."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ident.checks.findings import HULL, Evidence, Finding, Rule, check, kept, printed_place, rows_of, together
from ident.checks.physics import slope
from ident.checks.potential import hull_constants
from ident.checks.resistance import spheroid_diameter
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import Vehicle

# Moment -> force whose lever it shows, place of the lever in a vector, and its sign: N = x Y, M = -x Z.
_LEVERS = {"N": ("Y", 1.0), "M": ("Z", -1.0)}


def _slopes(evidence: Evidence, vehicle: Vehicle) -> dict[tuple[str, str], tuple[str, float, float]]:
    """Part and output -> coefficient over the deflection alone, its value and standard error."""
    assert evidence.constants is not None
    terms = {t.name: t for t in vehicle_terms(vehicle)}
    found: dict[tuple[str, str], tuple[str, float, float]] = {}
    rows = evidence.constants
    for name, part, value, error in zip(rows["coefficient"], rows["part"], rows["value"], rows["stderr"], strict=True):
        term = terms.get(str(name))
        if term is not None and sorted(term.factors) == ["deflection", "u", "u"] and term.norm == "rho/2 L":
            found[str(part), term.output] = (str(name), float(value), float(error))
    return found


@check("plane_sign")
def published_and_constant_planes(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Coefficients of a plane over its deflection: along its lift axis, and at its place."""
    vehicle = evidence.vehicle
    if evidence.constants is None or vehicle is None:
        return
    slopes, length = _slopes(evidence, vehicle), vehicle.particulars.length.value
    for plane in vehicle.planes:
        axis = plane.lift_axis
        for output in "YZ":
            name, value, error = slopes.get((plane.name, output), ("", 0.0, 0.0))
            way = float(axis["XYZ".index(output)])
            if name and abs(way) > rule.limits["along"] and way * value < -rule.limits["errors"] * error:
                towards = f"{'-' if way < 0 else '+'}{output}"
                what = f"{name} = {value:.4g}, and a deflected {plane.name} lifts towards {towards} "
                what += "(span_axis and leading_edge of the vehicle)"
                yield rule.finding(*printed_place(evidence.runs, [name]), ["value"], what)
        for moment, (force, sense) in _LEVERS.items():
            name, value, _ = slopes.get((plane.name, moment), ("", 0.0, 0.0))
            of_force, lift, _ = slopes.get((plane.name, force), ("", 0.0, 0.0))
            if not name or not lift:
                continue
            lever, place = sense * value / lift, plane.position[0] / length
            if abs(lever - place) > rule.limits["share"]:
                what = f"{name} = {value:.4g} with {of_force} = {lift:.4g}: a lever of {lever:.2f} L, "
                what += f"and {plane.name} is at {place:.2f} L"
                yield rule.finding(*printed_place(evidence.runs, [name]), ["value"], what)


@check("plane_sign")
def planes_of_runs(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Runs with a plane deflected whose force goes against its lift."""
    vehicle = evidence.vehicle
    if vehicle is None or not vehicle.terms_of.tabulated:
        return
    runs = evidence.runs[evidence.runs["test"] == "plane_deflection"]
    for plane in vehicle.planes:
        of_plane = runs[(runs["part"] == plane.name) & kept(runs, "Y") & kept(runs, "Z") & runs["plane"].notna()]
        for file, group in of_plane.groupby(together(of_plane), sort=False):
            if group["plane"].nunique() < 3:
                continue
            lift = group[["Y", "Z"]].to_numpy(float) @ plane.lift_axis[1:]
            angle = group["plane"].to_numpy(float) - float(group["plane"].mean())
            size = group["U"].to_numpy(float) ** 2
            if float(np.sum(angle * lift / size)) < 0.0:
                what = (
                    f"the force of {plane.name} over its angle goes against the axis that a deflected plane lifts along"
                )
                yield rule.finding(str(file), rows_of(group), ["plane"], what)


@check("levers")
def side_force_of_the_sail(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """K over Y in drift: K = -z Y, and the side force acts on the hull, or between the axis and the top of a sail."""
    body, vehicle, runs = evidence.body, evidence.vehicle, evidence.runs
    if body is None or body.mass is None or vehicle is None:
        return
    centre, particulars = float(vehicle.particulars.centre_of_buoyancy.value[2]), vehicle.particulars
    above = centre - float(particulars.sail_top.value[2]) if particulars.sail_top is not None else 0.0
    radius = 0.5 * spheroid_diameter(body)
    sail = above > rule.limits["sail"] * radius
    # Keels and rudders reach below the hull.
    low, high = -rule.limits["off"] * radius, rule.limits["off"] * max(above, radius)
    low = -rule.limits["share"] * above if sail else low
    of_test = runs[(runs["test"] == "drift_horizontal") & runs["part"].isin(HULL)]
    pairs = [
        (str(file), rows_of(group), slope(group, "beta", "K", body), slope(group, "beta", "Y", body))
        for file, group in of_test.groupby(together(of_test), sort=False)
    ]
    if of_test.empty and evidence.constants is not None:
        known = hull_constants(evidence)
        for roll, side in (("K_v", "Y_v"), ("K_uv", "Y_uv")):
            if roll in known and side in known:
                pairs.append((*printed_place(runs, [roll]), known[roll][0], known[side][0]))
    for file, rows, turn, push in pairs:
        if not push or not math.isfinite(turn):
            continue
        height = turn / push * body.length + (centre if not sail else 0.0)
        if low <= height <= high:
            continue
        where = f"{abs(height):.3g} m {'above' if height > 0.0 else 'below'} the axis"
        what = f"K over Y in drift is that of a side force {where}, and the boat has hull and sail from {low:.3g} to "
        what += f"{high:.3g} m above it: the sign of K, or the height of [moment_point]?"
        yield rule.finding(file, rows, ["K", "Y"], what)
