"""Authority: parameter recovery of the constant-coefficient set, Eqs. (17)-(22), written out by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify

BB2 = Path(__file__).parents[1] / "sim" / "vehicles" / "bb2.toml"
OUTPUTS = ("X", "Y", "Z", "K", "M", "N")
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
    assert {(one.file, one.output) for one in found.unused} <= {("rotating_arm.csv", o) for o in OUTPUTS}


def test_constant_coefficients_forbidden_by_symmetry_are_not_found(constant_set):
    _, found = constant_set
    assert not {"Y_*", "K_*", "N_*", "Z_v"} & {n.name for n in found.nodes}
