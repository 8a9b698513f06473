"""Commands that begin a project: new and schema."""

from __future__ import annotations

from pathlib import Path

import click

from ident.commands.shared import FOLDER, emit, json_to


@click.command()
@FOLDER
@json_to("Write the names of the files as JSON.")
def new(folder: Path, json_path: str | None) -> None:
    """Write a commented starter boat, campaign, case and calibration into FOLDER.

    \b
    Example: ident new my-boat
             ident fit my-boat/captive --db my-boat/db
             ident validate --case my-boat/zigzag.toml --db my-boat/db
    """
    import ident

    written = ident.write_starter(folder)
    if json_path != "-":
        click.echo("\n".join(path.as_posix() for path in written))
    if json_path:
        emit({"folder": str(folder), "files": [path.as_posix() for path in written]}, json_path)


@click.command()
@click.argument("kind", type=click.Choice(["vehicle", "campaign", "case", "calibration", "trial"]))
@json_to("Write the schema to a file; it is printed without.")
def schema(kind: str, json_path: str | None) -> None:
    """Print the JSON schema of a kind of file, for editors: every key, what it takes and means.

    \b
    Example: ident schema campaign > campaign.schema.json
             ident schema case --json case.schema.json
    """
    import ident

    emit(ident.schema(kind), json_path or "-")
