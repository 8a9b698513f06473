"""Loads that a test is made for.

Authority: equilibrium: a boat without the side force of drift turns on a circle of its own; BB2's campaign with the
column taken out.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner
from small_campaign import write

import ident
from ident.cli import main
from sim.flight.trim import NoEquilibrium

BB2 = Path(__file__).parents[1] / "raw_captive_data" / "bb2"


def without(folder: Path, column: str) -> Path:
    shutil.copytree(BB2, folder)
    table = pd.read_csv(folder / "drift_horizontal.csv", dtype=str, keep_default_na=False)
    table.drop(columns=column).to_csv(folder / "drift_horizontal.csv", index=False)
    return folder


@pytest.mark.parametrize("column", ["Y_N", "N_Nm"])
def test_a_forgotten_column_of_a_campaign_stops_its_fit(tmp_path, column):
    campaign = without(tmp_path / "bb2", column)
    done = CliRunner().invoke(main, ["fit", str(campaign), "--db", str(tmp_path / "db")])
    assert done.exit_code == 2
    assert "drift_horizontal" in done.output
    assert not (tmp_path / "db").exists()


def test_a_campaign_of_one_test_is_a_part_of_a_model_and_says_what_it_lacks(tmp_path):
    campaign = write(tmp_path / "drift")
    header = (campaign / "campaign.toml").read_text("utf-8")
    declared = '[absent]\n"drift_horizontal.N" = "a made balance of two components"\n'
    assert declared in header
    (campaign / "campaign.toml").write_text(header.replace(declared, ""), "utf-8")
    (done,) = ident.fit(campaign, db=tmp_path / "db")
    assert [f.severity for f in done.findings if f.check == "essential"] == ["warning"]
    rows = ident.Database(tmp_path / "db")[0].rows
    of_hull = rows[(rows["part"] == "hull") & (rows["output"] == "N")]
    assert (of_hull["estimated_by"] != "").all()
    # No run gives a propeller.
    with pytest.raises(NoEquilibrium):
        ident.validate("hzz20", tmp_path / "db")
