"""Speed of the wave loads beside a calm-water step, in one run: ``python -m sim.bench.waves``.

A step in waves is the whole one of the simulation: sums of the waves when they are due, and
wave loads, relative motion and emergence in each of the four right-hand sides.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import click
import numpy as np
from numba import njit

from sim.bench.ratios import _best
from sim.boat.coefficients import Coefficients
from sim.boat.database import read_rows
from sim.boat.mass import Environment
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.simulate import simulate
from sim.hull.surface import read_geometry
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace
from sim.waves import loads as wave_loads
from sim.waves.in_waves import surroundings, volume_points, water_around
from sim.waves.linear import regular
from sim.waves.pressure import froude_krylov, reference_load
from sim.waves.spectra import Spectrum, realise, sea_state
from sim.waves.surroundings import near_of, prepare


@njit(cache=True)
def _steps(m, w, states, controls, rate, step, around, s, k, stage, out):
    near = near_of(around)
    for i in range(states.shape[0]):
        prepare(around, states[i], i * step)
        kernel.step(m, w, states[i], controls[i], rate, step, near, s, k, stage, out)


@njit(cache=True)
def _pressures(waves, volume, states, out):
    for i in range(states.shape[0]):
        froude_krylov(waves, volume, states[i], 0.1 * i, out)


@njit(cache=True)
def _evaluations(sea, states, sums, value, slope):
    for i in range(states.shape[0]):
        wave_loads.evaluate(sea, states[i], 0.1 * i, sums, value, slope)


def _voyage(model, states, controls, rate, step, out, water):
    work = workspace(model, surroundings(water, model.added_mass) if water else ())
    scratch = (work.around, work.real, work.whole, work.stage)
    _steps(model.real, model.whole, states, controls, rate, step, *scratch, out)


def _alternately(calls: list[Callable[[], object]], tries: int) -> list[float]:
    """Shortest time of each call [s], taken in turn so that other load meets all alike."""
    best = [np.inf] * len(calls)
    for k in range(tries + 1):
        for i, call in enumerate(calls):
            start = time.perf_counter()
            call()
            # The first round compiles.
            best[i] = min(best[i], time.perf_counter() - start) if k else np.inf
    return best


@click.command()
@click.option("--db", default="coeff_db", show_default=True, help="Coefficient database.")
@click.option("--case", "name", default="hzz20", show_default=True, help="States are taken along this maneuver.")
@click.option("--components", default=200, show_default=True, help="Of the seaway.")
@click.option("--step", default=0.05, show_default=True, help="Integration step [s].")
@click.option("--depth", default=10.0, show_default=True, help="Depth D0 of the first state [m].")
@click.option("--tries", default=60, show_default=True)
def main(db: str, name: str, components: int, step: float, depth: float, tries: int) -> None:
    """Measure wave loads along a maneuver.

    Example: python -m sim.bench.waves --db coeff_db --components 200
    """
    try:
        case, where = load_case(name)
        vehicle = load_vehicle(case.vehicle, beside=where)
        rows, version = read_rows(db, vehicle=vehicle.name)
    except InputError as error:
        raise click.UsageError(str(error)) from error
    coefficients = Coefficients(vehicle, rows)
    environment = Environment(case.environment.density_kgpm3, case.environment.gravity_mps2)
    model, flown = assemble(coefficients, environment), simulate(case, coefficients)
    # States a step apart, so that the sums meet the boat where they expect it.
    clock = np.arange(0.0, flown.record[-1, 0], step)
    states = np.stack([np.interp(clock, flown.record[:, 0], flown.record[:, k]) for k in range(1, 13)], axis=1)
    states[:, 8] += depth - states[0, 8] - model.sail_top
    controls = np.zeros((len(states), len(vehicle.planes) + 1)) + flown.record[0, 13 : 14 + len(vehicle.planes)]
    rate, out, n = np.zeros(controls.shape[1]), np.zeros(12), len(states)

    state = sea_state(5)
    density, gravity = environment.density, environment.gravity
    one = regular(state.height, gravity * state.period**2 / (2.0 * np.pi), np.pi, density, gravity)
    many = realise(Spectrum("bretschneider", state.height, state.period, np.pi, 5.0), components, 1, density, gravity)
    waters = [water_around(coefficients, environment, waves) for waves in (one, many)]
    volume = volume_points(vehicle, environment)
    click.echo(f"{vehicle.name}, database version {version}, one core")
    assert vehicle.geometry is not None
    mesh = read_geometry(vehicle.geometry)
    start = time.perf_counter()
    reference_load(mesh, one, states[0], 0.0)
    triangles = time.perf_counter() - start
    fast = _best(lambda: _pressures(one, volume, states, np.zeros(6)), n, tries)
    click.echo(f"pressure load, {len(mesh.triangles)} triangles (NumPy)       {1e6 * triangles:8.0f} us")
    click.echo(f"pressure load, {len(volume.volumes)} volume points, 1 component {1e6 * fast:8.2f} us")
    few = states[:: max(1, n // 500)]
    steps: list[Callable[[], object]] = [partial(_voyage, model, states, controls, rate, step, out, None)]
    for water, count in zip(waters, (1, components), strict=True):
        sea, sums = water.sea, wave_loads.passage(water.sea)
        value, slope = np.zeros(sums.value.shape[1]), np.zeros(sums.value.shape[1])
        whole = _best(partial(_evaluations, sea, few, sums, value, slope), len(few), tries)
        click.echo(f"every wave quantity with rates, {count:3d} components {1e6 * whole:8.2f} us")
        steps.append(partial(_voyage, model, states, controls, rate, step, out, water))
    calm, single, seaway = (t / n for t in _alternately(steps, tries))
    click.echo(f"{n} states along {case.name} from D0 = {depth} m, step {step} s")
    click.echo(f"RK4 step, calm                              {1e6 * calm:8.2f} us")
    click.echo(f"RK4 step, regular waves                     {1e6 * single:8.2f} us, {single / calm:.2f} of calm")
    click.echo(
        f"RK4 step, {components:3d} components                    {1e6 * seaway:8.2f} us, {seaway / calm:.2f} of calm"
    )


if __name__ == "__main__":
    main()
