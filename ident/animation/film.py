"""Animation of a maneuver: the boat from its side and from above, strip charts beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ident.animation.silhouette import Silhouette, from_above, from_the_side, silhouette
from ident.output import whole
from ident.text import in_figure
from ident.validation.figures import FRAME, readable
from sim.files.errors import InputError
from sim.flight.simulation import Simulation
from sim.waves.linear import Waves, kinematics, mean_direction

if TYPE_CHECKING:
    from sim.boat.vehicle import Vehicle

Array = NDArray[np.float64]

_SUFFIXES = (".gif", ".mp4")
# Picture [inch] and dots an inch: 960 x 576, even as H.264 wants it.
_SIZE, _DPI = (12.0, 7.2), 80
# Half width of the side view in boat lengths: the usual, and the most that it is widened to so
# that the surface and the keel are in it. Its height follows from the panel's shape.
_HALF_WIDTH, _WIDEST = 0.85, 1.25
# A boat shorter than this share of the track's panel is drawn larger there.
_SEEN = 0.07
_SEA, _SKY, _BOAT = "#cfe4f2", "#f7fbfd", "#2b3a4a"
_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown", "tab:gray")


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
    return replace(simulation, record=record)


@dataclass
class _Scene:
    """What is shown, and what moves: artists, and one function a panel that moves them.

    ``flight`` has one row a frame, ``record`` those of the simulation, for lines. The functions
    are called with the frame's number and say whether axes have moved too.
    """

    flight: Simulation
    record: Simulation
    boat: Silhouette
    waves: Waves | None
    update: list[Callable[[int], bool]] = field(default_factory=list)
    moving: list[Any] = field(default_factory=list)

    def until(self, i: int, *channels: str) -> list[Array]:
        """Channels of the whole record from the first frame to this one, its own value last."""
        time, at = self.record["t"], self.flight["t"]
        low, high = np.searchsorted(time, [at[0], at[i]])
        return [np.append(self.record[c][low:high], self.flight[c][i]) for c in channels]

    def moves(self, artist: Any) -> Any:
        """Mark an artist as one that is drawn anew in every frame."""
        artist.set_animated(True)
        self.moving.append(artist)
        return artist

    def polygon(self, axis: Any, **style: Any) -> Any:
        """A filled outline that moves."""
        from matplotlib.patches import Polygon

        return self.moves(axis.add_patch(Polygon(np.zeros((3, 2)), closed=True, **style)))


def _window(scene: _Scene, shape: float) -> tuple[float, float | None]:
    """Half width and top of the side view [m].

    In the picture are surface and keel, or all depths of the run, or else (top None) the
    picture follows the boat.
    """
    flight, length = scene.flight, scene.flight.length
    tilts = (flight["theta"].min(), flight["theta"].max())
    ends = np.concatenate([from_the_side(o, float(t))[:, 1] for o in scene.boat.side for t in tilts])
    crest = 2.0 * float(np.sqrt(np.square(scene.waves.amplitude).sum())) if scene.waves is not None else 0.0
    deepest = float(flight["z"].max() + ends.max()) + 0.04 * length
    for top in (-max(0.08 * length, 1.2 * crest), float(flight["z"].min() + ends.min()) - 0.04 * length):
        needed = 0.5 * (deepest - top) / shape
        if needed <= _WIDEST * length:
            half = max(needed, _HALF_WIDTH * length)
            # What is left over goes below the surface, or to both sides of the depths.
            return half, top if top < 0.0 else top - (half - needed) * shape
    return _HALF_WIDTH * length, None


def _surface(scene: _Scene, i: int, ahead: Array) -> Array:
    """Elevation of the sea along the heading [m, up]."""
    flight, waves = scene.flight, scene.waves
    if waves is None or not waves.amplitude.size:
        return np.zeros_like(ahead)
    heading = float(flight["psi"][i])
    north, east = flight["x"][i] + ahead * math.cos(heading), flight["y"][i] + ahead * math.sin(heading)
    points = np.column_stack([north, east, np.zeros_like(ahead)])
    return kinematics(waves, points, float(flight["t"][i])).elevation


def _side_view(scene: _Scene, axis: Any) -> None:
    """Boat, depth and sea surface along the heading; a deep boat is followed."""
    flight, box = scene.flight, axis.get_window_extent()
    half, fixed = _window(scene, box.height / box.width)
    tall, z = 2.0 * half * box.height / box.width, flight["z"]
    first = float(z[0]) - 0.5 * tall if fixed is None else fixed
    axis.set(xlim=(-half, half), ylim=(first + tall, first), aspect="equal", facecolor=_SKY)
    axis.set_xlabel("distance ahead of the origin, along the heading [m]")
    axis.set_ylabel("depth z [m]")
    axis.grid(alpha=0.3)
    ahead = np.linspace(-1.05 * half, 1.05 * half, 160)
    water = scene.polygon(axis, fc=_SEA, ec="tab:blue", lw=1.0, alpha=0.6)
    parts = [scene.polygon(axis, fc=_BOAT, ec=_BOAT, lw=0.6) for _ in scene.boat.side]

    def update(i: int) -> bool:
        top = float(z[i]) - 0.5 * tall if fixed is None else fixed
        if fixed is None:
            axis.set_ylim(top + tall, top)
        floor = top + 2.0 * tall
        surface = np.column_stack([ahead, -_surface(scene, i, ahead)])
        water.set_xy(np.concatenate([surface, [[ahead[-1], floor], [ahead[0], floor]]]))
        for patch, outline in zip(parts, scene.boat.side, strict=True):
            seen = from_the_side(outline, float(flight["theta"][i]), float(flight["phi"][i]))
            patch.set_xy(seen + np.array([0.0, z[i]]))
        return fixed is None

    scene.update.append(update)


def _plan_view(scene: _Scene, axis: Any) -> None:
    """Track and boat from above: north to the right, east down, both axes to one scale."""
    flight, length = scene.flight, scene.flight.length
    x, y = flight["x"], flight["y"]
    box = axis.get_window_extent()
    wide, tall = float(np.ptp(x)) + 1.3 * length, float(np.ptp(y)) + 1.3 * length
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
    track = scene.moves(axis.plot([], [], color="tab:red", lw=1.4)[0])
    parts = [scene.polygon(axis, fc=_BOAT, ec=_BOAT, lw=0.6) for _ in scene.boat.top]
    nose = scene.moves(axis.plot([], [], color="tab:red", lw=1.2, ls=":")[0])

    def update(i: int) -> bool:
        track.set_data(*scene.until(i, "x", "y"))
        heading, place = float(flight["psi"][i]), np.array([x[i], y[i]])
        for patch, outline in zip(parts, scene.boat.top, strict=True):
            patch.set_xy(place + enlarged * from_above(outline, heading))
        line = place + enlarged * length * np.outer([0.5, 1.1], [math.cos(heading), math.sin(heading)])
        nose.set_data(*line.T)
        return False

    scene.update.append(update)


def _note(axis: Any, x: float, text: str, side: str) -> None:
    """A remark under the upper edge of a panel."""
    box = {"fc": "w", "ec": "none", "alpha": 0.75, "pad": 1.5}
    axis.text(x, 0.97, text, transform=axis.transAxes, ha=side, va="top", fontsize=8, bbox=box, zorder=5)


def _wave_arrow(waves: Waves, axis: Any) -> None:
    """Where the waves travel to, each component by its energy."""
    north, east = mean_direction(waves)
    size = math.hypot(north, east)
    if size < 1e-6:
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


def _shown(scene: _Scene) -> NDArray[np.bool_]:
    """Rows of the record that the film spans, those next to its ends included."""
    time, at = scene.record["t"], scene.flight["t"]
    step = float(np.diff(time).max())
    return (time >= at[0] - step) & (time <= at[-1] + step)


def _strip(scene: _Scene, axis: Any, channels: list[str], last: bool) -> None:
    """Channels over time up to now."""
    flight, moving = scene.flight, []
    t = flight["t"]
    drawn = [readable(c, flight[c]) for c in channels]
    values = np.array([d[0] for d in drawn])
    # Limits from the record: between frames it may go further.
    extent = np.concatenate([readable(c, scene.record[c][_shown(scene)])[0] for c in channels])
    for k, (_, name, _) in enumerate(drawn):
        colour = _COLOURS[k % len(_COLOURS)] if len(drawn) > 1 else "tab:red"
        moving.append(scene.moves(axis.plot([], [], color=colour, lw=1.2, label=in_figure(name))[0]))
    dots = scene.moves(axis.plot([], [], "o", color="k", ms=3)[0])
    room = 0.08 * max(float(np.ptp(extent)), 0.02 * float(np.abs(extent).max()), 0.05)
    axis.set(xlim=(t[0], t[-1]), ylim=(extent.min() - room, extent.max() + room))
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

    def update(i: int) -> bool:
        for line, channel in zip(moving, channels, strict=True):
            now, series = scene.until(i, "t", channel)
            line.set_data(now, readable(channel, series)[0])
        dots.set_data(np.full(len(drawn), t[i]), values[:, i])
        return False

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
    head = scene.moves(figure.text(0.5, 0.985, "", ha="center", va="top", fontsize=11))
    figure.text(0.06, 0.012, FRAME, ha="left", va="bottom", fontsize=8, color="0.35")
    side.set_title("from starboard, across the heading", loc="left", fontsize=9, pad=3)
    plan.set_title("from above: track and heading", loc="left", fontsize=9, pad=3)

    def update(i: int) -> bool:
        head.set_text(f"{in_figure(title)}\nt = {flight['t'][i]:.1f} s, {pace:.3g} times real time")
        return False

    scene.update.append(update)
    return figure


def writer_of(path: Path, fps: float) -> Any:
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
        return PillowWriter(fps=fps)  # type: ignore[arg-type]
    if not FFMpegWriter.isAvailable():
        raise InputError(str(path), "no ffmpeg on this machine, which MP4 needs", "a path that ends in .gif; or ffmpeg")
    return FFMpegWriter(fps=fps, codec="h264")  # type: ignore[arg-type]


def _pictures(scene: _Scene, figure: Any) -> Iterator[NDArray[np.uint8]]:
    """The frames as (rows, columns, 4) images; what stands still is drawn once."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    still = None
    for i in range(len(scene.flight["t"])):
        moved = [update(i) for update in scene.update]
        if still is None or any(moved):
            canvas.draw()
            still = canvas.copy_from_bbox(figure.bbox)
        canvas.restore_region(still)
        for artist in scene.moving:
            (artist.axes or figure).draw_artist(artist)
        yield np.asarray(canvas.buffer_rgba()).copy()


@dataclass(frozen=True)
class Film:
    """How a maneuver is drawn as a film.

    Attributes
    ----------
    frames : Number of pictures, equally spaced in time.
    fps : Pictures a second; a GIF holds whole hundredths of a second a picture.
    start, end : Part of the record to show [s]; all of it by default.
    title : Case and database version.
    """

    frames: int = 200
    fps: float = 20.0
    start: float | None = None
    end: float | None = None
    title: str = ""


def animate(
    simulation: Simulation,
    vehicle: Vehicle,
    waves: Waves | None,
    path: Path,
    film: Film = Film(),
    each: Callable[[], None] | None = None,
) -> Path:
    """Draw a maneuver as a film: GIF, or MP4 where ffmpeg is installed.

    Parameters
    ----------
    simulation : The flight.
    vehicle : Gives silhouette and planes.
    waves : The sea it flew in; None or no component is calm.
    path : File to write; ``.gif`` or ``.mp4``.
    film : Pictures, times and title.
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
    from matplotlib.figure import Figure

    writer = writer_of(path, film.fps)
    scene = _Scene(sampled(simulation, film.frames, film.start, film.end), simulation, silhouette(vehicle), waves)
    planes = [p.name for p in vehicle.planes if p.name in simulation.columns]
    pictures = _pictures(scene, _figure(scene, planes, film.title, film.fps))
    # The film's figure holds each picture as an image: drawing all axes anew takes ten times as long.
    screen = Figure(figsize=_SIZE, dpi=_DPI)
    FigureCanvasAgg(screen)
    # A writer without any picture fails at its end, in the place of the signal that ended the film.
    first = next(pictures)
    with whole(path) as part, writer.saving(screen, str(part), _DPI):
        for picture in chain((first,), pictures):
            screen.images.clear()
            screen.figimage(picture)
            writer.grab_frame()
            if each is not None:
                each()
    return path
