"""Text files in bounded memory: lines with their row numbers, numbers, and where they fail."""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sim.errors import InputError

Array = NDArray[np.float64]

# Larger numbers are slips of the pen, and their powers leave the floating-point range.
LARGEST = 1e15
# Bytes read at once, and the longest line that is still a line of numbers.
_CHUNK = 1 << 20
_LONGEST = 1 << 18
_HEAD = 200
# Before version 3, pandas rounded the last digit unless told not to.
_EXACT: dict[str, Any] = {} if int(pd.__version__.split(".")[0]) >= 3 else {"float_precision": "round_trip"}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,3})?", re.ASCII)
ENCODINGS = ("utf-8", "latin-1")
COMMENTS = ("#", "%", "!")


@dataclass(frozen=True)
class Lines:
    """Consecutive lines of a file.

    Attributes
    ----------
    rows : File row (from 1) of each line.
    text : The lines, without their ends.
    """

    rows: list[int]
    text: list[str]


def _decoded(path: Path, encoding: str) -> Iterator[str]:
    """The text of a file, a megabyte at a time."""
    import codecs

    decoder = codecs.getincrementaldecoder("utf-8-sig" if encoding == "utf-8" else encoding)()
    at = 0
    try:
        with path.open("rb") as stream:
            while chunk := stream.read(_CHUNK):
                try:
                    text = decoder.decode(chunk)
                except UnicodeDecodeError as error:
                    place = f"{path}, byte {at + error.start + 1}"
                    allowed = 'UTF-8 text, or encoding = "latin-1" in [[source]]'
                    raise InputError(place, f"not {encoding} text", allowed) from error
                if "\0" in text:
                    raise InputError(f"{path}, byte {at + 1} or after", "a zero byte: not a text file", "text")
                at += len(chunk)
                yield text
            try:
                yield decoder.decode(b"", final=True)
            except UnicodeDecodeError as error:
                raise InputError(f"{path}, last byte", f"not {encoding} text", "text that is not cut short") from error
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror}", "a readable file") from error


def blocks(path: Path, encoding: str = "utf-8", comments: tuple[str, ...] = COMMENTS) -> Iterator[Lines]:
    """The lines of a file that are neither blank nor comments, about a megabyte at a time.

    Parameters
    ----------
    path : The file.
    encoding : One of ``ENCODINGS``; a byte order mark is taken off.
    comments : What a comment line starts with.

    Raises
    ------
    InputError
        For a file that cannot be read, is not text, or has a line without end.
    """
    row, rest = 1, ""
    for text in itertools.chain(_decoded(path, encoding), [None]):
        if text is not None:
            # A lone carriage return at the end may be half of a line end.
            whole = rest + text
            half = "\r" if whole.endswith("\r") else ""
            found = whole.removesuffix("\r").replace("\r\n", "\n").replace("\r", "\n").split("\n")
            rest = found.pop() + half
        else:
            found = [rest.removesuffix("\r")] if rest.strip() else []
            rest = ""
        if len(rest) > _LONGEST or any(len(line) > _LONGEST for line in found):
            raise InputError(
                f"{path}, row {row} or after", f"a line of more than {_LONGEST} characters", "shorter lines"
            )
        kept = [
            (row + i, line) for i, line in enumerate(found) if line.strip() and not line.lstrip().startswith(comments)
        ]
        row += len(found)
        if kept:
            yield Lines([r for r, _ in kept], [line for _, line in kept])


def head(path: Path, encoding: str = "utf-8", comments: tuple[str, ...] = ()) -> Lines:
    """The first lines of a file, comments included unless ``comments`` names them."""
    rows: list[int] = []
    text: list[str] = []
    for block in blocks(path, encoding, comments or ("\0",)):
        rows += block.rows
        text += block.text
        if len(rows) >= _HEAD:
            break
    return Lines(rows[:_HEAD], text[:_HEAD])


@dataclass(frozen=True)
class Dialect:
    """How the cells of a table are written.

    Attributes
    ----------
    delimiter : ``,``, ``;``, a tab, or a blank for any run of white space.
    decimal : ``.`` or ``,``.
    thousands : ``.``, ``,``, ``'`` or a blank between groups of three digits; empty for none.
    """

    delimiter: str = ","
    decimal: str = "."
    thousands: str = ""

    def cells(self, line: str, where: str) -> list[str]:
        """The cells of one line.

        Raises
        ------
        InputError
            When a quote is opened and not closed.
        """
        if self.delimiter == " ":
            return line.split()
        try:
            found = next(csv.reader([line], delimiter=self.delimiter, strict=True, skipinitialspace=True))
        except csv.Error as error:
            raise InputError(where, f"not a row of cells: {error}", "quotes that are closed in the same row") from error
        return [cell.strip() for cell in found]

    def number(self, cell: str) -> float | None:
        """A cell as a number, or None when it is not a finite one of at most ``LARGEST``."""
        text = cell.strip()
        if self.thousands and self.thousands in text:
            group, mark = re.escape(self.thousands), re.escape(self.decimal)
            if not re.fullmatch(rf"[+-]?\d{{1,3}}({group}\d{{3}})+({mark}\d*)?", text, re.ASCII):
                return None
            text = text.replace(self.thousands, "")
        if self.decimal != ".":
            if "." in text:
                return None
            text = text.replace(self.decimal, ".")
        if not _NUMBER.fullmatch(text):
            return None
        value = float(text.replace("D", "E").replace("d", "e"))
        return value if abs(value) <= LARGEST else None


def sniff(path: Path, lines: Lines, delimiter: str = "", decimal: str = "", thousands: str = "") -> Dialect:
    """The dialect of a table, from its first lines and what the campaign declares.

    Parameters
    ----------
    path : For the error.
    lines : Header and some rows, without comments.
    delimiter, decimal, thousands : As declared; empty to find out.

    Raises
    ------
    InputError
        When ``1,234`` could be 1234 or 1.234, or when there is no header.
    """
    if not lines.text:
        raise InputError(str(path), "no rows", "a header and rows below it")
    bare = re.sub(r'"[^"]*"', "", lines.text[0])
    if not delimiter:
        counts = {d: bare.count(d) for d in (";", "\t", ",")}
        delimiter = next((d for d, n in counts.items() if n), ",")
    rough = Dialect(delimiter)
    cells = [
        (row, c)
        for row, line in zip(lines.rows[1:], lines.text[1:], strict=True)
        for c in rough.cells(line, f"{path}, row {row}")
        if re.fullmatch(r"[+-]?\d[\d., ']*([eE][+-]?\d+)?", c, re.ASCII) and ("," in c or "." in c)
    ]
    both = next((c for _, c in cells if "," in c and "." in c), None)
    if not decimal:
        decimal = _decimal(path, cells, both, thousands)
    if not thousands and both:
        thousands = "." if decimal == "," else ","
    if thousands == decimal:
        raise InputError(str(path), f"decimal and thousands are both {decimal!r}", "two different marks")
    return Dialect(delimiter, decimal, thousands)


def _decimal(path: Path, cells: list[tuple[int, str]], both: str | None, thousands: str) -> str:
    """The decimal mark that the cells show."""
    if thousands in (",", "."):
        return "." if thousands == "," else ","
    if both:
        return max(".,", key=both.rfind)
    commas = [(row, c) for row, c in cells if "," in c]
    if not commas or any("." in c for _, c in cells):
        return "."
    if all(re.fullmatch(r"[+-]?[1-9]\d{0,2}(,\d{3})+", c) for _, c in commas):
        row, cell = commas[0]
        text = 'decimal = "," or thousands = "," in [[source]]: it could be either'
        raise InputError(f"{path}, row {row}", repr(cell), text)
    return ","


def numbers(path: Path, block: Lines, dialect: Dialect, wanted: list[int], names: list[str]) -> Array:
    """The wanted columns of some rows as finite numbers.

    Parameters
    ----------
    path : For the error.
    block : The rows.
    dialect : How they are written.
    wanted : Positions of the columns.
    names : Header of every column, for their number and for the error.

    Returns
    -------
    (rows, wanted).

    Raises
    ------
    InputError
        Naming row and column of the first cell that is not a finite number.
    """
    if dialect.thousands == "":
        kind: dict[int, type] = {i: np.float64 if i in wanted else str for i in range(len(names))}
        try:
            frame = pd.read_csv(
                io.StringIO("\n".join(block.text)),
                sep=r"\s+" if dialect.delimiter == " " else dialect.delimiter,
                decimal=dialect.decimal,
                header=None,
                dtype=kind,
                skipinitialspace=True,
                keep_default_na=False,
                skip_blank_lines=False,
                **_EXACT,
            )
        except (ValueError, OverflowError):
            frame = None
        if frame is not None and frame.shape == (len(block.text), len(names)):
            values = frame[wanted].to_numpy(dtype=float)
            if np.isfinite(values).all() and np.abs(values).max(initial=0.0) <= LARGEST:
                return values
    return _one_by_one(path, block, dialect, wanted, names)


def _one_by_one(path: Path, block: Lines, dialect: Dialect, wanted: list[int], names: list[str]) -> Array:
    """The same cell by cell, to read what pandas does not and to name the cell that fails."""
    values = np.empty((len(block.text), len(wanted)))
    for i, (row, line) in enumerate(zip(block.rows, block.text, strict=True)):
        cells = dialect.cells(line, f"{path}, row {row}")
        while len(cells) > len(names) and not cells[-1]:
            cells.pop()
        if len(cells) > len(names) or len(cells) <= max(wanted):
            raise InputError(f"{path}, row {row}", f"{len(cells)} cells", f"{len(names)} cells, as in the header")
        for j, column in enumerate(wanted):
            value = dialect.number(cells[column])
            if value is None:
                place = f"{path}, row {row}, column {names[column][:60]}"
                found = repr(cells[column][:60]) if cells[column] else "nothing"
                raise InputError(place, found, f"a finite number of at most {LARGEST:g}")
            values[i, j] = value
    return values
