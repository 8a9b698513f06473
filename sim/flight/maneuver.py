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

from sim.boat.state import N_STATES, PSI, THETA
from sim.compiled import inlined, merged, outer
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
from sim.kernel.layout import Around, Model, Stage, Whole, Work, workspace
from sim.kernel.rhs import BEGUN, FROM_STATE, fill_rate, step
from sim.waves.surroundings import near_of, prepare, read_gauge

Array = NDArray[np.float64]

# Columns of a record: time, states, controls, and as many commands of planes at the end.
TIME, STATE, CONTROLS = 0, 1, 1 + N_STATES
COMMANDED = 2
# Zigzag executes and ended steps that a flight leaves room for at first.
_EVENTS = 256
# Time [s] to which an event is located.
_EVENT_TOLERANCE = 1e-10


class Sample(NamedTuple):
    """Scratch of a control sample.

    read, change : (12,) state and its rate as the autopilot reads them. trial : (12,) state a step further.
    rate : (controls,) at which the actuators move.
    """

    read: Array
    change: Array
    trial: Array
    rate: Array


def sample_of(controls: int) -> Sample:
    """Scratch for so many controls."""
    read, change, trial = np.zeros((3, N_STATES))
    return Sample(read, change, trial, np.zeros(controls))


class Flight(NamedTuple):
    """A boat under way, as the compiled loop takes it.

    Attributes
    ----------
    m, w : Model. g, q : Settings. f, j : Progress. s, k : Scratch. Floats and whole numbers.
    y, c : (12,) state and controls.
    stage : Scratch of a step. sample : Scratch of a control sample.
    """

    m: Array
    w: Whole
    g: Array
    q: Whole
    f: Array
    j: Whole
    y: Array
    c: Array
    s: Array
    k: Whole
    stage: Stage
    sample: Sample


class Log(NamedTuple):
    """What a flight writes down.

    Attributes
    ----------
    record : (rows, 1 + 12 + controls + 2) time, state, controls, commands of dV and dH.
    executes : (k, 2) time and command [rad] of each zigzag execute.
    steps : (k, 3) time, axis and number of each step of a programme that ended.
    """

    record: Array
    executes: Array
    steps: Array


def flight_of(model: Model, settings: Settings, work: Work, y: Array, c: Array) -> Flight:
    """A flight at its start.

    Parameters
    ----------
    y, c : (12,) state and controls, which change on the way.
    """
    g, q = flat(settings)
    f, j = progress(settings, y)
    return Flight(model.real, model.whole, g, q, f, j, y, c, work.real, work.whole, work.stage, sample_of(c.size))


@merged
def _past_check(g: np.ndarray, q: np.ndarray, y: np.ndarray, sense: float) -> float:
    """Positive once the checked angle has passed the check value of the present leg."""
    if q[LAW + HORIZONTAL] == ZIGZAG:
        return sense * np.sign(g[VALUE + HORIZONTAL]) * y[PSI] - g[CHECK + HORIZONTAL]
    if q[LAW + VERTICAL] == ZIGZAG:
        return sense * np.sign(g[VALUE + VERTICAL]) * y[THETA] - g[CHECK + VERTICAL]
    return -1.0


@inlined
def past(g: np.ndarray, q: np.ndarray, f: np.ndarray, j: np.ndarray, y: np.ndarray, t: float) -> float:
    """Not negative once a zigzag check or an event of a programme has happened."""
    latest = _past_check(g, q, y, f[SENSE])
    if q[N_EVENTS]:
        for axis in range(RUN + 1):
            latest = max(latest, step_past(g, q, f, j, axis, y, t))
    return latest


@merged
def _cross(v: Flight, near: Around, rate: np.ndarray, t: float, h: float, scheme: int, trial: np.ndarray) -> float:
    """Time into the step from ``t`` at which the first event happens; the state then into ``trial``."""
    low, high = 0.0, h
    while True:
        close = high - low <= _EVENT_TOLERANCE
        middle = high if close else 0.5 * (low + high)
        step(v.m, v.w, v.y, v.c, rate, middle, near, v.s, v.k, v.stage, scheme, trial)
        if close:
            return high
        if past(v.g, v.q, v.f, v.j, trial, t + middle) >= 0.0:
            high = middle
        else:
            low = middle


@merged
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


@merged
def is_finite(y: np.ndarray) -> bool:
    """Whether all of a state is finite."""
    total = 0.0
    for i in range(N_STATES):
        total += 0.0 * y[i]
    return total == 0.0


@merged
def _note(f: np.ndarray, y: np.ndarray, c: np.ndarray, time: float, record: np.ndarray, row: int) -> None:
    """Put time, state, controls and the two plane commands into a row of the record."""
    record[row, TIME] = time
    for i in range(N_STATES):
        record[row, STATE + i] = y[i]
    for i in range(c.size):
        record[row, CONTROLS + i] = c[i]
    for i in range(2):
        record[row, CONTROLS + c.size + i] = f[COMMAND + i]


@merged
def _command(v: Flight, around: Around, now: float, dt: float) -> None:
    """Commands of the sample that begins now; the rate of the state into the start of the next step."""
    dy, read, change = v.stage.start, v.sample.read, v.sample.change
    prepare(around, v.y, now)
    fill_rate(v.m, v.w, v.y, v.c, near_of(around), v.s, v.k, dy)
    if v.q[N_EVENTS] > 0:
        watch(v.g, v.q, v.f, v.j, v.y, dy, now)
    for i in range(N_STATES):
        read[i], change[i] = v.y[i], dy[i]
    if v.q[PRESSURE_DEPTH]:
        read_gauge(around, read, change)
    command_boat(v.g, v.q, v.f, v.j, read, change, dt)


@merged
def _turn_over(v: Flight, axis: int, now: float, log: Log, events: int) -> int:
    """Reverse a zigzag, when it is at its check angle; executes so far."""
    if _past_check(v.g, v.q, v.y, v.f[SENSE]) < 0.0:
        return events
    v.f[SENSE] = -v.f[SENSE]
    v.f[COMMAND + axis] = v.f[SENSE] * v.g[VALUE + axis]
    if events < log.executes.shape[0]:
        log.executes[events, 0], log.executes[events, 1] = now, v.f[COMMAND + axis]
    return events + 1


@outer
def integrate(
    v: Flight, around: Around, log: Log, dt: float, steps: int, every: int, scheme: int, start: float
) -> tuple[int, int, int, float]:
    """Integrate a maneuver.

    Parameters
    ----------
    v : At the start; progress, state and controls are left as they are at the end.
    around : Of the workspace.
    log : Filled with what happens.
    dt : Control sample and integration step [s].
    steps, every : Number of samples, and samples between records.
    scheme : ``BEGUN`` or ``MIDPOINT`` of ``sim.kernel.rhs``.
    start : Time at the start [s]; a run may go on from where another ended.

    Returns
    -------
    (rows recorded, executes, steps that ended, time at the end [s]); there may be more than the log has room for.
    """
    trial, rate, near = v.sample.trial, v.sample.rate, near_of(around)
    rows, events, ended, ends = 0, 0, 0, False
    programmed = v.q[N_EVENTS] > 0
    zigzag = v.q[LAW] == ZIGZAG or v.q[LAW + 1] == ZIGZAG
    axis = HORIZONTAL if v.q[LAW + HORIZONTAL] == ZIGZAG else VERTICAL
    if zigzag:
        log.executes[0, 0], log.executes[0, 1], events = start, v.g[VALUE + axis], 1
    for sample in range(steps + 1):
        now = start + sample * dt
        _command(v, around, now, dt)
        if sample % every == 0 and rows < log.record.shape[0]:
            _note(v.f, v.y, v.c, now, log.record, rows)
            rows += 1
        if sample == steps or not is_finite(v.y):
            return rows, events, ended, now
        move_actuators(v.g, v.q, v.f, v.c, dt, rate)
        left = dt
        while left > 0.0:
            now, part = start + sample * dt + (dt - left), left
            step(v.m, v.w, v.y, v.c, rate, left, near, v.s, v.k, v.stage, scheme, trial)
            happens = (zigzag or programmed) and past(v.g, v.q, v.f, v.j, trial, now + left) >= 0.0
            if happens:
                part = _cross(v, near, rate, now, left, scheme, trial)
            for i in range(N_STATES):
                v.y[i] = trial[i]
            for i in range(v.c.size):
                v.c[i] += part * rate[i]
            left -= part
            if not happens:
                continue
            now = start + sample * dt + (dt - left)
            if zigzag:
                events = _turn_over(v, axis, now, log, events)
            if programmed:
                ended, ends = _next_steps(v.g, v.q, v.f, v.j, v.y, now, log.steps, ended)
                if ends:
                    return rows, events, ended, now
            move_actuators(v.g, v.q, v.f, v.c, max(left, _EVENT_TOLERANCE), rate)
            prepare(around, v.y, now)
            fill_rate(v.m, v.w, v.y, v.c, near, v.s, v.k, v.stage.start)
    return rows, events, ended, start + steps * dt


@outer
def hold_for(v: Flight, around: Around, rate: np.ndarray, left: float, h: float, start: float) -> bool:
    """Part of a sample with the commands of the flight held.

    Parameters
    ----------
    rate : (controls,) scratch.
    left : Time until the next sample, at which the actuators are where they can be [s].
    h : Step, not longer [s].

    Returns
    -------
    Whether the state is finite.
    """
    prepare(around, v.y, start)
    move_actuators(v.g, v.q, v.f, v.c, left, rate)
    step(v.m, v.w, v.y, v.c, rate, h, near_of(around), v.s, v.k, v.stage, FROM_STATE, v.y)
    for i in range(v.c.size):
        v.c[i] += h * rate[i]
    return is_finite(v.y)


@outer
def hold(v: Flight, around: Around, rate: np.ndarray, dt: float, steps: int, start: float) -> float:
    """Samples with the commands of the flight held: ``run`` without autopilot, events and record.

    Parameters
    ----------
    rate : (controls,) scratch. Others as ``run``.

    Returns
    -------
    Time at the end [s]; not a number when the state left the finite numbers.
    """
    for sample in range(steps):
        if not hold_for(v, around, rate, dt, dt, start + sample * dt):
            return np.nan
    return start + steps * dt


class Flown(NamedTuple):
    """What a run leaves.

    record : (rows, ``CONTROLS`` + controls + ``COMMANDED``) as in ``run``, up to the last finite row.
    executes : (k, 2) time [s] and command [rad] of each zigzag execute.
    log : (k, 3) time [s], axis and number of each step of a programme that ended.
    end : (13,) time [s] and state at the end of the run.
    """

    record: Array
    executes: Array
    log: Array
    end: Array


class Clock(NamedTuple):
    """Steps of a flight: their length ``dt`` [s], how many at most, every how many of them is recorded, and how
    each is taken: ``BEGUN`` or ``MIDPOINT`` of ``sim.kernel.rhs``, whose four stages or two begin with the rate that
    the autopilot reads.
    """

    dt: float
    steps: int
    every: int
    scheme: int = BEGUN


def fly_logged(
    model: Model,
    settings: Settings,
    y0: Array,
    c0: Array,
    clock: Clock,
    around: Around = (),
    room: int = _EVENTS,
) -> Flown:
    """``integrate`` with its arrays allocated, in calm, deep water or what is ``around``.

    Parameters
    ----------
    model, settings : The boat and its commands.
    y0, c0 : State and controls at the start.
    clock : Steps and records.
    around : Waves and surface.
    room : Executes and ended steps there is room for at first; with more, it is flown once more.
    """
    record = np.zeros((clock.steps // clock.every + 1, CONTROLS + c0.size + COMMANDED))
    work = workspace(model, around)
    while True:
        log = Log(record, np.zeros((room, 2)), np.zeros((room, 3)))
        flight = flight_of(model, settings, work, y0.copy(), c0.copy())
        rows, executes, ended, end = integrate(flight, work.around, log, *clock, 0.0)
        if max(executes, ended) <= room:
            break
        room = max(executes, ended)
    flown = record[:rows]
    finite = flown[np.isfinite(flown).all(axis=1)]
    return Flown(finite, log.executes[:executes], log.steps[:ended], np.append(end, flight.y))


def fly(
    model: Model, settings: Settings, y0: Array, c0: Array, dt: float, steps: int, every: int
) -> tuple[Array, Array]:
    """Record and zigzag executes of ``fly_logged``."""
    return fly_logged(model, settings, y0, c0, Clock(dt, steps, every))[:2]
