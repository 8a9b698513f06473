"""Lost buoyancy of a partly emerged spheroid against the volume and centroid of its cap."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sim.hull.emergence import cells, lost_buoyancy
from sim.hull.surface import read_geometry
from sim.waves.linear import kinematics, regular
from sim.waves.loads import Gauges, evaluate, make_sea, passage
from sim.waves.pressure import Quadrature, rotation
from sim.waves.spectra import Spectrum, realise

RHO_G = 1025.0 * 9.81
A, B = 30.0, 4.0
VOLUME = 4.0 / 3.0 * np.pi * A * B * B


@pytest.fixture(scope="module")
def spheroid(tmp_path_factory):
    folder = tmp_path_factory.mktemp("spheroid")
    x = A * (1.0 - np.cos(np.linspace(0.0, np.pi, 81)))
    r = B * np.sqrt(np.maximum(1.0 - (x / A - 1.0) ** 2, 0.0))
    r[[0, -1]] = 0.0
    pd.DataFrame({"x_m": x, "r_m": r}).to_csv(folder / "offsets.csv", index=False)
    (folder / "boat.toml").write_text(
        f"""name = "spheroid"
source = "closed form"
origin = {{ value = [{A}, 0.0, 0.0], unit = "m", source = "centre" }}
frame = {{ x = "aft", y = "starboard", z = "up" }}
parts = [{{ kind = "hull", name = "hull", offsets = "offsets.csv", around = 64, step_m = 1.0 }}]
"""
    )
    return cells(read_geometry(folder / "boat.toml"), displaced=VOLUME, centre=(0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def boat():
    return cells(read_geometry(Path(__file__).parents[1] / "sim" / "vehicles" / "bb2" / "geometry.toml"))


def _state(depth, phi=0.0, theta=0.0, psi=0.0):
    y = np.zeros(12)
    y[8:] = depth, phi, theta, psi
    return y


def _lost(c, y, surface=0.0):
    out = np.zeros(6)
    share = lost_buoyancy(c, y, np.full(len(c.stations), surface), RHO_G, out, np.zeros(1))
    return share, out


def _cap(y):
    """Dry share and dry first moment (body axes) of a spheroid: a sphere's cap, stretched.

    With the vertical n in body axes and h^2 = sum (n_i a_i)^2, the plane at distance depth
    from the centre leaves t = depth / h; cap volume V (1 - t)^2 (2 + t) / 4, centroid at
    3 (1 + t)^2 / (4 (2 + t)) of the conjugate half diameter.
    """
    down = rotation(*y[9:])[2]
    axes = np.array([A, B, B])
    h = np.linalg.norm(down * axes)
    t = np.clip(y[8] / h, -1.0, 1.0)
    share = (1.0 - t) ** 2 * (2.0 + t) / 4.0
    centroid = -(3.0 * (1.0 + t) ** 2 / (4.0 * (2.0 + t))) * axes**2 * down / h
    return share, centroid, down


@pytest.mark.parametrize("attitude", [(0.0, 0.0), (0.0, 0.05), (0.0, 0.35), (0.5, -0.2), (1.2, 0.1)])
def test_lost_buoyancy_is_the_cap_of_the_spheroid(spheroid, attitude):
    """Eight bands over the height: within 1 % of the whole buoyancy at every depth and attitude."""
    for depth in np.linspace(-12.0, 12.0, 25):
        y = _state(depth, *attitude, psi=0.7)
        share, centroid, down = _cap(y)
        found, load = _lost(spheroid, y)
        weight = RHO_G * VOLUME
        assert found == pytest.approx(share, abs=0.01)
        assert load[:3] == pytest.approx(weight * found * down, rel=1e-12, abs=1e-6)
        lever = np.cross(centroid, weight * share * down)
        assert load[3:] == pytest.approx(lever, abs=5e-3 * weight * A)


def test_a_submerged_boat_loses_nothing_at_all(boat):
    """Sail top 11.4 m above the origin: at half a metre of water over it, exactly zero."""
    share, load = _lost(boat, _state(11.9))
    assert share == 0.0
    assert not load.any()


def test_out_of_the_water_everything_is_lost(boat):
    share, load = _lost(boat, _state(-20.0))
    assert share == pytest.approx(1.0, rel=1e-12)
    assert load[2] == pytest.approx(RHO_G * boat.volumes.sum(), rel=1e-12)


def test_the_cells_are_the_mesh(boat):
    mesh = read_geometry(Path(__file__).parents[1] / "sim" / "vehicles" / "bb2" / "geometry.toml")
    assert boat.volumes.sum() == pytest.approx(mesh.volume, rel=1e-9)
    assert boat.volumes @ boat.points / mesh.volume == pytest.approx(mesh.centroid, abs=2e-3)


@pytest.mark.parametrize("theta", [0.0, 0.25])
def test_surfacing_has_no_jump(boat, theta):
    """Each centimetre of rise changes the lift by less than the largest waterplane times it, and never back."""
    depths = np.arange(16.0, -8.0, -0.01)
    lift = np.array([_lost(boat, _state(d, theta=theta))[1] for d in depths])
    down = rotation(0.0, theta, 0.0)[2]
    change = np.diff(lift[:, :3] @ down)
    assert change.min() > -1e-6
    assert change.max() < RHO_G * 70.2 * 9.6 * 0.01
    assert lift[0] == pytest.approx(np.zeros(6), abs=0.0)


def test_port_and_starboard(boat):
    """Heel to either side: K and Y mirror, and the lost lift is the same."""
    (a, left), (b, right) = _lost(boat, _state(2.0, phi=0.3)), _lost(boat, _state(2.0, phi=-0.3))
    assert a == pytest.approx(b, rel=1e-9)
    size = np.abs(left).max()
    assert left == pytest.approx(right * [1, -1, 1, -1, 1, -1], abs=1e-9 * size)


def test_a_higher_surface_is_a_deeper_boat(boat):
    assert _lost(boat, _state(4.0), surface=1.5)[1] == pytest.approx(_lost(boat, _state(5.5))[1], rel=1e-9)


@pytest.mark.parametrize("components", [1, 30])
def test_elevations_are_those_of_the_waves(boat, components):
    one = regular(3.25, 140.9, 2.0, 1025.0, 9.81)
    many = realise(Spectrum("bretschneider", 3.3, 9.7, 2.0, 5.0), components, 1, 1025.0, 9.81)
    waves = one if components == 1 else many
    y = _state(10.0, 0.1, 0.2, 0.9)
    y[6:8] = 300.0, -80.0
    nothing = np.zeros((0, 3))
    volume = Quadrature(boat.points, boat.volumes)
    box = np.stack([boat.low, boat.high])
    sea = make_sea(waves, volume, nothing, nothing, nothing, gauges=Gauges(boat.stations, box))
    sums, size = passage(sea), len(boat.stations)
    value, slope = np.zeros(sums.value.shape[1]), np.zeros(sums.value.shape[1])
    evaluate(sea, y, 12.0, sums, value, slope)
    places = np.zeros((size, 3))
    places[:, 0] = boat.stations
    places = y[6:9] + places @ rotation(*y[9:]).T
    assert value[-size:] == pytest.approx(
        kinematics(waves, places, 12.0).elevation, abs=1e-12 if components == 1 else 1e-5
    )
    later, earlier = (kinematics(waves, places, 12.0 + h).elevation for h in (1e-4, -1e-4))
    assert slope[-size:] == pytest.approx((later - earlier) / 2e-4, abs=1e-5)
    y[8] = 60.0
    evaluate(sea, y, 12.0, sums, value, slope)
    assert (value[-size:] == 0.0).all()
