"""Workbooks of Excel (xlsx, xlsm, xlsb, xls) and OpenDocument (ods), by the library python-calamine."""

from __future__ import annotations

import datetime
import zipfile
from pathlib import Path
from typing import Any

from ident.captive.patterns import search
from ident.captive.readers.arrays import array_sheet, chosen, needs
from ident.captive.readers.sheet import Sheet, ignored
from ident.captive.readers.stored_cells import Stored, stored_cells
from ident.captive.readers.text import Dialect
from ident.captive.source import Source
from sim.files.errors import InputError

_PASSWORD = "EncryptedPackage".encode("utf-16-le")
# Bytes of a file that is looked through for it.
_HEAD = 1 << 26


def open_workbook(path: Path, source: Source) -> Sheet:
    """One worksheet: titles of one cell, the first row of names, perhaps a row of units, rows of cells.

    ``table`` names the worksheet where several hold cells, ``header_pattern`` finds the row of names
    (its cells joined by tabs) below a title, ``skip`` leaves out rows, ``units_row`` reads a row of units.

    Raises
    ------
    InputError
        For a file that is no workbook, a worksheet that is not there, or one without a row of names.
    """
    calamine = needs("python_calamine", "readers", path, "a workbook")
    try:
        book = calamine.CalamineWorkbook.from_path(str(path))
        sheets = {name: book.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in _visible(book)}
    except BaseException as error:
        # A panic of the library's own language is no Exception.
        panic = type(error).__name__ == "PanicException"
        if not panic and not isinstance(error, (calamine.CalamineError, OSError, ValueError)):
            raise
        if "password" in str(error).lower():
            raise InputError(str(path), "a workbook with a password", "the workbook saved without one") from error
        if inside := _inside(path):
            wrong = f"a zip archive of {inside}, and no workbook of that ending"
            raise InputError(
                str(path), wrong, "its files unpacked, or gzip; a workbook as xlsx, xlsb or ods"
            ) from error
        with path.open("rb") as stream:
            if _PASSWORD in stream.read(_HEAD):
                wrong = "a workbook with a password"
                raise InputError(str(path), wrong, "the workbook saved without one") from error
        raise InputError(str(path), f"not a workbook: {str(error)[:100]}", "a whole xlsx, xls, xlsb or ods") from error
    filled = [name for name, rows in sheets.items() if any(_filled(row) for row in rows)]
    name = chosen(path, filled, source, "worksheet")
    return _sheet(path, name, sheets[name], source)


def _inside(path: Path) -> str:
    """The first files of a zip archive, in words; empty for a workbook, and for a file that is none or is damaged."""
    try:
        with zipfile.ZipFile(path) as packed:
            names = packed.namelist()
            return "" if {"xl/workbook.xml", "content.xml"} & set(names) else ", ".join(names[:3])[:100]
    except (zipfile.BadZipFile, OSError, ValueError, RuntimeError):
        return ""


def _visible(book: Any) -> list[str]:
    return [str(n) for n in book.sheet_names]


def _filled(row: list[Any]) -> bool:
    return any(cell not in (None, "") for cell in row)


def _sheet(path: Path, name: str, rows: list[list[Any]], source: Source) -> Sheet:
    where = f"{path}, worksheet {name!r}"
    numbered = [(i, row) for i, row in enumerate(rows, start=1) if _filled(row)]
    # A row of one cell above a table of several columns is its title.
    at = next((k for k, (_, row) in enumerate(numbered) if sum(c not in (None, "") for c in row) > 1), 0)
    if source.header_pattern:
        at = next((k for k, (_, row) in enumerate(numbered) if search(source.header_pattern, _joined(row))), -1)
        if at < 0:
            raise InputError(where, "no row fits header_pattern", repr(source.header_pattern))
    top, names = numbered[at][0], [_text(cell) for cell in numbered[at][1]]
    body = numbered[at + 1 :]
    if source.units_row:
        if not body:
            raise InputError(f"{where}, row {top + 1}", "nothing", "a row of units: units_row is true")
        units = [_text(cell).strip("[]()") for cell in body[0][1]]
        names = [f"{n} [{u}]" if u else n for n, u in zip(names, units, strict=False)]
        body = body[1:]
    if source.skip:
        body = [(i, row) for i, row in body if not search(source.skip, _joined(row))]
    kept = [k for k, n in enumerate(names) if n]
    for k in range(max((len(row) for _, row in body), default=0)):
        if (k >= len(names) or not names[k]) and any(len(r) > k and r[k] not in (None, "") for _, r in body):
            named = f"column {k + 1}"
            if not ignored(named, source):
                text = f'a name for every column; ignore = ["{named}"], or header_pattern below a title, in [[source]]'
                raise InputError(f"{where}, row {top}", f"a column without a name ({named})", text)
            names += [""] * (k + 1 - len(names))
            names[k] = named
            kept = sorted({*kept, k})
    if not kept or not body:
        raise InputError(where, "no names with rows below them", "a row of names, and header_pattern below a title")
    stored = stored_cells(path, name)
    _refuse_unstored(stored, where, body, {k: names[k] for k in kept if not ignored(names[k], source)})
    columns = [
        [stored.errors.get((i, k + 1), _cell(row[k]) if len(row) > k else None) for i, row in body] for k in kept
    ]
    if source.decimal or source.thousands:
        columns = _of_text(columns, where, source)
    return array_sheet(path, [names[k] for k in kept], columns, source, [i for i, _ in body])


def _refuse_unstored(stored: Stored, where: str, body: list[tuple[int, list[Any]]], names: dict[int, str]) -> None:
    """Refuse rows that are hidden, and formulas whose result is not in the file: they would read as blank or zero."""
    for i, _ in body:
        if i in stored.hidden:
            text = "rows that are shown, or deleted; or skip in [[source]] for what its cells begin with"
            raise InputError(f"{where}, row {i}", "a hidden row", text)
        bare = next((name for k, name in names.items() if (i, k + 1) in stored.bare), None)
        if bare is not None:
            text = "results stored with their formulas: open the file in Excel or LibreOffice and save it"
            raise InputError(f"{where}, row {i}, column {bare[:60]}", "a formula without its result", text)


def _of_text(columns: list[list[Any]], where: str, source: Source) -> list[list[Any]]:
    """Columns whose numbers may be stored as text, in the stated decimal mark."""
    dialect = Dialect(decimal=source.decimal or ".", thousands=source.thousands)
    read = [[dialect.number(cell) if isinstance(cell, str) else None for cell in column] for column in columns]
    if all(value is None for column in read for value in column):
        raise InputError(where, "decimal or thousands, and no number that is stored as text", "neither of these keys")
    pairs = zip(columns, read, strict=True)
    return [[cell if v is None else v for cell, v in zip(column, values, strict=True)] for column, values in pairs]


def _joined(row: list[Any]) -> str:
    return "\t".join(_text(cell) for cell in row)


def _text(cell: Any) -> str:
    cell = _cell(cell)
    return "" if cell is None else str(cell).strip()


def _cell(cell: Any) -> Any:
    """Dates and times as text that the time column understands; blanks as nothing."""
    if cell is None or cell == "":
        return None
    if isinstance(cell, datetime.datetime):
        return cell.isoformat(sep="T", timespec="microseconds")
    if isinstance(cell, datetime.date):
        # A date without a time is its midnight.
        return f"{cell.isoformat()}T00:00:00"
    if isinstance(cell, datetime.time):
        return cell.isoformat(timespec="microseconds")
    if isinstance(cell, datetime.timedelta):
        return cell.total_seconds()
    return cell
