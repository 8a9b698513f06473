"""Every command asked to end at any moment (Ctrl-C or SIGTERM), and how it does.

    python tests/interrupted_commands.py 60

runs each command once to learn its time, then that many with a signal at a random part of it. Ctrl-C goes to the
processes that a command started too, as from a terminal; each third begins without a compiled cache. A command has to
end with 130 or 143, within two seconds and what a busy machine adds, without a traceback, and to leave every file
whole and every version as committed, as after ``killed_commands.py``.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from killed_commands import _BB2, faults, room
from mutated_files import digest

from sim.boat.database import versions

_SUBOFF = _BB2.parent / "suboff"
COMMANDS = (
    ("fit", str(_BB2), "--db", "{here}/db"),
    ("fit", str(_SUBOFF), "--db", "{here}/db"),
    ("plan", str(_SUBOFF)),
    ("check", str(_BB2)),
    ("report", "--db", "{here}/flown", "--out", "{out}"),
    ("validate", "--case", "hzz20", "--db", "{here}/flown", "--out", "{out}"),
    ("validate", "--case", "hzz20", "--db", "{here}/flown", "--out", "{out}", "--samples", "2000"),
    ("validate", "--all", "--db", "{here}/flown", "--out", "{out}"),
    ("stability", "--db", "{here}/flown", "--json", "{out}/s.json"),
    ("calibrate", "bb2", "--db", "{here}/flown", "--no-left-out"),
    ("animate", "--case", "roll-decay", "--db", "{here}/flown", "--out", "{out}/a.gif"),
    ("doctor", "--db", "{here}/db", "--repair", "--json", "{out}/d.json"),
)


def asked(here: Path, command: tuple[str, ...], after: float, number: int, fresh: bool) -> tuple[str, list[str]]:
    """How a command ended, and what is wrong with it."""
    out = here / "out"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    given = [a.format(here=here, out=out) for a in command]
    env = {**os.environ, **({"NUMBA_CACHE_DIR": tempfile.mkdtemp(dir=here)} if fresh else {})}
    process = subprocess.Popen(
        [sys.executable, "-m", "ident.cli", *given],
        cwd=here,
        env=env,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    try:
        _, said = process.communicate(timeout=after)
        return f"done, exit code {process.returncode}", ["a traceback"] if b"Traceback" in said else []
    except subprocess.TimeoutExpired:
        pass
    begun = time.monotonic()
    (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    try:
        _, said = process.communicate(timeout=30.0)
    except subprocess.TimeoutExpired:
        process.kill()
        return "asked (0), exit code 0 after 30 s", ["does not end", process.communicate()[1].decode()[-1500:]]
    took = time.monotonic() - begun
    wrong = []
    if process.returncode != 128 + number and process.returncode != -number:
        wrong.append(f"exit code {process.returncode}")
    if b"Traceback" in said or b"Exception" in said:
        wrong.append(said.decode(errors="replace")[-1500:])
    if took > 4.0:
        wrong.append(f"{took:.1f} s")
    return f"asked after {after:.1f} s ({number}), exit code {process.returncode} after {took:.2f} s", wrong


def main() -> int:
    """Run; exit code 1 when something is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--longest", type=float, default=20.0, help="Latest moment [s].")
    given = parser.parse_args()
    random.seed(given.seed)
    bad, times = 0, []
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        rows = room(here)
        for k in range(given.count):
            command, fresh = COMMANDS[k % len(COMMANDS)], k % 3 == 2
            after = random.uniform(0.3, given.longest if k % 2 else 5.0)
            number = random.choice((signal.SIGINT, signal.SIGTERM))
            inputs, known = digest(str(here / "campaign")), len(versions(str(here / "db")))
            ended, wrong = asked(here, command, after, number, fresh)
            wrong += faults(here, here / "out", rows, inputs, known)
            bad += bool(wrong)
            times += [float(ended.split()[-2])] if ended.startswith("asked") else []
            print(
                f"{k} {' '.join(command[:2])}: {ended}{', no cache' if fresh else ''}", *wrong, sep="\n    ", flush=True
            )
    print(f"{len(times)} asked, longest {max(times, default=0.0):.2f} s, {bad} with something wrong")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
