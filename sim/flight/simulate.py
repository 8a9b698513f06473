"""Fly a case with a vehicle's coefficients."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import STATES
from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.boat.state import PHI, PSI, THETA, U, Y, Z
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.flight import maneuver, orders
from sim.flight.case import Case
from sim.flight.commands import compile_programme, law_code
from sim.flight.plausible import check_lengths, check_revolutions, check_start, check_steepness
from sim.flight.simulation import TANKS, Simulation
from sim.flight.trim import Leveling, Trim, self_propulsion
from sim.kernel.assemble import assemble, weight_across, with_tanks
from sim.kernel.layout import Model
from sim.kernel.rhs import BEGUN
from sim.waves.in_waves import Water, surroundings, water_around
from sim.waves.linear import Waves, calm, regular
from sim.waves.spectra import Spectrum, realise, sea_state

Array = NDArray[np.float64]
# Time between sums of the waves [s], or the step if that is longer.
_SPAN = 0.4
# Speeds up to this many times the initial one have mean wave loads of their own.
_FASTER = 1.25


def columns_of(vehicle: Vehicle, tanks: bool) -> tuple[str, ...]:
    """Columns of a record, with or without tanks in use."""
    return ("t", *STATES, *[p.name for p in vehicle.planes], "n", *(TANKS if tanks else ()), "dV", "dH")


def samples_of(case: Case) -> tuple[int, int]:
    """Number of control samples of a run, and of those between two records."""
    dt = case.run.step_s
    return round(case.run.duration_s / dt), max(1, round(case.run.record_s / dt))


def mixer_of(vehicle: Vehicle, sail_planes: bool = True) -> Array:
    """(planes, 2) shares of dV and dH, Eq. (1); planes on the sail or at the bow may be left out of it."""
    rows = [[p.mixer.dV, p.mixer.dH] if sail_planes or p.is_aft else [0.0, 0.0] for p in vehicle.planes]
    return np.array(rows, dtype=float).reshape(-1, 2)


def plane_limits(vehicle: Vehicle) -> tuple[Array, Array]:
    """Largest deflection [rad] and rate [rad/s] of each plane."""
    limit = np.radians([p.limit_deg for p in vehicle.planes])
    return limit, np.radians([p.rate_degps for p in vehicle.planes])


def tank_limits(vehicle: Vehicle) -> tuple[float, float]:
    """Largest ballast [kg] and shift of the centre of gravity [m]; zero without tanks."""
    return (vehicle.tanks.ballast.limit.value, vehicle.tanks.trim.limit.value) if vehicle.tanks else (0.0, 0.0)


def _held(case: Case) -> tuple[float, float]:
    """Ballast and shift of the centre of gravity that the case gives."""
    ballast, trim = case.command.ballast, case.command.trim_tank
    return ballast.value if ballast else 0.0, trim.value if trim else 0.0


def initial_state(case: Case, vehicle: Vehicle, model: Model) -> tuple[Array, Array, Trim | None]:
    """State, controls and the equilibrium (if the case asks for one).

    Raises
    ------
    sim.flight.trim.NoEquilibrium
        When there is no self-propulsion state within the limits of planes and propeller.
    InputError
        For a start that is not in the sea, or self-propulsion without a propeller.
    """
    first = case.initial
    if first.state == "self_propulsion":
        vehicle.needed_propeller("self-propulsion")
    check_start(case, vehicle)
    if first.state == "self_propulsion":
        mixer = mixer_of(vehicle, case.sail_planes)
        limits = plane_limits(vehicle)[0]
        leveling = Leveling(first.trim, tank_limits(vehicle), _held(case), first.upright)
        trim = self_propulsion(model, mixer, first.speed_mps, first.depth_m, limits, leveling)
        check_revolutions(case, vehicle, float(trim.controls[len(vehicle.planes)]))
        return trim.state.copy(), trim.controls.copy(), trim
    state = np.zeros(12)
    state[U], state[Z] = first.speed_mps, first.depth_m - model.sail_top
    state[PHI], state[THETA] = math.radians(first.heel_deg), math.radians(first.pitch_deg)
    tanks = _held(case) if model.has_tanks else ()
    return state, np.array([*np.zeros(len(vehicle.planes)), first.revolutions_rps or 0.0, *tanks]), None


def uses_tanks(case: Case) -> bool:
    """Whether a case uses ballast or the trim tank."""
    return bool(case.command.ballast or case.command.trim_tank or case.initial.trim != "planes")


def _tank_settings(
    case: Case, vehicle: Vehicle, controls: Array
) -> tuple[NDArray[np.int64], Array, Array, Array, Array]:
    """Laws, start, gains, limits and rates of ballast and trim tank."""
    commands = (case.command.ballast, case.command.trim_tank)
    laws = np.array([law_code(c.law) if c else orders.FIXED for c in commands])
    gains = np.array([c.gains() if c else np.zeros(6) for c in commands])
    if vehicle.tanks is None or not uses_tanks(case):
        return laws, np.zeros(2), gains, np.zeros(2), np.zeros(2)
    tanks = (vehicle.tanks.ballast, vehicle.tanks.trim)
    limit, rate = ([getattr(t, k).value for t in tanks] for k in ("limit", "rate"))
    return laws, controls[-2:].copy(), gains, np.array(limit), np.array(rate)


def settings_of(case: Case, vehicle: Vehicle, state: Array, controls: Array, trim: Trim | None) -> orders.Settings:
    """The compiled loop's settings for a case."""
    dv, dh, n = case.command.dV, case.command.dH, case.command.n
    limit, rate = plane_limits(vehicle)
    value = [math.radians(c.first_deg if c.law == "zigzag" else c.value_deg) for c in (dv, dh)]
    revolutions = float(controls[len(vehicle.planes)])
    commands = (trim.dV, trim.dH) if trim else (0.0, 0.0)
    tank_law, tank_start, tank_gains, tank_limit, tank_rate = _tank_settings(case, vehicle, controls)
    sail_top = vehicle.needed_sail_top("the depth of a flight")[2]
    propeller = vehicle.needed_propeller("a flight")
    return orders.Settings(
        law=np.array([law_code(dv.law), law_code(dh.law)]),
        value=np.array(value),
        check=np.radians([dv.check_deg, dh.check_deg]),
        trim=np.array(commands),
        gains=np.array([dv.gains("z", "theta"), dh.gains("y", "psi")]),
        yaw_rate_gains=np.array([dh.P_r, dh.I_r, dh.D_r, 0.0, 0.0, 0.0]),
        target=np.array([state[Z], state[THETA], state[Y], state[PSI]]),
        pressure_depth=dv.depth_from == "pressure",
        speed_law=law_code(n.law),
        speed_target=float(state[U]),
        speed_gains=np.array([n.P_u, n.I_u, n.D_u]),
        revolutions=revolutions,
        mixer=mixer_of(vehicle, case.sail_planes),
        plane_limit=limit,
        plane_rate=rate,
        n_limit=np.array(n.limits_rps or propeller.limits.value),
        n_rate=propeller.rate.value,
        command_limit=np.radians([dv.limit_deg, dh.limit_deg]),
        tank_law=tank_law,
        tank_start=tank_start,
        tank_gains=tank_gains,
        tank_limit=tank_limit,
        tank_rate=tank_rate,
        programme=compile_programme(case.command, case.run.stop, commands, revolutions, sail_top),
    )


def begun(case: Case, vehicle: Vehicle, model: Model) -> tuple[Model, Array, Array, Trim | None, orders.Settings]:
    """A case ready to fly: the model as it is trimmed, state, controls, equilibrium and settings.

    Raises
    ------
    As ``initial_state``.
    """
    state, controls, trim = initial_state(case, vehicle, model)
    if trim and trim.lateral:
        model = weight_across(model, trim.lateral)
    return model, state, controls, trim, settings_of(case, vehicle, state, controls, trim)


def simulate(case: Case, coefficients: Coefficients) -> Simulation:
    """Fly a case with the coefficients of its vehicle; raises as ``model_of``, ``water_of`` and ``fly``."""
    return fly(case, coefficients.vehicle, model_of(case, coefficients), water_of(case, coefficients))


def fly(case: Case, vehicle: Vehicle, model: Model, water: Water | None, scheme: int = BEGUN) -> Simulation:
    """Fly a case with an assembled model.

    Parameters
    ----------
    case : From ``load_case``.
    vehicle : The case's.
    model : From ``model_of``, which may be flown more than once.
    water : From ``water_of``, likewise; None in deep, calm water.
    scheme : How a step is taken: ``BEGUN``, the classical Runge-Kutta step, or ``MIDPOINT`` of ``sim.kernel.rhs``.

    Returns
    -------
    Simulation; the record ends early when the state is no longer finite, or with an event.

    Raises
    ------
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    model, state, controls, trim, settings = begun(case, vehicle, model)
    clock = maneuver.Clock(case.run.step_s, *samples_of(case), scheme)
    around = surroundings(water, model.added_mass) if water else ()
    flown = maneuver.fly_logged(model, settings, state, controls, clock, around)
    return Simulation(
        columns=columns_of(vehicle, model.has_tanks),
        record=flown.record,
        executes=flown.executes,
        trim=trim,
        depth_offset=model.sail_top,
        length=vehicle.particulars.length.value,
        steps=flown.log,
        end=flown.end,
        waves=water.sea.waves if water else None,
    )


def model_of(case: Case, coefficients: Coefficients) -> Model:
    """The compiled model in the environment of a case, with tanks when the case uses them.

    Raises
    ------
    InputError
        When the vehicle has no tanks.
    """
    return equipped(case, coefficients.vehicle, assemble(coefficients, environment_of(case)))


def waves_of(case: Case) -> Waves:
    """Wave components of a case, carried by its current; none in calm water.

    Raises
    ------
    InputError
        When the case asks for a sea state that the table does not have, or for waves that would break.
    """
    north, east = flow_of(case)
    return _in_still_water(case)._replace(flow_north=north, flow_east=east)


def flow_of(case: Case) -> tuple[float, float]:
    """Velocity of the water over ground, north and east [m/s]."""
    current = case.environment.current
    if current is None:
        return 0.0, 0.0
    direction = math.radians(current.direction_deg)
    return current.speed_mps * math.cos(direction), current.speed_mps * math.sin(direction)


def _in_still_water(case: Case) -> Waves:
    density, gravity = case.environment.density_kgpm3, case.environment.gravity_mps2
    data = case.waves
    if data is None:
        return calm(density, gravity)
    direction = math.radians(data.direction_deg)
    if data.kind == "regular":
        length = data.length_m or gravity * (data.period_s or 0.0) ** 2 / (2.0 * math.pi)
        check_steepness(case, data.height_m or 0.0, length)
        return regular(data.height_m or 0.0, length, direction, density, gravity, math.radians(data.phase_deg))
    height, period = data.height_m or 0.0, data.period_s or 0.0
    if data.sea_state is not None:
        nominal = sea_state(data.sea_state)
        height, period = nominal.height, nominal.period
    check_steepness(case, height, gravity * period**2 / (2.0 * math.pi))
    spectrum = Spectrum(data.kind, height, period, direction, data.spreading, data.gamma)
    return realise(spectrum, data.components, data.seed, density, gravity)


def water_of(case: Case, coefficients: Coefficients) -> Water | None:
    """Waves and surface of a case around its vehicle; None in deep, calm water.

    Waves of zero height are calm water to the last digit.

    Raises
    ------
    InputError
        When the vehicle lacks the geometry or the place of the propeller that waves need.
    """
    waves = waves_of(case)
    check_lengths(case, coefficients.vehicle, waves)
    if not case.environment.free_surface and waves.amplitude.size == 0:
        return None
    dt = case.run.step_s
    span, fast = dt * max(1, round(_SPAN / dt)), _FASTER * case.initial.speed_mps
    second_order = case.waves is not None and case.waves.second_order
    return water_around(coefficients, environment_of(case), waves, span, fast, second_order)


def environment_of(case: Case) -> Environment:
    """Water and gravity of a case."""
    return Environment(case.environment.density_kgpm3, case.environment.gravity_mps2)


def _in_water(case: Case, model: Model) -> Model:
    """The model in a current, layers of density, and a hull that is pressed together."""
    water = case.environment
    if water.current:
        model = model.replaced(current=flow_of(case))
    if water.layer or water.hull_compressibility_perm:
        depths = [one.depth_m for one in water.layer] or [0.0]
        ratios = [one.density_kgpm3 / water.density_kgpm3 for one in water.layer] or [1.0]
        model = model.layered(np.array(depths), np.array(ratios))
        model = model.replaced(compressibility=water.hull_compressibility_perm)
    return model


def equipped(case: Case, vehicle: Vehicle, model: Model) -> Model:
    """An assembled model in the water of a case, with tanks when the case uses them.

    Raises
    ------
    InputError
        When the vehicle has no tanks.
    """
    if case.environment.current or case.environment.varies_over_depth:
        model = _in_water(case, model)
    if not uses_tanks(case):
        return model
    if vehicle.tanks is None:
        raise InputError(f"case {case.name}", f"tanks, which {vehicle.name} does not have", "a vehicle with [tanks]")
    return with_tanks(model, vehicle)
