"""What a fit gave of each coefficient: how many values, from how many runs, how well known."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class CoefficientSummary:
    """One coefficient of a fit.

    Attributes
    ----------
    coefficient : Symbol.
    points : Tabulated values.
    measured : Those of them from runs, or from published coefficients.
    runs : Runs behind them.
    estimated : Values that an estimate gave or changed.
    median_relative_error : Median of standard errors over values that are not zero; None without such a value.
    worst_residual : Largest disagreement of runs at one point, in standard errors.
    quality : Quality word -> values that are not zero with it.
    """

    coefficient: str
    points: int
    measured: int
    runs: int
    estimated: int
    median_relative_error: float | None
    worst_residual: float
    quality: dict[str, int]


def coefficient_summaries(rows: pd.DataFrame) -> list[CoefficientSummary]:
    """One entry a coefficient of database rows, in their order."""
    return [_summary(str(name), group) for name, group in rows.groupby("coefficient", sort=False)]


def _summary(name: str, group: pd.DataFrame) -> CoefficientSummary:
    from_runs = group[group["origin"].isin(["measured", "published"])]
    counted = from_runs if not from_runs.empty else group
    counted = counted[counted["value"] != 0.0]
    return CoefficientSummary(
        coefficient=name,
        points=len(group),
        measured=len(from_runs),
        runs=len({r for text in group["runs"] for r in text.split()}),
        estimated=int(group["estimated_by"].ne("").sum()),
        median_relative_error=None if counted.empty else float((counted["stderr"] / counted["value"].abs()).median()),
        worst_residual=float(group["worst_residual"].max()),
        quality=dict(Counter(q for q in counted["quality"] if q)),
    )
