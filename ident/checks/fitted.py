"""Runs held against the coefficients that were fitted to them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pandas as pd

from ident.checks.findings import Evidence, Finding, Rule, check, declared, milder

if TYPE_CHECKING:
    from ident.identification.identify import Identification


def residuals(identified: Identification) -> pd.DataFrame:
    """Columns coefficient, part, worst (largest residual of its runs, in their standard errors) and run."""
    rows = [(n.name, n.part, n.worst, n.worst_run) for n in identified.nodes if n.worst_run]
    return pd.DataFrame(rows, columns=["coefficient", "part", "worst", "run"])


@check("residuals")
def left_by_the_fit(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Loads that the fit leaves by many of their own standard errors: a slip in a state, a load, or an error."""
    if evidence.fitted is None:
        return
    apart = evidence.fitted[evidence.fitted["worst"] > rule.limits["errors"]]
    runs = evidence.runs.drop_duplicates("run_id")
    for name, group in apart.groupby("run", sort=False):
        of_run = runs[runs["run_id"] == name]
        if of_run.empty:
            continue
        worst = group.sort_values("worst").iloc[-1]
        terms = ", ".join(dict.fromkeys(f"{c} ({p})" for c, p in zip(group["coefficient"], group["part"], strict=True)))
        what = f"{worst['coefficient'][0]} of run {name} is {worst['worst']:.1f} of its standard errors off the fit of "
        what += f"{terms}, whose other runs agree better"
        loads = list(dict.fromkeys(str(c)[0] for c in group["coefficient"]))
        known = bool(declared(evidence, of_run).all())
        yield rule.finding(str(of_run["file"].iloc[0]), of_run["row"], loads, what, milder(rule, known))
