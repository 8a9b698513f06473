"""Loads that are not those of the flow: weight and buoyancy, tares, inertia of the model."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.campaign_file import CampaignFile, Tare
from ident.captive.oscillation import HEEL, STOOD, TRIM
from ident.captive.quantities import TAKEN, factor
from ident.captive.run_table import MOTION
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.boat.forces import body_velocity
from sim.files.errors import InputError
from sim.files.frames import Frame

Array = NDArray[np.float64]

# Columns of an oscillation's states that say where gravity is in the body.
_ATTITUDE = (STOOD, HEEL, TRIM)


def without_hydrostatics(runs: pd.DataFrame, header: CampaignFile, frame: Frame) -> pd.DataFrame:
    """Take the stated hydrostatic load off, about the vehicle's origin, in the program frame.

    A force B upwards at r_B: F = -B g, M = r_B x F, with g the direction of gravity in the body,
    (-sin theta, cos theta sin phi, cos theta cos phi): theta is zero level and alpha pitched, and a body that
    oscillates in roll or pitch has the angle of the instant too. The flow of a heaving body does not pitch it.
    """
    out = runs.drop(columns=[c for c in _ATTITUDE if c in runs])
    stated = header.hydrostatics
    if stated is None:
        return out
    chosen = runs["part"].isin(stated.parts)
    stood, heel, trim = (runs[c] if c in runs else pd.Series(np.nan, index=runs.index) for c in _ATTITUDE)
    stands = (stood.where(stood.notna(), runs["alpha"]).fillna(0.0) * (stated.attitude == "pitched")).to_numpy(float)
    (sin_t, cos_t), (sin_p, cos_p) = (_swung(np.asarray(angle.fillna(0.0), dtype=float)) for angle in (trim, heel))
    sin, cos = np.sin(stands) * cos_t + np.cos(stands) * sin_t, np.cos(stands) * cos_t - np.sin(stands) * sin_t
    gravity = [-sin, cos * sin_p, cos * cos_p]
    force = -stated.force_n * np.stack(gravity, axis=1)
    arm = np.broadcast_to(np.array(frame.vector(stated.centre_m)), force.shape)
    load = np.hstack([force, np.cross(arm, force)])
    for output, one in zip(OUTPUTS, load.T, strict=True):
        out[output] = out[output] - np.where(chosen, one, 0.0)
    return out


def _swung(angle: Array) -> tuple[Array, Array]:
    """Sine and cosine of A sin(wt) at its ends; of the sine the first harmonic 2 J1(A): the third is left out."""
    # Imported here: it takes longer than reading most campaigns, few of which need it.
    from scipy.special import j1

    return 2.0 * j1(angle), np.cos(angle)


def tare_applies(runs: pd.DataFrame, tare: Tare) -> pd.Series:
    """Which runs a tare is taken off: (runs,) of bool."""
    chosen = pd.Series(True, index=runs.index)
    if tare.tests:
        chosen &= runs["test"].isin(tare.tests)
    if tare.parts:
        chosen &= runs["part"].isin(tare.parts)
    return chosen


def without_tare(runs: pd.DataFrame, tares: list[Tare], where: str) -> pd.DataFrame:
    """Take off stated zero readings and strut loads, in the campaign's frame.

    Raises
    ------
    InputError
        For a load without a number and a unit of force or moment.
    """
    out = runs.copy()
    for k, tare in enumerate(tares):
        chosen = tare_applies(runs, tare)
        place = f"{where}, key tare.{k}"
        for output, text in tare.loads.items():
            out.loc[chosen, output] = out.loc[chosen, output] - quantity_of(text, output, f"{place}.loads.{output}")
        for output, slope in tare.per_speed_squared.items():
            strut = slope * runs.loc[chosen, "U"].fillna(0.0) ** 2
            out.loc[chosen, output] = out.loc[chosen, output] - strut
    return out


def quantity_of(text: str, quantity: str, where: str) -> float:
    """``"5 m/s"`` as a number in the SI unit of a quantity.

    Raises
    ------
    InputError
        When it is not a finite number and one of the quantity's units.
    """
    number, _, unit = text.strip().partition(" ")
    try:
        value = float(number)
    except ValueError:
        value = float("nan")
    scale = factor(quantity, unit.strip())
    if scale is None or not np.isfinite(value * scale):
        raise InputError(where, repr(text[:60]), f"a number and a unit of {quantity}, such as '1.5 N' or '3 deg'")
    return value * scale


def without_inertia(runs: pd.DataFrame, header: CampaignFile, frame: Frame) -> pd.DataFrame:
    """Add m a of the model back to loads that contain it: measured = water - m a.

    Rigid-body loads about the vehicle's origin, Fossen (2011), Eq. (3.33), in the program
    frame at model scale: F = m (dv/dt + w x v + dw/dt x r + w x (w x r)) and
    M = I_G dw/dt + w x I_G w + r x F.

    Parameters
    ----------
    runs : In the program frame, moments about the vehicle's origin.
    header : For ``[inertia]``.
    frame : Of the campaign, for the centre of gravity.
    """
    inertia = header.inertia
    if not inertia.model_inertia_in_loads:
        return runs
    assert inertia.mass_kg is not None
    assert inertia.centre_of_gravity_m is not None
    assert inertia.tensor_kgm2 is not None
    arm = np.array(frame.vector(inertia.centre_of_gravity_m))
    xx, yy, zz, xy, yz, zx = [*inertia.tensor_kgm2, 0.0, 0.0, 0.0][:6]
    xy, yz, zx = (v * s for v, s in zip((xy, yz, zx), _product_signs(frame), strict=True))
    tensor = np.array([[xx, -xy, -zx], [-xy, yy, -yz], [-zx, -yz, zz]])
    chosen = runs["part"].isin(inertia.parts).to_numpy()
    state = runs[["U", "alpha", "beta", *MOTION]].fillna(0.0)
    velocity = np.array([body_velocity(*row) for row in state[["U", "alpha", "beta"]].to_numpy()])
    rates = state[["p", "q", "r"]].to_numpy()
    linear, angular = state[list(ACCELERATIONS[:3])].to_numpy(), state[list(ACCELERATIONS[3:])].to_numpy()
    acceleration = linear + np.cross(rates, velocity) + np.cross(angular, arm) + np.cross(rates, np.cross(rates, arm))
    force = inertia.mass_kg * acceleration
    moment = angular @ tensor + np.cross(rates, rates @ tensor) + np.cross(np.broadcast_to(arm, force.shape), force)
    out = runs.copy()
    for output, load in zip(OUTPUTS, np.hstack([force, moment]).T, strict=True):
        # A relative error is one of what the balance measured, inertia included.
        out[f"size_{output}"] = as_measured(out, output).where(chosen)
        out[output] = out[output] + np.where(chosen, load, 0.0)
    return out


def as_measured(runs: pd.DataFrame, output: str) -> pd.Series:
    """Size that a relative error is of: the load, or total and part in squares where a part was taken off."""
    if TAKEN + output not in runs:
        return runs[output].abs()
    taken = runs[TAKEN + output].fillna(0.0)
    return ((runs[output] + taken) ** 2 + taken**2) ** 0.5


def _product_signs(frame: Frame) -> tuple[int, int, int]:
    """Signs that turn Ixy, Iyz, Izx, integrals over two coordinates."""
    s = frame.signs
    return s["x"] * s["y"], s["y"] * s["z"], s["z"] * s["x"]
