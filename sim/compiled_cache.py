"""Where compiled functions are kept: one folder for each state of the sources.

numba compares a cached function with the file it stands in only, by its path; code inlined from
another file, and constants taken from one, could change unseen, and a copy of the package
elsewhere would compile again. A folder named by a digest of all of these files makes every edit,
and every upgrade, compile afresh, and serves every copy of the same sources.

What lies there is run. It is believed only when it belongs to the user and nobody else could have
written it. Nothing heavy is imported here.

Processes that compile at the same time take turns: each function is compiled by one of them and read by the
others. Where a system has no locks of records, each compiles what it needs.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import re
import stat
import time
import zlib
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

try:
    import fcntl
except ImportError:  # pragma: no cover
    fcntl = None  # type: ignore[assignment]

VARIABLE = "NUMBA_CACHE_DIR"
PREFIX = "ident-compiled-"
_log = logging.getLogger(__name__)

# Folders that stay whatever their age, and the age [s] below which any stays.
_KEPT = 5
_RECENT = 86400.0
# One that has its turn longer is not waited for: it may have been stopped. How often it is looked for [s].
_PATIENCE, _LOOK = 60.0, 0.01
_IMPORTS = re.compile(r"^(?:from|import) sim((?:\.\w+)+)(?: import (\([^)]*\)|[^\n]*))?", re.MULTILINE)
_MARKS = ("cache=True", "from sim.compiled import")


def compiled_sources(folder: Path) -> list[Path]:
    """Modules with compiled functions that are kept, and what those import from the package.

    Parameters
    ----------
    folder : Of the package ``sim``.

    Returns
    -------
    Paths by name. The benchmarks do not count: nothing is compiled into other modules from them,
    and their own loops call these modules only.
    """
    text = {
        ".".join(path.relative_to(folder).with_suffix("").parts): path.read_text(encoding="utf-8")
        for path in folder.rglob("*.py")
    }
    todo = [n for n, source in text.items() if any(m in source for m in _MARKS) and not n.startswith("bench.")]
    compiled: set[str] = set()
    while todo:
        name = todo.pop()
        if name in text and name not in compiled:
            compiled.add(name)
            for module, names in _IMPORTS.findall(text[name]):
                todo += [module[1:], *(f"{module[1:]}.{word}" for word in re.split(r"\W+", names))]
    return [folder.joinpath(*name.split(".")).with_suffix(".py") for name in sorted(compiled)]


def sources_key(folder: Path) -> str:
    """Hexadecimal digest of names, sizes and contents of the ``compiled_sources`` of a folder."""
    digest = hashlib.sha256()
    for path in compiled_sources(folder):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(folder).as_posix()}:{len(content)}:".encode())
        digest.update(content)
    return digest.hexdigest()[:16]


def is_ours(path: Path) -> bool:
    """Whether a file or folder is the user's own, no link, and nobody else may write it.

    Where a system has no such owners, everything is.
    """
    if not hasattr(os, "geteuid"):
        return True
    try:
        state = os.lstat(path)
    except OSError:
        return False
    kind = stat.S_ISDIR(state.st_mode) or stat.S_ISREG(state.st_mode)
    return kind and state.st_uid == os.geteuid() and not state.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _candidates(folder: Path) -> Iterator[Path]:
    """Parents for the cache, best first: where the user wants it, the user's cache folder, the package's own."""
    chosen = os.environ.get(VARIABLE, "")
    if chosen:
        yield Path(chosen)
        return
    given = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME", "")
    base = Path(given) if os.path.isabs(given) else Path(os.path.expanduser("~")) / ".cache"
    if base.is_absolute():
        yield base / "ident-submarine"
    yield folder / "__pycache__" / "ident-submarine"


def _opened(place: Path) -> bool:
    """Make a folder for the user alone and mark it as used now; False where that cannot be."""
    try:
        place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        place.mkdir(mode=0o700, exist_ok=True)
        if not is_ours(place) or not is_ours(place.parent):
            return False
        (place / "used").write_bytes(b"")
    except OSError:
        return False
    return True


def remove_stale(parent: Path) -> None:
    """Remove the folders of states not used for a day, but for the newest few."""

    def used(place: Path) -> float:
        try:
            return (place / "used").stat().st_mtime
        except OSError:
            return 0.0

    places = sorted(parent.glob(f"{PREFIX}*"), key=used, reverse=True)
    for place in places[_KEPT:]:
        if time.time() - used(place) > _RECENT:
            import shutil

            shutil.rmtree(place, ignore_errors=True)


@lru_cache(maxsize=8)
def cache_place(folder: Path) -> Path | None:
    """The folder of this state of the sources, made when it is not there.

    Parameters
    ----------
    folder : Of the package ``sim``.

    Returns
    -------
    None where no folder can be written, or none is the user's alone: nothing is kept then.
    """
    name = PREFIX + sources_key(folder)
    parent = next((parent for parent in _candidates(folder) if _opened(parent / name)), None)
    _log.debug("compiled functions", extra={"folder": str(parent / name) if parent else "none: compiled each time"})
    if parent is None:
        return None
    remove_stale(parent)
    return parent / name


@lru_cache(maxsize=8)
def _turns(place: Path) -> int:
    """What turns are taken in. Open to the end of the process: with it closed, all of its turns would be over."""
    return os.open(place / "turns", os.O_RDWR | os.O_CREAT, 0o600)


def take_turn(place: Path, name: str) -> None:
    """Wait until no other process has the turn of a name, and take it; a process that ends has given it back.

    After a minute, and where there are no locks, it returns without.

    Parameters
    ----------
    place : From ``cache_place``.
    name : Of what one process at a time shall do.
    """
    if fcntl is None:
        return
    end = time.monotonic() + _PATIENCE
    with contextlib.suppress(OSError):
        turns = _turns(place)
        while time.monotonic() < end:
            try:
                fcntl.lockf(turns, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, zlib.crc32(name.encode()))
            except (BlockingIOError, PermissionError):
                time.sleep(_LOOK)
            else:
                return


def end_turn(place: Path, name: str) -> None:
    """Let the next process have its turn."""
    if fcntl is not None:
        with contextlib.suppress(OSError):
            fcntl.lockf(_turns(place), fcntl.LOCK_UN, 1, zlib.crc32(name.encode()))
