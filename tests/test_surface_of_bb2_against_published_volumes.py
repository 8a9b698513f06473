"""The regenerated surface: closed, outward, and the published volumes, areas and centroids."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sim.files.errors import InputError
from sim.hull.mesh import Mesh, MeshError, joined
from sim.hull.surface import Hull, hull_mesh, read_geometry

BB2 = Path(__file__).parents[1] / "sim" / "vehicles" / "bb2"
PUBLISHED = Path(__file__).parent / "data" / "published" / "bb2"


@pytest.fixture(scope="module")
def mesh():
    return read_geometry(BB2 / "geometry.toml")


def _published():
    return pd.read_csv(PUBLISHED / "components.csv").set_index("surface")


def test_volume_is_the_published_triangulations_to_a_thousandth(mesh):
    """Sum of the 14 surfaces: 4311.05 m3, centroid 0.4741 m above the shaft at the origin's station."""
    assert mesh.volume == pytest.approx(4311.0492, rel=1e-3)
    assert mesh.centroid == pytest.approx([0.0, 0.0, -0.4741], abs=0.02)
    assert 6000 < len(mesh.triangles) < 8000


def test_parts_have_the_published_volumes_and_centroids(mesh):
    table = _published()
    for name, row, tolerance in (("hull", "Hull", 1e-3), ("sail", "Sail", 2e-3), ("propeller hub", "PropHub", 0.02)):
        part, published = mesh.only(name), table.loc[row]
        assert part.volume == pytest.approx(published.signed_volume_m3, rel=tolerance)
        centre = [32.3287 - published.vol_cx, 0.0, -published.vol_cz]
        assert part.centroid == pytest.approx(centre, abs=0.02)
    roots = sum(mesh.only(n).volume for n in mesh.names if n.startswith("stern_root"))
    assert roots == pytest.approx(table.loc["TailPlaneRoots"].signed_volume_m3, rel=0.03)
    pair = [mesh.only(n) for n in mesh.names if n.startswith("sail_plane")]
    assert sum(p.volume for p in pair) == pytest.approx(table.loc["Sail planes pair"].signed_volume_m3, rel=0.01)
    plane = mesh.only("stern_plane_lower_stbd_X1")
    assert plane.volume == pytest.approx(table.loc["Stern plane (each of 4)"].signed_volume_m3, rel=0.03)
    assert np.linalg.norm(plane.areas, axis=1).sum() == pytest.approx(18.5471, rel=0.02)


def test_many_sides_give_the_smooth_hulls_displacement(mesh):
    """Kim (2021) Table 1: 4453.6 t; the rest of the boat is as facetted."""
    smooth = hull_mesh("hull", Hull(BB2 / "hull_offsets.csv"), around=144, step=0.3)
    displaced = 1.025 * (smooth.volume + mesh.volume - mesh.only("hull").volume)
    assert displaced == pytest.approx(4453.6, rel=1e-3)


def test_port_and_starboard_are_the_same(mesh):
    assert abs(mesh.centroid[1]) < 1e-12
    mirrored = mesh.vertices * [1.0, -1.0, 1.0]
    key = {tuple(v) for v in np.round(mesh.vertices, 9) + 0.0}
    assert all(tuple(v) in key for v in np.round(mirrored, 9) + 0.0)


def test_sections_of_the_hull_have_the_published_areas_up_to_the_facets(mesh):
    """30 sides enclose sin(12 deg) / 12 deg of a circle; published area 78.2674 m2 at mid-body."""
    area, centre, moments = mesh.only("hull").section(0, 32.3287 - 27.0)
    chord = np.radians(12.0)
    assert area == pytest.approx(78.2674 * np.sin(chord) / chord, rel=1e-3)
    assert centre == pytest.approx([0.0, -0.3727], abs=0.01)
    assert moments[0, 1] == pytest.approx(0.0, abs=1e-9 * moments[0, 0])


def test_sections_add_up_to_volume_and_centroid(mesh):
    """Cavalieri: areas and first moments of sections integrate to the divergence theorem's volume."""
    part = mesh.only("hull")
    low, high = part.vertices[:, 0].min(), part.vertices[:, 0].max()
    nodes, weights = np.polynomial.legendre.leggauss(200)
    cuts = [part.section(0, low + (high - low) * 0.5 * (1.0 + n)) for n in nodes]
    half = 0.5 * (high - low)
    assert half * weights @ [c[0] for c in cuts] == pytest.approx(part.volume, rel=2e-4)
    vertical = half * weights @ [c[0] * c[1][1] for c in cuts] / part.volume
    assert vertical == pytest.approx(part.centroid[2], abs=1e-3)


def _ellipsoid_offsets(folder, half_length, radius):
    x = half_length * (1.0 - np.cos(np.linspace(0.0, np.pi, 81)))
    r = radius * np.sqrt(np.maximum(1.0 - (x / half_length - 1.0) ** 2, 0.0))
    r[[0, -1]] = 0.0
    pd.DataFrame({"x_m": x, "r_m": r}).to_csv(folder / "offsets.csv", index=False)
    (folder / "boat.toml").write_text(
        f"""name = "spheroid"
source = "closed form"
origin = {{ value = [{half_length}, 0.0, 0.0], unit = "m", source = "centre" }}
[frame]
x = "aft"
y = "starboard"
z = "up"
[[parts]]
kind = "hull"
name = "hull"
offsets = "offsets.csv"
around = 96
step_m = 0.5
"""
    )
    return folder / "boat.toml"


def test_a_boat_with_a_hull_table_alone_is_enough(tmp_path):
    """A prolate spheroid: V = 4/3 pi a b^2, I = section moments pi r^4 / 4."""
    boat = read_geometry(_ellipsoid_offsets(tmp_path, 30.0, 4.0))
    assert boat.volume == pytest.approx(4.0 / 3.0 * np.pi * 30.0 * 16.0, rel=3e-3)
    assert boat.centroid == pytest.approx([0.0, 0.0, 0.0], abs=0.02)
    area, _, moments = boat.section(0, 0.0)
    assert area == pytest.approx(np.pi * 16.0, rel=1e-3)
    assert np.diag(moments) == pytest.approx([np.pi * 64.0] * 2, rel=2e-3)


def test_a_hole_and_inward_normals_are_refused(mesh):
    hole = Mesh(mesh.vertices, mesh.triangles[1:], mesh.part[1:], mesh.names)
    with pytest.raises(MeshError, match="part hull: 3 of"):
        hole.check()
    inward = Mesh(mesh.vertices, mesh.triangles[:, ::-1], mesh.part, mesh.names)
    with pytest.raises(MeshError, match="normals point inward"):
        inward.check()
    with pytest.raises(MeshError, match="two parts are called hull"):
        joined([mesh.only("hull"), mesh.only("hull")])


@pytest.mark.parametrize(
    ("column", "row", "value", "expected"),
    [("x_m", 3, 0.0, "increasing"), ("r_m", 2, -1.0, "zero or more"), ("r_m", 4, "two", "a finite number")],
)
def test_a_bad_offset_is_named_by_file_row_and_column(tmp_path, column, row, value, expected):
    path = _ellipsoid_offsets(tmp_path, 30.0, 4.0)
    table = pd.read_csv(tmp_path / "offsets.csv").astype(object)
    table.loc[row, column] = value
    table.to_csv(tmp_path / "offsets.csv", index=False)
    with pytest.raises(InputError, match=expected) as caught:
        read_geometry(path)
    assert "offsets.csv" in str(caught.value)
