"""What a worksheet of Excel 97 to 2003 (xls) stores beside its values, from the records of its stream.

Container: [MS-CFB] Compound File Binary; records: [MS-XLS] Excel Binary File Format, sections 2.4.28
BoundSheet8, 2.4.24 BoolErr, 2.4.127 Formula, 2.5.133 FormulaValue, 2.4.221 Row.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

_FREE = 0xFFFFFFFA
_SHEET, _END, _FORMULA, _BOOL_ERROR, _ROW = 0x0085, 0x000A, 0x0006, 0x0205, 0x0208
_HIDDEN = 0x20
# FormulaValue: what a result is that is no number.
_IS_ERROR, _IS_BLANK = 2, 3
_ERRORS = {0x00: "#NULL!", 0x07: "#DIV/0!", 0x0F: "#VALUE!", 0x17: "#REF!", 0x1D: "#NAME?", 0x24: "#NUM!", 0x2A: "#N/A"}
Cells = dict[tuple[int, int], str]


def stored_records(path: Path, sheet: str) -> tuple[Cells, set[tuple[int, int]], set[int]]:
    """Cells that show an error, formulas without a result, and hidden rows of a worksheet, counted from 1.

    Nothing for a file whose stream cannot be followed: what reads its values says what is wrong with it.
    """
    errors: Cells = {}
    bare: set[tuple[int, int]] = set()
    hidden: set[int] = set()
    try:
        stream = _workbook(path.read_bytes())
        at = _offset(stream, sheet)
        for kind, body in _records(stream, at) if at else ():
            if kind == _END:
                break
            if kind == _ROW and struct.unpack_from("<H", body, 12)[0] & _HIDDEN:
                hidden.add(struct.unpack_from("<H", body)[0] + 1)
            elif kind == _BOOL_ERROR and body[7]:
                row, column = struct.unpack_from("<2H", body)
                errors[row + 1, column + 1] = _ERRORS.get(body[6], "#ERROR!")
            elif kind == _FORMULA and body[12:14] == b"\xff\xff":
                row, column = struct.unpack_from("<2H", body)
                if body[6] == _IS_ERROR:
                    errors[row + 1, column + 1] = _ERRORS.get(body[8], "#ERROR!")
                elif body[6] == _IS_BLANK:
                    bare.add((row + 1, column + 1))
    except (struct.error, IndexError, ValueError):
        return {}, set(), set()
    return errors, bare, hidden


def _records(stream: bytes, at: int) -> Iterator[tuple[int, bytes]]:
    while at + 4 <= len(stream):
        kind, size = struct.unpack_from("<2H", stream, at)
        yield kind, stream[at + 4 : at + 4 + size]
        at += 4 + size


def _offset(stream: bytes, sheet: str) -> int:
    """Where the records of a worksheet begin; 0 where there is none of this name."""
    for kind, body in _records(stream, 0):
        if kind == _END:
            break
        if kind == _SHEET and len(body) >= 8:
            name = body[8:].decode("utf-16-le" if body[7] & 1 else "latin-1", "replace")
            if name[: body[6]] == sheet:
                return int(struct.unpack_from("<I", body)[0])
    return 0


def _workbook(data: bytes) -> bytes:
    """The stream Workbook of a compound file."""
    size = 1 << struct.unpack_from("<H", data, 30)[0]

    def sector(number: int) -> bytes:
        return data[(number + 1) * size : (number + 2) * size]

    tables = list(struct.unpack_from("<109I", data, 76))
    more = struct.unpack_from("<I", data, 68)[0]
    while more < _FREE and len(tables) <= len(data) // size:
        listed = struct.unpack(f"<{size // 4}I", sector(more))
        tables, more = [*tables, *listed[:-1]], listed[-1]
    table = [n for t in tables if t < _FREE for n in struct.unpack(f"<{size // 4}I", sector(t))]

    def chain(number: int) -> bytes:
        pieces: list[bytes] = []
        while number < _FREE and len(pieces) <= len(table):
            pieces.append(sector(number))
            number = table[number]
        return b"".join(pieces)

    directory = chain(struct.unpack_from("<I", data, 48)[0])
    for at in range(0, len(directory), 128):
        entry = directory[at : at + 128]
        name = entry[: max(struct.unpack_from("<H", entry, 64)[0] - 2, 0)].decode("utf-16-le", "replace")
        if name in ("Workbook", "Book"):
            return chain(struct.unpack_from("<I", entry, 116)[0])[: struct.unpack_from("<I", entry, 120)[0]]
    return b""
