"""Units that are taken for one another, and the factors by which numbers are off then.

The factors stand beside the units in ``data/unit_slips.csv``, and a test holds them against the units: most flights are
held against a record, and making units from their names takes longer than flying.
"""

from __future__ import annotations

import csv
import math
from functools import cache
from importlib.resources import files

# A ratio as near to that of two units is theirs.
_LIKE = 0.06


@cache
def unit_slips() -> dict[str, float]:
    """Pairs of units that are taken for one another -> one over the other; from ``data/unit_slips.csv``."""
    with (files("ident") / "data" / "unit_slips.csv").open(encoding="utf-8") as stream:
        return {row["words"]: float(row["ratio"]) for row in csv.DictReader(stream)}


def factor_between(ratio: float) -> tuple[float, str] | None:
    """The unit slip that a ratio of two channels shows, and its factor; None for none."""
    size = abs(ratio)
    every = [(one, words) for words, value in unit_slips().items() for one in (value, 1.0 / value)]
    one, words = min(every, key=lambda item: abs(math.log(max(size, 1e-300) / item[0])))
    return (one, words) if abs(size / one - 1.0) < _LIKE else None
