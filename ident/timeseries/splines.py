"""Splines of the fourth degree on even knots: basis, penalty on the third derivative, banded systems."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
DEGREE = 4
ORDER = 3
_THIRD = (-1.0, 3.0, -3.0, 1.0)
# Knots of a path; finer than any maneuver of a boat asks for.
_MOST_KNOTS = 1600
# Loss where a system cannot be solved: infinity would leave a minimiser without a number.
HOPELESS = 1e30


def penalty_of(knots: Array) -> Array:
    """Of the integral of the squared third derivative, upper banded (Eilers and Marx)."""
    size = len(knots) - DEGREE - 1
    bands = np.zeros((DEGREE + 1, size))
    for row in range(ORDER + 1):
        for column in range(row, ORDER + 1):
            # Row i of the differences touches coefficients i to i + 3.
            bands[DEGREE - (column - row), column : size - ORDER + column] += _THIRD[row] * _THIRD[column]
    return bands / step_of(knots) ** (2 * ORDER - 1)


def step_of(knots: Array) -> float:
    """Distance between two knots."""
    return float(knots[DEGREE + 1] - knots[DEGREE])


def roughness(knots: Array, coefficients: Array) -> float:
    """The integral of the squared third derivative."""
    return float(np.sum(np.diff(coefficients, ORDER) ** 2)) / step_of(knots) ** (2 * ORDER - 1)


def knots_for(time: Array, lo: float | None = None, hi: float | None = None) -> Array:
    """Evenly spaced knots of a path over some sample times."""
    start, end = float(time[0] if lo is None else lo), float(time[-1] if hi is None else hi)
    steps = np.diff(np.unique(time))
    typical = float(np.median(steps)) if steps.size else end - start
    count = int(np.clip(math.ceil((end - start) / max(typical, 1e-12)), 4, _MOST_KNOTS))
    step = (end - start) / count
    return np.asarray(start + step * np.arange(-DEGREE, count + DEGREE + 1, dtype=float))


def _values(knots: Array, time: Array, derivative: int) -> tuple[Array, NDArray[np.int64]]:
    """Values of the five B-splines at each time, and the first of them."""
    from scipy.interpolate import BSpline

    count = len(knots) - 2 * DEGREE - 1
    place = (time - knots[DEGREE]) / step_of(knots)
    if place.size and (place.min() < -1e-6 or place.max() > count + 1e-6):
        raise ValueError("samples outside of the knots, where B-splines do not sum to one")
    first = np.clip(np.floor(place).astype(np.int64), 0, count - 1)
    element = BSpline.basis_element(np.arange(DEGREE + 2.0), extrapolate=False)
    element = element.derivative(derivative) if derivative else element
    values = np.stack([np.nan_to_num(element(place - first + DEGREE - k)) for k in range(DEGREE + 1)], axis=1)
    return values / step_of(knots) ** derivative, first


def basis(knots: Array, time: Array, derivative: int) -> Any:
    """(n, k) sparse matrix of the B-splines, or their derivatives, at some times."""
    from scipy.sparse import csr_array

    values, first = _values(knots, time, derivative)
    columns = (first[:, None] + np.arange(DEGREE + 1)).ravel()
    starts = np.arange(0, columns.size + 1, DEGREE + 1)
    return csr_array((values.ravel(), columns, starts), shape=(time.size, len(knots) - DEGREE - 1))


def gram(matrix: Any) -> Array:
    """A'A of a sparse matrix, upper banded."""
    product = (matrix.T @ matrix).tocoo()
    above = product.col - product.row
    width = max(DEGREE, int(above.max(initial=0)))
    bands = np.zeros((width + 1, product.shape[0]))
    upper = above >= 0
    bands[width - above[upper], product.col[upper]] = product.data[upper]
    return bands


def added(*parts: Array) -> Array:
    """The sum of symmetric matrices, upper banded, of one size and any number of bands."""
    total = np.zeros((max(len(p) for p in parts), parts[0].shape[1]))
    for one in parts:
        total[len(total) - len(one) :] += one
    return total


def log_det(factor: Array) -> float:
    """Logarithm of the determinant of a matrix, by its banded factor."""
    return float(2.0 * np.sum(np.log(factor[-1])))


def solve(bands: Array, right: Array) -> tuple[Array, Array]:
    """The factor of a symmetric matrix, upper banded, and the solution."""
    from scipy.linalg import cho_solve_banded, cholesky_banded

    factor = cholesky_banded(bands)
    return factor, cho_solve_banded((factor, False), right)


def decade_of_least(loss: Callable[[float], float], grid: Array) -> float:
    """Decade of a smoothing parameter at which a loss is least.

    Parameters
    ----------
    loss : Of a decade; it may have two bottoms.
    grid : Decades, one apart, of which the least is taken first: the deeper bottom.
    """
    from scipy.optimize import minimize_scalar

    near = float(grid[int(np.argmin([loss(float(d)) for d in grid]))])
    found = minimize_scalar(loss, bounds=(near - 1.0, near + 1.0), method="bounded", options={"xatol": 0.02})
    return float(found.x)
