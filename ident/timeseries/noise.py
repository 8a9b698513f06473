"""The noise of samples: its size, and the time over which it is alike, by restricted maximum likelihood.

Noise behind a filter is alike from sample to sample. Its correlation is taken to fall exponentially with time, as
behind a filter of the first order, and samples are made independent by taking from each what it has in common with the
one before it (Prais and Winsten 1954, Trend estimators and serial correlation, Cowles Commission discussion paper 383).
Taken for white, such noise is followed by the path, and every error comes out too small.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.splines import (
    HOPELESS,
    ORDER,
    added,
    basis,
    decade_of_least,
    gram,
    knots_for,
    log_det,
    penalty_of,
    roughness,
    solve,
    step_of,
)

Array = NDArray[np.float64]
# Decades of the smoothing parameter that are searched, about the one of a unit response.
_DECADES = (-9.0, 13.0)
# The first memory that is tried, in steps of the record, and the longest: a share of the record, beyond which noise
# cannot be told from motion.
_FIRST, _LONGEST = 0.5, 1.0 / 50.0
# Change of the memory's logarithm by which the curvature of its likelihood is measured, and its largest standard error.
_ASIDE, _WIDEST = 0.2, 0.7
# Channels of which the likeliest noise is kept: those of a record.
_KEPT = 32
# Samples further apart than this many of the median steps begin anew.
_GAP = 4.0
# Decades about the likeliest smoothing parameter of one memory within which that of the next is sought.
_NEAR = 2.0


@dataclass(frozen=True)
class Samples:
    """Measurements of a path or of its rate.

    Attributes
    ----------
    time, value : (n,) [s] and in SI units.
    derivative : 0 for the path itself, 1 for its rate.
    sigma : Standard error of one sample; 0 where it is to be found.
    memory : Time in which the correlation of their errors falls to 1/e [s]; 0 for white errors, None where it is to
        be found.
    """

    time: Array
    value: Array
    derivative: int
    sigma: float
    memory: float | None = 0.0


def whitening(one: Samples) -> tuple[Any, float]:
    """Matrix that makes errors of some samples independent and of their size, and the logarithm of its determinant."""
    from scipy.sparse import diags_array

    steps = np.diff(one.time)
    alike = np.zeros(steps.size)
    if one.memory:
        near = steps <= _GAP * float(np.median(steps))
        alike[near] = np.exp(-steps[near] / one.memory)
    own = 1.0 / np.sqrt(1.0 - alike**2)
    matrix = diags_array([np.append(1.0, own), -alike * own], offsets=[0, -1], shape=(one.time.size, one.time.size))
    return matrix.tocsr(), float(np.sum(np.log(own)))


def equations(knots: Array, one: Samples) -> tuple[Any, Array]:
    """Left and right side of the equations of some samples, in standard errors that are independent."""
    white, _ = whitening(one)
    return white @ basis(knots, one.time, one.derivative) / one.sigma, white @ one.value / one.sigma


def product(one: Samples, other: Samples) -> float:
    """Sum of the products of two sets of values at the same samples, in standard errors that are independent."""
    white, _ = whitening(one)
    return float((white @ one.value) @ (white @ other.value)) / one.sigma**2


@dataclass(frozen=True)
class Likely:
    """What samples are most likely made of.

    Attributes
    ----------
    density : Spectral density of the path's third derivative.
    sigma, memory : Of the noise, as in ``Samples``.
    """

    density: float
    sigma: float
    memory: float


@dataclass(frozen=True)
class _Fit:
    decade: float
    loss: float
    left: float


def likely(time: Array, value: Array, memory: float | None = 0.0) -> Likely:
    """Density of the third derivative and noise at the largest likelihood.

    The checks of a record and its measurement ask for the same channel: what was found of the last ones is kept.

    Parameters
    ----------
    time, value : (n,) [s], growing, and the samples; at least 8.
    memory : Of the noise [s]; None to find it.
    """
    return _likely(np.ascontiguousarray(time).tobytes(), np.ascontiguousarray(value).tobytes(), memory)


@lru_cache(maxsize=_KEPT)
def _likely(times: bytes, values: bytes, memory: float | None) -> Likely:
    time, value = np.frombuffer(times), np.frombuffer(values)
    scale = float(np.std(value)) or 1.0
    unit = Samples(time, (value - value.mean()) / scale, 0, 1.0, memory or 0.0)
    knots = knots_for(time)
    of_path = basis(knots, time, 0)
    at, best = memory or 0.0, _best(knots, of_path, unit)
    if memory is None:
        at, best = _doubled(knots, of_path, unit, best)
        if at:
            at, best = _expected(knots, of_path, unit, at, best.decade)
    sigma = scale * math.sqrt(best.left / (time.size - ORDER))
    weight = step_of(knots) ** (2 * ORDER - 1) * 10.0**best.decade
    return Likely(sigma**2 / weight, sigma, at)


def _doubled(knots: Array, of_path: Any, unit: Samples, white: _Fit) -> tuple[float, _Fit]:
    """The likeliest of memories that are doubled as long as that helps, and its fit."""
    steps = float(np.median(np.diff(unit.time)))
    best, at, memory, near = white, 0.0, _FIRST * steps, white.decade
    while memory <= _LONGEST * float(unit.time[-1] - unit.time[0]):
        one = _best(knots, of_path, replace(unit, memory=memory), near)
        if one.loss < best.loss:
            best, at = one, memory
        elif memory > 2.0 * at:
            break
        near, memory = one.decade, 2.0 * memory
    return at, best


def _expected(knots: Array, of_path: Any, unit: Samples, near: float, decade: float) -> tuple[float, _Fit]:
    """The memory with which noise has the power that is expected of it, and the fit there.

    What noise of a memory does to a path grows with the product of its variance and its memory, which a record tells to
    some tenths and to one side. It is averaged over the likelihood of the memory, whose maximum would be too low.
    """
    from scipy.optimize import minimize_scalar

    def fitted(x: float) -> _Fit:
        return _best(knots, of_path, replace(unit, memory=math.exp(x)), decade)

    around = math.log(near / 2.0), math.log(near * 2.0)
    middle = float(
        minimize_scalar(lambda x: fitted(x).loss, bounds=around, method="bounded", options={"xatol": 0.05}).x
    )
    best = fitted(middle)
    # Steps of a standard error, as the curvature of the loss of two likelihoods has it.
    sides = [fitted(middle - _ASIDE).loss, fitted(middle + _ASIDE).loss]
    bent = max((sum(sides) - 2.0 * best.loss) / _ASIDE**2, 2.0 / _WIDEST**2)
    places = middle + math.sqrt(2.0 / bent) * np.arange(-2.0, 2.5)
    fits = [fitted(float(x)) for x in places]
    shares = np.exp(-0.5 * (np.array([fit.loss for fit in fits]) - best.loss))
    at = float(shares @ places / shares.sum())
    return math.exp(at), fitted(at)


def _best(knots: Array, of_path: Any, unit: Samples, near: float | None = None) -> _Fit:
    """The likeliest smoothing parameter, as a decade of the one of a unit response; near another, or anywhere.

    ``of_path`` is the basis at the samples, which does not change with their memory; their size is one.
    """
    white, shrunk = whitening(unit)
    left_side, right_side = white @ of_path, white @ unit.value
    bands, right, penalty = gram(left_side), left_side.T @ right_side, penalty_of(knots)
    free, rank = unit.time.size - ORDER, right.size - ORDER
    size = step_of(knots) ** (2 * ORDER - 1)

    def fitted(decade: float) -> _Fit:
        weight = size * 10.0**decade
        try:
            factor, solved = solve(added(bands, weight * penalty), right)
        except np.linalg.LinAlgError:
            return _Fit(decade, HOPELESS, 0.0)
        # Residuals and roughness by themselves: their sum as a difference would be lost in rounding.
        left = float(np.sum((right_side - left_side @ solved) ** 2)) + weight * roughness(knots, solved)
        left = max(left, 1e-28 * unit.time.size)
        loss = free * math.log(left / free) + log_det(factor) - rank * math.log(weight) - 2.0 * shrunk
        return _Fit(decade, loss, left)

    grid = np.arange(*_DECADES) if near is None else near + np.arange(-_NEAR, _NEAR + 0.5)
    return fitted(decade_of_least(lambda d: fitted(d).loss, grid))
