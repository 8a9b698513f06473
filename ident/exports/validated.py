"""Histories of the flights that a validation compares and draws."""

from __future__ import annotations

from pathlib import Path

from ident.exports.history import FORMATS, flight_attributes, history_of, samples_dataset, write_history
from ident.output import whole
from ident.text import in_file_name
from ident.validation.result import Validation

KINDS = tuple(ending[1:] for ending in FORMATS)


def write_histories(done: Validation, folder: Path, kind: str) -> list[Path]:
    """Write every flight of a validated case: all that its figures show of the boat.

    Parameters
    ----------
    done : A flown case.
    folder : Where to write.
    kind : ``csv``, ``parquet`` or ``nc``.

    Returns
    -------
    ``<case>_v<version>.<kind>``, then ``<case>_v<version>_<source>.<kind>`` of each flight that starts as a source's
    record does, then the samples of a case flown with bands, ``<case>_v<version>_samples.nc``.

    Raises
    ------
    InputError
        When a file cannot be written.
    """
    attributes = flight_attributes(done.case, done.boat.vehicle.name, done.database)
    stem = f"{in_file_name(done.case.name)}_v{done.version}"
    written = []
    for source, flight in {"": done.simulation, **done.as_started}.items():
        name = f"{stem}_{in_file_name(source)}.{kind}" if source else f"{stem}.{kind}"
        said = attributes | ({"started_as": source} if source else {})
        written.append(write_history(history_of(flight, done.boat.vehicle, said), folder / name))
    if done.bands:
        written.append(folder / f"{stem}_samples.nc")
        with whole(written[-1]) as part:
            samples_dataset(done.bands, attributes).to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")
    return written
