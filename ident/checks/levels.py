"""Checks of the states that runs were made at: the grid of a test, and the same numbers under two units."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.published import TEST as PUBLISHED
from ident.captive.quantities import table as quantities
from ident.checks.findings import Array, Evidence, Finding, Rule, check, rows_of, together
from sim.boat.catalogue import ACCELERATIONS

# States that are set, run by run, and rounded as they are compared.
_SET = ("alpha", "beta", "plane", "D0", "U", "p", "q", "r", *ACCELERATIONS)
_DIGITS = 9
# Quantities whose numbers may stand in each other's place, and the power of the scale that makes them full size.
_ALIKE = ((("U",), 0.5), (("alpha", "beta", "plane"), 0.0), (("p", "q", "r"), -0.5))


@check("rows")
def one_level_off_the_grid(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A series that has one level no other series has, and lacks the one that all others have: 21 for 12."""
    runs = evidence.runs
    tested = runs[runs["test"] != PUBLISHED]
    for (file, _), group in tested.groupby([together(tested), "test"], sort=False):
        levels = np.nan_to_num(group[list(_SET)].to_numpy(float)).round(_DIGITS)
        varied = np.flatnonzero(np.ptp(levels, axis=0) > 0.0)
        if len(varied) + (group["part"].nunique() > 1) < 2:
            continue
        # Levels and parts as whole numbers: a series is what is equal in all but one of them.
        codes = [np.unique(levels[:, k], return_inverse=True)[1] for k in varied]
        codes.append(pd.factorize(group["part"])[0])
        for place, k in enumerate(varied):
            rest = np.column_stack(codes[:place] + codes[place + 1 :])
            name = np.unique(rest, axis=0, return_inverse=True)[1].ravel()
            order = np.argsort(name, kind="stable")
            series = np.split(order, np.flatnonzero(np.diff(name[order])) + 1)
            yield from _odd_series(group, str(file), _SET[k], [(levels[one, k], one) for one in series], rule)


def _odd_series(
    group: pd.DataFrame, file: str, axis: str, series: list[tuple[Array, NDArray[np.int64]]], rule: Rule
) -> Iterator[Finding]:
    """Series of an axis that differ from all others by one level in the place of another."""
    sets = [frozenset(values.tolist()) for values, _ in series]
    usual, count = Counter(sets).most_common(1)[0]
    if count < rule.limits["series"] or len(usual) < 2 or len(series) - count > 1:
        return
    for (values, places), have in zip(series, sets, strict=True):
        extra, lost = have - usual, usual - have
        if len(extra) != 1 or len(lost) != 1:
            continue
        odd = group.iloc[places[np.isin(values, list(extra))]]
        unit = 180.0 / math.pi if axis in ("alpha", "beta", "plane") else 1.0
        what = f"run {odd['run_id'].iloc[0]} has {axis} = {next(iter(extra)) * unit:.4g}, and the {count} other series "
        what += f"of its test have {next(iter(lost)) * unit:.4g} in its place: a number typed wrong?"
        yield rule.finding(file, rows_of(odd), [axis], what)


@check("units")
def numbers_of_another_file(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """States of a file that are, digit for digit, those of another file or column in another unit."""
    campaign, runs = evidence.campaign, evidence.runs
    if campaign is None:
        return
    ratio = campaign.header.scale.ratio
    tested = runs[runs["test"] != PUBLISHED]
    factors = quantities().groupby("quantity", sort=False)["factor"]
    for names, power in _ALIKE:
        units = sorted({float(f) for n in names for f in factors.get_group(n)} - {1.0})
        numbers = {
            (str(file), n): _told(group[n].to_numpy(float) / ratio**power, rule)
            for file, group in tested.groupby(together(tested), sort=False)
            for n in names
        }
        numbers = {place: values for place, values in numbers.items() if values}
        for (file, name), values in numbers.items():
            rest = [(f, v) for (f, n), v in numbers.items() if (f, n) != (file, name) and not v & values]
            for unit in units:
                found = ((f, sorted(x for x in v if _short(x * unit) in values)) for f, v in rest)
                where, same = next(((f, same) for f, same in found if same), ("", [0.0]))
                if not where:
                    continue
                group = tested[(together(tested) == file) & tested[name].notna()]
                what = (
                    f"{name} of {same[0]:.6g} times {unit:.6g} beside {same[0]:.6g} in {where}: the same number under "
                )
                what += f"two units{_scaled(ratio)}"
                yield rule.finding(file, rows_of(group), [name], what)


@check("units")
def speeds_for_depths(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A file whose speeds are the depths of all others, and its depths their speeds: two columns changed places."""
    campaign, runs = evidence.campaign, evidence.runs
    if campaign is None:
        return
    ratio = campaign.header.scale.ratio
    tested = runs[(runs["test"] != PUBLISHED) & (runs["U"].fillna(0.0) > 0.0) & (runs["D0"].fillna(0.0) > 0.0)]
    tested = tested.assign(speed=tested["U"] / math.sqrt(ratio), depth=tested["D0"] / ratio)
    numbers = {
        str(file): tuple({_short(x) for x in group[c]} for c in ("speed", "depth"))
        for file, group in tested.groupby("file", sort=False)
    }
    # In how many files a number is a speed, and a depth.
    counts = [Counter(x for sets in numbers.values() for x in sets[k]) for k in (0, 1)]
    for file, (speeds, depths) in numbers.items():
        # A file's own numbers count once.
        own = any(counts[0][x] > 1 for x in speeds) or any(counts[1][x] > 1 for x in depths)
        crossed = all(counts[1][x] > (x in depths) for x in speeds) and all(
            counts[0][x] > (x in speeds) for x in depths
        )
        # Round numbers may be both.
        if crossed and not own and _told(np.array([*speeds, *depths]), rule):
            what = f"speeds of {min(speeds):g} m/s at depths of {min(depths):g} m (as tested), where the other files "
            what += "have these speeds for depths and these depths for speeds: did two columns change places?"
            yield rule.finding(file, rows_of(tested[tested["file"] == file]), ["U", "D0"], what)


def _scaled(ratio: float) -> str:
    return f" (at the tested size, 1:{ratio:g})" if ratio != 1.0 else ""


def _told(values: Array, rule: Rule) -> set[float]:
    """Numbers with so many digits that two of them are equal by no chance."""
    some = {_short(abs(x)) for x in values if math.isfinite(x) and x != 0.0}
    return {x for x in some if len(f"{x:.6g}".split("e")[0].replace(".", "").strip("0")) >= rule.limits["digits"]}


def _short(value: float) -> float:
    """A number to six digits, as a table prints it."""
    return float(f"{value:.6g}")
