"""A boat in irregular seas: statistics of a channel of its motion.

Slow drift is taken off by a low-order polynomial and a start-up transient cut off
(``ident.timeseries.reduction``). On what is left: significant values two ways, zero-crossing period,
Welch spectrum and moments. m0 and its standard error are the mean of the squared deviations and the standard
error of that mean, with the autocorrelation of the squares: no shape of spectrum is assumed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.metrics.seakeeping import channel_unit, check_channels, drift_columns
from ident.timeseries import blocks as condense
from ident.timeseries import reduction
from sim.files.errors import InputError
from sim.flight.simulation import Simulation
from sim.waves.linear import Waves, kinematics

Array = NDArray[np.float64]

_FEWEST_CROSSINGS = 10
# Errors of means are found from block means of about a zero-crossing period (between half and
# one): what oscillates faster averages out, and the slow rest is what such errors come from.
# Finer blocks of a narrow-band motion leave an autoregression on the edge of stability.
_BLOCKS = 1.0
_FEWEST_BLOCKS = 16
# Segments a record is cut into for its spectrum, before they overlap by half.
_SEGMENTS = 16


@dataclass(frozen=True)
class Density:
    """A one-sided spectrum by Welch's method (Hann window, half overlap).

    Attributes
    ----------
    frequency : (n,) omega, of encounter where the boat moves [rad/s].
    density : (n,) S(omega), unit^2 s.
    resolution : Equivalent noise bandwidth of the window [rad/s].
    segments : Averaged, half overlapping.
    """

    frequency: Array
    density: Array
    resolution: float
    segments: int

    def moments(self, orders: Sequence[int] = (0, 1, 2, 4)) -> Array:
        """m_n = int omega^n S d(omega)."""
        step = float(self.frequency[1] - self.frequency[0])
        return np.array([float((self.frequency**n * self.density).sum()) * step for n in orders])


@dataclass(frozen=True)
class Statistics:
    """Statistics of one channel in an irregular sea, in its unit.

    Attributes
    ----------
    channel, unit : Of the simulation.
    start, end : Window used [s]; cut : whether a start-up transient was cut off.
    mean, mean_stderr : Over the window; drift : change of the fitted drift over it.
    sigma, sigma_stderr : Standard deviation about mean and drift.
    significant : 4 sigma, double amplitude.
    third_highest, waves : Mean of the highest third of zero-crossing heights, and how many
        zero-crossing waves were counted.
    period : Mean zero up-crossing period counted [s].
    moments : m0, m1, m2, m4 of the spectrum, frequency in rad/s.
    effective : Effectively independent samples of the squares.
    spectrum : Of the deviations.
    time, deviation, trend : (n,) of the window; channel = trend + deviation.
    """

    channel: str
    unit: str
    start: float
    end: float
    cut: bool
    mean: float
    mean_stderr: float
    drift: float
    sigma: float
    sigma_stderr: float
    significant: float
    third_highest: float
    waves: int
    period: float
    moments: Array
    effective: float
    spectrum: Density
    time: Array
    deviation: Array
    trend: Array

    @property
    def rice_period(self) -> float:
        """Mean zero-crossing period 2 pi sigma / sqrt(m2) of a Gaussian process [s]."""
        return 2.0 * math.pi * self.sigma / math.sqrt(float(self.moments[2]))

    @property
    def resolved(self) -> float:
        """m0 of the spectrum over sigma^2: well below one, the boat moves more slowly than its
        segments show, and a finer resolution is wanted."""
        return float(self.moments[0]) / self.sigma**2

    @property
    def bandwidth(self) -> float:
        """Spectral width nu = sqrt(m0 m2/m1^2 - 1) (Longuet-Higgins 1975); 0 is narrow."""
        m0, m1, m2 = self.moments[:3]
        return math.sqrt(max(float(m0 * m2 / m1**2) - 1.0, 0.0))

    def as_json(self) -> dict[str, Any]:
        """Plain numbers, without the series."""
        names = ["channel", "unit", "start", "end", "cut", "mean", "mean_stderr", "drift", "sigma", "sigma_stderr"]
        names += [
            "significant",
            "third_highest",
            "waves",
            "period",
            "effective",
            "rice_period",
            "bandwidth",
            "resolved",
        ]
        moments = dict(zip(("m0", "m1", "m2", "m4"), self.moments.tolist(), strict=True))
        return (
            {n: getattr(self, n) for n in names}
            | {"moments": moments}
            | {"spectral_resolution_radps": self.spectrum.resolution, "segments": self.spectrum.segments}
        )


def uniform_step(time: Array) -> float:
    """The step of a record [s].

    Raises
    ------
    InputError
        When the steps are not equal, which a spectrum needs.
    """
    step = np.diff(time)
    if step.size < 2 or np.ptp(step) > 1e-6 * step.mean() + 1e-9:
        raise InputError("record in waves, column t", "steps that are not equal, or no record", "equal steps")
    return float(step.mean())


def spectrum(values: Array, step: float, resolution: float | None = None) -> Density:
    """One-sided spectrum of a series.

    Parameters
    ----------
    values : (n,) equally spaced.
    step : [s].
    resolution : Wanted noise bandwidth [rad/s]; by default sixteen segments' worth.

    Raises
    ------
    InputError
        For a resolution that the record is too short for.
    """
    from scipy.signal import welch

    n = len(values)
    # The Hann window is 1.5 spectral lines wide.
    length = n // _SEGMENTS if resolution is None else math.ceil(1.5 * 2.0 * math.pi / (resolution * step))
    if not 8 <= length <= n:
        finest = 1.5 * 2.0 * math.pi / (n * step)
        raise InputError("spectrum, resolution", f"{resolution or finest:.3g} rad/s of {n} samples", f"{finest:.3g} up")
    hertz, density = welch(values, fs=1.0 / step, window="hann", nperseg=length, detrend="constant")
    segments = 1 + (n - length) // (length - length // 2)
    width = 1.5 * 2.0 * math.pi / (length * step)
    return Density(2.0 * math.pi * hertz, density / (2.0 * math.pi), width, segments)


def upcrossings(values: Array) -> NDArray[np.int64]:
    """Samples before which a series has risen through zero."""
    return np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0)) + 1


def zero_crossing(time: Array, values: Array) -> tuple[float, Array]:
    """Mean zero up-crossing period [s] and the heights between up-crossings, in their order.

    Crossings are interpolated linearly; heights are those of the samples.
    """
    at = upcrossings(values)
    if at.size < 2:
        return math.nan, np.zeros(0)
    share = values[at] / (values[at] - values[at - 1])
    moment = time[at] - share * (time[at] - time[at - 1])
    inside = values[: at[-1]]
    high, low = np.maximum.reduceat(inside, at[:-1]), np.minimum.reduceat(inside, at[:-1])
    return float(moment[-1] - moment[0]) / (at.size - 1), high - low


def _fit(time: Array, values: Array, regressors: condense.Regressors, blocks: float, cut: bool) -> reduction.Fitted:
    condensed = condense.Condensed(regressors, 1, most=max(int(blocks), _FEWEST_BLOCKS))
    condensed.add(time, values[:, None])
    try:
        return reduction.fit_history(condensed, ["X"], transient=cut)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise InputError("statistics in waves", f"{error} in {len(time)} samples", "a longer record") from error


def _with_one(columns: condense.Regressors) -> condense.Regressors:
    return lambda time: np.column_stack([np.ones(time.size), columns(time)])


def _crossings(time: Array, values: Array, drift: int, channel: str) -> int:
    """Zero crossings of a series without its drift. Raises ``InputError`` for fewer than ten."""
    rough = values - np.polynomial.Polynomial.fit(time, values, max(drift, 0))(time)
    crossings = upcrossings(rough).size
    if crossings < _FEWEST_CROSSINGS:
        raise InputError(f"statistics of {channel}", f"{crossings} zero crossings", f"{_FEWEST_CROSSINGS} or more")
    return crossings


def _after_the_start(
    time: Array, values: Array, drift: int, blocks: float, step: float
) -> tuple[NDArray[np.bool_], bool]:
    """Samples after the start-up, and whether there is one."""
    whole = _fit(time, values, _with_one(drift_columns(float(time[0]), float(time[-1]), drift)), blocks, cut=True)
    return (time >= whole.start - 0.5 * step if whole.cut else np.ones(time.size, dtype=bool)), whole.cut


def statistics_of(
    time: Array,
    values: Array,
    channel: str = "X",
    unit: str = "-",
    drift: int = 1,
    resolution: float | None = None,
) -> Statistics:
    """Statistics of a series in an irregular sea.

    Parameters
    ----------
    time, values : (n,) equally spaced [s], and (n,).
    channel, unit : Names for the result.
    drift : Order of the polynomial taken off as slow drift; 0 takes off the mean alone.
    resolution : As in ``spectrum``.

    Raises
    ------
    InputError
        For unequal steps, values that are not finite, a channel at rest, or fewer than ten zero crossings.
    """
    step = uniform_step(time)
    if not np.isfinite(values).all():
        raise InputError(f"statistics of {channel}", "values that are not finite", "finite numbers")
    blocks = _BLOCKS * _crossings(time, values, drift, channel)
    use, cut = _after_the_start(time, values, drift, blocks, step)
    t, y = time[use], values[use]
    regressors = _with_one(drift_columns(float(t[0]), float(t[-1]), drift))
    fit = _fit(t, y, regressors, blocks, cut=False)
    trend = regressors(t) @ fit.values[:, 0]
    deviation = y - trend
    squares = _fit(t, deviation**2, condense.constant, blocks, cut=False)
    sigma = math.sqrt(float(squares.values[0, 0]))
    period, heights = zero_crossing(t, deviation)
    if heights.size < _FEWEST_CROSSINGS:
        raise InputError(f"statistics of {channel}", f"{heights.size} waves after the start-up", "a longer record")
    density = spectrum(deviation, step, resolution)
    return Statistics(
        channel=channel,
        unit=unit,
        start=float(t[0]),
        end=float(t[-1]),
        cut=cut,
        mean=float(fit.values[0, 0]),
        mean_stderr=math.sqrt(max(float(fit.covariance[0, 0, 0]), 0.0)),
        drift=float(trend[-1] - trend[0]),
        sigma=sigma,
        sigma_stderr=math.sqrt(max(float(squares.covariance[0, 0, 0]), 0.0)) / (2.0 * sigma),
        significant=4.0 * sigma,
        third_highest=float(np.sort(heights)[-max(1, heights.size // 3) :].mean()),
        waves=int(heights.size),
        period=period,
        moments=density.moments(),
        effective=float(squares.effective[0]),
        spectrum=density,
        time=t,
        deviation=deviation,
        trend=trend,
    )


def statistics(
    simulation: Simulation,
    channels: Sequence[str] = ("D0", "theta", "phi"),
    start: float = 0.0,
    drift: int = 1,
    resolution: float | None = None,
) -> dict[str, Statistics]:
    """Statistics of channels of a flight in an irregular sea.

    Parameters
    ----------
    simulation : The flight.
    channels : Columns of the simulation.
    start : Time before which nothing is used [s].
    drift, resolution : As in ``statistics_of``.

    Raises
    ------
    InputError
        As ``statistics_of``; for a channel that is not there.
    """
    check_channels(simulation, channels, "statistics in waves")
    use = simulation["t"] >= start
    time = simulation["t"][use]
    return {
        name: statistics_of(time, simulation[name][use], name, channel_unit(name), drift, resolution)
        for name in channels
    }


def encountered(waves: Waves, simulation: Simulation, step: float = 0.0, start: float = 0.0) -> tuple[Array, Array]:
    """The sea surface over the body origin along a flight, for its spectrum beside the boat's.

    Parameters
    ----------
    waves : The sea.
    simulation : The flight; its spectrum is over the frequency of encounter.
    step : Time between samples wanted [s]; at least that of the record.
    start : Time before which nothing is used [s].

    Returns
    -------
    time [s], elevation [m, up].
    """
    every = max(1, round(step / uniform_step(simulation["t"])))
    use = np.flatnonzero(simulation["t"] >= start)[::every]
    time = simulation["t"][use]
    points = np.column_stack([simulation["x"][use], simulation["y"][use], np.zeros(use.size)])
    return time, kinematics(waves, points, time).elevation
