"""The motion of an oscillatory test as its record has it: frequency, phase."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ident.captive.channels import Channels, Timed, timed
from ident.captive.source import Reduction
from ident.timeseries import blocks as condense
from ident.timeseries.frequency import START, Line, estimate
from ident.timeseries.phase import Leap, leap
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError

# A stated frequency that is off by more than this part of itself is another test's; one that the record
# contradicts by so many standard errors, and by so many cycles from end to end, is replaced by the record's.
_OFF = 0.05
_SURE = 4.0
_DRIFT = 2e-3
# Share of a channel's scatter that a line away from the stated frequency has to hold, and its cycles: a drift is none.
_CLEAR, _CYCLES = 0.9, 4.0
# A clock that starts later than so many steps does not start with the motion.
_LATE = 1.5


def line_of(pieces: Timed, names: list[str], frequency: float | None, channels: Channels) -> Line | None:
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
    line = estimate(time, values[:, chosen], weight, frequency) if time.size else None
    if line is None and frequency is not None and time.size:
        # Nothing there: a line elsewhere that is nearly all of a channel says that another frequency was meant.
        line = estimate(time, values[:, chosen], weight, None)
        clear = line is not None and line.share > _CLEAR and line.frequency * (time[-1] - time[0]) > _CYCLES
        line = line if clear else None
    return None if line is None else replace(line, channel=chosen[line.channel])


def leap_of(pieces: Timed, names: list[str], line: Line | None) -> Leap | None:
    """A step in the phase of the oscillation, of the channel that its frequency was found in."""
    if line is None:
        return None
    condensed = condense.condense(pieces, condense.constant, len(names))
    weight, time, _, values = condensed.blocks()
    late = np.ones(time.size, dtype=bool)
    if names[line.channel] != "displacement":
        # A load may have its start-up transient there.
        late = time >= time[0] + START * (time[-1] - time[0])
    return leap(time[late], values[late, line.channel], weight[late], line.frequency)


def frequency_of(
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
        wrong = f"frequency_hz = {stated:g}, and {names[line.channel]} oscillates at {line.frequency:.5g} Hz"
        wrong += " (rad/s for Hz?)" if abs(2.0 * math.pi * line.frequency - stated) < _OFF * stated else ""
        raise InputError(str(channels.path), wrong, f"the frequency of the motion, to {100 * _OFF:g} %")
    drift = off * span_of(channels, rule)
    return (line.frequency, stated) if off > _SURE * line.stderr and drift > _DRIFT else (stated, None)


def stated_frequency(channels: Channels, frequency: float | None) -> float | None:
    """The frequency that a campaign or a channel of the record states [Hz]; None for neither.

    Raises
    ------
    InputError
        For both, or a channel that changes.
    """
    if "frequency" not in channels.quantities:
        return frequency
    place = f"{channels.path}, column frequency"
    if frequency is not None:
        raise InputError(place, "a channel, and frequency stated in the campaign too", "one of the two")
    values = next((piece[:, channels.quantities.index("frequency")] for piece in channels.pieces()), np.zeros(0))
    if not values.size or not values[0] > 0.0 or np.ptp(values) > _OFF * values[0]:
        shown = f"{values.min():.4g} to {values.max():.4g} Hz" if values.size else "nothing"
        raise InputError(place, shown, "one frequency all along")
    return float(values.mean())


def phase_is_taken(names: list[str], rule: Reduction) -> bool:
    """Whether nothing says the phase of the displacement, so that it is zero at time zero."""
    return "displacement" not in names and "phase_deg" not in rule.model_fields_set


def span_of(channels: Channels, rule: Reduction) -> float:
    """Length of a history within its window [s]."""
    first, last = math.inf, -math.inf
    for time, _ in timed(channels, rule):
        first, last = min(first, float(time[0])), float(time[-1])
    return last - first


def phase_is_known(channels: Channels, rule: Reduction, names: list[str]) -> None:
    """A phase that is not stated is that of a clock that starts at zero, or a channel's."""
    if "displacement" in names or "phase_deg" in rule.model_fields_set or rule.rate_hz is not None:
        return
    time = next((time for time, _ in timed(channels, rule.model_copy(update={"start_s": None}))), np.zeros(0))
    if time.size > 1 and abs(time[0]) > _LATE * abs(time[1] - time[0]):
        text = "phase_deg in [source.reduction]: that of the displacement at time zero of this clock "
        text += "(phase_deg = 0.0 where it is zero), or a column displacement"
        raise InputError(str(channels.path), f"a clock that starts at {time[0]:g} s, and no phase", text)
