"""Standard error while native code runs, whose panics write their trace before they become an exception."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator

_lock = threading.Lock()
_STANDARD_ERROR = 2


class _Held:
    """What is held back, by how many threads, and where standard error goes else."""

    threads = 0
    beyond = -1
    failed = False


@contextlib.contextmanager
def without_panics() -> Iterator[None]:
    """Calls of native code, without what it writes on standard error when it fails: its exception says it.

    What comes to stand there while the calls end well is handed on afterwards. Threads may be in here together.
    """
    if not _hold():
        yield
        return
    well = False
    try:
        yield
        well = True
    finally:
        _release(well)


def _hold() -> bool:
    """Turn standard error aside; False where that cannot be done."""
    with _lock:
        if not _Held.threads:
            # In memory: the disk may be what is full.
            if not hasattr(os, "memfd_create"):
                return False
            try:
                _Held.beyond = os.dup(_STANDARD_ERROR)
            except OSError:
                return False
            memory = os.memfd_create("standard error")
            os.dup2(memory, _STANDARD_ERROR)
            os.close(memory)
            _Held.failed = False
        _Held.threads += 1
        return True


def _release(well: bool) -> None:
    with _lock:
        _Held.threads -= 1
        _Held.failed = _Held.failed or not well
        if _Held.threads:
            return
        said = os.pread(_STANDARD_ERROR, os.fstat(_STANDARD_ERROR).st_size, 0)
        os.dup2(_Held.beyond, _STANDARD_ERROR)
        os.close(_Held.beyond)
        if said and not _Held.failed:
            with contextlib.suppress(OSError):
                os.write(_STANDARD_ERROR, said)
