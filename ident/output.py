"""What leaves the program: files, written whole or not at all, tables of a notebook, progress."""

from __future__ import annotations

import contextlib
import errno
import glob
import logging
import os
import platform
import re
import shutil
import stat
import sys
from collections.abc import Callable, Iterable, Iterator
from html import escape
from pathlib import Path
from typing import Any, TypeVar

from sim.files.temporary import is_alive, take_place, temporary_folder

T = TypeVar("T")

_log = logging.getLogger(__name__)

# Told of long work as it goes on: what is being done, how much of it is done, and of how much.
Tell = Callable[[str, int, int], None]

# Folders may be shared with other machines, whose processes this one does not see.
_HOST = platform.node().replace("/", "_")
_WORKSHOP = "unfinished"
_HALF = re.compile(rf"\..*\.{re.escape(_HOST)}\.(\d+)(?:\.[^.]*)?")


def silent(what: str, done: int, of: int) -> None:
    """A ``Tell`` that nobody listens to."""


def refuse_database(path: Path) -> None:
    """Refuse a place inside of a database, whose files are its own. Raises ``InputError``."""
    from sim.files.errors import InputError

    target = Path(os.path.realpath(path))
    if any((above / "_delta_log").is_dir() for above in (target, *target.parents)):
        raise InputError(str(path), "a place inside the database", "a file or folder outside of it")


def check_folder(path: Path) -> None:
    """Refuse a folder that cannot be written to or made. Raises ``InputError``."""
    from sim.files.errors import InputError

    with _as_message(path):
        if path.exists() and not path.is_dir():
            raise InputError(str(path), "a file", "a folder to write to")
        above = next(p for p in (path, *path.absolute().parents) if p.exists())
        if not above.is_dir():
            raise InputError(str(path), f"{above} is a file", "a folder to write to")
        if not os.access(above, os.W_OK | os.X_OK):
            raise InputError(str(path), f"{above} may not be written to", "a folder you may write to")


def check_file(path: Path) -> None:
    """Refuse a file that cannot be written. Raises ``InputError``."""
    from sim.files.errors import InputError

    with _as_message(path):
        if path.is_dir():
            raise InputError(str(path), "a folder", "a file to write")
        if _stream_of(path) is None and not _is_fed(path):
            check_folder(_target(path).parent)
        if path.exists() and not os.access(path, os.W_OK):
            raise InputError(str(path), "a file that may not be written to", "a file you may write to")


def file_at(path: Path, name: str) -> Path:
    """Where a file goes: a path with its ending, that is no folder, is the file itself; else it is in that folder.

    Raises
    ------
    InputError
        For a place that cannot be written to.

    Examples
    --------
    >>> file_at(Path("exported"), "coefficients_v0.json").name, file_at(Path("bb2.json"), "coefficients_v0.json").name
    ('coefficients_v0.json', 'bb2.json')
    """
    if path.suffix == Path(name).suffix and not path.is_dir():
        check_file(path)
        return path
    check_folder(path)
    return path / name


@contextlib.contextmanager
def _as_message(path: Path) -> Iterator[None]:
    """What the file system refuses becomes an ``InputError``."""
    from sim.files.errors import InputError

    try:
        yield
    except OSError as error:
        text = "a pipe that nobody reads" if error.errno == errno.ENXIO else error.strerror or str(error)
        raise InputError(str(path), f"cannot be written: {text}", "a path you may write to") from error


def _target(path: Path) -> Path:
    """Where a file goes: a link stays, and what it points to is written."""
    return Path(os.path.realpath(path)) if path.is_symlink() else path


def _stream_of(path: Path) -> int | None:
    """1 or 2 when the path is this process's own standard output or error, as /dev/stdout is."""
    for stream in (1, 2):
        with contextlib.suppress(OSError):
            if os.path.samestat(path.stat(), os.fstat(stream)) and not stat.S_ISCHR(os.fstat(stream).st_mode):
                return stream
    return None


def _is_fed(path: Path) -> bool:
    """Whether a path is a device or a pipe, which takes what is written and is never replaced.

    Raises
    ------
    sim.files.errors.InputError
        For a disk or a socket.
    """
    from sim.files.errors import InputError

    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return False
    if stat.S_ISBLK(mode) or stat.S_ISSOCK(mode):
        raise InputError(str(path), "a disk" if stat.S_ISBLK(mode) else "a socket", "a file, a device or a pipe")
    return stat.S_ISCHR(mode) or stat.S_ISFIFO(mode)


def _feed(path: Path, part: Path) -> None:
    """Hand a finished file to a device or a pipe, or to standard output where the path is that."""
    stream = _stream_of(path)
    if stream is not None:
        sys.stdout.flush()
        # What stands there already stays: the place in the file is that of standard output.
        handle = os.dup(stream)
    else:
        # A pipe that nobody reads would be waited for without end.
        handle = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))
        if hasattr(os, "O_NONBLOCK"):
            os.set_blocking(handle, True)
    with part.open("rb") as source, open(handle, "wb") as sink:
        shutil.copyfileobj(source, sink)


def _remove_left(path: Path) -> None:
    """Remove what commands that were killed left of ``path``."""
    for left in path.parent.glob(glob.escape(f".{path.stem}.{_HOST}.") + "*" + glob.escape(path.suffix)):
        number = left.name[len(f".{path.stem}.{_HOST}.") : len(left.name) - len(path.suffix)]
        if number.isdecimal() and is_left(left):
            with contextlib.suppress(OSError):
                left.unlink()


def is_left(path: Path) -> bool:
    """Whether a file is half of one that a process of this machine began, which is gone."""
    begun = _HALF.fullmatch(path.name)
    return begun is not None and not is_alive(int(begun[1]))


def _begin(part: Path, like: Path) -> None:
    """Make the empty file that is to take the place of ``like``, with its mode and owner.

    Never through a link that someone else put there.
    """
    with contextlib.suppress(FileNotFoundError):
        part.unlink()
    try:
        old = like.stat()
    except FileNotFoundError:
        os.close(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        return
    os.close(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
    if hasattr(os, "chown"):
        # Only the superuser may give a file away; a group of one's own, everybody.
        for owner, group in ((old.st_uid, -1), (-1, old.st_gid)):
            with contextlib.suppress(OSError):
                os.chown(part, owner, group)
    part.chmod(stat.S_IMODE(old.st_mode))


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A file beside ``path``, of the same suffix, that takes its place once it is written.

    A link stays a link, and the file it points to is written. The mode of a file that is there is
    kept; a new one has what the user's mask leaves. A device and a pipe, standard output among them,
    are not replaced: they are handed the finished file.

    Raises
    ------
    sim.files.errors.InputError
        When it cannot be written; nothing is left then.
    """
    from sim.files import inputs
    from sim.files.errors import InputError

    if inputs.is_read(path):
        raise InputError(str(path), "an input of this command", "another file to write to")
    refuse_database(path)
    with _as_message(path):
        if _stream_of(path) is not None or _is_fed(path):
            with temporary_folder() as folder:
                part = folder / f"part{path.suffix}"
                yield part
                _feed(path, part)
            return
        target = _target(path)
        part = target.with_name(f".{target.stem}.{_HOST}.{os.getpid()}{target.suffix}")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            _remove_left(target)
            _begin(part, target)
            yield part
            size = part.stat().st_size
            take_place(part, target)
            _log.info("file written", extra={"file": str(path), "bytes": size})
        finally:
            with contextlib.suppress(OSError):
                part.unlink()


@contextlib.contextmanager
def workshop(folder: Path) -> Iterator[Path]:
    """A hidden folder inside of one that is being filled, for parts of it that are folders; removed at the end.

    One that a killed command left says that the folder was not finished (``is_begun``), and is removed.

    Raises
    ------
    sim.files.errors.InputError
        When it cannot be made.
    """
    with _as_message(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for left in _left_in(folder):
            shutil.rmtree(left, ignore_errors=True)
        place = folder / f".{_WORKSHOP}.{_HOST}.{os.getpid()}"
        place.mkdir()
    try:
        yield place
    finally:
        shutil.rmtree(place, ignore_errors=True)


def is_begun(folder: Path) -> bool:
    """Whether a command was killed while it filled a folder."""
    return any(_left_in(folder))


def _left_in(folder: Path) -> list[Path]:
    hidden = folder.glob(f".{_WORKSHOP}.*") if folder.is_dir() else ()
    return [p for p in hidden if p.is_dir() and not p.is_symlink() and is_left(p)]


class Results(tuple[T, ...]):
    """Results of one kind, one a campaign, that a notebook shows below each other.

    Examples
    --------
    >>> import ident
    >>> results = ident.check("my-boat/captive")
    >>> len(results), results.to_dict()[0]["campaign"]
    (1, 'my-boat-tank')
    """

    def to_dict(self) -> list[Any]:
        """``to_dict()`` of each, for a program to read."""
        return [one.to_dict() for one in self]  # type: ignore[attr-defined]

    def _repr_html_(self) -> str:
        return "".join(one._repr_html_() for one in self)  # type: ignore[attr-defined]


def html_table(title: str, header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table for a notebook; text is escaped, None shown as a dash."""

    def cells(kind: str, values: Iterable[object]) -> str:
        return "".join(f"<{kind}>{escape('-' if v is None else str(v))}</{kind}>" for v in values)

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    head = f"<thead><tr>{cells('th', header)}</tr></thead>"
    return f"<table><caption>{escape(title)}</caption>{head}<tbody>{body}</tbody></table>"
