"""The command line. Commands import what they need when they run, so that --help is quick."""

from __future__ import annotations

from typing import Any

import click

from ident import __version__
from ident.commands import animate, campaigns, doctor, flights, maneuvers, start, trials, versions


class Commands(click.Group):
    """Turns a user's mistake into one message and exit code 2."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; ``InputError`` becomes a message."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            ctx.exit(1)
        except (click.exceptions.Exit, click.ClickException):
            raise
        except Exception as error:
            # Imported only now: the help of a command has no need of it.
            from sim.files.errors import InputError

            if not isinstance(error, InputError):
                raise
            click.secho(f"Error: {error.where}", fg="red", err=True)
            click.echo(f"  found:   {error.found}", err=True)
            click.echo(f"  allowed: {error.allowed}", err=True)
            ctx.exit(2)


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
    ident trial zigzag.csv           measure a recorded maneuver
    """


for _module in (start, campaigns, maneuvers, trials, flights, animate, versions, doctor):
    for _command in vars(_module).values():
        if isinstance(_command, click.Command):
            main.add_command(_command)


if __name__ == "__main__":
    main()
