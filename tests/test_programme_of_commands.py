"""Programmes of commands: equal to the fixed laws, events located in time, refused mistakes."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from sim.flight.case import load_case
from sim.flight.commands import Event, PlaneCommand, PlaneStep, SpeedCommand, SpeedStep
from sim.flight.simulate import simulate

DEPTH = {"P_z": 3.0, "I_z": 0.1044, "D_z": 3.0, "P_theta": 3.0, "I_theta": 0.1466, "D_theta": 3.0}


@pytest.fixture
def case():
    """The horizontal zigzag's boat on a straight course, depth held."""
    found = load_case("hzz20")[0].model_copy(deep=True)
    found.command.dH = PlaneCommand(law="fixed", value_deg=0.0)
    found.run.duration_s = 60.0
    return found


def _programme(*steps, **gains):
    return PlaneCommand(law="programme", step=[PlaneStep(**s) for s in steps], **gains)


def test_programme_of_one_command_is_the_fixed_law(case, coefficients):
    case.command.dH.value_deg = 5.0
    fixed = simulate(case, coefficients)
    case.command.dH = _programme({"value_deg": 5.0})
    case.command.n = SpeedCommand(law="programme", step=[SpeedStep(times_initial=1.0)])
    assert np.array_equal(simulate(case, coefficients).record, fixed.record)


def test_programme_that_holds_is_the_autopilot(case, coefficients):
    """Depth held while the rudder turns, so that the autopilot has work."""
    case.command.dH.value_deg = 5.0
    autopilot = simulate(case, coefficients)
    case.command.dV = _programme({"hold": True}, **DEPTH)
    assert np.array_equal(simulate(case, coefficients).record, autopilot.record)
    assert np.ptp(autopilot["dV"]) > 1e-3


def test_zigzag_written_as_steps_is_the_zigzag(coefficients):
    """dH -20 until psi < -5, 20 until psi > 5, and so on: the same events, the same path."""
    case = load_case("hzz20")[0].model_copy(deep=True)
    case.command.dH.check_deg = 5.0
    case.run.duration_s = 130.0
    zigzag = simulate(case, coefficients)
    sides = [-1.0, 1.0, -1.0, 1.0]
    until = [[{"channel": "psi", "below" if s < 0 else "above": 5.0 * s}] for s in sides]
    case.command.dH = _programme(*[{"value_deg": 20.0 * s, "until": u} for s, u in zip(sides, until, strict=True)])
    steps = simulate(case, coefficients)
    assert len(zigzag.executes) == 4
    assert steps.steps[:, 0] == pytest.approx(zigzag.executes[1:, 0], abs=1e-9)
    assert steps.record[:, 1:13] == pytest.approx(zigzag.record[:, 1:13], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("step", [0.05, 0.02])
def test_event_in_time_is_where_it_should_be(case, coefficients, step):
    """12.3456 s is no sample; the plane starts to move there, at 7.11 deg/s."""
    case.run.step_s = case.run.record_s = step
    case.command.dH = _programme({"value_deg": 0.0, "until": [{"after_s": 12.3456}]}, {"value_deg": 10.0})
    flown = simulate(case, coefficients)
    assert flown.steps[0].tolist() == [pytest.approx(12.3456, abs=1e-9), 1.0, 0.0]
    i = int(np.searchsorted(flown["t"], 12.3456)) + 3
    # Planes 1 and 2 share dV and differ by twice dH, Eq. (1).
    rudder = np.degrees(flown["stern_plane_2"][i] - flown["stern_plane_1"][i]) / 2.0
    assert rudder == pytest.approx(7.11 * (flown["t"][i] - 12.3456), abs=1e-3)


def test_event_in_a_channel_is_where_the_channel_is(case, coefficients):
    """The run ends at 30 deg of heading and at no other: to 1e-9 rad per rad/s of time."""
    case.command.dH.value_deg = 10.0
    case.run.duration_s = 300.0
    case.run.stop = [Event(channel="psi", change=30.0)]
    flown = simulate(case, coefficients)
    turned = flown.end[12] - flown.record[0, 12]
    rate = flown["r"][-1]
    assert abs(turned - np.radians(30.0)) / rate < 1e-9
    assert flown.end[0] < 300.0
    assert flown["t"][-1] <= flown.end[0] < flown["t"][-1] + case.run.record_s
    assert flown.steps[-1].tolist() == [flown.end[0], 3.0, 0.0]


def test_depth_of_a_point_ends_the_run(coefficients):
    """Max-q: the nose, 32.33 m ahead of the origin, is at the surface at the end."""
    flown = simulate(load_case("max-q")[0], coefficients)
    _, *state = flown.end
    nose = state[8] - 32.33 * np.sin(state[10])
    assert nose == pytest.approx(0.0, abs=1e-7)
    assert flown["D0"].min() > 0.0


def test_steady_channel_ends_the_step(case, coefficients):
    """Yaw rate of a gentle turn: below the limit for 20 s, and not before."""
    case.run.duration_s, case.run.record_s = 400.0, 0.05
    steady = {"channel": "r", "steady": 0.002, "for_s": 20.0}
    case.command.dH = _programme({"value_deg": 3.0, "until": [steady]}, {"value_deg": 0.0})
    flown = simulate(case, coefficients)
    end = float(flown.steps[0, 0])
    t, acceleration = flown["t"][:-1], np.abs(np.degrees(np.diff(flown["r"]) / np.diff(flown["t"])))
    assert 20.0 < end < 400.0
    assert acceleration[(t > end - 19.9) & (t < end - 0.1)].max() < 0.002
    assert acceleration[(t > end - 22.0) & (t < end - 20.0)].max() > 0.0019


def test_two_events_of_one_step_the_first_ends_it(case, coefficients):
    ends = [{"after_s": 5.0}, {"channel": "psi", "change": 40.0}]
    case.command.dH = _programme({"value_deg": 10.0, "until": ends}, {"value_deg": 0.0})
    assert simulate(case, coefficients).steps[0, 0] == pytest.approx(5.0, abs=1e-9)


def test_autopilot_holds_a_yaw_rate(case, coefficients):
    case.run.duration_s = 300.0
    case.command.dH = _programme({"yaw_rate_degps": 0.3}, P_r=10.0, I_r=0.5)
    flown = simulate(case, coefficients)
    assert np.degrees(flown["r"][-1]) == pytest.approx(0.3, abs=1e-3)


def test_depth_target_moves_with_the_step(case, coefficients):
    """10 m deeper, within a decimetre after ten minutes."""
    case.run.duration_s = 600.0
    case.command.dV = _programme({"hold": True, "distance_m": 10.0}, **DEPTH, limit_deg=10.0)
    flown = simulate(case, coefficients)
    assert flown["z"][-1] - flown["z"][0] == pytest.approx(10.0, abs=0.1)
    assert np.abs(flown["dV"]).max() <= np.radians(10.0) * (1.0 + 1e-12)


def test_no_command_leaves_self_propulsion_alone(case, coefficients):
    """Ten minutes at trim: nothing moves, whatever law says so."""
    case.run.duration_s = 600.0
    for command in (PlaneCommand(law="pid", **DEPTH), _programme({"from_trim_deg": 0.0})):
        case.command.dV = command
        case.command.dH = _programme({"from_trim_deg": 0.0})
        flown = simulate(case, coefficients)
        state = flown.record[:, 1:7]
        assert np.abs(state - state[0]).max() < 1e-8
        assert np.ptp(flown["z"]) < 1e-6


def test_revolutions_are_reversed_at_the_shaft_rate(case, coefficients):
    case.run.record_s = 0.05
    steps = [SpeedStep(times_initial=1.0, until=[Event(after_s=1.0)]), SpeedStep(times_initial=-1.0)]
    case.command.n = SpeedCommand(law="programme", limits_rps=[-2.0, 2.0], step=steps)
    flown = simulate(case, coefficients)
    n = flown["n"]
    assert n[0] > 1.0
    assert n[-1] == pytest.approx(-n[0])
    assert np.abs(np.diff(n)).max() == pytest.approx(14.65 * 0.05, rel=1e-9)
    case.command.n.limits_rps = None
    assert simulate(case, coefficients)["n"].min() == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({}, "one of after_s"),
        ({"after_s": 1.0, "above": 2.0, "channel": "psi"}, "one of after_s"),
        ({"above": 2.0}, "need a channel"),
        ({"after_s": 2.0, "channel": "psi"}, "need a channel"),
        ({"channel": "psi", "steady": 0.1}, "steady and for_s"),
        ({"channel": "point_depth", "below": 0.0}, "point_m"),
        ({"channel": "heel", "below": 0.0}, "channel"),
        ({"after_s": -1.0}, "greater than 0"),
    ],
)
def test_mistake_in_an_event_is_named(data, words):
    with pytest.raises(ValidationError, match=words):
        Event(**data)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PlaneStep(), "one of value_deg"),
        (lambda: PlaneStep(value_deg=1.0, hold=True), "one of value_deg"),
        (lambda: PlaneStep(value_deg=1.0, distance_m=3.0), "go with hold"),
        (lambda: PlaneCommand(law="programme"), "go together"),
        (lambda: PlaneCommand(law="fixed", step=[PlaneStep(value_deg=1.0)]), "go together"),
        (lambda: _programme({"value_deg": 1.0}, {"value_deg": 2.0}), "until"),
        (lambda: SpeedStep(value_rps=1.0, hold=True), "one of value_rps"),
    ],
)
def test_mistake_in_a_step_is_named(make, words):
    with pytest.raises(ValidationError, match=words):
        make()
