"""Many boats of one kind moved side by side, in calm water or in waves: the loop of a plant over all of them."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.boat.coefficients import Coefficients
from sim.compiled import outer
from sim.flight import maneuver, orders
from sim.flight.case import Case
from sim.flight.simulate import begun, model_of, water_of
from sim.kernel.layout import Around, Model, workspace
from sim.waves.in_waves import Water, phases_of, surroundings, with_phases
from sim.waves.shared import kept_size, put_in, take_out

Array = NDArray[np.float64]


class Boats(NamedTuple):
    """What each boat of a fleet has of its own: (n, ...) commands, state, controls, sums and phases of waves, time."""

    f: Array
    y: Array
    c: Array
    kept: Array
    phases: Array
    time: Array


@outer
def hold_each(
    v: maneuver.Flight, around: Around, boats: Boats, rate: Array, dt: float, steps: int, first: int, last: int
) -> None:
    """``sim.flight.maneuver.hold`` for boats ``first`` to ``last``.

    Parameters
    ----------
    v, around, rate : Of the thread.
    boats : One whose state has left the finite numbers is left alone.
    """
    for i in range(first, last):
        if not maneuver.is_finite(boats.y[i]):
            continue
        put_in(around, boats.kept[i], boats.phases[i])
        one = maneuver.Flight(v.m, v.w, v.g, v.q, boats.f[i], v.j, boats.y[i], boats.c[i], v.s, v.k, v.stage, v.sample)
        boats.time[i] = maneuver.hold(one, around, rate, dt, steps, boats.time[i])
        take_out(around, boats.kept[i])


@dataclass(frozen=True)
class _Desk:
    """Scratch of one thread: a flight whose commands, state and controls are those of no boat, and its surroundings."""

    flight: maneuver.Flight
    around: Around
    rate: Array


def _desk(model: Model, settings: orders.Settings, start: Array, controls: Array, water: Water | None) -> _Desk:
    own = with_phases(water, water.sea.waves.phase.copy()) if water else None
    around = surroundings(own, model.added_mass) if own else ()
    flight = maneuver.flight_of(model, settings, workspace(model, around), start.copy(), controls.copy())
    return _Desk(flight, around, np.zeros(controls.size))


def _kept(around: Around, count: int) -> Array:
    """(count, k) what each boat has of its own in surroundings that are as they begin."""
    first = np.zeros(kept_size(around))
    if len(around):
        take_out(around, first)
    return np.tile(first, (count, 1))


class FleetPlant:
    """Boats of one case that move by your commands, all at once, over all cores.

    Each steps as a ``sim.flight.plant.Plant`` does, to the last digit, in the waves of the case or in the same sea with
    phases of its own.

    Parameters
    ----------
    case : Initial state, water, waves, step; its own control is left out.
    coefficients : Of the vehicle.
    count : Boats.

    Attributes
    ----------
    dt : Control sample [s]. start : (12,) state at the start.
    state, controls : (count, 12), (count, planes + 1), SI and radians.
    time : (count,) of each boat since its reset [s]; not a number for one whose state left the finite numbers.
    commands : (count, 5) dV, dH [rad], n [1/s], and what tanks have; change it in place.
    phases : (count, components) of the waves each boat is in [rad]; ``reset`` changes them.

    Raises
    ------
    InputError
        As ``sim.flight.simulate.model_of`` and ``water_of``.
    """

    def __init__(self, case: Case, coefficients: Coefficients, count: int) -> None:
        self.vehicle, self.dt = coefficients.vehicle, case.run.step_s
        water = water_of(case, coefficients)
        model, self.start, controls, trim, settings = begun(case, self.vehicle, model_of(case, coefficients))
        self._limits = settings.n_limit
        level = (trim.dV, trim.dH) if trim else (0.0, 0.0)
        self._moved, planes = controls, len(self.vehicle.planes)
        self._level = np.zeros(orders.N_COMMANDS)
        self._level[: 3 + controls.size - planes - 1] = *level, *controls[planes:]
        self.state = np.tile(self.start, (count, 1))
        self.controls = np.tile(controls, (count, 1))
        self.commands = np.tile(self._level, (count, 1))
        self.time = np.zeros(count)
        self._given = np.tile(orders.progress(settings, self.start).f, (count, 1))
        self._threads = max(1, min(os.cpu_count() or 1, count))
        self._pool = ThreadPoolExecutor(self._threads)
        self._desks = [_desk(model, settings, self.start, controls, water) for _ in range(self._threads)]
        self._water = water
        self.phases = np.tile(water.sea.waves.phase if water else np.zeros(0), (count, 1))
        self._kept = _kept(self._desks[0].around, count)
        self._untouched = self._kept[0].copy()

    def reset(self, which: NDArray[np.bool_] | None = None, phases: ArrayLike | None = None) -> None:
        """Back to the start, all or those that are true in a (count,) mask.

        Parameters
        ----------
        phases : (components,) or (those boats, components) of the waves from now on [rad]; as they are when None.

        Raises
        ------
        InputError
            For phases of another number, that are not finite, or in calm water.
        """
        some = np.ones(len(self.state), dtype=bool) if which is None else which
        if phases is not None:
            self.phases[some] = phases_of(self._water, phases, int(some.sum()))
        self.state[some], self.controls[some], self.commands[some] = self.start, self._moved, self._level
        self.time[some], self._kept[some] = 0.0, self._untouched

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
        boats = Boats(self._given, self.state, self.controls, self._kept, self.phases, self.time)
        hold_each(desk.flight, desk.around, boats, desk.rate, self.dt, steps, int(first), int(last))
