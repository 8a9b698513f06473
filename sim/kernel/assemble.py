"""Assemble a vehicle and its coefficients into the flat arrays of the compiled kernel."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from sim.boat.catalogue import ACCELERATIONS, BOAT_FEATURES, OUTPUTS, PLANE_FEATURES, feature_index
from sim.boat.coefficients import Coefficient, Coefficients
from sim.boat.vehicle import Vehicle
from sim.kernel import rhs as kernel

Array = NDArray[np.float64]
_RULES = {"hold": kernel.HOLD, "linear": kernel.LINEAR, "linear_load": kernel.LINEAR_LOAD}
MAX_FACTORS = 4
# Order of the kernel's inertia: Ixx Iyy Izz Ixy Ixz Iyz.
_INERTIA = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True)
class Environment:
    """Water density [kg/m^3] and gravity [m/s^2]."""

    density: float
    gravity: float


def cross_matrix(r: Iterable[float]) -> Array:
    """The matrix [r]x with [r]x a = r x a."""
    x, y, z = r
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rigid_body_matrix(vehicle: Vehicle) -> tuple[Array, Array]:
    """Rigid-body mass matrix about the origin, Eq. (14) as corrected.

    Returns
    -------
    mass : (6, 6) [kg, kg m, kg m^2].
    inertia : (3, 3) inertia about the origin.
    """
    particulars = vehicle.particulars
    m = particulars.mass.value
    lever = cross_matrix(particulars.centre_of_gravity.value)
    inertia = m * (np.diag(np.square(particulars.radius_of_gyration.value)) - lever @ lever)
    return np.block([[m * np.eye(3), -m * lever], [m * lever, inertia]]), inertia


def _added_masses(coefficients: Coefficients, environment: Environment) -> list[tuple[Coefficient, Array]]:
    """Each acceleration coefficient in use, with the (6, 6) added mass of a value of one.

    From sections, Eqs. (36)-(41): A = sum J^T diag(c m) J with J = [1, -[r]x]; or from the
    whole-boat derivatives, as the vehicle declares.
    """
    vehicle = coefficients.vehicle
    length, diameter = vehicle.particulars.length.value, vehicle.propeller.diameter.value
    found = []
    centres = {s.name: s.position for s in vehicle.sections.centres} if vehicle.sections else {}
    for coefficient in coefficients:
        term = coefficient.term
        if not term.is_acceleration or (coefficient.part in centres) != (vehicle.added_mass == "sections"):
            continue
        unit, load = np.zeros((6, 6)), term.scale(environment.density, length, diameter)
        i, j = OUTPUTS.index(term.output), ACCELERATIONS.index(term.factors[0])
        if coefficient.part in centres:
            motion = np.hstack([np.eye(3), -cross_matrix(centres[coefficient.part])])
            unit = -load * np.outer(motion[i], motion[j])
        else:
            unit[i, j] = -load
        found.append((coefficient, unit))
    return found


def added_mass_matrix(coefficients: Coefficients, environment: Environment) -> Array:
    """Added mass about the origin, (6, 6) [kg, kg m, kg m^2]; zero when nothing was identified."""
    parts = _added_masses(coefficients, environment)
    return np.array(sum((float(c.values[0]) * unit for c, unit in parts), np.zeros((6, 6))))


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


def _triple(values: list[float]) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


class _Flat:
    """Lists that become the kernel's arrays."""

    def __init__(self, coefficients: Coefficients, environment: Environment) -> None:
        vehicle = coefficients.vehicle
        self.planes = [p.name for p in vehicle.planes]
        self.one = len(BOAT_FEATURES) + len(PLANE_FEATURES) * len(self.planes)
        self.scale = (environment.density, vehicle.particulars.length.value, vehicle.propeller.diameter.value)
        self.group: list[list[int]] = []
        self.link: list[list[int]] = []
        self.axis: dict[tuple[int, int, bytes], list[int]] = {}
        self.order: dict[tuple[int, int, bytes], int] = {}
        self.nodes: list[float] = []
        self.data: list[Array] = []
        self.size = 0
        self.coefficient: list[tuple[int, float, list[int]]] = []

    def feature(self, factor: str, part: str) -> int:
        return feature_index(factor, self.planes.index(part) if part in self.planes else -1)

    def output(self, coefficient: Coefficient) -> int:
        if coefficient.term.name == "t":
            return kernel.OUT_DEDUCTION
        return kernel.OUT_THRUST if coefficient.term.name == "KT" else OUTPUTS.index(coefficient.term.output)

    def axis_index(self, feature: int, rule: int, nodes: Array) -> int:
        """Axes with the same feature, rule and nodes are located once per evaluation."""
        key = (feature, rule, nodes.tobytes())
        if key not in self.order:
            self.order[key] = len(self.order)
            self.axis[key] = [feature, rule, len(self.nodes), nodes.size]
            self.nodes += list(nodes)
        return self.order[key]

    def add_group(self, members: list[Coefficient]) -> None:
        first = members[0]
        rules = _group_key(first)[1]
        union = _union(members)
        grids = [_on(union, member, member.values) for member in members]
        grids += [np.zeros_like(grids[0])] * (kernel.WIDTH - len(grids))
        block = np.stack(grids, axis=-1)
        start = len(self.link)
        for k, (name, nodes) in enumerate(zip(first.term.axes, union, strict=True)):
            if nodes.size > 1:
                feature, rule = self.feature(name, first.part), _RULES[rules[k]]  # type: ignore[index]
                stride = int(np.prod(block.shape[k + 1 : -1]))
                self.link.append([self.axis_index(feature, rule, nodes), stride])
        self.group.append([start, len(self.link) - start, len(self.coefficient), len(members), self.size])
        self.data.append(block.reshape(-1, kernel.WIDTH))
        self.size += len(self.data[-1])
        for member in members:
            factors = [self.feature(f, member.part) for f in member.term.factors]
            factors += [self.one] * (MAX_FACTORS - len(factors))
            scale = member.term.sign * member.term.scale(*self.scale)
            self.coefficient.append((self.output(member), scale, factors))


def with_tanks(model: kernel.Model, vehicle: Vehicle) -> kernel.Model:
    """The model with ballast and trim tank in use; its controls have two more entries."""
    assert vehicle.tanks is not None
    return model._replace(tank=_triple(vehicle.tanks.ballast.position.value))


def weight_across(model: kernel.Model, lateral: float) -> kernel.Model:
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
    return model._replace(
        mass_matrix=mass,
        inverse_mass=np.linalg.inv(mass),
        r_g=(x, y + lateral, z),
        inertia=tuple(float(moved[i, j]) for i, j in _INERTIA),  # type: ignore[arg-type]
    )


def _batches(coefficients: Coefficients) -> Iterable[list[Coefficient]]:
    """Coefficients that share their axes, at most ``WIDTH`` at a time, in the order of the kernel."""
    groups: dict[tuple[object, ...], list[Coefficient]] = {}
    for coefficient in coefficients:
        if not coefficient.term.is_acceleration and coefficient.term.name != "w_T":
            groups.setdefault(_group_key(coefficient), []).append(coefficient)
    for members in groups.values():
        for i in range(0, len(members), kernel.WIDTH):
            yield members[i : i + kernel.WIDTH]


def assemble(coefficients: Coefficients, environment: Environment) -> kernel.Model:
    """The compiled kernel's model of a vehicle.

    Parameters
    ----------
    coefficients : From the database, with their vehicle.
    environment : Water density and gravity.

    Returns
    -------
    Model of flat arrays, program frame, SI and radians.
    """
    vehicle = coefficients.vehicle
    flat = _Flat(coefficients, environment)
    for batch in _batches(coefficients):
        flat.add_group(batch)
    mass, inertia = rigid_body_matrix(vehicle)
    wake = coefficients.get("w_T")
    particulars = vehicle.particulars
    if len(flat.axis) > kernel.MAX_AXES:
        raise ValueError(f"{vehicle.name}: {len(flat.axis)} table axes, at most {kernel.MAX_AXES}")
    added = added_mass_matrix(coefficients, environment)
    total = mass + added
    planes = [[*p.position, *p.lift_axis] for p in vehicle.planes]
    return kernel.Model(
        inverse_mass=np.linalg.inv(total),
        mass=particulars.mass.value,
        weight=particulars.mass.value * environment.gravity,
        buoyancy=particulars.displaced_mass.value * environment.gravity,
        r_g=_triple(particulars.centre_of_gravity.value),
        r_b=_triple(particulars.centre_of_buoyancy.value),
        inertia=tuple(float(inertia[i, j]) for i, j in _INERTIA),  # type: ignore[arg-type]
        sail_top=particulars.sail_top.value[2],
        diameter=vehicle.propeller.diameter.value,
        wake=float(wake.values[0]) if wake else 0.0,
        planes=np.array(planes, dtype=float).reshape(-1, 6),
        groups=np.array(flat.group, dtype=np.int64).reshape(-1, 5),
        links=np.array(flat.link, dtype=np.int64).reshape(-1, 2),
        axes=np.array(list(flat.axis.values()), dtype=np.int64).reshape(-1, 4),
        nodes=np.array(flat.nodes, dtype=float),
        data=np.concatenate(flat.data) if flat.data else np.zeros((0, kernel.WIDTH)),
        terms=np.array([[k[0], *k[2]] for k in flat.coefficient], dtype=np.int64).reshape(-1, 1 + MAX_FACTORS),
        scale=np.array([k[1] for k in flat.coefficient], dtype=float),
        mass_matrix=total,
        added_mass=added,
        tank=(),
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
        self._base = assemble(coefficients, environment)
        places = coefficients.places
        weight, node, row, first = [np.zeros(0)], [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)], 0
        for members in _batches(coefficients):
            union = _union(members)
            for slot, member in enumerate(members):
                grid = _on(union, member, np.eye(member.values.size)).reshape(-1, member.values.size)
                i, j = np.nonzero(grid)
                weight.append(grid[i, j])
                node.append((first + i) * kernel.WIDTH + slot)
                row.append(places[member.term.name, member.part][j])
            first += int(np.prod([nodes.size for nodes in union]))
        shape = (self._base.data.size, sum(p.size for p in places.values()))
        entries = (np.concatenate(weight), (np.concatenate(node), np.concatenate(row)))
        self._data = csr_array(entries, shape=shape)
        parts = _added_masses(coefficients, environment)
        self._added = np.array([places[c.term.name, c.part][0] for c, _ in parts], dtype=int)
        self._units = np.array([unit for _, unit in parts]).reshape(-1, 6, 6)
        self._rigid = rigid_body_matrix(coefficients.vehicle)[0]
        wake = coefficients.get("w_T")
        self._wake = int(places[wake.term.name, wake.part][0]) if wake else None

    def model(self, values: Array) -> kernel.Model:
        """The kernel's model at (rows,) values, in the order of the rows of the coefficients."""
        # einsum and not BLAS: the sum does not depend on how many threads BLAS may use.
        added = np.einsum("k,kij->ij", values[self._added], self._units)
        total = self._rigid + added
        return self._base._replace(
            data=(self._data @ values).reshape(-1, kernel.WIDTH),
            mass_matrix=total,
            added_mass=added,
            inverse_mass=np.linalg.inv(total),
            wake=0.0 if self._wake is None else float(values[self._wake]),
        )
