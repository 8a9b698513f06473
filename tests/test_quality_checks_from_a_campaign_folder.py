"""Authority: faults made on purpose in campaign folders, read as a user's are.

Every check that time histories, the tables beside the runs, published values or a deflected
rudder feed has to find its fault, name file and row, and keep silent without it.
"""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from hmri import STATIC, sheet
from hypothesis import given
from hypothesis import strategies as st
from made_campaigns import CONSTANTS, STEADY, campaign, history
from made_ship import CONFIGURED, DENSITY, DERIVATIVES, LENGTH, MMG, ROOT, ship

from ident.captive.campaign import read_campaign
from ident.captive.run_table import run_table
from ident.checks.check import check_campaign
from ident.checks.findings import Body, Evidence, registered, rules
from ident.cli import main
from ident.timeseries.clock import Clock
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError

SUBOFF = ROOT / "raw_captive_data" / "suboff"


def found(folder: Path, *names: str) -> list:
    return [f for f in check_campaign(read_campaign(folder), folder) if f.check in names]


def checked(evidence: Evidence, name: str) -> list:
    return [f for function in registered()[name] for f in function(evidence, rules()[name])]


# -- time histories ----------------------------------------------------------------------


def record(folder: Path, time, reduction: str = STEADY, drift: float = 0.0) -> Path:
    """A steady history with independent noise, below a comment and a row of units."""
    campaign(folder, history("tank.csv", "units_row = true", reduction=reduction))
    noise = np.random.default_rng(5).standard_normal((len(time), 2))
    loads = [900.0, 4000.0] + noise + drift * np.linspace(0.0, 1.0, len(time))[:, None]
    rows = "".join(f"{t:g},{y:.9g},{n:.9g}\n" for t, (y, n) in zip(time, loads, strict=True))
    (folder / "tank.csv").write_text("# run 12\ntime,Y,N\ns,N,N m\n" + rows)
    return folder


CLOCK = np.arange(1000.0, 1200.0, 0.5)
PRINTED = np.array([float(f"{t:.4g}") for t in CLOCK])


def test_stamps_with_too_few_digits_that_a_rate_stands_in_for(tmp_path):
    (only,) = found(record(tmp_path, PRINTED, STEADY + "rate_hz = 2.0\n"), "time")
    assert only.severity == "info"
    assert only.file == "tank.csv"
    # 1000.5 is printed 1000, in row 5: a comment, the header and the units come first.
    assert only.rows[0] == 5
    assert len(only.rows) == np.sum(np.diff(PRINTED) == 0.0)
    assert "4 significant digits" in only.what
    assert "rate_hz" in only.what


def test_a_rate_that_does_not_fit_the_stamps(tmp_path):
    (only,) = found(record(tmp_path, CLOCK, STEADY + "rate_hz = 20.0\n"), "time")
    assert only.severity == "error"
    assert "19.95 s" in only.what
    assert "199.5 s" in only.what


def test_stamps_that_are_right_are_passed_over(tmp_path):
    assert not found(record(tmp_path / "a", CLOCK), "time", "convergence")
    assert not found(record(tmp_path / "b", CLOCK, STEADY + "rate_hz = 2.0\n"), "time")


REPEATS = int(np.sum(np.diff(PRINTED) == 0.0))
BACK = np.concatenate([CLOCK[:200], CLOCK[150:200], CLOCK[200:]])


def three_records(folder: Path, *times) -> Path:
    """A folder a record, so that two files share a name."""
    for k, time in enumerate(times):
        record(folder / f"run{k}", time)
    source = history("run*/tank.csv", "units_row = true\nmatch = '(?P<run_id>run[0-9])/'")
    return campaign(folder, source)


@pytest.mark.parametrize("command", ["fit", "runs", "plan"])
def test_every_history_whose_stamps_do_not_rise_is_refused_in_one_message(tmp_path, command):
    three_records(tmp_path / "c", PRINTED, CLOCK, BACK)
    more = {"fit": ["--db", str(tmp_path / "db")], "runs": ["--out", str(tmp_path / "db")], "plan": []}[command]
    done = CliRunner().invoke(main, [command, str(tmp_path / "c"), *more])
    said = " ".join(done.output.split())
    assert done.exit_code == 2
    assert f"{tmp_path}/c/run0/tank.csv, data row 2, column time" in said
    assert f"{REPEATS} of 400 stamps repeat or step back" in said
    assert "in 1 more: run2/tank.csv, data row 201: 1075 s after 1099.5 s" in said
    assert "run1" not in said
    assert "rate_hz" in said
    assert not (tmp_path / "db").exists()


def test_a_check_names_every_history_whose_stamps_do_not_rise_and_checks_the_rest(tmp_path):
    three_records(tmp_path, PRINTED, CLOCK, BACK)
    done = CliRunner().invoke(main, ["check", str(tmp_path), "--json", "-", "--strict"])
    assert done.exit_code == 1
    listed = [f for f in json.loads(done.output)[0]["findings"] if f["check"] == "time"]
    assert [(f["file"], f["severity"], f["columns"]) for f in listed] == [
        ("run0/tank.csv", "error", ["time"]),
        ("run2/tank.csv", "error", ["time"]),
    ]
    # Below a comment, the header and the units: sample 2 is in row 5, the step back in row 204.
    assert (listed[0]["rows"][0], len(listed[0]["rows"])) == (5, REPEATS)
    assert listed[1]["rows"] == [204]
    assert "time steps back 1 times, first from 1099.5 s to 1075 s" in listed[1]["what"]
    # Too few digits make stamps that repeat, none that step back.
    assert ["rate_hz" in f["what"] for f in listed] == [True, False]


def test_a_check_of_nothing_but_stamps_that_do_not_rise_names_them_too(tmp_path):
    done = CliRunner().invoke(main, ["check", str(record(tmp_path, PRINTED))])
    assert done.exit_code == 0, done.output
    assert "0 runs" in done.output
    assert "1 error" in done.output


@given(
    st.lists(st.one_of(st.integers(0, 6).map(float), st.just(float("nan"))), min_size=1, max_size=40),
    st.lists(st.integers(1, 39), max_size=5),
)
def test_a_clock_fed_in_pieces_is_that_of_the_whole(stamps, cuts):
    whole, pieces = Clock(), Clock()
    whole.feed(np.array(stamps))
    for piece in np.split(np.array(stamps), sorted(set(cuts))):
        pieces.feed(piece)
    for name in ("samples", "repeat", "back", "bad", "repeats", "backs", "bads", "longest"):
        assert getattr(pieces, name) == getattr(whole, name), name
    finite = [t for t in stamps if np.isfinite(t)]
    assert whole.repeats == sum(b == a for a, b in itertools.pairwise(finite))
    assert whole.backs == sum(b < a for a, b in itertools.pairwise(finite))


def test_a_history_that_has_not_settled_is_a_finding(tmp_path):
    (only,) = found(record(tmp_path, CLOCK, drift=20.0), "convergence")
    assert (only.severity, only.file) == ("warning", "tank.csv")
    assert set(only.columns) <= {"Y", "N"}
    assert "run tank, " in only.what
    assert "start_s" in only.remedy
    done = CliRunner().invoke(main, ["check", str(tmp_path), "--json", "-"])
    listed = json.loads(done.output)[0]["findings"]
    assert [f["file"] for f in listed if f["check"] == "convergence"] == ["tank.csv"]


def test_a_history_the_campaign_trusts_less_is_information(tmp_path):
    record(tmp_path, CLOCK, drift=20.0)
    text = (tmp_path / "campaign.toml").read_text()
    text = text.replace('quality = "ok"', 'quality = "poor"').replace(
        "[quality]\n", '[quality]\npoor = { factor = 3.0, meaning = "short run" }\n'
    )
    (tmp_path / "campaign.toml").write_text(text)
    assert [f.severity for f in found(tmp_path, "convergence")] == ["info"]


# -- tables beside the runs --------------------------------------------------------------


def test_loads_in_the_other_norm_than_the_campaign_says(tmp_path):
    step = LENGTH / 0.448
    assert not found(ship(tmp_path / "right"), "norm")
    (only,) = found(ship(tmp_path / "wrong", step), "norm")
    assert only.severity == "error"
    assert only.columns == ("Y_vdot",)
    assert "1/2 rho L d" in only.what


def test_loads_against_derivatives_printed_elsewhere(tmp_path):
    printed = "coefficient,value\n" + "".join(f"{k},{1.1 * v:g}\n" for k, v in DERIVATIVES.items() if k != "Y_vdot")
    named = 'reference = "printed.csv"'
    assert not found(ship(tmp_path / "right", 1.0, named, printed), "norm")
    wrong = found(ship(tmp_path / "wrong", 0.448 / LENGTH, named, printed), "norm")
    assert any({"Yv", "Nv"} == set(f.columns) and "L/d = 15.39" in f.what for f in wrong), wrong


def test_a_drift_series_without_side_force_is_no_rudder(tmp_path):
    """Found on damaged files: with two columns exchanged the slope of Y over beta is zero."""
    folder = ship(tmp_path / "c")
    table = pd.read_csv(folder / "runs.csv").assign(**{"Y [-]": 0.0})
    table.to_csv(folder / "runs.csv", index=False)
    assert not found(folder, "angle_name")


def test_a_printed_value_out_of_all_range_is_no_other_norm(tmp_path):
    printed = "coefficient,value\nY_v,1e-310\nN_v,-1e15\n"
    assert not found(ship(tmp_path / "c", 1.0, 'reference = "printed.csv"', printed), "norm")
    tiny = pd.DataFrame({"coefficient": ["Y_v"], "value": [1e-320]})
    other = pd.DataFrame({"coefficient": ["Y_v"], "value": [1e10]})
    body = Body(LENGTH, DENSITY, 3123.0, None, 0.448)
    assert not checked(Evidence(derivatives=tiny, reference=other, body=body), "norm")


@pytest.mark.parametrize("declared", [True, False])
def test_configurations_that_the_campaign_names(tmp_path, declared):
    """Named beside declared sources or beside CSV files found by themselves, it is no file of runs."""
    source = '[[source]]\nfiles = "runs.csv"\n' + CONSTANTS + "rel_sigma = 0.05\n" if declared else ""
    campaign(tmp_path, source, tables='configurations = "named.csv"')
    runs = "Y_N,X_N\n900,-50\n"
    if not declared:
        runs = "run_id,test,part,quality,source,U_mps,alpha_deg,beta_deg,D0_m,Y_N,rel_sigma\n"
        runs += "a,drift_horizontal,hull,ok,made,2,0,5,25,900,0.05\n"
    (tmp_path / "runs.csv").write_text(runs)
    (tmp_path / "named.csv").write_text(CONFIGURED)
    campaign_ = read_campaign(tmp_path)
    assert set(campaign_.runs["file"]) == {"runs.csv"}
    said = {f.severity: f for f in check_campaign(campaign_, tmp_path) if f.check == "configuration"}
    assert said["info"].rows == (2,)
    assert "known by number only" in said["info"].what
    assert said["warning"].rows == (2, 4)
    assert "hull+sail stands under 2 configuration names" in said["warning"].what


@pytest.mark.parametrize(
    ("tables", "text", "words"),
    [
        ('reference = "other.csv"', "coefficient,value\nY_v,1\n", "key tables.reference"),
        ('reference = "../printed.csv"', "coefficient,value\nY_v,1\n", "a file in the campaign folder"),
        ('reference = "printed.csv"', "name,value\nY_v,1\n", "no column 'coefficient'"),
        ('reference = "printed.csv"', "coefficient,value\nY_v,small\n", "row 2, column value"),
        ('referenz = "printed.csv"', "coefficient,value\nY_v,1\n", "tables.referenz"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused_with_its_place(tmp_path, tables, text, words):
    ship(tmp_path / "c", 1.0, tables, text)
    with pytest.raises(InputError) as caught:
        found(tmp_path / "c", "norm")
    assert words in str(caught.value)


# -- published values --------------------------------------------------------------------


@pytest.fixture(scope="module")
def suboff():
    return check_campaign(read_campaign(SUBOFF), SUBOFF)


def test_published_coefficients_are_not_missing(suboff):
    missing = {n.strip(",") for f in suboff if f.check == "missing" for n in f.what.split()}
    for name in pd.read_csv(SUBOFF / "published.csv")["coefficient"]:
        assert name not in missing, name
    assert {"X_vv", "K_v", "K_pdot", "Y_wr"} <= missing
    assert "Y_v|v|" not in missing  # estimated there


def test_added_mass_turned_from_the_other_plane_does_not_make_a_body_round(suboff):
    """Y_vdot of SUBOFF is Z_wdot, with 20 % error: no evidence that Y_v has to be Z_w."""
    assert not [f for f in suboff if f.check == "revolution"]


# -- deflected rudders -------------------------------------------------------------------


def rudder_runs(part: str) -> pd.DataFrame:
    angles = np.radians([-20.0, -10.0, 0.0, 10.0, 20.0])
    columns = {"run_id": [f"R{k}" for k in range(5)], "plane": angles, "U": 3.0, "beta": 0.0, "alpha": 0.0, "n": 5.0}
    loads = {"Y": 900.0 * angles + 4.0, "N": -1800.0 * angles, "X": -50.0, "Z": 0.0, "M": 100.0, "D0": 10.0}
    return run_table(columns | loads | {"part": part, "file": "rudder.csv", "test": "plane_deflection"})


BODY = Body(4.2609, 1000.0, 700.0)


@pytest.mark.parametrize("part", ["rudders", "hull"])
def test_a_side_force_of_a_deflected_rudder_is_no_fault(part):
    evidence = Evidence(runs=rudder_runs(part), body=BODY, vehicle=load_vehicle("suboff"))
    assert not checked(evidence, "symmetry")


def test_an_elevator_that_pushes_sideways_is_a_fault():
    evidence = Evidence(runs=rudder_runs("stern_planes"), body=BODY, vehicle=load_vehicle("suboff"))
    said = checked(evidence, "symmetry")
    assert {f.columns for f in said} == {("Y",), ("N",)}


def test_a_side_force_at_zero_rudder_is_still_a_fault():
    runs = rudder_runs("rudders")
    runs.loc[2, "Y"] = 200.0
    (only,) = checked(Evidence(runs=runs, body=BODY, vehicle=load_vehicle("suboff")), "symmetry")
    assert only.rows == (4,)


@pytest.mark.parametrize("name", ["static_rudder_test.csv", "static_drift_and_rudder_test.csv"])
def test_rudder_sheets_of_a_ship_without_planes(name):
    """HMRI: rudder beside the hull in one column, whatever sense it has."""
    runs = sheet(name, "drift_horizontal", STATIC)
    vehicle = load_vehicle(str(MMG))
    length = vehicle.particulars.length.value
    evidence = Evidence(runs=runs, body=Body(length, 1000.0, 3123.0), vehicle=vehicle)
    turned = runs.loc[runs["plane"].fillna(0.0) != 0.0, "row"]
    assert len(turned) > 10
    for f in checked(evidence, "symmetry"):
        assert not set(f.rows) & set(turned), f
