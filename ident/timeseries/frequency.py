"""Frequency of an oscillation from the record itself, with its standard error."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Share of the record, at its start, that may hold the start-up transient and is not looked at.
START = 0.25
# Steps of the search in cycles over the record, and the widest search around a stated frequency.
_STEP = 0.1
_WIDEST = 0.1
# A line has to hold this share of the scatter to be one.
_LINE = 0.5
_FEWEST = 32


@dataclass(frozen=True)
class Line:
    """A frequency found in a record.

    Attributes
    ----------
    frequency, stderr : [Hz].
    channel : Position of the channel it was found in.
    share : Share of the channel's variance that the oscillation holds.
    """

    frequency: float
    stderr: float
    channel: int
    share: float


def _left(frequency: float, time: Array, value: Array, weight: Array) -> float:
    """Sum of squares that mean and three harmonics leave."""
    angle = 2.0 * math.pi * frequency * time
    x = np.column_stack([np.ones(time.size), *(f(k * angle) for k in (1, 2, 3) for f in (np.sin, np.cos))])
    root = np.sqrt(weight)[:, None]
    solution = np.linalg.lstsq(x * root, value * root[:, 0], rcond=None)[0]
    residual = (value - x @ solution) * root[:, 0]
    return float(residual @ residual)


def estimate(time: Array, values: Array, weight: Array, near: float | None) -> Line | None:
    """The frequency of the channel with the clearest oscillation.

    Least squares of mean and three harmonics over the frequency, the first quarter of the record
    left out. The standard error is the bound of Cramer and Rao for a line in noise,
    var(w) = 24 sigma^2 / (A^2 n T^2) (Rife and Boorstyn 1974, with T = n dt), n being the samples that
    are independent by the residuals' first autocorrelation.

    Parameters
    ----------
    time : (n,) [s]; ``values`` (n, channels) to look in; ``weight`` (n,).
    near : Stated frequency [Hz], searched to a tenth around; None to search from two periods in the
        record to an eighth of its sampling rate.

    Returns
    -------
    None where no channel holds an oscillation of two periods or more.
    """
    late = time >= time[0] + START * (time[-1] - time[0])
    t, y, w = time[late] - time[0], values[late], weight[late] / weight[late].mean()
    span = float(t[-1] - t[0]) if t.size else 0.0
    if t.size < _FEWEST or span <= 0.0 or (near is not None and near * span < 2.0):
        return None
    best = None
    for c in range(y.shape[1]):
        one = _channel(t, y[:, c], w, span, near, c)
        if one is not None and one.share > _LINE and (best is None or one.share > best.share):
            best = one
    return best


def _channel(t: Array, y: Array, w: Array, span: float, near: float | None, c: int) -> Line | None:
    from scipy.optimize import minimize_scalar

    centred = y - (w * y).sum() / w.sum()
    total = float((w * centred**2).sum())
    if total <= 1e-24 * float((w * y**2).sum()):
        return None
    centre = near if near is not None else _peak(t, centred, span)
    if centre is None:
        return None
    step = _STEP / span
    wide = max(_WIDEST * centre, step) if near is not None else 2.0 / span
    grid = np.arange(max(centre - wide, 1.0 / span), centre + wide + step, step)
    if grid.size > 4000:
        return None
    left = [_left(float(f), t, centred, w) for f in grid]
    k = int(np.argmin(left))
    best = minimize_scalar(
        _left, bounds=(grid[k] - step, grid[k] + step), args=(t, centred, w), method="bounded", options={"xatol": 1e-9}
    )
    frequency, rest = float(best.x), float(best.fun)
    amplitude2 = 2.0 * max(total - rest, 0.0) / w.sum()
    if amplitude2 <= 0.0:
        return None
    noise2 = rest / max(w.sum() - 7.0, 1.0)
    angle = 2.0 * math.pi * frequency * t
    x = np.column_stack([np.ones(t.size), *(f(k * angle) for k in (1, 2, 3) for f in (np.sin, np.cos))])
    residual = centred - x @ np.linalg.lstsq(x, centred, rcond=None)[0]
    below = float(residual @ residual)
    rho = min(max(float(residual[1:] @ residual[:-1]) / below if below > 0.0 else 0.0, 0.0), 0.99)
    independent = t.size * (1.0 - rho) / (1.0 + rho)
    omega = math.sqrt(24.0 * noise2 / (amplitude2 * max(independent, 1.0))) / span
    return Line(frequency, omega / (2.0 * math.pi), c, 1.0 - rest / total)


def _peak(t: Array, y: Array, span: float) -> float | None:
    """The largest line of the spectrum, from a record resampled evenly."""
    n = t.size
    even = np.interp(np.linspace(t[0], t[-1], n), t, y)
    power = np.abs(np.fft.rfft(even)) ** 2
    power[:2] = 0.0
    last = n // 8
    if last <= 2:
        return None
    return float(np.argmax(power[:last])) / span
