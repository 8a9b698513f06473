"""Processes that write versions of a database at once, for tests of several writers."""

from __future__ import annotations

import multiprocessing
import os
from multiprocessing.process import BaseProcess
from typing import Any

import pandas as pd


def _write(
    path: str, rows: pd.DataFrame, mine: int, rounds: int, options: dict[str, str], ready: Any, said: Any
) -> None:
    os.environ.update(options)
    from ident.database.store import commit

    ready.wait()
    for k in range(rounds):
        # Factors that never make one writer's rows those of another: each commit is a version.
        moved = rows.assign(value=rows["value"] * (1.0 + 1e-4 * (1000 * mine + k + 1)))
        said.put(commit(path, moved, {"by": f"{mine}.{k}"}, wait=120.0))


class Writers:
    """Writers at work.

    Parameters
    ----------
    path : Of the database.
    rows : For each writer, what it moves.
    rounds : Commits of each.
    options : Environment of each.
    """

    def __init__(self, path: str, rows: list[pd.DataFrame], rounds: int, options: dict[str, str] | None = None) -> None:
        # One process imports the program, the others are made from it.
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(["ident.database.store"])
        ready, self._said = context.Barrier(len(rows) + 1), context.Queue()
        self._processes: list[BaseProcess] = [
            context.Process(target=_write, args=(path, one, k, rounds, options or {}, ready, self._said))
            for k, one in enumerate(rows)
        ]
        self.by = {f"{k}.{n}" for k in range(len(rows)) for n in range(rounds)}
        for process in self._processes:
            process.start()
        ready.wait(timeout=120.0)

    @property
    def at_work(self) -> bool:
        """Whether one still writes."""
        return any(process.is_alive() for process in self._processes)

    def done(self) -> list[tuple[int, bool]]:
        """What their commits returned, when they are done; all of them ended well."""
        found = [self._said.get(timeout=120.0) for _ in self.by]
        for process in self._processes:
            process.join()
        assert all(process.exitcode == 0 for process in self._processes)
        return found
