"""The metrics of each maneuver, measured on the channels of one draw by the estimators that flights are measured by."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ident.metrics import turning, vertical
from ident.metrics.zigzag import roll_decay, zigzag
from ident.trials.alignment import Start
from ident.trials.body import pitch_rate, velocities, yaw_rate
from ident.trials.drawn import Drawn, Metrics
from ident.trials.keeping import keeping, steering_of
from ident.trials.maneuvers import Maneuver, control_of, holds
from ident.trials.reading import Recording
from ident.trials.spec import TrialFile
from sim.files.errors import InputError

Array = NDArray[np.float64]
# A boat that makes this share of its approach speed has all but stopped.
_STILL = 0.05
# Steps of a spiral are small beside its largest rudder.
_STEP = 0.005


def sense_of(one: Drawn, name: str) -> int:
    """Side to which an angle goes first, +1 to starboard or bow up."""
    x = one.angle(name)
    far = np.abs(x) > 0.3 * float(np.max(np.abs(x)))
    return 1 if x[int(np.argmax(far))] > 0.0 else -1


def _zigzag(one: Drawn, maneuver: Maneuver, start: Start, sense: int) -> Metrics:
    name, word = ("psi", "yaw") if maneuver.kind == "zigzag" else ("theta", "pitch")
    rate = (yaw_rate if name == "psi" else pitch_rate)(one.values, one.rates)
    t, check = one.time - start.time, math.radians(maneuver.check or 0.0)
    metrics = zigzag(t, one.angle(name), (t, rate), check, sense, word)
    if name == "theta" and "z" in one.values:
        metrics["depth_overshoot_1_m"] = vertical.depth_overshoot(t, one.values["z"], metrics["execute_2_s"], sense)
    return metrics


def _turn(one: Drawn, start: Start) -> Metrics:
    """Turning circle: the track turned to the course before the execute."""
    channels = one.horizontal(start.time)
    if "psi" in channels:
        channels["psi"] = channels["psi"].copy()
        # The estimator counts from the first sample, a trial from the course before it.
        channels["psi"][0] = 0.0
    if "x" not in channels:
        turned = channels["psi"] * (1.0 if channels["psi"][-1] > 0.0 else -1.0)
        t = channels["t"]
        return {f"time_{a}_heading_s": turning.at(t, turning.crossing(turned, math.radians(a))) for a in (90, 180)}
    for name in ("u", "U"):
        channels.pop(name, None)
    if "psi" in channels:
        channels |= velocities(one.values, one.rates)
    if one.origin is not None:
        # Distances from the stated place: the estimator counts from the first sample.
        channels["x"], channels["y"] = channels["x"].copy(), channels["y"].copy()
        channels["x"][0] = channels["y"][0] = 0.0
    return turning.turning_circle(channels)


def _steps(one: Recording) -> list[tuple[float, float]]:
    control = control_of(one)
    if control is None:
        raise InputError(one.file, "no rudder in the record", "a column of the rudder angle: it names the steps")
    levels = holds(control, _STEP)
    return [(h.value, h.end) for h in levels if h.end - h.start > 5.0]


def _slowed(one: Drawn) -> tuple[Array, int, float]:
    """Speed, sample after that at which the boat has all but stopped, and how long it then runs on [s]."""
    speed = one.values.get("u", one.values.get("U"))
    if speed is None:
        speed = np.hypot(one.rates["north"], one.rates["east"])
    still = np.flatnonzero(speed <= _STILL * float(speed[0]))
    end = int(still[0]) + 1 if still.size else len(speed)
    if not still.size or end <= 20:
        return speed, end, 0.0
    # The speed falls on to zero as it fell before: the last of it is under the noise.
    slope = np.polyfit(one.time[end - 20 : end], speed[end - 20 : end], 1)[0]
    return speed, end, -float(speed[end - 1]) / slope if slope < 0.0 else 0.0


def run_out(one: Drawn) -> float:
    """Angle [rad] by which a stopping boat would turn at its last rate until it lies still."""
    if "psi" not in one.values:
        return 0.0
    _, end, rest = _slowed(one)
    return rest * float(yaw_rate(one.values, one.rates)[end - 1])


def _stopping(one: Drawn, start: Start) -> Metrics:
    channels = one.horizontal(start.time)
    speed, end, rest = _slowed(one)
    stopped = bool(speed[end - 1] <= _STILL * float(speed[0]))
    short = {k: v[:end].copy() for k, v in channels.items()}
    if one.origin is not None:
        short["x"][0] = short["y"][0] = 0.0
    way = 0.5 * rest * max(float(speed[end - 1]), 0.0)
    across = float(short["psi"][-1]) if "psi" in short else 0.0
    short["t"][-1] += rest
    for name, share in (("s", 1.0), ("x", math.cos(across)), ("y", math.sin(across))):
        short[name][-1] += way * share
    if "psi" in short:
        # It turns on as it runs out.
        short["psi"][-1] += 0.5 * run_out(one)
    short.setdefault("psi", np.zeros(end))
    return turning.stopping(short, stopped)


def _depth_change(one: Drawn, start: Start, step: float | None) -> Metrics:
    z = one.values["z"]
    order = step if step is not None else float(np.mean(z[-len(z) // 10 :]) - z[0])
    theta = one.values.get("theta", np.zeros_like(z))
    metrics = vertical.depth_change({"t": one.time - start.time, "z": z, "theta": theta}, order)
    return metrics if "theta" in one.values else {k: v for k, v in metrics.items() if k != "pitch_peak_deg"}


def _rise(one: Drawn, start: Start, point: tuple[float, float, float] | None) -> Metrics:
    """Rise up to the end of the record, or until a point of the boat comes to the surface."""
    z, theta = one.values["z"], one.values["theta"]
    u = one.values.get("u", one.values.get("U"))
    channels = {"t": one.time - start.time, "theta": theta, "q": pitch_rate(one.values, one.rates), "z": z}
    channels["u"] = np.ones_like(z) if u is None else u
    surfaced = False
    if point is not None:
        phi = one.values.get("phi", np.zeros_like(z))
        depth = z - np.sin(theta) * point[0] + np.cos(theta) * (np.sin(phi) * point[1] + np.cos(phi) * point[2])
        place = turning.crossing(-depth, 0.0)
        surfaced = bool(place)
        if place:
            last = int(place) + 1
            channels = {
                k: np.append(v[:last], float(np.interp(place, np.arange(len(v)), v))) for k, v in channels.items()
            }
    metrics = vertical.rise(channels, surfaced)
    return {k: v for k, v in metrics.items() if u is not None or "speed" not in k}


_NEEDS = {
    "zigzag": ("psi",),
    "vertical_zigzag": ("theta",),
    "direct_spiral": ("psi",),
    "pull_out": ("psi",),
    "stopping": ("north",),
    "roll_decay": ("phi",),
    "rise": ("theta", "z"),
    "depth_change": ("z",),
    "course_keeping": ("psi",),
}


def estimator(
    one: Recording,
    maneuver: Maneuver,
    start: Start,
    spec: TrialFile,
    likely: Drawn,
) -> Callable[[Drawn], Metrics]:
    """The function that measures a draw."""
    missing = [c for c in _NEEDS.get(maneuver.kind, ()) if c not in likely.values]
    if missing or (maneuver.kind == "turning_circle" and not {"psi", "north"} & set(likely.values)):
        allowed = f"a column of {' and '.join(missing) or 'track or heading'}, which {maneuver.kind} is measured on"
        raise InputError(one.file, f"channels {', '.join(likely.values)}", allowed)
    if maneuver.kind in ("zigzag", "vertical_zigzag"):
        sense = sense_of(likely, "psi" if maneuver.kind == "zigzag" else "theta")
        return lambda drawn: _zigzag(drawn, maneuver, start, sense)
    if maneuver.kind in ("direct_spiral", "pull_out"):
        # What was before the execute is no step.
        ends = [(value, end - start.time) for value, end in _steps(one) if end > start.time]
        if maneuver.kind == "pull_out":
            # Amidships is what is small beside the turns.
            most = max((abs(value) for value, _ in ends), default=0.0)
            ends = [(value if abs(value) > 0.1 * most else 0.0, end) for value, end in ends]
            return lambda drawn: turning.pull_out(drawn.horizontal(start.time), ends)
        rounded = [(math.radians(round(math.degrees(v) * 2.0) / 2.0 + 0.0), end) for v, end in ends]
        return lambda drawn: turning.direct_spiral(drawn.horizontal(start.time), rounded)[0]
    steering = steering_of(one, start, spec) if maneuver.kind == "course_keeping" else None
    return {
        "turning_circle": lambda drawn: _turn(drawn, start),
        "stopping": lambda drawn: _stopping(drawn, start),
        "roll_decay": lambda drawn: roll_decay(drawn.time, drawn.values["phi"]),
        "rise": lambda drawn: _rise(drawn, start, spec.surface_point_m),
        "depth_change": lambda drawn: _depth_change(drawn, start, spec.step_m),
        "course_keeping": lambda drawn: keeping(drawn, start, steering),
    }[maneuver.kind]
