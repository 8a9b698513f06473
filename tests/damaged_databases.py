"""What tests do to small databases: other values, age, and commands that must refuse them."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pandas as pd
from click.testing import CliRunner
from small_campaign import write

from ident.cli import main
from ident.database.store import commit
from sim.boat.database import digest, read_rows, versions
from sim.boat.delta_log import LOG

EVERY = [
    ("versions",),
    ("export", "{here}/out"),
    ("diff", "0", "2"),
    ("validate", "--case", "hzz20", "--out", "{here}/out"),
    ("validate", "--all", "--out", "{here}/out"),
    ("report", "--out", "{here}/out"),
    ("stability",),
    ("animate", "--case", "hzz20", "--out", "{here}/out.gif"),
    ("calibrate", "bb2"),
    ("fit", "{here}/campaign"),
    ("vacuum",),
]
READING = [command for command in EVERY if command[0] not in ("versions", "vacuum", "diff")]


def times(rows: pd.DataFrame, factor: float) -> pd.DataFrame:
    return rows.assign(value=rows["value"] * factor)


def entry(db: Path, number: int) -> Path:
    return db / LOG / f"{number:020d}.json"


def refused(db: Path, command: tuple[str, ...]) -> str:
    """The message of a command that must refuse a database and leave it as it is."""
    write(db.parent / "campaign")
    before = {p: p.read_bytes() for p in db.rglob("*") if p.is_file()}
    result = CliRunner().invoke(main, [a.format(here=db.parent) for a in command] + ["--db", str(db)])
    assert result.exit_code == 2, (command, result.output, result.exception)
    assert "Traceback" not in result.output
    assert result.output.count("Error:") == 1
    assert not (db.parent / "out").exists()
    assert {p: p.read_bytes() for p in db.rglob("*") if p.is_file() and p.name != ".lock"} == {
        p: content for p, content in before.items() if p.name != ".lock"
    }
    return result.output


def commits(path: str, rows: pd.DataFrame, how_many: int) -> None:
    for k in range(how_many):
        commit(path, times(rows, 1.0 + 1e-3 * k), {})


def age(db: Path, days: float) -> None:
    for p in db.rglob("*"):
        os.utime(p, (time.time() - 86400 * days,) * 2)


def reading(path: Path) -> list[object]:
    held: list[object] = [(n, digest(rows)) for rows, n in (read_rows(str(path), v) for v in (None, 0, 1, 2))]
    return [*held, [(v.number, v.timestamp, sorted(v.metadata.items())) for v in versions(str(path))]]
