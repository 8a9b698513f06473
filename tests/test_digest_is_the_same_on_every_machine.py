"""Authority: the digest that README prints. The bundled campaign gives it on any processor and linear algebra."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from kernels_of_linear_algebra import kernels, threads
from small_campaign import write

from sim.boat.database import digest, read_rows

README = Path(__file__).parents[1] / "README.md"


def test_the_bundled_campaign_has_the_printed_digest(rows):
    """Run again under other kernels of linear algebra: nothing that is rounding may be stored."""
    printed = re.search(r"Measured only, BB2's digest is `(\w{16})`", README.read_text("utf-8"))[1]
    assert digest(rows)[:16] == printed


def test_agreeing_runs_store_no_rounding(rows):
    residual = rows["worst_residual"]
    assert ((residual == 0.0) | (residual >= 1e-9)).all()


def test_estimates_have_one_digest_under_the_oldest_and_the_newest_kernels(tmp_path):
    """A campaign of three runs, which a hundred estimated values complete."""
    campaign = write(tmp_path / "campaign")
    digests = set()
    for k, kernel in enumerate((kernels()[0], kernels()[-1])):
        command = [sys.executable, "-m", "ident.cli", "fit", str(campaign), "--db", str(tmp_path / f"db{k}")]
        where = os.environ | kernel | threads(k + 1) | {"PYTHONPATH": str(README.parent)}
        done = subprocess.run(command, env=where, capture_output=True, text=True, check=True)
        assert re.search(r"13\d estimated", done.stdout)
        digests.add(re.search(r"digest (?: )?(\w{16})", done.stdout)[1])
    assert len(digests) == 1
    stored = read_rows(str(tmp_path / "db0"))[0]
    touched = stored["estimated_by"].ne("")
    assert touched.sum() > 130
    for column in ("value", "stderr"):
        assert all(float(f"{x:.10g}") == x for x in stored.loc[touched, column])
