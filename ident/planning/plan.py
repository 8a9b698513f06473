"""``ident plan``: what a campaign leaves open, and the fewest runs that would settle it.

The unknowns are the tabulated values of ``identify``, the equations of a candidate run are
those it would give there. What is wanted: values of terms without a run, values of terms
whose standard error is above the target, and values beyond the range of the runs. After the
design, the planned runs are put to ``identify`` with the campaign's own: the standard errors
shown are its, errors of everything that is subtracted included.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ident.captive.campaign import Campaign, find_campaigns, read_campaign
from ident.captive.run_table import STATES, run_table
from ident.checks.findings import Body, dynamic
from ident.identification.identify import Identification, identify
from ident.identification.nodes import vanishes
from ident.identification.solver import Solver
from ident.planning.candidates import Facility, candidate_runs, defaults, read_facility
from ident.planning.design import Array, fewest_runs
from ident.planning.matrix import Need, Place, Plan
from sim.boat.catalogue import OUTPUTS, Term
from sim.boat.parts import parts_of, vehicle_terms
from sim.files.errors import InputError


@dataclass
class Block:
    """Equations of one candidate run.

    Attributes
    ----------
    rows : Column -> factor over the standard error, one a load.
    measured : Wanted terms that the run measures.
    sigma : Standard error of each load with an unknown in it [N, N m].
    """

    rows: list[dict[int, float]] = field(default_factory=list)
    measured: dict[str, None] = field(default_factory=dict)
    sigma: dict[str, float] = field(default_factory=dict)


class _Problem:
    """Unknowns and equations of the candidate runs of a campaign."""

    def __init__(self, campaign: Campaign, identified: Identification, target: float) -> None:
        self.campaign, self.target = campaign, target
        solver = Solver(campaign)
        solver.nodes, solver.values = list(identified.nodes), identified.values
        solver.covariance = identified.covariance
        solver.index = {(n.name, n.part, n.point): i for i, n in enumerate(identified.nodes)}
        self.solver = solver
        self.stderr = {k: math.sqrt(max(identified.covariance[i, i], 0.0)) for k, i in solver.index.items()}
        self.sizes = self._sizes()
        self._known_sizes: dict[tuple[str, str], float] = {}
        self.columns: dict[Place, int] = {}
        self.needs: dict[Place, Need] = {}
        self.noise = _Noise(campaign)
        self.poor = self._poor()

    def _sizes(self) -> dict[tuple[str, str], float]:
        groups: dict[tuple[str, str], list[float]] = {}
        for place, i in self.solver.index.items():
            groups.setdefault(place[:2], []).append(float(self.solver.values[i]))
        return {k: math.sqrt(float(np.mean(np.square(v)))) for k, v in groups.items() if any(v)}

    def size(self, term: Term, part: str) -> float:
        """``_size``, looked up."""
        if (term.name, part) not in self._known_sizes:
            self._known_sizes[term.name, part] = self._size(term, part)
        return self._known_sizes[term.name, part]

    def _size(self, term: Term, part: str) -> float:
        """Root mean square of a term's values, or the median of its kind; at least a part of that."""
        kind = (term.group, term.output in "XYZ")
        like = [s for (n, _), s in self.sizes.items() if self._kind(n) == kind]
        every = [s for (n, _), s in self.sizes.items() if self._kind(n)[1] == kind[1]]
        usual = float(np.median(like or every or defaults()["size"]))
        return max(self.sizes.get((term.name, part), usual), defaults()["least_size"][0] * usual)

    def _kind(self, name: str) -> tuple[str, bool]:
        term = self.solver.by_name[name]
        return term.group, term.output in "XYZ"

    def _poor(self) -> set[tuple[str, str]]:
        """Terms whose values are known worse than the target, in the root mean square."""
        groups: dict[tuple[str, str], list[float]] = {}
        for place in self.solver.index:
            groups.setdefault(place[:2], []).append(self.stderr[place] ** 2)
        limit = {k: self.target * self.size(self.solver.by_name[k[0]], k[1]) for k in groups}
        return {k for k, v in groups.items() if math.sqrt(float(np.mean(v))) > limit[k]}

    def why(self, place: Place, term: Term, gap: str) -> str:
        """Why a value is wanted; empty when it is not."""
        name, part, point = place
        if place in self.stderr:
            wanted = (name, part) in self.poor and self.stderr[place] > self.target * self.size(term, part)
            return "standard error" if wanted else ""
        points = [p for n, q, p in self.solver.index if (n, q) == (name, part)]
        if not points:
            return "no run"
        if gap != "value":
            return gap
        for k, axis in enumerate(term.axes):
            moving = axis not in ("U", "alpha", "beta", "delta", "D0", "J", "sgn(w)")
            if moving and abs(point[k]) > max(abs(p[k]) for p in points) * (1.0 + 1e-6):
                return f"{axis} beyond the runs"
        return ""

    def block(self, run: pd.Series) -> Block:
        """Equations of a candidate; unknowns are entered as they come."""
        solver, block = self.solver, Block()
        features = solver.features(run)
        for output in OUTPUTS:
            row: dict[int, float] = {}
            expected = 0.0
            for term, m in solver.active(run, output, features):
                if run["test"] not in term.tests:
                    self._subtracted(row, term, run["part"], m, features)
                    continue
                place, sign = solver.canonical(term.name, run["part"], solver.place(term, features))
                if sign == 0:
                    continue
                key = solver.by_name[place[0]]
                column = self.columns.setdefault(place, len(self.columns))
                factor = sign * solver.scales[term.name] * m
                row[column] = row.get(column, 0.0) + factor
                expected += abs(factor) * self.size(key, place[1])
                why = self.why(place, key, run["why"])
                if why and place not in self.needs:
                    size = self.size(key, place[1])
                    now = self.stderr.get(place, math.nan) / size
                    self.needs[place] = Need(*place, why, size, term.tests, now)
                if why:
                    block.measured[place[0]] = None
            if expected:
                sigma = self.noise.of(run, output, expected)
                block.rows.append({c: v / sigma for c, v in row.items()})
                block.sigma[output] = sigma
        return block

    def _subtracted(self, row: dict[int, float], term: Term, part: str, m: float, features: dict[str, float]) -> None:
        """Values that ``identify`` would subtract: their error limits what a run can tell."""
        for node, weight in (self.solver.row(term, part, features) or {}).items():
            known = self.solver.nodes[node]
            column = self.columns.setdefault((known.name, known.part, known.point), len(self.columns))
            row[column] = row.get(column, 0.0) + self.solver.scales[term.name] * m * weight

    def precision(self) -> Array:
        """Precision of every unknown before the planned runs, errors taken as independent."""
        known = np.zeros(len(self.columns))
        for place, column in self.columns.items():
            size = self.size(self.solver.by_name[place[0]], place[1])
            error = self.stderr.get(place, 0.0)
            known[column] = error if error > 0.0 else defaults()["unknown"][0] * size
        return np.diag(known**-2.0)


class _Noise:
    """Standard error of a planned load: the campaign's own, in prime form, before quality factors."""

    def __init__(self, campaign: Campaign) -> None:
        particulars, runs = campaign.vehicle.particulars, campaign.runs
        self.length = particulars.length.value
        self.body = Body(self.length, campaign.header.fluid.density_kgpm3)
        quality = runs["quality"].map({k: q.factor for k, q in campaign.header.quality.items()}).astype(float)
        pressure = dynamic(runs, self.body)
        self.prime: dict[tuple[str, str, str], float] = {}
        for output in OUTPUTS:
            scale = pressure * (self.length if output in "KMN" else 1.0)
            level = (runs[f"s_{output}"] / quality / scale).where(runs[output] != 0.0)
            for (test, part), values in level.groupby([runs["test"], runs["part"]]):
                if values.notna().any():
                    self.prime[str(test), str(part), output] = float(values.median())
        self.relative = runs.groupby("test")["rel_sigma"].median().to_dict()

    def of(self, run: pd.Series, output: str, expected: float) -> float:
        """Standard error of one load [N, N m]; ``expected`` is its size."""
        relative = self.relative.get(run["test"], math.nan)
        relative = defaults()["relative_error"][0] if math.isnan(relative) else relative
        level = self.prime.get((run["test"], run["part"], output), 0.0)
        turned = sum(float(run[k]) ** 2 for k in ("p", "q", "r") if run[k] == run[k]) * self.length**2
        pressure = 0.5 * self.body.density * self.length**2 * (float(run["U"]) ** 2 + turned)
        floor = level * pressure * (self.length if output in "KMN" else 1.0)
        return max(floor, relative * expected)


def plan(
    folder: str | os.PathLike[str],
    target_rel: float = 0.1,
    facility: str | os.PathLike[str] | Facility | None = None,
) -> Plan:
    """The fewest further runs that give every term of a campaign's vehicle a wanted standard error.

    Parameters
    ----------
    folder : Campaign folder.
    target_rel : Wanted standard error, relative to the size of a term's values.
    facility : TOML file of levels and limits, or what was read from one; the campaign's own
        ranges when None.

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        For more than one campaign, a campaign or facility that cannot be read, or a target that
        is not positive.

    Examples
    --------
    >>> import ident
    >>> plan = ident.plan("my-boat/captive", target_rel=0.2)
    >>> sorted(set(plan.terms["why"]) - {"standard error"})[:1]
    ['no run']
    """
    paths = find_campaigns(Path(folder))
    if len(paths) > 1:
        text = f"one campaign folder, such as {paths[0]}"
        raise InputError(str(folder), f"{len(paths)} campaigns", text)
    limits = facility if isinstance(facility, Facility) or facility is None else read_facility(Path(facility))
    return make_plan(read_campaign(paths[0]), target_rel, limits)


def make_plan(campaign: Campaign, target: float, facility: Facility | None = None) -> Plan:
    """The fewest runs of a facility that bring every term to a relative standard error.

    Parameters
    ----------
    campaign : From ``read_campaign``.
    target : Standard error over size; see ``Need``.
    facility : Limits and levels; from the campaign's own ranges when None.

    Raises
    ------
    InputError
        When the target is not positive.
    """
    if not 0.0 < target < math.inf:
        raise InputError("--target-rel", f"{target:g}", "a positive number, such as 0.1")
    facility = facility or Facility()
    problem = _Problem(campaign, identify(campaign), target)
    candidates = candidate_runs(campaign, facility)
    blocks = [problem.block(run) for _, run in candidates.iterrows()]
    seen: set[tuple[Any, ...]] = set()
    keep = []
    for i, block in enumerate(blocks):
        # A run and its mirror image tell the same; the first of the two is kept.
        shape = tuple(sorted((c, float(f"{abs(v):.6g}")) for row in block.rows for c, v in row.items()))
        if block.measured and shape not in seen:
            seen.add(shape)
            keep.append(i)
    counts = _design(problem, [blocks[i].rows for i in keep], facility.repeats) if keep else np.zeros(0, dtype=int)
    chosen = [(i, int(n)) for i, n in zip(keep, counts, strict=True) if n]
    runs = candidates.iloc[[i for i, _ in chosen]].reset_index(drop=True)
    runs["repeats"] = [n for _, n in chosen]
    runs["identifies"] = [" ".join(blocks[i].measured) for i, _ in chosen]
    for output in OUTPUTS:
        # A load without an unknown has no bearing; its error must only not be zero.
        runs[f"s_{output}"] = [blocks[i].sigma.get(output, 1.0) / math.sqrt(n) for i, n in chosen]
    return Plan(campaign, target, _predict(problem, runs), runs, _untestable(problem))


def _design(problem: _Problem, blocks: list[list[dict[int, float]]], most: int) -> np.ndarray:
    """Repeats of each candidate."""
    used = sorted({c for block in blocks for row in block for c in row})
    at = {c: k for k, c in enumerate(used)}
    dense = []
    for block in blocks:
        rows = np.zeros((len(block), len(used)))
        for r, row in enumerate(block):
            for c, v in row.items():
                rows[r, at[c]] = v
        dense.append(rows)
    target = np.full(len(used), np.inf)
    for place, need in problem.needs.items():
        if problem.columns[place] in at:
            target[at[problem.columns[place]]] = problem.target * need.size
    return fewest_runs(dense, problem.precision()[np.ix_(used, used)], target, most, defaults()["patience"][0])


def _untestable(problem: _Problem) -> dict[str, tuple[str, ...]]:
    """Terms without a value that no candidate reaches."""
    vehicle = problem.campaign.vehicle
    reached = {p[:2] for p in (*problem.needs, *problem.solver.index)}
    untestable = {}
    for term in (t for t in vehicle_terms(vehicle) if t.tests):
        keys = [problem.solver.mirrors[term.name, part] for part in parts_of(term, vehicle)]
        terms_of = {(term.name, part) for part in parts_of(term, vehicle)} | {(m.name, m.part) for m in keys}
        idle = all(vanishes(term, part, vehicle) for part in parts_of(term, vehicle))
        if not idle and not terms_of & reached:
            untestable[term.name] = term.tests
    return untestable


def planned_campaign(campaign: Campaign, runs: pd.DataFrame) -> Campaign:
    """The campaign with the runs of a plan done; standard errors are those of the plan.

    Loads are 1: standard errors of ``identify`` do not depend on them.

    Parameters
    ----------
    campaign : The campaign.
    runs : Of a plan.
    """
    word = min(campaign.header.quality, key=lambda k: campaign.header.quality[k].factor)
    sigma = {f"s_{o}": runs[f"s_{o}"] for o in OUTPUTS}
    done = run_table({c: runs[c] for c in ("run_id", "test", "part", *STATES)} | sigma | dict.fromkeys(OUTPUTS, 1.0))
    done = done.assign(quality=word, file="plan.csv", decoupled="", reason="", source="planned")
    return replace(campaign, runs=pd.concat([campaign.runs, done], ignore_index=True))


def promised(campaign: Campaign, runs: pd.DataFrame, target: float) -> Campaign:
    """The campaign with runs that are under way taken as done, at the standard errors a plan gives them.

    Parameters
    ----------
    campaign : What came back so far.
    runs : Run table of those under way, without loads.
    target : As for ``make_plan``.
    """
    problem = _Problem(campaign, identify(campaign), target)
    runs = runs.assign(why="value", decoupled="", reason="")
    blocks = [problem.block(run) for _, run in runs.iterrows()]
    for output in OUTPUTS:
        runs[f"s_{output}"] = [block.sigma.get(output, 1.0) for block in blocks]
    return planned_campaign(campaign, runs)


def _predict(problem: _Problem, runs: pd.DataFrame) -> tuple[Need, ...]:
    """What is wanted, with the standard errors that ``identify`` gives with the planned runs done."""
    if runs.empty:
        return tuple(problem.needs.values())
    after = identify(planned_campaign(problem.campaign, runs))
    index = {(n.name, n.part, n.point): i for i, n in enumerate(after.nodes)}

    def planned(place: Place, need: Need) -> Need:
        if place not in index:
            return need
        i = index[place]
        return replace(need, planned=math.sqrt(max(after.covariance[i, i], 0.0)) / need.size)

    return tuple(planned(place, need) for place, need in problem.needs.items())
