"""Files that users write, with one to three slips each, and what becomes of them.

    python tests/mutated_files.py vehicle 10000 --log vehicle.txt

reads that many vehicle files (or cases, references, calibrations, trials, campaigns), in a process of its own each
thousand; each tenth is flown, measured or fitted as a command does, the others are read and checked. It lists
what is no refusal and no result: a traceback, a number that is none, a process that died, a change of the database,
or a mutant that takes longer than a minute. ``--sample 100`` prints that many of those that were used, each with its
slips and with what became of it, to be read by eye.
"""

from __future__ import annotations

import argparse
import difflib
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
from typing import TYPE_CHECKING

from slips_at_random import mutant, mutated_table
from slips_of_a_hand import statement, table

if TYPE_CHECKING:
    import pandas as pd

    from ident.calibration.file import CalibrationFile
    from ident.estimates.carry_over import CarryOver
    from ident.validation.boats import Boat, Fleet
    from sim.boat.vehicle import Vehicle
    from sim.flight.case import Case
    from sim.flight.simulation import Simulation
    from sim.kernel.layout import Model
    from sim.waves.in_waves import Water

KINDS = ("vehicle", "case", "reference", "calibration", "trial", "campaign")
# Mutants a process reads: a death costs the rest of them, a start some seconds.
_EACH = 1000
_STARTER = files("ident") / "starter" / "files"
# What takes seconds each is drawn less often.
_TESTS_KEPT = ("drift_horizontal", "rotation_r", "towing", "open_water", "self_propulsion")
_RARE = {"cases/ss5-4m.toml": 0.1, "calibrations/bb2-predicted.toml": 0.03}


def _fleet(db: str) -> Fleet:
    """A database version read and checked once, which forgets the boats of earlier mutants."""
    from ident.validation.boats import Fleet

    class Forgetful(Fleet):
        def boat(self, vehicle: Vehicle) -> Boat:
            if len(self._boats) > 8:
                self._boats.clear()
            return super().boat(vehicle)

    return Forgetful(db)


def _work_kept() -> None:
    """What was flown is not flown again, nor a vehicle's planes computed again: most mutants ask for the same."""
    import ident.estimates.carry_over as planes
    import ident.validation.validate as flying

    fly, kept = flying.fly, {}
    carry_over, carried = planes.carry_over, {}

    def once(case: Case, vehicle: Vehicle, model: Model, water: Water | None = None) -> Simulation:
        asked = case.model_copy(update={"reference": None, "tolerance": [], "published": []})
        key = (asked.model_dump_json(), vehicle.model_dump_json())
        if key not in kept:
            if len(kept) > 64:
                kept.clear()
            kept[key] = fly(case, vehicle, model, water)
        return kept[key]

    def once_a_vehicle(vehicle: Vehicle) -> CarryOver:
        key = vehicle.model_dump_json()
        if key not in carried:
            carried[key] = carry_over(vehicle)
        return carried[key]

    flying.fly, planes.carry_over = once, once_a_vehicle


class Room:
    """A folder with whole files beside each other, and what is done with one of them."""

    def __init__(self, folder: Path, db: str, each: int = 1, by_hand: bool = False) -> None:
        self.folder, self.db, self.each, self.by_hand = folder, db, each, by_hand
        self.rows: dict[str, pd.DataFrame] = {}
        self.fleet = _fleet(db)
        self.asked = 0
        shutil.copytree(str(files("sim") / "vehicles"), folder / "vehicles", dirs_exist_ok=True)
        shutil.copytree(str(files("sim") / "cases"), folder / "cases", dirs_exist_ok=True)
        shutil.copytree(str(_STARTER), folder / "starter", dirs_exist_ok=True)
        shutil.copytree(str(files("ident") / "calibrations"), folder / "calibrations", dirs_exist_ok=True)
        for runs in (folder / "starter" / "captive").glob("*.csv"):
            if runs.stem not in _TESTS_KEPT:
                runs.unlink()
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
            "campaign": ("starter/captive/campaign.toml", "starter/captive/drift_horizontal.csv",
                         "starter/captive/open_water.csv", "starter/captive/self_propulsion.csv"),
        }  # fmt: skip
        self.given = {n: (folder / n).read_text("utf-8") for names in self.whole.values() for n in names}

    def written(self, kind: str, seed: int) -> tuple[Path, str]:
        """A mutant in the place of its original, and the name of that."""
        rng = random.Random(f"{kind} {seed}")
        self.asked = seed
        name = rng.choices(self.whole[kind], [_RARE.get(n, 1.0) for n in self.whole[kind]])[0]
        text = self.given[name]
        path = self.folder / name
        of_table, of_statement = (table, statement) if self.by_hand else (mutated_table, mutant)
        made = text
        while made == text:
            made = of_table(rng, text) if name.endswith(".csv") else of_statement(rng, text)
        path.write_text(made, "utf-8", newline="")
        return path, name

    def restore(self, name: str) -> None:
        (self.folder / name).write_text(self.given[name], "utf-8")

    def used(self, kind: str, path: Path) -> str:
        """What a command does with a file, short of what takes minutes; raises what the command shows as a message."""
        from ident.validation.validate import validated

        if self.asked % self.each:
            return self.read(kind, path)
        if kind == "vehicle":
            if "starter" in str(path):
                case = self.folder / "starter" / "zigzag.toml"
            else:
                case = self.folder / "cases" / ("suboff-hzz10.toml" if "suboff" in path.name else "roll-decay.toml")
            return said(validated(case, self.fleet, vehicle=path).to_dict())
        if kind == "case":
            return said(validated(path, self.fleet).to_dict())
        if kind == "reference":
            return said(validated(self.held(path), self.fleet, reference=path).to_dict())
        if kind == "calibration":
            return self.calibrated(path)
        if kind == "campaign":
            return fitted(self.folder / "starter" / "captive")
        spec = self.folder / "trial.toml"
        from ident.trials.spec import load_spec
        from ident.trials.trial import measure_trial

        return said(measure_trial(self.folder / "starter" / "zigzag_trial.csv", load_spec(spec), count=8).to_dict())

    def read(self, kind: str, path: Path) -> str:
        """What is done with a file before anything is flown, checked against another or fitted."""
        from ident.calibration.file import load_calibration, parameters
        from ident.captive.campaign import read_campaign
        from ident.options import Conditions
        from ident.trials.consistency import check_recording
        from ident.trials.earth import in_program_axes
        from ident.trials.maneuvers import maneuver_of
        from ident.trials.reading import read_recording
        from ident.trials.spec import load_spec
        from ident.trials.spikes import without_spikes
        from ident.validation.validate import _held_against
        from sim.boat.vehicle import load_vehicle

        if kind == "vehicle":
            ship = load_vehicle(path)
            return said({"vehicle": ship.model_dump(), "rows": len(self.fleet.boat(ship).rows)})
        if kind == "case":
            held, ship, _, notes = _held_against(path, None, Conditions(), None)
            return said({"case": held.case.model_dump(), "vehicle": ship.name, "notes": notes})
        if kind == "reference":
            held, _, _, notes = _held_against(self.held(path), None, Conditions(), path)
            rows = {s: sorted(channels) for s, channels in held.series.data.items()}
            return said({"rows": rows, "notes": notes})
        if kind == "calibration":
            spec, where, _ = load_calibration(path)
            vehicle, rows = self.calibrates(spec, where)
            return said({p.group.name: [p.mean, p.sigma] for p in parameters(spec, vehicle, rows, where)})
        if kind == "campaign":
            campaign = read_campaign(self.folder / "starter" / "captive")
            return said({"runs": len(campaign.runs), "refused": [str(r) for r in campaign.refused]})
        spec = load_spec(self.folder / "trial.toml")
        recording = read_recording(self.folder / "starter" / "zigzag_trial.csv", spec)
        recording = in_program_axes(without_spikes(recording), spec)
        remarks = [f.check for f in check_recording(recording)]
        return said({"maneuver": maneuver_of(recording, spec.maneuver)[0].kind, "remarks": remarks})

    def held(self, reference: Path) -> Path:
        """The case of a reference's file."""
        case = {"hzz20": "hzz20", "roll_decay": "roll-decay", "turn20_23.69m": "turn20-23.69m"}[reference.stem]
        return self.folder / "cases" / f"{case}.toml"

    def calibrates(self, spec: CalibrationFile, where: str) -> tuple[Vehicle, pd.DataFrame]:
        """Vehicle and rows that a calibration is of."""
        from ident.estimates.draft import measured_rows
        from sim.boat.database import read_rows
        from sim.boat.vehicle import load_vehicle

        vehicle = load_vehicle(spec.vehicle, beside=where)
        if vehicle.name not in self.rows:
            self.rows[vehicle.name] = read_rows(self.db, None, vehicle=vehicle.name)[0]
        rows = self.rows[vehicle.name]
        return vehicle, measured_rows(rows) if spec.starts_from == "runs" else rows

    def calibrated(self, path: Path) -> str:
        """A calibration as far as before its first flight, which takes minutes from there on."""
        from ident.calibration.file import load_calibration, parameters
        from ident.calibration.problem import problem

        spec, where, _ = load_calibration(path)
        vehicle, rows = self.calibrates(spec, where)
        chosen = parameters(spec, vehicle, rows, where)
        task = problem(spec, where, vehicle, rows, chosen)
        return said({"groups": {p.group.name: [p.mean, p.sigma] for p in chosen}, "channels": len(task.channels)})


def fitted(folder: Path) -> str:
    """A campaign read, checked and identified, as far as before its commit."""
    from ident.captive.campaign import read_campaign
    from ident.checks.check import check_campaign
    from ident.database.store import database_rows
    from ident.identification.identify import identify
    from sim.boat.database import digest as digest_of

    campaign = read_campaign(folder)
    remarks = check_campaign(campaign, folder)
    stopped = sorted({f.check for f in remarks if f.severity == "error"})
    if stopped:
        return said({"errors": stopped})
    rows = database_rows(identify(campaign))
    for column in ("value", "stderr"):
        said(rows[column].tolist())
    return said({"digest": digest_of(rows), "remarks": sorted({f.check for f in remarks})})


def said(result: object) -> str:
    """A result as JSON, whose numbers are numbers."""
    return json.dumps(result, allow_nan=False, default=str)


def slips(room: Room, path: Path, name: str) -> list[str]:
    """Lines that a mutant lost (-) and got (+)."""
    given, made = room.given[name].split("\n"), path.read_bytes().decode("utf-8").split("\n")
    lines = [x for x in difflib.unified_diff(given, made, lineterm="", n=0) if not x.startswith(("---", "+++", "@@"))]
    lost, got = ([x[:160] for x in lines if x[0] == sign] for sign in "-+")
    return [*lost[:4], *got[:4], f"{len(lost)} lines lost, {len(got)} got"]


def outcome(room: Room, kind: str, seed: int) -> tuple[str, str, list[str]]:
    """``refused``, ``accepted`` or ``fault``; the message, the result or the traceback; and the slips."""
    from sim.files.errors import InputError
    from sim.flight.trim import NoEquilibrium

    path, name = room.written(kind, seed)
    made = [name, *slips(room, path, name)]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            return "accepted", room.used(kind, path), made
    except (InputError, NoEquilibrium) as error:
        return "refused", f"{type(error).__name__} {error}", made
    except Exception:
        return "fault", traceback.format_exc(), made
    finally:
        room.restore(name)


def database(folder: Path) -> str:
    """A database to use, and nothing else: its files' digest is asked for again at the end."""
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


def _some(kind: str, first: int, last: int, db: str, log: Path, each: int, by_hand: bool) -> None:
    _work_kept()
    with tempfile.TemporaryDirectory() as folder:
        room = Room(Path(folder), db, each, by_hand)
        with log.open("a", encoding="utf-8") as out:
            for seed in range(first, last):
                out.write(f"{seed} begun\n")
                out.flush()
                begun = time.monotonic()
                what, text, made = outcome(room, kind, seed)
                took = round(time.monotonic() - begun, 2)
                line = {"seed": seed, "what": what, "text": text[-3000:], "s": took, "slips": made}
                out.write(json.dumps(line) + "\n")
                out.flush()


def main() -> int:
    """Run; exit code 1 when there is a fault."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("count", type=int)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--log", type=Path, default=None, help="Begun anew; KIND.txt when left out.")
    parser.add_argument("--db", default="", help="A database with bb2, suboff and my-boat; fitted when left out.")
    parser.add_argument("--slowest", type=float, default=60.0, help="Longest time for one of them [s].")
    parser.add_argument("--sample", type=int, default=0, help="Print so many of those that were used.")
    parser.add_argument("--whole-each", type=int, default=10, help="Each so many-th is flown or fitted; all are read.")
    parser.add_argument("--by-hand", action="store_true", help="Slips that people make: slips_of_a_hand.py.")
    parser.add_argument("--some", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    log = given.log or Path(f"{given.kind}.txt")
    if given.some:
        _some(given.kind, given.first, given.first + given.count, given.db, log, given.whole_each, given.by_hand)
        return 0
    log.write_text("", "utf-8")
    with tempfile.TemporaryDirectory() as folder:
        db = given.db or database(Path(folder))
        before = digest(db)
        slow, died = _watched(given, db, log)
        changed = digest(db) != before
    lines = [json.loads(line) for line in log.read_text("utf-8").splitlines() if line.startswith("{")]
    count = {w: sum(x["what"] == w for x in lines) for w in ("accepted", "refused", "fault")}
    print(f"{given.kind}: {count}, slower than {given.slowest:g} s: {slow}, died: {died}, database changed: {changed}")
    used = [x for x in lines if x["what"] == "accepted"]
    for one in random.Random(0).sample(used, min(given.sample, len(used))):
        print(f"\n{one['seed']} {one['slips'][0]}", *one["slips"][1:], one["text"][:300], sep="\n  ")
    return int(bool(count["fault"] or slow or died or changed))


def _watched(given: argparse.Namespace, db: str, log: Path) -> tuple[list[int], list[int]]:
    """Mutants that took too long, and those at which a process died by itself."""
    kind, first, last = given.kind, given.first, given.first + given.count
    slow: list[int] = []
    died: list[int] = []
    while first < last:
        upto = min(first + _EACH, last)
        command = [sys.executable, __file__, kind, str(upto - first), "--first", str(first), "--db", db]
        command += ["--whole-each", str(given.whole_each), *(["--by-hand"] if given.by_hand else [])]
        ended = False
        with subprocess.Popen([*command, "--log", str(log), "--some"]) as process:
            started, seen, since = False, -1, time.monotonic()
            while process.poll() is None:
                time.sleep(0.5)
                size = log.stat().st_size
                if size != seen:
                    # A start takes some seconds more.
                    started, seen, since = seen >= 0, size, time.monotonic()
                elif time.monotonic() - since > given.slowest * (1 if started else 10):
                    process.kill()
                    ended = True
            done = process.returncode
        if not done:
            first = upto
            continue
        begun = [int(x.split()[0]) for x in log.read_text("utf-8").splitlines() if x.endswith(" begun")]
        if not begun or begun[-1] < first:
            raise SystemExit(f"the process for {first} to {upto} died before its first mutant")
        (slow if ended else died).append(begun[-1])
        first = begun[-1] + 1
    return slow, died


if __name__ == "__main__":
    sys.exit(main())
