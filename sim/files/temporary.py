"""Files on their way: folders for what is temporary, and the step by which a finished file takes its place.

What a killed process left of such a folder is removed by the next that makes one.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import platform
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

_PREFIX = f"ident-{platform.node().replace('/', '_')}-"
# Windows refuses to replace a file while somebody reads it: access denied, sharing violation.
_IN_USE = (5, 32)
# How often that is tried again, and after how long [s].
_TRIES, _PAUSE = 40, 0.05


def is_alive(process: int) -> bool:
    """Whether a process of this machine runs; where that cannot be asked, it is taken to."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def take_place(part: Path, target: Path) -> None:
    """Put a finished file in the place of another, whole at every moment; waits two seconds for who reads that.

    Raises
    ------
    OSError
        When it cannot be; ``part`` is still there then.
    """
    for tries_left in reversed(range(_TRIES)):
        try:
            part.replace(target)
            return
        except PermissionError as error:
            if getattr(error, "winerror", None) not in _IN_USE or not tries_left:
                raise
            time.sleep(_PAUSE)


def folder_of_process() -> Path:
    """A new folder that goes with this process.

    Raises
    ------
    OSError
        When the folder for temporary files takes none.
    """
    _remove_left()
    made = Path(os.path.realpath(tempfile.mkdtemp(prefix=f"{_PREFIX}{os.getpid()}-")))
    atexit.register(_removed_by, os.getpid(), made)
    return made


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """A new folder, removed with its content at the end. Raises as ``folder_of_process``."""
    made = folder_of_process()
    try:
        yield made
    finally:
        shutil.rmtree(made, ignore_errors=True)


def _removed_by(process: int, folder: Path) -> None:
    # A process that was forked has its parent's list.
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


def _remove_left() -> None:
    """Remove folders of this user's killed processes."""
    if os.name != "posix":
        return
    with contextlib.suppress(OSError):
        for entry in os.scandir(tempfile.gettempdir()):
            process = entry.name.removeprefix(_PREFIX).partition("-")[0]
            if not (entry.name.startswith(_PREFIX) and process.isdecimal()):
                continue
            ours = entry.is_dir(follow_symlinks=False) and entry.stat(follow_symlinks=False).st_uid == os.getuid()
            if ours and not is_alive(int(process)):
                shutil.rmtree(entry.path, ignore_errors=True)
