"""Froude-Krylov load: the pressure of the undisturbed waves over a submerged hull.

The reference is the surface integral over the triangles, Eqs. (42)-(47) as corrected. For a
closed, fully submerged surface the divergence theorem turns it into a volume integral,

    F = -int p n dS = -int grad p dV,    M = -int p r x n dS = -int r x grad p dV,

and with one potential -grad p = rho dv/dt. The fast form is a quadrature of that volume
integral: Gauss stations along each part and, in each section, points that have the section's
area, centroid and second moments. It is exact for pressures up to second order across a
section and costs two orders of magnitude less than the triangles.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, exp, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.boat.state import PHI, PSI, THETA, X, Y, Z
from sim.compiled import making, outer
from sim.hull.mesh import Mesh
from sim.waves.linear import Waves, kinematics

Array = NDArray[np.float64]

# Share of the whole load that may be lost where a part or a section is taken as fewer points.
_NEGLIGIBLE = 3e-4
_SLICES = 160
# Relative difference of second moments below which a section is round.
_ROUND = 1e-9


class Quadrature(NamedTuple):
    """Points (n, 3) in the body frame [m] and the volumes (n,) they stand for [m^3]."""

    points: Array
    volumes: Array


def rotation(phi: float, theta: float, psi: float) -> Array:
    """Matrix that turns body components to earth components, Euler 3-2-1 [rad]."""
    matrix = np.empty((3, 3))
    fill_rotation(phi, theta, psi, matrix)
    return matrix


@outer
def fill_rotation(phi: float, theta: float, psi: float, out: Array) -> None:
    """``rotation`` into a (3, 3) array."""
    sf, cf, st, ct, sp, cp = sin(phi), cos(phi), sin(theta), cos(theta), sin(psi), cos(psi)
    out[0, 0], out[0, 1], out[0, 2] = ct * cp, sf * st * cp - cf * sp, cf * st * cp + sf * sp
    out[1, 0], out[1, 1], out[1, 2] = ct * sp, sf * st * sp + cf * cp, cf * st * sp - sf * cp
    out[2, 0], out[2, 1], out[2, 2] = -st, sf * ct, cf * ct


@outer
def box_top(box: Array, at: int, a: float, b: float, d: float) -> float:
    """Depth of the highest corner of a body-axis box below the body origin [m]; negative above.

    Parameters
    ----------
    box : Holds the low and the high corner of the box [m] from ``at`` on.
    a, b, d : Downward direction in body axes: last row of ``rotation``.
    """
    along = min(a * box[at], a * box[at + 3])
    return along + min(b * box[at + 1], b * box[at + 4]) + min(d * box[at + 2], d * box[at + 5])


def surface_load(mesh: Mesh, pressure: Callable[[Array], Array]) -> Array:
    """Load of a pressure field by the triangles, Eqs. (43)-(46): exact for linear pressure.

    Parameters
    ----------
    mesh : Closed and outward, body frame [m].
    pressure : Gives [Pa] (...) at points (..., 3) of the body frame.

    Returns
    -------
    (6,) force [N] and moment about the body origin [N m], body axes.
    """
    corners = mesh.corners
    middle = 0.5 * (corners + np.roll(corners, -1, axis=1))
    p = pressure(middle)
    lever = np.einsum("ij,ijk->ik", p, middle)
    return -np.concatenate([p.sum(axis=1) @ mesh.areas, np.cross(lever, mesh.areas).sum(axis=0)]) / 3.0


def reference_load(mesh: Mesh, waves: Waves, y: Array, time: float) -> Array:
    """Froude-Krylov load by the surface integral over the triangles.

    Parameters
    ----------
    mesh : Closed and outward, body frame [m].
    waves : Components.
    y : (12,) state; position y[6:9] and attitude y[9:12] are used.
    time : [s].

    Returns
    -------
    (6,) X Y Z K M N about the body origin [N, N m].
    """
    matrix = rotation(y[PHI], y[THETA], y[PSI])
    return surface_load(mesh, lambda r: kinematics(waves, y[6:9] + r @ matrix.T, time).pressure)


def quadrature(mesh: Mesh, shortest: float, displaced: float | None = None) -> Quadrature:
    """Volume points of a mesh for waves no shorter than a length.

    Parameters
    ----------
    mesh : Closed and outward, body frame [m].
    shortest : Shortest wavelength that matters [m]; sets the number of stations.
    displaced : Displaced volume [m^3] to scale to, when the mesh's own is not the vehicle's;
        a neutrally buoyant boat then follows long waves exactly.

    Returns
    -------
    Points whose volume and centroid are those of the mesh, part by part.
    """
    number = 2.0 * np.pi / shortest
    scale = 1.0 if displaced is None else displaced / mesh.volume
    points, volumes = [], []
    for name in mesh.names:
        part = mesh.only(name)
        p, v = _part_points(part, number, _NEGLIGIBLE * mesh.volume / part.volume)
        v = v * (part.volume / v.sum())
        points.append(p + part.centroid - v @ p / part.volume)
        volumes.append(v * scale)
    return Quadrature(np.concatenate(points), np.concatenate(volumes))


def _gauss(x: Array, weight: Array, functions: Array, count: int) -> tuple[Array, Array, Array]:
    """Gauss rule of a discrete measure, and functions at its nodes by projection.

    The rule integrates polynomials of degree 2 ``count`` - 1 times the measure exactly, and
    each function times polynomials of degree ``count`` - 1 (Golub and Welsch 1969).

    Parameters
    ----------
    x, weight : (m,) places and weights of the measure.
    functions : (m, k).
    count : Nodes.

    Returns
    -------
    nodes, weights : (count,); values : (count, k).
    """
    root = np.sqrt(weight)
    middle, half = 0.5 * (x[0] + x[-1]), 0.5 * (x[-1] - x[0])
    t = (x - middle) / half
    q = np.linalg.qr(root[:, None] * np.polynomial.legendre.legvander(t, count - 1))[0]
    nodes, u = np.linalg.eigh(q.T @ (t[:, None] * q))
    share = u.T @ (q.T @ root)
    values = u.T @ (q.T @ (root[:, None] * functions)) / share[:, None]
    return middle + half * nodes, share**2, values


def _stations(x: Array, weight: Array, functions: Array, number: float, tolerance: float) -> tuple[Array, Array, Array]:
    """The Gauss rule of fewest stations that holds the load of a wave along them.

    The load has a wave's pressure, its gradient times the centroids and its curvature times the second moments, each
    with its lever; of any of them no more than a share of the largest load may be lost.

    Parameters
    ----------
    x, weight : (m,) fine places and weights. functions : (m, 6) centroid and second moments of the section.
    number : Largest wave number [1/m]. tolerance : Share of the load.

    Returns
    -------
    As ``_gauss``.
    """
    middle, half = 0.5 * (x[0] + x[-1]), 0.5 * (x[-1] - x[0])
    order = np.array([1.0, *[number] * 2, *[0.5 * number**2] * 4])

    def load(at: Array, share: Array, shape: Array) -> Array:
        wave = np.exp(1j * number * (at - middle))
        lever = np.stack([np.ones(at.size), (at - middle) / half])
        return np.asarray(np.einsum("i,li,ij->lj", share * wave, lever, np.column_stack([np.ones(at.size), shape])))

    exact = load(x, weight, functions)
    # Bessel coefficients of exp(ikx) over the part die out beyond k times its half length.
    most = 4 + int(np.ceil(number * half))
    for count in range(1, most):
        rule = _gauss(x, weight, functions, count)
        if (np.abs(load(*rule) - exact) * order).max() < tolerance * weight.sum():
            return rule
    return _gauss(x, weight, functions, most)


def _principal(moments: Array) -> tuple[Array, Array]:
    """Principal second moments of a section (2,), ascending, and their axes as columns (2, 2).

    A round section has no axes of its own: it is given those of the boat, as rounding would
    otherwise choose them.
    """
    middle, half, mixed = 0.5 * (moments[0, 0] + moments[1, 1]), 0.5 * (moments[0, 0] - moments[1, 1]), moments[0, 1]
    radius = float(np.hypot(half, mixed))
    if radius <= _ROUND * middle:
        return np.full(2, max(middle, 0.0)), np.eye(2)
    angle = 0.5 * np.arctan2(mixed, half)
    c, s = np.cos(angle), np.sin(angle)
    return np.maximum([middle - radius, middle + radius], 0.0), np.array([[-s, c], [c, s]])


def _part_points(part: Mesh, number: float, tolerance: float) -> tuple[Array, Array]:
    """Gauss stations along the longest axis of a part, a few points in each section."""
    used = part.vertices[np.unique(part.triangles)]
    low, high = used.min(axis=0), used.max(axis=0)
    axis = int(np.argmax(high - low))
    half = 0.5 * (high[axis] - low[axis])
    # A bar of half length h has second moment h^2/3; its wave load is off by k^2 h^2/6.
    if (number * half) ** 2 / 6.0 < tolerance:
        return part.centroid[None, :], np.array([part.volume])
    fine, steps = np.polynomial.legendre.leggauss(_SLICES)
    cuts = [part.section(axis, low[axis] + half * (1.0 + node)) for node in fine]
    kept = [k for k, cut in enumerate(cuts) if cut[0] > 0.0]
    area = np.array([cuts[k][0] for k in kept])
    shape = np.array([[*cuts[k][1], *(cuts[k][2] / cuts[k][0]).ravel()] for k in kept])
    x, measure = low[axis] + half * (1.0 + fine[kept]), half * steps[kept] * area
    at, weight, shape = _stations(x, measure, shape, number, tolerance)
    others = [(axis + 1) % 3, (axis + 2) % 3]
    points, volumes = [], []
    for place_x, volume, (first, second, *moments) in zip(at, weight, shape, strict=True):
        spread, axes = _principal(np.reshape(moments, (2, 2)))
        share = volume / measure.sum()
        if number**2 * spread[1] / 2.0 * share < tolerance / at.size:
            offsets = np.zeros((1, 2))
        elif number**2 * spread[0] / 2.0 * share < tolerance / at.size:
            offsets = np.sqrt(spread[1]) * np.array([axes[:, 1], -axes[:, 1]])
        else:
            pair = np.sqrt(2.0 * spread) * axes
            offsets = np.concatenate([pair.T, -pair.T])
        place = np.empty((len(offsets), 3))
        place[:, axis] = place_x
        place[:, others] = np.array([first, second]) + offsets
        points.append(place)
        volumes.append(np.full(len(offsets), volume / len(offsets)))
    return np.concatenate(points), np.concatenate(volumes)


@making
def froude_krylov(w: Waves, q: Quadrature, y: Array, time: float, out: Array) -> None:
    """Froude-Krylov load by the quadrature; zero, and nothing else done, without components.

    Parameters
    ----------
    w : Components.
    q : Of the vehicle.
    y : (12,) state; position and attitude are used.
    time : [s].
    out : (6,) X Y Z K M N about the body origin [N, N m].
    """
    for i in range(6):
        out[i] = 0.0
    if w.amplitude.size == 0:
        return
    m = np.empty((3, 3))
    fill_rotation(y[PHI], y[THETA], y[PSI], m)
    for i in range(q.volumes.size):
        a, b, c = q.points[i, 0], q.points[i, 1], q.points[i, 2]
        x = y[X] - w.flow_north * time + m[0, 0] * a + m[0, 1] * b + m[0, 2] * c
        yy = y[Y] - w.flow_east * time + m[1, 0] * a + m[1, 1] * b + m[1, 2] * c
        z = y[Z] + m[2, 0] * a + m[2, 1] * b + m[2, 2] * c
        north, east, down = 0.0, 0.0, 0.0
        for j in range(w.amplitude.size):
            angle = w.number[j] * (w.north[j] * x + w.east[j] * yy) - w.frequency[j] * time + w.phase[j]
            size = w.amplitude[j] * w.frequency[j] * w.frequency[j] * exp(-w.number[j] * z)
            along = size * sin(angle)
            north += w.north[j] * along
            east += w.east[j] * along
            down += size * cos(angle)
        mass = w.density * q.volumes[i]
        fx = mass * (m[0, 0] * north + m[1, 0] * east + m[2, 0] * down)
        fy = mass * (m[0, 1] * north + m[1, 1] * east + m[2, 1] * down)
        fz = mass * (m[0, 2] * north + m[1, 2] * east + m[2, 2] * down)
        out[0] += fx
        out[1] += fy
        out[2] += fz
        out[3] += b * fz - c * fy
        out[4] += c * fx - a * fz
        out[5] += a * fy - b * fx
