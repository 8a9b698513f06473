"""Offsets against the vehicle's particulars: slips that change every estimate and no number looks wrong by itself."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import trimesh
from click.testing import CliRunner
from made_lines import CAMPAIGN, VEHICLE

import ident
from ident.captive.campaign import read_campaign
from ident.checks.check import evidence_of
from ident.checks.findings import registered, rules
from ident.cli import main
from sim.boat.vehicle import load_vehicle
from sim.files.toml_files import bundled
from sim.hull.slender import NoHull, lines

HALF, RADIUS = 2.0, 0.4
GEOMETRY = """name = "spheroid"
source = "made"
frame = { x = "aft", y = "starboard", z = "up" }
origin = { value = [2.2, 0.0, 0.0], unit = "m", source = "0.2 m aft of the centre" }
[[parts]]
kind = "hull"
name = "hull"
offsets = "hull_offsets.csv"
around = 24
step_m = 0.1
"""


def _boat(folder, table, geometry=GEOMETRY):
    text = VEHICLE.replace("added_mass", 'geometry = "hull.toml"\nadded_mass', 1)
    (folder / "spheroid.toml").write_text(text, encoding="utf-8")
    (folder / "hull.toml").write_text(geometry, encoding="utf-8")
    table.to_csv(folder / "hull_offsets.csv", index=False)
    (folder / "captive").mkdir()
    (folder / "captive" / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "captive"


def _spheroid():
    x = HALF * (1.0 - np.cos(np.linspace(0.0, np.pi, 61)))
    r = RADIUS * np.sqrt(np.maximum(1.0 - ((x - HALF) / HALF) ** 2, 0.0))
    r[[0, -1]] = 0.0
    return pd.DataFrame({"x_m": x, "r_m": r})


def _findings(folder):
    evidence, rule = evidence_of(read_campaign(folder), folder), rules()["geometry"]
    return [f for function in registered()["geometry"] for f in function(evidence, rule)]


def test_lines_of_the_boat_itself_are_passed(tmp_path):
    folder = _boat(tmp_path, _spheroid())
    assert _findings(folder) == []
    assert ident.fit(folder, db=str(tmp_path / "db"))[0].version == 0


def test_bundled_lines_are_those_of_their_vehicles():
    known = {}
    for name in bundled("vehicles"):
        vehicle = load_vehicle(name)
        try:
            known[name] = lines(vehicle), vehicle.particulars
        except NoHull:
            continue
    assert len(known) >= 6
    for hull, sizes in known.values():
        assert hull.length == pytest.approx(sizes.length.value, rel=0.025)
        assert 970.0 < sizes.displaced_mass.value / hull.volume < 1060.0
        assert hull.centre == pytest.approx(sizes.centre_of_buoyancy.value[0], abs=0.002 * sizes.length.value)


SLIPS = {
    "millimetres": (lambda t: t * 1000.0, "4000 m"),
    "feet": (lambda t: t * 0.3048, "1.219 m"),
    "diameters for radii": (lambda t: t.assign(r_m=2.0 * t["r_m"]), "displaces"),
    "half as long again": (lambda t: t.assign(x_m=1.5 * t["x_m"]), "6 m"),
    "a radius with a zero too much": (lambda t: t.assign(r_m=t["r_m"].where(t.index != 30, 4.0)), "displaces"),
    "from the tail on": (lambda t: t[::-1], "increasing"),
    "a negative radius": (lambda t: t.assign(r_m=t["r_m"].where(t.index != 30, -0.4)), "negative"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_in_the_offsets_is_an_error(tmp_path, slip):
    change, said = SLIPS[slip]
    found = _findings(_boat(tmp_path, change(_spheroid())))
    assert found[0].severity == "error"
    assert said in found[0].what
    assert found[0].file.endswith("hull.toml")


def test_it_stops_the_fit_with_one_message(tmp_path):
    folder = _boat(tmp_path, _spheroid() * 1000.0)
    done = CliRunner().invoke(main, ["fit", str(folder), "--db", str(tmp_path / "db")])
    assert done.exit_code == 2
    assert "hull.toml" in done.output
    assert "lines of 4000 m, the vehicle of 4 m" in done.output
    assert not (tmp_path / "db").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[2.2, 0.0", "[0.22, 0.0", "centre of the lines' volume"),
        ('x = "aft"', 'x = "forward"', "left-handed"),
        ('kind = "hull"', 'kind = "hulk"', "hulk"),
        ('offsets = "hull_offsets.csv"', 'offsets = "gone.csv"', "no such file"),
    ],
)
def test_a_slip_in_the_geometry_file_is_an_error_with_its_place(tmp_path, old, new, said):
    found = _findings(_boat(tmp_path, _spheroid(), GEOMETRY.replace(old, new)))
    assert found[0].severity == "error"
    assert said in found[0].what


def test_a_hull_put_the_wrong_way_round_is_told_by_its_centre_of_volume(tmp_path):
    """A pear, thick ahead: by its lines the centre of volume is 8 % of L ahead of where the vehicle has it."""
    table = _spheroid()
    table["r_m"] *= 1.3 - 0.3 * table["x_m"] / HALF
    folder = _boat(tmp_path, table)
    assert any("centre of the lines" in f.what for f in _findings(folder))


@pytest.fixture
def pear(tmp_path):
    mesh = trimesh.creation.icosphere(subdivisions=4)
    mesh.vertices *= np.array([HALF, RADIUS, RADIUS])
    # x runs aft: thick ahead.
    mesh.vertices[:, 1:] *= 1.0 - 0.3 * mesh.vertices[:, :1] / HALF
    mesh.export(tmp_path / "pear.stl")
    return tmp_path / "pear.stl"


@pytest.mark.parametrize(("x", "told"), [("aft", False), ("forward", True)])
def test_a_surface_read_from_its_tail_is_told(pear, tmp_path, x, told):
    options = ["offsets", str(pear), "--unit", "m", "--length", "4", "--x", x, "--z", "up", "--out", str(tmp_path / x)]
    done = CliRunner().invoke(main, options, catch_exceptions=False)
    assert done.exit_code == 0
    assert ("aft of the middle" in done.output) == told
    assert "behind the nose" in done.output


def test_a_surface_beside_its_middle_plane_says_so(pear, tmp_path):
    mesh = trimesh.load_mesh(pear)
    mesh.vertices[:, 1] += 1.0
    mesh.export(pear)
    done = CliRunner().invoke(
        main, ["offsets", str(pear), "--unit", "m", "--length", "4", "--out", str(tmp_path / "o")]
    )
    assert done.exit_code == 2
    assert "port and starboard differ" in done.output
