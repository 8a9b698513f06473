"""Derivatives of a boat of which only lines are known: hull, sail and fins together, with their errors.

Sum of a hull by slender-body theory (``slender``) and of sail and stern fins by a lattice (``fins``). Not in it:
a ring wing, what the sail's tip vortex does to the fins, and the propeller. The errors have causes that do not
know of one another; each moves all derivatives together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.hull.fins import fins_of, sail, sail_fin, stern_fins
from sim.hull.slender import geometry_of, hull_prior, lines

# Name of a linear derivative -> plane of motion, place among the five numbers of a part, sign there, power of L.
_DERIVATIVES = {
    "Y_v": ("horizontal", 0, 1.0, 2),
    "N_v": ("horizontal", 1, 1.0, 3),
    "K_v": ("horizontal", 4, 1.0, 3),
    "Y_ur": ("horizontal", 2, 1.0, 3),
    "N_ur": ("horizontal", 3, 1.0, 4),
    "Z_w": ("vertical", 0, 1.0, 2),
    "M_w": ("vertical", 1, -1.0, 3),
    "Z_uq": ("vertical", 2, -1.0, 3),
    "M_uq": ("vertical", 3, 1.0, 4),
}


@dataclass(frozen=True)
class Derivative:
    """One derivative by the lines.

    Attributes
    ----------
    value, sigma : In 1/2 rho L^n.
    errors : Cause -> change by one standard deviation of it; their squares add up to that of ``sigma``.
    """

    value: float
    sigma: float
    errors: dict[str, float]


def derivatives(vehicle: Vehicle, with_fins: bool = True) -> dict[str, Derivative]:
    """Linear derivatives of drift, heave, yaw and pitch from a vehicle's geometry file alone.

    Parameters
    ----------
    vehicle : With a geometry file.
    with_fins : False for the hull and sail of a boat whose planes have loads of their own.

    Returns
    -------
    ``Y_v``, ``N_v``, ``K_v``, ``Y_ur``, ``N_ur``, ``Z_w``, ``M_w``, ``Z_uq``, ``M_uq``, about the body origin.

    Raises
    ------
    InputError
        Without a geometry file, or a hull in it; for one whose x axis does not run aft.

    References
    ----------
    .. [1] Munk, M. M., NACA Report 184, 1924.
    .. [2] Hopkins, E. J., NACA RM A51C14, 1951.
    .. [3] Pitts, W. C., Nielsen, J. N., Kaattari, G. E., NACA Report 1307, 1957.

    Examples
    --------
    >>> from sim.boat.vehicle import load_vehicle
    >>> prior = derivatives(load_vehicle("suboff-hull"))
    >>> prior["N_v"].value < 0.0 < prior["N_v"].sigma
    True
    """
    hull = lines(vehicle)
    geometry, folder = geometry_of(vehicle)
    if geometry.frame.frame.sign("x") > 0.0:
        raise InputError(str(vehicle.geometry), "x runs forward", "a geometry file with x aft")
    origin = float(geometry.origin.value[0])
    length = vehicle.particulars.length.value
    tower = sail_fin(geometry, folder, hull)
    # Fins ahead of amidships, such as planes on the sail or the bow, are no stern fins.
    fins, radius = fins_of(geometry, folder, hull, origin)
    values = {}
    for plane in ("horizontal", "vertical"):
        value, sigma = hull_prior(hull)
        total, errors = np.append(value, 0.0), {"end of potential flow": np.append(sigma, 0.0)}
        parts = [stern_fins(fins, radius, plane, origin)] if fins and with_fins else []
        parts += [sail(tower[0], hull, tower[1], origin)] if tower and plane == "horizontal" else []
        for part in parts:
            total = total + part.value
            errors |= part.errors
        for name, (axis, k, sign, power) in _DERIVATIVES.items():
            if axis == plane:
                by = {cause: float(sign * change[k] / length**power) for cause, change in errors.items()}
                sigma_k = float(np.sqrt(sum(x**2 for x in by.values())))
                values[name] = Derivative(float(sign * total[k] / length**power), sigma_k, by)
    return values
