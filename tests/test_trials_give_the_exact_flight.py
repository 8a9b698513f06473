"""Records of one zigzag and one turning circle, written as trial teams write them, give the exact flight's metrics."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner
from trial_records import SCALE, approach, truth, turn, turned, write, zigzag

from ident.cli import main
from ident.trials.spec import TrialFile
from ident.trials.trial import measure_trial
from sim.files.errors import InputError

COUNT = 60


def held(path, known, spec=None, sigmas=3.0):
    """Every metric that the record allows is within three of its stated errors of the truth."""
    done = measure_trial(path, spec, COUNT)
    shared = set(known) & set(done.metrics)
    assert shared
    for name in shared:
        found = done.metrics[name]
        assert abs(found.value - known[name]) <= sigmas * found.sigma, (name, found, known[name])
    return done


def noisy(values, sigma, seed=0):
    return values + np.random.default_rng(seed).normal(0.0, sigma, values.size)


def columns(one, *names):
    units = {"t": "time [s]", "psi": "psi [deg]", "r": "r [deg/s]", "u": "u [m/s]", "dH": "dH [deg]"}
    units |= {"x": "x [m]", "y": "y [m]", "speed": "speed [m/s]"}
    return {units[n]: one[n] for n in names}


@pytest.mark.parametrize("sigma", [0.0, 0.05, 0.1, 0.2])
def test_zigzag_with_heading_noise(tmp_path, sigma):
    one = zigzag()
    record = columns(one, "t", "psi", "r", "u", "x", "y", "dH")
    record["psi [deg]"] = noisy(one["psi"], sigma)
    record["r [deg/s]"] = noisy(one["r"], sigma / 2.0, 1)
    done = held(write(tmp_path / "zz.csv", record), truth()["zigzag"])
    assert str(done.maneuver) == "zigzag 20/20"
    assert set(truth()["zigzag"]) <= set(done.metrics)


@pytest.mark.parametrize("heading", [-3.0, 5.0, 60.0, 350.0])
def test_zigzag_on_any_course_with_a_compass(tmp_path, heading):
    one = zigzag()
    record = {
        "time [s]": one["t"],
        "heading [deg]": np.mod(one["psi"] + heading, 360.0),
        "SOG [kn]": one["u"] / 0.514444,
    }
    done = held(write(tmp_path / "zz.csv", record), truth()["zigzag"])
    assert any("check angle 20 deg" in text and "State it" in text for text in done.assumed)


def test_zigzag_with_an_approach(tmp_path):
    one = approach(zigzag(), 60.0)
    record = columns(one, "t", "psi", "r", "u", "x", "y", "dH")
    record["psi [deg]"] = noisy(one["psi"], 0.02)
    done = held(write(tmp_path / "zz.csv", record), truth()["zigzag"])
    assert any("execute between 59.50 and 60.00 s" in text for text in done.assumed)
    exact = TrialFile.model_validate({"execute_s": 60.0})
    found = held(tmp_path / "zz.csv", truth()["zigzag"], exact)
    assert found.metrics["execute_2_s"].sigma < 0.05


def test_rudder_that_moves_at_its_rate_and_a_restless_approach(tmp_path):
    one = approach(zigzag(), 60.0)
    known = truth()["zigzag"]
    times = [60.0 + t for t in (0.0, known["execute_2_s"], known["execute_3_s"], known["execute_4_s"])]
    rate, angles = 7.11, [-20.0, 20.0, -20.0, 20.0]
    points, values, now = [0.0], [0.0], 0.0
    for time, angle in zip(times, angles, strict=True):
        points += [time, time + abs(angle - now) / rate]
        values += [now, angle]
        now = angle
    rudder = np.interp(one["t"], [*points, 300.0], [*values, now])
    # Course keeping before the execute: two degrees of rudder now and then.
    rudder += np.where((one["t"] > 20.0) & (one["t"] < 24.0), 2.0, 0.0)
    record = {"t [s]": one["t"], "psi [deg]": noisy(one["psi"], 0.1), "rudder [deg]": noisy(rudder, 0.05, 2)}
    done = held(write(tmp_path / "zz.csv", record), known)
    assert str(done.maneuver) == "zigzag 20/20"
    assert done.start.time == pytest.approx(60.0, abs=0.35)


def test_model_scale_by_froude(tmp_path):
    one, root = zigzag(), math.sqrt(SCALE)
    record = {"time [s]": one["t"] / root, "psi [deg]": one["psi"], "r [deg/s]": one["r"] * root}
    record |= {"u [m/s]": one["u"] / root, "dH [deg]": one["dH"]}
    path = write(tmp_path / "zz.csv", record, 6)
    done = held(path, truth()["zigzag"], TrialFile(scale=SCALE))
    assert done.metrics["approach_speed_mps"].value == pytest.approx(5.1442, abs=1e-3)
    unscaled = measure_trial(path, None, 10)
    assert unscaled.metrics["overshoot_1_deg"].value == pytest.approx(truth()["zigzag"]["overshoot_1_deg"], abs=0.01)
    assert any(text.startswith("scale 1:") for text in unscaled.assumed)


def test_semicolons_decimal_commas_and_german_headers(tmp_path):
    one = zigzag()
    lines = ["Zeit [s];Kurs [deg];Drehrate [deg/min];Fahrt [kn]"]
    for t, psi, r, u in zip(one["t"], one["psi"], one["r"], one["u"], strict=True):
        lines.append(f"{t:.2f};{psi:.3f};{60 * r:.3f};{u / 0.514444:.3f}".replace(".", ","))
    (tmp_path / "zz.csv").write_text("\n".join(lines), encoding="utf-8")
    held(tmp_path / "zz.csv", truth()["zigzag"])


def test_times_of_day_over_midnight(tmp_path):
    one = zigzag()
    lines = ["UTC,psi [deg]"]
    for t, psi in zip(one["t"], one["psi"], strict=True):
        second = (86390.0 + t) % 86400.0
        lines.append(f"{int(second // 3600):02d}:{int(second % 3600 // 60):02d}:{second % 60:05.2f},{psi:.3f}")
    (tmp_path / "zz.csv").write_text("\n".join(lines), encoding="utf-8")
    done = held(tmp_path / "zz.csv", truth()["zigzag"])
    assert any("times of day" in text for text in done.assumed)


def test_stamps_of_three_digits_repeat(tmp_path):
    one = zigzag()
    lines = ["time [s],psi [deg]", *[f"{t:.3g},{psi:.3f}" for t, psi in zip(one["t"], one["psi"], strict=True)]]
    (tmp_path / "zz.csv").write_text("\n".join(lines), encoding="utf-8")
    done = held(tmp_path / "zz.csv", truth()["zigzag"])
    assert any("even clock of 0.5 s" in text for text in done.assumed)


def test_stamps_that_are_all_alike_are_no_clock(tmp_path):
    """Found by mutations: an even clock of no step."""
    lines = ["time [s],psi [deg]", *["3.0,1.0"] * 40]
    (tmp_path / "zz.csv").write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match="39 stamps repeat"):
        measure_trial(tmp_path / "zz.csv", None, COUNT)


def test_long_table_gives_what_the_wide_one_gives(tmp_path):
    one = zigzag()
    lines = ["source,channel,t,value,unit"]
    for name, unit in (("psi", "deg"), ("dH", "deg")):
        lines += [f"TRIAL,{name},{t},{v},{unit}" for t, v in zip(one["t"], one[name], strict=True)]
    (tmp_path / "long.csv").write_text("\n".join(lines), encoding="utf-8")
    write(tmp_path / "wide.csv", columns(one, "t", "psi", "dH"))
    both = [measure_trial(tmp_path / f"{n}.csv", None, COUNT).metrics for n in ("long", "wide")]
    assert both[0] == both[1]


@pytest.mark.parametrize("sigma", [0.0, 0.5])
def test_turning_circle_with_position_noise(tmp_path, sigma):
    one = turn()
    record = {"time [s]": one["t"], "x_north [m]": noisy(one["x"], sigma), "y_east [m]": noisy(one["y"], sigma, 1)}
    record |= {"psi [deg]": noisy(one["psi"], sigma / 5.0, 2), "speed [m/s]": one["speed"]}
    done = held(write(tmp_path / "tc.csv", record), truth()["turn"])
    assert set(truth()["turn"]) <= set(done.metrics)


@pytest.mark.parametrize(
    "headers", [("x_north [m]", "y_east [m]"), ("y_north [m]", "x_east [m]"), ("N [m]", "E [m]"), ("y [m]", "x [m]")]
)
def test_turning_circle_on_another_course_with_its_axes_named_or_found(tmp_path, headers):
    one = turn()
    north, east = turned(one["x"], one["y"], 60.0, (250.0, -130.0))
    record = {"time [s]": one["t"], headers[0]: north, headers[1]: east, "psi [deg]": np.mod(one["psi"] + 60.0, 360.0)}
    spec = TrialFile(channels={"N [m]": "north", "E [m]": "east"}) if headers[0].startswith("N") else None
    held(write(tmp_path / "tc.csv", record), truth()["turn"], spec)


def test_latitude_and_longitude(tmp_path):
    """Positions on the ellipsoid by the radii of curvature, another way than the program's."""
    one = turn()
    north, east = turned(one["x"], one["y"], 60.0, (250.0, -130.0))
    a, square, lat = 6378137.0, 0.00669437999014, math.radians(43.1)
    across = a / math.sqrt(1.0 - square * math.sin(lat) ** 2)
    along = across * (1.0 - square) / (1.0 - square * math.sin(lat) ** 2)
    record = {"time [s]": one["t"], "lat": 43.1 + np.degrees(north / along)}
    record |= {
        "lon": 5.9 + np.degrees(east / (across * np.cos(lat + north / along))),
        "heading [deg]": np.mod(one["psi"] + 60.0, 360.0),
    }
    held(write(tmp_path / "tc.csv", record, 8), truth()["turn"])


def test_track_alone_printed_with_three_digits(tmp_path):
    one = turn()
    exact = held(write(tmp_path / "tc.csv", columns(one, "t", "x", "y", "psi")), truth()["turn"]).metrics
    lines = ["time [s],x_north [m],y_east [m]"]
    lines += [f"{t:.2f},{x:.3g},{y:.3g}" for t, x, y in zip(one["t"], one["x"], one["y"], strict=True)]
    (tmp_path / "rough.csv").write_text("\n".join(lines), encoding="utf-8")
    by_course = {k: v.value for k, v in exact.items() if "course" in k or k == "steady_diameter_m"}
    done = held(tmp_path / "rough.csv", by_course)
    assert set(by_course) <= set(done.metrics)
    assert not any("heading" in name for name in done.metrics)


def test_steady_current_is_taken_off_the_track(tmp_path):
    one = turn()
    drift = 0.6 * one["t"]
    record = {"time [s]": one["t"], "x_north [m]": one["x"], "y_east [m]": one["y"] + drift, "psi [deg]": one["psi"]}
    path = write(tmp_path / "tc.csv", record)
    spec = TrialFile.model_validate({"current": {"speed_mps": 0.6, "to_deg": 90.0}})
    held(path, truth()["turn"], spec)
    over_ground = measure_trial(path, None, COUNT).metrics["tactical_diameter_180_heading_m"]
    assert over_ground.value - truth()["turn"]["tactical_diameter_180_heading_m"] > 20.0


def test_contract_of_the_command(tmp_path):
    write(tmp_path / "zz.csv", columns(zigzag(), "t", "psi"))
    done = CliRunner().invoke(main, ["trial", str(tmp_path / "zz.csv"), "--maneuver", "zigzag 20/20", "--json", "-"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    assert set(found) >= {"maneuver", "assumed", "metrics", "findings"}
    assert found["maneuver"] == "zigzag 20/20"
    assert set(found["metrics"]["overshoot_1_deg"]) == {"value", "sigma", "unit"}
    assert found["metrics"]["execute_2_s"]["unit"] == "s"


def test_turn_after_an_approach_on_another_course(tmp_path):
    one = turn()
    before = np.arange(0.0, 90.0, 0.5)
    speed = float(one["speed"][0])
    x = np.concatenate([speed * before, 90.0 * speed + one["x"]])
    y = np.concatenate([0.0 * before, one["y"]])
    north, east = turned(x, y, 200.0, (1000.0, -3000.0))
    rudder = np.concatenate([0.0 * before, np.full(one["t"].size, 20.0)])
    record = {"time [s]": np.concatenate([before, 90.0 + one["t"]]), "x_north [m]": noisy(north, 0.5)}
    record |= {"y_east [m]": noisy(east, 0.5, 1)}
    record["heading [deg]"] = np.mod(noisy(np.concatenate([0.0 * before, one["psi"]]), 0.2, 2) + 200.0, 360.0)
    done = held(write(tmp_path / "without.csv", record), truth()["turn"])
    assert done.metrics["time_90_heading_s"].sigma > 0.3, "without a rudder the execute is not known to a sample"
    done = held(write(tmp_path / "with.csv", record | {"rudder [deg]": rudder}), truth()["turn"])
    assert done.metrics["time_90_heading_s"].sigma < 0.2
    assert str(done.maneuver) == "turning_circle 20"


@pytest.mark.parametrize(
    ("header", "stamp"),
    [
        ("t [ms]", lambda t: f"{1000 * t:.1f}"),
        ("time [s]", lambda t: f"{1.7e9 + t:.2f}"),
        ("time [min]", lambda t: f"{t / 60:.6f}"),
        ("Timestamp", lambda t: f"2024-05-01T09:{int(t // 60):02d}:{t % 60:06.3f}Z"),
    ],
    ids=["milliseconds", "epoch", "minutes", "ISO"],
)
def test_clocks_of_recorders(tmp_path, header, stamp):
    one = zigzag()
    lines = [header + ";psi [deg]", *[f"{stamp(t)};{psi:.4f}" for t, psi in zip(one["t"], one["psi"], strict=True)]]
    (tmp_path / "zz.csv").write_text("\n".join(lines), encoding="utf-8")
    held(tmp_path / "zz.csv", truth()["zigzag"])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("title.csv", "Trial 12\nDate 1.5.2024\ntime [s],psi [deg],delta [deg]\n"),
        ("units.csv", "TIME,PSI,DELTA\n[s],[deg],[deg]\n"),
        ("words.csv", "Time / s,Heading / deg,Rudder / deg\n"),
        ("suffix.csv", "time_s,psi_deg,dH_deg\n"),
        ("columns.dat", "# 20/20 zigzag\n# t[s]  psi[deg]  delta[deg]\n"),
        ("greek.csv", "t / s,\u03c8 / \u00b0,\u03b4 / \u00b0\n"),
        ("tank.dat", "Test 23456, KVLCC2 zig-zag 20/20, full scale\nTIME[s]  PSI[deg]  DELTA[deg]\n"),
        ("yard.csv", "time (s),heading (deg),rudder angle (deg)\n"),
    ],
)
def test_headers_of_recorders(tmp_path, name, text):
    one = zigzag()
    mark = "  " if name.endswith(".dat") else ","
    rows = [mark.join(f"{v:.4f}" for v in row) for row in zip(one["t"], one["psi"], one["dH"], strict=True)]
    (tmp_path / name).write_text(text + "\n".join(rows), encoding="utf-8")
    done = held(tmp_path / name, truth()["zigzag"])
    assert str(done.maneuver) == "zigzag 20/20"


def test_positions_less_often_than_headings_and_degrees_with_minutes(tmp_path):
    one = turn()
    lines = ["time [s],north [m],east [m],psi [deg]"]
    for i, (t, x, y, psi) in enumerate(zip(one["t"], one["x"], one["y"], one["psi"], strict=True)):
        place = f"{x:.3f},{y:.3f}" if i % 4 == 0 else ","
        lines.append(f"{t},{place},{psi:.3f}")
    (tmp_path / "tc.csv").write_text("\n".join(lines), encoding="utf-8")
    held(tmp_path / "tc.csv", truth()["turn"])
    decimal = ["time [s],lat,lon", "0,43.102250,5.898403", "1,43.102300,5.898403", "2,43.102350,5.898403"]
    minutes = ["time [s],lat,lon", "0,43°06.135000'N,5°53.90418'E", "1,43°06.138000'N,5°53.90418'E"]
    from ident.trials.reading import read_recording

    for name, rows in (("a.csv", decimal), ("b.csv", minutes)):
        (tmp_path / name).write_text("\n".join(rows), encoding="utf-8")
    found = [read_recording(tmp_path / n, TrialFile()).channels["lat"].value[:2] for n in ("a.csv", "b.csv")]
    np.testing.assert_allclose(found[0], found[1], rtol=0.0, atol=1e-12)


def test_folder_of_runs_gives_scatter_and_port_against_starboard(tmp_path):
    one = zigzag()
    for seed in range(3):
        psi = noisy(one["psi"], 0.2, seed)
        write(tmp_path / f"port{seed}.csv", {"t [s]": one["t"], "psi [deg]": psi, "dH [deg]": one["dH"]})
        write(tmp_path / f"starboard{seed}.csv", {"t [s]": one["t"], "psi [deg]": -psi - 30, "dH [deg]": -one["dH"]})
    done = CliRunner().invoke(main, ["trial", str(tmp_path), "--json", "-"])
    assert done.exit_code == 0, done.output
    rows = {(r["side"], r["metric"]): r for r in json.loads(done.output)["scatter"]}
    port = rows["port", "overshoot_1_deg"]
    assert port["runs"] == 3
    assert 0.2 < port["scatter"] / port["stated"] < 3.0
    gap = port["port_less_starboard"]
    assert abs(gap["value"]) < 3.0 * gap["sigma"]


def test_a_turn_to_port_that_mirrors_one_to_starboard_differs_in_nothing(tmp_path):
    one = turn()
    for side, sign in (("starboard", 1.0), ("port", -1.0)):
        columns = {"t [s]": one["t"], "x_north [m]": one["x"], "y_east [m]": sign * one["y"]}
        write(tmp_path / f"{side}.csv", columns | {"psi [deg]": sign * one["psi"]})
    done = CliRunner().invoke(main, ["trial", str(tmp_path), "--json", "-"])
    assert done.exit_code == 0, done.output
    gaps = {r["metric"]: r["port_less_starboard"] for r in json.loads(done.output)["scatter"] if r["side"] == "port"}
    assert {"yaw_rate_steady_degps", "drift_angle_steady_deg", "advance_90_heading_m"} <= set(gaps)
    assert all(abs(gap["value"]) <= gap["sigma"] for gap in gaps.values())


def test_columns_with_their_units_in_a_row_below_a_title(tmp_path):
    one = zigzag()
    lines = ["Basin test 201_004, zigzag", "scale 1", "TIME  PSI  R  DELTA", "[s]  [deg]  [deg/s]  [deg]"]
    rows = zip(one["t"], one["psi"], one["r"], one["dH"], strict=True)
    lines += ["  ".join(f"{v:.5f}" for v in row) for row in rows]
    (tmp_path / "zz.txt").write_text("\n".join(lines), encoding="utf-8")
    done = held(tmp_path / "zz.txt", truth()["zigzag"])
    assert "row 4: units of the columns" in done.assumed


def test_degree_signs_of_a_western_encoding_are_read_and_said(tmp_path):
    one = zigzag()
    lines = ["Zeit;Kurswinkel;Ruderwinkel", "s;°;°"]
    lines += [
        f"{t:.2f};{a:.3f};{b:.2f}".replace(".", ",") for t, a, b in zip(one["t"], one["psi"], one["dH"], strict=True)
    ]
    (tmp_path / "zz.csv").write_text("\n".join(lines), encoding="latin-1")
    done = held(tmp_path / "zz.csv", truth()["zigzag"])
    assert "no UTF-8: read as cp1252" in done.assumed
    (tmp_path / "zz.csv").write_text("\n".join(["時刻;針路", *lines[2:]]), encoding="shift_jis")
    with pytest.raises(InputError, match="not utf-8 text"):
        measure_trial(tmp_path / "zz.csv", None, COUNT)
