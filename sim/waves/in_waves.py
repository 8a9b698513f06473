"""A vehicle in waves or near the surface: its geometry gathered for ``sim.waves.surroundings``."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.files.errors import InputError
from sim.hull.emergence import Cells, cells
from sim.hull.surface import read_geometry
from sim.waves.drift import Drift, make_drift
from sim.waves.linear import Waves, calm
from sim.waves.loads import Sea, make_sea, section_added_mass
from sim.waves.pressure import Quadrature, quadrature
from sim.waves.surroundings import Surroundings, surroundings_of

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


@dataclass(frozen=True)
class Water:
    """Waves and the surface around a vehicle, shared by every flight of it.

    Attributes
    ----------
    sea : Waves and the boat's points in them; calm without components.
    cells : Of the hull, for emergence. drift : Mean second-order loads.
    centres, masses : (k, 3) sections that carry added mass [m], [kg].
    specific_weight : rho g [N/m^3].
    """

    sea: Sea
    cells: Cells
    drift: Drift
    centres: Array
    masses: Array
    specific_weight: float


def water_around(
    coefficients: Coefficients,
    environment: Environment,
    waves: Waves,
    span: float = 0.4,
    top_speed: float = 0.0,
    second_order: bool = True,
) -> Water:
    """Waves, perhaps none, and the surface around a vehicle.

    Parameters
    ----------
    coefficients : Of the vehicle.
    environment : Water density and gravity.
    waves : Components.
    span : Time between sums of the waves [s].
    top_speed : Largest speed ahead that is flown, for the mean second-order loads [m/s].
    second_order : Whether there are mean second-order loads.

    Raises
    ------
    InputError
        When the vehicle lacks what waves or emergence need.
    """
    vehicle = coefficients.vehicle
    volume = volume_points(vehicle, environment)
    centres, masses = section_masses(coefficients, environment, volume)
    hull = hull_cells(vehicle, environment, centres)
    places = probes(vehicle) if waves.amplitude.size else np.zeros((0, 3))
    box = np.stack([hull.low, hull.high])
    sea = make_sea(waves, volume, centres, masses, places, span, stations=hull.stations, box=box)
    second = waves if second_order else calm(waves.density, waves.gravity)
    drift = make_drift(coefficients, environment, second, top_speed)
    return Water(sea, hull, drift, centres, masses, environment.density * environment.gravity)


def _root(matrix: Array, power: float) -> Array:
    """A power of a symmetric, positive semidefinite matrix on its range."""
    values, vectors = np.linalg.eigh(matrix)
    kept = values > 1e-12 * values.max(initial=0.0)
    return np.asarray((vectors[:, kept] * values[kept] ** power) @ vectors[:, kept].T)


def shares(added: Array, centres: Array, masses: Array) -> Array:
    """Divide the added mass of a boat among its sections.

    The sections' own sum differs from the left-hand side's (Table 6 and a panel method); the
    congruence G = A^1/2 A_sections^-1/2 turns each section's J^T m J into a part of A, so that
    the parts of whatever is wet are positive semidefinite and all of them together are A.

    Parameters
    ----------
    added : (6, 6) of the left-hand side.
    centres, masses : (k, 3) of the sections.

    Returns
    -------
    (k + 1, 6, 6), the last what no section carries.
    """
    scale = np.array([1.0, 1.0, 1.0, *[max(float(np.abs(centres).max(initial=0.0)), 1.0)] * 3])
    unit = np.outer(scale, scale)
    parts = np.zeros((len(centres) + 1, 6, 6))
    for k, (r, m) in enumerate(zip(centres, masses, strict=True)):
        parts[k] = section_added_mass(r, m) / unit
    own = added / unit
    turn = _root(0.5 * (own + own.T), 0.5) @ _root(parts.sum(axis=0), -0.5)
    parts[:-1] = turn @ parts[:-1] @ turn.T
    parts *= unit
    parts[-1] = added - parts[:-1].sum(axis=0)
    return parts


def surroundings(water: Water, added_mass: Array) -> Surroundings:
    """The water around one boat and thread, with scratch arrays of its own.

    Parameters
    ----------
    water : Shared.
    added_mass : (6, 6) of the left-hand side.
    """
    added, parts = np.ascontiguousarray(added_mass), shares(added_mass, water.centres, water.masses)
    return surroundings_of(water.sea, water.cells, water.drift, added, parts, water.specific_weight)
