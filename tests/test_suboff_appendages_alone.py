"""SUBOFF: what sail and stern planes add, estimated from their size, against the difference of two configurations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.estimates.appendages import differences, lift_slope, on_a_body, read_appendages
from ident.identification.identify import identify
from sim.files.errors import InputError

SUBOFF = Path(__file__).parents[1] / "raw_captive_data" / "suboff"


@pytest.fixture(scope="module")
def found():
    names = ("hull", "hull-sail", "hull-planes")
    rows = {n: database_rows(identify(read_campaign(SUBOFF / "configurations" / n))) for n in names}
    return differences(read_appendages(SUBOFF / "configurations" / "appendages.csv"), rows, 4.2609)


def test_lift_slopes_between_their_two_limits():
    """pi A/2 of a slender wing, 2 pi of a long one; no body, no carry-over."""
    assert lift_slope(1e-4) == pytest.approx(np.pi * 1e-4 / 2.0, rel=1e-4)
    assert lift_slope(1e6) == pytest.approx(2.0 * np.pi, rel=1e-5)
    assert on_a_body(0.0, 1.0) == 1.0


def test_estimates_have_the_sign_of_the_measured_differences(found):
    assert len(found) == 8
    assert all(d.estimated * d.measured > 0.0 for d in found)


def test_differences_lie_in_the_stated_errors_at_the_stated_rate(found):
    """Of eight, 95 % intervals hold 6 or more with a chance of 99.4 %, one standard error 3 or more with 98 %."""
    scores = np.abs([d.score for d in found])
    assert (scores < 1.96).sum() >= 6
    assert (scores < 1.0).sum() >= 3


def test_the_sail_is_estimated_within_a_tenth(found):
    sail = next(d for d in found if d.appendage == "sail" and d.coefficient == "Y_v")
    assert sail.estimated == pytest.approx(sail.measured, rel=0.1)


def test_a_table_without_a_column_is_refused(tmp_path):
    (tmp_path / "a.csv").write_text("appendage\nsail\n", "utf-8")
    with pytest.raises(InputError, match="configuration"):
        read_appendages(tmp_path / "a.csv")
