"""Equilibria: straight and level self-propulsion, solved rather than preset."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from sim.kernel import rhs as kernel
from sim.kernel.layout import Model, workspace

Array = NDArray[np.float64]


class NoEquilibrium(RuntimeError):
    """No straight, level self-propelled state exists within the actuator limits.

    Examples
    --------
    >>> import ident
    >>> issubclass(ident.NoEquilibrium, RuntimeError)
    True
    """


@dataclass(frozen=True)
class Trim:
    """A straight, level self-propelled state.

    Attributes
    ----------
    state : (12,) state vector of the kernel.
    controls : (planes + 1,) deflections [rad] and n [1/s]; with tanks in use also ballast
        [kg] and shift of the centre of gravity [m].
    dV, dH : Commands that hold it [rad].
    residual : Largest acceleration left [m/s^2 or rad/s^2].
    limited : Which of ballast and trim_tank stand at their limit, so that pitch or planes
        hold what they cannot.
    lateral : Shift of the weight to starboard that keeps the boat upright [m].
    """

    state: Array
    controls: Array
    dV: float
    dH: float
    residual: float
    limited: tuple[str, ...] = ()
    lateral: float = 0.0


# What keeps the boat level, two unknowns each; the rest of pitch, dV and tanks is zero.
_LEVEL = {"planes": ("pitch", "dV"), "ballast": ("dV", "ballast"), "tanks": ("ballast", "trim_tank")}
# What takes over when a tank is at its limit.
_NEXT = {"trim_tank": "dV", "ballast": "pitch"}
TANK_NAMES = ("ballast", "trim_tank")


def _solve(
    model: Model,
    mixer: Array,
    speed: float,
    depth: float,
    free: tuple[str, ...],
    values: dict[str, float],
    upright: bool,
) -> tuple[Trim, str]:
    """Root of the six balances over n, heel (or, upright, y of the weight), drift, dH and ``free``.

    Returns
    -------
    The state found and, if it is no equilibrium, what is wrong with it.
    """
    work, derivative = workspace(model), np.zeros(12)
    # n relative to U/D: an advance coefficient near one. Tanks by what balances 1 % of weight.
    reference = speed / model.diameter
    size = {"pitch": 1.0, "dV": 1.0, "ballast": 0.01 * model.mass, "trim_tank": 1.0}
    x_g, y_g, z_g = model.r_g

    def build(x: Array) -> tuple[Array, Array, dict[str, float]]:
        n, first, second, heel, drift, dh = x
        if upright:
            heel = 0.0
        level = values | {k: float(size[k] * v) for k, v in zip(free, (first, second), strict=True)}
        pitch = level["pitch"]
        u = speed * np.cos(drift) * np.cos(pitch)
        v = speed * np.sin(drift)
        # Level flight: -sin(theta) u + sin(phi) cos(theta) v + cos(phi) cos(theta) w = 0.
        w = (np.sin(pitch) * u - np.sin(heel) * np.cos(pitch) * v) / (np.cos(heel) * np.cos(pitch))
        scale = speed / np.sqrt(u * u + v * v + w * w)
        state = np.zeros(12)
        state[:3] = u * scale, v * scale, w * scale
        state[8], state[9], state[10] = depth - model.sail_top, heel, pitch
        tanks = [level[k] for k in TANK_NAMES] if model.has_tanks else []
        return state, np.array([*(mixer @ np.array([level["dV"], dh])), n * reference, *tanks]), level

    def weighted(x: Array) -> Model:
        # Where nothing accelerates, the weight's place matters and the mass matrix does not.
        return model.replaced(r_g=(x_g, y_g + float(x[3]), z_g)) if upright else model

    def residual(x: Array) -> Array:
        state, controls, _ = build(x)
        kernel.rhs(weighted(x), state, controls, work, derivative)
        return derivative[:6].copy()

    found = root(residual, np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0]), method="hybr", tol=1e-13)
    state, controls, level = build(found.x)
    left = float(np.abs(residual(found.x)).max())
    wrong = ""
    if not np.isfinite(left) or left > 1e-8:
        wrong = (
            f"no self-propulsion state at {speed:.4g} m/s and D0 = {depth:.4g} m; {_closest(state, controls, mixer)}"
        )
    # The path is straight: heading such that the course is along earth x.
    kernel.rhs(weighted(found.x), state, controls, work, derivative)
    state[11] = -np.arctan2(derivative[7], derivative[6])
    lateral = float(found.x[3]) if upright else 0.0
    return Trim(state, controls, level["dV"], float(found.x[5]), left, lateral=lateral), wrong


def _closest(state: Array, controls: Array, mixer: Array) -> str:
    """What a search that failed came to, where that is a state of a boat at all."""
    angles = np.degrees(controls[: mixer.shape[0]])
    pitch, revolutions = float(np.degrees(state[10])), float(controls[mixer.shape[0]])
    if not np.isfinite([*angles, pitch, revolutions]).all() or max(np.abs(angles).max(initial=0.0), abs(pitch)) > 90.0:
        return "the search leaves all upright attitudes: planes, thrust and weight do not balance there"
    shown = ", ".join(f"{a:.1f}" for a in angles)
    return f"closest state: planes {shown} deg, pitch {pitch:.1f} deg, n {revolutions:.3g} 1/s"


def self_propulsion(
    model: Model,
    mixer: Array,
    speed: float,
    depth: float,
    plane_limit: Array,
    level: str = "planes",
    tank_limit: tuple[float, float] | None = None,
    held: tuple[float, float] = (0.0, 0.0),
    upright: bool = False,
) -> Trim:
    """Solve revolutions, heel, drift, dH and what keeps the boat level for straight flight.

    Parameters
    ----------
    model : The boat.
    mixer : (planes, 2) shares of dV and dH, Eq. (1).
    speed : Speed through the water [m/s].
    depth : D0, depth of the sail top [m].
    plane_limit : (planes,) [rad].
    level : ``planes``: pitch and dV are solved. ``ballast``: dV and ballast, pitch zero.
        ``tanks``: ballast and trim tank, pitch and dV zero. A tank that would pass its limit
        stands at it, and dV (for the trim tank) or the pitch (for ballast) is solved instead.
    tank_limit : Largest ballast [kg] and shift of the centre of gravity [m].
    held : Ballast and shift where they are not solved.
    upright : No heel: the weight is shifted across the boat against the propeller's torque.

    Raises
    ------
    NoEquilibrium
        When the six balances have no solution or a plane is beyond its limit.
    """
    free: tuple[str, ...] = _LEVEL[level]
    values = {"pitch": 0.0, "dV": 0.0} | dict(zip(TANK_NAMES, held, strict=True))
    limits = dict(zip(TANK_NAMES, tank_limit or (np.inf, np.inf), strict=True))
    limited: tuple[str, ...] = ()
    while True:
        found, wrong = _solve(model, mixer, speed, depth, free, values, upright)
        if wrong:
            raise NoEquilibrium(wrong)
        amounts = dict(zip(TANK_NAMES, found.controls[mixer.shape[0] + 1 :], strict=model.has_tanks))
        over = [k for k in reversed(TANK_NAMES) if k in free and abs(amounts[k]) > limits[k]]
        if not over:
            break
        values[over[0]] = float(np.sign(amounts[over[0]])) * limits[over[0]]
        free = tuple(_NEXT[k] if k == over[0] else k for k in free)
        limited += (over[0],)
    if np.any(np.abs(found.controls[: mixer.shape[0]]) > plane_limit):
        raise NoEquilibrium(f"self-propulsion at {speed:.4g} m/s and D0 = {depth:.4g} m needs a plane beyond its limit")
    return replace(found, limited=limited)
