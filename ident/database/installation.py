"""What the program runs on: versions, threads, caches, and a test of itself that takes a moment."""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from ident import __version__
from sim.compiled_cache import cache_place

# Packages whose version decides what is computed, written or drawn.
_PACKAGES = (
    "numpy",
    "scipy",
    "pandas",
    "numba",
    "pyarrow",
    "deltalake",
    "matplotlib",
    "pydantic",
    "pint",
    "click",
    "rich",
    "filelock",
    "capytaine",
    "distributed",
)
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True)
class Installation:
    """Versions, threads and caches.

    Attributes
    ----------
    program, python, machine : Names with versions.
    packages : Name -> version, empty when absent.
    threads : ``cores``, and the variables that limit them.
    cache : ``folder`` of compiled functions and its size, ``bytes``.
    self_test : One entry a test, as ``self_test``.
    """

    program: str
    python: str
    machine: str
    packages: dict[str, str]
    threads: dict[str, int | str]
    cache: Cache
    self_test: list[SelfTest]


@dataclass(frozen=True)
class Cache:
    """Where compiled functions of these sources are kept: folder, empty without one, and its size in bytes."""

    folder: str
    bytes: int


@dataclass(frozen=True)
class SelfTest:
    """A test of the installation and its fault, empty when it passed."""

    test: str
    fault: str


def installation() -> Installation:
    """What the program runs on, tested."""
    packages = {}
    for name in _PACKAGES:
        try:
            packages[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            packages[name] = ""
    import sim

    cache = cache_place(Path(sim.__file__).resolve().parent)
    size = sum(p.stat().st_size for p in cache.rglob("*") if p.is_file()) if cache else 0
    return Installation(
        program=f"ident {__version__}",
        python=sys.version.split()[0],
        machine=f"{platform.system()} {platform.machine()}",
        packages=packages,
        threads={"cores": os.cpu_count() or 1, **{k: os.environ[k] for k in _THREADS if k in os.environ}},
        cache=Cache(str(cache or ""), size),
        self_test=self_test(),
    )


def self_test() -> list[SelfTest]:
    """Bundled boats loaded, and rows committed to a database in a temporary folder and read back."""
    results = []
    for name, test in (("bundled vehicles", _vehicles), ("a database, written and read back", _database)):
        try:
            test()
            results.append(SelfTest(name, ""))
        except Exception as error:
            # Whatever goes wrong is what this is for.
            results.append(SelfTest(name, f"{type(error).__name__}: {error}"))
    return results


def _vehicles() -> None:
    import sim.boat.vehicle as module

    for path in sorted((Path(module.__file__).parents[1] / "vehicles").glob("*.toml")):
        module.load_vehicle(path.stem)


def _database() -> None:
    import pandas as pd

    from ident.database.store import commit
    from sim.boat.database import column_order, column_type, digest, read_rows
    from sim.files.temporary import temporary_folder

    cells = {"double": 0.1, "int64": 1, "string": "x"}
    rows = pd.DataFrame([{c: cells[column_type(c)] for c in column_order()}])
    with temporary_folder() as place:
        folder = str(place)
        for factor in (1.0, 2.0):
            commit(folder, rows.assign(value=factor), {"message": "self-test"})
        for number, factor in enumerate((1.0, 2.0)):
            if digest(read_rows(folder, number)[0]) != digest(rows.assign(value=factor)):
                raise ValueError(f"version {number} is not what was committed")
