"""State features and monomials of the term table, in plain NumPy.

This is the readable form of what ``sim.kernel.rhs`` compiles; identification inverts it and
tests hold the two against each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sim.boat.catalogue import STILL, Term
from sim.boat.vehicle import Plane

# Below this fraction of the speed a velocity component is the rounding of cos(90 deg).
_ROUNDING = 1e-12


def body_velocity(speed: float, alpha: float, beta: float) -> tuple[float, float, float]:
    """Velocity through the water from speed and flow angles, program frame.

    Parameters
    ----------
    speed : U [m/s].
    alpha : atan2(w, u) [rad].
    beta : asin(v/U) [rad].

    Returns
    -------
    u, v, w [m/s].
    """
    parts = (math.cos(alpha) * math.cos(beta), math.sin(beta), math.sin(alpha) * math.cos(beta))
    u, v, w = (speed * c if abs(c) > _ROUNDING else 0.0 for c in parts)
    return u, v, w


def boat_features(
    velocity: Sequence[float],
    rates: Sequence[float],
    depth: float,
    revolutions: float = math.nan,
    advance: float = math.nan,
    slip: float = 0.0,
) -> dict[str, float]:
    """Every factor and axis of the term table that belongs to the whole boat.

    Parameters
    ----------
    velocity : u, v, w through the water [m/s], program frame.
    rates : p, q, r [rad/s].
    depth : D0, depth of the sail top [m].
    revolutions : n [1/s].
    advance : J, advance coefficient.
    slip : epsilon of ``slipstream``; zero for a set that has none.

    Returns
    -------
    Feature name -> value, as in ``catalogue.BOAT_FEATURES``.
    """
    u, v, w = velocity
    p, q, r = rates
    speed = math.sqrt(u * u + v * v + w * w)
    base = {"u": u, "v": v, "w": w, "p": p, "q": q, "r": r}
    features = dict(base) | {f"|{k}|": abs(x) for k, x in base.items()}
    features |= {a + b: base[a] * base[b] for a in "uvw" for b in "pqr"}
    features |= {"pq": p * q, "qr": q * r, "rp": r * p}
    features["U"] = speed
    features["v/U"], features["r/U"] = (v / speed, r / speed) if speed else (0.0, 0.0)
    features["v/r"] = v / r if abs(r) > STILL else 0.0
    features["w/q"] = w / q if abs(q) > STILL else 0.0
    features["S"] = math.hypot(v, w)
    features["sgn(v)"], features["sgn(w)"] = float(np.sign(v)), float(np.sign(w))
    features["alpha"] = math.atan2(w, u) if u or w else 0.0
    features["beta"] = math.asin(max(-1.0, min(1.0, v / speed))) if speed else 0.0
    features["D0"] = depth
    features["n"], features["|n|"], features["J"] = revolutions, abs(revolutions), advance
    features["slip"], features["uslip"] = slip, slip * u
    return features


def slipstream(ahead: float, revolutions: float, pitch: float, loading: float) -> float:
    """What the propeller adds to the flow at the stern over self-propulsion, Healey and Lienard (1993).

    epsilon = -1 + sgn(n)/sgn(u) (sqrt(C_T + 1) - 1) / (sqrt(C_T1 + 1) - 1) with C_T = C_T1 eta |eta| and
    eta = J_0 n D/u; zero in self-propulsion, where eta = 1.

    Parameters
    ----------
    ahead : u [m/s].
    revolutions : n [1/s].
    pitch : J_0 D, advance of a revolution in self-propulsion [m].
    loading : C_T1, thrust loading of self-propulsion.

    Examples
    --------
    >>> slipstream(1.8, 9.0, 0.2, 1.2)
    0.0
    """
    if not loading > 0.0 or ahead == 0.0:
        return 0.0
    eta = pitch * revolutions / ahead
    sense = math.copysign(1.0, ahead) * (math.copysign(1.0, revolutions) if revolutions else 0.0)
    load = max(-1.0, loading * eta * abs(eta))
    return -1.0 + sense * (math.sqrt(load + 1.0) - 1.0) / (math.sqrt(loading + 1.0) - 1.0)


def plane_features(
    plane: Plane, velocity: Sequence[float], rates: Sequence[float], deflection: float
) -> dict[str, float]:
    """Speed at a plane and its effective angle, Eqs. (32)-(35) with sign.

    Parameters
    ----------
    plane : The plane; position from the origin, program frame.
    velocity, rates : Of the boat through the water [m/s], [rad/s].
    deflection : Plane angle [rad].

    Returns
    -------
    ``V`` [m/s], ``delta`` effective angle [rad], ``deflection`` [rad]. A plane that moves
    along its own lift direction loses incidence.
    """
    through = np.asarray(velocity) + np.cross(rates, plane.position)
    speed = float(np.linalg.norm(through))
    sine = -float(through @ plane.lift_axis) / speed if speed > 0.0 else 0.0
    return {"V": speed, "delta": deflection + math.asin(max(-1.0, min(1.0, sine))), "deflection": deflection}


def multiplier(term: Term, features: dict[str, float]) -> float:
    """The monomial m(state) of a term; NaN when a factor is unknown in this state."""
    value = float(term.sign)
    for factor in term.factors:
        value *= features.get(factor, math.nan)
    return value


def axis_values(term: Term, features: dict[str, float]) -> list[float]:
    """Where the coefficient of a term is looked up in this state."""
    return [features[a] for a in term.axes]
