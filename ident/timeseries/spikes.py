"""Samples inside of a channel's range that their neighbours do not lead to: dropouts to zero, bits that flipped.

Beyond the range of a record a spike is told by its size; within an oscillation it is not, and is told by the
median of seven around it. What is usual is learnt from the record: the robust scatter about that median, and the
steps from one sample to the next.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.timeseries import MAD_TO_SIGMA

Array = NDArray[np.float64]
# A spike of three samples leaves four of seven.
_WINDOW = 7
_HALF = _WINDOW // 2
# Samples whose surroundings are kept to learn from, and the fewest of them.
_KEPT, _FEWEST = 1 << 12, 40
# Further from the median than so many robust standard deviations, so many of the large steps and this part of the
# range; where more than a twentieth is, it is the channel's way.
_FAR, _STEPS, _LARGE, _RANGE, _MOST = 12.0, 2.2, 0.9, 0.05, 0.05


class Surroundings:
    """How far the samples of a channel usually are from those around them."""

    def __init__(self) -> None:
        self._away, self._step = np.zeros(0), np.zeros(0)
        self._stride = 1

    def feed(self, values: Array) -> None:
        """Take in the next samples, none of them NaN."""
        if values.size < _WINDOW:
            return
        # No more windows of a piece than are kept.
        stride = max(self._stride, values.size // _KEPT)
        around = np.lib.stride_tricks.sliding_window_view(values, _WINDOW)[::stride]
        middle = around[:, _HALF]
        self._away = np.concatenate([self._away, np.abs(middle - np.median(around, axis=1))])
        self._step = np.concatenate([self._step, np.abs(middle - around[:, _HALF - 1])])
        while self._away.size > _KEPT:
            self._away, self._step, self._stride = self._away[::2], self._step[::2], 2 * self._stride

    def limit(self, spread: float) -> float:
        """Distance from the median of seven that no sample of the channel has by itself; infinite where none is known.

        Parameters
        ----------
        spread : Between the outermost hundredths of the channel.
        """
        if self._away.size < _FEWEST:
            return float("inf")
        usual = MAD_TO_SIGMA * float(np.median(self._away))
        limit = max(_FAR * usual, _STEPS * float(np.quantile(self._step, _LARGE)), _RANGE * spread)
        return limit if limit > 0.0 and float((self._away > limit).mean()) <= _MOST else float("inf")


def beside_the_way(column: Array, limit: float) -> NDArray[np.bool_]:
    """Samples further than a limit from the median of seven around them.

    Parameters
    ----------
    column : (n,) Samples in their order; a NaN counts as the one before.
    limit : Of ``Surroundings.limit``.
    """
    mark = np.zeros(column.size, dtype=bool)
    if not np.isfinite(limit) or column.size < _WINDOW:
        return mark
    there = np.isfinite(column)
    if not there.all():
        if not there.any():
            return mark
        place = np.maximum.accumulate(np.where(there, np.arange(column.size), np.flatnonzero(there)[0]))
        column = column[place]
    # Into a spike there is a step; elsewhere nothing has to be sorted.
    jumps = np.flatnonzero(np.abs(np.diff(column)) > 0.3 * limit)
    if not jumps.size:
        return mark
    near = np.unique(np.clip(jumps[:, None] + np.arange(-_HALF, _HALF + 2), 0, column.size - 1))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(column, _HALF, mode="edge"), _WINDOW)[near]
    mark[near] = np.abs(column[near] - np.median(around, axis=1)) > limit
    return mark & there
