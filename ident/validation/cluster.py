"""Batches of flights over a Dask cluster, for those with a machine room."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.cluster import connected, over

Array = NDArray[np.float64]


def over_dask(address: str, batch: Any, chunks: Iterable[Array]) -> Iterator[tuple[int, Any]]:
    """Fly chunks of samples on a cluster.

    Parameters
    ----------
    address : Of the scheduler.
    batch : An ``ident.validation.samples.Batch``; its method ``fly`` is called with each chunk on a worker.
    chunks : (k, rows) row values each, taken as workers become free.

    Yields
    ------
    Place of a chunk and what ``batch.fly`` gave for it, in order.

    Raises
    ------
    InputError
        As ``ident.cluster.connected``, or when the cluster is lost on the way.
    """
    client = connected(address)
    with client:
        there = client.scatter(batch, broadcast=True)
        yield from enumerate(over(client, address, type(batch).fly, ((there, chunk) for chunk in chunks)))
