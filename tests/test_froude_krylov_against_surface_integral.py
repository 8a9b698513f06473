"""The volume quadrature against the surface integral over BB2's triangles, Eqs. (42)-(47)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sim.hull.surface import read_geometry
from sim.waves.linear import regular
from sim.waves.pressure import froude_krylov, quadrature, reference_load, rotation, surface_load
from sim.waves.spectra import sea_state

RHO, G, L = 1025.0, 9.81, 70.2
SAIL_TOP = 11.37
# A component below this share of rho V times the water's acceleration (times L/4 for moments)
# is one that symmetry makes zero; its error is held against the floor.
FLOOR = 1e-3


@pytest.fixture(scope="module")
def mesh():
    return read_geometry(Path(__file__).parents[1] / "sim" / "vehicles" / "bb2" / "geometry.toml")


@pytest.fixture(scope="module")
def volume(mesh):
    return quadrature(mesh, 0.6 * L)


def _two_phases(load, frequency):
    """A load a quarter period apart: its amplitude and phase."""
    return np.array([load(0.0), load(0.5 * np.pi / frequency)])


def _errors(mesh, volume, waves, y):
    frequency = waves.frequency[0]
    reference = _two_phases(lambda t: reference_load(mesh, waves, y, t), frequency)

    def fast(t):
        out = np.zeros(6)
        froude_krylov(waves, volume, y, t, out)
        return out

    scale = RHO * mesh.volume * waves.amplitude[0] * frequency**2 * np.exp(-waves.number[0] * y[8])
    floor = FLOOR * scale * np.array([1.0, 1.0, 1.0, L / 4, L / 4, L / 4])
    miss = np.linalg.norm(_two_phases(fast, frequency) - reference, axis=0)
    return miss / np.maximum(np.linalg.norm(reference, axis=0), floor)


@pytest.mark.parametrize("number", [2, 3, 4, 5, 6, 7])
@pytest.mark.parametrize("attitude", [(0.0, 0.0, 0.0), (0.1, -0.08, 0.4)])
def test_every_component_within_one_percent(mesh, volume, number, attitude):
    """Regular waves of each sea state's peak period, seven headings, three depths, phase included."""
    length = G * sea_state(number).period ** 2 / (2.0 * np.pi)
    y = np.zeros(12)
    y[9:] = attitude
    for depth in (2.5, 7.0, 23.69):
        y[8] = depth + SAIL_TOP
        for heading in np.radians(np.arange(0.0, 181.0, 30.0)):
            errors = _errors(mesh, volume, regular(sea_state(number).height, length, heading, RHO, G), y)
            assert errors.max() < 0.01, (depth, heading, errors)


def test_it_takes_few_points(mesh, volume):
    """A hundredth of the triangles, with the mesh's volume and centroid, symmetric about the middle."""
    assert len(volume.volumes) < len(mesh.triangles) / 100
    assert (volume.volumes > 0.0).all()
    assert volume.volumes.sum() == pytest.approx(mesh.volume, rel=1e-12)
    assert volume.volumes @ volume.points / mesh.volume == pytest.approx(mesh.centroid, abs=1e-9)
    outer = np.einsum("i,ij,ik->jk", volume.volumes, volume.points, volume.points) / mesh.volume
    assert outer[0, 1] == pytest.approx(0.0, abs=1e-9)
    assert outer[1, 2] == pytest.approx(0.0, abs=1e-9)


def test_hydrostatic_pressure_gives_archimedes(mesh):
    """Exact for linear pressure: weight of the displaced water, upward, at the centroid."""
    matrix = rotation(0.2, -0.3, 1.0)
    load = surface_load(mesh, lambda r: RHO * G * (20.0 + r @ matrix[2]))
    lift = -RHO * G * mesh.volume * matrix[2]
    assert load[:3] == pytest.approx(lift, abs=1e-9 * RHO * G * mesh.volume)
    # The moment of Eq. (45) is exact to the facets' second order.
    assert load[3:] == pytest.approx(np.cross(mesh.centroid, lift), abs=1e-9 * RHO * G * mesh.volume * L)


def test_uniform_pressure_gives_no_load(mesh):
    load = surface_load(mesh, lambda r: np.full(r.shape[:-1], 1e5))
    assert load == pytest.approx(np.zeros(6), abs=1e-6 * 1e5)


def test_a_declared_displacement_scales_the_load(mesh, volume):
    scaled = quadrature(mesh, 0.6 * L, displaced=4440.0 / 1.025)
    assert scaled.volumes.sum() == pytest.approx(4440.0 / 1.025, rel=1e-12)
    assert np.array_equal(scaled.points, volume.points)


def test_without_components_there_is_no_load(volume):
    out = np.ones(6)
    froude_krylov(regular(0.0, 100.0, 0.0, RHO, G), volume, np.zeros(12), 0.0, out)
    assert not out.any()
