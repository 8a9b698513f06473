"""Fits of many runs: the least squares written out in full, repeated runs, coverage."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.sparse import csr_array, random_array

from ident.captive.campaign import read_campaign
from ident.captive.run_table import MEASURED, run_table, sigma
from ident.checks.check import findings_of
from ident.checks.findings import Evidence
from ident.fitting.bench import recorded, repeated_campaign, worse
from ident.fitting.fit import fit
from ident.identification import solver
from ident.identification.identify import identify
from ident.identification.stage_solve import Loads, solve_stage, weights
from ident.options import Work

BB2 = Path(__file__).resolve().parents[1] / "raw_captive_data" / "bb2"


@pytest.fixture(scope="module")
def campaign():
    return read_campaign(BB2)


@pytest.fixture(scope="module")
def identified(campaign):
    return identify(campaign)


def stage(seed):
    """A stage of 60 loads: 12 unknowns, 5 values known with correlated errors, copies of either sign, one zero load."""
    make = np.random.default_rng(seed)
    a = random_array((60, 12), density=0.2, rng=make).toarray() + np.eye(60, 12) + np.roll(np.eye(60, 12), 20, axis=0)
    a[np.abs(a).max(axis=1) == 0.0, 3] = 1.0
    b = random_array((60, 5), density=0.3, rng=make).toarray()
    root = make.normal(size=(5, 5))
    value = make.normal(size=60)
    value[7] = 0.0
    spread = make.uniform(0.1, 1.0, size=60)
    shared = np.arange(60)
    shared[[7, 30, 31, 32, 50]] = shared[[6, 10, 10, 11, 10]]
    return a, b, value, spread, shared, make.normal(size=5), root @ root.T


def in_full(a, b, value, spread, shared, old, covariance):
    """The same by the normal equations, and the covariance of all loads, entry by entry."""
    w = np.diag(weights(a, spread) ** 2)
    gain = np.linalg.solve(a.T @ w @ a, a.T @ w)
    errors = np.zeros((60, 60))
    for i in range(60):
        for j in range(60):
            if i == j or shared[i] == shared[j]:
                errors[i, j] = (1.0 if i == j else np.sign(value[i] * value[j])) * spread[i] * spread[j]
    own = gain @ (errors + b @ covariance @ b.T) @ gain.T
    new = gain @ (value - b @ old)
    return new, own, -gain @ b @ covariance, value - b @ old - a @ new, np.diag(a @ gain)


@pytest.mark.parametrize("full", [0, 1000])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_stage_is_the_least_squares_written_out_in_full(seed, full):
    a, b, value, spread, shared, old, covariance = given = stage(seed)
    found = solve_stage(csr_array(a), csr_array(b), Loads(value, spread, np.sign(value), shared), old, covariance, full)
    assert not found.lost
    parts = (found.values, found.covariance, found.cross, found.residual, found.leverage)
    for got, wanted in zip(parts, in_full(*given), strict=True):
        np.testing.assert_allclose(got, wanted, rtol=1e-9, atol=1e-11)


def test_sparse_matrices_find_what_full_ones_do(campaign, identified, monkeypatch):
    monkeypatch.setattr(solver, "solve_stage", partial(solve_stage, full=0))
    again = identify(campaign)
    assert [(n.name, n.part, n.point, n.runs, n.tests) for n in again.nodes] == [
        (n.name, n.part, n.point, n.runs, n.tests) for n in identified.nodes
    ]
    np.testing.assert_allclose(again.values, identified.values, rtol=1e-9, atol=1e-15)
    size = np.sqrt(np.diag(identified.covariance))
    assert np.abs((again.covariance - identified.covariance) / np.outer(size, size)).max() < 1e-9
    worst = np.array([[n.worst for n in found.nodes] for found in (again, identified)])
    np.testing.assert_allclose(*worst, rtol=1e-9, atol=1e-9)
    assert again.unused == identified.unused
    assert again.warnings == identified.warnings


def repeated(runs: pd.DataFrame, times: int) -> pd.DataFrame:
    """Every run of a table some times over; a copy is one of the run of its own number."""
    out = runs.loc[runs.index.repeat(times)].reset_index(drop=True)
    number = "#" + pd.Series(np.tile(np.arange(times), len(runs)).astype(str))
    return out.assign(run_id=out["run_id"] + number, copy_of=(out["copy_of"] + number).where(out["copy_of"] != "", ""))


@pytest.mark.parametrize("times", [2, 5])
def test_repeated_runs_give_the_values_again_and_errors_by_the_root_of_their_number(campaign, identified, times):
    """Up to the wake fraction, which comes of the first run alone."""
    found = identify(replace(campaign, runs=repeated(campaign.runs, times)))
    assert [(n.name, n.part, n.point) for n in found.nodes] == [(n.name, n.part, n.point) for n in identified.nodes]
    of = np.array([n.name != "w_T" for n in found.nodes])
    np.testing.assert_allclose(found.values[of], identified.values[of], rtol=1e-9, atol=1e-14)
    one, many = (x.covariance[np.ix_(of, of)] for x in (identified, found))
    size = np.sqrt(np.diag(one))
    assert np.abs((many * times - one) / np.outer(size, size)).max() < 1e-9


def test_coverage_of_the_errors_that_eleven_thousand_runs_leave(campaign, identified):
    """Loads with errors of the stated size, shared by copies: deviations are what the covariance says.

    The estimate is linear in the loads, so its expectation is the estimate from loads without error.
    """
    runs = repeated(campaign.runs, 20)
    make = np.random.default_rng(5)
    original, _ = pd.factorize(runs["run_id"].where(runs["copy_of"] == "", runs["copy_of"]))
    for measured in MEASURED:
        if measured in runs and measured != "value":
            error = make.normal(size=len(runs))[original] * np.sign(runs[measured].to_numpy())
            runs[measured] = runs[measured] + error * runs[sigma(measured)].fillna(0.0)
    assert len(runs) > 11_000
    found = identify(replace(campaign, runs=runs))
    stderr = np.sqrt(np.diag(found.covariance))
    of = (stderr > 0.0) & np.array([n.name != "w_T" for n in found.nodes])
    scores = ((found.values - identified.values) / np.where(of, stderr, 1.0))[of]
    assert scores.size > 1000
    assert np.mean(np.abs(scores) < 1.0) == pytest.approx(0.683, abs=0.05)
    assert np.mean(np.abs(scores) < 2.0) == pytest.approx(0.954, abs=0.025)


def test_loads_that_agree_by_chance_are_no_frozen_column_and_a_frozen_one_is():
    """Three thousand loads of six digits: some dozen agree; forty that stand still are another thing."""
    make = np.random.default_rng(3)
    load = np.round(make.uniform(1e5, 9.99e5, size=3000))
    columns = {"test": "towing", "part": "hull", "file": "a.csv", "U": 1.0 + np.arange(3000) / 1000.0, "X": load}
    columns |= {"run_id": [str(i) for i in range(3000)], "Z": make.normal(size=3000)}
    assert len(np.unique(load)) < 3000
    assert not [f for f in findings_of(Evidence(runs=run_table(columns))) if f.check == "frozen_column"]
    load[200:240] = 123457.0
    (found,) = (f for f in findings_of(Evidence(runs=run_table(columns | {"X": load}))) if f.check == "frozen_column")
    assert found.columns == ("X",)
    assert set(range(202, 242)) <= set(found.rows)


def test_a_fit_tells_how_far_it_is(tmp_path):
    said: dict[str, list[tuple[int, int]]] = {}
    (done,) = fit(
        BB2, str(tmp_path / "db"), work=Work(tell=lambda what, n, of: said.setdefault(what, []).append((n, of)))
    )
    assert {"identifying", "checking", "reading towing.csv"} <= set(said)
    for steps in said.values():
        counts, (total,) = [n for n, _ in steps], {of for _, of in steps}
        assert counts == sorted(counts)
        assert counts[-1] == total
    assert len(done.rows) > 2000


def test_a_campaign_of_repeated_runs_is_the_same_but_for_noise(campaign, tmp_path):
    made = read_campaign(repeated_campaign(BB2, tmp_path / "x3", 3)).runs
    assert len(made) == 3 * len(campaign.runs)
    assert made["run_id"].is_unique
    own = campaign.runs.loc[campaign.runs.index.repeat(3)].reset_index(drop=True)
    for state in ("U", "alpha", "plane", "r"):
        np.testing.assert_array_equal(made[state], own[state])
    off = (made["X"] / own["X"] - 1.0)[own["X"].abs() > 0.0]
    assert 0.009 < off.std() < 0.011


def test_ratios_worse_than_recorded_by_more_than_a_quarter_are_said():
    assert not worse({k: 1.2 * v for k, v in recorded().items()})
    assert len(worse({k: 1.3 * v for k, v in recorded().items()})) == len(recorded()) == 2
