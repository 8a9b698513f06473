"""Authority: `ident doctor` names what is damaged and restores what was committed."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner
from damaged_databases import entry, times
from deltalake import DeltaTable
from small_campaign import write

from ident.captive.campaign import read_campaign
from ident.cli import main
from ident.database.store import commit
from ident.fitting.fit import completed
from sim.boat.database import digest, read_rows, versions
from sim.boat.delta_log import LOG, Log
from sim.files.errors import InputError

# -- ident doctor --------------------------------------------------------------------------


@pytest.fixture
def campaign(tmp_path):
    return write(tmp_path / "campaign")


@pytest.fixture
def fitted_twice(campaign, tmp_path, few_rows):
    """A fit of the campaign, then another vehicle, then other rows of the first."""
    db = tmp_path / "db"
    assert CliRunner().invoke(main, ["fit", str(campaign), "--db", str(db)]).exit_code == 0
    commit(str(db), few_rows.assign(vehicle="suboff"), {"message": "other"})
    commit(str(db), times(few_rows, 2), {"message": "third"})
    return db


def doctor(*arguments: str) -> tuple[int, dict[str, object]]:
    result = CliRunner().invoke(main, ["doctor", *map(str, arguments), "--json", "-"])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, json.loads(result.stdout)


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
def test_a_damaged_data_file_is_written_again_from_the_campaign(fitted_twice, campaign, few_rows, harm):
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
    whole = completed(read_campaign(campaign), few_rows)
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


def test_what_another_program_changed_is_committed_again_from_the_version_before(fitted_twice, few_rows):
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
    assert digest(rows[rows["vehicle"] == "bb2"]) == digest(times(few_rows, 2))
    assert digest(rows[rows["vehicle"] == "suboff"]) == digest(few_rows.assign(vehicle="suboff"))
    last = versions(str(fitted_twice))[-1]
    assert last.metadata["message"].startswith("repairs version 3: rows of 'bb2' are not those")
    with pytest.raises(InputError):
        read_rows(str(fitted_twice), 3)
    assert commit(str(fitted_twice), times(few_rows, 5), {}) == (5, True)


@pytest.mark.parametrize("harm", [lambda p: p.unlink(), lambda p: p.write_text(""), lambda p: p.write_text("{")])
def test_a_lost_last_entry_sets_the_database_back(fitted_twice, few_rows, harm):
    harm(entry(fitted_twice, 2))
    code, found = doctor("--db", fitted_twice)
    assert code == 1
    assert [bool(v["fault"]) for v in found["database"]["versions"]] == [False, False, True]
    code, found = doctor("--db", fitted_twice, "--repair")
    assert code == 0
    assert "set back to version 1" in found["database"]["repaired"][0]
    assert read_rows(str(fitted_twice))[1] == 1
    assert commit(str(fitted_twice), times(few_rows, 2), {}) == (2, True)


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
