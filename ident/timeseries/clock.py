"""Time stamps of a history in bounded memory: which repeat, which step back, which leave a gap."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Rows that are remembered of each fault, and stamps around the first repeat that are looked at.
_ROWS = 1000
_AROUND = 100
# A step that is longer than its neighbours by this factor is a gap.
_WIDE = 50.0


def gap_before(step: Array) -> NDArray[np.bool_]:
    """Whether each step is alone, and longer than its neighbours and the usual one by a factor of fifty.

    No sample is there. A time step that a solver adapts grows from one to the next by less.
    """
    steps = np.where(np.isfinite(step), step, 0.0)
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    before, behind = np.concatenate([[0.0], steps[:-1]]), np.concatenate([steps[1:], [0.0]])
    beside = np.maximum(before, behind)
    return np.asarray((beside > 0.0) & (steps > _WIDE * np.maximum(beside, usual)))


@dataclass
class Clock:
    """What a file's time stamps are like, fed piece by piece.

    Attributes
    ----------
    samples : Stamps so far.
    first, last : First and latest finite stamp [s]; NaN before there is one.
    longest : Longest step forward [s].
    repeat, back, bad : Positions (from 0) of stamps that repeat the one before, step back, or
        are no finite number; the first thousand of each.
    repeats, backs, bads : How many there are.
    at_repeat, at_back : The first stamp that repeats; the first step back, from and to [s].
    gap, gaps : Positions of stamps behind a gap, as ``gap_before``; how many there are.
    around : Stamps around the first repeat, for the digits they are written with.
    """

    samples: int = 0
    first: float = math.nan
    last: float = math.nan
    longest: float = 0.0
    repeat: list[int] = field(default_factory=list)
    back: list[int] = field(default_factory=list)
    bad: list[int] = field(default_factory=list)
    gap: list[int] = field(default_factory=list)
    gaps: int = 0
    repeats: int = 0
    backs: int = 0
    bads: int = 0
    at_repeat: float = math.nan
    at_back: tuple[float, float] = (math.nan, math.nan)
    around: Array = field(default_factory=lambda: np.zeros(0))

    def feed(self, time: Array) -> None:
        """Take in the next stamps.

        Parameters
        ----------
        time : (n,) [s], in the order of the file.
        """
        finite = np.isfinite(time)
        bad = np.flatnonzero(~finite)
        self.bads += bad.size
        self._note(self.bad, bad)
        place, stamps = np.flatnonzero(finite), time[finite]
        before = np.concatenate([[self.last], stamps[:-1]]) if stamps.size else stamps
        step = stamps - before
        back, same = np.flatnonzero(step < 0.0), np.flatnonzero(step == 0.0)
        if back.size and not self.backs:
            self.at_back = (float(before[back[0]]), float(stamps[back[0]]))
        if same.size and not self.repeats:
            k = int(same[0])
            self.at_repeat = float(stamps[k])
            self.around = stamps[max(k - _AROUND, 0) : k + _AROUND].copy()
        self.backs += back.size
        self.repeats += same.size
        self._note(self.back, place[back])
        self._note(self.repeat, place[same])
        wide = np.flatnonzero(gap_before(step))
        self.gaps += wide.size
        self._note(self.gap, place[wide])
        if stamps.size:
            self.longest = max(self.longest, float(np.nanmax(step, initial=0.0)))
            self.first = float(stamps[0]) if math.isnan(self.first) else self.first
            self.last = float(stamps[-1])
        self.samples += time.size

    def _note(self, known: list[int], more: NDArray[np.int64]) -> None:
        known.extend((more[: max(_ROWS - len(known), 0)] + self.samples).tolist())
