"""OpenFOAM ``forces`` function objects, every version by what its header says.

====================  ===========================================================
Foundation to 4,      ``forces.dat``: ``forces(pressure viscous porous) moment(...)``
OpenCFD to v1606
Foundation 5-8        ``forces.dat``: ``forces(...)``, tab, ``moments(...)``, perhaps local
Foundation 9-11       the same, porous only where there is porosity
Foundation 12 on      the same; ``movingForces.dat`` begins with a column ``CofR``
OpenCFD v1612-v2112   ``force.dat``, ``moment.dat``: ``(total_x total_y total_z)``, ...
OpenCFD v2206 on      the same without brackets
====================  ===========================================================

A header that says anything else is refused. Numbers are told apart by the names in the
header, never by their position; their count has to fit it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.captive.readers.text import Dialect, Lines, blocks, head, numbers
from sim.files.errors import InputError

Array = NDArray[np.float64]
LOADS = ("X", "Y", "Z", "K", "M", "N")
KNOWN = "the forces output of OpenFOAM Foundation 2.3 to 13 or OpenCFD v3.0 to v2412"

_VECTOR = r"\(\s*[-+\d.eE]+\s+[-+\d.eE]+\s+[-+\d.eE]+\s*\)"
_COFR = re.compile(rf"^#\s*CofR\s*:\s*({_VECTOR})\s*$")
_GROUP = re.compile(r"(forces|moments?|localForces|localMoments)\(([^()]*)\)")
_SPLIT = re.compile(r"\((\w+)_x \1_y \1_z\)|(?<!\()\b(\w+)_x \2_y \2_z\b(?!\))")
# A number as OpenFOAM writes it: so many digits, two of the exponent.
_WRITTEN = re.compile(r"-?\d\.(\d+)e[+-]\d\d")
_SHARES = ("total", "pressure", "viscous", "porous")
_BRACKETS = str.maketrans("()", "  ")
_PLAIN = Dialect(" ")
# A restarted run repeats a few time steps; more repeats mean stamps with too few digits.
_MOST_STEPS_BACK = 100_000


@dataclass(frozen=True)
class Layout:
    """What the header of one file says.

    Attributes
    ----------
    names : A name for every number of a row: ``time``, ``force_pressure_x``, ...
    forces, moments : Positions to add up to each component, (3, n); empty for none.
    totals : Positions of written totals, to be checked against the sums; empty for none.
    moving : Positions of the moment point; empty when it is fixed.
    centre : The fixed moment point (CofR) in mesh axes, None when it moves.
    """

    names: list[str]
    forces: Array
    moments: Array
    totals: Array
    moving: list[int]
    centre: Array | None


def read_layout(path: Path) -> Layout:
    """The layout of a ``forces.dat``, ``force.dat`` or ``moment.dat``.

    Raises
    ------
    InputError
        For a header of force coefficients, of bins, of a version that is not known.
    """
    first = head(path)
    comments = [(r, t.strip()) for r, t in zip(first.rows, first.text, strict=True) if t.lstrip().startswith("#")]
    columns = next(((r, t) for r, t in comments if re.match(r"#\s*Time\b", t)), None)
    titles = [t.lstrip("# ").strip() for _, t in comments]
    # A line of one's own may stand above the title.
    title = next((t for t in titles if t in ("Force", "Moment")), titles[0] if titles else "")
    if columns is None:
        raise InputError(f"{path}, row 1", "no line '# Time ...'", KNOWN)
    row, text = columns
    where = f"{path}, row {row} (header)"
    if any("oefficient" in t for t in titles) or re.search(r"\bC[dlm]\b", text):
        allowed = "forces: coefficients are divided by areas and lengths this campaign does not know"
        raise InputError(where, "force coefficients (forceCoeffs)", allowed)
    rest = re.sub(r"^#\s*Time\s*", "", text)
    centre = next((m for _, t in comments if (m := _COFR.match(t))), None)
    numbers = [_PLAIN.number(cell) for cell in centre[1].strip("() ").split()] if centre else []
    if centre and (None in numbers or not np.isfinite(np.array(numbers, dtype=float)).all()):
        raise InputError(where, centre[1][:80], "a moment point '# CofR : (x y z)' of numbers")
    point = np.array(numbers, dtype=float) if numbers else None
    if _GROUP.search(rest):
        return _grouped(where, rest, point)
    return _single(where, rest, title, point)


def _grouped(where: str, rest: str, point: Array | None) -> Layout:
    """``forces(pressure viscous) moments(pressure viscous)``, all versions of the Foundation."""
    names, moving = ["time"], []
    if rest.startswith("CofR"):
        moving, rest = [1, 2, 3], rest.removeprefix("CofR").strip()
        names += ["CofR_x", "CofR_y", "CofR_z"]
    groups = [(kind, inside, re.split(r"[\s,]+", inside.strip())) for kind, inside in _GROUP.findall(rest)]
    if _GROUP.sub("", rest).strip() or any(set(shares) - set(_SHARES[1:]) for _, _, shares in groups):
        raise InputError(where, f"unknown header {rest[:120]!r}", KNOWN)
    if any("," in inside for kind, inside, _ in groups if kind.startswith("local")):
        text = "forces without a coordinateSystem: this version writes the local loads on a second row of the same time"
        raise InputError(where, "loads in a local system", text)
    kinds = [kind for kind, _, _ in groups]
    if kinds[:2] not in (["forces", "moment"], ["forces", "moments"]) or kinds[2:] not in (
        [],
        ["localForces", "localMoments"],
    ):
        raise InputError(where, f"unknown header {rest[:120]!r}", KNOWN)
    at: dict[str, list[list[int]]] = {}
    for kind, _, shares in groups:
        starts = [len(names) + 3 * i for i in range(len(shares))]
        at[kind.rstrip("s")] = [[s + axis for s in starts] for axis in range(3)]
        names += [f"{kind}_{share}_{axis}" for share in shares for axis in "xyz"]
    return Layout(
        names,
        np.array(at["force"]),
        np.array(at["moment"]),
        np.zeros((3, 0), dtype=int),
        moving,
        None if moving else point,
    )


def _single(where: str, rest: str, title: str, point: Array | None) -> Layout:
    """``force.dat`` or ``moment.dat`` of OpenCFD, with or without brackets."""
    shares = [a or b for a, b in _SPLIT.findall(re.sub(r"[ \t]+", " ", rest))]
    left = _SPLIT.sub("", re.sub(r"[ \t]+", " ", rest)).strip()
    if (
        left
        or shares[:3] != list(_SHARES[:3])
        or shares[3:] not in ([], ["porous"])
        or title not in ("Force", "Moment")
    ):
        raise InputError(where, f"unknown header {title[:40]!r}, {rest[:120]!r}", KNOWN)
    names = ["time", *[f"{share}_{axis}" for share in shares for axis in "xyz"]]
    parts = np.array([[names.index(f"{share}_{axis}") for share in shares[1:]] for axis in "xyz"])
    totals = np.array([[names.index(f"total_{axis}")] for axis in "xyz"])
    none = np.zeros((3, 0), dtype=int)
    force = title == "Force"
    return Layout(names, parts if force else none, none if force else parts, totals, [], point)


def _rows(path: Path, layout: Layout) -> Iterator[tuple[int, Array]]:
    """First row and values of each block of a file, the count of numbers checked."""
    wanted = list(range(len(layout.names)))
    for block in blocks(path, comments=("#",)):
        if not block.ended and _cut(block.text[-1], len(wanted)):
            block = Lines(block.rows[:-1], block.text[:-1])
            if not block.rows:
                return
        text = []
        for row, line in zip(block.rows, block.text, strict=True):
            if line.count("(") != line.count(")"):
                raise InputError(f"{path}, row {row}", "brackets that do not close: a row cut short", "whole rows")
            text.append(line.translate(_BRACKETS))
        yield block.rows[0], numbers(path, Lines(block.rows, text), _PLAIN, wanted, layout.names)


def _cut(line: str, count: int) -> bool:
    """Whether the last line of a file, without its line end, may be cut short by a run that was killed.

    A bracket ends the last number; where there is none, it has to have as many digits as the one before.
    """
    cells = line.translate(_BRACKETS).split()
    if len(cells) != count or line.count("(") != line.count(")"):
        return True
    last, before = (_WRITTEN.fullmatch(cell) for cell in (cells[-1], cells[-2]))
    return not line.rstrip().endswith(")") and not (last and before and len(last[1]) == len(before[1]))


def _steps_back(path: Path, layout: Layout) -> tuple[float, list[tuple[int, float]]]:
    """First time of a file (infinite without rows), and (row number, time) wherever it repeats or goes back."""
    first, last, count = np.inf, -np.inf, 0
    back: list[tuple[int, float]] = []
    for row, values in _rows(path, layout):
        time = np.concatenate([[last], values[:, 0]])
        if not count:
            first = float(values[0, 0])
        back += [(count + int(i), float(time[i + 1])) for i in np.flatnonzero(np.diff(time) <= 0.0)]
        if len(back) > _MOST_STEPS_BACK:
            text = "time that moves on, a restart aside; write it with more digits (timePrecision)"
            raise InputError(f"{path}, row {row} or after", f"{len(back)} repeated times", text)
        last, count = float(values[-1, 0]), count + len(values)
    return first, back


def series(folder: Path, stems: tuple[str, ...]) -> list[Path]:
    """The files of one output over all restarts, oldest first.

    Parameters
    ----------
    folder : ``postProcessing/<function object>``.
    stems : Possible names: ``forces``, ``movingForces``, ``force``, ``moment``.
    """
    parts = []
    for start in folder.iterdir():
        if not (start.is_dir() and _time(start.name) is not None):
            continue
        for path in start.iterdir():
            stem, _, later = path.stem.partition("_")
            # A restart at the same time writes forces_<time>.dat beside forces.dat.
            if path.suffix == ".dat" and stem in stems and (not later or _time(later) is not None):
                parts.append((_time(start.name), later != "", _time(later) if later else 0.0, path))
    return [f[-1] for f in sorted(parts, key=lambda f: f[:3])]


def _time(name: str) -> float | None:
    try:
        value = float(name)
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def merged(paths: list[Path]) -> Iterator[tuple[Layout, Path, int, Array]]:
    """Rows over all restarts, time rising: a later start and a later repeat win.

    Yields
    ------
    Layout, file, first file row, values (rows, numbers) with the overtaken rows taken out.

    Raises
    ------
    InputError
        When no file has a row; a restart that ended before its first one is passed over.
    """
    paths = [p for p in paths if p.stat().st_size] or paths
    layouts = [read_layout(p) for p in paths]
    scans = [_steps_back(p, layout) for p, layout in zip(paths, layouts, strict=True)]
    if all(first == np.inf for first, _ in scans):
        raise InputError(str(paths[-1]), "no rows below the header", "at least one time step")
    for i, (path, layout) in enumerate(zip(paths, layouts, strict=True)):
        limit = min((first for first, _ in scans[i + 1 :]), default=np.inf)
        back = scans[i][1]
        # The least time that any later step back returns to.
        least = np.minimum.accumulate([t for _, t in back][::-1])[::-1] if back else np.zeros(0)
        starts = np.array([n for n, _ in back])
        count = 0
        for row, values in _rows(path, layout):
            number = np.arange(count, count + len(values))
            count += len(values)
            next_back = np.searchsorted(starts, number, side="right")
            cut = np.append(least, np.inf)[next_back]
            keep = values[:, 0] < np.minimum(cut, limit)
            if keep.any():
                yield layout, path, row, values[keep]


def loads(folder: Path, stated: Sequence[float] | None = None) -> Iterator[tuple[Array, Array, bool]]:
    """Loads of one function object, all shares added up.

    Parameters
    ----------
    folder : ``postProcessing/<function object>`` with one folder a start time.
    stated : CofR in mesh axes of files that name none, as foam-extend writes them.

    Yields
    ------
    values : (rows, 7) time, forces and moments along the mesh axes, as written.
    centre : (3,) moment point in mesh axes, or (rows, 3) where it moves.
    moving : Whether it moves.

    Raises
    ------
    InputError
        For an unknown layout, a missing file, times of force and moment that differ, or
        totals that are not the sum of their shares.
    """
    together = series(folder, ("forces", "movingForces"))
    if together:
        for layout, path, row, values in merged(together):
            if layout.forces.size == 0:
                raise InputError(f"{path}, row 1", "one group of loads", "forces and moments")
            columns = np.column_stack([values[:, 0], _sums(layout.forces, values), _sums(layout.moments, values)])
            moving = bool(layout.moving)
            centre = values[:, layout.moving] if moving else _point(layout, path, row, stated)
            yield columns, centre, moving
        return
    forces, moments = series(folder, ("force",)), series(folder, ("moment",))
    if not forces or len(forces) != len(moments):
        found_text = ", ".join(sorted(p.name for p in folder.glob("*/*.dat")))[:120] or "no .dat file"
        raise InputError(str(folder), found_text, "<start>/forces.dat, or force.dat and moment.dat")
    yield from _paired(forces, moments, stated)


def _point(layout: Layout, path: Path, row: int, stated: Sequence[float] | None) -> Array:
    """The moment point of the header, or the stated one where it names none."""
    if layout.centre is None and stated is None:
        text = "a line '# CofR : (x y z)', or cofr = [x, y, z] in [[source]]: the CofR of the function object"
        raise InputError(f"{path}, row {row}", "no moment point", text)
    if layout.centre is not None and stated is not None:
        wrong = f"cofr = {list(stated)} stated, and CofR {layout.centre} in the header"
        raise InputError(f"{path}, row 1 (header)", wrong, "cofr for files alone that name none")
    return np.array(stated, dtype=float) if layout.centre is None else layout.centre


def _sums(positions: Array, values: Array) -> Array:
    return np.stack([values[:, p].sum(axis=1) for p in positions], axis=1)


def _checked(layout: Layout, path: Path, row: int, values: Array) -> Array:
    """Sums of the shares, held against the written totals (printed with 6 digits or more)."""
    sums = _sums(layout.forces if layout.forces.size else layout.moments, values)
    totals = values[:, layout.totals[:, 0]]
    size = np.abs(values[:, 1:]).max(axis=1, keepdims=True)
    off = np.flatnonzero((np.abs(sums - totals) > 1e-3 * size).any(axis=1))
    if off.size:
        place = f"{path}, rows from {row}, time {values[off[0], 0]:g}, column total"
        raise InputError(place, "a total that is not pressure + viscous (+ porous)", "columns as the header says")
    return sums


def _paired(
    forces: list[Path], moments: list[Path], stated: Sequence[float] | None
) -> Iterator[tuple[Array, Array, bool]]:
    """``force.dat`` and ``moment.dat`` row by row; their times have to agree."""

    def checked(paths: list[Path], title: str) -> Iterator[tuple[Path, Array, Array]]:
        for layout, path, row, values in merged(paths):
            if (layout.forces.size > 0) != (title == "Force"):
                raise InputError(f"{path}, row 1", "the other of force and moment", f"# {title}")
            yield (
                path,
                np.column_stack([values[:, 0], _checked(layout, path, row, values)]),
                _point(layout, path, row, stated),
            )

    left, right = checked(forces, "Force"), checked(moments, "Moment")
    a: tuple[Path, Array, Array] | None = None
    b: tuple[Path, Array, Array] | None = None
    while True:
        a = a if a is not None and len(a[1]) else next(left, None)
        b = b if b is not None and len(b[1]) else next(right, None)
        if a is None and b is None:
            return
        if a is None or b is None:
            longer = a or b
            assert longer is not None
            # A run that is being written, or was killed, has one of the two files a row behind.
            if len(longer[1]) == 1 and next(left if a else right, None) is None:
                return
            place = f"{longer[0]}, time {longer[1][0, 0]:g}"
            raise InputError(place, "no row in the other file", "force.dat and moment.dat with the same times")
        n = min(len(a[1]), len(b[1]))
        off = np.flatnonzero(a[1][:n, 0] != b[1][:n, 0])
        if off.size:
            place = f"{b[0]}, time {b[1][off[0], 0]:g}"
            raise InputError(
                place, f"{a[1][off[0], 0]:g} in {a[0].name}", "force.dat and moment.dat with the same times"
            )
        if (a[2] != b[2]).any():
            raise InputError(str(b[0]), "another CofR than in force.dat", "one moment point")
        yield np.column_stack([a[1][:n], b[1][:n, 1:]]), a[2], False
        a, b = (a[0], a[1][n:], a[2]), (b[0], b[1][n:], b[2])


def objects(case: Path) -> dict[str, Path]:
    """The function objects of a case folder (or its ``postProcessing``) that wrote loads."""
    root = case / "postProcessing" if (case / "postProcessing").is_dir() else case
    names = ("forces", "movingForces", "force", "moment")
    if series(root, names):
        return {root.name: root}
    here = {p.name: p for p in sorted(root.iterdir()) if p.is_dir() and series(p, names)}
    # A case of several regions has a folder for each between.
    regions = [p for p in sorted(root.iterdir()) if p.is_dir() and p.name not in here and _time(p.name) is None]
    inside = [(r, p) for r in regions for p in sorted(r.iterdir()) if p.is_dir() and series(p, names)]
    several = len({r for r, _ in inside}) > 1 or bool(here)
    return here | {f"{r.name}/{p.name}" if several else p.name: p for r, p in inside}
