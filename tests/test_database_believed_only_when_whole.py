"""Authority: what was committed is read back as it was, or refused with one message; never something else."""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner
from database_writers import Writers
from deltalake import CommitProperties, DeltaTable, write_deltalake
from small_campaign import fitted, write

from ident.captive.campaign import read_campaign
from ident.cli import main
from ident.database import store
from ident.database.leftovers import unfinished, vacuum
from ident.database.store import commit
from ident.fitting.fit import completed
from ident.output import whole
from sim.boat.database import digest, own_version, read_rows, versions
from sim.boat.delta_log import LATEST, LOG, Log
from sim.files.errors import InputError

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


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    return fitted(write(tmp_path_factory.mktemp("small") / "campaign"))


@pytest.fixture(scope="module")
def three(few, tmp_path_factory):
    """Three versions of two vehicles."""
    path = tmp_path_factory.mktemp("three") / "db"
    commit(str(path), few, {"message": "first", "campaign": "small"})
    commit(str(path), few.assign(vehicle="suboff", value=few["value"] * 3), {"message": "\u00b0"})
    commit(str(path), few.assign(value=few["value"] * 2), {"message": "third", "trained": "[]"})
    return path


@pytest.fixture
def db(three, tmp_path):
    return Path(shutil.copytree(three, tmp_path / "db"))


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


# -- rows that are not those that were committed -------------------------------------------


@pytest.mark.parametrize("command", READING)
def test_a_coefficient_changed_by_another_program_is_refused_by_every_command(db, command):
    DeltaTable(db).update(predicate="coefficient = 'Y_uvw'", updates={"value": "value * 10"})
    assert "not those that were committed" in refused(db, command)


def test_the_versions_before_and_the_other_vehicle_stay_readable(db, few):
    DeltaTable(db).update(predicate="coefficient = 'Y_uvw' and vehicle = 'bb2'", updates={"value": "value * 10"})
    assert digest(read_rows(str(db), 3, "suboff")[0]) == digest(few.assign(vehicle="suboff", value=few["value"] * 3))
    assert digest(read_rows(str(db), 2, "bb2")[0]) == digest(times(few, 2))
    with pytest.raises(InputError, match="'bb2' are not those"):
        read_rows(str(db), vehicle="bb2")
    said = CliRunner().invoke(main, ["versions", "--db", str(db), "--json", "-"])
    assert [v["message"] for v in json.loads(said.output)] == ["first", "\u00b0", "third", "UPDATE by another program"]


@pytest.mark.parametrize(
    "harm",
    [
        lambda table: table.delete("vehicle = 'suboff'"),
        lambda table: table.delete("coefficient = 'X_uvw'"),
        lambda table: write_deltalake(table, table.to_pyarrow_table(), mode="append"),
        lambda table: write_deltalake(table, table.to_pyarrow_table().slice(0, 3), mode="overwrite"),
        lambda table: table.restore(0),
    ],
)
def test_rows_that_another_program_removed_doubled_or_turned_back_are_refused(db, harm):
    harm(DeltaTable(db))
    with pytest.raises(InputError, match="not those that were committed"):
        read_rows(str(db))
    assert read_rows(str(db), 2)[1] == 2


def test_files_put_together_by_another_program_are_read_as_before(db):
    """The content counts, not who wrote the file."""
    before = read_rows(str(db))[0]
    DeltaTable(db).optimize.compact()
    pd.testing.assert_frame_equal(read_rows(str(db))[0], before)
    assert own_version(str(db), "bb2", 3).number == 2


def test_each_vehicle_is_held_against_the_commit_that_wrote_it(db):
    """Their digests stand in different entries; the last one names both."""
    log = Log(str(db))
    own = {v: own_version(str(db), v, 2) for v in ("bb2", "suboff")}
    assert {v: one.number for v, one in own.items()} == {"bb2": 2, "suboff": 1}
    assert log.contents(2) == ({v: one.digest for v, one in own.items()}, True)
    assert log.entry(2).beside == {"suboff": own["suboff"].digest}


def reading(path: Path) -> list[object]:
    found: list[object] = [(n, digest(rows)) for rows, n in (read_rows(str(path), v) for v in (None, 0, 1, 2))]
    return [*found, [(v.number, v.timestamp, sorted(v.metadata.items())) for v in versions(str(path))]]


def test_every_byte_of_a_version_turned_is_refused_or_changes_nothing(db):
    """Data files, log and note; a sample of their bytes (``IDENT_BYTES=500``), each turned to a random other value."""
    expected = reading(db)
    files = [p for p in db.rglob("*") if p.is_file()]
    chance = random.Random(24)
    outcome = {"refused": 0, "equal": 0}
    count = int(os.environ.get("IDENT_BYTES", "60"))
    for file in chance.choices(files, [p.stat().st_size for p in files], k=count):
        content = file.read_bytes()
        turned = bytearray(content)
        turned[chance.randrange(len(turned))] ^= chance.randrange(1, 256)
        file.write_bytes(turned)
        try:
            assert reading(db) == expected
            outcome["equal"] += 1
        except InputError:
            outcome["refused"] += 1
        file.write_bytes(content)
    print(outcome)
    assert outcome["refused"] > count / 3
    assert reading(db) == expected


@pytest.mark.parametrize("word", ["first", "small", "suboff"])
def test_what_a_commit_says_of_itself_is_sealed(db, word):
    for number in (0, 1):
        log = entry(db, number)
        log.write_text(log.read_text().replace(f'"{word}"', '"other"'))
    with pytest.raises(InputError, match="not what the commit sealed"):
        versions(str(db))


# -- tables that are none of ours, and logs with holes -------------------------------------


@pytest.mark.parametrize("command", EVERY)
def test_a_foreign_table_is_refused_by_every_command(tmp_path, command):
    db = tmp_path / "db"
    write_deltalake(db, pd.DataFrame({"id": [1, 2], "name": ["a", "b"]}))
    assert "not a coefficient database" in refused(db, command)


def test_a_table_with_our_columns_and_no_commit_of_ours_is_refused(tmp_path, few):
    write_deltalake(tmp_path / "db", few)
    with pytest.raises(InputError, match="no commit of `ident fit` vouches"):
        read_rows(str(tmp_path / "db"))


def test_extra_columns_are_named(db, few):
    write_deltalake(db, few.assign(mood="good"), mode="append", schema_mode="merge")
    for command in (c for c in EVERY if c[0] != "diff"):
        assert "'mood'" in refused(db, command)


def test_a_column_of_another_type_is_named(tmp_path, few):
    write_deltalake(tmp_path / "db", few.assign(n_runs=few["n_runs"].astype(str)))
    with pytest.raises(InputError, match="column n_runs holds string"):
        read_rows(str(tmp_path / "db"))


def test_a_later_protocol_is_named(db):
    log = entry(db, 2)
    needs = {"minReaderVersion": 3, "minWriterVersion": 7, "readerFeatures": ["later"], "writerFeatures": ["later"]}
    log.write_text(log.read_text() + "\n" + json.dumps({"protocol": needs}) + "\n")
    for command in (c for c in EVERY if c[0] != "diff"):
        assert "later" in refused(db, command)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_lost_entry_of_the_log_is_named(db, number):
    """The last one too: the note on the last commit misses it."""
    entry(db, number).unlink()
    for command in EVERY:
        assert f"version {number} is missing" in refused(db, command)


@pytest.mark.parametrize("content", ["", "{}\n", "[]\n", "\n", "null\n", '{"commitInfo": 3}\n', '{"add": {}}\n'])
@pytest.mark.parametrize("number", [1, 2])
def test_an_entry_that_says_nothing_is_refused(db, number, content):
    entry(db, number).write_text(content)
    for command in (("versions",), ("export", "{here}/out")):
        assert "entry of the log" in refused(db, command)


def test_a_data_file_that_is_missing_or_cut_short_is_refused(db):
    data = max(db.glob("*.parquet"), key=lambda p: p.stat().st_mtime)
    content = data.read_bytes()
    for harmed in (content[:-100], content[:100], b""):
        data.write_bytes(harmed)
        assert "cannot be read" in refused(db, ("export", "{here}/out"))
    data.unlink()
    assert "cannot be read" in refused(db, ("export", "{here}/out"))


@pytest.mark.parametrize("command", [("versions",), ("fit", "{here}/campaign"), ("vacuum",)])
def test_a_folder_of_other_data_is_left_alone(tmp_path, command):
    db = tmp_path / "db"
    db.mkdir()
    (db / "part-00000-00000000-0000-0000-0000-000000000000-c000.snappy.parquet").write_bytes(b"mine")
    refused(db, command)
    assert [p.name for p in db.iterdir()] == ["part-00000-00000000-0000-0000-0000-000000000000-c000.snappy.parquet"]


# -- for ever ------------------------------------------------------------------------------


def commits(path: str, rows: pd.DataFrame, how_many: int) -> None:
    for k in range(how_many):
        commit(path, times(rows, 1.0 + 1e-3 * k), {})


def age(db: Path, days: float) -> None:
    for p in db.rglob("*"):
        os.utime(p, (time.time() - 86400 * days,) * 2)


@pytest.fixture(scope="module")
def checkpointed(few, tmp_path_factory):
    """Twelve versions and a checkpoint, which the storage engine writes of itself every hundred versions."""
    path = tmp_path_factory.mktemp("checkpointed") / "db"
    commits(str(path), few, 11)
    DeltaTable(path).create_checkpoint()
    commit(str(path), times(few, 5.0), {})
    return path


def test_every_version_stays_when_checkpoints_are_written_and_months_pass(checkpointed, few, tmp_path):
    db = shutil.copytree(checkpointed, tmp_path / "db")
    age(db, 400)
    assert commit(str(db), times(few, 7.0), {}) == (12, True)
    DeltaTable(db).create_checkpoint()
    # The housekeeping that other programs, and the storage engine of itself, do.
    DeltaTable(db).cleanup_metadata()
    DeltaTable(db).vacuum(dry_run=False)
    assert [v.number for v in versions(str(db))][:13] == list(range(13))
    for k in (0, 5, 10):
        assert digest(read_rows(str(db), k)[0]) == digest(times(few, 1.0 + 1e-3 * k))
    assert digest(read_rows(str(db), 11)[0]) == digest(times(few, 5.0))


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


def test_a_database_of_an_early_release_is_read_and_kept_for_ever_from_the_next_commit(tmp_path, few):
    db = tmp_path / "db"
    as_before(db, few)
    as_before(db, times(few, 2))
    assert digest(read_rows(str(db), 0)[0]) == digest(few)
    assert commit(str(db), times(few, 2), {}) == (1, False)
    assert commit(str(db), times(few, 3), {}) == (3, True)
    assert [v.metadata["message"] for v in versions(str(db))[:3]] == [
        "early",
        "early",
        "every version is kept for ever",
    ]
    assert DeltaTable(db).metadata().configuration["delta.enableExpiredLogCleanup"] == "false"
    assert own_version(str(db), "bb2", 2).number == 1
    assert commit(str(db), times(few, 4), {}) == (4, True)
    for k, factor in ((0, 1), (1, 2), (2, 2), (3, 3), (4, 4)):
        assert digest(read_rows(str(db), k)[0]) == digest(times(few, factor))


def test_rows_written_before_an_axis_existed_keep_their_digest(tmp_path, few):
    """The digest is of the columns of its time; the axis came with another vehicle's commit."""
    db = tmp_path / "db"
    empty = next(c for c in few.columns if few[c].isna().all())
    columns = [c for c in few.columns if c != empty]
    said = {"digest": digest(few, columns), "vehicle": "bb2", "parent": "", "program": "ident 0.1"}
    data = store.arrow(few).drop_columns([empty])
    write_deltalake(db, data, commit_properties=CommitProperties(custom_metadata=said))
    assert len(read_rows(str(db))[0]) == len(few)
    number, _ = commit(str(db), few.assign(vehicle="suboff"), {})
    assert len(read_rows(str(db), number)[0]) == 2 * len(few)


# -- one history, while others write -------------------------------------------------------


def test_eight_writers_and_a_reader_end_in_one_line_of_versions(tmp_path, few):
    path, rounds = str(tmp_path / "db"), 3
    commit(path, few, {})
    at_work = Writers(path, [few] * 8, rounds)
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


def test_a_commit_between_two_looks_at_the_log_shifts_nothing(db, few, monkeypatch):
    """The listing is taken, then another version arrives, then the entries are read."""
    log = Log(str(db))
    commit(str(db), times(few, 9), {})
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


def test_who_waits_for_a_lock_says_whose_it_is_and_ends(db, few, caplog):
    program = [sys.executable, "-c", HOLDER, str(db)]
    with subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "ready\n"
        started = time.monotonic()
        message = rf"process {holder.pid} on .*, writing since 20.* still holds the lock after 0.3 s"
        with pytest.raises(InputError, match=message):
            commit(str(db), times(few, 9), {}, wait=0.3)
        assert time.monotonic() - started < 10.0
        assert f"waiting up to 0.3 s for process {holder.pid} on " in caplog.text
        assert len(versions(str(db))) == 3
        holder.communicate("done\n")
    assert commit(str(db), times(few, 9), {}, wait=0.3) == (3, True)
    assert sorted(p.name for p in db.iterdir() if p.name.startswith(".")) == [LATEST, ".lock"]


# -- what did not finish -------------------------------------------------------------------


@pytest.mark.parametrize("left", ["an empty log", "data and no entry", "half a data file"])
def test_a_first_fit_that_did_not_finish_does_not_stand_in_the_way(tmp_path, few, left):
    db = tmp_path / "db"
    (db / LOG).mkdir(parents=True)
    name = "part-00000-01f0ae76-f187-4358-9487-f33e563448e6-c000.snappy.parquet"
    if left != "an empty log":
        (db / ".lock").touch()
        (db / (name if left.startswith("data") else f"{name}#1")).write_bytes(b"PAR1")
    for command in (("versions",), ("export", "{here}/out")):
        assert "first fit did not finish" in refused(db, command)
    assert commit(str(db), few, {}) == (0, True)
    assert len(list(db.glob("part-*"))) == 1


def test_what_killed_commits_left_is_removed_by_the_next(db, few):
    (db / "part-00000-01f0ae76-f187-4358-9487-f33e563448e6-c000.snappy.parquet").write_bytes(b"PAR1")
    (db / LOG / "_commit_01f0ae76-f187-4358-9487-f33e563448e6.json.tmp").write_text("{")
    (db / ".latest.123.part").write_text("{")
    (db / "notes.parquet").write_bytes(b"not of this program")
    before = reading(db)
    assert len(unfinished(str(db))) == 3
    assert commit(str(db), few, {"message": "next"}) == (3, True)
    assert unfinished(str(db)) == {}
    assert (db / "notes.parquet").exists()
    assert reading(db)[1:-1] == before[1:-1]


def test_an_empty_last_entry_that_was_never_said_to_be_committed_is_removed_by_the_next(db, few):
    """A power cut can leave it; the note says that version 2 was the last."""
    entry(db, 3).touch()
    assert "did not finish" in refused(db, ("export", "{here}/out"))
    assert commit(str(db), few, {}) == (3, True)


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


def test_files_are_flushed_before_a_commit_is_said_to_be_done(tmp_path, few, monkeypatch):
    flushed: list[str] = []
    really = os.fsync

    def fsync(handle: int) -> None:
        flushed.append(os.path.realpath(f"/proc/self/fd/{handle}"))
        really(handle)

    if not Path("/proc/self/fd").is_dir():
        pytest.fail("open files cannot be named on this system")
    monkeypatch.setattr(os, "fsync", fsync)
    db = (tmp_path / "db").resolve()
    commit(str(db), few, {})
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


# -- ident doctor --------------------------------------------------------------------------


@pytest.fixture
def campaign(tmp_path):
    return write(tmp_path / "campaign")


@pytest.fixture
def fitted_twice(campaign, tmp_path, few):
    """A fit of the campaign, then another vehicle, then other rows of the first."""
    db = tmp_path / "db"
    assert CliRunner().invoke(main, ["fit", str(campaign), "--db", str(db)]).exit_code == 0
    commit(str(db), few.assign(vehicle="suboff"), {"message": "other"})
    commit(str(db), times(few, 2), {"message": "third"})
    return db


def doctor(*arguments: str) -> tuple[int, dict[str, object]]:
    result = CliRunner().invoke(main, ["doctor", *map(str, arguments), "--json", "-"])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, json.loads(result.output)


def data_of(db: Path, number: int) -> Path:
    return db / next(iter(Log(str(db)).entry(number).added))


def test_doctor_finds_a_sound_database_whole(fitted_twice):
    code, found = doctor("--db", fitted_twice)
    assert code == 0
    assert found["database"]["whole"]
    assert [v["fault"] for v in found["database"]["versions"]] == ["", "", ""]
    assert [one["fault"] for one in found["self_test"]] == ["", ""]
    assert found["packages"]["deltalake"]


@pytest.mark.parametrize("harm", ["gone", "turned"])
def test_a_damaged_data_file_is_written_again_from_the_campaign(fitted_twice, campaign, few, harm):
    data = data_of(fitted_twice, 0)
    content = data.read_bytes()
    data.unlink() if harm == "gone" else data.write_bytes(content[:4] + bytes(400) + content[404:])
    code, found = doctor("--db", fitted_twice)
    states = found["database"]["versions"]
    assert code == 1
    # Version 1 holds the rows of version 0 beside its own.
    assert [bool(v["fault"]) for v in states] == [True, True, False]
    assert [v["restore"] for v in states[:2]] == ["", ""]
    code, found = doctor(campaign, "--db", fitted_twice)
    assert found["database"]["versions"][0]["restore"] == f"campaign {campaign}"
    code, found = doctor(campaign, "--db", fitted_twice, "--repair")
    assert code == 0
    assert found["database"]["repaired"] == [f"data file of version 0 written again from campaign {campaign}"]
    assert data.read_bytes() == content
    whole = completed(read_campaign(campaign), few)
    assert digest(read_rows(str(fitted_twice), 1)[0].query("vehicle == 'bb2'")) == digest(whole)
    assert len(versions(str(fitted_twice))) == 3


def test_a_campaign_that_was_changed_since_restores_nothing(fitted_twice, campaign):
    data_of(fitted_twice, 0).unlink()
    (campaign / "drift.csv").write_text((campaign / "drift.csv").read_text().replace("74000", "74001"))
    code, found = doctor(campaign, "--db", fitted_twice, "--repair")
    assert code == 1
    assert [bool(v["fault"]) for v in found["database"]["versions"]] == [True, True, False]
    assert found["database"]["repaired"] == []
    assert not data_of(fitted_twice, 0).exists()


def test_what_another_program_changed_is_committed_again_from_the_version_before(fitted_twice, few):
    DeltaTable(fitted_twice).update(predicate="vehicle = 'bb2'", updates={"value": "value * 10"})
    code, found = doctor("--db", fitted_twice)
    assert code == 1
    # The other vehicle's rows stand in the damaged version as they should.
    assert found["database"]["versions"][3]["restore"] == "version 1, version 2"
    code, found = doctor("--db", fitted_twice, "--repair")
    # The damaged version stays, and stays refused; the new one holds the rows.
    assert [bool(v["fault"]) for v in found["database"]["versions"]] == [False, False, False, True, False]
    rows, number = read_rows(str(fitted_twice))
    assert number == 4
    assert digest(rows[rows["vehicle"] == "bb2"]) == digest(times(few, 2))
    assert digest(rows[rows["vehicle"] == "suboff"]) == digest(few.assign(vehicle="suboff"))
    last = versions(str(fitted_twice))[-1]
    assert last.metadata["message"].startswith("repairs version 3: rows of 'bb2' are not those")
    with pytest.raises(InputError):
        read_rows(str(fitted_twice), 3)
    assert commit(str(fitted_twice), times(few, 5), {}) == (5, True)


@pytest.mark.parametrize("harm", [lambda p: p.unlink(), lambda p: p.write_text(""), lambda p: p.write_text("{")])
def test_a_lost_last_entry_sets_the_database_back(fitted_twice, few, harm):
    harm(entry(fitted_twice, 2))
    code, found = doctor("--db", fitted_twice)
    assert code == 1
    assert [bool(v["fault"]) for v in found["database"]["versions"]] == [False, False, True]
    code, found = doctor("--db", fitted_twice, "--repair")
    assert code == 0
    assert "set back to version 1" in found["database"]["repaired"][0]
    assert read_rows(str(fitted_twice))[1] == 1
    assert commit(str(fitted_twice), times(few, 2), {}) == (2, True)


def test_a_checkpoint_that_cannot_be_read_is_set_aside(checkpointed, tmp_path):
    db = shutil.copytree(checkpointed, tmp_path / "db")
    checkpoint = next((db / LOG).glob("*.checkpoint.parquet"))
    checkpoint.write_bytes(checkpoint.read_bytes()[:-50])
    assert doctor("--db", db)[0] == 1
    code, found = doctor("--db", db, "--repair")
    assert code == 0, found
    assert (db / ".damaged" / checkpoint.name).exists()
    assert [v.number for v in versions(str(db))] == list(range(12))


def test_doctor_refuses_what_is_no_database(tmp_path):
    for arguments in (["--db", str(tmp_path / "absent")], ["--repair"]):
        assert CliRunner().invoke(main, ["doctor", *arguments]).exit_code == 2
