"""Linear deep-water waves: every quantity from one potential.

Component j has, with z down from the calm surface and t the time,

    Phi_j = a_j g / omega_j exp(-k_j z) sin(theta_j),
    theta_j = k_j (x cos chi_j + y sin chi_j) - omega_j t + epsilon_j,   k_j = omega_j^2 / g,

chi_j the direction the waves travel to, clockwise from north. Then, to first order in
a_j (Newman 1977, section 6.3): elevation eta = a cos(theta) (up), v = grad Phi, dynamic
pressure p = -rho dPhi/dt = rho g a exp(-k z) cos(theta), and dv/dt = -grad p / rho.
Pressure and horizontal velocity are in phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Waves(NamedTuple):
    """Components of a wave field, cheap to hand to a compiled function.

    amplitude : (n,) [m]; number : (n,) k [1/m]; frequency : (n,) omega [rad/s].
    north, east : (n,) cos chi and sin chi of the direction each travels to.
    phase : (n,) epsilon [rad]; density [kg/m^3]; gravity [m/s^2].
    flow_north, flow_east : Velocity of the water that carries the waves [m/s]. All of the above is meant in that
    water: at a place that does not move, a component passes with omega + k . flow.
    No component means calm water, which costs nothing and changes no digit.
    """

    amplitude: Array
    number: Array
    frequency: Array
    north: Array
    east: Array
    phase: Array
    density: float
    gravity: float
    flow_north: float = 0.0
    flow_east: float = 0.0


@dataclass(frozen=True)
class Kinematics:
    """A wave field at points: elevation [m, up], dynamic pressure [Pa], earth velocity [m/s], acceleration [m/s^2].

    Elevation is that above each point's place; acceleration is dv/dt at a fixed point.
    """

    elevation: Array
    potential: Array
    pressure: Array
    velocity: Array
    acceleration: Array


def make_waves(
    amplitude: Array,
    frequency: Array,
    direction: Array,
    phase: Array,
    density: float,
    gravity: float,
) -> Waves:
    """Components as a wave field; those of zero amplitude are left out.

    Parameters
    ----------
    amplitude : (n,) or scalar [m].
    frequency : (n,) or scalar, omega > 0 [rad/s].
    direction : (n,) or scalar, chi: where the waves travel to, clockwise from north [rad].
    phase : (n,) or scalar [rad].
    density, gravity : Of the water and the place [kg/m^3], [m/s^2].

    Raises
    ------
    ValueError
        For a frequency that is not positive or a number that is not finite.
    """
    a, w, chi, e = (
        np.ascontiguousarray(v, dtype=float)
        for v in np.broadcast_arrays(*(np.atleast_1d(v) for v in (amplitude, frequency, direction, phase)))
    )
    if not all(np.isfinite(v).all() for v in (a, w, chi, e)) or (w <= 0.0).any():
        raise ValueError("wave components must be finite, with positive frequencies")
    keep = a != 0.0
    a, w, chi, e = a[keep], w[keep], chi[keep], e[keep]
    return Waves(a, w * w / gravity, w, np.cos(chi), np.sin(chi), e, float(density), float(gravity))


def calm(density: float, gravity: float) -> Waves:
    """No component: calm water."""
    nothing = np.zeros(0)
    return make_waves(nothing, nothing, nothing, nothing, density, gravity)


def mean_direction(waves: Waves) -> Array:
    """Where the waves travel to, each component by its energy.

    Returns
    -------
    (2,) north and east over the sum of the energies: one long for a long-crested sea, nothing
    where components cancel. Of at least one component.
    """
    energy = waves.amplitude**2
    return np.array([energy @ waves.north, energy @ waves.east]) / energy.sum()


def regular(
    height: float, length: float, direction: float, density: float, gravity: float, phase: float = 0.0
) -> Waves:
    """A regular wave of a height crest to trough [m] and a wavelength [m]; dispersion omega^2 = g k.

    Parameters
    ----------
    height, length : [m].
    direction : Where it travels to, clockwise from north [rad].
    density, gravity : [kg/m^3], [m/s^2].
    phase : Epsilon [rad]; zero puts a crest at the earth origin at t = 0.
    """
    frequency = np.sqrt(2.0 * np.pi * gravity / length)
    one = np.ones(1)
    return make_waves(0.5 * height * one, frequency * one, direction * one, phase * one, density, gravity)


def kinematics(waves: Waves, points: Array, time: Array | float) -> Kinematics:
    """The wave field at points and times, in plain NumPy.

    Parameters
    ----------
    waves : Components.
    points : (..., 3) north, east, down from the calm surface [m].
    time : Scalar or (...) [s].

    Returns
    -------
    Kinematics with arrays (...) and (..., 3), earth frame (north, east, down). Above the
    calm surface the field is continued analytically.
    """
    points = np.asarray(points, dtype=float)
    x, y, z = (points[..., i, None] for i in range(3))
    t = np.asarray(time, dtype=float)[..., None]
    x, y = x - waves.flow_north * t, y - waves.flow_east * t
    theta = waves.number * (waves.north * x + waves.east * y) - waves.frequency * t + waves.phase
    decay = waves.amplitude * np.exp(-waves.number * z)
    c, s = decay * np.cos(theta), decay * np.sin(theta)
    w, g = waves.frequency, waves.gravity

    def earth(along: Array, down: Array) -> Array:
        parts = ((waves.north * along).sum(-1), (waves.east * along).sum(-1), down.sum(-1))
        return np.stack(np.broadcast_arrays(*parts), axis=-1)

    return Kinematics(
        elevation=(waves.amplitude * np.cos(theta)).sum(-1),
        potential=(g / w * s).sum(-1),
        pressure=waves.density * g * c.sum(-1),
        velocity=earth(w * c, -w * s),
        acceleration=earth(w * w * s, w * w * c),
    )
