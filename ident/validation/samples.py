"""A case flown with many sets of row values: what goes to threads and to other machines, and what comes back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.metrics.measure import measured
from ident.metrics.metric import Values
from sim.boat.coefficients import Coefficients
from sim.boat.vehicle import Vehicle
from sim.flight.case import Case
from sim.flight.craft import Craft
from sim.flight.series import Series
from sim.flight.simulate import columns_of, equipped, fly, uses_tanks
from sim.flight.simulation import DERIVED
from sim.flight.trim import NoEquilibrium
from sim.kernel.assemble import Assembly
from sim.waves.in_waves import Water

Array = NDArray[np.float64]


class Flown(NamedTuple):
    """One sample: (channels, records) by source, and the metrics of the case's own flight."""

    records: dict[str, Array]
    metrics: Values


@dataclass(frozen=True)
class Batch:
    """A case to be flown with many sets of row values; goes to other processes as it is.

    Attributes
    ----------
    flights : The case, under "", and the case from the start of a source's record, by source.
    vehicle : Of the case.
    assembly : Row values to the model.
    channels : Names of what a flight gives.
    water : Waves and surface, with the sections' added mass at its database values.
    """

    flights: dict[str, Case]
    vehicle: Vehicle
    assembly: Assembly
    channels: tuple[str, ...]
    water: Water | None

    def fly(self, values: Array) -> list[Flown | None]:
        """Fly one sample after the other.

        Parameters
        ----------
        values : (k, rows) row values.

        Returns
        -------
        For each sample its records and metrics; None without a self-propulsion state.
        """
        samples: list[Flown | None] = []
        # A sample is measured by itself: references and published values are the case's.
        bare = self.flights[""].model_copy(update={"reference": None, "published": []})
        for sample in values:
            model = self.assembly.model(sample)
            try:
                flown = {
                    s: fly(c, self.vehicle, equipped(c, self.vehicle, model), self.water)
                    for s, c in self.flights.items()
                }
            except NoEquilibrium:
                samples.append(None)
                continue
            measures = measured(bare, flown[""], Series({}), {}).metrics
            metrics = {name: metric.simulated for name, metric in measures.items()}
            samples.append(Flown({s: np.stack([one[c] for c in self.channels]) for s, one in flown.items()}, metrics))
        return samples


def batch_of(case: Case, vehicle: Vehicle, rows: pd.DataFrame) -> Batch:
    """The batch of a case; raises ``InputError`` when it uses tanks that the vehicle lacks."""
    started = {s: case.started_as(s) for s in (case.reference.compare if case.reference else [])}
    craft = Craft(Coefficients(vehicle, rows))
    assembly = craft.assembly(case)
    equipped(case, vehicle, assembly.model(rows["value"].to_numpy()))
    return Batch(
        flights={"": case} | {s: c for s, c in started.items() if c is not None},
        vehicle=vehicle,
        assembly=assembly,
        channels=(*columns_of(vehicle, uses_tanks(case)), *DERIVED),
        water=craft.water(case),
    )
