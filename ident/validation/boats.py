"""What is flown from a database version: rows read once, every vehicle assembled once."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from threading import RLock
from typing import TYPE_CHECKING

from ident.validation.essentials import refuse_without_essentials
from sim.boat.coefficients import Coefficients
from sim.boat.database import Version, last_own, read_rows, versions
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError
from sim.flight.case import Case
from sim.flight.craft import Craft
from sim.kernel.layout import Model
from sim.waves.in_waves import Water

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Boat:
    """One vehicle with the coefficients of one version.

    Attributes
    ----------
    vehicle : From its file.
    rows : Its database rows.
    commit : The commit that wrote them.
    coefficients : The rows as tables.
    """

    vehicle: Vehicle
    rows: pd.DataFrame
    commit: Version
    coefficients: Coefficients

    @cached_property
    def craft(self) -> Craft:
        """The boat ready for any case."""
        return Craft(self.coefficients)

    def __reduce__(self) -> tuple[type[Boat], tuple[Vehicle, pd.DataFrame, Version, Coefficients]]:
        # Into another process without its lock; models are assembled again where they are needed.
        return type(self), (self.vehicle, self.rows, self.commit, self.coefficients)

    def model(self, case: Case) -> Model:
        """The model in the water of a case; raises as ``sim.flight.craft.Craft.model``."""
        return self.craft.model(case)

    def water(self, case: Case) -> Water | None:
        """Waves and surface of a case around the boat; raises as ``sim.flight.craft.Craft.water``."""
        return self.craft.water(case)


def _has_estimates(boat: Boat) -> bool:
    return bool(boat.rows["measured_value"].notna().any())


class Fleet:
    """Every vehicle of a database version, and of the versions it came from.

    May be shared by threads.

    Parameters
    ----------
    db : Database path or URL.
    version : Version number, latest when None.
    left_out : Terms and estimates that the version is flown without.

    Raises
    ------
    InputError
        When there is no database there, or no such version.
    """

    def __init__(self, db: str, version: int | None = None, left_out: Collection[str] = ()) -> None:
        self.db = db
        self.left_out = left_out
        everything, self.number = read_rows(db, version)
        self._rows = {self.number: everything}
        self._boats: dict[tuple[int, str], Boat] = {}
        self._lock = RLock()

    @cached_property
    def _history(self) -> list[Version]:
        return versions(self.db)

    @property
    def record(self) -> Version:
        """The commit of the version itself."""
        return next(v for v in self._history if v.number == self.number)

    @property
    def vehicles(self) -> set[str]:
        """Names of the vehicles the version holds."""
        return {str(v) for v in self._rows[self.number]["vehicle"].unique()}

    def boat(self, vehicle: Vehicle) -> Boat:
        """A vehicle with the coefficients of the version.

        Raises
        ------
        InputError
            When the version has no coefficients of the vehicle.
        sim.boat.catalogue.CatalogueError
            When it has some that the vehicle's term set does not.
        """
        return self._boat(vehicle, self.number)

    def parent(self, vehicle: Vehicle) -> Boat | None:
        """The vehicle with the coefficients that its own came from; None when they are the first.

        The commit names its parent; of a calibrated version that is the captive-only one.
        """
        named = self.boat(vehicle).commit.metadata.get("parent", "")
        if not named.isdigit():
            return None
        commit = last_own(self._history, vehicle.name, int(named))
        return self._boat(vehicle, commit.number) if commit else None

    def measured(self, vehicle: Vehicle) -> Boat | None:
        """The vehicle with what the runs alone gave, from the version or its parent; None without estimates."""
        source = next((b for b in (self.boat(vehicle), self.parent(vehicle)) if b and _has_estimates(b)), None)
        if source is None:
            return None
        key = (-1, vehicle.model_dump_json())
        with self._lock:
            if key not in self._boats:
                from ident.estimates.draft import measured_rows

                rows = measured_rows(source.rows)
                self._boats[key] = Boat(vehicle, rows, source.commit, Coefficients(vehicle, rows))
            return self._boats[key]

    def _boat(self, vehicle: Vehicle, number: int) -> Boat:
        # A vehicle file may change its numbers and keep its name.
        key = (number, vehicle.model_dump_json())
        with self._lock:
            if key not in self._boats:
                if number not in self._rows:
                    self._rows[number] = read_rows(self.db, number)[0]
                every = self._rows[number]
                rows = every[every["vehicle"] == vehicle.name].reset_index(drop=True)
                if rows.empty:
                    known = ", ".join(sorted(every["vehicle"].unique()))
                    raise InputError(self.db, f"no coefficients of vehicle {vehicle.name!r}", known)
                commit = last_own(self._history, vehicle.name, number) or self.record
                refuse_without_essentials(vehicle, rows, commit.metadata, self.db)
                if self.left_out and number == self.number:
                    from ident.estimates.ablation import without

                    rows = without(vehicle, rows, commit, self.left_out, "--without")
                self._boats[key] = Boat(vehicle, rows, commit, Coefficients(vehicle, rows))
            return self._boats[key]
