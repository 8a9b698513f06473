"""Self-propulsion as a root of six balances: Newton's method, compiled.

Unknowns ``x``: n over U/D, two of pitch, dV, ballast and trim tank, heel (or, upright, the shift of
the weight to starboard), drift and dH. Where it fails, ``sim.flight.trim`` asks a method that looks
further.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from sim.compiled import inner, outer
from sim.kernel.layout import DIAMETER, HAS_TANKS, HELD, N_PLANES, PHI, SHIFT, THETA, Around, Z
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


@outer
def place(
    m: np.ndarray,
    w: np.ndarray,
    x: np.ndarray,
    speed: float,
    z: float,
    mixer: np.ndarray,
    free: np.ndarray,
    level: np.ndarray,
    size: np.ndarray,
    upright: bool,
    s: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
) -> None:
    """State, controls and shift of the weight that the unknowns mean, into ``y``, ``c`` and ``s``.

    Parameters
    ----------
    speed, z : U [m/s], depth of the origin [m]. mixer : (planes, 2).
    free : (2,) which of ``level`` are unknown. level : (4,) pitch, dV, ballast, trim tank; those
        that are free are set. size : (4,) of one unit of an unknown.
    """
    for i in range(2):
        level[free[i]] = size[free[i]] * x[1 + i]
    heel, drift, dh, pitch = 0.0 if upright else x[3], x[4], x[5], level[PITCH]
    s[SHIFT] = x[3] if upright else 0.0
    u = speed * cos(drift) * cos(pitch)
    v = speed * sin(drift)
    # Level flight: -sin(theta) u + sin(phi) cos(theta) v + cos(phi) cos(theta) w = 0.
    across = (sin(pitch) * u - sin(heel) * cos(pitch) * v) / (cos(heel) * cos(pitch))
    scale = speed / sqrt(u * u + v * v + across * across)
    for i in range(y.size):
        y[i] = 0.0
    y[0], y[1], y[2] = u * scale, v * scale, across * scale
    y[Z], y[PHI], y[THETA] = z, heel, pitch
    planes = w[N_PLANES]
    for i in range(planes):
        c[i] = mixer[i, 0] * level[DV] + mixer[i, 1] * dh
    c[planes] = x[0] * speed / m[DIAMETER]
    if w[HAS_TANKS]:
        c[planes + 1], c[planes + 2] = level[BALLAST], level[TRIM_TANK]


@outer
def hold(w: np.ndarray, x: np.ndarray, dy: np.ndarray) -> None:
    """Residuals of held heave, roll and pitch: pitch, heel and dV, which are zero there."""
    if w[HELD] & 4:
        dy[2] = x[1]
    if w[HELD] & 8:
        dy[3] = x[3]
    if w[HELD] & 16:
        dy[4] = x[2]


@inner
def _residuals(
    m: np.ndarray,
    w: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    near: Around,
    s: np.ndarray,
    k: np.ndarray,
    dy: np.ndarray,
) -> None:
    """Accelerations of a state, and what stands for those that are held."""
    fill_rate(m, w, y, c, near, s, k, dy)
    if w[HELD]:
        hold(w, x, dy)


@inner
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
def balance(
    m: np.ndarray,
    w: np.ndarray,
    x: np.ndarray,
    speed: float,
    z: float,
    mixer: np.ndarray,
    free: np.ndarray,
    level: np.ndarray,
    size: np.ndarray,
    upright: bool,
    near: Around,
    s: np.ndarray,
    k: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    dy: np.ndarray,
    a: np.ndarray,
) -> float:
    """Newton's method with halved steps, from ``x``; largest acceleration left at what is found.

    Parameters
    ----------
    x : (6,) start, left at the root. Others as ``place``.
    near, s, k : Deep, calm water, and the scratch of the model.
    y, c, dy : (12,), controls and (12,); state, controls and rate of the root.
    a : (``SCRATCH``,) scratch.
    """
    largest = np.inf
    # The last step counts when it gains.
    for _ in range(_ITERATIONS):
        place(m, w, x, speed, z, mixer, free, level, size, upright, s, y, c)
        _residuals(m, w, x, y, c, near, s, k, dy)
        norm, largest = 0.0, 0.0
        for i in range(N_X):
            a[_RESIDUAL + i] = dy[i]
            norm += dy[i] * dy[i]
            largest = max(largest, abs(dy[i]))
        if not largest > _ROUNDING:
            return largest if largest == largest else np.inf
        for j in range(N_X):
            kept = x[j]
            h = _DIFFERENCE * max(abs(kept), 1e-2)
            x[j] = kept + h
            h = x[j] - kept
            place(m, w, x, speed, z, mixer, free, level, size, upright, s, y, c)
            _residuals(m, w, x, y, c, near, s, k, dy)
            x[j] = kept
            for i in range(N_X):
                a[_SYSTEM + (N_X + 1) * i + j] = (dy[i] - a[_RESIDUAL + i]) / h
        for i in range(N_X):
            a[_SYSTEM + (N_X + 1) * i + N_X] = -a[_RESIDUAL + i]
            a[_X + i] = x[i]
        gained = False
        if _solve(a):
            share = 1.0
            for _ in range(_HALVINGS):
                for i in range(N_X):
                    x[i] = a[_X + i] + share * a[_SYSTEM + (N_X + 1) * i + N_X]
                place(m, w, x, speed, z, mixer, free, level, size, upright, s, y, c)
                _residuals(m, w, x, y, c, near, s, k, dy)
                now = 0.0
                for i in range(N_X):
                    now += dy[i] * dy[i]
                if now < norm:
                    gained = True
                    break
                share *= 0.5
        if not gained:
            for i in range(N_X):
                x[i] = a[_X + i]
            place(m, w, x, speed, z, mixer, free, level, size, upright, s, y, c)
            _residuals(m, w, x, y, c, near, s, k, dy)
            return largest
    return largest
