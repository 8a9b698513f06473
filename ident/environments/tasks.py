"""What a boat is to do in an environment: what it observes, and what counts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.flight.guidance import LineOfSight

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

# States that are observed as they are, then what each task adds.
_OBSERVED = ("u", "v", "w", "p", "q", "r", "phi", "theta")
# What a step of a zigzag costs, beside a leg done, which is worth one.
_STEP = 0.01
_PLACES = (0, 1, 2, 3, 4, 5, 9, 10)


@dataclass(frozen=True)
class Goal:
    """Numbers of a task.

    Attributes
    ----------
    length : Of the boat [m], by which distances count.
    check : Heading at which a zigzag reverses [rad]. legs : Of a zigzag, after which it is done.
    path : Corners, north and east [m]. ahead : How far along it is looked [m].
    effort : What deflections cost beside errors.
    """

    length: float
    check: float = math.radians(20.0)
    legs: int = 5
    path: tuple[tuple[float, float], ...] = ()
    ahead: float = 200.0
    effort: float = 0.1


class Task:
    """Depth, course: keep what the boat starts with. Over (n, 12) states.

    Errors of depth count by the boat's length, errors of heading by ``check``; a reward is minus the
    square of the errors, less effort times the square of the deflections over their limits.

    Parameters
    ----------
    goal : Numbers. start : (12,) state to keep. count : Boats.
    """

    observed: tuple[str, ...] = (*_OBSERVED, "depth_error", "heading_error")
    _weights = (1.0, 0.0)

    def __init__(self, goal: Goal, start: Array, count: int) -> None:
        self.goal, self.start, self.count = goal, start, count
        self.reset(np.ones(count, dtype=bool))

    def reset(self, which: Flags) -> None:
        """Begin anew for some boats."""

    def _errors(self, state: Array) -> tuple[Array, Array]:
        turned = state[:, 11] - self.start[11]
        return state[:, 8] - self.start[8], np.remainder(turned + np.pi, 2.0 * np.pi) - np.pi

    def observe(self, state: Array) -> Array:
        """(n, k) what is observed, SI and radians."""
        depth, heading = self._errors(state)
        return np.column_stack([state[:, _PLACES], depth, heading])

    def judge(self, state: Array, share: Array) -> tuple[Array, Flags]:
        """Reward of a step, and whether the boat is done.

        Parameters
        ----------
        state : (n, 12) after the step. share : (n, 2) deflections commanded over their limits.
        """
        depth, heading = self._errors(state)
        by_depth, by_heading = self._weights
        cost = by_depth * (depth / self.goal.length) ** 2 + by_heading * (heading / self.goal.check) ** 2
        return -cost - self._effort(share), self._lost(state)

    def _effort(self, share: Array) -> Array:
        return np.asarray(self.goal.effort * (share**2).sum(axis=1))

    def _lost(self, state: Array) -> Flags:
        """Where there is nothing to keep any more: no finite state, or lengths away from the depth."""
        gone = np.abs(state[:, 8] - self.start[8]) > self.goal.length
        return np.asarray(~np.isfinite(state).all(axis=1) | gone)


class DepthKeeping(Task):
    """Keep the depth, with the heading free to count little."""

    _weights = (1.0, 0.1)


class CourseKeeping(Task):
    """Keep the heading, and not lose the depth."""

    _weights = (0.1, 1.0)


class Zigzag(Task):
    """Reverse the heading between plus and minus the check angle, ``legs`` times, in as few steps as can be."""

    observed = (*Task.observed, "sense")

    def reset(self, which: Flags) -> None:
        """Begin anew: the first leg is to port, as ITTC's."""
        if not hasattr(self, "sense"):
            self.sense, self.done = np.full(self.count, -1.0), np.zeros(self.count, dtype=int)
        self.sense[which], self.done[which] = -1.0, 0

    def observe(self, state: Array) -> Array:
        """With the sense of the present leg."""
        return np.column_stack([super().observe(state), self.sense])

    def judge(self, state: Array, share: Array) -> tuple[Array, Flags]:
        """A leg done is worth one; every step costs ``_STEP``, and errors of depth and effort as elsewhere."""
        depth, heading = self._errors(state)
        passed = self.sense * heading >= self.goal.check
        self.done[passed] += 1
        self.sense[passed] *= -1.0
        reward = np.where(passed, 1.0, 0.0) - (depth / self.goal.length) ** 2 - self._effort(share) - _STEP
        return reward, np.asarray((self.done >= self.goal.legs) | self._lost(state))


class PathFollowing(Task):
    """Follow a path of straight legs at the depth of the start."""

    observed = (*Task.observed, "offset", "wanted_yaw_rate")

    def __init__(self, goal: Goal, start: Array, count: int) -> None:
        here = start[6:8]
        path = np.array(goal.path or [(0.0, 0.0), (10 * goal.length, 0.0), (20 * goal.length, 5 * goal.length)])
        self.path = LineOfSight(here + path, goal.ahead)
        super().__init__(goal, start, count)

    def observe(self, state: Array) -> Array:
        """With the distance from the path and the yaw rate that line of sight asks for."""
        return np.column_stack([super().observe(state), self.path.offset(state), self.path.yaw_rate(state)])

    def judge(self, state: Array, share: Array) -> tuple[Array, Flags]:
        """Square of the offset over the length, and of the depth's."""
        depth, _ = self._errors(state)
        cost = (self.path.offset(state) / self.goal.length) ** 2 + (depth / self.goal.length) ** 2
        return -cost - self._effort(share), self._lost(state)


TASKS: dict[str, type[Task]] = {t.__name__: t for t in (DepthKeeping, CourseKeeping, Zigzag, PathFollowing)}
