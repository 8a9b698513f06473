"""Tables: tidy CSV, Parquet, STAR-CCM+ monitor exports and white-space columns.

Each is opened as a ``Sheet``: a header and rows that come a block at a time, so that a
file of any size is read in bounded memory.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.captive.patterns import search
from ident.captive.readers.sheet import Sheet, ignored, once
from ident.captive.readers.text import COMMENTS, Dialect, Lines, blocks, decimal_mark, head, numbers, sniff
from ident.captive.readers.times import Clocks
from ident.captive.source import Source
from sim.files.errors import InputError

Array = NDArray[np.float64]
# Rows at the end of a history that may lack cells: what a run that is still being written leaves.
_MOST_UNFINISHED = 10
# Lines that the names of a table may go over.
_MOST_WRAPPED = 40
_NO_DATA = "; skip = '...' in [[source]] leaves out lines that are no data"


def _blocks(path: Path, source: Source, comments: tuple[str, ...] = COMMENTS) -> Iterator[Lines]:
    """Lines as the campaign says they are to be read: without what it skips, fixed widths set apart."""
    edges = np.cumsum([0, *source.widths]).tolist()
    for block in blocks(path, source.encoding, comments, source.skip):
        if not source.widths:
            yield block
            continue
        pieces = [[line[a:b] for a, b in itertools.pairwise(edges)] for line in block.text]
        yield Lines(block.rows, [" ".join(cells) for cells in pieces], block.ended)


def _whole_rows(
    path: Path,
    data: Iterator[Lines],
    dialect: Dialect,
    wanted: list[int],
    header: list[str],
    solver: bool,
    clock: int = -1,
) -> Iterator[Array]:
    """Numbers of every row; rows at the end that a run still being written leaves unfinished are left out.

    Parameters
    ----------
    solver : A row without line end is never whole: its last number may be cut.

    Raises
    ------
    InputError
        For a cell that is no number, an unfinished row with others below it, or too many of them.
    """
    pending: InputError | None = None
    left = 0
    times = (clock, Clocks()) if clock >= 0 else None
    for block in data:
        text, cut = block.text, 0
        while cut < len(text) and _unfinished(text[-1 - cut], dialect, wanted, cut == 0 and not block.ended, solver):
            cut += 1
        if pending and cut < len(text):
            raise pending
        left += cut
        whole = Lines(block.rows[: len(text) - cut], text[: len(text) - cut])
        if whole.text:
            yield numbers(path, whole, dialect, wanted, header, _NO_DATA, times)
        if cut:
            try:
                numbers(path, Lines(block.rows[-cut:], text[-cut:]), dialect, wanted, header, _NO_DATA)
            except InputError as error:
                pending = pending or error
        if pending and left > _MOST_UNFINISHED:
            raise pending


def _unfinished(line: str, dialect: Dialect, wanted: list[int], open_end: bool, solver: bool) -> bool:
    """Whether a row lacks a wanted cell: blank, or cut off with the file."""
    if open_end and solver:
        return True
    try:
        cells = dialect.cells(line, "")
    except InputError:
        return open_end
    if open_end and (len(cells) <= max(wanted) or dialect.number(cells[max(wanted)]) is None):
        return True
    if dialect.delimiter == " ":
        return False
    return any(i >= len(cells) or (not cells[i] and "" not in dialect.nothing) for i in wanted)


def _text_sheet(path: Path, source: Source, dialect: Dialect, header: list[str], first: Lines, skip: int) -> Sheet:
    """A sheet over the lines after the header; ``skip`` is the last row that is not data."""
    dialect = replace(dialect, nothing=source.missing_words)

    def data() -> Iterator[Lines]:
        for block in _blocks(path, source):
            if block.rows[0] > skip:
                yield block
            elif block.rows[-1] > skip:
                i = next(k for k, row in enumerate(block.rows) if row > skip)
                yield Lines(block.rows[i:], block.text[i:], block.ended)

    def values(wanted: list[int], clock: int = -1) -> Iterator[Array]:
        yield from _whole_rows(path, data(), dialect, wanted, header, source.reader == "starccm", clock)

    def cells() -> Iterator[tuple[int, list[str]]]:
        for block in data():
            for row, line in zip(block.rows, block.text, strict=True):
                texts = dialect.cells(line, f"{path}, row {row}")
                while len(texts) > len(header) and not texts[-1]:
                    texts.pop()
                if len(texts) > len(header):
                    text = f"at most {len(header)}, as in the header"
                    raise InputError(f"{path}, row {row}", f"{len(texts)} cells", text)
                if len(texts) < len(header) and not block.ended and row == block.rows[-1]:
                    text = f"{len(header)} cells, as in the header: or a line end: is the file cut short?"
                    raise InputError(f"{path}, row {row}", f"{len(texts)} cells and no line end", text)
                # Spreadsheets drop blank cells at the end of a row.
                yield row, texts + [""] * (len(header) - len(texts))

    once(f"{path}, row {first.rows[0]} (header)", header, source)
    return Sheet(path, first.rows[0], header, values, cells, dialect, skip + 1)


def open_csv(path: Path, source: Source) -> Sheet:
    """A delimited table: header, perhaps a row of units, rows.

    Raises
    ------
    InputError
        For a file without header, an unclosed quote, an ambiguous number, a column twice.
    """
    first, delimiter = _below_title(path, source)
    first = _whole_names(first)
    dialect = sniff(path, first, delimiter, source.decimal, source.thousands)
    where = f"{path}, row {first.rows[0]} (header)"
    header = dialect.cells(first.text[0], where)
    while header and not header[-1]:
        header.pop()
    if not header:
        raise InputError(where, "a column without a name", "a name for every column")
    if len(header) == 1 and (mark := next((m for m in "|&" if header[0].count(m) > 1), "")):
        wrong = f"one column, and {header[0].count(mark)} times {mark!r} in its name"
        raise InputError(where, wrong, "columns parted by commas, semicolons, tabs or blanks")
    rows = [dialect.cells(line, f"{path}, row {row}") for row, line in zip(first.rows[1:], first.text[1:], strict=True)]
    longest = max((i + 1 for cells in rows[:1] for i, cell in enumerate(cells) if cell), default=0)
    if longest > len(header):
        text = "a name for every column; header_pattern and delimiter where a title stands above the header"
        raise InputError(where, f"{len(header)} names above {longest} cells", text)
    header, spacers = _nameless(header, rows, source, where)
    skip = first.rows[0]
    if source.units_row:
        if len(first.text) < 2:
            raise InputError(f"{path}, row {first.rows[0] + 1}", "nothing", "a row of units: units_row is true")
        skip = first.rows[1]
        given = dialect.cells(first.text[1], f"{path}, row {skip}")
        if len(given) != len(header):
            raise InputError(f"{path}, row {skip}", f"{len(given)} units", f"{len(header)}, one a column")
        header = [f"{name} [{unit.strip('[]()')}]" if unit else name for name, unit in zip(header, given, strict=True)]
    sheet = _text_sheet(path, source, dialect, header, first, skip)
    return replace(sheet, spacers=spacers)


def _whole_names(first: Lines) -> Lines:
    """The first lines with names in one, where a quoted name goes over several, as spreadsheets wrap them."""
    at = 1
    while at < min(len(first.text), _MOST_WRAPPED) and " ".join(first.text[:at]).count('"') % 2:
        at += 1
    if at == 1 or " ".join(first.text[:at]).count('"') % 2:
        return first
    return Lines(first.rows[at - 1 :], [" ".join(first.text[:at]), *first.text[at:]])


def _nameless(
    header: list[str], rows: list[list[str]], source: Source, where: str
) -> tuple[list[str], tuple[str, ...]]:
    """A header with ``column 3`` where no name stands, and those names; refused where cells stand below one."""
    names = [name or f"column {i + 1}" for i, name in enumerate(header)]
    spacers = tuple(named for named, name in zip(names, header, strict=True) if not name)
    for i, name in enumerate(names):
        if name in spacers and not ignored(name, source) and any(len(cells) > i and cells[i] for cells in rows):
            text = f'a name for every column, or ignore = ["{name}"] in [[source]]'
            raise InputError(where, f"a column without a name ({name})", text)
    return names, spacers


def _below_title(path: Path, source: Source) -> tuple[Lines, str]:
    """The first lines from the header on, and the delimiter where the campaign or the file states it."""
    first = head(path, source.encoding, COMMENTS, source.skip)
    at = 0
    if source.header_pattern and not any(search(source.header_pattern, line) for line in first.text):
        # The line of names may be a comment.
        first = head(path, source.encoding, skip=source.skip)
        at = _pattern_row(path, first, source)
        rows = [k for k in range(at + 1, len(first.rows)) if not first.text[k].lstrip().startswith(COMMENTS)]
        names = first.text[at].lstrip("#%!/ \t")
        return Lines([first.rows[k] for k in (at, *rows)], [names, *(first.text[k] for k in rows)]), source.delimiter
    if source.header_pattern:
        at = _pattern_row(path, first, source)
    elif first.text and (stated := re.fullmatch(r'"?sep=([,;\t])"?', first.text[0].strip(" "))):
        # The line by which spreadsheets are told.
        return Lines(first.rows[1:], first.text[1:]), source.delimiter or stated[1]
    return Lines(first.rows[at:], first.text[at:]), source.delimiter


def _pattern_row(path: Path, first: Lines, source: Source) -> int:
    """Which of the first lines fits ``header_pattern``."""
    at = next((i for i, line in enumerate(first.text) if search(source.header_pattern, line)), -1)
    if at < 0:
        raise InputError(str(path), "no line in the first 200 fits header_pattern", repr(source.header_pattern))
    return at


def open_columns(path: Path, source: Source) -> Sheet:
    """A file of white-space columns below a header of free text.

    The columns are those of ``names``, or those of the line that ``header_pattern`` finds.
    Data start at the first line below that holds a number in every column.

    Raises
    ------
    InputError
        When neither is declared, no line fits, or no line of numbers follows.
    """
    first = head(path, source.encoding, skip=source.skip)
    if source.names:
        header, at = source.names, -1
    elif source.header_pattern:
        at = _pattern_row(path, first, source)
        # The line of dashes counts whether skip leaves it out or not.
        every = head(path, source.encoding)
        header = _ruled(every.text, every.rows.index(first.rows[at])) or header_names(first.text[at])
    else:
        text = "names = [...] or header_pattern = '...' in [[source]], see docs/readers.md"
        raise InputError(str(path), "columns without declared names", text)
    below = next(_blocks(path, source, ("\0",)), Lines([], []))
    below = Lines(below.rows[at + 1 : len(first.rows)], below.text[at + 1 : len(first.rows)])
    dialect = Dialect(
        source.delimiter or " ",
        source.decimal or _columns_decimal(path, below, header, source),
        source.thousands,
    )
    for row, line in zip(below.rows, below.text, strict=True):
        cells = dialect.cells(line, f"{path}, row {row}") if dialect.delimiter == " " else line.split(dialect.delimiter)
        if len(cells) == len(header) and all(
            dialect.number(c) is not None or Clocks().seconds(c) is not None for c in cells
        ):
            lines = Lines([first.rows[max(at, 0)]], [first.text[max(at, 0)]])
            return _text_sheet(path, source, dialect, header, lines, row - 1)
    wrong = f"no line with {len(header)} numbers in the first {len(first.text)}"
    text = f"numbers for {', '.join(header)[:200]}; decimal, delimiter or widths = [...] where blanks do not part them"
    text += "; names = [...] where a name holds a blank" if source.header_pattern else ""
    raise InputError(str(path), wrong, text)


def _columns_decimal(path: Path, below: Lines, header: list[str], source: Source) -> str:
    """The decimal mark of white-space columns, from the lines that have a number in each."""
    mark = source.delimiter.strip(" ") or None
    rows = [(row, [c.strip() for c in line.split(mark)]) for row, line in zip(below.rows, below.text, strict=True)]
    form = re.compile(r"[+-]?[\d.,]*\d[.,]?\d*([eEdD][+-]?\d{1,3})?", re.ASCII)
    full = [
        (row, c) for row, cells in rows if len(cells) == len(header) for c in cells if all(map(form.fullmatch, cells))
    ]
    return decimal_mark(path, [(row, c) for row, c in full if "," in c or "." in c], None, source.thousands)


def _ruled(lines: list[str], at: int) -> list[str]:
    """Names above a line of dashes, a stretch a column, as XFOIL and XFLR5 print them; empty without such a line."""
    below = lines[at + 1] if at + 1 < len(lines) else ""
    if not re.fullmatch(r"\s*-{2,}(\s+-{2,})+\s*", below):
        return []
    stretches = [m.span() for m in re.finditer("-+", below)]
    names: list[list[str]] = [[] for _ in stretches]
    for word in re.finditer(r"[^\s#%!]+", lines[at]):
        # Each word belongs to the stretch that it lies over most.
        over = [min(word.end(), end) - max(word.start(), start) for start, end in stretches]
        names[int(np.argmax(over))].append(word[0])
    return [" ".join(words) for words in names] if all(names) else []


def header_names(line: str) -> list[str]:
    """Column names of a header line: split at tabs or two blanks, else at single blanks."""
    text = line.strip().lstrip("#%!").strip()
    quoted = re.fullmatch(r'\(?\s*("[^"]*"\s*)+\)?', text)
    if quoted:
        # Names of several words in quotes, perhaps in brackets: a report file of Fluent.
        return [n.strip() for n in re.findall(r'"([^"]*)"', text)]
    wide = [c.strip() for c in re.split(r"\t|\s{2,}", text) if c.strip()]
    if len(wide) > 1:
        return wide
    return re.findall(r"[^\s\[(]+(?:\s?[\[(][^\])]*[\])])?", text)
