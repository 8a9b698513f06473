"""What ends a step of a programme, or the run: compiled, located inside a time step.

An event is a row (kind, channel, value, hold, x, y, z). Its function is negative before the
event and not negative from it on, so that a bisection over the time step finds it. Arguments
``g``, ``q``, ``f``, ``j`` are settings and progress of ``sim.flight.orders``.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from sim.boat.state import N_STATES
from sim.compiled import inner
from sim.flight.orders import (
    ABOVE,
    AFTER,
    AT_EVENT_FIRST,
    AT_EVENTS,
    BELOW,
    EVENT,
    FIRST_STEP,
    N_AXES,
    N_STEPS,
    QUIET,
    SINCE,
    SPEED,
    START,
    STEADY,
)


@inner
def _channel_value(y: np.ndarray, at: int, g: np.ndarray, event: int) -> float:
    """The channel that an event watches, SI and radians, of the state that starts at ``y[at]``."""
    channel = int(g[event + 1])
    if channel < N_STATES:
        return y[at + channel]
    if channel == SPEED:
        return sqrt(y[at] ** 2 + y[at + 1] ** 2 + y[at + 2] ** 2)
    phi, theta = y[at + 9], y[at + 10]
    st, ct = sin(theta), cos(theta)
    return y[at + 8] - st * g[event + 4] + sin(phi) * ct * g[event + 5] + cos(phi) * ct * g[event + 6]


@inner
def _channel_rate(y: np.ndarray, dy: np.ndarray, g: np.ndarray, event: int) -> float:
    channel = int(g[event + 1])
    if channel < N_STATES:
        return dy[channel]
    return (y[0] * dy[0] + y[1] * dy[1] + y[2] * dy[2]) / max(_channel_value(y, 0, g, event), 1e-12)


@inner
def _events(q: np.ndarray, j: np.ndarray, axis: int) -> tuple[int, int]:
    """First event of the present step of an axis, and the one after its last; none after the last step."""
    if j[axis] >= q[N_STEPS + axis]:
        return 0, 0
    k = q[AT_EVENT_FIRST] + q[FIRST_STEP + axis] + j[axis]
    return q[k], q[k + 1]


@inner
def step_past(g: np.ndarray, q: np.ndarray, f: np.ndarray, j: np.ndarray, axis: int, y: np.ndarray, t: float) -> float:
    """Not negative once an event of the present step of an axis has happened."""
    latest = -np.inf
    first, end = _events(q, j, axis)
    for e in range(first, end):
        event = q[AT_EVENTS] + EVENT * e
        kind = int(g[event])
        if kind == AFTER:
            past = t - f[SINCE + axis] - g[event + 2]
        elif kind == STEADY:
            past = t - f[QUIET + e] - g[event + 3]
        elif kind == ABOVE:
            past = _channel_value(y, 0, g, event) - g[event + 2]
        elif kind == BELOW:
            past = g[event + 2] - _channel_value(y, 0, g, event)
        else:
            begun = _channel_value(f, START + N_STATES * axis, g, event)
            past = abs(_channel_value(y, 0, g, event) - begun) - g[event + 2]
        latest = max(latest, past)
    return latest if first < end else -1.0


@inner
def watch(g: np.ndarray, q: np.ndarray, f: np.ndarray, j: np.ndarray, y: np.ndarray, dy: np.ndarray, t: float) -> None:
    """Note which channels are not steady at this sample."""
    for axis in range(N_AXES):
        first, end = _events(q, j, axis)
        for e in range(first, end):
            event = q[AT_EVENTS] + EVENT * e
            if g[event] == STEADY and abs(_channel_rate(y, dy, g, event)) > g[event + 2]:
                f[QUIET + e] = t


@inner
def advance(q: np.ndarray, f: np.ndarray, j: np.ndarray, axis: int, y: np.ndarray, t: float) -> bool:
    """Go to the next step of an axis; false when there is none."""
    if j[axis] + 1 >= q[N_STEPS + axis]:
        return False
    j[axis] += 1
    f[SINCE + axis] = t
    for i in range(N_STATES):
        f[START + N_STATES * axis + i] = y[i]
    first, end = _events(q, j, axis)
    for e in range(first, end):
        f[QUIET + e] = t
    return True
