"""What planes carry in free flight and not in their towed runs: Whicker and Fehlner, actuator disc, images."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ident.estimates.carry_over import carry_over, hull_below, wall_factor
from ident.estimates.draft import Draft, NotApplicable
from ident.estimates.fin_lift import bend, fin_lift, grown, lift_slope, tip_drag
from ident.estimates.saturation import continued_rows
from ident.estimates.suction import drawn, propeller_suction, solid_angle, thrust_loading
from ident.estimates.turning import Given
from sim.hull.lattice import Fin


@pytest.fixture(scope="module")
def bb2(campaign):
    return campaign.vehicle


@pytest.fixture(scope="module")
def planes(bb2):
    return carry_over(bb2)


def test_lift_slope_is_the_printed_one_and_that_of_slender_wings():
    # Whicker and Fehlner, Eq. [1], at a = 1: 0.9 2 pi / (sqrt 5 + 1.8).
    assert lift_slope(1.0) == pytest.approx(1.401, abs=5e-4)
    # Small aspect ratios: pi a / 2 times 0.9 2 / 1.9; large ones: 0.9 2 pi.
    assert lift_slope(1e-6) / 1e-6 == pytest.approx(0.5 * math.pi * 1.8 / 1.9, rel=1e-6)
    assert lift_slope(1e9) == pytest.approx(1.8 * math.pi, rel=1e-6)


def test_tip_drag_lies_between_the_published_forms():
    """Prestero (2001): 0.56 for the faired tips of REMUS at a taper ratio of 0.654."""
    mean, sigma = tip_drag(0.654)
    assert mean - math.sqrt(3.0) * sigma == pytest.approx(0.558, abs=1e-3)
    # Whicker and Fehlner's own family, taper 0.45: 0.80 with square tips.
    mean, sigma = tip_drag(0.45)
    assert mean + math.sqrt(3.0) * sigma == pytest.approx(0.80, abs=0.03)


def test_bent_lift_meets_the_run_and_grows_with_the_square():
    angles = np.array([10.0, 20.0, 30.0])
    found = grown(angles, 0.12)
    assert found[0] == pytest.approx(10.0, rel=1e-12)
    # L = k (alpha + c alpha^2): second differences at 10, 20 and 30 deg are 2 k c (10 deg)^2.
    step = math.radians(10.0)
    scale = 10.0 / (step * (1.0 + 0.12 * step))
    assert found[2] - 2.0 * found[1] + found[0] == pytest.approx(2.0 * scale * 0.12 * step**2, rel=1e-9)


def test_only_loads_that_were_carried_on_are_bent(bb2, rows, planes):
    draft = Draft.of(bb2, rows)
    before = draft.value.copy()
    fin_lift(draft)
    continued = continued_rows(draft)
    assert np.array_equal(draft.value != before, continued & (before != 0.0))
    at = continued & (np.abs(draft.axis("delta")) == 20.0) & draft.where(["Z_d1"])
    curved, _ = bend(planes.stern_fin)
    # The line through the run at 10 deg ends in the neutral load, so that only the excess over it is bent.
    assert np.all(draft.value[at] / before[at] > 1.0)
    assert np.all(draft.value[at] / before[at] < 1.2 * grown(20.0, curved) / 20.0)


def test_solid_angle_of_a_disc():
    for ahead, radius in ((3.0, 4.0), (0.5, 2.5), (40.0, 2.5)):
        exact = 2.0 * math.pi * (1.0 - ahead / math.hypot(ahead, radius))
        assert solid_angle(ahead, radius, 0.0) == pytest.approx(exact, rel=2e-3)
    # Far away: area times the cosine over the square of the distance.
    assert solid_angle(300.0, 2.0, 400.0) == pytest.approx(4.0 * math.pi * 0.6 / 500.0**2, rel=1e-3)
    # Over a plane before the disc the flux is half of what the disc drinks: half its solid angle in the mean.
    r = np.linspace(0.0, 400.0, 4001)
    angle = np.array([solid_angle(2.0, 1.0, float(x)) for x in r])
    flux = np.trapezoid(angle * r, r) * 2.0 * math.pi
    assert flux == pytest.approx(2.0 * math.pi * math.pi, rel=1e-2)


def test_flow_in_the_disc_is_that_of_momentum_theory():
    # C_T = 4 a (1 + a) with a the flow added in the disc over the advance.
    for a in (0.05, 0.2, 0.5):
        before = 1.0 - 0.25 / math.hypot(0.25, 2.5)
        assert drawn(4.0 * a * (1.0 + a), 0.25, 2.5, 0.0) == pytest.approx(a * before, rel=1e-2)
    assert drawn(0.0, 3.0, 2.5, 1.0) == 0.0


def test_thrust_of_bb2_is_that_of_its_open_water_curve(bb2, rows):
    """K_T at the published revolutions of 10 kts, 1.18 1/s, gives the loading that resistance and deduction give."""
    loading, wake = thrust_loading(Draft.of(bb2, rows), bb2.propeller.diameter.value)
    advance = (1.0 - wake) * 5.14444 / (1.18 * 5.0)
    thrust = -0.0923 * advance**2 - 0.3652 * advance + 0.4786
    assert loading == pytest.approx(8.0 * thrust / (math.pi * advance**2), rel=0.02)


def test_suction_is_small_and_only_where_planes_were_towed(bb2, rows):
    draft = Draft.of(bb2, rows)
    before = draft.value.copy()
    propeller_suction(draft, Given())
    stern = draft.where(["[XYZKMN]_d*"], [p.name for p in bb2.stern_planes])
    assert np.array_equal(draft.value != before, stern & (draft.axis("delta") != 0.0) & (before != 0.0))
    deflected = stern & (np.abs(draft.axis("delta")) == 10.0) & draft.where(["Y_d1"])
    assert np.all(np.abs(draft.value[deflected] / before[deflected] - 1.009) < 0.002)
    with pytest.raises(NotApplicable, match="at work"):
        propeller_suction(Draft.of(bb2, rows), Given(propelled=True))


def test_image_of_a_plane_in_the_hull_below():
    """Far above the hull the flow about it is a dipole: -a^2 / z^2 of all that plane and root carry."""
    fin = Fin(((1.0, 0.0, 2.0), (1.2, 0.0, 2.0), (4.0, 0.2, 1.8)), 0.0)
    whole = wall_factor(fin, 1.0, (3, 6, 3))
    high = hull_below(fin, 1.0, 200.0, 5.0, (3, 6, 3))
    assert high == pytest.approx(-((5.0 / 200.0) ** 2) * whole, rel=2e-3)
    # Beside the hull the image is on the plane's side, as of a stern plane; between both it changes sign.
    assert hull_below(fin, 1.0, 0.0, 0.9, (3, 6, 3)) > 0.0
    # Mean value: a vortex from y1 to y2 gives the slope of -a^2 y / (y^2 + z^2) somewhere between.
    near = hull_below(fin, 1.0, 9.7, 5.0, (3, 6, 3)) / whole
    slope = [-(25.0) * (9.7**2 - y**2) / (9.7**2 + y**2) ** 2 for y in (1.0, 4.0)]
    assert slope[0] < near < slope[1]


def test_hull_below_bb2s_sail_planes(planes):
    # A cylinder of 5 m, vortices pi/4 of 4.19 m off the centre plane and 9.73 m up: -5^2 / (3.29^2 + 9.73^2).
    assert planes.below == pytest.approx(-25.0 / (3.29**2 + 9.73**2), abs=2.0 * planes.below_sigma)
    assert 0.0 < planes.below_sigma < 0.2 * abs(planes.below)
