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


def _line_interpolation(index: tuple[int, ...], axes: Sequence[Array], measured: NDArray[np.bool_]):
    """(node, weight) pairs for a node bracketed by runs along one axis, else None."""
    for k, nodes in enumerate(axes):
        line = measured[tuple(slice(None) if m == k else i for m, i in enumerate(index))]
        below, above = np.flatnonzero(line[: index[k]]), np.flatnonzero(line[index[k] :])
        if below.size and above.size:
            lo, hi = int(below[-1]), int(above[0]) + index[k]
            t = (nodes[index[k]] - nodes[lo]) / (nodes[hi] - nodes[lo])
            place = [(*index[:k], i, *index[k + 1 :]) for i in (lo, hi)]
            return [(place[0], 1.0 - t), (place[1], t)]
    return None


def _without_interaction(index: tuple[int, ...], known: NDArray[np.bool_]):
    """(node, weight) triple C(a,b0) + C(a0,b) - C(a0,b0) from the nearest known nodes."""
    best, corners = None, None
    for j, k in itertools.combinations(range(len(index)), 2):
        plane = known[tuple(slice(None) if m in (j, k) else i for m, i in enumerate(index))]
        # At (a, b): itself and the two corners it shares with the missing node are known.
        usable = plane & plane[:, index[k], None] & plane[None, index[j], :]
        usable[index[j], :] = usable[:, index[k]] = False
        away = [np.abs(np.arange(n) - i) for n, i in zip(plane.shape, (index[j], index[k]), strict=True)]
        distance = np.where(usable, np.add.outer(*away), sum(plane.shape) + 1)
        a, b = (int(i) for i in np.unravel_index(int(distance.argmin()), plane.shape))
        if usable[a, b] and (best is None or distance[a, b] < best):
            keep_j, keep_k, neither = list(index), list(index), list(index)
            keep_j[k], keep_k[j], neither[j], neither[k] = b, a, a, b
            triple = [tuple(keep_j), tuple(keep_k), tuple(neither)]
            best, corners = int(distance[a, b]), list(zip(triple, (1.0, 1.0, -1.0), strict=True))
    return corners


@lru_cache(maxsize=256)
def _complete(points: bytes, shape: tuple[int, int]) -> tuple[tuple[Array, ...], Array, NDArray[np.bool_]]:
    """Grid axes, completion matrix (nodes x points) and mask of the measured nodes."""
    x = np.frombuffer(points).reshape(shape)
    axes = tuple(np.unique(x[:, k]) for k in range(shape[1]))
    grid = tuple(a.size for a in axes)
    matrix = np.zeros((*grid, shape[0]))
    measured = np.zeros(grid, dtype=bool)
    for row, point in enumerate(x):
        index = tuple(int(np.searchsorted(a, c)) for a, c in zip(axes, point, strict=True))
        matrix[index][row] = 1.0
        measured[index] = True
    known = measured.copy()
    missing = [i for i in np.ndindex(*grid) if not known[i]]
    for attempt in range(1 + sum(grid)):
        snapshot, left = known.copy(), []
        for index in missing:
            first = attempt == 0
            parts = _line_interpolation(index, axes, measured) if first else _without_interaction(index, snapshot)
            if parts is None:
                left.append(index)
                continue
            matrix[index] = sum(w * matrix[i] for i, w in parts)
            known[index] = True
        if not left or (attempt and len(left) == len(missing)):
            missing = left
            break
        missing = left
    centres = np.argwhere(measured)
    for index in missing:
        nearest = centres[np.argmin(np.abs(centres - np.array(index)).sum(axis=1))]
        matrix[index] = matrix[tuple(nearest)]
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
