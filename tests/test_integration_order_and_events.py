"""The maneuver loop: fourth order, agreement with DOP853, zigzag events, actuator limits."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from sim.boat.coefficients import Coefficients
from sim.boat.database import axis_columns
from sim.flight import maneuver
from sim.flight.case import load_case
from sim.flight.simulate import initial_state, plane_limits, settings_of, simulate
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace

# Appended SUBOFF derivatives (model.md section 10), and round values where it names none.
SMOOTH = {
    **{"X_uu": -1.0e-3, "Y_v": -0.0278, "N_v": -0.0136, "Y_ur": 0.0053, "N_ur": -0.0044},
    **{"Z_w": -0.0139, "M_w": 0.0103, "Z_uq": -0.0075, "M_uq": -0.0037, "K_up": -1.0e-4, "K_v": -5.0e-4},
    **{"X_wq": 2.0e-4, "X_vr": -3.0e-4, "N_wp": 1.0e-4, "Y_wp": 2.0e-4},
}


@pytest.fixture(scope="module")
def smooth(campaign, rows, environment):
    """A model without kinks: constant coefficients, monomials without absolute values."""
    vehicle = campaign.vehicle.model_copy(update={"term_set": "gertler_hagen"})
    constant = pd.DataFrame([{"coefficient": k, "part": "hull", "value": v} for k, v in SMOOTH.items()])
    sections = rows.loc[rows["coefficient"].str.endswith("_section"), ["coefficient", "part", "value"]]
    table = pd.concat([constant, sections], ignore_index=True).reindex(
        columns=["coefficient", "part", "value", *axis_columns()]
    )
    return assemble(Coefficients(vehicle, table), environment)


START = np.array([5.0, 0.3, -0.2, 0.02, 0.01, -0.015, 0.0, 0.0, 40.0, 0.15, 0.05, 0.0])


def _steps(model, state, controls, duration, step):
    work, y = workspace(model), state.copy()
    for _ in range(round(duration / step)):
        kernel.rk4(model, y, controls, np.zeros(6), step, work, y)
    return y


def _reference(model, state, controls, duration, rtol=1e-10):
    work = workspace(model)

    def f(_, y):
        out = np.zeros(12)
        kernel.rhs(model, np.ascontiguousarray(y), controls, work, out)
        return out

    return solve_ivp(f, (0.0, duration), state, method="DOP853", rtol=rtol, atol=1e-12).y[:, -1]


def test_halving_the_step_divides_the_error_by_sixteen(smooth):
    """All states together; at these steps the fifth-order part of the error is a few percent."""
    controls = np.zeros(6)
    exact = _reference(smooth, START, controls, 40.0, rtol=1e-13)
    errors = [np.linalg.norm(_steps(smooth, START, controls, 40.0, h) - exact) for h in (0.2, 0.1, 0.05)]
    assert errors[-1] > 1e-10  # well above rounding
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.10)
    assert errors[1] / errors[2] == pytest.approx(16.0, rel=0.05)


def test_halving_the_step_divides_the_error_of_the_midpoint_rule_by_four(smooth):
    controls, still = np.zeros(6), np.zeros(6)
    exact = _reference(smooth, START, controls, 40.0, rtol=1e-12)

    def flown(step):
        work, y = workspace(smooth), START.copy()
        for _ in range(round(40.0 / step)):
            kernel.rhs(smooth, y, controls, work, work.stage.start)
            args = (smooth.real, smooth.whole, y, controls, still, step, (), work.real, work.whole, work.stage)
            kernel.step(*args, kernel.MIDPOINT, y)
        return y

    errors = [np.linalg.norm(flown(h) - exact) for h in (0.1, 0.05, 0.025)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)


def _fixed_course(case, dv, dh):
    other = case.model_copy(deep=True)
    for command, value in ((other.command.dV, dv), (other.command.dH, dh)):
        command.law, command.value_deg = "fixed", value
    return other


def test_fixed_step_loop_agrees_with_dop853_on_the_smooth_model(smooth, campaign):
    """Planes at their command from the start, so nothing but the equations of motion acts."""
    case = _fixed_course(load_case("hzz20")[0], 0.0, 0.0)
    controls = np.zeros(6)
    settings = settings_of(case, campaign.vehicle, START, controls, None)
    record, _ = maneuver.fly(smooth, settings, START, controls, 0.05, 2000, 2000)
    assert record[-1, 0] == pytest.approx(100.0)
    assert record[-1, 1:13] == pytest.approx(_reference(smooth, START, controls, 100.0), rel=1e-6, abs=1e-6)


def test_fixed_step_loop_agrees_with_dop853_on_the_fitted_boat(model, campaign):
    """Same with the BB2 tables, whose slopes jump at their nodes; a turn with 4 deg of dH."""
    case = _fixed_course(load_case("hzz20")[0], 0.7, 4.0)
    vehicle = campaign.vehicle
    state, controls, trim = initial_state(case, vehicle, model)
    settings = settings_of(case, vehicle, state, controls, trim)
    controls[:5] = settings.mixer @ settings.value
    record, _ = maneuver.fly(model, settings, state, controls, 0.05, 1200, 1200)
    assert np.abs(record[-1, 1:13] - state).max() > 1.0  # it went somewhere
    assert record[-1, 1:13] == pytest.approx(_reference(model, state, controls, 60.0), rel=1e-6, abs=1e-6)


# -- zigzag ------------------------------------------------------------------------------


def _zigzag(coefficients, step, check=5.0, duration=160.0):
    """A 20/5 zigzag: the captive-only boat executes often, so there are several events."""
    case = load_case("hzz20")[0].model_copy(deep=True)
    case.command.dH.check_deg = check
    case.run.step_s, case.run.record_s, case.run.duration_s = step, step, duration
    return case, simulate(case, coefficients)


def test_execute_times_do_not_depend_on_the_sample(coefficients):
    """Samples of 0.05 and 0.02 s: without event location the execute moves by up to 0.05 s.

    What is left, below 2 ms, is the depth autopilot, which samples, and the last part sample of
    each plane's swing.
    """
    coarse, fine = (_zigzag(coefficients, h)[1].executes for h in (0.05, 0.02))
    assert len(coarse) == len(fine) >= 3
    assert np.abs(coarse[:3, 0] - fine[:3, 0]).max() < 2e-3
    assert coarse[:3, 1] == pytest.approx(np.radians([-20.0, 20.0, -20.0]))


def test_heading_at_each_execute_is_the_check_angle(coefficients, environment):
    """One RK4 step from the record before the event to the event, with the rates of that sample."""
    case, found = _zigzag(coefficients, 0.05)
    vehicle, model = coefficients.vehicle, assemble(coefficients, environment)
    settings = settings_of(case, vehicle, found.record[0, 1:13], found.record[0, 13:19], found.trim)
    work, y = workspace(model), np.zeros(12)
    limit, rate_limit = plane_limits(vehicle)
    for time, command in found.executes[1:]:
        i = int(time // 0.05)
        row = found.record[i]
        planes, wanted = row[13:18], settings.mixer @ row[-2:]
        rate = np.clip((np.clip(wanted, -limit, limit) - planes) / 0.05, -rate_limit, rate_limit)
        controls = np.append(planes, row[18])
        kernel.rk4(model, row[1:13], controls, np.append(rate, 0.0), time - row[0], work, y)
        # Reversing to +20 deg happens at -5 deg of heading, and the other way round.
        assert y[11] == pytest.approx(-np.sign(command) * np.radians(5.0), abs=5e-8)
    assert len(found.executes) >= 3


def test_first_execute_is_at_time_zero_with_the_first_command(coefficients):
    _, found = _zigzag(coefficients, 0.05, duration=1.0)
    assert found.executes.tolist() == [[0.0, pytest.approx(np.radians(-20.0))]]


# -- actuators ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("dv", "dh"), [("pid", "zigzag"), ("fixed", "fixed")], ids=["zigzag 20/5", "both commands at full"]
)
def test_planes_never_exceed_their_rate_or_angle(coefficients, dv, dh):
    """30 deg and 7.11 deg/s from the released actuators, at every 0.05 s sample."""
    case, _ = _zigzag(coefficients, 0.05, duration=1.0)
    case.run.duration_s = 60.0
    if dv == "fixed":
        case = _fixed_course(case, 30.0, -30.0)
    found = simulate(case, coefficients)
    planes = np.degrees(found.record[:, 13:18])
    rates = np.diff(planes, axis=0) / np.diff(found["t"])[:, None]
    assert np.abs(rates).max() <= 7.11 * (1.0 + 1e-9)
    assert np.abs(rates).max() == pytest.approx(7.11, rel=1e-6)  # the limit is reached
    assert np.abs(planes).max() <= 30.0 * (1.0 + 1e-12)
    if dv == "fixed":
        # dV + dH asks 60 deg of two planes: they stand at 30; the other two get none.
        assert sorted(np.abs(planes[-1])) == pytest.approx([0.0, 0.0, 30.0, 30.0, 30.0], abs=1e-9)


def test_a_plane_takes_its_travel_over_its_rate(coefficients):
    """From trim to 20 deg at 7.11 deg/s: straight line, then still."""
    case = _fixed_course(load_case("hzz20")[0], 0.0, 20.0)
    case.run.duration_s, case.run.record_s = 6.0, 0.05
    found = simulate(case, coefficients)
    angle = np.degrees(found["stern_plane_2"])
    expected = np.minimum(angle[0] + 7.11 * found["t"], 20.0)
    assert angle == pytest.approx(expected, abs=1e-9)
