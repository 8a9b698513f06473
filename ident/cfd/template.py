"""The template of a matrix of CFD cases: what is the same in every case, as a TOML file."""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from sim.files.constants import constant
from sim.files.errors import InputError
from sim.files.schema import Data, FrameData, checked
from sim.files.toml_files import read_toml

# Metres in the unit that a surface is written in.
UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": constant("inch"), "ft": constant("foot")}
Version = Literal["v1912", "v2006", "v2012", "v2106", "v2112", "v2206", "v2212", "v2306", "v2312", "v2406", "v2412"]
Positive = Annotated[float, Field(gt=0, le=1e9)]
Share = Annotated[float, Field(gt=0, lt=1)]
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Patches = Annotated[list[Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=60)]], Field(min_length=1)]


@cache
def settings() -> dict[str, float]:
    """Numbers of ``data/openfoam_settings.csv`` by name."""
    with (files("ident") / "data" / "openfoam_settings.csv").open(encoding="utf-8") as stream:
        return {row["name"]: float(row["value"]) for row in csv.DictReader(stream)}


class Surface(FrameData):
    """How the surface file is to be read.

    Attributes
    ----------
    unit : Of its coordinates: ``m``, ``mm``, ``cm``, ``in`` or ``ft``.
    origin : The vehicle's origin in the surface's own axes and unit.
    ratio : Ship over surface; the cases are run at the surface's scale, by Froude's law.
    """

    unit: Literal["m", "mm", "cm", "in", "ft"]
    origin: Vector
    ratio: Annotated[float, Field(gt=0, le=1e4)] = 1.0


class Tolerances(Data):
    """Largest difference between the surface's own numbers and the vehicle file's, beyond which nothing is written.

    Attributes
    ----------
    length : Of the length, relative.
    volume : Of the volume (the displaced mass over the density), relative.
    centroid : Of the centroid from the centre of buoyancy, as a part of the length.
    sections : Of section areas from those of the vehicle's geometry file, as a part of the largest; where it has one.
    added_mass : Of the panel method's added masses from those of the geometry file, relative; where it has one.
    """

    length: Share = 0.02
    volume: Share = 0.05
    centroid: Share = 0.02
    sections: Share = 0.05
    added_mass: Share = 0.1


class Fluid(Data):
    """The water of the cases.

    Attributes
    ----------
    density_kgpm3 : The solver works with kinematic loads; the campaign multiplies them by this [kg/m^3].
    kinematic_viscosity_m2ps : Of the water [m^2/s].
    source : Where the numbers come from.
    """

    density_kgpm3: Annotated[float, Field(gt=0, le=1e5)]
    kinematic_viscosity_m2ps: Annotated[float, Field(gt=0, le=1)]
    source: Annotated[str, Field(min_length=1, max_length=500)]


class Flow(Data):
    """What is solved.

    Attributes
    ----------
    turbulence : ``kOmegaSST`` with wall functions, ``laminar``, or ``inviscid``: no viscosity, and walls that slip.
    free_surface : ``none``: unbounded water, for one depth alone. ``double_body``: a symmetry plane at the surface's
        place above the boat, no waves.
    intensity : Turbulence intensity of the inflow.
    viscosity_ratio : Eddy over molecular viscosity of the inflow.
    """

    turbulence: Literal["kOmegaSST", "laminar", "inviscid"] = "kOmegaSST"
    free_surface: Literal["none", "double_body"] = "none"
    intensity: Share | None = None
    viscosity_ratio: Positive | None = None

    @model_validator(mode="after")
    def _used(self) -> Flow:
        for key in ("intensity", "viscosity_ratio"):
            if self.turbulence != "kOmegaSST" and getattr(self, key) is not None:
                raise ValueError(f"no {key}: turbulence = {self.turbulence!r} has none")
        return self


class Layers(Data):
    """Prism layers on the walls.

    Attributes
    ----------
    number : Of layers.
    thickness : Of the outermost one, as a part of the cell beside it.
    expansion : Ratio of thicknesses.
    """

    number: Annotated[int, Field(ge=1, le=50)]
    thickness: Annotated[float, Field(gt=0, le=2)]
    expansion: Annotated[float, Field(gt=1, le=2)]


class Grid(Data):
    """The refinement rule: cells on the walls of length over ``cells_per_length``, each level beyond twice as long.

    Attributes
    ----------
    cells_per_length : Cells on the boat's length, on the finest grid.
    levels : Halvings between the cells at the far boundary and those on the wall.
    extent : From the origin to the far boundary, in lengths.
    number : 3 grids for the discretisation error of every run, or 1 without.
    refinement : Ratio of cell lengths between successive grids.
    layers : Prism layers on the walls, the same number on every grid; their thickness goes with the cells.
    """

    cells_per_length: Annotated[float, Field(ge=4, le=1e5)]
    levels: Annotated[int, Field(ge=1, le=12)]
    extent: Annotated[float, Field(ge=0.75, le=100)]
    number: Literal[1, 3] = 3
    refinement: Annotated[float, Field(gt=1.1, le=2)] = 1.4142135623730951
    layers: Layers | None = None

    @model_validator(mode="after")
    def _used(self) -> Grid:
        if self.number == 1 and "refinement" in self.model_fields_set:
            raise ValueError("no refinement: number = 1 has one grid")
        return self


class Steady(Data):
    """Steady runs: inflow and rotating frame.

    Attributes
    ----------
    iterations : Of every steady run; loads are means over the last part of them.
    """

    iterations: Annotated[int, Field(ge=50, le=1000000)] = 1000


class Unsteady(Data):
    """Runs with an acceleration.

    Attributes
    ----------
    kind : ``constant``: a constant acceleration from rest, by a source term (linear) or a moving mesh (angular).
        ``oscillation``: the mesh oscillates with the wanted acceleration as its amplitude, each a run at the ends of
        acceleration and velocity.
    travel : Of the body, in lengths (angles in radians): at the end, or the amplitude.
    courant : Cells of the wall that the fastest point of the body passes in a time step. Far smaller steps make
        the pressure worse: it then follows what is left of the coupling between velocity and flux.
    periods : Of an oscillation; the first is left out.
    """

    kind: Literal["constant", "oscillation"] = "constant"
    travel: Annotated[float, Field(gt=0, le=0.5)] = 0.02
    courant: Annotated[float, Field(gt=0, le=5)] = 0.5
    periods: Annotated[int, Field(ge=2, le=100)] | None = None

    @model_validator(mode="after")
    def _used(self) -> Unsteady:
        if self.kind == "constant" and self.periods is not None:
            raise ValueError("no periods: kind = 'constant' does not oscillate")
        return self


class Disc(Data):
    """Self-propulsion: the hull behind an actuator disc of stated thrust, and its towed run without.

    Attributes
    ----------
    speed_mps : Full-scale speed of the run.
    depth_m : Depth of the sail top, full scale.
    thrust_n : Thrust of the disc, full scale.
    thickness : Of the disc, in propeller diameters.
    source : Where thrust and revolutions come from.
    """

    speed_mps: Positive
    depth_m: Positive
    thrust_n: Annotated[float, Field(gt=0, le=1e10)]
    thickness: Annotated[float, Field(gt=0, le=1)] = 0.1
    source: Annotated[str, Field(min_length=1, max_length=500)]


class Uncertainty(Data):
    """What the grids do not say: the error of model and iteration.

    Attributes
    ----------
    rel_sigma : Standard error of every load, relative; added in squares to that of the grids.
    floor : Least size of a load that it counts on, as a share of the largest of its kind.
    source : What it rests on.
    """

    rel_sigma: Annotated[float, Field(gt=0, le=10)]
    floor: Annotated[float, Field(gt=0, le=1)]
    source: Annotated[str, Field(min_length=1, max_length=500)]


class Slurm(Data):
    """How a Slurm array asks for its machines.

    Attributes
    ----------
    time : Limit of a case, ``hh:mm:ss``.
    partition, account : Where the cluster asks for them.
    """

    time: Annotated[str, Field(pattern=r"^(\d+-)?\d+:\d\d:\d\d$")]
    partition: Annotated[str, Field(pattern=r"^[\w.,-]*$")] = ""
    account: Annotated[str, Field(pattern=r"^[\w.-]*$")] = ""


class Machine(Data):
    """Where cases run.

    Attributes
    ----------
    cores : Of a case; more than one decomposes it.
    slurm : Of a cluster; without it no array is written.
    """

    cores: Annotated[int, Field(ge=1, le=4096)] = 1
    slurm: Slurm | None = None


class Template(Data):
    """Schema of a template.

    Attributes
    ----------
    openfoam : Version of OpenCFD's OpenFOAM that the cases are for.
    surface : Unit, axes and origin of the surface file.
    parts : Part of the vehicle -> patches of the surface whose loads are its loads; every patch is in one.
    fluid : The water.
    uncertainty : Beyond the grids.
    grid : Refinement rule and grids.
    flow : What is solved.
    steady, unsteady : Iterations, time steps.
    disc : Self-propulsion, where it is wanted.
    tolerances : Between the surface's numbers and the vehicle file's.
    machine : Where cases run.
    """

    openfoam: Version
    surface: Surface
    parts: Annotated[dict[str, Patches], Field(min_length=1)]
    fluid: Fluid
    uncertainty: Uncertainty
    grid: Grid
    flow: Flow = Field(default_factory=Flow)
    steady: Steady = Field(default_factory=Steady)
    unsteady: Unsteady = Field(default_factory=Unsteady)
    disc: list[Disc] = Field(default_factory=list)
    tolerances: Tolerances = Field(default_factory=Tolerances)
    machine: Machine = Field(default_factory=Machine)

    @field_validator("parts")
    @classmethod
    def _once(cls, parts: dict[str, list[str]]) -> dict[str, list[str]]:
        for part, patches in parts.items():
            twice = [p for p in patches if patches.count(p) > 1]
            if twice:
                raise ValueError(f"each patch once: {part} names {twice[0]} twice")
            reserved = [p for p in patches if p in ("far", "surface")]
            if reserved:
                raise ValueError(
                    f"another name for patch {reserved[0]!r}: the far boundary and the surface are called so"
                )
        return parts


def read_template(path: Path) -> Template:
    """A checked template.

    Raises
    ------
    InputError
        For a file that is not TOML, a missing or unknown key, or a value out of range.
    """
    if path.suffix != ".toml":
        text = "a TOML file: openfoam, [surface], [parts], [fluid], [grid], [uncertainty], see docs/lines-to-runs.md"
        raise InputError(str(path), "not a .toml file", text)
    data, where = read_toml(path, "")
    template = checked(Template, data, where)
    template.surface.declared(f"{where}, key surface")
    return template
