"""`ident stability`: stability indices, eigenvalues and critical speeds from a version."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ident.analysis.derivatives import loads, prime_scale, slope, steps
from ident.analysis.result import Linear, Stability, StabilityMap
from ident.analysis.state_space import rate_change, state_space
from sim.boat.catalogue import OUTPUTS, STATES
from sim.boat.coefficients import Coefficients
from sim.boat.database import read_rows
from sim.boat.mass import Environment, added_mass_matrix
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.flight.case import Case, load_case
from sim.flight.plausible import within_limits
from sim.flight.simulate import environment_of, mixer_of, plane_limits
from sim.flight.trim import NoEquilibrium, self_propulsion
from sim.kernel.assemble import assemble
from sim.kernel.layout import Model

Array = NDArray[np.float64]
# States of the linearised boat: positions x, y and heading are neutral and left out.
_VERTICAL = (0, 2, 4, 8, 10)
_HORIZONTAL = (1, 3, 5, 9)
# Accelerations whose added mass a plane of motion cannot do without: w, q and v, r.
_VERTICAL_INERTIA, _HORIZONTAL_INERTIA = (2, 4), (1, 5)
_PLANES = ("vertical", "horizontal")
_TABLE_STEP = 1e-4
_DEFLECTION = math.radians(1.0)


def stability_index(force: float, moment: float, force_rate: float, moment_rate: float, mass: float) -> float:
    """Stability index G of one plane of motion.

    Gv = 1 - M_w (Z_q + m') / (Z_w M_q), Gh = 1 - N_v (Y_r - m') / (Y_v N_r), Feldman
    (1987); straight motion is stable for G > 0.

    Parameters
    ----------
    force, moment : Z_w, M_w or Y_v, N_v in prime form.
    force_rate, moment_rate : Z_q, M_q or Y_r, N_r in prime form.
    mass : +m' for the vertical, -m' for the horizontal plane, m' = m / (1/2 rho L^3).

    Returns
    -------
    G; infinite when force or moment_rate vanish.
    """
    damping = force * moment_rate
    return 1.0 - moment * (force_rate + mass) / damping if damping else math.inf


def critical_speed(stiffness: float, z_w: float, m_w: float, z_d: float, m_d: float) -> float | None:
    """Reversal speed of a group of planes.

    In steady straight motion Z_w w + Z_d U delta = 0 and M_w w U + M_d U^2 delta =
    stiffness theta; the path angle theta - w/U vanishes at
    U^2 = stiffness / (M_w - M_d Z_w / Z_d).

    Parameters
    ----------
    stiffness : W BG / (1/2 rho L^3) [m^2/s^2].
    z_w, m_w, z_d, m_d : Prime derivatives by w/U and by the deflection.

    Returns
    -------
    Speed [m/s], None when the planes keep their sense at every speed.
    """
    if z_d == 0.0:
        return None
    turning = m_w - m_d * z_w / z_d
    return math.sqrt(stiffness / turning) if stiffness * turning > 0.0 else None


def _plane_slope(model: Model, vehicle: Vehicle, names: list[str], speed: float, depth: float) -> Array:
    """Loads by the vertical command on some planes [N, N m per rad]."""
    shares = np.array([p.mixer.dV if p.name in names else 0.0 for p in vehicle.planes])
    motion = np.array([speed, 0.0, 0.0, 0.0, 0.0, 0.0])
    up, down = (loads(model, motion, depth, np.append(s * _DEFLECTION * shares, 0.0)) for s in (1.0, -1.0))
    return (up - down) / (2.0 * _DEFLECTION)


def _linear(
    model: Model, vehicle: Vehicle, state: Array, controls: Array, kept: tuple[int, ...], step: float
) -> Linear:
    """Central differences of the right-hand side; ``step`` in a state, a degree in the command."""
    change = rate_change(model, state, controls)
    axis = "dV" if 2 in kept else "dH"
    shares = np.array([getattr(p.mixer, axis) for p in vehicle.planes] + [0.0])
    none = np.zeros_like(controls)
    a = np.column_stack([change(step * np.eye(12)[j], none)[list(kept)] / step for j in kept])
    b = change(np.zeros(12), _DEFLECTION * shares)[list(kept)] / _DEFLECTION
    about = [float(state[j]) for j in kept]
    return Linear(tuple(STATES[j] for j in kept), axis, a.tolist(), b.tolist(), about)


def _eigenvalues(linear: Linear) -> list[tuple[float, float]]:
    """Least stable first."""
    values = np.linalg.eigvals(np.array(linear.a))
    return [(float(v.real), float(v.imag)) for v in sorted(values, key=lambda v: (-v.real, v.imag))]


def _linear_models(
    coefficients: Coefficients, environment: Environment, model: Model, speed: float, depth: float
) -> tuple[dict[str, Linear], str]:
    """Linear models, vertical and horizontal, as far as there are any; the state they are about."""
    vehicle = coefficients.vehicle
    step = _TABLE_STEP if vehicle.terms_of.tabulated else min(steps(vehicle))
    kept, about = [_VERTICAL, _HORIZONTAL], "self-propulsion"
    if coefficients.get("KT") is None:
        kept, about = [_VERTICAL[1:], _HORIZONTAL], "speed held"
        state, controls = np.zeros(12), np.zeros(len(vehicle.planes) + 1)
        state[0], state[8] = speed, depth - model.sail_top
    else:
        try:
            trim = self_propulsion(model, mixer_of(vehicle), speed, depth, plane_limits(vehicle)[0])
            limits = vehicle.needed_propeller("self-propulsion").limits.value
            within_limits(float(trim.controls[len(vehicle.planes)]), limits, speed, depth)
        except NoEquilibrium:
            return {}, about
        state, controls = trim.state, trim.controls
    added = np.diag(added_mass_matrix(coefficients, environment))
    models = {}
    for name, inertia, states in zip(_PLANES, (_VERTICAL_INERTIA, _HORIZONTAL_INERTIA), kept, strict=True):
        if (added[list(inertia)] > 0.0).all():
            models[name] = _linear(model, vehicle, state, controls, states, step)
    return models, about


def stability_at(coefficients: Coefficients, environment: Environment, speed: float, depth: float) -> Stability:
    """Stability of straight level motion.

    Parameters
    ----------
    coefficients : Of one vehicle.
    environment : Water density and gravity.
    speed, depth : U [m/s], D0 [m].

    Returns
    -------
    Stability; derivatives of the whole boat with the steps of ``ident.analysis.derivatives``.
    """
    vehicle, model = coefficients.vehicle, assemble(coefficients, environment)
    particulars = vehicle.particulars
    length, density = particulars.length.value, environment.density
    slopes = {m: slope(model, vehicle, m, speed, depth, 0.0) for m in "vwqr"}

    def prime(symbol: str) -> float:
        output, motion = symbol.split("_")
        return float(slopes[motion][OUTPUTS.index(output)] / (prime_scale(output, motion, density, length) * speed))

    volume = 0.5 * density * length**3
    mass = particulars.mass.value / volume
    bg = particulars.centre_of_gravity.value[2] - particulars.centre_of_buoyancy.value[2]
    stiffness = model.weight * bg / volume
    dynamic = 0.5 * density * length**2 * speed**2
    reversal = {}
    for group, aft in (("stern", True), ("sail", False)):
        planes = [p.name for p in vehicle.planes if p.is_aft is aft]
        by_command = _plane_slope(model, vehicle, planes, speed, depth)
        z_d, m_d = by_command[2] / dynamic, by_command[4] / (dynamic * length)
        reversal[group] = critical_speed(stiffness, prime("Z_w"), prime("M_w"), z_d, m_d)

    def index(motions: str, outputs: str, inertia: float) -> float | None:
        force, moment, force_rate, moment_rate = (prime(f"{o}_{m}") for m in motions for o in outputs)
        value = stability_index(force, moment, force_rate, moment_rate, inertia)
        return value if math.isfinite(value) else None

    def neutral_point(output: str, by: str, sign: float) -> float | None:
        force = prime(f"{output[0]}_{by}")
        return sign * prime(f"{output[1]}_{by}") / force if force else None

    linear, about = _linear_models(coefficients, environment, model, speed, depth)
    values = {name: _eigenvalues(one) for name, one in linear.items()}
    return Stability(
        speed=speed,
        depth=depth,
        g_vertical=index("wq", "ZM", mass),
        g_horizontal=index("vr", "YN", -mass),
        neutral_point_vertical=neutral_point("ZM", "w", -1.0),
        neutral_point_horizontal=neutral_point("YN", "v", 1.0),
        critical_speed_stern=reversal["stern"],
        critical_speed_sail=reversal["sail"],
        vertical=values.get("vertical", []),
        horizontal=values.get("horizontal", []),
        linear=linear,
        about=about,
    )


def _the_same_at_every_depth(case: Case) -> Environment:
    """Water of a case; a current carries the boat and changes no derivative, but layers would."""
    water = case.environment
    if water.layer or water.hull_compressibility_perm:
        key = "layer" if water.layer else "hull_compressibility_perm"
        raise InputError(f"case {case.name}, environment.{key}", "density or volume over depth", "a case without it")
    return environment_of(case)


def stability(
    case: str | os.PathLike[str],
    db: str | os.PathLike[str] = "coeff_db",
    version: int | None = None,
    speeds: Sequence[float] = (),
    depths: Sequence[float] = (),
) -> StabilityMap:
    """Stability indices, eigenvalues and critical speeds of a database version over speed and depth.

    Parameters
    ----------
    case : Bundled name or path of the case that gives vehicle, water and gravity.
    db, version : Folder or URL of the database, and version, latest when None.
    speeds : U [m/s]; those of the tabulated drift loads when empty, else the case's.
    depths : D0, depth of the sail top [m]; likewise.

    Returns
    -------
    StabilityMap

    Raises
    ------
    InputError
        For a case, vehicle, database or version that does not exist, or a speed or depth that
        is not a finite number in range.

    References
    ----------
    .. [1] Feldman, J., "Straightline and rotating arm captive-model experiments to investigate
       the stability and control characteristics of submarines and other submerged vehicles",
       David Taylor Research Center, Ship Hydromechanics Department, 1987.

    Examples
    --------
    >>> import ident
    >>> states = ident.stability("my-boat/zigzag.toml", db="coeff_db", speeds=[5.0], depths=[40.0])
    >>> [state.linear["vertical"].command for state in states]
    ['dV']
    """
    data, where = load_case(os.fspath(case))
    vehicle = load_vehicle(data.vehicle, beside=where)
    rows, number = read_rows(os.fspath(db), version, vehicle.name)
    for name, values, least in (("speed", speeds, 0.0), ("depth", depths, None)):
        for value in values:
            if not math.isfinite(value) or (least is not None and value <= least):
                text = "a finite number" + (" above zero" if least is not None else "")
                raise InputError(f"stability, {name}", f"{value:g}", text)
    drift = rows[rows["output"].eq("N") & rows["beta_deg"].notna()]
    speeds = speeds or tuple(sorted(drift["speed_mps"].dropna().unique())) or (data.initial.speed_mps,)
    depths = depths or tuple(sorted(drift["depth_m"].dropna().unique())) or (data.initial.depth_m,)
    coefficients = Coefficients(vehicle, rows)
    environment = _the_same_at_every_depth(data)
    states = []
    for depth in depths:
        for speed in speeds:
            whole = partial(state_space, coefficients, environment, speed, depth, data.run.step_s)
            states.append(replace(stability_at(coefficients, environment, speed, depth), _whole=whole))
    return StabilityMap(vehicle.title, number, tuple(states))
