"""SUBOFF: what sail and stern planes add, by the lines, against the difference of two configurations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.estimates.appendages import differences, estimated
from ident.identification.identify import identify

SUBOFF = Path(__file__).parents[1] / "raw_captive_data" / "suboff"


@pytest.fixture(scope="module")
def found():
    names = ("hull", "hull-sail", "hull-planes")
    rows = {n: database_rows(identify(read_campaign(SUBOFF / "configurations" / n))) for n in names}
    return differences(rows, "suboff")


def test_a_hull_adds_nothing_to_itself():
    """What both have wrong together is in neither value nor error."""
    assert set(estimated("suboff-hull", "suboff-hull").values()) == {(0.0, 0.0)}


def test_estimates_have_the_sign_of_the_measured_differences(found):
    assert len(found) == 8
    assert all(d.estimated * d.measured > 0.0 for d in found)


def test_differences_lie_in_the_stated_errors_at_the_stated_rate(found):
    """Of eight, 95 % intervals hold 6 or more with a chance of 99.4 %, one standard error 3 or more with 98 %."""
    scores = np.abs([d.score for d in found])
    assert (scores < 1.96).sum() >= 6
    assert (scores < 1.0).sum() >= 3


def test_the_sail_pushes_as_measured_within_both_errors(found):
    sail = next(d for d in found if d.appendage == "sail" and d.coefficient == "Y_v")
    assert abs(sail.score) < 1.96
    assert sail.estimated == pytest.approx(sail.measured, rel=0.25)
