"""The channels of one time history: how they are read again and again, and their clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.captive.source import Reduction
from ident.timeseries.clock import Clock
from sim.files.errors import InputError

Array = NDArray[np.float64]


Pieces = Callable[[], Iterator[Array]]


# (time, values, displacement at each sample) -> values along the body's axes, about its moving point.
Moving = Callable[[Array, Array, Array], Array]


@dataclass(frozen=True)
class Channels:
    """The channels of one history.

    Attributes
    ----------
    path : File or folder they come from.
    quantities : ``time`` (unless a rate is stated), loads, and measured states.
    pieces : Starts reading; blocks (rows, channels) in SI.
    first_row : File row of the first sample.
    missing : Channel -> stated values that stand for "nothing measured", in SI.
    moving : Turns loads and moves moments of a body that moves in their axes.
    """

    path: Path
    quantities: list[str]
    pieces: Pieces
    first_row: int = 2
    missing: dict[str, tuple[float, ...]] = field(default_factory=dict)
    moving: Moving | None = None


class NotRising(InputError):
    """A history whose time stamps do not rise, with nothing to stand in for them.

    Attributes
    ----------
    file : Of the run.
    row : Of the data, where time first does not rise.
    clock : All of its stamps.
    first_row : File row of the first stamp.
    """

    def __init__(self, channels: Channels, clock: Clock, at: int, stamp: str) -> None:
        text = "a time that rises; or rate_hz in [source.reduction] where stamps have too few digits"
        if not clock.repeats:
            # Too few digits make stamps that repeat, none that step back.
            text = "a time that rises: one run a file, and a restart without the steps that it repeats"
        super().__init__(f"{channels.path}, data row {at + 1}, column time", stamp, text)
        self.file, self.row = channels.path.name, at + 1
        self.clock, self.first_row = clock, channels.first_row


Timed = Iterator[tuple[Array, Array, NDArray[np.bool_]]]


def timed(channels: Channels, rule: Reduction, clock: Clock | None = None) -> Iterator[tuple[Array, Array]]:
    """Pieces as (time, other channels) within the window, time rising; stamps are fed to ``clock``."""
    at = channels.quantities.index("time") if "time" in channels.quantities else None
    others = [i for i, q in enumerate(channels.quantities) if q != "time"]
    count, last = 0, -math.inf
    for piece in channels.pieces():
        if clock is not None and at is not None:
            clock.feed(piece[:, at])
        if rule.rate_hz is not None:
            time = (count + np.arange(len(piece))) / rule.rate_hz
        else:
            time = piece[:, at]
        step = np.diff(time, prepend=last)
        if (step <= 0.0).any():
            i = int(np.flatnonzero(step <= 0.0)[0])
            whole = _whole(channels, at)
            faults = whole.repeats + whole.backs
            more = f"; {faults} of {whole.samples} stamps repeat or step back" if faults > 1 else ""
            raise NotRising(channels, whole, count + i, f"{time[i]:g} s after {time[i - 1] if i else last:g} s{more}")
        count, last = count + len(piece), float(time[-1])
        keep = np.ones(len(time), dtype=bool)
        if rule.start_s is not None:
            keep &= time >= rule.start_s
        if rule.end_s is not None:
            keep &= time <= rule.end_s
        if keep.any():
            yield time[keep], piece[keep][:, others]


def _whole(channels: Channels, at: int | None) -> Clock:
    """All stamps of a history."""
    clock = Clock()
    for piece in channels.pieces() if at is not None else ():
        clock.feed(piece[:, at])
    return clock
