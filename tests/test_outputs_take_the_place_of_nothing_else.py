"""Authority: POSIX files: what a name stands for stays what it is; a link is written through; modes and the mask hold.

A command that writes never replaces a device, a pipe or a link, never widens a mode, never writes over
what it reads, and never leaves its folder, whatever a case is called.
"""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from small_campaign import write

from ident.cli import main
from ident.output import check_file, whole
from ident.text import in_file_name
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.files.temporary import temporary_folder
from sim.flight.case import load_case

posix = pytest.mark.skipif(os.name != "posix", reason="POSIX files")


def put(path, text="new"):
    with whole(path) as part:
        part.write_text(text)


@posix
def test_a_pipe_is_handed_the_file_and_stays(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    # Until the reader has opened it, nobody reads.
    for _ in range(1000):
        try:
            put(pipe, "x" * 200_000)
            break
        except InputError:
            reader.join(0.01)
    reader.join()
    assert read[-1] == "x" * 200_000
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@posix
def test_a_pipe_that_nobody_reads_is_refused_at_once(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="nobody reads"):
        put(pipe)
    assert [p.name for p in tmp_path.iterdir()] == ["pipe"]


@posix
def test_a_link_stays_and_its_target_is_written(tmp_path):
    target, link = tmp_path / "there" / "target.json", tmp_path / "link.json"
    target.parent.mkdir()
    target.write_text("old")
    link.symlink_to(target)
    put(link)
    assert link.is_symlink()
    assert target.read_text() == "new"


@posix
def test_a_link_in_a_circle_is_one_message(tmp_path):
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    with pytest.raises(InputError):
        check_file(tmp_path / "a")
    with pytest.raises(InputError):
        put(tmp_path / "a")
    assert (tmp_path / "a").is_symlink()


@posix
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o444, 0o755])
def test_the_mode_of_a_file_that_is_there_is_kept_while_it_is_written_too(tmp_path, mode):
    path = tmp_path / "a.json"
    path.write_text("old")
    path.chmod(mode)
    if mode & 0o200:
        with whole(path) as part:
            assert stat.S_IMODE(part.stat().st_mode) == mode
            part.write_text("new")
        assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == mode


@posix
def test_a_new_file_has_what_the_mask_leaves(tmp_path):
    before = os.umask(0o027)
    try:
        put(tmp_path / "a.json")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a.json").stat().st_mode) == 0o640


@posix
def test_the_place_of_the_part_is_not_written_through_a_link(tmp_path):
    """Someone who may write to the folder guesses the name of the part."""
    victim = tmp_path / "victim"
    victim.write_text("mine")
    with whole(tmp_path / "a.json") as part:
        name = part.name
        part.write_text("x")
    (tmp_path / name).symlink_to(victim)
    put(tmp_path / "a.json")
    assert victim.read_text() == "mine"


@posix
def test_standard_output_named_as_a_file_is_written_and_not_replaced(tmp_path):
    """``--json /dev/stdout > file``: the file that the shell opened is the one that is written."""
    out = tmp_path / "out.json"
    script = "import sys\nfrom pathlib import Path\nfrom ident.output import whole\nprint('before')\n"
    script += "with whole(Path('/dev/stdout')) as part:\n    part.write_text('new')\nprint('after')"
    with out.open("w") as stream:
        number = out.stat().st_ino
        subprocess.run([sys.executable, "-c", script], stdout=stream, check=True)
    assert out.stat().st_ino == number
    assert out.read_text() == "before\nnewafter\n"


def run(*arguments: object):
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.mark.parametrize("name", ["campaign.toml", "drift.csv"])
def test_an_input_is_not_written_over(tmp_path, name):
    folder = write(tmp_path / "campaign")
    before = (folder / name).read_bytes()
    done = run("check", folder, "--json", folder / name)
    assert (done.exit_code, "an input of this command" in done.output) == (2, True)
    assert (folder / name).read_bytes() == before


def test_results_in_the_folder_of_a_campaign_may_be_written_again(tmp_path):
    folder = write(tmp_path / "campaign")
    for _ in range(2):
        assert run("check", folder, "--json", folder / "found.json").exit_code == 0


def test_a_case_and_the_vehicle_it_names_are_inputs(tmp_path, fitted_db):
    case = tmp_path / "case.toml"
    case.write_text('vehicle = "boat.toml"')
    for place in (case, f"{fitted_db}/_delta_log/00000000000000000000.json", f"{fitted_db}/new.json"):
        done = run("validate", "--case", case, "--db", fitted_db, "--out", tmp_path / "out", "--json", place)
        assert done.exit_code == 2
        assert "input of this command" in done.output or "inside the database" in done.output
    assert case.read_text() == 'vehicle = "boat.toml"'


# What a command needs before the last word names where it writes.
WRITES = [
    *(
        "animate --case hzz20 --out",
        "fly --case hzz20 --out",
        "diff 0 1 --figure",
        "export",
        "export --format c",
        "new",
    ),
    *("offsets x.stl --unit m --length 4 --out", "plan c", "plan c --out", "report --out", "runs c --out"),
    *("stability --out", "trial t.csv --out", "trial t.csv --figures", "validate --case hzz20 --out"),
]
WRITES_JSON = ["animate --case hzz20", "calibrate bb2", "check c", "diff 0 1", "doctor", "export out", "fit c"]
WRITES_JSON += ["fly --case hzz20", "import x.json", "new boat", "offsets x.stl --unit m --length 4 --out o", "plan c"]
WRITES_JSON += ["report", "runs c", "schema case", "stability", "trial t.csv", "vacuum", "validate --all", "versions"]


def test_no_command_writes_into_a_database(tmp_path, monkeypatch, fitted_db):
    """Its own, another, or one deep below."""
    monkeypatch.chdir(tmp_path)
    assert {line.split()[0] for line in WRITES_JSON} == set(main.commands)
    held = [p for p in Path(fitted_db).rglob("*") if p.is_file()]
    before = {p: p.read_bytes() for p in held}
    log = f"{fitted_db}/_delta_log/00000000000000000000.json"
    for line in [*WRITES, *(f"{line} --json" for line in WRITES_JSON)]:
        for place in (log, f"{fitted_db}/deep/x") if line.endswith("--json") else (f"{fitted_db}/x.svg",):
            done = run(*line.split(), place)
            assert (done.exit_code, "inside the database" in done.output) == (2, True), (line, done.output)
    assert {p: p.read_bytes() for p in Path(fitted_db).rglob("*") if p.is_file()} == before
    assert not list(tmp_path.iterdir())


def test_files_read_on_the_way_are_not_written_over(tmp_path):
    """The reference of a case stands on no command line."""
    from sim.files import inputs

    path = tmp_path / "reference.csv"
    path.write_text("old")
    inputs.begin()
    try:
        inputs.note(path)
        with pytest.raises(InputError, match="an input of this command"):
            put(path)
    finally:
        inputs._read.set(None)
    put(path)
    assert path.read_text() == "new"


@pytest.mark.parametrize(
    "name", ["", "../../escaped", "/etc/passwd", "a\\\\b", ".", "..", "a\\u001b[31m", " a", "a\\nb"]
)
def test_a_name_that_leaves_its_folder_is_refused(tmp_path, name):
    from importlib.resources import files

    for kind, bundled, load in (("cases", "roll-decay", load_case), ("vehicles", "bb2", load_vehicle)):
        text = (files("sim") / kind / f"{bundled}.toml").read_text("utf-8")
        path = tmp_path / f"{kind}.toml"
        path.write_text(text.replace(f'name = "{bundled}"', f'name = "{name}"', 1))
        with pytest.raises(InputError, match="key name"):
            load(path)


@given(st.text())
def test_any_text_names_a_file_in_its_folder(tmp_path_factory, text):
    name = in_file_name(text)
    assert os.path.basename(name) == name
    assert name not in ("", ".", "..")
    assert len(name.encode()) < 200
    path = tmp_path_factory.getbasetemp() / f"{name}_v0.png"
    path.write_text("x")
    assert path.parent.resolve() == tmp_path_factory.getbasetemp().resolve()
    path.unlink()


@posix
def test_temporary_folders_of_killed_processes_go(tmp_path, monkeypatch):
    """Those of processes that are gone, of this user and this machine; no others."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    with temporary_folder() as kept:
        (kept / "file").write_text("x")
        own = kept.name.split(str(os.getpid()))[0]
        for name in (f"{own}{gone.pid}-x", f"{own}{os.getppid()}-x", f"ident-elsewhere-{gone.pid}-x", "ident-mine"):
            (tmp_path / name).mkdir()
        with temporary_folder() as other:
            assert other != kept
        assert {p.name for p in tmp_path.iterdir()} == {
            kept.name, f"{own}{os.getppid()}-x", f"ident-elsewhere-{gone.pid}-x", "ident-mine"
        }  # fmt: skip
        assert (kept / "file").read_text() == "x"
    assert not kept.exists()
