"""Checks of runs against each other: symmetry, outliers and factors of ten."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.run_table import STATES
from ident.checks.copies import mirror_image, mirror_known, state_key
from ident.checks.findings import (
    Array,
    Evidence,
    Finding,
    Rule,
    check,
    declared,
    dynamic,
    factors,
    kept,
    milder,
    prime,
    rules,
)
from ident.timeseries import MAD_TO_SIGMA
from sim.boat.catalogue import MIRROR_OUTPUT, OUTPUTS

# Axes along which a load is smooth; angles and rates also bend (stall), and do so in
# every series alike.
_AXES = ("alpha", "beta", "plane", "D0", "U", "p", "q", "r")
_LOGARITHMIC = ("D0", "U")
_BENDING = ("alpha", "beta", "plane", "p", "q", "r")
_ODD = [o for o, sign in MIRROR_OUTPUT.items() if sign < 0]
# Other runs that a local fit goes through, and points on each side that are looked through for them: more than
# that many in one place, with one load each, have no neighbour anywhere else.
_NEAR, _BESIDE = 4, 16
# Points worked on at once, and points of a series that are tried as the one that spoils it.
_CHUNK, _SUSPECTS = 8192, 64


# -- symmetry ----------------------------------------------------------------------------


@check("symmetry")
def pairs(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """A run and its port/starboard image, loads of both measured."""
    if evidence.body is None:
        return
    runs = evidence.runs[(evidence.runs["copy_of"] == "") & mirror_known(evidence.runs, evidence.vehicle)]
    image = mirror_image(runs, evidence.vehicle)
    there = zip(image["test"], state_key(image), strict=True)
    at = {place: k for k, place in enumerate(zip(runs["test"], state_key(runs), strict=True))}
    couples = [(k, at[place]) for k, place in enumerate(there) if at.get(place, k) > k]
    if not couples:
        return
    first, second = np.array(couples).T
    known = declared(evidence, runs).to_numpy()
    off, share = _disagreement(evidence, runs, image, first, second)
    bad = (off > rule.limits["standard_errors"]) & (share > rule.limits["share"])
    both = pd.DataFrame({"file": runs["file"].to_numpy()[second], "known": known[first] | known[second]})
    here, there_ = (runs["part"].to_numpy(object)[k] for k in (first, second))
    both["parts"] = np.where(here == there_, here, here + " and " + there_)
    both["many"] = bad.sum(axis=1)
    for key, group in both[both["many"] > 0].groupby(["file", "parts", "known"], sort=False):
        file, parts, trusted_less = str(key[0]), str(key[1]), bool(key[2])
        inside = np.where(bad[group.index], share[group.index], 0.0)
        k, column = divmod(int(inside.argmax()), len(OUTPUTS))
        worst = int(group.index[k])
        names = f"{runs['run_id'].iloc[first[worst]]} and {runs['run_id'].iloc[second[worst]]}"
        what = f"{parts}: {group['many'].sum()} loads disagree with their mirror image, most {OUTPUTS[column]} of "
        what += f"{names}, by {100 * inside.max():.0f} % of the largest {OUTPUTS[column]} there"
        members = runs.iloc[np.unique([first[group.index], second[group.index]])]
        columns = [OUTPUTS[c] for c in np.flatnonzero(bad[group.index].sum(axis=0))]
        severity = "info" if trusted_less else rule.severity
        yield rule.finding(file, members.loc[members["file"] == file, "row"], columns, what, severity)


def _disagreement(
    evidence: Evidence, runs: pd.DataFrame, image: pd.DataFrame, first: NDArray[np.int64], second: NDArray[np.int64]
) -> tuple[Array, Array]:
    """(pairs, 6) difference of loads from their image: in standard errors before quality; over the largest there."""
    given = np.column_stack([kept(runs, o) for o in OUTPUTS])
    seen, stated = (t[list(OUTPUTS)].to_numpy(float) for t in (image, runs))
    sigma = runs[[f"s_{o}" for o in OUTPUTS]].to_numpy(float) / factors(evidence, runs).to_numpy()[:, None]
    both = given[first] & given[second]
    off = np.where(both, np.abs(stated[second] - seen[first]), 0.0)
    scale = dynamic(runs, evidence.body).fillna(1.0) if evidence.body else pd.Series(1.0, index=runs.index)
    largest = (runs[list(OUTPUTS)].abs().div(scale, axis=0)).groupby([runs["file"], runs["test"]]).transform("max")
    size = np.where(both, largest.to_numpy()[second] * scale.to_numpy()[second, None], 1.0)
    spread = np.nan_to_num(np.hypot(sigma[first], sigma[second]))
    score = np.where(off > 0.0, off / np.where(spread > 0.0, spread, np.nan), 0.0)
    return np.where(np.isnan(score), np.inf, score), off / np.where(size > 0.0, size, 1.0)


@check("symmetry")
def zero_by_symmetry(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Y, K and N of a symmetric state must vanish."""
    if evidence.body is None:
        return
    runs = evidence.runs
    # A state is symmetric when its mirror image is the same state: no drift, roll or yaw, and no
    # rudder, one plane of a pair, or deflection of unknown sense at an angle.
    same = state_key(mirror_image(runs, evidence.vehicle)) == state_key(runs)
    straight = same & mirror_known(runs, evidence.vehicle)
    for output in _ODD:
        load = prime(runs, output, evidence.body).abs().where(kept(runs, output))
        largest = load.groupby([runs["file"], runs["test"]]).transform("max")
        others = load.where(~straight).groupby([runs["file"], runs["test"]]).transform("max")
        reference = others.fillna(_across(runs, output, evidence))
        bad = straight & (load > rule.limits["share"] * reference) & (largest > 0.0)
        for (file, _), group in runs[bad].groupby(["file", "test"], sort=False):
            share = (load / reference)[group.index]
            worst = int(np.argmax(share.to_numpy()))
            what = f"{output} = {group[output].iloc[worst]:.4g} in a symmetric state, run {group['run_id'].iloc[worst]}"
            size = f"{100 * share.iloc[worst]:.0f} % of the largest {output} there"
            known = bool(declared(evidence, group).all())
            yield rule.finding(str(file), group["row"], [output], f"{what}, {size}", milder(rule, known))


def _across(runs: pd.DataFrame, output: str, evidence: Evidence) -> pd.Series:
    """Size of the loads that symmetry allows, where a test has no unsymmetric run."""
    assert evidence.body is not None
    allowed = ("X", "Z") if output == "Y" else ("M",)
    sizes = pd.DataFrame({o: prime(runs, o, evidence.body).abs() for o in allowed})
    return sizes.max(axis=1).groupby([runs["file"], runs["test"]]).transform("max")


# -- neighbours --------------------------------------------------------------------------


@dataclass(frozen=True)
class Fits:
    """A local fit through the neighbours of every point of a series.

    Attributes
    ----------
    near : (points, 4) the neighbours.
    weight : (points, 4) their weights in the fit.
    noise : (points,) sqrt(1 + sum of squared weights), in errors of one load; NaN without a fit.
    """

    near: NDArray[np.int64]
    weight: Array
    noise: Array

    def at(self, values: Array) -> Array:
        """(points,) fitted values; those of points without a load are not looked at."""
        fitted: Array = (self.weight * np.nan_to_num(values)[self.near]).sum(axis=1)
        return fitted


@dataclass
class Series:
    """Loads along one axis, all other states the same; mirror images of runs included.

    ``at`` are positions, ``loads`` (points, 6) dimensionless loads, ``owner`` the run of
    each point.
    """

    axis: str
    at: Array
    loads: Array
    owner: NDArray[np.int64]

    def local_fits(self, given: NDArray[np.bool_]) -> Fits:
        """Fit at each point: quadratic through the four nearest other runs, straight through fewer.

        There is none where fewer than two different positions are near.
        """
        near, count = self._nearest(given)
        at = np.where(np.arange(_NEAR) < count[:, None], self.at[near], np.nan)
        different = np.sort(at.round(9), axis=1)
        distinct = (count > 0) + (np.diff(different, axis=1) > 0.0).sum(axis=1)
        weight, noise = np.zeros(near.shape), np.full(len(near), np.nan)
        offset = at - self.at[:, None]
        for size in range(2, _NEAR + 1):
            for terms in (2, 3):
                fitted = np.flatnonzero((count == size) & (distinct >= 2) & ((distinct >= 4) == (terms == 3)))
                if fitted.size:
                    x = offset[fitted, :size] / np.abs(offset[fitted, :size]).max(axis=1, keepdims=True)
                    weight[fitted, :size] = np.linalg.pinv(x[:, :, None] ** np.arange(terms))[:, 0, :]
                    noise[fitted] = np.sqrt(1.0 + (weight[fitted] ** 2).sum(axis=1))
        return Fits(near, weight, noise)

    def _nearest(self, given: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(points, 4) nearest given points of other runs, first those that stand first; and how many there are."""
        order = np.flatnonzero(given)[np.argsort(self.at[given], kind="stable")]
        near = np.zeros((self.at.size, _NEAR), dtype=np.int64)
        count = np.zeros(self.at.size, dtype=np.int64)
        beside = np.concatenate([np.arange(-_BESIDE, 0), np.arange(1, _BESIDE + 1)])
        for low in range(0, order.size, _CHUNK):
            place = np.arange(low, min(low + _CHUNK, order.size))
            point, window = order[place], place[:, None] + beside
            inside = (window >= 0) & (window < order.size)
            others = np.sort(np.where(inside, order[window.clip(0, order.size - 1)], self.at.size), axis=1)
            known = others < self.at.size
            others = np.where(known, others, 0)
            known &= self.owner[others] != self.owner[point][:, None]
            distance = np.where(known, np.abs(self.at[others] - self.at[point][:, None]), np.inf)
            first = np.argsort(distance, axis=1, kind="stable")[:, :_NEAR]
            near[point, : first.shape[1]] = np.take_along_axis(others, first, axis=1)
            count[point] = np.minimum(known.sum(axis=1), _NEAR)
        return near, count


def _series(evidence: Evidence) -> list[Series]:
    """Every series of three or more different runs along every axis."""
    assert evidence.body is not None
    runs = evidence.runs[evidence.runs["copy_of"] == ""]
    runs = runs[runs["decoupled"] != "True"] if "decoupled" in runs else runs
    runs = runs[["test", "part", "exclude", *STATES, *OUTPUTS]]
    runs = runs.assign(**{output: runs[output].where(kept(runs, output)) for output in OUTPUTS})
    known = mirror_known(runs, evidence.vehicle)
    image = mirror_image(runs[known], evidence.vehicle)
    table = pd.concat([runs, image], ignore_index=True)
    owner = np.concatenate([runs.index, image.index])
    scale = dynamic(table, evidence.body).to_numpy(float)
    loads = table[list(OUTPUTS)].to_numpy(float) / scale[:, None]
    loads[:, 3:] /= evidence.body.length
    first = ~pd.DataFrame({"owner": owner, "state": state_key(table)}).duplicated().to_numpy()
    tests = pd.util.hash_array(table["test"].to_numpy(object))
    series = []
    for axis in _AXES:
        at = table[axis].to_numpy(float)
        usable = first & (np.nan_to_num(at) > 0.0 if axis in _LOGARITHMIC else np.isfinite(scale))
        at = np.log(np.where(usable, at, 1.0)) if axis in _LOGARITHMIC else np.nan_to_num(at)
        # Without speed, load over rate squared jumps with the sign of the rate.
        side = np.where(np.nan_to_num(table["U"]) == 0.0, np.sign(at), 0.0) if axis in "pqr" else np.zeros(at.size)
        rest = state_key(table.assign(**{axis: 0.0})).to_numpy() ^ tests
        rest ^= (side + 1.0).astype(np.uint64)
        places = np.flatnonzero(usable)
        order = places[np.argsort(rest[places], kind="stable")]
        for group in np.split(order, np.flatnonzero(np.diff(rest[order])) + 1):
            if group.size >= 3 and np.unique(owner[group]).size >= 3 and np.unique(at[group].round(9)).size >= 3:
                series.append(Series(axis, at[group], loads[group], owner[group]))
    return series


def deviations(evidence: Evidence, every: list[Series]) -> pd.DataFrame:
    """How far each load is from the local fit through its neighbours, along each axis.

    Parameters
    ----------
    evidence : Runs and body.
    every : Their series.

    Returns
    -------
    Columns series (position in ``every``), point, owner (index of the run), output, axis,
    load and fit (dimensionless), noise (of the deviation, in errors of one load), usual
    (median load of like series here), off (deviation over its noise, less what all like
    series share here) and scale (one robust standard deviation, at least the run's own
    standard error before its quality factor).
    """
    pieces: dict[str, list[Array]] = {name: [] for name in ("point", "owner", "at", "load", "fit", "noise")}
    places: list[tuple[int, str, str, int]] = []
    # Many series are of the same places, and many loads of the same runs.
    fits: dict[tuple[bytes, bytes, bytes], Fits] = {}
    for number, series in enumerate(every):
        stencil = hash(tuple(np.sort(series.at).round(6)))
        given, owners = np.isfinite(series.loads), np.unique(series.owner, return_inverse=True)[1]
        for output, values, known in zip(OUTPUTS, series.loads.T, given.T, strict=True):
            key = (series.at.tobytes(), owners.tobytes(), known.tobytes())
            if key not in fits:
                fits[key] = series.local_fits(known)
            local = fits[key]
            point = np.flatnonzero(np.isfinite(local.noise))
            columns = (point, series.owner[point], series.at[point].round(6), values[point], local.at(values)[point])
            for column, piece in zip(pieces.values(), (*columns, local.noise[point]), strict=True):
                column.append(piece)
            places.append((number, output, series.axis, stencil))
    size = [len(piece) for piece in pieces["point"]]
    table = pd.DataFrame({name: np.concatenate([np.zeros(0), *columns]) for name, columns in pieces.items()})
    table = table.astype({"point": int, "owner": evidence.runs.index.dtype})
    for k, (name, kind_of) in enumerate({"series": int, "output": object, "axis": object, "stencil": int}.items()):
        table[name] = np.repeat(np.array([place[k] for place in places], dtype=kind_of), size)
    runs = evidence.runs.loc[table["owner"]]
    kind = [table["output"], table["axis"], pd.Series(runs["test"].to_numpy()), pd.Series(runs["part"].to_numpy())]
    raw = (table["load"] - table["fit"]) / table["noise"]
    here = [*kind, table["stencil"], table["at"]]
    alike = (raw.groupby(here).transform("size") >= 3) & table["axis"].isin(_BENDING)
    table["usual"] = table["load"].groupby(here).transform("median").where(alike, 0.0)
    table["off"] = raw - raw.groupby(here).transform("median").where(alike, 0.0)
    robust = MAD_TO_SIGMA * table["off"].abs().groupby(kind).transform("median")
    floor = rules()["outliers"].limits["floor"] * table["load"].abs().groupby(kind).transform("max")
    table["scale"] = np.maximum(np.maximum(robust, floor), _own_error(evidence, table))
    return table


def _own_error(evidence: Evidence, table: pd.DataFrame) -> Array:
    """Dimensionless standard error of each run's load before its quality factor."""
    error = np.zeros(len(table))
    for output in OUTPUTS:
        here = (table["output"] == output).to_numpy()
        runs = evidence.runs.loc[table["owner"][here]]
        size = runs[output].abs().where(runs[output] != 0.0)
        relative = (runs[f"s_{output}"] / size / factors(evidence, runs)).fillna(runs["rel_sigma"]).fillna(0.0)
        error[here] = relative.to_numpy(float) * table["load"][here].abs().to_numpy(float)
    return error


def _culprit(group: pd.DataFrame, series: Series) -> int:
    """Row of the point without which a series is smoothest.

    A bad point spoils the fits of its neighbours, so the largest deviation may stand beside it.
    """
    values = np.full(series.at.size, np.nan)
    values[group["point"]] = group["load"] - group["usual"]
    # In a long series the bad point is among the worst.
    worst = group.loc[group["off"].abs().sort_values(ascending=False, kind="stable").index[:_SUSPECTS].sort_values()]
    left = {}
    for row, owner in zip(worst.index.to_numpy(), worst["owner"], strict=True):
        given = np.isfinite(values) & (series.owner != owner)
        local = series.local_fits(given)
        judged = np.isfinite(local.noise)
        if judged.sum() < 3:
            return int(group.index.to_numpy()[np.argmax(group["off"].abs().to_numpy())])
        off = (values - local.at(values))[judged] / local.noise[judged]
        left[int(row)] = float(np.abs(off).sum() / judged.sum())
    return int(min(left, key=lambda row: left[row]))


def flagged(evidence: Evidence, limit: float) -> pd.DataFrame:
    """One row for every series and load with a deviation beyond ``limit`` robust deviations.

    Returns
    -------
    Columns of ``deviations`` with score (largest of the series) and expected (dimensionless
    load in line with the neighbours), one row a run, load and axis, the worst first.
    """
    key = f"flagged {limit}"
    if key not in evidence.memo:
        every = _series(evidence)
        table = deviations(evidence, every)
        table["score"] = table["off"].abs() / table["scale"].where(table["scale"] > 0.0)
        table["expected"] = table["load"] - table["off"] * table["noise"]
        groups = [table["series"], table["output"]]
        table["score"] = table["score"].groupby(groups).transform("max")
        bad = table[table["score"] > limit].groupby(["series", "output"], sort=False)
        rows = [_culprit(group, every[int(group["series"].iloc[0])]) for _, group in bad]
        chosen = table.loc[rows].sort_values("score", ascending=False)
        evidence.memo[key] = chosen.drop_duplicates(["owner", "output", "axis"])
    return evidence.memo[key].copy()


def _decade(row: pd.Series, near: float) -> int:
    """Power of ten a load is off by, 0 when it is off by something else."""
    if not np.sign(row["load"]) * np.sign(row["expected"]) > 0.0:
        return 0
    power = math.log10(abs(row["load"])) - math.log10(abs(row["expected"]))
    whole = round(power)
    return whole if abs(power - whole) <= near and 1 <= abs(whole) <= 3 else 0


@check("factor")
def slipped_points(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Loads that are a power of ten away from what their neighbours say."""
    if evidence.body is None:
        return
    suspects = flagged(evidence, rule.limits["deviation"])
    suspects["decade"] = np.array([_decade(row, rule.limits["decades"]) for _, row in suspects.iterrows()], dtype=int)
    for _, group in suspects[suspects["decade"] != 0].groupby(["owner", "decade"], sort=False):
        worst = group.iloc[0]
        run, decade = evidence.runs.loc[worst["owner"]], int(worst["decade"])
        outputs = [o for o in OUTPUTS if o in set(group["output"])]
        value = run[worst["output"]]
        what = f"{worst['output']} = {value:.4g} of run {run['run_id']} is {10.0**decade:g} times "
        what += f"what its neighbours along {worst['axis']} say"
        yield rule.finding(str(run["file"]), [run["row"]], outputs, what)


@check("outliers")
def out_of_line(evidence: Evidence, rule: Rule) -> Iterator[Finding]:
    """Loads far from a local fit through their neighbours, and not by a power of ten."""
    if evidence.body is None:
        return
    near = rules()["factor"].limits["decades"]
    suspects = flagged(evidence, rule.limits["deviation"])
    suspects = suspects[np.array([_decade(row, near) == 0 for _, row in suspects.iterrows()], dtype=bool)]
    runs = evidence.runs.loc[suspects["owner"]]
    suspects = suspects.assign(file=runs["file"].to_numpy(), known=declared(evidence, runs).to_numpy())
    for (file, known), group in suspects.groupby(["file", "known"], sort=False):
        worst = group.iloc[0]
        run = evidence.runs.loc[worst["owner"]]
        outputs = [o for o in OUTPUTS if o in set(group["output"])]
        ratio = worst["load"] / worst["expected"] if worst["expected"] else math.inf
        what = f"{worst['output']} of run {run['run_id']} (or of a neighbour) is {ratio:.2g} times a local fit along "
        what += f"{worst['axis']}, {worst['score']:.1f} robust deviations off"
        others = sorted(set(evidence.runs.loc[group["owner"], "run_id"]) - {run["run_id"]})
        what += f"; so are loads of {len(others)} more, {', '.join(others[:4])}" if others else ""
        what += "; the campaign already trusts them less" if known else ""
        yield rule.finding(
            str(file), evidence.runs.loc[group["owner"], "row"], outputs, what, milder(rule, bool(known))
        )
