"""Options and output that the commands share."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

DB = click.option("--db", default="coeff_db", show_default=True, help="Database folder or object-store URL.")
WAIT = click.option(
    "--wait",
    type=click.FloatRange(min=0),
    default=60.0,
    show_default=True,
    help="Seconds to wait for another writer of the database.",
)
VERSION = click.option("--version", "version", type=int, default=None, help="Database version; latest by default.")


def _folder(context: click.Context, parameter: click.Parameter, value: Path) -> Path:
    from ident.output import check_folder

    check_folder(value)
    return value


def _file(context: click.Context, parameter: click.Parameter, value: Any) -> Any:
    from ident.output import check_file

    if value not in (None, "-"):
        check_file(Path(value))
    return value


# Where a command writes is looked at before it works: a calibration of minutes must not end at a wrong path.
OUT = click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("reports"),
    show_default=True,
    callback=_folder,
    help="Folder to write to.",
)
FOLDER = click.argument("folder", type=click.Path(path_type=Path), callback=_folder)


def out_file(text: str) -> Any:
    """The option ``--out`` of a command that writes one file."""
    return click.option("--out", type=click.Path(path_type=Path), default=None, callback=_file, help=text)


def json_to(text: str) -> Any:
    """The option ``--json`` of a command, with its help."""
    return click.option("--json", "json_path", default=None, metavar="PATH|-", callback=_file, help=text)


def emit(data: Any, target: str) -> None:
    """Write JSON to a file or, for ``-``, to standard output.

    Raises
    ------
    sim.files.errors.InputError
        When the file cannot be written.
    """
    text = json.dumps(data, indent=2, allow_nan=False)
    if target == "-":
        click.echo(text)
        return
    from ident.output import whole

    with whole(Path(target)) as part:
        part.write_text(text + "\n", encoding="utf-8")


@contextmanager
def equilibrium_of(case: str) -> Iterator[None]:
    """Says of which case there is no equilibrium: ``NoEquilibrium`` becomes an ``InputError``."""
    from sim.files.errors import InputError
    from sim.flight.trim import NoEquilibrium

    try:
        yield
    except NoEquilibrium as error:
        raise InputError(f"case {case}", str(error), "a state the boat can hold") from error


def console_for(quiet: bool = False) -> Any:
    """A rich console; a quiet one where standard output holds JSON."""
    from rich.console import Console

    # A pipe has no width of its own; tables are cut less when it is generous.
    return Console(quiet=quiet, width=None if sys.stdout.isatty() else 140)


@contextmanager
def told() -> Iterator[Any]:
    """Shows what a long command does on standard error, with the time left: yields an ``ident.output.Tell``."""
    from rich.console import Console
    from rich.progress import Progress, TaskID

    with Progress(console=Console(stderr=True), transient=True) as shown:
        tasks: dict[str, TaskID] = {}

        def tell(what: str, done: int, of: int) -> None:
            if what not in tasks:
                tasks[what] = shown.add_task(what, total=of)
            shown.update(tasks[what], completed=done, total=of, visible=done < of)

        yield tell
