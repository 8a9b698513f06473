"""KVLCC2 from HMRI's PMM files as they lie, against the MMG derivatives of Yasukawa and Yoshimura (2015)."""

from __future__ import annotations

import csv
import math
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from ident.captive.campaign import read_campaign
from ident.captive.quantities import HARMONICS
from ident.cli import main
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.boat.catalogue import term

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "datasets"
HMRI = DATA / "kvlcc2_hmri_pmm"
SHEETS = ("static_drift_test.csv", "pure_sway_test.csv", "pure_yaw_test.csv")
# Program norm 1/2 rho L^n to MMG's 1/2 rho L^(n-1) d: L/d of the ship, 320 m / 20.8 m.
SLENDERNESS = 320.0 / 20.8
# The MMG tests went to 20 deg of drift; a cubic does not hold to HMRI's 30 deg.
LARGEST_DRIFT = 20.0
LENGTH, MASS, YAW_INERTIA, GRAVITY = 6.8927, 3123.0, 9516.0, 0.24
# The print has three decimals.
LAST_DIGIT = 0.0005

pytestmark = pytest.mark.skipif(not HMRI.exists(), reason="the benchmark's sheets are not distributed with the program")


def _folder(where, edit=lambda text: text, rewrite=lambda name, row: row):
    """The campaign beside copies of HMRI's sheets."""
    where.mkdir()
    for name in ("kvlcc2.toml", "campaign.toml"):
        text = (ROOT / "tests" / "data" / "kvlcc2" / name).read_text("utf-8")
        (where / name).write_text(edit(text) if name == "campaign.toml" else text, "utf-8")
    for name in SHEETS:
        with (HMRI / name).open(encoding="utf-8-sig", newline="") as stream:
            rows = list(csv.DictReader(stream))
        pd.DataFrame([rewrite(name, r) for r in rows]).to_csv(where / name, index=False)
    return where


def _fit(folder):
    rows = database_rows(identify(read_campaign(folder))).set_index("coefficient")
    return {k: (rows.loc[k, "value"] * SLENDERNESS, rows.loc[k, "stderr"] * SLENDERNESS) for k in rows.index}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Coefficient -> value and standard error in MMG's norm."""
    return _fit(_folder(tmp_path_factory.mktemp("hmri") / "campaign"))


@pytest.fixture(scope="module")
def published():
    with (DATA / "kvlcc2_mmg_yasukawa2015.csv").open(encoding="utf-8") as stream:
        return {r["parameter"]: float(r["value"]) for r in csv.DictReader(stream)}


def _rudder(published):
    """Factor on the rudder's measured force RY', and where it acts [m]: with what it induces on the hull."""
    factor = 1.0 + published["a_H"]
    return factor, (-0.5 + published["a_H"] * published["x_H_dash"]) / factor * LENGTH


def _without_rudder(published):
    """The campaign with the rudder's load taken off, as a laboratory states it."""
    factor, x = _rudder(published)

    def edit(text):
        head, *sources = text.split("[[source]]\n")
        for k, source in enumerate(sources):
            kinds = [""] if "static" in source else [f"_{h}" for h in HARMONICS]
            columns = ", ".join(f'"RY{kind}\'" = "Y{kind} [-]"' for kind in kinds)
            sources[k] = f"""{source}
[[source.subtract]]
what = "rudder"
source = "its own balance; a_H and x_H of the MMG model"
columns = {{ {columns} }}
at_m = [{x!r}, 0.0, 0.0]
factor = {factor!r}

"""
        return "[[source]]\n".join([head, *sources])

    return edit


@pytest.fixture(scope="module")
def hull(tmp_path_factory, published):
    """The same with the rudder's load taken off: its measured force RY' and what it induces on the hull."""
    return _fit(_folder(tmp_path_factory.mktemp("hmri") / "hull", edit=_without_rudder(published)))


def test_a_load_taken_off_by_the_campaign_is_taken_off_the_sheets(tmp_path, published):
    """The same subtraction written into the sheets, harmonic by harmonic, in primes and about the balance."""
    factor, x = _rudder(published)

    def written(name, row):
        row = dict(row)
        for key in [k for k in row if k.startswith("RY")]:
            force, kind = float(row[key]), key[2:]
            row[f"Y{kind}"] = repr(float(row[f"Y{kind}"]) - factor * force)
            row[f"N{kind}"] = repr(float(row[f"N{kind}"]) - factor * (x - GRAVITY) / LENGTH * force)
        return row

    stated = read_campaign(_folder(tmp_path / "a", edit=_without_rudder(published))).runs
    sheets = read_campaign(_folder(tmp_path / "b", rewrite=written)).runs
    for load in ("Y", "N"):
        np.testing.assert_allclose(stated[load], sheets[load], rtol=1e-9, atol=1e-9)
    as_measured = read_campaign(_folder(tmp_path / "c")).runs
    assert np.abs(as_measured["Y"] - stated["Y"]).max() > 1.0


def _score(found, name, there):
    """Difference in standard errors."""
    value, error = found[name]
    return (value - there) / math.hypot(error, LAST_DIGIT)


def test_fit_command_on_the_files_as_they_lie(tmp_path):
    folder = tmp_path / "campaign"
    folder.mkdir()
    for name in SHEETS:
        shutil.copy(HMRI / name, folder)
    for name in ("kvlcc2.toml", "campaign.toml"):
        shutil.copy(ROOT / "tests" / "data" / "kvlcc2" / name, folder)
    done = CliRunner().invoke(main, ["fit", str(folder), "--db", str(tmp_path / "db")])
    assert done.exit_code == 0, done.output
    # 18 drift runs, four instants of each of 4 + 6 oscillations; four runs are beyond 20 deg and
    # the run at zero drift has no drift.
    assert "53 of 58 runs used" in done.output
    assert "beyond -20 to 20" in done.output
    assert "committed version 0" in done.output


@pytest.mark.parametrize("name", ["Y_v", "N_v", "Y_vvv", "N_r", "N_rrr"])
def test_derivatives_agree_with_the_published_ones(found, published, name):
    """As they lie, the rudder amidships included."""
    assert abs(_score(found, name, published[name])) < 2.0, found[name]


@pytest.mark.parametrize("with_rudder", [True, False])
def test_added_masses_agree_with_the_published_ones(found, hull, published, with_rudder):
    """The model's own mass and inertia, more than half of what was measured, are taken off."""
    ours = found if with_rudder else hull
    for name, symbol in (("Y_vdot", "m_y_dash"), ("N_rdot", "J_z_dash")):
        assert abs(_score(ours, name, -published[symbol])) < 2.0, (name, ours[name])
        assert ours[name][1] < 0.15 * abs(ours[name][0])


def test_yaw_of_the_hull_alone_agrees_with_the_published_one(found, hull, published):
    """MMG writes m_x u r beside Y_r; measured loads have it inside: Y_r of a run is Y_r - m_x.

    With the rudder in it does not agree: in yaw the rudder gives a quarter of the force.
    """
    whole = published["Y_r"] - published["m_x_dash"]
    assert abs(_score(hull, "Y_r", whole)) < 2.0, hull["Y_r"]
    assert abs(_score(found, "Y_r", whole)) > 2.0, found["Y_r"]
    for name in ("Y_vvv", "Y_rrr", "N_rrr"):
        assert abs(_score(hull, name, published[name])) < 2.0, (name, hull[name])


def test_what_does_not_agree_and_by_how_much(found, hull, published):
    """Not within the standard errors, whatever is done: two tanks, two models, one ship.

    N_vvv differs in sign in every reading: with the rudder or without, about midship or the
    centre of gravity, to 12 or 30 deg. HMRI's N/v falls by a seventh from 4 to 20 deg, the
    published one is level. The hull alone, which is what MMG derivatives are of, has Y_v 14 %
    smaller and N_v 13 % larger than printed, N_r 18 % smaller: that the two linear drift
    derivatives agree with the rudder in is partly chance.
    """
    for ours in (found, hull):
        assert ours["N_vvv"][0] > 0.1 > published["N_vvv"]
        assert _score(ours, "N_vvv", published["N_vvv"]) > 4.0
    for name, low, high in (("Y_v", 0.80, 0.90), ("N_v", 1.08, 1.18), ("N_r", 0.75, 0.90)):
        assert low < hull[name][0] / published[name] < high, (name, hull[name])


@pytest.mark.parametrize("degrees", [5.0, 10.0, 15.0, LARGEST_DRIFT])
def test_moment_of_the_hull_over_the_published_drift_range(hull, published, degrees):
    """The cubics differ, the moments they stand for by 13 % at most, by 7 % at 20 deg."""
    v = -math.sin(math.radians(degrees))
    here = hull["N_v"][0] * v + hull["N_vvv"][0] * v**3
    there = published["N_v"] * v + published["N_vvv"] * v**3
    assert here == pytest.approx(there, rel=0.07 if degrees == LARGEST_DRIFT else 0.13)


def test_the_models_own_inertia_is_the_difference_it_makes(found, tmp_path):
    def left_in(text):
        start = text.index("[inertia]")
        stop = text.index("[uncertainty]")
        return text[:start] + "[inertia]\nmodel_inertia_in_loads = false\n\n" + text[stop:]

    raw = _fit(_folder(tmp_path / "raw", left_in))
    mass = MASS / (500.0 * LENGTH**3) * SLENDERNESS
    inertia = (YAW_INERTIA + MASS * 0.24**2) / (500.0 * LENGTH**5) * SLENDERNESS
    # Errors are relative to the measured load in both, so the fits have the same weights.
    assert raw["Y_vdot"][0] - found["Y_vdot"][0] == pytest.approx(-mass, rel=1e-6)
    assert raw["N_rdot"][0] - found["N_rdot"][0] == pytest.approx(-inertia, rel=1e-6)
    assert raw["Y_vdot"][1] == pytest.approx(found["Y_vdot"][1], rel=1e-6)


def test_moment_point_is_where_added_mass_is_reciprocal(hull, published, tmp_path):
    """N_vdot = Y_rdot for any hull, which the rudder's wake-delayed force is no part of.

    Moments about a point x ahead of midship give N_vdot = N_vdot(0) + x Y_vdot(measured).
    """

    def midship(text):
        return text.replace("x_m = 0.24", "x_m = 0.0")

    error = math.hypot(hull["N_vdot"][1], hull["Y_rdot"][1])
    gap = hull["N_vdot"][0] - hull["Y_rdot"][0]
    assert abs(gap) < error
    assert hull["N_vdot"][0] < 0.0
    there = _fit(_folder(tmp_path / "midship", midship))
    step = there["N_vdot"][0] - _fit(_folder(tmp_path / "gravity"))["N_vdot"][0]
    point = GRAVITY * (1.0 + gap / step)
    assert point == pytest.approx(GRAVITY, abs=0.02)
    assert abs(step) > 10.0 * error


def test_mmg_norm_in_the_files_gives_the_same_coefficients(found, tmp_path):
    """Loads over 1/2 rho L d U^2 instead of 1/2 rho L^2 U^2, said by the campaign."""

    def rescaled(name, row):
        loads = [k for k in row if k[:2] in ("Y'", "N'", "Y_", "N_")]
        return row | {k: repr(float(row[k]) * LENGTH / 0.448) for k in loads}

    other = _fit(_folder(tmp_path / "mmg", lambda text: text.replace("half_rho_L2", "half_rho_Ld"), rewrite=rescaled))
    assert set(other) == set(found)
    for name, (value, error) in found.items():
        assert other[name] == pytest.approx((value, error), rel=1e-9), name


def test_powers_of_the_mmg_terms_are_those_of_the_published_form():
    """1/2 rho L d U^2 C v'^a r'^b with r' = r L/U: one more L than d, and one a rate."""
    for name in ("Y_v", "Y_vvv", "Y_r", "Y_vvr", "Y_vrr", "Y_rrr", "N_v", "N_vvv", "N_r", "N_vvr", "N_vrr", "N_rrr"):
        row = term(name, "mmg")
        rates = name.split("_")[1].count("r")
        assert row.power == 2 + (name[0] == "N") + rates, name
