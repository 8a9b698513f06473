"""`ident fit`: read a campaign, identify, commit one version, say what was done."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.captive.campaign import Campaign, find_campaigns, read_campaign
from ident.checks.check import check_campaign, refuse_errors
from ident.checks.check import table as findings_table
from ident.checks.findings import Finding
from ident.database.lock import WAIT
from ident.database.provenance import conversions
from ident.database.store import commit, database_rows, digest
from ident.fitting.notes import group_unused, group_warnings
from ident.identification.identify import Identification, identify
from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

_UNUSED = ("run_id", "file", "row", "output", "reason")


@dataclass(frozen=True)
class Fit:
    """One fitted campaign.

    Attributes
    ----------
    campaign, found : What was read and identified.
    rows : The database rows.
    version : Version that holds them.
    new : False when the latest version held them already.
    digest : Content digest.
    findings : Of the quality checks, errors first.
    """

    campaign: Campaign
    found: Identification
    rows: pd.DataFrame
    version: int
    new: bool
    digest: str
    findings: list[Finding]

    def summary(self) -> dict[str, Any]:
        """What a machine wants to know of the fit."""
        return {
            "campaign": self.campaign.header.name,
            "vehicle": self.campaign.vehicle.name,
            "version": self.version,
            "new": self.new,
            "digest": self.digest,
            "runs": len(self.campaign.runs),
            "conversions": conversions(self.campaign),
            "coefficients": coefficient_table(self.rows),
            "unused": [dict(zip(_UNUSED, u, strict=True)) for u in self.found.unused],
            "warnings": [{"subject": s, "message": m} for s, m in self.found.warnings],
            "checks": [f.as_json() for f in self.findings],
        }


def metadata(campaign: Campaign, found: Identification, message: str, findings: list[Finding]) -> dict[str, str]:
    """What a commit carries beside its rows: provenance, inputs, conversions, notes of the fit."""
    header = campaign.header
    return {
        "campaign": header.name,
        "facility": header.facility,
        "provenance": header.provenance.strip(),
        "frame": f"x {header.frame.x}, y {header.frame.y}, z {header.frame.z}",
        "inputs": json.dumps(campaign.digests),
        "conversions": json.dumps(conversions(campaign)),
        "options": json.dumps({"uncertainty": header.uncertainty.model_dump()}),
        "unused": json.dumps(found.unused),
        "warnings": json.dumps(found.warnings),
        "quality": json.dumps({k: q.model_dump() for k, q in header.quality.items()}),
        "checks": json.dumps([f.as_json() for f in findings]),
        "message": message,
    }


def fit(folder: Path, db: str, message: str = "", strict: bool = False, wait: float = WAIT) -> list[Fit]:
    """Fit every campaign at or below ``folder`` into the database.

    Parameters
    ----------
    folder : Campaign folder, or a folder of campaign folders.
    db : Database path or URL.
    message : Stored with the version.
    strict : Refuse a campaign with a quality finding of severity ``error``.
    wait : How long to wait for other writers of the database [s].

    Returns
    -------
    One Fit a campaign, in folder order.

    Raises
    ------
    sim.files.errors.InputError
        For bad input in any campaign, before anything is committed.
    """
    paths = find_campaigns(folder)
    read = [read_campaign(path) for path in paths]
    names = [campaign.vehicle.name for campaign in read]
    for path, name in zip(paths, names, strict=True):
        if names.count(name) > 1:
            text = "one campaign a vehicle: a version replaces all rows of its vehicle"
            raise InputError(str(path / "campaign.toml"), f"vehicle {name!r} has {names.count(name)} campaigns", text)
    identified = [identify(campaign) for campaign in read]
    checked = [check_campaign(*one) for one in zip(read, paths, identified, strict=True)]
    if strict:
        for path, findings in zip(paths, checked, strict=True):
            refuse_errors(path, findings)
    ready = [(campaign, found, database_rows(found)) for campaign, found in zip(read, identified, strict=True)]
    done = []
    for (campaign, found, rows), findings in zip(ready, checked, strict=True):
        version, new = commit(db, rows, metadata(campaign, found, message, findings), wait)
        done.append(Fit(campaign, found, rows, version, new, digest(rows), findings))
    return done


def coefficient_table(rows: pd.DataFrame) -> list[dict[str, Any]]:
    """One row a coefficient: points, runs, worst disagreement, points by quality."""
    table = []
    for name, group in rows.groupby("coefficient", sort=False):
        own = group[group["origin"].isin(["measured", "published"])]
        counted = own if not own.empty else group
        table.append(
            {
                "coefficient": str(name),
                "points": len(group),
                "measured": len(own),
                "runs": len({r for text in group["runs"] for r in text.split()}),
                "median_relative_error": float((counted["stderr"] / counted["value"].abs()).median()),
                "worst_residual": float(group["worst_residual"].max()),
                "quality": dict(Counter(q for q in counted["quality"] if q)),
            }
        )
    return table


def show(done: Fit, console: Console) -> None:
    """Print the fit as tables.

    Parameters
    ----------
    done : The fit.
    console : Where to print.
    """
    from rich.markup import escape
    from rich.table import Table

    serious = [f for f in done.findings if f.severity != "info"]
    if serious:
        console.print(findings_table(serious, f"Quality checks: {len(serious)} of {len(done.findings)} findings"))
    table = Table(title=f"{done.campaign.vehicle.title}: {done.campaign.header.name}", title_justify="left")
    for column, justify in (
        ("coefficient", "left"),
        ("points", "right"),
        ("measured", "right"),
        ("runs", "right"),
        ("median error", "right"),
        ("worst residual", "right"),
        ("quality", "left"),
    ):
        table.add_column(column, justify=justify)  # type: ignore[arg-type]
    factor = {k: q.factor for k, q in done.campaign.header.quality.items()}
    for row in coefficient_table(done.rows):
        words = [
            f"[{'yellow' if factor[q] > 1 else 'green'}]{escape(q)} {n}[/]" for q, n in sorted(row["quality"].items())
        ]
        worst = row["worst_residual"]
        table.add_row(
            escape(row["coefficient"]),
            str(row["points"]),
            str(row["measured"]),
            str(row["runs"]),
            f"{100 * row['median_relative_error']:.1f} %",
            f"[red]{worst:.1f} s.e.[/]" if worst > 2 else f"{worst:.1f} s.e." if worst else "-",
            ", ".join(words),
        )
    console.print(table)
    for warning in group_warnings(done.found.warnings):
        console.print(f"[yellow]warning[/] ({warning.count}x) {escape(warning.shown)}", highlight=False)
    used = {r for n in done.found.nodes for r in n.runs}
    total = done.campaign.runs["run_id"]
    console.print(f"{len(used)} of {len(total)} runs used; loads left out, with the reason:")
    for left in group_unused(done.found.unused):
        outputs = " ".join(dict.fromkeys(o for found in left.runs.values() for o in found))
        ids = list(left.runs)
        shown = ", ".join(ids[:4]) + (f", ... {len(ids)} runs" if len(ids) > 4 else "")
        console.print(f"  {escape(left.file)} {outputs}: {escape(left.reason)} [{escape(shown)}]", highlight=False)
    state = "committed" if done.new else "unchanged, nothing committed: already"
    console.print(f"[bold]{state} version {done.version}[/]  digest {done.digest[:16]}", highlight=False)
