"""Ballast and trim tank: a heavier boat, free fall, static pitch, limits, level trim."""

from __future__ import annotations

import numpy as np
import pytest

from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.files.errors import InputError
from sim.flight.autopilot import command_boat
from sim.flight.case import load_case
from sim.flight.commands import TankCommand
from sim.flight.orders import COMMAND, N_COMMANDS, flat, progress
from sim.flight.simulate import initial_state, mixer_of, model_of, plane_limits, settings_of, simulate
from sim.flight.trim import Leveling, NoEquilibrium, self_propulsion
from sim.kernel import plain
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble, with_tanks
from sim.kernel.layout import workspace

STATE = np.array([5.0, 0.3, -0.2, 0.02, 0.01, -0.015, 0.0, 0.0, 40.0, 0.15, 0.05, 0.3])
CONTROLS = np.array([0.1, 0.2, -0.1, 0.05, 0.03, 1.2])
G = 9.81


@pytest.fixture(scope="module")
def wet(model, campaign):
    return with_tanks(model, campaign.vehicle)


def _derivative(model, state, controls):
    out = np.zeros(12)
    kernel.rhs(model, state, controls, workspace(model), out)
    return out


def test_compiled_tanks_agree_with_the_plain_reading(wet):
    """Any tank place, ballast and shift, against vectors and a solved mass matrix."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        other = wet.replaced(tank=rng.normal(size=3) * [20.0, 3.0, 3.0])
        state = STATE + rng.normal(size=12) * 0.05
        controls = np.append(CONTROLS, [rng.normal() * 5e4, rng.normal() * 0.1])
        expected = plain.rhs(other, state, controls)
        assert _derivative(other, state, controls) == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_empty_tanks_change_nothing(model, wet):
    empty = _derivative(wet, STATE, np.append(CONTROLS, [0.0, 0.0]))
    assert empty == pytest.approx(_derivative(model, STATE, CONTROLS), rel=1e-11, abs=1e-15)


def test_ballast_is_a_heavier_boat(campaign, rows, wet, environment):
    """The vehicle file with the ballast in its mass gives the same accelerations.

    With the tank at the centre of gravity, only mass and gyration change: m k^2 stays.
    """
    ballast = 18000.0
    heavier = campaign.vehicle.model_copy(deep=True)
    particulars = heavier.particulars
    old = particulars.mass.value
    particulars.mass.value = old + ballast
    ratio = np.sqrt(old / (old + ballast))
    particulars.radius_of_gyration.value = [ratio * k for k in particulars.radius_of_gyration.value]
    solid = assemble(Coefficients(heavier, rows), environment)
    with_ballast = _derivative(wet, STATE, np.append(CONTROLS, [ballast, 0.0]))
    assert with_ballast == pytest.approx(_derivative(solid, STATE, CONTROLS), rel=1e-10, abs=1e-14)
    assert np.abs(with_ballast - _derivative(wet, STATE, np.append(CONTROLS, [0.0, 0.0]))).max() > 1e-3


@pytest.fixture
def still(campaign, rows):
    """BB2 without hydrodynamics but one added mass in heave, at rest; and that mass [kg]."""
    sail = rows[(rows["coefficient"] == "Z_wdot_section") & (rows["part"] == "Hull 5")]
    assert len(sail) == 1
    vehicle = campaign.vehicle.model_copy(deep=True, update={"added_mass": "sections"})
    for section in vehicle.sections.centres:
        # At the origin, so that heave stays alone.
        section.position = [0.0, 0.0, 0.0]
    case = load_case("roll-decay")[0].model_copy(deep=True)
    case.initial.heel_deg = 0.0
    case.run.duration_s = 10.0
    coefficients = Coefficients(vehicle, sail)
    model = assemble(coefficients, Environment(1025.0, G))
    return case, coefficients, model.mass_matrix[2, 2] - vehicle.particulars.mass.value


def test_constant_ballast_sinks_the_boat_as_it_must(still):
    """From rest, w = dm g t / (m + dm + A33) and z = 1/2 of that times t."""
    case, coefficients, added = still
    other = case.model_copy(deep=True)
    ballast = 5000.0
    other.command.ballast = TankCommand(law="fixed", value=ballast)
    flown = simulate(other, coefficients)
    assert added > 1e5
    rate = ballast * G / (coefficients.vehicle.particulars.mass.value + ballast + added)
    assert flown["w"] == pytest.approx(rate * flown["t"], rel=1e-9, abs=1e-12)
    assert flown["z"] - flown["z"][0] == pytest.approx(0.5 * rate * flown["t"] ** 2, rel=1e-9, abs=1e-9)
    assert np.abs(flown["theta"]).max() < 1e-12


def test_trim_tank_pitches_by_shift_over_bg(wet, campaign):
    """At rest the moment vanishes at tan(theta) = -shift / BG, bow down for a shift ahead."""
    particulars = campaign.vehicle.particulars
    lever = particulars.centre_of_gravity.value[2] - particulars.centre_of_buoyancy.value[2]
    assert lever == pytest.approx(0.430, abs=1e-3)
    shift, state = 0.03, np.zeros(12)
    state[8], state[10] = 40.0, -np.arctan(shift / lever)
    controls = np.zeros(8)
    controls[7] = shift
    assert abs(_derivative(wet, state, controls)[4]) < 1e-12
    state[10] = 0.0
    assert _derivative(wet, state, controls)[4] < -1e-5


def test_level_trim_with_ballast_is_an_equilibrium_of_the_controllers(coefficients):
    """Self-propulsion at 10 kts, D0 = 25 m: nothing moves in a minute of closed loop."""
    flown = simulate(load_case("self-propulsion")[0], coefficients)
    assert flown.trim.state[10] == 0.0
    assert flown.trim.limited == ()
    for channel in ("u", "v", "w", "z", "phi", "theta", "n", "ballast", "dV", "dH"):
        assert np.ptp(flown[channel]) < 1e-7 * max(1.0, abs(flown[channel][0])), channel


def _trim(wet, vehicle, level, limits, depth=4.0):
    return self_propulsion(wet, mixer_of(vehicle), 5.14444, depth, plane_limits(vehicle)[0], Leveling(level, limits))


def test_tank_at_its_limit_leaves_the_rest_to_pitch_and_planes(wet, campaign):
    vehicle = campaign.vehicle
    free = _trim(wet, vehicle, "ballast", (2e4, 0.035))
    kept = _trim(wet, vehicle, "ballast", (3000.0, 0.035))
    assert abs(free.controls[6]) > 3000.0
    assert (free.limited, kept.limited) == ((), ("ballast",))
    assert abs(kept.controls[6]) == 3000.0
    assert free.state[10] == 0.0
    assert abs(kept.state[10]) > 1e-3
    assert max(free.residual, kept.residual) < 1e-8


def test_level_trim_by_both_tanks_needs_no_planes(wet, campaign):
    found = _trim(wet, campaign.vehicle, "tanks", (1e9, 1e9))
    assert found.dV == 0.0
    assert found.state[10] == 0.0
    limited = _trim(wet, campaign.vehicle, "tanks", (1e9, 1e-4))
    assert limited.limited == ("trim_tank",)
    assert abs(limited.controls[7]) == 1e-4
    assert limited.dV != 0.0


def test_plane_beyond_its_limit_is_refused(wet, campaign):
    with pytest.raises(NoEquilibrium):
        self_propulsion(
            wet, mixer_of(campaign.vehicle), 5.14444, 4.0, np.full(5, 1e-4), Leveling("ballast", (2e4, 0.035))
        )


def test_ballast_keeps_its_limit_and_rate(coefficients):
    """33.3 kg/s and 20 t: a boat that dives pumps out at the full rate, down to the limit."""
    case = load_case("self-propulsion")[0].model_copy(deep=True)
    case.command.dV.law, case.command.dV.value_deg = "fixed", -5.0
    case.command.ballast.P_z = 1e5
    case.run.duration_s, case.run.record_s = 800.0, 0.05
    flown = simulate(case, coefficients)
    rates = np.abs(np.diff(flown["ballast"])) / 0.05
    assert rates.max() == pytest.approx(33.3, rel=1e-9)
    assert flown["ballast"][-1] == pytest.approx(-2e4, rel=1e-12)
    assert np.abs(flown["ballast"]).max() <= 2e4 * (1.0 + 1e-12)


def test_too_deep_pumps_out_and_bow_up_moves_weight_forward(coefficients):
    """Signs of Eq. (11) in the program frame, at the first sample."""
    case = load_case("self-propulsion")[0].model_copy(deep=True)
    case.command.trim_tank = TankCommand(law="pid", P_theta=3.5e-4)
    model = model_of(case, coefficients)
    state, controls, trim = initial_state(case, coefficients.vehicle, model)
    settings = settings_of(case, coefficients.vehicle, state, controls, trim)
    moved = state.copy()
    moved[8] += 2.0
    moved[10] += np.radians(3.0)
    (f, j), (g, q) = progress(settings, state), flat(settings)
    command_boat(g, q, f, j, moved, np.zeros(12), 1e-12)
    command = f[COMMAND : COMMAND + N_COMMANDS]
    assert command[3] == pytest.approx(controls[6] - 2.0 * 1000.0)
    assert command[4] == pytest.approx(controls[7] + 3.0 * 3.5e-4)


def test_vehicle_without_tanks_is_named(campaign, rows):
    vehicle = campaign.vehicle.model_copy(update={"tanks": None})
    with pytest.raises(InputError, match="does not have"):
        model_of(load_case("self-propulsion")[0], Coefficients(vehicle, rows))
