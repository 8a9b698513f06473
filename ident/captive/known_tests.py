"""The captive tests that the program knows."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import pandas as pd


@cache
def tests() -> pd.DataFrame:
    """Known captive tests by name: stage, required quantities, loads without which a boat is none, meaning."""
    with (files("ident") / "data" / "tests.csv").open(encoding="utf-8") as stream:
        return pd.read_csv(stream, keep_default_na=False).set_index("test")
