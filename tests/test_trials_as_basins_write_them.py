"""Authority: the exact flights, written as MARIN and HSVA wrote the tanker trials of SIMMAN 2008.

No header, titles above, three digits in powers of ten (``1.00E+02``: stamps repeat from 100 s on), a last line of
tabs; a model not quite on its ordered course when the rudder is laid; a rudder sampled on its way over; a turning
circle that ends in a pull-out. The files themselves are public (Zenodo, Alexandersson 2022) and give the published
overshoots: docs/trials.md.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from trial_records import truth as known
from trial_records import turn, turned, write, zigzag

from ident.trials.spec import TrialFile
from ident.trials.trial import measure_trial
from sim.files.errors import InputError

COUNT, RATE = 30, 15.8


def often(one, step=0.13527):
    """The flight at a basin's rate, with a rudder that moves at its rate."""
    t = np.arange(0.0, one["t"][-1] - 1.0, step)
    dense = {"t": t} | {k: make_interp_spline(one["t"], v, 5)(t) for k, v in one.items() if k not in ("t", "dH")}
    if "dH" not in one:
        return dense
    reversals = [known()["zigzag"][f"execute_{k}_s"] for k in (2, 3, 4)]
    order = one["dH"][0] * (-1.0) ** np.searchsorted(reversals, t)
    angle = np.zeros_like(t)
    for i in range(1, t.size):
        angle[i] = angle[i - 1] + np.clip(order[i - 1] - angle[i - 1], -RATE * step, RATE * step)
    return dense | {"dH": angle}


def as_marin(path, columns):
    rows = ["\t".join(f"{v:.2E}" for v in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join(["A basin", "Zig-zag manoeuvring : 20 / 20", "", *rows, "\t\t"]), encoding="utf-8")
    return path


@pytest.mark.parametrize("aside", [0.0, 0.9])
def test_a_file_without_header_counts_from_the_course_by_which_the_rudder_is_reversed(tmp_path, aside):
    one = often(zigzag())
    # The model settles on the ordered course as it begins to turn.
    psi = one["psi"] + aside * np.exp(-one["t"] / 6.0)
    path = as_marin(tmp_path / "zz.dat", (one["t"], one["x"], one["y"], psi, one["r"], -one["dH"]))
    with pytest.raises(InputError, match="names"):
        measure_trial(path, None, COUNT)
    names = ["t [s]", "x [m]", "y [m]", "psi [deg]", "-", "delta [deg]"]
    done = measure_trial(path, TrialFile(names=names), COUNT)
    assert str(done.maneuver) == "zigzag 20/20"
    assert any("stamps repeat" in text for text in done.assumed)
    assert any("counted from" in text for text in done.assumed) == (aside > 0.0)
    for k in (1, 2, 3):
        # Three digits are a tenth of a degree here.
        assert done.metrics[f"overshoot_{k}_deg"].value == pytest.approx(
            known()["zigzag"][f"overshoot_{k}_deg"], abs=0.06
        )


def test_a_turning_circle_ends_where_its_pull_out_begins(tmp_path):
    one = turn()
    step, n = one["t"][1] - one["t"][0], 120
    rate = (one["psi"][-1] - one["psi"][-2]) / step
    after = step * np.arange(1, n + 1)
    psi = one["psi"][-1] + rate * 8.0 * (1.0 - np.exp(-after / 8.0))
    course = np.radians(psi - 5.0)
    x = one["x"][-1] + np.cumsum(one["speed"][-1] * step * np.cos(course))
    y = one["y"][-1] + np.cumsum(one["speed"][-1] * step * np.sin(course))
    north, east = turned(np.r_[one["x"], x], np.r_[one["y"], y], 40.0, (0.0, 0.0))
    record = {"t [s]": np.r_[one["t"], one["t"][-1] + after], "x_north [m]": north, "y_east [m]": east}
    record |= {"psi [deg]": np.r_[one["psi"], psi] + 40.0}
    record |= {"rudder [deg]": np.r_[np.full(one["t"].size, 30.0), np.zeros(n)]}
    done = measure_trial(write(tmp_path / "tc.csv", record), None, COUNT)
    assert done.maneuver.kind == "turning_circle"
    assert any("until rudder [deg] leaves its side" in text for text in done.assumed)
    for name, value in known()["turn"].items():
        assert abs(done.metrics[name].value - value) < 3.0 * done.metrics[name].sigma, name
    alone = measure_trial(write(tmp_path / "one.csv", {k: v[: one["t"].size] for k, v in record.items()}), None, COUNT)
    for name in ("steady_diameter_m", "speed_ratio_steady"):
        assert done.metrics[name].value == pytest.approx(alone.metrics[name].value, rel=0.02)


def test_a_plane_under_the_rudders_name_is_told_by_what_the_heading_answers_to(tmp_path):
    one = often(zigzag())
    slow = np.interp(one["t"] - 8.0, one["t"], np.convolve(one["dH"], np.ones(80) / 80.0)[: one["t"].size], left=0.0)
    record = {"t [s]": one["t"], "psi [deg]": one["psi"], "rudder [deg]": 0.2 * slow, "plane [deg]": one["dH"]}
    with pytest.raises(InputError, match=r"channels exchanged, rudder .* and plane"):
        measure_trial(write(tmp_path / "one.csv", record), None, COUNT)


def test_two_runs_side_by_side_and_keys_that_no_such_file_is_read_by(tmp_path):
    one = zigzag()
    rows = [f"{t},{a},{d},{t},{a},{d}" for t, a, d in zip(one["t"], one["psi"], one["dH"], strict=True)]
    path = tmp_path / "two.csv"
    path.write_text("\n".join([",".join(["t [s]", "psi [deg]", "rudder [deg]"] * 2), *rows]), encoding="utf-8")
    with pytest.raises(InputError, match="one record a file; or names"):
        measure_trial(path, None, COUNT)
    first = TrialFile(names=["t [s]", "psi [deg]", "rudder [deg]", "-", "-", "-"])
    found = measure_trial(path, first, COUNT).metrics["overshoot_1_deg"]
    assert found.value == pytest.approx(known()["zigzag"]["overshoot_1_deg"], abs=0.02)
    with pytest.raises(InputError, match="key table"):
        measure_trial(path, TrialFile(table="Run 1", maneuver="zigzag 20/20"), COUNT)


def test_a_record_of_a_rudder_alone_names_what_it_does_not_use(tmp_path):
    record = {"t [s]": np.arange(50.0), "rudder [deg]": np.full(50, 20.0), "torque [kN]": np.arange(50.0)}
    with pytest.raises(InputError, match=r"rudder \[deg\]; columns not used: torque \[kN\]"):
        measure_trial(write(tmp_path / "one.csv", record), None, COUNT)


def test_a_header_behind_a_comment_sign_below_titles_is_read(tmp_path):
    one = zigzag()
    rows = [f"{t:.3f}\t{a:.4f}\t{d:.1f}" for t, a, d in zip(one["t"], one["psi"], one["dH"], strict=True)]
    path = tmp_path / "one.txt"
    path.write_text("\n".join(["Basin, run 12", "", "# t / s\tpsi / deg\tdelta / deg", *rows]), encoding="utf-8")
    found = measure_trial(path, None, COUNT).metrics["overshoot_1_deg"]
    assert found.value == pytest.approx(known()["zigzag"]["overshoot_1_deg"], abs=0.02)
