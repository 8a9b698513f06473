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
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path

_RECORDED = Path("data") / "command_times.csv"
# How often each run of the campaign stands in the larger ones that are fitted too; with --million the last as well.
_REPEATED, _MILLION = (10, 100), 1725


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


def commands(campaign: Path, folder: Path, repeated: Sequence[int] = _REPEATED) -> dict[str, list[str]]:
    """Every command that is timed, in an order in which each finds what it needs.

    Parameters
    ----------
    campaign : Folder of runs of BB2.
    folder : Where database and reports go, and where ``larger`` puts its campaigns.
    repeated : How often each run stands in them.
    """
    db, out = ["--db", str(folder / "db")], ["--out", str(folder / "reports")]
    return {
        "ident fit raw_captive_data/bb2": ["fit", str(campaign), *db],
        "ident validate --case hzz20": ["validate", "--case", "hzz20", *db, *out],
        "ident report": ["report", *db, *out],
        "ident validate --all": ["validate", "--all", *db, *out],
        "ident validate --case hzz20 --samples 1000": ["validate", "--case", "hzz20", "--samples", "1000", *db, *out],
        "ident calibrate bb2": ["calibrate", "bb2", *db],
    } | {
        f"ident fit (each run {times:,} times)": ["fit", str(_place(folder, times)), "--db", str(folder / f"db{times}")]
        for times in repeated
    }


def _place(folder: Path, times: int) -> Path:
    return folder / f"x{times}"


def larger(campaign: Path, folder: Path, repeated: Sequence[int] = _REPEATED) -> None:
    """Write the campaigns whose fits are timed: each run of another repeated with 1 % noise on its loads.

    Parameters
    ----------
    campaign, folder, repeated : As of ``commands``.
    """
    from ident.fitting.bench import repeated_campaign

    for times in repeated:
        repeated_campaign(campaign, _place(folder, times), times)


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
    parser.add_argument("--million", action="store_true", help=f"also fit each run {_MILLION:,} times: some minutes")
    options = parser.parse_args()
    campaign, repeated = options.campaign.resolve(), (*_REPEATED, *[_MILLION] * options.million)
    measured = []
    with tempfile.TemporaryDirectory() as folder:
        larger(campaign, Path(folder), repeated)
        for name, arguments in commands(campaign, Path(folder), repeated).items():
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
