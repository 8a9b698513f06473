"""Files of a database where they lie: in a folder, or under the URL of an object store."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sim.files.errors import InputError
from sim.files.mirror import handed_over, mirrored
from sim.files.temporary import take_place


def is_url(path: str) -> bool:
    """Whether a database lies in an object store."""
    return "://" in path


# What the storage engine takes for something else in the address of a folder, or does not take at all.
_MISREAD = re.compile(r"[\[\]\\^|\x00-\x1f\x7f\ud800-\udfff]|%[0-9A-Fa-f]{2}")

# Sequences that colour a terminal.
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def address(path: str) -> str:
    """Address of a database for the storage engine: a URL, in which ``#``, ``?`` and blanks are themselves.

    A folder whose name the engine misreads is read by its mirror (``sim.files.mirror``), as it is at this
    moment; to write, see ``written_to``.

    Raises
    ------
    InputError
        For such a folder where no mirror can be made.
    """
    if is_url(path):
        return path
    # Links are followed by the engine too.
    real = Path(os.path.realpath(path))
    if not _MISREAD.search(real.as_posix()):
        return real.as_uri()
    with _mirror(path):
        return _read(mirrored(real)).as_uri()


@contextlib.contextmanager
def written_to(path: str) -> Iterator[str]:
    """Address of a database for the storage engine to write to; what it wrote is there at the end.

    Hold the lock of a folder.

    Raises
    ------
    InputError
        As ``address``.
    OSError
        When what was written cannot be handed to the database, as when another writer was faster.
    """
    real = Path(path if is_url(path) else os.path.realpath(path))
    if is_url(path) or not _MISREAD.search(real.as_posix()):
        yield address(path)
        return
    with contextlib.ExitStack() as stack:
        with _mirror(path):
            place = _read(stack.enter_context(handed_over(real))).as_uri()
        yield place


def _read(mirror: Path) -> Path:
    if _MISREAD.search(mirror.as_posix()):
        raise OSError(f"the folder for temporary files is misread too, {mirror.parent}")
    return mirror


@contextlib.contextmanager
def _mirror(path: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        text = f"a name that the storage engine misreads, and no mirror of the folder: {error}"
        raise InputError(
            path, text, "room for temporary files, or a folder named without [ ] | ^ \\ and %20"
        ) from error


def brief(error: BaseException) -> str:
    """What the storage engine says, in one line and without its own trace."""
    lines = _COLOUR.sub("", str(error)).split("   0: ")[0].splitlines()
    return ": ".join(" ".join(line.strip(" \t↳") for line in lines if line.strip()).split(" ↳ "))[:300]


@contextlib.contextmanager
def engine(where: str, doing: str, allowed: str) -> Iterator[None]:
    """Calls of the storage engine: whatever it throws becomes one message.

    Parameters
    ----------
    where, doing, allowed : Of the ``InputError``; ``doing`` is followed by what the engine says.

    Raises
    ------
    InputError
        For every failure of the engine, a panic of its native code among them.
    """
    from deltalake.exceptions import DeltaError
    from pyarrow import ArrowException

    try:
        yield
    except InputError:
        raise
    except (
        DeltaError,
        ArrowException,
        OSError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        MemoryError,
    ) as error:
        raise InputError(where, f"{doing}: {brief(error)}", allowed) from error
    except BaseException as error:
        # A panic of native code is no ``Exception``; early releases of the engine throw one without a kind.
        if type(error) is not Exception and type(error).__name__ != "PanicException":
            raise
        raise InputError(where, f"{doing}: {brief(error)}", allowed) from error


class Storage:
    """The files below a folder or URL.

    Parameters
    ----------
    path : Folder, or URL of an object store (its options are taken from the environment).

    Raises
    ------
    InputError
        As ``address``, and when an object store cannot be reached.
    """

    def __init__(self, path: str) -> None:
        self.path = path
        self._remote: Any = None
        if is_url(path):
            from deltalake.fs import DeltaStorageHandler
            from pyarrow.fs import PyFileSystem

            with engine(path, "cannot be reached", "an object store the storage engine knows"):
                self._handler = DeltaStorageHandler(path)
                self._remote = PyFileSystem(self._handler)
        else:
            address(path)

    @property
    def local(self) -> Path | None:
        """The folder, None for an object store."""
        return None if self._remote else Path(self.path)

    def sizes(self, folder: str = "") -> dict[str, int]:
        """Name and size [bytes] of every file in a folder; empty when there is none.

        Raises
        ------
        InputError
            When the folder cannot be read.
        """
        with engine(self.path, "cannot be read", "a database you may read"):
            if self._remote is None:
                where = Path(self.path) / folder
                if not where.is_dir():
                    return {}
                sizes = {}
                for item in os.scandir(where):
                    with contextlib.suppress(FileNotFoundError):
                        if item.is_file():
                            sizes[item.name] = item.stat().st_size
                return sizes
            from pyarrow.fs import FileSelector, FileType

            selector = FileSelector(folder or "/", allow_not_found=True, recursive=False)
            return {
                Path(info.path).name: info.size or 0
                for info in self._remote.get_file_info(selector)
                if info.type == FileType.File
            }

    def read(self, name: str) -> bytes | None:
        """Content of a file; None when it is not there. Raises ``InputError`` when it cannot be read."""
        with engine(f"{self.path}/{name}", "cannot be read", "a file you may read"):
            if self._remote is None:
                try:
                    return (Path(self.path) / name).read_bytes()
                except FileNotFoundError:
                    return None
            try:
                with self._remote.open_input_file(name) as file:
                    return bytes(file.read())
            except FileNotFoundError:
                return None

    def write(self, name: str, content: bytes) -> None:
        """Write a file whole or not at all. Raises ``InputError`` when it cannot be written."""
        with engine(f"{self.path}/{name}", "cannot be written", "a path you may write to"):
            if self._remote is None:
                target = Path(self.path) / name
                part = target.with_name(f"{target.name}.{os.getpid()}.part")
                try:
                    part.write_bytes(content)
                    flush(part)
                    take_place(part, target)
                finally:
                    part.unlink(missing_ok=True)
                flush(target.parent)
            else:
                # pyarrow hands its own buffers on, which the engine's files do not take.
                file = self._handler._handler.open_output_stream(name, None)
                file.write(content)
                file.close()  # type: ignore[attr-defined]

    def remove(self, name: str) -> None:
        """Remove a file that is there. Raises ``InputError`` when it cannot be removed."""
        with engine(f"{self.path}/{name}", "cannot be removed", "a file you may remove"):
            if self._remote is None:
                (Path(self.path) / name).unlink(missing_ok=True)
            else:
                self._remote.delete_file(name)


def flush(path: Path) -> None:
    """Hand a file or folder over to the disk; returns when it is there."""
    # Folders cannot be opened on Windows, which flushes their entries with the file.
    posix = hasattr(os, "O_DIRECTORY")
    if path.is_dir() and not posix:
        return
    # Windows flushes only what was opened to be written.
    handle = os.open(path, os.O_RDONLY if posix else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
