"""Metrics of cases in waves: harmonics, statistics of a seaway, drift of a turn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.metrics import seakeeping, seaway
from ident.metrics.exceedance import exceedances, extreme
from ident.metrics.seakeeping import Harmonics, as_published
from ident.metrics.seaway import Statistics
from sim.flight.case import Case
from sim.flight.simulation import Simulation
from sim.waves.linear import mean_direction

Array = NDArray[np.float64]
Metrics = dict[str, float | None]
# Depth of the sail top [m] at the calm surface: broaching.
BROACHING = 0.0
_CHANNELS = ("D0", "theta", "phi")
# An extreme is asked for over the duration of a sea state [h], and passed with this probability.
_HOURS, _RISK = 3.0, 0.01


@dataclass(frozen=True)
class InWaves:
    """What is computed once of a flight in waves, for its metrics and figures; empty of any other.

    Attributes
    ----------
    harmonics : Channel -> harmonics, in a regular wave.
    statistics : Channel -> statistics, in an irregular sea.

    Examples
    --------
    >>> import ident
    >>> done = ident.validate("my-boat/zigzag.toml", db="coeff_db", version=0)
    >>> done.in_waves.harmonics, done.in_waves.statistics
    ({}, {})
    """

    harmonics: Mapping[str, Harmonics] = field(default_factory=dict)
    statistics: Mapping[str, Statistics] = field(default_factory=dict)


def in_waves(case: Case, simulation: Simulation) -> InWaves:
    """Harmonics or statistics of a flight, as its case asks for; raises as those."""
    if case.maneuver == "regular_waves":
        return InWaves(harmonics=seakeeping.harmonics(simulation))
    if case.maneuver == "irregular_waves":
        return InWaves(statistics=seaway.statistics(simulation, _CHANNELS))
    return InWaves()


def regular_waves(harmonics: Mapping[str, Harmonics]) -> Metrics:
    """First harmonics of depth over wave amplitude and of pitch, with means, of a flight in a regular wave."""
    published = as_published(harmonics)
    return {
        "dz1_over_aw": published["dz1_over_aw"][0],
        "theta1_deg": published["theta1"][0],
        "dz1_over_aw_stderr": published["dz1_over_aw"][1],
        "theta1_stderr_deg": published["theta1"][1],
        "speed_mean_mps": harmonics["D0"].encounter.speed,
        "D0_mean_m": harmonics["D0"].mean,
        "theta_mean_deg": math.degrees(harmonics["theta"].mean),
        "frequency_of_encounter_radps": harmonics["D0"].encounter.frequency,
    }


def irregular_waves(statistics: Mapping[str, Statistics], simulation: Simulation) -> Metrics:
    """Significant values (double amplitude), least depths, and how often the sail top comes out a hour.

    The least depth is that of the whole record, start-up included; beside it the one that Rice's
    rate lets expect in as much time as the statistics are of and in three hours, and the one that
    is passed in three hours with 1 %.
    """
    depth, pitch, roll = (statistics[name] for name in _CHANNELS)
    broaching = exceedances(depth, [BROACHING])[0]
    record = extreme(depth, (depth.end - depth.start) / 3600.0)
    sea_state = extreme(depth, _HOURS, risk=_RISK)
    return {
        "statistics_from_s": depth.start,
        "D0_mean_m": depth.mean,
        "D0_significant_m": depth.significant,
        "D0_significant_stderr_m": 4.0 * depth.sigma_stderr,
        "theta_significant_deg": math.degrees(pitch.significant),
        "theta_significant_stderr_deg": math.degrees(4.0 * pitch.sigma_stderr),
        "phi_significant_deg": math.degrees(roll.significant),
        "D0_period_s": depth.period,
        "D0_least_m": float(simulation["D0"].min()),
        "D0_least_rice_m": record["expected"],
        "D0_least_3h_rice_m": sea_state["expected"],
        "D0_least_3h_1percent_rice_m": sea_state["at_risk"],
        "broaching_per_hour": broaching.per_hour,
        "broaching_per_hour_rice": broaching.predicted,
    }


def turn_drift(simulation: Simulation) -> Metrics:
    """How a turning circle drifts with the waves: velocity of its centre and its diameter.

    Each whole turn of the heading after the first has a mean position and an extent; the drift
    is the slope of the mean positions in the water over time, errors are those of the scatter among turns.
    """
    heading = np.unwrap(simulation["psi"]) - simulation["psi"][0]
    turns = np.floor(np.abs(heading) / (2.0 * math.pi)).astype(int)
    whole = [k for k in range(1, int(turns.max())) if (turns == k).any()]
    names = ("drift_along_waves_mps", "drift_across_waves_mps", "drift_stderr_mps")
    sizes = ("diameter_mean_m", "diameter_stderr_m")
    if len(whole) < 3 or simulation.waves is None or simulation.waves.amplitude.size == 0:
        return dict.fromkeys((*names, *sizes))
    waves, centre, time, size = simulation.waves, [], [], []
    ahead = mean_direction(waves)
    ahead /= max(float(np.hypot(*ahead)), 1e-12)
    for k in whole:
        use = turns == k
        t = simulation["t"][use]
        x, y = simulation["x"][use] - waves.flow_north * t, simulation["y"][use] - waves.flow_east * t
        centre.append([x.mean(), y.mean()])
        time.append(t.mean())
        size.append(0.5 * (np.ptp(x) + np.ptp(y)))
    t = np.array(time) - np.mean(time)
    place = np.array(centre) - np.mean(centre, axis=0)
    drift = t @ place / (t @ t)
    left = place - np.outer(t, drift)
    error = math.sqrt(float((left**2).sum()) / (2.0 * max(len(t) - 2, 1)) / float(t @ t))
    along, across = float(drift @ ahead), float(drift @ [-ahead[1], ahead[0]])
    spread = float(np.std(size, ddof=1) / math.sqrt(len(size)))
    return dict(zip((*names, *sizes), (along, across, error, float(np.mean(size)), spread), strict=True))
