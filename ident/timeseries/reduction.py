"""Condensed time histories to values with standard errors.

* **Start-up transient**: MSER (White 1997) on the residuals of the fit. The cut d minimises
  SSE(d) / (n - d)^2 over the first half; for a mean this is the rule as published. The cut
  is made only where what it takes off departs from the rest (Geweke 1992): by more than
  three standard errors in the mean, or twice the scatter. Else it would cost data for noise.
* **Standard error**: the residuals' autocovariance is that of an autoregression fitted by
  Burg's method, its order by the criterion of Hannan and Quinn; with it, cov(b) = (X'X)^-1 X' G X (X'X)^-1. For a mean
  this is the spectrum at zero over n (Heidelberger and Welch 1981; ``spectrum0.ar``). It is done on
  block means, which keep the spectrum at zero: a short autoregression of 1000 samples a second sees a
  vibration and not the slow drift below it, and the error came out three times too small or too large.
  Of two block lengths the larger error counts.
* **Verdict**: enough effectively independent samples, no trend left, cut inside the half.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.blocks import Condensed
from ident.timeseries.regression import least_squares

Array = NDArray[np.float64]

TRANSIENT = "MSER"
ERROR = "autoregressive (Burg, Hannan-Quinn)"

_FEWEST = 8
# Cuts tried, the share of the record that may be cut, and the longest autoregression.
_CUTS = 200
_SHARE = 0.5
_ORDER = 30
# Fewest block means an autoregression is fitted to, and the share of a regressor's square that
# may be lost within the blocks.
_BLOCKS = 256
_BLURRED = 0.1
# What a start-up transient departs from the rest by: standard errors, ratio of scatter.
_DEPARTS = 3.0
_WILDER = 2.0
# Verdict: effective samples below which a standard error is not to be trusted, and the
# trend over the window, in standard errors of the mean and as a share of the scatter.
_EFFECTIVE = 20.0
_TREND = 3.0
# Block means of a constant differ by so much of it.
_ROUNDING = 1e-11
# A channel whose whole range is below this share of the largest force or moment has settled.
_SETTLED = 1e-3


@dataclass(frozen=True)
class Fitted:
    """Least squares of every channel on the regressors after the start-up transient.

    Attributes
    ----------
    values : (p, channels) coefficients.
    covariance : (channels, p, p).
    start, end : Window used [s].
    cut : Whether a start-up transient was cut off.
    effective : (channels,) effectively independent samples of the residuals.
    converged : True when every channel with scatter has enough of them and no trend is left.
    verdict : The same in words.
    time, channels, model : Block means over the whole record and the fit, for the plot.
    """

    values: Array
    covariance: Array
    start: float
    end: float
    cut: bool
    effective: Array
    converged: bool
    verdict: str
    time: Array
    channels: Array
    model: Array


def mser(x: Array, y: Array, weight: Array) -> int:
    """Blocks to cut off at the start: the largest over the channels of the MSER rule.

    Parameters
    ----------
    x : (n, p) regressors.
    y : (n, channels), without their means.
    weight : (n,) weights of the blocks.

    Returns
    -------
    Number of blocks before the window, at most half of them.
    """
    n, p = x.shape
    last = min(int(_SHARE * n), n - 2 * p - 2)
    if last <= 0:
        return 0
    cuts = np.unique(np.linspace(0, last, min(_CUTS, last + 1)).astype(int))
    w = weight / weight.mean()
    products = np.einsum("ni,nj,n->nij", x, x, w)
    cross = np.einsum("ni,nc,n->nic", x, y, w)
    squares = w[:, None] * y**2
    # Sums from each cut to the end.
    edges = list(cuts)
    xx = np.cumsum(np.add.reduceat(products, edges, axis=0)[::-1], axis=0)[::-1]
    xy = np.cumsum(np.add.reduceat(cross, edges, axis=0)[::-1], axis=0)[::-1]
    yy = np.cumsum(np.add.reduceat(squares, edges, axis=0)[::-1], axis=0)[::-1]
    fit = np.linalg.pinv(xx, hermitian=True) @ xy
    sse = np.maximum(yy - np.einsum("kic,kic->kc", fit, xy), 0.0)
    # Residuals at the level of rounding are no residuals.
    sse = np.where(sse < 1e-20 * yy[0] + 1e-300, 0.0, sse)
    score = sse / (n - cuts[:, None]) ** 2
    best = np.argmin(score, axis=0)
    real = [int(cuts[k]) for c, k in enumerate(best) if k and _departs(x, y[:, c], w, int(cuts[k]), fit[k, :, c])]
    return max(real, default=0)


def _departs(x: Array, y: Array, w: Array, cut: int, fit: Array) -> bool:
    """Whether the blocks before a cut differ from those after it by more than noise."""
    residual = y - x @ fit
    before, after = residual[:cut], residual[cut:]
    scatter = float((w[cut:] * after**2).sum()) / max(after.size - x.shape[1], 1)
    if float((before**2).mean()) > _WILDER**2 * (1.0 + _WILDER**2 / cut) * scatter:
        return True
    gamma = autocovariance(*burg(after - after.mean()), cut)
    if gamma[0] <= 0.0:
        return bool(np.any(before != 0.0))
    gamma *= scatter / gamma[0]
    lags = np.arange(1, cut)
    spectrum = gamma[0] + 2.0 * float(((1.0 - lags / cut) * gamma[1:cut]).sum())
    return abs(float(before.mean())) > _DEPARTS * math.sqrt(max(spectrum, 0.0) / cut)


def burg(residual: Array, most: int = _ORDER) -> tuple[Array, float]:
    """Autoregression of a series by Burg's method, order by the criterion of Hannan and Quinn.

    Parameters
    ----------
    residual : (n,) series of mean about zero.
    most : Largest order.

    Returns
    -------
    coefficients : (k,), e_t = sum_i a_i e_(t-i) + noise.
    variance : of the noise.
    """
    n = residual.size
    forward, backward = residual[1:].copy(), residual[:-1].copy()
    a = np.zeros(0)
    variance = float(residual @ residual) / n
    best = (math.inf, a, variance)
    for k in range(min(most, n // 4) + 1):
        if k:
            below = float(forward @ forward + backward @ backward)
            if below <= 0.0:
                break
            reflection = 2.0 * float(forward @ backward) / below
            a = np.append(a - reflection * a[::-1], reflection) if a.size else np.array([reflection])
            variance *= 1.0 - reflection**2
            if variance <= 0.0:
                break
            forward, backward = (forward - reflection * backward)[1:], (backward - reflection * forward)[:-1]
        score = n * math.log(variance) + 2.0 * k * math.log(math.log(n)) if variance > 0.0 else math.inf
        if score < best[0] - 1e-9:
            best = (score, a, variance)
    return best[1], best[2]


def autocovariance(a: Array, variance: float, lags: int) -> Array:
    """Autocovariances at lags 0 to ``lags`` of a stationary autoregression.

    Parameters
    ----------
    a : (k,) coefficients; ``variance`` of the noise.
    """
    k = a.size
    gamma = np.zeros(lags + 1)
    if k == 0:
        gamma[0] = variance
        return gamma
    # Yule-Walker for lags 0..k: gamma_j - sum_i a_i gamma_|j-i| = variance if j is 0.
    system = np.eye(k + 1)
    for j in range(k + 1):
        for i in range(1, k + 1):
            system[j, abs(j - i)] -= a[i - 1]
    start = np.linalg.solve(system, np.append(variance, np.zeros(k)))
    gamma[: min(k, lags) + 1] = start[: min(k, lags) + 1]
    if lags > k:
        from scipy.signal import lfilter, lfiltic

        state = lfiltic([1.0], np.append(1.0, -a), gamma[k::-1][:k] if k else [])
        gamma[k + 1 :], _ = lfilter([1.0], np.append(1.0, -a), np.zeros(lags - k), zi=state)
    return gamma


def _coarser(x: Array, residual: Array, weight: Array) -> tuple[Array, Array, Array] | None:
    """Pairs of neighbours averaged; None when too few would be left or the regressors vary within them."""
    n = len(weight) // 2
    if n < _BLOCKS:
        return None
    pairs = weight[: 2 * n].reshape(n, 2, 1)
    total = pairs.sum(axis=1)
    means = [(pairs * v[: 2 * n].reshape(n, 2, -1)).sum(axis=1) / total for v in (x, residual)]
    kept = (total * means[0] ** 2).sum(axis=0)
    if np.any(kept < (1.0 - _BLURRED) * (weight[:, None] * x**2).sum(axis=0)):
        return None
    return means[0], means[1][:, 0], total[:, 0]


def _covariance(x: Array, residual: Array, weight: Array) -> tuple[Array, float]:
    """Covariance of least-squares coefficients with autocorrelated errors; effective samples."""
    levels = [(x, residual, weight)]
    while (coarse := _coarser(*levels[-1])) is not None:
        levels = [levels[-1], coarse]
    at_levels = [_covariance_at(*level) for level in levels]
    covariance, of_mean = max(at_levels, key=lambda f: float(np.trace(x.T @ (weight[:, None] * x) @ f[0])))
    w = weight / weight.mean()
    scatter = float((w * residual**2).sum()) / (len(w) - x.shape[1])
    return covariance, scatter / of_mean if of_mean > 0.0 else float(len(w))


def _covariance_at(x: Array, residual: Array, weight: Array) -> tuple[Array, float]:
    """Covariance from the autoregression of these blocks, and the variance of the residuals' mean."""
    n, p = x.shape
    w = weight / weight.mean()
    scatter = float((w * residual**2).sum())
    if scatter <= 0.0:
        return np.zeros((p, p)), 0.0
    inverse = np.linalg.pinv(x.T @ (w[:, None] * x), hermitian=True)
    a, variance = burg(residual - residual.mean())
    gamma = autocovariance(a, variance, n - 1)
    # Degrees of freedom taken by the fit; the fit also takes out some of the correlation.
    gamma *= scatter / (n - p) / gamma[0]
    weighted = x * w[:, None]
    spread = weighted.T @ _toeplitz_times(gamma, weighted)
    spectrum = gamma[0] + 2.0 * float(((1.0 - np.arange(1, n) / n) * gamma[1:]).sum())
    return inverse @ spread @ inverse, max(spectrum, 0.0) / n


def _toeplitz_times(gamma: Array, x: Array) -> Array:
    """Symmetric Toeplitz matrix of ``gamma`` times ``x``, by the fast Fourier transform."""
    n = gamma.size
    ring = np.fft.rfft(np.concatenate([gamma, [0.0], gamma[:0:-1]]))
    padded = np.fft.rfft(x, 2 * n, axis=0)
    return np.fft.irfft(ring[:, None] * padded, 2 * n, axis=0)[:n]


def _trend(residual: Array, time: Array, effective: float) -> float:
    """Size of a linear trend left in the residuals, in standard errors of its slope."""
    centred = time - time.mean()
    slope = float(centred @ residual) / float(centred @ centred)
    left = residual - slope * centred
    spread = math.sqrt(float(left @ left) / max(residual.size - 2, 1) / float(centred @ centred))
    inflated = spread * math.sqrt(residual.size / max(min(effective, residual.size), 1.0))
    return abs(slope) / inflated if inflated > 0.0 else 0.0


def _verdict(residuals: Array, time: Array, effective: Array, loads: list[str], values: Array, late: bool) -> list[str]:
    """What speaks against convergence; channels that have settled are not asked."""
    groups = ("XYZ", "KMN")
    largest = {g: max((np.abs(values[:, c]).max() for c, q in enumerate(loads) if q in g), default=0.0) for g in groups}
    words = []
    unsettled = False
    for c, name in enumerate(loads):
        group = next((g for g in groups if name in g), "")
        size = largest[group] if group else np.abs(values[:, c]).max()
        if np.ptp(residuals[:, c]) <= _SETTLED * size:
            continue
        unsettled = True
        if effective[c] < _EFFECTIVE:
            words.append(f"{name}: {effective[c]:.0f} effective samples, {_EFFECTIVE:.0f} wanted")
        elif _trend(residuals[:, c], time, effective[c]) > _TREND:
            words.append(f"{name}: a trend is left")
    if late and unsettled:
        words.append("still in the start-up transient at half of the record")
    return words


def fit_history(condensed: Condensed, loads: list[str], transient: bool = True) -> Fitted:
    """Fit a condensed history.

    Parameters
    ----------
    condensed : All samples of a run.
    loads : Name of each channel, for the verdict; the transient is looked for in these.
    transient : Look for a start-up transient.

    Raises
    ------
    ValueError
        For too few samples to fit.
    """
    weight, time, x, y = condensed.blocks()
    n, p = x.shape
    if n < max(_FEWEST, 2 * p + 2):
        raise ValueError(f"{n} samples")
    centre = y.mean(axis=0)
    # A channel that varies by rounding alone is constant: its last bits must not decide a cut.
    moving = np.ptp(y, axis=0) > _ROUNDING * np.abs(y).max(axis=0)
    cut = mser(x, np.where(moving, y - centre, 0.0), weight) if transient else 0
    w, t, xs, ys = weight[cut:], time[cut:], x[cut:], y[cut:]
    values, _ = least_squares(xs, ys - centre, w / w.mean())
    residuals = ys - centre - xs @ values
    # Scatter at the level of rounding is none.
    residuals[:, np.abs(residuals).max(axis=0) <= 1e-13 * np.abs(ys).max(axis=0)] = 0.0
    errors = [_covariance(xs, residuals[:, c], w) for c in range(y.shape[1])]
    effective = np.array([e for _, e in errors])
    words = _verdict(residuals, t, effective, loads, ys, cut >= int(_SHARE * n) - max(1, n // _CUTS) > 0)
    # The constant is the first regressor of every fit, averaged to one.
    values[0] += centre
    return Fitted(
        values,
        np.array([c for c, _ in errors]),
        float(t[0]),
        float(t[-1]),
        cut > 0,
        effective,
        not words,
        "; ".join(words) or "converged",
        time,
        y,
        x @ values,
    )
