"""Calibration on maneuvers flown with known multipliers, on contradictory ones, and on mistakes."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from ident.calibration.crossed import cross_validated, mean_gains
from ident.calibration.estimate import calibrate
from ident.calibration.file import apply, load_calibration, parameters
from ident.calibration.problem import Channel, Problem, contradictions, problem
from ident.calibration.sensitivity import sensitivity as what_decides
from ident.calibration.version import calibrate as run
from ident.calibration.version import calibrated_rows
from ident.cli import main
from ident.options import Diagnostics
from ident.report.page import write_report
from sim.boat.coefficients import Coefficients
from sim.boat.database import own_version, read_rows, versions
from sim.boat.row_codec import correlation_matrix
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.simulate import simulate

CHANNELS = ("psi", "r", "phi", "u")
UNITS = {"psi": "rad", "r": "rad/s", "phi": "rad", "u": "m/s"}
# Boxes wide enough that the maneuver decides.
GROUPS = {
    "planes": ('["[YZKMN]_d[1-4]"]', 1.35),
    "yaw_damping": ('["N_ur"]', 1.25),
    "axial": ('["X_vr"]', 0.8),
}


def write_case(folder: Path) -> None:
    text = (files("sim") / "cases" / "hzz20.toml").read_text("utf-8")
    head, rest = text.split("[run]")
    run_part = (
        "[run]\nduration_s = 60.0\nstep_s = 0.1\nrecord_s = 0.5\n\n[command.dV]" + rest.split("[command.dV]", 1)[1]
    )
    commands = run_part.split("[reference]")[0]
    reference = (
        '[reference]\nfile = "made.csv"\ncompare = ["A", "B"]\n'
        f"channels = {json.dumps(CHANNELS)}\n\n[reference.frame]\nx = 'forward'\ny = 'starboard'\nz = 'down'\n"
    )
    (folder / "made.toml").write_text(head.replace('"hzz20"', '"made"') + commands + reference, encoding="utf-8")


def write_reference(folder: Path, flights: dict, noise: float = 0.0) -> None:
    random = np.random.default_rng(7)
    lines = []
    for source, flown in flights.items():
        for channel in CHANNELS:
            size = float(np.abs(flown[channel]).max())
            for t, value in zip(flown["t"], flown[channel], strict=True):
                moved = value + noise * size * random.standard_normal()
                lines.append((source, channel, t, moved, UNITS[channel], noise * size + 1e-9))
    columns = ["source", "channel", "t", "value", "unit", "sigma"]
    pd.DataFrame(lines, columns=columns).to_csv(folder / "made.csv", index=False)


def write_calibration(folder: Path, groups: dict = GROUPS, training: str = "", name: str = "made") -> Path:
    parts = [f'name = "{name}"\nvehicle = "bb2"\nsource = "made"\n']
    parts += [training or '[[training]]\ncase = "made.toml"\nsource = "A"\n']
    for key, (terms, _) in groups.items():
        parts.append(
            f'[[group]]\nname = "{key}"\ntitle = "{key}"\nterms = {terms}\n'
            'prior = { method = "stated", mean = 1.0, sigma = 0.5, source = "test" }\n'
        )
    path = folder / f"{name}.toml_calibration.toml"
    path.write_text("\n".join(parts), encoding="utf-8")
    return path


def fly(folder: Path, vehicle, rows: pd.DataFrame, factors: dict[str, float]):
    spec, where, _ = load_calibration(write_calibration(folder))
    chosen = parameters(spec, vehicle, rows, where)
    values = apply(rows["value"].to_numpy(), chosen, np.array([factors[k] for k in GROUPS]))
    case, _ = load_case(folder / "made.toml")
    return simulate(case, Coefficients(vehicle, rows).with_values(values))


@pytest.fixture(scope="module")
def truth() -> dict[str, float]:
    return {k: v for k, (_, v) in GROUPS.items()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory, campaign, rows, truth):
    path = tmp_path_factory.mktemp("calibration")
    write_case(path)
    (path / "made.csv").write_text("source,channel,t,value,unit\n", encoding="utf-8")
    flown = fly(path, campaign.vehicle, rows, truth)
    write_reference(path, {"A": flown, "B": flown}, noise=0.01)
    return path


@pytest.fixture(scope="module")
def task(folder, campaign, rows):
    spec, where, _ = load_calibration(write_calibration(folder))
    chosen = parameters(spec, campaign.vehicle, rows, where)
    return problem(spec, where, campaign.vehicle, rows, chosen)


@pytest.fixture(scope="module")
def estimate(task):
    return calibrate(task, workers=1)


def test_known_multipliers_come_back_within_their_posterior_errors(estimate, truth):
    away = (estimate.theta - np.array(list(truth.values()))) / estimate.deviation
    assert np.abs(away).max() < 3.0
    assert np.abs(estimate.theta - np.array(list(truth.values()))).max() < 0.08
    assert estimate.converged


def test_the_search_finds_an_optimum_that_its_beginning_knows_nothing_of():
    """A flight that does not come to its check angle below a multiplier of 1.1: no derivative at the prior mean."""

    class Step(Problem):
        def residuals(self, theta):
            return [np.full(4, 5.0 if theta[0] < 1.1 else theta[0] - 1.3)]

    at = np.linspace(0.0, 1.0, 4)
    channel = Channel(("case", "CFD", "theta"), at, at, True, 0.1, 0.0, 4.0)
    group = SimpleNamespace(kind="multiplier")
    one = SimpleNamespace(mean=1.0, sigma=0.2, group=group)
    stepped = Step(None, None, [one], {}, [channel], None)
    assert calibrate(stepped, workers=1, start=stepped.mean).theta[0] == pytest.approx(1.0)
    assert 1.1 < calibrate(stepped, workers=1).theta[0] < 1.3


def test_the_result_does_not_depend_on_the_number_of_workers(task, estimate):
    other = calibrate(task, workers=2)
    np.testing.assert_array_equal(other.theta, estimate.theta)
    np.testing.assert_array_equal(other.covariance, estimate.covariance)


def test_calibrated_rows_carry_multiplier_and_its_error(task, estimate, rows):
    done = calibrated_rows(rows, task.chosen, estimate)
    inside = np.any([p.rows for p in task.chosen], axis=0)
    wanted = apply(rows["value"].to_numpy(), task.chosen, estimate.theta)
    np.testing.assert_allclose(done["value"], wanted, rtol=1e-11, atol=1e-18)
    np.testing.assert_array_equal(done["stderr"][~inside], rows["stderr"][~inside])
    part = task.chosen[0]
    relative = np.hypot(estimate.theta[0] * rows["stderr"], rows["value"].abs() * estimate.deviation[0])
    np.testing.assert_allclose(done["stderr"][part.rows], relative[part.rows], rtol=1e-6)
    assert (done["calibration"][inside] != "").all()
    assert (done["calibration"][~inside] == "").all()
    _, matrix = correlation_matrix(done)
    assert np.linalg.eigvalsh(matrix).min() > -1e-4


def test_neutral_multipliers_change_nothing(task, rows):
    value = rows["value"].to_numpy()
    np.testing.assert_array_equal(apply(value, task.chosen, np.ones(len(task.chosen))), value)


def test_calibrating_twice_gives_the_same_version(folder, fitted_db, tmp_path, rows):
    from ident.database.store import commit

    db = str(tmp_path / "db")
    commit(db, rows, {"message": "captive"})
    path = str(write_calibration(folder))
    first = run(path, db, left_out=False)
    again = run(path, db, left_out=False)
    assert first.new
    assert not again.new
    assert (again.version, again.digest) == (first.version, first.digest)
    stored = own_version(db, "bb2", first.version).metadata
    assert stored["parent"] == "0"
    assert json.loads(stored["trained"]) == ["made"]
    kept = json.loads(stored["calibration"])
    assert [g["name"] for g in kept["groups"]] == list(GROUPS)
    assert all({"prior", "posterior", "captive_sigma", "beyond_captive"} <= set(g) for g in kept["groups"])
    # 35 % on the planes is far beyond what their captive error allows, and said so.
    assert kept["groups"][0]["beyond_captive"]
    captive, _ = read_rows(db, 0, "bb2")
    assert sorted(captive["value"]) == sorted(rows["value"])
    # The page of a calibration without draws has its groups, and nothing of draws.
    page = Path(write_report(db, first.version, tmp_path, "bb2").file).read_text("utf-8")
    assert all(f">{g['title']}</th>" in page for g in kept["groups"])
    assert "Posterior by draws" not in page


def test_sources_that_contradict_one_another_are_named(folder, campaign, rows, truth, tmp_path):
    write_case(tmp_path)
    (tmp_path / "made.csv").write_text("source,channel,t,value,unit\n", encoding="utf-8")
    flights = {
        "A": fly(tmp_path, campaign.vehicle, rows, truth),
        "B": fly(tmp_path, campaign.vehicle, rows, truth | {"planes": 1.8}),
    }
    write_reference(tmp_path, flights, noise=0.002)
    both = "".join(f'[[training]]\ncase = "made.toml"\nsource = "{s}"\n' for s in "AB")
    spec, where, _ = load_calibration(write_calibration(tmp_path, training=both))
    chosen = parameters(spec, campaign.vehicle, rows, where)
    said = contradictions(problem(spec, where, campaign.vehicle, rows, chosen))
    assert {s.split(" differ in ")[1].split()[0] for s in said} == set(CHANNELS)
    assert all(s.startswith("contradictory data") for s in said)


def test_the_evidence_frees_what_the_maneuver_asks_for_and_holds_the_rest(folder, rows, tmp_path):
    from ident.database.store import commit

    db = str(tmp_path / "db")
    commit(db, rows, {"message": "captive"})
    # A horizontal zigzag says nothing of the sail planes, and next to nothing of what the turn takes off its speed.
    path = write_calibration(folder, GROUPS | {"sail_planes": ('["[ZM]_dB"]', 1.0)}, name="choosing")
    path.write_text(
        path.read_text("utf-8").replace('source = "made"', 'source = "made"\nchoose = "evidence"', 1), "utf-8"
    )
    done = run(path, db, left_out=False, diagnostics=Diagnostics(posterior=120, seed=2))
    found = {g.name: g for g in done.summary.groups}
    chosen = {name for name, g in found.items() if g.chosen}
    assert {"planes", "yaw_damping"} <= chosen <= set(GROUPS)
    assert found["planes"].evidence > 5.0
    assert found["sail_planes"].evidence <= 0.0
    assert (found["sail_planes"].posterior.value, found["sail_planes"].posterior.sigma) == (1.0, 0.5)
    new, _ = read_rows(db, done.version, "bb2")
    old, _ = read_rows(db, 0, "bb2")
    held = old["coefficient"].isin(["Z_dB", "M_dB"])
    keys = ["coefficient", "part", "estimate", "value", "stderr", "calibration"]
    pd.testing.assert_frame_equal(new.loc[held, keys], old.loc[held, keys])
    # Few draws, and a posterior that is nearly normal: the optimum is their mean within the draws' own error.
    drawn = done.summary.sampled
    assert set(drawn.groups) == chosen
    assert all(abs(g.shift) < 5.0 * g.shift_error + 0.3 for g in drawn.groups.values())
    assert all(0.5 < g.width < 2.0 for g in drawn.groups.values())
    kept = json.loads(own_version(db, "bb2", done.version).metadata["calibration"])
    assert kept["sampled"]["groups"]["planes"]["q50"] == drawn.groups["planes"].q50


@pytest.mark.parametrize(
    ("options", "found"),
    [
        (["--sensitivity", "50"], "power of two"),
        (["--seed", "3"], "--seed goes with"),
        (["--cross-validate"], "trains on two maneuvers"),
    ],
)
def test_options_of_draws_that_cannot_be_are_refused(folder, rows, tmp_path, options, found):
    from ident.database.store import commit

    db = str(tmp_path / "db")
    commit(db, rows, {"message": "captive"})
    done = CliRunner().invoke(main, ["calibrate", str(write_calibration(folder)), "--db", db, *options])
    assert done.exit_code == 2
    assert found in done.output
    assert len(versions(db)) == 1


def test_a_maneuver_left_out_is_flown_by_the_multipliers_that_the_others_give(folder, campaign, rows, estimate):
    """What two maneuvers of one truth teach is the same: left out is as good as trained, and far from uncalibrated."""
    other = (folder / "made.toml").read_text("utf-8").replace('"made"', '"turned"')
    (folder / "turned.toml").write_text(other, encoding="utf-8")
    training = "".join(f'[[training]]\ncase = "{n}.toml"\nsource = "A"\n' for n in ("made", "turned"))
    spec, where, _ = load_calibration(write_calibration(folder, training=training, name="crossed"))
    two = problem(spec, where, campaign.vehicle, rows, parameters(spec, campaign.vehicle, rows, where))
    found = cross_validated(two, calibrate(two, workers=1, start=estimate.theta), workers=1)
    assert [(s.case, s.channel) for s in found] == [(case, c) for case in ("made", "turned") for c in CHANNELS]
    for one in found:
        assert one.left_out == pytest.approx(one.trained, rel=0.02)
        # The rest is the noise of the record, of which speed has the most.
        assert one.gain < (0.9 if one.channel == "u" else 0.3)
    every = mean_gains(found)
    assert every["", ""] == pytest.approx(np.sqrt(every["made", "A"] * every["turned", "A"]))


def test_what_decides_each_channel_of_a_flight_is_said(task):
    found = {one.channel: one for one in what_decides(task, 4, workers=1)}
    assert set(found) == set(CHANNELS)
    for one in found.values():
        assert 0.0 < one.along <= 1.0
        assert set(one.groups) == set(GROUPS)


def test_two_names_for_one_group_cannot_be_told_apart(folder, campaign, rows):
    from ident.calibration.cautions import identifiability

    twice = {"planes": GROUPS["planes"], "planes_again": GROUPS["planes"]}
    spec, where, _ = load_calibration(write_calibration(folder, groups=twice, name="twice"))
    chosen = parameters(spec, campaign.vehicle, rows, where)
    task = problem(spec, where, campaign.vehicle, rows, chosen)
    said = identifiability(task, calibrate(task, workers=1))
    assert any("planes_again and planes cannot be told apart" in s for s in said)


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (('"[YZKMN]_d[1-4]"', '"Y_d1"'), "mirror image"),
        (('"N_ur"', '"N_urr"'), "no value matches"),
        (('source = "A"', 'source = "C"'), "'C'"),
        (('"made.toml"', '"gone.toml"'), "no such file"),
        (('vehicle = "bb2"', 'vehicle = "suboff"'), "no captive version"),
        (('method = "stated"', 'method = "guessed"'), "guessed"),
        (("mean = 1.0", "mena = 1.0"), "mena"),
    ],
)
def test_a_users_mistake_gives_one_message_and_no_version(folder, rows, tmp_path, change, found):
    from ident.database.store import commit

    db = str(tmp_path / "db")
    commit(db, rows, {"message": "captive"})
    path = write_calibration(folder, name="wrong")
    path.write_text(path.read_text("utf-8").replace(*change, 1), encoding="utf-8")
    done = CliRunner().invoke(main, ["calibrate", str(path), "--db", db])
    assert done.exit_code == 2
    assert found in done.output
    assert "Traceback" not in done.output
    assert len(versions(db)) == 1


def test_a_missing_calibration_names_the_bundled_ones():
    with pytest.raises(InputError, match="bb2"):
        load_calibration("bb3")
