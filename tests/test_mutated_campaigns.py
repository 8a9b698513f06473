"""Authority: whatever the bytes of a campaign, it is refused by an InputError or gives a finite database.

Any other exception, or a wrong database from a broken file, is a failure; hypothesis looks
for both.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_campaign import HEADER, RUNS, fitted, write

from sim.files.errors import InputError


@st.composite
def mutations(draw, text: bytes):
    """The text with bytes flipped, cut, inserted or columns exchanged."""
    for _ in range(draw(st.integers(1, 4))):
        kind = draw(st.sampled_from(["flip", "cut", "insert", "swap", "repeat"]))
        at = draw(st.integers(0, max(len(text) - 1, 0)))
        if kind == "flip":
            text = text[:at] + bytes([draw(st.integers(0, 255))]) + text[at + 1 :]
        elif kind == "cut":
            text = text[:at] if draw(st.booleans()) else text[:at] + text[at + draw(st.integers(1, 40)) :]
        elif kind == "insert":
            pieces = st.sampled_from([b",", b'"', b"\n", b"\r", b"\x00", b"nan", b"1e308", b"-", b" ", b"]", b"="])
            text = text[:at] + draw(pieces | st.binary(max_size=6)) + text[at:]
        elif kind == "repeat":
            lines = text.split(b"\n")
            k = draw(st.integers(0, len(lines) - 1))
            text = b"\n".join([*lines[:k], lines[k], *lines[k:]])
        else:
            lines = [line.split(b",") for line in text.split(b"\n")]
            i, j = draw(st.integers(0, 13)), draw(st.integers(0, 13))
            for k, cells in enumerate(lines):
                whole = k > 0 or draw(st.booleans())  # with and without the header
                if whole and max(i, j) < len(cells):
                    cells[i], cells[j] = cells[j], cells[i]
            text = b"\n".join(b",".join(cells) for cells in lines)
    return text


def assert_accepted_or_refused(folder: Path) -> None:
    """The reader accepts or raises InputError; what it accepts gives a finite database."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            rows = fitted(folder)
        except InputError:
            return
    assert np.isfinite(rows[["value", "stderr", "worst_residual"]].to_numpy()).all()


EVERYTHING = settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@EVERYTHING
@given(runs=mutations(RUNS.encode()))
def test_any_mutation_of_a_run_file_is_accepted_or_refused(tmp_path, runs):
    assert_accepted_or_refused(write(tmp_path, runs=runs))


@EVERYTHING
@given(header=mutations(HEADER.encode()))
def test_any_mutation_of_the_campaign_file_is_accepted_or_refused(tmp_path, header):
    assert_accepted_or_refused(write(tmp_path, header=header))


HUGE = st.sampled_from(["1e300", "-1e300", "1e308", "1e-300", "1e-320", "1e155", "-1e155", "0", "1e16"])


@EVERYTHING
@given(
    columns=st.lists(st.sampled_from([3, 4, 5, 6, 7, 8, 9]), min_size=1, max_size=3), value=HUGE, row=st.integers(1, 3)
)
def test_huge_and_tiny_numbers_never_give_a_database_that_is_not_finite(tmp_path, columns, value, row):
    lines = [line.split(",") for line in RUNS.splitlines()]
    for column in columns:
        lines[row][column] = value
    assert_accepted_or_refused(write(tmp_path, runs="\n".join(",".join(c) for c in lines)))


@pytest.mark.parametrize("value", ["1e300", "1e-300", "1e200"])
@pytest.mark.parametrize("key", ["density_kgpm3 = 1025.0", "ratio = 1.0", "length_m = 70.2", "x_m = 0.0"])
def test_huge_and_tiny_header_numbers_never_give_a_database_that_is_not_finite(tmp_path, key, value):
    text = HEADER.replace(key, f"{key.split(' = ')[0]} = {value}")
    assert_accepted_or_refused(write(tmp_path, header=text))
