"""Authority: the boat itself, by small changes of what goes in; python-control's own margins; the plane models."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

import ident
from ident.analysis.figures import response
from sim.flight.case import load_case
from sim.flight.plant import Plant

SPEED, DEPTH = 5.14444, 25.0


@pytest.fixture(scope="module")
def found(fitted_db):
    return ident.stability("hzz20", db=fitted_db, speeds=[SPEED], depths=[DEPTH])


def test_whole_system_has_the_roots_of_the_plane_models(found):
    (state,) = found
    system = found.to_ss()
    assert isinstance(system, control.StateSpace)
    assert system.state_labels[:12] == ["u", "v", "w", "p", "q", "r", "x", "y", "z", "phi", "theta", "psi"]
    assert system.input_labels[:2] == ["dV", "dH"]
    assert {"stern_plane_1", "n", "ballast", "X_wave", "N_wave"} <= set(system.input_labels)
    assert not system.D.any()
    whole = state.state_space()
    for name in ("vertical", "horizontal"):
        kept = [whole.states.index(s) for s in state.linear[name].states]
        assert whole.a[np.ix_(kept, kept)] == pytest.approx(np.array(state.linear[name].a), abs=1e-7)
        axis, b = state.linear[name].command, np.array(state.linear[name].b)
        # Commands go through the actuators: at rest they are reached.
        planes = -whole.a[12:, 12:] @ np.eye(whole.a.shape[0] - 12)
        reached = np.linalg.solve(planes, whole.b[12:, whole.inputs.index(axis)])
        assert (whole.a[:12, 12:] @ reached)[kept] == pytest.approx(b, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(("name", "size"), [("dV", 1e-3), ("dH", 1e-3), ("n", 1e-3)])
def test_small_commands_move_the_system_as_they_move_the_boat(found, coefficients, name, size):
    case = load_case("hzz20")[0]
    case = case.model_copy(update={"initial": case.initial.model_copy(update={"upright": False})})
    plant = Plant(case, coefficients)
    start = plant.state.copy()
    base = plant.step(200)
    plant.reset()
    moved = plant.step(200, **{name: plant.commands[name] + size}) - base
    system = found.to_ss()
    given = np.zeros((len(system.input_labels), 201))
    given[system.input_labels.index(name)] = size
    answer = control.forced_response(system, np.linspace(0.0, 10.0, 201), given).outputs[:, -1]
    assert np.abs(start[[2, 4, 5]]).max() < 0.2
    kept = {"dV": [2, 4, 8, 10], "dH": [1, 5, 11], "n": [0, 6]}[name]
    assert answer[kept] == pytest.approx(moved[kept], rel=0.08)


def test_ballast_and_loads_act_as_newton_says(found):
    """A load at rest: its acceleration by the mass matrix; a tonne of ballast sinks the boat."""
    whole = found.states[0].state_space()
    by_load = whole.b[:6, -6:]
    assert by_load == pytest.approx(by_load.T, rel=1e-9, abs=1e-12)
    assert (np.linalg.eigvalsh(by_load) > 0.0).all()
    heave = whole.b[:6, whole.inputs.index("ballast")][2]
    assert heave == pytest.approx(9.81 * by_load[2, 2], rel=0.05)


def test_the_worked_depth_controller_has_margins_and_holds_the_boat(found, coefficients):
    """LQR on depth and pitch: phase margin of 60 degrees and more (Safonov and Athans 1977), and the boat arrives."""
    system = found.to_ss()
    kept = [system.state_labels.index(s) for s in ("w", "q", "z", "theta")]
    a, b = system.A[np.ix_(kept, kept)], found.states[0].linear["vertical"]
    column = np.array(b.b)[[b.states.index(s) for s in ("w", "q", "z", "theta")]][:, None]
    gain, _, roots = control.lqr(a, column, np.diag([0.0, 0.0, 1e-3, 1.0]), np.eye(1))
    assert (roots.real < 0.0).all()
    loop = control.ss(a, column, gain, 0.0)
    _, phase, *_ = control.stability_margins(loop)
    assert phase > 60.0
    plant = Plant(load_case("hzz20")[0], coefficients)
    held = plant.state[[2, 4, 8, 10]].copy()
    while plant.time < 200.0:
        error = plant.state[[2, 4, 8, 10]] - held - np.array([0.0, 0.0, 5.0, 0.0])
        plant.step(dV=plant.trim.dV - float(gain[0] @ error))
    assert plant["z"] - held[2] == pytest.approx(5.0, abs=0.5)
    assert abs(plant["theta"]) < math.radians(3.0)


def test_figure_of_roots_and_answers(found, tmp_path):
    from ident.analysis.figures import stability_figure

    linear = found.states[0].linear["horizontal"]
    still = response(linear, "r", np.array([1e-9]))[0]
    rest = -np.linalg.solve(np.array(linear.a), np.array(linear.b))[linear.states.index("r")]
    assert still == pytest.approx(rest)
    for ending in (".png", ".svg", ".pdf"):
        assert stability_figure(found, tmp_path / f"roots{ending}").stat().st_size > 5000
    with pytest.raises(ident.InputError, match=r"\.png"):
        stability_figure(found, tmp_path / "roots.jpg")


def test_there_is_no_linear_model_about_revolutions_that_the_propeller_lacks(coefficients, environment):
    from ident.analysis.stability import stability_at
    from ident.analysis.state_space import state_space

    fast = stability_at(coefficients, environment, 60.0, DEPTH)
    assert fast.linear == {}
    with pytest.raises(ident.InputError, match="propeller's limits"):
        state_space(coefficients, environment, 60.0, DEPTH, 0.1)
