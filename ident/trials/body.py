"""Rates and speeds along the axes of the boat, from the angles and the track that a record holds.

A gyro on a gimbal gives the rate of the heading, one that is strapped down the yaw rate r: in a turn with
heel and trim they differ by some percent (Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion
Control, section 2.2.1). Metrics of rates are those of the body, as those of flights are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Channels = dict[str, Array]


def yaw_rate(values: Channels, rates: Channels) -> Array:
    """Yaw rate r [rad/s]: the recorded one, else from the angles, heel and pitch zero where they are not recorded.

    Parameters
    ----------
    values : Channels on one time grid: perhaps ``r``, ``phi``, ``theta``.
    rates : Their rates: ``psi``, perhaps ``theta``.

    Returns
    -------
    r = psi' cos(theta) cos(phi) - theta' sin(phi).
    """
    if "r" in values:
        return values["r"]
    phi, theta = values.get("phi", np.zeros(1)), values.get("theta", np.zeros(1))
    return np.asarray(rates["psi"] * np.cos(theta) * np.cos(phi) - rates.get("theta", np.zeros(1)) * np.sin(phi))


def pitch_rate(values: Channels, rates: Channels) -> Array:
    """Pitch rate q [rad/s]: the recorded one, else theta' cos(phi) + psi' cos(theta) sin(phi)."""
    if "q" in values:
        return values["q"]
    phi = values.get("phi", np.zeros(1))
    return np.asarray(
        rates["theta"] * np.cos(phi) + rates.get("psi", np.zeros(1)) * np.cos(values["theta"]) * np.sin(phi)
    )


def body_rate(name: str, values: Channels, rates: Channels) -> Array:
    """The rate r, q or p that the angles say [rad/s]; without both heel and pitch that of its angle.

    Parameters
    ----------
    name : ``r``, ``q`` or ``p``.
    values, rates : Of ``psi``, ``theta`` and ``phi`` at the same times, as far as they are recorded.
    """
    angles = {n: v for n, v in values.items() if n in ("psi", "theta", "phi")}
    inclined = {"phi", "theta"} <= set(angles)
    if name == "r":
        return yaw_rate(angles, rates) if inclined else rates["psi"]
    if name == "q":
        return pitch_rate(angles, rates) if inclined else rates["theta"]
    return rates["phi"] - (np.sin(angles["theta"]) * rates.get("psi", np.zeros(1)) if inclined else 0.0)


def velocities(values: Channels, rates: Channels) -> Channels:
    """Speeds u, v, w [m/s] of a track along the axes of the boat; horizontal ones without heel or pitch.

    Where heel and pitch are recorded and depth is not, it is taken as kept.

    Parameters
    ----------
    values : Channels with ``psi``, perhaps ``phi`` and ``theta``.
    rates : Rates of ``north`` and ``east``, perhaps of ``z``.
    """
    psi = values["psi"]
    ahead = rates["north"] * np.cos(psi) + rates["east"] * np.sin(psi)
    abeam = rates["east"] * np.cos(psi) - rates["north"] * np.sin(psi)
    if not {"phi", "theta"} <= set(values):
        return {"u": ahead, "v": abeam}
    cf, sf, ct, st = (f(values[k]) for k in ("phi", "theta") for f in (np.cos, np.sin))
    down = rates.get("z", np.zeros(1))
    inclined = ahead * st + down * ct
    return {"u": ahead * ct - down * st, "v": abeam * cf + inclined * sf, "w": inclined * cf - abeam * sf}


def angle_rate(angle: str, rate: Array, values: Channels, rates: Channels) -> Array:
    """The rate of an Euler angle from the body rate of its axis; without heel and pitch they are one.

    Parameters
    ----------
    angle : ``psi``, ``theta`` or ``phi``.
    rate : r, q or p [rad/s].
    values, rates : Of ``phi``, ``theta`` and ``psi`` at the same times, as far as they are recorded.
    """
    phi, theta = values.get("phi", np.zeros(1)), values.get("theta", np.zeros(1))
    none = np.zeros(1)
    if angle == "psi":
        turning = (rates.get("theta", none) * np.tan(phi) + rate / np.cos(phi)) / np.cos(theta)
    elif angle == "theta":
        turning = (rate - rates.get("psi", none) * np.cos(theta) * np.sin(phi)) / np.cos(phi)
    else:
        turning = rate + rates.get("psi", none) * np.sin(theta)
    return np.asarray(turning)
