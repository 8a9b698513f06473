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
) -> dict[str, float]:
    """Every factor and axis of the term table that belongs to the whole boat.

    Parameters
    ----------
    velocity : u, v, w through the water [m/s], program frame.
    rates : p, q, r [rad/s].
    depth : D0, depth of the sail top [m].
    revolutions : n [1/s].
    advance : J, advance coefficient.

    Returns
    -------
    Feature name -> value, as in ``catalogue.BOAT_FEATURES``.
    """
    u, v, w = velocity
    p, q, r = rates
    speed = math.sqrt(u * u + v * v + w * w)
    base = {"u": u, "v": v, "w": w, "p": p, "q": q, "r": r}
    found = dict(base) | {f"|{k}|": abs(x) for k, x in base.items()}
    found |= {a + b: base[a] * base[b] for a in "uvw" for b in "pqr"}
    found |= {"pq": p * q, "qr": q * r, "rp": r * p}
    found["U"] = speed
    found["v/U"], found["r/U"] = (v / speed, r / speed) if speed else (0.0, 0.0)
    found["v/r"] = v / r if abs(r) > STILL else 0.0
    found["w/q"] = w / q if abs(q) > STILL else 0.0
    found["S"] = math.hypot(v, w)
    found["sgn(v)"], found["sgn(w)"] = float(np.sign(v)), float(np.sign(w))
    found["alpha"] = math.atan2(w, u) if u or w else 0.0
    found["beta"] = math.asin(max(-1.0, min(1.0, v / speed))) if speed else 0.0
    found["D0"] = depth
    found["n"], found["|n|"], found["J"] = revolutions, abs(revolutions), advance
    return found


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
