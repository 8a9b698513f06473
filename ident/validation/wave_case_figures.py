"""Figures of flown cases in waves: histories, spectra and exceedance; harmonics over depth."""

from __future__ import annotations

import math
from pathlib import Path

from ident.text import in_file_name
from ident.validation.figures import case_figure
from ident.validation.flown_case import FlownCase
from ident.validation.turn_figures import turn_figures
from sim.boat.database import version_words


def figures_of(done: FlownCase, folder: Path, kind: str = "png") -> list[Path]:
    """Every figure of a flown case: its own, and further ones in an irregular sea.

    Parameters
    ----------
    done : A flown case, drawn with its error bands where it has them.
    folder : Where to write.
    kind : Suffix of the files.
    """
    path = folder / f"{in_file_name(done.case.name)}_v{done.version}.{kind}"
    return [case_figure(done, path, done.bands), *sea_figures(done, folder, kind), *turn_figures(done, folder, kind)]


def sea_figures(done: FlownCase, folder: Path, kind: str = "png") -> list[Path]:
    """Figures of a flown case in an irregular sea: histories, spectra, exceedance of broaching.

    Parameters
    ----------
    done : A flown case; of any other there are none.
    folder : Where to write.
    kind : Format: png, svg or pdf.
    """
    if done.case.maneuver != "irregular_waves" or done.simulation.waves is None:
        return []
    from ident.metrics import seaway
    from ident.metrics.in_waves import BROACHING
    from ident.validation.wave_figures import exceedance_figure, seaway_figure, spectrum_figure

    database = done.database
    stamp = version_words(database)
    title, name = f"{done.case.title}, {done.case.vehicle}", f"{in_file_name(done.case.name)}_v{database['version']}"
    statistics = done.in_waves.statistics
    met = seaway.encountered(done.simulation.waves, done.simulation, start=statistics["D0"].start)
    return [
        seaway_figure(done.simulation, statistics, folder / f"{name}_histories.{kind}", title, stamp, BROACHING),
        spectrum_figure(statistics, met, folder / f"{name}_spectra.{kind}", title, stamp),
        exceedance_figure(statistics["D0"], folder / f"{name}_broaching.{kind}", title, stamp, "below", BROACHING),
    ]


def harmonics_over_depth(done: list[FlownCase], folder: Path, kind: str = "png") -> list[Path]:
    """First harmonics over depth of the cases in a regular wave that were flown, beside the published ones.

    Parameters
    ----------
    done : Flown cases.
    folder : Where to write.
    kind : Format: png, svg or pdf.

    Returns
    -------
    A figure for each vehicle and wave; none when no case is in regular waves.
    """
    groups: dict[str, list[FlownCase]] = {}
    for one in done:
        if one.in_waves.harmonics and one.case.waves is not None:
            depth = one.case.initial.depth_m
            key = f"{one.case.vehicle} {one.case.initial.speed_mps} {one.case.waves.model_dump_json()}"
            while any(other.case.initial.depth_m == depth for other in groups.get(key, [])):
                key += " again"
            groups.setdefault(key, []).append(one)
    return [_over_depth(group, folder, f"_{i + 1}" if i else "", kind) for i, group in enumerate(groups.values())]


def _over_depth(done: list[FlownCase], folder: Path, suffix: str, kind: str) -> Path:
    """The figure of one vehicle in one wave."""
    import pandas as pd

    from ident.validation.wave_figures import harmonics_figure

    metric = {"dz1_over_aw": "dz1_over_aw", "theta1_deg": "theta1"}
    rows = [
        {"source": p.source, "channel": metric[p.metric], "D0_m": d.case.initial.depth_m}
        | {"value": p.value, "sigma": p.sigma or 0.0}
        for d in done
        for p in d.case.published
        if p.metric in metric
    ]
    reference = pd.DataFrame(rows, columns=["source", "channel", "D0_m", "value", "sigma"])
    flown = {d.case.initial.depth_m: d.in_waves.harmonics for d in done}
    database, case = done[0].database, done[0].case
    encounter = next(iter(done[0].in_waves.harmonics.values())).encounter
    wave = f"waves {2.0 * encounter.amplitude:.3g} m high, {2.0 * math.pi / encounter.number:.4g} m long"
    # mu is 180 deg in head seas.
    title = f"{case.vehicle} in regular {wave}, mu = {math.degrees(encounter.angle):.0f} deg"
    title += f", U = {encounter.speed:.3g} m/s"
    path = folder / f"harmonics_in_waves{suffix}_v{database['version']}.{kind}"
    return harmonics_figure(flown, reference, path, title, version_words(database))
