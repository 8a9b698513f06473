"""Cells of a table of runs to columns of numbers in SI, and of text."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ident.captive.quantities import Column, owner
from ident.captive.readers.sheet import Sheet, run_blocks
from ident.captive.readers.text import LARGEST, odd
from ident.captive.run_table import DIRECT, sigma
from ident.captive.source import Source
from ident.captive.stated import signed
from ident.timeseries.faults import BEYOND, sentinel
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError

# A number with its error, and one with a footnote mark behind it.
_ERROR = re.compile(r"(?P<value>.*\d\)?)\s*(?:\u00b1|\+/?[-\u2212\u2013])\s*(?P<error>\d[\d.,]*)")
_MARKED = re.compile(
    r"(?P<value>.*\d\)?)\s*(?P<mark>[*\u2020\u2021\u00a7\u00b6#]+|[\u00b9\u00b2\u00b3\u2070-\u2079\u1d43-\u1d4d]+)"
)
_LEDGER = re.compile(r"\(\s*(\d[\d.,' ]*)\s*\)")
# Other values of a column that one is held against.
_OTHERS = 3
_DIGITS = frozenset("0123456789+-.eE")


@dataclass
class Cells:
    """The cells of a table of runs.

    Attributes
    ----------
    columns : One for each that was wanted: numbers in SI, or text.
    rows : File row of each run.
    errors : Column of a standard error -> the errors behind a plus-minus sign, in the units of its load.
    notes : For each run, what stood in its cells beside the numbers: ``Y: *``.
    marks : Footnote marks by run, without those that are only noted.
    used : Which of ``plus_minus`` and the keys of ``marks`` the cells made use of.
    """

    columns: list[np.ndarray] = field(default_factory=list)
    rows: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    errors: dict[str, np.ndarray] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    marks: list[str] = field(default_factory=list)
    used: set[str] = field(default_factory=set)


def read_cells(sheet: Sheet, wanted: list[tuple[int, Column | None]], source: Source) -> Cells:
    """Columns of a run table, each as numbers in SI or, without a kind, as text.

    Parameters
    ----------
    sheet : The open table.
    wanted : Position and kind of each column.
    source : For ``missing``, ``plus_minus`` and ``marks``.

    Raises
    ------
    InputError
        Naming file, row and column of a cell that cannot be read.
    """
    by_column: list[list[np.ndarray]] = [[] for _ in wanted]
    places = []
    beside = _Beside(source)
    for rows, cells in run_blocks(sheet):
        for parts, (at, kind) in zip(by_column, wanted, strict=True):
            parts.append(_words(cells[at]) if kind is None else _numbers(sheet, cells[at], rows, kind, beside))
        places.append(np.array(rows))
    every = np.concatenate(places)
    errors = {name: np.array([by.get(int(row), np.nan) for row in every]) for name, by in beside.errors.items()}
    notes = ["; ".join(beside.notes.get(int(row), ())) for row in every]
    marks = [beside.marks.get(int(row), "") for row in every]
    return Cells([np.concatenate(parts) for parts in by_column], every, errors, notes, marks, beside.used)


class _Beside:
    """What stands in cells beside their numbers."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.errors: dict[str, dict[int, float]] = {}
        self.notes: dict[int, list[str]] = {}
        self.marks: dict[int, str] = {}
        self.used: set[str] = set()

    def number(self, sheet: Sheet, cell: str, row: int, kind: Column) -> float | None:
        """The number of a cell that holds more than one; None where it cannot be told."""
        text, mark = cell.strip(), ""
        known = sorted(self.source.marks, key=len, reverse=True)
        stated = next((m for m in known if text.endswith(m) and len(text) > len(m)), "")
        if stated:
            text, mark = text.removesuffix(stated).rstrip(), stated
        elif sheet.dialect.number(text) is None and (noted := _MARKED.fullmatch(text)):
            text, mark = noted["value"], noted["mark"]
        error = None
        if parted := _ERROR.fullmatch(text):
            error = sheet.dialect.number(parted["error"])
            text = parted["value"]
            if error is None or not _has_error(kind.quantity):
                return None
        value = sheet.dialect.number(text)
        if value is None:
            return None
        if error is not None:
            self.errors.setdefault(sigma(kind.quantity), {})[row] = (
                error * abs(kind.factor) / (self.source.plus_minus or 1.0)
            )
            self.used.add("plus_minus")
            if self.source.plus_minus is None:
                self.notes.setdefault(row, []).append(f"{kind.quantity}: +-")
        if mark and mark in self.source.marks:
            self.marks[row] = self.source.marks[mark]
            self.used.add(f"marks.{mark}")
        elif mark:
            self.notes.setdefault(row, []).append(f"{kind.quantity}: {mark}")
        return value


def _has_error(quantity: str) -> bool:
    """Whether a standard error of a quantity has a place in the run table."""
    return quantity in OUTPUTS or quantity in DIRECT or (owner(quantity) == "value" and quantity == "value")


def _words(cells: Sequence[str]) -> np.ndarray:
    """A column of text without blanks around; words that repeat are kept once."""
    once: dict[str, str] = {}
    return np.array([once.setdefault(w, w) for w in (c.strip() for c in cells)], dtype=object)


def _numbers(sheet: Sheet, cells: Sequence[str], rows: list[int], kind: Column, beside: _Beside) -> np.ndarray:
    """A column of a run table as numbers; blank, or stated to be missing, is NaN."""
    missing, words = beside.source.missing_numbers, beside.source.missing_words
    signless = kind.quantity.startswith("s_") or kind.quantity == "rel_sigma"
    plain = _plain_numbers(cells) if (sheet.dialect.decimal, sheet.dialect.thousands) == (".", "") else None
    if plain is not None and not (signless and (plain < 0.0).any()):
        _refuse_sentinel(sheet, plain, rows, kind, missing)
        return np.where(np.isin(plain, list(missing)), np.nan, plain * kind.factor) if missing else plain * kind.factor
    values = np.full(len(cells), np.nan)
    # Brackets are an accountant's minus in a column that has no other one.
    ledger = signed(kind.quantity) and not any(c.strip()[:1] in "-\u2212\u2013\uff0d" for c in cells if c.strip())
    for i, cell in enumerate(cells):
        if not cell.strip() or cell.strip() in words:
            continue
        value = sheet.dialect.number(cell)
        if value is None and ledger and (inside := _LEDGER.fullmatch(cell.strip())):
            value = sheet.dialect.number(inside[1])
            value = None if value is None else -value
        if value is None:
            value = beside.number(sheet, cell, rows[i], kind)
        if value is None:
            place = f"{sheet.path}, row {rows[i]}, column {kind.name[:60]}"
            raise InputError(place, repr(cell[:60]), f"a finite number of at most {LARGEST:g}, or blank{odd(cell)}")
        if value < 0.0 and signless:
            raise InputError(f"{sheet.path}, row {rows[i]}, column {kind.name[:60]}", cell[:60], "zero or more")
        values[i] = np.nan if value in missing else value * kind.factor
    _refuse_sentinel(sheet, values / kind.factor, rows, kind, missing)
    return values


def _refuse_sentinel(sheet: Sheet, values: np.ndarray, rows: list[int], kind: Column, missing: Sequence[float]) -> None:
    """Refuse a number that loggers write where they have nothing, far outside of all others of its column."""
    known = np.array([sentinel(float(v)) and v not in missing for v in values], dtype=bool)
    others = values[~known & ~np.isnan(values) & ~np.isin(values, list(missing))]
    if not known.any() or others.size < _OTHERS:
        return
    for i in np.flatnonzero(known):
        if abs(values[i]) > BEYOND * np.abs(others).max():
            place = f"{sheet.path}, row {rows[i]}, column {kind.name[:60]}"
            text = (
                f"missing = [{values[i]:.10g}] in [[source]] where it stands for nothing measured; or the load excluded"
            )
            raise InputError(place, f"{values[i]:.10g}, beside others of at most {np.abs(others).max():.3g}", text)


def _plain_numbers(cells: Sequence[str]) -> np.ndarray | None:
    """Cells of digits, point, sign and exponent alone as numbers; None where another stands among them."""
    if not _DIGITS.issuperset("".join(cells)):
        return None
    try:
        values = np.array([float(c) if c else math.nan for c in cells])
    except ValueError:
        return None
    return values if np.nanmax(np.abs(values), initial=0.0) <= LARGEST else None
