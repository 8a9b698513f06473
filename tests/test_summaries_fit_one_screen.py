"""What ``ident check`` and ``ident fit`` print: one screen of 24 lines at 80 and 120 columns, the rest in the JSON."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
from rich.console import Console

from ident.checks.check import show as show_findings
from ident.checks.findings import Finding
from ident.checks.summary import cut, lines
from ident.fitting.fit import fit, show

BB2 = Path(__file__).parents[1] / "raw_captive_data" / "bb2"
LINES = 24


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    (done,) = fit(BB2, tmp_path_factory.mktemp("db") / "db")
    return done


def printed(width: int, print_to) -> list[str]:
    stream = io.StringIO()
    print_to(Console(file=stream, width=width, force_terminal=False))
    return stream.getvalue().splitlines()


@pytest.mark.parametrize("width", [80, 120])
def test_a_fit_of_bb2_fits_one_screen(fitted, width):
    text = printed(width, lambda console: show(fitted, console))
    assert len(text) <= LINES
    assert max(map(len, text)) <= width
    whole = "\n".join(text)
    for words in ("runs used", "loads left out", "quality checks: ", f"version {fitted.version}", fitted.digest[:16]):
        assert words in whole


@pytest.mark.parametrize("width", [80, 120])
def test_the_findings_of_bb2_fit_one_screen(fitted, width):
    text = printed(width, lambda console: show_findings(fitted.findings, "bb2: 580 runs", console))
    assert len(text) <= LINES
    assert max(map(len, text)) <= width


def test_everything_is_in_the_json(fitted):
    content = json.loads(json.dumps(fitted.to_dict()))
    assert len(content["checks"]) == len(fitted.findings)
    assert len(content["unused"]) == len(fitted.identification.unused) > 100
    assert len(content["warnings"]) == len(fitted.identification.warnings)
    assert len(content["coefficients"]) > 80


def finding(severity: str, check: str, what: str = "something") -> Finding:
    return Finding(check, severity, "a_file_with_a_long_name_of_a_test.csv", (2, 3), ("X",), what * 20, "mend it")


def test_errors_come_first_with_their_remedy_and_the_rest_is_counted():
    many = [finding("error", "size"), *(finding("warning", f"check{k}") for k in range(30))]
    shown = lines(many, 80, 9)
    assert len(shown) == 9
    assert shown[0][1].startswith("error")
    assert "mend it" in shown[1][1]
    assert "findings of" in shown[-1][1]
    named = [text for severity, text in shown if severity]
    assert f"and {len(many) - len(named)} findings" in shown[-1][1]
    assert all(len(text) <= 80 for _, text in shown)


def test_many_findings_of_one_check_are_one_line():
    shown = lines([finding("warning", "outliers") for _ in range(50)], 100)
    assert len(shown) == 1
    assert "outliers x50" in shown[0][1]


@pytest.mark.parametrize(
    ("text", "width", "expected"), [("abc", 3, "abc"), ("a  b\nc", 9, "a b c"), ("abcdefgh", 6, "abc...")]
)
def test_texts_are_cut_to_one_line(text, width, expected):
    assert cut(text, width) == expected
