"""Outlines of a boat, from the side and from above, for drawings of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sim.boat.vehicle import Vehicle

Array = NDArray[np.float64]

# Stations along each part.
_STATIONS = 40
# The box of a boat without geometry: height and breadth over length.
_SLENDER = 0.13


@dataclass(frozen=True)
class Silhouette:
    """Outlines of a boat's parts, body axes (x forward, y starboard, z down) about the origin [m].

    Attributes
    ----------
    side : Outlines (n, 2) in x, z of each part.
    top : The same in x, y.
    """

    side: list[Array]
    top: list[Array]


def silhouette(vehicle: Vehicle) -> Silhouette:
    """Outlines from the vehicle's surface; a box of its length where it names none.

    Raises
    ------
    InputError
        When the geometry file is wrong.
    """
    if vehicle.geometry is None:
        half = 0.5 * vehicle.particulars.length.value
        tall = _SLENDER * half
        box = np.array([[half, -tall], [half, tall], [-half, tall], [-half, -tall]])
        return Silhouette([box], [box])
    from sim.hull.surface import read_geometry

    mesh = read_geometry(vehicle.geometry)
    side: list[Array] = []
    top: list[Array] = []
    for name in mesh.names:
        part = mesh.only(name)
        x = part.corners[:, :, 0]
        # Just inside the ends, where a plane still cuts.
        inset = 1e-3 * (x.max() - x.min())
        spaced = 0.5 * (1.0 - np.cos(np.linspace(0.0, math.pi, _STATIONS)))
        stations = x.min() + inset + (x.max() - x.min() - 2.0 * inset) * spaced
        limits = []
        for at in stations:
            # Of a plane normal to x the other axes are y, z.
            points = np.concatenate(part.cut(0, float(at)))
            if points.size:
                limits.append([at, *points.min(axis=0), *points.max(axis=0)])
        a = np.array(limits)
        for outlines, k in ((top, 1), (side, 2)):
            outlines.append(np.concatenate([a[:, [0, k]], a[::-1][:, [0, k + 2]]]))
    return Silhouette(side, top)


def from_the_side(outline: Array, pitch: float, heel: float = 0.0) -> Array:
    """An outline in the body's x, z as seen from starboard, across the heading.

    Parameters
    ----------
    outline : (n, 2) x forward, z down [m].
    pitch, heel : theta and phi [rad]; theta > 0 lifts the bow.

    Returns
    -------
    (n, 2) ahead along the heading, and depth, from the origin [m].
    """
    x, z = outline.T
    down = z * math.cos(heel)
    c, s = math.cos(pitch), math.sin(pitch)
    return np.column_stack([c * x + s * down, -s * x + c * down])


def from_above(outline: Array, heading: float) -> Array:
    """An outline in the body's x, y as seen from above: (n, 2) north, east from the origin [m]."""
    x, y = outline.T
    c, s = math.cos(heading), math.sin(heading)
    return np.column_stack([c * x - s * y, s * x + c * y])
