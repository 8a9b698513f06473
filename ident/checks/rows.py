"""Checks of rows beside the others of their file: what a reason is for, which part of the boat a run is of."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from ident.captive.published import TEST as PUBLISHED
from ident.captive.run_table import STATES
from ident.checks.findings import HULL, NONE, Evidence, Finding, Rule, check, kept, rows_of, together
from sim.boat.catalogue import ACCELERATIONS, OUTPUTS


@check("rows")
def reasons_without_what_they_exclude(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Runs with a reason to leave a load out, and none left out: a column that was lost, or a row that was cut."""
    runs = evidence.runs
    if "reason" not in runs:
        return
    idle = runs[(runs["reason"].fillna("") != "") & (runs["exclude"].fillna("") == "")]
    for file, group in idle.groupby(together(idle), sort=False):
        first = group.iloc[0]
        what = f"{len(group)} runs, {first['run_id']} the first, have a reason ({str(first['reason'])[:60]}), and "
        what += "exclude nothing: every load of them is used"
        yield rule.finding(str(file), rows_of(group), ["exclude", "reason"], what)


@check("rows")
def a_run_of_another_part(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """One run of a part among many of one other part, in a test of one file: it is left out of that part's fit."""
    runs = evidence.runs
    tested = runs[runs["test"] != PUBLISHED]
    for (file, test), group in tested.groupby([together(tested), "test"], sort=False):
        counts = group["part"].value_counts()
        if len(counts) == 2 and counts.iloc[1] == 1 and counts.iloc[0] >= rule.limits["others"]:
            odd = group[group["part"] == counts.index[1]]
            what = f"run {odd['run_id'].iloc[0]} is of part {counts.index[1]}, the {counts.iloc[0]} others of {test} "
            what += f"are of {counts.index[0]}"
            yield rule.finding(str(file), rows_of(odd), ["part"], what)


# Test -> motions of which it is made of one at the least.
_OF_TEST = {
    "rotating_arm": ("p", "q", "r"),
    "pure_rotation": ("p", "q", "r"),
    "acceleration": tuple(ACCELERATIONS),
    "plane_deflection": ("plane",),
}


@check("rows")
def a_run_of_another_test(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """One run of a test among many of one other test of its file, without the motion that its own test is made of."""
    runs = evidence.runs
    tested = runs[runs["test"] != PUBLISHED]
    tested = tested[tested.groupby("file")["test"].transform("nunique") == 2]
    for file, group in tested.groupby("file", sort=False):
        counts = group["test"].value_counts()
        if counts.iloc[1] != 1 or counts.iloc[0] < rule.limits["others"]:
            continue
        odd = group[group["test"] == counts.index[1]]
        motions = list(_OF_TEST.get(str(counts.index[1]), ()))
        if motions and (odd[motions].fillna(0.0) == 0.0).all(axis=None):
            what = f"run {odd['run_id'].iloc[0]} is of {counts.index[1]} and has no {', '.join(motions)}; the "
            what += f"{counts.iloc[0]} others of its file are of {counts.index[0]}"
            yield rule.finding(str(file), rows_of(odd), ["test"], what)


@check("rows")
def runs_without_their_motion(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Runs of one drift test that have the angle of the other: the word in ``test``, or the column of the angle."""
    runs = evidence.runs
    for test, own, other in (("drift_horizontal", "beta", "alpha"), ("drift_vertical", "alpha", "beta")):
        tested = runs[runs["test"] == test]
        # Histories have a file a run: those of a source are looked at together.
        alone = tested.groupby("file")["file"].transform("size") == 1
        for file, group in tested.groupby(tested["file"].where(~alone, together(tested)), sort=False):
            turned = group[group[other].fillna(0.0).abs() > NONE]
            if len(turned) > 1 and (group[own].fillna(0.0).abs() <= NONE).all():
                what = f"{len(turned)} runs of {test} have {other} and none has {own}"
                yield rule.finding(str(file), rows_of(turned), ["test", other], what)


@check("rows")
def a_load_at_rest(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Loads of a body that neither moves nor is moved: water at rest makes none, and no coefficient takes them."""
    runs = evidence.runs
    measured = runs[~runs["test"].isin([PUBLISHED, "open_water", "self_propulsion"])]
    still = (measured[["U", "n", "p", "q", "r", *ACCELERATIONS]].fillna(0.0) == 0.0).all(axis=1)
    resting = measured[still & measured["U"].notna()]
    for file, group in resting.groupby(together(resting), sort=False):
        acts = {o: kept(group, o) & (group[o].fillna(0.0) != 0.0) for o in OUTPUTS}
        loads = [o for o, some in acts.items() if some.any()]
        if loads:
            bad = group[np.any(list(acts.values()), axis=0)]
            what = f"{' '.join(loads)} of run {bad['run_id'].iloc[0]}, and {len(bad) - 1} more, without speed, rate or "
            what += "acceleration: a number that was lost? A zero reading is taken off by [[tare]]"
            yield rule.finding(str(file), rows_of(bad), loads, what)


@check("rows")
def a_run_that_keeps_what_the_others_exclude(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """One run of a file that uses a load which all others of its test leave out."""
    runs = evidence.runs
    if "exclude" not in runs:
        return
    tested = runs[runs["test"] != PUBLISHED]
    tested = tested[tested.groupby(["file", "test"])["test"].transform("size") > rule.limits["others"]]
    tested = tested.assign(out=tested["exclude"].fillna("").str.split())
    for (file, test), group in tested.groupby(["file", "test"], sort=False):
        for load in sorted({name for names in group["out"] for name in names if name in group}):
            without = np.array([load in names for names in group["out"]])
            odd = group[~without & group[load].notna().to_numpy()]
            if len(odd) == 1 and without.sum() == len(group) - 1:
                what = f"run {odd['run_id'].iloc[0]} uses {load}, which the {without.sum()} other {test} runs of its "
                what += "file exclude"
                yield rule.finding(str(file), rows_of(odd), ["exclude", load], what)


@check("symmetry")
def ranges_of_two_sides(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A range of drift, roll or yaw in [source.within] that is another to port than to starboard."""
    campaign = evidence.campaign
    for source in campaign.header.source if campaign is not None else ():
        for name, (low, high) in source.within.items():
            sideways = re.match(r"(beta|p|r|vdot|pdot|rdot)\b", name.replace("_", " ")) is not None
            if sideways and low < 0.0 < high and not math.isclose(-low, high, rel_tol=1e-6):
                what = f"{name} from {low:g} to {high:g} in {source.files}: runs to one side count and their mirror "
                what += "images on the other do not"
                yield rule.finding("campaign.toml", [], [f"source.within.{name}"], what)


@check("rows")
def a_load_in_order_by_itself(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A load that only rises or falls from row to row of a file, where no state and no other load does."""
    runs = evidence.runs
    tested = runs[runs["test"] != PUBLISHED]
    for file, group in tested.groupby("file", sort=False):
        if len(group) < rule.limits["sorted"]:
            continue
        rows = group.sort_values("row")
        ordered = {o: _in_order(rows[o].to_numpy(float), True) for o in OUTPUTS if rows[o].notna().all()}
        loads = [o for o, one in ordered.items() if one]
        if len(loads) != 1 or len(ordered) < 2 or any(_in_order(rows[s].to_numpy(float), False) for s in STATES):
            continue
        what = f"{loads[0]} goes in order from row to row of {len(rows)} runs, and no state or other load does: "
        what += "was the column sorted by itself?"
        yield rule.finding(str(file), rows_of(rows), loads, what)


def _in_order(values: np.ndarray, strictly: bool) -> bool:
    """Whether numbers rise throughout, or fall; those that are not all the same."""
    if not np.isfinite(values).all() or float(np.ptp(values)) == 0.0:
        return False
    ways = set(np.sign(np.diff(values)).tolist())
    return len(ways if strictly else ways - {0.0}) == 1


# Motion -> load that it makes, which grows with it.
_MADE = {
    **{"beta": "Y", "alpha": "Z", "r": "N", "q": "M", "p": "K"},
    **dict(zip(ACCELERATIONS, OUTPUTS, strict=True)),
}


@check("rows")
def loads_that_fall_as_their_motion_grows(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Loads of a motion in the order of its sizes: one that falls was sorted, or is of another place."""
    runs = evidence.runs
    hull = (runs["test"] != PUBLISHED) & runs["part"].isin(HULL)
    needed = ["run_id", "test", "U", "file", "row", *(c for c in ("files", "exclude") if c in runs)]
    tested = runs.loc[hull, [*needed, *_MADE, *OUTPUTS]]
    moving = np.abs(np.nan_to_num(tested[list(_MADE)].to_numpy(float))) > NONE
    for k, (motion, load) in enumerate(_MADE.items()):
        alone = tested[moving[:, k] & (moving.sum(axis=1) == 1)]
        moved = alone[kept(alone, load)] if len(alone) >= rule.limits["falls"] else alone.iloc[:0]
        for (file, _, speed), group in moved.groupby([together(moved), "test", moved["U"].round(6)], sort=False):
            size = group[motion].abs().round(9)
            odd = (group[load] * np.sign(group[motion])).groupby(size).mean()
            if len(odd) < rule.limits["falls"] or (odd.abs() == 0.0).all():
                continue
            # Ranks, so that nothing is said of how it grows.
            order = odd.abs().rank().to_numpy()
            if float(np.corrcoef(order, np.arange(order.size))[0, 1]) >= 0.0:
                continue
            what = f"{load} falls from {odd.iloc[0]:.4g} to {odd.iloc[-1]:.4g} as {motion} grows over {len(odd)} sizes "
            what += f"at {speed:.4g} m/s: was the column sorted by itself, or is it of another harmonic?"
            yield rule.finding(str(file), rows_of(group), [load, motion], what)
