"""A vehicle in waves: its volume points, sections and probes gathered for ``sim.wave_loads``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.catalogue import ACCELERATIONS, OUTPUTS
from sim.errors import InputError
from sim.pressure import Quadrature, quadrature
from sim.surface import read_geometry
from sim.wave_loads import Sea, make_sea
from sim.waves import Waves

if TYPE_CHECKING:
    from sim.coefficients import Coefficients
    from sim.model import Environment
    from sim.vehicle import Vehicle

Array = NDArray[np.float64]

# Waves shorter than this share of the length load a boat too little to need more stations.
_SHORTEST = 0.6


def section_masses(coefficients: Coefficients, environment: Environment, volume: Quadrature) -> tuple[Array, Array]:
    """Where the boat's added mass sits, Eqs. (36)-(41).

    From the sections of Table 6 when the vehicle has them. Otherwise the whole-boat diagonal
    (X_udot, Y_vdot, Z_wdot) is spread over the volume points like the volume, which is exact
    for ellipsoids and the strip theory of a slender hull.

    Parameters
    ----------
    coefficients : With acceleration terms.
    environment : Water density.
    volume : Volume points of the hull.

    Returns
    -------
    centres, masses : (s, 3) [m] and c m in x, y, z [kg].
    """
    vehicle = coefficients.vehicle
    scales = (environment.density, vehicle.particulars.length.value, vehicle.propeller.diameter.value)
    places = {s.name: k for k, s in enumerate(vehicle.sections.centres)} if vehicle.sections else {}
    masses, whole = np.zeros((len(places), 3)), np.zeros(3)
    for coefficient in coefficients:
        term = coefficient.term
        if not term.is_acceleration:
            continue
        axis = OUTPUTS.index(term.output)
        if axis > 2 or ACCELERATIONS.index(term.factors[0]) != axis:
            continue
        mass = -term.scale(*scales) * float(coefficient.values[0])
        if coefficient.part in places:
            masses[places[coefficient.part], axis] += mass
        else:
            whole[axis] += mass
    if vehicle.sections:
        return np.array([s.position for s in vehicle.sections.centres]), masses
    return volume.points, np.outer(volume.volumes / volume.volumes.sum(), whole)


def probes(vehicle: Vehicle) -> Array:
    """Where the water's velocity is wanted: each plane in file order, then the propeller.

    Raises
    ------
    InputError
        When the vehicle file does not say where the propeller is.
    """
    position = vehicle.propeller.position
    if position is None:
        raise InputError(f"vehicle {vehicle.name}, key propeller.position", "nothing", "a position: waves need it")
    return np.array([*[p.position for p in vehicle.planes], position.value], dtype=float)


def volume_points(vehicle: Vehicle, environment: Environment) -> Quadrature:
    """Volume points of a vehicle, scaled to its displaced mass.

    With the surface's own volume instead, a neutrally buoyant boat would not follow long waves.

    Raises
    ------
    InputError
        When the vehicle names no geometry, or the geometry file is wrong.
    """
    if vehicle.geometry is None:
        raise InputError(f"vehicle {vehicle.name}, key geometry", "nothing", "a geometry file: waves need it")
    particulars = vehicle.particulars
    displaced = particulars.displaced_mass.value / environment.density
    return quadrature(read_geometry(vehicle.geometry), _SHORTEST * particulars.length.value, displaced)


def sea_around(coefficients: Coefficients, environment: Environment, waves: Waves, span: float = 0.4) -> Sea:
    """Waves and the vehicle in them, for ``wave_loads.advance`` and ``wave_loads.at``.

    Parameters
    ----------
    coefficients : Of the vehicle.
    environment : Water density and gravity.
    waves : Components; without any, nothing of the geometry is read and the sea is calm.
    span : Time between sums of the waves [s].

    Raises
    ------
    InputError
        When the vehicle lacks what waves need.
    """
    vehicle = coefficients.vehicle
    if waves.amplitude.size == 0:
        empty = np.zeros((0, 3))
        return make_sea(waves, Quadrature(empty, np.zeros(0)), empty, empty, empty, span)
    volume = volume_points(vehicle, environment)
    centres, masses = section_masses(coefficients, environment, volume)
    return make_sea(waves, volume, centres, masses, probes(vehicle), span)
