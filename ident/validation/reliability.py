"""How often references lie where bands say, over every case and level, and intervals of metrics.

A band that holds says of the share of a reference inside it what its level promises: half of the samples of a
reference in the 50 % band, nineteen of twenty in the 95 % band (Gneiting, Balabdaoui and Raftery 2007, J. R.
Statist. Soc. B 69, calibration). Shares are means over channels, so that a long record counts as a short one.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ident.metrics.measure import Columns
from ident.validation.bands import LEVELS, Bands
from sim.flight.case import Case
from sim.flight.series import Series

if TYPE_CHECKING:
    from rich.console import Console

Array = NDArray[np.float64]

# Levels of the reliability diagram.
_LEVELS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
QUANTILES = {"q025": 0.025, "q50": 0.5, "q975": 0.975}


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
    found = []
    for source in case.reference.compare if case.reference else []:
        channels = bands.own.get(source, bands.channels)
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
            found.append(below[counted > 0] / counted[counted > 0])
    return [one for one in found if one.size]


def reliability(found: Iterable[Array]) -> list[dict[str, float]]:
    """Share of references inside the central band of each level.

    Parameters
    ----------
    found : From ``ranks``, of any number of cases.

    Returns
    -------
    ``level`` and ``share``, both 0 to 1; empty without a reference.
    """
    channels = list(found)
    if not channels:
        return []
    return [
        {"level": level, "share": float(np.mean([np.mean(np.abs(2.0 * r - 1.0) <= level) for r in channels]))}
        for level in _LEVELS
    ]


def metric_intervals(bands: Bands) -> dict[str, dict[str, float | None]]:
    """Quantiles of every metric over the samples.

    Returns
    -------
    Metric -> ``q025``, ``q50``, ``q975`` over the samples that have it (None where none has), and ``without``, the
    share of samples that do not come to it.
    """
    names = list(dict.fromkeys(name for one in bands.metrics for name in one))
    table: dict[str, dict[str, float | None]] = {}
    for name in names:
        known = np.array([x for x in (one.get(name) for one in bands.metrics) if x is not None], dtype=float)
        known = known[np.isfinite(known)]
        quantiles = {k: float(np.quantile(known, q)) if known.size else None for k, q in QUANTILES.items()}
        table[name] = {**quantiles, "without": 1.0 - known.size / len(bands.metrics)}
    return table


def with_intervals(metrics: Columns, bands: Bands) -> Columns:
    """Metrics with the quantiles beside what was simulated, metric by metric."""
    quantiles = metric_intervals(bands)
    empty: dict[str, float | None] = {"simulated": None}
    # A metric that no sample comes to has its quantiles too, unknown.
    unknown: dict[str, float | None] = dict.fromkeys(QUANTILES) | {"without": 1.0}
    names = dict.fromkeys([*metrics, *quantiles])
    return {name: metrics.get(name, empty) | quantiles.get(name, unknown) for name in names}


def show_intervals(metrics: dict[str, dict[str, Any]], console: Console) -> None:
    """Print metrics with their intervals."""
    from rich.table import Table

    table = Table("metric", "simulated", "2.5 %", "median", "97.5 %", title="Metrics over the samples")
    for name, values in metrics.items():
        if "q50" in values:
            cells = [values.get("simulated"), *[values[k] for k in QUANTILES]]
            table.add_row(name, *["-" if x is None else f"{x:.4g}" for x in cells])
    if table.row_count:
        console.print(table)


def show_coverage(coverage: dict[str, float] | None, what: str, console: Console) -> None:
    """Print how much of the references lies in the bands."""
    if coverage:
        text = ", ".join(f"{100.0 * share:.0f} % in the {level} % band" for level, share in coverage.items())
        console.print(f"{what}: {text}", highlight=False)


def reliability_figure(points: list[dict[str, float]], path: Path) -> Path:
    """Draw the reliability diagram; returns the file."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2, 4.2), layout="constrained")
    ax = figure.subplots()
    ax.plot([0, 1], [0, 1], color="0.6", lw=1, label="as the level promises")
    ax.plot([p["level"] for p in points], [p["share"] for p in points], "o-", label="references")
    ax.set(
        xlabel="level of the band", ylabel="share of the references inside", xlim=(0, 1), ylim=(0, 1), aspect="equal"
    )
    ax.legend(frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
    return path
