"""Whether a case can happen in water at all."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from sim.boat.catalogue import held
from sim.files.constants import constant
from sim.files.errors import InputError
from sim.flight.trim import NoEquilibrium

if TYPE_CHECKING:
    from sim.boat.vehicle import Vehicle
    from sim.flight.case import Case
    from sim.waves.linear import Waves

# Height over length of the steepest wave in deep water.
_STEEPEST = constant("steepest_wave")
# Waves shorter than this part of the boat's length load it no more, and cost memory without bound.
_SHORTEST = 0.01
_DEEPEST = constant("deepest_sea")
_HIGHEST = constant("highest_wave")
# Faster than anything that keeps its hull wetted [m/s].
_FASTEST = 100.0


def check_start(case: Case, vehicle: Vehicle) -> None:
    """Refuse a start that is not in the sea.

    Raises
    ------
    InputError
        For a boat more than its length above the surface or below the sea floor, or faster than 100 m/s; for
        waves, heel or pitch of a vehicle whose set holds them.
    """
    first, length = case.initial, vehicle.particulars.length.value
    where = f"case {case.name}, key initial"
    if not -length <= first.depth_m <= _DEEPEST:
        allowed = f"a depth of the sail top from {-length:g} m, in the air, to {_DEEPEST:g} m"
        raise InputError(f"{where}.depth_m", f"{first.depth_m:g} m", allowed)
    still = held(vehicle.term_set)
    if still and (case.waves or case.environment.free_surface or first.heel_deg or first.pitch_deg):
        text = "calm water, no heel and no pitch"
        raise InputError(
            f"case {case.name}", f"motions that {vehicle.name} does not have ({' '.join(still)} held)", text
        )
    if first.speed_mps > _FASTEST:
        raise InputError(f"{where}.speed_mps", f"{first.speed_mps:g} m/s", f"{_FASTEST:g} m/s at most")


def check_revolutions(case: Case, vehicle: Vehicle, needed: float) -> None:
    """The propeller's limits hold at the start as in the flight.

    Parameters
    ----------
    needed : Revolutions of the self-propulsion state [1/s].

    Raises
    ------
    NoEquilibrium
        When they are beyond the limits.
    """
    limits = case.command.n.limits_rps or vehicle.needed_propeller("a flight").limits.value
    within_limits(needed, limits, case.initial.speed_mps, case.initial.depth_m)


def within_limits(needed: float, limits: Sequence[float], speed: float, depth: float) -> None:
    """Refuse revolutions that a propeller does not have.

    Parameters
    ----------
    needed : Revolutions of the self-propulsion state [1/s].
    limits : Lowest and highest [1/s].
    speed, depth : U [m/s] and D0 [m] of that state.

    Raises
    ------
    NoEquilibrium
        When they are beyond the limits.
    """
    low, high = limits
    if not low <= needed <= high:
        at = f"{speed:.4g} m/s and D0 = {depth:.4g} m"
        said = f"the propeller's limits are {low:g} to {high:g} 1/s"
        raise NoEquilibrium(f"self-propulsion at {at} needs {needed:.4g} 1/s; {said}")


def check_steepness(case: Case, height: float, length: float) -> None:
    """Refuse waves that would break.

    Parameters
    ----------
    height, length : From crest to trough and from crest to crest [m]; of a spectrum, the significant
        height and the length of the wave of the peak period.

    Raises
    ------
    InputError
        For a length of nothing, or longer than deep water allows, and for waves higher or steeper than any.
    """
    where = f"case {case.name}, key waves"
    if not length > 1e-6:
        raise InputError(where, f"waves of {length:.3g} m length", "a length or a period of waves of water")
    if length > 2.0 * _DEEPEST:
        allowed = f"{2.0 * _DEEPEST:g} m at most, twice the deepest sea: longer ones are no waves of deep water"
        raise InputError(where, f"waves of {length:.4g} m length", allowed)
    if height > _HIGHEST:
        raise InputError(where, f"waves of {height:.4g} m height", f"{_HIGHEST:g} m at most, the highest ever measured")
    if height > _STEEPEST * length:
        wave = f"{height:.4g} m high and {length:.4g} m long: steepness {height / length:.3g}"
        raise InputError(where, wave, f"a steepness of {_STEEPEST:g} at most, at which waves break")


def check_lengths(case: Case, vehicle: Vehicle, waves: Waves) -> None:
    """Refuse waves too short to be resolved along the boat.

    Raises
    ------
    InputError
        For a component shorter than a hundredth of the boat's length.
    """
    if waves.number.size == 0:
        return
    shortest, least = 2.0 * math.pi / float(waves.number.max()), _SHORTEST * vehicle.particulars.length.value
    if shortest < least:
        text = f"waves of {shortest:.3g} m length"
        raise InputError(f"case {case.name}, key waves", text, f"{least:.3g} m or more, a hundredth of the boat's")
