"""Write the coefficient database: one fit, one commit, or nothing."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident import __version__
from ident.captive.published import TEST as PUBLISHED
from ident.identification.identify import Identification
from sim.boat.database import COUNTS, NUMBERS, axis_columns, brief, column_order, read_rows, to_column, versions
from sim.boat.parts import parts_of, vehicle_terms
from sim.files.errors import InputError

# A conflicting commit of another fit is looked at again this often.
_TRIES = 3
# Correlations below this are rounding.
_LEAST_CORRELATION = 1e-6

Array = NDArray[np.float64]


def database_rows(found: Identification) -> pd.DataFrame:
    """The rows of the database for one identified campaign, completed by symmetry.

    Parameters
    ----------
    found : From ``identify``.

    Returns
    -------
    One row a tabulated value, columns as ``sim.boat.database.column_order``.

    Raises
    ------
    InputError
        When the campaign identifies nothing, or a value is not finite.
    """
    vehicle = found.campaign.vehicle
    columns = {axis: column for column, axis in axis_columns().items()}
    factor = {k: q.factor for k, q in found.campaign.header.quality.items()}
    stderr = np.sqrt(np.clip(np.diag(found.covariance), 0.0, None))
    correlated = correlation_texts(found.covariance, stderr)
    rows = []
    for term in vehicle_terms(vehicle):
        for part in parts_of(term, vehicle):
            for point, index, sign in zip(*found.points(term, part), strict=True):
                node = found.nodes[index]
                seen = "published" if node.tests == {PUBLISHED} else "measured"
                origin = seen if (part, point) in node.seen else "mirror"
                row: dict[str, Any] = {
                    "vehicle": vehicle.name,
                    "coefficient": term.name,
                    "part": part,
                    "output": term.output,
                }
                row |= {columns[a]: to_column(columns[a], x) for a, x in zip(term.axes, point, strict=True)}
                row |= {
                    "value": sign * found.values[index] + 0.0,
                    "stderr": abs(sign) * stderr[index],
                    "n_runs": len(set(node.runs)) if sign else 0,
                    "quality": max(node.qualities, key=lambda q: factor[q]) if sign else "",
                    "origin": origin if sign else "symmetry",
                    "calibration": "",
                    "estimate": index if sign else -1,
                    "correlation": correlated.get(index, "") if sign else "",
                    "worst_residual": node.worst if sign else 0.0,
                    "extrapolation": " ".join(f"{a}:{r}" for a, r in term.extrapolation.items()),
                    "equation": term.equation,
                    "runs": " ".join(dict.fromkeys(node.runs)) if sign else "",
                }
                rows.append(row)
    # Twelve digits: far below any error, above the rounding that differs between machines.
    for row in rows:
        row |= {k: float(f"{row[k]:.12g}") for k in NUMBERS}
    if not rows:
        raise InputError(found.campaign.header.name, "the runs identify nothing", "runs of at least one known test")
    table = pd.DataFrame(rows).reindex(columns=column_order())
    _check_finite(table, found.campaign.header.name)
    return table


def correlation_texts(covariance: Array, stderr: Array) -> dict[int, str]:
    """Estimate -> the estimates correlated with it, as text.

    Parameters
    ----------
    covariance, stderr : (n, n) and (n,) of the estimates.

    Returns
    -------
    Number of an estimate -> ``other:coefficient`` pairs; estimates without any are left out.
    """
    scale = np.outer(stderr, stderr)
    matrix = np.divide(covariance, scale, out=np.zeros_like(covariance), where=scale > 0.0)
    np.fill_diagonal(matrix, 0.0)
    found: dict[int, list[str]] = {}
    for i, j in np.argwhere(np.abs(matrix) > _LEAST_CORRELATION):
        found.setdefault(int(i), []).append(f"{j}:{matrix[i, j]:.6g}")
    return {i: " ".join(items) for i, items in found.items()}


def _check_finite(rows: pd.DataFrame, where: str) -> None:
    """Refuse values, errors or axis values that are not finite (axes may be empty)."""
    finite = np.isfinite(rows[list(NUMBERS)].to_numpy(dtype=float)).all(axis=1)
    finite &= ~np.isinf(rows[list(axis_columns())].to_numpy(dtype=float)).any(axis=1)
    if not finite.all():
        bad = rows[~finite].iloc[0]
        text = f"{bad['coefficient']} of {bad['part']} is not finite"
        raise InputError(where, text, "loads and errors of a size the arithmetic holds")


def digest(rows: pd.DataFrame) -> str:
    """SHA-256 of the content of database rows, independent of their order."""
    text = []
    for row in rows[column_order()].itertuples(index=False):
        cells = ["" if (isinstance(x, float) and math.isnan(x)) or x is None else repr(x) for x in row]
        text.append("\t".join(cells))
    return hashlib.sha256("\n".join(sorted(text)).encode()).hexdigest()


def _arrow(rows: pd.DataFrame) -> Any:
    import pyarrow as pa

    numbers = {*NUMBERS, *axis_columns()}
    fields = [
        pa.field(c, pa.float64() if c in numbers else pa.int64() if c in COUNTS else pa.string())
        for c in column_order()
    ]
    return pa.Table.from_pandas(rows[column_order()], schema=pa.schema(fields), preserve_index=False)


def commit(path: str, rows: pd.DataFrame, metadata: dict[str, str]) -> tuple[int, bool]:
    """Commit one vehicle's rows as a new version.

    Parameters
    ----------
    path : Folder or object-store URL of the database; created when absent.
    rows : From ``database_rows``; replace the same vehicle's rows, keep other vehicles'.
    metadata : Stored with the commit beside digest, program version and parent.

    Returns
    -------
    Version number, and False when the content equals the latest version's.

    Raises
    ------
    InputError
        When the path cannot hold a database, or another fit committed at the same time.
    """
    _check_finite(rows, path)
    local = Path(path)
    if "://" in path:
        return _commit(path, rows, metadata)
    from filelock import FileLock

    if local.exists() and not local.is_dir():
        raise InputError(path, "a file", "a folder for the database")
    try:
        local.mkdir(parents=True, exist_ok=True)
        # Creating a table is not exclusive in Delta Lake; the lock falls with its process.
        with FileLock(local / ".lock"):
            return _commit(path, rows, metadata)
    except OSError as error:
        raise InputError(path, f"cannot be written: {error}", "a folder you may write to") from error


def _commit(path: str, rows: pd.DataFrame, metadata: dict[str, str]) -> tuple[int, bool]:
    from deltalake import CommitProperties, write_deltalake
    from deltalake.exceptions import CommitFailedError, DeltaError

    content, vehicle = digest(rows), str(rows["vehicle"].iloc[0])
    for attempt in range(_TRIES):
        parent, number = _latest(path, vehicle, content)
        if number is not None:
            return number, False
        own = {
            "digest": content,
            "program": f"ident {__version__}",
            "parent": metadata.get("parent", parent),
            "vehicle": vehicle,
        }
        properties = CommitProperties(custom_metadata={**metadata, **own})
        try:
            if parent:
                replaced = "vehicle = '" + vehicle.replace("'", "''") + "'"
                write_deltalake(
                    path,
                    _arrow(rows),
                    mode="overwrite",
                    schema_mode="merge",
                    predicate=replaced,
                    commit_properties=properties,
                )
            else:
                write_deltalake(path, _arrow(rows), mode="error", commit_properties=properties)
        except CommitFailedError as error:
            # Another fit committed in between: look again, then give up.
            if attempt == _TRIES - 1:
                raise InputError(
                    path, f"another fit wrote at the same time: {brief(error)}", "run the fit again"
                ) from error
            continue
        except DeltaError as error:
            raise InputError(
                path, f"the database refused the version: {brief(error)}", "a database `ident fit` wrote"
            ) from error
        return _own_version(path, content), True
    raise AssertionError("unreachable: the last try returns or raises")


def _latest(path: str, vehicle: str, content: str) -> tuple[str, int | None]:
    """Parent version (empty for a new database), and the version that holds ``content``."""
    if "://" not in path and not (Path(path) / "_delta_log").is_dir():
        return "", None
    try:
        parent = str(versions(path)[-1].number)
    except InputError:
        if "://" in path:
            return "", None
        raise
    try:
        present, number = read_rows(path, vehicle=vehicle)
    except InputError:
        # No rows of this vehicle yet.
        return parent, None
    return parent, number if digest(present) == content else None


def _own_version(path: str, content: str) -> int:
    """The newest version with this content; another fit may have committed after it."""
    return next(v.number for v in reversed(versions(path)) if v.digest == content)
