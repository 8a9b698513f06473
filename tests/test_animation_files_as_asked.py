"""Authority: the file as read by Pillow, rigid-body geometry, what was asked for."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from click.testing import CliRunner
from flights_in_waves import made_flight
from PIL import Image

from ident.animation.film import Film, animate, sampled
from ident.animation.silhouette import from_above, from_the_side, silhouette
from ident.commands.animate import animate as command
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.waves.linear import regular


@pytest.fixture(scope="module")
def boat():
    return load_vehicle("bb2")


@pytest.fixture(scope="module")
def flight():
    time = np.arange(0.0, 60.5, 0.5)
    return made_flight(
        time, x=5.0 * time, y=0.02 * time**2, z=36.0 + 0.1 * time, theta=0.1 * np.sin(0.1 * time), psi=0.008 * time
    )


def test_gif_has_the_frames_and_the_duration_asked(flight, boat, tmp_path):
    """Twelve frames at ten a second are 1.2 s, every one of its own; nothing else is left."""
    seen = []
    waves = regular(3.25, 140.9, 2.5, 1025.0, 9.81)
    path = animate(
        flight, boat, waves, tmp_path / "new" / "a.gif", Film(12, 10.0, title="Made"), each=lambda: seen.append(1)
    )
    with Image.open(path) as film:
        assert film.n_frames == len(seen) == 12
        durations, pictures = [], []
        for i in range(12):
            film.seek(i)
            durations.append(film.info["duration"])
            pictures.append(np.asarray(film.convert("RGB")))
    assert sum(durations) == 1200
    assert all((a != b).any() for a, b in pairwise(pictures))
    assert path.stat().st_size < 12 * 25_000
    assert [p.name for p in path.parent.iterdir()] == ["a.gif"]


def test_what_cannot_be_written_is_refused_in_one_message(flight, boat, tmp_path, monkeypatch):
    """Another suffix; MP4 without ffmpeg; a folder that is a file; nothing half-written."""
    with pytest.raises(InputError, match=r"suffix \.avi \(allowed: \.gif or \.mp4\)"):
        animate(flight, boat, None, tmp_path / "a.avi")
    from matplotlib.animation import FFMpegWriter

    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(InputError, match="no ffmpeg"):
        animate(flight, boat, None, tmp_path / "a.mp4")
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot be written"):
        animate(flight, boat, None, tmp_path / "file" / "a.gif", Film(frames=2))
    with pytest.raises(InputError, match="frames"):
        animate(flight, boat, None, tmp_path / "a.gif", Film(frames=1))
    with pytest.raises(InputError, match="start and end"):
        animate(flight, boat, None, tmp_path / "a.gif", Film(start=50.0, end=10.0))
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_mp4_where_ffmpeg_is(flight, boat, tmp_path):
    from matplotlib.animation import FFMpegWriter

    if not FFMpegWriter.isAvailable():
        pytest.skip("needs ffmpeg")
    path = animate(flight, boat, None, tmp_path / "a.mp4", Film(frames=4, fps=10.0))
    assert path.read_bytes()[4:8] == b"ftyp"


def test_outline_is_the_boats(boat):
    """Length over all, beam of the hull and height of the sail are those of the surface."""
    outline = silhouette(boat)
    side, top = np.concatenate(outline.side), np.concatenate(outline.top)
    length = boat.particulars.length.value
    assert np.ptp(side[:, 0]) == pytest.approx(length, rel=0.01)
    assert side[:, 1].min() == pytest.approx(boat.particulars.sail_top.value[2], abs=0.05)
    # Port and starboard alike.
    assert top[:, 1].min() == pytest.approx(-top[:, 1].max(), abs=0.01)


def test_boat_without_geometry_is_a_box_of_its_length(boat):
    plain = boat.model_copy(update={"geometry": None})
    (box,) = silhouette(plain).side
    assert np.ptp(box[:, 0]) == boat.particulars.length.value


@pytest.mark.parametrize("pitch", [-0.3, -0.05, 0.05, 0.3])
def test_nose_goes_up_with_positive_pitch(boat, pitch):
    """The foremost point rises by x sin(theta); lengths stay; heel takes height off the sail alone."""
    hull = silhouette(boat).side[0]
    nose = int(np.argmax(hull[:, 0]))
    turned = from_the_side(hull, pitch)
    rise = hull[nose, 1] - turned[nose, 1]
    assert math.copysign(1.0, rise) == math.copysign(1.0, pitch)
    assert rise == pytest.approx(hull[nose, 0] * math.sin(pitch) + hull[nose, 1] * (1.0 - math.cos(pitch)))
    assert np.hypot(*turned.T) == pytest.approx(np.hypot(*hull.T))
    level = from_the_side(hull, 0.0, 0.4)
    assert level[:, 1] == pytest.approx(hull[:, 1] * math.cos(0.4))


def test_heading_to_starboard_points_east():
    """A bow at x = 1 heading 90 deg lies east of the origin; starboard lies south."""
    turned = from_above(np.array([[1.0, 0.0], [0.0, 1.0]]), math.pi / 2.0)
    assert turned == pytest.approx(np.array([[0.0, 1.0], [-1.0, 0.0]]), abs=1e-12)


def test_frames_are_equally_spaced_in_time(flight):
    found = sampled(flight, 7, 6.1, 30.1)
    assert found["t"] == pytest.approx(np.linspace(6.1, 30.1, 7))
    assert found["x"] == pytest.approx(5.0 * found["t"])
    assert found["D0"] == pytest.approx(25.0 + 0.1 * found["t"])


def test_command_explains_itself():
    shown = CliRunner().invoke(command, ["--help"])
    assert shown.exit_code == 0
    assert "Example: ident animate --case hzz20" in shown.output


def test_command_draws_a_case(fitted_db, tmp_path):
    """From the database to the film, and what was drawn as JSON."""
    import json

    asked = ["--case", "roll-decay", "--db", fitted_db, "--out", str(tmp_path / "r.gif")]
    done = CliRunner().invoke(command, [*asked, "--frames", "3", "--json", str(tmp_path / "r.json")])
    assert done.exit_code == 0, done.output
    shown = json.loads((tmp_path / "r.json").read_text())
    assert (shown["case"], shown["frames"]) == ("roll-decay", 3)
    assert shown["bytes"] == (tmp_path / "r.gif").stat().st_size
    refused = CliRunner().invoke(command, [*asked[:4], "--out", str(tmp_path / "r.webp")])
    assert isinstance(refused.exception, InputError)
