"""Metrics of vertical-plane maneuvers and of autopilots.

Channels are arrays of one length, program frame, SI and radians. A metric is None where the
record does not reach it.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Channels = dict[str, Array]
Metrics = dict[str, float | None]


def oscillation(t: Array, x: Array) -> tuple[float | None, float | None]:
    """Period [s] and damping ratio of an oscillation about zero.

    Parameters
    ----------
    t, x : Times [s] and the deviation from equilibrium.

    Returns
    -------
    Mean time between crossings of zero, twice; damping ratio by the logarithmic decrement
    delta of successive peaks, zeta = delta / sqrt(4 pi^2 + delta^2). None with less than
    three crossings, the damping also when the first peak is the last.
    """
    i = np.flatnonzero(x[:-1] * x[1:] < 0.0)
    if i.size < 3:
        return None, None
    crossings = t[i] - x[i] * (t[i + 1] - t[i]) / (x[i + 1] - x[i])
    peaks = np.array([np.max(np.abs(x[a + 1 : b + 1])) for a, b in itertools.pairwise(i)])
    # The remainder of a run that has settled is rounding.
    peaks = peaks[: int(np.argmax(peaks < 0.01 * peaks[0])) or None]
    if peaks.size < 2:
        return float(2.0 * np.mean(np.diff(crossings))), None
    decrement = 2.0 * np.log(peaks[0] / peaks[-1]) / (peaks.size - 1)
    return float(2.0 * np.mean(np.diff(crossings))), float(decrement / np.sqrt(4.0 * np.pi**2 + decrement**2))


def depth_overshoot(t: Array, z: Array, execute: float | None, sense: int) -> float | None:
    """Change of depth from a reversal of the planes to the depth's extremum [m], positive.

    Parameters
    ----------
    t, z : Times [s] and depth [m, down].
    execute : Time of the reversal [s].
    sense : +1 when the boat rises at the reversal.
    """
    if execute is None or execute >= t[-1]:
        return None
    rise = -sense * z[t >= execute]
    falls = np.flatnonzero(np.diff(rise) < 0.0)
    if falls.size == 0:
        return None
    return float(max(rise[falls[0]] + sense * np.interp(execute, t, z), 0.0))


def meander(channels: Channels, execute: float | None, pitch: float) -> Metrics:
    """Meander: planes back at the trim once the pitch has changed.

    Parameters
    ----------
    channels : ``t``, ``theta`` and ``z``.
    execute : Time [s] at which the planes go back.
    pitch : Pitch of the equilibrium [rad].

    Returns
    -------
    ``time_to_execute_s``; ``pitch_overshoot_deg``: pitch after the execute beyond that at it;
    ``depth_overshoot_m``; ``meander_period_s`` and ``damping_ratio`` of the pitch about its
    equilibrium; ``depth_change_m``: between both ends of the record, positive deeper.
    """
    t, theta, z = channels["t"], channels["theta"], channels["z"]
    names = ("time_to_execute_s", "pitch_overshoot_deg", "depth_overshoot_m", "meander_period_s", "damping_ratio")
    if execute is None:
        return dict.fromkeys((*names, "depth_change_m"))
    after = t >= execute
    there = float(np.interp(execute, t, theta))
    sense = 1 if there > theta[0] else -1
    # The first swing only: the largest deviation is the overshoot.
    overshoot = float(np.degrees(np.max(sense * (theta[after] - there))))
    period, damping = oscillation(t[after], theta[after] - pitch)
    values = (execute, max(overshoot, 0.0), depth_overshoot(t, z, execute, sense), period, damping)
    return dict(zip(names, values, strict=True)) | {"depth_change_m": float(z[-1] - z[0])}


def _crossed(t: Array, x: Array, i: int, level: float) -> float:
    """When ``x`` passes a level between sample ``i - 1`` and sample ``i`` [s]."""
    if i == 0 or x[i] == x[i - 1]:
        return float(t[i])
    return float(t[i - 1] + (level - x[i - 1]) * (t[i] - t[i - 1]) / (x[i] - x[i - 1]))


def depth_change(channels: Channels, step: float, band: float = 0.05) -> Metrics:
    """Step response of the depth.

    Parameters
    ----------
    channels : ``t``, ``z`` and ``theta``; the order is given at the first sample.
    step : Ordered change [m], positive deeper.
    band : Share of the step within which the depth counts as settled.

    Returns
    -------
    ``reach_90_s``: time to 90 % of the step. ``overshoot_m`` and ``overshoot_percent``:
    beyond the order. ``settling_5_percent_s``: from when on the depth stays within the band.
    ``pitch_peak_deg``: largest change of pitch.
    """
    t, theta = channels["t"] - channels["t"][0], channels["theta"]
    share = (channels["z"] - channels["z"][0]) / step
    reached = np.flatnonzero(share >= 0.9)
    outside = np.flatnonzero(np.abs(share - 1.0) > band)
    settled = outside.size == 0 or outside[-1] < len(t) - 1
    over = max(float(share.max()) - 1.0, 0.0)
    change = theta - theta[0]
    return {
        "reach_90_s": _crossed(t, share, int(reached[0]), 0.9) if reached.size else None,
        "overshoot_m": over * abs(step),
        "overshoot_percent": 100.0 * over,
        f"settling_{100 * band:g}_percent_s": _crossed(t, np.abs(share - 1.0), int(outside[-1]) + 1, band)
        if settled and outside.size
        else None,
        "pitch_peak_deg": float(np.degrees(change[np.argmax(np.abs(change))])),
    }


def course_keeping(channels: Channels, released: float | None, band_deg: float = 0.5) -> Metrics:
    """Return to a course by the autopilot.

    Parameters
    ----------
    channels : ``t``, ``psi``, ``y`` and ``dH``.
    released : Time [s] from which the autopilot steers.
    band_deg : Heading error that counts as on course.

    Returns
    -------
    ``heading_deviation_peak_deg``; ``heading_overshoot_deg``: beyond the course to the other
    side; ``settling_s``: from the release until the heading stays within the band;
    ``rudder_rms_deg`` while steering; ``lateral_offset_m`` at the end.
    """
    names = ("heading_deviation_peak_deg", "heading_overshoot_deg", "settling_s", "rudder_rms_deg", "lateral_offset_m")
    if released is None:
        return dict.fromkeys(names)
    steering = channels["t"] >= released
    t, error = channels["t"][steering], np.degrees(channels["psi"][steering] - channels["psi"][0])
    side = 1.0 if error[0] > 0.0 else -1.0
    outside = np.flatnonzero(np.abs(error) > band_deg)
    settled = outside.size > 0 and outside[-1] < len(t) - 1
    values = (
        float(np.max(np.abs(error))),
        float(max(np.max(-side * error), 0.0)),
        _crossed(t, np.abs(error), int(outside[-1]) + 1, band_deg) - released if settled else None,
        float(np.degrees(np.sqrt(np.mean(channels["dH"][steering] ** 2)))),
        float(channels["y"][-1] - channels["y"][0]),
    )
    return dict(zip(names, values, strict=True))


def rise(channels: Channels, surfaced: bool) -> Metrics:
    """Emergency rise up to the surface.

    Parameters
    ----------
    channels : ``t``, ``theta``, ``q``, ``u`` and ``z``, up to the end of the run.
    surfaced : Whether the run ended because the nose reached the surface.

    Returns
    -------
    ``nose_at_surface_s``; pitch, speed ratio u/u0 and rise at the end of the run; largest
    pitch rate and its time.
    """
    t, q = channels["t"], channels["q"]
    top = int(np.argmax(q))
    return {
        "nose_at_surface_s": float(t[-1]) if surfaced else None,
        "pitch_at_end_deg": float(np.degrees(channels["theta"][-1])),
        "speed_ratio_at_end": float(channels["u"][-1] / channels["u"][0]),
        "rise_at_end_m": float(channels["z"][0] - channels["z"][-1]),
        "pitch_rate_peak_degps": float(np.degrees(q[top])),
        "pitch_rate_peak_at_s": float(t[top]),
    }
