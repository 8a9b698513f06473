"""Tables: tidy CSV, Parquet, STAR-CCM+ monitor exports and white-space columns.

Each is opened as a ``Sheet``: a header and rows that come a block at a time, so that a
file of any size is read in bounded memory.
"""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.quantities import Column, column, split
from ident.readers.source import Source
from ident.readers.text import LARGEST, Dialect, Lines, blocks, head, numbers, sniff
from sim.errors import InputError

Array = NDArray[np.float64]
# A table of runs has a row a run; what is longer is a time history.
_MOST_RUNS = 100_000
_BATCH = 1 << 14


@dataclass(frozen=True)
class Sheet:
    """An open table.

    Attributes
    ----------
    path : The file.
    header_row : Row of the header.
    header : Column headers as they stand there.
    numbers : Wanted column positions -> blocks (rows, wanted) of finite numbers.
    cells : Blocks of (file row, cells as text), for a table of runs.
    dialect : How its numbers are written.
    first_row : Row where the data begin.
    """

    path: Path
    header_row: int
    header: list[str]
    numbers: Callable[[list[int]], Iterator[Array]]
    cells: Callable[[], Iterator[tuple[int, list[str]]]]
    dialect: Dialect
    first_row: int = 2

    @property
    def where(self) -> str:
        """The header, for errors."""
        return f"{self.path}, row {self.header_row} (header)"


def _once(where: str, header: list[str]) -> None:
    for name in header:
        if header.count(name) > 1:
            raise InputError(where, f"column {name[:60]!r} stands twice", "each column once")


def _text_sheet(path: Path, source: Source, dialect: Dialect, header: list[str], first: Lines, skip: int) -> Sheet:
    """A sheet over the lines after the header; ``skip`` is the last row that is not data."""

    def data() -> Iterator[Lines]:
        for block in blocks(path, source.encoding):
            if block.rows[0] > skip:
                yield block
            elif block.rows[-1] > skip:
                i = next(k for k, row in enumerate(block.rows) if row > skip)
                yield Lines(block.rows[i:], block.text[i:])

    def values(wanted: list[int]) -> Iterator[Array]:
        for block in data():
            yield numbers(path, block, dialect, wanted, header)

    def cells() -> Iterator[tuple[int, list[str]]]:
        for block in data():
            for row, line in zip(block.rows, block.text, strict=True):
                found = dialect.cells(line, f"{path}, row {row}")
                while len(found) > len(header) and not found[-1]:
                    found.pop()
                if len(found) > len(header):
                    text = f"at most {len(header)}, as in the header"
                    raise InputError(f"{path}, row {row}", f"{len(found)} cells", text)
                # Spreadsheets drop blank cells at the end of a row.
                yield row, found + [""] * (len(header) - len(found))

    _once(f"{path}, row {first.rows[0]} (header)", header)
    return Sheet(path, first.rows[0], header, values, cells, dialect, skip + 1)


def open_csv(path: Path, source: Source) -> Sheet:
    """A delimited table: header, perhaps a row of units, rows.

    Raises
    ------
    InputError
        For a file without header, an unclosed quote, an ambiguous number, a column twice.
    """
    first = head(path, source.encoding, ("#", "%", "!"))
    dialect = sniff(path, first, source.delimiter, source.decimal, source.thousands)
    header = dialect.cells(first.text[0], f"{path}, row {first.rows[0]}")
    while header and not header[-1]:
        header.pop()
    if not header or "" in header:
        raise InputError(f"{path}, row {first.rows[0]} (header)", "a column without a name", "a name for every column")
    skip = first.rows[0]
    if source.units_row:
        if len(first.text) < 2:
            raise InputError(f"{path}, row {first.rows[0] + 1}", "nothing", "a row of units: units_row is true")
        skip = first.rows[1]
        given = dialect.cells(first.text[1], f"{path}, row {skip}")
        if len(given) != len(header):
            raise InputError(f"{path}, row {skip}", f"{len(given)} units", f"{len(header)}, one a column")
        header = [f"{name} [{unit.strip('[]()')}]" if unit else name for name, unit in zip(header, given, strict=True)]
    return _text_sheet(path, source, dialect, header, first, skip)


def open_columns(path: Path, source: Source) -> Sheet:
    """A file of white-space columns below a header of free text.

    The columns are those of ``names``, or those of the line that ``header_pattern`` finds.
    Data start at the first line below that holds a number in every column.

    Raises
    ------
    InputError
        When neither is declared, no line fits, or no line of numbers follows.
    """
    first = head(path, source.encoding)
    dialect = Dialect(source.delimiter or " ", source.decimal or ".", source.thousands)
    if source.names:
        header, at = source.names, -1
    elif source.header_pattern:
        pattern = re.compile(source.header_pattern)
        at = next((i for i, line in enumerate(first.text) if pattern.search(line)), -1)
        if at < 0:
            raise InputError(str(path), "no line in the first 200 fits header_pattern", repr(source.header_pattern))
        header = header_names(first.text[at])
    else:
        text = "names = [...] or header_pattern = '...' in [[source]], see docs/readers.md"
        raise InputError(str(path), "columns without declared names", text)
    for row, line in list(zip(first.rows, first.text, strict=True))[at + 1 :]:
        cells = dialect.cells(line, f"{path}, row {row}") if dialect.delimiter == " " else line.split(dialect.delimiter)
        if len(cells) == len(header) and all(dialect.number(c) is not None for c in cells):
            lines = Lines([first.rows[max(at, 0)]], [first.text[max(at, 0)]])
            return _text_sheet(path, source, dialect, header, lines, row - 1)
    found = f"no line with {len(header)} numbers in the first {len(first.text)}"
    raise InputError(str(path), found, f"numbers for {', '.join(header)[:200]}")


def header_names(line: str) -> list[str]:
    """Column names of a header line: split at tabs or two blanks, else at single blanks."""
    text = line.strip().lstrip("#%!").strip()
    wide = [c.strip() for c in re.split(r"\t|\s{2,}", text) if c.strip()]
    if len(wide) > 1:
        return wide
    return re.findall(r"[^\s\[(]+(?:\s?[\[(][^\])]*[\])])?", text)


def open_parquet(path: Path, source: Source) -> Sheet:
    """A Parquet table; headers carry units as in a CSV file.

    Raises
    ------
    InputError
        For a file that is not Parquet or is cut short.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    bad = (pa.ArrowException, OSError, ValueError, MemoryError, OverflowError)

    def refused(error: Exception) -> InputError:
        return InputError(str(path), f"not a Parquet table: {str(error)[:120]}", "a whole Parquet file")

    try:
        with pq.ParquetFile(path) as opened:
            header = [str(n) for n in opened.schema_arrow.names]
    except bad as error:
        raise refused(error) from error
    _once(f"{path} (schema)", header)

    def batches(names: list[str]) -> Iterator[tuple[int, Any]]:
        row = 1
        try:
            with pq.ParquetFile(path) as opened:
                for batch in opened.iter_batches(batch_size=_BATCH, columns=names):
                    yield row, batch
                    row += batch.num_rows
        except bad as error:
            raise refused(error) from error

    def values(wanted: list[int]) -> Iterator[Array]:
        names = [header[i] for i in wanted]
        for row, batch in batches(names):
            columns = []
            for name in names:
                array = pd.to_numeric(batch.column(name).to_pandas(), errors="coerce").to_numpy(dtype=float)
                fail = np.flatnonzero(~(np.abs(array) <= LARGEST))
                if fail.size:
                    place = f"{path}, row {row + int(fail[0])}, column {name[:60]}"
                    shown = repr(batch.column(name)[int(fail[0])].as_py())[:60]
                    raise InputError(place, shown, f"a finite number of at most {LARGEST:g}")
                columns.append(array)
            yield np.stack(columns, axis=1)

    def cells() -> Iterator[tuple[int, list[str]]]:
        for row, batch in batches(header):
            columns = [batch.column(name).to_pylist() for name in header]
            for i, found in enumerate(zip(*columns, strict=True)):
                yield row + i, ["" if c is None else c if isinstance(c, str) else repr(c) for c in found]

    return Sheet(path, 0, header, values, cells, Dialect())


OPENERS = {"table": open_csv, "starccm": open_csv, "columns": open_columns, "parquet": open_parquet}


def position(sheet: Sheet, name: str) -> int:
    """Where a column of ``[[source.subtract]]`` stands, by its whole header or the header without its unit.

    Raises
    ------
    InputError
        When there is none.
    """
    for names in (sheet.header, [split(h)[0] for h in sheet.header]):
        if name in names:
            return names.index(name)
    shown = ", ".join(sheet.header)[:200]
    raise InputError(sheet.where, f"no column {name[:60]!r}, which [[source.subtract]] names", shown)


def columns_of(sheet: Sheet, source: Source, text: tuple[str, ...]) -> list[Column | None]:
    """What every column of a sheet is; None for ignored and text columns.

    Parameters
    ----------
    sheet : The open table.
    source : Its ``columns``, ``patterns`` and ``ignore``; columns of ``subtract`` are passed over.
    text : Names of the text columns of a run table.

    Raises
    ------
    InputError
        For an unknown column or unit, a pattern that fits no or several columns, or two
        columns of one quantity.
    """
    by_pattern = _by_pattern(sheet, source)
    parts = {position(sheet, name) for one in source.subtract for name in one.columns}
    found: list[Column | None] = []
    for i, header in enumerate(sheet.header):
        name = split(header)[0]
        declared = by_pattern.get(header) or source.columns.get(header) or source.columns.get(name)
        if i in parts:
            if declared is not None:
                found_twice = f"column {header[:60]!r} in [[source.subtract]] and in [source.columns] or patterns"
                raise InputError(sheet.where, found_twice, "one of the two")
            found.append(None)
        elif (
            declared is None
            and (source.patterns or any(fnmatch.fnmatchcase(h, p) for h in (header, name) for p in source.ignore))
        ) or (declared or header) in text:
            found.append(None)
        else:
            found.append(column(header, declared, sheet.where))
    for key in source.columns:
        if key not in sheet.header and key not in [split(h)[0] for h in sheet.header]:
            shown = ", ".join(sheet.header)[:200]
            raise InputError(sheet.where, f"no column {key[:60]!r}, which [source.columns] names", shown)
    quantities = [c.quantity for c in found if c]
    for quantity in quantities:
        if quantities.count(quantity) > 1:
            raise InputError(sheet.where, f"{quantity} stands twice", "one column a quantity")
    return found


def _by_pattern(sheet: Sheet, source: Source) -> dict[str, str]:
    """Header -> declared quantity, by the regular expressions of ``patterns``."""
    if not (source.patterns or source.columns) and any(re.search(r"\bMonitor\b", h) for h in sheet.header):
        text = "a table [source.patterns] that names the monitors, see docs/readers.md"
        raise InputError(sheet.where, "monitors without names", text)
    found: dict[str, str] = {}
    for pattern, quantity in source.patterns.items():
        fits = [h for h in sheet.header if re.search(pattern, h)]
        if len(fits) != 1 or fits[0] in found:
            shown = ", ".join(repr(h[:60]) for h in (fits or sheet.header)[:8])
            number = "no column fits" if not fits else "more than one fit"
            raise InputError(sheet.where, f"{number} pattern {pattern!r}", f"one column a pattern; here: {shown}")
        found[fits[0]] = quantity
    return found


def run_cells(sheet: Sheet) -> tuple[pd.DataFrame, list[int]]:
    """A table of runs as text, with the file row of each.

    Raises
    ------
    InputError
        When there is no row, or so many that it is a time history.
    """
    rows, cells = [], []
    for row, found in sheet.cells():
        rows.append(row)
        cells.append(found)
        if len(rows) > _MOST_RUNS:
            text = f"at most {_MOST_RUNS} runs; a time history is declared with rows = 'history'"
            raise InputError(f"{sheet.path}, row {row}", "more rows", text)
    if not rows:
        raise InputError(str(sheet.path), "no runs", "at least one row below the header")
    return pd.DataFrame(cells, columns=sheet.header, dtype=str), rows
