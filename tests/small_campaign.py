"""A campaign of three runs, written to a folder, for tests of what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.files.errors import InputError

HEADER = """name = "small"
vehicle = "bb2"
facility = "none"
provenance = "made up"
[frame]
x = "aft"
y = "starboard"
z = "up"
angles = "flight"
[moment_point]
x_m = 0.0
y_m = 0.0
z_m = 0.0
about = "body origin"
[scale]
ratio = 1.0
length_m = 70.2
[fluid]
density_kgpm3 = 1025.0
source = "made up"
[inertia]
model_inertia_in_loads = false
[uncertainty]
floor = 0.1
source = "made up"
[absent]
"drift_horizontal.N" = "a made balance of two components"
[quality]
as_published = { factor = 1.0, meaning = "as published" }
"""
RUNS = """run_id,test,part,U_mps,alpha_deg,beta_deg,D0_m,X_N,Y_N,rel_sigma,quality,source,copy_of,exclude
h0,drift_horizontal,hull,5.0,0,0,25,68000,0,0.05,as_published,book,,
h4,drift_horizontal,hull,5.0,0,4,25,74000,-336000,0.05,as_published,book,,
h8,drift_horizontal,hull,5.0,0,8,25,40000,-629000,0.05,as_published,book,,
"""


def write(folder: Path, header: str | bytes = HEADER, runs: str | bytes = RUNS) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("campaign.toml", header), ("drift.csv", runs)):
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


def fitted(folder: Path):
    return database_rows(identify(read_campaign(folder)))


def assert_refused(folder: Path, *words: str) -> InputError:
    """The InputError of reading and fitting ``folder``; its message holds every word."""
    with pytest.raises(InputError) as caught:
        fitted(folder)
    message = str(caught.value)
    for word in words:
        assert word in message, f"{word!r} is not in: {message}"
    assert caught.value.found
    assert caught.value.allowed
    return caught.value
