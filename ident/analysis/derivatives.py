"""Linear derivatives about straight ahead motion: a check of signs and magnitudes.

The tables of a database are not derivatives, and a sign lost in a frame or a mirror does
not show in a plot. Slopes of the assembled forward model do show it: they have known signs
for any submarine and published neighbours (``data/sign_checks.csv``).
"""

from __future__ import annotations

import csv
import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import OUTPUTS
from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.boat.vehicle import Vehicle
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import Model, workspace

Array = NDArray[np.float64]

# Steps of the central difference, discretisation and not properties of a boat. Tables have
# a kink at zero: about one degree of flow angle, and the rate r L / U = 0.2 of a moderate
# turn. Constant coefficients have a slope there: small steps, so that v|v| does not enter.
_TABLE_STEPS = (math.radians(1.0), 0.2)
_CONSTANT_STEPS = (1e-6, 1e-6)
_MOTIONS = "uvwpqr"
_HULL = frozenset({"hull"})


@dataclass(frozen=True)
class Check:
    """One row of ``data/sign_checks.csv``: sign in the program frame, a published neighbour."""

    symbol: str
    expected: int
    suboff: float | None
    source: str


@dataclass(frozen=True)
class Derivative:
    """A linear derivative in prime form, program frame.

    Attributes
    ----------
    symbol : Load component and motion, ``Y_v``.
    hull : With the coefficients of the part ``hull`` alone.
    whole : Of the whole boat: hull, planes at zero deflection, propeller.
    expected : Sign every submarine of this kind has, +1 or -1.
    suboff : Published value of the fully appended SUBOFF, where there is one.
    ok : True when ``whole`` has the expected sign; a vanishing derivative fails.
    """

    symbol: str
    hull: float
    whole: float
    expected: int
    suboff: float | None
    ok: bool


@cache
def checks() -> tuple[Check, ...]:
    """The derivatives with a known sign, from ``data/sign_checks.csv``."""
    with (files("ident") / "data" / "sign_checks.csv").open(encoding="utf-8") as stream:
        return tuple(
            Check(
                r["symbol"],
                1 if r["expected"] == "+" else -1,
                float(r["suboff"]) if r["suboff"] else None,
                r["source"],
            )
            for r in csv.DictReader(stream)
        )


class _Parts(Coefficients):
    """The coefficients that some parts of the boat carry."""

    def __init__(self, whole: Coefficients, parts: Collection[str]) -> None:
        self.vehicle = whole.vehicle
        self._all = {(c.term.name, c.part): c for c in whole if c.part in parts}


def loads(model: Model, motion: Array, depth: float, controls: Array) -> Array:
    """Hydrodynamic loads of the assembled boat in one state.

    Parameters
    ----------
    model : The boat.
    motion : u v w p q r [m/s, rad/s].
    depth : D0 [m].
    controls : (planes + 1,) deflections [rad] and n [1/s].

    Returns
    -------
    X Y Z K M N [N, N m], program frame.
    """
    work = workspace(model)
    state = np.zeros(12)
    state[:6] = motion
    state[8] = depth - model.sail_top
    kernel.features(model, state, controls, work)
    kernel.loads(model, work)
    return work.loads[: len(OUTPUTS)].copy()


def steps(vehicle: Vehicle) -> tuple[float, float]:
    """Steps of the central differences: flow angle [rad], and rate times L / U."""
    return _TABLE_STEPS if vehicle.terms_of.tabulated else _CONSTANT_STEPS


def slope(model: Model, vehicle: Vehicle, name: str, speed: float, depth: float, revolutions: float) -> Array:
    """Central difference of the loads by one motion about straight ahead motion.

    Steps as in ``derivatives``; planes at zero.

    Parameters
    ----------
    model, vehicle : The boat.
    name : Motion, one of v w p q r.
    speed, depth, revolutions : U [m/s], D0 [m], n [1/s].

    Returns
    -------
    (6,) slopes of X Y Z K M N [N or N m per m/s or rad/s].
    """
    controls = np.zeros(len(vehicle.planes) + 1)
    controls[-1] = revolutions
    turned = name in "vw"
    flow, rate = steps(vehicle)
    step = speed * math.sin(flow) if turned else rate * speed / vehicle.particulars.length.value
    side = []
    for sign in (1.0, -1.0):
        motion = np.zeros(6)
        # A flow angle turns the velocity: its size stays at the tabulated speed.
        motion[0] = speed * math.cos(flow) if turned else speed
        motion[_MOTIONS.index(name)] = sign * step
        side.append(loads(model, motion, depth, controls))
    return (side[0] - side[1]) / (2.0 * step)


def prime_scale(output: str, motion: str, density: float, length: float) -> float:
    """1/2 rho L^n of a linear derivative: n = 2 for a force by v or w, one more for a
    moment, one more for a rate."""
    return 0.5 * density * length ** (2 + (output in "KMN") + (motion in "pqr"))


def derivatives(
    coefficients: Coefficients, environment: Environment, speed: float, depth: float, revolutions: float = 0.0
) -> list[Derivative]:
    """Linear derivatives of the hydrodynamic loads about straight ahead motion.

    Central differences of the forward model, not fits to the tables. Many tables have a
    kink at zero, where the slope of a small step would be that of the innermost interval
    alone, so the steps are those of a moderate maneuver: one degree of flow angle for v
    and w, the rate 0.2 U/L for p, q and r. Terms even in the motion cancel; a term odd but
    not linear, such as p|p|, enters with its secant over the step. For a vehicle of constant
    coefficients the steps are small, and the slopes are the linear coefficients themselves.

    Parameters
    ----------
    coefficients : Of one vehicle, from the database.
    environment : Water density and gravity. Prime values do not depend on either.
    speed : U [m/s], ahead.
    depth : D0, depth of the sail top [m].
    revolutions : n of the propeller [1/s]; thrust and torque do not enter the derivatives
        by v, w, p, q and r, so zero serves.

    Returns
    -------
    One row a line of ``data/sign_checks.csv``: force by v, w over 1/2 rho L^2 U, force by
    rate and moment by v, w over 1/2 rho L^3 U, moment by rate over 1/2 rho L^4 U.

    Raises
    ------
    ValueError
        When the speed is not positive.
    """
    if not speed > 0.0:
        raise ValueError(f"speed {speed} m/s; derivatives about straight ahead motion need a positive one")
    vehicle = coefficients.vehicle
    length = vehicle.particulars.length.value
    models = [assemble(c, environment) for c in (_Parts(coefficients, _HULL), coefficients)]
    slopes: dict[str, list[Array]] = {}
    compared = []
    for check in checks():
        output, motion = check.symbol.split("_")
        if motion not in slopes:
            slopes[motion] = [slope(m, vehicle, motion, speed, depth, revolutions) for m in models]
        scale = prime_scale(output, motion, environment.density, length) * speed
        hull, whole = (float(s[OUTPUTS.index(output)]) / scale for s in slopes[motion])
        compared.append(
            Derivative(check.symbol, hull, whole, check.expected, check.suboff, whole * check.expected > 0.0)
        )
    return compared
