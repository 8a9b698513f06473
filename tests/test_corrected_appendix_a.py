"""Authority: the corrected equations A1-A6 and (48), worked by hand on runs of the campaign.

Raw loads stand in the source frame (x aft, z up, ahead is u < 0). Coefficients of the
program frame have the opposite sign of X, Z, K, N and of u, w, p, r.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
PUBLISHED = Path(__file__).parent / "data" / "published" / "bb2"
RHO, L, D = 1025.0, 70.2, 5.0
KTS10, KTS3 = 5.14444, 1.54333
SIGN = {"X": -1.0, "Y": 1.0, "Z": -1.0, "K": -1.0, "M": 1.0, "N": -1.0}
FORCE = 0.5 * RHO * L**2
MOMENT = 0.5 * RHO * L**3


@pytest.fixture(scope="module")
def raw():
    """Every run as it stands in the files, by run id."""
    runs = {}
    for path in sorted((ROOT / "raw_captive_data" / "bb2").glob("*.csv")):
        with path.open(encoding="utf-8", newline="") as stream:
            runs |= {row["run_id"]: row for row in csv.DictReader(stream)}
    return runs


@pytest.fixture(scope="module")
def look(rows):
    """Value in the database: coefficient, part, and the columns that choose the point."""

    def find(name, part="hull", /, **at):
        chosen = rows[(rows["coefficient"] == name) & (rows["part"] == part)]
        for column, value in at.items():
            chosen = chosen[np.isclose(chosen[column], value, rtol=1e-7, atol=1e-12)]
        assert len(chosen) == 1, f"{name} of {part} at {at}: {len(chosen)} rows"
        return float(chosen["value"].iloc[0])

    return find


def load(run, output):
    """A load of a raw run, turned to the program frame."""
    return SIGN[output] * float(run[f"{output}_N" if output in "XYZ" else f"{output}_Nm"])


def plane_run(raw, part, delta, output):
    """The run of one deflection at 25 m and 10 kts that gives a load: continued ones beyond 10 deg."""
    where = f"{part}-25-10-{'-' if delta < 0 else '+'}{abs(delta):02d}"
    run = raw[f"PD-{where}"]
    return raw[f"PL-{where}"] if output in run["exclude"].split() else run


def between(x, a, b, at_a, at_b):
    return at_a + (at_b - at_a) * (x - a) / (b - a)


# -- A1: C' = 2F/(rho U^2 L^2), 2m/(rho U^2 L^3) ------------------------------------------


@pytest.mark.parametrize("alpha", [-12, -8, -4, 4, 8, 12])
@pytest.mark.parametrize("output", ["X", "Z", "M"])
def test_a1_vertical_drift_by_hand(raw, look, alpha, output):
    run = raw[f"VD-23.69-10-{'-' if alpha < 0 else '+'}{abs(alpha):02d}"]
    by_hand = load(run, output) / ((FORCE if output in "XZ" else MOMENT) * KTS10**2)
    at = {"speed_mps": KTS10, "alpha_deg": alpha, "beta_deg": 0, "depth_m": 23.69}
    assert look(f"{output}_uvw", **at) == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize("beta", [4, 8, 12])
@pytest.mark.parametrize("output", ["X", "Y", "Z", "K", "M", "N"])
def test_a1_horizontal_drift_by_hand_and_its_port_image(raw, look, beta, output):
    run = raw[f"HD-23.69-10-{beta:02d}"]
    by_hand = load(run, output) / ((FORCE if output in "XYZ" else MOMENT) * KTS10**2)
    at = {"speed_mps": KTS10, "alpha_deg": 0, "depth_m": 23.69}
    assert look(f"{output}_uvw", beta_deg=beta, **at) == pytest.approx(by_hand, rel=1e-12)
    parity = -1.0 if output in "YKN" else 1.0
    assert look(f"{output}_uvw", beta_deg=-beta, **at) == pytest.approx(parity * by_hand, rel=1e-12)


@pytest.mark.parametrize("output", ["Y", "K", "N"])
def test_a1_loads_odd_in_drift_are_zero_at_zero_drift(look, output):
    assert look(f"{output}_uvw", speed_mps=KTS10, alpha_deg=0, beta_deg=0, depth_m=23.69) == 0.0


def test_a1_two_runs_at_one_point_give_their_weighted_mean(raw, look):
    """Towing and vertical drift at 3 kts, D0 = 25 and 23.69 m stay apart; copies are one."""
    at = {"speed_mps": KTS3, "alpha_deg": 0, "beta_deg": 0}
    towed = load(raw["TW-25-03"], "X") / (FORCE * KTS3**2)
    assert look("X_uvw", depth_m=25.0, **at) == pytest.approx(towed, rel=1e-12)
    one, other = (load(raw[k], "Z") for k in ("VD-23.69-03-+00", "HD-23.69-03-00"))
    assert look("Z_uvw", depth_m=23.69, **at) == pytest.approx(0.5 * (one + other) / (FORCE * KTS3**2), rel=1e-12)


# -- A2: the same form for one plane, deflection zero included ----------------------------


@pytest.mark.parametrize("delta", [-30, -20, -10, 0, 10, 20, 30])
@pytest.mark.parametrize("output", ["X", "Z", "M"])
def test_a2_sail_planes_by_hand(raw, look, delta, output):
    run = plane_run(raw, "sail_planes", delta, output)
    by_hand = load(run, output) / ((FORCE if output in "XZ" else MOMENT) * KTS10**2)
    at = {"delta_deg": delta, "speed_mps": KTS10, "depth_m": 25.0}
    assert look(f"{output}_dB", "sail_planes", **at) == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize("delta", [-30, -20, -10, 0, 10, 20, 30])
@pytest.mark.parametrize("output", ["X", "Y", "Z", "K", "M", "N"])
def test_a2_stern_plane_1_by_hand_and_its_port_partner(raw, look, delta, output):
    """Plane 4 is the mirror of plane 1: port/starboard loads and the deflection turn over."""
    run = plane_run(raw, "stern_plane_1", delta, output)
    by_hand = load(run, output) / ((FORCE if output in "XYZ" else MOMENT) * KTS10**2)
    at = {"speed_mps": KTS10, "depth_m": 25.0}
    assert look(f"{output}_d1", "stern_plane_1", delta_deg=delta, **at) == pytest.approx(by_hand, rel=1e-12)
    parity = -1.0 if output in "YKN" else 1.0
    partner = look(f"{output}_d4", "stern_plane_4", delta_deg=-delta, **at)
    assert partner == pytest.approx(parity * by_hand, rel=1e-12)


@pytest.mark.parametrize("output", ["Y", "Z", "K", "M", "N"])
def test_a2_stern_planes_2_and_3_give_one_weighted_mean(raw, look, output):
    """Both were measured: plane 3 at -10 deg is plane 2 at +10 deg in the mirror."""
    own = load(raw["PD-stern_plane_2-25-10-+10"], output)
    image = (-1.0 if output in "YKN" else 1.0) * load(raw["PD-stern_plane_3-25-10--10"], output)
    # The error is proportional to the load (same quality, same rel_sigma), so weights are 1/F^2.
    mean = (own / own**2 + image / image**2) / (1.0 / own**2 + 1.0 / image**2)
    at = {"delta_deg": 10, "speed_mps": KTS10, "depth_m": 25.0}
    scale = (FORCE if output in "YZ" else MOMENT) * KTS10**2
    assert look(f"{output}_d2", "stern_plane_2", **at) == pytest.approx(mean / scale, rel=1e-12)


# -- A3: pure rotation --------------------------------------------------------------------


@pytest.mark.parametrize(("run_id", "q"), [("PR-q-0.020000", -0.02), ("PR-q+0.015000", 0.015)])
def test_a3_pure_pitch_by_hand(raw, look, run_id, q):
    run = raw[run_id]
    at = {"q_radps": q, "depth_m": 25.0}
    assert look("X_qq", **at) == pytest.approx(2 * load(run, "X") / (RHO * q**2 * L**4), rel=1e-12)
    assert look("Z_q|q|", **at) == pytest.approx(2 * load(run, "Z") / (RHO * q * abs(q) * L**4), rel=1e-12)
    assert look("M_q|q|", **at) == pytest.approx(2 * load(run, "M") / (RHO * q * abs(q) * L**5), rel=1e-12)


@pytest.mark.parametrize(("output", "power"), [("X", 4), ("Y", 4), ("N", 5)])
def test_a3_pure_yaw_by_hand(raw, look, output, power):
    """Turns to starboard and to port are one estimate: their mean, weights 1/F^2."""
    starboard, port = load(raw["PR-r-0.020000"], output), load(raw["PR-r+0.020000"], output)  # z up
    image = port if output == "X" else -port
    mean = (1.0 / starboard + 1.0 / image) / (1.0 / starboard**2 + 1.0 / image**2)
    name = "X_rr" if output == "X" else f"{output}_r|r|"
    by_hand = 2 * mean / (RHO * 0.02**2 * L**power)
    assert look(name, r_radps=0.02, depth_m=25.0) == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize("p", [0.001, 0.002, 0.003, 0.004])
def test_a3_pure_roll_by_hand_with_parity(raw, look, p):
    """p|p| for Y, K, N and p^2 for X, Z, M; p > 0 in the source frame is p < 0 here."""
    run = raw[f"PR-p+{p:.4f}"]
    for output, name, power in (
        *(("X", "X_pp", 4), ("Y", "Y_p|p|", 4), ("Z", "Z_pp", 4)),
        *(("K", "K_p|p|", 5), ("M", "M_pp", 5), ("N", "N_p|p|", 5)),
    ):
        square = -p * p if "|" in name else p * p
        by_hand = 2 * load(run, output) / (RHO * square * L**power)
        assert look(name, p_radps=-p, depth_m=25.0) == pytest.approx(by_hand, rel=1e-12)
        assert look(name, p_radps=p, depth_m=25.0) == pytest.approx(by_hand, rel=1e-12)


# -- A4: rotating arm, drift and rotation subtracted --------------------------------------


@pytest.mark.parametrize(("output", "power"), [("Y", 3), ("N", 4)])
def test_a4_yaw_by_hand(raw, look, output, power):
    """Y' = 2F/(rho u r L^3) - Y'uvw u/(L r) - Y'r|r| |r| L/u; Y'uvw is zero without drift."""
    run = raw["RA-ur-7.775e-03"]
    u, r = float(run["U_mps"]), -float(run["r_radps"])
    low, high = 0.00647948, 0.00971922
    name = f"{output}_r|r|"
    rotation = between(r, low, high, *(look(name, r_radps=x, depth_m=25.0) for x in (low, high)))
    by_hand = 2 * load(run, output) / (RHO * u * r * L**power) - rotation * abs(r) * L / u
    # Measured and mirrored run hold the same load, so the mean is either of them.
    assert look(f"{output}_ur", ur_mps2=u * r, depth_m=25.0) == pytest.approx(by_hand, rel=1e-9)


@pytest.mark.parametrize("sense", ["+", "-"])
@pytest.mark.parametrize(("output", "power"), [("Z", 3), ("M", 4)])
def test_a4_pitch_by_hand(raw, look, output, power, sense):
    """Z'uq = 2F/(rho u q L^3) - Z'uvw u/(L q) - Z'q|q| |q| L/u."""
    run = raw[f"RA-uq{sense}6.191e-04"]
    u, q = float(run["U_mps"]), float(run["q_radps"])
    # Slower and deeper than any drift run: the 3 kts, 23.69 m value holds.
    straight = look(f"{output}_uvw", speed_mps=KTS3, alpha_deg=0, beta_deg=0, depth_m=23.69)
    edge = 0.000647948
    ends = [look(f"{output}_q|q|", q_radps=x, depth_m=25.0) for x in (-edge, edge)]
    rotation = between(q, -edge, edge, *ends)
    by_hand = 2 * load(run, output) / (RHO * u * q * L**power) - straight * u / (L * q) - rotation * abs(q) * L / u
    assert look(f"{output}_uq", uq_mps2=u * q, depth_m=25.0) == pytest.approx(by_hand, rel=1e-9)


def test_a4_surge_is_left_out_because_it_does_not_vanish_with_the_rate(raw, rows):
    """X' u q by hand at the three uq runs falls with the rate by a factor of three: a residual."""
    found = []
    for name in ("RA-uq+1.871e-04", "RA-uq+3.096e-04", "RA-uq+6.191e-04"):
        pair = [raw[name], raw[name.replace("+", "-")]]
        assert all("X" in run["exclude"].split() for run in pair)
        u, q = float(pair[0]["U_mps"]), float(pair[0]["q_radps"])
        # The part odd in q: drift and rotation cancel between the two senses.
        found.append((load(pair[0], "X") - load(pair[1], "X")) / (RHO * u * q * L**3))
    assert found[0] > 2.9 * found[2] > 0.0
    assert rows[rows["coefficient"] == "X_uq"].empty


def test_estimated_turning_coefficients_by_hand(raw, look):
    """X_vr = -Y_vdot of the panel method; the sail's strip in roll from the drift roll moment."""
    y_vdot = 2 * load(raw["AP-vdot"], "Y") / (RHO * L**3)
    assert look("X_vr", depth_m=25.0) == pytest.approx(-y_vdot, rel=1e-5)
    slope = [(raw[f"HD-23.69-10-{b:02d}"], math.sin(math.radians(b))) for b in (4, 8, 12)]
    roll = [(load(run, "K") / (MOMENT * KTS10**2), s) for run, s in slope]
    k_v = sum(k * s for k, s in roll) / sum(s * s for _, s in roll)
    z, x = 8.6491, 7.1877
    up = {"up_mps2": KTS10 * 0.02, "depth_m": 25.0}
    # Side force K_v L / z of u v; the sail meets v + z p, at z / L and x / L for roll and yaw.
    assert look("Y_up", **up) == pytest.approx(k_v, rel=1e-4)
    assert look("K_up", **up) == pytest.approx(k_v * z / L, rel=1e-4)
    assert look("N_up", **up) == pytest.approx(k_v * x / L, rel=1e-4)


def test_a4_decoupled_runs_are_not_subtracted_twice(raw, look):
    """The source removed drift and rotation: K'wp = 2 m_x/(rho w p L^4), with S = |w|."""
    run = raw["RA-wp+6.325e-03"]
    speed, p = float(run["U_mps"]), -float(run["p_radps"])
    w = -speed  # alpha = -90 deg, top windward: w < 0 with z down
    at = {"wp_mps2": w * p, "depth_m": 25.0}
    assert look("K_wp", **at) == pytest.approx(2 * load(run, "K") / (RHO * w * p * L**4), rel=1e-9)
    assert look("Y_wp", **at) == pytest.approx(2 * load(run, "Y") / (RHO * w * p * L**3), rel=1e-9)
    run = raw["RA-wq+9.487e-04"]
    speed, q = float(run["U_mps"]), float(run["q_radps"])
    at = {"wq_mps2": -speed * q, "depth_m": 25.0}
    assert look("Z_w|q|", **at) == pytest.approx(2 * load(run, "Z") / (RHO * -speed * q * L**3), rel=1e-9)
    assert look("M_|w|q", **at) == pytest.approx(2 * load(run, "M") / (RHO * speed * q * L**4), rel=1e-9)


# -- A5: added mass of the sections -------------------------------------------------------


def test_a5_sections_by_hand(raw, look):
    """2F/(rho L^3 vdot), section by section; Table 6 sums to c = 0.0492, 1.198, 0.840."""
    totals = dict.fromkeys("XYZ", 0.0)
    for run in raw.values():
        if run["test"] != "acceleration" or run["part"] == "hull":
            continue
        for output, motion in (("X", "udot"), ("Y", "vdot"), ("Z", "wdot")):
            if not run[f"{motion}_mps2"]:
                continue
            acceleration = SIGN[output] * float(run[f"{motion}_mps2"])
            by_hand = 2 * load(run, output) / (RHO * L**3 * acceleration)
            assert look(f"{output}_{motion}_section", run["part"]) == pytest.approx(by_hand, rel=1e-12)
            totals[output] += by_hand * 0.5 * RHO * L**3
    share = [-totals[o] / 4418.8e3 for o in "XYZ"]
    assert share == pytest.approx([0.0492, 1.198, 0.840], rel=2e-3)


# -- A6: side loads of the propeller -------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "output", "rate", "power"),
    [("Y_prop_ur", "Y", "r", 3), ("N_prop_ur", "N", "r", 4), ("Z_prop_uq", "Z", "q", 3), ("M_prop_uq", "M", "q", 4)],
)
@pytest.mark.parametrize(("kts", "speed"), [("10", KTS10), ("06", 3.08666)])
def test_a6_propeller_side_loads_by_hand(raw, look, name, output, rate, power, kts, speed):
    """2F/(rho u r L^3), 2m/(rho u q L^4): weighted mean over the rates of one speed."""
    top = bottom = 0.0
    for run_id, run in raw.items():
        if not run_id.startswith(f"PS-{rate}-{kts}"):
            continue
        turn = float(run[f"{rate}_radps"]) * (-1.0 if rate == "r" else 1.0)
        multiplier = 0.5 * RHO * L**power * speed * turn
        sigma = 0.1 * abs(load(run, output))
        top += multiplier * load(run, output) / sigma**2
        bottom += (multiplier / sigma) ** 2
    assert look(name, "propeller", speed_mps=speed, depth_m=25.0) == pytest.approx(top / bottom, rel=1e-9)


# -- Eq. (48): wake fraction ---------------------------------------------------------------


def _advance(thrust_coefficient):
    """J at a thrust coefficient from the published open-water polynomial."""
    a, b, c = -0.0923, -0.3652, 0.4786 - thrust_coefficient
    return (-b - math.sqrt(b * b - 4 * a * c)) / (2 * a)


def test_eq48_wake_fraction_by_hand(raw, look):
    """Hull towing load and five undeflected planes against the thrust at 1.18 rps."""
    run = raw["SP-25-10"]
    n, deduction = float(run["n_rps"]), float(run["t"])
    planes = ["stern_plane_1", "stern_plane_2", "stern_plane_3", "stern_plane_4", "sail_planes"]
    resistance = -load(raw["TW-25-10"], "X") - sum(load(raw[f"PD-{p}-25-10-+00"], "X") for p in planes)
    coefficient = resistance / ((1 - deduction) * RHO * n**2 * D**4)
    # The campaign holds the curve at J = 0, 0.05, ...: linear between, so the inverse is too.
    steps = [0.05 * k for k in range(21)]
    curve = [float(raw[f"OW-{j:.2f}"]["KT"]) for j in steps]
    k = next(k for k in range(20) if curve[k] >= coefficient > curve[k + 1])
    advance = between(coefficient, curve[k], curve[k + 1], steps[k], steps[k + 1])
    wake = 1 - advance * n * D / float(run["U_mps"])
    assert look("w_T", "propeller") == pytest.approx(wake, rel=1e-9)
    assert look("w_T", "propeller") == pytest.approx(1 - _advance(coefficient) * n * D / KTS10, abs=1e-3)
    assert 0.0 < wake < 0.4


# -- published numbers ---------------------------------------------------------------------


def _published(coefficient, angle):
    with (PUBLISHED / "published_coefficients.csv").open(encoding="utf-8", newline="") as stream:
        found = [r for r in csv.DictReader(stream) if r["coefficient"] == coefficient]
    deep = [r for r in found if r["speed_kts"] == "10" and r["D0_m"] == "23.6900" and r[angle]]
    return {float(r[angle]): float(r["value_half_rho_best"]) for r in deep}


@pytest.mark.parametrize(
    ("name", "released", "angle"),
    [
        ("Y_uvw", "Y'_uvw", "beta_deg"),
        ("N_uvw", "N'_uvw", "beta_deg"),
        ("K_uvw", "K'_uvw", "beta_deg"),
        ("Z_uvw", "Z'_uvw(alpha)", "alpha_deg"),
        ("M_uvw", "M'_uvw(alpha)", "alpha_deg"),
    ],
)
def test_database_holds_the_released_drift_tables_at_10_kts(look, name, released, angle):
    """Released tables are in the source frame; the campaign repeats them to six digits."""
    published = _published(released, angle)
    assert len(published) >= 4
    for degrees, value in published.items():
        at = {"alpha_deg": 0.0, "beta_deg": 0.0, angle: degrees}
        got = look(name, speed_mps=KTS10, depth_m=23.69, **at)
        assert got == pytest.approx(SIGN[name[0]] * value, rel=2e-5, abs=1e-12)


def test_signs_of_the_stability_derivatives_are_those_of_a_submarine(look):
    """Program frame: Y_v, N_v, Z_w < 0, M_w > 0; N_r, M_q, K_p < 0; Y_r > 0, Z_q < 0."""
    drift = {"speed_mps": KTS10, "alpha_deg": 0, "depth_m": 23.69}
    assert look("Y_uvw", beta_deg=4, **drift) < 0
    assert look("N_uvw", beta_deg=4, **drift) < 0
    pitch = {"speed_mps": KTS10, "beta_deg": 0, "depth_m": 23.69}
    assert look("Z_uvw", alpha_deg=4, **pitch) < look("Z_uvw", alpha_deg=-4, **pitch)
    assert look("M_uvw", alpha_deg=4, **pitch) > look("M_uvw", alpha_deg=-4, **pitch)
    assert look("K_p|p|", p_radps=0.004, depth_m=25.0) < 0
    ur = KTS10 * 0.00777538
    assert look("N_ur", ur_mps2=ur, depth_m=25.0) < 0
    assert look("Y_ur", ur_mps2=ur, depth_m=25.0) > 0
    uq = 0.371484 * 0.000619139
    assert look("M_uq", uq_mps2=uq, depth_m=25.0) < 0
    assert look("Z_uq", uq_mps2=uq, depth_m=25.0) < 0
