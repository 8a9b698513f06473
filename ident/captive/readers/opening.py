"""Readers: which files a source names, in which format each is, and how to open it."""

from __future__ import annotations

import lzma
import os
import re
from pathlib import Path

from ident.captive.readers.arrays import NoSuchTable
from ident.captive.readers.hdf5 import open_hdf5, open_netcdf
from ident.captive.readers.labview import open_lvm, open_tdms
from ident.captive.readers.matlab import open_matlab
from ident.captive.readers.parquet import open_parquet
from ident.captive.readers.sheet import Sheet
from ident.captive.readers.solvers import (
    fluent_header,
    is_xy,
    open_fluent,
    open_plots,
    open_su2,
    open_tecplot,
    plots,
    su2_header,
)
from ident.captive.readers.spreadsheet import open_workbook
from ident.captive.readers.table import open_columns, open_csv
from ident.captive.readers.text import COMMENTS, Lines, head, opened, packed, sniff
from ident.captive.readers.universal import open_universal
from ident.captive.source import Source
from sim.files.errors import InputError
from sim.files.inputs import check_regular

_LOADS = ("forces", "movingForces", "force", "moment")
_OUTPUTS = {"forces.dat", "movingForces.dat", "force.dat", "moment.dat"}
_COEFFICIENTS = {"coefficient.dat", "forceCoeffs.dat"}


OPENERS = {
    "table": open_csv,
    "starccm": open_csv,
    "columns": open_columns,
    "parquet": open_parquet,
    "workbook": open_workbook,
    "matlab": open_matlab,
    "hdf5": open_hdf5,
    "netcdf": open_netcdf,
    "tdms": open_tdms,
    "lvm": open_lvm,
    "fluent": open_fluent,
    "su2": open_su2,
    "tecplot": open_tecplot,
    "universal": open_universal,
}
# What a file begins with that says its format.
_BEGIN = {
    b"PAR1": "parquet",
    b"PK\x03\x04": "workbook",
    b"\xd0\xcf\x11\xe0": "workbook",
    b"MATLAB": "matlab",
    b"\x89HDF": "hdf5",
    b"CDF\x01": "netcdf",
    b"CDF\x02": "netcdf",
    b"CDF\x05": "netcdf",
    b"TDSm": "tdms",
    b"LabVIEW Measurement": "lvm",
    b"    -1\n": "universal",
    b"    -1\r\n": "universal",
}
# Readers whose libraries open the file themselves.
_WHOLE = ("parquet", "workbook", "matlab", "hdf5", "netcdf", "tdms", "universal")
_ENDINGS = {".parquet": "parquet", ".mat": "matlab", ".nc": "netcdf"}


def matching(folder: Path, source: Source) -> list[Path]:
    """The files (for OpenFOAM the case folders) that ``source.files`` names, sorted.

    Raises
    ------
    InputError
        When there is none, and none is awaited.
    """
    try:
        # Does not follow links to folders below **, which may lead round in circles.
        files = sorted(p for p in folder.glob(source.files) if not _is_hidden(p, folder, source.files))
    except (ValueError, IndexError, NotImplementedError, re.error, OSError):
        files = []
    lost = {p: o for p in files for o in on_coarser_grids(p, folder, source) if not o.exists()}
    if lost and not source.awaited:
        path, other = next(iter(lost.items()))
        raise InputError(
            f"{folder / 'campaign.toml'}, key source.grids", f"no {other} beside {path}", "all three grids"
        )
    # A run that is awaited counts once it is back from all of its grids, and one of a deduction with its towed twin.
    files = [path for path in files if path not in lost]
    if source.awaited and source.deduction is not None:
        towed = source.model_copy(update={"files": source.deduction.towed, "deduction": None})
        files = files if matching(folder, towed) else []
    if not files and not source.awaited:
        raise InputError(f"{folder / 'campaign.toml'}, key source.files", f"no file {source.files!r}", "a path or glob")
    return files


def _is_hidden(path: Path, folder: Path, pattern: str) -> bool:
    """Whether a name begins with a dot that the pattern does not ask for."""
    return "/." not in f"/{pattern}" and any(part.startswith(".") for part in path.relative_to(folder).parts)


def on_coarser_grids(path: Path, folder: Path, source: Source) -> list[Path]:
    """The same file on the coarser grids of ``[source.grids]``, the finer of them first; empty without."""
    if source.grids is None:
        return []
    parts = path.relative_to(folder).parts
    return [
        folder.joinpath(*(name if part == source.grids.finest else part for part in parts))
        for name in source.grids.coarser
    ]


def reader_of(path: Path, source: Source) -> str:
    """The format of a file: as declared, else by its content.

    A folder is an OpenFOAM case; workbooks, MATLAB, HDF5, netCDF, TDMS, LVM, universal and Parquet files say it in
    their first bytes, Fluent, SU2 and Tecplot files in their first lines; ``Monitor`` in the header
    is STAR-CCM+; a header with ``;``, a tab or ``,`` is a table; the rest are columns.
    """
    check_regular(path)
    if source.reader:
        return source.reader
    if path.is_dir():
        return "openfoam"
    if path.name in _COEFFICIENTS:
        text = (
            "reader = 'columns', header_pattern = '# Time', normalisation = 'half_rho_A' and [source.reference] beside"
        )
        raise InputError(str(path), "force coefficients of OpenFOAM", f"its forces; or {text}")
    if path.name in _OUTPUTS:
        text = "the case folder, or postProcessing/<function object>: restarts are read together"
        raise InputError(str(path), "one file of an OpenFOAM run", text)
    try:
        with opened(path) as stream:
            start = stream.read(20)
    except (OSError, EOFError, lzma.LZMAError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(str(path), f"cannot be read: {reason}", "a readable file") from error
    said = next((reader for mark, reader in _BEGIN.items() if start.startswith(mark)), _ENDINGS.get(path.suffix, ""))
    if said:
        return "matlab" if said == "hdf5" and path.suffix == ".mat" else said
    if _is_tecplot(head(path, source.encoding, COMMENTS, source.skip).text):
        return "tecplot"
    if source.header_pattern and source.delimiter in (",", ";", "\t"):
        return "table"
    if source.names or source.header_pattern:
        return "columns"
    lines = head(path, source.encoding, COMMENTS, source.skip).text
    first = next(iter(lines), "")
    if fluent_header(lines) >= 0 or is_xy(lines):
        return "fluent"
    if su2_header(lines):
        return "su2"
    if source.patterns or re.search(r"\bMonitor\b", first):
        return "starccm"
    if first and not re.search(r"[A-Za-z]", re.sub(r"[eEdD][+-]?\d", "", first)):
        return "columns"
    delimited = any(mark in first for mark in ",;\t")
    return "table" if delimited or path.suffix == ".csv" else "columns"


def _is_tecplot(lines: list[str]) -> bool:
    """Whether lines begin as an ASCII file of Tecplot does: its variables, perhaps below a title."""
    first = lines[0] if lines else ""
    named = any(re.match(r"(?i)\s*VARIABLES\s*=", line) for line in lines)
    return named and re.match(r"(?i)\s*(TITLE|VARIABLES)\s*=", first) is not None


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
    if reader in ("table", "starccm") and not source.header_pattern:
        first = head(path, source.encoding, COMMENTS, source.skip)
        if first.text and first.text[0].count(",") + first.text[0].count(";") + first.text[0].count("\t") >= 3:
            dialect = sniff(path, Lines(first.rows, first.text), source.delimiter, source.decimal, source.thousands)
            if plots([dialect.cells(first.text[0], f"{path}, row {first.rows[0]}")]):
                return open_plots(path, source, dialect)
    if reader in _WHOLE and packed(path):
        raise InputError(
            str(path), f"packed, and for the reader {reader}", "the file unpacked: text alone is read packed"
        )
    as_read = source.model_copy(update={"reader": reader})
    if reader in ("table", "starccm", "columns") and su2_header(head(path, source.encoding).text):
        return open_su2(path, as_read, OPENERS[reader])
    return OPENERS[reader](path, as_read)


def tables_of(path: Path, source: Source) -> list[str]:
    """The tables of a file that ``source.table`` names: one, or each that fits a name with ``*`` or ``?``.

    Raises
    ------
    InputError
        For a name that none of them fits, or anything the reader of its format refuses.
    """
    if not re.search(r"[*?]", source.table) or path.is_dir():
        return [source.table]
    try:
        open_sheet(path, source)
    except NoSuchTable as error:
        form = re.escape(source.table).replace(r"\*", ".*").replace(r"\?", ".")
        fitting = [name for name in error.names if re.fullmatch(form, name, re.DOTALL)]
        if not fitting:
            raise
        return fitting
    return [source.table]


def inputs(path: Path) -> list[Path]:
    """Every file at or below a path that a reader may look at, for the digests."""
    if path.is_file():
        return [path]
    names = ((root, n) for root, _, files in os.walk(path) for n in files)
    return sorted(Path(root) / n for root, n in names if n.endswith(".dat") and n.split(".")[0].split("_")[0] in _LOADS)
