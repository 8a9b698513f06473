"""Whether the elements of a MATLAB file of version 5 to 7 fit into each other, before a library takes them as they are.

Tags, classes and alignment: MathWorks, "MAT-File Format", 2024, chapter 1, tables 1-1 to 1-3.
"""

from __future__ import annotations

import math
import struct
import zlib

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_TYPES = {*range(1, 8), 9, *range(12, 19)}
_CLASSES = range(1, 18)
_CELL, _STRUCT, _CHARACTERS, _SPARSE = 1, 2, 4, 5
# Object, function and opaque: their parts are not laid open.
_OTHERS = (3, 16, 17)
_COMPLEX = 0x800
# Deeper than that no struct is.
_DEPTH = 50


def damaged(data: bytes) -> str:
    """What is wrong with the elements of a file, in words; empty where nothing is.

    Parameters
    ----------
    data : The whole file.

    Examples
    --------
    >>> damaged(bytes(124) + b"\\x00\\x01IM" + b"\\x63\\x00\\x00\\x00\\x08\\x00\\x00\\x00" + bytes(8))
    'an element of type 99 at byte 128'
    """
    order = ">" if data[126:128] == b"MI" else "<"
    try:
        _elements(data, _HEADER, len(data), order, 0)
    except (struct.error, zlib.error, ValueError) as error:
        return str(error)
    return ""


def _elements(data: bytes, at: int, end: int, order: str, depth: int) -> list[tuple[int, int, int]]:
    """Type, first byte and size of the elements of a stretch; ValueError for what does not fit."""
    if depth > _DEPTH:
        raise ValueError("structs without end")
    found = []
    while at + 8 <= end:
        kind, size = struct.unpack_from(f"{order}2I", data, at)
        begin, after = at + 8, at + 8 + size + (-size % 8 if kind != _COMPRESSED else 0)
        if kind >> 16:
            # A small element: its size, type and data in eight bytes.
            kind, size, begin, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        if kind not in _TYPES:
            raise ValueError(f"an element of type {kind} at byte {at}")
        if begin + size > end:
            raise ValueError(f"an element of {size} bytes at byte {at}, and {end - begin} are left")
        if kind == _COMPRESSED:
            inside = zlib.decompress(data[begin : begin + size])
            _elements(inside, 0, len(inside), order, depth + 1)
        elif kind == _MATRIX and size:
            _variable(data, begin, begin + size, order, depth)
        found.append((kind, begin, size))
        at = after
    return found


def _variable(data: bytes, begin: int, end: int, order: str, depth: int) -> None:
    """Whether a variable has the parts of its class: flags, sizes, name, and values after it."""
    parts = _elements(data, begin, end, order, depth + 1)
    if not parts or parts[0][2] != 8:
        raise ValueError(f"a variable without flags at byte {begin}")
    flags = struct.unpack_from(f"{order}I", data, parts[0][1])[0]
    kind, wide = flags & 0xFF, 1 + bool(flags & _COMPLEX)
    if kind not in _CLASSES:
        raise ValueError(f"a variable of class {kind} at byte {begin}")
    if kind in _OTHERS or len(parts) < 3:
        return
    sizes = struct.unpack_from(f"{order}{parts[1][2] // 4}i", data, parts[1][1])
    expected = {_CELL: 3 + math.prod(sizes), _CHARACTERS: 4, _SPARSE: 5 + wide}.get(kind, 3 + wide)
    if kind == _STRUCT and len(parts) >= 5:
        longest = struct.unpack_from(f"{order}i", data, parts[3][1])[0]
        expected = 5 + math.prod(sizes) * (parts[4][2] // longest if longest > 0 else 0)
    if len(parts) != expected:
        raise ValueError(f"a variable of {len(parts)} parts at byte {begin}, and {expected} belong to it")
