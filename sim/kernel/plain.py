"""The right-hand side once more in plain NumPy: readable, for benchmarks and as a check.

It shares the assembled tables with ``sim.kernel.rhs`` and nothing else: vectors and matrices
instead of scalars, ``np.searchsorted`` and tensor products instead of loops.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import BOAT_FEATURES
from sim.boat.forces import boat_features
from sim.boat.mass import cross_matrix
from sim.kernel import layout
from sim.kernel.layout import Model

Array = NDArray[np.float64]


def _weights(nodes: Array, rule: int, x: float) -> tuple[int, Array]:
    i = int(np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, nodes.size - 2))
    a, b = nodes[i], nodes[i + 1]
    outward = a * b > 0.0 and x * a > 0.0 and abs(x) > max(abs(a), abs(b))
    if rule == layout.LINEAR_LOAD and outward:
        t = (1.0 / x - 1.0 / a) / (1.0 / b - 1.0 / a)
    else:
        t = (x - a) / (b - a)
        t = t if rule == layout.LINEAR else min(max(t, 0.0), 1.0)
    return i, np.array([1.0 - t, t])


def features(m: Model, y: Array, c: Array) -> Array:
    """Feature vector as ``sim.kernel.rhs.features`` fills it, the constant 1 last."""
    n_planes = len(m.planes)
    n = float(c[n_planes])
    advance = (1.0 - m.wake) * y[0] / (n * m.diameter) if n else 0.0
    boat = boat_features(list(y[:3]), list(y[3:6]), y[8] + m.sail_top, n, advance)
    through = y[:3] + np.cross(y[3:6], m.planes[:, :3])
    speed = np.linalg.norm(through, axis=1)
    sine = -np.einsum("ij,ij->i", through, m.planes[:, 3:]) / np.where(speed > 0.0, speed, 1.0)
    plane = np.column_stack([speed, c[:n_planes] + np.arcsin(np.clip(sine, -1.0, 1.0)), c[:n_planes]])
    return np.concatenate([[boat[k] for k in BOAT_FEATURES], plane.reshape(-1), [1.0]])


def loads(m: Model, f: Array) -> Array:
    """Hydrodynamic loads X Y Z K M N [N, N m] from a feature vector."""
    total = np.zeros(layout.N_OUT)
    products = np.prod(f[m.multipliers], axis=1)
    for axes, strides, first, multipliers in m.groups:
        weight, place = np.ones(1), np.array([first])
        for axis, stride in zip(axes, strides, strict=True):
            feature, rule, node, nodes = m.axes[axis]
            i, w = _weights(m.nodes[node : node + nodes], rule, f[feature])
            weight = np.multiply.outer(weight, w).reshape(-1)
            place = np.add.outer(place, np.array([i, i + 1]) * stride).reshape(-1)
        total += (weight @ m.data[place]) * products[list(multipliers)]
    total[0] += (1.0 - total[layout.OUT_DEDUCTION]) * total[layout.OUT_THRUST]
    return total[:6]


def rhs(m: Model, y: Array, c: Array) -> Array:
    """Time derivative of the state; arguments as ``sim.kernel.rhs.rhs``."""
    v, omega = y[:3], y[3:6]
    (sf, st, sp), (cf, ct, cp) = np.sin(y[9:12]), np.cos(y[9:12])
    rotation = np.array(
        [
            [ct * cp, sf * st * cp - cf * sp, cf * st * cp + sf * sp],
            [ct * sp, sf * st * sp + cf * cp, cf * st * sp - sf * cp],
            [-st, sf * ct, cf * ct],
        ]
    )
    ixx, iyy, izz, ixy, ixz, iyz = m.inertia
    inertia = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    r_g, r_b, down = m.r_g, m.r_b, rotation[2]
    mass, weight, inverse = m.mass, m.weight, m.inverse_mass
    if m.has_tanks:
        ballast, shift, tank = c[-2], c[-1], m.tank
        moment = m.mass * np.array([shift, 0.0, 0.0]) + ballast * tank
        lever = cross_matrix(tank)
        inertia = inertia - ballast * lever @ lever
        own = cross_matrix(moment)
        inverse = np.linalg.inv(
            m.mass_matrix + np.block([[ballast * np.eye(3), -own], [own, -ballast * lever @ lever]])
        )
        mass += ballast
        r_g, weight = (m.mass * r_g + moment) / mass, weight * mass / m.mass
    swing = np.cross(omega, v)
    force = (weight - m.buoyancy) * down - mass * (swing + np.cross(omega, np.cross(omega, r_g)))
    moment = np.cross(weight * r_g - m.buoyancy * r_b, down)
    moment = moment - np.cross(omega, inertia @ omega) - mass * cross_matrix(r_g) @ swing
    acceleration = inverse @ (loads(m, features(m, y, c)) + np.concatenate([force, moment]))
    tangent = st / ct if ct else math.inf
    euler = np.array([[1.0, sf * tangent, cf * tangent], [0.0, cf, -sf], [0.0, sf / ct, cf / ct]])
    return np.concatenate([acceleration, rotation @ v, euler @ omega])
