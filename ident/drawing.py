"""Figures drawn quickly: without a second pass over all text, and beside each other in processes.

Matplotlib is imported where something is drawn, not before.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import logging
import multiprocessing
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from ident.processes import cores, serves, unheard
from sim.files import inputs

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

T = TypeVar("T")
_log = logging.getLogger(__name__)
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


@dataclass(frozen=True)
class Margins:
    """Room around and between the panels of a figure [inches].

    Attributes
    ----------
    left, right, top, bottom : From the edges of the figure to the panels.
    between, gap : Between columns and between rows.
    """

    left: float = 0.75
    right: float = 0.15
    top: float = 0.6
    bottom: float = 0.5
    between: float = 0.8
    gap: float = 0.6


def place_panels(figure: Figure, rows: int, columns: int, margins: Margins | None = None) -> None:
    """Panels of equal size at fixed places; an automatic layout draws every figure twice.

    Parameters
    ----------
    figure : Of a size.
    rows, columns : Of panels.
    margins : Around and between them.
    """
    around = margins or Margins()
    width, height = figure.get_size_inches()
    wide = (width - around.left - around.right - around.between * (columns - 1)) / columns
    tall = (height - around.top - around.bottom - around.gap * (rows - 1)) / rows
    figure.subplots_adjust(
        left=around.left / width,
        right=1.0 - around.right / width,
        top=1.0 - around.top / height,
        bottom=around.bottom / height,
        wspace=around.between / wide,
        hspace=around.gap / tall,
    )


def _ready(read: Iterable[Path] | None) -> None:
    """A process that draws: what the command has read it does not write over; it ends when the command does."""
    if read is not None:
        inputs.begin(read)
    serves()


@contextlib.contextmanager
def _without_a_word() -> Iterator[None]:
    """Python's process that clears up after a pool says nothing of what a command that is ended leaves to it.

    It is started with the flags of this one, at the first pool.
    """
    flag = "ignore:resource_tracker:UserWarning"
    sys.warnoptions.append(flag)
    try:
        yield
    finally:
        sys.warnoptions.remove(flag)


def _here(draw: Callable[..., T], *job: Any) -> T:
    return draw(*job)


def _draw_what_comes(jobs: Connection, modules: Sequence[str]) -> None:
    """Of a process started ahead: import what draws, then draw what is sent, until nothing more comes."""
    _ready(None)
    for module in modules:
        importlib.import_module(module)
    with contextlib.suppress(EOFError, OSError):
        while True:
            read, draw, job = jobs.recv()
            inputs.begin(read or ())
            try:
                drawn = draw(*job)
            except Exception as error:
                drawn = error
            jobs.send(drawn)


@contextlib.contextmanager
def ahead(*modules: str) -> Iterator[Callable[..., Any]]:
    """A process that has imported what draws by the time there is something to draw.

    Matplotlib takes longer to import than most cases to fly. On one core, and where no process can be started,
    figures are drawn here, as they are when the process ends before its time.

    Parameters
    ----------
    modules : What to import.

    Yields
    ------
    ``draw(function, *job)``: the result of ``function(*job)``, raising what that raises.
    """
    if cores() < 2:
        yield _here
        return
    context = multiprocessing.get_context("spawn")
    end, others = context.Pipe()
    process = context.Process(target=_draw_what_comes, args=(others, modules), daemon=True)
    with unheard():
        process.start()
    others.close()

    def draw(function: Callable[..., T], *job: Any) -> T:
        try:
            end.send((inputs.noted(), function, job))
            drawn = end.recv()
        except (EOFError, OSError):
            _log.warning("the process that draws has ended: what it was to draw is drawn here")
            return function(*job)
        if isinstance(drawn, Exception):
            raise drawn
        return cast("T", drawn)

    try:
        yield draw
    finally:
        end.close()
        process.kill()


class _Shared(Generic[T]):
    """Jobs that are done here, from the front, and by a pool, from the back: each process has one at a time."""

    def __init__(self, draw: Callable[..., T], jobs: Sequence[tuple[Any, ...]]) -> None:
        self.draw, self.jobs = draw, jobs
        self.left = deque(range(len(jobs)))
        self.given: dict[int, Future[T]] = {}
        self.drawn: dict[int, T] = {}

    def give(self, pool: ProcessPoolExecutor, done: Future[T] | None = None) -> None:
        """Give the last job that is left to a pool, and the next one when that is done."""
        try:
            job = self.left.pop()
        except IndexError:
            return
        try:
            self.given[job] = future = pool.submit(self.draw, *self.jobs[job])
        except RuntimeError:
            # A pool that has ended, or one of whose processes has.
            self.left.append(job)
            return
        future.add_done_callback(functools.partial(self.give, pool))

    def here(self) -> None:
        """Do what is left, and what a process that ended has not done."""
        while len(self.drawn) < len(self.jobs):
            while self.left:
                with contextlib.suppress(IndexError):
                    job = self.left.popleft()
                    self.drawn[job] = self.draw(*self.jobs[job])
            for job, future in list(self.given.items()):
                try:
                    self.drawn[job] = future.result()
                except BrokenProcessPool:
                    _log.warning("a process that draws has ended: what it was to draw is drawn here")
                    self.left.append(job)
                del self.given[job]


@contextlib.contextmanager
def begun(draw: Callable[..., T], jobs: Sequence[tuple[Any, ...]], workers: int = 1) -> Iterator[Callable[[], list[T]]]:
    """``draw(*job)`` for every job, begun by other processes while this one does something else.

    They draw from the back; this one from the front, once it asks. What is drawn does not depend on who draws it.

    Parameters
    ----------
    draw : Function of a module.
    jobs : Its arguments, which can be sent to another process.
    workers : Processes, this one among them; 0 for all cores. No other is started for few jobs.

    Yields
    ------
    A function without arguments: draws what is left and gives the results, in the order of the jobs.
    """
    others = min(workers or cores(), len(jobs) // 2) - 1
    if others < 1 or len(jobs) < _WORTH:
        yield lambda: [draw(*job) for job in jobs]
        return
    shared = _Shared(draw, jobs)
    with _without_a_word():
        pool = ProcessPoolExecutor(others, multiprocessing.get_context("spawn"), _ready, (inputs.noted(),))

    def finish() -> list[T]:
        shared.here()
        return [shared.drawn[k] for k in range(len(jobs))]

    try:
        with unheard():
            for _ in range(others):
                shared.give(pool)
        yield finish
    finally:
        shared.left.clear()
        pool.shutdown(wait=False, cancel_futures=True)


def beside(draw: Callable[..., T], jobs: Sequence[tuple[Any, ...]], workers: int = 1) -> list[T]:
    """``draw(*job)`` for every job, in several processes, in the order of the jobs; parameters as of ``begun``."""
    with begun(draw, jobs, workers) as finish:
        return finish()
