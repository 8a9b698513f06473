"""Restoring moments and plane incidence against their closed forms."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from sim.boat.catalogue import OUTPUTS
from sim.boat.coefficients import Coefficients
from sim.boat.forces import plane_features
from sim.boat.mass import rigid_body_matrix
from sim.flight.simulate import mixer_of
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace

U0 = 5.14444


@pytest.fixture(scope="module")
def bare(campaign, rows, environment):
    return assemble(Coefficients(campaign.vehicle, rows.iloc[:0]), environment)


def _static_load(model, vehicle, **state):
    """Force and moment on a body at rest: rigid-body mass matrix times its acceleration."""
    y, dy = np.zeros(12), np.zeros(12)
    for name, value in state.items():
        y[9 + ("phi", "theta", "psi").index(name)] = value
    kernel.rhs(model, y, np.zeros(6), workspace(model), dy)
    return rigid_body_matrix(vehicle)[0] @ dy[:6]


def test_restoring_moments_are_minus_weight_bg_sine(bare, campaign):
    """Neutral: no force; K = -W BG cos(theta) sin(phi), M = -W BG sin(theta), N = 0."""
    weight, lever = 4.440e6 * 9.81, 0.4741 - 0.0443  # published mass; heights above the shaft
    for heel, pitch, heading in itertools.product(np.radians([-40.0, 0.0, 4.58, 90.0]), (-0.3, 0.0, 0.2), (0.0, 1.0)):
        found = _static_load(bare, campaign.vehicle, phi=heel, theta=pitch, psi=heading)
        restoring = -weight * lever
        expected = [0, 0, 0, restoring * np.cos(pitch) * np.sin(heel), restoring * np.sin(pitch), 0]
        assert found == pytest.approx(np.array(expected), abs=1e-9 * weight)


def test_excess_weight_pulls_down_and_a_forward_weight_pitches_the_bow_down(campaign, rows, environment):
    vehicle = campaign.vehicle.model_copy(deep=True)
    vehicle.particulars.mass.value *= 1.01
    vehicle.particulars.centre_of_gravity.value = [0.1, 0.05, -0.0443]
    model = assemble(Coefficients(vehicle, rows.iloc[:0]), environment)
    weight = vehicle.particulars.mass.value * 9.81
    found = _static_load(model, vehicle)
    assert found[2] == pytest.approx(weight - weight / 1.01, rel=1e-9)
    assert found[4] == pytest.approx(-0.1 * weight, rel=1e-9)  # theta < 0 is bow down
    assert found[3] == pytest.approx(0.05 * weight, rel=1e-9)  # phi > 0 is starboard down


# -- incidence at a plane, Eqs. (32)-(35) --------------------------------------------------


def test_lift_directions_are_those_of_the_source(campaign):
    """Positive deflection lifts up on 1, 2 and B, down on 3 and 4; 45 deg to the side on the X."""
    half = np.sqrt(0.5)
    expected = {
        "stern_plane_1": [0.0, half, -half],  # lower starboard: up and outward
        "stern_plane_2": [0.0, -half, -half],  # upper starboard: up and inward
        "stern_plane_3": [0.0, -half, half],  # upper port: down and outward
        "stern_plane_4": [0.0, half, half],  # lower port: down and inward
        "sail_planes": [0.0, 0.0, -1.0],
    }
    for plane in campaign.vehicle.planes:
        assert plane.lift_axis == pytest.approx(np.array(expected[plane.name]), abs=1e-12)
        assert plane.lift_axis @ plane.span_axis == pytest.approx(0.0, abs=1e-12)


def test_a_plane_that_moves_along_its_lift_direction_loses_that_angle(campaign):
    """Ahead at U0 and at W along the lift axis: the angle falls by atan(W / U0)."""
    for plane in campaign.vehicle.planes:
        for across in (-1.5, -0.1, 0.2, 2.0):
            velocity = np.array([U0, 0.0, 0.0]) + across * plane.lift_axis
            found = plane_features(plane, velocity, (0.0, 0.0, 0.0), 0.1)
            assert found["delta"] == pytest.approx(0.1 - np.arctan2(across, U0), abs=1e-14)
            assert found["V"] == pytest.approx(np.hypot(across, U0), rel=1e-14)


def test_incidence_of_rotation_is_lever_times_rate_over_speed(campaign):
    """Bow-up pitch q moves the stern down, |x| q; roll moves each stern plane along its normal."""
    arm, rate = 31.1794, 0.01  # planform centroid, shared/bb2/geometry/planes.csv
    for plane in campaign.vehicle.planes:
        if plane.name == "sail_planes":
            continue
        # Stern moves down (z) by +arm q: along lift for planes whose lift has a z component.
        found = plane_features(plane, (U0, 0.0, 0.0), (0.0, rate, 0.0), 0.0)
        x, _, z = plane.position
        along = rate * np.array([z, 0.0, -x]) @ plane.lift_axis
        assert -x == pytest.approx(arm)
        expected = -np.arcsin(along / np.hypot(U0 + rate * z, rate * arm))
        assert found["delta"] == pytest.approx(expected, abs=1e-13)
        # Roll: every stern plane meets the flow at -p rho/U about its own axis.
        rolled = plane_features(plane, (U0, 0.0, 0.0), (rate, 0.0, 0.0), 0.0)
        radius = np.hypot(3.9057, 3.9057)
        assert abs(rolled["delta"]) == pytest.approx(np.arctan2(rate * radius, U0), rel=1e-12)


def _plane_loads(model, controls, velocity=(U0, 0.0, 0.0), rates=(0.0, 0.0, 0.0)):
    """Hydrodynamic loads that deflecting the planes adds."""
    work, y = workspace(model), np.zeros(12)
    y[:3], y[3:6], y[8] = velocity, rates, 25.0 - model.sail_top
    found = []
    for c in (np.append(controls, 1.18), np.append(np.zeros(5), 1.18)):
        kernel.features(model, y, c, work)
        kernel.loads(model, work)
        found.append(work.loads[:6].copy())
    return dict(zip(OUTPUTS, found[0] - found[1], strict=True))


@pytest.mark.parametrize("i", range(5))
def test_each_fitted_plane_lifts_along_its_lift_axis(model, campaign, i):
    """Loads on the plane follow its normal: the measured force has a positive part along it."""
    controls = np.zeros(5)
    controls[i] = np.radians(10.0)
    load = _plane_loads(model, controls)
    force = np.array([load["X"], load["Y"], load["Z"]])
    along = force @ campaign.vehicle.planes[i].lift_axis
    assert along > 0.0
    assert along > 0.8 * np.linalg.norm(force[1:])
    assert load["X"] < 0.0  # and drags


def test_vertical_command_lifts_the_bow_and_horizontal_turns_to_starboard(model, campaign):
    """Corrected Eq. (1): dV > 0 gives M > 0, dH > 0 gives N > 0; each leaves the other alone."""
    mixer = mixer_of(campaign.vehicle)
    vertical = _plane_loads(model, mixer @ [np.radians(10.0), 0.0])
    horizontal = _plane_loads(model, mixer @ [0.0, np.radians(10.0)])
    assert vertical["M"] > 0.0
    assert abs(vertical["N"]) < 1e-9 * vertical["M"]
    assert horizontal["N"] > 0.0
    assert abs(horizontal["M"]) < 0.2 * horizontal["N"]
    # The stern is pushed to port and down respectively: opposite to the turn it makes.
    assert horizontal["Y"] < 0.0
    stern = _plane_loads(model, mixer_of(campaign.vehicle, sail_planes=False) @ [np.radians(10.0), 0.0])
    assert stern["Z"] > 0.0
    assert stern["M"] > 0.0


def test_sail_planes_lift_with_a_positive_vertical_command(model, campaign):
    names = [p.name for p in campaign.vehicle.planes]
    controls = np.zeros(5)
    share = mixer_of(campaign.vehicle)[names.index("sail_planes")] @ [np.radians(10.0), 0.0]
    controls[names.index("sail_planes")] = share
    load = _plane_loads(model, controls)
    assert load["Z"] < 0.0
    assert load["M"] > 0.0  # ahead of the origin: lift raises the bow


def test_plane_incidence_damps_roll_pitch_and_yaw(campaign, rows, environment):
    """Only the planes' coefficients: each rotation meets a moment against it."""
    names = [p.name for p in campaign.vehicle.planes]
    model = assemble(Coefficients(campaign.vehicle, rows[rows["part"].isin(names)]), environment)
    work = workspace(model)
    for k, moment in enumerate("KMN"):
        found = []
        for rate in (0.01, -0.01):
            y = np.zeros(12)
            y[0], y[3 + k], y[8] = U0, rate, 25.0 - model.sail_top
            kernel.features(model, y, np.zeros(6), work)
            kernel.loads(model, work)
            found.append(work.loads[OUTPUTS.index(moment)])
        assert found[0] - found[1] < 0.0, moment
