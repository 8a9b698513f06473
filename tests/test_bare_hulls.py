"""A bare hull has no propeller and no sail: its tests are fitted without them, and what needs them asks for them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from small_campaign import HEADER

import sim
from ident.captive.campaign import read_campaign
from ident.identification.identify import identify
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.simulate import initial_state

ROWS = """run_id,test,part,U_mps,alpha_deg,beta_deg,X_N,Y_N,N_Nm,rel_sigma,quality,source
a,drift_horizontal,hull,2,0,-6,-40,110,240,0.03,as_published,made
b,drift_horizontal,hull,2,0,0,-38,0,0,0.03,as_published,made
d,drift_horizontal,hull,2,0,3,-38.5,-53,-121,0.03,as_published,made
e,drift_horizontal,hull,2,0,-3,-38.5,53,121,0.03,as_published,made
c,drift_horizontal,hull,2,0,6,-40,-110,-240,0.03,as_published,made
"""


@pytest.fixture
def bare(tmp_path) -> Path:
    text = (Path(sim.__file__).parent / "vehicles" / "suboff.toml").read_text("utf-8")
    text = re.sub(r"(?ms)^\[propeller\].*?(?=^\[)", "", text)
    text = re.sub(r"(?ms)^\[\[planes\]\].*?(?=^\[|\Z)", "", text)
    text = re.sub(r"(?m)^sail_top = .*\n", "", text)
    (tmp_path / "bare.toml").write_text(text, "utf-8")
    head = HEADER.replace('vehicle = "bb2"', 'vehicle = "bare.toml"').replace("length_m = 70.2", "length_m = 4.2609")
    (tmp_path / "campaign.toml").write_text(head, "utf-8")
    (tmp_path / "runs.csv").write_text(ROWS, "utf-8")
    return tmp_path


def test_a_bare_hull_is_fitted(bare):
    vehicle = load_vehicle(bare / "bare.toml")
    assert vehicle.part_names() == ["hull"]
    assert {t.part for t in vehicle_terms(vehicle)} <= {"hull", "section"}
    found = identify(read_campaign(bare))
    assert {"Y_v", "N_v", "X_uu"} <= {n.name for n in found.nodes}


def test_what_needs_a_propeller_or_a_sail_top_asks_for_it(bare):
    vehicle = load_vehicle(bare / "bare.toml")
    with pytest.raises(InputError, match=r"key propeller: nothing .*a flight needs it"):
        vehicle.needed_propeller("a flight")
    with pytest.raises(InputError, match=r"key propeller: nothing .*self-propulsion needs it"):
        initial_state(load_case("hzz20")[0], vehicle, None)
    with pytest.raises(InputError, match=r"particulars\.sail_top"):
        vehicle.needed_sail_top("a depth")
    (bare / "runs.csv").write_text(ROWS.replace("a,drift_horizontal,hull", "a,drift_horizontal,propeller"), "utf-8")
    with pytest.raises(InputError, match="'propeller' "):
        read_campaign(bare)
