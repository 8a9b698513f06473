"""The predicted version: what a boat does before any maneuver is flown, from runs and named estimates.

Estimates come one after the other into the rows that the runs gave; each takes what it can work from and
says so, or says what is missing. None reads a maneuver. ``docs/prediction.md`` has the reasons.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ident.estimates.draft import Draft, NotApplicable
from ident.estimates.extrapolation import extrapolation
from ident.estimates.facility import axial_in_drift, shared_errors
from ident.estimates.lines import from_lines
from ident.estimates.pitching import pure_pitch
from ident.estimates.plane_loads import carried_over, sail_planes
from ident.estimates.potential import unmeasured
from ident.estimates.roll import roll_damping
from ident.estimates.saturation import saturation
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


METHODS = (
    Method(
        "lines",
        "derivatives, added mass and resistance that no run gives, from the lines",
        "Munk (1924); Hopkins (1951); NACA Report 1307; Lamb (1932); ITTC 1957",
        from_lines,
    ),
    Method("shared_errors", "errors that runs have in common", "the campaign file", shared_errors),
    Method(
        "axial_in_drift",
        "error of the axial force in drift",
        "a small resultant of large pressures",
        lambda draft, given: axial_in_drift(draft),
    ),
    Method(
        "extrapolation",
        "errors of coefficients beyond the rates of their runs",
        "the trend over the runs, continued",
        lambda draft, given: extrapolation(draft),
    ),
    Method(
        "saturation",
        "lift of planes beyond the straight part",
        "Whicker and Fehlner (1958), DTMB Report 933; the campaign's runs",
        lambda draft, given: saturation(draft),
    ),
    Method(
        "carry_over",
        "what a deflected stern plane loads on root, hull and other fins",
        "vortex lattice after NACA Report 1307 (Pitts, Nielsen and Kaattari 1957)",
        lambda draft, given: carried_over(draft),
    ),
    Method(
        "tail_downwash",
        "sail planes with their roots, and their vortices at the stern planes",
        "NACA Report 1307; Katz and Plotkin",
        lambda draft, given: sail_planes(draft),
    ),
    Method(
        "cross_flow",
        "cross-flow along the hull where drift and rotation come together",
        "Allen and Perkins (1951); Feldman (1979); Hoerner (1965); Roshko (1961)",
        cross_flow,
    ),
    Method(
        "pure_pitch",
        "pure pitch with forward speed, where runs have it without",
        "Allen and Perkins (1951); the campaign's runs in heave",
        pure_pitch,
    ),
    Method(
        "roll_damping",
        "roll damping in oscillation, beyond the rates of steady runs",
        "Graham (1980), J. Fluid Mech. 97; the campaign's runs",
        roll_damping,
    ),
    Method(
        "even_loads",
        "loads linear in |r| that the mirror makes even",
        "symmetry",
        even_loads,
    ),
    Method(
        "unmeasured",
        "terms that no run identifies",
        "Kirchhoff's equations (Lamb 1932)",
        lambda draft, given: unmeasured(draft),
    ),
)


@dataclass(frozen=True)
class Estimated:
    """What became of one estimate.

    Attributes
    ----------
    name, title, source : Of the method.
    applied : False when it had nothing to work from, or was left out.
    said : What it did, or why not.
    """

    name: str
    title: str
    source: str
    applied: bool
    said: str


def names() -> list[str]:
    """Names of the estimates, in the order in which they work."""
    return [m.name for m in METHODS]


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
    for method in METHODS:
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
