"""Quality checks of a campaign: run them, show them, hand them on.

The checks themselves are pure functions over the run table, the vehicle and tables of
derivatives, registered by name; ``data/checks.csv`` holds their limits and remedies.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ident import checks_copies, checks_physics, checks_runs, checks_tables
from ident.campaign import Campaign
from ident.findings import SEVERITIES, Body, Evidence, Finding, registered, rules
from ident.identify import Identification, identify
from sim.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

# Importing a module enters its checks in the registry.
_MODULES = (checks_copies, checks_physics, checks_runs, checks_tables)
_COLOURS = {"error": "red", "warning": "yellow", "info": "cyan"}


def evidence_of(campaign: Campaign, folder: Path | None = None) -> Evidence:
    """What the checks may look at in a campaign.

    Parameters
    ----------
    campaign : From ``read_campaign``.
    folder : Where it lies: channel descriptions beside the runs are read from ``*.txt``.
    """
    particulars, header = campaign.vehicle.particulars, campaign.header
    mass = particulars.displaced_mass.value
    x, y, z = (particulars.mass.value * k**2 for k in particulars.radius_of_gyration.value)
    length = particulars.length.value
    body = Body(length, header.fluid.density_kgpm3, mass, (x, y, z), None, f"vehicle {campaign.vehicle.name}")
    return Evidence(
        runs=campaign.runs,
        body=body,
        vehicle=campaign.vehicle,
        campaign=campaign,
        labels=read_labels(folder) if folder else None,
        tested_length=header.scale.ratio * header.scale.length_m,
    )


def read_labels(folder: Path) -> pd.DataFrame | None:
    """Channel descriptions, ``[sheet] number | column | unit | description``, from ``*.txt``.

    Returns
    -------
    Columns sheet, column, description, file, row; None when no file has such lines.
    """
    found = []
    pattern = re.compile(r"^(?:\[(?P<sheet>[^\]]*)\])?\s*\d+\s*\|(?P<name>[^|]*)\|[^|]*\|(?P<text>[^|]*)$")
    for path in sorted(folder.glob("*.txt")):
        for row, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
            hit = pattern.match(line)
            if hit:
                sheet, name, text = (str(hit[k] or "").strip() for k in ("sheet", "name", "text"))
                found.append((sheet, name, text, path.name, row))
    return pd.DataFrame(found, columns=["sheet", "column", "description", "file", "row"]) if found else None


def run(evidence: Evidence) -> list[Finding]:
    """Every finding of every check, errors first.

    Parameters
    ----------
    evidence : What there is; checks without their evidence find nothing.
    """
    # Numbers no boat has must not stop the check that says so.
    with np.errstate(all="ignore"):
        found = [f for name, own in registered().items() for check in own for f in check(evidence, rules()[name])]
    return sorted(found, key=lambda f: -SEVERITIES.index(f.severity))


def check_campaign(campaign: Campaign, folder: Path | None = None) -> list[Finding]:
    """Quality checks of a campaign, errors first.

    Constant coefficients are identified for it and checked as a table of derivatives.
    """
    evidence = evidence_of(campaign, folder)
    if campaign.vehicle.term_set == "gertler_hagen":
        evidence = replace(evidence, derivatives=constants(identify(campaign)))
    return run(evidence)


def constants(found: Identification) -> pd.DataFrame:
    """The coefficients without an axis, as a table of derivatives: coefficient, value, file, row."""
    own = [(n.name, v) for n, v in zip(found.nodes, found.values, strict=True) if not n.point and n.part == "hull"]
    table = pd.DataFrame(own, columns=["coefficient", "value"])
    return table.assign(file="identified coefficients", row=table.index + 1)


def refuse_errors(folder: Path, findings: list[Finding]) -> None:
    """Stop at the first finding of severity ``error``.

    Raises
    ------
    InputError
        Naming file, row and column, what was found and the remedy.
    """
    errors = [f for f in findings if f.severity == "error"]
    if not errors:
        return
    first, more = errors[0], len(errors) - 1
    place = f"{folder / first.file}" + (f", row {first.shown_rows}" if first.rows else "")
    place += f", column {' '.join(first.columns)}" if first.columns else ""
    rest = f"; {more} more, see ident check {folder}" if more else ""
    raise InputError(place, f"{first.what} (check {first.check})", first.remedy + rest)


def table(findings: list[Finding], title: str) -> Table:
    """The findings as a table for the screen."""
    from rich.markup import escape
    from rich.table import Table

    shown = Table(title=escape(title), title_justify="left", show_lines=True)
    shown.add_column("severity")
    shown.add_column("check")
    shown.add_column("where")
    shown.add_column("what", ratio=3)
    shown.add_column("remedy", ratio=2)
    for f in findings:
        colour = _COLOURS[f.severity]
        rows = f"\nrow {f.shown_rows}" if f.rows else ""
        where = f"{f.file}{rows}" + (f"\n{' '.join(f.columns)}" if f.columns else "")
        shown.add_row(f"[{colour}]{f.severity}[/]", f.check, escape(where), escape(f.what), escape(f.remedy))
    return shown


def show(findings: list[Finding], title: str, console: Console) -> None:
    """Print the findings, or that there are none."""
    if findings:
        console.print(table(findings, title))
    counts = ", ".join(f"{sum(f.severity == s for f in findings)} {s}" for s in reversed(SEVERITIES))
    console.print(f"quality checks: {counts}", highlight=False)
