"""docs/your-own-boat.md does what it says: its commands run, and print what stands there."""

from __future__ import annotations

import doctest
import importlib.util
import re
import shlex
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from ident.campaign import read_campaign
from ident.cli import main
from ident.identify import identify
from ident.store import database_rows
from sim.database import read_rows

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "your-own-boat.md").read_text("utf-8")
EXAMPLE = ROOT / "docs" / "example"
BLOCKS = re.findall(r"```sh\n(.*?)\n```\n\n```text\n(.*?)\n```", PAGE, re.DOTALL)
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("docs") / "example"
    shutil.copytree(EXAMPLE, where)
    return where


@pytest.fixture(scope="module")
def outputs(folder):
    """What each command of the page prints, in the page's order and folder."""
    found = []
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for command, _ in BLOCKS:
            program, *arguments = shlex.split(command)
            assert program == "ident"
            found.append(CliRunner().invoke(main, arguments))
    return found


def test_the_page_has_its_commands():
    assert len(BLOCKS) >= 7
    assert len(BLOCKS) == PAGE.count("```sh") == PAGE.count("```text")


@pytest.mark.parametrize("k", range(len(BLOCKS)), ids=[c.split("--db")[0].strip() for c, _ in BLOCKS])
def test_a_command_prints_what_the_page_says(outputs, k):
    command, wanted = BLOCKS[k]
    printed = outputs[k].output
    # Leading dots may stand for nothing at all.
    wanted = re.sub(r"^\.\.\.\s+", "...", wanted)
    assert doctest.OutputChecker().check_output(wanted + "\n", printed, OPTIONS), f"{command}\n{printed}"
    assert outputs[k].exit_code == (2 if printed.startswith("Error") else 0)


def test_the_run_table_on_the_page_is_the_file():
    block = re.search(r"```\n(run_id.*?)\n```", PAGE, re.DOTALL)
    lines = (EXAMPLE / "captive" / "drift_horizontal.csv").read_text("utf-8").splitlines()
    assert block[1].splitlines() == lines[:3]


def _maker():
    spec = importlib.util.spec_from_file_location("make_example", EXAMPLE / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_data_are_what_the_script_writes(folder, monkeypatch, tmp_path):
    maker = _maker()
    shutil.copytree(EXAMPLE, tmp_path / "again", ignore=shutil.ignore_patterns("*.csv"))
    monkeypatch.setattr(maker, "HERE", tmp_path / "again")
    maker.captive()
    maker.propeller()
    written = sorted((tmp_path / "again" / "captive").glob("*.csv"))
    assert len(written) == len(list((EXAMPLE / "captive").glob("*.csv"))) > 15
    for path in written:
        assert path.read_text("utf-8") == (EXAMPLE / "captive" / path.name).read_text("utf-8"), path.name


def test_identification_comes_back_to_the_known_coefficients(outputs, folder):
    """Within their standard errors: 95 % inside two, none beyond four."""
    maker = _maker()
    rows = read_rows(str(folder / "my_db"))[0]
    assert len(rows) == len(database_rows(identify(read_campaign(EXAMPLE / "captive"))))
    found = rows[rows["coefficient"].isin(maker.TRUTH)].set_index("coefficient")
    assert set(found.index) == set(maker.TRUTH)
    scores = [abs(found.loc[k, "value"] - x) / found.loc[k, "stderr"] for k, x in maker.TRUTH.items()]
    assert max(scores) < 4.0
    assert sum(s < 2.0 for s in scores) >= 0.9 * len(scores)
