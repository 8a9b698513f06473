"""``trial.toml``: what a record of a maneuver does not say of itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from ident.captive.patterns import compiled
from ident.captive.source import Encoding
from sim.files.schema import Data, FrameData, checked
from sim.files.toml_files import read_toml

Positive = Annotated[float, Field(gt=0, le=1e9)]
# Of a model's thousandth and of its thousandfold: beyond, a scale is a slip.
Scale = Annotated[float, Field(ge=1e-3, le=1e3)]
# A quarter turn or twice the fastest submarine is no noise of an instrument.
AngleNoise = Annotated[float, Field(gt=0, le=90)]
SpeedNoise = Annotated[float, Field(gt=0, le=50)]
Axis = Literal["north", "east", "south", "west"]


class EarthAxes(Data):
    """Where the record's ``x`` and ``y`` point.

    Attributes
    ----------
    x : ``north``, ``east``, ``south`` or ``west``.
    y : The same, along the other line.
    """

    x: Axis
    y: Axis

    @model_validator(mode="after")
    def _two_directions(self) -> EarthAxes:
        along = {"north": 0, "south": 0, "east": 1, "west": 1}
        if along[self.x] == along[self.y]:
            raise ValueError("x and y point along the same line; one is north or south, the other east or west")
        return self


class Start(Data):
    """State at the execute: the ordered course, and where the boat was; found on the record when absent.

    Attributes
    ----------
    heading_deg : Ordered course [deg].
    pitch_deg : Pitch from which a vertical zigzag counts [deg].
    x_m, y_m : Position, along the record's axes [m].
    """

    heading_deg: Annotated[float, Field(ge=-720, le=720)] | None = None
    pitch_deg: Annotated[float, Field(ge=-90, le=90)] | None = None
    x_m: float | None = None
    y_m: float | None = None


class Noise(Data):
    """Standard errors of single samples, where they are better known than the record shows.

    Attributes
    ----------
    heading_deg : Of the heading [deg].
    pitch_deg : Of the pitch [deg].
    roll_deg : Of the heel [deg].
    yaw_rate_degps : Of the yaw rate [deg/s].
    position_m : Of each coordinate of the track [m].
    depth_m : Of the depth [m].
    speed_mps : Of the speed [m/s].
    """

    heading_deg: AngleNoise | None = None
    pitch_deg: AngleNoise | None = None
    roll_deg: AngleNoise | None = None
    yaw_rate_degps: AngleNoise | None = None
    position_m: Positive | None = None
    depth_m: Positive | None = None
    speed_mps: SpeedNoise | None = None


class Current(Data):
    """A steady current.

    Attributes
    ----------
    speed_mps : Its speed [m/s].
    to_deg : Direction it flows to, clockwise from north [deg].
    correct : Whether the track is made one through the water before it is measured.
    """

    speed_mps: Annotated[float, Field(ge=0, le=20)]
    to_deg: Annotated[float, Field(ge=-360, le=360)]
    correct: bool = True


class TrialFile(Data):
    """One recorded maneuver; every key is in ``docs/trials.md``.

    Attributes
    ----------
    name : Of the trial.
    maneuver : ``zigzag 20/20``, ``vertical zigzag 10/10``, ``turning_circle``, ...; found when absent.
    channels : Header -> channel, perhaps with unit: ``Gier = "psi [deg]"``; ``"-"`` leaves a column out.
    execute_s : Time of the first execute on the record's clock [s].
    initial : Course and place at the execute.
    axes : Where the record's x and y point.
    scale : Full-scale length over that of the model; Froude's law brings the record to full scale.
    frame : Directions of the body axes that heading, heel, pitch, rates and depth are counted in.
    wrap_deg : Turn after which a heading starts again, 180 or 360; found when absent.
    noise : Standard errors of samples.
    current : A steady current.
    length_m : Reference length of the boat at full scale, for the criteria [m].
    density_kgpm3 : Of the water; stated in the report, and in what is compared with the record.
    step_m : Ordered change of depth, down [m].
    released_s : Time from which the autopilot steers, after a push by the rudder, on the record's clock [s].
    surface_point_m : Point of the boat whose arrival at the surface ends a rise, from where the depth is measured:
        forward, starboard, down, full scale [m].
    loading : Loading condition, stated in the report.
    source : Where the record comes from.
    delimiter : Where it cannot be found out.
    decimal : Decimal mark, where it cannot be found out.
    thousands : Mark of digit groups, where it cannot be found out.
    encoding : Of the text, where no byte order mark says it.
    table : Worksheet, struct, group or zone of a file that holds several.
    names : Headers of the columns in order, of a file without a header: ``["t [s]", "psi [deg]", "-"]``.
    header_pattern : Regular expression that finds the header line.
    skip : Regular expression of lines that are no data.
    units_row : Whether the row below the header holds the units.
    """

    name: str = ""
    maneuver: str = ""
    channels: dict[str, str] = Field(default_factory=dict)
    execute_s: float | None = None
    initial: Start = Field(default_factory=Start)
    axes: EarthAxes | None = None
    scale: Scale = 1.0
    frame: FrameData | None = None
    wrap_deg: Literal[180, 360] | None = None
    noise: Noise = Field(default_factory=Noise)
    current: Current | None = None
    length_m: Annotated[float, Field(gt=0.0, le=1e4)] | None = None
    density_kgpm3: Positive | None = None
    step_m: Annotated[float, Field(ge=-1e5, le=1e5)] | None = None
    released_s: float | None = None
    surface_point_m: tuple[float, float, float] | None = None
    loading: str = ""
    source: str = ""
    delimiter: Literal["", ",", ";", "\t", " "] = ""
    decimal: Literal["", ".", ","] = ""
    thousands: Literal["", ".", ",", "'", " "] = ""
    encoding: Encoding = "utf-8"
    table: Annotated[str, Field(max_length=300)] = ""
    names: list[str] = Field(default_factory=list)
    header_pattern: str = ""
    skip: str = ""
    units_row: bool = False

    @model_validator(mode="after")
    def _one_header(self) -> TrialFile:
        if self.names and (self.header_pattern or self.units_row):
            raise ValueError("one of names and header_pattern or units_row: names are those of a file without a header")
        return self

    @field_validator("header_pattern", "skip")
    @classmethod
    def _pattern_compiles(cls, text: str) -> str:
        compiled(text)
        return text


def load_spec(path: Path | None) -> TrialFile:
    """The statements on a record; without a file none.

    Raises
    ------
    InputError
        For a missing file, an unknown key or a value out of range.
    """
    if path is None:
        return TrialFile()
    data, where = read_toml(str(path), "cases")
    return checked(TrialFile, data, where)
