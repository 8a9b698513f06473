"""Stated errors of trial metrics hold: 95 % intervals cover the exact flight in 90 to 99 of 100 noisy records.

``python tests/test_coverage_of_trial_errors.py 60`` makes the whole table of noise and sampling rates (docs/trials.md),
``... 60 turn`` that of turns; the suite a sample of it. Metrics of one record share the error of its initial heading:
their number says little of how well a share is known, that of the records does.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.signal import lfilter
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


def filtered_record(rate_hz, heading_deg, rng, seconds=1.0):
    """Heading noise behind a filter of the first order, as a gyro's output is damped."""
    one = sampled(zigzag(), rate_hz)
    a = np.exp(-1.0 / (rate_hz * seconds))
    white = rng.standard_normal(one["t"].size + 1000)
    noise = lfilter([heading_deg * np.sqrt(1.0 - a * a)], [1.0, -a], white)[1000:]
    return {"t [s]": one["t"], "psi [deg]": one["psi"] + noise}


def turn_record(rate_hz, position_m, rng):
    one = sampled(turn(), rate_hz)
    n = one["t"].size
    record = {"t [s]": one["t"], "x_north [m]": one["x"] + rng.normal(0.0, position_m, n)}
    record |= {"y_east [m]": one["y"] + rng.normal(0.0, position_m, n)}
    return record | {"psi [deg]": one["psi"] + rng.normal(0.0, 0.1, n)}


def errors(kind, rate_hz, noise, records, folder, draws=60):
    """(records, metrics) errors in standard errors."""
    make = {"zigzag": zigzag_record, "turn": turn_record, "filtered": filtered_record}[kind]
    known = truth()["turn" if kind == "turn" else "zigzag"]
    spec = TrialFile(maneuver="turning_circle" if kind == "turn" else "zigzag 20/20")
    found = []
    for seed in range(records):
        # Fresh noise in every cell: one that is the same but for its size would make all cells high or low together.
        rng = np.random.default_rng([seed, rate_hz, round(1000.0 * noise)])
        path = write(folder / "record.csv", make(rate_hz, noise, rng), 6)
        metrics = measure_trial(path, spec, draws).metrics
        found.append([(metrics[k].value - v) / metrics[k].sigma for k, v in known.items()])
    return np.array(found)


@pytest.mark.parametrize(
    ("kind", "rate_hz", "noise", "records"),
    [("zigzag", 2, 0.1, 30), ("zigzag", 10, 0.5, 20), ("turn", 2, 1.0, 12), ("filtered", 2, 0.1, 20)],
)
def test_intervals_cover_the_exact_flight(tmp_path, kind, rate_hz, noise, records):
    away = errors(kind, rate_hz, noise, records, tmp_path)
    inside = np.abs(away) < 1.96
    # Metrics of one record share their errors: a share of all counts as that of so many records.
    allowance = 2.0 * np.sqrt(0.95 * 0.05 / records)
    assert 0.90 - allowance <= inside.mean() <= 1.0
    assert np.sqrt(np.mean(away**2)) == pytest.approx(1.0, abs=0.35)
    assert np.abs(away).max() < 4.5


NOISES = {"zigzag": (0.0, 0.05, 0.1, 0.2, 0.5), "turn": (0.0, 0.5, 1.0, 2.0), "filtered": (0.1, 0.3)}
RATES_HZ = (1, 2, 10, 50)


def main(records: int, kinds: list[str]) -> None:
    """The whole table, printed: shares of all metrics, and of the metric with the smallest and the largest one."""
    print("| record | Hz | noise | records | all, % | least, % | most, % | rms error / stated | largest |")
    with tempfile.TemporaryDirectory() as folder:
        for kind in kinds or list(NOISES):
            for rate_hz in RATES_HZ:
                for noise in NOISES[kind]:
                    # A zigzag without noise is one record; a turn without it still has that of its heading.
                    count = 1 if kind == "zigzag" and not noise else records
                    away = errors(kind, rate_hz, noise, count, Path(folder))
                    each = 100.0 * np.mean(np.abs(away) < 1.96, axis=0)
                    shares = f"{each.mean():.0f} | {each.min():.0f} | {each.max():.0f}"
                    sizes = f"{np.sqrt(np.mean(away**2)):.2f} | {np.abs(away).max():.1f}"
                    print(f"| {kind} | {rate_hz} | {noise:g} | {count} | {shares} | {sizes} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
