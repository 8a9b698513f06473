"""One thing done in another process while this one goes on, and what every process of a command keeps to."""

from __future__ import annotations

import contextlib
import functools
import gc
import logging
import multiprocessing
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

from sim.files import inputs

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

T = TypeVar("T")
_log = logging.getLogger(__name__)
# What ends a command: see ident.commands.process.
_ASKS = (signal.SIGINT, signal.SIGTERM)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def serves() -> None:
    """This process works for a command: Ctrl-C is the command's to answer, and when it ends this one does."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ASKS)


@contextlib.contextmanager
def unheard() -> Iterator[None]:
    """Signals wait: a process that is started meanwhile meets none before it is ready for it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ASKS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# What a piece of work warned of (message, category, file, line), and what it gave or raised.
_Done: TypeAlias = tuple[list[tuple[Any, ...]], object]


def _done(work: Callable[[], object]) -> _Done:
    with warnings.catch_warnings(record=True) as warned:
        try:
            given = work()
        except Exception as error:
            given = error
    return [(w.message, w.category, w.filename, w.lineno) for w in warned], given


def _given(done: _Done) -> Any:
    warned, given = done
    for one in warned:
        warnings.warn_explicit(*one)
    if isinstance(given, Exception):
        raise given
    return given


def withheld(work: Callable[[], T]) -> Callable[[], T]:
    """Work done at once, of which nothing is said before its result is asked for.

    Parameters
    ----------
    work : What to do.

    Returns
    -------
    A function without arguments that gives the result, raising and warning as ``work`` did.
    """
    return functools.partial(_given, _done(work))


def _serve(results: Connection, work: Callable[[], object]) -> None:
    """Do it, and send the files it read, and what came of it."""
    serves()
    # Looking through what the other process holds would copy it.
    gc.freeze()
    done = _done(work)
    results.send((inputs.noted(), done))


@contextlib.contextmanager
def meanwhile(work: Callable[[], T], processes: int | None = None) -> Iterator[Callable[[], T]]:
    """``work()`` done in another process while this one goes on.

    The other is a copy of this one, so that nothing is imported or sent to it. Where a copy may not be made (other
    systems than Linux; one core) the work is done here when it is asked for, and so it is when the other ends before
    its time.

    Parameters
    ----------
    work : What to do; its result is sent from process to process.
    processes : That may be used, this one among them; 0 for one a core. One when None, as in a program of the user's
        own, whose threads a copy would not have.

    Yields
    ------
    A function without arguments: waits for the result and gives it, raising what ``work`` raised. What that read and
    warned of is known from then on, as if it was done here then.
    """
    allowed = 1 if processes is None else processes or cores()
    if sys.platform != "linux" or not hasattr(os, "fork") or min(allowed, cores()) < 2:
        yield work
        return
    context = multiprocessing.get_context("fork")
    results, end = context.Pipe(duplex=False)
    process = context.Process(target=_serve, args=(end, work), daemon=True)
    with unheard():
        process.start()
    end.close()

    def result() -> T:
        try:
            read, done = results.recv()
        except (EOFError, OSError):
            _log.warning("a process that worked for this one has ended: its work is done here")
            return work()
        if read is not None:
            inputs.begin(read | (inputs.noted() or frozenset()))
        return cast("T", _given(done))

    try:
        yield result
    finally:
        results.close()
        process.kill()
