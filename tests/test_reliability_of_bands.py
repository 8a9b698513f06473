"""Coverage, reliability and intervals of metrics against draws whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from ident.metrics.metric import Metric
from ident.validation.band_summary import inside
from ident.validation.bands import Bands, fly_samples
from ident.validation.reliability import mean_shares, metric_intervals, ranks, reliability, with_intervals
from sim.files.record import Record
from sim.flight.case import load_case
from sim.flight.series import Series


def bands(samples, time, channel="psi", metrics=()):
    one = np.eye(1)
    return Bands(time, {channel: samples}, {}, np.zeros((len(samples), 1)), one, ["A"], 0, 0, metrics)


@pytest.fixture(scope="module")
def case():
    found, _ = load_case("hzz20")
    assert found.reference is not None
    reference = found.reference.model_copy(update={"compare": ["EXP"], "channels": ["psi"]})
    return found.model_copy(update={"reference": reference})


@pytest.mark.parametrize(("width", "least", "most"), [(1.0, 0.0, 0.08), (3.0, 0.2, 0.6), (0.3, 0.3, 0.7)])
def test_honest_bands_are_reliable_and_others_are_not(case, width, least, most):
    """References drawn as the samples are: shares follow the levels; wrong widths leave the diagonal."""
    rng, time = np.random.default_rng(4), np.arange(400.0)
    samples = width * rng.standard_normal((800, 400))
    series = Series({"EXP": {"psi": Record("psi", time, rng.standard_normal(400), "rad")}})
    points = reliability(ranks(bands(samples, time), case, series))
    away = max(abs(p.share - p.level) for p in points)
    assert least < away < most
    shares = mean_shares([inside(bands(samples, time), case, series)])
    by_level = {p.level: p.share for p in points}
    assert shares["50"] == pytest.approx(by_level[0.5], abs=0.02)
    assert shares["95"] == pytest.approx(by_level[0.95], abs=0.02)


def test_no_reference_no_coverage():
    assert mean_shares([{}]) is None
    assert reliability([]) == []


def test_intervals_are_quantiles_and_say_what_never_came():
    rng = np.random.default_rng(1)
    drawn = rng.normal(10.0, 2.0, 4000)
    metrics = tuple({"overshoot": float(x), "rare": None if i % 4 else 1.0} for i, x in enumerate(drawn))
    found = metric_intervals(bands(np.zeros((4000, 2)), np.arange(2.0), metrics=metrics))
    assert found["overshoot"].q025 == pytest.approx(10.0 - 1.96 * 2.0, abs=0.2)
    assert found["overshoot"].q50 == pytest.approx(10.0, abs=0.1)
    assert found["overshoot"].q975 == pytest.approx(10.0 + 1.96 * 2.0, abs=0.2)
    assert found["overshoot"].without == 0.0
    assert found["rare"].without == pytest.approx(0.75)
    flown = {"overshoot": Metric({"simulated": 9.0, "EXP": 11.0})}
    beside = with_intervals(flown, bands(np.zeros((4000, 2)), np.arange(2.0), metrics=metrics))
    assert set(flown["overshoot"]) == {"simulated", "EXP"}
    assert {"simulated", "EXP", "q025", "q50", "q975"} <= set(beside["overshoot"])
    assert list(beside["overshoot"].to_dict()) == ["simulated", "EXP", "q025", "q50", "q975", "without"]
    assert beside["rare"].simulated is None


def test_samples_without_errors_have_the_metrics_of_the_run(campaign, rows):
    found, _ = load_case("vzz10-10kt")
    short = found.model_copy(update={"run": found.run.model_copy(update={"duration_s": 40.0}), "reference": None})
    flown = fly_samples(short, campaign.vehicle, rows.assign(stderr=0.0), 2)
    assert len(flown.metrics) == 2
    assert flown.metrics[0] == flown.metrics[1]
    assert any(x is not None for x in flown.metrics[0].values())
