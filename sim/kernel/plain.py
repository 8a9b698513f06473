"""The right-hand side once more in plain NumPy: readable, for benchmarks and as a check.

It shares the assembled tables with ``sim.kernel.rhs`` and nothing else: vectors and matrices
instead of scalars, ``np.searchsorted`` and tensor products instead of loops.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import BOAT_FEATURES
from sim.boat.forces import boat_features, slipstream
from sim.boat.mass import cross_matrix
from sim.boat.state import Z
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
    of = _ship(m)
    slip = slipstream(float(y[0]), n, of["J_0 D"], of["C_T1"])
    boat = boat_features(list(y[:3]), list(y[3:6]), y[Z] + m.sail_top, n, advance, slip)
    through = y[:3] + np.cross(y[3:6], m.planes[:, :3])
    speed = np.linalg.norm(through, axis=1)
    sine = -np.einsum("ij,ij->i", through, m.planes[:, 3:]) / np.where(speed > 0.0, speed, 1.0)
    plane = np.column_stack([speed, c[:n_planes] + np.arcsin(np.clip(sine, -1.0, 1.0)), c[:n_planes]])
    return np.concatenate([[boat[k] for k in BOAT_FEATURES], plane.reshape(-1), [1.0]])


def _ship(m: Model) -> dict[str, float]:
    return dict(zip(layout.SHIP_PLACES, m.ship.tolist(), strict=True))


def ship_loads(m: Model, f: Array) -> Array:
    """X Y Z K M N of a ship's propeller and rudder, the equations of Yasukawa and Yoshimura (2015) one by one."""
    total, of = np.zeros(6), _ship(m)
    u, v, r, speed, n = (float(f[BOAT_FEATURES.index(k)]) for k in ("u", "v", "r", "U", "n"))
    beta, yaw = math.atan2(-v, u), r * of["length"] / speed
    beta_p, beta_r = beta - of["x_P"] * yaw, beta - of["l_R"] * yaw
    c_2 = of["C_2+"] if beta_p > 0.0 else of["C_2-"]
    one_less_w = (1.0 - of["w_P0"]) * (1.0 + (1.0 - math.exp(-of["C_1"] * abs(beta_p))) * (c_2 - 1.0))
    advance = u * one_less_w / (n * m.diameter)
    k_t = of["k_0"] + of["k_1"] * advance + of["k_2"] * advance**2
    total[0] = (1.0 - of["t_P"]) * of["density"] * n**2 * m.diameter**4 * k_t
    if not m.whole[layout.HAS_RUDDER]:
        return total
    quicker = math.sqrt(1.0 + 8.0 * k_t / (math.pi * advance**2)) - 1.0
    eta = m.diameter / of["H_R"]
    u_r = of["epsilon"] * u * one_less_w * math.sqrt(eta * (1.0 + of["kappa"] * quicker) ** 2 + 1.0 - eta)
    v_r = speed * beta_r * (of["gamma_R+"] if beta_r > 0.0 else of["gamma_R-"])
    delta = f[len(BOAT_FEATURES) + 3 * int(m.whole[layout.RUDDER]) + 2]
    normal = (
        0.5 * of["density"] * of["A_R"] * (u_r**2 + v_r**2) * of["f_alpha"] * math.sin(delta - math.atan(v_r / u_r))
    )
    total[0] -= (1.0 - of["t_R"]) * normal * math.sin(delta)
    total[1] -= (1.0 + of["a_H"]) * normal * math.cos(delta)
    total[5] -= (of["x_R"] + of["a_H"] * of["x_H"] * of["length"]) * normal * math.cos(delta)
    return total


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
    return total[:6] + ship_loads(m, f) if m.whole[layout.HAS_PROPELLER] else total[:6]


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
        coupling = cross_matrix(moment)
        inverse = np.linalg.inv(
            m.mass_matrix + np.block([[ballast * np.eye(3), -coupling], [coupling, -ballast * lever @ lever]])
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
