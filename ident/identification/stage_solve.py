"""Weighted least squares on sparse, mostly diagonal systems, with what cannot be found."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Array = NDArray[np.float64]

# Singular values below this fraction of the largest do not determine anything.
_RANK = 1e-9


def weights(a: Array, sigma: Array) -> Array:
    """Weight of each equation.

    Parameters
    ----------
    a : (equations, unknowns) design.
    sigma : (equations,) standard errors.

    Returns
    -------
    1/sigma; an equation without any error outweighs the best of the others.
    """
    scale = np.abs(a).max(axis=1)
    relative = sigma / scale
    positive = relative[relative > 0.0]
    least = 1e-3 * positive.min() if positive.size else 1.0
    return 1.0 / (np.where(relative > 0.0, relative, least) * scale)


def gain_matrix(a: Array, weight: Array) -> tuple[Array, list[int]]:
    """Weighted least-squares operator, solved block by block.

    Parameters
    ----------
    a : (equations, unknowns) design.
    weight : (equations,) from ``weights``.

    Returns
    -------
    gain : (unknowns, equations), estimate = gain @ measured.
    lost : Columns that the equations do not determine.
    """
    n_rows, n_columns = a.shape
    rows, columns = np.nonzero(a)
    links = coo_array((np.ones(rows.size), (rows, n_rows + columns)), shape=(n_rows + n_columns,) * 2)
    _, label = connected_components(links, directed=False)
    gain = np.zeros((n_columns, n_rows))
    lost: list[int] = []
    for block in np.unique(label[n_rows:]):
        r, c = np.flatnonzero(label[:n_rows] == block), np.flatnonzero(label[n_rows:] == block)
        local = a[np.ix_(r, c)] * weight[r, None]
        size = np.linalg.norm(local, axis=0)
        if not (np.isfinite(local).all() and np.all(size > 0.0)):
            lost += [int(k) for k in c]
            continue
        u, s, vt = np.linalg.svd(local / size, full_matrices=False)
        good = s > _RANK * s[0]
        if good.sum() < c.size:
            null = np.linalg.svd(local / size)[2][good.sum() :]
            lost += [int(c[k]) for k in range(c.size) if np.abs(null[:, k]).max() > 1e-6]
        inverse = (vt[good].T / s[good]) @ u[:, good].T
        gain[np.ix_(c, r)] = inverse / size[:, None] * weight[r][None, :]
    return gain, lost
