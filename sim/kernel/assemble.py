"""Assemble a vehicle and its coefficients into the flat arrays of the compiled kernel."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import BOAT_FEATURES, OUTPUTS, PLANE_FEATURES, feature_index, held, terms
from sim.boat.coefficients import Coefficient, Coefficients
from sim.boat.mass import (
    Environment,
    added_mass_matrix,
    cross_matrix,
    rigid_body_matrix,
    unit_added_masses,
)
from sim.boat.plausible import check_mass, check_shares
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.kernel import layout
from sim.kernel.layout import Group, Model

Array = NDArray[np.float64]
_RULES = {"hold": layout.HOLD, "linear": layout.LINEAR, "linear_load": layout.LINEAR_LOAD}
# Order of the kernel's inertia: Ixx Iyy Izz Ixy Ixz Iyz.
_INERTIA = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _refine(grid: Array, axis: int, old: Array, new: Array) -> Array:
    """Values on a finer axis; exact for multilinear tables that hold beyond their ends."""
    if old.size == new.size:
        return grid
    matrix = np.stack([np.interp(new, old, unit) for unit in np.eye(old.size)], axis=1)
    return np.moveaxis(np.tensordot(matrix, grid, axes=(1, axis)), 0, axis)


def _union(members: list[Coefficient]) -> list[Array]:
    """Axis values of a group: all of its members'."""
    axes = range(len(members[0].term.axes))
    return [np.unique(np.concatenate([m.table.extension[k][0] for m in members])) for k in axes]


def _on(union: list[Array], member: Coefficient, values: Array) -> Array:
    """A member's grid on the axes of its group, from (n,) values or (n, k) sets of them."""
    grid = member.table.grid(values)
    for k, nodes in enumerate(union):
        grid = _refine(grid, k, member.table.extension[k][0], nodes)
    return grid


def _group_key(coefficient: Coefficient) -> tuple[object, ...]:
    # Continuation nodes stand in the grid already, so the kernel holds beyond them.
    rules = tuple(r if r in _RULES else "hold" for r in coefficient.table.rules)
    plane = coefficient.part if "delta" in coefficient.term.axes else ""
    # A rule other than hold may not be refined, so its nodes must agree.
    exact = tuple(n.tobytes() for n, r in zip(coefficient.table.nodes, rules, strict=True) if r != "hold")
    return coefficient.term.axes, rules, plane, exact


def _slot(coefficient: Coefficient) -> int:
    """Where a coefficient stands in its group: its load, thrust or thrust deduction."""
    if coefficient.term.name == "t":
        return layout.OUT_DEDUCTION
    return layout.OUT_THRUST if coefficient.term.name == "KT" else OUTPUTS.index(coefficient.term.output)


def _sail_top(coefficients: Coefficients) -> float:
    """z of the sail top [m]; asked for where a coefficient has an axis of depth."""
    vehicle = coefficients.vehicle
    if vehicle.particulars.sail_top is None and not any("D0" in c.term.axes for c in coefficients):
        return 0.0
    return vehicle.needed_sail_top("a coefficient over depth")[2]


class _Flat:
    """Lists that become the kernel's arrays."""

    def __init__(self, coefficients: Coefficients, environment: Environment) -> None:
        vehicle = coefficients.vehicle
        self.planes = [p.name for p in vehicle.planes]
        self.one = len(BOAT_FEATURES) + len(PLANE_FEATURES) * len(self.planes)
        self.scale = (environment.density, vehicle.particulars.length.value, vehicle.diameter)
        self.groups: list[Group] = []
        self.axis: dict[tuple[int, int, bytes], list[int]] = {}
        self.order: dict[tuple[int, int, bytes], int] = {}
        self.nodes: list[float] = []
        self.data: list[Array] = [np.zeros((0, layout.WIDTH))]
        self.size = 0
        # An empty slot is multiplied by one; its coefficients are zero.
        self.multipliers: dict[tuple[int, ...], int] = {(self.one,) * layout.MAX_FACTORS: 0}

    def feature(self, factor: str, part: str) -> int:
        return feature_index(factor, self.planes.index(part) if part in self.planes else -1)

    def axis_index(self, feature: int, rule: int, nodes: Array) -> int:
        """Axes with the same feature, rule and nodes are located once per evaluation."""
        key = (feature, rule, nodes.tobytes())
        if key not in self.order:
            self.order[key] = len(self.order)
            self.axis[key] = [feature, rule, len(self.nodes), nodes.size]
            self.nodes += list(nodes)
        return self.order[key]

    def scale_of(self, member: Coefficient) -> float:
        return member.term.sign * member.term.scale(*self.scale)

    def add_group(self, members: list[Coefficient]) -> None:
        first = members[0]
        rules = _group_key(first)[1]
        union = _union(members)
        block = np.zeros((*(nodes.size for nodes in union), layout.WIDTH))
        multipliers = [0] * layout.WIDTH
        for member in members:
            slot = _slot(member)
            block[..., slot] = self.scale_of(member) * _on(union, member, member.values)
            factors = [self.feature(f, member.part) for f in member.term.factors]
            factors += [self.one] * (layout.MAX_FACTORS - len(factors))
            multipliers[slot] = self.multipliers.setdefault(tuple(factors), len(self.multipliers))
        axes, strides = [], []
        for k, (name, nodes) in enumerate(zip(first.term.axes, union, strict=True)):
            if nodes.size > 1:
                feature, rule = self.feature(name, first.part), _RULES[rules[k]]  # type: ignore[index]
                axes.append(self.axis_index(feature, rule, nodes))
                strides.append(int(np.prod(block.shape[k + 1 : -1])))
        self.groups.append(Group(tuple(axes), tuple(strides), self.size, tuple(multipliers)))
        self.data.append(block.reshape(-1, layout.WIDTH))
        self.size += len(self.data[-1])


def with_tanks(model: Model, vehicle: Vehicle) -> Model:
    """The model with ballast and trim tank in use; its controls have two more entries."""
    assert vehicle.tanks is not None
    return model.replaced(tanks=True, tank=vehicle.tanks.ballast.position.value)


def weight_across(model: Model, lateral: float) -> Model:
    """The model with its whole weight shifted to starboard, in the loads and in the mass matrix.

    Parameters
    ----------
    lateral : Shift of the centre of gravity [m].
    """
    x, y, z = model.r_g
    old, new = cross_matrix(model.r_g), cross_matrix((x, y + lateral, z))
    first, second = model.mass * (new - old), -model.mass * (new @ new - old @ old)
    mass = model.mass_matrix + np.block([[np.zeros((3, 3)), -first], [first, second]])
    ixx, iyy, izz, ixy, ixz, iyz = model.inertia
    moved = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]) + second
    return model.replaced(
        mass_matrix=mass,
        inverse_mass=_inverse(mass, model.held),
        r_g=(x, y + lateral, z),
        inertia=[moved[i, j] for i, j in _INERTIA],
    )


def without_thrust(model: Model, share: float) -> Model:
    """The model with a share of the propeller's thrust and torque lost: of KT and KQ, or of a ship's k_0 to k_2."""
    other = model.replaced()
    kept, data = 1.0 - share, other.data
    data[:, layout.OUT_THRUST] *= kept
    turning = {BOAT_FEATURES.index("n"), BOAT_FEATURES.index("|n|")}
    ends = [*(g.first for g in model.groups[1:]), model.rows]
    slot = OUTPUTS.index("K")
    for group, end in zip(model.groups, ends, strict=True):
        if turning <= set(model.multipliers[group.multipliers[slot]].tolist()):
            data[group.first : end, slot] *= kept
    for name in ("k_0", "k_1", "k_2"):
        other.ship[layout.SHIP_PLACES.index(name)] *= kept
    return other


def _batches(coefficients: Coefficients) -> Iterable[list[Coefficient]]:
    """Coefficients that share their axes, one a slot, in the order of the kernel."""
    groups: dict[tuple[object, ...], list[list[Coefficient]]] = {}
    for coefficient in coefficients:
        if coefficient.term.is_acceleration or not (coefficient.term.output or coefficient.term.name == "t"):
            continue
        batches = groups.setdefault(_group_key(coefficient), [])
        slot = _slot(coefficient)
        free = next((b for b in batches if all(_slot(member) != slot for member in b)), None)
        if free is None:
            batches.append([coefficient])
        else:
            free.append(coefficient)
    for batches in groups.values():
        yield from batches


def _inverse(mass: Array, held: Sequence[int]) -> Array:
    """Accelerations of a unit load, none where a motion is held."""
    free = [i for i in range(6) if i not in held]
    inverse = np.zeros((6, 6))
    inverse[np.ix_(free, free)] = np.linalg.inv(mass[np.ix_(free, free)])
    return inverse


def _ship_kinds(coefficients: Coefficients) -> tuple[bool, int]:
    """Whether a ship's propeller is given, and the place of its rudder among the planes, -1 without.

    Raises
    ------
    InputError
        For one of them that is given in part.
    """
    vehicle, there = coefficients.vehicle, {c.term.name for c in coefficients}
    names = [p.name for p in vehicle.planes]
    kinds = {}
    for group in ("ship propeller", "ship rudder", "propeller interaction"):
        wanted = [t.name for t in terms(vehicle.term_set) if t.group == group and not t.output]
        missing = [n for n in wanted if n not in there]
        kinds[group] = bool(wanted) and not missing
        if missing and len(missing) < len(wanted):
            text = f"all of the group {group}: without {', '.join(missing)} its loads are not known"
            raise InputError(f"vehicle {vehicle.name}", ", ".join(n for n in wanted if n in there), text)
    if not kinds["ship rudder"]:
        return kinds["ship propeller"], -1
    if not kinds["ship propeller"] or vehicle.rudder is None or "rudder" not in names:
        text = "a propeller, the table [rudder] and a plane of that name: its flow depends on them"
        raise InputError(f"vehicle {vehicle.name}", "coefficients of a rudder alone", text)
    return True, names.index("rudder")


def _ship_numbers(coefficients: Coefficients, environment: Environment) -> Array:
    """Values of ``layout.SHIP_PLACES``."""
    vehicle = coefficients.vehicle
    values = {c.term.name: float(c.values[0]) for c in coefficients if not c.term.output and not c.term.axes}
    values["J_0 D"] = values.get("J_0", 0.0) * vehicle.diameter
    values |= {"density": environment.density, "length": vehicle.particulars.length.value}
    if vehicle.rudder is not None:
        values |= {"A_R": vehicle.rudder.area.value, "H_R": vehicle.rudder.height.value}
        values["x_R"] = next(p.position[0] for p in vehicle.planes if p.name == "rudder")
    return np.array([values.get(name, 0.0) for name in layout.SHIP_PLACES])


def assemble(coefficients: Coefficients, environment: Environment) -> Model:
    """The compiled kernel's model of a vehicle.

    Parameters
    ----------
    coefficients : From the database, with their vehicle.
    environment : Water density and gravity.

    Returns
    -------
    Model of flat arrays, program frame, SI and radians.

    Raises
    ------
    InputError
        As ``sim.boat.plausible.check_mass`` and ``check_shares``.
    """
    vehicle = coefficients.vehicle
    flat = _Flat(coefficients, environment)
    for batch in _batches(coefficients):
        flat.add_group(batch)
    mass, inertia = rigid_body_matrix(vehicle)
    wake = coefficients.get("w_T")
    particulars = vehicle.particulars
    added = added_mass_matrix(coefficients, environment)
    total = mass + added
    check_mass(total, added, vehicle)
    check_shares(((c.term, c.values) for c in coefficients), vehicle)
    still = [OUTPUTS.index(o) for o in held(vehicle.term_set)]
    numbers: layout.Numbers = {
        "mass": particulars.mass.value,
        "weight": particulars.mass.value * environment.gravity,
        "buoyancy": particulars.displaced_mass.value * environment.gravity,
        "r_g": particulars.centre_of_gravity.value,
        "r_b": particulars.centre_of_buoyancy.value,
        "inertia": [inertia[i, j] for i, j in _INERTIA],
        "sail_top": _sail_top(coefficients),
        "diameter": vehicle.diameter,
        "wake": float(wake.values[0]) if wake else 0.0,
        "mass_matrix": total,
        "added_mass": added,
        "inverse_mass": _inverse(total, still),
        "ship": _ship_numbers(coefficients, environment),
    }
    planes = [[*p.position, *p.lift_axis] for p in vehicle.planes]
    tables = layout.Tables(
        axes=np.array(list(flat.axis.values()), dtype=np.int64).reshape(-1, 4),
        nodes=np.array(flat.nodes, dtype=float),
        groups=tuple(flat.groups),
        multipliers=np.array(list(flat.multipliers), dtype=np.int64).reshape(-1, layout.MAX_FACTORS),
        data=np.concatenate(flat.data),
    )
    return layout.pack(
        numbers,
        planes=np.array(planes, dtype=float).reshape(-1, layout.PLANE_WIDTH),
        tables=tables,
        ship=_ship_kinds(coefficients),
        held=still,
    )


class Assembly:
    """A vehicle's tables as one linear map from row values to the kernel's data.

    Tables are completed, extended and refined once; each further set of values costs one
    sparse product, and gives what ``assemble`` gives to round-off.

    Parameters
    ----------
    coefficients, environment : As for ``assemble``.
    """

    def __init__(self, coefficients: Coefficients, environment: Environment) -> None:
        # A single flight needs no sparse products, and their import takes longer than the flight.
        from scipy.sparse import csr_array

        self._base = assemble(coefficients, environment)
        places = coefficients.places
        flat = _Flat(coefficients, environment)
        weight, node, row, first = [np.zeros(0)], [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)], 0
        for members in _batches(coefficients):
            union = _union(members)
            for member in members:
                grid = _on(union, member, np.eye(member.values.size)).reshape(-1, member.values.size)
                i, j = np.nonzero(grid)
                weight.append(flat.scale_of(member) * grid[i, j])
                node.append((first + i) * layout.WIDTH + _slot(member))
                row.append(places[member.term.name, member.part][j])
            first += int(np.prod([nodes.size for nodes in union]))
        shape = (self._base.data.size, sum(p.size for p in places.values()))
        entries = (np.concatenate(weight), (np.concatenate(node), np.concatenate(row)))
        self._data = csr_array(entries, shape=shape)
        parts = unit_added_masses(coefficients, environment)
        self._added = np.array([places[c.term.name, c.part][0] for c, _ in parts], dtype=int)
        self._units = np.array([unit for _, unit in parts]).reshape(-1, 6, 6)
        self._rigid = rigid_body_matrix(coefficients.vehicle)[0]
        wake = coefficients.get("w_T")
        self._wake = int(places[wake.term.name, wake.part][0]) if wake else None
        self._ship = {c.term.name: int(places[c.term.name, c.part][0]) for c in coefficients if not c.term.output}
        self._diameter = coefficients.vehicle.diameter

    def model(self, values: Array) -> Model:
        """The kernel's model at (rows,) values, in the order of the rows of the coefficients."""
        # einsum and not BLAS: the sum does not depend on how many threads BLAS may use.
        added = np.einsum("k,kij->ij", values[self._added], self._units)
        total = self._rigid + added
        return self._base.replaced(
            data=(self._data @ values).reshape(-1, layout.WIDTH),
            mass_matrix=total,
            added_mass=added,
            inverse_mass=_inverse(total, self._base.held),
            ship=self._ship_at(values),
            wake=0.0 if self._wake is None else float(values[self._wake]),
        )

    def _ship_at(self, values: Array) -> Array:
        ship = self._base.ship.copy()
        for k, name in enumerate(layout.SHIP_TERMS):
            if name in self._ship:
                ship[k] = values[self._ship[name]]
        if "J_0" in self._ship:
            ship[layout.SHIP_PLACES.index("J_0 D")] = values[self._ship["J_0"]] * self._diameter
        return ship
