"""Loads of a flight over time, by part of the boat and by term.

The loads of the model are a sum over the terms of its table, so each part and each term is flown on the states of the
flight with the rows of the others left out. With weight and buoyancy, the water's inertia and that of the boat they
balance: the sum of all columns of a load is zero but for the waves, whose loads are what is left.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ident.output import whole
from ident.text import in_file_name
from sim.boat.catalogue import OUTPUTS
from sim.boat.coefficients import Coefficients
from sim.boat.mass import cross_matrix
from sim.files.errors import InputError
from sim.flight.case import Case
from sim.flight.maneuver import CONTROLS, STATE, TIME
from sim.flight.simulate import begun, environment_of, uses_tanks
from sim.flight.simulation import Simulation
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace
from sim.kernel.water import shares_at

if TYPE_CHECKING:
    import pandas as pd

    from ident.validation.boats import Boat
    from ident.validation.result import Validation

Array = NDArray[np.float64]

# Not parts of the boat, but columns beside them.
WEIGHT, ADDED_MASS, INERTIA, WAVES = "weight and buoyancy", "added mass", "inertia of the boat", "waves"


def check_parts(case: Case) -> None:
    """Refuse a case whose loads are not all of the boat's parts. Raises ``InputError``."""
    if uses_tanks(case):
        raise InputError(f"case {case.name}", "ballast and trim tank in use: their weight is no part", "another case")


def loads_by_part(case: Case, boat: Boat, flight: Simulation, by: str = "part") -> pd.DataFrame:
    """Loads of a flight over time, by part or by term.

    Parameters
    ----------
    case : What was flown.
    boat : With which coefficients.
    flight : Its record.
    by : ``part`` (hull, each plane, propeller) or ``coefficient``.

    Returns
    -------
    Columns ``t_s``, ``source`` (part or term, or weight, added mass, inertia, waves) and ``X_N`` ... ``N_Nm`` in the
    program frame about the body origin. In calm water the loads of all sources add up to zero at every time, as far
    as accelerations are known from the record; in waves what is left of them stands as ``waves``.

    Raises
    ------
    ValueError
        For another ``by``.
    InputError
        For a case with ballast or trim tank, whose weight is none of the columns.
    """
    import pandas as pd

    check_parts(case)
    if by not in ("part", "coefficient"):
        raise ValueError(f"by {by!r}: part or coefficient")
    record = np.ascontiguousarray(flight.record)
    states = record[:, STATE:CONTROLS]
    controls = record[:, CONTROLS : CONTROLS + len(boat.vehicle.planes) + 1]
    by_source: dict[str, Array] = {}
    # Thrust needs thrust deduction and wake, which are rows of the propeller, whatever is asked.
    sections = {s.name for s in boat.vehicle.sections.centres} if boat.vehicle.sections else set()
    # Sections carry loads in a wave's acceleration alone.
    rows = boat.rows[~boat.rows["part"].isin(sections)]
    rows = rows.assign(source=rows[by].where(rows["part"] != "propeller", "propeller"))
    for name, of_source in rows.groupby("source", sort=False):
        by_source[str(name)] = _loads(case, boat, of_source.drop(columns="source"), states, controls)
    by_source |= _inertia_and_weight(case, boat, flight, states)
    total = np.sum(list(by_source.values()), axis=0)
    if flight.waves is not None:
        by_source[WAVES] = -total
    units = [f"{o}_{'N' if o in 'XYZ' else 'Nm'}" for o in OUTPUTS]
    time = record[:, TIME]
    tables = [pd.DataFrame(v, columns=units).assign(t_s=time, source=name) for name, v in by_source.items()]
    return pd.concat(tables, ignore_index=True)[["t_s", "source", *units]]


def _loads(case: Case, boat: Boat, rows: pd.DataFrame, states: Array, controls: Array) -> Array:
    """(samples, 6) loads of some of the rows in calm water of the density at each depth."""
    model = assemble(Coefficients(boat.vehicle, rows.reset_index(drop=True)), environment_of(case))
    work = workspace(model)
    out = np.zeros((len(states), 6))
    for i, (state, control) in enumerate(zip(states, controls, strict=True)):
        kernel.features(model, np.ascontiguousarray(state), np.ascontiguousarray(control), work)
        out[i] = kernel.loads(model, work)[:6]
    return out * shares_at(boat.model(case), states[:, 8])[0][:, None]


def _inertia_and_weight(case: Case, boat: Boat, flight: Simulation, states: Array) -> Mapping[str, Array]:
    """Weight and buoyancy, and the inertia of water and boat against the accelerations of the record."""
    # As it was flown: the weight may be shifted across to balance the propeller's torque.
    model, *_ = begun(case, boat.vehicle, boat.model(case))
    centre = np.array(model.r_g)
    phi, theta = states[:, 9], states[:, 10]
    down = np.stack([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)], axis=1)
    buoyancy = model.buoyancy * shares_at(model, states[:, 8])[1][:, None]
    moment = np.cross(centre * model.weight - np.array(model.r_b) * buoyancy, down)
    rate = np.gradient(states[:, :6], flight["t"], axis=0)
    v, omega = states[:, :3], states[:, 3:6]
    ixx, iyy, izz, ixy, ixz, iyz = model.inertia
    inertia = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    turned = model.mass * (np.cross(omega, v) + np.einsum("nij,j->ni", _twice(omega), centre))
    spun = np.cross(omega, omega @ inertia) + model.mass * np.cross(centre, np.cross(omega, v))
    return {
        WEIGHT: np.concatenate([(model.weight - buoyancy) * down, moment], axis=1),
        ADDED_MASS: -rate @ model.added_mass.T,
        INERTIA: -rate @ (model.mass_matrix - model.added_mass).T - np.concatenate([turned, spun], axis=1),
    }


def _twice(omega: Array) -> Array:
    """(n, 3, 3) matrices of omega x (omega x r)."""
    return np.stack([cross_matrix(o) @ cross_matrix(o) for o in omega])


def loads_figure(table: pd.DataFrame, path: Path, most: int = 8) -> Path:
    """Draw the loads of the largest sources over time, one panel a component, as Fig. 38 of Kim (2021).

    Parameters
    ----------
    table : From ``loads_by_part``.
    path : Of the figure.
    most : Sources that are drawn in each panel.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 9.0), layout="constrained")
    axes = figure.subplots(3, 2, sharex=True).T.reshape(-1)
    for ax, column in zip(axes, [c for c in table.columns if c not in ("t_s", "source")], strict=True):
        size = table.groupby("source", sort=False)[column].agg(lambda x: x.abs().max())
        for name in size[size > 0.0].sort_values(ascending=False).index[:most]:
            of_source = table[table["source"] == name]
            ax.plot(of_source["t_s"], of_source[column], lw=1.0, label=str(name))
        ax.set_ylabel(column.replace("_", " [") + "]")
        ax.legend(frameon=False, fontsize=6, ncols=2)
    for ax in axes[2::3]:
        ax.set_xlabel("t [s]")
    with whole(path) as part:
        figure.savefig(part, dpi=150)
    return path


def write_loads(done: Validation, by: str, folder: Path) -> tuple[pd.DataFrame, Path, Path]:
    """Loads of a validated flight as CSV and figure; the table, and where both lie.

    Parameters
    ----------
    done : A flight.
    by : ``part`` or ``coefficient``.
    folder : Where files go.
    """
    table = loads_by_part(done.case, done.boat, done.simulation, by)
    # A name may have points, after which no suffix begins.
    stem = f"{in_file_name(done.case.name)}_v{done.version}_loads"
    data = folder / f"{stem}.csv"
    with whole(data) as part:
        table.to_csv(part, index=False)
    return table, data, loads_figure(table, folder / f"{stem}.png")
