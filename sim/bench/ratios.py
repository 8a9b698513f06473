"""Speed of the compiled right-hand side, measured side by side: ``python -m sim.bench``.

Prints microseconds a right-hand side, RK4 steps a second on one core, and the ratio to a
plain-NumPy right-hand side of the same model, all in one process and one run.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import click
import numpy as np
from numba import njit

from sim.boat.coefficients import Coefficients
from sim.boat.database import read_rows
from sim.boat.mass import Environment
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.simulate import simulate
from sim.kernel import plain
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace


@njit(cache=True)
def _many_rhs(m, w, states, controls, s, k, dy):
    for i in range(states.shape[0]):
        kernel.fill_rate(m, w, states[i], controls[i], (), s, k, dy)


@njit(cache=True)
def _many_steps(m, w, states, controls, rate, s, k, stage, out):
    for i in range(states.shape[0]):
        kernel.step(m, w, states[i], controls[i], rate, 0.05, (), s, k, stage, out)


def _best(call: Callable[[], object], count: int, tries: int) -> float:
    """Shortest time a call [s] over several tries, so that other load counts least."""
    call()
    best = np.inf
    for _ in range(tries):
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return best / count


@click.command()
@click.option("--db", default="coeff_db", show_default=True, help="Coefficient database.")
@click.option("--case", "name", default="hzz20", show_default=True, help="States are taken along this maneuver.")
@click.option("--tries", default=200, show_default=True)
def main(db: str, name: str, tries: int) -> None:
    """Measure the right-hand side along a maneuver.

    Example: python -m sim.bench --db coeff_db
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
    states = np.ascontiguousarray(flown.record[:, 1:13])
    controls = np.ascontiguousarray(flown.record[:, 13 : 14 + len(vehicle.planes)])
    work, dy = workspace(model), np.zeros(12)
    flat = (model.real, model.whole)
    rate = np.zeros(controls.shape[1])
    n = len(states)
    compiled = _best(lambda: _many_rhs(*flat, states, controls, work.real, work.whole, dy), n, tries)
    step = _best(
        lambda: _many_steps(*flat, states, controls, rate, work.real, work.whole, work.stage, dy.copy()), n, tries
    )
    few = range(0, n, max(1, n // 200))
    numpy_rhs = _best(lambda: [plain.rhs(model, states[i], controls[i]) for i in few], len(few), max(3, tries // 50))
    worst = 0.0
    for i in few:
        kernel.rhs(model, states[i], controls[i], work, dy)
        other = plain.rhs(model, states[i], controls[i])
        worst = max(worst, float(np.abs(dy - other).max() / np.abs(other).max()))
    click.echo(f"{vehicle.name}, database version {version}, {n} states along {case.name}, one core")
    click.echo(f"compiled right-hand side   {1e6 * compiled:8.3f} us")
    click.echo(f"RK4 steps                  {1.0 / step:8.0f} a second")
    click.echo(f"plain-NumPy right-hand side{1e6 * numpy_rhs:8.1f} us")
    click.echo(f"ratio NumPy / compiled     {numpy_rhs / compiled:8.0f}")
    click.echo(f"largest difference         {worst:8.1e} relative")
