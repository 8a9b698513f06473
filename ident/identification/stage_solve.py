"""Weighted least squares on sparse, mostly diagonal systems, with what cannot be found.

The unknowns are as many as the tables have values; the equations as many as there are loads.
So nothing here is equations by equations: the operator of each block of unknowns has its
equations alone, and errors that several loads share enter as one column for each error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from ident.cluster import Spread, here

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
# A matrix, full or sparse.
Matrix = Any

# Singular values below this fraction of the largest do not determine anything.
_RANK = 1e-9
# Equations up to which matrices are full: for few, sparse ones are slower.
_FULL = 2000
# Numbers of the blocks that are solved at once.
_SHARE = 200_000
# An equation with this leverage or more has nothing to be compared with.
_FREE = 1.0 - 1e-9


def weights(a: Matrix, sigma: Array) -> Array:
    """Weight of each equation.

    Parameters
    ----------
    a : (equations, unknowns) design.
    sigma : (equations,) standard errors.

    Returns
    -------
    1/sigma; an equation without any error outweighs the best of the others.
    """
    scale = abs(a).max(axis=1) if isinstance(a, np.ndarray) else abs(csr_array(a)).max(axis=1).toarray()
    # An equation of nothing says nothing, whatever its weight.
    scale = np.where(scale > 0.0, scale, np.inf)
    relative = sigma / scale
    positive = relative[relative > 0.0]
    least = 1e-3 * positive.min() if positive.size else 1.0
    return 1.0 / (np.where(relative > 0.0, relative, least) * scale)


def gain_matrix(a: Matrix, weight: Array, spread: Spread = here) -> tuple[Matrix, list[int]]:
    """Weighted least-squares operator, solved block by block.

    Parameters
    ----------
    a : (equations, unknowns) design, full or sparse.
    weight : (equations,) from ``weights``.
    spread : Solves the blocks, some at a time.

    Returns
    -------
    gain : (unknowns, equations), estimate = gain @ measured; full or sparse as ``a``.
    lost : Columns that the equations do not determine.
    """
    design = csr_array(a)
    design.eliminate_zeros()
    lost: list[int] = []
    operators: list[tuple[Indices, Indices, Array]] = []
    places: list[list[tuple[Indices, Indices]]] = []

    def shares() -> Iterator[tuple[list[tuple[Array, Array]]]]:
        for some in _together(_blocks(design)):
            places.append([(r, c) for r, c, _ in some])
            yield ([(local, weight[r]) for r, _, local in some],)

    for number, solved in enumerate(spread(_operators, shares())):
        for (r, c), (operator, undetermined) in zip(places[number], solved, strict=True):
            lost += [int(c[k]) for k in undetermined]
            if operator is not None:
                operators.append((c, r, operator))
    return _assembled(operators, (design.shape[1], design.shape[0]), isinstance(a, np.ndarray)), lost


def _together(blocks: Iterator[tuple[Indices, Indices, Array]]) -> Iterator[list[tuple[Indices, Indices, Array]]]:
    """Blocks in lists of some size: one by one they are too small to be sent anywhere."""
    some: list[tuple[Indices, Indices, Array]] = []
    size = 0
    for block in blocks:
        some.append(block)
        size += block[2].size
        if size >= _SHARE:
            yield some
            some, size = [], 0
    if some:
        yield some


def _operators(blocks: list[tuple[Array, Array]]) -> list[tuple[Array | None, list[int]]]:
    """Operator and undetermined columns of each block, a full design with the weights of its equations."""
    return [_operator(local, weight) for local, weight in blocks]


def _operator(design: Array, weight: Array) -> tuple[Array | None, list[int]]:
    local = design * weight[:, None]
    size = np.linalg.norm(local, axis=0)
    if not (np.isfinite(local).all() and np.all(size > 0.0)):
        return None, list(range(local.shape[1]))
    u, s, vt = np.linalg.svd(local / size, full_matrices=False)
    good = s > _RANK * s[0]
    lost: list[int] = []
    if good.sum() < local.shape[1]:
        null = _null_space(local / size, int(good.sum()))
        lost = [k for k in range(local.shape[1]) if np.abs(null[:, k]).max() > 1e-6]
    inverse = (vt[good].T / s[good]) @ u[:, good].T
    return inverse / size[:, None] * weight[None, :], lost


def _blocks(design: csr_array) -> Iterator[tuple[Indices, Indices, Array]]:
    """Equations and unknowns that have only to do with one another: rows, columns, and the full part."""
    n_rows, n_columns = design.shape
    rows = np.repeat(np.arange(n_rows), np.diff(design.indptr))
    links = coo_array((np.ones(rows.size), (rows, n_rows + design.indices)), shape=(n_rows + n_columns,) * 2)
    count, label = connected_components(links, directed=False)
    members = []
    for labels in (label[:n_rows], label[n_rows:]):
        order = np.argsort(labels, kind="stable")
        members.append(np.split(order, np.searchsorted(labels[order], np.arange(1, count))))
    place = np.zeros(n_columns, dtype=np.int64)
    # All equations in the order of their blocks: each block is a stretch of them.
    ordered = design[np.concatenate(members[0])] if members[0] else design
    first = 0
    for r, c in zip(*members, strict=True):
        if c.size:
            place[c] = np.arange(c.size)
            ends = ordered.indptr[first : first + r.size + 1]
            local = np.zeros((r.size, c.size))
            entry = np.repeat(np.arange(r.size), np.diff(ends))
            local[entry, place[ordered.indices[ends[0] : ends[-1]]]] = ordered.data[ends[0] : ends[-1]]
            yield r, c, local
        first += r.size


def _null_space(local: Array, rank: int) -> Array:
    """Combinations of the unknowns that the equations say nothing of, a row each."""
    square = np.linalg.qr(local, mode="r") if local.shape[0] > local.shape[1] else local
    return np.linalg.svd(square)[2][rank:]


def _assembled(operators: list[tuple[Indices, Indices, Array]], shape: tuple[int, int], full: bool) -> Matrix:
    """The blocks in one matrix."""
    if full:
        gain = np.zeros(shape)
        for c, r, block in operators:
            gain[np.ix_(c, r)] = block
        return gain
    if not operators:
        return csr_array(shape)
    rows = np.concatenate([np.repeat(c, r.size) for c, r, _ in operators])
    columns = np.concatenate([np.tile(r, c.size) for c, r, _ in operators])
    return csr_array((np.concatenate([block.ravel() for *_, block in operators]), (rows, columns)), shape=shape)


@dataclass(frozen=True)
class Stage:
    """What a stage found.

    Attributes
    ----------
    values : (new,) coefficients.
    covariance : (new, new) of them.
    cross : (new, old) their covariance with the values found before.
    lost : Those that the equations do not determine.
    residual : (equations,) what the values leave of each load.
    leverage : (equations,) share of each load in its own fit.
    """

    values: Array
    covariance: Array
    cross: Array
    lost: list[int]
    residual: Array
    leverage: Array

    def scores(self, sigma: Array) -> Array:
        """(equations,) residuals in their own standard errors; zero where nothing else speaks of the load."""
        spread = sigma * np.sqrt(np.maximum(1.0 - self.leverage, 0.0))
        compared = (self.leverage < _FREE) & (spread > 0.0)
        return np.divide(np.abs(self.residual), spread, out=np.zeros(len(sigma)), where=compared)


@dataclass(frozen=True)
class Loads:
    """The measured loads of a stage's equations, with their errors.

    Attributes
    ----------
    measured, sigma : (equations,) loads and their standard errors.
    sign : (equations,) sign with which each load has the error it shares; 0 where it shares none.
    shared : (equations,) number of the error that each load has.
    """

    measured: Array
    sigma: Array
    sign: Array
    shared: Indices

    def errors(self) -> csr_array:
        """(equations, errors): independent errors of one standard deviation, and their sign in each load."""
        number = np.where(self.sign == 0.0, self.shared.max(initial=0) + 1 + np.arange(len(self.sigma)), self.shared)
        _, column = np.unique(number, return_inverse=True)
        size = np.where(self.sign == 0.0, self.sigma, self.sign * self.sigma)
        shape = (len(self.sigma), int(column.max(initial=-1)) + 1)
        return csr_array((size, (np.arange(len(self.sigma)), column)), shape=shape)


def solve_stage(
    a: csr_array,
    b: csr_array,
    loads: Loads,
    values: Array,
    covariance: Array,
    full: int = _FULL,
    spread: Spread = here,
) -> Stage:
    """Weighted least squares for the unknowns of a stage, with their covariance.

    measured = a new + b old + error. The estimate weighs every equation by its own error; its
    covariance has the errors that copies of a run share and those of the values subtracted:
    with G the operator and E the (equations, errors) matrix of independent errors,
    cov(new) = G E (G E)' + (G b) C (G b)', cov(new, old) = -(G b) C.

    Parameters
    ----------
    a, b : (equations, new) and (equations, old) factors.
    loads : Of the equations.
    values, covariance : (old,) and (old, old) known from earlier stages.
    full : Equations up to which matrices are full.
    spread : Solves the blocks of unknowns.

    Returns
    -------
    Stage.
    """
    design, known = (a.toarray(), b.toarray()) if len(loads.sigma) <= full else (a, b)
    gain, lost = gain_matrix(design, weights(design, loads.sigma), spread)
    rest = loads.measured - known @ values
    new = gain @ rest
    noise = gain @ loads.errors()
    carried = _full(gain @ known)
    seen = carried @ covariance
    leverage = (
        np.einsum("ij,ji->i", design, gain)
        if isinstance(design, np.ndarray)
        else np.asarray(design.multiply(gain.T).sum(axis=1)).ravel()
    )
    return Stage(new, _full(noise @ noise.T) + seen @ carried.T, -seen, lost, rest - design @ new, leverage)


def _full(matrix: Matrix) -> Array:
    dense: Array = matrix if isinstance(matrix, np.ndarray) else matrix.toarray()
    return dense
