"""The table of reference series: its header, its numbers, and whether a file is one at all."""

from __future__ import annotations

import math
import re
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sim.files import inputs
from sim.files.errors import InputError
from sim.files.schema import LARGEST

if TYPE_CHECKING:
    import pandas as pd

TEXTS = ("source", "channel", "unit")
# Remarks that a table may have beside what is read: how good a point is, its time in hull lengths.
REMARKS = ("quality", "tau", "note")
_HEAD = 1 << 16


def is_series(path: Path) -> bool:
    """Whether a file is a table of source, channel, t or s, value, unit: by its header, where slips are allowed for.

    Raises
    ------
    InputError
        For a file that cannot be read, or is empty.
    """
    try:
        with path.open("rb") as stream:
            start = stream.read(_HEAD)
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror}", "a file you may read") from error
    if not start.strip(b"\xef\xbb\xbf\xff\xfe\x00 \t\r\n"):
        raise InputError(str(path), "not a table: nothing in it", "a CSV file with a header and rows below it")
    first = start.partition(b"\n")[0].decode("utf-8", errors="replace").strip("\ufeff \r")
    names = {name.strip().strip('"').lower() for name in re.split(r"[,;\t]", first)}
    # A recorded trial may be long as well, but is of one source and does not name it.
    return bool(get_close_matches("source", names, 1)) and len(names & {"channel", "value", "unit"}) >= 2


def read_table(path: Path, abscissa: str) -> pd.DataFrame:
    """The rows of a table of reference series, checked.

    Parameters
    ----------
    path : CSV with the columns source, channel, ``abscissa``, value, unit and, where known, sigma; the columns
        quality, tau and note are remarks.
    abscissa : ``t`` or ``s``.

    Returns
    -------
    The table, numbers finite, texts not blank.

    Raises
    ------
    InputError
        For a file that is no such table, a column that is missing or that nothing reads, or a cell that is none.
    """
    import pandas as pd

    inputs.note(path)
    try:
        table = pd.read_csv(path, dtype=dict.fromkeys(TEXTS, str), skipinitialspace=True)
    except (ValueError, OSError, pd.errors.ParserError) as error:
        raise InputError(str(path), f"not a table: {error}", "a CSV file with a header, in UTF-8") from error
    required = ("source", "channel", abscissa, "value", "unit")
    known = (*required, "sigma")
    if len(table.columns) == 1 and re.search("[;\t]", str(table.columns[0])):
        raise InputError(str(path), "a header without commas", ", ".join(required) + " with commas between")
    extra = [str(c) for c in table.columns if c not in (*known, *REMARKS, "t", "s")]
    missing = [c for c in required if c not in table]
    if missing:
        near = get_close_matches(missing[0], extra, 1)
        more = f"; is {near[0]!r} it?" if near else ""
        raise InputError(str(path), f"column {missing[0]} missing{more}", ", ".join(known))
    if extra:
        near = get_close_matches(extra[0].lower(), known, 1)
        allowed = (f"{near[0]}? One of " if near else "one of ") + ", ".join((*known, *REMARKS))
        raise InputError(f"{path}, column {extra[0][:60]}", "unknown column, which nothing reads", allowed)
    for column in TEXTS:
        blank = np.flatnonzero(table[column].isna())
        if blank.size:
            raise InputError(f"{path}, row {blank[0] + 2}, column {column}", "nothing", f"a {column}")
    for column in (abscissa, "value", *(["sigma"] if "sigma" in table else [])):
        _numbers(table, column, path)
    return table


def _numbers(table: pd.DataFrame, column: str, path: Path) -> None:
    """Make a column numbers; only values may be negative. Raises ``InputError`` naming the row that is not."""
    import pandas as pd

    numbers = pd.to_numeric(table[column], errors="coerce").astype(float)
    least = -math.inf if column == "value" else 0.0
    bad = np.flatnonzero(~np.isfinite(numbers) | (numbers < least) | (numbers.abs() > LARGEST))
    if bad.size:
        place, given = f"{path}, row {bad[0] + 2}, column {column}", table[column].iloc[bad[0]]
        allowed = "a finite number" if column == "value" else "a finite number, zero or more"
        raise InputError(place, "nothing or nan" if pd.isna(given) else repr(str(given)[:60]), allowed)
    table[column] = numbers
