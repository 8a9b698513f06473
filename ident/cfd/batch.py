"""``ident plan --cases``: what is missing as a batch of cases, asked again with what came back."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from ident.captive.campaign import Campaign, find_campaigns, read_campaign
from ident.captive.combine import combined
from ident.captive.conversions import to_full_scale
from ident.captive.run_table import STATES, run_table
from ident.cfd.case import Case
from ident.cfd.matrix import Matrix, MeshedBoat, is_matrix, read_matrix, write_matrix
from ident.cfd.surfaces import Lines, read_surface
from ident.cfd.template import Template, read_template
from ident.output import Tell, silent
from ident.planning.candidates import Facility, read_facility
from ident.planning.matrix import Plan
from ident.planning.plan import make_plan, promised
from sim.files.errors import InputError


@dataclass(frozen=True)
class Batch:
    """What was asked for and what was written.

    Attributes
    ----------
    plan : Of what is missing, with the runs that came back.
    lines : The surface, with its numbers beside the vehicle file's.
    matrix : All cases; None where nothing was written: every wanted standard error is reached, or no state of the
        facility that is not computed yet would help.
    outstanding : Cases of earlier batches that are not back; the plan takes them as run.
    unreached : Terms that are known worse than wanted where nothing was written.

    Examples
    --------
    >>> import ident
    >>> batch = ident.plan_cases("lines/captive", "lines/hull.stl", "lines/template.toml", "cases")  # doctest: +SKIP
    >>> len(batch.matrix.new)  # doctest: +SKIP
    12
    """

    plan: Plan
    lines: Lines
    matrix: Matrix | None
    outstanding: tuple[str, ...]
    unreached: tuple[str, ...] = ()

    def __repr__(self) -> str:
        if self.matrix is None:
            return f"Batch({self.plan!r}; no case written)"
        made = f"{len(self.matrix.new)} new of {len(self.matrix.cases)} cases"
        return f"Batch({self.plan!r}; {made} in {self.matrix.folder})"

    def to_dict(self) -> dict[str, Any]:
        """For a program to read."""
        made = None if self.matrix is None else self.matrix.to_dict()
        checks = [{k: (v if v == v else None) for k, v in vars(one).items()} for one in self.lines.checks]
        return {
            **self.plan.to_dict(),
            "surface": checks,
            "matrix": made,
            "outstanding": list(self.outstanding),
            "unreached": list(self.unreached),
        }


def plan_cases(
    folder: str | os.PathLike[str],
    surface: str | os.PathLike[str],
    template: str | os.PathLike[str],
    out: str | os.PathLike[str],
    target_rel: float = 0.1,
    facility: str | os.PathLike[str] | Facility | None = None,
    tell: Tell = silent,
) -> Batch:
    """Write a case for every run that is missing, or none when every wanted standard error is reached.

    Parameters
    ----------
    folder : Campaign folder, or one that holds several of the same boat; a campaign without runs will do.
    surface : STL file with a solid for each patch, or a folder of STL files.
    template : TOML file of what all cases share.
    out : Folder of the matrix. One that is there is added to, and its runs that came back count.
    target_rel : Wanted standard error, relative to the size of a term's values.
    facility : TOML file of levels and limits, or what was read from one.
    tell : Told of what is done.

    Returns
    -------
    Batch

    Raises
    ------
    InputError
        For anything of campaign, facility, surface or template that is not right; no case is written then.

    Examples
    --------
    >>> import ident
    >>> batch = ident.plan_cases("lines/captive", "lines/hull.stl", "lines/template.toml", "cases")  # doctest: +SKIP
    """
    place, made_by = Path(out), Path(template)
    limits = facility if isinstance(facility, Facility) else read_facility(Path(facility)) if facility else Facility()
    shared = read_template(made_by)
    campaign, vehicle_file, back = _campaign(Path(folder), place)
    lines = read_surface(Path(surface), shared, campaign.vehicle, str(made_by))
    tell("planning", 0, 1)
    outstanding: list[Case] = []
    if is_matrix(place):
        _same_template(place, shared)
        outstanding = [c for c in read_matrix(place).cases if c.run_id not in back and c.test != "self_propulsion"]
        if outstanding:
            campaign = promised(campaign, _table(outstanding, shared), target_rel)
    # A computation gives the same numbers again: it is not repeated.
    plan = make_plan(campaign, target_rel, limits.model_copy(update={"repeats": 1}))
    wanted = [need for need in plan.needs if not need.now <= target_rel * (1.0 + 1e-6)]
    names = tuple(c.run_id for c in outstanding)
    if is_matrix(place):
        plan = replace(plan, runs=_fresh(plan.runs, read_matrix(place).cases, shared))
    if not wanted or plan.runs.empty:
        return Batch(plan, lines, None, names, tuple(dict.fromkeys(need.name for need in wanted)))
    if shared.disc and is_matrix(place) and any(c.test == "self_propulsion" for c in read_matrix(place).cases):
        shared = shared.model_copy(update={"disc": []})
    matrix = write_matrix(
        plan.runs, MeshedBoat(campaign.vehicle, vehicle_file, lines), shared, place, str(made_by), tell
    )
    return Batch(plan, lines, matrix, names)


def _fresh(runs: pd.DataFrame, cases: list[Case], template: Template) -> pd.DataFrame:
    """Planned runs that no case has yet."""

    def key(run: pd.Series) -> tuple[object, ...]:
        numbers = (float(run[k]) if run[k] == run[k] else 0.0 for k in STATES)
        return (str(run["test"]), str(run["part"]), *(float(f"{n:.6g}") + 0.0 for n in numbers))

    there = {key(run) for _, run in _table(cases, template).iterrows()}
    return runs[[key(run) not in there for _, run in runs.iterrows()]].reset_index(drop=True)


def _campaign(folder: Path, out: Path) -> tuple[Campaign, str, set[str]]:
    """The runs of the folder and those of the matrix; the vehicle's bundled name or path; cases that are back."""
    paths = find_campaigns(folder)
    if is_matrix(out) and out.resolve() not in {p.resolve() for p in paths}:
        paths.append(out)
    campaigns = [read_campaign(p, none_yet=True) for p in paths]
    first = campaigns[0]
    back: set[str] = set()
    for path, one in zip(paths, campaigns, strict=True):
        if path.resolve() == out.resolve():
            back = {str(name).split("-")[0] for name in one.runs["run_id"]}
    named = first.header.vehicle
    if named.endswith(".toml"):
        named = str(paths[0] / named)
    full = [(c, p) for c, p in zip(campaigns, paths, strict=True) if len(c.runs)]
    if not full:
        return first, named, back
    whole = combined([c for c, _ in full], [p for _, p in full])
    # The uncertainty of runs of several campaigns is a matter of the fit; the plan takes them as one.
    return replace(whole, members={}), named, back


def _same_template(out: Path, template: Template) -> None:
    """A matrix has one scale and one density."""
    other = read_campaign(out, none_yet=True).header
    if other.scale.ratio != template.surface.ratio or other.fluid.density_kgpm3 != template.fluid.density_kgpm3:
        wrong = f"ratio {other.scale.ratio:g} and density {other.fluid.density_kgpm3:g} in {out}"
        raise InputError("--template", wrong, "the same surface.ratio and fluid, or another folder")


def _table(cases: list[Case], template: Template) -> pd.DataFrame:
    """Cases as rows of a run table at full scale, without loads."""
    rows = [{"run_id": c.run_id, "test": c.test, "part": c.part, **c.state} for c in cases]
    table = run_table({k: [r.get(k) for r in rows] for k in ("run_id", "test", "part", *STATES)})
    return to_full_scale(table, template.surface.ratio)
