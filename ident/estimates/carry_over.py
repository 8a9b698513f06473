"""Carry-over: what a deflected plane loads beside itself, from the planes' geometry.

A captive campaign that keeps loads by part measures a moving plane alone. Its deflection also
loads its fixed root, the hull and the other fins. A vortex lattice (Katz and Plotkin,
Low-Speed Aerodynamics, ch. 12) of the fins, with the hull as a circular cylinder by image
vortices (Milne-Thomson's circle theorem), gives the ratio; it generalises the factors
K_W(B) and K_B(W) of Pitts, Nielsen and Kaattari (1957), NACA Report 1307, to a plane outboard
of a fixed root. Planes on the wall of a sail are mirrored in it.

By the reverse-flow theorem the moving plane's own load from hull incidence is the same
ratio above that from its own deflection, so the factor belongs to both.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sim.boat.vehicle import Vehicle, read_toml
from sim.files.errors import InputError
from sim.hull.surface import Geometry, Hull

Array = NDArray[np.float64]

# Lattice: panels along span (root, plane) and chord, and a coarser one for the discretisation error.
_FINE, _COARSE = (6, 10, 6), (4, 7, 4)
# Trailing vortices end so far downstream [m]; further makes no difference.
_FAR = np.array([1e4, 0.0, 0.0])


@dataclass(frozen=True)
class Fin:
    """One fin: corner chords of its fixed root and moving plane, along x (aft) and span s [m].

    ``chords`` holds (s, leading edge x, trailing edge x) at the inner edge of the root, at the
    gap, and at the tip; ``angle`` is the direction of the span axis about x [rad].
    """

    chords: tuple[tuple[float, float, float], ...]
    angle: float


@dataclass(frozen=True)
class Lattice:
    """Horseshoe vortices and control points.

    Attributes
    ----------
    a, b : (n, 3) ends of the bound vortices [m].
    control, normal : (n, 3).
    fin, moving : (n,) number of the fin, and whether the panel is on its moving plane.
    """

    a: Array
    b: Array
    control: Array
    normal: Array
    fin: NDArray[np.int64]
    moving: NDArray[np.bool_]


@dataclass(frozen=True)
class CarryOver:
    """Ratios of everything a deflected plane loads to its own load, with standard deviations.

    Attributes
    ----------
    force_factor, force_sigma : Along the plane's normal: stern planes.
    roll_factor, roll_sigma : Roll moment about the hull's axis.
    incidence_factor : Load of the moving plane by hull incidence on that by its deflection.
    sail_factor, sail_sigma : Lift of the sail planes with their fixed roots.
    lift_slope : Of the moving stern plane on its own area, by the lattice [1/rad].
    area : Of a moving stern plane [m^2].
    parts : Shares of root, hull and other fins in ``force_factor``.
    method : One line.
    """

    force_factor: float
    force_sigma: float
    roll_factor: float
    roll_sigma: float
    incidence_factor: float
    sail_factor: float
    sail_sigma: float
    lift_slope: float
    area: float
    parts: dict[str, float]
    method: str


def _fin_panels(fin: Fin, counts: tuple[int, int, int]) -> tuple[list[Array], list[bool]]:
    """Corner rows (a, b, control, normal) of a fin's panels, and whether they move."""
    span = np.array([0.0, np.cos(fin.angle), np.sin(fin.angle)])
    normal = np.array([0.0, -np.sin(fin.angle), np.cos(fin.angle)])
    rows, moving = [], []
    for part in (0, 1):
        (s0, lead0, trail0), (s1, lead1, trail1) = fin.chords[part], fin.chords[part + 1]
        edges = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, counts[part] + 1)))

        def point(
            t: float, c: float, s: tuple[float, float] = (s0, s1), e: tuple[float, ...] = (lead0, lead1, trail0, trail1)
        ) -> Array:
            lead, trail = e[0] + (e[1] - e[0]) * t, e[2] + (e[3] - e[2]) * t
            along = np.array([lead + (trail - lead) * c, 0.0, 0.0])
            return np.asarray(along + (s[0] + (s[1] - s[0]) * t) * span)

        for t0, t1 in itertools.pairwise(edges):
            for j in range(counts[2]):
                # Bound vortex at a quarter, control point at three quarters of the panel.
                bound, check = (j + 0.25) / counts[2], (j + 0.75) / counts[2]
                rows.append(np.stack([point(t0, bound), point(t1, bound), point(0.5 * (t0 + t1), check), normal]))
                moving.append(part == 1)
    return rows, moving


def lattice(fins: list[Fin], counts: tuple[int, int, int] = _FINE) -> Lattice:
    """Vortex lattice of fins.

    Parameters
    ----------
    fins : The fins.
    counts : Panels along the span of root and plane, and along the chord.
    """
    rows, moving, owner = [], [], []
    for i, fin in enumerate(fins):
        own, own_moving = _fin_panels(fin, counts)
        rows += own
        moving += own_moving
        owner += [i] * len(own)
    corners = np.stack(rows)
    return Lattice(
        corners[:, 0], corners[:, 1], corners[:, 2], corners[:, 3], np.array(owner), np.array(moving, dtype=bool)
    )


def _segment(p: Array, a: Array, b: Array) -> Array:
    """Velocity at points p (n, 1, 3) of unit straight vortices from a to b (m, 3), Biot and Savart."""
    # By components: products of short vectors cost more than the numbers in them.
    r1, r2 = ([p[..., i] - end[:, i] for i in range(3)] for end in (a, b))
    n1, n2 = (np.sqrt(r[0] ** 2 + r[1] ** 2 + r[2] ** 2) for r in (r1, r2))
    cross = [r1[i] * r2[j] - r1[j] * r2[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    square = cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2
    side = [(b[:, i] - a[:, i]) * (r1[i] / n1 - r2[i] / n2) for i in range(3)]
    # On the vortex's own line the velocity is zero.
    along = np.divide(
        side[0] + side[1] + side[2], 4.0 * np.pi * square, out=np.zeros_like(square), where=square > 1e-12
    )
    return np.stack([one * along for one in cross], axis=-1)


def horseshoes(p: Array, a: Array, b: Array) -> Array:
    """Velocity at points p (n, 3) of unit horseshoe vortices with bound part a to b (m, 3).

    Returns
    -------
    (n, m, 3) [1/m]; the trailing vortices go aft (+x).
    """
    at = p[:, None, :]
    return _segment(at, a + _FAR, a) + _segment(at, a, b) + _segment(at, b, b + _FAR)


def in_cylinder(p: Array, radius: float) -> Array:
    """Image points in a circular cylinder about the x axis: same angle, radius^2 / r."""
    r2 = p[:, 1] ** 2 + p[:, 2] ** 2
    return np.asarray(p * np.stack([np.ones_like(r2), radius**2 / r2, radius**2 / r2], axis=1))


def in_wall(p: Array, wall: float) -> Array:
    """Image points in the plane y = wall."""
    out = p.copy()
    out[:, 1] = 2.0 * wall - out[:, 1]
    return out


def influence(grid: Lattice, image_a: Array, image_b: Array) -> Array:
    """(n, n) normal velocity at the control points of unit vortices with their images."""
    both = horseshoes(grid.control, grid.a, grid.b) + horseshoes(grid.control, image_a, image_b)
    return np.asarray(np.einsum("nmi,ni->nm", both, grid.normal))


def _normal_load(circulation: NDArray[Any], a: Array, b: Array, direction: Array) -> Array:
    """Load along ``direction`` of each bound vortex, over density and speed (Kutta, Joukowsky)."""
    return np.asarray(circulation * (np.cross(np.array([1.0, 0.0, 0.0]), b - a) @ direction))


def stern_factors(fins: list[Fin], radius: float, counts: tuple[int, int, int] = _FINE) -> dict[str, float]:
    """Ratios of a deflected stern plane on a cylindrical hull.

    Parameters
    ----------
    fins : All fins; the first is deflected.
    radius : Of the hull [m].
    counts : Panels, see ``lattice``.

    Returns
    -------
    ``own`` (load over density, speed^2 and angle [m^2]), and on it: ``root``, ``hull``,
    ``others``, ``force`` (their sum with the plane), ``roll`` (of all fins), and ``incidence``.
    """
    grid = lattice(fins, counts)
    # A vortex and its image turn opposite ways.
    image_a, image_b = in_cylinder(grid.b, radius), in_cylinder(grid.a, radius)
    matrix = influence(grid, image_a, image_b)
    plane = (grid.fin == 0) & grid.moving
    circulation = np.linalg.solve(matrix, np.where(plane, -1.0, 0.0))
    normal = grid.normal[0]
    loads = _normal_load(circulation, grid.a, grid.b, normal)
    hull = float(_normal_load(circulation, image_a, image_b, normal).sum())
    own = float(loads[plane].sum())
    middle = np.linalg.norm(0.5 * (grid.a + grid.b)[:, 1:], axis=1)
    turning = circulation * np.linalg.norm((grid.b - grid.a)[:, 1:], axis=1) * middle
    # Cross-flow along the deflected plane's normal, with the cylinder's own disturbance.
    r2 = np.sum(grid.control[:, 1:] ** 2, axis=1, keepdims=True)
    d = grid.control[:, 1:] @ normal[1:]
    cross = normal[1:] - radius**2 / r2 * (2.0 * d[:, None] * grid.control[:, 1:] / r2 - normal[1:])
    wash = np.sum(cross * grid.normal[:, 1:], axis=1)
    in_flow = _normal_load(np.linalg.solve(matrix, -wash), grid.a, grid.b, normal)
    root = float(loads[(grid.fin == 0) & ~grid.moving].sum())
    others = float(loads[grid.fin != 0].sum())
    return {
        "own": abs(own),
        "root": root / own,
        "hull": hull / own,
        "others": others / own,
        "force": 1.0 + (root + hull + others) / own,
        "roll": float(turning.sum() / turning[plane].sum()),
        "incidence": float(in_flow[plane].sum() / own),
    }


def wall_factor(fin: Fin, wall: float, counts: tuple[int, int, int] = _FINE) -> float:
    """Lift of a deflected plane and its fixed root on the plane's own, on a flat wall at y = wall [m]."""
    grid = lattice([fin], counts)
    matrix = influence(grid, in_wall(grid.b, wall), in_wall(grid.a, wall))
    circulation = np.linalg.solve(matrix, np.where(grid.moving, -1.0, 0.0))
    loads = _normal_load(circulation, grid.a, grid.b, grid.normal[0])
    return float(loads.sum() / loads[grid.moving].sum())


def _parts(vehicle: Vehicle) -> tuple[pd.DataFrame, Hull, pd.DataFrame]:
    """Foils, hull and offsets of the sail of a vehicle's geometry file."""
    if vehicle.geometry is None:
        raise InputError(f"vehicle {vehicle.name}", "no geometry file", "key geometry, with hull, sail and foils")
    data, where = read_toml(vehicle.geometry, "vehicles")
    parts = {p.kind: p for p in reversed(Geometry.model_validate(data).parts)}
    if not {"hull", "sail", "foils"} <= set(parts):
        raise InputError(where, f"parts {', '.join(sorted(parts))}", "hull, sail and foils")
    folder = Path(where).parent
    foils = pd.read_csv(folder / parts["foils"].offsets).set_index("name")
    return foils, Hull(folder / parts["hull"].offsets), pd.read_csv(folder / parts["sail"].offsets)


def _stern_fins(foils: pd.DataFrame, gap: float, radius: float) -> list[Fin]:
    """The stern fins with the gap between its leading- (0) and trailing-edge (1) place."""
    rows = {str(k): {str(c): float(x) for c, x in row.items()} for k, row in foils.iterrows()}
    fins = []
    for name, plane in rows.items():
        if not name.startswith("stern_plane"):
            continue
        root = rows[name.replace("stern_plane", "stern_root")]
        cut = plane["LE_root_s_m"] + gap * (plane["TE_root_s_m"] - plane["LE_root_s_m"])
        tip = 0.5 * (plane["LE_tip_s_m"] + plane["TE_tip_s_m"])
        chords = (
            (radius, root["LE_root_x_m"], root["TE_root_x_m"]),
            (cut, root["LE_tip_x_m"], root["TE_tip_x_m"]),
            (tip, plane["LE_tip_x_m"], plane["TE_tip_x_m"]),
        )
        fins.append(Fin(chords, float(np.arctan2(plane["span_z"], plane["span_y"]))))
    return fins


def _sail_fin(foils: pd.DataFrame, wall: float) -> Fin:
    plane = {str(k): float(x) for k, x in foils[foils.index.str.startswith("sail_plane")].iloc[0].items()}
    inner = (plane["LE_root_x_m"], plane["TE_root_x_m"])
    outer = (plane["LE_tip_s_m"], plane["LE_tip_x_m"], plane["TE_tip_x_m"])
    return Fin(((wall, *inner), (plane["LE_root_s_m"], *inner), outer), 0.0)


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
    foils, hull, sail = _parts(vehicle)
    roots = foils[foils.index.str.startswith("stern_root")]
    if roots.empty or not foils.index.str.startswith("sail_plane").any():
        raise InputError(f"vehicle {vehicle.name}", "no stern or sail planes among the foils", "both")
    edges = np.array([roots["LE_root_x_m"].mean(), roots["TE_root_x_m"].mean()])
    radii = [float(np.ravel(hull.radius(edges[i : i + 1], np.array([np.pi / 4.0])))[0]) for i in (0, 1)]
    middle = float(np.mean(radii))
    found = [stern_factors(_stern_fins(foils, g, a), a) for g, a in ((0.5, r) for r in radii)]
    found += [stern_factors(_stern_fins(foils, g, middle), middle) for g in (0.0, 1.0)]
    best = stern_factors(_stern_fins(foils, 0.5, middle), middle)
    coarse = stern_factors(_stern_fins(foils, 0.5, middle), middle, _COARSE)

    def sigma(key: str) -> float:
        # Each pair spans what is possible: a quarter of it is one standard deviation.
        halves = [0.25 * abs(found[i][key] - found[i + 1][key]) for i in (0, 2)]
        return float(np.sqrt(halves[0] ** 2 + halves[1] ** 2 + (best[key] - coarse[key]) ** 2))

    plane = foils[foils.index.str.startswith("sail_plane")].iloc[0]
    chord = np.linspace(plane["LE_root_x_m"], plane["TE_root_x_m"], 9)
    walls = np.interp(chord, sail["x_m"], sail["y_wall_m"])
    wall = float(walls.mean())
    on_sail = [wall_factor(_sail_fin(foils, w), w) for w in (float(walls.min()), float(walls.max()))]
    return CarryOver(
        force_factor=best["force"],
        force_sigma=sigma("force"),
        roll_factor=best["roll"],
        roll_sigma=sigma("roll"),
        incidence_factor=best["incidence"],
        sail_factor=wall_factor(_sail_fin(foils, wall), wall),
        sail_sigma=0.25 * abs(on_sail[0] - on_sail[1]),
        lift_slope=2.0 * best["own"] / _area(_stern_fins(foils, 0.5, middle)[0]),
        area=_area(_stern_fins(foils, 0.5, middle)[0]),
        parts={k: best[k] for k in ("root", "hull", "others")},
        method="vortex lattice of the fins with the hull as a cylinder by images (after NACA Report 1307)",
    )


def _area(fin: Fin) -> float:
    """Planform area of the moving plane [m^2]."""
    (s0, lead0, trail0), (s1, lead1, trail1) = fin.chords[1:]
    return 0.5 * (trail0 - lead0 + trail1 - lead1) * (s1 - s0)
