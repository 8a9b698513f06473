"""``trial.toml``: what a record of a maneuver does not say of itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from ident.captive.patterns import compiled
from ident.captive.source import Encoding
from sim.boat.vehicle import read_toml
from sim.files.schema import Data, FrameData, checked

Positive = Annotated[float, Field(gt=0, le=1e9)]
Axis = Literal["north", "east", "south", "west"]


class EarthAxes(Data):
    """Where the record's ``x`` and ``y`` point."""

    x: Axis
    y: Axis

    @model_validator(mode="after")
    def _two_directions(self) -> EarthAxes:
        along = {"north": 0, "south": 0, "east": 1, "west": 1}
        if along[self.x] == along[self.y]:
            raise ValueError("x and y point along the same line; one is north or south, the other east or west")
        return self


class Start(Data):
    """State at the execute: the ordered course, and where the boat was; found on the record when absent."""

    heading_deg: Annotated[float, Field(ge=-720, le=720)] | None = None
    x_m: float | None = None
    y_m: float | None = None


class Noise(Data):
    """Standard errors of single samples, where they are better known than the record shows."""

    heading_deg: Positive | None = None
    pitch_deg: Positive | None = None
    roll_deg: Positive | None = None
    yaw_rate_degps: Positive | None = None
    position_m: Positive | None = None
    depth_m: Positive | None = None
    speed_mps: Positive | None = None


class Current(Data):
    """A steady current: speed, and the direction it flows to, clockwise from north.

    ``correct``: the track is made one through the water before it is measured.
    """

    speed_mps: Annotated[float, Field(ge=0, le=20)]
    to_deg: Annotated[float, Field(ge=-360, le=360)]
    correct: bool = True


class TrialFile(Data):
    """One recorded maneuver; every key is in ``docs/trials.md``.

    Attributes
    ----------
    maneuver : ``zigzag 20/20``, ``vertical zigzag 10/10``, ``turning_circle``, ...
    channels : Header -> channel, perhaps with unit: ``Gier = "psi [deg]"``; ``"-"`` leaves a column out.
    execute_s : Time of the first execute on the record's clock.
    scale : Full-scale length over that of the model; Froude's law brings the record to full scale.
    length_m : Reference length of the boat at full scale, for the criteria.
    step_m : Ordered change of depth, down.
    density_kgpm3, loading : Stated in the report, and in what is compared with the record.
    wrap_deg : Turn after which a heading starts again; found when absent.
    """

    name: str = ""
    maneuver: str = ""
    channels: dict[str, str] = Field(default_factory=dict)
    execute_s: float | None = None
    initial: Start = Field(default_factory=Start)
    axes: EarthAxes | None = None
    scale: Positive = 1.0
    frame: FrameData | None = None
    wrap_deg: Literal[180, 360] | None = None
    noise: Noise = Field(default_factory=Noise)
    current: Current | None = None
    length_m: Positive | None = None
    density_kgpm3: Positive | None = None
    step_m: float | None = None
    loading: str = ""
    source: str = ""
    delimiter: Literal["", ",", ";", "\t", " "] = ""
    decimal: Literal["", ".", ","] = ""
    encoding: Encoding = "utf-8"
    header_pattern: str = ""
    skip: str = ""
    units_row: bool = False

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
