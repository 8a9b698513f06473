"""One case folder: dictionaries through foamlib, surfaces, and the script that runs it."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.cfd import dictionaries as d
from ident.cfd import scripts
from ident.cfd.case import Case
from ident.cfd.grids import Box, block_mesh, box, snappy
from ident.cfd.motions import Motion
from ident.cfd.template import Template
from sim.files.extras import library
from sim.hull.mesh import Mesh

Array = NDArray[np.float64]
Entries = dict[str, Any]
_MADE: dict[tuple[str, str, str], bytes] = {}
_MOST = 2000


@dataclass(frozen=True)
class Disc:
    """An actuator disc in mesh axes [m].

    Attributes
    ----------
    centre : Of the propeller.
    radius, thickness : Of the disc.
    """

    centre: Array
    radius: float
    thickness: float


@dataclass(frozen=True)
class Body:
    """A boat in mesh axes, and what surrounds it; cases with the same one share their meshes.

    Attributes
    ----------
    patches : Name -> triangles [m].
    length : Of the boat [m].
    surface_z : Of the water's surface; None in unbounded water.
    disc : Of self-propulsion.
    """

    patches: dict[str, Mesh]
    length: float
    surface_z: float | None = None
    disc: Disc | None = None

    @property
    def whole(self) -> Mesh:
        """All patches as one heap of triangles."""
        from sim.hull.mesh import joined

        return joined(list(self.patches.values()))


def write_dictionary(path: Path, entries: Entries) -> None:
    """A dictionary of OpenFOAM, through foamlib.

    Raises
    ------
    InputError
        When foamlib is not installed.
    """
    foamlib = library("foamlib", "cfd", "cases")

    def make() -> None:
        with foamlib.FoamFile(path) as file:
            for key, value in entries.items():
                file[key] = value

    _once(path, entries, make)


def _once(path: Path, entries: Any, make: Callable[[], None]) -> None:
    """Make a file, or write what was made before of the same entries: foamlib parses all that it writes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    key = (path.parent.name, path.name, json.dumps(entries))
    if key not in _MADE:
        make()
        if len(_MADE) >= _MOST:
            _MADE.clear()
        _MADE[key] = path.read_bytes()
    path.write_bytes(_MADE[key])


def write_field(path: Path, dimensions: tuple[int, int, int], inner: Any, patches: Entries) -> None:
    """A field of the start, through foamlib: its dimensions as powers of kilogram, metre, second."""
    from foamlib import FoamFieldFile

    def make() -> None:
        mass, length, time = dimensions
        with FoamFieldFile(path) as file:
            file.dimensions = FoamFieldFile.DimensionSet(mass=mass, length=length, time=time)
            file.internal_field = inner
            file["boundaryField"] = {}
            for name, entry in patches.items():
                file["boundaryField", name] = entry

    _once(path, [dimensions, inner, patches], make)


def write_mesh(folder: Path, body: Body, template: Template, grid: str) -> Box:
    """The folder of a mesh: surfaces, blockMesh, snappyHexMesh, cell zones, and ``Allmesh`` that makes it once."""
    domain = box(template, body.whole, body.length, grid, body.surface_z)
    for name, patch in body.patches.items():
        _write_stl(folder / "constant" / "triSurface" / f"{name}.stl", patch)
    system = folder / "system"
    write_dictionary(system / "blockMeshDict", block_mesh(domain))
    write_dictionary(system / "snappyHexMeshDict", snappy(template, list(body.patches), domain, body.length))
    write_dictionary(system / "topoSetDict", _zones(domain, body.disc))
    still = Motion("inflow")
    write_dictionary(
        system / "controlDict", {**d.control(template, still, {}, np.zeros(3), domain.wall), "functions": {}}
    )
    write_dictionary(system / "fvSchemes", d.schemes(still))
    write_dictionary(system / "fvSolution", d.solution(template, still))
    _script(folder / "Allmesh", scripts.mesh())
    return domain


def _zones(domain: Box, disc: Disc | None) -> Entries:
    """All cells as the zone that may turn, and those of the disc."""
    low, high = np.array(domain.low) - 1.0, np.array(domain.high) + 1.0
    actions: list[Entries] = [
        {"name": "waterSet", "type": "cellSet", "action": "new", "source": "boxToCell", "box": _corners(low, high)},
        {"name": "water", "type": "cellZoneSet", "action": "new", "source": "setToCellZone", "set": "waterSet"},
    ]
    if disc is not None:
        half = np.array([0.5 * disc.thickness, 0.0, 0.0])
        cylinder = {
            "p1": d.vector(disc.centre - half),
            "p2": d.vector(disc.centre + half),
            "radius": float(disc.radius),
        }
        actions += [
            {"name": "discSet", "type": "cellSet", "action": "new", "source": "cylinderToCell", **cylinder},
            {"name": "disc", "type": "cellZoneSet", "action": "new", "source": "setToCellZone", "set": "discSet"},
        ]
    return {"actions": actions}


def _corners(low: Array, high: Array) -> Any:
    return (d.vector(low), d.vector(high))


def _write_stl(path: Path, patch: Mesh) -> None:
    import trimesh

    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.Trimesh(patch.vertices, patch.triangles, process=False).export(path, file_type="stl")


def _script(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
    path.chmod(0o755)


@dataclass
class PlannedCase:
    """A case with what it is made of, before it is written.

    Attributes
    ----------
    case : As ``campaign.toml`` and the matrix name it.
    motion : What it does.
    body : The boat in mesh axes.
    centre : Moment point in mesh axes [m].
    speed : Of the flow past the hull, for the turbulence of the inflow [m/s].
    """

    case: Case
    motion: Motion
    body: Body
    centre: Array
    speed: float


def write_case(folder: Path, mesh: Path, planned: PlannedCase, template: Template, wall: float) -> None:
    """A case folder that runs by its ``Allrun``.

    Parameters
    ----------
    folder : Of the case.
    mesh : Folder of its mesh.
    planned : The case.
    template : What all cases share.
    wall : Length of a cell on the wall [m].
    """
    motion, body = planned.motion, planned.body
    system, constant = folder / "system", folder / "constant"
    walls = list(body.patches)
    parts = {part: list(of_part) for part, of_part in template.parts.items()}
    write_dictionary(system / "controlDict", d.control(template, motion, parts, planned.centre, wall))
    write_dictionary(system / "fvSchemes", d.schemes(motion))
    write_dictionary(system / "fvSolution", d.solution(template, motion))
    write_dictionary(constant / "transportProperties", d.transport(template))
    write_dictionary(constant / "turbulenceProperties", d.turbulence(template))
    if motion.kind in ("rotating", "spun"):
        write_dictionary(constant / "MRFProperties", d.rotating_frame(motion))
    if motion.kind in ("accelerated", "propelled"):
        write_dictionary(constant / "fvOptions", d.sources(motion))
    if motion.kind == "moving":
        write_dictionary(constant / "dynamicMeshDict", d.moving_mesh(motion))
    if template.machine.cores > 1:
        cores = template.machine.cores
        split = {"numberOfSubdomains": cores, "method": "hierarchical", "coeffs": {"n": [cores, 1, 1]}}
        write_dictionary(system / "decomposeParDict", split)
    fields = d.fields(template, motion, walls, body.surface_z is not None, planned.speed, body.length)
    for name, (dimensions, inner, patches) in fields.items():
        write_field(folder / "0.orig" / name, dimensions, inner, patches)
    _script(
        folder / "Allrun",
        scripts.case(os.path.relpath(mesh, folder), d.application(motion), template.machine.cores),
    )
