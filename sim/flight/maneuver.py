"""Fixed-step maneuver loop: autopilot, mixer, actuators, programmes of commands with events.

The vehicle moves under RK4 between control samples; planes, revolutions and tanks move at
constant rate within a sample, towards their command, within their limits. A zigzag reverses
when the checked angle reaches its check value, a step of a programme ends with its event:
both are located inside the time step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.compiled import inner, outer
from sim.flight.autopilot import clip, command_boat, move_actuators
from sim.flight.events import advance, step_past, watch
from sim.flight.orders import (
    AT_MODES,
    AT_STEPS,
    CHECK,
    COMMAND,
    FIRST_STEP,
    FIXED,
    HORIZONTAL,
    LAW,
    N_EVENTS,
    N_LIMIT,
    PRESSURE_DEPTH,
    REVOLUTIONS,
    RUN,
    SENSE,
    STEP,
    VALUE,
    VERTICAL,
    ZIGZAG,
    Settings,
    flat,
    progress,
)
from sim.kernel.layout import N_STATES, Around, Model, Stage, workspace
from sim.kernel.rhs import fill_rate, step
from sim.waves.surroundings import near_of, prepare, read_gauge

Array = NDArray[np.float64]

# Columns of a record: time, states, controls, two commands.
TIME, STATE, CONTROLS = 0, 1, 1 + N_STATES
# Zigzag executes and ended steps that a flight leaves room for at first.
_EVENTS = 256
# Time [s] to which an event is located.
_EVENT_TOLERANCE = 1e-10


@inner
def _past_check(g: np.ndarray, q: np.ndarray, y: np.ndarray, sense: float) -> float:
    """Positive once the checked angle has passed the check value of the present leg."""
    if q[LAW + HORIZONTAL] == ZIGZAG:
        return sense * np.sign(g[VALUE + HORIZONTAL]) * y[11] - g[CHECK + HORIZONTAL]
    if q[LAW + VERTICAL] == ZIGZAG:
        return sense * np.sign(g[VALUE + VERTICAL]) * y[10] - g[CHECK + VERTICAL]
    return -1.0


@inner
def _past(g: np.ndarray, q: np.ndarray, f: np.ndarray, j: np.ndarray, y: np.ndarray, t: float) -> float:
    """Not negative once a zigzag check or an event of a programme has happened."""
    latest = _past_check(g, q, y, f[SENSE])
    if q[N_EVENTS]:
        for axis in range(RUN + 1):
            latest = max(latest, step_past(g, q, f, j, axis, y, t))
    return latest


@inner
def _cross(
    m: np.ndarray,
    w: np.ndarray,
    g: np.ndarray,
    q: np.ndarray,
    f: np.ndarray,
    j: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    rate: np.ndarray,
    t: float,
    h: float,
    near: Around,
    s: np.ndarray,
    k: np.ndarray,
    stage: Stage,
    trial: np.ndarray,
) -> float:
    """Time into the step from ``t`` at which the first event happens; the state then into ``trial``."""
    low, high = 0.0, h
    while True:
        close = high - low <= _EVENT_TOLERANCE
        middle = high if close else 0.5 * (low + high)
        step(m, w, y, c, rate, middle, near, s, k, stage, trial)
        if close:
            return high
        if _past(g, q, f, j, trial, t + middle) >= 0.0:
            high = middle
        else:
            low = middle


@inner
def _next_steps(
    g: np.ndarray, q: np.ndarray, f: np.ndarray, j: np.ndarray, y: np.ndarray, t: float, log: np.ndarray, logged: int
) -> tuple[int, bool]:
    """Take every programme past its event to its next step; fixed commands act at once.

    Returns
    -------
    (steps that ended so far, whether the run ends): time, axis and number of each, as far as
    ``log`` has room.
    """
    ends = False
    for axis in range(RUN + 1):
        while not ends and step_past(g, q, f, j, axis, y, t) >= 0.0:
            if logged < log.shape[0]:
                log[logged, 0], log[logged, 1], log[logged, 2] = t, axis, j[axis]
            logged += 1
            ends = not advance(q, f, j, axis, y, t)
            k = q[FIRST_STEP + axis] + j[axis]
            if axis < RUN and q[q[AT_MODES] + k] == FIXED:
                value = g[q[AT_STEPS] + STEP * k]
                f[COMMAND + axis] = clip(value, g[N_LIMIT], g[N_LIMIT + 1]) if axis == REVOLUTIONS else value
    return logged, ends


@inner
def _is_finite(y: np.ndarray) -> bool:
    total = 0.0
    for i in range(N_STATES):
        total += 0.0 * y[i]
    return total == 0.0


@inner
def _note(f: np.ndarray, y: np.ndarray, c: np.ndarray, time: float, record: np.ndarray, row: int) -> None:
    """Put time, state, controls and the two plane commands into a row of the record."""
    record[row, TIME] = time
    for i in range(N_STATES):
        record[row, STATE + i] = y[i]
    for i in range(c.size):
        record[row, CONTROLS + i] = c[i]
    for i in range(2):
        record[row, CONTROLS + c.size + i] = f[COMMAND + i]


@outer
def run(
    m: np.ndarray,
    w: np.ndarray,
    g: np.ndarray,
    q: np.ndarray,
    f: np.ndarray,
    j: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    dt: float,
    steps: int,
    every: int,
    around: Around,
    s: np.ndarray,
    k: np.ndarray,
    stage: Stage,
    record: np.ndarray,
    executes: np.ndarray,
    log: np.ndarray,
    start: float,
) -> tuple[int, int, int, float]:
    """Integrate a maneuver.

    Parameters
    ----------
    m, w : Model. g, q : Settings. Floats and whole numbers.
    f, j : Progress at the start; left as it is at the end.
    y : (12,) initial state, left final; c : initial controls, left final.
    dt : Control sample and integration step [s].
    steps, every : Number of samples, and samples between records.
    around, s, k, stage : Of a workspace.
    record : (rows, 1 + 12 + controls + 2) filled with time, state, controls, commands.
    executes : (k, 2) filled with time and command [rad] of each zigzag execute.
    log : (k, 3) filled with time, axis and step of each step of a programme that ended.
    start : Time at the start [s]; a run may go on from where another ended.

    Returns
    -------
    (rows recorded, executes, steps that ended, time at the end [s]); there may have been more
    executes and steps than their arrays have room for.
    """
    dy, trial, read, change = np.empty(N_STATES), np.empty(N_STATES), np.empty(N_STATES), np.empty(N_STATES)
    rate, near = np.empty(c.size), near_of(around)
    rows, events, logged, ends = 0, 0, 0, False
    programmed = q[N_EVENTS] > 0
    zigzag = q[LAW] == ZIGZAG or q[LAW + 1] == ZIGZAG
    axis = HORIZONTAL if q[LAW + HORIZONTAL] == ZIGZAG else VERTICAL
    if zigzag:
        executes[0, 0], executes[0, 1], events = start, g[VALUE + axis], 1
    for sample in range(steps + 1):
        now = start + sample * dt
        prepare(around, y, now)
        fill_rate(m, w, y, c, near, s, k, dy)
        if programmed:
            watch(g, q, f, j, y, dy, now)
        for i in range(N_STATES):
            read[i], change[i] = y[i], dy[i]
        if q[PRESSURE_DEPTH]:
            read_gauge(around, read, change)
        command_boat(g, q, f, j, read, change, dt)
        if sample % every == 0 and rows < record.shape[0]:
            _note(f, y, c, now, record, rows)
            rows += 1
        if sample == steps or not _is_finite(y):
            return rows, events, logged, now
        move_actuators(g, q, f, c, dt, rate)
        left = dt
        while left > 0.0:
            now, part = start + sample * dt + (dt - left), left
            step(m, w, y, c, rate, left, near, s, k, stage, trial)
            happens = (zigzag or programmed) and _past(g, q, f, j, trial, now + left) >= 0.0
            if happens:
                part = _cross(m, w, g, q, f, j, y, c, rate, now, left, near, s, k, stage, trial)
            for i in range(N_STATES):
                y[i] = trial[i]
            for i in range(c.size):
                c[i] += part * rate[i]
            left -= part
            if not happens:
                continue
            now = start + sample * dt + (dt - left)
            if zigzag and _past_check(g, q, y, f[SENSE]) >= 0.0:
                f[SENSE] = -f[SENSE]
                f[COMMAND + axis] = f[SENSE] * g[VALUE + axis]
                if events < executes.shape[0]:
                    executes[events, 0], executes[events, 1] = now, f[COMMAND + axis]
                events += 1
            if programmed:
                logged, ends = _next_steps(g, q, f, j, y, now, log, logged)
                if ends:
                    return rows, events, logged, now
            move_actuators(g, q, f, c, max(left, _EVENT_TOLERANCE), rate)
            prepare(around, y, now)
    return rows, events, logged, start + steps * dt


@outer
def hold_for(
    m: np.ndarray,
    w: np.ndarray,
    g: np.ndarray,
    q: np.ndarray,
    f: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    left: float,
    h: float,
    around: Around,
    s: np.ndarray,
    k: np.ndarray,
    stage: Stage,
    rate: np.ndarray,
    start: float,
) -> bool:
    """Part of a sample with the commands in ``f`` held.

    Parameters
    ----------
    left : Time until the next sample, at which the actuators are where they can be [s].
    h : Step, not longer [s].
    rate : (controls,) scratch. Others as ``run``.

    Returns
    -------
    Whether the state is finite.
    """
    prepare(around, y, start)
    move_actuators(g, q, f, c, left, rate)
    step(m, w, y, c, rate, h, near_of(around), s, k, stage, y)
    for i in range(c.size):
        c[i] += h * rate[i]
    return _is_finite(y)


@outer
def hold(
    m: np.ndarray,
    w: np.ndarray,
    g: np.ndarray,
    q: np.ndarray,
    f: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    dt: float,
    steps: int,
    around: Around,
    s: np.ndarray,
    k: np.ndarray,
    stage: Stage,
    rate: np.ndarray,
    start: float,
) -> float:
    """Samples with the commands in ``f`` held: ``run`` without autopilot, events and record.

    Parameters
    ----------
    rate : (controls,) scratch. Others as ``run``.

    Returns
    -------
    Time at the end [s]; not a number when the state left the finite numbers.
    """
    for sample in range(steps):
        if not hold_for(m, w, g, q, f, y, c, dt, dt, around, s, k, stage, rate, start + sample * dt):
            return np.nan
    return start + steps * dt


class Flown(NamedTuple):
    """What a run leaves.

    record : (rows, 15 + controls) as in ``run``, up to the last finite row.
    executes : (k, 2) time [s] and command [rad] of each zigzag execute.
    log : (k, 3) time [s], axis and number of each step of a programme that ended.
    end : (13,) time [s] and state at the end of the run.
    """

    record: Array
    executes: Array
    log: Array
    end: Array


def fly_logged(
    model: Model,
    settings: Settings,
    y0: Array,
    c0: Array,
    dt: float,
    steps: int,
    every: int,
    around: Around = (),
    room: int = _EVENTS,
) -> Flown:
    """``run`` with its arrays allocated, in calm, deep water or what is ``around``.

    Parameters
    ----------
    room : Executes and ended steps there is room for at first; with more, it is flown once more.
    """
    record = np.zeros((steps // every + 1, CONTROLS + c0.size + 2))
    g, q = flat(settings)
    work = workspace(model, around)
    while True:
        executes, log = np.zeros((room, 2)), np.zeros((room, 3))
        y, c, (f, j) = y0.copy(), c0.copy(), progress(settings, y0)
        m, w, s, k = model.real, model.whole, work.real, work.whole
        found = run(m, w, g, q, f, j, y, c, dt, steps, every, around, s, k, work.stage, record, executes, log, 0.0)
        rows, events, logged, end = found
        if max(events, logged) <= room:
            break
        room = max(events, logged)
    flown = record[:rows]
    finite = flown[np.isfinite(flown).all(axis=1)]
    return Flown(finite, executes[:events], log[:logged], np.append(end, y))


def fly(
    model: Model, settings: Settings, y0: Array, c0: Array, dt: float, steps: int, every: int
) -> tuple[Array, Array]:
    """Record and zigzag executes of ``fly_logged``."""
    return fly_logged(model, settings, y0, c0, dt, steps, every)[:2]
