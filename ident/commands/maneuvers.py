"""Commands that fly a version: validate, calibrate, stability."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ident.commands.shared import (
    DB,
    MESSAGE,
    OUT,
    VERSION,
    WAIT,
    Number,
    PathType,
    console_for,
    emit,
    equilibrium_of,
    json_to,
    out_file,
)
from ident.text import on_screen, visible

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ident.validation.board import Scoreboard
    from ident.validation.figure_files import Drawn
    from ident.validation.result import Validation


_OF_ONE_CASE = ("vehicle", "speed", "depth", "angle", "reference", "trial", "frame")


@dataclass(frozen=True)
class ValidateOptions:
    """What `ident validate` was asked: one case, or every case; from which version; against what; with which bands."""

    case: str | None
    every: bool
    cases: Path | None
    db: str
    version: int | None
    out: Path
    json_path: str | None
    figures: str
    history: str | None
    strict: bool
    samples: int | None
    seed: int
    dask: str | None
    left_out: tuple[str, ...]
    loads: str | None
    vehicle: str | None
    speed: float | None
    depth: float | None
    angle: float | None
    reference: Path | None
    trial: Path | None
    frame: str | None

    def of_one_case(self) -> dict[str, Any]:
        """What goes with a single case only, as ``ident.validate`` takes it."""
        from ident.options import Conditions, OwnReference

        reference = OwnReference(self.reference, self.frame, self.trial) if self.reference is not None else None
        conditions = Conditions(self.speed, self.depth, self.angle)
        return {"vehicle": self.vehicle, "reference": reference, "conditions": conditions}

    def check(self) -> None:
        """Refuse options that do not go together. Raises ``click.UsageError``."""
        alone = "--vehicle, --speed, --depth, --angle, --reference, --frame"
        for wrong, text in (
            (self.case == "", "--case is empty; give the name of a case or the path of a case file"),
            ((self.case is None) == (not self.every), "give either --case NAME or --all"),
            (self.every and any(getattr(self, name) for name in _OF_ONE_CASE), f"{alone} go with --case"),
            (self.loads and self.every, "--loads goes with --case"),
            (self.cases and not self.every, "--cases goes with --all"),
            (self.dask and not self.samples, "--dask goes with --samples"),
            (self.frame and not self.reference, "--frame goes with --reference"),
            (self.trial and not self.reference, "--trial goes with --reference"),
        ):
            if wrong:
                raise click.UsageError(text)


@dataclass(frozen=True)
class CalibrateOptions:
    """What `ident calibrate` was asked."""

    name: str
    db: str
    version: int | None
    message: str
    left_out: bool
    posterior: int | None
    sensitivity: int | None
    seed: int | None
    cross_validate: bool
    json_path: str | None
    wait: float

    def check(self) -> None:
        """Refuse options that do not go together. Raises ``click.UsageError``."""
        if self.seed is not None and not (self.posterior or self.sensitivity):
            raise click.UsageError("--seed goes with --posterior or --sensitivity")


@click.command()
@click.option("--case", "case", default=None, help="Bundled case name, or path to a case file.")
@click.option("--all", "every", is_flag=True, help="Fly every bundled case and print the scoreboard.")
@click.option(
    "--cases",
    type=PathType(),
    default=None,
    help="With --all: a folder of your own cases too.",
)
@DB
@VERSION
@OUT
@json_to("Write the comparison as JSON.")
@click.option("--figures", type=click.Choice(["png", "svg", "pdf"]), default="png", show_default=True, help="Format.")
@click.option(
    "--history",
    type=click.Choice(["csv", "parquet", "nc"]),
    is_flag=False,
    flag_value="csv",
    default=None,
    help="Also write every flight to --out, as CSV without a word.",
)
@click.option("--strict", is_flag=True, help="Exit 1 when a tolerance of a case file is missed.")
@click.option("--samples", type=click.IntRange(min=2), default=None, help="Draw so many coefficient sets; error bands.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the draws.")
@click.option(
    "--without", "left_out", multiple=True, metavar="NAME", help="Fly without a term or an estimate; may be repeated."
)
@click.option(
    "--loads",
    type=click.Choice(["part", "coefficient"]),
    default=None,
    help="With --case: loads over time by part or by term, as CSV, figure and in --json.",
)
@click.option("--dask", default=None, metavar="ADDRESS", help="With --samples: fly them on a Dask cluster.")
@click.option("--vehicle", default=None, help="With --case: bundled vehicle or vehicle file, not the case's.")
@click.option("--speed", type=Number(min=0, min_open=True), default=None, help="With --case: U [m/s].")
@click.option("--depth", type=Number(min=0), default=None, help="With --case: depth of the sail top [m].")
@click.option("--angle", type=Number(0, 90, min_open=True), default=None, help="With --case: planes [deg].")
@click.option(
    "--reference",
    type=PathType(),
    default=None,
    help="With --case: a recorded trial, or a CSV of source, channel, t or s, value, unit, and sigma if known.",
)
@click.option("--trial", type=PathType(), default=None, help="With --reference: its trial.toml.")
@click.option(
    "--frame",
    type=click.Choice(["source", "program"]),
    default=None,
    help="Frame of --reference: source is x aft, z up; program x forward, z down. The case's by default.",
)
def validate(**options: Any) -> None:
    """Fly a maneuver from the database and compare it with its references.

    \b
    Example: ident validate --case hzz20 --json -
             ident validate --case hzz20 --samples 1000
             ident validate --case hzz20 --without N_cross --without even_loads
             ident validate --case hzz20 --loads part
             ident validate --case hzz20 --history nc
             ident validate --case hzz20 --samples 100000 --dask tcp://scheduler:8786
             ident validate --case turn20-4m --reference mine.csv --frame program
             ident validate --case turning-circle --vehicle my_boat.toml --speed 1.5 --angle 15
             ident validate --all
             ident validate --all --samples 200
    """
    asked = ValidateOptions(**options)
    asked.check()
    console = console_for(quiet=asked.json_path == "-")
    with _figures(asked) as figures:
        with equilibrium_of(asked.case or "of --all", "" if asked.every else "; --speed and --depth state another"):
            board = _all(asked, console) if asked.every else None
            done = [_one(asked, console)] if board is None else board.flown
        if asked.samples:
            done = _with_bands(done, asked, console)
            board = board and _board_with_bands(board, done, asked, console)
        for figure in figures(done):
            console.print(f"figure: {on_screen(figure)}", highlight=False)
    if asked.history:
        _histories(done, asked.out, asked.history, console)
    by_source = _loads(done[0], asked.loads, asked.out, console) if asked.loads else {}
    if asked.json_path:
        result = done[0].to_dict() | by_source if board is None else board.to_dict()
        emit(result | ({"without": list(asked.left_out)} if asked.left_out else {}), asked.json_path)
    unfinished = [one.case.name for one in done if not one.complete]
    if unfinished:
        click.echo(f"left the finite numbers: {', '.join(map(visible, unfinished))}", err=True)
        raise click.exceptions.Exit(1)
    if asked.strict and not all(one.passed for one in done):
        raise click.exceptions.Exit(1)


def _loads(done: Validation, by: str, out: Path, console: Any) -> dict[str, Any]:
    """Write the loads of a flight by part or term; what the JSON says of them."""
    from ident.validation.loads import write_loads

    table, data, figure = write_loads(done, by, out)
    for path in (data, figure):
        console.print(f"loads: {on_screen(path)}", highlight=False)
    sources = {str(name): rows.drop(columns=["t_s", "source"]) for name, rows in table.groupby("source", sort=False)}
    time = table.loc[table["source"] == table["source"].iloc[0], "t_s"]
    listed = {name: {c: rows[c].tolist() for c in rows} for name, rows in sources.items()}
    return {"loads": {"by": by, "t_s": time.tolist(), "sources": listed}}


def _histories(done: list[Validation], out: Path, kind: str, console: Any) -> None:
    from ident.exports.validated import write_histories

    for one in done:
        for path in write_histories(one, out, kind):
            console.print(f"history: {on_screen(path)}", highlight=False)


@contextlib.contextmanager
def _figures(asked: ValidateOptions) -> Iterator[Drawn]:
    from ident.validation.figure_files import figures_of_many, figures_of_one

    if asked.every or asked.samples:
        # Samples are too many to hand to another process.
        yield partial(figures_of_many, asked.out, asked.figures)
        return
    with figures_of_one(asked.out, asked.figures) as drawn:
        yield drawn


def _one(asked: ValidateOptions, console: Any) -> Validation:
    import ident
    from ident.validation.compiling import loop_of
    from ident.validation.tables import show

    assert asked.case is not None
    with console.status("flying the case"), loop_of(asked.case):
        done = ident.validate(asked.case, asked.db, asked.version, without=asked.left_out, **asked.of_one_case())
    if asked.loads:
        from ident.validation.loads import check_parts

        check_parts(done.case)
    show(done, console)
    return done


def _with_bands(done: list[Validation], asked: ValidateOptions, console: Any) -> list[Validation]:
    """Fly the samples of every case with a progress bar, and print what they say."""
    from rich.progress import Progress

    from ident.validation.band_summary import show
    from ident.validation.reliability import show_coverage, show_intervals

    assert asked.samples is not None
    sampled = []
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("flying samples", total=asked.samples * len(done))
        for one in done:
            each = partial(progress.advance, task)
            sampled.append(one.with_bands(asked.samples, asked.seed, each, asked.dask))
    for one in sampled:
        if len(sampled) == 1 and one.band_summary:
            show(one.band_summary, console)
        console.print(f"[bold]{one.case.name}[/]", highlight=False)
        show_intervals(one.metrics, console)
        show_coverage(one.coverage, "references", console)
    return sampled


def _board_with_bands(board: Scoreboard, done: list[Validation], asked: ValidateOptions, console: Any) -> Scoreboard:
    """The board with bands and coverage case by case and over all references; draws the reliability diagram."""
    from ident.validation.reliability import reliability_figure, show_coverage

    sampled = board.with_validations(done)
    show_coverage(sampled.coverage, "all references", console)
    if sampled.reliability:
        path = asked.out / f"reliability_v{board.database['version']}.{asked.figures}"
        console.print(f"figure: {reliability_figure(sampled.reliability, path)}", highlight=False)
    return sampled


def _all(asked: ValidateOptions, console: Any) -> Scoreboard:
    from ident.validation.compiling import loop_of
    from ident.validation.scoreboard import scoreboard
    from ident.validation.scoreboard_tables import show

    with console.status("flying") as status, loop_of(None):
        board = scoreboard(
            asked.db,
            asked.version,
            cases=asked.cases,
            without=asked.left_out,
            tell=lambda name, place, of: status.update(f"flying {on_screen(name)}, {place + 1} of {of}"),
        )
    show(board, console)
    for name, kind in board.passed_over.items():
        console.print(f"passed over, a {kind}: {on_screen(name)}", highlight=False, markup=False)
    return board


@click.command()
@click.argument("name")
@DB
@VERSION
@MESSAGE
@click.option("--left-out/--no-left-out", default=True, show_default=True, help="Repeat without each source in turn.")
@click.option(
    "--posterior",
    type=click.IntRange(min=1),
    default=None,
    metavar="N",
    help="Also draw the posterior N times (emcee).",
)
@click.option(
    "--sensitivity",
    type=click.IntRange(min=2),
    default=None,
    metavar="N",
    help="Also say which prior decides each channel; N a power of two (SALib).",
)
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=None, help="Of --posterior and --sensitivity; 0.")
@click.option("--cross-validate", is_flag=True, help="Also predict each maneuver by a calibration on the others.")
@json_to("Write priors, posteriors and diagnostics.")
@WAIT
def calibrate(**options: Any) -> None:
    """Estimate multipliers of coefficient groups from free-running maneuvers.

    NAME is a bundled calibration or a path to a file. Commits a new version whose parent is the
    captive one it started from (the latest, or --version).

    \b
    Example: ident calibrate bb2
             ident calibrate my_boat.toml --no-left-out --json -
             ident calibrate bb2 --no-left-out --posterior 4000
             ident calibrate bb2 --no-left-out --sensitivity 64
             ident calibrate bb2 --no-left-out --cross-validate
    """
    import ident
    from ident.calibration.result import show

    asked = CalibrateOptions(**options)
    asked.check()
    console = console_for(quiet=asked.json_path == "-")
    with console.status("calibrating") as status:
        work = ident.Work(asked.wait, lambda what, done, of: status.update(on_screen(what)))
        diagnostics = ident.Diagnostics(asked.posterior or 0, asked.sensitivity or 0, asked.seed, asked.cross_validate)
        done = ident.calibrate(
            asked.name,
            asked.db,
            asked.version,
            asked.message,
            asked.left_out,
            diagnostics=diagnostics,
            work=work,
        )
    show(done, console)
    if asked.json_path:
        emit(done.to_dict(), asked.json_path)


@click.command()
@DB
@VERSION
@click.option("--case", "case", default="hzz20", show_default=True, help="Case that gives vehicle and environment.")
@click.option("--speed", "speeds", type=Number(0, 100, min_open=True), multiple=True, help="U [m/s]; repeat.")
@click.option("--depth", "depths", type=Number(0, 11000), multiple=True, help="D0 [m]; repeat.")
@out_file("Figure to draw, .png, .svg or .pdf: root loci and Bode plots over speed and depth.")
@json_to("Write the results as JSON.")
def stability(
    db: str,
    version: int | None,
    case: str,
    speeds: tuple[float, ...],
    depths: tuple[float, ...],
    out: Path | None,
    json_path: str | None,
) -> None:
    """Stability indices, eigenvalues and critical speeds against speed and depth.

    Without --speed and --depth, at the tabulated speeds and the depths of the drift runs.

    \b
    Example: ident stability --speed 3 --speed 5 --depth 25
             ident stability --out roots.svg
    """
    import ident
    from ident.analysis.tables import show

    for name, values in (("speed", speeds), ("depth", depths)):
        if any(not math.isfinite(v) for v in values):
            raise click.UsageError(f"--{name} is a finite number")
    console = console_for(quiet=json_path == "-")
    with console.status("linearising"):
        states = ident.stability(case, db, version, speeds, depths)
    show(states, console)
    if out:
        from ident.analysis.figures import stability_figure

        console.print(f"figure: {on_screen(stability_figure(states, out))}", highlight=False)
    if json_path:
        emit(states.to_dict(), json_path)
