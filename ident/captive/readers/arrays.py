"""Named columns from a file of arrays (a workbook, MATLAB, HDF5, netCDF, TDMS) as a ``Sheet``."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.captive.patterns import search
from ident.captive.quantities import owner, split, suffixed
from ident.captive.readers.sheet import Sheet, ignored, once
from ident.captive.readers.text import LARGEST, Dialect, odd
from ident.captive.readers.times import Clocks
from ident.captive.source import Source
from sim.files.errors import InputError

Array = NDArray[np.float64]
_PLAIN = Dialect()
# Rows handed on at once.
_BLOCK = 1 << 14


def needs(module: str, extra: str, path: Path, kind: str) -> Any:
    """A library that reads a format, imported when it is needed.

    Raises
    ------
    InputError
        Naming the extra that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        text = f"pip install 'ident-submarine[{extra}]', or the table saved as CSV or Parquet"
        raise InputError(str(path), f"{kind}, which needs the package {module.split('.')[0]}", text) from error


def with_units(names: Sequence[str], units: Sequence[str], source: Source) -> list[str]:
    """Names with the unit that the file stores beside them in brackets, where the name has none of its own."""
    declared = {*source.columns, *(name for one in source.subtract for name in one.columns)}
    named = []
    for name, unit in zip(names, units, strict=True):
        # A declared name is no quantity by itself: t may be the time.
        bare = split(name)[1] is None and (name in declared or (name not in suffixed() and owner(name.rstrip("'"))))
        named.append(f"{name} [{unit.strip()}]" if bare and unit.strip() else name)
    return named


class NoSuchTable(InputError):
    """A table that a file does not hold; ``names`` are those that it does."""

    def __init__(self, path: Path, what: str, table: str, names: Sequence[str]) -> None:
        shown = ", ".join(map(repr, names))[:200]
        super().__init__(f"{path}, key source.table", f"no {what} {table!r}", shown or "none is there")
        self.names = list(names)


def chosen(path: Path, names: Sequence[str], source: Source, what: str) -> str:
    """Which table (worksheet, group, variable) of a file to read.

    Raises
    ------
    InputError
        For a name that is not there, or several tables and none named.
    """
    if source.table:
        if source.table not in names:
            raise NoSuchTable(path, what, source.table, names)
        return source.table
    if len(names) != 1:
        text = f"table = '...' in [[source]]: one of {', '.join(map(repr, names))[:200]}" if names else f"a {what}"
        raise InputError(str(path), f"{len(names)} {what}s with columns", text)
    return names[0]


def of_one_length(path: Path, columns: dict[str, Any], source: Source) -> dict[str, Any]:
    """The columns of the most values; a single value that is a quantity with its unit stands in every row.

    Parameters
    ----------
    path : For the message.
    columns : Header -> values.
    source : What it declares or ignores.

    Raises
    ------
    InputError
        For a quantity with another number of values, or one with imaginary parts: neither is passed over.
    """
    longest = max((len(v) for v in columns.values()), default=0)
    kept: dict[str, Any] = {}
    for name, values in columns.items():
        meant = is_quantity(name, source)
        if isinstance(values, np.ndarray) and values.dtype.kind == "c":
            if meant and np.abs(values.imag).max(initial=0.0) > 0.0:
                raise InputError(f"{path}, {name[:60]}", "complex numbers", "the real ones of a time history")
            values = values.real
        if len(values) == longest:
            kept[name] = values
        elif ignored(name, source):
            # What is left out is still there to be named.
            kept[name] = np.full(longest, np.nan)
        elif meant and len(values) == 1:
            kept[name] = np.repeat(values, longest)
        elif meant:
            text = f'columns of one length; ignore = ["{name[:40]}"] in [[source]] leaves one out'
            raise InputError(f"{path}, {name[:60]}", f"{len(values)} values, and others {longest}", text)
    return kept


def is_quantity(name: str, source: Source) -> bool:
    """Whether a column is declared, or has the name of a quantity with its unit."""
    bare, unit = split(name)
    if ignored(name, source):
        return False
    declared = name in source.columns or bare in source.columns or any(search(p, name) for p in source.patterns)
    return declared or name in suffixed() or (unit is not None and bool(owner(bare.rstrip("'"))))


def array_sheet(
    path: Path, names: Sequence[str], columns: Sequence[Any], source: Source, rows: Sequence[int] | int = 1
) -> Sheet:
    """A sheet over columns in memory: arrays of numbers, or lists of cells (numbers, text, blanks).

    Parameters
    ----------
    path, source : For the checks.
    names : Headers.
    columns : Of equal length.
    rows : Rows of the values in the file, for messages; or the first of rows without a gap.
    """
    header = [str(n) for n in names]
    once(f"{path} (columns)", header, source)
    length = len(columns[0]) if columns else 0
    places = range(rows, rows + length) if isinstance(rows, int) else rows
    first_row = places[0] if length else 1

    def values(wanted: list[int], clock: int = -1) -> Iterator[Array]:
        clocks = Clocks()
        for at in range(0, length, _BLOCK):
            block = [
                _numbers(
                    path,
                    places[at : at + _BLOCK],
                    header[i],
                    columns[i][at : at + _BLOCK],
                    clocks if i == clock else None,
                    source,
                )
                for i in wanted
            ]
            yield np.stack(block, axis=1)

    def cells() -> Iterator[tuple[int, list[str]]]:
        for row in range(length):
            yield places[row], [_written(column[row]) for column in columns]

    return Sheet(path, max(first_row - 1, 0), header, values, cells, _PLAIN, first_row)


def take_pairs(
    place: str, cells: Sequence[str], plots: Sequence[tuple[str, dict[float, float]]], dialect: Dialect, of: str = ""
) -> None:
    """Enter a row of curves that stand side by side, an abscissa and a value each; a curve that has ended is blank.

    Parameters
    ----------
    place : File and row, for the message.
    cells : Of the row.
    plots : Name of each curve, and its abscissae and values so far.
    dialect : How numbers are written.
    of : Name of the abscissa, where the format has one.

    Raises
    ------
    InputError
        For half of a pair, or what is no number.
    """
    for k, (name, series) in enumerate(plots):
        pair = cells[2 * k : 2 * k + 2]
        if len(pair) < 2 or not any(pair):
            continue
        at, value = (dialect.number(cell) for cell in pair)
        if at is None or value is None:
            wanted = f"an {of or 'abscissa'} and a number, or both blank"
            raise InputError(f"{place}, column {name[:60]}", repr(" ".join(pair)[:60]), wanted)
        series[at] = value


def joined(
    path: Path, names: list[str], plots: list[dict[float, float]], source: Source, row: int, blank: Sequence[str] = ()
) -> Sheet:
    """Curves over the abscissae that all of them have.

    Parameters
    ----------
    path, source : For the checks.
    names : Of the abscissa, then of each curve.
    plots : Abscissa -> value, a curve each.
    row : Of the names, for the message.
    blank : Further columns, which hold no numbers.

    Raises
    ------
    InputError
        For curves without a common abscissa.
    """
    common = sorted(set(plots[0]).intersection(*plots[1:]))
    if not common:
        text = "plots of the same iterations or times"
        raise InputError(f"{path}, row {row} (header)", f"no {names[0]} that all plots have", text)
    columns = [np.array(common)] + [np.array([series[a] for a in common]) for series in plots]
    columns += [np.full(len(common), np.nan) for _ in blank]
    return array_sheet(path, [*names, *blank], columns, source, row + 1)


def _written(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bytes):
        return cell.decode("utf-8", "replace").strip()
    if isinstance(cell, str):
        return cell
    if isinstance(cell, (bool, np.bool_)):
        return str(bool(cell))
    if isinstance(cell, (int, float, np.number)):
        value = float(cell)
        return "" if np.isnan(value) else repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    return str(cell)


def _numbers(path: Path, rows: Sequence[int], name: str, cells: Any, clocks: Clocks | None, source: Source) -> Array:
    """One column of some rows as finite numbers; NaN where one is stated to be missing, but for a clock."""
    lost = np.zeros(len(cells), dtype=bool)
    if isinstance(cells, np.ndarray) and cells.dtype.kind in "iuf":
        values = cells.astype(float)
        if clocks is not None and cells.dtype.kind in "iu" and cells.size and int(cells.min()) > LARGEST:
            # Of microseconds or nanoseconds of an epoch.
            values = values / (1e9 if int(cells.min()) > 1e3 * LARGEST else 1e6)
    else:
        read = []
        for cell in cells:
            text = _written(cell)
            number = _PLAIN.number(text)
            if number is None and clocks is not None:
                number = clocks.seconds(text)
            read.append(np.nan if number is None else number)
        values = np.array(read, dtype=float)
        lost = np.array([_written(cell).strip() in source.missing_words for cell in cells], dtype=bool)
    if clocks is None:
        values, lost = without_missing(values, lost, source)
    bad = np.flatnonzero(~(np.abs(values) <= LARGEST) & ~lost)
    if bad.size:
        at = int(bad[0])
        place = f"{path}, row {rows[at]}, column {name[:60]}"
        shown = _written(cells[at]) or "nothing"
        word = "NaN" if isinstance(cells, np.ndarray) and np.isnan(values[at]) else _written(cells[at])
        text = f"a finite number of at most {LARGEST:g}{odd(word)}"
        raise InputError(place, repr(shown[:60]), text)
    return values


def without_missing(values: Array, lost: NDArray[np.bool_], source: Source) -> tuple[Array, NDArray[np.bool_]]:
    """Values with NaN where nothing was measured, and where that is: ``missing = ["NaN"]`` says that NaN does."""
    stated = source.missing_numbers
    if any(abs(m) > LARGEST for m in stated):
        lost = lost | np.isin(values, stated)
    if any(word.lower() == "nan" for word in source.missing_words):
        lost = lost | np.isnan(values)
    return np.where(lost, np.nan, values), lost
