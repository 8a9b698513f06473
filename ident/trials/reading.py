"""A record of a maneuver as the recorder wrote it: wide or long tables, any reader of a campaign."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.captive.quantities import is_unit, split
from ident.captive.readers.opening import open_sheet, reader_of
from ident.captive.readers.sheet import Sheet
from ident.captive.readers.text import COMMENTS, head
from ident.captive.source import LOOKED_AT, Source
from ident.checks.findings import Finding
from ident.trials.channels import Meaning, channel_of, meaning, plain
from ident.trials.spec import TrialFile
from ident.trials.times import parsed, stamps
from sim.files.errors import InputError
from sim.files.record import Record

Array = NDArray[np.float64]
_MOST_ROWS = 2_000_000
# What is stated of how a table is written, in the words of a campaign.
_AS_WRITTEN = ("delimiter", "decimal", "thousands", "encoding", "header_pattern", "skip", "units_row", "names", "table")
_LONG = ("channel", "value", "unit")
# Characters by which a line is found again.
_EXACTLY = 200
# A header stands within the first lines.
_TITLES = 100
_TIMES = ("t", "time", "time s", "t s")
_DEGREES = re.compile(
    r"""(\d+(?:\.\d+)?)\s*[°d\s]\s*(\d+(?:\.\d+)?)?\s*['′\s]?\s*(\d+(?:\.\d+)?)?\s*["″]?\s*([NSEWnsew])"""
)
_WESTERN = "°²³µäöüßÄÖÜéèêàåøæÅØÆçñ"
_BLANK = ("", "nan", "na", "n/a", "-", "--", "null", "none", "inf")


@dataclass(frozen=True)
class Recording:
    """A trial as read: SI, on its own clock from the first row.

    Attributes
    ----------
    file : The file.
    channels : Records by channel.
    headers : Channel -> header of its column.
    rows : File row of each time of the record, for findings: (times, rows).
    time_sigma : Standard error of the stamps [s].
    zero : First stamp as it stands, where it is a number of seconds; zero for times of day.
    place : North and east of the stated position at the execute [m]; None where none is stated.
    assumed : What was found or taken for granted.
    findings : What is wrong with it.
    """

    file: str
    channels: dict[str, Record]
    headers: dict[str, str]
    rows: tuple[Array, NDArray[np.int64]]
    time_sigma: float
    assumed: tuple[str, ...]
    findings: tuple[Finding, ...] = field(default=())
    zero: float = 0.0
    place: tuple[float, float] | None = None

    def row_at(self, time: float) -> int:
        """File row of the sample nearest a time."""
        return int(self.rows[1][int(np.argmin(np.abs(self.rows[0] - time)))])

    def with_(self, **changes: object) -> Recording:
        """The same with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]


def _source(path: Path, spec: TrialFile) -> Source:
    """How the file is to be opened; a header below titles, or in front of white-space columns, is found."""
    given = {k: getattr(spec, k) for k in _AS_WRITTEN}
    if given["encoding"] == "utf-8" and _western(path):
        given["encoding"] = "cp1252"
    source = Source(files=path.name, **given)
    reader = reader_of(path, source)
    if spec.names and reader in ("table", "columns"):
        return _without_header(path, source, spec)
    for key in _AS_WRITTEN:
        if getattr(spec, key) != getattr(TrialFile(), key) and key not in LOOKED_AT.get(reader, ()):
            allowed = f"no such key: a file of the kind {reader} is not read by it"
            raise InputError(f"{path}, trial.toml, key {key}", "stated, and changes nothing", allowed)
    if spec.header_pattern or reader not in ("table", "columns"):
        return source
    columns = reader == "columns"
    lines = head(path, source.encoding, (), source.skip).text
    if not columns and not spec.delimiter and _below_a_title(lines):
        # The commas are those of a title: the columns are parted by blanks.
        source, columns = source.model_copy(update={"reader": "columns"}), True
    mark = next((m for m in (";", "\t", ",") if not columns and any(m in t for t in lines[:_TITLES])), None)
    named = [i for i, line in enumerate(lines[:_TITLES]) if _names(line, mark) >= 2]
    if not columns:
        # A header behind a comment sign, below titles that have none, is the last line that names channels.
        at = next((i for i in named if not lines[i].lstrip().startswith(COMMENTS)), named[-1] if named else 0)
        above = [t for t in lines[:at] if not t.lstrip().startswith(COMMENTS) and not t.startswith("sep=")]
        if not above:
            return source
        if mark and lines[at].lstrip().startswith(COMMENTS) and named:
            header = [cell.strip(' "#%!') for cell in lines[at].split(mark)]
            return source.model_copy(update={"reader": "columns", "names": header, "delimiter": mark})
        return source.model_copy(update={"header_pattern": _exactly(lines[at]), "delimiter": mark})
    if not named:
        allowed = "a header with the names of the columns; or names = [...] or header_pattern in trial.toml"
        raise InputError(str(path), "columns without a header that names channels", allowed)
    return source.model_copy(update={"header_pattern": _exactly(lines[named[-1]])})


def _in_words_of_a_trial(error: InputError) -> InputError:
    """An error of the reader of campaigns, its remedy where a trial is stated."""
    allowed = re.sub(r'ignore = \["(.*?)"\]', r'[channels] "\1" = "-"', error.allowed)
    allowed = allowed.replace("[[source]]", "trial.toml")
    if "stands twice" in error.found:
        allowed = 'each column once: one record a file; or names = ["t [s]", "psi [deg]", "-", ...] in trial.toml '
        allowed += 'with "-" for the columns of the other run, where two stand side by side'
    return InputError(error.where, error.found, allowed)


def _without_header(path: Path, source: Source, spec: TrialFile) -> Source:
    """How a file is opened whose columns are named in ``trial.toml``; titles above the numbers are passed over."""
    numbers = [line for line in head(path, source.encoding, (), source.skip).text if re.search(r"\d", line)]
    marks = (m for m in (";", ",") if numbers and numbers[-1].count(m) >= len(spec.names) - 1)
    names = [name if name.strip() not in ("", "-") else f"column {i + 1}" for i, name in enumerate(spec.names)]
    delimiter: str = spec.delimiter
    delimiter = delimiter or next(marks, "")
    return source.model_copy(update={"reader": "columns", "names": names, "delimiter": delimiter})


def _western(path: Path) -> bool:
    """Whether a text is no UTF-8, and its only further bytes are single letters and signs of Western Europe."""
    text = path.read_bytes()
    if text.isascii() or b"\0" in text:
        return False
    try:
        text.decode("utf-8")
    except UnicodeDecodeError:
        further = re.findall(rb"[\x80-\xff]+", text)
        return all(len(one) == 1 and one.decode("cp1252", "replace") in _WESTERN for one in further)
    return False


def _below_a_title(lines: list[str]) -> bool:
    """Whether no line parted by a delimiter names channels, and one parted by blanks does, with numbers below."""
    marks = [m for m in (";", "\t", ",") if any(m in t for t in lines[:_TITLES])]
    if any(_names(line, m) >= 2 for m in marks for line in lines[:_TITLES]):
        return False
    at = next((i for i, line in enumerate(lines[:_TITLES]) if _names(line, None) >= 2), -1)
    return at > 0 and not any(m in lines[-1] for m in marks)


def _names(line: str, mark: str | None) -> int:
    """How many cells of a line name a channel."""
    cells = line.split(mark) if mark else re.split(r"[\s\[\](),;]+", line)
    return sum(bool(channel_of(split(c.strip(' "#'))[0]) or channel_of(c.strip(' "#'))) for c in cells)


def _exactly(line: str) -> str:
    """An expression for one line, by its first characters where it is a long one."""
    return "^" + re.escape(line[:_EXACTLY]) + ("$" if len(line) <= _EXACTLY else "")


def _cells(sheet: Sheet) -> tuple[list[int], list[list[str]]]:
    rows: list[int] = []
    cells: list[list[str]] = []
    for row, one in sheet.cells():
        rows.append(row)
        cells.append(one)
        if len(rows) > _MOST_ROWS:
            raise InputError(f"{sheet.path}, row {row}", "more rows", f"at most {_MOST_ROWS} of one maneuver")
    if len(rows) < 2:
        raise InputError(str(sheet.path), f"{len(rows)} rows below the header", "a record of two rows or more")
    return rows, cells


def _units_below(sheet: Sheet, cells: list[list[str]]) -> list[str] | None:
    """The first row where it holds units and no number: headers with them; None where it does not."""
    return _with_units(sheet, cells[0])


def _with_units(sheet: Sheet, first: list[str]) -> list[str] | None:
    """Headers with the units of a row; None where it is no row of units."""
    if (
        len(first) != len(sheet.header)
        or any(sheet.dialect.number(c) is not None or parsed(c, None) is not None for c in first)
        or not any(first)
    ):
        return None
    units = [c.strip("[]() ") for c in first]
    if not all(u in ("", "-") or is_unit(u) or is_unit(u.lower()) for u in units):
        return None
    return [h if u in ("", "-") else f"{h} [{u}]" for h, u in zip(sheet.header, units, strict=True)]


def _units_passed(path: Path, source: Source, sheet: Sheet, first_row: int) -> tuple[int, list[str]] | None:
    """A row of units between the header of white-space columns and their first numbers."""
    if reader_of(path, source) != "columns":
        return None
    lines = head(path, source.encoding, (), source.skip)
    above = [(row, text.split()) for row, text in zip(lines.rows, lines.text, strict=True) if row < first_row]
    headers = ((row, _with_units(sheet, cells)) for row, cells in reversed(above))
    return next(((row, header) for row, header in headers if header and any(h.endswith("]") for h in header)), None)


def read_recording(path: Path, spec: TrialFile) -> Recording:
    """Read a record of a maneuver.

    Parameters
    ----------
    path : Any table a campaign reads: CSV with any delimiter and decimal mark, columns, Parquet.
        Wide, a column a channel; or long, with the columns channel, t, value, unit.
    spec : What the file does not say.

    Raises
    ------
    InputError
        For a file that cannot be read, without time or channel, or with a unit missing.
    """
    if not path.is_file():
        raise InputError(str(path), "no such file", "a table with a time column and a column a channel")
    try:
        source = _source(path, spec)
        sheet = open_sheet(path, source)
        rows, cells = _cells(sheet)
    except InputError as error:
        raise _in_words_of_a_trial(error) from error
    header, said = list(sheet.header), []
    if source.encoding != spec.encoding:
        said.append(f"no UTF-8: read as {source.encoding}")
    below = _units_below(sheet, cells)
    if below:
        header, rows, cells = below, rows[1:], cells[1:]
        said.append(f"row {sheet.first_row}: units of the columns")
    elif passed := _units_passed(path, source, sheet, rows[0]):
        row, header = passed
        said.append(f"row {row}: units of the columns")
    if all(word in [plain(h) for h in header] for word in _LONG):
        return _long(sheet, header, rows, cells, spec, said)
    return _wide(sheet, header, rows, cells, spec, said)


def _meanings(sheet: Sheet, header: list[str], spec: TrialFile, said: list[str]) -> list[Meaning | None]:
    for key in spec.channels:
        if key not in header and key not in [h.partition(" [")[0] for h in header]:
            raise InputError(f"{sheet.path}, key channels", f"no column {key!r}", ", ".join(header)[:200])
    meanings = [meaning(h, spec.channels.get(h, spec.channels.get(h.partition(" [")[0])), sheet.where) for h in header]
    if sum(f is not None and f.channel == "z" for f in meanings) > 1:
        # A depth of the sail top beside that of the boat, as ``ident fly`` writes: one depth is enough.
        for i, f in enumerate(meanings):
            if f is not None and f.channel == "z" and plain(f.header).startswith("d0"):
                said.append(f"{f.header}: not used, z is the depth")
                meanings[i] = None
    for one in (f for f in meanings if f is not None):
        twice = [f.header for f in meanings if f is not None and f.channel == one.channel]
        if len(twice) > 1:
            text = f'one column a channel; leave one out in trial.toml: [channels] "{twice[1]}" = "-"'
            raise InputError(sheet.where, f"{' and '.join(map(repr, twice))} both hold {one.channel}", text)
        if one.assumed:
            said.append(one.assumed)
    unused = [h for h, f in zip(header, meanings, strict=True) if f is None and h not in sheet.spacers]
    if unused:
        said.append(f"columns not used: {', '.join(unused)[:200]}")
    return meanings


def _wide(
    sheet: Sheet, header: list[str], rows: list[int], cells: list[list[str]], spec: TrialFile, said: list[str]
) -> Recording:
    columns = _meanings(sheet, header, spec, said)
    clock = next((i for i, f in enumerate(columns) if f is not None and f.channel == "t"), None)
    if clock is None:
        text = 'a column of time (t [s], time, UTC), or trial.toml: [channels] "NAME" = "t [s]"; '
        text += "names = [...] of a file without a header"
        raise InputError(sheet.where, f"no time among {', '.join(header)[:160]}", text)
    one = columns[clock]
    assert one is not None
    raw = [parsed(c[clock], sheet.dialect.number(c[clock])) for c in cells]
    bad = next((i for i, v in enumerate(raw) if v is None or not math.isfinite(v)), None)
    if bad is not None:
        place = f"{sheet.path}, row {rows[bad]}, column {one.header}"
        raise InputError(place, repr(cells[bad][clock][:40]), "seconds, hh:mm:ss, or an ISO date and time")
    as_clock = sheet.dialect.number(cells[0][clock]) is None
    if as_clock and one.assumed in said:
        said.remove(one.assumed)
    times = stamps(
        [c[clock] for c in cells],
        np.array(raw, dtype=float),
        1.0 if as_clock else one.factor,
        str(sheet.path),
        rows,
        one.header,
    )
    said += times.said
    zero = 0.0 if as_clock else float(raw[0] or 0.0) * one.factor
    channels, headers = {}, {"t": one.header}
    for i, what in enumerate(columns):
        if what is None or i == clock:
            continue
        value = _numbers(sheet, rows, cells, i, what)
        kept = np.isfinite(value)
        if kept.sum() >= 2:
            channels[what.channel] = Record(what.channel, times.time[kept], value[kept] * what.factor, what.unit)
            headers[what.channel] = what.header
    if not channels:
        raise InputError(sheet.where, f"no channel among {', '.join(header)[:160]}", "a heading, pitch, heel or track")
    return Recording(
        str(sheet.path), channels, headers, (times.time, np.array(rows)), times.sigma, tuple(said), times.findings, zero
    )


def _position(cell: str) -> float | None:
    """Degrees of ``43°06.135'N`` or ``43 06 08.1 N``, negative to the south and west."""
    coordinate = _DEGREES.fullmatch(cell.strip().replace(",", "."))
    if not coordinate:
        return None
    minutes, seconds = float(coordinate[2] or 0.0), float(coordinate[3] or 0.0)
    size = float(coordinate[1]) + minutes / 60.0 + seconds / 3600.0
    return -size if coordinate[4].upper() in "SW" else size


def _numbers(sheet: Sheet, rows: list[int], cells: list[list[str]], column: int, what: Meaning) -> Array:
    """A column as numbers; NaN where a cell is blank."""
    out = np.full(len(cells), np.nan)
    for k, one in enumerate(cells):
        value = sheet.dialect.number(one[column])
        if value is None and what.channel in ("lat", "lon"):
            value = _position(one[column])
        if value is not None:
            out[k] = value
        elif one[column].strip().lower() not in _BLANK:
            place = f"{sheet.path}, row {rows[k]}, column {what.header}"
            raise InputError(place, repr(one[column][:40]), "a finite number, or nothing where there is no sample")
    return out


def _long(
    sheet: Sheet, header: list[str], rows: list[int], cells: list[list[str]], spec: TrialFile, said: list[str]
) -> Recording:
    """A table of one row a sample: channel, t, value, unit."""
    words = [plain(h) for h in header]
    at = {name: words.index(name) for name in _LONG}
    clock = next((i for i, w in enumerate(words) if w in _TIMES or channel_of(w) == "t"), None)
    if clock is None:
        raise InputError(sheet.where, f"no time among {', '.join(header)[:160]}", "a column t or time [s]")
    named = words.index("source") if "source" in words else None
    sources = list(dict.fromkeys(c[named] for c in cells)) if named is not None else []
    if len(sources) > 1:
        raise InputError(
            f"{sheet.path}, column source", f"{len(sources)} sources: {', '.join(sources)[:120]}", "one trial a file"
        )
    used = {clock, named, *at.values()}
    said += [f"column not used: {h}" for i, h in enumerate(header) if i not in used and h.strip()]
    channels, headers, findings = {}, {"t": header[clock]}, []
    everything: list[tuple[Array, list[int]]] = []
    for name in dict.fromkeys(c[at["channel"]] for c in cells):
        mine = [i for i, c in enumerate(cells) if c[at["channel"]] == name]
        unit = cells[mine[0]][at["unit"]]
        other = next((i for i in mine if cells[i][at["unit"]].strip() != unit.strip()), None)
        if other is not None:
            where, shown = f"{sheet.path}, row {rows[other]}, column unit", repr(cells[other][at["unit"]][:40])
            raise InputError(where, shown, f"{unit!r}, as in row {rows[mine[0]]}: one unit a channel")
        what = meaning(f"{name} [{unit}]", spec.channels.get(name), f"{sheet.path}, row {rows[mine[0]]}")
        if what is None:
            said.append(f"channel not used: {name}")
            continue
        place = [rows[i] for i in mine]
        raw = [parsed(cells[i][clock], sheet.dialect.number(cells[i][clock])) for i in mine]
        bad = next((i for i, v in enumerate(raw) if v is None), None)
        if bad is not None:
            raise InputError(
                f"{sheet.path}, row {place[bad]}, column {header[clock]}", repr(cells[mine[bad]][clock]), "a time"
            )
        first = np.array(raw, dtype=float)
        times = stamps([cells[i][clock] for i in mine], first, 1.0, str(sheet.path), place, header[clock])
        value = _numbers(sheet, place, [cells[i] for i in mine], at["value"], what)
        kept = np.isfinite(value)
        channels[what.channel] = Record(
            what.channel, (times.time + first[0])[kept], value[kept] * what.factor, what.unit
        )
        headers[what.channel] = name
        said += [s for s in times.said if s not in said]
        findings += list(times.findings)
        everything.append((times.time + first[0], place))
    if not channels:
        raise InputError(f"{sheet.path}, column channel", "no channel that is known", "psi, r, u, x, y, ...")
    zero = min(float(r.abscissa[0]) for r in channels.values())
    channels = {k: r.moved(zero) for k, r in channels.items()}
    stamps_of = max(everything, key=lambda e: e[0].size)
    rows_of = (stamps_of[0] - zero, np.array(stamps_of[1]))
    return Recording(str(sheet.path), channels, headers, rows_of, 0.0, tuple(said), tuple(findings), zero)
