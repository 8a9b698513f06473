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

# Columns worked on at once: their rows stay in the processor's cache.
_COLUMNS = 64


@outer
def _add_products(a: Array, b: Array, tile: Array, sums: Array, out: Array) -> None:
    # Not known to the compiler, which would write a known number of columns out one by one.
    columns = tile.shape[1]
    for first in range(0, b.shape[1], columns):
        width = min(columns, b.shape[1] - first)
        for t in range(b.shape[0]):
            for j in range(width):
                tile[t, j] = b[t, first + j]
        for i in range(a.shape[0]):
            for j in range(columns):
                sums[j] = 0.0
            for t in range(a.shape[1]):
                share = a[i, t]
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
    tile, sums = np.zeros((b.shape[0], _COLUMNS)), np.zeros(_COLUMNS)
    _add_products(np.ascontiguousarray(a), np.ascontiguousarray(b), tile, sums, out)
    return out
