"""KVLCC2 as bundled: its hull is what ``ident fit`` makes of HMRI's sheets, and it flies as a tanker does."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest

from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.boat.coefficients import Coefficients
from sim.boat.vehicle import load_vehicle
from sim.flight.case import load_case
from sim.flight.simulate import simulate

ROOT = Path(__file__).parents[1]
HMRI = ROOT.parent / "shared" / "datasets" / "kvlcc2_hmri_pmm"
OURS = ROOT / "raw_captive_data" / "kvlcc2"
SHEETS = ("static_drift_test.csv", "static_rudder_test.csv", "pure_sway_test.csv", "pure_yaw_test.csv")
# Norm 1/2 rho L^n to 1/2 rho L^(n-1) d at model scale.
SLENDERNESS = 6.8927 / 0.448


def _bundled(name: str) -> Coefficients:
    rows = database_rows(identify(read_campaign(ROOT / "raw_captive_data" / name)))
    return Coefficients(load_vehicle(name), rows)


@pytest.mark.skipif(not HMRI.exists(), reason="the benchmark's sheets are not distributed with the program")
def test_the_bundled_hull_is_what_fit_makes_of_the_sheets_as_they_lie(tmp_path):
    for name in SHEETS:
        shutil.copy(HMRI / name, tmp_path)
    shutil.copy(OURS / "hmri_sheets.toml", tmp_path / "campaign.toml")
    rows = database_rows(identify(read_campaign(tmp_path))).set_index("coefficient")
    with (OURS / "hull.csv").open(encoding="utf-8") as stream:
        kept = {
            r["coefficient"]: r
            for r in csv.DictReader(stream)
            if r["quality"] == "identified" and r["coefficient"] != "X_vra"
        }
    assert set(kept) == set(rows.index)
    for name, row in kept.items():
        assert float(row["value"]) == pytest.approx(rows.loc[name, "value"] * SLENDERNESS, rel=1e-5), name
        assert float(row["sigma_value"]) == pytest.approx(rows.loc[name, "stderr"] * SLENDERNESS, rel=1e-2), name


@pytest.mark.parametrize(("name", "scale"), [("kvlcc2", 46.426), ("kvlcc2-ship", 1.0)])
def test_a_tanker_turns_within_what_imo_asks_and_is_slowed_by_it(name, scale):
    """MSC.137(76): advance below 4.5, tactical diameter below 5 lengths; a full tanker loses half its speed."""
    coefficients = _bundled(name)
    case, _ = load_case(f"{name}-turn35-starboard")
    flight = simulate(case, coefficients)
    length = flight.length
    assert case.initial.speed_mps == pytest.approx(15.5 * 0.514444 / scale**0.5, rel=1e-5)
    advance = np.interp(np.pi / 2.0, flight["psi"], flight["x"] - flight["x"][0]) / length
    diameter = np.interp(np.pi, flight["psi"], flight["y"]) / length
    assert 2.0 < advance < 4.5
    assert 2.0 < diameter < 5.0
    assert 0.1 < flight["u"][-1] / flight["u"][0] < 0.5


@pytest.mark.parametrize("side", ["starboard", "port"])
def test_turning_circles_are_those_of_the_free_model(side):
    """MARIN's free model (SIMMAN 2008) within 15 %; no free-running test entered the coefficients."""
    case, _ = load_case(f"kvlcc2-turn35-{side}")
    flight = simulate(case, _bundled("kvlcc2"))
    turned = np.abs(flight["psi"])
    found = {
        "advance_90_heading_m": np.interp(np.pi / 2.0, turned, flight["x"] - flight["x"][0]),
        "tactical_diameter_180_heading_m": np.interp(np.pi, turned, np.abs(flight["y"])),
    }
    assert [p.metric for p in case.published] == list(found)
    for p in case.published:
        assert found[p.metric] == pytest.approx(p.value, rel=0.15), p.metric


def test_zigzags_reverse_at_their_check_angle():
    case, _ = load_case("kvlcc2-zz20-20")
    flight = simulate(case, _bundled("kvlcc2"))
    assert len(flight.executes) >= 3
    at = np.interp(flight.executes[1:, 0], flight["t"], np.degrees(flight["psi"]))
    np.testing.assert_allclose(np.abs(at), 20.0, atol=0.5)
