"""`ident validate`: fly a case from the database and hold it against its references."""

from __future__ import annotations

import logging
import os
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ident.deprecation import gathered
from ident.metrics.measure import measured
from ident.metrics.metric import Metrics
from ident.options import Conditions, OwnReference
from ident.validation.boats import Boat, Fleet
from ident.validation.coverage import outside_tables
from ident.validation.other_boat import check_answers, for_boat, saturated
from ident.validation.reference_limits import check_records, check_records_of_flight
from ident.validation.reference_pairs import check_pairs, units_by_flight
from ident.validation.references import beyond_the_run, check_reference, compared
from ident.validation.result import ChannelError, Validation
from ident.validation.sweep import with_grid
from ident.validation.trial_reference import DRIVEN, TRIAL, Referenced, referenced, smoothed, with_trial
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.files.record import Record
from sim.files.schema import FrameData
from sim.flight.case import Case, load_case
from sim.flight.reference import Reference
from sim.flight.reference_table import is_series
from sim.flight.series import Series, read_series
from sim.flight.simulate import fly
from sim.flight.simulation import CHANNELS, Simulation

Array = NDArray[np.float64]
_log = logging.getLogger(__name__)
_FRAMES = {
    "source": FrameData(x="aft", y="starboard", z="up"),
    "program": FrameData(x="forward", y="starboard", z="down"),
}


def rmse(simulation: Simulation, channel: str, record: Record, abscissa: str = "t") -> float:
    """Root mean square difference at the reference's own times or path lengths, in its unit."""
    value, unit, _ = record.shown
    flown = simulation[channel]
    flown = np.degrees(flown) if unit.startswith("deg") else flown
    return float(np.sqrt(np.mean((np.interp(record.abscissa, simulation[abscissa], flown) - value) ** 2)))


def _published(published: dict[str, Record], channel: str, unit: str) -> tuple[Array, Array]:
    """Abscissa and value of the published model in the reference's unit."""
    return published[channel].abscissa, published[channel].in_unit(unit).value


def _error(
    simulation: Simulation, reference: Series, source: str, channel: str, published: dict[str, Record]
) -> ChannelError:
    """Comparison of one channel with one source, as far as both go.

    Raises
    ------
    InputError
        As ``compared``.
    """
    record = reference[source][channel]
    along, (value, unit, _) = record.abscissa, record.shown
    flown = compared(along, simulation, reference.abscissa, f"reference {source} {channel}")
    error = rmse(simulation, channel, record.kept(flown), reference.abscissa)
    scatter = record.kept(flown).rms_sigma
    other = _published_rmse(along, value, flown, _published(published, channel, unit)) if channel in published else None
    return ChannelError(error, unit, int(flown.sum()), other, error / other if other else None, scatter)


def _published_rmse(
    along: Array, value: Array, flown: NDArray[np.bool_], published: tuple[Array, Array]
) -> float | None:
    """Root mean square difference of the published model where it and the reference go; None where they do not."""
    other_along, other = published
    both = flown & (along >= other_along[0]) & (along <= other_along[-1])
    if not both.any():
        return None
    gap = np.interp(along[both], other_along, other) - value[both]
    return float(np.sqrt(np.mean(gap**2)))


def flights(case: Case, boat: Boat) -> tuple[Simulation, dict[str, Simulation]]:
    """A case flown, and flown from the start of each source's record that has one of its own.

    Raises
    ------
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    model, water = boat.model(case), boat.water(case)
    started = {s: case.started_as(s) for s in (case.reference.compare if case.reference else [])}
    as_started = {s: fly(c, boat.vehicle, model, water) for s, c in started.items() if c is not None}
    return fly(case, boat.vehicle, model, water), as_started


def errors(
    case: Case, reference: Series, simulation: Simulation, as_started: dict[str, Simulation]
) -> dict[str, dict[str, ChannelError]]:
    """Errors by source and channel.

    Parameters
    ----------
    case, reference : What was flown, and what it is held against.
    simulation, as_started : From ``flights``.

    Raises
    ------
    InputError
        As ``compared``.
    """
    by_source: dict[str, dict[str, ChannelError]] = {}
    if case.reference is None:
        return by_source
    published = reference[case.reference.published_model or ""]
    flown = {source: as_started.get(source, simulation) for source in case.reference.compare}
    if DRIVEN in as_started:
        flown[DRIVEN] = as_started[DRIVEN]
    for label, flight in flown.items():
        source = TRIAL if label == DRIVEN else label
        by_source[label] = {
            channel: _error(flight, reference, source, channel, published)
            for channel in case.reference.channels
            if channel in reference[source]
        }
    return by_source


def _passed(case: Case, by_source: dict[str, dict[str, ChannelError]]) -> bool:
    """Whether every tolerance holds; each is looked at, also after one that does not."""
    held = True
    for tolerance in case.tolerance:
        entry = by_source.get(tolerance.source, {}).get(tolerance.channel)
        if entry is None or entry.unit != tolerance.unit:
            raise InputError(
                f"case {case.name}, tolerance on {tolerance.source} {tolerance.channel} [{tolerance.unit}]",
                "no such reference channel in that unit",
                "a source, channel and unit of the reference file",
            )
        held = held and entry.rmse <= tolerance.rmse
    return held


def _check_tolerances(case: Case, reference: Series) -> None:
    """Refuse a tolerance on a channel or in a unit that the reference does not have, before anything is flown.

    Raises
    ------
    InputError
        Naming the tolerance, and the channels with their units that there are.
    """
    compare = case.reference.compare if case.reference else []
    channels = case.reference.channels if case.reference else []
    units = {(s, c): reference[s][c].shown[1] for s in compare for c in channels if c in reference[s]}
    for one in case.tolerance:
        source = TRIAL if one.source == DRIVEN else one.source
        if units.get((source, one.channel)) != one.unit:
            raise InputError(
                f"case {case.name}, tolerance on {one.source} {one.channel}",
                f"[{one.unit}]: no such reference channel in that unit",
                ", ".join(f"{s} {c} [{u}]" for (s, c), u in units.items()) or "a reference to compare with",
            )


def _with_reference(case: Case, record: OwnReference) -> Referenced:
    """A case held against a user's own record, every channel that the simulation has.

    Raises
    ------
    InputError
        For a file that cannot be read or holds nothing to compare.
    """
    path, frame, trial = Path(record.path), record.frame, record.trial
    if frame not in (None, *_FRAMES):
        raise InputError(f"reference {path}, frame", repr(frame), " or ".join(_FRAMES))
    declared = case.reference.frame if case.reference and not frame else _FRAMES[frame or "program"]
    if not path.is_file():
        raise InputError(str(path), "no such file", "a CSV file: source, channel, t or s, value, unit")
    if trial is not None or not is_series(path):
        from ident.trials.spec import load_spec

        spec = load_spec(Path(trial) if trial else None)
        case = case.model_copy(update={"tolerance": [], "published": []})
        return with_trial(case, path, spec.model_copy(update={"frame": _FRAMES[frame]}) if frame else spec, False)
    header = path.read_bytes().partition(b"\n")[0].strip().split(b",")
    abscissa: Literal["t", "s"] = "s" if b"s" in header and b"t" not in header else "t"
    series = read_series(path, abscissa, declared.declared(f"case {case.name}, key reference.frame"))
    model = case.reference.published_model if case.reference else None
    compare = [s for s in series.data if s != model]
    channels = [c for c in CHANNELS if any(c in series[s] for s in compare)]
    if not channels:
        present = ", ".join(sorted({c for s in series.data.values() for c in s})) or "no row"
        raise InputError(f"{path}, column channel", present, ", ".join(CHANNELS))
    reference = Reference(
        file=str(path),
        published_model=model if model in series.data else None,
        compare=compare,
        channels=channels,
        abscissa=abscissa,
        frame=declared,
        initial={k: v for k, v in (case.reference.initial if case.reference else {}).items() if k in compare},
    )
    return Referenced(case.model_copy(update={"reference": reference, "tolerance": []}), series)


@gathered(
    "0.2",
    {"conditions": Conditions, "reference": OwnReference},
    speed=("conditions", "speed_mps", None),
    depth=("conditions", "depth_m", None),
    angle=("conditions", "angle_deg", None),
    frame="reference",
    trial="reference",
)
def validate(
    case: str | os.PathLike[str],
    db: str | os.PathLike[str] = "coeff_db",
    version: int | None = None,
    *,
    vehicle: str | os.PathLike[str] | None = None,
    reference: str | os.PathLike[str] | OwnReference | None = None,
    conditions: Conditions = Conditions(),  # noqa: B008  (frozen)
    without: Collection[str] = (),
) -> Validation:
    """Fly a case from a database version and hold it against its references.

    Parameters
    ----------
    case : Bundled case or path to a case file.
    db, version : Folder or URL of the database, and version, latest when None.
    vehicle : Bundled vehicle or path to a vehicle file, instead of the case's.
    reference : Your own record instead of the case's, or its path alone.
    conditions : Speed, depth and plane angle instead of the case's; references then do not apply.
    without : Terms such as ``N_ur`` and estimates such as ``cross_flow`` that the version is flown without.

    Returns
    -------
    Validation

    Raises
    ------
    InputError
        For a case, vehicle, reference, database or version that does not exist or fit.
    NoEquilibrium
        When the case starts from self-propulsion and there is none.

    Examples
    --------
    >>> import ident
    >>> done = ident.validate("my-boat/zigzag.toml", db="coeff_db", version=0)
    >>> sorted(done.errors["TRIAL"])
    ['psi', 'r', 'u']
    """
    held = _held_against(case, vehicle, conditions, reference)
    return _validated(held, Fleet(os.fspath(db), version, without))


def validated(
    case: str | os.PathLike[str],
    fleet: Fleet,
    *,
    vehicle: str | os.PathLike[str] | None = None,
    reference: str | os.PathLike[str] | OwnReference | None = None,
) -> Validation:
    """``validate`` from a database version that several cases are flown from."""
    return _validated(_held_against(case, vehicle, Conditions(), reference), fleet)


def _validated(as_held: tuple[Referenced, Vehicle, str, list[str]], fleet: Fleet) -> Validation:
    held, ship, where, notes = as_held
    flown, boat = held.case, fleet.boat(ship)
    simulation, as_started = _every_flight(held, boat, where)
    channel_errors = errors(flown, held.series, simulation, as_started)
    measures = measured(flown, simulation, held.series, as_started)
    _check_numbers(measures.metrics, where)
    model = boat.model(flown)
    grid, metrics = with_grid(flown, ship, model, measures.metrics)
    outside, constant = outside_tables(simulation, boat.coefficients, model)
    met = _passed(flown, channel_errors) and _published_met(flown, metrics)
    ended = {"ends_s": float(simulation.end[0]), "records": len(simulation.record)}
    _log.info("case flown", extra={"case": flown.name, "vehicle": ship.name, "version": boat.commit.number} | ended)
    return Validation(
        case=flown,
        simulation=simulation,
        reference=held.series,
        boat=boat,
        db=fleet.db,
        errors=channel_errors,
        metrics={name: replace(m, sigma=held.sigma.get(name, {})) for name, m in metrics.items()},
        as_started=as_started,
        outside_tables=outside,
        constant_axes=constant,
        curve=measures.curve,
        grid=grid,
        in_waves=measures.in_waves,
        passed=bool(np.isfinite(simulation.end).all() and met),
        saturated=saturated(simulation, flown, ship),
        notes=[
            *notes,
            *beyond_the_run(flown, held.series, simulation, as_started),
            *units_by_flight(flown, held.series, simulation, as_started),
        ],
    )


def _held_against(
    case: str | os.PathLike[str],
    vehicle: str | os.PathLike[str] | None,
    conditions: Conditions,
    reference: str | os.PathLike[str] | OwnReference | None,
) -> tuple[Referenced, Vehicle, str, list[str]]:
    """The case with its references as it is to be flown, by which vehicle, the case's place, and notes."""
    flown, where = load_case(os.fspath(case))
    ship = load_vehicle(os.fspath(vehicle)) if vehicle is not None else load_vehicle(flown.vehicle, beside=where)
    flown, notes = for_boat(flown, where, ship, conditions)
    check_records_of_flight(flown, ship, where)
    if reference is not None:
        stated = reference if isinstance(reference, OwnReference) else OwnReference(reference)
        held = _with_reference(flown, stated)
    else:
        held = referenced(flown, where)
    unknown = check_reference(held.case, held.series, where)
    file = held.case.reference.file if held.case.reference and held.case.reference.file else where
    unknown += check_records(held.case, held.series, ship, file)
    unknown += check_pairs(held.case, held.series, ship, file)
    if reference is not None and not held.series.smooth:
        smoothed(held.series, file)
    _check_tolerances(held.case, held.series)
    return held, ship, where, [*notes, *held.notes, *unknown]


def _every_flight(held: Referenced, boat: Boat, where: str) -> tuple[Simulation, dict[str, Simulation]]:
    """The case flown, and flown as each source starts and as a trial was driven; each of two records or more."""
    simulation, as_started = flights(held.case, boat)
    if held.driven is not None:
        as_started[DRIVEN] = fly(held.driven, boat.vehicle, boat.model(held.driven), boat.water(held.driven))
    for one in (simulation, *as_started.values()):
        if len(one["t"]) < 2:
            ended = f"the run ends at {one.end[0]:.3f} s, before a second record"
            raise InputError(f"{where}, key run", ended, "a run of two records or more; events that happen later")
    check_answers(simulation, held.case, boat.vehicle)
    return simulation, as_started


def _check_numbers(metrics: Metrics, where: str) -> None:
    """Refuse metrics that are no numbers. Raises ``InputError`` naming the first."""
    for name, metric in metrics.items():
        for value in metric.values():
            if value is not None and not np.isfinite(value):
                text = f"metric {name} is {value}"
                raise InputError(where, text, "a maneuver that the metrics of its kind are defined for")


def _published_met(case: Case, metrics: Metrics) -> bool:
    """Whether every published value with a tolerance is met."""
    for value in case.published:
        if value.tolerance is None:
            continue
        simulated = metrics[value.metric].simulated if value.metric in metrics else None
        if simulated is None or abs(simulated - value.value) > value.tolerance * abs(value.value):
            return False
    return True
