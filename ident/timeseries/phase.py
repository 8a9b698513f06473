"""Whether an oscillation goes on as it began: leaps of its phase, which a clock makes and no motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.timeseries import MAD_TO_SIGMA

Array = NDArray[np.float64]
# Windows of at least one period each, and the fewest and most of them; samples in one.
_FEWEST, _MOST, _SAMPLES = 6, 64, 6
# A leap is beyond so many robust standard deviations of the steps between windows; amplitudes below this share of
# the usual one have no phase.
_SURE, _FAINT = 8.0, 0.3


@dataclass(frozen=True)
class Leap:
    """A step in the phase of an oscillation.

    Attributes
    ----------
    degrees : Its size, of the oscillation's phase.
    time : About when [s].
    """

    degrees: float
    time: float


def leap(time: Array, value: Array, weight: Array, frequency: float) -> Leap | None:
    """The largest step of the phase of a line, where the steps around it are small.

    The phase is fitted in windows of whole periods, each against its neighbours, so that a frequency that is a
    little off, which moves it evenly, makes none.

    Parameters
    ----------
    time : (n,) [s]; ``value`` (n,) of a channel; ``weight`` (n,).
    frequency : Of the oscillation [Hz].

    Returns
    -------
    None for a record of few periods, or whose phase makes no step that stands out.

    Examples
    --------
    >>> t = np.arange(0.0, 60.0, 0.1)
    >>> leap(t, np.sin(t), np.ones(600), 0.5 / np.pi) is None
    True
    """
    periods = (time[-1] - time[0]) * frequency
    windows = int(min(periods, _MOST, time.size // _SAMPLES))
    if windows < _FEWEST:
        return None
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], windows + 1))
    phases, middles = [], []
    usual = math.sqrt(2.0) * float(np.std(value))
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        if b - a < _SAMPLES:
            continue
        angle = 2.0 * math.pi * frequency * time[a:b]
        x = np.column_stack([np.ones(b - a), np.sin(angle), np.cos(angle)]) * np.sqrt(weight[a:b])[:, None]
        _, s, c = np.linalg.lstsq(x, value[a:b] * np.sqrt(weight[a:b]), rcond=None)[0]
        if math.hypot(s, c) > _FAINT * usual:
            phases.append(math.atan2(c, s))
            middles.append(0.5 * (time[a] + time[b - 1]))
    if len(phases) < _FEWEST:
        return None
    # Over one window between, as the step may lie in it.
    steps = np.angle(np.exp(1j * (np.array(phases)[2:] - np.array(phases)[:-2])))
    steps = np.angle(np.exp(1j * (steps - np.median(steps))))
    k = int(np.argmax(np.abs(steps)))
    scatter = MAD_TO_SIGMA * float(np.median(np.abs(steps)))
    size = abs(float(steps[k]))
    return Leap(math.degrees(size), float(middles[k + 1])) if size > max(_SURE * scatter, 1e-6) else None
