"""Quality checks of a campaign: run them, show them, hand them on.

The checks themselves are pure functions over the run table, the vehicle and tables of
derivatives, registered by name; ``data/checks.csv`` holds their limits and remedies.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ident.captive.campaign import Campaign
from ident.captive.readers.opening import open_sheet
from ident.captive.readers.sheet import run_cells
from ident.captive.source import Source
from ident.checks import axes as checks_axes
from ident.checks import coefficients as checks_coefficients
from ident.checks import copies as checks_copies
from ident.checks import fitted as checks_fitted
from ident.checks import geometry as checks_geometry
from ident.checks import histories as checks_histories
from ident.checks import levels as checks_levels
from ident.checks import lines as checks_lines
from ident.checks import physics as checks_physics
from ident.checks import planes as checks_planes
from ident.checks import possible as checks_possible
from ident.checks import potential as checks_potential
from ident.checks import propeller as checks_propeller
from ident.checks import proportions as checks_proportions
from ident.checks import ratios as checks_ratios
from ident.checks import resistance as checks_resistance
from ident.checks import rows as checks_rows
from ident.checks import runs as checks_runs
from ident.checks import tables as checks_tables
from ident.checks import zeros as checks_zeros
from ident.checks.findings import (
    SEVERITIES,
    Body,
    Evidence,
    Finding,
    NotYetError,
    RunsAlone,
    function_name,
    of_air,
    registered,
    rules,
)
from ident.checks.summary import counted, cut, lines
from ident.identification.identify import Identification, identify
from ident.output import Tell, silent
from ident.text import on_screen
from sim.files.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

# Importing a module enters its checks in the registry.
_MODULES = (
    checks_axes,
    checks_coefficients,
    checks_copies,
    checks_fitted,
    checks_histories,
    checks_geometry,
    checks_levels,
    checks_lines,
    checks_physics,
    checks_planes,
    checks_possible,
    checks_potential,
    checks_propeller,
    checks_proportions,
    checks_ratios,
    checks_resistance,
    checks_rows,
    checks_runs,
    checks_tables,
    checks_zeros,
)
_COLOURS = {"error": "red", "warning": "yellow", "info": "cyan"}


def evidence_of(campaign: Campaign, folder: Path | None = None) -> Evidence:
    """What the checks may look at in a campaign.

    Parameters
    ----------
    campaign : From ``read_campaign``.
    folder : Where it lies: channel descriptions beside the runs are read from ``*.txt``, and
        the files of ``[tables]``.

    Raises
    ------
    InputError
        For a table of ``[tables]`` that is missing or lacks a column.
    """
    particulars, header = campaign.vehicle.particulars, campaign.header
    # In a wind tunnel the body displaces air.
    density = header.fluid.density_kgpm3
    thinner = density / rules()["fluid"].limits["water"] if of_air(density) else 1.0
    mass = particulars.displaced_mass.value * thinner
    x, y, z = (particulars.mass.value * thinner * k**2 for k in particulars.radius_of_gyration.value)
    length, scale = particulars.length.value, header.scale
    draught = scale.ratio * scale.draught_m if scale.draught_m else None
    body = Body(length, density, mass, (x, y, z), draught, f"vehicle {campaign.vehicle.name}")
    beside = {k: read_table(folder, v, k) for k, v in header.tables.given().items()} if folder else {}
    return Evidence(
        runs=campaign.runs,
        body=body,
        vehicle=campaign.vehicle,
        campaign=campaign,
        labels=read_labels(folder) if folder else None,
        histories=campaign.reduced,
        configurations=beside.get("configurations"),
        reference=beside.get("reference"),
        tested_length=scale.ratio * scale.length_m,
        folder=folder,
    )


# Columns of the files that [tables] names; the second of numbers or of text.
_BESIDE = {"configurations": ("configuration", "appendages"), "reference": ("coefficient", "value")}


def read_table(folder: Path, name: str, kind: str) -> pd.DataFrame:
    """A table that ``[tables]`` of a campaign names.

    Parameters
    ----------
    folder : The campaign's.
    name : File in it.
    kind : ``configurations`` or ``reference``.

    Returns
    -------
    Its two columns, file and row.

    Raises
    ------
    InputError
        For a file that is missing, a column that is, or a value that is no number.
    """
    path = folder / name
    if not path.is_file():
        raise InputError(f"{folder / 'campaign.toml'}, key tables.{kind}", f"no file {name!r}", "a CSV file beside it")
    sheet = open_sheet(path, Source(files=name, reader="table"))
    for column in _BESIDE[kind]:
        if column not in sheet.header:
            text = f"columns {' and '.join(_BESIDE[kind])}"
            raise InputError(sheet.where, f"no column {column!r}", text)
    cells, rows = run_cells(sheet)
    table = cells[list(_BESIDE[kind])].apply(lambda column: column.str.strip())
    if kind == "reference":
        numbers = [sheet.dialect.number(cell) for cell in table["value"]]
        for row, cell, number in zip(rows, table["value"], numbers, strict=True):
            if number is None:
                raise InputError(f"{path}, row {row}, column value", repr(cell[:60]), "a finite number")
        table["value"] = numbers
    return table.assign(file=path.name, row=rows)


def read_labels(folder: Path) -> pd.DataFrame | None:
    """Channel descriptions, ``[sheet] number | column | unit | description``, from ``*.txt``.

    Returns
    -------
    Columns sheet, column, description, file, row; None when no file has such lines.
    """
    labels = []
    pattern = re.compile(r"^(?:\[(?P<sheet>[^\]]*)\])?\s*\d+\s*\|(?P<name>[^|]*)\|[^|]*\|(?P<text>[^|]*)$")
    # Opening a pipe would wait for who writes to it.
    for path in sorted(p for p in folder.glob("*.txt") if p.is_file() and os.access(p, os.R_OK)):
        # Line by line: a tank file of any size may be a .txt beside the campaign.
        with path.open(encoding="utf-8", errors="replace") as stream:
            for row, line in enumerate(stream, start=1):
                hit = pattern.match(line.rstrip("\n")) if "|" in line else None
                if hit:
                    sheet, name, text = (str(hit[k] or "").strip() for k in ("sheet", "name", "text"))
                    labels.append((sheet, name, text, path.name, row))
    return pd.DataFrame(labels, columns=["sheet", "column", "description", "file", "row"]) if labels else None


def findings_of(
    evidence: Evidence, tell: Tell = silent, seen: Mapping[str, list[Finding]] = MappingProxyType({})
) -> list[Finding]:
    """Every finding of every check, errors first.

    Parameters
    ----------
    evidence : What there is; checks without their evidence find nothing.
    tell : Told of every check.
    seen : From ``seen_in_runs``: what need not be looked for again.
    """
    # Numbers no boat has must not stop the check that says so.
    with np.errstate(all="ignore"):
        checks = [(name, check) for name, of_name in registered().items() for check in of_name]
        findings: list[Finding] = []
        for done, (name, check) in enumerate(checks, start=1):
            known = seen.get(function_name(name, check))
            findings += check(evidence, rules()[name]) if known is None else known
            tell("checking", done, len(checks))
    return sorted(findings, key=lambda f: -SEVERITIES.index(f.severity))


def seen_in_runs(campaign: Campaign, folder: Path | None = None) -> dict[str, list[Finding]]:
    """What checks find that need only the runs, while these are being identified.

    Parameters
    ----------
    campaign, folder : As of ``check_campaign``.

    Returns
    -------
    Name of a function -> its findings; of a campaign put together from several nothing.
    """
    if campaign.members or campaign.runs.empty:
        return {}
    given = evidence_of(campaign, folder)
    evidence = RunsAlone(**{one.name: getattr(given, one.name) for one in fields(given) if one.init})
    seen = {}
    with np.errstate(all="ignore"):
        for name, functions in registered().items():
            for check in functions:
                with contextlib.suppress(NotYetError):
                    seen[function_name(name, check)] = list(check(evidence, rules()[name]))
    return seen


def check_campaign(
    campaign: Campaign,
    folder: Path | None = None,
    identified: Identification | None = None,
    tell: Tell = silent,
    seen: Mapping[str, list[Finding]] = MappingProxyType({}),
) -> list[Finding]:
    """Quality checks of a campaign, errors first.

    Parameters
    ----------
    campaign : From ``read_campaign``.
    folder : Where it lies, for what stands beside the runs.
    identified : Its coefficients, where they are at hand: constant ones are checked as a table
        of derivatives, and identified for it otherwise.
    tell : Told of every check.
    seen : From ``seen_in_runs`` of the campaign.
    """
    if campaign.members:
        return _of_several(campaign, folder, identified or identify(campaign), tell)
    evidence = evidence_of(campaign, folder)
    if not campaign.runs.empty:
        known = identified or identify(campaign)
        values = checks_coefficients.constant_values(known)
        shares = checks_coefficients.tabulated_values(known)
        evidence = replace(evidence, fitted=checks_fitted.residuals(known), constants=values, tabulated=shares)
        if not campaign.vehicle.terms_of.tabulated:
            evidence = replace(evidence, derivatives=_of_hull(values))
    return findings_of(evidence, tell, seen)


# What is asked of several campaigns as a whole; the rest is each one's own.
_TOGETHER = ("missing", "between_tests", "duplicates", "repeated_blocks", "facilities", "residuals")


def _of_several(campaign: Campaign, folder: Path | None, identified: Identification, tell: Tell) -> list[Finding]:
    """Each campaign by itself, and what only all of them show."""
    findings: list[Finding] = []
    for name, one in campaign.members.items():
        subfolder = folder / name if folder is not None and (folder / name).is_dir() else None
        for finding in check_campaign(one, subfolder, tell=tell):
            if finding.check not in ("missing", "residuals"):
                findings.append(replace(finding, file=f"{name}/{finding.file}"))
    evidence = replace(evidence_of(campaign), histories=(), between=identified.between)
    evidence = replace(evidence, fitted=checks_fitted.residuals(identified))
    known = {(f.check, f.file, f.what) for f in findings}
    with np.errstate(all="ignore"):
        for name in _TOGETHER:
            for check in registered()[name]:
                findings += [f for f in check(evidence, rules()[name]) if (f.check, f.file, f.what) not in known]
    return sorted(findings, key=lambda f: -SEVERITIES.index(f.severity))


def _of_hull(values: pd.DataFrame) -> pd.DataFrame:
    """The hull's among the coefficients without an axis, as a table of derivatives."""
    table = values[values["part"] == "hull"].drop(columns="part").reset_index(drop=True)
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
    rest += '; or --force "why it is fitted all the same"'
    raise InputError(place, f"{first.what} (check {first.check})", first.remedy + rest)


def table(findings: Sequence[Finding], title: str) -> Table:
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


def show(findings: Sequence[Finding], title: str, console: Console, everything: bool = False) -> None:
    """Print the findings on one screen, a line a check; or all of them with their remedies.

    Parameters
    ----------
    findings : Errors first.
    title : What was checked.
    console : Where to print.
    everything : A table of every finding.
    """
    from rich.text import Text

    if everything and findings:
        console.print(table(findings, title))
    elif findings:
        console.print(Text(on_screen(cut(title, console.width)), style="bold"))
        for severity, line in lines(findings, console.width, 18):
            console.print(Text(line, style=_COLOURS.get(severity, "")), no_wrap=True, overflow="crop")
    console.print(f"quality checks: {counted(findings)}", highlight=False)
