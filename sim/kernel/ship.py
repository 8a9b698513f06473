"""Propeller and rudder of a ship, and what a slipstream adds at the stern. Compiled.

Both are written in coefficients that are no loads of their own: rows of the term table without an
output, as thrust deduction and wake are. A model without them passes over this module.
"""

from __future__ import annotations

from math import atan2, cos, exp, pi, sin, sqrt

import numpy as np

from sim.boat.catalogue import BOAT_FEATURES
from sim.compiled import inner
from sim.kernel.layout import DIAMETER, FEATURES, FIRST_PLANE, HAS_RUDDER, LOADS, N_PLANE, RUDDER, SHIP, SHIP_PLACES

_AT = {name: FEATURES + i for i, name in enumerate(BOAT_FEATURES)}
_U, _V, _R, _SPEED, _N, _SLIP = _AT["u"], _AT["v"], _AT["r"], _AT["U"], _AT["n"], _AT["slip"]
_OF = {name: SHIP + i for i, name in enumerate(SHIP_PLACES)}
_DENSITY, _LENGTH, _AREA, _SPAN, _X_R = (_OF[k] for k in ("density", "length", "A_R", "H_R", "x_R"))
_T_P, _W_P0, _C_1, _C_2_PLUS, _C_2_MINUS, _X_P = (_OF[k] for k in ("t_P", "w_P0", "C_1", "C_2+", "C_2-", "x_P"))
_K_0, _K_1, _K_2, _KAPPA, _EPSILON, _F_ALPHA = (_OF[k] for k in ("k_0", "k_1", "k_2", "kappa", "epsilon", "f_alpha"))
_T_R, _A_H, _X_H, _L_R = (_OF[k] for k in ("t_R", "a_H", "x_H", "l_R"))
_GAMMA_PLUS, _GAMMA_MINUS = _OF["gamma_R+"], _OF["gamma_R-"]
PITCH, LOADING = _OF["J_0 D"], _OF["C_T1"]


@inner
def add_ship_loads(m: np.ndarray, w: np.ndarray, s: np.ndarray) -> None:
    """Add thrust and rudder force of the features in the scratch to the loads in it.

    The propeller, with J D n = u (1 - w_P) and w_P that drift and yaw change::

        X_P = (1 - t_P) rho D^2 (k_0 n^2 D^2 + k_1 n D u (1 - w_P) + k_2 u^2 (1 - w_P)^2)

    The rudder's normal force F_N = 1/2 rho A_R U_R^2 f_alpha sin(alpha_R), in a flow that the slipstream
    quickens and hull and propeller straighten; X_R, Y_R, N_R as the rows of the term table say.
    Yasukawa, H., Yoshimura, Y. (2015), *Introduction of MMG standard method for ship maneuvering
    predictions*, J Mar Sci Technol 20, 37-52, Eqs. (9)-(24).

    Parameters
    ----------
    m, w : Model, floats and whole numbers. s : Scratch.
    """
    u, speed, n, diameter = s[_U], s[_SPEED], s[_N], m[DIAMETER]
    drift = atan2(-s[_V], u) if speed > 0.0 else 0.0
    turn = s[_R] * m[_LENGTH] / speed if speed > 0.0 else 0.0
    at_propeller = drift - m[_X_P] * turn
    share = m[_C_2_PLUS] if at_propeller > 0.0 else m[_C_2_MINUS]
    ahead = u * (1.0 - m[_W_P0]) * (1.0 + (1.0 - exp(-m[_C_1] * abs(at_propeller))) * (share - 1.0))
    tip = n * diameter
    thrust = m[_DENSITY] * diameter * diameter
    thrust *= m[_K_0] * tip * abs(tip) + m[_K_1] * abs(tip) * ahead + m[_K_2] * ahead * ahead
    s[LOADS] += (1.0 - m[_T_P]) * thrust
    if w[HAS_RUDDER] == 0:
        return
    # u_P sqrt(1 + 8 K_T/(pi J^2)): the slipstream far behind an actuator disc.
    jet = sqrt(max(0.0, ahead * ahead + 8.0 * thrust / (pi * m[_DENSITY] * diameter * diameter)))
    within, eta = ahead + m[_KAPPA] * (jet - ahead), diameter / m[_SPAN]
    u_r = m[_EPSILON] * sqrt(eta * within * within + (1.0 - eta) * ahead * ahead)
    at_rudder = drift - m[_L_R] * turn
    v_r = speed * at_rudder * (m[_GAMMA_PLUS] if at_rudder > 0.0 else m[_GAMMA_MINUS])
    delta = s[FIRST_PLANE + N_PLANE * w[RUDDER] + 2]
    force = 0.5 * m[_DENSITY] * m[_AREA] * (u_r * u_r + v_r * v_r) * m[_F_ALPHA] * sin(delta - atan2(v_r, u_r))
    s[LOADS] -= (1.0 - m[_T_R]) * force * sin(delta)
    s[LOADS + 1] -= (1.0 + m[_A_H]) * force * cos(delta)
    s[LOADS + 5] -= (m[_X_R] + m[_A_H] * m[_X_H] * m[_LENGTH]) * force * cos(delta)


@inner
def fill_slipstream(m: np.ndarray, s: np.ndarray) -> None:
    """Features of ``sim.boat.forces.slipstream`` from u and n in the scratch."""
    u, n, loading = s[_U], s[_N], m[LOADING]
    s[_SLIP], s[_SLIP + 1] = 0.0, 0.0
    if u == 0.0:
        return
    eta = m[PITCH] * n / u
    sense = (1.0 if u > 0.0 else -1.0) * (1.0 if n > 0.0 else (-1.0 if n < 0.0 else 0.0))
    load = max(-1.0, loading * eta * abs(eta))
    slip = -1.0 + sense * (sqrt(load + 1.0) - 1.0) / (sqrt(loading + 1.0) - 1.0)
    s[_SLIP], s[_SLIP + 1] = slip, slip * u
