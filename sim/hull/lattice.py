"""Vortex lattice of fins on a cylindrical hull or a wall (Katz and Plotkin, Low-Speed Aerodynamics, ch. 12)."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Panels along span (root, plane) and chord.
FINE = (6, 10, 6)
# Trailing vortices end so far downstream [m]; further makes no difference.
_FAR = np.array([1e4, 0.0, 0.0])
# Pairs of control point and vortex worked on at once: their numbers stay in the processor's own memory.
_BLOCK = 1 << 13


@dataclass(frozen=True)
class Fin:
    """One fin: corner chords of its fixed root and moving plane, along x (aft) and span s [m].

    ``chords`` holds (s, leading edge x, trailing edge x) at the inner edge of the root, at the
    gap, and at the tip; ``angle`` is the direction of the span axis about x [rad].
    """

    chords: tuple[tuple[float, float, float], ...]
    angle: float


@dataclass(frozen=True)
class Lattice:
    """Horseshoe vortices and control points.

    Attributes
    ----------
    a, b : (n, 3) ends of the bound vortices [m].
    control, normal : (n, 3).
    fin, moving : (n,) number of the fin, and whether the panel is on its moving plane.
    """

    a: Array
    b: Array
    control: Array
    normal: Array
    fin: NDArray[np.int64]
    moving: NDArray[np.bool_]


def _fin_panels(fin: Fin, counts: tuple[int, int, int]) -> tuple[list[Array], list[bool]]:
    """Corner rows (a, b, control, normal) of a fin's panels, and whether they move."""
    span = np.array([0.0, np.cos(fin.angle), np.sin(fin.angle)])
    normal = np.array([0.0, -np.sin(fin.angle), np.cos(fin.angle)])
    rows, moving = [], []
    for part in (0, 1):
        (s0, lead0, trail0), (s1, lead1, trail1) = fin.chords[part], fin.chords[part + 1]
        edges = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, counts[part] + 1)))

        def point(
            t: float, c: float, s: tuple[float, float] = (s0, s1), e: tuple[float, ...] = (lead0, lead1, trail0, trail1)
        ) -> Array:
            lead, trail = e[0] + (e[1] - e[0]) * t, e[2] + (e[3] - e[2]) * t
            along = np.array([lead + (trail - lead) * c, 0.0, 0.0])
            return np.asarray(along + (s[0] + (s[1] - s[0]) * t) * span)

        for t0, t1 in itertools.pairwise(edges):
            for j in range(counts[2]):
                # Bound vortex at a quarter, control point at three quarters of the panel.
                bound, check = (j + 0.25) / counts[2], (j + 0.75) / counts[2]
                rows.append(np.stack([point(t0, bound), point(t1, bound), point(0.5 * (t0 + t1), check), normal]))
                moving.append(part == 1)
    return rows, moving


def lattice(fins: list[Fin], counts: tuple[int, int, int] = FINE) -> Lattice:
    """Vortex lattice of fins.

    Parameters
    ----------
    fins : The fins.
    counts : Panels along the span of root and plane, and along the chord.
    """
    rows, moving, owner = [], [], []
    for i, fin in enumerate(fins):
        panels, own_moving = _fin_panels(fin, counts)
        rows += panels
        moving += own_moving
        owner += [i] * len(panels)
    corners = np.stack(rows)
    return Lattice(
        corners[:, 0], corners[:, 1], corners[:, 2], corners[:, 3], np.array(owner), np.array(moving, dtype=bool)
    )


# From vortex ends to points, by components, each (n, m): the way, and its direction.
_Seen: TypeAlias = tuple[list[Array], list[Array]]


def _seen(p: Array, end: Array) -> _Seen:
    """Way and direction from the ends of vortices (m, 3) to points p (n, 1, 3)."""
    # By components: products of short vectors cost more than the numbers in them.
    way = [p[..., i] - end[:, i] for i in range(3)]
    length = np.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
    return way, [one / length for one in way]


def _segment(a: Array, b: Array, from_a: _Seen, from_b: _Seen) -> Array:
    """Velocity at points of unit straight vortices from a to b (m, 3), Biot and Savart."""
    (r1, d1), (r2, d2) = from_a, from_b
    cross = [r1[i] * r2[j] - r1[j] * r2[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    square = cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2
    side = [(b[:, i] - a[:, i]) * (d1[i] - d2[i]) for i in range(3)]
    # On the vortex's own line the velocity is zero.
    along = np.divide(
        side[0] + side[1] + side[2], 4.0 * np.pi * square, out=np.zeros_like(square), where=square > 1e-12
    )
    return np.stack([one * along for one in cross], axis=-1)


def horseshoes(p: Array, a: Array, b: Array) -> Array:
    """Velocity at points p (n, 3) of unit horseshoe vortices with bound part a to b (m, 3).

    Returns
    -------
    (n, m, 3) [1/m]; the trailing vortices go aft (+x).
    """
    ends = [a + _FAR, a, b, b + _FAR]
    seen = [_seen(p[:, None, :], end) for end in ends]
    first, bound, last = (_segment(*ends[k : k + 2], *seen[k : k + 2]) for k in range(3))
    return np.asarray(first + bound + last)


def in_cylinder(p: Array, radius: float) -> Array:
    """Image points in a circular cylinder about the x axis: same angle, radius^2 / r."""
    r2 = p[:, 1] ** 2 + p[:, 2] ** 2
    return np.asarray(p * np.stack([np.ones_like(r2), radius**2 / r2, radius**2 / r2], axis=1))


def in_wall(p: Array, wall: float) -> Array:
    """Image points in the plane y = wall."""
    out = p.copy()
    out[:, 1] = 2.0 * wall - out[:, 1]
    return out


def influence(grid: Lattice, image_a: Array, image_b: Array) -> Array:
    """(n, n) normal velocity at the control points of unit vortices with their images."""
    out = np.empty((len(grid.control), len(grid.a)))
    rows = max(1, _BLOCK // len(grid.a))
    for low in range(0, len(out), rows):
        some = slice(low, low + rows)
        both = horseshoes(grid.control[some], grid.a, grid.b) + horseshoes(grid.control[some], image_a, image_b)
        out[some] = np.einsum("nmi,ni->nm", both, grid.normal[some])
    return out


def normal_load(circulation: NDArray[Any], a: Array, b: Array, direction: Array) -> Array:
    """Load along ``direction`` of each bound vortex, over density and speed (Kutta, Joukowsky)."""
    return np.asarray(circulation * (np.cross(np.array([1.0, 0.0, 0.0]), b - a) @ direction))
