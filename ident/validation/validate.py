"""`ident validate`: fly a case from the database and hold it against its references."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ident.metrics.in_waves import InWaves
from ident.metrics.measure import measured
from ident.validation.boats import Boat, Fleet
from ident.validation.coverage import outside_tables
from ident.validation.sweep import with_grid
from sim.boat.database import axis_columns, version_words
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.files.schema import FrameData
from sim.flight.case import Case, Reference, Series, load_case, load_reference, read_series
from sim.flight.simulate import CHANNELS, Simulation, fly

if TYPE_CHECKING:
    from rich.console import Console

Array = NDArray[np.float64]
_FRAMES = {
    "source": FrameData(x="aft", y="starboard", z="up"),
    "program": FrameData(x="forward", y="starboard", z="down"),
}


@dataclass(frozen=True)
class Validation:
    """One flown case with its comparison.

    Attributes
    ----------
    case, simulation, reference : What was flown and what it is held against.
    result : The JSON object of the comparison.
    constant_axes : Term -> axes along which it was measured at one value only.
    boat : The vehicle with its coefficients.
    own : Flights from the start of a source's record, by source.
    in_waves : Harmonics or statistics of a flight in waves.
    """

    case: Case
    simulation: Simulation
    reference: Series
    result: dict[str, Any]
    constant_axes: dict[str, list[str]]
    boat: Boat
    own: dict[str, Simulation]
    in_waves: InWaves


def rmse(simulation: Simulation, channel: str, series: tuple[Array, Array, str], abscissa: str = "t") -> float:
    """Root mean square difference at the reference's own times or path lengths, in its unit."""
    along, value, unit = series
    flown = simulation[channel]
    flown = np.degrees(flown) if unit.startswith("deg") else flown
    return float(np.sqrt(np.mean((np.interp(along, simulation[abscissa], flown) - value) ** 2)))


def check_reference(case: Case, reference: Series, where: str) -> None:
    """Refuse sources, channels and units that cannot be compared.

    Raises
    ------
    InputError
        Naming the case file, what was found and what is allowed.
    """
    if case.reference is None or not reference.data:
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
            raise InputError(case.reference.file or where, text, " or ".join(sorted(allowed)))


def _published(published: dict[str, tuple[Array, Array, str]], channel: str, unit: str) -> tuple[Array, Array]:
    """Abscissa and value of the published model in the reference's unit."""
    along, value, own_unit = published[channel]
    if own_unit != unit:
        value = np.degrees(value) if unit.startswith("deg") else np.radians(value)
    return along, value


def _error(
    simulation: Simulation, reference: Series, source: str, channel: str, published: dict[str, tuple[Array, Array, str]]
) -> dict[str, Any]:
    """Comparison of one channel with one source, as far as both go.

    Raises
    ------
    InputError
        When the reference begins after the run ends.
    """
    along, value, unit = reference[source][channel]
    flown = along <= float(simulation[reference.abscissa][-1]) + 1e-9
    if not flown.any():
        end = f"the run ends at {simulation[reference.abscissa][-1]:.4g}"
        raise InputError(f"reference {source} {channel}", f"begins at {reference.abscissa} = {along[0]:.4g}", end)
    entry: dict[str, Any] = {
        "rmse": rmse(simulation, channel, (along[flown], value[flown], unit), reference.abscissa),
        "unit": unit,
        "n": int(flown.sum()),
        "published_model_rmse": None,
        "ratio": None,
        "reference_sigma": None,
    }
    sigma = reference.sigma.get(source, {}).get(channel)
    if sigma is not None:
        entry["reference_sigma"] = float(np.sqrt(np.mean(sigma[flown] ** 2)))
    if channel in published:
        other_along, other = _published(published, channel, unit)
        both = flown & (along >= other_along[0]) & (along <= other_along[-1])
        if both.any():
            gap = np.interp(along[both], other_along, other) - value[both]
            entry["published_model_rmse"] = float(np.sqrt(np.mean(gap**2)))
            entry["ratio"] = entry["rmse"] / entry["published_model_rmse"] if entry["published_model_rmse"] else None
    return entry


def flights(case: Case, boat: Boat) -> tuple[Simulation, dict[str, Simulation]]:
    """A case flown, and flown from the start of each source's record that has one of its own.

    Raises
    ------
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    model, water = boat.model(case), boat.water(case)
    started = {s: case.started_as(s) for s in (case.reference.compare if case.reference else [])}
    own = {s: fly(c, boat.vehicle, model, water) for s, c in started.items() if c is not None}
    return fly(case, boat.vehicle, model, water), own


def errors(case: Case, reference: Series, simulation: Simulation, own: dict[str, Simulation]) -> dict[str, Any]:
    """Errors by source and channel.

    Parameters
    ----------
    case, reference : What was flown, and what it is held against.
    simulation, own : From ``flights``.

    Raises
    ------
    InputError
        When the reference begins after the run ends.
    """
    found: dict[str, Any] = {}
    if case.reference is None:
        return found
    published = reference[case.reference.published_model or ""]
    for source in case.reference.compare:
        flown = own.get(source, simulation)
        found[source] = {
            channel: _error(flown, reference, source, channel, published)
            for channel in case.reference.channels
            if channel in reference[source]
        }
    return found


def _passed(case: Case, found: dict[str, Any]) -> bool:
    for tolerance in case.tolerance:
        entry = found.get(tolerance.source, {}).get(tolerance.channel)
        if entry is None or entry["unit"] != tolerance.unit:
            raise InputError(
                f"case {case.name}, tolerance on {tolerance.source} {tolerance.channel} [{tolerance.unit}]",
                "no such reference channel in that unit",
                "a source, channel and unit of the reference file",
            )
        if not entry["rmse"] <= tolerance.rmse:
            return False
    return True


def _with_reference(case: Case, path: Path, frame: str | None) -> tuple[Case, Series]:
    """A case held against a user's own reference file, every channel that the simulation has.

    Parameters
    ----------
    frame : ``source`` (x aft, z up), ``program`` (x forward, z down), or None: as the case
        declares, else the program frame.

    Raises
    ------
    InputError
        For a file that cannot be read or holds nothing to compare.
    """
    declared = case.reference.frame if case.reference and not frame else _FRAMES[frame or "program"]
    if not path.is_file():
        raise InputError(str(path), "no such file", "a CSV file: source, channel, t or s, value, unit")
    header = path.read_bytes().partition(b"\n")[0].strip().split(b",")
    abscissa: Literal["t", "s"] = "s" if b"s" in header and b"t" not in header else "t"
    series = read_series(path, abscissa, declared.declared(f"case {case.name}, key reference.frame"))
    model = case.reference.published_model if case.reference else None
    compare = [s for s in series.data if s != model]
    channels = [c for c in CHANNELS if any(c in series[s] for s in compare)]
    if not channels:
        found = ", ".join(sorted({c for s in series.data.values() for c in s})) or "no row"
        raise InputError(f"{path}, column channel", found, ", ".join(CHANNELS))
    reference = Reference(
        file=str(path),
        published_model=model if model in series.data else None,
        compare=compare,
        channels=channels,
        abscissa=abscissa,
        frame=declared,
        initial={k: v for k, v in (case.reference.initial if case.reference else {}).items() if k in compare},
    )
    return case.model_copy(update={"reference": reference, "tolerance": []}), series


def validate(
    name: str,
    db: str,
    version: int | None = None,
    vehicle_name: str | None = None,
    reference_file: Path | None = None,
    reference_frame: str | None = None,
    fleet: Fleet | None = None,
) -> Validation:
    """Fly a case from a database version and compare.

    Parameters
    ----------
    name : Bundled case or path to a case file.
    db : Database path or URL.
    version : Database version, latest when None.
    vehicle_name : Bundled vehicle or path to a vehicle file, instead of the case's.
    reference_file, reference_frame : A user's own reference instead of the case's, and its
        frame, ``source`` or ``program``; the case's when None.
    fleet : The database version, where more than one case is flown from it.

    Raises
    ------
    InputError
        For a case, vehicle, reference, database or version that does not exist or fit.
    sim.flight.trim.NoEquilibrium
        When the case starts from self-propulsion and there is none.
    """
    case, where = load_case(name)
    if reference_file is not None:
        case, reference = _with_reference(case, reference_file, reference_frame)
    else:
        reference = load_reference(case, where)
    check_reference(case, reference, where)
    vehicle = load_vehicle(vehicle_name) if vehicle_name else load_vehicle(case.vehicle, beside=where)
    case = case.model_copy(update={"vehicle": vehicle.name})
    boat = (fleet or Fleet(db, version)).boat(vehicle)
    simulation, own = flights(case, boat)
    for one in (simulation, *own.values()):
        if len(one["t"]) < 2:
            found_at = f"the run ends at {one.end[0]:.3f} s, before a second record"
            raise InputError(f"{where}, key run", found_at, "a run of two records or more; events that happen later")
    found = errors(case, reference, simulation, own)
    found_on = measured(case, simulation, reference, own)
    metrics, curve = found_on.metrics, found_on.curve
    model = boat.model(case)
    grid = with_grid(case, vehicle, model, metrics)
    outside, constant = outside_tables(simulation, boat.coefficients, model)
    result = {
        "case": case.name,
        "vehicle": vehicle.name,
        "database": {"path": db, "version": boat.commit.number, "digest": boat.commit.digest},
        "references": found,
        "metrics": metrics,
        "outside_tables": outside,
        **({"curve": curve} if curve else {}),
        **grid,
        "trim_limited": list(simulation.trim.limited) if simulation.trim else [],
        "ends_s": float(simulation.end[0]),
        "passed": bool(_complete(simulation) and _passed(case, found) and _published_met(case, metrics)),
    }
    return Validation(case, simulation, reference, result, constant, boat, own, found_on.in_waves)


def _complete(simulation: Simulation) -> bool:
    """Whether the run went to its duration, or to an event that ends it, in finite numbers."""
    return bool(np.isfinite(simulation.end).all())


def _published_met(case: Case, metrics: dict[str, Any]) -> bool:
    """Whether every published value with a tolerance is met."""
    for value in case.published:
        if value.tolerance is None:
            continue
        found = metrics.get(value.metric, {}).get("simulated")
        if found is None or abs(found - value.value) > value.tolerance * abs(value.value):
            return False
    return True


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def show(done: Validation, console: Console) -> None:
    """Print errors, metrics and use beyond the data as tables."""
    from rich.markup import escape
    from rich.table import Table

    result = done.result
    console.print(f"[bold]{escape(done.case.title)}[/], {version_words(result['database'])}")
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
    _show_grid(result.get("grid", []), console)
    _show_outside(done, console)
    if result["trim_limited"]:
        console.print(f"[red]at the start at their limit: {', '.join(result['trim_limited'])}[/]")
    end = float(done.simulation["t"][-1])
    if not _complete(done.simulation):
        console.print(f"[red]the simulation left the finite numbers after {end:.1f} s; errors are up to there[/]")
    elif end < done.case.run.duration_s - done.case.run.record_s:
        console.print(f"the run ended at {done.result['ends_s']:.1f} s by an event of the case", highlight=False)
    if float(done.simulation["D0"].min()) < 0.0:
        console.print("[red]the sail top left the water; the model holds for a fully submerged boat only[/]")
    if not done.case.tolerance and all(p.tolerance is None for p in done.case.published):
        console.print("the case states no tolerance")
    else:
        verdict = "[green]within[/]" if result["passed"] else "[red]outside[/]"
        console.print(f"{verdict} the tolerances of the case file")


def _show_grid(grid: list[dict[str, Any]], console: Console) -> None:
    from rich.table import Table

    if not grid:
        return
    keys = ("speed_mps", "depth_m", "n_rps", "pitch_deg", "heel_deg", "dV_deg", "dH_deg", "ballast_kg", "trim_tank_m")
    table = Table(*keys, "remark", title="Self-propulsion")
    for point in grid:
        remark = point["reason"] or ", ".join(f"{k} at its limit" for k in point["limited"])
        table.add_row(*[_number(point[k]) for k in keys], remark)
    console.print(table)


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
