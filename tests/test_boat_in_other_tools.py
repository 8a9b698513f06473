"""Authority: the simulated maneuver. A zigzag in calm water and a boat in sea state 5 are the same flight by
Plant, by C and what is built of it, and from a file."""

from __future__ import annotations

import os
import shutil
import subprocess

import fmpy
import fmpy.simulation
import fmpy.validation
import numpy as np
import pytest

from ident.exports.c_source import export_c
from ident.exports.fmu import export_fmu
from ident.validation.boats import Fleet
from sim.boat.catalogue import STATES
from sim.flight.case import Case, load_case
from sim.flight.plant import Plant
from sim.flight.simulate import fly
from sim.kernel.rhs import rhs
from sim.waves.surroundings import prepare

CASES = {"hzz20": 100.0, "ss5-4m": 20.0}
CURRENT = {
    "current": {"speed_mps": 1.2, "direction_deg": 70.0},
    "layer": [{"depth_m": 20.0, "density_kgpm3": 1020.0}, {"depth_m": 90.0, "density_kgpm3": 1030.0}],
    "hull_compressibility_perm": 1e-5,
}
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1")
# Flies the case and then the boat by commands, and prints both.
PROGRAM = r"""
#include "bb2.h"
#include <stdio.h>
static bb2_boat boat;
static double record[BB2_ROWS * BB2_COLUMNS];
int main(void)
{
    bb2_reset(&boat);
    int rows = bb2_fly(&boat, record);
    for (int i = 0; i < rows * BB2_COLUMNS; ++i) {
        printf("%.17g\n", record[i]);
    }
    bb2_reset(&boat);
    boat.commands[BB2_TO_DH] = 0.2;
    boat.commands[BB2_TO_N] *= 1.1;
    if (!bb2_step(&boat, 40) || !bb2_advance(&boat, 0.123) || !bb2_step(&boat, 1)) {
        return 1;
    }
    boat.commands[BB2_TO_DV] = -0.1;
    if (!bb2_advance(&boat, 7.7)) {
        return 1;
    }
    double rate[BB2_STATES];
    bb2_rate(&boat, rate);
    for (int i = 0; i < BB2_STATES; ++i) {
        printf("%.17g\n%.17g\n", boat.state[i], rate[i]);
    }
    return 0;
}
"""


def _case(name):
    case = load_case(name)[0]
    run = case.run.model_copy(update={"duration_s": CASES[name], "record_s": case.run.step_s})
    return case.model_copy(update={"run": run})


@pytest.fixture(scope="module")
def compiler():
    found = shutil.which(os.environ.get("CC", "cc"))
    if not found:
        pytest.skip("needs a C compiler")
    return found


@pytest.fixture(scope="module")
def boat(coefficients, fitted_db):
    return Fleet(fitted_db).boat(coefficients.vehicle)


@pytest.fixture(scope="module", params=list(CASES))
def flown(request, boat):
    """A case, and its flight by the simulator."""
    case = _case(request.param)
    return case, fly(case, boat.vehicle, boat.model(case), boat.water(case))


def _close(found, wanted, scale):
    """Largest difference, over the size that each column reaches."""
    return float((np.abs(found - wanted) / np.maximum(np.abs(scale).max(axis=0), 1.0)).max())


def test_generated_c_compiles_without_a_warning_and_flies_as_the_simulator(flown, boat, compiler, tmp_path):
    _flies_by_c_as_the_simulator(*flown, boat, compiler, tmp_path)


def test_generated_c_has_the_current_and_the_layers(boat, compiler, tmp_path):
    data = _case("hzz20").model_dump(exclude_none=True)
    data["environment"] |= CURRENT
    data["run"]["duration_s"] = 20.0
    case = Case.model_validate(data)
    simulation = fly(case, boat.vehicle, boat.model(case), boat.water(case))
    assert np.ptp(simulation["z"]) > 0.1
    _flies_by_c_as_the_simulator(case, simulation, boat, compiler, tmp_path)


def test_generated_c_has_the_current_that_carries_the_waves(boat, compiler, tmp_path):
    data = _case("ss5-4m").model_dump(exclude_none=True)
    data["environment"]["current"] = CURRENT["current"]
    data["run"]["duration_s"] = 5.0
    case = Case.model_validate(data)
    simulation = fly(case, boat.vehicle, boat.model(case), boat.water(case))
    assert simulation["y"][-1] > 5.0
    _flies_by_c_as_the_simulator(case, simulation, boat, compiler, tmp_path)


def _flies_by_c_as_the_simulator(case, simulation, boat, compiler, tmp_path):
    done = export_c(boat, case, "coeff_db", tmp_path)
    assert [p.rsplit("/", 1)[1] for p in done["files"]] == ["bb2.h", "bb2.c"]
    (tmp_path / "main.c").write_text(PROGRAM)
    subprocess.run([compiler, *STRICT, "main.c", "bb2.c", "-lm", "-o", "boat"], cwd=tmp_path, check=True)
    printed = subprocess.run([tmp_path / "boat"], capture_output=True, text=True, check=True).stdout.split()
    numbers = np.array(printed, dtype=float)
    record = numbers[:-24].reshape(-1, simulation.record.shape[1])
    assert record.shape == simulation.record.shape
    assert _close(record, simulation.record, simulation.record) < 1e-9
    plant = Plant(case, boat.coefficients)
    plant.step(40, dH=0.2, n=1.1 * plant.commands["n"])
    plant.advance(0.123)
    plant.step()
    plant.advance(7.7, dV=-0.1)
    assert np.abs(numbers[-24::2] - plant.state).max() < 1e-9
    rate = _rate(plant)
    assert np.abs(numbers[-23::2] - rate).max() < 1e-9 < np.abs(rate[:6]).max()


def _rate(plant):
    found, work = np.zeros(12), plant._work
    if work.around:
        prepare(work.around, plant.state, plant.time)
    rhs(plant._model, plant.state, plant.controls, work, found)
    return found


def test_plant_flies_the_zigzag_with_its_reversals_inside_samples(boat):
    """Parts of a sample as the loop flies them: commands of the record, cut at the executes."""
    case = _case("hzz20")
    flown = fly(case, boat.vehicle, boat.model(case), boat.water(case))
    plant, states = Plant(case, boat.coefficients), []
    for start, length, commands in _pieces(case, flown):
        if start == flown["t"][len(states)]:
            states.append(plant.state.copy())
        plant.advance(length, **commands)
    assert len(flown.executes) > 2
    assert _close(np.array(states), flown.record[:-1, 1:13], flown.record[:, 1:13]) < 1e-9


def _pieces(case, flown):
    """Time, length and commands of each part of a flight in which they stand still."""
    reached = ["n", *(k for k in ("ballast", "trim_tank") if k in flown.columns)]
    for k, t in enumerate(flown["t"][:-1]):
        commands = {"dV": flown["dV"][k], "dH": flown["dH"][k], **{n: flown[n][k + 1] for n in reached}}
        start, end = t, t + case.run.step_s
        for at, command in flown.executes[1:]:
            if t < at <= end:
                yield start, at - start, commands
                start, commands = at, commands | {"dH": command}
        yield start, end - start, commands


def test_an_fmu_is_valid_and_flies_as_the_simulator(flown, boat, compiler, tmp_path):
    """Authority beside: FMI's own rules as fmpy checks them. Tolerance: 1e-9 of what each state reaches.

    FMI 2.0 flies the one case, 3.0 the other.
    """
    case, simulation = flown
    fmi = 2 if case.name == "hzz20" else 3
    path = tmp_path / "boat.fmu"
    done = export_fmu(boat, case, "coeff_db", path, fmi)
    assert fmpy.validation.validate_fmu(str(path)) == []
    assert done["inputs"][:3] == ["dV", "dH", "n"]
    assert done["outputs"][:12] == list(STATES)
    described = fmpy.read_model_description(str(path))
    refs = {v.name: v.valueReference for v in described.modelVariables}
    unit = fmpy.simulation.instantiate_fmu(fmpy.extract(str(path), tmp_path / "unit"), described, "CoSimulation")
    get = unit.getReal if fmi == 2 else unit.getFloat64
    give = unit.setReal if fmi == 2 else unit.setFloat64
    if fmi == 2:
        unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    outputs, states = [refs[n] for n in STATES], []
    for start, length, commands in _pieces(case, simulation):
        if len(states) < len(simulation["t"]) and start == simulation["t"][len(states)]:
            states.append(get(outputs))
        give([refs[n] for n in commands], list(commands.values()))
        unit.doStep(currentCommunicationPoint=start, communicationStepSize=length)
    unit.terminate()
    unit.freeInstance()
    wanted = simulation.record[: len(states), 1:13]
    assert len(states) == len(simulation["t"]) - 1
    assert _close(np.array(states), wanted, wanted) < 1e-9
