"""From a number of the scoreboard to the values behind its flight, and from there to a run: one page, three clicks."""

from __future__ import annotations

import json
import re

import pytest
from click.testing import CliRunner

from ident.cli import main
from ident.report.score import read_score
from sim.boat.database import own_version, read_rows
from sim.files.errors import InputError

ERROR = {"rmse": 1.25, "unit": "deg", "measured_only_rmse": None, "published_model_rmse": 2.5, "ratio": 0.5}


def _board(path, digest, rows):
    case = {"case": "my zigzag", "database": {"digest": digest}, "trained": False, "rows": rows}
    path.write_text(json.dumps({"cases": [case | {"references": {"TRIAL": {"psi": ERROR}}}]}), "utf-8")
    return path


@pytest.fixture(scope="module")
def values(fitted_db):
    """The vehicle's rows, their digest, and the places of N_uvw at 8 deg among them."""
    rows = read_rows(fitted_db, None, "bb2")[0].reset_index(drop=True)
    chosen = rows[(rows["coefficient"] == "N_uvw") & (rows["beta_deg"] == 8.0)]
    return rows, own_version(fitted_db, "bb2", read_rows(fitted_db, None, "bb2")[1]).digest, chosen.index.tolist()


def test_a_number_leads_to_its_values_and_they_to_their_runs(fitted_db, values, tmp_path):
    rows, digest, places = values
    assert places
    board = _board(tmp_path / "board.json", digest, {"N_uvw": places})
    asked = ["report", "--db", fitted_db, "--vehicle", "bb2", "--out", str(tmp_path), "--scoreboard", str(board)]
    done = CliRunner().invoke(main, asked)
    assert done.exit_code == 0, done.output
    page = next(tmp_path.glob("*.html")).read_text("utf-8")
    link = f'<a href="#values" data-case="0" data-name="my zigzag">{len(places)} values of 1 terms</a>'
    assert link in page
    assert re.search(r'data-name="my zigzag">1\.25 deg</a>', page)
    behind = re.findall(r'<tr data-cases="0">(.*?)</tr>', page, re.DOTALL)
    assert len(behind) == len(places)
    runs = {name for text in rows.loc[places, "runs"] for name in text.split()}
    anchors = {anchor for row in behind for anchor in re.findall(r'href="#(run-\d+)"', row)}
    assert len(anchors) == len(runs)
    for anchor in anchors:
        (line,) = re.findall(rf'<tr id="{anchor}">(.*?)</tr>', page, re.DOTALL)
        assert ">plot</a>" in line


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{}", "no scoreboard"),
        ("[1]", "no scoreboard"),
        ('{"cases": [{"case": 1}]}', "no scoreboard"),
        ('{"cases": []}', "no case flown with the rows of digest"),
    ],
)
def test_what_is_no_scoreboard_of_this_version_is_refused(tmp_path, text, said):
    (tmp_path / "board.json").write_text(text, "utf-8")
    with pytest.raises(InputError, match=said):
        read_score(tmp_path / "board.json", "d" * 64, 10)


def test_a_row_that_the_version_does_not_have_is_refused(tmp_path):
    with pytest.raises(InputError, match="row 10 of 10"):
        read_score(_board(tmp_path / "board.json", "d" * 64, {"N_uvw": [10]}), "d" * 64, 10)
