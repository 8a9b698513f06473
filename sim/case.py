"""A maneuver case is data: initial state, environment, commands, references, tolerances."""

from __future__ import annotations

import math
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sim.errors import InputError
from sim.schema import Data, FrameData, checked
from sim.vehicle import bundled, read_toml

Array = NDArray[np.float64]
Positive = Annotated[float, Field(gt=0)]

# A record of more steps than this does not fit a laptop's memory.
_MOST_STEPS = 1e7


class EnvironmentData(Data):
    """Water density and gravity."""

    density_kgpm3: Positive
    gravity_mps2: Positive


class Initial(Data):
    """Initial state: solved self-propulsion, or the given speed as it is."""

    state: Literal["self_propulsion", "as_given"]
    speed_mps: Annotated[float, Field(ge=0)]
    depth_m: float
    heel_deg: float = 0.0
    pitch_deg: float = 0.0
    revolutions_rps: float | None = None

    @model_validator(mode="after")
    def _propelled_boats_move(self) -> Initial:
        if self.state == "self_propulsion" and self.speed_mps == 0.0:
            raise ValueError("self_propulsion needs a speed; use as_given for a boat at rest")
        return self


class Run(Data):
    """Duration, control sample (and integration step), and time between records."""

    duration_s: Annotated[float, Field(gt=0, le=1e5)]
    step_s: Annotated[float, Field(gt=0, le=10.0)]
    record_s: Positive

    @model_validator(mode="after")
    def _a_run_of_a_size(self) -> Run:
        if self.duration_s / self.step_s > _MOST_STEPS:
            raise ValueError(f"more than {_MOST_STEPS:g} steps")
        if self.record_s < self.step_s:
            raise ValueError("record_s is shorter than step_s")
        return self


class PlaneCommand(Data):
    """Law of dV or dH. Gains in degrees and metres, positive when they steer back."""

    law: Literal["fixed", "pid", "zigzag"]
    value_deg: float = 0.0
    first_deg: float = 0.0
    check_deg: float = 0.0
    limit_deg: Positive = 30.0
    P_z: float = 0.0
    I_z: float = 0.0
    D_z: float = 0.0
    P_theta: float = 0.0
    I_theta: float = 0.0
    D_theta: float = 0.0
    P_y: float = 0.0
    I_y: float = 0.0
    D_y: float = 0.0
    P_psi: float = 0.0
    I_psi: float = 0.0
    D_psi: float = 0.0

    @model_validator(mode="after")
    def _zigzag_has_angles(self) -> PlaneCommand:
        if self.law == "zigzag" and not (self.first_deg and self.check_deg > 0.0):
            raise ValueError("a zigzag needs first_deg, not zero, and check_deg, positive")
        return self

    def gains(self, distance: str, angle: str) -> list[float]:
        """P I D on a distance [rad/m] and on an angle [rad/rad]."""
        first = [math.radians(getattr(self, f"{k}_{distance}")) for k in "PID"]
        return first + [getattr(self, f"{k}_{angle}") for k in "PID"]


class SpeedCommand(Data):
    """Law of the revolutions: fixed at the initial value, or PID on the speed."""

    law: Literal["fixed", "pid"]
    P_u: float = 0.0
    I_u: float = 0.0
    D_u: float = 0.0


class Commands(Data):
    """Laws of the vertical and horizontal command and of the revolutions."""

    dV: PlaneCommand
    dH: PlaneCommand
    n: SpeedCommand

    @model_validator(mode="after")
    def _one_zigzag(self) -> Commands:
        if self.dV.law == self.dH.law == "zigzag":
            raise ValueError("one zigzag at a time: in dV or in dH")
        return self


class Reference(Data):
    """Where the reference series are and what to compare with them."""

    file: str
    published_model: str | None = None
    compare: list[str]
    channels: list[str]
    frame: FrameData


class Tolerance(Data):
    """Largest accepted RMSE of one channel against one source."""

    source: str
    channel: str
    rmse: Positive
    unit: str


class Case(Data):
    """A maneuver case file."""

    name: str
    title: str
    vehicle: str
    source: str
    sail_planes: bool = True
    environment: EnvironmentData
    initial: Initial
    run: Run
    command: Commands
    reference: Reference | None = None
    tolerance: list[Tolerance] = Field(default_factory=list)


class Series:
    """Reference series by source and channel, in the program frame.

    ``self[source][channel]`` is (time [s], value, unit).
    """

    def __init__(self, data: dict[str, dict[str, tuple[Array, Array, str]]]) -> None:
        self.data = data

    def __getitem__(self, source: str) -> dict[str, tuple[Array, Array, str]]:
        return self.data.get(source, {})


def in_radians(value: Array, unit: str) -> Array:
    """Values of a reference series in the simulation's unit: degrees become radians."""
    return np.radians(value) if unit.startswith("deg") else value


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


def load_reference(case: Case, where: str) -> Series:
    """Reference series of a case, turned to the program frame.

    Parameters
    ----------
    case : With a reference.
    where : As returned by ``load_case``; its folder holds the reference file.

    Raises
    ------
    InputError
        For a missing file or column, a non-number, or an undeclared frame.
    """
    import pandas as pd

    if case.reference is None:
        return Series({})
    if where in bundled("cases"):
        path = Path(str(files("sim") / "cases" / case.reference.file))
    else:
        path = Path(where).parent / case.reference.file
    if not path.is_file():
        raise InputError(str(path), "missing", f"the reference file of case {case.name}")
    frame = case.reference.frame.declared(f"{where}, key reference.frame")
    table = pd.read_csv(path, dtype={"source": str, "channel": str, "unit": str})
    for column in ("source", "channel", "t", "value", "unit"):
        if column not in table:
            raise InputError(str(path), f"column {column} missing", "source, channel, t, value, unit")
    for column in ("t", "value"):
        numbers = pd.to_numeric(table[column], errors="coerce").astype(float)
        bad = np.flatnonzero(~np.isfinite(numbers))
        if bad.size:
            place = f"{path}, row {bad[0] + 2}, column {column}"
            raise InputError(place, repr(table[column].iloc[bad[0]]), "a finite number")
        table[column] = numbers
    data: dict[str, dict[str, tuple[Array, Array, str]]] = {}
    for (source, channel), rows in table.groupby(["source", "channel"], sort=False):
        time = rows["t"].to_numpy(dtype=float)
        value = rows["value"].to_numpy(dtype=float) * frame.sign(str(channel))
        data.setdefault(str(source), {})[str(channel)] = (time, value, str(rows["unit"].iloc[0]))
    return Series(data)
