"""Campaign folders made for tests of the readers."""

from __future__ import annotations

from pathlib import Path

HEAD = """name = "made"
vehicle = "bb2"
facility = "none"
provenance = "made up"
"""
TABLES = {
    "frame": 'x = "forward"\ny = "starboard"\nz = "down"\nangles = "flight"',
    "moment_point": 'x_m = 0.0\ny_m = 0.0\nz_m = 0.0\nabout = "body origin"',
    "scale": "ratio = 1.0\nlength_m = 70.2",
    "fluid": 'density_kgpm3 = 1000.0\nsource = "made up"',
    "inertia": "model_inertia_in_loads = false",
    "uncertainty": 'floor = 0.1\nsource = "made up"',
    "quality": 'ok = { factor = 1.0, meaning = "as measured" }',
}
CONSTANTS = """[source.constants]
test = "drift_horizontal"
part = "hull"
quality = "ok"
U = "2 m/s"
alpha = "0 deg"
beta = "5 deg"
D0 = "25 m"
"""
STEADY = '[source.reduction]\nkind = "steady"\n'


def campaign(folder: Path, sources: str = "", **tables: str) -> Path:
    """A campaign folder with the usual header; ``tables`` replaces or adds to it."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = {**TABLES, **tables}
    text = HEAD + "".join(f"[{k}]\n{v}\n" for k, v in parts.items()) + sources
    (folder / "campaign.toml").write_text(text, "utf-8")
    return folder


def history(files: str, keys: str = "", constants: str = CONSTANTS, reduction: str = STEADY) -> str:
    """A ``[[source]]`` of time histories."""
    return f'[[source]]\nfiles = "{files}"\nrows = "history"\n{keys}\n{constants}{reduction}'
