"""The quality checks of a campaign folder, for a notebook and for ``ident check``."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.captive.campaign import Campaign, find_campaigns, read_campaign
from ident.captive.combine import by_vehicle
from ident.checks.check import check_campaign
from ident.checks.findings import SEVERITIES, Finding
from ident.output import Results, html_table

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd


@dataclass(frozen=True)
class Checked:
    """What the quality checks found in one campaign.

    Attributes
    ----------
    campaign : As read; histories whose time stamps do not rise are left out and found.
    findings : Errors first.

    Examples
    --------
    >>> import ident
    >>> (checked,) = ident.check("my-boat/captive")
    >>> checked.counts
    {'error': 0, 'warning': 6, 'info': 0}
    """

    campaign: Campaign
    findings: tuple[Finding, ...]

    @property
    def counts(self) -> dict[str, int]:
        """Number of findings by severity, the worst first."""
        return {s: sum(f.severity == s for f in self.findings) for s in reversed(SEVERITIES)}

    @property
    def table(self) -> pd.DataFrame:
        """One row a finding: check, severity, file, rows, columns, what, remedy."""
        import pandas as pd

        return pd.DataFrame([f.as_json() for f in self.findings], columns=list(Finding.__dataclass_fields__))

    def to_dict(self) -> dict[str, Any]:
        """The findings for a program to read."""
        return {"campaign": self.campaign.header.name, "findings": [f.as_json() for f in self.findings]}

    def __repr__(self) -> str:
        return f"Checked({self.campaign.header.name}: {', '.join(f'{n} {word}' for word, n in self.counts.items())})"

    def _repr_html_(self) -> str:
        header = ("severity", "check", "file", "rows", "what", "remedy")
        rows = [(f.severity, f.check, f.file, f.shown_rows, f.what, f.remedy) for f in self.findings]
        return html_table(f"{self.campaign.header.name}: {len(self.campaign.runs)} runs", header, rows)


def check(folder: str | os.PathLike[str], each: Callable[[str], None] = lambda text: None) -> Results[Checked]:
    """Quality checks of every campaign at or below a folder.

    Copies, slips of sign and unit, outliers, levers, inertia, missing tests: see the page on
    quality checks for each, its limits, and what they rest on.

    Parameters
    ----------
    folder : Campaign folder, or a folder of campaign folders.
    each : Called with the folder that is being checked.

    Returns
    -------
    Results of Checked
        One a vehicle, in folder order: several campaigns of one are looked at together.

    Raises
    ------
    InputError
        For a campaign that cannot be read.

    Examples
    --------
    >>> import ident
    >>> for checked in ident.check("my-boat/captive"):
    ...     print(checked.campaign.header.name, [f.check for f in checked.findings if f.severity == "error"])
    my-boat-tank []
    """
    places = find_campaigns(Path(folder))
    every = []
    for path in places:
        each(str(path))
        every.append(read_campaign(path, leave_out=True))
    results = []
    for campaign, path in zip(*by_vehicle(every, places), strict=True):
        each(str(path))
        results.append(Checked(campaign, tuple(check_campaign(campaign, path))))
    return Results(results)
