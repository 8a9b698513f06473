"""The captive tests that the program knows."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import pandas as pd


@cache
def tests() -> pd.DataFrame:
    """Known captive tests by name: stage, required quantities, other states that count, essential loads, meaning."""
    with (files("ident") / "data" / "tests.csv").open(encoding="utf-8") as stream:
        return pd.read_csv(stream, keep_default_na=False).set_index("test")


@cache
def states(test: str) -> frozenset[str]:
    """Quantities of the state that a run of a test may have: those it requires, and those that count beside them."""
    row = tests().loc[test]
    names = f"{row['requires']} {row['states']}".replace("delta", "plane").split()
    return frozenset(names)
