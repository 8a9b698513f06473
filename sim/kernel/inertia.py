"""Mass matrix and tanks in the compiled right-hand side: loads to accelerations.

The mass matrix is constant, and inverted once, unless tanks are in use or the hull is partly
out of the water.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from sim.boat.state import PHI, THETA
from sim.compiled import inner, merged
from sim.kernel.layout import (
    HAS_TANKS,
    INVERSE_MASS,
    LOADS,
    MASS,
    MASS_MATRIX,
    N_PLANES,
    SYSTEM,
    TANK,
    WEIGHT,
    Around,
)
from sim.waves.surroundings import is_emerged, wet_change

Loads = tuple[float, float, float, float, float, float]


@inner
def add_tank_loads(m: np.ndarray, w: np.ndarray, y: np.ndarray, c: np.ndarray, s: np.ndarray) -> None:
    """Add weight and centripetal loads of what the tanks change, a body on its own.

    Its mass is ``dm`` [kg], at the tank; its first moment is that of ``dm`` and of the boat's
    mass moved forward by ``shift`` [m]; its inertia is that of ``dm``.
    """
    dm, shift = c[w[N_PLANES] + 1], c[w[N_PLANES] + 2]
    u, v, w_, p, q, r = y[0], y[1], y[2], y[3], y[4], y[5]
    g = m[WEIGHT] / m[MASS]
    st, ct = sin(y[THETA]), cos(y[THETA])
    gx, gy, gz = -st * g, ct * sin(y[PHI]) * g, ct * cos(y[PHI]) * g
    x, yy, z = m[TANK], m[TANK + 1], m[TANK + 2]
    sx, sy, sz = m[MASS] * shift + dm * x, dm * yy, dm * z
    # g - omega x v, and omega x (omega x S)
    ax, ay, az = gx - (q * w_ - r * v), gy - (r * u - p * w_), gz - (p * v - q * u)
    bx, by, bz = q * sz - r * sy, r * sx - p * sz, p * sy - q * sx
    # omega x (I omega) of the point mass: dm r x (omega (omega . r))
    turn = -dm * (p * x + q * yy + r * z)
    s[LOADS] += dm * ax - (q * bz - r * by)
    s[LOADS + 1] += dm * ay - (r * bx - p * bz)
    s[LOADS + 2] += dm * az - (p * by - q * bx)
    s[LOADS + 3] += sy * az - sz * ay - turn * (q * z - r * yy)
    s[LOADS + 4] += sz * ax - sx * az - turn * (r * x - p * z)
    s[LOADS + 5] += sx * ay - sy * ax - turn * (p * yy - q * x)


@merged
def _fill_tanks(m: np.ndarray, dm: float, shift: float, s: np.ndarray) -> None:
    """Add what the tanks change to the mass matrix in the scratch."""
    x, y, z = m[TANK], m[TANK + 1], m[TANK + 2]
    sx, sy, sz = m[MASS] * shift + dm * x, dm * y, dm * z
    for i in range(3):
        s[SYSTEM + 8 * i] += dm
    pairs = (
        *((0, 4, sz), (0, 5, -sy), (1, 3, -sz), (1, 5, sx), (2, 3, sy), (2, 4, -sx)),
        *((3, 4, -dm * x * y), (3, 5, -dm * x * z), (4, 5, -dm * y * z)),
    )
    for i, j, moment in pairs:
        s[SYSTEM + 7 * i + j] += moment
        s[SYSTEM + 7 * j + i] += moment
    s[SYSTEM + 8 * 3] += dm * (y * y + z * z)
    s[SYSTEM + 8 * 4] += dm * (x * x + z * z)
    s[SYSTEM + 8 * 5] += dm * (x * x + y * y)


@merged
def _solve(s: np.ndarray, dy: np.ndarray) -> None:
    """Accelerations from the mass matrix in the scratch, six loads beside it, into ``dy``.

    Elimination without pivoting, because the matrix is positive definite.
    """
    for k in range(6):
        for i in range(k + 1, 6):
            factor = s[SYSTEM + 7 * i + k] / s[SYSTEM + 8 * k]
            for j in range(k + 1, 7):
                s[SYSTEM + 7 * i + j] -= factor * s[SYSTEM + 7 * k + j]
    for k in range(5, -1, -1):
        left = s[SYSTEM + 7 * k + 6]
        for j in range(k + 1, 6):
            left -= s[SYSTEM + 7 * k + j] * dy[j]
        dy[k] = left / s[SYSTEM + 8 * k]


@merged
def accelerate(
    m: np.ndarray, w: np.ndarray, c: np.ndarray, loads: Loads, near: Around, s: np.ndarray, dy: np.ndarray
) -> None:
    """Accelerations of six loads, into ``dy``; by elimination only where the matrix changes."""
    f0, f1, f2, f3, f4, f5 = loads
    if not (w[HAS_TANKS] or is_emerged(near)):
        for i in range(6):
            k = INVERSE_MASS + 6 * i
            dy[i] = m[k] * f0 + m[k + 1] * f1 + m[k + 2] * f2 + m[k + 3] * f3 + m[k + 4] * f4 + m[k + 5] * f5
        return
    dy[0], dy[1], dy[2], dy[3], dy[4], dy[5] = f0, f1, f2, f3, f4, f5
    for i in range(6):
        for j in range(6):
            s[SYSTEM + 7 * i + j] = m[MASS_MATRIX + 6 * i + j]
        s[SYSTEM + 7 * i + 6] = dy[i]
    if w[HAS_TANKS]:
        _fill_tanks(m, c[w[N_PLANES] + 1], c[w[N_PLANES] + 2], s)
    if is_emerged(near):
        for i in range(6):
            for j in range(6):
                s[SYSTEM + 7 * i + j] += wet_change(near, i, j)
    _solve(s, dy)
