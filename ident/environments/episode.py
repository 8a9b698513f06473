"""What every episode of an environment has in common: boat, case, times, numbers of the task."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypedDict, cast

import numpy as np
from numpy.typing import NDArray

from ident.environments.tasks import Goal
from sim.boat.coefficients import Coefficients
from sim.boat.database import read_rows
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.flight.case import Case, load_case
from sim.flight.simulate import waves_of


class Options(TypedDict, total=False):
    """What an environment may be asked beside task and case.

    Attributes
    ----------
    db, version : Database, ``coeff_db`` by default, and version, latest when None.
    vehicle : Instead of the case's.
    period : Time between actions [s], the case's step when None.
    duration : After which an episode is truncated [s], the case's when None.
    spread : Standard deviation of the start: pitch and heading [rad], by the seed; none when zero.
    sea : ``case``, the waves of the case in every episode; ``drawn``, the same sea at another moment in each, with
        phases of its components drawn by the seed.
    check, legs, path, ahead, effort : Of the task, ``ident.environments.tasks.Goal``.
    """

    db: str | os.PathLike[str]
    version: int | None
    vehicle: str | None
    period: float | None
    duration: float | None
    spread: float
    sea: Literal["case", "drawn"]
    check: float
    legs: int
    path: Sequence[Sequence[float]]
    ahead: float
    effort: float


@dataclass(frozen=True)
class Episode:
    """A task of a boat in a case.

    Attributes
    ----------
    case, coefficients : What is flown.
    steps : Control samples between actions.
    duration : After which an episode is truncated [s].
    spread : Standard deviation of pitch and heading at the start [rad].
    drawn : Components whose phases are drawn for an episode; none when the sea is the case's.
    goal : Numbers of the task.
    """

    case: Case
    coefficients: Coefficients
    steps: int
    duration: float
    spread: float
    drawn: int
    goal: Goal

    def phases(self, draw: np.random.Generator, boats: int | None = None) -> NDArray[np.float64] | None:
        """(components,), or (boats, components), of the waves of an episode [rad]; None for those there are."""
        if not self.drawn:
            return None
        return draw.uniform(0.0, 2.0 * np.pi, self.drawn if boats is None else (boats, self.drawn))


def _drawn(sea: str, case: Case) -> int:
    """Components whose phases are drawn."""
    if sea not in ("case", "drawn"):
        raise InputError("environment, sea", repr(sea), "case, drawn")
    count = int(waves_of(case).amplitude.size) if sea == "drawn" else 0
    if sea == "drawn" and not count:
        raise InputError("environment, sea", "drawn, in calm water", "a case with waves")
    return count


def _goal(vehicle: Vehicle, numbers: dict[str, Any]) -> Goal:
    known = sorted(set(Goal.__dataclass_fields__) - {"length"})
    for name in numbers:
        if name not in known:
            raise InputError(f"environment, {name}", "no such number of a task", ", ".join(known))
    if "path" in numbers:
        numbers = numbers | {"path": tuple(map(tuple, numbers["path"]))}
    return Goal(length=vehicle.particulars.length.value, **numbers)


def _steps(period: float, case: Case) -> int:
    steps = round(period / case.run.step_s)
    if steps < 1 or abs(steps * case.run.step_s - period) > 1e-9:
        allowed = f"a multiple of the case's step, {case.run.step_s:g} s"
        raise InputError("environment, period", f"{period:g} s", allowed)
    return steps


def episode(case: str | os.PathLike[str], options: Options) -> Episode:
    """The episodes that an environment was asked for.

    Raises
    ------
    InputError
        For what does not exist or fit, a number that no task has, a time between actions that is no multiple of
        the case's step, or a sea to be drawn where there are no waves.
    """
    asked = cast("dict[str, Any]", dict(options))
    db, version, vehicle = asked.pop("db", "coeff_db"), asked.pop("version", None), asked.pop("vehicle", None)
    period, duration, spread = asked.pop("period", None), asked.pop("duration", None), asked.pop("spread", 0.0)
    sea = asked.pop("sea", "case")
    data, where = load_case(os.fspath(case))
    boat = load_vehicle(vehicle) if vehicle is not None else load_vehicle(data.vehicle, beside=where)
    return Episode(
        case=data,
        coefficients=Coefficients(boat, read_rows(os.fspath(db), version, boat.name)[0]),
        steps=_steps(period if period is not None else data.run.step_s, data),
        duration=duration or data.run.duration_s,
        spread=spread,
        drawn=_drawn(sea, data),
        goal=_goal(boat, asked),
    )
