"""Authority: closed forms. Motion in a steady current is that in still water, carried along (Galilei); buoyancy by
Archimedes over depth; a load over the mass matrix; what is off changes no digit."""

from __future__ import annotations

import math
from importlib.resources import files

import numpy as np
import pytest
from pydantic import ValidationError

from ident.analysis.stability import stability
from ident.metrics.seakeeping import encounter_of
from sim.boat.catalogue import STATES
from sim.files.errors import InputError
from sim.flight.case import Case, load_case
from sim.flight.plant import Plant
from sim.flight.sensors import Sensors
from sim.flight.simulate import flow_of, simulate, waves_of
from sim.waves.linear import kinematics


def _text_of(name):
    return (files("sim") / "cases" / f"{name}.toml").read_text(encoding="utf-8")


def _in(case, **water):
    """The case in other water, checked as a file is."""
    data = case.model_dump(exclude_none=True)
    data["environment"] |= water
    return Case.model_validate(data)


def _at_rest(depth, **water):
    case = load_case("hzz20")[0]
    initial = case.initial.model_copy(
        update={"state": "as_given", "speed_mps": 0.0, "depth_m": depth, "revolutions_rps": 0.0, "upright": False}
    )
    return _in(case.model_copy(update={"initial": initial}), **water)


def test_a_boat_in_a_current_moves_as_in_still_water_and_is_carried(coefficients):
    case = load_case("hzz20")[0]
    case = case.model_copy(update={"run": case.run.model_copy(update={"duration_s": 60.0})})
    still = simulate(case, coefficients)
    flowing = simulate(_in(case, current={"speed_mps": 1.5, "direction_deg": 60.0}), coefficients)
    carried = 1.5 * np.array([math.cos(math.radians(60.0)), math.sin(math.radians(60.0))])
    assert flowing["x"] - still["x"] == pytest.approx(carried[0] * still["t"], abs=1e-9)
    assert flowing["y"] - still["y"] == pytest.approx(carried[1] * still["t"], abs=1e-9)
    for name in STATES:
        if name not in "xy":
            assert flowing[name] == pytest.approx(still[name], abs=1e-9)
    assert np.ptp(still["psi"]) > 0.3


@pytest.mark.parametrize(("name", "direction"), [("ss5-4m", 0.0), ("turn20-ss5-4m", 60.0)])
def test_waves_and_boat_are_carried_by_a_current_together(coefficients, name, direction):
    """Galilei again: waves in the water that flows meet the boat as those of still water do.

    The first boat's autopilot keeps its track over ground, which a current ahead does not turn it from.
    """
    case = load_case(name)[0]
    case = case.model_copy(update={"run": case.run.model_copy(update={"duration_s": 40.0})})
    still = simulate(case, coefficients)
    flowing = simulate(_in(case, current={"speed_mps": 1.5, "direction_deg": direction}), coefficients)
    carried = 1.5 * np.array([math.cos(math.radians(direction)), math.sin(math.radians(direction))])
    # Sums of many waves are in single precision.
    close = 1e-9 if still.waves.amplitude.size == 1 else 2e-4
    assert flowing["x"] - still["x"] == pytest.approx(carried[0] * still["t"], abs=close)
    assert flowing["y"] - still["y"] == pytest.approx(carried[1] * still["t"], abs=close)
    for channel in ("u", "w", "z", "theta", "q", "psi"):
        assert flowing[channel] == pytest.approx(still[channel], abs=close)
    assert np.ptp(still["theta"]) > 0.01


def test_a_wave_on_a_current_passes_a_fixed_place_with_the_doppler_frequency():
    """omega + k U cos(mu) at a place over ground (Peregrine 1976, Eq. 2.6); what the water does in it is the same."""
    case = _in(load_case("ss5-4m")[0], current={"speed_mps": 1.2, "direction_deg": 210.0})
    waves = waves_of(case)
    k, omega = waves.number[0], waves.frequency[0]
    passing = omega + k * 1.2 * math.cos(math.radians(210.0 - 180.0))
    time = np.linspace(0.0, 30.0, 301)
    found = kinematics(waves, np.zeros((301, 3)), time)
    assert found.elevation == pytest.approx(waves.amplitude[0] * np.cos(passing * time), abs=1e-9)
    assert np.abs(found.velocity).max() == pytest.approx(omega * waves.amplitude[0], rel=1e-3)
    carried = np.array(flow_of(case)) * 20.0
    beside = kinematics(waves, np.array([*carried, 0.0]), 20.0).elevation
    assert beside == pytest.approx(kinematics(waves_of(load_case("ss5-4m")[0]), np.zeros(3), 20.0).elevation, abs=1e-9)


def test_encounters_are_counted_in_the_water(coefficients):
    """Frequency of encounter of a boat in head seas is that of still water, whatever carries both."""
    case = load_case("ss5-4m")[0]
    waves = waves_of(_in(case, current={"speed_mps": 1.2, "direction_deg": 30.0}))
    time = np.linspace(0.0, 100.0, 501)
    north, east = flow_of(_in(case, current={"speed_mps": 1.2, "direction_deg": 30.0}))
    found = encounter_of(waves, time, (5.0 + north) * time, east * time)
    still = encounter_of(waves_of(case), time, 5.0 * time, 0.0 * time)
    assert (found.speed, found.frequency, found.angle) == pytest.approx((still.speed, still.frequency, still.angle))


def test_what_is_off_or_changes_nothing_is_the_same_to_the_last_digit(coefficients):
    case = load_case("hzz20")[0]
    case = case.model_copy(update={"run": case.run.model_copy(update={"duration_s": 20.0})})
    plain = simulate(case, coefficients).record
    same = _in(
        case, current={"speed_mps": 0.0, "direction_deg": 9.0}, layer=[{"depth_m": 3.0, "density_kgpm3": 1025.0}]
    )
    assert np.array_equal(simulate(same, coefficients).record, plain)


def test_buoyancy_over_layers_and_of_a_hull_pressed_together(coefficients):
    """From rest: vertical acceleration (W - B(z)) / (m + Z_wdot), upright and level."""
    layers = [{"depth_m": 20.0, "density_kgpm3": 1020.0}, {"depth_m": 60.0, "density_kgpm3": 1030.0}]
    for depth, water in (
        (50.0, {"layer": layers}),
        (90.0, {"layer": layers}),
        (50.0, {"hull_compressibility_perm": 1e-5}),
    ):
        plant = Plant(_at_rest(depth, **water), coefficients)
        z, model = plant.state[8], plant._model
        density = np.interp(z, [20.0, 60.0], [1020.0, 1030.0]) / 1025.0 if "layer" in water else 1.0
        share = density * (1.0 - water.get("hull_compressibility_perm", 0.0) * z)
        force = np.zeros(6)
        net = model.weight - model.buoyancy * share
        force[2], force[4] = net, -(model.r_g[0] * model.weight - model.r_b[0] * model.buoyancy * share)
        plant.step()
        assert plant["w"] == pytest.approx(plant.dt * (model.inverse_mass @ force)[2], rel=1e-3)
        assert abs(net) > 1e4
    assert share < 1.0


def test_waves_over_layers_and_layers_out_of_order_are_refused():
    with pytest.raises(ValidationError, match="waves over layers"):
        _in(load_case("ss5-4m")[0], layer=[{"depth_m": 3.0, "density_kgpm3": 1020.0}])
    with pytest.raises(ValidationError, match="without free_surface"):
        _in(load_case("hzz20")[0], free_surface=True, hull_compressibility_perm=1e-5)
    upside = [{"depth_m": 60.0, "density_kgpm3": 1030.0}, {"depth_m": 20.0, "density_kgpm3": 1020.0}]
    with pytest.raises(ValidationError, match="shallow to deep"):
        _in(load_case("hzz20")[0], layer=upside)


def test_a_load_from_outside_accelerates_the_boat_by_its_mass_matrix(coefficients):
    pushed, free = (Plant(_at_rest(50.0), coefficients) for _ in range(2))
    pushed.loads[:] = 1e5, -2e5, 3e5, 1e6, -2e6, 3e6
    wanted = pushed._model.inverse_mass @ pushed.loads
    change = pushed.step() - free.step()
    assert change[:6] / pushed.dt == pytest.approx(wanted, rel=2e-2, abs=1e-3 * np.abs(wanted[:3]).max())
    pushed.reset()
    assert not pushed.loads.any()
    assert np.array_equal(pushed.step(), free.state)


def test_failures_stay_until_they_are_repaired(coefficients):
    plant = Plant(load_case("hzz20")[0], coefficients)
    level = plant["stern_plane_1"]
    plant.stick("stern_plane_1")
    plant.step(100, dH=0.3)
    assert plant["stern_plane_1"] == level
    plant.repair()
    plant.reset()
    start = plant.state.copy()
    plant.stick("stern_plane_1", math.radians(10.0))
    plant.step(100, dH=0.3)
    assert plant["stern_plane_1"] == math.radians(10.0)
    assert abs(plant["stern_plane_2"]) > 0.25
    plant.reset()
    plant.step(100, dH=0.3)
    assert plant["stern_plane_1"] == math.radians(10.0)
    plant.repair()
    plant.step(200)
    assert abs(plant["stern_plane_1"]) > 0.25
    plant.reset(state=start)
    whole = Plant(load_case("hzz20")[0], coefficients)
    plant.lose_thrust(1.0)
    # Without any thrust the boat's resistance is what slows it, and no torque heels it.
    drag = (plant.step() - start)[0] / plant.dt
    assert drag < -1e-3
    assert abs((whole.step() - start)[0]) < 1e-9
    plant.repair()
    plant.reset()
    assert np.array_equal(plant.step(), whole.state)
    with pytest.raises(InputError, match="stern_plane_1"):
        plant.stick("rudder")
    with pytest.raises(InputError, match="up to"):
        plant.stick("stern_plane_1", 3.0)
    with pytest.raises(InputError, match="between 0 and 1"):
        plant.lose_thrust(1.5)


def test_sensors_have_the_noise_they_state(coefficients):
    plant = Plant(load_case("hzz20")[0], coefficients)
    sensors = Sensors(noise={"z": 0.2}, bias={"z": 1.0, "u": 0.0}, seed=7)
    read = np.array([sensors.read(plant)["z"] for _ in range(4000)])
    assert read.mean() == pytest.approx(plant["z"] + 1.0, abs=4 * 0.2 / math.sqrt(4000))
    assert read.std() == pytest.approx(0.2, rel=0.05)
    assert sensors.read(plant)["u"] == plant["u"]
    assert Sensors({"z": 0.2}, seed=7).read(plant) == Sensors({"z": 0.2}, seed=7).read(plant)
    with pytest.raises(InputError, match="zero or more"):
        Sensors({"z": -1.0})
    with pytest.raises(InputError, match="finite"):
        Sensors({}, bias={"z": math.nan})


def test_stability_does_not_leave_out_layers_in_silence(fitted_db, tmp_path):
    text = _text_of("hzz20").replace("[environment]", "[environment]\nhull_compressibility_perm = 1e-5", 1)
    (tmp_path / "pressed.toml").write_text(text)
    with pytest.raises(InputError, match="hull_compressibility_perm"):
        stability(tmp_path / "pressed.toml", db=fitted_db, speeds=[4.0], depths=[50.0])
