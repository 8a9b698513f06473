"""Authority: the campaign file. A version and its report say what was done to the runs, number by number."""

from __future__ import annotations

import html
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from made_campaigns import campaign, history

from ident.captive.campaign import read_campaign
from ident.cli import main
from ident.database.provenance import conversions, steps
from ident.database.store import commit
from ident.fitting.fit import fit
from ident.report.page import write_report
from sim.boat.database import versions

ROWS = """run_id,test,part,U_mps,alpha_deg,beta_deg,D0_m,X_N,Y_N,Z_N,K_Nm,M_Nm,N_Nm,rel_sigma,quality,source
A1,drift_horizontal,hull,2,0,-8,25,-20,60,1,1,1,40,0.02,ok,made
A2,drift_horizontal,hull,2,0,-4,25,-18,30,1,1,1,20,0.02,ok,made
A3,drift_horizontal,stern_plane_1,2,0,-4,25,-1,3,1,1,1,2,0.02,ok,made
"""
TABLES = {
    "frame": 'x = "forward"\ny = "starboard"\nz = "up"\nrotations = "left-hand"\nangles = "ittc"',
    "moment_point": 'x_m = 0.25\ny_m = 0.0\nz_m = 0.0\nabout = "balance"',
    "scale": "ratio = 20.0\nlength_m = 3.51",
    "inertia": "model_inertia_in_loads = true\nmass_kg = 500.0\ncentre_of_gravity_m = [0.1, 0.0, 0.0]\n"
    'tensor_kgm2 = [5.0, 300.0, 310.0]\nsource = "weighed"',
}
TARE = """[[tare]]
what = "strut"
source = "empty runs"
loads = { X = "1.5 N" }
per_speed_squared = { X = 0.25 }
parts = ["hull"]
"""
REDUCTION = '[source.reduction]\nkind = "steady"\nstart_s = 3.0\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    sources = TARE + '[[source]]\nfiles = "runs.csv"\n' + history("tow.csv", reduction=REDUCTION)
    where = campaign(tmp_path_factory.mktemp("made"), sources, **TABLES)
    (where / "runs.csv").write_text(ROWS, "utf-8")
    noise = np.random.default_rng(1).normal(size=(400, 6))
    lines = [f"{0.05 * i:.2f}," + ",".join(f"{x:.4f}" for x in row + 50.0) for i, row in enumerate(noise)]
    text = "time_s,X_N,Y_N,Z_N,K_Nm,M_Nm,N_Nm\n" + "\n".join(lines) + "\n"
    (where / "tow.csv").write_text(text, "utf-8")
    return where


@pytest.fixture(scope="module")
def fitted(folder, tmp_path_factory):
    db = str(tmp_path_factory.mktemp("provenance") / "db")
    return fit(folder, db, force="loads are made up, sheets do not agree")[0], db


def test_the_version_holds_every_conversion_of_the_file(fitted):
    _, db = fitted
    stored = json.loads(versions(db)[-1].metadata["conversions"])
    # In left-handed axes with z up, Z and the rotations about x and y turn; N = x Y - y X does not.
    assert stored["frame"]["changed_sign"] == ["Z", "K", "M", "p", "q", "wdot", "pdot", "qdot"]
    assert stored["frame"]["rotations"] == "left-hand"
    assert stored["frame"]["beta_changed_sign"] is True
    assert stored["moment_point"] == {"x_m": 0.25, "y_m": 0.0, "z_m": 0.0, "about": "balance"}
    assert stored["scale"] == {"ratio": 20.0, "length_m": 3.51, "draught_m": None}
    assert (stored["inertia"]["mass_kg"], stored["inertia"]["runs"]) == (500.0, 3)
    assert [(t["what"], t["loads"], t["runs"]) for t in stored["tare"]] == [("strut", {"X": "1.5 N"}, 3)]
    assert [s["files"] for s in stored["sources"]] == ["runs.csv", "tow.csv"]
    assert stored["sources"][1]["reduction"]["start_s"] == 3.0
    assert [h["file"] for h in stored["histories"]] == ["tow.csv"]
    assert "3-19.95 s" in stored["histories"][0]["reduction"]


def test_the_same_is_in_the_summary_a_program_reads(fitted):
    done, db = fitted
    assert done.to_dict()["conversions"] == json.loads(versions(db)[-1].metadata["conversions"])


def test_the_report_shows_it_in_the_order_it_was_done(fitted, tmp_path):
    _, db = fitted
    page = html.unescape(Path(write_report(db, None, tmp_path, "bb2").file).read_text("utf-8"))
    words = [
        "tow.csv: kind steady, start_s 3.0",
        "1; start-up transient MSER",
        "strut taken off 3 runs: X 1.5 N, X 0.25 U^2 (empty runs)",
        "Z K M p q wdot pdot qdot changed sign",
        "left-hand about these axes",
        "ship's drift angle, positive with port windward; beta changed sign",
        "moved to the vehicle's origin from (0.25, 0, 0) m; balance",
        "m a added to 3 runs of hull: m = 500 kg, centre of gravity (0.1, 0, 0) m, tensor (5, 300, 310) kg m2; weighed",
        "no: the whole body was tested",
        "1:20 by Froude's law to full scale; length 3.51 m; density 1000 kg/m3",
        "floor 0.1; made up",
    ]
    assert all(w in page for w in words), [w for w in words if w not in page]
    places = [page.index(w) for w in words]
    assert places == sorted(places)


def test_a_campaign_as_the_program_has_it_says_that_nothing_was_done(tmp_path):
    where = campaign(tmp_path)
    (where / "runs.csv").write_text(ROWS, "utf-8")
    said = dict(steps(conversions(read_campaign(where))))
    assert said["Axes"].endswith("nothing changed sign")
    assert said["Tare"] == "none taken off"
    assert said["Moments"].startswith("about the vehicle's origin: not moved")
    assert said["Model's own inertia"] == "not in the loads: nothing added back"
    assert said["Scale"].startswith("1:1, as tested")


def test_a_version_from_before_says_so_and_has_the_same_digest(fitted, tmp_path):
    """What is kept of the conversions is beside the content, not in it."""
    done, _ = fitted
    db = str(tmp_path / "db")
    commit(db, done.rows, {})
    assert versions(db)[-1].digest == done.digest
    assert "Not stored with the commit." in Path(write_report(db, None, tmp_path, "bb2").file).read_text("utf-8")


def said(*arguments: str) -> dict:
    """What a command writes for a program to read, and nothing else."""
    done = CliRunner().invoke(main, [*arguments, "--json", "-"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_the_report_says_what_it_wrote(fitted, tmp_path):
    one, db = fitted
    found = said("report", "--db", db, "--out", str(tmp_path))
    assert found["file"] == str(tmp_path / "bb2_v0.html")
    assert (tmp_path / "bb2_v0.html").read_text("utf-8").startswith("<!DOCTYPE html>")
    assert found["database"] == {"path": db, "version": 0, "digest": one.digest}
    assert (found["vehicle"], found["rows"]) == ("bb2", len(one.rows))
    assert found["coefficients"] == one.rows["coefficient"].nunique()
    assert not set(found["absent"]) & set(one.rows["coefficient"])
    counts = pd.Series([f.severity for f in one.findings]).value_counts()
    assert found["findings"] == {k: int(counts.get(k, 0)) for k in ("error", "warning", "info")}
    assert (found["warnings"], found["unused"]) == (len(one.identification.warnings), len(one.identification.unused))


def _exchanged(file: str) -> list[dict]:
    """Rows of an exchange file."""
    data = json.loads(Path(file).read_text("utf-8"))
    return [row for vehicle in data["vehicles"] for row in vehicle["rows"]]


@pytest.mark.parametrize("kind", ["csv", "parquet", "json"])
def test_an_export_says_what_it_wrote(fitted, tmp_path, kind):
    one, db = fitted
    found = said("export", str(tmp_path / "out"), "--db", db, "--format", kind)
    read = {"csv": pd.read_csv, "parquet": pd.read_parquet, "json": _exchanged}[kind]
    assert len(read(found["file"])) == found["rows"] == len(one.rows)
    assert (found["format"], found["database"]["digest"]) == (kind, one.digest)
    assert found["vehicles"] == [{"vehicle": "bb2", "version": 0, "digest": one.digest, "rows": len(one.rows)}]
    (tmp_path / "what.json").unlink(missing_ok=True)
    done = CliRunner().invoke(main, ["export", str(tmp_path), "--db", db, "--json", str(tmp_path / "what.json")])
    assert done.output.strip() == str(tmp_path / "coefficients_v0.csv")
    assert json.loads((tmp_path / "what.json").read_text())["rows"] == len(one.rows)
