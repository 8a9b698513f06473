"""Physical numbers that no file of a user states, with their sources: ``sim/data/constants.csv``."""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files


@cache
def _table() -> dict[str, float]:
    with (files("sim") / "data" / "constants.csv").open(encoding="utf-8", newline="") as file:
        return {row["name"]: float(row["value"]) for row in csv.DictReader(file)}


def constant(name: str) -> float:
    """A physical number in the unit that the table states.

    Example
    -------
    >>> constant("standard_gravity")
    9.80665
    """
    return _table()[name]
