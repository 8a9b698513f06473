"""Fly a case with a vehicle's coefficients."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim import maneuver
from sim.case import Case
from sim.coefficients import Coefficients
from sim.kernel import Model
from sim.model import Environment, assemble
from sim.trim import Trim, self_propulsion
from sim.vehicle import Vehicle

Array = NDArray[np.float64]
_STATES = ("u", "v", "w", "p", "q", "r", "x", "y", "z", "phi", "theta", "psi")

# Channels a reference may hold, with the unit of the simulation.
CHANNELS = dict.fromkeys(("u", "v", "w", "U"), "m/s") | dict.fromkeys(("p", "q", "r"), "rad/s")
CHANNELS |= dict.fromkeys(("x", "y", "z", "D0"), "m") | dict.fromkeys(("phi", "theta", "psi"), "rad")
CHANNELS |= {"u_over_U0": "-", "dz_over_L0": "-", "n": "1/s"}
_LAWS = {"fixed": maneuver.FIXED, "pid": maneuver.PID, "zigzag": maneuver.ZIGZAG}


@dataclass(frozen=True)
class Simulation:
    """Time histories of one maneuver, program frame, SI and radians.

    Attributes
    ----------
    columns : Names of the columns of ``record``: t, the 12 states, planes, n, dV, dH.
    record : (rows, columns).
    executes : (k, 2) time [s] and command [rad] of each zigzag execute.
    trim : The initial equilibrium, or None.
    depth_offset : D0 = z + depth_offset.
    length : Reference length L [m].
    """

    columns: tuple[str, ...]
    record: Array
    executes: Array
    trim: Trim | None
    depth_offset: float
    length: float

    def __getitem__(self, column: str) -> Array:
        """One column by name; ``U``, ``D0``, ``u_over_U0`` and ``dz_over_L0`` are derived."""
        if column == "U":
            return np.sqrt(self["u"] ** 2 + self["v"] ** 2 + self["w"] ** 2)
        if column == "D0":
            return self["z"] + self.depth_offset
        if column == "u_over_U0":
            return self["u"] / self["U"][0]
        if column == "dz_over_L0":
            return (self["z"] - self["z"][0]) / self.length
        return self.record[:, self.columns.index(column)]


def mixer_of(vehicle: Vehicle, sail_planes: bool = True) -> Array:
    """(planes, 2) shares of dV and dH, Eq. (1); sail planes may be left out of it."""
    rows = [
        [p.mixer.dV, p.mixer.dH] if sail_planes or not p.name.startswith("sail") else [0.0, 0.0] for p in vehicle.planes
    ]
    return np.array(rows, dtype=float).reshape(-1, 2)


def plane_limits(vehicle: Vehicle) -> tuple[Array, Array]:
    """Largest deflection [rad] and rate [rad/s] of each plane."""
    limit = np.radians([p.limit_deg for p in vehicle.planes])
    return limit, np.radians([p.rate_degps for p in vehicle.planes])


def initial_state(case: Case, vehicle: Vehicle, model: Model) -> tuple[Array, Array, Trim | None]:
    """State, controls and the equilibrium (if the case asks for one).

    Raises
    ------
    sim.trim.NoEquilibrium
        When there is no self-propulsion state.
    """
    first = case.initial
    if first.state == "self_propulsion":
        mixer = mixer_of(vehicle, case.sail_planes)
        trim = self_propulsion(model, mixer, first.speed_mps, first.depth_m, plane_limits(vehicle)[0])
        return trim.state.copy(), trim.controls.copy(), trim
    state = np.zeros(12)
    state[0], state[8] = first.speed_mps, first.depth_m - model.sail_top
    state[9], state[10] = math.radians(first.heel_deg), math.radians(first.pitch_deg)
    return state, np.append(np.zeros(len(vehicle.planes)), first.revolutions_rps or 0.0), None


def settings_of(case: Case, vehicle: Vehicle, state: Array, controls: Array, trim: Trim | None) -> maneuver.Settings:
    """The compiled loop's settings for a case."""
    dv, dh, n = case.command.dV, case.command.dH, case.command.n
    limit, rate = plane_limits(vehicle)
    value = [math.radians(c.first_deg if c.law == "zigzag" else c.value_deg) for c in (dv, dh)]
    return maneuver.Settings(
        law=np.array([_LAWS[dv.law], _LAWS[dh.law]]),
        value=np.array(value),
        check=np.radians([dv.check_deg, dh.check_deg]),
        trim=np.array([trim.dV, trim.dH]) if trim else np.zeros(2),
        gains=np.array([dv.gains("z", "theta"), dh.gains("y", "psi")]),
        target=np.array([state[8], state[10], state[7], state[11]]),
        speed_law=_LAWS[n.law],
        speed_target=case.initial.speed_mps,
        speed_gains=np.array([n.P_u, n.I_u, n.D_u]),
        revolutions=float(controls[-1]),
        mixer=mixer_of(vehicle, case.sail_planes),
        plane_limit=limit,
        plane_rate=rate,
        n_limit=np.array(vehicle.propeller.limits.value),
        n_rate=vehicle.propeller.rate.value,
        command_limit=np.radians([dv.limit_deg, dh.limit_deg]),
    )


def simulate(case: Case, coefficients: Coefficients) -> Simulation:
    """Fly a case.

    Parameters
    ----------
    case : From ``load_case``.
    coefficients : Of the case's vehicle.

    Returns
    -------
    Simulation; the record ends early when the state is no longer finite.

    Raises
    ------
    sim.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    vehicle = coefficients.vehicle
    environment = Environment(case.environment.density_kgpm3, case.environment.gravity_mps2)
    model = assemble(coefficients, environment)
    state, controls, trim = initial_state(case, vehicle, model)
    settings = settings_of(case, vehicle, state, controls, trim)
    dt = case.run.step_s
    steps, every = round(case.run.duration_s / dt), max(1, round(case.run.record_s / dt))
    record, executes = maneuver.fly(model, settings, state, controls, dt, steps, every)
    columns = ("t", *_STATES, *[p.name for p in vehicle.planes], "n", "dV", "dH")
    return Simulation(columns, record, executes, trim, model.sail_top, vehicle.particulars.length.value)
