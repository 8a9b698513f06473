"""Which terms a vehicle uses, and how the port/starboard mirror maps them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sim.boat import catalogue
from sim.boat.catalogue import MIRROR_OUTPUT, Term
from sim.boat.vehicle import Plane, Vehicle
from sim.files.errors import InputError

Point = tuple[float, ...]


def vehicle_terms(vehicle: Vehicle) -> tuple[Term, ...]:
    """The rows of the term table that apply to a vehicle.

    Whole-boat derivatives of added mass only where the vehicle takes its inertia from them;
    sections only where it has some (they then carry wave loads alone). Terms of planes
    or of a propeller the vehicle does not have are left out.
    """
    out_of_use = "added mass" if vehicle.added_mass == "sections" else ""
    planes = {p.name for p in vehicle.planes}
    driven = ("propeller",) if vehicle.propeller else ()
    return tuple(
        t
        for t in all_terms(vehicle)
        if t.group != out_of_use and (t.part in ("hull", "section", *driven) or t.part in planes)
    )


def all_terms(vehicle: Vehicle) -> tuple[Term, ...]:
    """The rows of a vehicle's term set and those of its own term file.

    Raises
    ------
    InputError
        For an own term file that cannot be used, or a term of a part the vehicle does not have.
    """
    if vehicle.terms is None:
        return catalogue.terms(vehicle.term_set)
    # Few vehicles have any.
    from sim.boat.own_terms import own_terms

    path = Path(vehicle.terms)
    changed = path.stat().st_mtime_ns if path.is_file() else 0
    added = own_terms(vehicle.terms, vehicle.term_set, changed)
    for term in added:
        if term.part not in (*vehicle.part_names(), "section"):
            raise InputError(f"{path}, term {term.name}, column part", repr(term.part), ", ".join(vehicle.part_names()))
    return (*catalogue.terms(vehicle.term_set), *added)


def parts_of(term: Term, vehicle: Vehicle) -> list[str]:
    """The parts that carry a coefficient of this term: one, or every section."""
    if term.part != "section":
        return [term.part]
    return [s.name for s in vehicle.sections.centres] if vehicle.sections else []


@dataclass(frozen=True)
class Mirror:
    """The mirror image of a coefficient: which term, with which sign and axis signs."""

    name: str
    part: str
    sign: int
    axis_signs: tuple[int, ...]

    def point(self, point: Point) -> Point:
        """The tabulated point seen in the mirror."""
        return tuple(s * x + 0.0 for s, x in zip(self.axis_signs, point, strict=True))


def _deflection_sign(plane: Plane, partner: Plane) -> int:
    """+1 when the mirrored plane deflects with the same sign as its partner."""
    mirrored = plane.lift_axis * np.array([1.0, -1.0, 1.0])
    return 1 if float(mirrored @ partner.lift_axis) > 0 else -1


def mirror_of(term: Term, part: str, vehicle: Vehicle) -> Mirror:
    """How the port/starboard mirror maps a coefficient.

    Parameters
    ----------
    term, part : The coefficient and the part that carries it.
    vehicle : For the partner of a plane.

    Returns
    -------
    Mirror with C_mirror(axis_signs * x) = sign * C(x).
    """
    planes = {p.name: p for p in vehicle.planes}
    if part not in planes or not term.output:
        signs = tuple(catalogue.axes()[a].mirror for a in term.axes)
        return Mirror(term.name, part, term.mirror_sign(), signs)
    partner = planes[planes[part].mirror]
    turn = _deflection_sign(planes[part], partner)
    sign = MIRROR_OUTPUT[term.output]
    for factor in term.factors:
        sign *= turn if factor == "deflection" else -1 if factor in catalogue.MIRRORED_FACTORS else 1
    like = [
        t
        for t in all_terms(vehicle)
        if t.part == partner.name and t.output == term.output and t.factors == term.factors
    ]
    if not like:
        where = f"vehicle {vehicle.name}, term {term.name}"
        raise InputError(where, f"no such term of {partner.name}", f"the same row for {partner.name}, the mirror image")
    signs = tuple(turn if a == "delta" else catalogue.axes()[a].mirror for a in term.axes)
    return Mirror(like[0].name, partner.name, sign, signs)
