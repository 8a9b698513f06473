"""A recorded trial as the reference of a case: aligned by its execute, started as it started, driven as it was.

What a simulation is held against is the samples themselves, from the execute on, turned to the course
before it, at full scale. Metrics are measured on the smooth path through them, by the estimators that
measure the flight.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sim.files.errors import InputError
from sim.files.record import Record, Written
from sim.files.schema import FrameData
from sim.files.toml_files import bundled
from sim.flight.case import Case
from sim.flight.commands import Event, PlaneCommand, PlaneStep, SpeedCommand, SpeedStep
from sim.flight.reference import Reference, Start
from sim.flight.reference_table import is_series
from sim.flight.series import Series, load_reference
from sim.flight.simulation import CHANNELS

if TYPE_CHECKING:
    from ident.timeseries.smoothing import SmoothPath
    from ident.trials.spec import TrialFile
    from ident.trials.trial import Trial

Array = NDArray[np.float64]
_PROGRAM = FrameData(x="forward", y="starboard", z="down")
TRIAL = "TRIAL"
DRIVEN = f"{TRIAL} with recorded controls"
_GRID = 2000
# Rudder angles nearer than this [rad] are one step of a programme.
_ALIKE = math.radians(0.05)
# So many more turning points than its smooth path has are noise.
_MORE_TURNS = 3


@dataclass(frozen=True)
class Referenced:
    """A case with what it is held against.

    Attributes
    ----------
    case : Its reference names the trial, its sources, channels and start.
    series : The samples, and the smooth paths that metrics are measured on.
    driven : The case with the recorded controls instead of its command laws; None without a trial or rudder.
    notes : What was assumed, what is wrong with the record, how its commands differ.
    sigma : Metric -> source -> standard error.
    """

    case: Case
    series: Series
    driven: Case | None = None
    notes: list[str] = field(default_factory=list)
    sigma: dict[str, dict[str, float]] = field(default_factory=dict)


def referenced(case: Case, where: str) -> Referenced:
    """The references of a case file: its series, or its recorded trial.

    Parameters
    ----------
    case, where : From ``load_case``.

    Raises
    ------
    InputError
        For a file that cannot be read, or a key that changes nothing.
    """
    given = case.reference
    if given is None or given.file is None:
        return Referenced(case, load_reference(case, where))
    folder = Path(where).parent
    if where in bundled("cases") or (given.trial is None and _long_or_missing(folder / given.file)):
        if given.controls == "recorded" or given.trial:
            allowed = "a recorded trial as reference.file: no table of source, channel, t, value, unit"
            raise InputError(f"{where}, key reference", f"trial or controls with {given.file}", allowed)
        return Referenced(case, load_reference(case, where))
    from ident.trials.spec import TrialFile, load_spec

    spec = load_spec(folder / given.trial) if given.trial else TrialFile()
    if given.frame != _PROGRAM:
        if spec.frame not in (None, given.frame):
            raise InputError(
                f"{where}, key reference.frame", f"another than in {given.trial}", "the frame in one of them"
            )
        spec = spec.model_copy(update={"frame": given.frame})
    held = with_trial(case, folder / given.file, spec, given.controls == "recorded")
    compared = held.case.reference.channels if held.case.reference else []
    if missing := [c for c in given.channels if c not in compared]:
        known = ", ".join(c for c in CHANNELS if c in held.series[TRIAL])
        raise InputError(f"{where}, key reference.channels", ", ".join(missing), f"recorded: {known}")
    return held


def _long_or_missing(path: Path) -> bool:
    return not path.is_file() or is_series(path)


def with_trial(case: Case, path: Path, spec: TrialFile, recorded: bool) -> Referenced:
    """A case held against a recorded trial.

    Parameters
    ----------
    case : What is flown.
    path, spec : The record and what is said of it; the case's maneuver when neither says one.
    recorded : Fly the recorded controls instead of the command laws.

    Raises
    ------
    InputError
        As ``measure_trial``; when no channel can be compared, or recorded controls are asked for that
        the record does not hold.
    """
    trial = _measured(case, path, spec)
    series = Series({TRIAL: samples(trial, case.run.duration_s)}, "t")
    series.smooth = {TRIAL: paths(trial)}
    given = case.reference
    known = [c for c in CHANNELS if c in series[TRIAL]]
    channels = [c for c in (given.channels if given and given.channels else known) if c in known]
    if not channels:
        raise InputError(f"{path}, channels", ", ".join(trial.recording.channels), ", ".join(CHANNELS))
    begun = Start(source=TRIAL, **_start(trial, case))
    reference = Reference(
        file=str(path),
        compare=[TRIAL],
        channels=channels,
        frame=given.frame if given else _PROGRAM,
        initial={TRIAL: begun},
    )
    held = case.model_copy(update={"reference": reference})
    driven, said = _driven(held, trial)
    if recorded and driven is None:
        raise InputError(f"{path}, recorded controls", said[0], "a column of the rudder or plane angle")
    notes = [f"trial: {text}" for text in trial.assumed]
    notes += [
        f"trial, {f.severity}, row {f.shown_rows}, {', '.join(f.columns)}: {f.what}; {f.remedy}" for f in trial.findings
    ]
    sigma = {name: {TRIAL: value.sigma} for name, value in trial.metrics.items()}
    return Referenced(held, series, driven, [*notes, *_commands_differ(case, trial), *said], sigma)


def _measured(case: Case, path: Path, spec: TrialFile) -> Trial:
    """The trial by itself; by the case's maneuver where it does not show one, or not by its rudder."""
    from ident.trials.trial import measure_trial

    fallback = spec.model_copy(update={"maneuver": _maneuver(case)})
    if spec.maneuver or not fallback.maneuver:
        return measure_trial(path, spec)
    try:
        trial = measure_trial(path, spec)
    except InputError:
        return measure_trial(path, fallback)
    unsure = "zigzag" in trial.maneuver.kind and trial.maneuver.planes is None
    return measure_trial(path, fallback) if unsure else trial


def _maneuver(case: Case) -> str:
    """The case's maneuver in the words of a trial; empty where it has none."""
    for axis, kind in (("dH", "zigzag"), ("dV", "vertical_zigzag")):
        one = getattr(case.command, axis)
        if one.law == "zigzag":
            return f"{kind} {abs(one.first_deg):g}/{one.check_deg:g}"
    known = {"turning_circle", "direct_spiral", "pull_out", "stopping", "rise", "depth_change", "course_keeping"}
    return case.maneuver if case.maneuver in known else ""


def _record(channel: str, t: Array, value: Array, sigma: float | None) -> Record:
    """A record shown in degrees where it is an angle."""
    unit = CHANNELS[channel]
    error = None if sigma is None else np.full(t.size, sigma)
    if not unit.startswith("rad"):
        return Record(channel, t, value, unit, error)
    shown = None if error is None else np.degrees(error)
    return Record.read(channel, t, Written(np.degrees(value), unit.replace("rad", "deg"), shown))


def _base(trial: Trial) -> float:
    """Course at the execute [rad]."""
    if "psi" in trial.paths:
        return float(trial.paths["psi"](trial.start.time)) if trial.start.angle is None else trial.start.angle
    if "north" in trial.paths:
        return math.atan2(*(float(trial.paths[k](trial.start.time, 1)) for k in ("east", "north")))
    return 0.0


def _depth(trial: Trial) -> str:
    """Whether the depth of the record is that of the sail top."""
    from ident.trials.channels import plain

    return "D0" if plain(trial.recording.headers.get("z", "")).startswith("d0") else "z"


def samples(trial: Trial, duration: float) -> dict[str, Record]:
    """The samples of a trial from the execute on, as long as the case is flown, by channel of a simulation."""
    records: dict[str, Record] = {}
    base, start = _base(trial), trial.start.time
    for name, record in trial.recording.channels.items():
        channel = _depth(trial) if name == "z" else name
        if channel not in CHANNELS or name in ("x", "y"):
            continue
        after = record.kept((record.abscissa >= start - 1e-9) & (record.abscissa <= start + duration + 1e-9))
        if len(after) < 2:
            continue
        offset = base if name == "psi" else 0.0
        sigma = trial.paths[name].sigma if name in trial.paths else None
        records[channel] = _record(channel, after.abscissa - start, after.value - offset, sigma)
    if {"north", "east"} <= set(trial.paths):
        north = trial.recording.channels["north"]
        inside = (north.abscissa >= start - 1e-9) & (north.abscissa <= start + duration + 1e-9)
        t = north.abscissa[inside]
        x, y = _turned(trial, base, north.value[inside], trial.recording.channels["east"].at(t))
        sigma = trial.paths["north"].sigma
        records |= {"x": _record("x", t - start, x, sigma), "y": _record("y", t - start, y, sigma)}
    return records


def _turned(trial: Trial, base: float, north: Array, east: Array) -> tuple[Array, Array]:
    """Along and across the course at the execute, from the place there."""
    dn, de = (v - float(trial.paths[k](trial.start.time)) for k, v in (("north", north), ("east", east)))
    return math.cos(base) * dn + math.sin(base) * de, math.cos(base) * de - math.sin(base) * dn


def paths(trial: Trial) -> dict[str, Record]:
    """The smooth paths of a trial on one grid, by channel of a simulation."""
    end = min(float(p.knots[-5]) for p in trial.paths.values())
    at = np.linspace(trial.start.time, end, _GRID)
    t, base = at - trial.start.time, _base(trial)
    records: dict[str, Record] = {}
    for name, path in trial.paths.items():
        channel = _depth(trial) if name == "z" else name
        if channel in CHANNELS and name not in ("x", "y"):
            records[channel] = _record(channel, t, path(at) - (base if name == "psi" else 0.0), None)
    for angle, rate in (("psi", "r"), ("theta", "q"), ("phi", "p")):
        if angle in trial.paths:
            records[rate] = _record(rate, t, trial.paths[angle](at, 1), None)
    if {"north", "east"} <= set(trial.paths):
        x, y = _turned(trial, base, trial.paths["north"](at), trial.paths["east"](at))
        records = {"x": _record("x", t, x, None), "y": _record("y", t, y, None)} | records
    return records


def _start(trial: Trial, case: Case) -> dict[str, Any]:
    """The state measured at the execute, as far as a case can start from it."""
    start: dict[str, Any] = {}
    speed = trial.metrics.get("approach_speed_mps")
    if speed is not None and speed.value > 0.0 and case.initial.speed_mps > 0.0:
        start["speed_mps"] = speed.value
    if case.initial.state == "as_given":
        for name, key in (("phi", "heel_deg"), ("theta", "pitch_deg")):
            if name in trial.paths:
                start[key] = math.degrees(float(trial.paths[name](trial.start.time)))
        if "n" in trial.recording.channels:
            start["revolutions_rps"] = float(trial.recording.channels["n"].at(trial.start.time))
    if "z" in trial.paths and _depth(trial) == "D0":
        start["depth_m"] = float(trial.paths["z"](trial.start.time))
    return start


def _commands_differ(case: Case, trial: Trial) -> list[str]:
    """What the record was ordered to do otherwise than the case."""
    from ident.trials.trial import side_of

    said = []
    one = case.command.dH if trial.maneuver.horizontal else case.command.dV
    if one.law != "zigzag" or "zigzag" not in trial.maneuver.kind:
        return []
    first = "starboard" if one.first_deg > 0 else "port"
    if trial.maneuver.horizontal and side_of(trial) != first:
        said.append(f"commands differ: the case goes to {first} first, the trial to {side_of(trial)}")
    pairs = (abs(one.first_deg), trial.maneuver.planes), (one.check_deg, trial.maneuver.check)
    for name, (flown, was) in zip(("plane angle", "check angle"), pairs, strict=True):
        if was is not None and abs(flown - was) > 0.5:
            said.append(f"commands differ: {name} {flown:g} deg in the case, {was:g} deg in the trial")
    return said


def _steps(t: Array, value: Array, alike: float) -> list[tuple[float, float]]:
    """Duration and value of stretches over which a recorded control is one value."""
    steps: list[tuple[float, float]] = []
    start = 0
    for i in range(1, len(t)):
        if abs(value[i] - value[start]) > alike:
            steps.append((float(t[i] - t[start]), float(value[start])))
            start = i
    return [*steps, (float("inf"), float(value[start]))]


def _held(t: Array, value: Array) -> tuple[Array, Array]:
    """Times from the execute on at which a sampled control takes each value: midway between two samples.

    An order that changed between two samples did so at their middle, give or take; an angle that ramps is
    followed by steps about it.
    """
    middle = t - 0.5 * float(np.median(np.diff(t)))
    first = int(np.searchsorted(middle, 1e-9)) - 1
    held = value[first:] if first >= 0 else np.concatenate([value[:1], value])
    return np.concatenate([[0.0], middle[first + 1 :]]), held


def _driven(case: Case, trial: Trial) -> tuple[Case | None, list[str]]:
    """The case with the recorded rudder or planes, and the recorded change of the revolutions."""
    axis, names = ("dH", ("dH", "dH_order")) if trial.maneuver.horizontal else ("dV", ("dV",))
    name = next((n for n in names if n in trial.recording.channels), None)
    if name is None:
        return None, ["no rudder or plane angle in the record: it cannot be flown open loop"]
    record = trial.recording.channels[name]
    t = record.abscissa - trial.start.time
    value = record.value
    first = float(value[int(np.argmax(np.abs(value) > 0.5 * float(np.max(np.abs(value)))))])
    from ident.trials.trial import side_of

    sides = {"starboard": 1.0, "bow up": 1.0, "port": -1.0, "bow down": -1.0}
    sign = math.copysign(1.0, first) * sides.get(side_of(trial), 1.0)
    header = trial.recording.headers[name]
    said = [] if sign > 0.0 else [f"{header}: positive turns to port or down here, taken with the other sign"]
    steps = [
        PlaneStep(value_deg=math.degrees(v), until=[Event(after_s=d)] if math.isfinite(d) else [])
        for d, v in _steps(*_held(t, sign * value), _ALIKE)
    ]
    law = PlaneCommand(law="programme", step=steps, limit_deg=getattr(case.command, axis).limit_deg)
    update: dict[str, Any] = {axis: law}
    if "n" in trial.recording.channels and case.command.n.law == "fixed":
        n = trial.recording.channels["n"]
        at = n.kept(n.abscissa >= trial.start.time - 1e-9)
        ratio = at.value / float(at.value[0]) if len(at) > 2 and at.value[0] else np.ones(1)
        if float(np.ptp(ratio)) > 0.02:
            kept = _steps(at.abscissa, ratio, 0.01)
            speeds = [SpeedStep(times_initial=v, until=[Event(after_s=d)] if math.isfinite(d) else []) for d, v in kept]
            update["n"] = SpeedCommand(law="programme", step=speeds, limits_rps=case.command.n.limits_rps)
    begun = case.started_as(TRIAL) or case
    return begun.model_copy(update={"command": case.command.model_copy(update=update)}), said


def smoothed(series: Series, where: str) -> Series:
    """Series whose noisy channels have a smooth path that metrics are measured on; others are as they are.

    Raises
    ------
    InputError
        Naming the channel of ``where`` through which there is none: a time or value of another size than the others.
    """
    if series.abscissa != "t":
        return series
    for source, channels in series.data.items():
        smooth = {}
        for name, record in channels.items():
            try:
                path = _if_noisy(record)
            except np.linalg.LinAlgError as error:
                ends = f"times from {record.abscissa[0]:g} to {record.abscissa[-1]:g} s"
                found = f"no smooth path through it, {ends}: {error}"
                remedy = "times that are even, and values of one size: look at the clock and the units"
                raise InputError(f"{where}, {source} {name}", found, remedy) from error
            if path is not None:
                smooth[name] = path
        if smooth:
            series.smooth[source] = channels | smooth
    return series


def _if_noisy(record: Record) -> Record | None:
    if len(record) < 30:
        return None
    from ident.timeseries.noise import Samples
    from ident.timeseries.smoothing import smooth

    path: SmoothPath = smooth([Samples(record.abscissa, record.value, 0, 0.0)])
    turns = [int(np.count_nonzero(np.diff(np.sign(np.diff(x))))) for x in (record.value, path(record.abscissa))]
    if turns[0] <= _MORE_TURNS * turns[1] + 5:
        return None
    at = np.linspace(record.abscissa[0], record.abscissa[-1], _GRID)
    return _record(record.channel, at, path(at), None) if record.channel in CHANNELS else None
