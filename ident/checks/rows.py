"""Checks of rows beside the others of their file: what a reason is for, which part of the boat a run is of."""

from __future__ import annotations

from collections.abc import Iterator

from ident.captive.published import TEST as PUBLISHED
from ident.checks.findings import Evidence, Finding, Rule, check, rows_of, together


@check("rows")
def reasons_without_what_they_exclude(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Runs with a reason to leave a load out, and none left out: a column that was lost, or a row that was cut."""
    runs = evidence.runs
    if "reason" not in runs:
        return
    idle = runs[(runs["reason"].fillna("") != "") & (runs["exclude"].fillna("") == "")]
    for file, group in idle.groupby(together(idle), sort=False):
        first = group.iloc[0]
        what = f"{len(group)} runs, {first['run_id']} the first, have a reason ({str(first['reason'])[:60]}), and "
        what += "exclude nothing: every load of them is used"
        yield rule.finding(str(file), rows_of(group), ["exclude", "reason"], what)


@check("rows")
def a_run_of_another_part(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """One run of a part among many of one other part, in a test of one file: it is left out of that part's fit."""
    runs = evidence.runs
    tested = runs[runs["test"] != PUBLISHED]
    for (file, test), group in tested.groupby([together(tested), "test"], sort=False):
        counts = group["part"].value_counts()
        if len(counts) == 2 and counts.iloc[1] == 1 and counts.iloc[0] >= rule.limits["others"]:
            odd = group[group["part"] == counts.index[1]]
            what = f"run {odd['run_id'].iloc[0]} is of part {counts.index[1]}, the {counts.iloc[0]} others of {test} "
            what += f"are of {counts.index[0]}"
            yield rule.finding(str(file), rows_of(odd), ["part"], what)
