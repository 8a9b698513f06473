"""What a flight used of the tables: the values behind it, and how long each term beyond its data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import feature_index
from sim.boat.coefficients import Coefficient, Coefficients
from sim.flight.maneuver import COMMANDED, CONTROLS, STATE
from sim.flight.simulation import Simulation
from sim.kernel import rhs as kernel
from sim.kernel.layout import Model, workspace

Array = NDArray[np.float64]
# Samples of a record that are looked at: enough for a share of time.
_COVERAGE_SAMPLES = 200
# Those at which the rows behind a flight are looked up: neighbours in time use the same ones.
_ROW_SAMPLES = 40


@dataclass(frozen=True)
class OutsideUse:
    """Use of a term beyond the data it was identified from.

    Attributes
    ----------
    term, axis : Which term, along which axis; ``alpha x beta`` where no run has both angles.
    fraction_of_time : Share of the flight, 0 to 1.

    Examples
    --------
    >>> import ident
    >>> done = ident.validate("my-boat/zigzag.toml", db="coeff_db", version=0)
    >>> all(0.0 <= use.fraction_of_time <= 1.0 for use in done.outside_tables)
    True
    """

    term: str
    axis: str
    fraction_of_time: float


def _features(simulation: Simulation, model: Model, samples: int = _COVERAGE_SAMPLES) -> Array:
    """(samples, features) of the kernel at evenly spread samples of a record."""
    chosen = np.unique(np.linspace(0, len(simulation.record) - 1, samples).astype(int))
    record = np.ascontiguousarray(simulation.record[chosen])
    work = workspace(model)
    features = np.empty((len(chosen), work.features.size))
    for row, sample in zip(features, record, strict=True):
        kernel.features(model, sample[STATE:CONTROLS], sample[CONTROLS:-COMMANDED], work)
        row[:] = work.features
    return features


def used_rows(simulation: Simulation, coefficients: Coefficients, model: Model) -> dict[str, list[int]]:
    """Which tabulated values a flight was computed from.

    Parameters
    ----------
    simulation, coefficients, model : A flight, and what was flown.

    Returns
    -------
    Term -> places among the version's rows of the vehicle, in their order, that had a weight in its tables at one of
    40 instants spread over the flight.
    """
    features = _features(simulation, model, _ROW_SAMPLES)
    planes = [p.name for p in coefficients.vehicle.planes]
    used: dict[str, set[int]] = {}
    for coefficient in coefficients:
        term = coefficient.term
        places = coefficients.places[term.name, coefficient.part]
        chosen = np.ones(len(places), dtype=bool)
        if term.axes and not term.is_acceleration:
            plane = planes.index(coefficient.part) if coefficient.part in planes else -1
            points = np.unique(features[:, [feature_index(a, plane) for a in term.axes]], axis=0)
            chosen = np.max([np.abs(coefficient.table.weights(p.tolist())) for p in points], axis=0) > 0.0
        used.setdefault(term.name, set()).update(places[chosen].tolist())
    return {name: sorted(places) for name, places in used.items()}


def outside_tables(
    simulation: Simulation, coefficients: Coefficients, model: Model
) -> tuple[list[OutsideUse], dict[str, list[str]]]:
    """Share of time each term was used beyond its data, and its one-valued axes.

    Parameters
    ----------
    simulation, coefficients, model : A flight, and what was flown.

    Returns
    -------
    outside : One entry a term and axis.
    constant : Term -> axes along which it was measured at one value only.
    """
    features = _features(simulation, model)
    planes = [p.name for p in coefficients.vehicle.planes]
    outside: list[OutsideUse] = []
    constant: dict[str, list[str]] = {}
    for coefficient in coefficients:
        term, table = coefficient.term, coefficient.table
        if term.is_acceleration or not term.axes:
            continue
        plane = planes.index(coefficient.part) if coefficient.part in planes else -1
        points = features[:, [feature_index(a, plane) for a in term.axes]]
        for k, axis in enumerate(term.axes):
            low, high = table.range(axis)
            if low == high and term.extrapolation[axis] != "absent":
                constant.setdefault(term.name, []).append(axis)
                continue
            slack = 1e-9 * max(abs(low), abs(high))
            share = float(np.mean((points[:, k] < low - slack) | (points[:, k] > high + slack)))
            if share > 0.0:
                outside.append(OutsideUse(term.name, axis, share))
        outside += _combined(coefficient, points)
    return outside, constant


def _combined(coefficient: Coefficient, points: Array) -> list[OutsideUse]:
    """Share of time at flow angles of which no run has both."""
    axes = coefficient.term.axes
    if not {"alpha", "beta"} <= set(axes) or coefficient.table.measured.all():
        return []
    varied = [a for a in ("alpha", "beta") if coefficient.table.range(a)[0] < coefficient.table.range(a)[1]]
    if len(varied) < 2:
        return []
    share = float(np.mean(coefficient.table.covered(points) < 0.5))
    return [OutsideUse(coefficient.term.name, "alpha x beta", share)] if share else []
