"""Authority: the compiler's own count. What is compiled ahead is what a flight calls."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from ident.validation import compiling
from sim.bench.boat import frozen_boat
from sim.flight import ahead
from sim.flight.case import load_case
from sim.flight.maneuver import integrate
from sim.flight.simulate import simulate

ALONE = """
from numba.core import event
from sim.bench.boat import frozen_boat
from sim.flight import ahead
from sim.flight.case import load_case
from sim.flight.simulate import simulate

class Told(event.Listener):
    def on_start(self, what):
        print(what.data["dispatcher"].py_func.__qualname__)

    def on_end(self, what):
        pass

case, _ = load_case("station-keeping-ss5")
start = case.initial.model_copy(update={"state": "as_given", "revolutions_rps": 1.0})
run = case.run.model_copy(update={"duration_s": 1.0})
ahead.compile_loop(True)
event.register("numba:compile", Told())
simulate(case.model_copy(update={"run": run, "initial": start}), frozen_boat())
print("flown")
"""


def test_a_flight_in_waves_compiles_nothing_that_was_not_ahead(tmp_path):
    """In a fresh environment, without the search for an equilibrium, which is the other process's."""
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", ALONE], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["flown"]
    assert done.stderr.count("compiling the right-hand side") == 1
    assert "compiling the right-hand side in waves, once per installation, about 20 s" in done.stderr


def _flown(name: str, duration: float):
    case, _ = load_case(name)
    case = case.model_copy(update={"run": case.run.model_copy(update={"duration_s": duration})})
    simulate(case, frozen_boat())


@pytest.mark.parametrize(("case", "in_waves"), [("hzz20", False), ("station-keeping-ss5", True)])
def test_a_flight_calls_what_is_compiled_ahead(case, in_waves):
    _flown(case, 1.0)
    known = len(integrate.signatures)
    assert ahead.is_compiled(in_waves)
    ahead.compile_loop(in_waves)
    assert len(integrate.signatures) == known


@pytest.fixture
def begun(monkeypatch):
    """What is begun beside a command, with nothing kept yet."""
    begun = []

    def beside(work, processes):
        begun.append(work)
        return compiling.contextlib.nullcontext()

    monkeypatch.setattr(compiling, "meanwhile", beside)
    monkeypatch.setattr(compiling, "is_compiled", lambda in_waves: False)
    return begun


@pytest.mark.parametrize(
    ("case", "in_waves"), [("hzz20", False), ("station-keeping-ss5", True), ("max-q-surfacing", True), (None, True)]
)
def test_the_loop_is_that_of_the_case(begun, case, in_waves):
    with compiling.loop_of(case):
        pass
    assert [(w.func, w.args) for w in begun] == [(compiling._quietly, (in_waves,))]


def test_nothing_is_begun_for_a_case_that_is_none_or_a_loop_that_is_kept(begun, monkeypatch):
    with compiling.loop_of("no-such-case"):
        pass
    monkeypatch.setattr(compiling, "is_compiled", lambda in_waves: True)
    with compiling.loop_of("hzz20"):
        pass
    assert not begun
