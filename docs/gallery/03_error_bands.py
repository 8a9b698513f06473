"""
Error bands of a maneuver
=========================

Every coefficient has a standard error, and correlations with others. Drawn and flown, they give the band that a
prediction has by what is known of the coefficients, and which of them make it wide.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import ident

desk = Path(tempfile.mkdtemp())
ident.write_starter(desk / "my-boat")
ident.fit(desk / "my-boat/captive", db=desk / "coeff_db")
done = ident.validate(desk / "my-boat/zigzag.toml", db=desk / "coeff_db").with_bands(200)

# %%
# As differences from the flight with the values themselves.
flight = np.degrees(done.simulation["psi"])
for level, shade in (("95", 0.2), ("50", 0.4)):
    low, high = done.bands.band("psi", level)
    plt.fill_between(
        done.bands.time, np.degrees(low) - flight, np.degrees(high) - flight, color="tab:red", alpha=shade, lw=0
    )
trial = done.reference["TRIAL"]["psi"]
plt.plot(
    trial.abscissa,
    np.degrees(trial.value) - np.interp(trial.abscissa, done.simulation["t"], flight),
    "k.",
    ms=4,
    label="trial",
)
plt.xlabel("t [s]")
plt.ylabel("heading less the flight's [deg], 50 and 95 % bands")
plt.legend()

# %%
# Which coefficients cause the width of the heading's band.
for entry in done.band_summary.variance_shares["psi"]:
    print(f"{entry.coefficient:>10} {100 * entry.share:4.0f} %")
