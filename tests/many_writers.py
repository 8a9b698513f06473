"""Eight writers at once with readers, in a folder or in an object store, and what is there afterwards.

    python tests/many_writers.py --rounds 25
    python tests/many_writers.py --rounds 3 --store

Every commit has to be one version, versions have to count 0, 1, 2 without a gap, each with the digest of the rows its
writer committed, and every reading meanwhile has to give versions from 0 on and rows of the digest that their
version states. The object store is a server of moto on this machine (extra ``s3``).
"""

from __future__ import annotations

import argparse
import contextlib
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from database_writers import Writers
from object_store import object_store
from small_campaign import fitted, write

from sim.boat.database import digest, read_rows, versions
from sim.files.errors import InputError

_READER = """
import sys
from sim.boat.database import digest, find_version, read_rows, versions
path, count, last = sys.argv[1], 0, -1
try:
    for line in sys.stdin:
        seen = versions(path)
        numbers = [v.number for v in seen]
        assert numbers == list(range(len(numbers))), numbers
        rows, number = read_rows(path)
        assert number >= last, (number, last)
        assert digest(rows) == find_version(path, number).digest
        last, count = number, count + 1
except Exception as error:
    print("WRONG", type(error).__name__, error)
print(count, last)
"""


@contextlib.contextmanager
def place(folder: Path, store: bool) -> Iterator[tuple[str, dict[str, str]]]:
    """Where the database is to lie, and the environment that leads there."""
    if not store:
        yield str(folder / "db"), {}
        return
    with object_store() as (bucket, options):
        os.environ.update(options)
        yield f"{bucket}/db", options


def main() -> int:
    """Run; exit code 1 when something is lost or wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--writers", type=int, default=8)
    parser.add_argument("--readers", type=int, default=3)
    parser.add_argument("--rounds", type=int, default=25, help="Commits of each writer.")
    parser.add_argument("--store", action="store_true")
    given = parser.parse_args()
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as name, place(Path(name), given.store) as (path, options):
        rows = fitted(write(Path(name) / "campaign"))
        from ident.database.store import commit

        commit(path, rows, {"by": "first"})
        readers = [
            subprocess.Popen(
                [sys.executable, "-c", _READER, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
            for _ in range(given.readers)
        ]
        begun = time.monotonic()
        writers = Writers(path, [rows] * given.writers, given.rounds, options)
        results: list[tuple[int, bool]] = []
        waits = threading.Thread(target=lambda: results.extend(writers.done()))
        waits.start()
        while waits.is_alive():
            for one in readers:
                with contextlib.suppress(OSError):
                    one.stdin.write("read\n")
                    one.stdin.flush()
            waits.join(0.5)
        took = time.monotonic() - begun
        said = [one.communicate()[0].split("\n") for one in readers]
        wrong += [line for lines in said for line in lines if line.startswith("WRONG")]
        readings = sum(int(lines[-2].split()[0]) for lines in said)
        wanted = {
            f"{k}.{n}": 1.0 + 1e-4 * (1000 * k + n + 1) for k in range(given.writers) for n in range(given.rounds)
        }
        if sorted(n for n, _ in results) != list(range(1, len(wanted) + 1)) or not all(new for _, new in results):
            wrong.append(f"numbers of the commits: {sorted(results)[:5]} ...")
        history = versions(path)
        if [v.number for v in history] != list(range(len(wanted) + 1)):
            wrong.append(f"versions {[v.number for v in history]}")
        for version in history[1:]:
            by = version.metadata["by"]
            factor = wanted.pop(by, None)
            if factor is None:
                wrong.append(f"version {version.number} is of {by}, once more")
                continue
            try:
                there = digest(read_rows(path, version.number)[0])
            except InputError as error:
                wrong.append(str(error))
                continue
            if not there == version.digest == digest(rows.assign(value=rows["value"] * factor)):
                wrong.append(f"version {version.number} has not the rows of {by}")
        wrong += [f"lost: {by}" for by in wanted]
    where = "an object store" if given.store else "a folder"
    commits = given.writers * given.rounds
    print(
        f"{given.writers} writers, {commits} commits in {where} in {took:.0f} s, {readings} readings", *wrong, sep="\n"
    )
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
