"""The run table: one row a captive run, in SI and radians. Its columns stand here and nowhere else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from sim.boat.catalogue import ACCELERATIONS, OUTPUTS

# Angular velocity and all six accelerations of a run.
MOTION = ("p", "q", "r", *ACCELERATIONS)
# What a run was made at: speed, flow angles, depth, plane angle, revolutions, advance ratio, motion.
STATES = ("U", "alpha", "beta", "D0", "plane", "n", "J", *MOTION)
# Results of propeller tests that are coefficients already.
PROPULSION = ("KT", "KQ", "t")
# Everything that is a coefficient as it stands; ``value`` belongs to a published ``coefficient``.
DIRECT = (*PROPULSION, "value")
# What a run measures.
MEASURED = (*OUTPUTS, *DIRECT)
# Numbers that a table has, blank where no file gives them.
NUMBERS = (*STATES[:7], "rel_sigma", *MOTION, *MEASURED)
# Texts that a file may give, and those it must.
TEXT = (
    "run_id",
    "test",
    "part",
    "quality",
    "source",
    "copy_of",
    "exclude",
    "reason",
    "decoupled",
    "coefficient",
    "unit",
)
REQUIRED = TEXT[:5]
# Texts that quality checks read.
_CHECKED = ("run_id", "test", "part", "quality", "copy_of", "exclude", "file")


def sigma(measured: str) -> str:
    """Column of the standard error of a load or coefficient: ``s_X`` for ``X``."""
    return f"s_{measured}"


def excludes(runs: pd.DataFrame, measured: str) -> bool:
    """Whether column ``exclude`` of any run names a load or coefficient."""
    return any(measured in text.split() for text in runs["exclude"].unique())


def excluded(runs: pd.DataFrame, measured: str) -> pd.Series:
    """True for runs whose column ``exclude`` names a load or coefficient."""
    if not excludes(runs, measured):
        return pd.Series(False, index=runs.index)
    texts = runs["exclude"]
    return texts.map({text: measured in text.split() for text in texts.unique()}).astype(bool)


def run_table(columns: Mapping[str, Any]) -> pd.DataFrame:
    """A table of your own runs with every column the checks read.

    Parameters
    ----------
    columns : As in ``Campaign.runs``: SI, radians, program frame. Missing states and loads
        are NaN, missing texts empty, ``row`` counts from 2.

    Example
    -------
    >>> table = run_table({"run_id": ["a"], "U": [5.0], "Y": [1000.0], "s_Y": [10.0]})
    >>> int(table.loc[0, "row"]), float(table.loc[0, "s_Y"])
    (2, 10.0)
    """
    table = pd.DataFrame(dict(columns))
    for name in (*STATES, *MEASURED, "rel_sigma", *(sigma(o) for o in MEASURED)):
        table[name] = pd.to_numeric(table[name]).astype(float) if name in table else np.nan
    for name in _CHECKED:
        table[name] = table[name].astype(str) if name in table else ""
    if "row" not in table:
        table["row"] = np.arange(len(table)) + 2
    return table.reset_index(drop=True)
