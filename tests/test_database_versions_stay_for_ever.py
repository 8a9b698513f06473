"""Authority: a version stays, whatever time, other writers and killed commands do."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner
from damaged_databases import age, entry, reading, refused, times
from database_writers import Writers
from deltalake import CommitProperties, DeltaTable, write_deltalake

from ident.cli import main
from ident.database import store
from ident.database.leftovers import unfinished, vacuum
from ident.database.store import commit
from ident.output import whole
from sim.boat.database import digest, own_version, read_rows, versions
from sim.boat.delta_log import LATEST, LOG, Log
from sim.files.errors import InputError


@pytest.fixture
def db(three_versions, tmp_path):
    return Path(shutil.copytree(three_versions, tmp_path / "db"))


# -- for ever ------------------------------------------------------------------------------


def test_every_version_stays_when_checkpoints_are_written_and_months_pass(checkpointed, few_rows, tmp_path):
    db = shutil.copytree(checkpointed, tmp_path / "db")
    age(db, 400)
    assert commit(str(db), times(few_rows, 7.0), {}) == (12, True)
    DeltaTable(db).create_checkpoint()
    # The housekeeping that other programs, and the storage engine of itself, do.
    DeltaTable(db).cleanup_metadata()
    DeltaTable(db).vacuum(dry_run=False)
    assert [v.number for v in versions(str(db))][:13] == list(range(13))
    for k in (0, 5, 10):
        assert digest(read_rows(str(db), k)[0]) == digest(times(few_rows, 1.0 + 1e-3 * k))
    assert digest(read_rows(str(db), 11)[0]) == digest(times(few_rows, 5.0))


@pytest.mark.parametrize("harm", [lambda b: b[:-50], lambda b: b"", lambda b: b[:4] + bytes(len(b) - 8) + b[-4:]])
def test_a_damaged_checkpoint_is_refused(checkpointed, tmp_path, harm):
    db = shutil.copytree(checkpointed, tmp_path / "db")
    checkpoint = next((db / LOG).glob("*.checkpoint.parquet"))
    checkpoint.write_bytes(harm(checkpoint.read_bytes()))
    refused(db, ("export", "{here}/out"))


def as_before(path: Path, rows: pd.DataFrame) -> None:
    """A version as releases before this one wrote it: no seal, the log cleaned up after thirty days."""
    said = {"digest": digest(rows), "vehicle": "bb2", "parent": "", "program": "ident 0.1", "message": "early"}
    data = store.arrow(rows)
    exists = (path / LOG).is_dir()
    mode = {"mode": "overwrite", "predicate": "vehicle = 'bb2'"} if exists else {"mode": "error"}
    write_deltalake(path, data, commit_properties=CommitProperties(custom_metadata=said), **mode)


def test_a_database_of_an_early_release_is_read_and_kept_for_ever_from_the_next_commit(tmp_path, few_rows):
    db = tmp_path / "db"
    as_before(db, few_rows)
    as_before(db, times(few_rows, 2))
    assert digest(read_rows(str(db), 0)[0]) == digest(few_rows)
    assert commit(str(db), times(few_rows, 2), {}) == (1, False)
    assert commit(str(db), times(few_rows, 3), {}) == (3, True)
    assert [v.metadata["message"] for v in versions(str(db))[:3]] == [
        "early",
        "early",
        "every version is kept for ever",
    ]
    assert DeltaTable(db).metadata().configuration["delta.enableExpiredLogCleanup"] == "false"
    assert own_version(str(db), "bb2", 2).number == 1
    assert commit(str(db), times(few_rows, 4), {}) == (4, True)
    for k, factor in ((0, 1), (1, 2), (2, 2), (3, 3), (4, 4)):
        assert digest(read_rows(str(db), k)[0]) == digest(times(few_rows, factor))


def test_rows_written_before_an_axis_existed_keep_their_digest(tmp_path, few_rows):
    """The digest is of the columns of its time; the axis came with another vehicle's commit."""
    db = tmp_path / "db"
    empty = next(c for c in few_rows.columns if few_rows[c].isna().all())
    columns = [c for c in few_rows.columns if c != empty]
    said = {"digest": digest(few_rows, columns), "vehicle": "bb2", "parent": "", "program": "ident 0.1"}
    data = store.arrow(few_rows).drop_columns([empty])
    write_deltalake(db, data, commit_properties=CommitProperties(custom_metadata=said))
    assert len(read_rows(str(db))[0]) == len(few_rows)
    number, _ = commit(str(db), few_rows.assign(vehicle="suboff"), {})
    assert len(read_rows(str(db), number)[0]) == 2 * len(few_rows)


# -- one history, while others write -------------------------------------------------------


def test_eight_writers_and_a_reader_end_in_one_line_of_versions(tmp_path, few_rows):
    path, rounds = str(tmp_path / "db"), 3
    commit(path, few_rows, {})
    at_work = Writers(path, [few_rows] * 8, rounds)
    seen: dict[int, str] = {}
    readings = 0
    while at_work.at_work:
        history = versions(path)
        assert [v.number for v in history] == list(range(len(history)))
        for v in history:
            assert seen.setdefault(v.number, v.digest) == v.digest
        rows, number = read_rows(path)
        assert seen.get(number, digest(rows)) == digest(rows)
        readings += 1
        time.sleep(0.02)
    assert sorted(at_work.done()) == [(n, True) for n in range(1, 8 * rounds + 1)]
    assert readings > 3
    for v in versions(path):
        assert digest(read_rows(path, v.number)[0]) == v.digest == seen.get(v.number, v.digest)
    assert {v.metadata["by"] for v in versions(path)[1:]} == at_work.by


def test_a_commit_between_two_looks_at_the_log_shifts_nothing(db, few_rows, monkeypatch):
    """The listing is taken, then another version arrives, then the entries are read."""
    log = Log(str(db))
    commit(str(db), times(few_rows, 9), {})
    assert [v.number for v in log.versions] == [0, 1, 2]
    assert [v.metadata["message"] for v in log.versions] == ["first", "\u00b0", "third"]


HOLDER = """
import sys
from pathlib import Path
from ident.database.lock import held
with held(Path(sys.argv[1])):
    print("ready", flush=True)
    sys.stdin.readline()
"""


def test_who_waits_for_a_lock_says_whose_it_is_and_ends(db, few_rows, caplog):
    program = [sys.executable, "-c", HOLDER, str(db)]
    with subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "ready\n"
        started = time.monotonic()
        message = rf"process {holder.pid} on .*, writing since 20.* still holds the lock after 0.3 s"
        with pytest.raises(InputError, match=message):
            commit(str(db), times(few_rows, 9), {}, wait=0.3)
        assert time.monotonic() - started < 10.0
        assert f"waiting up to 0.3 s for process {holder.pid} on " in caplog.text
        assert len(versions(str(db))) == 3
        holder.communicate("done\n")
    assert commit(str(db), times(few_rows, 9), {}, wait=0.3) == (3, True)
    assert sorted(p.name for p in db.iterdir() if p.name.startswith(".")) == [LATEST, ".lock"]


# -- what did not finish -------------------------------------------------------------------


@pytest.mark.parametrize("left", ["an empty log", "data and no entry", "half a data file"])
def test_a_first_fit_that_did_not_finish_does_not_stand_in_the_way(tmp_path, few_rows, left):
    db = tmp_path / "db"
    (db / LOG).mkdir(parents=True)
    name = "part-00000-01f0ae76-f187-4358-9487-f33e563448e6-c000.snappy.parquet"
    if left != "an empty log":
        (db / ".lock").touch()
        (db / (name if left.startswith("data") else f"{name}#1")).write_bytes(b"PAR1")
    for command in (("versions",), ("export", "{here}/out")):
        assert "first fit did not finish" in refused(db, command)
    assert commit(str(db), few_rows, {}) == (0, True)
    assert len(list(db.glob("part-*"))) == 1


def test_what_killed_commits_left_is_removed_by_the_next(db, few_rows):
    (db / "part-00000-01f0ae76-f187-4358-9487-f33e563448e6-c000.snappy.parquet").write_bytes(b"PAR1")
    (db / LOG / "_commit_01f0ae76-f187-4358-9487-f33e563448e6.json.tmp").write_text("{")
    (db / ".latest.123.part").write_text("{")
    (db / "notes.parquet").write_bytes(b"not of this program")
    before = reading(db)
    assert len(unfinished(str(db))) == 3
    assert commit(str(db), few_rows, {"message": "next"}) == (3, True)
    assert unfinished(str(db)) == {}
    assert (db / "notes.parquet").exists()
    assert reading(db)[1:-1] == before[1:-1]


def test_an_empty_last_entry_that_was_never_said_to_be_committed_is_removed_by_the_next(db, few_rows):
    """A power cut can leave it; the note says that version 2 was the last."""
    entry(db, 3).touch()
    assert "did not finish" in refused(db, ("export", "{here}/out"))
    assert commit(str(db), few_rows, {}) == (3, True)


def test_vacuum_removes_only_what_did_not_finish(db):
    left = db / "part-00000-01f0ae76-f187-4358-9487-f33e563448e6-c000.snappy.parquet"
    left.write_bytes(b"PAR1")
    before = reading(db)
    asked = CliRunner().invoke(main, ["vacuum", "--db", str(db), "--dry-run", "--json", "-"])
    assert json.loads(asked.output)["files"] == [{"file": left.name, "bytes": 4}]
    assert left.exists()
    assert left.name in CliRunner().invoke(main, ["vacuum", "--db", str(db)]).output
    assert not left.exists()
    assert vacuum(str(db)) == {}
    assert reading(db) == before


def test_files_are_flushed_before_a_commit_is_said_to_be_done(tmp_path, few_rows, monkeypatch):
    flushed: list[str] = []
    really = os.fsync

    def fsync(handle: int) -> None:
        flushed.append(os.path.realpath(f"/proc/self/fd/{handle}"))
        really(handle)

    if not Path("/proc/self/fd").is_dir():
        pytest.fail("open files cannot be named on this system")
    monkeypatch.setattr(os, "fsync", fsync)
    db = (tmp_path / "db").resolve()
    commit(str(db), few_rows, {})
    data = next(db.glob("*.parquet"))
    for path in (data, entry(db, 0), db / LOG, db, db.parent):
        assert str(path) in flushed, path
    assert flushed.index(str(data)) < flushed.index(str(entry(db, 0)))


KILLED = """
import os, sys
from pathlib import Path
from ident.output import whole
with whole(Path(sys.argv[1])) as part:
    part.write_text("half")
    print(part.name, flush=True)
    os.kill(os.getpid(), 9)
"""


def test_the_half_file_of_a_killed_command_is_removed_by_the_next(tmp_path):
    path = tmp_path / "report.html"
    left = subprocess.run([sys.executable, "-c", KILLED, str(path)], capture_output=True, text=True).stdout.strip()
    assert (tmp_path / left).read_text() == "half"
    # The file of a command that still works on it.
    alive = tmp_path / left.replace(left.split(".")[-2], str(os.getppid()))
    alive.write_text("at work")
    with whole(path) as part:
        part.write_text("new")
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([alive.name, path.name])
