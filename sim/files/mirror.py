"""A database in a folder whose name the storage engine misreads, shown to it under a name that it reads.

The engine follows links before it reads a name, so that a link to the folder does not help: a mirror is a folder
of its own, for as long as this process lives, with a link to every file. What the engine writes there is handed to
the database in the order in which a commit is safe: data, then the entry of the log that names it.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from sim.files.temporary import folder_of_process, take_place, temporary_folder

LOG = "_delta_log"

# Folder -> its mirror, of this process.
_mirrors: dict[tuple[int, str], Path] = {}


def mirrored(real: Path) -> Path:
    """The mirror of a folder as it is now, for reading.

    Parameters
    ----------
    real : The folder, absolute and without links; it need not exist.

    Raises
    ------
    OSError
        When the folder for temporary files takes no folder or no links.
    """
    key = (os.getpid(), os.fspath(real))
    if key not in _mirrors or not _mirrors[key].is_dir():
        _mirrors[key] = folder_of_process()
    _linked(real, _mirrors[key])
    return _mirrors[key]


@contextlib.contextmanager
def handed_over(real: Path) -> Iterator[Path]:
    """A mirror to write to, whose new files are the database's at the end; hold the lock of the folder.

    Raises
    ------
    OSError
        As ``mirrored``, and when the database cannot be written to.
    FileExistsError
        When another writer made the entry of the log meanwhile.
    """
    with temporary_folder() as mirror:
        _linked(real, mirror)
        yield mirror
        for name in _in_order(mirror):
            _hand(mirror / name, real / name, only_once=name.startswith(f"{LOG}/") and name.endswith(".json"))


def _linked(real: Path, mirror: Path) -> None:
    """Make a mirror hold a link to every file of a folder and of its log, and no other."""
    for below in ("", LOG):
        here, there = real / below, mirror / below
        names = {e.name for e in os.scandir(here) if e.is_file()} if here.is_dir() else set()
        if not here.is_dir() and not there.is_dir():
            continue
        there.mkdir(exist_ok=True)
        seen = {e.name for e in os.scandir(there) if e.is_symlink()}
        for name in seen - names:
            (there / name).unlink(missing_ok=True)
        for name in names - seen:
            # Another thread may have linked it.
            with contextlib.suppress(FileExistsError):
                (there / name).symlink_to(here / name)


def _in_order(mirror: Path) -> list[str]:
    """New files of a mirror: data, entries of the log, checkpoints, the note that names the last checkpoint."""
    new = [p for p in mirror.rglob("*") if p.is_file() and not p.is_symlink()]
    names = [p.relative_to(mirror).as_posix() for p in new]

    def turn(name: str) -> tuple[int, str]:
        if not name.startswith(f"{LOG}/"):
            return 0, name
        return (3 if "_last_checkpoint" in name else 1 if name.endswith(".json") else 2), name

    return sorted(names, key=turn)


def _hand(new: Path, target: Path, only_once: bool) -> None:
    """Copy a file into the database: whole, on the disk, and an entry of the log only where there is none."""
    target.parent.mkdir(exist_ok=True)
    # Named as the storage engine names its halves, so that the next commit removes what a kill leaves.
    half = target.with_name(f"{target.name}#1")
    try:
        shutil.copyfile(new, half)
        with half.open("rb+") as copy:
            os.fsync(copy.fileno())
        if only_once:
            os.link(half, target)
        else:
            take_place(half, target)
    finally:
        half.unlink(missing_ok=True)
