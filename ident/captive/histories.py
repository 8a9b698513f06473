"""A time history to runs: window, sound samples, reduction."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.captive import delay
from ident.captive.channels import Channels, Timed, timed
from ident.captive.left_behind import LeftBehind
from ident.captive.motion import frequency_of, leap_of, line_of, phase_is_known, phase_is_taken, stated_frequency
from ident.captive.oscillation import PHASES, Oscillation
from ident.captive.quantities import HARMONICS, TAKEN
from ident.captive.source import MOTIONS, Reduction
from ident.timeseries import blocks as condense
from ident.timeseries import reduction
from ident.timeseries.clock import Clock
from ident.timeseries.faults import Usual, usual
from ident.timeseries.frequency import Line
from ident.timeseries.phase import Leap
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError

Array = NDArray[np.float64]


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
    phase_taken : Whether the phase of an oscillation is nowhere stated or measured, and taken as zero at time zero.
    stated_hz : Frequency of an oscillation as stated, where the record's own was used instead.
    line : Frequency found in the record.
    delays : By how much channels come behind the motion, beyond what is stated.
    leap : A step in the phase of the oscillation.
    left_behind : What a moment point that stays while the body moves would do, where nothing says that it goes along.
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
    phase_taken: bool = False
    stated_hz: float | None = None
    line: Line | None = None
    delays: tuple[delay.Delay, ...] = ()
    left_behind: tuple[LeftBehind, ...] = ()
    leap: Leap | None = None

    @property
    def runs(self) -> list[str]:
        """Names of the runs it became."""
        return [self.run_id + phase for phase in PHASES] if self.kind == "oscillatory" else [self.run_id]

    def words(self) -> str:
        """The reduction in one line, as the run table carries it."""
        cut = f"{reduction.TRANSIENT} cut to" if self.fit.cut else "window"
        fewest = self.fit.effective.min() if self.fit.effective.size else math.nan
        # A channel that has settled to its last digits has no scatter to count samples of.
        amount = "settled" if self.fit.converged and fewest < 1.0 else f"{fewest:.0f} effective samples"
        more = "".join(f"; {text}" for text in self.remarks())
        return (
            f"{self.kind}, {cut} {self.fit.start:.10g}-{self.fit.end:.10g} s, s.e. {reduction.ERROR}, "
            f"{amount}, {self.fit.verdict}{more}"
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


@dataclass(frozen=True)
class HistoryValues:
    """What a history comes to.

    Attributes
    ----------
    quantities : Quantity -> mean, or of an oscillation's own rates the amplitude; ``s_X`` standard errors of loads.
    harmonics, covariance : Load -> (7,) and (7, 7), as ``Oscillation``; of oscillatory tests.
    frequency, amplitude : Of an oscillatory test: [Hz], and of the displacement where a channel measures it.
    """

    quantities: dict[str, float]
    harmonics: dict[str, Array] = field(default_factory=dict)
    covariance: dict[str, Array] = field(default_factory=dict)
    frequency: float | None = None
    amplitude: float | None = None

    @property
    def measured(self) -> set[str]:
        """Names of what the history gives, as constants of a source would be called."""
        harmonics = {f"{load}_{h}" for load in self.harmonics for h in HARMONICS}
        return {*self.quantities, *harmonics, *(("amplitude",) if self.amplitude is not None else ())}

    def oscillation(self, row: Mapping[str, Any]) -> Oscillation:
        """The oscillatory test, with what the row of the run states beside it."""
        stated = Oscillation.of_row(row)
        return replace(
            stated,
            harmonics=stated.harmonics | self.harmonics,
            covariance=self.covariance,
            frequency=self.frequency,
            amplitude=stated.amplitude if self.amplitude is None else self.amplitude,
        )


def reduce(channels: Channels, rule: Reduction, run_id: str, frequency: float | None) -> tuple[HistoryValues, Reduced]:
    """Reduce one history.

    Parameters
    ----------
    channels : From a reader.
    rule : ``[source.reduction]``.
    run_id : Name of the run.
    frequency : Frequency of an oscillatory test [Hz].

    Returns
    -------
    values : Of the run.
    reduced : What was fitted.

    Raises
    ------
    InputError
        Without time, loads or enough samples; ``NotRising`` for a time that does not rise.
    """
    names = [q for q in channels.quantities if q != "time"]
    _check_channels(channels, rule)
    sound, faults = _sound(channels, rule, names)
    line, stated, leapt = None, None, None
    if rule.kind == "oscillatory":
        frequency = stated_frequency(channels, frequency)
        line = line_of(sound(None), names, frequency, channels)
        frequency, stated = frequency_of(line, frequency, names, rule, channels)
        phase_is_known(channels, rule, names)
        leapt = leap_of(sound(None), names, line)
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
    times = (clock, rule.rate_hz, channels.first_row)
    reduced = replace(
        Reduced(run_id, channels.path.name, names, rule.kind, fit, *times),
        left_out=dict(faults.counts),
        clipped=faults.clipped,
        samples=condensed.samples + sum(faults.counts.values()),
        phase_taken=rule.kind == "oscillatory" and phase_is_taken(names, rule),
        stated_hz=stated,
        line=line,
        leap=leapt,
    )
    if rule.kind == "oscillatory":
        values, delays = _harmonic_values(names, fit, frequency or 0.0, rule)
        # A motion that starts from rest shows a lag by its start.
        all_of_it = faults.faults(timed(channels, rule), "displacement")
        whole = condense.condense(_moved(all_of_it, channels, names, rule, frequency), condense.constant, len(names))
        weight, time, _, samples = whole.blocks()
        seen = delay.of_loads(time, samples, weight, names, frequency or 0.0, rule.delay_s)
        return values, replace(reduced, delays=(*delays, *((seen,) if seen else ())))
    return HistoryValues(_means(names, fit, rule, span)), reduced


def _check_channels(channels: Channels, rule: Reduction) -> None:
    """Refuse a history without loads, or without a clock."""
    if not any(quantity in OUTPUTS for quantity in channels.quantities):
        raise InputError(str(channels.path), f"channels {', '.join(channels.quantities)}", "at least one load")
    if "time" not in channels.quantities and rule.rate_hz is None:
        text = "a column time, or rate_hz in [source.reduction]"
        raise InputError(str(channels.path), "no time", text)


def _means(names: list[str], fit: reduction.Fitted, rule: Reduction, span: float) -> dict[str, float]:
    """Means of a steady or accelerated run and the standard errors of its loads."""
    values: dict[str, float] = {}
    for c, name in enumerate(names):
        values[name] = float(fit.values[0, c])
        if name in OUTPUTS:
            values[f"s_{name}"] = math.sqrt(max(float(fit.covariance[c, 0, 0]), 0.0))
    if rule.kind == "acceleration" and "U" in names:
        values["udot"] = float(fit.values[1, names.index("U")]) / span
    return values


def _sound(channels: Channels, rule: Reduction, names: list[str]) -> tuple[Callable[[Clock | None], Timed], Usual]:
    """The history with the samples marked that are no measurements, and what its channels are like."""
    missing = [channels.missing.get(name, ()) for name in names]
    learned = usual((values for _, values in timed(channels, rule)), names, missing)
    return (lambda clock: learned.faults(timed(channels, rule, clock))), learned


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
    names: list[str], fit: reduction.Fitted, frequency: float, rule: Reduction
) -> tuple[HistoryValues, list[delay.Delay]]:
    """Harmonics in the phase of the displacement, which a channel may measure, each channel's delay taken off."""
    shift, amplitude = 0.0, None
    values: dict[str, float] = {}
    delay_s, motion = rule.delay_s, rule.motion or ""
    omega = 2.0 * math.pi * frequency
    if "displacement" in names:
        s, c = fit.values[1:3, names.index("displacement")]
        shift = math.atan2(c, s) + omega * delay_s.get("displacement", 0.0)
        amplitude = math.hypot(s, c)
    harmonics: dict[str, Array] = {}
    covariance: dict[str, Array] = {}
    delays: list[delay.Delay] = []
    for c_, name in enumerate(names):
        # What comes late by a delay stands a phase of omega times it behind.
        late = omega * delay_s.get(name.removeprefix(TAKEN), 0.0)
        turn = np.eye(7)
        for k in (1, 2, 3):
            a = k * (shift - late)
            block = [[math.cos(a), math.sin(a)], [-math.sin(a), math.cos(a)]]
            turn[2 * k - 1 : 2 * k + 1, 2 * k - 1 : 2 * k + 1] = block
        turned = turn @ fit.values[:, c_]
        if name.removeprefix(TAKEN) in OUTPUTS:
            harmonics[name] = turned
            covariance[name] = turn @ fit.covariance[c_] @ turn.T
        elif name in MOTIONS[motion]:
            # A measured rate or acceleration swings with the motion: its amplitude is meant, not its mean.
            seen = delay.of_rate(name, motion, turned, turn @ fit.covariance[c_] @ turn.T, frequency)
            delays += [seen] if seen else []
            values[name] = math.hypot(turned[1], turned[2]) * (1.0 if name == MOTIONS[motion][0] else -1.0)
        elif name != "displacement":
            values[name] = float(turned[0])
    return HistoryValues(values, harmonics, covariance, frequency, amplitude), delays
