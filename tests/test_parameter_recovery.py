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

from ident.campaign import Campaign, read_campaign
from ident.identify import Identification, identify
from ident.store import database_rows
from sim.coefficients import Coefficients
from sim.forces import axis_values, boat_features, body_velocity, multiplier, plane_features

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


# -- the constant-coefficient set, Eqs. (17)-(22) ----------------------------------------

# Multipliers by hand, not from the term table: power of L and monomial. s is sqrt(v^2+w^2).
GERTLER = {
    "X_uu": (2, lambda u, v, w, p, q, r, s: u * u),
    "X_vv": (2, lambda u, v, w, p, q, r, s: v * v),
    "X_ww": (2, lambda u, v, w, p, q, r, s: w * w),
    "X_qq": (4, lambda u, v, w, p, q, r, s: q * q),
    "X_rr": (4, lambda u, v, w, p, q, r, s: r * r),
    "X_rp": (4, lambda u, v, w, p, q, r, s: r * p),
    "X_vr": (3, lambda u, v, w, p, q, r, s: v * r),
    "X_wq": (3, lambda u, v, w, p, q, r, s: w * q),
    "Y_v": (2, lambda u, v, w, p, q, r, s: u * v),
    "Y_v|v|": (2, lambda u, v, w, p, q, r, s: v * s),
    "Y_vw": (2, lambda u, v, w, p, q, r, s: v * w),
    "Y_p|p|": (4, lambda u, v, w, p, q, r, s: p * abs(p)),
    "Y_pq": (4, lambda u, v, w, p, q, r, s: p * q),
    "Y_qr": (4, lambda u, v, w, p, q, r, s: q * r),
    "Y_ur": (3, lambda u, v, w, p, q, r, s: u * r),
    "Y_up": (3, lambda u, v, w, p, q, r, s: u * p),
    "Y_vq": (3, lambda u, v, w, p, q, r, s: v * q),
    "Y_wp": (3, lambda u, v, w, p, q, r, s: w * p),
    "Y_wr": (3, lambda u, v, w, p, q, r, s: w * r),
    "Y_v|r|": (3, lambda u, v, w, p, q, r, s: np.sign(v) * s * abs(r)),
    "Z_*": (2, lambda u, v, w, p, q, r, s: u * u),
    "Z_vv": (2, lambda u, v, w, p, q, r, s: v * v),
    "Z_w": (2, lambda u, v, w, p, q, r, s: u * w),
    "Z_w|w|": (2, lambda u, v, w, p, q, r, s: w * s),
    "Z_pp": (4, lambda u, v, w, p, q, r, s: p * p),
    "Z_rr": (4, lambda u, v, w, p, q, r, s: r * r),
    "Z_rp": (4, lambda u, v, w, p, q, r, s: r * p),
    "Z_uq": (3, lambda u, v, w, p, q, r, s: u * q),
    "Z_vp": (3, lambda u, v, w, p, q, r, s: v * p),
    "Z_vr": (3, lambda u, v, w, p, q, r, s: v * r),
    "Z_w|q|": (3, lambda u, v, w, p, q, r, s: np.sign(w) * s * abs(q)),
    "K_v": (3, lambda u, v, w, p, q, r, s: u * v),
    "K_v|v|": (3, lambda u, v, w, p, q, r, s: v * s),
    "K_vw": (3, lambda u, v, w, p, q, r, s: v * w),
    "K_p|p|": (5, lambda u, v, w, p, q, r, s: p * abs(p)),
    "K_pq": (5, lambda u, v, w, p, q, r, s: p * q),
    "K_qr": (5, lambda u, v, w, p, q, r, s: q * r),
    "K_ur": (4, lambda u, v, w, p, q, r, s: u * r),
    "K_up": (4, lambda u, v, w, p, q, r, s: u * p),
    "K_vq": (4, lambda u, v, w, p, q, r, s: v * q),
    "K_wp": (4, lambda u, v, w, p, q, r, s: w * p),
    "K_wr": (4, lambda u, v, w, p, q, r, s: w * r),
    "M_*": (3, lambda u, v, w, p, q, r, s: u * u),
    "M_vv": (3, lambda u, v, w, p, q, r, s: v * v),
    "M_w": (3, lambda u, v, w, p, q, r, s: u * w),
    "M_|w|": (3, lambda u, v, w, p, q, r, s: u * abs(w)),
    "M_w|w|": (3, lambda u, v, w, p, q, r, s: w * s),
    "M_ww": (3, lambda u, v, w, p, q, r, s: abs(w) * s),
    "M_pp": (5, lambda u, v, w, p, q, r, s: p * p),
    "M_q|q|": (5, lambda u, v, w, p, q, r, s: q * abs(q)),
    "M_rr": (5, lambda u, v, w, p, q, r, s: r * r),
    "M_rp": (5, lambda u, v, w, p, q, r, s: r * p),
    "M_uq": (4, lambda u, v, w, p, q, r, s: u * q),
    "M_vp": (4, lambda u, v, w, p, q, r, s: v * p),
    "M_vr": (4, lambda u, v, w, p, q, r, s: v * r),
    "M_|w|q": (4, lambda u, v, w, p, q, r, s: s * q),
    "N_v": (3, lambda u, v, w, p, q, r, s: u * v),
    "N_v|v|": (3, lambda u, v, w, p, q, r, s: v * s),
    "N_vw": (3, lambda u, v, w, p, q, r, s: v * w),
    "N_pq": (5, lambda u, v, w, p, q, r, s: p * q),
    "N_qr": (5, lambda u, v, w, p, q, r, s: q * r),
    "N_r|r|": (5, lambda u, v, w, p, q, r, s: r * abs(r)),
    "N_ur": (4, lambda u, v, w, p, q, r, s: u * r),
    "N_up": (4, lambda u, v, w, p, q, r, s: u * p),
    "N_vq": (4, lambda u, v, w, p, q, r, s: v * q),
    "N_wp": (4, lambda u, v, w, p, q, r, s: w * p),
    "N_wr": (4, lambda u, v, w, p, q, r, s: w * r),
    "N_|v|r": (4, lambda u, v, w, p, q, r, s: s * r),
}
ADDED = {
    **{"X_udot": 3, "Y_vdot": 3, "Y_rdot": 4, "Y_pdot": 4, "Z_wdot": 3, "Z_qdot": 4, "K_pdot": 5, "K_rdot": 5},
    **{"K_vdot": 4, "M_qdot": 5, "M_wdot": 4, "N_rdot": 5, "N_pdot": 5, "N_vdot": 4},
}
# Linear lift and quadratic drag of the planes, and the correction with the yaw or pitch rate.
PLANES = {
    **{"X_d1d1": (2, 2), "Y_delta1": (2, 1), "Z_delta1": (2, 1), "K_delta1": (3, 1), "M_delta1": (3, 1)},
    **{"N_delta1": (3, 1), "X_d2d2": (2, 2), "Y_delta2": (2, 1), "Z_delta2": (2, 1), "N_delta2": (3, 1)},
    **{"X_dBdB": (2, 2), "Z_deltaB": (2, 1), "M_deltaB": (3, 1)},
}
PLANE_RATE = {"Y_|r|d1": (3, "r"), "Z_|q|d1": (3, "q"), "Y_|r|d2": (3, "r"), "Z_|q|d2": (3, "q")}
LENGTH, DENSITY = 60.0, 1000.0


def _constant_truth() -> dict[str, float]:
    random = np.random.default_rng(17)
    names = [*GERTLER, *ADDED, *PLANES, *PLANE_RATE]
    return {n: float(random.uniform(0.001, 0.02) * random.choice([-1, 1])) for n in names}


def _plane_of(name: str) -> str:
    digit = name.rstrip("|")[-1]
    return "sail_planes" if digit == "B" else f"stern_plane_{digit}"


def _constant_runs(truth: dict[str, float]) -> pd.DataFrame:
    """Runs of a boat with constant coefficients; loads written out from Eqs. (17)-(22)."""
    half = 0.5 * DENSITY
    rows: list[dict[str, object]] = []

    def add(test: str, part: str, loads: dict[str, float], **state: float) -> None:
        head = {"run_id": f"r{len(rows)}", "test": test, "part": part, "quality": "made_up", "source": "known truth"}
        named = {f"{o}_N" if o in "XYZ" else f"{o}_Nm": value for o, value in loads.items()}
        rows.append({**head, "D0_m": 30.0, "rel_sigma": 0.02, **state, **named})

    def hull(u, v, w, p=0.0, q=0.0, r=0.0) -> dict[str, float]:
        total = dict.fromkeys(OUTPUTS, 0.0)
        for name, (power, m) in GERTLER.items():
            total[name[0]] += half * LENGTH**power * truth[name] * m(u, v, w, p, q, r, math.hypot(v, w))
        return total

    def flow(speed: float, alpha: float, beta: float) -> tuple[float, float, float]:
        a, b = math.radians(alpha), math.radians(beta)
        return speed * math.cos(a) * math.cos(b), speed * math.sin(b), speed * math.sin(a) * math.cos(b)

    for speed in (2.0, 5.0):
        for alpha in (-15, -8, 0, 5, 12, 20):
            add("drift_vertical", "hull", hull(*flow(speed, alpha, 0)), U_mps=speed, alpha_deg=alpha, beta_deg=0)
        for beta, alpha in ((4, 0), (8, 0), (14, 0), (20, 0), (10, 8), (10, -8), (15, 10)):
            state = {"U_mps": speed, "alpha_deg": alpha, "beta_deg": beta}
            add("drift_horizontal", "hull", hull(*flow(speed, alpha, beta)), **state)
    for p, q, r in ((0.02, 0, 0), (-0.03, 0, 0), (0, 0.02, 0), (0, -0.01, 0), (0, 0, 0.02), (0.02, 0.01, 0)):
        add("pure_rotation", "hull", hull(0, 0, 0, p, q, r), p_radps=p, q_radps=q, r_radps=r)
    for p, q, r in ((0, 0.02, 0.01), (0.02, 0, 0.03), (0.01, 0.02, 0.03)):
        add("pure_rotation", "hull", hull(0, 0, 0, p, q, r), p_radps=p, q_radps=q, r_radps=r)
    for alpha, beta in ((0, 0), (10, 0), (0, 10), (-12, 5), (8, -10)):
        for p, q, r in ((0.02, 0, 0), (0, 0.02, 0), (0, 0, 0.02), (0, -0.03, 0), (0, 0, -0.03), (0.01, 0.02, 0.03)):
            state = {"U_mps": 4.0, "alpha_deg": alpha, "beta_deg": beta, "p_radps": p, "q_radps": q, "r_radps": r}
            add("rotating_arm", "hull", hull(*flow(4.0, alpha, beta), p, q, r), **state)
    for motion in ("udot", "vdot", "wdot", "pdot", "qdot", "rdot"):
        terms = [n for n in ADDED if n.endswith(motion)]
        unit = "mps2" if motion[0] in "uvw" else "radps2"
        loads = {n[0]: half * LENGTH ** ADDED[n] * truth[n] * 0.3 for n in terms}
        add("acceleration", "hull", loads, U_mps=0.0, **{f"{motion}_{unit}": 0.3})
    for part in ("stern_plane_1", "stern_plane_2", "sail_planes"):
        own = [n for n in PLANES if _plane_of(n) == part]
        for angle in (-20, -10, 10, 20):
            d = math.radians(angle)
            loads = {n[0]: half * LENGTH ** PLANES[n][0] * truth[n] * 25.0 * d ** PLANES[n][1] for n in own}
            add("plane_deflection", part, loads, U_mps=5.0, plane_deg=angle, alpha_deg=0, beta_deg=0)
        for name, (power, rate) in PLANE_RATE.items():
            if _plane_of(name) != part:
                continue
            d, turn = math.radians(15.0), -0.02
            lift = next(n for n in own if n[0] == name[0] and "delta" in n)
            load = half * LENGTH**2 * truth[lift] * 25.0 * d + half * LENGTH**power * truth[name] * 5.0 * abs(turn) * d
            state = {"U_mps": 5.0, "plane_deg": 15.0, "alpha_deg": 0, "beta_deg": 0, f"{rate}_radps": turn}
            add("rotating_arm", part, {name[0]: load}, **state)
    return pd.DataFrame(rows)


HEADER = """
name = "made-up"
vehicle = "boat.toml"
facility = "arithmetic"
provenance = "known coefficients"
[frame]
x = "forward"
y = "starboard"
z = "down"
angles = "flight"
[moment_point]
x_m = 0.0
y_m = 0.0
z_m = 0.0
about = "body origin"
[scale]
ratio = 1.0
length_m = 60.0
[fluid]
density_kgpm3 = 1000.0
source = "made up"
[inertia]
model_inertia_in_loads = false
[uncertainty]
floor = 0.1
source = "made up"
[quality]
made_up = { factor = 1.0, meaning = "computed from known coefficients" }
"""


@pytest.fixture(scope="module")
def constant_set(tmp_path_factory):
    """A Gertler-Hagen boat with every test, written to files and identified from them."""
    folder = tmp_path_factory.mktemp("constant")
    boat = BB2.read_text("utf-8").replace('name = "bb2"', 'name = "boat"', 1)
    boat = boat.replace('term_set = "reduced"', 'term_set = "gertler_hagen"')
    boat = boat.replace('added_mass = "sections"', 'added_mass = "derivatives"')
    boat = boat.replace("length = { value = 70.2", f"length = {{ value = {LENGTH}")
    (folder / "boat.toml").write_text(boat, "utf-8")
    (folder / "campaign.toml").write_text(HEADER, "utf-8")
    truth = _constant_truth()
    for test, runs in _constant_runs(truth).groupby("test"):
        runs.dropna(axis=1, how="all").to_csv(folder / f"{test}.csv", index=False)
    return truth, identify(read_campaign(folder))


def test_constant_coefficient_set_is_recovered_to_1e_9(constant_set):
    truth, found = constant_set
    rows = database_rows(found)
    got = rows[rows["origin"] == "measured"].set_index("coefficient")["value"]
    assert set(truth) <= set(got.index), set(truth) - set(got.index)
    off = {n: abs(got[n] / value - 1.0) for n, value in truth.items()}
    assert max(off.values()) < 1e-9, sorted(off.items(), key=lambda x: -x[1])[:5]


def test_constant_coefficient_set_has_no_axis_and_no_disagreement(constant_set):
    _, found = constant_set
    assert all(n.point == () for n in found.nodes)
    assert max(n.worst for n in found.nodes) < 1e-3
    # Loads of a rotating arm that no rate term adds to say nothing new; nothing else is left out.
    assert {(file, output) for _, file, _, output, _ in found.unused} <= {("rotating_arm.csv", o) for o in OUTPUTS}


def test_constant_coefficients_forbidden_by_symmetry_are_not_found(constant_set):
    _, found = constant_set
    assert not {"Y_*", "K_*", "N_*", "Z_v"} & {n.name for n in found.nodes}
