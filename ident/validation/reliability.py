"""How often references lie where bands say, over every case and level, and intervals of metrics.

A band that holds says of the share of a reference inside it what its level promises: half of the samples of a
reference in the 50 % band, nineteen of twenty in the 95 % band (Gneiting, Balabdaoui and Raftery 2007, J. R.
Statist. Soc. B 69, calibration). Shares are means over channels, so that a long record counts as a short one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ident.metrics.metric import Interval, Metric, Metrics
from ident.output import whole
from ident.validation.bands import LEVELS, Bands
from sim.flight.case import Case
from sim.flight.series import Series

if TYPE_CHECKING:
    from rich.console import Console

Array = NDArray[np.float64]

# Levels of the reliability diagram.
_LEVELS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
_QUANTILES = (0.025, 0.5, 0.975)


@dataclass(frozen=True)
class Reliability:
    """A point of the reliability diagram.

    Attributes
    ----------
    level : Of a central band, 0 to 1.
    share : Of the references that lie inside it, 0 to 1.
    """

    level: float
    share: float


def mean_shares(inside: Iterable[dict[str, Any]]) -> dict[str, float] | None:
    """Mean share inside each band over references.

    Parameters
    ----------
    inside : ``ident.validation.bands.inside`` of each case: source -> channel -> level -> share.

    Returns
    -------
    ``{"50": share, "95": share}``; None without a reference.

    Example
    -------
    >>> mean_shares([{"EXP": {"psi": {"50": 0.4, "95": 1.0}, "u": {"50": 0.6, "95": 0.9}}}])
    {'50': 0.5, '95': 0.95}
    """
    entries = [e for case in inside for channels in case.values() for e in channels.values()]
    if not entries:
        return None
    return {level: float(np.mean([e[level] for e in entries])) for level in LEVELS}


def ranks(bands: Bands, case: Case, reference: Series) -> list[Array]:
    """Share of the samples below each point of each reference channel, one array a channel."""
    below_each = []
    for source in case.reference.compare if case.reference else []:
        channels = bands.of(source)
        for channel in case.reference.channels if case.reference else []:
            if channel not in reference[source]:
                continue
            time, value = reference[source][channel].abscissa, reference[source][channel].value
            if reference.abscissa == "s":
                time = np.interp(time, np.nanmedian(channels["s"], axis=0), bands.time)
            flown = np.stack([np.interp(time, bands.time, one) for one in channels[channel]])
            known = np.isfinite(flown)
            below = np.where(known, flown < value, False).sum(axis=0)
            counted = known.sum(axis=0)
            below_each.append(below[counted > 0] / counted[counted > 0])
    return [one for one in below_each if one.size]


def reliability(rank_sets: Iterable[Array]) -> list[Reliability]:
    """Share of references inside the central band of each level.

    Parameters
    ----------
    rank_sets : From ``ranks``, of any number of cases.

    Returns
    -------
    One point a level; empty without a reference.
    """
    channels = list(rank_sets)
    if not channels:
        return []
    return [
        Reliability(level, float(np.mean([np.mean(np.abs(2.0 * r - 1.0) <= level) for r in channels])))
        for level in _LEVELS
    ]


def metric_intervals(bands: Bands) -> dict[str, Interval]:
    """Quantiles of every metric over the samples."""
    names = list(dict.fromkeys(name for one in bands.metrics for name in one))
    intervals = {}
    for name in names:
        known = np.array([x for x in (one.get(name) for one in bands.metrics) if x is not None], dtype=float)
        known = known[np.isfinite(known)]
        low, middle, high = (float(np.quantile(known, q)) if known.size else None for q in _QUANTILES)
        intervals[name] = Interval(low, middle, high, without=1.0 - known.size / len(bands.metrics))
    return intervals


def with_intervals(metrics: Metrics, bands: Bands) -> Metrics:
    """Metrics with the intervals beside what was simulated; one that no sample comes to has an unknown one."""
    intervals = metric_intervals(bands)
    unknown = Metric({"simulated": None})
    return {
        name: replace(metrics.get(name, unknown), interval=intervals.get(name, Interval()))
        for name in dict.fromkeys([*metrics, *intervals])
    }


def show_intervals(metrics: Metrics, console: Console) -> None:
    """Print metrics with their intervals."""
    from rich.table import Table

    table = Table("metric", "simulated", "2.5 %", "median", "97.5 %", title="Metrics over the samples")
    for name, metric in metrics.items():
        of = metric.interval
        if of:
            cells = (metric.simulated, of.q025, of.q50, of.q975)
            table.add_row(name, *["-" if x is None else f"{x:.4g}" for x in cells])
    if table.row_count:
        console.print(table)


def show_coverage(coverage: dict[str, float] | None, what: str, console: Console) -> None:
    """Print how much of the references lies in the bands."""
    if coverage:
        text = ", ".join(f"{100.0 * share:.0f} % in the {level} % band" for level, share in coverage.items())
        console.print(f"{what}: {text}", highlight=False)


def reliability_figure(points: list[Reliability], path: Path) -> Path:
    """Draw the reliability diagram; returns the file."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2, 4.2), layout="constrained")
    ax = figure.subplots()
    ax.plot([0, 1], [0, 1], color="0.6", lw=1, label="as the level promises")
    ax.plot([p.level for p in points], [p.share for p in points], "o-", label="references")
    ax.set(
        xlabel="level of the band", ylabel="share of the references inside", xlim=(0, 1), ylim=(0, 1), aspect="equal"
    )
    ax.legend(frameon=False)
    with whole(path) as part:
        figure.savefig(part, dpi=150)
    return path
