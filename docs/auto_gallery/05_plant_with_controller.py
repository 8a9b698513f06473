"""
The boat as a plant with your own controller
============================================

A boat of the database that moves by your commands, a control sample at a time, through the same actuators and
integration as every simulated maneuver.
"""

import tempfile
from math import radians
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import ident

desk = Path(tempfile.mkdtemp())
ident.write_starter(desk / "my-boat")
ident.fit(desk / "my-boat/captive", db=desk / "coeff_db")
boat = ident.Plant.from_database(desk / "my-boat/zigzag.toml", desk / "coeff_db")


def heading(wanted, rate_gain):
    """Turn to a heading with a PD law, hold the depth; time, heading and rudder."""
    boat.reset()
    log = []
    while boat.time < 120.0:
        dH = 1.5 * (radians(wanted) - boat["psi"]) - rate_gain * boat["r"]
        dV = boat.trim.dV + 0.05 * (boat["z"] - boat.trim.state[8]) - 1.0 * (boat["theta"] - boat.trim.state[10])
        boat.step(dV=dV, dH=dH)
        log.append((boat.time, boat["psi"], boat["rudders"]))
    return np.array(log).T


# %%
figure, axes = plt.subplots(2, sharex=True)
for gain in (0.0, 6.0, 20.0):
    time, psi, rudder = heading(30.0, gain)
    axes[0].plot(time, np.degrees(psi), label=f"gain on r {gain:g} s")
    axes[1].plot(time, np.degrees(rudder))
axes[0].axhline(30.0, color="k", lw=0.6)
axes[0].set_ylabel("heading [deg]")
axes[1].set_ylabel("rudder [deg]")
axes[1].set_xlabel("t [s]")
axes[0].legend()

# %%
# A linear model of the same boat for the design of the gains: x' = A x + b dH.
(state,) = ident.stability(desk / "my-boat/zigzag.toml", db=desk / "coeff_db", speeds=[5.14444], depths=[40.0])
linear = state.linear["horizontal"]
print(linear.states)
print(np.array(linear.a).round(4))
print(np.array(linear.b).round(4))
