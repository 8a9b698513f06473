"""Commands on the runs of a campaign: check, fit, plan, runs."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ident.commands.shared import (
    DB,
    MESSAGE,
    OUT,
    WAIT,
    AnyNumber,
    PathType,
    console_for,
    either,
    emit,
    json_to,
    out_file,
    told,
)
from ident.text import on_screen

if TYPE_CHECKING:
    from ident.cfd.batch import Batch
    from ident.planning.matrix import Plan


@dataclass(frozen=True)
class FitOptions:
    """What `ident fit` was asked."""

    folder: Path
    db: str
    message: str
    json_path: str | None
    force: str
    wait: float
    measured_only: bool
    without: tuple[str, ...]
    dask: str | None


@dataclass(frozen=True)
class PlanOptions:
    """What `ident plan` was asked: a matrix, or also the CFD cases of it."""

    folder: Path
    cases_folder: Path | None
    target_rel: float
    facility: Path | None
    cases: str | None
    surface: Path | None
    template: Path | None
    out: Path | None
    json_path: str | None

    def check(self) -> None:
        """Refuse options that do not go together. Raises ``click.UsageError``."""
        of_cases = {"OUT": self.cases_folder, "--surface": self.surface, "--template": self.template}
        if self.cases is not None and not all(of_cases.values()):
            raise click.UsageError("--cases openfoam needs --surface FILE, --template FILE and a folder OUT")
        for name, value in of_cases.items():
            if self.cases is None and value is not None:
                raise click.UsageError(f"{name} is for --cases openfoam, which is not given")


@click.command()
@click.argument("folder", type=PathType())
@DB
@MESSAGE
@json_to("Write the summary as JSON.")
@click.option(
    "--force", default="", metavar="REASON", help="Fit in spite of errors of ident check; the reason is stored."
)
# What it did is done without it since errors stop a fit; scripts that state it go on.
@click.option("--strict", is_flag=True, hidden=True, expose_value=False)
@WAIT
@click.option("--measured-only", is_flag=True, help="What the runs give, without any estimate.")
@click.option("--without", multiple=True, metavar="ESTIMATE", help="Leave a named estimate out; may be repeated.")
@click.option("--dask", default=None, metavar="ADDRESS", help="Read, reduce and solve on a Dask cluster.")
def fit(**options: Any) -> None:
    """Identify the coefficients of a campaign and commit one database version.

    FOLDER holds campaign.toml and one CSV a test, or such folders. Nothing is committed while ident check
    finds an error, unless --force says why; the reason stands in the version. What the runs do not say, named
    estimates do (docs/prediction.md); no maneuver is used.

    \b
    Example: ident fit raw_captive_data/ --db coeff_db
             ident fit /shared/campaign --dask tcp://scheduler:8786
    """
    import ident
    from ident.fitting.fit import show

    asked = FitOptions(**options)
    console = console_for(quiet=asked.json_path == "-")
    with told() as tell:
        done = ident.fit(
            asked.folder,
            asked.db,
            asked.message,
            asked.force,
            measured_only=asked.measured_only,
            without=asked.without,
            work=ident.Work(asked.wait, tell, asked.dask, workers=0),
        )
    for one in done:
        show(one, console)
    if asked.json_path:
        emit(done.to_dict(), asked.json_path)


@click.command()
@click.argument("folder", type=PathType())
@json_to("Write the findings as JSON.")
@click.option("--strict", is_flag=True, help="Exit 1 when a finding is an error.")
@click.option("--all", "everything", is_flag=True, help="Every finding with its remedy, not a line a check.")
def check(folder: Path, json_path: str | None, strict: bool, everything: bool) -> None:
    """Check the runs of a campaign: copies, slips, outliers, levers, inertia, missing tests.

    \b
    Example: ident check raw_captive_data/ --json -
    """
    import ident
    from ident.checks.check import show

    console = console_for(quiet=json_path == "-")
    with console.status("checking") as status:
        checked = ident.check(folder, lambda path: status.update(f"checking {on_screen(path)}"))
    for one in checked:
        show(one.findings, f"{one.campaign.header.name}: {len(one.campaign.runs)} runs", console, everything)
    if json_path:
        emit(checked.to_dict(), json_path)
    if strict and any(one.counts["error"] for one in checked):
        sys.exit(1)


@click.command()
@click.argument("folder", type=PathType())
@click.argument("cases_folder", metavar="[OUT]", type=PathType(), required=False, callback=either)
@click.option(
    "--target-rel",
    type=AnyNumber(),
    default=0.1,
    show_default=True,
    help="Standard error wanted, relative to a term's size.",
)
@click.option("--facility", type=PathType(), default=None, help="TOML file of levels and limits.")
@click.option("--cases", type=click.Choice(["openfoam"]), default=None, help="Write a CFD case for every run into OUT.")
@click.option("--surface", type=PathType(), default=None, help="With --cases: STL file of the boat.")
@click.option("--template", type=PathType(), default=None, help="With --cases: TOML file of settings.")
@out_file("Write the test matrix as CSV.")
@json_to("Write terms and runs as JSON.")
def plan(**options: Any) -> None:
    """Plan the fewest runs that give every term of the vehicle a wanted standard error.

    With --cases, each becomes a case folder in OUT that OpenFOAM runs as it is, beside a campaign.toml that reads
    its output; asked again, the plan counts what came back, and writes nothing once it is enough.

    \b
    Example: ident plan raw_captive_data/bb2 --target-rel 0.1 --out plan.csv
             ident plan lines/captive --cases openfoam --surface hull.stl --template template.toml cases/
    """
    from ident.planning.matrix import show

    asked = PlanOptions(**options)
    asked.check()
    console = console_for(quiet=asked.json_path == "-")
    batch = _cases(asked) if asked.cases else None
    made = _matrix(asked, console) if batch is None else batch.plan
    show(made, console)
    if batch is not None:
        from ident.cfd.screen import show_batch

        show_batch(batch, console)
    if asked.out:
        made.to_csv(asked.out)
        console.print(f"test matrix: {on_screen(asked.out)}", highlight=False)
    if asked.json_path:
        emit(made.to_dict() if batch is None else batch.to_dict(), asked.json_path)


def _matrix(asked: PlanOptions, console: Any) -> Plan:
    import ident

    with console.status("identifying, choosing runs, identifying again with them"):
        return ident.plan(asked.folder, asked.target_rel, asked.facility)


def _cases(asked: PlanOptions) -> Batch:
    """The runs of the plan written as CFD cases."""
    import ident

    assert asked.surface is not None
    assert asked.template is not None
    assert asked.cases_folder is not None
    with told() as tell:
        return ident.plan_cases(
            asked.folder, asked.surface, asked.template, asked.cases_folder, asked.target_rel, asked.facility, tell
        )


@click.command()
@click.argument("folder", type=PathType())
@OUT
@json_to("Write the run table as JSON.")
def runs(folder: Path, out: Path, json_path: str | None) -> None:
    """Read a campaign and show its run table; plot the time histories it reduced.

    Of a folder that ident plan --cases wrote: also how far its cases are, which converged, which to start again,
    and the end of the log of those that died.

    \b
    Example: ident runs raw_captive_data/ --out reports
             ident runs cases/
    """
    from ident.captive.list_runs import as_json, read, show
    from ident.cfd.matrix import is_matrix, read_matrix

    console = console_for(quiet=json_path == "-")
    with console.status("reading and reducing"):
        campaigns = read(folder, none_yet=is_matrix(folder))
    for campaign in campaigns:
        if len(campaign.runs):
            show(campaign, console)
    cases = None
    if is_matrix(folder):
        from ident.cfd.progress import progress
        from ident.cfd.screen import show_progress

        cases = progress(read_matrix(folder), campaigns[0])
        show_progress(cases, console)
    histories = tuple(one for campaign in campaigns for one in campaign.reduced)
    if histories:
        from ident.captive.history_figures import history_figures

        for path in history_figures(histories, out):
            console.print(f"figure: {on_screen(path)}", highlight=False)
    if json_path:
        rows = [row for campaign in campaigns for row in as_json(campaign)]
        emit(rows if cases is None else {"runs": rows, **cases.to_dict()}, json_path)
