"""A vehicle's coefficients as tables, from database rows."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.boat.catalogue import Term
from sim.boat.database import axis_columns, from_column
from sim.boat.parts import parts_of, vehicle_terms
from sim.boat.tables import Table
from sim.boat.vehicle import Vehicle
from sim.files.columns import places_of
from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
_SAME_BOAT = "the term set, planes and sections that the database's coefficients are of"


@dataclass(frozen=True)
class Coefficient:
    """One tabulated coefficient of one part, with the values at its measured points."""

    term: Term
    part: str
    table: Table
    values: Array

    def at(self, x: list[float]) -> float:
        """Value at a state, axis values in radians or SI."""
        return float(self.table.weights(x) @ self.values)


class Coefficients:
    """All coefficients of a vehicle.

    Parameters
    ----------
    vehicle : Decides the term set and the parts.
    rows : Database rows of this vehicle, in any order.

    Raises
    ------
    InputError
        When a row names a coefficient that the vehicle's term set does not have, or a part that it does not have.

    Attributes
    ----------
    places : (symbol, part) -> places of its values among the rows.
    """

    def __init__(self, vehicle: Vehicle, rows: pd.DataFrame) -> None:
        self.vehicle = vehicle
        self.places: dict[tuple[str, str], NDArray[np.int64]] = {}
        columns = {axis: column for column, axis in axis_columns().items()}
        known, parts = {t.name: t for t in vehicle_terms(vehicle)}, vehicle.part_names()
        self._all: dict[tuple[str, str], Coefficient] = {}
        values = rows["value"].to_numpy(dtype=float)
        at: dict[str, Array] = {}
        symbols = zip(rows["coefficient"].tolist(), rows["part"].tolist(), strict=True)
        for (name, part), group in places_of(symbols).items():
            if name not in known:
                raise InputError(
                    f"vehicle {vehicle.name}", f"coefficient {name!r} is not a term of its set", _SAME_BOAT
                )
            if part not in parts:
                text = f"coefficients of {part!r}, which is none of its parts: {', '.join(parts)}"
                raise InputError(f"vehicle {vehicle.name}", text, _SAME_BOAT)
            term = known[name]
            points = np.empty((len(group), len(term.axes)))
            for k, column in enumerate(columns[a] for a in term.axes):
                if column not in at:
                    at[column] = np.array([from_column(column, x) for x in rows[column].to_numpy(dtype=float).tolist()])
                points[:, k] = at[column][group]
            rules = tuple(term.extrapolation[a] for a in term.axes)
            self.places[name, part] = group
            self._all[name, part] = Coefficient(term, part, Table(term.axes, rules, points), values[group])

    def __iter__(self) -> Iterator[Coefficient]:
        return iter(self._all.values())

    def with_values(self, values: Array) -> Coefficients:
        """The same tables with other values.

        Parameters
        ----------
        values : One value a database row, in the order of the rows this was made from.
        """
        other = copy(self)
        other._all = {k: replace(c, values=values[self.places[k]]) for k, c in self._all.items()}
        return other

    def get(self, name: str, part: str | None = None) -> Coefficient | None:
        """A coefficient by symbol (and part, for sections), or None when it is absent."""
        if part is not None:
            return self._all.get((name, part))
        return next((c for (n, _), c in self._all.items() if n == name), None)

    def absent(self) -> list[tuple[Term, str]]:
        """Terms of the vehicle's set that no data support."""
        wanted = [(t, p) for t in vehicle_terms(self.vehicle) for p in parts_of(t, self.vehicle)]
        return [(t, p) for t, p in wanted if (t.name, p) not in self._all]
