"""Copies of bundled campaigns and of the starter's, to make slips in."""

from __future__ import annotations

import shutil
from pathlib import Path

from sample_of_mutations import STARTER, TABLES

ROOT = Path(__file__).parents[1]


def copied(place: Path, boat: str) -> Path:
    """A folder with a copy of a campaign; the starter's as far as its tables of runs, histories take their time."""
    if boat != "starter":
        shutil.copytree(ROOT / "raw_captive_data" / boat, place / boat)
        return place / boat
    shutil.copytree(STARTER, place / boat)
    folder = place / boat / "captive"
    shutil.rmtree(folder / "histories")
    header = folder / "campaign.toml"
    tables = TABLES.match(header.read_text("utf-8"))
    assert tables
    header.write_text(tables[0], "utf-8")
    return folder
