"""What surrounds a command: its streams, and the signals that end it wherever it is."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import NoReturn

# What an interrupted command has to end by itself [s]: files half-written are removed, locks are left.
_GRACE = 1.0
# New objects after which Python looks for unused ones that hold each other. While libraries are imported there are
# none, and every look goes through what is there: its own 700 took a tenth of a command; more than this gains nothing.
_LOOKS_AFTER = 20_000


class Asked(BaseException):
    """The process was asked to end, by Ctrl-C (SIGINT) or by SIGTERM.

    No ``KeyboardInterrupt``: libraries answer that one themselves, with other words and another code.

    Attributes
    ----------
    number : Of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number

    @property
    def said(self) -> str:
        """For people."""
        return "Interrupted." if self.number == signal.SIGINT else "Terminated."

    @property
    def code(self) -> int:
        """Exit code, as a shell counts."""
        return 128 + self.number


def ready_streams() -> None:
    """Standard streams that are open and never fail for a character.

    A closed one is a place where everything vanishes; what the terminal's encoding does not have
    is shown as a question mark.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # The lowest number that is free is given: this one. No file opened later may take it.
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def absolute_folders() -> None:
    """Folders of the user that are no absolute path are not there, as the XDG Base Directory Specification says.

    Libraries that take them as they stand would write into the working folder.
    """
    for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME"):
        if not os.path.isabs(os.environ.get(name, "/")):
            del os.environ[name]


@contextlib.contextmanager
def looks_seldom() -> Iterator[None]:
    """Python looks for unused objects that hold each other less often than by itself, as long as a command runs."""
    before = gc.get_threshold()
    gc.set_threshold(_LOOKS_AFTER, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


def silence(name: str) -> None:
    """Let what is left in a stream that takes nothing more vanish, so that the end of Python does not complain."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, getattr(sys, name).fileno())
        os.close(nowhere)


def _ask(number: int, frame: FrameType | None) -> None:
    raise Asked(number)


def _unraisable(before: Callable[[sys.UnraisableHookArgs], object]) -> Callable[[sys.UnraisableHookArgs], object]:
    """Where nothing can be raised, as when an object is deleted, a signal is no fault to be printed."""

    def show(what: sys.UnraisableHookArgs) -> None:
        if not issubclass(what.exc_type, Asked):
            before(what)

    return show


def _watch(pipe: int, ended: threading.Event) -> None:
    """End the process when it does not end by itself: a loop in native code does not look at signals."""
    with os.fdopen(pipe, "rb", buffering=0) as signals:
        while number := signals.read(1):
            if number[0] in (signal.SIGINT, signal.SIGTERM) and not ended.wait(_GRACE):
                os.write(2, (b"\x1b[?25h" if os.isatty(2) else b"") + b"\nEnded.\n")
                os._exit(128 + number[0])


def _leave(code: int) -> NoReturn:
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)


@contextlib.contextmanager
def ends_when_asked() -> Iterator[None]:
    """Ctrl-C and SIGTERM end what runs inside within two seconds, in native code and worker threads too.

    The signal raises ``Asked`` where Python code runs. When a compiled loop, a pool of threads or code that
    swallows it keeps that from happening, the process ends all the same: that is as safe as a kill, which
    leaves no half-written file under its name and no half version in a database.
    """
    if os.name != "posix" or threading.current_thread() is not threading.main_thread():
        yield
        return
    pipe, end = os.pipe()
    os.set_blocking(end, False)
    ended = threading.Event()
    before = {number: signal.signal(number, _ask) for number in (signal.SIGINT, signal.SIGTERM)}
    hook, sys.unraisablehook = sys.unraisablehook, _unraisable(sys.unraisablehook)
    told = signal.set_wakeup_fd(end, warn_on_full_buffer=False)
    threading.Thread(target=_watch, args=(pipe, ended), daemon=True).start()
    try:
        try:
            yield
        except Asked as asked:
            # Before a command began, or after it ended.
            os.write(2, f"\n{asked.said}\n".encode())
            raise SystemExit(asked.code) from None
    except SystemExit as asked:
        if asked.code in (128 + signal.SIGINT, 128 + signal.SIGTERM) and sys.stdout is sys.__stdout__:
            # Python would wait for the threads of a pool, and change the code where it met the signal itself.
            _leave(asked.code)
        raise
    finally:
        ended.set()
        signal.set_wakeup_fd(told)
        for number, handler in before.items():
            signal.signal(number, handler)
        sys.unraisablehook = hook
        os.close(end)
