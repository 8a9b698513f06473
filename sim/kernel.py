"""Compiled right-hand side: loads from flat tables, rigid body, kinematics.

Everything here runs without Python objects. ``Model`` is a named tuple of arrays and
scalars built by ``sim.model``; angles are radians, the rest SI, frame SNAME.

State ``y`` (12,): u v w p q r [m/s, rad/s], x y z [m, earth, z down], phi theta psi [rad].
Controls ``c``: one deflection a plane [rad], then n [1/s].
"""

from __future__ import annotations

from math import asin, atan2, cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from sim.catalogue import BOAT_FEATURES, PLANE_FEATURES

HOLD, LINEAR, LINEAR_LOAD = 0, 1, 2
N_BOAT, N_PLANE = len(BOAT_FEATURES), len(PLANE_FEATURES)
OUT_DEDUCTION, OUT_THRUST, N_OUT = 6, 7, 8
MAX_COEFFICIENTS = 16


class Model(NamedTuple):
    """A vehicle with its coefficients as flat arrays.

    Groups are tables that share axes: ``g_*`` per group, ``a_*`` per axis of a group,
    ``k_*`` per coefficient; ``data`` holds the grids, coefficients innermost.
    """

    inverse_mass: np.ndarray
    mass: float
    inertia: np.ndarray
    r_g: np.ndarray
    r_b: np.ndarray
    weight: float
    buoyancy: float
    sail_top: float
    diameter: float
    wake: float
    position: np.ndarray
    lift: np.ndarray
    g_axis: np.ndarray
    g_axes: np.ndarray
    g_coefficient: np.ndarray
    g_coefficients: np.ndarray
    g_data: np.ndarray
    a_feature: np.ndarray
    a_rule: np.ndarray
    a_node: np.ndarray
    a_nodes: np.ndarray
    a_stride: np.ndarray
    nodes: np.ndarray
    data: np.ndarray
    k_output: np.ndarray
    k_scale: np.ndarray
    k_factors: np.ndarray


class Work(NamedTuple):
    """Scratch arrays of one thread."""

    features: np.ndarray
    values: np.ndarray
    loads: np.ndarray
    offset: np.ndarray
    stride: np.ndarray
    fraction: np.ndarray
    force: np.ndarray


def workspace(n_planes: int) -> Work:
    """Scratch arrays for a vehicle with ``n_planes`` planes."""
    return Work(
        np.ones(N_BOAT + N_PLANE * n_planes + 1),
        np.zeros(MAX_COEFFICIENTS),
        np.zeros(N_OUT),
        np.zeros(8, dtype=np.int64),
        np.zeros(8, dtype=np.int64),
        np.zeros(8),
        np.zeros(6),
    )


@njit(cache=True, error_model="numpy", inline="always")
def _sign(x):
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@njit(cache=True, error_model="numpy")
def fill_features(m, y, c, f):
    """State features in the order of the catalogue, then three per plane, then 1."""
    u, v, w, p, q, r = y[0], y[1], y[2], y[3], y[4], y[5]
    n_planes = m.position.shape[0]
    for i in range(6):
        f[i] = y[i]
        f[6 + i] = abs(y[i])
    cross2 = v * v + w * w
    speed = sqrt(u * u + cross2)
    f[12], f[13] = speed, sqrt(cross2)
    f[14], f[15] = _sign(v), _sign(w)
    f[16] = atan2(w, u) if speed > 0.0 else 0.0
    f[17] = asin(v / speed) if speed > 0.0 else 0.0
    f[18] = y[8] + m.sail_top
    n = c[n_planes]
    f[19], f[20] = n, abs(n)
    f[21] = (1.0 - m.wake) * u / (n * m.diameter) if n != 0.0 else 0.0
    f[22], f[23], f[24] = u * p, u * q, u * r
    f[25], f[26], f[27] = v * p, v * q, v * r
    f[28], f[29], f[30] = w * p, w * q, w * r
    f[31], f[32], f[33] = p * q, q * r, r * p
    for i in range(n_planes):
        x, yy, z = m.position[i, 0], m.position[i, 1], m.position[i, 2]
        a = u + q * z - r * yy
        b = v + r * x - p * z
        d = w + p * yy - q * x
        size = sqrt(a * a + b * b + d * d)
        incidence = 0.0
        if size > 0.0:
            incidence = asin(-(a * m.lift[i, 0] + b * m.lift[i, 1] + d * m.lift[i, 2]) / size)
        k = N_BOAT + N_PLANE * i
        f[k], f[k + 1], f[k + 2] = size, c[i] + incidence, c[i]


@njit(cache=True, error_model="numpy", inline="always")
def _locate(nodes, start, count, rule, x):
    """Lower node and fraction along one axis, by its extrapolation rule."""
    i = 0
    while i < count - 2 and x >= nodes[start + i + 1]:
        i += 1
    a, b = nodes[start + i], nodes[start + i + 1]
    if (a <= x <= b) or rule == LINEAR:
        return i, (x - a) / (b - a)
    if rule == LINEAR_LOAD and a * b > 0.0 and x * a > 0.0:
        return i, (1.0 / x - 1.0 / a) / (1.0 / b - 1.0 / a)
    return i, 0.0 if x < a else 1.0


@njit(cache=True, error_model="numpy")
def loads(m, work):
    """Hydrodynamic loads X Y Z K M N from the features in ``work``; into ``work.loads``."""
    f, values, out = work.features, work.values, work.loads
    offset, stride, fraction = work.offset, work.stride, work.fraction
    for j in range(N_OUT):
        out[j] = 0.0
    for g in range(m.g_axis.size):
        axes, first = m.g_axes[g], m.g_coefficient[g]
        count, base = m.g_coefficients[g], m.g_data[g]
        used = 0
        for k in range(axes):
            a = m.g_axis[g] + k
            i, t = _locate(m.nodes, m.a_node[a], m.a_nodes[a], m.a_rule[a], f[m.a_feature[a]])
            base += i * m.a_stride[a]
            if t == 1.0:
                base += m.a_stride[a]
            elif t != 0.0:
                stride[used], fraction[used] = m.a_stride[a], t
                used += 1
        for j in range(count):
            values[j] = 0.0
        for corner in range(1 << used):
            weight, place = 1.0, base
            for k in range(used):
                if (corner >> k) & 1:
                    weight *= fraction[k]
                    place += stride[k]
                else:
                    weight *= 1.0 - fraction[k]
            for j in range(count):
                values[j] += weight * m.data[place + j]
        for j in range(count):
            k = first + j
            m0, m1 = f[m.k_factors[k, 0]], f[m.k_factors[k, 1]]
            m2, m3 = f[m.k_factors[k, 2]], f[m.k_factors[k, 3]]
            out[m.k_output[k]] += m.k_scale[k] * values[j] * m0 * m1 * m2 * m3
    out[0] += (1.0 - out[OUT_DEDUCTION]) * out[OUT_THRUST]


@njit(cache=True, error_model="numpy")
def rhs(m, y, c, work, dy):
    """Time derivative of the state, Eqs. (12)-(16) as corrected, added mass on the left.

    Parameters
    ----------
    m : Model.
    y : (12,) state.
    c : (planes + 1,) deflections [rad] and n [1/s].
    work : Scratch arrays.
    dy : (12,) result.
    """
    fill_features(m, y, c, work.features)
    loads(m, work)
    u, v, w, p, q, r = y[0], y[1], y[2], y[3], y[4], y[5]
    phi, theta, psi = y[9], y[10], y[11]
    sf, cf, st, ct, sp, cp = sin(phi), cos(phi), sin(theta), cos(theta), sin(psi), cos(psi)
    gx, gy, gz = -st, ct * sf, ct * cf
    xg, yg, zg = m.r_g[0], m.r_g[1], m.r_g[2]
    xb, yb, zb = m.r_b[0], m.r_b[1], m.r_b[2]
    net = m.weight - m.buoyancy
    mx, my, mz = xg * m.weight - xb * m.buoyancy, yg * m.weight - yb * m.buoyancy, zg * m.weight - zb * m.buoyancy
    # omega x v, omega x (omega x r_G), omega x (I omega)
    cx, cy, cz = q * w - r * v, r * u - p * w, p * v - q * u
    ax, ay, az = q * zg - r * yg, r * xg - p * zg, p * yg - q * xg
    ex, ey, ez = q * az - r * ay, r * ax - p * az, p * ay - q * ax
    hx = m.inertia[0, 0] * p + m.inertia[0, 1] * q + m.inertia[0, 2] * r
    hy = m.inertia[1, 0] * p + m.inertia[1, 1] * q + m.inertia[1, 2] * r
    hz = m.inertia[2, 0] * p + m.inertia[2, 1] * q + m.inertia[2, 2] * r
    force = work.force
    force[0] = work.loads[0] + net * gx - m.mass * (cx + ex)
    force[1] = work.loads[1] + net * gy - m.mass * (cy + ey)
    force[2] = work.loads[2] + net * gz - m.mass * (cz + ez)
    force[3] = work.loads[3] + my * gz - mz * gy - (q * hz - r * hy) - m.mass * (yg * cz - zg * cy)
    force[4] = work.loads[4] + mz * gx - mx * gz - (r * hx - p * hz) - m.mass * (zg * cx - xg * cz)
    force[5] = work.loads[5] + mx * gy - my * gx - (p * hy - q * hx) - m.mass * (xg * cy - yg * cx)
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += m.inverse_mass[i, j] * force[j]
        dy[i] = total
    dy[6] = ct * cp * u + (sf * st * cp - cf * sp) * v + (cf * st * cp + sf * sp) * w
    dy[7] = ct * sp * u + (sf * st * sp + cf * cp) * v + (cf * st * sp - sf * cp) * w
    dy[8] = -st * u + sf * ct * v + cf * ct * w
    dy[9] = p + (sf * q + cf * r) * st / ct
    dy[10] = cf * q - sf * r
    dy[11] = (sf * q + cf * r) / ct


@njit(cache=True, error_model="numpy")
def rk4(m, y, c, rate, h, work, stages, out):
    """One classical Runge-Kutta step with controls that move at constant rate.

    Parameters
    ----------
    y, out : (12,) states before and after (may be the same array).
    c, rate : (planes + 1,) controls at the start and their rates.
    h : Step [s].
    stages : (6, 12) scratch; row 5 also carries the controls, so planes + 1 <= 12.
    """
    k1, k2, k3, k4, z, moved = stages[0], stages[1], stages[2], stages[3], stages[4], stages[5]
    rhs(m, y, c, work, k1)
    for i in range(c.size):
        moved[i] = c[i] + 0.5 * h * rate[i]
    for i in range(12):
        z[i] = y[i] + 0.5 * h * k1[i]
    rhs(m, z, moved, work, k2)
    for i in range(12):
        z[i] = y[i] + 0.5 * h * k2[i]
    rhs(m, z, moved, work, k3)
    for i in range(c.size):
        moved[i] = c[i] + h * rate[i]
    for i in range(12):
        z[i] = y[i] + h * k3[i]
    rhs(m, z, moved, work, k4)
    for i in range(12):
        out[i] = y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
