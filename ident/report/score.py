"""The scoreboard on the page of a version: every error, with the tabulated values that its flight was computed from."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ident.report.values import number
from sim.files import inputs
from sim.files.errors import InputError

_HOW = "JSON of this version, written by `ident validate --all --json FILE`"


@dataclass(frozen=True)
class Line:
    """One error of a flight against a reference, as text.

    Attributes
    ----------
    source, channel, unit : What it is an error of.
    rmse, measured_only, published, ratio : Errors of the version, of its runs alone and of the published model;
        the first over the last. Empty where there is none.
    """

    source: str
    channel: str
    unit: str
    rmse: str
    measured_only: str
    published: str
    ratio: str


@dataclass(frozen=True)
class Flown:
    """One case of the scoreboard.

    Attributes
    ----------
    name, place : Of the case, and its number on the page.
    trained : Whether the version was calibrated on it.
    terms : Symbol and number of its values behind the flight, of every term that has some.
    values : How many these are together.
    lines : Its errors.
    failed : Why it was not flown; empty.
    """

    name: str
    place: int
    trained: bool
    terms: tuple[tuple[str, int], ...]
    values: int
    lines: tuple[Line, ...]
    failed: str


@dataclass(frozen=True)
class Score:
    """The scoreboard of one vehicle at one version.

    Attributes
    ----------
    cases : In the order flown.
    behind : Place of a row among the vehicle's rows -> places of the cases that were computed from it.
    """

    cases: tuple[Flown, ...]
    behind: dict[int, list[int]]


def _text(value: float | None) -> str:
    return "" if value is None else number(value, 4)


def _lines(case: dict[str, Any]) -> tuple[Line, ...]:
    return tuple(
        Line(
            source,
            channel,
            error["unit"],
            *(_text(error[k]) for k in ("rmse", "measured_only_rmse", "published_model_rmse", "ratio")),
        )
        for source, channels in case["references"].items()
        for channel, error in channels.items()
    )


def read_score(path: Path, digest: str, rows: int) -> Score:
    """The scoreboard that ``ident validate --all --json`` wrote, for one vehicle.

    Parameters
    ----------
    path : Its file.
    digest : Of the vehicle's rows at the version of the page: cases of other rows are left out.
    rows : How many these are.

    Raises
    ------
    InputError
        For a file that is no scoreboard, or holds no case of these rows.
    """
    try:
        board = json.loads(inputs.statements(path))
        cases = [case for case in board["cases"] if case["database"]["digest"] == digest]
        flown: list[Flown] = []
        behind: dict[int, list[int]] = {}
        for place, case in enumerate(cases):
            used = case.get("rows", {})
            for row in {row for places in used.values() for row in places}:
                if not 0 <= row < rows:
                    raise ValueError(f"row {row} of {rows}")
                behind.setdefault(int(row), []).append(place)
            terms = tuple((symbol, len(places)) for symbol, places in used.items() if places)
            said = str(case.get("failed", ""))
            total = sum(count for _, count in terms)
            flown.append(Flown(case["case"], place, bool(case["trained"]), terms, total, _lines(case), said))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(str(path), f"no scoreboard: {error}", _HOW) from error
    if not flown:
        raise InputError(str(path), f"no case flown with the rows of digest {digest[:16]}", _HOW)
    return Score(tuple(flown), behind)
