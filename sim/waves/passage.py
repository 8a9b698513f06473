"""Wave quantities along a boat's path: summed once in a while and interpolated, compiled.

All waves of ``sim.waves.loads`` are summed once per ``span`` seconds at the predicted place of
the boat, with rates, and interpolated by cubic Hermite polynomials in between.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from sim.boat.state import PHI, PSI, THETA
from sim.compiled import inlined, inner, outer
from sim.waves.loads import IMPULSE, WATER, Passage, Sea, evaluate
from sim.waves.pressure import fill_rotation

Array = NDArray[np.float64]

# What ``interpolate`` puts in the place of IMPULSE.
WATER_RATE = IMPULSE


@inner
def _predict(sea: Sea, y: Array, gain: Array, mean: Array, matrix: Array, out: Array) -> None:
    """State after a span when the velocities change by ``gain``, second order in its length; ``mean`` is scratch."""
    h = sea.span
    for k in range(6):
        mean[k] = y[k] + 0.5 * gain[k]
        out[k] = y[k] + gain[k]
    phi, theta, psi = y[PHI], y[THETA], y[PSI]
    for _ in range(2):
        # Rates of the angles at the start, then at half time.
        fill_rotation(phi, theta, psi, matrix)
        ct = max(sqrt(matrix[2, 1] * matrix[2, 1] + matrix[2, 2] * matrix[2, 2]), 1e-6)
        turn = (mean[4] * matrix[2, 1] + mean[5] * matrix[2, 2]) / (ct * ct)
        dphi = mean[3] - turn * matrix[2, 0]
        dtheta = (mean[4] * matrix[2, 2] - mean[5] * matrix[2, 1]) / ct
        phi, theta, psi = y[PHI] + 0.5 * h * dphi, y[THETA] + 0.5 * h * dtheta, y[PSI] + 0.5 * h * turn
    for k in range(3):
        out[6 + k] = y[6 + k] + h * (matrix[k, 0] * mean[0] + matrix[k, 1] * mean[1] + matrix[k, 2] * mean[2])
    out[6] += h * sea.waves.flow_north
    out[7] += h * sea.waves.flow_east
    out[PHI], out[THETA], out[PSI] = y[PHI] + h * dphi, y[THETA] + h * dtheta, y[PSI] + h * turn


@inner
def _miss(sea: Sea, y: Array, pas: Passage) -> float:
    """Largest distance of a point from where it was predicted [m], and of its velocity over a span."""
    size = 0.0
    for i in range(sea.points.shape[0]):
        size = max(size, abs(sea.points[i, 0]))
    miss = 0.0
    for k in range(3):
        place, turn = abs(y[6 + k] - pas.state[6 + k]), abs(y[9 + k] - pas.state[9 + k])
        speed, rate = abs(y[k] - pas.state[k]), abs(y[3 + k] - pas.state[3 + k])
        miss = max(miss, place + size * turn, sea.span * (speed + size * rate))
    return miss


@outer
def advance(sea: Sea, y: Array, time: float, pas: Passage) -> None:
    """Make the sums cover the time from now on; call it before a step, not within one.

    Parameters
    ----------
    sea, pas : Of this boat and thread.
    y : (12,) state now.
    time : Now [s].
    """
    ahead = pas.time[1]
    if pas.time[0] <= time < ahead - 1e-9 * sea.span:
        return
    known = pas.time[0] <= ahead and abs(time - ahead) <= 1e-6 * sea.span
    if known and _miss(sea, y, pas) <= sea.reach:
        for i in range(pas.value.shape[1]):
            pas.value[0, i], pas.slope[0, i] = pas.value[1, i], pas.slope[1, i]
    else:
        evaluate(sea, y, time, pas, pas.value[0], pas.slope[0])
    gain, mean = pas.body, pas.sums
    for k in range(6):
        gain[k] = y[k] - pas.before[k] if known else 0.0
        pas.before[k] = y[k]
    pas.time[0] = time
    pas.time[1] = time + sea.span
    _predict(sea, y, gain, mean, pas.matrix, pas.state)
    evaluate(sea, pas.state, pas.time[1], pas, pas.value[1], pas.slope[1])


@inlined
def _hermite(start: float, end: float, time: float) -> tuple[float, float, float, float, float, float, float]:
    """Weights of a cubic between two sums: of the values and slopes at its ends, in the value
    (four) and in its rate (of the difference of the values, and of the slopes)."""
    h = end - start
    t = (time - start) / h
    a, b = (1.0 + 2.0 * t) * (1.0 - t) * (1.0 - t), t * t * (3.0 - 2.0 * t)
    c, d = h * t * (1.0 - t) * (1.0 - t), h * t * t * (t - 1.0)
    e, f, g = 6.0 * t * (1.0 - t) / h, (1.0 - t) * (1.0 - 3.0 * t), t * (3.0 * t - 2.0)
    return a, b, c, d, e, f, g


@inlined
def blend(
    v: Array,
    start: float,
    end: float,
    value: int,
    slope: int,
    width: int,
    time: float,
    first: int,
    last: int,
    out: Array,
    at: int,
) -> None:
    """Wave quantities ``first`` to ``last`` at a time, into ``out`` from ``at + first`` on.

    Parameters
    ----------
    v : Holds values and slopes at both ends of the span, ``width`` each, from ``value`` and ``slope`` on.
    start, end, time : Of the span, and wanted [s].
    """
    a, b, c, d, e, f, g = _hermite(start, end, time)
    after, turned = value + width, slope + width
    for i in range(first, last):
        out[at + i] = a * v[value + i] + b * v[after + i] + c * v[slope + i] + d * v[turned + i]
    if first == 0:
        for i in range(WATER, WATER + 6):
            rate = e * (v[after + i] - v[value + i]) + f * v[slope + i] + g * v[turned + i]
            out[at + WATER_RATE - WATER + i] = rate


@outer
def _interpolate(start: float, end: float, v: Array, width: int, time: float, out: Array) -> None:
    blend(v, start, end, 0, 2 * width, width, time, 0, width, out, 0)


def interpolate(span: Array, value: Array, slope: Array, time: float, out: Array) -> None:
    """Wave quantities at a time inside the present span, by cubic Hermite interpolation.

    Parameters
    ----------
    span, value, slope : ``time``, ``value`` and ``slope`` of a passage, after ``advance``.
    time : [s].
    out : (n,) FORCE Froude-Krylov load [N, N m]; WATER_RATE rate of the water's u v w p q r
        along the motion [m/s^2, rad/s^2], which times the added mass is the added-mass load;
        WATER; PROBES; gauge; elevations.
    """
    v = np.concatenate([value.ravel(), slope.ravel()])
    _interpolate(span[0], span[1], v, value.shape[1], time, out)


@outer
def gauge(sea: Sea, pas: Passage, time: float) -> tuple[float, float]:
    """Head of the waves' pressure at the body origin and its rate along the motion.

    Parameters
    ----------
    sea, pas : After ``advance``.
    time : [s].

    Returns
    -------
    p / (rho g) [m] and its rate [m/s]: what a depth gauge reads beside the depth.
    """
    i = pas.value.shape[1] - sea.stations - 1
    p, q, r, s = pas.value[0, i], pas.value[1, i], pas.slope[0, i], pas.slope[1, i]
    a, b, c, d, e, f, g = _hermite(pas.time[0], pas.time[1], time)
    return a * p + b * q + c * r + d * s, e * (q - p) + f * r + g * s
