"""Authority: exact flights. Every maneuver, flown by the simulator and recorded with noise, gives the flight's metrics.

The truth is what ``ident validate`` measures on the flight; the record has the noise of good instruments, 2 Hz, a
course of 030 and, where it is made under way, half a minute of approach.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from trial_records import turned, write

from ident.metrics.measure import measured
from ident.trials.spec import TrialFile
from ident.trials.trial import measure_trial
from sim.flight.case import load_case
from sim.flight.simulate import simulate

COUNT = 40
NOISE = {"psi [deg]": 0.05, "r [deg/s]": 0.005, "phi [deg]": 0.02, "theta [deg]": 0.02, "u [m/s]": 0.01}
NOISE |= {"depth [m]": 0.02, "x_north [m]": 0.3, "y_east [m]": 0.3, "rudder [deg]": 0.02, "plane [deg]": 0.02}


@pytest.fixture(scope="module")
def flown(coefficients):
    """Case name -> the flight and its metrics."""
    known = {}

    def fly(name):
        if name not in known:
            case, reference = load_case(name)
            flight = simulate(case, coefficients)
            metrics = measured(case, flight, reference, {}).metrics
            known[name] = flight, {k: v["simulated"] for k, v in metrics.items() if v.get("simulated") is not None}
        return known[name]

    return fly


def recorded(flight, folder, seed: int = 1, approach: float = 30.0):
    """The flight as a trial: program channels with noise, at 2 Hz."""
    rng = np.random.default_rng(seed)
    # Twice a second; of spirals, which take hours, some thousand samples.
    step = max(1, round(0.5 / (flight["t"][1] - flight["t"][0])), flight["t"].size // 2500)
    pick = np.arange(0, flight["t"].size, step)
    t = flight["t"][pick]
    before = np.arange(0.0, approach, t[1] - t[0])
    speed = float(flight["u"][0])

    def joined(name, first=None, factor=1.0):
        values = flight[name][pick] * factor
        return np.concatenate([np.full(before.size, values[0] if first is None else first), values])

    x = np.concatenate([speed * (before - approach), flight["x"][pick]])
    north, east = turned(x, joined("y"), 30.0, (100.0, -50.0))
    degrees = math.degrees(1.0)
    columns = {"time [s]": np.concatenate([before, approach + t])}
    columns |= {"psi [deg]": joined("psi", factor=degrees) + 30.0, "r [deg/s]": joined("r", factor=degrees)}
    columns |= {"phi [deg]": joined("phi", factor=degrees), "theta [deg]": joined("theta", factor=degrees)}
    columns |= {"u [m/s]": joined("u"), "depth [m]": joined("z"), "x_north [m]": north, "y_east [m]": east}
    columns |= {"rudder [deg]": joined("dH", 0.0, degrees), "plane [deg]": joined("dV", factor=degrees)}
    columns |= {"n [rpm]": joined("n", float(flight["n"][0]), 60.0)}
    n = columns["time [s]"].size
    noisy = {k: v + NOISE.get(k, 0.0) * rng.standard_normal(n) for k, v in columns.items()}
    return write(folder / "record.csv", noisy)


CASES = {
    "crash-stop": ("stopping", ("time_to_stop_s", "track_reach_m", "head_reach_m", "lateral_deviation_m")),
    "direct-spiral": ("direct spiral", ("yaw_rate_+20_deg_down_degps", "yaw_rate_-5_deg_up_degps")),
    "reverse-spiral": ("reverse spiral", ("slope_at_zero_deg_per_degps", "rudder_+0.5_degps_deg")),
    "pull-out": ("pull out", ("turn_1_degps", "residual_1_degps", "residual_difference_degps")),
    "vzz10-10kt": ("vertical zigzag 10/10", ("execute_2_s", "overshoot_1_deg", "overshoot_2_deg")),
    "depth-change": ("depth change", ("pitch_peak_deg", "overshoot_m", "rise_s")),
    "max-q": ("max-q rise", ("pitch_at_end_deg", "rise_at_end_m", "pitch_rate_peak_degps")),
    "roll-decay": ("roll decay", ("roll_period_s", "log_decrement")),
}


@pytest.mark.parametrize("name", CASES)
def test_the_record_gives_the_flights_metrics_within_their_errors(flown, tmp_path, name):
    maneuver, wanted = CASES[name]
    flight, truth = flown(name)
    at_rest = float(flight["u"][0]) == 0.0
    path = recorded(flight, tmp_path, approach=0.0 if at_rest else 30.0)
    step = case_step(name)
    spec = TrialFile(maneuver=maneuver, execute_s=0.0 if at_rest else 30.0, step_m=step)
    found = measure_trial(path, spec, COUNT)
    names = [n for n in wanted if n in truth]
    assert names, sorted(truth)
    for one in names:
        assert one in found.metrics, (one, sorted(found.metrics))
        away = found.metrics[one].value - truth[one]
        assert abs(away) < 3.5 * found.metrics[one].sigma, (one, truth[one], found.metrics[one])
        assert found.metrics[one].sigma < 0.2 * abs(truth[one]) + 0.6, (one, found.metrics[one])


def case_step(name):
    """Ordered change of depth of a case, where it has one."""
    case, _ = load_case(name)
    steps = case.command.dV.step
    return steps[-1].distance_m if case.maneuver == "depth_change" and steps else None


def test_depth_and_course_keeping_in_waves_of_noise(tmp_path):
    """Closed form: sines of known size; the root mean square is a / sqrt 2, the peak a."""
    t = np.arange(0.0, 600.0, 0.5)
    rng = np.random.default_rng(2)
    record = {"time [s]": t, "heading [deg]": 45.0 + 1.5 * np.sin(0.2 * t) + 0.05 * rng.standard_normal(t.size)}
    record |= {"depth [m]": 20.0 + 0.8 * np.sin(0.1 * t) + 0.02 * rng.standard_normal(t.size)}
    found = measure_trial(write(tmp_path / "one.csv", record), TrialFile(maneuver="course keeping"), COUNT).metrics
    for name, value in {"heading_rms_deg": 1.5 / math.sqrt(2.0), "depth_rms_m": 0.8 / math.sqrt(2.0)}.items():
        assert found[name].value == pytest.approx(value, rel=0.03)
    assert found["heading_deviation_peak_deg"].value == pytest.approx(1.5, rel=0.05)
    assert found["depth_deviation_peak_m"].value == pytest.approx(0.8, rel=0.05)
