"""Campaign folders made for tests of the readers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ident.captive.campaign import read_campaign

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


# -- the same numbers in every format -----------------------------------------------------------

COLUMNS = ["X", "Y", "N"]
VALUES = np.array([[-1234.5, 2750.25, 12500.0], [-1180.0, 5600.5, 25250.0], [-1100.25, 8450.0, 38000.0]])
BETA = [2.0, 4.0, 6.0]
RUNS = CONSTANTS.replace('beta = "5 deg"\n', "") + "rel_sigma = 0.05\n"


def tidy(keys: str = "", columns: str = "", constants: str = RUNS) -> str:
    return f'[[source]]\nfiles = "runs.*"\n{keys}\n[source.columns]\n{columns}\n{constants}'


def read(folder, text: str | bytes, source: str, name: str = "runs.csv", **tables):
    campaign(folder, source, **tables)
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_campaign(folder).runs


def assert_values(runs) -> None:
    np.testing.assert_allclose(runs[COLUMNS].to_numpy(), VALUES, rtol=1e-12)
    np.testing.assert_allclose(np.degrees(runs["beta"]), BETA, rtol=1e-12)
    np.testing.assert_allclose(runs["U"], 2.0)


TIME = np.arange(400) * 0.05
SERIES = np.column_stack([np.full(400, v) for v in VALUES[0]]) + np.random.default_rng(3).standard_normal((400, 3))
MEANS = SERIES.mean(axis=0)
SAMPLES = [(t, *row) for t, row in zip(TIME.tolist(), SERIES.tolist(), strict=True)]


def assert_means(runs) -> None:
    assert len(runs) == 1
    np.testing.assert_allclose(runs[COLUMNS].to_numpy()[0], MEANS, rtol=1e-6)
    np.testing.assert_allclose(runs[["s_X", "s_Y", "s_N"]].to_numpy()[0], 1.0 / np.sqrt(400), rtol=0.3)
    assert runs["beta"].iloc[0] == pytest.approx(np.radians(5.0))


def runs_of(folder, name: str, keys: str = ""):
    """Runs of a file, a row a run."""
    campaign(folder, tidy(keys).replace("runs.*", name))
    return read_campaign(folder).runs


def reduced(folder, name: str, keys: str = ""):
    """The run that a file of a time history reduces to."""
    campaign(folder, history(name, keys))
    return read_campaign(folder).runs
