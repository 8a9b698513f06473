"""One boat in one case, calm or in waves, as a Gymnasium environment."""

from __future__ import annotations

import os
from typing import Any, Unpack

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ident.environments.episode import Options, episode
from ident.environments.tasks import TASKS
from sim.boat.vehicle import Vehicle
from sim.flight.plant import Plant
from sim.flight.simulate import plane_limits

Array = NDArray[np.float64]


def action_space(vehicle: Vehicle) -> spaces.Box:
    """Commands dV and dH [rad], within the largest deflection."""
    limit = float(plane_limits(vehicle)[0].max())
    return spaces.Box(-limit, limit, (2,), np.float64)


class BoatEnv(gymnasium.Env[Array, Array]):
    """Command the planes of a boat; revolutions stay as they start.

    Parameters
    ----------
    task : ``DepthKeeping``, ``CourseKeeping``, ``Zigzag`` or ``PathFollowing``.
    case : Bundled name or path: boat, water, waves, start and step.
    options : Database, vehicle, times and numbers of the task: ``ident.environments.episode.Options``.

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
        self, task: str = "DepthKeeping", case: str | os.PathLike[str] = "ss5-4m", **options: Unpack[Options]
    ) -> None:
        self._episode = episode(case, options)
        self.plant = Plant(self._episode.case, self._episode.coefficients)
        boat = self.plant.vehicle
        self.task = TASKS[task](self._episode.goal, self.plant.state.copy(), 1)
        self.observed = self.task.observed
        self.action_space: spaces.Space[Any] = action_space(boat)
        self._box = action_space(boat)
        self.observation_space = spaces.Box(-np.inf, np.inf, (len(self.observed),), np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Back to the start of the case, spread, and its sea drawn, by the seed; ``options`` may hold a ``state``."""
        super().reset(seed=seed)
        state = self.task.start.copy()
        if self._episode.spread:
            state[10:12] += self._episode.spread * self.np_random.standard_normal(2)
        phases = self._episode.phases(self.np_random)
        self.plant.reset(state=(options or {}).get("state", state), phases=phases)
        self.task.reset(np.ones(1, dtype=bool))
        return self._observation(), self._said()

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Command dV and dH for a period."""
        box = self._box
        given = np.clip(np.asarray(action, dtype=float), box.low, box.high)
        try:
            self.plant.step(self._episode.steps, dV=given[0], dH=given[1])
        except FloatingPointError:
            return np.zeros(len(self.observed)), 0.0, True, False, {"time": self.plant.time, "finite": False}
        reward, done = self.task.judge(self.plant.state[None], (given / box.high)[None])
        ended = self.plant.time >= self._episode.duration - 1e-9
        return self._observation(), float(reward[0]), bool(done[0]), bool(ended), self._said()

    def _observation(self) -> Array:
        return np.asarray(self.task.observe(self.plant.state[None])[0])

    def _said(self) -> dict[str, Any]:
        return {"time": self.plant.time, "state": self.plant.state.copy(), "controls": self.plant.controls.copy()}
