"""What commits that did not finish left in a database: found by the log, which names every finished file."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping
from pathlib import Path

from ident.database.lock import LOCK, WAIT, held
from sim.boat.database import open_table
from sim.boat.delta_log import LATEST, LOG, Log, has_versions, latest_said
from sim.files.errors import InputError
from sim.files.storage import Storage

# Names that the storage engine gives to data, and to parts of what it writes.
_DATA = re.compile(r"part-\d{5}-[0-9a-f-]{36}-c\d{3}(?:\.\w+)?\.parquet(?:#\d+)?")
_LOG_PART = re.compile(
    r"_commit_[0-9a-f-]{36}\.json\.tmp|\d{20}\.(?:json|checkpoint\.parquet)#\d+|_last_checkpoint#\d+"
)
_NOTE_PART = re.compile(re.escape(LATEST) + r"\.\d+\.part")


def unfinished(path: str) -> dict[str, int]:
    """Files of commits that did not finish.

    Parameters
    ----------
    path : Folder or object-store URL of the database. A writer at work has such files too:
        hold the lock of the folder.

    Returns
    -------
    Name -> size [bytes], relative to ``path``: data files that no entry of the log names, and
    halves of files. Empty where the log does not begin at version 0: its lost entries may
    have named them.

    Raises
    ------
    InputError
        When the database cannot be read or an entry is missing: its data must not be removed.
    """
    storage = Storage(path)
    here, log_files = storage.sizes(), storage.sizes(LOG)
    halves = {name: size for name, size in here.items() if _NOTE_PART.fullmatch(name)}
    halves |= {f"{LOG}/{name}": size for name, size in log_files.items() if _LOG_PART.fullmatch(name)}
    data = {name: size for name, size in here.items() if _DATA.fullmatch(name)}
    if not has_versions(path):
        # Only where a first fit of this program began; other data is someone else's.
        return halves | data if LOCK in here else {}
    last = _empty_entry(storage, log_files)
    if last:
        halves[last] = 0
    log = Log(path, but=last)
    if log.first > 0:
        return halves
    for number in range(log.first, log.last + 1):
        content = storage.read(f"{LOG}/{number:020d}.json") or b""
        for name in _DATA.findall(content.decode(errors="replace")):
            data.pop(name, None)
    return halves | data


def _empty_entry(storage: Storage, log_files: Mapping[str, int]) -> str:
    """The last entry of the log, when it is empty and was never said to be committed."""
    last = max((name for name in log_files if re.fullmatch(r"\d{20}\.json", name)), default="")
    if not last or log_files[last]:
        return ""
    said = latest_said(storage)
    return f"{LOG}/{last}" if said is not None and said < int(last[:20]) else ""


def remove_unfinished(path: str) -> dict[str, int]:
    """Remove what ``unfinished`` names, and return it; raises as it does."""
    leftovers = unfinished(path)
    storage = Storage(path)
    for name in leftovers:
        storage.remove(name)
    return leftovers


def vacuum(path: str, wait: float = WAIT, dry_run: bool = False) -> dict[str, int]:
    """Remove the files of commits that did not finish, no writer being at work.

    Parameters
    ----------
    path : Folder or object-store URL of the database.
    wait : How long to wait for a writer [s].
    dry_run : Only name the files.

    Returns
    -------
    Name -> size [bytes], as ``unfinished``.

    Raises
    ------
    InputError
        When there is no database, it is damaged, or a writer holds it for longer.
    """
    local = Storage(path).local
    if local is None or not (local / LOCK).exists() or has_versions(path):
        # Files that no log of this program names may be anyone's.
        open_table(path)
    try:
        with contextlib.nullcontext() if local is None else held(local, wait):
            return unfinished(path) if dry_run else remove_unfinished(path)
    except OSError as error:
        raise InputError(path, f"cannot be written: {error}", "a folder you may write to") from error


def check_foreign(folder: Path) -> None:
    """Refuse a folder that holds data of something else. Raises ``InputError``."""
    if not folder.is_dir() or (folder / LOCK).exists() or has_versions(str(folder)):
        return
    foreign = sorted(p.name for p in folder.glob("*.parquet"))
    if foreign:
        text = f"Parquet files that are of no database ({foreign[0]})"
        raise InputError(str(folder), text, "an empty or new folder, or a database `ident fit` wrote")
