"""An open table: a header, and rows that come a block at a time, so that a file of any size fits memory."""

from __future__ import annotations

import fnmatch
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.quantities import split
from ident.captive.readers.text import Dialect
from ident.captive.source import Source
from sim.files.errors import InputError

Array = NDArray[np.float64]
# Rows of a table of runs that are text at once.
_BLOCK = 1 << 14


@dataclass(frozen=True)
class Sheet:
    """An open table.

    Attributes
    ----------
    path : The file.
    header_row : Row of the header.
    header : Column headers as they stand there.
    numbers : Wanted column positions, and that of the column that may hold clock times -> blocks
        (rows, wanted) of finite numbers.
    cells : Blocks of (file row, cells as text), for a table of runs.
    dialect : How its numbers are written.
    first_row : Row where the data begin.
    spacers : Columns without a name that are empty.
    """

    path: Path
    header_row: int
    header: list[str]
    numbers: Callable[..., Iterator[Array]]
    cells: Callable[[], Iterator[tuple[int, list[str]]]]
    dialect: Dialect
    first_row: int = 2
    spacers: tuple[str, ...] = ()

    @property
    def where(self) -> str:
        """The header, for errors."""
        return f"{self.path}, row {self.header_row} (header)"


def ignored(header: str, source: Source) -> bool:
    """Whether the campaign leaves a column out."""
    return any(fnmatch.fnmatchcase(h, p) for h in (header, split(header)[0]) for p in source.ignore)


def once(where: str, header: list[str], source: Source) -> None:
    """Refuse a column that stands twice and is not left out."""
    for name in header:
        if header.count(name) > 1 and not ignored(name, source):
            raise InputError(where, f"column {name[:60]!r} stands twice", "each column once, or in ignore")


def run_blocks(sheet: Sheet) -> Iterator[tuple[list[int], list[tuple[str, ...]]]]:
    """A table of runs, some thousand rows at a time: their file rows, and the cells of every column as text.

    Raises
    ------
    InputError
        When there is no row.
    """
    cells = sheet.cells()
    block = list(itertools.islice(cells, _BLOCK))
    if not block:
        raise InputError(str(sheet.path), "no runs", "at least one row below the header")
    while block:
        yield [row for row, _ in block], list(zip(*(texts for _, texts in block), strict=True))
        block = list(itertools.islice(cells, _BLOCK))


def run_cells(sheet: Sheet) -> tuple[pd.DataFrame, list[int]]:
    """A table of runs as text, with the file row of each.

    Raises
    ------
    InputError
        When there is no row.
    """
    blocks = list(run_blocks(sheet))
    tables = [pd.DataFrame(dict(enumerate(columns)), dtype=str) for _, columns in blocks]
    table = pd.concat(tables, ignore_index=True).set_axis(sheet.header, axis=1)
    return table, [row for rows, _ in blocks for row in rows]
