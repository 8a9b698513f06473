"""
Reading OpenFOAM
================

A computed drift run comes as the ``forces`` function object wrote it. Here such a folder is made up, in the form that
OpenFOAM v2106 and later write: a hull at 6 degrees drift whose loads settle. It joins the runs of the starter campaign.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import ident

desk = Path(tempfile.mkdtemp())
ident.write_starter(desk / "my-boat")

# %%
# What OpenFOAM leaves behind: force and moment, total, pressure and viscous, three components each.
folder = desk / "my-boat/captive/cfd/postProcessing/hull/0"
folder.mkdir(parents=True)
time = np.arange(0.1, 40.0, 0.1)
settling = 1.0 - 0.5 * np.exp(-time / 3.0)
noise = np.random.default_rng(3)
loads = {"Force": (-15.0, -85.0, 0.0), "Moment": (0.0, 0.0, -125.0)}
shares = "\t".join(" ".join(f"{share}_{axis}" for axis in "xyz") for share in ("total", "pressure", "viscous"))
for name, settled in loads.items():
    total = np.outer(settling, settled) * (1.0 + 0.01 * noise.standard_normal((time.size, 1)))
    table = np.column_stack([time, total, 0.8 * total, 0.2 * total])
    header = f"# {name}\n# CofR : (0 0 0)\n#\n# Time\t{shares}"
    np.savetxt(folder / f"{name.lower()}.dat", table, fmt="%.8g", header=header, comments="")

# %%
# One table in ``campaign.toml`` says what the files do not: which part, which state, how to reduce it.
source = """
[[source]]
files = "cfd"
reader = "openfoam"
rows = "history"
rho_inf = 1000.0
parts = { hull = "hull" }
[source.constants]
run_id = "CFD-6"
test = "drift_horizontal"
quality = "good"
source = "computed"
U = "1.5 m/s"
alpha = "0 deg"
beta = "6 deg"
D0 = "3.333 m"
[source.reduction]
kind = "steady"
"""
with open(desk / "my-boat/captive/campaign.toml", "a", encoding="utf-8") as file:
    file.write(source)
campaign = ident.read_campaign(desk / "my-boat/captive")
run = campaign.runs.set_index("run_id").loc["CFD-6-hull"]
print(run["file"], "|", run["reduction"])

# %%
# Full scale, program frame, among the measured runs of the tank.
drift = campaign.runs[campaign.runs["test"] == "drift_horizontal"]
plt.errorbar(np.degrees(drift["beta"]), drift["N"], yerr=drift["s_N"], fmt="o", ms=4, capsize=3, label="tank")
plt.errorbar(np.degrees(run["beta"]), run["N"], yerr=run["s_N"], fmt="s", capsize=3, label="OpenFOAM")
plt.xlabel("drift angle [deg]")
plt.ylabel("N [N m]")
plt.legend()
