"""A boat of which only a surface is known: offsets of a spheroid against its equation, and the way to a first fit."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest
import trimesh
from click.testing import CliRunner
from made_lines import CAMPAIGN, VEHICLE

from ident.cfd.offsets import offsets_of
from ident.cli import main
from sim.boat.database import read_rows
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.hull.derivatives import derivatives
from sim.hull.slender import hull_added_mass, lines, spheroid

HALF, RADIUS = 2.0, 0.4


def body(half=HALF, radius=RADIUS, scale=1.0):
    """A spheroid of fine triangles, x aft and z up."""
    mesh = trimesh.creation.icosphere(subdivisions=5)
    # Triangles between points of a body lie inside of it: grown to its volume.
    grown = (4.0 / 3.0 * np.pi / mesh.volume) ** (1.0 / 3.0)
    mesh.apply_scale(scale * np.array([half, radius, radius]) * grown)
    return mesh


@pytest.fixture(scope="module")
def surface(tmp_path_factory):
    path = tmp_path_factory.mktemp("surface") / "hull.stl"
    body(scale=1000.0).export(path)
    return path


def test_offsets_of_a_spheroid_are_its_equation(surface):
    found = offsets_of(surface, "mm", 2.0 * HALF)
    # The first stations lie on the triangles that the nose is made of.
    inside = found.x[5:-5]
    wanted = RADIUS * np.sqrt(1.0 - ((inside - HALF) / HALF) ** 2)
    np.testing.assert_allclose(found.radius[5:-5], wanted[:, None] * np.ones(found.radius.shape[1]), atol=2e-3 * RADIUS)
    assert not found.radius[[0, -1]].any()
    assert found.volume == pytest.approx(4.0 / 3.0 * np.pi * HALF * RADIUS**2, rel=5e-3)
    assert found.centre == pytest.approx(HALF, abs=2e-3)


def test_axes_of_the_surface_are_turned_and_its_axis_is_found(tmp_path):
    mesh = body()
    # A keel half as deep again: a lower half that is no mirror of the upper.
    mesh.vertices[:, 2] *= np.where(mesh.vertices[:, 2] < 0.0, 1.5, 1.0)
    mesh.vertices[:, 0] += 0.3 * (mesh.vertices[:, 0] / HALF) ** 2
    mesh.vertices[:, 2] += 0.1
    mesh.export(tmp_path / "aft_up.stl")
    turned = mesh.copy()
    turned.vertices *= np.array([-1.0, 1.0, -1.0])
    turned.export(tmp_path / "ahead_down.stl")
    one = offsets_of(tmp_path / "aft_up.stl", "m", 2.0 * HALF, axis=0.1)
    two = offsets_of(tmp_path / "ahead_down.stl", "m", 2.0 * HALF, forward=True, up=False, axis=-0.1)
    np.testing.assert_allclose(one.radius, two.radius, atol=1e-6)
    middle = len(one.x) // 2
    assert one.radius[middle, -1] == pytest.approx(1.5 * one.radius[middle, 0], rel=5e-3)


def opened(mesh):
    mesh.update_faces(np.arange(len(mesh.faces)) > 3)
    return mesh


def lopsided(mesh):
    mesh.vertices[:, 1] *= np.where(mesh.vertices[:, 1] < 0.0, 1.1, 1.0)
    return mesh


def inverted(mesh):
    mesh.invert()
    return mesh


def doubled(mesh):
    return trimesh.util.concatenate([mesh, trimesh.creation.icosphere(radius=0.2).apply_translation([0.0, 0.0, 3.0])])


@pytest.mark.parametrize(
    ("spoil", "ask", "found"),
    [
        (opened, {}, "hole"),
        (inverted, {}, "inward"),
        (doubled, {}, "2 closed bodies"),
        (lopsided, {}, "port and starboard differ"),
        (lambda mesh: mesh, {"axis": 0.5}, "axis lies outside"),
        (lambda mesh: mesh, {"length": 4000.0}, "4.0"),
    ],
)
def test_what_is_no_hull_is_refused(tmp_path, spoil, ask, found):
    path = tmp_path / "hull.stl"
    spoil(body()).export(path)
    with pytest.raises(InputError, match=found):
        offsets_of(path, **({"unit": "m", "length": 2.0 * HALF} | ask))


def test_the_unit_that_fits_is_named(surface, tmp_path):
    done = CliRunner().invoke(main, ["offsets", str(surface), "--unit", "m", "--length", "4", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert "--unit mm" in done.output
    assert not list(tmp_path.iterdir())


def test_from_a_surface_to_a_first_fit_whose_estimates_runs_replace(surface, tmp_path):
    done = CliRunner().invoke(
        main, ["offsets", str(surface), "--unit", "mm", "--length", "4", "--out", str(tmp_path)], catch_exceptions=False
    )
    assert done.exit_code == 0
    text = VEHICLE.replace("added_mass", 'geometry = "hull.toml"\nadded_mass', 1)
    (tmp_path / "spheroid.toml").write_text(text, encoding="utf-8")
    # The vehicle's origin lies 0.2 m aft of the centre.
    geometry = tmp_path / "hull.toml"
    origin = re.sub(r"(?m)^value = .*$", "value = [2.2, 0.0, 0.0]", geometry.read_text("utf-8"))
    geometry.write_text(origin, encoding="utf-8")
    folder, db = tmp_path / "captive", str(tmp_path / "db")
    folder.mkdir()
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    vehicle = load_vehicle(tmp_path / "spheroid.toml")
    hull = lines(vehicle)
    assert hull.volume == pytest.approx(4.0 / 3.0 * np.pi * HALF * RADIUS**2, rel=5e-3)
    # Lamb's added mass of the spheroid.
    added, displaced = hull_added_mass(hull), 4.0 / 3.0 * np.pi * HALF * RADIUS**2
    assert added["vdot"] == pytest.approx(spheroid(2.0 * HALF, 2.0 * RADIUS)[1] * displaced, rel=0.02)
    fitted = CliRunner().invoke(main, ["fit", str(folder), "--db", db], catch_exceptions=False)
    assert fitted.exit_code == 0
    rows = read_rows(db, None, "spheroid")[0].set_index("coefficient")
    prior = derivatives(vehicle, with_fins=True)
    assert set(rows["origin"]) == {"estimated"}
    assert rows.loc["N_v", "value"] == pytest.approx(prior["N_v"].value, rel=1e-9)
    drift = pd.DataFrame({"beta_deg": [-8, -4, 0, 4, 8]})
    drift["run_id"] = [f"d{b}" for b in drift["beta_deg"]]
    side = np.sin(np.radians(drift["beta_deg"]))
    drift = drift.assign(test="drift_horizontal", part="hull", U_mps=2.0, alpha_deg=0.0, D0_m=40.0, rel_sigma=0.05)
    drift = drift.assign(Y_N=-400.0 * side, N_Nm=-1500.0 * side, quality="made", source="made")
    drift.to_csv(folder / "drift.csv", index=False)
    assert CliRunner().invoke(main, ["fit", str(folder), "--db", db], catch_exceptions=False).exit_code == 0
    rows = read_rows(db, None, "spheroid")[0]
    assert set(rows.loc[rows["coefficient"].isin(["Y_v", "N_v"]), "origin"]) == {"measured"}
    assert set(rows.loc[rows["coefficient"].isin(["N_ur", "M_w"]), "origin"]) == {"estimated"}
