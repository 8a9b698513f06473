"""What ends a step of a programme, or the run: compiled, located inside a time step.

An event is a row (kind, channel, value, hold, x, y, z). Its function is negative before the
event and not negative from it on, so that a bisection over the time step finds it.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

AFTER, ABOVE, BELOW, CHANGE, STEADY = 0, 1, 2, 3, 4
# Channels are the twelve states, then these.
SPEED, POINT_DEPTH = 12, 13
# Axes of a programme; the fourth holds the events that end the run.
VERTICAL, HORIZONTAL, REVOLUTIONS, RUN = 0, 1, 2, 3
N_AXES = 4


class Programme(NamedTuple):
    """Steps of commands and the events that end them.

    first, steps : (4,) first step of each axis (dV, dH, n, run) and how many.
    mode : (k,) law while the step lasts; value : (k,) fixed command [rad or 1/s].
    shift : (k, 2) move of the autopilot's targets: distance [m] and angle [rad], or the
        yaw rate to hold [rad/s].
    event_first : (k + 1,) first event of each step; events : (e, 7) as above.
    """

    first: np.ndarray
    steps: np.ndarray
    mode: np.ndarray
    value: np.ndarray
    shift: np.ndarray
    event_first: np.ndarray
    events: np.ndarray


class Progress(NamedTuple):
    """Where a run is in its programme.

    sense : (1,) sign of the zigzag leg. at : (4,) step of each axis. since : (4,) its start
    [s]. start : (4, 12) the state then. quiet : (e,) since when each channel is steady [s].
    """

    sense: np.ndarray
    at: np.ndarray
    since: np.ndarray
    start: np.ndarray
    quiet: np.ndarray


def progress(programme: Programme, y0: np.ndarray) -> Progress:
    """The start of a run in state ``y0``."""
    start = np.tile(y0, (N_AXES, 1))
    zeros = np.zeros(len(programme.events))
    return Progress(np.ones(1), np.zeros(N_AXES, dtype=np.int64), np.zeros(N_AXES), start, zeros)


@njit(cache=True, error_model="numpy")
def channel_value(y: np.ndarray, event: np.ndarray) -> float:
    """The watched channel of a state, SI and radians."""
    channel = int(event[1])
    if channel < 12:
        return y[channel]
    if channel == SPEED:
        return sqrt(y[0] ** 2 + y[1] ** 2 + y[2] ** 2)
    st, ct = sin(y[10]), cos(y[10])
    return y[8] - st * event[4] + sin(y[9]) * ct * event[5] + cos(y[9]) * ct * event[6]


@njit(cache=True, error_model="numpy")
def _channel_rate(y: np.ndarray, dy: np.ndarray, event: np.ndarray) -> float:
    channel = int(event[1])
    if channel < 12:
        return dy[channel]
    return (y[0] * dy[0] + y[1] * dy[1] + y[2] * dy[2]) / max(channel_value(y, event), 1e-12)


@njit(cache=True, error_model="numpy")
def step_past(p: Programme, run: Progress, axis: int, y: np.ndarray, t: float) -> float:
    """Not negative once an event of the present step of an axis has happened."""
    found = -1.0
    if run.at[axis] >= p.steps[axis]:
        return found
    k = p.first[axis] + run.at[axis]
    for e in range(p.event_first[k], p.event_first[k + 1]):
        event = p.events[e]
        kind = int(event[0])
        if kind == AFTER:
            past = t - run.since[axis] - event[2]
        elif kind == STEADY:
            past = t - run.quiet[e] - event[3]
        elif kind == ABOVE:
            past = channel_value(y, event) - event[2]
        elif kind == BELOW:
            past = event[2] - channel_value(y, event)
        else:
            past = abs(channel_value(y, event) - channel_value(run.start[axis], event)) - event[2]
        if e == p.event_first[k] or past > found:
            found = past
    return found


@njit(cache=True, error_model="numpy")
def watch(p: Programme, run: Progress, y: np.ndarray, dy: np.ndarray, t: float) -> None:
    """Note which channels are not steady at this sample."""
    for axis in range(N_AXES):
        if run.at[axis] >= p.steps[axis]:
            continue
        k = p.first[axis] + run.at[axis]
        for e in range(p.event_first[k], p.event_first[k + 1]):
            if p.events[e, 0] == STEADY and abs(_channel_rate(y, dy, p.events[e])) > p.events[e, 2]:
                run.quiet[e] = t


@njit(cache=True, error_model="numpy")
def advance(p: Programme, run: Progress, axis: int, y: np.ndarray, t: float) -> bool:
    """Go to the next step of an axis; false when there is none."""
    if run.at[axis] + 1 >= p.steps[axis]:
        return False
    run.at[axis] += 1
    run.since[axis] = t
    run.start[axis] = y
    k = p.first[axis] + run.at[axis]
    for e in range(p.event_first[k], p.event_first[k + 1]):
        run.quiet[e] = t
    return True
