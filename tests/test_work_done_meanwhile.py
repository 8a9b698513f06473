"""Invariants of work another process does meanwhile: result, refusal, warnings and files read are as if done here."""

from __future__ import annotations

import os
import signal
import sys
import time
import warnings
from dataclasses import fields
from functools import partial
from pathlib import Path

import pytest

import ident
from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign, evidence_of, seen_in_runs
from ident.checks.findings import OF_FIT, NotYetError, RunsAlone, function_name, registered
from ident.identification.identify import identify
from ident.output import check_folder
from ident.processes import meanwhile, withheld
from sim.files import inputs
from sim.files.errors import InputError

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setattr("ident.processes.cores", lambda: 2)


@pytest.mark.parametrize(("processes", "elsewhere"), [(None, False), (1, False), (2, True), (0, True)])
def test_another_process_works_where_two_may(processes, elsewhere):
    with meanwhile(os.getpid, processes) as result:
        assert (result() != os.getpid()) == (elsewhere and sys.platform == "linux")


def test_what_may_not_be_done_elsewhere_is_done_when_it_is_asked_for():
    done = []
    with meanwhile(partial(done.append, 1)) as result:
        assert not done
        result()
    assert done == [1]


def test_a_refusal_arrives_as_it_is_when_the_result_is_asked_for(tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("", "utf-8")
    with meanwhile(partial(check_folder, taken), 2) as result, pytest.raises(InputError) as refused:
        result()
    assert (refused.value.where, refused.value.found) == (str(taken), "a file")


def test_files_read_there_are_known_here_beside_those_read_meanwhile(tmp_path):
    here, there = tmp_path / "here.toml", tmp_path / "there.toml"
    there.write_text("a = 1", "utf-8")
    inputs.begin()
    try:
        with meanwhile(partial(inputs.statements, there), 2) as result:
            inputs.note(here)
            assert not inputs.is_read(there)
            assert result() == b"a = 1"
        assert inputs.is_read(there)
        assert inputs.is_read(here)
    finally:
        inputs._read.set(None)


def test_a_warning_is_given_with_the_result():
    with (
        meanwhile(partial(warnings.warn, "worn", UserWarning, 1), 2) as result,
        pytest.warns(UserWarning, match="worn"),
    ):
        result()


def dies_elsewhere(parent: int) -> str:
    if os.getpid() != parent:
        os._exit(1)
    return "done here"


def test_what_a_process_that_ended_had_to_do_is_done_here(caplog):
    with meanwhile(partial(dies_elsewhere, os.getpid()), 2) as result:
        assert result() == "done here"
    assert caplog.text.count("a process that worked for this one has ended") == (sys.platform == "linux")


def writes_late(path):
    path.with_suffix(".begun").write_text(str(os.getpid()))
    time.sleep(30)
    path.write_text("late")


@pytest.mark.skipif(sys.platform != "linux", reason="no other process elsewhere")
def test_a_process_whose_result_nobody_wants_any_more_ends(tmp_path):
    """A refusal, or Ctrl-C here, ends it at once; Ctrl-C at a terminal, which both meet, is not the other one's."""
    path = tmp_path / "file"
    begun = path.with_suffix(".begun")
    with meanwhile(partial(writes_late, path), 2):
        while not begun.exists() or not begun.read_text():
            time.sleep(0.01)
        other = int(begun.read_text())
        os.kill(other, signal.SIGINT)
        time.sleep(0.1)
        assert os.waitpid(other, os.WNOHANG) == (0, 0)
    pid, status = os.waitpid(other, 0)
    assert (pid, os.waitstatus_to_exitcode(status)) == (other, -signal.SIGKILL)
    assert not path.exists()


def test_a_fit_of_two_processes_is_that_of_one(tmp_path, monkeypatch):
    """Rows, findings, estimates; and what the checks refuse is said before what the estimates do."""
    monkeypatch.chdir(tmp_path)
    ident.write_starter("my-boat")
    (alone,) = ident.fit("my-boat/captive", "one")
    (beside,) = ident.fit("my-boat/captive", "other", work=ident.Work(workers=2))
    assert beside.to_dict() == alone.to_dict()
    assert beside.rows.equals(alone.rows)
    said = []
    for workers in (None, 2):
        work = ident.Work(workers=workers)
        with pytest.raises(InputError) as refused:
            ident.fit("my-boat/captive", "one", force="no error", without=["no such estimate"], work=work)
        said.append(str(refused.value))
    assert said[0] == said[1]
    assert "no check finds an error" in said[0]


def refuses_after_a_warning():
    warnings.warn("worn", UserWarning, 1)
    raise InputError("here", "nothing", "something")


def test_what_is_withheld_is_done_at_once_and_said_when_asked_for(recwarn):
    done = []
    result = withheld(refuses_after_a_warning)
    assert withheld(partial(done.append, 1))() is None
    assert (done, len(recwarn)) == ([1], 0)
    with pytest.warns(UserWarning, match="worn"), pytest.raises(InputError, match="nothing"):
        result()


@pytest.mark.parametrize("name", ["bb2", "suboff", "kvlcc2-mmg"])
def test_checks_of_the_runs_alone_are_those_of_identified_runs(name):
    """Seen before or not, the findings are the same; what looks at the fit is not looked for before it."""
    folder = ROOT / "raw_captive_data" / name
    campaign = read_campaign(folder)
    seen, identified = seen_in_runs(campaign, folder), identify(campaign)
    assert check_campaign(campaign, folder, identified, seen=seen) == check_campaign(campaign, folder, identified)
    functions = {function_name(check, one) for check, several in registered().items() for one in several}
    assert {one for one in functions if one.startswith(("residuals.", "facilities."))}.isdisjoint(seen)
    assert 0.5 * len(functions) < len(seen) < len(functions)


@pytest.mark.parametrize("name", ["bb2", "suboff"])
def test_all_that_checks_are_given_of_a_fit_is_what_they_are_not_given_before(name, monkeypatch):
    """Whatever a fit is to say to the checks from now on has to be named where evidence before it refuses it."""
    folder = ROOT / "raw_captive_data" / name
    campaign, given = read_campaign(folder), []
    monkeypatch.setattr("ident.checks.check.findings_of", lambda evidence, *more: given.append(evidence) or [])
    check_campaign(campaign, folder, identify(campaign))
    before = evidence_of(campaign, folder)
    said = {f.name for f in fields(before) if getattr(given[0], f.name) is not getattr(before, f.name)}
    assert {"fitted", "constants", "tabulated"} <= said - {"runs"}
    assert {name for name in said if getattr(before, name) in (None, ())} <= set(OF_FIT)


@pytest.mark.parametrize("given", ["fitted", "constants", "tabulated", "derivatives", "between"])
def test_evidence_before_the_fit_says_that_it_is(given):
    with pytest.raises(NotYetError, match=given):
        getattr(RunsAlone(), given)
