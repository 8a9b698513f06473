"""The log of a coefficient database, read entry by entry: what each commit says of itself.

An entry is the file of one commit and never changes; it is read by its own number, so that a
commit in between shifts nothing. A commit seals what it says (``seal``) and names the digests of
the other vehicles' rows it left in place, so that one entry vouches for a whole version. After a
commit its number is written to ``.latest``: an entry lost from the end is missed by it.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypedDict
from urllib.parse import unquote

from sim.files.errors import InputError
from sim.files.storage import Storage

LOG = "_delta_log"
# Number and seal of the newest commit.
LATEST = ".latest"
_ENTRY = re.compile(r"(\d{20})\.json")
# What the storage engine writes of itself into an entry, beside what a commit says.
_ENGINE = {
    "timestamp",
    "operation",
    "operationParameters",
    "operationMetrics",
    "engineInfo",
    "clientVersion",
    "isBlindAppend",
    "isolationLevel",
    "readVersion",
    "userId",
    "userName",
    "userMetadata",
    "txnId",
    "version",
}
# What an entry may say, of what this program writes.
_KINDS = {"commitInfo", "metaData", "protocol", "add", "remove"}
WHOLE = "a database with all its files; `ident doctor --db` says what can be restored"
OURS = "a database written by `ident fit`"


class Origin(TypedDict):
    """Where the rows of a result are from, as every JSON output names it: a database, a version and its digest."""

    path: str
    version: int
    digest: str


@dataclass(frozen=True)
class Version:
    """One commit of the database.

    Attributes
    ----------
    number : Counted from 0.
    timestamp : Of the commit, milliseconds since 1970 as text.
    metadata : What the commit says: digest, vehicle, campaign, inputs, message and so on.
    operation : What another program did, empty for commits of this one.
    """

    number: int
    timestamp: str
    metadata: dict[str, str]
    operation: str = ""

    @property
    def digest(self) -> str:
        """Content digest of the rows of the commit's vehicle; empty when it wrote none."""
        return self.metadata.get("digest", "")

    def origin(self, path: str) -> Origin:
        """The version as where a result is from; ``path`` is that of the database."""
        return {"path": path, "version": self.number, "digest": self.digest}

    @property
    def trained(self) -> list[str]:
        """Cases that a calibrated version was trained on; none for one that no maneuver made."""
        return list(json.loads(self.metadata.get("trained", "[]")))

    def stored(self, key: str, default: Any) -> Any:
        """A JSON value of the commit, or ``default`` where it is missing, damaged or of another type."""
        try:
            value = json.loads(self.metadata.get(key, ""))
        except ValueError:
            return default
        return value if isinstance(value, type(default)) else default


def seal(metadata: Mapping[str, str]) -> str:
    """SHA-256 of what a commit says of itself."""
    said = {k: v for k, v in metadata.items() if k != "seal"}
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Entry:
    """One entry of the log.

    Attributes
    ----------
    version : What the commit says.
    added : Data files of the commit, with their size [bytes].
    columns : Of the table, when the commit sets them.
    """

    version: Version
    added: dict[str, int] = field(default_factory=dict)
    columns: tuple[str, ...] = ()

    @property
    def beside(self) -> dict[str, str] | None:
        """Vehicle -> digest of the rows that the commit left in place; None when it does not say."""
        metadata = self.version.metadata
        # Said of the version before; another commit may have come between on an object store.
        if "beside" not in metadata or metadata.get("after") != str(self.version.number - 1):
            return None
        return dict(json.loads(metadata["beside"]))


def _entry(where: str, number: int, content: bytes) -> Entry:
    """An entry from its file. Raises ``InputError`` for one that is damaged."""
    damaged = InputError(where, "a damaged entry of the log", WHOLE)
    try:
        actions = [json.loads(line) for line in content.decode().splitlines() if line.strip()]
    except (ValueError, RecursionError) as error:
        raise damaged from error
    if not all(isinstance(action, dict) for action in actions):
        raise damaged
    if not any(_KINDS.intersection(action) for action in actions):
        raise InputError(where, "an entry of the log that says nothing", WHOLE)
    said: dict[str, Any] = {}
    added: dict[str, int] = {}
    columns: tuple[str, ...] = ()
    try:
        for action in actions:
            said |= action.get("commitInfo", {})
            if "add" in action:
                added[unquote(action["add"]["path"])] = int(action["add"]["size"])
            if "metaData" in action:
                columns = tuple(f["name"] for f in json.loads(action["metaData"]["schemaString"])["fields"])
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise damaged from error
    metadata = {k: str(v) for k, v in said.items() if k not in _ENGINE}
    if "seal" in metadata and metadata["seal"] != seal(metadata):
        raise InputError(where, "an entry of the log that is not what the commit sealed", WHOLE)
    operation = "" if "digest" in metadata or "seal" in metadata else str(said.get("operation", "unknown operation"))
    # Of this program's commits the time is sealed.
    timestamp = metadata.get("time", str(said.get("timestamp", 0)))
    if not timestamp.isdecimal():
        raise damaged
    version = Version(number, timestamp, metadata, operation)
    return Entry(version, added, columns)


def latest_said(storage: Storage) -> int | None:
    """Number of the newest commit, as it was noted when it was done; None where nothing is noted."""
    content = storage.read(LATEST)
    try:
        return None if content is None else int(json.loads(content)["version"])
    except (ValueError, KeyError, TypeError):
        # A note on the commit, not the commit: it is written anew with the next.
        return None


def has_versions(path: str) -> bool:
    """Whether anything was ever committed at a folder or URL."""
    storage = Storage(path)
    return any(_ENTRY.fullmatch(name) for name in storage.sizes(LOG)) or latest_said(storage) is not None


class Log:
    """The log of one database as it stands.

    Parameters
    ----------
    path : Folder or object-store URL of the database.
    but : An entry to leave out, ``_delta_log/`` and its name.
    holes : Also open a log with missing or empty entries; reading one of them is refused still.

    Raises
    ------
    InputError
        When there is no database, or an entry is missing.
    """

    def __init__(self, path: str, but: str = "", holes: bool = False) -> None:
        self.path = path
        self.storage = Storage(path)
        local = self.storage.local
        if local is not None and not (local / LOG).is_dir():
            there = "a file" if local.is_file() else "no coefficient database"
            raise InputError(path, there, f"{OURS}; choose it with --db")
        # Before the entries are listed: a commit in between makes more of them, never fewer.
        latest = latest_said(self.storage)
        every = self.storage.sizes(LOG)
        files = {n: size for n, size in every.items() if _ENTRY.fullmatch(n) and f"{LOG}/{n}" != but}
        numbers = sorted(int(name[:20]) for name in files)
        if not numbers and latest is None:
            nothing = "a database without any version: its first fit did not finish"
            raise InputError(path, nothing if local is not None else "no coefficient database", OURS)
        # Early releases let old entries be deleted, once a checkpoint held what they said.
        self.first = numbers[0] if numbers and any(".checkpoint." in name for name in every) else 0
        self.last = max([*numbers, -1 if latest is None else latest])
        self._entries: dict[int, Entry] = {}
        for number in range(self.first, self.last + 1) if not holes else ():
            size = files.get(f"{number:020d}.json")
            if size is None:
                text = f"the entry of version {number} is missing from the log"
                raise InputError(self._where(number), text, WHOLE)
            if size == 0:
                raise InputError(self._where(number), "an empty entry of the log: its commit did not finish", WHOLE)

    def _where(self, number: int) -> str:
        return f"{self.path}/{LOG}/{number:020d}.json"

    def entry(self, number: int) -> Entry:
        """One entry. Raises ``InputError`` when it is damaged or no longer there."""
        if number not in self._entries:
            content = self.storage.read(f"{LOG}/{number:020d}.json")
            if content is None:
                raise InputError(self._where(number), "no such entry of the log", WHOLE)
            self._entries[number] = _entry(self._where(number), number, content)
        return self._entries[number]

    @cached_property
    def versions(self) -> list[Version]:
        """Every version, oldest first."""
        return [self.entry(n).version for n in range(self.first, self.last + 1)]

    def contents(self, number: int) -> tuple[dict[str, str], bool]:
        """What a version should hold, by the commits up to it.

        Returns
        -------
        Vehicle -> digest of its rows (under "" of a commit that names no vehicle), and whether
        the entries that say so are all there.
        """
        digests: dict[str, str] = {}
        for k in range(number, self.first - 1, -1):
            entry = self.entry(k)
            if entry.version.digest:
                digests.setdefault(entry.version.metadata.get("vehicle", ""), entry.version.digest)
            if entry.beside is not None:
                return entry.beside | digests, True
        return digests, self.first == 0
