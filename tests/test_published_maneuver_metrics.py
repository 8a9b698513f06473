"""Metrics of the reference series against the values published beside them.

The published numbers are those of the digitised curves (their own reading, with its
standard error); four standard errors are allowed, and half a sample where the two ways to
read a peak differ.
"""

from __future__ import annotations

import numpy as np
import pytest

import ident
from ident.metrics.zigzag import roll_decay, zigzag
from sim.flight.case import load_case
from sim.flight.series import load_reference

HZZ20 = {
    "EXP": {
        "overshoot_1_deg": (11.838, 0.079),
        "overshoot_2_deg": (12.794, 0.13),
        "overshoot_3_deg": (12.084, 0.079),
        "execute_2_s": (18.255, 0.29),
        "execute_3_s": (69.495, 0.1),
        "execute_4_s": (128.76, 0.1),
        "period_s": (110.5, 0.3),
    },
    "HDM": {
        "overshoot_1_deg": (13.379, 0.062),
        "overshoot_2_deg": (20.573, 0.062),
        "overshoot_3_deg": (21.802, 0.062),
        "execute_2_s": (19.085, 0.077),
        "execute_4_s": (124.54, 0.075),
    },
}
VZZ10_10KT = {
    "CFD": {
        "overshoot_1_deg": (1.6049, 0.072),
        "overshoot_2_deg": (1.8578, 0.072),
        "execute_2_s": (19.101, 0.3),
        "execute_3_s": (50.78, 0.18),
    },
    "HDM": {"overshoot_2_deg": (2.892, 0.035), "execute_4_s": (84.435, 0.1)},
}


def assert_close(found: dict[str, float | None], published: dict[str, tuple[float, float]]) -> None:
    for metric, (value, sigma) in published.items():
        assert found[metric] == pytest.approx(value, abs=4.0 * sigma), metric


@pytest.mark.parametrize("source", list(HZZ20))
def test_horizontal_zigzag(source):
    case, where = load_case("hzz20")
    psi = load_reference(case, where)[source]["psi"]
    assert_close(zigzag(psi.abscissa, psi.value, None, np.radians(20.0), -1, "yaw"), HZZ20[source])


def test_peak_yaw_rates_of_the_experiment():
    """0.032281, -0.032896, 0.030241 rad/s, each to 4 standard errors."""
    case, where = load_case("hzz20")
    series = load_reference(case, where)["EXP"]
    psi, r = series["psi"], series["r"]
    found = zigzag(psi.abscissa, psi.value, (r.abscissa, r.value), np.radians(20.0), -1, "yaw")
    for k, (rate, sigma) in enumerate(((0.032281, 1.1e-4), (0.032896, 1.6e-4), (0.030241, 1.1e-4)), start=1):
        assert np.radians(found[f"peak_yaw_rate_{k}_degps"]) == pytest.approx(rate, abs=4.0 * sigma)


@pytest.mark.parametrize("source", list(VZZ10_10KT))
def test_vertical_zigzag(source):
    case, where = load_case("vzz10-10kt")
    theta = load_reference(case, where)[source]["theta"]
    assert (theta.shown.unit, theta.unit) == ("deg", "rad")
    assert_close(zigzag(theta.abscissa, theta.value, None, np.radians(10.0), 1, "pitch"), VZZ10_10KT[source])


@pytest.mark.parametrize(("source", "period", "sigma"), [("EXP", 12.684, 0.02), ("HDM", 13.036, 0.011)])
def test_roll_period(source, period, sigma):
    case, where = load_case("roll-decay")
    phi = load_reference(case, where)[source]["phi"]
    assert roll_decay(phi.abscissa, phi.value)["roll_period_s"] == pytest.approx(period, abs=4.0 * sigma)


def test_roll_decay_of_a_damped_cosine():
    """Closed form: period 2 pi / omega, logarithmic decrement 2 pi zeta / sqrt(1 - zeta^2)."""
    zeta, omega = 0.02, 0.5
    damped = omega * np.sqrt(1.0 - zeta**2)
    t = np.arange(0.0, 150.0, 0.05)
    found = roll_decay(t, 0.1 * np.exp(-zeta * omega * t) * np.cos(damped * t))
    assert found["roll_period_s"] == pytest.approx(2.0 * np.pi / damped, rel=2e-3)
    assert found["log_decrement"] == pytest.approx(2.0 * np.pi * zeta / np.sqrt(1.0 - zeta**2), rel=2e-2)


def test_every_bundled_case_flies_and_is_compared(fitted_db):
    """The scoreboard: a finite error for every channel, ratios over the published model."""
    flown = ident.scoreboard(fitted_db)
    board = flown.to_dict()
    assert [c["case"] for c in board["cases"]] == [one.case.name for one in flown.flown]
    assert {"hzz20", "vzz10-06kt", "vzz10-10kt", "roll-decay"} <= {c["case"] for c in board["cases"]}
    for case in board["cases"]:
        for channels in case["references"].values():
            assert all(np.isfinite(e["rmse"]) and e["n"] > 0 for e in channels.values())
    assert board["geometric_mean_ratio"]["trained"] is None
    ratios = [e["ratio"] for c in board["cases"] for r in c["references"].values() for e in r.values() if e["ratio"]]
    assert board["geometric_mean_ratio"]["untrained"] == pytest.approx(np.exp(np.mean(np.log(ratios))))
