"""Samples of a history that are no measurements: sentinels, spikes, stuck and clipped channels.

A first reading of a history learns what its channels are like (``Usual``), a second takes out the
samples that are not (``Usual.faults``). Both are in bounded memory. A sample is left out with all
of its channels, and counted by channel and kind; nothing is put in its place.

* **sentinel**: a stated value or word (``missing``), one written with nines only (-999, 9999, ...) or the end of
  an integer's range far outside of all others, or one value that stands often and far from all others: what
  loggers write where they have nothing.
* **spike**: at most three samples far outside of 98 % of the record (or of 90 %), with neighbours inside on both
  sides, or inside of it and far from all that stand around them (``ident.timeseries.spikes``). What stands at the
  start of a record is the start-up transient's, and not looked at.
* **stuck**: one value for longer than chance repeats it, while the steps around it are larger than
  the last digit: a frozen channel, an amplifier at its limit, a dropout to zero. A computed load
  that has settled moves by its last digit before it rests, and is none.
* **clipped**: the largest or smallest value stands far more often than the next one: what went
  beyond was cut off one by one, and a mean of the rest is biased. Named, nothing is left out.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.spikes import Surroundings, beside_the_way

Array = NDArray[np.float64]

# Samples kept for the quantiles, and those carried from one piece to the next.
_KEPT = 1 << 14
_CARRIED = 64
# A spike is outside of the quantiles by so many times their distance, and no longer than so many samples.
_QUANTILES = (0.01, 0.99)
_FAR = 5.0
# Where spikes are up to a tenth of the samples: closer quantiles, as far as those of normal noise.
_CLOSER = (0.05, 0.95)
_AS_FAR = 7.0
_SHORT = 3
# Shortest run of one value that is stuck; chance of a longer one in a sound record; steps around in last digits.
_RUN = 5
_CHANCE = 1e-6
_AROUND = 20
_DIGITS = 5.0
# Values with nines only stand outside of all others by this factor.
BEYOND = 3.0
# -999.25 of well logs, and the ends of 16 and 32 bits.
_KNOWN = (999.25, 32767.0, 32768.0, 65535.0, 2147483647.0, 2147483648.0)
# Clipped: the extreme value stands so many times, and so many times as often as the next.
_CLIPPED = 10
_OFTEN = 5.0
# A limit that is so far from the next value, as a share of 98 % of the record, cuts nothing off.
_APART = 0.2
_ROUNDED = 2.0**33
_NINES = re.compile(r"9{3,}0*")


def sentinel(value: float) -> bool:
    """Whether loggers write a number where they have nothing: three nines or more and nothing else, -999.25, -32768."""
    return abs(value) in _KNOWN or bool(_NINES.fullmatch(f"{abs(value):.10g}".replace(".", "").lstrip("0")))


@dataclass
class _Extreme:
    """The largest value of a channel and the next one, with how often each stands."""

    sign: float
    first: float = -math.inf
    second: float = -math.inf
    firsts: int = 0
    seconds: int = 0

    def feed(self, values: Array) -> None:
        # To ten digits: tops of a motion without noise differ by rounding alone, and none of them is a limit.
        digits, exponent = np.frexp(self.sign * values)
        signed = np.ldexp(np.round(digits * _ROUNDED), exponent) / _ROUNDED
        for value in np.unique(signed)[-2:]:
            count = int((signed == value).sum())
            if value > self.first:
                self.second, self.seconds = self.first, self.firsts
                self.first, self.firsts = float(value), count
            elif value == self.first:
                self.firsts += count
            elif value > self.second:
                self.second, self.seconds = float(value), count
            elif value == self.second:
                self.seconds += count

    def clipped(self) -> bool:
        return self.firsts >= _CLIPPED and self.seconds > 0 and self.firsts > _OFTEN * self.seconds


@dataclass
class _Channel:
    """What one channel is like."""

    low: float = -math.inf
    high: float = math.inf
    digit: float = 0.0
    longest: int = 1 << 60
    beside: float = math.inf
    sentinels: tuple[float, ...] = ()
    often: tuple[float, ...] = ()
    clipped: str = ""
    # How often the limit stands, and whether far from all other values: a dropout, nothing is cut off there.
    at_limit: int = 0
    apart: bool = False


@dataclass
class _Rest:
    """How long a channel stands at its first value."""

    column: int | None
    first: float | None = None
    over: bool = False

    def samples(self, values: Array) -> int:
        """Samples at the beginning of a piece before the channel first moves."""
        if self.over or not values.size:
            return 0
        self.first = float(values[0]) if self.first is None else self.first
        moved = np.flatnonzero(values != self.first)
        self.over = bool(moved.size)
        return int(moved[0]) if moved.size else values.size


@dataclass
class Usual:
    """What the channels of a history are like, from a first reading.

    Attributes
    ----------
    names : Of the channels.
    counts : Kind and channel -> samples found by ``faults`` so far.
    """

    names: list[str]
    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    _channels: list[_Channel] = field(default_factory=list)

    @property
    def clipped(self) -> dict[str, str]:
        """Channel -> how it is clipped, in words; after ``faults``, without what was left out whole as stuck."""
        return {
            n: c.clipped
            for n, c in zip(self.names, self._channels, strict=True)
            if c.clipped and not (c.apart and self.counts["stuck", n] >= c.at_limit)
        }

    def faults(
        self, pieces: Iterator[tuple[Array, Array]], resting: str = ""
    ) -> Iterator[tuple[Array, Array, NDArray[np.bool_]]]:
        """Pieces (any columns, channels) with a mask of the samples to leave out, counted as they pass.

        Parameters
        ----------
        pieces : In their order.
        resting : Channel that may stand at one value before it first moves: a motion that starts from rest.
        """
        carried = np.zeros((0, len(self.names)))
        held: tuple[Array, Array] | None = None
        rest = _Rest(self.names.index(resting) if resting in self.names else None)
        for piece in pieces:
            if held is not None:
                ahead = piece[1][:_CARRIED]
                yield (*held, self._mask(held[1], carried, ahead, rest))
                carried = held[1][-_CARRIED:]
            held = piece
        if held is not None:
            yield (*held, self._mask(held[1], carried, held[1][:0], rest))

    def _mask(self, values: Array, before: Array, after: Array, rest: _Rest) -> NDArray[np.bool_]:
        whole = np.vstack([before, values, after])
        inside = slice(len(before), len(before) + len(values))
        bad = np.zeros(len(values), dtype=bool)
        for c, (name, channel) in enumerate(zip(self.names, self._channels, strict=True)):
            column = whole[:, c]
            nothing = np.isnan(column)
            marks = (
                {"sentinel": nothing | np.isin(column, channel.sentinels)} if channel.sentinels or nothing.any() else {}
            )
            known = marks.get("sentinel", np.zeros(len(column), dtype=bool))
            outside = ((column < channel.low) | (column > channel.high)) & ~known
            if outside.any():
                marks["spike"] = _short(outside, len(before) == 0)
                known = known | marks["spike"]
            if len(column) > channel.longest:
                marks["stuck"] = _stuck(column, channel) & ~known
                if c == rest.column:
                    marks["stuck"][inside][: rest.samples(values[:, c])] = False
                known = known | marks["stuck"]
            # What is out already is no neighbour that a spike could be told by.
            beside = beside_the_way(np.where(known, np.nan, column), channel.beside)
            if beside.any():
                marks["spike"] = marks.get("spike", False) | _short(beside, len(before) == 0)
                known = known | marks["spike"]
            if channel.often:
                marks["sentinel"] = marks.get("sentinel", False) | (np.isin(column, channel.often) & ~known)
            for kind, mark in marks.items():
                faulty = mark[inside]
                if faulty.any():
                    self.counts[kind, name] += int(faulty.sum())
                    bad |= faulty
        return bad


def _spans(mark: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """First and one after last position of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mark, [False]]).astype(np.int8)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def _short(outside: NDArray[np.bool_], first: bool) -> NDArray[np.bool_]:
    """Runs of at most three samples; not at the very start of a record."""
    mark = np.zeros(len(outside), dtype=bool)
    for a, b in _spans(outside):
        if b - a <= _SHORT and not (first and a == 0):
            mark[a:b] = True
    return mark


def _stuck(column: Array, channel: _Channel) -> NDArray[np.bool_]:
    """Runs of one value longer than chance makes them, between steps larger than the last digit."""
    mark = np.zeros(len(column), dtype=bool)
    step = np.abs(np.diff(column))
    for a, b in _spans(step == 0.0):
        if b - a + 1 <= channel.longest:
            continue
        around = np.concatenate([step[max(a - _AROUND, 0) : a], step[b : b + _AROUND]])
        if around.size and float(np.median(around)) > _DIGITS * channel.digit > 0.0:
            mark[a : b + 1] = True
    return mark


class _Learning:
    """The first reading of one channel."""

    def __init__(self) -> None:
        self.kept = np.zeros(0)
        self.stride, self.count, self.steps, self.equal = 1, 0, 0, 0
        self.digit = math.inf
        self.last: float | None = None
        self.nines: Counter[float] = Counter()
        self.around = Surroundings()
        self.ends = (_Extreme(1.0), _Extreme(-1.0))

    def feed(self, values: Array) -> None:
        values = values[~np.isnan(values)]
        if not values.size:
            return
        self.around.feed(values)
        start = -self.count % self.stride
        self.kept = np.concatenate([self.kept, values[start :: self.stride]])
        while self.kept.size > _KEPT:
            self.kept, self.stride = self.kept[::2], 2 * self.stride
        self.count += values.size
        step = np.abs(np.diff(values, prepend=values[:1] if self.last is None else self.last))
        run_steps = step == 0.0
        # A repeat counts once a run, so that one stuck stretch does not make repeats usual.
        self.equal += int((run_steps[1:] & ~run_steps[:-1]).sum())
        self.steps += int((~run_steps).sum())
        moving = step[~run_steps]
        if moving.size:
            self.digit = min(self.digit, float(moving.min()))
        self.last = float(values[-1])
        size = float(np.abs(values).max())
        if size >= 99.0:
            for value in np.unique(values[np.abs(values) >= 99.0])[[0, -1]]:
                if sentinel(float(value)):
                    self.nines[float(value)] += int((values == value).sum())
        for end in self.ends:
            end.feed(values)

    def _alone(self, end: _Extreme) -> bool:
        """Whether one value stands often, and further from all others than they are apart."""
        other = self.ends[1] if end is self.ends[0] else self.ends[0]
        apart, spread = end.first - end.second, end.second + other.first
        return end.firsts >= _CLIPPED and end.seconds > 0 and spread > 0.0 and apart > _FAR * spread

    def result(self, name: str, stated: Sequence[float]) -> _Channel:
        channel = _Channel(digit=self.digit if math.isfinite(self.digit) else 0.0)
        if not self.count:
            return channel
        often = [end.sign * end.first for end in self.ends if self._alone(end)]
        kept = self.kept[~np.isin(self.kept, (*stated, *self.nines, *often))]
        kept = kept if kept.size else self.kept
        low, high = (float(np.quantile(kept, q)) for q in _QUANTILES)
        size = max(abs(low), abs(high))
        channel.sentinels = (*stated, *(v for v in self.nines if abs(v) > BEYOND * size))
        channel.often = tuple(often)
        # Of a channel that stands at zero what is beyond is told by its own size.
        room = max(_FAR * (high - low), 0.01 * size) or 1e-3 * max(abs(end.first) for end in self.ends)
        if room > 0.0 and self.count > _AROUND:
            channel.low, channel.high = low - room, high + room
            lower, upper = (float(np.quantile(kept, q)) for q in _CLOSER)
            closer = _AS_FAR * (upper - lower)
            # A channel of few digits has its usual values further apart than its quantiles.
            if closer > max(_DIGITS * channel.digit, 0.01 * max(abs(lower), abs(upper))):
                channel.low, channel.high = max(channel.low, lower - closer), min(channel.high, upper + closer)
        channel.beside = max(self.around.limit(high - low), _DIGITS * channel.digit)
        repeats = min(max(self.equal / max(self.equal + self.steps, 1), 1e-12), 1.0 - 1e-12)
        channel.longest = max(_RUN, math.ceil(math.log(_CHANCE / max(self.count, 1)) / math.log(repeats)))
        for end, word in zip(self.ends, ("largest", "smallest"), strict=True):
            value = end.sign * end.first
            # Of a constant channel with a spike nothing is cut off: no other value is inside.
            inside = all(channel.low <= v <= channel.high for v in (value, end.sign * end.second))
            if end.clipped() and value not in channel.sentinels and inside:
                channel.at_limit, channel.apart = end.firsts, end.first - end.second > _APART * (high - low)
                channel.clipped = f"{end.firsts} of {self.count} samples are the {word} value {value:g}"
        return channel


def usual(pieces: Iterator[Array], names: list[str], missing: Sequence[Sequence[float]]) -> Usual:
    """Read a history once to learn what its channels are like.

    Parameters
    ----------
    pieces : Blocks (rows, channels).
    names : Of the channels.
    missing : Stated sentinels of each channel, in its units.
    """
    learning = [_Learning() for _ in names]
    for piece in pieces:
        for channel, values in zip(learning, piece.T, strict=True):
            if values.size:
                channel.feed(values)
    learned = Usual(names)
    if learning and learning[0].count:
        learned._channels = [one.result(n, list(m)) for one, n, m in zip(learning, names, missing, strict=True)]
    else:
        learned._channels = [_Channel() for _ in names]
    return learned
