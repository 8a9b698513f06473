"""Every key of ``[[source]]``: changing it changes the result, or is refused; what is unused says why.

That every key has a case is held by tests/test_every_key_of_a_campaign_has_a_case.py.
"""

from __future__ import annotations

import pytest
from cases_of_source_keys import SAID, SOURCE_CASES
from declared_campaigns import DRIFT, ROWS, differs, of, outcome


@pytest.mark.parametrize("key", SOURCE_CASES)
def test_every_key_of_a_source_counts(tmp_path, key):
    before, after, how = SOURCE_CASES[key]
    differs(
        tmp_path,
        before,
        after,
        how.get("files"),
        words=how.get("words", False),
        named=key,
        elsewhere=how.get("said", "") or SAID.get(key, ""),
    )


def test_what_is_declared_and_unused_names_file_key_and_reason(tmp_path):
    for own, words in (
        (of(DRIFT, normalisation="half_rho_L2"), ("campaign.toml", "source.normalisation", "nothing is made")),
        (of(DRIFT, ignore=["Cd"]), ("campaign.toml", "source.ignore", "no column of the files fits it")),
        (of(DRIFT, factor={"Q": 2.0}), ("campaign.toml", "source.factor", "has this name")),
        (of(DRIFT, words={"a b": "towing"}), ("campaign.toml", "source.words", "no text column")),
        (of(DRIFT, rho_inf=1.0), ("campaign.toml", "source.rho_inf", "does not look at it")),
    ):
        found = outcome(tmp_path, own, {"drift.csv": ROWS})
        assert all(w in found["refused"] for w in words), found
