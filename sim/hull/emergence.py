"""Partly emerged hull: buoyancy that is lost above the water, continuous in depth and attitude.

The hull is cut into cells by stations along x, bands along z and the middle plane. A cell
counts as wet in the share of its height (projected to the vertical) that is under water, so
the lost buoyancy is piecewise linear and continuous, and exactly zero while the boat is
under: calm, submerged runs keep every digit.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.boat.state import PHI, THETA, Z
from sim.compiled import inner, outer
from sim.hull.mesh import Mesh

Array = NDArray[np.float64]
_SIDES = (1.0, -1.0)
# Cells below this share of a mean one are dropped.
_DUST = 1e-6
# Numbers of a cell: box, half extents, volume, centroid.
CELL = 10


class Cells(NamedTuple):
    """Cells of a hull.

    points : (n, 3) centroids; boxes, halves : (n, 3) middle and half extents of the box that
        stands for each, body frame [m].
    volumes : (n,) [m^3]. station : (n,) of the cell; stations : (s,) their x [m].
    section : (n,) nearest of the sections that carry added mass; zeros where none were given.
    low, high : (3,) corners of the box that holds them [m].
    """

    points: Array
    boxes: Array
    halves: Array
    volumes: Array
    station: NDArray[np.int64]
    stations: Array
    section: NDArray[np.int64]
    low: Array
    high: Array


def _bands(p: Array, q: Array, edges: Array) -> tuple[Array, Array, Array]:
    """Area and first moments of a section, by side and band, from its cut edges (y, z).

    int y dy dz between two heights is a sum over the edges, clipped to the band and to the
    side (Green's theorem): area = oint y dz, moments oint y^2/2 dz and oint y z dz.
    """
    shape = (len(_SIDES), len(edges) - 1)
    area, first, height = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    nodes, weights = np.polynomial.legendre.leggauss(3)
    for s, side in enumerate(_SIDES):
        # Cut each edge at y = 0, so that max(side y, 0) is linear on every piece.
        a, b = p[:, 0] * side, q[:, 0] * side
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(a * b < 0.0, a / (a - b), 1.0)[:, None]
        middle = p + t * (q - p)
        start, end = np.concatenate([p, middle]), np.concatenate([middle, q])
        for k in range(len(edges) - 1):
            low, high = edges[k], edges[k + 1]
            z0, z1 = np.clip(start[:, 1], low, high), np.clip(end[:, 1], low, high)
            rise = end[:, 1] - start[:, 1]
            safe = np.where(rise == 0.0, 1.0, rise)
            for node, weight in zip(nodes, weights, strict=True):
                z = 0.5 * (z0 + z1) + 0.5 * node * (z1 - z0)
                y = start[:, 0] + (end[:, 0] - start[:, 0]) * (z - start[:, 1]) / safe
                y = np.where(rise == 0.0, 0.0, np.maximum(side * y, 0.0))
                dz = 0.5 * weight * (z1 - z0) * side
                area[s, k] += (y * dz).sum()
                first[s, k] += (0.5 * side * y * y * dz).sum()
                height[s, k] += (y * z * dz).sum()
    return area, first, height


def _part_cells(part: Mesh, length: float, bands: int) -> tuple[Array, Array, Array, Array]:
    """Centroids, box middles, half extents and volumes of the cells of one part."""
    corners = part.corners.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    count = max(1, round((high[0] - low[0]) / length))
    step, edges = (high[0] - low[0]) / count, np.linspace(low[2], high[2], bands + 1)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    cells = []
    for k in range(count):
        at = low[0] + step * (k + 0.5 * (1.0 + nodes))
        # (station, quantity, side, band): area and its moments in y and z.
        cuts = np.array([_bands(*part.cut(0, x), edges) for x in at])
        share = 0.5 * step * weights
        volume = np.tensordot(share, cuts[:, 0], axes=1)
        moments = [np.tensordot(share * at, cuts[:, 0], axes=1), *np.tensordot(share, cuts[:, 1:], axes=1)]
        for s, j in np.argwhere(volume > _DUST * part.volume / (count * bands)):
            middle = (low[0] + step * (k + 0.5), 0.5 * (edges[j] + edges[j + 1]))
            cells.append([volume[s, j], *(m[s, j] / volume[s, j] for m in moments), *middle])
    table, band = np.array(cells), edges[1] - edges[0]
    half = np.stack(np.broadcast_arrays(0.5 * step, 0.5 * table[:, 0] / (step * band), 0.5 * band), axis=1)
    return table[:, 1:4], table[:, [4, 2, 5]], half, table[:, 0] * part.volume / table[:, 0].sum()


def cells(
    mesh: Mesh,
    stations: int = 24,
    bands: int = 8,
    displaced: float | None = None,
    centre: Sequence[float] | None = None,
    sections: Array | None = None,
) -> Cells:
    """Cells of every part of a mesh; parts shorter than a station's length get one station.

    Parameters
    ----------
    mesh : Closed and outward, body frame [m].
    stations, bands : Cells along x over the boat's length, and along z over each part's height.
    displaced : Volume [m^3] to scale to, when the mesh's own is not the vehicle's.
    centre : Centre of buoyancy to shift to [m], likewise: fully emerged, nothing is left over.
    sections : (k, 3) centres of the sections that carry added mass [m].
    """
    x = mesh.vertices[mesh.triangles.ravel(), 0]
    length = (x.max() - x.min()) / stations
    scale = 1.0 if displaced is None else displaced / mesh.volume
    tables = [_part_cells(mesh.only(name), length, bands) for name in mesh.names]
    place, box, half, volume = (np.concatenate([t[i] for t in tables]) for i in range(4))
    volume *= scale
    if centre is not None:
        shift = np.asarray(centre) - volume @ place / volume.sum()
        place, box = place + shift, box + shift
    middles = x.min() + length * (np.arange(stations) + 0.5)
    station = np.abs(box[:, :1] - middles).argmin(axis=1)
    near = np.zeros((1, 3)) if sections is None or len(sections) == 0 else sections
    section = np.linalg.norm(place[:, None] - near[None], axis=2).argmin(axis=1)
    return Cells(
        place, box, half, volume, station, middles, section, (box - half).min(axis=0), (box + half).max(axis=0)
    )


def flat_cells(c: Cells) -> tuple[Array, NDArray[np.int64]]:
    """Cells as the compiled loop reads them, one after the other.

    Returns
    -------
    Box, half extents, volume and centroid; station and section.
    """
    floats = np.column_stack([c.boxes, c.halves, c.volumes, c.points])
    return floats.ravel(), np.column_stack([c.station, c.section]).astype(np.int64).ravel()


@inner
def lose(
    a: Array,
    at: int,
    count: int,
    b: NDArray[np.int64],
    places: int,
    y: Array,
    surface: int,
    specific_weight: float,
    out: int,
    dry: int,
    sections: int,
) -> float:
    """``lost_buoyancy`` with everything in one array ``a``: cells, elevations and results.

    Parameters
    ----------
    at, count : First of the cells in ``a``, and how many. places : Of their stations in ``b``.
    surface, out, dry : Where elevations, load and emerged volumes stand in ``a``.

    Returns
    -------
    Emerged volume [m^3].
    """
    for i in range(6):
        a[out + i] = 0.0
    for i in range(sections):
        a[dry + i] = 0.0
    st, ct = sin(y[THETA]), cos(y[THETA])
    down0, down1, down2 = -st, sin(y[PHI]) * ct, cos(y[PHI]) * ct
    total, mx, my, mz = 0.0, 0.0, 0.0, 0.0
    for i in range(count):
        k = at + CELL * i
        depth = y[Z] + down0 * a[k] + down1 * a[k + 1] + down2 * a[k + 2] + a[surface + b[places + 2 * i]]
        half = abs(down0) * a[k + 3] + abs(down1) * a[k + 4] + abs(down2) * a[k + 5]
        if depth < half:
            share = a[k + 6] * min(1.0, 0.5 * (half - depth) / half)
            total += share
            a[dry + b[places + 2 * i + 1]] += share
            mx += share * a[k + 7]
            my += share * a[k + 8]
            mz += share * a[k + 9]
    # Lost lift: a weight of water, downward in body axes, at the dry centroid.
    fx, fy, fz = specific_weight * down0, specific_weight * down1, specific_weight * down2
    a[out], a[out + 1], a[out + 2] = total * fx, total * fy, total * fz
    a[out + 3], a[out + 4], a[out + 5] = my * fz - mz * fy, mz * fx - mx * fz, mx * fy - my * fx
    return total


@outer
def _lost(
    a: Array, b: NDArray[np.int64], y: Array, specific_weight: float, stations: int, cells: int, sections: int
) -> float:
    at = 6 + sections + stations
    return lose(a, at, cells, b, 0, y, 6 + sections, specific_weight, 0, 6, sections)


def lost_buoyancy(c: Cells, y: Array, surface: Array, specific_weight: float, out: Array, dry: Array) -> float:
    """Load to add to the fully submerged one where the boat is out of the water.

    Parameters
    ----------
    c : Cells. y : (12,) state.
    surface : (s,) elevation over each station [m, up]; zeros in calm water.
    specific_weight : rho g [N/m^3].
    out : (6,) X Y Z K M N about the body origin [N, N m].
    dry : (k,) emerged volume that belongs to each section [m^3].

    Returns
    -------
    Emerged share of the volume, 0 (and ``out`` and ``dry`` zero) when submerged.
    """
    floats, places = flat_cells(c)
    a = np.concatenate([np.zeros(6 + dry.size), surface, floats])
    total = _lost(a, places, y, specific_weight, surface.size, c.volumes.size, dry.size)
    out[:], dry[:] = a[:6], a[6 : 6 + dry.size]
    return total / float(sum(c.volumes))
