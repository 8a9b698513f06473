"""Invariants: a fit of one process and of a cluster of two; error bands in memory and in a file."""

from __future__ import annotations

import pickle
from importlib.util import find_spec

import numpy as np
import pytest
from made_campaigns import CONSTANTS, SAMPLES, campaign, history

from ident.captive.campaign import read_campaign
from ident.cluster import cluster as over
from ident.fitting.fit import fit
from ident.identification import stage_solve
from ident.options import Work
from ident.validation import band_summary, bands
from sim.files.errors import InputError
from sim.flight.case import load_case

needs_dask = pytest.mark.skipif(find_spec("distributed") is None, reason="needs the extra dask")
NAMES = '[source.columns]\ntime = "time"\nX = "X_N"\nY = "Y_N"\nN = "N_Nm"'


@pytest.fixture(scope="module")
def cluster():
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as found:
        yield found.scheduler_address


@pytest.fixture
def histories(tmp_path):
    """Drift runs as time histories, each at its own angle."""
    every = []
    for angle in (2, 4, 6):
        name = f"beta{angle}.csv"
        lines = [",".join(f"{x:.6g}" for x in (t, x, angle * y, angle * n)) for t, x, y, n in SAMPLES]
        campaign(tmp_path)
        (tmp_path / name).write_text("time_s,X_N,Y_N,N_Nm\n" + "\n".join(lines) + "\n", "utf-8")
        every.append(history(name, constants=CONSTANTS.replace("5 deg", f"{angle} deg") + f'run_id = "{name}"\n'))
    return campaign(tmp_path, "".join(every))


@needs_dask
def test_two_processes_read_and_reduce_what_one_does(cluster, histories):
    alone = read_campaign(histories)
    with over(cluster) as spread:
        there = read_campaign(histories, spread=spread)
    assert len(alone.runs) == 3
    assert alone.runs.equals(there.runs)
    assert [one.fit.values.tolist() for one in alone.reduced] == [one.fit.values.tolist() for one in there.reduced]
    assert alone.digests == there.digests


@needs_dask
def test_two_processes_fit_what_one_does(cluster, histories, tmp_path_factory, monkeypatch):
    db = tmp_path_factory.mktemp("db")
    monkeypatch.setattr(stage_solve, "_SHARE", 1)
    (alone,) = fit(histories, db / "alone", measured_only=True)
    (there,) = fit(histories, db / "there", measured_only=True, work=Work(dask=cluster))
    assert len(alone.rows) > 3
    assert alone.digest == there.digest


@needs_dask
def test_faults_of_a_file_come_back_from_the_cluster(cluster, histories):
    path = histories / "beta4.csv"
    text = path.read_text("utf-8")
    path.write_text(text.replace("\n0.1,", "\n0.0,", 1), "utf-8")
    with pytest.raises(InputError) as alone:
        read_campaign(histories)
    with pytest.raises(InputError) as there, over(cluster) as spread:
        read_campaign(histories, spread=spread)
    assert str(alone.value) == str(there.value)
    assert "beta4.csv" in there.value.where


def test_message_keeps_its_parts_on_the_way_between_processes():
    error = pickle.loads(pickle.dumps(InputError("here", "this", "that")))
    assert (error.where, error.found, error.allowed, str(error)) == (
        "here",
        "this",
        "that",
        "here: this (allowed: that)",
    )


def test_records_in_a_file_are_those_in_memory(campaign, rows, monkeypatch):
    case = load_case("hzz20")[0]
    case = case.model_copy(update={"run": case.run.model_copy(update={"duration_s": 20.0})})
    held = bands.fly_samples(case, campaign.vehicle, rows, 5, seed=2)
    monkeypatch.setattr(bands, "_IN_MEMORY", 0.0)
    filed = bands.fly_samples(case, campaign.vehicle, rows, 5, seed=2)
    assert isinstance(filed.channels["psi"].base, np.memmap) or isinstance(filed.channels["psi"], np.memmap)
    for channel, values in held.channels.items():
        assert np.array_equal(values, filed.channels[channel], equal_nan=True), channel


def test_shares_over_some_instants_are_those_over_all(campaign, rows, monkeypatch):
    case = load_case("hzz20")[0]
    case = case.model_copy(update={"run": case.run.model_copy(update={"duration_s": 20.0})})
    held = bands.fly_samples(case, campaign.vehicle, rows, 120, seed=2)
    every = band_summary.variance_shares(held, "psi", most=3)
    monkeypatch.setattr(band_summary, "_INSTANTS", 40)
    some = {s.coefficient: s.share for s in band_summary.variance_shares(held, "psi", most=99)}
    assert every
    for one in every:
        assert some[one.coefficient] == pytest.approx(one.share, abs=0.02)


def test_hundred_thousand_samples_of_the_zigzag_fit_a_machine_of_24_GB(campaign, rows, monkeypatch):
    monkeypatch.setattr(bands, "_memory", lambda: 24e9)
    monkeypatch.setattr(bands.shutil, "disk_usage", lambda path: type("Disk", (), {"free": 100e9}))
    case = load_case("hzz20")[0]
    bands._check_room(case, campaign.vehicle, rows, 100_000)
    with pytest.raises(InputError, match="GB of memory"):
        bands._check_room(case, campaign.vehicle, rows, 10_000_000)
