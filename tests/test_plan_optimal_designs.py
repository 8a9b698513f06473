"""Authority: D-optimal designs with a known closed form, and Monte Carlo of ``identify``.

Closed forms after Atkinson, Donev and Tobias (2007), *Optimum experimental designs*, ch. 11:
a straight line is measured at its ends, a quadratic at -1, 0, 1, a cubic at -1, 1 and
1/sqrt(5) either side, two factors with interaction at the four corners.
"""

from __future__ import annotations

import json
import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from ident.captive.campaign import read_campaign
from ident.captive.campaign_file import MotionPoint
from ident.cli import main
from ident.identification.identify import identify
from ident.identification.solver import Solver
from ident.planning.candidates import Facility, Levels, planned_tests, read_facility
from ident.planning.design import Design, d_optimal, fewest_runs
from ident.planning.matrix import matrix
from ident.planning.plan import make_plan, planned_campaign
from sim.boat.catalogue import OUTPUTS
from sim.boat.forces import multiplier
from sim.files.errors import InputError

BB2 = Path(__file__).parents[1] / "raw_captive_data" / "bb2"
LINE = np.linspace(-1.0, 1.0, 41)


def polynomial(order, points=LINE):
    return [np.array([[x**k for k in range(order + 1)]]) for x in points]


def weak(n):
    return 1e-9 * np.eye(n)


def support(counts, points=LINE):
    return {round(float(points[i]), 6): int(counts[i]) for i in np.flatnonzero(counts)}


# -- closed forms ------------------------------------------------------------------------


@pytest.mark.parametrize("runs", [2, 8, 20])
def test_a_straight_line_is_measured_at_its_ends(runs):
    assert support(d_optimal(polynomial(1), runs, weak(2))) == {-1.0: runs // 2, 1.0: runs // 2}


@pytest.mark.parametrize("runs", [3, 6, 30])
def test_a_quadratic_is_measured_by_thirds_at_the_ends_and_the_middle(runs):
    third = runs // 3
    assert support(d_optimal(polynomial(2), runs, weak(3))) == {-1.0: third, 0.0: third, 1.0: third}


def test_a_cubic_is_measured_at_the_roots_of_legendre():
    points = np.linspace(-1.0, 1.0, 2001)
    found = support(d_optimal(polynomial(3, points), 8, weak(4)), points)
    assert sorted(found) == pytest.approx([-1.0, -1.0 / math.sqrt(5.0), 1.0 / math.sqrt(5.0), 1.0], abs=1.1e-3)
    assert set(found.values()) == {2}


def test_two_factors_are_measured_at_the_corners():
    grid = np.linspace(-1.0, 1.0, 5)
    places = [(a, b) for a in grid for b in grid]
    counts = d_optimal([np.array([[1.0, a, b, a * b]]) for a, b in places], 8, weak(4))
    assert {places[i]: counts[i] for i in np.flatnonzero(counts)} == {
        (a, b): 2 for a in (-1.0, 1.0) for b in (-1.0, 1.0)
    }


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_no_run_tells_more_than_the_number_of_unknowns(order):
    """Kiefer and Wolfowitz: at the optimum the largest x' V x times the runs is the number of unknowns."""
    candidates, runs = polynomial(order), 12 * (order + 1)
    design = Design(candidates, weak(order + 1))
    design.counts[:] = d_optimal(candidates, runs, weak(order + 1))
    design.refresh()
    worst = max(float(x[0] @ design.covariance @ x[0]) for x in candidates) * runs
    assert worst == pytest.approx(order + 1, rel=0.01)


def test_what_is_known_before_counts():
    known = np.diag([1e6, 1e-9])  # the level is known: one end tells the slope as well as the other
    counts = d_optimal(polynomial(1), 5, known)
    assert sum(n for x, n in support(counts).items() if abs(x) == 1.0) == 5


def test_updates_keep_the_covariance_and_gains_are_determinants():
    random = np.random.default_rng(3)
    blocks = [random.normal(size=(2, 4)) for _ in range(12)]
    design = Design(blocks, np.eye(4))
    for i in (0, 5, 5, 7):
        before = np.linalg.slogdet(np.linalg.inv(design.covariance))[1]
        gain = design.gains()[i]
        design.change(i, 1)
        assert np.linalg.slogdet(np.linalg.inv(design.covariance))[1] - before == pytest.approx(gain, rel=1e-9)
    design.change(5, -1)
    updated = design.covariance.copy()
    design.refresh()
    assert updated == pytest.approx(design.covariance, rel=1e-9)


@pytest.mark.parametrize("target", [0.05, 0.03])
def test_the_fewest_runs_for_a_slope(target):
    """Standard error of a slope from n runs at the ends is sigma / sqrt(n)."""
    sigma = 0.1
    counts = fewest_runs([x / sigma for x in polynomial(1)], weak(2), np.array([np.inf, target]), most=50)
    # Unequal ends: 4 n1 n2 / (n1 + n2) is the information.
    assert counts.sum() == math.ceil((sigma / target) ** 2)


def test_a_target_out_of_reach_ends_near_the_best():
    sigma, most = 0.1, 4
    counts = fewest_runs([x / sigma for x in polynomial(0, LINE[:2])], weak(1), np.array([1e-6]), most, patience=1.2)
    best = sigma / math.sqrt(2 * most)
    assert sigma / math.sqrt(counts.sum()) <= 1.2 * best
    assert counts.sum() == 6


# -- against identify --------------------------------------------------------------------


@pytest.fixture(scope="module")
def rotations():
    """The bundled campaign's own runs of pure rotation, no copies."""
    campaign = read_campaign(BB2)
    runs = campaign.runs
    runs = runs[(runs["test"] == "pure_rotation") & (runs["copy_of"] == "")].iloc[::2]
    return replace(campaign, runs=runs.reset_index(drop=True))


@pytest.fixture(scope="module")
def only_rotation():
    others = [t for t in planned_tests() if t != "pure_rotation"]
    return Facility(
        exclude=others, repeats=6, pure_rotation=Levels(depth_m=[25.0], **{f"{k}_radps": [0.02] for k in "pqr"})
    )


@pytest.fixture(scope="module")
def rotation_plan(rotations, only_rotation):
    return make_plan(rotations, 0.2, only_rotation)


def test_planned_errors_are_those_of_monte_carlo(rotations, rotation_plan):
    """Loads made from constant coefficients, noise of the planned size, identified again and again."""
    campaign = planned_campaign(rotations, rotation_plan.runs)
    solver, runs = Solver(campaign), campaign.runs
    truth = {t.name: 0.01 * (1.0 + 0.1 * i) for i, t in enumerate(solver.terms)}
    exact = runs.copy()
    for i, run in runs.iterrows():
        features = solver.features(run)
        for output in OUTPUTS:
            active = solver.active(run, output, features)
            exact.loc[i, output] = sum(
                solver.scales[t.name] * multiplier(t, features) * truth[t.name] for t, _ in active
            )
    errors = {f"s_{o}": exact[f"s_{o}"].fillna(1.0) for o in OUTPUTS}
    random, scores = np.random.default_rng(11), []
    wanted = {(n.name, n.part, n.point): n.planned * n.size for n in rotation_plan.needs if n.planned == n.planned}
    for _ in range(40):
        noisy = exact.assign(**{o: exact[o] + random.normal(size=len(exact)) * errors[f"s_{o}"] for o in OUTPUTS})
        found = identify(replace(campaign, runs=noisy))
        at = {(n.name, n.part, n.point): v for n, v in zip(found.nodes, found.values, strict=True)}
        scores += [(at[k] - truth[k[0]]) / sigma for k, sigma in wanted.items()]
    assert len(wanted) > 15
    assert np.mean(np.square(scores)) == pytest.approx(1.0, abs=0.12)
    assert np.mean(np.abs(scores) < 1.0) == pytest.approx(0.683, abs=0.04)


def test_what_can_be_reached_is_reached_and_nothing_is_idle(rotations, rotation_plan):
    """Leaving out any planned state loses a value or its error."""
    reached = [n for n in rotation_plan.needs if n.planned <= rotation_plan.target]
    assert len(reached) > 5
    for i in range(len(rotation_plan.runs)):
        left = rotation_plan.runs.drop(index=i).reset_index(drop=True)
        again = identify(planned_campaign(rotations, left))
        index = {(n.name, n.part, n.point): k for k, n in enumerate(again.nodes)}
        worse = False
        for need in rotation_plan.needs:
            k = index.get((need.name, need.part, need.point))
            error = math.inf if k is None else math.sqrt(again.covariance[k, k]) / need.size
            worse |= error > need.planned * 1.001
        assert worse, rotation_plan.runs.loc[i]


# -- the bundled campaign ----------------------------------------------------------------


@pytest.fixture(scope="module")
def bb2_plan(campaign):
    return make_plan(campaign, 0.1)


def test_the_plan_names_the_gaps_of_the_bundled_campaign(bb2_plan):
    """model.md, section 10: pure yaw, vp, vq, wr, pq, qr, rp, alpha with beta, beyond 12 deg."""
    rows = {(r["coefficient"], r["why"]): r for r in bb2_plan.summary()}
    for name in ("Z_vp", "M_vp", "Y_vq", "N_vq", "Y_wr", "N_wr", "Y_pq", "K_qr", "X_rp", "M_rp", "Z_rp", "K_vq"):
        assert rows[name, "no run"]["now"] is None
        assert rows[name, "no run"]["planned"] is not None
    for name in ("Y_uvw", "N_uvw", "Z_uvw", "M_uvw"):
        assert (name, "alpha with beta") in rows
        assert (name, "beta beyond the runs") in rows
    assert ("M_uvw", "alpha beyond the runs") in rows
    for name in ("N_r|r|", "Y_r|r|"):  # pure yaw is pitch turned, with a large error
        assert rows[name, "standard error"]["now"] > 0.2
        assert rows[name, "standard error"]["planned"] < 0.15
    towed = bb2_plan.runs[bb2_plan.runs["U"] > 1.0]  # slower is cross-flow
    wide = towed[["alpha", "beta"]].abs().max().map(math.degrees)
    assert wide["alpha"] == pytest.approx(24.0)
    assert wide["beta"] == pytest.approx(24.0)
    assert (bb2_plan.runs["repeats"] >= 1).all()
    assert bb2_plan.runs["repeats"].sum() < 200


def test_the_matrix_can_be_run_and_read_back(bb2_plan, campaign, tmp_path):
    """The CSV with loads added is a file of the campaign, and gives every planned value."""
    folder = tmp_path / "bb2"
    shutil.copytree(BB2, folder)
    table = bb2_plan.matrix.drop(columns=["repeats", "identifies"])
    units = {o: f"{o}_N" if o in "XYZ" else f"{o}_Nm" for o in OUTPUTS}
    done = table.assign(**dict.fromkeys(units.values(), 1.0), rel_sigma=0.05, quality="as_published", source="planned")
    done.to_csv(folder / "planned.csv", index=False)
    again = identify(read_campaign(folder))
    places = {(n.name, n.part, n.point) for n in again.nodes}
    planned = [n for n in bb2_plan.needs if n.planned == n.planned]
    assert len(planned) > 100
    assert [n for n in planned if (n.name, n.part, n.point) not in places] == []


def test_a_matrix_of_a_campaign_with_a_pivot_is_of_its_motion(bb2_plan, campaign):
    """v_P = v_O + omega x r_P: what the pivot does, and turned back the runs of the plan again."""
    pivot = MotionPoint(x_m=-6.0, y_m=0.0, z_m=1.0, about="pivot")
    moved = replace(campaign, header=campaign.header.model_copy(update={"motion_point": pivot}))
    there, here = matrix(bb2_plan.runs, moved), bb2_plan.matrix
    turns = here[["p_radps", "q_radps", "r_radps"]].fillna(0.0).ne(0.0).any(axis=1) & (here["U_mps"] > 0.0)
    pd.testing.assert_frame_equal(there[~turns], here[~turns])
    # Axes of the campaign: x aft, z up; 6 m ahead of the origin, r_P = (6, 0, -1) in the program's.
    others = here[["p_radps", "q_radps", "alpha_deg"]].fillna(0.0).ne(0.0).any(axis=1)
    yaw = turns & ~others
    drift, rate, speed = np.radians(here["beta_deg"].fillna(0.0)), -here["r_radps"], here["U_mps"]
    across = np.degrees(np.arctan2(speed * np.sin(drift) + 6.0 * rate, speed * np.cos(drift)))
    assert yaw.sum() > 3
    np.testing.assert_allclose(there["beta_deg"][yaw], across[yaw], atol=1e-9)


def test_plan_command(tmp_path):
    folder = tmp_path / "bb2"
    folder.mkdir()
    for name in ("campaign.toml", "towing.csv", "drift_vertical.csv", "drift_horizontal.csv"):
        shutil.copy(BB2 / name, folder / name)
    limits = tmp_path / "arm.toml"
    levels = "[rotating_arm]\nspeed_mps = [3.0]\ndepth_m = [25]\nr_radps = [0.02]\nbeta_deg = [8]\n"
    limits.write_text('name = "arm"\nexclude = ["pure_rotation"]\nrepeats = 2\n' + levels)
    out = tmp_path / "plan.csv"
    done = CliRunner().invoke(main, ["plan", str(folder), "--facility", str(limits), "--out", str(out), "--json", "-"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.output)
    table = pd.read_csv(out)
    assert set(table.columns) >= {"run_id", "test", "U_mps", "beta_deg", "D0_m", "r_radps", "repeats", "identifies"}
    assert "pure_rotation" not in set(table["test"])
    assert table["repeats"].max() <= 2
    fresh = table[(table["test"] == "rotating_arm") & (table["U_mps"] == 3.0)]
    assert len(fresh) > 0
    assert (fresh["beta_deg"].fillna(0.0).abs().isin([0.0, 8.0])).all()
    assert "Y_qr" in told["no_test_planned"]
    assert len(told["runs"]) == len(table)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[rotating_arm]\nr_radps = [-0.1]\n", "zero or more"),
        ("[rotating_arms]\n", "rotating_arms"),
        ("repeats = 0\n", "repeats"),
        ('exclude = ["arm"]\n', "rotating_arm"),
        ("[rotating_arm\n", "not TOML"),
    ],
)
def test_a_facility_file_with_a_mistake(tmp_path, text, said):
    path = tmp_path / "facility.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_facility(path)
    assert said in str(caught.value)
    assert "facility.toml" in caught.value.where


def test_a_target_that_is_no_target(rotations):
    with pytest.raises(InputError):
        make_plan(rotations, 0.0)


def test_a_precision_that_rounding_made_singular_has_a_large_variance_where_nothing_is_told():
    """Two unknowns of which only the sum is known, with precision 4."""
    design = Design([np.zeros((1, 2))], np.array([[4.0, 4.0], [4.0, 4.0]]))
    together, apart = np.array([1.0, 1.0]), np.array([1.0, -1.0])
    assert together @ design.covariance @ together == pytest.approx(0.25, rel=1e-9)
    assert apart @ design.covariance @ apart > 1e12
