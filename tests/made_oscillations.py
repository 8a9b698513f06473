"""Oscillations in sway of known damping and inertia, as a table of harmonics and as a record."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from made_campaigns import campaign, history

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign

FREQUENCY, AMPLITUDE = 0.25, 0.3
OMEGA = 2.0 * math.pi * FREQUENCY
X, DAMPING, INERTIA = -4.0e4, -3.0e5, -9.0e5
N_DAMPING, N_INERTIA = -2.0e6, -1.0e5
SPEED, ACCELERATION = AMPLITUDE * OMEGA, -AMPLITUDE * OMEGA**2
CONSTANTS = """[source.constants]
part = "hull"
quality = "ok"
U = "5 m/s"
alpha = "0 deg"
beta = "0 deg"
D0 = "25 m"
"""
REDUCTION = '[source.reduction]\nkind = "oscillatory"\nmotion = "sway"\n'
TABLE = {
    "run_id": "s",
    "frequency [Hz]": FREQUENCY,
    "vdot [m/s^2]": ACCELERATION,
    "X_mean [N]": X,
    "Y_in [N]": INERTIA * ACCELERATION,
    "Y_out [N]": DAMPING * SPEED,
    "N_in [N m]": N_INERTIA * ACCELERATION,
    "N_out [N m]": N_DAMPING * SPEED,
}


def of_table(folder, keys: str = "", constants: str = CONSTANTS, reduction: str = REDUCTION, **changed: float):
    row = {k: v for k, v in (TABLE | changed).items() if v is not None}
    source = f'[[source]]\nfiles = "table.csv"\n{keys}\n{constants}rel_sigma = 0.05\n{reduction}'
    campaign(folder, source)
    pd.DataFrame([row]).to_csv(folder / "table.csv", index=False)
    runs = read_campaign(folder).runs
    return runs.set_index(runs["run_id"].str[-2:])


def record(phase: float = 0.0, start: float = 0.0) -> pd.DataFrame:
    time = start + np.arange(0.0, 80.0, 0.05)
    angle = OMEGA * time + phase
    s, c = np.sin(angle), np.cos(angle)
    noise = np.random.default_rng(2).standard_normal((3, time.size))
    return pd.DataFrame(
        {
            "time_s": time,
            "X_N": X + 10.0 * noise[0],
            "Y_N": DAMPING * SPEED * c + INERTIA * ACCELERATION * s + 10.0 * noise[1],
            "N_Nm": N_DAMPING * SPEED * c + N_INERTIA * ACCELERATION * s + 10.0 * noise[2],
            "displacement_m": AMPLITUDE * s,
        }
    )


def findings(folder, table: pd.DataFrame, keys: str = "", reduction: str = "", check: str = ""):
    campaign(folder, history("run.csv", keys, CONSTANTS, REDUCTION + reduction))
    table.to_csv(folder / "run.csv", index=False)
    return [f for f in check_campaign(read_campaign(folder), folder) if f.check == check]
