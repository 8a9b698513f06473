"""Options and output that the commands share."""

from __future__ import annotations

import functools
import json
import logging
import math
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

_log = logging.getLogger(__name__)


class AnyNumber(click.types.FloatParamType):
    """A finite number: not ``nan`` or ``inf``, which click takes for one."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number; fails as click does."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


class Number(AnyNumber, click.FloatRange):
    """A finite number of a range."""


class PathType(click.Path):
    """A path that is one: nothing at all would be the working folder, which nobody meant."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path; fails as click does."""
        if not str(value):
            self.fail("'' (allowed: a file or folder; . is the working folder)", param, ctx)
        return super().convert(value, param, ctx)


DB = click.option("--db", default="coeff_db", show_default=True, help="Database folder or object-store URL.")
WAIT = click.option(
    "--wait",
    type=Number(min=0),
    default=60.0,
    show_default=True,
    help="Seconds to wait for another writer of the database.",
)


def _as_text(context: click.Context, parameter: click.Parameter, value: str) -> str:
    """Text of an argument; in a locale that cannot say it, it arrives as bytes in disguise."""
    return os.fsencode(value).decode("utf-8", "replace")


MESSAGE = click.option("-m", "--message", default="", callback=_as_text, help="Message stored with the version.")
VERSION = click.option("--version", "version", type=int, default=None, help="Database version; latest by default.")


def _folder(context: click.Context, parameter: click.Parameter, value: Path) -> Path:
    from ident.output import check_folder

    check_folder(value)
    return value


def either(context: click.Context, parameter: click.Parameter, value: Any) -> Any:
    """Marks what is written to, a file or a folder by what else is asked; the command looks at it then."""
    return value


def _file(context: click.Context, parameter: click.Parameter, value: Any) -> Any:
    from ident.output import check_file

    if value not in (None, "-"):
        check_file(Path(value))
    return value


# What a figure may be written as.
DRAWINGS = (".png", ".svg", ".pdf")


def _drawing(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
    if value is not None and value.suffix.lower() not in DRAWINGS:
        raise click.BadParameter(f"{value.name!r} (allowed: a name that ends in {', '.join(DRAWINGS)})")
    _file(context, parameter, value)
    return value


def figure_to(text: str) -> Any:
    """The option ``--figure`` of a command, with its help."""
    return click.option("--figure", type=PathType(), default=None, callback=_drawing, help=text)


def _inputs(command: click.Command, values: dict[str, Any]) -> list[Path]:
    """Files and folders among the arguments that a command reads, its database among them."""
    read = [str(values[p.name]) for p in command.params if p.name and values.get(p.name) and not _is_written(p)]
    # A message may be longer than any name.
    return [Path(os.path.realpath(text)) for text in read if "://" not in text and os.path.exists(text)]


def _is_written(parameter: click.Parameter) -> bool:
    return parameter.callback in (_file, _folder, _drawing, either)


def _refuse_inputs(command: click.Command, values: dict[str, Any]) -> None:
    """Refuse to write over what a command reads. Raises ``InputError``."""
    from ident.output import refuse_database
    from sim.files.errors import InputError

    inputs = _inputs(command, values)
    for parameter in command.params:
        given = values.get(parameter.name or "")
        if not _is_written(parameter) or given in (None, "-"):
            continue
        target = Path(os.path.realpath(given))
        refuse_database(Path(given))
        if parameter.callback is _folder or not target.is_file():
            continue
        for one in inputs:
            inside = one in target.parents and target.suffix.lower() not in _RESULTS
            if (one.is_file() and target.samefile(one)) or inside:
                raise InputError(str(given), "an input of this command", "another file to write to")


# What the program writes and no campaign consists of: may be written again in a campaign's folder.
_RESULTS = (".json", ".png", ".svg", ".pdf", ".html", ".gif", ".mp4")


def _after(command: click.Command, began: float) -> dict[str, object]:
    return {"command": command.name, "seconds": round(time.monotonic() - began, 3)}


def inputs_kept(command: click.Command) -> click.Command:
    """The command, which refuses to write over what it reads before it begins."""
    command_itself = command.callback
    assert command_itself is not None

    @functools.wraps(command_itself)
    def kept(**values: Any) -> Any:
        from sim.files import inputs

        _refuse_inputs(command, values)
        inputs.begin()
        given = {f"option_{k}": v for k, v in values.items() if v not in (None, "", (), False)}
        _log.debug("command begins", extra={"command": command.name, **given})
        began = time.monotonic()
        try:
            result = command_itself(**values)
        except BaseException as error:
            _log.info("command ends early", extra=_after(command, began) | {"by": type(error).__name__})
            raise
        _log.info("command ends", extra=_after(command, began))
        return result

    command.callback = kept
    return command


# Where a command writes is looked at before it works: a calibration of minutes must not end at a wrong path.
OUT = click.option(
    "--out",
    type=PathType(),
    default=Path("reports"),
    show_default=True,
    callback=_folder,
    help="Folder to write to.",
)
FOLDER = click.argument("folder", type=PathType(), callback=_folder)


def out_file(text: str) -> Any:
    """The option ``--out`` of a command that writes one file."""
    return click.option("--out", type=PathType(), default=None, callback=_file, help=text)


def json_to(text: str) -> Any:
    """The option ``--json`` of a command, with its help."""
    return click.option("--json", "json_path", default=None, metavar="PATH|-", callback=_file, help=text)


def emit(data: Any, target: str) -> None:
    """Write JSON to a file or, for ``-``, to standard output.

    Raises
    ------
    sim.files.errors.InputError
        When the file cannot be written, or a number is not finite.
    """
    from sim.files.errors import InputError

    try:
        text = json.dumps(data, indent=2, allow_nan=False)
    except ValueError as error:
        raise InputError("the result", "a number that is not finite", "input whose results are numbers") from error
    if target == "-":
        click.echo(text)
        return
    from ident.output import whole

    with whole(Path(target)) as part:
        part.write_text(text + "\n", encoding="utf-8")


@contextmanager
def equilibrium_of(case: str, hint: str = "") -> Iterator[None]:
    """Says of which case there is no equilibrium: ``NoEquilibrium`` becomes an ``InputError``.

    Parameters
    ----------
    case : As it was asked for.
    hint : How another state is asked for, after what is allowed.
    """
    from sim.files.errors import InputError
    from sim.flight.trim import NoEquilibrium

    try:
        yield
    except NoEquilibrium as error:
        raise InputError(f"case {case}", str(error), f"a state the boat can hold{hint}") from error


def console_for(quiet: bool = False) -> Any:
    """A rich console; a quiet one where standard output holds JSON."""
    from ident.commands.screen import Screen

    # A pipe has no width of its own; tables are cut less when it is generous.
    return Screen(quiet=quiet, width=None if sys.stdout.isatty() else 140)


@contextmanager
def told() -> Iterator[Any]:
    """Shows what a long command does on standard error, with the time left: yields an ``ident.output.Tell``."""
    from rich.progress import Progress, TaskID

    from ident.commands.screen import Screen

    screen = Screen(stderr=True)
    # Where nobody watches, a bar that is taken away leaves a blank line.
    with Progress(console=screen, transient=True, disable=not screen.is_terminal) as shown:
        tasks: dict[str, TaskID] = {}

        def tell(what: str, done: int, of: int) -> None:
            if what not in tasks:
                tasks[what] = shown.add_task(what, total=of)
            shown.update(tasks[what], completed=done, total=of, visible=done < of)

        yield tell
