"""Figures drawn quickly: without a second pass over all text, and beside each other in processes.

Matplotlib is imported where something is drawn, not before.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

T = TypeVar("T")

# Figures for which another process is worth its start.
_WORTH = 4

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def _power_formatter() -> Callable[[], Any]:
    """Matplotlib's formatter of ticks with the common power of ten as ``×10⁻³``.

    Its own writes it as a formula, and every tick of the axis with it: parsing them took as long as drawing.
    """
    from matplotlib.ticker import ScalarFormatter

    class PowerOfTen(ScalarFormatter):
        def __init__(self) -> None:
            super().__init__(useOffset=False, useMathText=False)
            self.set_powerlimits((-2, 3))

        def get_offset(self) -> str:
            power = super().get_offset().replace("\N{MINUS SIGN}", "-").removeprefix("1e")
            return f"×10{power.translate(_SUPERSCRIPTS)}" if power else ""

    return PowerOfTen


def scientific(*axes: Axis) -> None:
    """Ticks of axes with one power of ten in common, where the numbers are small or large."""
    formatter = _power_formatter()
    for axis in axes:
        axis.set_major_formatter(formatter())


def fixed_labels(axes: Axes, left: float, below: float) -> None:
    """Labels of both axes at a fixed distance from the panel.

    Matplotlib looks for a place by measuring the text of all ticks, twice a panel.

    Parameters
    ----------
    axes : The panel.
    left : From its left edge to the label of the ordinate [inches].
    below : From its lower edge to that of the abscissa [inches].
    """
    from matplotlib.transforms import ScaledTranslation

    scale = axes.figure.dpi_scale_trans
    axes.yaxis.set_label_coords(0.0, 0.5, axes.transAxes + ScaledTranslation(-left, 0.0, scale))
    axes.xaxis.set_label_coords(0.5, 0.0, axes.transAxes + ScaledTranslation(0.0, -below, scale))


def margins(
    figure: Figure,
    rows: int,
    columns: int,
    *,
    left: float = 0.75,
    right: float = 0.15,
    top: float = 0.6,
    bottom: float = 0.5,
    between: float = 0.8,
    gap: float = 0.6,
) -> None:
    """Room around and between panels of equal size; an automatic layout draws every figure twice.

    Parameters
    ----------
    figure : Of a size.
    rows, columns : Of panels.
    left, right, top, bottom : From the edges of the figure to the panels [inches].
    between, gap : Between columns and between rows [inches].
    """
    width, height = figure.get_size_inches()
    wide = (width - left - right - between * (columns - 1)) / columns
    tall = (height - top - bottom - gap * (rows - 1)) / rows
    figure.subplots_adjust(
        left=left / width,
        right=1.0 - right / width,
        top=1.0 - top / height,
        bottom=bottom / height,
        wspace=between / wide,
        hspace=gap / tall,
    )


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _ready(read: Iterable[Path] | None) -> None:
    """A process that draws: what the command has read it does not write over; it ends when the command does."""
    import signal

    from sim.files import inputs

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if read is not None:
        inputs.begin(read)


def beside(draw: Callable[..., T], jobs: Sequence[tuple[Any, ...]], workers: int = 1) -> list[T]:
    """``draw(*job)`` for every job, in several processes.

    This process draws from the front, the others from the back. What is drawn does not depend on who draws it.

    Parameters
    ----------
    draw : Function of a module.
    jobs : Its arguments, which can be sent to another process.
    workers : Processes, this one among them; 0 for all cores. No other is started for few jobs.

    Returns
    -------
    The results, in the order of the jobs.
    """
    from sim.files import inputs

    others = min(workers or cores(), len(jobs) // 2) - 1
    if others < 1 or len(jobs) < _WORTH:
        return [draw(*job) for job in jobs]
    start = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(others, start, _ready, (inputs.noted(),)) as pool:
        waiting = [pool.submit(draw, *job) for job in reversed(jobs)][::-1]
        try:
            return [_here_or_there(draw, job, one) for job, one in zip(jobs, waiting, strict=True)]
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _here_or_there(draw: Callable[..., T], job: tuple[Any, ...], waiting: Future[T]) -> T:
    """A job that nobody has begun is done here; so is one whose process ended or never came up."""
    if waiting.cancel():
        return draw(*job)
    try:
        return waiting.result()
    except BrokenProcessPool:
        return draw(*job)
