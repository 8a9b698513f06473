"""Mass matrix and tanks in the compiled right-hand side: loads to accelerations.

The mass matrix is constant, and inverted once, unless tanks are in use or the hull is partly
out of the water. A branch at run time, even one never taken, costs a fifth of the right-hand
side, so the compiler chooses by the types of ``tank`` and ``around``.
"""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numba.extending import overload

from sim.waves.surroundings import Around

if TYPE_CHECKING:
    from sim.kernel.rhs import Model, Work


def tank_loads(m: Model, y: np.ndarray, c: np.ndarray, tank: tuple[float, ...], out: np.ndarray) -> None:
    """Add weight and centripetal loads of what the tanks change, a body on its own.

    Its mass is ``dm`` [kg], at the tank; its first moment is that of ``dm`` and of the boat's
    mass moved forward by ``shift`` [m]; its inertia is that of ``dm``.
    """
    dm, shift = c[m.planes.shape[0] + 1], c[m.planes.shape[0] + 2]
    u, v, w, p, q, r = y[0], y[1], y[2], y[3], y[4], y[5]
    g = m.weight / m.mass
    st, ct = sin(y[10]), cos(y[10])
    gx, gy, gz = -st * g, ct * sin(y[9]) * g, ct * cos(y[9]) * g
    x, yy, z = tank
    sx, sy, sz = m.mass * shift + dm * x, dm * yy, dm * z
    # g - omega x v, and omega x (omega x S)
    ax, ay, az = gx - (q * w - r * v), gy - (r * u - p * w), gz - (p * v - q * u)
    bx, by, bz = q * sz - r * sy, r * sx - p * sz, p * sy - q * sx
    # omega x (I omega) of the point mass: dm r x (omega (omega . r))
    turn = -dm * (p * x + q * yy + r * z)
    out[0] += dm * ax - (q * bz - r * by)
    out[1] += dm * ay - (r * bx - p * bz)
    out[2] += dm * az - (p * by - q * bx)
    out[3] += sy * az - sz * ay - turn * (q * z - r * yy)
    out[4] += sz * ax - sx * az - turn * (r * x - p * z)
    out[5] += sx * ay - sy * ax - turn * (p * yy - q * x)


def _fill_tanks(m: Model, c: np.ndarray, tank: tuple[float, ...], a: np.ndarray) -> None:
    """Add what the tanks change to the mass matrix."""
    dm, shift = c[m.planes.shape[0] + 1], c[m.planes.shape[0] + 2]
    x, y, z = tank
    sx, sy, sz = m.mass * shift + dm * x, dm * y, dm * z
    for i in range(3):
        a[i, i] += dm
    for i, j, moment in ((0, 4, sz), (0, 5, -sy), (1, 3, -sz), (1, 5, sx), (2, 3, sy), (2, 4, -sx)):
        a[i, j] += moment
        a[j, i] += moment
    for i, j, product in ((3, 4, -x * y), (3, 5, -x * z), (4, 5, -y * z)):
        a[i, j] += dm * product
        a[j, i] += dm * product
    a[3, 3] += dm * (y * y + z * z)
    a[4, 4] += dm * (x * x + z * z)
    a[5, 5] += dm * (x * x + y * y)


@njit(cache=True, error_model="numpy")
def _solve(a: np.ndarray, dy: np.ndarray) -> None:
    """Accelerations from a mass matrix with six loads in column 6, into ``dy``.

    Elimination without pivoting, because the matrix is positive definite.
    """
    for k in range(6):
        for i in range(k + 1, 6):
            factor = a[i, k] / a[k, k]
            for j in range(k + 1, 7):
                a[i, j] -= factor * a[k, j]
    for k in range(5, -1, -1):
        left = a[k, 6]
        for j in range(k + 1, 6):
            left -= a[k, j] * dy[j]
        dy[k] = left / a[k, k]


def _no_tank_loads(m: Model, y: np.ndarray, c: np.ndarray, tank: tuple[float, ...], out: np.ndarray) -> None:
    pass


def _no_tanks(m: Model, c: np.ndarray, tank: tuple[float, ...], a: np.ndarray) -> None:
    pass


@njit(cache=True, error_model="numpy", inline="always")
def _multiply(m: Model, dy: np.ndarray) -> None:
    """Accelerations by the inverse mass matrix of the model."""
    f0, f1, f2, f3, f4, f5 = dy[0], dy[1], dy[2], dy[3], dy[4], dy[5]
    inverse = m.inverse_mass
    for i in range(6):
        dy[i] = (
            inverse[i, 0] * f0
            + inverse[i, 1] * f1
            + inverse[i, 2] * f2
            + inverse[i, 3] * f3
            + inverse[i, 4] * f4
            + inverse[i, 5] * f5
        )


@overload(tank_loads, inline="always")
def _choose_loads(m: Model, y: np.ndarray, c: np.ndarray, tank: tuple[float, ...], out: np.ndarray) -> object:
    return tank_loads if len(tank) else _no_tank_loads


@overload(_fill_tanks, inline="always")
def _choose_tanks(m: Model, c: np.ndarray, tank: tuple[float, ...], a: np.ndarray) -> object:
    return _fill_tanks if len(tank) else _no_tanks


def _dry_part(around: Around, a: np.ndarray) -> None:
    """Take the added mass of what is out of the water from the mass matrix."""


def _no_dry_part(around: Around, a: np.ndarray) -> None:
    pass


def _some_dry_part(around: Around, a: np.ndarray) -> None:
    if around.emerged[0] > 0.0:
        for i in range(6):
            for j in range(6):
                a[i, j] += around.wet[i, j] - around.added[i, j]


@overload(_dry_part, inline="always")
def _choose_dry_part(around: Around, a: np.ndarray) -> object:
    return _some_dry_part if len(around) else _no_dry_part


@njit(cache=True, error_model="numpy", inline="always")
def _eliminate(m: Model, c: np.ndarray, work: Work, dy: np.ndarray) -> None:
    """Accelerations with the mass matrix as tanks and emergence make it now."""
    a = work.system
    for i in range(6):
        for j in range(6):
            a[i, j] = m.mass_matrix[i, j]
        a[i, 6] = dy[i]
    _fill_tanks(m, c, m.tank, a)
    _dry_part(work.around, a)
    _solve(a, dy)


def accelerate(m: Model, c: np.ndarray, tank: tuple[float, ...], around: Around, work: Work, dy: np.ndarray) -> None:
    """Turn six loads in ``dy`` into accelerations; by elimination only where the matrix changes."""
    _eliminate(m, c, work, dy)


def _accelerate_calm(
    m: Model, c: np.ndarray, tank: tuple[float, ...], around: Around, work: Work, dy: np.ndarray
) -> None:
    _multiply(m, dy)


def _accelerate_surfacing(
    m: Model, c: np.ndarray, tank: tuple[float, ...], around: Around, work: Work, dy: np.ndarray
) -> None:
    if around.emerged[0] > 0.0:
        _eliminate(m, c, work, dy)
    else:
        _multiply(m, dy)


@overload(accelerate, inline="always")
def _choose_accelerate(
    m: Model, c: np.ndarray, tank: tuple[float, ...], around: Around, work: Work, dy: np.ndarray
) -> object:
    if len(tank):
        return accelerate
    return _accelerate_surfacing if len(around) else _accelerate_calm
