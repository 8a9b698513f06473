"""Physical numbers that no file of a user states, with their sources: ``sim/data/constants.csv``."""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from typing import NamedTuple


class Constant(NamedTuple):
    """A row of the table."""

    name: str
    value: float
    unit: str
    meaning: str
    source: str


@cache
def constants() -> dict[str, Constant]:
    """Every constant by its name."""
    rows = csv.DictReader((files("sim") / "data" / "constants.csv").read_text("utf-8").splitlines())
    return {r["name"]: Constant(r["name"], float(r["value"]), r["unit"], r["meaning"], r["source"]) for r in rows}


def constant(name: str) -> float:
    """A physical number in the unit that the table states.

    Example
    -------
    >>> constant("standard_gravity")
    9.80665
    """
    return constants()[name].value
