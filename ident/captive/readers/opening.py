"""Readers: which files a source names, in which format each is, and how to open it."""

from __future__ import annotations

import glob
import os
import re
from pathlib import Path

from ident.captive.readers.parquet import open_parquet
from ident.captive.readers.table import Sheet, open_columns, open_csv
from ident.captive.readers.text import COMMENTS, head
from ident.captive.source import Source
from sim.files.errors import InputError

_LOADS = ("forces", "movingForces", "force", "moment")
_OUTPUTS = {"forces.dat", "movingForces.dat", "force.dat", "moment.dat", "coefficient.dat", "forceCoeffs.dat"}


OPENERS = {"table": open_csv, "starccm": open_csv, "columns": open_columns, "parquet": open_parquet}


def matching(folder: Path, source: Source) -> list[Path]:
    """The files (for OpenFOAM the case folders) that ``source.files`` names, sorted.

    Raises
    ------
    InputError
        When there is none.
    """
    try:
        names = glob.glob(source.files, root_dir=folder, recursive=True)
    except (ValueError, re.error, OSError):
        names = []
    found = sorted(folder / name for name in names)
    if not found:
        raise InputError(f"{folder / 'campaign.toml'}, key source.files", f"no file {source.files!r}", "a path or glob")
    return found


def reader_of(path: Path, source: Source) -> str:
    """The format of a file: as declared, else by its content.

    A folder is an OpenFOAM case; ``PAR1`` begins a Parquet file; ``Monitor`` in the header
    is STAR-CCM+; a header with ``;``, a tab or ``,`` is a table; the rest are columns.
    """
    if source.reader:
        return source.reader
    if path.is_dir():
        return "openfoam"
    if path.name in _OUTPUTS:
        text = "the case folder, or postProcessing/<function object>: restarts are read together"
        raise InputError(str(path), "one file of an OpenFOAM run", text)
    try:
        with path.open("rb") as stream:
            start = stream.read(4)
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror}", "a readable file") from error
    if start == b"PAR1" or path.suffix == ".parquet":
        return "parquet"
    if source.header_pattern and source.delimiter in (",", ";", "\t"):
        return "table"
    if source.names or source.header_pattern:
        return "columns"
    first = next(iter(head(path, source.encoding, COMMENTS, source.skip).text), "")
    if source.patterns or re.search(r"\bMonitor\b", first):
        return "starccm"
    if first and not re.search(r"[A-Za-z]", re.sub(r"[eEdD][+-]?\d", "", first)):
        return "columns"
    delimited = any(mark in first for mark in ",;\t")
    return "table" if delimited or path.suffix == ".csv" else "columns"


def open_sheet(path: Path, source: Source) -> Sheet:
    """Open one file as a table.

    Raises
    ------
    InputError
        For a folder, or anything the reader of its format refuses.
    """
    reader = reader_of(path, source)
    if reader == "openfoam" or path.is_dir():
        text = "a file; rows = 'history' for an OpenFOAM case; a glob such as 'runs.parquet/*.parquet' for many files"
        raise InputError(str(path), "a folder", text)
    return OPENERS[reader](path, source.model_copy(update={"reader": reader}))


def inputs(path: Path) -> list[Path]:
    """Every file at or below a path that a reader may look at, for the digests."""
    if path.is_file():
        return [path]
    names = ((root, n) for root, _, found in os.walk(path) for n in found)
    return sorted(Path(root) / n for root, n in names if n.endswith(".dat") and n.split(".")[0].split("_")[0] in _LOADS)
