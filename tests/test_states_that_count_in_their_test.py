"""A state that no coefficient of a run's test depends on is refused, and so is a part that the test says nothing of.

The columns are those of the run table and the tests those of the program's list, so that a new one without a word on
what counts in it fails.
"""

from __future__ import annotations

import math
from itertools import product

import pytest
from made_campaigns import campaign

from ident.captive import known_tests
from ident.captive.campaign import read_campaign
from ident.captive.run_table import MOTION, STATES
from ident.checks.check import check_campaign
from sim.files.errors import InputError

# Test -> a run that has what it requires.
RUNS = {
    "open_water": {"part": "propeller", "J": 0.4, "KT": 0.3, "KQ": 0.04},
    "towing": {"part": "hull", "U_mps": 5, "D0_m": 25, "X_N": -70000},
    "drift_vertical": {"part": "hull", "U_mps": 5, "alpha_deg": 4, "beta_deg": 0, "D0_m": 25, "Z_N": -70000},
    "drift_horizontal": {"part": "hull", "U_mps": 5, "alpha_deg": 0, "beta_deg": 4, "D0_m": 25, "Y_N": -3e5},
    "plane_deflection": {"part": "sail_planes", "U_mps": 5, "plane_deg": 5, "D0_m": 25, "Z_N": -3e4},
    "pure_rotation": {"part": "hull", "U_mps": 0, "q_radps": 0.01, "D0_m": 25, "M_Nm": -4e5},
    "rotating_arm": {"part": "hull", "U_mps": 5, "alpha_deg": 0, "beta_deg": 0, "r_radps": 0.01, "D0_m": 25,
                     "N_Nm": -2e6},
    "acceleration": {"part": "hull", "U_mps": 0, "D0_m": 25, "vdot_mps2": 0.5, "Y_N": -2e6},
    "propeller_side_force": {"part": "propeller", "U_mps": 5, "r_radps": 0.004, "D0_m": 25, "Y_N": -2600},
    "self_propulsion": {"part": "propeller", "U_mps": 5, "D0_m": 25, "t": 0.2},
}  # fmt: skip
UNITS = {"U": "U_mps", "alpha": "alpha_deg", "beta": "beta_deg", "D0": "D0_m", "plane": "plane_deg", "n": "n_rps",
         "J": "J", "R0": "R0_m", **{k: f"{k}_radps" for k in "pqr"}, "decoupled": "decoupled"}  # fmt: skip
ANY = {"decoupled": "True", "R0": 500.0, "n": 1.0, "J": 0.4}


def written(folder, test: str, run: dict[str, object]) -> None:
    row = {"run_id": "a", "test": test, "quality": "ok", "source": "s", "rel_sigma": 0.05, **run}
    campaign(folder)
    (folder / "runs.csv").write_text(",".join(row) + "\n" + ",".join(map(str, row.values())) + "\n", "utf-8")


def test_every_test_has_a_run_here():
    assert set(RUNS) == set(known_tests.tests().index) - {"published_derivative"}
    assert set(STATES[1:7]) | set(MOTION[:3]) <= set(UNITS)


@pytest.mark.parametrize(("test", "state"), list(product(RUNS, [s for s in UNITS if s not in ("U", "D0")])))
def test_a_state_counts_in_its_test_or_is_refused(tmp_path, test, state):
    written(tmp_path / "as_it_is", test, RUNS[test])
    read_campaign(tmp_path / "as_it_is")
    more = {} if UNITS[state] in RUNS[test] else {UNITS[state]: ANY.get(state, 0.004)}
    if state == "R0" and test == "rotating_arm":
        more = {"R0_m": 500.0}
    # Speed and revolutions of an open-water test make the advance together; at rest there is no angle of flow.
    if state == "n" and test == "open_water":
        more |= {"U_mps": 2.0}
    if state in ("alpha", "beta") and not RUNS[test].get("U_mps"):
        return
    written(tmp_path / "more", test, {**RUNS[test], **more})
    if state in known_tests.states(test):
        assert len(read_campaign(tmp_path / "more").runs) == 1
        return
    with pytest.raises(InputError, match=rf"column {state}: .*declared and unused"):
        read_campaign(tmp_path / "more")


@pytest.mark.parametrize("test", ["towing", "drift_horizontal", "rotating_arm", "acceleration"])
def test_a_hulls_test_of_the_propeller_is_refused_and_not_dropped(tmp_path, test):
    written(tmp_path, test, {**RUNS[test], "part": "propeller"})
    with pytest.raises(InputError, match=r"column part: 'propeller', and its loads would be left out") as refused:
        read_campaign(tmp_path)
    assert "hull" in refused.value.allowed


def test_levers_of_a_plane_are_refused(tmp_path):
    written(tmp_path, "plane_deflection", {**RUNS["plane_deflection"], "x_m": 9.0, "y_m": 0.0, "z_m": 0.0})
    with pytest.raises(InputError, match="column x: 9, declared and unused"):
        read_campaign(tmp_path)


def test_a_file_without_a_speed_is_a_message(tmp_path):
    run = {k: v for k, v in RUNS["drift_horizontal"].items() if k != "U_mps"}
    written(tmp_path, "drift_horizontal", run)
    with pytest.raises(InputError, match="column U: nothing"):
        read_campaign(tmp_path)


def test_speed_and_revolutions_of_an_open_water_test_make_its_advance(tmp_path):
    campaign(tmp_path)
    head = "run_id,test,part,quality,source,rel_sigma,J,U_mps,n_rps,KT,KQ\n"

    def findings(slip: float) -> list[str]:
        rows = [(j, 15.0 * 0.2 * j * (slip if j == 0.6 else 1.0), 0.45 - 0.35 * j, 0.06 - 0.04 * j)
                for j in (0.2, 0.4, 0.6, 0.8)]  # fmt: skip
        text = "".join(f"o{j},open_water,propeller,ok,s,0.02,{j},{u!r},15,{kt!r},{kq!r}\n" for j, u, kt, kq in rows)
        (tmp_path / "open.csv").write_text(head + text, "utf-8")
        return [f.what for f in check_campaign(read_campaign(tmp_path), tmp_path) if f.check == "open_water"]

    assert not findings(1.0)
    (what,) = findings(1.1)
    assert "at J = 0.6" in what
    (tmp_path / "open.csv").write_text(head + "o,open_water,propeller,ok,s,0.02,0.4,3,,0.3,0.04\n", "utf-8")
    with pytest.raises(InputError, match=r"column U: 3\.0, declared and unused .*U and n together"):
        read_campaign(tmp_path)


def test_revolutions_beside_a_side_force_are_named_and_a_turn_of_no_size_too(tmp_path):
    written(tmp_path / "n", "drift_horizontal", {**RUNS["drift_horizontal"], "n_rps": 1.5})
    (one,) = [f for f in check_campaign(read_campaign(tmp_path / "n"), tmp_path / "n") if f.check == "propeller_on"]
    assert one.severity == "info"
    assert "1.5 to 1.5 rev/s" in one.what
    # Radius over length, taken for metres.
    written(tmp_path / "r", "rotating_arm", {**RUNS["rotating_arm"], "r_radps": "", "R0_m": 4.0})
    named = [f.what for f in check_campaign(read_campaign(tmp_path / "r"), tmp_path / "r") if f.check == "state"]
    assert any(f"a radius of {4.0 / 70.2:.2g} lengths" in what for what in named)
    assert math.isclose(4.0 / 70.2, 0.057, rel_tol=0.01)
