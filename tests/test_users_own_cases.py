"""A user's own case file: flown like a bundled one, and refused with the place named."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import pytest

from ident.schemas.describe import KINDS as FILES
from ident.starter.write import write_starter
from ident.validation.case_folder import KINDS, in_folder
from ident.validation.validate import validate
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.hull.surface import Geometry

TEXT = (files("sim") / "cases" / "roll-decay.toml").read_text("utf-8")
SERIES = (files("sim") / "cases" / "data" / "roll_decay.csv").read_text("utf-8")


@pytest.fixture
def write(tmp_path):
    def write(text: str = TEXT, series: str = SERIES) -> str:
        (tmp_path / "data").mkdir(exist_ok=True)
        (tmp_path / "data" / "roll_decay.csv").write_text(series)
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return str(path)

    return write


def test_own_case_gives_what_the_bundled_one_gives(write, fitted_db):
    own, bundled = (validate(name, fitted_db).to_dict() for name in (write(), "roll-decay"))
    assert own["references"] == bundled["references"]
    assert own["metrics"] == bundled["metrics"]


def test_reference_in_degrees_gives_the_same_error_in_degrees(write, fitted_db):
    lines = SERIES.splitlines()
    turned = [lines[0]]
    for line in lines[1:]:
        source, channel, t, value, _, *rest = line.split(",")
        turned.append(",".join([source, channel, t, repr(float(value) * 57.29577951308232), "deg", *rest]))
    found = validate(write(series="\n".join(turned)), fitted_db).to_dict()["references"]["EXP"]["phi"]
    known = validate("roll-decay", fitted_db).to_dict()["references"]["EXP"]["phi"]
    assert found["unit"] == "deg"
    assert found["rmse"] == pytest.approx(known["rmse"] * 57.29577951308232)
    assert found["ratio"] == pytest.approx(known["ratio"])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('channels = ["phi"]', 'channels = ["heel"]', ["reference.channels", "heel", "phi"]),
        ('channels = ["phi"]', 'channels = ["psi"]', ["reference.channels", "psi"]),
        ('compare = ["EXP"]', 'compare = ["TANK"]', ["TANK", "EXP"]),
        ("duration_s = 120.0", "duration_s = -1.0", ["run.duration_s", "-1.0"]),
        ("record_s = 0.1", "record_s = 0.01", ["record_s"]),
        ('state = "as_given"', 'state = "self_propulsion"', ["needs a speed"]),
        ('[command.dH]\nlaw = "fixed"', '[command.dH]\nlaw = "zigzag"', ["first_deg"]),
        (
            '[command.dH]\nlaw = "fixed"',
            '[command.dH]\nlaw = "zigzag"\nfirst_deg = 0.349\ncheck_deg = 20.0',
            ["radians?"],
        ),
        ('z = "up"', 'z = "down"', ["left-handed"]),
        ('vehicle = "bb2"', 'vehicle = "bb3"', ["bb3", "bb2"]),
        ("speed_mps = 0.0\n", "", ["initial.speed_mps", "nothing"]),
        ("data/roll_decay.csv", "data/none.csv", ["none.csv", "missing"]),
        ("duration_s = 120.0", "duratoin_s = 120.0", ["run.duratoin_s", "unknown key", "duration_s?"]),
        ("record_s = 0.1", "record_s = 0.1\ncolour = 3", ["run.colour", "unknown key", "step_s, record_s"]),
        ("record_s = 0.1", "record_s = 28.0", ["key run.record_s", "28 s", "half its length"]),
        ('channels = ["phi"]', 'channels = ["phi", "phi"]', ["key reference", "phi stands twice in channels"]),
        ("record_s = 0.1", "record_s = 130.0", ["key run", "record_s = 130.0", "longer than duration_s"]),
        ("record_s = 0.1", 'record_s = 0.1\nstop = [{channel = "psi", above = -1.0}]', ["ends at 0.000 s", "later"]),
    ],
)
def test_mistake_in_a_case_is_named(write, fitted_db, old, new, words):
    assert old in TEXT
    with pytest.raises(InputError) as caught:
        validate(write(TEXT.replace(old, new)), fitted_db)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("rad", "furlong", ["furlong", "rad"]),
        ("value", "valu", ["roll_decay.csv", "column value missing", "'valu'"]),
        ("sigma", "Sigma", ["roll_decay.csv", "column Sigma", "sigma?"]),
        ("EXP,phi,", "EXP,Phi,", ["column channel", "'Phi' of EXP", "phi?"]),
        ("-0.076853", "nan", ["row", "column value", "nan"]),
        ("EXP,phi,", ",phi,", ["row 2", "column source", "nothing"]),
    ],
)
def test_mistake_in_a_reference_is_named(write, fitted_db, old, new, words):
    assert old in SERIES
    with pytest.raises(InputError) as caught:
        validate(write(series=SERIES.replace(old, new)), fitted_db)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("number", ["1e300", "-2e16", "1" + "0" * 400])
def test_a_number_no_file_means_is_refused_with_its_key(tmp_path, number):
    text = (files("sim") / "cases" / "hzz20.toml").read_text("utf-8")
    path = tmp_path / "large.toml"
    path.write_text(text.replace("depth_m = 25.0", f"depth_m = {number}"), encoding="utf-8")
    with pytest.raises(InputError, match=r"initial\.depth_m"):
        load_case(str(path))


@pytest.mark.parametrize("name", ["turning-circle", "hzz20", "self-propulsion"])
def test_a_start_above_the_surface_is_refused_but_for_a_boat_that_may_be_there(tmp_path, name):
    text = (files("sim") / "cases" / f"{name}.toml").read_text("utf-8")
    line = next(k for k in text.splitlines() if k.startswith("depth_m = "))
    path = tmp_path / "own.toml"
    path.write_text(text.replace(line, "depth_m = -3.0", 1))
    with pytest.raises(InputError, match=r"depth_m -3 .*positive down"):
        load_case(path)
    path.write_text(path.read_text().replace("gravity_mps2 = 9.81", "gravity_mps2 = 9.81\nfree_surface = true"))
    assert load_case(path)[0].initial.depth_m == -3.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('value = 70.2, unit = "m"', 'value = 70.2, unit = "ft"', ["particulars.length", "'ft'", "unit 'm'"]),
        ("length = { value = 70.2", "length = { value = -70.2", ["particulars.length", "above zero"]),
        ("mass = { value = ", "mass = { value = -", ["particulars.mass", "above zero"]),
        ('unit = "rps"', 'unit = "rpm"', ["propeller.limits", "'rpm'", "unit 'rps'"]),
        ("mixer = { dV = -1, dH = -1 }", "mixer = { dV = -1 }", ["planes.0.mixer.dH", "nothing"]),
        ('mirror = "stern_plane_4"', 'mirror = "stern_plane_9"', ["planes", "stern_plane_9", "not a plane"]),
    ],
)
def test_mistake_in_a_vehicle_is_named(tmp_path, old, new, words):
    """Numbers are used as they are, so that a unit that is not the program's must not pass."""
    text = (files("sim") / "vehicles" / "bb2.toml").read_text("utf-8")
    assert old in text
    path = tmp_path / "own.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_vehicle(path)
    for word in words:
        assert word in str(caught.value)


def test_what_tells_the_kind_of_a_file_is_in_every_file_of_it_and_in_no_other():
    models = {**{kind: model for kind, model in FILES.items() if kind in KINDS or kind == "case"}, "geometry": Geometry}
    assert set(models) == {*KINDS, "case"}
    for kind, keys in KINDS.items():
        assert all(models[kind].model_fields[key].is_required() for key in keys), kind
        assert not any(set(keys) & set(model.model_fields) for other, model in models.items() if other != kind), kind


def test_the_folder_that_a_starter_fills_is_a_folder_of_cases(tmp_path):
    folder = write_starter(tmp_path / "boat")[0].parent
    cases, others = in_folder(folder)
    assert cases == [str(folder / "zigzag.toml")]
    assert {Path(name).name: kind for name, kind in others.items()} == {
        "calibration.toml": "calibration",
        "my-boat.toml": "vehicle",
    }
    # The trial file of a reference lies beside its case.
    (folder / "zigzag_trial.toml").write_text('maneuver = "zigzag 20/20"\n[noise]\nheading_deg = 0.1\n')
    assert in_folder(folder)[0] == cases
    assert in_folder(folder)[1][str(folder / "zigzag_trial.toml")] == "trial"
    (folder / "slip.toml").write_text((folder / "zigzag.toml").read_text("utf-8").replace("[command", "[commnad"))
    slipped = next(name for name in in_folder(folder)[0] if name.endswith("slip.toml"))
    with pytest.raises(InputError, match="commnad"):
        load_case(slipped)
    with pytest.raises(InputError, match=r"no case file beside campaign.toml \(a campaign\)"):
        in_folder(folder / "captive")
