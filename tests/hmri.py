"""KVLCC2 captive tests of HMRI as run tables: small adapters to the extracts in ``data/published``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ident.captive.run_table import run_table
from ident.checks.findings import Body

DATASETS = Path(__file__).parent / "data" / "published"
HMRI = DATASETS / "hmri"
# channel_definitions.txt: Lpp 6.893 m at scale 46.426, mass 3123 kg, Izz 9516 kg m2; d = 0.448 m
# is the ship's 20.8 m at that scale.
KVLCC2 = Body(6.8926, 1000.0, 3123.0, (float("nan"), float("nan"), 9516.0), 0.448, "channel_definitions.txt")


def sheet(name: str, test: str, loads: dict[str, str]) -> pd.DataFrame:
    """One HMRI sheet as a run table in the program frame, SI.

    ``loads`` names the column of each load. Loads are in 1/2 rho L^2 U^2, rates in U/L;
    beta is the ship's drift angle, positive with port windward.
    """
    table = pd.read_csv(HMRI / name)
    table.columns = [c.split("(")[0].strip() for c in table.columns]
    speed = table["Speed"].astype(float)
    pressure = 0.5 * KVLCC2.density * KVLCC2.length**2 * speed**2
    columns = {"run_id": table["Run No."].astype(str), "U": speed, "n": table.get("rps", table.get("RPS"))}
    for ours, theirs, sign in (("beta", "beta", -1.0), ("plane", "delta", 1.0)):
        if theirs in table:
            columns[ours] = sign * np.deg2rad(table[theirs].astype(float))
    # In-phase components answer the acceleration, out-of-phase ones the velocity.
    motions = {"r": 1} if loads is PMM else {"rdot": 2, "vdot": 2}
    for rate, power in motions.items():
        if rate in table:
            columns[rate] = table[rate] * speed**power / KVLCC2.length ** (power if rate != "vdot" else 1)
    for output, column in loads.items():
        columns[output] = table[column] * pressure * (KVLCC2.length if output in "KMN" else 1.0)
    columns["test"] = table.get("test type", test)
    return run_table(columns | {"part": "hull", "file": name})


STATIC = {"X": "X'", "Y": "Y'", "N": "N'"}
PMM = {"X": "X_mean'", "Y": "Y_out'", "N": "N_out'"}
