"""Checks of what can be at all: states of a boat in water, errors that leave something known, loads that act."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd

from ident.captive.campaign import Campaign
from ident.captive.conversions import turning
from ident.captive.run_table import MEASURED
from ident.checks.findings import Evidence, Finding, Rule, check, factors, kept, of_air, rows_of, together
from sim.boat.catalogue import ACCELERATIONS, SETS, held, terms

# Files that hold runs when a campaign's source names them.
_TABLES = frozenset((".csv", ".parquet", ".xlsx", ".xls", ".xlsb", ".ods", ".mat", ".h5", ".nc", ".tdms", ".lvm"))
# Files that one finding looks at: a folder may hold a whole archive beside the runs.
_MOST = 2000


@check("state")
def states_of_a_boat(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Speeds, angles, depths and motions that no boat has."""
    runs, limits = evidence.runs, rule.limits
    length = evidence.body.length if evidence.body else math.nan
    angles = {"alpha": limits["incidence"], "beta": limits["drift"], "plane": limits["plane"]}
    for name, most in angles.items():
        size = np.degrees(runs[name]).abs()
        yield from _beyond(runs, rule, name, size, most, "deg")
    header = evidence.campaign.header if evidence.campaign else None
    tunnel = header is not None and of_air(header.fluid.density_kgpm3)
    # Full-scale speeds are by Froude's law, which no wind tunnel keeps.
    own = math.sqrt(header.scale.ratio) if tunnel and header is not None else 1.0
    fastest, where = (limits["air"], "m/s in the wind tunnel") if tunnel else (limits["speed"], "m/s at full scale")
    yield from _beyond(runs, rule, "U", runs["U"] / own, fastest, where)
    for name in ("p", "q", "r"):
        at_length = "m/s at the boat's length" if not tunnel else f"{where}, at the model's length"
        yield from _beyond(runs, rule, name, runs[name].abs() * length / own, fastest, at_length)
    # A pure rotation has no way on, and a circle of no size; what moves across the hull is on no circle.
    along = runs["U"] * np.cos(runs["alpha"].fillna(0.0)) * np.cos(runs["beta"].fillna(0.0))
    tight = runs[["p", "q", "r"]].abs().max(axis=1) * length / runs["U"].where(along > 0.5 * runs["U"])
    for file, group in runs[tight > limits["turn"]].groupby(together(runs[tight > limits["turn"]]), sort=False):
        sizes = tight[group.index].to_numpy(float)
        what = f"run {group['run_id'].iloc[int(sizes.argmax())]} turns on a radius of {1.0 / sizes.max():.2g} lengths; "
        what += f"{len(group)} of the runs below {1.0 / limits['turn']:.2g}: the unit of the rate, or of the radius?"
        yield rule.finding(str(file), rows_of(group), ["r"], what, "warning")
    for name in ACCELERATIONS:
        lever = 1.0 if name in ("udot", "vdot", "wdot") else length
        yield from _beyond(runs, rule, name, runs[name].abs() * lever, limits["acceleration"], "m/s^2")
    vehicle = evidence.vehicle
    if vehicle is not None and vehicle.propeller is not None:
        tip = math.pi * vehicle.diameter * runs["n"].abs() / own
        yield from _beyond(runs, rule, "n", tip, limits["tip"], "m/s at the tip of the propeller's blades")
    yield from _beyond(runs, rule, "D0", runs["D0"], limits["depth"], "m of depth")
    yield from _beyond(runs, rule, "t", runs["t"].abs(), limits["fraction"], "of the thrust")
    if "coefficient" in runs and "value" in runs:
        sets = (vehicle.term_set,) if vehicle is not None else SETS
        of_hull = runs[runs["coefficient"].isin([t.name for s in sets for t in terms(s) if t.share_of])]
        yield from _beyond(of_hull, rule, "value", of_hull["value"].abs(), limits["fraction"], "of thrust or speed")


def _beyond(runs: pd.DataFrame, rule: Rule, name: str, size: pd.Series, most: float, unit: str) -> Iterator[Finding]:
    for file, group in runs[size > most].groupby(together(runs), sort=False):
        sizes = size[group.index].to_numpy(float)
        worst = int(sizes.argmax())
        what = f"{name} of run {group['run_id'].iloc[worst]} is {sizes[worst]:.4g} {unit}, beyond {most:g}"
        yield rule.finding(str(file), rows_of(group), [name], f"{what}; {len(group)} of the runs")


@check("state")
def motions_without_a_load(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Incidence or pitching of a vehicle that moves in the horizontal plane alone: no term has a load of it."""
    runs, vehicle = evidence.runs, evidence.vehicle
    if vehicle is None or not {"Z", "M"} <= set(held(vehicle.term_set)):
        return
    for name in ("alpha", "q"):
        moved = runs[runs[name].fillna(0.0) != 0.0]
        for file, group in moved.groupby(together(moved), sort=False):
            what = f"{name} of run {group['run_id'].iloc[0]} is not zero, and {vehicle.name} has no term in Z or M; "
            yield rule.finding(str(file), rows_of(group), [name], f"{what}{len(group)} of the runs")


@check("state")
def boats_in_the_air(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Depths above the surface: D0 is positive down."""
    runs, vehicle = evidence.runs, evidence.vehicle
    above = runs[runs["D0"] < 0.0]
    if above.empty:
        return
    # The keel is about as far below the centre of buoyancy as the sail top is above it.
    whole = math.inf
    top = vehicle.particulars.sail_top if vehicle is not None else None
    if vehicle is not None and top is not None:
        whole = 2.0 * abs(top.value[2] - vehicle.particulars.centre_of_buoyancy.value[2])
    for file, group in above.groupby(together(runs), sort=False):
        out = float(-group["D0"].min())
        what = f"D0 = {-out:.4g} m has the sail top {out:.4g} m above the surface"
        what += ", and the whole boat out of the water" if out > whole else ""
        severity = rule.severity if out > whole else "warning"
        yield rule.finding(str(file), rows_of(group), ["D0"], f"{what}: D0 is positive down", severity)


@check("moment_point")
def point_beside_the_body(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A moment point farther from the vehicle's origin than the tested body is long, or half as long to the side."""
    campaign = evidence.campaign
    if campaign is None:
        return
    point, length = campaign.header.moment_point, campaign.header.scale.length_m
    for axis, value in (("x_m", point.x_m), ("y_m", point.y_m), ("z_m", point.z_m)):
        most = rule.limits["along" if axis == "x_m" else "aside"]
        if abs(value) > most * length:
            what = f"{axis} = {value:g} of a body of {length:g} m: no balance and no mesh has its point there"
            yield rule.finding("campaign.toml", [], [f"moment_point.{axis}"], what)


@check("moment_point")
def motions_of_another_point(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Turning runs of a campaign whose moments are about another point than the origin: whose motions are stated?"""
    campaign = evidence.campaign
    if campaign is None or campaign.header.motion_point is not None:
        return
    header = campaign.header
    x, y, z = header.frame.frame.vector([getattr(header.moment_point, f"{k}_m") * header.scale.ratio for k in "xyz"])
    if not any((x, y, z)):
        return
    runs = evidence.runs[turning(evidence.runs) & (evidence.runs["U"] > 0.0)]
    p, q, r = (runs[k].fillna(0.0) for k in "pqr")
    across = np.hypot(r * x - p * z, p * y - q * x) / runs["U"]
    asked = runs[across > rule.limits["turned"]]
    for file, group in asked.groupby(together(asked), sort=False):
        worst = math.degrees(across[group.index].max())
        what = f"{len(group)} turning runs, and moments about another point than the vehicle's origin: speed and drift "
        what += (
            f"are taken for those of the origin; were they the moment point's, it would drift by {worst:.2g} deg more"
        )
        yield rule.finding(str(file), rows_of(group), ["motion_point"], what, "warning")


@check("errors")
def errors_that_leave_nothing(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Relative errors of more than all of a load: per cent for a fraction."""
    runs = evidence.runs
    published = runs["coefficient"].fillna("").ne("") if "coefficient" in runs else pd.Series(False, runs.index)
    for are, most in ((~published, rule.limits["run"]), (published, rule.limits["published"])):
        large = runs[are & (runs["rel_sigma"] > most)]
        for file, group in large.groupby(together(runs), sort=False):
            sizes = group["rel_sigma"].to_numpy(float)
            worst = int(sizes.argmax())
            what = f"rel_sigma = {sizes[worst]:.4g} of run {group['run_id'].iloc[worst]} is "
            what += f"{100.0 * sizes[worst]:.4g} % of the load; {len(group)} of the runs above {most:g}"
            yield rule.finding(str(file), rows_of(group), ["rel_sigma"], what)


@check("errors")
def loads_without_error(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Loads with a standard error of zero are known exactly: all others would count for nothing beside them.

    A history without scatter, as a computation leaves that has settled, is said; it takes nothing from others that are
    as certain.
    """
    runs = evidence.runs
    for file, group in runs.groupby(together(runs), sort=False):
        exact = {o: kept(group, o) & (group[o] != 0.0) & (group[f"s_{o}"] == 0.0) for o in MEASURED if o in group}
        columns = [o for o, bad in exact.items() if bad.any()]
        if columns:
            bad = group[pd.DataFrame(exact).any(axis=1)]
            what = f"{' '.join(columns)} of run {bad['run_id'].iloc[0]} with a standard error of zero; {len(bad)} runs"
            scatterless = bool((bad["reduction"] != "").all()) if "reduction" in bad else False
            mild = scatterless and not any(_outweighed(runs, bad, o, rule.limits["exact"]) for o in columns)
            yield rule.finding(str(file), rows_of(bad), columns, what, "warning" if mild else "")


def _outweighed(runs: pd.DataFrame, exact: pd.DataFrame, load: str, most: float) -> bool:
    """Whether runs of the same tests have errors of a load that would count for nothing beside exact ones."""
    others = runs[runs["test"].isin(exact["test"]) & kept(runs, load) & (runs[load] != 0.0) & (runs[f"s_{load}"] > 0.0)]
    return bool((others[f"s_{load}"] > most * others[load].abs()).any())


@check("errors")
def runs_that_decide_alone(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A relative error so much smaller than those of its test that the other runs count for nothing."""
    runs = evidence.runs[evidence.runs["rel_sigma"] > 0.0]
    for (file, test), group in runs.groupby([together(runs), "test"], sort=False):
        usual = float(group["rel_sigma"].median())
        small = group[group["rel_sigma"] < rule.limits["alone"] * usual]
        if len(group) >= 4 and not small.empty:
            first = small.iloc[0]
            what = (
                f"rel_sigma = {first['rel_sigma']:.4g} of run {first['run_id']} where {usual:.4g} is usual in {test}: "
            )
            what += "the others count for nothing beside it"
            yield rule.finding(str(file), rows_of(small), ["rel_sigma"], what, "warning")


@check("errors")
def words_that_leave_nothing(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Relative errors times the factor of the quality word beyond half of the load: twice that, and no sign is left."""
    runs = evidence.runs
    published = runs["coefficient"].fillna("").ne("") if "coefficient" in runs else pd.Series(False, runs.index)
    trusted = factors(evidence, runs) * runs["rel_sigma"]
    # Above the whole load rel_sigma is an error by itself.
    large = runs[~published & (trusted > rule.limits["half"]) & (runs["rel_sigma"] <= rule.limits["run"])]
    for (file, word), group in large.groupby([together(large), large["quality"].fillna("")], sort=False):
        size = trusted[group.index].to_numpy(float)
        worst = group.iloc[int(size.argmax())]
        what = f"the standard error of run {worst['run_id']} is {100.0 * size.max():.3g} % of its loads "
        what += f"(rel_sigma = {worst['rel_sigma']:.4g} times the factor of quality {str(word)!r}): twice that is more "
        what += f"than the load; {len(group)} runs, which hardly count"
        yield rule.finding(str(file), rows_of(group), ["rel_sigma", "quality"], what, "warning")


@check("zero")
def loads_that_do_not_act(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Runs of one test and part whose every load is zero."""
    runs = evidence.runs
    names = [o for o in MEASURED if o in runs]
    given = pd.DataFrame({o: kept(runs, o) for o in names})
    acts = given & (runs[names] != 0.0)
    for (_, test, part), group in runs.groupby([together(runs), "test", "part"], sort=False):
        if given.loc[group.index].any(axis=None) and not acts.loc[group.index].any(axis=None):
            columns = [o for o in names if given.loc[group.index, o].any()]
            what = f"every load of {len(group)} {test} runs of {part or 'the boat'} is zero"
            yield rule.finding(str(group["file"].iloc[0]), rows_of(group), columns, what)


@check("unread")
def files_that_nothing_reads(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Tables in the folder of a campaign that no source names."""
    campaign, folder = evidence.campaign, evidence.folder
    if campaign is None or folder is None:
        return
    left = _unread(campaign, folder)
    if left:
        more = f" and {len(left) - 5} more" if len(left) > 5 else ""
        what = f"{', '.join(left[:5])}{more}: in the campaign's folder, and no source reads it"
        yield rule.finding(left[0], [], [], what)


def _unread(campaign: Campaign, folder: Path) -> list[str]:
    """Names of the tables below a folder that are no input of the campaign, nor of one below it."""
    known = {*campaign.digests, *campaign.header.tables.given().values()}
    vehicle = campaign.vehicle
    beside = {Path(p).resolve() for p in (vehicle.terms, vehicle.errata, vehicle.geometry) if p}
    unread = []
    for root, folders, names in islice(os.walk(folder), _MOST):
        if Path(root) != folder and "campaign.toml" in names:
            folders.clear()
            continue
        folders[:] = sorted(f for f in folders if not f.startswith("."))
        for name in sorted(names)[:_MOST]:
            path = Path(root) / name
            if name.startswith(".") or path.suffix.lower() not in _TABLES or path.resolve() in beside:
                continue
            if path.relative_to(folder).as_posix() not in known:
                unread.append(path.relative_to(folder).as_posix())
    return unread
