"""Channels exchanged, units off by 57.3 or 1.94, gaps, spikes: a finding with file, row and remedy, or a refusal."""

from __future__ import annotations

import csv
from importlib.resources import files

import numpy as np
import pytest
from click.testing import CliRunner
from trial_records import truth, turn, write, zigzag

from ident.captive.quantities import factor
from ident.captive.unit_slips import factor_between, unit_slips
from ident.cli import main
from ident.trials.body import velocities
from ident.trials.spec import TrialFile, load_spec
from ident.trials.trial import measure_trial
from sim.files.errors import InputError

COUNT = 10


def zigzag_columns(**changes):
    one = zigzag()
    record = {"t [s]": one["t"], "psi [deg]": one["psi"], "r [deg/s]": one["r"], "u [m/s]": one["u"]}
    record |= {"x [m]": one["x"], "y [m]": one["y"], "delta [deg]": one["dH"]}
    return record | {k.replace("__", " "): v for k, v in changes.items()}


def turn_columns():
    one = turn()
    record = {"t [s]": one["t"], "x_north [m]": one["x"], "y_east [m]": one["y"], "psi [deg]": one["psi"]}
    return record | {"speed [m/s]": one["speed"]}


def refusal(tmp_path, record, spec=None):
    with pytest.raises(InputError) as caught:
        measure_trial(write(tmp_path / "one.csv", record), spec, COUNT)
    return caught.value


@pytest.mark.parametrize("roll", [False, True])
def test_yaw_rate_under_the_name_p_is_refused_by_name(tmp_path, roll):
    record = zigzag_columns()
    record["p [deg/s]"] = record.pop("r [deg/s]")
    if roll:
        record["r [deg/s]"] = 0.3 * np.sin(record["t [s]"] / 2.0)
    error = refusal(tmp_path, record)
    assert "one.csv, row" in error.where
    assert "p [deg/s]" in error.where
    assert "channels exchanged" in error.found
    assert '"p [deg/s]" = "r [UNIT]"' in error.allowed
    done = CliRunner().invoke(main, ["trial", str(tmp_path / "one.csv"), "--json", "-"])
    assert done.exit_code == 2
    if not roll:
        spec = TrialFile(channels={"p [deg/s]": "r [deg/s]"})
        assert measure_trial(tmp_path / "one.csv", spec, COUNT).findings == ()


def test_rate_in_radians_is_found_and_not_used(tmp_path):
    record = zigzag_columns()
    record["r [deg/s]"] = np.radians(record["r [deg/s]"])
    done = measure_trial(write(tmp_path / "one.csv", record), None, COUNT)
    (finding,) = done.findings
    assert (finding.check, finding.severity) == ("unit_slip", "error")
    assert "57.3" in finding.what or "0.01745" in finding.what
    assert finding.rows
    assert '[channels] "r [deg/s]"' in finding.remedy
    assert done.metrics["overshoot_1_deg"].value == pytest.approx(truth()["zigzag"]["overshoot_1_deg"], abs=0.01)


def test_heading_and_rate_alone_that_differ_by_57_are_refused(tmp_path):
    one = zigzag()
    record = {"t [s]": one["t"], "psi [deg]": one["psi"], "r [deg/s]": np.radians(one["r"])}
    assert "degrees and radians" in refusal(tmp_path, record).found


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (lambda: zigzag_columns() | {"psi [deg]": np.radians(zigzag()["psi"])}, "degrees and radians"),
        (lambda: {"t [s]": zigzag()["t"], "psi [rad]": zigzag()["psi"]}, "a zigzag that swings by"),
        (lambda: turn_columns() | {"psi [deg]": np.radians(turn()["psi"])}, "degrees and radians"),
        (lambda: turn_columns() | {"speed [m/s]": turn()["speed"] / 0.514444}, "knots and m/s"),
        (lambda: turn_columns() | {"x_north [m]": turn()["y"], "y_east [m]": turn()["x"]}, "track and heading differ"),
    ],
    ids=["heading in radians", "radians that are degrees", "turn in radians", "knots", "north and east exchanged"],
)
def test_slips_that_decide_a_number_are_refused(tmp_path, record, words):
    error = refusal(tmp_path, record())
    assert words in error.found
    assert "one.csv" in error.where


def test_speed_in_knots_beside_a_heading_is_a_finding(tmp_path):
    record = zigzag_columns()
    record["u [m/s]"] = record["u [m/s]"] / 0.514444
    done = measure_trial(write(tmp_path / "one.csv", record), None, COUNT)
    assert any("knots and m/s" in f.what and f.rows for f in done.findings)


def test_a_check_angle_never_reached_is_refused(tmp_path):
    one = zigzag()
    record = {"t [s]": one["t"], "psi [deg]": np.radians(one["psi"])}
    error = refusal(tmp_path, record, TrialFile(maneuver="zigzag 20/20"))
    assert "never comes to 20 deg" in error.found


def test_gap_and_spike_are_named_by_row_and_change_little(tmp_path):
    record = {k: v.copy() for k, v in zigzag_columns().items()}
    record["psi [deg]"][150] = -999.0
    kept = np.ones(record["t [s]"].size, dtype=bool)
    kept[205:225] = False
    done = measure_trial(write(tmp_path / "one.csv", {k: v[kept] for k, v in record.items()}), None, COUNT)
    assert {f.check: f.rows for f in done.findings} == {"clock_gaps": (207,), "spikes": (152,)}
    known = truth()["zigzag"]
    for name in ("overshoot_1_deg", "overshoot_2_deg", "execute_3_s"):
        assert abs(done.metrics[name].value - known[name]) < 3.0 * done.metrics[name].sigma


def test_missing_units_and_columns_are_named(tmp_path):
    one = zigzag()
    error = refusal(tmp_path, {"t [s]": one["t"], "psi": one["psi"]})
    assert "no unit for psi" in error.found
    assert '"psi [deg]"' in error.allowed
    error = refusal(tmp_path, {"t [s]": one["t"], "psi [deg]": one["psi"], "heading [deg]": one["psi"]})
    assert "both hold psi" in error.found
    error = refusal(tmp_path, {"t [s]": one["t"], "psi [deg]": one["psi"]}, TrialFile(channels={"gyro": "psi"}))
    assert "no column 'gyro'" in error.found


def test_clock_that_steps_back_is_refused(tmp_path):
    record = zigzag_columns()
    record["t [s]"] = record["t [s]"].copy()
    record["t [s]"][100:] -= 20.0
    assert "after" in refusal(tmp_path, record).found


def test_a_long_table_has_one_unit_a_channel_and_names_what_it_does_not_use(tmp_path):
    one = zigzag()
    rows = [f"{name},{t},{v},deg,good" for name in ("psi", "dH") for t, v in zip(one["t"], one[name], strict=True)]
    path = tmp_path / "long.csv"
    path.write_text("\n".join(["channel,t,value,unit,sourcex", *rows]), encoding="utf-8")
    assert "column not used: sourcex" in measure_trial(path, None, COUNT).assumed
    rows[7] = rows[7].replace(",deg,", ",rad,")
    path.write_text("\n".join(["channel,t,value,unit,sourcex", *rows]), encoding="utf-8")
    with pytest.raises(InputError, match=r"row 9, column unit: 'rad'.*one unit a channel"):
        measure_trial(path, None, COUNT)


@pytest.mark.parametrize("key", ["skip", "header_pattern"])
def test_an_expression_that_is_none_is_refused_with_its_key(tmp_path, key):
    (tmp_path / "trial.toml").write_text(f"{key} = '(?=a)'\n", encoding="utf-8")
    with pytest.raises(InputError, match=f"{key}.*no look-around"):
        load_spec(tmp_path / "trial.toml")


def test_a_header_of_thousands_of_characters_is_found_below_a_title(tmp_path):
    one = zigzag()
    names = ["t [s]", "psi [deg]", "delta [deg]", *[f"channel {'x' * 50} {k}" for k in range(60)]]
    rows = [",".join([f"{a},{b},{c}", *["0"] * 60]) for a, b, c in zip(one["t"], one["psi"], one["dH"], strict=True)]
    path = tmp_path / "wide.csv"
    path.write_text("\n".join(["Trial of a boat", ",".join(names), *rows]), encoding="utf-8")
    spec = TrialFile(delimiter=",")
    assert measure_trial(path, spec, COUNT).metrics["overshoot_1_deg"].value > 0.0


def test_slips_of_units_are_those_of_the_units_themselves():
    """By the library of units; and the numbers one knows: 57.3, 60, 1.94, 3.6, 3.28, 1.852, 3438, 9.81, 1000."""
    with (files("ident") / "data" / "unit_slips.csv").open(encoding="utf-8") as stream:
        listed = list(csv.DictReader(stream))
    assert [one["words"] for one in listed] == list(unit_slips())
    for one in listed:
        unit, instead = (factor(one["like"], one[name]) for name in ("unit", "instead"))
        assert abs(unit_slips()[one["words"]] * instead / unit - 1.0) < 1e-14, one
    known = (57.29578, 60.0, 1.943844, 3.6, 3.280840, 1.852, 3437.747, 9.80665, 1000.0)
    for value in known:
        for ratio in (value, 1.0 / value):
            one, words = factor_between(ratio)
            assert abs(one / ratio - 1.0) < 2e-6, words
    assert factor_between(1.3) is None


def every_channel(submerged=False):
    """The zigzag with all channels that a recorder has, heel of its own, noise of good instruments."""
    one = zigzag()
    t, psi = one["t"], np.radians(one["psi"])
    dx, dy = np.gradient(one["x"], t), np.gradient(one["y"], t)
    heel = np.interp(t - 4.0, t, one["r"]) ** 2 - 0.8 * np.interp(t - 2.0, t, one["r"])
    record = zigzag_columns() | {"v [m/s]": dy * np.cos(psi) - dx * np.sin(psi)}
    record |= {"phi [deg]": heel, "p [deg/s]": np.gradient(heel, t)}
    rng = np.random.default_rng(1)
    sizes = {"psi [deg]": 0.1, "r [deg/s]": 0.02, "x [m]": 0.3, "y [m]": 0.3, "phi [deg]": 0.02}
    sizes |= {"u [m/s]": 0.02, "v [m/s]": 0.02, "p [deg/s]": 0.01}
    if submerged:
        pitch = np.radians(1.5 * np.sin(2.0 * np.pi * t / 60.0))
        depth = 30.0 - 5.0 * np.cumsum(np.sin(pitch)) * (t[1] - t[0])
        angles = {"psi": psi, "phi": np.radians(heel), "theta": pitch}
        along = velocities(angles, {"north": dx, "east": dy, "z": np.gradient(depth, t)})
        record |= {f"{k} [m/s]": v for k, v in along.items()} | {"theta [deg]": np.degrees(pitch), "z [m]": depth}
        record |= {"plane [deg]": 3.0 * np.sin(2.0 * np.pi * (t + 20.0) / 60.0)}
        record["p [deg/s]"] = record["p [deg/s]"] - record["r [deg/s]"] * np.sin(pitch)
        sizes |= {"theta [deg]": 0.02, "z [m]": 0.02, "w [m/s]": 0.01, "plane [deg]": 0.02}
    return {k: v + sizes.get(k, 0.0) * rng.standard_normal(v.size) for k, v in record.items()}


NAMED = [("psi [deg]", other) for other in ("u [m/s]", "v [m/s]", "y [m]", "phi [deg]", "delta [deg]")]
NAMED += [("r [deg/s]", other) for other in ("u [m/s]", "p [deg/s]", "delta [deg]")]
NAMED += [("r [deg/s]", "phi [deg]"), ("r [deg/s]", "v [m/s]"), ("phi [deg]", "u [m/s]"), ("p [deg/s]", "delta [deg]")]
NAMED += [("u [m/s]", "v [m/s]"), ("phi [deg]", "p [deg/s]"), ("v [m/s]", "delta [deg]"), ("y [m]", "delta [deg]")]
NAMED += [("phi [deg]", "y [m]"), ("w [m/s]", "plane [deg]"), ("plane [deg]", "delta [deg]")]


@pytest.mark.parametrize("pair", NAMED, ids=["-".join(p).replace(" ", "") for p in NAMED])
def test_two_channels_exchanged_are_refused_by_name(tmp_path, pair):
    record = every_channel(submerged="plane [deg]" in pair)
    first, second = pair
    record[first], record[second] = record[second], record[first]
    error = refusal(tmp_path, record)
    assert "exchanged" in str(error)
    assert first in str(error) or second in str(error)


def test_a_sound_record_of_all_channels_is_measured_and_x_and_y_are_told_apart(tmp_path):
    record = every_channel()
    whole = measure_trial(write(tmp_path / "one.csv", record), None, COUNT)
    assert not [f for f in whole.findings if f.severity == "error"]
    assert_truth(whole)
    record["x [m]"], record["y [m]"] = record["y [m]"], record["x [m]"]
    turned = measure_trial(write(tmp_path / "two.csv", record), None, COUNT)
    assert_truth(turned)
    assert any("x east, y north" in text for text in turned.assumed)


def assert_truth(trial):
    for name, value in truth()["zigzag"].items():
        measured = trial.metrics[name]
        assert abs(measured.value - value) < 4.0 * measured.sigma, name


def test_a_heel_of_no_boat_is_a_finding_where_nothing_says_whose_it_is(tmp_path):
    record = zigzag_columns() | {"phi [deg]": zigzag()["y"]}
    for name in ("u [m/s]", "x [m]", "y [m]"):
        record.pop(name)
    done = measure_trial(write(tmp_path / "one.csv", record), None, COUNT)
    (finding,) = done.findings
    assert (finding.check, finding.columns) == ("impossible_heel", ("phi [deg]",))


def test_a_flight_as_ident_fly_writes_it_has_two_depths_and_one_is_used(tmp_path):
    record = zigzag_columns()
    record |= {"z [m]": np.full_like(record["t [s]"], 30.0), "D0 [m]": np.full_like(record["t [s]"], 25.0)}
    found = measure_trial(write(tmp_path / "one.csv", record), None, COUNT)
    assert found.recording.channels["z"].value[0] == 30.0
    assert any("D0 [m]: not used" in text for text in found.assumed)


def test_speeds_ahead_and_abeam_exchanged_are_told_without_a_track(tmp_path):
    one = zigzag()
    record = {"t [s]": one["t"], "psi [deg]": one["psi"], "delta [deg]": one["dH"]}
    record |= {"u [m/s]": 0.1 * one["r"], "v [m/s]": one["u"]}
    error = refusal(tmp_path, record)
    assert "going sideways" in error.found
    assert "channels exchanged, u [m/s] and v [m/s]" in error.found


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_heading_and_rudder_under_one_anothers_names_are_refused_by_name(tmp_path, noise):
    """Nothing but these two columns: a rudder does not go on turning after the heading has been put over."""
    one = zigzag()
    read = one["psi"] + noise * np.random.default_rng(1).standard_normal(one["psi"].size)
    error = refusal(tmp_path, {"t [s]": one["t"], "psi [deg]": one["dH"], "delta [deg]": read})
    assert "channels exchanged" in error.found
    assert "psi [deg]" in error.where
    assert "delta [deg]" in error.where
    right = measure_trial(
        write(tmp_path / "two.csv", {"t [s]": one["t"], "psi [deg]": read, "delta [deg]": one["dH"]}), None, COUNT
    )
    assert "overshoot_1_deg" in right.metrics
