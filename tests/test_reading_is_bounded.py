"""Authority: memory and time of a reader are bounded by the size of what a file means, not by what it unfolds to.

Parquet files that unfold a thousandfold, pipes that nobody writes to, links that lead round in circles
or out of the campaign's folder, regular expressions that fit a line in more ways than there are seconds.
"""

from __future__ import annotations

import contextlib
import os
import resource
import shutil
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from small_campaign import HEADER, RUNS, assert_refused, fitted, write

from ident.captive.campaign import read_campaign
from ident.checks.check import read_labels
from ident.report.page import _errata
from ident.report.score import read_score
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.files.inputs import statements

posix = pytest.mark.skipif(os.name != "posix", reason="pipes and links of POSIX")


def table(rows: int, text: pa.Array | pa.DictionaryArray) -> pa.Table:
    numbers = {"U_mps": np.full(rows, 5.0), "X_N": np.full(rows, 5.0), "rel_sigma": np.full(rows, 0.05)}
    words = {"run_id": "r", "test": "drift_horizontal", "part": "hull", "quality": "as_published"}
    constant = {k: pa.array([v] * rows) for k, v in words.items()}
    return pa.table({**constant, **{k: pa.array(v) for k, v in numbers.items()}, "source": text})


def one_word(rows: int, word: str) -> pa.DictionaryArray:
    return pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows, dtype=np.int32)), pa.array([word]))


@pytest.mark.parametrize(
    "text", [one_word(20_000, "y" * (1 << 20)), pa.array(["y" * 400_000_000])], ids=["in every row", "one cell"]
)
def test_a_small_parquet_file_does_not_unfold(tmp_path, text):
    folder = write(tmp_path / "campaign")
    (folder / "drift.csv").unlink()
    pq.write_table(table(len(text), text), folder / "runs.parquet", compression="zstd")
    assert (folder / "runs.parquet").stat().st_size < 100_000
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert_refused(folder, "column source", "10000 bytes at most")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300_000


@posix
def test_a_pipe_among_the_runs_is_refused_at_once(tmp_path):
    folder = write(tmp_path / "campaign")
    os.mkfifo(folder / "b.csv")
    script = (
        "import sys\nfrom pathlib import Path\nfrom ident.captive.campaign import read_campaign\n"
        "from sim.files.errors import InputError\n"
        "try:\n    read_campaign(Path(sys.argv[1]))\nexcept InputError as error:\n    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(folder)], capture_output=True, text=True, timeout=120, check=True
    )
    assert "a pipe or a device" in done.stdout


@posix
def test_a_pipe_in_the_place_of_a_file_of_statements_is_refused_at_once(tmp_path):
    """Scoreboards, vehicles, cases and calibrations are read by one function."""
    pipe = tmp_path / "board.json"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="a pipe or a device"):
        statements(pipe)
    with pytest.raises(InputError, match="a pipe or a device"):
        read_score(pipe, "digest", 1)
    suboff = load_vehicle("suboff").model_copy(update={"errata": str(pipe)})
    with pytest.raises(InputError, match="a pipe or a device"):
        _errata(suboff)


@posix
def test_a_pipe_among_the_descriptions_is_passed_over(tmp_path):
    folder = write(tmp_path / "campaign")
    os.mkfifo(folder / "channels.txt")
    assert read_labels(folder) is None


def test_a_campaign_file_that_nobody_wrote_is_refused_before_it_is_read(tmp_path):
    folder = write(tmp_path / "campaign")
    with (folder / "campaign.toml").open("r+b") as stream:
        stream.truncate(1 << 30)
    assert_refused(folder, "campaign.toml", "1073741824 bytes")


@posix
def test_links_in_circles_are_gone_through_once(tmp_path):
    folder = write(tmp_path / "campaign", header=HEADER + '[[source]]\nfiles = "**/*.csv"\n')
    for name in "abcdefgh":
        (folder / name).symlink_to(".")
    assert len(read_campaign(folder).runs) == 3


@posix
def test_a_glob_does_not_leave_the_folder_of_a_campaign_through_a_link(tmp_path):
    """A folder that is linked is read where it is named, as one that holds large files is."""
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "more.csv").write_text(RUNS.replace("\nh", "\nother"))
    folder = write(tmp_path / "campaign", header=HEADER + '[[source]]\nfiles = "**/*.csv"\n')
    (folder / "linked").symlink_to(outside)
    assert len(read_campaign(folder).runs) == 3
    named = HEADER + '[[source]]\nfiles = "linked/*.csv"\n'
    assert len(read_campaign(write(folder, header=named)).runs) == 3


def test_tables_with_names_in_capitals_are_read(tmp_path):
    folder = write(tmp_path / "campaign")
    expected = fitted(folder)
    shutil.move(folder / "drift.csv", folder / "DRIFT.CSV")
    assert fitted(folder)["value"].tolist() == expected["value"].tolist()


def test_a_glob_that_is_none_is_one_message(tmp_path):
    for k, pattern in enumerate(("[", "***", "nothing/*.csv")):
        folder = write(tmp_path / f"campaign{k}", header=HEADER + f'[[source]]\nfiles = "{pattern}"\n')
        with pytest.raises(InputError):
            read_campaign(folder)


SLOW = "(a+)+$"
KEYS = {
    "skip": f'[[source]]\nfiles = "drift.csv"\nskip = "{SLOW}"\n',
    "header_pattern": f'[[source]]\nfiles = "drift.csv"\ndelimiter = ","\nheader_pattern = "^run_id|{SLOW}"\n',
    "patterns": f'[[source]]\nfiles = "drift.csv"\n[source.patterns]\n"{SLOW}" = "X"\n',
    "match": '[[source]]\nfiles = "*.csv"\nmatch = "(a+)+(?P<beta_deg>[0-9])$"\n',
}


@pytest.mark.parametrize("key", list(KEYS))
def test_an_expression_is_matched_in_linear_time(tmp_path, key):
    """Fifty letters are fitted in 2^50 ways by the engine of Python."""
    folder = write(tmp_path / "campaign", header=HEADER + KEYS[key])
    drift = folder / "drift.csv"
    if key == "match":
        drift.rename(folder / f"{'a' * 50}!.csv")
    elif key == "patterns":
        drift.write_text(drift.read_text().replace("run_id,", f"run_id,{'a' * 50}!,").replace("\nh", "\nh0,0,h"))
    else:
        drift.write_text(f"{'a' * 50}!\n" + drift.read_text())
    begun = time.monotonic()
    with contextlib.suppress(InputError):
        read_campaign(folder)
    assert time.monotonic() - begun < 10.0


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        ("beta(?=_)", "no look-around"),
        (r"(\\d)\\1", "no back-references"),
        ("[", "regular expression"),
        ("(a{500}b{500}){100}", "regular expression"),
        (r"[\\pL\\d]{200}", "a smaller regular expression"),
        ("a" * 2000, "1000 characters at most"),
    ],
)
def test_an_expression_of_another_syntax_or_size_is_refused_with_its_key(tmp_path, pattern, words):
    folder = write(tmp_path / "campaign", header=HEADER + f'[[source]]\nfiles = "*.csv"\nskip = "{pattern}"\n')
    assert_refused(folder, "source.0.skip", words)
