"""Measured loads of a part, taken off the total: a rudder with its own balance, a thrust column.

What is taken off, where it acts and by what factor is stated in ``[[source.subtract]]``; nothing
is assumed. Tables and time histories share ``Taken``: which loads of the total each column
reduces, and by how much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.campaign_file import CampaignFile
from ident.captive.dimensions import dimensional
from ident.captive.headers import column
from ident.captive.quantities import TAKEN, Column, owner
from ident.captive.readers.sheet import Sheet
from ident.captive.readers.sheet_columns import position
from ident.captive.source import Source, Subtract
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError
from sim.files.frames import Frame

Array = NDArray[np.float64]
# Moments that a force can have.
_MOMENTS = {"X": "MN", "Y": "KN", "Z": "KM"}


@dataclass(frozen=True)
class Taken:
    """One column of a part, and what it takes off the total.

    Attributes
    ----------
    at : Position of the column in the sheet.
    kind : Its quantity, unit and factor to SI.
    shares : Load of the total -> factor on the column in SI; a force also takes its moment off.
    what : The part, in the campaign's words.
    """

    at: int
    kind: Column
    shares: dict[str, float]
    what: str


def taken_columns(sheet: Sheet, source: Source, header: CampaignFile, totals: set[str], where: str) -> list[Taken]:
    """The columns that ``[[source.subtract]]`` names, with what each takes off.

    Parameters
    ----------
    sheet : The open table.
    source : Its ``subtract``.
    header : For the frame and the moment point.
    totals : Loads (harmonics included) that the total gives.
    where : The campaign file.

    Raises
    ------
    InputError
        For a column that is no load, a total that is not measured, or a moment of
        the total to which the part's share is not stated.
    """
    taken = []
    for k, one in enumerate(source.subtract):
        place = f"{where}, key source.subtract.{k}"
        kinds = {}
        for name, declared in one.columns.items():
            at = position(sheet, name)
            kinds[at] = column(
                sheet.header[at], declared, sheet.where, sheet.header[at : at + 1] if one.factor != 1.0 else ()
            )
            if owner(kinds[at].quantity) not in OUTPUTS or kinds[at].quantity.startswith("s_"):
                raise InputError(f"{place}.columns.{name[:60]}", repr(declared), f"a load: {' '.join(OUTPUTS)}")
        given = {kind.quantity for kind in kinds.values()}
        if len(given) < len(kinds):
            raise InputError(f"{place}.columns", "one load of the part twice", "one column a load")
        levers = _levers(one, header)
        _complete(given, totals, levers, one, place)
        for at, kind in kinds.items():
            load, _, harmonic = kind.quantity.partition("_")
            end = f"_{harmonic}" if harmonic else ""
            shares = {kind.quantity: one.factor}
            shares |= {f"{m}{end}": one.factor * arm for (m, f), arm in levers.items() if f == load}
            taken.append(Taken(at, kind, {q: s for q, s in shares.items() if q in totals}, one.what))
    return taken


def _levers(one: Subtract, header: CampaignFile) -> dict[tuple[str, str], float]:
    """(moment, force) -> arm [m] about the campaign's moment point, in its axes and senses; none without ``at_m``."""
    if one.at_m is None:
        return {}
    frame: Frame = header.frame.frame
    point = header.moment_point
    x, y, z = frame.vector(list(np.array(one.at_m) - [point.x_m, point.y_m, point.z_m]))
    arms = {("K", "Z"): y, ("K", "Y"): -z, ("M", "X"): z, ("M", "Z"): -x, ("N", "Y"): x, ("N", "X"): -y}
    return {(m, f): frame.sign(m) * arm * frame.sign(f) for (m, f), arm in arms.items() if arm != 0.0}


def _complete(
    given: set[str], totals: set[str], levers: dict[tuple[str, str], float], one: Subtract, place: str
) -> None:
    """Every load of the part is one of the total, and the moments of its forces are stated."""
    ends = {q[1:] for q in given}
    moved = {f"{force}{end}" for moment, force in levers for end in ends if f"{moment}{end}" in totals}
    for name in sorted(given - totals - moved):
        text = "loads that the total has, or that have an arm in its moments"
        raise InputError(f"{place}.columns", f"{name} of the part, and no {name} of the total", text)
    if one.at_m is not None:
        return
    for end in sorted(ends):
        moments = sorted({m for q in given if q[1:] == end for m in _MOMENTS.get(q[0], "")})
        lost = [f"{m}{end}" for m in moments if f"{m}{end}" in totals - given]
        if lost:
            text = f"the point its forces act at, or columns for its moments about the moment point ({' '.join(lost)})"
            raise InputError(f"{place}.at_m", "nothing", text)


def off_table(
    runs: pd.DataFrame, taken: list[Taken], parts: pd.DataFrame, source: Source, header: CampaignFile, sheet: Sheet
) -> pd.DataFrame:
    """A table of runs with the loads of the parts taken off.

    Parameters
    ----------
    runs : In SI, the campaign's frame, about its moment point; ``U``, ``file``, ``row``.
    taken : From ``taken_columns``.
    parts : Their columns in SI or dimensionless, by position in ``taken``.
    source, header, sheet : For the normalisation, and for the error.

    Returns
    -------
    ``runs`` with the rest in the place of the total, and ``taken_X`` ... what was taken off.

    Raises
    ------
    InputError
        For a blank cell of a part where the total is measured.
    """
    out = runs.copy()
    for i, one in enumerate(taken):
        of_part = runs[["file", "row"]].assign(**({"U": runs["U"]} if "U" in runs else {}))
        of_part[one.kind.quantity] = parts[i].to_numpy()
        primed = {one.kind.quantity} if one.kind.primed else set()
        load = dimensional(of_part, primed, source, header, str(sheet.path))[one.kind.quantity]
        for total, share in one.shares.items():
            bare = load.isna() & out[total].notna()
            if bare.any():
                place = f"{sheet.path}, row {runs['row'][bare].iloc[0]}, column {one.kind.name[:60]}"
                raise InputError(place, "nothing", f"a number wherever {total} is measured: {one.what} is taken off")
            name = f"{TAKEN}{total}"
            out[name] = out.get(name, 0.0) + share * load
            out[total] = out[total] - share * load
    return out


def off_samples(quantities: list[str], taken: list[Taken], factors: Array) -> tuple[list[str], Array]:
    """Columns of a time history to channels with the parts taken off, as one matrix.

    Parameters
    ----------
    quantities : (n,) of the columns that are channels.
    taken : (m,) columns of parts.
    factors : (n + m,) factor to SI of each column, channels first.

    Returns
    -------
    Names of the channels, ``taken_X`` ... last, and the matrix (n + m, channels) from samples to them.
    """
    names = [*quantities, *(f"{TAKEN}{o}" for o in OUTPUTS if any(o in one.shares for one in taken))]
    matrix = np.zeros((len(factors), len(names)))
    matrix[: len(quantities), : len(quantities)] = np.diag(factors[: len(quantities)])
    for i, one in enumerate(taken, start=len(quantities)):
        for total, share in one.shares.items():
            matrix[i, names.index(total)] -= share * factors[i]
            matrix[i, names.index(f"{TAKEN}{total}")] += share * factors[i]
    return names, matrix
