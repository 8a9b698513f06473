"""A hull from its surface: polar offsets and a geometry file, so that lines speak where no run does yet."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.cfd.surfaces import closed_bodies, read_patches
from ident.cfd.template import UNITS
from ident.output import check_folder, whole
from sim.files.errors import InputError
from sim.files.temporary import temporary_folder
from sim.hull.integral import trapezoid
from sim.hull.mesh import Mesh

Array = NDArray[np.float64]

# Stations along the hull, closer at its ends, and radii from the deck to the keel.
_STATIONS = 61
_ANGLES = np.arange(0.0, 180.5, 15.0)
# Relative: length against the one that is stated; port against starboard; volume of the offsets against the surface's.
_LENGTH, _SYMMETRY, _VOLUME = 0.01, 0.01, 0.01
# Of the length: how far behind the middle a centre of volume is told.
_MIDDLE = 0.005
# Of the length: how near to an end the last section is cut.
_END = 1e-4


@dataclass(frozen=True)
class Offsets:
    """Polar offsets of a hull, x from its nose aft.

    Attributes
    ----------
    x : (n,) stations [m].
    angle : (k,) from the top [deg].
    radius : (n, k) from the axis [m].
    volume, surface_volume : Of the offsets, and of the surface they were taken from [m^3].
    centre : Centre of volume aft of the nose [m].
    source : The surface file.
    """

    x: Array
    angle: Array
    radius: Array
    volume: float
    surface_volume: float
    centre: float
    source: str

    @property
    def stern_first(self) -> bool:
        """Whether the centre of volume lies behind the middle, as that of a submarine read from its tail does."""
        return self.centre > (0.5 + _MIDDLE) * float(self.x[-1] - self.x[0])

    def to_dict(self) -> dict[str, object]:
        """The offsets for a program to read."""
        numbers = {"x_m": self.x.tolist(), "angle_deg": self.angle.tolist(), "radius_m": self.radius.tolist()}
        volumes = {"volume_m3": self.volume, "surface_volume_m3": self.surface_volume, "centre_m": self.centre}
        return {"source": self.source, **volumes, **numbers}

    def write(self, folder: Path) -> tuple[Path, Path]:
        """Write ``hull_offsets.csv`` and ``hull.toml``, which a vehicle file names by ``geometry = "hull.toml"``.

        Raises
        ------
        InputError
            For a folder that cannot be written to.
        """
        check_folder(folder)
        table, text = folder / "hull_offsets.csv", folder / "hull.toml"
        header = ",".join(["x_m", *(f"r_{int(a):03d}" for a in self.angle)])
        lines = [",".join(f"{v:.6g}" for v in (x, *r)) for x, r in zip(self.x, self.radius, strict=True)]
        with whole(table) as part:
            part.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
        with whole(text) as part:
            part.write_text(_geometry(self), encoding="utf-8")
        return table, text


def _geometry(offsets: Offsets) -> str:
    name = Path(offsets.source).stem.replace("\\", "").replace('"', "")
    file = Path(offsets.source).name.replace("\\", "").replace('"', "")
    return f"""# Hull from its surface; sail and planes are parts to be added (docs/your-own-boat.md).
name = "{name}"
source = "{file}"

# x = 0 is the nose, z = 0 the axis of the offsets.
[frame]
x = "aft"
y = "starboard"
z = "up"

# The vehicle file's origin in these axes.
[origin]
value = [{offsets.centre:.6g}, 0.0, 0.0]
unit = "m"
source = "centre of volume of the surface: put the vehicle's own origin here"

[[parts]]
kind = "hull"
name = "hull"
offsets = "hull_offsets.csv"
around = 24
step_m = {(offsets.x[-1] - offsets.x[0]) / 40.0:.3g}
"""


def offsets_of(
    surface: Path, unit: str, length: float, forward: bool = False, up: bool = True, axis: float = 0.0
) -> Offsets:
    """Polar offsets of a hull from an STL file.

    Parameters
    ----------
    surface : STL file of the hull alone, or a folder of STL files that close one body together.
    unit : Of its coordinates, a key of ``ident.cfd.template.UNITS``.
    length : Over all, that the surface must have in this unit [m].
    forward, up : Whether x of the surface points forward, and z up; y follows, as axes are right-handed.
    axis : Height of the axis of the offsets, z of the surface in its unit.

    Raises
    ------
    InputError
        For a file that is no surface, one that is open or turned inside out, more than one closed body, another
        length, sections without the axis, or a hull that is not the same to port and starboard.
    """
    if unit not in UNITS:
        raise InputError("--unit", repr(unit), ", ".join(UNITS))
    size = UNITS[unit]
    signs = np.array([1.0 if forward else -1.0, 1.0, -1.0 if up else 1.0])
    signs[1] = signs[0] * signs[2]
    patches = {
        name: Mesh((v - np.array([0.0, 0.0, axis])) * signs * size, t, np.zeros(len(t), np.int64), (name,))
        for name, (v, t) in read_patches(surface).items()
    }
    every = np.concatenate([p.vertices[:, 0] for p in patches.values()])
    _right_length(surface, float(np.ptp(every)), length, unit)
    body, members = closed_bodies(surface, patches)
    if len(members) > 1:
        wrong = f"{len(members)} closed bodies: {', '.join('+'.join(sorted(m)) for m in members)}"[:200]
        raise InputError(str(surface), wrong, "the hull alone; sail and planes are parts of the geometry file")
    _about_the_axis(body, surface)
    nose, tail = float(body.vertices[:, 0].max()), float(body.vertices[:, 0].min())
    x = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, _STATIONS))) * (nose - tail)
    radius = np.stack([_radii(body, nose - min(max(s, _END * x[-1]), (1.0 - _END) * x[-1]), surface) for s in x])
    _ended(body, radius, nose, tail)
    volume = _volume(x, radius)
    if abs(volume / body.volume - 1.0) > _VOLUME:
        wrong = f"{volume:.5g} m3 by polar sections, {body.volume:.5g} m3 by the surface"
        raise InputError(str(surface), wrong, "a hull whose sections each ray from the axis leaves once, without sail")
    centre = float(nose - body.centroid[0])
    return Offsets(x, _ANGLES, radius, volume, float(body.volume), centre, str(surface))


def _right_length(surface: Path, length: float, wanted: float, unit: str) -> None:
    if abs(length / wanted - 1.0) <= _LENGTH:
        return
    fits = [u for u, size in UNITS.items() if abs(length / UNITS[unit] * size / wanted - 1.0) <= _LENGTH]
    text = f"--unit {fits[0]}" if fits else f"a surface as long as --length says, {wanted:g} m"
    raise InputError(str(surface), f"{length:.6g} m long with --unit {unit}", text)


def _about_the_axis(body: Mesh, surface: Path) -> None:
    """Refuse a hull whose middle plane is not y = 0."""
    port, starboard = float(body.vertices[:, 1].min()), float(body.vertices[:, 1].max())
    if abs(port + starboard) > _SYMMETRY * (starboard - port):
        wrong = f"port and starboard differ: its sides are at y = {port:.3g} and {starboard:.3g} m"
        raise InputError(str(surface), wrong, "a hull that is the same to both sides of y = 0")


def _radii(body: Mesh, at: float, surface: Path) -> Array:
    """(k,) radii of the section at x, starboard and port together."""
    a, b = body.cut(0, at)
    theta = np.radians(np.concatenate([_ANGLES, -_ANGLES]))
    # y to starboard, z down: the top is at -z.
    ray = np.stack([np.sin(theta), -np.cos(theta)], axis=1)[:, None, :]
    edge = (b - a)[None]
    cross = ray[..., 0] * edge[..., 1] - ray[..., 1] * edge[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (a[:, 0] * ray[..., 1] - a[:, 1] * ray[..., 0]) / cross
        far = (a[:, 0] * edge[..., 1] - a[:, 1] * edge[..., 0]) / cross
    # A corner belongs to both of its edges, so that no ray passes between them.
    hit = (along >= -1e-9) & (along <= 1.0 + 1e-9) & (far > 0.0) & (cross != 0.0)
    if not hit.any(axis=1).all():
        wrong = f"the axis lies outside of the section at x = {at:.4g} m of the surface turned ahead"
        raise InputError(str(surface), wrong, "--axis, a height that all sections contain")
    both = np.where(hit, far, 0.0).max(axis=1).reshape(2, -1)
    widest = float(np.abs(body.vertices[:, 1:]).max())
    if np.abs(both[0] - both[1]).max() > _SYMMETRY * widest:
        wrong = f"port and starboard differ by {np.abs(both[0] - both[1]).max():.3g} m at a section"
        raise InputError(str(surface), wrong, "a hull that is the same to both sides of y = 0")
    return np.asarray(both.mean(axis=0))


def _ended(body: Mesh, radius: Array, nose: float, tail: float) -> None:
    """Ends of the offsets: a point where the surface ends in one, else the section beside it."""
    near = _END * (nose - tail)
    for row, place in ((0, nose), (-1, tail)):
        there = body.vertices[np.abs(body.vertices[:, 0] - place) < 1e-9 * (nose - tail)]
        if np.ptp(there[:, 1:], axis=0).max() < near:
            radius[row] = 0.0


def _volume(x: Array, radius: Array) -> float:
    """Of the offsets as the geometry file's splines take them."""
    from sim.hull.surface import Hull

    header = ",".join(["x_m", *(f"r_{int(a):03d}" for a in _ANGLES)])
    lines = [",".join(repr(float(v)) for v in (s, *r)) for s, r in zip(x, radius, strict=True)]
    with temporary_folder() as folder:
        path = folder / "hull.csv"
        path.write_text("\n".join([header, *lines]), encoding="utf-8")
        hull = Hull(path)
    s = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 401))) * x[-1]
    angle = np.linspace(0.0, np.pi, 181)
    area = trapezoid(hull.radius(s, angle) ** 2, angle, axis=1)
    return float(trapezoid(area, s))
