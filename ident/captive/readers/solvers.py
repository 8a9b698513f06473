"""Text files of flow solvers: Fluent, SU2, Tecplot, plots of STAR-CCM+ that have an abscissa each."""

from __future__ import annotations

import csv
import math
import re
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.captive.readers.arrays import array_sheet, chosen, joined, take_pairs
from ident.captive.readers.sheet import Sheet
from ident.captive.readers.table import open_columns, open_csv
from ident.captive.readers.text import Dialect, blocks, head
from ident.captive.source import Source
from sim.files.errors import InputError

_PLAIN = Dialect()
_FLUENT = re.compile(r'^\(\s*"[^"]*"(\s+"[^"]*")+\s*\)\s*$')


def fluent_header(lines: list[str]) -> int:
    """Which of the first lines is the header of a Fluent report file; -1 for none."""
    return next((i for i, line in enumerate(lines[:5]) if _FLUENT.match(line.strip())), -1)


def open_fluent(path: Path, source: Source) -> Sheet:
    """A report file of Fluent: two lines of titles, ``("Time Step" "flow-time" "force-x")``, numbers; or its XY plot.

    Raises
    ------
    InputError
        For a file without that line.
    """
    first = head(path, source.encoding, skip=source.skip)
    if is_xy(first.text):
        return _open_xy(path, source)
    at = fluent_header(first.text)
    if at < 0:
        raise InputError(str(path), 'no line ("..." "...") of names', "a report file as Fluent writes it")
    names = shlex.split(first.text[at].strip().strip("()"))
    return open_columns(path, source.model_copy(update={"names": names, "header_pattern": ""}))


def is_xy(lines: list[str]) -> bool:
    """Whether the first line is that of an XY plot file of Fluent."""
    return bool(lines) and re.match(r'\s*\(title\s+"', lines[0]) is not None


def _open_xy(path: Path, source: Source) -> Sheet:
    """``(labels "Iteration" "fx")``, then a curve each: ``((xy/key/label "fx")``, pairs of numbers, ``)``."""
    names: list[str] = []
    curves: dict[str, dict[float, float]] = {}
    text = ""
    for block in blocks(path, source.encoding, comments=("\0",), skip=source.skip):
        for row, line in zip(block.rows, block.text, strict=True):
            text = line.strip()
            if label := re.match(r'\(\(xy/key/label\s+"([^"]*)"\)', text):
                if label[1] in curves:
                    raise InputError(f"{path}, row {row}", f"curve {label[1]!r} twice", "a label a curve")
                curves[label[1]] = {}
            elif text.startswith("(labels"):
                names = re.findall(r'"([^"]*)"', text)
            elif curves and text not in ("(", ")"):
                pair = [_PLAIN.number(cell) for cell in text.split()]
                if len(pair) != 2 or pair[0] is None or pair[1] is None:
                    raise InputError(f"{path}, row {row}", repr(text[:40]), "an abscissa and a number")
                curves[list(curves)[-1]][pair[0]] = pair[1]
    if curves and text != ")" and (last := curves[list(curves)[-1]]):
        # Still being written, or cut: so may be its last number.
        last.popitem()
    if not names or not curves:
        raise InputError(str(path), "no (labels ...) or no curve", "an XY plot file as Fluent writes it")
    return joined(path, [names[0], *curves], list(curves.values()), source, 2)


def su2_header(lines: list[str]) -> list[str]:
    """The columns of an SU2 history, from the first of its lines; empty for any other file."""
    names = [name.strip().strip('"') for name in lines[0].split(",")] if lines else []
    return names if "Time_Iter" in names and "Inner_Iter" in names else []


def open_su2(path: Path, source: Source, opener: Callable[[Path, Source], Sheet] = open_csv) -> Sheet:
    """A convergence history of SU2; of an unsteady run the last inner iteration of each time step.

    Parameters
    ----------
    path, source : For the checks.
    opener : What reads its table; the campaign may have given its columns other names.

    Raises
    ------
    InputError
        For what the reader of tables refuses.
    """
    sheet = opener(path, source)
    own = su2_header(head(path, source.encoding).text)
    if len(own) != len(sheet.header):
        return sheet
    every = np.vstack(list(sheet.numbers(list(range(len(sheet.header))))))
    kept = _last_iterations(own, every)
    return sheet if kept is every else array_sheet(path, sheet.header, list(kept.T), source, sheet.first_row)


def _last_iterations(header: Sequence[str], every: NDArray[np.float64]) -> NDArray[np.float64]:
    """The last inner iteration of each time step of an SU2 history; all rows of anything else."""
    if "Time_Iter" not in header or "Inner_Iter" not in header:
        return every
    step = every[:, list(header).index("Time_Iter")]
    return every if np.unique(step).size < 2 else every[np.append(np.diff(step) != 0.0, True)]


def plots(rows: list[list[str]]) -> bool:
    """Whether a header has an abscissa for each plot: the same name before every monitor."""
    names = rows[0] if rows else []
    return len(names) >= 4 and len(names) % 2 == 0 and len(set(names[::2])) == 1 and names[0] not in names[1::2]


def open_plots(path: Path, source: Source, dialect: Dialect) -> Sheet:
    """Plots of STAR-CCM+ exported side by side: joined at the abscissae that all of them have.

    Raises
    ------
    InputError
        For a cell that is no number, or plots without a common abscissa.
    """
    lines: list[tuple[int, list[str]]] = []
    ended = True
    for block in blocks(path, source.encoding, skip=source.skip):
        lines += [
            (row, dialect.cells(line, f"{path}, row {row}")) for row, line in zip(block.rows, block.text, strict=True)
        ]
        ended = block.ended
    names = lines[0][1]
    plots: list[dict[float, float]] = [{} for _ in names[1::2]]
    # A row without line end may be cut.
    for row, cells in lines[1:] if ended else lines[1:-1]:
        if any(cells[len(names) :]):
            raise InputError(f"{path}, row {row}", f"{len(cells)} cells", f"at most {len(names)}, as in the header")
        take_pairs(f"{path}, row {row}", cells, list(zip(names[1::2], plots, strict=True)), dialect)
    return joined(path, [names[0], *names[1::2]], plots, source, lines[0][0])


def open_tecplot(path: Path, source: Source) -> Sheet:
    """An ASCII file of Tecplot: VARIABLES, and one ZONE (``table`` names its title), POINT or BLOCK.

    Raises
    ------
    InputError
        For a file without VARIABLES, several zones and none named, or numbers that do not fill the zone.
    """
    names: list[str] = []
    zones: dict[str, tuple[str, list[float], int]] = {}
    points: dict[str, dict[str, int]] = {}
    shared: set[str] = set()
    key, place = "", 0
    listing = False
    for block in blocks(path, source.encoding, comments=("#",), skip=source.skip):
        for row, line in zip(block.rows, block.text, strict=True):
            text = line.strip()
            word = text.split("=")[0].split()[0].upper() if text else ""
            if word == "VARIABLES" or (listing and text.startswith('"')):
                listing = True
                names += _names(text.partition("=")[2] if word == "VARIABLES" else text)
            elif word in ("TITLE", "DATASETAUXDATA", "FILETYPE", "VARAUXDATA", "AUXDATA"):
                listing = False
            elif word == "ZONE" or (key and not zones[key][1] and re.match(r"[A-Z]+\s*=", text)):
                listing = False
                if word == "ZONE":
                    title = re.search(r'\bT\s*=\s*"([^"]*)"', text)
                    key = title[1] if title else f"zone {len(zones) + 1}"
                    if key in zones:
                        raise InputError(f"{path}, row {row}", f"zone {key!r} twice", "a title a zone")
                    zones[key] = ("POINT", [], row)
                packed = re.search(r"(?i)(?:DATAPACKING|\bF)\s*=\s*(?:FE)?(POINT|BLOCK)", text)
                zones[key] = (packed[1].upper() if packed else zones[key][0], *zones[key][1:])
                if re.search(r"(?i)\b(VARSHARELIST|PASSIVEVARLIST)\s*=", re.sub(r'"[^"]*"', "", text)):
                    shared.add(key)
                sizes = re.findall(r"\b([IJK])\s*=\s*(\d+)", re.sub(r'"[^"]*"', "", text).upper())
                points.setdefault(key, {}).update({axis: int(size) for axis, size in sizes})
            else:
                if not names:
                    raise InputError(f"{path}, row {row}", repr(text[:40]), 'VARIABLES = "..." before any number')
                if not key:
                    key = "zone 1"
                    zones[key] = ("POINT", [], row)
                for cell in text.replace(",", " ").split():
                    # 400*1.5 stands for so many of it.
                    many, _, last = cell.rpartition("*")
                    value = _PLAIN.number(last)
                    if value is None or (many and not re.fullmatch(r"\d{1,7}", many)):
                        raise InputError(f"{path}, row {row}, zone {key}", repr(cell[:40]), "a finite number")
                    zones[key][1].extend([value] * int(many or 1))
            place = row
    name = chosen(path, list(zones), source, "zone")
    if name in shared:
        wrong = f"zone {name!r} leaves variables out (VARSHARELIST, PASSIVEVARLIST)"
        raise InputError(f"{path}, row {zones[name][2]}", wrong, "every variable in its zone")
    return _zone(path, name, names, zones[name], points.get(name, {}), place, source)


def _zone(
    path: Path,
    name: str,
    names: list[str],
    zone: tuple[str, list[float], int],
    sizes: dict[str, int],
    last: int,
    source: Source,
) -> Sheet:
    """The columns of one zone: packing, numbers and row of it, and its stated sizes."""
    packing, values, row = zone
    stated = math.prod(sizes.values()) * len(names) if sizes else len(values)
    if not names or not values or len(values) % len(names) or len(values) != stated:
        wrong = f"{len(values)} numbers for {len(names)} variables in zone {name!r}"
        raise InputError(f"{path}, rows {row} to {last}", wrong, "as many of each variable")
    table = np.array(values).reshape((-1, len(names)) if packing == "POINT" else (len(names), -1))
    rows = _last_iterations(names, table if packing == "POINT" else table.T)
    return array_sheet(path, names, list(rows.T), source, row + 1)


def _names(text: str) -> list[str]:
    # SU2 goes on in the next line behind a backslash.
    text = text.strip().removesuffix("\\")
    quoted = re.findall(r'"([^"]*)"', text)
    return [n.strip() for n in quoted] if quoted else [n for c in csv.reader([text]) for w in c for n in w.split()]
