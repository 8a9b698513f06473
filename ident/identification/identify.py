"""Identification: the inverse of the term table, stage by stage.

Every load of every run is one linear equation in the tabulated values::

    F_measured = sum_j  scale_j m_j(state) C_j(state)  + error

Stages follow ``data/tests.csv``. In each, the terms that the stage's tests identify are
unknown; all other active terms of the same part are subtracted with the values already
found (the corrected Eqs. A1-A6 are cases of this). Weighted least squares solves each
stage, so that duplicated points are averaged with their weights; the covariance of
everything found so far is carried through each subtraction.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.campaign import Campaign
from ident.captive.known_tests import tests
from ident.cluster import Spread, here
from ident.identification.equations import Runs
from ident.identification.facilities import Between, Left, between, together, widened
from ident.identification.nodes import Node, by_coefficient, table_points
from ident.identification.noted import FitWarning, UnusedLoad
from ident.identification.solver import Solver, check_levers
from ident.identification.wake import wake_fraction
from ident.output import Tell, silent
from sim.boat.catalogue import Term
from sim.boat.parts import Point

Array = NDArray[np.float64]
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Identification:
    """Result of ``identify``.

    Attributes
    ----------
    campaign : What was identified.
    nodes : The tabulated values found, port/starboard folded onto one side.
    values : (n,) coefficients.
    covariance : (n, n) of ``values``.
    unused : Every load that was not used.
    warnings : What is to be said of runs and coefficients that were.
    between : Error between facilities of each load, where several campaigns give it.

    Examples
    --------
    >>> import ident
    >>> (done,) = ident.fit("my-boat/captive", db="coeff_db")
    >>> found = done.identification
    >>> found.covariance.shape == (len(found.nodes), len(found.values))
    True
    """

    campaign: Campaign
    nodes: list[Node]
    values: Array
    covariance: Array
    unused: list[UnusedLoad]
    warnings: list[FitWarning]
    between: tuple[Between, ...] = ()

    def __repr__(self) -> str:
        name, count = self.campaign.header.name, len(self.values)
        return f"Identification({name}: {count} values, {len(self.unused)} loads unused)"

    @cached_property
    def _members(self) -> dict[tuple[str, str], list[int]]:
        return by_coefficient(self.nodes)

    def points(self, term: Term, part: str) -> tuple[list[Point], list[int], list[int]]:
        """Measured and mirrored points of the coefficient of a ``term`` on a ``part``, their node and sign."""
        return table_points(self.nodes, term, part, self.campaign.vehicle, self._members)


def _propulsion_point(solver: Solver, runs: pd.DataFrame) -> None:
    """The wake fraction from the first self-propulsion run that gives revolutions."""
    speeds = runs[(runs["test"] == "self_propulsion") & runs["n"].notna()]
    if "w_T" not in solver.by_name or speeds.empty:
        return
    first = speeds.iloc[0]
    wake = wake_fraction(solver, first)
    if isinstance(wake, str):
        solver.skip(first, "n", wake)
        return
    term = solver.by_name["w_T"]
    node = solver.append((term.name, term.part, ()), *wake)
    solver.nodes[node].runs.append(first["run_id"])
    solver.nodes[node].seen.add((term.part, ()))
    solver.nodes[node].qualities.append(first["quality"])
    for _, run in speeds.iloc[1:].iterrows():
        solver.skip(run, "n", "the wake fraction is taken from the first self-propulsion run that gives n")
    solver.tables.clear()


def identify(campaign: Campaign, tell: Tell = silent, spread: Spread = here) -> Identification:
    """Every coefficient the campaign supports, with covariance.

    Several campaigns of one boat that were put together are fitted twice: the second time with the
    error between facilities that the first one shows (``ident.identification.facilities``).

    Parameters
    ----------
    campaign : From ``read_campaign``.
    tell : Told of the runs of every stage.
    spread : Solves the blocks of unknowns that have nothing to do with one another, here or on a cluster.

    Returns
    -------
    Identification; runs that could not be used are listed with the reason.
    """
    if not campaign.members:
        return _identify(campaign, tell, spread)[0]
    identified, left = _identify(campaign, tell, spread)
    apart = between(left, campaign.runs["campaign"].tolist())
    if any(one.tau > 0.0 for one in apart):
        identified, _ = _identify(replace(campaign, runs=widened(campaign.runs, left, apart)), tell, spread)
        identified = replace(identified, campaign=campaign)
    return replace(identified, between=tuple(apart))


def _identify(campaign: Campaign, tell: Tell, spread: Spread) -> tuple[Identification, Left]:
    """One pass through all stages, and what it leaves of the loads of several campaigns."""
    solver = Solver(campaign)
    check_levers(solver)
    stages = tests()["stage"]
    runs = Runs.of(campaign.runs)
    at = campaign.runs["test"].map(stages).to_numpy()
    done = 0
    for stage in sorted(stages.unique()):
        rows, first = np.flatnonzero(at == stage), len(solver.nodes)
        tell("identifying", done, len(at))
        done += len(rows)
        solver.solve(runs, solver.equations(runs, rows), first, spread)
        values = len(solver.nodes) - first
        _log.debug("stage solved", extra={"stage": int(stage), "runs": len(rows), "values": values})
        solver.tables.clear()
        _propulsion_point(solver, campaign.runs.iloc[rows])
    tell("identifying", len(at), len(at))
    identified = Identification(
        campaign, solver.nodes, solver.values, solver.covariance, solver.unused, solver.warnings
    )
    return identified, together(solver.left)
