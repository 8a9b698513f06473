"""Authority: the ten traps known in published captive data, on the data that contain them.

Each trap is a fault somebody has published or a facility has delivered; what the check says
must name it.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hmri import DATASETS, HMRI, KVLCC2, PMM, STATIC, sheet

from ident.captive.run_table import run_table
from ident.checks.check import findings_of, read_labels
from ident.checks.findings import Evidence
from ident.checks.histories import time_stamps


def found(evidence: Evidence, check: str) -> list:
    return [f for f in findings_of(evidence) if f.check == check]


def derivative_table(name: str, value: str = "value") -> pd.DataFrame:
    table = pd.read_csv(DATASETS / name).rename(columns={value: "value"})
    return table.assign(file=name, row=table.index + 2)


def test_1_the_same_run_under_two_drift_angles():
    runs = sheet("yaw_with_drift_test.csv", "yaw_with_drift", PMM)
    (only,) = found(Evidence(runs=runs, body=KVLCC2), "duplicates")
    assert only.severity == "error"
    assert only.rows == (16, 20)  # run 279, beta 12 and 16
    assert "279" in only.what
    assert "12" in only.what
    assert "16" in only.what


@pytest.mark.parametrize(
    ("name", "load", "own"),
    [("pure_sway_test.csv", {"Y": "Y_in'"}, "mass"), ("pure_yaw_test.csv", {"N": "N_in'"}, "inertia")],
)
def test_2_the_models_inertia_in_pmm_loads(name, load, own):
    (only,) = found(Evidence(runs=sheet(name, name[:8], load), body=KVLCC2), "inertia_left_in")
    assert own in only.what
    left = float(re.search(r"subtracted ([\d.]+) is left", only.what)[1])
    assert 0.6 < left < 1.0  # strip theory; 0.76 m by Yasukawa and Yoshimura in sway


def test_2_is_silent_once_the_inertia_is_subtracted():
    runs = sheet("pure_sway_test.csv", "pure_sway", {"Y": "Y_in'"})
    runs["Y"] += KVLCC2.mass * runs["vdot"]
    assert not found(Evidence(runs=runs, body=KVLCC2), "inertia_left_in")
    assert not found(Evidence(runs=runs, body=KVLCC2), "inertia_sign")


@pytest.mark.parametrize("which", ["Model", "Real"])
def test_3_open_water_columns_times_ten_and_a_hundred(which):
    table = pd.read_csv(HMRI / "propeller_open_water_test.csv")
    curve = {"J": table["J"], "KT": table[f"K_T ({which})"], "KQ": table[f"K_Q ({which})"], "file": "ow"}
    (only,) = found(Evidence(runs=run_table(curve)), "open_water")
    assert "KT x 10 and KQ x 100" in only.what
    mended = curve | {"KT": curve["KT"] / 10.0, "KQ": curve["KQ"] / 100.0}
    assert not found(Evidence(runs=run_table(mended)), "open_water")
    (ten,) = found(Evidence(runs=run_table(mended | {"KQ": curve["KQ"] / 10.0})), "open_water")
    assert "columns are KQ x 10" in ten.what


def test_4_length_squared_and_length_times_draught():
    runs = sheet("static_drift_test.csv", "drift_horizontal", STATIC)
    small = runs[runs["beta"].abs() < np.deg2rad(7.0)]
    pressure = 0.5 * KVLCC2.density * KVLCC2.length**2 * small["U"] ** 2
    slopes = {
        "Y_v": np.polyfit(small["beta"], small["Y"] / pressure, 1)[0],
        "N_v": np.polyfit(small["beta"], small["N"] / pressure / KVLCC2.length, 1)[0],
    }
    own = pd.DataFrame({"coefficient": slopes.keys(), "value": slopes.values()})
    theirs = derivative_table("kvlcc2_mmg_yasukawa2015.csv").rename(columns={"parameter": "coefficient"})
    claim = Evidence(derivatives=theirs, reference=own, body=KVLCC2)
    (only,) = found(claim, "norm")
    assert set(only.columns) == {"Y_v", "N_v"} or set(only.columns) == {"Yv", "Nv"}
    assert "L/d = 15.3" in only.what
    step = KVLCC2.length / KVLCC2.draught
    mended = theirs.assign(value=theirs["value"] / step)
    assert not found(replace(claim, derivatives=mended), "norm")


def test_4_an_added_mass_fifteen_times_the_displaced_mass():
    table = pd.DataFrame({"coefficient": ["Y_vdot"], "value": [-0.223]})  # Yasukawa and Yoshimura 2015
    (only,) = found(Evidence(derivatives=table, body=KVLCC2), "norm")
    assert "1/2 rho L d" in only.what


def test_5_drift_described_as_rudder():
    labels = read_labels(HMRI)
    (only,) = found(Evidence(labels=labels), "angle_name")
    assert only.columns == ("beta",)
    assert only.rows == (4,)
    assert "Rudder Angle" in only.what
    assert "Static Drift Test" in only.what


def test_5_a_rudder_sheet_read_as_drift():
    runs = sheet("static_rudder_test.csv", "drift_horizontal", STATIC)
    swapped = runs.assign(beta=runs["plane"], plane=np.nan)
    swapped = swapped[swapped["U"] > 1.0].reset_index(drop=True)
    (only,) = found(Evidence(runs=swapped, body=KVLCC2), "angle_name")
    assert "stern plane" in only.what
    drift = sheet("static_drift_test.csv", "drift_horizontal", STATIC)
    assert not found(Evidence(runs=drift, body=KVLCC2), "angle_name")


def test_6_time_stamps_printed_with_three_digits():
    exact = np.arange(990.0, 1030.0, 0.5)
    printed = np.array([float(f"{t:.3g}") for t in exact])
    (only,) = found(Evidence(times={"tank.txt": printed}), "time")
    assert "3 significant digits" in only.what
    assert only.file == "tank.txt"
    assert not list(time_stamps(exact, "tank.txt"))


def test_6_a_restart_that_steps_back_and_a_stamp_that_is_no_number():
    steps = np.array([0.0, 1.0, 2.0, 1.5, 2.5, np.nan, 3.5])
    texts = {f.what for f in time_stamps(steps, "force.dat")}
    assert any("steps back 1 times" in t for t in texts)
    assert any("not finite" in t for t in texts)


def test_7_a_block_that_stands_twice():
    runs = sheet("captive_static_merged_original.csv", "", STATIC)
    blocks = found(Evidence(runs=runs, body=KVLCC2), "repeated_blocks")
    into = [f for f in blocks if "under drift + rudder angle" in f.what]
    # 18 drift runs; the one without drift stands a third time, in the rudder block.
    assert sum(len(f.rows) for f in into) + 1 == 18
    separate = [
        sheet(n, "drift_horizontal", STATIC) for n in ("static_drift_test.csv", "static_drift_and_rudder_test.csv")
    ]
    both = pd.concat(separate, ignore_index=True)
    (across,) = found(Evidence(runs=both, body=KVLCC2), "repeated_blocks")
    assert across.file == "static_drift_and_rudder_test.csv"
    assert "static_drift_test.csv" in across.what


def test_7_ship_data_of_another_scale():
    text = (HMRI / "ship_data_L7.yml").read_text()
    particulars = {k: float(re.search(rf"^{k}: ([\d.]+)", text, re.M)[1]) for k in ("L", "m", "rho", "T")}
    other = replace(KVLCC2, length=particulars["L"], mass=particulars["m"], file="ship_data_L7.yml")
    (only,) = found(Evidence(body=other, tested_length=KVLCC2.length), "scale")
    assert only.severity == "error"
    assert only.file == "ship_data_L7.yml"
    assert not found(Evidence(body=KVLCC2, tested_length=KVLCC2.length), "scale")


def test_8_a_body_of_revolution_with_two_cross_flow_drags():
    pairs = found(Evidence(derivatives=derivative_table("remus_prestero2001_appC.csv", "value_appC")), "revolution")
    assert {f.columns for f in pairs} == {("Yvv", "Zww"), ("Nrr", "Mqq")}
    text = " ".join(f.what for f in pairs)
    assert "ratio of 10" in text
    assert "ratio of 0.5" in text


def test_8_is_silent_on_a_table_that_is_consistent():
    assert not found(Evidence(derivatives=derivative_table("lauv_dasilva2007_gym_dockauv.csv")), "revolution")
    # NPS AUV is no body of revolution: its added masses say so.
    assert not found(Evidence(derivatives=derivative_table("npsauv_healey1993.csv")), "revolution")


def test_9_added_inertia_of_the_wrong_sign():
    wrong = found(Evidence(derivatives=derivative_table("lauv_dasilva2007_gym_dockauv.csv")), "inertia_sign")
    assert {f.columns for f in wrong} == {("M_qdot",), ("N_rdot",)}
    for name, column in (("remus_prestero2001_appC.csv", "value_appC"), ("npsauv_healey1993.csv", "value")):
        assert not found(Evidence(derivatives=derivative_table(name, column)), "inertia_sign")


def test_10_configurations_known_by_numbers():
    table = pd.read_csv(DATASETS / "suboff_roddy1990_table4.csv").rename(columns={"roddy_config": "configuration"})
    table = table.assign(file="table4", row=table.index + 2)
    said = " ".join(f.what for f in found(Evidence(configurations=table), "configuration"))
    assert "known by number only" in said
    assert "stands under 2 configuration names: 1; 2" in said  # vertical and horizontal tests of one boat
