"""Rigid-body invariants (energy, momentum, free fall) and the port/starboard mirror."""

from __future__ import annotations

import numpy as np
import pytest

from sim.boat.coefficients import Coefficients
from sim.boat.mass import rigid_body_matrix
from sim.boat.parts import mirror_of, vehicle_terms
from sim.flight.case import load_case
from sim.flight.simulate import simulate
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace

PLANES = 5
# State order u v w p q r x y z phi theta psi: what changes sign in the mirror.
MIRROR = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1], dtype=float)


def _boat(vehicle, *, centre_of_gravity=None, centre_of_buoyancy=None, displaced=None):
    other = vehicle.model_copy(deep=True)
    if centre_of_gravity is not None:
        other.particulars.centre_of_gravity.value = list(centre_of_gravity)
    if centre_of_buoyancy is not None:
        other.particulars.centre_of_buoyancy.value = list(centre_of_buoyancy)
    if displaced is not None:
        other.particulars.displaced_mass.value = displaced
    return other


def _bare(vehicle, rows, environment):
    """A body without any hydrodynamic coefficient, added mass included."""
    return assemble(Coefficients(vehicle, rows.iloc[:0]), environment)


def _rotation(state):
    """Body to earth, Euler 3-2-1, from its three elementary turns."""
    phi, theta, psi = state[9:12]
    about_x = np.array([[1, 0, 0], [0, np.cos(phi), -np.sin(phi)], [0, np.sin(phi), np.cos(phi)]])
    about_y = np.array([[np.cos(theta), 0, np.sin(theta)], [0, 1, 0], [-np.sin(theta), 0, np.cos(theta)]])
    about_z = np.array([[np.cos(psi), -np.sin(psi), 0], [np.sin(psi), np.cos(psi), 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _fly_free(model, state, duration, step):
    """RK4 with all controls at zero; every state."""
    work = workspace(model)
    controls = np.zeros(PLANES + 1)
    y, states = state.copy(), [state.copy()]
    for _ in range(round(duration / step)):
        kernel.rk4(model, y, controls, controls, step, work, y)
        states.append(y.copy())
    return np.array(states)


def _derivative(model, state, controls=None):
    out = np.zeros(12)
    controls = np.zeros(PLANES + 1) if controls is None else controls
    kernel.rhs(model, state, controls, workspace(model), out)
    return out


# -- rigid body --------------------------------------------------------------------------


def test_kinetic_and_potential_energy_are_conserved_in_a_tumble(campaign, rows, environment):
    """G and B off the origin in all three directions, weight 5 % above buoyancy, 60 s."""
    r_g, r_b, mass = (0.8, -0.5, 0.6), (-0.4, 0.3, -0.2), campaign.vehicle.particulars.mass.value
    vehicle = _boat(campaign.vehicle, centre_of_gravity=r_g, centre_of_buoyancy=r_b, displaced=0.95 * mass)
    model = _bare(vehicle, rows, environment)
    start = np.array([5.0, -1.0, 0.5, 1.5, 0.04, 0.06, 0, 0, 40.0, 0.4, -0.2, 0.1])
    states = _fly_free(model, start, 60.0, 0.01)
    matrix, energy = rigid_body_matrix(vehicle)[0], []
    for y in states[::50]:
        down = _rotation(y)[2]
        # z is down: the weight's potential falls with depth, the buoyancy's rises.
        potential = -9.81 * mass * (y[8] + down @ r_g) + 9.81 * 0.95 * mass * (y[8] + down @ r_b)
        energy.append(0.5 * y[:6] @ matrix @ y[:6] + potential)
    energy = np.array(energy)
    kinetic = 0.5 * start[:6] @ matrix @ start[:6]
    assert np.abs(states[:, 10]).max() < np.radians(85.0)  # away from the Euler singularity
    assert np.ptp(states[:, 9]) > 2.0 * np.pi  # it does tumble
    assert np.abs(energy - energy[0]).max() < 1e-8 * kinetic


def test_momentum_is_conserved_without_a_resultant(campaign, rows, environment):
    """Weight and buoyancy equal and at one point: linear momentum and that about G are constant."""
    centre = (0.8, -0.5, 0.6)
    vehicle = _boat(campaign.vehicle, centre_of_gravity=centre, centre_of_buoyancy=centre)
    model = _bare(vehicle, rows, environment)
    start = np.array([5.0, -1.0, 0.5, 0.3, 0.05, 0.04, 0, 0, 40.0, 0.1, -0.2, 0.1])
    states = _fly_free(model, start, 60.0, 0.01)
    about_g = vehicle.particulars.mass.value * np.diag(np.square(vehicle.particulars.radius_of_gyration.value))
    linear, angular = [], []
    for y in states[::100]:
        turn = _rotation(y)
        linear.append(turn @ (y[:3] + np.cross(y[3:6], centre)))
        angular.append(turn @ (about_g @ y[3:6]))
    assert np.abs(states[:, 10]).max() < np.radians(80.0)
    assert np.abs(np.array(linear) - linear[0]).max() < 1e-8 * np.linalg.norm(linear[0])
    assert np.abs(np.array(angular) - angular[0]).max() < 1e-8 * np.linalg.norm(angular[0])


def test_the_centre_of_gravity_falls_at_g_without_buoyancy(campaign, rows, environment):
    """a_G = dv/dt + w x v + dw/dt x r_G + w x (w x r_G) = g down, whatever the motion."""
    lever = np.array([1.2, -0.7, 0.9])
    vehicle = _boat(campaign.vehicle, centre_of_gravity=lever, displaced=0.0)
    model = _bare(vehicle, rows, environment)
    rng = np.random.default_rng(7)
    for _ in range(20):
        state = rng.normal(size=12)
        dy, spin = _derivative(model, state), state[3:6]
        found = dy[:3] + np.cross(spin, state[:3]) + np.cross(dy[3:6], lever)
        found = found + np.cross(spin, np.cross(spin, lever))
        assert found == pytest.approx(9.81 * _rotation(state)[2], abs=1e-12)


def test_kinematics_are_the_turned_velocity_and_the_turned_rates(campaign, rows, environment):
    """Earth velocity is R v, and dR/dt = R [omega]x, by central difference."""
    model = _bare(campaign.vehicle, rows, environment)
    rng = np.random.default_rng(8)
    for _ in range(20):
        state = rng.normal(size=12) * 0.5
        dy, turn, step = _derivative(model, state), _rotation(state), 1e-6
        assert dy[6:9] == pytest.approx(turn @ state[:3], abs=1e-13)
        moved = [_rotation(state + side * step * np.append(np.zeros(9), dy[9:12])) for side in (1, -1)]
        rate = turn.T @ (moved[0] - moved[1]) / (2 * step)
        p, q, r = state[3:6]
        assert rate == pytest.approx(np.array([[0, -r, q], [r, 0, -p], [-q, p, 0]]), abs=1e-8)


# -- mirror ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def without_torque(campaign, rows):
    """The propeller's torque is the one load with a hand; without it the boat is symmetric."""
    symmetric = rows.copy()
    symmetric.loc[symmetric["coefficient"] == "KQ", "value"] = 0.0
    return Coefficients(campaign.vehicle, symmetric)


def _plane_mirror(vehicle):
    """Index of the partner of each plane, and the sign of its deflection in the mirror."""
    names = [p.name for p in vehicle.planes]
    index, sign = np.zeros(len(names), dtype=int), np.zeros(len(names))
    for term in vehicle_terms(vehicle):
        if term.part in names:
            mirror = mirror_of(term, term.part, vehicle)
            i = names.index(term.part)
            index[i], sign[i] = names.index(mirror.part), mirror.axis_signs[term.axes.index("delta")]
    return index, sign


def test_planes_pair_as_in_the_source(campaign):
    """1 lower starboard with 4 lower port, 2 with 3; opposite sense; the sail pair with itself."""
    index, sign = _plane_mirror(campaign.vehicle)
    assert list(index) == [3, 2, 1, 0, 4]
    assert list(sign) == [-1, -1, -1, -1, 1]


def test_mirrored_state_and_controls_give_the_mirrored_derivative(without_torque, environment):
    model = assemble(without_torque, environment)
    index, sign = _plane_mirror(without_torque.vehicle)
    rng = np.random.default_rng(12)
    for _ in range(100):
        state = rng.normal(size=12) * np.repeat([1.0, 0.03, 1.0, 0.3], 3)
        state[0] += 4.0
        state[8] = rng.uniform(3.0, 25.0) - model.sail_top
        controls = np.append(rng.normal(size=5) * 0.3, rng.uniform(0.5, 1.5))
        mirrored = np.zeros(6)
        mirrored[index], mirrored[5] = sign * controls[:5], controls[5]
        here, there = _derivative(model, state, controls), _derivative(model, MIRROR * state, mirrored)
        assert there == pytest.approx(MIRROR * here, rel=1e-12, abs=1e-12)


def test_the_torque_alone_breaks_the_mirror(model):
    """The same check must fail with the torque on, or it would prove nothing."""
    state, controls = np.zeros(12), np.zeros(PLANES + 1)
    state[0], state[8], controls[-1] = 5.0, 36.0, 1.2
    here, there = _derivative(model, state, controls), _derivative(model, MIRROR * state, controls)
    assert np.abs(there - MIRROR * here).max() > 1e-5


def test_a_zigzag_flown_to_the_other_side_is_its_mirror_image(without_torque):
    case, _ = load_case("hzz20")
    port = simulate(case, without_torque)
    other = case.model_copy(deep=True)
    other.command.dH.first_deg = -case.command.dH.first_deg
    starboard = simulate(other, without_torque)
    index, sign = _plane_mirror(without_torque.vehicle)
    first = 1 + 12
    planes, size = port.record[:, first : first + 5], np.array([1, 1, 1, 1, 1, 1, 70.0, 70.0, 70.0, 1, 1, 1])
    image = np.zeros_like(planes)
    image[:, index] = sign * planes
    assert len(port.record) == len(starboard.record) == 1601
    # Rounding only, relative to 1 m/s, 1 rad/s, a boat length and 1 rad.
    assert np.abs((starboard.record[:, 1:13] - MIRROR * port.record[:, 1:13]) / size).max() < 1e-9
    assert np.abs(starboard.record[:, first : first + 5] - image).max() < 1e-9
    assert len(port.executes) == len(starboard.executes) >= 2
    assert starboard.executes == pytest.approx(port.executes * [1.0, -1.0], abs=1e-8)


@pytest.mark.parametrize("name", ["turn20-23.69m", "turning-circle"])
def test_a_turn_to_port_is_the_mirror_image_of_one_to_starboard(without_torque, name):
    """With ballast and without it, and with the event that ends the turn."""
    case = load_case(name)[0].model_copy(deep=True)
    case.run.duration_s = 120.0
    starboard = simulate(case, without_torque)
    case.command.dH.value_deg = -case.command.dH.value_deg
    port = simulate(case, without_torque)
    size = np.array([1, 1, 1, 1, 1, 1, 70.0, 70.0, 70.0, 1, 1, 1])
    assert np.abs((port.record[:, 1:13] - MIRROR * starboard.record[:, 1:13]) / size).max() < 1e-9
    assert np.ptp(starboard["psi"]) > 1.0
    if "ballast" in starboard.columns:
        assert port["ballast"] == pytest.approx(starboard["ballast"], abs=1e-6)
