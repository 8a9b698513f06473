"""What commands a boat, and where it stands in the flat arrays of the compiled loop.

``Settings`` and its ``Programme`` are for people; ``flat`` makes one array of floats ``g`` and
one of whole numbers ``q`` of them. What changes in the course of a flight, the present leg and
step, integrals and commands, is its ``Progress``: floats ``f`` and whole numbers ``j``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

FIXED, PID, ZIGZAG, PROGRAMME, YAW_RATE = 0, 1, 2, 3, 4
# Axes of a programme; the fourth holds the events that end the run.
VERTICAL, HORIZONTAL, REVOLUTIONS, RUN = 0, 1, 2, 3
N_AXES = 4
# Kinds of events. Channels are the twelve states, then these.
AFTER, ABOVE, BELOW, CHANGE, STEADY = 0, 1, 2, 3, 4
SPEED, POINT_DEPTH = 12, 13
N_STATES = 12

# Settings, floats. Then four a plane: shares of dV and dH, limit, rate; three a step: value,
# distance, angle; seven an event.
VALUE, CHECK, TRIM, COMMAND_LIMIT = 0, 2, 4, 6
GAINS, YAW_RATE_GAINS, TARGET = 8, 20, 26
SPEED_TARGET, SPEED_GAINS, REVOLUTIONS_START, N_LIMIT, N_RATE = 30, 31, 34, 35, 37
TANK_START, TANK_GAINS, TANK_LIMIT, TANK_RATE = 38, 40, 52, 54
PLANES, PLANE, STEP, EVENT = 56, 4, 3, 7
# Settings, whole numbers. Then the modes of the steps and the first event of each.
LAW, SPEED_LAW, PRESSURE_DEPTH, TANK_LAW, N_PLANES = 0, 2, 3, 4, 6
FIRST_STEP, N_STEPS, N_EVENTS = 7, 11, 15
AT_STEPS, AT_EVENTS, AT_MODES, AT_EVENT_FIRST = 16, 17, 18, 19
HEADER = 20

# Progress, floats: sense of the zigzag leg, commands, integrals, start of each axis' step [s] and
# the state then, since when each channel is steady [s]. Whole numbers: step of each axis.
SENSE, COMMAND = 0, 1
PLANE_INTEGRALS, SPEED_INTEGRAL, TANK_INTEGRALS, YAW_RATE_INTEGRALS = 6, 10, 11, 15
SINCE, START = 17, 21
QUIET = START + N_AXES * N_STATES
N_COMMANDS = 5


class Programme(NamedTuple):
    """Steps of commands and the events that end them.

    first, steps : (4,) first step of each axis (dV, dH, n, run) and how many.
    mode : (k,) law while the step lasts; value : (k,) fixed command [rad or 1/s].
    shift : (k, 2) move of the autopilot's targets: distance [m] and angle [rad], or the
        yaw rate to hold [rad/s].
    event_first : (k + 1,) first event of each step; events : (e, 7) kind, channel, value, hold,
        x, y, z.
    """

    first: Whole
    steps: Whole
    mode: Whole
    value: Array
    shift: Array
    event_first: Whole
    events: Array


class Settings(NamedTuple):
    """What commands the boat.

    law : (2,) law of dV and dH (``FIXED``, ``PID``, ``ZIGZAG``, ``PROGRAMME``).
    value : (2,) fixed command or first zigzag command, signed [rad].
    check : (2,) zigzag check angle [rad].
    trim : (2,) command at the initial equilibrium [rad].
    gains : (2, 6) P I D on depth [rad/m] and pitch [rad/rad], and on sway and yaw.
    yaw_rate_gains : (6,) P I D of dH on the yaw rate [rad per rad/s], then zeros.
    target : (4,) depth of the origin, pitch, earth y, heading.
    pressure_depth : Whether the depth is that of a pressure gauge, which feels waves.
    speed_law : ``FIXED``, ``PID`` or ``PROGRAMME``; speed_target [m/s], speed_gains P I D
        [rps per m/s]; revolutions at the start [1/s].
    mixer : (planes, 2) shares of dV and dH; plane_limit, plane_rate [rad, rad/s].
    n_limit, n_rate : [1/s, 1/s^2]. command_limit : (2,) of dV and dH [rad].
    tank_law : (2,) of ballast and trim tank, ``FIXED`` or ``PID``; tank_start : (2,) at the
        start, kept when fixed [kg, m]; tank_gains : (2, 6) P I D on depth and pitch;
        tank_limit, tank_rate : (2,).
    programme : Steps and events.
    """

    law: Whole
    value: Array
    check: Array
    trim: Array
    gains: Array
    yaw_rate_gains: Array
    target: Array
    pressure_depth: bool
    speed_law: int
    speed_target: float
    speed_gains: Array
    revolutions: float
    mixer: Array
    plane_limit: Array
    plane_rate: Array
    n_limit: Array
    n_rate: float
    command_limit: Array
    tank_law: Whole
    tank_start: Array
    tank_gains: Array
    tank_limit: Array
    tank_rate: Array
    programme: Programme


def flat(s: Settings) -> tuple[Array, Whole]:
    """The settings as the compiled loop reads them: floats ``g`` and whole numbers ``q``."""
    p = s.programme
    planes = np.column_stack([s.mixer, s.plane_limit, s.plane_rate]).ravel()
    head = np.zeros(PLANES)
    places = (
        *((VALUE, s.value), (CHECK, s.check), (TRIM, s.trim), (COMMAND_LIMIT, s.command_limit)),
        *((GAINS, s.gains), (YAW_RATE_GAINS, s.yaw_rate_gains), (TARGET, s.target)),
        *((SPEED_TARGET, s.speed_target), (SPEED_GAINS, s.speed_gains), (REVOLUTIONS_START, s.revolutions)),
        *((N_LIMIT, s.n_limit), (N_RATE, s.n_rate), (TANK_START, s.tank_start), (TANK_GAINS, s.tank_gains)),
        *((TANK_LIMIT, s.tank_limit), (TANK_RATE, s.tank_rate)),
    )
    for at, value in places:
        numbers = np.ravel(value)
        head[at : at + numbers.size] = numbers
    steps = np.column_stack([p.value, p.shift]).ravel()
    g = np.concatenate([head, planes, steps, p.events.ravel()])
    q = np.zeros(HEADER, dtype=np.int64)
    q[LAW : LAW + 2], q[TANK_LAW : TANK_LAW + 2] = s.law, s.tank_law
    q[[SPEED_LAW, PRESSURE_DEPTH, N_PLANES, N_EVENTS]] = s.speed_law, s.pressure_depth, len(s.mixer), len(p.events)
    q[FIRST_STEP : FIRST_STEP + N_AXES], q[N_STEPS : N_STEPS + N_AXES] = p.first, p.steps
    q[AT_STEPS], q[AT_EVENTS] = PLANES + planes.size, PLANES + planes.size + steps.size
    q[AT_MODES], q[AT_EVENT_FIRST] = HEADER, HEADER + len(p.mode)
    return g, np.concatenate([q, p.mode, p.event_first])


class Progress(NamedTuple):
    """Where a flight is in its commands: floats ``f`` and whole numbers ``j``."""

    f: Array
    j: Whole


def progress(settings: Settings, y0: Array) -> Progress:
    """The start of a flight in state ``y0``."""
    f = np.zeros(QUIET + len(settings.programme.events))
    f[SENSE] = 1.0
    f[START:QUIET] = np.tile(y0, N_AXES)
    return Progress(f, np.zeros(N_AXES, dtype=np.int64))
