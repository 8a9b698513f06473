"""`ident animate`: a maneuver as a film. Imports are inside, so that --help is quick."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.option("--case", "case", required=True, help="Bundled case name, or path to a case file.")
@click.option("--db", default="coeff_db", show_default=True, help="Database folder or object-store URL.")
@click.option("--version", "version", type=int, default=None, help="Database version; latest by default.")
@click.option("--vehicle", default=None, help="Bundled vehicle or path to a vehicle file, instead of the case's.")
@click.option("--out", type=click.Path(path_type=Path), default=None, help="File to write, .gif or .mp4; CASE.gif.")
@click.option("--frames", type=click.IntRange(2, 2000), default=200, show_default=True, help="Number of pictures.")
@click.option("--fps", type=click.FloatRange(1, 50), default=20.0, show_default=True, help="Pictures a second.")
@click.option("--start", type=float, default=None, help="Time to begin at [s].")
@click.option("--end", type=float, default=None, help="Time to end at [s].")
@click.option("--json", "json_path", default=None, metavar="PATH|-", help="Write what was drawn as JSON.")
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
    from ident.animation import film

    film(case, db, version, vehicle, out, (frames, fps, start, end), json_path)
