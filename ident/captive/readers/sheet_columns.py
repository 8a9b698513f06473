"""What every column of a table is: a quantity with its unit and factor, text, or nothing that counts."""

from __future__ import annotations

import re
from dataclasses import replace

from ident.captive.headers import column, refuse_both_ways
from ident.captive.patterns import search
from ident.captive.quantities import Column, owner, split
from ident.captive.readers.sheet import Sheet, ignored
from ident.captive.source import Source
from sim.files.errors import InputError


def position(sheet: Sheet, name: str) -> int:
    """Where a column of ``[[source.subtract]]`` stands, by its whole header or the header without its unit.

    Raises
    ------
    InputError
        When there is none.
    """
    for names in (sheet.header, [split(h)[0] for h in sheet.header]):
        if name in names:
            return names.index(name)
    shown = ", ".join(sheet.header)[:200]
    raise InputError(sheet.where, f"no column {name[:60]!r}, which [[source.subtract]] names", shown)


def columns_of(sheet: Sheet, source: Source, text: tuple[str, ...]) -> list[Column | None]:
    """What every column of a sheet is; None for ignored and text columns.

    Parameters
    ----------
    sheet : The open table.
    source : Its ``columns``, ``patterns`` and ``ignore``; columns of ``subtract`` are passed over.
    text : Names of the text columns of a run table.

    Raises
    ------
    InputError
        For an unknown column or unit, a pattern that fits no or several columns, or two
        columns of one quantity.
    """
    by_pattern = _by_pattern(sheet, source)
    parts = {position(sheet, name) for one in source.subtract for name in one.columns}
    known: list[Column | None] = []
    for i, header in enumerate(sheet.header):
        name = split(header)[0]
        declared = by_pattern.get(header) or source.columns.get(header) or source.columns.get(name)
        if header in sheet.spacers:
            known.append(None)
        elif i in parts:
            if declared is not None:
                found_twice = f"column {header[:60]!r} in [[source.subtract]] and in [source.columns] or patterns"
                raise InputError(sheet.where, found_twice, "one of the two")
            known.append(None)
        elif (declared is None and (source.patterns or ignored(header, source))) or (declared or header) in text:
            known.append(None)
        else:
            read = column(header, declared, sheet.where, source.factor)
            times = _times(read, source, sheet.where)
            if source.rows == "runs" and times is read:
                refuse_both_ways(read, sheet.where)
            known.append(times)
    for key in source.columns:
        if key not in sheet.header and key not in [split(h)[0] for h in sheet.header]:
            shown = ", ".join(sheet.header)[:200]
            raise InputError(sheet.where, f"no column {key[:60]!r}, which [source.columns] names", shown)
    quantities = [c.quantity for c in known if c]
    for quantity in quantities:
        if quantities.count(quantity) > 1:
            raise InputError(sheet.where, f"{quantity} stands twice", "one column a quantity")
    return known


def _times(kind: Column, source: Source, where: str) -> Column:
    """A column with the factor that ``[source.factor]`` puts on it, by its header or its quantity."""
    names = [n for n in dict.fromkeys((kind.name, split(kind.name)[0], kind.quantity)) if n in source.factor]
    load = owner(kind.quantity)
    if not names and load in source.factor and kind.quantity != load:
        # A load's factor is its standard error's and its harmonics' as well.
        names = [load]
    if not names:
        return kind
    if len(names) > 1:
        raise InputError(f"{where}, column {kind.name[:60]!r}", f"factors under {' and '.join(names)}", "one factor")
    value = source.factor[names[0]]
    return replace(kind, factor=kind.factor * (abs(value) if kind.quantity.startswith("s_") else value))


def _by_pattern(sheet: Sheet, source: Source) -> dict[str, str]:
    """Header -> declared quantity, by the regular expressions of ``patterns``."""
    if not (source.patterns or source.columns) and any(re.search(r"\bMonitor\b", h) for h in sheet.header):
        text = "a table [source.patterns] that names the monitors, see docs/readers.md"
        raise InputError(sheet.where, "monitors without names", text)
    by_header: dict[str, str] = {}
    for pattern, quantity in source.patterns.items():
        fits = [h for h in sheet.header if search(pattern, h)]
        if len(fits) != 1 or fits[0] in by_header:
            shown = ", ".join(repr(h[:60]) for h in (fits or sheet.header)[:8])
            number = "no column fits" if not fits else "more than one fit"
            raise InputError(sheet.where, f"{number} pattern {pattern!r}", f"one column a pattern; here: {shown}")
        by_header[fits[0]] = quantity
    return by_header
