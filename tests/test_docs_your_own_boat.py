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

from ident.captive.campaign import read_campaign
from ident.cli import main
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.boat.database import read_rows

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "your-own-boat.md").read_text("utf-8")
EXAMPLE = ROOT / "ident" / "starter" / "files"
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
    assert len(BLOCKS) >= 9
    commands = [shlex.split(command)[1] for command, _ in BLOCKS]
    wanted = ["runs", "check", "fit", "report", "validate"]
    assert [c for c in dict.fromkeys(commands) if c in wanted] == wanted
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
    for first, name in (("run_id", "drift_horizontal.csv"), ("time_s", "histories/drift_6.csv")):
        block = re.search(rf"```\n({first}.*?)\n```", PAGE, re.DOTALL)
        lines = (EXAMPLE / "captive" / name).read_text("utf-8").splitlines()
        assert block[1].splitlines() == lines[:3]


def test_the_source_on_the_page_is_the_campaign_files():
    block = re.search(r"```toml\n(.*?)\n```", PAGE, re.DOTALL)[1]
    campaign = re.sub(r" +#.*", "", (EXAMPLE / "captive" / "campaign.toml").read_text("utf-8"))
    assert block in campaign


def _maker():
    spec = importlib.util.spec_from_file_location("make_example", ROOT / "docs" / "make_example.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_data_are_what_the_script_writes(folder, monkeypatch, tmp_path):
    maker = _maker()
    shutil.copytree(EXAMPLE, tmp_path / "again", ignore=shutil.ignore_patterns("*.csv"))
    monkeypatch.setattr(maker, "HERE", tmp_path / "again")
    maker.captive()
    maker.histories()
    maker.propeller()
    here = tmp_path / "again" / "captive"
    written = sorted(here.rglob("*.csv"))
    assert len(written) == len(list((EXAMPLE / "captive").rglob("*.csv"))) > 18
    for path in written:
        there = EXAMPLE / "captive" / path.relative_to(here)
        assert path.read_text("utf-8") == there.read_text("utf-8"), path.name


def test_example_files_stay_small():
    assert sum(p.stat().st_size for p in EXAMPLE.rglob("*") if p.suffix in (".csv", ".toml")) < 60000


def test_reduced_histories_hold_the_known_loads_within_their_errors():
    """Six runs of three loads against the term table's exact loads, at the states the reduction says."""
    tank = _maker().Tank()
    read = read_campaign(EXAMPLE / "captive")
    runs = read.runs[read.runs["reduction"] != ""]
    assert len(runs) == 6
    scores = []
    for _, run in runs.iterrows():
        # Froude's law back to the model: speeds by the root of 12, forces by its cube.
        state = {"U": run["U"] / 12.0**0.5, "beta": run["beta"], "D0": run["D0"] / 12.0, "vdot": run["vdot"]}
        exact = tank.exact("hull", {k: x for k, x in state.items() if x == x})
        for output, power in (("X", 3), ("Y", 3), ("N", 4)):
            scores.append((run[output] / 12.0**power - exact[output]) / (run[f"s_{output}"] / 12.0**power))
    assert max(map(abs, scores)) < 4.0
    assert 0.5 < (sum(s * s for s in scores) / len(scores)) ** 0.5 < 1.7


def test_identification_comes_back_to_the_known_coefficients(outputs, folder):
    """Within their standard errors: none beyond four, and inside two as many as 95 % make likely."""
    maker = _maker()
    rows = read_rows(str(folder / "my_db"))[0]
    assert len(rows) == len(database_rows(identify(read_campaign(EXAMPLE / "captive"))))
    found = rows[rows["coefficient"].isin(maker.TRUTH)].set_index("coefficient")
    assert set(found.index) == set(maker.TRUTH)
    scores = [abs(found.loc[k, "value"] - x) / found.loc[k, "stderr"] for k, x in maker.TRUTH.items()]
    assert max(scores) < 4.0
    # Of 37 independent scores, 32 or more with probability 0.99; some here share their runs.
    assert len(scores) == 37
    assert sum(s < 2.0 for s in scores) >= 32
