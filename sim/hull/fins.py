"""Fins and sail on a hull, from their lines: loads by drift and rotation.

A vortex lattice of the fins with the hull as a cylinder by images (``lattice``; Pitts, Nielsen and Kaattari 1957, NACA
Report 1307) gives what they carry in the flow of an ideal fluid, which the hull has sped up around itself and which
loads the hull beside them. On a stern the flow along the hull is slow and parts, so that neither need be there: a fin
in the undisturbed flow on a wall is the other limit. The value is the middle, the deviation that of a uniform
distribution.

A sail stands on the parallel body, where the ideal fluid is near. Its vortices trail along the hull; where the hull
ends, the vorticity inside it has to leave, and loads the stern on the same side. How much of it does is not known:
between nothing and what slender-body theory gives, again the middle with a uniform deviation.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sim.files.constants import constant
from sim.hull.integral import trapezoid
from sim.hull.lattice import Fin, in_cylinder, influence, lattice, normal_load
from sim.hull.slender import Lines
from sim.hull.surface import Geometry

Array = NDArray[np.float64]

_COUNTS = (4, 6, 4)
# Lift of a real surface on that of a lattice, and its deviation: the boundary layer takes some per cent.
_VISCOUS, _LATTICE = constant("lift_on_lattice"), constant("lift_on_lattice_range")
# Place of a rolled-up tip vortex over the span: elliptic loading.
_ROLLED_UP = np.pi / 4.0
_UNIFORM = 1.0 / np.sqrt(12.0)
ACROSS = {"horizontal": np.array([0.0, 1.0, 0.0]), "vertical": np.array([0.0, 0.0, 1.0])}


@dataclass(frozen=True)
class Part:
    """What fins carry, over 1/2 rho U: value and deviations with the meaning of each.

    Attributes
    ----------
    value : (5,) force by cross-flow [m^2], moment by cross-flow, force by rotation [m^3], moment by rotation [m^4],
        roll moment by cross-flow [m^3].
    errors : Meaning -> (5,) change by one standard deviation.
    """

    value: Array
    errors: dict[str, Array]


def fins_of(geometry: Geometry, folder: Path, hull: Lines, station: float) -> tuple[list[Fin], float]:
    """Fins of a geometry file that stand at the stern, joined over their gaps, and the hull's radius there [m].

    Parameters
    ----------
    geometry, folder : Geometry file.
    hull : For the radius at the fins.
    station : Fins before it are left out [m, along the file's x axis from the nose aft].
    """
    rows = []
    for part in geometry.parts:
        if part.kind == "foils":
            table = pd.read_csv(folder / part.offsets)
            rows += [r for _, r in table.iterrows() if 0.5 * (r["LE_root_x_m"] + r["TE_tip_x_m"]) > station]
    ends: dict[float, list[tuple[float, float, float]]] = {}
    for r in rows:
        angle = round(float(np.arctan2(r["span_z"], r["span_y"])), 4)
        inner = 0.5 * (r["LE_root_s_m"] + r["TE_root_s_m"])
        outer = 0.5 * (r["LE_tip_s_m"] + r["TE_tip_s_m"])
        ends.setdefault(angle, []).extend(
            [(inner, r["LE_root_x_m"], r["TE_root_x_m"]), (outer, r["LE_tip_x_m"], r["TE_tip_x_m"])]
        )
    if not ends:
        return [], 0.0
    middle = float(np.mean([0.5 * (lead + trail) for chords in ends.values() for _, lead, trail in chords]))
    forward = geometry.frame.frame.sign("x") * (middle - geometry.origin.value[0])
    radius = float(np.interp(forward, hull.x[::-1], hull.radius[::-1]))
    fins = []
    for angle, chords in ends.items():
        root, *_, tip = sorted(chords)
        # A fin cannot begin inside the hull, and its chords go on straight to it.
        start = max(radius, root[0])
        half = 0.5 * (start + tip[0])
        fins.append(Fin((_chord(root, tip, start), _chord(root, tip, half), tip), angle))
    return fins, radius


def _chord(root: tuple[float, ...], tip: tuple[float, ...], span: float) -> tuple[float, float, float]:
    share = (span - root[0]) / (tip[0] - root[0])
    return span, root[1] + share * (tip[1] - root[1]), root[2] + share * (tip[2] - root[2])


def sail_fin(geometry: Geometry, folder: Path, hull: Lines) -> tuple[Fin, float] | None:
    """The sail as a rectangular fin from the deck to its mean top, and the deck's height below it; None without one."""
    part = next((p for p in geometry.parts if p.kind == "sail"), None)
    if part is None:
        return None
    table = pd.read_csv(folder / part.offsets)
    lead, trail = float(table["x_m"].min()), float(table["x_m"].max())
    forward = geometry.frame.frame.sign("x") * (0.5 * (lead + trail) - geometry.origin.value[0])
    deck = float(np.interp(forward, hull.x[::-1], hull.deck[::-1]))
    top = float(trapezoid(table["z_top_m"], table["x_m"]) / (trail - lead))
    half = 0.5 * (deck + top)
    return Fin(((deck, lead, trail), (half, lead, trail), (top, lead, trail)), 0.5 * np.pi), deck


def loads(fins: list[Fin], radius: float, plane: str, origin: float, with_hull: bool) -> Array:
    """Loads of fins by cross-flow and rotation.

    Parameters
    ----------
    fins, radius : On a cylinder [m]; fins along x aft.
    plane : ``horizontal`` or ``vertical``.
    origin : Body origin along x aft [m].
    with_hull : With the flow around the hull and the load on it, or in the undisturbed flow.

    Returns
    -------
    (5,) as ``Part.value``, in the horizontal plane with its signs; no viscosity.
    """
    grid = lattice(fins, _COUNTS)
    image_a, image_b = in_cylinder(grid.b, radius), in_cylinder(grid.a, radius)
    matrix = influence(grid, image_a, image_b)
    across = ACROSS[plane]
    flow = np.tile(across, (len(grid.fin), 1))
    if with_hull:
        at = grid.control * np.array([0.0, 1.0, 1.0])
        r2 = np.sum(at**2, axis=1, keepdims=True)
        flow = flow - radius**2 / r2 * (2.0 * (at @ across)[:, None] * at / r2 - across)
    wash = np.sum(flow * grid.normal, axis=1)
    middle = 0.5 * (grid.a + grid.b)
    lever = origin - middle[:, 0]
    height = middle @ (np.array([0.0, 0.0, 1.0]) if plane == "horizontal" else np.array([0.0, -1.0, 0.0]))
    totals = []
    for speed in (np.ones(len(wash)), origin - grid.control[:, 0]):
        circulation = np.linalg.solve(matrix, -wash * speed)
        of_the_fin = normal_load(circulation, grid.a, grid.b, across)
        both = of_the_fin + (normal_load(circulation, image_a, image_b, across) if with_hull else 0.0)
        totals += [both.sum(), both @ lever]
        roll = of_the_fin @ height
        if len(totals) == 2:
            first_roll = roll
    # A load against the cross-flow.
    sign = -np.sign(totals[0]) if totals[0] else 1.0
    return 2.0 * sign * np.array([totals[0], totals[1], totals[2], totals[3], first_roll])


def stern_fins(fins: list[Fin], radius: float, plane: str, origin: float) -> Part:
    """Fins at the stern between both limits."""
    ideal, bare = (loads(fins, radius, plane, origin, hull) for hull in (True, False))
    middle = 0.5 * _VISCOUS * (ideal + bare)
    errors = {"flow about the stern": _VISCOUS * _UNIFORM * (ideal - bare), "lattice": _LATTICE / _VISCOUS * middle}
    return Part(middle, errors)


def sail(fin: Fin, hull: Lines, deck: float, origin: float) -> Part:
    """The sail, and what its vortices load where the hull ends behind it."""
    alone = _VISCOUS * loads([fin], deck, "horizontal", origin, True)
    height = deck + _ROLLED_UP * (fin.chords[2][0] - deck)
    # Impulse of a vortex and its image in the hull; without the hull it is that of the vortex alone.
    ratio = deck**2 / height / (height - deck**2 / height)
    behind = hull.x < origin - fin.chords[0][2]
    lost = np.gradient(hull.area[behind])
    at = float(lost @ hull.x[behind] / lost.sum())
    whole = ratio * alone[0] * np.array([1.0, at, alone[2] / alone[0], at * alone[2] / alone[0], 0.0])
    value = alone + 0.5 * whole
    return Part(
        value, {"sail's vortices at the stern": _UNIFORM * whole, "lattice of the sail": _LATTICE / _VISCOUS * alone}
    )
