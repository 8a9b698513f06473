"""The command on recorded maneuvers: trial."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click

from ident.commands.shared import Number, PathType, console_for, either, emit, json_to, out_file
from ident.text import on_screen

# What may follow the first word of a maneuver: its angles, and second words; three words at most.
_FOLLOWS = re.compile(r"\d+(\.\d+)?(/\d+(\.\d+)?)?|zig-?zag|circle|spiral|out|stop|decay|change|keeping", re.IGNORECASE)
_WORDS = 3


def _follows(text: str) -> bool:
    return _FOLLOWS.fullmatch(text) is not None and not Path(text).exists()


def _as_one_word(args: list[str]) -> list[str]:
    """Arguments in which the words after ``--maneuver`` are one; a file that exists is no such word."""
    for at, text in enumerate(args):
        if text != "--maneuver" and not text.startswith("--maneuver="):
            continue
        first = at + (text == "--maneuver")
        words, rest = args[first : first + 1], args[first + 1 :]
        while (
            rest
            and len(" ".join(words).split()) < _WORDS
            and _FOLLOWS.fullmatch(rest[0])
            and not Path(rest[0]).exists()
        ):
            words.append(rest.pop(0))
        named = [" ".join(words)] if words else []
        return [*args[:first], *named, *_as_one_word(rest)]
    return args


class _Maneuver(click.Command):
    """A command whose ``--maneuver zigzag 20/20`` needs no quotation marks."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        return super().parse_args(ctx, _as_one_word(args))


@click.command(cls=_Maneuver)
@click.argument("path", metavar="FILE|DIR", type=PathType())
@click.option("--spec", type=PathType(), default=None, help="trial.toml: what the record does not say.")
@click.option("--maneuver", default="", help="As zigzag 20/20 or turning_circle 35, instead of the spec's.")
@click.option("--scale", type=Number(min=0, min_open=True), default=None, help="Full scale over model scale.")
@click.option("--length", "length", type=Number(min=0, min_open=True), default=None, help="L [m], full scale.")
@click.option(
    "--figures",
    type=PathType(),
    default=None,
    callback=either,
    help="Folder for the plots of the report.",
)
@out_file("Write the metrics as CSV.")
@json_to("Write maneuver, assumptions, metrics with standard errors and findings.")
def trial(
    path: Path,
    spec: Path | None,
    maneuver: str,
    scale: float | None,
    length: float | None,
    figures: Path | None,
    out: Path | None,
    json_path: str | None,
) -> None:
    """Measure a recorded maneuver: ITTC metrics with standard errors, IMO criteria, findings.

    FILE is the record; DIR holds several, compared run by run and port against starboard.

    \b
    Example: ident trial zigzag.csv --json -
             ident trial zigzag.csv --maneuver zigzag 20/20 --figures reports
             ident trial model.csv --spec trial.toml --out metrics.csv
    """
    from ident.output import check_folder
    from ident.trials.report import measure_all, show, write_csv
    from ident.trials.spec import TrialFile, load_spec
    from sim.files.schema import checked

    stated: dict[str, Any] = {"maneuver": maneuver or None, "scale": scale, "length_m": length}
    given = {k: v for k, v in stated.items() if v is not None}
    read = load_spec(spec).model_dump(exclude_unset=True)
    statements = checked(TrialFile, read | given, f"--{', --'.join(given)}".replace("_m", "") if given else str(spec))
    if figures is not None:
        check_folder(figures)
    console = console_for(quiet=json_path == "-")
    with console.status("reading and measuring"):
        done = measure_all(path, statements)
    show(done, console)
    if figures is not None:
        from ident.trials.figures import trial_figure

        for one in done.trials:
            console.print(f"figure: {on_screen(trial_figure(one, figures))}", highlight=False)
    if out is not None:
        write_csv(done, out)
        console.print(f"metrics: {on_screen(out)}", highlight=False)
    if json_path:
        emit(done.to_dict(), json_path)
