"""Checks of what the loads are of: along which axes, with buoyancy in them, and the same in every test."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pandas as pd

from ident.captive.axes import from_flow
from ident.checks.findings import (
    HULL,
    NONE,
    Body,
    Evidence,
    Finding,
    Rule,
    check,
    declared,
    kept,
    milder,
    prime,
    rows_of,
    together,
)
from sim.boat.catalogue import ACCELERATIONS

_PLANES = {"drift_horizontal": ("beta", "Y", "N"), "drift_vertical": ("alpha", "Z", "M")}
_MOVING = ("p", "q", "r", *ACCELERATIONS)


def _still(runs: pd.DataFrame) -> pd.Series:
    return (runs[list(_MOVING)].fillna(0.0) == 0.0).all(axis=1) & runs["part"].isin(HULL)


def _sweep(runs: pd.DataFrame, test: str, angle: str) -> pd.DataFrame:
    """Runs over one angle of the flow: without the other where a file sweeps both, else those of its test."""
    of_test = runs[runs["test"] == test]
    other = "alpha" if angle == "beta" else "beta"
    if of_test[other].fillna(0.0).abs().round(6).nunique() < 3:
        return of_test
    return of_test[of_test[other].fillna(0.0).abs() < NONE]


@check("flow_axes")
def along_the_flow(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Whether X grows with drift by the side force's share along the flow, X + Y tan(beta)."""
    body = evidence.body
    if body is None:
        return
    for test, (angle, force, _) in _PLANES.items():
        runs = _sweep(evidence.runs[_still(evidence.runs)], test, angle)
        runs = runs[kept(runs, "X") & kept(runs, force) & (runs[angle].abs() < math.radians(rule.limits["widest"]))]
        if runs[angle].abs().round(6).nunique() < 3:
            continue
        x, share = prime(runs, "X", body), prime(runs, force, body) * np.tan(runs[angle])
        if not np.isfinite(x).all() or not float(np.ptp(share)) > 0.0:
            continue
        design = np.column_stack([np.ones(len(x)), share])
        (_, slope), *_ = np.linalg.lstsq(design, x.to_numpy(), rcond=None)
        left = x - design @ np.linalg.lstsq(design, x.to_numpy(), rcond=None)[0]
        explained = 1.0 - float((left**2).sum() / ((x - x.mean()) ** 2).sum()) if float(np.ptp(x)) > 0.0 else 0.0
        if explained < rule.limits["explained"] or not rule.limits["low"] < abs(slope) < rule.limits["high"]:
            continue
        turned = "along the flow, not the body" if slope > 0.0 else "turned to the body twice"
        what = f"X changes with {angle} by {slope:.2f} of {force} tan({angle}): as loads {turned}, would"
        file = ", ".join(dict.fromkeys(together(runs)))
        yield rule.finding(file[:200], rows_of(runs), ["X", force], what)


@check("flow_axes")
def moments_along_the_flow(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Moments that were turned from the flow with the forces, where nothing says that they are along it."""
    campaign = evidence.campaign
    if campaign is None or "moment_axes" not in evidence.runs:
        return
    stated = {s.files for s in campaign.header.source if s.moment_axes}
    runs = evidence.runs[(evidence.runs["moment_axes"] == "flow") & ~evidence.runs["files"].isin(stated)]
    if runs.empty or campaign.header.frame.moment_axes:
        return
    turned = from_flow(*(runs[k].fillna(0.0).to_numpy(float) for k in ("alpha", "beta")))
    moments = np.nan_to_num(runs[[*"KMN"]].to_numpy(float))
    before = np.einsum("nji,nj->ni", turned, moments)
    changed, size = np.abs(moments - before).max(axis=0), np.abs(moments).max(axis=0)
    asked = [c for c in range(3) if changed[c] > rule.limits["asked"] * size[c] > 0.0]
    if asked:
        shares = ", ".join(f"{'KMN'[c]} changes by {changed[c] / size[c]:.1%} of its largest" for c in asked)
        what = f"are moments along the flow too? Nothing says it, and turned with the forces {shares}: solvers give "
        what += "drag and lift with moments along their mesh; moment_axes in [[source]] says it"
        file = ", ".join(dict.fromkeys(together(runs)))
        yield rule.finding(file[:200], rows_of(runs), ["KMN"[c] for c in asked], what, "warning")


@check("hydrostatic")
def weight_in_the_loads(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Z or M of a body at zero incidence as large as a part of its weight, and no load a boat has there."""
    body = evidence.body
    if body is None or body.mass is None:
        return
    weight = body.mass * rule.limits["gravity"]
    level = evidence.runs["alpha"].fillna(0.0).abs() < math.radians(rule.limits["level"])
    for load, whole, share_limit, prime_limit, words in (
        ("Z", weight, "share", "prime", f"the displaced weight ({weight:.4g} N)"),
        ("M", weight * body.length, "moment_share", "moment_prime", "the displaced weight times the length"),
    ):
        runs = _standing(evidence.runs[level & kept(evidence.runs, load)], load)
        for file, group in runs.groupby(together(runs), sort=False):
            size = float(prime(group, load, body).abs().median())
            share = float(group[load].abs().median() / whole)
            if share > rule.limits[share_limit] and size > rule.limits[prime_limit]:
                unit = "N" if load == "Z" else "N m"
                what = f"{load} = {group[load].median():.4g} {unit} without incidence, {100 * share:.3g} % of {words} "
                what += f"and {size:.2g} in prime form: buoyancy or weight in the loads"
                yield rule.finding(str(file), rows_of(group), ["Z", "M"], what)


def _standing(runs: pd.DataFrame, load: str) -> pd.DataFrame:
    """Runs of the hull at rest in a steady flow, and for each two sides of an oscillation what they have in common."""
    phases = runs["run_id"].astype(str).str.extract(r"^(?P<cycle>.*)[+-](?P<side>[av])$")
    swung = phases["cycle"].notna() & runs["part"].isin(HULL)
    sides = runs[swung].groupby([together(runs)[swung], phases["cycle"][swung], phases["side"][swung]], sort=False)
    common = sides[load].transform("mean").where(sides[load].transform("size") == 2)
    both = runs[swung].assign(**{load: common})
    return pd.concat([runs[_still(runs) & ~swung], both[common.notna()]])


@check("propeller_on")
def thrust_in_x(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """X of hull runs with revolutions, from which no thrust was taken off."""
    runs = evidence.runs
    taken = runs["taken_X"].notna() if "taken_X" in runs else pd.Series(False, index=runs.index)
    pushed = runs[(runs["part"].isin(HULL)) & (runs["n"].fillna(0.0) != 0.0) & ~taken & kept(runs, "X")]
    for file, group in pushed.groupby(together(pushed), sort=False):
        what = f"X of {len(group)} hull runs with the propeller at {group['n'].min():g} to {group['n'].max():g} rev/s"
        yield rule.finding(str(file), rows_of(group), ["X", "n"], what)


@check("propeller_on")
def revolutions_beside_other_loads(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Other loads with revolutions: no coefficient depends on them, so what the propeller does is in the loads."""
    runs = evidence.runs
    turning = runs[(runs["n"].fillna(0.0) != 0.0) & ~runs["test"].isin(["open_water", "self_propulsion"])]
    turning = turning[~(turning["part"].isin(HULL) & kept(turning, "X"))]
    for file, group in turning.groupby(together(turning), sort=False):
        what = f"loads of {len(group)} runs with the propeller at {group['n'].min():g} to {group['n'].max():g} rev/s, "
        what += "on which no coefficient of theirs depends: what the propeller does to them is in them"
        yield rule.finding(str(file), rows_of(group), ["n"], what, "info")


# -- between tests -------------------------------------------------------------------------


def _groups(evidence: Evidence, test: str, angle: str) -> Iterator[tuple[str, pd.DataFrame]]:
    """Runs that give a load at an angle and nothing else, by how they were made: (words, runs)."""
    runs = evidence.runs
    rest = [m for m in ("p", "q", "r") if m in runs]
    still = (runs[rest].fillna(0.0) == 0.0).all(axis=1) & runs["part"].isin(HULL)
    steady = still & _still(runs) & (runs["test"] == test)
    phases = runs["run_id"].astype(str).str.extract(r"^(?P<cycle>.*)(?P<phase>[+-][av])$")
    swung = phases["phase"].notna()
    source = together(runs)
    for file, group in runs[steady].groupby(source[steady], sort=False):
        held = group[~swung[group.index]]
        if len(held):
            yield f"steady runs of {file}", held
        if len(held) < len(group):
            yield f"oscillations of {file}", group[swung[group.index]]
    # The mean of a cycle: its two ends of acceleration.
    ends = still & phases["phase"].isin(["+a", "-a"]) & (runs[angle].fillna(0.0) != 0.0)
    for file, group in runs[ends].groupby(source[ends], sort=False):
        cycle = phases["cycle"][group.index]
        numbers = group.select_dtypes("number").groupby(cycle).mean()
        texts = group.select_dtypes(exclude="number").groupby(cycle).first()
        whole = group.groupby(cycle).size() == 2
        yield f"means of the oscillations of {file}", numbers.join(texts)[whole].reset_index(drop=True)


def _slope(group: pd.DataFrame, angle: str, output: str, body: Body, widest: float) -> tuple[float, float]:
    """Slope of a prime load over the sine of an angle, odd in it, with its standard error."""
    straight = group[kept(group, output) & (group[angle].abs() <= widest + 1e-9)]
    x = np.sin(straight[angle].to_numpy(float))
    y = prime(straight, output, body).to_numpy(float)
    # An offset of the rig is no slope: it is taken off where both sides were measured.
    if x.size >= 3 and x.min() < 0.0 < x.max():
        design = np.column_stack([np.ones(x.size), x])
    else:
        design = x[:, None]
    if x.size < design.shape[1] or not float(np.abs(x).max(initial=0.0)) > 0.0 or not np.isfinite(y).all():
        return math.nan, math.nan
    error = prime(straight.assign(**{output: straight[f"s_{output}"]}), output, body).fillna(0.0).to_numpy(float)
    inverse = np.linalg.pinv(design)
    slope = float(inverse[-1] @ y)
    left = y - design @ (inverse @ y)
    spread = math.sqrt(float(left @ left) / (x.size - design.shape[1])) if x.size > design.shape[1] else 0.0
    sigma = np.maximum(error, spread)
    return slope, float(np.sqrt((inverse[-1] ** 2) @ sigma**2))


@check("between_tests")
def same_slope(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The load over drift or incidence, from steady runs, from oscillations, and from their means."""
    body = evidence.body
    if body is None:
        return
    for test, (angle, force, moment) in _PLANES.items():
        groups = list(_groups(evidence, test, angle))
        for output in (force, moment):
            slopes: list[tuple[str, pd.DataFrame, float, float]] = []
            # The same range of angles, for a curved load has no one slope.
            reach = [float(g[angle].abs()[kept(g, output)].max()) for _, g in groups]
            reach = [r for r in reach if r > 0.0]
            widest = max(min(reach, default=0.0), math.radians(rule.limits["narrow"]))
            for words, group in groups:
                slope, error = _slope(group, angle, output, body, widest)
                if math.isfinite(slope):
                    slopes.append((words, group, slope, error))
            yield from _compared(evidence, rule, output, angle, slopes, rule.limits["share"])


# Rate -> loads that answer it, and whether symmetry leaves them nothing without it.
_TURNS = {"r": (("Y", "N"), True), "q": (("Z", "M"), False), "p": (("K",), True)}


def _turning(evidence: Evidence, rate: str, body: Body) -> list[tuple[str, pd.DataFrame]]:
    """Runs with way on that turn about one axis and do nothing else, by how they were made: (words, runs).

    A column ``turn`` has the rate times length over speed.
    """
    runs = evidence.runs
    others = [m for m in _MOVING if m != rate]
    alone = (runs[others].fillna(0.0) == 0.0).all(axis=1) & (runs[rate].fillna(0.0) != 0.0)
    straight = (runs[["alpha", "beta"]].fillna(0.0).abs() < math.radians(0.5)).all(axis=1)
    chosen = runs[alone & straight & runs["part"].isin(HULL) & (runs["U"].fillna(0.0) > 0.0)]
    chosen = chosen.assign(turn=chosen[rate] * body.length / chosen["U"])
    swung = chosen["run_id"].astype(str).str.contains(r"[+-]v$")
    words = swung.map({True: "oscillations of ", False: "steady runs of "}) + together(chosen)
    return [(str(name), group) for name, group in chosen.groupby(words, sort=False)]


@check("between_tests")
def same_rotation(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The load over a rate, from the rotating arm of each file and from oscillations: a radius that was a diameter."""
    body = evidence.body
    if body is None:
        return
    for rate, (outputs, odd) in _TURNS.items():
        groups = _turning(evidence, rate, body)
        if len(groups) < 2:
            continue
        for output in outputs:
            reach = [float(g["turn"].abs()[kept(g, output)].max()) for _, g in groups]
            widest = min((r for r in reach if r > 0.0), default=0.0)
            slopes: list[tuple[str, pd.DataFrame, float, float]] = []
            for words, group in groups:
                found, error = _slope_of_turn(group, output, body, 1.05 * widest, odd)
                if math.isfinite(found):
                    slopes.append((words, group, found, error))
            yield from _compared(evidence, rule, output, rate, slopes, rule.limits["turn"])


# Rotation -> its acceleration, the angle of the flow it stands at on a straight path, its sign there, its force.
_SWINGS = {"r": ("rdot", "beta", -1.0, "Y"), "q": ("qdot", "alpha", 1.0, "Z")}


@check("motion")
def swings_across_its_path(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Whether a force in phase with yaw or pitch is that of drift or incidence at the same angle."""
    body, campaign = evidence.body, evidence.campaign
    if body is None or campaign is None:
        return
    stated = {s.files for s in campaign.header.source if s.reduction is not None and s.reduction.path}
    runs = evidence.runs[~evidence.runs["files"].isin(stated)] if "files" in evidence.runs else evidence.runs
    for rate, (acceleration, angle, sign, force) in _SWINGS.items():
        if not (runs[acceleration].fillna(0.0) != 0.0).any():
            continue
        still = evidence.runs[_still(evidence.runs) & kept(evidence.runs, force)]
        slope, _ = _slope(
            _sweep(still, _TEST_OF[angle], angle), angle, force, body, math.radians(rule.limits["widest"])
        )
        if not math.isfinite(slope) or slope == 0.0:
            continue
        for file, group in _cycles(runs, rate, acceleration, force).groupby("file", sort=False):
            size = 0.5 * body.density * group["U"] ** 2 * body.length**2
            share = (group["in_phase"] / size / (sign * slope * group["angle"])).median()
            if share > rule.limits["across"]:
                what = f"does the body stay along its path? {force} in phase with the angle is {share:.2g} of that of "
                what += f"{angle} at the same angle, as where it swings about an axis that is towed straight or stands "
                what += "in a stream; path in [source.reduction] says it"
                yield rule.finding(str(file), rows_of(group), [force], what)


# Test over each angle of the flow.
_TEST_OF = {angle: test for test, (angle, _, _) in _PLANES.items()}


def _cycles(runs: pd.DataFrame, rate: str, acceleration: str, force: str) -> pd.DataFrame:
    """Cycles of an oscillation about one axis with way on: file, row, U, amplitude of the angle, force in phase."""
    name = runs["run_id"].astype(str)
    wanted = ["file", "row", "U", rate, acceleration, force]
    at = {end: runs[name.str.endswith(end)].set_index(name[name.str.endswith(end)].str[:-2])[wanted] for end in _ENDS}
    other, fast = at["-a"][[force]].add_suffix("_other"), at["+v"][[rate]].add_suffix("_fast")
    both = at["+a"].join(other, how="inner").join(fast, how="inner")
    both = both[(both[acceleration].fillna(0.0) != 0.0) & (both[f"{rate}_fast"].fillna(0.0) != 0.0) & (both["U"] > 0.0)]
    # A = (A w)^2 / (A w^2); the displacement is positive where the acceleration is negative.
    angle = -(both[f"{rate}_fast"] ** 2) / both[acceleration]
    return both.assign(angle=angle, in_phase=0.5 * (both[force] - both[f"{force}_other"]))


# Instants of a cycle that tell its angle.
_ENDS = ("+v", "+a", "-a")


def _slope_of_turn(group: pd.DataFrame, output: str, body: Body, widest: float, odd: bool) -> tuple[float, float]:
    """Slope of a load over the turn, prime form with 1/2 rho U^2, and its standard error; NaN where there is none."""
    near = group[kept(group, output) & (group["turn"].abs() <= widest)]
    x = near["turn"].to_numpy(float)
    size = 0.5 * body.density * near["U"].to_numpy(float) ** 2 * body.length ** (2 if output in "XYZ" else 3)
    both = x.size > 0 and x.min() < 0.0 < x.max()
    if not x.size or not (odd or both):
        return math.nan, math.nan
    design = np.column_stack([np.ones(x.size), x]) if both and x.size > 2 else x[:, None]
    inverse = np.linalg.pinv(design)
    y = near[output].to_numpy(float) / size
    found = inverse[-1] @ y
    left = y - design @ (inverse @ y)
    spread = math.sqrt(float(left @ left) / (x.size - design.shape[1])) if x.size > design.shape[1] else 0.0
    sigma = np.maximum(near[f"s_{output}"].fillna(0.0).to_numpy(float) / size, spread)
    return float(found), float(np.sqrt((inverse[-1] ** 2) @ sigma**2))


def _compared(
    evidence: Evidence,
    rule: Rule,
    output: str,
    angle: str,
    slopes: list[tuple[str, pd.DataFrame, float, float]],
    share: float,
) -> Iterator[Finding]:
    """Slopes against that of the most runs, which differ by more than a share and their errors."""
    if len(slopes) < 2:
        return
    base = max(slopes, key=lambda one: (one[0].startswith("steady"), len(one[1])))
    for one in slopes:
        words, group, slope, error = one
        if one is base:
            continue
        off = abs(slope - base[2])
        size = max(abs(slope), abs(base[2]))
        if off <= share * size or off <= rule.limits["errors"] * math.hypot(error, base[3]):
            continue
        what = f"{output} over {angle} is {slope:.3g} (prime form, per radian) in {words}, {base[2]:.3g} in {base[0]}"
        what += f": a factor {slope / base[2]:.2g}" if base[2] else ""
        known = bool(declared(evidence, group).all())
        file = str(group["file"].iloc[0])
        far = not 1.0 / rule.limits["factor"] < slope / (base[2] or math.inf) < rule.limits["factor"]
        severity = "error" if far and not known else milder(rule, known)
        yield rule.finding(file, rows_of(group), [output, angle], what, severity)


@check("facilities")
def facilities_apart(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Campaigns of one boat that differ by more than the errors they state."""
    for apart in evidence.between:
        if apart.tau > 0.0 and apart.excess > rule.limits["excess"]:
            yield rule.finding("campaign.toml", [], [apart.output], apart.words())
