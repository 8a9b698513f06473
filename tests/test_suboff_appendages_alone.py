"""SUBOFF: what sail and stern planes add, by the lines, against the difference of two configurations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.estimates.appendages import differences, estimated, mass_number, slope_error
from ident.identification.identify import identify

SUBOFF = Path(__file__).parents[1] / "raw_captive_data" / "suboff"


@pytest.fixture(scope="module")
def found():
    names = ("hull", "hull-sail", "hull-planes")
    folders = {n: SUBOFF / "configurations" / n for n in names} | {"full": SUBOFF}
    rows = {n: database_rows(identify(read_campaign(folder))) for n, folder in folders.items()}
    return differences(rows, "suboff", 1000.0)


def test_a_hull_adds_nothing_to_itself():
    """What both have wrong together is in neither value nor error."""
    assert set(estimated("suboff-hull", "suboff-hull").values()) == {(0.0, 0.0)}


def test_estimates_have_the_sign_of_the_measured_differences(found):
    assert len(found) == 8
    assert all(d.estimated * d.measured > 0.0 for d in found)


def test_differences_lie_in_the_stated_errors_at_the_stated_rate(found):
    """Of eight, 95 % intervals hold 7 or more with a chance of 94 %, one standard error 3 or more with 98 %."""
    scores = np.abs([d.score for d in found])
    assert (scores < 1.96).sum() >= 7
    assert (scores < 1.0).sum() >= 3


def test_a_force_by_yaw_is_known_as_well_as_the_slope_it_was_measured_as(found):
    """10 % of the full boat's 0.005251 are 4.0 % of its slope, 0.018333 - 0.005251; of 0.000023 they are nothing."""
    mass = mass_number("suboff", 1000.0)
    assert mass == pytest.approx(0.018333, abs=1e-6)
    share = 0.10 * 0.005251 / (mass - 0.005251)
    assert share == pytest.approx(0.0401, abs=1e-4)
    assert slope_error(0.005251, 0.0005251, mass, share) == pytest.approx(0.0005251)
    assert slope_error(0.0, 0.0, mass, share) == pytest.approx(0.0401 * 0.018333, rel=2e-3)
    # What is quoted is kept where it is more.
    assert slope_error(0.006324, 0.0006324, mass, share) == 0.0006324
    yaw = {d.appendage: d.measured_sigma for d in found if d.coefficient == "Y_ur"}
    slopes = [mass_number(f"suboff-{c}", 1000.0) - v for c, v in (("hull", 0.001811), ("hull-sail", -0.000023))]
    assert yaw["sail"] == pytest.approx(share * np.hypot(*slopes), rel=1e-6)
    others = [d for d in found if d.coefficient == "Y_v" and d.appendage == "sail"]
    assert others[0].measured_sigma == pytest.approx(np.hypot(0.05 * 0.005948, 0.05 * 0.023008), rel=1e-6)


def test_the_sail_pushes_as_measured_within_both_errors(found):
    sail = next(d for d in found if d.appendage == "sail" and d.coefficient == "Y_v")
    assert abs(sail.score) < 1.96
    assert sail.estimated == pytest.approx(sail.measured, rel=0.25)
