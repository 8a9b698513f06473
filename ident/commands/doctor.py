"""The command on the health of a database and of the installation: doctor."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ident.commands.shared import WAIT, PathType, console_for, emit, json_to

if TYPE_CHECKING:
    from ident.database.installation import Installation


@click.command()
@click.argument("folders", type=PathType(), nargs=-1)
@click.option("--db", default=None, help="Database folder or object-store URL to examine.")
@click.option("--repair", is_flag=True, help="Restore what can be restored; damaged files are set aside in .damaged.")
@WAIT
@json_to("Write what was seen as JSON.")
def doctor(folders: tuple[Path, ...], db: str | None, repair: bool, wait: float, json_path: str | None) -> None:
    """Check every version of a database and the installation; restore what is damaged.

    FOLDERS hold the campaigns that damaged rows may be restored from, when their input files are those that the commit
    names. Exit 1 when something is not whole.

    \b
    Example: ident doctor
             ident doctor --db coeff_db
             ident doctor raw_captive_data/ --db coeff_db --repair
    """
    from ident.database.installation import installation
    from sim.files.errors import InputError

    if db is None and (repair or folders):
        raise InputError("ident doctor", "--repair or a campaign without --db", "--db with the database to repair")
    quiet = json_path == "-"
    console = console_for(quiet=quiet)
    with console.status("testing the installation"):
        installed = installation()
    report = asdict(installed)
    well = not any(one.fault for one in installed.self_test)
    if not quiet:
        _show_installation(installed, console)
    if db is not None:
        from ident.database.doctor import examine
        from ident.database.doctor import repair as restore
        from ident.fitting.fit import completed

        with console.status("examining") as status:
            if repair:
                seen = restore(db, folders, wait, status.update, completed)
            else:
                seen = examine(db, folders, status.update, completed)
        report["database"] = seen.to_dict()
        well = well and seen.whole
        if not quiet:
            _show_database(seen, console)
    if json_path:
        emit(report, json_path)
    if not well:
        sys.exit(1)


def _show_installation(installed: Installation, console: Any) -> None:
    packages = ", ".join(f"{name} {version}" for name, version in installed.packages.items() if version)
    threads = ", ".join(f"{name} {value}" for name, value in installed.threads.items())
    lines = (
        f"{installed.program}, Python {installed.python}, {installed.machine}",
        f"packages: {packages}",
        f"threads: {threads}",
        f"compiled functions: {installed.cache.folder or 'no cache'} ({installed.cache.bytes / 1e6:.1f} MB)",
        *(f"self-test: {one.test}: {one.fault or 'as it should be'}" for one in installed.self_test),
    )
    for line in lines:
        console.print(line, highlight=False, markup=False)


def _show_database(seen: Any, console: Any) -> None:
    from rich.table import Table
    from rich.text import Text

    table = Table("version", "vehicle", "digest", "state", "can be restored from")
    for v in seen.versions:
        state = Text(v.fault, "red") if v.fault else Text("whole", "green")
        table.add_row(
            str(v.version), Text(v.vehicle), v.digest[:16], state, Text(v.restore or ("-" if v.fault else ""))
        )
    console.print(table)
    for line in (*seen.notes, *(f"repaired: {one}" for one in seen.repaired)):
        console.print(line, highlight=False, markup=False)
    damaged = sum(bool(v.fault) for v in seen.versions)
    words = "every version is as it was committed" if not damaged else f"{damaged} of {len(seen.versions)} are damaged"
    console.print(f"{seen.database}: {words}", highlight=False, markup=False)
