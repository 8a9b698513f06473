"""Taylor wake fraction from the revolutions at self-propulsion, Eq. (48)."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.identification.solver import Solver

Array = NDArray[np.float64]

# Relative step of the central differences that carry the covariance through Eq. (48).
_STEP = 1e-6


def _resistance(solver: Solver, run: pd.Series) -> dict[int, float] | str:
    """Tabulated values and their factors in -X of hull and undeflected planes."""
    state = run.copy()
    needed: dict[int, float] = {}
    for part in ("hull", *solver.planes):
        state["part"] = part
        features = solver.features(state)
        for term, m in solver.active(state, "X", features):
            row = solver.row(term, part, features)
            if row is None:
                return f"{term.name} is not identified, so the resistance is incomplete"
            for node, weight in row.items():
                needed[node] = needed.get(node, 0.0) - solver.scales[term.name] * m * weight
    return needed


def wake_fraction(solver: Solver, run: pd.Series) -> tuple[float, float, Array] | str:
    """Wake fraction of one self-propulsion run.

    (1-t) KT(J) rho n^2 D^4 balances hull and undeflected planes, and w_T = 1 - J n D / U.

    Parameters
    ----------
    solver : With resistance, planes, KT and t identified.
    run : A self-propulsion run that gives n.

    Returns
    -------
    Value, variance, and covariance with every value found so far; or, as text, why it
    cannot be found.
    """
    resistance = _resistance(solver, run)
    if isinstance(resistance, str):
        return resistance
    deduction = solver.row(solver.by_name["t"], "propeller", solver.features(run))
    curve = solver.table(solver.by_name["KT"], "propeller")
    if deduction is None or curve is None:
        return "no open-water curve or thrust deduction"
    table, kt_nodes, _ = curve
    order = np.argsort(table.points[:, 0])
    advance, kt_order = table.points[order, 0], np.array(kt_nodes)[order]
    scale = solver.scales["KT"]

    def wake(values: Array, n: float) -> float:
        wanted = sum(f * values[i] for i, f in resistance.items())
        t = sum(f * values[i] for i, f in deduction.items())
        kt = wanted / ((1.0 - t) * scale * n * abs(n))
        j = float(np.interp(-kt, -values[kt_order], advance))
        return 1.0 - j * n * solver.diameter / float(run["U"])

    n, values = float(run["n"]), solver.values
    gradient = np.zeros(values.size)
    for i in {*resistance, *deduction, *kt_nodes}:
        step = _STEP * max(abs(values[i]), _STEP)
        up, down = values.copy(), values.copy()
        up[i] += step
        down[i] -= step
        gradient[i] = (wake(up, n) - wake(down, n)) / (2.0 * step)
    by_n = (wake(values, n * (1.0 + _STEP)) - wake(values, n * (1.0 - _STEP))) / (2.0 * _STEP * n)
    row = gradient @ solver.covariance
    variance = float(row @ gradient) + (by_n * float(run["rel_sigma"]) * n) ** 2
    return wake(values, n), variance, row
