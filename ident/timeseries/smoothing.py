"""Smooth paths through noisy samples, with the errors of everything that is read off them.

A channel is taken as a smooth function whose third derivative is white noise of unknown size,
sampled with errors of unknown size, white or alike over a time. These are found by restricted maximum likelihood
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

from ident.timeseries.noise import Samples, equations, likely
from ident.timeseries.splines import (
    DEGREE,
    HOPELESS,
    ORDER,
    added,
    decade_of_least,
    gram,
    knots_for,
    log_det,
    penalty_of,
    roughness,
    solve,
)

Array = NDArray[np.float64]
# A rudder that begins to move makes the third derivative jump. The density is taken this much larger than the
# likeliest one: the bias of a cubic kink falls with its root, to a third, and standard errors grow with its
# twelfth root, by a fifth (Hall 1992, Annals of Statistics 20:675-694, on undersmoothing for intervals).
ROUGHER = 10.0


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

        return np.asarray(BSpline(self.knots, self.mean, DEGREE)(time, derivative))

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

        sides = [equations(self.knots, one) for one in samples]
        right = np.sum([left.T @ value for left, value in sides], axis=0)
        return right, cho_solve_banded((self.factor, False), right)

    def again(self) -> SmoothPath:
        """This path smoothed once more as its samples were: the difference is the bias of smoothing."""
        from scipy.linalg import cho_solve_banded

        right, centre = np.zeros(self.mean.size), self.centre
        for one in self.samples:
            left, _ = equations(self.knots, one)
            right += left.T @ (left @ (self.mean - centre))
        return replace(self, mean=centre + cho_solve_banded((self.factor, False), right))

    def repeated(self, count: int, rng: np.random.Generator) -> list[tuple[SmoothPath, SmoothPath]]:
        """Paths that the same record would give with other noise, in pairs of opposite noise about ``again``.

        What a metric comes to on these beyond its value on ``again`` is its bias by noise: a peak is read too high.
        """
        from scipy.linalg import cho_solve_banded

        middle = self.again().mean
        right = np.zeros((self.mean.size, count))
        for one in self.samples:
            right += equations(self.knots, one)[0].T @ rng.standard_normal((one.time.size, count))
        away = cho_solve_banded((self.factor, False), right)
        return [(replace(self, mean=middle + a), replace(self, mean=middle - a)) for a in away.T]

    def deviation(self, time: Array | float, derivative: int = 0) -> Array:
        """Standard error of the path, or its derivative, at some times."""
        from scipy.interpolate import BSpline
        from scipy.linalg import cho_solve_banded

        at = np.atleast_1d(np.asarray(time, dtype=float))
        eye = np.eye(self.mean.size)
        basis = np.asarray(BSpline(self.knots, eye, DEGREE)(at, derivative)) if at.size <= 64 else None
        if basis is None:
            return np.concatenate(
                [self.deviation(piece, derivative) for piece in np.array_split(at, at.size // 64 + 1)]
            )
        solved = cho_solve_banded((self.factor, False), basis.T)
        variance = np.einsum("ij,ji->i", basis, solved)
        for one in self.shared:
            variance += (basis @ one) ** 2
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64)


def smooth(
    samples: list[Samples], lo: float | None = None, hi: float | None = None, rougher: float = ROUGHER
) -> SmoothPath:
    """The path through samples of it, and of its rate where there are any.

    Parameters
    ----------
    samples : The first of the path itself; a ``sigma`` of 0 and a ``memory`` of None are found from the samples.
    lo, hi : Times between which the path is wanted; those of the samples when None.
    rougher : Density of the path's third derivative, in likeliest ones.

    Returns
    -------
    SmoothPath; the size of its third derivative is that of the largest likelihood.
    """
    first = samples[0]
    noise = likely(first.time, first.value, first.memory)
    centre = float(first.value.mean())
    found = replace(first, value=first.value - centre, sigma=first.sigma or noise.sigma, memory=noise.memory)
    told = [found, *samples[1:]]
    ends = min(float(one.time[0]) for one in told), max(float(one.time[-1]) for one in told)
    knots = knots_for(first.time, ends[0] if lo is None else lo, ends[1] if hi is None else hi)
    sides = [equations(knots, one) for one in told]
    bands = added(*(gram(left) for left, _ in sides))
    right = np.sum([left.T @ value for left, value in sides], axis=0)
    density = noise.density
    if len(told) > 1 or first.sigma:
        density = _density(knots, sides, bands, right, density)
    density *= rougher
    factor, solved = solve(added(bands, penalty_of(knots) / density), right)
    # B-splines sum to one: the mean is a shift of every coefficient.
    return SmoothPath(knots, solved + centre, factor, found.sigma, tuple(told), centre)


def _density(knots: Array, sides: list[tuple[Any, Array]], bands: Array, right: Array, near: float) -> float:
    """Spectral density of the third derivative at the largest likelihood, where the noise is known."""
    penalty, rank = penalty_of(knots), right.size - ORDER

    def loss(decade: float) -> float:
        weight = 10.0**-decade / near
        try:
            factor, solved = solve(added(bands, weight * penalty), right)
        except np.linalg.LinAlgError:
            return HOPELESS
        left = sum(float(np.sum((value - side @ solved) ** 2)) for side, value in sides)
        return left + weight * roughness(knots, solved) + log_det(factor) - rank * math.log(weight)

    return near * 10.0 ** decade_of_least(loss, np.arange(-4.0, 4.5, 1.0))
