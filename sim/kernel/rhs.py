"""Compiled right-hand side: loads from flat tables, rigid body, kinematics.

Everything here runs without Python objects. ``Model`` is a named tuple of arrays and
scalars built by ``sim.kernel.assemble``; angles are radians, the rest SI, frame SNAME.

State ``y`` (12,): u v w p q r [m/s, rad/s], x y z [m, earth, z down], phi theta psi [rad].
Controls ``c``: one deflection a plane [rad], then n [1/s]; a boat that uses its tanks has two
more, ballast [kg] and the shift of the centre of gravity by the trim tank [m, forward].
Waves and a surface in reach are ``sim.waves.surroundings``, in the scratch arrays of a thread.
"""

from __future__ import annotations

from math import asin, atan2, cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import overload

from sim.boat.catalogue import BOAT_FEATURES, PLANE_FEATURES
from sim.kernel.inertia import accelerate, tank_loads
from sim.waves.loads import PROBES
from sim.waves.surroundings import Around, add_loads, observe, tick

HOLD, LINEAR, LINEAR_LOAD = 0, 1, 2
N_BOAT, N_PLANE = len(BOAT_FEATURES), len(PLANE_FEATURES)
OUT_DEDUCTION, OUT_THRUST, N_OUT = 6, 7, 8
# Coefficients a group holds, one a load component: a fixed width unrolls the inner loop.
WIDTH = 6
MAX_CORNERS = 32
MAX_AXES = 128


class Model(NamedTuple):
    """A vehicle with its coefficients as a few flat arrays, cheap to hand to a function.

    inverse_mass : (6, 6) inverse of rigid-body plus added mass.
    mass, weight, buoyancy [kg, N, N]; r_g, r_b [m]; inertia : Ixx Iyy Izz Ixy Ixz Iyz.
    sail_top : D0 = z + sail_top [m]; diameter [m]; wake : w_T.
    planes : (planes, 6) position [m] and lift axis of each plane.
    groups : (g, 5) tables that share axes: first link, links, first coefficient,
        coefficients, first row in ``data``; data : (rows, WIDTH) grid nodes, coefficients.
    links : (l, 2) axis and stride; axes : (a, 4) feature, rule, first node, nodes.
    terms : (k, 5) output and four factors of each coefficient; scale : (k,) its load scale.
    mass_matrix : (6, 6) rigid-body plus added mass; added_mass : (6, 6) of it. tank : where ballast is taken [m], or
        empty: a boat without tanks in use is compiled without them, a fifth faster.
    """

    inverse_mass: np.ndarray
    mass: float
    weight: float
    buoyancy: float
    r_g: tuple[float, float, float]
    r_b: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]
    sail_top: float
    diameter: float
    wake: float
    planes: np.ndarray
    groups: np.ndarray
    links: np.ndarray
    axes: np.ndarray
    nodes: np.ndarray
    data: np.ndarray
    terms: np.ndarray
    scale: np.ndarray
    mass_matrix: np.ndarray
    added_mass: np.ndarray
    tank: tuple[()] | tuple[float, float, float]


class Work(NamedTuple):
    """Scratch arrays of one thread; ``around`` is empty in deep, calm water."""

    features: np.ndarray
    values: np.ndarray
    loads: np.ndarray
    place: np.ndarray
    weight: np.ndarray
    lower: np.ndarray
    fraction: np.ndarray
    system: np.ndarray
    around: Around


def workspace(n_planes: int, around: Around = ()) -> Work:
    """Scratch arrays for a vehicle with ``n_planes`` planes, and what surrounds it."""
    return Work(
        np.ones(N_BOAT + N_PLANE * n_planes + 1),
        np.zeros(WIDTH),
        np.zeros(N_OUT),
        np.zeros(MAX_CORNERS, dtype=np.int64),
        np.zeros(MAX_CORNERS),
        np.zeros(MAX_AXES, dtype=np.int64),
        np.zeros(MAX_AXES),
        np.zeros((6, 7)),
        around,
    )


@njit(cache=True, error_model="numpy", inline="always")
def _sign(x: float) -> float:
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@njit(cache=True, error_model="numpy", inline="always")
def _fill_plane(m: Model, i: int, a: float, b: float, d: float, c: np.ndarray, f: np.ndarray) -> None:
    """Speed, effective angle and deflection of a plane from its velocity through the water."""
    size = sqrt(a * a + b * b + d * d)
    incidence = 0.0
    if size > 0.0:
        sine = -(a * m.planes[i, 3] + b * m.planes[i, 4] + d * m.planes[i, 5]) / size
        incidence = asin(min(1.0, max(-1.0, sine)))
    k = N_BOAT + N_PLANE * i
    f[k], f[k + 1], f[k + 2] = size, c[i] + incidence, c[i]


@njit(cache=True, error_model="numpy", inline="always")
def fill_features(m: Model, y: np.ndarray, c: np.ndarray, f: np.ndarray) -> None:
    """State features in the order of the catalogue, then three per plane, then 1."""
    u, v, w, p, q, r = y[0], y[1], y[2], y[3], y[4], y[5]
    n_planes = m.planes.shape[0]
    for i in range(6):
        f[i] = y[i]
        f[6 + i] = abs(y[i])
    cross2 = v * v + w * w
    speed = sqrt(u * u + cross2)
    f[12], f[13] = speed, sqrt(cross2)
    f[14], f[15] = _sign(v), _sign(w)
    f[16] = atan2(w, u) if speed > 0.0 else 0.0
    f[17] = asin(min(1.0, max(-1.0, v / speed))) if speed > 0.0 else 0.0
    f[18] = y[8] + m.sail_top
    n = c[n_planes]
    f[19], f[20] = n, abs(n)
    f[21] = (1.0 - m.wake) * u / (n * m.diameter) if n != 0.0 else 0.0
    f[22], f[23], f[24] = u * p, u * q, u * r
    f[25], f[26], f[27] = v * p, v * q, v * r
    f[28], f[29], f[30] = w * p, w * q, w * r
    f[31], f[32], f[33] = p * q, q * r, r * p
    f[34], f[35] = (v / speed, r / speed) if speed > 0.0 else (0.0, 0.0)
    for i in range(n_planes):
        x, yy, z = m.planes[i, 0], m.planes[i, 1], m.planes[i, 2]
        _fill_plane(m, i, u + q * z - r * yy, v + r * x - p * z, w + p * yy - q * x, c, f)


def _sense(m: Model, y: np.ndarray, c: np.ndarray, around: Around, f: np.ndarray) -> None:
    """Features of the motion relative to the water, which planes and propeller meet where they are."""
    a = around
    fill_features(m, a.felt, c, f)
    if not a.waves:
        return
    u, v, w, p, q, r = y[0], y[1], y[2], y[3], y[4], y[5]
    n_planes, k = m.planes.shape[0], PROBES
    for i in range(n_planes):
        x, yy, z = m.planes[i, 0], m.planes[i, 1], m.planes[i, 2]
        along = u + q * z - r * yy - a.found[k]
        _fill_plane(m, i, along, v + r * x - p * z - a.found[k + 1], w + p * yy - q * x - a.found[k + 2], c, f)
        k += 3
    n = c[n_planes]
    f[21] = (1.0 - m.wake) * (u - a.found[k]) / (n * m.diameter) if n != 0.0 else 0.0


def _sense_calm(m: Model, y: np.ndarray, c: np.ndarray, around: Around, f: np.ndarray) -> None:
    fill_features(m, y, c, f)


@overload(_sense)
def _choose_sense(m: Model, y: np.ndarray, c: np.ndarray, around: Around, f: np.ndarray) -> object:
    return _sense if len(around) else _sense_calm


@njit(cache=True, error_model="numpy", inline="always")
def _locate(nodes: np.ndarray, start: int, count: int, rule: int, x: float, i: int) -> tuple[int, float]:
    """Lower node and fraction along one axis, by its extrapolation rule.

    The search starts at node ``i`` of the last call; the result does not depend on it.
    """
    if i > count - 2:
        i = count - 2
    while i > 0 and x < nodes[start + i]:
        i -= 1
    while i < count - 2 and x >= nodes[start + i + 1]:
        i += 1
    a, b = nodes[start + i], nodes[start + i + 1]
    if (a <= x <= b) or rule == LINEAR:
        return i, (x - a) / (b - a)
    if rule == LINEAR_LOAD and a * b > 0.0 and x * a > 0.0 and abs(x) > max(abs(a), abs(b)):
        return i, (1.0 / x - 1.0 / a) / (1.0 / b - 1.0 / a)
    if x != x:
        # Not a number must not look like a held value.
        return i, x
    return i, 0.0 if x < a else 1.0


@njit(cache=True, error_model="numpy", inline="always")
def loads(m: Model, work: Work) -> None:
    """Hydrodynamic loads X Y Z K M N from the features in ``work``; into ``work.loads``."""
    f, values, out = work.features, work.values, work.loads
    place, weight = work.place, work.weight
    for j in range(N_OUT):
        out[j] = 0.0
    for a in range(m.axes.shape[0]):
        x = f[m.axes[a, 0]]
        work.lower[a], work.fraction[a] = _locate(m.nodes, m.axes[a, 2], m.axes[a, 3], m.axes[a, 1], x, work.lower[a])
    for g in range(m.groups.shape[0]):
        first, count = m.groups[g, 2], m.groups[g, 3]
        place[0], weight[0], corners = m.groups[g, 4], 1.0, 1
        for link in range(m.groups[g, 0], m.groups[g, 0] + m.groups[g, 1]):
            axis, step = m.links[link, 0], m.links[link, 1]
            t, shift = work.fraction[axis], work.lower[axis] * step
            if t == 0.0 or t == 1.0:
                # On a node or held: no second corner along this axis.
                shift += step if t == 1.0 else 0
                for k in range(corners):
                    place[k] += shift
                continue
            for k in range(corners):
                place[k] += shift
                place[corners + k] = place[k] + step
                weight[corners + k] = weight[k] * t
                weight[k] *= 1.0 - t
            corners *= 2
        for j in range(WIDTH):
            values[j] = 0.0
        for k in range(corners):
            share, row = weight[k], m.data[place[k]]
            for j in range(WIDTH):
                values[j] += share * row[j]
        for j in range(count):
            k = first + j
            product = m.scale[k] * values[j] * f[m.terms[k, 1]] * f[m.terms[k, 2]]
            out[m.terms[k, 0]] += product * f[m.terms[k, 3]] * f[m.terms[k, 4]]
    out[0] += (1.0 - out[OUT_DEDUCTION]) * out[OUT_THRUST]


@njit(cache=True, error_model="numpy")
def rhs(m: Model, y: np.ndarray, c: np.ndarray, work: Work, dy: np.ndarray) -> None:
    """Time derivative of the state, Eqs. (12)-(16) as corrected, added mass on the left.

    Parameters
    ----------
    m : Model.
    y : (12,) state.
    c : (planes + 1,) deflections [rad] and n [1/s]; with a tank in the model (planes + 3,),
        with ballast [kg] and shift of the centre of gravity [m].
    work : Scratch arrays.
    dy : (12,) result.
    """
    observe(work.around, y)
    _sense(m, y, c, work.around, work.features)
    loads(m, work)
    tank_loads(m, y, c, m.tank, work.loads)
    add_loads(work.around, y, work.loads)
    u, v, w, p, q, r = y[0], y[1], y[2], y[3], y[4], y[5]
    phi, theta, psi = y[9], y[10], y[11]
    sf, cf, st, ct, sp, cp = sin(phi), cos(phi), sin(theta), cos(theta), sin(psi), cos(psi)
    gx, gy, gz = -st, ct * sf, ct * cf
    xg, yg, zg = m.r_g
    xb, yb, zb = m.r_b
    net = m.weight - m.buoyancy
    mx, my, mz = xg * m.weight - xb * m.buoyancy, yg * m.weight - yb * m.buoyancy, zg * m.weight - zb * m.buoyancy
    # omega x v, omega x (omega x r_G), omega x (I omega)
    cx, cy, cz = q * w - r * v, r * u - p * w, p * v - q * u
    ax, ay, az = q * zg - r * yg, r * xg - p * zg, p * yg - q * xg
    ex, ey, ez = q * az - r * ay, r * ax - p * az, p * ay - q * ax
    ixx, iyy, izz, ixy, ixz, iyz = m.inertia
    hx, hy, hz = ixx * p + ixy * q + ixz * r, ixy * p + iyy * q + iyz * r, ixz * p + iyz * q + izz * r
    f0 = work.loads[0] + net * gx - m.mass * (cx + ex)
    f1 = work.loads[1] + net * gy - m.mass * (cy + ey)
    f2 = work.loads[2] + net * gz - m.mass * (cz + ez)
    f3 = work.loads[3] + my * gz - mz * gy - (q * hz - r * hy) - m.mass * (yg * cz - zg * cy)
    f4 = work.loads[4] + mz * gx - mx * gz - (r * hx - p * hz) - m.mass * (zg * cx - xg * cz)
    f5 = work.loads[5] + mx * gy - my * gx - (p * hy - q * hx) - m.mass * (xg * cy - yg * cx)
    dy[0], dy[1], dy[2], dy[3], dy[4], dy[5] = f0, f1, f2, f3, f4, f5
    accelerate(m, c, m.tank, work.around, work, dy)
    dy[6] = ct * cp * u + (sf * st * cp - cf * sp) * v + (cf * st * cp + sf * sp) * w
    dy[7] = ct * sp * u + (sf * st * sp + cf * cp) * v + (cf * st * sp - sf * cp) * w
    dy[8] = -st * u + sf * ct * v + cf * ct * w
    dy[9] = p + (sf * q + cf * r) * st / ct
    dy[10] = cf * q - sf * r
    dy[11] = (sf * q + cf * r) / ct


@njit(cache=True, error_model="numpy")
def rk4(
    m: Model,
    y: np.ndarray,
    c: np.ndarray,
    rate: np.ndarray,
    h: float,
    work: Work,
    stages: np.ndarray,
    out: np.ndarray,
) -> None:
    """One classical Runge-Kutta step with controls that move at constant rate.

    With surroundings, ``sim.waves.surroundings.prepare`` comes before the step.

    Parameters
    ----------
    y, out : (12,) states before and after (may be the same array).
    c, rate : Controls at the start and their rates.
    h : Step [s].
    stages : (6, 12) scratch; row 5 also carries the controls, so at most 12 of them.
    """
    z, moved = stages[4], stages[5]
    # One call in a loop: four would be inlined four times, which takes minutes to compile in waves.
    for stage in range(4):
        ahead = h if stage == 3 else (0.5 * h if stage else 0.0)
        for i in range(c.size):
            moved[i] = c[i] + ahead * rate[i]
        for i in range(12):
            z[i] = y[i] + ahead * stages[stage - 1, i] if stage else y[i]
        tick(work.around, ahead)
        rhs(m, z, moved, work, stages[stage])
    k1, k2, k3, k4 = stages[0], stages[1], stages[2], stages[3]
    for i in range(12):
        out[i] = y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
