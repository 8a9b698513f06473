"""HDF5 files, netCDF 4 and MATLAB 7.3 among them, by the library h5py; netCDF 3 by scipy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ident.captive.readers.arrays import array_sheet, chosen, needs, of_one_length, with_units
from ident.captive.readers.sheet import Sheet
from ident.captive.source import Source
from sim.files.errors import InputError

# Attributes by which HDF5 links datasets, which are no words or numbers.
_OF_STRUCTURE = ("DIMENSION_LIST", "REFERENCE_LIST")


def _text(value: Any) -> str:
    value = value[0] if isinstance(value, np.ndarray) and value.size == 1 else value
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value) if value is not None else ""


def unit(text: str) -> str:
    """A unit as netCDF writes it: ``seconds since 2019-03-04`` is seconds."""
    return text.partition(" since ")[0].strip()


def open_hdf5(path: Path, source: Source) -> Sheet:
    """Datasets of one length as columns: of the file, or of the group that ``table`` names.

    A unit is read from the attribute ``units`` or ``unit``. A compound dataset is a table by itself, as
    pandas and PyTables write it; a matrix has its columns named by ``names`` or its attribute ``columns``.

    Raises
    ------
    InputError
        For a file that is not HDF5, or holds no datasets of one length.
    """
    h5py = needs("h5py", "readers", path, "an HDF5 file")
    try:
        with h5py.File(path, "r") as opened:
            groups: dict[str, dict[str, tuple[np.ndarray, str]]] = {}
            _collect(h5py, opened, "", groups, source)
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise InputError(str(path), f"not an HDF5 file: {str(error)[:100]}", "a whole file") from error
    name = chosen(path, list(groups), source, "group")
    return _sheet(path, groups[name], source)


def _sheet(path: Path, vectors: dict[str, tuple[np.ndarray, str]], source: Source) -> Sheet:
    header = with_units(list(vectors), [u for _, u in vectors.values()], source)
    columns = of_one_length(path, dict(zip(header, (v for v, _ in vectors.values()), strict=True)), source)
    return array_sheet(path, list(columns), list(columns.values()), source)


def unpacked(values: np.ndarray, attributes: Any) -> np.ndarray:
    """Values as the conventions for climate and forecast pack them: times ``scale_factor`` plus ``add_offset``.

    ``_FillValue`` and ``missing_value`` stand for nothing measured, and become NaN.
    """
    if values.dtype.kind not in "iuf":
        return values
    blank = np.zeros(values.shape, dtype=bool)
    for key in ("_FillValue", "missing_value"):
        for one in np.ravel(attributes.get(key, [])):
            blank |= values == one
    made = values
    for key, change in (("scale_factor", np.multiply), ("add_offset", np.add)):
        if key in attributes:
            made = change(made.astype(float), float(np.ravel(attributes[key])[0]))
    return np.where(blank, np.nan, made.astype(float)) if blank.any() else made


def _collect(h5py: Any, group: Any, name: str, groups: dict[str, Any], source: Source) -> None:
    """Columns of every group, by its path; a compound dataset or a matrix is a group of its own."""
    vectors: dict[str, tuple[np.ndarray, str]] = {}
    for key, item in group.items():
        path = f"{name}/{key}".lstrip("/")
        if isinstance(item, h5py.Group):
            if not key.startswith("#"):
                _collect(h5py, item, path, groups, source)
            continue
        attributes = {str(k): v for k, v in item.attrs.items() if k not in _OF_STRUCTURE}
        stated = unit(_text(next((v for k, v in attributes.items() if k.lower() in ("units", "unit")), "")))
        if item.dtype.names:
            table = item[()]
            groups[path] = {n: (np.asarray(table[n]).ravel(), "") for n in item.dtype.names if table[n].ndim == 1}
        elif item.ndim <= 1 or (item.ndim == 2 and 1 in item.shape):
            if item.size and item.dtype.kind in "iufcSUO":
                values = unpacked(np.ravel(item[()]), attributes)
                text = item.dtype.kind in "SUO"
                vectors[key] = (np.array([_text(v) for v in values], dtype=object) if text else values, stated)
        elif item.ndim == 2 and item.dtype.kind in "iuf":
            labels = source.names or [_text(v) for v in np.ravel(item.attrs.get("columns", []))]
            values = unpacked(item[()], attributes)
            # MATLAB stores its columns as rows.
            values = values if len(labels) == values.shape[1] else values.T
            if len(labels) == values.shape[1]:
                groups[path] = {str(n): (values[:, i], "") for i, n in enumerate(labels)}
    if any(len(v) > 1 for v, _ in vectors.values()):
        groups[name or "/"] = vectors


def open_netcdf(path: Path, source: Source) -> Sheet:
    """Variables of one length of a netCDF file, with their attribute ``units``; version 4 is HDF5.

    Raises
    ------
    InputError
        For a file that is not netCDF, or holds no variables of one length.
    """
    with path.open("rb") as stream:
        if stream.read(4) == b"\x89HDF":
            return open_hdf5(path, source)
    from scipy.io import netcdf_file

    try:
        with netcdf_file(str(path), "r", mmap=False) as opened:
            read = [(str(k), np.array(v[...]), v._attributes) for k, v in opened.variables.items()]
            vectors = {
                name: (unpacked(np.atleast_1d(values), attributes), unit(_text(attributes.get("units", ""))))
                for name, values, attributes in read
                if values.ndim <= 1 and values.dtype.kind in "iuf" and values.size
            }
    except (OSError, ValueError, TypeError, IndexError, KeyError) as error:
        raise InputError(str(path), f"not a netCDF file: {str(error)[:100]}", "a whole file") from error
    if not any(len(v) > 1 for v, _ in vectors.values()):
        raise InputError(str(path), "no variables of one dimension", "variables of one length")
    return _sheet(path, vectors, source)
