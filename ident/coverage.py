"""How long a flight used each term beyond the data it was identified from."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.coefficients import Coefficient, Coefficients
from sim.forces import boat_features, plane_features
from sim.simulate import Simulation

Array = NDArray[np.float64]
Features = dict[str, float]
# Samples of a record that are looked at: enough for a share of time.
_COVERAGE_SAMPLES = 200


def _states(simulation: Simulation, coefficients: Coefficients) -> list[tuple[Features, dict[str, Features]]]:
    """Boat features, and features by plane, at evenly spread samples of a record."""
    chosen = np.unique(np.linspace(0, len(simulation.record) - 1, _COVERAGE_SAMPLES).astype(int))
    found: list[tuple[Features, dict[str, Features]]] = []
    columns = {c: simulation.record[chosen, i] for i, c in enumerate(simulation.columns)}
    wake = coefficients.get("w_T")
    factor = 1.0 - (float(wake.values[0]) if wake else 0.0)
    vehicle = coefficients.vehicle
    for i in range(len(chosen)):
        velocity = [columns[c][i] for c in "uvw"]
        rates = [columns[c][i] for c in "pqr"]
        n = columns["n"][i]
        advance = factor * velocity[0] / (n * vehicle.propeller.diameter.value) if n else 0.0
        boat = boat_features(velocity, rates, columns["z"][i] + simulation.depth_offset, n, advance)
        planes = {p.name: plane_features(p, velocity, rates, columns[p.name][i]) for p in vehicle.planes}
        found.append((boat, planes))
    return found


def outside_tables(
    simulation: Simulation, coefficients: Coefficients
) -> tuple[list[dict[str, Any]], dict[str, list[str]]]:
    """Share of time each term was used beyond its data, and its one-valued axes."""
    states = _states(simulation, coefficients)
    found: list[dict[str, Any]] = []
    constant: dict[str, list[str]] = {}
    for coefficient in coefficients:
        term, table = coefficient.term, coefficient.table
        if term.is_acceleration or not term.axes:
            continue
        points = np.array(
            [[{**boat, **planes.get(coefficient.part, {})}[a] for a in term.axes] for boat, planes in states]
        )
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
    share = float(np.mean([coefficient.table.covered(x) < 0.5 for x in points]))
    return [{"term": coefficient.term.name, "axis": "alpha x beta", "fraction_of_time": share}] if share else []
