"""What a calibration is held against: training series with their weights, and the flights that answer to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.calibration.file import CalibrationFile, Parameter, Training, apply
from ident.validation.reference_limits import check_records
from ident.validation.reference_pairs import check_pairs
from ident.validation.references import check_reference
from ident.validation.trial_reference import TRIAL, Referenced, referenced
from sim.boat.coefficients import Coefficients
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.files.record import Record
from sim.flight.case import Case, load_case
from sim.flight.craft import Craft
from sim.flight.series import Series
from sim.flight.simulate import equipped, fly
from sim.flight.simulation import Simulation
from sim.flight.trim import NoEquilibrium

Array = NDArray[np.float64]
Key = tuple[str, str, str]

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
    chosen : Groups whose multipliers are free.
    cases : Case name -> (case, abscissa).
    channels : Training series.
    craft : What flights have in common whatever the multipliers.
    held : Groups that stay at their prior means.
    """

    vehicle: Vehicle
    rows: pd.DataFrame
    chosen: list[Parameter]
    cases: dict[str, tuple[Case, str]]
    channels: list[Channel]
    craft: Craft
    held: tuple[Parameter, ...] = ()

    @property
    def mean(self) -> Array:
        """(k,) prior means."""
        return np.array([p.mean for p in self.chosen])

    @property
    def prior(self) -> Array:
        """(k,) prior standard deviations."""
        return np.array([p.sigma for p in self.chosen])

    @property
    def least(self) -> Array:
        """(k,) least values: no multiplier turns a load around."""
        return np.array([1e-6 if p.group.kind == "multiplier" else -np.inf for p in self.chosen])

    def freeing(self, kept: Sequence[int]) -> Problem:
        """The same problem with some of the groups free and the others held at their prior means."""
        rest = [p for i, p in enumerate(self.chosen) if i not in kept]
        return replace(self, chosen=[self.chosen[i] for i in kept], held=(*self.held, *rest))

    def without(self, dropped: Callable[[Channel], bool]) -> Problem:
        """The same problem with some of the series left out."""
        kept = [c for c in self.channels if not dropped(c)]
        cases = {name: pair for name, pair in self.cases.items() if any(c.key[0] == name for c in kept)}
        return replace(self, cases=cases, channels=kept)

    def residuals(self, theta: Array) -> list[Array]:
        """Residuals of every series at multipliers ``theta``, in the references' units."""
        means = [p.mean for p in self.held]
        values = apply(self.rows["value"].to_numpy(), [*self.chosen, *self.held], np.concatenate([theta, means]))
        flown: dict[str, Simulation | None] = {}
        for name, (case, _) in self.cases.items():
            model = equipped(case, self.vehicle, self.craft.assembly(case).model(values))
            try:
                flown[name] = fly(case, self.vehicle, model, self.craft.water(case))
            except NoEquilibrium:
                flown[name] = None
        every = []
        for channel in self.channels:
            one = flown[channel.key[0]]
            if one is None:
                every.append(np.full(channel.along.size, _LOST * float(np.abs(channel.value).max())))
            else:
                every.append(channel.residual(one, self.cases[channel.key[0]][1]))
        return every

    def rms(self, theta: Array) -> dict[Key, float]:
        """Root mean square residual of every series at multipliers ``theta``, in the references' units."""
        found = zip(self.channels, self.residuals(theta), strict=True)
        return {c.key: float(np.sqrt(np.mean(r**2))) for c, r in found}


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


def _refuse(where: str, training: Training, key: str, given: str, allowed: Sequence[str]) -> InputError:
    return InputError(f"{where}, training {training.case}, key {key}", repr(given), ", ".join(allowed))


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
    cases: dict[str, tuple[Case, str]] = {}
    channels: list[Channel] = []
    for training in spec.training:
        beside = Path(where).parent / training.case
        case, place = load_case(beside if training.case.endswith(".toml") else training.case)
        held = referenced(case, place)
        recorded = case.reference is not None and case.reference.controls == "recorded"
        case, reference = held.case, held.series
        check_reference(case, reference, place)
        check_records(case, reference, vehicle, place)
        check_pairs(case, reference, vehicle, place)
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
