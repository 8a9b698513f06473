"""Many boats of one kind moved side by side, in deep, calm water: the loop of a plant over all of them."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.boat.coefficients import Coefficients
from sim.compiled import outer
from sim.files.errors import InputError
from sim.flight import maneuver, orders
from sim.flight.case import Case
from sim.flight.simulate import begun, model_of, water_of
from sim.kernel.layout import workspace

Array = NDArray[np.float64]


@outer
def hold_each(
    v: maneuver.Flight,
    f: np.ndarray,
    y: np.ndarray,
    c: np.ndarray,
    rate: np.ndarray,
    dt: float,
    steps: int,
    first: int,
    last: int,
) -> None:
    """``sim.flight.maneuver.hold`` for boats ``first`` to ``last`` of (n, ...) commands, states and controls."""
    for i in range(first, last):
        one = maneuver.Flight(v.m, v.w, v.g, v.q, f[i], v.j, y[i], c[i], v.s, v.k, v.stage)
        maneuver.hold(one, (), rate, dt, steps, 0.0)


class _Desk(NamedTuple):
    """Scratch of one thread: a flight whose commands, state and controls are those of no boat."""

    flight: maneuver.Flight
    rate: Array


class FleetPlant:
    """Boats of one case that move by your commands, all at once, over all cores.

    Each steps as a ``sim.flight.plant.Plant`` does, to the last digit.

    Parameters
    ----------
    case : Initial state, water, step; its own control is left out.
    coefficients : Of the vehicle.
    count : Boats.

    Attributes
    ----------
    dt : Control sample [s]. start : (12,) state at the start.
    state, controls : (count, 12), (count, planes + 1), SI and radians.
    commands : (count, 5) dV, dH [rad], n [1/s], and what tanks have; change it in place.

    Raises
    ------
    InputError
        In waves or near the surface, which take a boat's own sums: use several ``Plant`` there.
    """

    def __init__(self, case: Case, coefficients: Coefficients, count: int) -> None:
        self.vehicle, self.dt = coefficients.vehicle, case.run.step_s
        if water_of(case, coefficients) is not None:
            raise InputError(
                f"case {case.name}", "waves, or a surface in reach", "deep, calm water for many boats at once"
            )
        model, self.start, controls, trim, settings = begun(case, self.vehicle, model_of(case, coefficients))
        self._limits = settings.n_limit
        level = (trim.dV, trim.dH) if trim else (0.0, 0.0)
        self._moved, planes = controls, len(self.vehicle.planes)
        self._level = np.zeros(orders.N_COMMANDS)
        self._level[: 3 + controls.size - planes - 1] = *level, *controls[planes:]
        self.state = np.tile(self.start, (count, 1))
        self.controls = np.tile(controls, (count, 1))
        self.commands = np.tile(self._level, (count, 1))
        self._given = np.tile(orders.progress(settings, self.start).f, (count, 1))
        self._threads = max(1, min(os.cpu_count() or 1, count))
        self._pool = ThreadPoolExecutor(self._threads)
        self._desks = [
            _Desk(
                maneuver.flight_of(model, settings, workspace(model), self.start.copy(), controls.copy()),
                np.zeros(controls.size),
            )
            for _ in range(self._threads)
        ]

    def reset(self, which: NDArray[np.bool_] | None = None) -> None:
        """Back to the start, all or those that are true in a (count,) mask."""
        some = np.ones(len(self.state), dtype=bool) if which is None else which
        self.state[some], self.controls[some], self.commands[some] = self.start, self._moved, self._level

    def step(self, steps: int = 1) -> Array:
        """Move every boat on by control samples; states that left the finite numbers stay so.

        Returns
        -------
        (count, 12) the states, not a copy.
        """
        at = slice(orders.COMMAND, orders.COMMAND + orders.N_COMMANDS)
        self._given[:, at] = self.commands
        revolutions = self._given[:, orders.COMMAND + orders.REVOLUTIONS]
        np.clip(revolutions, *self._limits, out=revolutions)
        ends = np.linspace(0, len(self.state), self._threads + 1).astype(int)
        some = zip(self._desks, ends[:-1], ends[1:], strict=True)
        list(self._pool.map(lambda one: self._move(steps, *one), some))
        return self.state

    def _move(self, steps: int, desk: _Desk, first: int, last: int) -> None:
        boats = (self._given, self.state, self.controls)
        hold_each(desk.flight, *boats, desk.rate, self.dt, steps, int(first), int(last))
