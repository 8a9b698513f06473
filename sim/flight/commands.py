"""Commands of a case as data: laws, programmes of steps, the events that end them."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from sim.boat.catalogue import STATES
from sim.files.schema import Data, Positive
from sim.flight import orders
from sim.flight.orders import Programme

_ANGLES, _RATES = ("phi", "theta", "psi"), ("p", "q", "r")
_WATCHED = (*STATES, "U", "point_depth")
_LAWS = {"fixed": orders.FIXED, "pid": orders.PID, "zigzag": orders.ZIGZAG, "programme": orders.PROGRAMME}


# Of a command [deg]: planes turn no farther either way.
Angle = Annotated[float, Field(ge=-90.0, le=90.0)]
# Gains steer back where they are positive; negative ones would drive away.
Gain = Annotated[float, Field(ge=0.0)]
# Of planes and propeller: with more, three hundredths of a degree or a metre off take them to their limit.
# Angles of a zigzag [deg]: the smallest in use is 1/1; 20 deg as radians are 0.35.
_LEAST_ZIGZAG = 0.5
PlaneGain = Annotated[float, Field(ge=0.0, le=1000.0)]


class Event(Data):
    """What ends a step or the run: a time, or a channel that reaches something.

    ``above``, ``below``: the channel's value. ``change``: how far it went since the step
    began, either way. ``steady``: its rate of change stayed below this, per second, for
    ``for_s`` seconds. Angles in degrees, rates in degrees per second, the rest in SI; frame
    x forward, z down. D0 is the depth of the sail top; ``point_depth`` that of ``point_m``.

    Attributes
    ----------
    after_s : A time since the step began [s].
    channel : What is watched.
    above : The channel is above this.
    below : The channel is below this.
    change : The channel has gone this far since the step began.
    steady : Its rate of change stayed below this, per second.
    for_s : For so long [s].
    point_m : Point of the body whose depth is watched [m].
    """

    after_s: Positive | None = None
    channel: Literal["D0", *_WATCHED] | None = None  # type: ignore[valid-type]
    above: float | None = None
    below: float | None = None
    change: Positive | None = None
    steady: Positive | None = None
    for_s: Positive | None = None
    point_m: Annotated[list[float], Field(min_length=3, max_length=3)] | None = None

    @model_validator(mode="after")
    def _one_thing(self) -> Event:
        named = [k for k in ("after_s", "above", "below", "change", "steady") if getattr(self, k) is not None]
        if len(named) != 1:
            raise ValueError("an event names one of after_s, above, below, change, steady")
        if (named == ["after_s"]) != (self.channel is None):
            raise ValueError("above, below, change and steady need a channel; after_s has none")
        if (named == ["steady"]) != (self.for_s is not None):
            raise ValueError("steady and for_s go together")
        if (self.channel == "point_depth") != (self.point_m is not None):
            raise ValueError("point_depth and point_m go together")
        if self.channel == "point_depth" and named == ["steady"]:
            raise ValueError("steady is not watched for point_depth")
        return self

    def row(self, sail_top: float) -> list[float]:
        """The event as the compiled loop reads it."""
        if self.after_s is not None:
            return [orders.AFTER, 0.0, self.after_s, 0.0, 0.0, 0.0, 0.0]
        channel = "z" if self.channel == "D0" else str(self.channel)
        unit = math.pi / 180.0 if channel in _ANGLES + _RATES else 1.0
        offset = sail_top if self.channel == "D0" else 0.0
        kind, value = next(
            (code, amount * unit - shift)
            for code, amount, shift in (
                (orders.ABOVE, self.above, offset),
                (orders.BELOW, self.below, offset),
                (orders.CHANGE, self.change, 0.0),
                (orders.STEADY, self.steady, 0.0),
            )
            if amount is not None
        )
        return [kind, _WATCHED.index(channel), value, self.for_s or 0.0, *(self.point_m or (0.0, 0.0, 0.0))]


class PlaneStep(Data):
    """One step of dV or dH; it ends with the first of its events.

    Attributes
    ----------
    value_deg : The command [deg].
    from_trim_deg : The command less that of the initial equilibrium [deg].
    hold : The autopilot.
    distance_m : Its target is moved down, or to starboard [m].
    angle_deg : Its target is moved in pitch, or heading [deg].
    yaw_rate_degps : The autopilot on r [deg/s].
    until : Events that end the step; the first counts.
    """

    value_deg: Angle | None = None
    from_trim_deg: Angle | None = None
    hold: bool = False
    distance_m: float = 0.0
    angle_deg: float = 0.0
    yaw_rate_degps: float | None = None
    until: list[Event] = Field(default_factory=list)

    @model_validator(mode="after")
    def _one_law(self) -> PlaneStep:
        named = [self.value_deg is not None, self.from_trim_deg is not None, self.hold, self.yaw_rate_degps is not None]
        if sum(named) != 1:
            raise ValueError("a step names one of value_deg, from_trim_deg, hold, yaw_rate_degps")
        if (self.distance_m or self.angle_deg) and not self.hold:
            raise ValueError("distance_m and angle_deg go with hold")
        return self

    def row(self, trim: float) -> tuple[int, float, list[float]]:
        """Mode, command [rad] and shifts of the targets."""
        if self.hold:
            return orders.PID, 0.0, [self.distance_m, math.radians(self.angle_deg)]
        if self.yaw_rate_degps is not None:
            return orders.YAW_RATE, 0.0, [0.0, math.radians(self.yaw_rate_degps)]
        if self.value_deg is not None:
            return orders.FIXED, math.radians(self.value_deg), [0.0, 0.0]
        return orders.FIXED, trim + math.radians(self.from_trim_deg or 0.0), [0.0, 0.0]


class PlaneCommand(Data):
    """Law of dV or dH. Gains in degrees and metres, positive when they steer back.

    Attributes
    ----------
    law : ``fixed``, ``pid`` (autopilot), ``zigzag`` or ``programme`` (steps).
    value_deg : Of the fixed law [deg].
    first_deg : Of a zigzag: the first command; its sign is the side [deg].
    check_deg : Of a zigzag: the angle that reverses it [deg].
    limit_deg : Largest command either way [deg].
    depth_from : What dV and the tanks take for the depth: that below the calm surface, or that of a
        pressure gauge at the body origin, which feels the waves.
    P_z, I_z, D_z : Proportional, integral and differential gain on depth [deg/m, deg/(m s), deg s/m].
    P_theta, I_theta, D_theta : Proportional, integral and differential gain on pitch [deg/deg, 1/s, s].
    P_y, I_y, D_y : Proportional, integral and differential gain on offset from the track.
    P_psi, I_psi, D_psi : Proportional, integral and differential gain on heading.
    P_r, I_r, D_r : Proportional, integral and differential gain on yaw rate.
    step : Steps of a programme.
    """

    law: Literal["fixed", "pid", "zigzag", "programme"]
    value_deg: Angle = 0.0
    first_deg: Angle = 0.0
    check_deg: Annotated[float, Field(ge=0.0, lt=180.0)] = 0.0
    limit_deg: Annotated[float, Field(gt=0.0, le=90.0)] = 30.0
    depth_from: Literal["calm_surface", "pressure"] = "calm_surface"
    P_z: PlaneGain = 0.0
    I_z: PlaneGain = 0.0
    D_z: PlaneGain = 0.0
    P_theta: PlaneGain = 0.0
    I_theta: PlaneGain = 0.0
    D_theta: PlaneGain = 0.0
    P_y: PlaneGain = 0.0
    I_y: PlaneGain = 0.0
    D_y: PlaneGain = 0.0
    P_psi: PlaneGain = 0.0
    I_psi: PlaneGain = 0.0
    D_psi: PlaneGain = 0.0
    P_r: PlaneGain = 0.0
    I_r: PlaneGain = 0.0
    D_r: PlaneGain = 0.0
    step: list[PlaneStep] = Field(default_factory=list)

    @model_validator(mode="after")
    def _zigzag_has_angles(self) -> PlaneCommand:
        if self.law == "zigzag" and not (self.first_deg and self.check_deg > 0.0):
            raise ValueError("a zigzag needs first_deg, not zero, and check_deg, positive")
        if self.law == "zigzag" and min(abs(self.first_deg), self.check_deg) < _LEAST_ZIGZAG:
            raise ValueError(f"first_deg and check_deg of {_LEAST_ZIGZAG:g} deg or more; radians?")
        return self

    @model_validator(mode="after")
    def _steps_go_with_a_programme(self) -> PlaneCommand:
        _programme_has_steps(self.law, self.step)
        return self

    def gains(self, distance: str, angle: str) -> list[float]:
        """P I D on a distance [rad/m] and on an angle [rad/rad]."""
        first = [math.radians(getattr(self, f"{k}_{distance}")) for k in "PID"]
        return first + [getattr(self, f"{k}_{angle}") for k in "PID"]


class SpeedStep(Data):
    """One step of the revolutions: a value, a multiple of the initial ones, or speed held.

    Attributes
    ----------
    value_rps : Revolutions [rps].
    times_initial : Revolutions as a multiple of the initial ones.
    hold : The speed is held.
    until : Events that end the step; the first counts.
    """

    value_rps: float | None = None
    times_initial: float | None = None
    hold: bool = False
    until: list[Event] = Field(default_factory=list)

    @model_validator(mode="after")
    def _one_law(self) -> SpeedStep:
        if [self.value_rps is not None, self.times_initial is not None, self.hold].count(True) != 1:
            raise ValueError("a step names one of value_rps, times_initial, hold")
        return self

    def row(self, initial: float) -> tuple[int, float, list[float]]:
        """Mode, revolutions [1/s], no shifts."""
        if self.hold:
            return orders.PID, 0.0, [0.0, 0.0]
        value = self.value_rps if self.value_rps is not None else initial * (self.times_initial or 0.0)
        return orders.FIXED, value, [0.0, 0.0]


class SpeedCommand(Data):
    """Law of the revolutions: initial value kept, PID on the speed ahead, or a programme.

    Attributes
    ----------
    law : ``fixed``: the initial revolutions. ``pid``: on the speed ahead. ``programme``: steps.
    P_u, I_u, D_u : Proportional, integral and differential gain on speed ahead.
    limits_rps : Lowest and highest revolutions [rps], instead of the vehicle's, which may be an autopilot's
        and not the shaft's.
    step : Steps of a programme.
    """

    law: Literal["fixed", "pid", "programme"]
    P_u: PlaneGain = 0.0
    I_u: PlaneGain = 0.0
    D_u: PlaneGain = 0.0
    limits_rps: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    step: list[SpeedStep] = Field(default_factory=list)

    @model_validator(mode="after")
    def _steps_go_with_a_programme(self) -> SpeedCommand:
        _programme_has_steps(self.law, self.step)
        return self


class TankCommand(Data):
    """Law of ballast [kg] or of the trim tank [m]: initial value kept, or PID, Eq. (11).

    Gains per metre of depth and per degree of pitch, positive when they steer back: too
    deep, ballast is pumped out; bow up, the centre of gravity moves forward.

    Attributes
    ----------
    law : ``fixed`` or ``pid``.
    value : Where it starts, or stays [kg or m].
    P_z, I_z, D_z : Proportional, integral and differential gain on depth [kg or m for each m].
    P_theta, I_theta, D_theta : Proportional, integral and differential gain on pitch [kg or m for each
        deg].
    """

    law: Literal["fixed", "pid"]
    value: float = 0.0
    P_z: Gain = 0.0
    I_z: Gain = 0.0
    D_z: Gain = 0.0
    P_theta: Gain = 0.0
    I_theta: Gain = 0.0
    D_theta: Gain = 0.0

    def gains(self) -> list[float]:
        """P I D on depth [per m] and on pitch [per rad]."""
        first = [getattr(self, f"{k}_z") for k in "PID"]
        return first + [math.degrees(getattr(self, f"{k}_theta")) for k in "PID"]


class Commands(Data):
    """Laws of the vertical and horizontal command, the revolutions and the tanks.

    Attributes
    ----------
    dV : Vertical command: pitch and depth; positive lifts the bow.
    dH : Horizontal command: heading; positive turns to starboard.
    n : Revolutions.
    ballast : Ballast [kg].
    trim_tank : Shift of the centre of gravity [m].
    """

    dV: PlaneCommand
    dH: PlaneCommand
    n: SpeedCommand
    ballast: TankCommand | None = None
    trim_tank: TankCommand | None = None

    @model_validator(mode="after")
    def _one_zigzag(self) -> Commands:
        if self.dV.law == self.dH.law == "zigzag":
            raise ValueError("one zigzag at a time: in dV or in dH")
        if any(s.yaw_rate_degps is not None for s in self.dV.step):
            raise ValueError("dV does not hold a yaw rate")
        return self


def _programme_has_steps(law: str, step: list[PlaneStep] | list[SpeedStep]) -> None:
    if (law == "programme") != bool(step):
        raise ValueError("law programme and step go together")
    if any(not s.until for s in step[:-1]):
        raise ValueError("every step but the last needs until, the events that end it")


def law_code(law: str) -> int:
    """The compiled loop's number of a law."""
    return _LAWS[law]


def compile_programme(
    command: Commands, stop: list[Event], trim: tuple[float, float], revolutions: float, sail_top: float
) -> Programme:
    """Steps and events of a case as the compiled loop reads them.

    Parameters
    ----------
    command, stop : Commands of the case, and the events that end its run.
    trim : dV and dH of the initial equilibrium [rad].
    revolutions : Initial n [1/s].
    sail_top : D0 = z + sail_top [m].
    """
    rows: list[list[tuple[int, float, list[float]]]] = [
        [s.row(t) for s in c.step] for c, t in zip((command.dV, command.dH), trim, strict=True)
    ]
    rows += [[s.row(revolutions) for s in command.n.step], [(orders.FIXED, 0.0, [0.0, 0.0])] if stop else []]
    ends = [s.until for c in (command.dV, command.dH, command.n) for s in c.step] + ([stop] if stop else [])
    flat = [r for axis in rows for r in axis]
    count = np.array([len(axis) for axis in rows], dtype=np.int64)
    return Programme(
        first=np.concatenate([[0], np.cumsum(count)[:-1]]),
        steps=count,
        mode=np.array([r[0] for r in flat], dtype=np.int64),
        value=np.array([r[1] for r in flat], dtype=float),
        shift=np.array([r[2] for r in flat], dtype=float).reshape(-1, 2),
        event_first=np.cumsum([0, *[len(e) for e in ends]], dtype=np.int64),
        events=np.array([e.row(sail_top) for group in ends for e in group], dtype=float).reshape(-1, 7),
    )
