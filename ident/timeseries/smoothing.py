"""Smooth paths through noisy samples, with the errors of everything that is read off them.

A channel is taken as a smooth function whose third derivative is white noise of unknown size,
sampled with white errors of unknown size. Both sizes are found by restricted maximum likelihood
(Wahba 1985, Annals of Statistics 13:1378-1402; Patterson and Thompson 1971, Biometrika 58:545-554).
The posterior of the path is then a penalised spline (Eilers and Marx 1996, Statistical Science
11:89-121) and its draws carry the error of any metric: a peak, a crossing, a diameter. That
intervals of this posterior cover the truth as often as they say is shown by Wahba (1983), Journal
of the Royal Statistical Society B 45:133-150, and tested here on flights.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_DEGREE = 4
_ORDER = 3
_THIRD = (-1.0, 3.0, -3.0, 1.0)
# A rudder that begins to move makes the third derivative jump. The density is taken this much larger than the
# likeliest one: the bias of a cubic kink falls with its root, to a third, and standard errors grow with its
# twelfth root, by a fifth (Hall 1992, Annals of Statistics 20:675-694, on undersmoothing for intervals).
_ROUGHER = 10.0
# Knots of a path; finer than any maneuver of a boat asks for.
_MOST_KNOTS = 1600
# Decades of the smoothing parameter that are searched, about the one of a unit response.
_DECADES = (-9.0, 13.0)
# Loss where a system cannot be solved: infinity would leave the minimiser without a number.
_HOPELESS = 1e30


@dataclass(frozen=True)
class Samples:
    """Measurements of a path or of its rate.

    Attributes
    ----------
    time, value : (n,) [s] and in SI units.
    derivative : 0 for the path itself, 1 for its rate.
    sigma : Standard error of one sample.
    """

    time: Array
    value: Array
    derivative: int
    sigma: float


@dataclass(frozen=True)
class SmoothPath:
    """The posterior of a smooth path.

    Attributes
    ----------
    knots : Of the B-splines.
    mean : (k,) coefficients of the most likely path.
    factor : Banded upper factor of the precision of the coefficients.
    sigma : Standard error of one sample of the path.
    samples : What it was made from, less ``centre``, each with its standard error.
    shared : Changes of the coefficients by one standard error of what all samples share.
    """

    knots: Array
    mean: Array
    factor: Array
    sigma: float
    samples: tuple[Samples, ...]
    centre: float
    shared: tuple[Array, ...] = ()

    def __call__(self, time: Array | float, derivative: int = 0) -> Array:
        """The most likely path, or its derivative, at some times [s]."""
        from scipy.interpolate import BSpline

        return np.asarray(BSpline(self.knots, self.mean, _DEGREE)(time, derivative))

    def drawn(self, count: int, rng: np.random.Generator) -> list[SmoothPath]:
        """Paths drawn from the posterior."""
        from scipy.linalg import solve_banded

        normal = rng.standard_normal((self.mean.size, count))
        away = solve_banded((0, len(self.factor) - 1), self.factor, normal)
        for one in self.shared:
            away += one[:, None] * rng.standard_normal(count)
        return [replace(self, mean=self.mean + one) for one in away.T]

    def response(self, samples: tuple[Samples, ...]) -> tuple[Array, Array]:
        """B'Wy of other values at the samples, and the coefficients of the path through them."""
        from scipy.linalg import cho_solve_banded

        right = np.sum([_gram(self.knots, one)[1] for one in samples], axis=0)
        return right, cho_solve_banded((self.factor, False), right)

    def again(self) -> SmoothPath:
        """This path smoothed once more as its samples were: the difference is the bias of smoothing."""
        from scipy.linalg import cho_solve_banded

        right, centre = np.zeros(self.mean.size), self.centre
        for one in self.samples:
            value = _fitted(self.knots, self.mean - centre, one)
            right += _gram(self.knots, replace(one, value=value))[1]
        return replace(self, mean=centre + cho_solve_banded((self.factor, False), right))

    def repeated(self, count: int, rng: np.random.Generator) -> list[tuple[SmoothPath, SmoothPath]]:
        """Paths that the same record would give with other noise, in pairs of opposite noise about ``again``.

        What a metric comes to on these beyond its value on ``again`` is its bias by noise: a peak is read too high.
        """
        from scipy.linalg import cho_solve_banded

        middle = self.again().mean
        right = np.zeros((self.mean.size, count))
        for one in self.samples:
            right += _basis(self.knots, one).T @ rng.standard_normal((one.time.size, count)) / one.sigma
        away = cho_solve_banded((self.factor, False), right)
        return [(replace(self, mean=middle + a), replace(self, mean=middle - a)) for a in away.T]

    def deviation(self, time: Array | float, derivative: int = 0) -> Array:
        """Standard error of the path, or its derivative, at some times."""
        from scipy.interpolate import BSpline
        from scipy.linalg import cho_solve_banded

        at = np.atleast_1d(np.asarray(time, dtype=float))
        eye = np.eye(self.mean.size)
        basis = np.asarray(BSpline(self.knots, eye, _DEGREE)(at, derivative)) if at.size <= 64 else None
        if basis is None:
            return np.concatenate(
                [self.deviation(piece, derivative) for piece in np.array_split(at, at.size // 64 + 1)]
            )
        solved = cho_solve_banded((self.factor, False), basis.T)
        variance = np.einsum("ij,ji->i", basis, solved)
        for one in self.shared:
            variance += (basis @ one) ** 2
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64)


def _penalty(knots: Array) -> Array:
    """Of the integral of the squared third derivative, upper banded (Eilers and Marx)."""
    size = len(knots) - _DEGREE - 1
    bands = np.zeros((_DEGREE + 1, size))
    for row in range(_ORDER + 1):
        for column in range(row, _ORDER + 1):
            # Row i of the differences touches coefficients i to i + 3.
            bands[_DEGREE - (column - row), column : size - _ORDER + column] += _THIRD[row] * _THIRD[column]
    return bands / _step(knots) ** (2 * _ORDER - 1)


def _step(knots: Array) -> float:
    return float(knots[_DEGREE + 1] - knots[_DEGREE])


def _roughness(knots: Array, coefficients: Array) -> float:
    """The integral of the squared third derivative."""
    return float(np.sum(np.diff(coefficients, _ORDER) ** 2)) / _step(knots) ** (2 * _ORDER - 1)


def knots_for(time: Array, lo: float | None = None, hi: float | None = None) -> Array:
    """Evenly spaced knots of a path over some sample times."""
    start, end = float(time[0] if lo is None else lo), float(time[-1] if hi is None else hi)
    steps = np.diff(np.unique(time))
    typical = float(np.median(steps)) if steps.size else end - start
    count = int(np.clip(math.ceil((end - start) / max(typical, 1e-12)), 4, _MOST_KNOTS))
    step = (end - start) / count
    return np.asarray(start + step * np.arange(-_DEGREE, count + _DEGREE + 1, dtype=float))


def _values(knots: Array, time: Array, derivative: int) -> tuple[Array, NDArray[np.int64]]:
    """Values of the five B-splines at each time, and the first of them."""
    from scipy.interpolate import BSpline

    count = len(knots) - 2 * _DEGREE - 1
    place = (time - knots[_DEGREE]) / _step(knots)
    if place.size and (place.min() < -1e-6 or place.max() > count + 1e-6):
        raise ValueError("samples outside of the knots, where B-splines do not sum to one")
    first = np.clip(np.floor(place).astype(np.int64), 0, count - 1)
    element = BSpline.basis_element(np.arange(_DEGREE + 2.0), extrapolate=False)
    element = element.derivative(derivative) if derivative else element
    values = np.stack([np.nan_to_num(element(place - first + _DEGREE - k)) for k in range(_DEGREE + 1)], axis=1)
    return values / _step(knots) ** derivative, first


def _fitted(knots: Array, coefficients: Array, samples: Samples) -> Array:
    """The path, or its rate, at the times of some samples."""
    from scipy.interpolate import BSpline

    return np.asarray(BSpline(knots, coefficients, _DEGREE)(samples.time, samples.derivative))


def _gram(knots: Array, samples: Samples) -> tuple[Array, Array]:
    """Banded B'WB and B'Wy of some samples."""
    values, first = _values(knots, samples.time, samples.derivative)
    size, weight = len(knots) - _DEGREE - 1, samples.sigma**-2.0
    bands, right = np.zeros((_DEGREE + 1, size)), np.zeros(size)
    for i in range(_DEGREE + 1):
        np.add.at(right, first + i, weight * values[:, i] * samples.value)
        for j in range(i, _DEGREE + 1):
            np.add.at(bands[_DEGREE - (j - i)], first + j, weight * values[:, i] * values[:, j])
    return bands, right


def _basis(knots: Array, samples: Samples) -> Any:
    """(n, k) sparse matrix of the B-splines at some samples."""
    from scipy.sparse import csr_array

    values, first = _values(knots, samples.time, samples.derivative)
    columns = (first[:, None] + np.arange(_DEGREE + 1)).ravel()
    starts = np.arange(0, columns.size + 1, _DEGREE + 1)
    return csr_array((values.ravel(), columns, starts), shape=(samples.time.size, len(knots) - _DEGREE - 1))


def _log_det(factor: Array) -> float:
    return float(2.0 * np.sum(np.log(factor[-1])))


def _solve(bands: Array, right: Array) -> tuple[Array, Array]:
    from scipy.linalg import cho_solve_banded, cholesky_banded

    factor = cholesky_banded(bands)
    return factor, cho_solve_banded((factor, False), right)


def noise_of(time: Array, value: Array) -> float:
    """Standard error of one sample of a smooth path, by restricted maximum likelihood.

    Parameters
    ----------
    time, value : (n,) [s], growing, and the samples; at least 8.
    """
    return _likely(time, value)[1]


def _likely(time: Array, value: Array) -> tuple[float, float]:
    """Spectral density of the third derivative, and the noise, at the largest likelihood."""
    from scipy.optimize import minimize_scalar

    knots = knots_for(time)
    scale = float(np.std(value)) or 1.0
    one = Samples(time, (value - value.mean()) / scale, 0, 1.0)
    bands, right = _gram(knots, one)
    penalty = _penalty(knots)
    free, rank = time.size - _ORDER, right.size - _ORDER
    unit = _step(knots) ** (2 * _ORDER - 1)

    def rest(weight: float) -> tuple[Array, float]:
        factor, solved = _solve(bands + weight * penalty, right)
        # Residuals and roughness by themselves: their sum as a difference would be lost in rounding.
        left = float(np.sum((one.value - _fitted(knots, solved, one)) ** 2)) + weight * _roughness(knots, solved)
        return factor, max(left, 1e-28 * time.size)

    def loss(decade: float) -> float:
        weight = unit * 10.0**decade
        try:
            factor, left = rest(weight)
        except np.linalg.LinAlgError:
            return _HOPELESS
        return free * math.log(left / free) + _log_det(factor) - rank * math.log(weight)

    grid = np.arange(*_DECADES)
    best = grid[int(np.argmin([loss(d) for d in grid]))]
    likely = minimize_scalar(loss, bounds=(best - 1.0, best + 1.0), method="bounded", options={"xatol": 0.02})
    weight = unit * 10.0 ** float(likely.x)
    sigma = scale * math.sqrt(rest(weight)[1] / free)
    return sigma**2 / weight, sigma


def smooth(samples: list[Samples], lo: float | None = None, hi: float | None = None) -> SmoothPath:
    """The path through samples of it, and of its rate where there are any.

    Parameters
    ----------
    samples : The first of the path itself; a ``sigma`` of 0 is found from the samples.
    lo, hi : Times between which the path is wanted; those of the samples when None.

    Returns
    -------
    SmoothPath; the size of its third derivative is that of the largest likelihood.
    """
    first = samples[0]
    density, sigma = _likely(first.time, first.value)
    centre = float(first.value.mean())
    told = [replace(first, value=first.value - centre, sigma=first.sigma or sigma), *samples[1:]]
    ends = min(float(one.time[0]) for one in told), max(float(one.time[-1]) for one in told)
    knots = knots_for(first.time, ends[0] if lo is None else lo, ends[1] if hi is None else hi)
    parts = [_gram(knots, s) for s in told]
    bands, right = np.sum([p[0] for p in parts], axis=0), np.sum([p[1] for p in parts], axis=0)
    penalty = _penalty(knots)
    if len(told) > 1 or first.sigma:
        density = _density(knots, told, bands, right, density)
    density *= _ROUGHER
    factor, solved = _solve(bands + penalty / density, right)
    # B-splines sum to one: the mean is a shift of every coefficient.
    return SmoothPath(knots, solved + centre, factor, told[0].sigma, tuple(told), centre)


def _density(knots: Array, told: list[Samples], bands: Array, right: Array, near: float) -> float:
    """Spectral density of the third derivative at the largest likelihood, where the noise is known."""
    from scipy.optimize import minimize_scalar

    penalty, rank = _penalty(knots), right.size - _ORDER

    def loss(decade: float) -> float:
        weight = 10.0**-decade / near
        try:
            factor, solved = _solve(bands + weight * penalty, right)
        except np.linalg.LinAlgError:
            return _HOPELESS
        left = sum(float(np.sum((s.value - _fitted(knots, solved, s)) ** 2)) / s.sigma**2 for s in told)
        return left + weight * _roughness(knots, solved) + _log_det(factor) - rank * math.log(weight)

    # The loss may have two bottoms: the deeper one is found on a grid.
    grid = np.arange(-4.0, 4.5, 1.0)
    least = grid[int(np.argmin([loss(d) for d in grid]))]
    best = minimize_scalar(loss, bounds=(least - 1.0, least + 1.0), method="bounded", options={"xatol": 0.02})
    return near * 10.0 ** float(best.x)
