"""Authority: bodies, planes, propellers and waves: mechanics of rigid bodies, Michell's steepest wave, the sea's depth.

A file whose numbers no boat and no sea has is refused with its key; limits are limits from the start on;
a result that is no number is no success.
"""

from __future__ import annotations

import re
from importlib.resources import files

import click
import pytest
from click.testing import CliRunner

import ident
from ident.calibration.file import load_calibration, parameters
from ident.cli import main
from ident.trials.maneuvers import stated
from ident.trials.spec import load_spec
from ident.validation.bands import fly_samples
from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.files.schema import Data, checked
from sim.files.toml_files import bundled
from sim.flight.case import load_case
from sim.flight.plausible import check_revolutions, check_start
from sim.flight.simulate import waves_of
from sim.flight.trim import NoEquilibrium
from sim.kernel.assemble import assemble

WATER = Environment(density=1025.0, gravity=9.81)


def written(tmp_path, kind: str, name: str, *edits: tuple[str, str]):
    text = (files("sim") / kind / f"{name}.toml").read_text("utf-8")
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = tmp_path / f"{name}.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", bundled("vehicles"))
def test_every_bundled_vehicle_can_be(name):
    assert load_vehicle(name).name == name


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("value = 70.2,", 'value = "70.2",', "particulars.length.value"),
        ("mass = { value = 4.440e6", "mass = { value = true", "particulars.mass.value"),
        ("dV = -1, dH = -1", "dV = false, dH = -1", "mixer.dV"),
        ("[3.433, 17.6, 17.522]", "[-3.433, 17.6, 17.522]", "radius_of_gyration"),
        ("[3.433, 17.6, 17.522]", "[3.433, 17.6, 11.0]", "radius_of_gyration"),
        ("[3.433, 17.6, 17.522]", "[3.433, 1760.0, 1752.2]", "radius_of_gyration"),
        ("mass = { value = 4.440e6", "mass = { value = 4.440e5", "displaced_mass"),
        ("diameter = { value = 5.0", "diameter = { value = 500.0", "propeller.diameter"),
        ("value = [0.01, 10.0]", "value = [0.6, 600.0]", "propeller.limits"),
        ("diameter = { value = 5.0", "diameter = { value = 0.5", "propeller.diameter"),
        ("centre_of_gravity = { value = [0.0", "centre_of_gravity = { value = [100.0", "centre_of_gravity"),
        ("position = [31.1794, 3.9057, -3.9057]", "position = [62.3588, 3.9057, -3.9057]", "stern_plane_1, position"),
        ("position = [31.1794, 3.9057, -3.9057]", "position = [311.794, 3.9057, -3.9057]", "stern_plane_1, position"),
        ("position = [31.1794, 3.9057, -3.9057]", "position = [31.1794, 3.9057, 3.9057]", "stern_plane_1, mirror"),
        ('mirror = "stern_plane_4"', 'mirror = "stern_plane_2"', "stern_plane_1, mirror"),
        ("span_axis = [0, 1, -1]", "span_axis = [1, 0, 0]", "stern_plane_1, span_axis"),
        ("span_axis = [0, 1, -1]", "span_axis = [0, 0, 0]", "stern_plane_1, span_axis"),
        ("leading_edge = [-1, 0, 0]", "leading_edge = [0, 1, -1]", "stern_plane_1, span_axis"),
        ("span_axis = [0, 1, -1]", "span_axis = [0.3, 1, -1]", "stern_plane_1, span_axis"),
        ("rate_degps = 7.11", "rate_degps = 7.11e9", "stern_plane_1, rate_degps"),
        ("limit_deg = 30.0", "limit_deg = 3000.0", "stern_plane_1, limit_deg"),
        ('name = "Hull 2"', 'name = "Hull 1"', "planes and sections"),
        ('name = "Hull 2"', 'name = " "', "sections.centres.1.name"),
        ('name = "MARIN 7371R"', 'name = ""', "propeller.name"),
        ("[0.0, 0.0, 0.0443]", "[0.0, 0.0, 4.43]", "centre_of_gravity"),
        ("[0.0, 0.0, 0.0443]", "[4.43, 0.0, 0.0443]", "centre_of_gravity"),
        ("[0.0, 0.0, 0.0443]", "[0.0, 0.5, 0.0443]", "centre_of_gravity"),
        ("span_axis = [0, 1, -1]", "span_axis = [0, 1, 1]", "stern_plane_1, span_axis"),
        ("leading_edge = [-1, 0, 0]", "leading_edge = [1, 0, 0]", "stern_plane_1, leading_edge"),
        ("dV = -1, dH = -1", "dV = 1, dH = -1", "stern_plane_1, mixer.dV"),
        ("dV = -1, dH = -1", "dV = -1, dH = 1", "stern_plane_1, mixer.dH"),
        ("limit_deg = 30.0", "limit_deg = 3.0", "stern_plane_1, limit_deg"),
        ("rate_degps = 7.11", "rate_degps = 0.00711", "stern_plane_1, rate_degps"),
        ("leading_edge = [-1, 0, 0]", "leading_edge = [0, 1, 1]", "stern_plane_1, leading_edge"),
        ("value = 70.2,", "value = 702.0,", "particulars.length"),
        ("[3.433, 17.6, 17.522]", "[17.6, 3.433, 17.522]", "radius_of_gyration"),
        ("value = 70.2,", "value = 140.4,", "radius_of_gyration"),
        ("value = 70.2,", "value = 42.0,", "radius_of_gyration"),
        ("[0.0, 0.0, 11.37]", "[0.0, 11.37, 0.0]", "sail_top"),
        ("[0.0, 0.0, 0.4741]", "[0.0, 0.4741, 0.0]", "centre_of_buoyancy"),
        ("[-27.2503, 0.0, 0.0081]", "[0.0081, -27.2503, 0.0]", "sections, Hull 1"),
    ],
)
def test_a_vehicle_that_no_body_is_like_is_refused(tmp_path, old, new, key):
    with pytest.raises(InputError) as caught:
        load_vehicle(written(tmp_path, "vehicles", "bb2", (old, new)))
    assert key in caught.value.where, caught.value


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('name = "Hull 1"', 'name = "H1"'),
        ('term_set = "reduced"', 'term_set = "gertler_hagen"'),
        ('name = "sail_planes"\n', 'name = "bow_planes"\n'),
    ],
)
def test_coefficients_of_parts_that_the_vehicle_lacks_are_not_dropped(tmp_path, rows, old, new):
    edits = [(old, new)] + ([('mirror = "sail_planes"', 'mirror = "bow_planes"')] if "bow" in new else [])
    vehicle = load_vehicle(written(tmp_path, "vehicles", "bb2", *edits))
    with pytest.raises(InputError, match="vehicle bb2"):
        Coefficients(vehicle, rows)


@pytest.mark.parametrize(
    ("coefficient", "factor", "words"),
    [
        ("Z_wdot", -1.0, "in heave"),
        ("Z_wdot", 10.0, "in heave"),
        ("X_udot", 100.0, "in surge"),
        ("K_pdot", -30.0, "in roll"),
        ("N_vdot", 1e4, "not positive definite"),
    ],
)
def test_added_mass_that_no_water_has_is_not_flown(rows, coefficient, factor, words):
    """Lamb's bounds of each motion, and the kinetic energy of all together."""
    vehicle = load_vehicle("bb2")
    assemble(Coefficients(vehicle, rows), WATER)
    own = (rows["coefficient"] == coefficient) & (rows["part"] == "hull")
    assert (rows.loc[own, "value"] != 0.0).any()
    wrong = rows.assign(value=rows["value"].where(~own, factor * rows["value"]))
    with pytest.raises(InputError, match=f"added mass.*{words}"):
        assemble(Coefficients(vehicle, wrong), WATER)


@pytest.mark.parametrize(("coefficient", "value"), [("t", 10.0), ("t", 1.0), ("t", -1.5), ("w_T", 1.2), ("w_T", -3.0)])
def test_a_share_of_thrust_or_speed_that_no_hull_takes_is_not_flown(rows, coefficient, value):
    """Of the thrust 1 - t moves the boat, of the speed 1 - w reaches the propeller: both above zero."""
    own = rows["coefficient"] == coefficient
    assert own.any()
    wrong = rows.assign(value=rows["value"].where(~own, value))
    with pytest.raises(InputError, match=f"{coefficient}.*below 1"):
        assemble(Coefficients(load_vehicle("bb2"), wrong), WATER)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [("mixer = { dV = -1, dH = 0 }", "mixer = { dV = 1, dH = 0 }", "mixer.dV"),
     ("mixer = { dV = 0, dH = -1 }", "mixer = { dV = 0, dH = 1 }", "mixer.dH"),
     ("mixer = { dV = 0, dH = -1 }", "mixer = { dV = 0.5, dH = -1 }", "rudders, mixer.dV"),
     ("mixer = { dV = 0, dH = -1 }", "mixer = { dV = 0, dH = -10 }", "10 of the command"),
     ("mixer = { dV = 0, dH = -1 }", "mixer = { dV = 0, dH = -0.001 }", "0.001 of the command"),
     ("[0.0, 0.0, 0.25]", "[0.25, 0.0, 0.0]", "a trim of 90 deg"),
     ("[0.0, 0.0, 0.25]", "[0.0, 0.0, -0.25]", "above the centre of buoyancy")],
)  # fmt: skip
def test_a_boat_does_what_it_is_told_and_lies_upright(tmp_path, old, new, key):
    """What dV and dH do is their definition (docs/conventions.md); statics of a submerged body is Archimedes'."""
    text = (files("ident") / "starter" / "files" / "my-boat.toml").read_text("utf-8")
    assert old in text
    (tmp_path / "boat.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_vehicle(tmp_path / "boat.toml")
    assert key in str(caught.value)


def test_a_boat_whose_heel_and_trim_are_held_may_be_heavy_above(tmp_path):
    """A ship in surge, sway and yaw: the waterplane holds her up, of which the file says nothing."""
    edit = ("centre_of_gravity = { value = [0.245, 0.0, 0.0]", "centre_of_gravity = { value = [0.245, 0.0, -0.1]")
    assert load_vehicle(written(tmp_path, "vehicles", "kvlcc2-mmg", edit)).name == "kvlcc2-mmg"


@pytest.mark.parametrize("key", ["geometry", "errata"])
def test_a_file_that_a_vehicle_names_is_there_or_refused(tmp_path, monkeypatch, key):
    """Beside the vehicle's file or bundled, by its name as it is written."""
    name = "bb2/geometry.toml" if key == "geometry" else "bb2/errata.csv"
    ours = getattr(load_vehicle("bb2"), key)
    assert getattr(load_vehicle(written(tmp_path, "vehicles", "bb2")), key) == ours
    (tmp_path / "hulls").mkdir()
    (tmp_path / "hulls" / "own.toml").write_text("")
    monkeypatch.setenv("HULLS", str(tmp_path / "hulls"))
    for absent in ("bb2/none.toml", "", "bb2", "a" * 300, "$HULLS/own.toml"):
        with pytest.raises(InputError, match=f"key {key}: no file") as caught:
            load_vehicle(written(tmp_path, "vehicles", "bb2", (name, absent)))
        assert ("no variable of the environment" in str(caught.value)) == absent.startswith("$")
    vehicle = load_vehicle(written(tmp_path, "vehicles", "bb2", (name, "hulls/own.toml")))
    assert getattr(vehicle, key) == str(tmp_path / "hulls" / "own.toml")


@pytest.mark.parametrize("limits", [[0.01, 0.02], [-5.0, -1.0]])
def test_a_self_propulsion_state_beyond_the_propeller_is_none(tmp_path, limits):
    vehicle = load_vehicle(written(tmp_path, "vehicles", "bb2", ("[0.01, 10.0]", str(limits))))
    case = load_case("self-propulsion")[0]
    with pytest.raises(NoEquilibrium, match="the propeller's limits"):
        check_revolutions(case, vehicle, 1.18)
    check_revolutions(case, load_vehicle("bb2"), 1.18)


@pytest.mark.parametrize(
    ("key", "value"), [("depth_m", 2e4), ("depth_m", -1e9), ("depth_m", -71.0), ("speed_mps", 3000.0)]
)
def test_a_start_outside_of_the_sea_is_refused(key, value):
    case = load_case("roll-decay")[0]
    check_start(case, load_vehicle("bb2"))
    moved = case.model_copy(update={"initial": case.initial.model_copy(update={key: value})})
    with pytest.raises(InputError, match=f"initial.{key}"):
        check_start(moved, load_vehicle("bb2"))


@pytest.mark.parametrize(
    ("waves", "stands"),
    [
        ({"height_m": 100.0, "period_s": 8.0}, False),
        ({"height_m": 14.2, "length_m": 100.0}, False),
        ({"height_m": 14.1, "length_m": 100.0}, True),
        ({"height_m": 0.001, "period_s": 1e-9}, False),
        ({"height_m": 0.001, "period_s": 1e-300}, False),
        ({"kind": "jonswap", "height_m": 30.0, "period_s": 8.0}, False),
        ({"height_m": 1.0, "period_s": 1e9}, False),
        ({"height_m": 1e9, "period_s": 1e9}, False),
        ({"height_m": 40.0, "period_s": 30.0}, False),
        ({"height_m": 30.0, "period_s": 18.0}, True),
    ],
)
def test_waves_steeper_than_michells_break(waves, stands):
    case = load_case("ss5-4m")[0]
    data = {"kind": "regular", "direction_deg": 180.0, **waves}
    moved = case.model_copy(update={"waves": type(case.waves).model_validate(data)})
    if stands:
        assert waves_of(moved).amplitude.size == 1
        return
    with pytest.raises(InputError, match="key waves"):
        waves_of(moved)


def test_waves_of_centimetres_are_refused_before_anything_is_laid_out(coefficients):
    from sim.flight.simulate import water_of

    case = load_case("ss5-4m")[0]
    waves = {"kind": "regular", "direction_deg": 180.0, "height_m": 0.001, "period_s": 0.2}
    moved = case.model_copy(update={"waves": type(case.waves).model_validate(waves)})
    with pytest.raises(InputError, match="a hundredth of the boat"):
        water_of(moved, coefficients)


@pytest.mark.parametrize("samples", [10**12, 2**63, 10**30])
def test_samples_that_no_memory_holds_are_refused_before_one_is_drawn(rows, samples):
    with pytest.raises(InputError, match=r"in .* GB of memory"):
        fly_samples(load_case("roll-decay")[0], load_vehicle("bb2"), rows, samples)


class Anything(Data):
    x: float = 0.0


@pytest.mark.parametrize("number", [10**5000, -(10**5000), 1e300, 2**60], ids=["long", "below", "float", "int"])
def test_numbers_that_no_file_means_are_named_whatever_their_length(number):
    with pytest.raises(InputError, match="a number of size 1e"):
        checked(Anything, {"x": number}, "file.toml")


def test_a_file_of_parts_in_parts_is_refused_at_any_depth():
    data: dict = {"x": 1.0}
    for _ in range(5000):
        data = {"a": data}
    with pytest.raises(InputError, match="parts in parts"):
        checked(Anything, data, "file.toml")


def test_a_multiplier_below_zero_is_refused_when_it_is_read(tmp_path):
    text = (files("ident") / "calibrations" / "bb2.toml").read_text("utf-8")
    start = text.index("[[group]]")
    group = '[[group]]\nname = "a"\ntitle = "a"\nterms = ["N_v"]\n'
    prior = '[group.prior]\nmethod = "stated"\nmean = -1.0\nsigma = 1.0\nsource = "made"\n'
    path = tmp_path / "calibration.toml"
    path.write_text(text[:start] + group + prior)
    with pytest.raises(InputError, match="a mean above zero"):
        load_calibration(str(path))


def run(*arguments: object):
    return CliRunner().invoke(main, [str(a) for a in arguments])


def test_an_empty_name_of_a_case_is_no_case(tmp_path, fitted_db):
    done = run("validate", "--case", "", "--db", fitted_db, "--out", tmp_path / "out")
    assert (done.exit_code, "empty" in done.output) == (2, True)
    assert not (tmp_path / "out").exists()


def test_an_empty_name_of_a_vehicle_is_not_that_of_the_case(tmp_path, fitted_db):
    into = ("--vehicle", "", "--db", fitted_db, "--out", tmp_path / "out")
    for command in (("validate", "--case", "hzz20"), ("fly", "--case", "hzz20"), ("report",)):
        done = run(*command, *into)
        assert (done.exit_code, "no such file or bundled name" in done.output) == (2, True)
    with pytest.raises(InputError, match="posterior"):
        ident.calibrate("bb2", fitted_db, diagnostics=ident.Diagnostics(posterior=10**12))


def test_speeds_that_overflow_are_refused(fitted_db):
    done = run("stability", "--db", fitted_db, "--speed", "1e155")
    assert (done.exit_code, type(done.exception)) == (2, SystemExit)


def test_a_depth_change_without_a_change_is_refused(tmp_path):
    """Its metrics are shares of the change."""
    text = (files("sim") / "cases" / "depth-change.toml").read_text("utf-8")
    path = tmp_path / "case.toml"
    path.write_text("\n".join(line for line in text.splitlines() if not line.startswith("distance_m")))
    with pytest.raises(InputError, match="distance_m"):
        load_case(path)


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_a_result_that_is_no_number_is_no_success(tmp_path, number):
    from ident.commands.shared import emit
    from ident.validation.validate import _check_numbers

    with pytest.raises(InputError, match="not finite"):
        emit({"x": number}, str(tmp_path / "x.json"))
    assert not (tmp_path / "x.json").exists()
    with pytest.raises(InputError, match="metric overshoot_m"):
        _check_numbers({"overshoot_m": {"simulated": number, "CFD": None}}, "case.toml")


TRAINING = '[[training]]\ncase = "hzz20"\nsource = "EXP"\n'
STATED = 'method = "stated", mean = 1.0, sigma = 0.3, source = "made up"'


def calibration(folder, *groups: str, training: str = TRAINING) -> str:
    """A calibration file with groups of the keys that are given, each with a prior."""
    made = [f'[[group]]\nname = "g{i}"\ntitle = "made up"\n{keys}\n' for i, keys in enumerate(groups)]
    path = folder / "calibration.toml"
    head = 'name = "made-up"\nvehicle = "bb2"\nsource = "made up"\n'
    path.write_text(head + training + "\n".join(made))
    return str(path)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (f'terms = ["N_uvw"]\nprior = {{ {STATED.replace("1.0", "1000")} }}', "a multiplier is 0.1 to 10"),
        (f'terms = ["N_uvw"]\nprior = {{ {STATED.replace("1.0", "1e-3")} }}', "a multiplier is 0.1 to 10"),
        (f'terms = ["N_uvw"]\nprior = {{ {STATED.replace("0.3", "5e7")} }}', "sigma of 5e.07"),
        (f'terms = ["N_uvw"]\nprior = {{ {STATED}, of = "roll" }}', "no key of"),
        ('terms = ["Z_dB"]\nprior = { method = "carry_over", of = "pitch", source = "x" }', "'force' or 'roll'"),
        (f'terms = ["N_uvw", "TRIAL"]\nprior = {{ {STATED} }}', "no value matches 'TRIAL'"),
        (f'terms = ["N_uvw"]\nparts = ["hull", "rudder"]\nprior = {{ {STATED} }}', "no value matches 'rudder'"),
        ('terms = ["N_uvw"]\nprior = { method = "version", sigma = 1e-6, source = "x" }', "widens"),
    ],
)
def test_what_a_group_of_a_calibration_states_counts(tmp_path, rows, keys, words):
    path = calibration(tmp_path, keys)

    def read():
        spec, where, _ = load_calibration(path)
        return parameters(spec, load_vehicle("bb2"), rows, where)

    with pytest.raises(InputError, match=words):
        read()


def test_a_mean_of_ones_own_stands_instead_of_the_methods(tmp_path, rows):
    one = 'terms = ["N_uvw"]\nprior = { method = "version", mean = 1.2, sigma = 2.0, source = "x" }'
    spec, where, _ = load_calibration(calibration(tmp_path, one))
    (found,) = parameters(spec, load_vehicle("bb2"), rows, where)
    assert (found.mean, found.sigma) == (1.2, 2.0)


@pytest.mark.parametrize(
    ("training", "words"),
    [
        (TRAINING + "share = 0.2\n", "differs_from"),
        (TRAINING + 'differs_from = "EXP"\n', "itself"),
        (TRAINING + TRAINING, "count twice"),
        (TRAINING + TRAINING + 'channels = ["psi"]\n', "count twice"),
    ],
)
def test_what_is_trained_on_is_stated_once(tmp_path, training, words):
    group = f'terms = ["N_uvw"]\nprior = {{ {STATED} }}'
    with pytest.raises(InputError, match=words):
        load_calibration(calibration(tmp_path, group, training=training))


@pytest.mark.parametrize("key", ["scale = 1e-300", "[noise]\nheading_deg = 100", "[noise]\nspeed_mps = 1e7"])
def test_scales_and_noise_that_no_trial_has_are_refused(tmp_path, key):
    path = tmp_path / "trial.toml"
    path.write_text(key + "\n")
    with pytest.raises(InputError, match=key.split("\n")[-1].split(" =")[0]):
        load_spec(path)


@pytest.mark.parametrize("words", ["zigzag 0/10", "zigzag 10/0", "vertical_zigzag 10/1000"])
def test_a_zigzag_without_an_angle_is_none(words):
    with pytest.raises(InputError, match="above 0"):
        stated(words)


@pytest.mark.parametrize("words", ["zigzag 10/1e+10", "zigzag 1e1/10", "turn 3e-1", "turn 3.5.1", "turning_circle 350"])
def test_an_angle_is_not_a_part_of_a_number(words):
    with pytest.raises(InputError, match="maneuver"):
        stated(words)
    assert str(stated("zigzag 20/20 at 10 kts")) == "zigzag 20/20"


def test_a_gain_that_no_planes_follow_is_refused(tmp_path):
    text = (files("sim") / "cases" / "depth-change.toml").read_text("utf-8")
    path = tmp_path / "case.toml"
    for key in ("P_z", "D_z", "I_theta"):
        path.write_text(re.sub(rf"(?m)^{key} = .*", f"{key} = 3e6", text, count=1), "utf-8")
        with pytest.raises(InputError, match=key):
            load_case(path)


def test_no_option_takes_what_is_no_number():
    """Every option of numbers, of every command: click takes nan for one, since it is not below any least."""
    options = [p for c in main.commands.values() for p in c.params if isinstance(p.type, click.types.FloatParamType)]
    assert len(options) > 15
    for option in options:
        for word in ("nan", "inf", "-inf", "1e999"):
            with pytest.raises(click.BadParameter, match=r"finite|range"):
                option.type.convert(word, option, None)
    assert CliRunner().invoke(main, ["fit", ".", "--wait", "nan"]).exit_code == 2


@pytest.mark.parametrize("words", [["--scale", "1e308"], ["--scale", "1e-9"], ["--length", "1e30"]])
def test_what_a_trial_file_may_not_say_the_command_line_may_not(words):
    record = str(files("ident") / "starter" / "files" / "zigzag_trial.csv")
    done = CliRunner().invoke(main, ["trial", record, "--maneuver", "zigzag 20/20", *words])
    assert (done.exit_code, words[0] in done.output) == (2, True), done.output


def test_a_message_may_be_longer_than_a_name(tmp_path):
    done = CliRunner().invoke(main, ["fit", str(tmp_path), "-m", "x" * 5000])
    assert done.exit_code == 2
    assert "campaign.toml" in done.output
