"""`ident calibrate`: multipliers of coefficient groups from free-running maneuvers.

Maximum a posteriori by least squares. A series k (case, source, channel) with residual r_k
adds ``n_k mean(r_k^2) / sigma_k^2``; n_k is the number of independent pieces the record
holds (crossings of its mean, plus one), shared among the channels of one motion (heading,
yaw rate and track are one motion), and::

    sigma_k^2 = s_c^2 + reading_k^2 + d_k^2

with the reading error of the record, its share d_k of the difference to another source of the
same case, and the discrepancy s_c between model and reality: one for each case and
channel, shared by its sources, estimated by maximum likelihood in turn with the multipliers.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.calibration.file import CalibrationFile, Parameter, Training, apply
from ident.validation.references import check_reference
from ident.validation.trial_reference import TRIAL, Referenced, referenced
from sim.boat.coefficients import Coefficients
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.files.record import Record
from sim.flight.case import Case, load_case
from sim.flight.craft import Craft
from sim.flight.series import Series
from sim.flight.simulate import Simulation, equipped, fly
from sim.flight.trim import NoEquilibrium

Array = NDArray[np.float64]
Key = tuple[str, str, str]

# Relative to the prior's sigma: step of the differences, and when the multipliers are found.
_STEP = 0.05
_CLOSE = 0.01
_ROUNDS = 12
_INNER = 6
# A flight that ends early is this many times the record's size away from it.
_LOST = 10.0
# Channels that follow from one another: what one says of a source, the others say again.
_MOTIONS = (
    ("psi", "r", "y", "x"),
    ("theta", "q", "z", "D0", "dz_over_L0", "w"),
    ("phi", "p"),
    ("u", "U", "u_over_U0", "n"),
)
# Residual samples of a series; enough for the fastest oscillation of a maneuver.
_SAMPLES = 240
# Sources that differ by this many of their reading errors contradict one another.
_FAR = 3.0


@dataclass(frozen=True)
class Channel:
    """One training series, resampled evenly.

    Attributes
    ----------
    key : Case, source, channel.
    along, value : Abscissa [s or m] and reference values in its unit.
    degrees : True when the unit is in degrees.
    reading : Standard error of reading.
    against : Its share of the root mean square difference to another source, or zero.
    pieces : Independent pieces of the record.
    """

    key: Key
    along: Array
    value: Array
    degrees: bool
    reading: float
    against: float
    pieces: float

    def residual(self, flown: Simulation, abscissa: str) -> Array:
        """Simulation less reference, (samples,)."""
        channel = flown[self.key[2]]
        value = np.degrees(channel) if self.degrees else channel
        at = flown[abscissa]
        gap = np.interp(self.along, at, value) - self.value
        size = float(np.abs(self.value).max())
        # A large number that grows with what is missing keeps the search going back.
        beyond = np.clip(self.along - at[-1], 0.0, None) / max(float(self.along[-1]), 1e-9)
        return np.where(beyond > 1e-3, _LOST * size * (1.0 + beyond), gap)


@dataclass(frozen=True)
class Problem:
    """Everything the objective needs.

    Attributes
    ----------
    vehicle, rows : The captive version.
    chosen : Groups with priors.
    cases : Case name -> (case, abscissa).
    channels : Training series.
    craft : What flights have in common whatever the multipliers.
    """

    vehicle: Vehicle
    rows: pd.DataFrame
    chosen: list[Parameter]
    cases: dict[str, tuple[Case, str]]
    channels: list[Channel]
    craft: Craft

    def without(self, dropped: Callable[[Channel], bool]) -> Problem:
        """The same problem with some of the series left out."""
        kept = [c for c in self.channels if not dropped(c)]
        cases = {name: pair for name, pair in self.cases.items() if any(c.key[0] == name for c in kept)}
        return replace(self, cases=cases, channels=kept)

    def residuals(self, theta: Array) -> list[Array]:
        """Residuals of every series at multipliers ``theta``, in the references' units."""
        values = apply(self.rows["value"].to_numpy(), self.chosen, theta)
        flown: dict[str, Simulation | None] = {}
        for name, (case, _) in self.cases.items():
            model = equipped(case, self.vehicle, self.craft.assembly(case).model(values))
            try:
                flown[name] = fly(case, self.vehicle, model, self.craft.water(case))
            except NoEquilibrium:
                flown[name] = None
        found = []
        for channel in self.channels:
            one = flown[channel.key[0]]
            if one is None:
                found.append(np.full(channel.along.size, _LOST * float(np.abs(channel.value).max())))
            else:
                found.append(channel.residual(one, self.cases[channel.key[0]][1]))
        return found


@dataclass(frozen=True)
class Estimate:
    """A calibrated set of multipliers.

    Attributes
    ----------
    theta, covariance : (k,) and (k, k), posterior.
    information : (k, k) of the data alone, without priors.
    rms : Series -> root mean square residual.
    sigma : Series -> sigma_k used.
    converged : False when the rounds ran out.
    """

    theta: Array
    covariance: Array
    information: Array
    rms: dict[Key, float]
    sigma: dict[Key, float]
    converged: bool
    rounds: int = field(default=0)

    @property
    def deviation(self) -> Array:
        """(k,) posterior standard deviations."""
        return np.sqrt(np.diag(self.covariance))


def pieces(value: Array) -> int:
    """Independent pieces a record holds: crossings of its mean, plus one, at least two."""
    centred = value - value.mean()
    return max(2, 1 + int(np.count_nonzero(centred[:-1] * centred[1:] < 0.0)))


def _sharing(channel: str, used: Sequence[str]) -> int:
    """How many of a source's channels describe the motion of this one."""
    motion = next((m for m in _MOTIONS if channel in m), (channel,))
    return sum(other in motion for other in used)


def _gap(x: Array, y: Array, other_x: Array, other_y: Array) -> float:
    """Root mean square difference of two records where both exist."""
    at = np.linspace(max(x[0], other_x[0]), min(x[-1], other_x[-1]), _SAMPLES)
    return float(np.sqrt(np.mean((np.interp(at, x, y) - np.interp(at, other_x, other_y)) ** 2)))


def _difference(one: Record, other: Record, unit: str) -> float:
    """Root mean square difference of two records where both exist, in ``unit``."""
    return _gap(one.abscissa, one.in_unit(unit).value, other.abscissa, other.in_unit(unit).value)


def _channel(training: Training, reference: Series, name: str, channel: str, used: Sequence[str]) -> Channel:
    record = reference[training.source][channel]
    # Sources of one channel share a discrepancy, in one unit: that of the first.
    unit = next(s[channel].shown.unit for s in reference.data.values() if channel in s)
    along, (value, _, sigma) = record.abscissa, record.in_unit(unit)
    at = np.linspace(along[0], along[-1], _SAMPLES)
    against = 0.0
    if training.differs_from and channel in reference[training.differs_from]:
        gap = _difference(record, reference[training.differs_from][channel], unit)
        against = gap * training.share**0.5
    return Channel(
        key=(name, training.source, channel),
        along=at,
        value=np.interp(at, along, value),
        degrees=unit.startswith("deg"),
        reading=float(np.sqrt(np.mean(sigma**2))) if sigma is not None else 0.0,
        against=against,
        pieces=pieces(np.interp(at, along, value)) / _sharing(channel, used),
    )


def _refuse(where: str, training: Training, key: str, found: str, allowed: Sequence[str]) -> InputError:
    return InputError(f"{where}, training {training.case}, key {key}", repr(found), ", ".join(allowed))


def _flown(held: Referenced, recorded: bool) -> Case:
    """The case as it is flown: from the start that a trial measured, with its controls where the case says so."""
    if recorded and held.driven is not None:
        return held.driven
    return held.case.started_as(TRIAL) or held.case if TRIAL in held.series.smooth else held.case


def problem(
    spec: CalibrationFile, where: str, vehicle: Vehicle, rows: pd.DataFrame, chosen: list[Parameter]
) -> Problem:
    """Load the training cases of a calibration.

    Parameters
    ----------
    spec, where : From ``load_calibration``; cases given as paths are relative to its folder.
    vehicle, rows, chosen : What is calibrated, from which version.

    Raises
    ------
    InputError
        For a case of another vehicle, or a source or channel that the reference lacks.
    """
    from pathlib import Path

    cases: dict[str, tuple[Case, str]] = {}
    channels: list[Channel] = []
    for training in spec.training:
        own = Path(where).parent / training.case
        case, place = load_case(own if training.case.endswith(".toml") else training.case)
        held = referenced(case, place)
        recorded = case.reference is not None and case.reference.controls == "recorded"
        case, reference = held.case, held.series
        check_reference(case, reference, place)
        # A case names its vehicle, or the vehicle's file.
        flown = load_vehicle(case.vehicle, beside=place).name
        if flown != vehicle.name:
            raise _refuse(where, training, "case", f"a case of {flown}", [f"a case of {vehicle.name}"])
        for key, source in (("source", training.source), ("differs_from", training.differs_from)):
            if source and source not in reference.data:
                raise _refuse(where, training, key, source, list(reference.data))
        known = [c for c in case.reference.channels if c in reference[training.source]] if case.reference else []
        used = training.channels or known
        for channel in used:
            if channel not in known:
                raise _refuse(where, training, "channels", channel, known)
            channels.append(_channel(training, reference, case.name, channel, used))
        cases[case.name] = (_flown(held, recorded), reference.abscissa)
    return Problem(vehicle, rows, chosen, cases, channels, Craft(Coefficients(vehicle, rows)))


def discrepancies(channels: list[Channel], rms: Sequence[float]) -> Array:
    """sigma_k of every series: the shared discrepancy of its case and channel by maximum likelihood.

    Parameters
    ----------
    channels, rms : The series and their root mean square residuals.

    Returns
    -------
    (series,) in the units of the references.
    """
    from scipy.optimize import minimize_scalar

    own = np.array([c.reading**2 + c.against**2 for c in channels])
    square, count = np.square(rms), np.array([c.pieces for c in channels])
    out = np.zeros(len(channels))
    for shared in dict.fromkeys((c.key[0], c.key[2]) for c in channels):
        k = [i for i, c in enumerate(channels) if (c.key[0], c.key[2]) == shared]

        def loss(log_s: float, k: list[int] = k) -> float:
            variance = np.exp(2.0 * log_s) + own[k]
            return float(np.sum(count[k] * (np.log(variance) + square[k] / variance)))

        top = np.log(np.sqrt(square[k].max()) + 1e-300)
        best = minimize_scalar(loss, bounds=(top - 9.0, top + 1.0), method="bounded", options={"xatol": 1e-6})
        out[k] = np.sqrt(np.exp(2.0 * best.x) + own[k])
    return out


def _stack(task: Problem, residuals: list[Array], sigma: Array) -> Array:
    """Residuals with weight so that a series adds pieces * mean square / sigma^2."""
    return np.concatenate(
        [np.sqrt(c.pieces / r.size) / s * r for c, r, s in zip(task.channels, residuals, sigma, strict=True)]
    )


def _jacobian(task: Problem, theta: Array, sigma: Array, step: Array, workers: int) -> Array:
    """(residuals, k) central differences of the data part, columns in parallel."""

    def column(i: int) -> Array:
        sides = []
        for sign in (1.0, -1.0):
            moved = theta.copy()
            moved[i] += sign * step[i]
            sides.append(_stack(task, task.residuals(moved), sigma))
        return np.asarray((sides[0] - sides[1]) / (2.0 * step[i]))

    with ThreadPoolExecutor(workers) as pool:
        return np.stack(list(pool.map(column, range(theta.size))), axis=1)


def calibrate(
    task: Problem,
    workers: int | None = None,
    each: Callable[[str], None] = lambda text: None,
    start: Array | None = None,
) -> Estimate:
    """Maximum a posteriori multipliers of a problem.

    Parameters
    ----------
    task : From ``problem``.
    workers : Threads; all cores when None. The result does not depend on it.
    each : Called with a line of text after each round.
    start : (k,) where the search begins; the prior means when None.

    Returns
    -------
    Estimate; the covariance is that of the least-squares problem at the end.
    """
    from scipy.optimize import least_squares

    mean, prior = np.array([p.mean for p in task.chosen]), np.array([p.sigma for p in task.chosen])
    threads = workers or os.cpu_count() or 1
    low = np.array([1e-6 if p.group.kind == "multiplier" else -np.inf for p in task.chosen])
    theta = (mean if start is None else start).copy()
    converged, rounds = False, 0
    sigma = np.ones(len(task.channels))
    for rounds in range(1, _ROUNDS + 1):
        rms = [float(np.sqrt(np.mean(r**2))) for r in task.residuals(theta)]
        sigma = discrepancies(task.channels, rms)

        def residual(x: Array, sigma: Array = sigma) -> Array:
            return np.concatenate([_stack(task, task.residuals(x), sigma), (x - mean) / prior])

        def jacobian(x: Array, sigma: Array = sigma) -> Array:
            data = _jacobian(task, x, sigma, _STEP * prior, threads)
            return np.concatenate([data, np.diag(1.0 / prior)])

        solved = least_squares(
            residual, theta, jac=jacobian, bounds=(low, np.inf), x_scale=prior, max_nfev=_INNER, xtol=1e-4, ftol=1e-4
        )
        moved = float(np.max(np.abs(solved.x - theta) / prior))
        theta = solved.x
        each(f"round {rounds}: cost {solved.cost:.2f}, largest move {moved:.3f} prior standard deviations")
        if moved < _CLOSE:
            converged = True
            break
    data = _jacobian(task, theta, sigma, _STEP * prior, threads)
    information = data.T @ data
    covariance = np.asarray(np.linalg.inv(information + np.diag(1.0 / prior**2)), dtype=np.float64)
    final = [float(np.sqrt(np.mean(r**2))) for r in task.residuals(theta)]
    keys = [c.key for c in task.channels]
    return Estimate(
        np.asarray(theta, dtype=np.float64),
        covariance,
        information,
        dict(zip(keys, final, strict=True)),
        dict(zip(keys, [float(s) for s in sigma], strict=True)),
        converged,
        rounds,
    )


def contradictions(task: Problem) -> list[str]:
    """Sources of one case and channel that differ by more than their stated errors allow."""
    said = []
    for i, one in enumerate(task.channels):
        for other in task.channels[:i]:
            if (one.key[0], one.key[2]) != (other.key[0], other.key[2]):
                continue
            rms = _gap(one.along, one.value, other.along, other.value)
            stated = float(np.hypot(one.reading, other.reading))
            if rms > _FAR * max(stated, 1e-12 * float(np.abs(one.value).max())):
                text = f"{other.key[1]} and {one.key[1]} of {one.key[0]} differ in {one.key[2]} by {rms:.3g}"
                said.append(f"contradictory data: {text}, {rms / max(stated, 1e-12):.0f} times their reading errors")
    return said
