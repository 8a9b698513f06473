"""A boat in regular waves: harmonics of its motions at the frequency at which it meets them.

A channel is fitted by mean, drift and harmonics of the encountered wave,

    y(t) = mean + drift(t) + sum_k A_k cos(k Theta(t) + phi_k),   k = 1, 2, 3,

with the least squares, start-up cut and standard errors of the oscillatory captive tests
(``ident.timeseries.reduction``). Theta rises at the frequency of encounter |omega - k U cos mu| and is
zero where the wave has its crest over the mean place of the body origin, so that phi_k > 0
leads the wave. Drift is a low-order polynomial fitted with the harmonics: slow changes of
depth do not leak into them. Regular waves of deep water: omega^2 = g k.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.timeseries import blocks as condense
from ident.timeseries.reduction import Fitted, fit_history
from ident.timeseries.regression import least_squares
from sim.files.errors import InputError
from sim.flight.simulation import CHANNELS, DERIVED, Simulation
from sim.waves.linear import Waves

Array = NDArray[np.float64]

_HARMONICS = 3
# Fewer periods than this do not tell harmonics from drift.
_FEWEST_PERIODS = 3.0
# Samples by which the frequency is refined; more tell nothing new.
_REFINED_BY = 1000
_STEPS = 30
# Blocks a period, at most (half as many at least): coarse enough that what is left of a motion
# that is nearly periodic is no autoregression on the edge of stability.
_BLOCKS = 32.0
# A phase that is not known is uniform on the circle.
_ANY_PHASE = math.pi / math.sqrt(3.0)


@dataclass(frozen=True)
class Encounter:
    """How a boat meets a regular wave.

    Attributes
    ----------
    amplitude, number : Of the wave, a [m] and k [1/m].
    speed : Mean over ground, horizontal [m/s].
    angle : mu between the course and the direction the waves travel to [rad]; pi is head
        seas, 0 following seas.
    computed : |omega - k U cos mu| [rad/s].
    frequency : The same refined from the record [rad/s]; ``computed`` where the record has
        no oscillation there.
    phase : Theta at t = 0 [rad]: Theta(t) = frequency t + phase.
    """

    amplitude: float
    number: float
    speed: float
    angle: float
    computed: float
    frequency: float
    phase: float


@dataclass(frozen=True)
class Harmonics:
    """Harmonics of one channel, in its unit.

    Attributes
    ----------
    channel, unit : Of the simulation.
    mean, mean_stderr : Harmonic 0 over the window, drift included.
    amplitude, amplitude_stderr : (3,) of harmonics 1-3.
    phase, phase_stderr : (3,) phi_k, lead over the wave's elevation at the origin [rad].
    drift : Change of the fitted drift from start to end of the window.
    start, end : Window used [s].
    cut : Whether a start-up transient was cut off.
    verdict : ``converged``, or what speaks against it.
    encounter : The wave as met.
    """

    channel: str
    unit: str
    mean: float
    mean_stderr: float
    amplitude: Array
    amplitude_stderr: Array
    phase: Array
    phase_stderr: Array
    drift: float
    start: float
    end: float
    cut: bool
    verdict: str
    encounter: Encounter

    @property
    def periods(self) -> float:
        """Encountered periods in the window."""
        return (self.end - self.start) * self.encounter.frequency / (2.0 * math.pi)

    @property
    def transfer(self) -> tuple[float, float]:
        """First harmonic over that of the wave, with its standard error.

        A_1 / a for lengths, A_1 / (k a) for angles [-]; for other channels A_1 / a in the
        channel's unit a metre.
        """
        wave = self.encounter.amplitude * (self.encounter.number if self.unit == "rad" else 1.0)
        return float(self.amplitude[0]) / wave, float(self.amplitude_stderr[0]) / wave

    def as_json(self) -> dict[str, Any]:
        """Plain numbers and lists, all finite."""
        plain = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in asdict(self).items()}
        value, error = self.transfer
        return plain | {"periods": self.periods, "transfer": value, "transfer_stderr": error}


def as_published(harmonics: Mapping[str, Harmonics]) -> dict[str, tuple[float, float]]:
    """``dz1_over_aw`` [-] and ``theta1`` [deg] with standard errors, of depth (D0 or z) and pitch."""
    published: dict[str, tuple[float, float]] = {}
    depth = harmonics.get("D0", harmonics.get("z"))
    if depth is not None:
        published["dz1_over_aw"] = depth.transfer
    if "theta" in harmonics:
        pitch = harmonics["theta"]
        published["theta1"] = math.degrees(pitch.amplitude[0]), math.degrees(pitch.amplitude_stderr[0])
    return published


def channel_unit(channel: str) -> str:
    """Unit of a channel of a simulation; planes and commands are in radians."""
    return CHANNELS.get(channel, "rad")


def check_channels(simulation: Simulation, channels: Sequence[str], where: str) -> None:
    """Refuse channels that a flight does not have over time.

    Raises
    ------
    InputError
        Naming ``where``, the channel, and those there are.
    """
    known = [c for c in (*simulation.columns, *DERIVED) if c not in ("t", "s")]
    for name in channels:
        if name not in known:
            raise InputError(where, f"channel {name!r}", ", ".join(known))


def encounter_of(waves: Waves, time: Array, north: Array, east: Array) -> Encounter:
    """The wave as a boat meets it on its mean path, not yet refined.

    Parameters
    ----------
    waves : One component.
    time : (n,) [s].
    north, east : (n,) track of the body origin over ground [m]; a current that carries the waves is taken off.

    Raises
    ------
    InputError
        For calm water or more than one component.
    """
    if waves.amplitude.size != 1:
        text = "one regular wave; for irregular seas ident.metrics.seaway"
        raise InputError("harmonics in waves", f"{waves.amplitude.size} wave components", text)
    # A line through the whole track: oscillation and noise of single samples average out.
    north, east = north - waves.flow_north * time, east - waves.flow_east * time
    line = np.polynomial.polynomial.polyfit(time - time.mean(), np.column_stack([north, east]), 1)
    k, omega = float(waves.number[0]), float(waves.frequency[0])
    along = line @ np.array([float(waves.north[0]), float(waves.east[0])])
    rate = omega - k * float(along[1])
    # Elevation is a cos(k s - omega t + epsilon), even in its argument: let Theta rise.
    sense = 1.0 if rate >= 0.0 else -1.0
    middle = sense * (omega * float(time.mean()) - k * float(along[0]) - float(waves.phase[0]))
    speed = float(np.hypot(*line[1]))
    cosine = float(along[1]) / speed if speed > 0.0 else -1.0
    return Encounter(
        amplitude=abs(float(waves.amplitude[0])),
        number=k,
        speed=speed,
        angle=math.acos(max(-1.0, min(1.0, cosine))),
        computed=abs(rate),
        frequency=abs(rate),
        phase=middle - abs(rate) * float(time.mean()) + (math.pi if waves.amplitude[0] < 0.0 else 0.0),
    )


def drift_columns(first: float, last: float, order: int) -> condense.Regressors:
    """Regressors P_1 ... P_order (Legendre) of time brought to -1 ... 1 over a window."""
    middle, half = 0.5 * (first + last), 0.5 * (last - first)

    def regressors(time: Array) -> Array:
        return np.asarray(np.polynomial.legendre.legvander((time - middle) / half, order)[:, 1:], dtype=float)

    return regressors


def _regressors(encounter: Encounter, first: float, last: float, order: int) -> condense.Regressors:
    """One, three harmonics of the encountered wave, drift."""
    waves = condense.harmonics(encounter.frequency / (2.0 * math.pi), encounter.phase)
    drift = drift_columns(first, last, order)
    return lambda time: np.column_stack([waves(time), drift(time)])


def _at(encounter: Encounter, frequency: float, middle: float) -> Encounter:
    """The same wave met at another frequency, its phase at time ``middle`` kept."""
    values = asdict(encounter)
    values["phase"] += (encounter.frequency - frequency) * middle
    return Encounter(**(values | {"frequency": frequency}))


def refined(encounter: Encounter, time: Array, values: Array, order: int = 1) -> Encounter:
    """Frequency of encounter from the record itself, by least squares of all channels.

    Gauss-Newton steps on the frequency that all channels share, each channel weighed by its
    scatter. An optimum further from the computed frequency than half a spectral line (pi over
    the record's length) is no oscillation of this wave and is not taken.

    Parameters
    ----------
    encounter : From ``encounter_of`` on the same window.
    time : (n,) [s].
    values : (n, channels).
    order : Of the drift.
    """
    step = max(1, len(time) // _REFINED_BY)
    first, last, middle = float(time[0]), float(time[-1]), float(time.mean())
    t, y = time[::step], values[::step] - values.mean(axis=0)
    y = y / np.where(np.ptp(y, axis=0) > 0.0, y.std(axis=0), 1.0)
    half, better = math.pi / (last - first), encounter
    for _ in range(_STEPS):
        x = _regressors(better, first, last, order)(t)
        b = least_squares(x, y)[0]
        # dy/d(omega) = (t - middle) dy/d(Theta), of it what the linear coefficients leave.
        slope = np.zeros_like(y)
        for k in range(1, _HARMONICS + 1):
            slope += k * (np.outer(x[:, 2 * k], b[2 * k - 1]) - np.outer(x[:, 2 * k - 1], b[2 * k]))
        slope *= (t - middle)[:, None]
        slope -= x @ least_squares(x, slope)[0]
        size = float((slope**2).sum())
        if size <= 0.0:
            return encounter
        change = float((slope * (y - x @ b)).sum()) / size
        better = _at(better, better.frequency + change, middle)
        if not abs(better.frequency - encounter.frequency) < half:
            return encounter
        if abs(change) < 1e-6 * half:
            return better
    return encounter


def _fit(encounter: Encounter, time: Array, values: Array, names: list[str], order: int, cut: bool) -> Fitted:
    regressors = _regressors(encounter, float(time[0]), float(time[-1]), order)
    periods = (time[-1] - time[0]) * encounter.frequency / (2.0 * math.pi)
    condensed = condense.Condensed(regressors, values.shape[1], most=math.ceil(_BLOCKS * periods))
    condensed.add(time, values)
    try:
        return fit_history(condensed, names, transient=cut)
    except (ValueError, np.linalg.LinAlgError) as error:
        text = "a record long and fine enough for three harmonics and drift"
        raise InputError(f"harmonics of {', '.join(names)}", f"{error} in {len(time)} samples", text) from error


def _enough(encounter: Encounter, time: Array) -> None:
    periods = (time[-1] - time[0]) * encounter.frequency / (2.0 * math.pi)
    if not periods >= _FEWEST_PERIODS:
        wrong = f"{periods:.2g} periods of {encounter.frequency:.3g} rad/s from {time[0]:.4g} to {time[-1]:.4g} s"
        raise InputError("harmonics in waves", wrong, f"{_FEWEST_PERIODS:g} or more")
    samples = 2.0 * math.pi / encounter.frequency / float(np.diff(time).max())
    if samples < 2.0 * _HARMONICS + 2.0:
        wrong = f"{samples:.2g} samples an encountered period"
        raise InputError("harmonics in waves", wrong, f"{2 * _HARMONICS + 2} or more; a shorter record_s")


def _one(name: str, unit: str, c: int, fit: Fitted, encounter: Encounter, order: int) -> Harmonics:
    """Values of one channel as amplitudes and phases, errors by the delta method."""
    b, covariance = fit.values[:, c], fit.covariance[c]
    ends = drift_columns(fit.start, fit.end, order)(np.array([fit.start, fit.end]))
    # A residual that is nearly one line leaves an autoregression on the edge of stability, whose
    # variances come out at nothing: no error is smaller than that of uncorrelated residuals.
    least = float(np.square(fit.channels[:, c] - fit.model[:, c]).mean()) / len(fit.time)
    amplitude, phase, errors = np.zeros(_HARMONICS), np.zeros(_HARMONICS), np.zeros((2, _HARMONICS))
    for k in range(_HARMONICS):
        s, cosine = b[2 * k + 1 : 2 * k + 3]
        block = covariance[2 * k + 1 : 2 * k + 3, 2 * k + 1 : 2 * k + 3]
        size = math.hypot(s, cosine)
        amplitude[k], phase[k] = size, math.atan2(-s, cosine)
        if size > 0.0:
            along, across = np.array([s, cosine]) / size, np.array([-cosine, s]) / size
            errors[0, k] = math.sqrt(max(float(along @ block @ along), 2.0 * least))
            errors[1, k] = min(math.sqrt(max(float(across @ block @ across), 2.0 * least)) / size, _ANY_PHASE)
        else:
            errors[:, k] = math.sqrt(max(float(np.trace(block)) / 2.0, 2.0 * least)), _ANY_PHASE
    # The drift's mean over the window is zero, so that harmonic 0 is the mean of the rest.
    return Harmonics(
        channel=name,
        unit=unit,
        mean=float(b[0]),
        mean_stderr=math.sqrt(max(float(covariance[0, 0]), least)),
        amplitude=amplitude,
        amplitude_stderr=errors[0],
        phase=phase,
        phase_stderr=errors[1],
        drift=float((ends[1] - ends[0]) @ b[2 * _HARMONICS + 1 :]),
        start=fit.start,
        end=fit.end,
        cut=fit.cut,
        verdict=fit.verdict,
        encounter=encounter,
    )


def harmonics(
    simulation: Simulation,
    waves: Waves | None = None,
    channels: Sequence[str] = ("D0", "theta"),
    start: float = 0.0,
    drift: int = 3,
) -> dict[str, Harmonics]:
    """Harmonics 0-3 of channels of a flight in a regular wave.

    Parameters
    ----------
    simulation : The flight.
    waves : The one regular wave it flew in; that of the simulation when None.
    channels : Columns of the simulation.
    start : Time before which nothing is used [s]; of what is left, a start-up transient is
        cut off by the rule of ``ident.timeseries.reduction``.
    drift : Order of the polynomial that takes up slow drift; 0 is none. Drift that is left is in
        the residuals and widens the standard errors.

    Raises
    ------
    InputError
        For a channel that is not there, water that is not one regular wave, or a record of
        too few periods or samples.
    """
    waves = waves if waves is not None else simulation.waves
    if waves is None:
        raise InputError("harmonics in waves", "a flight in calm water", "one in a regular wave")
    check_channels(simulation, channels, "harmonics in waves")
    use = simulation["t"] >= start
    if use.sum() < 2:
        end = f"the record ends at {simulation['t'][-1]:.4g} s"
        raise InputError("harmonics in waves, start", f"{start:g} s", end)
    time = simulation["t"][use]
    values = np.column_stack([simulation[name][use] for name in channels])
    units = [channel_unit(name) for name in channels]
    return harmonics_of(time, values, dict(zip(channels, units, strict=True)), waves, _track(simulation, use), drift)


def _track(simulation: Simulation, use: NDArray[np.bool_]) -> Array:
    return np.column_stack([simulation["x"][use], simulation["y"][use]])


def harmonics_of(
    time: Array, values: Array, channels: Mapping[str, str], waves: Waves, track: Array, drift: int = 3
) -> dict[str, Harmonics]:
    """As ``harmonics``, on arrays.

    Parameters
    ----------
    time : (n,) rising [s].
    values : (n, channels).
    channels : Name -> unit, in the order of the columns.
    waves : One component.
    track : (n, 2) north and east of the body origin [m].
    drift : Order of the drift.

    Raises
    ------
    InputError
        As ``harmonics``.
    """
    names = list(channels)
    encounter = encounter_of(waves, time, *track.T)
    _enough(encounter, time)
    # A start-up would turn the frequency; it may take the first half and no more.
    half = time >= 0.5 * (time[0] + time[-1])
    early = _fit(refined(encounter, time[half], values[half], drift), time, values, names, drift, cut=True)
    left = (time[-1] - early.start) * encounter.frequency / (2.0 * math.pi)
    # A record too short to be cut is used whole; its verdict says so.
    cut = early.cut and left >= _FEWEST_PERIODS
    use = time >= early.start if cut else np.ones(time.size, dtype=bool)
    time, values, track = time[use], values[use], track[use]
    encounter = refined(encounter_of(waves, time, *track.T), time, values, drift)
    fit = _fit(encounter, time, values, names, drift, cut=False)
    fit = replace(fit, start=float(time[0]), end=float(time[-1]), cut=cut, verdict=early.verdict)
    return {name: _one(name, unit, c, fit, encounter, drift) for c, (name, unit) in enumerate(channels.items())}
