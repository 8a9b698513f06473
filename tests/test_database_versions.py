"""Authority: invariants of a versioned store. What was committed stays, whatever happens next."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ident import __version__
from ident.database.store import _commit, commit, digest
from sim.boat.database import column_order, read_rows, versions
from sim.boat.row_codec import correlation_pairs
from sim.files.errors import InputError


@pytest.fixture(scope="module")
def few(rows):
    """A few coefficients with every kind of row: commits of them are quick."""
    return rows[rows["coefficient"].isin(["Y_uvw", "w_T", "KT", "Y_vdot_section", "Y_d1"])].reset_index(drop=True)


@pytest.fixture
def db(tmp_path):
    return str(tmp_path / "db")


def scaled(rows: pd.DataFrame, factor: float) -> pd.DataFrame:
    return rows.assign(value=rows["value"] * factor)


# -- one writer ---------------------------------------------------------------------------


def test_rows_come_back_to_the_bit(rows, db):
    commit(db, rows, {})
    back, number = read_rows(db)
    assert number == 0
    assert list(back.columns) == column_order()
    key = ["vehicle", "coefficient", "part", *[c for c in column_order() if rows[c].dtype == float]]
    ours = rows.sort_values(key, kind="stable").reset_index(drop=True)
    theirs = back.sort_values(key, kind="stable").reset_index(drop=True)
    for column in column_order():
        if ours[column].dtype == float:
            np.testing.assert_array_equal(ours[column].to_numpy().view("i8"), theirs[column].to_numpy().view("i8"))
        else:
            assert ours[column].tolist() == theirs[column].tolist()
    assert digest(back) == digest(rows)


def test_the_same_input_again_commits_nothing(few, db):
    assert commit(db, few, {"message": "first"}) == (0, True)
    files = sorted(p.name for p in Path(db).rglob("*"))
    assert commit(db, few, {"message": "again"}) == (0, False)
    assert commit(db, few.sample(frac=1.0, random_state=3), {"message": "shuffled"}) == (0, False)
    assert sorted(p.name for p in Path(db).rglob("*")) == files


def test_a_changed_value_is_a_new_version_and_the_old_one_stays(few, db):
    commit(db, few, {})
    changed = few.copy()
    changed.loc[3, "value"] = np.nextafter(changed.loc[3, "value"], 1.0)  # the smallest change there is
    assert commit(db, changed, {}) == (1, True)
    assert digest(read_rows(db, 0)[0]) == digest(few)
    assert digest(read_rows(db, 1)[0]) == digest(changed)
    assert digest(read_rows(db)[0]) == digest(changed) != digest(few)


@pytest.mark.parametrize("column", ["stderr", "quality", "n_runs", "runs", "extrapolation", "beta_deg"])
def test_a_change_in_any_other_column_is_a_new_version(few, db, column):
    commit(db, few, {})
    changed = few.copy()
    text = not pd.api.types.is_numeric_dtype(changed[column])
    place = changed.index[changed[column].notna()][0]
    changed.loc[place, column] = changed.loc[place, column] + ("x" if text else 1)
    assert commit(db, changed, {}) == (1, True)


def test_going_back_to_old_values_is_a_new_version_with_the_old_digest(few, db):
    commit(db, few, {})
    commit(db, scaled(few, 2.0), {})
    assert commit(db, few, {}) == (2, True)
    numbers = {v.number: v.digest for v in versions(db)}
    assert numbers[0] == numbers[2] != numbers[1]


def test_rows_of_another_vehicle_are_kept(few, db):
    commit(db, few, {})
    other = scaled(few, 3.0).assign(vehicle="second boat")
    assert commit(db, other, {}) == (1, True)
    assert commit(db, few, {}) == (1, False)
    commit(db, scaled(few, 5.0), {})
    assert digest(read_rows(db, vehicle="second boat")[0]) == digest(other)
    assert digest(read_rows(db, vehicle="bb2")[0]) == digest(scaled(few, 5.0))
    assert digest(read_rows(db, 1, vehicle="bb2")[0]) == digest(few)


def test_rows_dropped_from_a_fit_leave_the_next_version(few, db):
    commit(db, few, {})
    commit(db, few[few["coefficient"] != "KT"], {})
    assert "KT" not in set(read_rows(db)[0]["coefficient"])
    assert "KT" in set(read_rows(db, 0)[0]["coefficient"])


def test_digest_does_not_depend_on_the_order_of_rows_or_columns(few):
    shuffled = few.sample(frac=1.0, random_state=1)[few.columns[::-1]]
    assert digest(shuffled) == digest(few)
    assert digest(few.iloc[:-1]) != digest(few)


def test_version_metadata_round_trip(few, db):
    provenance = {"campaign": "bb2", "note": 'quotes " and\nlines, \u00b0'}
    commit(db, few, provenance)
    commit(db, scaled(few, 2.0), provenance)
    first, second = versions(db)
    assert (first.number, second.number) == (0, 1)
    assert first.digest == digest(few)
    assert second.digest == digest(scaled(few, 2.0))
    assert second.metadata["parent"] == "0"
    assert first.metadata["parent"] == ""
    assert second.metadata["program"] == f"ident {__version__}"
    for key, value in provenance.items():
        assert second.metadata[key] == value


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("column", ["value", "stderr"])
def test_numbers_that_are_not_finite_are_never_stored(few, db, wrong, column):
    commit(db, few, {})
    bad = few.copy()
    bad.loc[0, column] = wrong
    with pytest.raises(InputError):
        commit(db, bad, {})
    assert digest(read_rows(db)[0]) == digest(few)


def test_commit_returns_its_own_version_when_another_follows_at_once(few, db, monkeypatch):
    """Between the write and the look at the history another fit may commit."""
    import deltalake

    commit(db, few, {})
    write = deltalake.write_deltalake
    others = [scaled(few, 7.0)]

    def write_and_be_followed(*arguments, **options):
        write(*arguments, **options)
        if others:
            # On an object store there is no lock.
            _commit(db, others.pop(), {})

    monkeypatch.setattr(deltalake, "write_deltalake", write_and_be_followed)
    number, new = commit(db, scaled(few, 2.0), {})
    assert new
    assert len(versions(db)) == 3
    assert digest(read_rows(db, number)[0]) == digest(scaled(few, 2.0))


# -- several processes --------------------------------------------------------------------

LOOP = """
import sys
from ident.database.store import commit
from sim.boat.database import read_rows
path = sys.argv[1]
rows, _ = read_rows(path)
print("ready", flush=True)
for k in range(10_000):
    rows["value"] = rows["value"] * 1.0001
    commit(path, rows, {"step": str(k)})
"""

ROUNDS = """
import sys
from ident.database.store import commit
from sim.boat.database import read_rows
from sim.files.errors import InputError
source, mine = sys.argv[1], float(sys.argv[2])
rows, _ = read_rows(source)
print("ready", flush=True)
for line in sys.stdin:
    path, factor = line.split()
    mixed = rows.assign(value=rows["value"] * mine * float(factor))
    try:
        print("committed", commit(path, mixed, {})[0], flush=True)
    except InputError as error:
        print("refused", repr(str(error)), flush=True)
"""


def start(program: str, *arguments: str) -> subprocess.Popen:
    process = subprocess.Popen(
        [sys.executable, "-c", program, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
    )
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "ready", process.stderr.read()
    return process


def test_writer_killed_at_any_moment_leaves_the_last_version_readable(few, db):
    commit(db, few, {})
    moments = random.Random(5)
    seen = 0
    for trial in range(5):
        process = start(LOOP, db)
        # Later each time: on a loaded machine a first commit takes seconds.
        time.sleep(moments.uniform(0.0, 0.25) * 2.0**trial)
        process.kill()
        process.communicate()
        back, number = read_rows(db)
        history = versions(db)
        assert number == history[-1].number
        assert digest(back) == history[-1].digest
        assert len(back) == len(few)
        seen = max(seen, number)
    assert seen > 0, "no commit happened before the kill: the test shows nothing"
    for version in (0, seen // 2, seen):
        assert digest(read_rows(db, version)[0]) == versions(db)[version].digest
    # A killed writer does not block the next one.
    assert commit(db, few, {})[1]


@pytest.fixture(scope="module")
def two_writers(few, tmp_path_factory):
    source = str(tmp_path_factory.mktemp("source") / "db")
    commit(source, few, {})
    writers = [start(ROUNDS, source, factor) for factor in ("2.0", "3.0")]
    yield writers
    for writer in writers:
        writer.kill()
        writer.communicate()


def at_once(writers: list[subprocess.Popen], path: str, factor: float) -> list[str]:
    for writer in writers:
        writer.stdin.write(f"{path} {factor}\n")
        writer.stdin.flush()
    return [writer.stdout.readline().strip() for writer in writers]


def test_two_writers_at_once_end_in_versions_or_a_clear_refusal(two_writers, few, db):
    commit(db, few, {})
    expected = 1
    # Factors that never make one writer's rows those of the other: each commit is a version.
    for k in range(8):
        said = at_once(two_writers, db, 1.0 + 0.37 * k)
        done = [s for s in said if s.startswith("committed")]
        assert done, said
        assert all("another fit wrote at the same time" in s for s in said if not s.startswith("committed")), said
        expected += len(done)
        history = versions(db)
        assert [v.number for v in history] == list(range(expected))
        back, _ = read_rows(db)
        assert digest(back) == history[-1].digest
        assert digest(back) in {digest(scaled(scaled(few, m), 1.0 + 0.37 * k)) for m in (2.0, 3.0)}


def test_two_writers_that_create_the_database_at_once(two_writers, few, tmp_path):
    for k in range(4):
        path = str(tmp_path / f"db{k}")
        said = at_once(two_writers, path, 1.0)
        done = [s for s in said if s.startswith("committed")]
        assert done, said
        assert all("Traceback" not in s and s.startswith(("committed", "refused")) for s in said), said
        history = versions(path)
        back, _ = read_rows(path)
        assert len(back) == len(few), f"the database holds the rows of both: {said}"
        assert sorted(int(s.split()[1]) for s in done) == [v.number for v in history]
        assert digest(back) == history[-1].digest


def test_database_keeps_the_covariance_of_the_identification(identification, rows):
    """stderr and correlation of the rows give the covariance of the estimates back."""
    known = rows[rows["estimate"] >= 0].drop_duplicates("estimate").set_index("estimate")
    stderr = known["stderr"].reindex(range(len(identification.values))).to_numpy()
    assert stderr == pytest.approx(np.sqrt(np.diag(identification.covariance)), rel=1e-10)
    matrix = np.diag(stderr**2)
    for i, text in known["correlation"].items():
        for j, coefficient in correlation_pairs(text).items():
            matrix[i, j] = coefficient * stderr[i] * stderr[j]
    scale = np.outer(stderr, stderr)
    assert np.abs(matrix - identification.covariance).max() > 0.0
    assert (np.abs(matrix - identification.covariance) <= 2e-6 * scale).all()


def test_rows_of_one_estimate_are_one_value_up_to_its_sign(rows):
    estimated = rows[rows["estimate"] >= 0]
    assert estimated["estimate"].duplicated().any()
    for _, group in estimated.groupby("estimate"):
        assert group["value"].abs().nunique() == 1
        assert group["stderr"].nunique() == 1
