"""Invariants of the batch: the same samples from any workers, chunks, processes; the single run without errors."""

from __future__ import annotations

import builtins
from importlib.util import find_spec

import numpy as np
import pytest

from ident.validation.bands import Execution, fly_samples
from ident.validation.cluster import over_dask
from ident.validation.draws import draw
from ident.validation.samples import batch_of
from sim.boat.coefficients import Coefficients
from sim.boat.row_codec import correlation_matrix
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.reference import Start
from sim.flight.simulate import environment_of, simulate
from sim.kernel.assemble import Assembly, assemble

needs_dask = pytest.mark.skipif(find_spec("distributed") is None, reason="needs the extra dask")


@pytest.fixture(scope="module")
def case():
    found, _ = load_case("hzz20")
    return found.model_copy(update={"run": found.run.model_copy(update={"duration_s": 40.0})})


@pytest.fixture(scope="module")
def alone(case, campaign, rows):
    return fly_samples(case, campaign.vehicle, rows, 9, seed=4, execution=Execution(workers=1, chunk=1))


def _same(one, other):
    assert np.array_equal(one.draws, other.draws)
    assert set(one.channels) == set(other.channels)
    for channel, values in one.channels.items():
        assert np.array_equal(values, other.channels[channel], equal_nan=True), channel


def _assert_same_flight(one, other):
    """As docs/integration.md states it of steps with two stages."""
    assert np.sqrt(np.mean((one - other) ** 2)) < 1e-4 * np.ptp(other)


@pytest.mark.parametrize(("workers", "chunk"), [(1, 9), (2, 2), (5, 4)])
def test_bands_do_not_depend_on_workers_or_chunks(case, campaign, rows, alone, workers, chunk):
    done = []
    found = fly_samples(
        case, campaign.vehicle, rows, 9, seed=4, execution=Execution(workers=workers, chunk=chunk, each=done.append)
    )
    _same(alone, found)
    assert sum(done) == 9


def test_more_samples_begin_with_the_same_samples(case, campaign, rows, alone):
    few = fly_samples(case, campaign.vehicle, rows, 4, seed=4)
    assert np.array_equal(few.channels["psi"], alone.channels["psi"][:4])


def test_sample_of_the_batch_is_the_single_run_of_its_coefficients(case, campaign, rows, alone):
    """Sample 3, its row values made here from the draw, flown through assemble as a single run is."""
    estimates, correlation = correlation_matrix(rows)
    score = dict(zip(estimates["estimate"], draw(correlation, 4, seed=4)[3], strict=True))
    first = dict(zip(estimates["estimate"], estimates["value"], strict=True))
    values = [
        row.value + score[row.estimate] * row.stderr * (-1.0 if row.value * first[row.estimate] < 0.0 else 1.0)
        if row.estimate >= 0
        else row.value
        for row in rows.itertuples()
    ]
    single = simulate(case, Coefficients(campaign.vehicle, rows.assign(value=values)))
    for channel in ("psi", "u", "r", "phi", "z"):
        _assert_same_flight(alone.channels[channel][3], single[channel])


@pytest.mark.parametrize("name", ["hzz20", "self-propulsion"])
def test_linear_map_is_the_assembly(name, campaign, rows):
    """Data, added mass and wake at values far from those the map was made at."""
    found, _ = load_case(name)
    base = Coefficients(campaign.vehicle, rows)
    values = rows["value"].to_numpy() * np.random.default_rng(0).uniform(0.5, 1.5, len(rows))
    mapped = Assembly(base, environment_of(found)).model(values)
    whole = assemble(base.with_values(values), environment_of(found))
    assert np.array_equal(mapped.whole, whole.whole)
    for name in ("data", "mass_matrix", "added_mass", "inverse_mass", "wake", "planes", "r_g"):
        one, other = (np.asarray(getattr(m, name)) for m in (mapped, whole))
        assert one == pytest.approx(other, rel=1e-12, abs=1e-14 * np.abs(other).max(initial=1)), name


def test_flights_from_a_sources_own_start_are_part_of_the_batch(case, campaign, rows):
    start = Start(speed_mps=4.0, source="made for this test")
    reference = case.reference.model_copy(update={"initial": {"EXP": start}})
    own = case.model_copy(update={"reference": reference})
    bands = fly_samples(own, campaign.vehicle, rows.assign(stderr=0.0), 2)
    single = simulate(own.started_as("EXP"), Coefficients(campaign.vehicle, rows))
    _assert_same_flight(bands.as_started["EXP"]["u"][0], single["u"])
    assert bands.as_started["EXP"]["U"][:, 0] == pytest.approx([4.0, 4.0])
    assert bands.channels["U"][:, 0] == pytest.approx(np.full(2, own.initial.speed_mps))


@pytest.fixture(scope="module")
def cluster():
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as found:
        yield found


@needs_dask
@pytest.mark.parametrize("chunk", [2, 5])
def test_two_dask_processes_give_what_threads_give(cluster, case, campaign, rows, alone, chunk):
    done = []
    address = cluster.scheduler_address
    found = fly_samples(
        case, campaign.vehicle, rows, 9, seed=4, execution=Execution(dask=address, chunk=chunk, each=done.append)
    )
    _same(alone, found)
    assert sum(done) == 9


@needs_dask
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "tcp://no-such-host.invalid:8786"])
def test_address_that_does_not_answer_is_named(address, case, campaign, rows, monkeypatch):
    monkeypatch.setattr("ident.cluster._PATIENCE", 1)
    with pytest.raises(InputError) as refused:
        next(over_dask(address, batch_of(case, campaign.vehicle, rows), []))
    assert address in refused.value.where
    assert "no scheduler answers" in refused.value.found


@needs_dask
def test_workers_of_another_version_are_refused(cluster, case, campaign, rows, monkeypatch):
    monkeypatch.setattr("ident.cluster.__version__", "9.9.9")
    with pytest.raises(InputError, match=r"9\.9\.9"):
        next(over_dask(cluster.scheduler_address, batch_of(case, campaign.vehicle, rows), []))


def test_missing_extra_says_how_to_install_it(case, campaign, rows, monkeypatch):
    known = builtins.__import__

    def without(name, *rest, **named):
        if name.split(".")[0] == "distributed":
            raise ModuleNotFoundError("No module named 'distributed'")
        return known(name, *rest, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError) as refused:
        fly_samples(case, campaign.vehicle, rows, 2, execution=Execution(dask="tcp://127.0.0.1:1"))
    assert "ident-submarine[dask]" in refused.value.allowed
