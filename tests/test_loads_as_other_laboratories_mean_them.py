"""Loads along other axes, about points that move, with buoyancy, lag and faults in them: made from a known law.

Each test writes a record from a law that is known (a load linear in velocity and acceleration), puts one
habit of a laboratory on it by hand, and asks for the law back.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_campaigns import CONSTANTS, campaign, history

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from ident.timeseries.faults import usual
from sim.files.errors import InputError

RHO, LENGTH, SPEED = 1000.0, 70.2, 2.0
# The law of the body: X = -R, Y = Yv v + Yvdot vdot, N = Nv v + Nvdot vdot [SI].
RESISTANCE, YV, YVDOT, NV, NVDOT = 30.0, -400.0, -900.0, -350.0, -30.0
FREQUENCY, AMPLITUDE = 0.25, 0.3
OMEGA = 2.0 * math.pi * FREQUENCY
SWAY = '[source.reduction]\nkind = "oscillatory"\nmotion = "sway"\nfrequency_hz = 0.25\n'
STRAIGHT = CONSTANTS.replace('test = "drift_horizontal"\n', "").replace('beta = "5 deg"', 'beta = "0 deg"')


def record(seconds: float = 80.0, rate: float = 20.0, frequency: float = FREQUENCY, start: float = 0.0) -> pd.DataFrame:
    """A sway history by the law, with noise of a thousandth."""
    t = np.arange(int(seconds * rate)) / rate
    w = 2.0 * math.pi * frequency
    v, a = AMPLITUDE * w * np.cos(w * t), -AMPLITUDE * w**2 * np.sin(w * t)
    noise = np.random.default_rng(5).standard_normal((t.size, 3)) * 0.3
    columns = {"time_s": t + start, "X_N": -RESISTANCE + noise[:, 0], "Y_N": YV * v + YVDOT * a + noise[:, 1]}
    columns |= {"N_Nm": NV * v + NVDOT * a + noise[:, 2], "displacement_m": AMPLITUDE * np.sin(w * t)}
    return pd.DataFrame(columns)


def law_of(runs: pd.DataFrame) -> tuple[float, float, float, float]:
    """Yv, Yvdot, Nv, Nvdot of the four instants of a sway cycle."""
    at = runs.set_index(runs["run_id"].str[-2:])
    v = (at["U"] * np.sin(at["beta"]))["+v"]
    a = at["vdot"]["+a"]
    half = {o: ((at[o]["+v"] - at[o]["-v"]) / 2.0 / v, (at[o]["+a"] - at[o]["-a"]) / 2.0 / a) for o in "YN"}
    return (*half["Y"], *half["N"])


def swayed(folder: Path, table: pd.DataFrame, keys: str = "", reduction: str = SWAY, **tables: str) -> pd.DataFrame:
    campaign(folder, history("sway.csv", keys, STRAIGHT, reduction), **tables)
    table.to_csv(folder / "sway.csv", index=False)
    return read_campaign(folder).runs


def assert_law(runs: pd.DataFrame, rel: float = 0.01) -> None:
    assert law_of(runs) == pytest.approx((YV, YVDOT, NV, NVDOT), rel=rel)


# -- the motion ----------------------------------------------------------------------------------


@pytest.mark.parametrize("off", [0.0, 0.006, -0.02])
@pytest.mark.parametrize("measured", [True, False])
def test_the_records_own_frequency_is_used_and_named(tmp_path, off, measured):
    table = record(frequency=FREQUENCY * (1.0 + off))
    table = table if measured else table.drop(columns="displacement_m")
    reduction = SWAY if measured else SWAY + "amplitude = 0.3\nphase_deg = 0.0\n"
    assert_law(swayed(tmp_path, table, reduction=reduction))
    done = read_campaign(tmp_path)
    found = [f for f in check_campaign(done, tmp_path) if f.check == "motion"]
    assert bool(found) == bool(off)
    assert all("0.25 Hz stated" in f.what for f in found)


def test_a_frequency_nothing_oscillates_at_is_refused(tmp_path):
    with pytest.raises(InputError, match="oscillates at"):
        swayed(tmp_path, record(frequency=0.27))


def test_a_frequency_that_is_not_stated_is_found_in_the_displacement(tmp_path):
    assert_law(swayed(tmp_path, record(), reduction=SWAY.replace("frequency_hz = 0.25\n", "")))
    with pytest.raises(InputError, match="no frequency"):
        swayed(tmp_path, record().drop(columns="displacement_m"), reduction=SWAY.replace("frequency_hz = 0.25\n", ""))


def test_a_clock_that_does_not_start_at_zero_asks_for_the_phase(tmp_path):
    late = record(start=36001.3)
    assert_law(swayed(tmp_path / "a", late))
    bare = late.drop(columns="displacement_m")
    with pytest.raises(InputError, match="phase_deg"):
        swayed(tmp_path / "b", bare, reduction=SWAY + "amplitude = 0.3\n")
    # The displacement is zero at 36001.3 s, so at time zero of the clock it has this phase.
    phase = math.degrees(math.remainder(-OMEGA * 36001.3, 2.0 * math.pi))
    assert_law(swayed(tmp_path / "c", bare, reduction=f"{SWAY}amplitude = 0.3\nphase_deg = {phase:.9f}\n"))


def test_a_stated_delay_of_the_load_channels_is_taken_off(tmp_path):
    table, lag = record(), 0.05
    t = table["time_s"].to_numpy()
    w = OMEGA * (t - lag)
    table["Y_N"] = YV * AMPLITUDE * OMEGA * np.cos(w) - YVDOT * AMPLITUDE * OMEGA**2 * np.sin(w)
    table["N_Nm"] = NV * AMPLITUDE * OMEGA * np.cos(w) - NVDOT * AMPLITUDE * OMEGA**2 * np.sin(w)
    assert law_of(swayed(tmp_path / "a", table))[0] != pytest.approx(YV, rel=0.1)
    assert_law(swayed(tmp_path / "b", table, reduction=SWAY + "delay_s = { Y = 0.05, N = 0.05 }\n"))


def started(lag: float) -> pd.DataFrame:
    """Sway from rest with a smooth ramp over two cycles, loads by the law and late by ``lag``."""
    table = record()

    def motion(t):
        at = math.pi * np.clip(t / 8.0, 0.0, 1.0)
        ramp, rate, bend = 0.5 - 0.5 * np.cos(at), np.sin(at) * math.pi / 16.0, np.cos(at) * math.pi**2 / 128.0
        bend = np.where((t > 0.0) & (t < 8.0), bend, 0.0)
        s, c = np.sin(OMEGA * t), np.cos(OMEGA * t)
        v = rate * s + ramp * OMEGA * c
        a = bend * s + 2.0 * rate * OMEGA * c - ramp * OMEGA**2 * s
        return AMPLITUDE * ramp * s, AMPLITUDE * v, AMPLITUDE * a

    t = table["time_s"].to_numpy()
    noise = np.random.default_rng(3).standard_normal((t.size, 2)) * [2.0, 1.0]
    _, v, a = motion(t - lag)
    table["displacement_m"] = motion(t)[0]
    table["Y_N"], table["N_Nm"] = YV * v + YVDOT * a + noise[:, 0], NV * v + NVDOT * a + noise[:, 1]
    return table


@pytest.mark.parametrize("lag", [0.0, 0.05, -0.03])
def test_a_delay_of_the_loads_is_found_where_the_motion_starts_from_rest(tmp_path, lag):
    """And the stated one is taken off what is found."""
    swayed(tmp_path / "a", started(lag))
    (one,) = read_campaign(tmp_path / "a").reduced
    (late,) = one.delays
    assert abs(late.seconds - lag) < 3.0 * late.stderr
    assert late.stderr < 0.01
    found = [f for f in check_campaign(read_campaign(tmp_path / "a"), tmp_path / "a") if f.check == "delay"]
    assert bool(found) == bool(lag)
    if lag:
        delays = f"delay_s = {{ Y = {lag}, N = {lag} }}\nstart_s = 12.0\n"
        assert_law(swayed(tmp_path / "b", started(lag), reduction=SWAY + delays), rel=0.02)
        delays = f"delay_s = {{ X = {lag}, Y = {lag}, N = {lag} }}\n"
        swayed(tmp_path / "c", started(lag), reduction=SWAY + delays)
        assert not [f for f in check_campaign(read_campaign(tmp_path / "c"), tmp_path / "c") if f.check == "delay"]


def test_a_steady_oscillation_shows_no_delay_and_none_is_named(tmp_path):
    """One line: a lag is another added mass, so nothing may be said."""
    swayed(tmp_path, record())
    assert not read_campaign(tmp_path).reduced[0].delays


def test_noise_of_the_displacement_is_no_motion_that_shows_a_lag(tmp_path):
    """A steady line 0.15 s late under a hundredth of noise: no lag can be seen, and none of another size is named."""
    table = record()
    noise = 0.01 * AMPLITUDE * np.random.default_rng(3).standard_normal(len(table))
    table["displacement_m"] = AMPLITUDE * np.sin(OMEGA * (table["time_s"] - 0.15)) + noise
    swayed(tmp_path, table)
    assert not read_campaign(tmp_path).reduced[0].delays


def test_a_commanded_motion_that_rests_before_it_starts_shows_the_lag(tmp_path):
    """Six seconds at one value to the last digit are a rest there, not a stuck channel."""
    table = started(0.05)
    rest = pd.DataFrame({k: np.full(120, table[k].iloc[0]) for k in table})
    rest[["Y_N", "N_Nm"]] += np.random.default_rng(4).standard_normal((120, 2)) * [2.0, 1.0]
    table = pd.concat([rest, table], ignore_index=True)
    table["time_s"] = np.arange(len(table)) / 20.0
    swayed(tmp_path, table)
    (late,) = read_campaign(tmp_path).reduced[0].delays
    assert abs(late.seconds - 0.05) < 3.0 * late.stderr
    assert late.stderr < 0.01


@pytest.mark.parametrize("late", [0.0, 0.04])
def test_a_measured_acceleration_has_its_amplitude_and_shows_the_delay_of_its_system(tmp_path, late):
    table = record()
    table["vdot_mps2"] = -AMPLITUDE * OMEGA**2 * np.sin(OMEGA * (table["time_s"] - late))
    table["vdot_mps2"] += 0.01 * np.random.default_rng(8).standard_normal(len(table))
    assert_law(swayed(tmp_path, table))
    found = [f for f in check_campaign(read_campaign(tmp_path), tmp_path) if f.check == "delay"]
    assert bool(found) == bool(late)
    (one,) = read_campaign(tmp_path).reduced[0].delays
    assert abs(one.seconds - late) < 4.0 * one.stderr
    assert one.stderr < 1e-3


# -- where the loads are -------------------------------------------------------------------------


def test_moments_about_a_point_that_stays_behind_the_swaying_body(tmp_path):
    """M about the body's point is M - d x F; d along sway gives N + d X."""
    table = record()
    table["N_Nm"] -= table["displacement_m"] * table["X_N"]
    assert law_of(swayed(tmp_path / "a", table))[3] != pytest.approx(NVDOT, rel=0.1)
    assert_law(swayed(tmp_path / "b", table, keys='moments_about = "fixed"'))


@pytest.mark.parametrize("beta", [-12.0, 0.0, 8.0])
def test_drag_and_side_force_are_turned_to_the_body(tmp_path, beta):
    """X = -D cos b - S sin b by hand with drag D against the flow and S across it."""
    b = math.radians(beta)
    x, y, n = -RESISTANCE, YV * SPEED * math.sin(b), NV * SPEED * math.sin(b)
    along, across = x * math.cos(b) + y * math.sin(b), -x * math.sin(b) + y * math.cos(b)
    text = f"run_id,X_N,Y_N,N_Nm\na,{along!r},{across!r},{n!r}\n"
    for name, axes, aft in (("flow", "flow", False), ("tank", "tank", False), ("aft", "flow", True)):
        frame = 'x = "forward"\ny = "starboard"\nz = "down"\nangles = "flight"\n'
        if aft:
            frame = 'x = "aft"\ny = "starboard"\nz = "up"\nangles = "ittc"\n'
        signs = (-1.0, 1.0, -1.0) if aft else (1.0, 1.0, 1.0)
        own = f"run_id,X_N,Y_N,N_Nm\na,{along * signs[0]!r},{across * signs[1]!r},{n * signs[2]!r}\n" if aft else text
        constants = CONSTANTS.replace("5 deg", f"{-beta if aft else beta} deg") + "rel_sigma = 0.05\n"
        campaign(tmp_path / name, f'[[source]]\nfiles = "runs.csv"\naxes = "{axes}"\n{constants}', frame=frame)
        (tmp_path / name / "runs.csv").write_text(own, "utf-8")
        run = read_campaign(tmp_path / name).runs.iloc[0]
        assert (run["X"], run["Y"], run["N"]) == pytest.approx((x, y, n), abs=1e-9)


def test_drag_and_lift_with_moments_along_the_mesh(tmp_path):
    """A solver's forces along the flow, its moments along the mesh that the hull is not turned in; both angles."""
    rows, header = [], "run_id,alpha_deg,beta_deg,X_N,Y_N,Z_N,K_Nm,M_Nm,N_Nm"
    for k, (alpha, beta) in enumerate([(0, 8), (6, -6), (8, 0), (-4, 10)]):
        a, b = math.radians(alpha), math.radians(beta)
        force, moment = np.array([-30.0, -80.0 * b, -50.0 * a]), np.array([-5.0 * b, 40.0 * a, -70.0 * b])
        ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
        # The flow's axes in the body, by hand: along the velocity, y turned with it, z of the lift.
        axes = np.array([[ca * cb, sb, sa * cb], [-ca * sb, cb, -sa * sb], [-sa, 0.0, ca]])
        own = ",".join(f"{x!r}" for x in map(float, (*axes @ force, *moment)))
        rows.append((f"r{k},{alpha},{beta},{own}", force, moment))
    text = "\n".join([header, *(r for r, _, _ in rows)]) + "\n"
    constants = CONSTANTS.replace('alpha = "0 deg"\n', "").replace('beta = "5 deg"\n', "") + "rel_sigma = 0.05\n"
    frame = 'x = "forward"\ny = "starboard"\nz = "down"\nangles = "flight"\n'
    ways = {
        "source": ('axes = "flow"\nmoment_axes = "body"\n', frame),
        "frame": ("", frame + 'axes = "flow"\nmoment_axes = "body"\n'),
        "silent": ('axes = "flow"\n', frame),
    }
    for name, (keys, own_frame) in ways.items():
        campaign(tmp_path / name, f'[[source]]\nfiles = "runs.csv"\n{keys}{constants}', frame=own_frame)
        (tmp_path / name / "runs.csv").write_text(text, "utf-8")
        done = read_campaign(tmp_path / name)
        got, want = done.runs[[*"XYZKMN"]].to_numpy(float), np.array([[*f, *m] for _, f, m in rows])
        assert got[:, :3] == pytest.approx(want[:, :3], abs=1e-9)
        asked = [f for f in check_campaign(done, tmp_path / name) if f.check == "flow_axes" and "too?" in f.what]
        # Where nothing says it, both are turned and it is asked.
        assert (got[:, 3:] == pytest.approx(want[:, 3:], abs=1e-9)) == (name != "silent")
        assert bool(asked) == (name == "silent")


def test_a_sheet_over_both_angles_shows_loads_along_the_flow(tmp_path):
    """Drag and lift called body loads, in a wind tunnel's sheet of drift and incidence under one test."""
    rows = ["run_id,alpha_deg,beta_deg,X_N,Y_N,Z_N,K_Nm,M_Nm,N_Nm"]
    for alpha, beta in [(a, 0) for a in (-12, -6, 0, 6, 12)] + [(0, b) for b in (-12, -6, 6, 12)]:
        a, b = math.radians(alpha), math.radians(beta)
        x, y, z = -30.0, -400.0 * b, -300.0 * a
        along, across = x * math.cos(b) + y * math.sin(b), y * math.cos(b) - x * math.sin(b)
        along, down = along * math.cos(a) + z * math.sin(a), z * math.cos(a) - x * math.sin(a)
        rows.append(f"r{alpha}/{beta},{alpha},{beta},{along!r},{across!r},{down!r},0,{200 * a!r},{-300 * b!r}")
    constants = CONSTANTS.replace('alpha = "0 deg"\n', "").replace('beta = "5 deg"\n', "") + "rel_sigma = 0.05\n"
    campaign(tmp_path, f'[[source]]\nfiles = "runs.csv"\n{constants}')
    (tmp_path / "runs.csv").write_text("\n".join(rows) + "\n", "utf-8")
    named = [f for f in check_campaign(read_campaign(tmp_path), tmp_path) if f.check == "flow_axes"]
    assert [f.severity for f in named] == ["error"]


def test_a_wind_tunnel_has_its_own_speed_and_displaces_air(tmp_path):
    """45 m/s at a scale of 18.3 are 193 m/s by Froude's law, which no tunnel keeps; 200 m/s in it are too many."""
    frame = 'x = "forward"\ny = "starboard"\nz = "down"\nangles = "flight"\n'
    constants = CONSTANTS.replace('beta = "5 deg"\n', "") + "rel_sigma = 0.02\n"
    for name, speed in (("tunnel", 45.0), ("supersonic", 200.0)):
        scale, rho = 18.348, 1.21
        force, length = 0.5 * rho * speed**2 * (70.2 / scale) ** 2, 70.2 / scale
        rows = ["run_id,beta_deg,X_N,Y_N,N_Nm"]
        for beta in (-12, -6, 0, 6, 12):
            b = math.sin(math.radians(beta))
            rows.append(f"w{beta},{beta},{-0.00103 * force},{-0.072 * b * force},{-0.017 * b * force * length}")
        tables = {"scale": f"ratio = {scale}\nlength_m = {length!r}", "fluid": f'density_kgpm3 = {rho}\nsource = "air"'}
        own = re.sub(r'U = "[^"]*"', f'U = "{speed} m/s"', constants)
        campaign(tmp_path / name, f'[[source]]\nfiles = "runs.csv"\n{own}', frame=frame, **tables)
        (tmp_path / name / "runs.csv").write_text("\n".join(rows) + "\n", "utf-8")
        named = {
            f.check for f in check_campaign(read_campaign(tmp_path / name), tmp_path / name) if f.severity == "error"
        }
        assert named == ({"state"} if name == "supersonic" else set())


def test_loads_of_a_yawing_body_along_the_axes_of_the_tank(tmp_path):
    """Sampled along axes at rest, where the body turns by 0.3 sin(wt)."""
    t = np.arange(1600) / 20.0
    psi = 0.3 * np.sin(OMEGA * t)
    r, rdot = 0.3 * OMEGA * np.cos(OMEGA * t), -0.3 * OMEGA**2 * np.sin(OMEGA * t)
    x, y, n = np.full(t.size, -RESISTANCE), 50.0 * r - 20.0 * rdot, -500.0 * r - 900.0 * rdot
    table = pd.DataFrame({"time_s": t, "X_N": x * np.cos(psi) - y * np.sin(psi)})
    table["Y_N"] = x * np.sin(psi) + y * np.cos(psi)
    table["N_Nm"], table["displacement_rad"] = n, psi
    yaw = SWAY.replace("sway", "yaw")
    runs = swayed(tmp_path, table, keys='axes = "tank"', reduction=yaw)
    at = runs.set_index(runs["run_id"].str[-2:])
    assert at["X"].to_numpy() == pytest.approx(np.full(4, -RESISTANCE), abs=1e-6)
    assert at["Y"]["+v"] == pytest.approx(50.0 * 0.3 * OMEGA, rel=1e-6)
    assert at["Y"]["+a"] == pytest.approx(20.0 * 0.3 * OMEGA**2, rel=1e-6)
    assert at["N"]["+a"] == pytest.approx(900.0 * 0.3 * OMEGA**2, rel=1e-6)
    with pytest.raises(InputError, match="tank or body"):
        swayed(tmp_path / "flow", table, keys='axes = "flow"', reduction=yaw)


@pytest.mark.parametrize("attitude", ["level", "pitched"])
def test_buoyancy_is_taken_off_with_its_moment(tmp_path, attitude):
    """At 4 deg of incidence; B acts 0.5 m ahead of the origin, upwards in the tank."""
    alpha, force, arm = math.radians(4.0), 9100.0, 0.5
    pitch = alpha if attitude == "pitched" else 0.0
    x, z = force * math.sin(pitch), -force * math.cos(pitch)
    text = f"run_id,X_N,Z_N,M_Nm\na,{-30.0 + x!r},{-20.0 + z!r},{15.0 - arm * z!r}\n"
    constants = CONSTANTS.replace("drift_horizontal", "drift_vertical").replace('alpha = "0 deg"', 'alpha = "4 deg"')
    constants = constants.replace("5 deg", "0 deg") + "rel_sigma = 0.05\n"
    tables = {"hydrostatics": f'force_n = {force}\ncentre_m = [{arm}, 0.0, 0.0]\nattitude = "{attitude}"\nsource = "s"'}
    campaign(tmp_path, f'[[source]]\nfiles = "runs.csv"\n{constants}', **tables)
    (tmp_path / "runs.csv").write_text(text, "utf-8")
    run = read_campaign(tmp_path).runs.iloc[0]
    assert (run["X"], run["Z"], run["M"]) == pytest.approx((-30.0, -20.0, 15.0), abs=1e-9)


@pytest.mark.parametrize("motion", ["roll", "pitch", "heave"])
def test_buoyancy_turns_in_the_axes_of_a_body_that_rolls_or_pitches(tmp_path, motion):
    """Gravity by hand, sample by sample; a heaving body keeps its attitude, whatever its flow."""
    force, (x, z), swing = 9100.0, (0.3, -0.2), 0.25
    t = np.arange(1600) / 20.0
    angle = swing * np.sin(OMEGA * t)
    phi, theta = (angle if motion == m else 0.0 * angle for m in ("roll", "pitch"))
    up = -force * np.stack([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)], axis=1)
    loads = np.hstack([up, np.cross([x, 0.0, z], up)])
    # The water's: a damping and an added inertia about the axis that moves.
    own = {"roll": 3, "pitch": 4, "heave": 2}[motion]
    loads[:, own] += -500.0 * swing * OMEGA * np.cos(OMEGA * t) + 900.0 * swing * OMEGA**2 * np.sin(OMEGA * t)
    table = pd.DataFrame(loads, columns=["X_N", "Y_N", "Z_N", "K_Nm", "M_Nm", "N_Nm"])
    table.insert(0, "time_s", t)
    table["displacement_m" if motion == "heave" else "displacement_rad"] = angle
    hydrostatics = f'force_n = {force}\ncentre_m = [{x}, 0.0, {z}]\nattitude = "pitched"\nsource = "s"'
    runs = swayed(tmp_path, table, reduction=SWAY.replace("sway", motion), hydrostatics=hydrostatics)
    at = runs.set_index(runs["run_id"].str[-2:])
    load = "XYZKMN"[own]
    assert at[load]["+a"] == pytest.approx(900.0 * swing * OMEGA**2, rel=3e-4)
    assert at[load]["-v"] == pytest.approx(500.0 * swing * OMEGA, rel=3e-4)
    others = at[[o for o in "XYZKMN" if o != load]].to_numpy(float)
    # The third harmonic is left out of the ends of the acceleration; nothing else is.
    assert np.abs(others).max() < 1e-4 * force
    assert not {"stood", "heel", "trim"} & set(runs)
    assert not [f for f in check_campaign(read_campaign(tmp_path), tmp_path) if f.check == "hydrostatic"]
    if motion == "pitch":
        # Half of the boat's weight, left in.
        table["Z_N"] -= 2.2e7
        swayed(tmp_path / "left_in", table, reduction=SWAY.replace("sway", motion))
        named = check_campaign(read_campaign(tmp_path / "left_in"), tmp_path / "left_in")
        assert [f for f in named if f.check == "hydrostatic"]


# -- samples that are no measurements --------------------------------------------------------------


def steady(n: int = 800) -> np.ndarray:
    return np.array([-30.0, -75.0, -90.0]) + 0.5 * np.random.default_rng(9).standard_normal((n, 3)).round(3)


FAULTS = {
    "one sentinel": (lambda y: y.__setitem__(400, -9999.0), "sentinel"),
    "one in ten": (lambda y: y.__setitem__(slice(5, None, 10), 9999.0), "sentinel"),
    "spike": (lambda y: y.__setitem__(333, 812.3), "spike"),
    "zeros": (lambda y: y.__setitem__(slice(200, 240), 0.0), "stuck"),
    "many spikes of one side": (lambda y: y.__setitem__(slice(7, None, 29), y[7::29] * 40 - 800), "spike"),
    "single zeros": (lambda y: y.__setitem__([50, 310, 702], 0.0), "spike"),
    "frozen to the end": (lambda y: y.__setitem__(slice(500, None), y[499]), "stuck"),
    "at the limit": (lambda y: y.__setitem__(slice(300, 420), -100.0), "stuck"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_a_channel_are_left_out_and_named(tmp_path, fault):
    values = steady()
    spoil, kind = FAULTS[fault]
    spoil(values[:, 1])
    campaign(tmp_path, history("run.csv"))
    table = pd.DataFrame(values, columns=["X_N", "Y_N", "N_Nm"])
    table.insert(0, "time_s", np.arange(len(table)) * 0.05)
    table.to_csv(tmp_path / "run.csv", index=False)
    done = read_campaign(tmp_path)
    run = done.runs.iloc[0]
    assert abs(run["Y"] + 75.0) < 4.0 * run["s_Y"]
    assert run["s_Y"] < 0.06
    assert f"{kind} samples of Y left out" in run["reduction"]
    assert {k for k, name in done.reduced[0].left_out if name == "Y"} == {kind}
    assert {name for _, name in done.reduced[0].left_out} == {"Y"}
    assert not done.reduced[0].clipped


def test_tops_of_a_motion_without_noise_are_no_limit():
    """Twenty cycles whose two highest samples are the same but for rounding: nothing is cut off."""
    time = np.arange(0.0, 80.0, 0.1) + 12.3
    record = 0.3 * np.sin(0.5 * np.pi * time)[:, None]
    assert not usual(iter([record]), ["displacement"], [()]).clipped
    assert usual(iter([np.minimum(record, 0.2)]), ["displacement"], [()]).clipped


def test_a_clipped_channel_is_an_error(tmp_path):
    values = steady()
    values[:, 1] = np.maximum(values[:, 1], -75.2)
    campaign(tmp_path, history("run.csv"))
    table = pd.DataFrame(values, columns=["X_N", "Y_N", "N_Nm"])
    table.insert(0, "time_s", np.arange(len(table)) * 0.05)
    table.to_csv(tmp_path / "run.csv", index=False)
    assert "Y is clipped" in read_campaign(tmp_path).runs["reduction"].iloc[0]


@pytest.mark.parametrize("value", [-0.12, 0.21, 1e-7, 3.3e5])
def test_a_sound_record_loses_nothing(tmp_path, value):
    """Noise, a constant channel whose block means differ by rounding, a settled one, a slow drift."""
    values = steady()
    campaign(tmp_path, history("run.csv"))
    table = pd.DataFrame(values, columns=["X_N", "Y_N", "N_Nm"])
    table.insert(0, "time_s", np.arange(len(table)) * 0.05)
    table["Z_N"] = value
    table.to_csv(tmp_path / "run.csv", index=False)
    one = read_campaign(tmp_path).reduced[0]
    assert not one.left_out
    assert not one.clipped
    assert not one.fit.cut


def test_a_computed_load_that_settles_is_not_stuck(tmp_path):
    t = np.arange(1, 1500)
    y = (-75.0 * (1.0 - np.exp(-t / 40.0) * np.cos(t / 15.0))).round(6)
    campaign(tmp_path, history("run.csv"))
    pd.DataFrame({"time_s": t * 1.0, "X_N": -30.0, "Y_N": y, "N_Nm": 1.2 * y}).to_csv(tmp_path / "run.csv", index=False)
    done = read_campaign(tmp_path)
    assert not done.reduced[0].left_out
    assert done.runs["Y"].iloc[0] == pytest.approx(-75.0, rel=1e-3)
