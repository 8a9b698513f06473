"""Mass of a vehicle and of the water that moves with it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.boat.coefficients import Coefficient, Coefficients
from sim.boat.vehicle import Vehicle

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Environment:
    """Water density [kg/m^3] and gravity [m/s^2]."""

    density: float
    gravity: float


def cross_matrix(r: Iterable[float]) -> Array:
    """The matrix [r]x with [r]x a = r x a."""
    x, y, z = r
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rigid_body_matrix(vehicle: Vehicle) -> tuple[Array, Array]:
    """Rigid-body mass matrix about the origin, Eq. (14) as corrected.

    Returns
    -------
    mass : (6, 6) [kg, kg m, kg m^2].
    inertia : (3, 3) inertia about the origin.
    """
    particulars = vehicle.particulars
    m = particulars.mass.value
    lever = cross_matrix(particulars.centre_of_gravity.value)
    inertia = m * (np.diag(np.square(particulars.radius_of_gyration.value)) - lever @ lever)
    return np.block([[m * np.eye(3), -m * lever], [m * lever, inertia]]), inertia


def unit_added_masses(coefficients: Coefficients, environment: Environment) -> list[tuple[Coefficient, Array]]:
    """Each acceleration coefficient in use, with the (6, 6) added mass of a value of one.

    From sections, Eqs. (36)-(41): A = sum J^T diag(c m) J with J = [1, -[r]x]; or from the
    whole-boat derivatives, as the vehicle declares.
    """
    vehicle = coefficients.vehicle
    length, diameter = vehicle.particulars.length.value, vehicle.diameter
    masses = []
    centres = {s.name: s.position for s in vehicle.sections.centres} if vehicle.sections else {}
    for coefficient in coefficients:
        term = coefficient.term
        if not term.is_acceleration or (coefficient.part in centres) != (vehicle.added_mass == "sections"):
            continue
        unit, load = np.zeros((6, 6)), term.scale(environment.density, length, diameter)
        i, j = OUTPUTS.index(term.output), ACCELERATIONS.index(term.factors[0])
        if coefficient.part in centres:
            motion = np.hstack([np.eye(3), -cross_matrix(centres[coefficient.part])])
            unit = -load * np.outer(motion[i], motion[j])
        else:
            unit[i, j] = -load
        masses.append((coefficient, unit))
    return masses


def added_mass_matrix(coefficients: Coefficients, environment: Environment) -> Array:
    """Added mass about the origin, (6, 6) [kg, kg m, kg m^2]; zero when nothing was identified."""
    parts = unit_added_masses(coefficients, environment)
    return np.array(sum((float(c.values[0]) * unit for c, unit in parts), np.zeros((6, 6))))
