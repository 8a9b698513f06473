"""The closed outer surface of a vehicle from its geometry file.

A geometry file (TOML) lists parts, each with a table of offsets beside it: ``hull`` (polar
radii at stations), ``sail`` (wall, shoulder and crown of a symmetric section, foot on the
deck), ``foils`` (planes and roots by their corners). A boat may have a hull alone.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from sim.boat.stated import Place
from sim.files.errors import InputError
from sim.files.schema import Data, FrameData, checked
from sim.files.toml_files import read_toml
from sim.hull.mesh import Array, Index, Mesh, MeshError, closed_part, joined

_FOIL_COLUMNS = [
    "span_x",
    "span_y",
    "span_z",
    "base_z_m",
    "LE_root_x_m",
    "LE_root_s_m",
    "LE_tip_x_m",
    "LE_tip_s_m",
    "TE_tip_x_m",
    "TE_tip_s_m",
    "TE_root_x_m",
    "TE_root_s_m",
    "thickness_over_chord",
    "half_TE_thickness_m",
]
_SAIL_COLUMNS = ["x_m", "y_wall_m", "z_wall_top_m", "y_shoulder_m", "z_shoulder_m", "y_mid_m", "z_mid_m", "z_top_m"]
# Half thickness of a NACA four-digit section over the thickness ratio, Abbott and von Doenhoff (1959).
_NACA = (5 * 0.2969, -5 * 0.126, -5 * 0.3516, 5 * 0.2843, -5 * 0.1015)


class HullPart(Data):
    """A body of polar sections along x: hull, hub."""

    kind: Literal["hull"]
    name: str
    offsets: str
    around: Annotated[int, Field(ge=8, multiple_of=2)]
    step_m: Annotated[float, Field(gt=0)]


class SailPart(Data):
    """A sail standing on the deck of a hull part."""

    kind: Literal["sail"]
    name: str
    offsets: str
    on: str
    levels: Annotated[int, Field(ge=2)]


class FoilParts(Data):
    """Planes and roots, one a row of the table.

    A column ``plane`` names the vehicle's plane that a foil belongs to, and ``fixed`` says whether it is the root
    that stays (1) or the part that moves (0): for estimates of what a deflected plane loads beside itself.
    """

    kind: Literal["foils"]
    name: str
    offsets: str
    along_chord: Annotated[int, Field(ge=4)]
    along_span: Annotated[int, Field(ge=1)]


class Geometry(Data):
    """A geometry file."""

    name: str
    source: str
    frame: FrameData
    origin: Place
    parts: Annotated[list[Annotated[HullPart | SailPart | FoilParts, Field(discriminator="kind")]], Field(min_length=1)]


def _table(path: Path, columns: list[str]) -> pd.DataFrame:
    """A CSV of finite numbers (columns of names aside) with at least these columns."""
    if not path.is_file():
        raise InputError(str(path), "no such file", "the offsets the geometry file names")
    table = pd.read_csv(path, dtype=str)
    for column in columns:
        if column not in table:
            raise InputError(str(path), f"column {column} missing", ", ".join(columns))
    for column in table.columns.drop(["name", "plane"], errors="ignore"):
        numbers = pd.to_numeric(table[column], errors="coerce").astype(float)
        bad = np.flatnonzero(~np.isfinite(numbers))
        if bad.size:
            place = f"{path}, row {bad[0] + 2}, column {column}"
            raise InputError(place, repr(table[column].iloc[bad[0]]), "a finite number")
        table[column] = numbers
    return table


@lru_cache(maxsize=8)
def _same_hull(path: Path, changed: int, size: int) -> Hull:
    return Hull(path)


def hull_of(path: Path) -> Hull:
    """The hull of a table of offsets, read once as long as the file is the same. Raises as ``Hull``."""
    if not path.is_file():
        return Hull(path)
    state = path.stat()
    return _same_hull(path, state.st_mtime_ns, state.st_size)


class Hull:
    """Radii of a hull anywhere, from polar offsets at stations.

    Around, a cubic spline mirrored at top and keel. Along, a modified Akima spline; where the
    nose is a point, in the square root of the distance from it and mirrored, which a round
    nose needs.

    Parameters
    ----------
    path : Table with ``x_m`` from the nose on and either ``r_m`` or ``r_DDD`` at DDD degrees
        from the top (0 to 180).

    Raises
    ------
    InputError
        For a missing column, a bad number, or stations that do not increase.
    """

    def __init__(self, path: Path) -> None:
        from scipy.interpolate import Akima1DInterpolator

        table = _table(path, ["x_m"])
        names = [c for c in map(str, table.columns) if c.startswith("r_") and c != "r_m"]
        if not names and "r_m" not in table:
            raise InputError(str(path), "no radii", "a column r_m, or columns r_000 ... r_180")
        self.x = table["x_m"].to_numpy(float)
        if len(self.x) < 4 or (np.diff(self.x) <= 0.0).any():
            raise InputError(f"{path}, column x_m", "stations", "at least four, increasing")
        radii = table[names].to_numpy(float) if names else np.repeat(table[["r_m"]].to_numpy(float), 3, axis=1)
        angles = np.radians([float(c[2:]) for c in names]) if names else np.array([0.0, 0.5, 1.0]) * np.pi
        if (radii < 0.0).any():
            raise InputError(f"{path}, row {np.argwhere(radii < 0.0)[0][0] + 2}", "a negative radius", "zero or more")
        if abs(angles[0]) > 1e-12 or abs(angles[-1] - np.pi) > 1e-12 or (np.diff(angles) <= 0.0).any():
            raise InputError(f"{path}, columns r_DDD", ", ".join(names), "increasing angles from 000 to 180")
        self.pointed = not radii[0].any()
        s = self._s(self.x)
        if self.pointed:
            s, radii = np.concatenate([-s[:0:-1], s]), np.concatenate([-radii[:0:-1], radii])
        self._along = Akima1DInterpolator(s, radii, method="makima")
        self._angles = angles

    def _s(self, x: Array) -> Array:
        return np.sqrt(np.maximum(x - self.x[0], 0.0)) if self.pointed else x

    def radius(self, x: Array, angle: Array) -> Array:
        """(len(x), len(angle)) radii [m] at x [m] and angle from the top [rad, 0 to pi]."""
        from scipy.interpolate import CubicSpline

        return np.maximum(CubicSpline(self._angles, self._along(self._s(x)), axis=1, bc_type="clamped")(angle), 0.0)

    def deck(self, x: Array, y: Array) -> Array:
        """Height of the deck above the axis [m] at points (x, y), |y| inside the hull."""
        angle = np.linspace(0.0, 0.5 * np.pi, 181)
        r = self.radius(x, angle)
        return np.array([np.interp(abs(b), a * np.sin(angle), a * np.cos(angle)) for a, b in zip(r, y, strict=True)])

    def stations(self, step: float) -> Array:
        """The table's stations with each interval cut to at most ``step`` [m]."""
        pieces = [
            np.linspace(a, b, max(1, int(np.ceil((b - a) / step))), endpoint=False)
            for a, b in zip(self.x[:-1], self.x[1:], strict=True)
        ]
        return np.append(np.concatenate(pieces), self.x[-1])


def _skin(rings: int, around: int) -> Index:
    """Triangles between successive closed rings; the diagonals of the two halves mirror each other."""
    i, j = (k.ravel() for k in np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij"))
    a, b = i * around + j, i * around + (j + 1) % around
    c, d = a + around, b + around
    first = (j < around // 2)[:, None]
    return np.concatenate(
        [
            np.where(first, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1)),
            np.where(first, np.stack([b, d, c], axis=1), np.stack([a, d, c], axis=1)),
        ]
    )


def hull_mesh(name: str, hull: Hull, around: int, step: float) -> Mesh:
    """A closed hull of ``around`` sides, flat or pointed at its ends.

    Parameters
    ----------
    name : Of the part.
    hull : Offsets.
    around : Sides of a section.
    step : Largest distance between rings [m].
    """
    x = hull.stations(step)
    angle = 2.0 * np.pi * np.arange(around) / around
    r = hull.radius(x, np.minimum(angle, 2.0 * np.pi - angle))
    rings = np.stack([np.repeat(x[:, None], around, axis=1), r * np.sin(angle), r * np.cos(angle)], axis=-1)
    n = len(x) * around
    ends = np.array([[x[0], 0.0, 0.0], [x[-1], 0.0, 0.0]])
    j = np.arange(around)
    k = (j + 1) % around
    nose = np.stack([np.full(around, n), k, j], axis=1)
    tail = np.stack([np.full(around, n + 1), j + n - around, k + n - around], axis=1)
    triangles = np.concatenate([_skin(len(x), around), nose, tail])
    return closed_part(name, np.concatenate([rings.reshape(-1, 3), ends]), triangles)


def _loft(name: str, rings: Array) -> Mesh:
    """A body from contours whose vertices j and N - j face each other; the ends are capped."""
    count, around = rings.shape[:2]
    j = np.arange(1, (around + 1) // 2)
    left = np.concatenate([[0], j])
    right = np.concatenate([[0], around - j])
    a, b, c, d = left[:-1], left[1:], right[:-1], right[1:]
    cap = np.concatenate([np.stack([a, c, b], axis=1), np.stack([c, d, b], axis=1)])
    last = cap[:, ::-1] + (count - 1) * around
    triangles = np.concatenate([_skin(count, around), cap, last])
    return closed_part(name, rings.reshape(-1, 3), triangles)


def foil_mesh(row: pd.Series, along_chord: int, along_span: int) -> Mesh:
    """A plane or root between its four corners, NACA four-digit with a blunt trailing edge."""
    xi = 0.5 * (1.0 - np.cos(np.pi * np.arange(along_chord + 1) / along_chord))
    powers = np.array([np.sqrt(xi), xi, xi**2, xi**3, xi**4])
    naca = np.array(_NACA) @ powers
    span = np.array([row.span_x, row.span_y, row.span_z], dtype=float)
    span /= np.linalg.norm(span)
    normal = np.cross([1.0, 0.0, 0.0], span)
    rings = []
    for eta in np.linspace(0.0, 1.0, along_span + 1):
        lead = (1 - eta) * np.array([row.LE_root_x_m, row.LE_root_s_m]) + eta * np.array(
            [row.LE_tip_x_m, row.LE_tip_s_m]
        )
        trail = (1 - eta) * np.array([row.TE_root_x_m, row.TE_root_s_m]) + eta * np.array(
            [row.TE_tip_x_m, row.TE_tip_s_m]
        )
        line = lead + xi[:, None] * (trail - lead)
        chord = trail[0] - lead[0]
        half = chord * row.thickness_over_chord * (naca - naca[-1] * xi) + row.half_TE_thickness_m * xi
        base = np.array([0.0, 0.0, row.base_z_m])
        middle = base + line[:, :1] * np.array([1.0, 0.0, 0.0]) + line[:, 1:] * span
        upper, lower = middle + half[:, None] * normal, middle - half[:, None] * normal
        rings.append(np.concatenate([upper, lower[:0:-1]]))
    return _loft(str(row["name"]), np.array(rings))


def sail_mesh(name: str, table: pd.DataFrame, hull: Hull, levels: int) -> Mesh:
    """A sail from its offsets, closed on the deck below.

    Parameters
    ----------
    name : Of the part.
    table : Chord stations: wall half-breadth and top, shoulder, middle of the crown, crown.
    hull : Whose deck carries the sail.
    levels : Rings on the wall.
    """
    x, wall, top = (table[c].to_numpy(float) for c in ("x_m", "y_wall_m", "z_wall_top_m"))
    foot = hull.deck(x, wall)
    contours = [(wall, foot + share * (top - foot)) for share in np.linspace(0.0, 1.0, levels)]
    for part in ("shoulder", "mid"):
        contours.append((table[f"y_{part}_m"].to_numpy(float), table[f"z_{part}_m"].to_numpy(float)))
    contours.append((np.zeros_like(x), table["z_top_m"].to_numpy(float)))
    rings = []
    for y, z in contours:
        starboard, port = np.stack([x, y, z], axis=1), np.stack([x, -y, z], axis=1)
        rings.append(np.concatenate([starboard, port[:0:-1]]))
    return _loft(name, np.array(rings))


def _coarser(part: HullPart | SailPart | FoilParts, factor: float) -> HullPart | SailPart | FoilParts:
    """The same part with panels ``factor`` times as long, as far as its shape allows."""
    if isinstance(part, HullPart):
        around = max(8, 2 * round(part.around / factor / 2))
        return part.model_copy(update={"around": around, "step_m": part.step_m * factor})
    if isinstance(part, SailPart):
        return part.model_copy(update={"levels": max(2, round(part.levels / factor))})
    chord, span = max(4, round(part.along_chord / factor)), max(1, round(part.along_span / factor))
    return part.model_copy(update={"along_chord": chord, "along_span": span})


def read_geometry(path: str | Path, coarser: float = 1.0) -> Mesh:
    """The closed, outward-facing surface that a geometry file describes.

    Parameters
    ----------
    path : The geometry file; its tables lie beside it.
    coarser : Factor on the panel sizes the file asks for; panel methods need fewer panels.

    Returns
    -------
    Mesh in the program frame (x forward, y starboard, z down) about the body origin [m].

    Raises
    ------
    InputError
        For a missing file, key or column, a bad number, or a surface that does not close.
    """
    data, where = read_toml(Path(path), "vehicles")
    geometry = checked(Geometry, data, where)
    frame = geometry.frame.declared(f"{where}, key frame")
    folder = Path(where).parent
    hulls: dict[str, Hull] = {}
    parts: list[Mesh] = []
    for part in (_coarser(p, coarser) if coarser != 1.0 else p for p in geometry.parts):
        offsets = folder / part.offsets
        if isinstance(part, HullPart):
            hulls[part.name] = Hull(offsets)
            parts.append(hull_mesh(part.name, hulls[part.name], part.around, part.step_m))
        elif isinstance(part, SailPart):
            if part.on not in hulls:
                raise InputError(f"{where}, part {part.name}, key on", part.on, f"one of {', '.join(hulls)} above it")
            parts.append(sail_mesh(part.name, _table(offsets, _SAIL_COLUMNS), hulls[part.on], part.levels))
        else:
            table = _table(offsets, ["name", *_FOIL_COLUMNS])
            parts += [foil_mesh(row, part.along_chord, part.along_span) for _, row in table.iterrows()]
    try:
        mesh = joined(parts).check(where)
    except MeshError as error:
        raise InputError(where, str(error), "a closed surface with outward normals") from error
    return mesh.moved(geometry.origin.value, [frame.signs[a] for a in "xyz"])
