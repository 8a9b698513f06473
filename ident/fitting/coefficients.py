"""What a fit gave of each coefficient: how many values, from how many runs, how well known."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sim.files.columns import places_of

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
    of_runs = rows["origin"].isin(["measured", "published"]).to_numpy(dtype=bool)
    estimated = rows["estimated_by"].ne("").to_numpy(dtype=bool)
    value, stderr, worst = (rows[c].to_numpy(dtype=float) for c in ("value", "stderr", "worst_residual"))
    runs, quality = rows["runs"].to_numpy(object), rows["quality"].to_numpy(object)
    summaries = []
    for name, group in places_of(rows["coefficient"].tolist()).items():
        counted = group[of_runs[group]] if of_runs[group].any() else group
        counted = counted[value[counted] != 0.0]
        relative = stderr[counted] / np.abs(value[counted])
        summaries.append(
            CoefficientSummary(
                coefficient=name,
                points=len(group),
                measured=int(of_runs[group].sum()),
                runs=len({r for text in set(runs[group]) for r in text.split()}),
                estimated=int(estimated[group].sum()),
                median_relative_error=float(np.nanmedian(relative)) if counted.size else None,
                worst_residual=float(np.fmax.reduce(worst[group])),
                quality=dict(Counter(q for q in quality[counted] if q)),
            )
        )
    return summaries
