"""Commands on the versions of a database: report, versions, diff, vacuum."""

from __future__ import annotations

from pathlib import Path

import click

from ident.commands.shared import DB, OUT, VERSION, WAIT, PathType, console_for, emit, figure_to, json_to
from ident.text import on_screen, visible


@click.command()
@DB
@VERSION
@click.option(
    "--vehicle", default=None, help="Bundled vehicle or path to a vehicle file; all of the version's without it."
)
@OUT
@click.option("--interactive", is_flag=True, help="Also a page with figures to turn and slice (extra: report).")
@click.option(
    "--beside", type=int, multiple=True, metavar="N", help="Another version in the interactive figures; repeatable."
)
@click.option(
    "--scoreboard",
    type=PathType(),
    default=None,
    help="JSON of `ident validate --all`: errors of flights, linked to the values behind them.",
)
@json_to("Write what the page shows as JSON.")
def report(
    db: str,
    version: int | None,
    vehicle: str | None,
    out: Path,
    interactive: bool,
    beside: tuple[int, ...],
    scoreboard: Path | None,
    json_path: str | None,
) -> None:
    """Write one self-contained HTML page on each vehicle of a database version.

    With --json, one object for one vehicle, a list for several.

    \b
    Example: ident report --version 0
             ident report --version 2 --interactive --beside 0
             ident validate --all --json board.json && ident report --vehicle bb2 --scoreboard board.json
    """
    from ident.report.interactive import plotly
    from ident.report.page import Additions, reported_vehicles, write_report

    if beside and not interactive:
        raise click.UsageError("--beside changes nothing without --interactive")
    if interactive:
        plotly()

    console = console_for(quiet=json_path == "-")
    additions = Additions(interactive, beside, scoreboard)
    done = []
    for name in [vehicle] if vehicle is not None else reported_vehicles(db, version):
        with console.status(f"drawing every coefficient of {on_screen(name)}"):
            done.append(write_report(db, version, out, name, additions, 0))
        console.print(f"report: {on_screen(done[-1].file)}", highlight=False)
    if json_path:
        emit(done[0].to_dict() if len(done) == 1 else [one.to_dict() for one in done], json_path)


@click.command()
@DB
@json_to("Write the list as JSON.")
def versions(db: str, json_path: str | None) -> None:
    """List the versions of a database.

    \b
    Example: ident versions --db coeff_db
    """
    from rich.table import Table

    import ident

    history = ident.Database(db).to_dict()
    if json_path:
        emit(history, json_path)
    if json_path != "-":
        table = Table(*history[0])
        for row in history:
            table.add_row(*[on_screen(str(x)[:16] if k == "digest" else x) for k, x in row.items()])
        console_for().print(table)


@click.command()
@click.argument("first", type=int)
@click.argument("second", type=int)
@DB
@figure_to("Draw the changes: PNG, SVG or PDF.")
@json_to("Write the differences as JSON.")
def diff(first: int, second: int, db: str, figure: Path | None, json_path: str | None) -> None:
    """Show what changed between two versions.

    \b
    Example: ident diff 0 1
             ident diff 0 1 --figure changes.svg
    """
    from rich.table import Table

    import ident
    from ident.report.difference import draw_difference

    versions = ident.Database(db)
    difference = versions[first].diff(versions[second])
    if figure is not None:
        draw_difference(difference, figure, Path(db).name)
    if json_path:
        emit(difference.to_dict(), json_path)
    if json_path == "-":
        return
    if not difference:
        click.echo(f"versions {first} and {second} hold the same coefficients")
        return
    table = Table("vehicle", "coefficient", "added", "removed", "changed", "largest change", "in standard errors")
    for one in difference:
        change = f"{100 * one.largest_relative_change:.3g} %"
        counts = [str(n) for n in (one.added, one.removed, one.changed)]
        table.add_row(
            on_screen(one.vehicle), on_screen(one.coefficient), *counts, change, f"{one.largest_change_in_stderr:.2f}"
        )
    console_for().print(table)


@click.command()
@DB
@WAIT
@click.option("--dry-run", is_flag=True, help="Only say what would be removed.")
@json_to("Write the removed files as JSON.")
def vacuum(db: str, wait: float, dry_run: bool, json_path: str | None) -> None:
    """Remove the files of commits that did not finish. Every version stays as it is.

    The next commit removes them too. In an object store, where writers hold no lock, let none be at work.

    \b
    Example: ident vacuum --db coeff_db
             ident vacuum --db coeff_db --dry-run --json -
    """
    from ident.database import leftovers

    removed = leftovers.vacuum(db, wait, dry_run)
    if json_path != "-":
        verb = "would be removed" if dry_run else "removed"
        for name, size in removed.items():
            click.echo(f"{verb}: {visible(name)} ({size} bytes)")
        click.echo(f"{len(removed)} files of commits that did not finish, {sum(removed.values())} bytes")
    if json_path:
        files = [{"file": name, "bytes": size} for name, size in removed.items()]
        emit({"database": db, "dry_run": dry_run, "files": files}, json_path)
