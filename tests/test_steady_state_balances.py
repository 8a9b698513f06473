"""A settled turn: loads balance the rigid body's inertia, the path is a circle."""

from __future__ import annotations

import numpy as np
import pytest

from sim.flight.case import load_case
from sim.flight.simulate import simulate
from sim.kernel import rhs as kernel
from sim.kernel.layout import workspace


@pytest.fixture(scope="module")
def turn(coefficients):
    """Steady turn to starboard, dH = 5 deg, 10 kts held by the released speed gains.

    From 7 deg on, the captive-only planes (stalled at 10 deg) no longer hold the depth: dV stands
    at its limit and the boat leaves its depth, so there is no level turn to check.
    """
    case = load_case("hzz20")[0].model_copy(deep=True)
    case.command.dH.law, case.command.dH.value_deg = "fixed", 5.0
    case.command.n.law, case.command.n.P_u, case.command.n.I_u = "pid", 14.65, 1.465
    case.initial.upright = False  # the weight stays where the vehicle file has it
    case.run.duration_s, case.run.step_s, case.run.record_s = 2500.0, 0.05, 0.05
    return simulate(case, coefficients)


def _last(turn):
    return turn.record[-1, 1:13], turn.record[-1, 13:19]


def test_accelerations_and_turning_are_steady(turn, model):
    state, controls = _last(turn)
    dy = np.zeros(12)
    kernel.rhs(model, state, controls, workspace(model), dy)
    # The depth integrator is the slowest mode; its remainder is far below 1e-6 g.
    assert np.abs(dy[:6]).max() < 1e-8
    assert dy[8:11] == pytest.approx(np.zeros(3), abs=1e-6)  # level, constant heel and pitch
    # Eq. (9) holds the speed ahead, at what it was at self-propulsion.
    assert turn["u"][-1] == pytest.approx(turn["u"][0], rel=1e-5)
    assert state[5] > 0.0  # to starboard


def test_loads_weight_and_buoyancy_balance_the_inertia(turn, campaign, environment, plain_loads):
    """m (w x v + w x (w x r_G)) = F and w x (I_G w) + r_G x (m a_G) = M, written out here."""
    state, controls = _last(turn)
    velocity, spin = state[:3], state[3:6]
    particulars = campaign.vehicle.particulars
    m, r_g = particulars.mass.value, np.array(particulars.centre_of_gravity.value)
    r_b = np.array(particulars.centre_of_buoyancy.value)
    about_g = m * np.diag(np.square(particulars.radius_of_gyration.value))
    phi, theta = state[9], state[10]
    down = np.array([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)])
    weight = m * environment.gravity * down
    buoyancy = -particulars.displaced_mass.value * environment.gravity * down
    loads, size = plain_loads(state, controls)
    force = loads[:3] + weight + buoyancy
    moment = loads[3:] + np.cross(r_g, weight) + np.cross(r_b, buoyancy)
    of_g = np.cross(spin, velocity) + np.cross(spin, np.cross(spin, r_g))
    assert force == pytest.approx(m * of_g, abs=1e-6 * size[:3].max())
    assert moment == pytest.approx(np.cross(spin, about_g @ spin) + np.cross(r_g, m * of_g), abs=1e-6 * size[3:].max())


def test_the_boat_turns_about_the_vertical(turn):
    """In a steady turn the rotation is vertical: p q r is the turning rate along gravity."""
    state, _ = _last(turn)
    phi, theta = state[9], state[10]
    down = np.array([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)])
    rate = np.linalg.norm(state[3:6])
    assert state[3:6] == pytest.approx(rate * down, abs=1e-5 * rate)


def test_path_is_a_circle_of_radius_speed_over_turning_rate(turn):
    """Circle through three points of the last lap against U over d(psi)/dt."""
    x, y, psi, t = turn["x"], turn["y"], turn["psi"], turn["t"]
    rate = (psi[-1] - psi[-2001]) / (t[-1] - t[-2001])
    points = np.stack([x, y], axis=1)[[-1, -2001, -4001]]
    a, b, c = (np.linalg.norm(points[i] - points[j]) for i, j in ((0, 1), (1, 2), (2, 0)))
    area = abs(np.cross(np.append(points[1] - points[0], 0), np.append(points[2] - points[0], 0))[2]) / 2.0
    radius = a * b * c / (4.0 * area)
    assert radius == pytest.approx(turn["U"][-1] / rate, rel=1e-5)
    # U/r, with the heel of this turn cos(phi) cos(theta) = 0.9997.
    assert radius == pytest.approx(turn["U"][-1] / turn["r"][-1], rel=1e-3)
    assert rate == pytest.approx(turn["r"][-1], rel=1e-3)


def test_bow_points_into_the_turn(turn):
    """Drift in a starboard turn: the flow meets the port side, beta < 0, and v < 0."""
    assert turn["v"][-1] < 0.0
