"""Runs as linear equations: one form a state, and a value with its error for every run in it.

What a load says of the tabulated values depends on the state alone, not on what was measured
there. So each state is worked out once, however many runs stand in it, and the equations of a
stage are a form's number, a value and a standard error each.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ident.captive.run_table import MEASURED, STATES, sigma
from sim.files.columns import records

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# What two runs of one state share beside the state itself and which loads they give.
_SHARED = ("test", "part", "decoupled", "coefficient", "exclude", "reason")
# States worked out at once: their records are large.
_CHUNK = 4096
# When a note is given: of every run, where the load is not zero, or where it is beyond two standard errors.
ALWAYS, NONZERO, BEYOND = "always", "nonzero", "beyond"


@dataclass(frozen=True)
class Form:
    """A load (or directly measured coefficient) of a state in the tabulated values.

    Attributes
    ----------
    output : Name of the load.
    unknowns, known : Node -> factor: of values that the stage finds, and of values found before.
    """

    output: str
    unknowns: dict[int, float]
    known: dict[int, float]


@dataclass(frozen=True)
class Note:
    """What is to be said of a load of the runs in a state.

    Attributes
    ----------
    output : Name of the load.
    text : The reason or the message; ``{value:g}`` is filled in.
    unused : True for a load that is left out, False for a warning.
    when : ``ALWAYS``, ``NONZERO`` or ``BEYOND``.
    """

    output: str
    text: str
    unused: bool
    when: str = ALWAYS


@dataclass(frozen=True)
class Equations:
    """The equations of a stage, in the order of runs and loads.

    Attributes
    ----------
    forms : Those that occur.
    form : (equations,) position in ``forms``.
    run : (equations,) row of the run table.
    output : (equations,) position in ``MEASURED``.
    value, sigma : (equations,) what was measured, and its standard error.
    """

    forms: list[Form]
    form: Indices
    run: Indices
    output: Indices
    value: Array
    sigma: Array

    def design(self, first: int) -> tuple[csr_array, csr_array]:
        """Factors of the unknowns, nodes from ``first`` on, and of the known values: (equations, nodes) each.

        What an earlier stage found is known, also to a test that would have identified it.
        """
        top = 1 + max((max(f.unknowns, default=-1) for f in self.forms), default=-1)
        sought = [{node: x for node, x in f.unknowns.items() if node >= first} for f in self.forms]
        given = [
            f.known | {node: x + f.known.get(node, 0.0) for node, x in f.unknowns.items() if node < first}
            for f in self.forms
        ]
        unknowns = _matrix(sought, first, max(top - first, 0))
        known = _matrix(given, 0, first)
        return unknowns[self.form], known[self.form]


def _matrix(rows: list[dict[int, float]], first: int, width: int) -> csr_array:
    """(rows, width) of node -> factor, node ``first`` in the first column."""
    ends = np.cumsum([0, *(len(r) for r in rows)])
    columns = np.array([node - first for r in rows for node in r], dtype=np.int64)
    data = np.array([factor for r in rows for factor in r.values()], dtype=float)
    # Sparse products write where they are told to, also beside the matrix.
    if columns.size and not 0 <= columns.min() <= columns.max() < width:
        raise IndexError(f"nodes {columns.min() + first} to {columns.max() + first} of {first} to {first + width}")
    return csr_array((data, columns, ends), shape=(len(rows), width))


@dataclass
class Runs:
    """The run table in columns, its runs numbered by their state.

    Attributes
    ----------
    table : The run table.
    state : (runs,) number of the state of each run; equal where runs differ in their loads alone.
    first : (states,) the first run of each.
    value, sigma : (runs, measured) loads and coefficients, and their standard errors.
    """

    table: pd.DataFrame
    state: Indices
    first: Indices
    value: Array
    sigma: Array
    _words: dict[str, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, table: pd.DataFrame) -> Runs:
        """Number the runs of a table."""
        value = table.reindex(columns=list(MEASURED)).to_numpy(dtype=float)
        spread = table.reindex(columns=[sigma(o) for o in MEASURED]).to_numpy(dtype=float)
        given = ~np.isnan(value) @ (1 << np.arange(len(MEASURED)))
        keys = [table[c].reset_index(drop=True) for c in (*_SHARED, *STATES) if c in table]
        number = pd.Series(given).groupby([pd.Series(given), *keys], dropna=False, sort=False).ngroup()
        state, _ = pd.factorize(number)
        _, first = np.unique(state, return_index=True)
        return cls(table, state.astype(np.int64), first.astype(np.int64), value, spread)

    def words(self, column: str) -> NDArray[np.object_]:
        """(runs,) text of a column."""
        if column not in self._words:
            self._words[column] = self.table[column].to_numpy(object)
        chosen: NDArray[np.object_] = self._words[column]
        return chosen

    def records(self, states: Indices) -> Iterator[tuple[int, dict[str, Any]]]:
        """The first run of each of some states, as number of the state and column -> value."""
        for at in range(0, len(states), _CHUNK):
            chunk = states[at : at + _CHUNK]
            yield from zip(chunk.tolist(), records(self.table.iloc[self.first[chunk]]), strict=True)

    def origins(self) -> Indices:
        """(runs,) number of the run that each is a copy of, or its own."""
        names, copies = self.words("run_id"), self.words("copy_of")
        return pd.factorize(np.where(copies == "", names, copies))[0].astype(np.int64)
