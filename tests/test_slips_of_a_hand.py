"""Authority: the rule for bad input. Slips of a hand in files of a boat end in a refusal or in a whole table."""

from __future__ import annotations

from sample_of_mutations import sample


def test_slips_of_a_hand():
    """``sample`` raises for any exception but InputError, and for numbers that are not finite."""
    counts, accepted = sample(60, seed=7)
    assert sum(counts.values()) == 60
    assert counts["refused"] > 15
    assert len(accepted) == counts["accepted"] + counts["accepted, nothing changed"]
