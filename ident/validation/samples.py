"""A case flown with many sets of row values: what goes to threads and to other machines, and what comes back."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
from sim.flight.simulation import DERIVED, Simulation
from sim.flight.trim import NoEquilibrium
from sim.kernel.assemble import Assembly
from sim.kernel.rhs import BEGUN, MIDPOINT
from sim.waves.in_waves import Water

Array = NDArray[np.float64]

# Root mean square difference of a channel, of its range, to which a flight by half the work is the same flight: what
# the length of a step changes is larger (``sim/bench/step_errors.csv``), and far larger is what a sample is flown for.
_SAME = 1e-4
# Difference of a channel that stands still.
_NOTHING = 1e-12


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
    scheme : How a step is taken: ``MIDPOINT`` of ``sim.kernel.rhs`` where the flights of the database's own values
        are the same by it, to 1e-4 of the range of every channel; else ``BEGUN``.
    """

    flights: dict[str, Case]
    vehicle: Vehicle
    assembly: Assembly
    channels: tuple[str, ...]
    water: Water | None
    scheme: int = BEGUN

    def _flown(self, values: Array, scheme: int) -> dict[str, Simulation]:
        """The flights with row values; raises ``NoEquilibrium``."""
        model = self.assembly.model(values)
        return {
            source: fly(case, self.vehicle, equipped(case, self.vehicle, model), self.water, scheme)
            for source, case in self.flights.items()
        }

    def quick(self, values: Array) -> Batch:
        """The batch with the quickest steps that leave the flights with row values the same."""
        try:
            by_four, by_two = (self._flown(values, scheme) for scheme in (BEGUN, MIDPOINT))
        except NoEquilibrium:
            return self
        same = all(_is_same(one, by_two[source]) for source, one in by_four.items())
        return replace(self, scheme=MIDPOINT) if same else self

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
            try:
                flown = self._flown(sample, self.scheme)
            except NoEquilibrium:
                samples.append(None)
                continue
            measures = measured(bare, flown[""], Series({}), {}).metrics
            metrics = {name: metric.simulated for name, metric in measures.items()}
            samples.append(Flown({s: np.stack([one[c] for c in self.channels]) for s, one in flown.items()}, metrics))
        return samples


def _is_same(one: Simulation, other: Simulation) -> bool:
    """Whether no channel of two flights differs, as a root mean square, by 1e-4 of its range."""
    if one.record.shape != other.record.shape:
        return False
    difference = np.sqrt(np.mean((one.record - other.record) ** 2, axis=0))
    return bool((difference <= _SAME * np.ptp(one.record, axis=0) + _NOTHING).all())


def batch_of(case: Case, vehicle: Vehicle, rows: pd.DataFrame) -> Batch:
    """The batch of a case; raises ``InputError`` when it uses tanks that the vehicle lacks."""
    started = {s: case.started_as(s) for s in (case.reference.compare if case.reference else [])}
    craft = Craft(Coefficients(vehicle, rows))
    assembly = craft.assembly(case)
    values = rows["value"].to_numpy()
    equipped(case, vehicle, assembly.model(values))
    batch = Batch(
        flights={"": case} | {s: c for s, c in started.items() if c is not None},
        vehicle=vehicle,
        assembly=assembly,
        channels=(*columns_of(vehicle, uses_tanks(case)), *DERIVED),
        water=craft.water(case),
    )
    return batch.quick(values)
