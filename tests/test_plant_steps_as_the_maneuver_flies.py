"""Authority: the simulated maneuver. A boat stepped from outside with its commands makes the same motion."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.plant import Plant
from sim.flight.simulate import simulate

DOCS = Path(__file__).parents[1] / "docs" / "plant-model.md"


def _short(name, duration):
    case = load_case(name)[0]
    run = case.run.model_copy(update={"duration_s": duration, "record_s": case.run.step_s})
    return case.model_copy(update={"run": run})


def _replayed(case, coefficients):
    """The flight, and states of a plant that is given the flight's commands."""
    flown = simulate(case, coefficients)
    plant = Plant(case, coefficients)
    states = [plant.state.copy()]
    # Of revolutions and tanks the record has what was reached: commanded, it is reached again a sample later.
    reached = [name for name in ("n", "ballast", "trim_tank") if name in plant.commands]
    for k in range(len(flown["t"]) - 1):
        after = {name: flown[name][k + 1] for name in reached}
        states.append(plant.step(dV=flown["dV"][k], dH=flown["dH"][k], **after))
    return flown, np.array(states), plant


def test_commands_of_a_turning_circle_give_its_states_to_the_last_digit(coefficients):
    flown, states, plant = _replayed(_short("turning-circle", 40.0), coefficients)
    assert np.array_equal(states, flown.record[:, 1:13])
    assert plant.time == pytest.approx(40.0)
    assert plant["stern_plane_1"] == flown["stern_plane_1"][-1]
    assert plant["psi"] == flown["psi"][-1] > 0.3
    assert plant["D0"] == flown["D0"][-1]


def test_commands_in_waves_give_the_states_of_the_flight(coefficients):
    """Time is a sum of steps there and a product here: the same to its rounding."""
    flown, states, plant = _replayed(_short("turn20-ss5-4m", 20.0), coefficients)
    assert np.ptp(flown["theta"]) > 0.002
    assert np.abs(states - flown.record[:, 1:13]).max() < 1e-8
    plant.reset()
    assert plant.time == 0.0
    assert np.array_equal(plant.state, states[0])


def test_many_samples_at_once_are_as_many_single_ones(coefficients):
    case = load_case("hzz20")[0]
    one, many = Plant(case, coefficients), Plant(case, coefficients)
    for _ in range(40):
        one.step(dH=0.2)
    assert np.array_equal(many.step(40, dH=0.2), one.state)
    assert many.time == pytest.approx(one.time)


def test_commands_go_through_the_actuators(coefficients):
    """Planes move at their rate to their limit; revolutions within those of the propeller; a level boat stays."""
    plant = Plant(load_case("hzz20")[0], coefficients)
    start = plant.state.copy()
    plant.step(200)
    assert np.abs(plant.state[[2, 4, 5, 8]] - start[[2, 4, 5, 8]]).max() < 1e-6
    plane = plant.vehicle.planes[0]
    before = plant[plane.name]
    plant.step(dH=3.0)
    assert abs(plant[plane.name] - before) == pytest.approx(math.radians(plane.rate_degps) * plant.dt)
    plant.step(2000, n=1e6)
    assert abs(plant[plane.name]) == pytest.approx(math.radians(plane.limit_deg))
    assert plant["n"] == pytest.approx(plant.vehicle.propeller.limits.value[1])


def test_wrong_commands_are_named_and_move_nothing(coefficients):
    plant = Plant(load_case("hzz20")[0], coefficients)
    for commands, words in (
        ({"dh": 0.1}, "command dh.*dV, dH, n"),
        ({"ballast": 1.0}, "command ballast.*command.ballast"),
        ({"dH": math.nan}, "command dH.*finite"),
        ({"dH": 20.0}, "command dH.*radians"),
    ):
        with pytest.raises(InputError, match=words):
            plant.step(**commands)
    with pytest.raises(InputError, match="steps"):
        plant.step(0)
    with pytest.raises(KeyError, match="theta"):
        plant["pitch"]
    assert plant.time == 0.0


def test_a_database_and_its_mistakes(fitted_db, tmp_path):
    assert Plant.from_database("hzz20", fitted_db)["U"] == pytest.approx(load_case("hzz20")[0].initial.speed_mps)
    with pytest.raises(InputError, match="no coefficient database"):
        Plant.from_database("hzz20", str(tmp_path / "absent"))


def test_the_example_of_the_documentation_runs(fitted_db, tmp_path, monkeypatch):
    """Own heading controller: the boat is on its new heading at the end."""
    program = DOCS.read_text("utf-8").split("```python\n")[1].split("```")[0]
    assert len(program.strip().splitlines()) <= 12
    names = {}
    exec(program.replace('"coeff_db"', repr(fitted_db)), names)
    assert names["boat"]["psi"] == pytest.approx(math.radians(30.0), abs=0.05)
