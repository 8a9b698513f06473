"""The time by which loads come behind the motion, from a record that lets it be seen.

A steady oscillation does not: a lag turns velocity into acceleration, as another added mass would. Two things do.

* A motion that is more than one line (a start from rest, a ramp, two frequencies): the loads are fitted by
  velocity, acceleration and velocity times its size of the measured displacement, all of them late by one time,
  y(t) = c0 + c1 v(t - tau) + c2 a(t - tau) + c3 v|v|(t - tau), and tau is that of the least squares (a separable
  problem: Golub and Pereyra 1973, SIAM J Numer Anal 10:413-432). Its standard error is that of the curvature there.
* A channel of rate or acceleration beside the displacement: the phase it should have is known.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ident.captive.source import MOTIONS

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline
from sim.boat.catalogue import OUTPUTS

Array = NDArray[np.float64]

# Lags that are tried, in periods of the oscillation, and their number; the step that shows the curvature.
_WIDEST = 0.2
_TRIED = 41
_STEP = 0.02
# Samples that are looked at, after averaging neighbours; fewest in a period.
_MOST = 4096
_PER_PERIOD = 12
# Width of the filter of both, in periods: a bell's standard deviation.
_SMOOTH = 1.0 / 24.0
# The same of the filter that parts motion from noise: half of a motion of twice the frequency passes, and has to.
_SLOW = 1.0 / 16.0
_SHARE = 0.3
# Steps that differ by more than this factor are no clock that a spline is laid through.
_UNEVEN = 5.0
# Steps that differ by more than this part are made even before they are filtered.
_UNEVENNESS = 0.1
# A lag is seen when its standard error is below this share of a period, and no other lag fits as well by so
# many standard errors.
_SEEN = 0.005
_SURE = 6.0


@dataclass(frozen=True)
class Delay:
    """By how much something comes behind the motion.

    Attributes
    ----------
    what : Channels, in words.
    seconds, stderr : [s]; what is stated is taken off already.
    """

    what: str
    seconds: float
    stderr: float


def of_loads(
    time: Array, values: Array, weight: Array, names: list[str], frequency: float, stated: dict[str, float]
) -> Delay | None:
    """The one lag of all loads behind the measured displacement.

    Parameters
    ----------
    time : (n,) [s]; ``values`` (n, channels) along the body; ``weight`` (n,).
    names : Of the channels.
    frequency : Of the oscillation [Hz].
    stated : Channel -> delay that is taken off.

    Returns
    -------
    None where there is no displacement, or where its motion does not let a lag be seen.
    """
    loads = [n for n in names if n in OUTPUTS]
    step, period = max(1, time.size // _MOST), 1.0 / frequency
    n = time.size // step
    if "displacement" not in names or not loads or n < 4 * _PER_PERIOD:
        return None
    t, w = _means(time, step, n), _means(weight, step, n)
    columns = {o: _means(values[:, names.index(o)], step, n) for o in (*loads, "displacement")}
    if not _even(np.diff(t), period / _PER_PERIOD):
        return None
    t, w, columns = _filled(t, w, columns)
    inside = (t > t[0] + 0.5 * period) & (t < t[-1] - 0.5 * period)
    if inside.sum() < 4 * _PER_PERIOD:
        return None
    # Few records need them, and they are slow to load.
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    displacement = columns["displacement"]
    if not _more_than_a_line(t, displacement, frequency):
        return None
    smooth = _smoothing(t, _SMOOTH * period)
    moved = CubicSpline(t, smooth(displacement))
    root = np.sqrt(w[inside] / w[inside].mean())
    y = np.stack([smooth(columns[o])[inside] * root for o in loads], axis=1)
    early = [t[inside] - stated.get(o, 0.0) + stated.get("displacement", 0.0) for o in loads]

    def residuals(tau: float) -> Array:
        return np.stack([_residual(moved, at - tau, root, y[:, c]) for c, at in enumerate(early)], axis=1)

    grid = np.linspace(-_WIDEST, _WIDEST, _TRIED) * period
    rests = np.array([(residuals(float(tau)) ** 2).sum(axis=0) for tau in grid])
    # Each load weighs by what is left of it at its best; one that the motion does not make, by its noise.
    noise = np.maximum(rests.min(axis=0), 1e-12 * ((y - y.mean(axis=0)) ** 2).sum(axis=0) + 1e-300) / len(y)

    def left(tau: float) -> float:
        return float(((residuals(tau) ** 2).sum(axis=0) / noise).sum())

    k = int(np.argmin((rests / noise).sum(axis=1)))
    if k in (0, _TRIED - 1):
        return None
    best = minimize_scalar(left, bounds=(grid[k - 1], grid[k + 1]), method="bounded", options={"xatol": 1e-6 * period})
    tau, h = float(best.x), _STEP * period
    curvature = (left(tau - h) + left(tau + h) - 2.0 * left(tau)) / h**2
    rest = residuals(tau) / np.sqrt(noise)
    rho = min(max(float((rest[1:] * rest[:-1]).sum() / max((rest**2).sum(), 1e-300)), 0.0), 0.999)
    correlated = (1.0 + rho) / (1.0 - rho)
    error = math.sqrt(2.0 / curvature * correlated) if curvature > 0.0 else math.inf
    # Another lag that fits about as well: none is seen.
    others = (rests / noise).sum(axis=1)[np.abs(grid - tau) > 2.0 * _STEP * period] - left(tau)
    alone = bool((others > _SURE**2 * correlated).all())
    return Delay(f"the loads {' '.join(loads)}", tau, error) if alone and error < _SEEN * period else None


def _filled(t: Array, w: Array, columns: dict[str, Array]) -> tuple[Array, Array, dict[str, Array]]:
    """Even steps: a filter over samples with some left out shifts what is behind them."""
    apart = np.diff(t)
    usual = float(np.median(apart))
    if float(np.abs(apart - usual).max()) <= _UNEVENNESS * usual:
        return t, w, columns
    even = np.arange(t[0], t[-1], usual)
    return even, np.interp(even, t, w), {name: np.interp(even, t, column) for name, column in columns.items()}


def _smoothing(t: Array, width: float) -> Callable[[Array], Array]:
    """A low-pass filter, the same for motion and loads: their relation stays, and noise has small derivatives.

    Parameters
    ----------
    t : (n,) [s].
    width : Standard deviation of its bell [s].
    """
    # Few records need it, and it is slow to load.
    from scipy.ndimage import gaussian_filter1d

    samples = width / float(np.median(np.diff(t)))
    return lambda x: np.asarray(gaussian_filter1d(x, samples, mode="nearest"), dtype=float)


def _more_than_a_line(t: Array, displacement: Array, frequency: float) -> bool:
    """Whether what a motion is beside its line is slow, as a motion is, and no noise.

    With a line and noise any lag fits, and the best one is that whose load has least of the noise of the acceleration.
    """
    at = 2.0 * math.pi * frequency * np.outer(t, (1.0, 2.0, 3.0))
    x = np.column_stack([np.ones(t.size), np.sin(at), np.cos(at)])
    rest = displacement - x @ np.linalg.lstsq(x, displacement, rcond=None)[0]
    if not float(rest.var()) > 0.0:
        return False
    width = _SLOW / frequency
    share = float(_smoothing(t, width)(rest).var() / rest.var())
    # What the filter leaves of white noise.
    white = float(np.median(np.diff(t))) / (2.0 * math.sqrt(math.pi) * width)
    return share > max(_SHARE, 1.5 * white)


def _even(apart: Array, longest: float) -> bool:
    """Whether steps are short, and no spline is laid through samples close together here and far apart there."""
    usual = float(np.median(apart))
    return usual <= longest and float(apart.max()) < _UNEVEN * usual < _UNEVEN**2 * float(apart.min())


def _residual(moved: CubicSpline, at: Array, root: Array, y: Array) -> Array:
    """What velocity, acceleration and velocity times its size at other times leave of a load."""
    v, a = moved(at, 1), moved(at, 2)
    x = np.column_stack([np.ones(at.size), v, a, v * np.abs(v)]) * root[:, None]
    x /= np.maximum(np.sqrt((x**2).mean(axis=0)), 1e-300)
    return np.asarray(y - x @ np.linalg.lstsq(x, y, rcond=1e-10)[0], dtype=float)


def of_rate(name: str, motion: str, harmonics: Array, covariance: Array, frequency: float) -> Delay | None:
    """The lag of a measured rate or acceleration behind the displacement, whose phase it should have.

    Parameters
    ----------
    name : Channel, of ``MOTIONS[motion]``.
    motion : What oscillates.
    harmonics : (7,) of the channel, in the phase of the displacement, stated delays taken off.
    covariance : Theirs (7, 7).
    frequency : [Hz].
    """
    s, c = harmonics[1:3]
    size = math.hypot(s, c)
    error = math.sqrt(max(0.5 * float(covariance[1, 1] + covariance[2, 2]), 0.0))
    if size <= 10.0 * error or name not in MOTIONS[motion]:
        return None
    # Displacement sin: the rate is a cosine, the acceleration a negative sine.
    expected = 0.5 * math.pi if name == MOTIONS[motion][0] else math.pi
    behind = math.remainder(expected - math.atan2(c, s), 2.0 * math.pi)
    omega = 2.0 * math.pi * frequency
    return Delay(name, behind / omega, error / size / omega)


def _means(x: Array, step: int, n: int) -> Array:
    return np.asarray(x[: n * step].reshape(n, step).mean(axis=1), dtype=float)
