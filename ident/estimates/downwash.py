"""What deflected sail planes load beside themselves: their roots, and the stern planes behind.

Sail planes leave a pair of vortices, pi/4 of their span apart (elliptic loading), that trail
straight aft and pass over the stern planes. Their circulation follows from the measured
lift of the sail planes by Kutta and Joukowsky, their velocity at the stern planes by Biot
and Savart (Katz and Plotkin, Low-Speed Aerodynamics, ch. 2); the stern planes answer with
their measured lift. This is the wing-tail interference of Pitts, Nielsen and Kaattari (1957,
NACA Report 1307). The campaign measured each plane alone, so it is in none of its runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from ident.estimates.carry_over import CarryOver
    from sim.boat.vehicle import Plane

Array = NDArray[np.float64]

# Elliptic loading: distance of the rolled-up vortices over the span.
_ROLLED_UP = np.pi / 4.0
# Relative standard deviation. The pair may be as far apart as the tips, or lie on the local
# flow instead of straight aft (0.3); and, as in NACA Report 1307, the loads it induces on the
# hull before the tail are left out, which act against those on the tail and may be of their size.
_RELATIVE_SIGMA = 0.7
# Deflections [deg] between which the lift slopes are taken: before any stall.
_LINEAR_DEG = 10.0


@dataclass(frozen=True)
class TailDownwash:
    """Factors on the sail planes' own loads that include their fixed roots and the stern planes.

    Attributes
    ----------
    force_factor, force_sigma : On the heave force.
    moment_factor, moment_sigma : On the pitch moment.
    incidence_deg : Plane -> incidence for 10 deg of sail-plane deflection [deg].
    method : One line.
    """

    force_factor: float
    force_sigma: float
    moment_factor: float
    moment_sigma: float
    incidence_deg: dict[str, float]
    method: str


def vortex_pair(point: Array, start: Array, half: float, circulation: float) -> Array:
    """Velocity of two semi-infinite vortices trailing aft, program frame.

    Parameters
    ----------
    point : (3,) where [m].
    start : (3,) middle of the pair's upstream end [m]; x forward, y starboard, z down.
    half : Half the distance between the vortices [m].
    circulation : Of the bound vortex, positive for lift up [m^2/s].

    Returns
    -------
    (3,) velocity [m/s]; between the vortices it points down.
    """
    total = np.zeros(3)
    for side in (1.0, -1.0):
        d = point - (start + np.array([0.0, side * half, 0.0]))
        r2 = d[1] ** 2 + d[2] ** 2
        # Both trail aft (-x); seen from astern the starboard one turns anticlockwise.
        share = 1.0 - d[0] / np.sqrt(d[0] ** 2 + r2)
        total += side * circulation / (4.0 * np.pi * r2) * share * np.array([0.0, d[2], -d[1]])
    return total


def slopes(rows: pd.DataFrame, part: str, depth: float, speed: float) -> dict[str, float]:
    """Measured change of each load coefficient of a plane per radian of its deflection."""
    at_state = rows[(rows["part"] == part) & (rows["depth_m"] == depth) & (rows["speed_mps"] == speed)]
    slope_of = {}
    for output, group in at_state.groupby("output"):
        value = group.set_index("delta_deg")["value"]
        if {-_LINEAR_DEG, _LINEAR_DEG} <= set(value.index):
            change = float(value[_LINEAR_DEG] - value[-_LINEAR_DEG])
            slope_of[str(output)] = change / (2.0 * np.radians(_LINEAR_DEG))
    return slope_of


def _coefficient_changes(
    rows: pd.DataFrame, tails: list[Plane], sail: Plane, half: float, length: float, at: tuple[float, float]
) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Own slopes of the sail planes, what the tail adds per radian, incidence by plane."""
    depth, speed = at
    by_runs = slopes(rows, sail.name, depth, speed)
    lift = -by_runs["Z"]
    circulation = 0.5 * length**2 * lift / (2.0 * half)
    added, incidence = {"Z": 0.0, "M": 0.0}, {}
    for plane in tails:
        flow = vortex_pair(np.array(plane.position), np.array(sail.position), half, circulation)
        incidence[plane.name] = float(flow @ plane.lift_axis)
        answer = slopes(rows, plane.name, depth, speed)
        for output in added:
            added[output] += answer[output] * incidence[plane.name]
    return by_runs, added, incidence


def tail_downwash(vehicle: Vehicle, rows: pd.DataFrame, planes: CarryOver) -> TailDownwash:
    """Factors on the sail planes' loads by their downwash on the stern planes.

    Parameters
    ----------
    vehicle : With planes at the stern and one pair on the sail.
    rows : Captive database rows, for the measured lift slopes (deepest, fastest runs).
    planes : What stern and sail planes carry over to their roots and the hull.

    Raises
    ------
    InputError
        When the vehicle has no such planes.
    """
    sails, tails = vehicle.forward_planes, vehicle.stern_planes
    if len(sails) != 1 or not tails:
        text = f"{len(sails)} planes on sail or bow, {len(tails)} at the stern"
        raise InputError(f"vehicle {vehicle.name}", text, "one pair that moves together and any at the stern")
    runs = rows[rows["part"] == sails[0].name]
    at = (float(runs["depth_m"].max()), float(runs["speed_mps"].max()))
    half = _ROLLED_UP * planes.sail_tip
    by_runs, added, incidence = _coefficient_changes(rows, tails, sails[0], half, vehicle.particulars.length.value, at)
    change = {k: planes.force_factor * added[k] / by_runs[k] for k in added}
    factor = {k: planes.sail_factor * (1.0 + x) for k, x in change.items()}
    sigma = {k: float(np.hypot(abs(x) * _RELATIVE_SIGMA, planes.sail_sigma)) for k, x in change.items()}
    return TailDownwash(
        force_factor=factor["Z"],
        force_sigma=sigma["Z"],
        moment_factor=factor["M"],
        moment_sigma=sigma["M"],
        incidence_deg={k: v * _LINEAR_DEG for k, v in incidence.items()},
        method=(
            "fixed roots by vortex lattice on the sail's wall; "
            "trailing vortex pair (elliptic loading) at the stern planes"
        ),
    )
