"""A flown case as its figures show it, light to hand to a process that draws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ident.metrics.in_waves import InWaves
    from ident.metrics.turning import SpiralPoint
    from ident.validation.bands import Bands
    from ident.validation.sweep import SweepPoint
    from sim.boat.delta_log import Origin
    from sim.flight.case import Case
    from sim.flight.series import Series
    from sim.flight.simulation import Simulation


@dataclass(frozen=True)
class FlownCase:
    """What figures show of a validation.

    Attributes
    ----------
    case, simulation, reference, as_started, curve, grid, in_waves, bands : As of ``Validation``; flights without
        the equilibrium they started from.
    database : Path, version and digest.
    """

    case: Case
    simulation: Simulation
    reference: Series
    as_started: dict[str, Simulation]
    curve: list[SpiralPoint] | None
    grid: list[SweepPoint] | None
    in_waves: InWaves
    bands: Bands | None
    database: Origin

    @property
    def version(self) -> int:
        """Number of the version that was flown."""
        return int(self.database["version"])
