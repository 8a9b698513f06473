"""Figures of flown cases, labelled with units, frame and version."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ident.drawing import Margins, fixed_labels, place_panels
from ident.output import whole
from ident.text import in_figure
from ident.validation.trial_reference import DRIVEN
from sim.boat.database import version_words
from sim.files.record import Record
from sim.flight.simulation import CHANNELS, Simulation

if TYPE_CHECKING:
    from ident.validation.bands import Bands
    from ident.validation.flown_case import FlownCase

Array = NDArray[np.float64]
FRAME = "frame: x forward, y starboard, z down; psi and r positive to starboard"
_LABELS = {
    "psi": "heading psi",
    "theta": "pitch theta",
    "phi": "heel phi",
    "u": "surge speed u",
    "v": "sway speed v",
    "w": "heave speed w",
    "U": "speed U",
    "p": "roll rate p",
    "q": "pitch rate q",
    "r": "yaw rate r",
    "x": "advance x",
    "y": "transfer y",
    "z": "depth of the origin z",
    "D0": "depth of the sail top D0",
    "n": "revolutions n",
    "dV": "vertical command dV",
    "dH": "horizontal command dH",
    "ballast": "ballast",
    "trim_tank": "shift of the centre of gravity",
    "u_over_U0": "surge speed u/U0",
    "dz_over_L0": "depth change dz/L",
}
# Columns of a flight that are neither channels nor planes.
_NO_PLANES = ("t", "dV", "dH")
# The angle at which a zigzag reverses, and the command that is reversed.
_REVERSED_BY = {"psi": "dH", "theta": "dV"}
_ALONG = {"t": "time t [s]", "s": "path length over ground s [m]"}
_STYLE = {"EXP": ("k", "o"), "CFD": ("tab:blue", "s")}
# Depth grows downwards on paper too.
DOWNWARDS = ("z", "D0")
_UNITS = CHANNELS | {"dV": "rad", "dH": "rad"}
_SHOWN = {
    "turning_circle": ("psi", "D0", "U", "phi"),
    "direct_spiral": ("dH", "r", "U", "D0"),
    "reverse_spiral": ("dH", "r", "U", "D0"),
    "pull_out": ("dH", "r", "psi", "U", "phi", "D0"),
    "stopping": ("n", "u", "x", "psi", "theta", "D0"),
    "meander": ("dV", "theta", "q", "D0"),
    "depth_change": ("dV", "theta", "D0", "U"),
    "course_keeping": ("dH", "psi", "y", "r"),
    "rise": ("theta", "q", "D0", "u_over_U0"),
    "regular_waves": ("D0", "theta", "u", "dV"),
    "irregular_waves": ("D0", "theta", "phi", "ballast"),
    "self_propulsion": ("n", "theta", "D0", "ballast"),
}
_DEFAULT = ("psi", "theta", "phi", "u", "D0", "r")
# Room below the panels for the abscissa and two lines of legend [inches].
_LEGEND = 0.95
# Between rows that have the abscissa in common, with room for a line on top of a panel [inches].
_SHARED_GAP = 0.3
# Columns of the legend of planes, and a row of it as a part of the panel's height.
_LEGEND_COLUMNS, _ROW_OF_LEGEND = 3, 0.12


def _shown(values: Array, unit: str) -> tuple[Array, str]:
    """Angles in degrees, everything else as it is."""
    if unit.startswith("rad"):
        return np.degrees(values), unit.replace("rad", "deg")
    return values, unit


def _degrees(record: Record) -> Array:
    """A reference as it is drawn: angles in degrees."""
    return _shown(record.shown.value, record.shown.unit)[0]


def readable(channel: str, values: Array) -> tuple[Array, str, str]:
    """A channel of a simulation for people: angles in degrees, and the name of its axis.

    Returns
    -------
    values, name, unit.
    """
    shown, unit = _shown(values, _UNITS.get(channel, "rad"))
    return shown, _LABELS.get(channel, channel.replace("_", " ")), unit


def _sources(done: FlownCase) -> list[str]:
    reference = done.case.reference
    published = reference.published_model if reference else None
    return [*(reference.compare if reference else []), *([published] if published else [])]


def _line(done: FlownCase, source: str) -> dict[str, Any]:
    """How a source is drawn."""
    if done.case.reference and source == done.case.reference.published_model:
        return {"color": "tab:green", "lw": 1.2, "ls": "--", "label": f"published model ({in_figure(source)})"}
    colour, marker = _STYLE.get(source, ("tab:gray", "^"))
    return {"color": colour, "marker": marker, "ms": 2.5, "lw": 0.6, "markevery": 4, "label": in_figure(source)}


def _flights(done: FlownCase) -> list[tuple[Simulation, dict[str, Any]]]:
    main = {"color": "tab:red", "lw": 1.6, "label": "simulated from the database"}
    as_started = [
        (flight, {"color": "tab:orange", "lw": 1.2, "ls": "-.", "label": f"simulated as {in_figure(source)} starts"})
        if source != DRIVEN
        else (flight, {"color": "tab:blue", "lw": 1.2, "ls": "--", "label": "simulated with the recorded controls"})
        for source, flight in done.as_started.items()
    ]
    return [(done.simulation, main), *as_started]


def _series(done: FlownCase, channel: str, axis: Any, bands: Bands | None) -> None:
    """One channel of the references, the bands and the flights over the abscissa."""
    along, unit = done.reference.abscissa, _UNITS[channel]
    for source in _sources(done):
        if channel in done.reference[source]:
            record = done.reference[source][channel]
            unit = record.shown.unit
            axis.plot(record.abscissa, _degrees(record), **_line(done, source))
    if bands and along == "t" and channel in bands.channels:
        for level, alpha in (("95", 0.15), ("50", 0.3)):
            low, high = (_shown(edge, _UNITS[channel])[0] for edge in bands.band(channel, level))
            axis.fill_between(bands.time, low, high, color="tab:red", alpha=alpha, lw=0, label=f"{level} % band")
    for flight, style in _flights(done):
        values, unit = _shown(flight[channel], _UNITS[channel])
        axis.plot(flight[along], values, **style)
    dress(axis, _ALONG[along], f"{_LABELS.get(channel, channel)} [{unit}]")
    if channel in DOWNWARDS:
        axis.invert_yaxis()


def blank(width: float, height: float) -> Any:
    """An empty figure of a size [inches], drawn to a file."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height))


def finish(figure: Any, path: Path, title: str, stamp: str) -> Path:
    """Put title, database version and frame on top and write.

    Parameters
    ----------
    path : File to write; the suffix chooses the format.
    title : Case and vehicle. stamp : Database version.

    Returns
    -------
    ``path``.
    """
    top = 1.0 - 0.08 / figure.get_figheight()
    figure.suptitle(f"{in_figure(title)}\n{in_figure(stamp)}; {FRAME}", fontsize=10, y=top)
    with whole(path) as part:
        figure.savefig(part, dpi=120)
    return path


def dress(axis: Any, x: str, y: str) -> None:
    """Name the axes of a panel, with a grid."""
    axis.set_xlabel(x)
    axis.set_ylabel(y)
    fixed_labels(axis, 0.5, 0.3)
    axis.grid(alpha=0.3)


def share_abscissa(axes: Any, columns: int) -> None:
    """Number and name the abscissa that panels have in common below the lowest of each column, with few ticks.

    Ticks are most of the time of a panel.
    """
    for axis in axes:
        axis.locator_params(axis="x", nbins=5)
        axis.locator_params(axis="y", nbins=6)
    for axis in axes[:-columns]:
        axis.set_xlabel("")
        axis.tick_params(labelbottom=False)


def _track(done: FlownCase, axis: Any) -> None:
    """The path over ground, north up, both axes to one scale."""
    for source in _sources(done):
        series = done.reference[source]
        if {"x", "y"} <= set(series):
            axis.plot(series["y"].at(series["x"].abscissa), series["x"].value, **_line(done, source))
    for flight, style in _flights(done):
        axis.plot(flight["y"], flight["x"], **style)
    dress(axis, "transfer y, to starboard [m]", "advance x, ahead [m]")
    axis.set_aspect("equal", adjustable="datalim")


def _checks(done: FlownCase, channel: str, axis: Any) -> None:
    """The command and the check angles of a zigzag over the angle that it reverses at."""
    command = getattr(done.case.command, _REVERSED_BY.get(channel, ""), None)
    if command is None or command.law != "zigzag":
        return
    flight, along = done.simulation, done.reference.abscissa
    name = _REVERSED_BY[channel]
    axis.plot(flight[along], np.degrees(flight[name]), color="0.6", lw=1.0, drawstyle="steps-post")
    for side in (-1.0, 1.0):
        axis.axhline(side * command.check_deg, color="0.4", lw=0.8, ls=":")
    note = f"grey: {_LABELS[name]}; dotted: check angle {command.check_deg:g} deg"
    axis.set_title(note, fontsize=8, loc="right")


def _deflections(done: FlownCase, planes: list[str], axis: Any) -> None:
    """Every plane of the main flight."""
    along = done.reference.abscissa
    for plane in planes:
        axis.plot(done.simulation[along], np.degrees(done.simulation[plane]), lw=1.0, label=in_figure(plane))
    dress(axis, _ALONG[along], "plane deflection [deg]")
    # Room above the curves, so that the legend covers none.
    low, high = axis.get_ylim()
    axis.set_ylim(low, high + _ROW_OF_LEGEND * math.ceil(len(planes) / _LEGEND_COLUMNS) * (high - low))
    axis.legend(loc="upper center", fontsize=7, frameon=False, ncols=_LEGEND_COLUMNS)


def _spiral(done: FlownCase, axis: Any) -> None:
    """Steady yaw rate against rudder, in the order flown."""
    curve = done.curve or []
    rudder, rate = [p.dH_deg for p in curve], [p.r_degps for p in curve]
    axis.plot(rudder, rate, color="tab:red", marker="o", ms=4, lw=1.2, label="simulated from the database")
    axis.axhline(0.0, color="k", lw=0.6)
    axis.axvline(0.0, color="k", lw=0.6)
    dress(axis, "horizontal command dH [deg]", "steady yaw rate r [deg/s]")


def _grid(done: FlownCase, axes: Any) -> None:
    """Self-propulsion over speed, one line a depth."""
    names = {
        "n_rps": "revolutions n [1/s]",
        "dV_deg": "dV [deg]",
        "ballast_kg": "ballast [kg]",
        "pitch_deg": "pitch [deg]",
    }
    grid = done.grid or []
    for axis, (key, label) in zip(axes, names.items(), strict=True):
        for depth in sorted({p.depth_m for p in grid}):
            points = [p for p in grid if p.depth_m == depth and getattr(p, key) is not None]
            speeds, values = [p.speed_mps for p in points], [getattr(p, key) for p in points]
            axis.plot(speeds, values, marker="o", label=f"D0 = {depth:g} m")
        dress(axis, "speed U [m/s]", label)
    for value in done.case.published:
        axes[0].axhline(
            value.value, color="tab:blue", ls="--", lw=1.0, label=in_figure(f"{value.source} {value.metric}")
        )


def _draw(done: FlownCase, bands: Bands | None) -> tuple[Any, Any]:
    """The figure, and the axis that has every label."""
    kind = done.case.maneuver or ""
    if done.grid:
        figure = blank(11, 7)
        place_panels(figure, 2, 2, Margins(bottom=_LEGEND))
        axes = figure.subplots(2, 2)
        _grid(done, np.ravel(axes))
        return figure, np.ravel(axes)[0]
    if kind in ("turning_circle", "direct_spiral", "reverse_spiral"):
        figure = blank(13, 7)
        place_panels(figure, 2, 4, Margins(bottom=_LEGEND))
        spec = figure.add_gridspec(2, 4)
        main = figure.add_subplot(spec[:, :2])
        _track(done, main) if kind == "turning_circle" else _spiral(done, main)
        for channel, place in zip(_SHOWN[kind], (spec[0, 2], spec[0, 3], spec[1, 2], spec[1, 3]), strict=True):
            _over_time(done, channel, figure.add_subplot(place))
        return figure, main
    reference = done.case.reference
    named = reference.channels if reference and reference.channels else list(_SHOWN.get(kind, _DEFAULT))
    channels = [c for c in named if c in done.simulation.columns or c in CHANNELS]
    planes = [c for c in done.simulation.columns if c not in CHANNELS and c not in _NO_PLANES]
    panels = len(channels) + bool(planes)
    rows, columns = (panels + 1) // 2, min(2, panels)
    figure = blank(11, 2.4 * rows + 1.1)
    place_panels(figure, rows, columns, Margins(bottom=_LEGEND, gap=_SHARED_GAP))
    axes = np.ravel(figure.subplots(rows, columns))
    for channel, axis in zip(channels, axes, strict=False):
        _series(done, channel, axis, bands)
        _checks(done, channel, axis)
    if planes:
        _deflections(done, planes, axes[len(channels)])
    for axis in axes[panels:]:
        axis.set_visible(False)
    share_abscissa(axes[:panels], columns)
    return figure, axes[0]


def _over_time(done: FlownCase, channel: str, axis: Any) -> None:
    """One channel over time, with the references that have it over time."""
    unit = _UNITS[channel]
    if done.reference.abscissa == "t":
        for source in _sources(done):
            if channel in done.reference[source]:
                record = done.reference[source][channel]
                axis.plot(record.abscissa, _degrees(record), **_line(done, source))
    for flight, style in _flights(done):
        values, unit = _shown(flight[channel], _UNITS[channel])
        axis.plot(flight["t"], values, **style)
    dress(axis, _ALONG["t"], f"{_LABELS.get(channel, channel)} [{unit}]")
    if channel in DOWNWARDS:
        axis.invert_yaxis()


def case_figure(done: FlownCase, path: Path, bands: Bands | None = None) -> Path:
    """Draw a case: channels over the references; the track of a turn, the curve of a spiral.

    Parameters
    ----------
    done : A flown case.
    path : File to write; the suffix chooses the format.
    bands : Flown samples, drawn as 50 and 95 % bands.

    Returns
    -------
    ``path``.
    """
    figure, labelled = _draw(done, bands)
    handles, labels = labelled.get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=4, frameon=False)
    return finish(figure, path, f"{done.case.title}, {done.case.vehicle}", version_words(done.database))
