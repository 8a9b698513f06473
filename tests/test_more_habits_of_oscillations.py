"""Oscillations as other laboratories write them: tables about a fixed point, amplitudes, phases, clocks, weights."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from made_campaigns import campaign, history
from made_oscillations import (
    ACCELERATION,
    AMPLITUDE,
    CONSTANTS,
    DAMPING,
    FREQUENCY,
    INERTIA,
    N_DAMPING,
    N_INERTIA,
    OMEGA,
    REDUCTION,
    SPEED,
    TABLE,
    X,
    findings,
    of_table,
    record,
)

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from sim.files.errors import InputError

# -- the point that moments are about -------------------------------------------------------------


def test_a_table_about_a_fixed_point_is_moved_to_the_bodys(tmp_path):
    """N about a point that stays has -y X in it: in phase, -A X_mean."""
    own = of_table(tmp_path / "own")
    fixed = TABLE["N_in [N m]"] - AMPLITUDE * X
    left = of_table(tmp_path / "left", **{"N_in [N m]": fixed})
    assert abs(left["N"]["+a"] - own["N"]["+a"]) == pytest.approx(-AMPLITUDE * X, rel=1e-9)
    moved = of_table(tmp_path / "moved", 'moments_about = "fixed"', **{"N_in [N m]": fixed})
    for load in "XYN":
        np.testing.assert_allclose(moved[load], own[load], rtol=1e-9, atol=1e-6)


def test_every_harmonic_of_the_force_is_taken_along(tmp_path):
    """X of twice the frequency times y is a moment of the first and third harmonic."""
    swing = 3.0e3
    angle = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
    moment = -AMPLITUDE * np.sin(angle) * swing * np.cos(2.0 * angle)
    parts = {f"N_in{k or ''}": 2.0 * float((moment * np.sin((k or 1) * angle)).mean()) for k in (0, 2, 3)}
    fixed = TABLE["N_in [N m]"] - AMPLITUDE * X + parts["N_in"]
    changed = {"N_in [N m]": fixed, "N_in3 [N m]": parts["N_in3"], "X_out2 [N]": swing}
    moved = of_table(tmp_path / "moved", 'moments_about = "fixed"', **changed)
    own = of_table(tmp_path / "own", **{"X_out2 [N]": swing})
    np.testing.assert_allclose(moved["N"], own["N"], rtol=1e-9)


def test_a_table_about_a_fixed_point_needs_the_mean_of_its_force(tmp_path):
    with pytest.raises(InputError, match="X_mean"):
        of_table(tmp_path, 'moments_about = "fixed"', **{"X_mean [N]": None, "X_in [N]": 3.0})
    with pytest.raises(InputError, match="no X"):
        of_table(tmp_path, 'moments_about = "fixed"', **{"X_mean [N]": None})


def test_a_point_that_may_stay_is_asked_for_by_what_it_does_to_the_added_mass(tmp_path):
    """A X is a hundredth of N's swing and a tenth of the part in phase, which is its added inertia."""
    asked = findings(tmp_path / "asked", record(), check="moment_point")
    assert [f.severity for f in asked] == ["warning"]
    assert not findings(tmp_path / "said", record(), 'moments_about = "body"\n', check="moment_point")


# -- amplitude, phase, frequency ------------------------------------------------------------------------


def test_the_displacement_of_a_table_is_its_amplitude(tmp_path):
    known = of_table(tmp_path / "a")
    other = of_table(tmp_path / "b", **{"vdot [m/s^2]": None, "displacement_m": AMPLITUDE})
    np.testing.assert_allclose(other[["vdot", "beta", "Y"]], known[["vdot", "beta", "Y"]], rtol=1e-9, atol=1e-9)
    both = of_table(tmp_path / "c", displacement_m=AMPLITUDE)
    np.testing.assert_allclose(both["vdot"], known["vdot"])
    with pytest.raises(InputError, match="amplitudes that agree"):
        of_table(tmp_path / "d", displacement_m=2.0 * AMPLITUDE)


@pytest.mark.parametrize("header", ["Stroke [mm]", "2A [mm]", "Hub [mm]", "Schwingbreite [mm]", "y_max - y_min [mm]"])
def test_a_way_between_both_ends_is_no_amplitude_of_a_table(tmp_path, header):
    """Twice the amplitude under another name; in a record the stroke is where the body is."""
    known = of_table(tmp_path / "known")
    own = {"vdot [m/s^2]": None, header: 2000.0 * AMPLITUDE}
    columns = f'[source.columns]\n"{header}" = "displacement"\n'
    with pytest.raises(InputError, match="way between both ends"):
        of_table(tmp_path / "silent", columns, **own)
    said = of_table(tmp_path / "said", f'{columns}[source.factor]\n"{header}" = 0.5\n', **own)
    np.testing.assert_allclose(said[["vdot", "beta", "Y"]], known[["vdot", "beta", "Y"]], rtol=1e-9, atol=1e-9)
    plain = of_table(
        tmp_path / "plain", columns.replace(header, "Weg [mm]"), **{**own, header: None, "Weg [mm]": 300.0}
    )
    np.testing.assert_allclose(plain["vdot"], known["vdot"], rtol=1e-9, atol=1e-9)
    table = record().rename(columns={"displacement_m": header})
    table[header] *= 1000.0
    swing = findings(tmp_path / "record", table, columns, f"frequency_hz = {FREQUENCY}\n", "inertia_sign")
    assert not swing
    assert read_campaign(tmp_path / "record").runs["vdot"].min() == pytest.approx(ACCELERATION, rel=1e-3)


def test_a_phase_that_nothing_says_is_named(tmp_path):
    bare = record().drop(columns="displacement_m")
    stated = f"frequency_hz = {FREQUENCY}\namplitude = {AMPLITUDE}\n"
    found = findings(tmp_path / "bare", bare, reduction=stated, check="motion")
    assert [f.severity for f in found] == ["warning"]
    assert "phase_deg" in found[0].remedy
    assert not findings(tmp_path / "said", bare, reduction=stated + "phase_deg = 0.0\n", check="motion")
    assert not findings(tmp_path / "measured", record(), reduction=f"frequency_hz = {FREQUENCY}\n", check="motion")


def test_the_frequency_of_a_record_may_be_a_channel_of_it(tmp_path):
    bare = record().drop(columns="displacement_m").assign(**{"frequency [rad/s]": OMEGA})
    stated = f"amplitude = {AMPLITUDE}\nphase_deg = 0.0\n"
    findings(tmp_path, bare, reduction=stated)
    runs = read_campaign(tmp_path).runs.set_index("run_id")
    assert runs["vdot"]["run+a"] == pytest.approx(ACCELERATION, rel=1e-9)
    with pytest.raises(InputError, match="frequency stated in the campaign too"):
        findings(tmp_path, bare, reduction=stated + f"frequency_hz = {FREQUENCY}\n")
    changing = bare.assign(**{"frequency [rad/s]": np.linspace(OMEGA, 1.2 * OMEGA, len(bare))})
    with pytest.raises(InputError, match="one frequency all along"):
        findings(tmp_path, changing, reduction=stated)


def test_samples_at_any_time_show_no_lag_that_is_not_there(tmp_path):
    """Of a steady sine nothing may be said, whatever the steps between its samples."""
    time = np.sort(np.random.default_rng(3).uniform(0.0, 80.0, 1600))
    table = record()
    angle = OMEGA * time
    table["time_s"], table["displacement_m"] = time, AMPLITUDE * np.sin(angle)
    table["Y_N"] = DAMPING * SPEED * np.cos(angle) + INERTIA * ACCELERATION * np.sin(angle)
    table["N_Nm"] = N_DAMPING * SPEED * np.cos(angle) + N_INERTIA * ACCELERATION * np.sin(angle)
    assert not findings(tmp_path, table, check="delay")


# -- weight in the loads ----------------------------------------------------------------------------


@pytest.mark.parametrize(("left_in", "expected"), [(0.0, 0), (0.3, 1)])
def test_the_added_mass_of_a_heaving_boat_is_no_weight(tmp_path, left_in, expected):
    """A seventh of the displaced weight either way at the ends of heave, and nothing in common."""
    weight = 4440e3 * 9.81
    table = record().rename(columns={"Y_N": "Z_N", "N_Nm": "M_Nm"})
    table["Z_N"] = table["Z_N"] * 0.15 * weight / np.abs(table["Z_N"]).max() - left_in * weight
    reduction = f"frequency_hz = {FREQUENCY}\n".replace("sway", "heave")
    campaign(tmp_path, history("run.csv", "", CONSTANTS, REDUCTION.replace("sway", "heave") + reduction))
    table.to_csv(tmp_path / "run.csv", index=False)
    found = [f for f in check_campaign(read_campaign(tmp_path), tmp_path) if f.check == "hydrostatic"]
    assert len(found) == expected


@pytest.mark.parametrize(("lever", "expected"), [(0.0, []), (0.02, ["M"])])
def test_a_moment_without_incidence_is_a_part_of_the_weight_times_the_length(tmp_path, lever, expected):
    weight, length = 4440e3 * 9.81, 70.2
    source = f'[[source]]\nfiles = "runs.csv"\n{CONSTANTS}'.replace('alpha = "0 deg"\n', "")
    campaign(tmp_path, source + 'test = "drift_vertical"\nrel_sigma = 0.03\n')
    rows = [f"{a},{-2e6 * a},{2e7 * a + lever * weight * length}" for a in (-8, -4, 0, 4, 8)]
    (tmp_path / "runs.csv").write_text("\n".join(["alpha_deg,Z_N,M_Nm", *rows]) + "\n", "utf-8")
    found = [f for f in check_campaign(read_campaign(tmp_path), tmp_path) if f.check == "hydrostatic"]
    assert [f.what[0] for f in found] == expected


# -- a body that swings across its path -----------------------------------------------------------

SWING = 0.1
# Y of sway velocity, yaw rate and both accelerations; N the same [SI], of a boat at 5 m/s.
YAWING = {"v": (-3.0e5, -2.0e6), "r": (9.0e5, -6.0e6), "vdot": (-9.0e5, -1.0e5), "rdot": (-1.0e5, -2.0e8)}


def swung(straight: bool, motion: str = "yaw") -> pd.DataFrame:
    """Yaw, or pitch by the same law with the sign of w, about an axis that is towed straight or along the path."""
    time = np.arange(0.0, 80.0, 0.05)
    angle = SWING * np.sin(OMEGA * time)
    rate, change = SWING * OMEGA * np.cos(OMEGA * time), -SWING * OMEGA**2 * np.sin(OMEGA * time)
    across = -1.0 if motion == "yaw" else 1.0
    state = {"r": rate, "rdot": change, "v": 0.0 * time, "vdot": 0.0 * time}
    if straight:
        state |= {"v": across * 5.0 * np.sin(angle), "vdot": across * 5.0 * np.cos(angle) * rate}
    loads = [sum(YAWING[k][c] * state[k] for k in state) for c in (0, 1)]
    noise = np.random.default_rng(2).standard_normal((3, time.size))
    force, moment = ("Y_N", "N_Nm") if motion == "yaw" else ("Z_N", "M_Nm")
    table = pd.DataFrame({"time_s": time, "X_N": X + 10 * noise[0], force: loads[0] + 10 * noise[1]})
    return table.assign(**{moment: loads[1] + 10 * noise[2], "displacement_rad": angle})


def yawed(folder, table: pd.DataFrame, path: str, angles: str = "flight", motion: str = "yaw"):
    across = {b: 5.0 * math.sin(math.radians(b)) for b in (-8, -4, 0, 4, 8)}
    rows = [f"d{b},{b},{X},{YAWING['v'][0] * v},{YAWING['v'][1] * v}\n" for b, v in across.items()]
    steady = CONSTANTS.replace('beta = "0 deg"\n', "") + 'test = "drift_horizontal"\nrel_sigma = 0.05\n'
    reduction = REDUCTION.replace("sway", motion) + (f'path = "{path}"\n' if path else "")
    frame = f'x = "forward"\ny = "starboard"\nz = "down"\nangles = "{angles}"'
    both = history("run.csv", "", CONSTANTS, reduction) + f'[[source]]\nfiles = "drift.csv"\n{steady}'
    campaign(folder, both, frame=frame)
    table.to_csv(folder / "run.csv", index=False)
    (folder / "drift.csv").write_text("run_id,beta_deg,X_N,Y_N,N_Nm\n" + "".join(rows), "utf-8")
    done = read_campaign(folder)
    swings = done.runs[done.runs["file"] == "run.csv"]
    return done, swings.set_index(swings["run_id"].str[-2:])


@pytest.mark.parametrize("angles", ["flight", "ittc"])
@pytest.mark.parametrize("motion", ["yaw", "pitch"])
def test_a_body_on_a_straight_path_stands_at_its_angle(tmp_path, motion, angles):
    """At the ends of yaw v = -U sin psi, of pitch w = U sin theta; loads of angle and acceleration."""
    done, at = yawed(tmp_path, swung(True, motion), "straight", angles, motion)
    angle, sign = ("beta", -1.0) if motion == "yaw" else ("alpha", 1.0)
    for end, side in (("+a", 1.0), ("-a", -1.0)):
        assert at[angle][end] == pytest.approx(sign * side * SWING, rel=1e-9)
        law = YAWING["v"][0] * sign * 5.0 * math.sin(side * SWING) - YAWING["rdot"][0] * side * SWING * OMEGA**2
        assert at["Y" if motion == "yaw" else "Z"][end] == pytest.approx(law, rel=1e-3)
    # Rate and acceleration across are one load at the other ends.
    assert set(at.loc[["+v", "-v"], "exclude"]) == {"X Y Z K M N"}
    assert at["reason"]["+v"].startswith(f"{motion} on a straight path")
    assert not [f for f in check_campaign(done, tmp_path) if f.check in ("motion", "inertia_left_in", "inertia_sign")]


def test_the_path_of_a_yawing_body_is_asked_for_where_its_force_is_that_of_drift(tmp_path):
    asked = {}
    for name, straight, path in (("silent", True, ""), ("along", False, ""), ("said", True, "tangent")):
        done, _ = yawed(tmp_path / name, swung(straight), path)
        asked[name] = [
            f.severity for f in check_campaign(done, tmp_path / name) if "path" in f.what and f.check == "motion"
        ]
    assert asked == {"silent": ["warning"], "along": [], "said": []}


def test_only_yaw_and_pitch_have_a_path(tmp_path):
    with pytest.raises(InputError, match="no path: only a body that yaws or pitches"):
        of_table(tmp_path, reduction=REDUCTION + 'path = "straight"\n')
