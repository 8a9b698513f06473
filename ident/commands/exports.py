"""Commands that take a version out of the program and back into it: export, import."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from ident.commands.shared import DB, VERSION, WAIT, PathType, console_for, either, emit, equilibrium_of, json_to
from ident.text import on_screen, visible

# Formats that write the coefficients, and those that write a boat in a case.
_ROWS = ("csv", "parquet", "json")
_FLOWN = ("c", "fmu")
_VEHICLE = ("daveml", "jsbsim", "gazebo")
_CASE = "hzz20"


@click.command()
@click.argument("path", type=PathType(), callback=either)
@click.option("--format", "kind", type=click.Choice([*_ROWS, *_FLOWN, *_VEHICLE]), default="csv", show_default=True)
@click.option(
    "--case",
    "case",
    default=None,
    help=f"With --format {', '.join((*_FLOWN, *_VEHICLE))}: boat, start, water, step; {_CASE} without.",
)
@click.option("--vehicle", default=None, help="With --case: bundled vehicle or vehicle file, instead of the case's.")
@click.option(
    "--fmi",
    type=click.Choice(["2", "3", "2.0", "3.0"]),
    default=None,
    help="With --format fmu: version of FMI, 2 without.",
)
@DB
@VERSION
@json_to("Write what was exported as JSON.")
def export(
    path: Path,
    kind: str,
    case: str | None,
    vehicle: str | None,
    fmi: str | None,
    db: str,
    version: int | None,
    json_path: str | None,
) -> None:
    """Write one version for other programs.

    PATH is a folder or, for csv, parquet and json, a file with that ending. csv, parquet: the coefficients as a plain
    file. json: the version whole, with units, frame, covariance and digest, which `ident import` reads back. c: the
    boat in a case as one header and one source of C99, which step as the simulator does. fmu: the same as an FMU for
    co-simulation, with its sources, compiled by the C compiler of this machine; PATH is FILE.fmu. daveml: the tables
    of the case's vehicle with check cases (ANSI/AIAA S-119); PATH is FILE.dml. jsbsim: an aircraft file whose external
    reactions are the boat's loads; PATH is NAME/NAME.xml. gazebo: an SDF model with the terms of Gazebo's hydrodynamics
    plugin, fitted where they are tables here; PATH is FILE.sdf. What a format cannot hold is printed, and stands in its
    file.

    \b
    Example: ident export --version 0 --format csv exported/
             ident export --format c --case ss5-4m exported/
             ident export --format fmu --case hzz20 hzz20.fmu
             ident export --format daveml bb2.dml
             ident export --format gazebo --case hzz20 bb2.sdf
    """
    if kind in _ROWS and (case or vehicle):
        raise click.UsageError(f"--case and --vehicle go with --format {', '.join((*_FLOWN, *_VEHICLE))}")
    if fmi and kind != "fmu":
        raise click.UsageError("--fmi goes with --format fmu")
    console = console_for(quiet=json_path == "-")
    with console.status("writing"):
        if kind in _ROWS:
            done = _rows(path, kind, db, version)
        else:
            done = _flown(path, kind, case or _CASE, vehicle, db, version, int((fmi or "2")[0]))
    if json_path != "-":
        for name in done.get("files", [done.get("file")]):
            click.echo(visible(name))
        for one in done.get("lost", ()):
            click.echo(visible(f"lost: {one}"), err=True)
    if json_path:
        emit(done, json_path)


def _rows(path: Path, kind: str, db: str, version: int | None) -> dict[str, Any]:
    from ident.database import compare

    if kind == "json":
        from ident.exports.exchange import export_exchange

        return export_exchange(db, version, path)
    return compare.export(db, version, kind, path)


def _flown(
    path: Path, kind: str, name: str, vehicle_name: str | None, db: str, version: int | None, fmi: int
) -> dict[str, Any]:
    from ident.output import check_file, check_folder
    from ident.validation.boats import Fleet
    from sim.boat.vehicle import load_vehicle
    from sim.flight.case import load_case

    (check_folder if kind == "c" else check_file)(path)
    case, where = load_case(name)
    vehicle = load_vehicle(vehicle_name) if vehicle_name is not None else load_vehicle(case.vehicle, beside=where)
    boat = Fleet(db, version).boat(vehicle)
    with equilibrium_of(on_screen(name)):
        if kind == "daveml":
            from ident.exports.daveml import export_daveml

            return export_daveml(boat, db, path)
        if kind == "jsbsim":
            from ident.exports.jsbsim import export_jsbsim

            return export_jsbsim(boat, case, db, path)
        if kind == "gazebo":
            from ident.exports.gazebo import export_gazebo

            return export_gazebo(boat, case, db, path)
        if kind == "c":
            from ident.exports.c_source import export_c

            return export_c(boat, case, db, path)
        from ident.exports.fmu import export_fmu

        return export_fmu(boat, case, db, path, fmi)


@click.command("import")
@click.argument("path", type=PathType())
@DB
@WAIT
@json_to("Write what was imported as JSON.")
def import_(path: Path, db: str, wait: float, json_path: str | None) -> None:
    """Commit the version that an exchange file holds, to the same digest.

    PATH is a file of `ident export --format json`. Rows that have another digest than it says are refused.

    \b
    Example: ident import coefficients_v0.json --db coeff_db
    """
    from ident.exports.exchange import import_exchange

    done = import_exchange(path, db, wait)
    if json_path != "-":
        for one in done:
            said = f"version {one.version}" if one.new else f"the same as version {one.version}"
            click.echo(f"{visible(one.vehicle)}: {said}, {one.rows} rows, digest {one.digest[:16]}")
    if json_path:
        emit({"database": db, "vehicles": [asdict(one) for one in done]}, json_path)
