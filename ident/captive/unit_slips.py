"""Units that are taken for one another, and the factors by which numbers are off then."""

from __future__ import annotations

import math
from functools import cache
from importlib.resources import files

import pandas as pd

from ident.captive.quantities import factor

# A ratio as near to that of two units is theirs.
_LIKE = 0.06


@cache
def unit_slips() -> dict[str, float]:
    """Pairs of units that are taken for one another -> their ratio, above one; from ``data/unit_slips.csv``."""
    with (files("ident") / "data" / "unit_slips.csv").open(encoding="utf-8") as stream:
        rows = pd.read_csv(stream)
    ratios = {}
    for like, unit, instead, words in zip(rows["like"], rows["unit"], rows["instead"], rows["words"], strict=True):
        sizes = [factor(like, one) for one in (unit, instead)]
        assert sizes[0] is not None, words
        assert sizes[1] is not None, words
        ratios[words] = sizes[0] / sizes[1]
    return ratios


def factor_between(ratio: float) -> tuple[float, str] | None:
    """The unit slip that a ratio of two channels shows, and its factor; None for none."""
    size = abs(ratio)
    every = [(one, words) for words, value in unit_slips().items() for one in (value, 1.0 / value)]
    one, words = min(every, key=lambda item: abs(math.log(max(size, 1e-300) / item[0])))
    return (one, words) if abs(size / one - 1.0) < _LIKE else None
