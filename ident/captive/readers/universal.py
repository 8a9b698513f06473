"""Universal files (UFF, UNV): functions of dataset 58, as Simcenter Testlab and other analysers export them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ident.captive.readers.arrays import array_sheet, needs, with_units
from ident.captive.readers.sheet import Sheet
from ident.captive.source import Source
from sim.files.errors import InputError

# Dataset of functions at nodes, and its function type for a time history (0: not said).
_FUNCTIONS, _TIMES = 58, (0, 1)
# Where a channel has its name, in the order of preference.
_NAMES = ("rsp_ent_name", "id1", "ordinate_axis_lab", "id2")
_NOTHING = ("", "none", "noname")


def open_universal(path: Path, source: Source) -> Sheet:
    """The time histories of dataset 58, ASCII or binary: a column a channel and ``time [s]``.

    A channel is called by its response entity, else by its first line of identification, else by the label of
    its ordinate: the first of these that tells all of them apart. Its unit is that of the ordinate.

    Raises
    ------
    InputError
        For a file that is not universal, has no time history, or several clocks.
    """
    pyuff = needs("pyuff", "readers", path, "a universal file")
    try:
        stored = pyuff.UFF(str(path)).read_sets()
    except Exception as error:
        raise InputError(str(path), f"not a universal file: {str(error)[:100]}", "a whole file") from error
    sets = [stored] if isinstance(stored, dict) else list(stored)
    functions = [one for one in sets if one.get("type") == _FUNCTIONS]
    histories = [one for one in functions if int(one.get("func_type", 0)) in _TIMES]
    if not histories:
        kinds = ", ".join(sorted({str(one.get("type")) for one in sets})) or "nothing"
        raise InputError(str(path), f"datasets {kinds}, no time history", "functions of dataset 58, type time response")
    clock = np.asarray(histories[0]["x"], dtype=float)
    for one in histories[1:]:
        other = np.asarray(one["x"], dtype=float)
        if other.shape != clock.shape or not np.allclose(other, clock, rtol=0.0, atol=1e-9 * max(abs(clock[-1]), 1.0)):
            raise InputError(str(path), "channels of different clocks", "one clock for all channels of a file")
    columns = [np.asarray(one["data"]) for one in histories]
    if any(np.iscomplexobj(c) and np.abs(c.imag).max() > 0.0 for c in columns):
        raise InputError(str(path), "complex values", "time histories, not spectra")
    units = [
        "" if _word(one, "ordinate_axis_units_lab") == "" else _word(one, "ordinate_axis_units_lab")
        for one in histories
    ]
    header = ["time [s]", *with_units(_names(path, histories), units, source)]
    return array_sheet(path, header, [clock, *(c.real.astype(float) for c in columns)], source)


def _word(one: dict[str, Any], key: str) -> str:
    text = str(one.get(key, "") or "").strip()
    return "" if text.lower() in _NOTHING else text


def _names(path: Path, histories: list[dict[str, Any]]) -> list[str]:
    """A name for each channel."""
    for key in _NAMES:
        names = [_word(one, key) for one in histories]
        if all(names) and len(set(names)) == len(names):
            return names
    places = [f"{int(one.get('rsp_node', 0))}:{int(one.get('rsp_dir', 0))}" for one in histories]
    if len(set(places)) < len(places):
        raise InputError(str(path), "channels without names of their own", "a name, or a node and direction, a channel")
    return places
