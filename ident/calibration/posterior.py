"""Draws of the posterior of a calibration, beside its quadratic at the optimum.

The log density is the objective of ``ident.calibration.estimate``, with the discrepancies at their most likely values
for every set of multipliers: unlike the quadratic it knows how the flights bend and how the weights change. It is
sampled by emcee (Foreman-Mackey et al. 2013, PASP 125, 306): four steps of five propose from a t distribution about
the optimum with the covariance of the quadratic (an independence sampler, Tierney 1994, Annals of Statistics 22),
the fifth is a differential-evolution step (ter Braak 2006, Statistics and Computing 16), which needs no optimum.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.calibration.estimate import Estimate, log_density
from ident.calibration.problem import Problem
from sim.files.extras import library

Array = NDArray[np.float64]

# Share of the steps that propose about the optimum, and degrees of freedom of what they propose from: heavier tails
# than the quadratic's, so that no region which the posterior has is left out.
_SHARE = 0.8
_FREEDOM = 5
# Steps between two lines of progress; first share of the steps that is not counted.
_SAID = 5
_BURNT = 0.2
# Fewer independent draws than this say nothing of a width.
_FEW = 50
# Shift in standard deviations, and factor of the width, from which the quadratic does not tell the posterior.
_SHIFTED = 0.5
_WIDER = 4.0 / 3.0


@dataclass(frozen=True)
class Marginal:
    """The draws of one multiplier.

    Attributes
    ----------
    mean, sigma : Of the draws.
    q025, q50, q975 : Quantiles.
    shift, shift_error : Mean less optimum in standard deviations of the quadratic, and its Monte Carlo error.
    width : Standard deviation of the draws on that of the quadratic.
    """

    mean: float
    sigma: float
    q025: float
    q50: float
    q975: float
    shift: float
    shift_error: float
    width: float


@dataclass(frozen=True)
class Sampled:
    """A sampled posterior.

    Attributes
    ----------
    walkers, steps, seed : Of the sampler; the first fifth of the steps is left out of the draws.
    acceptance : Share of the proposals that were taken.
    autocorrelation : Longest integrated autocorrelation time of a multiplier [steps].
    independent : Independent draws that the rest is worth.
    groups : Name of a group -> its draws.
    """

    walkers: int
    steps: int
    seed: int
    acceptance: float
    autocorrelation: float
    independent: float
    groups: dict[str, Marginal]

    @property
    def tells(self) -> bool:
        """Whether the draws are enough, and lie where the quadratic has them: half a deviation, widths to a third."""
        near = all(abs(g.shift) < _SHIFTED and 1.0 / _WIDER < g.width < _WIDER for g in self.groups.values())
        return self.independent >= _FEW and near

    @property
    def verdict(self) -> str:
        """Whether the quadratic tells the truth, in words."""
        if self.independent < _FEW:
            return f"{self.independent:.0f} independent draws say nothing of the posterior: ask for more"
        worst = max(self.groups.items(), key=lambda g: abs(g[1].shift))
        low, high = min(g.width for g in self.groups.values()), max(g.width for g in self.groups.values())
        text = f"largest shift from the optimum {worst[1].shift:+.2f} +- {worst[1].shift_error:.2f} standard deviations"
        return f"{text} ({worst[0]}); widths {low:.2f} to {high:.2f} times those of the quadratic"


def emcee() -> Any:
    """The sampler's library.

    Raises
    ------
    InputError
        When the extra is not installed.
    """
    return library("emcee", "posterior", "--posterior")


def _about(centre: Array, covariance: Array) -> Callable[[Array, np.random.RandomState], tuple[Array, Array]]:
    """Proposals from a t distribution, whatever the place they start from, and what that costs in the balance."""
    k = len(centre)
    root = np.linalg.cholesky(covariance)
    inverse = np.linalg.inv(root)

    def log_of(x: Array) -> Array:
        square = np.sum(((x - centre) @ inverse.T) ** 2, axis=1)
        return -0.5 * (_FREEDOM + k) * np.log1p(square / _FREEDOM)

    def propose(coords: Array, random: np.random.RandomState) -> tuple[Array, Array]:
        stretch = np.sqrt(_FREEDOM / random.chisquare(_FREEDOM, size=len(coords)))
        new = centre + stretch[:, None] * random.standard_normal(coords.shape) @ root.T
        return new, log_of(coords) - log_of(new)

    return propose


def chain(
    density: Callable[[Array], float],
    centre: Array,
    covariance: Array,
    draws: int,
    seed: int = 0,
    workers: int | None = None,
    each: Callable[[str], None] = lambda text: None,
) -> tuple[Array, float]:
    """Walk through a density from draws about its optimum.

    Parameters
    ----------
    density : (k,) -> log density, -inf where there is none.
    centre, covariance : Its optimum and the covariance of its quadratic.
    draws : Least number of draws, burnt ones among them.
    seed : Of the generator.
    workers : Threads; the chain does not depend on it.
    each : Called with a line of text as the work goes on.

    Returns
    -------
    (steps, walkers, k) draws after the burnt ones, and the share of the proposals that were taken.

    Example
    -------
    >>> walk, taken = chain(lambda x: -0.5 * float(x @ x), np.zeros(2), np.eye(2), 4000)
    >>> bool(abs(walk.mean()) < 0.1), bool(abs(walk.std() - 1.0) < 0.1)
    (True, True)
    """
    library = emcee()
    k = len(centre)
    walkers = 2 * (k + 1)
    steps = max(-(-draws // walkers), 2)
    random = np.random.RandomState(seed)
    at = _about(centre, covariance)(np.zeros((walkers, k)), random)[0]
    moves = [(library.moves.MHMove(_about(centre, covariance)), _SHARE), (library.moves.DEMove(), 1.0 - _SHARE)]
    began = time.monotonic()
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:

        def together(places: Array) -> Array:
            return np.array(list(pool.map(density, places)))

        at = np.where(np.isfinite(together(at))[:, None], at, centre + 1e-3 * (at - centre))
        sampler = library.EnsembleSampler(walkers, k, together, moves=moves, vectorize=True)
        start = library.State(at, random_state=random.get_state())
        for done, _ in enumerate(sampler.sample(start, iterations=steps), start=1):
            if done % _SAID == 0:
                left = (time.monotonic() - began) / done * (steps - done)
                each(f"posterior: step {done} of {steps}; about {left:.0f} s left")
    kept = sampler.get_chain(discard=int(_BURNT * steps))
    return np.asarray(kept, dtype=np.float64), float(np.mean(sampler.acceptance_fraction))


def sample(
    task: Problem,
    estimate: Estimate,
    draws: int,
    seed: int = 0,
    workers: int | None = None,
    each: Callable[[str], None] = lambda text: None,
) -> Sampled:
    """Sample the posterior of a calibration and hold it against the quadratic of its optimum.

    Parameters
    ----------
    task, estimate : A problem and its optimum.
    draws : Least number of draws; each flies all training cases.
    seed, workers, each : As ``chain``.

    Returns
    -------
    Sampled

    Raises
    ------
    InputError
        When the extra ``posterior`` is not installed.
    """
    walk, taken = chain(lambda x: log_density(task, x), estimate.theta, estimate.covariance, draws, seed, workers, each)
    steps, walkers, _ = walk.shape
    longest = float(np.max(emcee().autocorr.integrated_time(walk, tol=0)))
    independent = steps * walkers / max(longest, 1.0)
    groups = {}
    for i, parameter in enumerate(task.chosen):
        drawn, optimum, sigma = walk[:, :, i].ravel(), estimate.theta[i], estimate.deviation[i]
        low, middle, high = (float(q) for q in np.quantile(drawn, [0.025, 0.5, 0.975]))
        deviation = float(drawn.std())
        shift, error = (
            float(x) for x in ((drawn.mean() - optimum) / sigma, deviation / sigma / math.sqrt(independent))
        )
        width = float(deviation / sigma)
        groups[parameter.group.name] = Marginal(float(drawn.mean()), deviation, low, middle, high, shift, error, width)
    burnt = int(_BURNT * max(-(-draws // walkers), 2))
    return Sampled(walkers, steps + burnt, seed, taken, longest, independent, groups)
