"""The loop of a flight, compiled while another process reads files, looks for an equilibrium and compiles the rest.

Nothing is flown: the compiler needs the types of the arguments alone. It begins with what the other process comes to
last, or waits for longest; what both need, one of them compiles and the other reads (``sim.compiled_cache``).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from sim import compiled
from sim.flight.autopilot import command_boat, move_actuators
from sim.flight.events import watch
from sim.flight.maneuver import Flight, Log, Sample, integrate, past
from sim.hull.emergence import Cells
from sim.kernel.layout import Around, Stage
from sim.kernel.rhs import BEGUN, fill_rate, step
from sim.waves.drift import Drift
from sim.waves.linear import regular
from sim.waves.loads import Gauges, make_sea
from sim.waves.passage import advance
from sim.waves.pressure import Quadrature
from sim.waves.surroundings import near_of, surroundings_of

_REAL, _WHOLE, _TABLE = np.zeros(1), np.zeros(1, dtype=np.int64), np.zeros((1, 1))


def _in_waves() -> Around:
    """Surroundings of one point in one wave."""
    point, places, row = np.zeros((1, 3)), np.zeros(3), np.ones(1)
    gauges = Gauges(np.zeros(1), np.zeros((2, 3)))
    sea = make_sea(regular(1.0, 1.0, 0.0, 1.0, 1.0), Quadrature(point, row), point, point, point, gauges=gauges)
    cells = Cells(point, point, point, row, _WHOLE, row, _WHOLE, places, places)
    drift = Drift(np.zeros((0, 0, 0, 6)), 1.0, 1.0, 1.0)
    return surroundings_of(sea, cells, drift, np.eye(6), np.zeros((2, 6, 6)), 1.0)


def _parts(in_waves: bool) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """Compiled functions of a flight with arguments as they are called with, the loop itself last."""
    around: Around = _in_waves() if in_waves else ()
    near, stage = near_of(around), Stage(*[_REAL] * 5)
    v = Flight(*(_REAL, _WHOLE, _REAL, _WHOLE, _REAL, _WHOLE), _REAL, _REAL, _REAL, _WHOLE, stage, Sample(*[_REAL] * 4))
    apart = (
        (past, (v.g, v.q, v.f, v.j, v.y, 0.0)),
        (move_actuators, (v.g, v.q, v.f, v.c, 0.0, v.c)),
        (command_boat, (v.g, v.q, v.f, v.j, v.y, v.y, 0.0)),
        (watch, (v.g, v.q, v.f, v.j, v.y, v.y, 0.0)),
    )
    rates = (
        (fill_rate, (v.m, v.w, v.y, v.c, near, v.s, v.k, v.y)),
        (step, (v.m, v.w, v.y, v.c, v.c, 0.0, near, v.s, v.k, stage, BEGUN, v.y)),
    )
    if in_waves:
        yield advance, (around.sea, v.y, 0.0, around.sums)
    # In calm water the other process begins with the right-hand side, for the equilibrium.
    yield from (*rates, *apart) if in_waves else (*apart, *rates)
    yield integrate, (v, around, Log(_TABLE, _TABLE, _TABLE), 0.0, 0, 0, BEGUN, 0.0)


def is_compiled(in_waves: bool) -> bool:
    """Whether the loop of a flight is kept already, in calm water or in waves."""
    *_, (loop, arguments) = _parts(in_waves)
    return compiled.is_kept(loop, *arguments)


def compile_loop(in_waves: bool) -> None:
    """Compile the loop of a flight and what it calls, in calm water or in waves, and keep it."""
    for function, arguments in _parts(in_waves):
        compiled.compile_for(function, *arguments)
