"""`ident validate --all`: every case, every reference, one table."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.text import on_screen
from ident.validation.boats import Boat, Fleet
from ident.validation.result import ChannelError, Validation
from ident.validation.validate import errors, flights, validate
from sim.boat.catalogue import CatalogueError
from sim.boat.database import version_words
from sim.boat.vehicle import Vehicle, load_vehicle
from sim.files.errors import InputError
from sim.files.toml_files import bundled
from sim.flight.case import load_case
from sim.flight.trim import NoEquilibrium

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console
    from rich.table import Table

KINDS = ("trained", "untrained")
# Metrics of a case without reference that are printed; the JSON has them all.
_METRICS = 4


def case_names(folder: Path | None) -> list[str]:
    """Bundled cases, and the case files of a user's folder.

    Raises
    ------
    InputError
        When the folder does not exist or holds no case file.
    """
    names = bundled("cases")
    if folder is None:
        return names
    found = sorted(str(p) for p in folder.glob("*.toml")) if folder.is_dir() else []
    if not found:
        raise InputError(str(folder), "no case file", "a folder with case files (*.toml)")
    return names + found


def _flyable(names: list[str], present: set[str]) -> list[str]:
    """Without the bundled cases of vehicles the database does not hold."""
    own = bundled("cases")
    found = [name for name in names if name not in own or load_case(name)[0].vehicle in present]
    if not found:
        raise InputError(f"vehicles {', '.join(sorted(present))}", "no case of them", "a folder of cases: --cases DIR")
    return found


def trained_on(boat: Boat) -> list[str]:
    """What a vehicle's coefficients were trained on: names of cases, or case:source."""
    return list(json.loads(boat.commit.metadata.get("trained", "[]")))


def is_trained(case: str, trained: list[str]) -> bool:
    """Whether a case, or any source of it, is among the training cases."""
    return any(entry == case or entry.startswith(f"{case}:") for entry in trained)


def entries(cases: list[dict[str, Any]]) -> Iterator[tuple[dict[str, Any], str, str, dict[str, Any]]]:
    """Case, source, channel and error of every comparison on a board."""
    for case in cases:
        for source, channels in case["references"].items():
            for channel, entry in channels.items():
                yield case, source, channel, entry


def geometric_mean(ratios: list[float]) -> float | None:
    """Geometric mean of positive numbers; None of none."""
    return math.exp(sum(math.log(r) for r in ratios) / len(ratios)) if ratios else None


def means(cases: list[dict[str, Any]], key: str) -> dict[str, float | None]:
    """Geometric mean of one ratio over the trained and over the untrained cases."""
    found = {}
    for kind in KINDS:
        chosen = [case for case in cases if case["trained"] == (kind == "trained")]
        found[kind] = geometric_mean([e[key] for *_, e in entries(chosen) if e[key]])
    return found


def worst(cases: list[dict[str, Any]]) -> dict[str, Any] | None:
    """The comparison with the largest ratio to the published model."""
    rated = [(e["ratio"], case["case"], source, channel) for case, source, channel, e in entries(cases) if e["ratio"]]
    return dict(zip(("ratio", "case", "source", "channel"), max(rated), strict=True)) if rated else None


def _errors_of(done: Validation, boat: Boat | None) -> dict[str, dict[str, ChannelError]]:
    """Errors of another version of the boat in the same case; none where it does not come to the reference."""
    if boat is None or not done.errors:
        return {}
    try:
        return errors(done.case, done.reference, *flights(done.case, boat))
    except (NoEquilibrium, InputError, CatalogueError):
        return {}


def _rmse(found: dict[str, dict[str, ChannelError]], source: str, channel: str) -> float | None:
    against = found.get(source, {}).get(channel)
    return against.rmse if against else None


def _with_parent(done: Validation, fleet: Fleet) -> dict[str, Any]:
    """The result with the errors of the parent version and of the runs alone beside each error of this one."""
    result = done.to_dict()
    parent = fleet.parent(done.boat.vehicle)
    flown, measured = _errors_of(done, parent), _errors_of(done, fleet.measured(done.boat.vehicle))
    for _, source, channel, entry in entries([result]):
        error = _rmse(flown, source, channel)
        entry["parent_rmse"] = error
        entry["ratio_to_parent"] = entry["rmse"] / error if error else None
        entry["measured_only_rmse"] = _rmse(measured, source, channel)
    described = {"version": parent.commit.number, "digest": parent.commit.digest} if parent else None
    return result | {"parent": described}


def three_columns(cases: list[dict[str, Any]], trained: bool) -> dict[str, float | None]:
    """Geometric mean of the error ratios to the published model: measured only, predicted, calibrated.

    Parameters
    ----------
    cases : Of a board.
    trained : Whether the version is calibrated; its parent is then the predicted one.
    """
    found = [e for *_, e in entries(cases) if e["published_model_rmse"]]
    keys = {"measured_only": "measured_only_rmse", "predicted": "parent_rmse" if trained else "rmse"}
    keys |= {"calibrated": "rmse"} if trained else {}
    ratios = {
        name: geometric_mean([e[key] / e["published_model_rmse"] for e in found if e[key]])
        for name, key in keys.items()
    }
    return {name: ratios.get(name) for name in ("measured_only", "predicted", "calibrated")}


def _vehicle_of(name: str) -> Vehicle:
    case, where = load_case(name)
    return load_vehicle(case.vehicle, beside=where)


def _one(name: str, fleet: Fleet) -> tuple[dict[str, Any], Validation | None]:
    """A case's object on the board and, when it flew, its validation."""
    boat = fleet.boat(_vehicle_of(name))
    try:
        done = validate(name, fleet.db, fleet.number, fleet=fleet)
    except NoEquilibrium as error:
        case = load_case(name)[0].name
        database = {"path": fleet.db, "version": boat.commit.number, "digest": boat.commit.digest}
        nothing: dict[str, Any] = {"references": {}, "metrics": {}, "outside_tables": [], "passed": False}
        found = {"case": case, "database": database, **nothing, "failed": str(error), "parent": None}
        return found | {"trained": is_trained(case, trained_on(boat))}, None
    return _with_parent(done, fleet) | {"trained": is_trained(done.case.name, trained_on(boat))}, done


def run_all(
    db: str,
    version: int | None,
    folder: Path | None,
    each: Callable[[str], None] = lambda name: None,
    workers: int | None = None,
    left_out: Collection[str] = (),
) -> tuple[dict[str, Any], list[Validation]]:
    """Fly every case from one version; bundled cases only of vehicles it holds.

    Parameters
    ----------
    db, version : Database and version, latest when None.
    folder : Users' own cases beside the bundled ones.
    each : Called with the name of each case before it is flown.
    workers : Threads; all cores when None. The result does not depend on it.
    left_out : Terms and estimates that the version is flown without.

    Returns
    -------
    board : ``database``; ``cases``, the single-case objects, each with ``trained``, ``parent`` and,
        in every entry of ``references``, ``parent_rmse`` and ``ratio_to_parent``;
        ``geometric_mean_ratio`` of the error ratios to the published model over cases the
        version was trained on and not, None where there is none; the same for the parent,
        ``geometric_mean_ratio_to_parent``; ``trained_on`` by vehicle; ``worst_ratio``.
    flown : The validations, in the order of the cases; a case that starts from a
        self-propulsion state that does not exist is not among them, and ``failed`` on the board.

    Raises
    ------
    InputError
        As ``ident.validation.validate.validate``.
    """
    fleet = Fleet(db, version, left_out)
    names = _flyable(case_names(folder), fleet.vehicles)

    def one(name: str) -> tuple[dict[str, Any], Validation | None]:
        each(name)
        return _one(name, fleet)

    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        found = list(pool.map(one, names))
    cases = [case for case, _ in found]
    boats = {vehicle.name: fleet.boat(vehicle) for vehicle in map(_vehicle_of, names)}
    board = {
        "database": {"path": db, "version": fleet.number, "digest": fleet.record.digest},
        "cases": cases,
        "geometric_mean_ratio": means(cases, "ratio"),
        "geometric_mean_ratio_to_parent": means(cases, "ratio_to_parent"),
        "geometric_mean_ratio_of": three_columns(cases, any(trained_on(boat) for boat in boats.values())),
        "trained_on": {name: trained_on(boat) for name, boat in boats.items()},
        "worst_ratio": worst(cases),
    }
    return board, [done for _, done in found if done is not None]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _ratio(value: float | None) -> str:
    return "-" if value is None else f"[{'green' if value <= 1 else 'red'}]{value:.2f}[/]"


def _errors_table(board: dict[str, Any]) -> Table:
    from rich.table import Table

    table = Table(
        *("case", "reference", "channel", "RMSE", "parent", "measured only", "published", "ratio", "to parent"),
        *("unit", "trained"),
        title=f"Scoreboard, {version_words(board['database'])}",
    )
    for case, source, channel, e in entries(board["cases"]):
        numbers = [_number(e[k]) for k in ("rmse", "parent_rmse", "measured_only_rmse", "published_model_rmse")]
        ratios = [_ratio(e[k]) for k in ("ratio", "ratio_to_parent")]
        names = [on_screen(name) for name in (case["case"], source, channel)]
        table.add_row(*names, *numbers, *ratios, on_screen(e["unit"]), "yes" if case["trained"] else "no")
    return table


def _metrics_table(board: dict[str, Any]) -> Table:
    """Cases that no reference stands against, and so do not count."""
    from rich.table import Table

    table = Table("case", "simulated", title="Without a reference series: flown, not counted")
    for case in board["cases"]:
        if not case["references"] and "failed" not in case:
            known = [(k, v.get("simulated")) for k, v in case["metrics"].items() if v.get("simulated") is not None]
            text = ", ".join(f"{k} {_number(v)}" for k, v in known[:_METRICS])
            more = len(known) - _METRICS
            table.add_row(
                on_screen(case["case"]), (on_screen(text) or "-") + (f", {more} more in --json" if more > 0 else "")
            )
    return table


def show(board: dict[str, Any], console: Console) -> None:
    """Print the scoreboard as tables."""
    console.print(_errors_table(board))
    without = _metrics_table(board)
    if without.row_count:
        console.print(without)
    for case in board["cases"]:
        if "failed" in case:
            console.print(f"[red]{on_screen(case['case'])} not flown: {on_screen(case['failed'])}[/]", highlight=False)
    for name, trained in board["trained_on"].items():
        console.print(on_screen(f"{name} trained on: {', '.join(trained) or 'no maneuver'}"), highlight=False)
    for kind in KINDS:
        shown, to_parent = (
            "no case" if board[key][kind] is None else f"{board[key][kind]:.2f}"
            for key in ("geometric_mean_ratio", "geometric_mean_ratio_to_parent")
        )
        text = f"geometric mean of the ratios, {kind} cases: {shown}"
        console.print(f"{text}; to the parent version: {to_parent}", highlight=False)
    at = board["worst_ratio"]
    if at:
        place = f"{at['case']} {at['source']} {at['channel']}"
        console.print(f"worst ratio: {at['ratio']:.2f} ({on_screen(place)})", highlight=False)
