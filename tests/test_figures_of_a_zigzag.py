"""Authority: the flight itself: what is drawn of a zigzag is what was commanded and what the planes did."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ident
from ident.validation.figures import _draw, case_figure

SUBOFF = Path(__file__).parents[1] / "raw_captive_data" / "suboff"


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    db = str(tmp_path_factory.mktemp("zigzag") / "db")
    ident.fit(SUBOFF, db=db)
    return ident.validate("suboff-hzz10", db)


def test_planes_command_and_check_angles_are_drawn(flown):
    figure, _ = _draw(flown.flown, None)
    by_label = {axis.get_ylabel(): axis for axis in figure.axes}
    heading = next(axis for label, axis in by_label.items() if label.startswith("heading psi"))
    drawn = [line.get_ydata() for line in heading.lines]
    assert any(np.array_equal(y, np.degrees(flown.simulation["dH"])) for y in drawn)
    levels = {float(y[0]) for y in map(np.asarray, drawn) if len(y) == 2}
    assert {-10.0, 10.0} <= levels
    planes = {line.get_label(): line.get_ydata() for line in by_label["plane deflection [deg]"].lines}
    wanted = [p.name for p in flown.boat.vehicle.planes]
    assert list(planes) == wanted
    for name in wanted:
        np.testing.assert_array_equal(planes[name], np.degrees(flown.simulation[name]))


@pytest.mark.parametrize(("kind", "head"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_the_suffix_decides_the_format(flown, tmp_path, kind, head):
    assert case_figure(flown.flown, tmp_path / f"one.{kind}").read_bytes().startswith(head)
