"""Time histories in bounded memory: block means of channels and regressors as they stream by.

Consecutive samples are averaged into a bounded number of blocks, and the regressors of the
fit (one; harmonics; powers of time) are averaged over the same blocks, so that the
least-squares fit of block means is unbiased whatever their length.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.clock import gap_before

Array = NDArray[np.float64]
# Times (n,) -> columns (n, p).
Regressors = Callable[[Array], Array]

_MOST = 1 << 15


class Condensed:
    """Block means of samples that are fed in pieces.

    Parameters
    ----------
    regressors : Times (n,) -> (n, p) columns to be averaged with the samples.
    channels : Number of channels of a sample, time left out.
    most : Blocks to keep; the block length doubles when they are full.
    """

    def __init__(self, regressors: Regressors, channels: int, most: int = _MOST) -> None:
        self.regressors = regressors
        self.p = regressors(np.zeros(1)).shape[1]
        self.most = most
        self.length = 1
        self.samples = 0
        # Columns: weight, then weighted time, regressors and channels.
        self._full = np.zeros((0, 2 + self.p + channels))
        self._rest = np.zeros((0, 2 + self.p + channels))
        self._last: float | None = None
        self._alone: tuple[Array, Array, NDArray[np.bool_]] | None = None

    def add(self, time: Array, values: Array, bad: NDArray[np.bool_] | None = None) -> None:
        """Take in some samples.

        Parameters
        ----------
        time : (n,) rising, [s].
        values : (n, channels).
        bad : (n,) samples to leave out; they weigh nothing, and their neighbours no more for it.
        """
        bad = np.zeros(time.size, dtype=bool) if bad is None else bad
        if self._alone is not None:
            time, values = np.append(self._alone[0], time), np.vstack([self._alone[1], values])
            bad = np.append(self._alone[2], bad)
            self._alone = None
        if not time.size:
            return
        if self._last is None and time.size == 1:
            # The first step is not known before the second sample.
            self._alone = (time, values, bad)
            return
        self.samples += time.size - int(bad.sum())
        # A sample stands for the step that ends in it, so uneven steps weigh as they last.
        step = np.diff(time, prepend=time[0] if self._last is None else self._last)
        if self._last is None:
            step[0] = step[1]
        self._last = float(time[-1])
        # The sample behind a gap does not stand for it.
        gap = gap_before(step)
        if gap.any():
            step[gap] = np.median(step[~gap])
        if bad.any():
            step, time, values = step[~bad], time[~bad], values[~bad]
        sample = np.column_stack([time, self.regressors(time), values])
        rows = np.column_stack([step, step[:, None] * sample])
        self._rest = np.vstack([self._rest, rows])
        n = len(self._rest) // self.length
        if n:
            whole = self._rest[: n * self.length].reshape(n, self.length, -1).sum(axis=1)
            self._rest = self._rest[n * self.length :]
            self._full = np.vstack([self._full, whole])
        while len(self._full) > self.most:
            pairs = len(self._full) // 2
            odd = self._full[2 * pairs :]
            self._full = self._full[: 2 * pairs].reshape(pairs, 2, -1).sum(axis=1)
            self.length *= 2
            if len(odd):
                # The odd block goes back in front of the samples that follow it.
                self._rest = np.vstack([self._split(odd, self.length // 2), self._rest])

    @staticmethod
    def _split(block: Array, parts: int) -> Array:
        return np.repeat(block / parts, parts, axis=0)

    def blocks(self) -> tuple[Array, Array, Array, Array]:
        """Weights (n,), mean times (n,), regressors (n, p) and channels (n, channels)."""
        weight = self._full[:, :1]
        means = self._full[:, 1:] / weight
        return self._full[:, 0], means[:, 0], means[:, 1 : 1 + self.p], means[:, 1 + self.p :]


def constant(time: Array) -> Array:
    """Regressor of a steady test."""
    return np.ones((time.size, 1))


def harmonics(frequency: float, phase: float = 0.0) -> Regressors:
    """Regressors 1, sin, cos, sin 2, cos 2, sin 3, cos 3 of 2 pi f t + phase.

    Parameters
    ----------
    frequency : f [Hz].
    phase : of the displacement at time zero [rad].
    """

    def regressors(time: Array) -> Array:
        angle = 2.0 * math.pi * frequency * time + phase
        columns = [f(k * angle) for k in (1, 2, 3) for f in (np.sin, np.cos)]
        return np.column_stack([np.ones(time.size), *columns])

    return regressors


def powers(middle: float, span: float) -> Regressors:
    """Regressors 1, tau, tau^2 with tau = (t - middle) / span, for constant acceleration."""

    def regressors(time: Array) -> Array:
        tau = (time - middle) / span
        return np.column_stack([np.ones(time.size), tau, tau**2])

    return regressors


def condense(
    chunks: Iterator[tuple[Array, Array, NDArray[np.bool_]]], regressors: Regressors, channels: int
) -> Condensed:
    """Feed all (time, values, samples to leave out) pieces of a history into block means."""
    condensed = Condensed(regressors, channels)
    for time, values, bad in chunks:
        condensed.add(time, values, bad)
    return condensed
