"""Metrics of turns, spirals, pull-outs and stops by the ITTC definitions (7.5-02-06-01).

Channels are arrays of one length, program frame, SI and radians. A metric is None where the
record does not reach it, and absent where it has no channel for it. Distances are those of
the body origin; the ITTC names midship.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Channels = dict[str, Array]
Metrics = dict[str, float | None]


def crossing(x: Array, level: float) -> float | None:
    """Place (in samples, interpolated) at which ``x`` first reaches ``level`` from below."""
    above = np.flatnonzero(x >= level)
    if above.size == 0:
        return None
    i = int(above[0])
    if i == 0:
        return 0.0
    return float(i - 1 + (level - x[i - 1]) / (x[i] - x[i - 1]))


def at(x: Array, place: float | None) -> float | None:
    """Value of a channel at a place."""
    return None if place is None else float(np.interp(place, np.arange(len(x)), x))


def circle_diameter(x: Array, y: Array) -> float:
    """Diameter of the circle with the least squared distances to the points."""
    from scipy.optimize import least_squares

    linear = np.linalg.lstsq(np.column_stack([x, y, np.ones_like(x)]), x**2 + y**2, rcond=None)[0]
    start = [linear[0] / 2.0, linear[1] / 2.0]
    start.append(float(np.sqrt(linear[2] + start[0] ** 2 + start[1] ** 2)))
    circle = least_squares(lambda c: np.hypot(x - c[0], y - c[1]) - c[2], start)
    return float(2.0 * circle.x[2])


def _course(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Change of course along a track [rad], growing, and the points where it holds.

    The tangent is that of the chord between neighbours, at the middle of the chord.
    """
    course = np.unwrap(np.arctan2(np.diff(y), np.diff(x)))
    start = 2.0 * np.pi * np.round(course[0] / (2.0 * np.pi))
    return course - start, 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])


def _reaches(angle: Array, x: Array, y: Array, by: str) -> Metrics:
    """Advance and transfer at 90 deg, tactical diameter at 180 deg of heading or course."""
    quarter, half = crossing(angle, np.pi / 2.0), crossing(angle, np.pi)
    return {
        f"advance_90_{by}_m": at(x, quarter),
        f"transfer_90_{by}_m": at(y, quarter),
        f"tactical_diameter_180_{by}_m": at(y, half),
    }


def _steady(channels: Channels, turned: Array) -> Metrics:
    """Means over the last 90 deg of heading, once 270 deg are turned; of the channels that there are."""
    speed = np.sqrt(sum(channels[k] ** 2 for k in "uvw" if k in channels))
    of: Metrics = {"speed_ratio_steady": None, "drift_angle_steady_deg": None}
    of |= {"yaw_rate_steady_degps": None} if "r" in channels else {}
    of |= {"heel_steady_deg": None} if "phi" in channels else {}
    if turned[-1] < 1.5 * np.pi:
        return of
    last = turned >= turned[-1] - np.pi / 2.0
    drift = np.arcsin(channels["v"] / speed)
    values = {
        "speed_ratio_steady": np.mean(speed[last]) / speed[0],
        "drift_angle_steady_deg": np.degrees(np.mean(drift[last])),
    }
    for channel, name in (("r", "yaw_rate_steady_degps"), ("phi", "heel_steady_deg")):
        if channel in channels:
            values[name] = np.degrees(np.mean(channels[channel][last]))
    return {name: float(value) for name, value in values.items()}


def turning_circle(channels: Channels) -> Metrics:
    """Metrics of a turning circle executed at the first sample, towards either side.

    Parameters
    ----------
    channels : ``x`` and ``y``; with ``psi`` also the metrics by heading; with ``u v`` (and
        ``w r phi``) the steady turn; with ``z`` and ``theta`` how depth is kept; with ``t`` times.

    Returns
    -------
    ``advance_90``, ``transfer_90``, ``tactical_diameter_180``, by course (tangent of the
    track) and by heading; ``steady_diameter_m``: circle through the track beyond 180 deg of
    course, when at least 270 deg were turned. Speed ratio U/U0, drift angle, yaw rate and heel
    as means over the last 90 deg of heading. ``depth_excursion_m``: largest distance from the
    depth at execute. Transfers are positive to the side of the turn, angles as they are.
    """
    x, y = channels["x"] - channels["x"][0], channels["y"] - channels["y"][0]
    course, cx, cy = _course(x, y)
    side = 1.0 if course[-1] > 0.0 else -1.0
    metrics = _reaches(side * course, cx, side * cy, "course")
    place = crossing(side * course, np.pi)
    enough = place is not None and side * course[-1] >= 1.5 * np.pi
    beyond = slice(int(np.ceil(place or 0.0)) + 1, None)
    metrics["steady_diameter_m"] = circle_diameter(x[beyond], y[beyond]) if enough else None
    if "psi" in channels:
        turned = side * (channels["psi"] - channels["psi"][0])
        metrics |= _reaches(turned, x, side * y, "heading")
        if "t" in channels:
            t = channels["t"] - channels["t"][0]
            metrics["time_90_heading_s"] = at(t, crossing(turned, np.pi / 2.0))
            metrics["time_180_heading_s"] = at(t, crossing(turned, np.pi))
        if {"u", "v"} <= set(channels):
            metrics |= _steady(channels, turned)
    if "phi" in channels:
        metrics["heel_peak_deg"] = float(np.degrees(channels["phi"][np.argmax(np.abs(channels["phi"]))]))
    if "z" in channels:
        metrics["depth_excursion_m"] = float(np.max(np.abs(channels["z"] - channels["z"][0])))
    if "theta" in channels:
        metrics["pitch_peak_deg"] = float(np.degrees(channels["theta"][np.argmax(np.abs(channels["theta"]))]))
    return metrics


def _before(channels: Channels, name: str, time: float, window: float) -> float:
    """Mean of a channel over the seconds before a time."""
    t = channels["t"]
    inside = (t >= time - window) & (t <= time + 1e-9)
    return float(np.mean(channels[name][inside])) if inside.any() else float(np.interp(time, t, channels[name]))


def _steady_points(
    channels: Channels, name: str, ends: list[tuple[float, float]], window: float
) -> list[tuple[float, float]]:
    """What each step orders, and the mean of a channel over the window [s] before the step's end; both in degrees."""
    return [
        (float(np.degrees(ordered)), float(np.degrees(_before(channels, name, end, window)))) for ordered, end in ends
    ]


def _branches(points: list[tuple[float, float]]) -> tuple[Array, Array]:
    """The points of a spiral on its way down and on its way back, each by growing rudder."""
    array = np.array(points)
    turn = int(np.argmin(array[:, 0]))
    return array[: turn + 1][::-1], array[turn:]


@dataclass(frozen=True)
class SpiralPoint:
    """A steady point of a spiral.

    Attributes
    ----------
    dH_deg : Rudder or horizontal command [deg].
    r_degps : Yaw rate [deg/s].

    Examples
    --------
    >>> import ident
    >>> ident.SpiralPoint(dH_deg=5.0, r_degps=0.4).r_degps
    0.4
    """

    dH_deg: float
    r_degps: float


def direct_spiral(channels: Channels, ends: list[tuple[float, float]]) -> tuple[Metrics, list[SpiralPoint]]:
    """Steady yaw rate against rudder, and the hysteresis loop.

    Parameters
    ----------
    channels : ``t`` and ``r``.
    ends : Rudder command [rad] and end [s] of each step.

    Returns
    -------
    metrics : ``yaw_rate_<dH>_deg_down_degps`` and ``_up_``: at the end of the step, on the way
        from the first to the smallest rudder and back. ``loop_height_degps``: difference of the
        two at zero rudder. ``loop_width_deg``: rudder between their zeros of r, None where a
        branch has none.
    curve : The points.
    """
    if not ends:
        return dict.fromkeys(("loop_height_degps", "loop_width_deg")), []
    points = _steady_points(channels, "r", ends, 5.0)
    down, up = _branches(points)
    metrics: Metrics = {}
    for name, branch in (("down", down), ("up", up)):
        if len(branch) > 1:
            metrics |= {f"yaw_rate_{dh:+g}_deg_{name}_degps": float(r) for dh, r in branch}
    heights = [float(np.interp(0.0, b[:, 0], b[:, 1])) if b[0, 0] <= 0.0 <= b[-1, 0] else None for b in (down, up)]
    zeros = [_zero(b[:, 0], b[:, 1]) for b in (down, up)]
    metrics["loop_height_degps"] = _gap(heights)
    metrics["loop_width_deg"] = _gap(zeros)
    return metrics, [SpiralPoint(d, r) for d, r in points]


def _gap(pair: list[float | None]) -> float | None:
    return None if pair[0] is None or pair[1] is None else abs(pair[0] - pair[1])


def _zero(x: Array, y: Array) -> float | None:
    """Where ``y`` passes zero, interpolated; None where it does not."""
    change = np.flatnonzero(y[:-1] * y[1:] <= 0.0)
    if change.size == 0 or y[change[0]] == y[change[0] + 1]:
        return None
    i = int(change[0])
    return float(x[i] - y[i] * (x[i + 1] - x[i]) / (y[i + 1] - y[i]))


def reverse_spiral(channels: Channels, ends: list[tuple[float, float]]) -> tuple[Metrics, list[SpiralPoint]]:
    """Rudder that holds each yaw rate, and the width of the unstable part.

    Parameters
    ----------
    channels : ``t`` and ``dH``.
    ends : Yaw rate [rad/s] and end [s] of each step.

    Returns
    -------
    metrics : ``rudder_<r>_degps_deg``: mean over the last 30 s of each step.
        ``slope_at_zero_deg_per_degps``: of the curve at r = 0, positive when straight-line
        stable. ``loop_width_deg``: rudder from the largest fall of the curve with growing r,
        zero when it never falls.
    curve : The points.
    """
    if len(ends) < 2:
        return dict.fromkeys(("slope_at_zero_deg_per_degps", "loop_width_deg")), []
    points = _steady_points(channels, "dH", ends, 30.0)
    rate, rudder = np.array(sorted(points)).T
    metrics: Metrics = {f"rudder_{r:+g}_degps_deg": d for r, d in sorted(points)}
    i = int(np.clip(np.searchsorted(rate, 0.0), 1, len(rate) - 1))
    low, high = (i - 1, i) if rate[i] != 0.0 or i + 1 >= len(rate) else (i - 1, i + 1)
    metrics["slope_at_zero_deg_per_degps"] = float((rudder[high] - rudder[low]) / (rate[high] - rate[low]))
    metrics["loop_width_deg"] = float(np.max(np.maximum.accumulate(rudder) - rudder))
    return metrics, [SpiralPoint(d, r) for r, d in points]


def pull_out(channels: Channels, ends: list[tuple[float, float]]) -> Metrics:
    """Yaw rate that stays after the rudder is put amidships, from turns to either side.

    Parameters
    ----------
    channels : ``t`` and ``r``.
    ends : Rudder command [rad] and end [s] of each step.

    Returns
    -------
    ``turn_k_degps``: rate of the k-th turn. ``residual_k_degps``: what is left of it at the
    end of the pull-out. ``residual_difference_degps``: between the first two; a boat that is
    straight-line stable comes to one rate from both sides, zero.
    """
    metrics: Metrics = {}
    turns = residuals = 0
    for dh, rate in _steady_points(channels, "r", ends, 5.0):
        if dh != 0.0:
            turns += 1
            metrics[f"turn_{turns}_degps"] = rate
        else:
            residuals += 1
            metrics[f"residual_{residuals}_degps"] = rate
    pair = [metrics.get("residual_1_degps"), metrics.get("residual_2_degps")]
    metrics["residual_difference_degps"] = _gap(pair)
    return metrics


def stopping(channels: Channels, stopped: bool) -> Metrics:
    """Stopping test: from the order to dead in the water.

    Parameters
    ----------
    channels : ``t x y psi s``, up to the end of the run.
    stopped : Whether the boat lay still at the end.

    Returns
    -------
    ``time_to_stop_s``; ``track_reach_m``: length of the path; ``head_reach_m`` and
    ``lateral_deviation_m``: along and across the first course; ``heading_change_deg``. None
    when the boat did not stop.
    """
    heading = channels["psi"][0]
    dx, dy = channels["x"][-1] - channels["x"][0], channels["y"][-1] - channels["y"][0]
    values = {
        "time_to_stop_s": channels["t"][-1],
        "track_reach_m": channels["s"][-1],
        "head_reach_m": dx * np.cos(heading) + dy * np.sin(heading),
        "lateral_deviation_m": dy * np.cos(heading) - dx * np.sin(heading),
        "heading_change_deg": np.degrees(channels["psi"][-1] - heading),
    }
    return {k: float(v) if stopped else None for k, v in values.items()}
