"""Checks of loads and stated sizes against the boat's own proportions: volume, draught, lines."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pandas as pd

from ident.checks.findings import HULL, Evidence, Finding, Rule, check, printed_place, rows_of, together
from ident.checks.physics import apparent_inertia, slope
from ident.checks.potential import hull_constants
from ident.checks.resistance import spheroid_diameter
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.hull.slender import geometry_of, lines, spheroid
from sim.hull.surface import FoilParts

_LIFTS = (
    ("drift_horizontal", "beta", "Y", ("Y_v", "Y_uv")),
    ("drift_vertical", "alpha", "Z", ("Z_w", "Z_uw")),
)


@check("lift")
def cross_force_over_volume(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The slope of the cross force beside the displaced volume, which the boats of the table share within a factor."""
    body, vehicle = evidence.body, evidence.vehicle
    if body is None or body.mass is None or vehicle is None:
        return
    volume = body.mass / body.density / body.length**3
    by_part = bool(evidence.runs["part"].isin([p.name for p in vehicle.planes]).any())
    least = rule.limits["bare" if by_part or not vehicle.planes else "appended"]
    for test, angle, force, names in _LIFTS:
        for file, rows, value in _slopes(evidence, test, angle, force, names):
            share = -value / volume
            # A wrong sign is the check `size`'s.
            if not share > 0.0 or least <= share <= rule.limits["most"]:
                continue
            what = f"{force} over {angle} is {value:.3g} (prime form, per radian), {share:.2g} times the displaced "
            what += f"volume over L^3; boats and ships have {least:g} to {rule.limits['most']:g}: "
            what += f"the unit of {force}, of the speed, or of {angle}?"
            yield rule.finding(file, rows, [force, angle], what)


def _slopes(
    evidence: Evidence, test: str, angle: str, force: str, names: tuple[str, ...]
) -> Iterator[tuple[str, list[int], float]]:
    """File, rows and slope of the runs of each file; without any, of what is published."""
    body, runs = evidence.body, evidence.runs
    assert body is not None
    of_test = runs[(runs["test"] == test) & runs["part"].isin(HULL)]
    for file, group in of_test.groupby(together(of_test), sort=False):
        value = slope(group, angle, force, body)
        if math.isfinite(value):
            yield str(file), rows_of(group), value
    if of_test.empty and evidence.constants is not None and evidence.vehicle is not None:
        known = hull_constants(evidence)
        name = next((n for n in names if n in known), "")
        if name:
            yield *printed_place(runs, [name]), known[name][0]


@check("added_mass")
def added_mass_over_the_spheroid(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Added mass and added moment of inertia below those that a body of that length and volume has at the least."""
    body = evidence.body
    if body is None or body.mass is None:
        return
    diameter = spheroid_diameter(body)
    if diameter >= body.length:
        return
    along, across, turned = spheroid(body.length, diameter)
    # Moment of inertia of the displaced water about a lateral axis.
    inertia = body.mass * (body.length**2 + diameter**2) / 20.0
    of_spheroid = {"udot": along * body.mass, "vdot": across * body.mass, "wdot": across * body.mass}
    of_spheroid |= {"qdot": turned * inertia, "rdot": turned * inertia}
    for file, acceleration, group, apparent in apparent_inertia(evidence):
        known = of_spheroid.get(acceleration)
        # A wrong sign is the check `inertia_sign`'s.
        if known is None or not 0.0 < apparent < rule.limits["least"] * known:
            continue
        output = OUTPUTS[ACCELERATIONS.index(acceleration)]
        what = f"{output} over {acceleration} is an added inertia of {apparent:.4g}, {apparent / known:.2g} of that of "
        what += "the spheroid of the boat's length and volume: the unit of the load or of the acceleration?"
        yield rule.finding(file, rows_of(group), [output, acceleration], what)


# Added masses across, and about the lateral axes.
_ACROSS = (("Y_vdot", "Z_wdot", "mean_mass"), ("N_rdot", "M_qdot", "mean_inertia"))


@check("added_mass")
def both_ways_together(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The geometric mean of the added masses sideways and up and down, over that of the spheroid.

    Of an ellipse of half axes a and b they are pi b^2 and pi a^2: their mean is the ellipse's own area however flat it
    is, and of any other section of that area it is not much less. What a boat's shape leaves open of one is
    not open of both.
    """
    body = evidence.body
    if body is None or body.mass is None or evidence.constants is None or evidence.vehicle is None:
        return
    diameter = spheroid_diameter(body)
    if diameter >= body.length:
        return
    _, across, turned = spheroid(body.length, diameter)
    unit = 0.5 * body.density * body.length**3
    of_spheroid = {"mean_mass": across * body.mass / unit}
    of_spheroid["mean_inertia"] = turned * body.mass * (1.0 + (diameter / body.length) ** 2) / 20.0 / unit
    known = hull_constants(evidence)
    for side, up, limit in _ACROSS:
        if not all(n in known and known[n][0] < 0.0 for n in (side, up)):
            continue
        (one, s_one), (two, s_two) = known[side], known[up]
        mean = math.sqrt(one * two)
        slack = 1.0 + 0.5 * rule.limits["errors"] * math.hypot(s_one / one, s_two / two)
        place = printed_place(evidence.runs, [side, up])
        share = mean / of_spheroid[limit]
        # What is published is meant as it stands.
        runs = evidence.runs
        printed = "coefficient" in runs and {side, up} <= set(runs["coefficient"])
        if share * (1.0 if printed else slack) >= rule.limits[limit]:
            continue
        what = f"{side} = {one:.3g} and {up} = {two:.3g}: their geometric mean is {share:.2g} of that of the spheroid "
        what += f"of the boat's length and volume, boats have {rule.limits[limit]:g} at the least: their unit or norm, "
        what += "or the unit of the acceleration?"
        yield rule.finding(*place, [side, up], what)


@check("draught")
def draught_of_the_body(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The draught that loads were made dimensionless with, beside the volume, and the lines where there are any."""
    body, vehicle = evidence.body, evidence.vehicle
    if body is None or body.draught is None or body.mass is None or vehicle is None:
        return
    limits, draught = rule.limits, body.draught
    fullness = body.mass / body.density / (body.length * draught**2)
    # A floating hull is wider than deep; a rudder has a size of its own on ships alone.
    depths = evidence.runs["D0"].dropna()
    floats = vehicle.rudder is not None or (not depths.empty and bool((depths == 0.0).all()))
    least = limits["ship" if floats else "least"]
    if not least <= fullness <= limits["most"]:
        what = f"a draught of {draught:.4g} m (draught_m at full scale) makes volume over L d^2 {fullness:.2g}, "
        what += f"boats have {least:g} to {limits['most']:g}: every load over 1/2 rho L d is off by its ratio"
        yield rule.finding("campaign.toml", [], ["draught_m"], what)
        return
    try:
        hull = lines(vehicle)
    except InputError:
        return
    diameter = 2.0 * float(hull.radius.max())
    high = diameter + max(0.0, float(hull.deck.max()) - 0.5 * diameter)
    if not limits["low"] * diameter <= draught <= limits["high"] * high:
        what = f"a draught of {draught:.4g} m (draught_m at full scale) of a hull {diameter:.4g} m across"
        yield rule.finding("campaign.toml", [], ["draught_m"], what)


def plane_areas(vehicle: Vehicle) -> dict[str, float]:
    """Plane -> planform area by the vehicle's geometry or rudder, fixed root and other side included [m^2]."""
    areas: dict[str, float] = {}
    if vehicle.rudder is not None:
        areas["rudder"] = float(vehicle.rudder.area.value)
    if not vehicle.geometry:
        return areas
    try:
        geometry, folder = geometry_of(vehicle)
    except InputError:
        return areas
    for part in geometry.parts:
        if not isinstance(part, FoilParts):
            continue
        table = pd.read_csv(folder / part.offsets)
        if "plane" not in table:
            continue
        for plane, rows in table.groupby("plane"):
            chord = rows["TE_root_x_m"] - rows["LE_root_x_m"], rows["TE_tip_x_m"] - rows["LE_tip_x_m"]
            span = 0.5 * (rows["LE_tip_s_m"] + rows["TE_tip_s_m"] - rows["LE_root_s_m"] - rows["TE_root_s_m"])
            areas[str(plane)] = areas.get(str(plane), 0.0) + float((0.5 * (chord[0] + chord[1]) * span).abs().sum())
    return areas


@check("area")
def areas_of_planes(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Reference areas of a plane's coefficients against the plane's own planform."""
    campaign, vehicle = evidence.campaign, evidence.vehicle
    if campaign is None or vehicle is None:
        return
    stated = [(s, s.reference) for s in campaign.header.source if s.reference is not None]
    areas = plane_areas(vehicle) if stated else {}
    for source, reference in stated:
        part = str(source.constants.get("part", ""))
        known = areas.get(part)
        if known is None:
            continue
        area = reference.area_m2 * campaign.header.scale.ratio**2
        # A table may be of one of a pair, or with the root that stays.
        ratios = np.array([area / known, 2.0 * area / known]) if vehicle.rudder is None else np.array([area / known])
        if (np.abs(np.log(ratios)) > math.log(rule.limits["factor"])).all():
            what = f"area_m2 = {reference.area_m2:g} ({area:.4g} m2 at full scale) of {part}, whose planform in the "
            what += f"vehicle has {known:.4g} m2: a factor {area / known:.3g} in every load of {source.files}"
            yield rule.finding("campaign.toml", [], ["reference.area_m2"], what)
