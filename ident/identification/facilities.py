"""The error between facilities: what campaigns of one boat differ by beyond the errors they state.

Where runs of several campaigns give the same tabulated values, the load of campaign c is taken as
(1 + e_c) times the true one, e_c with variance tau^2. From the residuals r and fitted loads p of a
joint fit, e_c = sum(w r p) / sum(w p^2) with variance 1 / sum(w p^2); tau^2 is the moment estimator of
DerSimonian and Laird (1986), zero where the campaigns agree within their errors. With it every
load has s^2 + n tau^2 p^2, n being the campaign's loads of the same values, so that a campaign of
many runs is no better known than its facility; then the fit is done again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Left:
    """What a joint fit leaves of each load that it uses.

    Attributes
    ----------
    run : (n,) row of the run table.
    output : (n,) name of the load.
    fitted, residual, sigma : (n,) of the load.
    values : (n,) names of the tabulated values it is an equation for, as one text.
    """

    run: NDArray[np.int64]
    output: NDArray[np.object_]
    fitted: Array
    residual: Array
    sigma: Array
    values: NDArray[np.object_]


@dataclass(frozen=True)
class Between:
    """Relative error between facilities of one load component.

    Attributes
    ----------
    output : Load component.
    tau : Standard deviation of e_c.
    factors : Campaign -> (e_c, its standard error).
    excess : Q of DerSimonian and Laird over its degrees of freedom.
    """

    output: str
    tau: float
    factors: dict[str, tuple[float, float]]
    excess: float

    def words(self) -> str:
        """The estimate in one line."""
        shown = ", ".join(f"{name} {100 * e:+.2g} +- {100 * s:.1g} %" for name, (e, s) in self.factors.items())
        return f"{self.output}: between facilities {100 * self.tau:.2g} % (joint fit and {shown})"


def together(parts: Sequence[Left]) -> Left:
    """What all stages leave, as one."""
    names = ("run", "output", "fitted", "residual", "sigma", "values")
    if not parts:
        empty: Array = np.zeros(0)
        words = np.zeros(0, dtype=object)
        return Left(np.zeros(0, dtype=np.int64), words, empty, empty, empty, words)
    return Left(*(np.concatenate([getattr(one, n) for one in parts]) for n in names))


def between(left: Left, campaign: Sequence[str]) -> list[Between]:
    """The error between facilities of every load that several of them give.

    Parameters
    ----------
    left : Of a joint fit.
    campaign : (runs,) which campaign each run is of.
    """
    names = np.array(campaign, dtype=object)[left.run]
    table = pd.DataFrame({"c": names, "o": left.output, "v": left.values, "p": left.fitted, "r": left.residual})
    table["s"] = left.sigma
    shared = table.groupby(["o", "v"])["c"].transform("nunique") > 1
    table = table[shared & (table["p"] != 0.0) & (table["s"] > 0.0)]
    spread = []
    for output, group in table.groupby("o", sort=False):
        weight = 1.0 / group["s"] ** 2
        sums = pd.DataFrame({"a": weight * group["r"] * group["p"], "b": weight * group["p"] ** 2})
        per = sums.groupby(group["c"]).sum()
        if len(per) < 2:
            continue
        e, u = (per["a"] / per["b"]).to_numpy(), per["b"].to_numpy()
        mean = float((u * e).sum() / u.sum())
        q = float((u * (e - mean) ** 2).sum())
        spare = float(u.sum() - (u**2).sum() / u.sum())
        tau2 = max((q - (len(e) - 1)) / spare, 0.0) if spare > 0.0 else 0.0
        factors = {str(k): (float(x), float(y**-0.5)) for k, x, y in zip(per.index, e, u, strict=True)}
        spread.append(Between(str(output), tau2**0.5, factors, q / (len(e) - 1)))
    return spread


def widened(runs: pd.DataFrame, left: Left, between_facilities: list[Between]) -> pd.DataFrame:
    """Runs with the error between facilities in the standard errors of their loads."""
    tau = {one.output: one.tau for one in between_facilities if one.tau > 0.0}
    if not tau:
        return runs
    out = runs.copy()
    names = runs["campaign"].to_numpy(object)[left.run]
    count = pd.Series(1.0, index=range(len(left.run))).groupby([names, left.output, left.values]).transform("sum")
    for output, size in tau.items():
        of_output = left.output == output
        rows = left.run[of_output]
        wide = np.sqrt(left.sigma[of_output] ** 2 + count.to_numpy()[of_output] * (size * left.fitted[of_output]) ** 2)
        errors = out[f"s_{output}"].to_numpy(dtype=float, copy=True)
        errors[rows] = wide
        out[f"s_{output}"] = errors
    return out
