"""First-order wave loads of BB2 under way against the exact linear potential flow about its surface.

Deep water, no lift and no friction: Froude-Krylov, added mass along the motion and the Munk
moment of the relative velocity are then the whole load, and what the panels say is exact.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from unbounded_panels import Panels

from sim.hull.added_mass import wetted_panels
from sim.hull.surface import read_geometry
from sim.waves import loads as wave_loads
from sim.waves.in_waves import water_around
from sim.waves.linear import regular

SPEED, DEPTH = 5.14444, 35.0624
X_Z_M = [0, 2, 4]


@pytest.fixture(scope="module")
def panels(coefficients):
    mesh = read_geometry(Path(str(coefficients.vehicle.geometry)), coarser=2.5)
    return Panels(wetted_panels(mesh).corners)


def _centripetal(added: np.ndarray, speed: float, motion: np.ndarray) -> np.ndarray:
    """X, Z, M of Kirchhoff's equations linear in a small motion about a speed ahead."""
    ahead, own = added @ np.array([speed, 0.0, 0.0]), added @ motion
    u, w, q = motion
    return np.array([-ahead[1] * q, ahead[0] * q, ahead[1] * u + own[1] * speed - ahead[0] * w])


def test_added_mass_of_the_sphere_is_half_its_displacement():
    """Lamb (1932), section 92; an inscribed polyhedron is a little small."""
    theta, phi = np.meshgrid(np.linspace(0.0, np.pi, 25), np.linspace(-np.pi, np.pi, 49), indexing="ij")
    p = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    corners = np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))])
    added = Panels(corners).added_mass(1.0)
    assert np.diag(added)[:2] == pytest.approx(2.0 / 3.0 * np.pi * np.ones(2), rel=0.03)
    assert np.abs(added[2]).max() < 0.02


def test_added_mass_of_the_panels_is_that_of_the_boat(panels, model):
    """Which another panel method worked out, on the whole surface."""
    found, known = panels.added_mass(1025.0), model.added_mass[np.ix_(X_Z_M, X_Z_M)]
    assert np.diag(found) == pytest.approx(np.diag(known), rel=0.06)


@pytest.mark.parametrize("length", [76.0, 140.9, 220.0])
@pytest.mark.parametrize("sense", [1.0, -1.0], ids=["head", "following"])
def test_heave_force_and_pitch_moment_of_waves_at_speed(panels, coefficients, environment, model, length, sense):
    wave = regular(2.0, length, np.pi if sense > 0 else 0.0, environment.density, environment.gravity)
    sea = water_around(coefficients, environment, wave, second_order=False).sea
    sums, y = wave_loads.passage(sea), np.zeros(12)
    y[0], y[8] = SPEED, DEPTH
    value, slope = np.zeros(sums.value.shape[1]), np.zeros(sums.value.shape[1])
    added = model.added_mass[np.ix_(X_Z_M, X_Z_M)]
    parts = []
    for time in (0.0, 0.5 * np.pi / wave.frequency[0]):
        wave_loads.evaluate(sea, y, time, sums, value, slope)
        water, rate = value[wave_loads.WATER :][X_Z_M], slope[wave_loads.WATER :][X_Z_M]
        parts.append(value[X_Z_M] + added @ rate - _centripetal(added, SPEED, water))
    found = (parts[0] - 1j * parts[1]) / wave.amplitude[0]
    exact = panels.wave_load(environment.density, SPEED, wave.number[0], sense, wave.frequency[0])
    exact *= np.exp(-wave.number[0] * DEPTH)
    # Of water that moves as one: the orbital acceleration at the origin, and its change along the boat.
    acceleration = wave.frequency[0] ** 2 * np.exp(-wave.number[0] * DEPTH)
    whole = np.diag(added)[1:] + np.array([model.mass, model.inertia[1]])
    size = acceleration * whole * [1.0, wave.number[0]]
    assert abs(found[1] - exact[1]) < 0.04 * size[0]
    assert abs(found[2] - exact[2]) < 0.07 * size[1]
    assert abs(found[2]) == pytest.approx(abs(exact[2]), rel=0.05)
