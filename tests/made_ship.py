"""A small ship's campaign with tables beside the runs."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from made_campaigns import HEAD, campaign

ROOT = Path(__file__).parents[1]
MMG = ROOT / "tests" / "data" / "kvlcc2" / "kvlcc2.toml"
SHIP = {
    "vehicle": "kvlcc2.toml",
    "scale": "ratio = 1.0\nlength_m = 6.8927\ndraught_m = 0.448",
    "frame": 'x = "forward"\ny = "starboard"\nz = "down"\nangles = "flight"',
}
DENSITY, LENGTH, SPEED = 1000.0, 6.8927, 1.2
# 1/2 rho L^2, of the size of a tanker's.
DERIVATIVES = {"Y_v": -0.020, "N_v": -0.009, "Y_vdot": -0.0147}


def ship(folder: Path, factor: float = 1.0, tables: str = "", reference: str = "") -> Path:
    """Drift and acceleration tests with dimensionless loads, ``factor`` times too large."""
    folder.mkdir()
    shutil.copy(MMG, folder)
    rows = []
    for beta in (-8.0, -6.0, -4.0, -2.0, 2.0, 4.0, 6.0, 8.0):
        v = np.sin(np.radians(beta))
        loads = [DERIVATIVES["Y_v"] * v, DERIVATIVES["N_v"] * v]
        rows.append((f"D{beta:g}", "drift_horizontal", beta, 0.0, *(factor * x for x in loads)))
    for vdot in (-0.2, -0.1, 0.1, 0.2):
        rows.append((f"A{vdot:g}", "acceleration", 0.0, vdot, factor * DERIVATIVES["Y_vdot"] * vdot, 0.0))
    text = "run_id,test,beta [deg],vdot [-],Y [-],N [-]\n"
    text += "".join(",".join(str(x) if isinstance(x, str) else f"{x:.9g}" for x in row) + "\n" for row in rows)
    (folder / "runs.csv").write_text(text)
    source = '[[source]]\nfiles = "runs.csv"\nnormalisation = "half_rho_L2"\n[source.constants]\npart = "hull"\n'
    source += f'quality = "ok"\nU = "{SPEED} m/s"\nalpha = "0 deg"\nD0 = "0 m"\nrel_sigma = 0.03\n'
    more = {"tables": tables} if tables else {}
    campaign(folder, source, **{k: v for k, v in SHIP.items() if k != "vehicle"}, **more)
    path = folder / "campaign.toml"
    path.write_text(path.read_text().replace(HEAD, HEAD.replace('"bb2"', '"kvlcc2.toml"')))
    if reference:
        (folder / "printed.csv").write_text(reference)
    return folder


CONFIGURED = "configuration,appendages\nConfig 3,hull+sail\nA,hull\nB,hull+sail\n"
