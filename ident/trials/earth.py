"""From what a recorder wrote to the program's axes: wraps, latitude and longitude, x and y, scale, current."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from importlib.resources import files

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.trials.channels import plain
from ident.trials.reading import Recording
from ident.trials.spec import TrialFile
from sim.files.errors import InputError
from sim.files.record import Record

Array = NDArray[np.float64]
# Powers of the scale by which Froude's law brings a unit to full scale.
_FROUDE = {"m": 1.0, "m/s": 0.5, "rad/s": -0.5, "1/s": -0.5}
_TURNS = {"north": (0, 1.0), "south": (0, -1.0), "east": (1, 1.0), "west": (1, -1.0)}
# Boats drift by less than this in a maneuver; a track beyond it has other axes.
_MOST_DRIFT = math.radians(40.0)


def unwrapped(value: Array, turn: float) -> Array:
    """An angle without the jumps of a compass that starts again after ``turn`` [rad]."""
    return np.asarray(np.unwrap(value, period=turn))


def _unwrap(one: Recording, spec: TrialFile) -> Recording:
    channels, said = dict(one.channels), list(one.assumed)
    for name in ("psi", "course"):
        if name not in channels:
            continue
        record = channels[name]
        turn = 2.0 * math.pi if spec.wrap_deg is None else 2.0 * math.pi * (spec.wrap_deg / 360.0)
        jumps = int(np.count_nonzero(np.abs(np.diff(record.value)) > turn / 2.0))
        if jumps:
            channels[name] = replace(record, value=unwrapped(record.value, turn))
            said.append(f"{one.headers[name]}: {jumps} jumps of a compass of {math.degrees(turn):.0f} deg taken out")
    return one.with_(channels=channels, assumed=tuple(said))


def _scaled(one: Recording, scale: float) -> Recording:
    """Froude's law: times and speeds by the root of the scale, lengths by it, angles as they are."""
    if scale == 1.0:
        text = "scale 1: times, lengths and speeds as recorded"
        return one.with_(assumed=(*one.assumed, text))
    root = math.sqrt(scale)
    channels = {
        k: replace(r, abscissa=r.abscissa * root, value=r.value * scale ** _FROUDE.get(r.unit, 0.0))
        for k, r in one.channels.items()
        if k not in ("lat", "lon")
    }
    channels |= {
        k: replace(one.channels[k], abscissa=one.channels[k].abscissa * root)
        for k in ("lat", "lon")
        if k in one.channels
    }
    rows = (one.rows[0] * root, one.rows[1])
    text = f"scale {scale:g}: brought to full scale by Froude's law"
    return one.with_(channels=channels, rows=rows, time_sigma=one.time_sigma * root, assumed=(*one.assumed, text))


@cache
def _ellipsoid() -> tuple[float, float]:
    """Semi-major axis [m] and flattening of the WGS 84 ellipsoid, from ``data/ellipsoid.csv``."""
    with (files("ident") / "data" / "ellipsoid.csv").open(encoding="utf-8") as stream:
        values = pd.read_csv(stream).set_index("name")["value"]
    return float(values["semi_major"]), 1.0 / float(values["inverse_flattening"])


def tangent_plane(latitude: Array, longitude: Array) -> tuple[Array, Array]:
    """North and east [m] of points on the WGS 84 ellipsoid, in the plane that touches it at the first.

    Parameters
    ----------
    latitude, longitude : (n,) [rad].
    """
    semi_major, flattening = _ellipsoid()
    square = flattening * (2.0 - flattening)
    across = semi_major / np.sqrt(1.0 - square * np.sin(latitude) ** 2)
    x = across * np.cos(latitude) * np.cos(longitude)
    y = across * np.cos(latitude) * np.sin(longitude)
    z = across * (1.0 - square) * np.sin(latitude)
    dx, dy, dz = x - x[0], y - y[0], z - z[0]
    s, c = math.sin(latitude[0]), math.cos(latitude[0])
    sl, cl = math.sin(longitude[0]), math.cos(longitude[0])
    return -s * cl * dx - s * sl * dy + c * dz, -sl * dx + cl * dy


def _common(one: Recording, first: str, second: str) -> tuple[Record, Record]:
    """Two records on the times that both have."""
    a, b = one.channels[first], one.channels[second]
    if a.abscissa.size == b.abscissa.size and np.array_equal(a.abscissa, b.abscissa):
        return a, b
    shared = np.intersect1d(a.abscissa, b.abscissa)
    if shared.size < 3:
        place = f"{one.file}, columns {one.headers[first]}, {one.headers[second]}"
        raise InputError(place, "no samples of both at one time", "a position with both its coordinates")
    return a.kept(np.isin(a.abscissa, shared)), b.kept(np.isin(b.abscissa, shared))


def _positions(one: Recording, spec: TrialFile) -> Recording:
    """Track to north and east."""
    channels, headers, said = dict(one.channels), dict(one.headers), list(one.assumed)
    stated = [v for v in (spec.initial.x_m, spec.initial.y_m) if v is not None]
    pointing = [_TURNS["north"], _TURNS["east"]]
    if {"lat", "lon"} <= set(channels) and "north" not in channels:
        lat, lon = _common(one, "lat", "lon")
        north, east = tangent_plane(lat.value, np.unwrap(lon.value))
        for name, value in (("north", north), ("east", east)):
            channels[name] = Record(name, lat.abscissa, value * 1.0, "m")
            headers[name] = f"{headers['lat']}, {headers['lon']}"
        said.append("latitude and longitude: WGS 84, in the plane that touches it at the first position")
    elif {"x", "y"} <= set(channels) and "north" not in channels:
        named = one.with_(channels=channels)
        x, y = _common(named, "x", "y")
        axes, text = _axes(named, x, y, spec)
        pointing = axes
        for record, (axis, sign) in zip((x, y), axes, strict=True):
            name = ("north", "east")[axis]
            channels[name] = Record(name, record.abscissa, sign * record.value, "m")
            headers[name] = headers[record.channel]
        said.append(text)
    channels = {k: r for k, r in channels.items() if k not in ("x", "y", "lat", "lon")}
    if ("north" in channels) != ("east" in channels):
        lone = "north" if "north" in channels else "east"
        raise InputError(f"{one.file}, column {headers[lone]}", "one coordinate of a position", "both, or neither")
    place = None
    if stated:
        if len(stated) < 2 or "north" not in channels or {"lat", "lon"} & set(one.channels):
            allowed = "x_m and y_m, with a track in metres that they are a point of; or neither"
            raise InputError(f"{one.file}, key initial", "a position at the execute", allowed)
        at = {axis: sign * spec.scale * v for v, (axis, sign) in zip(stated, pointing, strict=True)}
        place = (at[0], at[1])
        said.append(f"position at the execute: {stated[0]:g}, {stated[1]:g} m, stated")
    return one.with_(channels=channels, headers=headers, assumed=tuple(said), place=place)


def place_of(one: Recording, spec: TrialFile, execute: float) -> tuple[float, float] | None:
    """North and east [m] of the stated position at the execute, through the water as the track is."""
    if one.place is None or spec.current is None or not spec.current.correct:
        return one.place
    to, ran = math.radians(spec.current.to_deg), spec.current.speed_mps * execute
    return one.place[0] - ran * math.cos(to), one.place[1] - ran * math.sin(to)


def _axes(one: Recording, x: Record, y: Record, spec: TrialFile) -> tuple[list[tuple[int, float]], str]:
    """Where x and y point: stated, or as the heading shows, or north and east."""
    if spec.axes:
        return [_TURNS[spec.axes.x], _TURNS[spec.axes.y]], f"x {spec.axes.x}, y {spec.axes.y}: stated"
    usual: list[tuple[int, float]] = [_TURNS["north"], _TURNS["east"]]
    if "psi" not in one.channels:
        return usual, "x and y: axes not named, x north and y east taken (only the side of the turn depends on it)"
    fits = []
    for names in (
        ("north", "east"),
        ("east", "north"),
        ("north", "west"),
        ("west", "north"),
        ("south", "west"),
        ("south", "east"),
        ("east", "south"),
        ("west", "south"),
    ):
        away = drift(one.channels["psi"], x, y, [_TURNS[n] for n in names])
        if away is not None and away < _MOST_DRIFT:
            fits.append((away, names))
    if not fits or fits[0][1] == ("north", "east"):
        agrees = "which agrees with the heading" if fits else "the heading does not say"
        return usual, f"x and y: axes not named, x north and y east taken, {agrees}"
    names = min(fits)[1]
    return [_TURNS[n] for n in names], f"x {names[0]}, y {names[1]}: axes not named, found by the heading"


def drift(psi: Record, x: Record, y: Record, axes: list[tuple[int, float]]) -> float | None:
    """Root mean square angle [rad] between heading and track; None where the track does not move."""
    n = max(1, x.abscissa.size // 60)
    t, plane = x.abscissa[::n], np.zeros((2, x.abscissa[::n].size))
    for record, (axis, sign) in zip((x, y), axes, strict=True):
        plane[axis] = sign * record.value[::n]
    step = np.diff(plane, axis=1)
    moved = np.hypot(*step)
    good = moved > 0.3 * np.median(moved)
    if moved.size < 3 or not good.any() or np.median(moved) == 0.0:
        return None
    course = np.arctan2(step[1], step[0])[good]
    heading = psi.at(0.5 * (t[1:] + t[:-1]))[good]
    away = np.angle(np.exp(1j * (course - heading)))
    return float(np.sqrt(np.mean(away**2)))


def _through_water(one: Recording, spec: TrialFile) -> Recording:
    """The track less a stated steady current."""
    if spec.current is None:
        return one
    if not spec.current.correct:
        return one.with_(assumed=(*one.assumed, "current: stated, the track over ground is measured"))
    if "north" not in one.channels:
        raise InputError(
            f"{one.file}, key current", "a current, and no track it could be taken off", "a track, or no [current]"
        )
    to, channels = math.radians(spec.current.to_deg), dict(one.channels)
    for name, share in (("north", math.cos(to)), ("east", math.sin(to))):
        record = channels[name]
        channels[name] = replace(record, value=record.value - spec.current.speed_mps * share * record.abscissa)
    text = f"current of {spec.current.speed_mps:g} m/s to {spec.current.to_deg:g} deg taken off the track"
    return one.with_(channels=channels, assumed=(*one.assumed, text))


def in_program_axes(one: Recording, spec: TrialFile) -> Recording:
    """A recording turned, scaled and unwrapped: tracks north and east, headings without jumps, full scale.

    Raises
    ------
    InputError
        For half a position, an undeclared frame, or a statement that changes nothing.
    """
    channels = dict(one.channels)
    if spec.frame is not None:
        frame = spec.frame.declared("trial.toml, key frame")
        channels = {k: replace(r, value=frame.sign(k) * r.value) for k, r in channels.items()}
        one = one.with_(channels=channels, assumed=(*one.assumed, f"frame {frame}: stated"))
    if plain(one.headers.get("z", "")).startswith("d0") and "z" in channels:
        one = one.with_(assumed=(*one.assumed, f"{one.headers['z']}: depth of the sail top; only its changes are used"))
    return _through_water(_positions(_scaled(_unwrap(one, spec), spec.scale), spec), spec)
