"""Closed triangulated surfaces: areas, volume, centroid, plane sections, and the check.

Reversed normals or a hole give silently wrong loads, so that a mesh is checked when it is
made: every edge is met in both directions equally often, every part has positive volume.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class MeshError(ValueError):
    """A surface is not closed, or its normals do not point outward."""


@dataclass(frozen=True)
class Mesh:
    """A closed surface of one or more bodies.

    Attributes
    ----------
    vertices : (n, 3) [m].
    triangles : (m, 3) vertices of each triangle, counter-clockwise seen from outside.
    part : (m,) index into ``names``.
    names : Name of each closed part.
    """

    vertices: Array
    triangles: Index
    part: Index
    names: tuple[str, ...]

    @cached_property
    def corners(self) -> Array:
        """(m, 3, 3) corner positions of each triangle [m]."""
        return self.vertices[self.triangles]

    @cached_property
    def areas(self) -> Array:
        """(m, 3) outward area vectors, Eq. (42) [m^2]."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return 0.5 * np.cross(b - a, c - a)

    @cached_property
    def volume(self) -> float:
        """Enclosed volume [m^3], by the divergence theorem."""
        return float(np.einsum("ij,ij->", self.corners.mean(axis=1), self.areas)) / 3.0

    @cached_property
    def centroid(self) -> Array:
        """(3,) centre of the enclosed volume [m], exact for the facets."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        squares = ((a + b) ** 2 + (b + c) ** 2 + (c + a) ** 2) / 4.0 / 3.0
        return np.einsum("ij,ij->j", squares, self.areas) / 2.0 / self.volume

    def only(self, name: str) -> Mesh:
        """The part of that name as a mesh of its own."""
        keep = self.part == self.names.index(name)
        return Mesh(self.vertices, self.triangles[keep], np.zeros(int(keep.sum()), dtype=np.int64), (name,))

    def moved(self, shift: Sequence[float], signs: Sequence[float] = (1.0, 1.0, 1.0)) -> Mesh:
        """Shifted by ``-shift``, then turned by axis signs whose product is +1."""
        return Mesh((self.vertices - np.asarray(shift)) * np.asarray(signs), self.triangles, self.part, self.names)

    def cut(self, axis: int, at: float) -> tuple[Array, Array]:
        """Edges in which a plane normal to an axis cuts the surface, the interior to their left.

        Parameters
        ----------
        axis : 0, 1 or 2.
        at : Where along it [m].

        Returns
        -------
        start, end : (m, 2) in the two other axes, in cyclic order [m].
        """
        height = self.corners[:, :, axis] - at
        # A vertex on the plane counts as above it, so that no cut is lost or doubled.
        above = height >= 0.0
        rows = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
        points, h, up = self.corners[rows][:, :, [(axis + 1) % 3, (axis + 2) % 3]], height[rows], above[rows]
        on = np.roll(up, -1, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (h / (h - np.roll(h, -1, axis=1)))[:, :, None]
            crossing = points + share * (np.roll(points, -1, axis=1) - points)
        # Seen from outside the triangle turns left, so the interior lies left of the cut
        # that leads from the edge going down to the edge going up.
        return crossing[up & ~on], crossing[~up & on]

    def section(self, axis: int, at: float) -> tuple[float, Array, Array]:
        """Area, centroid and second moments of the plane section normal to an axis.

        By Green's theorem over the cut edges, whose direction the outward normals give.

        Parameters
        ----------
        axis : 0, 1 or 2, normal to the section.
        at : Where along it [m].

        Returns
        -------
        area : [m^2].
        centre : (2,) centroid along the two other axes, in cyclic order [m].
        moments : (2, 2) central second moments [m^4].
        """
        p, q = self.cut(axis, at)
        cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
        area = 0.5 * cross.sum()
        if area == 0.0:
            return 0.0, np.zeros(2), np.zeros((2, 2))
        centre = (cross[:, None] * (p + q)).sum(axis=0) / (6.0 * area)
        outer = [np.einsum("i,ij,ik->jk", cross, a, b) for a, b in ((p, p), (q, q), (p, q), (q, p))]
        second_moments = (2.0 * (outer[0] + outer[1]) + outer[2] + outer[3]) / 24.0
        return float(area), centre, second_moments - area * np.outer(centre, centre)

    def check(self, where: str = "mesh") -> Mesh:
        """The mesh itself when closed and outward.

        Raises
        ------
        MeshError
            Naming the part, the number of open edges, or the negative volume.
        """
        if not np.isfinite(self.vertices).all():
            raise MeshError(f"{where}: a vertex is not a finite number")
        for k, name in enumerate(self.names):
            t = self.triangles[self.part == k]
            edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
            # Forward and backward walks of an edge cancel on a closed surface.
            key, inverse = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
            balance = np.bincount(inverse.ravel(), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
            if open_edges := int(np.count_nonzero(balance)):
                raise MeshError(f"{where}, part {name}: {open_edges} of {len(key)} edges are open")
            if (volume := self.only(name).volume) <= 0.0:
                raise MeshError(f"{where}, part {name}: volume {volume:.4g} m^3, its normals point inward")
        return self


def closed_part(name: str, vertices: Array, triangles: Index) -> Mesh:
    """One part from raw triangles: equal vertices merged, degenerate triangles dropped, outward.

    Parameters
    ----------
    name : For messages.
    vertices, triangles : (n, 3) [m] and (m, 3), in one consistent sense of rotation.
    """
    size = float(np.ptp(vertices, axis=0).max()) or 1.0
    _, keep, inverse = np.unique(np.round(vertices / size, 9), axis=0, return_index=True, return_inverse=True)
    t = inverse.ravel()[triangles]
    t = t[(t[:, 0] != t[:, 1]) & (t[:, 1] != t[:, 2]) & (t[:, 2] != t[:, 0])]
    mesh = Mesh(vertices[keep], t, np.zeros(len(t), dtype=np.int64), (name,))
    return mesh if mesh.volume > 0.0 else Mesh(mesh.vertices, t[:, ::-1].copy(), mesh.part, mesh.names)


def joined(parts: Sequence[Mesh]) -> Mesh:
    """Several parts as one mesh; overlapping volumes count twice.

    Raises
    ------
    MeshError
        When two parts have the same name.
    """
    names = tuple(p.names[0] for p in parts)
    if len(set(names)) < len(names):
        raise MeshError(f"two parts are called {next(n for n in names if names.count(n) > 1)}")
    start = np.cumsum([0, *[len(p.vertices) for p in parts]])
    return Mesh(
        np.concatenate([p.vertices for p in parts]),
        np.concatenate([p.triangles + n for p, n in zip(parts, start, strict=False)]),
        np.concatenate([np.full(len(p.triangles), k, dtype=np.int64) for k, p in enumerate(parts)]),
        names,
    )
