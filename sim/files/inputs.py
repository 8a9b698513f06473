"""Which files a command has read, so that it does not write over them."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable
from contextvars import ContextVar
from pathlib import Path

from sim.files.errors import InputError

_log = logging.getLogger(__name__)
# Files of statements are written by hand [bytes]; data stand in tables.
_LARGEST_STATEMENT = 1 << 24
_read: ContextVar[set[Path] | None] = ContextVar("files a command has read", default=None)


def begin(read: Iterable[Path] = ()) -> None:
    """From here on files are noted; without it, as in a program of the user's own, they are not.

    Parameters
    ----------
    read : Files that count as read already: in a process that works for another.
    """
    _read.set(set(read))


def noted() -> frozenset[Path] | None:
    """The files read since ``begin``; None without it."""
    files = _read.get()
    return None if files is None else frozenset(files)


def note(path: Path) -> None:
    """A file is read."""
    _log.debug("file read", extra={"file": str(path)})
    files = _read.get()
    if files is not None:
        files.add(Path(os.path.realpath(path)))


def is_read(path: Path) -> bool:
    """Whether a file has been read since ``begin``."""
    return Path(os.path.realpath(path)) in (_read.get() or ())


def check_regular(path: Path) -> None:
    """Refuse a pipe or a device, which may never end; what is not there, and a folder, is said where it is read."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(str(path), "a pipe or a device", "a file that somebody wrote")


def statements(path: Path) -> bytes:
    """Content of a file of statements, campaign, vehicle or case, which is noted as read.

    Raises
    ------
    InputError
        For a file that may not be read, or is none that somebody wrote.
    """
    note(path)
    try:
        check_regular(path)
        size = path.stat().st_size
        if size > _LARGEST_STATEMENT:
            raise InputError(str(path), f"{size} bytes", f"a TOML file of {_LARGEST_STATEMENT} bytes at most")
        return path.read_bytes()
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror}", "a file you may read") from error
