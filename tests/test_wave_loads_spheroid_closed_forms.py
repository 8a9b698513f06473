"""Wave loads on a fixed, submerged sphere and prolate spheroid against closed forms.

With one potential f = exp(kappa . r), kappa . kappa = 0, the integral over a spheroid of half
axes a, b is V 3 (s cosh s - sinh s) / s^3 with s^2 = kappa_x^2 (a^2 - b^2); along the waves
s = i q. The potentials of an ellipsoid moving along its axes are -k_i x_i on its surface, so
that Green's theorem gives the whole deeply submerged load as (1 + k_i) times Froude-Krylov,
k_i Lamb's added-mass coefficients (Lamb 1932, art. 114).
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sim.hull.surface import read_geometry
from sim.waves import loads as wave_loads
from sim.waves.linear import kinematics, make_waves, regular
from sim.waves.pressure import froude_krylov, quadrature, rotation

RHO, G = 1025.0, 9.81
A, B = 30.0, 4.0
NOTHING = np.zeros((0, 3))


def _spheroid(folder, a, b, stations):
    folder.mkdir()
    x = a * (1.0 - np.cos(np.linspace(0.0, np.pi, stations)))
    r = b * np.sqrt(np.maximum(1.0 - (x / a - 1.0) ** 2, 0.0))
    r[[0, -1]] = 0.0
    pd.DataFrame({"x_m": x, "r_m": r}).to_csv(folder / "offsets.csv", index=False)
    (folder / "boat.toml").write_text(
        f"""name = "spheroid"
source = "closed form"
origin = {{ value = [{a}, 0.0, 0.0], unit = "m", source = "centre" }}
frame = {{ x = "aft", y = "starboard", z = "up" }}
parts = [{{ kind = "hull", name = "hull", offsets = "offsets.csv", around = 64, step_m = 1.0 }}]
"""
    )
    return read_geometry(folder / "boat.toml")


@pytest.fixture(scope="module")
def spheroid(tmp_path_factory):
    mesh = _spheroid(tmp_path_factory.mktemp("boat") / "spheroid", A, B, 81)
    return quadrature(mesh, 25.0, displaced=4.0 / 3.0 * np.pi * A * B * B)


def _state(depth, attitude=(0.0, 0.0, 0.0)):
    y = np.zeros(12)
    y[6:9], y[9:] = (100.0, -40.0, depth), attitude
    return y


def _shape(s):
    """3 (s cosh s - sinh s) / s^3 and its derivative over s, complex s."""
    g = 3.0 * (s * np.cosh(s) - np.sinh(s)) / s**3
    return g, (3.0 * np.sinh(s) / s**2 - 3.0 * g / s) / s


def _closed_form(wave, y, time):
    """Froude-Krylov load on the spheroid, body axes, and the phasor it is the real part of."""
    volume = 4.0 / 3.0 * np.pi * A * B * B
    k = wave.number[0]
    kappa = rotation(*y[9:]).T @ (k * np.array([1j * wave.north[0], 1j * wave.east[0], -1.0]))
    theta = k * (wave.north[0] * y[6] + wave.east[0] * y[7]) - wave.frequency[0] * time + wave.phase[0]
    f = wave.amplitude[0] * np.exp(-k * y[8] + 1j * theta)
    g, slope = _shape(kappa[0] * np.sqrt(A * A - B * B))
    moment = slope * (A * A - B * B) * np.array([0.0, -kappa[0] * kappa[2], kappa[0] * kappa[1]])
    return np.real(-RHO * G * f * volume * np.concatenate([g * kappa, moment]))


@pytest.mark.parametrize("length", [45.0, 62.0, 147.0, 350.0])
@pytest.mark.parametrize("heading", [0.0, 40.0, 85.0, 140.0, 180.0])
def test_froude_krylov_load_on_a_spheroid(spheroid, length, heading):
    wave = regular(2.0, length, np.radians(heading), RHO, G)
    for attitude in ((0.0, 0.0, 0.0), (0.2, -0.15, 0.5)):
        y = _state(15.0, attitude)
        found, expected = [], []
        for time in (0.0, 0.5 * np.pi / wave.frequency[0]):
            out = np.zeros(6)
            froude_krylov(wave, spheroid, y, time, out)
            found.append(out)
            expected.append(_closed_form(wave, y, time))
        size = RHO * spheroid.volumes.sum() * wave.frequency[0] ** 2 * np.exp(-wave.number[0] * 15.0)
        floor = 1e-3 * size * np.array([1.0, 1.0, 1.0, B, A / 2, A / 2])
        miss = np.linalg.norm(np.subtract(found, expected), axis=0)
        # A body of revolution has no K; four points a section leave (k b)^2 / 50 of F b.
        floor[3] += (wave.number[0] * B) ** 2 / 50.0 * B * np.linalg.norm(expected, axis=0)[:3].max()
        assert (miss < 3e-3 * np.linalg.norm(expected, axis=0) + floor).all()


@pytest.mark.parametrize("radii", [0.2, 0.5, 1.0])
def test_on_a_sphere_it_is_the_acceleration_at_the_centre(tmp_path, radii):
    """Mean-value property of harmonic functions, whatever k R; and no moment."""
    mesh = _spheroid(tmp_path / "sphere", 4.0, 4.0, 61)
    exact = 4.0 / 3.0 * np.pi * 64.0
    points = quadrature(mesh, 2.0 * np.pi * 4.0 / radii, displaced=exact)
    wave = regular(1.0, 2.0 * np.pi * 4.0 / radii, 0.6, RHO, G)
    y, out = _state(9.0, (0.3, 0.2, 1.0)), np.zeros(6)
    froude_krylov(wave, points, y, 2.0, out)
    expected = RHO * exact * kinematics(wave, y[6:9], 2.0).acceleration @ rotation(*y[9:])
    assert out[:3] == pytest.approx(expected, abs=5e-3 * np.linalg.norm(expected))
    assert np.linalg.norm(out[3:]) < 5e-3 * (1.0 + 5.0 * radii**2) * 4.0 * np.linalg.norm(expected)


def test_a_plane_wave_over_a_spheroid(spheroid):
    """int cos(k x) dV = V 3 (sin ka - ka cos ka) / (ka)^3."""
    for k in (0.03, 0.1, 0.2):
        phase = k * A
        expected = 3.0 * (np.sin(phase) - phase * np.cos(phase)) / phase**3
        found = spheroid.volumes @ np.cos(k * spheroid.points[:, 0]) / spheroid.volumes.sum()
        assert found == pytest.approx(expected, abs=1e-3)


def _lamb():
    e = np.sqrt(1.0 - (B / A) ** 2)
    log = np.log((1.0 + e) / (1.0 - e))
    alpha = 2.0 * (1.0 - e * e) / e**3 * (0.5 * log - e)
    beta = 1.0 / e**2 - (1.0 - e * e) / (2.0 * e**3) * log
    return np.array([alpha / (2.0 - alpha), beta / (2.0 - beta), beta / (2.0 - beta)])


def _total(sea, y, time):
    """Froude-Krylov plus added-mass load of the waves."""
    sums = wave_loads.passage(sea)
    value, slope = np.zeros(sums.value.shape[1]), np.zeros(sums.value.shape[1])
    wave_loads.evaluate(sea, y, time, sums, value, slope)
    return value[:6] + slope[6:12], value


@pytest.mark.parametrize("length", [62.0, 147.0, 350.0])
@pytest.mark.parametrize("heading", [0.0, 55.0, 90.0, 160.0])
def test_whole_load_on_a_spheroid_is_one_plus_lambs_coefficients(spheroid, length, heading):
    """Added mass spread like the volume is exact for an ellipsoid."""
    wave = regular(2.0, length, np.radians(heading), RHO, G)
    masses = RHO * np.outer(spheroid.volumes, _lamb())
    sea = wave_loads.make_sea(wave, spheroid, spheroid.points, masses, NOTHING)
    y = _state(15.0, (0.0, 0.1, 0.3))
    size = RHO * spheroid.volumes.sum() * wave.frequency[0] ** 2 * np.exp(-wave.number[0] * 15.0)
    for time in (0.0, 1.5):
        expected = (1.0 + _lamb()) * _closed_form(wave, y, time)[:3]
        assert _total(sea, y, time)[0][:3] == pytest.approx(expected, abs=4e-3 * size)


def test_lambs_coefficients_are_the_printed_ones():
    """Slenderness 7.5 lies between Lamb's rows for 6.97 (0.036, 0.933) and 8.01 (0.029, 0.945)."""
    k = _lamb()
    assert 0.029 < k[0] < 0.036
    assert 0.933 < k[1] < 0.945


def _strips(count):
    """A spheroid's added mass in strips, c m = k rho A dx at the strips' own centroids."""
    edges = np.linspace(-A, A, count + 1)
    area = [np.pi * B * B * np.array([x - x**3 / (3 * A * A), x * x / 2 - x**4 / (4 * A * A)]) for x in edges]
    moments = np.diff(area, axis=0)
    centres = np.zeros((count, 3))
    centres[:, 0] = moments[:, 1] / moments[:, 0]
    return centres, RHO * np.outer(moments[:, 0], _lamb())


def test_fifteen_sections_carry_the_load_of_waves_longer_than_the_boat(spheroid):
    """Lumped strips (Table 6 has 15) against the spread added mass: 1 % for waves over a boat's length."""
    centres, masses = _strips(15)
    for length in (62.0, 147.0, 350.0):
        wave = regular(2.0, length, np.radians(30.0), RHO, G)
        lumped = wave_loads.make_sea(wave, spheroid, centres, masses, NOTHING)
        spread = wave_loads.make_sea(
            wave, spheroid, spheroid.points, RHO * np.outer(spheroid.volumes, _lamb()), NOTHING
        )
        y = _state(15.0)
        a, b = (
            np.array([_total(s, y, t)[0] for t in (0.0, 0.25 * 2 * np.pi / wave.frequency[0])])
            for s in (lumped, spread)
        )
        amplitude = np.linalg.norm(b, axis=0)
        for k in (0, 1, 2, 4, 5):
            assert np.linalg.norm(a - b, axis=0)[k] < 0.015 * amplitude[k], (length, k)


def test_long_waves_carry_a_neutral_boat_like_water(spheroid):
    """F = (1 + k) rho V a: divided by mass plus added mass it is the water's acceleration, at every phase."""
    wave = regular(2.0, 200.0 * A, np.radians(35.0), RHO, G)
    centres, masses = _strips(15)
    sea = wave_loads.make_sea(wave, spheroid, centres, masses, NOTHING)
    mass = RHO * spheroid.volumes.sum()
    for time in np.linspace(0.0, 2.0 * np.pi / wave.frequency[0], 5):
        load, value = _total(sea, _state(20.0), time)
        water = kinematics(wave, _state(20.0)[6:9], time)
        scale = wave.frequency[0] ** 2
        assert load[:3] / (mass + masses.sum(axis=0)) == pytest.approx(water.acceleration, abs=1e-3 * scale)
        assert value[12:15] == pytest.approx(water.velocity, abs=1e-3 * wave.frequency[0])


@pytest.mark.parametrize("heading", [0.0, 70.0, 180.0])
def test_the_load_decays_as_exp_kz(spheroid, heading):
    wave = regular(2.0, 120.0, np.radians(heading), RHO, G)
    sea = wave_loads.make_sea(wave, spheroid, *_strips(15), NOTHING)
    shallow, deep = (_total(sea, _state(z, (0.1, 0.1, 0.0)), 1.0)[0] for z in (10.0, 73.0))
    assert deep == pytest.approx(shallow * np.exp(-wave.number[0] * 63.0), rel=1e-9)


def test_head_and_following_seas_are_mirror_images_at_zero_speed(spheroid):
    """Fore-and-aft symmetric body, crest at its middle at t = 0: X and M change sign, Z does not."""
    y = _state(12.0)
    y[6:8] = 0.0
    for time in (0.0, 1.0, 3.3):
        loads = []
        for heading in (0.0, np.pi):
            sea = wave_loads.make_sea(regular(2.0, 90.0, heading, RHO, G), spheroid, *_strips(15), NOTHING)
            loads.append(_total(sea, y, time)[0])
        assert loads[0] == pytest.approx(loads[1] * [-1, 1, 1, 1, -1, 1], abs=1e-5 * np.abs(loads[0]).max())


def test_short_waves_in_components_do_not_reach_a_deep_boat(spheroid):
    """Ten metre waves at 40 m: exp(-25)."""
    waves = make_waves(np.ones(3), np.full(3, np.sqrt(G * 2 * np.pi / 10.0)), np.arange(3.0), np.zeros(3), RHO, G)
    sea = wave_loads.make_sea(waves, spheroid, *_strips(15), NOTHING)
    assert np.abs(_total(sea, _state(40.0), 0.0)[0][:3]).max() < 1e-9 * RHO * G * spheroid.volumes.sum()
