"""Times of the simulator, and their ratios, all in one process and one run."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np

from sim.bench.boat import frozen_boat
from sim.bench.loops import rates, steps
from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.flight.case import Case, load_case
from sim.flight.fleet import FleetPlant
from sim.flight.maneuver import CONTROLS, STATE
from sim.flight.plant import Plant
from sim.flight.simulate import environment_of, fly, samples_of, simulate
from sim.kernel import plain
from sim.kernel.assemble import assemble
from sim.kernel.layout import Model, workspace
from sim.waves.in_waves import Water, surroundings, water_around
from sim.waves.linear import regular
from sim.waves.spectra import Spectrum, realise, sea_state

COMPONENTS, FLIGHTS, DEPTH = 200, 1000, 10.0
# Steps of a try, so few that one in many is not interrupted; right-hand sides in NumPy; steps of a plant.
_STEPS, _FEW, _PLANT = 400, 1, 20
# Resolution of a clock with which they can be timed [s].
_FINE = 1e-5


def shortest(calls: Mapping[str, Callable[[], object]], tries: int) -> dict[str, float]:
    """Shortest time of each call [s], taken in turn so that other load meets all alike.

    Of the processor, where it is told finely enough: what waits for its turn on a busy machine is not slower.
    """
    fine = time.get_clock_info("thread_time").resolution < _FINE
    clock = time.thread_time if fine else time.perf_counter
    best = dict.fromkeys(calls, np.inf)
    for call in calls.values():
        call()
    for _ in range(tries):
        for name, call in calls.items():
            start = clock()
            call()
            best[name] = min(best[name], clock() - start)
    return best


def _step_apart(case: Case, coefficients: Coefficients, model: Model) -> tuple[np.ndarray, np.ndarray]:
    """States a step apart along a flight, near the surface, so that sums meet the boat where they expect it."""
    flown = simulate(case, coefficients)
    clock = np.arange(0.0, flown["t"][-1], case.run.step_s)
    states = np.stack([np.interp(clock, flown["t"], flown.record[:, k]) for k in range(STATE, CONTROLS)], axis=1)
    states[:, 8] += DEPTH - states[0, 8] - model.sail_top
    planes = len(coefficients.vehicle.planes)
    controls = np.stack(
        [np.interp(clock, flown["t"], flown.record[:, CONTROLS + k]) for k in range(planes + 1)], axis=1
    )
    return states, controls


def _voyage(
    model: Model, states: np.ndarray, controls: np.ndarray, h: float, water: Water | None
) -> Callable[[], None]:
    """A step from each state; the sums over the waves start afresh each time."""
    around = surroundings(water, model.added_mass) if water else ()
    work, rate, out = workspace(model, around), np.zeros(controls.shape[1]), np.zeros(12)
    scratch = (work.real, work.whole, work.stage)
    return lambda: steps(model.real, model.whole, states, controls, rate, h, around, *scratch, out)


def _voyages(model: Model, states: np.ndarray, controls: np.ndarray, h: float, _: int) -> None:
    voyage = _voyage(model, states, controls, h, None)
    for _ in range(500):
        voyage()


def _waters(coefficients: Coefficients, environment: Environment) -> list[Water]:
    """Sea state 5 as one regular wave, and as a spectrum of components."""
    state, density, gravity = sea_state(5), environment.density, environment.gravity
    one = regular(state.height, gravity * state.period**2 / (2.0 * np.pi), np.pi, density, gravity)
    many = realise(Spectrum("bretschneider", state.height, state.period, np.pi, 5.0), COMPONENTS, 1, density, gravity)
    return [water_around(coefficients, environment, waves) for waves in (one, many)]


def ratios(tries: int = 300, say: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Times and ratios of the right-hand side, a step, a batch of flights and a plant.

    Parameters
    ----------
    tries : Of each time, of which the shortest counts.
    say : Told what is measured next.

    Returns
    -------
    Name -> number: microseconds, steps a second, ratios.
    """
    coefficients, (case, _) = frozen_boat(), load_case("hzz20")
    environment = environment_of(case)
    model = assemble(coefficients, environment)
    states, controls = (some[:_STEPS] for some in _step_apart(case, coefficients, model))
    work, dy, h = workspace(model), np.zeros(12), case.run.step_s
    flat = (model.real, model.whole)
    few = range(0, len(states), len(states) // _FEW)
    waters = _waters(coefficients, environment)
    calls: dict[str, Callable[[], object]] = {
        "rhs": lambda: rates(*flat, states, controls, work.real, work.whole, dy),
        "calm": _voyage(model, states, controls, h, None),
        "regular": _voyage(model, states, controls, h, waters[0]),
        "components": _voyage(model, states, controls, h, waters[1]),
    }
    say("right-hand sides and steps")
    seconds = {k: v / len(states) for k, v in shortest(calls, tries).items()}
    say("the same in NumPy")
    numpy_calls = {"numpy": lambda: [plain.rhs(model, states[i], controls[i]) for i in few]}
    seconds["numpy"] = shortest(numpy_calls, tries)["numpy"] / len(few)
    say("a plant")
    plant = Plant(case, coefficients)
    seconds["plant"] = (
        shortest({"plant": lambda: [plant.step(dH=0.01) for _ in range(_PLANT)]}, tries)["plant"] / _PLANT
    )
    say(f"{FLIGHTS} flights")
    flight_steps, vehicle = samples_of(case)[0], coefficients.vehicle
    one_flight = shortest({"flight": lambda: fly(case, vehicle, model, None)}, max(tries // 10, 3))["flight"]
    free = _free_cores(partial(_voyages, model, states, controls, h))
    elapsed, busy = _busy(lambda k: fly(case, vehicle, model, None), FLIGHTS)
    batch, alone = FLIGHTS * flight_steps / elapsed, flight_steps / one_flight
    return {
        "rhs_us": 1e6 * seconds["rhs"],
        "rk4_steps_per_s": 1.0 / seconds["calm"],
        "numpy_us": 1e6 * seconds["numpy"],
        "numpy_ratio": seconds["numpy"] / seconds["rhs"],
        "waves_ratio": seconds["regular"] / seconds["calm"],
        "components_ratio": seconds["components"] / seconds["calm"],
        "flight_steps_per_s": alone,
        "flight_ratio": one_flight / flight_steps / seconds["calm"],
        "batch_steps_per_s": batch,
        "batch_efficiency": batch / alone / (os.cpu_count() or 1),
        "busy_cores": busy,
        "free_cores": free,
        "plant_step_us": 1e6 * seconds["plant"],
        "plant_ratio": seconds["plant"] / seconds["calm"],
        "cores": os.cpu_count() or 1,
    }


def _busy(call: Callable[[int], object], times: int) -> tuple[float, float]:
    """Time that many calls take over all cores [s], and how many cores they kept busy."""
    start, used = time.perf_counter(), time.process_time()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(call, range(times)))
    elapsed = time.perf_counter() - start
    return elapsed, (time.process_time() - used) / elapsed


def _free_cores(call: Callable[[int], object]) -> float:
    """How many calls side by side get done in the time of one: fewer than cores beside other work or half cores."""
    cores = os.cpu_count() or 1
    return cores * _busy(call, 1)[0] / _busy(call, cores)[0]


def fleets(boats: int = FLIGHTS, samples: int = 40) -> dict[str, float]:
    """Steps a second of many boats moved side by side, over all cores: in calm water, and each in a sea of its own.

    Parameters
    ----------
    boats : Of a fleet. samples : Control samples it is moved on by.
    """
    coefficients, (case, _) = frozen_boat(), load_case("turn20-ss5-23.69m")
    speeds = {}
    for name, flown in (("calm", case.model_copy(update={"waves": None})), ("waves", case)):
        fleet = FleetPlant(flown, coefficients, boats)
        phases = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, fleet.phases.shape)
        fleet.reset(phases=phases if phases.size else None)
        fleet.step()
        start = time.perf_counter()
        fleet.step(samples)
        speeds[f"fleet_{name}_steps_per_s"] = boats * samples / (time.perf_counter() - start)
    return speeds


def jsbsim_us(tries: int = 30) -> dict[str, float]:
    """Time of ``run()`` of JSBSim's c172x and f16 [us]; empty when it is not installed."""
    try:
        import jsbsim
    except ImportError:
        return {}
    times = {}
    for name, speed in (("c172x", 200.0), ("f16", 500.0)):
        plane = jsbsim.FGFDMExec(None)
        plane.set_debug_level(0)
        plane.load_model(name)
        plane["ic/h-sl-ft"], plane["ic/u-fps"] = 5000.0, speed
        plane.run_ic()
        times[f"jsbsim_{name}_us"] = 1e4 * shortest({"run": partial(_run_often, plane)}, tries)["run"]
    return times


def _run_often(plane: Any) -> None:
    for _ in range(100):
        plane.run()
