"""
Comparing two versions
======================

A campaign grows, or a run is corrected: each fit is a version that stays. What changed, by how much, in units of the
errors, and what that does to a maneuver.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import ident

desk = Path(tempfile.mkdtemp())
ident.write_starter(desk / "my-boat")
ident.fit(desk / "my-boat/captive", db=desk / "coeff_db", message="all runs")

# %%
# The same campaign without its drift runs at 12 degrees.
runs = desk / "my-boat/captive/drift_horizontal.csv"
header, *lines = runs.read_text("utf-8").splitlines(keepends=True)
runs.write_text(header + "".join(line for line in lines if line.split(",")[5] not in ("12", "-12")), "utf-8")
ident.fit(desk / "my-boat/captive", db=desk / "coeff_db", message="without drift of 12 degrees")
db = ident.Database(desk / "coeff_db")
db

# %%
change = db[0].diff(db[1])
change.table

# %%
# What drift decides, with 95 % intervals, in parts of the value of the first version.
names = ["Y_v", "Y_v|v|", "N_v", "N_v|v|", "X_vv"]
for version, shift in ((db[0], -0.1), (db[1], 0.1)):
    first = np.array([db[0][name].item() for name in names])
    values = np.array([version[name].item() for name in names]) / first
    errors = np.array([version[name].stderr.item() for name in names]) / np.abs(first)
    label = f"version {version.number}: {version.metadata['message']}"
    plt.errorbar(np.arange(len(names)) + shift, values, yerr=1.96 * errors, fmt="o", capsize=3, label=label)
plt.xticks(range(len(names)), names)
plt.ylabel("coefficient over that of version 0")
plt.legend()

# %%
# What became of a value: its runs and their source in either version.
for version in db:
    print(version.number, version["N_v"].n_runs.item(), version["N_v"].source.item()[:70])

# %%
for version in db:
    done = ident.validate(desk / "my-boat/zigzag.toml", db=desk / "coeff_db", version=version.number)
    plt.plot(done.simulation["t"], np.degrees(done.simulation["psi"]), label=f"version {version.number}")
plt.xlabel("t [s]")
plt.ylabel("heading [deg]")
plt.legend()
