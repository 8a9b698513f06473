"""How rows of the coefficient database are written as text: their digest and their correlations."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
# Correlations below this are rounding.
_LEAST_CORRELATION = 1e-6


def digest(rows: pd.DataFrame, columns: Sequence[str]) -> str:
    """SHA-256 of the content of database rows, independent of their order.

    Parameters
    ----------
    rows : Database rows.
    columns : The columns that count, in the order of the schema.

    Returns
    -------
    Hexadecimal digest of one line a row, its cells in ``repr`` and separated by tabs, empty
    for a cell without a value; lines sorted.
    """
    lines = sorted(map("\t".join, zip(*[_texts(rows[column]) for column in columns], strict=True)))
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _texts(column: pd.Series[Any]) -> list[str]:
    values = column.to_numpy()
    if values.dtype.kind in "fi":
        # Most cells of an axis are empty.
        texts = [""] * len(values)
        present = np.flatnonzero(values == values)
        for i, x in zip(present.tolist(), values[present].tolist(), strict=True):
            texts[i] = repr(x)
        return texts
    # Most texts of a column are alike, and some have many kilobytes.
    known: dict[str, str] = {}
    return [known[x] if x in known else known.setdefault(x, _text(x)) for x in values.tolist()]


def _text(x: Any) -> str:
    return "" if x is None or x != x else repr(x)


def correlation_texts(covariance: Array, names: Iterable[int] | None = None) -> dict[int, str]:
    """The ``correlation`` cells of estimates.

    Parameters
    ----------
    covariance : (n, n) of the estimates.
    names : Numbers of the estimates; 0 to n - 1 when None.

    Returns
    -------
    Number of an estimate -> ``other:coefficient`` pairs; estimates without any are left out.

    Example
    -------
    >>> correlation_texts(np.array([[4.0, 1.0], [1.0, 1.0]]), [7, 9])
    {7: '9:0.5', 9: '7:0.5'}
    """
    number = list(range(len(covariance)) if names is None else names)
    stderr = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    scale = np.outer(stderr, stderr)
    matrix = np.divide(covariance, scale, out=np.zeros_like(covariance), where=scale > 0.0)
    np.fill_diagonal(matrix, 0.0)
    row, column = np.nonzero(np.abs(matrix) > _LEAST_CORRELATION)
    # A version has some hundred thousand pairs, half of them equal to another: each number is written once.
    different, which = np.unique(matrix[row, column], return_inverse=True)
    written = np.array([f"{x:.6g}" for x in different.tolist()], dtype=object)
    before = np.array([f"{n}:" for n in number], dtype=object)
    pairs = (before[column] + written[which]).tolist()
    ends = np.searchsorted(row, np.arange(len(number) + 1)).tolist()
    return {number[i]: " ".join(pairs[low:high]) for i, (low, high) in enumerate(pairwise(ends)) if low < high}


def correlation_pairs(text: str) -> dict[int, float]:
    """One ``correlation`` cell: estimate number -> correlation coefficient."""
    # One split for all of them: a cell may hold some hundred.
    words = text.replace(":", " ").split()
    return dict(zip(map(int, words[::2]), map(float, words[1::2]), strict=True))


def correlation_matrix(rows: pd.DataFrame) -> tuple[pd.DataFrame, Array]:
    """One row an estimate, and the correlation matrix of the estimates.

    Parameters
    ----------
    rows : Database rows of one vehicle.

    Returns
    -------
    estimates : First row of each estimate, in the order of the matrix.
    correlation : (n, n), unit diagonal.
    """
    known = rows[rows["estimate"] >= 0].drop_duplicates("estimate").reset_index(drop=True)
    place = {int(e): i for i, e in enumerate(known["estimate"])}
    matrix = np.eye(len(known))
    for i, text in enumerate(known["correlation"]):
        for other, coefficient in correlation_pairs(text).items():
            matrix[i, place[other]] = coefficient
    return known, 0.5 * (matrix + matrix.T)
