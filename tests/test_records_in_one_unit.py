"""A record is SI once it is read, and keeps its file's numbers to the last digit for what is reported in them."""

from __future__ import annotations

import numpy as np
import pytest

from ident.calibration.file import Training
from ident.calibration.problem import _channel
from sim.files.record import Record, Written
from sim.flight.series import Series


def test_degrees_become_radians_once_and_are_shown_as_written():
    written = Written(np.array([0.1, 0.3]), "deg/s", np.array([0.01, 0.02]))
    record = Record.read("r", np.array([0.0, 1.0]), written)
    assert record.unit == "rad/s"
    np.testing.assert_allclose(record.value, np.radians([0.1, 0.3]), rtol=1e-15)
    np.testing.assert_allclose(record.sigma, np.radians([0.01, 0.02]), rtol=1e-15)
    assert record.shown.value.tolist() == [0.1, 0.3]
    assert record.kept(np.array([False, True])).shown.sigma.tolist() == [0.02]
    assert record.less(0.1).shown.value.tolist() == [0.0, 0.3 - 0.1]
    assert record.in_unit("rad/s").value.tolist() == record.value.tolist()
    with pytest.raises(ValueError, match="no unit of it"):
        record.in_unit("m/s")
    with pytest.raises(ValueError, match="arrays of"):
        Record("r", np.zeros(2), np.zeros(3), "rad/s")


def test_sources_in_degrees_and_radians_are_calibrated_alike():
    """One motion written in deg and in rad differs by nothing, and has one discrepancy."""
    t = np.linspace(0.0, 100.0, 101)
    heading = np.radians(20.0 * np.sin(t / 10.0))
    sigma = np.full(t.size, np.radians(0.5))
    series = Series(
        {
            "A": {"psi": Record("psi", t, heading, "rad", sigma)},
            "B": {"psi": Record.read("psi", t, Written(np.degrees(heading), "deg", np.degrees(sigma)))},
        }
    )
    found = [
        _channel(Training(case="zz", source=one, differs_from=other), series, "zz", "psi", ["psi"])
        for one, other in (("A", "B"), ("B", "A"))
    ]
    np.testing.assert_allclose(found[0].value, found[1].value, rtol=0.0, atol=1e-12)
    assert found[0].degrees == found[1].degrees
    assert found[0].reading == pytest.approx(found[1].reading)
    assert max(f.against for f in found) < 1e-12
