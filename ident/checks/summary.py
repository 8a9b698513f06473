"""Findings on one screen: counted by check, the worst first, a line each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ident.checks.findings import SEVERITIES, Finding

# Lines of findings on a screen of 24 lines, and the narrowest screen.
MOST = 9
NARROW = 60


def cut(text: str, width: int) -> str:
    """A text on one line of a width, with three dots where it goes on."""
    indent = len(text) - len(text.lstrip(" "))
    one = " " * indent + " ".join(str(text).split())
    return one if len(one) <= width else one[: max(width - 3, 1)].rstrip() + "..."


def counted(findings: Iterable[Finding]) -> str:
    """``1 error, 6 warning, 0 info``."""
    every = list(findings)
    return ", ".join(f"{sum(f.severity == s for f in every)} {s}" for s in reversed(SEVERITIES))


def lines(findings: Sequence[Finding], width: int, most: int = MOST) -> list[tuple[str, str]]:
    """The findings by check and severity, with where and what of the first of each.

    Parameters
    ----------
    findings : Errors first.
    width : Of the screen.
    most : Lines at most.

    Returns
    -------
    Severity and line; a last one, without a severity, says how many checks are not shown.
    """
    width = max(width, NARROW)
    groups: dict[tuple[str, str], list[Finding]] = {}
    for one in findings:
        groups.setdefault((one.severity, one.check), []).append(one)
    shown: list[tuple[str, str]] = []
    rest = list(groups.items())
    while rest and len(shown) < most - (len(rest) > 1):
        (severity, name), group = rest.pop(0)
        first = group[0]
        rows = f" row {first.shown_rows}" if first.rows and len(first.shown_rows) < 12 else ""
        times = f" x{len(group)}" if len(group) > 1 else ""
        text = f"{severity:7} {name}{times}: {cut(first.file, 32)}{rows}: {first.what}"
        shown.append((severity, cut(text, width)))
        if severity == "error" and len(shown) < most - (len(rest) > 0):
            shown.append(("", cut(f"        -> {first.remedy}", width)))
    if rest:
        more = sum(len(group) for _, group in rest)
        shown.append(("", cut(f"and {more} findings of {len(rest)} more checks", width)))
    return shown
