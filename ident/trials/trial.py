"""``ident trial``: a recorded maneuver, measured alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ident.checks.findings import Finding
from ident.timeseries.smoothing import SmoothPath
from ident.trials.alignment import Start, paths, start_of
from ident.trials.consistency import check_recording, refused
from ident.trials.earth import in_program_axes
from ident.trials.exchanged import exchanged
from ident.trials.keeping import steering_of
from ident.trials.maneuvers import Maneuver, control_of, maneuver_of, turn_ends
from ident.trials.measure import DRAWS, Value, measured, measured_until
from ident.trials.reading import Recording, read_recording
from ident.trials.shown import Shown, refuse_unshown
from ident.trials.spec import TrialFile
from ident.trials.spikes import without_spikes
from ident.trials.stated import quoted, refuse_unused, unused
from sim.files.errors import InputError

# A zigzag has its check angle at this share of the plane angle or more.
_LEAST_CHECK = 0.1


@dataclass(frozen=True)
class Trial:
    """A measured trial.

    Attributes
    ----------
    recording : In program axes, full scale.
    spec : What was stated.
    maneuver, start : What was done, and when it began.
    paths : Smooth path of each channel.
    metrics : Name -> value, standard error, unit.
    assumed : What was found or taken for granted.
    findings : What is wrong with the record.
    """

    recording: Recording
    spec: TrialFile
    maneuver: Maneuver
    start: Start
    paths: dict[str, SmoothPath]
    metrics: dict[str, Value]
    assumed: tuple[str, ...]
    findings: tuple[Finding, ...]

    def to_dict(self) -> dict[str, Any]:
        """For a machine to read."""
        return {
            "maneuver": str(self.maneuver),
            "file": self.recording.file,
            "assumed": list(self.assumed),
            "metrics": {name: value.to_dict() for name, value in self.metrics.items()},
            "findings": [f.as_json() for f in self.findings],
            "stated": quoted(self.spec),
        }


def side_of(one: Trial) -> str:
    """To which side a trial went first: starboard or port, bow up or bow down."""
    name = "psi" if one.maneuver.horizontal else "theta"
    if name not in one.paths:
        return ""
    at = np.linspace(one.start.time, float(one.paths[name].knots[-5]), 400)
    base = float(one.paths[name](one.start.time)) if one.start.angle is None else one.start.angle
    away = one.paths[name](at) - base
    first = away[int(np.argmax(np.abs(away) > 0.3 * float(np.max(np.abs(away)))))]
    sides = ("starboard", "port") if name == "psi" else ("bow up", "bow down")
    return sides[0] if first > 0.0 else sides[1]


def _borne_out(one: Recording, maneuver: Maneuver, findings: list[Finding]) -> bool:
    """Whether rudder or track say that the angle measured on has the right size."""
    headings = {one.headers.get("psi", "")}
    if any(
        f.check in ("unit_slip", "track_against_heading") and "track" in f.what and headings & set(f.columns)
        for f in findings
    ):
        return False
    by_control = control_of(one, maneuver.kind == "vertical_zigzag") is not None
    plausible = maneuver.check is None or maneuver.planes is None or maneuver.check >= _LEAST_CHECK * maneuver.planes
    return (by_control and plausible) or "north" in one.channels


def _taken_for_granted(
    one: Recording, maneuver: Maneuver, start: Start, smoothed: dict[str, SmoothPath], spec: TrialFile
) -> list[str]:
    """What the estimator of a maneuver takes for granted."""
    if maneuver.kind == "course_keeping":
        steering = steering_of(one, start, spec)
        return [steering.said if steering else "no push by the rudder at the execute: deviations only"]
    if maneuver.kind == "depth_change" and "z" in smoothed:
        stated = spec.step_m is not None
        order = (
            f"{spec.step_m:g} m: stated" if stated else "what the last tenth of the record comes to; step_m states it"
        )
        return [f"ordered change of depth: {order}"]
    if maneuver.kind == "turning_circle" and (control := control_of(one)) is not None:
        ended = turn_ends(control)
        words = f"turning circle: until {one.headers[control.channel]} leaves its side at {ended or 0.0:.1f} s"
        return [f"{words}; --maneuver pull_out measures what follows"] if ended is not None else []
    if maneuver.kind == "rise":
        return _of_a_rise(one, spec)
    return []


def _of_a_rise(one: Recording, spec: TrialFile) -> list[str]:
    """Where a rise ends, and which speed its ratio is one of."""
    said = []
    if spec.surface_point_m is None:
        said.append(
            "rise: measured to the end of the record; surface_point_m ends it where that point comes to the surface"
        )
    if "u" not in one.channels and "U" in one.channels:
        said.append(
            f"rise: the speed ratio is that of {one.headers['U']}, along the path; u along the boat is not recorded, "
            "and is less where the boat rises at an angle to its path"
        )
    return said


def measure_trial(path: Path, spec: TrialFile | None = None, count: int = DRAWS, every_key: bool = True) -> Trial:
    """Read, check, align and measure one recorded maneuver.

    Parameters
    ----------
    path : The record.
    spec : What it does not say of itself.
    count : Draws from the posterior of the paths, for the standard errors.
    every_key : Refuse a key that changes nothing on this record; of several records it is only said.

    Raises
    ------
    InputError
        For a file that cannot be read, a record that contradicts itself where the numbers would be
        wrong, or a maneuver that is neither stated nor found, or stated and not shown.

    Examples
    --------
    >>> from ident.trials.trial import measure_trial
    >>> measure_trial(Path("zigzag.csv")).metrics["overshoot_1_deg"]  # doctest: +SKIP
    Value(value=11.42, sigma=0.03, unit='deg')
    """
    spec = spec or TrialFile()
    as_read = read_recording(path, spec)
    one = in_program_axes(without_spikes(as_read), spec)
    findings = [*one.findings, *exchanged(one), *check_recording(one)]
    # Exchanged channels would be taken for a maneuver that was not made.
    refused(one, [f for f in findings if f.check == "exchanged_channels"], True, True)
    try:
        maneuver, by = maneuver_of(one, spec.maneuver)
    except InputError:
        # A unit slip hides the maneuver: it is said first.
        refused(one, findings, True, False)
        raise
    idle = unused(as_read, one, maneuver, spec)
    if every_key:
        refuse_unused(str(path), idle)
    track = maneuver.kind in ("turning_circle", "stopping")
    sure = _borne_out(one, maneuver, findings)
    refused(one, findings, track, sure)
    try:
        start = start_of(one, maneuver, spec)
        smoothed, taken = paths(one, start, spec)
        metrics = measured(one, maneuver, start, smoothed, spec, count)
    except np.linalg.LinAlgError as error:
        named = f"no smooth path through {', '.join(one.headers.values())[:160]}: {error}"
        remedy = "a record whose samples are even in time and of a size: look at the clock and the units"
        raise InputError(str(path), named, remedy) from error
    by_key = [f"key {key}: changes nothing here, {why}" for key, why, _ in idle]
    said = (*one.assumed, *by_key, by, *start.said, *taken, *_taken_for_granted(one, maneuver, start, smoothed, spec))
    until, ordered = measured_until(one, maneuver, smoothed), spec.step_m is not None
    refuse_unshown(Shown(one, maneuver, start, smoothed, metrics, until, ordered))
    return Trial(one, spec, maneuver, start, smoothed, metrics, said, tuple(findings))
