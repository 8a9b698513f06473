"""Thousands of boats of one case at once, calm or in waves, as a Gymnasium vector environment."""

from __future__ import annotations

import os
from typing import Any, Unpack

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ident.environments.boat import action_space
from ident.environments.episode import Options, episode
from ident.environments.tasks import TASKS
from sim.flight.fleet import FleetPlant

Array = NDArray[np.float64]


class FleetEnv(VectorEnv[Array, Array, Any]):
    """``BoatEnv`` many times, over the compiled loop and all cores; parameters as there.

    A boat that is done starts anew with the next step, whose reward is zero (``AutoresetMode.NEXT_STEP``).

    Parameters
    ----------
    num_envs : Boats.

    Raises
    ------
    InputError
        As ``BoatEnv``.
    """

    def __init__(
        self,
        num_envs: int = 1,
        task: str = "DepthKeeping",
        case: str | os.PathLike[str] = "ss5-4m",
        **options: Unpack[Options],
    ) -> None:
        self._episode = episode(case, options)
        self.num_envs, self.plant = num_envs, FleetPlant(self._episode.case, self._episode.coefficients, num_envs)
        boat = self.plant.vehicle
        self.task = TASKS[task](self._episode.goal, self.plant.start, num_envs)
        self.single_action_space = self._box = action_space(boat)
        shape = (len(self.task.observed),)
        self.single_observation_space = spaces.Box(-np.inf, np.inf, shape, np.float64)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}
        self._over = np.zeros(num_envs, dtype=bool)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """All back to the start of the case, spread, and its seas drawn, by the seed."""
        super().reset(seed=seed)
        self._begin(np.ones(self.num_envs, dtype=bool))
        return self.task.observe(self.plant.state), {}

    def _begin(self, which: NDArray[np.bool_]) -> None:
        self.plant.reset(which, self._episode.phases(self.np_random, int(which.sum())))
        if self._episode.spread and which.any():
            self.plant.state[which, 10:12] += self._episode.spread * self.np_random.standard_normal(
                (int(which.sum()), 2)
            )
        self.task.reset(which)
        self._over[which] = False

    def step(self, actions: Array) -> tuple[Array, Any, Any, Any, dict[str, Any]]:
        """Command dV and dH of every boat for a period."""
        box = self._box
        again = self._over.copy()
        given = np.clip(np.asarray(actions, dtype=float), box.low, box.high)
        self.plant.commands[:, :2] = given
        self.plant.step(self._episode.steps)
        reward, done = self.task.judge(self.plant.state, given / box.high)
        lost = ~np.isfinite(self.plant.state).all(axis=1)
        ended = self.plant.time >= self._episode.duration - 1e-9
        reward[lost | again], done[again], ended[again] = 0.0, False, False
        self._begin(again | lost)
        self._over = done | ended
        return self.task.observe(self.plant.state), reward, done, np.asarray(ended), {}
