"""What a case is held against: reference series, published values and tolerances, as a case file states them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from sim.files.schema import Data, FrameData, Positive


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
    frame : Axes of the series; of a trial those of the program, unless here or in ``trial``.
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

    @model_validator(mode="before")
    @classmethod
    def _trial_in_program_axes(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("trial") and "frame" not in data:
            return data | {"frame": {"x": "forward", "y": "starboard", "z": "down"}}
        return data

    @model_validator(mode="after")
    def _each_once(self) -> Reference:
        for key in ("compare", "channels", "from_start"):
            given = getattr(self, key)
            twice = sorted({name for name in given if given.count(name) > 1})
            if twice:
                raise ValueError(f"each once: {', '.join(twice)} stands twice in {key}")
        return self


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
