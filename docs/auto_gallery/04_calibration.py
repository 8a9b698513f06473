"""
Calibration from a trial
========================

Multipliers of coefficient groups from a free-running maneuver, with priors: what is believed before it, what the
maneuver alone says, and what follows from both. The result is a new version; the captive one stays.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import ident

desk = Path(tempfile.mkdtemp())
ident.write_starter(desk / "my-boat")
ident.fit(desk / "my-boat/captive", db=desk / "coeff_db")
print((desk / "my-boat/calibration.toml").read_text("utf-8"))

# %%
done = ident.calibrate(desk / "my-boat/calibration.toml", db=desk / "coeff_db", left_out=False)
done.groups

# %%
place = range(len(done.groups))
plt.errorbar(done.groups["prior"], place, xerr=done.groups["prior_sigma"], fmt="o", capsize=4, label="prior")
plt.errorbar(
    done.groups["posterior"], [p + 0.15 for p in place], xerr=done.groups["posterior_sigma"], fmt="s", capsize=4,
    label="posterior",
)  # fmt: skip
plt.yticks(list(place), done.groups.index)
plt.xlabel("multiplier, with one standard deviation")
plt.legend()

# %%
# Error against the trial before and after.
for version in ident.Database(desk / "coeff_db"):
    error = ident.validate(desk / "my-boat/zigzag.toml", db=desk / "coeff_db", version=version.number).errors["TRIAL"][
        "psi"
    ]
    print(f"version {version.number}: {error.rmse:.3f} {error.unit}")
