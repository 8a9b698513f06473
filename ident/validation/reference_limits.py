"""Whether a reference can be the record of a boat at all: places, speeds, angles and rates against what boats do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sim.boat.vehicle import Vehicle
from sim.files.constants import constant
from sim.files.errors import InputError
from sim.files.record import Record
from sim.flight.case import Case, Initial
from sim.flight.series import Series, place_of
from sim.flight.simulation import CHANNELS

Array = NDArray[np.float64]
_TURNING = ("psi", "theta")
_PLACES = ("x", "y", "z", "D0", "dz_over_L0")
_TURNED = " (as turned: x forward, y starboard, z down)"
_UNITS = "feet, knots, degrees, minutes, millimetres or kilometres under the name of another unit?"


@cache
def limits() -> dict[str, float]:
    """What a reference is held against, by name: ``ident/data/reference_limits.csv``, with the source of each."""
    with (files("ident") / "data" / "reference_limits.csv").open(encoding="utf-8") as stream:
        rows = pd.read_csv(stream)
    return dict(zip(rows["limit"], rows["value"].astype(float), strict=True))


@dataclass(frozen=True)
class Scales:
    """What makes a record free of dimensions, and where it should begin.

    Attributes
    ----------
    length : L [m].
    speed : U at the start, at least that of a slow boat [m/s].
    started : U at the start as stated [m/s].
    fastest : No boat of the case is faster over ground [m/s].
    gravity : [m/s^2].
    initial : State in which the source's run starts.
    way : Path length for each unit of the abscissa: ``speed`` over time, one over path length.
    steady : Nothing drives the boat but its constant revolutions, in calm water without a current.
    """

    length: float
    speed: float
    started: float
    fastest: float
    gravity: float
    initial: Initial
    way: float
    steady: bool


@dataclass(frozen=True)
class Doubt:
    """Something of a series that no boat does: at which point, what was found and is allowed, whether it stops."""

    at: int
    found: str
    allowed: str
    stops: bool = True


def scales(case: Case, vehicle: Vehicle, source: str, abscissa: str) -> Scales:
    """Scales of the record of one source."""
    named, initial = limits(), (case.started_as(source) or case).initial
    length, gravity = vehicle.particulars.length.value, case.environment.gravity_mps2
    wave_speed = math.sqrt(gravity * length)
    current = case.environment.current.speed_mps if case.environment.current else 0.0
    driven = case.waves is not None or case.command.n.law == "programme" or case.maneuver in ("rise", "stopping")
    steady = initial.state == "self_propulsion" and not driven
    speed = max(initial.speed_mps, named["speed_from_rest"] * wave_speed)
    fastest = named["speed_most"] * speed
    if not steady:
        fastest = max(fastest, named["froude_most"] * wave_speed)
    way = 1.0 if abscissa == "s" else speed
    return Scales(
        length, speed, initial.speed_mps, fastest + current, gravity, initial, way, steady and current < 0.2 * speed
    )


def check_records(case: Case, reference: Series, vehicle: Vehicle, where: str) -> list[str]:
    """Refuse references that no boat can have made.

    Each series is held against the case and the vehicle that are flown: the way it goes in its time, how fast it
    turns, where it begins, how deep it is, its revolutions against the propeller's limits.
    Limits are wide: what they refuse is another unit, sign or run.

    Parameters
    ----------
    case, reference, vehicle : What is flown, and what it is held against.
    where : File of the series, for messages.

    Returns
    -------
    Notes on what is odd and may be right.

    Raises
    ------
    InputError
        Naming file, source and channel, row, what was found and what is allowed.
    """
    said = []
    for source, channels in reference.data.items():
        scale = scales(case, vehicle, source, reference.abscissa)
        for channel, record in channels.items():
            for doubt in _doubts(channel, record, scale, case, vehicle, reference):
                place = place_of(reference, where, source, channel, doubt.at)
                found = doubt.found + (_TURNED if channel in reference.turned else "")
                if doubt.stops:
                    raise InputError(place, found, doubt.allowed)
                said.append(f"{place}: {found}; {doubt.allowed}")
        said += _shorter(channels, source, reference)
    return said


def check_records_of_flight(case: Case, vehicle: Vehicle, where: str) -> None:
    """Refuse a flight whose records are so far apart that nothing can be measured on them.

    Raises
    ------
    InputError
        Naming the case's key, and the longest time between two records.
    """
    named, length = limits(), vehicle.particulars.length.value
    slow = named["speed_from_rest"] * math.sqrt(case.environment.gravity_mps2 * length)
    most = named["record_most"] * length / max(case.initial.speed_mps, slow)
    if case.run.record_s > most:
        allowed = f"{most:.3g} s at most, in which a boat of {length:g} m runs half its length"
        raise InputError(f"{where}, key run.record_s", f"{case.run.record_s:g} s", allowed)


def _shorter(channels: dict[str, Record], source: str, reference: Series) -> list[str]:
    """Channels that begin after or end before the others of their source, in a file that somebody wrote."""
    kept = {c: r.abscissa for c, r in channels.items() if c in CHANNELS and len(r)}
    if not reference.rows or len(kept) < 2:
        return []
    first, last = min(float(a[0]) for a in kept.values()), max(float(a[-1]) for a in kept.values())
    apart, name = limits()["ends_apart"] * (last - first), reference.abscissa
    late = ", ".join(f"{c} at {a[0]:.4g}" for c, a in kept.items() if a[0] > first + apart)
    short = ", ".join(f"{c} at {a[-1]:.4g}" for c, a in kept.items() if a[-1] < last - apart)
    said = [f"{late} begin after the others, at {name} = {first:.4g}"] if late else []
    said += [f"{short} end before the others, at {name} = {last:.4g}"] if short else []
    return [f"reference {source}: {text}: is something missing?" for text in said]


def _doubts(
    channel: str, record: Record, scale: Scales, case: Case, vehicle: Vehicle, reference: Series
) -> Iterator[Doubt]:
    if len(record) == 0 or channel not in CHANNELS:
        return
    # What is said of cells is said of those that somebody wrote, not of a trial's smooth path.
    abscissa, written = reference.abscissa, bool(reference.rows)
    yield from _range(channel, record, scale, case, vehicle)
    yield from _sigma(channel, record, scale, written)
    if len(record) < 2:
        return
    yield from _clock(record, case, abscissa)
    if written and len(record) > 2 and not np.ptp(record.value):
        yield Doubt(0, f"{channel} is {float(record.shown.value[0]):g} at every point", "a record?", stops=False)
    if channel in _PLACES:
        yield from _way(channel, record, scale, abscissa)
    if channel in _TURNING:
        yield from _turns(channel, record, scale)
    if channel in ("phi", *_TURNING):
        yield from _swings(channel, record, scale, case, abscissa)
    yield from _start(channel, record, scale, case, abscissa)


def _first(bad: NDArray[np.bool_]) -> int | None:
    return int(np.argmax(bad)) if bad.any() else None


def _range(channel: str, record: Record, scale: Scales, case: Case, vehicle: Vehicle) -> Iterator[Doubt]:
    """Values that no boat has, whenever."""
    low, high, why = _allowed(channel, scale, case, vehicle)
    value = record.value
    at = _first((value < low) | (value > high))
    if at is not None:
        number, unit = float(record.shown.value[at]), record.shown.unit
        one = 1.0 if unit == record.unit else math.degrees(1.0)
        size = f"{low * one:.4g} to {high * one:.4g} {unit}"
        yield Doubt(at, f"{channel} = {number:.6g} {unit}", f"{size}: {why}; {_UNITS}")
    if channel in ("phi", "theta"):
        seldom = _first(np.abs(value) > limits()["heel_seldom"])
        if seldom is not None:
            angle = math.degrees(abs(float(value[seldom])))
            yield Doubt(seldom, f"{channel} of {angle:.3g} deg", "is its unit the one stated?", stops=False)


def _allowed(channel: str, scale: Scales, case: Case, vehicle: Vehicle) -> tuple[float, float, str]:
    """Least and most of a channel [SI], and why."""
    named, wide = limits(), math.inf
    if channel in ("u", "v", "w", "U"):
        return -scale.fastest, scale.fastest, f"the case starts at {scale.started:.4g} m/s"
    if channel == "u_over_U0":
        most = scale.fastest / scale.speed
        return -most, most, "over the speed at the start"
    if channel in ("q", "r"):
        most = named["rotation_most"] * max(scale.speed, scale.started) / scale.length
        return -most, most, f"{named['rotation_most']:g} of U / L, a circle of a third of the boat's length"
    if channel == "p":
        by_gravity = named["roll_by_gravity"] * math.sqrt(scale.gravity / scale.length)
        most = max(named["roll_by_speed"] * scale.speed / scale.length, by_gravity)
        return -most, most, "no boat rolls faster"
    if channel in ("phi", "theta"):
        return -named["heel_most"], named["heel_most"], "beyond, a boat has turned over"
    if channel in ("z", "D0"):
        open_above = case.environment.free_surface or case.waves is not None
        least = -(1.0 if open_above else named["emerged"]) * scale.length
        return least, constant("deepest_sea"), "depth, positive down after the frame that is stated"
    if channel == "n" and vehicle.propeller:
        low, high = case.command.n.limits_rps or vehicle.propeller.limits.value
        most = named["revolutions_most"] * max(abs(low), abs(high))
        return -most, most, "the propeller's limits, rps"
    if channel in ("ballast", "trim_tank") and vehicle.tanks:
        tank = vehicle.tanks.ballast if channel == "ballast" else vehicle.tanks.trim
        most = named["tank_most"] * tank.limit.value
        return -most, most, "what the tank takes"
    return -wide, wide, ""


def _sigma(channel: str, record: Record, scale: Scales, written: bool) -> Iterator[Doubt]:
    """Standard errors that leave nothing known."""
    if record.sigma is None:
        return
    named = limits()
    most = {"psi": named["sigma_angle"], "theta": named["sigma_angle"], "phi": named["sigma_angle"]}
    most |= dict.fromkeys(("x", "y", "z", "D0"), named["sigma_length"] * scale.length)
    most |= dict.fromkeys(("u", "v", "w", "U"), named["sigma_speed"] * scale.speed)
    most |= {"dz_over_L0": named["sigma_length"], "u_over_U0": named["sigma_speed"]}
    most |= dict.fromkeys(("q", "r"), named["sigma_angle"] * named["rotation_most"] * scale.speed / scale.length)
    at = _first(record.sigma > most.get(channel, math.inf))
    if at is not None and record.shown.sigma is not None:
        one = 1.0 if record.shown.unit == record.unit else math.degrees(1.0)
        found = f"column sigma: {float(record.shown.sigma[at]):.4g} {record.shown.unit} of {channel}"
        yield Doubt(at, found, f"{most[channel] * one:.4g} {record.shown.unit} at most, in the unit of the value")
    spread = float(np.std(record.value))
    share = float(np.sqrt(np.mean(record.sigma**2))) / spread if spread > 0.0 else named["sigma_share_most"]
    if written and len(record) > 2 and not named["sigma_share_least"] <= share <= named["sigma_share_most"]:
        found = f"standard errors of {channel} that are {share:.2g} of what it changes by"
        yield Doubt(0, found, "are they in the unit of the value?", stops=False)


def _clock(record: Record, case: Case, abscissa: str) -> Iterator[Doubt]:
    """Times of another unit, and holes in a record."""
    named, along = limits(), record.abscissa
    run = case.run.duration_s
    if abscissa == "t" and along[-1] > named["run_share"] * run:
        after = int(np.argmax(along > run))
        found = f"t goes to {along[-1]:.4g}, {along[-1] / run:.3g} times the {run:g} s that are flown"
        yield Doubt(after, found, f"times in s, to {named['run_share']:g} times the run; ms, minutes, a clock?")
    steps = np.diff(along)
    usual = float(np.median(steps))
    even = float(np.mean(np.abs(steps - usual) <= named["even_within"] * usual)) >= named["even_share"]
    if len(steps) >= 8 and float(steps.max()) > named["gap_of_even" if even else "gap"] * usual:
        at = int(np.argmax(steps))
        found = f"a gap from {abscissa} = {along[at]:.4g} to {along[at + 1]:.4g}, usual steps are {usual:.3g}"
        yield Doubt(at + 1, found, "is something missing, or misprinted?", stops=False)


def _way(channel: str, record: Record, scale: Scales, abscissa: str) -> Iterator[Doubt]:
    """Places farther apart than a boat gets in the time, or than the way along the path."""
    named = limits()
    over, unit = (scale.length, "L") if channel == "dz_over_L0" else (1.0, "m")
    place = record.value * over
    fastest = 1.0 if abscissa == "s" else scale.fastest
    slack = named["slack_depth" if channel in ("z", "D0", "dz_over_L0") else "slack_length"] * scale.length
    gone = np.abs(place - place[0])
    reach = fastest * (record.abscissa - record.abscissa[0]) + slack
    apart = np.abs(np.diff(place))
    at = _first(gone > reach)
    step = _first(apart > fastest * np.diff(record.abscissa) + slack)
    since = 0
    if at is None and step is not None:
        at, since = step + 1, step
    if at is None:
        return
    after = float(record.abscissa[at] - record.abscissa[since])
    moved = float(abs(place[at] - place[since])) / over
    found = f"{channel} changes by {moved:.4g} {unit} in {after:.4g} {'m of path' if abscissa == 's' else 's'}"
    by = "as far as the path is long" if abscissa == "s" else f"at {fastest:.3g} m/s"
    yield Doubt(at, found, f"{(fastest * after + slack) / over:.4g} {unit} at most, {by}; {_UNITS}")


def _turns(channel: str, record: Record, scale: Scales) -> Iterator[Doubt]:
    """Turns faster than any boat's, and turns that take for ever."""
    named = limits()
    way = record.abscissa * scale.way / scale.length
    value = record.value
    half = np.minimum(np.searchsorted(way, way + 0.5), len(way) - 1)
    for other in (np.minimum(np.arange(len(way)) + 1, len(way) - 1), half):
        turned, gone = np.abs(value[other] - value), way[other] - way
        at = _first(turned > named["rotation_most"] * np.maximum(gone, 0.1) + named["slack_angle"])
        if at is not None:
            size = math.degrees(float(turned[at]))
            found = f"{channel} turns by {size:.4g} deg within {gone[at]:.3g} lengths"
            if abs(size - 360.0) < 90.0:
                found += ": begun again at 360 deg?"
            allowed = f"{named['rotation_most']:g} rad a length at most, a circle of a third of it; {_UNITS}"
            yield Doubt(int(other[at]), found, allowed)
            return
    spread = float(np.ptp(value))
    if channel == "psi" and spread > named["rotation_counts"] and way[-1] > way[0]:
        ahead = np.minimum(np.searchsorted(way, way + max(2.0, (way[-1] - way[0]) / 100.0)), len(way) - 1)
        gone = np.maximum(way[ahead] - way, 1e-9)
        fastest = float(np.max(np.abs(value[ahead] - value) / np.maximum(gone, 2.0)))
        if fastest < named["rotation_least"]:
            found = f"psi turns by {math.degrees(spread):.3g} deg, at its fastest on {1.0 / max(fastest, 1e-12):.3g} L"
            yield Doubt(0, found, f"circles of {1.0 / named['rotation_least']:g} lengths and less; ms for s?")


def _swings(channel: str, record: Record, scale: Scales, case: Case, abscissa: str) -> Iterator[Doubt]:
    """Swings to and fro that are quicker than a boat's, which small angles do not show by their rate."""
    named, value = limits(), record.value
    middle, band = 0.5 * float(value.max() + value.min()), 0.2 * float(np.ptp(value))
    far = np.flatnonzero(np.abs(value - middle) > band)
    turns = int(np.count_nonzero(np.diff(np.sign(value[far] - middle)))) if band > 0.0 else 0
    took = float(record.abscissa[-1] - record.abscissa[0])
    if turns < 3 or abscissa == "s":
        return
    frequency = math.pi * turns / took
    by_speed, by_gravity = scale.speed / scale.length, math.sqrt(scale.gravity / scale.length)
    most = named["swing_by_speed"] * by_speed
    if channel == "phi" or not scale.steady:
        most = max(most, named["swing_by_gravity"] * by_gravity)
    if frequency > most:
        found = f"{channel} swings {turns} times to and fro within {took:.4g} s: {frequency:.3g} rad/s"
        yield Doubt(0, found, f"{most:.3g} rad/s at most; minutes or hours for s?")


def _start(channel: str, record: Record, scale: Scales, case: Case, abscissa: str) -> Iterator[Doubt]:
    """Where a record begins, and whether it goes ahead from there."""
    named, initial = limits(), scale.initial
    first = float(record.value[0])
    if float(record.abscissa[0]) * scale.way > named["lead_in"] * scale.length:
        return
    if channel in ("u", "U", "u_over_U0") and scale.started > 0.0 and scale.started >= scale.speed:
        share = first / (1.0 if channel == "u_over_U0" else scale.started)
        if not named["speed_least"] <= share <= named["speed_most"]:
            found = f"{channel} begins at {share:.3g} of the {scale.started:.4g} m/s that the case starts at"
            yield Doubt(0, found, f"{named['speed_least']:g} to {named['speed_most']:g} of it; the sign, or {_UNITS}")
    offsets = {"x": named["offset_most"] * scale.length, "y": named["offset_most"] * scale.length}
    offsets |= {"psi": named["offset_heading"], "dz_over_L0": named["offset_depth"]}
    begun = float(record.abscissa[0])
    moved = {"x": scale.fastest * begun if abscissa == "t" else begun}.get(channel, 0.0)
    if channel in offsets and abs(first) > offsets[channel] + abs(moved):
        shown = f"{first:.4g} m" if channel in "xy" else f"{math.degrees(first):.4g} deg"
        shown = f"{first:.4g} lengths" if channel == "dz_over_L0" else shown
        yield Doubt(0, f"{channel} begins at {shown}", "flights begin at zero: reference.from_start", stops=False)
    if channel in ("phi", "theta") and initial.state == "as_given":
        stated = math.radians(initial.heel_deg if channel == "phi" else initial.pitch_deg)
        yield from _attitude(channel, first, stated)
    if channel == "D0" and abs(first - initial.depth_m) > named["offset_depth"] * scale.length:
        found = f"D0 begins at {first:.4g} m, the case at {initial.depth_m:.4g} m"
        yield Doubt(0, found, "the depth of the sail top, in m", stops=False)
    if channel == "x" and scale.steady and scale.started >= scale.speed:
        yield from _ahead(record, scale)


def _attitude(channel: str, first: float, stated: float) -> Iterator[Doubt]:
    """A heel or pitch that a case states and its record does not begin with."""
    found = f"{channel} begins at {math.degrees(first):.3g} deg, the case at {math.degrees(stated):.3g} deg"
    if abs(stated) > math.radians(1.0) and not 0.3 < first / stated < 3.0:
        yield Doubt(0, found, f"about what the case states; its sign, its start, or {_UNITS}")
    elif abs(first - stated) > limits()["offset_attitude"]:
        yield Doubt(0, found, "is its unit the one stated?", stops=False)


def _ahead(record: Record, scale: Scales) -> Iterator[Doubt]:
    """Two lengths of way lead a boat ahead."""
    named = limits()
    way = record.abscissa * scale.way
    lead = named["lead_in"] * scale.length
    if way[-1] < lead:
        return
    at = int(np.searchsorted(way, lead))
    gone = float(way[at] - way[0])
    if gone > 1.5 * lead or gone < 0.5 * lead:
        return
    share = float(record.value[at] - record.value[0]) / gone
    if share < named["lead_least"]:
        found = f"x changes by {share * gone:.4g} m over the first {gone:.4g} m of way"
        if share < 0.0:
            yield Doubt(at, f"{found}: astern", "a record that goes ahead: the frame, x forward or aft")
        else:
            yield Doubt(at, found, f"{named['lead_least'] * gone:.4g} m or more; {_UNITS}")
