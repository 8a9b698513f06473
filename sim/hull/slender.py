"""A hull alone, from its lines: derivatives by slender-body theory between two limits, added mass, resistance.

Each section of apparent mass m(x) meets its own cross-flow; the momentum left behind a section is its load (Munk 1924,
NACA Report 184). Carried to the end of a closed hull this is the flow of an ideal fluid: a couple and no force. On a
real hull the flow leaves the stern; Hopkins (1951, NACA RM A51C14) has potential loads end at a station that he found
from bodies of revolution, 0.378 L + 0.527 x1 behind the nose with x1 the station where sections shrink fastest.
The one keeps the flow to the end, the other gives all of it up: the value is the middle of the two,
its deviation that of a uniform distribution between them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.boat.vehicle import Vehicle
from sim.files.constants import constant
from sim.files.errors import InputError
from sim.files.schema import checked
from sim.files.toml_files import read_toml
from sim.hull.integral import trapezoid
from sim.hull.surface import Geometry, hull_of

Array = NDArray[np.float64]

_SECTIONS = 800
# Hopkins (1951): station at which potential flow ends, over the length and over the station of steepest decrease.
_OF_LENGTH, _OF_STEEPEST = constant("potential_flow_ends_length"), constant("potential_flow_ends_steepest")


class NoHull(InputError):
    """A vehicle without a geometry file, or one without a hull in it: its lines are not known."""


@dataclass(frozen=True)
class Lines:
    """Sections of a hull.

    Attributes
    ----------
    x : (n,) stations forward of the body origin, from the nose aft [m].
    area : (n,) [m^2].
    girth : (n,) [m].
    deck : (n,) height of the deck above the hull's axis [m].
    """

    x: Array
    area: Array
    girth: Array
    deck: Array

    @property
    def radius(self) -> Array:
        """(n,) radius of the circle of equal area [m]."""
        return np.sqrt(self.area / np.pi)

    @property
    def length(self) -> float:
        """Over all [m]."""
        return float(self.x[0] - self.x[-1])

    @property
    def volume(self) -> float:
        """[m^3]"""
        return float(-trapezoid(self.area, self.x))

    @property
    def centre(self) -> float:
        """Centre of volume, forward of the body origin [m]."""
        return float(-trapezoid(self.area * self.x, self.x)) / self.volume

    @property
    def wetted(self) -> float:
        """Wetted surface, the slope of the sections left out as in a slender body [m^2]."""
        return float(-trapezoid(self.girth, self.x))


def geometry_of(vehicle: Vehicle) -> tuple[Geometry, Path]:
    """Geometry file of a vehicle and its folder.

    Raises
    ------
    NoHull
        Without one.
    InputError
        For a file that is no geometry file, or whose frame is left-handed.
    """
    if vehicle.geometry is None:
        raise NoHull(f"vehicle {vehicle.name}", "no geometry file", "key geometry, with the hull's offsets")
    data, where = read_toml(vehicle.geometry, "vehicles")
    geometry = checked(Geometry, data, where)
    geometry.frame.declared(f"{where}, key frame")
    return geometry, Path(where).parent


def lines(vehicle: Vehicle) -> Lines:
    """Sections of a vehicle's hull, from its offsets.

    Raises
    ------
    NoHull
        Without a geometry file, or a hull in it.
    InputError
        For a geometry file or offsets that cannot be read.
    """
    geometry, folder = geometry_of(vehicle)
    part = next((p for p in geometry.parts if p.kind == "hull"), None)
    if part is None:
        raise NoHull(str(vehicle.geometry), "no hull", "a part of kind hull")
    hull = hull_of(folder / part.offsets)
    # Closer where the sections change, at the ends.
    x = hull.x[0] + (hull.x[-1] - hull.x[0]) * 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, _SECTIONS + 1)))
    angle = np.linspace(0.0, np.pi, 91)
    r = hull.radius(x, angle)
    area = np.asarray(trapezoid(r**2, angle, axis=1))
    step = np.hypot(np.gradient(r, angle, axis=1), r)
    forward = geometry.frame.frame.sign("x") * (x - geometry.origin.value[0])
    return Lines(forward, area, np.asarray(2.0 * trapezoid(step, angle, axis=1)), r[:, 0])


def spheroid(length: float, diameter: float) -> tuple[float, float, float]:
    """Added mass coefficients of a prolate spheroid: along, across, and of rotation (Lamb 1932, art. 114).

    Returns
    -------
    On the displaced mass, the same, and on the displaced moment of inertia.

    Examples
    --------
    >>> [round(k, 2) for k in spheroid(6.01, 1.0)]
    [0.05, 0.92, 0.76]
    """
    e = float(np.sqrt(1.0 - (diameter / length) ** 2))
    logarithm = float(np.log((1.0 + e) / (1.0 - e)))
    alpha = 2.0 * (1.0 - e**2) / e**3 * (0.5 * logarithm - e)
    beta = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * logarithm
    turned = e**4 * (beta - alpha) / ((2.0 - e**2) * (2.0 * e**2 - (2.0 - e**2) * (beta - alpha)))
    return alpha / (2.0 - alpha), beta / (2.0 - beta), turned


def end_of_potential_flow(hull: Lines) -> float:
    """Hopkins' station, forward of the body origin [m]."""
    aft = hull.x[0] - hull.x
    steepest = float(aft[int(np.argmin(np.gradient(hull.area, aft)))])
    return float(hull.x[0]) - (_OF_LENGTH * hull.length + _OF_STEEPEST * steepest)


def hull_derivatives(hull: Lines, last: float | None) -> Array:
    """Slender-body derivatives of a hull whose potential loads end at a station.

    Parameters
    ----------
    hull : Sections.
    last : Station [m forward of the origin]; None for the end of the hull, where a closed hull has no section left.

    Returns
    -------
    (4,) Y_v [m^2], N_v, Y_r [m^3], N_r [m^4], over 1/2 rho U.
    """
    along, across, _ = spheroid(hull.length, 2.0 * float(hull.radius.max()))
    kept = hull.x >= (hull.x[-1] if last is None else last)
    x, mass = hull.x[kept], (across - along) * hull.area[kept]
    left, at = (0.0, float(x[-1])) if last is None else (float(mass[-1]), float(x[-1]))
    whole, first = float(-trapezoid(mass, x)), float(-trapezoid(mass * x, x))
    return 2.0 * np.array([-left, -(at * left + whole), -at * left, -(at**2 * left + first)])


def hull_prior(hull: Lines) -> tuple[Array, Array]:
    """The middle of both limits and half their distance over sqrt(3), (4,) each; the error is one and the same."""
    attached, parted = hull_derivatives(hull, None), hull_derivatives(hull, end_of_potential_flow(hull))
    return 0.5 * (attached + parted), (parted - attached) / np.sqrt(12.0)


def hull_added_mass(hull: Lines) -> dict[str, float]:
    """Added mass of a hull over rho: sections, with the ends of the spheroid of its proportions.

    Returns
    -------
    ``udot``, ``vdot`` [m^3], ``rdot`` [m^5] about the origin, ``vr`` [m^4] coupling of sway with yaw.
    """
    along, across, turned = spheroid(hull.length, 2.0 * float(hull.radius.max()))
    moments = [float(-trapezoid(hull.area * hull.x**k, hull.x)) for k in range(3)]
    centre = moments[1] / moments[0]
    inertia = moments[2] - centre**2 * moments[0]
    return {
        "udot": along * moments[0],
        "vdot": across * moments[0],
        "vr": across * moments[1],
        "rdot": turned * inertia + across * centre**2 * moments[0],
    }


def friction(reynolds: float) -> float:
    """Friction coefficient of a turbulent plate by the ITTC 1957 line.

    Example
    -------
    >>> round(friction(1e7), 5)
    0.003
    """
    return float(0.075 / (np.log10(reynolds) - 2.0) ** 2)
