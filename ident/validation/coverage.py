"""How long a flight used each term beyond the data it was identified from."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import feature_index
from sim.boat.coefficients import Coefficient, Coefficients
from sim.flight.simulate import Simulation
from sim.kernel import rhs as kernel
from sim.kernel.layout import Model, workspace

Array = NDArray[np.float64]
# Samples of a record that are looked at: enough for a share of time.
_COVERAGE_SAMPLES = 200


def _features(simulation: Simulation, model: Model) -> Array:
    """(samples, features) of the kernel at evenly spread samples of a record."""
    chosen = np.unique(np.linspace(0, len(simulation.record) - 1, _COVERAGE_SAMPLES).astype(int))
    # Columns: t, states, controls, the two commands.
    record = np.ascontiguousarray(simulation.record[chosen])
    work = workspace(model)
    found = np.empty((len(chosen), work.features.size))
    for row, sample in zip(found, record, strict=True):
        kernel.features(model, sample[1:13], sample[13:-2], work)
        row[:] = work.features
    return found


def outside_tables(
    simulation: Simulation, coefficients: Coefficients, model: Model
) -> tuple[list[dict[str, Any]], dict[str, list[str]]]:
    """Share of time each term was used beyond its data, and its one-valued axes.

    Parameters
    ----------
    simulation, coefficients, model : A flight, and what was flown.

    Returns
    -------
    found : ``term``, ``axis`` and ``fraction_of_time``, one entry a term and axis.
    constant : Term -> axes along which it was measured at one value only.
    """
    features = _features(simulation, model)
    planes = [p.name for p in coefficients.vehicle.planes]
    found: list[dict[str, Any]] = []
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
                found.append({"term": term.name, "axis": axis, "fraction_of_time": share})
        found += _combined(coefficient, points)
    return found, constant


def _combined(coefficient: Coefficient, points: Array) -> list[dict[str, Any]]:
    """Share of time at flow angles of which no run has both."""
    axes = coefficient.term.axes
    if not {"alpha", "beta"} <= set(axes) or coefficient.table.measured.all():
        return []
    varied = [a for a in ("alpha", "beta") if coefficient.table.range(a)[0] < coefficient.table.range(a)[1]]
    if len(varied) < 2:
        return []
    share = float(np.mean(coefficient.table.covered(points) < 0.5))
    return [{"term": coefficient.term.name, "axis": "alpha x beta", "fraction_of_time": share}] if share else []
