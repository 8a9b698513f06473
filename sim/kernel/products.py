"""Sums of products in one order, on every machine and for any number of threads.

A product of matrices by a linear algebra library rounds by its kernels and its threads. Here each
element is summed along one index after the other, and the processor works on several elements at
once: the result is the same to the last bit everywhere, and nearly as quick.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.compiled import outer

Array = NDArray[np.float64]

# Columns and products of each worked on at once: they stay in the processor's nearest cache.
_COLUMNS, _DEEP = 64, 64
# Products added in one pass over the sums, one after the other: sums are read and written less often.
_AT_ONCE = 4


@outer
def _add_products(a: Array, b: Array, tile: Array, sums: Array, out: Array) -> None:
    # Not known to the compiler, which would write a known number of columns out one by one.
    deep, columns = tile.shape
    for first in range(0, b.shape[1], columns):
        width = min(columns, b.shape[1] - first)
        for start in range(0, b.shape[0], deep):
            depth = min(deep, b.shape[0] - start)
            together = depth - depth % _AT_ONCE
            for t in range(depth):
                for j in range(width):
                    tile[t, j] = b[start + t, first + j]
            for i in range(a.shape[0]):
                for j in range(width):
                    sums[j] = out[i, first + j]
                for t in range(0, together, _AT_ONCE):
                    at = start + t
                    one, two, three, four = a[i, at], a[i, at + 1], a[i, at + 2], a[i, at + 3]
                    for j in range(columns):
                        total = sums[j] + one * tile[t, j]
                        total += two * tile[t + 1, j]
                        total += three * tile[t + 2, j]
                        sums[j] = total + four * tile[t + 3, j]
                for t in range(together, depth):
                    share = a[i, start + t]
                    for j in range(columns):
                        sums[j] += share * tile[t, j]
                for j in range(width):
                    out[i, first + j] = sums[j]


def product(a: Array, b: Array) -> Array:
    """The matrix product (n, m) of (n, k) and (k, m), each element summed along k in its order.

    Examples
    --------
    >>> product(np.array([[1.0, 2.0]]), np.array([[3.0], [4.0]])).tolist()
    [[11.0]]
    """
    out = np.zeros((a.shape[0], b.shape[1]))
    tile, sums = np.zeros((_DEEP, _COLUMNS)), np.zeros(_COLUMNS)
    _add_products(np.ascontiguousarray(a), np.ascontiguousarray(b), tile, sums, out)
    return out
