"""Course and depth keeping: how far a boat strays from its course and depth, and how it comes back from a push."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.metrics import vertical
from ident.trials.alignment import Start
from ident.trials.drawn import Drawn, Metrics
from ident.trials.maneuvers import control_of, holds
from ident.trials.reading import Recording
from ident.trials.spec import TrialFile
from sim.files.errors import InputError
from sim.files.record import Record

Array = NDArray[np.float64]
_DEGREES = math.degrees(1.0)
# A push by the rudder: at least this angle, held from so soon after the execute [s].
_PUSH, _SOON = math.radians(1.0), 10.0


@dataclass(frozen=True)
class Steering:
    """From when the autopilot steers, after a push by the rudder.

    Attributes
    ----------
    released, sigma : Time from which it steers, on the record's clock, and its standard error [s].
    rudder : The recorded rudder; None where there is none.
    said : How it is known.
    """

    released: float
    sigma: float
    rudder: Record | None
    said: str


def steering_of(one: Recording, start: Start, spec: TrialFile) -> Steering | None:
    """When the autopilot took over: stated, or the end of a rudder angle held from the execute; None for no push.

    Raises
    ------
    InputError
        For a stated time outside the record.
    """
    rudder = control_of(one)
    if spec.released_s is not None:
        time = (spec.released_s - one.zero) * math.sqrt(spec.scale)
        if not start.time <= time < float(one.rows[0][-1]):
            allowed = "a time of the record, after the execute"
            raise InputError(f"{one.file}, key released_s", f"{spec.released_s:g}", allowed)
        return Steering(time, 0.0, rudder, f"the autopilot steers from {spec.released_s:g} s: stated")
    if rudder is None:
        return None
    step = float(np.median(np.diff(rudder.abscissa)))
    after = [h for h in holds(rudder) if h.end > start.time + step]
    push = after[0] if after else None
    if (
        push is None
        or push.start > start.time + _SOON
        or push.start < start.time - 2.5 * step
        or abs(push.value) < _PUSH
        or push.end >= rudder.abscissa[-1] - step
    ):
        return None
    header = one.headers[rudder.channel]
    text = (
        f"{header} held at {math.degrees(push.value):.1f} deg until {push.end:.2f} s: the autopilot steers from there"
    )
    return Steering(push.end + 0.5 * step, step / math.sqrt(12.0), rudder, text)


def keeping(one: Drawn, start: Start, steering: Steering | None) -> Metrics:
    """Root mean square and largest deviations; after a push also how the autopilot brings the boat back.

    Parameters
    ----------
    one, start : A draw, and the execute.
    steering : From ``steering_of``.

    Returns
    -------
    ``heading_rms_deg``, ``pitch_rms_deg``, ...: about the mean. ``..._deviation_peak``: from the mean; the
    heading's from the course before the execute where that is known. With a push the metrics of
    ``ident.metrics.vertical.course_keeping``.
    """
    metrics: Metrics = {}
    for name, word, factor, unit in (
        ("psi", "heading", _DEGREES, "deg"),
        ("theta", "pitch", _DEGREES, "deg"),
        ("phi", "heel", _DEGREES, "deg"),
        ("z", "depth", 1.0, "m"),
    ):
        if name in one.values:
            values = factor * one.values[name]
            metrics[f"{word}_rms_{unit}"] = float(np.std(values))
            middle = factor * one.base if name == "psi" and one.base is not None else values.mean()
            metrics[f"{word}_deviation_peak_{unit}"] = float(np.max(np.abs(values - middle)))
    if steering is None or "psi" not in one.values:
        return metrics
    channels = one.horizontal(start.time)
    channels["psi"] = channels["psi"].copy()
    channels["psi"][0] = 0.0
    channels.setdefault("y", np.zeros_like(channels["t"]))
    channels["dH"] = np.zeros_like(channels["t"])
    back = vertical.course_keeping(channels, steering.released - start.time)
    back.pop("rudder_rms_deg")
    if "north" not in one.values:
        back.pop("lateral_offset_m")
    return metrics | back


def rudder_used(steering: Steering) -> tuple[float, float] | None:
    """Root mean square of the rudder while the autopilot steers and its standard error [deg], from its samples.

    The rudder is no smooth path: its noise is that of third differences, taken off the mean square; the error of
    sampling is what every second sample says otherwise.
    """
    if steering.rudder is None:
        return None
    after = steering.rudder.kept(steering.rudder.abscissa >= steering.released)
    if len(after) < 16:
        return None
    x = _DEGREES * after.value
    noise = float(np.median(np.abs(np.diff(x, 3)))) / (0.6745 * math.sqrt(20.0))

    def rms(values: Array) -> float:
        return math.sqrt(max(float(np.mean(values**2)) - noise**2, 0.0))

    whole, halves = rms(x), (rms(x[::2]), rms(x[1::2]))
    return whole, max(abs(halves[0] - halves[1]) / 2.0, noise / math.sqrt(2.0 * x.size))
