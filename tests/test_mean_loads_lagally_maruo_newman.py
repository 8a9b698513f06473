"""Mean second-order loads on dipole bodies against far-field formulas, closed forms and invariants.

Near field: Lagally's theorem on each dipole. Far field: Maruo's (1960) horizontal force and
Newman's (1967) yaw moment from the Kochin function H, which the code does not use,

    F = rho k^2/(8 pi) int |H|^2 (cos mu - cos a, sin mu - sin a) da,
    N = -rho k/(8 pi) Im int conj(H) H' da - rho omega/(2 k) Im H'(mu).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dipole_bodies import FREE, RHO, G, assembled, kochin, lamb, spheroid

from sim.waves.linear import make_waves
from sim.waves.mean_loads import DipoleBody, mean_loads, plane_waves, rigid_response, scattering
from sim.waves.pressure import Quadrature, fill_rotation, froude_krylov


def lopsided(free):
    """A body without symmetry, with hydrostatic stiffness, unlike its displaced water in inertia."""
    draw = np.random.default_rng(4)
    points = draw.uniform(-1.0, 1.0, (9, 3)) * [30.0, 4.0, 5.0]
    body = assembled(points, draw.uniform(1e5, 6e5, 9), draw.uniform(0.0, 5e5, (9, 3)), [4e7, 1.4e9, 1.3e9], free)
    return replace(body, restoring=np.diag([0.0, 0.0, 0.0, 0.0, 2e7, 0.0]))


def incident(body, frequency, headings):
    number = frequency**2 / G
    kappa, fields = plane_waves(body, number, np.asarray(headings, dtype=float))
    return number, kappa, frequency / (1j * number) * fields


@pytest.mark.parametrize("free", [(), FREE], ids=["fixed", "free"])
@pytest.mark.parametrize("frequency", [0.45, 0.66, 0.95])
def test_near_field_is_far_field(free, frequency):
    """Maruo's force, Newman's moment and the energy balance, for a body without symmetry."""
    body, depth, headings = lopsided(free), 12.0, np.array([0.3, 1.6, 2.9, 4.4])
    number, kappa, velocity = incident(body, frequency, headings)
    found, q = scattering(body, number, kappa, velocity, depth), np.exp(-2.0 * number * depth)
    angles = 2.0 * np.pi * np.arange(96) / 96
    step, e = 2.0 * np.pi / 96, 1e-4
    h = kochin(body, number, found.dipoles, angles)
    slope = (kochin(body, number, found.dipoles, angles + e) - kochin(body, number, found.dipoles, angles - e)) / (
        2 * e
    )
    ahead = [
        kochin(body, number, found.dipoles[i : i + 1], np.array([mu - e, mu + e]))[0] for i, mu in enumerate(headings)
    ]
    scale = RHO * number**2 / (8.0 * np.pi) * q * step
    for k, part in enumerate((np.cos, np.sin)):
        maruo = scale * (np.abs(h) ** 2 * (part(headings)[:, None] - part(angles))).sum(axis=1)
        assert found.force[:, k] == pytest.approx(maruo, rel=1e-6, abs=1e-6 * np.abs(found.force[:, :2]).max())
    newman = -RHO * number / (8.0 * np.pi) * q * step * np.imag(np.conj(h) * slope).sum(axis=1)
    newman -= 0.5 * RHO * frequency / number * np.imag([(b - a) / (2 * e) for a, b in ahead])
    munk = -0.5 * np.real(np.cross(found.water.conj(), found.dipoles)).sum(axis=1)[:, 2]
    assert found.force[:, 5] + munk == pytest.approx(newman, rel=1e-5, abs=1e-6 * np.abs(newman).max())
    taken = 0.5 * frequency * np.imag((velocity.conj() * found.dipoles).sum(axis=(1, 2)))
    radiated = RHO * frequency * number / (8.0 * np.pi) * q * step * (np.abs(h) ** 2).sum(axis=1)
    assert taken == pytest.approx(radiated, rel=1e-7)


def test_a_small_fixed_sphere_is_pushed_as_in_closed_form():
    """D = 3/2 rho V v, H = 3/2 V i a omega k (1 + cos a): F = rho k^2/8 (3/2 V a omega k)^2 exp(-4 k z)."""
    body, depth, frequency = spheroid(0.5, 0.5, free=()), 10.0, 0.6
    number, kappa, velocity = incident(body, frequency, [0.7])
    volume = body.displaced.sum() / RHO
    force = np.exp(-2.0 * number * depth) * scattering(body, number, kappa, velocity, depth).force[0]
    size = RHO * number**2 / 8.0 * (1.5 * volume * frequency * number) ** 2 * np.exp(-4.0 * number * depth)
    assert force[:2] == pytest.approx(size * np.array([np.cos(0.7), np.sin(0.7)]), rel=2e-3)
    # Suction 3/2 rho V grad(v^2/2)
    suction = -1.5 * body.displaced.sum() * frequency**2 * number * np.exp(-2.0 * number * depth)
    assert force[2] == pytest.approx(suction, rel=2e-3)


def test_a_free_small_sphere_follows_the_water_without_a_mean_force():
    """First-order loads where it is push it down as much as the waves' own second-order pressure lifts."""
    body, frequency = spheroid(0.5, 0.5), 0.6
    found = mean_loads(body, frequency, np.array([0.0, 1.0]), np.zeros(1), np.array([10.0]))
    lift = body.displaced.sum() * frequency**4 / G
    assert found.direct[0][:, 2] == pytest.approx(-lift, rel=1e-3)
    assert found.simulated[0][:, 2] == pytest.approx(lift, rel=1e-3)
    whole = found.direct[0] + found.simulated[0] + found.answered[0]
    assert np.abs(whole[:, :3]).max() < 2e-3 * lift


def test_a_long_circular_cylinder_in_beam_seas_sends_nothing_back():
    """Dean (1948): no reflection, because horizontal and vertical dipoles are equal and 90 deg apart.

    With the vertical dipole alone it reflects, and F = rho k |h|^2 / 2 a unit length with
    h = d k a omega / rho, d its mass: Maruo's formula by stationary phase.
    """
    frequency, length, count, d = 1.0, 600.0, 240, 1e3
    points = np.zeros((count, 3))
    points[:, 0] = length * ((np.arange(count) + 0.5) / count - 0.5)
    mass = np.full((count, 3), d * length / count)
    body = DipoleBody(points, np.zeros(count), mass, np.eye(6), np.zeros((6, 6)), (), RHO, G)
    number, _, velocity = incident(body, frequency, [0.5 * np.pi])
    angles = 2.0 * np.pi * np.arange(720) / 720
    forces = []
    for dipoles in (mass * velocity, mass * velocity * [0.0, 0.0, 1.0]):
        h = kochin(body, number, dipoles, angles)[0]
        forces.append(RHO * number**2 / (8 * np.pi) * 2 * np.pi / 720 * (np.abs(h) ** 2 * (1 - np.sin(angles))).sum())
    reflected = 0.5 * RHO * number * (d * number * frequency / RHO) ** 2 * length
    assert forces[1] == pytest.approx(reflected, rel=0.05)
    assert forces[0] < 0.02 * forces[1]


@pytest.mark.parametrize(("speed", "heading"), [(0.0, 0.4), (5.0, np.pi), (5.0, 2.2), (3.0, 0.3)])
def test_what_the_simulator_has_is_the_time_average_of_its_load(speed, heading):
    """Froude-Krylov load of ``sim.waves.pressure`` averaged along the boat's own first-order motion, earth axes."""
    body, depth, frequency, amplitude = spheroid(30.0, 4.0), 15.0, 0.7, 0.02
    number, _, velocity = incident(body, frequency, [heading])
    encounter = frequency - number * speed * np.cos(heading)
    motion = rigid_response(body, velocity, frequency, np.array([encounter]))[0] * amplitude
    shift = motion * np.exp(-number * depth) / (-1j * encounter)
    waves = make_waves(amplitude, frequency, heading, 0.0, RHO, G)
    points = Quadrature(body.points, body.displaced / RHO)
    sums, matrix, out = np.zeros(3), np.zeros((3, 3)), np.zeros(6)
    times = np.arange(64) * 2.0 * np.pi / encounter / 64
    for t in times:
        y = np.zeros(12)
        y[6:] = np.real(shift * np.exp(-1j * encounter * t))
        y[6] += speed * t
        y[8] += depth
        froude_krylov(waves, points, y, t, out)
        fill_rotation(y[9], y[10], y[11], matrix)
        sums += matrix @ out[:3] / 64
    expected = mean_loads(body, frequency, np.array([heading]), np.array([speed]), np.array([depth])).simulated[
        0, 0, :3
    ]
    expected = expected * amplitude**2 * np.exp(-2.0 * number * depth)
    assert sums == pytest.approx(expected, rel=2e-3, abs=2e-3 * np.abs(expected).max())


@pytest.mark.parametrize("speed", [0.0, 4.0])
def test_waves_push_only_what_scatters_them(speed):
    """Without the free surface's answer no momentum leaves: table and simulator cancel horizontally."""
    headings = np.linspace(0.0, 6.0, 7)
    found = mean_loads(lopsided(FREE), 0.7, headings, np.array([speed]), np.array([12.0]))
    size = np.abs(found.direct[0][:, 2]).max()
    assert np.abs((found.direct + found.simulated)[0][:, :2]).max() < 1e-10 * size
    assert np.abs(found.direct[0][:, :2]).max() > 1e-4 * size


def test_head_and_following_seas_are_mirror_images_at_zero_speed():
    for free in ((), FREE):
        found = mean_loads(spheroid(30.0, 4.0, free), 0.7, np.array([0.3, np.pi - 0.3]), np.zeros(1), np.array([12.0]))
        for loads in (found.direct[0], found.answered[0]):
            size = np.abs(loads).max()
            assert loads[1] == pytest.approx(loads[0] * [-1, 1, 1, 1, -1, -1], abs=1e-9 * size)


def test_port_and_starboard_are_mirror_images():
    headings = np.array([0.5, 2.5])
    for free in ((), FREE):
        one, other = (
            mean_loads(spheroid(30.0, 4.0, free), 0.7, sign * headings, np.array([4.0]), np.array([12.0]))
            for sign in (1.0, -1.0)
        )
        for a, b in ((one.direct, other.direct), (one.answered, other.answered)):
            assert b == pytest.approx(a * [1, -1, 1, -1, 1, -1], abs=1e-9 * np.abs(a).max())


def test_deep_boats_have_the_waves_own_suction_alone():
    """The free surface's answer dies out with depth beyond exp(-2 k z), as the cube of the depth or faster."""
    body = spheroid(30.0, 4.0, ())
    found = mean_loads(body, 0.7, np.array([0.8]), np.zeros(1), np.array([12.0, 60.0, 300.0]))
    near, far, deep = np.abs(found.answered[:, 0, 2]) / np.abs(found.direct[0, 0, 2])
    assert near < 0.3
    assert far < 0.02
    assert deep < 0.02 * (60.0 / 300.0) ** 2


def test_a_fixed_slender_body_is_sucked_by_its_volume_and_added_mass_section_by_section():
    """Force on a fixed body: (rho A + m) grad(v^2/2) along it; the hydrostatic head adds no more than -1/2 rho v^2."""
    a, b, frequency, heading = 30.0, 1.0, 0.7, 0.6
    body, k = spheroid(a, b, ()), frequency**2 / G
    found = mean_loads(body, frequency, np.array([heading]), np.zeros(1), np.array([20.0])).direct[0, 0]
    c = lamb(a, b)
    share = 1.0 + 0.5 * (c[2] + c[0] * np.cos(heading) ** 2 + c[1] * np.sin(heading) ** 2)
    # <grad(v^2/2)> is the same all along: a^2 omega^2 k, half of it by either component of v.
    assert found[2] == pytest.approx(-share * body.displaced.sum() * frequency**2 * k, rel=3e-3)
