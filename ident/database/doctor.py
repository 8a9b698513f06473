"""Examine every version of a database, say what can be restored from what, and restore it."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.captive.campaign import Campaign, find_campaigns, read_campaign
from ident.captive.combine import by_vehicle
from ident.database.lock import WAIT, held
from ident.database.store import FOR_EVER, arrow, commit_again, database_rows
from ident.identification.identify import identify
from sim.boat.database import check_digests, column_order, digest, matches, open_table, stored_rows
from sim.boat.delta_log import LATEST, LOG, Log, Version, latest_said
from sim.files.errors import InputError
from sim.files.storage import Storage, address, engine
from sim.files.temporary import temporary_folder

if TYPE_CHECKING:
    import pandas as pd

# Where damaged files go: nothing is deleted.
ASIDE = ".damaged"


@dataclass(frozen=True)
class Examined:
    """What was seen of one version.

    Attributes
    ----------
    version : Number.
    vehicle, digest : Of its commit; empty where the commit is damaged or another program's.
    fault : Empty when every row is the one committed.
    restore : From what its rows can be restored; empty when they cannot, or need not.
    """

    version: int
    vehicle: str
    digest: str
    fault: str
    restore: str


@dataclass(frozen=True)
class Examination:
    """What was seen of a database.

    Attributes
    ----------
    database : Folder or URL.
    versions : Every version, oldest first.
    notes : Of the log and its folder.
    repaired : What was done.
    """

    database: str
    versions: list[Examined]
    notes: list[str]
    repaired: list[str]

    @property
    def whole(self) -> bool:
        """Whether every version is as it was committed."""
        return not any(v.fault for v in self.versions)

    def to_dict(self) -> dict[str, Any]:
        """For a program to read."""
        return {**asdict(self), "whole": self.whole}


Rows = dict[tuple[str, str], tuple[str, "pd.DataFrame"]]
# What a fit adds to the rows that the runs alone gave; fits stand above this room.
Completed = Callable[[Campaign, "pd.DataFrame"], "pd.DataFrame"]


def examine(
    path: str,
    folders: tuple[Path, ...] = (),
    each: Callable[[str], None] = lambda text: None,
    completed: Completed | None = None,
) -> Examination:
    """Read every version of a database and check every row of it.

    Parameters
    ----------
    path : Folder or object-store URL of the database.
    folders : Campaigns, or folders of campaigns, that rows may be restored from.
    each : Called with a line of text as the work goes on.

    Raises
    ------
    InputError
        When there is no database, or a campaign cannot be read.
    """
    log = Log(path, holes=True)
    faults = _faults(log, each)
    sources = _sources(log, faults, folders, completed) if any(faults.values()) else {}
    seen = []
    for number, fault in faults.items():
        said = _entry(log, number)
        vehicle = said.metadata.get("vehicle", "") if said else ""
        wanted = _wanted(log, number)
        restore = ""
        if fault and wanted and all(item in sources for item in wanted.items()):
            restore = ", ".join(dict.fromkeys(sources[item][0] for item in wanted.items()))
        seen.append(Examined(number, vehicle, said.digest if said else "", fault, restore))
    notes = [f"the log begins at version {log.first}: earlier ones were deleted"] if log.first else []
    if faults[log.last] and _entry(log, log.last) is None:
        notes.append(f"the entry of version {log.last} is lost; --repair goes back to the version before it")
    elif _stopped_by_a_checkpoint(log):
        notes.append("a checkpoint cannot be read; the entries of the log are all there: --repair sets it aside")
    return Examination(path, seen, notes, [])


def _faults(log: Log, each: Callable[[str], None]) -> dict[int, str]:
    faults = {}
    for number in range(log.first, log.last + 1):
        each(f"version {number} of {log.last}")
        try:
            log.entry(number)
            check_digests(log, number, stored_rows(log, number))
            faults[number] = ""
        except InputError as error:
            faults[number] = error.found
    return faults


def _entry(log: Log, number: int) -> Version | None:
    try:
        return log.entry(number).version
    except InputError:
        return None


def _lost(log: Log) -> list[int]:
    return [n for n in range(log.first, log.last + 1) if _entry(log, n) is None]


def _wanted(log: Log, number: int) -> dict[str, str]:
    """Vehicle -> digest that a version should have; empty when the entries that say so are lost."""
    try:
        expected, complete = log.contents(number)
    except InputError:
        return {}
    return expected if complete and "" not in expected else {}


def _sources(log: Log, faults: dict[int, str], folders: tuple[Path, ...], completed: Completed | None) -> Rows:
    """(Vehicle, digest) -> where rows of that digest are, and the rows."""
    sources: Rows = {}
    for number in faults:
        wanted = _wanted(log, number)
        try:
            everything = stored_rows(log, number)
        except InputError:
            continue
        # One vehicle's rows may be damaged and another's not.
        for vehicle, content in wanted.items():
            rows = everything[everything["vehicle"] == vehicle]
            if (vehicle, content) not in sources and matches(log, number, rows, content):
                sources[vehicle, content] = (f"version {number}", rows)
    commits = [v for n in faults if (v := _entry(log, n)) is not None and v.digest]
    for folder in folders:
        places = find_campaigns(folder)
        every = [read_campaign(where, leave_out=True) for where in places]
        whole, above = by_vehicle(every, places)
        for where, campaign in dict(zip([*places, *above], [*every, *whole], strict=True)).items():
            same = [v for v in commits if json.loads(v.metadata.get("inputs", "null")) == campaign.digests]
            if not same or campaign.refused:
                continue
            rows = database_rows(identify(campaign))
            for one in [rows, *([completed(campaign, rows)] if completed else [])]:
                sources.setdefault((campaign.vehicle.name, digest(one)), (f"campaign {where}", one))
    return sources


def repair(
    path: str,
    folders: tuple[Path, ...] = (),
    wait: float = WAIT,
    each: Callable[[str], None] = lambda text: None,
    completed: Completed | None = None,
) -> Examination:
    """Restore what can be restored; damaged files are set aside, none is deleted.

    Data files are written again from rows of the same digest where that gives a file of the size the
    log names; else, for the latest version, the rows are committed again as a new version. A
    lost last entry of the log sets the database back to the version before it. Checkpoints that
    cannot be read are set aside when all entries are there.

    Parameters
    ----------
    path : Folder of the database.
    folders, each, completed : As of ``examine``.
    wait : How long to wait for another writer [s].
    completed : What a fit adds to the rows that runs alone gave (``ident.fitting.fit.completed``); a commit may
        be of either.

    Returns
    -------
    As the database is afterwards.

    Raises
    ------
    InputError
        As ``examine``, and for an object store.
    """
    local = Storage(path).local
    if local is None:
        raise InputError(path, "an object store", "a folder; copy the database and repair the copy")
    before = examine(path, folders, each, completed)
    if before.whole:
        return before
    done: list[str] = []
    with held(local, wait):
        log = Log(path, holes=True)
        done += _log_mended(local, log)
        log = Log(path)
        faults = _faults(log, each)
        sources = _sources(log, faults, folders, completed) if any(faults.values()) else {}
        for number, fault in faults.items():
            if fault:
                done += _files_mended(local, log, number, sources)
        faults = _faults(Log(path), each)
        if faults[log.last]:
            done += _latest_again(path, log, faults[log.last], sources)
    after = examine(path, folders, each, completed)
    return Examination(after.database, after.versions, after.notes, done)


def _set_aside(local: Path, file: Path) -> None:
    aside = local / ASIDE
    aside.mkdir(exist_ok=True)
    target = aside / file.name
    number = 0
    while target.exists():
        number += 1
        target = aside / f"{file.name}.{number}"
    file.rename(target)


def _checkpoints(log: Log) -> list[Path]:
    local = log.storage.local
    return [] if local is None else sorted([*(local / LOG).glob("*.checkpoint*"), *(local / LOG).glob("_last_check*")])


def _stopped_by_a_checkpoint(log: Log) -> bool:
    """Whether the table cannot be opened though every entry of its log is there."""
    if log.first or _lost(log) or not _checkpoints(log):
        return False
    try:
        open_table(log.path, log.last, log)
    except InputError:
        return True
    return False


def _log_mended(local: Path, log: Log) -> list[str]:
    done = []
    lost = _lost(log)
    if lost and lost == list(range(lost[0], log.last + 1)) and lost[0] > log.first:
        for number in lost:
            file = local / LOG / f"{number:020d}.json"
            if file.exists():
                _set_aside(local, file)
        back = lost[0] - 1
        if (latest_said(log.storage) or 0) > back:
            log.storage.write(LATEST, json.dumps({"version": back}).encode())
        done.append(f"set back to version {back}: the entry of version {lost[0]} is lost")
    elif _stopped_by_a_checkpoint(log):
        for file in _checkpoints(log):
            _set_aside(local, file)
            done.append(f"set {file.name} aside: the entries of the log say all it said")
    return done


def _files_mended(local: Path, log: Log, number: int, sources: Rows) -> list[str]:
    """Write the data file of one commit again, when that gives what the log says of it."""
    entry = log.entry(number)
    source = sources.get((entry.version.metadata.get("vehicle", ""), entry.version.digest))
    if source is None or len(entry.added) != 1:
        return []
    (name, size), (where, rows) = next(iter(entry.added.items())), source
    content = _parquet(rows)
    file = local / name
    if len(content) != size or (file.exists() and file.read_bytes() == content):
        return []
    old = file.read_bytes() if file.exists() else None
    if old is not None:
        _set_aside(local, file)
    log.storage.write(name, content)
    with contextlib.suppress(InputError):
        check_digests(log, number, stored_rows(log, number))
        return [f"data file of version {number} written again from {where}"]
    # It was something else: as it was before.
    file.unlink()
    if old is not None:
        file.write_bytes(old)
    return []


def _parquet(rows: pd.DataFrame) -> bytes:
    """The data file that a commit of rows writes."""
    from deltalake import write_deltalake

    with temporary_folder() as folder, engine(str(folder), "cannot be written", "room for temporary files"):
        write_deltalake(address(str(folder)), arrow(rows[column_order()]), mode="error", configuration=FOR_EVER)
        return next(folder.glob("*.parquet")).read_bytes()


def _latest_again(path: str, log: Log, fault: str, sources: Rows) -> list[str]:
    """Commit the rows that the latest version should have, as a new version."""
    import pandas as pd

    wanted = _wanted(log, log.last)
    if not wanted or any(item not in sources for item in wanted.items()):
        return []
    everything = pd.concat([sources[item][1] for item in wanted.items()], ignore_index=True)
    of_vehicles = [v for v in log.versions if v.digest and v.metadata.get("vehicle", "") in wanted]
    bad = log.entry(log.last).version if log.entry(log.last).version.digest else of_vehicles[-1]
    message = f"repairs version {log.last}: {fault}"
    said = bad.metadata | {"message": message, "repairs": str(log.last)}
    number = commit_again(path, everything, bad.metadata["vehicle"], said, log.last)
    where = ", ".join(dict.fromkeys(sources[item][0] for item in wanted.items()))
    return [f"rows of version {log.last} committed again as version {number}, from {where}"]
