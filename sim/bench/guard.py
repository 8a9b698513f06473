"""Recorded times and ratios, and whether today's ratios have fallen behind them.

Times are those of one machine. Ratios hold on any: a column ``better`` says which way.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

# A ratio may be this much worse than recorded, for the noise of a shared machine.
SLACK = 0.25
_FILE = Path(__file__).with_name("recorded.csv")


class Line(NamedTuple):
    """One number: its name, what it is, unit, which way is better (empty: a time), recorded value."""

    name: str
    label: str
    unit: str
    better: str
    value: float


def recorded() -> list[Line]:
    """The lines of ``recorded.csv``."""
    with _FILE.open(encoding="utf-8", newline="") as stream:
        return [Line(r["name"], r["label"], r["unit"], r["better"], float(r["value"])) for r in csv.DictReader(stream)]


def record(measured: dict[str, float]) -> None:
    """Write the numbers of a run into ``recorded.csv`` of this checkout; others stay."""
    lines = [line._replace(value=measured.get(line.name, line.value)) for line in recorded()]
    with _FILE.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(Line._fields)
        writer.writerows((*line[:4], f"{line.value:.3g}") for line in lines)


def fallen(measured: dict[str, float]) -> list[str]:
    """What is worse than recorded by more than a quarter, one line each."""
    lines = []
    for line in recorded():
        if not line.better:
            continue
        now = measured[line.name]
        if line.name == "batch_efficiency" and "free_cores" in measured:
            # Other work on the machine takes its share of the cores, and two threads of one core are not two.
            now *= measured["cores"] / measured["free_cores"]
        gain = now / line.value if line.better == "more" else line.value / now
        if not gain >= 1.0 - SLACK:
            lines.append(f"{line.name}: {now:.3g}, recorded {line.value:.3g}; {line.better} is better")
    return lines
