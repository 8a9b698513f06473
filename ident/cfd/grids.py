"""The mesh of a case: background block, refinement rule, prism layers; one set of dictionaries a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ident.cfd.template import Template, settings
from sim.hull.mesh import Mesh

GRIDS = ("fine", "medium", "coarse")


@dataclass(frozen=True)
class Box:
    """The domain of a case and its cells.

    Attributes
    ----------
    low, high : Corners [m].
    cells : Of the background along each axis.
    wall : Length of a cell on the wall [m].
    surface : Whether the upper side (least z) is the plane of symmetry at the water's surface.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    cells: tuple[int, int, int]
    wall: float
    surface: bool

    @property
    def inside(self) -> list[float]:
        """A point of the water, off every face of the background."""
        low, high = np.array(self.low), np.array(self.high)
        size = (high - low) / np.array(self.cells)
        return [float(v) for v in low + (0.5 + np.array([0.013, 0.017, 0.019])) * size]


def wall_cell(template: Template, length: float, grid: str) -> float:
    """Length of a cell on the wall of a grid [m]: finest times the ratio for each coarser one."""
    return length / template.grid.cells_per_length * template.grid.refinement ** GRIDS.index(grid)


def box(template: Template, surface: Mesh, length: float, grid: str, surface_z: float | None) -> Box:
    """The domain: cubic cells of ``wall 2^levels``, as many as fill ``extent`` lengths either way.

    Parameters
    ----------
    template : Refinement rule.
    surface : The boat, in mesh axes [m].
    length : Of the boat [m].
    grid : ``fine``, ``medium`` or ``coarse``.
    surface_z : Of the water's surface in mesh axes; None in unbounded water.

    Returns
    -------
    Box
        Cells have their stated length in every grid, so that lengths of successive grids have the stated ratio. The
        sides of the domain, ``extent`` lengths off or up to two cells more, therefore differ by less than that.
    """
    wall = wall_cell(template, length, grid)
    back = wall * 2**template.grid.levels
    middle = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
    reach = template.grid.extent * length
    # Whole cells either way: in all grids the middle of the boat lies between cells, not in one grid within them.
    half = math.ceil(reach / back - 1e-9) * back
    low, high = middle - half, middle + half
    if surface_z is not None:
        low[2] = surface_z
        high[2] = surface_z + math.ceil((middle[2] + reach - surface_z) / back - 1e-9) * back
    cells = tuple(round((b - a) / back) for a, b in zip(low, high, strict=True))
    return Box(tuple(map(float, low)), tuple(map(float, high)), cells, wall, surface_z is not None)  # type: ignore[arg-type]


def block_mesh(domain: Box) -> dict[str, Any]:
    """``system/blockMeshDict``."""
    (x0, y0, z0), (x1, y1, z1) = domain.low, domain.high
    corners = [[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]]
    corners += [[x, y, z1] for x, y, _ in corners]
    sides = {"top": [0, 3, 2, 1], "bottom": [4, 5, 6, 7], "back": [0, 4, 7, 3], "front": [1, 2, 6, 5]}
    sides |= {"port": [0, 1, 5, 4], "starboard": [3, 7, 6, 2]}
    far = [face for name, face in sides.items() if not (domain.surface and name == "top")]
    patches: list[Any] = [("far", {"type": "patch", "faces": far})]
    if domain.surface:
        patches.append(("surface", {"type": "symmetryPlane", "faces": [sides["top"]]}))
    return {
        "scale": 1,
        "vertices": corners,
        "blocks": ["hex", list(range(8)), list(domain.cells), "simpleGrading", [1, 1, 1]],
        "edges": [],
        "boundary": patches,
        "mergePatchPairs": [],
    }


# What keeps a mesh usable, as the tutorials of OpenFOAM have it; the least volume is added by size.
_QUALITY = {
    "maxNonOrtho": 65,
    "maxBoundarySkewness": 20,
    "maxInternalSkewness": 4,
    "maxConcave": 80,
    "minTetQuality": 1e-15,
    "minArea": -1,
    "minTwist": 0.02,
    "minDeterminant": 0.001,
    "minFaceWeight": 0.05,
    "minVolRatio": 0.01,
    "minTriangleTwist": -1,
    "nSmoothScale": 4,
    "errorReduction": 0.75,
}
_SNAP = {
    "nSmoothPatch": 3,
    "tolerance": 2.0,
    "nSolveIter": 30,
    "nRelaxIter": 5,
    "nFeatureSnapIter": 10,
    "implicitFeatureSnap": True,
    "explicitFeatureSnap": False,
    "multiRegionFeatureSnap": False,
}


def _layers(template: Template, patches: list[str]) -> dict[str, Any]:
    """How layers on the walls are added, where the template has any."""
    layers = template.grid.layers
    return {
        "relativeSizes": True,
        "layers": {name: {"nSurfaceLayers": layers.number} for name in patches} if layers else {},
        "expansionRatio": layers.expansion if layers else 1.2,
        "finalLayerThickness": layers.thickness if layers else 0.5,
        "minThickness": 0.05 * layers.thickness if layers else 0.05,
        "nGrow": 0,
        "featureAngle": 120,
        "nRelaxIter": 5,
        "nSmoothSurfaceNormals": 1,
        "nSmoothNormals": 3,
        "nSmoothThickness": 10,
        "maxFaceThicknessRatio": 0.5,
        "maxThicknessToMedialRatio": 0.3,
        "minMedianAxisAngle": 90,
        "nBufferCellsNoExtrude": 0,
        "nLayerIter": 50,
    }


def refinement_bands(levels: int, wall: float, near: float) -> list[list[float]]:
    """Distance from the walls [m] up to which each level is refined, finest first.

    Walls have the level ``levels``, ``near`` has one less, and so on, twice as far each. No distance is less than the
    length of the cells that are to be halved: a cell through which a wall passes has its centre within 0.87 of that.
    A test of edges against the surface alone leaves out walls that pass between the centres of coarse cells.

    Examples
    --------
    >>> refinement_bands(2, 0.1, 0.5)
    [[0.2, 2], [0.5, 1]]
    """
    bands = [[2.0 * wall, levels]]
    bands += [[max(near * 2.0**k, 2.0 ** (k + 2) * wall), levels - 1 - k] for k in range(levels - 1)]
    return bands


def snappy(template: Template, patches: list[str], domain: Box, length: float) -> dict[str, Any]:
    """``system/snappyHexMeshDict``: ``levels`` on the walls and coarser with the distance from them."""
    levels = template.grid.levels
    bands = refinement_bands(levels, domain.wall, settings()["reach"] * length)
    walls = {name: {"level": [levels, levels], "patchInfo": {"type": "wall"}} for name in patches}
    return {
        "castellatedMesh": True,
        "snap": True,
        "addLayers": template.grid.layers is not None,
        "geometry": {f"{name}.stl": {"type": "triSurfaceMesh", "name": name} for name in patches},
        "castellatedMeshControls": {
            "maxLocalCells": 100000000,
            "maxGlobalCells": 2000000000,
            "minRefinementCells": 0,
            "nCellsBetweenLevels": int(settings()["buffer"]),
            "features": [],
            "refinementSurfaces": walls,
            "resolveFeatureAngle": 30,
            "refinementRegions": {name: {"mode": "distance", "levels": bands} for name in patches},
            "locationInMesh": domain.inside,
            "allowFreeStandingZoneFaces": False,
        },
        "snapControls": dict(_SNAP),
        "addLayersControls": _layers(template, patches),
        "meshQualityControls": _QUALITY | {"minVol": 1e-9 * domain.wall**3},
        "mergeTolerance": 1e-6,
    }
