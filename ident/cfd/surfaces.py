"""The surface of a boat as patches: read, checked and measured before a case is written."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.cfd.template import UNITS, Template
from sim.boat.vehicle import Plane, Vehicle
from sim.files.constants import constant
from sim.files.errors import InputError
from sim.files.extras import library
from sim.hull.added_mass import panel_added_mass, wetted_panels
from sim.hull.mesh import Mesh, MeshError, joined
from sim.hull.surface import read_geometry

Array = NDArray[np.float64]
# Stations at which section areas are compared, ends left out.
_STATIONS = np.linspace(0.05, 0.95, 19)
# Panels beyond which the panel method takes minutes.
_MOST_PANELS = 3000
_MOTIONS = ("X_udot", "Y_vdot", "Z_wdot", "K_pdot", "M_qdot", "N_rdot")


@dataclass(frozen=True)
class Check:
    """One number of the surface beside the vehicle file's.

    Attributes
    ----------
    name : What it is, with its unit.
    surface : Of the surface, full scale.
    vehicle : What the vehicle file says; NaN where it says nothing.
    off : Difference, relative as the tolerance is; NaN where there is nothing to compare with.
    tolerance : From the template; NaN where there is none.
    """

    name: str
    surface: float
    vehicle: float = float("nan")
    off: float = float("nan")
    tolerance: float = float("nan")


@dataclass(frozen=True)
class Lines:
    """A boat's surface in the program frame about the vehicle's origin, at the surface's scale [m].

    Attributes
    ----------
    patches : Name -> its triangles, in the order of the file.
    body : All patches, each closed body of them a part.
    members : (parts of ``body``,) patches of each closed body.
    checks : Its numbers beside the vehicle file's.
    """

    patches: dict[str, Mesh]
    body: Mesh
    members: tuple[frozenset[str], ...]
    checks: tuple[Check, ...] = field(default=())

    @property
    def length(self) -> float:
        """Extent along x [m]."""
        return float(np.ptp(self.body.vertices[:, 0]))


def read_surface(path: Path, template: Template, vehicle: Vehicle, where: str) -> Lines:
    """The patches of a surface file, checked against template and vehicle file.

    Parameters
    ----------
    path : STL file, text with a ``solid NAME`` for each patch; or a folder of STL files, each a patch.
    template : Unit, axes, origin, patches of the parts, tolerances.
    vehicle : In the program frame, full scale.
    where : The template file, for messages.

    Returns
    -------
    Lines

    Raises
    ------
    InputError
        For a file that is no surface, a patch that is missing or belongs to no part, a surface that is open or
        inverted, a unit or a number beyond its tolerance of the vehicle file.
    """
    raw = read_patches(path)
    _named(path, set(raw), template, vehicle, where)
    drawn = template.surface
    signs = np.array([drawn.frame.signs[a] for a in "xyz"], dtype=float)
    hand = int(np.prod(signs))
    if hand < 0:
        raise InputError(f"{where}, key surface", "left-handed axes", "right-handed axes of the surface")
    to_metres = UNITS[drawn.unit]
    patches = {
        name: Mesh(
            (vertices - np.array(drawn.origin)) * signs * to_metres, triangles, np.zeros(len(triangles), int), (name,)
        )
        for name, (vertices, triangles) in raw.items()
    }
    _right_unit(path, patches, template, vehicle, where)
    body, members = closed_bodies(path, patches)
    lines = Lines(patches, body, members)
    lines = Lines(patches, body, members, tuple(_numbers(lines, template, vehicle)))
    for one in lines.checks:
        if one.off > one.tolerance:
            wrong = f"{one.name}: {one.surface:.5g} of the surface, {one.vehicle:.5g} of vehicle {vehicle.name}"
            text = f"a difference of {one.tolerance:g} at most; [tolerances] of {where} where the surface is right"
            raise InputError(str(path), wrong, text)
    return lines


def read_patches(path: Path) -> dict[str, tuple[Array, NDArray[np.int64]]]:
    """Patch -> vertices as written and triangles, equal vertices merged."""
    trimesh = library("trimesh", "cfd", "surface")
    paths = sorted(path.glob("*.stl")) if path.is_dir() else [path]
    if not paths or not all(p.is_file() and p.suffix.lower() == ".stl" for p in paths):
        wrong = (
            "no .stl file in the folder" if path.is_dir() else "not a .stl file" if path.is_file() else "no such file"
        )
        raise InputError(
            str(path), wrong, "an STL file with a solid for each patch, or a folder with an STL file for each"
        )
    patches = {}
    for one in paths:
        try:
            scene = trimesh.load_scene(one)
        except Exception as error:  # trimesh raises what its parsers do.
            raise InputError(str(one), f"cannot be read: {error}"[:200], "an STL file") from error
        several = len(scene.geometry) > 1
        for name, mesh in scene.geometry.items():
            # A single solid without a name is called like its file.
            bare = name.strip() in ("", one.name) or (path.is_dir() and not several)
            patch = one.stem if bare else name.strip()
            if patch in patches:
                raise InputError(str(one), f"two patches {patch!r}", "a name for each")
            mesh.merge_vertices(merge_tex=True, merge_norm=True)
            vertices, triangles = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
            if not len(triangles) or not np.isfinite(vertices).all():
                raise InputError(
                    str(one), f"patch {patch!r} without triangles of finite numbers", "a triangulated surface"
                )
            patches[patch] = (vertices, triangles)
    if not patches:
        raise InputError(str(path), "no triangles", "an STL file with a solid for each patch")
    return patches


def _named(path: Path, named: set[str], template: Template, vehicle: Vehicle, where: str) -> None:
    """Every part is the vehicle's, every patch of a part is in the file, and every patch in a part."""
    for part in template.parts:
        if part not in vehicle.part_names():
            raise InputError(f"{where}, key parts.{part}", "no part of the vehicle", ", ".join(vehicle.part_names()))
    wanted = {patch: part for part, patches in template.parts.items() for patch in patches}
    for patch, part in wanted.items():
        if patch not in named:
            text = f"one of {', '.join(sorted(named))}: the solids of the file"
            raise InputError(f"{where}, key parts.{part}", f"patch {patch!r}, which {path} does not have", text)
    for patch in sorted(named):
        if patch not in wanted:
            raise InputError(str(path), f"patch {patch!r} that no part has", f"every patch in [parts] of {where}")


def _right_unit(path: Path, patches: dict[str, Mesh], template: Template, vehicle: Vehicle, where: str) -> None:
    """The length in the stated unit is the vehicle's; the message names the unit that would fit."""
    every = np.concatenate([p.vertices[:, 0] for p in patches.values()])
    wanted = vehicle.particulars.length.value
    length = float(np.ptp(every)) * template.surface.ratio
    if abs(length / wanted - 1.0) <= template.tolerances.length:
        return
    drawn = length / UNITS[template.surface.unit]
    fits = [u for u, size in UNITS.items() if abs(drawn * size / wanted - 1.0) <= template.tolerances.length]
    hint = (
        f"unit = {fits[0]!r}, "
        if fits
        else f"a ratio of {template.surface.ratio * wanted / length:.5g}, "
        if length
        else ""
    )
    text = f"{hint}or a surface as long as vehicle {vehicle.name}, {wanted:g} m"
    stated = f"unit = {template.surface.unit!r} and ratio = {template.surface.ratio:g}"
    what = f"{length:.6g} m long at full scale with {stated}"
    raise InputError(f"{path}, by {where}, key surface.unit", what, text)


def closed_bodies(path: Path, patches: dict[str, Mesh]) -> tuple[Mesh, tuple[frozenset[str], ...]]:
    """All patches as closed bodies, pieces that share edges together, with the patches of each."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    names = list(patches)
    start = np.cumsum([0, *[len(p.vertices) for p in patches.values()]])
    vertices = np.concatenate([p.vertices for p in patches.values()])
    triangles = np.concatenate([p.triangles + n for p, n in zip(patches.values(), start, strict=False)])
    patch = np.concatenate([np.full(len(p.triangles), k) for k, p in enumerate(patches.values())])
    size = float(np.ptp(vertices, axis=0).max()) or 1.0
    # Patches are written with six digits or more: the same place to a millionth of the size.
    _, keep, inverse = np.unique(np.round(vertices / size, 6), axis=0, return_index=True, return_inverse=True)
    vertices, triangles = vertices[keep], inverse.ravel()[triangles]
    proper = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles, patch = triangles[proper], patch[proper]
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(len(vertices),) * 2)
    _, label = connected_components(graph, directed=False)
    body_of = label[triangles[:, 0]]
    parts: list[Mesh] = []
    members: list[frozenset[str]] = []
    for k in np.unique(body_of):
        t = triangles[body_of == k]
        used = frozenset(names[i] for i in np.unique(patch[body_of == k]))
        name = f"{'+'.join(sorted(used))} ({len(parts) + 1})"
        whole = Mesh(vertices, t, np.zeros(len(t), dtype=np.int64), (name,))
        try:
            whole.check(str(path))
        except MeshError as error:
            text = "a closed surface, every triangle counter-clockwise seen from the water"
            wrong = str(error).removeprefix(f"{path}, ")
            if "open" in wrong:
                wrong += " (a hole, or a triangle turned inside out)"
            raise InputError(str(path), wrong, text) from error
        parts.append(whole)
        members.append(used)
    return joined(parts), tuple(members)


def _numbers(lines: Lines, template: Template, vehicle: Vehicle) -> list[Check]:
    """Length, volume, centroid, wetted area, section areas and added mass at full scale."""
    ratio, allowed, particulars = template.surface.ratio, template.tolerances, vehicle.particulars
    length = particulars.length.value
    wet = wetted_panels(lines.body) if len(lines.members) > 1 else lines.body
    measured = lines.length * ratio
    out = [Check("length [m]", measured, length, abs(measured / length - 1.0), allowed.length)]
    displaced = particulars.displaced_mass.value / template.fluid.density_kgpm3
    volume = wet.volume * ratio**3
    out.append(Check("volume [m3]", volume, displaced, abs(volume / displaced - 1.0), allowed.volume))
    centre = wet.centroid * ratio
    for axis, mine, theirs in zip("xyz", centre, particulars.centre_of_buoyancy.value, strict=True):
        out.append(Check(f"centroid {axis} [m]", mine, theirs, abs(mine - theirs) / length, allowed.centroid))
    out.append(Check("wetted area [m2]", float(np.linalg.norm(wet.areas, axis=1).sum()) * ratio**2))
    other = None if vehicle.geometry is None else read_geometry(vehicle.geometry)
    low, high = lines.body.vertices[:, 0].min(), lines.body.vertices[:, 0].max()
    sections = {s: lines.body.section(0, low + s * (high - low))[0] * ratio**2 for s in _STATIONS}
    if other is None:
        out += [Check(f"section area at {s:.2f} of the length [m2]", a) for s, a in sections.items()]
    else:
        theirs_at = {s: other.section(0, ratio * (low + s * (high - low)))[0] for s in _STATIONS}
        largest = max(theirs_at.values())
        for s, area in sections.items():
            off = abs(area - theirs_at[s]) / largest
            out.append(Check(f"section area at {s:.2f} of the length [m2]", area, theirs_at[s], off, allowed.sections))
    return out + _added_mass(wet, other, template)


def _unbounded(panels: Mesh, density: float) -> Array:
    """Added mass of six motions far from the surface [kg, kg m, kg m^2]; raises ``InputError`` without capytaine."""
    matrix = panel_added_mass(panels, np.inf, [np.inf], density, constant("standard_gravity"))[0][0]
    return -np.diag(matrix)


def _added_mass(wet: Mesh, other: Mesh | None, template: Template) -> list[Check]:
    """Added mass in unbounded water over rho/2 L^n by the panel method, where capytaine is installed."""
    if len(wet.triangles) > _MOST_PANELS:
        return []
    ratio, density = template.surface.ratio, template.fluid.density_kgpm3
    powers = np.array([3.0, 3.0, 3.0, 5.0, 5.0, 5.0])
    try:
        by_panels = _unbounded(wet, density) * ratio**powers
        coarse = None if other is None else wetted_panels(other)
        if coarse is None or len(coarse.triangles) > _MOST_PANELS:
            rows = zip(_MOTIONS, by_panels, strict=True)
            return [Check(f"{name} by panels [kg, kg m2]", value) for name, value in rows]
        theirs = _unbounded(coarse, density)
    except InputError:
        return []
    allowed = template.tolerances.added_mass
    # Roll about the axis of a body of revolution is nothing, of which no part is compared.
    least = 1e-3 * np.abs(theirs[3:]).max()
    pairs = enumerate(zip(by_panels, theirs, strict=True))
    offs = [abs(a - b) / max(abs(b), least if k > 2 else 0.0) for k, (a, b) in pairs]
    compared = zip(_MOTIONS, by_panels, theirs, offs, strict=True)
    return [Check(f"{n} by panels [kg, kg m2]", a, b, off, allowed) for n, a, b, off in compared]


def turned(lines: Lines, patches: list[str], plane: Plane, angle: float, ratio: float, where: str) -> dict[str, Mesh]:
    """All patches, those of a plane turned right-handed about its stock.

    Parameters
    ----------
    lines : The surface, planes amidships.
    patches : Of the plane.
    plane : Its position (full scale) and span axis.
    angle : Deflection [rad].
    ratio : Ship over surface.
    where : The template, for messages.

    Raises
    ------
    InputError
        When the patches are not closed bodies of their own: turning them would tear the surface.
    """
    mine = set(patches)
    for members in lines.members:
        if members & mine and not members <= mine:
            text = "a closed body of its own: turned, it would tear the surface"
            raise InputError(
                f"{where}, key parts.{plane.name}", f"patches that share edges with {sorted(members - mine)[0]!r}", text
            )
    axis = np.array(plane.span_axis) / np.linalg.norm(plane.span_axis)
    stock = np.array(plane.position) / ratio
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # Rodrigues' formula.
    matrix = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    out = dict(lines.patches)
    for name in patches:
        one = lines.patches[name]
        out[name] = Mesh((one.vertices - stock) @ matrix.T + stock, one.triangles, one.part, one.names)
    return out
