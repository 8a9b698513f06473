"""The sail's tip vortex at the stern planes of a boat that drifts.

A sail in drift sheds a vortex near its tip that trails along the hull and passes the stern planes. What it loads on
hull and fixed roots is in the hull's runs in drift; what it loads on the moving planes is in no run, because
those are measured one by one, straight ahead. The circulation follows from the sail's side force by
Kutta and Joukowsky, the path from cross-flow planes about the hull's circular sections (Nielsen, Missile Aerodynamics,
1960, ch. 4; the image is that of Milne-Thomson's circle theorem), and the planes' load from their measured lift: by the
reverse-flow theorem a moving plane, its root and the hull weigh the flow as they share the load of a deflection.

The tables of drift know of no yaw. A boat that drifts in free flight turns: its sail meets less drift and its stern
more, so that the vortex is weaker and passes farther away, and how much of it the stern leaves is not known. So the
load is zero within half of what the whole vortex does in drift alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.estimates.carry_over import CarryOver
from ident.estimates.downwash import slopes
from ident.estimates.draft import Draft, NotApplicable
from ident.estimates.plane_loads import lift_slope, planes_of
from sim.boat.vehicle import Plane, Vehicle
from sim.files.errors import InputError
from sim.files.toml_files import read_toml
from sim.hull.surface import Geometry, hull_of

Array = NDArray[np.float64]

# Elliptic loading over the span above the deck: place of the rolled-up vortex, and centre of the load.
_ROLLED_UP, _CENTRE = np.pi / 4.0, 4.0 / (3.0 * np.pi)
# Steps of the path between the sail and the planes; twice as many change nothing in four digits.
_STEPS = 200
_LOADS = ("Y", "Z", "K", "M", "N")
# One standard deviation, of what the whole vortex does in drift alone.
_SHARE = 0.5


@dataclass(frozen=True)
class Sail:
    """Where a sail's vortex begins, and the hull behind it.

    Attributes
    ----------
    deck, top : Heights of the sail's foot and tip above the hull's axis [m].
    end : Trailing edge, aft of the file's origin [m].
    origin : Of the body, aft of the file's origin [m].
    radius : Stations aft of the file's origin -> mean radii of the hull [m].
    """

    deck: float
    top: float
    end: float
    origin: float
    radius: Callable[[Array], Array]


def vortex_path(
    start: complex,
    drift: Callable[[float], Array | float],
    circulation: Array | float,
    radius: Callable[[Array], Array],
    stations: Array,
) -> NDArray[np.complex128]:
    """Where vortices that leave at the first station are at the last, in the plane across the hull.

    d zeta / ds = cross-flow about the section + its growth or shrinking + the image, all over the speed ahead, by
    Runge and Kutta's fourth order.

    Parameters
    ----------
    start : y to starboard + i height above the axis [m].
    drift : Station -> sideways speed of the section over the speed ahead, (v + x r) / u; to starboard is positive.
        One number, or one a vortex.
    circulation : Of each vortex, each alone in its own flow; anticlockwise seen from astern, over the speed [m].
    radius : Stations -> radii of the hull [m].
    stations : (n,) increasing aft [m].

    Returns
    -------
    Places in the form of ``circulation``.

    Examples
    --------
    >>> import numpy as np
    >>> vortex_path(8j, lambda x: 0.1, 0.0, lambda x: 0.0 * x, np.linspace(0.0, 10.0, 11)).real.round(6)
    -1.0
    """
    near = 1e-3
    step = np.diff(stations)
    places = np.concatenate([stations, stations[:-1] + 0.5 * step])
    size, growth = radius(places), (radius(places + near) - radius(places - near)) / (2.0 * near)

    def velocity(k: int, zeta: NDArray[np.complex128]) -> NDArray[np.complex128]:
        a = size[k]
        cross = -drift(places[k]) * (1.0 - a**2 / zeta**2)
        turned = -circulation / (2j * np.pi * (zeta - a**2 / np.conj(zeta))) if a > 0.0 else 0.0
        return np.conj(cross + a * growth[k] / zeta + turned)

    zeta = np.full(np.shape(circulation), start, dtype=complex)
    for k, h in enumerate(step):
        between = len(stations) + k
        k1 = velocity(k, zeta)
        k2 = velocity(between, zeta + 0.5 * h * k1)
        k3 = velocity(between, zeta + 0.5 * h * k2)
        k4 = velocity(k + 1, zeta + h * k3)
        zeta = zeta + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return zeta


def vortex_flow(point: complex, vortex: NDArray[np.complex128] | complex, circulation: Array | float) -> Array:
    """(..., 3) flow of long vortices over the speed at a point across the hull, program frame."""
    velocity = np.conj(circulation / (2j * np.pi * (point - vortex)))
    return np.stack([np.zeros_like(velocity.real), velocity.real, -velocity.imag], axis=-1)


def sail_of(vehicle: Vehicle) -> Sail:
    """The sail of a vehicle's geometry file; raises ``InputError`` without one or without a hull."""
    if vehicle.geometry is None:
        raise InputError(f"vehicle {vehicle.name}", "no geometry file", "key geometry, with hull and sail")
    data, where = read_toml(vehicle.geometry, "vehicles")
    geometry = Geometry.model_validate(data)
    parts = {p.kind: p for p in reversed(geometry.parts)}
    if not {"hull", "sail"} <= set(parts):
        raise InputError(where, f"parts {', '.join(sorted(parts))}", "hull and sail")
    folder = Path(where).parent
    hull, table = hull_of(folder / parts["hull"].offsets), pd.read_csv(folder / parts["sail"].offsets)
    around = np.radians(np.arange(0.0, 181.0, 15.0))
    mean = np.array([float(np.mean(hull.radius(np.array([x]), around))) for x in hull.x])
    middle = 0.5 * (table["x_m"].min() + table["x_m"].max())
    return Sail(
        deck=float(np.ravel(hull.radius(np.array([middle]), np.array([0.0])))[0]),
        top=float(table["z_top_m"].max()),
        end=float(table["x_m"].max()),
        origin=float(geometry.origin.value[0]),
        radius=lambda x: np.interp(x, hull.x, mean),
    )


def at_planes(
    sail: Sail,
    tails: list[Plane],
    factors: CarryOver,
    roll: Array | float,
    drift: Callable[[float], Array | float],
    length: float,
) -> Array:
    """(planes, ...) incidence of the stern planes by the whole vortex, in deflection that loads a plane as much [rad].

    Parameters
    ----------
    sail, tails, factors : Geometry; how planes, roots and hull share the load of a deflection.
    roll : (...) roll moments in drift over 1/2 rho U^2 L^3, program frame.
    drift : As of ``vortex_path``.
    length : L [m].
    """
    span = sail.top - sail.deck
    # K = h Y: the hull's round sections bear no roll.
    side = roll * length**3 / (sail.deck + _CENTRE * span)
    circulation = -0.5 * side / (_ROLLED_UP * span)
    end = sail.origin - float(np.mean([p.position[0] for p in tails]))
    start = 1j * (sail.deck + _ROLLED_UP * span)
    vortex = vortex_path(start, drift, circulation, sail.radius, np.linspace(sail.end, end, _STEPS + 1))
    share = factors.parts
    angles = []
    for plane in tails:
        at, axis = complex(plane.position[1], -plane.position[2]), np.array(plane.lift_axis)
        at_plane, on_axis = (vortex_flow(point, vortex, circulation) @ axis for point in (at, 0j))
        angles.append((1.0 + share["root"] + share["others"]) * at_plane + share["hull"] * on_axis)
    return np.array(angles)


def sail_vortex(draft: Draft) -> str:
    """Error by what the sail's vortex does to the moving stern planes in drift: zero within half of it.

    Raises
    ------
    NotApplicable
        Without a sail, stern planes whose loads are known by part, or roll moments in drift.
    """
    tails = draft.vehicle.stern_planes
    if not tails or not draft.where(["[YZ]_d*"], [p.name for p in tails]).any():
        raise NotApplicable("no loads of stern planes by part")
    try:
        sail = sail_of(draft.vehicle)
    except InputError as error:
        raise NotApplicable(str(error)) from error
    factors = planes_of(draft)
    rows, beta, length = draft.rows, draft.axis("beta"), draft.vehicle.particulars.length.value
    drift = (np.nan_to_num(beta) != 0.0) & (np.nan_to_num(draft.axis("alpha")) == 0.0)
    rolls = drift & draft.where(["K_uvw"])
    if not rolls.any():
        raise NotApplicable("no roll moment in drift")
    planes = rows[rows["part"].isin([p.name for p in tails])]
    answer = {p.name: slopes(rows, p.name, planes["depth_m"].max(), planes["speed_mps"].max()) for p in tails}
    lift = lift_slope(draft, factors)[0]
    change, places = np.zeros(len(rows)), rows[["speed_mps", "depth_m"]].to_numpy(float)
    drifting = np.flatnonzero(rolls)
    alone = np.tan(np.radians(beta[drifting]))
    angles = at_planes(sail, tails, factors, draft.value[drifting].astype(float), lambda _: alone, length)
    loaded = {load: drift & draft.where([f"{load}_uvw"]) for load in _LOADS}
    for i, of_planes in zip(drifting, angles.T, strict=True):
        same = drift & (beta == beta[i]) & (places == places[i]).all(axis=1)
        for load in _LOADS:
            gained = sum(a * answer[p.name].get(load, 0.0) for a, p in zip(of_planes, tails, strict=True))
            change[same & loaded[load]] = lift * gained
    draft.spread("sail vortex at the stern", _SHARE * change)
    first = drift & draft.where(["N_uvw"]) & (beta == np.min(beta[rolls & (beta > 0.0)]))
    least = float(np.mean(change[first] / draft.value[first]))
    return f"zero within half of all of it, which in drift alone changes N at {beta[first][0]:g} deg by {least:+.1%}"
