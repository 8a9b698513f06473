"""What lines give where no run does: derivatives, added mass, cross-flow drag and resistance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.estimates.cross_flow import literature_drag, strips
from ident.estimates.draft import Draft, Mask, NotApplicable
from ident.estimates.turning import Given
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import Vehicle
from sim.files.constants import constant
from sim.files.errors import InputError
from sim.hull.derivatives import Derivative, derivatives
from sim.hull.slender import Lines, NoHull, friction, hull_added_mass, lines

Array = NDArray[np.float64]

# Table over the flow angles that holds a derivative in the reduced set, and its axis.
_TABLES = {
    name: (name[0] + "_uvw", "beta" if name[2] == "v" else "alpha") for name in ("Y_v", "N_v", "K_v", "Z_w", "M_w")
}
_ANGLES = (-12.0, -8.0, -4.0, 4.0, 8.0, 12.0)
# Added mass: term -> key of ``hull_added_mass``, sign, power of L. Fins and sail are not in it: measured added mass of
# SUBOFF with all its appendages is below that of its hull by potential flow.
_ADDED = {
    "X_udot": ("udot", -1.0, 3),
    "Y_vdot": ("vdot", -1.0, 3),
    "Z_wdot": ("vdot", -1.0, 3),
    "M_qdot": ("rdot", -1.0, 5),
    "N_rdot": ("rdot", -1.0, 5),
    "Y_rdot": ("vr", -1.0, 4),
    "N_vdot": ("vr", -1.0, 4),
    "Z_qdot": ("vr", 1.0, 4),
    "M_wdot": ("vr", 1.0, 4),
}
_ADDED_ERROR = constant("added_mass_range")
# Resistance on the friction line.
_FORM, _FORM_ERROR = constant("form_factor"), constant("form_factor_range")
_WORD = "lines"


def from_lines(draft: Draft, given: Given) -> str:
    """Derivatives, added mass, cross-flow drag and resistance that no run gives, from the lines.

    A run of a term takes the place of its estimate.

    Raises
    ------
    NotApplicable
        Without a hull's lines; for a published set, whose authors have said what they leave out, unless its campaign
        asks for it; when runs give all.
    InputError
        For lines that cannot be read.
    """
    if draft.rows["origin"].eq("published").any() and not given.complete:
        raise NotApplicable("the set is as its authors give it")
    try:
        hull = lines(draft.vehicle)
    except NoHull as error:
        raise NotApplicable(str(error)) from error
    by_part = draft.where(["[YZ]_d*"]).any()
    try:
        known = derivatives(draft.vehicle, with_fins=not by_part)
    except InputError as error:
        raise NotApplicable(str(error)) from error
    named = {t.name: t for t in vehicle_terms(draft.vehicle)}
    done: list[str] = []
    for name, one in known.items():
        table = _TABLES.get(name, ("", ""))[0]
        if name in named and not draft.has(name):
            _add(draft, name, [{}], np.array([one.value]), {c: np.array([x]) for c, x in one.errors.items()})
            done.append(name)
        elif table in named and not draft.has(table):
            _add_over_angles(draft, name, one)
            done.append(table)
    if draft.vehicle.added_mass == "derivatives":
        done += _add_added_mass(draft, hull)
    done += _add_drag(draft, hull)
    if not done:
        raise NotApplicable("runs give all that lines would")
    return ", ".join(done)


def _add(draft: Draft, name: str, points: list[dict[str, float]], value: Array, errors: dict[str, Array]) -> Mask:
    """Rows of a term at points, zero along its other axes, with errors that the lines' derivatives share."""
    axes = next(t.axes for t in vehicle_terms(draft.vehicle) if t.name == name)
    places = [{a: _at(draft, a) for a in axes} | p for p in points]
    new = draft.add(name, places, [float(x) for x in value], _WORD)
    for cause, change in errors.items():
        whole = np.zeros(len(new))
        whole[new] = change
        draft.spread(f"{_WORD}: {cause}", whole)
    return new


def _at(draft: Draft, axis: str) -> float:
    """Where along an axis an estimate stands that does not depend on it: the deepest, the fastest, else zero."""
    if axis not in ("D0", "U"):
        return 0.0
    # What stands there once is not moved by the rows that are put there.
    if (place := draft.memo.get(f"lines at {axis}")) is None:
        known = draft.axis(axis)
        known = known[np.isfinite(known)]
        place = draft.memo[f"lines at {axis}"] = float(known.max()) if known.size else 0.0
    assert isinstance(place, float)
    return place


def _add_over_angles(draft: Draft, name: str, one: Derivative) -> None:
    """A derivative and the cross-flow drag beside it as a table over a flow angle."""
    table, angle = _TABLES[name]
    alpha = np.radians(_ANGLES)
    second, error = _second_order(draft.vehicle, name)
    form, square = np.sin(alpha) * np.cos(alpha), np.sin(alpha) * np.abs(np.sin(alpha))
    errors = {cause: x * form for cause, x in one.errors.items()} | {"cross-flow drag": error * square}
    _add(draft, table, [{angle: float(a)} for a in alpha], one.value * form + second * square, errors)


def _second_order(vehicle: Vehicle, name: str) -> tuple[float, float]:
    """Coefficient of v|v| or w|w| by cross-flow drag in a load, and its deviation."""
    if name[0] not in "YNZM":
        return 0.0, 0.0
    hull = strips(vehicle, vertical=name[0] in "ZM")
    drag, error = literature_drag(hull)
    length, moment = vehicle.particulars.length.value, name[0] in "NM"
    unit = hull.moment_of_area(int(moment)) / length ** (3 if moment else 2)
    sign = 1.0 if name[0] == "M" else -1.0
    return sign * drag * unit, sign * error * unit


def _add_added_mass(draft: Draft, hull: Lines) -> list[str]:
    """Added mass of the hull where none is known."""
    known, length = hull_added_mass(hull), draft.vehicle.particulars.length.value
    names = {t.name for t in vehicle_terms(draft.vehicle)}
    done = []
    for name, (key, sign, power) in _ADDED.items():
        if name not in names or draft.has(name):
            continue
        value = np.array([2.0 * sign * known[key] / length**power])
        _add(draft, name, [{}], value, {"added mass": _ADDED_ERROR * value})
        done.append(name)
    return done


def _add_drag(draft: Draft, hull: Lines) -> list[str]:
    """Resistance by the friction line, and drag across the flow in a set of constants."""
    names = {t.name for t in vehicle_terms(draft.vehicle)}
    length = draft.vehicle.particulars.length.value
    done: list[str] = []
    # At a Froude number of 0.2; the friction line moves by 2 % for half and for double.
    reynolds = 0.2 * np.sqrt(constant("standard_gravity") * length) * length / constant("sea_water_viscosity")
    value = np.array([-_FORM * friction(reynolds) * hull.wetted / length**2])
    for name in ("X_uu", "X_uvw"):
        if name in names and not draft.has(name):
            _add(draft, name, [{}], value, {"resistance": _FORM_ERROR * value})
            done.append(name)
    for name in ("Y_v|v|", "N_v|v|", "Z_w|w|", "M_w|w|"):
        if name in names and not draft.has(name):
            second, error = _second_order(draft.vehicle, name)
            _add(draft, name, [{}], np.array([second]), {"cross-flow drag": np.array([error])})
            done.append(name)
    return done
