"""Authority: the flight at a quarter of the step. The recorded table is what the program does."""

from __future__ import annotations

import numpy as np
import pytest

from sim.bench.boat import frozen_boat
from sim.bench.step_errors import recorded, step_error
from sim.flight.case import load_case


def test_recorded_errors_are_those_of_the_flights():
    case, _ = load_case("hzz20")
    found, kept = step_error(case, frozen_boat()), next(e for e in recorded() if e.case == "hzz20")
    assert found.step_s == kept.step_s
    assert np.allclose(found[2:], kept[2:], rtol=0.02)


@pytest.mark.parametrize("error", recorded(), ids=lambda e: e.case)
def test_no_case_loses_a_fiftieth_of_a_channel_to_its_step(error):
    off, size = np.array(error[2::2]), np.array(error[3::2])
    assert (off <= np.maximum(0.02 * size, [0.005, 0.01, 0.02, 0.05, 0.1])).all()
