"""Which files a command has read, so that it does not write over them."""

from __future__ import annotations

import os
from contextvars import ContextVar
from pathlib import Path

_read: ContextVar[set[Path] | None] = ContextVar("files a command has read", default=None)


def begin() -> None:
    """From here on files are noted; without it, as in a program of the user's own, they are not."""
    _read.set(set())


def note(path: Path) -> None:
    """A file is read."""
    files = _read.get()
    if files is not None:
        files.add(Path(os.path.realpath(path)))


def is_read(path: Path) -> bool:
    """Whether a file has been read since ``begin``."""
    return Path(os.path.realpath(path)) in (_read.get() or ())
