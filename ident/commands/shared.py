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
VERSION = click.option("--version", "version", type=int, default=None, help="Database version; latest by default.")
OUT = click.option(
    "--out", type=click.Path(path_type=Path), default=Path("reports"), show_default=True, help="Folder to write to."
)


def emit(data: Any, target: str) -> None:
    """Write JSON to a file or, for ``-``, to standard output.

    Raises
    ------
    sim.errors.InputError
        When the file cannot be written.
    """
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


@contextmanager
def equilibrium_of(case: str) -> Iterator[None]:
    """Says of which case there is no equilibrium: ``NoEquilibrium`` becomes an ``InputError``."""
    from sim.errors import InputError
    from sim.trim import NoEquilibrium

    try:
        yield
    except NoEquilibrium as error:
        raise InputError(f"case {case}", str(error), "a state the boat can hold") from error


def console_for(quiet: bool = False) -> Any:
    """A rich console; a quiet one where standard output holds JSON."""
    from rich.console import Console

    # A pipe has no width of its own; tables are cut less when it is generous.
    return Console(quiet=quiet, width=None if sys.stdout.isatty() else 140)
