"""``python -m sim.bench.step_errors``: what the step of each bundled case costs in accuracy.

Each case of the frozen boat is flown at its step and at a quarter of it. Both have the same
Runge-Kutta method, events and laws; the autopilot samples as often as the boat steps, so that the
difference holds the error of the integration, of order h^4, and that of sampled commands.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np

from sim.bench.boat import frozen_boat
from sim.boat.coefficients import Coefficients
from sim.flight.case import Case, load_case
from sim.flight.simulate import simulate
from sim.flight.simulation import Simulation
from sim.flight.trim import NoEquilibrium

_FILE = Path(__file__).with_name("step_errors.csv")
# Channels by name: unit and what one of the simulation's is in it.
_CHANNELS = {"u": 1.0, "D0": 1.0, "theta": 180.0 / np.pi, "psi": 180.0 / np.pi}
FINER = 4


class StepError(NamedTuple):
    """Of one case: its step [s] and the largest differences of u [m/s], D0 [m], theta and psi [deg] and
    of the place [m] from those at a quarter of it, each with its range in the case."""

    case: str
    step_s: float
    u_mps: float
    u_range: float
    D0_m: float
    D0_range: float
    theta_deg: float
    theta_range: float
    psi_deg: float
    psi_range: float
    place_m: float
    place_range: float


def _place(flown: Simulation) -> np.ndarray:
    return np.stack([flown["x"], flown["y"]])


def step_error(case: Case, coefficients: Coefficients) -> StepError:
    """What the step of a case costs.

    Raises
    ------
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    flown = simulate(case, coefficients)
    finer = case.model_copy(update={"run": case.run.model_copy(update={"step_s": case.run.step_s / FINER})})
    fine = simulate(finer, coefficients)
    rows = min(len(flown.record), len(fine.record))
    numbers: list[float] = []
    for channel, factor in _CHANNELS.items():
        a, b = flown[channel][:rows], fine[channel][:rows]
        numbers += [factor * float(np.abs(a - b).max()), factor * float(np.ptp(b))]
    here, there = _place(flown)[:, :rows], _place(fine)[:, :rows]
    numbers += [float(np.hypot(*(here - there)).max()), float(np.hypot(*np.ptp(there, axis=1)))]
    return StepError(case.name, case.run.step_s, *numbers)


def recorded() -> list[StepError]:
    """The lines of ``step_errors.csv``."""
    with _FILE.open(encoding="utf-8", newline="") as stream:
        return [StepError(r["case"], *(float(r[k]) for k in StepError._fields[1:])) for r in csv.DictReader(stream)]


def _every() -> Iterator[StepError]:
    coefficients = frozen_boat()
    names = sorted(p.name.removesuffix(".toml") for p in (files("sim") / "cases").iterdir() if p.name.endswith(".toml"))
    for name in names:
        case, _ = load_case(name)
        if case.vehicle != coefficients.vehicle.name:
            continue
        try:
            error = step_error(case, coefficients)
        except NoEquilibrium as reason:
            click.echo(f"{name}: {reason}", err=True)
            continue
        click.echo(f"{name}: u {error.u_mps:.2g} m/s, D0 {error.D0_m:.2g} m, psi {error.psi_deg:.2g} deg", err=True)
        yield error


@click.command()
def main() -> None:
    """Fly every bundled case of BB2 at its step and at a quarter of it, and record the differences.

    Example: python -m sim.bench.step_errors
    """
    errors = list(_every())
    with _FILE.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(StepError._fields)
        writer.writerows((f.case, f.step_s, *(f"{v:.3g}" for v in f[2:])) for f in errors)


if __name__ == "__main__":
    main()
