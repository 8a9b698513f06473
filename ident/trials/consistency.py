"""Whether the channels of a record can be those of one boat: rates, speeds and tracks held against one another."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.captive.unit_slips import factor_between
from ident.checks.findings import Finding
from ident.timeseries.noise import Samples
from ident.timeseries.smoothing import SmoothPath, smooth
from ident.trials.body import body_rate
from ident.trials.earth import drift
from ident.trials.reading import Recording
from sim.files.errors import InputError
from sim.files.record import Record

Array = NDArray[np.float64]
# Rate -> the channel that it is the rate of.
RATES = {"r": "psi", "p": "phi", "q": "theta", "udot": "u"}
_NAMES = {"r": "yaw rate", "p": "roll rate", "q": "pitch rate", "udot": "surge acceleration", "psi": "heading"}
_NAMES |= {"phi": "heel", "theta": "pitch", "u": "speed ahead", "U": "speed"}
_SAME, _ALIKE = 0.1, 0.9
_MOST_DRIFT = math.radians(40.0)
# What moves by less than so many standard errors of a sample lies still.
_SCATTER = 6.0
# Heading and track of a boat turn by angles that differ by less than this factor.
_TURNS_ALIKE = 2.0


@dataclass(frozen=True)
class Pair:
    """A channel regressed on what it should be: slope, offset, correlation, and where they differ most."""

    slope: float
    offset: float
    correlation: float
    worst: float

    @property
    def agrees(self) -> bool:
        """One curve, within a tenth."""
        return self.correlation > _ALIKE and abs(self.slope - 1.0) < _SAME


def regressed(time: Array, value: Array, like: Array) -> Pair | None:
    """A channel on what it should be; None where that does not move."""
    spread = float(np.std(like))
    if spread == 0.0 or float(np.std(value)) == 0.0 or value.size < 8:
        return None
    slope, offset = np.polyfit(like, value, 1)
    correlation = float(np.corrcoef(like, value)[0, 1])
    away = np.abs(value - like)
    return Pair(float(slope), float(offset), correlation, float(time[int(np.argmax(away))]))


def path_of(record: Record, memory: float | None = 0.0) -> SmoothPath:
    """The smooth path through a record, for its noise white.

    Parameters
    ----------
    record : One channel.
    memory : None for noise that may be alike from sample to sample. Checks take what is alike for motion: the steps
        of a rudder under another's name must not pass for noise.
    """
    return smooth([Samples(record.abscissa, record.value, 0, 0.0, memory)])


def finding_of(
    one: Recording, check: str, columns: tuple[str, ...], at: float, what: str, remedy: str, severity: str = "error"
) -> Finding:
    """A finding at a time of a record, with the headers of its channels."""
    headers = tuple(one.headers.get(c, c) for c in columns)
    return Finding(check, severity, one.file, (one.row_at(at),), headers, what, remedy)


def _inside(record: Record, time: Array) -> NDArray[np.bool_]:
    return np.asarray((time >= record.abscissa[0]) & (time <= record.abscissa[-1]))


def expected_rate(one: Recording, name: str, path: Callable[[str], SmoothPath], at: Array) -> Array:
    """What a rate should be by its angle [SI]; about the axes of the boat where heel and pitch are recorded."""
    if name == "udot":
        return path("u")(at, 1)
    angles = [a for a in ("psi", "theta", "phi") if a in one.channels and len(one.channels[a]) >= 8]
    return body_rate(name, {a: path(a)(at) for a in angles}, {a: path(a)(at, 1) for a in angles})


def _rates(one: Recording, slopes: dict[str, SmoothPath]) -> list[Finding]:
    """Rates against the angles they are rates of, and against those of others."""
    findings = []
    for name in RATES:
        if name not in one.channels:
            continue
        rate = one.channels[name]
        pairs = {}
        for angle, path in slopes.items():
            if (angle == "u") != (name == "udot"):
                continue
            inside = _inside(one.channels[angle], rate.abscissa)
            at = rate.abscissa[inside]
            like = expected_rate(one, name, slopes.__getitem__, at) if angle == RATES[name] else path(at, 1)
            pair = regressed(at, rate.value[inside], like) if inside.sum() >= 8 else None
            if pair:
                pairs[angle] = pair
        findings += _of_rate(one, name, pairs)
    return findings


def _of_rate(one: Recording, name: str, pairs: dict[str, Pair]) -> list[Finding]:
    of_its_angle = pairs.get(RATES[name])
    others = {a: p for a, p in pairs.items() if a != RATES[name] and abs(p.correlation) > 0.95}
    header = one.headers[name]
    if others and (of_its_angle is None or abs(of_its_angle.correlation) < 0.8):
        angle, pair = max(others.items(), key=lambda item: abs(item[1].correlation))
        right = next(k for k, v in RATES.items() if v == angle)
        what = (
            f"{header} is read as {_NAMES[name]} {name}, and is the rate of {_NAMES[angle]} {angle} "
            f"(correlation {pair.correlation:.3f}, slope {pair.slope:.3g}): channels exchanged"
        )
        remedy = f'trial.toml: [channels] "{header}" = "{right} [UNIT]", or mend the file'
        return [finding_of(one, "exchanged_channels", (name, angle), pair.worst, what, remedy)]
    if of_its_angle is None or of_its_angle.agrees:
        return []
    words = f"{header} against the rate of {one.headers[RATES[name]]}: "
    words += f"slope {of_its_angle.slope:.4g}, correlation {of_its_angle.correlation:.3f}"
    slip = factor_between(of_its_angle.slope) if abs(of_its_angle.correlation) > _ALIKE else None
    if slip:
        remedy = f'state the right unit in trial.toml: [channels] "{header}" = "{name} [UNIT]"'
        return [
            finding_of(
                one,
                "unit_slip",
                (name, RATES[name]),
                of_its_angle.worst,
                f"{words}: off by {slip[0]:.4g}, {slip[1]}",
                remedy,
            )
        ]
    if of_its_angle.correlation < -_ALIKE:
        remedy = "state the frame of the record in trial.toml: [frame], or mend the sign of one of the two"
        return [
            finding_of(
                one,
                "sign_of_a_rate",
                (name, RATES[name]),
                of_its_angle.worst,
                f"{words}: they turn against one another",
                remedy,
            )
        ]
    if of_its_angle.correlation < _ALIKE and abs(of_its_angle.slope) < 2.0 and abs(of_its_angle.slope) > 0.5:
        # A noisy rate of the right size: nothing is wrong with it but the noise.
        return []
    remedy = "the rate is not used; look at its unit, its zero and its filter"
    return [finding_of(one, "rate_against_angle", (name, RATES[name]), of_its_angle.worst, words, remedy, "warning")]


def _track(one: Recording) -> list[Finding]:
    """Track against speed and heading."""
    if not {"north", "east"} <= set(one.channels):
        return []
    north, east = one.channels["north"], one.channels["east"]
    paths = path_of(north), path_of(east)
    t = north.abscissa
    speed = np.hypot(paths[0](t, 1), paths[1](t, 1))
    middle = speed[len(speed) // 20 : len(speed) - len(speed) // 20]
    findings = []
    name = next((n for n in ("U", "u") if n in one.channels), None)
    if name and float(np.median(middle)) > 0.0:
        logs = [one.channels[name].at(t)]
        if name == "u" and "v" in one.channels:
            # Speeds ahead and abeam together are that along the track; v may hold something else.
            logs.append(np.hypot(logs[0], one.channels["v"].at(t)))
        ratios = [float(np.median(speed / np.maximum(np.abs(log), 1e-9))) for log in logs]
        ratio, log = min(zip(ratios, logs, strict=True), key=lambda pair: abs(math.log(max(pair[0], 1e-9))))
        worst = float(t[int(np.argmax(np.abs(speed - ratio * log)))])
        findings += _speed_ratio(one, name, ratio, worst)
    if "psi" in one.channels:
        findings += _course(one, np.unwrap(np.arctan2(paths[1](t, 1), paths[0](t, 1))), t)
        away = drift(one.channels["psi"], north, east, [(0, 1.0), (1, 1.0)])
        if away is not None and away > _MOST_DRIFT:
            course = np.arctan2(paths[1](t, 1), paths[0](t, 1))
            gap = np.abs(np.angle(np.exp(1j * (course - one.channels["psi"].at(t)))))
            what = f"track and heading differ by {math.degrees(away):.0f} deg (root mean square)"
            remedy = "state the axes in trial.toml, [axes] x = 'east', y = 'north', ..., or the frame; "
            remedy += "the two cannot both be right"
            findings.append(
                finding_of(
                    one, "track_against_heading", ("north", "east", "psi"), float(t[int(np.argmax(gap))]), what, remedy
                )
            )
    return findings


def _course(one: Recording, course: Array, t: Array) -> list[Finding]:
    """Turns of the track against those of the heading: in degrees and radians they differ by 57.3."""
    psi = one.channels["psi"]
    inside = _inside(psi, t)
    pair = regressed(t[inside], course[inside], psi.at(t[inside])) if inside.sum() >= 8 else None
    if pair is None or np.ptp(course[inside]) < math.radians(10.0) or pair.correlation < 0.8:
        return []
    if 1.0 / _TURNS_ALIKE < pair.slope < _TURNS_ALIKE:
        return []
    slip = factor_between(pair.slope / _lag_free(pair.slope))
    words = f"the track turns {pair.slope:.3g} times as far as {one.headers['psi']}"
    remedy = (
        f'state the right unit in trial.toml: [channels] "{one.headers["psi"]}" = "psi [UNIT]", or that of the track'
    )
    check = "unit_slip" if slip else "track_against_heading"
    more = f": off by {slip[0]:.4g}, {slip[1]}" if slip else ""
    return [finding_of(one, check, ("psi", "north", "east"), pair.worst, words + more, remedy)]


def _lag_free(slope: float) -> float:
    """Drift makes a track turn somewhat less or more than the heading; a unit slip is told all the same."""
    degrees = math.degrees(1.0)
    for value in (degrees, 1.0 / degrees):
        if 0.6 < slope / value < 1.6:
            return slope / value
    return 1.0


def _speed_ratio(one: Recording, name: str, ratio: float, at: float) -> list[Finding]:
    header = one.headers[name]
    words = f"the track runs at {ratio:.4g} of the speed in {header}"
    slip = factor_between(ratio)
    if slip and abs(ratio - 1.0) > 0.25:
        remedy = f'state the right unit in trial.toml: [channels] "{header}" = "{name} [UNIT]", or that of the track'
        return [finding_of(one, "unit_slip", (name, "north", "east"), at, f"{words}: {slip[1]} exchanged", remedy)]
    if abs(ratio - 1.0) > 0.25:
        remedy = "look at units and scale of track and speed; the two cannot both be right"
        return [finding_of(one, "track_against_speed", (name, "north", "east"), at, words, remedy)]
    if abs(ratio - 1.0) > 0.05:
        remedy = "a current, or a log that is off; [current] in trial.toml takes a current off the track"
        return [finding_of(one, "track_against_speed", (name, "north", "east"), at, words, remedy, "warning")]
    return []


def _moving(one: Recording) -> Recording:
    """The recording without what lies still under its noise: a track at rest, a rate and an angle that do not turn."""
    still = {name for name in ("psi", "theta", "phi", "r", "p", "q", "north", "east") if _still(one.channels.get(name))}
    gone = {c for rate, angle in RATES.items() if {rate, angle} <= still for c in (rate, angle)}
    gone |= {"north", "east"} if {"north", "east"} <= still else set()
    return one.with_(channels={k: r for k, r in one.channels.items() if k not in gone}) if gone else one


def _still(record: Record | None) -> bool:
    """Whether the smooth path of a channel moves by less than single samples scatter."""
    if record is None or len(record) < 8:
        return False
    path = path_of(record)
    return float(np.ptp(path(record.abscissa))) < _SCATTER * path.sigma


def check_recording(one: Recording) -> list[Finding]:
    """Everything about a recording that two of its channels tell one another.

    Parameters
    ----------
    one : In program axes.

    Returns
    -------
    Findings with file, row, columns and remedy.
    """
    one = _moving(one)
    angles: list[str] = [a for a in ("psi", "phi", "theta", "u") if a in one.channels and len(one.channels[a]) >= 8]
    slopes = {a: path_of(one.channels[a]) for a in angles}
    return [*_rates(one, slopes), *_track(one)]


def refused(one: Recording, findings: list[Finding], uses_track: bool, heading_sure: bool) -> None:
    """Refuse a record whose numbers would be wrong.

    Parameters
    ----------
    uses_track : The metrics are read off the track.
    heading_sure : The heading is borne out by rudder or track; a rate that is off then is off alone.

    Raises
    ------
    InputError
        Naming file, row and columns of the first finding that decides a number, with its remedy.
    """
    for finding in findings:
        track = finding.check.startswith("track") or "north" in finding.what or "track" in finding.what
        if finding.check == "exchanged_channels":
            break
        if finding.severity == "error" and track and uses_track:
            break
        if finding.severity == "error" and not track and not heading_sure:
            break
    else:
        return
    many = "s" if len(finding.columns) > 1 else ""
    place = f"{one.file}, row {finding.shown_rows}, column{many} {', '.join(finding.columns)}"
    raise InputError(place, finding.what, finding.remedy)
