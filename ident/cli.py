"""The command line. Imports are inside the commands, so that --help is quick."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import click

from ident import __version__

DB = click.option("--db", default="coeff_db", show_default=True, help="Database folder or object-store URL.")
VERSION = click.option("--version", "version", type=int, default=None, help="Database version; latest by default.")

OUT = click.option(
    "--out", type=click.Path(path_type=Path), default=Path("reports"), show_default=True, help="Folder to write to."
)


class Commands(click.Group):
    """Turns a user's mistake into one message and exit code 2."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; ``InputError`` becomes a message."""
        from sim.errors import InputError

        try:
            return super().invoke(ctx)
        except InputError as error:
            click.secho(f"Error: {error.where}", fg="red", err=True)
            click.echo(f"  found:   {error.found}", err=True)
            click.echo(f"  allowed: {error.allowed}", err=True)
            ctx.exit(2)
        except BrokenPipeError:
            ctx.exit(1)


def _emit(data: Any, target: str) -> None:
    """Write JSON to a file or, for ``-``, to standard output."""
    text = json.dumps(data, indent=2, allow_nan=False)
    if target == "-":
        click.echo(text)
        return
    path = Path(target)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        from sim.errors import InputError

        raise InputError(target, f"cannot be written: {error.strerror}", "a path you may write to, or -") from error


def _console(quiet: bool = False) -> Any:
    from rich.console import Console

    # A pipe has no width of its own; tables are cut less when it is generous.
    return Console(quiet=quiet, width=None if sys.stdout.isatty() else 140)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="ident")
def main() -> None:
    """Captive submarine tests to a maneuvering model people trust.

    \b
    ident check raw_captive_data/    what is wrong with the runs
    ident fit raw_captive_data/      identify coefficients, commit a version
    ident runs raw_captive_data/     the run table as read, histories reduced
    ident report                     one HTML page on a version
    ident validate --case hzz20      fly a maneuver and compare
    """


@main.command()
@click.argument("folder", type=click.Path(path_type=Path))
@DB
@click.option("-m", "--message", default="", help="Message stored with the version.")
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write the summary as JSON.")
@click.option("--strict", is_flag=True, help="Commit nothing when a quality check finds an error.")
def fit(folder: Path, db: str, message: str, json_path: str | None, strict: bool) -> None:
    """Identify the coefficients of a campaign and commit one database version.

    FOLDER holds campaign.toml and one CSV a test, or such folders.

    \b
    Example: ident fit raw_captive_data/ --db coeff_db
    """
    from ident.fit import fit as run
    from ident.fit import show

    console = _console(quiet=json_path == "-")
    with console.status("reading, checking and identifying"):
        done = run(folder, db, message, strict)
    for one in done:
        show(one, console)
    if json_path:
        _emit([one.summary() for one in done], json_path)


@main.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write the findings as JSON.")
@click.option("--strict", is_flag=True, help="Exit 1 when a finding is an error.")
def check(folder: Path, json_path: str | None, strict: bool) -> None:
    """Check the runs of a campaign: copies, slips, outliers, levers, inertia, missing tests.

    \b
    Example: ident check raw_captive_data/ --json -
    """
    from ident.campaign import find_campaigns, read_campaign
    from ident.checks import check_campaign, show

    console = _console(quiet=json_path == "-")
    found: list[dict[str, Any]] = []
    for path in find_campaigns(folder):
        with console.status(f"checking {path}"):
            campaign = read_campaign(path)
            findings = check_campaign(campaign, path)
        show(findings, f"{campaign.header.name}: {len(campaign.runs)} runs", console)
        found.append({"campaign": campaign.header.name, "findings": [f.as_json() for f in findings]})
    if json_path:
        _emit(found, json_path)
    if strict and any(f["severity"] == "error" for one in found for f in one["findings"]):
        sys.exit(1)


@main.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--target-rel", default=0.1, show_default=True, help="Standard error wanted, relative to a term's size.")
@click.option("--facility", type=click.Path(path_type=Path), default=None, help="TOML file of levels and limits.")
@click.option("--out", type=click.Path(path_type=Path), default=None, help="Write the test matrix as CSV.")
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write terms and runs as JSON.")
def plan(folder: Path, target_rel: float, facility: Path | None, out: Path | None, json_path: str | None) -> None:
    """Plan the fewest runs that give every term of the vehicle a wanted standard error.

    \b
    Example: ident plan raw_captive_data/bb2 --target-rel 0.1 --out plan.csv
    """
    from ident.campaign import find_campaigns, read_campaign
    from ident.plan import make_plan
    from ident.plan_candidates import read_facility
    from ident.plan_output import show, summary, write_matrix
    from sim.errors import InputError

    paths = find_campaigns(folder)
    if len(paths) > 1:
        raise InputError(str(folder), f"{len(paths)} campaigns", "one campaign folder, such as " + str(paths[0]))
    console = _console(quiet=json_path == "-")
    limits = read_facility(facility) if facility else None
    campaign = read_campaign(paths[0])
    with console.status("identifying, choosing runs, identifying again with them"):
        made = make_plan(campaign, target_rel, limits)
    show(made, campaign, console)
    if out:
        write_matrix(made, campaign, out)
        console.print(f"test matrix: {out}", highlight=False)
    if json_path:
        _emit(summary(made, campaign), json_path)


@main.command()
@click.argument("folder", type=click.Path(path_type=Path))
@OUT
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write the run table as JSON.")
def runs(folder: Path, out: Path, json_path: str | None) -> None:
    """Read a campaign and show its run table; plot the time histories it reduced.

    \b
    Example: ident runs raw_captive_data/ --out reports
    """
    from ident.list_runs import as_json, read, show

    console = _console(quiet=json_path == "-")
    with console.status("reading and reducing"):
        found = read(folder)
    for campaign in found:
        show(campaign, console)
    histories = tuple(one for campaign in found for one in campaign.reduced)
    if histories:
        from ident.reduction_figures import history_figures

        for path in history_figures(histories, out):
            console.print(f"figure: {path}", highlight=False)
    if json_path:
        _emit([row for campaign in found for row in as_json(campaign)], json_path)


@main.command()
@click.option("--case", "case", default=None, help="Bundled case name, or path to a case file.")
@click.option("--all", "every", is_flag=True, help="Fly every bundled case and print the scoreboard.")
@click.option(
    "--cases", type=click.Path(path_type=Path), default=None, help="With --all: a folder of your own cases too."
)
@DB
@VERSION
@OUT
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write the comparison as JSON.")
@click.option("--strict", is_flag=True, help="Exit 1 when a tolerance of a case file is missed.")
@click.option("--samples", type=click.IntRange(min=2), default=None, help="Draw so many coefficient sets; error bands.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the draws.")
@click.option("--dask", default=None, metavar="ADDRESS", help="With --samples: fly them on a Dask cluster.")
@click.option("--vehicle", default=None, help="With --case: bundled vehicle or vehicle file, not the case's.")
@click.option(
    "--reference",
    type=click.Path(path_type=Path),
    default=None,
    help="With --case: your own reference, a CSV of source, channel, t or s, value, unit, and sigma if known.",
)
@click.option(
    "--frame",
    type=click.Choice(["source", "program"]),
    default=None,
    help="Frame of --reference: source is x aft, z up; program x forward, z down. The case's by default.",
)
def validate(
    case: str | None,
    every: bool,
    cases: Path | None,
    db: str,
    version: int | None,
    out: Path,
    json_path: str | None,
    strict: bool,
    samples: int | None,
    seed: int,
    dask: str | None,
    **own: Any,
) -> None:
    """Fly a maneuver from the database and compare it with its references.

    \b
    Example: ident validate --case hzz20 --json -
             ident validate --case hzz20 --samples 1000
             ident validate --case hzz20 --samples 100000 --dask tcp://scheduler:8786
             ident validate --case turn20-4m --reference mine.csv --frame program
             ident validate --case turning-circle --vehicle my_boat.toml
             ident validate --all
    """
    from sim.errors import InputError
    from sim.trim import NoEquilibrium

    if (case is None) == (not every):
        raise click.UsageError("give either --case NAME or --all")
    if every and (samples or any(own.values())):
        raise click.UsageError("--samples, --vehicle, --reference and --frame go with --case")
    if dask and not samples:
        raise click.UsageError("--dask goes with --samples")
    if own["frame"] and not own["reference"]:
        raise click.UsageError("--frame goes with --reference")
    if out.exists() and not out.is_dir():
        raise InputError(str(out), "a file", "a folder for the figures")
    console = _console(quiet=json_path == "-")
    try:
        done, result = _one(case, db, version, own, console) if case else _all(db, version, cases, console)
    except NoEquilibrium as error:
        raise InputError(f"case {case or 'of --all'}", str(error), "a state the boat can hold") from error
    from ident.figures import case_figure

    bands = _bands(done[0], result, samples, seed, dask, console) if samples else None
    for one in done:
        figure = case_figure(one, out / f"{one.case.name}_v{one.result['database']['version']}.png", bands)
        console.print(f"figure: {figure}", highlight=False)
    if json_path:
        _emit(result, json_path)
    if strict and not all(one.result["passed"] for one in done):
        raise click.exceptions.Exit(1)


def _one(
    case: str, db: str, version: int | None, own: dict[str, Any], console: Any
) -> tuple[list[Any], dict[str, Any]]:
    from ident.validate import show, validate

    with console.status("flying the case (the first run on a machine compiles for half a minute)"):
        done = validate(case, db, version, own["vehicle"], own["reference"], own["frame"])
    show(done, console)
    return [done], done.result


def _bands(one: Any, result: dict[str, Any], samples: int, seed: int, dask: str | None, console: Any) -> Any:
    """Fly the samples with a progress bar; adds ``bands`` to the result and prints it."""
    from rich.progress import Progress

    from ident.bands import fly_samples, show, summary

    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("flying samples", total=samples)

        def each(done: int) -> None:
            progress.advance(task, done)

        boat = one.boat
        found = fly_samples(one.case, boat.vehicle, boat.rows, samples, seed, each=each, dask=dask)
    result["bands"] = summary(found, one.case, one.reference)
    show(result["bands"], console)
    return found


def _all(db: str, version: int | None, cases: Path | None, console: Any) -> tuple[list[Any], dict[str, Any]]:
    from ident.scoreboard import run_all, show

    with console.status("flying") as status:
        board, done = run_all(db, version, cases, lambda name: status.update(f"flying {name}"))
    show(board, console)
    return done, board


@main.command()
@click.argument("name", default="bb2")
@DB
@VERSION
@click.option("-m", "--message", default="", help="Message stored with the version.")
@click.option("--left-out/--no-left-out", default=True, show_default=True, help="Repeat without each source in turn.")
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write priors, posteriors and diagnostics.")
def calibrate(name: str, db: str, version: int | None, message: str, left_out: bool, json_path: str | None) -> None:
    """Estimate multipliers of coefficient groups from free-running maneuvers.

    NAME is a bundled calibration or a path to a file. Commits a new version whose parent is the
    captive one it started from (the latest, or --version).

    \b
    Example: ident calibrate bb2
             ident calibrate my_boat.toml --no-left-out --json -
    """
    from ident.calibrated import run, show

    console = _console(quiet=json_path == "-")
    with console.status("calibrating") as status:
        done = run(name, db, version, message, left_out, each=status.update)
    show(done, console)
    if json_path:
        _emit({**done.summary, "version": done.version, "new": done.new, "digest": done.digest}, json_path)


@main.command()
@DB
@VERSION
@click.option("--vehicle", default="bb2", show_default=True, help="Bundled vehicle name, or path to a vehicle file.")
@OUT
def report(db: str, version: int | None, vehicle: str, out: Path) -> None:
    """Write one self-contained HTML page on a database version.

    \b
    Example: ident report --version 0
    """
    from ident.report import write_report

    console = _console()
    with console.status("drawing every coefficient"):
        path = write_report(db, version, out, vehicle)
    console.print(f"report: {path}", highlight=False)


@main.command()
@DB
@VERSION
@click.option("--case", "case", default="hzz20", show_default=True, help="Case that gives vehicle and environment.")
@click.option("--speed", "speeds", type=click.FloatRange(min=0, min_open=True), multiple=True, help="U [m/s]; repeat.")
@click.option("--depth", "depths", type=float, multiple=True, help="D0 [m]; repeat.")
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write the results as JSON.")
def stability(
    db: str,
    version: int | None,
    case: str,
    speeds: tuple[float, ...],
    depths: tuple[float, ...],
    json_path: str | None,
) -> None:
    """Stability indices, eigenvalues and critical speeds against speed and depth.

    Without --speed and --depth, at the tabulated speeds and the depths of the drift runs.

    \b
    Example: ident stability --speed 3 --speed 5 --depth 25
    """
    from ident.stability import as_json, show
    from ident.stability import stability as at
    from sim.case import load_case
    from sim.coefficients import Coefficients
    from sim.database import read_rows
    from sim.model import Environment
    from sim.vehicle import load_vehicle

    data, where = load_case(case)
    vehicle = load_vehicle(data.vehicle, beside=where)
    rows, number = read_rows(db, version, vehicle.name)
    drift = rows[rows["output"].eq("N") & rows["beta_deg"].notna()]
    speeds = speeds or tuple(sorted(drift["speed_mps"].dropna().unique())) or (data.initial.speed_mps,)
    depths = depths or tuple(sorted(drift["depth_m"].dropna().unique())) or (data.initial.depth_m,)
    environment = Environment(data.environment.density_kgpm3, data.environment.gravity_mps2)
    coefficients = Coefficients(vehicle, rows)
    console = _console(quiet=json_path == "-")
    with console.status("linearising"):
        found = [at(coefficients, environment, u, d) for d in depths for u in speeds]
    show(found, f"{vehicle.title}, database version {number}", console)
    if json_path:
        _emit(as_json(found), json_path)


@main.command()
@DB
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write the list as JSON.")
def versions(db: str, json_path: str | None) -> None:
    """List the versions of a database.

    \b
    Example: ident versions --db coeff_db
    """
    from datetime import UTC, datetime

    from rich.table import Table

    from sim.database import versions as read

    keys = ("vehicle", "campaign", "digest", "parent", "program", "message")
    found = [
        {
            "version": v.number,
            "time": datetime.fromtimestamp(int(v.timestamp) / 1000, UTC).isoformat(timespec="seconds"),
            **{k: v.metadata.get(k, "") for k in keys},
        }
        for v in read(db)
    ]
    if json_path:
        _emit(found, json_path)
    if json_path != "-":
        table = Table(*found[0])
        for row in found:
            table.add_row(*[str(x)[:16] if k == "digest" else str(x) for k, x in row.items()])
        _console().print(table)


@main.command()
@click.argument("first", type=int)
@click.argument("second", type=int)
@DB
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write the differences as JSON.")
def diff(first: int, second: int, db: str, json_path: str | None) -> None:
    """Show what changed between two versions.

    \b
    Example: ident diff 0 1
    """
    from rich.table import Table

    from ident.compare import difference

    found = difference(db, first, second)
    if json_path:
        _emit(found, json_path)
    if json_path == "-":
        return
    if not found:
        click.echo(f"versions {first} and {second} hold the same coefficients")
        return
    table = Table("coefficient", "added", "removed", "changed", "largest change", "in standard errors")
    for row in found:
        change = f"{100 * row['largest_relative_change']:.3g} %"
        counts = [str(row[k]) for k in ("added", "removed", "changed")]
        table.add_row(row["coefficient"], *counts, change, f"{row['largest_change_in_stderr']:.2f}")
    _console().print(table)


@main.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--format", "kind", type=click.Choice(["parquet", "csv", "json"]), default="csv", show_default=True)
@DB
@VERSION
def export(folder: Path, kind: str, db: str, version: int | None) -> None:
    """Write one version as a plain file into FOLDER.

    \b
    Example: ident export --version 0 --format csv exported/
    """
    from ident.compare import export as run

    click.echo(str(run(db, version, kind, folder)))


if __name__ == "__main__":
    main()
