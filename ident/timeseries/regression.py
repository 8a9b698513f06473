"""Least squares with the unscaled covariance, in full accuracy for ill-conditioned designs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_REFINEMENTS = 2


def least_squares(x: Array, y: Array, weight: Array | None = None) -> tuple[Array, Array]:
    """Weighted least squares by Householder QR of the scaled design, refined (Bjorck 1967).

    Parameters
    ----------
    x : (n, p) design.
    y : (n,) or (n, channels) measured.
    weight : (n,) weights of the squares; ones by default.

    Returns
    -------
    values : (p,) or (p, channels).
    inverse : (p, p), (X' W X)^-1; times the variance of an observation of weight one it is
        the covariance of the values.

    Raises
    ------
    numpy.linalg.LinAlgError
        When the columns of ``x`` are linearly dependent to rounding.

    Notes
    -----
    Held against the NIST StRD linear sets (``tests/test_nist_strd_linear.py``).
    """
    from scipy.linalg import solve_triangular

    root = np.ones(len(x)) if weight is None else np.sqrt(weight)
    a, b = x * root[:, None], (y.T * root).T
    size = np.linalg.norm(a, axis=0)
    if not np.all(size > 0.0):
        raise np.linalg.LinAlgError("a column of zeros")
    # Powers of two scale without rounding.
    size = 2.0 ** np.round(np.log2(size))
    a = a / size
    q, r = np.linalg.qr(a)
    diagonal = np.abs(np.diag(r))
    if diagonal.min() <= len(x) * np.finfo(float).eps * diagonal.max():
        raise np.linalg.LinAlgError("columns that depend on each other")
    values = solve_triangular(r, q.T @ b)
    residual = b - a @ values
    for _ in range(_REFINEMENTS):
        # Of the augmented system r + A x = b, A' r = 0, residuals in extended precision.
        wide, left = a.astype(np.longdouble), residual.astype(np.longdouble)
        f = (b.astype(np.longdouble) - left - wide @ values.astype(np.longdouble)).astype(float)
        g = (-(wide.T @ left)).astype(float)
        h, d = solve_triangular(r, g, trans="T"), q.T @ f
        values = values + solve_triangular(r, d - h)
        residual = residual + f - q @ d + q @ h
    half = solve_triangular(r, np.eye(len(r)))
    return (values.T / size).T, half @ half.T / np.outer(size, size)
