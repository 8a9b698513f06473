"""Authority: the digest. What an exchange file holds is committed to the same digest, or not at all."""

from __future__ import annotations

import contextlib
import json
import os
import random
from pathlib import Path

import pytest
from click.testing import CliRunner
from small_campaign import fitted, write

import ident
from ident.cli import main
from ident.database.store import commit
from ident.exports.exchange import export_exchange, import_exchange, schema
from sim.boat.database import read_rows, versions
from sim.files.errors import InputError


def test_a_version_comes_back_to_its_digest(fitted_db, tmp_path):
    done = export_exchange(fitted_db, None, tmp_path)
    text = (tmp_path / "coefficients_v0.json").read_text("utf-8")
    assert export_exchange(fitted_db, None, tmp_path / "bb2.json")["file"] == str(tmp_path / "bb2.json")
    assert (tmp_path / "bb2.json").read_text("utf-8") == text
    data = json.loads(text)
    assert set(data) <= set(schema()["properties"])
    assert set(schema()["required"]) <= set(data)
    assert data["units"]["beta_deg"] == "deg"
    assert len(data["vehicles"][0]["rows"]) == done["rows"] > 100
    assert any("correlation" in row for row in data["vehicles"][0]["rows"])
    other = str(tmp_path / "other")
    result = CliRunner().invoke(main, ["import", done["file"], "--db", other, "--json", "-"])
    assert result.exit_code == 0, result.output
    (said,) = json.loads(result.output)["vehicles"]
    assert said["digest"] == done["database"]["digest"] == ident.Database(other)[0].digest
    ours, theirs = read_rows(fitted_db)[0], read_rows(other)[0]
    assert ours.equals(theirs)
    assert not import_exchange(tmp_path / "coefficients_v0.json", other, 10.0)[0].new


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d["vehicles"][0]["rows"][3].update(value=1.0), "digest"),
        (lambda d: d["vehicles"][0]["rows"][0].update(colour="red"), "colour"),
        (lambda d: d["vehicles"][0]["rows"][0].update(value="much"), "numbers and texts"),
        (lambda d: d.update(schema=3), "no exchange file"),
        (lambda d: d.update(frame="z up"), "seal"),
        (lambda d: d.pop("seal"), "seal"),
        (lambda d: d["vehicles"][0]["metadata"].update(message="another"), "seal"),
        (lambda d: d["vehicles"][0].update(version=7), "seal"),
        (lambda d: d.update(vehicles=[]), "one vehicle or more"),
        (lambda d: d["vehicles"][0].pop("metadata"), "as the schema says"),
    ],
)
def test_a_changed_file_is_refused_and_nothing_committed(fitted_db, tmp_path, change, words):
    path = tmp_path / "coefficients_v0.json"
    export_exchange(fitted_db, None, tmp_path)
    data = json.loads(path.read_text("utf-8"))
    change(data)
    path.write_text(json.dumps(data), "utf-8")
    with pytest.raises(InputError, match=words):
        import_exchange(path, str(tmp_path / "other"), 10.0)
    assert not (tmp_path / "other").exists()


def test_no_byte_of_a_file_changes_in_silence(tmp_path):
    """A byte turned is refused, or what is committed is what was exported, its notes too."""
    db, path = str(tmp_path / "db"), tmp_path / "coefficients_v0.json"
    commit(db, fitted(write(tmp_path / "campaign")), {"message": "as measured", "conversions": "none"})
    export_exchange(db, None, tmp_path)
    content, chance = path.read_bytes(), random.Random(5)
    head = content.index(b'"rows"')
    for k in range(60):
        at = chance.randrange(head if k % 2 else len(content))
        path.write_bytes(content[:at] + bytes([content[at] ^ chance.randrange(1, 256)]) + content[at + 1 :])
        other = str(tmp_path / f"other{k}")
        with contextlib.suppress(InputError):
            import_exchange(path, other, 10.0)
            assert read_rows(other)[0].equals(read_rows(db)[0])
            ours, theirs = versions(db)[0].metadata, versions(other)[0].metadata
            assert [theirs[key] for key in ("message", "conversions")] == [
                ours[key] for key in ("message", "conversions")
            ]


def test_a_file_of_before_the_seal_is_read(fitted_db, tmp_path):
    path = tmp_path / "coefficients_v0.json"
    done = export_exchange(fitted_db, None, tmp_path)
    data = json.loads(path.read_text("utf-8"))
    del data["seal"]
    data["schema"] = 1
    path.write_text(json.dumps(data), "utf-8")
    assert import_exchange(path, str(tmp_path / "other"), 10.0)[0].digest == done["database"]["digest"]


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_what_has_no_end_or_no_bottom_is_no_exchange_file(tmp_path):
    """A pipe, a device without an end, a file of a terabyte, lists in lists."""
    os.mkfifo(tmp_path / "pipe.json")
    with (tmp_path / "large.json").open("wb") as file:
        file.truncate(1 << 40)
    (tmp_path / "deep.json").write_text("[" * 100_000)
    for path in (tmp_path / "pipe.json", Path("/dev/zero"), tmp_path / "large.json", tmp_path / "deep.json"):
        with pytest.raises(InputError):
            import_exchange(path, str(tmp_path / "other"), 1.0)
    assert not (tmp_path / "other").exists()
