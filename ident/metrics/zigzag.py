"""Zigzag and roll-decay metrics by the ITTC definitions, from any time history."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Leg:
    """One leg of a zigzag: from a plane execute to the next.

    Attributes
    ----------
    sense : +1 when the angle grows on this leg.
    check : Time [s] at which the angle reaches the check value, None when it does not.
    peak : Largest sense * angle [rad] after the check, None when not reached.
    """

    sense: int
    check: float | None
    peak: float | None
    peak_time: float | None


def _extremum(t: Array, x: Array, i: int) -> tuple[float, float]:
    """Time and value of the extremum near sample ``i``, by the parabola through three."""
    if i == 0 or i == len(x) - 1 or not t[i - 1] < t[i] < t[i + 1]:
        return float(t[i]), float(x[i])
    # Divided differences: a fit by linear algebra would round by the machine it runs on.
    before, after = t[i - 1] - t[i], t[i + 1] - t[i]
    one, two = (x[i - 1] - x[i]) / before, (x[i + 1] - x[i]) / after
    curved = (two - one) / (after - before)
    if curved >= 0.0:
        return float(t[i]), float(x[i])
    slope = one - curved * before
    return float(t[i] - slope / (2.0 * curved)), float(x[i] - slope**2 / (4.0 * curved))


def legs(t: Array, angle: Array, check: float, sense: int) -> list[Leg]:
    """Legs of a zigzag.

    Parameters
    ----------
    t : Times [s]; the first plane execute is at t[0].
    angle : Heading or pitch [rad].
    check : Check angle [rad], positive.
    sense : Sign of the angle's growth on the first leg.

    Returns
    -------
    The legs in order; the last may be incomplete.
    """
    swings: list[Leg] = []
    start = 0
    while start < len(t):
        x = sense * angle
        after = np.flatnonzero(x[start:] >= check)
        if after.size == 0:
            break
        i = start + int(after[0])
        crossing = float(t[i])
        if i > 0 and x[i] > x[i - 1]:
            crossing = float(t[i - 1] + (check - x[i - 1]) * (t[i] - t[i - 1]) / (x[i] - x[i - 1]))
        back = np.flatnonzero(x[i:] < check)
        end = i + int(back[0]) if back.size else len(t)
        top = i + int(np.argmax(x[i:end]))
        reached = top < len(t) - 1
        peak_time, peak = _extremum(t, x, top) if reached else (None, None)
        swings.append(Leg(sense, crossing, peak, peak_time))
        sense, start = -sense, end
    return swings


def zigzag(
    t: Array, angle: Array, rate: tuple[Array, Array] | None, check: float, sense: int, name: str
) -> dict[str, float | None]:
    """Zigzag metrics: overshoots, execute times, period, peak rates.

    Parameters
    ----------
    t, angle : Times [s] and heading or pitch [rad].
    rate : Times and rate [rad/s] of the same angle, if known.
    check, sense : Check angle [rad] and sign of the first leg.
    name : ``yaw`` or ``pitch``, for the names of the peak rates.

    Returns
    -------
    ``overshoot_k_deg``: largest angle after the k-th check less the check angle.
    ``execute_k_s``: time of the k-th plane execute after the first (k = 2 is the first
    check). ``period_s``: second to fourth execute. ``peak_<name>_rate_k_degps``: largest
    rate on the k-th leg, its ends included: it may still grow when the plane is reversed.
    None where the record ends before.
    """
    swings = legs(t, angle, check, sense)
    metrics: dict[str, float | None] = {}
    for k in range(3):
        leg = swings[k] if k < len(swings) else None
        peak = np.degrees(leg.peak - check) if leg and leg.peak is not None else None
        metrics[f"overshoot_{k + 1}_deg"] = peak
        metrics[f"execute_{k + 2}_s"] = leg.check if leg else None
    first, third = metrics["execute_2_s"], metrics["execute_4_s"]
    metrics["period_s"] = third - first if first is not None and third is not None else None
    if rate is not None:
        bounds = [float(t[0]), *[leg.check for leg in swings if leg.check is not None]]
        for k in range(3):
            value = None
            if k + 1 < len(bounds):
                value = float(np.degrees(_largest(rate, sense * (-1) ** k, bounds[k], bounds[k + 1])))
            metrics[f"peak_{name}_rate_{k + 1}_degps"] = value
    return {k: float(v) if v is not None else None for k, v in metrics.items()}


def _largest(rate: tuple[Array, Array], sense: int, begin: float, end: float) -> float:
    """Largest rate to one side between two times, at the samples and at the times themselves."""
    inside = (rate[0] >= begin) & (rate[0] <= end)
    return float(np.max(sense * np.concatenate([rate[1][inside], np.interp([begin, end], *rate)])))


def roll_decay(t: Array, phi: Array) -> dict[str, float | None]:
    """Roll period and damping of a free decay.

    Parameters
    ----------
    t, phi : Times [s] and heel [rad].

    Returns
    -------
    ``roll_period_s``: mean time between crossings of the mean heel, both ways.
    ``log_decrement``: mean logarithm of successive half-cycle amplitudes' ratio, per period;
    amplitudes from peak to trough, so that a constant heel does not matter.
    None where the record holds less than two periods.
    """
    x = phi - phi.mean()
    up = np.flatnonzero(x[:-1] * x[1:] < 0.0)
    crossings = t[up] - x[up] * (t[up + 1] - t[up]) / (x[up + 1] - x[up])
    if crossings.size < 5:
        return {"roll_period_s": None, "log_decrement": None}
    pieces = [x[a + 1 : b + 1] for a, b in itertools.pairwise(up)]
    peaks = np.array([p[np.argmax(np.abs(p))] for p in pieces])
    swings = np.abs(np.diff(peaks))
    return {
        "roll_period_s": float(2.0 * np.mean(np.diff(crossings))),
        "log_decrement": float(2.0 * np.log(swings[0] / swings[-1]) / (swings.size - 1)),
    }
