"""A maneuver case is data: initial state, environment, commands, references, tolerances."""

from __future__ import annotations

from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sim.boat.vehicle import bundled, read_toml
from sim.files.errors import InputError
from sim.files.frames import Frame
from sim.files.record import Record, Written
from sim.files.schema import Data, FrameData, Name, checked
from sim.flight.commands import Commands, Event
from sim.flight.reference_table import read_table

Array = NDArray[np.float64]
Positive = Annotated[float, Field(gt=0)]

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


class CurrentData(Data):
    """A steady current, the same everywhere.

    Attributes
    ----------
    speed_mps : Of the water over ground [m/s].
    direction_deg : Where it flows to, clockwise from north [deg]; a case starts along north.
    """

    speed_mps: Annotated[float, Field(ge=0, le=10)]
    direction_deg: float


class LayerData(Data):
    """Density of the water at a depth; linear between two depths, held beyond them.

    Attributes
    ----------
    depth_m : Of the body origin [m].
    density_kgpm3 : There [kg/m^3].
    """

    depth_m: Annotated[float, Field(ge=0)]
    density_kgpm3: Positive


class EnvironmentData(Data):
    """Water density and gravity.

    Attributes
    ----------
    density_kgpm3 : Of the water [kg/m^3]; where there are layers, that of the tables' loads and of the hull's stated
        displacement.
    gravity_mps2 : Gravity [m/s^2].
    current : Of the water; velocities of the boat are then through the water, its place over ground.
    layer : Density over depth: buoyancy and loads follow it, the added mass does not.
    hull_compressibility_perm : Share of its volume that the hull loses a metre of depth [1/m].
    free_surface : The hull may come out of the water and loses buoyancy and added mass there; always so in
        waves, which need the vehicle's geometry alike.
    """

    density_kgpm3: Positive
    gravity_mps2: Positive
    free_surface: bool = False
    current: CurrentData | None = None
    layer: Annotated[list[LayerData], Field(max_length=8)] = Field(default_factory=list)
    hull_compressibility_perm: Annotated[float, Field(ge=0, le=1e-3)] = 0.0

    @model_validator(mode="after")
    def _deep_where_it_varies(self) -> EnvironmentData:
        depths = [one.depth_m for one in self.layer]
        if any(b <= a for a, b in pairwise(depths)):
            raise ValueError("layers stand from shallow to deep, each at a depth of its own")
        if self.free_surface and self.varies:
            raise ValueError("current, layer and hull_compressibility_perm are for deep water, without free_surface")
        return self

    @property
    def varies(self) -> bool:
        """Whether there is a current, or anything that changes over depth."""
        return bool(self.current or self.layer or self.hull_compressibility_perm)


class WavesData(Data):
    """Waves of a case.

    Attributes
    ----------
    kind : ``regular``, or a spectrum.
    direction_deg : Where the waves travel to, clockwise from north [deg]; a case starts along north, so 180
        is a head sea.
    sea_state : Of ``sim/data/sea_states.csv``; instead of a spectrum's height and period.
    height_m : Of a regular wave from trough to crest, or significant [m].
    length_m : Of a regular wave [m].
    period_s : Of a regular wave, or the spectrum's peak [s].
    phase_deg : Of a regular wave: zero puts a crest at the earth origin at the start [deg].
    components : Number of regular waves that make up a spectrum.
    seed : Of their phases.
    second_order : With mean drift forces and suction.
    spreading : Exponent s of cos^2s of half the angle; zero is long-crested.
    gamma : Peakedness of a JONSWAP spectrum.
    """

    kind: Literal["regular", "bretschneider", "jonswap"]
    direction_deg: float
    sea_state: int | None = None
    height_m: Annotated[float, Field(ge=0)] | None = None
    length_m: Positive | None = None
    period_s: Positive | None = None
    phase_deg: float = 0.0
    components: Annotated[int, Field(ge=1, le=5000)] = 200
    seed: Annotated[int, Field(ge=0)] = 1
    second_order: bool = True
    spreading: Annotated[float, Field(ge=0)] = 0.0
    gamma: Annotated[float, Field(ge=1)] = 3.3

    @model_validator(mode="after")
    def _one_size(self) -> WavesData:
        if self.kind == "regular":
            if self.sea_state is not None:
                raise ValueError("a regular wave has height_m, and length_m or period_s; no sea_state")
            if self.height_m is None or (self.length_m is None) == (self.period_s is None):
                raise ValueError("a regular wave needs height_m, and one of length_m and period_s")
            return self
        if self.length_m is not None:
            raise ValueError("a spectrum has a peak period_s, no length_m")
        if self.phase_deg:
            raise ValueError("phase_deg is for a regular wave; the phases of a spectrum come from its seed")
        given = (self.height_m is not None, self.period_s is not None)
        if given != ((False, False) if self.sea_state is not None else (True, True)):
            raise ValueError("a spectrum needs sea_state, or height_m and period_s")
        return self


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
    heel_deg: float = 0.0
    pitch_deg: float = 0.0
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


class Start(Data):
    """How the record of one source starts, where it is not as the case starts.

    Attributes
    ----------
    source : Where this comes from.
    speed_mps : U [m/s].
    depth_m : D0 [m].
    heel_deg : phi [deg].
    pitch_deg : theta [deg].
    revolutions_rps : n [rps].
    """

    source: str
    speed_mps: Annotated[float, Field(gt=0)] | None = None
    depth_m: float | None = None
    heel_deg: float | None = None
    pitch_deg: float | None = None
    revolutions_rps: float | None = None


class Reference(Data):
    """Where the reference series are and what to compare with them.

    Attributes
    ----------
    file : CSV of the series (source, channel, t or s, value, unit, sigma), beside the case; without it
        users bring their own.
    trial : Statements on ``file`` (``docs/trials.md``), which is then a recorded trial.
    controls : ``recorded`` flies the trial's rudder or planes and revolutions instead of the command laws.
    published_model : Source in it that is another model, and so no reference.
    compare : Sources that the flight is held against.
    channels : Channels that are compared.
    abscissa : ``t``: over time [s]. ``s``: over the path length over ground [m].
    frame : Axes of the series.
    initial : Source -> its own start; it is compared with a run from there.
    from_start : Channels that are changes since the start, so that every series begins at zero whatever
        offset it was published with.
    """

    file: str | None = None
    trial: str | None = None
    controls: Literal["command", "recorded"] = "command"
    published_model: str | None = None
    compare: list[str] = Field(default_factory=list)
    channels: list[str] = Field(default_factory=list)
    abscissa: Literal["t", "s"] = "t"
    frame: FrameData
    initial: dict[str, Start] = Field(default_factory=dict)
    from_start: list[str] = Field(default_factory=list)


class Sweep(Data):
    """Speeds and depths at which self-propulsion is solved, each with each.

    Attributes
    ----------
    speed_mps : U [m/s].
    depth_m : D0 [m].
    """

    speed_mps: Annotated[list[Positive], Field(min_length=1)]
    depth_m: Annotated[list[float], Field(min_length=1)]


class Published(Data):
    """A published value of one metric, and the relative deviation that is accepted.

    Attributes
    ----------
    metric : Name of the metric.
    source : Who published it.
    value : The value, in the unit.
    unit : Its unit.
    note : Where it is printed.
    sigma : Standard error of reading it, in its unit.
    tolerance : Accepted deviation, relative.
    """

    metric: str
    source: str
    value: float
    unit: str
    note: str
    sigma: Annotated[float, Field(ge=0)] | None = None
    tolerance: Positive | None = None


class Tolerance(Data):
    """Largest accepted RMSE of one channel against one source.

    Attributes
    ----------
    source : Of the reference.
    channel : Of the reference.
    rmse : Largest accepted root mean square error, in the unit.
    unit : Unit of the channel.
    """

    source: str
    channel: str
    rmse: Positive
    unit: str


class Case(Data):
    """A maneuver case file. ``maneuver`` names the metrics; zigzags and roll decays need none.

    Attributes
    ----------
    name : Of the case.
    title : For people.
    vehicle : Bundled vehicle, or a vehicle file beside the case.
    source : Where the case comes from.
    maneuver : What is measured on it; zigzags and roll decays need none.
    sail_planes : Whether the sail planes follow dV.
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
    def _no_waves_on_a_current(self) -> Case:
        if self.waves and self.environment.varies:
            raise ValueError("waves on a current or over layers are not modelled; one of them in a case")
        return self

    @model_validator(mode="after")
    def _changes_depth_by_something(self) -> Case:
        steps = self.command.dV.step
        if self.maneuver == "depth_change" and not (steps and steps[-1].distance_m):
            raise ValueError("a depth_change whose last step of dV has a distance_m that is not zero")
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


class Series:
    """Reference series by source and channel, in the program frame.

    ``self[source][channel]`` is a ``Record`` over time [s] or path length [m]; its ``sigma`` is the
    standard error of reading the value, where stated.
    """

    def __init__(self, data: dict[str, dict[str, Record]], abscissa: Literal["t", "s"] = "t") -> None:
        self.data = data
        self.abscissa = abscissa
        self.smooth: dict[str, dict[str, Record]] = {}

    def measured_on(self, source: str) -> dict[str, Record]:
        """What metrics are measured on: smooth paths where the series of a source are noisy."""
        return self.smooth.get(source, self[source])

    def __getitem__(self, source: str) -> dict[str, Record]:
        return self.data.get(source, {})


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


def _from_start(series: Series, channels: list[str]) -> Series:
    """The series with the listed channels beginning at zero."""
    for own in series.data.values():
        for channel in channels:
            if channel in own:
                own[channel] = own[channel].less(own[channel].shown.value[0])
    return series


def read_series(path: Path, abscissa: Literal["t", "s"], frame: Frame) -> Series:
    """Read reference series and turn them to the program frame.

    Parameters
    ----------
    path : As ``sim.flight.reference_table.read_table``.
    abscissa : Column over which the series are given.
    frame : Axis directions of the file.

    Raises
    ------
    InputError
        As ``read_table``; for values of the abscissa that do not increase, or two units in one series.
    """
    table = read_table(path, abscissa)
    data: dict[str, dict[str, Record]] = {}
    for (source, channel), rows in table.groupby(["source", "channel"], sort=False):
        along = rows[abscissa].to_numpy(dtype=float)
        if np.any(np.diff(along) <= 0.0):
            raise InputError(f"{path}, {source} {channel}", f"column {abscissa} not increasing", "increasing values")
        units = rows["unit"].unique()
        if len(units) > 1:
            raise InputError(f"{path}, {source} {channel}", f"units {', '.join(units)}", "one unit a series")
        value = rows["value"].to_numpy(dtype=float) * frame.sign(str(channel))
        sigma = rows["sigma"].to_numpy(dtype=float) if "sigma" in rows else None
        one = Record.read(str(channel), along, Written(value, str(units[0]), sigma))
        data.setdefault(str(source), {})[str(channel)] = one
    return Series(data, abscissa)


def load_reference(case: Case, where: str) -> Series:
    """Reference series of a case, turned to the program frame.

    Parameters
    ----------
    case : With a reference or without.
    where : As returned by ``load_case``; its folder holds the reference file.

    Raises
    ------
    InputError
        For a missing file or column, a non-number, or an undeclared frame.
    """
    if case.reference is None:
        return Series({})
    frame = case.reference.frame.declared(f"{where}, key reference.frame")
    if case.reference.file is None:
        return Series({}, case.reference.abscissa)
    if where in bundled("cases"):
        path = Path(str(files("sim") / "cases" / case.reference.file))
    else:
        path = Path(where).parent / case.reference.file
    if not path.is_file():
        raise InputError(str(path), "missing", f"the reference file of case {case.name}")
    return _from_start(read_series(path, case.reference.abscissa, frame), case.reference.from_start)
