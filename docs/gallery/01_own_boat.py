"""
Own boat: from captive runs to a zigzag
=======================================

The starter boat, fitted and flown: its captive loads are computed from known coefficients with 2 % noise, and its
"trial" is the same boat flown with them.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import ident

desk = Path(tempfile.mkdtemp())
files = ident.write_starter(desk / "my-boat")
print(len(files), "files, of which", *[f.name for f in files if f.suffix == ".toml"])

# %%
# What was measured, and what is wrong with it.
campaign = ident.read_campaign(desk / "my-boat/captive")
campaign

# %%
(checked,) = ident.check(desk / "my-boat/captive")
print(checked.counts)

# %%
# Identify, commit one version, look at what the runs support.
(fitted,) = ident.fit(desk / "my-boat/captive", db=desk / "coeff_db")
fitted.coefficients.sort_values("median_relative_error").tail(5)

# %%
# Fly the zigzag and hold it against the trial.
done = ident.validate(desk / "my-boat/zigzag.toml", db=desk / "coeff_db")
done.table

# %%
trial = done.reference["TRIAL"]["psi"]
plt.plot(trial.abscissa, np.degrees(trial.value), ".", label="trial")
plt.plot(done.simulation["t"], np.degrees(done.simulation["psi"]), label="simulated from the database")
plt.xlabel("t [s]")
plt.ylabel("heading [deg]")
plt.legend()
