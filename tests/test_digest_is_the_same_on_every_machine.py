"""Authority: the digest that README prints. The bundled campaign gives it on any processor and linear algebra."""

from __future__ import annotations

import re
from pathlib import Path

from sim.boat.database import digest

README = Path(__file__).parents[1] / "README.md"


def test_the_bundled_campaign_has_the_printed_digest(rows):
    """Run again under other kernels of linear algebra: nothing that is rounding may be stored."""
    printed = re.search(r"Measured only, BB2's digest is `(\w{16})`", README.read_text("utf-8"))[1]
    assert digest(rows)[:16] == printed


def test_agreeing_runs_store_no_rounding(rows):
    residual = rows["worst_residual"]
    assert ((residual == 0.0) | (residual >= 1e-9)).all()
