"""Every command killed (SIGKILL) at any moment, and what is left.

    python tests/killed_commands.py 100

runs each command once to learn its time, then that many with a kill at a random part of it. Afterwards every file
under its final name is whole, every version of the database is the one committed, inputs are as they were, and the
next commit is the next version and leaves nothing unfinished. Where a command left hidden files or folders, it is run
once more, and they have to be gone.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pandas as pd
from made_lines import surfaces, write_files, write_stl
from mutated_files import digest
from small_campaign import fitted, write

from ident.database.leftovers import unfinished
from ident.database.store import commit
from sim.boat.database import read_rows, versions, whole_version
from sim.boat.delta_log import Log

_BB2 = Path(__file__).resolve().parents[1] / "raw_captive_data" / "bb2"
COMMANDS = (
    ("fit", "{here}/campaign", "--db", "{here}/db", "--json", "{out}/fit.json"),
    ("fit", str(_BB2), "--db", "{here}/db"),
    ("fit", "{here}/campaign", "--db", "{out}/new"),
    ("check", "{here}/campaign", "--json", "{out}/check.json"),
    ("runs", "{here}/campaign", "--out", "{out}", "--json", "{out}/runs.json"),
    ("plan", "{here}/campaign", "--json", "{out}/plan.json"),
    ("versions", "--db", "{here}/db", "--json", "{out}/versions.json"),
    ("export", "{out}", "--db", "{here}/db"),
    ("diff", "0", "1", "--db", "{here}/db", "--json", "{out}/diff.json"),
    ("report", "--db", "{here}/flown", "--out", "{out}"),
    ("validate", "--case", "roll-decay", "--db", "{here}/flown", "--out", "{out}", "--json", "{out}/v.json"),
    ("fly", "--case", "hzz20", "--out", "{out}/flight.csv", "--db", "{here}/flown"),
    ("fly", "--case", "roll-decay", "--samples", "20", "--out", "{out}/flight.nc", "--db", "{here}/flown"),
    ("trial", "{here}/boat/zigzag_trial.csv", "--out", "{out}/metrics.csv", "--figures", "{out}"),
    ("calibrate", "{here}/boat/calibration.toml", "--no-left-out", "--db", "{here}/boat/db", "--json", "{out}/c.json"),
    ("import", "{here}/exchange/coefficients_v1.json", "--db", "{out}/new", "--json", "{out}/i.json"),
    ("export", "{out}", "--format", "json", "--db", "{here}/db"),
    ("export", "{out}", "--format", "c", "--case", "roll-decay", "--db", "{here}/flown"),
    ("export", "{out}/boat.fmu", "--format", "fmu", "--case", "roll-decay", "--db", "{here}/flown"),
    ("export", "{out}/boat.dml", "--format", "daveml", "--case", "roll-decay", "--db", "{here}/flown"),
    ("export", "{out}/boat/boat.xml", "--format", "jsbsim", "--case", "roll-decay", "--db", "{here}/flown"),
    (
        "plan",
        "{here}/lines/captive",
        "--cases",
        "openfoam",
        "--surface",
        "{here}/lines/hull.stl",
        "--template",
        "{here}/lines/template.toml",
        "--facility",
        "{here}/lines/facility.toml",
        "{out}/cases",
    ),
    ("offsets", "{here}/hull.stl", "--unit", "m", "--length", "4", "--out", "{out}", "--json", "{out}/o.json"),
    (
        "validate",
        "--case",
        "hzz20",
        "--db",
        "{here}/flown",
        "--out",
        "{out}",
        "--loads",
        "part",
        "--history",
        "csv",
    ),
    ("stability", "--db", "{here}/flown", "--json", "{out}/s.json"),
    ("animate", "--case", "roll-decay", "--db", "{here}/flown", "--out", "{out}/a.gif"),
    ("doctor", "--db", "{here}/db", "--repair"),
    ("vacuum", "--db", "{here}/db"),
    ("new", "{out}/boat"),
)


def room(folder: Path) -> pd.DataFrame:
    """A campaign, a database of two versions, and one to fly from; the rows of the first."""
    rows = fitted(write(folder / "campaign"))
    commit(str(folder / "db"), rows, {})
    commit(str(folder / "db"), rows.assign(value=rows["value"] * 2), {})
    import ident
    from ident.cli import main

    (folder / "tmp").mkdir()
    ident.fit(_BB2, str(folder / "flown"))
    ident.write_starter(folder / "boat")
    ident.fit(folder / "boat" / "captive", str(folder / "boat" / "db"))
    main(["export", str(folder / "exchange"), "--format", "json", "--db", str(folder / "db")], standalone_mode=False)
    write_files(folder / "lines")
    hull = surfaces()["hull"]
    hull.apply_scale(0.002)
    write_stl(folder / "hull.stl", {"hull": hull})
    return rows


def started(command: tuple[str, ...], here: Path, out: Path) -> subprocess.Popen[bytes]:
    """A command in a process group of its own."""
    given = [a.format(here=here, out=out) for a in command]
    return subprocess.Popen(
        [sys.executable, "-m", "ident.cli", *given],
        cwd=here,
        env={**os.environ, "TMPDIR": str(here / "tmp")},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def is_whole(path: Path) -> bool:
    """Whether a file is one that a command wrote to its end."""
    content = path.read_bytes()
    if path.suffix == ".json":
        json.loads(content)
    elif path.suffix == ".csv":
        cells = [len(r) for r in csv.reader(line for line in content.decode().splitlines() if line[:1] != "#")]
        return content.endswith(b"\n") and len(set(cells)) == 1
    ends = {".png": b"IEND\xaeB`\x82", ".gif": b";", ".html": b"</html>", ".toml": b"\n"}
    return content.rstrip(b"\n" if path.suffix == ".html" else b"").endswith(ends.get(path.suffix, b""))


def faults(here: Path, out: Path, rows: pd.DataFrame, inputs: str, known: int) -> list[str]:
    """What is wrong after a kill."""
    found = []
    for path in out.rglob("*"):
        inside = path.relative_to(out).parts[:-1]
        if path.is_file() and not path.name.startswith(".") and "new" not in inside:
            try:
                good = is_whole(path)
            except ValueError:
                good = False
            found += [] if good else [f"{path.name} is not whole"]
    if digest(str(here / "campaign")) != inputs:
        found.append("inputs changed")
    for db in (here / "db", here / "flown", here / "boat" / "db", *([out / "new"] if (out / "new").is_dir() else [])):
        try:
            first = not any((db / "_delta_log").glob("*.json"))
            before = 0 if first else len(versions(str(db)))
            # Older ones were looked at after the kills before.
            for number in {0, *range(max(0, before - 3), before)} if before else ():
                whole_version(Log(str(db)), number)
            if db == here / "db" and before < known:
                found.append(f"{before} versions of {known}")
            if db.name != "flown":
                # The boat is to be calibrated once more.
                own = read_rows(str(db))[0] if db.parent.name == "boat" else rows
                factor = 1.0 + 1e-3 * random.random()
                number, new = commit(str(db), own.assign(value=own["value"] * factor), {})
                found += [] if (number, new) == (before, True) else [f"commit {number} after {before} versions"]
                found += [f"left: {name}" for name in unfinished(str(db))]
                read_rows(str(db))
        except Exception as error:
            found.append(f"{db.name}: {type(error).__name__} {error}")
    return found


def killed(
    here: Path, command: tuple[str, ...], takes: float | None, rows: pd.DataFrame
) -> tuple[float, str, list[str]]:
    """Seconds, how a command ended, and what is wrong afterwards; not killed where ``takes`` is None."""
    out = here / "out"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    inputs, known = digest(str(here / "campaign")), len(versions(str(here / "db")))
    begun = time.monotonic()
    process = started(command, here, out)
    try:
        code = process.wait(None if takes is None else random.uniform(0.05, 1.0) * takes)
        ended = f"exit code {code}"
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        ended = "killed"
    took = time.monotonic() - begun
    wrong = faults(here, out, rows, inputs, known)
    if ended == "killed" and hidden(here, out):
        started(command, here, out).wait()
        wrong += [f"not removed by the next command: {name}" for name in hidden(here, out)]
    return took, ended, wrong


def hidden(here: Path, out: Path) -> list[str]:
    """Files and folders that a command had not finished: in its output, and among temporary files."""
    left = [p for p in out.rglob(".*") if p.name not in (".lock", ".damaged") and "new" not in p.relative_to(out).parts]
    return [p.name for p in (*left, *(here / "tmp").iterdir())]


def run() -> int:
    """Run; exit code 1 when something is not whole."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int, help="Kills.")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    random.seed(given.seed)
    wrong = kills = 0
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        rows = room(here)
        takes: dict[tuple[str, ...], float] = {}
        while kills < given.count:
            command = random.choice(COMMANDS) if len(takes) == len(COMMANDS) else COMMANDS[len(takes)]
            seconds, ended, found = killed(here, command, takes.get(command), rows)
            kills += ended == "killed"
            wrong += bool(found)
            takes.setdefault(command, seconds)
            print(f"{kills} {' '.join(command[:2])}: {ended} after {seconds:.1f} s", *found, sep="\n    ", flush=True)
    print(f"{kills} kills over {len(COMMANDS)} commands, {wrong} with something wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(run())
