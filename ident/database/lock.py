"""One writer at a time in a database folder: who waits says for whom, and does not wait for ever."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import socket
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from ident.options import WAIT
from sim.files.errors import InputError

LOCK = ".lock"
# Who holds the lock; the lock's own file is emptied by everyone who tries it.
OWNER = ".lock.owner"

_log = logging.getLogger(__name__)


@contextlib.contextmanager
def held(folder: Path, wait: float = WAIT) -> Iterator[None]:
    """The lock of a database folder; it falls with its process.

    Parameters
    ----------
    folder : Of the database.
    wait : How long to wait for another writer [s].

    Raises
    ------
    InputError
        When another writer holds it for longer.
    """
    from filelock import FileLock, Timeout

    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        _log.warning("%s: waiting up to %g s for %s", folder, wait, owner(folder))
        try:
            lock.acquire(timeout=wait)
        except Timeout as error:
            text = f"{owner(folder)} still holds the lock after {wait:g} s"
            raise InputError(str(folder), text, "a longer --wait, or that process ended") from error
    try:
        # Whoever waits wants to know; a full disk must not stop the work for it.
        with contextlib.suppress(OSError):
            since = datetime.now(UTC).isoformat(timespec="seconds")
            said = {"pid": os.getpid(), "host": socket.gethostname(), "since": since}
            (folder / OWNER).write_text(json.dumps(said), encoding="utf-8")
        yield
    finally:
        with contextlib.suppress(OSError):
            (folder / OWNER).unlink()
        lock.release()


def owner(folder: Path) -> str:
    """Who holds the lock of a database folder, in words."""
    try:
        said = json.loads((folder / OWNER).read_text(encoding="utf-8"))
        return f"process {said['pid']} on {said['host']}, writing since {said['since']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "another writer that does not say who it is"
