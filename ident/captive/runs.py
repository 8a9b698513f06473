"""Files of a source to rows of the run table, in SI and the campaign's own frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ident.captive.campaign_file import CampaignFile
from ident.captive.cells import Cells, read_cells
from ident.captive.channels import Channels, NotRising
from ident.captive.deduction import thrust_deduction
from ident.captive.dimensions import dimensional
from ident.captive.foam_histories import foam_channels
from ident.captive.grids import with_discretisation
from ident.captive.harmonic_tables import cartesian, instants
from ident.captive.histories import Reduced, reduce
from ident.captive.left_behind import left_behind
from ident.captive.moving import axes_of, moment_axes_of, moving_body, refuse_tables
from ident.captive.oscillation import states
from ident.captive.quantities import Column, owner
from ident.captive.readers.opening import matching, on_coarser_grids, open_sheet, reader_of, tables_of
from ident.captive.readers.sheet import Sheet
from ident.captive.readers.sheet_columns import columns_of
from ident.captive.readers.times import unit_of
from ident.captive.run_table import REQUIRED, TEXT
from ident.captive.source import NO_COLUMNS, Reduction, Source, idle_keys
from ident.captive.stated import Stated, constants, outside_excluded
from ident.captive.subtract import off_samples, off_table, taken_columns
from ident.captive.uses import Uses, refuse_axes_of_published, refuse_idle_quantities
from ident.cluster import Spread, here
from ident.output import Tell, silent
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError


@dataclass
class Gathered:
    """What some sources gave.

    Attributes
    ----------
    tables : Runs, a table a file: text columns, quantities in SI, ``file``, ``row``, ``reduction``.
    reduced : The histories that were reduced, in order.
    refused : Those whose time stamps do not rise.
    inputs : Paths that were read.
    """

    tables: list[pd.DataFrame] = field(default_factory=list)
    reduced: list[Reduced] = field(default_factory=list)
    refused: list[NotRising] = field(default_factory=list)
    inputs: list[Path] = field(default_factory=list)


def source_runs(
    folder: Path, source: Source, header: CampaignFile, gathered: Gathered, tell: Tell = silent, spread: Spread = here
) -> list[pd.DataFrame]:
    """Add all runs of one source to what was found.

    Parameters
    ----------
    folder : The campaign's.
    source : One ``[[source]]``.
    header : The campaign, for frame, scale and density.
    gathered : Its lists grow.
    tell : Told of every file.
    spread : Reads the files, here or on a cluster that sees the same folder.

    Returns
    -------
    The tables that were added.

    Raises
    ------
    InputError
        Naming file, row, column, what was found and what is allowed.
    """
    paths = matching(folder, source)
    tables: list[pd.DataFrame] = []
    uses = Uses(source, str(folder / "campaign.toml"))
    jobs = list(_jobs(folder, paths, source, header))
    read = spread(_read, iter(jobs))
    for done in range(len(jobs)):
        tell(f"reading {source.files}", done, len(jobs))
        table, reduced, refused, used = next(read)
        uses.add(used)
        gathered.reduced += reduced
        if refused is not None:
            gathered.refused.append(refused)
        else:
            tables.append(table)
    if paths and not gathered.refused:
        uses.refuse()
    tell(f"reading {source.files}", len(jobs), len(jobs))
    gathered.tables += tables
    gathered.inputs += [p for path in paths for p in (path, *on_coarser_grids(path, folder, source))]
    return tables


def _jobs(
    folder: Path, paths: list[Path], source: Source, header: CampaignFile
) -> Iterator[tuple[Path, Path, Source, CampaignFile, str]]:
    """What is read: each file, or each table of a file where ``table`` stands for several; their name then."""
    for path in paths:
        stated = bool(source.table) and not idle_keys(source, reader_of(path, source))
        names = tables_of(path, source) if stated else [source.table]
        for name in names:
            many = "" if name == source.table else name
            yield folder, path, source.model_copy(update={"table": name}) if many else source, header, many


def _read(
    folder: Path, path: Path, source: Source, header: CampaignFile, of_many: str = ""
) -> tuple[pd.DataFrame, list[Reduced], NotRising | None, Uses]:
    """The runs of one file, its reduced histories, and what it made use of; or why its time stamps refuse it."""
    where = str(folder / "campaign.toml")
    uses = Uses(source, where)
    idle = idle_keys(source, reader_of(path, source))
    if idle:
        text = f"nothing: the reader {reader_of(path, source)} of {path.name} does not look at it"
        raise InputError(f"{where}, key source.{idle[0]}", "declared", text)
    stated = constants(folder, path, source, of_many)
    if of_many and source.rows == "history":
        stated[0].setdefault("run_id", f"{path.stem}/{of_many}")
    name = path.relative_to(folder).as_posix()
    reduced: list[Reduced] = []
    try:
        if source.rows == "history":
            table, reduced = _from_histories(path, source, header, stated, where, uses)
            if source.grids is not None:
                others = on_coarser_grids(path, folder, source)
                coarser = [_from_histories(p, source, header, stated, where, uses)[0] for p in others]
                table = with_discretisation(table, coarser, source.grids.refinement, str(path))
            if source.deduction is not None:
                bare = _towed(folder, source, header, stated, where, uses)
                table = thrust_deduction(table, bare, source.deduction, header.frame.frame)
            reduced = [replace(one, file=name) for one in reduced]
        else:
            table = _from_table(path, source, header, stated, where, uses)
    except NotRising as error:
        # Every such file is to be named, not the first alone.
        error.file = name
        return pd.DataFrame(), [], error, uses
    turned = source.reduction is not None and source.reduction.kind == "oscillatory"
    along = {"axes": axes_of(source, header), "moment_axes": moment_axes_of(source, header)}
    table = table.assign(file=name, files=source.files, **(dict.fromkeys(along, "body") if turned else along))
    if source.table:
        # Its runs are numbered by themselves.
        table = table.assign(of_table=source.table)
    refuse_idle_quantities(table)
    refuse_axes_of_published(table, source, where)
    return outside_excluded(table, source, where), reduced, None, uses


def _towed(folder: Path, source: Source, header: CampaignFile, stated: Stated, where: str, uses: Uses) -> pd.DataFrame:
    """The run without thrust that a deduction is from, with the error of its grids."""
    assert source.deduction is not None
    towed = source.model_copy(update={"files": source.deduction.towed, "awaited": False})
    paths = matching(folder, towed)
    if len(paths) != 1:
        raise InputError(f"{where}, key source.deduction.towed", f"{len(paths)} files", "those of one run")
    tables = [
        _from_histories(p, towed, header, stated, where, uses)[0]
        for p in (paths[0], *on_coarser_grids(paths[0], folder, towed))
    ]
    if source.grids is None:
        return tables[0]
    return with_discretisation(tables[0], tables[1:], source.grids.refinement, str(paths[0]))


def _from_table(
    path: Path, source: Source, header: CampaignFile, stated: Stated, where: str, uses: Uses
) -> pd.DataFrame:
    """A table with a row a run."""
    words, numbers, primed = stated
    sheet = open_sheet(path, source)
    kinds = columns_of(sheet, source, TEXT)
    uses.columns(sheet.header, kinds)
    wanted: list[tuple[int, Column | None]] = []
    names: list[str] = []
    for at, (name, kind) in enumerate(zip(sheet.header, kinds, strict=True)):
        text = source.columns.get(name, name)
        if kind is not None or text in TEXT:
            wanted.append((at, kind))
            names.append(text if kind is None else kind.quantity)
    for name in {**words, **numbers}:
        if name in names:
            raise InputError(f"{sheet.where}, column {name}", "also in [source.constants]", "one of the two")
    _required(sheet, {*names, *words, *numbers}, source)
    totals = {q for q in (*names, *numbers) if owner(q) in OUTPUTS and not q.startswith(("s_", "sigma_"))}
    taken = taken_columns(sheet, source, header, totals, where) if source.subtract else []
    read = read_cells(sheet, wanted + [(t.at, t.kind) for t in taken], source)
    rows = read.rows
    cells = [
        uses.translated(c, names[i]) if i < len(wanted) and wanted[i][1] is None else c
        for i, c in enumerate(read.columns)
    ]
    columns: dict[str, Any] = dict(zip(names, cells, strict=False)) | {**words, **numbers}
    primed = primed | {kind.quantity for _, kind in wanted if kind is not None and kind.primed}
    primed |= _beside_numbers(columns, read, primed, sheet, uses)
    if "run_id" not in columns:
        columns["run_id"] = [f"{path.stem}-{row}" for row in rows]
    columns.setdefault("source", path.name)
    for name in TEXT:
        columns.setdefault(name, "")
    out = pd.DataFrame({**columns, "file": path.name, "row": rows, "reduction": ""}, index=range(len(rows)))
    uses.primed |= primed | ({"value"} if "value" in columns else set())
    out = dimensional(out, primed, source, header, where)
    if "value" in columns:
        out["value_unit"] = next((k.unit for k in kinds if k is not None and k.quantity == "value"), "")
        out["normalisation"], out["reference_area"], out["reference_length"] = _of_values(source)
    if taken:
        uses.primed |= {t.kind.quantity for t in taken if t.kind.primed}
        off = pd.DataFrame(dict(enumerate(cells[len(wanted) :])))
        out = off_table(out, taken, off, source, header, sheet)
    if source.reduction is None:
        return out
    out = cartesian(out, where)
    standing = any(out[k].fillna(0.0).ne(0.0).any() for k in ("alpha", "beta") if k in out)
    refuse_tables(source, header, standing, where)
    return instants(out, source, header, str(path), where)


def _beside_numbers(columns: dict[str, Any], read: Cells, primed: set[str], sheet: Sheet, uses: Uses) -> set[str]:
    """Put errors, footnote marks and notes of cells into the columns of a table; what of them is dimensionless."""
    for name, errors in read.errors.items():
        if name in columns:
            raise InputError(f"{sheet.where}, column {name}", "errors behind the numbers too", "one of the two")
        columns[name] = errors
    uses.beside |= read.used
    if any(read.marks):
        usual = np.broadcast_to(np.asarray(columns.get("quality", ""), dtype=object), len(read.marks))
        columns["quality"] = [mark or word for mark, word in zip(read.marks, usual, strict=True)]
    columns["notes"] = read.notes
    return {name for name in read.errors if name.removeprefix("s_") in primed}


def _of_values(source: Source) -> tuple[str, float, float]:
    """How published values of a source were made dimensionless: name, area and length [SI] where stated."""
    stated = source.reference
    return source.normalisation, stated.area_m2 if stated else np.nan, (stated.length_m or np.nan) if stated else np.nan


def _required(sheet: Sheet, columns: set[str], source: Source) -> None:
    optional = {"run_id", "source"} if source.columns or source.constants else set()
    optional |= {"test"} if source.reduction else set()
    for name in REQUIRED:
        if name not in columns and name not in optional:
            text = f"columns {', '.join(REQUIRED)} and quantities"
            raise InputError(str(sheet.path), f"column {name} missing", text)


def _from_histories(
    path: Path, source: Source, header: CampaignFile, stated: Stated, where: str, uses: Uses
) -> tuple[pd.DataFrame, list[Reduced]]:
    """A file or case that is one history a part."""
    assert source.reduction is not None
    words, numbers, primed = stated
    rule = source.reduction
    if primed:
        one_run = pd.DataFrame([{**numbers, "file": path.name, "row": 1}])
        made = dimensional(one_run, primed, source, header, where).iloc[0]
        uses.primed |= primed
        numbers = {k: float(made[k]) for k in numbers}
    frame, ittc = header.frame.frame, header.frame.angles == "ittc"
    rows: list[dict[str, Any]] = []
    reduced = []
    for part, channels in _channels(path, source, header, numbers, where, uses):
        words_of_run = dict(words) | ({"part": part} if part else {})
        # Of a folder "drift_2.5" all is its name.
        name = words_of_run.get("run_id") or (path.name if path.is_dir() else path.stem)
        words_of_run["run_id"] = f"{name}-{part}" if part else name
        own_error = next((q for q in numbers if q.startswith("s_")), "")
        if own_error:
            text = "rel_sigma, which is added to the error that the record has of itself"
            raise InputError(f"{where}, key source.constants.sigma{own_error[1:]}", "declared for a record", text)
        if "displacement" in numbers:
            text = "amplitude in [source.reduction], or a column of the record"
            raise InputError(f"{where}, key source.constants.displacement", "one value for a whole record", text)
        if "frequency" in numbers and rule.frequency_hz is not None:
            raise InputError(f"{where}, key source.reduction.frequency_hz", "frequency stated twice", "one of the two")
        frequency = numbers.get("frequency", rule.frequency_hz)
        _no_idle_rule(channels, rule, where)
        values, one = reduce(channels, rule, words_of_run["run_id"], frequency)
        for quantity in sorted(values.measured & numbers.keys()):
            twice = f"{quantity} is measured and stands in [source.constants]"
            raise InputError(str(channels.path), twice, "one of the two")
        run: dict[str, Any] = dict.fromkeys((*TEXT, "notes"), "") | {"source": f"{path.name}, reduced"}
        run |= words_of_run | numbers | values.quantities
        run |= {"file": path.name, "row": 1, "reduction": one.words(), "converged": one.fit.converged}
        if rule.kind == "oscillatory":
            rows += states(values.oscillation(run), rule, frame, ittc, str(path))
            # An OpenFOAM header says what becomes of its CofR.
            if not source.moments_about and reader_of(path, source) != "openfoam":
                size = abs(values.amplitude or rule.amplitude or 0.0)
                behind = left_behind(str(rule.motion), size, values.harmonics, values.covariance, frame)
                one = replace(one, left_behind=behind)
        else:
            rows.append(run)
        reduced.append(one)
    out = pd.DataFrame(rows)
    for name in REQUIRED:
        missing = (out[name] == "") if name in out else pd.Series(True, index=out.index)
        if missing.any():
            raise InputError(str(path), f"{name} missing", f"{name} in [source.constants], or (?P<{name}>...) in match")
    return out, reduced


def _channels(
    path: Path, source: Source, header: CampaignFile, numbers: dict[str, float], where: str, uses: Uses
) -> Iterator[tuple[str, Channels]]:
    """The histories of a path: part (empty where the campaign names it) and channels."""
    if reader_of(path, source) == "openfoam":
        if source.subtract:
            raise InputError(f"{where}, key source.subtract", "an OpenFOAM case", NO_COLUMNS)
        uses.whole()
        yield from foam_channels(path, source, header, numbers, where)
        return
    sheet = open_sheet(path, source)
    kinds = columns_of(sheet, source, ())
    uses.columns(sheet.header, kinds)
    wanted = [(i, k) for i, k in enumerate(kinds) if k is not None]
    if not wanted:
        raise InputError(sheet.where, "no column that is a quantity", "time and loads")
    names = [k.quantity for _, k in wanted]
    taken = taken_columns(sheet, source, header, {n for n in names if n in OUTPUTS}, where)

    def to_si(kind: Column) -> float:
        if not kind.primed:
            return kind.factor
        one = pd.DataFrame([{kind.quantity: 1.0, "U": numbers.get("U"), "file": path.name, "row": 1}])
        uses.primed.add(kind.quantity)
        made = dimensional(one, {kind.quantity}, source, header, where).iloc[0]
        return float(made[kind.quantity]) * kind.factor

    factors = np.array([to_si(kind) for kind in (*(k for _, k in wanted), *(t.kind for t in taken))])
    channels, matrix = off_samples(names, taken, factors)

    positions = [*(i for i, _ in wanted), *(t.at for t in taken)]
    at = next((k for k, (_, kind) in enumerate(wanted) if kind.quantity == "time"), -1)
    clock = wanted[at][0] if at >= 0 else -1
    if at >= 0 and factors[at] == 1.0:
        made = _stamps(sheet, positions, clock, at)
        matrix[at] *= made
        factors[at] *= made

    def pieces() -> Iterator[np.ndarray]:
        for block in sheet.numbers(positions, clock):
            yield block @ matrix if taken else block * factors

    gaps = {
        k.quantity: tuple(m * f for m in source.missing_numbers) for (_, k), f in zip(wanted, factors, strict=False)
    }
    others = [c for c in channels if c != "time"]
    moving = moving_body(others, source, header, numbers, source.moments_about or "body", where)
    yield "", Channels(path, channels, pieces, sheet.first_row, gaps, moving)


def _stamps(sheet: Sheet, positions: list[int], clock: int, at: int) -> float:
    """Factor to seconds of a time column said to be in seconds whose stamps cannot be; 1 for others."""
    block = next(sheet.numbers(positions, clock), None)
    named = unit_of(float(block[0, at]), float(block[1, at])) if block is not None and len(block) > 1 else None
    return named[0] if named else 1.0


def _no_idle_rule(channels: Channels, rule: Reduction, where: str) -> None:
    """Refuse keys of an oscillation that a channel of the record stands in for."""
    place = f"{where}, key source.reduction."
    if "displacement" in channels.quantities:
        for key in ("amplitude", "phase_deg"):
            if key in rule.model_fields_set:
                text = "nothing: the column displacement measures it"
                raise InputError(place + key, "declared", text)
    for name in rule.delay_s:
        if name not in channels.quantities or name == "time":
            raise InputError(f"{place}delay_s.{name}", "no such channel", ", ".join(channels.quantities))
