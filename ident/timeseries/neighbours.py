"""Single samples that no boat made, told by their neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.timeseries import MAD_TO_SIGMA

Array = NDArray[np.float64]
# So many robust standard deviations from the median of five.
_FAR = 12.0
# Samples that show what is usual, and the part of them that may be spikes: more are another motion.
_FEWEST, _MOST = 9, 0.05


def _away(value: Array, angle: bool) -> Array:
    """Distance of each sample from the median of five around it."""
    padded = np.pad(value, 2, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, 5)
    if angle:
        turned = np.angle(np.exp(1j * (around - value[:, None])))
        return np.asarray(np.median(turned, axis=1))
    return np.asarray(np.median(around, axis=1) - value)


def far_from_neighbours(value: Array, angle: bool = False) -> NDArray[np.bool_]:
    """Single samples that the ones around them do not lead to.

    Parameters
    ----------
    value : (n,) Samples in their order, as often as a boat's motion asks for.
    angle : Whether they are directions [rad], which come round.

    Returns
    -------
    (n,) True for samples further from the median of five than twelve robust standard deviations and than
    five large steps; none of fewer than nine samples, nor where more than a twentieth is.
    """
    none = np.zeros(len(value), dtype=bool)
    if len(value) < _FEWEST:
        return none
    away = np.abs(_away(value, angle))
    usual = MAD_TO_SIGMA * float(np.median(away))
    steps = np.diff(value)
    steps = np.abs(np.angle(np.exp(1j * steps)) if angle else steps)
    limit = max(_FAR * usual, 5.0 * float(np.percentile(steps, 95)), 1e-9)
    bad = np.asarray(away > limit)
    return bad if bad.mean() <= _MOST else none
