"""LabVIEW: TDMS by the library nptdms, and the text files LVM."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.captive.quantities import known_unit
from ident.captive.readers.arrays import array_sheet, chosen, joined, needs, of_one_length, take_pairs, with_units
from ident.captive.readers.sheet import Sheet
from ident.captive.readers.table import open_csv
from ident.captive.readers.text import Dialect, blocks, head
from ident.captive.source import Source
from sim.files.errors import InputError

_END = "***End_of_Header***"
_ABSCISSA = "X_Value"


def open_tdms(path: Path, source: Source) -> Sheet:
    """The channels of one group; ``table`` names it where several hold channels.

    The unit of a channel is its property ``unit_string``. Where the channels are waveforms and none is
    called time, a column ``time [s]`` is made from their start offset and increment.

    Raises
    ------
    InputError
        For a file that is not TDMS or is cut short, or waveforms of different increments.
    """
    nptdms = needs("nptdms", "readers", path, "a LabVIEW TDMS file")
    try:
        with nptdms.TdmsFile.open(str(path)) as opened:
            groups = {
                g.name: {c.name: (np.asarray(c[:]), dict(c.properties)) for c in g.channels() if len(c)}
                for g in opened.groups()
            }
    except Exception as error:
        # The library checks little of what it reads: unpacking, looking up and converting fail each in their way.
        raise InputError(str(path), f"not a TDMS file: {str(error)[:100]}", "a whole file") from error
    filled = [n for n, channels in groups.items() if any(len(v) > 1 for v, _ in channels.values())]
    name = chosen(path, filled, source, "group")
    channels = groups[name]
    named = with_units(list(channels), [_unit(p) for _, p in channels.values()], source)
    whole = of_one_length(path, dict(zip(named, (v for v, _ in channels.values()), strict=True)), source)
    header, columns = list(whole), list(whole.values())
    longest = len(columns[0])
    waves = {
        (float(p.get("wf_start_offset", 0.0)), float(p["wf_increment"]))
        for v, p in channels.values()
        if p.get("wf_increment") and len(v) == longest
    }
    if waves and not any(re.match(r"(?i)time\b", h) for h in header) and "time" not in source.columns.values():
        if len(waves) > 1:
            raise InputError(
                f"{path}, group {name}", f"{len(waves)} different increments", "one clock, or one group each"
            )
        offset, step = waves.pop()
        header, columns = ["time [s]", *header], [offset + step * np.arange(longest), *columns]
    return array_sheet(path, header, columns, source)


def _unit(properties: dict[str, object]) -> str:
    """The unit of a channel, under either of the names that LabVIEW gives it."""
    return str(properties.get("unit_string") or properties.get("NI_UnitDescription") or "")


def open_lvm(path: Path, source: Source) -> Sheet:
    """A LabVIEW measurement file: the table below its last header, tabs or commas and units as the header says.

    Where the column X_Value is left empty (X_Columns No), it is made of the header's X0 and Delta_X; channels with
    an X_Value each (X_Columns Multi) are joined where all of them have one.

    Raises
    ------
    InputError
        For a file without the end of its header, with more than one block of data, or channels of several increments.
    """
    first = head(path, source.encoding)
    ends = [i for i, line in enumerate(first.text) if line.startswith(_END)]
    if not ends:
        raise InputError(str(path), f"no line {_END}", "a LabVIEW measurement file with its header")
    words = dict(p for line in first.text for p in [line.rstrip("\t").partition("\t")[::2]] if p[1])
    separator = {"Tab": "\t", "Comma": ","}.get(words.get("Separator", "Tab").strip(), "\t")
    decimal = source.decimal or words.get("Decimal_Separator", ".").strip()[:1] or "."
    names = first.text[ends[-1] + 1] if ends[-1] + 1 < len(first.text) else ""
    # What the last header says of each channel.
    said = {line.split(separator)[0]: line.split(separator)[1:] for line in first.text[: ends[-1]]}
    units = [u.strip() if known_unit(u.strip()) else "" for u in said.get("Y_Unit_Label", [])]
    if names.split(separator).count(_ABSCISSA) > 1:
        return _own_abscissae(path, source, first.rows[ends[-1] + 1], Dialect(separator, decimal), units)
    layout = {"header_pattern": "^" + re.escape(names[:120]), "delimiter": separator, "decimal": decimal}
    skip = source.skip or re.escape(_END)
    sheet = open_csv(path, source.model_copy(update={**layout, "skip": skip}))
    beside = [""] * (sheet.header[:1] == [_ABSCISSA]) + units
    beside += [""] * (len(sheet.header) - len(beside))
    below = first.text[ends[-1] + 2] if ends[-1] + 2 < len(first.text) else ""
    if sheet.header[:1] == [_ABSCISSA] and below.startswith(separator):
        sheet = _with_clock(sheet, said, decimal)
    return replace(sheet, header=with_units(sheet.header, beside[: len(sheet.header)], source))


def _with_clock(sheet: Sheet, said: dict[str, list[str]], decimal: str) -> Sheet:
    """A sheet whose first column, left empty, is the time that the header states."""
    stated = {key: {w.strip() for w in said.get(key, []) if w.strip()} for key in ("X0", "Delta_X")}
    numbers = {key: [Dialect(decimal=decimal).number(w) for w in values] for key, values in stated.items()}
    if any(len(values) != 1 or values[0] is None for values in numbers.values()):
        wrong = f"an empty {_ABSCISSA}, and X0 {sorted(stated['X0'])}, Delta_X {sorted(stated['Delta_X'])}"
        raise InputError(sheet.where, wrong[:150], "one start and one increment for all channels")
    start, step = float(numbers["X0"][0] or 0.0), float(numbers["Delta_X"][0] or 0.0)

    def values(wanted: list[int], clock: int = -1) -> Iterator[NDArray[np.float64]]:
        measured = [i for i in wanted if i != 0]
        done = 0
        for block in sheet.numbers(measured, clock if clock != 0 else -1):
            whole = np.empty((len(block), len(wanted)))
            whole[:, [k for k, i in enumerate(wanted) if i != 0]] = block
            whole[:, [k for k, i in enumerate(wanted) if i == 0]] = (start + step * np.arange(done, done + len(block)))[
                :, None
            ]
            done += len(block)
            yield whole

    return replace(sheet, numbers=values)


def _own_abscissae(path: Path, source: Source, header_row: int, dialect: Dialect, units: list[str]) -> Sheet:
    """Channels with an X_Value each, joined where all of them have one."""
    names: list[str] = []
    blank: list[str] = []
    series: list[dict[float, float]] = []
    for block in blocks(path, source.encoding, skip=source.skip):
        for row, line in zip(block.rows, block.text, strict=True):
            cells = [cell.strip() for cell in line.split(dialect.delimiter)]
            if row < header_row:
                continue
            if row == header_row:
                names = [cells[k + 1] for k, cell in enumerate(cells[:-1]) if cell == _ABSCISSA]
                series = [{} for _ in names]
                blank = [cell for cell in cells[2 * len(names) :] if cell]
                continue
            if any(cells[2 * len(names) + len(blank) :]):
                most = f"at most {2 * len(names) + len(blank)}, as in the header"
                raise InputError(f"{path}, row {row}", f"{len(cells)} cells", most)
            take_pairs(f"{path}, row {row}", cells, list(zip(names, series, strict=True)), dialect, _ABSCISSA)
    if not any(series):
        raise InputError(str(path), "no numbers", "rows below the header")
    # A unit stands below its channel, nothing below its abscissa.
    beside = (units[::2] if not any(units[1::2]) else units) + [""] * len(names)
    header = with_units(names, beside[: len(names)], source)
    return joined(path, [_ABSCISSA, *header], series, source, header_row, blank)
