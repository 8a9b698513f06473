"""Stated errors of trial metrics hold: 95 % intervals cover the exact flight in 90 to 99 of 100 noisy records.

``python tests/test_coverage_of_trial_errors.py 60`` makes the whole table of noise and sampling rates; the suite a
sample of it.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from trial_records import truth, turn, write, zigzag

from ident.trials.spec import TrialFile
from ident.trials.trial import measure_trial


def sampled(one, rate_hz):
    """The exact flight at another rate; its own samples are exact to their last digit."""
    t = np.arange(0.0, one["t"][-1] + 1e-9, 1.0 / rate_hz)
    return {"t": t} | {k: make_interp_spline(one["t"], v, 5)(t) for k, v in one.items() if k not in ("t", "dH")}


def zigzag_record(rate_hz, heading_deg, rng):
    one = sampled(zigzag(), rate_hz)
    return {"t [s]": one["t"], "psi [deg]": one["psi"] + rng.normal(0.0, heading_deg, one["t"].size)}


def turn_record(rate_hz, position_m, rng):
    one = sampled(turn(), rate_hz)
    n = one["t"].size
    record = {"t [s]": one["t"], "x_north [m]": one["x"] + rng.normal(0.0, position_m, n)}
    record |= {"y_east [m]": one["y"] + rng.normal(0.0, position_m, n)}
    return record | {"psi [deg]": one["psi"] + rng.normal(0.0, 0.1, n)}


def errors(kind, rate_hz, noise, records, folder, draws=60):
    """(records, metrics) errors in standard errors."""
    make, known = (zigzag_record, truth()["zigzag"]) if kind == "zigzag" else (turn_record, truth()["turn"])
    spec = TrialFile(maneuver="zigzag 20/20" if kind == "zigzag" else "turning_circle")
    found = []
    for seed in range(records):
        path = write(folder / "record.csv", make(rate_hz, noise, np.random.default_rng(1000 + seed)), 6)
        metrics = measure_trial(path, spec, draws).metrics
        found.append([(metrics[k].value - v) / metrics[k].sigma for k, v in known.items()])
    return np.array(found)


@pytest.mark.parametrize(
    ("kind", "rate_hz", "noise", "records"),
    [("zigzag", 2, 0.1, 30), ("zigzag", 10, 0.5, 20), ("turn", 2, 1.0, 12)],
)
def test_intervals_cover_the_exact_flight(tmp_path, kind, rate_hz, noise, records):
    away = errors(kind, rate_hz, noise, records, tmp_path)
    inside = np.abs(away) < 1.96
    # Metrics of one record share their errors: a share of all counts as that of so many records.
    allowance = 2.0 * np.sqrt(0.95 * 0.05 / records)
    assert 0.90 - allowance <= inside.mean() <= 1.0
    assert np.sqrt(np.mean(away**2)) == pytest.approx(1.0, abs=0.35)
    assert np.abs(away).max() < 4.5


def main(records: int) -> None:
    """The whole table, printed."""
    with tempfile.TemporaryDirectory() as folder:
        for kind, noises in (("zigzag", (0.0, 0.05, 0.1, 0.2, 0.5)), ("turn", (0.0, 0.5, 1.0, 2.0))):
            for rate_hz in (1, 2, 10, 50):
                for noise in noises:
                    away = errors(kind, rate_hz, noise, records if noise else 2, Path(folder))
                    inside = 100.0 * np.mean(np.abs(away) < 1.96)
                    row = f"| {kind} | {rate_hz} | {noise:g} | {away.size} | {inside:.1f} | {np.abs(away).max():.1f} |"
                    print(row, flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))
