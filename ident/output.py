"""What leaves the program: files, written whole or not at all, tables of a notebook, progress."""

from __future__ import annotations

import contextlib
import glob
import os
import platform
from collections.abc import Callable, Iterable, Iterator
from html import escape
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")

# Told of long work as it goes on: what is being done, how much of it is done, and of how much.
Tell = Callable[[str, int, int], None]

# Folders may be shared with other machines, whose processes this one does not see.
_HOST = platform.node().replace("/", "_")


def silent(what: str, done: int, of: int) -> None:
    """A ``Tell`` that nobody listens to."""


def check_folder(path: Path) -> None:
    """Refuse a folder that cannot be written to or made. Raises ``InputError``."""
    from sim.files.errors import InputError

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

    if path.is_dir():
        raise InputError(str(path), "a folder", "a file to write")
    check_folder(path.parent)
    if path.exists() and not os.access(path, os.W_OK):
        raise InputError(str(path), "a file that may not be written to", "a file you may write to")


def _remove_left(path: Path) -> None:
    """Remove what commands that were killed left of ``path``: their process is gone from this machine."""
    for left in path.parent.glob(glob.escape(f".{path.stem}.{_HOST}.") + "*" + glob.escape(path.suffix)):
        number = left.name[len(f".{path.stem}.{_HOST}.") : len(left.name) - len(path.suffix)]
        if number.isdecimal() and not is_alive(int(number)):
            with contextlib.suppress(OSError):
                left.unlink()


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


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A file beside ``path``, of the same suffix, that takes its place once it is written.

    Raises
    ------
    sim.files.errors.InputError
        When it cannot be written; nothing is left then.
    """
    from sim.files.errors import InputError

    part = path.with_name(f".{path.stem}.{_HOST}.{os.getpid()}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_left(path)
        yield part
        part.replace(path)
    except OSError as error:
        text = f"cannot be written: {error.strerror or error}"
        raise InputError(str(path), text, "a path you may write to") from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


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
