"""Reference series read: every source and channel one record in the program frame."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sim.files.errors import InputError
from sim.files.frames import Frame
from sim.files.record import Record, Written
from sim.files.toml_files import bundled
from sim.flight.case import Case
from sim.flight.reference_table import read_table


class Series:
    """Reference series by source and channel, in the program frame.

    ``self[source][channel]`` is a ``Record`` over time [s] or path length [m]; its ``sigma`` is the
    standard error of reading the value, where stated.

    Examples
    --------
    >>> import ident
    >>> reference = ident.validate("my-boat/zigzag.toml", db="coeff_db", version=0).reference
    >>> reference
    Series(TRIAL: psi, r, u over t)
    >>> reference["TRIAL"]["psi"].unit
    'rad'
    """

    def __init__(self, data: dict[str, dict[str, Record]], abscissa: Literal["t", "s"] = "t") -> None:
        self.data = data
        self.abscissa = abscissa
        self.smooth: dict[str, dict[str, Record]] = {}
        self.rows: dict[tuple[str, str], NDArray[np.int_]] = {}
        self.turned: set[str] = set()

    def __repr__(self) -> str:
        listed = "; ".join(f"{source}: {', '.join(records)}" for source, records in self.data.items())
        return f"Series({listed} over {self.abscissa})"

    def measured_on(self, source: str) -> dict[str, Record]:
        """What metrics are measured on: smooth paths where the series of a source are noisy."""
        return self.smooth.get(source, self[source])

    def __getitem__(self, source: str) -> dict[str, Record]:
        """Channel -> record of a source; empty for one that has none."""
        return self.data.get(source, {})


def place_of(series: Series, file: str, source: str, channel: str, at: int) -> str:
    """File, row and series of a point, for messages; its time or path length where the row is not known."""
    rows = series.rows.get((source, channel))
    if rows is not None:
        return f"{file}, row {int(rows[at])}, {source} {channel}"
    return f"{file}, {source} {channel}, {series.abscissa} = {float(series[source][channel].abscissa[at]):.6g}"


def _from_start(series: Series, channels: list[str]) -> Series:
    """The series with the listed channels beginning at zero."""
    for records in series.data.values():
        for channel in channels:
            if channel in records:
                records[channel] = records[channel].less(records[channel].shown.value[0])
    return series


def read_series(path: Path, abscissa: Literal["t", "s"], frame: Frame) -> Series:
    """Read reference series and turn them to the program frame.

    Parameters
    ----------
    path : As ``sim.flight.reference_table.read_table``.
    abscissa : Column over which the series are given.
    frame : Axis directions of the file.

    Raises
    ------
    InputError
        As ``read_table``; for values of the abscissa that do not increase, or two units in one series.
    """
    table = read_table(path, abscissa)
    data: dict[str, dict[str, Record]] = {}
    places: dict[tuple[str, str], NDArray[np.int_]] = {}
    for (source, channel), rows in table.groupby(["source", "channel"], sort=False):
        along = rows[abscissa].to_numpy(dtype=float)
        if np.any(np.diff(along) <= 0.0):
            raise InputError(f"{path}, {source} {channel}", f"column {abscissa} not increasing", "increasing values")
        units = rows["unit"].unique()
        if len(units) > 1:
            raise InputError(f"{path}, {source} {channel}", f"units {', '.join(units)}", "one unit a series")
        value = rows["value"].to_numpy(dtype=float) * frame.sign(str(channel))
        sigma = rows["sigma"].to_numpy(dtype=float) if "sigma" in rows else None
        one = Record.read(str(channel), along, Written(value, str(units[0]), sigma))
        data.setdefault(str(source), {})[str(channel)] = one
        places[(str(source), str(channel))] = rows.index.to_numpy(int) + 2
    series = Series(data, abscissa)
    series.rows, series.turned = places, {c for _, c in places if frame.sign(c) < 0.0}
    return series


def load_reference(case: Case, where: str) -> Series:
    """Reference series of a case, turned to the program frame.

    Parameters
    ----------
    case : With a reference or without.
    where : As returned by ``load_case``; its folder holds the reference file.

    Raises
    ------
    InputError
        For a missing file or column, a non-number, or an undeclared frame.
    """
    if case.reference is None:
        return Series({})
    frame = case.reference.frame.declared(f"{where}, key reference.frame")
    if case.reference.file is None:
        return Series({}, case.reference.abscissa)
    if where in bundled("cases"):
        path = Path(str(files("sim") / "cases" / case.reference.file))
    else:
        path = Path(where).parent / case.reference.file
    if not path.is_file():
        raise InputError(str(path), "missing", f"the reference file of case {case.name}")
    return _from_start(read_series(path, case.reference.abscissa, frame), case.reference.from_start)
