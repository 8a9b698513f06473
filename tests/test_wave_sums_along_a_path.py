"""Sums of the waves along a moving, turning boat: rates, interpolation, precision, symmetry, calm."""

from __future__ import annotations

from copy import copy

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sim.boat.mass import Environment, added_mass_matrix
from sim.waves import loads as wave_loads
from sim.waves import passage as wave_passage
from sim.waves.in_waves import water_around
from sim.waves.linear import Waves, kinematics, regular
from sim.waves.points import probes, section_masses, volume_points
from sim.waves.pressure import froude_krylov, rotation
from sim.waves.spectra import Spectrum, realise

RHO, G = 1025.0, 9.81


@pytest.fixture(scope="module")
def boat(coefficients, environment):
    """Volume points, section centres and masses, probes of BB2."""
    volume = volume_points(coefficients.vehicle, environment)
    return volume, *section_masses(coefficients, environment, volume), probes(coefficients.vehicle)


@pytest.fixture(scope="module")
def seaway():
    return realise(Spectrum("bretschneider", 3.3, 9.7, direction=np.pi, spreading=5.0), 200, 1, RHO, G)


def _state(**changes):
    values = {"u": 5.0, "v": 0.3, "w": 0.2, "p": 0.01, "q": 0.02, "r": 0.03}
    values |= {"x": 100.0, "y": 50.0, "z": 16.0, "phi": 0.05, "theta": 0.1, "psi": 0.7}
    return np.array(list((values | changes).values()))


def _evaluate(sea, y, time):
    sums = wave_loads.passage(sea)
    value, slope = np.zeros(sums.value.shape[1]), np.zeros(sums.value.shape[1])
    wave_loads.evaluate(sea, y, time, sums, value, slope)
    return value, slope


def _plain(boat, waves, y, time):
    """Load, impulse and probes by the plain wave field, double precision."""
    volume, centres, masses, places = boat
    matrix = rotation(*y[9:])
    force = np.zeros(6)
    froude_krylov(waves, volume, y, time, force)
    velocity = masses * (kinematics(waves, y[6:9] + centres @ matrix.T, time).velocity @ matrix)
    impulse = np.concatenate([velocity.sum(axis=0), np.cross(centres, velocity).sum(axis=0)])
    return force, impulse, kinematics(waves, y[6:9] + places @ matrix.T, time).velocity @ matrix


def _motion(t, y):
    """Kinematics of a boat that speeds up, heaves, pitches and turns, all known functions of time."""
    velocity = np.array([5.0 + 0.05 * t, 0.0, 0.3 * np.sin(0.8 * t)])
    p, q, r = 0.0, 0.008 * np.cos(0.8 * t), 0.03
    sf, cf, tt, ct = np.sin(y[3]), np.cos(y[3]), np.tan(y[4]), np.cos(y[4])
    turn = q * sf + r * cf
    return velocity, np.array([p, q, r]), np.array([p + turn * tt, q * cf - r * sf, turn / ct])


def _path(times, start):
    def rate(t, y):
        velocity, _, angles = _motion(t, y)
        return np.concatenate([rotation(*y[3:]) @ velocity, angles])

    places = solve_ivp(rate, (times[0], times[-1]), start, t_eval=times, rtol=1e-10, atol=1e-10).y.T
    return [np.concatenate([*_motion(t, y)[:2], y]) for t, y in zip(times, places, strict=True)]


@pytest.mark.parametrize("components", [3, 200])
def test_values_are_those_of_the_plain_field(boat, components):
    waves = realise(Spectrum("bretschneider", 3.3, 9.7, 0.4, 5.0), components, 1, RHO, G)
    y = _state()
    value, _ = _evaluate(wave_loads.make_sea(waves, *boat), y, 33.0)
    force, impulse, velocity = _plain(boat, waves, y, 33.0)
    precision = 1e-12 if components < wave_loads.MANY else 2e-5
    assert value[:6] == pytest.approx(force, rel=precision)
    assert value[6:12] == pytest.approx(impulse, rel=precision)
    head = kinematics(waves, y[6:9], 33.0).pressure / (RHO * G)
    assert value[-1] == pytest.approx(head, abs=1e-12 if components < wave_loads.MANY else 1e-5)
    assert value[18:-1].reshape(-1, 3) == pytest.approx(velocity, abs=precision)


def test_slopes_are_the_rates_along_the_motion(boat, seaway):
    """Central differences of the plain field along the path of constant body-axis velocities."""
    few = Waves(*(a[::40] if isinstance(a, np.ndarray) else a for a in seaway))
    y, step = _state(), 0.02

    def moved(h):
        def rate(_, place):
            p, q, r = y[3:6]
            turn = q * np.sin(place[3]) + r * np.cos(place[3])
            angles = [p + turn * np.tan(place[4]), q * np.cos(place[3]) - r * np.sin(place[3]), turn / np.cos(place[4])]
            return np.concatenate([rotation(*place[3:]) @ y[:3], angles])

        place = solve_ivp(rate, (0.0, h), y[6:], rtol=1e-12, atol=1e-12).y[:, -1]
        return np.concatenate(_plain(boat, few, np.concatenate([y[:6], place]), 33.0 + h)[:2])

    expected = (8.0 * (moved(step) - moved(-step)) - (moved(2 * step) - moved(-2 * step))) / (12.0 * step)
    _, slope = _evaluate(wave_loads.make_sea(few, *boat), y, 33.0)
    assert slope[:12] == pytest.approx(expected, rel=1e-5)


def test_water_is_the_rigid_motion_of_the_same_impulse(boat, seaway, coefficients, environment):
    """A nu_water = I with A the added mass of the sections that carry the load, Eqs. (36)-(41)."""
    value, slope = _evaluate(wave_loads.make_sea(seaway, *boat), _state(), 3.0)
    sections = copy(coefficients)
    sections.vehicle = coefficients.vehicle.model_copy(update={"added_mass": "sections"})
    added = added_mass_matrix(sections, environment)
    assert added @ value[12:18] == pytest.approx(value[6:12], rel=1e-6)
    assert added @ slope[12:18] == pytest.approx(slope[6:12], rel=1e-6)


def test_long_waves_move_the_water_as_one(boat):
    """Waves of 200 boat lengths: translation with the particle velocity, rotation k times that."""
    waves = regular(2.0, 14000.0, 0.6, RHO, G)
    y = _state()
    value, _ = _evaluate(wave_loads.make_sea(waves, *boat), y, 3.0)
    water = kinematics(waves, y[6:9], 3.0).velocity @ rotation(*y[9:])
    orbit = waves.frequency[0]
    assert value[12:15] == pytest.approx(water, abs=0.01 * orbit)
    assert np.abs(value[15:18]).max() < 2.0 * waves.number[0] * orbit


def test_interpolated_loads_follow_the_exact_ones(boat, seaway):
    """A seaway on a boat in full manoeuvre: 0.5 % at 0.4 s between sums, at least second order in it."""
    times = np.arange(0.0, 24.0, 0.2)
    path = _path(times, [0.0, 0.0, 14.0, 0.0, 0.0, 0.3])
    exact = []
    sea = wave_loads.make_sea(seaway, *boat)
    for t, y in zip(times, path, strict=True):
        value, slope = _evaluate(sea, y, t)
        value[6:12] = slope[12:18]
        exact.append(value)
    size = np.abs(exact).max(axis=0)
    worst = []
    for span in (0.4, 0.8):
        sea = wave_loads.make_sea(seaway, *boat, wave_loads.Summing(span))
        sums, out = wave_loads.passage(sea), np.zeros(len(size))
        miss = np.zeros(len(size))
        for t, y, known in zip(times, path, exact, strict=True):
            wave_passage.advance(sea, y, t, sums)
            wave_passage.interpolate(sums.time, sums.value, sums.slope, t, out)
            miss = np.maximum(miss, np.abs(out - known) / size)
        worst.append(miss.max())
    assert worst[0] < 5e-3
    assert worst[0] < 0.3 * worst[1]


def test_sums_are_made_anew_after_a_jump(boat, seaway):
    """A boat put elsewhere, or a time gone back, is noticed: the next value is exact."""
    sea = wave_loads.make_sea(seaway, *boat)
    sums, out = wave_loads.passage(sea), np.zeros(18 + 18 + 1)
    wave_passage.advance(sea, _state(), 0.0, sums)
    for y, time in ((_state(x=140.0), 0.4), (_state(psi=1.5), 0.8), (_state(), 0.1)):
        wave_passage.advance(sea, y, time, sums)
        wave_passage.interpolate(sums.time, sums.value, sums.slope, time, out)
        value, slope = _evaluate(sea, y, time)
        assert out[:6] == pytest.approx(value[:6], rel=1e-9)
        assert out[6:12] == pytest.approx(slope[12:18], rel=1e-9)
        assert out[12:] == pytest.approx(value[12:], abs=1e-12)


def test_within_a_span_nothing_is_summed_again(boat, seaway):
    sea = wave_loads.make_sea(seaway, *boat)
    sums = wave_loads.passage(sea)
    wave_passage.advance(sea, _state(), 0.0, sums)
    kept = sums.value.copy()
    wave_passage.advance(sea, _state(x=100.1), 0.2, sums)
    assert np.array_equal(sums.value, kept)


def test_mirrored_seas_give_mirrored_loads(boat):
    """Port and starboard: Y, K, N and the water's v, p, r change sign."""
    y = _state(v=0.0, p=0.0, r=0.0, y=0.0, phi=0.0, psi=0.0)
    starboard, port = (
        _evaluate(wave_loads.make_sea(regular(3.0, 120.0, chi, RHO, G), *boat), y, 2.0) for chi in (0.8, -0.8)
    )
    mirror = np.tile([1.0, -1.0, 1.0, -1.0, 1.0, -1.0], 3)
    for a, b in zip(starboard, port, strict=True):
        assert a[:18] == pytest.approx(b[:18] * mirror, rel=1e-9, abs=1e-9 * np.abs(a[:18]).max())


def test_a_calm_surface_needs_no_place_of_the_propeller(coefficients):
    """No component: nothing meets the water at planes and propeller."""
    other = coefficients.vehicle.model_copy(deep=True)
    other.propeller.position = None
    bare = type(coefficients).__new__(type(coefficients))
    bare.__dict__.update(coefficients.__dict__ | {"vehicle": other})
    water = water_around(bare, Environment(RHO, G), regular(0.0, 100.0, 0.0, RHO, G))
    assert water.sea.waves.amplitude.size == 0
    assert water.cells.volumes.sum() > 0.0


def test_a_vehicle_without_geometry_or_propeller_place_is_told_so(coefficients):
    from sim.files.errors import InputError

    vehicle = coefficients.vehicle.model_copy(deep=True, update={"geometry": None})
    with pytest.raises(InputError, match="key geometry"):
        volume_points(vehicle, Environment(RHO, G))
    vehicle.propeller.position = None
    with pytest.raises(InputError, match=r"propeller\.position"):
        probes(vehicle)


def test_section_masses_are_table_6(boat):
    """Totals of the rows of Table 6: 0.0492, 1.198, 0.840 of 4418.8 t (see the errata)."""
    assert boat[2].sum(axis=0) / 4418.8e3 == pytest.approx([0.0492, 1.198, 0.840], abs=5e-4)


def test_volume_points_carry_the_displaced_mass(boat, coefficients):
    displaced = coefficients.vehicle.particulars.displaced_mass.value
    assert RHO * boat[0].volumes.sum() == pytest.approx(displaced, rel=1e-12)
