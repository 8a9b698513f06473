"""Spheroids and other bodies as dipoles, for tests of mean wave loads."""

from __future__ import annotations

import numpy as np

from sim.boat.mass import cross_matrix
from sim.waves.mean_loads import DipoleBody, plane_waves

RHO, G = 1025.0, 9.81
# Roll is held.
FREE = (0, 1, 2, 4, 5)


def lamb(a, b):
    """Added-mass coefficients of a prolate spheroid, Lamb (1932), art. 114."""
    if a == b:
        return np.full(3, 0.5)
    e = np.sqrt(1.0 - (b / a) ** 2)
    log = np.log((1.0 + e) / (1.0 - e))
    x = 2.0 * (1.0 - e * e) / e**3 * (0.5 * log - e)
    y = 1.0 / e**2 - (1.0 - e * e) / (2.0 * e**3) * log
    return np.array([x / (2.0 - x), y / (2.0 - y), y / (2.0 - y)])


def spheroid(a, b, free=FREE, stations=16):
    """A homogeneous, neutrally buoyant spheroid; each section is four points with its second moments."""
    volume = 4.0 / 3.0 * np.pi * a * b * b
    x, weight = np.polynomial.legendre.leggauss(stations)
    r = b * np.sqrt((1.0 - x * x) / 2.0)
    points = np.array([(a * u, s * y, s * z) for u, s in zip(x, r) for y, z in ((1, 0), (-1, 0), (0, 1), (0, -1))])
    mass = RHO * volume * 0.75 / 4.0 * np.repeat(weight * (1.0 - x * x), 4)
    return assembled(
        points,
        mass,
        mass[:, None] * lamb(a, b),
        RHO * volume / 5.0 * np.array([2 * b * b, a * a + b * b, a * a + b * b]),
        free,
    )


def assembled(points, displaced, added, inertia, free):
    total = np.diag([*[displaced.sum()] * 3, *inertia])
    for r, m in zip(points, added, strict=True):
        motion = np.hstack([np.eye(3), -cross_matrix(r)])
        total += motion.T @ (m[:, None] * motion)
    return DipoleBody(points, displaced, added, total, np.zeros((6, 6)), free, RHO, G)


def kochin(body, number, dipoles, angles):
    """Kochin function of dipoles: far away phi = -i k/2 sqrt(2/(pi k R)) exp(i k R - i pi/4 - k z) H.

    Parameters
    ----------
    dipoles : (m, n, 3) [kg m/s]. angles : (c,) [rad].

    Returns
    -------
    (m, c) H, without the decay exp(-k z) down to the origin [m^3/s].
    """
    g = plane_waves(body, number, angles)[1]
    return -np.einsum("cni,mni->mc", g.conj(), dipoles) / body.density
