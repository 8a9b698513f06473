"""A fit on one screen: what was used, what was left out and why, and the few findings that matter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ident.checks.summary import NARROW, counted, cut, lines
from ident.fitting.notes import group_unused, group_warnings

if TYPE_CHECKING:
    import pandas as pd

    from ident.checks.findings import Finding
    from ident.fitting.coefficients import CoefficientSummary
    from ident.identification.identify import Identification

# Lines of each part; together with the rest they fit a screen of 24.
_REASONS, _NOTES, _FINDINGS = 4, 3, 6
_NAMES = 6


def summary(
    identification: Identification,
    rows: pd.DataFrame,
    findings: Sequence[Finding],
    table: list[CoefficientSummary],
    last: str,
    width: int,
) -> list[tuple[str, str]]:
    """Style and text of every line.

    Parameters
    ----------
    identification, rows, findings : Of the fit.
    table : Its coefficients, one row each.
    last : The last line: what was committed.
    width : Of the screen.
    """
    width, campaign = max(width, NARROW), identification.campaign
    used = {r for n in identification.nodes for r in n.runs}
    out = [("bold", cut(f"{campaign.vehicle.title}: {campaign.header.name}", width))]
    origins = ", ".join(f"{n} {word}" for word, n in rows["origin"].value_counts().items())
    out.append(("", cut(f"{len(used)} of {len(campaign.runs)} runs used; {len(table)} coefficients, {origins}", width)))
    out += [("", cut(f"  {line}", width)) for line in _known(table)]
    out += _left_out(identification, width)
    groups = sorted(group_warnings(identification.warnings), key=lambda g: -g.count)
    if groups:
        out.append(("", f"notes of the fit: {sum(g.count for g in groups)}"))
        out += [("yellow", cut(f"  {g.count}x {g.shown}", width)) for g in groups[:_NOTES]]
    out += [("", cut(f"  {one.words()}", width)) for one in identification.between if one.tau > 0.0]
    out.append(("", f"quality checks: {counted(findings)}"))
    serious = [f for f in findings if f.severity != "info"]
    colours = {"error": "red", "warning": "yellow"}
    out += [(colours.get(s, ""), "  " + text) for s, text in lines(serious, width - 2, _FINDINGS)]
    out.append(("bold", last))
    return out


def _known(table: list[CoefficientSummary]) -> list[str]:
    """The coefficients that are known worst, and those whose runs disagree most."""
    errors = {one.coefficient: one.median_relative_error or math.nan for one in table}
    loose = sorted((name for name, error in errors.items() if math.isfinite(error)), key=lambda n: -errors[n])[:_NAMES]
    apart = sorted((one for one in table if one.worst_residual > 2.0), key=lambda one: -one.worst_residual)[:_NAMES]
    said = []
    if loose:
        named = ", ".join(f"{name} {100 * errors[name]:.0f} %" for name in loose)
        said.append(f"largest standard errors: {named}")
    if apart:
        named = ", ".join(f"{one.coefficient} {one.worst_residual:.1f} s.e." for one in apart)
        said.append(f"runs that disagree most: {named}")
    return said


def _left_out(identification: Identification, width: int) -> list[tuple[str, str]]:
    """Loads that were not used, by reason."""
    reasons: dict[str, tuple[int, set[str], set[str]]] = {}
    for left in group_unused(identification.unused):
        count, runs, files = reasons.get(left.reason, (0, set(), set()))
        reasons[left.reason] = (count + left.count, runs | set(left.runs), files | {left.file})
    if not reasons:
        return []
    total = sum(count for count, _, _ in reasons.values())
    out = [("", f"{total} loads left out, with the reason:")]
    every = sorted(reasons.items(), key=lambda item: -item[1][0])
    shown = every if len(every) <= _REASONS else every[: _REASONS - 1]
    for reason, (count, runs, files) in shown:
        where = next(iter(files)) if len(files) == 1 else f"{len(files)} files"
        out.append(("", cut(f"  {count} of {len(runs)} runs, {where}: {reason}", width)))
    if len(every) > len(shown):
        more = sum(count for _, (count, _, _) in every[len(shown) :])
        out.append(("", f"  {more} for {len(every) - len(shown)} more reasons (--json, ident report)"))
    return out
