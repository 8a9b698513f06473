"""Tables over measured points: completion of ragged grids, interpolation, extrapolation.

A table keeps its measured points. Everything derived from them is *linear* in the
measured values, so that a value at any state is a weighted sum of measured values and its
standard error follows from the same weights.

* Between points: multilinear (linear in depth, as in the source).
* Grid nodes no run covers: interpolated along a measured line where one brackets the
  node, else completed without interaction, C(a,b) = C(a,b0) + C(a0,b) - C(a0,b0), from the
  nearest runs; this is the source's superposition X'(alpha) + X'(beta).
* Beyond the points, per axis: ``hold``; ``linear`` (the coefficient goes on straight);
  ``linear_load`` (coefficient times axis goes on straight away from zero, so the coefficient
  tends to a constant); ``drift_odd`` and ``drift_even``: the forms of Eq. (25), up to 90 deg.
  In-plane loads, C0 cos^2 + A sin cos + B sin|sin| through all runs of the side, moved to pass
  through the last; out-of-plane loads, A cos^2 + B sin^2 with value and slope of the last two;
  ``absent`` (for a sign axis): zero on a side no run has.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Where the tabulated continuation of a drift rule has nodes: the run spacing up to 30 deg,
# then coarser. A discretisation, not a property of a boat.
_FINE_TO = np.radians(30.0)
_COARSE = np.radians([40.0, 50.0, 60.0, 75.0, 90.0])


def axis_weights(nodes: Array, rule: str, x: float) -> Array:
    """Interpolation weights of one axis.

    Parameters
    ----------
    nodes : (n,) increasing axis values.
    rule : Extrapolation rule; drift rules hold beyond their own continuation nodes.
    x : Where to evaluate.

    Returns
    -------
    (n,) weights that sum to one.
    """
    weights = np.zeros(nodes.size)
    if nodes.size == 1:
        weights[0] = 1.0
        return weights
    i = int(np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, nodes.size - 2))
    a, b = nodes[i], nodes[i + 1]
    if a <= x <= b or rule == "linear":
        t = (x - a) / (b - a)
    elif rule == "linear_load" and a * b > 0.0 and x * a > 0.0 and abs(x) > max(abs(a), abs(b)):
        t = (1.0 / x - 1.0 / a) / (1.0 / b - 1.0 / a)
    else:
        t = 0.0 if x < a else 1.0
    weights[i], weights[i + 1] = 1.0 - t, t
    return weights


def _weight_rows(nodes: Array, rule: str, x: Array) -> Array:
    """``axis_weights`` at (m,) values, (m, n)."""
    if rule in ("linear", "linear_load"):
        return np.stack([axis_weights(nodes, rule, float(value)) for value in x])
    return np.stack([np.interp(x, nodes, unit) for unit in np.eye(nodes.size)], axis=1)


def _odd_row(nodes: Array, x: float) -> Array:
    """Weights of the nodes for the value at ``x`` of an in-plane load, Eq. (25).

    C0 cos^2 + A sin cos + B sin|sin| by least squares through the runs on the side of
    ``x``, moved to pass through the last of them.
    """

    def lift_and_drag(angle: float) -> Array:
        return np.array([0.5 * np.sin(2.0 * angle), np.sin(angle) * abs(np.sin(angle))])

    side = np.flatnonzero(nodes * np.sign(x) > 0.0)
    edge = side[-1] if x > 0.0 else side[0]
    last, centre = np.eye(nodes.size)[edge], axis_weights(nodes, "hold", 0.0)
    beyond, at_edge = lift_and_drag(x), lift_and_drag(nodes[edge])
    if side.size == 1:
        # One run determines the lift only.
        return centre + beyond[0] / at_edge[0] * (last - centre)
    form = np.array([lift_and_drag(a) for a in nodes[side]])
    rest = np.eye(nodes.size)[side] - np.outer(np.cos(nodes[side]) ** 2, centre)
    fitted = (beyond - at_edge) @ np.linalg.pinv(form) @ rest
    return last + (np.cos(x) ** 2 - np.cos(nodes[edge]) ** 2) * centre + fitted


def _even_row(nodes: Array, x: float) -> Array:
    """Weights of the nodes for the value at ``x`` of an out-of-plane load.

    A cos^2 + B sin^2 with the value and the slope of the last two runs.
    """
    edge, inner = (-1, -2) if x > 0 else (0, 1)
    e = nodes[edge]
    value, slope = np.zeros(nodes.size), np.zeros(nodes.size)
    value[edge] = 1.0
    slope[edge], slope[inner] = 1.0 / (e - nodes[inner]), -1.0 / (e - nodes[inner])
    basis = np.array([[np.cos(e) ** 2, np.sin(e) ** 2], [-np.sin(2.0 * e), np.sin(2.0 * e)]])
    return np.array([np.cos(x) ** 2, np.sin(x) ** 2]) @ np.linalg.solve(basis, np.stack([value, slope]))


def extend_axis(nodes: Array, rule: str) -> tuple[Array, Array]:
    """Continuation nodes of a drift axis.

    Parameters
    ----------
    nodes : (n,) increasing angles [rad], or signs.
    rule : ``drift_odd``, ``drift_even``, ``absent``, or another rule (nothing is added).

    Returns
    -------
    extended : (m,) axis values, m >= n.
    matrix : (m, n) values at ``extended`` from values at ``nodes``.
    """
    if rule == "absent":
        sides = np.array([-1.0, 0.0, 1.0])
        return sides, (sides[:, None] == nodes[None, :]).astype(float)
    if not rule.startswith("drift") or nodes.size < 3 or nodes[-1] >= _FINE_TO:
        return nodes, np.eye(nodes.size)
    extra: list[float] = []
    for sign, edge, step in (
        (-1.0, -nodes[0], nodes[1] - nodes[0]),
        (1.0, nodes[-1], nodes[-1] - nodes[-2]),
    ):
        if edge <= 0.0:
            continue
        fine = edge + step * np.arange(1, int(np.ceil((_FINE_TO - edge) / step - 1e-9)) + 1)
        last = fine[-1]
        extra += list(sign * fine) + [sign * c for c in _COARSE if c > last]
    extended = np.sort(np.concatenate([nodes, extra]))
    matrix = np.zeros((extended.size, nodes.size))
    for row, x in zip(matrix, extended, strict=True):
        inside = nodes[0] <= x <= nodes[-1]
        beyond = _odd_row if rule == "drift_odd" else _even_row
        row[:] = axis_weights(nodes, "hold", x) if inside else beyond(nodes, x)
    return extended, matrix


# Nodes looked at together when a grid is completed, times the nodes of a plane: bounds the memory.
_AT_ONCE = 1 << 20
# Grid nodes, and the weights by which others replace a missing one: (m, d), (p, m, d) and (p, m).
Replaced = tuple[NDArray[np.int64], NDArray[np.int64], Array]


def _line_interpolation(missing: NDArray[np.int64], axes: Sequence[Array], measured: NDArray[np.bool_]) -> Replaced:
    """Nodes bracketed by runs along an axis, the first such axis, between the nearest of both sides."""
    ends = np.stack([missing, missing])
    share, open_ = np.zeros(len(missing)), np.ones(len(missing), dtype=bool)
    for k, nodes in enumerate(axes):
        shape = [-1 if m == k else 1 for m in range(len(axes))]
        number = np.arange(nodes.size).reshape(shape)
        below = np.maximum.accumulate(np.where(measured, number, -1), axis=k)
        above = np.flip(np.minimum.accumulate(np.flip(np.where(measured, number, nodes.size), k), axis=k), k)
        place = tuple(missing.T)
        low, high = below[place], above[place]
        here = open_ & (low >= 0) & (high < nodes.size)
        low, high = low[here], high[here]
        ends[0, here, k], ends[1, here, k] = low, high
        share[here] = (nodes[missing[here, k]] - nodes[low]) / (nodes[high] - nodes[low])
        open_ &= ~here
    done = ~open_
    return missing[done], ends[:, done], np.stack([1.0 - share[done], share[done]])


def _without_interaction(missing: NDArray[np.int64], known: NDArray[np.bool_]) -> Replaced:
    """C(a,b0) + C(a0,b) - C(a0,b0) from the nearest known nodes, where there are such three."""
    count, axes = missing.shape
    best = np.full(count, np.iinfo(np.int64).max)
    corners = np.stack([missing] * 3)
    for j, k in itertools.combinations(range(axes), 2):
        planes = np.moveaxis(known, (j, k), (-2, -1))
        others = [m for m in range(axes) if m not in (j, k)]
        size = known.shape[j] * known.shape[k]
        for part in np.array_split(np.arange(count), -(-count * size // _AT_ONCE) or 1):
            at = missing[part]
            distance, a, b = _nearest_corner(planes[tuple(at[:, others].T)], at[:, j], at[:, k])
            nearer = distance < best[part]
            a, b, part = a[nearer], b[nearer], part[nearer]
            best[part] = distance[nearer]
            corners[:, part] = missing[part]
            corners[0, part, k] = corners[2, part, k] = b
            corners[1, part, j] = corners[2, part, j] = a
    done = best < np.iinfo(np.int64).max
    return missing[done], corners[:, done], np.outer([1.0, 1.0, -1.0], np.ones(int(done.sum())))


def _nearest_corner(
    plane: NDArray[np.bool_], row: NDArray[np.int64], column: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Of each missing node the nearest (a, b) that is known as are (a, column) and (row, b); how far, where.

    Parameters
    ----------
    plane : (m, rows, columns), or (rows, columns) that all of them lie in: known nodes.
    row, column : (m,) of the missing nodes.
    """
    each, (rows, columns) = np.arange(row.size), plane.shape[-2:]
    plane = np.broadcast_to(plane, (row.size, rows, columns))
    # A missing node is not known itself, so that neither its row nor its column is usable.
    usable = plane & plane[each, :, column][:, :, None] & plane[each, row, :][:, None, :]
    away = np.abs(np.arange(rows) - row[:, None])[:, :, None] + np.abs(np.arange(columns) - column[:, None])[:, None, :]
    far = np.where(usable, away, np.iinfo(np.int64).max).reshape(row.size, -1)
    first = far.argmin(axis=1)
    return far[each, first], first // columns, first % columns


@lru_cache(maxsize=256)
def _complete(points: bytes, shape: tuple[int, int]) -> tuple[tuple[Array, ...], Array, NDArray[np.bool_]]:
    """Grid axes, completion matrix (nodes x points) and mask of the measured nodes."""
    x = np.frombuffer(points).reshape(shape)
    axes = tuple(np.unique(x[:, k]) for k in range(shape[1]))
    grid = tuple(a.size for a in axes)
    matrix = np.zeros((*grid, shape[0]))
    measured = np.zeros(grid, dtype=bool)
    place = tuple(np.searchsorted(a, x[:, k]) for k, a in enumerate(axes))
    matrix[(*place, np.arange(shape[0]))] = 1.0
    measured[place] = True
    known = measured.copy()
    for attempt in range(1 + sum(grid)):
        missing = np.argwhere(~known)
        if not len(missing):
            break
        completed = _without_interaction(missing, known) if attempt else _line_interpolation(missing, axes, measured)
        nodes, sources, weights = completed
        if attempt and not len(nodes):
            break
        matrix[tuple(nodes.T)] = sum(w[:, None] * matrix[tuple(s.T)] for s, w in zip(sources, weights, strict=True))
        known[tuple(nodes.T)] = True
    centres = np.argwhere(measured)
    for index in np.argwhere(~known):
        nearest = centres[np.argmin(np.abs(centres - index).sum(axis=1))]
        matrix[tuple(index)] = matrix[tuple(nearest)]
    return axes, matrix.reshape(-1, shape[0]), measured.reshape(-1)


@dataclass(frozen=True)
class Table:
    """A coefficient's tabulation over its measured points.

    Attributes
    ----------
    axes : Axis names, d of them; d = 0 is a constant.
    rules : Extrapolation rule of each axis.
    points : (n, d) measured points; angles in radians, the rest in SI.
    """

    axes: tuple[str, ...]
    rules: tuple[str, ...]
    points: Array

    @cached_property
    def _completed(self) -> tuple[tuple[Array, ...], Array, NDArray[np.bool_]]:
        points = np.ascontiguousarray(self.points, dtype=float)
        return _complete(points.tobytes(), (points.shape[0], points.shape[1]))

    @property
    def nodes(self) -> tuple[Array, ...]:
        """Axis values of the completed grid."""
        return self._completed[0]

    @property
    def completion(self) -> Array:
        """(grid nodes, n) matrix from measured values to grid values."""
        return self._completed[1]

    @property
    def measured(self) -> NDArray[np.bool_]:
        """(grid nodes,) True where a run stands."""
        return self._completed[2]

    @cached_property
    def extension(self) -> tuple[tuple[Array, Array], ...]:
        """Extended axis values and extension matrix of each axis."""
        return tuple(extend_axis(n, r) for n, r in zip(self.nodes, self.rules, strict=True))

    def grid_weights(self, x: Sequence[float]) -> Array:
        """(grid nodes,) weights of the completed grid at the state ``x`` (d,)."""
        weights = np.ones(1)
        for (extended, matrix), rule, value in zip(self.extension, self.rules, x, strict=True):
            along = axis_weights(extended, rule, float(value)) @ matrix
            weights = np.multiply.outer(weights, along).reshape(-1)
        return weights

    def weights(self, x: Sequence[float]) -> Array:
        """(n,) weights of the measured values at the state ``x`` (d,)."""
        if not self.axes:
            return np.ones(1)
        return self.grid_weights(x) @ self.completion

    def covered(self, x: Array) -> Array:
        """Share of the interpolation weight that rests on runs, 0 to 1.

        Parameters
        ----------
        x : (m, d) states.

        Returns
        -------
        (m,) shares; zero where all weights are zero.
        """
        x = np.asarray(x, dtype=float)
        if not self.axes:
            return np.ones(len(x))
        # Weights are products along the axes, so that one axis at a time is summed.
        runs = np.broadcast_to(self.measured.reshape([n.size for n in self.nodes]), (len(x), *map(len, self.nodes)))
        total = np.ones(len(x))
        for k, ((extended, matrix), rule) in enumerate(zip(self.extension, self.rules, strict=True)):
            along = np.abs(_weight_rows(extended, rule, x[:, k]) @ matrix)
            runs = np.einsum("mi,mi...->m...", along, runs)
            total = total * along.sum(axis=1)
        return np.divide(runs, total, out=np.zeros(len(x)), where=total > 0.0)

    def grid(self, values: Array) -> Array:
        """Values on the extended grid.

        Parameters
        ----------
        values : (n,) values at the measured points, or (n, k), k sets of them.

        Returns
        -------
        Array with one dimension an axis, and k last where there are k sets.
        """
        if not self.axes:
            return np.asarray(values, dtype=float).reshape(values.shape[1:])
        out = (self.completion @ values).reshape([*(n.size for n in self.nodes), *values.shape[1:]])
        for k, (_, matrix) in enumerate(self.extension):
            out = np.moveaxis(np.tensordot(matrix, out, axes=(1, k)), 0, k)
        return out

    def range(self, axis: str) -> tuple[float, float]:
        """Smallest and largest measured value along an axis (radians or SI)."""
        column = self.points[:, self.axes.index(axis)]
        return float(column.min()), float(column.max())
