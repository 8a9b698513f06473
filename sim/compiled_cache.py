"""Where compiled functions are cached: one folder for each state of the sources.

numba compares a cached function with the file it stands in only; code inlined from another
file, and constants taken from one, could change unseen. A folder named by a digest of all of
these files makes every edit, and every upgrade, compile afresh.

Imported by ``sim`` itself, before numba: nothing heavy belongs here.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"
PREFIX = "ident-compiled-"

# Folders that stay whatever their age, and the age [s] below which any stays.
_KEPT = 5
_RECENT = 86400.0
_IMPORTS = re.compile(r"^(?:from|import) sim((?:\.\w+)+)(?: import \(?([\w\s,]+))?", re.MULTILINE)


def compiled_sources(folder: Path) -> list[Path]:
    """Modules with cached compiled functions, and what those import from the package.

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
    marks = ("cache=True", "from sim.compiled import")
    todo = [n for n, source in text.items() if any(m in source for m in marks) and not n.startswith("bench.")]
    found: set[str] = set()
    while todo:
        name = todo.pop()
        if name in text and name not in found:
            found.add(name)
            for module, names in _IMPORTS.findall(text[name]):
                todo += [module[1:], *(f"{module[1:]}.{word}" for word in re.split(r"\W+", names))]
    return [folder.joinpath(*name.split(".")).with_suffix(".py") for name in sorted(found)]


def sources_key(folder: Path) -> str:
    """Hexadecimal digest of names, sizes and contents of the ``compiled_sources`` of a folder."""
    digest = hashlib.sha256()
    for path in compiled_sources(folder):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(folder).as_posix()}:{len(content)}:".encode())
        digest.update(content)
    return digest.hexdigest()[:16]


def _candidates(folder: Path) -> Iterator[Path]:
    """Parents for the cache, best first: the user's cache folder, then the package's own."""
    given = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME", "")
    base = Path(given) if os.path.isabs(given) else Path(os.path.expanduser("~")) / ".cache"
    if base.is_absolute():
        yield base / "ident-submarine"
    yield folder / "__pycache__"


def _opened(place: Path) -> bool:
    """Make a folder and mark it as used now; False where that is not allowed."""
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        (place / "used").write_bytes(b"")
    except OSError:
        return False
    return True


def _temporary() -> str:
    """A folder for this process alone, or nothing when there is no place for it either."""
    import atexit
    import shutil
    import tempfile

    try:
        place = tempfile.mkdtemp(prefix=PREFIX)
    except OSError:
        return ""
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return place


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


def use_keyed_cache(folder: Path | None = None) -> None:
    """Point numba at the folder of this state of the sources.

    A place that the user chose stays. One inherited from a parent process that ran this package
    is chosen again: the sources may have changed since. Where no lasting folder can be written,
    one for this process is used: numba's own choice would not see the change of another file.

    Parameters
    ----------
    folder : Path, optional
        Of the package ``sim``; this file's by default.
    """
    config = sys.modules.get("numba.core.config")
    chosen = (os.environ.get(VARIABLE, ""), getattr(config, "CACHE_DIR", ""))
    if any(place and not Path(place).name.startswith(PREFIX) for place in chosen):
        return
    folder = folder or Path(__file__).resolve().parent
    name = PREFIX + sources_key(folder)
    parent = next((parent for parent in _candidates(folder) if _opened(parent / name)), None)
    if parent is not None:
        remove_stale(parent)
    place = str(parent / name) if parent is not None else _temporary()
    os.environ[VARIABLE] = place
    if config is not None:
        # numba reads the environment when it is imported; this process has done that already.
        config.CACHE_DIR = place  # type: ignore[attr-defined]
