"""`ident new` and `ident schema`: the starter fits, flies and trains as it is; every key of every file is described."""

from __future__ import annotations

import json
import math
import platform
import tomllib
from importlib.resources import files
from pathlib import Path

import pytest
from click.testing import CliRunner

import ident
from ident.cli import main
from ident.schemas.describe import KINDS, keys

ROOT = Path(__file__).parents[1]
BUNDLED = {
    "vehicle": sorted((ROOT / "sim" / "vehicles").glob("*.toml")),
    "case": sorted((ROOT / "sim" / "cases").glob("*.toml")),
    "campaign": sorted((ROOT / "raw_captive_data").rglob("campaign.toml")),
    "calibration": sorted((ROOT / "ident" / "calibrations").glob("*.toml")),
}


def _run(*arguments):
    done = CliRunner().invoke(main, list(arguments))
    assert done.exit_code == 0, done.output
    return done.stdout


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("desk")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        yield folder


def test_a_new_boat_is_checked_fitted_flown_and_trained_as_it_is_written(desk):
    written = json.loads(_run("new", "boat", "--json", "-"))["files"]
    assert {f for f in written if f.endswith(".toml")} == {
        *("boat/my-boat.toml", "boat/captive/campaign.toml", "boat/zigzag.toml", "boat/calibration.toml")
    }
    assert all((desk / f).is_file() for f in written)
    assert json.loads(_run("check", "boat/captive", "--json", "-"))[0]["campaign"] == "my-boat-tank"
    (fitted,) = json.loads(_run("fit", "boat/captive", "--db", "db", "--json", "-"))
    assert fitted["version"] == 0
    flown = json.loads(_run("validate", "--case", "boat/zigzag.toml", "--db", "db", "--json", "-"))
    assert flown["passed"]
    trained = json.loads(_run("calibrate", "boat/calibration.toml", "--db", "db", "--no-left-out", "--json", "-"))
    assert trained["version"] == 1
    # The trial is the boat of the known coefficients: multipliers take back what noise put into the captive values.
    for group in trained["groups"]:
        error = math.hypot(group["posterior"]["sigma"], group["captive_sigma"])
        assert abs(group["posterior"]["value"] - 1.0) < 3.0 * error
    again = json.loads(_run("validate", "--case", "boat/zigzag.toml", "--db", "db", "--json", "-"))
    before, after = (found["references"]["TRIAL"]["psi"]["rmse"] for found in (flown, again))
    assert after < before


def test_every_file_to_start_from_is_commented():
    started = sorted((ROOT / "ident" / "starter" / "files").rglob("*.toml"))
    assert len(started) == 4
    for path in started:
        lines = path.read_text("utf-8").splitlines()
        assert lines[0].startswith("# ")
        assert sum("#" in line for line in lines) >= 3, path.name


def test_nothing_is_overwritten(desk):
    (desk / "full").mkdir()
    (desk / "full" / "notes.txt").write_text("mine")
    with pytest.raises(ident.InputError, match="not empty"):
        ident.write_starter(desk / "full")
    assert [p.name for p in (desk / "full").iterdir()] == ["notes.txt"]
    done = CliRunner().invoke(main, ["new", "full"])
    assert done.exit_code == 2


def test_a_folder_that_was_begun_is_finished(desk):
    """A killed command leaves some files whole and half of one; nothing of anybody else is taken for that."""
    whole = [p.relative_to(desk / "first") for p in ident.write_starter(desk / "first")]
    ident.write_starter(desk / "killed")
    for name in whole[3:]:
        (desk / "killed" / name).unlink()
    half = desk / "killed" / f".zigzag.{platform.node()}.{2**22 + 1}.toml"
    half.write_text("half")
    (desk / "changed").mkdir()
    (desk / "changed" / whole[0].name).write_text("mine")
    again = ident.write_starter(desk / "killed")
    assert [p.relative_to(desk / "killed") for p in again] == whole
    assert all((desk / "killed" / name).read_bytes() == (desk / "first" / name).read_bytes() for name in whole)
    assert not half.exists()
    for folder in ("first", "changed"):
        with pytest.raises(ident.InputError, match="not empty"):
            ident.write_starter(desk / folder)


def test_the_starter_is_in_the_package():
    listed = {p.name for p in (files("ident") / "starter" / "files").iterdir()}
    assert {"my-boat.toml", "zigzag.toml", "zigzag_trial.csv", "calibration.toml", "captive"} <= listed
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]
    patterns = settings["package-data"]["ident"]
    here = ROOT / "ident"
    carried = {p for pattern in patterns for p in here.glob(pattern)}
    assert {p for p in (here / "starter" / "files").rglob("*") if p.is_file()} <= carried


@pytest.mark.parametrize("package", ["ident", "sim"])
def test_every_data_file_is_in_the_package(package):
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]
    carried = {p for pattern in settings["package-data"][package] for p in (ROOT / package).glob(pattern)}
    there = {p for p in (ROOT / package).rglob("*") if p.is_file() and "__pycache__" not in p.parts}
    assert {p for p in there if p.suffix != ".py"} <= carried


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_has_a_meaning(kind):
    found = keys(kind)
    assert len(found) > 15
    assert not [f"{k.table} {k.name}" for k in found if not k.meaning]


def _paths(data, table=""):
    """Keys of parsed TOML by table, entries of free tables left out."""
    for name, value in data.items():
        yield table, name
        inner = value if isinstance(value, list) else [value]
        for one in inner:
            if isinstance(one, dict):
                yield from _paths(one, f"{table}.{name}".strip("."))


@pytest.mark.parametrize("kind", BUNDLED)
def test_bundled_files_use_listed_keys_only(kind):
    listed = {(k.table.strip("[]"), k.name) for k in keys(kind)}
    tables = {table for table, _ in listed}
    assert BUNDLED[kind]
    seen = set()
    for path in BUNDLED[kind]:
        for table, name in _paths(tomllib.loads(path.read_text("utf-8"))):
            if table in tables:
                assert (table, name) in listed, f"{path.name}: {table} {name}"
                seen.add((table, name))
    assert len(seen) >= 10


@pytest.mark.parametrize("kind", KINDS)
def test_the_schema_is_the_models(kind):
    found = json.loads(_run("schema", kind))
    assert found == ident.schema(kind)
    model = KINDS[kind]
    assert set(found["properties"]) == set(model.model_fields)
    assert set(found.get("required", [])) == {n for n, f in model.model_fields.items() if f.is_required()}
    assert found["additionalProperties"] is False
    assert all(p["description"] for p in found["properties"].values())
    for inner in found["$defs"].values():
        assert inner["additionalProperties"] is False
        assert all(p.get("description") for p in inner["properties"].values()), inner["title"]


def test_another_kind_is_refused_with_those_there_are():
    with pytest.raises(ident.InputError, match="vehicle, campaign, case, calibration, trial"):
        ident.schema("boat")


def test_one_version_everywhere():
    version = ident.__version__
    assert f"version: {version}\n" in (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"ident, version {version}:" in (ROOT / "README.md").read_text("utf-8")
    cited = "10.17077/etd.005772"
    for name in ("CITATION.cff", "README.md", "docs/references.md", "raw_captive_data/bb2/campaign.toml"):
        text = (ROOT / name).read_text("utf-8")
        assert cited in text, name
        assert "Kim, D." not in text
