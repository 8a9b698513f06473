"""Correlated standard normal draws that are the same on every machine.

Eigenvectors of equal eigenvalues are any basis of their space, and which one a library returns
depends on its blocking, its threads and the processor. The factor here is unique: a pivoted
Cholesky factor of each connected block of the correlations, in arithmetic of a stated order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.files.errors import InputError

Array = NDArray[np.float64]
Places = NDArray[np.int64]

# Variances that differ by less are equal: the database holds six digits of a correlation, which adds
# up to less than this over blocks of a thousand values.
_EQUAL = 1e-5
# Variance below which a value has no score of its own among the values of its coefficient: draws leave
# out up to twice ``_EQUAL`` of it.
_SCORED = 1e-4
# Samples drawn at once: their numbers stay in the processor's cache while the columns are added.
_AT_ONCE = 32
# A matrix that its factor gives back no better than this is not one of correlations.
_REFUSED = 1e-3


@dataclass(frozen=True)
class Block:
    """Factor of values that are correlated with one another and with no others.

    Attributes
    ----------
    members : (k,) places of the values in the whole matrix, ascending.
    pivots : (rank,) members whose own normal number each column takes, in the order of the pivots.
    root : (k, rank), root root^T is the block's correlation.
    """

    members: Places
    pivots: Places
    root: Array


def factor(correlation: Array, least: float = 2.0 * _EQUAL) -> list[Block]:
    """Pivoted Cholesky factor of a correlation matrix, block by block; semidefinite is allowed.

    In each block the value with the largest variance that the pivots so far leave is the next
    pivot p, with a column l = s_p / sqrt(s_pp) of the remainder s, which becomes s - l l^T
    (Higham 2002, *Accuracy and stability of numerical algorithms*, 2nd ed., section 10.3). Of
    variances that are equal to 1e-5 the first in the order of the matrix is taken; where all are
    ``least`` or less the rest is taken to follow from the pivots.

    Every step is one multiplication, one division or one subtraction an element, so that the
    result is the same to the last bit whatever the processor and its libraries.

    Parameters
    ----------
    correlation : (n, n) symmetric with unit diagonal, zero where values are independent.
    least : Largest variance, of one, that is left out.

    Returns
    -------
    Blocks in the order of their first members.

    Raises
    ------
    InputError
        When the matrix is not positive semidefinite to three figures, or not finite.

    Examples
    --------
    >>> factor(np.array([[1.0, 0.6], [0.6, 1.0]]))[0].root.tolist()
    [[1.0, 0.0], [0.6, 0.8]]
    """
    from scipy.sparse.csgraph import connected_components

    if not np.isfinite(correlation).all():
        raise InputError("correlations", "values that are not finite", "numbers from -1 to 1")
    count, label = connected_components(correlation != 0.0, directed=False)
    members = sorted((np.flatnonzero(label == k) for k in range(count)), key=lambda place: int(place[0]))
    return [_block(place.astype(np.int64), correlation[np.ix_(place, place)], least) for place in members]


def _block(members: Places, correlation: Array, least: float) -> Block:
    rest, product, pivots, columns = correlation.copy(), np.empty_like(correlation), [], []
    left = np.ones(members.size, dtype=bool)
    for _ in range(members.size):
        variance = np.where(left, np.diag(rest), -np.inf)
        if variance.max() <= least:
            break
        pivot = int(np.argmax(variance >= variance.max() - _EQUAL))
        # Rows of earlier pivots are zero but for rounding.
        column = np.where(left, rest[:, pivot] / np.sqrt(rest[pivot, pivot]), 0.0)
        rest -= np.multiply(column[:, None], column, out=product)
        left[pivot] = False
        pivots.append(pivot)
        columns.append(column)
    rest = rest[np.ix_(left, left)]
    if rest.size and np.abs(rest).max() > _REFUSED:
        wrong = f"off by {np.abs(rest).max():.2g} from any positive semidefinite matrix"
        raise InputError(f"correlations of {members.size} values", wrong, "correlations as a fit writes them")
    return Block(members, members[pivots], np.stack(columns, axis=1))


def draw(correlation: Array, samples: int, seed: int) -> Array:
    """Correlated standard normal draws, the same on every machine.

    Sample i has its own generator and every value its own normal number z; a value is the sum
    over the columns of ``factor`` of root times z of the column's pivot, in their order.

    Parameters
    ----------
    correlation : As of ``factor``.
    samples, seed : Number of draws and seed of the generator.

    Returns
    -------
    (samples, n) in standard errors; sample i does not depend on how many are drawn.

    Raises
    ------
    InputError
        As ``factor``.
    """
    children = np.random.SeedSequence(seed).spawn(samples)
    normal = np.stack([np.random.default_rng(child).standard_normal(len(correlation)) for child in children])
    out = np.zeros_like(normal)
    for block in factor(correlation):
        for low in range(0, samples, _AT_ONCE):
            some = normal[low : low + _AT_ONCE, block.pivots]
            # Element by element: a product of matrices would round as its library sees fit.
            total = np.zeros((len(some), block.members.size))
            share = np.empty_like(total)
            for z, column in zip(some.T, block.root.T, strict=True):
                total += np.multiply(z[:, None], column, out=share)
            out[low : low + _AT_ONCE, block.members] = total
    return out


def scores(draws: Array, correlation: Array) -> Array:
    """Independent standard scores behind correlated draws: the normal numbers of the pivots.

    Parameters
    ----------
    draws : (samples, n) in standard errors.
    correlation : (n, n) they were drawn with, or the rows and columns of some of them.

    Returns
    -------
    (samples, rank), by forward substitution in each block's factor.
    """
    independent: list[Array] = []
    for block in factor(correlation, _SCORED):
        place = {int(member): row for row, member in enumerate(block.members)}
        of_block: list[Array] = []
        for k, pivot in enumerate(block.pivots):
            row = block.root[place[int(pivot)]]
            left = draws[:, pivot].copy()
            for score, share in zip(of_block, row[:k], strict=True):
                left -= share * score
            of_block.append(left / row[k])
        independent += of_block
    return np.stack(independent, axis=1)
