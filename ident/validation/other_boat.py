"""A case flown with another boat, or at another speed, depth or angle, than the one it was written for.

What belongs to the case's own boat (references, published values, tolerances) does not go with it. A
bundled case is brought to the size and the speed of the other boat: lengths with the ratio of lengths, times with
that of lengths over speeds; autopilot gains keep their meaning. The speed is that asked for, that which the vehicle
states as that of its maneuvers, or that of Froude's law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ident.options import Conditions
from sim.boat.catalogue import held
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.files.toml_files import bundled
from sim.flight.case import Case
from sim.flight.commands import Commands, Event
from sim.flight.simulate import mixer_of
from sim.flight.simulation import Simulation

# Powers of length and time of what an event watches; of a rate of change, one more of time.
_WATCHED = {"D0": (1, 0), "z": (1, 0), "x": (1, 0), "y": (1, 0), "point_depth": (1, 0)}
_WATCHED |= {"u": (1, -1), "v": (1, -1), "w": (1, -1), "U": (1, -1), "p": (0, -1), "q": (0, -1), "r": (0, -1)}
# Gains: proportional, integral and differential, of an angle on a distance, an angle, a yaw rate; of revolutions on a
# speed.
_GAINS = {"z": (-1, 0), "y": (-1, 0), "theta": (0, 0), "psi": (0, 0), "r": (0, 1), "u": (-1, 0)}
_TIMES = {"P": 0, "I": -1, "D": 1}
_DEPTHS = ("D0", "z", "point_depth")
_STOPS = math.radians(0.01)


@dataclass(frozen=True)
class _Size:
    """Length and time of the other boat over those of the case's own, and the revolutions of its propeller [1/s]."""

    length: float
    time: float
    most_rps: float

    def of(self, powers: tuple[int, int], times: int = 0) -> float:
        """Factor on a quantity with these powers of length and time, and more of time."""
        return self.length ** powers[0] * self.time ** (powers[1] + times)


def _event(event: Event, size: _Size) -> Event:
    """An event at the size of the other boat; levels of depth are where they are."""
    powers = _WATCHED.get(event.channel or "", (0, 0))
    moved: dict[str, Any] = {}
    for key, factor in (("after_s", size.time), ("for_s", size.time), ("steady", size.of(powers, -1))):
        if getattr(event, key) is not None:
            moved[key] = getattr(event, key) * factor
    if event.change is not None:
        moved["change"] = event.change * size.of(powers)
    if event.point_m is not None:
        moved["point_m"] = [x * size.length for x in event.point_m]
    return event.model_copy(update=moved)


def _commands(command: Commands, size: _Size) -> Commands:
    updates: dict[str, Any] = {}
    for axis in ("dV", "dH", "n"):
        one = getattr(command, axis)
        moved: dict[str, Any] = {}
        for name in type(one).model_fields:
            kind, _, of = name.partition("_")
            if kind in _TIMES and of in _GAINS:
                moved[name] = getattr(one, name) * size.of(_GAINS[of], _TIMES[kind])
        steps = []
        for step in one.step:
            change: dict[str, Any] = {"until": [_event(e, size) for e in step.until]}
            for key, factor in (
                ("distance_m", size.length),
                ("yaw_rate_degps", 1.0 / size.time),
                ("value_rps", 1.0 / size.time),
            ):
                if getattr(step, key, None):
                    change[key] = getattr(step, key) * factor
            steps.append(step.model_copy(update=change))
        if getattr(one, "limits_rps", None):
            # Those of the case let its own boat go astern: the other one does so as fast as it goes ahead.
            most = max(abs(limit) for limit in one.limits_rps)
            moved["limits_rps"] = [limit / most * size.most_rps for limit in one.limits_rps]
        updates[axis] = one.model_copy(update=moved | {"step": steps})
    return command.model_copy(update=updates)


def _resized(case: Case, size: _Size) -> Case:
    """Times, speed, gains and events at the size of the other boat; the depth stays, so that deep is deep."""
    run = case.run.model_copy(
        update={
            "duration_s": case.run.duration_s * size.time,
            "record_s": case.run.record_s * size.time,
            "step_s": min(case.run.step_s, case.run.step_s * size.time),
            "stop": [_event(e, size) for e in case.run.stop],
        }
    )
    initial = case.initial.model_copy(update={"speed_mps": case.initial.speed_mps * size.of((1, -1))})
    return case.model_copy(update={"run": run, "initial": initial, "command": _commands(case.command, size)})


def _to_its_size(case: Case, home: Vehicle, vehicle: Vehicle, asked: float | None) -> tuple[Case, list[str]]:
    """A bundled case at the size of another boat: at the speed asked for, else the boat's own, else by Froude's law."""
    length = vehicle.particulars.length.value / home.particulars.length.value
    here, stated = case.initial.speed_mps, vehicle.particulars.approach_speed
    speed = asked or (stated.value if stated else here * math.sqrt(length))
    time = length * here / speed if here else math.sqrt(length)
    most = vehicle.needed_propeller("a standard maneuver").limits.value[1]
    moved = _resized(case, _Size(length, time, most))
    if not here:
        return moved, []
    moved = moved.model_copy(update={"initial": moved.initial.model_copy(update={"speed_mps": speed})})
    if asked:
        return moved, [f"times and gains of {home.name} brought to {speed:.4g} m/s as lengths over speeds"]
    if stated:
        why = f"the approach speed of {vehicle.name}, times and gains as lengths over speeds"
    else:
        why = f"by Froude's law, times and gains alike; {vehicle.name} states no particulars.approach_speed"
    return moved, [f"speed {here:.4g} m/s of {home.name} brought to {speed:.4g} m/s, {why}; --speed states another"]


def _afloat(case: Case) -> Case:
    """A case of a boat that keeps to the surface: at depth 0, which is no event that ends it."""
    stops = [e for e in case.run.stop if e.channel not in _DEPTHS]
    run, initial = (
        case.run.model_copy(update={"stop": stops}),
        case.initial.model_copy(update={"depth_m": 0.0}),
    )
    return case.model_copy(update={"run": run, "initial": initial})


def largest_command(case: Case, vehicle: Vehicle, axis: str) -> float | None:
    """Largest dV or dH [deg] that some plane can follow; None where no plane has a share in it."""
    shares = np.abs(mixer_of(vehicle, case.sail_planes)[:, 0 if axis == "dV" else 1])
    reach = [p.limit_deg / s for p, s in zip(vehicle.planes, shares, strict=True) if s > 0.0]
    return max(reach) if reach else None


def _turned(value: float | None, to: float) -> float | None:
    return value if not value else math.copysign(to, value)


def _angles(case: Case, axis: str, angle: float | None, most: float | None) -> tuple[Case, list[str]]:
    """Commands of one axis set to an angle, or brought within what the planes can do."""
    one = getattr(case.command, axis)
    moved: dict[str, Any] = {}
    notes: list[str] = []

    def wanted(value: float, name: str) -> float:
        to = angle if angle is not None else abs(value)
        if most is not None and to > most + 1e-9:
            notes.append(f"{axis} {name}: {to:g} deg asked, the planes stop at {most:g} deg, which is flown")
            to = most
        return math.copysign(to, value)

    if one.law == "zigzag":
        moved["first_deg"] = wanted(one.first_deg, "of the zigzag")
    elif one.law == "fixed" and one.value_deg:
        moved["value_deg"] = wanted(one.value_deg, "command")
    elif one.law == "programme":
        # A programme keeps its proportions: its largest angle is the one asked for.
        values = [abs(s.value_deg) for s in one.step if s.value_deg]
        if values:
            factor = wanted(max(values), "of the programme") / max(values)
            moved["step"] = [
                s.model_copy(update={"value_deg": s.value_deg * factor}) if s.value_deg else s for s in one.step
            ]
    if not moved:
        return case, []
    command = case.command.model_copy(update={axis: one.model_copy(update=moved)})
    return case.model_copy(update={"command": command}), notes


def _title(case: Case, vehicle: Vehicle) -> str:
    """What is flown, in its own angles; the case's name would say those of another boat."""
    zigzags = [axis for axis in ("dV", "dH") if getattr(case.command, axis).law == "zigzag"]
    name = (case.maneuver or case.name).replace("_", " ").replace("-", " ")
    if zigzags:
        name = "vertical zigzag" if zigzags == ["dV"] else "zigzag"
    angles = []
    for axis in ("dV", "dH"):
        one = getattr(case.command, axis)
        if one.law == "zigzag":
            angles.append(f"{axis} {one.first_deg:g} deg at {one.check_deg:g} deg")
        elif one.law == "fixed" and one.value_deg:
            angles.append(f"{axis} {one.value_deg:g} deg")
    speed = [f"{case.initial.speed_mps:.3g} m/s"] if case.initial.speed_mps else ["at rest"]
    words = ", ".join([*angles, *speed, f"D0 {case.initial.depth_m:g} m"])
    return f"{name.capitalize()} of {vehicle.name}: {words}"


def for_boat(case: Case, where: str, vehicle: Vehicle, conditions: Conditions) -> tuple[Case, list[str]]:
    """A case as another boat flies it, or at another speed, depth or angle.

    Parameters
    ----------
    case, where : From ``load_case``.
    vehicle : What flies it.
    conditions : Instead of the case's.

    Returns
    -------
    case : With the boat's name and, where anything changed, a title that says what is flown.
    notes : What was left out, scaled or limited.

    Raises
    ------
    InputError
        For an angle where the case commands none.
    """
    at_home, changed = vehicle.name == case.vehicle or _home(case, where) == vehicle.name, conditions != Conditions()
    if at_home and not changed:
        return case.model_copy(update={"vehicle": vehicle.name}), []
    notes: list[str] = []
    home = case.vehicle
    if case.reference or case.published or case.tolerance:
        what = "of " + home if not at_home else "at the case's own speed, depth and angle"
        notes.append(f"references, published values and tolerances {what} left out")
    moved = case.model_copy(update={"vehicle": vehicle.name, "reference": None, "published": [], "tolerance": []})
    if not at_home and where in bundled("cases"):
        moved, said = _to_its_size(moved, load_vehicle(home), vehicle, conditions.speed_mps)
        notes += said
        if "Z" in held(vehicle.term_set):
            moved = _afloat(moved)
            notes.append(f"depth 0: {vehicle.name} floats, the terms of {vehicle.term_set} have no heave")
    update = {k: v for k, v in (("speed_mps", conditions.speed_mps), ("depth_m", conditions.depth_m)) if v is not None}
    moved = moved.model_copy(update={"initial": moved.initial.model_copy(update=update)})
    for axis in ("dV", "dH"):
        moved, said = _angles(moved, axis, conditions.angle_deg, largest_command(case, vehicle, axis))
        notes += said
    if conditions.angle_deg is not None and not _commanded(moved):
        raise InputError(f"case {case.name}, --angle", f"{conditions.angle_deg:g} deg", "a case that commands an angle")
    return moved.model_copy(update={"title": _title(moved, vehicle)}), notes


def _home(case: Case, where: str) -> str:
    """Name of the vehicle that the case names, which may be a path."""
    if not case.vehicle.endswith(".toml"):
        return case.vehicle
    return load_vehicle(case.vehicle, beside=where).name


def _commanded(case: Case) -> list[str]:
    """Axes to which the case gives an angle, by itself or by a programme."""
    commanded = []
    for axis in ("dV", "dH"):
        one = getattr(case.command, axis)
        fixed = one.law == "fixed" and bool(one.value_deg)
        if fixed or one.law == "zigzag" or any(s.value_deg or s.yaw_rate_degps or s.distance_m for s in one.step):
            commanded.append(axis)
    return commanded


@dataclass(frozen=True)
class Saturated:
    """An actuator that lay at its limit.

    Attributes
    ----------
    actuator : A plane, or n.
    limit, unit : The limit, in its unit.
    share_of_time : Share of the flight, 0 to 1.

    Examples
    --------
    >>> import ident
    >>> done = ident.validate("my-boat/zigzag.toml", db="coeff_db", version=0)
    >>> [one.actuator for one in done.saturated if one.share_of_time > 0.5]
    []
    """

    actuator: str
    limit: float
    unit: str
    share_of_time: float


def saturated(simulation: Simulation, case: Case, vehicle: Vehicle) -> list[Saturated]:
    """Actuators that lay at their limit for part of a flight: which, at what, for what share of the time."""
    at_limit = []
    for plane in vehicle.planes:
        share = float(np.mean(np.abs(simulation[plane.name]) >= math.radians(plane.limit_deg) - 1e-9))
        if share > 0.0:
            at_limit.append(Saturated(plane.name, plane.limit_deg, "deg", share))
    for limit in case.command.n.limits_rps or vehicle.needed_propeller("a flight").limits.value:
        share = float(np.mean(np.abs(simulation["n"] - limit) <= 1e-9))
        if share > 0.0 and case.command.n.law != "fixed":
            at_limit.append(Saturated("n", float(limit), "1/s", share))
    return at_limit


def check_answers(simulation: Simulation, case: Case, vehicle: Vehicle) -> None:
    """Refuse a flight whose commands change nothing.

    Raises
    ------
    InputError
        When planes are commanded and neither turn nor pitch of the boat leaves its start.
    """
    for axis in _commanded(case):
        angle, track = ("psi", "y") if axis == "dH" else ("theta", "z")
        if largest_command(case, vehicle, axis) is None:
            wrong = f"{axis} is commanded, and no plane of {vehicle.name} has a share in it"
        elif np.ptp(simulation[angle]) < _STOPS and np.ptp(simulation[track]) < 1e-6 * simulation.length:
            wrong = f"a flat line: {axis} is commanded, and {angle} of {vehicle.name} does not change"
        else:
            continue
        allowed = "a version with the loads of its planes or rudder: terms in the term set and rows in the database"
        raise InputError(f"case {case.name}", wrong, allowed)
