"""Fixed-step maneuver loop: autopilot, mixer, actuators, programmes of commands with events.

The vehicle moves under RK4 between control samples; planes, revolutions and tanks move at
constant rate within a sample, towards their command, within their limits. A zigzag reverses
when the checked angle reaches its check value, a step of a programme ends with its event:
both are located inside the time step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sim.flight.events import (
    HORIZONTAL,
    REVOLUTIONS,
    RUN,
    VERTICAL,
    Programme,
    Progress,
    advance,
    progress,
    step_past,
    watch,
)
from sim.kernel.rhs import Model, Work, rhs, rk4, workspace
from sim.waves.surroundings import Around, prepare, read_gauge

FIXED, PID, ZIGZAG, PROGRAMME, YAW_RATE = 0, 1, 2, 3, 4
N_COMMANDS, N_INTEGRALS = 5, 10
# Time [s] to which an event is located.
_EVENT_TOLERANCE = 1e-10


class Settings(NamedTuple):
    """What commands the boat.

    law : (2,) law of dV and dH (``FIXED``, ``PID``, ``ZIGZAG``, ``PROGRAMME``).
    value : (2,) fixed command or first zigzag command, signed [rad].
    check : (2,) zigzag check angle [rad].
    trim : (2,) command at the initial equilibrium [rad].
    gains : (2, 6) P I D on depth [rad/m] and pitch [rad/rad], and on sway and yaw.
    yaw_rate_gains : (6,) P I D of dH on the yaw rate [rad per rad/s], then zeros.
    pressure_depth : Whether the depth is that of a pressure gauge, which feels waves.
    target : (4,) depth of the origin, pitch, earth y, heading.
    speed_law : ``FIXED``, ``PID`` or ``PROGRAMME``; speed_target [m/s], speed_gains P I D
        [rps per m/s].
    tank_law : (2,) of ballast and trim tank, ``FIXED`` or ``PID``; tank_start : (2,) at the
        start, kept when fixed [kg, m]; tank_gains : (2, 6) P I D on depth and pitch;
        tank_limit, tank_rate : (2,).
    programme : Steps and events.
    """

    law: np.ndarray
    value: np.ndarray
    check: np.ndarray
    trim: np.ndarray
    gains: np.ndarray
    yaw_rate_gains: np.ndarray
    target: np.ndarray
    pressure_depth: bool
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
    tank_law: np.ndarray
    tank_start: np.ndarray
    tank_gains: np.ndarray
    tank_limit: np.ndarray
    tank_rate: np.ndarray
    programme: Programme


@njit(cache=True, error_model="numpy")
def _clip(x: float, low: float, high: float) -> float:
    return low if x < low else (high if x > high else x)


@njit(cache=True, error_model="numpy")
def _pid(
    g: np.ndarray,
    trim: float,
    limit: float,
    errors: np.ndarray,
    rates: np.ndarray,
    integrals: np.ndarray,
    dt: float,
) -> float:
    """One loop pair; integrators stop while the command is limited (anti-windup)."""
    command = trim
    for k in range(2):
        trial = integrals[k] + errors[k] * dt
        command += g[3 * k] * errors[k] + g[3 * k + 1] * trial + g[3 * k + 2] * rates[k]
    limited = _clip(command, -limit, limit)
    for k in range(2):
        pushes = g[3 * k + 1] * errors[k] * (command - limited) > 0.0
        if not pushes:
            integrals[k] += errors[k] * dt
    return limited


@njit(cache=True, error_model="numpy")
def autopilot(
    s: Settings,
    y: np.ndarray,
    dy: np.ndarray,
    run: Progress,
    integrals: np.ndarray,
    dt: float,
    command: np.ndarray,
) -> None:
    """Commands dV, dH [rad], n [1/s], ballast [kg] and trim [m] of this sample, Eqs. (9)-(11).

    dV = P_z (z - z_t) + P_theta (theta_t - theta) + ..., dH = P_y (y_t - y) +
    P_psi (psi_t - psi) + ...: positive gains steer back in the program frame. Too deep,
    ballast is pumped out; bow up, the trim tank moves forward.
    """
    errors = np.empty(2)
    rates = np.empty(2)
    p = s.programme
    for axis in range(2):
        law, value, far, turn = s.law[axis], s.value[axis], 0.0, 0.0
        if law == PROGRAMME:
            k = p.first[axis] + run.at[axis]
            law, value, far, turn = p.mode[k], p.value[k], p.shift[k, 0], p.shift[k, 1]
        limit = s.command_limit[axis]
        own = integrals[2 * axis : 2 * axis + 2]
        if law == FIXED:
            command[axis] = value
        elif law == ZIGZAG:
            command[axis] = run.sense[0] * value
        elif law == YAW_RATE:
            errors[0], errors[1] = turn - y[5], 0.0
            rates[0], rates[1] = -dy[5], 0.0
            command[axis] = _pid(s.yaw_rate_gains, s.trim[axis], limit, errors, rates, integrals[8:10], dt)
        elif axis == VERTICAL:
            errors[0], errors[1] = y[8] - (s.target[0] + far), (s.target[1] + turn) - y[10]
            rates[0], rates[1] = dy[8], -dy[10]
            command[axis] = _pid(s.gains[axis], s.trim[axis], limit, errors, rates, own, dt)
        else:
            errors[0], errors[1] = (s.target[2] + far) - y[7], (s.target[3] + turn) - y[11]
            rates[0], rates[1] = -dy[7], -dy[11]
            command[axis] = _pid(s.gains[axis], s.trim[axis], limit, errors, rates, own, dt)
    _revolutions(s, y, dy, run, integrals, dt, command)
    for tank in range(2):
        command[3 + tank] = s.tank_start[tank]
        if s.tank_law[tank] == PID:
            errors[0], rates[0] = s.target[0] - y[8], -dy[8]
            errors[1], rates[1] = y[10] - s.target[1], dy[10]
            own = integrals[5 + 2 * tank : 7 + 2 * tank]
            command[3 + tank] = _pid(s.tank_gains[tank], s.tank_start[tank], s.tank_limit[tank], errors, rates, own, dt)


@njit(cache=True, error_model="numpy")
def _revolutions(
    s: Settings,
    y: np.ndarray,
    dy: np.ndarray,
    run: Progress,
    integrals: np.ndarray,
    dt: float,
    command: np.ndarray,
) -> None:
    """Revolutions that hold the speed ahead, Eq. (9), or those of the programme."""
    law = s.speed_law
    command[2] = s.revolutions
    if law == PROGRAMME:
        k = s.programme.first[REVOLUTIONS] + run.at[REVOLUTIONS]
        law = s.programme.mode[k]
        command[2] = _clip(s.programme.value[k], s.n_limit[0], s.n_limit[1])
    if law == PID:
        error = s.speed_target - y[0]
        trial = integrals[4] + error * dt
        wanted = s.revolutions + s.speed_gains[0] * error + s.speed_gains[1] * trial
        wanted -= s.speed_gains[2] * dy[0]
        command[2] = _clip(wanted, s.n_limit[0], s.n_limit[1])
        if (wanted - command[2]) * error <= 0.0:
            integrals[4] = trial


@njit(cache=True, error_model="numpy")
def _actuators(s: Settings, command: np.ndarray, c: np.ndarray, dt: float, rate: np.ndarray) -> None:
    """Rates of planes, revolutions and tanks towards the mixed command, Eq. (1)."""
    n_planes = s.mixer.shape[0]
    for i in range(n_planes):
        wanted = s.mixer[i, 0] * command[0] + s.mixer[i, 1] * command[1]
        wanted = _clip(wanted, -s.plane_limit[i], s.plane_limit[i])
        rate[i] = _clip((wanted - c[i]) / dt, -s.plane_rate[i], s.plane_rate[i])
    rate[n_planes] = _clip((command[2] - c[n_planes]) / dt, -s.n_rate, s.n_rate)
    for tank in range(c.size - n_planes - 1):
        i = n_planes + 1 + tank
        wanted = _clip(command[3 + tank], -s.tank_limit[tank], s.tank_limit[tank])
        rate[i] = _clip((wanted - c[i]) / dt, -s.tank_rate[tank], s.tank_rate[tank])


@njit(cache=True, error_model="numpy")
def _past_check(s: Settings, y: np.ndarray, sense: float) -> float:
    """Positive once the checked angle has passed the check value of the present leg."""
    if s.law[HORIZONTAL] == ZIGZAG:
        return sense * np.sign(s.value[HORIZONTAL]) * y[11] - s.check[HORIZONTAL]
    if s.law[VERTICAL] == ZIGZAG:
        return sense * np.sign(s.value[VERTICAL]) * y[10] - s.check[VERTICAL]
    return -1.0


@njit(cache=True, error_model="numpy")
def _past(s: Settings, run: Progress, y: np.ndarray, t: float) -> float:
    """Not negative once a zigzag check or an event of a programme has happened."""
    found = _past_check(s, y, run.sense[0])
    if s.programme.events.shape[0]:
        for axis in range(RUN + 1):
            found = max(found, step_past(s.programme, run, axis, y, t))
    return found


@njit(cache=True, error_model="numpy")
def _crossing(
    m: Model,
    s: Settings,
    run: Progress,
    y: np.ndarray,
    c: np.ndarray,
    rate: np.ndarray,
    t: float,
    h: float,
    work: Work,
    stages: np.ndarray,
    trial: np.ndarray,
) -> float:
    """Time into the step from ``t`` at which the first event happens."""
    low, high = 0.0, h
    while high - low > _EVENT_TOLERANCE:
        middle = 0.5 * (low + high)
        rk4(m, y, c, rate, middle, work, stages, trial)
        if _past(s, run, trial, t + middle) >= 0.0:
            high = middle
        else:
            low = middle
    return high


@njit(cache=True, error_model="numpy")
def _next_steps(
    s: Settings, run: Progress, y: np.ndarray, t: float, command: np.ndarray, log: np.ndarray, logged: int
) -> tuple[int, bool]:
    """Take every programme past its event to its next step; fixed commands act at once.

    Returns
    -------
    (rows of the log, whether the run ends): time, axis and number of the step that ended.
    """
    p, ends = s.programme, False
    for axis in range(RUN + 1):
        while not ends and step_past(p, run, axis, y, t) >= 0.0:
            if logged < log.shape[0]:
                log[logged, 0], log[logged, 1], log[logged, 2] = t, axis, run.at[axis]
                logged += 1
            ends = not advance(p, run, axis, y, t)
            k = p.first[axis] + run.at[axis]
            if axis < RUN and p.mode[k] == FIXED:
                command[axis] = p.value[k]
                if axis == REVOLUTIONS:
                    command[axis] = _clip(p.value[k], s.n_limit[0], s.n_limit[1])
    return logged, ends


@njit(cache=True, error_model="numpy", nogil=True)
def run(
    m: Model,
    s: Settings,
    state: Progress,
    y: np.ndarray,
    c: np.ndarray,
    dt: float,
    steps: int,
    every: int,
    work: Work,
    record: np.ndarray,
    executes: np.ndarray,
    log: np.ndarray,
    start: float,
) -> tuple[int, int, int, float]:
    """Integrate a maneuver.

    Parameters
    ----------
    m, s : Model and Settings.
    state : Progress at the start; left as it is at the end.
    y : (12,) initial state, left final; c : initial controls, left final.
    dt : Control sample and integration step [s].
    steps, every : Number of samples, and samples between records.
    record : (rows, 1 + 12 + controls + 2) filled with time, state, controls, commands.
    executes : (k, 2) filled with time and command [rad] of each zigzag execute.
    log : (k, 3) filled with time, axis and step of each step of a programme that ended.
    start : Time at the start [s]; a run may go on from where another ended.

    Returns
    -------
    (rows recorded, executes recorded, rows of the log, time at the end [s]).
    """
    dy, stages, trial = np.zeros(12), np.zeros((6, 12)), np.zeros(12)
    read, change = np.zeros(12), np.zeros(12)
    rate, command, integrals = np.zeros(c.size), np.zeros(N_COMMANDS), np.zeros(N_INTEGRALS)
    rows, events, logged, ends = 0, 0, 0, False
    programmed = s.programme.events.shape[0] > 0
    zigzag = s.law[0] == ZIGZAG or s.law[1] == ZIGZAG
    axis = HORIZONTAL if s.law[1] == ZIGZAG else VERTICAL
    if zigzag:
        executes[0, 0], executes[0, 1], events = start, s.value[axis], 1
    for step in range(steps + 1):
        prepare(work.around, y, start + step * dt)
        rhs(m, y, c, work, dy)
        if programmed:
            watch(s.programme, state, y, dy, start + step * dt)
        read[:], change[:] = y, dy
        if s.pressure_depth:
            read_gauge(work.around, read, change)
        autopilot(s, read, change, state, integrals, dt, command)
        if step % every == 0 and rows < record.shape[0]:
            record[rows, 0] = start + step * dt
            record[rows, 1:13] = y
            record[rows, 13 : 13 + c.size] = c
            record[rows, 13 + c.size : 15 + c.size] = command[:2]
            rows += 1
        if step == steps or not np.isfinite(y).all():
            return rows, events, logged, start + step * dt
        _actuators(s, command, c, dt, rate)
        left = dt
        while left > 0.0:
            now = start + step * dt + (dt - left)
            rk4(m, y, c, rate, left, work, stages, trial)
            part = left
            happens = (zigzag or programmed) and _past(s, state, trial, now + left) >= 0.0
            if happens:
                part = _crossing(m, s, state, y, c, rate, now, left, work, stages, trial)
                rk4(m, y, c, rate, part, work, stages, trial)
            y[:] = trial
            for i in range(c.size):
                c[i] += part * rate[i]
            left -= part
            if not happens:
                continue
            now = start + step * dt + (dt - left)
            if zigzag and _past_check(s, y, state.sense[0]) >= 0.0:
                state.sense[0] = -state.sense[0]
                command[axis] = state.sense[0] * s.value[axis]
                if events < executes.shape[0]:
                    executes[events, 0] = now
                    executes[events, 1] = command[axis]
                events += 1
            if programmed:
                logged, ends = _next_steps(s, state, y, now, command, log, logged)
                if ends:
                    return rows, events, logged, now
            _actuators(s, command, c, max(left, _EVENT_TOLERANCE), rate)
            prepare(work.around, y, now)
    return rows, events, logged, start + steps * dt


class Flown(NamedTuple):
    """What a run leaves.

    record : (rows, 15 + controls) as in ``run``, up to the last finite row.
    executes : (k, 2) time [s] and command [rad] of each zigzag execute.
    log : (k, 3) time [s], axis and number of each step of a programme that ended.
    end : (13,) time [s] and state at the end of the run.
    """

    record: np.ndarray
    executes: np.ndarray
    log: np.ndarray
    end: np.ndarray


def fly_logged(
    model: Model,
    settings: Settings,
    y0: np.ndarray,
    c0: np.ndarray,
    dt: float,
    steps: int,
    every: int,
    around: Around = (),
) -> Flown:
    """``run`` with its arrays allocated, in calm, deep water or what is ``around``."""
    record = np.zeros((steps // every + 1, 15 + c0.size))
    executes, log = np.zeros((256, 2)), np.zeros((256, 3))
    y, c, state = y0.copy(), c0.copy(), progress(settings.programme, y0)
    work = workspace(len(settings.mixer), around)
    rows, events, logged, end = run(model, settings, state, y, c, dt, steps, every, work, record, executes, log, 0.0)
    flown = record[:rows]
    finite = flown[np.isfinite(flown).all(axis=1)]
    return Flown(finite, executes[: min(events, len(executes))], log[:logged], np.append(end, y))


def fly(
    model: Model, settings: Settings, y0: np.ndarray, c0: np.ndarray, dt: float, steps: int, every: int
) -> tuple[np.ndarray, np.ndarray]:
    """Record and zigzag executes of ``fly_logged``."""
    return fly_logged(model, settings, y0, c0, dt, steps, every)[:2]
