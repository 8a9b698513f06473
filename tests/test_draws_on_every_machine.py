"""Correlated draws: their factor gives the correlations back, and is the same whatever the linear algebra."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as given_settings
from hypothesis import strategies as st
from kernels_of_linear_algebra import kernels, threads

from ident.validation.band_summary import variance_shares
from ident.validation.bands import Bands
from ident.validation.draws import draw, factor, scores
from sim.boat.row_codec import correlation_matrix
from sim.files.errors import InputError

ELSEWHERE = """
import hashlib, json, sys
from dataclasses import asdict
import numpy as np
from ident.validation.band_summary import variance_shares
from ident.validation.bands import Bands
from ident.validation.draws import draw, scores
correlation = np.load(sys.argv[1])
drawn = draw(correlation, 60, seed=3)
within = scores(drawn[:, :300], correlation[:300, :300])
names = [f"C{i // 4}" for i in range(len(correlation))]
channel = (3.0 * drawn[:, 0] + drawn[:, 1] + drawn[:, 500])[:, None] * np.cos(0.1 * np.arange(50.0))
shares = variance_shares(Bands(np.arange(50.0), {"psi": channel}, {}, drawn, correlation, names, 0, 3), "psi")
digest = lambda values: hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()
product = drawn.T @ drawn[:, :200]
listed = [asdict(one) for one in shares]
print(json.dumps({"product": digest(product), "same": [digest(drawn), digest(within), listed]}))
"""


@pytest.fixture(scope="module")
def correlation(rows):
    return correlation_matrix(rows)[1]


def test_draws_and_what_follows_are_the_same_under_any_linear_algebra(correlation, tmp_path):
    """To the last bit, for every core type this machine executes, on one thread and on two."""
    np.save(tmp_path / "correlation.npy", correlation)
    root = str(Path(__file__).parents[1])
    found = []
    for own in [kernel | threads(n) for kernel in kernels() for n in (1, 2)]:
        command = [sys.executable, "-c", ELSEWHERE, str(tmp_path / "correlation.npy")]
        environment = os.environ | own | {"PYTHONPATH": root}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, (own, done.stderr)
        found.append(json.loads(done.stdout))
    assert len({json.dumps(one["same"]) for one in found}) == 1
    assert found[0]["same"][2], "shares of which nothing is listed would be the same anywhere"
    if len(found) > 2 and "openblas" in np.show_config(mode="dicts")["Build Dependencies"]["blas"]["name"]:
        # The settings do reach the library: a product of matrices differs.
        assert len({one["product"] for one in found}) > 1


def _whole(correlation):
    root = np.zeros_like(correlation)
    for block in factor(correlation):
        root[np.ix_(block.members, block.pivots)] = block.root
    return root


@st.composite
def correlations(draw_from):
    """Correlation matrices of some blocks, each of any rank, their values in any order."""
    parts = draw_from(st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6)), min_size=1, max_size=4))
    random = np.random.default_rng(draw_from(st.integers(0, 2**32)))
    size = sum(n for n, _ in parts)
    matrix, first = np.zeros((size, size)), 0
    for n, rank in parts:
        lines = random.standard_normal((n, rank))
        if draw_from(st.booleans()):
            # Few values, so that many correlations are equal.
            lines = np.where(lines > 0.0, 1.0, -1.0)
        lines /= np.linalg.norm(lines, axis=1)[:, None]
        matrix[first : first + n, first : first + n] = lines @ lines.T
        first += n
    order = random.permutation(size)
    matrix = matrix[np.ix_(order, order)]
    # As the database holds them.
    matrix = np.array([[float(f"{x:.6g}") if abs(x) > 1e-6 else 0.0 for x in row] for row in matrix])
    np.fill_diagonal(matrix, 1.0)
    return matrix


@given(correlations())
@given_settings(deadline=None)
def test_factor_gives_the_correlations_back(correlation):
    """root root^T is the matrix to what is left out, semidefinite or not; blocks do not touch."""
    root = _whole(correlation)
    assert np.abs(root @ root.T - correlation).max() < 5e-5
    places = np.concatenate([block.members for block in factor(correlation)])
    assert sorted(places) == list(range(len(correlation)))
    for block in factor(correlation):
        others = np.setdiff1d(np.arange(len(correlation)), block.members)
        assert not correlation[np.ix_(block.members, others)].any()
        assert len(block.pivots) <= np.linalg.matrix_rank(correlation[np.ix_(block.members, block.members)], tol=1e-6)


@given(correlations(), st.integers(0, 10**6))
@given_settings(deadline=None)
def test_scores_of_draws_give_the_draws_back(correlation, seed):
    """Draws are root times independent scores: what forward substitution takes out goes in again."""
    drawn = draw(correlation, 5, seed)
    assert np.array_equal(drawn[:3], draw(correlation, 3, seed))
    blocks = factor(correlation, 1e-4)
    root = np.concatenate([_placed(block, len(correlation)) for block in blocks], axis=1)
    assert np.abs(scores(drawn, correlation) @ root.T - drawn).max() < 0.1


def _placed(block, size):
    columns = np.zeros((size, len(block.pivots)))
    columns[block.members] = block.root
    return columns


@pytest.mark.parametrize("size", [2, 5, 24])
def test_rounding_does_not_choose_the_pivots(size):
    """Equal correlations leave equal variances: the order is that of the matrix, with rounding or without."""
    equal = np.full((size, size), 0.4) + 0.6 * np.eye(size)
    noise = np.random.default_rng(size).uniform(-1e-9, 1e-9, (size, size))
    noise = noise + noise.T
    np.fill_diagonal(noise, 0.0)
    for matrix in (equal, equal + noise):
        assert list(factor(matrix)[0].pivots) == list(range(size))


def test_factor_in_closed_form():
    """Two values with correlation r: columns (1, r) and (0, sqrt(1 - r^2)); r = 1 leaves one column."""
    block = factor(np.array([[1.0, 0.28], [0.28, 1.0]]))[0]
    assert block.root == pytest.approx(np.array([[1.0, 0.0], [0.28, 0.96]]), rel=1e-15)
    assert factor(np.ones((2, 2)))[0].root.tolist() == [[1.0], [1.0]]


def test_what_no_values_can_have_is_refused():
    """Three values each against the two others; and a number that is none."""
    opposed = np.full((3, 3), -0.9) + 1.9 * np.eye(3)
    with pytest.raises(InputError, match="semidefinite"):
        draw(opposed, 2, 0)
    with pytest.raises(InputError, match="not finite"):
        draw(np.array([[1.0, np.nan], [np.nan, 1.0]]), 2, 0)


def _bands(drawn, correlation, channel, names):
    return Bands(np.arange(channel.shape[1]), {"psi": channel}, {}, drawn, correlation, names, 0, 0)


def test_standard_errors_of_shares_cover_the_truth():
    """y = 0.6 a + 0.8 b, 300 draws of 100 samples: A has 0.36, within two standard errors 19 times in 20."""
    inside, listed = 0, 0
    for seed in range(300):
        drawn = draw(np.eye(2), 100, seed)
        channel = (0.6 * drawn[:, 0] + 0.8 * drawn[:, 1])[:, None]
        found = {s.coefficient: s for s in variance_shares(_bands(drawn, np.eye(2), channel, ["A", "B"]), "psi")}
        if "A" in found:
            listed += 1
            inside += abs(found["A"].share - 0.36) < 2.0 * found["A"].standard_error
    assert listed >= 290
    # Of 300 with probability 0.92 (the jackknife of a skewed share), five standard deviations.
    assert inside >= 0.84 * listed


def test_chance_lists_a_coefficient_as_seldom_as_stated():
    """A channel that goes with nothing, ten coefficients: one draw in a hundred lists any."""
    listed, names = 0, [f"C{i // 3}" for i in range(30)]
    for seed in range(200):
        drawn = draw(np.eye(31), 40, seed)
        listed += bool(variance_shares(_bands(drawn[:, :30], np.eye(30), drawn[:, 30:], names), "psi"))
    # Two are expected; more than nine with probability 5e-5.
    assert listed <= 9
