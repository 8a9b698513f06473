"""Files of a source to rows of the run table, in SI and the campaign's own frame."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ident.captive.campaign_file import CampaignFile
from ident.captive.conversions import dimensional, quantity_of
from ident.captive.histories import Channels, Moving, NotRising, Pieces, Reduced, reduce, states
from ident.captive.moving import axes_of, moving_body, refuse_tables
from ident.captive.patterns import search
from ident.captive.quantities import Column, column, owner, suffixed
from ident.captive.readers import openfoam
from ident.captive.readers.opening import matching, open_sheet, reader_of
from ident.captive.readers.table import Sheet, columns_of, run_blocks
from ident.captive.readers.text import LARGEST, Dialect, odd
from ident.captive.readers.times import unit_of
from ident.captive.run_table import DIRECT, REQUIRED, STATES, TEXT
from ident.captive.source import NO_COLUMNS, Reduction, Source, idle_keys
from ident.captive.subtract import off_samples, off_table, taken_columns
from ident.captive.uses import Uses, refuse_idle_quantities
from ident.output import Tell, silent
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError

_PLAIN = Dialect()
# By how much of itself a limit of [source.within] is widened.
_SLACK = 1e-9
_LEDGER = re.compile(r"\(\s*(\d[\d.,' ]*)\s*\)")
# Signs and decimal points as file names have them: m08, p08, n4, 04p5, 4,5.
_IN_NAMES = re.compile(r"(?P<sign>[mpnMPN+-]?)(?P<whole>\d+)(?:[pP,](?P<part>\d+))?")
_DIGITS = frozenset("0123456789+-.eE")


@dataclass
class Found:
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
    folder: Path, source: Source, header: CampaignFile, found: Found, tell: Tell = silent
) -> list[pd.DataFrame]:
    """Add all runs of one source to what was found.

    Parameters
    ----------
    folder : The campaign's.
    source : One ``[[source]]``.
    header : The campaign, for frame, scale and density.
    found : Its lists grow.
    tell : Told of every file.

    Returns
    -------
    The tables that were added.

    Raises
    ------
    InputError
        Naming file, row, column, what was found and what is allowed.
    """
    paths = matching(folder, source)
    where = str(folder / "campaign.toml")
    tables: list[pd.DataFrame] = []
    uses = Uses(source, where)
    for done, path in enumerate(paths):
        tell(f"reading {source.files}", done, len(paths))
        idle = idle_keys(source, reader_of(path, source))
        if idle:
            text = f"nothing: the reader {reader_of(path, source)} of {path.name} does not look at it"
            raise InputError(f"{where}, key source.{idle[0]}", "declared", text)
        stated = constants(folder, path, source)
        name = path.relative_to(folder).as_posix()
        try:
            if source.rows == "history":
                table, reduced = _from_histories(path, source, header, stated, where, uses)
                found.reduced += [replace(one, file=name) for one in reduced]
            else:
                table = _from_table(path, source, header, stated, where, uses)
        except NotRising as error:
            # Every such file is to be named, not the first alone.
            error.file = name
            found.refused.append(error)
            continue
        turned = source.reduction is not None and source.reduction.kind == "oscillatory"
        table = table.assign(file=name, files=source.files, axes="body" if turned else axes_of(source, header))
        refuse_idle_quantities(table)
        tables.append(outside_excluded(table, source, where))
    if paths and not found.refused:
        uses.refuse()
    tell(f"reading {source.files}", len(paths), len(paths))
    found.tables += tables
    found.inputs += paths
    return tables


def outside_excluded(table: pd.DataFrame, source: Source, where: str) -> pd.DataFrame:
    """Runs with every load excluded where their state is outside ``[source.within]``.

    Parameters
    ----------
    table : Runs in SI, in the campaign's own frame.
    source : Its ``within``: state with a suffix unit -> lowest and highest value.
    where : The campaign file.

    Returns
    -------
    ``table`` with ``exclude`` and ``reason`` filled in for these runs, so that fit and checks
    leave them out and say why.

    Raises
    ------
    InputError
        For a state that is not one, has no unit, or that no run of the files gives.
    """
    out = table
    for name, (low, high) in source.within.items():
        place = f"{where}, key source.within.{name}"
        if name not in suffixed() or suffixed()[name][0] not in STATES:
            known = ", ".join(c for c, (q, _) in suffixed().items() if q in ("U", "alpha", "beta", "r"))
            raise InputError(place, "no state of a run with its unit", known + " and the like")
        quantity, factor = suffixed()[name]
        if quantity not in out or out[quantity].isna().all():
            raise InputError(place, f"no {quantity} in the runs of {source.files}", "a state that the runs give")
        value = out[quantity].astype(float)
        # A limit that stands in the file in other digits is still inside.
        slack = _SLACK * max(abs(low), abs(high)) * factor
        outside = (value < low * factor - slack) | (value > high * factor + slack)
        loads = " ".join(o for o in (*OUTPUTS, *DIRECT) if o in out)
        out = out.assign(
            exclude=out["exclude"].mask(outside, loads),
            reason=out["reason"].mask(outside, f"{name} beyond {low:g} to {high:g}"),
        )
    return out


def constants(folder: Path, path: Path, source: Source) -> tuple[dict[str, str], dict[str, float], set[str]]:
    """What the campaign says of every run of a file: ``constants``, and ``match`` on its path.

    Returns
    -------
    words : Text columns.
    numbers : Quantities in SI.
    primed : Those that are dimensionless.

    Raises
    ------
    InputError
        For a path that does not match, an unknown quantity, or no finite number.
    """
    toml = str(folder / "campaign.toml")
    where = f"{toml}, key source.constants"
    given: dict[str, Any] = dict(source.constants)
    if source.match:
        name = path.relative_to(folder).as_posix()
        found = search(source.match, name)
        if not found:
            raise InputError(f"{folder / 'campaign.toml'}, key source.match", f"{name!r} does not match", source.match)
        named = {k: v for k, v in found.groupdict().items() if v is not None}
        given |= {k: _of_name(k, v, name[: found.start(found.re.groupindex[k])], toml) for k, v in named.items()}
    words: dict[str, str] = {}
    numbers: dict[str, float] = {}
    primed: set[str] = set()
    for key, value in given.items():
        if key in TEXT:
            words[key] = str(value).strip()
            continue
        place = f"{where}.{key}"
        if key in suffixed() or not isinstance(value, str):
            kind = column(key, None, where)
            number = _PLAIN.number(str(value))
            if number is None:
                raise InputError(place, repr(str(value)[:60]), "a finite number")
            numbers[kind.quantity] = number * kind.factor
            primed |= {kind.quantity} if kind.primed else set()
        elif owner(key):
            numbers[key] = quantity_of(value, owner(key), place)
        else:
            raise InputError(place, repr(value[:60]), "a quantity, or one of " + ", ".join(TEXT))
    return words, numbers, primed


def signed(quantity: str) -> bool:
    """Whether a quantity may be below zero."""
    return quantity not in ("U", "D0", "rel_sigma", "KT", "KQ", "time", "frequency") and not quantity.startswith("s_")


def _of_name(key: str, text: str, before: str, where: str) -> str:
    """A number out of a path with its sign and point as file names write them; other text as it is.

    Raises
    ------
    InputError
        For a mark of a sign right before the digits that the group leaves out.
    """
    if key in TEXT or not re.search(r"\d", text):
        return text
    quantity = suffixed()[key][0] if key in suffixed() else key
    mark = re.search(r"(?:^|[^A-Za-z])([mpnMPN])$", before)
    if mark and text[:1].isdigit() and signed(quantity):
        found = f"{mark[1]!r} right before {text!r}, outside of the group {key}"
        raise InputError(f"{where}, key source.match", found, f"(?P<{key}>[mp]?...): m and n are minus, p is plus")
    hit = _IN_NAMES.fullmatch(text)
    if hit is None:
        return text
    sign = "-" if hit["sign"] in tuple("mMnN-") else ""
    return f"{sign}{hit['whole']}" + (f".{hit['part']}" if hit["part"] else "")


Stated = tuple[dict[str, str], dict[str, float], set[str]]


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
    cells, rows = _cells(sheet, wanted + [(t.at, t.kind) for t in taken], source.missing)
    cells = [
        uses.translated(c, names[i]) if i < len(wanted) and wanted[i][1] is None else c for i, c in enumerate(cells)
    ]
    columns: dict[str, Any] = dict(zip(names, cells, strict=False)) | {**words, **numbers}
    primed = primed | {kind.quantity for _, kind in wanted if kind is not None and kind.primed}
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
    out = _cartesian(out, where)
    standing = any(out[k].fillna(0.0).ne(0.0).any() for k in ("alpha", "beta") if k in out)
    refuse_tables(source, header, standing, where)
    return _spread(out, source, header, str(path))


def _cartesian(table: pd.DataFrame, where: str) -> pd.DataFrame:
    """Amplitudes and phases of harmonics as parts in phase and in quadrature with the displacement.

    A sin(k w t + phase) = A cos(phase) sin(k w t) + A sin(phase) cos(k w t); a lag is a phase behind.

    Raises
    ------
    InputError
        For an amplitude without one of phase and lag, or beside parts of the same harmonic.
    """
    out = table
    for output, k in itertools.product(OUTPUTS, ("", "2", "3")):
        names = {kind: f"{output}_{kind}{k}" for kind in ("amp", "phase", "lag", "in", "out")}
        given = {kind for kind, name in names.items() if name in out}
        if not given & {"amp", "phase", "lag"}:
            continue
        if given not in ({"amp", "phase"}, {"amp", "lag"}):
            found = " ".join(sorted(names[kind] for kind in given))
            text = (
                f"{names['amp']} with one of {names['phase']} (ahead of the displacement) and {names['lag']} (behind)"
            )
            raise InputError(f"{where}, key source.columns", found, text)
        phase = out[names["phase"]] if "phase" in given else -out[names["lag"]]
        parts = {names["in"]: out[names["amp"]] * np.cos(phase), names["out"]: out[names["amp"]] * np.sin(phase)}
        out = out.drop(columns=[names[kind] for kind in given]).assign(**parts)
    return out


def _of_values(source: Source) -> tuple[str, float, float]:
    """How published values of a source were made dimensionless: name, area and length [SI] where stated."""
    own = source.reference
    return source.normalisation, own.area_m2 if own else np.nan, (own.length_m or np.nan) if own else np.nan


def _cells(
    sheet: Sheet, wanted: list[tuple[int, Column | None]], missing: Sequence[float]
) -> tuple[list[np.ndarray], np.ndarray]:
    """Columns of a run table, each as numbers in SI or, without a kind, as text; and the file rows."""
    found: list[list[np.ndarray]] = [[] for _ in wanted]
    places = []
    for rows, cells in run_blocks(sheet):
        for parts, (at, kind) in zip(found, wanted, strict=True):
            parts.append(_words(cells[at]) if kind is None else _numbers(sheet, cells[at], rows, kind, missing))
        places.append(np.array(rows))
    return [np.concatenate(parts) for parts in found], np.concatenate(places)


def _words(cells: Sequence[str]) -> np.ndarray:
    """A column of text without blanks around; words that repeat are kept once."""
    once: dict[str, str] = {}
    return np.array([once.setdefault(w, w) for w in (c.strip() for c in cells)], dtype=object)


def _required(sheet: Sheet, columns: set[str], source: Source) -> None:
    optional = {"run_id", "source"} if source.columns or source.constants else set()
    optional |= {"test"} if source.reduction else set()
    for name in REQUIRED:
        if name not in columns and name not in optional:
            text = f"columns {', '.join(REQUIRED)} and quantities"
            raise InputError(str(sheet.path), f"column {name} missing", text)


def _numbers(sheet: Sheet, cells: Sequence[str], rows: list[int], kind: Column, missing: Sequence[float]) -> np.ndarray:
    """A column of a run table as numbers; blank, or stated to be missing, is NaN."""
    signless = kind.quantity.startswith("s_") or kind.quantity == "rel_sigma"
    plain = _plain_numbers(cells) if (sheet.dialect.decimal, sheet.dialect.thousands) == (".", "") else None
    if plain is not None and not (signless and (plain < 0.0).any()):
        return np.where(np.isin(plain, list(missing)), np.nan, plain * kind.factor) if missing else plain * kind.factor
    values = np.full(len(cells), np.nan)
    # Brackets are an accountant's minus in a column that has no other one.
    ledger = signed(kind.quantity) and not any(c.strip()[:1] in "-\u2212\u2013\uff0d" for c in cells if c.strip())
    for i, cell in enumerate(cells):
        if not cell.strip():
            continue
        value = sheet.dialect.number(cell)
        if value is None and ledger and (inside := _LEDGER.fullmatch(cell.strip())):
            value = sheet.dialect.number(inside[1])
            value = None if value is None else -value
        if value is None:
            place = f"{sheet.path}, row {rows[i]}, column {kind.name[:60]}"
            raise InputError(place, repr(cell[:60]), f"a finite number of at most {LARGEST:g}, or blank{odd(cell)}")
        if value < 0.0 and signless:
            raise InputError(f"{sheet.path}, row {rows[i]}, column {kind.name[:60]}", cell[:60], "zero or more")
        values[i] = np.nan if value in missing else value * kind.factor
    return values


def _plain_numbers(cells: Sequence[str]) -> np.ndarray | None:
    """Cells of digits, point, sign and exponent alone as numbers; None where another stands among them."""
    if not _DIGITS.issuperset("".join(cells)):
        return None
    try:
        values = np.array([float(c) if c else math.nan for c in cells])
    except ValueError:
        return None
    return values if np.nanmax(np.abs(values), initial=0.0) <= LARGEST else None


def _spread(table: pd.DataFrame, source: Source, header: CampaignFile, where: str) -> pd.DataFrame:
    """Rows of harmonics to the four states of each oscillation."""
    assert source.reduction is not None
    frame, ittc = header.frame.frame, header.frame.angles == "ittc"
    found = []
    for run in table.to_dict("records"):
        place = f"{where}, row {run['row']}"
        found += states({str(k): v for k, v in run.items()}, source.reduction, frame, ittc, place)
    return pd.DataFrame(found)


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
        own = dict(words) | ({"part": part} if part else {})
        # Of a folder "drift_2.5" all is its name.
        name = own.get("run_id") or (path.name if path.is_dir() else path.stem)
        own["run_id"] = f"{name}-{part}" if part else name
        if "frequency" in numbers and rule.frequency_hz is not None:
            raise InputError(f"{where}, key source.reduction.frequency_hz", "frequency stated twice", "one of the two")
        frequency = numbers.get("frequency", rule.frequency_hz)
        _no_idle_rule(channels, rule, where)
        values, one = reduce(channels, rule, own["run_id"], frequency)
        for quantity in values:
            if quantity in numbers and quantity != "frequency":
                found = f"{quantity} is measured and stands in [source.constants]"
                raise InputError(str(channels.path), found, "one of the two")
        run = {**dict.fromkeys(TEXT, ""), "source": f"{path.name}, reduced", **own, **numbers, **values}
        run |= {"file": path.name, "row": 1, "reduction": one.words(), "converged": one.fit.converged}
        rows += states(run, rule, frame, ittc, str(path)) if rule.kind == "oscillatory" else [run]
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
        yield from _openfoam(path, source, header, numbers, where)
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

    gaps = {k.quantity: tuple(m * f for m in source.missing) for (_, k), f in zip(wanted, factors, strict=False)}
    others = [c for c in channels if c != "time"]
    moving = moving_body(others, source, header, numbers, source.moments_about or "body", where)
    yield "", Channels(path, channels, pieces, sheet.first_row, gaps, moving)


def _stamps(sheet: Sheet, positions: list[int], clock: int, at: int) -> float:
    """Factor to seconds of a time column said to be in seconds whose stamps cannot be; 1 for others."""
    block = next(sheet.numbers(positions, clock), None)
    found = unit_of(float(block[0, at]), float(block[1, at])) if block is not None and len(block) > 1 else None
    return found[0] if found else 1.0


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


def _openfoam(
    path: Path, source: Source, header: CampaignFile, numbers: dict[str, float], where: str
) -> Iterator[tuple[str, Channels]]:
    """The function objects of an OpenFOAM case, each the history of one part."""
    if source.rho_inf is None:
        text = "the rhoInf of the function object: 1 for kinematic loads, or the density it used"
        raise InputError(f"{where}, key source.rho_inf", "nothing", text)
    if not path.is_dir():
        raise InputError(str(path), "a file", "a case folder, its postProcessing, or one function object in it")
    try:
        found = openfoam.objects(path)
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror}", "a readable folder") from error
    if not found:
        others = sorted({p.name for p in path.glob("**/*.dat")})[:5]
        seen = f", only {', '.join(others)}" if others else ""
        text = "postProcessing/<function object>/<start>/forces.dat or force.dat; coefficients are not read"
        raise InputError(str(path), f"no output of forces{seen}", text)
    for name in source.parts:
        if name not in found:
            raise InputError(str(path), f"no function object {name!r}", ", ".join(found))
    twice = [part for part in source.parts.values() if list(source.parts.values()).count(part) > 1]
    if twice:
        text = "one function object a part: it sums the patches that it is given"
        raise InputError(f"{where}, key source.parts", f"{twice[0]!r} twice", text)
    chosen = source.parts or (dict.fromkeys(found, "") if len(found) == 1 else {})
    if not chosen:
        text = f"[source.parts] naming the part of each: {', '.join(found)}"
        raise InputError(str(path), f"{len(found)} function objects", text)
    for name, part in chosen.items():
        pieces = _foam_pieces(found[name], source, header, where)
        moving = _foam_moving(found[name], source, header, numbers, where)
        yield part, Channels(path, ["time", *openfoam.LOADS], pieces, moving=moving)


def _foam_moving(
    folder: Path, source: Source, header: CampaignFile, numbers: dict[str, float], where: str
) -> Moving | None:
    """What a moving body asks for: its CofR stays in the header where the file has no column for it."""
    rule = source.reduction
    if rule is None or rule.kind != "oscillatory":
        return None
    if rule.motion in ("roll", "pitch", "yaw") and not source.axes and "axes" not in header.frame.model_fields_set:
        text = "tank where the body turns in the mesh (the loads are along the mesh's axes), body where it does not"
        raise InputError(f"{where}, key source.axes", f"nothing, and a motion of {rule.motion}", text)
    moves = next((m for _, _, m in openfoam.loads(folder, source.cofr)), False)
    if moves and source.moments_about == "fixed":
        raise InputError(
            f"{where}, key source.moments_about", "'fixed'", "nothing: the file's CofR moves with the body"
        )
    about = "body" if moves else source.moments_about or "fixed"
    return moving_body(list(openfoam.LOADS), source, header, numbers, about, where)


def _foam_pieces(folder: Path, source: Source, header: CampaignFile, where: str) -> Pieces:
    """Starts reading one function object: SI, moments about the campaign's point."""
    density = header.fluid.density_kgpm3 / float(source.rho_inf or 1.0)
    factors = np.ones(7)
    for name, value in source.factor.items():
        if name not in openfoam.LOADS:
            raise InputError(f"{where}, key source.factor.{name}", "no load of the file", ", ".join(openfoam.LOADS))
        factors[1 + openfoam.LOADS.index(name)] = value
    point = header.moment_point
    origin = source.vehicle_origin

    def pieces() -> Iterator[np.ndarray]:
        fixed = None
        for values, centre, moving in openfoam.loads(folder, source.cofr):
            if not moving:
                if fixed is not None and (centre != fixed).any():
                    raise InputError(str(folder), f"CofR {fixed} and {centre}", "one moment point in all restarts")
                fixed = centre
            elif origin is not None:
                text = "no vehicle_origin: a moving CofR is the body's moment point"
                raise InputError(str(folder), "CofR moves", text)
            out = values * factors
            if origin is not None:
                arm = centre - np.array(origin) - np.array([point.x_m, point.y_m, point.z_m])
                out[:, 4:] += np.cross(np.broadcast_to(arm, (len(out), 3)), out[:, 1:4])
            out[:, 1:] *= density
            yield out

    return pieces
