"""Carry-over of planes against lifting-surface theory, the circle theorem and reverse flow."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from ident.estimates import carry_over as c
from ident.estimates.downwash import tail_downwash, vortex_pair
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.simulate import mixer_of
from sim.hull.lattice import horseshoes


@pytest.fixture(scope="module")
def bb2():
    return load_vehicle("bb2")


@pytest.fixture(scope="module")
def planes(bb2):
    return c.carry_over(bb2)


def rectangle(half_span: float, chord: float = 1.0) -> c.Fin:
    edge = (0.0, chord)
    return c.Fin(((0.0, *edge), (0.5 * half_span, *edge), (half_span, *edge)), 0.0)


@pytest.mark.parametrize("aspect", [2.0, 4.0, 8.0])
def test_lift_slope_of_a_rectangular_wing_is_helmbolds(aspect):
    # A half wing on a wall is a whole wing of twice the span: Helmbold, within 5 %.
    grid = c.lattice([rectangle(0.5 * aspect)], (6, 6, 6))
    matrix = c.influence(grid, c.in_wall(grid.b, 0.0), c.in_wall(grid.a, 0.0))
    load = c.normal_load(np.linalg.solve(matrix, -np.ones(len(grid.a))), grid.a, grid.b, grid.normal[0]).sum()
    slope = 2.0 * abs(load) / (0.5 * aspect)
    helmbold = 2.0 * math.pi * aspect / (2.0 + math.sqrt(aspect**2 + 4.0))
    assert slope == pytest.approx(helmbold, rel=0.05)


def test_images_make_the_cylinder_a_stream_surface_far_downstream():
    grid = c.lattice([rectangle(3.0)], (2, 2, 1))
    shifted = np.array([0.0, 1.4, 0.0])
    a, b = grid.a + shifted, grid.b + shifted
    angle = np.linspace(0.1, 3.0, 13)
    on = np.stack([np.full(13, 300.0), np.cos(angle), np.sin(angle)], axis=1)
    own = horseshoes(on, a, b) + horseshoes(on, c.in_cylinder(b, 1.0), c.in_cylinder(a, 1.0))
    outward = np.einsum("nmi,ni->nm", own, on * np.array([0.0, 1.0, 1.0]))
    along = np.linalg.norm(own, axis=2)
    assert np.abs(outward).max() < 1e-4 * along.max()


def test_wall_images_leave_no_flow_through_the_wall():
    grid = c.lattice([rectangle(2.0)], (2, 3, 2))
    lifted = np.array([0.0, 0.3, 0.0])
    a, b = grid.a + lifted, grid.b + lifted
    at = np.array([[0.4, 0.0, 0.2], [2.0, 0.0, -0.7], [9.0, 0.0, 0.1]])
    through = horseshoes(at, a, b) + horseshoes(at, c.in_wall(b, 0.0), c.in_wall(a, 0.0))
    assert np.abs(through[..., 1]).max() < 1e-13


def test_reverse_flow_the_incidence_factor_is_the_force_factor(planes):
    # Equal for thin fins; the chordwise stagger of root and plane leaves 3 %.
    assert planes.incidence_factor == pytest.approx(planes.force_factor, rel=0.03)


def test_a_wider_hull_takes_more_and_no_hull_takes_none():
    edge = (0.0, 3.0)

    def cross(radius: float) -> list[c.Fin]:
        chords = ((radius, *edge), (4.0, *edge), (7.0, *edge))
        return [c.Fin(chords, math.pi / 4.0 + k * math.pi / 2.0) for k in range(4)]

    shares = [c.stern_factors(cross(r), r)["hull"] for r in (0.05, 1.5, 2.5, 3.5)]
    assert np.all(np.diff(shares) > 0.0)
    assert shares[0] < 0.02


def test_every_fin_of_a_cross_carries_over_the_same():
    edge = (0.0, 3.0)
    chords = ((2.5, *edge), (4.0, *edge), (7.0, *edge))
    fins = [c.Fin(chords, math.pi / 4.0 + k * math.pi / 2.0) for k in range(4)]
    first = c.stern_factors(fins, 2.5, (3, 5, 3))
    for turned in (fins[1:] + fins[:1], fins[2:] + fins[:2]):
        assert c.stern_factors(turned, 2.5, (3, 5, 3)) == pytest.approx(first, rel=1e-9)


def test_bb2_parts_add_up_and_stay_inside_the_spread(planes):
    assert planes.force_factor == pytest.approx(1.0 + sum(planes.parts.values()), rel=1e-12)
    assert 0.0 < planes.force_sigma < 0.15 * planes.force_factor
    assert 1.0 < planes.sail_factor < 1.15
    # The lattice has no boundary layer: its slope is above the measured 1.71 per radian.
    assert 1.71 < planes.lift_slope < 2.2


def test_a_vehicle_without_geometry_is_refused(bb2):
    with pytest.raises(InputError, match="geometry"):
        c.carry_over(bb2.model_copy(update={"geometry": None}))


def test_vortex_pair_far_downstream_is_the_plane_flow_of_two_vortices():
    y, z, half = 1.3, 4.0, 2.0
    found = vortex_pair(np.array([-1e6, y, z]), np.zeros(3), half, 1.0)
    wanted = np.zeros(2)
    for side in (1.0, -1.0):
        dy = y - side * half
        wanted += side / (2.0 * math.pi * (dy**2 + z**2)) * np.array([z, -dy])
    assert found[1:] == pytest.approx(wanted, rel=1e-9)
    # Between the vortices of a wing that lifts up the flow is down.
    assert vortex_pair(np.array([-50.0, 0.0, 3.0]), np.zeros(3), half, 1.0)[2] > 0.0


def test_downwash_raises_the_sail_planes_pitch_moment_and_takes_lift(bb2, rows, planes):
    tail = tail_downwash(bb2, rows, planes)
    assert tail.moment_factor > planes.sail_factor > tail.force_factor
    # Port and starboard see mirror images; mirrored planes deflect with opposite signs.
    angle = tail.incidence_deg
    assert angle["stern_plane_1"] == pytest.approx(-angle["stern_plane_4"], abs=1e-9)
    assert angle["stern_plane_2"] == pytest.approx(-angle["stern_plane_3"], abs=1e-9)
    # The upper planes stand nearer to the vortices.
    assert abs(angle["stern_plane_2"]) > abs(angle["stern_plane_1"])


def renamed(vehicle, names):
    """The vehicle and its foils under other names of planes."""
    planes = [p.model_copy(update={"name": names[p.name], "mirror": names[p.mirror]}) for p in vehicle.planes]
    return vehicle.model_copy(update={"planes": planes})


def test_which_planes_are_at_the_stern_is_seen_by_their_place_not_their_names(bb2, planes, tmp_path):
    """Aft of the origin they are at the stern, whatever they are called: other names, the same ratios."""
    names = {p.name: f"sail_fin_{i}" if p.is_aft else "stern_of_the_sail" for i, p in enumerate(bb2.planes)}
    other = renamed(bb2, names)
    folder = Path(bb2.geometry).parent
    for file in folder.iterdir():
        text = file.read_text(encoding="utf-8")
        for old, new in names.items():
            text = text.replace(f",{old},", f",{new},")
        (tmp_path / file.name).write_text(text, encoding="utf-8")
    other = other.model_copy(update={"geometry": str(tmp_path / "geometry.toml")})
    assert c.carry_over(other) == planes
    assert mixer_of(other, sail_planes=False).tolist() == mixer_of(bb2, sail_planes=False).tolist()
    assert [bool(row.any()) for row in mixer_of(other, sail_planes=False)] == [p.is_aft for p in bb2.planes]


def test_a_foil_of_no_plane_is_refused(bb2, tmp_path):
    path = tmp_path / "foils.csv"
    text = (Path(bb2.geometry).parent / "foils.csv").read_text(encoding="utf-8")
    path.write_text(text.replace(",stern_plane_2,0", ",stern_plane_9,0"), encoding="utf-8")
    with pytest.raises(InputError, match="row 5, column plane"):
        c.foils_of(bb2, path)
    path.write_text(text.replace(",plane,", ",Plane,", 1), encoding="utf-8")
    with pytest.raises(InputError, match="no columns plane and fixed"):
        c.foils_of(bb2, path)
