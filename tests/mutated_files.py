"""Vehicle, case, reference, calibration and trial files with one to three slips each, and what becomes of them.

    python tests/mutated_files.py vehicle 10000 --log vehicle.txt

reads that many, in a process of its own each hundred, and lists what is no refusal and no result: a
traceback, a number that is none, a change of the database, or a mutant that takes longer than a minute.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from importlib.resources import files
from pathlib import Path

KINDS = ("vehicle", "case", "reference", "calibration", "trial")
_STARTER = files("ident") / "starter" / "files"
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")
_TEXT = re.compile(r'"([^"\n]*)"')
_WORDS = [
    *(
        "",
        " ",
        "0",
        "true",
        "nan",
        "[/]",
        "$\\\\bad$",
        "../x",
        "/",
        "a" * 300,
        "\\u0000",
        "\\u001b[31m",
        "%20",
        "é",
        "*",
        "[",
        "(a+)+$",
    ),
    *("hzz20", "bb2", "EXP", "psi", "m", "deg", "none", "fixed", "zigzag", "turning_circle", "sections", "utf-8"),
]
_CELLS = [
    "",
    "nan",
    "inf",
    "-1",
    "0",
    "1e9",
    "1e-9",
    "1e300",
    "x",
    "True",
    "--3",
    "1,5",
    "'",
    '"',
    "\x00",
    "９",
    "1e999",
]


def _number(rng: random.Random, text: str) -> str:
    value = float(text)
    scaled = [value * f for f in (-1.0, 0.0, 0.1, 10.0, 0.5, 2.0, 1e3, 1e-3, 1e6, 1e9, 57.3)]
    odd = ["nan", "inf", "true", '"1"', "[]", "{}", "[1, 2, 3]", "1" + "0" * 400, "-0.0", "1e-300", "1e15", "0x7f"]
    return rng.choice(odd) if rng.random() < 0.25 else f"{rng.choice(scaled):.10g}"


def mutant(rng: random.Random, text: str) -> str:
    """A text with one to three slips: of a number, a word, a key, a line, a character."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        kind = rng.choice(("number", "number", "number", "word", "swap words", "key", "drop", "double", "move", "byte"))
        lines = text.split("\n")
        at = rng.randrange(len(lines))
        if kind in ("number", "word"):
            found = list((_NUMBER if kind == "number" else _TEXT).finditer(text))
            if found:
                hit = rng.choice(found)
                new = _number(rng, hit[0]) if kind == "number" else f'"{rng.choice(_WORDS)}"'
                text = text[: hit.start()] + new + text[hit.end() :]
        elif kind == "swap words":
            found = list(_TEXT.finditer(text))
            if len(found) > 1:
                hit, other = rng.choice(found), rng.choice(found)
                text = text[: hit.start()] + other[0] + text[hit.end() :]
        elif kind == "key":
            found = list(re.finditer(r"(?m)^\s*(\w+)\s*=", text)) or list(re.finditer(r"\w+", text))
            hit = rng.choice(found)
            text = text[: hit.start()] + hit[0][:-2] + rng.choice("xyz") + hit[0][-2:] + text[hit.end() :]
        elif kind in ("drop", "double", "move"):
            line = lines[at]
            lines[at : at + 1] = [line, line] if kind == "double" else []
            if kind == "move":
                lines.insert(rng.randrange(len(lines) + 1), line)
            text = "\n".join(lines)
        else:
            at = rng.randrange(len(text) + 1)
            text = text[:at] + rng.choice("x-.,=[]{}\"'#\n0 9e\t\x00é;") + text[at + rng.randrange(2) :]
    return text


def mutated_table(rng: random.Random, text: str) -> str:
    """A CSV file with one to three slips: of a cell, a row, a column, a unit, or of a character."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        kind = rng.choice(("cell", "cell", "header", "column", "scale", "rows", "text"))
        rows = [line.split(",") for line in text.split("\n")]
        at, column = rng.randrange(len(rows)), rng.randrange(len(rows[0]))
        if kind == "text":
            text = mutant(rng, text)
            continue
        if kind == "header":
            name = rows[0][column]
            rows[0][column] = rng.choice((name.upper(), name[:-1], name + "x", "", "t", name + " [s]", "value"))
        elif kind == "cell" and column < len(rows[at]):
            rows[at][column] = rng.choice((*_CELLS, rows[at][column].upper(), rows[at][column] * 2))
        elif kind == "column":
            other = rng.randrange(len(rows[0]))
            for row in rows:
                if max(column, other) < len(row):
                    row[column], row[other] = row[other], row[column]
        elif kind == "scale":
            by = rng.choice((-1.0, 0.0, 1e-3, 1e3, 1e9, 57.3, 1.0 / 60.0))
            for row in rows[1:]:
                if column < len(row) and _NUMBER.fullmatch(row[column]):
                    row[column] = f"{by * float(row[column]):.9g}"
        elif kind == "rows":
            rows[at : at + rng.randrange(1, 40)] = []
            rows = rows or [[""]]
        text = "\n".join(",".join(row) for row in rows)
    return text


class Room:
    """A folder with whole files beside each other, and what is done with one of them."""

    def __init__(self, folder: Path, db: str) -> None:
        self.folder, self.db = folder, db
        self.rows: dict[str, object] = {}
        shutil.copytree(str(files("sim") / "vehicles"), folder / "vehicles", dirs_exist_ok=True)
        shutil.copytree(str(files("sim") / "cases"), folder / "cases", dirs_exist_ok=True)
        shutil.copytree(str(_STARTER), folder / "starter", dirs_exist_ok=True)
        shutil.copytree(str(files("ident") / "calibrations"), folder / "calibrations", dirs_exist_ok=True)
        for case in (folder / "cases").glob("*.toml"):
            text = re.sub(r"(?m)^duration_s = .*", "duration_s = 8.0", case.read_text("utf-8"))
            case.write_text(text, "utf-8")
        (folder / "trial.toml").write_text(
            'maneuver = "zigzag 10/10"\nscale = 1.0\nlength_m = 10.0\nwrap_deg = 360\nsource = "made up"\n'
            "execute_s = 0.0\n\n[initial]\nheading_deg = 0.0\n\n[noise]\nheading_deg = 0.1\nspeed_mps = 0.01\n"
            "\n[current]\nspeed_mps = 0.1\nto_deg = 90.0\ncorrect = false\n",
            "utf-8",
        )
        self.whole = {
            "vehicle": ("vehicles/bb2.toml", "starter/my-boat.toml", "vehicles/suboff.toml"),
            "case": ("cases/hzz20.toml", "cases/ss5-4m.toml", "cases/turn20-4m.toml", "cases/roll-decay.toml",
                     "cases/depth-change.toml", "starter/zigzag.toml"),
            "reference": ("cases/data/hzz20.csv", "cases/data/roll_decay.csv", "cases/data/turn20_23.69m.csv"),
            "calibration": ("calibrations/bb2.toml", "calibrations/bb2-predicted.toml", "starter/calibration.toml"),
            "trial": ("trial.toml", "starter/zigzag_trial.csv"),
        }  # fmt: skip
        self.given = {n: (folder / n).read_text("utf-8") for names in self.whole.values() for n in names}

    def written(self, kind: str, seed: int) -> tuple[Path, str]:
        """A mutant in the place of its original, and the name of that."""
        rng = random.Random(f"{kind} {seed}")
        name = rng.choice(self.whole[kind])
        text = self.given[name]
        path = self.folder / name
        made = mutated_table(rng, text) if name.endswith(".csv") else mutant(rng, text)
        path.write_text(made, "utf-8", newline="")
        return path, name

    def restore(self, name: str) -> None:
        (self.folder / name).write_text(self.given[name], "utf-8")

    def used(self, kind: str, path: Path) -> str:
        """What a command does with a file, short of what takes minutes; raises what the command shows as a message."""
        import ident

        if kind == "vehicle":
            if "starter" in str(path):
                case = self.folder / "starter" / "zigzag.toml"
            else:
                case = self.folder / "cases" / ("suboff-hzz10.toml" if "suboff" in path.name else "roll-decay.toml")
            return said(ident.validate(case, self.db, vehicle=path).to_dict())
        if kind == "case":
            return said(ident.validate(path, self.db).to_dict())
        if kind == "reference":
            case = {"hzz20": "hzz20", "roll_decay": "roll-decay", "turn20_23.69m": "turn20-23.69m"}[path.stem]
            return said(ident.validate(self.folder / "cases" / f"{case}.toml", self.db, reference=path).to_dict())
        if kind == "calibration":
            return self.calibrated(path)
        spec = self.folder / "trial.toml"
        from ident.trials.spec import load_spec
        from ident.trials.trial import measure_trial

        return said(measure_trial(self.folder / "starter" / "zigzag_trial.csv", load_spec(spec), count=8).to_dict())

    def calibrated(self, path: Path) -> str:
        """A calibration as far as before its first flight, which takes minutes from there on."""
        from ident.calibration.file import load_calibration, parameters
        from ident.calibration.problem import problem
        from ident.estimates.draft import measured_rows
        from sim.boat.database import read_rows
        from sim.boat.vehicle import load_vehicle

        spec, where, _ = load_calibration(path)
        vehicle = load_vehicle(spec.vehicle, beside=where)
        if vehicle.name not in self.rows:
            self.rows[vehicle.name] = read_rows(self.db, None, vehicle=vehicle.name)[0]
        rows = self.rows[vehicle.name]
        rows = measured_rows(rows) if spec.starts_from == "runs" else rows
        chosen = parameters(spec, vehicle, rows, where)
        task = problem(spec, where, vehicle, rows, chosen)
        return said({"groups": {p.group.name: [p.mean, p.sigma] for p in chosen}, "channels": len(task.channels)})


def said(result: object) -> str:
    """A result as JSON, whose numbers are numbers."""
    return json.dumps(result, allow_nan=False, default=str)


def outcome(room: Room, kind: str, seed: int) -> tuple[str, str]:
    """``refused``, ``accepted`` or ``fault``, and the message, the result or the traceback."""
    from sim.files.errors import InputError
    from sim.flight.trim import NoEquilibrium

    path, name = room.written(kind, seed)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            return "accepted", room.used(kind, path)
    except (InputError, NoEquilibrium) as error:
        return "refused", f"{type(error).__name__} {error}"
    except Exception:
        return "fault", traceback.format_exc()
    finally:
        room.restore(name)


def database(folder: Path) -> str:
    """A database to use, and nothing else: its files' digest is asked for again after each hundred."""
    import ident

    db = str(folder / "db")
    ident.fit(Path(__file__).resolve().parents[1] / "raw_captive_data", db)
    ident.fit(str(_STARTER / "captive"), db)
    return db


def digest(folder: str) -> str:
    """SHA-256 over names and contents of every file below a folder."""
    whole = hashlib.sha256()
    for path in sorted(p for p in Path(folder).rglob("*") if p.is_file()):
        whole.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return whole.hexdigest()


def _some(kind: str, first: int, last: int, db: str, log: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        room = Room(Path(folder), db)
        with log.open("a", encoding="utf-8") as out:
            for seed in range(first, last):
                out.write(f"{seed} begun\n")
                out.flush()
                begun = time.monotonic()
                what, text = outcome(room, kind, seed)
                took = time.monotonic() - begun
                out.write(json.dumps({"seed": seed, "what": what, "text": text[-3000:], "s": round(took, 2)}) + "\n")
                out.flush()


def main() -> int:
    """Run; exit code 1 when there is a fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("count", type=int)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--log", type=Path, default=None)
    parser.add_argument("--db", default="", help="A database with bb2, suboff and my-boat; fitted when left out.")
    parser.add_argument("--slowest", type=float, default=60.0, help="Longest time for one of them [s].")
    parser.add_argument("--some", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    log = given.log or Path(f"{given.kind}.txt")
    if given.some:
        _some(given.kind, given.first, given.first + given.count, given.db, log)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        db = given.db or database(Path(folder))
        before = digest(db)
        slow = _watched(given, db, log)
        changed = digest(db) != before
    found = [json.loads(line) for line in log.read_text("utf-8").splitlines() if line.startswith("{")]
    count = {w: sum(f["what"] == w for f in found) for w in ("accepted", "refused", "fault")}
    print(f"{given.kind}: {count}, slower than {given.slowest:g} s: {slow}, database changed: {changed}")
    return int(bool(count["fault"] or slow or changed))


def _watched(given: argparse.Namespace, db: str, log: Path) -> list[int]:
    """Mutants that took too long; each hundred in a process that is ended when one does."""
    kind, first, last = given.kind, given.first, given.first + given.count
    slow: list[int] = []
    while first < last:
        upto = min(first + 100, last)
        command = [sys.executable, __file__, kind, str(upto - first), "--first", str(first), "--db", db]
        with subprocess.Popen([*command, "--log", str(log), "--some"]) as process:
            seen, since = 0, time.monotonic()
            while process.poll() is None:
                time.sleep(0.5)
                size = log.stat().st_size if log.exists() else 0
                if size != seen:
                    seen, since = size, time.monotonic()
                elif time.monotonic() - since > given.slowest:
                    process.kill()
            done = process.returncode
        at = upto
        if done:
            at = int([x for x in log.read_text("utf-8").splitlines() if x.endswith(" begun")][-1].split()[0])
            slow.append(at)
            at += 1
        first = at
    return slow


if __name__ == "__main__":
    sys.exit(main())
