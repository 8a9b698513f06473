"""Partly emerged hull: buoyancy that is lost above the water, continuous in depth and attitude.

The hull is cut into cells by stations along x, bands along z and the middle plane. A cell
counts as wet in the share of its height (projected to the vertical) that is under water, so
the lost buoyancy is piecewise linear and continuous, and exactly zero while the boat is
under: calm, submerged runs keep every digit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.hull.mesh import Mesh
from sim.waves.pressure import box_top, fill_rotation

Array = NDArray[np.float64]
_SIDES = (1.0, -1.0)
# Cells below this share of a mean one are dropped.
_DUST = 1e-6


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
    found = []
    for k in range(count):
        at = low[0] + step * (k + 0.5 * (1.0 + nodes))
        # (station, quantity, side, band): area and its moments in y and z.
        cuts = np.array([_bands(*part.cut(0, x), edges) for x in at])
        share = 0.5 * step * weights
        volume = np.tensordot(share, cuts[:, 0], axes=1)
        moments = [np.tensordot(share * at, cuts[:, 0], axes=1), *np.tensordot(share, cuts[:, 1:], axes=1)]
        for s, j in np.argwhere(volume > _DUST * part.volume / (count * bands)):
            middle = (low[0] + step * (k + 0.5), 0.5 * (edges[j] + edges[j + 1]))
            found.append([volume[s, j], *(m[s, j] / volume[s, j] for m in moments), *middle])
    table, band = np.array(found), edges[1] - edges[0]
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


@njit(cache=True, error_model="numpy")
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
    for i in range(6):
        out[i] = 0.0
    for i in range(dry.size):
        dry[i] = 0.0
    lowest = 0.0
    for i in range(surface.size):
        lowest = min(lowest, surface[i])
    m = np.empty((3, 3))
    fill_rotation(y[9], y[10], y[11], m)
    a, b, d = m[2, 0], m[2, 1], m[2, 2]
    if y[8] + box_top(c.low, c.high, a, b, d) + lowest > 0.0:
        return 0.0
    total, mx, my, mz = 0.0, 0.0, 0.0, 0.0
    for i in range(c.volumes.size):
        depth = y[8] + a * c.boxes[i, 0] + b * c.boxes[i, 1] + d * c.boxes[i, 2] + surface[c.station[i]]
        half = abs(a) * c.halves[i, 0] + abs(b) * c.halves[i, 1] + abs(d) * c.halves[i, 2]
        if depth < half:
            share = c.volumes[i] * min(1.0, 0.5 * (half - depth) / half)
            total += share
            dry[c.section[i]] += share
            mx += share * c.points[i, 0]
            my += share * c.points[i, 1]
            mz += share * c.points[i, 2]
    # Lost lift: a weight of water, downward along (a, b, d) in body axes, at the dry centroid.
    fx, fy, fz = specific_weight * a, specific_weight * b, specific_weight * d
    out[0], out[1], out[2] = total * fx, total * fy, total * fz
    out[3], out[4], out[5] = my * fz - mz * fy, mz * fx - mx * fz, mx * fy - my * fx
    return total / c.volumes.sum()
