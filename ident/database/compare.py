"""Differences between database versions, and export."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.output import check_folder, whole
from sim.boat.database import axis_columns, last_own, read_rows, versions

if TYPE_CHECKING:
    import pandas as pd


def _indexed(rows: pd.DataFrame) -> pd.DataFrame:
    keys = ["vehicle", "coefficient", "part", *axis_columns()]
    return rows.set_index(keys)[["value", "stderr"]]


def difference(db: str, first: int, second: int) -> list[dict[str, Any]]:
    """What changed between two versions, one row a coefficient.

    Parameters
    ----------
    db : Database path or URL.
    first, second : Version numbers.

    Returns
    -------
    For each coefficient that differs: points added, removed and changed, the largest
    change relative to the coefficient's largest value, and in standard errors.

    Raises
    ------
    InputError
        When the database or a version does not exist.
    """
    old, new = (_indexed(read_rows(db, v)[0]) for v in (first, second))
    both = old.add_suffix("_old").join(new.add_suffix("_new"), how="outer")
    found = []
    for (vehicle, name), group in both.groupby(level=["vehicle", "coefficient"], sort=False):
        added, removed = group["value_old"].isna(), group["value_new"].isna()
        step = (group["value_new"] - group["value_old"]).abs()
        changed = step > 0
        if not (added | removed | changed).any():
            continue
        error = group[["stderr_old", "stderr_new"]].max(axis=1)
        score = (step / error)[changed & (error > 0)]
        scale = group["value_old"].abs().max()
        found.append(
            {
                "vehicle": str(vehicle),
                "coefficient": str(name),
                "added": int(added.sum()),
                "removed": int(removed.sum()),
                "changed": int(changed.sum()),
                "largest_relative_change": float(step.max() / scale) if changed.any() and scale > 0 else 0.0,
                "largest_change_in_stderr": float(score.max()) if not score.empty else 0.0,
            }
        )
    return found


def export(db: str, version: int | None, kind: str, folder: Path) -> dict[str, Any]:
    """Write one version as a plain file.

    Parameters
    ----------
    db, version : Database and version (latest when None).
    kind : ``parquet``, ``csv`` or ``json``.
    folder : Where the file goes; created when absent.

    Returns
    -------
    What was written, for a program to read: ``file`` (``coefficients_v<version>.<kind>``), format,
    version and digest, number of rows in all, and for each vehicle with the version they are from.

    Raises
    ------
    InputError
        For a missing database or version, a folder that is a file or cannot be written to.
    """
    rows, number = read_rows(db, version)
    check_folder(folder)
    path = folder / f"coefficients_v{number}.{kind}"
    with whole(path) as part:
        if kind == "parquet":
            rows.to_parquet(part, index=False)
        elif kind == "csv":
            rows.to_csv(part, index=False)
        else:
            rows.to_json(part, orient="records", indent=1, double_precision=15)
    history = versions(db)
    commit = next(v for v in history if v.number == number)
    own = {name: last_own(history, name, number) or commit for name in rows["vehicle"].unique()}
    return {
        "file": str(path),
        "format": kind,
        "database": {"path": db, "version": number, "digest": commit.digest},
        "rows": len(rows),
        "vehicles": [
            {"vehicle": name, "version": v.number, "digest": v.digest, "rows": int(rows["vehicle"].eq(name).sum())}
            for name, v in own.items()
        ],
    }
