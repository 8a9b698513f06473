"""Write the coefficient database: one fit, one commit, or nothing."""

from __future__ import annotations

import contextlib
import json
import logging
import random
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident import __version__
from ident.captive.published import TEST as PUBLISHED
from ident.database.leftovers import check_foreign, remove_unfinished
from ident.database.lock import WAIT, held
from ident.identification.identify import Identification
from ident.identification.nodes import Node
from ident.identification.noted import UNTOLD
from ident.output import check_folder
from sim.boat.database import (
    NUMBERS,
    OPTIONAL,
    axis_columns,
    column_order,
    column_type,
    digest,
    last_own,
    open_table,
    to_column,
    whole_version,
)
from sim.boat.delta_log import LATEST, LOG, Entry, Log, has_versions, latest_said, seal
from sim.boat.parts import Point, parts_of, vehicle_terms
from sim.boat.row_codec import correlation_texts
from sim.files.errors import InputError
from sim.files.standard_error import without_panics
from sim.files.storage import address, brief, engine, flush, is_url, written_to

# Delta Lake's own housekeeping would delete the log of old versions, and then their data.
FOR_EVER = {
    "delta.enableExpiredLogCleanup": "false",
    "delta.logRetentionDuration": "interval 36500 days",
    "delta.deletedFileRetentionDuration": "interval 36500 days",
}

Array = NDArray[np.float64]
_log = logging.getLogger(__name__)

# Disagreements are kept to a billionth of a standard error.
_RESIDUAL_DIGITS = 9


def no_rows() -> pd.DataFrame:
    """The rows of a campaign without runs: columns as ``database_rows``, with their types."""
    kinds = {"double": float, "int64": int, "string": str}
    return pd.DataFrame({c: pd.Series([], dtype=kinds[column_type(c)]) for c in column_order()})


def _runs_behind(node: Node, place: tuple[str, Point], sign: float, factor: dict[str, float]) -> dict[str, Any]:
    """What a row says of the runs behind its value; a value that symmetry makes nothing has none."""
    if not sign:
        return {"n_runs": 0, "quality": "", "origin": "symmetry", "worst_residual": 0.0, "runs": ""}
    seen = "published" if node.tests == {PUBLISHED} else "measured"
    return {
        "n_runs": len(set(node.runs)),
        "quality": max(node.qualities, key=lambda q: factor[q]),
        "origin": seen if place in node.seen else "mirror",
        # Runs that agree leave rounding, which differs between processors.
        "worst_residual": round(node.worst, _RESIDUAL_DIGITS),
        "runs": " ".join(dict.fromkeys(node.runs)),
    }


def database_rows(identified: Identification) -> pd.DataFrame:
    """The rows of the database for one identified campaign, completed by symmetry.

    Parameters
    ----------
    identified : From ``identify``.

    Returns
    -------
    One row a tabulated value, columns as ``sim.boat.database.column_order``.

    Raises
    ------
    InputError
        When the campaign identifies nothing, or a value is not finite.
    """
    vehicle = identified.campaign.vehicle
    if identified.campaign.runs.empty:
        where = identified.campaign.folder or identified.campaign.header.name
        allowed = "one CSV a test beside campaign.toml, or [[source]]; estimates from lines do without"
        raise InputError(where, "no CSV file of runs: the runs identify nothing", allowed)
    columns = {axis: column for column, axis in axis_columns().items()}
    factor = {k: q.factor for k, q in identified.campaign.header.quality.items()}
    stderr = np.sqrt(np.clip(np.diag(identified.covariance), 0.0, None))
    correlated = correlation_texts(identified.covariance)
    rows = []
    for term in vehicle_terms(vehicle):
        for part in parts_of(term, vehicle):
            for point, index, sign in zip(*identified.points(term, part), strict=True):
                row: dict[str, Any] = {
                    "vehicle": vehicle.name,
                    "coefficient": term.name,
                    "part": part,
                    "output": term.output,
                    "value": sign * identified.values[index] + 0.0,
                    "stderr": abs(sign) * stderr[index],
                    "estimated_by": "",
                    "measured_correlation": "",
                    "calibration": "",
                    "estimate": index if sign else -1,
                    "correlation": correlated.get(index, "") if sign else "",
                    "extrapolation": " ".join(f"{a}:{r}" for a, r in term.extrapolation.items()),
                    "equation": term.equation,
                }
                row |= {columns[a]: to_column(columns[a], x) for a, x in zip(term.axes, point, strict=True)}
                rows.append(row | _runs_behind(identified.nodes[index], (part, point), sign, factor))
    # Twelve digits: far below any error, above the rounding that differs between machines.
    for row in rows:
        row |= {k: float(f"{row[k]:.12g}") for k in NUMBERS}
    if not rows:
        raise InputError(identified.campaign.header.name, *_why_nothing(identified))
    table = pd.DataFrame(rows).reindex(columns=column_order())
    _check_finite(table, identified.campaign.header.name)
    return table


def _why_nothing(identified: Identification) -> tuple[str, str]:
    """What is said, and what is allowed, of runs that identify no coefficient."""
    untold = list(dict.fromkeys(one.subject for one in identified.warnings if one.message.endswith(UNTOLD)))
    if untold:
        many = len(identified.campaign.runs)
        what = f"; {many} run{'' if many == 1 else 's'} cannot tell {' '.join(untold)} from one another"
        return f"the runs identify nothing{what}", "runs of the same test at further angles, rates or speeds"
    reasons = list(dict.fromkeys(one.reason for one in identified.unused))[:3]
    why = f"; loads were left out: {'; '.join(reasons)}" if reasons else ""
    return f"the runs identify nothing{why}", "runs of at least one known test"


def _check_finite(rows: pd.DataFrame, where: str) -> None:
    """Refuse values, errors or axis values that are not finite (axes may be empty)."""
    finite = np.isfinite(rows[list(NUMBERS)].to_numpy(dtype=float)).all(axis=1)
    finite &= ~np.isinf(rows[[*axis_columns(), *OPTIONAL]].to_numpy(dtype=float)).any(axis=1)
    if not finite.all():
        bad = rows[~finite].iloc[0]
        text = f"{bad['coefficient']} of {bad['part']} is not finite"
        raise InputError(where, text, "loads and errors of a size the arithmetic holds")


def arrow(rows: pd.DataFrame) -> Any:
    """Rows as an Arrow table with the types of the database, in one piece.

    The storage engine writes the pieces of a table side by side, in whatever order they come.
    """
    import pyarrow as pa

    kinds = {"double": pa.float64(), "int64": pa.int64(), "string": pa.string()}
    fields = [pa.field(c, kinds[column_type(c)]) for c in column_order()]
    return pa.Table.from_pandas(rows[column_order()], schema=pa.schema(fields), preserve_index=False).combine_chunks()


def commit(path: str, rows: pd.DataFrame, metadata: dict[str, str], wait: float = WAIT) -> tuple[int, bool]:
    """Commit one vehicle's rows as a new version; returns when data and log are on the disk.

    Parameters
    ----------
    path : Folder or object-store URL of the database; created when absent.
    rows : From ``database_rows``; replace the same vehicle's rows, keep other vehicles'.
    metadata : Stored with the commit beside digest, program version and parent.
    wait : How long to wait for other writers [s].

    Returns
    -------
    Version number, and False when the content equals the latest version's.

    Raises
    ------
    InputError
        When the path cannot hold a database, the database is damaged, or others keep writing.
    """
    _check_finite(rows, path)
    if is_url(path):
        return _commit(path, rows, metadata, wait)
    address(path)
    local = Path(path)
    if local.exists() and not local.is_dir():
        raise InputError(path, "a file", "a folder for the database")
    check_foreign(local)
    for folder in (local, local / LOG):
        check_folder(folder)
    try:
        local.mkdir(parents=True, exist_ok=True)
        # Creating a table is not exclusive in Delta Lake; the lock falls with its process.
        with held(local, wait):
            remove_unfinished(path)
            return _commit(path, rows, metadata, wait)
    except OSError as error:
        raise InputError(path, f"cannot be written: {error}", "a folder you may write to") from error


def _commit(path: str, rows: pd.DataFrame, metadata: dict[str, str], wait: float = WAIT) -> tuple[int, bool]:
    content, vehicle = digest(rows), str(rows["vehicle"].iloc[0])
    until = time.monotonic() + wait
    while True:
        log = Log(path) if has_versions(path) else None
        beside: dict[str, str] = {}
        if log is not None:
            # Nothing is put on top of what is damaged.
            beside = whole_version(log, log.last)
            if beside.pop(vehicle, "") == content:
                _log.info("version unchanged", extra={"database": path, "version": log.last, "digest": content[:16]})
                return log.last, False
            log = _kept_for_ever(log)
        before = last_own(log.versions, vehicle, log.last) if log else None
        parent = metadata.get("parent", str(before.number) if before else "")
        said = _said({**metadata, "parent": parent}, vehicle, content, beside, log.last if log else -1)
        how: dict[str, Any] = {"mode": "error", "configuration": FOR_EVER}
        if log:
            predicate = "vehicle = '" + vehicle.replace("'", "''") + "'"
            how = {"mode": "overwrite", "schema_mode": "merge", "predicate": predicate}
        if _written(path, rows, said, how, last_try=time.monotonic() > until):
            number = _finished(path, said["seal"])
            what = {"database": path, "version": number, "vehicle": vehicle, "rows": len(rows)}
            _log.info("version committed", extra=what | {"digest": content[:16]})
            return number, True
        # Another fit committed in between, as it can on an object store: look again, not all at once.
        time.sleep(random.uniform(0.05, 0.5))


def _said(metadata: dict[str, str], vehicle: str, content: str, beside: dict[str, str], after: int) -> dict[str, str]:
    """What a commit says of itself, sealed."""
    said = metadata | {
        "digest": content,
        "program": f"ident {__version__}",
        "vehicle": vehicle,
        "time": str(time.time_ns() // 1_000_000),
        "beside": json.dumps(beside, sort_keys=True),
        "after": str(after),
    }
    return said | {"seal": seal(said)}


def commit_again(path: str, everything: pd.DataFrame, vehicle: str, metadata: dict[str, str], after: int) -> int:
    """Commit the rows of every vehicle in place of a version that is damaged; hold the lock of the folder.

    Parameters
    ----------
    path : Folder or object-store URL of the database.
    everything : Rows of all vehicles.
    vehicle : Whose rows the damaged version held wrongly.
    metadata : Of the commit that wrote them first.
    after : Number of the version that is replaced.

    Returns
    -------
    Number of the new version.

    Raises
    ------
    InputError
        As ``commit``.
    """
    digests = {str(name): digest(rows) for name, rows in everything.groupby("vehicle")}
    content = digests.pop(vehicle)
    said = _said({k: v for k, v in metadata.items() if k != "seal"}, vehicle, content, digests, after)
    _written(path, everything, said, {"mode": "overwrite"}, last_try=True)
    return _finished(path, said["seal"])


def _written(path: str, rows: pd.DataFrame, said: dict[str, str], how: dict[str, Any], last_try: bool) -> bool:
    """Write a version; False when another was faster."""
    from deltalake import CommitProperties, PostCommitHookProperties, write_deltalake
    from deltalake.exceptions import CommitFailedError, DeltaError

    with engine(path, "the version cannot be written", "room, and a path you may write to"):
        try:
            # Never tried again on top of what another wrote meanwhile: what it replaces would be another's.
            with written_to(path) as place, without_panics():
                write_deltalake(
                    place,
                    arrow(rows),
                    commit_properties=CommitProperties(custom_metadata=said, max_commit_retries=0),
                    post_commithook_properties=PostCommitHookProperties(cleanup_expired_logs=False),
                    **how,
                )
        except CommitFailedError as error:
            if last_try:
                raise InputError(
                    path, f"another fit wrote at the same time: {brief(error)}", "run the fit again"
                ) from error
            return False
        except DeltaError:
            # Another fit made the database in between.
            if last_try or how["mode"] != "error" or not has_versions(path):
                raise
            return False
    return True


def _kept_for_ever(log: Log) -> Log:
    """A table that was made before versions were kept for ever is told to keep them."""
    from deltalake import CommitProperties, DeltaTable

    table = open_table(log.path, log.last, log)
    with engine(log.path, "cannot be changed", "a database you may write to"):
        if FOR_EVER.items() <= table.metadata().configuration.items():
            return log
        said = {
            "message": "every version is kept for ever",
            "program": f"ident {__version__}",
            "time": str(time.time_ns() // 1_000_000),
        }
        said["seal"] = seal(said)
        never_again = CommitProperties(custom_metadata=said, max_commit_retries=0)
        with written_to(log.path) as place:
            DeltaTable(place, version=log.last).alter.set_table_properties(FOR_EVER, commit_properties=never_again)
    return Log(log.path)


def _finished(path: str, sealed: str) -> int:
    """Number of a version just written, read back, flushed and noted; another fit may have committed after it."""
    log = Log(path)
    number = next(v.number for v in reversed(log.versions) if v.metadata.get("seal") == sealed)
    whole_version(log, number)
    if log.storage.local is not None:
        _flush(log.storage.local, number, log.entry(number))
    # The version is there without the note, which only guards against the loss of its entry.
    with contextlib.suppress(InputError):
        if number > (latest_said(log.storage) or -1):
            log.storage.write(LATEST, json.dumps({"version": number, "seal": sealed}).encode())
    return number


def _flush(local: Path, number: int, entry: Entry) -> None:
    """Hand data, log and their folders over to the disk."""
    for name in entry.added:
        flush(local / name)
    for file in (local / LOG).iterdir():
        if file.name.startswith((f"{number:020d}.", f"{number - 1:020d}.", "_last_checkpoint")):
            flush(file)
    for folder in (local / LOG, local, local.absolute().parent):
        flush(folder)
