"""Roll in oscillation: drag of sail and fins that shed a vortex from their edges at every swing.

Runs that turn steadily about the boat's axis have the drag of a plate in a stream. A boat that rolls moves its sail and
fins by a fraction of their chord to and fro, and the drag of a sharp edge in a flow that turns back is larger,
by the Keulegan-Carpenter number KC = 2 pi A / c to the power -1/3 (Graham 1980, J. Fluid Mech. 97, who gives 8.0 for a
plate with two sharp edges; a section has one)::

    K = -1/2 rho p|p| integral of  c(s) Cd(KC) s^3  ds

Neither is a boat that rolls: the one has the flow established, the other two-dimensional and without the round edges'
relief. The geometric mean of both, with the deviation of a uniform distribution of the logarithm between them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.estimates.draft import Draft, NotApplicable
from ident.estimates.turning import Given
from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment, added_mass_matrix
from sim.boat.vehicle import Vehicle
from sim.files.constants import constant
from sim.files.errors import InputError
from sim.hull.fins import fins_of, sail_fin
from sim.hull.integral import trapezoid
from sim.hull.lattice import Fin
from sim.hull.slender import geometry_of, lines

Array = NDArray[np.float64]

# Drag of a plate in oscillation over KC^(-1/3), both edges sharp.
_PLATE, _POWER = constant("oscillating_plate_drag"), constant("oscillating_plate_power")
# Amplitudes of the roll rate in degrees of roll at the natural period.
_ROLL_DEG = (1.0, 2.0, 5.0, 10.0, 20.0)


def natural_frequency(draft: Draft) -> float:
    """Undamped natural frequency of roll of a submerged boat by its weight, lever and inertia [rad/s].

    Raises
    ------
    NotApplicable
        Without a restoring lever or the hull's lines, which give the density of the water it floats in.
    """
    vehicle, particulars = draft.vehicle, draft.vehicle.particulars
    lever = particulars.centre_of_gravity.value[2] - particulars.centre_of_buoyancy.value[2]
    density = particulars.displaced_mass.value / lines(vehicle).volume
    rows = draft.rows.assign(value=draft.value)
    water = added_mass_matrix(Coefficients(vehicle, rows), Environment(density, constant("standard_gravity")))[3, 3]
    inertia = particulars.mass.value * (particulars.radius_of_gyration.value[0] ** 2 + lever**2) + water
    if lever <= 0.0:
        raise NotApplicable("no lever that rights the boat")
    return float(np.sqrt(particulars.mass.value * constant("standard_gravity") * lever / inertia))


def edge_drag(fins: list[Fin], angle: float) -> float:
    """Integral of c Cd s^3 over fins that swing by an amplitude [rad], about the axis s is measured from [m^5].

    Example
    -------
    A strip of chord 1 m at 10 m with KC = 2 pi 0.1 10 = 6.28 has Cd = 4.0 x 6.28^(-1/3) = 2.17:

    >>> strip = Fin(((9.99, 0.0, 1.0), (10.0, 0.0, 1.0), (10.01, 0.0, 1.0)), 0.0)
    >>> round(edge_drag([strip], 0.1) / (0.02 * 10.0**3), 2)
    2.17
    """
    total = 0.0
    for fin in fins:
        ends = np.array(fin.chords)
        s = np.linspace(ends[0, 0], ends[-1, 0], 60)
        chord = np.interp(s, ends[:, 0], ends[:, 2] - ends[:, 1])
        drag = 0.5 * _PLATE * (2.0 * np.pi * angle * s / chord) ** _POWER
        total += float(trapezoid(chord * drag * s**3, s))
    return total


def _surfaces(vehicle: Vehicle) -> list[Fin]:
    """Sail and stern fins."""
    hull = lines(vehicle)
    geometry, folder = geometry_of(vehicle)
    fins = fins_of(geometry, folder, hull, float(geometry.origin.value[0]))[0]
    tower = sail_fin(geometry, folder, hull)
    return fins + ([tower[0]] if tower else [])


def roll_damping(draft: Draft, given: Given) -> str:
    """Roll damping in oscillation, between steady runs and the drag of edges; rows beyond the rates of the runs.

    Raises
    ------
    NotApplicable
        Without runs in pure roll, sail and fins, or when the runs go to the rates of a rolling boat.
    """
    runs = draft.where(["K_p[|]p[|]"])
    if not runs.any():
        raise NotApplicable("no runs in pure roll")
    try:
        surfaces, frequency = _surfaces(draft.vehicle), natural_frequency(draft)
    except InputError as error:
        raise NotApplicable(str(error)) from error
    if not surfaces:
        raise NotApplicable("no sail and no fins")
    rate = np.abs(draft.axis("p"))
    last = float(rate[runs].max())
    steady = float(np.mean(draft.value[runs & np.isclose(rate, last)]))
    amplitude = np.radians([a for a in _ROLL_DEG if np.radians(a) * frequency > last])
    if not amplitude.size or steady >= 0.0:
        raise NotApplicable("runs in pure roll go to the rates of a rolling boat")
    length = draft.vehicle.particulars.length.value
    edges = -np.array([edge_drag(surfaces, a) for a in amplitude]) / length**5
    mean, half = -np.sqrt(steady * edges), np.abs(np.log(edges / steady)) / np.sqrt(12.0)
    depth = float(np.nanmax(draft.axis("D0")[runs]))
    rates = amplitude * frequency
    points = [{"p": float(s * p), "D0": depth} for s in (-1.0, 1.0) for p in rates]
    new = draft.add("K_p|p|", points, [float(x) for x in np.tile(mean, 2)], "roll_damping")
    change = np.zeros(len(new))
    change[new] = np.tile(mean * half, 2)
    draft.spread("roll in oscillation", change)
    ratio = mean / steady
    return (
        f"x{ratio[-1]:.1f} to x{ratio[0]:.1f} of the steady runs within a factor {np.exp(half.max()):.1f}, "
        f"natural period {2.0 * np.pi / frequency:.1f} s"
    )
