"""Error bands: coefficient sets drawn from the database's errors, flown as one batch."""

from __future__ import annotations

import logging
import math
import os
import shutil
import tempfile
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.metrics.metric import Values
from ident.validation.cluster import over_dask
from ident.validation.draws import draw, scores
from ident.validation.samples import Batch, Flown, batch_of
from sim.boat.row_codec import correlation_matrix
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.flight.case import Case
from sim.flight.simulate import columns_of, samples_of, uses_tanks
from sim.flight.simulation import DERIVED

Array = NDArray[np.float64]
_log = logging.getLogger(__name__)
# Samples handed out at once: enough that handing out costs nothing, few enough for a progress bar.
CHUNK = 8
# Of a machine that does not say how much memory it has [bytes].
_LEAST_MEMORY = 4e9
# Share of it that the records of all channels may take before they go to a file; and how many arrays of the size
# of the draws, or of the records of a channel, are held at once at most.
_IN_MEMORY = 0.25
_HELD = 8
LEVELS = {"50": (25.0, 75.0), "95": (2.5, 97.5)}


@dataclass(frozen=True)
class Bands:
    """Flown samples of one case.

    Attributes
    ----------
    time : (rows,) record times [s].
    channels : Channel -> (samples, rows), NaN after a sample ended.
    as_started : The same of the flights from the start of a source's record, by source.
    draws : (samples, estimates) what was drawn, in standard errors.
    correlation : (estimates, estimates) they were drawn with.
    estimates : Coefficient of each estimate.
    failed : Samples without a self-propulsion state.
    seed : Of the random generator.
    metrics : Metrics of each sample, as ``ident.metrics.measure`` names them.

    Examples
    --------
    >>> import ident
    >>> done = ident.validate("my-boat/zigzag.toml", db="coeff_db", version=0)
    >>> bands = done.with_bands(8, seed=1).bands
    >>> low, high = bands.band("psi", "95")
    >>> bool((low <= high).all()), bands.draws.shape == (8, len(bands.estimates))
    (True, True)
    """

    time: Array
    channels: dict[str, Array]
    as_started: dict[str, dict[str, Array]]
    draws: Array
    correlation: Array
    estimates: list[str]
    failed: int
    seed: int
    metrics: tuple[Values, ...] = ()
    _edges: dict[tuple[str, str], dict[float, Array]] = field(default_factory=dict, repr=False, compare=False)
    _scores: dict[str, Array] = field(default_factory=dict, repr=False, compare=False)

    def __repr__(self) -> str:
        return f"Bands({len(self.draws)} samples of {len(self.estimates)} estimates, {len(self.channels)} channels)"

    def of(self, source: str) -> dict[str, Array]:
        """Channels as a source's record starts, which are those of the case where it has no start of its own."""
        return self.as_started.get(source, self.channels)

    def scores(self) -> dict[str, Array]:
        """Independent scores of each coefficient, (samples, rank), mean zero."""
        if not self._scores:
            names = np.array(self.estimates)
            for coefficient in dict.fromkeys(self.estimates):
                places = np.flatnonzero(names == coefficient)
                independent = scores(self.draws[:, places], self.correlation[np.ix_(places, places)])
                self._scores[coefficient] = independent - independent.mean(axis=0)
        return self._scores

    def values(self, rows: pd.DataFrame) -> Array:
        """(samples, rows) values of database rows that were drawn; ``rows`` as they were flown."""
        index, step = _row_steps(rows, correlation_matrix(rows)[0])
        value = rows["value"].to_numpy() + np.where(index >= 0, self.draws[:, index] * step, 0.0)
        return np.asarray(value, dtype=np.float64)

    def band(self, channel: str, level: str, source: str = "") -> tuple[Array, Array]:
        """Lower and upper edge of a band, (rows,) each, SI and radians.

        Parameters
        ----------
        channel : Of the flight.
        level : ``50`` or ``95`` [%].
        source : Whose record the flight starts as; the case's own start without one.
        """
        # A source without a start of its own has the edges of the case.
        key = (channel, source if source in self.as_started else "")
        if key not in self._edges:
            self._edges[key] = _percentiles(self.of(source)[channel])
        low, high = (self._edges[key][p] for p in LEVELS[level])
        return low, high


def _percentiles(values: Array) -> dict[float, Array]:
    """Every edge of the bands of (samples, rows), those of samples that have ended left out."""
    wanted = sorted({p for edges in LEVELS.values() for p in edges})
    edges = np.percentile(values, wanted, axis=0)
    # Few columns have ended samples, and what leaves them out goes column by column.
    ended = ~np.isfinite(values).all(axis=0)
    if ended.any():
        edges[:, ended] = np.nanpercentile(values[:, ended], wanted, axis=0)
    return dict(zip(wanted, edges, strict=True))


def _row_steps(rows: pd.DataFrame, estimates: pd.DataFrame) -> tuple[NDArray[np.int64], Array]:
    """For each row: its estimate's place (-1 for none) and signed standard error."""
    place = pd.Series(range(len(estimates)), index=estimates["estimate"])
    index = np.asarray(rows["estimate"].map(place).fillna(-1), dtype=np.int64)
    value = estimates["value"].to_numpy()
    turned = np.sign(rows["value"].to_numpy() * np.where(index >= 0, value[index], 1.0)) < 0.0
    return index, np.asarray(np.where(turned, -1.0, 1.0) * rows["stderr"].to_numpy(), dtype=np.float64)


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
        records: Array = np.memmap(file, dtype=np.float64, mode="w+", shape=shape)
    return records


class _Stacks:
    """Records and metrics of samples as they come."""

    def __init__(self, case: Case, batch: Batch, samples: int) -> None:
        steps, every = samples_of(case)
        shape = (len(batch.channels), samples, steps // every + 1)
        self.records = {source: _records(shape) for source in batch.flights}
        self.flown = np.zeros(samples, dtype=bool)
        self.metrics: dict[int, Values] = {}

    def put(self, i: int, sample: Flown | None) -> None:
        """Sample i, None where it has no state of self-propulsion."""
        self.flown[i] = sample is not None
        if sample is None:
            return
        self.metrics[i] = sample.metrics
        for source, record in sample.records.items():
            self.records[source][:, i, : record.shape[1]] = record
            self.records[source][:, i, record.shape[1] :] = np.nan


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


@dataclass(frozen=True)
class Execution:
    """Who flies the samples, and who is told; the bands do not depend on it.

    Attributes
    ----------
    workers : Threads; all cores when None.
    each : Called with the number of samples flown since the last call.
    dask : Address of a Dask scheduler that flies them instead.
    chunk : Samples handed out at once.
    """

    workers: int | None = None
    each: Callable[[int], None] = lambda done: None
    dask: str | None = None
    chunk: int = CHUNK


def fly_samples(
    case: Case,
    vehicle: Vehicle,
    rows: pd.DataFrame,
    samples: int,
    seed: int = 0,
    execution: Execution | None = None,
) -> Bands:
    """Fly a case with coefficient sets drawn from the errors of the database.

    Sample i depends on the seed and on i alone, wherever it is flown.

    Parameters
    ----------
    case, vehicle, rows : What is flown, from which version.
    samples, seed : Number of coefficient sets and seed of the generator.
    execution : Who flies them, and who is told; all cores of this machine when None.

    Returns
    -------
    Bands over the simulated states.

    Raises
    ------
    InputError
        When no sample has a self-propulsion state, for more samples than memory and disk hold, or as
        ``ident.validation.cluster.over_dask``.
    """
    execution = execution or Execution()
    chunk, workers, dask = execution.chunk, execution.workers, execution.dask
    _check_room(case, vehicle, rows, samples)
    estimates, correlation = correlation_matrix(rows)
    draws = draw(correlation, samples, seed)
    index, step = _row_steps(rows, estimates)
    value = rows["value"].to_numpy()
    chunks = (value + np.where(index >= 0, draws[i : i + chunk, index] * step, 0.0) for i in range(0, samples, chunk))
    batch = batch_of(case, vehicle, rows)
    stacks = _Stacks(case, batch, samples)
    for place, chunk_flown in over_dask(dask, batch, chunks) if dask else _over_threads(batch, chunks, workers):
        for i, one in enumerate(chunk_flown, start=place * chunk):
            stacks.put(i, one)
        execution.each(len(chunk_flown))
    return _bands(case, batch, stacks, draws, correlation, list(estimates["coefficient"]), seed)


def _bands(
    case: Case, batch: Batch, stacks: _Stacks, draws: Array, correlation: Array, estimates: list[str], seed: int
) -> Bands:
    """What the flights that came to an end say; raises as ``fly_samples`` where none does."""
    flown, samples = stacks.flown, len(draws)
    said = {"case": case.name, "samples": samples, "seed": seed, "without_equilibrium": int((~flown).sum())}
    _log.info("samples flown", extra=said)
    if not flown.any():
        raise InputError(f"case {case.name}", "no sample has a self-propulsion state", "smaller errors or another case")
    kept = {source: _without_failed(stack, flown) for source, stack in stacks.records.items()}
    time, channels = _up_to_the_end(case, batch, kept)
    return Bands(
        time=time,
        channels=channels.pop(""),
        as_started=channels,
        draws=draws if flown.all() else draws[flown],
        correlation=correlation,
        estimates=estimates,
        failed=int(samples - flown.sum()),
        seed=seed,
        metrics=tuple(stacks.metrics[i] for i in sorted(stacks.metrics)),
    )


def _up_to_the_end(case: Case, batch: Batch, stacks: dict[str, Array]) -> tuple[Array, dict[str, dict[str, Array]]]:
    """Times and, by source, channels up to the end of the longest flight."""
    ends = np.max([np.isfinite(stack[0]).any(axis=0).sum() for stack in stacks.values()])
    channels = {s: dict(zip(batch.channels, stack[:, :, :ends], strict=True)) for s, stack in stacks.items()}
    time = np.arange(ends) * samples_of(case)[1] * case.run.step_s
    for stack in channels.values():
        del stack["t"]
    return time, channels
