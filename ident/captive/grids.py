"""The discretisation error of loads that were computed on three grids."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import pandas as pd

from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError


@cache
def rules() -> dict[str, float]:
    """Numbers of ``data/grid_convergence.csv`` by name."""
    with (files("ident") / "data" / "grid_convergence.csv").open(encoding="utf-8") as stream:
        return {row["name"]: float(row["value"]) for row in csv.DictReader(stream)}


@dataclass(frozen=True)
class Convergence:
    """How a load goes with the grid.

    Attributes
    ----------
    kind : ``monotonic``, ``oscillatory`` or ``none``.
    order : Observed order of a monotonic convergence, between its limits; NaN for the others.
    uncertainty : At 95 per cent.
    """

    kind: str
    order: float
    uncertainty: float

    @property
    def stderr(self) -> float:
        """Standard error of the load on the finest grid."""
        return self.uncertainty / rules()["coverage"]


def convergence(fine: float, medium: float, coarse: float, refinement: float) -> Convergence:
    """Discretisation error of the finest of three grids by generalised Richardson extrapolation.

    With e21 = medium - fine, e32 = coarse - medium and R = e21 / e32 (ITTC 7.5-03-01-01, 2008, section 4.2):

    * 0 < R < 1, monotonic: p = ln(1/R) / ln r, delta = e21 / (r^p - 1), U = F |delta| (the grid convergence
      index, Roache 1998). An order above the formal one counts as that; below the least that is believed,
      it is as without convergence.
    * R < 0, oscillatory, and |R| < 1: U is half the distance between the largest and the least value.
    * otherwise no convergence: U is the distance between the largest and the least value times the factor of
      safety of the doubtful (Eca and Hoekstra 2014).

    Parameters
    ----------
    fine, medium, coarse : The load on the three grids.
    refinement : Ratio r of cell lengths between successive grids.

    Returns
    -------
    Convergence

    Examples
    --------
    Exact solution 1 and an error of second order, 0.01 on the finest grid:

    >>> found = convergence(1.01, 1.04, 1.16, 2.0)
    >>> found.kind, round(found.order, 6), round(found.uncertainty, 6)
    ('monotonic', 2.0, 0.0125)
    """
    rule = rules()
    e21, e32 = medium - fine, coarse - medium
    spread = max(fine, medium, coarse) - min(fine, medium, coarse)
    if e21 == 0.0:
        # Two grids agree to the last digit: what is left is the step to the third, had it gone on.
        return Convergence("monotonic", rule["order"], rule["safety"] * abs(e32) / (refinement ** rule["order"] - 1.0))
    ratio = e21 / e32 if e32 != 0.0 else math.inf
    if 0.0 < ratio < 1.0:
        observed = math.log(1.0 / ratio) / math.log(refinement)
        if observed >= rule["least_order"]:
            order = min(observed, rule["order"])
            return Convergence("monotonic", order, rule["safety"] * abs(e21) / (refinement**order - 1.0))
    if -1.0 < ratio < 0.0:
        return Convergence("oscillatory", math.nan, 0.5 * spread)
    return Convergence("none", math.nan, rule["safety_doubtful"] * spread)


def with_discretisation(
    table: pd.DataFrame, coarser: Sequence[pd.DataFrame], refinement: float, where: str
) -> pd.DataFrame:
    """Runs of the finest grid, the discretisation error added in squares to their standard errors.

    Parameters
    ----------
    table : Runs of the finest grid.
    coarser : The same runs on the two coarser grids.
    refinement : Ratio of cell lengths between successive grids.
    where : For the error.

    Raises
    ------
    InputError
        When the grids do not give the same runs.
    """
    out = table.copy()
    medium, coarse = coarser
    if list(medium["run_id"]) != list(table["run_id"]) or list(coarse["run_id"]) != list(table["run_id"]):
        raise InputError(where, "other runs on the coarser grids", "the same runs on the three grids")
    told: list[list[str]] = [[] for _ in range(len(out))]
    for output in (o for o in OUTPUTS if o in out):
        errors = []
        for i, (a, b, c) in enumerate(zip(out[output], medium[output], coarse[output], strict=True)):
            converged = convergence(float(a), float(b), float(c), refinement)
            statistical = float(out[f"s_{output}"].iloc[i]) if f"s_{output}" in out else 0.0
            errors.append(math.hypot(statistical, converged.stderr))
            order = f" of order {converged.order:.2g}" if converged.kind == "monotonic" else ""
            told[i].append(f"{output} {converged.kind}{order} +- {converged.stderr:.3g}")
        out[f"s_{output}"] = errors
    both = zip(out["reduction"], told, strict=True)
    out["reduction"] = [f"{text}; grids: {', '.join(of_run)}" for text, of_run in both]
    return out
