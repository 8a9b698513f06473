"""The predicted version: what a boat does before any maneuver is flown, from runs and named estimates.

Estimates come one after the other into the rows that the runs gave; each takes what it can work from and
says so, or says what is missing. None reads a maneuver. ``docs/prediction.md`` has the reasons.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from ident.estimates.draft import Draft, NotApplicable
from ident.estimates.extrapolation import extrapolation
from ident.estimates.facility import axial_in_drift, shared_errors
from ident.estimates.fin_lift import fin_lift
from ident.estimates.lines import from_lines
from ident.estimates.pitching import pure_pitch
from ident.estimates.plane_loads import carried_over, forward_planes, hull_below
from ident.estimates.potential import unmeasured
from ident.estimates.roll import roll_damping
from ident.estimates.sail_vortex import sail_vortex
from ident.estimates.saturation import saturation
from ident.estimates.suction import propeller_suction
from ident.estimates.turning import Given, cross_flow, even_loads
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Method:
    """A named estimate.

    Attributes
    ----------
    name : What ``--without`` takes.
    title, source : For people.
    work : Changes a draft and says what it did; raises ``NotApplicable``.
    """

    name: str
    title: str
    source: str
    work: Callable[[Draft, Given], str]


# What each estimate does; its title and source stand in ``ident/data/estimates.csv``.
_WORK: dict[str, Callable[[Draft, Given], str]] = {
    "lines": from_lines,
    "shared_errors": shared_errors,
    "axial_in_drift": lambda draft, given: axial_in_drift(draft),
    "extrapolation": lambda draft, given: extrapolation(draft),
    "fin_lift": lambda draft, given: fin_lift(draft),
    "saturation": lambda draft, given: saturation(draft),
    "carry_over": lambda draft, given: carried_over(draft),
    "propeller_suction": propeller_suction,
    "tail_downwash": lambda draft, given: forward_planes(draft),
    "hull_below": lambda draft, given: hull_below(draft),
    "sail_vortex": lambda draft, given: sail_vortex(draft),
    "cross_flow": cross_flow,
    "pure_pitch": pure_pitch,
    "roll_damping": roll_damping,
    "even_loads": even_loads,
    "unmeasured": lambda draft, given: unmeasured(draft),
}


@cache
def methods() -> tuple[Method, ...]:
    """Every estimate, in the order in which they work."""
    rows = csv.DictReader((files("ident") / "data" / "estimates.csv").read_text("utf-8").splitlines())
    return tuple(Method(row["name"], row["title"], row["source"], _WORK[row["name"]]) for row in rows)


@dataclass(frozen=True)
class Estimated:
    """What became of one estimate.

    Attributes
    ----------
    name, title, source : Of the method.
    applied : False when it had nothing to work from, or was left out.
    said : What it did, or why not.

    Examples
    --------
    >>> import ident
    >>> (done,) = ident.fit("my-boat/captive", db="coeff_db")
    >>> {one.name for one in done.estimates if one.applied} <= {one.name for one in done.estimates}
    True
    """

    name: str
    title: str
    source: str
    applied: bool
    said: str


def names() -> list[str]:
    """Names of the estimates, in the order in which they work."""
    return [m.name for m in methods()]


def check_names(chosen: Collection[str], where: str) -> None:
    """Refuse names that are no estimate. Raises ``InputError``."""
    for name in chosen:
        if name not in names():
            raise InputError(where, repr(name), f"an estimate: {', '.join(names())}")


def predicted(
    vehicle: Vehicle, rows: pd.DataFrame, given: Given, without: Collection[str] = ()
) -> tuple[pd.DataFrame, list[Estimated]]:
    """Rows of the predicted version, from those that the runs alone gave.

    Parameters
    ----------
    vehicle : Of the rows.
    rows : Measured only.
    given : What estimates need beside the rows.
    without : Estimates to leave out.

    Returns
    -------
    The rows, and what became of each estimate. Rows that no estimate touched are given back as they were.

    Raises
    ------
    InputError
        For a name in ``without`` that is no estimate.
    """
    check_names(without, "estimates to leave out")
    draft, done = Draft.of(vehicle, rows), []
    for method in methods():
        if method.name in without:
            done.append(Estimated(method.name, method.title, method.source, False, "left out"))
            continue
        try:
            said, applied = method.work(draft, given), True
        except NotApplicable as missing:
            said, applied = str(missing), False
        done.append(Estimated(method.name, method.title, method.source, applied, said))
    if not any(one.applied for one in done):
        return rows, done
    return draft.finished(), done
