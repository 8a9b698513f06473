"""Text files in bounded memory: lines with their row numbers, numbers, and where they fail."""

from __future__ import annotations

import bz2
import csv
import gzip
import io
import itertools
import lzma
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, cast, get_args

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.patterns import compiled
from ident.captive.quantities import known_unit
from ident.captive.readers.times import FORMS, Clocks
from ident.captive.readers.unread import BEGINNING, unread
from ident.captive.source import Encoding
from sim.files.errors import InputError

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
ENCODINGS = get_args(Encoding)
COMMENTS = ("#", "%", "!", "//")
_PACKED: dict[bytes, Any] = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ": lzma.open}
# A file that begins so says its encoding itself, or is no text.
_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
# Blanks that tools put between groups of digits, dashes of typesetting for minus, full-width signs and digits.
_SPELLED = str.maketrans(
    {
        **dict.fromkeys("\u00a0\u202f\u2009", " "),
        **dict.fromkeys("\u2212\u2013\u2010\u2011\ufe63\uff0d", "-"),
        "\u2019": "'",
        "\uff0b": "+",
        "\uff0e": ".",
        "\uff0c": ",",
        **{chr(0xFF10 + i): str(i) for i in range(10)},
    }
)
# A minus behind the number, as ledgers print it; (8.0) of accountants is read by ``bracketed``.
_BEHIND = re.compile(r"(\d[\d.,' ]*(?:[eEdD][+-]?\d{1,3})?)-")
# What loggers and spreadsheets write where they have no number; one too large to be a number of a load among it.
_NOTHING = re.compile(
    r"(?i)|#?n\.?/?a\.?|#?nan|null|none|nil|missing|[-\u2013\u2014.*?x]+|ol|ovl|over\w*|[-+]?inf(inity)?"
    r"|#(div/0|value|wert|ref|bezug|num|zahl|nv|name)[!?]?|[-+]?1\.#\w+|[-+]?[\d.]+e\+?\d{2,3}"
)
# What a row without any cell is made of: spreadsheets write their empty rows so; DOS ends with ctrl-Z.
_EMPTY = ' \t\r\f\v,;"\x1a'


@dataclass(frozen=True)
class Lines:
    """Consecutive lines of a file.

    Attributes
    ----------
    rows : File row (from 1) of each line.
    text : The lines, without their ends.
    ended : False when the last of them has no line end: it may be cut short.
    """

    rows: list[int]
    text: list[str]
    ended: bool = True


def packed(path: Path) -> bool:
    """Whether a file is a gzip, bzip2 or xz archive."""
    with path.open("rb") as stream:
        return stream.read(6).startswith(tuple(_PACKED))


def opened(path: Path) -> IO[bytes]:
    """A file to read, unpacked where it is a gzip, bzip2 or xz archive."""
    with path.open("rb") as stream:
        start = stream.read(6)
    opener = next((o for mark, o in _PACKED.items() if start.startswith(mark)), None)
    return cast(IO[bytes], opener(path, "rb")) if opener else path.open("rb")


def _decoded(path: Path, encoding: str) -> Iterator[str]:
    """The text of a file, a megabyte at a time."""
    import codecs

    at = 0
    try:
        with opened(path) as stream:
            start = stream.read(BEGINNING)
            stream.seek(0)
            if kind := unread(start):
                raise InputError(str(path), kind, "the sheet or the channels saved as CSV, or Parquet")
            marked = next((e for mark, e in _MARKS.items() if start.startswith(mark)), encoding)
            decoder = codecs.getincrementaldecoder(marked)()
            while chunk := stream.read(_CHUNK):
                try:
                    text = decoder.decode(chunk)
                except UnicodeDecodeError as error:
                    place = f"{path}, byte {at + error.start + 1}"
                    allowed = f"UTF-8 text, or encoding in [[source]]: {', '.join(ENCODINGS[1:])}"
                    raise InputError(place, f"not {marked} text", allowed) from error
                if "\0" in text:
                    allowed = 'text; or encoding = "utf-16-le" in [[source]] for UTF-16 without a byte order mark'
                    raise InputError(f"{path}, byte {at + 1} or after", "a zero byte: not a text file", allowed)
                at += len(chunk)
                yield text
            try:
                yield decoder.decode(b"", final=True)
            except UnicodeDecodeError as error:
                raise InputError(f"{path}, last byte", f"not {marked} text", "text that is not cut short") from error
    except (OSError, EOFError, zlib.error, lzma.LZMAError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(str(path), f"cannot be read: {reason}", "a readable file") from error


def blocks(
    path: Path, encoding: str = "utf-8", comments: tuple[str, ...] = COMMENTS, skip: str = ""
) -> Iterator[Lines]:
    """The lines of a file that are neither blank nor comments, about a megabyte at a time.

    Parameters
    ----------
    path : The file.
    encoding : One of ``ENCODINGS``; a byte order mark says it better, and is taken off.
    comments : What a comment line starts with.
    skip : Regular expression of further lines that are no data.

    Raises
    ------
    InputError
        For a file that cannot be read, is not text, or has a line without end.
    """
    row, rest, ended = 1, "", True
    leave = compiled(skip).search if skip else None
    for text in itertools.chain(_decoded(path, encoding), [None]):
        if text is not None:
            # A lone carriage return at the end may be half of a line end.
            whole = rest + text
            half = "\r" if whole.endswith("\r") else ""
            lines = whole.removesuffix("\r").replace("\r\n", "\n").replace("\r", "\n").split("\n")
            rest = lines.pop() + half
        else:
            lines = [rest.removesuffix("\r")] if rest.strip() else []
            rest, ended = "", not lines or rest.endswith("\r")
        if len(rest) > _LONGEST or any(len(line) > _LONGEST for line in lines):
            raise InputError(
                f"{path}, row {row} or after", f"a line of more than {_LONGEST} characters", "shorter lines"
            )
        kept = [
            (row + i, line)
            for i, line in enumerate(lines)
            if line.strip(_EMPTY) and not line.lstrip().startswith(comments) and not (leave and leave(line))
        ]
        row += len(lines)
        if kept:
            yield Lines([r for r, _ in kept], [line for _, line in kept], ended)


def head(path: Path, encoding: str = "utf-8", comments: tuple[str, ...] = (), skip: str = "") -> Lines:
    """The first lines of a file, comments included unless ``comments`` names them."""
    rows: list[int] = []
    text: list[str] = []
    for block in blocks(path, encoding, comments or ("\0",), skip):
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
    nothing : Words that stand for a value that was not measured.
    """

    delimiter: str = ","
    decimal: str = "."
    thousands: str = ""
    nothing: frozenset[str] = frozenset()

    def absent(self, cell: str) -> bool:
        """Whether a cell stands for a value that was not measured."""
        return cell.strip() in self.nothing

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
            if '"' in line:
                # SU2 pads its quoted names with blanks up to the delimiter.
                line = re.sub(rf'"[ ]+(?={re.escape(self.delimiter)}|$)', '"', line)
            texts = next(csv.reader([line], delimiter=self.delimiter, strict=True, skipinitialspace=True))
        except csv.Error as error:
            raise InputError(where, f"not a row of cells: {error}", "quotes that are closed in the same row") from error
        return [cell.strip() for cell in texts]

    def number(self, cell: str) -> float | None:
        """A cell as a number, or None when it is not a finite one of at most ``LARGEST``."""
        text = (cell if cell.isascii() else cell.translate(_SPELLED)).strip()
        if text[-1:] == "-" and (behind := _BEHIND.fullmatch(text)):
            text = f"-{behind[1]}"
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
        for c in (c.translate(_SPELLED) for c in rough.cells(line, f"{path}, row {row}"))
        if re.fullmatch(r"[+-]?\d[\d., ']*([eE][+-]?\d+)?", c, re.ASCII)
    ]
    if not thousands and delimiter != " ":
        # An apostrophe or a blank between groups of three digits can be nothing else, nor the mark that follows.
        grouped = [g for _, c in cells if (g := re.fullmatch(r"[+-]?\d{1,3}([' ])\d{3}(\1\d{3})*(?:([.,])\d*)?", c))]
        thousands = next((g[1] for g in grouped), "")
        decimal = decimal or next((g[3] for g in grouped if g[3]), "")
    cells = [(row, c) for row, c in cells if "," in c or "." in c]
    both = next((c for _, c in cells if "," in c and "." in c), None)
    if not decimal:
        decimal = decimal_mark(path, cells, both, thousands)
    if not thousands and both:
        thousands = "." if decimal == "," else ","
    if thousands == decimal:
        raise InputError(str(path), f"decimal and thousands are both {decimal!r}", "two different marks")
    return Dialect(delimiter, decimal, thousands)


def decimal_mark(path: Path, cells: list[tuple[int, str]], both: str | None, thousands: str) -> str:
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


Clock = tuple[int, Clocks] | None


def numbers(
    path: Path,
    block: Lines,
    dialect: Dialect,
    wanted: list[int],
    names: list[str],
    hint: str = "",
    clock: Clock = None,
) -> Array:
    """The wanted columns of some rows as finite numbers.

    Parameters
    ----------
    path : For the error.
    block : The rows.
    dialect : How they are written.
    wanted : Positions of the columns.
    names : Header of every column, for their number and for the error.
    hint : What more is allowed instead of a row with another number of cells.
    clock : Position of the column that may hold clock times, and what reads them.

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
                na_values=sorted(dialect.nothing),
                skip_blank_lines=False,
                **_EXACT,
            )
        except (ValueError, OverflowError):
            frame = None
        if frame is not None and frame.shape == (len(block.text), len(names)):
            values = frame[wanted].to_numpy(dtype=float)
            # What is missing is no number; a clock has to be one.
            sound = values[np.isfinite(values)] if dialect.nothing and not _no_clock(values, wanted, clock) else values
            if np.isfinite(sound).all() and np.abs(sound).max(initial=0.0) <= LARGEST and not np.isinf(values).any():
                return values
    return _one_by_one(path, block, dialect, wanted, names, hint, clock)


def _no_clock(values: Array, wanted: list[int], clock: Clock) -> bool:
    """Whether the column of the clock lacks a number."""
    return clock is not None and bool(np.isnan(values[:, wanted.index(clock[0])]).any())


def odd(cell: str) -> str:
    """What to do with a cell that holds no number, or one and something else; empty for other cells."""
    if _NOTHING.fullmatch(cell.strip()):
        return f"; or missing = [{cell.strip()[:20]!r}] in [[source]]: not measured"
    if re.search(r"\d\s*(±|\+/?-|\+\u2212)\s*\d", cell):
        return "; an error behind the number is read in loads, KT, KQ, t and value of a table of runs alone"
    if re.search(r"\d\s*[*\u2020\u2021\u00a7#a-d]$", cell):
        return "; a footnote mark: marks = { a = '...' } in [[source]] says which quality word it stands for"
    if re.fullmatch(r"\(\s*\d[\d.,]*\s*\)", cell):
        return "; a number in brackets may be negative or doubtful: write it with its sign"
    if re.fullmatch(r"[+-]?\d[\d.]*,\d+", cell.strip()):
        return "; or decimal (or thousands) = ',' in [[source]]"
    if re.search(r"[A-Za-z\u00b0]", cell) and known_unit(cell.strip().strip("[]()")):
        return "; units_row = true in [[source]] where the row below the header holds the units"
    return ""


def _one_by_one(
    path: Path, block: Lines, dialect: Dialect, wanted: list[int], names: list[str], hint: str, clock: Clock
) -> Array:
    """The same cell by cell, to read what pandas does not and to name the cell that fails."""
    values = np.empty((len(block.text), len(wanted)))
    for i, (row, line) in enumerate(zip(block.rows, block.text, strict=True)):
        cells = dialect.cells(line, f"{path}, row {row}")
        while len(cells) > len(names) and not cells[-1]:
            cells.pop()
        if len(cells) > len(names) or len(cells) <= max(wanted):
            raise InputError(f"{path}, row {row}", f"{len(cells)} cells", f"{len(names)} cells, as in the header{hint}")
        for j, column in enumerate(wanted):
            value = dialect.number(cells[column])
            timed = clock is not None and clock[0] == column
            if value is None and timed and clock is not None:
                value = clock[1].seconds(cells[column])
            if value is None and not timed and dialect.absent(cells[column]):
                value = np.nan
            if value is None:
                place = f"{path}, row {row}, column {names[column][:60]}"
                wrong = repr(cells[column][:60]) if cells[column] else "nothing"
                more = f"seconds, {FORMS}; or rate_hz in [source.reduction] and the column in ignore" if timed else ""
                raise InputError(place, wrong, more or f"a finite number of at most {LARGEST:g}{odd(cells[column])}")
            values[i, j] = value
    return values
