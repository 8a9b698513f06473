"""Metrics of a recorded maneuver, each with a standard error, by the estimators that flights are measured with.

The estimators of ``ident.metrics`` are applied to the most likely smooth path of each channel, and to
draws from its posterior, with execute and base course drawn from their errors: the spread of a metric
over the draws about its value, and what a second smoothing changes, make its standard error: noise and
sampling, the bias of an extreme and the bias of smoothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.metrics import turning, vertical
from ident.metrics.zigzag import roll_decay, zigzag
from ident.timeseries.smoothing import SmoothPath
from ident.trials.alignment import Start
from ident.trials.maneuvers import Maneuver, control_of, holds
from ident.trials.reading import Recording
from ident.trials.spec import TrialFile
from sim.files.errors import InputError

Array = NDArray[np.float64]
Channels = dict[str, Array]
Metrics = dict[str, float | None]
DRAWS = 200
_STEP_S, _GRID = 0.15, (1200, 3000)
# A boat that makes this share of its approach speed has all but stopped.
_STILL = 0.05
# No record says when and where more closely than this, in the unit of the metric.
_LEAST = {"deg": 1e-3, "s": 1e-3, "m": 1e-3, "deg/s": 1e-4, "m/s": 1e-4, "-": 1e-5, "%": 1e-3, "deg s/deg": 1e-3}


@dataclass(frozen=True)
class Value:
    """A metric: value, standard error, unit."""

    value: float
    sigma: float
    unit: str

    def to_dict(self) -> dict[str, float | str]:
        """For a machine to read."""
        return {"value": self.value, "sigma": self.sigma, "unit": self.unit}


def unit_of(name: str) -> str:
    """Unit of a metric, by its name."""
    for end, unit in (
        ("_degps", "deg/s"),
        ("_mps", "m/s"),
        ("_deg", "deg"),
        ("_percent", "%"),
        ("_m", "m"),
        ("_s", "s"),
        ("_rps", "1/s"),
    ):
        if name.endswith(end):
            return unit
    return "deg/s" if "degps" in name and not name.endswith("deg") else "-"


def _grid(begin: float, end: float) -> Array:
    """Times at which draws are measured: fine enough for straight lines between them."""
    return np.linspace(begin, end, int(np.clip((end - begin) / _STEP_S, *_GRID)))


@dataclass(frozen=True)
class Drawn:
    """Channels on one time grid from the execute on: the most likely ones, or a draw."""

    time: Array
    values: Channels
    rates: Channels
    base: float | None


def _most_likely(paths: dict[str, SmoothPath], grid: Array, start: Start) -> Drawn:
    values = {k: p(grid) for k, p in paths.items()}
    return Drawn(grid, values, {k: p(grid, 1) for k, p in paths.items()}, start.angle)


def _draws(paths: dict[str, SmoothPath], grid: Array, start: Start, count: int, seed: int) -> list[Drawn]:
    """Draws of every channel, of the execute and of the base course."""
    rng = np.random.default_rng(seed)
    moved = start.time_sigma * rng.standard_normal(count)
    base = None if start.angle is None else start.angle + start.angle_sigma * rng.standard_normal(count)
    drawn = {name: path.drawn(count, rng) for name, path in paths.items()}
    found = []
    for i in range(count):
        one = {name: d[i] for name, d in drawn.items()}
        at = np.clip(grid + moved[i], *_range(one)) if moved[i] else grid
        values, rates = {k: p(at) for k, p in one.items()}, {k: p(at, 1) for k, p in one.items()}
        found.append(Drawn(at - moved[i], values, rates, None if base is None else float(base[i])))
    return found


def _range(paths: dict[str, SmoothPath]) -> tuple[float, float]:
    """Times that every path has."""
    return max(float(p.knots[4]) for p in paths.values()), min(float(p.knots[-5]) for p in paths.values())


def _angle(one: Drawn, name: str) -> Array:
    base = float(one.values[name][0]) if one.base is None else one.base
    return one.values[name] - base


def sense_of(one: Drawn, name: str) -> int:
    """Side to which an angle goes first, +1 to starboard or bow up."""
    x = _angle(one, name)
    far = np.abs(x) > 0.3 * float(np.max(np.abs(x)))
    return 1 if x[int(np.argmax(far))] > 0.0 else -1


def _zigzag(one: Drawn, maneuver: Maneuver, start: Start, sense: int) -> Metrics:
    name, word = ("psi", "yaw") if maneuver.kind == "zigzag" else ("theta", "pitch")
    t, check = one.time - start.time, math.radians(maneuver.check or 0.0)
    found = zigzag(t, _angle(one, name), (t, one.rates[name]), check, sense, word)
    if name == "theta" and "z" in one.values:
        found["depth_overshoot_1_m"] = vertical.depth_overshoot(t, one.values["z"], found["execute_2_s"], sense)
    return found


def _turn(one: Drawn, start: Start) -> Metrics:
    """Turning circle: the track turned to the course before the execute."""
    north, east = one.values.get("north"), one.values.get("east")
    channels: Channels = {"t": one.time - start.time}
    base = one.base
    if "psi" in one.values:
        channels["psi"] = one.values["psi"] - (one.values["psi"][0] if base is None else base)
        channels["psi"][0] = 0.0
        channels["r"] = one.rates["psi"]
        base = float(one.values["psi"][0]) if base is None else base
    if north is None or east is None:
        turned = channels["psi"] * (1.0 if channels["psi"][-1] > 0.0 else -1.0)
        t = channels["t"]
        found: Metrics = {
            f"time_{a}_heading_s": turning.at(t, turning.crossing(turned, math.radians(a))) for a in (90, 180)
        }
        return found
    vn, ve = one.rates["north"], one.rates["east"]
    if base is None:
        base = math.atan2(ve[0], vn[0])
    c, s = math.cos(base), math.sin(base)
    dn, de = north - north[0], east - east[0]
    channels |= {"x": c * dn + s * de, "y": c * de - s * dn}
    if "psi" in one.values:
        cp, sp = np.cos(one.values["psi"]), np.sin(one.values["psi"])
        channels |= {"u": vn * cp + ve * sp, "v": ve * cp - vn * sp}
    for name in ("phi", "z", "theta"):
        if name in one.values:
            channels[name] = one.values[name]
    return turning.turning_circle(channels)


def _steps(one: Recording) -> list[tuple[float, float]]:
    control = control_of(one)
    if control is None:
        raise InputError(one.file, "no rudder in the record", "a column of the rudder angle: it names the steps")
    levels = holds(control)
    return [(h.value, h.end) for h in levels if h.end - h.start > 5.0]


def _horizontal(one: Drawn, start: Start) -> Channels:
    """Channels t, psi, r, and x and y along and across the course at the execute."""
    channels: Channels = {"t": one.time - start.time}
    base = one.base or 0.0
    if "psi" in one.values:
        base = float(one.values["psi"][0]) if one.base is None else one.base
        channels |= {"psi": _angle(one, "psi"), "r": one.rates["psi"]}
    if "north" in one.values:
        dn, de = one.values["north"] - one.values["north"][0], one.values["east"] - one.values["east"][0]
        if "psi" not in one.values:
            base = math.atan2(one.rates["east"][0], one.rates["north"][0])
        channels["x"] = math.cos(base) * dn + math.sin(base) * de
        channels["y"] = math.cos(base) * de - math.sin(base) * dn
        channels["s"] = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(dn), np.diff(de)))])
    for name in ("u", "U", "phi", "theta", "z"):
        if name in one.values:
            channels[name] = one.values[name]
    return channels


def _stopping(one: Drawn, start: Start) -> Metrics:
    channels = _horizontal(one, start)
    speed = channels.get("u", channels.get("U"))
    if speed is None:
        speed = np.hypot(one.rates["north"], one.rates["east"])
    still = np.flatnonzero(speed <= _STILL * float(speed[0]))
    end = int(still[0]) + 1 if still.size else len(speed)
    short = {k: v[:end].copy() for k, v in channels.items()}
    if end > 20:
        # The speed falls on to zero as it fell before: the last of it is under the noise.
        slope = np.polyfit(short["t"][-20:], speed[end - 20 : end], 1)[0]
        rest = -float(speed[end - 1]) / slope if still.size and slope < 0.0 else 0.0
        way = 0.5 * rest * max(float(speed[end - 1]), 0.0)
        across = float(short["psi"][-1]) if "psi" in short else 0.0
        short["t"][-1] += rest
        for name, share in (("s", 1.0), ("x", math.cos(across)), ("y", math.sin(across))):
            short[name][-1] += way * share
    short.setdefault("psi", np.zeros(end))
    return turning.stopping(short, bool(still.size))


def _keeping(one: Drawn, start: Start) -> Metrics:
    """Course and depth keeping: how far a boat strays from its means."""
    found: Metrics = {}
    for name, word, factor, unit in (
        ("psi", "heading", 180.0 / math.pi, "deg"),
        ("theta", "pitch", 180.0 / math.pi, "deg"),
        ("phi", "heel", 180.0 / math.pi, "deg"),
        ("z", "depth", 1.0, "m"),
    ):
        if name in one.values:
            away = factor * (one.values[name] - one.values[name].mean())
            found[f"{word}_rms_{unit}"] = float(np.sqrt(np.mean(away**2)))
            found[f"{word}_deviation_peak_{unit}"] = float(np.max(np.abs(away)))
    return found


def _depth_change(one: Drawn, start: Start, step: float | None) -> Metrics:
    z = one.values["z"]
    order = step if step is not None else float(np.mean(z[-len(z) // 10 :]) - z[0])
    theta = one.values.get("theta", np.zeros_like(z))
    found = vertical.depth_change({"t": one.time - start.time, "z": z, "theta": theta}, order)
    return found if "theta" in one.values else {k: v for k, v in found.items() if k != "pitch_peak_deg"}


def _rise(one: Drawn, start: Start) -> Metrics:
    z, theta = one.values["z"], one.values["theta"]
    q = one.rates["theta"]
    u = one.values.get("u", one.values.get("U"))
    channels = {"t": one.time - start.time, "theta": theta, "q": q, "u": np.ones_like(z) if u is None else u, "z": z}
    found = vertical.rise(channels, False)
    return {k: v for k, v in found.items() if u is not None or "speed" not in k}


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


def _estimator(
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
        ends = [(value, end - start.time) for value, end in _steps(one)]
        if maneuver.kind == "pull_out":
            # Amidships is what is small beside the turns; what was before the execute is no step.
            most = max((abs(value) for value, _ in ends), default=0.0)
            ends = [(value if abs(value) > 0.1 * most else 0.0, end) for value, end in ends if end > 0.0]
            return lambda drawn: turning.pull_out(_horizontal(drawn, start), ends)
        rounded = [(math.radians(round(math.degrees(v) * 2.0) / 2.0), end) for v, end in ends]
        return lambda drawn: turning.direct_spiral(_horizontal(drawn, start), rounded)[0]
    return {
        "turning_circle": lambda drawn: _turn(drawn, start),
        "stopping": lambda drawn: _stopping(drawn, start),
        "roll_decay": lambda drawn: roll_decay(drawn.time, drawn.values["phi"]),
        "rise": lambda drawn: _rise(drawn, start),
        "depth_change": lambda drawn: _depth_change(drawn, start, spec.step_m),
        "course_keeping": lambda drawn: _keeping(drawn, start),
    }[maneuver.kind]


def with_errors(
    measure: Callable[[Drawn], Metrics], likely: Drawn, again: Drawn, draws: list[Drawn]
) -> dict[str, Value]:
    """Metrics of the most likely path, with the spread over the draws and the bias of smoothing."""
    best, twice = measure(likely), measure(again)
    spread: dict[str, list[float]] = {name: [] for name in best}
    for one in draws:
        for name, value in measure(one).items():
            if name in spread and value is not None:
                spread[name].append(value)
    found = {}
    for name, value in best.items():
        drawn = np.array(spread[name])
        if value is None or drawn.size < 0.9 * len(draws):
            continue
        unit = unit_of(name)
        smoother = twice.get(name)
        bias = 0.0 if smoother is None else smoother - value
        sigma = math.sqrt(float(np.mean((drawn - value) ** 2)) + bias**2 + _LEAST.get(unit, 1e-6) ** 2)
        found[name] = Value(float(value), sigma, unit)
    return found


def measured(
    one: Recording, maneuver: Maneuver, start: Start, paths: dict[str, SmoothPath], spec: TrialFile, count: int = DRAWS
) -> dict[str, Value]:
    """Metrics of a recording, each with its standard error.

    Parameters
    ----------
    one, maneuver, start, paths : From reading, ``maneuver_of``, ``start_of`` and ``alignment.paths``.
    spec : Statements on the record.
    count : Draws from the posterior.

    Raises
    ------
    InputError
        When the record lacks a channel that the maneuver is measured on.
    """
    end = _range(paths)[1]
    grid = _grid(start.time, end)
    likely = _most_likely(paths, grid, start)
    measure = _estimator(one, maneuver, start, spec, likely)
    again = _most_likely({k: p.again() for k, p in paths.items()}, grid, start)
    found = with_errors(measure, likely, again, _draws(paths, grid, start, count, 0))
    return found | _approach_speed(one, paths, start)


def _approach_speed(one: Recording, paths: dict[str, SmoothPath], start: Start) -> dict[str, Value]:
    """Speed at the execute, by the log, else by the track."""
    at = start.time
    for name in ("U", "u"):
        if name in paths:
            value, sigma = float(paths[name](at)), float(paths[name].deviation(at)[0])
            return {"approach_speed_mps": Value(abs(value), math.hypot(sigma, 1e-4), "m/s")}
    if "north" in paths:
        vn, ve = float(paths["north"](at, 1)), float(paths["east"](at, 1))
        sigma = float(paths["north"].deviation(at, 1)[0])
        return {"approach_speed_mps": Value(math.hypot(vn, ve), math.hypot(sigma, 1e-4), "m/s")}
    return {}
