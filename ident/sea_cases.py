"""Metrics and figures of cases in waves: harmonics, statistics of a seaway, drift of a turn."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ident import seakeeping, seaway
from ident.exceedance import exceedances
from ident.seakeeping_published import as_published
from sim.database import version_words
from sim.simulate import Simulation
from sim.waves import mean_direction

if TYPE_CHECKING:
    from ident.validate import Validation

Array = NDArray[np.float64]
Metrics = dict[str, float | None]
# The sail top at the calm surface: broaching.
_BROACHING = 0.0
_CHANNELS = ("D0", "theta", "phi")


def regular_waves(simulation: Simulation) -> Metrics:
    """First harmonics of depth over wave amplitude and of pitch, with means, of a flight in a regular wave."""
    found = seakeeping.harmonics(simulation)
    own = as_published(found)
    return {
        "dz1_over_aw": own["dz1_over_aw"][0],
        "theta1_deg": own["theta1"][0],
        "dz1_over_aw_stderr": own["dz1_over_aw"][1],
        "theta1_stderr_deg": own["theta1"][1],
        "D0_mean_m": found["D0"].mean,
        "theta_mean_deg": math.degrees(found["theta"].mean),
        "frequency_of_encounter_radps": found["D0"].encounter.frequency,
    }


def irregular_waves(simulation: Simulation) -> Metrics:
    """Significant values (double amplitude), and how often the sail top comes out a hour."""
    found = seaway.statistics(simulation, _CHANNELS)
    broaching = exceedances(found["D0"], [_BROACHING])[0]
    depth, pitch, roll = (found[name] for name in _CHANNELS)
    return {
        "D0_mean_m": depth.mean,
        "D0_significant_m": depth.significant,
        "D0_significant_stderr_m": 4.0 * depth.sigma_stderr,
        "theta_significant_deg": math.degrees(pitch.significant),
        "theta_significant_stderr_deg": math.degrees(4.0 * pitch.sigma_stderr),
        "phi_significant_deg": math.degrees(roll.significant),
        "D0_period_s": depth.period,
        "D0_least_m": float(simulation["D0"].min()),
        "broaching_per_hour": broaching.per_hour,
        "broaching_per_hour_rice": broaching.predicted,
    }


def turn_drift(simulation: Simulation) -> Metrics:
    """How a turning circle drifts with the waves: velocity of its centre and its diameter.

    Each whole turn of the heading after the first has a mean position and an extent; the drift
    is the slope of the mean positions over time, errors are those of the scatter among turns.
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
        x, y = simulation["x"][use], simulation["y"][use]
        centre.append([x.mean(), y.mean()])
        time.append(simulation["t"][use].mean())
        size.append(0.5 * (np.ptp(x) + np.ptp(y)))
    t = np.array(time) - np.mean(time)
    place = np.array(centre) - np.mean(centre, axis=0)
    drift = t @ place / (t @ t)
    left = place - np.outer(t, drift)
    error = math.sqrt(float((left**2).sum()) / (2.0 * max(len(t) - 2, 1)) / float(t @ t))
    along, across = float(drift @ ahead), float(drift @ [-ahead[1], ahead[0]])
    spread = float(np.std(size, ddof=1) / math.sqrt(len(size)))
    return dict(zip((*names, *sizes), (along, across, error, float(np.mean(size)), spread), strict=True))


def sea_figures(done: Validation, folder: Path) -> list[Path]:
    """Figures of a flown case in an irregular sea: histories, spectra, exceedance of broaching.

    Parameters
    ----------
    done : A flown case; of any other there are none.
    folder : Where to write.
    """
    if done.case.maneuver != "irregular_waves" or done.simulation.waves is None:
        return []
    from ident.seakeeping_figures import exceedance_figure, seaway_figure, spectrum_figure

    database = done.result["database"]
    stamp = version_words(database)
    title, name = f"{done.case.title}, {done.case.vehicle}", f"{done.case.name}_v{database['version']}"
    found = seaway.statistics(done.simulation, _CHANNELS)
    met = seaway.encountered(done.simulation.waves, done.simulation, start=found["D0"].start)
    return [
        seaway_figure(done.simulation, found, folder / f"{name}_histories.png", title, stamp, _BROACHING),
        spectrum_figure(found, met, folder / f"{name}_spectra.png", title, stamp),
        exceedance_figure(found["D0"], folder / f"{name}_broaching.png", title, stamp, "below", _BROACHING),
    ]


def harmonics_over_depth(done: list[Validation], folder: Path) -> Path | None:
    """First harmonics over depth of every case in regular waves that was flown, beside the published ones.

    Parameters
    ----------
    done : Flown cases.
    folder : Where to write.

    Returns
    -------
    The figure; None when no case is in regular waves.
    """
    import pandas as pd

    from ident.seakeeping_figures import harmonics_figure

    chosen = [d for d in done if d.case.maneuver == "regular_waves"]
    if not chosen:
        return None
    flown = {d.case.initial.depth_m: seakeeping.harmonics(d.simulation) for d in chosen}
    metric = {"dz1_over_aw": ("dz1_over_aw", "-"), "theta1_deg": ("theta1", "deg")}
    rows = [
        {"source": p.source, "channel": metric[p.metric][0], "D0_m": d.case.initial.depth_m}
        | {"value": p.value, "unit": metric[p.metric][1], "sigma": 0.0}
        for d in chosen
        for p in d.case.published
        if p.metric in metric
    ]
    columns = ["source", "channel", "D0_m", "value", "unit", "sigma"]
    database = chosen[0].result["database"]
    stamp = version_words(database)
    path = folder / f"harmonics_in_waves_v{database['version']}.png"
    title = f"First harmonics in regular head waves, {chosen[0].case.vehicle}"
    return harmonics_figure(flown, pd.DataFrame(rows, columns=columns), path, title, stamp)
