"""LabVIEW: TDMS by the library nptdms, and the text files LVM."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from ident.captive.quantities import known_unit
from ident.captive.readers.arrays import array_sheet, chosen, needs, of_one_length, with_units
from ident.captive.readers.sheet import Sheet
from ident.captive.readers.table import open_csv
from ident.captive.readers.text import head
from ident.captive.source import Source
from sim.files.errors import InputError

_END = "***End_of_Header***"


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
    except (ValueError, OSError, KeyError, EOFError, TypeError, IndexError) as error:
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

    Raises
    ------
    InputError
        For a file without the end of its header, or with more than one block of data.
    """
    first = head(path, source.encoding)
    ends = [i for i, line in enumerate(first.text) if line.startswith(_END)]
    if not ends:
        raise InputError(str(path), f"no line {_END}", "a LabVIEW measurement file with its header")
    words = dict(p for line in first.text for p in [line.rstrip("\t").partition("\t")[::2]] if p[1])
    separator = {"Tab": "\t", "Comma": ","}.get(words.get("Separator", "Tab").strip(), "\t")
    decimal = words.get("Decimal_Separator", ".").strip()[:1] or "."
    names = first.text[ends[-1] + 1] if ends[-1] + 1 < len(first.text) else ""
    layout = {"header_pattern": "^" + re.escape(names[:120]), "delimiter": separator}
    layout |= {} if source.decimal else {"decimal": decimal}
    skip = source.skip or r"\*\*\*End_of_Header\*\*\*"
    sheet = open_csv(path, source.model_copy(update={**layout, "skip": skip}))
    if "X_Value" in sheet.header and sheet.header.count("X_Value") > 1:
        raise InputError(
            sheet.where, "an X_Value for each channel", "one X column (X_Columns One), or a file a channel"
        )
    units = next((line for line in reversed(first.text[: ends[-1]]) if line.startswith("Y_Unit_Label")), "")
    stated = [u.strip() for u in units.split(separator)[1:]]
    at = 1 if sheet.header[:1] == ["X_Value"] else 0
    beside = [""] * at + [u if known_unit(u) else "" for u in stated]
    beside += [""] * (len(sheet.header) - len(beside))
    return replace(sheet, header=with_units(sheet.header, beside[: len(sheet.header)], source))
