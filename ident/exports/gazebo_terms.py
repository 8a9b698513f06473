"""Loads of a boat as terms of Gazebo's hydrodynamics plugin: linear and quadratic in the body velocities.

The plugin's loads are sums of ``C a b`` and ``C a |b|``, a and b of u v w p q r, with constant C. Coefficients of that
form go over as they are. Tables are constants there: each is fitted to the loads at its own runs by least squares, at
one speed and depth, and how far the fit is off is told. What has no such form is lost, by name.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.analysis.derivatives import steps
from sim.boat.catalogue import OUTPUTS
from sim.boat.coefficients import Coefficient, Coefficients
from sim.boat.mass import Environment
from sim.boat.vehicle import Plane

Array = NDArray[np.float64]
MOTIONS = "uvwpqr"
_ODD = (("u", "v"), ("v", "|v|"))
_EVEN = (("v", "v"),)
_VERTICAL = (("u", "w"), ("w", "|w|"), ("w", "w"))
_AHEAD = ("u", "|u|")
_STATES = ("U", "D0")


@dataclass(frozen=True)
class Share:
    """What one coefficient gives to one term.

    Attributes
    ----------
    value : SI, frame x forward, y to starboard, z down.
    source : The coefficient, its part, and how it was made a constant.
    """

    value: float
    source: str


@dataclass
class Terms:
    """Terms of the plugin.

    Attributes
    ----------
    shares : (load, motion, another, its size in bars or nothing) -> what adds up to it.
    lost : What has no term, a line each.
    largest_misfit : Of the fitted tables, as a share of the largest load of the table that it is of.
    """

    shares: dict[tuple[str, str, str], list[Share]] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)
    largest_misfit: float = 0.0

    def add(self, output: str, pair: tuple[str, str], value: float, source: str) -> None:
        """One more share of a term, whose motions may stand in any order; nothing where it is zero."""
        a, b = pair
        if b in MOTIONS and b:
            a, b = sorted(pair, key=MOTIONS.index)
        if value:
            self.shares.setdefault((output, a, b), []).append(Share(value, source))

    def values(self) -> dict[tuple[str, str, str], float]:
        """The terms, summed."""
        return {key: math.fsum(s.value for s in shares) for key, shares in self.shares.items()}


def loads_of(terms: Terms, motion: Sequence[float]) -> Array:
    """X Y Z K M N of the terms at u v w p q r, frame and units of this program.

    Examples
    --------
    >>> terms = Terms()
    >>> terms.add("Y", ("v", "|v|"), -2.0, "Y_v|v|")
    >>> loads_of(terms, [1.0, -3.0, 0.0, 0.0, 0.0, 0.0])[1]
    np.float64(18.0)
    """
    at = dict(zip(MOTIONS, motion, strict=True))
    at |= {f"|{k}|": abs(x) for k, x in at.items()} | {"": 1.0}
    total = np.zeros(6)
    for (output, a, b), value in terms.values().items():
        total[OUTPUTS.index(output)] += value * at[a] * at[b]
    return total


def terms_of(coefficients: Coefficients, environment: Environment, speed: float, depth: float) -> Terms:
    """The terms nearest to a boat's coefficients, planes amidships.

    Parameters
    ----------
    coefficients : Of the boat.
    environment : Water density.
    speed, depth : U [m/s] and D0 [m] at which tables over them are read.

    Returns
    -------
    Terms in the frame of this program: x forward, y to starboard, z down.
    """
    vehicle, terms = coefficients.vehicle, Terms()
    scales = (environment.density, vehicle.particulars.length.value, vehicle.diameter)
    planes = {p.name: p for p in vehicle.planes}
    turn = steps(vehicle)[0]
    for c in coefficients:
        if c.term.is_acceleration:
            continue
        scale = c.term.sign * c.term.scale(*scales)
        said = f"{c.term.name} of {c.part}"
        if c.term.factors == ("U", "U") and "beta" in c.term.axes:
            _drift(terms, c, scale, speed, depth)
        elif c.term.factors == ("V", "V"):
            _plane(terms, c, planes[c.part], scale, (speed, depth, turn))
        elif (pair := _pair(c.term.factors)) and c.term.output and not {"v/r", "w/q"} & set(c.term.axes):
            value, misfit = _constant(c, speed, depth)
            terms.largest_misfit = max(terms.largest_misfit, misfit)
            made = f", fitted over {', '.join(_own_axes(c))}, off by {misfit:.0%} at most" if _own_axes(c) else ""
            read = ", sqrt(v^2 + w^2) read as the size of one of them" if "S" in c.term.factors else ""
            terms.add(c.term.output, pair, scale * value, f"{said}{made}{read}")
        else:
            terms.lost.append(f"{said}: {c.term.multiplier or 'no load of its own'}")
    return terms


def _pair(factors: Sequence[str]) -> tuple[str, str] | None:
    """The motion that a monomial is, with another, a size in bars or nothing; None where it is no such."""
    sides = {"v": ("v", "r"), "w": ("w", "q")}
    cross = next((k for k, near in sides.items() if any(f.strip("|") in near or f == f"sgn({k})" for f in factors)), "")
    if "S" in factors and not cross:
        return None
    signed = {f"sgn({k})" for k in sides} & set(factors)
    plain = []
    for f in factors:
        if f == "S":
            # With its sign it is the velocity itself.
            plain.append(cross if signed else f"|{cross}|")
        elif f not in signed:
            plain.append(f)
    if len(plain) == 1 and plain[0] in MOTIONS:
        return plain[0], ""
    if len(plain) != 2 or any(f.strip("|") not in MOTIONS for f in plain):
        return None
    plain.sort(key=lambda f: f.startswith("|"))
    if plain[0].startswith("|"):
        # |w| |w| is w w; other products of two sizes have no term.
        return (plain[0].strip("|"),) * 2 if plain[0] == plain[1] else None
    return plain[0], plain[1]


def _own_axes(c: Coefficient) -> list[str]:
    """Axes over which a constant is fitted: those of more than one point that are no state of the whole flight."""
    return [a for a, n in zip(c.term.axes, c.table.nodes, strict=True) if a not in _STATES and n.size > 1]


def _points(c: Coefficient, speed: float, depth: float) -> Iterator[tuple[list[float], float]]:
    """Nodes of a table at a speed and depth, with the size of the motion there."""
    given = {"U": speed, "D0": depth}
    axes = [np.array([given[a]]) if a in given else n for a, n in zip(c.term.axes, c.table.nodes, strict=True)]
    for point in np.array(np.meshgrid(*axes, indexing="ij")).reshape(len(axes), -1).T:
        size = 1.0
        for axis, x in zip(c.term.axes, point, strict=True):
            if axis not in _STATES and not axis.startswith("sgn"):
                # An axis of one rate is met squared: the load goes with r |r|.
                size *= abs(x) if len(axis) > 1 else x * x
        yield [float(x) for x in point], size


def _constant(c: Coefficient, speed: float, depth: float) -> tuple[float, float]:
    """The constant whose loads are nearest to a table's at its nodes, and how far off they are at most."""
    if not c.term.axes:
        return float(c.values[0]), 0.0
    points = list(_points(c, speed, depth))
    values, sizes = np.array([c.at(p) for p, _ in points]), np.array([s for _, s in points])
    if not sizes.any():
        sizes = np.ones_like(sizes)
    value = float(values @ sizes**2 / (sizes @ sizes))
    return value, _misfit(values * sizes, value * sizes)


def _misfit(wanted: Array, fitted: Array) -> float:
    largest = float(np.abs(wanted).max())
    return float(np.abs(fitted - wanted).max()) / largest if largest else 0.0


def _drift(terms: Terms, c: Coefficient, scale: float, speed: float, depth: float) -> None:
    """Hull drift loads: ahead, over drift and over incidence, each by the forms of Eq. (25)."""
    place = {a: k for k, a in enumerate(c.term.axes)}
    at = [0.0] * len(place)
    at[place["U"]], at[place["D0"]] = speed, depth
    said, output = f"{c.term.name} of {c.part}", c.term.output
    straight = scale * c.at(at)
    terms.add(output, _AHEAD, straight, f"{said}, ahead")
    odd = c.term.parity.get("beta") == -1
    for axis, across, basis in (("beta", "v", _ODD if odd else _EVEN), ("alpha", "w", () if odd else _VERTICAL)):
        nodes = c.table.nodes[place[axis]]
        nodes = nodes[nodes != 0.0]
        if not basis or not nodes.size:
            continue
        motion = {"u": speed * np.cos(nodes), across: speed * np.sin(nodes)}
        motion |= {f"|{k}|": np.abs(x) for k, x in motion.items()}
        whole = np.array([scale * speed**2 * c.at([*at[: place[axis]], x, *at[place[axis] + 1 :]]) for x in nodes])
        wanted = whole - straight * motion["u"] * motion["|u|"]
        used = basis[: nodes.size]
        form = np.column_stack([motion[a] * motion[b] for a, b in used])
        fitted = np.linalg.lstsq(form, wanted, rcond=None)[0]
        misfit = _misfit(wanted, form @ fitted)
        terms.largest_misfit = max(terms.largest_misfit, misfit)
        reach = f"{axis} {math.degrees(nodes.min()):g} to {math.degrees(nodes.max()):g} deg"
        for pair, value in zip(used, fitted, strict=True):
            terms.add(output, pair, float(value), f"{said}, fitted over {reach}, off by {misfit:.0%} at most")


def _plane(terms: Terms, c: Coefficient, plane: Plane, scale: float, at: tuple[float, float, float]) -> None:
    """A plane amidships: its load ahead, and what the motions add through its incidence, by the slope about zero."""
    speed, depth, turn = at
    where = {"U": speed, "D0": depth}
    low, middle, high = (c.at([where.get(a, x) for a in c.term.axes]) for x in (-turn, 0.0, turn))
    said = f"{c.term.name} of {c.part}, amidships"
    terms.add(c.term.output, _AHEAD, scale * middle, f"{said}, ahead")
    slope = scale * (high - low) / (2.0 * turn)
    lift = np.array(plane.lift_axis)
    # Along the lift axis the plane moves with l . (v + omega x r) = l . v + omega . (r x l).
    by_motion = np.concatenate([lift, np.cross(plane.position, lift)])
    for k, share in zip(MOTIONS, by_motion, strict=True):
        if k != "u":
            terms.add(c.term.output, ("u", k), float(-slope * share), f"{said}, by its incidence")


def add_rotation_of_water(terms: Terms, added: Array) -> None:
    """Take back what a physics engine adds when the velocity turns in a body with added mass.

    The coefficients hold it: they were measured on a body in steady motion. An engine that knows the added mass adds
    minus omega x P to the forces and minus omega x H - v x P to the moments, with P and H the momentum of the water
    (Kirchhoff; Fossen 2011, Eq. 6.43), so that it would be there twice.

    Parameters
    ----------
    terms : To be added to.
    added : (6, 6) added mass about the origin, frame of this program.
    """
    turns = ((1, 2), (2, 0), (0, 1))
    source = "the turning of the added mass, which the engine adds and the coefficients hold"
    for k, (i, j) in enumerate(turns):
        for n, motion in enumerate(MOTIONS):
            for axis, about, sign in ((i, j, 1.0), (j, i, -1.0)):
                linear, angular = MOTIONS[axis], MOTIONS[3 + axis]
                terms.add(OUTPUTS[k], (angular, motion), sign * float(added[about, n]), source)
                terms.add(OUTPUTS[3 + k], (angular, motion), sign * float(added[3 + about, n]), source)
                terms.add(OUTPUTS[3 + k], (linear, motion), sign * float(added[about, n]), source)
