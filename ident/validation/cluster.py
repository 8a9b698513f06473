"""Batches of flights over a Dask cluster, for those with a machine room."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident import __version__
from sim.files.errors import InputError

Array = NDArray[np.float64]
# Seconds to wait for an answer of the scheduler.
_PATIENCE = 10
_ADDRESS = "the address of a running scheduler with workers, such as tcp://host:8786"


def program_version() -> str:
    """The version of this program where it runs."""
    return __version__


def _connected(address: str) -> Any:
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
        found = set(client.run(program_version).values())
    except Exception as error:
        # What a worker cannot import arrives as a plain Exception with the text of its own.
        client.close()
        allowed = f"workers with ident {__version__}"
        raise InputError(f"--dask {address}", f"workers that cannot run ident: {error}", allowed) from error
    if found != {__version__}:
        client.close()
        text = f"workers with ident {', '.join(sorted(found))}" if found else "a scheduler without workers"
        raise InputError(f"--dask {address}", text, f"workers with ident {__version__}")
    return client


def over_dask(address: str, batch: Any, chunks: Sequence[Array]) -> Iterator[tuple[int, Any]]:
    """Fly chunks of samples on a cluster.

    Parameters
    ----------
    address : Of the scheduler.
    batch : An ``ident.validation.bands.Batch``; its method ``fly`` is called with each chunk on a worker.
    chunks : (k, rows) row values each.

    Yields
    ------
    Place of a chunk and what ``batch.fly`` gave for it, as they are done.

    Raises
    ------
    InputError
        As ``_connected``, or when the cluster is lost on the way.
    """
    client = _connected(address)
    from distributed import KilledWorker, as_completed

    with client:
        there = client.scatter(batch, broadcast=True)
        futures = client.map(type(batch).fly, [there] * len(chunks), list(chunks), pure=False)
        place = {future.key: i for i, future in enumerate(futures)}
        for future in as_completed(futures, loop=client.loop):
            if future.status == "error" and not isinstance(future.exception(), KilledWorker):
                raise future.exception()
            if future.status != "finished":
                raise InputError(f"--dask {address}", f"the cluster lost work: {future.status}", "a stable cluster")
            yield place[future.key], future.result()
            future.release()
