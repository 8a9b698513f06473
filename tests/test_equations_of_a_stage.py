"""Authority: closed form: what an earlier stage found is known to a later one; no place stands beside a matrix."""

from __future__ import annotations

import numpy as np
import pytest

from ident.identification.equations import Equations, Form, _matrix


def test_a_node_of_an_earlier_stage_is_known():
    """Found by a plan whose runs name a value again that the campaign has: the heap was written over."""
    forms = [Form("Y", {1: 2.0, 3: 5.0}, {0: 1.0, 1: 4.0}), Form("Y", {0: 7.0}, {})]
    one = np.zeros(3)
    found = Equations(forms, np.array([0, 1, 0]), np.arange(3), np.zeros(3, int), one, one)
    unknowns, known = found.design(2)
    assert unknowns.toarray().tolist() == [[0.0, 5.0], [0.0, 0.0], [0.0, 5.0]]
    assert known.toarray().tolist() == [[1.0, 6.0], [7.0, 0.0], [1.0, 6.0]]


def test_no_place_beside_the_matrix():
    with pytest.raises(IndexError, match="nodes 1 to 1 of 2 to 4"):
        _matrix([{1: 1.0}], 2, 2)
