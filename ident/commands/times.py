"""What whole commands take, warm: ``python -m ident.commands.times CAMPAIGN --record``.

Every command is run twice in a process of its own and the second run counts: compiled functions and files are there
then. ``data/command_times.csv`` holds what was recorded on a machine with nothing else to do; README's table is
made from it.
"""

from __future__ import annotations

import argparse
import csv
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path

_RECORDED = Path("data") / "command_times.csv"


@dataclass(frozen=True)
class CommandTime:
    """One command.

    Attributes
    ----------
    command : As it is typed, without places.
    wall_s : From start to end.
    processor_s : Of all its processes.
    memory_GB : Of the largest of them.
    """

    command: str
    wall_s: float
    processor_s: float
    memory_GB: float


def commands(campaign: Path, folder: Path) -> dict[str, list[str]]:
    """Every command that is timed, in an order in which each finds what it needs.

    Parameters
    ----------
    campaign : Folder of runs of BB2.
    folder : Where database and reports go.
    """
    db, out = ["--db", str(folder / "db")], ["--out", str(folder / "reports")]
    return {
        "ident fit raw_captive_data/bb2": ["fit", str(campaign), *db],
        "ident validate --case hzz20": ["validate", "--case", "hzz20", *db, *out],
        "ident report": ["report", *db, *out],
        "ident validate --all": ["validate", "--all", *db, *out],
        "ident validate --case hzz20 --samples 1000": ["validate", "--case", "hzz20", "--samples", "1000", *db, *out],
        "ident calibrate bb2": ["calibrate", "bb2", *db],
    }


def timed(name: str, arguments: list[str]) -> CommandTime:
    """Run a command twice, the second time with the clock; raises when it fails."""
    command = [sys.executable, "-m", "ident.cli", *arguments]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    if code := os.waitstatus_to_exitcode(status):
        raise subprocess.CalledProcessError(code, command)
    peak = used.ru_maxrss / (2**30 if sys.platform == "darwin" else 2**20)
    return CommandTime(name, round(wall, 2), round(used.ru_utime + used.ru_stime, 2), round(peak, 2))


def recorded() -> list[CommandTime]:
    """What stands in ``data/command_times.csv``."""
    with (files("ident") / str(_RECORDED)).open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return [CommandTime(r["command"], *(float(r[k]) for k in ("wall_s", "processor_s", "memory_GB"))) for r in rows]


def main() -> None:
    """Print the times; with ``--record`` keep them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("campaign", type=Path, help="folder of the runs of BB2")
    parser.add_argument("--record", action="store_true", help="write data/command_times.csv; on an idle machine only")
    options = parser.parse_args()
    measured = []
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in commands(options.campaign.resolve(), Path(folder)).items():
            measured.append(timed(name, arguments))
            one = measured[-1]
            print(f"{name:45} {one.wall_s:7.2f} s, {one.processor_s:.2f} s of processor, {one.memory_GB:.2f} GB")
    if options.record:
        path = Path(__file__).parents[1] / _RECORDED
        with path.open("w", encoding="utf-8", newline="") as stream:
            table = csv.DictWriter(stream, list(CommandTime.__dataclass_fields__), lineterminator="\n")
            table.writeheader()
            table.writerows(asdict(one) for one in measured)


if __name__ == "__main__":
    main()
