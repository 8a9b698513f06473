"""Which groups the maneuvers ask for: comparison of models by their evidence.

A group that is held stays at its prior mean. About the optimum of all groups the residuals are linear in the
multipliers, so that the mean square of every series is a quadratic form, and the evidence of a subset S of free
groups is that of Laplace (MacKay 2003, *Information Theory, Inference, and Learning Algorithms*, chapter 28)::

    2 log Z(S) = - min_{theta, s} [ sum_k n_k (mean r_k^2 / sigma_k^2 + log sigma_k^2)
                                    + sum_S (theta_j - mean_j)^2 / prior_j^2 ] - log det(A P)

with A the curvature in the multipliers of S, P their prior covariance, and the discrepancies s estimated anew for each
subset, as ``ident.calibration.estimate`` does. A multiplier has to pay for its freedom with what it explains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.calibration.estimate import Estimate, discrepancies
from ident.calibration.problem import Channel, Problem

Array = NDArray[np.float64]

# Rounds of multipliers and discrepancies in turn, and the change of log Z at which they end.
_ROUNDS = 60
_CLOSE = 1e-6


@dataclass(frozen=True)
class Quadratic:
    """Mean square residuals near an optimum, as quadratic forms of the multipliers.

    Attributes
    ----------
    channels : The (s,) series.
    at : (k,) multipliers at the optimum.
    mean, prior : (k,) prior means and standard deviations.
    square, slope, curvature : (s,), (s, k), (s, k, k): mean square = square + 2 slope d + d' curvature d, with d from
        ``at``, in the units of the references.
    """

    channels: list[Channel]
    at: Array
    mean: Array
    prior: Array
    square: Array
    slope: Array
    curvature: Array

    @classmethod
    def of(cls, task: Problem, estimate: Estimate) -> Quadratic:
        """The forms of an estimate, from the residuals and derivatives that it ended with."""
        sizes = [c.along.size for c in task.channels]
        ends = np.cumsum(sizes)[:-1]
        r, j = np.split(estimate.residual, ends), np.split(estimate.slope, ends)
        weight = [estimate.sigma[c.key] ** 2 / c.pieces for c in task.channels]
        return cls(
            task.channels,
            estimate.theta,
            task.mean,
            task.prior,
            np.array([w * a @ a for w, a in zip(weight, r, strict=True)]),
            np.stack([w * b.T @ a for w, a, b in zip(weight, r, j, strict=True)]),
            np.stack([w * b.T @ b for w, b in zip(weight, j, strict=True)]),
        )


def log_evidence(near: Quadratic, subset: Sequence[int]) -> float:
    """log Z of a subset of free groups, but for a constant that all subsets share.

    Parameters
    ----------
    near : Mean squares about the optimum of all groups.
    subset : Places of the groups that are free.
    """
    free = list(subset)
    pieces = np.array([c.pieces for c in near.channels])
    away = near.mean - near.at
    value = -np.inf
    for _ in range(_ROUNDS):
        square = near.square + 2.0 * near.slope @ away + np.einsum("skl,k,l->s", near.curvature, away, away)
        square = np.clip(square, 0.0, None)
        variance = discrepancies(near.channels, np.sqrt(square)) ** 2
        weight = pieces / variance
        curvature = np.einsum("s,skl->kl", weight, near.curvature)[np.ix_(free, free)]
        moved = ((near.at + away - near.mean) / near.prior)[free]
        scaled = curvature * np.outer(near.prior[free], near.prior[free]) + np.eye(len(free))
        fit = float(np.sum(weight * square + pieces * np.log(variance)) + moved @ moved)
        last, value = value, -0.5 * (fit + float(np.linalg.slogdet(scaled)[1]))
        if not free or abs(value - last) < _CLOSE:
            break
        slope = weight @ (near.slope + near.curvature @ away)
        step = np.linalg.solve(scaled, -(slope[free] * near.prior[free]) - moved)
        away[free] += step * near.prior[free]
    return value


@dataclass(frozen=True)
class Comparison:
    """What became of the groups.

    Attributes
    ----------
    kept : Places of the groups that the maneuvers ask for, in their order.
    log_evidence : log Z of these free, less that of none.
    every : The same of all groups free.
    gain : (k,) change of log Z by each group's freedom, the others as kept; positive for a group that is asked for.
    """

    kept: tuple[int, ...]
    log_evidence: float
    every: float
    gain: tuple[float, ...]


def compare(task: Problem, estimate: Estimate) -> Comparison:
    """The groups with the largest evidence that steps of one group reach from all and from none.

    Parameters
    ----------
    task, estimate : A problem with all groups free, and its optimum.
    """
    near = Quadratic.of(task, estimate)
    known: dict[frozenset[int], float] = {}
    places = range(len(task.chosen))

    def evidence(subset: frozenset[int]) -> float:
        if subset not in known:
            known[subset] = log_evidence(near, sorted(subset))
        return known[subset]

    def climb(at: frozenset[int]) -> frozenset[int]:
        while True:
            best = max((at ^ {i} for i in places), key=evidence)
            if evidence(best) <= evidence(at) + _CLOSE:
                return at
            at = best

    none, every = frozenset[int](), frozenset(places)
    kept = max((climb(every), climb(none)), key=evidence)
    gain = tuple(evidence(kept | {i}) - evidence(kept - {i}) for i in places)
    return Comparison(tuple(sorted(kept)), evidence(kept) - evidence(none), evidence(every) - evidence(none), gain)
