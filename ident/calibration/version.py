"""A calibration from a database version to the next: diagnostics, rows, metadata, tables."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.calibration.cautions import UNLEARNT, cautions
from ident.calibration.crossed import cross_validated, maneuvers
from ident.calibration.estimate import Estimate, left_out
from ident.calibration.estimate import calibrate as most_probable
from ident.calibration.file import CalibrationFile, Parameter, apply, load_calibration, parameters
from ident.calibration.posterior import emcee, sample
from ident.calibration.problem import Channel, Problem, problem
from ident.calibration.result import (
    Calibrated,
    CalibrationSummary,
    Known,
    LeftOut,
    MultiplierGroup,
    Prior,
    TrainedSeries,
)
from ident.calibration.selection import Comparison, compare
from ident.calibration.sensitivity import sensitivity as what_decides
from ident.database.store import commit, digest
from ident.deprecation import gathered
from ident.estimates.draft import measured_rows
from ident.options import Diagnostics, Work
from ident.output import Tell
from sim.boat.database import NUMBERS, Version, column_order, own_version, read_rows, versions
from sim.boat.row_codec import correlation_matrix, correlation_texts
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError

Array = NDArray[np.float64]

# Metadata of the fit that go on with its rows.
_FIT = ("conversions", "options", "unused", "warnings", "quality", "checks", "runs")

# Draws of a posterior, or of a design: more would fill the memory, and fly for weeks.
_MOST_DRAWS = 10_000_000


def captive_version(db: str, vehicle: str, number: int | None) -> Version:
    """The version to start from: the one asked for, or the latest that no maneuver trained.

    Raises
    ------
    InputError
        When there is none, or the one asked for is itself calibrated.
    """
    if number is not None:
        captive = own_version(db, vehicle, number)
        if captive.trained:
            raise InputError(
                f"{db}, version {number}", "a calibrated version", "a captive-only one; see `ident versions`"
            )
        return captive
    for version in reversed(versions(db)):
        of_vehicle = version.metadata.get("vehicle", vehicle) == vehicle
        if of_vehicle and not version.trained:
            return version
    raise InputError(db, f"no captive version of {vehicle}", "a version written by `ident fit`")


def from_data(parameter: Parameter, value: float, sigma: float) -> tuple[float, float] | None:
    """What the maneuvers alone say of one multiplier, its prior taken out of the posterior.

    Returns
    -------
    Value and standard deviation, or None when the maneuvers say next to nothing.
    """
    gained = 1.0 / sigma**2 - 1.0 / parameter.sigma**2
    if sigma > UNLEARNT * parameter.sigma or gained <= 0.0:
        return None
    alone = (value / sigma**2 - parameter.mean / parameter.sigma**2) / gained
    return float(alone), float(gained**-0.5)


def _group(parameter: Parameter, value: float, sigma: float, chosen: bool, evidence: float) -> MultiplierGroup:
    prior = parameter.group.prior
    alone = from_data(parameter, value, sigma)
    away = None
    if alone is not None:
        away = abs(alone[0] - parameter.mean) / float(np.hypot(alone[1], parameter.sigma))
    method = parameter.method
    known = Prior(parameter.mean, parameter.sigma, method, prior.method not in ("captive", "stated"), prior.source)
    return MultiplierGroup(
        name=parameter.group.name,
        title=parameter.group.title,
        kind=parameter.group.kind,
        terms=parameter.group.terms,
        values=int(parameter.rows.sum()),
        prior=known,
        captive_sigma=parameter.captive,
        posterior=Known(value, sigma),
        maneuvers_alone=None if alone is None else Known(*alone),
        away_from_prior=away,
        beyond_captive=parameter.beyond_captive(value),
        chosen=chosen,
        evidence=float(f"{evidence:.4g}"),
    )


def _left_out(task: Problem, whole: Estimate, workers: int | None, each: Callable[[str], None]) -> list[LeftOut]:
    """The calibration repeated without each source of each case, and what it then predicts."""
    repeated = []
    for out in dict.fromkeys(c.key[:2] for c in task.channels):

        def dropped(channel: Channel, out: tuple[str, str] = out) -> bool:
            return channel.key[:2] == out

        if all(map(dropped, task.channels)):
            continue
        each(f"without {out[0]} {out[1]}")
        estimate, found = left_out(task, whole, dropped, workers)
        predicted = {key[2]: error for key, error in found.items()}
        shift = (estimate.theta - whole.theta) / np.maximum(estimate.deviation, whole.deviation)
        trained = {k[2]: v for k, v in whole.rms.items() if k[:2] == out}
        values, sigmas, shifts = ([float(x) for x in vector] for vector in (estimate.theta, estimate.deviation, shift))
        repeated.append(LeftOut(*out, values, sigmas, shifts, predicted, trained))
    return repeated


def calibrated_rows(rows: pd.DataFrame, chosen: list[Parameter], estimate: Estimate) -> pd.DataFrame:
    """Database rows with the multipliers in force and the posterior in their errors.

    The captive error of a value stays, scaled; the error of its multiplier is added, and
    is shared by all values of a group (column ``correlation``).
    """
    out = rows.copy()
    out["value"] = apply(rows["value"].to_numpy(), chosen, estimate.theta)
    first, matrix = correlation_matrix(rows)
    value, error = first["value"].to_numpy(), first["stderr"].to_numpy()
    place = first["estimate"].to_numpy()
    first_row = {int(e): i for i, e in reversed(list(enumerate(rows["estimate"])))}
    at = np.array([first_row[int(e)] for e in place])
    inside = np.stack([p.rows[at] for p in chosen], axis=1)
    multiplies = np.array([p.group.kind == "multiplier" for p in chosen])
    factor = np.prod(np.where(inside & multiplies, estimate.theta, 1.0), axis=1)
    side = np.where(value < 0.0, -1.0, 1.0)
    slope = np.where(multiplies, (value * factor)[:, None] / estimate.theta, side[:, None]) * inside
    total = np.outer(factor * error, factor * error) * matrix + slope @ estimate.covariance @ slope.T
    deviation = np.sqrt(np.diag(total))
    text = correlation_texts(total, place.tolist())
    index = {int(e): i for i, e in enumerate(place)}
    known = rows["estimate"].to_numpy() >= 0
    where = np.array([index.get(int(e), -1) for e in rows["estimate"]])
    out.loc[known, "stderr"] = deviation[where[known]]
    out["correlation"] = [text.get(int(e), "") for e in rows["estimate"]]
    out["calibration"] = [
        " ".join(f"{p.group.name}={x:.4g}" for p, x in zip(chosen, estimate.theta, strict=True) if p.rows[i])
        for i in range(len(rows))
    ]
    for column in NUMBERS:
        out[column] = [float(f"{x:.12g}") for x in out[column]]
    return out[column_order()]


def _rounded(estimate: Estimate) -> Estimate:
    """Four digits: far below any posterior error, and the same on another machine."""
    return replace(
        estimate,
        theta=np.array([float(f"{x:.4g}") for x in estimate.theta]),
        covariance=np.array([[float(f"{x:.4g}") for x in row] for row in estimate.covariance]),
    )


@dataclass(frozen=True)
class Solved:
    """The multipliers of a calibration.

    Attributes
    ----------
    task, estimate : With the groups that are free, and their optimum.
    comparison : What the maneuvers ask for, of all groups.
    kept : Places of the free groups among all.
    """

    task: Problem
    estimate: Estimate
    comparison: Comparison
    kept: tuple[int, ...]


def _solved(every: Problem, choose: str, workers: int | None, each: Callable[[str], None]) -> Solved:
    """The optimum of all groups, or of those that the evidence chooses."""
    whole = most_probable(every, workers, each)
    comparison = compare(every, whole)
    if choose == "all":
        return Solved(every, _rounded(whole), comparison, tuple(range(len(every.chosen))))
    if not comparison.kept:
        text = "a file whose groups can explain what the references have"
        raise InputError("choose", "maneuvers that ask for no group", text)
    task = every.freeing(comparison.kept)
    each(f"{len(comparison.kept)} of {len(every.chosen)} groups are asked for")
    start = whole.theta[list(comparison.kept)]
    return Solved(task, _rounded(most_probable(task, workers, each, start)), comparison, comparison.kept)


def _groups(every: Problem, solved: Solved) -> list[MultiplierGroup]:
    """Every group as it stands: free ones at their posterior, held ones at their prior."""
    groups, gain = [], solved.comparison.gain
    free = dict(zip(solved.kept, zip(solved.estimate.theta, solved.estimate.deviation, strict=True), strict=True))
    for i, parameter in enumerate(every.chosen):
        value, sigma = free.get(i, (parameter.mean, parameter.sigma))
        groups.append(_group(parameter, float(value), float(sigma), i in free, gain[i]))
    return groups


def _in_force(solved: Solved) -> tuple[list[Parameter], Estimate]:
    """What changes the rows: free groups, and held ones whose prior mean changes something, with its error."""
    held = [p for p in solved.task.held if p.mean != p.neutral]
    theta = np.concatenate([solved.estimate.theta, [p.mean for p in held]])
    covariance = np.zeros((theta.size, theta.size))
    k = len(solved.estimate.theta)
    covariance[:k, :k] = solved.estimate.covariance
    covariance[range(k, theta.size), range(k, theta.size)] = [p.sigma**2 for p in held]
    return [*solved.task.chosen, *held], replace(solved.estimate, theta=theta, covariance=covariance)


def _told(each: Callable[[str], None]) -> Tell:
    """The teller that a function of one line of text makes."""
    return lambda what, done, of: each(what)


@gathered(
    "0.2",
    {"work": Work, "diagnostics": Diagnostics},
    ("workers", "each", "wait", "posterior", "sensitivity", "seed"),
    wait="work",
    workers="work",
    each=("work", "tell", _told),
    posterior="diagnostics",
    sensitivity="diagnostics",
    # Zero was what it was without; now it is refused where nothing is drawn.
    seed=("diagnostics", "seed", lambda seed: seed or None),
)
def calibrate(
    name: str | os.PathLike[str],
    db: str | os.PathLike[str] = "coeff_db",
    version: int | None = None,
    message: str = "",
    left_out: bool = True,
    *,
    diagnostics: Diagnostics = Diagnostics(),  # noqa: B008  (frozen)
    work: Work = Work(),  # noqa: B008  (frozen)
) -> Calibrated:
    """Estimate multipliers of coefficient groups from free-running maneuvers; commit the result.

    Parameters
    ----------
    name, db, message : Bundled calibration or path; folder or URL of the database; stored with the version.
    version : The captive version it starts from; the latest captive one when None.
    left_out : Also calibrate without each source in turn.
    diagnostics, work : What else is computed of the posterior; how long to wait, who is told, how many threads.

    Returns
    -------
    Calibrated
        The new version has the captive one as its parent, and covariances of the posterior.

    Raises
    ------
    InputError
        For a calibration, case, reference, database or version that does not exist or fit, or a missing package.

    Examples
    --------
    >>> import ident
    >>> _ = ident.fit("my-boat/captive", db="calibrated_db")
    >>> done = ident.calibrate("my-boat/calibration.toml", db="calibrated_db", left_out=False)
    >>> done.version, list(done.groups.index)
    (1, ['rudders', 'yaw_damping'])
    """
    _refuse_idle(diagnostics, work)
    if diagnostics.posterior:
        emcee()
    spec, where, file_digest = load_calibration(os.fspath(name))
    vehicle = load_vehicle(spec.vehicle, beside=where)
    base = captive_version(os.fspath(db), vehicle.name, version)
    rows, _ = read_rows(os.fspath(db), base.number, vehicle.name)
    if spec.starts_from == "runs":
        rows = measured_rows(rows)
    every = problem(spec, where, vehicle, rows, parameters(spec, vehicle, rows, where))
    solved, summary = _learnt(every, spec, (base, file_digest), left_out, diagnostics, work)
    done = calibrated_rows(rows, *_in_force(solved))
    number, new = commit(os.fspath(db), done, _metadata(base, solved.task, summary, message), work.wait)
    return Calibrated(summary, number, new, digest(done))


def _refuse_idle(diagnostics: Diagnostics, work: Work) -> None:
    """Refuse options that change nothing."""
    if work.dask is not None:
        raise InputError(
            "calibrate, work.dask", repr(work.dask), "workers: a calibration runs in threads of one machine"
        )
    for name, count in (("posterior", diagnostics.posterior), ("sensitivity", diagnostics.sensitivity)):
        if count > _MOST_DRAWS:
            text = f"{_MOST_DRAWS:,} at most: each flies every training case"
            raise InputError(f"calibrate, diagnostics.{name}", f"{count:,}", text)
    if diagnostics.seed is not None and not (diagnostics.posterior or diagnostics.sensitivity):
        raise InputError("calibrate, diagnostics.seed", f"{diagnostics.seed}", "with posterior or sensitivity")


def _learnt(
    every: Problem, spec: CalibrationFile, of: tuple[Version, str], left_out: bool, diagnostics: Diagnostics, work: Work
) -> tuple[Solved, CalibrationSummary]:
    """The multipliers, and what is said of them; ``of`` are the parent and the digest of the file."""

    def each(text: str) -> None:
        work.tell(text, 0, 0)

    seed, workers = diagnostics.seed or 0, work.workers
    # Before the search, so that what cannot be is refused at once.
    if diagnostics.cross_validate:
        maneuvers(every)
    size = diagnostics.sensitivity
    shares = what_decides(every, size, seed, workers, each) if size else None
    solved = _solved(every, spec.choose, workers, each)
    task, estimate = solved.task, solved.estimate
    without = _left_out(task, estimate, workers, each) if left_out else []
    draws = diagnostics.posterior
    drawn = sample(task, estimate, draws, seed, workers, each) if draws else None
    crossed = cross_validated(task, estimate, workers, each) if diagnostics.cross_validate else None
    series = [
        TrainedSeries(*key, float(f"{rmse:.4g}"), float(f"{estimate.sigma[key]:.4g}"))
        for key, rmse in estimate.rms.items()
    ]
    evidence = {"chosen": solved.comparison.log_evidence, "all": solved.comparison.every}
    base, file_digest = of
    return solved, CalibrationSummary(
        calibration=spec.name,
        vehicle=every.vehicle.name,
        parent=base.number,
        parent_digest=base.digest,
        source=spec.source,
        file_digest=file_digest,
        trained=list(dict.fromkeys(f"{c.key[0]}:{c.key[1]}" for c in task.channels)),
        groups=_groups(every, solved),
        covariance=estimate.covariance.tolist(),
        series=series,
        left_out=without,
        warnings=cautions(task, estimate, without, drawn),
        evidence={which: float(f"{value:.4g}") for which, value in evidence.items()},
        sampled=drawn,
        sensitivity=shares,
        cross_validation=crossed,
    )


def _metadata(base: Version, task: Problem, summary: CalibrationSummary, message: str) -> dict[str, str]:
    """What the commit carries beside its rows: of the fit it starts from, and of the calibration."""
    named = ("campaign", "facility", "provenance", "frame", "inputs", *_FIT)
    return {k: v for k, v in base.metadata.items() if k in named} | {
        "parent": str(base.number),
        "trained": json.dumps(list(dict.fromkeys(c.key[0] for c in task.channels))),
        "calibration": json.dumps(summary.to_dict()),
        "message": message,
    }
