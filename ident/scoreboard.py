"""`ident validate --all`: every case, every reference, one table."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.validate import Validation, validate
from sim.case import load_case
from sim.database import find_version, own_version, read_rows
from sim.errors import InputError
from sim.trim import NoEquilibrium
from sim.vehicle import bundled, load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console


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


def _trained(db: str, name: str, number: int) -> list[str]:
    """Names of the cases that the coefficients of a case's vehicle were trained on."""
    case, where = load_case(name)
    vehicle = load_vehicle(case.vehicle, beside=where)
    return list(json.loads(own_version(db, vehicle.name, number).metadata.get("trained", "[]")))


def _mean_ratio(cases: list[dict[str, Any]]) -> float | None:
    ratios = [
        entry["ratio"]
        for case in cases
        for channels in case["references"].values()
        for entry in channels.values()
        if entry["ratio"]
    ]
    return math.exp(sum(math.log(r) for r in ratios) / len(ratios)) if ratios else None


def run_all(
    db: str, version: int | None, folder: Path | None, each: Callable[[str], None] = lambda name: None
) -> tuple[dict[str, Any], list[Validation]]:
    """Fly every case from one version; bundled cases only of vehicles it holds.

    Parameters
    ----------
    db, version : Database and version, latest when None.
    folder : Users' own cases beside the bundled ones.
    each : Called with the name of each case before it is flown.

    Returns
    -------
    board : ``database``, ``cases`` (the single-case objects, each with ``trained``),
        ``geometric_mean_ratio`` of the error ratios to the published model over cases the
        version was trained on and not; None where there is none.
    flown : The validations, in the order of the cases; a case that starts from a
        self-propulsion state that does not exist is not among them, and ``failed`` on the board.

    Raises
    ------
    InputError
        As ``ident.validate.validate``.
    """
    record = find_version(db, version)
    present = {str(v) for v in read_rows(db, record.number)[0]["vehicle"].unique()}
    names = _flyable(case_names(folder), present)
    flown, cases = [], []
    for name in names:
        each(name)
        trained = _trained(db, name, record.number)
        try:
            done = validate(name, db, record.number)
        except NoEquilibrium as error:
            nothing: dict[str, Any] = {"references": {}, "metrics": {}, "outside_tables": [], "passed": False}
            database = {"path": db, "version": record.number, "digest": record.digest}
            case = load_case(name)[0].name
            cases.append(
                {"case": case, "database": database, **nothing, "failed": str(error), "trained": case in trained}
            )
            continue
        flown.append(done)
        cases.append({**done.result, "trained": done.case.name in trained})
    board = {
        "database": {"path": db, "version": record.number, "digest": record.digest},
        "cases": cases,
        "geometric_mean_ratio": {
            "trained": _mean_ratio([c for c in cases if c["trained"]]),
            "untrained": _mean_ratio([c for c in cases if not c["trained"]]),
        },
    }
    return board, flown


def show(board: dict[str, Any], console: Console) -> None:
    """Print the scoreboard as a table."""
    from rich.table import Table

    database = board["database"]
    table = Table(
        *("case", "reference", "channel", "RMSE", "published model", "ratio", "unit", "trained"),
        title=f"Scoreboard, database version {database['version']} ({database['digest'][:16]})",
    )
    for case in board["cases"]:
        for source, channels in case["references"].items():
            for channel, e in channels.items():
                published = "-" if e["published_model_rmse"] is None else f"{e['published_model_rmse']:.4g}"
                ratio = "-" if e["ratio"] is None else f"[{'green' if e['ratio'] <= 1 else 'red'}]{e['ratio']:.2f}[/]"
                used = "yes" if case["trained"] else "no"
                table.add_row(case["case"], source, channel, f"{e['rmse']:.4g}", published, ratio, e["unit"], used)
    console.print(table)
    for case in board["cases"]:
        if "failed" in case:
            console.print(f"[red]{case['case']} not flown: {case['failed']}[/]", highlight=False)
    for kind, value in board["geometric_mean_ratio"].items():
        shown = "no case" if value is None else f"{value:.2f}"
        console.print(f"geometric mean of the ratios, {kind} cases: {shown}", highlight=False)
