"""Self-propulsion as a root of six balances: Newton's method, compiled.

Unknowns ``x``: n over U/D, two of pitch, dV, ballast and trim tank, heel (or, upright, the shift of
the weight to starboard), drift and dH. Where it fails, ``sim.flight.trim`` asks a method that looks
further.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from sim.boat.state import PHI, THETA, Z
from sim.compiled import merged, outer
from sim.kernel.layout import DIAMETER, HAS_TANKS, HELD, N_PLANES, SHIFT, Array, Whole
from sim.kernel.rhs import fill_rate

# Unknowns, and what keeps the boat level.
N_X = 6
PITCH, DV, BALLAST, TRIM_TANK = range(4)
# Scratch: residuals, a column of them, unknowns tried, the linear system with its right side.
_RESIDUAL, _TRIED, _X, _SYSTEM = 0, 6, 12, 18
SCRATCH = _SYSTEM + N_X * (N_X + 1)
_ITERATIONS, _HALVINGS = 30, 12
# Relative difference of a slope; size of residuals that rounding leaves [m/s^2, rad/s^2].
_DIFFERENCE, _ROUNDING = 1.5e-8, 1e-15


class Search(NamedTuple):
    """An equilibrium that is looked for, and where its state is left.

    Attributes
    ----------
    m, w : Model. s, k : Scratch. Floats and whole numbers.
    speed, z : U [m/s], depth of the origin [m]. mixer : (planes, 2) shares of dV and dH.
    free : (2,) which of ``level`` are unknown. level : (4,) pitch, dV, ballast, trim tank; those
        that are free are set. size : (4,) of one unit of an unknown.
    upright : Whether the weight is shifted to starboard instead of a heel.
    y, c, dy : (12,), (controls,) and (12,) state, controls and rate.
    a : (``SCRATCH``,) of Newton's method.
    """

    m: Array
    w: Whole
    s: Array
    k: Whole
    speed: float
    z: float
    mixer: Array
    free: Whole
    level: Array
    size: Array
    upright: bool
    y: Array
    c: Array
    dy: Array
    a: Array


@merged
def _place(b: Search, x: np.ndarray) -> None:
    """State, controls and shift of the weight that the unknowns mean, into the search and its scratch."""
    level, y, c = b.level, b.y, b.c
    for i in range(2):
        level[b.free[i]] = b.size[b.free[i]] * x[1 + i]
    heel, drift, dh, pitch = 0.0 if b.upright else x[3], x[4], x[5], level[PITCH]
    b.s[SHIFT] = x[3] if b.upright else 0.0
    u = b.speed * cos(drift) * cos(pitch)
    v = b.speed * sin(drift)
    # Level flight: -sin(theta) u + sin(phi) cos(theta) v + cos(phi) cos(theta) w = 0.
    across = (sin(pitch) * u - sin(heel) * cos(pitch) * v) / (cos(heel) * cos(pitch))
    scale = b.speed / sqrt(u * u + v * v + across * across)
    for i in range(y.size):
        y[i] = 0.0
    y[0], y[1], y[2] = u * scale, v * scale, across * scale
    y[Z], y[PHI], y[THETA] = b.z, heel, pitch
    planes = b.w[N_PLANES]
    for i in range(planes):
        c[i] = b.mixer[i, 0] * level[DV] + b.mixer[i, 1] * dh
    c[planes] = x[0] * b.speed / b.m[DIAMETER]
    if b.w[HAS_TANKS]:
        c[planes + 1], c[planes + 2] = level[BALLAST], level[TRIM_TANK]


@merged
def _hold(b: Search, x: np.ndarray) -> None:
    """Residuals of held heave, roll and pitch: pitch, heel and dV, which are zero there."""
    if b.w[HELD] & 4:
        b.dy[2] = x[1]
    if b.w[HELD] & 8:
        b.dy[3] = x[3]
    if b.w[HELD] & 16:
        b.dy[4] = x[2]


@merged
def _solve(a: np.ndarray) -> bool:
    """Six equations with their right side as a column, solved into it; false when singular."""
    n = N_X + 1
    for k in range(N_X):
        p = k
        for i in range(k + 1, N_X):
            if abs(a[_SYSTEM + n * i + k]) > abs(a[_SYSTEM + n * p + k]):
                p = i
        if not abs(a[_SYSTEM + n * p + k]) > 0.0:
            return False
        for j in range(n):
            a[_SYSTEM + n * k + j], a[_SYSTEM + n * p + j] = a[_SYSTEM + n * p + j], a[_SYSTEM + n * k + j]
        for i in range(N_X):
            if i != k:
                factor = a[_SYSTEM + n * i + k] / a[_SYSTEM + n * k + k]
                for j in range(k, n):
                    a[_SYSTEM + n * i + j] -= factor * a[_SYSTEM + n * k + j]
    for k in range(N_X):
        a[_SYSTEM + n * k + N_X] /= a[_SYSTEM + n * k + k]
    return True


@outer
def attempt(b: Search, x: np.ndarray) -> float:
    """Accelerations at the unknowns, and what stands for those held, into ``b.dy``; the sum of their squares."""
    _place(b, x)
    fill_rate(b.m, b.w, b.y, b.c, (), b.s, b.k, b.dy)
    if b.w[HELD]:
        _hold(b, x)
    total = 0.0
    for i in range(N_X):
        total += b.dy[i] * b.dy[i]
    return total


@merged
def _slopes(b: Search, x: np.ndarray) -> None:
    """The linear system of Newton's method at the unknowns, whose residuals are in the scratch."""
    a = b.a
    for j in range(N_X):
        kept = x[j]
        h = _DIFFERENCE * max(abs(kept), 1e-2)
        x[j] = kept + h
        h = x[j] - kept
        attempt(b, x)
        x[j] = kept
        for i in range(N_X):
            a[_SYSTEM + (N_X + 1) * i + j] = (b.dy[i] - a[_RESIDUAL + i]) / h
    for i in range(N_X):
        a[_SYSTEM + (N_X + 1) * i + N_X] = -a[_RESIDUAL + i]
        a[_X + i] = x[i]


@merged
def _step_down(b: Search, x: np.ndarray, norm: float) -> bool:
    """Go along the solution of the system, halved until the residuals fall; false when they do not."""
    a, share = b.a, 1.0
    for _ in range(_HALVINGS):
        for i in range(N_X):
            x[i] = a[_X + i] + share * a[_SYSTEM + (N_X + 1) * i + N_X]
        if attempt(b, x) < norm:
            return True
        share *= 0.5
    return False


@outer
def balance(b: Search, x: np.ndarray) -> float:
    """Newton's method with halved steps, from ``x``; largest acceleration left at what is found.

    Parameters
    ----------
    x : (6,) start, left at the root, with its state, controls and rate in the search.
    """
    a, largest = b.a, np.inf
    # The last step counts when it gains.
    for _ in range(_ITERATIONS):
        norm, largest = attempt(b, x), 0.0
        for i in range(N_X):
            a[_RESIDUAL + i] = b.dy[i]
            largest = max(largest, abs(b.dy[i]))
        if not largest > _ROUNDING:
            return largest if largest == largest else np.inf
        _slopes(b, x)
        if not (_solve(a) and _step_down(b, x, norm)):
            for i in range(N_X):
                x[i] = a[_X + i]
            attempt(b, x)
            return largest
    return largest
