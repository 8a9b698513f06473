"""Autopilot, mixer and actuators of the compiled loop, at one control sample.

Arguments ``g``, ``q``, ``f``, ``j`` are settings and progress of ``sim.flight.orders``.
"""

from __future__ import annotations

import numpy as np

from sim.boat.state import PSI, THETA, R, U, Y, Z
from sim.compiled import inner, outer
from sim.flight.orders import (
    AT_MODES,
    AT_STEPS,
    COMMAND,
    COMMAND_LIMIT,
    FIRST_STEP,
    FIXED,
    GAINS,
    LAW,
    N_LIMIT,
    N_PLANES,
    N_RATE,
    PID,
    PLANE,
    PLANE_INTEGRALS,
    PLANES,
    PROGRAMME,
    REVOLUTIONS,
    REVOLUTIONS_START,
    SENSE,
    SPEED_GAINS,
    SPEED_INTEGRAL,
    SPEED_LAW,
    SPEED_TARGET,
    STEP,
    TANK_GAINS,
    TANK_INTEGRALS,
    TANK_LAW,
    TANK_LIMIT,
    TANK_RATE,
    TANK_START,
    TARGET,
    TRIM,
    VALUE,
    VERTICAL,
    YAW_RATE,
    YAW_RATE_GAINS,
    YAW_RATE_INTEGRALS,
    ZIGZAG,
)


@inner
def clip(x: float, low: float, high: float) -> float:
    """``x`` between two limits."""
    return low if x < low else (high if x > high else x)


@inner
def _pid(
    g: np.ndarray,
    gains: int,
    trim: float,
    limit: float,
    errors: tuple[float, float],
    rates: tuple[float, float],
    f: np.ndarray,
    integral: int,
    dt: float,
) -> float:
    """One loop pair; integrators stop while the command is limited (anti-windup)."""
    command = trim
    for k in range(2):
        at = gains + 3 * k
        trial = f[integral + k] + errors[k] * dt
        command += g[at] * errors[k] + g[at + 1] * trial + g[at + 2] * rates[k]
    limited = clip(command, -limit, limit)
    for k in range(2):
        pushes = g[gains + 3 * k + 1] * errors[k] * (command - limited) > 0.0
        if not pushes:
            f[integral + k] += errors[k] * dt
    return limited


@outer
def command_boat(
    g: np.ndarray, q: np.ndarray, f: np.ndarray, j: np.ndarray, y: np.ndarray, dy: np.ndarray, dt: float
) -> None:
    """Commands dV, dH [rad], n [1/s], ballast [kg] and trim [m] of this sample, Eqs. (9)-(11), into ``f``.

    dV = P_z (z - z_t) + P_theta (theta_t - theta) + ..., dH = P_y (y_t - y) +
    P_psi (psi_t - psi) + ...: positive gains steer back in the program frame. Too deep,
    ballast is pumped out; bow up, the trim tank moves forward.
    """
    for axis in range(2):
        law, value, far, turn = q[LAW + axis], g[VALUE + axis], 0.0, 0.0
        if law == PROGRAMME:
            k = q[FIRST_STEP + axis] + j[axis]
            at = q[AT_STEPS] + STEP * k
            law, value, far, turn = q[q[AT_MODES] + k], g[at], g[at + 1], g[at + 2]
        limit, trim = g[COMMAND_LIMIT + axis], g[TRIM + axis]
        if law == FIXED:
            f[COMMAND + axis] = value
        elif law == ZIGZAG:
            f[COMMAND + axis] = f[SENSE] * value
        else:
            gains, integral = GAINS + 6 * axis, PLANE_INTEGRALS + 2 * axis
            if law == YAW_RATE:
                gains, integral = YAW_RATE_GAINS, YAW_RATE_INTEGRALS
                errors, rates = (turn - y[R], 0.0), (-dy[R], 0.0)
            elif axis == VERTICAL:
                errors = (y[Z] - (g[TARGET] + far), (g[TARGET + 1] + turn) - y[THETA])
                rates = (dy[Z], -dy[THETA])
            else:
                errors = ((g[TARGET + 2] + far) - y[Y], (g[TARGET + 3] + turn) - y[PSI])
                rates = (-dy[Y], -dy[PSI])
            f[COMMAND + axis] = _pid(g, gains, trim, limit, errors, rates, f, integral, dt)
    _command_revolutions(g, q, f, j, y, dy, dt)
    for tank in range(2):
        start = g[TANK_START + tank]
        f[COMMAND + 3 + tank] = start
        if q[TANK_LAW + tank] == PID:
            errors, rates = (g[TARGET] - y[Z], y[THETA] - g[TARGET + 1]), (-dy[Z], dy[THETA])
            integral = TANK_INTEGRALS + 2 * tank
            f[COMMAND + 3 + tank] = _pid(
                g, TANK_GAINS + 6 * tank, start, g[TANK_LIMIT + tank], errors, rates, f, integral, dt
            )


@inner
def _command_revolutions(
    g: np.ndarray, q: np.ndarray, f: np.ndarray, j: np.ndarray, y: np.ndarray, dy: np.ndarray, dt: float
) -> None:
    """Revolutions that hold the speed ahead, Eq. (9), or those of the programme."""
    law, n, low, high = q[SPEED_LAW], g[REVOLUTIONS_START], g[N_LIMIT], g[N_LIMIT + 1]
    if law == PROGRAMME:
        k = q[FIRST_STEP + REVOLUTIONS] + j[REVOLUTIONS]
        law, n = q[q[AT_MODES] + k], clip(g[q[AT_STEPS] + STEP * k], low, high)
    if law == PID:
        error = g[SPEED_TARGET] - y[U]
        trial = f[SPEED_INTEGRAL] + error * dt
        wanted = g[REVOLUTIONS_START] + g[SPEED_GAINS] * error + g[SPEED_GAINS + 1] * trial
        wanted -= g[SPEED_GAINS + 2] * dy[U]
        n = clip(wanted, low, high)
        if (wanted - n) * error <= 0.0:
            f[SPEED_INTEGRAL] = trial
    f[COMMAND + REVOLUTIONS] = n


@inner
def move_actuators(g: np.ndarray, q: np.ndarray, f: np.ndarray, c: np.ndarray, dt: float, rate: np.ndarray) -> None:
    """Rates of planes, revolutions and tanks towards the mixed command, Eq. (1)."""
    n_planes, at = q[N_PLANES], PLANES
    for i in range(n_planes):
        limit, fastest = g[at + 2], g[at + 3]
        wanted = clip(g[at] * f[COMMAND] + g[at + 1] * f[COMMAND + 1], -limit, limit)
        rate[i] = clip((wanted - c[i]) / dt, -fastest, fastest)
        at += PLANE
    rate[n_planes] = clip((f[COMMAND + 2] - c[n_planes]) / dt, -g[N_RATE], g[N_RATE])
    for tank in range(c.size - n_planes - 1):
        i, limit, fastest = n_planes + 1 + tank, g[TANK_LIMIT + tank], g[TANK_RATE + tank]
        wanted = clip(f[COMMAND + 3 + tank], -limit, limit)
        rate[i] = clip((wanted - c[i]) / dt, -fastest, fastest)
