"""Authority: the hazard itself. An edit of inlined code is seen by the functions of other files."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import time
from pathlib import Path
from types import FunctionType, ModuleType

import numba
import pytest
from numba.core.dispatcher import Dispatcher

from sim.compiled_cache import PREFIX, VARIABLE, compiled_sources, remove_stale, sources_key, use_keyed_cache

ROOT = Path(__file__).parents[1]
SIM = ROOT / "sim"

INNER = """
from numba import njit
from sim.constants import HALF


@njit(cache=True, inline="always")
def inner(x):
    return x * FACTOR * HALF
"""
OUTER = """
from numba import njit
from sim.inner import inner


@njit(cache=True)
def outer(x):
    return inner(x)
"""
PROGRAM = "from sim.outer import outer; print(outer(1.0), sum(outer.stats.cache_hits.values()))"


@pytest.fixture
def package(tmp_path):
    """A package ``sim`` of two compiled files, one inlined into the other, with the real rule."""
    folder = tmp_path / "sim"
    folder.mkdir()
    for name in ("__init__.py", "compiled_cache.py"):
        (folder / name).write_text((SIM / name).read_text("utf-8"), "utf-8")
    (folder / "constants.py").write_text("HALF = 0.5\n", "utf-8")
    (folder / "inner.py").write_text(INNER.replace("FACTOR", "2.0"), "utf-8")
    (folder / "outer.py").write_text(OUTER, "utf-8")
    (folder / "apart.py").write_text("NOTHING = 1\n", "utf-8")
    return folder


def run(folder: Path, program: str = PROGRAM, **environment: str) -> list[str]:
    """What a fresh process prints with this package, its home a folder of its own."""
    clean = {k: v for k, v in os.environ.items() if k not in (VARIABLE, "XDG_CACHE_HOME", "LOCALAPPDATA")}
    home = {"HOME": str(folder.parent / "home"), "LOCALAPPDATA": str(folder.parent / "home")}
    done = subprocess.run(
        [sys.executable, "-B", "-c", program],
        cwd=folder.parent,
        env={**clean, **home, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


def test_an_edit_of_inlined_code_is_seen_in_another_file(package):
    assert run(package) == ["1.0", "0"]
    assert run(package) == ["1.0", "1"]  # from the cache: the hazard would be real
    (package / "inner.py").write_text(INNER.replace("FACTOR", "3.0"), "utf-8")
    # As a child of a process that ran before the edit.
    assert run(package, **{VARIABLE: str(package.parent / f"{PREFIX}0123456789abcdef")}) == ["1.5", "0"]


def test_without_the_key_numba_gives_the_stale_value_and_a_users_place_is_kept(package):
    own = {VARIABLE: str(package.parent / "mine")}
    assert run(package, **own) == ["1.0", "0"]
    assert [p.name[:4] for p in (package.parent / "mine").iterdir()] == ["sim_"]
    (package / "inner.py").write_text(INNER.replace("FACTOR", "3.0"), "utf-8")
    assert run(package, **own) == ["1.0", "1"]


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A cache folder of the user's own, no choice made yet, and numba's setting restored after."""
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(name, str(tmp_path / "home"))
    return tmp_path / "home"


def test_numba_imported_first_is_told(package, home):
    use_keyed_cache(package)
    wanted = home / "ident-submarine" / (PREFIX + sources_key(package))
    assert wanted.is_dir()
    assert os.environ[VARIABLE] == numba.config.CACHE_DIR == str(wanted)


def test_a_choice_made_in_a_program_is_kept(package, home, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", "mine")
    use_keyed_cache(package)
    assert (numba.config.CACHE_DIR, os.environ[VARIABLE], home.exists()) == ("mine", "", False)


def test_the_packages_own_folder_when_home_cannot_be_written(package, home):
    home.write_text("", "utf-8")
    use_keyed_cache(package)
    assert str(package / "__pycache__" / (PREFIX + sources_key(package))) == numba.config.CACHE_DIR


def test_nowhere_to_write_compiles_for_one_process(package, home):
    home.write_text("", "utf-8")
    (package / "__pycache__").write_text("", "utf-8")
    # Without a cache folder at all, numba refuses to compile a cached function.
    value, hits, place = run(
        package,
        f"{PROGRAM}; import os; print(os.environ['{VARIABLE}'])",
        **dict.fromkeys(("HOME", "LOCALAPPDATA", "XDG_CACHE_HOME"), str(home)),
    )
    assert (value, hits) == ("1.0", "0")
    assert Path(place).name.startswith(PREFIX)
    assert not Path(place).exists()


def test_the_key_follows_compiled_sources_and_what_they_import_only(package):
    key = sources_key(package)
    (package / "apart.py").write_text("NOTHING = 2\n", "utf-8")
    assert sources_key(package) == key
    for name in ("inner.py", "outer.py", "constants.py"):
        path = package / name
        before = path.read_text("utf-8")
        path.write_text(before + "\n", "utf-8")
        assert sources_key(package) != key, name
        path.write_text(before, "utf-8")
    assert sources_key(package) == key


def test_only_states_long_unused_are_removed(tmp_path):
    now = time.time()
    for k in range(9):
        place = tmp_path / f"{PREFIX}{k}"
        place.mkdir()
        (place / "used").write_bytes(b"")
        # The first two were used within the hour, the others for days not.
        age = 60.0 * k if k < 2 else 86400.0 * (k + 1)
        os.utime(place / "used", (now - age, now - age))
    (tmp_path / "another program").mkdir()
    remove_stale(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["another program", *(f"{PREFIX}{k}" for k in range(5))]


def _users() -> list[str]:
    """Modules of the two packages that use numba."""
    found = []
    for folder in ("sim", "ident"):
        for path in (ROOT / folder).rglob("*.py"):
            if "numba import" in path.read_text("utf-8"):
                found.append(".".join(path.relative_to(ROOT).with_suffix("").parts))
    return sorted(found)


def test_everything_that_compiled_functions_use_is_in_the_key():
    """The rule reads text; this asks the functions themselves."""
    keyed = {".".join(path.relative_to(ROOT).with_suffix("").parts) for path in compiled_sources(SIM)}
    users = _users()
    assert {"sim.kernel.rhs", "sim.flight.maneuver", "sim.bench.ratios"} <= set(users)
    assert {name for name in users if "bench" not in name} <= keyed
    for name in users:
        module = importlib.import_module(name)
        for function in [f for f in vars(module).values() if isinstance(f, Dispatcher)]:
            for word in function.py_func.__code__.co_names:
                used = function.py_func.__globals__.get(word)
                used = getattr(used, "py_func", used)
                home = used.__module__ if isinstance(used, FunctionType) else ""
                home = used.__name__ if isinstance(used, ModuleType) else home
                assert not home.startswith(("sim", "ident")) or home in keyed | {name}, (function, word)


def test_this_process_uses_it():
    chosen = Path(os.environ[VARIABLE])
    if not chosen.name.startswith(PREFIX):
        pytest.skip(f"{VARIABLE} is the user's own: {chosen}")
    assert chosen.name == PREFIX + sources_key(SIM)
    assert str(chosen) == numba.config.CACHE_DIR
