"""MATLAB files: version 4 to 7 by scipy, version 7.3 (which is HDF5) by h5py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ident.captive.readers.arrays import array_sheet, chosen, of_one_length
from ident.captive.readers.hdf5 import open_hdf5, refuse_objects
from ident.captive.readers.matlab_elements import damaged
from ident.captive.readers.sheet import Sheet
from ident.captive.source import Source
from sim.files.errors import InputError

# Where a file of version 7.3 says its version, whatever wrote the text before it.
_VERSION_7_3 = b"\x00\x02"
# Bytes of a file that is looked through before it is read.
_LARGEST = 1 << 27


def open_matlab(path: Path, source: Source) -> Sheet:
    """Vectors of one length as columns: of the file, or of the struct or matrix that ``table`` names.

    A matrix has its columns named by ``names``.

    Raises
    ------
    InputError
        For a file that is not MATLAB's, or holds no vectors of one length.
    """
    with path.open("rb") as stream:
        start = stream.read(128)
    if start.startswith((b"\x89HDF", b"MATLAB 7.3")) or start[124:126] == _VERSION_7_3:
        return open_hdf5(path, source)
    if start[126:128] in (b"IM", b"MI") and path.stat().st_size <= _LARGEST and (wrong := damaged(path.read_bytes())):
        raise InputError(str(path), f"not a MATLAB file: {wrong[:100]}", "a whole file of save -v7 or -v7.3")
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabOpaque

    try:
        stored = loadmat(str(path), squeeze_me=True, struct_as_record=False)
    except Exception as error:
        # Reading, unpacking and decoding fail each in their way.
        raise InputError(
            str(path), f"not a MATLAB file: {str(error)[:100]}", "a whole file of save -v7 or -v7.3"
        ) from error
    objects = {
        v["s0"][0].decode("ascii", "replace"): v["s2"][0].decode("ascii", "replace")
        for v in stored.values()
        if isinstance(v, MatlabOpaque)
    }
    variables = {k: v for k, v in stored.items() if not isinstance(v, MatlabOpaque) and not str(k).startswith("__")}
    refuse_objects(path, objects, bool(variables), source)
    return from_variables(path, variables, source)


def from_variables(path: Path, variables: dict[str, Any], source: Source) -> Sheet:
    """Columns among named variables: vectors, structs of vectors (``run.data``, ``run(2)``), matrices."""
    groups: dict[str, dict[str, Any]] = {}
    _collect("", variables, groups)
    vectors = groups.pop("", {})
    if vectors and (not source.table or source.table not in groups):
        if source.table:
            chosen(path, [*groups], source, "variable")
        columns = vectors
    else:
        name = chosen(path, [*groups], source, "variable")
        columns = groups[name]
        if all(k.isdigit() for k in columns):
            if len(source.names) == len(columns["0"]) != len(columns):
                # A channel a row.
                columns = {str(i): row for i, row in enumerate(np.array(list(columns.values())).T)}
            if len(source.names) != len(columns):
                text = f"names = [...] in [[source]], one for each of its {len(columns)} columns"
                raise InputError(f"{path}, variable {name}", f"a matrix and {len(source.names)} names", text)
            columns = dict(zip(source.names, columns.values(), strict=True))
    columns = of_one_length(path, columns, source)
    if not columns:
        raise InputError(str(path), "no vectors", "vectors of one length, a struct of them, or a matrix with names")
    return array_sheet(path, list(columns), list(columns.values()), source)


def _collect(name: str, value: Any, groups: dict[str, dict[str, Any]]) -> None:
    """The groups of columns in a struct, by its path; a matrix, and each of an array of structs, is one of its own."""
    names = getattr(value, "_fieldnames", None)
    fields = value if isinstance(value, dict) else {n: getattr(value, n) for n in names} if names else None
    if fields is not None:
        columns = {k: np.ravel(v) for k, v in fields.items() if _is_column(v)}
        if any(v.size > 1 for v in columns.values()):
            groups[name] = columns
        for key, inside in fields.items():
            _collect(f"{name}.{key}".lstrip("."), inside, groups)
    elif isinstance(value, np.ndarray) and value.ndim == 2 and 1 not in value.shape and value.dtype.kind in "iuf":
        groups[name] = {str(i): column for i, column in enumerate(value.T)}
    elif isinstance(value, np.ndarray) and value.dtype.kind == "O":
        if rows := _of_single_values(value):
            groups[name] = rows
        for i, inside in enumerate(np.ravel(value), start=1):
            if getattr(inside, "_fieldnames", None):
                _collect(f"{name}({i})", inside, groups)


def _of_single_values(structs: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of an array of structs whose fields are single numbers or words: a run each; empty for others."""
    rows = np.ravel(structs)
    names = getattr(rows[0], "_fieldnames", None) if rows.size else None
    if not names or rows.size < 2 or any(getattr(r, "_fieldnames", None) != names for r in rows):
        return {}
    columns = {n: [getattr(r, n) for r in rows] for n in names}
    if any(not isinstance(v, (str, int, float, np.number)) for values in columns.values() for v in values):
        return {}
    return {n: np.array(v, dtype=object if isinstance(v[0], str) else None) for n, v in columns.items()}


def _is_column(value: Any) -> bool:
    """Whether a variable is a vector, or a single number."""
    if isinstance(value, (int, float, complex, np.number)) and not isinstance(value, bool):
        return True
    if not isinstance(value, np.ndarray) or not value.size or value.dtype.kind not in "iufcUSO":
        return False
    structs = value.dtype.kind == "O" and any(getattr(v, "_fieldnames", None) for v in np.ravel(value))
    return not structs and (value.ndim <= 1 or (value.ndim == 2 and 1 in value.shape))
