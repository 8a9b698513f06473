"""Waves against linear deep-water theory (Newman 1977), published spectral moments and sampling theory."""

from __future__ import annotations

import numpy as np
import pytest

from sim.files.errors import InputError
from sim.waves.linear import Waves, kinematics, make_waves, regular
from sim.waves.spectra import Spectrum, bretschneider, jonswap, moments, realise, sea_state

RHO, G = 1025.0, 9.81
POINTS = np.array([[12.0, -30.0, 5.0], [0.0, 0.0, 0.5], [-55.0, 21.0, 14.0]])


@pytest.fixture(scope="module")
def sea() -> Waves:
    return realise(Spectrum("jonswap", 3.3, 9.7, direction=0.7, spreading=6.0), 40, 3, RHO, G)


def _slope(field, step=1e-3):
    """Central difference of fourth order of a function of a scalar."""
    return (8.0 * (field(step) - field(-step)) - (field(2 * step) - field(-2 * step))) / (12.0 * step)


def _gradient(waves, quantity, time):
    return np.stack(
        [_slope(lambda h, e=e: getattr(kinematics(waves, POINTS + h * e, time), quantity)) for e in np.eye(3)], axis=-1
    )


def test_velocity_is_the_gradient_of_the_potential_and_pressure_its_rate(sea):
    now = kinematics(sea, POINTS, 17.0)
    assert _gradient(sea, "potential", 17.0) == pytest.approx(now.velocity, abs=1e-9)
    rate = _slope(lambda h: kinematics(sea, POINTS, 17.0 + h).potential)
    assert -RHO * rate == pytest.approx(now.pressure, rel=1e-8)


def test_acceleration_is_the_rate_of_velocity_and_the_pressure_gradient(sea):
    """Euler, linearised: dv/dt = -grad p / rho."""
    now = kinematics(sea, POINTS, 17.0)
    assert _slope(lambda h: kinematics(sea, POINTS, 17.0 + h).velocity) == pytest.approx(now.acceleration, abs=1e-9)
    assert -_gradient(sea, "pressure", 17.0) / RHO == pytest.approx(now.acceleration, abs=1e-9)


def test_laplace(sea):
    """div v = 0 and curl v = 0, each against the size of its own terms."""
    jacobian = _gradient(sea, "velocity", 17.0)
    size = np.abs(jacobian).max()
    assert np.trace(jacobian, axis1=1, axis2=2) == pytest.approx(0.0, abs=1e-8 * size)
    assert jacobian - np.swapaxes(jacobian, 1, 2) == pytest.approx(0.0, abs=1e-8 * size)


def test_free_surface_conditions(sea):
    """At z = 0: p = rho g eta, and the surface rises with the water."""
    surface = POINTS * [1.0, 1.0, 0.0]
    now = kinematics(sea, surface, 4.0)
    assert now.pressure == pytest.approx(RHO * G * now.elevation, rel=1e-12)
    rise = _slope(lambda h: kinematics(sea, surface, 4.0 + h).elevation)
    assert rise == pytest.approx(-now.velocity[:, 2], abs=1e-9)


@pytest.mark.parametrize("direction", [0.0, 1.1, np.pi])
def test_pressure_and_velocity_are_in_phase(direction):
    """p = rho c v along the waves, c = omega/k: the release has them a quarter period apart."""
    wave = regular(3.25, 140.9, direction, RHO, G)
    now = kinematics(wave, POINTS, np.linspace(0.0, 10.0, 3))
    along = now.velocity @ [np.cos(direction), np.sin(direction), 0.0]
    celerity = wave.frequency[0] / wave.number[0]
    assert now.pressure == pytest.approx(RHO * celerity * along, rel=1e-12)


def test_dispersion_decay_and_orbits():
    """omega^2 = g k; 140.9 m has 9.5 s (published SS5); orbits of radius a exp(-kz)."""
    wave = regular(3.25, 140.9, 0.3, RHO, G)
    assert wave.frequency[0] ** 2 == pytest.approx(G * wave.number[0], rel=1e-14)
    assert 2.0 * np.pi / wave.frequency[0] == pytest.approx(9.5, abs=0.01)
    for z in (0.0, 10.0, 35.0):
        speed = np.linalg.norm(kinematics(wave, np.array([3.0, 4.0, z]), 1.7).velocity)
        assert speed / wave.frequency[0] == pytest.approx(1.625 * np.exp(-2.0 * np.pi / 140.9 * z), rel=1e-12)


def test_crests_travel_where_the_direction_says():
    """A crest starts at the origin and is at c t along chi."""
    wave = regular(2.0, 100.0, np.radians(120.0), RHO, G)
    celerity = np.sqrt(G * 100.0 / (2.0 * np.pi))
    place = celerity * 7.0 * np.array([np.cos(np.radians(120.0)), np.sin(np.radians(120.0)), 0.0])
    assert kinematics(wave, place, 7.0).elevation == pytest.approx(1.0, rel=1e-12)


def test_head_and_following_seas_mirror():
    north, south = regular(2.0, 80.0, 0.0, RHO, G), regular(2.0, 80.0, np.pi, RHO, G)
    a, b = kinematics(north, POINTS, 3.0), kinematics(south, POINTS * [-1.0, 1.0, 1.0], 3.0)
    assert a.pressure == pytest.approx(b.pressure, rel=1e-12)
    assert a.velocity == pytest.approx(b.velocity * [-1.0, 1.0, 1.0], abs=1e-12)


# -- spectra -------------------------------------------------------------------------------


def test_bretschneider_moments_in_closed_form():
    """m0 = Hs^2/16; m2 = m0 omega_s^2 sqrt(5 pi / 4), of Eq. (8)."""
    grid = np.geomspace(0.05, 400.0, 400001)
    m0, m2 = moments(grid, bretschneider(grid, 3.3, 0.648), (0, 2))
    assert m0 == pytest.approx(3.3**2 / 16.0, rel=1e-5)
    assert m2 == pytest.approx(3.3**2 / 16.0 * 0.648**2 * np.sqrt(1.25 * np.pi), rel=1e-4)
    assert grid[np.argmax(bretschneider(grid, 3.3, 0.648))] == pytest.approx(0.648, rel=1e-3)


@pytest.mark.parametrize("gamma", [1.0, 2.0, 3.3, 5.0])
def test_jonswap_mean_periods_are_dnvs(gamma):
    """DNV-RP-C205: Tz/Tp and T1/Tp as cubics in gamma; m0 keeps Hs."""
    grid = np.geomspace(0.1, 60.0, 60001)
    m0, m1, m2 = moments(grid, jonswap(grid, 4.0, 0.6, gamma))
    assert m0 == pytest.approx(1.0, rel=2e-3)
    tz = 0.6673 + 0.05037 * gamma - 0.006230 * gamma**2 + 0.0003341 * gamma**3
    t1 = 0.7303 + 0.04936 * gamma - 0.006556 * gamma**2 + 0.0003610 * gamma**3
    assert np.sqrt(m0 / m2) * 0.6 == pytest.approx(tz, rel=5e-3)
    assert m0 / m1 * 0.6 == pytest.approx(t1, rel=5e-3)


@pytest.mark.parametrize("kind", ["bretschneider", "jonswap"])
@pytest.mark.parametrize("components", [1, 25, 200])
def test_a_realisation_has_the_spectrums_moments(kind, components):
    spectrum = Spectrum(kind, 3.3, 9.7)
    peak = 2.0 * np.pi / 9.7
    grid = peak * np.geomspace(0.3, 20.0, 100001)
    m0, m2 = moments(grid, spectrum.density(grid), (0, 2))
    waves = realise(spectrum, components, 1, RHO, G)
    energy = 0.5 * waves.amplitude**2
    assert energy.sum() == pytest.approx(m0, rel=1e-4)
    assert energy @ waves.frequency**2 == pytest.approx(m2, rel=1e-3)
    assert 4.0 * np.sqrt(energy.sum()) == pytest.approx(3.3, rel=1e-3)


def test_a_record_has_the_significant_height_and_zero_crossings_of_its_spectrum():
    """Gaussian sea: var(m0 hat) = 2 pi int S^2 / T; crossings sqrt(m2/m0) / 2 pi a second (Rice 1944)."""
    spectrum, duration = Spectrum("bretschneider", 3.3, 9.7), 4.0 * 3600.0
    waves = realise(spectrum, 400, 11, RHO, G)
    time = np.arange(0.0, duration, 0.25)
    record = np.concatenate([kinematics(waves, np.zeros((t.size, 3)), t).elevation for t in np.array_split(time, 60)])
    grid = np.geomspace(0.2, 12.0, 20001)
    s = spectrum.density(grid)
    m0, m2 = moments(grid, s, (0, 2))
    scatter = np.sqrt(2.0 * np.pi * np.trapezoid(s**2, grid) / duration)
    assert record.var() == pytest.approx(m0, abs=3.0 * scatter)
    assert abs(record.mean()) < 0.01
    crossings = np.count_nonzero((record[:-1] < 0.0) & (record[1:] >= 0.0))
    assert crossings == pytest.approx(duration * np.sqrt(m2 / m0) / (2.0 * np.pi), rel=0.05)


@pytest.mark.parametrize("s", [1.0, 4.0, 25.0])
def test_spreading_has_the_closed_form_mean_vector(s):
    """cos^2s of the half angle: mean of cos(chi - mean) is s / (s + 1) (Longuet-Higgins et al. 1963)."""
    waves = realise(Spectrum("bretschneider", 3.3, 9.7, direction=2.0, spreading=s), 2000, 5, RHO, G)
    north, east = waves.north.mean(), waves.east.mean()
    assert np.hypot(north, east) == pytest.approx(s / (s + 1.0), abs=0.002)
    assert np.arctan2(east, north) == pytest.approx(2.0, abs=0.01)
    # Direction and frequency are independent.
    assert np.corrcoef(np.arctan2(waves.east, waves.north), waves.frequency)[0, 1] == pytest.approx(0.0, abs=0.08)


def test_long_crested_is_one_direction_and_seeds_decide_the_phases():
    spectrum = Spectrum("jonswap", 2.0, 8.0, direction=1.0)
    one, same, other = (realise(spectrum, 50, seed, RHO, G) for seed in (4, 4, 5))
    assert np.ptp(one.north) == 0.0
    assert all(np.array_equal(a, b) for a, b in zip(one, same, strict=True))
    assert not np.array_equal(one.phase, other.phase)
    assert np.array_equal(one.amplitude, other.amplitude)


def test_zero_height_is_calm():
    for calm in (realise(Spectrum("jonswap", 0.0, 8.0), 50, 1, RHO, G), regular(0.0, 100.0, 0.0, RHO, G)):
        assert calm.amplitude.size == 0
        assert not kinematics(calm, POINTS, 1.0).velocity.any()


def test_sea_states_are_the_thesis_table():
    assert [(sea_state(n).period, sea_state(n).height) for n in (2, 3, 4, 5, 6)] == [
        (6.3, 0.3),
        (7.5, 0.9),
        (8.8, 1.9),
        (9.7, 3.3),
        (12.4, 5.0),
    ]
    with pytest.raises(InputError, match="2, 3, 4, 5, 6, 7"):
        sea_state(9)


@pytest.mark.parametrize(
    ("spectrum", "count"),
    [
        (Spectrum("pierson", 1.0, 8.0), 5),
        (Spectrum("jonswap", -1.0, 8.0), 5),
        (Spectrum("jonswap", 1.0, 0.0), 5),
        (Spectrum("jonswap", 1.0, 8.0, spreading=-1.0), 5),
        (Spectrum("jonswap", 1.0, 8.0), 0),
    ],
)
def test_a_sea_that_cannot_be_is_refused(spectrum, count):
    with pytest.raises(InputError):
        realise(spectrum, count, 1, RHO, G)


def test_components_must_be_finite_and_have_frequencies():
    one = np.ones(1)
    for amplitude, frequency in ((np.nan, 1.0), (1.0, 0.0), (1.0, -1.0), (np.inf, 1.0)):
        with pytest.raises(ValueError, match="finite"):
            make_waves(amplitude * one, frequency * one, one, one, RHO, G)
