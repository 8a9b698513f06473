"""Authority: potential flow. A boat is turned away from the flow by its Munk moment, added inertia is symmetric,
and the load of a turn acts behind the middle: the sign of one moment or force alone, wrong in one test, is named.

The boats are the bundled ones, of which nothing of the kind is found as they lie.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_campaigns import campaign as made
from made_campaigns import history

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign, evidence_of
from ident.checks.findings import Body, registered, rules
from ident.checks.potential import munk
from sim.hull.slender import spheroid

CAPTIVE = Path(__file__).parents[1] / "raw_captive_data"
CHECKS = ("munk", "reciprocal", "turning")
PUBLISHED = [
    ("suboff", "N_v", "munk"),
    ("suboff", "M_w", "munk"),
    ("suboff", "Y_ur", "turning"),
    ("suboff", "Z_uq", "turning"),
    ("suboff", "M_wdot", "reciprocal"),
    ("kvlcc2", "N_v", "munk"),
    ("kvlcc2", "Y_r", "turning"),
    ("kvlcc2", "Y_rdot", "reciprocal"),
    ("nps-auv2", "Z_qdot", "reciprocal"),
    ("remus100", "N_vdot", "reciprocal"),
]


def found(folder: Path) -> set[str]:
    return {f.check for f in check_campaign(read_campaign(folder), folder)} & set(CHECKS)


@pytest.mark.parametrize(("boat", "coefficient", "check"), PUBLISHED)
def test_a_published_value_of_the_wrong_sign_is_named(tmp_path, boat, coefficient, check):
    folder = tmp_path / boat
    shutil.copytree(CAPTIVE / boat, folder)
    assert not found(folder)
    changed = 0
    for path in folder.glob("*.csv"):
        table = pd.read_csv(path, dtype=str, keep_default_na=False)
        if "coefficient" in table:
            is_it = table["coefficient"] == coefficient
            table.loc[is_it, "value"] = table.loc[is_it, "value"].map(lambda text: repr(-float(text)))
            changed += int(is_it.sum())
            table.to_csv(path, index=False)
    assert changed == 1
    assert found(folder) == {check}


@pytest.mark.parametrize(
    ("test", "load", "check"),
    [
        ("drift_horizontal", "N", "munk"),
        ("drift_vertical", "M", "munk"),
        ("rotating_arm", "N", "turning"),
        ("rotating_arm", "M", "turning"),
        ("rotating_arm", "Y", "turning"),
    ],
)
def test_one_load_of_the_wrong_sign_in_one_test_of_bb2_is_named(campaign, test, load, check):
    evidence = evidence_of(campaign)
    (name, functions) = check, registered()[check]

    def named(runs: pd.DataFrame) -> list[str]:
        return [f.what for one in functions for f in one(replace(evidence, runs=runs), rules()[name])]

    runs = campaign.runs.copy()
    assert not named(runs)
    runs.loc[runs["test"] == test, load] *= -1.0
    (what,) = named(runs)
    assert load in what


def test_the_munk_moment_of_a_spheroid_is_lambs():
    """Without measured added mass: (k2 - k1) of the displaced mass, whatever the density."""
    length, diameter = 6.0, 1.0
    mass = 1000.0 * np.pi / 6.0 * length * diameter**2
    along, across, _ = spheroid(length, diameter)
    moment, measured = munk(Body(length, 1000.0, mass), rules()["munk"].limits)
    assert moment == pytest.approx((across - along) * mass / (500.0 * length**3), rel=1e-12)
    assert not measured
    assert munk(Body(length, 1000.0, mass), rules()["munk"].limits, 0.9 * mass, 0.05 * mass) == (
        pytest.approx(0.85 * mass / (500.0 * length**3)),
        True,
    )


def test_resistance_is_no_load_of_a_surge_oscillation(tmp_path):
    """X = -R - m udot at 2 m/s: X stays negative on both sides of the cycle, and nothing pushes along udot."""
    omega, time = 2.0 * np.pi * 0.25, np.arange(0.0, 80.0, 0.05)
    noise = np.random.default_rng(2).standard_normal(time.size)
    x = -9000.0 + 3000.0 * 0.3 * omega**2 * np.sin(omega * time) + noise
    constants = '[source.constants]\npart = "hull"\nquality = "ok"\nU = "2 m/s"\nalpha = "0 deg"\nbeta = "0 deg"\n'
    reduction = '[source.reduction]\nkind = "oscillatory"\nmotion = "surge"\nfrequency_hz = 0.25\n'
    made(tmp_path, history("surge.csv", "", constants + 'D0 = "25 m"\n', reduction))
    table = pd.DataFrame({"time_s": time, "X_N": x, "displacement_m": 0.3 * np.sin(omega * time)})
    for sign, expected in ((1.0, False), (-1.0, True)):
        # Reversed about its mean, the load does push along.
        table["X_N"] = -9000.0 + sign * (x + 9000.0)
        table.to_csv(tmp_path / "surge.csv", index=False)
        findings = check_campaign(read_campaign(tmp_path), tmp_path)
        assert any(f.check == "inertia_sign" for f in findings) == expected


@pytest.mark.parametrize(
    ("boat", "coefficient"), [("suboff", "Y_deltar"), ("suboff", "M_deltas"), ("lauv", "Z_deltas")]
)
def test_a_plane_that_lifts_the_other_way_is_named_with_its_row(tmp_path, boat, coefficient):
    """The vehicle file says which way: along span axis x leading edge, at the plane's place."""
    folder = tmp_path / boat
    shutil.copytree(CAPTIVE / boat, folder)
    for path in folder.glob("*.csv"):
        table = pd.read_csv(path, dtype=str, keep_default_na=False)
        if "coefficient" in table:
            is_it = table["coefficient"] == coefficient
            table.loc[is_it, "value"] = table.loc[is_it, "value"].map(lambda text: repr(-float(text)))
            table.to_csv(path, index=False)
    named = [f for f in check_campaign(read_campaign(folder), folder) if f.check == "plane_sign"]
    assert any(coefficient in f.what and f.severity == "error" and f.rows for f in named)


def test_runs_of_a_plane_that_lifts_the_other_way_are_named(campaign):
    evidence = evidence_of(campaign)
    runs = campaign.runs.copy()
    for sign, expected in ((1.0, set()), (-1.0, {"stern_plane_2"})):
        of_it = (runs["test"] == "plane_deflection") & (runs["part"] == "stern_plane_2")
        runs.loc[of_it, ["Y", "Z"]] *= sign
        found_ = [
            f for one in registered()["plane_sign"] for f in one(replace(evidence, runs=runs), rules()["plane_sign"])
        ]
        assert {f.what.split()[3] for f in found_} == expected
