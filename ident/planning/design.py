"""D-optimal designs: which candidate runs tell most, and the fewest that are enough.

A candidate run is a block of equations, rows over their standard errors, in the unknowns.
With precision M of what is known already, a run F adds F^T F, and
det(M + F^T F) = det(M) det(I + F M^-1 F^T). Exact designs by greedy choice and exchange
(Fedorov 1972, *Theory of optimal experiments*; Atkinson, Donev and Tobias 2007, ch. 12).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

# Rises of log det that differ by less are equal: an exchange must raise it by more.
_LEAST_GAIN = 1e-9
# Squared row over variance below this tells nothing of an unknown.
_HELPS = 1e-6
# A run that carried all but this part of some precision is taken away without an update.
_NEARLY = 1e-6


def _inverse(information: Array) -> Array:
    """Inverse of a precision; where rounding makes it singular, what nothing tells of has a very large variance."""
    try:
        return np.asarray(np.linalg.inv(information), dtype=np.float64)
    except np.linalg.LinAlgError:
        size = np.sqrt(np.diag(information))
        scale = 1.0 / np.where(size > 0.0, size, 1.0)
        values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
        least = np.finfo(float).eps * len(values) * max(float(values[-1]), 1.0)
        return np.asarray((vectors / np.maximum(values, least)) @ vectors.T * np.outer(scale, scale), dtype=np.float64)


class Design:
    """Repeats of every candidate run, with the covariance they lead to.

    Parameters
    ----------
    candidates : Blocks (equations, unknowns), each row divided by its standard error.
    precision : (unknowns, unknowns) of what is known before, positive definite.
    """

    def __init__(self, candidates: Sequence[Array], precision: Array) -> None:
        deep = max(block.shape[0] for block in candidates)
        self.rows = np.zeros((len(candidates), deep, precision.shape[0]))
        for i, block in enumerate(candidates):
            self.rows[i, : block.shape[0]] = block
        self.counts: Counts = np.zeros(len(candidates), dtype=int)
        self.prior = precision
        self.refresh()

    def refresh(self) -> None:
        """Covariance anew from the counts, free of the rounding of many updates."""
        used = np.flatnonzero(self.counts)
        information = self.prior + np.einsum("n,nkp,nkq->pq", self.counts[used], self.rows[used], self.rows[used])
        self.covariance = _inverse(information)
        self.seen = self.rows @ self.covariance

    @property
    def variance(self) -> Array:
        """Variance of every unknown."""
        return np.diag(self.covariance)

    def gains(self) -> Array:
        """Rise of log det of the information by one more of each candidate."""
        inner = np.einsum("nkp,nlp->nkl", self.seen, self.rows)
        return np.linalg.slogdet(np.eye(inner.shape[1]) + inner)[1]

    def change(self, i: int, by: int) -> None:
        """Add (+1) or take away (-1) one repeat of a candidate, updating the covariance."""
        rows, seen = self.rows[i], self.seen[i]
        inner = np.eye(rows.shape[0]) + by * seen @ rows.T
        self.counts[i] += by
        if by < 0 and np.linalg.eigvalsh(inner)[0] < _NEARLY:
            self.refresh()
            return
        step = by * np.linalg.solve(inner, seen)
        self.covariance = self.covariance - seen.T @ step
        self.seen = self.seen - (self.seen @ rows.T) @ step


def d_optimal(candidates: Sequence[Array], runs: int, precision: Array, most: int | None = None) -> Counts:
    """Exact D-optimal design of a number of runs.

    Parameters
    ----------
    candidates, precision : As of ``Design``.
    runs : Number of runs.
    most : Largest number of repeats of one candidate.

    Returns
    -------
    (candidates,) repeats: greedy start, then exchanges until none raises the determinant.
    """
    design = Design(candidates, precision)
    for _ in range(runs):
        design.change(_best(design, most), 1)
    _exchange(design, most)
    return design.counts


def _best(design: Design, most: int | None, allowed: NDArray[np.bool_] | None = None) -> int:
    gains = design.gains()
    if most is not None:
        gains[design.counts >= most] = -np.inf
    if allowed is not None:
        gains[~allowed] = -np.inf
    # The first of those that gain the same: which of them rounding puts first is the machine's.
    return int(np.argmax(gains >= gains.max() - _LEAST_GAIN))


def _exchange(design: Design, most: int | None) -> None:
    """Move single runs while that raises the determinant."""
    for _ in range(10 * int(design.counts.sum()) + 10):
        before = np.linalg.slogdet(design.covariance)[1]
        best, move = 0.0, (-1, -1)
        for i in np.flatnonzero(design.counts):
            design.change(int(i), -1)
            j = _best(design, most)
            gain = float(design.gains()[j] + before - np.linalg.slogdet(design.covariance)[1])
            if gain > best + _LEAST_GAIN:
                best, move = gain, (int(i), j)
            design.change(int(i), 1)
        if move[0] < 0:
            return
        design.change(move[0], -1)
        design.change(move[1], 1)
        design.refresh()


def fewest_runs(
    candidates: Sequence[Array], precision: Array, target: Array, most: int, patience: float = 1.2
) -> Counts:
    """The fewest runs that bring every unknown to its target, as far as they can.

    Parameters
    ----------
    candidates, precision : As of ``Design``.
    target : (unknowns,) wanted standard errors; infinite where none is wanted.
    most : Largest number of repeats of one candidate.
    patience : An unknown whose target is out of reach is brought to this multiple of the
        standard error that all repeats of all candidates would give.

    Returns
    -------
    (candidates,) repeats. Greedy by log det among the candidates that help an unknown short
    of its target, then every run that is not needed is taken away, least useful first.
    """
    design = Design(candidates, precision)
    design.counts[:] = most
    design.refresh()
    target = np.where(np.isfinite(target), np.maximum(target, patience * np.sqrt(design.variance)), np.inf)
    design.counts[:] = 0
    design.refresh()
    while True:
        short = np.sqrt(np.maximum(design.variance, 0.0)) > target
        # Part of the variance of each unknown that one more of each candidate would take away.
        shares = design.seen[:, :, short] ** 2 / design.variance[short]
        helps = (shares.max(axis=(1, 2), initial=0.0) > _HELPS) & (design.counts < most)
        if not short.any() or not helps.any():
            break
        design.change(_best(design, most, helps), 1)
        if design.counts.sum() % 50 == 0:
            design.refresh()
    design.refresh()
    _prune(design, np.maximum(target, np.sqrt(design.variance)))
    return design.counts


def _prune(design: Design, reached: Array) -> None:
    """Take away every run without which all unknowns stay within ``reached``."""
    gains = design.gains()
    order = np.argsort(gains, kind="stable")
    # Candidates that gain the same in their own order.
    level = np.cumsum(np.diff(gains[order], prepend=gains[order[0]]) > _LEAST_GAIN)
    order = order[np.lexsort((order, level))]
    for i in order[design.counts[order] > 0]:
        while design.counts[i]:
            design.change(int(i), -1)
            if (np.sqrt(np.maximum(design.variance, 0.0)) > reached * (1.0 + 1e-9)).any():
                design.change(int(i), 1)
                break
    design.refresh()
