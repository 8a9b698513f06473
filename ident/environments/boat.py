"""One boat in one case, calm or in waves, as a Gymnasium environment."""

from __future__ import annotations

import os
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ident.environments.tasks import TASKS, Goal
from sim.boat.coefficients import Coefficients
from sim.boat.database import read_rows
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.flight.case import Case, load_case
from sim.flight.plant import Plant
from sim.flight.simulate import plane_limits

Array = NDArray[np.float64]


def setting(
    case: str | os.PathLike[str], db: str | os.PathLike[str], version: int | None, vehicle: str | None
) -> tuple[Case, Coefficients]:
    """Case and coefficients by name. Raises ``InputError`` for what does not exist or fit."""
    data, where = load_case(os.fspath(case))
    boat = load_vehicle(vehicle) if vehicle else load_vehicle(data.vehicle, beside=where)
    return data, Coefficients(boat, read_rows(os.fspath(db), version, boat.name)[0])


def action_space(vehicle: Vehicle) -> spaces.Box:
    """Commands dV and dH [rad], within the largest deflection."""
    limit = float(plane_limits(vehicle)[0].max())
    return spaces.Box(-limit, limit, (2,), np.float64)


def goal_of(vehicle: Vehicle, numbers: dict[str, Any]) -> Goal:
    """The task's numbers. Raises ``InputError`` for one that no task has."""
    known = sorted(set(Goal.__dataclass_fields__) - {"length"})
    for name in numbers:
        if name not in known:
            raise InputError(f"environment, {name}", "no such number of a task", ", ".join(known))
    if "path" in numbers:
        numbers = numbers | {"path": tuple(map(tuple, numbers["path"]))}
    return Goal(length=vehicle.particulars.length.value, **numbers)


def steps_of(period: float, case: Case) -> int:
    """Control samples in the time between actions. Raises ``InputError`` when it is no multiple of one."""
    steps = round(period / case.run.step_s)
    if steps < 1 or abs(steps * case.run.step_s - period) > 1e-9:
        raise InputError(
            "environment, period", f"{period:g} s", f"a multiple of the case's step, {case.run.step_s:g} s"
        )
    return steps


class BoatEnv(gymnasium.Env[Array, Array]):
    """Command the planes of a boat; revolutions stay as they start.

    Parameters
    ----------
    task : ``DepthKeeping``, ``CourseKeeping``, ``Zigzag`` or ``PathFollowing``.
    case : Bundled name or path: boat, water, waves, start and step.
    db, version, vehicle : Database; version, latest when None; vehicle instead of the case's.
    period : Time between actions [s], the case's step when None.
    duration : After which an episode is truncated [s], the case's when None.
    spread : Standard deviation of the start: pitch and heading [rad], by the seed; none when zero.
    numbers : Of the task, ``ident.environments.tasks.Goal``.

    Raises
    ------
    InputError
        For what does not exist or fit.

    Notes
    -----
    Observations: ``u v w p q r phi theta``, errors of depth and heading, and what the task adds
    (``observed``), SI and radians. Actions: dV and dH [rad].
    """

    metadata = {"render_modes": []}  # noqa: RUF012  (as Gymnasium has it)

    def __init__(
        self,
        task: str = "DepthKeeping",
        case: str | os.PathLike[str] = "ss5-4m",
        db: str | os.PathLike[str] = "coeff_db",
        version: int | None = None,
        vehicle: str | None = None,
        period: float | None = None,
        duration: float | None = None,
        spread: float = 0.0,
        **numbers: Any,
    ) -> None:
        data, coefficients = setting(case, db, version, vehicle)
        self.plant = Plant(data, coefficients)
        self._steps = steps_of(period if period is not None else self.plant.dt, data)
        self._duration, self._spread = duration or data.run.duration_s, spread
        boat = self.plant.vehicle
        self.task = TASKS[task](goal_of(boat, numbers), self.plant.state.copy(), 1)
        self.observed = self.task.observed
        self.action_space: spaces.Space[Any] = action_space(boat)
        self._box = action_space(boat)
        self.observation_space = spaces.Box(-np.inf, np.inf, (len(self.observed),), np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Back to the start of the case, spread by the seed; ``options`` may hold a whole ``state``."""
        super().reset(seed=seed)
        state = self.task.start.copy()
        if self._spread:
            state[10:12] += self._spread * self.np_random.standard_normal(2)
        self.plant.reset(state=(options or {}).get("state", state))
        self.task.reset(np.ones(1, dtype=bool))
        return self._observation(), self._said()

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Command dV and dH for a period."""
        box = self._box
        given = np.clip(np.asarray(action, dtype=float), box.low, box.high)
        try:
            self.plant.step(self._steps, dV=given[0], dH=given[1])
        except FloatingPointError:
            return np.zeros(len(self.observed)), 0.0, True, False, {"time": self.plant.time, "finite": False}
        reward, done = self.task.judge(self.plant.state[None], (given / box.high)[None])
        ended = self.plant.time >= self._duration - 1e-9
        return self._observation(), float(reward[0]), bool(done[0]), bool(ended), self._said()

    def _observation(self) -> Array:
        return np.asarray(self.task.observe(self.plant.state[None])[0])

    def _said(self) -> dict[str, Any]:
        return {"time": self.plant.time, "state": self.plant.state.copy(), "controls": self.plant.controls.copy()}
