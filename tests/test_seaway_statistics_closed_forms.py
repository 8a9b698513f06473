"""Authority: closed forms. Rice (1944), Longuet-Higgins (1952), Gaussian processes of known
spectra, AR(1), sums of sines.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from flights_in_waves import gaussian, made_flight
from scipy.signal import lfilter

from ident.metrics.exceedance import exceedances, extreme, rice_rate
from ident.metrics.seaway import encountered, spectrum, statistics, statistics_of, zero_crossing
from ident.validation.wave_figures import exceedance_figure, seaway_figure, spectrum_figure
from sim.files.errors import InputError
from sim.waves.linear import regular
from sim.waves.spectra import Spectrum, bretschneider, moments, realise

GRID = np.linspace(1e-3, 2.0 * math.pi, 100001)


def sea(omega):
    return bretschneider(omega, 4.0, 0.6)


@pytest.fixture(scope="module")
def hours():
    """Twenty-five hours of the sea, an hour at a time."""
    return [statistics_of(*gaussian(sea, 3600.0, 0.5, seed)) for seed in range(25)]


def test_standard_deviation_and_its_error(hours):
    """Var(s^2) = 2 pi / T int S^2 d(omega) of a Gaussian process."""
    sigma, stated = np.array([h.sigma for h in hours]), np.array([h.sigma_stderr for h in hours])
    error = math.sqrt(2.0 * math.pi / 3600.0 * np.trapezoid(sea(GRID) ** 2, GRID)) / 2.0
    assert np.mean(stated) == pytest.approx(error, rel=0.1)
    assert np.mean(sigma) == pytest.approx(1.0, abs=3.0 * error / math.sqrt(25))
    # The scatter of 25 is known to 14 %.
    assert np.std(sigma) == pytest.approx(error, rel=0.42)
    assert hours[0].significant == 4.0 * hours[0].sigma


def test_moments_and_periods_of_the_spectrum(hours):
    """Welch moments are those of the target; counted and Rice's period agree with it."""
    target = moments(GRID, sea(GRID), (0, 1, 2, 4))
    assert np.mean([h.moments for h in hours], axis=0) == pytest.approx(target, rel=0.03)
    period = 2.0 * math.pi * math.sqrt(target[0] / target[2])
    assert np.mean([h.rice_period for h in hours]) == pytest.approx(period, rel=0.01)
    counted = np.array([h.period for h in hours])
    # Linear interpolation between half seconds loses the shortest waves.
    assert np.mean(counted) == pytest.approx(period, rel=0.02)
    # Cut off at the sampling frequency, nu is that of the moments above.
    nu = math.sqrt(target[0] * target[2] / target[1] ** 2 - 1.0)
    assert np.mean([h.bandwidth for h in hours]) == pytest.approx(nu, rel=0.05)


@pytest.mark.parametrize("side", ["above", "below"])
def test_crossings_are_those_of_rice(hours, side):
    """Counts of 25 h at one, two and three sigma within three errors of the closed form."""
    target = moments(GRID, sea(GRID))
    sense = 1.0 if side == "above" else -1.0
    for away in (1.0, 2.0, 3.0):
        rate = 3600.0 / (2.0 * math.pi) * math.sqrt(target[2] / target[0]) * math.exp(-0.5 * away**2 / target[0])
        each = [exceedances(h, [sense * away], side)[0] for h in hours]
        counts = np.array([e.count for e in each])
        scatter = max(np.std(counts, ddof=1), math.sqrt(rate)) / 5.0
        assert counts.mean() == pytest.approx(rate, abs=3.0 * scatter)
        predicted, stated = np.array([e.predicted for e in each]), np.array([e.predicted_stderr for e in each])
        assert predicted.mean() == pytest.approx(rate, rel=0.1)
        assert np.std(predicted) < 2.0 * stated.mean()
        assert rice_rate(hours[0], sense * away) == each[0].predicted


def test_extreme_of_an_hour(hours):
    """Mean of 25 hourly maxima beside the expected one; their scatter is pi/sqrt(6)/sqrt(2 ln n)."""
    target = moments(GRID, sea(GRID))
    n = 3600.0 / (2.0 * math.pi) * math.sqrt(target[2] / target[0])
    root = math.sqrt(2.0 * math.log(n))
    highest = np.array([h.deviation.max() for h in hours])
    expected = np.mean([extreme(h, 1.0, "above")["expected"] for h in hours])
    scatter = math.pi / math.sqrt(6.0) / root
    assert expected == pytest.approx(root + 0.5772 / root, rel=0.02)
    assert highest.mean() == pytest.approx(expected, abs=3.0 * scatter / 5.0)
    one = extreme(hours[0], 1.0, "above", risk=1.0 - math.exp(-1.0))
    assert one["at_risk"] == pytest.approx(one["most_probable"])
    low = extreme(hours[0], 1.0, "below")
    assert low["at_risk"] < low["expected"] < low["most_probable"] < hours[0].mean
    with pytest.raises(InputError, match="risk"):
        extreme(hours[0], 1.0, risk=1.0)
    with pytest.raises(InputError, match="hours"):
        extreme(hours[0], 0.0)


def test_narrow_band_heights_are_rayleigh():
    """The mean of the highest third is 4.004 sigma (Longuet-Higgins 1952), the period that of the peak."""

    def narrow(omega):
        return np.exp(-0.5 * ((omega - 0.8) / 0.03) ** 2) / (0.03 * math.sqrt(2.0 * math.pi))

    ratios, stated, periods = [], [], []
    for seed in range(12):
        found = statistics_of(*gaussian(narrow, 7200.0, 0.25, seed))
        ratios.append(found.third_highest / found.significant)
        stated.append(found.sigma_stderr / found.sigma)
        periods.append(found.period)
        assert found.bandwidth < 0.1
    assert np.mean(periods) == pytest.approx(2.0 * math.pi / 0.8, rel=0.005)
    assert np.mean(ratios) == pytest.approx(4.004 / 4.0, rel=0.015)
    # The envelope is correlated for long; int S^2 = 1 / (2 sqrt(pi) s).
    error = math.sqrt(2.0 * math.pi / 7200.0 / (2.0 * math.sqrt(math.pi) * 0.03)) / 2.0
    assert np.mean(stated) == pytest.approx(error, rel=0.2)


def test_error_of_the_standard_deviation_of_ar1():
    """Var(s^2) = 2/n gamma_0^2 (1 + phi^2) / (1 - phi^2), exact for long records."""
    phi, n = 0.9, 4000
    noise = np.random.default_rng(5).standard_normal((30, n + 500))
    series = lfilter([1.0], [1.0, -phi], noise, axis=1)[:, 500:]
    found = [statistics_of(np.arange(n) * 1.0, 3.0 + y) for y in series]
    sigma = 1.0 / math.sqrt(1.0 - phi**2)
    error = sigma * math.sqrt((1.0 + phi**2) / (1.0 - phi**2) / (2.0 * n))
    assert np.mean([f.sigma for f in found]) == pytest.approx(sigma, abs=3.0 * error / math.sqrt(30))
    assert np.mean([f.sigma_stderr for f in found]) == pytest.approx(error, rel=0.15)
    mean_error = 1.0 / (1.0 - phi) / math.sqrt(n)
    assert np.mean([f.mean_stderr for f in found]) == pytest.approx(mean_error, rel=0.15)


def test_spectrum_of_ar1():
    """S = dt / (pi |1 - phi exp(-i omega dt)|^2) within the errors of the segments."""
    phi, step = 0.5, 0.5
    series = lfilter([1.0], [1.0, -phi], np.random.default_rng(6).standard_normal(60000))
    found = spectrum(series, step, 0.2)
    exact = step / math.pi / np.abs(1.0 - phi * np.exp(-1j * found.frequency * step)) ** 2
    ratio = (found.density / exact)[2:-2]
    assert ratio.mean() == pytest.approx(1.0, abs=0.01)
    assert ratio.std() < 2.0 / math.sqrt(found.segments)
    assert found.resolution == pytest.approx(0.2, rel=0.02)
    with pytest.raises(InputError, match="resolution"):
        spectrum(series[:50], step, 1e-3)


def test_sum_of_sines():
    """sigma^2 = sum a^2/2; m2 = sum a^2 omega^2/2; drift and mean come back."""
    time = np.arange(0.0, 2000.0, 0.2)
    amplitude, omega = np.array([1.0, 0.6]), np.array([0.7, 1.1])
    value = sum(a * np.cos(w * time + w) for a, w in zip(amplitude, omega, strict=True))
    found = statistics_of(time, 5.0 + 2e-4 * (time - 1000.0) + value, "D0", "m")
    assert found.sigma == pytest.approx(math.sqrt(0.68), rel=2e-3)
    assert found.moments[0] == pytest.approx(0.68, rel=0.01)
    assert found.moments[2] == pytest.approx(0.5 * (amplitude**2 * omega**2).sum(), rel=0.02)
    assert found.mean == pytest.approx(5.0, abs=5e-3)
    assert found.drift == pytest.approx(0.4, abs=0.02)
    assert all(math.isfinite(v) for v in found.as_json().values() if isinstance(v, float))


def test_crossings_of_one_sine_are_counted():
    """A sine passes every level below its amplitude once a period, for arccos(l/a)/pi of the time."""
    time = np.arange(0.0, 1000.0, 0.05)
    found = statistics_of(time, 10.0 + 2.0 * np.sin(2.0 * math.pi * time / 8.0), "D0", "m")
    low, never = exceedances(found, [9.0, 7.9], "below")
    assert low.count == 125
    assert low.per_hour == pytest.approx(450.0, rel=1e-3)
    assert low.share == pytest.approx(1.0 / 3.0, abs=1.0 / 160.0)
    assert (never.count, never.share) == (0, 0.0)
    period, heights = zero_crossing(time, found.deviation)
    assert period == pytest.approx(8.0, rel=1e-4)
    assert heights == pytest.approx(4.0, rel=1e-3)


def test_encountered_surface_has_the_frequency_of_encounter():
    """Head seas of 140.9 m at 5 m/s: one line at omega + k U, of variance a^2/2."""
    wave = regular(3.0, 140.9, math.pi, 1025.0, 9.81)
    time = np.arange(0.0, 1200.0, 0.1)
    flown = made_flight(time, x=5.0 * time)
    at, elevation = encountered(wave, flown, step=0.4, start=100.0)
    assert (at[0], at[1] - at[0]) == pytest.approx((100.0, 0.4))
    found = spectrum(elevation, 0.4)
    k = 2.0 * math.pi / 140.9
    peak = found.frequency[np.argmax(found.density)]
    assert peak == pytest.approx(math.sqrt(9.81 * k) + 5.0 * k, abs=found.resolution)
    assert found.moments()[0] == pytest.approx(1.5**2 / 2.0, rel=0.02)


def test_what_has_no_statistics_is_refused():
    time = np.arange(0.0, 100.0, 0.2)
    with pytest.raises(InputError, match="zero crossings"):
        statistics_of(time, 0.0 * time)
    with pytest.raises(InputError, match="steps that are not equal"):
        statistics_of(time**1.1, np.sin(time))
    with pytest.raises(InputError, match="not finite"):
        statistics_of(time, np.where(time > 50.0, np.nan, np.sin(time)))
    with pytest.raises(InputError, match="channel 'depth'"):
        statistics(made_flight(time, z=np.sin(time)), ("depth",))


def test_figures_are_drawn(tmp_path):
    """Every figure of an irregular sea from one flight."""
    waves = realise(Spectrum("bretschneider", 3.25, 9.7, math.pi), 60, 3, 1025.0, 9.81)
    time = np.arange(0.0, 1800.0, 0.5)
    flown = made_flight(time, x=2.0 * time)
    at, eta = encountered(waves, flown)
    flown = made_flight(time, x=2.0 * time, z=15.0 - 0.8 * eta, theta=0.01 * eta, phi=0.002 * eta)
    found = statistics(flown)
    stamp = "database version 0"
    one = seaway_figure(flown, found, tmp_path / "history.png", "Made sea", stamp)
    two = spectrum_figure(found, (at, eta), tmp_path / "spectrum.png", "Made sea", stamp)
    three = exceedance_figure(found["D0"], tmp_path / "exceedance.png", "Made sea", stamp, level=0.0)
    assert all(p.read_bytes()[:4] == b"\x89PNG" for p in (one, two, three))
