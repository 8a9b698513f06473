"""`ident calibrate`: multipliers of coefficient groups from free-running maneuvers.

Maximum a posteriori by least squares. A series k (case, source, channel) with residual r_k
adds ``n_k mean(r_k^2) / sigma_k^2``; n_k is the number of independent pieces the record
holds (crossings of its mean, plus one), shared among the channels of one motion (heading,
yaw rate and track are one motion), and::

    sigma_k^2 = s_c^2 + reading_k^2 + d_k^2

with the reading error of the record, its share d_k of the difference to another source of the
same case, and the discrepancy s_c between model and reality: one for each case and
channel, shared by its sources, estimated by maximum likelihood in turn with the multipliers.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.calibration.problem import Channel, Key, Problem

Array = NDArray[np.float64]

# Relative to the prior's sigma: step of the differences, and when the multipliers are found.
_STEP = 0.05
_CLOSE = 0.01
_ROUNDS = 12
_INNER = 6
# Draws of the prior of which the most probable is a second place to begin from, and their seed.
_DRAWN, _SEED = 64, 0
# Log density by which another optimum must be the more probable.
_MORE = 0.05


@dataclass(frozen=True)
class Estimate:
    """A calibrated set of multipliers.

    Attributes
    ----------
    theta, covariance : (k,) and (k, k), posterior.
    information : (k, k) of the data alone, without priors.
    rms : Series -> root mean square residual.
    sigma : Series -> sigma_k used.
    residual, slope : (n,) and (n, k), weighted residuals of all series at ``theta`` (``stack``) and their derivatives.
    converged : False when the rounds ran out.
    rounds : How many there were.
    """

    theta: Array
    covariance: Array
    information: Array
    rms: dict[Key, float]
    sigma: dict[Key, float]
    residual: Array
    slope: Array
    converged: bool
    rounds: int = field(default=0)

    @property
    def deviation(self) -> Array:
        """(k,) posterior standard deviations."""
        return np.sqrt(np.diag(self.covariance))


def discrepancies(channels: list[Channel], rms: Sequence[float]) -> Array:
    """sigma_k of every series: the shared discrepancy of its case and channel by maximum likelihood.

    Parameters
    ----------
    channels, rms : The series and their root mean square residuals.

    Returns
    -------
    (series,) in the units of the references.
    """
    from scipy.optimize import minimize_scalar

    stated = np.array([c.reading**2 + c.against**2 for c in channels])
    square, count = np.square(rms), np.array([c.pieces for c in channels])
    out = np.zeros(len(channels))
    for shared in dict.fromkeys((c.key[0], c.key[2]) for c in channels):
        k = [i for i, c in enumerate(channels) if (c.key[0], c.key[2]) == shared]

        def loss(log_s: float, k: list[int] = k) -> float:
            variance = np.exp(2.0 * log_s) + stated[k]
            return float(np.sum(count[k] * (np.log(variance) + square[k] / variance)))

        top = np.log(np.sqrt(square[k].max()) + 1e-300)
        best = minimize_scalar(loss, bounds=(top - 9.0, top + 1.0), method="bounded", options={"xatol": 1e-6})
        out[k] = np.sqrt(np.exp(2.0 * best.x) + stated[k])
    return out


def log_density(task: Problem, theta: Array) -> float:
    """Log of the posterior, but for a constant, with the discrepancies at their most likely values.

    Parameters
    ----------
    task : From ``ident.calibration.problem.problem``.
    theta : (k,) multipliers.
    """
    if np.any(theta < task.least):
        return -math.inf
    square = np.array([float(np.mean(r**2)) for r in task.residuals(theta)])
    variance = discrepancies(task.channels, np.sqrt(square)) ** 2
    pieces = np.array([c.pieces for c in task.channels])
    data = float(np.sum(pieces * (square / variance + np.log(variance))))
    return -0.5 * (data + float(np.sum(((theta - task.mean) / task.prior) ** 2)))


def stack(task: Problem, residuals: list[Array], sigma: Array) -> Array:
    """Residuals with weight so that a series adds pieces * mean square / sigma^2."""
    return np.concatenate(
        [np.sqrt(c.pieces / r.size) / s * r for c, r, s in zip(task.channels, residuals, sigma, strict=True)]
    )


def jacobian(task: Problem, theta: Array, sigma: Array, step: Array, workers: int) -> Array:
    """(residuals, k) central differences of the data part, columns in parallel."""

    def column(i: int) -> Array:
        sides = []
        for sign in (1.0, -1.0):
            moved = theta.copy()
            moved[i] += sign * step[i]
            sides.append(stack(task, task.residuals(moved), sigma))
        return np.asarray((sides[0] - sides[1]) / (2.0 * step[i]))

    with ThreadPoolExecutor(workers) as pool:
        return np.stack(list(pool.map(column, range(theta.size))), axis=1)


def _left(rounds: int, moved: float, before: float, spent: float) -> str:
    """Time that is left, if the moves go on to shrink as in the last round; nothing where they do not shrink."""
    if not 0.0 < moved < before < np.inf or moved < _CLOSE:
        return ""
    further = min(np.ceil(np.log(_CLOSE / moved) / np.log(moved / before)), _ROUNDS - rounds)
    return f"; about {further * spent / rounds:.0f} s left"


def calibrate(
    task: Problem,
    workers: int | None = None,
    each: Callable[[str], None] = lambda text: None,
    start: Array | None = None,
) -> Estimate:
    """Maximum a posteriori multipliers of a problem.

    Parameters
    ----------
    task : From ``problem``.
    workers : Threads; all cores when None. The result does not depend on it.
    each : Called with a line of text after each round.
    start : (k,) where the search begins. When None it begins at the prior means and at the most probable of draws of
        the prior, and the second end is taken where it is the more probable: where a flight at the means never comes
        to its check angle, no derivative says that it could.

    Returns
    -------
    Estimate; the covariance is that of the least-squares problem at the end.
    """
    threads = workers or os.cpu_count() or 1
    if start is not None:
        return _search(task, start, threads, each)
    first, second = (_search(task, begun, threads, each) for begun in (task.mean, _drawn(task, threads)))
    # Two ends of one optimum differ by less than what ends the search.
    better = log_density(task, second.theta) > log_density(task, first.theta) + _MORE
    return second if better else first


def left_out(
    task: Problem, whole: Estimate, dropped: Callable[[Channel], bool], workers: int | None = None
) -> tuple[Estimate, dict[Key, float]]:
    """A calibration without some of the series, and what it predicts of these.

    Parameters
    ----------
    task, whole : The problem, and its optimum, where the search begins.
    dropped : Whether a series is left out; some must stay.
    workers : As of ``calibrate``.

    Returns
    -------
    The optimum of the rest, and for each series left out its root mean square residual there.
    """
    rest = calibrate(task.without(dropped), workers, start=whole.theta)
    return rest, task.without(lambda channel: not dropped(channel)).rms(rest.theta)


def _drawn(task: Problem, threads: int) -> Array:
    """(k,) the most probable of some draws of the prior."""
    scatter = np.random.default_rng(_SEED).standard_normal((_DRAWN, len(task.chosen)))
    draws = np.maximum(task.mean + task.prior * scatter, task.least)
    with ThreadPoolExecutor(threads) as pool:
        found = list(pool.map(lambda theta: log_density(task, theta), draws))
    return np.asarray(draws[int(np.argmax(found))], dtype=np.float64)


def _search(task: Problem, start: Array, threads: int, each: Callable[[str], None]) -> Estimate:
    """The optimum that a search from ``start`` comes to."""
    from scipy.optimize import least_squares

    mean, prior, low = task.mean, task.prior, task.least
    theta = start.copy()
    converged, rounds, moved, began = False, 0, np.inf, time.monotonic()
    sigma = np.ones(len(task.channels))
    for rounds in range(1, _ROUNDS + 1):
        rms = [float(np.sqrt(np.mean(r**2))) for r in task.residuals(theta)]
        sigma = discrepancies(task.channels, rms)

        def residual(x: Array, sigma: Array = sigma) -> Array:
            return np.concatenate([stack(task, task.residuals(x), sigma), (x - mean) / prior])

        def slope(x: Array, sigma: Array = sigma) -> Array:
            data = jacobian(task, x, sigma, _STEP * prior, threads)
            return np.concatenate([data, np.diag(1.0 / prior)])

        solved = least_squares(
            residual, theta, jac=slope, bounds=(low, np.inf), x_scale=prior, max_nfev=_INNER, xtol=1e-4, ftol=1e-4
        )
        before, moved = moved, float(np.max(np.abs(solved.x - theta) / prior))
        theta = solved.x
        text = f"round {rounds}: cost {solved.cost:.2f}, largest move {moved:.3f} prior standard deviations"
        each(text + _left(rounds, moved, before, time.monotonic() - began))
        if moved < _CLOSE:
            converged = True
            break
    return _estimate(task, theta, sigma, threads, converged, rounds)


def _estimate(task: Problem, theta: Array, sigma: Array, threads: int, converged: bool, rounds: int) -> Estimate:
    """The optimum with the covariance of its least-squares problem."""
    prior = task.prior
    data = jacobian(task, theta, sigma, _STEP * prior, threads)
    information = data.T @ data
    covariance = np.asarray(np.linalg.inv(information + np.diag(1.0 / prior**2)), dtype=np.float64)
    last = task.residuals(theta)
    final = [float(np.sqrt(np.mean(r**2))) for r in last]
    keys = [c.key for c in task.channels]
    return Estimate(
        np.asarray(theta, dtype=np.float64),
        covariance,
        information,
        dict(zip(keys, final, strict=True)),
        dict(zip(keys, [float(s) for s in sigma], strict=True)),
        stack(task, last, sigma),
        data,
        converged,
        rounds,
    )
