"""Authority: the documentation of Python on what ``os`` and ``signal`` lack on Windows, and what Windows refuses there.

Nothing of Windows runs here. A process is made to look like one: without the calls and modules that it lacks, with
a flush that takes only files opened to be written, a console of its code page, and files that are in use for a moment.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_campaign import HEADER, write

from ident.text import in_file_name
from sim.files import temporary
from sim.files.temporary import take_place

_BEGINS = """
import errno, fcntl, os, signal, sys
import filelock, deltalake, matplotlib.pyplot, numba, numpy, pandas, pyarrow, rich.console, scipy.optimize

def fsync(number, real=os.fsync, modes=fcntl):
    if modes.fcntl(number, modes.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
        raise OSError(errno.EBADF, "Bad file descriptor")
    real(number)

os.fsync = fsync
lacks = "fork getuid geteuid getgid chown fchown mkfifo killpg setsid sched_getaffinity sysconf statvfs uname getpgid"
for name in (lacks + " O_NONBLOCK O_NOCTTY O_DIRECTORY set_blocking symlink").split():
    if hasattr(os, name):
        delattr(os, name)
for name in "pthread_sigmask SIGKILL SIGHUP SIGUSR1 alarm set_wakeup_fd".split():
    delattr(signal, name)
for name in "fcntl resource pwd grp termios tty pty syslog posix".split():
    sys.modules[name] = None
os.name = "other"
from ident.cli import main
for line in sys.stdin:
    print("code", main(eval(line), standalone_mode=False) or 0, file=sys.stderr, flush=True)
"""


def test_commands_run_without_what_windows_lacks(tmp_path):
    folder = write(tmp_path / "campaign", header=HEADER.replace('"small"', '"潜水艦 é"'))
    db = str(tmp_path / "db")
    commands = [
        ["fit", str(folder), "--db", db],
        ["versions", "--db", db, "--json", str(tmp_path / "versions.json")],
        ["export", str(tmp_path / "out"), "--db", db],
        ["vacuum", "--db", db],
        ["new", str(tmp_path / "boat")],
    ]
    done = subprocess.run(
        [sys.executable, "-c", _BEGINS],
        input="".join(f"{c!r}\n" for c in commands),
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONIOENCODING": "cp437"},
        capture_output=True,
        encoding="cp437",
        timeout=300,
        check=False,
    )
    assert done.stderr.split("\n")[:-1] == ["code 0"] * len(commands), done.stderr[-2000:]
    assert done.returncode == 0
    assert "??? é" in done.stdout
    assert json.loads((tmp_path / "versions.json").read_text("utf-8"))[0]["version"] == 0
    assert (tmp_path / "out" / "coefficients_v0.csv").stat().st_size > 100
    assert not [p.name for p in tmp_path.rglob(".*") if p.name not in (".lock", ".latest")]


class InUse(PermissionError):
    """As Windows says it."""

    def __init__(self, number: int) -> None:
        super().__init__(13, "The process cannot access the file because it is being used by another process")
        self.winerror = number


@pytest.mark.parametrize(
    ("refusals", "number", "placed"), [(3, 32, True), (3, 5, True), (99, 32, False), (1, 19, False)]
)
def test_a_file_takes_its_place_when_its_readers_are_done(tmp_path, monkeypatch, refusals, number, placed):
    part, target = tmp_path / "part", tmp_path / "target"
    part.write_text("new")
    target.write_text("old")
    left, replace = [refusals], Path.replace

    def in_use(self: Path, to: Path) -> Path:
        left[0] -= 1
        if left[0] >= 0:
            raise InUse(number)
        return replace(self, to)

    monkeypatch.setattr(Path, "replace", in_use)
    monkeypatch.setattr(temporary, "_PAUSE", 0.0)
    if placed:
        take_place(part, target)
    else:
        with pytest.raises(PermissionError):
            take_place(part, target)
    assert target.read_text() == ("new" if placed else "old")
    assert part.exists() is not placed


def test_what_a_system_forbids_is_said_at_once(tmp_path, monkeypatch):
    def forbidden(self: Path, to: Path) -> Path:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "replace", forbidden)
    begun = time.monotonic()
    with pytest.raises(PermissionError):
        take_place(tmp_path / "part", tmp_path / "target")
    assert time.monotonic() - begun < 1.0


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("CON", "_CON"),
        ("nul.trial", "_nul.trial"),
        ("com1", "_com1"),
        ("LPT9 .x", "_LPT9 .x"),
        ("console", "console"),
        ("turn. .", "turn_"),
        ("a:b", "a_b"),
        ("hzz20", "hzz20"),
    ],
)
def test_no_name_is_a_device_or_loses_its_end(name, safe):
    assert in_file_name(name) == safe
