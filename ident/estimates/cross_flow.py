"""Cross-flow along the hull: what drift and rotation do together, and pure yaw with forward speed.

Each section meets its own cross-flow v + x r, and its drag is that of a cylinder across the flow
(Allen and Perkins 1951, NACA Report 1048; the integrals are Feldman's, 1979, DTNSRDC/SPD-0393-09)::

    Y = -1/2 rho Cd  integral of  h(x) (v + x r) |v + x r|        dx
    N = -1/2 rho Cd  integral of  h(x) (v + x r) |v + x r|  x     dx

and in the vertical plane with the breadth b(x) and the cross-flow w - x q. Tables of pure drift
and pure rotation hold the integral at r = 0 and at v = 0, so the coupling is what is left; it is
r|r| times a function of v/r alone, and beyond the ends of the hull a straight line in v/r.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.boat.vehicle import Vehicle
from sim.files.constants import constant
from sim.files.errors import InputError
from sim.files.toml_files import read_toml
from sim.hull.surface import Geometry, hull_of

Array = NDArray[np.float64]

# Sections along the hull; more change nothing in four digits.
_SECTIONS = 400
# Drag of a long cylinder across the flow: least beyond the critical Reynolds number, most below it. Roshko measures
# 0.7 beyond 3.5e6, the middle.
_LEAST, _MOST = constant("cylinder_drag_least"), constant("cylinder_drag_most")


@cache
def _finite_cylinders() -> tuple[Array, Array]:
    """Length over diameter, and drag on that of a long cylinder, which Allen and Perkins use as eta."""
    table = csv.DictReader((files("ident") / "data" / "finite_cylinders.csv").read_text("utf-8").splitlines())
    rows = [(float(row["length_to_diameter"]), float(row["drag_on_that_of_a_long_one"])) for row in table]
    slender, drag = np.array(rows).T
    return slender, drag


@dataclass(frozen=True)
class Strips:
    """Sections of a hull across one plane of motion.

    Attributes
    ----------
    x : (n,) stations, forward of the body origin [m].
    width : (n,) height (horizontal motion) or breadth (vertical) [m].
    step : Distance of the stations [m].
    """

    x: Array
    width: Array
    step: float

    def moment_of_area(self, power: int) -> float:
        """Integral of width x^power [m^(2 + power)]."""
        return float(np.sum(self.width * self.x**power) * self.step)


def strips(vehicle: Vehicle, vertical: bool = False) -> Strips:
    """Sections of a vehicle's hull, from its offsets.

    Parameters
    ----------
    vehicle : With a geometry file that has a hull.
    vertical : For motion in the vertical plane, which meets the breadth.

    Raises
    ------
    InputError
        When there is no geometry or no hull in it.
    """
    if vehicle.geometry is None:
        raise InputError(f"vehicle {vehicle.name}", "no geometry file", "key geometry, with the hull's offsets")
    data, where = read_toml(vehicle.geometry, "vehicles")
    geometry = Geometry.model_validate(data)
    part = next((p for p in geometry.parts if p.kind == "hull"), None)
    if part is None:
        raise InputError(where, "no hull", "a part of kind hull")
    hull = hull_of(Path(where).parent / part.offsets)
    edges = np.linspace(hull.x[0], hull.x[-1], _SECTIONS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])

    def radius(degrees: float) -> Array:
        return np.ravel(hull.radius(middle, np.array([np.radians(degrees)])))

    width = 2.0 * radius(90.0) if vertical else radius(0.0) + radius(180.0)
    forward = geometry.frame.frame.sign("x") * (middle - geometry.origin.value[0])
    return Strips(forward, width, float(edges[1] - edges[0]))


def integrals(hull: Strips, pivot: Array | float) -> tuple[Array, Array]:
    """Integrals of width (X + x)|X + x| and of that times x, at X = v/r.

    Parameters
    ----------
    hull : Sections.
    pivot : (k,) v/r [m].

    Returns
    -------
    (k,) [m^4] and (k,) [m^5].
    """
    cross = np.atleast_1d(np.asarray(pivot, dtype=float))[:, None] + hull.x
    load = hull.width * cross * np.abs(cross) * hull.step
    return load.sum(axis=1), (load * hull.x).sum(axis=1)


def coupling(hull: Strips, pivot: Array | float) -> tuple[Array, Array]:
    """The integrals less their parts in pure drift and in pure rotation, (k,) [m^4] and [m^5]."""
    x = np.atleast_1d(np.asarray(pivot, dtype=float))
    force, moment = integrals(hull, x)
    still = integrals(hull, 0.0)
    drift = x * np.abs(x)
    return (
        force - still[0] - drift * hull.moment_of_area(0),
        moment - still[1] - drift * hull.moment_of_area(1),
    )


def literature_drag(hull: Strips) -> tuple[float, float]:
    """Drag coefficient across the flow with its standard deviation, from the hull's proportions alone.

    A long cylinder between its least and its most (uniform), times the end effect at length over diameter.
    """
    slender = (hull.x.max() - hull.x.min()) / hull.width.max()
    measured, drag = _finite_cylinders()
    end = float(np.interp(np.log(slender), np.log(measured), drag))
    return end * 0.5 * (_LEAST + _MOST), end * (_MOST - _LEAST) / np.sqrt(12.0)


def drift_drag(angle: Array, value: Array, sigma: Array) -> tuple[float, float] | None:
    """Second-order part of a load in drift, with its standard error.

    C = C0 cos^2 + A sin cos + B sin|sin| by weighted least squares, Eq. (25); with runs on one side
    only, C0 is zero by symmetry.

    Parameters
    ----------
    angle, value, sigma : (n,) of the runs with incidence [rad].

    Returns
    -------
    B and its standard error; None with fewer runs than unknowns and one more, or for runs that lie on the straight
    part exactly: a line drawn by the source says nothing of curvature.
    """
    sine = np.sin(angle)
    form = np.stack([sine * np.cos(angle), sine * np.abs(sine)], axis=1)
    if angle.min() < 0.0 < angle.max():
        form = np.column_stack([form, np.cos(angle) ** 2])
    if len(angle) <= form.shape[1] or np.any(sigma <= 0.0):
        return None
    linear = np.column_stack([np.ones(len(angle)), angle])
    rest = value - linear @ np.linalg.lstsq(linear, value, rcond=None)[0]
    if np.abs(rest).max() < 1e-4 * np.abs(value).max():
        return None
    weighted = form / sigma[:, None]
    inverse = np.linalg.inv(weighted.T @ weighted)
    return float((inverse @ weighted.T @ (value / sigma))[1]), float(np.sqrt(inverse[1, 1]))


def weighted_mean(values: list[tuple[float, float]]) -> tuple[float, float]:
    """Mean by inverse variance and its deviation, which scatter beyond the errors widens (Birge ratio)."""
    x, s = np.array(values, dtype=float).T
    weight = 1.0 / s**2
    mean = float((weight * x).sum() / weight.sum())
    scatter = float((weight * (x - mean) ** 2).sum() / max(len(x) - 1, 1))
    return mean, float(weight.sum() ** -0.5 * np.sqrt(max(scatter, 1.0)))
