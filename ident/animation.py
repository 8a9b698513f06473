"""Animation of a maneuver: the boat from its side and from above, strip charts beside it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ident.figures import FRAME, readable
from sim.errors import InputError
from sim.simulate import Simulation
from sim.waves import Waves, kinematics

if TYPE_CHECKING:
    from sim.vehicle import Vehicle

Array = NDArray[np.float64]

_SUFFIXES = (".gif", ".mp4")
# Stations of a silhouette along each part.
_STATIONS = 40
# The box of a boat without geometry: height and breadth over length.
_SLENDER = 0.13
# Picture [inch] and dots an inch: 960 x 576, even as H.264 wants it.
_SIZE, _DPI = (12.0, 7.2), 80
# Side view in boat lengths: half width. Its height follows from the panel's shape.
_HALF_WIDTH = 0.85
# A boat shorter than this share of the track's panel is drawn larger there.
_SEEN = 0.07
_SEA, _SKY, _BOAT = "#cfe4f2", "#f7fbfd", "#2b3a4a"
_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown", "tab:gray")


@dataclass(frozen=True)
class Silhouette:
    """Outlines of a boat's parts, body axes (x forward, y starboard, z down) about the origin [m].

    Attributes
    ----------
    side : Outlines (n, 2) in x, z of each part.
    top : The same in x, y.
    """

    side: list[Array]
    top: list[Array]


def silhouette(vehicle: Vehicle) -> Silhouette:
    """Outlines from the vehicle's surface; a box of its length where it names none.

    Raises
    ------
    InputError
        When the geometry file is wrong.
    """
    if vehicle.geometry is None:
        half = 0.5 * vehicle.particulars.length.value
        tall = _SLENDER * half
        box = np.array([[half, -tall], [half, tall], [-half, tall], [-half, -tall]])
        return Silhouette([box], [box])
    from sim.surface import read_geometry

    mesh = read_geometry(vehicle.geometry)
    side, top = [], []
    for name in mesh.names:
        part = mesh.only(name)
        x = part.corners[:, :, 0]
        # Just inside the ends, where a plane still cuts.
        inset = 1e-3 * (x.max() - x.min())
        spaced = 0.5 * (1.0 - np.cos(np.linspace(0.0, math.pi, _STATIONS)))
        stations = x.min() + inset + (x.max() - x.min() - 2.0 * inset) * spaced
        limits = []
        for at in stations:
            # Of a plane normal to x the other axes are y, z.
            points = np.concatenate(part.cut(0, float(at)))
            if points.size:
                limits.append([at, *points.min(axis=0), *points.max(axis=0)])
        a = np.array(limits)
        for outlines, k in ((top, 1), (side, 2)):
            outlines.append(np.concatenate([a[:, [0, k]], a[::-1][:, [0, k + 2]]]))
    return Silhouette(side, top)


def from_the_side(outline: Array, pitch: float, heel: float = 0.0) -> Array:
    """An outline in the body's x, z as seen from starboard, across the heading.

    Parameters
    ----------
    outline : (n, 2) x forward, z down [m].
    pitch, heel : theta and phi [rad]; theta > 0 lifts the bow.

    Returns
    -------
    (n, 2) ahead along the heading, and depth, from the origin [m].
    """
    x, z = outline.T
    down = z * math.cos(heel)
    c, s = math.cos(pitch), math.sin(pitch)
    return np.column_stack([c * x + s * down, -s * x + c * down])


def from_above(outline: Array, heading: float) -> Array:
    """An outline in the body's x, y as seen from above: (n, 2) north, east from the origin [m]."""
    x, y = outline.T
    c, s = math.cos(heading), math.sin(heading)
    return np.column_stack([c * x - s * y, s * x + c * y])


def sampled(simulation: Simulation, frames: int, start: float | None = None, end: float | None = None) -> Simulation:
    """The record at ``frames`` times equally spaced from start to end, interpolated linearly.

    Raises
    ------
    InputError
        For fewer than two frames, or times that the record does not have.
    """
    time = simulation["t"]
    first = float(time[0]) if start is None else start
    last = float(time[-1]) if end is None else end
    if frames < 2:
        raise InputError("animation, frames", str(frames), "two or more")
    if not time[0] <= first < last <= time[-1]:
        allowed = f"times from {time[0]:g} to {time[-1]:g} s, the end after the start"
        raise InputError("animation, start and end", f"{first:g} and {last:g} s", allowed)
    at = np.linspace(first, last, frames)
    record = np.column_stack([np.interp(at, time, column) for column in simulation.record.T])
    none = np.zeros((0, simulation.executes.shape[1]))
    length, offset = simulation.length, simulation.depth_offset
    return Simulation(simulation.columns, record, none, None, offset, length, simulation.steps, simulation.end)


@dataclass
class _Scene:
    """The axes and what moves in them: one function a panel, called with the frame's number."""

    flight: Simulation
    boat: Silhouette
    waves: Waves | None
    update: list[Callable[[int], None]] = field(default_factory=list)


def _side_view(scene: _Scene, axis: Any) -> None:
    """Boat, depth and sea surface along the heading; the picture follows the boat."""
    from matplotlib.patches import Polygon

    flight, length = scene.flight, scene.flight.length
    box = axis.get_window_extent()
    half, tall = _HALF_WIDTH * length, 2.0 * _HALF_WIDTH * length * box.height / box.width
    z = flight["z"]
    low = np.array(
        [from_the_side(o, t)[:, 1].max() for o in scene.boat.side for t in (flight["theta"].min(), 0.0)]
    ).max()
    crest = 2.0 * float(np.sqrt(np.square(scene.waves.amplitude).sum())) if scene.waves is not None else 0.0
    # Surface to keel in one picture when they fit; else the picture follows the boat's depth.
    above, below = -max(0.06 * tall, 1.2 * crest), float(z.max()) + low + 0.03 * tall
    fits = below - above <= tall
    axis.set(xlim=(-half, half), ylim=(above + tall, above), aspect="equal", facecolor=_SKY)
    axis.set_xlabel("distance ahead of the origin, along the heading [m]")
    axis.set_ylabel("depth z [m]")
    ahead = np.linspace(-1.05 * half, 1.05 * half, 160)
    water = axis.add_patch(Polygon(np.zeros((3, 2)), closed=True, fc=_SEA, ec="tab:blue", lw=1.0, zorder=1))
    parts = [axis.add_patch(Polygon(o, closed=True, fc=_BOAT, ec=_BOAT, lw=0.6, zorder=3)) for o in scene.boat.side]
    axis.grid(alpha=0.3, zorder=0)
    axis.set_axisbelow(False)

    def update(i: int) -> None:
        top = above if fits else min(max(above, float(z[i]) - 0.5 * tall), float("inf"))
        axis.set_ylim(top + tall, top)
        height = np.zeros_like(ahead)
        if scene.waves is not None and scene.waves.amplitude.size:
            heading = float(flight["psi"][i])
            north, east = flight["x"][i] + ahead * math.cos(heading), flight["y"][i] + ahead * math.sin(heading)
            points = np.column_stack([north, east, np.zeros_like(ahead)])
            height = kinematics(scene.waves, points, float(flight["t"][i])).elevation
        floor = top + 2.0 * tall
        ends = [[ahead[-1], floor], [ahead[0], floor]]
        water.set_xy(np.concatenate([np.column_stack([ahead, -height]), ends]))
        for patch, outline in zip(parts, scene.boat.side, strict=True):
            seen = from_the_side(outline, float(flight["theta"][i]), float(flight["phi"][i]))
            patch.set_xy(seen + [0.0, z[i]])

    scene.update.append(update)


def _plan_view(scene: _Scene, axis: Any) -> None:
    """Track and boat from above: north to the right, east down, both axes to one scale."""
    from matplotlib.patches import Polygon

    flight, length = scene.flight, scene.flight.length
    x, y = flight["x"], flight["y"]
    box = axis.get_window_extent()
    wide, tall = float(np.ptp(x)) + 1.6 * length, float(np.ptp(y)) + 1.6 * length
    scale = max(wide / box.width, tall / box.height)
    cx, cy = 0.5 * float(x.min() + x.max()), 0.5 * float(y.min() + y.max())
    half = 0.5 * scale * box.width, 0.5 * scale * box.height
    axis.set(xlim=(cx - half[0], cx + half[0]), ylim=(cy + half[1], cy - half[1]), aspect="equal", facecolor=_SEA)
    axis.set_xlabel("north x [m]")
    axis.set_ylabel("east y [m]")
    axis.grid(color="w", alpha=0.7)
    enlarged = max(1.0, math.ceil(_SEEN * 2.0 * half[0] / length))
    if enlarged > 1.0:
        _note(axis, 0.01, f"boat drawn {enlarged:g} times its size", "left")
    if scene.waves is not None and scene.waves.amplitude.size:
        _wave_arrow(scene.waves, axis)
    (track,) = axis.plot([], [], color="tab:red", lw=1.4)
    parts = [axis.add_patch(Polygon(o, closed=True, fc=_BOAT, ec=_BOAT, lw=0.6, zorder=3)) for o in scene.boat.top]
    (nose,) = axis.plot([], [], color="tab:red", lw=1.2, ls=":")

    def update(i: int) -> None:
        track.set_data(x[: i + 1], y[: i + 1])
        heading, place = float(flight["psi"][i]), np.array([x[i], y[i]])
        for patch, outline in zip(parts, scene.boat.top, strict=True):
            patch.set_xy(place + enlarged * from_above(outline, heading))
        line = place + enlarged * length * np.outer([0.5, 1.1], [math.cos(heading), math.sin(heading)])
        nose.set_data(*line.T)

    scene.update.append(update)


def _note(axis: Any, x: float, text: str, side: str) -> None:
    """A remark under the upper edge of a panel."""
    box = {"fc": "w", "ec": "none", "alpha": 0.75, "pad": 1.5}
    axis.text(x, 0.97, text, transform=axis.transAxes, ha=side, va="top", fontsize=8, bbox=box, zorder=5)


def _wave_arrow(waves: Waves, axis: Any) -> None:
    """Where the waves travel to, each component by its energy."""
    energy = waves.amplitude**2
    north, east = float(energy @ waves.north), float(energy @ waves.east)
    size = math.hypot(north, east)
    if size < 1e-6 * float(energy.sum()):
        return
    box = axis.get_window_extent()
    # Fractions of the panel; east is down on paper.
    step = 0.045 * np.array([north, -east * box.width / box.height]) / size
    middle = np.array([0.93, 0.16])
    arrow = {"arrowstyle": "-|>", "color": "tab:blue", "lw": 2.0}
    axis.annotate(
        "", middle + step, middle - step, xycoords="axes fraction", textcoords="axes fraction", arrowprops=arrow
    )
    _note(axis, 0.99, "arrow: where the waves travel to", "right")


def _strip(scene: _Scene, axis: Any, channels: list[str], last: bool) -> None:
    """Channels over time up to now."""
    flight, lines = scene.flight, []
    t = flight["t"]
    drawn = [readable(c, flight[c]) for c in channels]
    values = np.array([d[0] for d in drawn])
    for k, (series, name, _) in enumerate(drawn):
        (line,) = axis.plot(
            [], [], color=_COLOURS[k % len(_COLOURS)] if len(drawn) > 1 else "tab:red", lw=1.2, label=name
        )
        lines.append((line, series))
    (dots,) = axis.plot([], [], "o", color="k", ms=3, zorder=4)
    room = 0.08 * max(float(np.ptp(values)), 0.02 * float(np.abs(values).max()), 0.05)
    axis.set(xlim=(t[0], t[-1]), ylim=(values.min() - room, values.max() + room))
    if channels == ["D0"]:
        axis.invert_yaxis()
    title = f"{drawn[0][1]} [{drawn[0][2]}]" if len(drawn) == 1 else f"plane angles [{drawn[0][2]}]"
    axis.set_title(title, loc="left", fontsize=9, pad=3)
    axis.grid(alpha=0.3)
    axis.locator_params(axis="y", nbins=5)
    axis.tick_params(labelbottom=last)
    if last:
        axis.set_xlabel("time t [s]")
        # Under the lowest panel, where no line can run through it.
        axis.legend(
            loc="upper center", bbox_to_anchor=(0.5, -0.33), ncols=3, frameon=False, fontsize=8, handlelength=1.2
        )

    def update(i: int) -> None:
        for line, series in lines:
            line.set_data(t[: i + 1], series[: i + 1])
        dots.set_data(np.full(len(lines), t[i]), [series[i] for _, series in lines])

    scene.update.append(update)


def _figure(scene: _Scene, planes: list[str], title: str, fps: float) -> Any:
    """The whole picture; fixed margins, so that nothing moves but what should."""
    from matplotlib.figure import Figure

    flight = scene.flight
    figure = Figure(figsize=_SIZE, dpi=_DPI)
    side, plan = figure.add_axes((0.06, 0.54, 0.55, 0.35)), figure.add_axes((0.06, 0.105, 0.55, 0.335))
    _side_view(scene, side)
    _plan_view(scene, plan)
    rows = [["D0"], ["theta"], ["phi"], planes or ["dV", "dH"]]
    for k, channels in enumerate(rows):
        _strip(scene, figure.add_axes((0.675, 0.735 - 0.19 * k, 0.31, 0.145)), channels, k == len(rows) - 1)
    pace = float(flight["t"][1] - flight["t"][0]) * fps
    head = figure.text(0.5, 0.985, "", ha="center", va="top", fontsize=11)
    figure.text(0.06, 0.012, FRAME, ha="left", va="bottom", fontsize=8, color="0.35")
    side.set_title("from starboard, across the heading", loc="left", fontsize=9, pad=3)
    plan.set_title("from above: track and heading", loc="left", fontsize=9, pad=3)

    def update(i: int) -> None:
        head.set_text(f"{title}\nt = {flight['t'][i]:.1f} s, {pace:.3g} times real time")

    scene.update.append(update)
    return figure


def _writer(path: Path, fps: float) -> Any:
    """The writer of a suffix.

    Raises
    ------
    InputError
        For a suffix that is neither, or MP4 without ffmpeg.
    """
    from matplotlib.animation import FFMpegWriter, PillowWriter

    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(str(path), f"suffix {path.suffix or 'missing'}", " or ".join(_SUFFIXES))
    if not fps > 0.0:
        raise InputError("animation, fps", f"{fps:g}", "more than zero")
    if path.suffix.lower() == ".gif":
        return PillowWriter(fps=fps)
    if not FFMpegWriter.isAvailable():
        raise InputError(str(path), "no ffmpeg on this machine, which MP4 needs", "a path that ends in .gif; or ffmpeg")
    return FFMpegWriter(fps=fps, codec="h264")


def animate(
    simulation: Simulation,
    vehicle: Vehicle,
    waves: Waves | None,
    path: Path,
    *,
    frames: int = 200,
    fps: float = 20.0,
    title: str = "",
    start: float | None = None,
    end: float | None = None,
    each: Callable[[], None] | None = None,
) -> Path:
    """Draw a maneuver as a film: GIF, or MP4 where ffmpeg is installed.

    Parameters
    ----------
    simulation : The flight.
    vehicle : Gives silhouette and planes.
    waves : The sea it flew in; None or no component is calm.
    path : File to write; ``.gif`` or ``.mp4``.
    frames : Number of pictures, equally spaced in time.
    fps : Pictures a second; a GIF holds whole hundredths of a second a picture.
    title : Case and database version.
    start, end : Part of the record to show [s]; all of it by default.
    each : Called after each picture, for a progress bar.

    Returns
    -------
    ``path``.

    Raises
    ------
    InputError
        For another suffix, MP4 without ffmpeg, a path that cannot be written, or fewer than
        two frames.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    writer = _writer(path, fps)
    scene = _Scene(sampled(simulation, frames, start, end), silhouette(vehicle), waves)
    planes = [p.name for p in vehicle.planes if p.name in simulation.columns]
    figure = _figure(scene, planes, title, fps)
    FigureCanvasAgg(figure)
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with writer.saving(figure, str(part), _DPI):
            for i in range(frames):
                for update in scene.update:
                    update(i)
                writer.grab_frame()
                if each is not None:
                    each()
        part.replace(path)
    except OSError as error:
        raise InputError(
            str(path), f"cannot be written: {error.strerror or error}", "a path you may write to"
        ) from error
    finally:
        part.unlink(missing_ok=True)
    return path


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
    case, db, version, vehicle : As for ``ident.validate.validate``.
    out : File; the case's name as GIF when None.
    pictures : Number of frames, frames a second, start and end [s] or None.
    json_path : Where to write what was drawn as JSON, ``-`` for standard output.

    Raises
    ------
    InputError
        As ``validate`` and ``animate``.
    """
    from rich.console import Console
    from rich.progress import Progress

    from ident.cli import _emit
    from ident.validate import validate
    from sim.trim import NoEquilibrium

    frames, fps, start, end = pictures
    console = Console(quiet=json_path == "-")
    if out is not None:
        _writer(out, fps)
    try:
        with console.status("flying the case"):
            done = validate(case, db, version, vehicle)
    except NoEquilibrium as error:
        raise InputError(f"case {case}", str(error), "a state the boat can hold") from error
    database = done.result["database"]
    title = (
        f"{done.case.title}, {done.case.vehicle}; database version {database['version']} ({database['digest'][:16]})"
    )
    path = out or Path(f"{done.case.name}.gif")
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("drawing", total=frames)
        animate(
            done.simulation,
            done.boat.vehicle,
            None,
            path,
            frames=frames,
            fps=fps,
            title=title,
            start=start,
            end=end,
            each=lambda: progress.advance(task),
        )
    size = path.stat().st_size
    console.print(f"animation: {path}, {frames} frames, {size / 1e6:.2g} MB", highlight=False)
    if json_path:
        shown = {"case": done.case.name, "database": database, "file": str(path), "frames": frames, "fps": fps}
        _emit(shown | {"bytes": size}, json_path)
