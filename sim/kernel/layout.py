"""Where everything stands in the flat arrays that the compiled functions take.

A model is one array of floats and one of whole numbers, the scratch of a flight likewise:
passing them costs a pointer each, however much they hold. A tuple of thirty arrays costs its
length, and counts references, at every call; that alone made the right-hand side three times
slower. Angles are radians, the rest SI, frame SNAME.

State ``y`` (12,): u v w p q r [m/s, rad/s], x y z [m, earth, z down], phi theta psi [rad].
Controls ``c``: one deflection a plane [rad], then n [1/s]; a boat that uses its tanks has two
more, ballast [kg] and the shift of the centre of gravity by the trim tank [m, forward].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import BOAT_FEATURES, PLANE_FEATURES
from sim.boat.state import N_STATES

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

# Surroundings of ``sim.waves.surroundings``, or an empty tuple in deep, calm water.
Around: TypeAlias = Any

# Rules beyond the nodes of an axis.
HOLD, LINEAR, LINEAR_LOAD = 0, 1, 2

# A group of tables has one coefficient a slot: the six loads, thrust deduction and thrust.
OUT_DEDUCTION, OUT_THRUST, N_OUT = 6, 7, 8
WIDTH = N_OUT

# Model, floats.
MASS, WEIGHT, BUOYANCY, SAIL_TOP, DIAMETER, WAKE = range(6)
R_G, R_B, INERTIA, TANK = 6, 9, 12, 18
INVERSE_MASS, MASS_MATRIX, ADDED_MASS, SHIP = 24, 60, 96, 132
# What ``sim.kernel.ship`` reads: rows of the term table without a load, then numbers of the vehicle and the water.
SHIP_TERMS = (
    *("t_P", "w_P0", "C_1", "C_2+", "C_2-", "x_P", "k_0", "k_1", "k_2"),
    *("t_R", "a_H", "x_H", "gamma_R+", "gamma_R-", "l_R", "kappa", "epsilon", "f_alpha", "C_T1"),
)
SHIP_PLACES = (*SHIP_TERMS, "J_0 D", "density", "length", "A_R", "H_R", "x_R")
# Velocity of the water over ground, north and east [m/s]; share of its volume that the hull loses a metre
# of depth; depths of density [m] with its ratio to the case's.
CURRENT = SHIP + len(SHIP_PLACES)
COMPRESSIBILITY, LAYERS, MOST_LAYERS = CURRENT + 2, CURRENT + 3, 8
PLANES = LAYERS + 2 * MOST_LAYERS
PLANE_WIDTH = 6

# Model, whole numbers: how many there are, then where they start, in floats or in whole numbers.
N_PLANES, HAS_TANKS, N_AXES, N_MULTIPLIERS, N_PAIRS = range(5)
# Groups by their axes: none, one, two, three, more.
N_GROUPS = 5
KINDS = 5
AT_AXES, AT_MULTIPLIERS, AT_GROUPS, AT_DATA = 10, 11, 12, 13
# Where fractions and multipliers stand in the scratch.
AT_FRACTIONS, AT_PRODUCTS, SCRATCH = 14, 15, 16
# A ship's propeller and rudder, and the rudder's place among the planes; heave, roll and pitch that are held.
HAS_PROPELLER, HAS_RUDDER, RUDDER, HELD = 17, 18, 19, 20
# Depths at which the density is given; with none of them water and hull are the same everywhere.
N_LAYERS = 21
HEADER = 22
# An axis: feature, rule, first node, nodes, first cell. A cell: range, origin, slope and base.
AXIS, CELL = 5, 5
# Factors of a multiplier.
MAX_FACTORS = 4

# Scratch, floats: eight outputs, a linear system, the shift of the weight to starboard [m], loads from
# outside [N, N m], then the features.
LOADS, SYSTEM, SHIFT, OUTSIDE, FEATURES = 0, 8, 50, 51, 64
N_BOAT, N_PLANE = len(BOAT_FEATURES), len(PLANE_FEATURES)
FIRST_PLANE = FEATURES + N_BOAT


class Stage(NamedTuple):
    """Scratch of a Runge-Kutta step.

    start : (12,) rate of the state at the start of the step, where it is known already.
    state, rate, total : (12,) within the step; controls : (planes + 3,) within it.
    """

    start: Array
    state: Array
    rate: Array
    total: Array
    controls: Array


class _Scalar:
    """A number of a model."""

    def __init__(self, at: int) -> None:
        self.at = at

    def __get__(self, model: Model, owner: type) -> float:
        return float(model.real[self.at])


class _Block:
    """A vector or matrix of a model, as a view."""

    def __init__(self, at: int, *shape: int) -> None:
        self.at, self.shape, self.size = at, shape, int(np.prod(shape))

    def __get__(self, model: Model, owner: type) -> Array:
        return model.real[self.at : self.at + self.size].reshape(self.shape)


class Group(NamedTuple):
    """Tables that share their axes.

    axes, strides : Place of each axis among the model's, and rows between its nodes.
    first : First row in ``data``. multipliers : (8,) place of each slot's multiplier.
    """

    axes: tuple[int, ...]
    strides: tuple[int, ...]
    first: int
    multipliers: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Model:
    """A vehicle with its coefficients.

    Attributes
    ----------
    real, whole : What the compiled functions take.
    axes : (a, 4) feature, rule, first node and number of nodes of each axis. nodes : Of all axes.
    groups : Tables that share their axes. multipliers : (k, 4) features of each product.
    rows : Of ``data``.
    mass, weight, buoyancy : [kg, N, N]. r_g, r_b : (3,) [m].
    inertia : (6,) Ixx Iyy Izz Ixy Ixz Iyz [kg m^2]. diameter : [m]. wake : w_T.
    sail_top : D0 = z + sail_top [m]. tank : (3,) where ballast is taken [m].
    mass_matrix : (6, 6) rigid-body plus added mass; added_mass : of it; inverse_mass, with zeros
        where a motion is held. ship : of ``SHIP_PLACES``; zero for what a vehicle does not have.
    planes : (planes, 6) position [m] and lift axis. has_tanks : Whether they are in use.
    data : (rows, 8) dimensional coefficients at the nodes.
    current : (2,) north and east [m/s]. compressibility : Of the hull's volume [1/m].
    """

    real: Array
    whole: Whole
    axes: Whole
    nodes: Array
    groups: tuple[Group, ...]
    multipliers: Whole
    rows: int

    mass, weight, buoyancy = _Scalar(MASS), _Scalar(WEIGHT), _Scalar(BUOYANCY)
    sail_top, diameter, wake = _Scalar(SAIL_TOP), _Scalar(DIAMETER), _Scalar(WAKE)
    r_g, r_b, inertia, tank = _Block(R_G, 3), _Block(R_B, 3), _Block(INERTIA, 6), _Block(TANK, 3)
    inverse_mass, mass_matrix = _Block(INVERSE_MASS, 6, 6), _Block(MASS_MATRIX, 6, 6)
    added_mass, ship = _Block(ADDED_MASS, 6, 6), _Block(SHIP, len(SHIP_PLACES))
    current, compressibility = _Block(CURRENT, 2), _Scalar(COMPRESSIBILITY)

    @property
    def planes(self) -> Array:
        """Position and lift axis of each plane, (planes, 6)."""
        count = int(self.whole[N_PLANES])
        return self.real[PLANES : PLANES + PLANE_WIDTH * count].reshape(count, PLANE_WIDTH)

    @property
    def data(self) -> Array:
        """Coefficients at the nodes, (rows, 8)."""
        at = int(self.whole[AT_DATA])
        return self.real[at : at + WIDTH * self.rows].reshape(self.rows, WIDTH)

    @property
    def has_tanks(self) -> bool:
        """Whether ballast and trim tank are in use."""
        return bool(self.whole[HAS_TANKS])

    @property
    def held(self) -> list[int]:
        """Heave, roll and pitch that are held, as places of u v w p q r."""
        return [i for i in range(6) if int(self.whole[HELD]) & (1 << i)]

    def layered(self, depths: Array, ratios: Array) -> Model:
        """A copy in water whose density is given over depth.

        Parameters
        ----------
        depths : (n,) of the body origin, ascending, ``MOST_LAYERS`` at most [m].
        ratios : (n,) of the density there to that of the model.
        """
        other = self.replaced()
        other.whole[N_LAYERS] = len(depths)
        other.real[LAYERS : LAYERS + 2 * len(depths)] = np.column_stack([depths, ratios]).ravel()
        return other

    def replaced(self, tanks: bool | None = None, **values: Any) -> Model:
        """A copy with some of its numbers changed, by name."""
        other = Model(aligned(self.real), self.whole.copy(), *(getattr(self, k) for k in _KEPT))
        if tanks is not None:
            other.whole[HAS_TANKS] = tanks
        for name, value in values.items():
            field = type(self).__dict__[name]
            if isinstance(field, _Scalar):
                other.real[field.at] = value
            else:
                getattr(other, name)[:] = value
        return other


_KEPT = ("axes", "nodes", "groups", "multipliers", "rows")


def aligned(values: Array) -> Array:
    """A copy that starts with a cache line, so that each row of the tables is in one."""
    room = np.empty(values.size + WIDTH)
    start = (-room.ctypes.data // room.itemsize) % WIDTH
    copy = room[start : start + values.size]
    copy[:] = values
    return copy


@dataclass(frozen=True, eq=False)
class Work:
    """Scratch of one flight; for models of one layout.

    Attributes
    ----------
    real, whole : What the compiled functions take; ``whole`` holds the cell and the row where
        each axis was met last, for a quick search.
    stage : Within a Runge-Kutta step.
    around : Surroundings, empty in deep, calm water.
    features : View; of the state met last, the constant 1 last.
    """

    real: Array
    whole: Whole
    stage: Stage
    around: Around
    features: Array

    @property
    def loads(self) -> Array:
        """View of X Y Z K M N, thrust deduction and thrust met last."""
        return self.real[LOADS : LOADS + N_OUT]


def workspace(model: Model, around: Around = ()) -> Work:
    """Scratch for a model, and what surrounds it."""
    w = model.whole
    real = aligned(np.zeros(int(w[SCRATCH])))
    features = real[FEATURES : FEATURES + N_BOAT + N_PLANE * int(w[N_PLANES]) + 1]
    features[-1] = 1.0
    count, at = int(w[N_AXES]), int(w[AT_AXES])
    cells = np.zeros(2 * count, dtype=np.int64)
    cells[::2] = w[at : at + AXIS * count].reshape(count, AXIS)[:, 4]
    start, state, rate, total = np.zeros((4, N_STATES))
    stage = Stage(start, state, rate, total, np.zeros(int(w[N_PLANES]) + 3))
    return Work(real, cells, stage, around, features)


def _cells(nodes: Array, rule: int) -> Array:
    """(nodes + 1, 5) range, origin, slope and base of the fraction before, between and after nodes.

    Beyond the ends the fraction is held, or goes on straight. One that goes on as a load has an
    empty range, so that ``sim.kernel.tables`` works it out each time.
    """
    slope = 1.0 / np.diff(nodes)
    low, high = np.concatenate([[-np.inf], nodes]), np.concatenate([nodes, [np.inf]])
    table = np.zeros((nodes.size + 1, CELL))
    table[:, 0], table[:, 1] = low, high
    table[1:-1, 2], table[1:-1, 3] = nodes[:-1], slope
    table[0, 2:], table[-1, 2:] = (nodes[0], 0.0, 0.0), (nodes[-1], 0.0, 1.0)
    if rule == LINEAR:
        table[0, 2:], table[-1, 2:] = (nodes[0], slope[0], 0.0), (nodes[-2], slope[-1], 0.0)
    if rule == LINEAR_LOAD:
        for end, outward in ((0, nodes[1] < 0.0), (-1, nodes[-2] > 0.0)):
            if outward:
                table[end, :2] = np.inf, -np.inf
    return table


class Numbers(TypedDict):
    """What ``pack`` enters into a model beside its tables; each as the attribute of ``Model`` of that name."""

    mass: float
    weight: float
    buoyancy: float
    r_g: Sequence[float] | Array
    r_b: Sequence[float] | Array
    inertia: Sequence[float] | Array
    sail_top: float
    diameter: float
    wake: float
    mass_matrix: Array
    added_mass: Array
    inverse_mass: Array
    ship: Array


@dataclass(frozen=True, eq=False)
class Tables:
    """The coefficients of a model over their axes; as the attributes of ``Model``."""

    axes: Whole
    nodes: Array
    groups: tuple[Group, ...]
    multipliers: Whole
    data: Array


def pack(
    numbers: Numbers, planes: Array, tables: Tables, ship: tuple[bool, int] = (False, -1), held: Sequence[int] = ()
) -> Model:
    """A model from its parts.

    Parameters
    ----------
    numbers : Mass, buoyancy and the rest.
    planes : (planes, 6) position [m] and lift axis.
    tables : Of coefficients.
    ship : Whether there is a propeller of ``SHIP_TERMS``, and which plane is the rudder of them (-1: none).
    held : Motions that are held, as places of u v w p q r.
    """
    axes, nodes, groups, multipliers, data = tables.axes, tables.nodes, tables.groups, tables.multipliers, tables.data
    one = FEATURES + N_BOAT + N_PLANE * len(planes)
    cells = [_cells(nodes[first : first + n], rule) for _, rule, first, n in axes]
    floats = [np.zeros(PLANES), planes.ravel(), nodes, *(c.ravel() for c in cells)]
    size = sum(f.size for f in floats)
    at_nodes = PLANES + planes.size
    at_cells = at_nodes + nodes.size + np.cumsum([0, *(c.size for c in cells)])
    at_data = size + -size % WIDTH
    real = aligned(np.concatenate([*floats, np.zeros(at_data - size), data.ravel()]))

    # Products of two factors come first.
    pairs = (multipliers[:, 2:] == one - FEATURES).all(axis=1)
    order = np.argsort(~pairs, kind="stable")
    place = np.argsort(order)
    header = np.zeros(HEADER, dtype=np.int64)
    axis = [
        [f + FEATURES, rule, first + at_nodes, n, c] for (f, rule, first, n), c in zip(axes, at_cells, strict=False)
    ]
    whole = [header, np.array(axis, dtype=np.int64).ravel(), (multipliers[order] + FEATURES).ravel()]
    at = np.cumsum([w.size for w in whole])
    count = np.zeros(KINDS, dtype=np.int64)
    for kind in range(KINDS):
        for g in groups:
            if min(len(g.axes), KINDS - 1) == kind:
                count[kind] += 1
                links = np.array([g.axes, np.multiply(g.strides, WIDTH)]).T.ravel()
                much = [len(g.axes)] if kind == KINDS - 1 else []
                whole.append(
                    np.array([*much, at_data + g.first * WIDTH, *links, *place[list(g.multipliers)]], dtype=np.int64)
                )
    fractions = one + 1
    header[[N_PLANES, N_AXES, N_MULTIPLIERS, N_PAIRS]] = len(planes), len(axes), len(multipliers), pairs.sum()
    header[N_GROUPS : N_GROUPS + KINDS] = count
    header[[AT_AXES, AT_MULTIPLIERS, AT_GROUPS, AT_DATA]] = *at, at_data
    header[[AT_FRACTIONS, AT_PRODUCTS]] = fractions, fractions + len(axes)
    header[HAS_PROPELLER], header[HAS_RUDDER], header[RUDDER] = ship[0], ship[1] >= 0, max(ship[1], 0)
    header[HELD] = sum(1 << i for i in held)
    header[SCRATCH] = fractions + len(axes) + len(multipliers)
    model = Model(real, np.concatenate(whole), axes, nodes, groups, multipliers, len(data))
    return model.replaced(**numbers)
