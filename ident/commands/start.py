"""Commands that begin a project: new and schema."""

from __future__ import annotations

from pathlib import Path

import click

from ident.commands.shared import FOLDER, AnyNumber, Number, PathType, either, emit, json_to


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


@click.command()
@click.argument("surface", type=PathType())
@click.option("--unit", type=click.Choice(["m", "mm", "cm", "in", "ft"]), required=True, help="Of the surface.")
@click.option("--length", type=Number(0, 1e4, min_open=True), required=True, help="Over all [m]; checks the unit.")
@click.option("--x", type=click.Choice(["aft", "forward"]), default="aft", show_default=True, help="Where x points.")
@click.option("--z", type=click.Choice(["up", "down"]), default="up", show_default=True, help="Where z points.")
@click.option("--axis", type=AnyNumber(), default=0.0, show_default=True, help="z of the hull's axis, in the unit.")
@click.option(
    "--out",
    type=PathType(),
    required=True,
    callback=either,
    help="Folder for hull.toml and hull_offsets.csv.",
)
@json_to("Write the offsets as JSON.")
def offsets(
    surface: Path, unit: str, length: float, x: str, z: str, axis: float, out: Path, json_path: str | None
) -> None:
    """Take polar offsets of a hull from an STL file and write its geometry file.

    The surface is the hull alone: closed, its triangles seen from the water counter-clockwise, as long as --length. A
    vehicle file names what is written by geometry = "hull.toml"; a campaign of it without runs is then
    fitted from its lines (docs/your-own-boat.md). Needs the extra cfd.

    \b
    Example: ident offsets hull.stl --unit mm --length 70.2 --out my-boat
    """
    import math

    from ident.cfd.offsets import offsets_of

    if not math.isfinite(axis):
        raise click.UsageError("--axis is a finite number")
    hull = offsets_of(surface, unit, length, x == "forward", z == "up", axis)
    written = hull.write(out)
    if json_path != "-":
        click.echo("\n".join(path.as_posix() for path in written))
        centre = f"its centre {hull.centre:.4g} m behind the nose"
        click.echo(f"volume {hull.volume:.5g} m3, of the surface {hull.surface_volume:.5g} m3, {centre}")
        if hull.stern_first:
            click.echo(f"warning: more of the volume is aft of the middle than before it: is --x {x} right?", err=True)
    if json_path:
        emit(hull.to_dict() | {"files": [path.as_posix() for path in written]}, json_path)
