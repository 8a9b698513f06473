"""What the report prints of each value, its interactive figures, and differences drawn.

Authority: the database's own rows (every one is printed once, with its runs), the campaign's files (a value's
run stands in the row that is named), and the normal distribution's interval.
"""

from __future__ import annotations

import csv
import html
import json
import re
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner
from small_campaign import fitted, write

from ident.cli import main
from ident.database.store import commit
from ident.database.versions import Database
from ident.fitting.fit import fit
from ident.report.coverage import coverage
from ident.report.values import number, runs_of, term_anchor, term_pages
from sim.boat.database import axis_columns, own_version, read_rows
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import load_vehicle


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A small campaign, fitted, and again with one coefficient moved."""
    folder = tmp_path_factory.mktemp("values")
    campaign = write(folder / "campaign")
    db = str(folder / "db")
    fit(campaign, db)
    rows, _ = read_rows(db)
    moved = rows.assign(value=rows["value"].where(rows["coefficient"] != "Y_uvw", rows["value"] * 1.1))
    commit(db, moved, {"runs": own_version(db, "bb2", 0).metadata["runs"]})
    return folder, campaign, db


@pytest.fixture(scope="module")
def pages(place):
    _, _, db = place
    rows, _ = read_rows(db, 0)
    runs = runs_of(rows, own_version(db, "bb2", 0))
    return rows, runs, {p.symbol: p for p in term_pages(vehicle_terms(load_vehicle("bb2")), rows, (), runs)}


def test_every_row_is_printed_once_under_its_term(pages):
    rows, _, of_term = pages
    assert {s: len(p.values) for s, p in of_term.items()} == rows.groupby("coefficient").size().to_dict()


def test_a_value_names_the_file_and_row_its_run_stands_in(place, pages):
    _, campaign, _ = place
    _, _, of_term = pages
    named = [run for page in of_term.values() for value in page.values for run in value.runs]
    assert named
    for run in named:
        with open(campaign / run.file, encoding="utf-8", newline="") as stream:
            lines = list(csv.reader(stream))
        # Row 1 is the header.
        assert lines[run.row - 1][lines[0].index("run_id")] == run.name


def test_the_interval_is_that_of_a_normal_distribution(pages):
    rows, _, of_term = pages
    one = rows[(rows["origin"] == "measured") & (rows["stderr"] > 0)].iloc[0]
    texts = {(v.value, v.low, v.high) for v in of_term[one["coefficient"]].values}
    half = 1.959963984540054 * one["stderr"]
    assert (number(one["value"]), number(one["value"] - half, 4), number(one["value"] + half, 4)) in texts


def test_the_page_holds_every_value_and_links_them(place):
    folder, _, db = place
    done = CliRunner().invoke(main, ["report", "--db", db, "--version", "0", "--out", str(folder / "r"), "--json", "-"])
    assert done.exit_code == 0, done.output
    page = Path(json.loads(done.stdout)["file"]).read_text("utf-8")
    rows, _ = read_rows(db, 0)
    assert page.count('<details class="term"') == rows["coefficient"].nunique() + 1
    targets = set(re.findall(r'id="([^"]+)"', page))
    links = {html.unescape(t) for t in re.findall(r'href="#([^"]+)"', page)}
    assert links <= targets
    assert term_anchor("Y_uvw") in links
    # Nothing is fetched.
    assert not re.search(r'(?:src|href)="https?:', page)


def test_interactive_figures_hold_every_version_asked_for(place):
    folder, _, db = place
    command = ["report", "--db", db, "--out", str(folder / "i"), "--interactive", "--beside", "0", "--json", "-"]
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 0, done.output
    page = Path(json.loads(done.stdout)["interactive"]).read_text("utf-8")
    figures = json.loads(re.search(r"const FIGURES = (.*);\n", page)[1])
    rows = {n: read_rows(db, n)[0] for n in (0, 1)}
    for symbol, (slices, *_) in figures.items():
        for n, of_version in rows.items():
            drawn = [y for t in slices["data"] if t["name"].startswith(f"version {n},") for y in t["y"]]
            assert sorted(drawn) == sorted(of_version[of_version["coefficient"] == symbol]["value"])
    assert "Y_uvw" in figures


def test_an_option_that_changes_nothing_is_refused(place):
    done = CliRunner().invoke(main, ["report", "--db", place[2], "--beside", "0"])
    assert (done.exit_code, "--interactive" in done.output) == (2, True)


@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
def test_a_difference_is_drawn_in_every_format(place, kind):
    folder, _, db = place
    path = folder / f"changes.{kind}"
    done = CliRunner().invoke(main, ["diff", "0", "1", "--db", db, "--figure", str(path)])
    assert done.exit_code == 0, done.output
    assert path.read_bytes()[:5] in (b"\x89PNG\r", b"<?xml", b"%PDF-")
    assert "bb2" in done.output
    refused = CliRunner().invoke(main, ["diff", "0", "1", "--db", db, "--figure", str(folder / "changes.bmp")])
    assert refused.exit_code == 2


def test_the_worst_of_words_with_one_factor_is_the_last_of_the_vocabulary():
    """Whatever the order of a set is in this process: the page of a version is the same every time."""
    suboff = load_vehicle("suboff")
    term = vehicle_terms(suboff)[0]
    words = [f"word_{k}" for k in range(9)]
    shown = {"coefficient": term.name, "part": "hull", "origin": "published", "quality": words, "worst_residual": 0.0}
    rows = pd.DataFrame(shown | dict.fromkeys(axis_columns(), 0.0))
    of_term = next(one for one in coverage(suboff, rows, dict.fromkeys(words, 1.0)) if one.symbol == term.name)
    assert (of_term.quality, of_term.worst_points) == (words[-1], 1)


def test_another_boats_version_is_no_parent(tmp_path):
    few = fitted(write(tmp_path / "campaign"))
    db = str(tmp_path / "db")
    commit(db, few, {})
    commit(db, few.assign(vehicle="suboff"), {})
    commit(db, few.assign(value=2.0 * few["value"]), {})
    assert [v["parent"] for v in Database(db).to_dict()] == ["", "", "0"]
