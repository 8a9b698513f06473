"""`ident validate`: fly a case from the database and hold it against its references."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ident.metrics import roll_decay, zigzag
from sim.case import Case, Series, in_radians, load_case, load_reference
from sim.coefficients import Coefficient, Coefficients
from sim.database import axis_columns, own_version, read_rows
from sim.errors import InputError
from sim.forces import boat_features, plane_features
from sim.simulate import CHANNELS, Simulation, simulate
from sim.vehicle import Vehicle, load_vehicle

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

Array = NDArray[np.float64]
Features = dict[str, float]
# Samples of a record at which table coverage is looked at: enough for a share of time.
_COVERAGE_SAMPLES = 200


@dataclass(frozen=True)
class Validation:
    """One flown case with its comparison.

    Attributes
    ----------
    case, simulation, reference : What was flown and what it is held against.
    result : The JSON object of the comparison.
    constant_axes : Term -> axes along which it was measured at one value only.
    vehicle, rows : What was flown.
    """

    case: Case
    simulation: Simulation
    reference: Series
    result: dict[str, Any]
    constant_axes: dict[str, list[str]]
    vehicle: Vehicle
    rows: pd.DataFrame


def rmse(simulation: Simulation, channel: str, series: tuple[Array, Array, str]) -> float:
    """Root mean square difference at the reference's own times, in its unit."""
    time, value, unit = series
    flown = simulation[channel]
    flown = np.degrees(flown) if unit.startswith("deg") else flown
    return float(np.sqrt(np.mean((np.interp(time, simulation["t"], flown) - value) ** 2)))


def check_reference(case: Case, reference: Series, where: str) -> None:
    """Refuse sources, channels and units that cannot be compared.

    Raises
    ------
    InputError
        Naming the case file, what was found and what is allowed.
    """
    if case.reference is None:
        return
    named = {*case.reference.compare, *([case.reference.published_model] if case.reference.published_model else [])}
    for source in sorted(named - set(reference.data)):
        raise InputError(f"{where}, key reference", f"source {source!r}", f"one of {', '.join(reference.data)}")
    for channel in case.reference.channels:
        if channel not in CHANNELS:
            raise InputError(f"{where}, key reference.channels", repr(channel), ", ".join(CHANNELS))
        allowed = {CHANNELS[channel], CHANNELS[channel].replace("rad", "deg")}
        units = {reference[source][channel][2] for source in named if channel in reference[source]}
        if not units:
            raise InputError(f"{where}, key reference.channels", repr(channel), "a channel of the reference file")
        for unit in sorted(units - allowed):
            text = f"{channel} in {unit!r}"
            raise InputError(case.reference.file, text, " or ".join(sorted(allowed)))


def _errors(case: Case, simulation: Simulation, reference: Series) -> dict[str, Any]:
    if case.reference is None:
        return {}
    found: dict[str, Any] = {}
    end = float(simulation["t"][-1])
    published = reference[case.reference.published_model or ""]
    for source in case.reference.compare:
        found[source] = {}
        for channel in case.reference.channels:
            if channel not in reference[source]:
                continue
            time, value, unit = reference[source][channel]
            flown = time <= end + 1e-9
            entry: dict[str, Any] = {
                "rmse": rmse(simulation, channel, (time[flown], value[flown], unit)),
                "unit": unit,
                "n": int(flown.sum()),
                "published_model_rmse": None,
                "ratio": None,
            }
            if channel in published:
                other_time, other, other_unit = published[channel]
                if other_unit != unit:
                    other = np.degrees(other) if unit.startswith("deg") else np.radians(other)
                both = flown & (time <= other_time[-1])
                gap = np.interp(time[both], other_time, other) - value[both]
                entry["published_model_rmse"] = float(np.sqrt(np.mean(gap**2)))
                entry["ratio"] = entry["rmse"] / entry["published_model_rmse"]
            found[source][channel] = entry
    return found


def _metrics(case: Case, simulation: Simulation, reference: Series) -> dict[str, dict[str, float | None]]:
    dv, dh = case.command.dV, case.command.dH
    if case.initial.heel_deg and case.initial.state == "as_given":
        return _side_by_side(case, reference, "phi", roll_decay, (simulation["t"], simulation["phi"]))
    if "zigzag" not in (dv.law, dh.law):
        return {}
    command, angle, rate, name = (dh, "psi", "r", "yaw") if dh.law == "zigzag" else (dv, "theta", "q", "pitch")
    check, sense = math.radians(command.check_deg), 1 if command.first_deg > 0 else -1

    def measure(t: Array, x: Array, turn: tuple[Array, Array] | None) -> dict[str, float | None]:
        return zigzag(t, x, turn, check, sense, name)

    metrics = _side_by_side(
        case, reference, angle, measure, (simulation["t"], simulation[angle]), rate, (simulation["t"], simulation[rate])
    )
    for i, (time, _) in enumerate(simulation.executes[1:4]):
        metrics[f"execute_{i + 2}_s"]["simulated"] = float(time)
    return metrics


def _side_by_side(
    case: Case,
    reference: Series,
    angle: str,
    measure: Callable[..., dict[str, float | None]],
    flown: tuple[Array, Array],
    rate: str | None = None,
    flown_rate: tuple[Array, Array] | None = None,
) -> dict[str, dict[str, float | None]]:
    """Metrics of the simulated and every reference series, by metric and source."""
    columns = {"simulated": measure(*flown, flown_rate) if rate else measure(*flown)}
    sources = [*case.reference.compare, case.reference.published_model] if case.reference else []
    for source in sources:
        series = reference[source or ""]
        if angle not in series:
            continue
        time, value, unit = series[angle]
        value = in_radians(value, unit)
        turn = None
        if rate and rate in series:
            turn_time, turn_value, turn_unit = series[rate]
            turn = (turn_time, in_radians(turn_value, turn_unit))
        label = "published_model" if case.reference and source == case.reference.published_model else str(source)
        columns[label] = measure(time, value, turn) if rate else measure(time, value)
    return {k: {label: column.get(k) for label, column in columns.items()} for k in columns["simulated"]}


def _states(simulation: Simulation, coefficients: Coefficients) -> list[tuple[Features, dict[str, Features]]]:
    """Boat features, and features by plane, at evenly spread samples of a record."""
    chosen = np.unique(np.linspace(0, len(simulation.record) - 1, _COVERAGE_SAMPLES).astype(int))
    found: list[tuple[Features, dict[str, Features]]] = []
    columns = {c: simulation.record[chosen, i] for i, c in enumerate(simulation.columns)}
    wake = coefficients.get("w_T")
    factor = 1.0 - (float(wake.values[0]) if wake else 0.0)
    vehicle = coefficients.vehicle
    for i in range(len(chosen)):
        velocity = [columns[c][i] for c in "uvw"]
        rates = [columns[c][i] for c in "pqr"]
        n = columns["n"][i]
        advance = factor * velocity[0] / (n * vehicle.propeller.diameter.value) if n else 0.0
        boat = boat_features(velocity, rates, columns["z"][i] + simulation.depth_offset, n, advance)
        planes = {p.name: plane_features(p, velocity, rates, columns[p.name][i]) for p in vehicle.planes}
        found.append((boat, planes))
    return found


def _outside(simulation: Simulation, coefficients: Coefficients) -> tuple[list[dict[str, Any]], dict[str, list[str]]]:
    """Share of time each term was used beyond its data, and its one-valued axes."""
    states = _states(simulation, coefficients)
    found: list[dict[str, Any]] = []
    constant: dict[str, list[str]] = {}
    for coefficient in coefficients:
        term, table = coefficient.term, coefficient.table
        if term.is_acceleration or not term.axes:
            continue
        points = np.array(
            [[{**boat, **planes.get(coefficient.part, {})}[a] for a in term.axes] for boat, planes in states]
        )
        for k, axis in enumerate(term.axes):
            low, high = table.range(axis)
            if low == high and term.extrapolation[axis] != "absent":
                constant.setdefault(term.name, []).append(axis)
                continue
            slack = 1e-9 * max(abs(low), abs(high))
            share = float(np.mean((points[:, k] < low - slack) | (points[:, k] > high + slack)))
            if share > 0.0:
                found.append({"term": term.name, "axis": axis, "fraction_of_time": share})
        found += _combined(coefficient, points)
    return found, constant


def _combined(coefficient: Coefficient, points: Array) -> list[dict[str, Any]]:
    """Share of time at flow angles of which no run has both."""
    axes = coefficient.term.axes
    if not {"alpha", "beta"} <= set(axes) or coefficient.table.measured.all():
        return []
    varied = [a for a in ("alpha", "beta") if coefficient.table.range(a)[0] < coefficient.table.range(a)[1]]
    if len(varied) < 2:
        return []
    share = float(np.mean([coefficient.table.covered(x) < 0.5 for x in points]))
    return [{"term": coefficient.term.name, "axis": "alpha x beta", "fraction_of_time": share}] if share else []


def _passed(case: Case, errors: dict[str, Any]) -> bool:
    for tolerance in case.tolerance:
        entry = errors.get(tolerance.source, {}).get(tolerance.channel)
        if entry is None or entry["unit"] != tolerance.unit:
            raise InputError(
                f"case {case.name}, tolerance on {tolerance.source} {tolerance.channel} [{tolerance.unit}]",
                "no such reference channel in that unit",
                "a source, channel and unit of the reference file",
            )
        if not entry["rmse"] <= tolerance.rmse:
            return False
    return True


def validate(name: str, db: str, version: int | None = None) -> Validation:
    """Fly a case from a database version and compare.

    Parameters
    ----------
    name : Bundled case or path to a case file.
    db : Database path or URL.
    version : Database version, latest when None.

    Raises
    ------
    InputError
        For a case, reference, database or version that does not exist or does not fit.
    sim.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    case, where = load_case(name)
    reference = load_reference(case, where)
    check_reference(case, reference, where)
    vehicle = load_vehicle(case.vehicle, beside=where)
    rows, number = read_rows(db, version, vehicle.name)
    coefficients = Coefficients(vehicle, rows)
    simulation = simulate(case, coefficients)
    commit = own_version(db, vehicle.name, number)
    errors = _errors(case, simulation, reference)
    outside, constant = _outside(simulation, coefficients)
    complete = simulation["t"][-1] >= case.run.duration_s - case.run.record_s
    result = {
        "case": case.name,
        "database": {"path": db, "version": commit.number, "digest": commit.digest},
        "references": errors,
        "metrics": _metrics(case, simulation, reference),
        "outside_tables": outside,
        "passed": bool(complete and _passed(case, errors)),
    }
    return Validation(case, simulation, reference, result, constant, vehicle, rows)


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def show(done: Validation, console: Console) -> None:
    """Print errors, metrics and use beyond the data as tables."""
    from rich.markup import escape
    from rich.table import Table

    result = done.result
    database = result["database"]
    console.print(
        f"[bold]{escape(done.case.title)}[/], database version {database['version']} ({database['digest'][:16]})"
    )
    if result["references"]:
        table = Table("reference", "channel", "RMSE", "published model", "ratio", "unit", title="Errors")
        for source, channels in result["references"].items():
            for channel, e in channels.items():
                ratio = e["ratio"]
                text = "-" if ratio is None else f"[{'green' if ratio <= 1 else 'red'}]{ratio:.2f}[/]"
                table.add_row(source, channel, _number(e["rmse"]), _number(e["published_model_rmse"]), text, e["unit"])
        console.print(table)
    if result["metrics"]:
        labels = list(next(iter(result["metrics"].values())))
        table = Table("metric", *labels, title="Metrics (ITTC)")
        for metric, values in result["metrics"].items():
            table.add_row(metric, *[_number(values[c]) for c in labels])
        console.print(table)
    _show_outside(done, console)
    end = float(done.simulation["t"][-1])
    if end < done.case.run.duration_s - done.case.run.record_s:
        console.print(f"[red]the simulation left the finite numbers after {end:.1f} s; errors are up to there[/]")
    if float(done.simulation["D0"].min()) < 0.0:
        console.print("[red]the sail top left the water; the model holds for a fully submerged boat only[/]")
    verdict = "[green]within[/]" if result["passed"] else "[red]outside[/]"
    console.print(f"{verdict} the tolerances of the case file")


def _show_outside(done: Validation, console: Console) -> None:
    from rich.table import Table

    units = {axis: column for column, axis in axis_columns().items()}
    rows: dict[tuple[str, float], list[str]] = {}
    for item in done.result["outside_tables"]:
        rows.setdefault((item["axis"], round(item["fraction_of_time"], 3)), []).append(item["term"])
    if rows:
        table = Table("axis", "share of time", "terms", title="Used outside their data")
        for (axis, share), terms in sorted(rows.items(), key=lambda r: -r[0][1]):
            table.add_row(units.get(axis, axis), f"{100 * share:.1f} %", " ".join(terms))
        console.print(table)
    single: dict[str, list[str]] = {}
    for term, axes in done.constant_axes.items():
        for axis in axes:
            single.setdefault(axis, []).append(term)
    for axis, terms in single.items():
        console.print(
            f"measured at one {units.get(axis, axis)} only, used at every other: {' '.join(terms)}", highlight=False
        )
