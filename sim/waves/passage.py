"""Wave quantities along a boat's path: summed once in a while and interpolated, compiled.

All waves of ``sim.waves.loads`` are summed once per ``span`` seconds at the predicted place of
the boat, with rates, and interpolated by cubic Hermite polynomials in between.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from sim.boat.state import PHI, PSI, THETA
from sim.compiled import inlined, inner, merged, outer
from sim.waves.loads import IMPULSE, WATER, Passage, Sea, sum_up
from sim.waves.pressure import fill_rotation

Array = NDArray[np.float64]

# Numbers of a curve over a span: its present value and four coefficients.
CURVE = 5


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
    size, miss = sea.length, 0.0
    for k in range(3):
        place, turn = abs(y[6 + k] - pas.state[6 + k]), abs(y[9 + k] - pas.state[9 + k])
        speed, rate = abs(y[k] - pas.state[k]), abs(y[3 + k] - pas.state[3 + k])
        miss = max(miss, place + size * turn, sea.span * (speed + size * rate))
    return miss


@merged
def move_on(sea: Sea, y: Array, time: float, pas: Passage) -> bool:
    """``advance`` as a part of its caller: handing over a sea and its sums takes long."""
    ahead = pas.time[1]
    if pas.time[0] <= time < ahead - 1e-9 * sea.span:
        return False
    known = pas.time[0] <= ahead and abs(time - ahead) <= 1e-6 * sea.span
    anew = not (known and _miss(sea, y, pas) <= sea.reach)
    if anew:
        sum_up(sea, y, time, pas, pas.value[0], pas.slope[0])
    else:
        for i in range(pas.value.shape[1]):
            pas.value[0, i], pas.slope[0, i] = pas.value[1, i], pas.slope[1, i]
    gain, mean = pas.gain, pas.sums[0]
    for k in range(6):
        gain[k] = y[k] - pas.before[k] if known else 0.0
        pas.before[k] = y[k]
    pas.time[0] = time
    pas.time[1] = time + sea.span
    _predict(sea, y, gain, mean, pas.matrix, pas.state)
    sum_up(sea, pas.state, pas.time[1], pas, pas.value[1], pas.slope[1])
    return anew


@outer
def advance(sea: Sea, y: Array, time: float, pas: Passage) -> bool:
    """Make the sums cover the time from now on; call it before a step, not within one.

    Parameters
    ----------
    sea, pas : Of this boat and thread.
    y : (12,) state now.
    time : Now [s].

    Returns
    -------
    Whether the sums at the start are new, and not those that ended the span before.
    """
    return move_on(sea, y, time, pas)


@inner
def fit(value: Array, slope: Array, span: float, out: Array, at: int) -> None:
    """Curves of all quantities over a span: cubic Hermite polynomials of the part of it that has passed.

    Parameters
    ----------
    value, slope : (2, n) at its ends. span : Its length [s].
    out : From ``at`` on ``CURVE`` numbers a quantity: its present value, left alone, and coefficients of t^0 to t^3.
    """
    for i in range(value.shape[1]):
        k, rise = at + CURVE * i, value[1, i] - value[0, i]
        start, end = span * slope[0, i], span * slope[1, i]
        out[k + 1], out[k + 2] = value[0, i], start
        out[k + 3], out[k + 4] = 3.0 * rise - 2.0 * start - end, start + end - 2.0 * rise


@inner
def recall(curves: Array, at: int, span: float, value: Array, slope: Array) -> None:
    """Values and slopes at the end of curves, into the second rows of (2, n) arrays."""
    for i in range(value.shape[1]):
        k = at + CURVE * i
        a, b, c = curves[k + 2], curves[k + 3], curves[k + 4]
        value[1, i], slope[1, i] = curves[k + 1] + a + b + c, (a + 2.0 * b + 3.0 * c) / span


@inlined
def height(curves: Array, k: int, t: float) -> float:
    """Value of the curve that stands at ``k``, when the part ``t`` of its span has passed."""
    return curves[k + 1] + t * (curves[k + 2] + t * (curves[k + 3] + t * curves[k + 4]))


@inlined
def rise(curves: Array, k: int, t: float) -> float:
    """Slope of a curve, over the whole of its span."""
    return curves[k + 2] + t * (2.0 * curves[k + 3] + 3.0 * t * curves[k + 4])


@outer
def _interpolate(value: Array, slope: Array, span: float, t: float, curves: Array, out: Array) -> None:
    fit(value, slope, span, curves, 0)
    for i in range(value.shape[1]):
        out[i] = height(curves, CURVE * i, t)
    for i in range(6):
        out[IMPULSE + i] = rise(curves, CURVE * (WATER + i), t) / span


def interpolate(span: Array, value: Array, slope: Array, time: float, out: Array) -> None:
    """Wave quantities at a time inside the present span, by cubic Hermite interpolation.

    Parameters
    ----------
    span, value, slope : ``time``, ``value`` and ``slope`` of a passage, after ``advance``.
    time : [s].
    out : (n,) FORCE Froude-Krylov load [N, N m]; in the place of IMPULSE the rate of the water's u v w p q r
        along the motion [m/s^2, rad/s^2], which times the added mass is the added-mass load;
        WATER; PROBES; gauge; elevations.
    """
    whole = span[1] - span[0]
    _interpolate(value, slope, whole, (time - span[0]) / whole, np.zeros(CURVE * value.shape[1]), out)
