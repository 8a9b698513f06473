"""One JSON file that holds a version whole: to publish, and to read back to the same digest.

Rows as they stand in the database, with units, frame and the covariance of the values (their correlations
stand in the rows), and what the commit says of itself. The files of a run table are not in it.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ident.database.store import commit
from ident.output import file_at, whole
from sim.boat.database import Version, axis_columns, column_order, column_type, digest, last_own, read_rows, versions
from sim.files.errors import InputError
from sim.files.frames import PROGRAM
from sim.files.inputs import check_regular

FORMAT, SCHEMA = "ident exchange", 2
# Files without a seal: read as far as the digests of their rows go.
_UNSEALED = 1
# Ten thousand rows of a version take 5 million bytes.
_LARGEST = 1 << 28
# What a commit says anew, and what belongs to the database that it stood in.
_OF_THE_COMMIT = frozenset({"digest", "program", "vehicle", "time", "beside", "after", "seal", "parent"})
_KINDS = {"double": "number", "int64": "integer", "string": "string"}


def schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of an exchange file."""
    row = {name: {"type": [_KINDS[column_type(name)], "null"]} for name in column_order()}
    text = {"type": "string"}
    vehicle = {
        "type": "object",
        "required": ["vehicle", "digest", "metadata", "rows"],
        "additionalProperties": False,
        "properties": {
            "vehicle": text,
            "version": {"type": "integer"},
            "digest": {"type": "string", "pattern": "^[0-9a-f]{64}$"},
            "metadata": {"type": "object", "additionalProperties": text},
            "rows": {"type": "array", "items": {"type": "object", "additionalProperties": False, "properties": row}},
        },
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": FORMAT,
        "type": "object",
        "required": ["format", "schema", "frame", "units", "vehicles", "seal"],
        "additionalProperties": False,
        "properties": {
            "format": {"const": FORMAT},
            "schema": {"const": SCHEMA},
            "program": text,
            "frame": text,
            "units": {"type": "object", "additionalProperties": text},
            "covariance": text,
            "vehicles": {"type": "array", "minItems": 1, "items": vehicle},
            "seal": {"type": "string", "pattern": "^[0-9a-f]{64}$"},
        },
    }


def export_exchange(db: str, version: int | None, to: Path) -> dict[str, Any]:
    """Write a version as ``coefficients_v<version>.json`` into a folder, or as a file that ends in ``.json``.

    Returns
    -------
    As ``ident.database.compare.export``.

    Raises
    ------
    InputError
        For a missing database or version, or a place that cannot be written to.
    """
    rows, number = read_rows(db, version)
    path, history = file_at(to, f"coefficients_v{number}.json"), versions(db)
    vehicles = [
        _vehicle(str(name), of_vehicle, history, number) for name, of_vehicle in rows.groupby("vehicle", sort=False)
    ]
    data = {
        "format": FORMAT,
        "schema": SCHEMA,
        "program": _program(),
        "frame": f"{PROGRAM}: x forward, y to starboard, z down; values in prime form as docs/terms.md defines each",
        "units": _units(),
        "covariance": "rows of one estimate share their values; correlation: pairs of estimate and coefficient",
        "vehicles": vehicles,
    }
    data["seal"] = _seal(data)
    with whole(path) as part:
        part.write_text(json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8")
    commit_of = next(v for v in history if v.number == number)
    return {
        "file": str(path),
        "format": "json",
        "database": {"path": db, "version": number, "digest": commit_of.digest},
        "rows": len(rows),
        "vehicles": [{k: v[k] for k in ("vehicle", "version", "digest")} | {"rows": len(v["rows"])} for v in vehicles],
    }


def _seal(data: dict[str, Any]) -> str:
    """SHA-256 of all that a file says but its seal, however its keys and blanks are ordered."""
    text = json.dumps({k: v for k, v in data.items() if k != "seal"}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _program() -> str:
    from ident import __version__

    return f"ident {__version__}"


def _units() -> dict[str, str]:
    """Unit of every column of axes, by how its name ends; values are in prime form."""
    endings = {"mps": "m/s", "deg": "deg", "m": "m", "radps": "rad/s", "mps2": "m/s^2", "rad2ps2": "rad^2/s^2"}
    units = {name: endings.get(name.rsplit("_", 1)[-1], "1") for name in axis_columns()}
    return units | dict.fromkeys(("value", "stderr", "measured_value", "measured_stderr"), "1")


def _vehicle(name: str, rows: Any, history: list[Version], number: int) -> dict[str, Any]:
    commit = last_own(history, name, number) or next(v for v in history if v.number == number)
    kept = {k: v for k, v in commit.metadata.items() if k not in _OF_THE_COMMIT}
    records = [
        {k: _plain(v) for k, v in zip(column_order(), row, strict=True) if v == v}
        for row in rows[column_order()].itertuples(index=False, name=None)
    ]
    return {"vehicle": name, "version": commit.number, "digest": digest(rows), "metadata": kept, "rows": records}


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


@dataclass(frozen=True)
class Imported:
    """A vehicle that was committed from an exchange file.

    Attributes
    ----------
    vehicle : Its name.
    version, digest, rows : What was committed.
    new : Whether the database did not have it.
    """

    vehicle: str
    version: int
    digest: str
    rows: int
    new: bool


def import_exchange(path: Path, db: str, wait: float) -> list[Imported]:
    """Commit what an exchange file holds, a version a vehicle.

    Parameters
    ----------
    path : From ``export_exchange``.
    db : Folder or URL of the database, created when absent.
    wait : For other writers [s].

    Returns
    -------
    One entry a vehicle.

    Raises
    ------
    InputError
        For a file that cannot be read, is no exchange file, or is not what was exported: its rows have another
        digest than it says, or it another seal. Nothing is committed then.
    """
    data = _read(path)
    read = [_rows_of(path, one) for one in data["vehicles"]]
    if data["schema"] != _UNSEALED and data.get("seal") != _seal(data):
        raise InputError(str(path), "not what its seal says", "a file that was not changed: export it once more")
    done = []
    for (name, wanted, metadata), rows in read:
        number, new = commit(db, rows, metadata, wait)
        done.append(Imported(name, number, wanted, len(rows), new))
    return done


def _read(path: Path) -> dict[str, Any]:
    check_regular(path)
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(str(path), f"{path.stat().st_size} bytes", f"{_LARGEST} bytes at most")
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise InputError(str(path), f"cannot be read: {error}", "a file of `ident export --format json`") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT or data.get("schema") not in (SCHEMA, _UNSEALED):
        raise InputError(str(path), "no exchange file of this program", f"format {FORMAT!r}, schema {SCHEMA}")
    vehicles = data.get("vehicles")
    if not isinstance(vehicles, list) or not vehicles:
        raise InputError(f"{path}, vehicles", "none", "one vehicle or more")
    return data


def _rows_of(path: Path, one: Any) -> tuple[tuple[str, str, dict[str, str]], Any]:
    """Name, digest and metadata of a vehicle in the file, and its rows."""
    import pandas as pd

    name = one.get("vehicle") if isinstance(one, dict) else None
    where = f"{path}, vehicle {name}"
    records, metadata = (one.get(k) if isinstance(one, dict) else None for k in ("rows", "metadata"))
    texts = isinstance(metadata, dict) and all(isinstance(v, str) for v in metadata.values())
    if not (name and isinstance(records, list) and records and texts and all(isinstance(r, dict) for r in records)):
        raise InputError(where, "not as the schema says", "vehicle, digest, metadata of texts, and rows")
    unknown = sorted({key for r in records for key in r} - set(column_order()))
    if unknown:
        raise InputError(f"{where}, rows", f"columns {', '.join(unknown)}", "those of `ident schema`'s exchange file")
    try:
        rows = pd.DataFrame(
            {c: pd.Series([r.get(c) for r in records], dtype=_DTYPES[column_type(c)]) for c in column_order()}
        )
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}, rows", str(error), "numbers and texts as the schema says") from error
    if set(rows["vehicle"]) != {name}:
        raise InputError(f"{where}, rows", "rows of other vehicles", f"rows of {name} alone")
    if digest(rows) != one.get("digest"):
        text = f"the rows have digest {digest(rows)[:16]}, the file says {str(one.get('digest'))[:16]}"
        raise InputError(where, text, "a file that was not changed")
    kept = {k: v for k, v in (metadata or {}).items() if k not in _OF_THE_COMMIT}
    return (str(name), digest(rows), kept), rows


_DTYPES = {"double": "float64", "int64": "int64", "string": "object"}
