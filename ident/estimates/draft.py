"""Rows of a version while estimates change them: values, what is left of captive errors, shared errors.

An estimate has a few unknowns of its own (a factor, a drag coefficient), each with a standard
deviation. What one standard deviation of an unknown does to every value is a ``direction``; values
moved by the same direction share its error, so that the covariance of the version is

    S R S + sum_k d_k d_k^T

with S the captive errors as scaled, R their correlation, and d_k the directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sim.boat import catalogue
from sim.boat.database import ESTIMATED, NUMBERS, OPTIONAL, axis_columns, column_order, to_column
from sim.boat.parts import vehicle_terms
from sim.boat.row_codec import correlation_matrix, correlation_texts
from sim.boat.vehicle import Vehicle

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Significant digits that are stored. Estimates come of sums over a surface, whose last digits differ between
# processors: of some hundred values one was at a tie of the twelfth digit.
_DIGITS, _ESTIMATED_DIGITS = 12, 10


class NotApplicable(Exception):
    """An estimate has nothing to work from; the text says what is missing."""


@dataclass
class Draft:
    """Database rows under change.

    Attributes
    ----------
    vehicle : Whose rows.
    value : (n,) values as they stand.
    scale : (n,) what is left of each captive standard error.
    words : For each row, the estimates in force and what they did.
    directions : Unknown of an estimate -> (n,) change of the values by one standard deviation of it.
    names, parts : Coefficient and part of each row: as the runs gave them, then what estimates added.
    memo : What more than one estimate computes from the vehicle.
    """

    vehicle: Vehicle
    value: Array
    scale: Array
    words: list[list[str]]
    directions: dict[str, Array]
    names: list[str]
    parts: list[str]
    _joined: pd.DataFrame
    _numbers: int
    _added: list[dict[str, object]] = field(default_factory=list)
    memo: dict[str, object] = field(default_factory=dict)

    @classmethod
    def of(cls, vehicle: Vehicle, rows: pd.DataFrame) -> Draft:
        """A draft of rows that no estimate has touched."""
        first = rows.reset_index(drop=True)
        n = len(first)
        names, parts = first["coefficient"].tolist(), first["part"].tolist()
        value = first["value"].to_numpy(float).copy()
        numbers = int(first["estimate"].max()) + 1 if n else 0
        return cls(vehicle, value, np.ones(n), [[] for _ in range(n)], {}, names, parts, first, numbers)

    @property
    def rows(self) -> pd.DataFrame:
        """The rows; those added since they were last asked for are joined to them at once."""
        if self._added:
            table = pd.DataFrame(self._added).reindex(columns=self._joined.columns)
            table = table.astype({c: t for c, t in self._joined.dtypes.items() if t.kind in "fi"})
            self._joined, self._added = pd.concat([self._joined, table], ignore_index=True), []
        return self._joined

    # -- which rows -------------------------------------------------------------------------

    def where(self, terms: Sequence[str], parts: Sequence[str] = ("*",)) -> Mask:
        """(n,) True where coefficient and part match any of the shell patterns."""
        return _matching(self.names, terms) & _matching(self.parts, parts)

    def has(self, *terms: str) -> bool:
        """Whether any of the coefficients has a row."""
        return not set(terms).isdisjoint(self.names)

    def axis(self, name: str) -> Array:
        """(n,) values along an axis as the database holds them (deg or SI); NaN where a row has none."""
        return self.rows[catalogue.axes()[name].column].to_numpy(dtype=float)

    # -- what is done to them ----------------------------------------------------------------

    def multiply(
        self, chosen: Mask, factor: float, sigma: float, unknown: str, word: str, kept: Array | None = None
    ) -> None:
        """Multiply values, their captive errors and their directions; the factor's error is shared.

        Parameters
        ----------
        chosen : (n,) rows.
        factor, sigma : The factor and its standard deviation.
        unknown : Whose error the factor's is.
        word : What the column ``estimated_by`` says.
        kept : (n,) part of each value that the factor does not act on; none by default.
        """
        still = np.zeros(len(self.value)) if kept is None else kept
        base = np.where(chosen, self.value - still, 0.0)
        for direction in self.directions.values():
            direction[chosen] *= factor
        self.value[chosen] = still[chosen] + factor * base[chosen]
        self.scale[chosen] *= factor
        self._move(unknown, base * sigma)
        self._say(chosen, word)

    def replace(self, chosen: Mask, value: Array, word: str) -> None:
        """Put values in the place of others, whose captive errors and directions go with them.

        Parameters
        ----------
        chosen : (n,) rows.
        value : (n,) new values; those of other rows are not read.
        """
        self.value[chosen] = value[chosen]
        self.scale[chosen] = 0.0
        for direction in self.directions.values():
            direction[chosen] = 0.0
        self._say(chosen, word)

    def shift(self, chosen: Mask, change: Array, word: str) -> None:
        """Add (n,) changes to the values; their captive errors stay."""
        self.value[chosen] += change[chosen]
        self._say(chosen, word)

    def spread(self, unknown: str, change: Array) -> None:
        """One standard deviation of an unknown changes the values by (n,) ``change``."""
        self._move(unknown, np.asarray(change, dtype=float))

    def add(self, term: str, points: Sequence[dict[str, float]], values: Sequence[float], word: str) -> Mask:
        """Rows of a term that no run identifies.

        Parameters
        ----------
        term : Symbol in the vehicle's term set, of a part other than a plane or section.
        points : Axis name -> value in radians or SI, one a row.
        values : One a row.
        word : What the column ``estimated_by`` says.

        Returns
        -------
        (n,) True at the new rows, n with them.
        """
        row_of = {t.name: t for t in vehicle_terms(self.vehicle)}
        if term not in row_of:
            raise NotApplicable(f"the term set of {self.vehicle.name} has no {term}")
        known = row_of[term]
        columns = {axis: column for column, axis in axis_columns().items()}
        first = self._numbers
        new: list[dict[str, object]] = []
        for i, (point, value) in enumerate(zip(points, values, strict=True)):
            place = {columns[a]: to_column(columns[a], point[a]) for a in known.axes}
            new.append(
                {
                    **dict.fromkeys(("quality", "calibration", "correlation", "measured_correlation", "runs"), ""),
                    **{"vehicle": self.vehicle.name, "coefficient": term, "part": known.part, "output": known.output},
                    **place,
                    **{"value": value, "stderr": 0.0, "worst_residual": 0.0, "n_runs": 0},
                    **{"origin": ESTIMATED, "estimated_by": "", "estimate": first + i},
                    "extrapolation": " ".join(f"{a}:{r}" for a, r in known.extrapolation.items()),
                    "equation": known.equation,
                }
            )
        count = len(new)
        self._added += new
        self._numbers += count
        self.names += [term] * count
        self.parts += [known.part] * count
        self.value = np.concatenate([self.value, np.asarray(values, dtype=float)])
        self.scale = np.concatenate([self.scale, np.zeros(count)])
        self.words += [[word] for _ in range(count)]
        self.directions = {k: np.concatenate([d, np.zeros(count)]) for k, d in self.directions.items()}
        return np.arange(len(self.value)) >= len(self.value) - count

    def _move(self, unknown: str, change: Array) -> None:
        if np.any(change):
            self.directions[unknown] = self.directions.get(unknown, np.zeros(len(self.value))) + change

    def _say(self, chosen: Mask, word: str) -> None:
        for i in np.flatnonzero(chosen).tolist():
            self.words[i].append(word)

    # -- the version ---------------------------------------------------------------------------

    def finished(self) -> pd.DataFrame:
        """The rows of the predicted version, columns as ``sim.boat.database.column_order``."""
        out = self.rows.copy()
        added = out["origin"].eq(ESTIMATED).to_numpy()
        out["measured_value"] = np.where(added, np.nan, out["value"])
        out["measured_stderr"] = np.where(added, np.nan, out["stderr"])
        out["measured_correlation"] = np.where(added, "", out["correlation"])
        out["value"] = self.value
        out["estimated_by"] = ["; ".join(words) for words in self.words]
        first, matrix = correlation_matrix(self.rows)
        place = {int(e): i for i, e in reversed(list(enumerate(self.rows["estimate"])))}
        at = np.array([place[int(e)] for e in first["estimate"]])
        captive = self.scale[at] * first["stderr"].to_numpy()
        total = np.outer(captive, captive) * matrix
        for direction in self.directions.values():
            # An unknown moves a part of the values only.
            moved = np.flatnonzero(direction[at])
            change = direction[at[moved]]
            total[np.ix_(moved, moved)] += np.outer(change, change)
        return with_covariance(out, list(first["estimate"]), total)


def _matching(names: Sequence[str], patterns: Sequence[str]) -> Mask:
    """(n,) True where a name matches any of the shell patterns; each name is looked at once."""
    fits = {n: any(fnmatchcase(n, p) for p in patterns) for n in set(names)}
    return np.array([fits[n] for n in names], dtype=bool)


def with_covariance(rows: pd.DataFrame, numbers: Sequence[int], total: Array) -> pd.DataFrame:
    """Rows with standard errors and correlations of a covariance, in the digits that are stored.

    Parameters
    ----------
    rows : Database rows with their values.
    numbers : (k,) estimates, in the order of ``total``.
    total : (k, k) covariance of the estimates.
    """
    out = rows.copy()
    deviation = np.sqrt(np.clip(np.diag(total), 0.0, None))
    place = {int(e): i for i, e in enumerate(numbers)}
    text = correlation_texts(total, [int(e) for e in numbers])
    where = np.array([place.get(int(e), -1) for e in out["estimate"]])
    out.loc[where >= 0, "stderr"] = deviation[where[where >= 0]]
    out["correlation"] = [text.get(int(e), "") for e in out["estimate"]]
    touched = out["estimated_by"].ne("").tolist()
    for column in (*NUMBERS, *OPTIONAL):
        fewer = [t and column not in OPTIONAL for t in touched]
        out[column] = [_stored(x, _ESTIMATED_DIGITS if f else _DIGITS) for x, f in zip(out[column], fewer, strict=True)]
    return out[column_order()]


def _stored(x: float, digits: int) -> float:
    return x if np.isnan(x) else float(f"{x:.{digits}g}")


def measured_rows(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that the runs alone gave, as ``ident fit --measured-only`` writes them, from a predicted version."""
    known = rows[~rows["origin"].eq(ESTIMATED)].reset_index(drop=True)
    given = known["measured_value"].notna()
    return known.assign(
        value=known["value"].where(~given, known["measured_value"]),
        stderr=known["stderr"].where(~given, known["measured_stderr"]),
        correlation=known["correlation"].where(~given, known["measured_correlation"]),
        measured_value=np.nan,
        measured_stderr=np.nan,
        measured_correlation="",
        estimated_by="",
    )
