"""Equilibria: straight and level self-propulsion, solved rather than preset."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim.boat.state import PSI, THETA, X, Y
from sim.flight.balance import DV, SCRATCH, Search, attempt, balance
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

    Examples
    --------
    >>> import ident
    >>> flight = ident.validate("my-boat/zigzag.toml", db="coeff_db", version=0).simulation
    >>> flight.trim is None or flight.trim.residual < 1e-6
    True
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
_NAMES = ("pitch", "dV", *TANK_NAMES)
# Largest acceleration that counts as none [m/s^2, rad/s^2].
_BALANCED = 1e-8


def _search(
    model: Model,
    mixer: Array,
    speed: float,
    depth: float,
    free: tuple[str, ...],
    values: dict[str, float],
    upright: bool,
) -> Search:
    """What the balances are worked out in."""
    work = workspace(model)
    planes, tanks = mixer.shape[0], len(TANK_NAMES) if model.has_tanks else 0
    return Search(
        *(model.real, model.whole, work.real, work.whole),
        speed=float(speed),
        z=float(depth - model.sail_top),
        mixer=np.ascontiguousarray(mixer),
        free=np.array([_NAMES.index(k) for k in free]),
        level=np.array([values[k] for k in _NAMES]),
        # Ballast by what balances 1 % of the weight.
        size=np.array([1.0, 1.0, 0.01 * model.mass, 1.0]),
        upright=bool(upright),
        y=np.zeros(12),
        c=np.zeros(planes + 1 + tanks),
        dy=np.zeros(12),
        a=np.zeros(SCRATCH),
    )


def _solve(search: Search, model: Model) -> tuple[Trim, str]:
    """Root of the six balances over n, heel (or, upright, y of the weight), drift, dH and what is free.

    Returns
    -------
    The state found and, if it is no equilibrium, what is wrong with it.
    """
    state, derivative, controls = search.y, search.dy, search.c

    def residual(x: Array) -> Array:
        attempt(search, x)
        return derivative[:6].copy()

    # n relative to U/D: an advance coefficient near one.
    start = np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    x = start.copy()
    if not balance(search, x) <= _BALANCED:
        # Newton's method gives up at kinks of the tables that a trust region may pass.
        from scipy.optimize import root

        x = root(residual, start, method="hybr", tol=1e-13).x
    left = float(np.abs(residual(x)).max())
    wrong = ""
    if not left <= _BALANCED:
        place_of = f"{search.speed:.4g} m/s and D0 = {search.z + model.sail_top:.4g} m"
        wrong = f"no self-propulsion state at {place_of}; {_closest(state, controls, search.mixer)}"
    # The path is straight: heading such that the course is along earth x.
    # Along north through the water, whatever carries it.
    state[PSI] = -np.arctan2(derivative[Y] - model.current[1], derivative[X] - model.current[0])
    lateral = float(x[3]) if search.upright else 0.0
    return Trim(state, controls, float(search.level[DV]), float(x[5]), left, lateral=lateral), wrong


def _closest(state: Array, controls: Array, mixer: Array) -> str:
    """What a search that failed came to, where that is a state of a boat at all."""
    angles = np.degrees(controls[: mixer.shape[0]])
    pitch, revolutions = float(np.degrees(state[THETA])), float(controls[mixer.shape[0]])
    if not np.isfinite([*angles, pitch, revolutions]).all() or max(np.abs(angles).max(initial=0.0), abs(pitch)) > 90.0:
        return "the search leaves all upright attitudes: planes, thrust and weight do not balance there"
    shown = ", ".join(f"{a:.1f}" for a in angles)
    planes = f"planes {shown} deg" if angles.size else "no planes to hold it level"
    return f"closest state: {planes}, pitch {pitch:.1f} deg, n {revolutions:.3g} 1/s"


@dataclass(frozen=True)
class Leveling:
    """What keeps a boat level in straight flight.

    Attributes
    ----------
    by : ``planes``: pitch and dV are solved. ``ballast``: dV and ballast, pitch zero.
        ``tanks``: ballast and trim tank, pitch and dV zero. A tank that would pass its limit
        stands at it, and dV (for the trim tank) or the pitch (for ballast) is solved instead.
    tank_limit : Largest ballast [kg] and shift of the centre of gravity [m].
    held : Ballast and shift where they are not solved.
    upright : No heel: the weight is shifted across the boat against the propeller's torque.
    """

    by: str = "planes"
    tank_limit: tuple[float, float] | None = None
    held: tuple[float, float] = (0.0, 0.0)
    upright: bool = False


def self_propulsion(
    model: Model,
    mixer: Array,
    speed: float,
    depth: float,
    plane_limit: Array,
    leveling: Leveling | None = None,
) -> Trim:
    """Solve revolutions, heel, drift, dH and what keeps the boat level for straight flight.

    Parameters
    ----------
    model : The boat.
    mixer : (planes, 2) shares of dV and dH, Eq. (1).
    speed : Speed through the water [m/s].
    depth : D0, depth of the sail top [m].
    plane_limit : (planes,) [rad].
    leveling : What keeps the boat level; its planes when None.

    Raises
    ------
    NoEquilibrium
        When the six balances have no solution or a plane is beyond its limit.
    """
    leveling = leveling or Leveling()
    free: tuple[str, ...] = _LEVEL[leveling.by]
    values = {"pitch": 0.0, "dV": 0.0} | dict(zip(TANK_NAMES, leveling.held, strict=True))
    limits = dict(zip(TANK_NAMES, leveling.tank_limit or (np.inf, np.inf), strict=True))
    limited: tuple[str, ...] = ()
    while True:
        trim, wrong = _solve(_search(model, mixer, speed, depth, free, values, leveling.upright), model)
        if wrong:
            raise NoEquilibrium(wrong)
        amounts = dict(zip(TANK_NAMES, trim.controls[mixer.shape[0] + 1 :], strict=model.has_tanks))
        over = [k for k in reversed(TANK_NAMES) if k in free and abs(amounts[k]) > limits[k]]
        if not over:
            break
        values[over[0]] = float(np.sign(amounts[over[0]])) * limits[over[0]]
        free = tuple(_NEXT[k] if k == over[0] else k for k in free)
        limited += (over[0],)
    if np.any(np.abs(trim.controls[: mixer.shape[0]]) > plane_limit):
        raise NoEquilibrium(f"self-propulsion at {speed:.4g} m/s and D0 = {depth:.4g} m needs a plane beyond its limit")
    return replace(trim, limited=limited)
