"""Error bands: coefficient sets drawn from the database's errors, flown as one batch."""

from __future__ import annotations

import math
import os
import shutil
import tempfile
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.metrics.measure import Metrics, measured
from ident.text import on_screen
from ident.validation.cluster import over_dask
from ident.validation.draws import draw, scores
from sim.boat.coefficients import Coefficients
from sim.boat.row_codec import correlation_matrix
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.flight.case import Case
from sim.flight.craft import Craft
from sim.flight.series import Series
from sim.flight.simulate import DERIVED, columns_of, equipped, fly, samples_of, uses_tanks
from sim.flight.trim import NoEquilibrium
from sim.kernel.assemble import Assembly
from sim.kernel.products import product
from sim.waves.in_waves import Water

if TYPE_CHECKING:
    from rich.console import Console

Array = NDArray[np.float64]
# Samples handed out at once: enough that handing out costs nothing, few enough for a progress bar.
CHUNK = 8
# Of a machine that does not say how much memory it has [bytes].
_LEAST_MEMORY = 4e9
# Share of it that the records of all channels may take before they go to a file; and how many arrays of the size
# of the draws, or of the records of a channel, are held at once at most.
_IN_MEMORY = 0.25
_HELD = 8
# Samples up to which their products are one matrix: beyond, it would be larger than all they are made of.
_SQUARE = 2000
# Probability that chance alone lists a coefficient as a cause of a channel's width.
_BY_CHANCE = 0.01
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
    correlation : (estimates, estimates) they were drawn with.
    estimates : Coefficient of each estimate.
    failed : Samples without a self-propulsion state.
    seed : Of the random generator.
    metrics : Metrics of each sample, as ``ident.metrics.measure`` names them.
    """

    time: Array
    channels: dict[str, Array]
    own: dict[str, dict[str, Array]]
    draws: Array
    correlation: Array
    estimates: list[str]
    failed: int
    seed: int
    metrics: tuple[Metrics, ...] = ()
    _edges: dict[tuple[str, str], dict[float, Array]] = field(default_factory=dict, repr=False, compare=False)
    _scores: dict[str, Array] = field(default_factory=dict, repr=False, compare=False)

    def scores(self) -> dict[str, Array]:
        """Independent scores of each coefficient, (samples, rank), mean zero."""
        if not self._scores:
            names = np.array(self.estimates)
            for coefficient in dict.fromkeys(self.estimates):
                places = np.flatnonzero(names == coefficient)
                own = scores(self.draws[:, places], self.correlation[np.ix_(places, places)])
                self._scores[coefficient] = own - own.mean(axis=0)
        return self._scores

    def values(self, rows: pd.DataFrame) -> Array:
        """(samples, rows) values of database rows that were drawn; ``rows`` as they were flown."""
        index, step = _row_steps(rows, correlation_matrix(rows)[0])
        value = rows["value"].to_numpy() + np.where(index >= 0, self.draws[:, index] * step, 0.0)
        return np.asarray(value, dtype=np.float64)

    def band(self, channel: str, level: str, source: str = "") -> tuple[Array, Array]:
        """Lower and upper edge of the 50 or 95 % band of a channel, as a source's record starts."""
        key = (channel, source)
        if key not in self._edges:
            self._edges[key] = _percentiles(self.own.get(source, self.channels)[channel])
        low, high = (self._edges[key][p] for p in LEVELS[level])
        return low, high


def _percentiles(values: Array) -> dict[float, Array]:
    """Every edge of the bands of (samples, rows), those of samples that have ended left out."""
    wanted = sorted({p for edges in LEVELS.values() for p in edges})
    found = np.percentile(values, wanted, axis=0)
    # Few columns have ended samples, and what leaves them out goes column by column.
    ended = ~np.isfinite(values).all(axis=0)
    if ended.any():
        found[:, ended] = np.nanpercentile(values[:, ended], wanted, axis=0)
    return dict(zip(wanted, found, strict=True))


def _row_steps(rows: pd.DataFrame, estimates: pd.DataFrame) -> tuple[NDArray[np.int64], Array]:
    """For each row: its estimate's place (-1 for none) and signed standard error."""
    place = pd.Series(range(len(estimates)), index=estimates["estimate"])
    index = np.asarray(rows["estimate"].map(place).fillna(-1), dtype=np.int64)
    value = estimates["value"].to_numpy()
    turned = np.sign(rows["value"].to_numpy() * np.where(index >= 0, value[index], 1.0)) < 0.0
    return index, np.asarray(np.where(turned, -1.0, 1.0) * rows["stderr"].to_numpy(), dtype=np.float64)


class Flown(NamedTuple):
    """One sample: (channels, records) by source, and the metrics of the case's own flight."""

    records: dict[str, Array]
    metrics: Metrics


@dataclass(frozen=True)
class Batch:
    """A case to be flown with many sets of row values; goes to other processes as it is.

    Attributes
    ----------
    flights : The case, under "", and the case from the start of a source's record, by source.
    vehicle : Of the case.
    assembly : Row values to the model.
    channels : Names of what a flight gives.
    water : Waves and surface, with the sections' added mass at its database values.
    """

    flights: dict[str, Case]
    vehicle: Vehicle
    assembly: Assembly
    channels: tuple[str, ...]
    water: Water | None

    def fly(self, values: Array) -> list[Flown | None]:
        """Fly one sample after the other.

        Parameters
        ----------
        values : (k, rows) row values.

        Returns
        -------
        For each sample its records and metrics; None without a self-propulsion state.
        """
        found: list[Flown | None] = []
        # A sample is measured by itself: references and published values are the case's.
        bare = self.flights[""].model_copy(update={"reference": None, "published": []})
        for sample in values:
            model = self.assembly.model(sample)
            try:
                flown = {
                    s: fly(c, self.vehicle, equipped(c, self.vehicle, model), self.water)
                    for s, c in self.flights.items()
                }
            except NoEquilibrium:
                found.append(None)
                continue
            columns = measured(bare, flown[""], Series({}), {}).metrics
            metrics = {name: column.get("simulated") for name, column in columns.items()}
            found.append(Flown({s: np.stack([one[c] for c in self.channels]) for s, one in flown.items()}, metrics))
        return found


def batch_of(case: Case, vehicle: Vehicle, rows: pd.DataFrame) -> Batch:
    """The batch of a case; raises ``InputError`` when it uses tanks that the vehicle lacks."""
    started = {s: case.started_as(s) for s in (case.reference.compare if case.reference else [])}
    craft = Craft(Coefficients(vehicle, rows))
    assembly = craft.assembly(case)
    equipped(case, vehicle, assembly.model(rows["value"].to_numpy()))
    return Batch(
        flights={"": case} | {s: c for s, c in started.items() if c is not None},
        vehicle=vehicle,
        assembly=assembly,
        channels=(*columns_of(vehicle, uses_tanks(case)), *DERIVED),
        water=craft.water(case),
    )


def _check_room(case: Case, vehicle: Vehicle, rows: pd.DataFrame, samples: int) -> None:
    """Refuse more samples than memory and disk hold, before any is drawn. Raises ``InputError``.

    In memory stand draws and scores of all samples and the records of one channel at a time; the records of all
    channels go to a file where they are large.
    """
    sources = case.reference.compare if case.reference else []
    flights = 1 + sum(case.started_as(s) is not None for s in sources)
    steps, every = samples_of(case)
    channels = len(columns_of(vehicle, uses_tanks(case))) + len(DERIVED)
    record = 8 * (steps // every + 1)
    values = 8 * len(rows["estimate"].unique())
    _refuse_beyond(samples, _HELD * (values + record), _memory(), "memory")
    if samples * flights * channels * record > _IN_MEMORY * _memory():
        room = shutil.disk_usage(tempfile.gettempdir()).free
        _refuse_beyond(samples, flights * channels * record, room, f"room in {tempfile.gettempdir()}")


def _refuse_beyond(samples: int, each: float, room: float, what: str) -> None:
    if samples * each > room:
        text = f"{samples} samples of {each / 1e6:.3g} MB each"
        raise InputError("--samples", text, f"{max(int(room / each), 0)} at most in {room / 1e9:.3g} GB of {what}")


def _records(shape: tuple[int, int, int]) -> Array:
    """(channels, samples, records) without numbers yet; in a nameless file where memory is better kept."""
    if 8 * math.prod(shape) <= _IN_MEMORY * _memory():
        return np.full(shape, np.nan)
    with tempfile.TemporaryFile() as file:
        found: Array = np.memmap(file, dtype=np.float64, mode="w+", shape=shape)
    return found


def _without_failed(stack: Array, flown: NDArray[np.bool_]) -> Array:
    """(channels, flown samples, records), channel by channel in place."""
    count = int(flown.sum())
    if count < flown.size:
        for channel in stack:
            channel[:count] = channel[flown]
    return stack[:, :count]


def _memory() -> float:
    """Memory of this machine [bytes]; where it cannot be asked, what every machine has."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return _LEAST_MEMORY


def _over_threads(
    batch: Batch, chunks: Iterable[Array], workers: int | None
) -> Iterator[tuple[int, list[Flown | None]]]:
    """Place of a chunk and its flights, in order; few chunks are made before they are flown."""
    threads = workers or os.cpu_count() or 1
    waiting: deque[Future[list[Flown | None]]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            done = 0
            for chunk in chunks:
                waiting.append(pool.submit(batch.fly, chunk))
                if len(waiting) > 2 * threads:
                    yield done, waiting.popleft().result()
                    done += 1
            while waiting:
                yield done, waiting.popleft().result()
                done += 1
        except BaseException:
            # Who stops here does not wait for what has not begun.
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def fly_samples(
    case: Case,
    vehicle: Vehicle,
    rows: pd.DataFrame,
    samples: int,
    seed: int = 0,
    workers: int | None = None,
    each: Callable[[int], None] = lambda done: None,
    dask: str | None = None,
    chunk: int = CHUNK,
) -> Bands:
    """Fly a case with coefficient sets drawn from the errors of the database.

    Sample i depends on the seed and on i alone, wherever it is flown.

    Parameters
    ----------
    case, vehicle, rows : What is flown, from which version.
    samples, seed : Number of coefficient sets and seed of the generator.
    workers : Threads; all cores when None.
    each : Called with the number of samples flown since the last call.
    dask : Address of a Dask scheduler that flies them instead.
    chunk : Samples handed out at once.

    Returns
    -------
    Bands over the simulated states.

    Raises
    ------
    InputError
        When no sample has a self-propulsion state, for more samples than memory and disk hold, or as
        ``ident.validation.cluster.over_dask``.
    """
    _check_room(case, vehicle, rows, samples)
    estimates, correlation = correlation_matrix(rows)
    draws = draw(correlation, samples, seed)
    index, step = _row_steps(rows, estimates)
    value = rows["value"].to_numpy()
    chunks = (value + np.where(index >= 0, draws[i : i + chunk, index] * step, 0.0) for i in range(0, samples, chunk))
    batch = batch_of(case, vehicle, rows)
    steps, every = samples_of(case)
    shape = (len(batch.channels), samples, steps // every + 1)
    stacks = {source: _records(shape) for source in batch.flights}
    flown = np.zeros(samples, dtype=bool)
    metrics: dict[int, Metrics] = {}
    for place, found in over_dask(dask, batch, chunks) if dask else _over_threads(batch, chunks, workers):
        for i, one in enumerate(found, start=place * chunk):
            flown[i] = one is not None
            if one is None:
                continue
            metrics[i] = one.metrics
            for source, record in one.records.items():
                stacks[source][:, i, : record.shape[1]] = record
                stacks[source][:, i, record.shape[1] :] = np.nan
        each(len(found))
    if not flown.any():
        raise InputError(f"case {case.name}", "no sample has a self-propulsion state", "smaller errors or another case")
    kept = {source: _without_failed(stack, flown) for source, stack in stacks.items()}
    time, channels = _up_to_the_end(case, batch, kept)
    return Bands(
        time=time,
        channels=channels.pop(""),
        own=channels,
        draws=draws if flown.all() else draws[flown],
        correlation=correlation,
        estimates=list(estimates["coefficient"]),
        failed=int(samples - flown.sum()),
        seed=seed,
        metrics=tuple(metrics[i] for i in sorted(metrics)),
    )


def _up_to_the_end(case: Case, batch: Batch, stacks: dict[str, Array]) -> tuple[Array, dict[str, dict[str, Array]]]:
    """Times and, by source, channels up to the end of the longest flight."""
    ends = np.max([np.isfinite(stack[0]).any(axis=0).sum() for stack in stacks.values()])
    channels = {s: dict(zip(batch.channels, stack[:, :, :ends], strict=True)) for s, stack in stacks.items()}
    time = np.arange(ends) * samples_of(case)[1] * case.run.step_s
    for stack in channels.values():
        del stack["t"]
    return time, channels


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
            time, value = reference[source][channel].abscissa, reference[source][channel].value
            if reference.abscissa == "s":
                # Path length to time by the median flight.
                time = np.interp(time, np.nanmedian(bands.own.get(source, bands.channels)["s"], axis=0), bands.time)
            entry = {}
            for level in LEVELS:
                low, high = (np.interp(time, bands.time, edge) for edge in bands.band(channel, level, source))
                entry[level] = float(np.mean((value >= low) & (value <= high)))
            found.setdefault(source, {})[channel] = entry
    return found


def _without_each(scores: Array, along: Array, own: Array) -> tuple[float, Array]:
    """Share of the variance of a channel that goes with the scores, of all samples and without each.

    Parameters
    ----------
    scores : (samples, rank), mean zero.
    along : (samples, rank) G times the scores, with G the products of the samples' departures from
        the mean of the channel, summed over the record. own : (samples,) diagonal of G.

    Returns
    -------
    share : Sum of the squared correlations, averaged over the record with the variance as weight.
    without : (samples,) the same without one sample.
    """
    samples = len(scores)
    # What a sum of products about the mean loses with a sample is this times the sample's product.
    lost = samples / (samples - 1.0)
    total = float(own.sum())
    square, size = (scores * along).sum(axis=0), (scores**2).sum(axis=0)
    left = square - 2.0 * lost * scores * along + (lost * scores) ** 2 * own[:, None]
    without = (left / (size - lost * scores**2)).sum(axis=1) / (total - lost * own)
    return float((square / size).sum()) / total, without


def variance_shares(bands: Bands, channel: str, most: int = 8) -> list[dict[str, Any]]:
    """Which coefficients cause the width of a channel's band.

    The share of the variance that a linear function of all values of a coefficient
    accounts for: the squared correlations of the channel with the coefficient's independent
    scores, averaged over the record with the variance as weight, less what chance gives
    (1/samples a score). Its standard error is the jackknife's, from the shares without one sample
    each (Efron and Stein 1981). By chance alone, the samples times the squared correlations are
    chi-square distributed with a degree of freedom a score; a coefficient is listed when its
    share lies beyond what, of all coefficients together, one in a hundred draws exceeds.
    Coefficients whose errors are correlated each have what they share, so that the shares may sum
    to more than one.

    Parameters
    ----------
    bands, channel : Flown samples, and which channel of them.
    most : Number of coefficients listed.

    Returns
    -------
    ``coefficient``, ``share`` (0 to 1) and ``standard_error``, surest share (share less twice its
    standard error) first.
    """
    from scipy.special import chdtri

    values = bands.channels[channel]
    complete = np.isfinite(values).all(axis=0)
    spread = values[:, complete] - values[:, complete].mean(axis=0)
    if len(values) < 3 or not spread.any():
        return []
    every = bands.scores()
    columns = np.concatenate(list(every.values()), axis=1)
    if len(spread) <= _SQUARE:
        products = product(spread, spread.T)
        along, size = product(products, columns), np.diag(products)
    else:
        along, size = product(spread, product(spread.T, columns)), np.einsum("ij,ij->i", spread, spread)
    del columns
    found, first = [], 0
    for coefficient, own in every.items():
        samples, rank = own.shape
        share, without = _without_each(own, along[:, first : first + rank], size)
        first += rank
        if samples * share <= chdtri(rank, _BY_CHANCE / len(every)):
            continue
        error = np.sqrt((samples - 1.0) / samples * ((without - without.mean()) ** 2).sum())
        one = {"share": min(share - rank / samples, 1.0), "standard_error": float(error)}
        found.append({"coefficient": coefficient, **one})
    found.sort(key=lambda one: 2.0 * one["standard_error"] - one["share"])
    return found[:most]


def summary(bands: Bands, case: Case, reference: Series) -> dict[str, Any]:
    """What the JSON result says of the bands."""
    channels = case.reference.channels if case.reference else []
    bands.scores()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        shares = dict(zip(channels, pool.map(lambda channel: variance_shares(bands, channel), channels), strict=True))
    return {
        "samples": len(bands.draws),
        "failed": bands.failed,
        "seed": bands.seed,
        "inside": inside(bands, case, reference),
        "variance_shares": shares,
    }


def show(found: dict[str, Any], console: Console) -> None:
    """Print how often the references lie inside, and what makes the bands wide."""
    from rich.table import Table

    failed = f", {found['failed']} without self-propulsion" if found["failed"] else ""
    table = Table("reference", "channel", "inside 50 %", "inside 95 %", title=f"{found['samples']} samples{failed}")
    for source, channels in found["inside"].items():
        for channel, entry in channels.items():
            table.add_row(on_screen(source), channel, f"{100 * entry['50']:.0f} %", f"{100 * entry['95']:.0f} %")
    console.print(table)
    table = Table("channel", "variance share by coefficient, ± its standard error")
    for channel, shares in found["variance_shares"].items():
        texts = [f"{s['coefficient']} {100 * s['share']:.0f} ± {100 * s['standard_error']:.0f} %" for s in shares]
        table.add_row(channel, ", ".join(texts))
    console.print(table)
