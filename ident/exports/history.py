"""A flight as named series with units, to CSV, Parquet or NetCDF.

Everything is in the program frame (x forward, y starboard, z down; earth axes north, east, down),
SI and radians, so that what is read back is what was flown to the last digit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ident.output import whole
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.files.frames import PROGRAM
from sim.flight.case import Case
from sim.flight.simulation import CHANNELS, Simulation
from sim.waves.linear import kinematics

if TYPE_CHECKING:
    import pandas as pd
    import xarray

    from ident.validation.bands import Bands

Array = NDArray[np.float64]
FORMATS = (".csv", ".parquet", ".nc")
# Unit -> how it ends the name of a column.
_ENDINGS = {"s": "s", "m": "m", "m/s": "mps", "rad": "rad", "rad/s": "radps", "1/s": "rps", "kg": "kg", "-": ""}
_ENDINGS |= {"N": "N", "N m": "Nm"}
# Names of the CF conventions, where they have one for the quantity.
_STANDARD = {"phi": "platform_roll", "theta": "platform_pitch", "psi": "platform_yaw"}
_MEANING = {
    "t": "time from the start of the run",
    "u": "velocity forward, relative to earth, in a current to the water it carries",
    "v": "velocity to starboard, likewise",
    "w": "velocity downwards in body axes, likewise",
    "p": "roll rate",
    "q": "pitch rate",
    "r": "yaw rate",
    "x": "position north of the body origin",
    "y": "position east of the body origin",
    "z": "depth of the body origin below the calm surface",
    "phi": "roll angle",
    "theta": "pitch angle, bow up positive",
    "psi": "heading, unwrapped",
    "U": "speed",
    "D0": "depth of the sail top of the upright boat below the calm surface",
    "s": "length of the path over ground",
    "u_over_U0": "forward velocity over the initial speed",
    "dz_over_L0": "change of depth over the reference length",
    "alpha": "vertical incidence, atan2(w, u)",
    "beta": "drift angle, asin(v / U), starboard windward positive",
    "n": "propeller revolutions",
    "ballast": "ballast water taken in",
    "trim_tank": "shift of the centre of gravity forward",
    "dV": "command in the vertical plane, bow up positive",
    "dH": "command in the horizontal plane, to starboard positive",
    "elevation": "elevation of the surface above the body origin, upwards",
    "sail_top_submergence": "distance of the sail top below the surface above it, waves included",
}


@dataclass(frozen=True)
class History:
    """Series of one flight.

    Attributes
    ----------
    values : Name -> (records,) series, SI and radians, program frame; ``t`` is the first.
    units : Name -> unit.
    meaning : Name -> what it is.
    attributes : Case, vehicle, database version and digest, frame, program: texts.
    """

    values: Mapping[str, Array]
    units: Mapping[str, str]
    meaning: Mapping[str, str]
    attributes: Mapping[str, str]

    def column(self, name: str) -> str:
        """Name of a series in a table, its unit at the end: ``psi_rad``."""
        ending = _ENDINGS[self.units[name]]
        return f"{name}_{ending}" if ending else name


def check_history_file(path: Path) -> None:
    """Refuse a name that says no format. Raises ``InputError``."""
    if path.suffix not in FORMATS:
        raise InputError(str(path), f"the ending {path.suffix!r}", ", ".join(FORMATS))


def sampled(case: Case, every: float | None) -> Case:
    """The case with a record every so many seconds.

    Parameters
    ----------
    case : From ``load_case``.
    every : Time between records [s], a multiple of the case's step; as the case says when None.

    Raises
    ------
    InputError
        When it is no multiple of the step, or longer than the run.
    """
    if every is None:
        return case
    step = case.run.step_s
    steps = every / step
    if not (steps >= 1.0 - 1e-9 and abs(steps - round(steps)) < 1e-6 and every <= case.run.duration_s):
        allowed = f"a multiple of the step {step:g} s, up to {case.run.duration_s:g} s"
        raise InputError(f"case {case.name}, --every", f"{every:g} s", allowed)
    return case.model_copy(update={"run": case.run.model_copy(update={"record_s": every})})


def flight_attributes(case: Case, vehicle: str, database: Mapping[str, object]) -> dict[str, str]:
    """What a file says of the flight it holds."""
    from ident import __version__

    return {
        "title": case.title,
        "case": case.name,
        "vehicle": vehicle,
        "database_version": str(database["version"]),
        "database_digest": str(database["digest"]),
        "frame": f"{PROGRAM}; earth axes north, east, down; SI and radians",
        "step_s": f"{case.run.step_s:g}",
        "source": f"ident {__version__}",
    }


def history_of(simulation: Simulation, vehicle: Vehicle, attributes: Mapping[str, str]) -> History:
    """Every series of a flight: states, actuators, commands, flow angles, distance to the surface.

    Parameters
    ----------
    simulation : A flown case.
    vehicle : The boat that flew.
    attributes : From ``flight_attributes``.

    Returns
    -------
    History; in waves with the elevation above the boat.

    Example
    -------
    >>> from ident.validation.validate import validate  # doctest: +SKIP
    >>> done = validate("hzz20", "coeff_db")  # doctest: +SKIP
    >>> history_of(done.simulation, done.boat.vehicle, {}).values["psi"].max()  # doctest: +SKIP
    """
    planes = [p.name for p in vehicle.planes]
    units = {"t": "s"} | {c: CHANNELS.get(c, "rad") for c in simulation.columns if c != "t"}
    values = {name: np.array(simulation[name]) for name in units}
    derived = {"U": "m/s", "D0": "m", "s": "m", "u_over_U0": "-", "dz_over_L0": "-"}
    if not simulation["U"][0] > 0.0:
        # From rest there is no initial speed to divide by.
        del derived["u_over_U0"]
    for name, unit in derived.items():
        values[name], units[name] = np.array(simulation[name]), unit
    speed = np.where(values["U"] > 0.0, values["U"], 1.0)
    values["alpha"] = np.arctan2(values["w"], values["u"])
    values["beta"] = np.arcsin(np.clip(values["v"] / speed, -1.0, 1.0))
    place = _sail_top(simulation, vehicle)
    over_top = elevation = np.zeros(len(values["t"]))
    if simulation.waves is not None and simulation.waves.amplitude.size:
        origin = np.stack([values["x"], values["y"], np.zeros_like(elevation)], axis=-1)
        elevation = kinematics(simulation.waves, origin, values["t"]).elevation
        above = place * np.array([1.0, 1.0, 0.0])
        over_top = kinematics(simulation.waves, above, values["t"]).elevation
        values["elevation"], units["elevation"] = elevation, "m"
    values["sail_top_submergence"] = place[:, 2] + over_top
    units |= {"alpha": "rad", "beta": "rad", "sail_top_submergence": "m"}
    meaning = {name: _MEANING.get(name, "") for name in values} | {p: f"deflection of {p}" for p in planes}
    return History(values, units, meaning, dict(attributes))


def with_loads(history: History, table: pd.DataFrame) -> History:
    """A flight with the loads on the boat beside its motion.

    Parameters
    ----------
    history : Of the flight.
    table : Its loads by part or by term, from ``ident.validation.loads.loads_by_part``.

    Returns
    -------
    History with a series ``X_<source>`` ... ``N_<source>`` of every load that a source has [N, N m], about the body
    origin in the program frame.
    """
    values, units, meaning = dict(history.values), dict(history.units), dict(history.meaning)
    for source, rows in table.groupby("source", sort=False):
        for column in rows.columns.drop(["t_s", "source"]):
            load = rows[column].to_numpy()
            if not load.any():
                continue
            output, unit = column.split("_")
            name = f"{output}_{str(source).replace(' ', '_')}"
            values[name], units[name] = load, "N" if unit == "N" else "N m"
            meaning[name] = f"{output} of {source} on the boat, about the body origin"
    return History(values, units, meaning, history.attributes)


def _sail_top(simulation: Simulation, vehicle: Vehicle) -> Array:
    """(records, 3) place of the sail top in earth axes [m]."""
    a, b, c = vehicle.needed_sail_top("its place")
    phi, theta, psi = (simulation[k] for k in ("phi", "theta", "psi"))
    # Body to earth, Euler angles 3-2-1: first about x, then y, then z.
    y, z = np.cos(phi) * b - np.sin(phi) * c, np.sin(phi) * b + np.cos(phi) * c
    x, z = np.cos(theta) * a + np.sin(theta) * z, -np.sin(theta) * a + np.cos(theta) * z
    north, east = np.cos(psi) * x - np.sin(psi) * y, np.sin(psi) * x + np.cos(psi) * y
    return np.stack([simulation["x"] + north, simulation["y"] + east, simulation["z"] + z], axis=-1)


def write_history(history: History, path: Path) -> Path:
    """Write a flight to a ``.csv``, ``.parquet`` or ``.nc`` file, whole or not at all.

    CSV: lines ``# name: text`` of what it is, then one column a series with its unit at the end of
    the name, every digit kept. Parquet: the same columns, units and texts in the metadata. NetCDF:
    dimension ``time``, units, long names and the texts as attributes.

    Raises
    ------
    InputError
        For another ending, or a path that cannot be written.
    """
    check_history_file(path)
    with whole(path) as part:
        if path.suffix == ".nc":
            as_dataset(history).to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")
        elif path.suffix == ".parquet":
            _write_parquet(history, part)
        else:
            _write_csv(history, part)
    return path


def _write_csv(history: History, path: Path) -> None:
    import pandas as pd

    table = pd.DataFrame({history.column(name): series for name, series in history.values.items()})
    with path.open("w", encoding="utf-8", newline="") as stream:
        for name, text in history.attributes.items():
            stream.write(f"# {name}: {' '.join(text.split())}\n")
        table.to_csv(stream, index=False, lineterminator="\n")


def _write_parquet(history: History, path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [
        pa.field(history.column(n), pa.float64(), metadata={"unit": history.units[n], "meaning": history.meaning[n]})
        for n in history.values
    ]
    schema = pa.schema(fields, metadata=dict(history.attributes))
    pq.write_table(pa.table([pa.array(v) for v in history.values.values()], schema=schema), path)


def as_dataset(history: History) -> xarray.Dataset:
    """A flight as an xarray Dataset over ``time`` [s]."""
    import xarray as xr

    series = {
        name: ("time", values, _attributes(name, history.units[name], history.meaning[name]))
        for name, values in history.values.items()
        if name != "t"
    }
    time = ("time", history.values["t"], _attributes("t", "s", history.meaning["t"]))
    return xr.Dataset(series, {"time": time}, {"Conventions": "CF-1.10", **history.attributes})


def _attributes(name: str, unit: str, meaning: str) -> dict[str, str]:
    standard = {"standard_name": _STANDARD[name]} if name in _STANDARD else {}
    return {"units": "1" if unit == "-" else unit, "long_name": meaning or name, **standard}


def samples_dataset(bands: Bands, attributes: Mapping[str, str], quantiles: tuple[float, ...] = ()) -> xarray.Dataset:
    """Flights with coefficient sets drawn from their errors, as a Dataset.

    Parameters
    ----------
    bands : From ``fly_samples``.
    attributes : From ``flight_attributes``.
    quantiles : Between 0 and 1: their curves over ``quantile`` and ``time`` instead of every sample.

    Returns
    -------
    Dataset over (sample, time), or (quantile, time); NaN after a flight ended.
    """
    import xarray as xr

    first = "quantile" if quantiles else "sample"
    series = {}
    for name, values in bands.channels.items():
        shown = np.nanquantile(values, quantiles, axis=0) if quantiles else values
        unit = CHANNELS.get(name, "m" if name == "s" else "rad")
        series[name] = ((first, "time"), shown, _attributes(name, unit, _MEANING.get(name, "")))
    count = np.asarray(quantiles, dtype=float) if quantiles else np.arange(len(bands.draws))
    time = ("time", bands.time, _attributes("t", "s", _MEANING["t"]))
    texts = {"Conventions": "CF-1.10", "samples": str(len(bands.draws)), "seed": str(bands.seed), **attributes}
    return xr.Dataset(series, {"time": time, first: (first, count)}, texts)
