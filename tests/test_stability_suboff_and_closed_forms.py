"""Stability indices against SUBOFF's published table, and against the motions they promise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from ident.analysis.stability import critical_speed, stability_at, stability_index
from sim.flight.case import load_case
from sim.flight.plant import Plant
from sim.flight.simulate import mixer_of, plane_limits
from sim.flight.trim import self_propulsion
from sim.kernel.assemble import assemble

# Roddy (1990), DTRC/SHD-1298-08, Table 4, fully appended: force, moment, force by rate,
# moment by rate, index.
SUBOFF = {
    "vertical": (-0.013910, 0.010324, -0.007545, -0.003702, -1.162874),
    "horizontal": (-0.027834, -0.013648, 0.005251, -0.004444, -0.443297),
}
# m' that both of SUBOFF's indices give when they are solved for it.
MASS = 0.018333


@pytest.mark.parametrize(("plane", "sign"), [("vertical", 1.0), ("horizontal", -1.0)])
def test_suboff_indices_to_four_digits(plane, sign):
    force, moment, force_rate, moment_rate, published = SUBOFF[plane]
    found = stability_index(force, moment, force_rate, moment_rate, sign * MASS)
    # Derivatives are printed to half a unit in the sixth decimal.
    digits = sum(0.5e-6 / abs(x) for x in (force, moment, force_rate + sign * MASS, moment_rate))
    assert found == pytest.approx(published, abs=abs(1.0 - published) * digits)


def test_suboff_indices_agree_on_the_mass():
    """G is linear in m': two values of it give the m' of the published index."""
    mass = []
    for plane, sign in (("vertical", 1.0), ("horizontal", -1.0)):
        *row, published = SUBOFF[plane]
        at_zero, at_one = (stability_index(*row, sign * m) for m in (0.0, 1.0))
        mass.append((published - at_zero) / (at_one - at_zero))
    assert mass[0] == pytest.approx(mass[1], abs=2e-6)
    assert mass[0] == pytest.approx(MASS, abs=2e-6)


@given(
    y_v=st.floats(-0.1, -0.01),
    n_v=st.floats(-0.03, 0.03),
    y_r=st.floats(-0.01, 0.015),
    n_r=st.floats(-0.02, -0.001),
)
def test_index_is_positive_exactly_when_sway_and_yaw_die_out(y_v, n_v, y_r, n_r):
    """Eigenvalues of the linear sway-yaw motion at unit speed and length."""
    mass, inertia = 0.02, 0.001
    index = stability_index(y_v, n_v, y_r, n_r, -mass)
    if abs(index) < 1e-6:
        return
    inertias = np.diag([2.0 * mass, 2.0 * inertia])
    slopes = np.array([[y_v, y_r - mass], [n_v, n_r]])
    stable = bool((np.linalg.eigvals(np.linalg.solve(inertias, slopes)).real < 0.0).all())
    assert stable == (index > 0.0)


def test_path_is_level_at_the_critical_speed():
    """Solve heave and pitch balance for w and theta at the speed found: they cancel."""
    stiffness, z_w, m_w, z_d, m_d = 0.12, -0.032, 0.0105, 0.004, 0.0018
    speed = critical_speed(stiffness, z_w, m_w, z_d, m_d)
    assert speed is not None
    for u, expected in ((speed, 0.0), (0.5 * speed, -1.0), (2.0 * speed, 1.0)):
        balance = np.array([[z_w * u, 0.0], [m_w * u, -stiffness]])
        w, theta = np.linalg.solve(balance, -np.array([z_d, m_d]) * u**2)
        path = theta - w / u
        assert path == pytest.approx(0.0, abs=1e-12) if expected == 0.0 else path * expected > 0.0


def test_planes_at_the_neutral_point_never_reverse():
    """A force at the neutral point turns the boat not at all: M_d = M_w Z_d / Z_w."""
    z_w, m_w, z_d = -0.032, 0.0105, 0.004
    assert critical_speed(0.12, z_w, m_w, z_d, m_w * z_d / z_w - 1e-6) is None


def test_bb2_horizontal_index_agrees_with_its_roots(coefficients, environment):
    """BB2 is directionally stable deep at 10 kts: Gh > 0 and no growing lateral root."""
    found = stability_at(coefficients, environment, 5.14444, 23.69)
    assert found.g_horizontal > 0.0
    assert found.horizontal[0][0] < 0.0


def test_least_stable_lateral_root_is_seen_in_a_flight(coefficients, environment):
    """A small disturbance of the trimmed boat decays as the eigenvalue says."""
    from sim.flight import maneuver
    from sim.flight.case import load_case
    from sim.flight.simulate import settings_of

    found = stability_at(coefficients, environment, 5.14444, 23.69)
    model = assemble(coefficients, environment)
    vehicle = coefficients.vehicle
    trim = self_propulsion(model, mixer_of(vehicle), 5.14444, 23.69, plane_limits(vehicle)[0])
    case, _ = load_case("roll-decay")
    settings = settings_of(case, vehicle, trim.state, trim.controls, None)
    settings = settings._replace(value=np.array([trim.dV, trim.dH]))
    state = trim.state.copy()
    state[1] += 1e-5
    record, _ = maneuver.fly(model, settings, state, trim.controls, 0.05, 6000, 20)
    t, v = record[:, 0], record[:, 2] - trim.state[1]
    late = (t > 200.0) & (t < 280.0)
    rate = np.polyfit(t[late], np.log(np.abs(v[late])), 1)[0]
    assert math.isclose(rate, found.horizontal[0][0], rel_tol=0.02)


@pytest.mark.parametrize(("plane", "command"), [("vertical", "dV"), ("horizontal", "dH")])
def test_linear_model_moves_as_the_boat_does_by_a_small_command(coefficients, environment, plane, command):
    """x(t) = A^-1 (exp(A t) - 1) b c for a step; half a degree is small, and reached within a tenth of a second."""
    case = load_case("turning-circle")[0]
    boat = Plant(case, coefficients)
    speed, depth = case.initial.speed_mps, case.initial.depth_m
    linear = stability_at(coefficients, environment, speed, depth).linear[plane]
    assert linear.command == command
    assert linear.about == pytest.approx([boat[name] for name in linear.states], abs=1e-9)
    size, time = math.radians(0.5), 12.0
    a, b = np.array(linear.a), np.array(linear.b)
    # Written as one exponential, which a neutral depth does not trouble.
    whole = expm(time * np.block([[a, b[:, None]], [np.zeros((1, len(b) + 1))]]))
    expected = whole[:-1, -1] * size
    boat.step(round(time / boat.dt), **{command: boat.commands[command] + size})
    moved = np.array([boat[name] for name in linear.states]) - linear.about
    for k, name in enumerate(linear.states):
        if name in "wqvr" or name in ("z", "theta"):
            assert moved[k] == pytest.approx(expected[k], rel=0.06), name
