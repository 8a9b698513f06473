"""Authority: what was committed is read back as it was, or refused with one message; never something else."""

from __future__ import annotations

import json
import os
import random
import shutil
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner
from damaged_databases import EVERY, READING, entry, reading, refused, times
from deltalake import DeltaTable, write_deltalake

from ident.cli import main
from sim.boat.database import digest, own_version, read_rows, versions
from sim.boat.delta_log import Log
from sim.files.errors import InputError


@pytest.fixture
def db(three_versions, tmp_path):
    return Path(shutil.copytree(three_versions, tmp_path / "db"))


# -- rows that are not those that were committed -------------------------------------------


@pytest.mark.parametrize("command", READING)
def test_a_coefficient_changed_by_another_program_is_refused_by_every_command(db, command):
    DeltaTable(db).update(predicate="coefficient = 'Y_uvw'", updates={"value": "value * 10"})
    assert "not those that were committed" in refused(db, command)


def test_the_versions_before_and_the_other_vehicle_stay_readable(db, few_rows):
    DeltaTable(db).update(predicate="coefficient = 'Y_uvw' and vehicle = 'bb2'", updates={"value": "value * 10"})
    assert digest(read_rows(str(db), 3, "suboff")[0]) == digest(
        few_rows.assign(vehicle="suboff", value=few_rows["value"] * 3)
    )
    assert digest(read_rows(str(db), 2, "bb2")[0]) == digest(times(few_rows, 2))
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


def test_a_table_with_our_columns_and_no_commit_of_ours_is_refused(tmp_path, few_rows):
    write_deltalake(tmp_path / "db", few_rows)
    with pytest.raises(InputError, match="no commit of `ident fit` vouches"):
        read_rows(str(tmp_path / "db"))


def test_extra_columns_are_named(db, few_rows):
    write_deltalake(db, few_rows.assign(mood="good"), mode="append", schema_mode="merge")
    for command in (c for c in EVERY if c[0] != "diff"):
        assert "'mood'" in refused(db, command)


def test_a_column_of_another_type_is_named(tmp_path, few_rows):
    write_deltalake(tmp_path / "db", few_rows.assign(n_runs=few_rows["n_runs"].astype(str)))
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
