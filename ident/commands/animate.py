"""`ident animate`: a maneuver as a film. Imports are inside, so that --help is quick."""

from __future__ import annotations

from pathlib import Path

import click

from ident.commands.shared import DB, VERSION, console_for, emit, equilibrium_of, json_to, out_file
from ident.text import in_file_name, on_screen


@click.command()
@click.option("--case", "case", required=True, help="Bundled case name, or path to a case file.")
@DB
@VERSION
@click.option("--vehicle", default=None, help="Bundled vehicle or path to a vehicle file, instead of the case's.")
@out_file("File to write, .gif or .mp4; CASE.gif.")
@click.option("--frames", type=click.IntRange(2, 2000), default=200, show_default=True, help="Number of pictures.")
@click.option("--fps", type=click.FloatRange(1, 50), default=20.0, show_default=True, help="Pictures a second.")
@click.option("--start", type=float, default=None, help="Time to begin at [s].")
@click.option("--end", type=float, default=None, help="Time to end at [s].")
@json_to("Write what was drawn as JSON.")
def animate(
    case: str,
    db: str,
    version: int | None,
    vehicle: str | None,
    out: Path | None,
    frames: int,
    fps: float,
    start: float | None,
    end: float | None,
    json_path: str | None,
) -> None:
    """Draw a maneuver as an animation: boat, track, depth, pitch, heel and planes.

    \b
    Example: ident animate --case hzz20 --db coeff_db --out hzz20.gif
             ident animate --case vzz10-10kt --frames 100 --end 120
    """
    film(case, db, version, vehicle, out, (frames, fps, start, end), json_path)


def film(
    case: str,
    db: str,
    version: int | None,
    vehicle: str | None,
    out: Path | None,
    pictures: tuple[int, float, float | None, float | None],
    json_path: str | None,
) -> None:
    """Fly a case as ``ident validate`` does, draw it with a progress bar, and say what was drawn.

    Parameters
    ----------
    case, db, version, vehicle : As for ``ident.validate``.
    out : File; the case's name as GIF when None.
    pictures : Number of frames, frames a second, start and end [s] or None.
    json_path : Where to write what was drawn as JSON, ``-`` for standard output.

    Raises
    ------
    InputError
        As ``validate`` and ``animate``.
    """
    from rich.progress import Progress

    import ident
    from ident.animation.film import animate as draw
    from ident.animation.film import writer_of
    from sim.boat.database import version_words

    frames, fps, start, end = pictures
    console = console_for(quiet=json_path == "-")
    if out is not None:
        writer_of(out, fps)
    with equilibrium_of(case), console.status("flying the case"):
        done = ident.validate(case, db, version, vehicle=vehicle)
    database = done.database
    title = f"{done.case.title}, {done.case.vehicle}; {version_words(database)}"
    path = out or Path(f"{in_file_name(done.case.name)}.gif")
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("drawing", total=frames)
        draw(
            done.simulation,
            done.boat.vehicle,
            done.simulation.waves,
            path,
            frames=frames,
            fps=fps,
            title=title,
            start=start,
            end=end,
            each=lambda: progress.advance(task),
        )
    size = path.stat().st_size
    console.print(f"animation: {on_screen(path)}, {frames} frames, {size / 1e6:.2g} MB", highlight=False)
    if json_path:
        shown = {"case": done.case.name, "database": database, "file": str(path), "frames": frames, "fps": fps}
        emit(shown | {"bytes": size}, json_path)
