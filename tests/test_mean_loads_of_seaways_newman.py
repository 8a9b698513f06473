"""Mean loads of a seaway on BB2: Newman's (1974) diagonal sum, its table, symmetry, limits."""

from __future__ import annotations

from copy import copy

import numpy as np
import pytest

from sim.waves.drift import add_mean, make_drift, tabulate
from sim.waves.linear import make_waves, regular
from sim.waves.mean_loads import dipole_body, mean_loads
from sim.waves.points import volume_points
from sim.waves.spectra import Spectrum, realise

RHO, G = 1025.0, 9.81
TOP = 11.37


@pytest.fixture(scope="module")
def body(coefficients, environment):
    return dipole_body(coefficients, environment)


@pytest.fixture(scope="module")
def wave():
    return regular(3.25, 140.9, 2.4, RHO, G)


@pytest.fixture(scope="module")
def drift(body, wave):
    return tabulate(body, wave, TOP, 6.0)


def _state(**changes):
    values = dict.fromkeys(["u", "v", "w", "p", "q", "r", "x", "y", "z", "phi", "theta", "psi"], 0.0) | {"z": 20.0}
    return np.array(list((values | changes).values()))


def _at(drift, **changes):
    out = np.zeros(6)
    add_mean(drift, _state(**changes), out)
    return out


def _sum(body, waves, depth, psi, speed):
    """Component by component, no table."""
    total = np.zeros(6)
    for j in range(waves.amplitude.size):
        heading = np.arctan2(waves.east[j], waves.north[j]) - psi
        found = mean_loads(body, waves.frequency[j], np.array([heading]), np.array([speed]), np.array([depth]))
        size = waves.amplitude[j] ** 2 * np.exp(-2.0 * waves.number[j] * depth)
        total += size * (found.direct[0, 0] + found.answered[0, 0])
    return total


@pytest.mark.parametrize("depth", [13.87, 21.37, 35.06, 80.0])
def test_table_of_a_regular_wave(body, wave, drift, depth):
    size = np.max([np.abs(_sum(body, wave, depth, psi, 0.0)) for psi in np.linspace(0.0, 3.0, 5)], axis=0)
    for psi, speed in ((0.0, 0.0), (1.23, 2.7), (4.0, 6.0)):
        expected, found = _sum(body, wave, depth, psi, speed), _at(drift, z=depth, psi=psi, u=speed)
        # Each load against its own size over the headings: 1 % of it.
        assert (np.abs(found - expected) < 0.01 * size).all(), (psi, speed)


def test_table_of_a_short_crested_sea(body):
    waves = realise(Spectrum("bretschneider", 3.3, 9.7, 0.4, 5.0), 16, 1, RHO, G)
    table = tabulate(body, waves, TOP)
    for depth in (13.87, 21.37, 35.06):
        expected, found = _sum(body, waves, depth, 1.03, 0.0), _at(table, z=depth, psi=1.03)
        assert found[[2, 4, 5]] == pytest.approx(expected[[2, 4, 5]], rel=0.02)
        assert found[:2] == pytest.approx(expected[:2], abs=0.03 * np.linalg.norm(expected[:2]))


def test_components_add_and_amplitudes_count_squared(body, wave, drift):
    other = regular(2.0, 90.0, 0.3, RHO, G)
    both = make_waves(
        np.array([wave.amplitude[0], 2.0 * other.amplitude[0]]),
        np.array([wave.frequency[0], other.frequency[0]]),
        np.array([2.4, 0.3]),
        np.zeros(2),
        RHO,
        G,
    )
    sum_of = _at(drift, psi=0.7) + 4.0 * _at(tabulate(body, other, TOP, 6.0), psi=0.7)
    assert _at(tabulate(body, both, TOP, 6.0), psi=0.7) == pytest.approx(sum_of, rel=2e-2)


def test_no_waves_nothing(coefficients, environment):
    """Not a digit, and no geometry read."""
    bare = copy(coefficients)
    bare.vehicle = coefficients.vehicle.model_copy(update={"geometry": None})
    table = make_drift(bare, environment, regular(0.0, 140.9, 0.0, RHO, G), 6.0)
    assert table.loads.size == 0
    out = np.array([1.0, -2.0, np.pi, 0.0, -0.0, 1e-300])
    before = out.tobytes()
    add_mean(table, _state(u=3.0), out)
    assert out.tobytes() == before


def test_bow_and_side_of_the_boat(body, drift):
    """BB2 is its own mirror image to port and starboard; a full turn changes nothing."""
    for angle in (0.4, 1.7, 2.9):
        one, other = _at(drift, psi=2.4 - angle), _at(drift, psi=2.4 + angle)
        assert other == pytest.approx(one * [1, -1, 1, -1, 1, -1], abs=1e-3 * np.abs(one).max())
    assert _at(drift, psi=0.6) == pytest.approx(_at(drift, psi=0.6 - 4.0 * np.pi), rel=1e-9)


def test_the_load_is_level_whatever_the_attitude(drift):
    level, turned = _at(drift), _at(drift, phi=0.3, theta=-0.4)
    assert np.linalg.norm(turned[:3]) == pytest.approx(np.linalg.norm(level[:3]), rel=1e-12)
    up = np.array([np.sin(-0.4), -np.cos(-0.4) * np.sin(0.3), -np.cos(-0.4) * np.cos(0.3)])
    assert turned[:3] @ up == pytest.approx(-level[2], rel=1e-9)
    # Nose straight down, suction is astern.
    assert _at(drift, theta=-0.5 * np.pi)[0] == pytest.approx(level[2], rel=1e-9)


def test_suction_at_every_heading_and_held_above_the_surface(coefficients, environment, wave, drift):
    displaced = RHO * volume_points(coefficients.vehicle, environment).volumes.sum()
    for psi in np.linspace(0.0, 6.0, 9):
        size = displaced * wave.amplitude[0] ** 2 * wave.frequency[0] ** 2 * wave.number[0]
        assert -1.4 < _at(drift, psi=psi)[2] / (size * np.exp(-40.0 * wave.number[0])) < -0.9
    assert (_at(drift, z=5.0) == _at(drift, z=TOP)).all()
    assert (_at(drift, u=-1.0) == _at(drift, u=0.0)).all()
    assert (_at(drift, u=9.0) == _at(drift, u=6.0)).all()
    assert np.abs(_at(drift, z=1e4)).max() < 1e-100


def test_a_fixed_boat_is_pushed_with_the_waves(coefficients, environment, wave):
    """Maruo: never against them, and much harder than a free one."""
    table = make_drift(coefficients, environment, wave, free=False)
    free = make_drift(coefficients, environment, wave)
    for psi in np.linspace(0.0, 6.0, 7):
        ahead = np.array([np.cos(2.4 - psi), np.sin(2.4 - psi)])
        along = _at(table, z=14.0, psi=psi)[:2] @ ahead
        assert along > 0.0
        assert along > 2.0 * np.abs(_at(free, z=14.0, psi=psi)[:2] @ ahead)
