"""The four instants of an oscillatory test, each a run of its own, from the harmonics of its loads."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.captive.quantities import HARMONICS, TAKEN
from ident.captive.source import MOTIONS, Reduction
from sim.boat.catalogue import OUTPUTS
from sim.boat.forces import body_velocity
from sim.files.errors import InputError
from sim.files.frames import Frame

Array = NDArray[np.float64]

# The four states of an oscillation: name, phase of the displacement A sin(theta).
PHASES = {"+v": 0.0, "-v": math.pi, "+a": math.pi / 2, "-a": 3 * math.pi / 2}

# Amplitudes of rate and acceleration in a table are printed with three digits or more.
_AGREE = 0.02
# Those measured, and what was taken off them.
_LOADS = (*OUTPUTS, *(TAKEN + o for o in OUTPUTS))
# Angles of the body at an instant, columns that go with the hydrostatic load: the incidence that it stands at
# before the oscillation adds to the flow, and what roll and pitch turn gravity by in its axes.
STOOD, HEEL, TRIM = "stood", "heel", "trim"
_TURNS_GRAVITY = {"roll": HEEL, "pitch": TRIM}
# Test whose terms a state at the end of the velocity identifies.
_STEADY_TEST = {"surge": "towing", "sway": "drift_horizontal", "heave": "drift_vertical"}


def phase_row(theta: float, of_angle: bool = False) -> Array:
    """Weights of mean, in, out, in2, out2, in3, out3 in the load at phase ``theta``.

    The third harmonic in phase is left out: a load that is a function of the velocity and
    linear in the acceleration has none, so at the ends of the acceleration it is noise. One that is a
    function of the angle of the body as well has it (``of_angle``).
    """
    row = np.array([1.0, *(f(k * theta) for k in (1, 2, 3) for f in (math.sin, math.cos))])
    if not of_angle:
        row[HARMONICS.index("in3")] = 0.0
    return row


@dataclass(frozen=True)
class Oscillation:
    """An oscillatory test as its harmonics.

    Attributes
    ----------
    state : What holds for the whole run: words, and the quantities of its mean state (SI, campaign frame); the
        amplitude of the velocity or of the acceleration (-A w^2, signed) under its name, where it is given.
    harmonics : Load -> (7,) of ``HARMONICS``; NaN where one is not given.
    covariance : Load -> (7, 7) of its harmonics, where it is known.
    frequency : [Hz]. amplitude : Of the displacement [m, rad]. None where not given.
    """

    state: dict[str, Any]
    harmonics: dict[str, Array]
    covariance: dict[str, Array] = field(default_factory=dict)
    frequency: float | None = None
    amplitude: float | None = None

    @classmethod
    def of_row(cls, row: Mapping[str, Any]) -> Oscillation:
        """From a row of a table: ``X_mean``, ``X_in``, ... beside the state, ``frequency`` and ``displacement``."""
        apart = ("frequency", "amplitude", "displacement")
        state = {k: v for k, v in row.items() if k not in apart and ("_" not in k or k.split("_")[-1] not in HARMONICS)}
        named = {o: [f"{o}_{h}" for h in HARMONICS] for o in _LOADS}
        harmonics = {o: np.array([row.get(k, math.nan) for k in keys], dtype=float) for o, keys in named.items()}
        stated = [row[k] for k in ("amplitude", "displacement") if row.get(k) is not None]
        return cls(state, harmonics, frequency=row.get("frequency"), amplitude=stated[0] if stated else None)


def states(run: Oscillation, rule: Reduction, frame: Frame, ittc: bool, where: str) -> list[dict[str, Any]]:
    """Four instants of an oscillatory test, each a run of its own.

    The displacement is A sin(theta); the velocity A w cos(theta) is largest at 0 and pi,
    the acceleration -A w^2 sin(theta) at pi/2 and 3 pi/2. The load there is the sum of its
    harmonics 0-3 (in phase: of sine, in quadrature: of cosine).

    Parameters
    ----------
    run : The test; of amplitude, velocity and acceleration one is given, here or in the rule.
    rule : Says what oscillates.
    frame, ittc : Of the campaign: direction of the axis that moves, sign of drift.
    where : For the error.

    Returns
    -------
    Rows of a run table.

    Raises
    ------
    InputError
        Without frequency, amplitude, or any load.
    """
    assert rule.motion is not None
    speed_name, acceleration_name = MOTIONS[rule.motion]
    omega = _omega(run, rule, where)
    speed, given = _amplitudes(run, rule, omega, where)
    made = []
    for name, theta in PHASES.items():
        state = dict(run.state)
        state["run_id"] = f"{run.state['run_id']}{name}"
        at_velocity = name.endswith("v")
        _move(state, speed_name, speed * math.cos(theta) if at_velocity else 0.0, frame, ittc)
        state[acceleration_name] = 0.0 if at_velocity else given * math.sin(theta)
        state[STOOD] = float(np.nan_to_num(run.state.get("alpha", 0.0) or 0.0))
        if rule.motion in _TURNS_GRAVITY:
            swing = frame.sign(speed_name) * speed / omega
            state[_TURNS_GRAVITY[rule.motion]] = swing * math.sin(theta)
        straight = rule.path == "straight"
        if straight:
            _across(state, rule.motion, frame.sign(speed_name) * speed / omega * math.sin(theta), ittc, at_velocity)
        usual = _STEADY_TEST.get(rule.motion, "rotating_arm")
        state["test"] = (run.state.get("test") or usual) if at_velocity else "acceleration"
        weights = phase_row(theta, straight)
        for output in _LOADS:
            parts = run.harmonics.get(output)
            if parts is None or np.isnan(parts).all():
                continue
            state[output] = float(weights @ np.nan_to_num(parts))
            if output in OUTPUTS and output in run.covariance:
                variance = float(weights @ run.covariance[output] @ weights)
                state[f"s_{output}"] = math.sqrt(max(variance, 0.0))
        made.append(state)
    return made


def amplitude_of(run: Oscillation, rule: Reduction, where: str) -> float:
    """Amplitude A of the displacement A sin(theta) [m, rad], along the axis of the campaign.

    Raises
    ------
    InputError
        Without frequency, or amplitude.
    """
    omega = _omega(run, rule, where)
    return _amplitudes(run, rule, omega, where)[0] / omega


def _omega(run: Oscillation, rule: Reduction, where: str) -> float:
    omega = 2.0 * math.pi * float((rule.frequency_hz if run.frequency is None else run.frequency) or math.nan)
    if not omega > 0.0:
        raise InputError(f"{where}, column frequency", "nothing", "a frequency, or frequency_hz in [source.reduction]")
    return omega


def _amplitudes(run: Oscillation, rule: Reduction, omega: float, where: str) -> tuple[float, float]:
    """Amplitudes of velocity (of cosine) and acceleration (of sine), from what the run gives."""
    speed_name, acceleration_name = MOTIONS[rule.motion or "sway"]
    amplitude = rule.amplitude if run.amplitude is None else run.amplitude
    given = {k: run.state.get(k) for k in (speed_name, acceleration_name)}
    known = {k: float(v) for k, v in given.items() if v is not None and not math.isnan(v)}
    if acceleration_name in known:
        speed = -known[acceleration_name] / omega
    elif speed_name in known:
        speed = known[speed_name]
    elif amplitude is not None and not math.isnan(amplitude):
        speed = float(amplitude) * omega
    else:
        text = f"amplitude in [source.reduction], a column displacement, or the amplitude {acceleration_name}"
        raise InputError(f"{where}, column displacement", "nothing", text)
    # In a table all three are as printed; of a record's own channels each has its noise.
    printed = not run.covariance and bool(known) and amplitude is not None and not math.isnan(amplitude)
    if printed and abs(abs(speed) - abs(float(amplitude or 0.0)) * omega) > _AGREE * abs(speed):
        wrong = (
            f"an amplitude of {float(amplitude or 0.0):g}, and {', '.join(f'{k} = {v:g}' for k, v in known.items())}"
        )
        raise InputError(where, wrong, f"amplitudes that agree, with omega = {omega:g} rad/s; or one of them")
    off = abs(speed - known.get(speed_name, speed))
    if off > _AGREE * abs(speed):
        wrong = f"amplitudes {speed_name} = {known[speed_name]:g} and {acceleration_name} = {-speed * omega:g}"
        text = f"{acceleration_name} = -{speed_name} omega with omega = {omega:g} rad/s (displacement A sin)"
        raise InputError(where, wrong, text)
    return speed, -speed * omega


def _across(state: dict[str, Any], motion: str, angle: float, ittc: bool, at_velocity: bool) -> None:
    """Put a body that swings about an axis on a straight path into the flow at its angle.

    At the ends of its rate it is along the path and v or w changes by U times the rate: what that does and what the
    rate does are one load, which no coefficient is identified from.
    """
    if at_velocity:
        state["exclude"] = " ".join(OUTPUTS)
        state["reason"] = f"{motion} on a straight path: rate and cross acceleration are not told apart"
        return
    sign = -1.0 if ittc else 1.0
    speed, alpha, beta = (float(np.nan_to_num(state.get(k, 0.0) or 0.0)) for k in ("U", "alpha", "beta"))
    u, v, w = body_velocity(speed, alpha, sign * beta)
    c, s = math.cos(angle), math.sin(angle)
    u, v, w = (u * c + v * s, v * c - u * s, w) if motion == "yaw" else (u * c - w * s, v, w * c + u * s)
    if speed > 0.0:
        state["alpha"] = math.atan2(w, u)
        state["beta"] = sign * math.asin(max(-1.0, min(1.0, v / speed)))


def _move(state: dict[str, Any], name: str, velocity: float, frame: Frame, ittc: bool) -> None:
    """Put the velocity of the oscillation into a state: a rate, or added to the flow."""
    if name in "pqr":
        state[name] = velocity
        return
    sign = -1.0 if ittc else 1.0
    speed, alpha, beta = (float(np.nan_to_num(state.get(k, 0.0) or 0.0)) for k in ("U", "alpha", "beta"))
    moving = np.array(body_velocity(speed, alpha, sign * beta))
    moving["uvw".index(name)] += frame.sign(name) * velocity
    size = float(np.linalg.norm(moving))
    state["U"] = size
    if size > 0.0:
        state["alpha"] = math.atan2(moving[2], moving[0]) if moving[0] or moving[2] else 0.0
        state["beta"] = sign * math.asin(max(-1.0, min(1.0, moving[1] / size)))
