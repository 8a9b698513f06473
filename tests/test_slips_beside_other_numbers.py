"""Authority: what another number of the same campaign says. A moment of a load that acts elsewhere than its part is, a
level that no other series has, the digits of another file under another unit, an added mass below what is moved at the
least both ways: each is named, and the boats as they lie have none of it.
"""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_copies import copied

from ident.captive.campaign import read_campaign
from ident.captive.run_table import run_table
from ident.checks.check import check_campaign, evidence_of
from ident.checks.findings import Body, Evidence, registered, rules
from ident.checks.levels import one_level_off_the_grid, speeds_for_depths
from ident.checks.rows import loads_that_fall_as_their_motion_grows
from ident.checks.zeros import means_of_oscillations
from sim.boat.vehicle import load_vehicle
from sim.hull.slender import spheroid

ROOT = Path(__file__).parents[1]
KNOT = 0.514444
CHECKS = (
    *("added_mass", "between_tests", "errors", "levers", "model_inertia", "open_water", "proportion", "rows"),
    *("side_force", "units", "zero_reading"),
)


@pytest.fixture
def place(tmp_path):
    """Copies a campaign, by name."""
    return partial(copied, tmp_path)


def found(folder: Path) -> list[tuple[str, str, str]]:
    findings = check_campaign(read_campaign(folder), folder)
    return [(f.check, f.severity, f.what) for f in findings if f.check in CHECKS and f.severity != "info"]


def times(column: str, factor: float, rows: str = ""):
    """A column of runs whose name begins so times a factor."""

    def change(table: pd.DataFrame) -> None:
        some = table["run_id"].str.startswith(rows) & (table[column] != "")
        assert some.any()
        table.loc[some, column] = [repr(float(x) * factor) for x in table.loc[some, column]]

    return change


def plus(column: str, more: float):
    def change(table: pd.DataFrame) -> None:
        table[column] = [repr(float(x) + more) for x in table[column]]

    return change


def renamed(old: str, new: str):
    def change(table: pd.DataFrame) -> None:
        assert old in table
        table.columns = [new if c == old else c for c in table.columns]

    return change


def exchanged(one: str, other: str):
    def change(table: pd.DataFrame) -> None:
        table[[one, other]] = table[[other, one]].to_numpy()

    return change


def put(run: str, column: str, text: str):
    def change(table: pd.DataFrame) -> None:
        assert (table["run_id"] == run).any()
        table.loc[table["run_id"] == run, column] = text

    return change


def without(*runs: str):
    def change(table: pd.DataFrame) -> pd.DataFrame:
        gone = table["run_id"].isin(runs)
        assert gone.sum() == len(runs)
        return table[~gone]

    return change


DRIFT = "drift_horizontal.csv"
SLIPS = {
    "a side moment's sign": (
        "bb2", "propeller_side_force.csv", times("M_Nm", -1.0), "side_force", "error", "load at x = 0.53 L"),
    "a roll moment's sign": ("bb2", DRIFT, times("K_Nm", -1.0), "levers", "warning", "m below the axis"),
    "digits of an angle": (
        "bb2", DRIFT, put("HD-4-03-12", "beta_deg", "21"), "rows", "warning", "have 12 in its place"),
    "knots in one file": ("bb2", "estimates.csv", renamed("U_mps", "U_kts"), "units", "warning", "under two units"),
    "degrees in one file": (
        "bb2", "propeller_side_force.csv", renamed("q_radps", "q_degps"), "units", "warning", "under two units"),
    "a moment point above the sail": ("bb2", DRIFT, times("K_Nm", 8.0), "levers", "warning", "m above the axis"),
    "speeds for depths": ("starter", "arm_p.csv", exchanged("U_mps", "D0_m"), "units", "warning", "change places"),
    "a test of another file": (
        "starter", DRIFT, put("drift_horizontal-04", "test", "rotating_arm"), "rows", "warning", "has no p, q, r"),
    "a rate that was lost": (
        "starter", "rotation_q.csv", put("rotation_q-04", "q_radps", "0."), "rows", "warning", "without speed, rate"),
    "an exclude that was lost": (
        "suboff", "stand_in_propeller.csv", put("OW-0.0", "exclude", ""), "rows", "warning", "uses KQ"),
    "pounds in a turn with drift": (
        "starter", "arm_r.csv", times("Y_N", 1.0 / 4.4482216152605), "proportion", "warning", "Y_v|r|"),
    "a flow from the other side": (
        "bb2", "rotating_arm.csv", times("alpha_deg", -1.0, "RA-w"), "proportion", "warning", "X_wq"),
    "a thrust deduction of twice": (
        "bb2", "self_propulsion.csv", times("t", 1.0 / KNOT), "proportion", "warning", "t = 0."),
    "a torque of rpm": ("remus100", "published.csv", put("P01-Kprop", "value", "-1.62"), "proportion", "error", "K_nn"),
    "digits exchanged": (
        "remus100", "published.csv", put("P01-Nura", "value", "1.39"), "proportion", "warning", "N_ura"),
    "half of every added mass": (
        "remus100", "published.csv", times("value", 0.55), "added_mass", "warning", "geometric mean"),
    "half of one plane's": ("suboff", "published.csv", times("value", KNOT), "added_mass", "warning", "geometric mean"),
    "an acceleration of twice": (
        "starter", "acceleration_rdot.csv", times("rdot_radps2", 1.0 / KNOT), "proportion", "warning", "N_rdot"),
    "a zero in X": ("starter", DRIFT, plus("X_N", 9.0), "between_tests", "warning", "straight ahead is off"),
    "a zero in X of towing": (
        "bb2", "towing.csv", plus("X_N", 20000.0), "between_tests", "warning", "straight ahead is off"),
    "the end of a curve": (
        "starter", "open_water.csv", without("OW-0.8", "OW-1.0"), "open_water", "warning", "beyond the open-water"),
    "thrust of half at rest": (
        "starter", "open_water.csv", times("KT", 0.6), "open_water", "warning", "at J = 0"),
    "torque of half at rest": (
        "starter", "open_water.csv", times("KQ", 0.4), "open_water", "error", "at J = 0"),
    "a curve of way astern": (
        "suboff", "stand_in_propeller.csv", times("J", -1.0), "open_water", "error", "of none above"),
    "a thrust of the row beside": (
        "starter", "open_water.csv", put("OW-0.2", "KT", "0.45"), "open_water", "warning", "at J = 0, 0.2"),
    "a drift test of the other angle": (
        "starter", DRIFT, lambda t: t.assign(test="drift_vertical"), "rows", "warning", "beta and none has alpha"),
    "an error of the whole load": (
        "starter", "rudders.csv", put("rudders-06", "rel_sigma", "0.902"), "errors", "warning", "hardly count"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_named(place, slip):
    boat, name, change, check, severity, words = SLIPS[slip]
    path = place(boat) / name
    before = [f for f in found(path.parent) if f[0] == check]
    assert not any(words in what for _, _, what in before)
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    changed = change(table)
    (table if changed is None else changed).to_csv(path, index=False)
    named = [(s, what) for c, s, what in found(path.parent) if c == check]
    assert any(s == severity and words in what for s, what in named), named


def test_a_quality_word_that_leaves_nothing_is_named(place):
    header = place("starter") / "campaign.toml"
    text = header.read_text("utf-8")
    assert "factor = 1.0" in text
    header.write_text(text.replace("factor = 1.0", "factor = 40.0", 1), "utf-8")
    assert ("errors", "warning") in [f[:2] for f in found(header.parent)]


@pytest.mark.parametrize(
    ("span", "named"), [([-20.0, 20.0], 0), ([0.0, 20.0], 0), ([-2.0, 20.0], 1), ([-200.0, 20.0], 1)]
)
def test_a_range_of_drift_is_the_same_to_both_sides(place, span, named):
    campaign = read_campaign(place("starter"))
    source = campaign.header.source[0].model_copy(update={"within": {"beta_deg": span, "alpha_deg": [-3.0, 9.0]}})
    header = campaign.header.model_copy(update={"source": [source]})
    functions = {f.__name__: f for f in registered()["symmetry"]}
    evidence = evidence_of(replace(campaign, header=header))
    findings = list(functions["ranges_of_two_sides"](evidence, rules()["symmetry"]))
    assert [f.columns for f in findings] == [("source.within.beta_deg",)] * named


def test_a_term_whose_only_value_is_excluded_is_missing(place):
    path = place("remus100") / "published.csv"
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    left = table[table["run_id"] != "P01-Yvv-corrected"]
    assert len(left) == len(table) - 1
    assert (left["coefficient"] == "Y_v|v|").any()
    left.to_csv(path, index=False)
    campaign = read_campaign(path.parent)
    said = [f.what for f in check_campaign(campaign, path.parent) if f.check == "missing"]
    assert any("Y_v|v|" in what for what in said), said


# -- the least added mass --------------------------------------------------------------------------


@pytest.mark.parametrize(("flat", "share", "named"), [(1.0, 1.0, 0), (9.0, 1.0, 0), (9.0, 0.6, 1), (1.0, 0.6, 1)])
def test_an_ellipsoid_has_the_mean_of_its_spheroid_however_flat(flat, share, named):
    """Of an ellipse of half axes a and b the added masses are pi b^2 and pi a^2 (Newman 1977, Table 4.3)."""
    vehicle = load_vehicle("suboff")
    length, mass, density = 4.0, 300.0, 1000.0
    diameter = np.sqrt(6.0 * mass / density / np.pi / length)
    _, across, _ = spheroid(length, diameter)
    mean = share * across * mass / (0.5 * density * length**3)
    values = {"Y_vdot": -mean / flat, "Z_wdot": -mean * flat}
    constants = pd.DataFrame([{"coefficient": n, "part": "hull", "value": v, "stderr": 0.0} for n, v in values.items()])
    evidence = Evidence(body=Body(length, density, mass), vehicle=vehicle, constants=constants)
    functions = {f.__name__: f for f in registered()["added_mass"]}
    findings = list(functions["both_ways_together"](evidence, rules()["added_mass"]))
    assert len(findings) == named


# -- the grid of a test --------------------------------------------------------------------------


def grid(change: dict[int, float], speeds=(1.0, 2.0, 3.0, 4.0)) -> list[str]:
    rows = [(u, b) for u in speeds for b in (2.0, 4.0, 8.0, 12.0)]
    rows = [(u, change.get(k, b)) for k, (u, b) in enumerate(rows)]
    runs = {
        "run_id": [f"r{k}" for k in range(len(rows))], "test": "drift_horizontal", "part": "hull", "file": "d.csv",
        "U": [u for u, _ in rows], "beta": np.deg2rad([b for _, b in rows]), "Y": [-u * u * b for u, b in rows],
    }  # fmt: skip
    evidence = Evidence(runs=run_table(runs))
    return [f.what for f in one_level_off_the_grid(evidence, rules()["rows"])]


def test_one_level_in_the_place_of_another_is_named():
    (what,) = grid({7: 21.0})
    assert re.search(r"run r7 has beta = 21, and the 3 other series of its test have 12", what)
    assert grid({}) == []
    # Two series of their own are a plan, not a slip; of two series nobody knows which is odd.
    assert grid({7: 21.0, 11: 20.0}) == []
    assert grid({3: 21.0}, (1.0, 2.0)) == []


@pytest.mark.parametrize(("depth", "named"), [(3.333, 1), (3.0, 0)])
def test_round_speeds_may_be_depths_elsewhere(place, depth, named):
    campaign = read_campaign(place("starter"))
    scale = campaign.header.scale.ratio
    runs = run_table(
        {
            "run_id": ["a", "b", "c"], "test": "towing", "part": "hull", "file": ["t.csv", "t.csv", "d.csv"],
            "U": [1.5 * scale**0.5, 1.5 * scale**0.5, depth * scale**0.5],
            "D0": [depth * scale, depth * scale, 1.5 * scale],
        }
    )  # fmt: skip
    findings = list(speeds_for_depths(replace(evidence_of(campaign), runs=runs), rules()["units"]))
    assert {f.file for f in findings} == ({"t.csv", "d.csv"} if named else set())


# -- loads in the order of their motion --------------------------------------------------------------


def turned(loads: list[float]) -> list[str]:
    runs = {
        "run_id": [f"r{k}" for k in range(len(loads))], "test": "rotating_arm", "part": "hull", "file": "a.csv",
        "U": 2.0, "r": [0.01 * (k + 1) for k in range(len(loads))], "N": loads,
    }  # fmt: skip
    evidence = Evidence(runs=run_table(runs))
    return [f.what for f in loads_that_fall_as_their_motion_grows(evidence, rules()["rows"])]


def test_a_load_that_falls_as_its_motion_grows_is_named():
    loads = [-1.0, -2.1, -3.3, -4.6, -6.2, -8.0]
    assert turned(loads) == []
    (what,) = turned(sorted(loads))
    assert "N falls from -8 to -1 as r grows over 6 sizes" in what
    assert turned(sorted(loads)[:3]) == []


# -- means of oscillations -------------------------------------------------------------------------


@pytest.mark.parametrize(("mean", "beta", "named"), [(0.0, 0.0, 0), (0.1, 0.0, 0), (0.6, 0.0, 1), (0.6, 8.0, 0)])
def test_a_side_force_on_both_sides_of_a_sway_is_named(mean, beta, named):
    """Symmetry: what port and starboard have in common of Y, K or N is nothing, unless the hull drifts."""
    rate = [0.1, -0.1, 0.0, 0.0]
    runs = {
        "run_id": ["s+a", "s-a", "s+v", "s-v"], "test": "acceleration", "part": "hull", "file": "s.csv",
        "vdot": rate, "beta": np.deg2rad([beta, beta, beta + 3.0, beta - 3.0]),
        "Y": [mean - 0.4, mean + 0.4, -1.0, 1.0],
        "s_Y": 0.01, "U": 2.0,
    }  # fmt: skip
    findings = list(means_of_oscillations(Evidence(runs=run_table(runs)), rules()["zero_reading"]))
    assert len(findings) == named


# -- the model's own inertia -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({}, []),
        ({"centre_of_gravity_m": [0.9, 0.0, 0.0]}, ["inertia.centre_of_gravity_m"]),
        ({"centre_of_gravity_m": [0.0, 0.3, 0.0]}, ["inertia.centre_of_gravity_m"]),
        # A model without its ballast is no floating body.
        ({"centre_of_gravity_m": [0.9, 0.0, 0.0], "mass_kg": 200.0}, ["inertia.tensor_kgm2"]),
        ({"tensor_kgm2": [1.0, 1.0, 2e5]}, ["inertia.tensor_kgm2"]),
    ],
)
def test_a_model_that_floats_has_its_weight_below_its_buoyancy(place, change, named):
    campaign = read_campaign(place("starter"))
    scale, particulars = campaign.header.scale, campaign.vehicle.particulars
    mass = particulars.displaced_mass.value / scale.ratio**3
    radius = 0.25 * scale.length_m
    given = {
        "model_inertia_in_loads": True, "mass_kg": mass, "centre_of_gravity_m": [0.0, 0.0, 0.0],
        "tensor_kgm2": [0.01 * mass, mass * radius**2, mass * radius**2], "source": "made",
    }  # fmt: skip
    inertia = campaign.header.inertia.model_copy(update=given | change)
    header = campaign.header.model_copy(update={"inertia": inertia})
    (function,) = registered()["model_inertia"]
    evidence = evidence_of(replace(campaign, header=header))
    seen = [c for f in function(evidence, rules()["model_inertia"]) for c in f.columns]
    assert list(dict.fromkeys(seen)) == named


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_no_quality_word_excuses_a_plane_moment_of_another_unit(tmp_path, factor):
    """The rows that carry the planes' lift on have three times their errors; a moment in kN m is none of them."""
    folder = tmp_path / "bb2"
    shutil.copytree(ROOT / "raw_captive_data" / "bb2", folder)
    path = folder / "plane_lift_continued.csv"
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    table["M_Nm"] = [f"{factor * float(x):.6g}" for x in table["M_Nm"]]
    table.to_csv(path, index=False)
    listed = [f for f in check_campaign(read_campaign(folder), folder) if f.severity == "error"]
    # Four stern planes and the pair on the sail.
    assert [(f.check, f.file, f.columns) for f in listed] == [("levers", "plane_lift_continued.csv", ("M",))] * 5
