"""Bands of a case that has no reference series: said in a line, not in tables without a row."""

from __future__ import annotations

from rich.console import Console

from ident.validation.band_summary import BandSummary, show


def _shown(of):
    console = Console(width=120, force_terminal=False)
    with console.capture() as caught:
        show(of, console)
    return caught.get()


def test_without_a_series_one_line_says_so():
    text = _shown(BandSummary(20, 1, 0, {}, {}))
    assert text.split("\n")[0] == "20 samples, 1 without self-propulsion; the case has no series to hold them against"
    assert "inside" not in text


def test_with_one_its_share_inside_is_shown():
    text = _shown(BandSummary(20, 0, 0, {"EXP": {"psi": {"50": 0.4, "95": 0.9}}}, {"psi": []}))
    assert "inside 95 %" in text
    assert "90 %" in text
