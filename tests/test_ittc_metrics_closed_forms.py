"""ITTC metrics on records whose metrics are known exactly, and on the published tracks."""

from __future__ import annotations

import numpy as np
import pytest

from ident.metrics import turning, vertical
from ident.metrics.measure import reference_channels
from sim.flight.case import load_case
from sim.flight.series import load_reference

# -- turns -------------------------------------------------------------------------------


def _turn(radius, drift_deg, side, total=3.0 * np.pi, speed=5.0):
    """A turn that is steady from its first instant, with the bow inside the path by the drift."""
    course = np.linspace(0.0, total, 4001)
    drift = np.radians(drift_deg)
    heading = course + drift * np.clip(course / 0.5, 0.0, 1.0)
    ones = np.ones_like(course)
    return {
        "t": course * radius / speed,
        "x": radius * np.sin(course),
        "y": side * radius * (1.0 - np.cos(course)),
        "psi": side * heading,
        "u": speed * np.cos(drift) * ones,
        "v": -side * speed * np.sin(drift) * ones,
        "w": 0.0 * ones,
        "r": side * speed / radius * ones,
        "phi": side * np.radians(2.0) * ones,
        "z": 30.0 + 0.4 * np.sin(course),
        "theta": np.radians(0.5) * np.sin(course),
    }


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["starboard", "port"])
def test_turn_of_a_circle(side):
    """R = 100 m, drift 8 deg: by course R, R, 2R, 2R; by heading at 82 and 172 deg of course."""
    radius, drift = 100.0, 8.0
    found = turning.turning_circle(_turn(radius, drift, side))
    assert found["advance_90_course_m"] == pytest.approx(radius, rel=1e-5)
    assert found["transfer_90_course_m"] == pytest.approx(radius, rel=1e-5)
    assert found["tactical_diameter_180_course_m"] == pytest.approx(2.0 * radius, rel=1e-5)
    assert found["steady_diameter_m"] == pytest.approx(2.0 * radius, rel=1e-9)
    quarter, half = np.radians(90.0 - drift), np.radians(180.0 - drift)
    assert found["advance_90_heading_m"] == pytest.approx(radius * np.sin(quarter), rel=1e-5)
    assert found["transfer_90_heading_m"] == pytest.approx(radius * (1.0 - np.cos(quarter)), rel=1e-5)
    assert found["tactical_diameter_180_heading_m"] == pytest.approx(radius * (1.0 - np.cos(half)), rel=1e-5)
    assert found["time_90_heading_s"] == pytest.approx(radius * quarter / 5.0, rel=1e-5)
    assert found["speed_ratio_steady"] == pytest.approx(1.0)
    assert found["drift_angle_steady_deg"] == pytest.approx(-side * drift)
    assert found["yaw_rate_steady_degps"] == pytest.approx(side * np.degrees(5.0 / radius))
    assert found["heel_steady_deg"] == pytest.approx(side * 2.0)
    assert found["depth_excursion_m"] == pytest.approx(0.4, rel=1e-5)
    assert abs(found["pitch_peak_deg"]) == pytest.approx(0.5, rel=1e-5)


def test_turn_that_ends_early_has_no_tactical_diameter():
    found = turning.turning_circle(_turn(100.0, 8.0, 1.0, total=2.0))
    assert found["advance_90_course_m"] == pytest.approx(100.0, rel=1e-5)
    for name in ("tactical_diameter_180_course_m", "tactical_diameter_180_heading_m", "steady_diameter_m"):
        assert found[name] is None
    assert found["speed_ratio_steady"] is None


def test_circle_through_noise_is_the_least_squares_circle():
    """200 points of a half circle, 0.1 m of noise: the diameter to 0.1 m."""
    rng = np.random.default_rng(4)
    angle = np.linspace(0.0, np.pi, 200)
    x = 40.0 + 90.0 * np.cos(angle) + 0.1 * rng.normal(size=200)
    y = -7.0 + 90.0 * np.sin(angle) + 0.1 * rng.normal(size=200)
    assert turning.circle_diameter(x, y) == pytest.approx(180.0, abs=0.1)


# Value and standard error published beside the digitised tracks (maneuver_metrics.csv): of
# advance and transfer at 90 deg of course, tactical diameter at 180 deg, steady diameter.
TRACKS = {
    ("turn20-23.69m", "CFD"): ((187.13, 0.2), (117.86, 1.0), (222.2, 0.2), (203.94, 0.3)),
    ("turn20-23.69m", "HDM"): ((189.85, 0.2), (125.22, 1.0), (235.64, 0.2), (219.24, 0.3)),
    ("turn20-2.5m", "CFD"): ((183.14, 0.2), (116.94, 1.0), (223.04, 0.2), (199.33, 0.3)),
    ("turn20-2.5m", "HDM"): ((178.68, 0.2), (118.23, 1.0), (225.16, 0.2), (211.8, 0.3)),
}


@pytest.mark.parametrize("name", list(TRACKS))
def test_published_tracks(name):
    """Turned to the program frame, to starboard; each to 2 standard errors."""
    case, where = load_case(name[0])
    found = turning.turning_circle(reference_channels(load_reference(case, where), name[1]))
    metrics = ("advance_90_course_m", "transfer_90_course_m", "tactical_diameter_180_course_m", "steady_diameter_m")
    for metric, (value, sigma) in zip(metrics, TRACKS[name], strict=True):
        assert found[metric] == pytest.approx(value, abs=2.0 * sigma), metric
    assert found.get("advance_90_heading_m") is None


# -- spirals, pull-out, stop -------------------------------------------------------------


def _held(values, each=100.0):
    """A record that jumps to each value and stays: ends of the steps, time, channel."""
    t = np.arange(0.0, each * len(values), 1.0)
    channel = np.array(values)[(t // each).astype(int)]
    return t, channel, [each * (i + 1) - 1.0 for i in range(len(values))]


def test_direct_spiral_of_a_stable_boat_has_no_loop():
    """r = 0.05 dH either way."""
    rudder = np.radians([20.0, 10.0, 0.0, -10.0, -20.0, -10.0, 0.0, 10.0, 20.0])
    t, r, ends = _held(0.05 * rudder)
    found, curve = turning.direct_spiral({"t": t, "r": r}, list(zip(rudder, ends, strict=True)))
    assert found["loop_height_degps"] == pytest.approx(0.0, abs=1e-12)
    assert found["loop_width_deg"] == pytest.approx(0.0, abs=1e-12)
    assert found["yaw_rate_+10_deg_down_degps"] == pytest.approx(0.5)
    assert found["yaw_rate_-20_deg_up_degps"] == pytest.approx(-1.0)
    assert len(curve) == 9


def test_direct_spiral_of_an_unstable_boat():
    """Down the boat keeps turning to starboard to -4 deg, up to port to +4: r = 0.1 (dH +- 4)."""
    rudder = np.radians([20.0, 10.0, 0.0, -10.0, -20.0, -10.0, 0.0, 10.0, 20.0])
    shift = np.radians([4.0] * 5 + [-4.0] * 4)
    t, r, ends = _held(0.1 * (rudder + shift))
    found, _ = turning.direct_spiral({"t": t, "r": r}, list(zip(rudder, ends, strict=True)))
    assert found["loop_height_degps"] == pytest.approx(0.8)
    # On the way up the branch starts at the point the way down ended in.
    assert found["loop_width_deg"] == pytest.approx(8.0, abs=1e-9)


def test_reverse_spiral_of_the_classic_s_curve():
    """dH = -3 r + r^3 [deg, deg/s] falls between r = -1 and 1, by 4 deg; slope at zero -3 + h^2."""
    rate = np.arange(2.0, -2.01, -0.25)
    t, rudder, ends = _held(np.radians(-3.0 * rate + rate**3))
    steps = list(zip(np.radians(rate), ends, strict=True))
    found, _ = turning.reverse_spiral({"t": t, "dH": rudder}, steps)
    assert found["loop_width_deg"] == pytest.approx(4.0)
    assert found["slope_at_zero_deg_per_degps"] == pytest.approx(-3.0 + 0.25**2)
    straight, _ = turning.reverse_spiral({"t": t, "dH": np.radians(2.0) * np.sign(rudder) * 0.0}, steps)
    assert straight["loop_width_deg"] == 0.0


def test_pull_out_leaves_what_stays():
    rudder = np.radians([20.0, 0.0, -20.0, 0.0])
    t, r, ends = _held(np.radians([2.0, 0.3, -2.0, -0.2]))
    found = turning.pull_out({"t": t, "r": r}, list(zip(rudder, ends, strict=True)))
    assert found["turn_1_degps"] == pytest.approx(2.0)
    assert found["residual_1_degps"] == pytest.approx(0.3)
    assert found["residual_2_degps"] == pytest.approx(-0.2)
    assert found["residual_difference_degps"] == pytest.approx(0.5)


def test_stop_at_constant_deceleration():
    """U0 = 5, a = 0.1: 50 s, 125 m, along a course of 30 deg."""
    t = np.linspace(0.0, 50.0, 501)
    s = 5.0 * t - 0.05 * t**2
    course = np.radians(30.0)
    channels = {"t": t, "s": s, "x": s * np.cos(course), "y": s * np.sin(course), "psi": np.full_like(t, course)}
    found = turning.stopping(channels, True)
    assert found["time_to_stop_s"] == pytest.approx(50.0)
    assert found["track_reach_m"] == pytest.approx(125.0)
    assert found["head_reach_m"] == pytest.approx(125.0)
    assert found["lateral_deviation_m"] == pytest.approx(0.0, abs=1e-9)
    assert set(turning.stopping(channels, False).values()) == {None}


# -- vertical plane and autopilots -------------------------------------------------------


def test_oscillation_of_a_damped_cosine():
    zeta, omega = 0.05, 0.3
    damped = omega * np.sqrt(1.0 - zeta**2)
    t = np.arange(0.0, 400.0, 0.1)
    period, damping = vertical.oscillation(t, np.exp(-zeta * omega * t) * np.cos(damped * t))
    assert period == pytest.approx(2.0 * np.pi / damped, rel=1e-3)
    assert damping == pytest.approx(zeta, rel=1e-2)
    assert vertical.oscillation(t, np.exp(-t)) == (None, None)


def test_depth_change_of_a_second_order_response():
    """Overshoot exp(-pi zeta / sqrt(1 - zeta^2)); 5 % settling from the response itself."""
    zeta, omega, step = 0.4, 0.1, -8.0
    damped = omega * np.sqrt(1.0 - zeta**2)
    t = np.arange(0.0, 300.0, 0.05)
    response = 1.0 - np.exp(-zeta * omega * t) * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))
    found = vertical.depth_change({"t": t, "z": 50.0 + step * response, "theta": 0.0 * t}, step)
    overshoot = np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2))
    assert found["overshoot_percent"] == pytest.approx(100.0 * overshoot, rel=1e-5)
    assert found["overshoot_m"] == pytest.approx(8.0 * overshoot, rel=1e-5)
    settled = found["settling_5_percent_s"]
    assert np.all(np.abs(response[t >= settled] - 1.0) <= 0.05)
    assert abs(response[t < settled][-1] - 1.0) > 0.05
    assert response[np.searchsorted(t, found["reach_90_s"])] == pytest.approx(0.9, abs=1e-2)


def test_depth_overshoot_of_a_parabola():
    """Rising at 1 m/s at the reversal, decelerated at 0.1 m/s^2: 5 m more."""
    t = np.arange(0.0, 60.0, 0.1)
    z = np.where(t < 20.0, 50.0 - t, 50.0 - t + 0.05 * (t - 20.0) ** 2)
    assert vertical.depth_overshoot(t, z, 20.0, 1) == pytest.approx(5.0, abs=1e-3)
    assert vertical.depth_overshoot(t, 100.0 - z, 20.0, -1) == pytest.approx(5.0, abs=1e-3)
    assert vertical.depth_overshoot(t, z, None, 1) is None


def test_meander_of_a_known_swing():
    """Execute at 10 s and 3 deg; then a damped cosine about zero from 3 deg, still rising."""
    zeta, omega = 0.1, 0.2
    damped = omega * np.sqrt(1.0 - zeta**2)
    t = np.arange(0.0, 300.0, 0.05)
    after = np.clip(t - 10.0, 0.0, None)
    theta = np.radians(3.0) * np.where(t < 10.0, t / 10.0, 1.0) * np.exp(-zeta * omega * after) * np.cos(damped * after)
    found = vertical.meander({"t": t, "theta": theta, "z": 50.0 - 0.01 * t}, 10.0, 0.0)
    assert found["time_to_execute_s"] == 10.0
    assert found["pitch_overshoot_deg"] == pytest.approx(0.0, abs=1e-9)
    assert found["meander_period_s"] == pytest.approx(2.0 * np.pi / damped, rel=1e-3)
    assert found["damping_ratio"] == pytest.approx(zeta, rel=2e-2)
    assert found["depth_change_m"] == pytest.approx(-0.01 * t[-1])


def test_course_keeping_of_a_decay():
    """5 deg exp(-t/20) after the release: within 0.5 deg after 20 ln 10 s."""
    t = np.arange(0.0, 200.0, 0.1)
    psi = np.radians(5.0) * np.where(t < 10.0, t / 10.0, np.exp(-(t - 10.0) / 20.0))
    channels = {"t": t, "psi": psi, "y": 0.1 * t, "dH": np.full_like(t, np.radians(2.0))}
    found = vertical.course_keeping(channels, 10.0)
    assert found["heading_deviation_peak_deg"] == pytest.approx(5.0, rel=1e-2)
    assert found["settling_s"] == pytest.approx(20.0 * np.log(10.0), abs=0.11)
    assert found["rudder_rms_deg"] == pytest.approx(2.0)
    assert found["heading_overshoot_deg"] == 0.0
    assert found["lateral_offset_m"] == pytest.approx(0.1 * t[-1])
