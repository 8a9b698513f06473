"""What CONTRIBUTING.md tells a contributor: paths are there, the term and the reader of its recipes work as printed."""

from __future__ import annotations

import csv
import re
import textwrap
import tomllib
from pathlib import Path

import pytest

import ident
from ident.captive.source import Source
from sim.boat import catalogue

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text("utf-8")


def recipe(language):
    """The block of a numbered recipe in that language, as it is printed."""
    (block,) = re.findall(rf"^ +```{language}\n(.*?)\n +```$", TEXT, re.DOTALL | re.MULTILINE)
    return textwrap.dedent(block)


def test_the_term_of_the_recipe_is_a_row_of_the_table():
    table = (ROOT / "sim" / "data" / "terms.csv").read_text("utf-8").splitlines()
    (row,) = csv.DictReader([table[0], recipe("text")])
    term = catalogue.read_term(row)
    catalogue.check(term)
    assert term.name not in {t.name for t in catalogue.terms("gertler_hagen")}
    assert (term.factors, term.output, term.power, term.axes) == (("v", "v", "v/U"), "N", 3, ())
    with pytest.raises(catalogue.CatalogueError, match="row N_vvv"):
        catalogue.check(catalogue.read_term(row | {"multiplier": "v*v*v/T"}))


def test_the_reader_of_the_recipe_reads_and_refuses(tmp_path):
    names = {}
    exec(compile(recipe("python"), "CONTRIBUTING.md", "exec"), names)
    path, source = tmp_path / "runs.jsonl", Source(files="*.jsonl")
    path.write_text('{"beta_deg": 2.0, "Y_N": 10.5}\n{"beta_deg": 4.0, "Y_N": 21.25}\n')
    sheet = names["open_json_lines"](path, source)
    assert sheet.header == ["beta_deg", "Y_N"]
    assert [(row, list(map(float, cells))) for row, cells in sheet.cells()] == [(1, [2.0, 10.5]), (2, [4.0, 21.25])]
    for damaged in ('{"beta_deg": 2.0}\n{"beta', '{"beta_deg": 2.0}\n{"beta_rad": 2.0}'):
        path.write_text(damaged)
        with pytest.raises(ident.InputError, match="row 2"):
            names["open_json_lines"](path, source)
    for damaged in ("", "5\n", "[1, 2]\n"):
        path.write_text(damaged)
        with pytest.raises(ident.InputError, match=r"runs\.jsonl"):
            names["open_json_lines"](path, source)


def test_what_a_contributor_is_told_to_run_is_there():
    named = re.findall(r"`((?:sim|ident|tests|docs|\.ci)/[\w./]+\w)`", TEXT)
    assert len(named) >= 10
    for path in named:
        assert (ROOT / path).exists() or "NAME" in path, path
    for path in re.findall(r"(?:pytest (?:-n 0 )?|python )((?:tests|docs)/\S+\.py)", TEXT):
        assert (ROOT / path).is_file(), path
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    dev = " ".join(extras["dev"] + extras["docs"])
    for tool in ("ruff", "mypy", "import-linter", "sphinx"):
        assert tool in dev
