"""Error bands: coefficient sets drawn from the database's errors, flown as one batch."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sim.case import Case, Series, in_radians
from sim.coefficients import Coefficients
from sim.database import correlation_pairs
from sim.errors import InputError
from sim.simulate import Simulation, model_of, simulate
from sim.trim import NoEquilibrium
from sim.vehicle import Vehicle

if TYPE_CHECKING:
    from rich.console import Console

Array = NDArray[np.float64]
_DERIVED = ("U", "D0", "s", "u_over_U0", "dz_over_L0")
LEVELS = {"50": (25.0, 75.0), "95": (2.5, 97.5)}


@dataclass(frozen=True)
class Bands:
    """Flown samples of one case.

    Attributes
    ----------
    time : (rows,) record times [s].
    channels : Channel -> (samples, rows), NaN after a sample ended.
    own : The same of the flights from the start of a source's record, by source.
    draws : (samples, estimates) what was drawn, in standard errors.
    estimates : Coefficient of each estimate.
    failed : Samples without a self-propulsion state.
    seed : Of the random generator.
    """

    time: Array
    channels: dict[str, Array]
    own: dict[str, dict[str, Array]]
    draws: Array
    estimates: list[str]
    failed: int
    seed: int

    def band(self, channel: str, level: str, source: str = "") -> tuple[Array, Array]:
        """Lower and upper edge of the 50 or 95 % band of a channel, as a source's record starts."""
        low, high = np.nanpercentile(self.own.get(source, self.channels)[channel], LEVELS[level], axis=0)
        return np.asarray(low), np.asarray(high)


def covariance(rows: pd.DataFrame) -> tuple[pd.DataFrame, Array]:
    """One row an estimate, and the correlation matrix of the estimates.

    Parameters
    ----------
    rows : Database rows of one vehicle.

    Returns
    -------
    estimates : First row of each estimate, in the order of the matrix.
    correlation : (n, n), unit diagonal.
    """
    known = rows[rows["estimate"] >= 0].drop_duplicates("estimate").reset_index(drop=True)
    place = {int(e): i for i, e in enumerate(known["estimate"])}
    matrix = np.eye(len(known))
    for i, text in enumerate(known["correlation"]):
        for other, coefficient in correlation_pairs(text).items():
            matrix[i, place[other]] = coefficient
    return known, 0.5 * (matrix + matrix.T)


def draw(correlation: Array, samples: int, seed: int) -> Array:
    """Correlated standard normal draws.

    Returns
    -------
    (samples, n) in standard errors; sample i does not depend on how many are drawn.
    """
    values, vectors = np.linalg.eigh(correlation)
    root = vectors * np.sqrt(np.clip(values, 0.0, None))
    children = np.random.SeedSequence(seed).spawn(samples)
    # One product a sample: a single large one would round by the number of samples.
    return np.stack([root @ np.random.default_rng(child).standard_normal(len(values)) for child in children])


def _row_steps(rows: pd.DataFrame, estimates: pd.DataFrame) -> tuple[NDArray[np.int64], Array]:
    """For each row: its estimate's place (-1 for none) and signed standard error."""
    place = pd.Series(range(len(estimates)), index=estimates["estimate"])
    index = np.asarray(rows["estimate"].map(place).fillna(-1), dtype=np.int64)
    value = estimates["value"].to_numpy()
    turned = np.sign(rows["value"].to_numpy() * np.where(index >= 0, value[index], 1.0)) < 0.0
    return index, np.asarray(np.where(turned, -1.0, 1.0) * rows["stderr"].to_numpy(), dtype=np.float64)


def fly_samples(
    case: Case,
    vehicle: Vehicle,
    rows: pd.DataFrame,
    samples: int,
    seed: int = 0,
    workers: int | None = None,
    each: Callable[[], None] = lambda: None,
) -> Bands:
    """Fly a case with coefficient sets drawn from the errors of the database.

    Parameters
    ----------
    case, vehicle, rows : What is flown, from which version.
    samples, seed : Number of coefficient sets and seed of the generator.
    workers : Threads; all cores when None. The result does not depend on it.
    each : Called after each flight.

    Returns
    -------
    Bands over the simulated states.

    Raises
    ------
    InputError
        When no sample has a self-propulsion state.
    """
    estimates, correlation = covariance(rows)
    draws = draw(correlation, samples, seed)
    index, step = _row_steps(rows, estimates)
    base = Coefficients(vehicle, rows)
    value = rows["value"].to_numpy()

    started = {s: case.started_as(s) for s in (case.reference.compare if case.reference else [])}
    flights = {"": case} | {s: c for s, c in started.items() if c is not None}

    def one(i: int) -> dict[str, Simulation] | None:
        moved = base.with_values(value + np.where(index >= 0, draws[i][index] * step, 0.0))
        try:
            model = model_of(case, moved)
            return {s: simulate(c, moved, model) for s, c in flights.items()}
        except NoEquilibrium:
            return None
        finally:
            each()

    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        flown = list(pool.map(one, range(samples)))
    kept = [i for i, s in enumerate(flown) if s is not None]
    if not kept:
        raise InputError(f"case {case.name}", "no sample has a self-propulsion state", "smaller errors or another case")
    done = [s for s in flown if s is not None]
    time = max((s["t"] for flown_from in done for s in flown_from.values()), key=len)
    channels = {source: _stacked([s[source] for s in done], time) for source in flights}
    own = {source: stack for source, stack in channels.items() if source}
    return Bands(time, channels[""], own, draws[kept], list(estimates["coefficient"]), samples - len(kept), seed)


def _stacked(flown: list[Simulation], time: Array) -> dict[str, Array]:
    """Channel -> (samples, rows), NaN after a sample ended."""
    channels: dict[str, Array] = {}
    for name in (*flown[0].columns[1:], *_DERIVED):
        stack = np.full((len(flown), time.size), np.nan)
        for row, simulation in zip(stack, flown, strict=True):
            row[: len(simulation.record)] = simulation[name]
        channels[name] = stack
    return channels


def inside(bands: Bands, case: Case, reference: Series) -> dict[str, Any]:
    """How often each reference lies inside the bands.

    Returns
    -------
    source -> channel -> {"50": share of its samples, "95": share}.
    """
    found: dict[str, Any] = {}
    for source in case.reference.compare if case.reference else []:
        for channel in case.reference.channels if case.reference else []:
            if channel not in reference[source]:
                continue
            time, value, unit = reference[source][channel]
            if reference.abscissa == "s":
                # Path length to time by the median flight.
                time = np.interp(time, np.nanmedian(bands.own.get(source, bands.channels)["s"], axis=0), bands.time)
            value = in_radians(value, unit)
            entry = {}
            for level in LEVELS:
                low, high = (np.interp(time, bands.time, edge) for edge in bands.band(channel, level, source))
                entry[level] = float(np.mean((value >= low) & (value <= high)))
            found.setdefault(source, {})[channel] = entry
    return found


def variance_shares(bands: Bands, channel: str, most: int = 8) -> list[dict[str, Any]]:
    """Which coefficients cause the width of a channel's band.

    The squared correlation of each estimate with the channel, averaged over the record
    with the variance as weight, summed by coefficient, less what chance gives (1/samples
    an estimate). Correlated estimates share what they have in common.
    """
    values = bands.channels[channel]
    complete = np.isfinite(values).all(axis=0)
    spread = values[:, complete] - values[:, complete].mean(axis=0)
    variance = (spread**2).sum(axis=0)
    scores = bands.draws - bands.draws.mean(axis=0)
    scale = (scores**2).sum(axis=0)
    square = (scores.T @ spread) ** 2 / np.where(scale > 0.0, scale, 1.0)[:, None]
    share = square.sum(axis=1) / variance.sum() if variance.sum() > 0.0 else np.zeros(len(scale))
    total = pd.Series(share - 1.0 / len(values)).groupby(bands.estimates).sum().sort_values(ascending=False)
    return [{"coefficient": str(k), "share": float(v)} for k, v in total.head(most).items() if v > 0.0]


def summary(bands: Bands, case: Case, reference: Series) -> dict[str, Any]:
    """What the JSON result says of the bands."""
    channels = case.reference.channels if case.reference else []
    return {
        "samples": len(bands.draws),
        "failed": bands.failed,
        "seed": bands.seed,
        "inside": inside(bands, case, reference),
        "variance_shares": {c: variance_shares(bands, c) for c in channels},
    }


def show(found: dict[str, Any], console: Console) -> None:
    """Print how often the references lie inside, and what makes the bands wide."""
    from rich.table import Table

    failed = f", {found['failed']} without self-propulsion" if found["failed"] else ""
    table = Table("reference", "channel", "inside 50 %", "inside 95 %", title=f"{found['samples']} samples{failed}")
    for source, channels in found["inside"].items():
        for channel, entry in channels.items():
            table.add_row(source, channel, f"{100 * entry['50']:.0f} %", f"{100 * entry['95']:.0f} %")
    console.print(table)
    table = Table("channel", "variance share by coefficient")
    for channel, shares in found["variance_shares"].items():
        table.add_row(channel, ", ".join(f"{s['coefficient']} {100 * s['share']:.0f} %" for s in shares))
    console.print(table)
