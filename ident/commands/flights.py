"""Command that writes a flight: fly."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from ident.commands.shared import DB, VERSION, Number, console_for, emit, equilibrium_of, json_to, out_file
from ident.text import on_screen


@dataclass(frozen=True)
class FlyOptions:
    """What `ident fly` was asked."""

    case: str
    vehicle: str | None
    db: str
    version: int | None
    out: Path | None
    every: float | None
    loads: str | None
    samples: int | None
    seed: int | None
    quantiles: str | None
    json_path: str | None

    def check(self) -> None:
        """Refuse options that do not go together. Raises ``click.UsageError``."""
        if self.samples and self.loads:
            raise click.UsageError("--loads goes with one flight, without --samples")
        if not self.samples and (self.quantiles or self.seed is not None):
            raise click.UsageError("--quantiles and --seed go with --samples")


@click.command()
@click.option("--case", "case", required=True, help="Bundled case name, or path to a case file.")
@click.option("--vehicle", default=None, help="Bundled vehicle or path to a vehicle file, instead of the case's.")
@DB
@VERSION
@out_file("File to write, .csv, .parquet or .nc; CASE_vVERSION.csv by default.")
@click.option("--every", type=Number(min=0, min_open=True), default=None, help="Seconds between records.")
@click.option(
    "--loads",
    type=click.Choice(["part", "coefficient"]),
    default=None,
    help="Also the loads on the boat over time, by part or by term.",
)
@click.option("--samples", type=click.IntRange(min=2), default=None, help="To .nc: so many sets drawn from the errors.")
@click.option("--seed", type=click.IntRange(min=0), default=None, help="With --samples: seed of the draws, 0 without.")
@click.option("--quantiles", default=None, metavar="Q,Q,...", help="With --samples: curves at these shares, 0 to 1.")
@json_to("Write what was flown as JSON.")
def fly(**options: Any) -> None:
    """Fly a maneuver and write its history: states, planes, commands, flow angles, surface.

    Program frame, SI and radians, every digit.

    \b
    Example: ident fly --case hzz20 --out hzz20.csv
             ident fly --case ss5-4m --every 0.5 --out ss5.nc
             ident fly --case hzz20 --loads part --out loads.parquet
             ident fly --case hzz20 --samples 200 --quantiles 0.025,0.5,0.975 --out band.nc
    """
    asked = FlyOptions(**options)
    asked.check()
    from ident.exports.fly import Draws, Recording, fly_to_file
    from ident.validation.compiling import loop_of

    draws = Draws(asked.samples, asked.seed or 0, _shares(asked.quantiles)) if asked.samples else None
    console = console_for(quiet=asked.json_path == "-")
    with equilibrium_of(asked.case), console.status("flying the case"), loop_of(asked.case):
        recording = Recording(asked.every, draws, asked.loads)
        written = fly_to_file(asked.case, asked.db, asked.version, asked.vehicle, asked.out, recording)
    console.print(f"history: {on_screen(written.file)}, {written.records} records", highlight=False)
    if asked.json_path:
        emit(written.to_dict(), asked.json_path)


def _shares(text: str | None) -> tuple[float, ...]:
    """Quantiles as they are typed."""
    if text is None:
        return ()
    try:
        shares = tuple(float(word) for word in text.split(","))
    except ValueError as error:
        raise click.UsageError(f"--quantiles {text}: numbers between 0 and 1, with commas") from error
    if not all(0.0 <= share <= 1.0 for share in shares):
        raise click.UsageError(f"--quantiles {text}: numbers between 0 and 1, with commas")
    return shares
