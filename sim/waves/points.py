"""Points of a vehicle at which waves and the surface are felt: volume, sections, planes, cells."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.files.errors import InputError
from sim.hull.emergence import Cells, cells
from sim.hull.surface import read_geometry
from sim.waves.pressure import Quadrature, quadrature

if TYPE_CHECKING:
    from sim.boat.coefficients import Coefficients
    from sim.boat.mass import Environment
    from sim.boat.vehicle import Vehicle

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
    scales = (environment.density, vehicle.particulars.length.value, vehicle.diameter)
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
    position = vehicle.needed_propeller("a boat in waves").position
    if position is None:
        raise InputError(f"vehicle {vehicle.name}, key propeller.position", "nothing", "a position: waves need it")
    return np.array([*[p.position for p in vehicle.planes], position.value], dtype=float)


def _geometry(vehicle: Vehicle) -> str:
    """The geometry file of a vehicle; raises ``InputError`` when it names none."""
    if vehicle.geometry is None:
        where = f"vehicle {vehicle.name}, key geometry"
        raise InputError(where, "nothing", "a geometry file: waves and emergence need it")
    return str(vehicle.geometry)


# Points and cells are a second of work, and the same for every flight of a vehicle.
@lru_cache(maxsize=8)
def _points(geometry: str, shortest: float, displaced: float) -> Quadrature:
    return quadrature(read_geometry(Path(geometry)), shortest, displaced)


def volume_points(vehicle: Vehicle, environment: Environment) -> Quadrature:
    """Volume points of a vehicle, scaled to its displaced mass.

    With the surface's own volume instead, a neutrally buoyant boat would not follow long waves.

    Raises
    ------
    InputError
        When the vehicle names no geometry, or the geometry file is wrong.
    """
    particulars = vehicle.particulars
    displaced = particulars.displaced_mass.value / environment.density
    return _points(_geometry(vehicle), _SHORTEST * particulars.length.value, displaced)


@lru_cache(maxsize=8)
def _cells(
    geometry: str, displaced: float, centre: tuple[float, ...], sections: tuple[tuple[float, ...], ...]
) -> Cells:
    return cells(read_geometry(Path(geometry)), displaced=displaced, centre=centre, sections=np.array(sections))


def hull_cells(vehicle: Vehicle, environment: Environment, sections: Array) -> Cells:
    """Cells of a hull for emergence, scaled and shifted to its displaced mass and centre of buoyancy.

    Parameters
    ----------
    vehicle : With a geometry; raises ``InputError`` without.
    environment : Water density.
    sections : (k, 3) centres of the sections that carry added mass [m].
    """
    particulars = vehicle.particulars
    displaced = particulars.displaced_mass.value / environment.density
    centre = tuple(float(v) for v in particulars.centre_of_buoyancy.value)
    return _cells(_geometry(vehicle), displaced, centre, tuple(map(tuple, sections.tolist())))
