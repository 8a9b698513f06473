"""A turning circle in waves over its heading: what the waves of every direction do to depth, pitch, heel and speed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.drawing import Margins, place_panels
from ident.text import in_file_name
from ident.validation.figures import DOWNWARDS, blank, dress, finish, readable
from ident.validation.flown_case import FlownCase
from sim.boat.database import version_words
from sim.flight.simulation import Simulation
from sim.waves.linear import mean_direction

Array = NDArray[np.float64]
SHOWN = ("theta", "D0", "phi", "U")
# Sectors of heading over which turns are averaged.
_SECTORS = 72


def over_heading(flight: Simulation, channel: str, sectors: int = _SECTORS) -> tuple[Array, Array, Array]:
    """Mean and spread of a channel by heading, over all turns after the first.

    Parameters
    ----------
    flight : A turning circle of two turns or more.
    channel : Of the flight.
    sectors : Into which the circle is divided.

    Returns
    -------
    (k,) heading of the middle of each sector that was passed [rad], 0 to 2 pi; mean and standard deviation of the
    channel there [SI, rad].
    """
    turned = np.abs(flight["psi"] - flight["psi"][0])
    steady = turned > 2.0 * np.pi
    heading = np.remainder(flight["psi"][steady], 2.0 * np.pi)
    sector = np.minimum((heading / (2.0 * np.pi) * sectors).astype(int), sectors - 1)
    count = np.bincount(sector, minlength=sectors)
    passed = count > 0
    values = flight[channel][steady]
    mean = np.bincount(sector, values, sectors)[passed] / count[passed]
    square = np.bincount(sector, values**2, sectors)[passed] / count[passed]
    middle = (np.flatnonzero(passed) + 0.5) * 2.0 * np.pi / sectors
    return middle, mean, np.sqrt(np.maximum(square - mean**2, 0.0))


def turn_figures(done: FlownCase, folder: Path, kind: str = "png") -> list[Path]:
    """Pitch, depth, heel and speed of a turn in waves over heading, as Figs. 43 to 45 of Kim (2021).

    Parameters
    ----------
    done : A flown case; of any but a turning circle of two turns or more in waves there is none.
    folder : Where to write.
    kind : Format: png, svg or pdf.
    """
    flight = done.simulation
    turned = np.abs(flight["psi"] - flight["psi"][0]).max()
    if done.case.maneuver != "turning_circle" or flight.waves is None or turned < 4.0 * np.pi:
        return []
    figure = blank(11, 7.6)
    place_panels(figure, 2, 2, Margins(bottom=0.95))
    axes = figure.subplots(2, 2, sharex=True)
    travels = np.arctan2(*mean_direction(flight.waves)[::-1])
    for channel, axis in zip(SHOWN, np.ravel(axes), strict=True):
        _panel(flight, channel, axis, float(travels))
    for axis in axes[1]:
        axis.set_xlabel("heading psi [deg]")
        axis.set_xticks(range(0, 361, 45))
    axes[0, 0].set_xlim(0.0, 360.0)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="lower center", ncols=5, frameon=False)
    path = folder / f"{in_file_name(done.case.name)}_v{done.version}_heading.{kind}"
    title = f"{done.case.title}, {done.case.vehicle}, over heading"
    return [finish(figure, path, title, version_words(done.database))]


def _panel(flight: Simulation, channel: str, axis: Any, travels: float) -> None:
    """One channel over heading: the first turn, every later one, their mean; where the waves come from."""
    shown, name, unit = readable(channel, flight[channel])
    heading = np.degrees(np.remainder(flight["psi"], 2.0 * np.pi))
    turn = np.floor(np.abs(flight["psi"] - flight["psi"][0]) / (2.0 * np.pi)).astype(int)
    for k in range(turn.max() + 1):
        x, y = heading[turn == k], np.array(shown[turn == k])
        # A line ends where the heading goes on at the other side of the figure.
        y[1:][np.abs(np.diff(x)) > 180.0] = np.nan
        style = {"color": "tab:blue", "lw": 0.9} if k == 0 else {"color": "0.7", "lw": 0.5}
        label = {0: "first turn", 1: "later turns"}.get(k)
        axis.plot(x, y, label=label, **style)
    middle, mean, spread = over_heading(flight, channel)
    mean, spread = readable(channel, mean)[0], readable(channel, spread)[0]
    x = np.degrees(middle)
    axis.plot(x, mean, color="tab:red", lw=1.6, label="mean of the later turns")
    axis.fill_between(x, mean - spread, mean + spread, color="tab:red", alpha=0.2, lw=0)
    for at, dashes, label in ((travels + np.pi, "--", "head sea"), (travels, ":", "following sea")):
        degrees = float(np.degrees(np.remainder(at, 2.0 * np.pi)))
        axis.axvline(degrees, color="k", lw=0.9, ls=dashes, label=label)
    dress(axis, "", f"{name} [{unit}]")
    if channel in DOWNWARDS:
        axis.invert_yaxis()
