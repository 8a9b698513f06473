"""A maneuver case is data: initial state, environment, commands, references, tolerances."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from sim.files.schema import Data, Name, Positive, checked
from sim.files.toml_files import read_toml
from sim.flight.commands import Commands, Event
from sim.flight.environment import EnvironmentData, WavesData
from sim.flight.reference import Published, Reference, Start, Tolerance

Maneuver = Literal[
    "turning_circle",
    "direct_spiral",
    "reverse_spiral",
    "pull_out",
    "stopping",
    "meander",
    "depth_change",
    "course_keeping",
    "rise",
    "self_propulsion",
    "regular_waves",
    "irregular_waves",
]

# A record of more steps than this does not fit a laptop's memory.
_MOST_STEPS = 1e7
# Of depth, in a maneuver that is one [m].
_LEAST_CHANGE = 1e-3


class Initial(Data):
    """Initial state: solved self-propulsion, or the given speed as it is.

    Attributes
    ----------
    state : ``self_propulsion``: solved. ``as_given``: the speed as it is.
    speed_mps : U through the water [m/s].
    depth_m : D0, depth of the sail top [m].
    heel_deg : phi [deg].
    pitch_deg : theta [deg].
    revolutions_rps : n of a state as given [rps].
    trim : What keeps a self-propelled boat level: ``planes`` and the pitch that they need; planes and
        ``ballast`` at no pitch; or ballast and trim tank (``tanks``) at no pitch and no planes.
    upright : Weight has been shifted across a self-propelled boat against the propeller's torque, as is
        done before a test.
    """

    state: Literal["self_propulsion", "as_given"]
    speed_mps: Annotated[float, Field(ge=0)]
    depth_m: float
    heel_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    pitch_deg: Annotated[float, Field(ge=-90, le=90)] = 0.0
    revolutions_rps: float | None = None
    trim: Literal["planes", "ballast", "tanks"] = "planes"
    upright: bool = False

    @model_validator(mode="after")
    def _propelled_boats_move(self) -> Initial:
        if self.state == "self_propulsion" and self.speed_mps == 0.0:
            raise ValueError("self_propulsion needs a speed; use as_given for a boat at rest")
        return self


class Run(Data):
    """Duration, control sample (and integration step), time between records; events that end it.

    Attributes
    ----------
    duration_s : Of the run [s].
    step_s : Control sample and integration step [s].
    record_s : Time between two records [s].
    stop : Events that end the run before.
    """

    duration_s: Annotated[float, Field(gt=0, le=1e5)]
    step_s: Annotated[float, Field(gt=0, le=10.0)]
    record_s: Positive
    stop: list[Event] = Field(default_factory=list)

    @model_validator(mode="after")
    def _a_run_of_a_size(self) -> Run:
        if self.duration_s / self.step_s > _MOST_STEPS:
            raise ValueError(f"more than {_MOST_STEPS:g} steps")
        if self.record_s < self.step_s:
            raise ValueError("record_s is shorter than step_s")
        if self.record_s > self.duration_s:
            raise ValueError("record_s is longer than duration_s: the record would hold the start alone")
        return self


class Sweep(Data):
    """Speeds and depths at which self-propulsion is solved, each with each.

    Attributes
    ----------
    speed_mps : U [m/s].
    depth_m : D0 [m].
    """

    speed_mps: Annotated[list[Positive], Field(min_length=1)]
    depth_m: Annotated[list[float], Field(min_length=1)]


class Case(Data):
    """A maneuver case file. ``maneuver`` names the metrics; zigzags and roll decays need none.

    Attributes
    ----------
    name : Of the case.
    title : For people.
    vehicle : Bundled vehicle, or a vehicle file beside the case.
    source : Where the case comes from.
    maneuver : What is measured on it; zigzags and roll decays need none.
    sail_planes : Whether planes on the sail or at the bow (those not aft of the body origin) follow dV and dH.
    environment : Water and gravity.
    waves : Waves; calm without.
    initial : The state at the start.
    run : Duration, step and record.
    command : Laws of planes, revolutions and tanks.
    sweep : Speeds and depths at which self-propulsion is solved beside.
    reference : What the flight is held against.
    published : Published values of metrics.
    tolerance : Largest accepted errors.
    """

    name: Name
    title: str
    vehicle: str
    source: str
    maneuver: Maneuver | None = None
    sail_planes: bool = True
    environment: EnvironmentData
    waves: WavesData | None = None
    initial: Initial
    run: Run
    command: Commands
    sweep: Sweep | None = None
    reference: Reference | None = None
    published: list[Published] = Field(default_factory=list)
    tolerance: list[Tolerance] = Field(default_factory=list)

    @model_validator(mode="after")
    def _no_waves_over_layers(self) -> Case:
        if self.waves and self.environment.varies_over_depth:
            raise ValueError("waves over layers or with a pressed hull are not modelled; one of them in a case")
        return self

    @model_validator(mode="after")
    def _changes_depth_by_something(self) -> Case:
        steps = self.command.dV.step
        if self.maneuver == "depth_change" and not (steps and abs(steps[-1].distance_m or 0.0) > _LEAST_CHANGE):
            raise ValueError(
                "a depth_change whose last step of dV has a distance_m that is not zero: a millimetre at least"
            )
        return self

    @model_validator(mode="after")
    def _starts_below_the_surface(self) -> Case:
        starts: list[Initial | Start] = [self.initial, *(self.reference.initial.values() if self.reference else [])]
        depths = [s.depth_m for s in starts if s.depth_m is not None] + (self.sweep.depth_m if self.sweep else [])
        if min(depths) < 0.0 and not (self.environment.free_surface or self.waves):
            text = f"depth_m {min(depths):g} has the sail top above the surface; D0 is positive down, 0 or more"
            raise ValueError(f"{text}, or free_surface = true in [environment]")
        return self

    def started_as(self, source: str) -> Case | None:
        """This case from the start of one source's record; None when it is the case's own."""
        start = self.reference.initial.get(source) if self.reference else None
        if start is None:
            return None
        moved = start.model_dump(exclude_none=True, exclude={"source"})
        return self.model_copy(update={"initial": self.initial.model_copy(update=moved)})


def load_case(name: str | Path) -> tuple[Case, str]:
    """A bundled case or a path to one.

    Returns
    -------
    The case and the folder-relative name for messages.

    Raises
    ------
    InputError
        For a missing file, a missing or unknown key, or a value out of range.
    """
    data, where = read_toml(name, "cases")
    return checked(Case, data, where), where
