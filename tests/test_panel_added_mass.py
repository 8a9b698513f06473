"""Panel-method added mass against Lamb's spheroid and the published depth ratios of BB2.

What needs capytaine is skipped where the optional extra is not installed.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import quad

from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.hull.added_mass import (
    SIZES,
    TURNED,
    between_planes,
    depth_table,
    panel_added_mass,
    prime_added_mass,
    solid_angle,
    wetted_panels,
)
from sim.hull.mesh import Mesh, joined
from sim.hull.slender import spheroid
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


def _ellipsoid(folder, axes, size):
    """Panels of an ellipsoid of three half axes, finer as ``size`` falls."""
    ball = _spheroid(folder, 1.0, 1.0, max(8, 2 * round(12.0 / size)), 0.1 * size)
    return Mesh(ball.vertices * np.array(axes), ball.triangles, ball.part, ball.names)


def _lamb(axes):
    """Added mass over displaced mass along each axis (Lamb 1932, art. 114)."""
    shares = []
    for k in axes:
        own, _ = quad(lambda s, k=k: 1.0 / ((k * k + s) * np.sqrt(np.prod([a * a + s for a in axes]))), 0.0, np.inf)
        shares.append(np.prod(axes) * own)
    return np.array([a / (2.0 - a) for a in shares])


@panels
@pytest.mark.parametrize("axes", [(1.0, 1.0 / 8.57, 1.0 / 8.57), (1.0, 0.6, 0.1)], ids=["hull", "plate like a sail"])
def test_continued_to_panels_of_no_size_added_mass_is_lambs(tmp_path, axes):
    """A spheroid of SUBOFF's proportions and an ellipsoid as thin as a sail: 3 % across; panels alone have 5 %."""
    known = prime_added_mass([_ellipsoid(tmp_path, axes, s) for s in SIZES], 2.0)
    unit = 2.0 * 4.0 / 3.0 * np.pi * np.prod(axes) / 2.0**3
    coarse, _, continued = (np.array([-known[f"{a}dot"][k] / unit for a in ("Y_v", "Z_w")]) for k in range(3))
    lamb = _lamb(axes)[1:]
    assert continued[-1] == pytest.approx(lamb[-1], rel=0.03)
    assert abs(coarse[-1] / lamb[-1] - 1.0) > abs(continued[-1] / lamb[-1] - 1.0)
    if axes[1] == axes[2]:
        assert lamb[0] == pytest.approx(spheroid(2.0, 2.0 * axes[1])[1], rel=1e-6)
        turned = spheroid(2.0, 2.0 * axes[1])[2] * (1.0 + axes[1] ** 2) / 5.0 * unit / 4.0
        assert -known["N_rdot"][2] == pytest.approx(turned, rel=0.03)
        # Both planes of a body of revolution are one.
        assert all(abs(v) < 2e-3 * unit for v in between_planes(known).values())


@panels
def test_horizontal_added_mass_of_suboff_is_the_vertical_one_and_the_sail_by_panels():
    """Rows of the campaign: measured vertical values turned, and what panels give across more than up."""
    folder = Path(__file__).parents[1] / "raw_captive_data" / "suboff"
    rows = pd.concat([pd.read_csv(folder / f) for f in ("published.csv", "by_panels.csv")]).set_index("coefficient")
    vehicle = load_vehicle("suboff")
    # Coarser than the rows were made with: the difference of the planes moves by 5 to 7 %.
    sizes = (3.0, 2.0)
    known = prime_added_mass(
        [read_geometry(vehicle.geometry, s) for s in sizes], vehicle.particulars.length.value, sizes
    )
    more = between_planes(known)
    for name, (vertical, sign) in TURNED.items():
        row, measured = rows.loc[name], rows.loc[vertical]
        sail = float(row["value"]) - sign * float(measured["value"])
        assert sail == pytest.approx(more[name], rel=0.08), name
        # Of the measured value, and what panels are off by in its plane.
        error = np.hypot(measured["rel_sigma"] * measured["value"], 0.18 * sail)
        assert row["rel_sigma"] * abs(row["value"]) == pytest.approx(error, rel=0.06), name
    # The bias that the difference leaves out: panels above the measured heave.
    assert 1.15 < known["Z_wdot"][2] / rows.loc["Z_wdot", "value"] < 1.25
    assert known["X_udot"][2] == pytest.approx(rows.loc["X_udot", "value"], rel=0.18)


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
