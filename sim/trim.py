"""Equilibria: straight and level self-propulsion, solved rather than preset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from sim import kernel

Array = NDArray[np.float64]


class NoEquilibrium(RuntimeError):
    """No straight, level self-propelled state exists within the actuator limits."""


@dataclass(frozen=True)
class Trim:
    """A straight, level self-propelled state.

    Attributes
    ----------
    state : (12,) state vector of the kernel.
    controls : (planes + 1,) deflections [rad] and n [1/s].
    dV, dH : Commands that hold it [rad].
    residual : Largest acceleration left [m/s^2 or rad/s^2].
    """

    state: Array
    controls: Array
    dV: float
    dH: float
    residual: float


def self_propulsion(model: kernel.Model, mixer: Array, speed: float, depth: float, plane_limit: Array) -> Trim:
    """Solve revolutions, plane commands, pitch, heel and drift for straight level flight.

    Parameters
    ----------
    model : The boat.
    mixer : (planes, 2) shares of dV and dH, Eq. (1).
    speed : Speed through the water [m/s].
    depth : D0, depth of the sail top [m].
    plane_limit : (planes,) [rad].

    Raises
    ------
    NoEquilibrium
        When the six balances have no solution or a plane is beyond its limit.
    """
    work = kernel.workspace(mixer.shape[0])
    derivative = np.zeros(12)
    # Unknowns: n relative to U/D (an advance coefficient near one), pitch, dV, heel, drift,
    # dH; earth velocity is horizontal.
    reference = speed / model.diameter

    def build(x: Array) -> tuple[Array, Array]:
        n, pitch, dv, heel, drift, dh = x
        u = speed * np.cos(drift) * np.cos(pitch)
        v = speed * np.sin(drift)
        # Level flight: -sin(theta) u + sin(phi) cos(theta) v + cos(phi) cos(theta) w = 0.
        w = (np.sin(pitch) * u - np.sin(heel) * np.cos(pitch) * v) / (np.cos(heel) * np.cos(pitch))
        scale = speed / np.sqrt(u * u + v * v + w * w)
        state = np.zeros(12)
        state[:3] = u * scale, v * scale, w * scale
        state[8], state[9], state[10] = depth - model.sail_top, heel, pitch
        return state, np.append(mixer @ np.array([dv, dh]), n * reference)

    def residual(x: Array) -> Array:
        state, controls = build(x)
        kernel.rhs(model, state, controls, work, derivative)
        return derivative[:6].copy()

    found = root(residual, np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0]), method="hybr", tol=1e-13)
    state, controls = build(found.x)
    left = float(np.abs(residual(found.x)).max())
    if not np.isfinite(left) or left > 1e-8:
        angles = ", ".join(f"{a:.1f}" for a in np.degrees(controls[:-1]))
        raise NoEquilibrium(
            f"no self-propulsion state at {speed:.4g} m/s and D0 = {depth:.4g} m; "
            f"closest found: planes {angles} deg, pitch {np.degrees(state[10]):.1f} deg, n {controls[-1]:.3g} 1/s"
        )
    if np.any(np.abs(controls[:-1]) > plane_limit):
        raise NoEquilibrium(f"self-propulsion at {speed:.4g} m/s and D0 = {depth:.4g} m needs a plane beyond its limit")
    # The path is straight: heading such that the course is along earth x.
    kernel.rhs(model, state, controls, work, derivative)
    state[11] = -np.arctan2(derivative[7], derivative[6])
    return Trim(state, controls, float(found.x[2]), float(found.x[5]), left)
