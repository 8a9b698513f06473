"""Whether every run of a campaign says what its test needs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ident.captive.known_tests import tests
from ident.captive.published import TEST as PUBLISHED
from ident.captive.run_table import DIRECT, MEASURED, sigma
from sim.boat.catalogue import OUTPUTS
from sim.boat.parts import parts_of, vehicle_terms
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError


def check_words(folder: Path, runs: pd.DataFrame, allowed: dict[str, list[str]]) -> None:
    """Every text column holds words of its list.

    Parameters
    ----------
    folder : Of the campaign, for the message.
    runs : As read.
    allowed : Column -> its words.

    Raises
    ------
    InputError
        Naming file, row and column of the first word that is another.
    """
    for column, words in allowed.items():
        bad = ~runs[column].isin(words)
        if bad.any():
            run = runs[bad].iloc[0]
            place = f"{folder / run['file']}, row {run['row']}, column {column}"
            raise InputError(place, repr(run[column]), ", ".join(words))


def check_parts(folder: Path, runs: pd.DataFrame, vehicle: Vehicle) -> None:
    """Every run has a part that its test says something of, and levers are those of sections.

    A file that gives the loads of several parts, as solvers write them, may have others beside them: the fit leaves
    those out and says so.

    Parameters
    ----------
    folder : Of the campaign, for the message.
    runs : As read.
    vehicle : For its terms: the part of each, and the tests that identify it.

    Raises
    ------
    InputError
        Naming file, row and column of the first run whose loads would be left out, or whose lever nothing uses.
    """
    parts: dict[str, set[str]] = {}
    for term in vehicle_terms(vehicle):
        for test in term.tests:
            parts.setdefault(test, set()).update(parts_of(term, vehicle))
    sections = {s.name for s in vehicle.sections.centres} if vehicle.sections else set()

    def at(group: pd.DataFrame, column: str) -> str:
        return f"{folder / group['file'].iloc[0]}, row {group['row'].iloc[0]}, column {column}"

    for key, group in runs.groupby(["test", "part"], sort=False):
        test, part = map(str, key)
        useful = parts.get(test, {part}) if test != PUBLISHED else {part}
        if part not in useful:
            beside = runs.loc[(runs["test"] == test) & runs["part"].isin(useful), "file"]
            alone = group[~group["file"].isin(beside)]
            if not alone.empty:
                text = f"{', '.join(sorted(useful))}: no coefficient of another part is identified by {test} runs"
                raise InputError(at(alone, "part"), f"{part!r}, and its loads would be left out", text)
        for lever in ("x", "y", "z"):
            if part not in sections and lever in group and group[lever].notna().any():
                text = "nothing: levers are those of the vehicle file's sections, which alone are compared"
                raise InputError(at(group, lever), f"{group[lever].dropna().iloc[0]:g}, declared and unused", text)


def _doubtful(runs: pd.DataFrame) -> np.ndarray:
    """True for runs that may lack something: where ``check_complete`` has to look."""
    # On arrays: a campaign has a table a file, and a comparison of columns costs more than all of its rows.
    columns = [*MEASURED, *(sigma(o) for o in MEASURED), "rel_sigma"]
    given = runs.reindex(columns=columns).notna().to_numpy()
    size = len(MEASURED)
    loads, errors, relative = given[:, :size], given[:, size:-1], given[:, -1]
    doubtful = (runs["run_id"] == "").to_numpy() | ~loads.any(axis=1) | (~relative & (loads & ~errors).any(axis=1))
    if "U" in runs:
        doubtful |= (runs["U"] < 0).to_numpy()
    named = runs["test"].to_numpy()
    for test in set(named):
        for need in str(tests().loc[test, "requires"]).split():
            quantity = "plane" if need == "delta" else need
            doubtful |= (named == test) & (runs[quantity].isna().to_numpy() if quantity in runs else True)
    known = {text: set(text.split()) <= set(MEASURED) for text in runs["exclude"].unique()}
    doubtful |= ~runs["exclude"].map(known).to_numpy(bool)
    return doubtful


def check_complete(folder: Path, runs: pd.DataFrame, vehicle: Vehicle) -> None:
    """Every run has what its test needs, a load or coefficient, and an error to go with it.

    Parameters
    ----------
    folder : Of the campaign, for the message.
    runs : As read, in SI.
    vehicle : Its term set says whether depth is wanted.

    Raises
    ------
    InputError
        Naming file, row and column of the first run that lacks something.
    """
    # A boat whose coefficients have no axis of depth is asked for none.
    deep = {test for term in vehicle_terms(vehicle) if "D0" in term.axes for test in term.tests}
    for _, run in runs[_doubtful(runs)].iterrows():
        place = f"{folder / run['file']}, row {run['row']}"
        for need in str(tests().loc[run["test"], "requires"]).split():
            if need == "D0" and run["test"] not in deep:
                continue
            quantity = "plane" if need == "delta" else need
            if pd.isna(run.get(quantity, np.nan)):
                raise InputError(f"{place}, column {quantity}", "nothing", f"a number: a {run['test']} run needs it")
        if not run["run_id"]:
            raise InputError(f"{place}, column run_id", "nothing", "a name for the run")
        if run.get("U", np.nan) < 0:
            text = "zero or more: U is a speed, its direction is in alpha and beta"
            raise InputError(f"{place}, column U", str(run["U"]), text)
        measured = [o for o in (*OUTPUTS, *DIRECT) if pd.notna(run.get(o, np.nan))]
        if not measured:
            raise InputError(place, "no load and no coefficient", "at least one of X Y Z K M N, KT KQ, t, value")
        wrong = [w for w in run["exclude"].split() if w not in (*OUTPUTS, *DIRECT)]
        if wrong:
            raise InputError(f"{place}, column exclude", repr(wrong[0]), ", ".join((*OUTPUTS, *DIRECT)))
        relative = run.get("rel_sigma", np.nan)
        if pd.isna(relative):
            bare = [o for o in measured if pd.isna(run.get(f"s_{o}", np.nan))]
            if bare:
                raise InputError(f"{place}, column rel_sigma", "nothing", f"a number, or sigma_{bare[0]}_<unit>")
