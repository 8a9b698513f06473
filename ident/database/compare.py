"""Differences between database versions, and export."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.output import file_at, html_table, whole
from sim.boat.database import axis_columns, last_own, read_rows, versions

if TYPE_CHECKING:
    import pandas as pd


def _indexed(rows: pd.DataFrame) -> pd.DataFrame:
    keys = ["vehicle", "coefficient", "part", *axis_columns()]
    return rows.set_index(keys)[["value", "stderr"]]


@dataclass(frozen=True)
class Change:
    """What changed in one coefficient.

    Attributes
    ----------
    vehicle, coefficient : Which.
    added, removed, changed : Numbers of tabulated values.
    largest_relative_change : Over the largest value that the coefficient had.
    largest_change_in_stderr : In standard errors, the larger of the two versions'.

    Examples
    --------
    >>> from ident import Change
    >>> Change("my-boat", "N_v", 0, 0, 1, 0.02, 1.5).to_dict()["changed"]
    1
    """

    vehicle: str
    coefficient: str
    added: int
    removed: int
    changed: int
    largest_relative_change: float
    largest_change_in_stderr: float

    def to_dict(self) -> dict[str, Any]:
        """The change for a program to read."""
        return asdict(self)


@dataclass(frozen=True)
class Difference:
    """What changed between two versions, one entry a coefficient that differs.

    Attributes
    ----------
    first, second : Version numbers.
    changes : In the order of the coefficients.

    Examples
    --------
    >>> import ident
    >>> db = ident.Database("coeff_db")
    >>> db[0].diff(db[-1]).table.empty
    True
    """

    first: int
    second: int
    changes: tuple[Change, ...]

    def __len__(self) -> int:
        return len(self.changes)

    def __iter__(self) -> Iterator[Change]:
        return iter(self.changes)

    @property
    def table(self) -> pd.DataFrame:
        """The changes as a table, indexed by vehicle and coefficient."""
        import pandas as pd

        columns = [f.name for f in fields(Change)]
        return pd.DataFrame(self.to_dict(), columns=columns).set_index(columns[:2])

    def to_dict(self) -> list[dict[str, Any]]:
        """The changes for a program to read."""
        return [one.to_dict() for one in self.changes]

    def _repr_html_(self) -> str:
        rows = [
            [c.vehicle, c.coefficient, c.added, c.removed, c.changed, share, f"{c.largest_change_in_stderr:.2f}"]
            for c in self.changes
            for share in [f"{100 * c.largest_relative_change:.3g} %"]
        ]
        header = ("vehicle", "coefficient", "added", "removed", "changed", "largest change", "in standard errors")
        return html_table(f"version {self.first} to {self.second}", header, rows)


def compared(first: pd.DataFrame, second: pd.DataFrame) -> list[Change]:
    """What changed from database rows to others, one entry a coefficient that differs."""
    old, new = _indexed(first), _indexed(second)
    both = old.add_suffix("_old").join(new.add_suffix("_new"), how="outer")
    changes = []
    for (vehicle, name), group in both.groupby(level=["vehicle", "coefficient"], sort=False):
        added, removed = group["value_old"].isna(), group["value_new"].isna()
        step = (group["value_new"] - group["value_old"]).abs()
        changed = step > 0
        if not (added | removed | changed).any():
            continue
        error = group[["stderr_old", "stderr_new"]].max(axis=1)
        score = (step / error)[changed & (error > 0)]
        scale = group["value_old"].abs().max()
        changes.append(
            Change(
                vehicle=str(vehicle),
                coefficient=str(name),
                added=int(added.sum()),
                removed=int(removed.sum()),
                changed=int(changed.sum()),
                largest_relative_change=float(step.max() / scale) if changed.any() and scale > 0 else 0.0,
                largest_change_in_stderr=float(score.max()) if not score.empty else 0.0,
            )
        )
    return changes


def export(db: str, version: int | None, kind: str, to: Path) -> dict[str, Any]:
    """Write one version as a plain file.

    Parameters
    ----------
    db, version : Database and version (latest when None).
    kind : ``parquet``, ``csv`` or ``json``.
    to : Folder that the file goes to, created when absent, or a file with the ending of its kind.

    Returns
    -------
    What was written, for a program to read: ``file`` (``coefficients_v<version>.<kind>``), format,
    version and digest, number of rows in all, and for each vehicle with the version they are from.

    Raises
    ------
    InputError
        For a missing database or version, a folder that is a file, or a place that cannot be written to.
    """
    rows, number = read_rows(db, version)
    path = file_at(to, f"coefficients_v{number}.{kind}")
    with whole(path) as part:
        if kind == "parquet":
            rows.to_parquet(part, index=False)
        elif kind == "csv":
            rows.to_csv(part, index=False)
        else:
            rows.to_json(part, orient="records", indent=1, double_precision=15)
    history = versions(db)
    commit = next(v for v in history if v.number == number)
    last_commit = {name: last_own(history, name, number) or commit for name in rows["vehicle"].unique()}
    return {
        "file": str(path),
        "format": kind,
        "database": commit.origin(db),
        "rows": len(rows),
        "vehicles": [
            {"vehicle": name, "version": v.number, "digest": v.digest, "rows": int(rows["vehicle"].eq(name).sum())}
            for name, v in last_commit.items()
        ],
    }
