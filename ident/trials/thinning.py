"""Records whose noise a filter has made alike from sample to sample, thinned to samples that are independent.

A smooth path is fitted with white noise. Noise that was filtered looks like motion to it: the path follows the
noise, and every error comes out too small. Its size shows it: seen in every second, fourth, ... sample the noise of
a path stays the same where it is white, and grows where it was filtered, until the samples are independent.
"""

from __future__ import annotations

import math

import numpy as np

from ident.timeseries.smoothing import noise_of
from ident.trials.reading import Recording
from sim.files.record import Record

# Noise grows by so much in all before a filter is seen; the stride is the first that sees this share of the most.
_GROWS, _ENDS = 1.3, 0.93
# From one stride to the next filtered noise grows by less than this; a path that is sampled too coarsely by more.
_COARSE = 2.0
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
    strides, sizes = [1], [noise_of(t, x)] if len(record) >= 2 * _FEWEST else [0.0]
    while sizes[0] > 0.0:
        k = 2 * strides[-1]
        if len(record) < k * _FEWEST or float(np.median(np.diff(t))) * k > _APART * float(t[-1] - t[0]):
            break
        size = noise_of(t[::k], x[::k])
        if size > _COARSE * sizes[-1]:
            break
        strides.append(k)
        sizes.append(size)
    # What a size is known to: 1 / sqrt(2 n) of itself.
    known = 3.0 * math.sqrt(0.5 * strides[-1] / max(len(record), 1))
    steps = np.abs(np.diff(x))
    digit = float(steps[steps > 0.0].min()) if (steps > 0.0).any() else 0.0
    if sizes[-1] < max((_GROWS + known) * sizes[0], _DIGITS * digit):
        return record, ""
    at = next(i for i, size in enumerate(sizes) if size >= _ENDS * max(sizes))
    step = float(np.median(np.diff(t)))
    words = f"{header}: its noise is filtered, one sample in {strides[at]} ({strides[at] * step:.2g} s) is used"
    if at == len(strides) - 1:
        words += "; it may be filtered over longer, which no record of this length shows: errors may be too small"
    return record.kept(slice(0, len(record), strides[at])), words
