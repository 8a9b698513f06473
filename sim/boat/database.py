"""The contract between identification and simulation: rows of the coefficient database.

One tidy row a tabulated value. The axis columns come from the term table, so the schema
has no list of its own. A version is one commit of a Delta Lake table.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sim.boat import catalogue, row_codec
from sim.boat.delta_log import OURS, WHOLE, Log, Version
from sim.files.errors import InputError
from sim.files.storage import address, engine

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
    "origin": (
        "measured, published (given as a coefficient), mirror (port/starboard image), symmetry (zero by it) "
        "or estimated (no run behind it)"
    ),
    "estimated_by": "estimates in force, with what each does to the value; empty for what the runs alone give",
    "measured_value": "value that the runs alone give, before estimates and calibration; empty without estimates",
    "measured_stderr": "standard error of that value; empty without estimates",
    "measured_correlation": "correlations of that value, as in correlation; empty without estimates",
    "calibration": "group=multiplier of every calibration in force, empty for captive values",
    "estimate": "values with the same number are one estimate",
    "correlation": "estimate:coefficient of every estimate whose error is correlated with this one's",
    "worst_residual": "largest disagreement among the runs, in standard errors",
    "extrapolation": "rule beyond the data, axis by axis",
    "equation": "equations of the source",
    "runs": "run ids behind the value",
}
NUMBERS = ("value", "stderr", "worst_residual")
# Numbers that may be empty, as those of the axes.
OPTIONAL = ("measured_value", "measured_stderr")
# Columns that the first schema did not have: an unused one leaves the digest of a version as it was.
_LATER = ("estimated_by", "measured_value", "measured_stderr", "measured_correlation")
ESTIMATED = "estimated"
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


def column_order() -> list[str]:
    """All columns in the order they are stored."""
    first = ["vehicle", "coefficient", "part", "output"]
    return [*first, *axis_columns(), *[c for c in COLUMNS if c not in first]]


def later_columns() -> list[str]:
    """Columns that came after the first schema, in the order they are stored."""
    since = {a.column for a in catalogue.axes().values() if a.since > 1}
    return [c for c in column_order() if c in since or c in _LATER]


def version_words(database: Mapping[str, Any]) -> str:
    """Version and digest for people, from the ``version`` and ``digest`` of a result."""
    return f"database version {database['version']} ({database['digest'][:16]})"


def open_table(path: str, version: int | None = None, log: Log | None = None) -> Any:
    """The Delta table at ``path``, at a version.

    Parameters
    ----------
    path : Folder or object-store URL of the database.
    version : Version number, latest when None.
    log : Its log, when it has been read already.

    Raises
    ------
    InputError
        When there is no database there, or no such version.
    """
    from deltalake import DeltaTable

    log = log or Log(path)
    number = log.last if version is None else version
    if not 0 <= number <= log.last:
        raise InputError(path, f"version {number} does not exist", f"0 to {log.last}; see `ident versions`")
    if number < log.first:
        text = f"version {number} is gone: the log begins at version {log.first}"
        raise InputError(path, text, f"{log.first} to {log.last}; see `ident versions`")
    try:
        with engine(path, "not a coefficient database", OURS):
            table = DeltaTable(address(path), version=number)
            stored = {f.name: str(f.type) for f in _schema(table)}
    except InputError:
        # An entry that is damaged is named; the engine does not say which.
        _ = log.versions
        raise
    log.entry(number)
    check_columns(path, stored)
    return table


def _schema(table: Any) -> Any:
    import pyarrow as pa

    return pa.schema(table.schema().to_arrow())


def check_columns(path: str, stored: Mapping[str, str]) -> None:
    """Refuse a table whose columns are not those of a coefficient database.

    Parameters
    ----------
    path : Where the table is.
    stored : Column -> type, as pyarrow names it. Axes may be missing: they came later.

    Raises
    ------
    InputError
        For columns that are missing, unknown or of another type.
    """
    missing = [c for c in COLUMNS if c not in stored and c not in _LATER]
    if missing:
        raise InputError(path, f"not a coefficient database: no columns {', '.join(missing[:3])} ...", OURS)
    unknown = [c for c in stored if c not in column_order()]
    if unknown:
        text = f"columns that this program does not know: {', '.join(map(repr, unknown))}"
        raise InputError(path, text, f"{OURS} of this release or an earlier one")
    for column, kind in stored.items():
        if kind != column_type(column):
            raise InputError(path, f"column {column} holds {kind}", column_type(column))


def column_type(column: str) -> str:
    """Type of a column, as pyarrow names it."""
    number = column in NUMBERS or column in OPTIONAL or column in axis_columns()
    return "double" if number else "int64" if column in COUNTS else "string"


def digest(rows: pd.DataFrame, columns: Sequence[str] | None = None) -> str:
    """SHA-256 of the content of database rows, independent of their order and of later columns they do not use.

    Parameters
    ----------
    rows : Rows of one vehicle.
    columns : Columns that count, in order; those of this program when None.
    """
    unused = {c for c in later_columns() if rows[c].isna().all() or rows[c].astype(str).eq("").all()}
    return row_codec.digest(rows, [c for c in (column_order() if columns is None else columns) if c not in unused])


def read_rows(path: str, version: int | None = None, vehicle: str | None = None) -> tuple[pd.DataFrame, int]:
    """Rows of one version and its number, each vehicle's checked against the digest of its commit.

    Parameters
    ----------
    path : Folder or object-store URL of the database.
    version : Version number, latest when None.
    vehicle : Keep only this vehicle's rows.

    Raises
    ------
    InputError
        When database, version or vehicle do not exist, or the rows are not those that were committed.
    """
    log = Log(path)
    number = log.last if version is None else version
    everything = stored_rows(log, number)
    if vehicle is not None and vehicle not in vehicles_of(log, number, everything):
        known = ", ".join(vehicles_of(log, number, everything))
        raise InputError(path, f"no coefficients of vehicle {vehicle!r}", known)
    check_digests(log, number, everything, vehicle)
    rows = everything if vehicle is None else everything[everything["vehicle"] == vehicle]
    order = ["vehicle", "coefficient", "part", *axis_columns()]
    return rows.sort_values(order, kind="stable").reset_index(drop=True), number


def whole_version(log: Log, number: int) -> dict[str, str]:
    """Vehicle -> digest of a version, every row of it read and checked. Raises as ``read_rows``."""
    return check_digests(log, number, stored_rows(log, number))


def vehicles_of(log: Log, number: int, everything: pd.DataFrame) -> list[str]:
    """Vehicles that a version holds or should hold."""
    expected = (name for name in log.contents(number)[0] if name)
    return sorted({*everything["vehicle"].unique(), *expected})


def check_digests(log: Log, number: int, everything: pd.DataFrame, vehicle: str | None = None) -> dict[str, str]:
    """Refuse rows that are not those that were committed.

    Parameters
    ----------
    log, number : Version.
    everything : Its rows, from ``stored_rows``.
    vehicle : Whose rows to check; every vehicle's when None.

    Returns
    -------
    Vehicle -> digest.

    Raises
    ------
    InputError
        When the rows of a vehicle have another digest than its commit, or no commit vouches for them.
    """
    expected, complete = log.contents(number)
    where = f"{log.path}, version {number}"
    digests: dict[str, str] = {}
    for name in vehicles_of(log, number, everything) if vehicle is None else [vehicle]:
        # A commit of early releases does not name its vehicle.
        wanted = expected.get(name, expected.get("", ""))
        if not wanted:
            text = f"rows of {name!r} that no commit of `ident fit` vouches for"
            raise InputError(where, text if complete else f"{text}: the log begins at version {log.first}", WHOLE)
        if not matches(log, number, everything[everything["vehicle"] == name], wanted):
            text = f"rows of {name!r} are not those that were committed (digest {wanted[:16]})"
            raise InputError(where, text, WHOLE)
        digests[name] = wanted
    return digests


def stored_rows(log: Log, number: int) -> pd.DataFrame:
    """Rows of one version as they are stored, not checked. Raises ``InputError`` when they cannot be read."""
    table = open_table(log.path, number, log)
    with engine(f"{log.path}, version {number}", "cannot be read", WHOLE):
        # A version written before an axis existed has no column for it.
        rows = table.to_pyarrow_table().to_pandas().reindex(columns=column_order())
    for column in ("estimated_by", "measured_correlation"):
        rows[column] = rows[column].fillna("").astype(str)
    if rows["vehicle"].isna().any():
        raise InputError(f"{log.path}, version {number}", "rows without a vehicle", WHOLE)
    return rows


def matches(log: Log, number: int, rows: pd.DataFrame, wanted: str) -> bool:
    """Whether rows of one vehicle in a version have a digest."""
    return any(digest(rows, columns) == wanted for columns in _columns_of_the_time(log, number))


def _columns_of_the_time(log: Log, number: int) -> Iterator[list[str]]:
    """The columns a digest may be of: those of this program, and those the table had before axes were added."""
    order = column_order()
    yield order
    seen = {tuple(order)}
    for k in range(number, log.first - 1, -1):
        columns = tuple(c for c in order if c in log.entry(k).columns)
        if columns and columns not in seen:
            seen.add(columns)
            yield list(columns)


def versions(path: str) -> list[Version]:
    """Every version of a database, oldest first. Raises ``InputError`` when there is none, or it is damaged."""
    log = Log(path)
    open_table(path, log.last, log)
    return log.versions


def find_version(path: str, number: int | None = None) -> Version:
    """One version of a database, the latest when ``number`` is None.

    Raises
    ------
    InputError
        When there is no database there, or no such version.
    """
    log = Log(path)
    open_table(path, number, log)
    return log.entry(log.last if number is None else number).version


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
    log = Log(path)
    open_table(path, number, log)
    return last_own(log.versions, vehicle, number) or log.entry(number).version


def last_own(history: list[Version], vehicle: str, number: int) -> Version | None:
    """The last commit of a vehicle's rows up to version ``number``, of a history oldest first."""
    commits = [v for v in history if v.number <= number and v.digest and v.metadata.get("vehicle", vehicle) == vehicle]
    return commits[-1] if commits else None
