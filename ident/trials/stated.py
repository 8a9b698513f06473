"""Whether what is stated of a record counts: a key that changes nothing is named."""

from __future__ import annotations

from typing import Any

from ident.trials.maneuvers import Maneuver
from ident.trials.reading import Recording
from ident.trials.spec import TrialFile
from sim.files.errors import InputError

# Keys of [noise] -> channels that they are the error of.
_NOISE: dict[str, tuple[str, ...]] = {"heading_deg": ("psi",), "pitch_deg": ("theta",), "roll_deg": ("phi",)}
_NOISE |= {"yaw_rate_degps": ("r",)}
_NOISE |= {"position_m": ("north",), "depth_m": ("z",), "speed_mps": ("U", "u")}
# Keys that one kind of maneuver is measured by.
_OF_KIND = {
    "step_m": ("depth_change",),
    "released_s": ("course_keeping",),
    "surface_point_m": ("rise",),
    "initial.pitch_deg": ("vertical_zigzag",),
    "initial.x_m": ("turning_circle", "stopping"),
    "initial.y_m": ("turning_circle", "stopping"),
}
# What a report quotes, and nothing is computed from.
QUOTED = ("name", "loading", "density_kgpm3", "length_m", "source")


def quoted(spec: TrialFile) -> dict[str, Any]:
    """What is stated of a trial for its report: name, loading, density, length, source."""
    return {key: getattr(spec, key) for key in QUOTED if getattr(spec, key)}


def unused(as_read: Recording, one: Recording, maneuver: Maneuver, spec: TrialFile) -> list[tuple[str, str, str]]:
    """Keys that change nothing on this record: key, why, and what would make them count.

    Parameters
    ----------
    as_read, one : The recording with the file's own channels, and in program axes.
    maneuver, spec : What was done, and what is stated.
    """
    idle = []
    for key, channels in _NOISE.items():
        if getattr(spec.noise, key) is not None and not set(channels) & set(one.channels):
            idle.append((f"noise.{key}", "the record has no such channel", "the noise of a channel that is recorded"))
    for key, kinds in _OF_KIND.items():
        value = getattr(spec.initial, key[8:]) if key.startswith("initial.") else getattr(spec, key)
        if value is not None and maneuver.kind not in kinds:
            idle.append((key, f"a {maneuver.kind} is not measured by it", f"the key with {' or '.join(kinds)}"))
    if spec.initial.heading_deg is not None and ("psi" not in one.channels or not maneuver.horizontal):
        idle.append(("initial.heading_deg", f"no heading that {maneuver.kind} counts from", "a heading, or no key"))
    if spec.axes is not None and not {"x", "y"} <= set(as_read.channels):
        idle.append(("axes", "the record has no x and y", "columns x and y, or no [axes]"))
    if spec.wrap_deg is not None and not {"psi", "course"} & set(one.channels):
        idle.append(("wrap_deg", "the record has no heading", "a heading, or no key"))
    if spec.current is not None and "north" not in one.channels:
        idle.append(("current", "the record has no track", "a track, or no [current]"))
    return idle


def refuse_unused(file: str, keys: list[tuple[str, str, str]]) -> None:
    """Refuse the first key that changes nothing.

    Raises
    ------
    InputError
        Naming the key and why nothing comes of it.
    """
    if keys:
        key, why, allowed = keys[0]
        raise InputError(f"{file}, trial.toml, key {key}", f"stated, and changes nothing: {why}", allowed)
