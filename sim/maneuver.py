"""Fixed-step maneuver loop: autopilot, mixer, actuators, zigzag reversals as events.

The vehicle moves under RK4 between control samples; the planes move at constant rate
within a sample, towards their command, within rate and angle limits. A zigzag reverses
when the checked angle reaches its check value: the crossing is located inside the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sim.kernel import Model, Work, rk4, workspace

FIXED, PID, ZIGZAG = 0, 1, 2
VERTICAL, HORIZONTAL = 0, 1
# Time [s] to which a zigzag reversal is located.
_EVENT_TOLERANCE = 1e-10


class Settings(NamedTuple):
    """What commands the boat.

    law : (2,) law of dV and dH (``FIXED``, ``PID``, ``ZIGZAG``).
    value : (2,) fixed command or first zigzag command, signed [rad].
    check : (2,) zigzag check angle [rad].
    trim : (2,) command at the initial equilibrium [rad].
    gains : (2, 6) P I D on depth [rad/m] and pitch [rad/rad], and on sway and yaw.
    target : (4,) depth of the origin, pitch, earth y, heading.
    speed_law : ``FIXED`` or ``PID``; speed_target [m/s], speed_gains P I D [rps per m/s].
    """

    law: np.ndarray
    value: np.ndarray
    check: np.ndarray
    trim: np.ndarray
    gains: np.ndarray
    target: np.ndarray
    speed_law: int
    speed_target: float
    speed_gains: np.ndarray
    revolutions: float
    mixer: np.ndarray
    plane_limit: np.ndarray
    plane_rate: np.ndarray
    n_limit: np.ndarray
    n_rate: float
    command_limit: np.ndarray


@njit(cache=True, error_model="numpy")
def _clip(x: float, low: float, high: float) -> float:
    return low if x < low else (high if x > high else x)


@njit(cache=True, error_model="numpy")
def _pid(s: Settings, axis: int, errors: np.ndarray, rates: np.ndarray, integrals: np.ndarray, dt: float) -> float:
    """One loop pair; integrators stop while the command is limited (anti-windup)."""
    g = s.gains[axis]
    command = s.trim[axis]
    for k in range(2):
        trial = integrals[2 * axis + k] + errors[k] * dt
        command += g[3 * k] * errors[k] + g[3 * k + 1] * trial + g[3 * k + 2] * rates[k]
    limited = _clip(command, -s.command_limit[axis], s.command_limit[axis])
    for k in range(2):
        pushes = g[3 * k + 1] * errors[k] * (command - limited) > 0.0
        if not pushes:
            integrals[2 * axis + k] += errors[k] * dt
    return limited


@njit(cache=True, error_model="numpy")
def autopilot(
    s: Settings,
    y: np.ndarray,
    dy: np.ndarray,
    sense: float,
    integrals: np.ndarray,
    dt: float,
    command: np.ndarray,
) -> None:
    """Commands dV, dH [rad] and n [1/s] of this sample, Eqs. (9)-(10).

    dV = P_z (z - z_t) + P_theta (theta_t - theta) + ..., dH = P_y (y_t - y) +
    P_psi (psi_t - psi) + ...: positive gains steer back in the program frame.
    """
    errors = np.empty(2)
    rates = np.empty(2)
    for axis in range(2):
        if s.law[axis] == FIXED:
            command[axis] = s.value[axis]
        elif s.law[axis] == ZIGZAG:
            command[axis] = sense * s.value[axis]
        elif axis == VERTICAL:
            errors[0], errors[1] = y[8] - s.target[0], s.target[1] - y[10]
            rates[0], rates[1] = dy[8], -dy[10]
            command[axis] = _pid(s, axis, errors, rates, integrals, dt)
        else:
            errors[0], errors[1] = s.target[2] - y[7], s.target[3] - y[11]
            rates[0], rates[1] = -dy[7], -dy[11]
            command[axis] = _pid(s, axis, errors, rates, integrals, dt)
    command[2] = s.revolutions
    if s.speed_law == PID:
        error = s.speed_target - np.sqrt(y[0] ** 2 + y[1] ** 2 + y[2] ** 2)
        trial = integrals[4] + error * dt
        wanted = s.revolutions + s.speed_gains[0] * error + s.speed_gains[1] * trial
        wanted -= s.speed_gains[2] * dy[0]
        command[2] = _clip(wanted, s.n_limit[0], s.n_limit[1])
        if (wanted - command[2]) * error <= 0.0:
            integrals[4] = trial


@njit(cache=True, error_model="numpy")
def _actuators(s: Settings, command: np.ndarray, c: np.ndarray, dt: float, rate: np.ndarray) -> None:
    """Rates of planes and revolutions towards the mixed command, Eq. (1)."""
    n_planes = s.mixer.shape[0]
    for i in range(n_planes):
        wanted = s.mixer[i, 0] * command[0] + s.mixer[i, 1] * command[1]
        wanted = _clip(wanted, -s.plane_limit[i], s.plane_limit[i])
        rate[i] = _clip((wanted - c[i]) / dt, -s.plane_rate[i], s.plane_rate[i])
    rate[n_planes] = _clip((command[2] - c[n_planes]) / dt, -s.n_rate, s.n_rate)


@njit(cache=True, error_model="numpy")
def _past_check(s: Settings, y: np.ndarray, sense: float) -> float:
    """Positive once the checked angle has passed the check value of the present leg."""
    if s.law[HORIZONTAL] == ZIGZAG:
        return sense * np.sign(s.value[HORIZONTAL]) * y[11] - s.check[HORIZONTAL]
    if s.law[VERTICAL] == ZIGZAG:
        return sense * np.sign(s.value[VERTICAL]) * y[10] - s.check[VERTICAL]
    return -1.0


@njit(cache=True, error_model="numpy")
def _crossing(
    m: Model,
    s: Settings,
    y: np.ndarray,
    c: np.ndarray,
    rate: np.ndarray,
    h: float,
    sense: float,
    work: Work,
    stages: np.ndarray,
    trial: np.ndarray,
) -> float:
    """Time into the step at which the checked angle reaches the check value."""
    low, high = 0.0, h
    while high - low > _EVENT_TOLERANCE:
        middle = 0.5 * (low + high)
        rk4(m, y, c, rate, middle, work, stages, trial)
        if _past_check(s, trial, sense) >= 0.0:
            high = middle
        else:
            low = middle
    return high


@njit(cache=True, error_model="numpy", nogil=True)
def run(
    m: Model,
    s: Settings,
    y0: np.ndarray,
    c0: np.ndarray,
    dt: float,
    steps: int,
    every: int,
    work: Work,
    record: np.ndarray,
    executes: np.ndarray,
) -> tuple[int, int]:
    """Integrate a maneuver.

    Parameters
    ----------
    m, s : Model and Settings.
    y0 : (12,) initial state; c0 : (planes + 1,) initial controls.
    dt : Control sample and integration step [s].
    steps, every : Number of samples, and samples between records.
    record : (rows, 1 + 12 + planes + 1 + 2) filled with time, state, controls, commands.
    executes : (k, 2) filled with time and command [rad] of each zigzag execute.

    Returns
    -------
    (rows recorded, executes recorded).
    """
    y, c, dy = y0.copy(), c0.copy(), np.zeros(12)
    stages, trial = np.zeros((6, 12)), np.zeros(12)
    rate, command, integrals = np.zeros(c.size), np.zeros(3), np.zeros(5)
    sense, rows, events = 1.0, 0, 0
    zigzag = s.law[0] == ZIGZAG or s.law[1] == ZIGZAG
    axis = HORIZONTAL if s.law[1] == ZIGZAG else VERTICAL
    if zigzag:
        executes[0, 0], executes[0, 1], events = 0.0, s.value[axis], 1
    for step in range(steps + 1):
        rk4(m, y, c, rate, 0.0, work, stages, trial)
        for i in range(12):
            dy[i] = stages[0, i]
        autopilot(s, y, dy, sense, integrals, dt, command)
        if step % every == 0 and rows < record.shape[0]:
            record[rows, 0] = step * dt
            record[rows, 1:13] = y
            record[rows, 13 : 13 + c.size] = c
            record[rows, 13 + c.size : 15 + c.size] = command[:2]
            rows += 1
        if step == steps or not np.isfinite(y).all():
            break
        _actuators(s, command, c, dt, rate)
        left = dt
        while left > 0.0:
            rk4(m, y, c, rate, left, work, stages, trial)
            part = left
            reversed_now = zigzag and _past_check(s, trial, sense) >= 0.0
            if reversed_now:
                part = _crossing(m, s, y, c, rate, left, sense, work, stages, trial)
                rk4(m, y, c, rate, part, work, stages, trial)
            y[:] = trial
            for i in range(c.size):
                c[i] += part * rate[i]
            left -= part
            if reversed_now:
                sense = -sense
                command[axis] = sense * s.value[axis]
                if events < executes.shape[0]:
                    executes[events, 0] = step * dt + (dt - left)
                    executes[events, 1] = command[axis]
                events += 1
                _actuators(s, command, c, max(left, _EVENT_TOLERANCE), rate)
    return rows, events


def fly(
    model: Model, settings: Settings, y0: np.ndarray, c0: np.ndarray, dt: float, steps: int, every: int
) -> tuple[np.ndarray, np.ndarray]:
    """``run`` with its arrays allocated.

    Returns
    -------
    record : (rows, 15 + planes + 1) as in ``run``, up to the last finite row.
    executes : (k, 2) time [s] and command [rad] of each zigzag execute.
    """
    record = np.zeros((steps // every + 1, 15 + c0.size))
    executes = np.zeros((256, 2))
    work = workspace(c0.size - 1)
    rows, events = run(model, settings, y0, c0, dt, steps, every, work, record, executes)
    flown = record[:rows]
    return flown[np.isfinite(flown).all(axis=1)], executes[: min(events, len(executes))]
