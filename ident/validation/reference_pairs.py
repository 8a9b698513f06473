"""Series of one source against each other, and against the flight: rates and angles, units taken for another."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ident.captive.unit_slips import factor_between
from ident.validation.reference_limits import Scales, limits, scales
from ident.validation.trial_reference import TRIAL
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.files.record import Record
from sim.flight.case import Case
from sim.flight.commands import PlaneCommand
from sim.flight.series import Series, place_of
from sim.flight.simulation import Simulation

Array = NDArray[np.float64]
_LEADS = ("y", "z", "D0", "dz_over_L0")
# One channel, what it follows from, and its rate by that.
_EXPECTED: tuple[tuple[str, str, Callable[[Array, Scales], Array]], ...] = (
    ("psi", "r", lambda value, scale: value),
    ("theta", "q", lambda value, scale: value),
    ("phi", "p", lambda value, scale: value),
    ("y", "psi", lambda value, scale: np.sin(value)),
    ("dz_over_L0", "theta", lambda value, scale: -np.sin(value - value[0]) / scale.length),
    ("z", "theta", lambda value, scale: -np.sin(value - value[0])),
    ("D0", "theta", lambda value, scale: -np.sin(value - value[0])),
)


def check_pairs(case: Case, reference: Series, vehicle: Vehicle, where: str) -> list[str]:
    """Refuse series of one source that contradict each other: an angle its rate, a place the heading that leads there.

    Parameters
    ----------
    case, reference, vehicle, where : As ``check_records``.

    Returns
    -------
    Notes on angles and rates that do not go together.

    Raises
    ------
    InputError
        Naming file, source and both channels, the factor between them and their correlation.
    """
    named, said = limits(), []
    for source, channels in reference.data.items():
        scale = scales(case, vehicle, source, reference.abscissa)
        for one, other, expected in _EXPECTED:
            if one not in channels or other not in channels or (reference.abscissa == "s" and one not in _LEADS):
                continue
            found = _regressed(channels[one], channels[other], expected(channels[other].value, scale))
            if found is None:
                continue
            if abs(found[1]) < named["pair_correlation"]:
                if one not in _LEADS:
                    text = f"{one} and what {other} leads to do not go together (correlation {found[1]:.2f})"
                    said.append(f"reference {source}: {text}: a part in another unit, or of the other sign?")
                continue
            slope = found[0] / (scale.way if one in _LEADS else 1.0)
            least, most = 1.0 / named["pair_slope"], named["pair_slope"]
            if one in _LEADS:
                wider = 1.0 if scale.steady else named["pair_unsteady"]
                least, most = named["pair_lead_least"] / wider, named["pair_lead_most"] * wider
            if not least < slope < most:
                text = f"{one} is {slope:.3g} times what {other} leads to (correlation {found[1]:.2f})"
                allowed = f"{least:.2g} to {most:.2g} times: the unit or the sign of one of them"
                raise InputError(f"{place_of(reference, where, source, one, 0)} and below, column value", text, allowed)
        if source != TRIAL:
            _check_side(case, reference, scale, source, where)
        if reference.abscissa == "s" and {"x", "y"} <= set(channels):
            _check_path(reference, source, where)
    return said


def _check_path(reference: Series, source: str, where: str) -> None:
    """Refuse a track that is not as long as the path length that it is given over."""
    named = limits()
    x, y = reference[source]["x"], reference[source]["y"]
    if len(x) < 3 or not np.array_equal(x.abscissa, y.abscissa):
        return
    gone, along = np.hypot(np.diff(x.value), np.diff(y.value)).sum(), float(np.ptp(x.abscissa))
    if not named["path_least"] <= gone / along <= named["path_most"]:
        place = f"{place_of(reference, where, source, 'x', 0)} and below, columns s and value"
        found = f"a track of {gone:.5g} m by x and y over {along:.5g} m of path length: {gone / along:.3g}"
        raise InputError(place, found, f"{named['path_least']:g} to {named['path_most']:g}: the unit of s, x or y")


def _check_side(case: Case, reference: Series, scale: Scales, source: str, where: str) -> None:
    """Refuse a record that turns to the other side first than the case is commanded to."""
    named = limits()
    words = {"dH": ("starboard", "port"), "dV": ("bow up", "bow down")}
    begins = {"psi": ("dH", named["side_angle"]), "y": ("dH", named["side_length"] * scale.length)}
    begins["theta"] = ("dV", named["side_angle"])
    for channel, (axis, counts) in begins.items():
        record, ordered = reference[source].get(channel), _first_order(getattr(case.command, axis))
        if record is None or not ordered:
            continue
        moved = record.value - record.value[0]
        far = np.flatnonzero(np.abs(moved) > counts)
        if far.size and moved[far[0]] * ordered < 0.0:
            side, other = words[axis] if moved[far[0]] > 0.0 else words[axis][::-1]
            found = f"{channel} goes to {side} first, the case to {other}"
            allowed = "a record of the maneuver that is flown: the sign of the values, or the frame"
            raise InputError(
                f"{place_of(reference, where, source, channel, int(far[0]))}, column value", found, allowed
            )


def _first_order(command: PlaneCommand) -> float:
    """First angle that planes are ordered to [deg]; zero for an autopilot, and for less than planes' trim."""
    if command.law == "zigzag":
        first = command.first_deg
    elif command.law == "fixed":
        first = command.value_deg
    else:
        first = next((s.value_deg or s.from_trim_deg or 0.0 for s in command.step), 0.0)
    return first if abs(first) >= limits()["side_order"] else 0.0


def _regressed(one: Record, other: Record, rates: Array) -> tuple[float, float] | None:
    """Slope and correlation of a channel on the integral of what gives its rate; None where one does not move."""
    inside = (one.abscissa >= other.abscissa[0]) & (one.abscissa <= other.abscissa[-1])
    if int(inside.sum()) < 8:
        return None
    total = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(other.abscissa))])
    return _line(np.interp(one.abscissa[inside], other.abscissa, total), one.value[inside])


def _line(like: Array, value: Array) -> tuple[float, float] | None:
    """Slope and correlation; None where one of the two does not move."""
    if float(np.ptp(like)) < 1e-12 or float(np.ptp(value)) < 1e-12:
        return None
    return float(np.polyfit(like - like[0], value, 1)[0]), float(np.corrcoef(like, value)[0, 1])


def units_by_flight(
    case: Case, reference: Series, simulation: Simulation, as_started: dict[str, Simulation]
) -> list[str]:
    """Notes on series that are as the flight but for a unit's factor or the sign.

    Parameters
    ----------
    case, reference, simulation, as_started : As ``beyond_the_run``.
    """
    named, said = limits(), []
    for source in case.reference.compare if case.reference else []:
        flight = as_started.get(source, simulation)
        for channel, record in reference[source].items():
            if not case.reference or channel not in case.reference.channels:
                continue
            inside = record.abscissa <= float(flight[reference.abscissa][-1])
            if int(inside.sum()) < 8:
                continue
            flown = np.interp(record.abscissa[inside], flight[reference.abscissa], flight[channel])
            line = _line(flown, record.value[inside])
            if line is None or abs(line[1]) < named["alike_correlation"]:
                continue
            slip = factor_between(line[0])
            factor = abs(math.log(max(abs(line[0]), 1e-300))) > math.log(named["alike_slope"])
            if line[0] < 0.0 or (slip and factor):
                what = f"{channel} is {line[0]:.3g} times what is flown (correlation {line[1]:.2f})"
                said.append(f"reference {source}: {what}: {slip[1] if slip and factor else 'the sign of one of them'}?")
    return said
