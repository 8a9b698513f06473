"""Figures of a boat in waves: histories, spectra, exceedances, harmonics over depth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.drawing import Margins, place_panels
from ident.metrics.exceedance import Exceedance, Side, exceedances, rice_rate
from ident.metrics.seakeeping import Harmonics, as_published
from ident.metrics.seaway import Statistics, spectrum, uniform_step
from ident.text import in_figure
from ident.validation.figures import DOWNWARDS, blank, dress, finish, readable
from sim.flight.simulation import Simulation

Array = NDArray[np.float64]

_OWN: Any = {"color": "tab:red", "lw": 1.4}
_STYLES: dict[str, Any] = {
    "CFD": {"color": "tab:blue", "marker": "s", "ls": ""},
    "EXP": {"color": "k", "marker": "o", "ls": ""},
    "HDM": {"color": "tab:green", "marker": "^", "ls": "", "label": "published model (HDM)"},
}
# Levels drawn on an exceedance plot, and how far beyond the largest counted one.
_LEVELS = 60
_BEYOND = 4.5
# Rates below this [1/h] are not drawn.
_LEAST = 1e-6
# Spectra are drawn up to where this share of the energy has passed.
_ENERGY = 0.99
_LABEL_OF = {
    "dz1_over_aw": r"depth: first harmonic over wave amplitude, $z_1/a_w$ [-]",
    "theta1": r"pitch: first harmonic $\theta_1$ [deg]",
}


def seaway_figure(
    simulation: Simulation,
    statistics: Mapping[str, Statistics],
    path: Path,
    title: str,
    stamp: str,
    level: float | None = None,
) -> Path:
    """Time histories in an irregular sea with mean, drift and the band of +- 2 sigma.

    Parameters
    ----------
    simulation : The flight.
    statistics : Channel -> statistics, from ``seaway.statistics``.
    path : File to write; the suffix chooses the format.
    title : Case and vehicle. stamp : Database version.
    level : Depth of the sail top that counts as broaching, drawn on D0 when within 8 sigma [m].

    Returns
    -------
    ``path``.
    """
    figure = blank(11, 2.1 * len(statistics) + 1.4)
    place_panels(figure, len(statistics), 1, Margins(top=0.85, gap=0.3))
    axes = figure.subplots(len(statistics), 1, sharex=True, squeeze=False)
    for (channel, one), axis in zip(statistics.items(), axes[:, 0], strict=True):
        values, name, unit = readable(channel, simulation[channel])
        trend, sigma = readable(channel, one.trend)[0], readable(channel, np.array(one.sigma))[0]
        axis.plot(simulation["t"], values, color="tab:red", lw=0.7, label="simulated from the database")
        axis.plot(one.time, trend, color="k", lw=1.0, label="mean and drift")
        band = f"mean and drift ± 2 sigma: significant value {4.0 * float(sigma):.3g} {unit}"
        axis.fill_between(
            one.time, trend - 2.0 * sigma, trend + 2.0 * sigma, color="tab:red", alpha=0.15, lw=0, label=band
        )
        if one.start > simulation["t"][0]:
            axis.axvspan(simulation["t"][0], one.start, color="k", alpha=0.08, lw=0, label="start-up, not used")
        if level is not None and channel == "D0" and abs(level - one.mean) < 8.0 * one.sigma:
            axis.axhline(level, color="tab:blue", ls="--", lw=1.0, label=f"broaching: D0 < {level:g} m")
        dress(axis, "", f"{name} [{unit}]")
        if channel in DOWNWARDS:
            axis.invert_yaxis()
        # Above the axes, where no history can run through it.
        axis.legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=5,
            frameon=False,
            fontsize=8,
            borderaxespad=0.1,
            columnspacing=1.2,
        )
    axes[-1, 0].set_xlabel("time t [s]")
    return finish(figure, path, title, stamp)


def _drawn_to(frequency: Array, density: Array) -> float:
    energy = np.cumsum(density)
    return float(frequency[np.searchsorted(energy, _ENERGY * energy[-1])])


def spectrum_figure(
    statistics: Mapping[str, Statistics], elevation: tuple[Array, Array], path: Path, title: str, stamp: str
) -> Path:
    """Spectra of the motions under that of the waves as the boat meets them.

    Parameters
    ----------
    statistics : Channel -> statistics.
    elevation : Time [s] and elevation over the origin [m], from ``seaway.encountered``.
    path, title, stamp : As in ``seaway_figure``.

    Returns
    -------
    ``path``.
    """
    time, eta = elevation
    first = next(iter(statistics.values()))
    waves = spectrum(eta, uniform_step(time), first.spectrum.resolution)
    panels = [("waves over the origin", "m", waves, 1.0, "tab:blue", 0.0)]
    for channel, one in statistics.items():
        one_unit, name, unit = readable(channel, np.ones(1))
        panels.append((name, unit, one.spectrum, float(one_unit[0]) ** 2, "tab:red", one.rice_period))
    figure = blank(9, 1.9 * len(panels) + 1.2)
    place_panels(figure, len(panels), 1, Margins(top=0.85, gap=0.4))
    axes = figure.subplots(len(panels), 1, sharex=True)
    for (name, unit, drawn, scale, colour, period), axis in zip(panels, axes, strict=True):
        axis.plot(drawn.frequency, scale * drawn.density, color=colour, lw=1.3)
        axis.fill_between(drawn.frequency, scale * drawn.density, color=colour, alpha=0.15, lw=0)
        m0 = scale * float(drawn.moments((0,))[0])
        words = f"{name}: $4\\sqrt{{m_0}}$ = {4.0 * m0**0.5:.3g} {unit}"
        words += f", $2\\pi\\sqrt{{m_0/m_2}}$ = {period:.3g} s" if period else ""
        axis.set_title(
            f"{words}; resolution {drawn.resolution:.2g} rad/s, {drawn.segments} segments",
            loc="left",
            fontsize=9,
            y=1.0,
        )
        dress(axis, "", rf"S [{unit}$^2$ s/rad]")
        axis.set_ylim(bottom=0.0)
    highest = max(_drawn_to(drawn.frequency, drawn.density) for _, _, drawn, *_ in panels)
    axes[-1].set_xlim(0.0, 1.05 * highest)
    axes[-1].set_xlabel(r"frequency of encounter $\omega_e$ [rad/s]")
    return finish(figure, path, title, stamp)


def _counted(axis: Any, levels: Array, each: Sequence[Exceedance]) -> None:
    """Crossings that were counted, where there are any, with the error of counting."""
    counted = np.array([(v, e.per_hour, e.per_hour_stderr) for v, e in zip(levels, each, strict=True) if e.count])
    if not counted.size:
        return
    # An error bar as long as the rate has no lower end on this axis.
    bars = [np.minimum(counted[:, 2], 0.9 * counted[:, 1]), counted[:, 2]]
    label = "counted ± Poisson error"
    axis.errorbar(*counted[:, :2].T, yerr=bars, color="tab:red", fmt="o", ms=3, lw=0.8, label=label)


def exceedance_figure(
    of: Statistics, path: Path, title: str, stamp: str, side: Side = "below", level: float | None = None
) -> Path:
    """Crossings of levels a hour, counted and by Rice, on a logarithmic axis.

    Parameters
    ----------
    of : Statistics of the channel.
    path, title, stamp : As in ``seaway_figure``.
    side : Side of the level that is out; ``below`` for a depth.
    level : A level to mark: broaching.

    Returns
    -------
    ``path``.
    """
    sense = -1.0 if side == "below" else 1.0
    largest = float((sense * (of.trend + of.deviation - of.mean)).max())
    reach = max(_BEYOND * of.sigma, 1.05 * largest)
    if level is not None and rice_rate(of, level) > _LEAST:
        reach = max(reach, 1.05 * sense * (level - of.mean))
    levels = of.mean + sense * np.linspace(0.0, reach, _LEVELS)
    each = exceedances(of, list(levels), side)
    shown, name, unit = readable(of.channel, levels)
    rate, error = np.array([e.predicted for e in each]), np.array([e.predicted_stderr for e in each])
    figure = blank(8, 5.4)
    place_panels(figure, 1, 1)
    axis = figure.subplots()
    axis.semilogy(shown, rate, color="tab:blue", lw=1.4, label=r"Rice, from $m_0$ and $m_2$")
    factor = np.exp(2.0 * error / rate)
    axis.fill_between(
        shown,
        rate / factor,
        rate * factor,
        color="tab:blue",
        alpha=0.15,
        lw=0,
        label="± 2 standard errors of mean and sigma",
    )
    _counted(axis, shown, each)
    hours = (of.end - of.start) / 3600.0
    axis.axhline(1.0 / hours, color="k", ls=":", lw=0.9, label=f"once in the record of {hours:.3g} h")
    bottom = 0.1 / hours
    if level is not None:
        expected = rice_rate(of, level)
        mark = float(readable(of.channel, np.array(level))[0])
        # A level that is never reached is named only: it would squeeze all that is reached.
        place = mark if expected > _LEAST else np.nan
        text = f"{mark:g} {unit}: Rice {expected:.2g} a hour"
        axis.axvline(place, color="tab:green", ls="--", lw=1.0, label=text)
        bottom = min(bottom, 0.3 * expected) if expected > _LEAST else bottom
    axis.set_ylim(max(bottom, _LEAST), 2.0 * rate.max())
    dress(axis, f"level of {name} [{unit}]", f"crossings to {side} the level [1/h]")
    axis.legend(fontsize=8, frameon=False)
    return finish(figure, path, title, stamp)


def harmonics_figure(
    flown: Mapping[float, Mapping[str, Harmonics]], reference: pd.DataFrame, path: Path, title: str, stamp: str
) -> Path:
    """First harmonics of depth and pitch over depth, beside CFD and the published model.

    Parameters
    ----------
    flown : Depth of the sail top D0 [m] -> harmonics.
    reference : Published values: source, channel (``dz1_over_aw`` [-], ``theta1`` [deg]), D0_m,
        value, and sigma, the standard error of reading it; may be empty.
    path, title, stamp : As in ``seaway_figure``.

    Returns
    -------
    ``path``.
    """
    figure = blank(10, 4.8)
    place_panels(figure, 1, 2, Margins(bottom=0.95))
    axes = figure.subplots(1, 2)
    depths = sorted(flown)
    for channel, axis in zip(_LABEL_OF, axes, strict=True):
        simulated = [(d, *as_published(flown[d])[channel]) for d in depths if channel in as_published(flown[d])]
        if simulated:
            d, value, error = np.array(simulated).T
            label = "simulated from the database, ± 2 s.e."
            axis.errorbar(d, value, yerr=2.0 * error, marker="D", ms=5, capsize=3, label=label, **_OWN)
        for source, rows in reference[reference["channel"] == channel].groupby("source"):
            style = {"color": "tab:gray", "marker": "v", "ls": ""} | _STYLES.get(str(source), {})
            style |= {"label": style.get("label", in_figure(source))}
            axis.errorbar(rows["D0_m"], rows["value"], yerr=2.0 * rows["sigma"], ms=6, capsize=3, **style)
        dress(axis, "depth of the sail top D0 [m]", _LABEL_OF[channel])
        axis.margins(0.08)
        axis.set_ylim(bottom=0.0)
        axis.set_xlim(left=0.0)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="lower center", ncols=4, frameon=False)
    return finish(figure, path, title, stamp)
