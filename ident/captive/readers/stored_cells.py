"""What a worksheet stores beside its values: formulas without a result, errors, hidden rows (xlsx, xlsm, xls, ods)."""

from __future__ import annotations

import html
import re
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from ident.captive.readers.stored_records import stored_records

# Bytes of a worksheet that is looked through.
_LARGEST = 1 << 28
_LARGEST_TREE = 1 << 26
# Rows of one element that are told apart.
_ROWS = 1 << 20
_CONTENT = "content.xml"
_TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
_OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"
_ERROR = re.compile(r"#(?:DIV/0!|VALUE!|REF!|NAME\?|NUM!|N/A|NULL!)|Err:\d{3}")
_VALUES = ("value", "string-value", "date-value", "time-value", "boolean-value")
_CELL = re.compile(rb'<c r="([A-Z]+)([0-9]+)"([^>]*?)(?:/>|>(.*?)</c>)', re.DOTALL)
_FORMULA = re.compile(rb"<f[\s/>]")
_RESULT = re.compile(rb"<v>\s*([^<\s][^<]*)</v>|<is>")
_ROW = re.compile(rb"<row\s[^>]*>")
_HIDDEN = re.compile(rb'\shidden="(?:1|true)"')
_NUMBER = re.compile(rb'\sr="([0-9]+)"')
_UNDONE = re.compile(rb'<calcPr\b[^>]*\bfullCalcOnLoad="(?:1|true)"')


@dataclass(frozen=True)
class Stored:
    """Row and column of cells, both from 1.

    Attributes
    ----------
    errors : Of a cell whose formula failed: the word that it shows, ``#DIV/0!``.
    bare : Cells of formulas whose result is not in the file.
    hidden : Rows that are hidden, by hand or by a filter.
    """

    errors: dict[tuple[int, int], str] = field(default_factory=dict)
    bare: frozenset[tuple[int, int]] = frozenset()
    hidden: frozenset[int] = frozenset()


def stored_cells(path: Path, sheet: str) -> Stored:
    """What one worksheet of a workbook stores; nothing for xlsb.

    Programs that write workbooks store a formula alone, or zero in the place of its result and that
    everything is to be calculated; Excel and LibreOffice store the results when they save.
    """
    if not zipfile.is_zipfile(path):
        errors, bare, hidden = stored_records(path, sheet)
        return Stored(errors, frozenset(bare), frozenset(hidden))
    try:
        return _of_archive(path, sheet)
    except Exception:
        # Archives fail in many ways: what reads the values says what is wrong with this one.
        return Stored()


def _of_archive(path: Path, sheet: str) -> Stored:
    with zipfile.ZipFile(path) as packed:
        if _CONTENT in packed.namelist():
            small = packed.getinfo(_CONTENT).file_size <= _LARGEST_TREE
            return _of_document(packed.read(_CONTENT), sheet) if small else Stored()
        part = _part(packed, sheet)
        if not part or packed.getinfo(part).file_size > _LARGEST:
            return Stored()
        text, undone = packed.read(part), bool(_UNDONE.search(packed.read("xl/workbook.xml")))
    return _of_excel(text, undone)


def _of_excel(text: bytes, undone: bool) -> Stored:
    errors: dict[tuple[int, int], str] = {}
    bare = set()
    # Most worksheets hold numbers alone.
    for letters, row, attributes, inside in _CELL.findall(text) if b"<f" in text or b't="e"' in text else ():
        column = 0
        for letter in letters:
            column = 26 * column + letter - 64
        result = _RESULT.search(inside)
        if b't="e"' in attributes:
            errors[int(row), column] = (
                result[1].decode("utf-8", "replace").strip() if result and result[1] else "#ERROR!"
            )
        elif _FORMULA.search(inside) and (result is None or (undone and result[1] == b"0")):
            bare.add((int(row), column))
    hidden = {int(n[1]) for tag in _ROW.findall(text) if _HIDDEN.search(tag) and (n := _NUMBER.search(tag))}
    return Stored(errors, frozenset(bare), frozenset(hidden))


def _of_document(text: bytes, sheet: str) -> Stored:
    """The same of an OpenDocument: rows and cells may stand for many, and hold no place of their own."""
    errors: dict[tuple[int, int], str] = {}
    bare = set()
    hidden: set[int] = set()
    for table in ElementTree.fromstring(text).iter(f"{_TABLE}table"):
        row = 0
        for line in table.iter(f"{_TABLE}table-row") if table.get(f"{_TABLE}name") == sheet else ():
            many = int(line.get(f"{_TABLE}number-rows-repeated", "1"))
            if line.get(f"{_TABLE}visibility", "visible") != "visible":
                hidden.update(range(row + 1, row + 1 + min(many, _ROWS)))
            column = 0
            for cell in line:
                wide = int(cell.get(f"{_TABLE}number-columns-repeated", "1"))
                if cell.get(f"{_TABLE}formula") is not None:
                    shown = "".join(cell.itertext()).strip()
                    if _ERROR.fullmatch(shown):
                        errors[row + 1, column + 1] = shown
                    elif not shown and not any(cell.get(f"{_OFFICE}{name}") for name in _VALUES):
                        bare.add((row + 1, column + 1))
                column += wide
            row += many
    return Stored(errors, frozenset(bare), frozenset(hidden))


def _part(packed: zipfile.ZipFile, sheet: str) -> str:
    """Name of the part of a workbook that holds a worksheet; empty where there is none."""
    names = packed.namelist()
    book, relations = "xl/workbook.xml", "xl/_rels/workbook.xml.rels"
    if book not in names or relations not in names:
        return ""
    target = {}
    for tag in re.findall(r"<Relationship\b[^>]*>", packed.read(relations).decode("utf-8", "replace")):
        target[_attribute(tag, "Id")] = _attribute(tag, "Target")
    for tag in re.findall(r"<sheet\b[^>]*>", packed.read(book).decode("utf-8", "replace")):
        if html.unescape(_attribute(tag, "name")) == sheet:
            at = target.get(_attribute(tag, r"\w+:id"), "")
            part = at.lstrip("/") if at.startswith("/") else f"xl/{at}"
            return part if part in names else ""
    return ""


def _attribute(tag: str, name: str) -> str:
    found = re.search(rf"\s{name}\s*=\s*(?:\"([^\"]*)\"|'([^']*)')", tag)
    return (found[1] or found[2] or "") if found else ""
