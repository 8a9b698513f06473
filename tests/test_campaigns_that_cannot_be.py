"""Authority: what a boat in water can do. States, errors and loads that none has are found, and stop a strict fit."""

from __future__ import annotations

import shutil

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from made_campaigns import campaign
from made_ship import ROOT, ship
from small_campaign import RUNS, write

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from ident.cli import main


def findings(folder, *names):
    found = check_campaign(read_campaign(folder), folder)
    return [f for f in found if not names or f.check in names]


@pytest.fixture
def folder(tmp_path):
    return write(tmp_path / "campaign", runs=RUNS)


def test_a_campaign_that_can_be_has_none_of_these(folder):
    assert not findings(folder, "state", "errors", "zero", "unread")


@pytest.mark.parametrize(
    ("old", "new", "check", "column", "severity"),
    [
        ("5.0,0,4,25", "5.0,270,4,25", "state", "alpha", "error"),
        ("5.0,0,4,25", "5.0,0,400,25", "state", "beta", "error"),
        (",25,", ",-25,", "state", "D0", "error"),
        (",25,", ",-5,", "state", "D0", "warning"),
        (",25,", ",25000,", "state", "D0", "error"),
        ("5.0,0,4", "3000,0,4", "state", "U", "error"),
        ("0.05,as", "40,as", "errors", "rel_sigma", "error"),
        ("0.05,as", "5,as", "errors", "rel_sigma", "error"),
        ("0.05,as", "0,as", "errors", "X", "error"),
        ("-336000", "0", None, None, None),
    ],
)
def test_a_number_of_no_boat_is_named_with_its_rows(folder, old, new, check, column, severity):
    drift = folder / "drift.csv"
    assert old in drift.read_text()
    drift.write_text(drift.read_text().replace(old, new))
    found = findings(folder, "state", "errors", "zero")
    if check is None:
        assert not found
        return
    assert [(f.check, f.severity) for f in found] == [(check, severity)]
    assert column in found[0].columns
    assert found[0].rows


def test_the_thrust_deducted_in_a_sound_campaign_is_no_finding():
    assert not findings(ROOT / "raw_captive_data" / "bb2", "state")


@pytest.mark.parametrize("t", ["10", "-1.8", "1.18"])
def test_more_than_the_thrust_is_not_deducted(tmp_path, t):
    folder = tmp_path / "bb2"
    shutil.copytree(ROOT / "raw_captive_data" / "bb2", folder)
    path = folder / "self_propulsion.csv"
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    table.loc[table.index[0], "t"] = t
    table.to_csv(path, index=False)
    (only,) = findings(folder, "state")
    assert (only.severity, only.columns, len(only.rows)) == ("error", ("t",), 1)


def test_a_campaign_of_zeros_is_refused(tmp_path):
    folder = tmp_path / "bb2"
    shutil.copytree(ROOT / "raw_captive_data" / "bb2", folder)
    for path in folder.glob("*.csv"):
        table = pd.read_csv(path, dtype=str, keep_default_na=False)
        for column in table.columns:
            if column.split("_")[0] in ("X", "Y", "Z", "K", "M", "N", "KT", "KQ", "t", "value"):
                table[column] = table[column].where(table[column] == "", "0.0")
        table.to_csv(path, index=False)
    done = CliRunner().invoke(main, ["fit", str(folder), "--db", str(tmp_path / "db")])
    assert done.exit_code == 2, done.output
    assert not (tmp_path / "db").exists()
    errors = {(f.check, f.file) for f in findings(folder, "zero", "essential")}
    assert {("zero", "towing.csv"), ("zero", "open_water.csv"), ("essential", "drift_vertical.csv")} <= errors


def test_a_channel_of_zeros_is_missed_as_one_that_is_not_there(folder):
    drift = folder / "drift.csv"
    drift.write_text(drift.read_text().replace("-336000", "0").replace("-629000", "0"))
    (only,) = findings(folder, "essential")
    # Of the only test there is.
    assert only.severity == "warning"
    assert only.columns == ("Y",)


def test_a_table_that_no_source_names_is_said(folder):
    (folder / "more").mkdir()
    (folder / "more" / "DRIFT2.CSV").write_text(RUNS)
    (folder / "notes.md").write_text("read")
    (only,) = findings(folder, "unread")
    assert only.severity == "warning"
    assert "more/DRIFT2.CSV" in only.what


def test_a_ship_has_no_load_of_incidence(tmp_path):
    """A vehicle of the horizontal plane: what is said of alpha would change the speed along it, and nothing else."""
    folder = ship(tmp_path / "ship")
    assert not findings(folder, "state")
    stated = folder / "campaign.toml"
    text = stated.read_text()
    assert 'alpha = "0 deg"' in text
    stated.write_text(text.replace('alpha = "0 deg"', 'alpha = "5 deg"'))
    found = findings(folder, "state")
    assert [(f.severity, f.columns) for f in found] == [("error", ("alpha",))]


def scatterless(tmp_path, drag):
    """Two histories in drift whose axial force is what it is, sample after sample."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 0.05)
    folder = tmp_path / "campaign"
    folder.mkdir()
    for beta, x in zip((4, 8), drag, strict=True):
        y = -30.0 * beta + rng.normal(0.0, 1.0, len(time))
        axial = np.full(len(time), -31.0) if x == 0.0 else -31.0 + rng.normal(0.0, x, len(time))
        lines = "\n".join(f"{t:.2f},{a:.9g},{b:.9g}" for t, a, b in zip(time, axial, y, strict=True))
        (folder / f"drift_{beta}.csv").write_text("time [s],X [N],Y [N]\n" + lines + "\n")
    source = '[[source]]\nfiles = "drift_*.csv"\nrows = "history"\nmatch = \'drift_(?P<beta_deg>[0-9]+)\'\n'
    source += '[source.constants]\ntest = "drift_horizontal"\npart = "hull"\nquality = "ok"\nU = "2 m/s"\n'
    source += 'alpha = "0 deg"\nD0 = "25 m"\n[source.reduction]\nkind = "steady"\n'
    campaign(folder, source)
    return [f for f in findings(folder, "errors") if "standard error of zero" in f.what]


def test_a_computed_load_without_scatter_is_said_where_it_outweighs_nothing(tmp_path):
    (only,) = scatterless(tmp_path, (0.0, 0.0))
    assert (only.severity, only.columns) == ("warning", ("X",))


def test_a_load_without_scatter_that_outweighs_a_measured_one_is_an_error(tmp_path):
    (only,) = scatterless(tmp_path, (0.0, 1.0))
    assert (only.severity, only.columns) == ("error", ("X",))
