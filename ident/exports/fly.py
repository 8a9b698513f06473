"""Fly a case from a database version and write what was flown."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from ident.exports.history import (
    check_history_file,
    flight_attributes,
    history_of,
    sampled,
    samples_dataset,
    with_loads,
    write_history,
)
from ident.output import whole
from ident.validation.bands import fly_samples
from ident.validation.boats import Boat, Fleet
from ident.validation.loads import loads_by_part
from sim.boat.delta_log import Origin
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import Case, load_case
from sim.flight.simulate import fly


@dataclass(frozen=True)
class Draws:
    """Coefficient sets drawn from the errors of a version.

    Attributes
    ----------
    samples, seed : How many, and the seed of the generator.
    quantiles : Shares, 0 to 1, whose curves are written instead of every flight; see ``samples_dataset``.
    """

    samples: int
    seed: int = 0
    quantiles: tuple[float, ...] = ()


@dataclass(frozen=True)
class Recording:
    """What is written of a flight.

    Attributes
    ----------
    every : Time between records [s], as the case says when None.
    draws : Flights of drawn coefficient sets instead, to ``.nc``.
    loads : ``part`` or ``coefficient``: loads on the boat from each of them beside the motion, see ``with_loads``.
    """

    every: float | None = None
    draws: Draws | None = None
    loads: str | None = None


@dataclass(frozen=True)
class Written:
    """A flight written to a file.

    Attributes
    ----------
    file, case, vehicle : Where, and what was flown.
    database : ``path``, ``version`` and ``digest``.
    records : Number of times.
    ends_s : End of the flight [s].
    samples : Number of coefficient sets; None for the version itself.
    """

    file: str
    case: str
    vehicle: str
    database: Origin
    records: int
    ends_s: float
    samples: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """For a program to read; without ``samples`` where there are none."""
        return {f.name: value for f in fields(self) if (value := getattr(self, f.name)) is not None}


def fly_to_file(
    name: str,
    db: str,
    version: int | None = None,
    vehicle_name: str | None = None,
    out: Path | None = None,
    recording: Recording | None = None,
) -> Written:
    """Fly a case and write its history.

    Parameters
    ----------
    name : Bundled case or path to a case file.
    db, version : Database path or URL, and version, latest when None.
    vehicle_name : Bundled vehicle or path to a vehicle file, instead of the case's.
    out : ``.csv``, ``.parquet`` or ``.nc``; named after case and version when None.
    recording : What is written of the flight; states at the case's own times when None.

    Raises
    ------
    InputError
        For a case, vehicle, version or path that does not exist or fit, or a flight that left the
        finite numbers.
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    recording = recording or Recording()
    draws = recording.draws
    case, where = load_case(name)
    case = sampled(case, recording.every)
    vehicle = load_vehicle(vehicle_name) if vehicle_name is not None else load_vehicle(case.vehicle, beside=where)
    boat = Fleet(db, version).boat(vehicle)
    database = boat.commit.origin(db)
    path = out or Path(f"{case.name}_v{database['version']}{'.nc' if draws else '.csv'}")
    check_history_file(path)
    if draws and path.suffix != ".nc":
        raise InputError(str(path), f"{draws.samples} samples", "a .nc file, which has a dimension for them")
    attributes = flight_attributes(case, vehicle.name, database)
    if draws:
        records, ends, samples = _write_samples(case, boat, draws, attributes, path)
        return Written(str(path), case.name, vehicle.name, database, records, ends, samples)
    written = _write_flight(case, boat, recording.loads, attributes, path)
    return Written(str(path), case.name, vehicle.name, database, *written)


def _write_samples(
    case: Case, boat: Boat, draws: Draws, attributes: dict[str, str], path: Path
) -> tuple[int, float, int]:
    """Flights of drawn sets; number of times, their end [s] and the number of sets that fly."""
    bands = fly_samples(case, boat.vehicle, boat.rows, draws.samples, draws.seed)
    with whole(path) as part:
        data = samples_dataset(bands, attributes, draws.quantiles)
        data.to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")
    return len(bands.time), float(bands.time[-1]), len(bands.draws)


def _write_flight(
    case: Case, boat: Boat, loads: str | None, attributes: dict[str, str], path: Path
) -> tuple[int, float]:
    """One flight; number of records and its end [s]."""
    simulation = fly(case, boat.vehicle, boat.model(case), boat.water(case))
    history = history_of(simulation, boat.vehicle, attributes)
    if loads:
        history = with_loads(history, loads_by_part(case, boat, simulation, loads))
    if not all(map(_finite, history.values.values())):
        raise InputError(f"case {case.name}", f"not finite after {simulation['t'][-1]:.1f} s", "a flight that holds")
    write_history(history, path)
    return len(history.values["t"]), float(simulation.end[0])


def _finite(values: Any) -> bool:
    import numpy as np

    return bool(np.isfinite(values).all())
