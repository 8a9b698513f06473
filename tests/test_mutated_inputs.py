"""Authority: the rule for bad input, on files that were damaged at random.

Bytes flipped, cut off, doubled or inserted; columns swapped; numbers made huge, infinite or
empty. Whatever comes out is a run table without non-finite loads, or one InputError that
names a place. A few dozen examples a reader here; ``IDENT_MUTATIONS=10000`` for the long run:

    IDENT_MUTATIONS=2000 python -m pytest tests/test_mutated_inputs.py
"""

from __future__ import annotations

import json
import os
import shutil
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_campaigns import STEADY, campaign, history, tidy
from made_files import MAP, PATTERNS, PLAIN, ROWS, STAR
from made_openfoam import PARTS, REAL, SOURCE, STATE, VERSIONS
from made_ship import CONFIGURED, ship

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from ident.database.store import commit, database_rows
from ident.identification.identify import identify
from sim.boat.catalogue import OUTPUTS
from sim.files.errors import InputError

EXAMPLES = int(os.environ.get("IDENT_MUTATIONS", "40"))
MUTATED = settings(
    max_examples=EXAMPLES,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large],
)
TOKENS = [b"nan", b"inf", b"-inf", b"1e999", b"1e300", b"-9e15", b"", b"1,5", b"1.2.3", b"0x1p3", b"1_0", b"\xff\xfe",
          b"\x00", b'"', b"(", b")", b";", b",", b"\t", b"\n", b"\r", b"#", b"\xe2\x80\x8b", b"'", b"=1+1", b"1e-400",
          "１２".encode(), b"True", b"--3", b"9" * 400]  # fmt: skip


@st.composite
def damage(draw, size: int):
    """One to four edits: (kind, place, length, token)."""
    kind = st.sampled_from(["flip", "cut", "drop", "double", "insert", "token", "swap", "line"])
    places = st.integers(0, max(size - 1, 0))
    edit = st.tuples(kind, places, st.integers(1, 60), st.sampled_from(TOKENS), st.integers(0, 255))
    return draw(st.lists(edit, min_size=1, max_size=4))


def damaged(data: bytes, edits) -> bytes:
    for kind, at, length, token, byte in edits:
        at = min(at, len(data))
        if kind == "flip" and at < len(data):
            data = data[:at] + bytes([byte]) + data[at + 1 :]
        elif kind == "cut":
            data = data[:at]
        elif kind == "drop":
            data = data[:at] + data[at + length :]
        elif kind == "double":
            data = data[: at + length] + data[at:]
        elif kind == "insert":
            data = data[:at] + token + data[at:]
        elif kind == "token":
            data = replaced_number(data, at, token)
        elif kind == "swap":
            data = swapped(data, at, length)
        elif kind == "line":
            lines = data.splitlines(keepends=True)
            k = at % max(len(lines), 1)
            data = b"".join([*lines[:k], *lines[k + 1 : k + 1 + length], *lines[k : k + 1], *lines[k + 1 + length :]])
    return data


def replaced_number(data: bytes, at: int, token: bytes) -> bytes:
    """The cell that ``at`` is in, made the token."""
    marks = b",;\t \n()"
    start = at
    while start and data[start - 1 : start] not in [bytes([m]) for m in marks]:
        start -= 1
    end = at
    while end < len(data) and data[end : end + 1] not in [bytes([m]) for m in marks]:
        end += 1
    return data[:start] + token + data[end:]


def swapped(data: bytes, a: int, b: int) -> bytes:
    """Two columns of every row, or of every row but the header, exchanged."""
    mark = b"," if b"," in data else b"\t" if b"\t" in data else b" "
    out = []
    for k, line in enumerate(data.split(b"\n")):
        cells = line.split(mark)
        if len(cells) > 2 and (k or a % 2):
            i, j = a % len(cells), b % len(cells)
            cells[i], cells[j] = cells[j], cells[i]
        out.append(mark.join(cells))
    return b"\n".join(out)


def attempt(folder: Path, fit: bool):
    """The campaign and its database rows, or the refusal; any other exception is a failure."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            found = read_campaign(folder)
            return found, database_rows(identify(found)) if fit else None, None
    except InputError as error:
        return None, None, error


def survives(folder: Path, fit: bool = False) -> None:
    """Reading gives finite loads or an InputError that names a place, and no warning."""
    found, rows, refusal = attempt(folder, fit)
    if found is None:
        assert refusal.where
        assert refusal.found
        assert refusal.allowed
        assert str(folder) in refusal.where or "row" in refusal.where, str(refusal)
        return
    loads = found.runs[[*OUTPUTS, *(f"s_{o}" for o in OUTPUTS)]]
    assert (np.isfinite(loads) | loads.isna()).all(axis=None)
    if rows is not None:
        assert np.isfinite(rows[["value", "stderr"]].to_numpy()).all()


@MUTATED
@given(data=st.data())
def test_damaged_campaigns_are_checked(tmp_path, data):
    """Quality checks of whatever can be read: findings or a refusal, and no warning."""
    folder = tmp_path / "ship"
    if not folder.exists():
        printed = "coefficient,value\nY_v,-0.021\nN_v,-0.009\nY_vdot,-0.0146\n"
        ship(folder, 1.0, 'reference = "printed.csv"\nconfigurations = "named.csv"', printed)
        (folder / "named.csv").write_text(CONFIGURED)
        for path in folder.glob("*.csv"):
            shutil.copy(path, tmp_path)
    hit = data.draw(st.sampled_from(["runs.csv", "printed.csv", "named.csv"]))
    for path in tmp_path.glob("*.csv"):
        content = path.read_bytes()
        (folder / path.name).write_bytes(
            damaged(content, data.draw(damage(len(content)))) if path.name == hit else content
        )
    for one in checked_or_refused(folder):
        assert one.what
        json.dumps(one.as_json(), allow_nan=False)


def checked_or_refused(folder: Path) -> list:
    """Findings on a campaign; none where it is refused."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            return check_campaign(read_campaign(folder), folder)
    except InputError:
        return []


MONITORS = STAR[:6000].rsplit("\n", 1)[0].replace("(N-m)", "")
CASES = {
    "tidy": (tidy("", MAP), "runs.csv", PLAIN.encode()),
    "decimal comma": (tidy("", MAP), "runs.csv", PLAIN.replace(",", ";").replace(".", ",").encode()),
    "monitors": (history("runs.csv", PATTERNS), "runs.csv", MONITORS.encode()),
    "columns": (
        history("runs.txt", 'names = ["time [s]", "X [N]", "Y [N]", "N [N m]"]'),
        "runs.txt",
        ("Tank 3 run 17\n t Fx Fy Mz\n" + ROWS[:6000].rsplit("\n", 1)[0]).encode(),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
@MUTATED
@given(data=st.data())
def test_damaged_tables(tmp_path, case, data):
    source, name, content = CASES[case]
    if not (tmp_path / "campaign.toml").is_file():
        campaign(tmp_path, source)
    (tmp_path / name).write_bytes(damaged(content, data.draw(damage(len(content)))))
    survives(tmp_path, fit=case == "tidy")


def test_the_undamaged_tables_are_read(tmp_path):
    for case, (source, name, content) in CASES.items():
        folder = campaign(tmp_path / case, source)
        (folder / name).write_bytes(content)
        assert len(read_campaign(folder).runs) > 0


@pytest.mark.parametrize("version", ["Foundation 11", "Foundation 13, moving", "OpenCFD v1912", "OpenCFD v2212"])
@MUTATED
@given(data=st.data())
def test_damaged_openfoam(tmp_path, version, data):
    folder = tmp_path / "run" / "postProcessing" / "forces" / "0"
    folder.mkdir(parents=True, exist_ok=True)
    if not (tmp_path / "campaign.toml").is_file():
        campaign(tmp_path, history("run", "rho_inf = 1.0"))
    files = {k: v.encode() for k, v in VERSIONS[version].items()}
    hit = data.draw(st.sampled_from(sorted(files)))
    files[hit] = damaged(files[hit], data.draw(damage(len(files[hit]))))
    for name, content in files.items():
        (folder / name).write_bytes(content)
    survives(tmp_path)


@MUTATED
@given(data=st.data())
def test_damaged_parquet(tmp_path, data):
    if not (tmp_path / "campaign.toml").is_file():
        campaign(tmp_path, tidy())
        values = {"beta_deg": [1.0, 2.0, 4.0], "X [kN]": [1.0, 2.0, 3.0], "remark": ["a", None, "c"]}
        pd.DataFrame(values).drop(columns="remark").to_parquet(tmp_path / "whole")
    content = (tmp_path / "whole").read_bytes()
    (tmp_path / "runs.parquet").write_bytes(damaged(content, data.draw(damage(len(content)))))
    survives(tmp_path)


HEADER = SOURCE + "rho_inf = 1.0\nvehicle_origin = [0.5, 0.0, 0.0]\n" + PARTS + STATE + STEADY
HEADER += "[source.within]\nbeta_deg = [-20.0, 20.0]\n"


@MUTATED
@given(data=st.data())
def test_damaged_campaign_file(tmp_path, data):
    campaign(tmp_path, HEADER, tables='reference = "printed.csv"')
    if not (tmp_path / "run").exists():
        (tmp_path / "run").symlink_to(REAL)
    path = tmp_path / "campaign.toml"
    content = path.read_bytes()
    path.write_bytes(damaged(content, data.draw(damage(len(content)))))
    survives(tmp_path)


def test_a_refused_campaign_leaves_the_database_as_it_was(tmp_path):
    """Read and identify come before commit: a bad file in a later source commits nothing."""
    from sim.boat.database import read_rows, versions

    source, name, content = CASES["tidy"]
    campaign(tmp_path / "c", source)
    (tmp_path / "c" / name).write_bytes(content)
    db = str(tmp_path / "db")
    rows = database_rows(identify(read_campaign(tmp_path / "c")))
    commit(db, rows, {"message": "good"})
    (tmp_path / "c" / name).write_bytes(content + b"8,nan,3,4\n")
    from ident.fitting.fit import fit

    with pytest.raises(InputError, match="row 5"):
        fit(tmp_path / "c", db)
    assert len(versions(db)) == 1
    pd.testing.assert_frame_equal(read_rows(db, vehicle="bb2")[0], read_rows(db, 0, "bb2")[0])


@pytest.mark.parametrize("name", ["b2", "b2.toml"])
def test_a_slip_in_the_name_of_the_vehicle_names_the_campaign_file(tmp_path, name):
    """Found by damaging campaign files."""
    campaign(tmp_path, tidy())
    path = tmp_path / "campaign.toml"
    path.write_text(path.read_text().replace('"bb2"', f'"{name}"'))
    with pytest.raises(InputError, match=r"campaign\.toml, key vehicle: '.*b2.*: no such file"):
        read_campaign(tmp_path)


def test_folders_and_unreadable_files_are_refused(tmp_path):
    campaign(tmp_path, tidy())
    (tmp_path / "runs.csv").mkdir()
    with pytest.raises(InputError, match=r"runs\.csv"):
        read_campaign(tmp_path)
