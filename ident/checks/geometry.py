"""The vehicle's particulars beside its lines and beside the tested model: units, radii, ends, where the weight is."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator

from ident.checks.findings import Evidence, Finding, Rule, check
from sim.files.errors import InputError
from sim.hull.slender import NoHull, lines


@check("geometry")
def of_this_boat(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Length, volume and centre of volume of the hull's lines beside length, displaced mass and centre of buoyancy."""
    vehicle, body = evidence.vehicle, evidence.body
    if vehicle is None or body is None:
        return
    # As it is found from the campaign's folder.
    file = (
        os.path.relpath(vehicle.geometry, evidence.folder) if vehicle.geometry and evidence.folder else "geometry file"
    )
    try:
        hull = lines(vehicle)
    except NoHull:
        return
    except InputError as error:
        yield rule.finding(file, [], [], str(error).replace("\n", "; "), "error")
        return
    known = vehicle.particulars
    length, volume = known.length.value, (body.mass or known.displaced_mass.value) / body.density
    centre, buoyancy = hull.centre, known.centre_of_buoyancy.value[0]
    for name, off, what in (
        ("length", hull.length / length - 1.0, f"lines of {hull.length:.4g} m, the vehicle of {length:.4g} m"),
        (
            "volume",
            volume / hull.volume - 1.0,
            f"lines of {hull.volume:.4g} m3, the vehicle displaces {volume:.4g} m3",
        ),
        (
            "centre",
            (centre - buoyancy) / length,
            f"centre of the lines' volume at x = {centre:.4g} m, centre of buoyancy at {buoyancy:.4g} m",
        ),
    ):
        limit = rule.limits[name]
        if abs(off) > limit:
            severity = "error" if abs(off) > rule.limits["gross"] * limit else ""
            yield rule.finding(file, [], [], f"hull without sail and planes: {what}", severity)


@check("model_inertia")
def weight_of_the_model(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The centre of gravity and the radii of gyration of the model whose inertia is taken off the loads."""
    campaign, body, vehicle = evidence.campaign, evidence.body, evidence.vehicle
    if campaign is None or body is None or vehicle is None or not campaign.header.inertia.model_inertia_in_loads:
        return
    header, inertia, known = campaign.header, campaign.header.inertia, vehicle.particulars
    assert inertia.mass_kg is not None
    assert inertia.centre_of_gravity_m is not None
    assert inertia.tensor_kgm2 is not None
    centre = [header.scale.ratio * x for x in header.frame.frame.vector(inertia.centre_of_gravity_m)]
    share = inertia.mass_kg * header.scale.ratio**3
    if abs(share / known.displaced_mass.value - 1.0) <= rule.limits["same"]:
        places = {"gravity": known.centre_of_gravity.value, "buoyancy": known.centre_of_buoyancy.value}
        for k, axis in enumerate("xy"):
            off = {word: centre[k] - place[k] for word, place in places.items()}
            if min(map(abs, off.values())) > rule.limits["centre"] * body.length:
                what = f"the model's centre of gravity is at {axis} = {centre[k]:.4g} m (at the vehicle's size), that "
                what += f"of the vehicle at {places['gravity'][k]:.4g} m, its buoyancy at "
                what += f"{places['buoyancy'][k]:.4g} m, and the model weighs what it displaces"
                yield rule.finding("campaign.toml", [], ["inertia.centre_of_gravity_m"], what)
    turned = (("y", "qdot"), ("z", "rdot"))
    for (axis, acceleration), moment in zip(turned, inertia.tensor_kgm2[1:3], strict=True):
        # What no run accelerates is of no effect.
        if not (evidence.runs[acceleration].fillna(0.0) != 0.0).any():
            continue
        radius = math.sqrt(max(moment, 0.0) / inertia.mass_kg) / header.scale.length_m
        if not rule.limits["least"] <= radius <= rule.limits["most"]:
            what = f"I{axis}{axis} = {moment:g} kg m2 of {inertia.mass_kg:g} kg: a radius of gyration of {radius:.3g} "
            what += f"lengths, models have {rule.limits['least']:g} to {rule.limits['most']:g}"
            yield rule.finding("campaign.toml", [], ["inertia.tensor_kgm2"], what)
