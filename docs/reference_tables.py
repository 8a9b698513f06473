"""Tables of the documentation that are read from the program: axes, keys of the files, rooms."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

from ident.schemas.describe import KINDS, Key, keys
from sim.boat import catalogue
from sim.files.constants import constants

ROOT = Path(__file__).resolve().parents[1]


def table(header: list[str], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    return "\n".join([*lines, *["| " + " | ".join(c.replace("|", "\\|") for c in row) + " |" for row in rows]])


def axes_table() -> str:
    """Every axis of the tables, from ``sim/data/axes.csv``."""
    sign = {1: "even", -1: "odd"}
    rows = [[f"`{a.name}`", f"`{a.column}`", a.unit, sign[a.mirror], a.meaning] for a in catalogue.axes().values()]
    return table(["axis", "column", "unit", "mirror", "meaning"], rows)


def constants_table() -> str:
    """Every physical constant, from ``sim/data/constants.csv``."""
    rows = [[f"`{c.name}`", f"{c.value:.6g}", c.unit, c.meaning, c.source] for c in constants().values()]
    return table(["name", "value", "unit", "meaning", "source"], rows)


def _key_row(key: Key) -> list[str]:
    default = "required" if key.default is None else f"`{key.default}`" if key.default else "-"
    return [f"`{key.name}`", key.kind, default, key.meaning.replace("``", "`")]


def key_tables() -> str:
    """Every key of every kind of file, table by table."""
    parts = []
    for kind in KINDS:
        parts.append(f"## {kind.capitalize()}")
        tables: dict[str, list[Key]] = {}
        for key in keys(kind):
            tables.setdefault(key.table, []).append(key)
        shown: dict[tuple[Key, ...], str] = {}
        for name, own in tables.items():
            # Events and gains have the same keys wherever they stand.
            same = tuple(Key("", k.name, k.kind, k.default, k.meaning) for k in own)
            parts.append(f"### `{name}`" if name else "### At the top")
            if same in shown:
                parts.append(f"The keys of `{shown[same]}`.")
                continue
            shown[same] = name
            parts.append(table(["key", "takes", "default", "meaning"], [_key_row(k) for k in own]))
    return "\n\n".join(parts)


def _docstring(path: Path) -> str:
    text = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split())


def _room(package: str, name: str) -> list[str]:
    """Name, purpose and modules of a room, or of a module that stands alone."""
    place = ROOT / package / name
    if not place.is_dir():
        return [f"`{package}/{name}.py`", _docstring(place.with_suffix(".py")), ""]
    modules = sorted(p.stem for p in place.glob("*.py") if not p.stem.startswith("__"))
    modules += sorted(f"{p.name}/" for p in place.iterdir() if p.is_dir() and (p / "__init__.py").is_file())
    return [f"`{package}/{name}/`", _docstring(place / "__init__.py"), " ".join(f"`{m}`" for m in modules)]


def room_tables() -> str:
    """The rooms of both packages in the order of their contracts, lowest first."""
    with (ROOT / "pyproject.toml").open("rb") as stream:
        contracts = tomllib.load(stream)["tool"]["importlinter"]["contracts"]
    parts = []
    # The first contract says which package stands on which.
    for package in reversed(contracts[0]["layers"]):
        for contract in (c for c in contracts if c.get("containers") == [package]):
            layers = [[name.strip() for name in layer.split(":")] for layer in reversed(contract["layers"])]
            rows = [_room(package, name) for floor in layers for name in floor]
            parts.append(table(["room", "what happens in it", "modules"], rows))
    return "\n\n".join(parts)
