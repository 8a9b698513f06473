"""Authority: known paths. An angle and a rate of unknown scale and offset give the path, and intervals that hold it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.metrics.zigzag import zigzag
from ident.timeseries.noise import Samples
from ident.timeseries.scaled_rate import smooth_with_rate

ANGLE, RATE, PEAK_S = 0.05, 0.02, 30.0


def push(t):
    """A course left by eight degrees and found again, and its rate: s, deg, deg/s."""
    away = 8.0 * np.exp(-(((t - PEAK_S) / 8.0) ** 2))
    return away, -2.0 * (t - PEAK_S) / 64.0 * away


@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1.01, 0.02), (0.99, -0.05)])
def test_the_peak_is_neither_raised_nor_lowered_by_a_noisy_rate(scale, offset):
    """A slope read against a noisy rate is too small by a percent here, the peak then too high by it."""
    t = np.arange(0.0, 120.0, 0.5)
    angle, rate = push(t)
    rng = np.random.default_rng(5)
    away = []
    for _ in range(60):
        noisy = Samples(t, angle + ANGLE * rng.standard_normal(t.size), 0, ANGLE)
        measured = Samples(t, scale * rate + offset + RATE * rng.standard_normal(t.size), 1, RATE)
        path = smooth_with_rate(noisy, measured, 0.02)
        away.append(float(path(PEAK_S) - 8.0) / float(path.deviation(PEAK_S)[0]))
    assert abs(np.mean(away)) < 3.0 / np.sqrt(60)
    assert np.mean(np.abs(away) < 1.96) >= 0.87
    assert np.std(away) == pytest.approx(1.0, abs=0.3)


def test_draws_carry_the_error_of_the_scale():
    t = np.arange(0.0, 120.0, 0.5)
    angle, rate = push(t)
    path = smooth_with_rate(Samples(t, angle, 0, ANGLE), Samples(t, rate, 1, RATE), 0.02)
    drawn = [float(one(PEAK_S)) for one in path.drawn(800, np.random.default_rng(1))]
    assert np.std(drawn) == pytest.approx(float(path.deviation(PEAK_S)[0]), rel=0.1)
    assert path_change(path) > 0.2 * float(path.deviation(PEAK_S)[0])


def path_change(path):
    """Change of the peak by one standard error of what all samples share."""
    middle = float(path(PEAK_S))
    return np.sqrt(sum((float(replace(path, mean=path.mean + one)(PEAK_S)) - middle) ** 2 for one in path.shared))


def test_a_rate_that_grows_until_the_plane_is_reversed_is_largest_there():
    """psi = t^2 deg reaches 20 deg after sqrt(20) s, at 2 sqrt(20) deg/s, between samples two seconds apart."""
    t = np.arange(0.0, 12.1, 2.0)
    fine = np.linspace(0.0, 12.0, 1201)
    rate = (t, np.radians(np.where(t < 7.0, 2.0 * t, 0.0)))
    psi = np.radians(np.where(fine < 7.0, fine**2, 49.0 - 10.0 * (fine - 7.0)))
    measured = zigzag(fine, psi, rate, np.radians(20.0), 1, "yaw")
    assert measured["execute_2_s"] == pytest.approx(np.sqrt(20.0), abs=1e-4)
    assert measured["peak_yaw_rate_1_degps"] == pytest.approx(2.0 * np.sqrt(20.0), abs=1e-3)
