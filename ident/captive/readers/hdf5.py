"""HDF5 files, netCDF 4 and MATLAB 7.3 among them, by the library h5py; netCDF 3 by scipy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ident.captive.quantities import split
from ident.captive.readers.arrays import array_sheet, chosen, is_quantity, needs, of_one_length, with_units
from ident.captive.readers.sheet import Sheet, ignored
from ident.captive.source import Source
from sim.files.errors import InputError

# A dataset that stands in another place or file, and is not there; one of flags.
_LOST, _FLAGS = "a link that leads nowhere", "true or false"
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
            objects: dict[str, str] = {}
            _collect(h5py, opened, "", groups, source, objects)
    except Exception as error:
        raise InputError(str(path), f"not an HDF5 file: {str(error)[:100]}", "a whole file") from error
    refuse_objects(path, objects, bool(groups), source)
    name = chosen(path, list(groups), source, "group")
    beside = [p.rpartition("/")[2] for p in objects if (p.rpartition("/")[0] or "/") == name]
    # What is left out is still there to be named.
    left_out = {key: (np.empty(0), "") for key in beside if ignored(key, source)}
    return _sheet(path, groups[name] | left_out, source)


def refuse_objects(path: Path, objects: dict[str, str], others: bool, source: Source) -> None:
    """Refuse objects of MATLAB (tables, timetables, times) and arrays of several dimensions where they are meant.

    Parameters
    ----------
    path, source : For the message, and for what is declared.
    objects : Variable -> its class, or its size.
    others : Whether the file holds columns beside them.

    Raises
    ------
    InputError
        For one that a key names, or the first of a file that holds nothing else.
    """
    meant = {source.table, *source.columns, *(split(h)[0] for h in source.columns)}
    for name, kind in objects.items():
        key = name.rpartition("/")[2]
        if key in meant or name in meant or is_quantity(key, source) or (not others and kind not in (_LOST, _FLAGS)):
            if kind == _LOST:
                text = f'the file that it leads to beside this one; or ignore = ["{key[:40]}"] in [[source]]'
                raise InputError(f"{path}, {name[:60]}", kind, text)
            if kind == _FLAGS:
                raise InputError(f"{path}, {name[:60]}", kind, "numbers")
            if "x" in kind:
                raise InputError(f"{path}, {name[:60]}", f"an array of {kind}", "vectors: a variable or a file a run")
            how = "columns as vectors: s = table2struct(t, 'ToScalar', true); save('run.mat', '-struct', 's')"
            how += "; t = timetable2table(tt) before" if kind == "timetable" else ""
            how = "seconds as numbers: seconds(t - t(1))" if kind in ("datetime", "duration") else how
            raise InputError(f"{path}, variable {name[:60]}", f"an object of MATLAB ({kind[:40]})", how)


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


def _collect(h5py: Any, group: Any, name: str, groups: dict[str, Any], source: Source, objects: dict[str, str]) -> None:
    """Columns of every group, by its path; a compound dataset or a matrix is a group of its own."""
    vectors: dict[str, tuple[np.ndarray, str]] = {}
    for key, item in group.items():
        path = f"{name}/{key}".lstrip("/")
        if item is None:
            objects[path] = _LOST
            continue
        if isinstance(item, h5py.Group):
            if not key.startswith("#"):
                _collect(h5py, item, path, groups, source, objects)
            continue
        attributes = {str(k): v for k, v in item.attrs.items() if k not in _OF_STRUCTURE}
        stated = unit(_text(next((v for k, v in attributes.items() if k.lower() in ("units", "unit")), "")))
        if "MATLAB_object_decode" in attributes:
            objects[path] = _text(attributes.get("MATLAB_class"))
        elif h5py.check_ref_dtype(item.dtype) is not None:
            values = _referred(h5py, group.file, item, path, groups, source, objects)
            if values is not None:
                vectors[key] = (values, "")
        elif item.dtype.names:
            table = item[()]
            groups[path] = {n: (np.asarray(table[n]).ravel(), "") for n in item.dtype.names if table[n].ndim == 1}
        elif item.ndim <= 1 or (item.ndim == 2 and 1 in item.shape):
            if item.size and item.dtype.kind in "iufcSUO":
                values = unpacked(np.ravel(item[()]), attributes)
                text = item.dtype.kind in "SUO"
                vectors[key] = (np.array([_text(v) for v in values], dtype=object) if text else values, stated)
        elif item.ndim == 2 and item.dtype.kind in "iuf" and (matrix := _matrix(item, attributes, source)):
            groups[path] = matrix
        elif item.dtype.kind in "iuf":
            objects[path] = " x ".join(map(str, item.shape))
        if item.dtype.kind == "b":
            objects[path] = _FLAGS
    if any(len(v) > 1 for v, _ in vectors.values()):
        groups[name or "/"] = vectors


def _matrix(item: Any, attributes: dict[str, Any], source: Source) -> dict[str, tuple[np.ndarray, str]]:
    """The columns of a matrix that has a name for each; empty for one without."""
    labels = source.names or [_text(v) for v in np.ravel(attributes.get("columns", []))]
    values = unpacked(item[()], attributes)
    # MATLAB stores its columns as rows.
    values = values if len(labels) == values.shape[1] else values.T
    if len(labels) != values.shape[1]:
        return {}
    return {str(n): (values[:, i], "") for i, n in enumerate(labels)}


def _referred(
    h5py: Any, file: Any, item: Any, path: str, groups: dict[str, Any], source: Source, objects: dict[str, str]
) -> np.ndarray | None:
    """What references lead to, as MATLAB 7.3 stores cells and arrays of structs: structs become groups.

    Returns
    -------
    A column where each of them is one number or word, else None.
    """
    values = []
    for i, reference in enumerate(np.ravel(item[()]), start=1):
        target = file[reference] if reference else None
        if isinstance(target, h5py.Group):
            _collect(h5py, target, f"{path}({i})", groups, source, objects)
        elif target is not None and target.dtype.kind in "iuf":
            stored = np.ravel(target[()])
            word = _text(target.attrs.get("MATLAB_class")) == "char"
            values.append("".join(map(chr, stored)) if word else stored[0] if stored.size == 1 else None)
    if len(values) != item.size or any(v is None for v in values):
        return None
    return np.array(values, dtype=object if any(isinstance(v, str) for v in values) else None)


def open_netcdf(path: Path, source: Source) -> Sheet:
    """Variables of one length of a netCDF file, with their attribute ``units``; version 4 is HDF5.

    Raises
    ------
    InputError
        For a file that is not netCDF, or holds no variables of one length.
    """
    with path.open("rb") as stream:
        start = stream.read(4)
    if start == b"\x89HDF":
        return open_hdf5(path, source)
    if start == b"CDF\x05":
        raise InputError(str(path), "a netCDF file of 64-bit data (CDF-5)", "netCDF 3 or 4: nccopy -k netCDF-4")
    from scipy.io import netcdf_file

    try:
        with netcdf_file(str(path), "r", mmap=False) as opened:
            read = [(str(k), np.array(v[...]), v._attributes) for k, v in opened.variables.items()]
            vectors = {
                name: (unpacked(np.atleast_1d(values), attributes), unit(_text(attributes.get("units", ""))))
                for name, values, attributes in read
                if values.ndim <= 1 and values.dtype.kind in "iuf" and values.size
            }
            wide = {k: " x ".join(map(str, v.shape)) for k, v, _ in read if v.ndim > 1 and v.dtype.kind in "iuf"}
    except Exception as error:
        raise InputError(str(path), f"not a netCDF file: {str(error)[:100]}", "a whole file") from error
    refuse_objects(path, wide, any(len(v) > 1 for v, _ in vectors.values()), source)
    if not any(len(v) > 1 for v, _ in vectors.values()):
        raise InputError(str(path), "no variables of one dimension", "variables of one length")
    return _sheet(path, vectors, source)
