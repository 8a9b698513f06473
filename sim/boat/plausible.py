"""Whether the numbers of a vehicle file can be those of a vehicle at all."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from sim.boat.catalogue import Term, held
from sim.files.errors import InputError

# Largest cosine between span and chord: 3 degrees off a right angle. The deflection turns about the span axis.
_ALONG = 0.05
# Most added mass over displaced mass along, across and in heave, of bodies longer than wide: a sphere has 0.5 each way,
# a cylinder 1 across, an elliptic one b / h across its breadth b (Lamb, *Hydrodynamics*, art. 71, 114 and 115): 5 is a
# body five times wider than high. Rotations: over displaced mass times length^2 / 12, a rod's.
_MOST_ADDED = (1.0, 5.0, 5.0, 5.0, 5.0, 5.0)
# What errors of measurement may leave below zero, in the same measure.
_LEAST_ADDED = -0.05
# Displaced volume over length^3: a sphere has pi / 6, a cylinder fifty times as long as wide 3e-4.
_FULLNESS = (3e-4, math.pi / 6.0)
# Radii of gyration in pitch and yaw over the length: an ellipsoid has 0.22, a rod 0.29, boats 0.22 to 0.30 (ITTC
# 7.5-02-06-03 takes 0.25 where nothing is known); half or twice of that is of another length.
_SPREAD = (0.17, 0.4)
# From fresh water to brine, what a body may displace [kg/m^3]: only the size of its length is looked at.
_WATER = (990.0, 1250.0)
# Longest way of a plane from amidships to its limit [s]: rudders of ships take 15 (SOLAS II-1, regulation 29);
# rad/s written as deg/s are 57 times slower.
_SLOWEST_PLANE = 100.0
# Cosine of 45 degrees: a plane whose leading edge looks elsewhere does not lift up, down or sideways.
_AHEAD = math.sqrt(0.5)
# Faster than any rudder servo [deg/s].
_FASTEST_PLANE = 1000.0
# Less is no plane [deg]: a limit in radians.
_LEAST_LIMIT = 1.0
# What may stand above the sail top, over the length: planes of a boat whose sail top is stated on the axis.
_ABOVE = 0.05
# What is on a boat is not farther from its centre of buoyancy, over the length: a cone's tip from its centroid.
_FARTHEST = 0.75
# Diameter of a propeller over the length: a large tanker has 0.03, a torpedo 0.1.
_PROPELLER = (0.01, 0.5)
# Faster than sound in air [m/s]: no blade tip, and revolutions per minute taken for those per second.
_FASTEST_TIP = 300.0
# Of what floats: displacement over weight, and how far their centres are apart along, over the length: a hundredth of
# the length is about half a degree of trim, since the longitudinal metacentre is a length above.
_AFLOAT = 0.01
_ONE_STATION = 0.02
_MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
# Floating boats displace what they weigh; a submerged one differs by what its planes can carry.
_OUT_OF_TRIM = 0.5
# Of a command, on the plane that takes most: less would never turn it to its limit, more is a slip of a digit.
_LARGEST_SHARE = (0.1, 2.0)
# Port and starboard exchanged.
_MIRROR = (1.0, -1.0, 1.0)
# Two positions are each other's mirror image when they differ by less than this part of the length.
_SAME = 1e-3
# Cosine of 5 degrees: two directions nearer to each other are read off one drawing.
_ONE_DIRECTION = 0.996
# Steepest heel or trim at rest [deg] that is a boat's: what weights on board and tanks can bring about.
_AT_REST = 45.0


def check_vehicle(vehicle: Any, where: str) -> None:
    """Refuse numbers that no body has.

    A body's mass is spread over its length: its radii of gyration about the centre of gravity are above
    zero, below its length, and the square of none exceeds the sum of the others' (the principal moments
    of inertia of any body: Goldstein, *Classical mechanics*, section 5.3). Whatever is on the boat is no
    farther from its centre of buoyancy than a cone's tip from its centroid, and the boat is as full as a sphere
    at most; its propeller has a hundredth to half of the length, and its tips are slower than sound in air. A ship
    displaces what it weighs, with its centre of gravity above that of buoyancy, not along from it. A boat that
    may heel or trim has its centre of gravity below that of buoyancy, or it lies on its side. A plane has a
    span across its chord, and is the mirror image of the plane that it mirrors, whose share of each command
    is its own seen in the mirror; all planes together lift the bow for dV > 0 and turn to starboard for dH > 0.

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


def check_shares(values: Iterable[tuple[Term, Any]], vehicle: Any) -> None:
    """Refuse thrust deductions and wake fractions that no propeller behind a hull has.

    Of the thrust T the share 1 - t moves the boat, of its speed the share 1 - w reaches the propeller (ITTC
    7.5-02-03-01.4): both above zero, or the propeller would push astern; a hull that adds as much as all of
    either is none.

    Parameters
    ----------
    values : Terms with their values; those that are no share of anything may have any.
    vehicle : For the message.

    Raises
    ------
    InputError
        Naming the coefficient, its value and what is allowed.
    """
    for term, given in values:
        for value in np.ravel(given) if term.share_of else ():
            if not abs(value) < 1.0:
                where = f"coefficients of vehicle {vehicle.name}, {term.name}"
                raise InputError(where, f"{value:.3g}", f"above -1 and below 1, a part of the {term.share_of}")


def _faults(vehicle: Any) -> Iterator[tuple[str, str, str]]:
    yield from _names(vehicle)
    yield from _mass(vehicle)
    yield from _amidships(vehicle)
    yield from _places(vehicle)
    yield from _at_rest(vehicle)
    yield from _afloat(vehicle)
    for plane in vehicle.planes:
        yield from _plane(plane, vehicle.frame.frame.sign("x"))
        yield from _image(plane, vehicle)
    yield from _commands(vehicle)
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
    if radii[0] > radii[1:].max() * (1.0 + 1e-9):
        text = "a roll radius not above those of pitch and yaw: x, y, z of a body longer than high"
        yield key, str(radii.tolist()), text
    light, dense = (given.displaced_mass.value / density / length**3 for density in _WATER)
    if light < _FULLNESS[0] or dense > _FULLNESS[1]:
        found = f"{given.displaced_mass.value:g} kg of water displaced over {length:g} m: {light:.3g} of length^3"
        yield "particulars.length", found, f"{_FULLNESS[0]:g} to {_FULLNESS[1]:.2g}, from a needle to a sphere"
    for axis, radius in zip(("pitch", "yaw"), radii[1:], strict=True):
        if not _SPREAD[0] <= radius / length <= _SPREAD[1]:
            text = f"a radius of {axis} of {radius:g} m on {length:g} m: {radius / length:.3g} of the length"
            yield key, text, f"{_SPREAD[0]:g} to {_SPREAD[1]:g} of it: the radius or particulars.length"
    least, most = (share * length for share in _PROPELLER)
    if vehicle.propeller and not least <= vehicle.diameter <= most:
        text = f"{least:.3g} to {most:.3g} m: a hundredth to half of the length of {length:g} m"
        yield "propeller.diameter", f"{vehicle.diameter:g} m", text
    if vehicle.propeller:
        tip = math.pi * vehicle.diameter * max(abs(float(n)) for n in vehicle.propeller.limits.value)
        if tip > _FASTEST_TIP:
            allowed = f"{_FASTEST_TIP:g} m/s at most: revolutions per second"
            yield "propeller.limits", f"blade tips at {tip:.4g} m/s", allowed


def _amidships(vehicle: Any) -> Iterator[tuple[str, str, str]]:
    """What a boat has once lies in its plane of symmetry; what lies beside it has an image."""
    given, centres = vehicle.particulars, vehicle.sections.centres if vehicle.sections else []
    near = _SAME * given.length.value
    once = {
        "particulars.centre_of_buoyancy": given.centre_of_buoyancy.value,
        **({"particulars.sail_top": given.sail_top.value} if given.sail_top else {}),
        **(
            {"propeller.position": vehicle.propeller.position.value}
            if vehicle.propeller and vehicle.propeller.position
            else {}
        ),
    }
    for key, place in once.items():
        if abs(place[1]) > near:
            yield key, f"{place[1]:g} m beside the plane of symmetry", "a place in it: port is starboard's image"
    for one in centres:
        image = np.array(one.position) * _MIRROR
        if not any(np.abs(image - other.position).max() <= near for other in centres):
            yield f"sections, {one.name}, position", str(one.position), f"a section at {image.tolist()} too, its image"


def _at_rest(vehicle: Any) -> Iterator[tuple[str, str, str]]:
    """How a boat lies in still water without a plane: a motion that is held needs no equilibrium."""
    given, frame = vehicle.particulars, vehicle.frame.frame
    apart = np.array(given.centre_of_gravity.value) - given.centre_of_buoyancy.value
    x, y, z = (frame.sign(axis) * apart[k] for k, axis in enumerate("xyz"))
    # A lever below the rounding of a drawing's numbers makes no angle.
    small = 1e-9 * given.length.value
    for free, arm, motion in (("K", y, "heel"), ("M", x, "trim")):
        if free in held(vehicle.term_set):
            continue
        key = "particulars.centre_of_gravity"
        if z < -small:
            allowed = "a centre of gravity below it: held up by nothing, a submerged boat turns over"
            yield key, f"{-z:.4g} m above the centre of buoyancy", allowed
        angle = math.degrees(math.atan2(abs(arm), z)) if abs(arm) > small else 0.0
        if angle > _AT_REST:
            text = f"{abs(arm):.4g} m off the centre of buoyancy and {z:.4g} m below it: a {motion} of {angle:.3g} deg"
            yield key, f"{text} at rest", f"{_AT_REST:g} deg at most"


def _afloat(vehicle: Any) -> Iterator[tuple[str, str, str]]:
    """A ship, whose heave and pitch are held, displaces what it weighs and lies on an even keel (Archimedes)."""
    if not {"Z", "M"} <= set(held(vehicle.term_set)):
        return
    given = vehicle.particulars
    share = given.displaced_mass.value / given.mass.value
    if abs(share - 1.0) > _AFLOAT:
        yield "particulars.displaced_mass", f"{share:.4g} times the mass", "the mass: what floats displaces its weight"
    apart = abs(given.centre_of_gravity.value[0] - given.centre_of_buoyancy.value[0])
    if apart > _ONE_STATION * given.length.value:
        allowed = f"{_ONE_STATION * given.length.value:.3g} m at most: above one another, or the ship trims"
        yield "particulars.centre_of_gravity", f"{apart:.4g} m along from the centre of buoyancy", allowed


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
        if away > _FARTHEST * length:
            text = f"{_FARTHEST * length:.4g} m at most: a place on the boat, which is {length:g} m long"
            yield key, f"{away:.4g} m from the centre of buoyancy", text
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


def _plane(plane: Any, ahead: float) -> Iterator[tuple[str, str, str]]:
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
    if ahead * chord[0] < _AHEAD * sizes[1]:
        yield f"{key}, leading_edge", str(plane.leading_edge), "a leading edge that looks ahead, 45 deg off at most"
    if not _LEAST_LIMIT <= plane.limit_deg <= 90.0:
        yield f"{key}, limit_deg", f"{plane.limit_deg:g}", f"{_LEAST_LIMIT:g} to 90, in degrees"
    if plane.rate_degps > _FASTEST_PLANE:
        yield f"{key}, rate_degps", f"{plane.rate_degps:g}", f"{_FASTEST_PLANE:g} at most"
    if plane.limit_deg > _SLOWEST_PLANE * plane.rate_degps:
        allowed = f"{plane.limit_deg / _SLOWEST_PLANE:.3g} or more: its limit reached in {_SLOWEST_PLANE:g} s"
        yield f"{key}, rate_degps", f"{plane.rate_degps:g}", allowed


def _image(plane: Any, vehicle: Any) -> Iterator[tuple[str, str, str]]:
    """What differs between a plane's mirror image and the plane that is said to be that."""
    key = f"planes, {plane.name}"
    partner = next(p for p in vehicle.planes if p.name == plane.mirror)
    if partner.mirror != plane.name:
        yield f"{key}, mirror", f"{plane.mirror!r}, which mirrors {partner.mirror!r}", "planes that mirror each other"
    image = np.array(plane.position) * _MIRROR
    if np.abs(image - partner.position).max() > _SAME * vehicle.particulars.length.value:
        yield f"{key}, mirror", f"{plane.mirror!r} at {partner.position}", f"the plane at {image.tolist()}"
    # The span of a pair may be drawn to either side: what it turns by is then counted the other way.
    for name, either_way in (("span_axis", True), ("leading_edge", False)):
        turned, there = np.array(getattr(plane, name)) * _MIRROR, np.array(getattr(partner, name))
        alike = float(turned @ there) / float(np.linalg.norm(turned) * np.linalg.norm(there))
        if (abs(alike) if either_way else alike) < _ONE_DIRECTION:
            found = f"{getattr(plane, name)}, and {getattr(partner, name)} of {partner.name}"
            yield f"{key}, {name}", found, f"each other's mirror image, as {turned.tolist()} of {partner.name}"
            return
    sign = float(np.sign(plane.lift_axis * _MIRROR @ partner.lift_axis))
    share = {"dV": sign * plane.mixer.dV, "dH": -sign * plane.mixer.dH}
    for name, wanted in share.items():
        found = getattr(partner.mixer, name)
        if abs(found - wanted) > _SAME * max(abs(found), abs(wanted)):
            what = "both sides alike" if name == "dV" else "the two sides opposed"
            text = f"{getattr(plane.mixer, name):g}, and {found:g} of {partner.name}"
            yield f"{key}, mixer.{name}", text, f"{wanted + 0.0:g} of {partner.name}: the command moves {what}"
    for name in ("limit_deg", "rate_degps"):
        one, other = getattr(plane, name), getattr(partner, name)
        if one != other:
            yield f"{key}, {name}", f"{one:g}, and {other:g} of {partner.name}", "the same of a mirror image"


def _commands(vehicle: Any) -> Iterator[tuple[str, str, str]]:
    """dV > 0 lifts the bow, dH > 0 turns to starboard (docs/conventions.md): what all planes do together."""
    frame = vehicle.frame.frame
    middle = vehicle.particulars.centre_of_buoyancy.value[0]
    for name, axis, what in (("dV", 2, "lifts the bow"), ("dH", 1, "turns to starboard")):
        turning, shares = 0.0, 0.0
        for plane in vehicle.planes:
            arm = frame.sign("x") * (plane.position[0] - middle)
            # Lift to starboard ahead turns to starboard; lift down ahead turns the bow down.
            lift = frame.sign("xyz"[axis]) * float(plane.lift_axis[axis]) * (1.0 if name == "dH" else -1.0)
            turning += arm * lift * getattr(plane.mixer, name)
            shares = max(shares, abs(arm * lift * getattr(plane.mixer, name)))
        most = max((abs(getattr(plane.mixer, name)) for plane in vehicle.planes), default=0.0)
        if most and not _LARGEST_SHARE[0] <= most <= _LARGEST_SHARE[1]:
            allowed = f"{_LARGEST_SHARE[0]:g} to {_LARGEST_SHARE[1]:g} of it on the plane that takes most"
            yield f"planes, mixer.{name}", f"{most:g} of the command at most", allowed
        if turning < -_SAME * shares:
            found = f"shares of {name} that do the opposite together"
            yield (
                f"planes, mixer.{name}",
                found,
                f"{name} > 0 {what}: the sign of each share, span_axis or leading_edge",
            )
