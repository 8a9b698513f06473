"""Work spread over the processes of a Dask cluster, or done here when there is none."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from ident import __version__
from sim.files.errors import InputError

# A function on many arguments, its results in their order; each is asked for before the next.
Spread = Callable[[Callable[..., Any], Iterable[tuple[Any, ...]]], Iterator[Any]]

# Seconds to wait for an answer of the scheduler.
_PATIENCE = 10
_ADDRESS = "the address of a running scheduler with workers, such as tcp://host:8786"
# Jobs handed out for each thread of the cluster: one runs, the next is there when it is done.
_AHEAD = 2


def here(function: Callable[..., Any], jobs: Iterable[tuple[Any, ...]]) -> Iterator[Any]:
    """A ``Spread`` that does one job after the other in this process."""
    for job in jobs:
        yield function(*job)


def program_version() -> str:
    """The version of this program where it runs."""
    return __version__


def connected(address: str) -> Any:
    """A client of a cluster whose workers have this program.

    Raises
    ------
    InputError
        When ``distributed`` is not installed, the address does not answer, or the cluster has no
        worker or another version of this program.
    """
    try:
        from distributed import Client
        from distributed.comm import resolve_address
    except ImportError as error:
        allowed = "pip install 'ident-submarine[dask]'"
        raise InputError("--dask", "the package distributed is not installed", allowed) from error
    try:
        # A client that failed on a malformed address would complain once more when it is collected.
        resolve_address(address)
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"--dask {address}", f"no scheduler answers: {error}", _ADDRESS) from error
    try:
        versions = set(client.run(program_version).values())
    except Exception as error:
        # What a worker cannot import arrives as a plain Exception with the text of its own.
        client.close()
        allowed = f"workers with ident {__version__}"
        raise InputError(f"--dask {address}", f"workers that cannot run ident: {error}", allowed) from error
    if versions != {__version__}:
        client.close()
        text = f"workers with ident {', '.join(sorted(versions))}" if versions else "a scheduler without workers"
        raise InputError(f"--dask {address}", text, f"workers with ident {__version__}")
    return client


def over(client: Any, address: str, function: Callable[..., Any], jobs: Iterable[tuple[Any, ...]]) -> Iterator[Any]:
    """Results of a function on a cluster, in the order of the jobs, few of which are there at once.

    Parameters
    ----------
    client : From ``connected``.
    address : Of the scheduler, for the message.
    function : Of a module that the workers have.
    jobs : Its arguments; taken as workers become free, so that they may be made one by one.

    Raises
    ------
    InputError
        When the cluster is lost on the way; and what the function raises.
    """
    from distributed import KilledWorker

    most = _AHEAD * max(sum(client.nthreads().values()), 1)
    waiting: deque[Any] = deque()

    def first() -> Any:
        future = waiting.popleft()
        try:
            return future.result()
        except KilledWorker as error:
            raise InputError(f"--dask {address}", "the cluster lost work", "a stable cluster") from error
        finally:
            future.release()

    try:
        for job in jobs:
            waiting.append(client.submit(function, *job, pure=False))
            if len(waiting) >= most:
                yield first()
        while waiting:
            yield first()
    finally:
        for future in waiting:
            future.cancel()


@contextmanager
def cluster(address: str | None) -> Iterator[Spread]:
    """Spreads work over a cluster while it lasts; ``here`` without an address.

    Raises
    ------
    InputError
        As ``connected``.
    """
    if address is None:
        yield here
        return
    client = connected(address)
    with client:
        yield lambda function, jobs: over(client, address, function, jobs)
