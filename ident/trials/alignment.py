"""When the maneuver began and from what course, place and speed: stated, or found on the record."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.noise import Samples
from ident.timeseries.scaled_rate import smooth_with_rate
from ident.timeseries.smoothing import ROUGHER, SmoothPath, smooth
from ident.trials.body import angle_rate
from ident.trials.consistency import path_of, regressed
from ident.trials.maneuvers import Maneuver, control_of, holds, large
from ident.trials.reading import Recording
from ident.trials.spec import TrialFile
from sim.files.errors import InputError
from sim.files.record import Record

Array = NDArray[np.float64]
# What an approach needs to be called one: seconds and samples.
_APPROACH_S, _APPROACH_SAMPLES, _LONGEST_S = 5.0, 8, 60.0
# Seconds before the execute that are looked at with the maneuver.
_RUN_UP_S = 20.0
# Two channels of one motion are taken together when they agree to this.
_CLOSE = 0.02
# Heading change up to which a turn is still being entered.
_ENTRY = math.radians(60.0)
# A path that begins at the execute has no samples before it, and the bias of smoothing is larger at an end than
# within: its density is taken this many times the likeliest.
_AT_AN_END = 10.0 * ROUGHER
# A course is steady when it turns by less than this share of the maneuver's largest rate.
_STEADY = 0.01
# A course from which a zigzag counts differs from that before it by this at least [rad].
_ASIDE = math.radians(0.05)
# A boat trimmed by less than this is level [rad].
_LEVEL = math.radians(0.05)
# Share of a body rate by which it may differ from the rate of the angle, along the record, heel and pitch unknown.
_BODY_RATE = 0.005
# Noise of fewer last digits is that of rounding.
_DIGITS = 3.0
_NOISE = {"psi": "heading_deg", "theta": "pitch_deg", "phi": "roll_deg", "r": "yaw_rate_degps", "north": "position_m"}
_NOISE |= {"east": "position_m", "z": "depth_m", "U": "speed_mps", "u": "speed_mps"}


@dataclass(frozen=True)
class Start:
    """The execute and the state there.

    Attributes
    ----------
    time, time_sigma : Of the execute on the record's clock [s].
    angle, angle_sigma : Course, or pitch, before it [rad]; None where it is that of the path at the
        execute, with the path's own error.
    said : How they are known.
    """

    time: float
    time_sigma: float
    angle: float | None
    angle_sigma: float
    said: tuple[str, ...]


def stated_noise(spec: TrialFile, channel: str) -> float:
    """Standard error of a sample as stated, SI; zero when it is not."""
    value = getattr(spec.noise, _NOISE.get(channel, ""), None) if channel in _NOISE else None
    angular = channel in ("psi", "theta", "phi", "r")
    return 0.0 if value is None else math.radians(value) if angular else float(value)


def _of_control(one: Recording, control: Record) -> tuple[float, float, str] | None:
    """Execute by the first step of the rudder or planes, or of the revolutions."""
    levels = holds(control)
    if not (used := large(levels)):
        return None
    first = used[0]
    header = one.headers[control.channel]
    t, x = control.abscissa, control.value
    if first.start <= t[0] + 1e-9:
        return float(t[0]), 0.0, f"execute at the first sample: {header} is at its angle there"
    quiet = [h for h in levels if h.end < first.start]
    base = quiet[-1].value if quiet else 0.0
    step = first.value - base
    share = (x - base) / step
    moving = np.flatnonzero(
        (t <= first.start + 1e-9) & (share > 0.1) & (share < 0.9) & (t > (quiet[-1].end if quiet else t[0]))
    )
    if moving.size >= 2:
        slope, offset = np.polyfit(t[moving], share[moving], 1)
        start = float(-offset / slope)
        return (
            start,
            float(np.median(np.diff(t))) / math.sqrt(12.0),
            f"execute at {start:.2f} s, where {header} begins to move",
        )
    after = int(np.argmax((share > 0.5) & (t > (quiet[-1].end if quiet else t[0]) - 1e-9)))
    before, now = float(t[max(after - 1, 0)]), float(t[after])
    text = f"execute between {before:.2f} and {now:.2f} s, where {header} leaves {math.degrees(base):.1f} deg"
    return 0.5 * (before + now), (now - before) / math.sqrt(12.0), text


def _onset(record: Record, path: SmoothPath) -> tuple[float, float, str]:
    """Execute by the heading, which leaves its course with the second or third power of time."""
    t = record.abscissa
    grid = np.linspace(t[0], t[-1], 6000)
    base = float(path(t[0]))
    away = np.abs(path(grid) - base)
    small = max(math.radians(0.5), 4.0 * path.sigma)
    late = np.flatnonzero(away > 4.0 * small)
    if not late.size:
        return float(t[0]), 0.0, "execute at the first sample: nothing in the record says otherwise"
    last = int(np.flatnonzero(away[: late[0]] < small)[-1]) if (away[: late[0]] < small).any() else 0
    first, second = float(grid[last]), float(grid[late[0]])
    # away ~ (t - t0)^k passes small and four times small.
    starts = [(4.0 ** (1.0 / k) * first - second) / (4.0 ** (1.0 / k) - 1.0) for k in (2.0, 3.0)]
    start, sigma = 0.5 * sum(starts), abs(starts[1] - starts[0]) / 2.0
    if start - t[0] <= max(2.0 * sigma, 3.0 * float(np.median(np.diff(t))), 0.1 * (second - t[0])):
        return (
            float(t[0]),
            0.0,
            "execute at the first sample: the boat begins to turn with the record; no rudder is recorded",
        )
    text = f"execute at {start:.1f} s +- {sigma:.1f} s, from when the boat begins to turn"
    return start, sigma, text + "; no rudder is recorded: execute_s states it"


def _approach(record: Record, until: float, sigma: float) -> tuple[float, float, str] | None:
    """Mean angle before the execute, where the record has an approach."""
    inside = (record.abscissa < until - 1e-9) & (record.abscissa >= until - _LONGEST_S)
    t, x = record.abscissa[inside], record.value[inside]
    if t.size < _APPROACH_SAMPLES or t[-1] - t[0] < _APPROACH_S:
        return None
    mean, spread = float(np.mean(x)), float(np.std(x, ddof=1))
    pieces = max(2, 1 + int(np.count_nonzero((x[:-1] - mean) * (x[1:] - mean) < 0.0)))
    error = max(spread / math.sqrt(pieces), sigma / math.sqrt(t.size))
    text = f"{math.degrees(mean):.3f} deg +- {math.degrees(error):.3f}, the mean of {t[-1] - t[0]:.0f} s of approach"
    return mean, error, text


def start_of(one: Recording, maneuver: Maneuver, spec: TrialFile) -> Start:
    """The execute and the angle before it.

    Raises
    ------
    InputError
        For a stated execute outside the record.
    """
    vertical = maneuver.kind in ("vertical_zigzag", "rise", "depth_change")
    angle = "theta" if vertical else "psi"
    record = one.channels.get("phi") if maneuver.kind == "roll_decay" else one.channels.get(angle)
    begin, end = float(one.rows[0][0]), float(one.rows[0][-1])
    control = control_of(one, vertical)
    said: list[str] = []
    if spec.execute_s is not None:
        time = (spec.execute_s - one.zero) * math.sqrt(spec.scale)
        if not begin - 1e-9 <= time < end:
            allowed = f"a time of the record: {one.zero:g} to {one.zero + end / math.sqrt(spec.scale):g} s"
            raise InputError(f"{one.file}, key execute_s", f"{spec.execute_s:g}", allowed)
        execute = (time, 0.0, f"execute at {spec.execute_s:g} s: stated")
    else:
        by_control = _of_control(one, control) if control is not None else None
        if by_control is None and maneuver.kind == "stopping" and "n" in one.channels:
            by_control = _of_revolutions(one)
        if by_control is None and (record is None or maneuver.kind in ("roll_decay", "course_keeping", "depth_change")):
            by_control = (begin, 0.0, "execute at the first sample")
        execute = by_control or _onset(record, path_of(record, None))  # type: ignore[arg-type]
    said.append(execute[2])
    known: tuple[float, float] | None = None
    if record is not None and maneuver.kind == "vertical_zigzag":
        known = _pitch(one, record, maneuver, execute[0], spec, said)
    elif record is not None and maneuver.kind != "roll_decay":
        known = _angle(record, execute[0], angle, spec, said)
        if maneuver.kind == "zigzag" and spec.initial.heading_deg is None:
            known = _ordered_course(one, record, maneuver, execute[0], known, said)
    sigma = math.hypot(execute[1], one.time_sigma)
    return Start(execute[0], sigma, known[0] if known else None, known[1] if known else 0.0, tuple(said))


def _pitch(
    one: Recording, record: Record, maneuver: Maneuver, execute: float, spec: TrialFile, said: list[str]
) -> tuple[float, float]:
    """Pitch from which a vertical zigzag counts: level, or the trim before it where the planes turn by that."""
    if spec.initial.pitch_deg is not None:
        said.append(f"pitch counts from {spec.initial.pitch_deg:g} deg: stated")
        return math.radians(spec.initial.pitch_deg), 0.0
    trim = _approach(record, execute, stated_noise(spec, "theta"))
    control = control_of(one, True)
    level = "pitch counts from level"
    if trim is None or abs(trim[0]) < max(_LEVEL, 3.0 * trim[1]):
        said.append(level)
        return 0.0, 0.0
    if control is None or maneuver.check is None:
        said.append(f"{level}, not from {math.degrees(trim[0]):.2f} deg before the execute; pitch_deg states it")
        return 0.0, 0.0
    half = 0.5 * float(np.median(np.diff(control.abscissa)))
    reversals = [float(record.at(h.end + half)) for h in large(holds(control))[:-1]]
    away = {base: sum(abs(abs(x - base) - math.radians(maneuver.check)) for x in reversals) for base in (0.0, trim[0])}
    if away[0.0] <= away[trim[0]]:
        said.append(f"{level}: {one.headers[control.channel]} is reversed at the check angle from there")
        return 0.0, 0.0
    said.append(
        f"pitch counts from {trim[2]}: {one.headers[control.channel]} is reversed at the check angle from there"
    )
    return trim[0], trim[1]


def _angle(record: Record, execute: float, angle: str, spec: TrialFile, said: list[str]) -> tuple[float, float] | None:
    name = "initial heading" if angle == "psi" else "initial pitch"
    if angle == "psi" and spec.initial.heading_deg is not None:
        said.append(f"{name} {spec.initial.heading_deg:g} deg: stated")
        turns = round((float(record.at(execute)) - math.radians(spec.initial.heading_deg)) / (2.0 * math.pi))
        return math.radians(spec.initial.heading_deg) + 2.0 * math.pi * turns, 0.0
    mean = _approach(record, execute, stated_noise(spec, angle))
    if mean:
        said.append(f"{name} {mean[2]}")
        return mean[0], mean[1]
    entry = _entry(record, execute)
    if entry:
        said.append(f"{name} {math.degrees(entry[0]):.3f} deg +- {math.degrees(entry[1]):.3f}, {entry[2]}")
        return entry[0], entry[1]
    said.append(f"{name}: that of the smooth path at the execute; no approach is recorded")
    return None


def _ordered_course(
    one: Recording,
    record: Record,
    maneuver: Maneuver,
    execute: float,
    known: tuple[float, float] | None,
    said: list[str],
) -> tuple[float, float] | None:
    """Course that a zigzag counts from where its rudder shows another than that before the execute.

    The rudder is reversed when the heading differs by the check angle from the ordered course; a model that was not
    quite on that course, or not yet steady, when the rudder was first laid is counted from it all the same.
    """
    control = control_of(one)
    if control is None or maneuver.check is None:
        return known
    path, check = path_of(record, None), math.radians(maneuver.check)
    half = 0.5 * float(np.median(np.diff(control.abscissa)))
    ends = np.array([h.end + half for h in large(holds(control))[:-1] if h.end > execute])
    ends = ends[(ends > record.abscissa[0]) & (ends < record.abscissa[-1])]
    if ends.size < 2:
        return known
    before = float(path(execute)) if known is None else known[0]
    turned, rate = path(ends) - before, path(ends, 1)
    side = np.sign(turned)
    if abs(float(side.sum())) == side.size:
        return known
    # To each side: side (turned - base) = check + lag |rate|; the lag is that of order, gear and sampling.
    equations = np.column_stack([side, np.abs(rate)])
    (middle, lag), *_ = np.linalg.lstsq(equations, side * turned - check, rcond=None)
    left = side * turned - check - equations @ np.array([middle, lag])
    one_left = float(np.sqrt(left @ left / (ends.size - 2))) if ends.size > 2 else 0.0
    scatter = math.hypot(one_left, float(np.mean(np.abs(rate))) * 2.0 * half / math.sqrt(12.0))
    error = scatter * math.sqrt(float(np.linalg.pinv(equations.T @ equations)[0, 0]))
    late = float(lag * np.mean(np.abs(rate)))
    own = known[1] if known else float(path.deviation(execute)[0])
    if abs(late) > 0.1 * check or abs(middle) < max(3.0 * math.hypot(error, own), _ASIDE):
        return known
    said.append(
        f"zigzag counted from {math.degrees(before + middle):.3f} deg +- {math.degrees(error):.3f}: there "
        f"{one.headers[control.channel]} is reversed at the check angle to both sides; not from the course before "
        "the execute; heading_deg states it"
    )
    return before + middle, error


def _entry(record: Record, execute: float) -> tuple[float, float, str] | None:
    """Heading at the execute from the entry into a turn: the turn itself, long and even, says nothing of it."""
    after = record.kept(record.abscissa >= execute - 1e-9)
    beyond = np.flatnonzero(np.abs(after.value - after.value[0]) > _ENTRY)
    if not beyond.size or beyond[0] < 16 or beyond[0] > 0.6 * len(after):
        return None
    entry = after.kept(slice(0, int(beyond[0])))
    said: list[str] = []
    path = _from_a_steady_course(path_of(entry, None), execute, said)
    value, bias = float(path(execute)), float(path.again()(execute) - path(execute))
    text = f"from the first {entry.abscissa[-1] - execute:.0f} s of the turn; no approach is recorded"
    return value, math.hypot(float(path.deviation(execute)[0]), bias), "; ".join([text, *said])


def _of_revolutions(one: Recording) -> tuple[float, float, str] | None:
    n = one.channels["n"]
    first = float(np.median(n.value[:5]))
    away = np.flatnonzero(np.abs(n.value - first) > 0.1 * max(abs(first), 1e-9))
    if not away.size:
        return None
    i = int(away[0])
    if i == 0:
        return float(n.abscissa[0]), 0.0, "execute at the first sample"
    before, now = float(n.abscissa[i - 1]), float(n.abscissa[i])
    text = f"execute between {before:.2f} and {now:.2f} s, where {one.headers['n']} leaves its value"
    return 0.5 * (before + now), (now - before) / math.sqrt(12.0), text


def paths(one: Recording, start: Start, spec: TrialFile) -> tuple[dict[str, SmoothPath], list[str]]:
    """Smooth paths of the channels from shortly before the execute on, rates taken with their angles."""
    taken: dict[str, list[Samples]] = {}
    smoothed: dict[str, SmoothPath] = {}
    said: list[str] = []
    for name, record in one.channels.items():
        if name in ("dH", "dV", "dH_order", "course", "p", "q", "r", "udot", "n", "v", "w"):
            continue
        samples, path = _from_run_up(record, start.time, stated_noise(spec, name))
        if path is not None:
            taken[name], smoothed[name] = samples, smooth(samples)
            said += _alike(smoothed[name], one.headers[name])
    alone: dict[str, SmoothPath] = {n: smoothed[n] for n in ("psi", "theta", "phi") if n in smoothed}
    for name in alone:
        rate = {"psi": "r", "theta": "q", "phi": "p"}[name]
        if rate in one.channels:
            smoothed |= _with_rate(one, name, rate, taken[name], alone, spec, said)
        if name in ("psi", "theta") and start.angle is None:
            smoothed[name] = _from_a_steady_course(smoothed[name], start.time, said)
    if "psi" in smoothed and "r" not in smoothed and not {"phi", "theta"} <= set(smoothed):
        said.append("yaw rates are those of the heading: neither r nor heel and pitch are recorded or agree with it")
    return smoothed, said


def _alike(path: SmoothPath, header: str) -> list[str]:
    """What is said of noise that a filter has made alike from sample to sample; nothing of that of rounding."""
    samples = path.samples[0]
    steps, jumps = float(np.median(np.diff(samples.time))), np.abs(np.diff(samples.value))
    digit = float(jumps[jumps > 0.0].min(initial=math.inf))
    if (samples.memory or 0.0) < steps or path.sigma < _DIGITS * digit:
        return []
    return [f"{header}: its noise is alike over {samples.memory:.2g} s, as behind a filter; errors allow for it"]


def _with_rate(
    one: Recording,
    name: str,
    rate: str,
    samples: list[Samples],
    alone: dict[str, SmoothPath],
    spec: TrialFile,
    said: list[str],
) -> dict[str, SmoothPath]:
    """The path through an angle and the rate of its axis, and that of the rate where heel or pitch are unknown."""
    begin = float(samples[0].time[0])
    record = one.channels[rate].kept(one.channels[rate].abscissa >= begin - 1e-9)
    inclined = {"phi", "theta"} <= set(alone)
    lo = max(float(p.knots[4]) for p in alone.values())
    hi = min(float(p.knots[-5]) for p in alone.values())
    record = record.kept((record.abscissa >= lo) & (record.abscissa <= hi))
    at = record.abscissa
    values, slopes = {k: p(at) for k, p in alone.items()}, {k: p(at, 1) for k, p in alone.items()}
    angular = replace(record, value=angle_rate(name, record.value, values, slopes)) if inclined else record
    smoothed: dict[str, SmoothPath] = {}
    joined = _joined(samples, angular, alone[name], stated_noise(spec, rate), 0.0 if inclined else _BODY_RATE)
    if joined is not None:
        smoothed[name] = joined
        said.append(f"{one.headers[name]} and {one.headers[rate]} taken together: they agree")
    if not inclined and rate in ("r", "q") and len(record) >= 16:
        pair = regressed(at, record.value, slopes[name])
        if pair is not None and pair.agrees:
            smoothed[rate] = smooth([Samples(at, record.value, 0, stated_noise(spec, rate), None)])
    return smoothed


def _from_run_up(record: Record, execute: float, noise: float) -> tuple[list[Samples], SmoothPath | None]:
    """Samples from shortly before the execute on; from the execute on where the noise before it is another."""
    step = float(np.median(np.diff(record.abscissa)))
    best: tuple[list[Samples], SmoothPath | None] = ([], None)
    for run_up in (1.01 * step, _RUN_UP_S):
        inside = record.kept(record.abscissa >= execute - run_up - 1e-9)
        if len(inside) < 8 or (best[0] and len(inside) == best[0][0].time.size):
            continue
        samples = [Samples(inside.abscissa, inside.value, 0, noise, None)]
        path = smooth(samples)
        if best[1] is None or best[1].sigma / 1.4 <= path.sigma <= 1.4 * best[1].sigma:
            best = (samples, path)
    return best


def _from_a_steady_course(path: SmoothPath, execute: float, said: list[str]) -> SmoothPath:
    """A path without an approach, its rate at the execute zero to a share of the largest, where it may be."""
    grid = np.linspace(float(path.knots[4]), float(path.knots[-5]), 1000)
    share = _STEADY * float(np.max(np.abs(path(grid, 1))))
    there = float(path(execute, 1))
    if share <= 0.0 or abs(there) > 3.0 * math.hypot(share, float(path.deviation(execute, 1)[0])):
        return path
    said.append(f"steady course at the execute: its rate there is zero to {100.0 * _STEADY:g} % of the largest")
    steady = Samples(np.array([execute]), np.zeros(1), 1, share)
    first = replace(path.samples[0], value=path.samples[0].value + path.centre)
    # An execute between two samples may lie before the first of them.
    again = smooth([first, *path.samples[1:], steady], lo=min(float(path.knots[4]), execute), rougher=_AT_AN_END)
    return replace(again, shared=path.shared)


def _joined(
    samples: list[Samples], inside: Record, path: SmoothPath, noise: float, body_rate: float
) -> SmoothPath | None:
    """The path through an angle and its rate, where the two agree to a hundredth.

    A body rate is not quite the rate of its Euler angle where heel and pitch stand between them: by ``body_rate``.
    """
    if len(inside) < 16:
        return None
    pair = regressed(inside.abscissa, inside.value, path(inside.abscissa, 1))
    own = path_of(inside, None)
    scatter = own.sigma
    offset_error = max(scatter, 1e-12) / math.sqrt(len(inside))
    if pair is None or abs(pair.slope - 1.0) > _CLOSE or abs(pair.offset) > 6.0 * offset_error + 1e-6:
        return None
    first = replace(samples[0], sigma=path.sigma, memory=path.samples[0].memory)
    sigma = math.hypot(noise or scatter, body_rate * float(np.sqrt(np.mean(inside.value**2))))
    return smooth_with_rate(first, Samples(inside.abscissa, inside.value, 1, sigma, own.samples[0].memory), _CLOSE)
