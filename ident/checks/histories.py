"""Checks of time histories: their time stamps, and whether they had settled."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ident.checks.copies import digits
from ident.checks.findings import Array, Evidence, Finding, Rule, check, declared, milder, rules
from ident.timeseries.clock import Clock

if TYPE_CHECKING:
    from ident.captive.histories import Reduced


@check("time")
def clocks(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Every time column of the evidence."""
    for name, time in evidence.times.items():
        yield from time_stamps(np.asarray(time, dtype=float), name, rule)


@check("time")
def replaced_clocks(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Stamps that ``rate_hz`` of the campaign stands in for, and whether it fits them.

    Stamps that do not rise and that nothing stands in for are those of ``refused_clocks``.
    """
    seen: set[str] = set()
    for one in evidence.histories:
        if one.clock is None or one.rate_hz is None or one.file in seen:
            continue
        seen.add(one.file)
        for finding in faults(one.clock, one.file, rule, one.first_row, "info"):
            yield finding.with_words("; rate_hz of the campaign stands in for the stamps")
        yield from _rate(one, one.clock, one.rate_hz, rule)


@check("time")
def gaps_of_clocks(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Histories whose clock leaps over a time without samples."""
    for one in evidence.histories:
        if one.clock is not None and one.rate_hz is None and one.clock.gaps:
            rows = [k + one.first_row for k in one.clock.gap]
            what = f"time leaps {one.clock.gaps} times, by {one.clock.longest:.4g} s at the most: no samples are there"
            yield rule.finding(one.file, rows, ["time"], what, "warning")


@check("time")
def refused_clocks(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Histories that were not reduced because their stamps do not rise and nothing stands in for them."""
    for one in evidence.campaign.refused if evidence.campaign else ():
        for finding in faults(one.clock, one.file, rule, one.first_row):
            yield finding.with_words(f"; not reduced, and refused by ident fit (allowed: {one.allowed})")


def _rate(one: Reduced, clock: Clock, rate_hz: float, rule: Rule) -> Iterator[Finding]:
    """A sampling rate that makes the record another length than its stamps say."""
    span, stated = clock.last - clock.first, (clock.samples - 1) / rate_hz
    # Stamps are no better than their longest step, at both ends.
    if abs(span - stated) > rule.limits["rate"] * max(span, stated) + 2.0 * clock.longest:
        what = f"rate_hz = {rate_hz:g} makes {clock.samples} rows a record of {stated:.4g} s, "
        what += f"the time stamps span {span:.4g} s"
        yield rule.finding(one.file, [], ["time"], what)


def time_stamps(time: Array, file: str, rule: Rule | None = None, first_row: int = 2) -> Iterator[Finding]:
    """Stamps that are not finite, repeat or step back.

    Parameters
    ----------
    time : Stamps in the order of the file [s].
    file, first_row : File, and its row of the first stamp.
    rule : The row of ``data/checks.csv``; looked up when None.
    """
    clock = Clock()
    clock.feed(np.asarray(time, dtype=float))
    yield from faults(clock, file, rule or rules()["time"], first_row)


def faults(clock: Clock, file: str, rule: Rule, first_row: int, severity: str = "") -> Iterator[Finding]:
    """What is wrong with the stamps a clock was fed.

    Parameters
    ----------
    clock : From a reader.
    file, first_row : File, and its row of the first stamp.
    rule : The row of ``data/checks.csv``.
    severity : Instead of the rule's own.
    """
    if clock.bads:
        rows = [k + first_row for k in clock.bad]
        yield rule.finding(file, rows, ["time"], f"{clock.bads} time stamps are not finite numbers", severity)
    if clock.backs:
        a, b = clock.at_back
        text = f"time steps back {clock.backs} times, first from {a:g} s to {b:g} s"
        yield rule.finding(file, [k + first_row for k in clock.back], ["time"], text, severity)
    if clock.repeats:
        text = f"{clock.repeats} time stamps repeat the one before, from {clock.at_repeat:g} s on"
        shown = int(digits(clock.around).max())
        few = shown <= rule.limits["digits"]
        text += f": the column is printed with {shown} significant digits" if few else ""
        yield rule.finding(file, [k + first_row for k in clock.repeat], ["time"], text, severity)


@check("convergence")
def unsettled(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Histories whose reduction did not converge, one finding a file."""
    files: dict[str, list[Reduced]] = {}
    for one in evidence.histories:
        if not one.fit.converged:
            files.setdefault(one.file, []).append(one)
    for file, group in files.items():
        words = [f"run {one.run_id}, {one.fit.start:g}-{one.fit.end:g} s: {one.fit.verdict}" for one in group]
        channels = dict.fromkeys(w.split(":")[0] for one in group for w in one.fit.verdict.split("; ") if ":" in w)
        concerned = evidence.runs["run_id"].isin([name for one in group for name in one.runs])
        known = bool(concerned.any() and declared(evidence, evidence.runs[concerned]).all())
        yield rule.finding(file, [], list(channels), "; ".join(words), milder(rule, known))


@check("channels")
def samples_left_out(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """What was left out of each history, and channels that are clipped; one finding a file."""
    for one in evidence.histories:
        if one.left_out:
            words = [f"{n} {kind} samples of {name}" for (kind, name), n in one.left_out.items()]
            channels = list(dict.fromkeys(name for _, name in one.left_out))
            share = sum(one.left_out.values()) / max(one.samples, 1)
            severe = "error" if share > rule.limits["share"] else rule.severity
            what = f"run {one.run_id}: {', '.join(words)} of {one.samples} are no measurements and left out"
            yield rule.finding(one.file, [], channels, what, severe)
        for name, text in one.clipped.items():
            yield rule.finding(one.file, [], [name], f"run {one.run_id}: {name} is clipped, {text}", "error")


@check("motion")
def another_frequency(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Oscillations whose record contradicts the stated frequency."""
    for one in evidence.histories:
        if one.stated_hz is not None and one.line is not None:
            name = one.loads[one.line.channel]
            what = f"run {one.run_id}: {one.stated_hz:g} Hz stated, {name} oscillates at {one.line.frequency:.6g} +- "
            what += f"{one.line.stderr:.1g} Hz, which was used"
            yield rule.finding(one.file, [], [name], what)


@check("motion")
def a_phase_that_nothing_says(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Oscillations whose displacement is not measured, and whose phase at time zero is not stated."""
    for one in evidence.histories:
        if one.phase_taken:
            what = f"no phase of run {one.run_id} is measured or stated: the displacement is taken to be zero at "
            what += "time zero, and what that is off by turns damping into added mass"
            yield rule.finding(one.file, [], ["time"], what)


@check("motion")
def a_phase_that_leaps(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Oscillations that do not go on in the phase in which they began: no one frequency and phase fits them."""
    for one in evidence.histories:
        if one.leap is None or one.line is None or one.leap.degrees < rule.limits["leap"]:
            continue
        name = one.loads[one.line.channel]
        what = (
            f"run {one.run_id}: the phase of {name} leaps by {one.leap.degrees:.0f} deg about {one.leap.time:.4g} s: "
        )
        what += "a clock that jumped, samples that are lost, or runs behind each other in one file"
        severe = "error" if one.leap.degrees > rule.limits["torn"] else rule.severity
        yield rule.finding(one.file, [], ["time", name], what, severe)


@check("delay")
def behind_the_motion(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Loads and measured rates that come behind the displacement by more than is stated."""
    for one in evidence.histories:
        cycle = one.line.frequency if one.line is not None else 0.0
        for late in one.delays:
            least = max(rule.limits["errors"] * late.stderr, rule.limits["cycle"] / max(cycle, 1e-9))
            if abs(late.seconds) > least:
                side = "behind" if late.seconds > 0.0 else "ahead of"
                size = f"{abs(late.seconds):.3g} +- {late.stderr:.1g} s"
                what = f"run {one.run_id}: {late.what} {size} {side} the displacement"
                yield rule.finding(one.file, [], late.what.removeprefix("the loads ").split(), what)


@check("moment_point")
def point_that_may_stay(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Moments of a body that moves along an axis, where nothing says whether their point goes with it."""
    for one in evidence.histories:
        for arm in one.left_behind:
            verdict = arm.verdict(rule.limits["errors"])
            if abs(arm.in_phase) <= rule.limits["share"] * arm.own or verdict == "goes":
                continue
            stays = f"a point that stays while the body moves in {arm.motion} has {arm.force} times the displacement "
            stays += f"in it, in phase {abs(arm.in_phase):.3g} N m beside {arm.own:.3g}"
            if verdict:
                shown = f"{arm.shown:.3g} of {arm.third:.3g} N m"
                what = f"the point of {arm.moment} stays, as its third harmonic shows ({shown}): {stays}"
            else:
                what = f"does the point of {arm.moment} go with the body? Nothing says it, nor does the record: {stays}"
            asked = "warning" if abs(arm.in_phase) > rule.limits["asked"] * arm.own else "info"
            yield rule.finding(one.file, [], [arm.moment], what, "" if verdict else asked)
