"""Panel-method added mass against Lamb's spheroid and the published depth ratios of BB2.

What needs capytaine is skipped where the optional extra is not installed.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sim.files.errors import InputError
from sim.hull.added_mass import depth_table, panel_added_mass, solid_angle, wetted_panels
from sim.hull.mesh import joined
from sim.hull.surface import Hull, hull_mesh, read_geometry

BB2 = Path(__file__).parents[1] / "sim" / "vehicles" / "bb2"
PUBLISHED = Path(__file__).parent / "data" / "published" / "bb2" / "added_mass_vs_depth.csv"
HAS_PANELS = importlib.util.find_spec("capytaine") is not None
panels = pytest.mark.skipif(not HAS_PANELS, reason="the optional extra 'panels' (capytaine) is not installed")
RHO, G = 1025.0, 9.81


def _spheroid(folder, a, b, around=20, step=1.5, name="hull"):
    x = a * (1.0 - np.cos(np.linspace(0.0, np.pi, 25)))
    r = b * np.sqrt(np.maximum(1.0 - (x / a - 1.0) ** 2, 0.0))
    r[[0, -1]] = 0.0
    pd.DataFrame({"x_m": x, "r_m": r}).to_csv(folder / "offsets.csv", index=False)
    mesh = hull_mesh(name, Hull(folder / "offsets.csv"), around, step)
    return mesh.moved((a, 0.0, 0.0), (-1.0, 1.0, -1.0))


def test_solid_angle_tells_inside_from_outside():
    mesh = read_geometry(BB2 / "geometry.toml", coarser=3.0).only("hull")
    points = np.array([[0.0, 0.0, 0.0], [10.0, 2.0, 1.0], [0.0, 0.0, 8.0], [50.0, 0.0, 0.0]])
    assert solid_angle(mesh, points) == pytest.approx([1.0, 1.0, 0.0, 0.0], abs=1e-6)


def test_overlapping_parts_lose_their_inner_panels(tmp_path):
    """Two spheroids half inside each other: what is left encloses their union, to the ragged rim."""
    one = _spheroid(tmp_path, 6.0, 4.0, 32, 0.6)
    other = _spheroid(tmp_path, 6.0, 4.0, 32, 0.6, name="other")
    both = joined([one, other.moved((-5.0, 0.0, 0.0))])
    left = wetted_panels(both)
    assert 0.5 * len(both.triangles) < len(left.triangles) < 0.9 * len(both.triangles)
    # Caps of a sphere stretched along x: the plane halfway cuts each at 2.5 / 6 of its half length.
    t = 2.5 / 6.0
    union = 2.0 * one.volume * (1.0 - (1.0 - t) ** 2 * (2.0 + t) / 4.0)
    assert left.volume == pytest.approx(union, rel=0.05)
    assert wetted_panels(one).triangles.shape == one.triangles.shape


@pytest.mark.skipif(HAS_PANELS, reason="capytaine is installed")
def test_without_capytaine_the_message_says_what_to_install(tmp_path):
    with pytest.raises(InputError, match="pip install"):
        panel_added_mass(_spheroid(tmp_path, 6.0, 2.0), np.inf, [np.inf], RHO, G)


@panels
def test_spheroid_has_lambs_added_mass(tmp_path):
    """k1 and k2 of a prolate spheroid of 3 to 1 (Lamb 1932, art. 114): 0.122 and 0.803."""
    mesh = _spheroid(tmp_path, 12.0, 4.0, 28, 1.1)
    added, damping = panel_added_mass(mesh, np.inf, [np.inf], RHO, G)
    ratio = np.diag(added[0])[:3] / (RHO * 4.0 / 3.0 * np.pi * 12.0 * 16.0)
    assert ratio == pytest.approx([0.122, 0.803, 0.803], rel=0.04)
    assert added[0] == pytest.approx(added[0].T, abs=0.02 * added[0].max())
    assert not damping.any()


@panels
def test_limits_order_and_depth(tmp_path):
    """A rigid surface adds to added mass, a pressure-free one takes from it; deep, neither matters."""
    mesh = _spheroid(tmp_path, 12.0, 4.0)
    deep = np.diag(panel_added_mass(mesh, np.inf, [np.inf], RHO, G)[0][0])
    for depth, least in ((5.0, 0.03), (40.0, -1e-3)):
        # Asked out of order: each answer belongs to its own frequency.
        added, damping = panel_added_mass(mesh, depth, [np.inf, 0.9, 0.0], RHO, G)
        free, rigid = np.diag(added[0]), np.diag(added[2])
        assert rigid[2] / deep[2] > 1.0 + least
        assert free[2] / deep[2] < 1.0 - least
        assert not damping[0].any()
        if depth < 10.0:
            assert damping[1][2, 2] > 0.0
    assert rigid[1:3] == pytest.approx(deep[1:3], rel=0.01)
    with pytest.raises(InputError, match="fully submerged"):
        panel_added_mass(mesh, 3.9, [0.0], RHO, G)


@panels
def test_depth_ratios_of_bb2_are_the_published_ones():
    table = pd.read_csv(PUBLISHED)
    mesh = read_geometry(BB2 / "geometry.toml", coarser=3.0)
    found = depth_table(mesh, -11.37, [2.5], [0.0, 0.66, np.inf], RHO, G)
    assert len(found) == 3
    for _, row in found.iterrows():
        omega = table["omega"].astype(float)
        known = table[(table["D0_m"].astype(float) == 2.5) & (omega == row.omega_radps)].iloc[0]
        for i in range(1, 7):
            assert row[f"ratio{i}{i}"] == pytest.approx(float(known[f"ratio{i}{i}"]), abs=0.01)
