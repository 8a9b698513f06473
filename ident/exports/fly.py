"""Fly a case from a database version and write what was flown."""

from __future__ import annotations

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
from ident.validation.boats import Fleet
from ident.validation.loads import loads_by_part
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.simulate import fly


def fly_to_file(
    name: str,
    db: str,
    version: int | None = None,
    vehicle_name: str | None = None,
    out: Path | None = None,
    every: float | None = None,
    samples: int | None = None,
    seed: int = 0,
    quantiles: tuple[float, ...] = (),
    loads: str | None = None,
) -> dict[str, Any]:
    """Fly a case and write its history.

    Parameters
    ----------
    name : Bundled case or path to a case file.
    db, version : Database path or URL, and version, latest when None.
    vehicle_name : Bundled vehicle or path to a vehicle file, instead of the case's.
    out : ``.csv``, ``.parquet`` or ``.nc``; named after case and version when None.
    every : Time between records [s], as the case says when None.
    loads : ``part`` or ``coefficient``: loads on the boat from each of them beside the motion, see ``with_loads``.
    samples, seed, quantiles : Coefficient sets drawn from the errors, to ``.nc``; see ``samples_dataset``.

    Returns
    -------
    ``file``, case, vehicle, version and digest, ``records`` and the end of the run ``ends_s``.

    Raises
    ------
    InputError
        For a case, vehicle, version or path that does not exist or fit, or a flight that left the
        finite numbers.
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    case, where = load_case(name)
    case = sampled(case, every)
    vehicle = load_vehicle(vehicle_name) if vehicle_name else load_vehicle(case.vehicle, beside=where)
    fleet = Fleet(db, version)
    boat = fleet.boat(vehicle)
    database = {"path": db, "version": boat.commit.number, "digest": boat.commit.digest}
    path = out or Path(f"{case.name}_v{database['version']}{'.nc' if samples else '.csv'}")
    check_history_file(path)
    if samples and path.suffix != ".nc":
        raise InputError(str(path), f"{samples} samples", "a .nc file, which has a dimension for them")
    said = {"file": str(path), "case": case.name, "vehicle": vehicle.name, "database": database}
    attributes = flight_attributes(case, vehicle.name, database)
    if samples:
        bands = fly_samples(case, vehicle, boat.rows, samples, seed)
        with whole(path) as part:
            data = samples_dataset(bands, attributes, quantiles)
            data.to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")
        return said | {"records": len(bands.time), "ends_s": float(bands.time[-1]), "samples": len(bands.draws)}
    simulation = fly(case, vehicle, boat.model(case), boat.water(case))
    history = history_of(simulation, vehicle, attributes)
    if loads:
        history = with_loads(history, loads_by_part(case, boat, simulation, loads))
    if not all(map(_finite, history.values.values())):
        raise InputError(f"case {case.name}", f"not finite after {simulation['t'][-1]:.1f} s", "a flight that holds")
    write_history(history, path)
    return said | {"records": len(history.values["t"]), "ends_s": float(simulation.end[0])}


def _finite(values: Any) -> bool:
    import numpy as np

    return bool(np.isfinite(values).all())
