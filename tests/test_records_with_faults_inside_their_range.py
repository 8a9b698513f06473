"""Faults of a record that its range does not show: dropouts within an oscillation, leaps of phase, holes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from made_oscillations import (
    ACCELERATION,
    DAMPING,
    INERTIA,
    SPEED,
    findings,
    record,
)

from ident.captive.campaign import read_campaign
from ident.timeseries.phase import leap
from ident.timeseries.spikes import Surroundings, beside_the_way

SAMPLES = 1600


def coefficients(folder) -> tuple[float, float]:
    """Damping and added inertia in sway over the true ones, frame taken out."""
    runs = read_campaign(folder).runs
    runs = runs.set_index(runs["run_id"].str[-2:])
    damping = (runs.loc["+v", "Y"] - runs.loc["-v", "Y"]) / (2.0 * SPEED * DAMPING)
    inertia = (runs.loc["+a", "Y"] - runs.loc["-a", "Y"]) / (2.0 * ACCELERATION * INERTIA)
    return float(damping), float(inertia)


def test_the_record_gives_its_own_coefficients(tmp_path):
    assert findings(tmp_path, record(), check="channels") == []
    assert coefficients(tmp_path) == pytest.approx((1.0, 1.0), abs=1e-4)


@pytest.mark.parametrize("value", [0.0, 999.0, -32768.0])
@pytest.mark.parametrize("channel", ["Y_N", "displacement_m"])
def test_dropouts_within_the_range_are_left_out_and_named(tmp_path, channel, value):
    """Thirty of 1600 samples at one value inside of the channel's range moved the damping by 2 %."""
    table = record()
    table.loc[np.random.default_rng(5).choice(SAMPLES, 30, replace=False), channel] = value
    (finding,) = findings(tmp_path, table, check="channels")
    assert f"samples of {channel.split('_')[0]}" in finding.what
    assert coefficients(tmp_path) == pytest.approx((1.0, 1.0), abs=6e-3)


def test_flips_of_half_the_amplitude_are_spikes(tmp_path):
    table = record()
    at = np.random.default_rng(7).choice(np.arange(5, SAMPLES - 5), 20, replace=False)
    table.loc[at, "Y_N"] += 0.5 * table["Y_N"].abs().max()
    (finding,) = findings(tmp_path, table, check="channels")
    assert "20 spike samples of Y" in finding.what
    assert coefficients(tmp_path) == pytest.approx((1.0, 1.0), abs=1e-4)


def test_what_a_channel_does_all_along_is_no_spike():
    """White noise, a step, a triangle and pulses in a tenth of the samples."""
    t = np.arange(4000)
    noise = np.random.default_rng(3).standard_normal(4000)
    for column in (noise, np.where(t < 2000, 0.0, 50.0) + noise, np.abs(t % 40 - 20.0), 50.0 * (t % 10 == 0) + noise):
        usual = Surroundings()
        usual.feed(column)
        assert not beside_the_way(column, usual.limit(float(np.ptp(column)))).any()


def test_three_samples_of_a_sine_that_are_zero_are_told_from_those_that_pass_it():
    column = np.sin(2.0 * math.pi * np.arange(2000) / 80.0)
    column[[100, 420, 421, 901]] = 0.0
    usual = Surroundings()
    usual.feed(column)
    found = np.flatnonzero(beside_the_way(column, usual.limit(2.0)))
    assert found.tolist() == [100, 420, 421, 901]


@pytest.mark.parametrize("seconds", [0.6, 1.3, 7.0])
def test_a_clock_that_jumps_is_an_error(tmp_path, seconds):
    """The phase behind it leaps by 360 deg times frequency times jump, whole turns apart."""
    table = record()
    table.loc[800:, "time_s"] += seconds
    errors = [f for f in findings(tmp_path, table, check="motion") if f.severity == "error"]
    degrees = math.degrees(abs(math.remainder(2.0 * math.pi * 0.25 * seconds, 2.0 * math.pi)))
    assert len(errors) == 1
    leapt = float(errors[0].what.split("leaps by ")[1].split()[0])
    assert leapt == pytest.approx(degrees, abs=8.0)


def test_a_leap_is_that_of_the_phase_and_a_wrong_frequency_makes_none():
    time = np.arange(0.0, 80.0, 0.05)
    turned = 2.0 * math.pi * 0.25 * time + np.where(time > 40.0, math.radians(25.0), 0.0)
    found = leap(time, np.sin(turned), np.ones(time.size), 0.25)
    assert found is not None
    assert (found.degrees, found.time) == (pytest.approx(25.0, abs=0.1), pytest.approx(40.0, abs=4.0))
    assert leap(time, np.sin(2.0 * math.pi * 0.2515 * time), np.ones(time.size), 0.25) is None


@pytest.mark.parametrize("channel", ["Y_N", "displacement_m"])
def test_samples_left_out_make_no_lag(tmp_path, channel):
    """A filter over what is left shifted it by the hole: 0.03 s of a lag that was not there."""
    table = record().astype(object)
    table.loc[[100, 500, 501], channel] = "NaN"
    assert findings(tmp_path, table, 'missing = ["NaN"]\n', check="delay") == []
