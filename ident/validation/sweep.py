"""Self-propulsion solved over the speeds and depths of a case."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from ident.metrics.metric import Metric, Metrics
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


@dataclass(frozen=True)
class SweepPoint:
    """Self-propulsion at one speed and depth of a sweep; None where there is none.

    Attributes
    ----------
    speed_mps, depth_m : U [m/s], D0 [m].
    n_rps : Revolutions [1/s].
    pitch_deg, heel_deg : theta, phi [deg].
    dV_deg, dH_deg : Commands [deg].
    ballast_kg, trim_tank_m : Ballast [kg], shift of the centre of gravity [m].
    limited : Actuators at their limit.
    reason : Why there is none.

    Examples
    --------
    >>> import ident
    >>> ident.SweepPoint(speed_mps=2.0, depth_m=20.0, reason="no equilibrium").n_rps is None
    True
    """

    speed_mps: float
    depth_m: float
    n_rps: float | None = None
    pitch_deg: float | None = None
    heel_deg: float | None = None
    dV_deg: float | None = None
    dH_deg: float | None = None
    ballast_kg: float | None = None
    trim_tank_m: float | None = None
    limited: list[str] = field(default_factory=list)
    reason: str | None = None


def _solved(case: Case, vehicle: Vehicle, model: Model, speed: float, depth: float) -> SweepPoint:
    initial = case.initial.model_copy(update={"speed_mps": speed, "depth_m": depth})
    try:
        _, controls, trim = initial_state(case.model_copy(update={"initial": initial}), vehicle, model)
    except NoEquilibrium as error:
        return SweepPoint(speed, depth, reason=str(error))
    assert trim is not None
    revolutions, *tanks = (float(value) for value in controls[len(vehicle.planes) :])
    ballast, trim_tank = tanks or (0.0, 0.0)
    pitch, heel, dv, dh = (float(value) for value in np.degrees([trim.state[10], trim.state[9], trim.dV, trim.dH]))
    return SweepPoint(speed, depth, revolutions, pitch, heel, dv, dh, ballast, trim_tank, list(trim.limited))


def _named(point: SweepPoint) -> str:
    return f"n_rps_{point.speed_mps:.4g}mps_{point.depth_m:g}m"


def _grid(case: Case, vehicle: Vehicle, model: Model) -> list[SweepPoint]:
    """Self-propulsion at every speed and depth of a sweep."""
    assert case.sweep is not None
    return [_solved(case, vehicle, model, u, d) for u in case.sweep.speed_mps for d in case.sweep.depth_m]


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
    metrics = []
    for of_sample, values in zip(bands.metrics, bands.values(rows), strict=True):
        grid = _grid(case, vehicle, equipped(case, vehicle, assembly.model(values)))
        metrics.append(dict(of_sample) | {_named(point): point.n_rps for point in grid})
    return replace(bands, metrics=tuple(metrics))


def with_grid(case: Case, vehicle: Vehicle, model: Model, metrics: Metrics) -> tuple[list[SweepPoint] | None, Metrics]:
    """The grid of a sweep, None without one, and the metrics with its revolutions."""
    if case.sweep is None:
        return None, metrics
    grid = _grid(case, vehicle, model)
    labels = {label: None for metric in metrics.values() for label in metric} | {"simulated": None}
    solved = {}
    for point in grid:
        known = metrics[_named(point)].columns if _named(point) in metrics else {}
        solved[_named(point)] = Metric(labels | known | {"simulated": point.n_rps})
    return grid, metrics | solved
