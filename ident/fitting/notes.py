"""Notes of a fit, warnings and unused loads, gathered for people."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

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


def group_warnings(warnings: Iterable[Any]) -> list[WarningGroup]:
    """Warnings (subject, message) by their text, in order of appearance."""
    groups: dict[str, WarningGroup] = {}
    for subject, message in warnings:
        text = _NUMBER.sub(_BLANK, str(message))
        numbers = [float(n) for n in _NUMBER.findall(str(message))]
        group = groups.setdefault(text, WarningGroup(text))
        group.count += 1
        if numbers:
            group.lowest = min(numbers[0], group.lowest if group.lowest is not None else numbers[0])
            group.highest = max(numbers[0], group.highest if group.highest is not None else numbers[0])
        group.subjects.append(str(subject))
    for group in groups.values():
        group.subjects = list(dict.fromkeys(group.subjects))
    return list(groups.values())


def group_unused(unused: Iterable[Any]) -> list[UnusedGroup]:
    """Unused loads (run_id, file, row, output, reason) by file and reason."""
    groups: dict[tuple[str, str], UnusedGroup] = {}
    for run, file, _, output, reason in unused:
        group = groups.setdefault((str(file), str(reason)), UnusedGroup(str(file), str(reason)))
        group.runs.setdefault(str(run), []).append(str(output))
    return list(groups.values())
