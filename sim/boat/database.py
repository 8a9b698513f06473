"""The contract between identification and simulation: rows of the coefficient database.

One tidy row a tabulated value. The axis columns come from the term table, so the schema
has no list of its own. A version is one commit of a Delta Lake table.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sim.boat import catalogue
from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

# Columns beside the axes, with their meaning.
COLUMNS = {
    "vehicle": "vehicle name",
    "coefficient": "symbol in the term table",
    "part": "part of the boat that carries the load",
    "output": "load component, X Y Z K M N, empty for t and w_T",
    "value": "prime (dimensionless) coefficient, program frame",
    "stderr": "standard error of the value",
    "n_runs": "number of runs behind the value",
    "quality": "worst quality word among those runs",
    "origin": "measured, published (given as a coefficient), mirror (port/starboard image) or symmetry (zero by it)",
    "calibration": "group=multiplier of every calibration in force, empty for captive values",
    "estimate": "values with the same number are one estimate",
    "correlation": "estimate:coefficient of every estimate whose error is correlated with this one's",
    "worst_residual": "largest disagreement among the runs, in standard errors",
    "extrapolation": "rule beyond the data, axis by axis",
    "equation": "equations of the source",
    "runs": "run ids behind the value",
}
# How often a history that a commit overtook is read again.
_LOOKS = 5
NUMBERS = ("value", "stderr", "worst_residual")
COUNTS = ("n_runs", "estimate")


def axis_columns() -> dict[str, str]:
    """Database column -> axis name, in the order of the axes table."""
    return {a.column: name for name, a in catalogue.axes().items()}


def from_column(column: str, value: float) -> float:
    """Axis value of a database column in radians or SI."""
    return math.radians(value) if column.endswith("_deg") else value


def to_column(column: str, value: float) -> float:
    """Database value of an axis value in radians or SI."""
    return float(f"{math.degrees(value):.10g}") if column.endswith("_deg") else value


def correlation_pairs(text: str) -> dict[int, float]:
    """The ``correlation`` cell: estimate number -> correlation coefficient."""
    return {int(k): float(v) for k, v in (item.split(":") for item in text.split())}


def column_order() -> list[str]:
    """All columns in the order they are stored."""
    first = ["vehicle", "coefficient", "part", "output"]
    return [*first, *axis_columns(), *[c for c in COLUMNS if c not in first]]


def version_words(database: Mapping[str, Any]) -> str:
    """Version and digest for people, from the ``version`` and ``digest`` of a result."""
    return f"database version {database['version']} ({database['digest'][:16]})"


@dataclass(frozen=True)
class Version:
    """One commit of the database."""

    number: int
    timestamp: str
    metadata: dict[str, str]

    @property
    def digest(self) -> str:
        """Content digest of the version's rows."""
        return self.metadata.get("digest", "")


def brief(error: Exception) -> str:
    """What the storage engine says, in one line and without its own trace."""
    lines = str(error).split("   0: ")[0].splitlines()
    return " ".join(line.strip(" \t↳") for line in lines if line.strip())[:300]


def open_table(path: str, version: int | None = None) -> Any:
    """The Delta table at ``path``, at a version.

    Raises
    ------
    InputError
        When there is no database there, or no such version.
    """
    from deltalake import DeltaTable
    from deltalake.exceptions import DeltaError, TableNotFoundError

    local = Path(path)
    if "://" not in path and not (local / "_delta_log").is_dir():
        found = "a file" if local.is_file() else "no coefficient database"
        raise InputError(path, found, "a database written by `ident fit`; choose it with --db")
    try:
        table = DeltaTable(path)
    except (TableNotFoundError, DeltaError, OSError) as error:
        raise InputError(
            path, f"not a coefficient database: {brief(error)}", "a database written by `ident fit`"
        ) from error
    latest = table.version()
    if version is not None:
        if not 0 <= version <= latest:
            raise InputError(path, f"version {version} does not exist", f"0 to {latest}; see `ident versions`")
        table.load_as_version(version)
    return table


def read_rows(path: str, version: int | None = None, vehicle: str | None = None) -> tuple[pd.DataFrame, int]:
    """Rows of one version and its number.

    Parameters
    ----------
    path : Folder or object-store URL of the database.
    version : Version number, latest when None.
    vehicle : Keep only this vehicle's rows.

    Raises
    ------
    InputError
        When database, version or vehicle do not exist.
    """
    from deltalake.exceptions import DeltaError

    table = open_table(path, version)
    # A version written before an axis existed has no column for it.
    try:
        rows = table.to_pyarrow_table().to_pandas().reindex(columns=column_order())
    except (OSError, DeltaError) as error:
        raise InputError(
            path, f"version {table.version()} cannot be read: {brief(error)}", "all files of the version"
        ) from error
    if vehicle is not None:
        known = sorted(rows["vehicle"].unique())
        rows = rows[rows["vehicle"] == vehicle]
        if rows.empty:
            raise InputError(path, f"no coefficients of vehicle {vehicle!r}", ", ".join(known))
    order = ["vehicle", "coefficient", "part", *axis_columns()]
    return rows.sort_values(order, kind="stable").reset_index(drop=True), int(table.version())


def versions(path: str) -> list[Version]:
    """Every version of a database, oldest first. Raises ``InputError`` when there is none."""
    entries: list[dict[str, Any]] = []
    for _ in range(_LOOKS):
        table = open_table(path)
        entries = table.history()
        # A commit between the two calls shifts the numbers of the history.
        if entries and max(int(e["version"]) for e in entries) == table.version() >= 0:
            break
    found = []
    for entry in entries:
        metadata = {k: str(v) for k, v in entry.items() if k not in ("version", "timestamp")}
        stamp = entry.get("timestamp", "")
        found.append(Version(int(entry["version"]), str(stamp), metadata))
    return sorted(found, key=lambda v: v.number)


def find_version(path: str, number: int | None = None) -> Version:
    """One version of a database, the latest when ``number`` is None.

    Raises
    ------
    InputError
        When there is no database there, or no such version.
    """
    number = int(open_table(path, number).version())
    return next(v for v in versions(path) if v.number == number)


def own_version(path: str, vehicle: str, number: int) -> Version:
    """The commit that wrote a vehicle's rows of version ``number``: others may have come later.

    Parameters
    ----------
    path : Folder or object-store URL of the database.
    vehicle : Vehicle name.
    number : Version that holds the rows.

    Raises
    ------
    InputError
        When there is no such version.
    """
    open_table(path, number)
    history = versions(path)
    up_to = [v for v in history if v.number <= number]
    return last_own(history, vehicle, number) or (up_to or [Version(number, "", {})])[-1]


def last_own(history: list[Version], vehicle: str, number: int) -> Version | None:
    """The last commit of a vehicle's rows up to version ``number``, of a history oldest first."""
    own = [v for v in history if v.number <= number and v.metadata.get("vehicle", vehicle) == vehicle]
    return own[-1] if own else None
