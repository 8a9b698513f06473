"""Whether a record shows the maneuver that is measured on it: one that is stated may be another.

Every estimator finds something on every record; a zigzag measured as a turning circle has a peak heel. What a maneuver
must show is in its definition (ITTC 7.5-02-06-01): a turn goes on to one side, a stop comes to rest, a rise comes up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.timeseries.smoothing import SmoothPath
from ident.trials.alignment import Start
from ident.trials.maneuvers import Maneuver
from ident.trials.measure import Value
from ident.trials.reading import Recording
from sim.files.errors import InputError

Array = NDArray[np.float64]
# No boat swings further in a zigzag; a turn does not turn back by more; a boat that keeps a course strays less [deg].
_MOST_SWING, _MOST_BACK, _MOST_ASTRAY = 150.0, 30.0, 30.0
# Angles of rudder that make a spiral of steps.
_FEWEST_ANGLES = 3
# A rate that is so many of its standard errors is one.
_SURE = 5.0
_POINTS = 1000


@dataclass(frozen=True)
class Shown:
    """A measured record.

    Attributes
    ----------
    recording, maneuver, start, paths, metrics : As of a ``Trial``.
    until : Where the measurement ends on the record's clock [s].
    ordered : Whether the change of depth is stated.
    """

    recording: Recording
    maneuver: Maneuver
    start: Start
    paths: dict[str, SmoothPath]
    metrics: dict[str, Value]
    until: float
    ordered: bool

    def away(self, name: str) -> Array:
        """A channel less its value at the execute, SI."""
        path = self.paths[name]
        first = max(self.start.time, float(path.knots[4]))
        t = np.linspace(first, min(self.until, float(path.knots[-5])), _POINTS)
        return np.asarray(path(t) - path(first))

    def has(self, begin: str) -> bool:
        """Whether a metric whose name begins so was measured."""
        return any(name.startswith(begin) for name in self.metrics)


def _zigzag(one: Shown) -> tuple[str, str] | None:
    name = "psi" if one.maneuver.kind == "zigzag" else "theta"
    record = one.recording.channels[name]
    size = math.degrees(float(np.max(np.abs(record.value - float(one.paths[name](one.start.time))))))
    if size > _MOST_SWING:
        return name, f"a zigzag that swings by {size:.4g} deg"
    check = f"{one.maneuver.check:g} deg, the check angle of {one.maneuver}"
    if not one.has("execute_2_s"):
        return name, f"{size:.3g} deg at most, which never comes to {check}"
    if not one.has("overshoot_1_deg"):
        return name, f"{size:.3g} deg at most, which comes to {check}, and does not swing back"
    return None


def _turn(one: Shown) -> tuple[str, str] | None:
    if "psi" in one.paths:
        turned = np.degrees(one.away("psi"))
        turned = turned * (1.0 if turned[int(np.argmax(np.abs(turned)))] > 0.0 else -1.0)
        if float(turned.max()) < 90.0:
            return (
                "psi",
                f"a turn by {turned.max():.3g} deg at most; the first metrics of a turning circle are at 90 deg",
            )
        back = float(np.max(np.maximum.accumulate(turned) - turned))
        if back > _MOST_BACK:
            return "psi", f"a turn by {turned.max():.4g} deg that turns back by {back:.3g}: a turning circle goes on"
    if not (one.has("advance_90") or one.has("time_90")):
        return "north", "a track whose course never turns by 90 deg"
    return None


def _spiral(one: Shown) -> tuple[str, str] | None:
    angles = {name.split("_")[2] for name in one.metrics if name.startswith("yaw_rate_")}
    if len(angles) >= _FEWEST_ANGLES:
        return None
    return "psi", f"{len(angles)} angles at which the rudder stays; a spiral has {_FEWEST_ANGLES} steps at least"


def _pull_out(one: Shown) -> tuple[str, str] | None:
    turns = [v for name, v in one.metrics.items() if name.startswith("turn_")]
    if not any(abs(v.value) > _SURE * v.sigma for v in turns):
        return "psi", "no steady turn before the rudder is laid amidships"
    return None if one.has("residual_") else ("psi", "a rudder that is never left amidships after the turn")


def _stop(one: Shown) -> tuple[str, str] | None:
    if one.has("time_to_stop_s"):
        return None
    name = next((n for n in ("u", "U", "north") if n in one.paths), "north")
    return name, "a boat that never comes to rest: speed never falls to a twentieth of that at the execute"


def _roll(one: Shown) -> tuple[str, str] | None:
    return None if one.has("roll_period_s") else ("phi", "a heel that does not swing to and fro")


def _rise(one: Shown) -> tuple[str, str] | None:
    up = -one.away("z")
    if float(up[-1]) <= max(0.0, -2.0 * float(up.min())):
        deeper = max(0.0, -float(up.min()))
        return "z", f"a boat that ends {up[-1]:.3g} m above where it began and goes {deeper:.3g} m deeper: no rise"
    return None


def _depth(one: Shown) -> tuple[str, str] | None:
    past = one.metrics.get("overshoot_percent")
    if one.ordered or past is None or past.value <= 100.0:
        return None
    return "z", f"a depth that goes past where it ends by {past.value:.3g} % of the change: state the order, step_m"


def _course(one: Shown) -> tuple[str, str] | None:
    astray = math.degrees(float(np.max(np.abs(one.away("psi")))))
    return ("psi", f"a heading that strays by {astray:.3g} deg: no course is kept") if astray > _MOST_ASTRAY else None


_RULES: dict[str, Callable[[Shown], tuple[str, str] | None]] = {
    "zigzag": _zigzag,
    "vertical_zigzag": _zigzag,
    "turning_circle": _turn,
    "direct_spiral": _spiral,
    "pull_out": _pull_out,
    "stopping": _stop,
    "roll_decay": _roll,
    "rise": _rise,
    "depth_change": _depth,
    "course_keeping": _course,
}


def refuse_unshown(one: Shown) -> None:
    """Refuse a record that does not show the maneuver it was measured as.

    Raises
    ------
    InputError
        Naming the column, what it shows and what may be stated.
    """
    wrong = _RULES[one.maneuver.kind](one)
    if wrong is None:
        return
    header = one.recording.headers.get(wrong[0], ", ".join(one.recording.headers.values())[:80])
    place = f"{one.recording.file}, column {header}, measured as {one.maneuver}"
    remedy = f"the maneuver that was made, the unit of {header} (degrees and radians?), or execute_s, in trial.toml"
    raise InputError(place, wrong[1], remedy)
