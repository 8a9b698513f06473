"""A boat in a case as one C header and one C source, with everything in them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from numpy.typing import NDArray

from ident.exports.c_functions import Translation
from ident.exports.c_types import SCALARS, Block, Kind, Number, Several, constant, literal
from ident.output import check_folder, whole
from ident.text import in_file_name
from ident.validation.boats import Boat
from sim.boat.catalogue import STATES
from sim.flight import maneuver, orders
from sim.flight.case import Case
from sim.flight.plant import COMMANDS
from sim.flight.simulate import begun, samples_of
from sim.flight.trim import Trim
from sim.kernel.layout import Model, workspace
from sim.kernel.rhs import BEGUN, fill_rate
from sim.waves.in_waves import surroundings
from sim.waves.surroundings import AT_DRIFT, AT_PARTS, CREST, DRIFT, WAVES, prepare

Array = NDArray[Any]
_KINDS = {"f": {8: "d", 4: "f"}, "i": {8: "i"}}
_A_LINE = 6


@dataclass
class Members:
    """Arrays of Python as tables of the source and members of the structure.

    Attributes
    ----------
    tables : Definitions of what never changes. fields : Declarations of what a boat has of its own.
    starts : Values of those at the start, by name.
    """

    tables: list[str] = field(default_factory=list)
    fields: list[str] = field(default_factory=list)
    starts: dict[str, Array] = field(default_factory=dict)
    _places: list[tuple[int, int, str]] = field(default_factory=list)
    _alive: list[Array] = field(default_factory=list)

    def add(self, value: Any, name: str, fixed: bool = False) -> Kind:
        """The type of a value; arrays are written out, a view as a place in what it is a view of."""
        if isinstance(value, tuple):
            names = getattr(type(value), "_fields", ())
            parts = [self.add(v, f"{name}_{names[i] if names else i}", fixed) for i, v in enumerate(value)]
            return Several(tuple(parts), names)
        if not isinstance(value, np.ndarray):
            return constant(value).kind
        kind = _KINDS[value.dtype.kind][value.dtype.itemsize]
        shape, start = value.shape, value.__array_interface__["data"][0]
        for first, end, owner in self._places:
            if first <= start and start + value.nbytes <= end and value.nbytes:
                return Block(kind, shape, _place(owner, (start - first) // value.itemsize), fixed)
        flat = np.ascontiguousarray(value).ravel()
        if value.flags.c_contiguous:
            self._alive.append(value)
            member = name if fixed else f"boat->{name}"
            self._places.append((start, start + value.nbytes, member))
        if fixed:
            self.tables.append(table(f"static const {SCALARS[kind]} {name}", flat, kind))
        else:
            self.fields.append(f"{SCALARS[kind]} {name}[{max(flat.size, 1)}];")
            self.starts[name] = flat.copy()
        return Block(kind, shape, name if fixed else f"boat->{name}", fixed)


def _place(owner: str, offset: int) -> str:
    return f"({owner} + {offset})" if offset else owner


def _names(definition: str) -> str:
    """The name that a table is defined by."""
    return definition.split("[")[0].split()[-1]


def table(head: str, values: Array, kind: str) -> str:
    """Definition of an array with its values."""
    texts = [literal(v, kind) for v in values] or ["0"]
    lines = [", ".join(texts[i : i + _A_LINE]) for i in range(0, len(texts), _A_LINE)]
    return f"{head}[{len(texts)}] = {{\n    " + ",\n    ".join(lines) + "\n};"


# Zigzag executes and ended steps that a flight in C notes; more are flown, and not noted.
_ROOM = 256


@dataclass(frozen=True)
class Source:
    """A boat in C.

    Attributes
    ----------
    name : Before every name that others see. header, source : Texts of the two files.
    states, controls, commands : Names in their order. start : State, controls and commands at the start.
    step : Control sample [s].
    """

    name: str
    header: str
    source: str
    states: tuple[str, ...]
    controls: tuple[str, ...]
    commands: tuple[str, ...]
    start: tuple[Array, Array, Array]
    step: float
    in_waves: bool


def identifier(name: str) -> str:
    """A name as C takes it."""
    plain = re.sub(r"\W", "_", in_file_name(name), flags=re.ASCII)
    return plain if plain[:1].isalpha() else f"boat_{plain}"


def c_source(boat: Boat, case: Case, db: str) -> Source:
    """The right-hand side, actuators and loop of a boat in a case, translated to C.

    Parameters
    ----------
    boat : Of a database version. case : Initial state, water, waves, commands and step. db : For the comment.

    Returns
    -------
    Source; compiles as C99 without a warning, and steps as ``sim.flight.plant.Plant``.

    Raises
    ------
    InputError, NoEquilibrium
        As ``sim.flight.simulate.fly``.
    ident.exports.c_types.Untranslatable
        When the simulator has come to use what the translation does not know.
    """
    model, state, controls, trim, settings = begun(case, boat.vehicle, boat.model(case))
    water = boat.water(case)
    around = surroundings(water, model.added_mass) if water else ()
    work, (g, q), (f, j) = workspace(model, around), orders.flat(settings), orders.progress(settings, state)
    members = Members()
    fixed = {
        "m": members.add(model.real, "model_real", True),
        "w": members.add(model.whole, "model_whole", True),
        "g": members.add(g, "settings_real", True),
        "q": members.add(q, "settings_whole", True),
    }
    of_the_flight = {
        "f": members.add(f, "progress"),
        "j": members.add(j, "leg"),
        "s": members.add(work.real, "scratch"),
        "k": members.add(work.whole, "cells"),
        "stage": members.add(work.stage, "stage"),
        "sample": members.add(maneuver.sample_of(controls.size), "sample"),
        "rate": members.add(np.zeros(controls.size), "actuator_rate"),
        "around": _around(members, around),
        "y": Block("d", (12,), "boat->state"),
        "c": Block("d", (controls.size,), "boat->controls"),
        "dt": Number("d", case.run.step_s),
        "steps": Number("i"),
        "every": Number("i"),
        "start": Number("d"),
        "left": Number("d"),
        "h": Number("d"),
    }
    return _written(
        boat, case, db, _Parts(members, fixed | of_the_flight, model, settings, state, controls, trim, around)
    )


def _around(members: Members, around: Any) -> Kind:
    """Types of the surroundings; what the waves' size changes is the boat's own."""
    if not around:
        return Several(())
    near = Several((members.add(around.near.a, "near"), members.add(around.near.b, "near_places", True)), ("a", "b"))
    waves = around.sea.waves
    amplitude = members.add(waves.amplitude, "wave_amplitude")
    sea = members.add(around.sea._replace(waves=waves._replace(amplitude=np.zeros(0))), "sea", True)
    assert isinstance(sea, Several)
    field_of = sea.items[0]
    assert isinstance(field_of, Several)
    sea = Several((Several((amplitude, *field_of.items[1:]), field_of.names), *sea.items[1:]), sea.names)
    return Several((near, sea, members.add(around.sums, "sums")), type(around)._fields)


@dataclass(frozen=True)
class _Parts:
    members: Members
    kinds: dict[str, Kind]
    model: Model
    settings: orders.Settings
    state: Array
    controls: Array
    trim: Trim | None
    around: Any


def _translated(parts: _Parts, rows: int, columns: int) -> tuple[Translation, dict[str, str]]:
    """Functions that are called from outside, and their names."""
    translation = Translation("boat_type")
    kinds = parts.kinds | {
        "start_zero": Number("d", 0.0),
        "scheme": Number("i", BEGUN),
        "log": Several(
            (Block("d", (rows, columns)), Block("d", (_ROOM, 2)), Block("d", (_ROOM, 3))), maneuver.Log._fields
        ),
        "flight": Several(tuple(parts.kinds[k] for k in maneuver.Flight._fields), maneuver.Flight._fields),
        "near": parts.kinds["around"].items[0] if parts.around else Several(()),  # type: ignore[union-attr]
        "dy": Block("d", (12,)),
        "time": Number("d"),
    }
    wanted: dict[str, tuple[Any, str]] = {
        "hold": (maneuver.hold, "flight around rate dt steps start"),
        "hold_for": (maneuver.hold_for, "flight around rate left h start"),
        "run": (maneuver.integrate, "flight around log dt steps every scheme start_zero"),
        "fill_rate": (fill_rate, "m w y c near s k dy"),
    }
    if parts.around:
        wanted["prepare"] = (prepare, "around y time")
    names = {
        n: translation.function(one, tuple(kinds[k] for k in order.split()))[0] for n, (one, order) in wanted.items()
    }
    return translation, names


def files() -> Environment:
    """Templates of the files that are written."""
    loader = PackageLoader("ident.exports")
    return Environment(loader=loader, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)


def _of_the_boat(parts: _Parts, tanks: bool, name: str) -> dict[str, Any]:
    """What templates are told of a boat, in whatever case."""
    return {
        "name": name,
        "upper": name.upper(),
        "guard": f"IDENT_{name.upper()}_H",
        "states": STATES,
        "tanks": tanks,
        "sail_top": literal(parts.model.sail_top, "d"),
        "fields": parts.members.fields,
        "command_at": orders.COMMAND,
        "n_low": literal(parts.settings.n_limit[0], "d"),
        "n_high": literal(parts.settings.n_limit[1], "d"),
        "room": _ROOM,
        "wave_fields": _wave_fields(parts.around),
    }


def _of_the_flight(parts: _Parts, functions: str, level: Array) -> dict[str, Any]:
    """What templates are told of where a flight starts, and of the tables that its functions use."""
    kind_of = {
        n: "i" if v.dtype.kind == "i" else ("f" if v.dtype.itemsize == 4 else "d")
        for n, v in parts.members.starts.items()
    }
    started = {"state": parts.state, "controls": parts.controls, **parts.members.starts}
    return {
        "tables": [t for t in parts.members.tables if _names(t) in functions],
        "starts": [
            table(f"static const {SCALARS[kind_of.get(n, 'd')]} start_{n}", v, kind_of.get(n, "d"))
            for n, v in started.items()
        ],
        "started": list(started),
        "level": [literal(v, "d") for v in level],
    }


def _written(boat: Boat, case: Case, db: str, parts: _Parts) -> Source:
    """Both files from the parts of a boat."""
    from ident import __version__

    name = identifier(boat.vehicle.name)
    steps, every = samples_of(case)
    rows, columns = steps // every + 1, maneuver.CONTROLS + parts.controls.size + maneuver.COMMANDED
    translation, names = _translated(parts, rows, columns)
    tanks = parts.controls.size > len(boat.vehicle.planes) + 1
    commands = COMMANDS if tanks else COMMANDS[:3]
    level = (parts.trim.dV, parts.trim.dH) if parts.trim else (0.0, 0.0)
    start = np.array([*level, *parts.controls[len(boat.vehicle.planes) :]])
    version = f"version {boat.commit.number}, digest {boat.commit.digest}"
    said = (
        _of_the_boat(parts, tanks, name)
        | _of_the_flight(parts, translation.text, start)
        | {
            "title": f"{boat.vehicle.title}; {case.title}",
            "source_line": f"Database {Path(db).name} {version}; case {case.name}.",
            "program": __version__,
            "step": literal(case.run.step_s, "d"),
            "controls": [p.name for p in boat.vehicle.planes] + ["n", *(("ballast", "trim_tank") if tanks else ())],
            "commands": commands,
            "rows": rows,
            "columns": columns,
            "functions": translation.text,
            "samples": steps,
            "every": every,
            **{"prepare": "", **names},
        }
    )
    header, source = (files().get_template(f"boat.{k}.j2").render(said) + "\n" for k in "hc")
    return Source(
        name=name,
        header=header,
        source=source,
        states=tuple(STATES),
        controls=tuple(said["controls"]),
        commands=tuple(commands),
        start=(parts.state, parts.controls, start),
        step=case.run.step_s,
        in_waves=bool(said["wave_fields"]),
    )


def _wave_fields(around: Any) -> list[tuple[str, str, int, int, int]]:
    """What the size of the waves changes: member, its start, first place, how many, power."""
    if not around or not around.near.b[WAVES]:
        return []
    count = int(around.sea.waves.amplitude.size)
    fields = [("wave_amplitude", "start_wave_amplitude", 0, count, 1), ("near", "start_near", CREST, 1, 1)]
    if around.near.b[DRIFT]:
        first, end = (int(around.near.b[k]) for k in (AT_DRIFT, AT_PARTS))
        fields.append(("near", "start_near", first, end - first, 2))
    return fields


def export_c(boat: Boat, case: Case, db: str, folder: Path) -> dict[str, Any]:
    """Write a boat as one header and one source of C.

    Returns
    -------
    ``files``, the name before every name in them, and case, vehicle, version and digest.

    Raises
    ------
    InputError
        As ``c_source``, and for a folder that cannot be written to.
    """
    source = c_source(boat, case, db)
    check_folder(folder)
    paths = [folder / f"{source.name}.h", folder / f"{source.name}.c"]
    for path, text in zip(paths, (source.header, source.source), strict=True):
        with whole(path) as part:
            part.write_text(text, encoding="utf-8")
    return {
        "files": [str(p) for p in paths],
        "format": "c",
        "name": source.name,
        "case": case.name,
        "vehicle": boat.vehicle.name,
        "database": boat.commit.origin(db),
    }
