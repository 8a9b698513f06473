"""A time history to runs: window, reduction, and the states of an oscillation."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.captive.quantities import HARMONICS, TAKEN
from ident.captive.source import MOTIONS, Reduction
from ident.timeseries import blocks as condense
from ident.timeseries import reduction
from ident.timeseries.clock import Clock
from ident.timeseries.faults import Usual, usual
from ident.timeseries.frequency import Line, estimate
from sim.boat.catalogue import OUTPUTS
from sim.boat.forces import body_velocity
from sim.files.errors import InputError
from sim.files.frames import Frame

Array = NDArray[np.float64]
Pieces = Callable[[], Iterator[Array]]
# (time, values, displacement at each sample) -> values along the body's axes, about its moving point.
Moving = Callable[[Array, Array, Array], Array]

# The four states of an oscillation: name, phase of the displacement A sin(theta).
PHASES = {"+v": 0.0, "-v": math.pi, "+a": math.pi / 2, "-a": 3 * math.pi / 2}
# Amplitudes of rate and acceleration in a table are printed with three digits or more.
_AGREE = 0.02
# A stated frequency that is off by more than this part of itself is another test's; one that the record
# contradicts by so many standard errors, and by so many cycles from end to end, is replaced by the record's.
_OFF = 0.05
_SURE = 4.0
_DRIFT = 2e-3
# A clock that starts later than so many steps does not start with the motion.
_LATE = 1.5
# Test whose terms a state at the end of the velocity identifies.
_STEADY_TEST = {"surge": "towing", "sway": "drift_horizontal", "heave": "drift_vertical"}


@dataclass(frozen=True)
class Channels:
    """The channels of one history.

    Attributes
    ----------
    path : File or folder they come from.
    quantities : ``time`` (unless a rate is stated), loads, and measured states.
    pieces : Starts reading; blocks (rows, channels) in SI.
    first_row : File row of the first sample.
    missing : Channel -> stated values that stand for "nothing measured", in SI.
    moving : Turns loads and moves moments of a body that moves in their axes.
    """

    path: Path
    quantities: list[str]
    pieces: Pieces
    first_row: int = 2
    missing: dict[str, tuple[float, ...]] = field(default_factory=dict)
    moving: Moving | None = None


class NotRising(InputError):
    """A history whose time stamps do not rise, with nothing to stand in for them.

    Attributes
    ----------
    file : Of the run.
    row : Of the data, where time first does not rise.
    clock : All of its stamps.
    first_row : File row of the first stamp.
    """

    def __init__(self, channels: Channels, clock: Clock, at: int, found: str) -> None:
        text = "a time that rises; or rate_hz in [source.reduction] where stamps have too few digits"
        super().__init__(f"{channels.path}, data row {at + 1}, column time", found, text)
        self.file, self.row = channels.path.name, at + 1
        self.clock, self.first_row = clock, channels.first_row


@dataclass(frozen=True)
class Reduced:
    """One reduced history, for the verdict and the plot.

    Attributes
    ----------
    run_id, file : Of the run.
    loads : Names of the channels that were fitted.
    kind : Kind of reduction.
    fit : Values, covariance, window, verdict.
    clock : Its time stamps; None where the file has none.
    rate_hz : Sampling rate that stands in for them.
    first_row : File row of the first stamp.
    left_out : (kind, channel) -> samples that were no measurements, see ``ident.timeseries.faults``.
    clipped : Channel -> how it is clipped.
    samples : All of them, in the window.
    stated_hz : Frequency of an oscillation as stated, where the record's own was used instead.
    line : Frequency found in the record.
    """

    run_id: str
    file: str
    loads: list[str]
    kind: str
    fit: reduction.Fitted
    clock: Clock | None = None
    rate_hz: float | None = None
    first_row: int = 2
    left_out: dict[tuple[str, str], int] = field(default_factory=dict)
    clipped: dict[str, str] = field(default_factory=dict)
    samples: int = 0
    stated_hz: float | None = None
    line: Line | None = None

    @property
    def runs(self) -> list[str]:
        """Names of the runs it became."""
        return [self.run_id + phase for phase in PHASES] if self.kind == "oscillatory" else [self.run_id]

    def words(self) -> str:
        """The reduction in one line, as the run table carries it."""
        cut = f"{reduction.TRANSIENT} cut to" if self.fit.cut else "window"
        fewest = self.fit.effective.min() if self.fit.effective.size else math.nan
        more = "".join(f"; {text}" for text in self.remarks())
        return (
            f"{self.kind}, {cut} {self.fit.start:g}-{self.fit.end:g} s, s.e. {reduction.ERROR}, "
            f"{fewest:.0f} effective samples, {self.fit.verdict}{more}"
        )

    def remarks(self) -> list[str]:
        """What was left out of the record, and what of it is not as stated."""
        texts = [f"{n} {kind} samples of {name} left out" for (kind, name), n in self.left_out.items()]
        texts += [f"{name} is clipped: {text}" for name, text in self.clipped.items()]
        if self.stated_hz is not None and self.line is not None:
            texts.append(
                f"{self.stated_hz:g} Hz stated, the record oscillates at {self.line.frequency:.6g} +- "
                f"{self.line.stderr:.1g} Hz, which is used"
            )
        return texts


Timed = Iterator[tuple[Array, Array, NDArray[np.bool_]]]


def _timed(channels: Channels, rule: Reduction, clock: Clock | None = None) -> Iterator[tuple[Array, Array]]:
    """Pieces as (time, other channels) within the window, time rising; stamps are fed to ``clock``."""
    at = channels.quantities.index("time") if "time" in channels.quantities else None
    others = [i for i, q in enumerate(channels.quantities) if q != "time"]
    count, last = 0, -math.inf
    for piece in channels.pieces():
        if clock is not None and at is not None:
            clock.feed(piece[:, at])
        if rule.rate_hz is not None:
            time = (count + np.arange(len(piece))) / rule.rate_hz
        else:
            time = piece[:, at]
        step = np.diff(time, prepend=last)
        if (step <= 0.0).any():
            i = int(np.flatnonzero(step <= 0.0)[0])
            whole = _whole(channels, at)
            faults = whole.repeats + whole.backs
            more = f"; {faults} of {whole.samples} stamps repeat or step back" if faults > 1 else ""
            raise NotRising(channels, whole, count + i, f"{time[i]:g} s after {time[i - 1] if i else last:g} s{more}")
        count, last = count + len(piece), float(time[-1])
        keep = np.ones(len(time), dtype=bool)
        if rule.start_s is not None:
            keep &= time >= rule.start_s
        if rule.end_s is not None:
            keep &= time <= rule.end_s
        if keep.any():
            yield time[keep], piece[keep][:, others]


def _whole(channels: Channels, at: int | None) -> Clock:
    """All stamps of a history."""
    clock = Clock()
    for piece in channels.pieces() if at is not None else ():
        clock.feed(piece[:, at])
    return clock


def reduce(channels: Channels, rule: Reduction, run_id: str, frequency: float | None) -> tuple[dict[str, Any], Reduced]:
    """Reduce one history.

    Parameters
    ----------
    channels : From a reader.
    rule : ``[source.reduction]``.
    run_id : Name of the run.
    frequency : Frequency of an oscillatory test [Hz].

    Returns
    -------
    values : Quantity -> value, ``s_X`` standard errors; for an oscillatory test the
        harmonics of each load with their covariance under ``covariance``.
    reduced : What was fitted.

    Raises
    ------
    InputError
        Without time, loads or enough samples; ``NotRising`` for a time that does not rise.
    """
    names = [q for q in channels.quantities if q != "time"]
    loads = [q for q in names if q in OUTPUTS]
    if not loads:
        raise InputError(str(channels.path), f"channels {', '.join(channels.quantities)}", "at least one load")
    if "time" not in channels.quantities and rule.rate_hz is None:
        text = "a column time, or rate_hz in [source.reduction]"
        raise InputError(str(channels.path), "no time", text)
    sound, faults = _sound(channels, rule, names)
    line, stated = None, None
    if rule.kind == "oscillatory":
        line = _line(sound(None), names, frequency, channels)
        frequency, stated = _frequency(line, frequency, names, rule, channels)
        _phase_is_known(channels, rule, names)
    regressors, span = _regressors(channels, rule, frequency, sound)
    clock = Clock() if "time" in channels.quantities else None
    faults.counts.clear()
    condensed = condense.condense(_moved(sound(clock), channels, names, rule, frequency), regressors, len(names))
    try:
        fit = reduction.fit_history(condensed, names)
    except (ValueError, np.linalg.LinAlgError) as error:
        window = f" between start_s and end_s ({rule.start_s}, {rule.end_s})" if rule.start_s or rule.end_s else ""
        text = f"samples enough for a {rule.kind} fit{window}"
        raise InputError(str(channels.path), f"{error} in {condensed.samples} rows", text) from error
    own = (clock, rule.rate_hz, channels.first_row)
    reduced = replace(
        Reduced(run_id, channels.path.name, names, rule.kind, fit, *own),
        left_out=dict(faults.counts),
        clipped=faults.clipped,
        samples=condensed.samples + sum(faults.counts.values()),
        stated_hz=stated,
        line=line,
    )
    if rule.kind == "oscillatory":
        return _harmonic_values(names, fit, frequency or 0.0, rule.delay_s), reduced
    values: dict[str, Any] = {}
    for c, name in enumerate(names):
        values[name] = float(fit.values[0, c])
        if name in OUTPUTS:
            values[f"s_{name}"] = math.sqrt(max(float(fit.covariance[c, 0, 0]), 0.0))
    if rule.kind == "acceleration" and "U" in names:
        values["udot"] = float(fit.values[1, names.index("U")]) / span
    return values, reduced


def _sound(channels: Channels, rule: Reduction, names: list[str]) -> tuple[Callable[[Clock | None], Timed], Usual]:
    """The history with the samples marked that are no measurements, and what its channels are like."""
    missing = [channels.missing.get(name, ()) for name in names]
    found = usual((values for _, values in _timed(channels, rule)), names, missing)
    return (lambda clock: found.faults(_timed(channels, rule, clock))), found


def _line(pieces: Timed, names: list[str], frequency: float | None, channels: Channels) -> Line | None:
    """The oscillation of the displacement, or else of the loads."""
    condensed = condense.condense(pieces, condense.constant, len(names))
    weight, time, _, values = condensed.blocks()
    chosen = (
        [names.index("displacement")]
        if "displacement" in names
        else [c for c, name in enumerate(names) if name in OUTPUTS]
    )
    if frequency is None and "displacement" not in names:
        raise InputError(str(channels.path), "no frequency", "frequency_hz in [source.reduction], or frequency")
    found = estimate(time, values[:, chosen], weight, frequency) if time.size else None
    return None if found is None else replace(found, channel=chosen[found.channel])


def _frequency(
    line: Line | None, stated: float | None, names: list[str], rule: Reduction, channels: Channels
) -> tuple[float, float | None]:
    """The frequency to use, and the stated one where the record says another."""
    if stated is None or not stated > 0.0:
        if line is None:
            text = "frequency_hz in [source.reduction], or frequency; the displacement holds no clear oscillation"
            raise InputError(str(channels.path), "no frequency", text)
        return line.frequency, None
    if line is None:
        return stated, None
    off = abs(line.frequency - stated)
    if off > _OFF * stated:
        found = f"frequency_hz = {stated:g}, and {names[line.channel]} oscillates at {line.frequency:.5g} Hz"
        raise InputError(str(channels.path), found, f"the frequency of the motion, to {100 * _OFF:g} %")
    drift = off * _span(channels, rule)
    return (line.frequency, stated) if off > _SURE * line.stderr and drift > _DRIFT else (stated, None)


def _span(channels: Channels, rule: Reduction) -> float:
    first, last = math.inf, -math.inf
    for time, _ in _timed(channels, rule):
        first, last = min(first, float(time[0])), float(time[-1])
    return last - first


def _phase_is_known(channels: Channels, rule: Reduction, names: list[str]) -> None:
    """A phase that is not stated is that of a clock that starts at zero, or a channel's."""
    if "displacement" in names or "phase_deg" in rule.model_fields_set or rule.rate_hz is not None:
        return
    time = next((time for time, _ in _timed(channels, rule.model_copy(update={"start_s": None}))), np.zeros(0))
    if time.size > 1 and abs(time[0]) > _LATE * abs(time[1] - time[0]):
        text = "phase_deg in [source.reduction]: that of the displacement at time zero of this clock "
        text += "(phase_deg = 0.0 where it is zero), or a column displacement"
        raise InputError(str(channels.path), f"a clock that starts at {time[0]:g} s, and no phase", text)


def _moved(pieces: Timed, channels: Channels, names: list[str], rule: Reduction, frequency: float | None) -> Timed:
    """Loads of a body that moves in their axes: turned with it, moments about its own point."""
    for time, values, bad in pieces:
        if channels.moving is None:
            yield time, values, bad
            continue
        if "displacement" in names:
            at = values[:, names.index("displacement")]
        elif rule.amplitude is not None and frequency:
            at = rule.amplitude * np.sin(2.0 * math.pi * frequency * time + math.radians(rule.phase_deg))
        else:
            text = "amplitude in [source.reduction], or a column displacement: the body moves in the axes of the loads"
            raise InputError(str(channels.path), "no displacement", text)
        yield time, channels.moving(time, values, at), bad


def _regressors(
    channels: Channels, rule: Reduction, frequency: float | None, sound: Callable[[Clock | None], Timed]
) -> tuple[condense.Regressors, float]:
    """What the channels of a test are fitted by, and the unit of its time [s]."""
    if rule.kind == "steady":
        return condense.constant, 1.0
    if rule.kind == "oscillatory":
        assert frequency is not None
        return condense.harmonics(frequency, math.radians(rule.phase_deg)), 1.0
    first, last = math.inf, -math.inf
    for time, _, _ in sound(None):
        first, last = min(first, float(time[0])), float(time[-1])
    if not last > first:
        raise InputError(str(channels.path), "no span of time", "samples over a span of time")
    half = 0.5 * (last - first)
    return condense.powers(first + half, half), half


def _harmonic_values(
    names: list[str], fit: reduction.Fitted, frequency: float, delay_s: dict[str, float]
) -> dict[str, Any]:
    """Harmonics in the phase of the displacement, which a channel may measure, each channel's delay taken off."""
    shift, values = 0.0, {}
    omega = 2.0 * math.pi * frequency
    if "displacement" in names:
        s, c = fit.values[1:3, names.index("displacement")]
        shift = math.atan2(c, s) + omega * delay_s.get("displacement", 0.0)
        values["amplitude"] = math.hypot(s, c)
    covariance = {}
    for c_, name in enumerate(names):
        # What comes late by a delay stands a phase of omega times it behind.
        late = omega * delay_s.get(name.removeprefix(TAKEN), 0.0)
        turn = np.eye(7)
        for k in (1, 2, 3):
            a = k * (shift - late)
            block = [[math.cos(a), math.sin(a)], [-math.sin(a), math.cos(a)]]
            turn[2 * k - 1 : 2 * k + 1, 2 * k - 1 : 2 * k + 1] = block
        own = turn @ fit.values[:, c_]
        if name.removeprefix(TAKEN) in OUTPUTS:
            values |= {f"{name}_{h}": float(v) for h, v in zip(HARMONICS, own, strict=True)}
            covariance[name] = turn @ fit.covariance[c_] @ turn.T
        elif name != "displacement":
            values[name] = float(own[0])
    return values | {"covariance": covariance, "frequency": frequency}


def phase_row(theta: float) -> Array:
    """Weights of mean, in, out, in2, out2, in3, out3 in the load at phase ``theta``.

    The third harmonic in phase is left out: a load that is a function of the velocity and
    linear in the acceleration has none, so at the ends of the acceleration it is noise.
    """
    row = np.array([1.0, *(f(k * theta) for k in (1, 2, 3) for f in (math.sin, math.cos))])
    row[HARMONICS.index("in3")] = 0.0
    return row


def states(run: dict[str, Any], rule: Reduction, frame: Frame, ittc: bool, where: str) -> list[dict[str, Any]]:
    """Four instants of an oscillatory test, each a run of its own.

    The displacement is A sin(theta); the velocity A w cos(theta) is largest at 0 and pi,
    the acceleration -A w^2 sin(theta) at pi/2 and 3 pi/2. The load there is the sum of its
    harmonics 0-3 (in phase: of sine, in quadrature: of cosine).

    Parameters
    ----------
    run : Base state (SI, campaign frame), ``X_mean``, ``X_in``, ..., ``frequency`` [Hz], and
        one of ``amplitude`` or the acceleration's amplitude (-A w^2, signed).
    rule : Says what oscillates.
    frame, ittc : Of the campaign: direction of the axis that moves, sign of drift.
    where : For the error.

    Raises
    ------
    InputError
        Without frequency, amplitude, or any load.
    """
    assert rule.motion is not None
    speed_name, acceleration_name = MOTIONS[rule.motion]
    omega = 2.0 * math.pi * float(run.get("frequency", rule.frequency_hz) or math.nan)
    if not omega > 0.0:
        raise InputError(f"{where}, column frequency", "nothing", "a frequency, or frequency_hz in [source.reduction]")
    speed, given = _amplitudes(run, rule, omega, where)
    found = []
    for name, theta in PHASES.items():
        state = {k: v for k, v in run.items() if "_" not in k or k.split("_")[-1] not in HARMONICS}
        state["run_id"] = f"{run['run_id']}{name}"
        at_velocity = name.endswith("v")
        _move(state, speed_name, speed * math.cos(theta) if at_velocity else 0.0, frame, ittc)
        state[acceleration_name] = 0.0 if at_velocity else given * math.sin(theta)
        usual = _STEADY_TEST.get(rule.motion, "rotating_arm")
        state["test"] = (run.get("test") or usual) if at_velocity else "acceleration"
        weights = phase_row(theta)
        for output in (*OUTPUTS, *(TAKEN + o for o in OUTPUTS)):
            parts = np.array([run.get(f"{output}_{h}", math.nan) for h in HARMONICS], dtype=float)
            if np.isnan(parts).all():
                continue
            state[output] = float(weights @ np.nan_to_num(parts))
            if output in OUTPUTS and output in run.get("covariance", {}):
                variance = float(weights @ run["covariance"][output] @ weights)
                state[f"s_{output}"] = math.sqrt(max(variance, 0.0))
        for name_ in ("covariance", "frequency", "amplitude", "displacement"):
            state.pop(name_, None)
        found.append(state)
    return found


def _amplitudes(run: dict[str, Any], rule: Reduction, omega: float, where: str) -> tuple[float, float]:
    """Amplitudes of velocity (of cosine) and acceleration (of sine), from what the run gives."""
    speed_name, acceleration_name = MOTIONS[rule.motion or "sway"]
    amplitude = run.get("amplitude", rule.amplitude)
    given = {k: run.get(k) for k in (speed_name, acceleration_name)}
    known = {k: float(v) for k, v in given.items() if v is not None and not math.isnan(v)}
    if acceleration_name in known:
        speed = -known[acceleration_name] / omega
    elif speed_name in known:
        speed = known[speed_name]
    elif amplitude is not None and not math.isnan(amplitude):
        speed = float(amplitude) * omega
    else:
        text = f"amplitude in [source.reduction], a column displacement, or the amplitude {acceleration_name}"
        raise InputError(f"{where}, column displacement", "nothing", text)
    off = abs(speed - known.get(speed_name, speed))
    if off > _AGREE * abs(speed):
        found = f"amplitudes {speed_name} = {known[speed_name]:g} and {acceleration_name} = {-speed * omega:g}"
        text = f"{acceleration_name} = -{speed_name} omega with omega = {omega:g} rad/s (displacement A sin)"
        raise InputError(where, found, text)
    return speed, -speed * omega


def _move(state: dict[str, Any], name: str, velocity: float, frame: Frame, ittc: bool) -> None:
    """Put the velocity of the oscillation into a state: a rate, or added to the flow."""
    if name in "pqr":
        state[name] = velocity
        return
    sign = -1.0 if ittc else 1.0
    speed, alpha, beta = (float(np.nan_to_num(state.get(k, 0.0) or 0.0)) for k in ("U", "alpha", "beta"))
    moving = np.array(body_velocity(speed, alpha, sign * beta))
    moving["uvw".index(name)] += frame.sign(name) * velocity
    size = float(np.linalg.norm(moving))
    state["U"] = size
    if size > 0.0:
        state["alpha"] = math.atan2(moving[2], moving[0]) if moving[0] or moving[2] else 0.0
        state["beta"] = sign * math.asin(max(-1.0, min(1.0, moving[1] / size)))
