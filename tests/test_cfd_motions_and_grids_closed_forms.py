"""Closed forms: a screw motion, and what three grids whose error is a power of the cell say."""

from __future__ import annotations

import numpy as np
import pytest

from ident.captive.grids import convergence
from ident.cfd.motions import screw


def test_a_screw_motion_gives_back_the_velocity_of_the_origin():
    rng = np.random.default_rng(3)
    for _ in range(20):
        velocity, rate = rng.standard_normal(3), rng.standard_normal(3)
        along, centre = screw(velocity, rate)
        assert along + np.cross(rate, -centre) == pytest.approx(velocity)
        assert np.cross(along, rate) == pytest.approx(np.zeros(3), abs=1e-12)


@pytest.mark.parametrize("order", [0.7, 1.0, 1.6, 2.0])
def test_richardson_finds_order_and_error_of_a_power_law(order):
    values = [1.0 + 0.03 * 1.4 ** (order * k) for k in range(3)]
    found = convergence(*values, 1.4)
    assert found.kind == "monotonic"
    assert found.order == pytest.approx(order)
    assert found.uncertainty == pytest.approx(1.25 * 0.03)


def test_grids_that_do_not_converge_say_so():
    assert convergence(1.0, 1.1, 1.05, 1.4).kind == "none"
    swinging = convergence(1.0, 1.1, 0.8, 1.4)
    assert (swinging.kind, swinging.uncertainty) == ("oscillatory", pytest.approx(0.15))
    assert convergence(1.0, 2.0, 2.1, 1.4).uncertainty == pytest.approx(3.0 * 1.1)
