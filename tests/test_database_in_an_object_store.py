"""Authority: invariants of a versioned store, held by a real S3 server; writers there have no lock."""

from __future__ import annotations

import os
import time

import pytest
from database_writers import Writers
from object_store import object_store
from small_campaign import fitted, write

from ident.database.leftovers import unfinished, vacuum
from ident.database.store import commit
from sim.boat.database import digest, read_rows, versions
from sim.boat.delta_log import has_versions
from sim.files.errors import InputError
from sim.files.storage import Storage

pytest.importorskip("moto.server", reason="the extra s3 is not installed")


@pytest.fixture(scope="module")
def bucket():
    """URL of an empty bucket of a server on this machine; the storage engine's options are in the environment."""
    with object_store() as (url, options), pytest.MonkeyPatch.context() as patch:
        for key, value in options.items():
            patch.setenv(key, value)
        patch.delenv("AWS_S3_ALLOW_UNSAFE_RENAME", raising=False)
        yield url


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    return fitted(write(tmp_path_factory.mktemp("small") / "campaign"))


def test_versions_in_an_object_store_are_those_of_a_folder(bucket, few, tmp_path):
    """Committed twice, kept when the same, read back, refused when the last entry is lost."""
    url, folder = f"{bucket}/one", str(tmp_path / "db")
    with pytest.raises(InputError, match="no coefficient database"):
        read_rows(url)
    for path in (url, folder):
        assert commit(path, few, {"message": "first"}) == (0, True)
        assert commit(path, few, {}) == (0, False)
        assert commit(path, few.assign(vehicle="suboff"), {"message": "other"}) == (1, True)
    there, here = versions(url), versions(folder)
    assert [(v.number, v.digest, v.metadata["message"]) for v in there] == [
        (v.number, v.digest, v.metadata["message"]) for v in here
    ]
    assert digest(read_rows(url)[0]) == digest(read_rows(folder)[0])
    storage = Storage(url)
    left = "part-00000-01f0ae76-f187-4358-9487-f33e563448e6-c000.snappy.parquet"
    storage.write(left, b"PAR1")
    assert vacuum(url) == {left: 4}
    assert unfinished(url) == {}
    last = storage.read("_delta_log/00000000000000000001.json")
    storage.remove("_delta_log/00000000000000000001.json")
    with pytest.raises(InputError, match="version 1 is missing"):
        versions(url)
    storage.write("_delta_log/00000000000000000001.json", last[:-100])
    with pytest.raises(InputError, match="damaged entry"):
        versions(url)


def test_eight_writers_without_a_lock_and_a_reader_end_in_one_line_of_versions(bucket, few):
    """They make the database together and write two vehicles: no commit is lost or doubled."""
    url = f"{bucket}/race"
    options = {key: value for key, value in os.environ.items() if key.startswith("AWS_")}
    writers = Writers(url, [few.assign(vehicle=f"boat {k % 2}") for k in range(8)], 1, options)
    seen: dict[int, str] = {}
    while writers.at_work:
        time.sleep(0.1)
        if not has_versions(url):
            continue
        history = versions(url)
        assert [v.number for v in history] == list(range(len(history)))
        for v in history:
            assert seen.setdefault(v.number, v.digest) == v.digest
        rows, number = read_rows(url)
        assert number >= history[-1].number
        assert not rows[rows["vehicle"] == history[-1].metadata["vehicle"]].empty
    said = writers.done()
    assert sorted(said) == [(n, True) for n in range(8)]
    history = versions(url)
    assert {v.metadata["by"] for v in history} == writers.by
    for v in history:
        assert digest(read_rows(url, v.number, v.metadata["vehicle"])[0]) == v.digest == seen.get(v.number, v.digest)
