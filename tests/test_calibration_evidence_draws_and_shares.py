"""Evidence against integrals, draws against a known density, shares of the variance against closed forms."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy import integrate, special

from ident.calibration import posterior, sensitivity
from ident.calibration.problem import Channel
from ident.calibration.selection import Quadratic, log_evidence
from sim.files.errors import InputError


def linear(residual, slopes, mean, prior, pieces):
    """One series with reading error 1 whose residual is linear in the multipliers, about the point zero."""
    channel = Channel(("case", "A", "psi"), np.arange(residual.size * 1.0), residual, False, 1.0, 0.0, pieces)
    n = residual.size
    square, slope, curvature = residual @ residual / n, slopes.T @ residual / n, slopes.T @ slopes / n
    return Quadratic([channel], np.zeros(len(mean)), mean, prior, square[None], slope[None], curvature[None])


@pytest.mark.parametrize("subset", [(0,), (1,), (0, 1)])
def test_log_evidence_is_the_integral_over_the_prior(subset):
    # Residuals below their reading error, so that the discrepancy is next to nothing and the density is normal.
    random = np.random.default_rng(3)
    residual, slopes = 0.3 * random.standard_normal(40), random.standard_normal((40, 2))
    mean, prior, pieces = np.array([0.4, -0.2]), np.array([0.5, 0.8]), 12.0
    near = linear(residual, slopes, mean, prior, pieces)

    def density(*free):
        theta = mean.copy()
        theta[list(subset)] = free
        r = residual + slopes @ theta
        own = np.array([theta[i] - mean[i] for i in subset]) / prior[list(subset)]
        norm = np.prod(prior[list(subset)] * np.sqrt(2.0 * np.pi))
        return np.exp(-0.5 * pieces * np.mean(r**2) - 0.5 * own @ own) / norm

    limits = [(mean[i] - 5.0 * prior[i], mean[i] + 5.0 * prior[i]) for i in subset]
    whole = integrate.nquad(density, limits)[0]
    assert log_evidence(near, subset) == pytest.approx(np.log(whole), abs=0.02)


def test_a_multiplier_that_moves_nothing_is_never_asked_for():
    random = np.random.default_rng(4)
    slopes = np.stack([random.standard_normal(40), np.zeros(40)], axis=1)
    near = linear(slopes[:, 0] * 3.0, slopes, np.zeros(2), np.ones(2), 10.0)
    assert log_evidence(near, (0, 1)) == pytest.approx(log_evidence(near, (0,)), abs=1e-9)
    assert log_evidence(near, (0,)) > log_evidence(near, ()) + 1.0


def test_draws_have_the_mean_and_width_of_a_skewed_density():
    # The logarithm of a gamma variate of shape 2: its quadratic at the mode has the wrong mean and width.
    shape = 2.0
    walk, taken = posterior.chain(
        lambda x: shape * float(x[0]) - float(np.exp(x[0])), np.array([np.log(shape)]), np.array([[1.0 / shape]]), 6000
    )
    assert 0.3 < taken < 1.0
    assert walk.mean() == pytest.approx(special.digamma(shape), abs=0.05)
    assert walk.std() == pytest.approx(np.sqrt(special.polygamma(1, shape)), abs=0.05)


def test_draws_are_the_same_with_one_and_two_workers():
    def density(x):
        return -0.5 * float(x @ x)

    one, two = (posterior.chain(density, np.zeros(2), np.eye(2), 120, 5, workers)[0] for workers in (1, 2))
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, posterior.chain(density, np.zeros(2), np.eye(2), 120, 6, 1)[0])


def test_shares_of_a_product_are_those_of_the_closed_form():
    # y = 2 x1 + x2 + 1.5 x1 x2 of standard normal unknowns: variances 4, 1 and 2.25; x3 does nothing.
    described, points = sensitivity.design(np.zeros(3), np.ones(3), np.full(3, -np.inf), 2048, 1)
    y = 2.0 * points[:, 0] + points[:, 1] + 1.5 * points[:, 0] * points[:, 1]
    found = sensitivity.indices(described, y, 1)
    for share, first, total in zip(found, (4.0, 1.0, 0.0), (6.25, 3.25, 0.0), strict=True):
        assert share.first == pytest.approx(first / 7.25, abs=4.0 * share.first_error + 1e-6)
        assert share.total == pytest.approx(total / 7.25, abs=4.0 * share.total_error + 1e-6)
        assert share.total_error < 0.05


def test_the_main_direction_of_histories_is_the_one_they_differ_in():
    random = np.random.default_rng(2)
    shape = np.sin(np.linspace(0.0, 3.0, 50))
    size = random.standard_normal(30)
    scores, along = sensitivity.main_direction(5.0 + np.outer(size, shape))
    assert along == pytest.approx(1.0)
    assert abs(np.corrcoef(scores, size)[0, 1]) == pytest.approx(1.0)
    assert sensitivity.main_direction(np.ones((4, 6)))[1] == 0.0


@pytest.mark.parametrize(
    ("missing", "ask", "option"),
    [("emcee", posterior.emcee, "--posterior"), ("SALib.analyze", sensitivity.salib, "--sensitivity")],
)
def test_a_package_that_is_not_there_is_named_with_its_extra(monkeypatch, missing, ask, option):
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=r"ident-submarine\[posterior\]") as said:
        ask()
    assert option in str(said.value)
