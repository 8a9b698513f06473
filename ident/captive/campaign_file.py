"""The schema of ``campaign.toml``."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from ident.captive.source import Source, Vector
from sim.boat.catalogue import OUTPUTS
from sim.files import inputs
from sim.files.errors import InputError
from sim.files.frames import Frame, FrameError
from sim.files.schema import Data, FrameData, checked


class CampaignFrame(FrameData):
    """Axis directions of the loads and rates, sense of rotation, sign convention of the angles.

    Attributes
    ----------
    angles : ``flight``: beta = asin(v/U), positive with starboard windward. ``ittc``: the
        ship's drift angle, positive with port windward.
    axes : What the loads are along. ``body``: axes fixed in the body. ``flow``: x along the body's
        own velocity, so that minus x is drag; y and z turned with it (drag, side force and lift). ``tank``:
        axes of the tank or mesh, x along the towing direction, in which the body stands at its
        angles, or swings in an oscillation of yaw, pitch or roll. Directions are those of a body at zero angles.
    moment_axes : What the moments are along, where it is not what the forces are: a solver gives drag and lift
        along the flow, and moments along its mesh.
    rotations : Sense of moments and rates about their axis, ``right-hand`` or ``left-hand``
        (N = x Y - y X in left-handed axes). A left-handed set has to state it.
    """

    angles: Literal["flight", "ittc"]
    axes: Literal["body", "flow", "tank"] = "body"
    moment_axes: Literal["", "body", "flow", "tank"] = ""
    rotations: Literal["", "right-hand", "left-hand"] = ""

    @property
    def frame(self) -> Frame:
        """The declared frame. Raises ``FrameError`` when it is not one."""
        return Frame(self.x, self.y, self.z, self.rotations)

    def declared(self, where: str) -> Frame:
        """The declared frame. Raises ``InputError`` naming ``where`` when it is not one."""
        try:
            return self.frame
        except FrameError as error:
            text = 'right-handed axes; or left-handed ones with rotations = "left-hand" (N = x Y - y X) or "right-hand"'
            raise InputError(where, str(error), text) from error


class MomentPoint(Data):
    """Point the moments are about, from the vehicle's origin, in the campaign frame.

    Attributes
    ----------
    x_m : Along x [m].
    y_m : Along y [m].
    z_m : Along z [m].
    about : What the point is, in words.
    """

    x_m: float
    y_m: float
    z_m: float
    about: str


class MotionPoint(MomentPoint):
    """Point whose speed, drift and incidence the runs state, from the vehicle's origin, in the campaign frame.

    A boat that turns has another velocity at each of its points: v = v_P - omega x r_P at the origin.

    Attributes
    ----------
    x_m : Along x [m].
    y_m : Along y [m].
    z_m : Along z [m].
    about : What the point is, in words: the pivot of the arm or of the planar motion mechanism.
    """


class Scale(Data):
    """Linear scale ratio (ship over model); length, and draught where one is needed, of the tested body.

    Attributes
    ----------
    ratio : Ship over model.
    length_m : Of the tested body [m].
    draught_m : Of the tested body, where a norm needs it [m].
    """

    ratio: Annotated[float, Field(gt=0, le=1e4)]
    length_m: Annotated[float, Field(gt=0, le=1e4)]
    draught_m: Annotated[float, Field(gt=0, le=1e4)] | None = None


class Fluid(Data):
    """Water density of the tests.

    Attributes
    ----------
    density_kgpm3 : Of the water [kg/m^3].
    source : Where it comes from.
    """

    density_kgpm3: Annotated[float, Field(gt=0, le=1e5)]
    source: str


class Inertia(Data):
    """Whether the loads contain the model's own inertia, and then what it is.

    Attributes
    ----------
    model_inertia_in_loads : When true, the measured load is water minus m a, and m a is
        added back: mass, centre of gravity and tensor have to be given.
    mass_kg : Mass of everything that the balance carries.
    centre_of_gravity_m : From the vehicle's origin, campaign frame, model scale.
    tensor_kgm2 : Ixx, Iyy, Izz, and products Ixy, Iyz, Izx (integral of xy dm) where there
        are any, about the centre of gravity.
    parts : Parts whose loads contain it.
    source : Where the numbers come from.
    """

    model_inertia_in_loads: bool
    mass_kg: Annotated[float, Field(gt=0, le=1e10)] | None = None
    centre_of_gravity_m: Vector | None = None
    tensor_kgm2: Annotated[list[float], Field(min_length=3, max_length=6)] | None = None
    parts: list[str] = Field(default_factory=lambda: ["hull"])
    source: str = ""

    @model_validator(mode="after")
    def _all_or_nothing(self) -> Inertia:
        given = [k for k in ("mass_kg", "centre_of_gravity_m", "tensor_kgm2") if getattr(self, k) is not None]
        if self.model_inertia_in_loads and len(given) < 3:
            raise ValueError("with model_inertia_in_loads = true: mass_kg, centre_of_gravity_m and tensor_kgm2")
        if not self.model_inertia_in_loads and given:
            raise ValueError(f"no {given[0]}: model_inertia_in_loads is false, so nothing is taken off")
        if self.tensor_kgm2 is not None and len(self.tensor_kgm2) not in (3, 6):
            raise ValueError("three moments of inertia, or three and three products")
        return self


class Hydrostatics(Data):
    """Hydrostatic load that the loads contain, as two-phase CFD and balances without a zero reading have it.

    Attributes
    ----------
    force_n : Upward force [N] of the tested body: its buoyancy, less what of its weight is in the loads.
    centre_m : Where it acts, from the vehicle's origin, campaign frame, model scale.
    attitude : ``level``: the body's z axis stays along gravity, the flow comes at an angle. ``pitched``:
        the body is pitched by alpha, and gravity turns in its axes.
    parts : Parts whose loads contain it.
    source : Where the numbers come from.
    """

    force_n: Annotated[float, Field(ge=-1e12, le=1e12)]
    centre_m: Vector
    attitude: Literal["level", "pitched"]
    parts: list[str] = Field(default_factory=lambda: ["hull"])
    source: Annotated[str, Field(min_length=1, max_length=500)]


class Tare(Data):
    """Loads that are not the water's on the model: zero readings, struts, wind, wires.

    Attributes
    ----------
    what : Strut, zero reading, ...
    loads : Component -> load with its unit, subtracted: ``X = "1.2 N"``.
    per_speed_squared : Component -> load [N or N m] for every (m/s)^2 of U^2, subtracted.
    tests, parts : Runs it applies to; all when empty.
    source : Where the numbers come from.
    """

    what: str
    source: str
    loads: dict[str, str] = Field(default_factory=dict)
    per_speed_squared: dict[str, float] = Field(default_factory=dict)
    tests: list[str] = Field(default_factory=list)
    parts: list[str] = Field(default_factory=list)

    @field_validator("loads", "per_speed_squared")
    @classmethod
    def _components(cls, given: dict[str, object]) -> dict[str, object]:
        for name in given:
            if name not in OUTPUTS:
                raise ValueError(f"components {' '.join(OUTPUTS)}, not {name}")
        return given


class HalfModel(Data):
    """Only half of the body was tested, against its plane of symmetry.

    Attributes
    ----------
    plane : ``port_starboard``: X, Z, M are doubled; the others are zero by symmetry and
        left out. ``upper_lower`` (a double body): X, Y, N are doubled.
    source : Where this is said.
    """

    plane: Literal["port_starboard", "upper_lower"]
    source: str


class Uncertainty(Data):
    """Rule for the standard error of a load.

    Attributes
    ----------
    floor : Least size of a load that its relative error counts on, as a share of the largest of its kind.
    source : What the errors rest on.
    """

    floor: Annotated[float, Field(ge=0, le=1)]
    source: str


class Quality(Data):
    """A word of the quality vocabulary: factor on the standard error, and its meaning.

    Attributes
    ----------
    factor : On the standard error of runs with this word.
    meaning : What the word means.
    """

    factor: Annotated[float, Field(ge=1, le=1e6)]
    meaning: str


class Tables(Data):
    """Tables beside the runs that the quality checks look at.

    Attributes
    ----------
    configurations : CSV with columns configuration and appendages: what each name of a
        configuration in the source stands for.
    reference : CSV with columns coefficient and value: derivatives of the same body printed
        elsewhere, program frame, over 1/2 rho L^n.
    """

    configurations: str = ""
    reference: str = ""

    @field_validator("configurations", "reference")
    @classmethod
    def _beside(cls, name: str) -> str:
        if name and (Path(name).name != name or len(name) > 200):
            raise ValueError("the name of a file in the campaign folder")
        return name

    def given(self) -> dict[str, str]:
        """Those that are named."""
        return {k: v for k, v in self.model_dump().items() if v}


class PureYaw(Data):
    """Pure yaw that is no measurement, but pure pitch turned by axisymmetry.

    With forward speed it is then estimated (``ident.estimates.turning``).

    Attributes
    ----------
    taken_off, sigma : Share of it that the source had taken off its loads at the rotating arm before it
        published them, from 0 to 1, and the standard deviation of what is known of that.
    source : Where this is said.
    """

    taken_off: Annotated[float, Field(ge=0, le=1)]
    sigma: Annotated[float, Field(ge=0, le=1)]
    source: str


# Tests whose coefficients are prime loads: nothing else multiplies them.
_STEADY = ("towing", "drift_horizontal", "drift_vertical")


class SharedError(Data):
    """An error that all runs of some tests have in common: a grid, a normalisation, a balance.

    The standard errors of runs do not hold it, for they average out over runs; the predicted version adds it.

    Attributes
    ----------
    name : Of the error.
    tests, parts, loads : Which loads share it; all where empty.
    relative : Standard deviation, of the load. This, or ``offset``.
    offset : Load component -> prime load that may have to be added to every run, all of them together, as where two
        prints of the same runs lie apart: F / (1/2 rho U^2 L^n), campaign frame, about the vehicle's origin. Runs
        in drift and towing only, whose coefficients are loads themselves.
    source : Where this is said.
    """

    name: str
    tests: list[str] = Field(default_factory=list)
    parts: list[str] = Field(default_factory=list)
    loads: list[str] = Field(default_factory=list)
    relative: Annotated[float, Field(gt=0, le=1)] | None = None
    offset: dict[str, float] = Field(default_factory=dict)
    source: str

    @field_validator("loads", "offset")
    @classmethod
    def _components(cls, given: list[str] | dict[str, float]) -> list[str] | dict[str, float]:
        for name in given:
            if name not in OUTPUTS:
                raise ValueError(f"components {' '.join(OUTPUTS)}, not {name}")
        return given

    @model_validator(mode="after")
    def _one_size(self) -> SharedError:
        if (self.relative is None) == (not self.offset):
            raise ValueError("one of relative and offset")
        if self.offset and (self.loads or not set(self.tests) <= set(_STEADY) or not self.tests):
            raise ValueError(f"an offset names its loads itself, and tests of {', '.join(_STEADY)}")
        if self.offset and not all(0.0 < abs(value) < 1.0 for value in self.offset.values()):
            raise ValueError("an offset is a prime load between 0 and 1, or -1 and 0")
        return self


class CampaignFile(Data):
    """Schema of ``campaign.toml``.

    Attributes
    ----------
    name : Of the campaign.
    vehicle : Bundled vehicle, or a vehicle file beside this one.
    facility : Tank or code.
    provenance : Where the runs come from.
    frame : Axes of loads and rates, and sign of the angles.
    moment_point : Point the moments are about.
    motion_point : Point of a turning boat whose speed, drift and incidence are stated; the vehicle's origin without.
    scale : Ship over model, and the tested length.
    fluid : Density of the water.
    inertia : Whether the loads contain the model's own inertia.
    uncertainty : Rule for the standard error of a load.
    quality : Word -> factor on the standard error, and meaning.
    tare : Loads that are taken off.
    hydrostatics : Hydrostatic load that the loads contain.
    half_model : Where only half of the body was tested.
    tables : Files beside the runs that only the checks look at.
    source : Which files hold the runs; every CSV beside this file without.
    pure_yaw : Where pure yaw is pure pitch turned: what had been taken off published loads, with its error.
    shared_error : Errors that all runs of some tests have in common.
    complete_from : ``lines``: what a published set leaves out is estimated from the vehicle's lines; else it stays as
        its authors give it.
    absent : Essential loads that a test does not give, with the reason:
        ``"drift_horizontal.N" = "a balance of two components"``.
    """

    name: str
    vehicle: str
    facility: str
    provenance: str
    frame: CampaignFrame
    moment_point: MomentPoint
    scale: Scale
    fluid: Fluid
    inertia: Inertia
    uncertainty: Uncertainty
    quality: dict[str, Quality]
    motion_point: MotionPoint | None = None
    tare: list[Tare] = Field(default_factory=list)
    half_model: HalfModel | None = None
    hydrostatics: Hydrostatics | None = None
    absent: dict[str, Annotated[str, Field(min_length=1, max_length=500)]] = Field(default_factory=dict)
    tables: Tables = Field(default_factory=Tables)
    pure_yaw: PureYaw | None = None
    shared_error: list[SharedError] = Field(default_factory=list)
    complete_from: Literal["", "lines"] = ""
    source: list[Source] = Field(default_factory=list)


def read_header(folder: Path) -> tuple[CampaignFile, bytes]:
    """The checked ``campaign.toml`` of a folder, and its bytes.

    Raises
    ------
    InputError
        For a missing file, one that is not TOML, or a key missing, unknown or out of range.
    """
    path = folder / "campaign.toml"
    if not path.is_file():
        raise InputError(str(path), "missing", "a campaign folder holds campaign.toml and one CSV a test")
    raw = inputs.statements(path)
    try:
        data = tomllib.loads(raw.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(str(path), f"not TOML: {error}", "a TOML file in UTF-8") from error
    return checked(CampaignFile, data, str(path)), raw
