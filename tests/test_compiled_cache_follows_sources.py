"""Authority: the hazard itself. An edit of inlined code is seen by the functions of other files."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import FunctionType, ModuleType

import pytest
from numba.core.dispatcher import Dispatcher

import sim
from ident.database.installation import installation
from sim.compiled_cache import (
    PREFIX,
    VARIABLE,
    cache_place,
    compiled_sources,
    end_turn,
    is_ours,
    remove_stale,
    sources_key,
    take_turn,
)
from sim.flight.maneuver import integrate as run_flight

ROOT = Path(__file__).parents[1]
SIM = ROOT / "sim"

INNER = """
from sim.compiled import inlined
from sim.constants import HALF


@inlined
def inner(x):
    return x * FACTOR * HALF
"""
OUTER = """
from sim.compiled import outer
from sim.inner import inner


@outer
def fill_rate(x):
    return inner(x)
"""
PROGRAM = "from sim.outer import fill_rate; print(fill_rate(1.0), sum(fill_rate.stats.cache_hits.values()))"


def _made(folder: Path) -> Path:
    folder.mkdir()
    for name in ("__init__.py", "compiled.py", "compiled_cache.py"):
        (folder / name).write_text((SIM / name).read_text("utf-8"), "utf-8")
    (folder / "constants.py").write_text("HALF = 0.5\n", "utf-8")
    (folder / "inner.py").write_text(INNER.replace("FACTOR", "2.0"), "utf-8")
    (folder / "outer.py").write_text(OUTER, "utf-8")
    (folder / "apart.py").write_text("NOTHING = 1\n", "utf-8")
    return folder


@pytest.fixture
def package(tmp_path):
    """A package ``sim`` of two compiled files, one inlined into the other, with the real rule."""
    return _made(tmp_path / "sim")


@pytest.fixture(scope="module")
def once_compiled(tmp_path_factory):
    """The folder of such a package that has run once, with its home."""
    folder = tmp_path_factory.mktemp("compiled")
    run(_made(folder / "sim"))
    return folder


@pytest.fixture
def compiled(once_compiled, tmp_path):
    """A copy of that package, and of its home beside it."""
    shutil.copytree(once_compiled, tmp_path / "copy")
    return tmp_path / "copy" / "sim"


# Says that it has compiled something, and keeps it when it is told to.
WAITING = f"""
import sys
from sim.compiled import _Cache

keep = _Cache._write

def told(*of_a_function):
    print("compiled", flush=True)
    sys.stdin.readline()
    keep(*of_a_function)

_Cache._write = told
{PROGRAM}
"""


def begun(folder: Path, home: Path | None = None, program: str = PROGRAM) -> subprocess.Popen[str]:
    """A fresh process with this package, its home a folder of its own."""
    clean = {k: v for k, v in os.environ.items() if k not in (VARIABLE, "XDG_CACHE_HOME", "LOCALAPPDATA")}
    place = str(home or folder.parent / "home")
    return subprocess.Popen(
        [sys.executable, "-B", "-c", program],
        cwd=folder.parent,
        env={**clean, "HOME": place, "LOCALAPPDATA": place},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def run(folder: Path, home: Path | None = None) -> tuple[list[str], str]:
    """What a fresh process prints, and on stderr."""
    with begun(folder, home) as process:
        printed, said = process.communicate()
    assert process.returncode == 0, said
    return printed.split(), said


def _kept(folder: Path) -> list[Path]:
    """Files of compiled functions in the home beside a package."""
    return sorted((folder.parent / "home").rglob("outer.fill_rate-*.nb?"))


def test_an_edit_of_inlined_code_is_seen_and_a_copy_elsewhere_does_not_compile_again(package, tmp_path):
    values, said = run(package)
    assert values == ["1.0", "0"]
    assert said.count("compiling the right-hand side in calm water, once per installation") == 1
    # From the cache: the hazard would be real.
    assert run(package) == (["1.0", "1"], "")
    other = tmp_path / "elsewhere" / "sim"
    shutil.copytree(package, other)
    assert run(other, tmp_path / "home") == (["1.0", "1"], "")
    (package / "inner.py").write_text(INNER.replace("FACTOR", "3.0"), "utf-8")
    assert run(package)[0] == ["1.5", "0"]


@pytest.mark.skipif(os.name != "posix", reason="locks of POSIX")
@pytest.mark.parametrize(("ends", "read"), [(False, "1"), (True, "0")])
def test_what_another_process_compiles_is_waited_for_and_read_unless_that_ends(package, ends, read):
    with begun(package, program=WAITING) as first:
        assert first.stdout.readline() == "compiled\n"
        with begun(package) as second:
            assert second.stderr.readline().startswith("compiling")
            # It has looked and not found; without turns it would compile from here on.
            time.sleep(1.0)
            assert second.poll() is None
            first.kill() if ends else first.stdin.write("\n\n")
            first.stdin.close() if ends else first.stdin.flush()
            assert second.communicate(timeout=60)[0].split() == ["1.0", read]


def test_a_turn_is_not_waited_for_without_end(package, home, monkeypatch):
    place = cache_place(package)
    monkeypatch.setattr("sim.compiled_cache._PATIENCE", 0.2)
    holder = "import sys; from pathlib import Path; from sim.compiled_cache import take_turn\n"
    holder += f"take_turn(Path({str(place)!r}), 'it'); print('taken', flush=True); sys.stdin.readline()"
    with begun(package, program=holder) as other:
        assert other.stdout.readline() == "taken\n"
        since = time.monotonic()
        take_turn(place, "it")
        assert time.monotonic() - since >= (0.2 if os.name == "posix" else 0.0)
        since = time.monotonic()
        take_turn(place, "another")
        end_turn(place, "another")
        assert time.monotonic() - since < 0.2
        other.communicate("\n")


def _truncate(path: Path) -> None:
    path.write_bytes(b"")


def _garble(path: Path) -> None:
    path.write_bytes(b"\x80\x05garbage" * 9)


def _share(path: Path) -> None:
    path.chmod(0o666)


@pytest.mark.parametrize("harm", [_truncate, _garble, _share])
@pytest.mark.parametrize("kind", [".nbc", ".nbi"])
def test_a_damaged_or_foreign_file_is_compiled_again_and_replaced(compiled, harm, kind):
    harmed = [p for p in _kept(compiled) if p.suffix == kind]
    assert harmed
    for path in harmed:
        harm(path)
    assert run(compiled)[0] == ["1.0", "0"]
    assert run(compiled)[0] == ["1.0", "1"]


def test_what_another_user_owns_or_could_write_is_not_ours(tmp_path, monkeypatch):
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_text("", "utf-8")
    file.chmod(0o644)
    link.symlink_to(file)
    assert is_ours(file)
    assert not is_ours(link)
    for mode in (0o664, 0o646):
        file.chmod(mode)
        assert not is_ours(file)
    file.chmod(0o644)
    monkeypatch.setattr(os, "geteuid", lambda: file.stat().st_uid + 1)
    assert not is_ours(file)


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A cache folder of the user's own."""
    monkeypatch.delenv(VARIABLE, raising=False)
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(name, str(tmp_path / "home"))
    cache_place.cache_clear()
    return tmp_path / "home"


def test_a_folder_that_others_may_write_is_not_used(package, home):
    shared = home / "ident-submarine"
    shared.mkdir(parents=True)
    shared.chmod(0o777)
    place = cache_place(package)
    assert place is not None
    assert shared not in place.parents


def test_a_place_of_the_users_choice_is_used(package, home, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "mine"))
    assert cache_place(package) == tmp_path / "mine" / (PREFIX + sources_key(package))


def test_the_packages_own_folder_when_home_cannot_be_written(package, home):
    home.write_text("", "utf-8")
    place = cache_place(package)
    assert place == package / "__pycache__" / "ident-submarine" / (PREFIX + sources_key(package))


def test_nowhere_to_write_compiles_at_every_start_and_says_so(package, tmp_path):
    nowhere = tmp_path / "file"
    nowhere.write_text("", "utf-8")
    (package / "__pycache__").write_text("", "utf-8")
    values, said = run(package, nowhere)
    assert values == ["1.0", "0"]
    assert "at every start" in said


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
            text = path.read_text("utf-8")
            if "numba import" in text or "sim.compiled import" in text:
                found.append(".".join(path.relative_to(ROOT).with_suffix("").parts))
    return sorted(found)


def test_everything_that_compiled_functions_use_is_in_the_key():
    """The rule reads text; this asks the functions themselves."""
    keyed = {".".join(path.relative_to(ROOT).with_suffix("").parts) for path in compiled_sources(SIM)}
    users = _users()
    assert {"sim.kernel.rhs", "sim.flight.maneuver", "sim.bench.loops"} <= set(users)
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
    place = cache_place(SIM)
    assert place is not None
    assert place.name == PREFIX + sources_key(SIM)
    assert run_flight._cache.cache_path == str(place)


def test_doctor_names_the_folder_that_compiled_functions_are_kept_in():
    told = installation().cache
    place = cache_place(Path(sim.__file__).resolve().parent)
    assert told.folder == str(place)
    # Tests beside this one may add to it meanwhile.
    assert 0 <= told.bytes <= sum(p.stat().st_size for p in place.rglob("*") if p.is_file())
