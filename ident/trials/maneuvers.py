"""Which maneuver a record holds: stated, or found from rudder or planes, heading, pitch and heel."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.timeseries import MAD_TO_SIGMA
from ident.timeseries.noise import Samples
from ident.timeseries.smoothing import SmoothPath, smooth
from ident.trials.reading import Recording
from sim.files.errors import InputError
from sim.files.record import Record

Array = NDArray[np.float64]
KINDS = (
    "zigzag",
    "vertical_zigzag",
    "turning_circle",
    "direct_spiral",
    "pull_out",
    "stopping",
    "roll_decay",
    "rise",
    "depth_change",
    "course_keeping",
)
_ALLOWED = "zigzag 20/20, vertical_zigzag 10/10, turning_circle 35, " + ", ".join(KINDS[3:])
# A number that stands alone; of 1e+10 the 1 is none.
_ANGLE = r"(?<![\d.])(?<!\de)(?<!\de[ +])(\d+(?:\.\d+)?)(?![.\d]|e[ +]?\d)"
# Check angles in use, and how far after the reversal its effect is seen in the heading.
_CHECKS = (1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0)
# A reversal is seen before its angle by this at most [deg], and later by this share of the rudder's way over.
_EARLY, _GEAR = 0.15, 0.25
_NOTICE = math.radians(0.3)
# A step of a spiral is held for longer [s].
_STEADY_S = 5.0
# Share of a stretch that lies near its median where it is a plateau; of a ramp it is a half.
_PLATEAU = 0.8
# A turn in which a boat has become steady.
_A_TURN = math.radians(270.0)


@dataclass(frozen=True)
class Maneuver:
    """A maneuver with its angles [deg].

    Attributes
    ----------
    kind : One of ``KINDS``.
    planes : Angle of rudder or planes, without sign; None where not known.
    check : Check angle of a zigzag.
    """

    kind: str
    planes: float | None = None
    check: float | None = None

    @property
    def horizontal(self) -> bool:
        """Whether rudder and heading make it."""
        turns = ("zigzag", "turning_circle", "direct_spiral")
        return self.kind in (*turns, "pull_out", "stopping", "course_keeping")

    def __str__(self) -> str:
        if self.check is not None:
            planes = f"{self.planes:g}" if self.planes is not None else "?"
            return f"{self.kind} {planes}/{self.check:g}"
        return self.kind if self.planes is None else f"{self.kind} {self.planes:g}"


def stated(text: str) -> Maneuver:
    """A maneuver from words such as ``zigzag 20/20``, ``turning circle 35``, ``10/10 vertical zig-zag``.

    Raises
    ------
    InputError
        For words that name none, numbers that are not plain, or a zigzag without those.
    """
    low = re.sub(r"[\s_-]+", " ", text.strip().lower()).replace("zig zag", "zigzag")
    angles = re.search(rf"{_ANGLE}\s*/\s*{_ANGLE}", low)
    single = re.search(_ANGLE, low)
    if not single and re.search(r"\d", low):
        raise InputError("maneuver", repr(text), f"plain numbers of degrees: {_ALLOWED}")
    if "zigzag" in low or re.search(r"\b(zz|hzz|vzz)\b", low):
        if not angles:
            raise InputError("maneuver", repr(text), "a zigzag with rudder and check angle: zigzag 20/20")
        kind = "vertical_zigzag" if "vert" in low or "vzz" in low or "depth" in low else "zigzag"
        execute, check = float(angles[1]), float(angles[2])
        if not (0.0 < execute <= 90.0 and 0.0 < check <= 90.0):
            raise InputError("maneuver", repr(text), "rudder and check angle above 0, at most 90 deg")
        return Maneuver(kind, execute, check)
    words = {"turn": "turning_circle"}
    words |= {"spiral": "direct_spiral", "pull": "pull_out", "stop": "stopping"}
    words |= {"roll": "roll_decay", "rise": "rise", "max q": "rise", "surfac": "rise", "depth": "depth_change"}
    words |= {"course keep": "course_keeping", "heading keep": "course_keeping"}
    kind = next((k for word, k in words.items() if word in low), "")
    if not kind:
        raise InputError("maneuver", repr(text), _ALLOWED)
    planes = float(single[1]) if single and kind in ("turning_circle", "rise") else None
    if planes is not None and planes > 90.0:
        raise InputError("maneuver", repr(text), "an angle of rudder or planes of 90 deg at most")
    return Maneuver(kind, planes)


@dataclass(frozen=True)
class Hold:
    """A stretch over which rudder or planes stay at one angle [rad]."""

    start: float
    end: float
    value: float


def holds(record: Record, share: float = 0.04) -> list[Hold]:
    """The stretches over which a control stays where it is, of three samples or more.

    Parameters
    ----------
    record : Of the rudder, the planes, or an order.
    share : Of its range, by which it may stray from where it stays; smaller for steps that are.
    """
    t, x = record.abscissa, record.value
    spread = float(np.percentile(x, 98) - np.percentile(x, 2))
    tolerance = max(share * spread, 4.0 * MAD_TO_SIGMA * float(np.median(np.abs(np.diff(x)))), math.radians(0.2))
    total = np.concatenate([[0.0], np.cumsum(x)])
    out: list[Hold] = []
    start = 0
    for i in range(1, len(x) + 1):
        mean = (total[i] - total[start]) / (i - start)
        if i < len(x) and abs(x[i] - mean) <= tolerance:
            continue
        if i - start >= 3 and not _on_a_ramp(x, start, i) and (plateau := _plateau(x[start:i], tolerance)):
            first, last = start + plateau[0], start + plateau[1]
            out.append(Hold(float(t[first]), float(t[last]), float(np.median(x[first : last + 1]))))
        start = i
    return out


def _on_a_ramp(x: Array, start: int, end: int) -> bool:
    """Whether a stretch runs as steeply as what it hangs between: a control sampled often is seen on its way."""
    into = abs(float(x[start] - x[start - 1])) if start else math.inf
    out = abs(float(x[end] - x[end - 1])) if end < len(x) else math.inf
    return abs(float(x[end - 1] - x[start])) / (end - start - 1) > 0.5 * max(into, out)


def _plateau(x: Array, tolerance: float) -> tuple[int, int] | None:
    """First and last sample of a plateau, less what of a ramp hangs on to its ends; None for a piece of a ramp."""
    if abs(float(x[-1] - x[0])) < tolerance:
        return 0, x.size - 1
    near = np.flatnonzero(np.abs(x - np.median(x)) <= 0.5 * tolerance)
    return (int(near[0]), int(near[-1])) if near.size >= _PLATEAU * x.size else None


def large(levels: list[Hold]) -> list[Hold]:
    """The holds of a maneuver, not those by which a straight course is kept."""
    most = max((abs(h.value) for h in levels), default=0.0)
    return [h for h in levels if most > math.radians(0.5) and abs(h.value) > 0.4 * most]


def turn_ends(control: Record) -> float | None:
    """When the rudder leaves the one side that a turn is made to [s]; None where it stays to the end."""
    levels = holds(control)
    used = large(levels)
    if not used or any(h.value * used[0].value < 0.0 for h in used):
        return None
    away = [h.start for h in levels if h.start > used[-1].end and abs(h.value) < 0.4 * abs(used[0].value)]
    return used[-1].end if away else None


def control_of(one: Recording, vertical: bool = False) -> Record | None:
    """Record of what steers the maneuver: the order where it is recorded, else the angle."""
    names = ("dV",) if vertical else ("dH_order", "dH")
    return next((one.channels[n] for n in names if n in one.channels), None)


def _by_control(one: Recording, angle: Record, control: Record, vertical: bool) -> Maneuver | None:
    """A maneuver from the steps of rudder or planes and what the angle does."""
    levels = holds(control)
    used = large(levels)
    if not used:
        return None
    before = angle.value[angle.abscissa <= used[0].start + 1e-9]
    turned = angle.value - float(np.median(before[-20:] if used[0].start > 0.0 else angle.value[:1]))
    planes = round(math.degrees(float(np.median([abs(h.value) for h in used]))) * 2.0) / 2.0
    zigzag = _zigzag_by_control(used, angle.abscissa, turned, planes)
    if zigzag is not None:
        return Maneuver("vertical_zigzag" if vertical else "zigzag", planes, zigzag)
    if vertical:
        return None
    if len({round(math.degrees(h.value)) for h in levels if h.end - h.start > _STEADY_S}) >= 5:
        return Maneuver("direct_spiral")
    ended = turn_ends(control)
    if ended is not None and abs(float(np.interp(ended, angle.abscissa, turned))) > _A_TURN:
        # A pull-out that ends a turning circle is told by the turn.
        return Maneuver("turning_circle", planes)
    if any(abs(h.value) < 0.1 * abs(used[0].value) and h.start > used[0].start for h in levels):
        return Maneuver("pull_out")
    if len(used) == 1 and abs(turned[-1]) > math.radians(120.0):
        return Maneuver("turning_circle", planes)
    return None


def steered(one: Recording, angle: str, control: str, record: Record | None = None) -> bool:
    """Whether a control makes steps to which an angle answers by a zigzag, a turn, a spiral or a pull-out."""
    record = one.channels[control] if record is None else record
    if float(np.ptp(one.channels[angle].value)) < math.radians(3.0):
        return False
    return _by_control(one, one.channels[angle], record, angle == "theta") is not None


def _zigzag_by_control(used: list[Hold], t: Array, turned: Array, planes: float) -> float | None:
    """Check angle [deg] where the steps are those of a zigzag: to and fro by one angle."""
    used = [list(side)[-1] for _, side in itertools.groupby(used, key=lambda h: h.value > 0.0)]
    alike = all(abs(abs(math.degrees(h.value)) - planes) < 0.2 * planes for h in used)
    if not (len(used) >= 2 and alike and np.ptp(turned) < math.radians(170.0)):
        return None
    half = 0.5 * float(np.median(np.diff(t)))
    ends = np.array([h.end + half for h in used[:-1]])
    turned_at = np.interp(ends, t, turned)
    sides = [np.abs(turned_at[side]) for side in (turned_at > 0.0, turned_at < 0.0) if side.any()]
    # The mean of both sides, which a course that was not quite held before does not change.
    at = math.degrees(float(np.mean([np.median(side) for side in sides])))
    rates = np.abs(np.interp(ends + half, t, turned) - np.interp(ends - half, t, turned)) / (2.0 * half)
    rate = math.degrees(float(np.median(rates)))
    # No rudder is reversed before the check angle, but by a sample; its gear takes a part of the time of its way.
    way = float(np.median([b.start - a.end for a, b in itertools.pairwise(used)]))
    near = max((c for c in _CHECKS if c <= at + rate * half + _EARLY), default=_CHECKS[0])
    late = max(1.0, 0.08 * near, _GEAR * way * rate)
    return near if abs(near - at) < late else float(round(at))


def reversal_angle(t: Array, path: SmoothPath, base: float) -> tuple[float, list[float]]:
    """Check angle of a zigzag [deg], from where the heading alone shows that the rudder was reversed.

    Parameters
    ----------
    t : Times of the record [s].
    path : Its heading.
    base : Course at the start [rad].

    Returns
    -------
    The angle in use next below, and the angles [deg] at which the yaw began to slow down.
    """
    grid = np.linspace(t[0], t[-1], 4000)
    x, rate, acceleration = path(grid) - base, path(grid, 1), path(grid, 2)
    turns = np.flatnonzero(rate[:-1] * rate[1:] < 0.0)
    ends = [i for i in turns if abs(x[i]) > 0.25 * float(np.max(np.abs(x)))]
    seen = []
    for before, end in zip([0, *map(int, ends)], map(int, ends), strict=False):
        if end - before < 20:
            continue
        sense = math.copysign(1.0, x[end])
        slowing = sense * acceleration[before : end + 1]
        bottom = int(np.argmin(slowing))
        fell = np.flatnonzero(slowing[:bottom] > 0.25 * slowing[bottom])
        if fell.size:
            seen.append(math.degrees(sense * float(x[before + fell[-1]])))
    if not seen:
        return math.nan, []
    lowest = float(np.median(seen)) + math.degrees(_NOTICE)
    return max((c for c in _CHECKS if c <= lowest), default=math.nan), seen


def _by_angle(one: Recording, name: str) -> tuple[Maneuver, str] | None:
    """A turn or a zigzag, from heading or pitch alone."""
    record = one.channels[name]
    path = smooth([Samples(record.abscissa, record.value, 0, 0.0)])
    base = float(path(record.abscissa[0]))
    turned = path(record.abscissa) - base
    if (
        name == "psi"
        and abs(turned[-1]) > math.radians(120.0)
        and abs(turned[-1]) > 0.9 * float(np.max(np.abs(turned)))
    ):
        return Maneuver("turning_circle"), "turning circle: the heading turns on to one side"
    high, low = float(turned.max()), float(turned.min())
    if min(high, -low) < math.radians(0.5) or min(high, -low) < 0.25 * max(high, -low):
        return None
    check, seen = reversal_angle(record.abscissa, path, base)
    if math.isnan(check):
        return None
    kind, control, motion = ("zigzag", "rudder", "yaw") if name == "psi" else ("vertical_zigzag", "plane", "pitch")
    shown = ", ".join(f"{s:.1f}" for s in seen)
    text = f"{kind} with check angle {check:g} deg: no {control} in the record; {motion} begins to slow down at {shown}"
    return Maneuver(kind, None, check), text + f' deg. State it if it is another: --maneuver "{kind} D/C"'


def _rudder_fits(one: Recording, angle: str, maneuver: Maneuver) -> None:
    """Refuse a zigzag that the heading shows, and a recorded rudder that does not go to and fro in steps.

    Raises
    ------
    InputError
        Naming the column of the rudder.
    """
    control = control_of(one, angle == "theta")
    if control is None or maneuver.check is None or float(np.ptp(control.value)) < math.radians(1.0):
        return
    header, turning = one.headers[control.channel], one.headers[angle]
    what = f"{turning} makes a zigzag, and {header} holds no steps to and fro by one angle: channels exchanged?"
    text = (
        f'trial.toml: [channels] "{header}" = the channel that it is, or "-" to leave it out; or --maneuver zigzag D/C'
    )
    raise InputError(f"{one.file}, column {header}", what, text)


def maneuver_of(one: Recording, text: str) -> tuple[Maneuver, str]:
    """The maneuver of a record, and by what it is known.

    Raises
    ------
    InputError
        When it is not stated and cannot be found.
    """
    if text:
        return stated(text), f"maneuver {text}: stated"
    for angle, vertical in (("psi", False), ("theta", True)):
        control = control_of(one, vertical)
        if angle in one.channels and control is not None:
            known = _by_control(one, one.channels[angle], control, vertical)
            if known:
                by = one.headers[control.channel]
                return known, f"maneuver {known}: found from {by} and {one.headers[angle]}"
    for angle in ("psi", "theta"):
        by_angle = _by_angle(one, angle) if angle in one.channels else None
        if by_angle:
            _rudder_fits(one, angle, by_angle[0])
            return by_angle[0], "maneuver: " + by_angle[1]
    if "psi" not in one.channels and "north" in one.channels:
        return Maneuver("turning_circle"), "turning circle: a track without heading"
    if "phi" in one.channels and not {"psi", "theta"} & set(one.channels):
        return Maneuver("roll_decay"), "roll decay: heel is the only angle"
    header = ", ".join(one.headers[name] for name in one.channels)
    unused = next((f"; {text}" for text in one.assumed if text.startswith("columns not used")), "")
    what = f"a record that shows no maneuver: {header[:160]}{unused}"
    raise InputError(one.file, what, f"--maneuver, or maneuver in trial.toml: {_ALLOWED}")
