"""Checks for numbers that stand twice: copied runs, columns, blocks and mirror images."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.run_table import STATES
from ident.checks.findings import Array, Evidence, Finding, Rule, check, declared, kept, milder, spans
from sim.boat.catalogue import MIRROR_OUTPUT, MIRRORED_FACTORS, OUTPUTS
from sim.boat.vehicle import Vehicle
from sim.files.columns import places_of

# Digits in which two copies agree after they went through a spreadsheet.
_AGREE = 6
# Smaller numbers have no six digits left.
_NOTHING = 1e-290


def digits(values: Array) -> NDArray[np.int64]:
    """Significant digits numbers are written with, up to ten; 0 for zero and NaN."""
    size = np.abs(np.nan_to_num(np.asarray(values, dtype=float), posinf=0.0, neginf=0.0))
    size = np.where(size > _NOTHING, size, 0.0)
    power = np.floor(np.log10(np.where(size > 0.0, size, 1.0)))
    whole = np.rint(size * 10.0 ** (9.0 - power))
    counts = np.where(whole > 0.0, 10, 0)
    # A logarithm that rounds up or down leaves nine digits, or eleven.
    counts += (whole >= 1e10).astype(int) - ((whole > 0.0) & (whole < 1e9)).astype(int)
    left = whole.astype(np.int64)
    for _ in range(10):
        even = (left > 0) & (left % 10 == 0)
        if not even.any():
            break
        left, counts = np.where(even, left // 10, left), counts - even
    return counts.astype(np.int64)


def _rounded(values: Array) -> Array:
    """Numbers to six significant digits; NaN counts as zero."""
    finite = np.where(np.abs(np.nan_to_num(values)) > _NOTHING, np.nan_to_num(values), 0.0)
    size = np.where(finite == 0.0, 1.0, np.abs(finite))
    unit = 10.0 ** (np.floor(np.log10(size)) - (_AGREE - 1))
    return np.round(finite / unit) * unit + 0.0


def _hashed(table: pd.DataFrame) -> pd.Series:
    """One number a row; equal rows have equal numbers."""
    return pd.util.hash_pandas_object(table, index=False)


def mirror_image(runs: pd.DataFrame, vehicle: Vehicle | None) -> pd.DataFrame:
    """The same runs seen in the port/starboard mirror: states, loads and parts.

    Parameters
    ----------
    runs : Run table.
    vehicle : For the partner of a plane and the sense of its deflection.
    """
    image = runs.copy()
    odd = [c for c in STATES if c == "beta" or c in MIRRORED_FACTORS]
    image[odd] = -image[odd]
    for output, sign in MIRROR_OUTPUT.items():
        image[output] = sign * image[output]
    planes = {p.name: p for p in vehicle.planes} if vehicle else {}
    for name, plane in planes.items():
        of_part = runs["part"] == name
        partner = planes[plane.mirror]
        turned = float((plane.lift_axis * np.array([1.0, -1.0, 1.0])) @ partner.lift_axis)
        image.loc[of_part, "plane"] *= 1.0 if turned > 0.0 else -1.0
        image.loc[of_part, "part"] = plane.mirror
    return image


def mirror_known(runs: pd.DataFrame, vehicle: Vehicle | None) -> pd.Series:
    """True where the mirror image of a run's state is known.

    A deflection that stands beside another part than a plane may be that of a rudder, which
    the mirror reverses, or of an elevator, which it does not.
    """
    planes = [p.name for p in vehicle.planes] if vehicle else []
    return (runs["plane"].fillna(0.0) == 0.0) | runs["part"].isin(planes)


def state_key(runs: pd.DataFrame) -> pd.Series:
    """A state and its part as a number: equal states have equal keys; a missing motion is zero."""
    table = pd.DataFrame(_rounded(runs[list(STATES)].to_numpy(float)), columns=list(STATES), index=runs.index)
    return _hashed(table.assign(part=runs["part"]))


def load_key(runs: pd.DataFrame, rule: Rule) -> pd.Series:
    """The loads of a run as a number; 0 when too few digits could tell a copy from chance."""
    loads = runs[list(OUTPUTS)].to_numpy(float)
    table = pd.DataFrame(_rounded(loads), columns=list(OUTPUTS), index=runs.index)
    sharp = (digits(loads) >= int(rule.limits["digits"])).sum(axis=1) >= int(rule.limits["loads"])
    return _hashed(table).where(sharp, 0)


def _again(runs: pd.DataFrame, key: pd.Series) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Groups of runs that share a key other than 0, two or more in each."""
    shared = (key != 0) & key.duplicated(keep=False)
    yield from runs[shared].groupby(key[shared], sort=False)


def _independent(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs that do not say they are copies."""
    return runs[runs["copy_of"] == ""]


def _differences(group: pd.DataFrame) -> str:
    """Which states differ within a group, with their values."""
    differing = []
    for column in STATES:
        values = sorted(set(group[column].dropna()))
        if len(values) > 1:
            shown = np.rad2deg(values) if column in ("alpha", "beta", "plane") else values
            unit = " deg" if column in ("alpha", "beta", "plane") else ""
            differing.append(f"{column} = {' and '.join(f'{v:.4g}' for v in shown)}{unit}")
    parts = sorted(set(group["part"]))
    return ", ".join(differing + ([f"parts {' and '.join(parts)}"] if len(parts) > 1 else []))


@check("duplicates")
def duplicates(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Every load of a run again, under another state."""
    runs = _independent(evidence.runs)
    states = state_key(runs)
    places: dict[tuple[str, str, bool], list[pd.DataFrame]] = {}
    for _, group in _again(runs, load_key(runs, rule)):
        if states[group.index].nunique() < 2:
            continue
        known = bool((~declared(evidence, group)).sum() <= 1)
        for file in dict.fromkeys(group["file"]):
            places.setdefault((str(file), _differences(group), known), []).append(group)
    for (file, difference, known), groups in places.items():
        table = pd.concat(groups)
        names = " = ".join(dict.fromkeys(groups[0]["run_id"]))
        more = f" and {len(groups) - 1} more" if len(groups) > 1 else ""
        columns = [o for o in OUTPUTS if table[o].notna().any()]
        what = f"run {names}{more}: all loads the same under {difference}"
        yield rule.finding(file, table.loc[table["file"] == file, "row"], columns, what, milder(rule, known))


@check("repeated_blocks")
def repeated_blocks(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """The same runs, state and loads, in two places."""
    runs = _independent(evidence.runs)
    loads = load_key(runs, rule)
    both = _hashed(pd.DataFrame({"loads": loads, "state": state_key(runs)})).where(loads != 0, 0)
    blocks: dict[tuple[str, str, str, str], list[tuple[int, int]]] = {}
    for _, group in _again(runs, both):
        first = group.iloc[0]
        for _, again in group.iloc[1:].iterrows():
            place = (first["file"], first["test"], again["file"], again["test"])
            blocks.setdefault(place, []).append((int(first["row"]), int(again["row"])))
    for (file, test, other, block), pairs in blocks.items():
        count = f"{len(pairs)} runs" if len(pairs) > 1 else "a run"
        what = f"{count} of {file}, {test} (rows {spans(a for a, _ in pairs)}) again here under {block}"
        yield rule.finding(other, [b for _, b in pairs], (), what)


@check("mirrored_copies")
def mirrored_copies(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Runs that are the mirror image of another to the last digit."""
    runs = _independent(evidence.runs)
    image = mirror_image(runs, evidence.vehicle)
    loads, seen = load_key(runs, rule), load_key(image, rule)
    here = list(zip(loads, state_key(runs), strict=True))
    there = list(zip(seen, state_key(image), strict=True))
    first = {k: i for i, k in reversed(list(enumerate(here)))}
    pairs = np.array([(first[k], i) for i, k in enumerate(there) if k[0] and first.get(k, i) < i], dtype=int)
    if not pairs.size:
        return
    originals, copies = runs["run_id"].to_numpy()[pairs[:, 0]], runs.iloc[pairs[:, 1]]
    for file, group in copies.groupby("file", sort=False):
        name = originals[np.argmax(copies["file"].to_numpy() == file)]
        what = f"{len(group)} runs are exact mirror images of others (the first of {name})"
        yield rule.finding(str(file), group["row"], OUTPUTS, what)


@check("frozen_column")
def frozen_column(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """One load unchanged in runs of different state while the other loads change."""
    runs = _independent(evidence.runs).copy()
    odd = [c for c in STATES if c in ("beta", "plane") or c in MIRRORED_FACTORS]
    runs[odd] = runs[odd].abs()
    states, whole = state_key(runs).to_numpy(), load_key(runs, rule).to_numpy()
    given, known = runs[list(OUTPUTS)].notna().to_numpy(), declared(evidence, runs).to_numpy()
    files, rows = runs["file"].to_numpy(object), runs["row"].to_numpy()
    # File, what varies, whether the campaign says so -> rows and the load of each group.
    found: dict[tuple[str, str, bool], list[tuple[Array, str]]] = {}
    for column, output in enumerate(OUTPUTS):
        for group in _alike(runs, output, rule):
            others = np.delete(given[group], column, axis=1).any()
            same = others and len(np.unique(whole[group])) == 1
            if len(np.unique(states[group])) < 2 or same:
                continue
            varies, trusted_less = _axes(runs.iloc[group]), int((~known[group]).sum()) <= 1
            for file in dict.fromkeys(files[group]):
                here = rows[group[files[group] == file]]
                found.setdefault((str(file), varies, trusted_less), []).append((here, output))
    for (file, varies, trusted_less), groups in found.items():
        places, columns = np.concatenate([r for r, _ in groups]), list(dict.fromkeys(output for _, output in groups))
        what = f"the same to the last digit whatever {varies}: {len(groups)} values of {', '.join(columns)} "
        what += f"stand in {len(np.unique(places))} runs"
        yield rule.finding(file, places, columns, what, milder(rule, trusted_less))


def _alike(runs: pd.DataFrame, output: str, rule: Rule) -> list[NDArray[np.int64]]:
    """Places of runs of one test with the same value of a load, in groups too large for chance, as they come."""
    count = digits(runs[output].to_numpy(float))
    usable = np.flatnonzero(kept(runs, output).to_numpy() & (count >= rule.limits["digits"]))
    if not usable.size:
        return []
    test, which = np.unique(runs["test"].to_numpy(object)[usable], return_inverse=True)
    shown = np.zeros(len(test), dtype=int)
    np.maximum.at(shown, which, count[usable])
    of_test = np.bincount(which)
    least = [_beyond_chance(int(n), int(d), rule.limits["chance"]) for n, d in zip(of_test, shown, strict=True)]
    value = _rounded(runs[output].to_numpy(float)[usable])
    _, key, size = np.unique(np.stack([which, value]), axis=1, return_inverse=True, return_counts=True)
    many = (size[key] > 1) & (size[key] >= np.array(least)[which])
    return [usable[many][group] for group in places_of(key[many].tolist()).values()]


def _beyond_chance(count: int, shown: int, chance: float) -> int:
    """Fewest of some values that agree and are not expected to by chance.

    Of n values that are equally likely to be any of m, n^k / (k! m^(k-1)) groups of k agree.

    Parameters
    ----------
    count : Number of values, n.
    shown : Digits they are written with; the first of them tells little, m = 10^(digits - 1).
    chance : Groups expected by chance that are still taken for none.
    """
    size, m = 2, 10.0 ** (min(shown, _AGREE) - 1)
    while size < count and size * math.log(count) - math.lgamma(size + 1) - (size - 1) * math.log(m) > math.log(chance):
        size += 1
    return size


def _axes(group: pd.DataFrame) -> str:
    """Names of the states that differ within a group."""
    values = group[list(STATES)].to_numpy(float)
    names = [
        c for c, low, high in zip(STATES, np.fmin.reduce(values), np.fmax.reduce(values), strict=True) if low < high
    ]
    return ", ".join(names + (["part"] if group["part"].nunique() > 1 else []))
