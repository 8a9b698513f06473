"""Authority: parameter recovery. Loads made from known coefficients must give them back.

Without noise to rounding; with noise of known standard deviation, the stated standard
errors must cover the truth as often as they claim.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import brentq

from ident.captive.campaign import Campaign
from ident.database.store import database_rows
from ident.identification.identify import Identification, identify
from sim.boat.coefficients import Coefficients
from sim.boat.forces import axis_values, boat_features, body_velocity, multiplier, plane_features

BB2 = Path(__file__).parents[1] / "sim" / "vehicles" / "bb2.toml"
OUTPUTS = ("X", "Y", "Z", "K", "M", "N")
GROUPS = {
    "drift": ("towing", "drift_vertical", "drift_horizontal"),
    "planes": ("plane_deflection",),
    "pure rotation": ("pure_rotation",),
    "rotating arm": ("rotating_arm",),
}
DRAWS = 24


@dataclass(frozen=True)
class Truth:
    """Known values node by node, and the campaign whose loads follow from them."""

    found: Identification
    values: np.ndarray
    campaign: Campaign


def _state(run: pd.Series, campaign: Campaign, part: str) -> dict[str, float]:
    """Features of a run's state as the forward model has them."""
    zero = run[["U", "alpha", "beta", "p", "q", "r", "plane"]].astype(float).fillna(0.0)
    velocity = body_velocity(zero["U"], zero["alpha"], zero["beta"])
    rates = (zero["p"], zero["q"], zero["r"])
    features = boat_features(velocity, rates, float(run["D0"]), float(run["n"]), float(run["J"]))
    for plane in campaign.vehicle.planes:
        if plane.name == part:
            features |= plane_features(plane, velocity, rates, zero["plane"])
    for name in ("udot", "vdot", "wdot", "pdot", "qdot", "rdot"):
        features[name] = 0.0 if pd.isna(run[name]) else float(run[name])
    return features


def _load(run: pd.Series, campaign: Campaign, known: Coefficients, part: str, output: str) -> float:
    """One load of one part: the sum of the forward model's terms at this state."""
    particulars, density = campaign.vehicle.particulars, campaign.header.fluid.density_kgpm3
    features, total = _state(run, campaign, part), 0.0
    for coefficient in known:  # by the simulator's tables, not by the identification's rows
        term = coefficient.term
        if coefficient.part != part or term.output != output:
            continue
        if run["decoupled"] == "True" and run["test"] not in term.tests:
            continue  # the source has already subtracted these
        m = multiplier(term, features)
        if m == 0.0 or math.isnan(m):
            continue
        scale = term.scale(density, particulars.length.value, campaign.vehicle.propeller.diameter.value)
        total += scale * m * coefficient.at(axis_values(term, features))
    return total


def _revolutions(run: pd.Series, campaign: Campaign, known: Coefficients, wake: float) -> float:
    """n at which (1-t) KT(J) rho n^2 D^4 balances the resistance, J = (1-w) U/(n D)."""
    diameter = campaign.vehicle.propeller.diameter.value
    density = campaign.header.fluid.density_kgpm3
    parts = ["hull", *[p.name for p in campaign.vehicle.planes]]
    resistance = -sum(_load(run, campaign, known, part, "X") for part in parts)
    deduction = known.get("t").at([float(run["U"]), float(run["D0"])])

    def surplus(n: float) -> float:
        thrust = known.get("KT").at([(1.0 - wake) * float(run["U"]) / (n * diameter)])
        return (1.0 - deduction) * thrust * density * n * n * diameter**4 - resistance

    return float(brentq(surplus, 0.9, 3.0, xtol=1e-14, rtol=1e-14))


def make_truth(found: Identification, seed: int) -> Truth:
    """Random truth on the nodes of an identification, and its synthetic run table."""
    random = np.random.default_rng(seed)
    factors = random.uniform(0.6, 1.4, len(found.nodes))
    for i, node in enumerate(found.nodes):
        if node.name in ("KT", "KQ"):
            factors[i] = 1.1  # one factor: the open-water curve has to stay monotonic
        if node.name == "X_uvw":
            factors[i] = random.uniform(0.95, 1.05)
    values = found.values * factors
    wake = next(i for i, n in enumerate(found.nodes) if n.name == "w_T")
    values[wake] = 0.17
    campaign = found.campaign
    known = Coefficients(campaign.vehicle, database_rows(replace(found, values=values)))
    runs = campaign.runs.copy()
    for i, run in campaign.runs.iterrows():
        for output in OUTPUTS:
            if pd.notna(run[output]):
                runs.loc[i, output] = _load(run, campaign, known, run["part"], output)
        for name in ("KT", "KQ", "t"):
            if pd.notna(run[name]):
                at = _state(run, campaign, run["part"])
                runs.loc[i, name] = known.get(name).at(axis_values(known.get(name).term, at))
        if run["test"] == "self_propulsion" and pd.notna(run["n"]):
            runs.loc[i, "n"] = _revolutions(run, campaign, known, 0.17)
    return Truth(found, values, replace(campaign, runs=runs))


def _deviations(truth: Truth, again: Identification) -> pd.DataFrame:
    """Estimate minus truth of every node, by coefficient and test group."""
    keys = {(n.name, n.part, n.point): i for i, n in enumerate(truth.found.nodes)}
    tests = dict(zip(again.campaign.runs["run_id"], again.campaign.runs["test"], strict=True))
    rows = []
    error = np.sqrt(np.diag(again.covariance))
    for i, node in enumerate(again.nodes):
        true = float(truth.values[keys[node.name, node.part, node.point]])
        rows.append((node.name, tests[node.runs[0]], true, again.values[i] - true, error[i]))
    return pd.DataFrame(rows, columns=["name", "test", "true", "off", "stderr"])


@pytest.fixture(scope="module")
def full_truth(identification):
    return make_truth(identification, seed=1)


@pytest.fixture(scope="module")
def recovered(full_truth):
    return identify(full_truth.campaign)


def test_recovery_without_noise_returns_every_coefficient_to_1e_9(full_truth, recovered):
    again = recovered
    off = _deviations(full_truth, again)
    assert {(n.name, n.part, n.point) for n in again.nodes} == {
        (n.name, n.part, n.point) for n in full_truth.found.nodes
    }
    largest = off.groupby("name")["true"].transform(lambda x: x.abs().max())
    relative = (off["off"].abs() / largest).groupby(off["name"]).max()
    assert relative.drop("w_T").max() < 1e-9, relative.nlargest(5)


def test_recovery_without_noise_returns_the_wake_fraction(recovered):
    wake = next(i for i, n in enumerate(recovered.nodes) if n.name == "w_T")
    assert recovered.values[wake] == pytest.approx(0.17, abs=1e-9)


def test_recovery_without_noise_leaves_no_disagreement_between_runs(recovered):
    assert max(n.worst for n in recovered.nodes) < 1e-3


def _small_truth(campaign: Campaign) -> Truth:
    """10 kts and the rotary tests at the deepest two depths: fast, and every kind of term."""
    runs = campaign.runs
    deep = runs["D0"].isna() | runs["D0"].isin([23.69, 25.0])
    slow = runs["test"].isin([*GROUPS["drift"], "plane_deflection"]) & (runs["U"] < 5.0)
    return make_truth(identify(replace(campaign, runs=runs[deep & ~slow].reset_index(drop=True))), seed=2)


def _noisy(truth: Truth, random: np.random.Generator) -> Campaign:
    """A draw: every load with its stated error; copies share the error of their original."""
    runs = truth.campaign.runs.copy()
    shared = runs["copy_of"].where(runs["copy_of"] != "", runs["run_id"])
    for output in (*OUTPUTS, "KT", "KQ", "t"):
        draw = pd.Series(random.standard_normal(len(runs)), index=runs["run_id"])
        noise = shared.map(draw).to_numpy() * np.sign(runs[output]) * runs[f"s_{output}"]
        runs[output] = runs[output] + noise
    runs["n"] = runs["n"] * (1.0 + runs["rel_sigma"] * random.standard_normal(len(runs)))
    return replace(truth.campaign, runs=runs)


@pytest.fixture(scope="module")
def draws(campaign):
    truth = _small_truth(campaign)
    runs = truth.campaign.runs.copy()
    for output in (*OUTPUTS, "KT", "KQ", "t"):
        size = runs[output].abs()
        # Four per cent of the load, and a floor far below it: a copy keeps the sign of its load.
        runs[f"s_{output}"] = np.maximum(
            0.04 * size, 1e-4 * size.groupby([runs["test"], runs["part"]]).transform("max")
        )
    for name in ("KT", "KQ", "t"):
        runs[f"s_{name}"] = 0.002 * runs[name].abs().max()
    runs["rel_sigma"] = 0.004
    truth = replace(truth, campaign=replace(truth.campaign, runs=runs))
    random = np.random.default_rng(20210)
    tables = [_deviations(truth, identify(_noisy(truth, random))).assign(draw=k) for k in range(DRAWS)]
    every = pd.concat(tables, ignore_index=True)
    every["z"] = every["off"] / every["stderr"]
    return every


def test_coverage_of_95_percent_intervals_over_all_coefficients(draws):
    covered = (draws["z"].abs() < 1.96).mean()
    assert 0.90 < covered < 0.99


@pytest.mark.parametrize("group", GROUPS)
def test_coverage_of_95_percent_intervals_in_each_group(draws, group):
    part = draws[draws["test"].isin(GROUPS[group])]
    assert len(part) > 200
    assert 0.90 < (part["z"].abs() < 1.96).mean() < 0.99


def test_standard_scores_have_mean_zero_and_deviation_one(draws):
    assert draws["z"].mean() == pytest.approx(0.0, abs=0.05)
    assert draws["z"].std() == pytest.approx(1.0, abs=0.07)


@pytest.mark.parametrize("group", GROUPS)
def test_standard_scores_of_each_group_have_deviation_one(draws, group):
    part = draws[draws["test"].isin(GROUPS[group])]
    assert part["z"].std() == pytest.approx(1.0, abs=0.15)


def test_wake_fraction_is_covered_by_its_interval(draws):
    wake = draws[draws["name"] == "w_T"]
    assert len(wake) == DRAWS
    # 24 draws of a 95 % interval: 19 or more hits with probability 0.998.
    assert (wake["z"].abs() < 1.96).sum() >= 19
    assert wake["z"].std() == pytest.approx(1.0, abs=0.45)


def test_errors_of_subtracted_loads_reach_the_rotary_coefficients(campaign):
    """A larger error of pure rotation widens N_ur, whose runs subtract N_r|r| (A4)."""
    runs = campaign.runs.copy()
    rotation = runs["test"] == "pure_rotation"
    runs.loc[rotation, "s_N"] *= 10.0

    def width(found: Identification) -> float:
        i = next(i for i, n in enumerate(found.nodes) if n.name == "N_ur")
        return math.sqrt(found.covariance[i, i])

    keep = runs["test"].isin(["drift_horizontal", "pure_rotation", "rotating_arm"])
    before = identify(replace(campaign, runs=campaign.runs[keep]))
    assert width(identify(replace(campaign, runs=runs[keep]))) > 1.05 * width(before)
