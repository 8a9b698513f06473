"""The command line. Commands import what they need when they run, so that --help is quick."""

from __future__ import annotations

from ident.commands import starting  # noqa: F401

# isort: split
import os
import signal
import sys
from collections.abc import Callable
from typing import Any, NoReturn

import click

from ident import __version__
from ident.commands import animate, campaigns, doctor, exports, flights, maneuvers, start, trials, versions
from ident.commands.log import LEVELS, log_level
from ident.commands.process import Asked, absolute_folders, ends_when_asked, looks_seldom, ready_streams, silence
from ident.commands.shared import inputs_kept
from ident.text import visible


class Commands(click.Group):
    """Turns a user's mistake into one message and exit code 2, and ends when asked."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the program: streams that take every character, signals that end it anywhere."""
        ready_streams()
        absolute_folders()
        with ends_when_asked(), looks_seldom():
            return super().main(*args, **kwargs)

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        """The options before a command's name; a mistake in them is said as one behind it."""
        try:
            return super().make_context(*args, **kwargs)
        except click.ClickException as error:
            _say(error.show)
            raise click.exceptions.Exit(error.exit_code) from error
        except BrokenPipeError:
            silence("stdout")
            raise click.exceptions.Exit(1) from None
        except OSError as error:
            # Of --version and --help, before there is a context to be refused in.
            words = f"Error: standard output: {error.strerror}"
            silence("stdout")
            _say(lambda: click.echo(words, err=True))
            raise click.exceptions.Exit(2) from error

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; ``InputError`` and what the system refuses become a message."""
        try:
            if not _stands_somewhere():
                _refuse(ctx, "the working folder", "no longer there", "a folder that exists")
            result = super().invoke(ctx)
            # What cannot be written shows here at the latest, not when Python ends.
            sys.stdout.flush()
            return result
        except BrokenPipeError:
            silence("stdout")
            ctx.exit(1)
        except click.exceptions.Exit:
            raise
        except click.ClickException as error:
            _say(error.show)
            ctx.exit(error.exit_code)
        except (Asked, KeyboardInterrupt) as given:
            # Outside of the main thread, and where there are no signals of POSIX, it is Python's own.
            asked = given if isinstance(given, Asked) else Asked(signal.SIGINT)
            click.echo(f"\n{asked.said}", err=True)
            ctx.exit(asked.code)
        except MemoryError:
            _refuse(ctx, "memory", "more was asked for than there is", "smaller files, fewer samples, shorter runs")
        except OSError as error:
            silence("stdout")
            text, where = error.strerror or str(error), error.filename or "standard output, or a file"
            _refuse(ctx, str(where), text, "what you may read and write, with room for it")
        except Exception as error:
            # Imported only now: the help of a command has no need of it.
            from sim.files.errors import InputError

            if not isinstance(error, InputError):
                raise
            _refuse(ctx, error.where, error.found, error.allowed)


def _stands_somewhere() -> bool:
    try:
        os.getcwd()
    except FileNotFoundError:
        return False
    return True


def _refuse(ctx: click.Context, where: str, found: str, allowed: str) -> NoReturn:
    """One message, exit code 2."""

    def show() -> None:
        click.secho(f"Error: {visible(where)}", fg="red", err=True)
        click.echo(f"  found:   {visible(found)}", err=True)
        click.echo(f"  allowed: {visible(allowed)}", err=True)

    _say(show)
    ctx.exit(2)


def _say(show: Callable[[], object]) -> None:
    """Show a message; where standard error takes none, the exit code says it alone."""
    try:
        show()
    except OSError:
        silence("stderr")


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="ident")
@click.option(
    "--log-level",
    type=click.Choice(LEVELS),
    envvar="IDENT_LOG_LEVEL",
    show_envvar=True,
    callback=log_level,
    expose_value=False,
    help="Log on standard error what a command does, before its name: ident --log-level info fit ...",
)
def main() -> None:
    """Captive submarine tests to a maneuvering model people trust.

    \b
    ident check raw_captive_data/    what is wrong with the runs
    ident fit raw_captive_data/      identify coefficients, commit a version
    ident runs raw_captive_data/     the run table as read, histories reduced
    ident report                     one HTML page on a version
    ident validate --case hzz20      fly a maneuver and compare
    ident trial zigzag.csv           measure a recorded maneuver
    """


for _module in (start, campaigns, maneuvers, trials, flights, animate, versions, exports, doctor):
    for _command in vars(_module).values():
        if isinstance(_command, click.Command):
            main.add_command(inputs_kept(_command))


if __name__ == "__main__":
    main()
