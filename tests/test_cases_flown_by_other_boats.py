"""A case flown by another boat carries none of its own boat's numbers, says what it flew and what lay at its limit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ident.cli import main
from ident.fitting.fit import fit
from ident.options import Conditions
from ident.validation.other_boat import for_boat
from ident.validation.validate import validate
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def suboff_db(tmp_path_factory):
    path = str(tmp_path_factory.mktemp("suboff") / "coeff_db")
    fit(ROOT / "raw_captive_data" / "suboff", path, "test")
    return path


def limited(tmp_path, limit_deg, name="suboff-limited"):
    """SUBOFF with rudders that stop earlier, under another name."""
    text = (ROOT / "sim" / "vehicles" / "suboff.toml").read_text("utf-8")
    head, rudders = text.split('name = "rudders"')
    text = head + 'name = "rudders"' + rudders.replace("limit_deg = 30.0", f"limit_deg = {limit_deg}")
    path = tmp_path / "boat.toml"
    path.write_text(text.replace('name = "suboff"', f'name = "{name}"', 1), encoding="utf-8")
    return str(path)


def test_roll_decay_of_another_boat_is_not_scored_against_bb2s_experiment(suboff_db):
    done = validate("roll-decay", suboff_db, vehicle="suboff")
    assert done.errors == {}
    assert set(done.metrics["roll_period_s"]) == {"simulated"}
    assert any("of bb2 left out" in note for note in done.notes)
    assert "suboff" in done.case.title


def test_times_and_speed_of_a_standard_maneuver_follow_froude():
    case, where = load_case("turning-circle")
    boat = of_no_speed(load_vehicle("suboff"))
    moved, notes = for_boat(case, where, boat, Conditions())
    ratio = boat.particulars.length.value / load_vehicle("bb2").particulars.length.value
    assert moved.initial.speed_mps == pytest.approx(case.initial.speed_mps * np.sqrt(ratio))
    assert moved.run.duration_s == pytest.approx(case.run.duration_s * np.sqrt(ratio))
    assert any("by Froude's law" in note for note in notes)
    gain = case.command.dV
    scaled = moved.command.dV
    # A depth error of a share of the length, a pitch error, and their rates in lengths a unit of time.
    assert scaled.P_z == pytest.approx(gain.P_z / ratio)
    assert scaled.D_z == pytest.approx(gain.D_z / ratio * np.sqrt(ratio))
    assert scaled.P_theta == gain.P_theta
    assert scaled.I_theta == pytest.approx(gain.I_theta / np.sqrt(ratio))


def of_no_speed(boat):
    """A boat that does not state the speed of its maneuvers."""
    return boat.model_copy(update={"particulars": boat.particulars.model_copy(update={"approach_speed": None})})


@pytest.mark.parametrize("asked", [None, 2.0])
def test_a_standard_maneuver_is_flown_at_the_speed_of_the_boat_or_that_asked_for(asked):
    """Lengths run in the same time: U t / L is kept, and with it gains on lengths, rates and integrals."""
    case, where = load_case("turning-circle")
    boat, home = load_vehicle("kvlcc2"), load_vehicle("bb2")
    moved, notes = for_boat(case, where, boat, Conditions(speed_mps=asked))
    speed = moved.initial.speed_mps
    assert speed == (asked or boat.particulars.approach_speed.value)
    assert any(f"{speed:.4g} m/s" in note for note in notes)
    lengths = [
        one.initial.speed_mps * one.run.duration_s / ship.particulars.length.value
        for one, ship in ((case, home), (moved, boat))
    ]
    assert lengths[1] == pytest.approx(lengths[0])
    time = moved.run.duration_s / case.run.duration_s
    assert moved.command.dV.D_z / moved.command.dV.P_z == pytest.approx(
        case.command.dV.D_z / case.command.dV.P_z * time
    )
    assert moved.command.dV.I_theta == pytest.approx(case.command.dV.I_theta / time)


def test_a_speed_that_cannot_be_held_names_the_option(suboff_db, tmp_path):
    arguments = ["--vehicle", "suboff", "--db", suboff_db, "--out", str(tmp_path)]
    done = CliRunner().invoke(main, ["validate", "--case", "turning-circle", "--speed", "60", *arguments])
    assert done.exit_code == 2
    assert "--speed" in done.output
    assert "Traceback" not in done.output


def test_the_own_boat_flies_its_case_as_it_is_written():
    case, where = load_case("hzz20")
    same, notes = for_boat(case, where, load_vehicle("bb2"), Conditions())
    assert (same, notes) == (case, [])


def test_angles_are_those_the_planes_can_do_and_the_title_says_them(tmp_path):
    case, where = load_case("turning-circle")
    boat = load_vehicle(limited(tmp_path, 15.0))
    moved, notes = for_boat(case, where, boat, Conditions())
    assert moved.command.dH.value_deg == 15.0
    assert "dH 15 deg" in moved.title
    assert any("the planes stop at 15 deg" in note for note in notes)
    spiral, where = load_case("direct-spiral")
    moved, _ = for_boat(spiral, where, boat, Conditions())
    assert max(s.value_deg for s in moved.command.dH.step) == pytest.approx(15.0)
    asked, _ = for_boat(case, where, boat, Conditions(speed_mps=2.0, depth_m=7.0, angle_deg=10.0))
    assert (asked.initial.speed_mps, asked.initial.depth_m, asked.command.dH.value_deg) == (2.0, 7.0, 10.0)
    with pytest.raises(InputError, match="a case that commands an angle"):
        for_boat(*load_case("roll-decay"), boat, Conditions(angle_deg=5.0))


def test_options_and_actuators_at_their_limit(suboff_db, tmp_path):
    arguments = ["validate", "--case", "turning-circle", "--vehicle", "suboff", "--db", suboff_db, "--json", "-"]
    options = ["--speed", "3", "--depth", "30", "--out", str(tmp_path)]
    done = CliRunner().invoke(main, [*arguments, *options])
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    (rudder,) = [s for s in found["saturated"] if s["actuator"] == "rudders"]
    assert rudder["limit"] == 30.0
    assert rudder["share_of_time"] > 0.9
    slack = CliRunner().invoke(main, [*arguments, *options, "--angle", "10"])
    assert json.loads(slack.output)["saturated"] == []


def test_a_boat_without_a_rudder_in_its_terms_says_so(suboff_db, tmp_path):
    arguments = ["--db", suboff_db, "--out", str(tmp_path), "--json", "-"]
    text = (ROOT / "sim" / "vehicles" / "suboff.toml").read_text("utf-8")
    path = tmp_path / "boat.toml"
    path.write_text(text.replace("mixer = { dV = 0, dH = -1 }", "mixer = { dV = 0, dH = 0 }"), encoding="utf-8")
    done = CliRunner().invoke(main, ["validate", "--case", "suboff-hzz10", "--vehicle", str(path), *arguments])
    assert done.exit_code == 2
    assert "no plane of suboff has a share in it" in done.output


@pytest.mark.parametrize("name", ["suboff", "kvlcc2", "remus100"])
def test_a_crash_stop_goes_astern_as_fast_as_the_boats_own_propeller_turns_ahead(name):
    boat = load_vehicle(name)
    moved, _ = for_boat(*load_case("crash-stop"), boat, Conditions())
    most = boat.propeller.limits.value[1]
    assert moved.command.n.limits_rps == [-most, most]


def test_the_title_says_the_boat_and_the_angles_that_are_flown():
    moved, notes = for_boat(*load_case("hzz20"), load_vehicle("remus100"), Conditions())
    assert moved.title == "Zigzag of remus100: dH -13.6 deg at 20 deg, 1.54 m/s, D0 25 m"
    assert any("the planes stop at 13.6 deg" in note for note in notes)


def test_a_ship_flies_a_standard_maneuver_afloat_and_makes_no_change_of_depth():
    boat = load_vehicle("kvlcc2")
    moved, notes = for_boat(*load_case("turning-circle"), boat, Conditions())
    assert moved.initial.depth_m == 0.0
    assert not [e for e in moved.run.stop if e.channel == "D0"]
    assert any("kvlcc2 floats" in note for note in notes)
