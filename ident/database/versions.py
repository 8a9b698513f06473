"""The coefficient database for a notebook: versions, coefficients with axes, differences, covariances."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from difflib import get_close_matches
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ident.database.arrays import coefficient_array, row_covariance
from ident.database.compare import Difference, compared
from ident.output import html_table
from sim.boat.database import Version, last_own, open_table, read_rows, versions

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

# What the commit of a version says, in the order it is listed.
_SAID = ("vehicle", "campaign", "digest", "parent", "program", "message")


@dataclass(frozen=True)
class DatabaseVersion:
    """One version of a database: every coefficient with its error and where it comes from.

    From ``Database(path)[number]``. Rows are read when they are first asked for. Coefficients
    are dimensionless, in the program frame: x forward, y starboard, z down.

    Attributes
    ----------
    path : Folder or object-store URL of the database.
    number : Version number.
    commit : What was committed: time stamp and metadata.
    history : Every commit of the database, oldest first.
    only : The vehicle it is narrowed to; empty for all.

    Examples
    --------
    >>> import ident
    >>> version = ident.Database("coeff_db")[-1]
    >>> version.vehicles
    ('my-boat',)
    >>> N_v = version["N_v"]
    >>> print(f"{N_v.item():.4f} +- {N_v.stderr.item():.4f}, {N_v.n_runs.item()} runs")
    -0.0100 +- 0.0001, 12 runs
    >>> version.rows[["coefficient", "value", "stderr", "runs"]].shape[1]
    4
    """

    path: str
    number: int
    commit: Version
    history: tuple[Version, ...] = field(repr=False)
    only: str = ""

    @property
    def digest(self) -> str:
        """Content digest (SHA-256) of the rows that the version wrote."""
        return self.commit.digest

    @property
    def metadata(self) -> dict[str, str]:
        """Everything stored with the commit, as text; lists and tables as JSON."""
        return self.commit.metadata

    @property
    def time(self) -> str:
        """When it was committed, ISO 8601, UTC."""
        return datetime.fromtimestamp(int(self.commit.timestamp) / 1000, UTC).isoformat(timespec="seconds")

    @cached_property
    def rows(self) -> pd.DataFrame:
        """One row a tabulated value; columns as ``coeff_db/README.md`` lists them.

        Raises
        ------
        InputError
            When the version cannot be read, or holds nothing of the vehicle it is narrowed to.
        """
        return read_rows(self.path, self.number, self.only or None)[0]

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles that have coefficients in this version."""
        return tuple(str(v) for v in self.rows["vehicle"].unique())

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Symbols of the coefficients, as in the term table."""
        return tuple(str(v) for v in self.rows["coefficient"].unique())

    def of(self, vehicle: str) -> DatabaseVersion:
        """The same version, one vehicle's coefficients only.

        Raises
        ------
        InputError
            When the version holds nothing of that vehicle.
        """
        one = DatabaseVersion(self.path, self.number, self.commit, self.history, vehicle)
        _ = one.rows
        return one

    def __contains__(self, coefficient: object) -> bool:
        return coefficient in self.coefficients

    def __getitem__(self, coefficient: str) -> xr.DataArray:
        """One coefficient over its axes, with error, runs and source of every value.

        Parameters
        ----------
        coefficient : Symbol, such as ``N_uvw``.

        Returns
        -------
        xarray.DataArray
            Dimensionless value. Dimensions are the axes by the name of their database column,
            which ends in the unit: ``speed_mps``, ``alpha_deg``, ``beta_deg``, ``delta_deg``,
            ``depth_m``; and ``part`` or ``vehicle`` where there is more than one. Coordinates of
            every value: ``stderr``, ``runs``, ``n_runs``, ``source``, ``quality``, ``origin``,
            ``calibration``, ``worst_residual``. A point without a value is NaN.

        Raises
        ------
        KeyError
            Naming those of like spelling, or else all there are.
        InputError
            When vehicles tabulate it over different axes; ``of`` chooses one.

        Examples
        --------
        >>> import ident
        >>> KT = ident.Database("coeff_db")[0]["KT"]
        >>> KT.dims, KT["J"].attrs["units"]
        (('J',), '1')
        >>> point = KT.sel(J=0.4)
        >>> round(point.item(), 3), point.runs.item(), point.source.item()
        (0.3, 'OW-0.4', 'computed (open_water.csv row 4)')
        """
        rows = self.rows[self.rows["coefficient"] == coefficient].reset_index(drop=True)
        if rows.empty:
            raise KeyError(self._without(coefficient))
        return coefficient_array(rows, coefficient, self._commits(rows))

    def _without(self, coefficient: str) -> str:
        near = get_close_matches(coefficient, self.coefficients, 3)
        of_whom = f"version {self.number} ({', '.join(self.vehicles)})"
        there = f"spelt like it: {', '.join(near)}" if near else f"it has {', '.join(self.coefficients)}"
        return f"no {coefficient} in {of_whom}; {there}"

    def _commits(self, rows: pd.DataFrame) -> dict[str, Version]:
        names = [str(v) for v in rows["vehicle"].unique()]
        return {v: last_own(list(self.history), v, self.number) or self.commit for v in names}

    def covariance(self, *coefficients: str) -> pd.DataFrame:
        """Covariance of the values of some coefficients, all of them when none is named.

        Parameters
        ----------
        coefficients : Symbols.

        Returns
        -------
        pandas.DataFrame
            (n, n), dimensionless; rows and columns are labelled by vehicle, coefficient, part
            and axes. Its diagonal is the square of ``stderr``.

        Raises
        ------
        KeyError
            For a coefficient that the version does not have.

        Examples
        --------
        >>> import ident
        >>> found = ident.Database("coeff_db")[0].covariance("N_v", "N_v|v|")
        >>> found.shape
        (2, 2)
        >>> bool(found.iloc[0, 1] < 0.0)
        True
        """
        for name in coefficients:
            if name not in self:
                raise KeyError(self._without(name))
        return row_covariance(self.rows, coefficients or self.coefficients)

    def diff(self, other: DatabaseVersion) -> Difference:
        """What changed from this version to another one.

        Parameters
        ----------
        other : Of this or another database.

        Returns
        -------
        Difference
            One entry a coefficient that differs.

        Examples
        --------
        >>> import ident
        >>> version = ident.Database("coeff_db")[0]
        >>> len(version.diff(version))
        0
        """
        return Difference(self.number, other.number, tuple(compared(self.rows, other.rows)))

    def to_dict(self) -> dict[str, Any]:
        """Number, time, vehicle, campaign, digest, parent, program and message, as ``ident versions`` lists them."""
        said = {k: self.metadata.get(k, "") for k in _SAID}
        said["parent"] = self._parent()
        if self.commit.operation:
            said["message"] = f"{self.commit.operation} by another program"
        return {"version": self.number, "time": self.time, **said}

    def _parent(self) -> str:
        """The parent that is named, unless it holds no rows of the vehicle: early releases named any."""
        named = self.metadata.get("parent", "")
        vehicle = self.metadata.get("vehicle", "")
        if vehicle and named.isdigit() and last_own(list(self.history), vehicle, int(named)) is None:
            return ""
        return named

    def __repr__(self) -> str:
        return f"DatabaseVersion({self.path}: version {self.number})"

    def _repr_html_(self) -> str:
        title = f"version {self.number} of {self.path}: {len(self.rows)} values of {', '.join(self.vehicles)}"
        groups = self.rows.groupby(["vehicle", "coefficient"], sort=False)
        rows = [
            (*key, len(g), f"{g['value'].min():.4g}", f"{g['value'].max():.4g}", f"{g['stderr'].median():.2g}")
            for key, g in groups
        ]
        return html_table(title, ("vehicle", "coefficient", "values", "least", "largest", "median s.e."), rows)


class Database:
    """A coefficient database: versions that never change, each from one fit or calibration.

    Parameters
    ----------
    path : Folder or object-store URL, as ``--db`` of the command line.

    Raises
    ------
    InputError
        When there is no database there.

    Examples
    --------
    >>> import ident
    >>> db = ident.Database("coeff_db")
    >>> db[0].commit.metadata["campaign"]
    'my-boat-tank'
    >>> db[-1].number == db.latest.number
    True
    >>> [version.number for version in db]
    [0]
    >>> db.table["campaign"].to_dict()
    {0: 'my-boat-tank'}
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = os.fspath(path)
        open_table(self.path)

    @property
    def versions(self) -> tuple[DatabaseVersion, ...]:
        """Every version, oldest first; read anew each time, others may have committed."""
        history = tuple(versions(self.path))
        return tuple(DatabaseVersion(self.path, v.number, v, history) for v in history)

    @property
    def table(self) -> pd.DataFrame:
        """The versions as a table, indexed by number: time, vehicle, campaign, digest, parent, program, message."""
        import pandas as pd

        columns = ["version", "time", *_SAID]
        return pd.DataFrame(self.to_dict(), columns=columns).set_index("version")

    @property
    def latest(self) -> DatabaseVersion:
        """The last version."""
        return self[-1]

    def __getitem__(self, number: int) -> DatabaseVersion:
        """One version by its number; -1 is the latest, -2 the one before.

        Raises
        ------
        InputError
            When there is no such version.
        """
        every = self.versions
        known = {v.number: v for v in every}
        if number < 0 and -number <= len(every):
            return every[number]
        if number not in known:
            # Says which versions there are.
            open_table(self.path, number)
        return known[number]

    def __iter__(self) -> Iterator[DatabaseVersion]:
        return iter(self.versions)

    def __len__(self) -> int:
        return len(self.versions)

    def to_dict(self) -> list[dict[str, Any]]:
        """``to_dict()`` of every version, as ``ident versions --json`` prints."""
        return [v.to_dict() for v in self.versions]

    def __repr__(self) -> str:
        return f"Database({self.path!r})"

    def _repr_html_(self) -> str:
        rows = self.to_dict()
        shown = [[str(v)[:16] if k == "digest" else v for k, v in row.items()] for row in rows]
        return html_table(f"database {self.path}", rows[0] if rows else (), shown)
