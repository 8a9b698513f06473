"""Time stamps of a record: clock times, stamps with too few digits, gaps, steps back."""

from __future__ import annotations

import datetime
import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.checks.findings import Finding, spans
from sim.files.errors import InputError

Array = NDArray[np.float64]
_CLOCK = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}(?:[.,]\d*)?))?\s*(am|pm|z|utc)?", re.IGNORECASE)
_POWER = re.compile(r"\d[eEdD]([+-]?\d+)\s*$")
_DAY = 86400.0
# Half digits by which a stamp may be off an even clock: some were rounded before they were scaled and printed.
_ROUNDED_TWICE = 1.5
# A step of this many times the usual one is a gap.
_GAP = 3.5


@dataclass(frozen=True)
class Stamps:
    """Times of the rows [s] from the first, what was done to get them, and what is wrong with them.

    Attributes
    ----------
    time : (rows,) growing.
    sigma : Standard error of the times, common to them [s].
    said : What was assumed.
    findings : Gaps.
    """

    time: Array
    sigma: float
    said: tuple[str, ...]
    findings: tuple[Finding, ...]


def parsed(cell: str, number: float | None) -> float | None:
    """Seconds of a time cell: a number, hh:mm:ss with decimals, or an ISO date and time."""
    if number is not None:
        return number
    text = cell.strip()
    clock = _CLOCK.fullmatch(text)
    if clock:
        hours, half = int(clock[1]), (clock[4] or "").lower()
        hours = hours % 12 + (12 if half == "pm" else 0) if half in ("am", "pm") else hours
        seconds = float(clock[3].replace(",", ".")) if clock[3] else 0.0
        return 3600.0 * hours + 60.0 * int(clock[2]) + seconds
    try:
        moment = datetime.datetime.fromisoformat(text.replace("Z", "+00:00").replace("/", "-"))
    except ValueError:
        return None
    zero = datetime.datetime(2000, 1, 1, tzinfo=moment.tzinfo)
    return (moment - zero).total_seconds()


def _resolution(cells: list[str], raw: Array) -> Array:
    """Half a unit of the last digit that each stamp is written with [in its own unit]."""
    out = np.zeros(len(cells))
    digits = max((len(c.split("e")[0].split("E")[0].replace(".", "").strip("+-0")) for c in cells if c), default=1)
    for i, (cell, value) in enumerate(zip(cells, raw, strict=True)):
        written, power = re.search(r"[.,](\d+)", cell), _POWER.search(cell)
        places = len(written[1]) if written else 0
        if power:
            # 1.00E+02: the last digit that is written counts ones.
            out[i] = 0.5 * 10.0 ** (int(power[1]) - places)
            continue
        # Trailing zeros are dropped by printing with significant digits.
        size = math.floor(math.log10(abs(value))) if value else 0
        out[i] = 0.5 * 10.0 ** -min(max(places, digits - 1 - size), 9)
    return out


def _even(raw: Array, half: Array) -> tuple[float, float] | None:
    """Start and step of an even clock that rounds to every stamp; None when none does."""
    row = np.arange(raw.size, dtype=float)
    start, step, worst = _nearest_even(raw, half)
    if not step > 1e-9 * float(np.max(half)):
        # Stamps that are all alike.
        return None
    for simple in (
        *(float(f"{step:.{k}g}") for k in (1, 2, 3)),
        *(1.0 / round(1.0 / step, k) for k in (0, 1) if round(1.0 / step, k)),
    ):
        offset = raw - simple * row
        lo, hi = float(np.max(offset - half)), float(np.min(offset + half))
        if lo <= hi + 1e-9:
            near = raw[0] if lo - 1e-9 <= raw[0] <= hi + 1e-9 else 0.5 * (lo + hi)
            return float(near), simple
    return (start, step) if worst <= _ROUNDED_TWICE else None


def _nearest_even(raw: Array, half: Array) -> tuple[float, float, float]:
    """Start and step of the even clock whose largest distance from a stamp is least, in that stamp's half digit."""
    from scipy.optimize import linprog

    row = np.arange(raw.size, dtype=float)
    size = max(float(raw.size), 1.0)
    line = np.column_stack([np.ones(raw.size), row / size]) / half[:, None]
    away = -np.ones((raw.size, 1))
    matrix = np.vstack([np.hstack([line, away]), np.hstack([-line, away])])
    least = linprog([0.0, 0.0, 1.0], matrix, np.concatenate([raw, -raw]) / np.tile(half, 2), bounds=[(None, None)] * 3)
    if least.x is None:
        return float(raw[0]), 0.0, math.inf
    return float(least.x[0]), float(least.x[1]) / size, float(least.x[2])


def stamps(cells: list[str], raw: Array, factor: float, path: str, rows: list[int], column: str) -> Stamps:
    """Times of the rows of a record.

    Parameters
    ----------
    cells, raw : The stamps as they stand and as numbers in their own unit (seconds for clock times).
    factor : Seconds of that unit.
    path, rows, column : For errors and findings.

    Raises
    ------
    InputError
        When the clock steps back, or repeats where no even clock would round to its stamps.
    """
    said: list[str] = []
    clock = [bool(_CLOCK.fullmatch(c.strip())) for c in cells]
    if all(clock):
        midnights = np.cumsum(np.concatenate([[0.0], np.diff(raw) < -0.5 * _DAY]))
        raw = raw + _DAY * midnights.astype(np.float64)
        said.append(f"{column}: times of day, counted from {cells[0].strip()}")
    step = np.diff(raw)
    back = np.flatnonzero(step < 0.0)
    if back.size:
        row = rows[int(back[0]) + 1]
        text = "time that moves on: two records in one file, or a clock that was set; cut the file there"
        raise InputError(f"{path}, row {row}, column {column}", f"{cells[back[0] + 1]} after {cells[back[0]]}", text)
    sigma = 0.0
    same = np.flatnonzero(step == 0.0)
    if same.size:
        half = _resolution(cells, raw)
        even = _even(raw, half)
        if even is None:
            place = f"{path}, row {rows[int(same[0]) + 1]}, column {column}"
            text = "a time a row: stamps with more digits, or an even clock, or one row a time"
            raise InputError(place, f"{same.size} stamps repeat, first {cells[same[0] + 1]}", text)
        raw = np.asarray(even[0] + even[1] * np.arange(raw.size, dtype=float))
        sigma = even[1] * 0.05
        said.append(
            f"{column}: {same.size} stamps repeat (printed with too few digits); "
            f"an even clock of {factor * even[1]:.6g} s a row fits every one of them and is used"
        )
    time = (raw - raw[0]) * factor
    return Stamps(time, sigma * factor, tuple(said), tuple(_gaps(time, path, rows, column)))


def _gaps(time: Array, path: str, rows: list[int], column: str) -> list[Finding]:
    step = np.diff(time)
    usual = float(np.median(step)) if step.size else 0.0
    wide = np.flatnonzero(step > _GAP * usual) if usual > 0.0 else np.zeros(0, dtype=int)
    if not wide.size:
        return []
    places = tuple(rows[int(i) + 1] for i in wide)
    what = (
        f"the clock jumps {len(places)} times, at most by {float(step[wide].max()):.3g} s where {usual:.3g} s is usual"
    )
    remedy = "look for lost samples; what falls into a gap has the error of a curve drawn across it"
    return [Finding("clock_gaps", "warning", path, places, (column,), f"{what} (row {spans(places)})", remedy)]
