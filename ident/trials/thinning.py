"""Records whose noise a filter has made alike from sample to sample, thinned to samples that are independent.

A smooth path is fitted with white noise. Noise that was filtered looks like motion to it: the path follows the
noise, and every error comes out too small. Its size shows it: seen in every second, fourth, ... sample the noise of
a path stays the same where it is white, and grows where it was filtered, until the samples are independent.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.smoothing import noise_of
from ident.trials.reading import Recording
from sim.files.record import Record

Array = NDArray[np.float64]
# Noise grows by so much in all before a filter is seen; the stride is the first that sees this share of the most.
_GROWS, _ENDS = 1.3, 0.93
# Quarter of the distribution that is quiet: its quantile of a normal distribution's size.
_QUIET, _NORMAL = 25.0, 0.31864
# Sum of the squares of 1, 3, 3, 1: variance of a third difference of white noise.
_THIRD = 20.0
# From one stride to the next filtered noise grows by less than this; a path that is sampled too coarsely by more.
_COARSE = 2.0
# From there on samples are independent: it grows by less than this.
_LEVEL = 1.08
# Noise of so many last digits is that of rounding.
_DIGITS = 3.0
# Samples are left at most this share of the record apart, and no fewer than so many.
_APART, _FEWEST = 1.0 / 50.0, 60


# Channels that paths are laid through.
_CHANNELS = ("psi", "theta", "phi", "r", "q", "p", "north", "east", "z", "u", "U")


def with_white_noise(one: Recording) -> Recording:
    """A recording whose channels hold samples with independent noise; what was thinned is said."""
    channels, said = dict(one.channels), list(one.assumed)
    for name in _CHANNELS:
        if name in channels:
            channels[name], words = thinned(channels[name], one.headers[name])
            said += [words] if words else []
    return one.with_(channels=channels, assumed=tuple(said))


def _quiet_noise(x: Array, stride: int) -> float:
    """Noise of every k-th sample, from third differences where the record is at its quietest.

    A path that bends between its samples shows noise too, where the boat maneuvers; a filter is at work everywhere.
    """
    apart = x[3 * stride :] - 3.0 * x[2 * stride : -stride] + 3.0 * x[stride : -2 * stride] - x[: -3 * stride]
    return float(np.percentile(np.abs(apart), _QUIET)) / (_NORMAL * math.sqrt(_THIRD))


def _ratio(now: float, then: float) -> float:
    if then > 0.0:
        return now / then
    return math.inf if now > 0.0 else 0.0


def thinned(record: Record, header: str) -> tuple[Record, str]:
    """Every k-th sample of a record, k as large as its noise is filtered; and what was seen, in words.

    Parameters
    ----------
    record : One channel.
    header : Its column, for the words.

    Returns
    -------
    The record as it is, and no words, where its noise is white.
    """
    t, x = record.abscissa, record.value
    before = (noise_of(t, x), _quiet_noise(x, 1)) if len(record) >= 2 * _FEWEST else (0.0, 0.0)
    strides, sizes = [1], [max(before)]
    ended = False
    while sizes[0] > 0.0:
        k = 2 * strides[-1]
        if len(record) < k * _FEWEST or float(np.median(np.diff(t))) * k > _APART * float(t[-1] - t[0]):
            break
        here = (noise_of(t[::k], x[::k]), _quiet_noise(x, k))
        # A filter makes both grow, a path that bends the one or the other.
        growth = min(_ratio(now, then) for now, then in zip(here, before, strict=True))
        # Independent samples stay as they are; what grows after that is the path between them.
        if not _LEVEL <= growth <= _COARSE:
            ended = growth < _LEVEL
            break
        strides.append(k)
        sizes.append(growth * sizes[-1])
        before = here
    # What a size is known to: 1 / sqrt(2 n) of itself.
    known = 3.0 * math.sqrt(0.5 * strides[-1] / max(len(record), 1))
    steps = np.abs(np.diff(x))
    digit = float(steps[steps > 0.0].min()) if (steps > 0.0).any() else 0.0
    if sizes[-1] < max((_GROWS + known) * sizes[0], _DIGITS * digit):
        return record, ""
    at = next(i for i, size in enumerate(sizes) if size >= _ENDS * max(sizes))
    step = float(np.median(np.diff(t)))
    words = f"{header}: its noise is filtered, one sample in {strides[at]} ({strides[at] * step:.2g} s) is used"
    if not ended:
        words += "; it may be filtered over longer, which no record of this length shows: errors may be too small"
    return record.kept(slice(0, len(record), strides[at])), words
