"""Whatever is declared counts: keys of a source and columns of runs that nothing uses are refused."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence

import numpy as np
import pandas as pd

from ident.captive import known_tests
from ident.captive.published import TEST as PUBLISHED
from ident.captive.quantities import HARMONICS, POLAR, Column, owner, split
from ident.captive.run_table import MOTION, STATES
from ident.captive.source import Source
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.files.errors import InputError

# Quantities of a history or of an oscillation that mean nothing in a plain run.
_OF_HISTORIES = ("time", "displacement", "frequency", "amplitude")


class Uses:
    """What of a source its files made use of.

    Parameters
    ----------
    source : One ``[[source]]``.
    where : The campaign file, for the error.

    Attributes
    ----------
    primed : Quantities that were dimensionless.
    beside : What stood in cells beside numbers and was used: ``plus_minus``, ``marks.*``.
    """

    def __init__(self, source: Source, where: str) -> None:
        self.source, self.where = source, where
        self.primed: set[str] = set()
        self._ignored: set[str] = set()
        self._factors: set[str] = set()
        self._words: set[str] = set()
        self.beside: set[str] = set()

    def add(self, other: Uses) -> None:
        """What another file of the source made use of counts too."""
        self.primed |= other.primed
        self._ignored |= other._ignored
        self._factors |= other._factors
        self._words |= other._words
        self.beside |= other.beside

    def whole(self) -> None:
        """All factors are checked where the file is read."""
        self._factors |= set(self.source.factor)

    def columns(self, header: Sequence[str], kinds: Sequence[Column | None]) -> None:
        """Note which columns of a sheet ``ignore`` and ``factor`` name."""
        for name in header:
            self._ignored |= {
                p for p in self.source.ignore if any(fnmatch.fnmatchcase(h, p) for h in (name, split(name)[0]))
            }
        for name, kind in zip(header, kinds, strict=True):
            if kind is not None:
                self._factors |= {name, split(name)[0], kind.quantity, base(kind.quantity)} & set(self.source.factor)

    def translated(self, values: np.ndarray, column: str) -> np.ndarray:
        """Words of a text column in those of this program."""
        if column == "run_id" or not self.source.words:
            return values
        self._words |= set(values) & set(self.source.words)
        return np.array([self.source.words.get(v, v) for v in values], dtype=object)

    def refuse(self) -> None:
        """Refuse what none of the files used.

        Raises
        ------
        InputError
            Naming the key and the reason.
        """
        source = self.source
        for key, given, used, reason in (
            ("ignore", source.ignore, self._ignored, "no column of the files fits it"),
            ("factor", source.factor, self._factors, "no column or quantity of the files has this name"),
            ("words", source.words, self._words, "no text column of the files holds it"),
        ):
            for name in given:
                if name not in used:
                    raise InputError(f"{self.where}, key source.{key}", f"{name[:60]!r}, and {reason}", "what is there")
        if source.plus_minus is not None and "plus_minus" not in self.beside:
            raise InputError(f"{self.where}, key source.plus_minus", "declared, and no cell has such a sign", "nothing")
        for mark in source.marks:
            if f"marks.{mark}" not in self.beside:
                idle_mark = f"{mark!r}, and no number has it behind"
                raise InputError(f"{self.where}, key source.marks", idle_mark, "marks that are there")
        if source.normalisation and not self.primed:
            text = "nothing: every column of the files has a unit, so nothing is made dimensional"
            raise InputError(f"{self.where}, key source.normalisation", repr(source.normalisation), text)


def refuse_axes_of_published(runs: pd.DataFrame, source: Source, where: str) -> None:
    """Refuse axes that are stated for published coefficients, which turn with ``[frame]`` and have no flow.

    Raises
    ------
    InputError
        Naming the key.
    """
    for key, stated in (("axes", source.axes), ("moment_axes", source.moment_axes)):
        if stated and len(runs) and (runs["test"] == PUBLISHED).all():
            text = "nothing: published coefficients are along the axes of [frame]"
            raise InputError(f"{where}, key source.{key}", f"{stated!r}, declared and unused", text)
    if source.moment_axes and len(runs) and not any(o in runs and runs[o].notna().any() for o in "KMN"):
        raise InputError(f"{where}, key source.moment_axes", "declared, and no run has a moment", "nothing")


def base(quantity: str) -> str:
    """The load of a harmonic or a standard error: ``X`` of ``X_in2`` and ``s_X``."""
    return owner(quantity) or quantity


def refuse_idle_quantities(runs: pd.DataFrame) -> None:
    """Refuse quantities that mean nothing in their runs.

    Parameters
    ----------
    runs : Of one file, in SI.

    Raises
    ------
    InputError
        Naming file, row and column, and why nothing would use it.
    """
    ends = {f"{o}_{h}" for o in OUTPUTS for h in (*HARMONICS, *POLAR)}
    for name in runs:
        if name in _OF_HISTORIES or name in ends:
            text = "rows = 'history' or [source.reduction] kind = 'oscillatory': a plain run has none"
            _refuse(runs, runs[name].notna(), str(name), text)
    published = runs["test"] == PUBLISHED
    for name in (*STATES[1:], "R0"):
        if name in runs:
            text = "nothing: a published coefficient has no state (U alone, where its unit needs a speed)"
            _refuse(runs, published & runs[name].notna(), name, text)
    for output in OUTPUTS:
        if f"s_{output}" in runs:
            text = "nothing: a published coefficient has sigma_value or rel_sigma"
            _refuse(runs, published & runs[f"s_{output}"].notna(), f"s_{output}", text)
    if "s_value" in runs and "rel_sigma" in runs:
        text = "nothing: sigma_value is the error of this row"
        # Beside rows without one it is the usual error.
        if runs.loc[published, "s_value"].notna().all():
            _refuse(runs, published & runs["rel_sigma"].notna(), "rel_sigma", text)
    for name, used in (("exclude", ("", "value")), ("decoupled", ("", "False"))):
        if name in runs:
            text = f"nothing{' but value' if name == 'exclude' else ''}: a published coefficient has no loads"
            _refuse(runs, published & ~runs[name].astype(str).str.strip().isin(used), name, text)
    for name in ACCELERATIONS:
        if name in runs:
            text = "zero, or the test acceleration: any other run is steady"
            _refuse(runs, (runs["test"] != "acceleration") & (runs[name].fillna(0.0) != 0.0), name, text)
    for name in ("alpha", "beta"):
        if name in runs and "U" in runs:
            text = "zero or empty: a boat at rest (U = 0) has no angle of flow"
            _refuse(runs, (runs["U"] == 0.0) & (runs[name].fillna(0.0) != 0.0), name, text)
    _refuse_other_states(runs[~published])


def _refuse_other_states(runs: pd.DataFrame) -> None:
    """Refuse states that no coefficient of a run's test depends on: a towed run's yaw rate, an arm's radius."""
    for test in runs["test"].unique():
        if test not in known_tests.tests().index:
            continue
        of_test = runs[runs["test"] == test]
        allowed = known_tests.states(str(test))
        text = f"nothing: no coefficient that a {test} run identifies depends on it"
        for name in (*STATES[1:7], *MOTION[:3], "R0"):
            if name in of_test and name not in (*allowed, "D0"):
                given = of_test[name].notna() if name in ("J", "R0") else of_test[name].fillna(0.0) != 0.0
                _refuse(of_test, given, name, text)
        if test == "open_water" and {"U", "n"} & set(of_test):
            both = [of_test[c].fillna(0.0) if c in of_test else 0.0 * of_test["J"] for c in ("U", "n")]
            text = "U and n together, of which J = U/(nD) is made, or neither"
            name = "U" if "U" in of_test and (both[0] != 0.0).any() else "n"
            if name in of_test and "J" in of_test:
                alone = ((both[0] != 0.0) != (both[1] != 0.0)) & (of_test["J"] != 0.0)
                _refuse(of_test, alone & (of_test[name].fillna(0.0) != 0.0), name, text)
        if "decoupled" not in allowed and "decoupled" in of_test:
            taken_off = "nothing: no load of other terms is taken off such a run"
            _refuse(of_test, of_test["decoupled"].astype(str) == "True", "decoupled", taken_off)


def _refuse(runs: pd.DataFrame, idle: pd.Series, column: str, text: str) -> None:
    if idle.any():
        run = runs[idle].iloc[0]
        raise InputError(
            f"{run['file']}, row {run['row']}, column {column}", f"{run[column]}, declared and unused", text
        )
