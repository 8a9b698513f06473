"""A vehicle in waves or near the surface: its geometry gathered for ``sim.waves.surroundings``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.files.errors import InputError
from sim.hull.emergence import Cells
from sim.waves.drift import Drift, make_drift
from sim.waves.linear import Waves, calm
from sim.waves.loads import Gauges, Sea, Summing, make_sea, section_added_mass
from sim.waves.points import hull_cells, probes, section_masses, volume_points
from sim.waves.surroundings import Surroundings, surroundings_of

if TYPE_CHECKING:
    from sim.boat.coefficients import Coefficients
    from sim.boat.mass import Environment

Array = NDArray[np.float64]


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
    sea = make_sea(waves, volume, centres, masses, places, Summing(span), Gauges(hull.stations, box))
    second = waves if second_order else calm(waves.density, waves.gravity)
    drift = make_drift(coefficients, environment, second, top_speed)
    return Water(sea, hull, drift, centres, masses, environment.density * environment.gravity)


def phases_of(water: Water | None, phases: ArrayLike, boats: int | None = None) -> Array:
    """Phases as a sea takes them.

    Parameters
    ----------
    phases : (components,) or, for so many ``boats``, (boats, components) [rad].

    Raises
    ------
    InputError
        For another number than the sea has components, or a phase that is not finite.
    """
    count = water.sea.waves.amplitude.size if water else 0
    given = np.array(phases, dtype=float)
    if given.shape not in ((count,), (boats, count)) or not count or not np.isfinite(given).all():
        each = f", or {boats} times as many" if boats is not None else ""
        allowed = f"{count} finite numbers, one a component of the waves{each}" if count else "none in calm water"
        raise InputError("phases of the waves", f"{given.shape} numbers", allowed)
    return given


def with_phases(water: Water, phases: Array) -> Water:
    """The same sea at another moment or place: other phases of its components.

    Parameters
    ----------
    phases : (components,) [rad]; not copied.
    """
    return replace(water, sea=water.sea._replace(waves=water.sea.waves._replace(phase=phases)))


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
    inertia = added / unit
    turn = _root(0.5 * (inertia + inertia.T), 0.5) @ _root(parts.sum(axis=0), -0.5)
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
