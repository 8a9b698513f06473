"""Whether the numbers of a vehicle file can be those of a vehicle at all."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sim.files.errors import InputError

# Largest cosine between span and chord: 3 degrees off a right angle. The deflection turns about the span axis.
_ALONG = 0.05
# Most added mass over displaced mass along, across and in heave, of bodies longer than wide: a sphere has 0.5 each way,
# a cylinder 1 across, an elliptic one b / h across its breadth b (Lamb, *Hydrodynamics*, art. 71, 114 and 115): 5 is a
# body five times wider than high. Rotations: over displaced mass times length^2 / 12, a rod's.
_MOST_ADDED = (1.0, 5.0, 5.0, 5.0, 5.0, 5.0)
# What errors of measurement may leave below zero, in the same measure.
_LEAST_ADDED = -0.05
# Faster than any rudder servo [deg/s].
_FASTEST_PLANE = 1000.0
# Less is no plane [deg]: a limit in radians.
_LEAST_LIMIT = 1.0
# What may stand above the sail top, over the length: planes of a boat whose sail top is stated on the axis.
_ABOVE = 0.05
_MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
# Floating boats displace what they weigh; a submerged one differs by what its planes can carry.
_OUT_OF_TRIM = 0.5
# Two positions are each other's mirror image when they differ by less than this part of the length.
_SAME = 1e-3
# What is taken from thrust or speed by the hull before the propeller.
FRACTIONS = {
    "t": "a part of the thrust",
    "t_P": "a part of the thrust",
    "w_T": "a part of the speed",
    "w_P0": "a part of the speed",
}


def check_vehicle(vehicle: Any, where: str) -> None:
    """Refuse numbers that no body has.

    A body's mass is spread over its length: its radii of gyration about the centre of gravity are above
    zero, below its length, and the square of none exceeds the sum of the others' (the principal moments
    of inertia of any body: Goldstein, *Classical mechanics*, section 5.3). Whatever is on the boat is no
    farther from its centre of buoyancy than the boat is long. A plane has a span across its chord, and is
    the mirror image of the plane that it mirrors.

    Parameters
    ----------
    vehicle : A ``sim.boat.vehicle.Vehicle``, as read.
    where : File, for the message.

    Raises
    ------
    InputError
        Naming the file, the key, what was found and what is allowed.
    """
    for key, value, allowed in _faults(vehicle):
        raise InputError(f"{where}, key {key}", value, allowed)


def check_mass(total: Any, added: Any, vehicle: Any) -> None:
    """Refuse a mass matrix that no body in water has.

    The kinetic energy of body and water is above zero however they move, so that their mass matrix is positive
    definite; the water's part of each motion is not below zero, nor above the bounds of potential flow.

    Parameters
    ----------
    total, added : (6, 6) mass of body and water, and of the water, about the origin [kg, kg m, kg m^2].
    vehicle : For its displaced mass and length.

    Raises
    ------
    InputError
        Naming the motion, its added mass and what is allowed.
    """
    given, where = vehicle.particulars, f"coefficients of vehicle {vehicle.name}, added mass"
    mass, arm = given.displaced_mass.value, given.length.value**2 / 12.0
    units = mass * np.array([1.0, 1.0, 1.0, arm, arm, arm])
    for motion, size, unit, most in zip(_MOTIONS, np.diag(added), units, _MOST_ADDED, strict=True):
        if not _LEAST_ADDED * unit <= size <= most * unit:
            of = f"the displaced mass of {mass:.4g} kg" + ("" if motion in _MOTIONS[:3] else " times length^2 / 12")
            raise InputError(f"{where} in {motion}", f"{size:.3g}", f"zero to {most:g} of {of}")
    least = float(np.linalg.eigvalsh(0.5 * (total + total.T))[0]) if np.isfinite(total).all() else float("nan")
    if not least > 0.0:
        text = "a mass matrix that is not positive definite"
        raise InputError(where, text, "added masses and levers of one body in water: its kinetic energy is above zero")


def check_shares(values: Mapping[str, Any], vehicle: Any) -> None:
    """Refuse thrust deductions and wake fractions that no propeller behind a hull has.

    Of the thrust T the share 1 - t moves the boat, of its speed the share 1 - w reaches the propeller (ITTC
    7.5-02-03-01.4): both above zero, or the propeller would push astern; a hull that adds as much as all of
    either is none.

    Parameters
    ----------
    values : Name of the coefficient -> its values.
    vehicle : For the message.

    Raises
    ------
    InputError
        Naming the coefficient, its value and what is allowed.
    """
    for name in FRACTIONS:
        for value in np.ravel(values.get(name, ())):
            if not abs(value) < 1.0:
                where = f"coefficients of vehicle {vehicle.name}, {name}"
                raise InputError(where, f"{value:.3g}", f"above -1 and below 1, {FRACTIONS[name]}")


def _faults(vehicle: Any) -> Iterator[tuple[str, str, str]]:
    yield from _names(vehicle)
    yield from _mass(vehicle)
    yield from _places(vehicle)
    for plane in vehicle.planes:
        yield from _plane(plane, vehicle)
    if vehicle.rudder is not None and (not vehicle.terms_of.rudder or "rudder" not in [p.name for p in vehicle.planes]):
        yield "rudder", "the size of a rudder", 'term_set = "mmg" and a plane named rudder: nothing else uses it'


def _names(vehicle: Any) -> Iterator[tuple[str, str, str]]:
    for name, times in Counter(vehicle.part_names()).items():
        if times > 1:
            yield "planes and sections", f"{name!r} {times} times", "a name for each part; not hull, not propeller"


def _mass(vehicle: Any) -> Iterator[tuple[str, str, str]]:
    given, length = vehicle.particulars, vehicle.particulars.length.value
    radii = np.array(given.radius_of_gyration.value)
    key = "particulars.radius_of_gyration"
    if not (radii > 0.0).all() or (radii > length).any():
        yield key, str(radii.tolist()), f"radii above zero, and not above the length of {length:g} m"
    square = radii**2
    if (2.0 * square > square.sum() * (1.0 + 1e-9)).any():
        text = "radii of a body: the square of none is more than the sum of the others' squares"
        yield key, str(radii.tolist()), text
    share = given.displaced_mass.value / given.mass.value
    if not 1.0 - _OUT_OF_TRIM < share < 1.0 + _OUT_OF_TRIM:
        yield "particulars.displaced_mass", f"{share:.3g} times the mass", "about the mass: a boat that floats"
    if vehicle.propeller and not vehicle.diameter < length:
        yield "propeller.diameter", f"{vehicle.diameter:g} m", f"less than the length of {length:g} m"


def _places(vehicle: Any) -> Iterator[tuple[str, str, str]]:
    given, propeller, tanks = vehicle.particulars, vehicle.propeller, vehicle.tanks
    places = {
        "particulars.centre_of_gravity": given.centre_of_gravity.value,
        **({"particulars.sail_top": given.sail_top.value} if given.sail_top else {}),
        **({"propeller.position": propeller.position.value} if propeller and propeller.position else {}),
        **({"tanks.ballast.position": tanks.ballast.position.value} if tanks else {}),
        **{f"planes, {p.name}, position": p.position for p in vehicle.planes},
        **{f"sections, {s.name}, position": s.position for s in (vehicle.sections.centres if vehicle.sections else [])},
    }
    length, middle = given.length.value, np.array(given.centre_of_buoyancy.value)
    for key, place in places.items():
        away = float(np.linalg.norm(np.array(place) - middle))
        if away > length:
            yield key, f"{away:.4g} m from the centre of buoyancy", f"a place on the boat, which is {length:g} m long"
    if given.sail_top:
        yield from _below_the_sail(places, np.array(given.sail_top.value), length, vehicle.frame.frame.sign("z"))


def _below_the_sail(places: Any, top: Any, length: float, down: float) -> Iterator[tuple[str, str, str]]:
    """The sail top is the highest point of a boat, or the axis of one that has no other."""
    for key, place in places.items():
        if key.startswith("tanks"):
            continue
        above = down * (float(top[2]) - place[2])
        if above > _ABOVE * length:
            text = "a place below the sail top, particulars.sail_top"
            yield key, f"{above:.4g} m above the sail top", text


def _plane(plane: Any, vehicle: Any) -> Iterator[tuple[str, str, str]]:
    key = f"planes, {plane.name}"
    span, chord = np.array(plane.span_axis), np.array(plane.leading_edge)
    sizes = float(np.linalg.norm(span)), float(np.linalg.norm(chord))
    if not min(sizes) > 0.0 or not np.isfinite(sizes).all():
        yield f"{key}, span_axis and leading_edge", "no direction", "two directions that are not zero"
        return
    if abs(float(span / sizes[0] @ (chord / sizes[1]))) > _ALONG:
        yield (
            f"{key}, span_axis",
            f"{plane.span_axis} along the leading edge's {plane.leading_edge}",
            "a span across it",
        )
    if not _LEAST_LIMIT <= plane.limit_deg <= 90.0:
        yield f"{key}, limit_deg", f"{plane.limit_deg:g}", f"{_LEAST_LIMIT:g} to 90, in degrees"
    if plane.rate_degps > _FASTEST_PLANE:
        yield f"{key}, rate_degps", f"{plane.rate_degps:g}", f"{_FASTEST_PLANE:g} at most"
    partner = next(p for p in vehicle.planes if p.name == plane.mirror)
    if partner.mirror != plane.name:
        yield f"{key}, mirror", f"{plane.mirror!r}, which mirrors {partner.mirror!r}", "planes that mirror each other"
    image = np.array(plane.position) * (1.0, -1.0, 1.0)
    if np.abs(image - partner.position).max() > _SAME * vehicle.particulars.length.value:
        yield f"{key}, mirror", f"{plane.mirror!r} at {partner.position}", f"the plane at {image.tolist()}"
