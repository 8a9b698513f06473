"""A vehicle is data: particulars, planes, propeller, sections and its term set."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_validator

from sim.boat.catalogue import TermSet, term_sets
from sim.boat.plausible import check_vehicle
from sim.boat.stated import Length, Limits, Mass, Number, Place, Vector, in_unit
from sim.files.errors import InputError
from sim.files.frames import PROGRAM, Frame
from sim.files.schema import Data, FrameData, Name, checked
from sim.files.toml_files import bundled, read_toml


class Particulars(Data):
    """Mass, inertia and reference points; positions from the body origin.

    Attributes
    ----------
    length : Reference length L [m].
    mass : Mass with all water inside the envelope [kg].
    displaced_mass : Mass of the displaced water [kg].
    radius_of_gyration : About x, y, z through the centre of gravity [m].
    centre_of_gravity : From the body origin [m].
    centre_of_buoyancy : From the body origin [m].
    sail_top : The point whose depth is D0, from the body origin [m]; a bare hull has none until a depth
        or a flight asks for it.
    approach_speed : Of the boat's maneuvers [m/s]: a standard maneuver of another boat is flown at it; by Froude's law
        where it is left out.
    """

    length: Length
    mass: Mass
    displaced_mass: Mass
    radius_of_gyration: Place
    centre_of_gravity: Place
    centre_of_buoyancy: Place
    sail_top: Place | None = None
    approach_speed: Annotated[Number, in_unit("m/s", positive=True)] | None = None


class Propeller(Data):
    """Propeller diameter, the limits of its revolutions, and where it is (waves need that).

    Attributes
    ----------
    name : Of the propeller.
    diameter : D [m].
    limits : Lowest and highest revolutions [rps].
    rate : Largest change of the revolutions [rps/s].
    position : Of the propeller disc from the body origin [m]; waves need it.
    """

    name: Name
    diameter: Length
    limits: Annotated[Limits, in_unit("rps")]
    rate: Annotated[Number, in_unit("rps/s", positive=True)]
    position: Place | None = None


class Rudder(Data):
    """Size of a ship's rudder; a plane named ``rudder`` says where it is and how it turns.

    Attributes
    ----------
    area : A_R, of the part that moves [m2].
    height : H_R, its span [m].
    """

    area: Annotated[Number, in_unit("m2", positive=True)]
    height: Length


class Mixer(Data):
    """Share of the vertical and horizontal command in a plane's deflection, Eq. (1).

    Attributes
    ----------
    dV : Share of the vertical command.
    dH : Share of the horizontal command.
    """

    dV: float
    dH: float


class Plane(Data):
    """One control plane: where it is, how it turns, what limits it.

    Attributes
    ----------
    name : Of the plane; a part that runs carry loads of.
    where : In words.
    position : Of its root or stock from the body origin [m].
    span_axis : From root to tip; positive deflection turns right-handed about it.
    leading_edge : Direction of its leading edge at no deflection.
    mirror : Name of the plane that is its port/starboard image; its own where it has none.
    mixer : Share of each command in its deflection.
    limit_deg : Largest deflection either way [deg].
    rate_degps : Largest rate of deflection [deg/s].
    source : Where this comes from.
    """

    name: Name
    where: str
    position: Vector
    span_axis: Vector
    leading_edge: Vector
    mirror: str
    mixer: Mixer
    limit_deg: Annotated[float, Field(gt=0)]
    rate_degps: Annotated[float, Field(gt=0)]
    source: str

    @property
    def is_aft(self) -> bool:
        """Whether it stands aft of the body origin, in the program frame."""
        return self.position[0] < 0.0

    @property
    def lift_axis(self) -> np.ndarray:
        """Unit normal n = b x p along which positive deflection lifts, Eq. (32)."""
        normal = np.cross(self.span_axis, self.leading_edge)
        return normal / np.linalg.norm(normal)


class Section(Data):
    """Centre of one added-mass section.

    Attributes
    ----------
    name : Of the section; a part that runs carry loads of.
    position : Of its centre from the body origin [m].
    """

    name: Name
    position: Vector


class Sections(Data):
    """The added-mass sections of Table 6.

    Attributes
    ----------
    source : Where the centres come from.
    centres : Sections from stern to bow.
    """

    source: str
    centres: list[Section]


class BallastTank(Data):
    """Water taken in and pumped out: where, how much, how fast.

    Attributes
    ----------
    position : Of the water from the body origin [m].
    limit : Largest mass taken in or pumped out [kg].
    rate : Of pumping [kg/s].
    """

    position: Place
    limit: Mass
    rate: Annotated[Number, in_unit("kg/s", positive=True)]


class TrimTank(Data):
    """Water moved along the boat, as the shift of the centre of gravity: how far, how fast.

    Attributes
    ----------
    limit : Largest shift of the centre of gravity [m].
    rate : Of the shift [m/s].
    """

    limit: Length
    rate: Annotated[Number, in_unit("m/s", positive=True)]


class Tanks(Data):
    """Ballast and trim tank, Eq. (11).

    Attributes
    ----------
    ballast : Water taken in and pumped out.
    trim : Water moved along the boat.
    """

    ballast: BallastTank
    trim: TrimTank


class Axes(FrameData):
    """Declared directions of the body axes and what the origin is.

    Attributes
    ----------
    x : ``forward`` or ``aft``.
    y : ``starboard`` or ``port``.
    z : ``down`` or ``up``.
    origin : Where the origin is, in words; moments of the database are about it.
    """

    origin: str


class Vehicle(Data):
    """A vehicle file, turned to the program frame by ``load_vehicle``.

    ``propeller`` may be left out of a bare hull: its terms are then out of the set, and flights ask for it.
    ``geometry`` names its surface (``sim.hull.surface``), waves need it; ``errata`` a table of what is
    printed wrong in its source and how it is applied (columns equation, printed, corrected,
    consequence), shown in the report. They and ``terms`` are relative to the vehicle file, or one that is
    bundled (``bb2/geometry.toml``), so that a copy of a bundled vehicle is whole.

    Attributes
    ----------
    name : Of the vehicle, as the database names it.
    title : For people.
    source : Where the file comes from.
    term_set : ``reduced``: tables over speed, angle and depth. ``gertler_hagen``: constant coefficients.
        ``mmg``: ships in surge, sway and yaw, with rudder and propeller. ``auv``: slender vehicles with
        cross-flow axis by axis and fins. ``nps_auv``: the terms of Healey and Lienard (1993).
    added_mass : ``derivatives`` of the whole boat, or ``sections`` along it.
    frame : Axes of every vector of the file.
    particulars : Mass, inertia and reference points.
    propeller : The propeller; a bare hull has none until a flight asks for it.
    planes : Control planes.
    rudder : Size of a ship's rudder, for the set ``mmg``.
    sections : Added-mass sections; with ``added_mass = "sections"``.
    tanks : Ballast and trim tank, where the boat has them.
    geometry : File of its surface, beside this one; waves need it.
    errata : Table of what is printed wrong in its source, beside this file.
    terms : CSV file of terms that its set does not have, beside this file (columns ``name``, ``output``,
        ``power``, ``multiplier``, ``part``, ``test``).
    """

    name: Name
    title: str
    source: str
    term_set: Literal["reduced", "gertler_hagen", "mmg", "auv", "nps_auv"]
    added_mass: Literal["sections", "derivatives"]
    frame: Axes
    particulars: Particulars
    propeller: Propeller | None = None
    planes: list[Plane] = Field(default_factory=list)
    rudder: Rudder | None = None
    sections: Sections | None = None
    tanks: Tanks | None = None
    geometry: str | None = None
    errata: str | None = None
    terms: str | None = None

    @field_validator("planes")
    @classmethod
    def _mirrors_exist(cls, planes: list[Plane]) -> list[Plane]:
        names = {p.name for p in planes}
        for plane in planes:
            if plane.mirror not in names:
                raise ValueError(f"plane {plane.name} mirrors {plane.mirror!r}, which is not a plane")
        return planes

    def turned(self, frame: Frame) -> Vehicle:
        """The same vehicle described in another frame (program frame to ``frame`` or back)."""
        data: dict[str, Any] = self.model_dump()
        signs = [self.frame.frame.signs[a] * frame.signs[a] for a in "xyz"]

        def turn(vector: list[float]) -> list[float]:
            return [s * v + 0.0 for s, v in zip(signs, vector, strict=True)]

        data["frame"].update(x=frame.x, y=frame.y, z=frame.z)
        for key in ("centre_of_gravity", "centre_of_buoyancy", "sail_top"):
            if data["particulars"][key]:
                data["particulars"][key]["value"] = turn(data["particulars"][key]["value"])
        if data["tanks"]:
            tank = data["tanks"]["ballast"]["position"]
            tank["value"] = turn(tank["value"])
        if data["propeller"] and data["propeller"]["position"]:
            data["propeller"]["position"]["value"] = turn(data["propeller"]["position"]["value"])
        for plane in data["planes"]:
            for key in ("position", "span_axis", "leading_edge"):
                plane[key] = turn(plane[key])
        for section in (data["sections"] or {"centres": []})["centres"]:
            section["position"] = turn(section["position"])
        return Vehicle.model_validate(data)

    @property
    def terms_of(self) -> TermSet:
        """What holds for all terms of its set."""
        return term_sets()[self.term_set]

    def part_names(self) -> list[str]:
        """Every part of the boat that a run may carry loads of."""
        sections = [s.name for s in self.sections.centres] if self.sections else []
        driven = ["propeller"] if self.propeller else []
        return ["hull", *driven, *[p.name for p in self.planes], *sections]

    @property
    def diameter(self) -> float:
        """Propeller diameter [m]; 1 for a boat without one, none of whose terms has it."""
        return self.propeller.diameter.value if self.propeller else 1.0

    @property
    def stern_planes(self) -> list[Plane]:
        """Planes aft of the body origin, by their place."""
        return [p for p in self.planes if p.is_aft]

    @property
    def forward_planes(self) -> list[Plane]:
        """Planes on the sail or at the bow: those that are not aft of the body origin."""
        return [p for p in self.planes if not p.is_aft]

    def needed_propeller(self, what: str) -> Propeller:
        """The propeller, for what cannot be done without one.

        Raises
        ------
        InputError
            When the vehicle file has none.
        """
        if self.propeller is None:
            raise InputError(f"vehicle {self.name}, key propeller", "nothing", f"a propeller: {what} needs it")
        return self.propeller

    def needed_sail_top(self, what: str) -> list[float]:
        """Place of the sail top [m], for what cannot be done without it.

        Raises
        ------
        InputError
            When the vehicle file has none.
        """
        top = self.particulars.sail_top
        if top is None:
            where = f"vehicle {self.name}, key particulars.sail_top"
            raise InputError(where, "nothing", f"the highest point of boat or sail: {what} needs it")
        return top.value


def load_vehicle(name: str | Path, beside: str | Path = "") -> Vehicle:
    """Read a vehicle and turn it to the program frame.

    Parameters
    ----------
    name : Bundled name or path to a vehicle file.
    beside : File that names the vehicle; a path is relative to its folder.

    Raises
    ------
    InputError
        For a missing file, also one that the vehicle file names, a missing or unknown key, a value out of
        range, or as ``check_vehicle``.
    """
    path = Path(name)
    there = Path(beside).parent / path if path.suffix == ".toml" else name
    data, where = read_toml(there, "vehicles", f"{beside}, key vehicle" if str(beside) else "")
    vehicle = checked(Vehicle, data, where)
    vehicle.frame.declared(where)
    check_vehicle(vehicle, where)
    for key in ("geometry", "errata", "terms"):
        if getattr(vehicle, key) is not None:
            setattr(vehicle, key, _file_of(where, key, getattr(vehicle, key)))
    return vehicle.turned(PROGRAM)


def _file_of(where: str, key: str, name: str) -> str:
    """Path of a file that a vehicle file names: beside it, else bundled."""
    ours = str(files("sim") / "vehicles")
    for place in (ours if where in bundled("vehicles") else os.path.dirname(where), ours):
        path = os.path.join(place, name)
        if os.path.isfile(path):
            return path
    allowed = "a file beside it, or a bundled one"
    if "$" in name or "%" in name or name.startswith("~"):
        allowed += "; its name as it is, no variable of the environment is put in"
    raise InputError(f"{where}, key {key}", f"no file {name[:200]!r}", allowed)
