"""Authority: the rule for bad input, for databases and the command line: one message, exit code 2, nothing written."""

from __future__ import annotations

import pytest
from small_campaign import RUNS, fitted, write

from ident.database.store import commit
from ident.output import whole
from sim.boat.database import read_rows, versions
from sim.files.errors import InputError


def test_database_path_that_is_a_file_is_refused(tmp_path):
    path = tmp_path / "db"
    path.write_text("not a folder")
    rows = fitted(write(tmp_path / "campaign"))
    with pytest.raises(InputError, match="a file"):
        commit(str(path), rows, {})
    with pytest.raises(InputError, match="a file"):
        read_rows(str(path))
    assert path.read_text() == "not a folder"


def test_absent_database_is_refused_and_not_created(tmp_path):
    with pytest.raises(InputError, match="no coefficient database"):
        read_rows(str(tmp_path / "absent"))
    assert not (tmp_path / "absent").exists()


@pytest.mark.parametrize("number", [-1, 1, 99])
def test_absent_version_is_refused_with_the_range(tmp_path, number):
    path = str(tmp_path / "db")
    commit(path, fitted(write(tmp_path / "campaign")), {})
    with pytest.raises(InputError, match=rf"version {number} does not exist.*0 to 0"):
        read_rows(path, number)


def test_absent_vehicle_lists_the_vehicles(tmp_path):
    path = str(tmp_path / "db")
    commit(path, fitted(write(tmp_path / "campaign")), {})
    with pytest.raises(InputError, match=r"nautilus.*bb2"):
        read_rows(path, vehicle="nautilus")


def test_vehicle_with_an_apostrophe_can_be_stored_twice(tmp_path):
    """The name stands in the predicate of the commit."""
    path = str(tmp_path / "db")
    rows = fitted(write(tmp_path / "campaign")).assign(vehicle="o'hara")
    assert commit(path, rows, {}) == (0, True)
    assert commit(path, rows.assign(value=rows["value"] * 2), {}) == (1, True)
    assert len(read_rows(path)[0]) == len(rows)


def test_damaged_database_is_refused(tmp_path):
    path = tmp_path / "db"
    commit(str(path), fitted(write(tmp_path / "campaign")), {})
    for log in (path / "_delta_log").iterdir():
        log.write_text("{ not json")
    with pytest.raises(InputError, match="db"):
        read_rows(str(path))
    with pytest.raises(InputError, match="db"):
        versions(str(path))


def test_a_log_cut_short_is_refused_in_one_line(tmp_path):
    """The storage engine adds its own trace to the message."""
    path = tmp_path / "db"
    commit(str(path), fitted(write(tmp_path / "campaign")), {})
    log = next((path / "_delta_log").glob("*.json"))
    log.write_text(log.read_text()[:-400])
    with pytest.raises(InputError, match="a damaged entry of the log") as caught:
        versions(str(path))
    assert "\n" not in caught.value.found
    assert "0:" not in caught.value.found


def test_a_file_that_cannot_be_finished_leaves_the_old_one(tmp_path):
    path = tmp_path / "report.html"
    path.write_text("old")

    def disk_runs_full() -> None:
        with whole(path) as part:
            part.write_text("half")
            raise OSError(28, "no room")

    with pytest.raises(InputError, match="no room"):
        disk_runs_full()
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    assert path.read_text() == "old"


def test_database_without_its_data_files_is_refused(tmp_path):
    path = tmp_path / "db"
    commit(str(path), fitted(write(tmp_path / "campaign")), {})
    for data in path.rglob("*.parquet"):
        data.unlink()
    with pytest.raises(InputError, match="db"):
        read_rows(str(path))


# -- the command line ---------------------------------------------------------------------


def command(*arguments: str):
    from click.testing import CliRunner

    from ident.cli import main

    return CliRunner().invoke(main, list(arguments))


def test_command_line_shows_a_mistake_without_a_traceback(tmp_path):
    folder = write(tmp_path / "campaign", runs=RUNS.replace("74000", "abc"))
    result = command("fit", str(folder), "--db", str(tmp_path / "db"))
    assert result.exit_code == 2
    assert "Traceback" not in result.output
    for word in ("drift.csv", "row 3", "column X_N", "abc", "finite number"):
        assert word in result.output
    assert not (tmp_path / "db").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ("fit", "{here}/absent", "--db", "{here}/db"),
        ("fit", "{here}/campaign", "--db", "{here}/file"),
        ("versions", "--db", "{here}/absent"),
        ("diff", "0", "1", "--db", "{here}/absent"),
        ("diff", "0", "7", "--db", "{here}/good"),
        ("export", "{here}/out", "--version", "7", "--format", "csv", "--db", "{here}/good"),
        ("export", "{here}/file", "--version", "0", "--format", "csv", "--db", "{here}/good"),
        ("validate", "--case", "hzz20", "--db", "{here}/absent"),
        ("validate", "--case", "no-such-case", "--db", "{here}/good"),
        ("report", "--db", "{here}/absent", "--out", "{here}/out"),
        ("report", "--db", "{here}/good", "--out", "{here}/file"),
        ("fit", "{here}/campaign", "--db", "{here}/new", "--json", "{here}"),
        ("fit", "{here}/campaign", "--db", "{here}/new", "--json", "{here}/file/below.json"),
        ("runs", "{here}/campaign", "--out", "{here}/file/below"),
        ("plan", "{here}/campaign", "--out", "{here}"),
        ("plan", "{here}/campaign", "--facility", "{here}/none.toml"),
        ("calibrate", "bb2", "--db", "{here}/good", "--json", "{here}"),
        ("calibrate", "bb2", "--db", "{here}/good", "--version", "7"),
        ("animate", "--case", "hzz20", "--db", "{here}/good", "--out", "{here}"),
        ("stability", "--db", "{here}/good", "--depth", "-5"),
        ("stability", "--db", "{here}/good", "--speed", "nan"),
        ("validate", "--case", "hzz20", "--db", "{here}/good", "--cases", "{here}"),
        ("validate", "--case", "hzz20", "--db", "{here}/good", "--json", "{here}"),
    ],
)
def test_every_command_ends_with_code_2_and_one_message(tmp_path, arguments):
    folder = write(tmp_path / "campaign")
    (tmp_path / "file").write_text("in the way")
    commit(str(tmp_path / "good"), fitted(folder), {})
    before = sorted(tmp_path.rglob("*"))
    result = command(*[a.format(here=tmp_path) for a in arguments])
    assert result.exit_code == 2, (result.output, result.exception)
    assert "Traceback" not in result.output
    assert "Error" in result.output
    assert (tmp_path / "file").read_text() == "in the way"
    assert sorted(tmp_path.rglob("*")) == before


def test_fit_by_command_line_says_the_version(tmp_path):
    folder, db = write(tmp_path / "campaign"), str(tmp_path / "db")
    assert command("fit", str(folder), "--db", db).exit_code == 0
    again = command("fit", str(folder), "--db", db)
    assert again.exit_code == 0
    assert [v.number for v in versions(db)] == [0]
    assert "0" in again.output
