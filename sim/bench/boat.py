"""The boat that speed is measured with: BB2 with coefficients of a fit, frozen.

``boat.csv`` is for speed alone. It has the shape of a real database, rounded, and is not kept in step
with what a fit gives today.
"""

from __future__ import annotations

from importlib.resources import files

import pandas as pd

from sim.boat.coefficients import Coefficients
from sim.boat.database import axis_columns
from sim.boat.vehicle import load_vehicle


def frozen_boat() -> Coefficients:
    """BB2 and its frozen coefficients."""
    with (files("sim") / "bench" / "boat.csv").open(encoding="utf-8") as stream:
        rows = pd.read_csv(stream, keep_default_na=False, na_values=[""], dtype={"part": str})
    rows["part"] = rows["part"].fillna("")
    for column in axis_columns():
        if column not in rows:
            rows[column] = float("nan")
    return Coefficients(load_vehicle("bb2"), rows)
