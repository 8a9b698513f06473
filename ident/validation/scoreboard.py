"""`ident validate --all`: every case of a version flown, and every error beside those of other versions."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ident.output import Tell, silent
from ident.validation.board import BoardCase, ComparedError, Parent, Scoreboard
from ident.validation.boats import Boat, Fleet
from ident.validation.case_folder import in_folder
from ident.validation.result import ChannelError, Validation
from ident.validation.validate import errors, flights, validated
from sim.boat.catalogue import CatalogueError
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.files.toml_files import bundled
from sim.flight.case import load_case
from sim.flight.trim import NoEquilibrium


def case_names(cases: str | os.PathLike[str] | Iterable[str | os.PathLike[str]] | None) -> list[str]:
    """Bundled cases, and a user's own: those of a folder, or the files named.

    Raises
    ------
    InputError
        When the folder does not exist or holds no case file.
    """
    names = bundled("cases")
    if cases is None:
        return names
    if not isinstance(cases, str | os.PathLike):
        return names + [os.fspath(one) for one in cases]
    return names + in_folder(Path(cases))[0]


def _passed_over(cases: str | os.PathLike[str] | Iterable[str | os.PathLike[str]] | None) -> dict[str, str]:
    """Files of a folder of cases that are none, and what they are."""
    return in_folder(Path(cases))[1] if isinstance(cases, str | os.PathLike) else {}


def _flyable(names: list[str], present: set[str]) -> list[str]:
    """Without the bundled cases of vehicles the database does not hold."""
    ours = bundled("cases")
    flyable = [name for name in names if name not in ours or load_case(name)[0].vehicle in present]
    if not flyable:
        raise InputError(f"vehicles {', '.join(sorted(present))}", "no case of them", "a folder of cases: --cases DIR")
    return flyable


def trained_on(boat: Boat) -> list[str]:
    """What a vehicle's coefficients were trained on: names of cases, or case:source."""
    return boat.commit.trained


def is_trained(case: str, trained: list[str]) -> bool:
    """Whether a case, or any source of it, is among the training cases."""
    return any(entry == case or entry.startswith(f"{case}:") for entry in trained)


def _errors_of(done: Validation, boat: Boat | None) -> dict[str, dict[str, ChannelError]]:
    """Errors of another version of the boat in the same case; none where it does not come to the reference."""
    if boat is None or not done.errors:
        return {}
    try:
        return errors(done.case, done.reference, *flights(done.case, boat))
    except (NoEquilibrium, InputError, CatalogueError):
        return {}


def _rmse(by_source: dict[str, dict[str, ChannelError]], source: str, channel: str) -> float | None:
    against = by_source.get(source, {}).get(channel)
    return against.rmse if against else None


def _beside_other_versions(done: Validation, fleet: Fleet, trained: bool) -> BoardCase:
    """A flown case with the errors of the parent version and of the runs alone beside each error of this one."""
    parent = fleet.parent(done.boat.vehicle)
    of_parent, of_runs = _errors_of(done, parent), _errors_of(done, fleet.measured(done.boat.vehicle))
    compared = {
        source: {
            channel: ComparedError(error, _rmse(of_parent, source, channel), _rmse(of_runs, source, channel))
            for channel, error in channels.items()
        }
        for source, channels in done.errors.items()
    }
    return BoardCase(
        name=done.case.name,
        database=done.database,
        trained=trained,
        parent=Parent(parent.commit.number, parent.commit.digest) if parent else None,
        errors=compared,
        validation=done,
    )


def _vehicle_of(name: str) -> Vehicle:
    case, where = load_case(name)
    return load_vehicle(case.vehicle, beside=where)


def _one(name: str, fleet: Fleet) -> BoardCase:
    """A case flown, or why it was not."""
    boat = fleet.boat(_vehicle_of(name))
    try:
        done = validated(name, fleet)
    except NoEquilibrium as error:
        case = load_case(name)[0].name
        database = boat.commit.origin(fleet.db)
        return BoardCase(case, database, is_trained(case, trained_on(boat)), failed=str(error))
    return _beside_other_versions(done, fleet, is_trained(done.case.name, trained_on(boat)))


def scoreboard(
    db: str | os.PathLike[str] = "coeff_db",
    version: int | None = None,
    *,
    cases: str | os.PathLike[str] | Iterable[str | os.PathLike[str]] | None = None,
    without: Collection[str] = (),
    workers: int | None = None,
    tell: Tell = silent,
) -> Scoreboard:
    """Fly every case from one version; bundled cases only of vehicles it holds.

    Parameters
    ----------
    db, version : Folder or URL of the database, and version, latest when None.
    cases : Folder of users' own cases beside the bundled ones, or their files. Vehicle, campaign, calibration and
        geometry files of the folder are passed over by name.
    without : Terms and estimates that the version is flown without.
    workers : Threads; all cores when None. The result does not depend on it.
    tell : Called with the name of each case before it is flown, its place and how many there are.

    Returns
    -------
    Scoreboard

    Raises
    ------
    InputError
        For a database, version or case that does not exist or fit.

    Examples
    --------
    >>> import ident
    >>> board = ident.scoreboard(db="coeff_db", cases=["my-boat/zigzag.toml"])
    >>> board.cases[0].errors["TRIAL"]["psi"].error.unit
    'deg'
    """
    fleet = Fleet(os.fspath(db), version, without)
    names = _flyable(case_names(cases), fleet.vehicles)

    def one(place: int, name: str) -> BoardCase:
        tell(name, place, len(names))
        return _one(name, fleet)

    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        flown = tuple(pool.map(one, range(len(names)), names))
    boats = {vehicle.name: fleet.boat(vehicle) for vehicle in map(_vehicle_of, names)}
    return Scoreboard(
        database=fleet.record.origin(fleet.db),
        cases=flown,
        trained_on={name: trained_on(boat) for name, boat in boats.items()},
        passed_over=_passed_over(cases),
    )
