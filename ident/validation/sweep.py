"""Self-propulsion solved over the speeds and depths of a case."""

from __future__ import annotations

from typing import Any

import numpy as np

from sim.boat.vehicle import Vehicle
from sim.flight.case import Case
from sim.flight.simulate import initial_state
from sim.flight.trim import NoEquilibrium
from sim.kernel.layout import Model


def _grid(case: Case, vehicle: Vehicle, model: Model) -> list[dict[str, Any]]:
    """Self-propulsion at every speed and depth of a sweep; ``reason`` where there is none."""
    found: list[dict[str, Any]] = []
    names = ("n_rps", "pitch_deg", "heel_deg", "dV_deg", "dH_deg", "ballast_kg", "trim_tank_m")
    assert case.sweep is not None
    for speed in case.sweep.speed_mps:
        for depth in case.sweep.depth_m:
            initial = case.initial.model_copy(update={"speed_mps": speed, "depth_m": depth})
            entry: dict[str, Any] = {"speed_mps": speed, "depth_m": depth} | dict.fromkeys(names)
            try:
                _, controls, trim = initial_state(case.model_copy(update={"initial": initial}), vehicle, model)
            except NoEquilibrium as error:
                found.append(entry | {"limited": [], "reason": str(error)})
                continue
            assert trim is not None
            tanks = controls[len(vehicle.planes) + 1 :]
            angles = np.degrees([trim.state[10], trim.state[9], trim.dV, trim.dH])
            values = [controls[len(vehicle.planes)], *angles, *(tanks if len(tanks) else (0.0, 0.0))]
            entry |= {k: float(v) for k, v in zip(names, values, strict=True)}
            found.append(entry | {"limited": list(trim.limited), "reason": None})
    return found


def with_grid(case: Case, vehicle: Vehicle, model: Model, metrics: dict[str, Any]) -> dict[str, Any]:
    """The grid of a sweep for the result; its revolutions are added to ``metrics``."""
    if case.sweep is None:
        return {}
    grid = _grid(case, vehicle, model)
    labels = {label: None for columns in metrics.values() for label in columns} | {"simulated": None}
    for point in grid:
        name = f"n_rps_{point['speed_mps']:.4g}mps_{point['depth_m']:g}m"
        metrics[name] = labels | metrics.get(name, {}) | {"simulated": point["n_rps"]}
    return {"grid": grid}
