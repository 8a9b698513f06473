"""The thrust deduction of a self-propelled hull, from its loads and those of its towed run."""

from __future__ import annotations

import math

import pandas as pd

from ident.captive.source import Deduction
from sim.boat.catalogue import OUTPUTS
from sim.files.frames import Frame


def thrust_deduction(table: pd.DataFrame, towed: pd.DataFrame, rule: Deduction, frame: Frame) -> pd.DataFrame:
    """Runs whose loads are replaced by the thrust deduction t.

    A towed hull has X = -R; behind the thrust T it has X = -(R + t T), so that t = (X_towed - X) / T with x
    forward (ITTC 7.5-02-03-01.4). The standard error is that of the two loads, over T.

    Parameters
    ----------
    table, towed : The runs with thrust, and the one without.
    rule : Thrust.
    frame : Of the loads.
    """
    out = table.drop(columns=[c for o in OUTPUTS for c in (o, f"s_{o}") if c in table])
    bare, s_bare = float(towed["X"].iloc[0]), float(towed["s_X"].iloc[0])
    out["t"] = [frame.sign("X") * (bare - float(x)) / rule.thrust_n for x in table["X"]]
    out["s_t"] = [math.hypot(float(s), s_bare) / rule.thrust_n for s in table["s_X"]]
    return out.assign(part="propeller")
