"""MATLAB files: version 4 to 7 by scipy, version 7.3 (which is HDF5) by h5py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ident.captive.readers.arrays import array_sheet, chosen, of_one_length
from ident.captive.readers.hdf5 import open_hdf5
from ident.captive.readers.sheet import Sheet
from ident.captive.source import Source
from sim.files.errors import InputError


def open_matlab(path: Path, source: Source) -> Sheet:
    """Vectors of one length as columns: of the file, or of the struct or matrix that ``table`` names.

    A matrix has its columns named by ``names``.

    Raises
    ------
    InputError
        For a file that is not MATLAB's, or holds no vectors of one length.
    """
    with path.open("rb") as stream:
        start = stream.read(60)
    if start.startswith((b"\x89HDF", b"MATLAB 7.3")):
        return open_hdf5(path, source)
    from scipy.io import loadmat

    try:
        stored = loadmat(str(path), squeeze_me=True, struct_as_record=False)
    except (ValueError, TypeError, NotImplementedError, OSError, MemoryError, IndexError, KeyError) as error:
        raise InputError(
            str(path), f"not a MATLAB file: {str(error)[:100]}", "a whole file of save -v7 or -v7.3"
        ) from error
    variables = {k: v for k, v in stored.items() if not k.startswith("__")}
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
        for i, inside in enumerate(np.ravel(value), start=1):
            if getattr(inside, "_fieldnames", None):
                _collect(f"{name}({i})", inside, groups)


def _is_column(value: Any) -> bool:
    """Whether a variable is a vector, or a single number."""
    if isinstance(value, (int, float, complex, np.number)) and not isinstance(value, bool):
        return True
    if not isinstance(value, np.ndarray) or not value.size or value.dtype.kind not in "iufcUSO":
        return False
    structs = value.dtype.kind == "O" and any(getattr(v, "_fieldnames", None) for v in np.ravel(value))
    return not structs and (value.ndim <= 1 or (value.ndim == 2 and 1 in value.shape))
