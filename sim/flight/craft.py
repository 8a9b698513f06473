"""A vehicle with its coefficients, ready for any case: the one way from rows of a database to a flight."""

from __future__ import annotations

from threading import RLock

from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.flight.case import Case
from sim.flight.simulate import environment_of, equipped, fly, water_of
from sim.flight.simulation import Simulation
from sim.kernel.assemble import Assembly, assemble
from sim.kernel.layout import Model
from sim.waves.in_waves import Water


class Craft:
    """What flights of one boat have in common, worked out once; may be shared by threads.

    Parameters
    ----------
    coefficients : With their vehicle.

    Examples
    --------
    >>> from sim.bench.boat import frozen_boat
    >>> from sim.flight.case import load_case
    >>> case, _ = load_case("self-propulsion")
    >>> Craft(frozen_boat()).fly(case)["u"].shape[0] > 1
    True
    """

    def __init__(self, coefficients: Coefficients) -> None:
        self.coefficients = coefficients
        self.vehicle = coefficients.vehicle
        self._models: dict[Environment, Model] = {}
        self._assemblies: dict[Environment, Assembly] = {}
        self._waters: dict[tuple[str, ...], Water | None] = {}
        self._lock = RLock()

    def model(self, case: Case) -> Model:
        """The model in the water of a case; raises as ``sim.flight.simulate.equipped``."""
        environment = environment_of(case)
        with self._lock:
            if environment not in self._models:
                self._models[environment] = assemble(self.coefficients, environment)
        return equipped(case, self.vehicle, self._models[environment])

    def assembly(self, case: Case) -> Assembly:
        """From row values to models in the water of a case."""
        environment = environment_of(case)
        with self._lock:
            if environment not in self._assemblies:
                self._assemblies[environment] = Assembly(self.coefficients, environment)
            return self._assemblies[environment]

    def water(self, case: Case) -> Water | None:
        """Waves and surface of a case around the boat; raises as ``sim.flight.simulate.water_of``."""
        waves = case.waves.model_dump_json() if case.waves else ""
        key = (case.environment.model_dump_json(), waves, repr(case.run.step_s), repr(case.initial.speed_mps))
        with self._lock:
            if key not in self._waters:
                self._waters[key] = water_of(case, self.coefficients)
            return self._waters[key]

    def fly(self, case: Case) -> Simulation:
        """Fly a case; raises as ``model``, ``water`` and ``sim.flight.simulate.fly``."""
        return fly(case, self.vehicle, self.model(case), self.water(case))
