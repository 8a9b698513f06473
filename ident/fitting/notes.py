"""Notes of a fit, warnings and unused loads, gathered for people."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from ident.identification.noted import FitWarning, UnusedLoad
from sim.boat.delta_log import Version

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\w)")
_BLANK = "\N{HORIZONTAL ELLIPSIS}"


@dataclass
class WarningGroup:
    """Warnings that say the same but for a number.

    Attributes
    ----------
    text : The message, its numbers left out.
    count : How often it was given.
    lowest, highest : Range of the first number left out, None where there is none.
    subjects : Runs or coefficients it was said of, each once.
    """

    text: str
    count: int = 0
    lowest: float | None = None
    highest: float | None = None
    subjects: list[str] = field(default_factory=list)

    @property
    def numbers(self) -> str:
        """The range of the first number left out, empty where there is none."""
        if self.lowest is None or self.highest is None:
            return ""
        ends = dict.fromkeys(f"{n:.3g}" for n in (self.lowest, self.highest))
        return " to ".join(ends)

    @property
    def shown(self) -> str:
        """The message with the range in place of the first number."""
        return self.text.replace(_BLANK, self.numbers, 1)


@dataclass
class UnusedGroup:
    """Loads left out of one file for one reason: run id -> load components."""

    file: str
    reason: str
    runs: dict[str, list[str]] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of loads."""
        return sum(len(outputs) for outputs in self.runs.values())


def stored_warnings(commit: Version) -> list[FitWarning]:
    """The warnings that a commit carries."""
    return [FitWarning(str(subject), str(message)) for subject, message in commit.stored("warnings", [])]


def stored_unused(commit: Version) -> list[UnusedLoad]:
    """The unused loads that a commit carries."""
    every = commit.stored("unused", [])
    return [UnusedLoad(str(run), str(file), row, str(load), str(why)) for run, file, row, load, why in every]


def group_warnings(warnings: Iterable[FitWarning]) -> list[WarningGroup]:
    """Warnings by their text, in order of appearance."""
    groups: dict[str, WarningGroup] = {}
    for one in warnings:
        text = _NUMBER.sub(_BLANK, one.message)
        numbers = [float(n) for n in _NUMBER.findall(one.message)]
        group = groups.setdefault(text, WarningGroup(text))
        group.count += 1
        if numbers:
            group.lowest = min(numbers[0], group.lowest if group.lowest is not None else numbers[0])
            group.highest = max(numbers[0], group.highest if group.highest is not None else numbers[0])
        group.subjects.append(one.subject)
    for group in groups.values():
        group.subjects = list(dict.fromkeys(group.subjects))
    return list(groups.values())


def group_unused(unused: Iterable[UnusedLoad]) -> list[UnusedGroup]:
    """Unused loads by file and reason."""
    groups: dict[tuple[str, str], UnusedGroup] = {}
    for one in unused:
        group = groups.setdefault((one.file, one.reason), UnusedGroup(one.file, one.reason))
        group.runs.setdefault(one.run_id, []).append(one.output)
    return list(groups.values())
