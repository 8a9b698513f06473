"""Commands on the runs of a campaign: check, fit, plan, runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from ident.commands.shared import DB, OUT, WAIT, console_for, emit, json_to, out_file


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@DB
@click.option("-m", "--message", default="", help="Message stored with the version.")
@json_to("Write the summary as JSON.")
@click.option("--strict", is_flag=True, help="Commit nothing when a quality check finds an error.")
@WAIT
def fit(folder: Path, db: str, message: str, json_path: str | None, strict: bool, wait: float) -> None:
    """Identify the coefficients of a campaign and commit one database version.

    FOLDER holds campaign.toml and one CSV a test, or such folders.

    \b
    Example: ident fit raw_captive_data/ --db coeff_db
    """
    from ident.fitting.fit import fit as run
    from ident.fitting.fit import show

    console = console_for(quiet=json_path == "-")
    with console.status("reading, checking and identifying"):
        done = run(folder, db, message, strict, wait)
    for one in done:
        show(one, console)
    if json_path:
        emit([one.summary() for one in done], json_path)


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@json_to("Write the findings as JSON.")
@click.option("--strict", is_flag=True, help="Exit 1 when a finding is an error.")
def check(folder: Path, json_path: str | None, strict: bool) -> None:
    """Check the runs of a campaign: copies, slips, outliers, levers, inertia, missing tests.

    \b
    Example: ident check raw_captive_data/ --json -
    """
    from ident.captive.campaign import find_campaigns, read_campaign
    from ident.checks.check import check_campaign, show

    console = console_for(quiet=json_path == "-")
    found: list[dict[str, Any]] = []
    for path in find_campaigns(folder):
        with console.status(f"checking {path}"):
            campaign = read_campaign(path, leave_out=True)
            findings = check_campaign(campaign, path)
        show(findings, f"{campaign.header.name}: {len(campaign.runs)} runs", console)
        found.append({"campaign": campaign.header.name, "findings": [f.as_json() for f in findings]})
    if json_path:
        emit(found, json_path)
    if strict and any(f["severity"] == "error" for one in found for f in one["findings"]):
        sys.exit(1)


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--target-rel", default=0.1, show_default=True, help="Standard error wanted, relative to a term's size.")
@click.option("--facility", type=click.Path(path_type=Path), default=None, help="TOML file of levels and limits.")
@out_file("Write the test matrix as CSV.")
@json_to("Write terms and runs as JSON.")
def plan(folder: Path, target_rel: float, facility: Path | None, out: Path | None, json_path: str | None) -> None:
    """Plan the fewest runs that give every term of the vehicle a wanted standard error.

    \b
    Example: ident plan raw_captive_data/bb2 --target-rel 0.1 --out plan.csv
    """
    from ident.captive.campaign import find_campaigns, read_campaign
    from ident.planning.candidates import read_facility
    from ident.planning.matrix import show, summary, write_matrix
    from ident.planning.plan import make_plan
    from sim.files.errors import InputError

    paths = find_campaigns(folder)
    if len(paths) > 1:
        raise InputError(str(folder), f"{len(paths)} campaigns", "one campaign folder, such as " + str(paths[0]))
    console = console_for(quiet=json_path == "-")
    limits = read_facility(facility) if facility else None
    campaign = read_campaign(paths[0])
    with console.status("identifying, choosing runs, identifying again with them"):
        made = make_plan(campaign, target_rel, limits)
    show(made, campaign, console)
    if out:
        write_matrix(made, campaign, out)
        console.print(f"test matrix: {out}", highlight=False)
    if json_path:
        emit(summary(made, campaign), json_path)


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@OUT
@json_to("Write the run table as JSON.")
def runs(folder: Path, out: Path, json_path: str | None) -> None:
    """Read a campaign and show its run table; plot the time histories it reduced.

    \b
    Example: ident runs raw_captive_data/ --out reports
    """
    from ident.captive.list_runs import as_json, read, show

    console = console_for(quiet=json_path == "-")
    with console.status("reading and reducing"):
        found = read(folder)
    for campaign in found:
        show(campaign, console)
    histories = tuple(one for campaign in found for one in campaign.reduced)
    if histories:
        from ident.captive.history_figures import history_figures

        for path in history_figures(histories, out):
            console.print(f"figure: {path}", highlight=False)
    if json_path:
        emit([row for campaign in found for row in as_json(campaign)], json_path)
