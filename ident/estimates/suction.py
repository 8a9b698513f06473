"""What a working propeller does to the planes before it.

Planes are tested on a towed boat; in free flight the propeller draws the water past them. An actuator disc of uniform
load (Hough and Ordway 1965) is a semi-infinite vortex cylinder, whose flow outside the slipstream is that of a disc of
sinks:

    u = u_0 Omega / (2 pi),    u_0 = V_a / 2 (sqrt(1 + C_T) - 1)

with Omega the solid angle under which a point sees the disc, and u_0 the flow it adds in itself (Rankine and Froude).
The thrust is that of self-propulsion: resistance of hull and planes over one less the thrust deduction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.estimates.draft import Draft, NotApplicable
from ident.estimates.plane_loads import at_neutral, planes_of
from ident.estimates.turning import Given

Array = NDArray[np.float64]

# The load is not uniform over a real disc, and the water about the stern is slowed: half of the change.
_RELATIVE_SIGMA = 0.5
_RINGS, _SECTORS = 40, 90


def solid_angle(ahead: float, radius: float, off: float) -> float:
    """Solid angle of a disc from a point before it.

    Parameters
    ----------
    ahead : Distance of the point from the disc's plane [m].
    radius : Of the disc [m].
    off : Distance of the point from the axis [m].

    Examples
    --------
    On the axis it is 2 pi (1 - x / sqrt(x^2 + R^2)).

    >>> import math
    >>> round(solid_angle(3.0, 4.0, 0.0) / (2.0 * math.pi), 4)
    0.4
    """
    edges = np.linspace(0.0, radius, _RINGS + 1)
    r = np.sqrt(0.5 * (edges[1:] ** 2 + edges[:-1] ** 2))[:, None]
    area = 0.5 * (edges[1:] ** 2 - edges[:-1] ** 2)[:, None] * 2.0 * np.pi / _SECTORS
    turn = (np.arange(_SECTORS) + 0.5) * 2.0 * np.pi / _SECTORS
    square = ahead**2 + r**2 + off**2 - 2.0 * r * off * np.cos(turn)
    return float(np.sum(ahead * area / square**1.5))


def drawn(loading: float, ahead: float, radius: float, off: float) -> float:
    """Flow that the propeller adds at a point before it, over the speed at which it advances.

    Parameters
    ----------
    loading : C_T, thrust over 1/2 rho V_a^2 and the disc's area.
    ahead, radius, off : As of ``solid_angle``.
    """
    return 0.5 * (np.sqrt(1.0 + loading) - 1.0) * solid_angle(ahead, radius, off) / (2.0 * np.pi)


def _held(draft: Draft, term: str, speed: float, depth: float, **at: float) -> float:
    """Value of a term at the row nearest to a speed and depth, with other axes as stated; raises without one."""
    rows = draft.rows
    chosen = draft.where([term])
    for axis, value in at.items():
        chosen &= draft.axis(axis) == value
    if not chosen.any():
        raise NotApplicable(f"no {term} at rest of its other axes")
    gap = np.abs(rows["speed_mps"].fillna(speed) - speed) + 1e-3 * np.abs(rows["depth_m"].fillna(depth) - depth)
    return float(draft.value[np.flatnonzero(chosen)[np.argmin(gap[chosen])]])


def thrust_loading(draft: Draft, diameter: float) -> tuple[float, float]:
    """C_T of self-propulsion at the fastest and deepest runs, and the wake fraction.

    Raises
    ------
    NotApplicable
        Without resistance or thrust deduction.
    """
    rows = draft.rows
    speed, depth = float(rows["speed_mps"].max()), float(rows["depth_m"].max())
    resistance = -_held(draft, "X_uvw", speed, depth, alpha=0.0, beta=0.0)
    for plane in draft.vehicle.planes:
        of_plane = [n for n, p in zip(draft.names, draft.parts, strict=True) if p == plane.name and n.startswith("X_d")]
        if of_plane:
            resistance -= _held(draft, of_plane[0], speed, depth, delta=0.0)
    deduction = _held(draft, "t", speed, depth)
    wake = _held(draft, "w_T", speed, depth) if draft.has("w_T") else 0.0
    thrust = resistance / (1.0 - deduction)
    area = 0.25 * np.pi * diameter**2
    return thrust * draft.vehicle.particulars.length.value**2 / area / (1.0 - wake) ** 2, wake


def propeller_suction(draft: Draft, given: Given) -> str:
    """Loads of the stern planes with the propeller at work, where they were measured without.

    Plane, root and hull carry their shares in the flow at their own distance from the axis. The state is
    self-propulsion: a boat that slows down at fixed revolutions draws more.

    Raises
    ------
    NotApplicable
        For planes measured with a working propeller, or without stern planes, geometry, propeller or resistance.
    """
    stern, propeller = draft.vehicle.stern_planes, draft.vehicle.propeller
    terms, parts = ["[XYZKMN]_d*"], [p.name for p in stern]
    if given.propelled:
        raise NotApplicable("the planes were measured with the propeller at work")
    if propeller is None or not draft.where(terms, parts).any():
        raise NotApplicable("no propeller, or no loads of stern planes by part")
    planes = planes_of(draft)
    if propeller.position is None:
        raise NotApplicable("no place of the propeller")
    loading, wake = thrust_loading(draft, propeller.diameter.value)
    ahead = float(np.mean([p.position[0] for p in stern])) - propeller.position.value[0]
    if ahead <= 0.0 or loading <= 0.0:
        raise NotApplicable("no propeller behind the planes that drives the boat ahead")
    weights = {"plane": 1.0} | planes.parts
    added = {
        part: (1.0 - wake) * drawn(loading, ahead, 0.5 * propeller.diameter.value, planes.radii[part])
        for part in weights
    }
    factor = sum(w * (1.0 + added[part]) ** 2 for part, w in weights.items()) / sum(weights.values())
    chosen = draft.where(terms, parts)
    sigma = _RELATIVE_SIGMA * (factor - 1.0)
    draft.multiply(
        chosen, factor, sigma, "propeller suction", f"propeller_suction x{factor:.4f}", at_neutral(draft, chosen)
    )
    return f"C_T {loading:.2f}, {added['plane']:.2%} of speed at the planes: loads x{factor:.4f} +- {sigma:.4f}"
