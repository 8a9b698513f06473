"""Water of a case: density, gravity, current, layers and waves, as a case file states them."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from sim.files.constants import constant
from sim.files.schema import Data, Positive

# Of water, fresh and hot to brine.
Water = Annotated[float, Field(ge=constant("least_water_density"), le=constant("most_water_density"))]


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
    density_kgpm3: Water


class EnvironmentData(Data):
    """Water density and gravity.

    Attributes
    ----------
    density_kgpm3 : Of the water [kg/m^3]; where there are layers, that of the tables' loads and of the hull's stated
        displacement.
    gravity_mps2 : Gravity [m/s^2].
    current : Of the water; velocities of the boat are then through the water, its place over ground, and waves are
        those in the water that it carries.
    layer : Density over depth: buoyancy and loads follow it, the added mass does not.
    hull_compressibility_perm : Share of its volume that the hull loses a metre of depth [1/m].
    free_surface : The hull may come out of the water and loses buoyancy and added mass there; always so in
        waves, which need the vehicle's geometry alike.
    """

    density_kgpm3: Water
    gravity_mps2: Annotated[float, Field(ge=constant("least_gravity"), le=constant("most_gravity"))]
    free_surface: bool = False
    current: CurrentData | None = None
    layer: Annotated[list[LayerData], Field(max_length=8)] = Field(default_factory=list)
    hull_compressibility_perm: Annotated[float, Field(ge=0, le=1e-3)] = 0.0

    @model_validator(mode="after")
    def _deep_where_it_varies(self) -> EnvironmentData:
        depths = [one.depth_m for one in self.layer]
        if any(b <= a for a, b in pairwise(depths)):
            raise ValueError("layers stand from shallow to deep, each at a depth of its own")
        if self.free_surface and self.varies_over_depth:
            raise ValueError("layer and hull_compressibility_perm are for deep water, without free_surface")
        return self

    @property
    def varies_over_depth(self) -> bool:
        """Whether water or hull change over depth."""
        return bool(self.layer or self.hull_compressibility_perm)


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
