"""Carry-over: what a deflected plane loads beside itself, from the planes' geometry.

A captive campaign that keeps loads by part measures a moving plane alone. Its deflection also
loads its fixed root, the hull and the other fins. A vortex lattice (Katz and Plotkin,
Low-Speed Aerodynamics, ch. 12) of the fins, with the hull as a circular cylinder by image
vortices (Milne-Thomson's circle theorem), gives the ratio; it generalises the factors
K_W(B) and K_B(W) of Pitts, Nielsen and Kaattari (1957), NACA Report 1307, to a plane outboard
of a fixed root. Planes on the wall of a sail are mirrored in it; what they load on the hull below is that of their
images in it.

By the reverse-flow theorem the moving plane's own load from hull incidence is the same
ratio above that from its own deflection, so the factor belongs to both.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.files.toml_files import read_toml
from sim.hull.lattice import FINE, Fin, in_cylinder, in_wall, influence, lattice, normal_load
from sim.hull.surface import Geometry, Hull, hull_of

Array = NDArray[np.float64]
ByPlane: TypeAlias = dict[str, dict[str, float]]

# A coarser lattice, for the discretisation error.
_COARSE = (4, 7, 4)


@dataclass(frozen=True)
class FinShape:
    """Form of a plane with its root: aspect ratio with the wall as a mirror, and tip over root chord."""

    aspect: float
    taper: float


@dataclass(frozen=True)
class CarryOver:
    """Ratios of everything a deflected plane loads to its own load, with standard deviations.

    Attributes
    ----------
    force_factor, force_sigma : Along the plane's normal: stern planes.
    roll_factor, roll_sigma : Roll moment about the hull's axis.
    incidence_factor : Load of the moving plane by hull incidence on that by its deflection.
    sail_factor, sail_sigma : Lift of the sail planes with their fixed roots.
    below, below_sigma : Load on the hull below the sail planes; against their lift, so below zero.
    sail_tip : Distance of the sail planes' tips from the centre plane [m].
    lift_slope : Of the moving stern plane on its own area, by the lattice [1/rad].
    area : Of a moving stern plane [m^2].
    parts : Shares of root, hull and other fins in ``force_factor``.
    radii : Distance from the hull's axis of plane, root, hull and other fins [m].
    stern_fin, sail_fin : Form of a plane with its root.
    method : One line.
    """

    force_factor: float
    force_sigma: float
    roll_factor: float
    roll_sigma: float
    incidence_factor: float
    sail_factor: float
    sail_sigma: float
    below: float
    below_sigma: float
    sail_tip: float
    lift_slope: float
    area: float
    parts: dict[str, float]
    radii: dict[str, float]
    stern_fin: FinShape
    sail_fin: FinShape
    method: str


def stern_factors(fins: list[Fin], radius: float, counts: tuple[int, int, int] = FINE) -> dict[str, float]:
    """Ratios of a deflected stern plane on a cylindrical hull.

    Parameters
    ----------
    fins : All fins; the first is deflected.
    radius : Of the hull [m].
    counts : Panels, see ``lattice``.

    Returns
    -------
    ``plane`` (load on it over density, speed^2 and angle [m^2]), and over that: ``root``, ``hull``,
    ``others``, ``force`` (their sum with the plane), ``roll`` (of all fins), and ``incidence``.
    """
    grid = lattice(fins, counts)
    # A vortex and its image turn opposite ways.
    image_a, image_b = in_cylinder(grid.b, radius), in_cylinder(grid.a, radius)
    matrix = influence(grid, image_a, image_b)
    plane = (grid.fin == 0) & grid.moving
    circulation = np.linalg.solve(matrix, np.where(plane, -1.0, 0.0))
    normal = grid.normal[0]
    loads = normal_load(circulation, grid.a, grid.b, normal)
    hull = float(normal_load(circulation, image_a, image_b, normal).sum())
    on_plane = float(loads[plane].sum())
    middle = np.linalg.norm(0.5 * (grid.a + grid.b)[:, 1:], axis=1)
    turning = circulation * np.linalg.norm((grid.b - grid.a)[:, 1:], axis=1) * middle
    # Cross-flow along the deflected plane's normal, with the cylinder's own disturbance.
    r2 = np.sum(grid.control[:, 1:] ** 2, axis=1, keepdims=True)
    d = grid.control[:, 1:] @ normal[1:]
    cross = normal[1:] - radius**2 / r2 * (2.0 * d[:, None] * grid.control[:, 1:] / r2 - normal[1:])
    wash = np.sum(cross * grid.normal[:, 1:], axis=1)
    in_flow = normal_load(np.linalg.solve(matrix, -wash), grid.a, grid.b, normal)
    root = float(loads[(grid.fin == 0) & ~grid.moving].sum())
    others = float(loads[grid.fin != 0].sum())
    return {
        "plane": abs(on_plane),
        "root": root / on_plane,
        "hull": hull / on_plane,
        "others": others / on_plane,
        "force": 1.0 + (root + hull + others) / on_plane,
        "roll": float(turning.sum() / turning[plane].sum()),
        "incidence": float(in_flow[plane].sum() / on_plane),
    }


def wall_factor(fin: Fin, wall: float, counts: tuple[int, int, int] = FINE) -> float:
    """Lift of a deflected plane and its fixed root on the plane's own, on a flat wall at y = wall [m]."""
    grid = lattice([fin], counts)
    matrix = influence(grid, in_wall(grid.b, wall), in_wall(grid.a, wall))
    circulation = np.linalg.solve(matrix, np.where(grid.moving, -1.0, 0.0))
    loads = normal_load(circulation, grid.a, grid.b, grid.normal[0])
    return float(loads.sum() / loads[grid.moving].sum())


def hull_below(fin: Fin, wall: float, height: float, radius: float, counts: tuple[int, int, int] = FINE) -> float:
    """Load on the hull below a deflected plane that stands off its centre plane, on the plane's own.

    The images of the plane's vortices in the hull carry it (Milne-Thomson's circle theorem), as those of stern planes
    do; above the hull an image is wider outboard than inboard, so that its load is against the plane's. A vortex from
    y1 to y2 gives -a^2 (y2 / r2^2 - y1 / r1^2) / (y2 - y1). By the reverse-flow theorem it is what the hull's
    flow takes off the plane's load by incidence.

    Parameters
    ----------
    fin, wall : As of ``wall_factor``; the spans are distances from the boat's centre plane [m].
    height : Of the plane over the hull's axis [m].
    radius : Of the hull [m].
    counts : Panels, see ``lattice``.
    """
    grid = lattice([fin], counts)
    matrix = influence(grid, in_wall(grid.b, wall), in_wall(grid.a, wall))
    circulation = np.linalg.solve(matrix, np.where(grid.moving, -1.0, 0.0))
    own = normal_load(circulation, grid.a, grid.b, grid.normal[0])[grid.moving].sum()
    above = np.array([0.0, 0.0, height])
    image_a, image_b = in_cylinder(grid.b + above, radius), in_cylinder(grid.a + above, radius)
    return float(normal_load(circulation, image_a, image_b, grid.normal[0]).sum() / own)


def foils_of(vehicle: Vehicle, path: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Foils of the vehicle's stern planes and of those further forward, by the plane each belongs to.

    Parameters
    ----------
    vehicle : Whose planes.
    path : Table of foils of its geometry.

    Raises
    ------
    InputError
        For a table that does not say which foil is which plane's, or names a plane that the vehicle lacks.
    """
    foils = pd.read_csv(path)
    if not {"plane", "fixed"} <= set(foils):
        raise InputError(
            str(path), "no columns plane and fixed", "the vehicle's plane of each foil; 1 for a fixed root"
        )
    names = {p.name for p in vehicle.planes}
    for row, plane in enumerate(foils["plane"]):
        if plane not in names and not pd.isna(plane):
            raise InputError(f"{path}, row {row + 2}, column plane", repr(plane), ", ".join(sorted(names)))
    stern, forward = ([p.name for p in planes] for planes in (vehicle.stern_planes, vehicle.forward_planes))
    return foils[foils["plane"].isin(stern)], foils[foils["plane"].isin(forward)]


def _parts(vehicle: Vehicle) -> tuple[pd.DataFrame, pd.DataFrame, Hull, pd.DataFrame]:
    """Foils of stern and forward planes, hull, and offsets of the sail of a vehicle's geometry file."""
    if vehicle.geometry is None:
        raise InputError(f"vehicle {vehicle.name}", "no geometry file", "key geometry, with hull, sail and foils")
    data, where = read_toml(vehicle.geometry, "vehicles")
    parts = {p.kind: p for p in reversed(Geometry.model_validate(data).parts)}
    if not {"hull", "sail", "foils"} <= set(parts):
        raise InputError(where, f"parts {', '.join(sorted(parts))}", "hull, sail and foils")
    folder = Path(where).parent
    stern, forward = foils_of(vehicle, folder / parts["foils"].offsets)
    return stern, forward, hull_of(folder / parts["hull"].offsets), pd.read_csv(folder / parts["sail"].offsets)


def _by_plane(foils: pd.DataFrame) -> ByPlane:
    """Plane -> numbers of its foil."""
    rows = foils.set_index("plane").drop(columns=["name", "fixed"])
    return {str(plane): {str(c): float(x) for c, x in row.items()} for plane, row in rows.iterrows()}


def _stern_fins(roots: ByPlane, moving: ByPlane, gap: float, radius: float) -> list[Fin]:
    """The stern fins with the gap between its leading- (0) and trailing-edge (1) place."""
    fins = []
    for name, plane in moving.items():
        root = roots[name]
        cut = plane["LE_root_s_m"] + gap * (plane["TE_root_s_m"] - plane["LE_root_s_m"])
        tip = 0.5 * (plane["LE_tip_s_m"] + plane["TE_tip_s_m"])
        chords = (
            (radius, root["LE_root_x_m"], root["TE_root_x_m"]),
            (cut, root["LE_tip_x_m"], root["TE_tip_x_m"]),
            (tip, plane["LE_tip_x_m"], plane["TE_tip_x_m"]),
        )
        fins.append(Fin(chords, float(np.arctan2(plane["span_z"], plane["span_y"]))))
    return fins


def _sail_fin(plane: pd.Series, wall: float) -> Fin:
    inner = (plane["LE_root_x_m"], plane["TE_root_x_m"])
    outer = (plane["LE_tip_s_m"], plane["LE_tip_x_m"], plane["TE_tip_x_m"])
    return Fin(((wall, *inner), (plane["LE_root_s_m"], *inner), outer), 0.0)


def _on_the_sail(forward: pd.DataFrame, sail: pd.DataFrame) -> pd.DataFrame:
    """Those of the moving foils whose chord at the root lies on the sail."""
    begins, ends = sail["x_m"].min(), sail["x_m"].max()
    return forward[(forward["fixed"] == 0) & (forward["LE_root_x_m"] >= begins) & (forward["TE_root_x_m"] <= ends)]


def carry_over(vehicle: Vehicle) -> CarryOver:
    """Carry-over of a vehicle's stern and sail planes.

    The standard deviations come from what the geometry leaves open: the hull's radius between its
    values at the leading and the trailing edge of the fins, the place of the slanted gap between
    its ends, the sail's wall between its least and largest breadth at the planes, and
    the lattice.

    Raises
    ------
    InputError
        When the vehicle has no geometry with hull, sail, stern and sail planes.
    """
    foils, forward, hull, sail = _parts(vehicle)
    roots, moving = foils[foils["fixed"] == 1], foils[foils["fixed"] == 0]
    on_sail = _on_the_sail(forward, sail)
    names = [sorted(one["plane"]) for one in (moving, roots)]
    if on_sail.empty or not names[0] or names[0] != names[1] or len(set(names[0])) < len(names[0]):
        where = f"vehicle {vehicle.name}, foils of its geometry"
        seen = f"moving {names[0]}, fixed {names[1]} at the stern"
        raise InputError(where, seen, "planes on the sail; at the stern one moving foil and one fixed root a plane")
    edges = np.array([roots["LE_root_x_m"].mean(), roots["TE_root_x_m"].mean()])
    radii = [float(np.ravel(hull.radius(edges[i : i + 1], np.array([np.pi / 4.0])))[0]) for i in (0, 1)]
    middle = float(np.mean(radii))
    fins = partial(_stern_fins, _by_plane(roots), _by_plane(moving))
    factors = [
        stern_factors(fins(g, a), a) for g, a in ((0.5, radii[0]), (0.5, radii[1]), (0.0, middle), (1.0, middle))
    ]
    first = fins(0.5, middle)[0]
    best, coarse = (stern_factors(fins(0.5, middle), middle, counts) for counts in (FINE, _COARSE))

    def sigma(key: str) -> float:
        # Each pair spans what is possible: a quarter of it is one standard deviation.
        halves = [0.25 * abs(factors[i][key] - factors[i + 1][key]) for i in (0, 2)]
        return float(np.sqrt(halves[0] ** 2 + halves[1] ** 2 + (best[key] - coarse[key]) ** 2))

    plane = on_sail.iloc[0]
    chord = np.linspace(plane["LE_root_x_m"], plane["TE_root_x_m"], 9)
    walls = np.interp(chord, sail["x_m"], sail["y_wall_m"])
    wall = float(walls.mean())
    by_wall = [wall_factor(_sail_fin(plane, w), w) for w in (float(walls.min()), float(walls.max()))]
    below, below_sigma = _below(_sail_fin(plane, wall), wall, float(plane["base_z_m"]), hull)
    return CarryOver(
        force_factor=best["force"],
        force_sigma=sigma("force"),
        roll_factor=best["roll"],
        roll_sigma=sigma("roll"),
        incidence_factor=best["incidence"],
        sail_factor=wall_factor(_sail_fin(plane, wall), wall),
        sail_sigma=0.25 * abs(by_wall[0] - by_wall[1]),
        below=below,
        below_sigma=below_sigma,
        sail_tip=float((0.5 * (on_sail["LE_tip_s_m"] + on_sail["TE_tip_s_m"])).mean()),
        lift_slope=2.0 * best["plane"] / _area(first),
        area=_area(first),
        parts={k: best[k] for k in ("root", "hull", "others")},
        radii=_radii(first, middle),
        stern_fin=_shape(first),
        sail_fin=_shape(_sail_fin(plane, wall)),
        method="vortex lattice of the fins with the hull as a cylinder by images (after NACA Report 1307)",
    )


def _below(fin: Fin, wall: float, height: float, hull: Hull) -> tuple[float, float]:
    """Load on the hull below the sail planes, and its deviation: a section between its half breadth and its deck."""
    station = np.array([0.5 * (fin.chords[1][1] + fin.chords[1][2])])
    around = np.ravel(hull.radius(station, np.radians(np.arange(0.0, 181.0, 15.0))))
    sides = [hull_below(fin, wall, height, float(r)) for r in (around[len(around) // 2], around[0])]
    return hull_below(fin, wall, height, float(around.mean())), 0.25 * abs(sides[0] - sides[1])


def _area(fin: Fin, first: int = 1) -> float:
    """Planform area of the moving plane, or of what begins at another of the chords [m^2]."""
    return sum(
        0.5 * (trail0 - lead0 + trail1 - lead1) * (s1 - s0)
        for (s0, lead0, trail0), (s1, lead1, trail1) in itertools.pairwise(fin.chords[first:])
    )


def _shape(fin: Fin) -> FinShape:
    """Aspect ratio with the mirror image of the whole fin, and taper."""
    (s0, lead0, trail0), (s1, lead1, trail1) = fin.chords[0], fin.chords[-1]
    return FinShape(2.0 * (s1 - s0) ** 2 / _area(fin, 0), (trail1 - lead1) / (trail0 - lead0))


def _radii(fin: Fin, hull: float) -> dict[str, float]:
    """Middle of plane and root, and the hull's surface, from the axis [m]; other fins are as the plane."""
    root, gap, tip = (chord[0] for chord in fin.chords)
    outer = 0.5 * (gap + tip)
    return {"plane": outer, "root": 0.5 * (root + gap), "hull": hull, "others": outer}
