"""Lines of a vehicle against its particulars: a unit, a diameter for a radius, the tail for the nose."""

from __future__ import annotations

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
    length, volume = known.length.value, known.displaced_mass.value / body.density
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
