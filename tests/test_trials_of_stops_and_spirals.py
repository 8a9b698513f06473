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
