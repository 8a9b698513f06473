"""Parquet tables, a batch at a time; units from the column names or from the metadata."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.captive.quantities import owner, split, suffixed
from ident.captive.readers.arrays import without_missing
from ident.captive.readers.sheet import Sheet, once
from ident.captive.readers.text import LARGEST, Dialect, odd
from ident.captive.source import Source
from sim.files.errors import InputError

Array = NDArray[np.float64]
_BATCH = 1 << 14
# No name, word or remark of a run is longer [bytes].
LONGEST_CELL = 10_000
_PLAIN = Dialect()
# The index that pandas writes when it has no name.
_INDEX = "__index_level_0__"


def open_parquet(path: Path, source: Source) -> Sheet:
    """A Parquet table; units stand in the column names as in a CSV file, or in the metadata.

    Metadata that are read: ``unit`` or ``units`` of a field, and ``attrs["units"]`` of a pandas table.

    Raises
    ------
    InputError
        For a file that is not Parquet or is cut short, or a column whose type is not one of numbers.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    bad = (pa.ArrowException, OSError, ValueError, MemoryError, OverflowError)

    def refused(error: Exception) -> InputError:
        return InputError(str(path), f"not a Parquet table: {str(error)[:120]}", "a whole Parquet file")

    try:
        with pq.ParquetFile(path) as opened:
            schema = opened.schema_arrow
            _check_sizes(path, opened.metadata)
    except bad as error:
        raise refused(error) from error
    names = [str(n) for n in schema.names]
    header = _with_units(schema, {*source.columns, *(name for one in source.subtract for name in one.columns)})
    once(f"{path} (schema)", header, source)

    def batches(wanted: list[str]) -> Iterator[tuple[int, Any]]:
        row = 1
        try:
            with pq.ParquetFile(path) as opened:
                for batch in opened.iter_batches(batch_size=_BATCH, columns=wanted):
                    yield row, batch
                    row += batch.num_rows
        except bad as error:
            raise refused(error) from error

    def values(wanted: list[int], clock: int = -1) -> Iterator[Array]:
        for row, batch in batches([names[i] for i in wanted]):
            stated = [source if i != clock else None for i in wanted]
            read = [
                _numbers(path, row, header[i], batch.column(names[i]), s) for i, s in zip(wanted, stated, strict=True)
            ]
            yield np.stack(read, axis=1)

    def cells() -> Iterator[tuple[int, list[str]]]:
        for row, batch in batches(names):
            for name in names:
                _check_lengths(path, row, name, batch.column(name))
            columns = [batch.column(name).to_pylist() for name in names]
            for i, row_of_cells in enumerate(zip(*columns, strict=True)):
                yield row + i, ["" if c is None else _written(c) for c in row_of_cells]

    return Sheet(path, 0, header, values, cells, _PLAIN, spacers=(_INDEX,))


def _check_sizes(path: Path, metadata: Any) -> None:
    """Refuse columns whose cells are too long on the average, before any is read. Raises ``InputError``."""
    for group in (metadata.row_group(i) for i in range(metadata.num_row_groups)):
        for column in (group.column(i) for i in range(group.num_columns)):
            # A page of a few cells has a dictionary and a head besides.
            if column.total_uncompressed_size > LONGEST_CELL * (column.num_values + 100):
                place, size = f"{path}, column {column.path_in_schema[:60]}", column.total_uncompressed_size
                wrong = f"{size} bytes in {column.num_values} cells"
                raise InputError(place, wrong, f"cells of {LONGEST_CELL} bytes at most")


def _check_lengths(path: Path, row: int, name: str, array: Any) -> None:
    """Refuse text too long for a cell: a file of kilobytes may hold it in every row. Raises ``InputError``."""
    import pyarrow as pa
    import pyarrow.compute as pc

    text = array.dictionary if pa.types.is_dictionary(array.type) else array
    if not (pa.types.is_string(text.type) or pa.types.is_large_string(text.type)):
        return
    longest = pc.max(pc.binary_length(text)).as_py() or 0
    if longest > LONGEST_CELL:
        place = f"{path}, row {row} or after, column {name[:60]}"
        raise InputError(place, f"a cell of {longest} bytes", f"{LONGEST_CELL} bytes at most")


def _written(cell: Any) -> str:
    """A cell as text; a decimal is the number it prints."""
    from decimal import Decimal

    return cell if isinstance(cell, str) else str(cell) if isinstance(cell, Decimal) else repr(cell)


def _with_units(schema: Any, declared: set[str]) -> list[str]:
    """Column names; those of quantities with the unit of the metadata in brackets where they have none."""
    stored: dict[str, Any] = {}
    try:
        known = json.loads((schema.metadata or {}).get(b"pandas", b"{}")).get("attributes") or {}
        stored = known.get("units") or {}
    except (ValueError, AttributeError):
        stored = {}
    header = []
    for name, field in zip(schema.names, schema, strict=True):
        metadata = field.metadata or {}
        unit = metadata.get(b"unit", metadata.get(b"units", b"")).decode("utf-8", "replace")
        unit = unit or (stored.get(name) if isinstance(stored, dict) else None)
        bare = split(str(name))[1] is None and name not in suffixed() and (name in declared or owner(name.rstrip("'")))
        header.append(f"{name} [{unit.strip()}]" if bare and isinstance(unit, str) and unit.strip() else str(name))
    return header


def _numbers(path: Path, row: int, name: str, array: Any, source: Source | None) -> Array:
    """One column of a batch as finite numbers; NaN where ``source`` states one to be missing."""
    import pyarrow as pa

    if pa.types.is_dictionary(array.type):
        array = array.dictionary_decode()
    kind = array.type
    if pa.types.is_integer(kind) or pa.types.is_floating(kind):
        values = array.to_pandas().to_numpy(dtype=float, na_value=np.nan)
    elif pa.types.is_decimal(kind) or pa.types.is_string(kind) or pa.types.is_large_string(kind):
        read = (None if c is None else _PLAIN.number(_written(c)) for c in array.to_pylist())
        values = np.array([np.nan if v is None else v for v in read])
    else:
        raise InputError(f"{path}, column {name[:60]}", f"a column of {kind}", "a column of numbers")
    lost = np.zeros(len(values), dtype=bool)
    if source is not None:
        values, lost = without_missing(values, lost, source)
    fail = np.flatnonzero(~(np.abs(values) <= LARGEST) & ~lost)
    if fail.size:
        place = f"{path}, row {row + int(fail[0])}, column {name[:60]}"
        shown = repr(array[int(fail[0])].as_py())[:60]
        text = f"a finite number of at most {LARGEST:g}{odd('NaN') if np.isnan(values[fail[0]]) else ''}"
        raise InputError(place, shown, text)
    return values
