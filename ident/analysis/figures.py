"""Figures of stability: roots over speed and depth, and answers to the commands over frequency."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ident.output import whole
from ident.text import in_figure
from sim.files.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ident.analysis.result import Linear, Stability, StabilityMap

Array = NDArray[np.float64]
_ENDINGS = (".png", ".svg", ".pdf")
# The answer that is drawn of each plane of motion, and its name in the figure.
_ANSWERS = {"vertical": ("theta", "dV"), "horizontal": ("r", "dH")}
_FREQUENCIES = np.geomspace(1e-3, 1e1, 300)


def response(linear: Linear, output: str, frequencies: Array) -> NDArray[np.complex128]:
    """Answer of a state to the command, (i omega - A)^-1 B, at frequencies [rad/s]."""
    a, b = np.array(linear.a), np.array(linear.b)
    k, one = linear.states.index(output), np.eye(len(a))
    return np.array([np.linalg.solve(1j * w * one - a, b)[k] for w in frequencies])


def stability_figure(over: StabilityMap, path: Path) -> Path:
    """Root loci over speed, a colour a depth, and Bode plots of pitch by dV and yaw rate by dH.

    Parameters
    ----------
    over : Over speeds and depths.
    path : ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    InputError
        For another ending, or when there is no linear model to draw.
    """
    if path.suffix not in _ENDINGS:
        raise InputError(str(path), f"the ending {path.suffix!r}", ", ".join(_ENDINGS))
    states = [s for s in over if s.linear]
    if not states:
        raise InputError("stability, figure", "no linear model at any speed and depth", "a boat with added mass")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 9.0), layout="constrained")
    _draw(figure, states)
    figure.suptitle(in_figure(f"{over.title}, database version {over.version}"))
    with whole(path) as part:
        figure.savefig(part, format=path.suffix[1:], dpi=130)
    return path


def _draw(figure: Figure, states: list[Stability]) -> None:
    import matplotlib

    axes = figure.subplots(3, 2)
    depths = sorted({s.depth for s in states})
    fastest = max(s.speed for s in states)
    colours = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(depths)))
    for column, (plane, (output, command)) in enumerate(_ANSWERS.items()):
        for one in states:
            colour = colours[depths.index(one.depth)]
            roots = np.array(getattr(one, plane)).reshape(-1, 2)
            label = f"D0 {one.depth:g} m" if one.speed == fastest else None
            size = 10.0 + 40.0 * one.speed / fastest
            axes[0, column].scatter(*roots.T, s=size, color=colour, alpha=0.7, label=label)
            if plane in one.linear and output in one.linear[plane].states:
                answer = response(one.linear[plane], output, _FREQUENCIES)
                width = 0.5 + 1.5 * one.speed / fastest
                axes[1, column].loglog(_FREQUENCIES, np.abs(answer), color=colour, lw=width)
                axes[2, column].semilogx(_FREQUENCIES, _phase(answer), color=colour, lw=width)
        _label(axes[:, column], plane, output, command)


def _phase(answer: NDArray[np.complex128]) -> Array:
    return np.asarray(np.degrees(np.unwrap(np.angle(answer))))


def _label(axes: NDArray[np.object_], plane: str, output: str, command: str) -> None:
    roots, size, phase = axes
    unit = "1" if output == "theta" else "1/s"
    roots.axvline(0.0, color="k", lw=0.6)
    roots.set(title=f"{plane}: roots, larger with speed", xlabel="real part [1/s]", ylabel="imaginary part [1/s]")
    roots.legend(fontsize="small")
    size.set(ylabel=f"|{output} / {command}| [{unit}]", title=f"answer of {output} to {command}, wider with speed")
    phase.set(xlabel="frequency [rad/s]", ylabel="phase [deg]")
    one: Axes
    for one in axes:
        one.grid(alpha=0.3)
