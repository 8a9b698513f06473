"""Self-propulsion solved over the speeds and depths of a case."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sim.boat.coefficients import Coefficients
from sim.boat.vehicle import Vehicle
from sim.flight.case import Case
from sim.flight.simulate import environment_of, equipped, initial_state
from sim.flight.trim import NoEquilibrium
from sim.kernel.assemble import Assembly
from sim.kernel.layout import Model

if TYPE_CHECKING:
    import pandas as pd

    from ident.validation.bands import Bands


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


def sampled_grid(case: Case, vehicle: Vehicle, rows: pd.DataFrame, bands: Bands) -> Bands:
    """Bands whose metrics have the revolutions of a sweep's grid too; as they are without a sweep.

    Parameters
    ----------
    case, vehicle, rows : What the bands were flown with.
    bands : Of ``ident.validation.bands.fly_samples``.
    """
    if case.sweep is None:
        return bands
    assembly = Assembly(Coefficients(vehicle, rows), environment_of(case))
    found = []
    for own, values in zip(bands.metrics, bands.values(rows), strict=True):
        metrics: dict[str, Any] = {}
        with_grid(case, vehicle, equipped(case, vehicle, assembly.model(values)), metrics)
        found.append(dict(own) | {name: columns["simulated"] for name, columns in metrics.items()})
    return replace(bands, metrics=tuple(found))


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
