"""Compiled right-hand side: features, loads from flat tables, rigid body, kinematics.

Everything here runs without Python objects, on the arrays of ``sim.kernel.layout``. ``rhs`` and
``rk4`` take a ``Model`` and a ``Work``; ``fill_rate`` and ``step`` are what compiled loops call.
Waves and a surface in reach are ``sim.waves.surroundings``; the compiler chooses by the type of
``near``, so that a boat in deep, calm water is compiled without them. ``_rate``, ``_features`` and
``_loads`` are inlined where they are used; ``fill_rate``, ``fill_features`` and ``fill_loads`` are the
same as entries that other compiled functions and Python may call.
"""

from __future__ import annotations

from math import asin, atan2, cos, sin, sqrt

import numpy as np

from sim.boat.catalogue import BOAT_FEATURES, STILL
from sim.boat.state import N_STATES, PHI, PSI, THETA, X, Y, Z
from sim.compiled import inlined, merged, outer
from sim.kernel.inertia import accelerate, add_tank_loads
from sim.kernel.layout import (
    BUOYANCY,
    CURRENT,
    DIAMETER,
    FEATURES,
    FIRST_PLANE,
    HAS_PROPELLER,
    HAS_TANKS,
    INERTIA,
    LOADS,
    MASS,
    N_LAYERS,
    N_PLANE,
    N_PLANES,
    OUTSIDE,
    PLANE_WIDTH,
    PLANES,
    R_B,
    R_G,
    SAIL_TOP,
    SHIFT,
    WAKE,
    WEIGHT,
    Around,
    Model,
    Stage,
    Work,
)
from sim.kernel.ship import LOADING, add_ship_loads, fill_slipstream
from sim.kernel.tables import add_up_loads
from sim.kernel.water import scale_by_depth
from sim.waves.surroundings import add_loads, near_of, observe, plane_inflow, propeller_inflow, relative, tick

# Places of the features of the catalogue in the scratch.
_AT = {name: FEATURES + i for i, name in enumerate(BOAT_FEATURES)}
_SIZES, _SPEED, _CROSS = _AT["|u|"], _AT["U"], _AT["S"]
_SIGN_V, _SIGN_W, _ALPHA, _BETA, _DEPTH = _AT["sgn(v)"], _AT["sgn(w)"], _AT["alpha"], _AT["beta"], _AT["D0"]
_N, _SIZE_N, _ADVANCE = _AT["n"], _AT["|n|"], _AT["J"]
_U_BY, _V_BY, _W_BY, _RATES = _AT["up"], _AT["vp"], _AT["wp"], _AT["pq"]
_DRIFT, _TURN = _AT["v/U"], _AT["r/U"]
_YAW_PIVOT, _PITCH_PIVOT = _AT["v/r"], _AT["w/q"]

# Runge-Kutta schemes of a step.
FROM_STATE, BEGUN, MIDPOINT = 0, 1, 2


@inlined
def _sign(x: float) -> float:
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@inlined
def _arcsine(x: float) -> float:
    return asin(min(1.0, max(-1.0, x)))


@merged
def _fill_boat(m: np.ndarray, y: np.ndarray, at: int, ahead: float, n: float, s: np.ndarray) -> None:
    """Features of the boat as a whole, in the order of the catalogue, into the scratch.

    Parameters
    ----------
    y : State from ``at`` on, velocities through the water. ahead : u at the propeller [m/s]. n : [1/s].
    """
    u, v, w_, p, q, r = y[at], y[at + 1], y[at + 2], y[at + 3], y[at + 4], y[at + 5]
    for i in range(6):
        s[FEATURES + i] = y[at + i]
        s[_SIZES + i] = abs(y[at + i])
    cross2 = v * v + w_ * w_
    speed = sqrt(u * u + cross2)
    s[_SPEED], s[_CROSS] = speed, sqrt(cross2)
    s[_SIGN_V], s[_SIGN_W] = _sign(v), _sign(w_)
    s[_ALPHA] = atan2(w_, u) if speed > 0.0 else 0.0
    s[_BETA] = _arcsine(v / speed) if speed > 0.0 else 0.0
    s[_DEPTH] = y[at + Z] + m[SAIL_TOP]
    s[_N], s[_SIZE_N] = n, abs(n)
    s[_ADVANCE] = (1.0 - m[WAKE]) * ahead / (n * m[DIAMETER]) if n != 0.0 else 0.0
    s[_U_BY], s[_U_BY + 1], s[_U_BY + 2] = u * p, u * q, u * r
    s[_V_BY], s[_V_BY + 1], s[_V_BY + 2] = v * p, v * q, v * r
    s[_W_BY], s[_W_BY + 1], s[_W_BY + 2] = w_ * p, w_ * q, w_ * r
    s[_RATES], s[_RATES + 1], s[_RATES + 2] = p * q, q * r, r * p
    s[_DRIFT], s[_TURN] = (v / speed, r / speed) if speed > 0.0 else (0.0, 0.0)
    s[_YAW_PIVOT] = v / r if abs(r) > STILL else 0.0
    s[_PITCH_PIVOT] = w_ / q if abs(q) > STILL else 0.0


@merged
def _fill_planes(m: np.ndarray, w: np.ndarray, y: np.ndarray, c: np.ndarray, near: Around, s: np.ndarray) -> None:
    """Speed, effective angle and deflection of every plane from its velocity through the water."""
    u, v, w_, p, q, r = y[0], y[1], y[2], y[3], y[4], y[5]
    at, k = PLANES, FIRST_PLANE
    for i in range(w[N_PLANES]):
        x, yy, z = m[at], m[at + 1], m[at + 2]
        flow = plane_inflow(near, i)
        a, b, d = u + q * z - r * yy - flow[0], v + r * x - p * z - flow[1], w_ + p * yy - q * x - flow[2]
        size = sqrt(a * a + b * b + d * d)
        incidence = 0.0
        if size > 0.0:
            incidence = _arcsine(-(a * m[at + 3] + b * m[at + 4] + d * m[at + 5]) / size)
        s[k], s[k + 1], s[k + 2] = size, c[i] + incidence, c[i]
        at += PLANE_WIDTH
        k += N_PLANE


@inlined
def _features(m: np.ndarray, w: np.ndarray, y: np.ndarray, c: np.ndarray, near: Around, s: np.ndarray) -> None:
    through, at = relative(near, y)
    planes = w[N_PLANES]
    _fill_boat(m, through, at, y[0] - propeller_inflow(near, planes), c[planes], s)
    if m[LOADING] > 0.0:
        fill_slipstream(m, s)
    _fill_planes(m, w, y, c, near, s)


@inlined
def _loads(m: np.ndarray, w: np.ndarray, s: np.ndarray, k: np.ndarray) -> None:
    add_up_loads(m, w, s, k)
    if w[HAS_PROPELLER]:
        add_ship_loads(m, w, s)


@inlined
def _rate(
    m: np.ndarray,
    w: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    near: Around,
    s: np.ndarray,
    k: np.ndarray,
    dy: np.ndarray,
) -> None:
    """Time derivative of the state, Eqs. (12)-(16) as corrected, added mass on the left."""
    observe(near, y)
    _features(m, w, y, c, near, s)
    _loads(m, w, s, k)
    buoyancy = m[BUOYANCY]
    if w[N_LAYERS]:
        buoyancy *= scale_by_depth(m, w, y[Z], s)
    for i in range(6):
        s[LOADS + i] += s[OUTSIDE + i]
    if w[HAS_TANKS]:
        add_tank_loads(m, w, y, c, s)
    u, v, w_, p, q, r = y[0], y[1], y[2], y[3], y[4], y[5]
    phi, theta, psi = y[PHI], y[THETA], y[PSI]
    sf, cf, st, ct, sp, cp = sin(phi), cos(phi), sin(theta), cos(theta), sin(psi), cos(psi)
    gx, gy, gz = -st, ct * sf, ct * cf
    add_loads(near, y, (gx, gy, gz), s)
    mass, weight = m[MASS], m[WEIGHT]
    xg, yg, zg = m[R_G], m[R_G + 1] + s[SHIFT], m[R_G + 2]
    xb, yb, zb = m[R_B], m[R_B + 1], m[R_B + 2]
    net = weight - buoyancy
    mx, my, mz = xg * weight - xb * buoyancy, yg * weight - yb * buoyancy, zg * weight - zb * buoyancy
    # omega x v, omega x (omega x r_G), omega x (I omega)
    cx, cy, cz = q * w_ - r * v, r * u - p * w_, p * v - q * u
    ax, ay, az = q * zg - r * yg, r * xg - p * zg, p * yg - q * xg
    ex, ey, ez = q * az - r * ay, r * ax - p * az, p * ay - q * ax
    ixx, iyy, izz = m[INERTIA], m[INERTIA + 1], m[INERTIA + 2]
    ixy, ixz, iyz = m[INERTIA + 3], m[INERTIA + 4], m[INERTIA + 5]
    hx, hy, hz = ixx * p + ixy * q + ixz * r, ixy * p + iyy * q + iyz * r, ixz * p + iyz * q + izz * r
    f0 = s[LOADS] + net * gx - mass * (cx + ex)
    f1 = s[LOADS + 1] + net * gy - mass * (cy + ey)
    f2 = s[LOADS + 2] + net * gz - mass * (cz + ez)
    f3 = s[LOADS + 3] + my * gz - mz * gy - (q * hz - r * hy) - mass * (yg * cz - zg * cy)
    f4 = s[LOADS + 4] + mz * gx - mx * gz - (r * hx - p * hz) - mass * (zg * cx - xg * cz)
    f5 = s[LOADS + 5] + mx * gy - my * gx - (p * hy - q * hx) - mass * (xg * cy - yg * cx)
    accelerate(m, w, c, (f0, f1, f2, f3, f4, f5), near, s, dy)
    dy[X] = ct * cp * u + (sf * st * cp - cf * sp) * v + (cf * st * cp + sf * sp) * w_ + m[CURRENT]
    dy[Y] = ct * sp * u + (sf * st * sp + cf * cp) * v + (cf * st * sp - sf * cp) * w_ + m[CURRENT + 1]
    dy[Z] = -st * u + sf * ct * v + cf * ct * w_
    dy[PHI] = p + (sf * q + cf * r) * st / ct
    dy[THETA] = cf * q - sf * r
    dy[PSI] = (sf * q + cf * r) / ct


@outer
def fill_rate(
    m: np.ndarray,
    w: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    near: Around,
    s: np.ndarray,
    k: np.ndarray,
    dy: np.ndarray,
) -> None:
    """Time derivative of a state, into ``dy``.

    Parameters
    ----------
    m, w : Model, floats and whole numbers.
    y, c : State and controls.
    near : What is around, at the time of its clock.
    s, k : Scratch, floats and whole numbers.
    dy : (12,) result.
    """
    _rate(m, w, y, c, near, s, k, dy)


@outer
def fill_features(m: np.ndarray, w: np.ndarray, y: np.ndarray, c: np.ndarray, near: Around, s: np.ndarray) -> None:
    """Features of a state in what is around it, into the scratch; with waves after ``observe``."""
    _features(m, w, y, c, near, s)


@outer
def fill_loads(m: np.ndarray, w: np.ndarray, s: np.ndarray, k: np.ndarray) -> None:
    """Hydrodynamic loads of the features in the scratch, into the scratch."""
    _loads(m, w, s, k)


@outer
def step(
    m: np.ndarray,
    w: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    rate: np.ndarray,
    h: float,
    near: Around,
    s: np.ndarray,
    k: np.ndarray,
    stage: Stage,
    scheme: int,
    out: np.ndarray,
) -> None:
    """One Runge-Kutta step; arguments as ``rk4`` and ``fill_rate``.

    With surroundings, ``sim.waves.surroundings.prepare`` comes before the step.

    Parameters
    ----------
    scheme : ``FROM_STATE``, the classical four stages; ``BEGUN``, the same where ``stage.start`` holds the
        rate of the state already, a quarter of the work; ``MIDPOINT``, two stages, begun as well.
    """
    z, dy, total, moved = stage.state, stage.rate, stage.total, stage.controls
    stages = 2 if scheme == MIDPOINT else 4
    # One call in a loop: four would be inlined four times, which takes long to compile.
    for part in range(stages):
        ahead = h if part == 3 else (0.5 * h if part else 0.0)
        for i in range(c.size):
            moved[i] = c[i] + ahead * rate[i]
        for i in range(N_STATES):
            z[i] = y[i] + ahead * dy[i] if part else y[i]
        tick(near, ahead)
        if part or scheme == FROM_STATE:
            _rate(m, w, z, moved, near, s, k, dy)
        else:
            for i in range(N_STATES):
                dy[i] = stage.start[i]
        twice = 2.0 if part == 1 or part == 2 else 1.0
        for i in range(N_STATES):
            total[i] = total[i] + twice * dy[i] if part else dy[i]
    for i in range(N_STATES):
        out[i] = y[i] + (h * dy[i] if scheme == MIDPOINT else h / 6.0 * total[i])


def features(model: Model, y: np.ndarray, c: np.ndarray, work: Work) -> np.ndarray:
    """Features of a state in calm water, a view of the scratch, the constant 1 last."""
    fill_features(model.real, model.whole, y, c, (), work.real)
    return work.features


def loads(model: Model, work: Work) -> np.ndarray:
    """Hydrodynamic loads X Y Z K M N [N, N m] of the features in the scratch, a view of it."""
    fill_loads(model.real, model.whole, work.real, work.whole)
    return work.loads


def rhs(model: Model, y: np.ndarray, c: np.ndarray, work: Work, dy: np.ndarray) -> None:
    """Time derivative of the state.

    Parameters
    ----------
    model : Of ``sim.kernel.assemble``.
    y : (12,) state.
    c : (planes + 1,) deflections [rad] and n [1/s]; with tanks in use (planes + 3,), with
        ballast [kg] and shift of the centre of gravity [m].
    work : Scratch of the model.
    dy : (12,) result.
    """
    fill_rate(model.real, model.whole, y, c, near_of(work.around), work.real, work.whole, dy)


def rk4(model: Model, y: np.ndarray, c: np.ndarray, rate: np.ndarray, h: float, work: Work, out: np.ndarray) -> None:
    """One classical Runge-Kutta step with controls that move at constant rate.

    Parameters
    ----------
    y, out : (12,) states before and after (may be the same array).
    c, rate : Controls at the start and their rates.
    h : Step [s].
    """
    step(
        model.real, model.whole, y, c, rate, h, near_of(work.around), work.real, work.whole, work.stage, FROM_STATE, out
    )
