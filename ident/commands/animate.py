"""`ident animate`: a maneuver as a film. Imports are inside, so that --help is quick."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click

from ident.commands.shared import DB, VERSION, AnyNumber, Number, console_for, emit, equilibrium_of, json_to, out_file
from ident.text import in_file_name, on_screen


@click.command()
@click.option("--case", "case", required=True, help="Bundled case name, or path to a case file.")
@DB
@VERSION
@click.option("--vehicle", default=None, help="Bundled vehicle or path to a vehicle file, instead of the case's.")
@out_file("File to write, .gif or .mp4; CASE.gif.")
@click.option("--frames", type=click.IntRange(2, 2000), default=200, show_default=True, help="Number of pictures.")
@click.option("--fps", type=Number(1, 50), default=20.0, show_default=True, help="Pictures a second.")
@click.option("--start", type=AnyNumber(), default=None, help="Time to begin at [s].")
@click.option("--end", type=AnyNumber(), default=None, help="Time to end at [s].")
@json_to("Write what was drawn as JSON.")
def animate(**options: Any) -> None:
    """Draw a maneuver as an animation: boat, track, depth, pitch, heel and planes.

    \b
    Example: ident animate --case hzz20 --db coeff_db --out hzz20.gif
             ident animate --case vzz10-10kt --frames 100 --end 120
    """
    draw(AnimateOptions(**options))


@dataclass(frozen=True)
class AnimateOptions:
    """What `ident animate` was asked: a case as of `ident validate`, a file, and which pictures."""

    case: str
    db: str
    version: int | None
    vehicle: str | None
    out: Path | None
    frames: int
    fps: float
    start: float | None
    end: float | None
    json_path: str | None


def draw(asked: AnimateOptions) -> None:
    """Fly a case as ``ident validate`` does, draw it with a progress bar, and say what was drawn.

    Raises
    ------
    InputError
        As ``validate`` and ``ident.animation.film.animate``.
    """
    from rich.progress import Progress

    import ident
    from ident.animation.film import Film, writer_of
    from ident.animation.film import animate as as_film
    from ident.validation.compiling import loop_of
    from sim.boat.database import version_words

    console = console_for(quiet=asked.json_path == "-")
    if asked.out is not None:
        writer_of(asked.out, asked.fps)
    with equilibrium_of(asked.case), console.status("flying the case"), loop_of(asked.case):
        done = ident.validate(asked.case, asked.db, asked.version, vehicle=asked.vehicle)
    title = f"{done.case.title}, {done.case.vehicle}; {version_words(done.database)}"
    path = asked.out or Path(f"{in_file_name(done.case.name)}.gif")
    film = Film(asked.frames, asked.fps, asked.start, asked.end, title)
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("drawing", total=film.frames)
        each = partial(progress.advance, task)
        as_film(done.simulation, done.boat.vehicle, done.simulation.waves, path, film, each)
    size = path.stat().st_size
    console.print(f"animation: {on_screen(path)}, {film.frames} frames, {size / 1e6:.2g} MB", highlight=False)
    if asked.json_path:
        shown = {"case": done.case.name, "database": done.database, "file": str(path)}
        emit(shown | {"frames": film.frames, "fps": film.fps, "bytes": size}, asked.json_path)
