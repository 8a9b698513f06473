"""Authority: NIST Statistical Reference Datasets, linear least squares: certified estimates
and standard deviations to six digits (https://www.itl.nist.gov/div898/strd/).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ident.identification.stage_solve import gain_matrix, weights
from ident.timeseries.regression import least_squares

FOLDER = Path(__file__).parent / "data" / "nist_strd"
SETS = ["Norris", "Pontius", "NoInt1", "NoInt2", "Filip", "Longley", *(f"Wampler{k}" for k in range(1, 6))]


def load(name: str):
    """Design, observations, certified estimates and standard deviations."""
    lines = (FOLDER / f"{name}.csv").read_text().splitlines()
    model = lines[0].split("model:")[1].split()
    certified = np.array([line.split()[2:] for line in lines if line.startswith("# certified")], dtype=float)
    rows = [line for line in lines if not line.startswith("#")]
    data = np.array([row.split(",") for row in rows[1:]], dtype=float)
    columns = dict(zip(rows[0].split(","), data.T, strict=True))
    design = []
    for term in model:
        base, _, power = term.partition("^")
        design.append(np.ones(len(data)) if term == "1" else columns[base] ** int(power or 1))
    return np.array(design).T, columns["y"], certified[:, 0], certified[:, 1]


def errors(x, y, values, inverse):
    residual = (y.astype(np.longdouble) - x.astype(np.longdouble) @ values).astype(float)
    variance = residual @ residual / (len(y) - x.shape[1])
    return np.sqrt(variance * np.diag(inverse))


@pytest.mark.parametrize("name", SETS)
def test_estimates_and_standard_errors_have_six_certified_digits(name):
    x, y, estimates, deviations = load(name)
    values, inverse = least_squares(x, y)
    np.testing.assert_allclose(values, estimates, rtol=1e-6)
    exact = deviations == 0.0
    found = errors(x, y, values, inverse)
    np.testing.assert_allclose(found[~exact], deviations[~exact], rtol=1e-6)
    assert (found[exact] < 1e-7 * np.abs(y).max()).all()


@pytest.mark.parametrize("name", [s for s in SETS if s != "Filip"])
def test_identification_solves_them_to_six_digits_too(name):
    """The block solver of the stages drops what its rank rule calls undetermined (Filip is)."""
    x, y, estimates, deviations = load(name)
    gain, lost = gain_matrix(x, weights(x, np.ones(len(y))))
    assert not lost
    np.testing.assert_allclose(gain @ y, estimates, rtol=2e-6 if name == "Wampler5" else 1e-6)
    residual = y - x @ (gain @ y)
    spread = np.sqrt(residual @ residual / (len(y) - x.shape[1]) * np.diag(gain @ gain.T))
    inexact = deviations > 0.0
    np.testing.assert_allclose(spread[inexact], deviations[inexact], rtol=1e-6)


def test_dependent_columns_are_refused():
    x = np.column_stack([np.ones(9), np.arange(9.0), 2.0 * np.arange(9.0) + 1.0])
    with pytest.raises(np.linalg.LinAlgError):
        least_squares(x, np.arange(9.0))
