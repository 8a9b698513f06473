"""Authority: the plain right-hand side, and counting. Nothing is lost or overwritten where there is much of it."""

from __future__ import annotations

import numpy as np
import pytest

from sim.boat.coefficients import Coefficients
from sim.flight import maneuver
from sim.flight.case import load_case
from sim.flight.commands import Event, PlaneStep
from sim.flight.simulate import initial_state, settings_of, simulate
from sim.kernel import plain
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace

STEPS = 300


def _classical(model, y, c, rate, h):
    """A Runge-Kutta step of the plain right-hand side."""
    k1 = plain.rhs(model, y, c)
    k2 = plain.rhs(model, y + 0.5 * h * k1, c + 0.5 * h * rate)
    k3 = plain.rhs(model, y + 0.5 * h * k2, c + 0.5 * h * rate)
    k4 = plain.rhs(model, y + h * k3, c + h * rate)
    return y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@pytest.mark.parametrize("more", [0, 6, 9, 20])
def test_a_step_of_a_boat_with_many_planes_is_that_of_the_plain_right_hand_side(campaign, rows, environment, more):
    """More planes than states: twelve was the room for planes, revolutions and tanks."""
    vehicle = campaign.vehicle.model_copy(deep=True)
    first = vehicle.planes[0]
    vehicle.planes += [first.model_copy(update={"name": f"extra_{k}"}) for k in range(more)]
    model = assemble(Coefficients(vehicle, rows), environment)
    rng, count = np.random.default_rng(more), len(vehicle.planes)
    y = np.array([5.0, 0.3, -0.2, 0.01, 0.02, -0.015, 10.0, 3.0, 40.0, 0.02, 0.05, 0.4])
    c = np.append(rng.uniform(-0.2, 0.2, count), 1.2)
    rate, out = np.append(rng.uniform(-0.05, 0.05, count), 0.01), np.zeros(12)
    work = workspace(model)
    guard = work.stage.controls.size
    kernel.rk4(model, y, c, rate, 0.05, work, out)
    assert guard >= c.size
    assert out == pytest.approx(_classical(model, y, c, rate, 0.05), rel=1e-12, abs=1e-13)


def test_every_step_of_a_long_programme_is_in_the_log(coefficients):
    case = load_case("hzz20")[0].model_copy(deep=True)
    wave = [PlaneStep(from_trim_deg=(-1.0) ** k, until=[Event(after_s=0.05)]) for k in range(STEPS)]
    case.command.dH = case.command.dH.model_copy(update={"law": "programme", "step": wave})
    case.run = case.run.model_copy(update={"duration_s": 0.05 * (STEPS + 20)})
    steps = simulate(case, coefficients).steps
    assert len(steps) == STEPS  # the last one ends the run
    assert steps[:, 2].tolist() == list(range(STEPS))


def test_zigzag_executes_do_not_depend_on_the_room_for_them(coefficients, model):
    case = load_case("hzz20")[0].model_copy(deep=True)
    case.command.dH = case.command.dH.model_copy(update={"check_deg": 1.0, "first_deg": -5.0})
    vehicle = coefficients.vehicle
    state, controls, trim = initial_state(case, vehicle, model)
    settings = settings_of(case, vehicle, state, controls, trim)
    few, many = (
        maneuver.fly_logged(model, settings, state, controls, maneuver.Clock(0.05, 3200, 20), room=n) for n in (2, 256)
    )
    assert len(many.executes) > 4
    assert np.array_equal(few.executes, many.executes)
    assert np.array_equal(few.record, many.record)
