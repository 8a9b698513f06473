"""Slips in campaign, vehicle and run files of several campaigns, thousands of them.

    python tests/sample_of_mutations.py 10000 slips.jsonl --sample 100

makes so many, counts by kind what is refused, found by a check, or accepted, and prints a hundred of those that nothing
spoke against, each with the lines that were changed and what became of the coefficients, to be read by eye. None may
end in a traceback, take a minute, or leave half a version: each fiftieth goes through ``ident.fit`` into a database.
"""

from __future__ import annotations

import argparse
import collections
import difflib
import hashlib
import json
import random
import re
import shutil
import signal
import tempfile
import time
import traceback
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import numpy as np
from slips_in_campaigns import slipped

import ident
from ident.captive import runs
from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.boat.database import read_rows, versions
from sim.files.errors import InputError

ROOT = Path(__file__).parents[1]
STARTER = ROOT / "ident" / "starter" / "files"
# The benchmark's sheets are not distributed with the program.
HMRI = ROOT.parent / "shared" / "datasets" / "kvlcc2_hmri_pmm"
# The starter's campaign file as far as its tables of runs; histories take their time.
TABLES = re.compile(r"(?s).*?files = \"\*\.csv\"\n")
# Seconds of a processor, whoever else works beside.
SLOWEST = 60


@dataclass
class Subject:
    """A campaign in a folder of its own, its files as they were, and what they lead to."""

    name: str
    folder: Path
    weight: float
    files: dict[Path, str] = field(default_factory=dict)
    usual: dict[str, list[float]] = field(default_factory=dict)
    loud: list[tuple[str, str, str]] = field(default_factory=list)


def subjects(place: Path, cases: Path | None) -> list[Subject]:
    """The starter's, the bundled, HMRI's sheets, and those of a folder of cases; each with its vehicle beside it."""
    vehicles = ROOT / "sim" / "vehicles"
    made = []

    def add(name: str, source: Path, weight: float, vehicle: str = "") -> Subject:
        folder = place / name
        shutil.copytree(source, folder)
        for path in (folder, *folder.rglob("*")):
            path.chmod(0o755 if path.is_dir() else 0o644)
        if vehicle:
            text = (vehicles / f"{vehicle}.toml").read_text("utf-8")
            (folder / "boat.toml").write_text(re.sub(r"(?m)^errata = .*\n", "", text), "utf-8")
            if (vehicles / vehicle).is_dir():
                shutil.copytree(vehicles / vehicle, folder / vehicle)
            text = (folder / "campaign.toml").read_text("utf-8")
            (folder / "campaign.toml").write_text(text.replace(f'"{vehicle}"', '"boat.toml"', 1), "utf-8")
        made.append(Subject(name, folder, weight))
        return made[-1]

    starter = add("starter", STARTER, 6.0)
    shutil.rmtree(starter.folder / "captive" / "histories")
    header = starter.folder / "captive" / "campaign.toml"
    header.write_text(TABLES.match(header.read_text("utf-8"))[0], "utf-8")
    starter.folder = starter.folder / "captive"
    histories = add("histories", STARTER, 1.0)
    for path in (histories.folder / "captive").glob("*.csv"):
        if path.stem not in ("drift_horizontal", "rudders"):
            path.unlink()
    histories.folder = histories.folder / "captive"
    add("bb2", ROOT / "raw_captive_data" / "bb2", 0.7, "bb2")
    add("suboff", ROOT / "raw_captive_data" / "suboff", 3.0, "suboff")
    add("kvlcc2", ROOT / "raw_captive_data" / "kvlcc2", 2.0, "kvlcc2")
    add("remus100", ROOT / "raw_captive_data" / "remus100", 1.0, "remus100")
    if HMRI.is_dir():
        sheets = add("hmri", HMRI, 2.0)
        for name in ("campaign.toml", "kvlcc2.toml"):
            shutil.copy(ROOT / "tests" / "data" / "kvlcc2" / name, sheets.folder)
    for k, toml in enumerate(sorted(cases.rglob("campaign.toml")) if cases else []):
        add(f"case{k:02d}-{toml.parent.parent.name[:2]}-{toml.parent.name}", toml.parent, 0.25)
    return made


def _files_kept() -> None:
    """A file that did not change, under a campaign whose keys did not, is not read again."""
    read, kept = runs._read, {}

    def once(folder, path, source, header, of_many=""):
        if path.is_dir():
            return read(folder, path, source, header, of_many)
        key = (
            str(path),
            hashlib.sha256(path.read_bytes()).digest(),
            source.model_dump_json(),
            header.model_dump_json(),
            of_many,
        )
        if key not in kept:
            if len(kept) > 2000:
                kept.clear()
            kept[key] = read(folder, path, source, header, of_many)
        table, *rest = kept[key]
        return (table.copy(), *rest)

    runs._read = once


def refused(_signal: int, _frame: FrameType | None) -> None:
    raise TimeoutError(f"longer than {SLOWEST} s")


# What campaigns led to, by folder and what was read of them: many a slip is in a comment.
_KNOWN: dict[tuple[str, ...], tuple] = {}


def _as_read(folder: Path, campaign) -> tuple[str, ...]:
    """All that a campaign without histories is fitted and checked by, but for what people write beside the runs."""
    runs = campaign.runs.drop(columns=["source"], errors="ignore")
    return str(folder), runs.to_csv(), repr(campaign.header), repr(campaign.vehicle)


def outcome(folder: Path):
    """Values by coefficient, findings and the refusal of a campaign."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            campaign = read_campaign(folder)
            known = _as_read(folder, campaign)
            if known in _KNOWN:
                return _KNOWN[known]
            found = identify(campaign)
            rows = database_rows(found)
            assert np.isfinite(rows[["value", "stderr"]].to_numpy()).all(), "not finite"
            findings = check_campaign(campaign, folder, found)
        except InputError as error:
            return {}, [], str(error)
    own = rows.groupby(["coefficient", "part"], sort=False)["value"].apply(list)
    led = {" ".join(k): v for k, v in own.items()}, findings, ""
    # The first is the campaign as it is.
    if not campaign.reduced and all(k[0] != str(folder) for k in _KNOWN):
        _KNOWN[known] = led
    return led


def fitted(folder: Path, db: Path) -> None:
    """A fit into a database: one version more that is whole, or none."""
    before = len(versions(str(db))) if db.exists() else 0
    try:
        ident.fit(folder, db)
    except InputError:
        assert (len(versions(str(db))) if db.exists() else 0) == before, "a version of what was refused"
        return
    assert len(versions(str(db))) in (before, before + 1)
    assert len(read_rows(str(db), None)[0])


def changes(before: dict[str, list[float]], after: dict[str, list[float]]) -> str:
    """Coefficients that changed, in words, those that changed most first."""
    gone = [n for n in {**before, **after} if (n in before) != (n in after)]
    both = [n for n in before if n in after and before[n] != after[n]]

    def apart(name: str) -> tuple[float, int]:
        one, two = before[name], after[name]
        if len(one) != len(two):
            return float("inf"), 0
        off = [abs(a - b) / max(abs(a), 1e-12) for a, b in zip(one, two, strict=True)]
        return max(off), int(np.argmax(off))

    both.sort(key=lambda n: -apart(n)[0])
    words = []
    for n in both[:4]:
        off, k = apart(n)
        words.append(f"{n}: {len(before[n])} -> {len(after[n])} values" if off == float("inf")
                     else f"{n} {before[n][k]:.4g} -> {after[n][k]:.4g}")  # fmt: skip
    words += [f"{n} {'gone' if n in before else 'new'}" for n in gone[:3]]
    return "; ".join(words) + (f"; ... {len(both)} changed, {len(gone)} came or went") if words else "nothing"


def loud(findings) -> list[tuple[str, str, str]]:
    """Check and severity of what is said aloud; and which terms are missing, for something always is."""
    words = [(f.check, f.severity, f.what if f.check == "missing" else "") for f in findings]
    return [w for w in words if w[1] != "info"]


def begin(subject: Subject) -> bool:
    """Its files, and what it leads to as it is."""
    names = [p for p in sorted(subject.folder.rglob("*")) if p.suffix in (".toml", ".csv", ".txt", ".out", ".dat")]
    own = [p for p in names if p.parent == subject.folder or "histories" in str(p) or "forces" in str(p)]
    own += list(subject.folder.parent.glob("my-boat.toml"))
    unread = re.compile("captive_static|channel_def|resistance|propeller_open|drift_and|static_rudder|yaw_with")
    own = [p for p in own if p.stat().st_size < 300_000 and not (subject.name == "hmri" and unread.match(p.name))]
    subject.files = {p: p.read_bytes().decode("utf-8", "surrogateescape") for p in own}
    subject.usual, findings, no = outcome(subject.folder)
    subject.loud = loud(findings)
    return not no


def one(subject: Subject, seed: int, db: Path) -> dict[str, object]:
    """One slip and what becomes of it."""
    rng = random.Random(f"slip {seed}")
    tomls = [p for p in subject.files if p.suffix == ".toml"]
    tables = [p for p in subject.files if p.suffix != ".toml"] or tomls
    path = rng.choice(tomls if rng.random() < 0.4 else tables)
    text = subject.files[path]
    kind, made = slipped(rng, path.name, text)
    line: dict[str, object] = {"seed": seed, "campaign": subject.name, "file": path.name, "kind": kind}
    line["slip"] = [d[:200] for d in difflib.unified_diff(text.split("\n"), made.split("\n"), lineterm="", n=0)
                    if not d.startswith(("---", "+++", "@@"))][:8]  # fmt: skip
    path.write_bytes(made.encode("utf-8", "surrogateescape"))
    begun = time.monotonic()
    signal.setitimer(signal.ITIMER_PROF, SLOWEST)
    try:
        values, findings, no = outcome(subject.folder)
        if seed % 50 == 0:
            fitted(subject.folder, db)
        if no:
            line |= {"what": "refused", "text": no[:400]}
        else:
            more = collections.Counter(loud(findings)) - collections.Counter(subject.loud)
            errors = [c for c, s, _ in more if s == "error"]
            what = "error" if errors else "warning" if more else "accepted"
            if what == "accepted" and values == subject.usual:
                what = "nothing changed"
            line |= {"what": what, "text": changes(subject.usual, values), "checks": sorted({c for c, *_ in more})}
    except Exception:
        line |= {"what": "fault", "text": traceback.format_exc()[-3000:]}
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        path.write_bytes(text.encode("utf-8", "surrogateescape"))
    line["s"] = round(time.monotonic() - begun, 2)
    return line


def main() -> None:
    """Make so many slips and write what became of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int)
    parser.add_argument("log", type=Path)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=Path, default=None, help="A folder of further campaigns.")
    parser.add_argument("--seeds", type=Path, default=None, help="A file of the seeds to make, and no others.")
    parser.add_argument("--sample", type=int, default=0)
    parser.add_argument("--only", default="", help="Campaigns whose name begins with it.")
    given = parser.parse_args()
    signal.signal(signal.SIGPROF, refused)
    _files_kept()
    counts: collections.Counter[tuple[str, str]] = collections.Counter()
    with tempfile.TemporaryDirectory() as folder, given.log.open("a", encoding="utf-8") as out:
        every = [s for s in subjects(Path(folder) / "campaigns", given.cases) if s.name.startswith(given.only)]
        begun: dict[str, bool] = {}
        chosen = map(int, given.seeds.read_text("utf-8").split()) if given.seeds else None
        for seed in chosen or range(given.first, given.first + given.count):
            rng = random.Random(f"campaign {seed}")
            # One that is refused as it is tells nothing.
            while True:
                subject = rng.choices(every, [s.weight for s in every])[0]
                if subject.name not in begun:
                    begun[subject.name] = begin(subject)
                if begun[subject.name]:
                    break
            line = one(subject, seed, Path(folder) / "db")
            counts[str(line["kind"]), str(line["what"])] += 1
            out.write(json.dumps(line) + "\n")
            out.flush()
    for (kind, what), number in sorted(counts.items()):
        print(f"{kind:40} {what:16} {number}")
    lines = [json.loads(x) for x in given.log.read_text("utf-8").splitlines()]
    for what in ("fault", "accepted"):
        some = [x for x in lines if x["what"] == what]
        for x in random.Random(1).sample(some, min(given.sample, len(some))):
            print(f"\n{x['seed']} {x['campaign']} {x['file']} [{x['kind']}]", *x["slip"], f"=> {x['text']}", sep="\n  ")


if __name__ == "__main__":
    main()
