"""Authority: exact flights. Every maneuver, flown by the simulator and recorded with noise, gives the flight's metrics.

The truth is what ``ident validate`` measures on the flight, by the same names; the record has the noise of good
instruments, 2 Hz, a course of 030 and, where it is made under way, half a minute of approach. How often the stated
intervals hold over many records is the table of docs/trials.md, made by ``python tests/trial_flights.py``.
"""

from __future__ import annotations

import numpy as np
import pytest
from trial_flights import MANEUVERS, approach_of, errors, flown, recorded

from ident.trials.spec import TrialFile
from ident.trials.trial import measure_trial

# What a metric may be off by and still be of use, by its unit: shares of the value, and that much.
SHARE, LEAST = 0.05, {"deg": 0.1, "s": 1.0, "m": 1.0, "deg/s": 0.03, "m/s": 0.02, "%": 1.0, "-": 0.02}
# The first overshoot out of the band of 5 % is 4.8 % of the step: noise decides when it has settled.
UNDECIDED = {"settling_5_percent_s", "pitch_rate_peak_at_s"}
IN_MINUTES = ("hzz20", "turning-circle")  # test_trials_give_the_exact_flight.py has these


@pytest.fixture(scope="module")
def flight_of(coefficients):
    known = {}

    def fly(name):
        if name not in known:
            known[name] = flown(name, coefficients)
        return known[name]

    return fly


@pytest.mark.parametrize("name", [n for n in MANEUVERS if n not in IN_MINUTES])
def test_the_record_gives_the_flights_metrics_within_their_errors(flight_of, tmp_path, name):
    one = flight_of(name)
    words, stated = MANEUVERS[name]
    spec = TrialFile(maneuver=words, execute_s=approach_of(one), **stated)
    metrics = measure_trial(recorded(one, tmp_path, 100), spec, 20).metrics
    assert len(one.truth) >= 2
    for metric, value in one.truth.items():
        found = metrics[metric]
        assert abs(found.value - value) < 4.0 * found.sigma, (metric, value, found)
        if metric not in UNDECIDED:
            assert found.sigma < SHARE * abs(value) + LEAST[found.unit], (metric, found)


@pytest.mark.parametrize("name", ["vzz10-10kt", "max-q"])
def test_stated_intervals_hold_over_several_records(flight_of, tmp_path, name):
    away = np.array([list(z.values()) for z in errors(flight_of(name), tmp_path, range(200, 204), 20)])
    # Metrics of one record share their errors: 95 % of a few records is 4 in 5 here.
    assert np.mean(np.abs(away) < 1.96) >= 0.8
    assert 0.4 < np.sqrt(np.mean(away**2)) < 1.5
    assert np.abs(away).max() < 4.5


def test_a_rise_ends_where_the_nose_comes_to_the_surface(flight_of, tmp_path):
    """A point above the nose comes up before the record ends."""
    one = flight_of("max-q")
    path = recorded(one, tmp_path, 7)
    point = (32.33, 0.0, -3.0)
    spec = TrialFile(maneuver="rise", execute_s=30.0, surface_point_m=point)
    flight = one.flight
    depth = flight["z"] - np.sin(flight["theta"]) * point[0] + np.cos(flight["theta"]) * point[2]
    below = int(np.argmax(depth <= 0.0))
    assert depth[below] <= 0.0
    exact = np.interp(0.0, -depth[below - 1 : below + 1], flight["t"][below - 1 : below + 1])
    found = measure_trial(path, spec, 20).metrics["nose_at_surface_s"]
    assert abs(found.value - exact) < 3.5 * found.sigma < 1.0
    path.write_text(path.read_text("utf-8").replace("u [m/s]", "speed [m/s]", 1), "utf-8")
    assert any("speed ratio is that of speed [m/s]" in text for text in measure_trial(path, spec, 10).assumed)


def test_pitch_counts_from_level_or_from_the_trim_by_which_the_planes_are_reversed(flight_of, tmp_path):
    """The boat is trimmed by half a degree; its planes are reversed at ten degrees from level."""
    one = flight_of("vzz10-10kt")
    path = recorded(one, tmp_path, 3)
    spec = TrialFile(maneuver="vertical zigzag 10/10", execute_s=30.0)
    done = measure_trial(path, spec, 10)
    assert any("pitch counts from level: plane" in text for text in done.assumed)
    trimmed = TrialFile.model_validate(spec.model_dump() | {"initial": {"pitch_deg": -0.47}})
    other = measure_trial(path, trimmed, 10).metrics["overshoot_1_deg"].value
    assert other - done.metrics["overshoot_1_deg"].value == pytest.approx(0.47, abs=0.05)
