"""What a command says in its log: one line an event, in a form a program reads, and nothing where nobody asked."""

from __future__ import annotations

import logging
import re
import shlex

import pytest
from click.testing import CliRunner

import ident
from ident.cli import main
from ident.commands.log import Lines

LINE = re.compile(r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z (debug|info|warning|error) ((?:ident|sim)[\w.]*) (.*)$")


@pytest.fixture(autouse=True)
def quiet_afterwards():
    yield
    logging.captureWarnings(False)
    for name in ("ident", "sim", "py.warnings"):
        logging.getLogger(name).handlers.clear()
        logging.getLogger(name).setLevel(logging.NOTSET)


def _events(text):
    """Level, module, words and values of every line; every line is one."""
    found = []
    for line in text.splitlines():
        level, module, said = LINE.match(line).groups()
        words = shlex.split(said)
        found.append((level, module, dict(w.split("=", 1) for w in words if "=" in w), said))
    return found


def test_a_fit_says_what_it_read_checked_and_committed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ident.write_starter("my boat")
    asked = ["--log-level", "info", "fit", "my boat/captive", "--db", "db", "--json", "fit.json"]
    done = CliRunner().invoke(main, asked)
    assert done.exit_code == 0, done.output
    events = _events(done.stderr)
    by_words = {said.split(" campaign=")[0].split(" file=")[0]: given for _, _, given, said in events}
    assert by_words["campaign read"]["runs"].isdigit()
    assert by_words["campaign checked"]["error"] == "0"
    assert by_words["file written"]["file"] == "fit.json"
    committed = next(given for _, module, given, _ in events if module == "ident.database.store")
    assert (committed["version"], committed["vehicle"]) == ("0", "my-boat")
    assert committed["digest"] == ident.Database("db")[0].digest[:16]
    (end,) = (given for *_, given, said in events if said.startswith("command ends"))
    assert end["command"] == "fit"
    assert float(end["seconds"]) > 0.0
    assert {level for level, *_ in events} == {"info"}
    assert committed["database"] == "db"


def test_levels_choose_and_nothing_is_said_without_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ident.write_starter("my-boat")
    runs = ["runs", "my-boat/captive", "--json", "-"]
    plain = CliRunner().invoke(main, runs)
    assert (plain.exit_code, plain.stderr) == (0, "")
    warned = CliRunner().invoke(main, ["--log-level", "warning", *runs])
    assert (warned.stdout, warned.stderr) == (plain.stdout, "")
    fine = CliRunner().invoke(main, runs, env={"IDENT_LOG_LEVEL": "debug"})
    assert fine.stdout == plain.stdout
    read = [given["file"] for *_, given, said in _events(fine.stderr) if said.startswith("file read")]
    assert any(name.endswith("campaign.toml") for name in read)
    refused = CliRunner().invoke(main, ["--log-level", "loud", *runs])
    assert refused.exit_code == 2
    assert "'debug', 'info', 'warning', 'error'" in refused.output


def test_an_error_of_the_user_ends_the_command_early_in_the_log(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["--log-level", "info", "versions", "--db", "nowhere"])
    assert done.exit_code == 2
    (line,) = (line for line in done.stderr.splitlines() if LINE.match(line))
    assert "command ends early command=versions" in line
    assert line.endswith("by=InputError")


def test_a_line_stays_one_line_whatever_a_file_is_called():
    record = logging.makeLogRecord({"name": "ident.x", "levelname": "INFO", "msg": "read\n", "file": 'a "b"\n\x1b[31m'})
    line = Lines().format(record)
    assert line.isprintable()
    assert line.endswith(r'read\n file="a \"b\"\n\u001b[31m"')
