"""Authority: a bound. Memory for reading a time history does not grow with the file."""

from __future__ import annotations

import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_campaigns import campaign, history

from ident.captive.campaign import read_campaign
from sim.files.errors import InputError

NAMES = 'names = ["time [s]", "X [N]", "Y [N]"]'
MEGABYTE = 1 << 20


def tank_file(path, megabytes: int) -> int:
    """A white-space tank file of about this size; the number of its rows."""
    rng = np.random.default_rng(5)
    block = rng.standard_normal((20_000, 2)) + np.array([100.0, -30.0])
    rows = 0
    with path.open("w") as stream:
        stream.write("Tank 3, run 17\n t Fx Fy\n")
        while stream.tell() < megabytes * MEGABYTE:
            time = (rows + np.arange(len(block))) * 0.002
            np.savetxt(stream, np.column_stack([time, block]), fmt="%.6f")
            rows += len(block)
    return rows


CHILD = """
import resource, sys
from pathlib import Path
from ident.captive.campaign import read_campaign
for name in sys.argv[1:]:
    read_campaign(Path(name))
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def peaks_of_reading(*folders) -> list[float]:
    """Largest resident memory [MB] of a process after reading each of the campaigns in turn."""
    pytest.importorskip("resource", reason="resident memory is measured on Unix")
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    command = [sys.executable, "-c", CHILD, *map(str, folders)]
    text = subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout
    unit = MEGABYTE if sys.platform == "darwin" else 1024
    return [int(line) / unit for line in text.split()]


def test_memory_does_not_grow_with_the_file(tmp_path):
    """Once its buffers stand, a file six times as long takes no more."""
    folders = [campaign(tmp_path / str(k), history("run.txt", NAMES)) for k in range(2)]
    for folder, megabytes in zip(folders, (6, 36), strict=True):
        tank_file(folder / "run.txt", megabytes)
    _, small, large = peaks_of_reading(folders[0], *folders)
    assert large - small < 12.0


def test_a_long_file_gives_the_mean_of_all_its_samples(tmp_path):
    folder = campaign(tmp_path, history("run.txt", NAMES))
    rows = tank_file(folder / "run.txt", 4)
    # More rows than blocks are kept, so that blocks hold several samples.
    assert rows > 2 << 15
    values = np.loadtxt(folder / "run.txt", skiprows=2)
    found = read_campaign(folder).runs.iloc[0]
    assert found["X"] == pytest.approx(values[:, 1].mean(), rel=1e-5)
    assert found["s_X"] == pytest.approx(1.0 / np.sqrt(rows), rel=0.25)


def test_parquet_comes_in_batches(tmp_path):
    folder = campaign(tmp_path, history("run.parquet"))
    n = 400_000
    rng = np.random.default_rng(1)
    frame = pd.DataFrame({"time_s": np.arange(n) * 0.01, "X_N": rng.standard_normal(n), "other [V]": 1.0})
    frame.drop(columns="other [V]").to_parquet(folder / "run.parquet", row_group_size=20_000)
    small = campaign(tmp_path / "small", history("run.parquet"))
    frame[:20_000].drop(columns="other [V]").to_parquet(small / "run.parquet")
    first, second = peaks_of_reading(small, folder)
    assert second - first < 30.0


def test_a_line_without_end_is_refused_before_it_is_held(tmp_path):
    folder = campaign(tmp_path, history("run.txt", NAMES))
    with (folder / "run.txt").open("w") as stream:
        for _ in range(16):
            stream.write("1.0 " * (MEGABYTE // 4))
    tracemalloc.start()
    with pytest.raises(InputError, match="shorter lines"):
        read_campaign(folder)
    peak = tracemalloc.get_traced_memory()[1] / MEGABYTE
    tracemalloc.stop()
    assert peak < 40.0
