"""Maneuvers flown by the simulator, their exact metrics, and records of them as good instruments write them.

``python tests/trial_flights.py 60`` makes so many noisy records of each maneuver, and prints how often the stated
interval of each metric holds the exact flight's value: the table of docs/trials.md.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from trial_records import turned, write

from ident.metrics import vertical
from ident.metrics.measure import channels_of, measured
from ident.trials.measure import DRAWS
from ident.trials.spec import TrialFile
from ident.trials.trial import measure_trial
from sim.boat.coefficients import Coefficients
from sim.flight.case import load_case
from sim.flight.series import load_reference
from sim.flight.simulate import simulate
from sim.flight.simulation import Simulation

# Standard errors of a sample: a good gyro, log, depth gauge, satellite position and transducers.
NOISE = {"psi [deg]": 0.05, "r [deg/s]": 0.005, "phi [deg]": 0.02, "theta [deg]": 0.02, "u [m/s]": 0.01}
NOISE |= {"depth [m]": 0.02, "x_north [m]": 0.3, "y_east [m]": 0.3, "rudder [deg]": 0.02, "plane [deg]": 0.02}
# Case -> what its trial is called, and what is stated of it.
MANEUVERS: dict[str, tuple[str, dict[str, Any]]] = {
    "hzz20": ("zigzag 20/20", {}),
    "vzz10-10kt": ("vertical zigzag 10/10", {}),
    "turning-circle": ("turning circle", {}),
    "direct-spiral": ("direct spiral", {}),
    "pull-out": ("pull out", {}),
    "crash-stop": ("stopping", {}),
    "roll-decay": ("roll decay", {}),
    "max-q": ("rise", {}),
    "depth-change": ("depth change", {"step_m": 10.0}),
    "course-keeping": ("course keeping", {}),
}
STEP_S, APPROACH_S = 0.5, 30.0


@dataclass(frozen=True)
class Flown:
    """A flight, and its metrics as ``ident validate`` names and measures them."""

    name: str
    flight: Simulation
    truth: dict[str, float]


def flown(name: str, coefficients: Coefficients) -> Flown:
    """A bundled case, flown."""
    case, where = load_case(name)
    flight = simulate(case, coefficients)
    metrics = measured(case, flight, load_reference(case, where), {}).metrics
    truth = {k: v["simulated"] for k, v in metrics.items() if v.get("simulated") is not None}
    if name == "max-q":
        # The record ends with its last sample, before the nose comes to the surface.
        channels = channels_of(flight)
        short = {k: channels[k][: _picked(flight)[-1] + 1] for k in ("t", "theta", "q", "u", "z")}
        truth = {k: v for k, v in vertical.rise(short, False).items() if v is not None}
    return Flown(name, flight, truth)


def _picked(flight: Simulation) -> np.ndarray:
    """Samples twice a second; of spirals, which take hours, some thousand."""
    step = max(1, round(STEP_S / (flight["t"][1] - flight["t"][0])), flight["t"].size // 2500)
    return np.arange(0, flight["t"].size, step)


def recorded(one: Flown, folder: Path, seed: int) -> Path:
    """The flight as a trial: on course 030, with half a minute of approach where it is under way, and noise."""
    flight, rng, pick = one.flight, np.random.default_rng(seed), _picked(one.flight)
    t, degrees, lead = flight["t"][pick], math.degrees(1.0), approach_of(one)
    before = np.arange(0.0, lead, t[1] - t[0])

    def joined(name: str, first: float | None = None, factor: float = 1.0) -> np.ndarray:
        values = flight[name][pick] * factor
        return np.concatenate([np.full(before.size, values[0] if first is None else first), values])

    x = np.concatenate([float(flight["u"][0]) * (before - lead), flight["x"][pick]])
    north, east = turned(x, joined("y"), 30.0, (100.0, -50.0))
    columns = {"time [s]": np.concatenate([before, lead + t])}
    columns |= {"psi [deg]": joined("psi", factor=degrees) + 30.0, "r [deg/s]": joined("r", factor=degrees)}
    columns |= {"phi [deg]": joined("phi", factor=degrees), "theta [deg]": joined("theta", factor=degrees)}
    columns |= {"u [m/s]": joined("u"), "depth [m]": joined("z"), "x_north [m]": north, "y_east [m]": east}
    columns |= {"rudder [deg]": joined("dH", 0.0, degrees), "plane [deg]": joined("dV", factor=degrees)}
    columns |= {"n [rpm]": joined("n", float(flight["n"][0]), 60.0)}
    n = columns["time [s]"].size
    noisy = {k: v + NOISE.get(k, 0.0) * rng.standard_normal(n) for k, v in columns.items()}
    return write(folder / f"{one.name}.csv", noisy)


def approach_of(one: Flown) -> float:
    """Seconds of the record before the execute."""
    return 0.0 if float(one.flight["u"][0]) == 0.0 else APPROACH_S


def errors(one: Flown, folder: Path, seeds: range, draws: int = DRAWS) -> Iterator[dict[str, float]]:
    """Of each record: error of each metric in its stated standard errors."""
    words, stated = MANEUVERS[one.name]
    spec = TrialFile(maneuver=words, execute_s=approach_of(one), **stated)
    for seed in seeds:
        metrics = measure_trial(recorded(one, folder, seed), spec, draws).metrics
        missing = sorted(set(one.truth) - set(metrics))
        assert not missing, (one.name, seed, missing)
        yield {k: (metrics[k].value - v) / metrics[k].sigma for k, v in one.truth.items()}


def table(names: list[str], records: int, coefficients: Coefficients) -> None:
    """Print a row a maneuver and metric; the yaw rates of a spiral's steps are one."""
    print("| maneuver | metric | intervals | hold the value, % | rms error / stated | largest |")
    print("| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            found: dict[str, list[float]] = defaultdict(list)
            one = flown(name, coefficients)
            for record in errors(one, Path(folder), range(records)):
                for metric, away in record.items():
                    step = metric.startswith("yaw_rate_") and "steady" not in metric
                    found["yaw_rate of each step" if step else metric].append(away)
            for metric, away in found.items():
                z = np.abs(away)
                row = f"| {MANEUVERS[name][0]} | `{metric}` | {z.size} | {100.0 * np.mean(z < 1.96):.0f} "
                print(row + f"| {np.sqrt(np.mean(z**2)):.2f} | {z.max():.1f} |", flush=True)


if __name__ == "__main__":
    from ident.captive.campaign import read_campaign
    from ident.database.store import database_rows
    from ident.identification.identify import identify

    campaign = read_campaign(Path(__file__).parents[1] / "raw_captive_data" / "bb2")
    boat = Coefficients(campaign.vehicle, database_rows(identify(campaign)))
    table(sys.argv[2:] or list(MANEUVERS), int(sys.argv[1]), boat)
