"""The sail's vortex at the stern: closed forms of its path and flow, and what it does to the predicted version."""

from __future__ import annotations

import numpy as np
import pytest

from ident.estimates.carry_over import carry_over
from ident.estimates.predict import predicted
from ident.estimates.sail_vortex import at_planes, sail_of, vortex_flow, vortex_path
from ident.fitting.fit import given_of
from sim.boat.vehicle import load_vehicle

ALONG = np.linspace(0.0, 40.0, 201)


def none(along):
    return 0.0 * along


def test_without_a_hull_the_vortex_drifts_with_the_flow_and_in_a_turn_along_a_parabola():
    assert vortex_path(8j, lambda _: 0.1, 3.0, none, ALONG) == pytest.approx(-4.0 + 8j, abs=1e-9)
    # Sideways speed rises along the boat: y = -(0.1 s + 0.005 s^2 / 2).
    assert vortex_path(8j, lambda s: 0.1 + 0.005 * s, 0.0, none, ALONG) == pytest.approx(-8.0 + 8j, abs=1e-9)


def test_vortices_of_one_call_go_each_its_own_way():
    """As when each is alone: none feels another."""
    strengths, drifts = np.array([-3.0, 0.5, 2.0]), np.array([0.1, 0.0, -0.2])
    together = vortex_path(8j, lambda _: drifts, strengths, lambda s: 4.8 - 0.07 * s, ALONG)
    for end, strength, drift in zip(together, strengths, drifts, strict=True):
        alone = vortex_path(8j, lambda _, d=drift: d, strength, lambda s: 4.8 - 0.07 * s, ALONG)
        assert alone == pytest.approx(end, rel=1e-12)


def test_behind_a_hull_that_tapers_the_vortex_sinks_as_the_flow_between_them_keeps_its_area():
    """pi (r^2 - a^2) is constant: the stream between hull and vortex."""

    def radius(s):
        return 4.8 - 0.07 * s

    end = vortex_path(9.0j, none, 0.0, radius, ALONG)
    assert abs(end) ** 2 - radius(40.0) ** 2 == pytest.approx(81.0 - 4.8**2, rel=1e-8)


def test_beside_a_cylinder_the_image_leads_the_vortex_around_on_a_circle():
    """Milne-Thomson: an image of opposite turn at a^2/r, so that it goes around at Gamma / (2 pi r (r - a^2/r))."""
    a, r, circulation = 4.8, 9.0, 2.0
    end = vortex_path(1j * r, none, circulation, lambda s: a + 0.0 * s, ALONG)
    assert abs(end) == pytest.approx(r, rel=1e-8)
    turned = np.angle(end / 1j)
    assert abs(turned) == pytest.approx(40.0 * circulation / (2.0 * np.pi * r * (r - a**2 / r)), rel=1e-7)
    # It moves as the image below it drives it.
    below = np.conj(-circulation / (2j * np.pi * (1j * r - 1j * a**2 / r)))
    assert np.sign(end.real) == np.sign(below.real)


def test_flow_of_a_vortex_by_biot_and_savart():
    flow = vortex_flow(0j, 5j, 2.0)
    # Below an anticlockwise vortex, seen from astern, the flow goes to starboard.
    assert flow == pytest.approx([0.0, 2.0 / (2.0 * np.pi * 5.0), 0.0], abs=1e-12)
    # To starboard of it the flow rises, which is negative along z.
    assert vortex_flow(5.0 + 0j, 0j, 2.0)[2] == pytest.approx(-2.0 / (2.0 * np.pi * 5.0))


def test_the_vortex_takes_side_force_off_the_stern_planes_and_half_of_it_in_a_turn():
    bb2 = load_vehicle("bb2")
    sail, factors = sail_of(bb2), carry_over(bb2)
    tails = bb2.stern_planes
    length = bb2.particulars.length.value

    def side(angles):
        return sum(a * p.lift_axis[1] for a, p in zip(angles, tails, strict=True))

    # Starboard windward: the sail lifts to port, its vortex loads the planes to starboard.
    drift = at_planes(sail, tails, factors, -4.2e-4, lambda _: 0.158, length)
    other = at_planes(sail, tails, factors, 4.2e-4, lambda _: -0.158, length)
    assert side(drift) > 0.0
    assert side(other) == pytest.approx(-side(drift), rel=1e-9)
    # A turn with a drift of 9 deg and a radius of 104 m: the sail meets 5 deg, the stern 26.
    turn = at_planes(sail, tails, factors, -2.4e-4, lambda s: 0.158 - (sail.origin - s) / 104.0, length)
    assert 0.2 * side(drift) < side(turn) < 0.6 * side(drift)


def test_it_widens_the_errors_of_drift_and_moves_no_value(campaign, rows):
    given = given_of(campaign)
    without, _ = predicted(campaign.vehicle, rows, given, ["sail_vortex"])
    found, done = predicted(campaign.vehicle, rows, given)
    assert next(one for one in done if one.name == "sail_vortex").applied
    np.testing.assert_allclose(found["value"], without["value"], rtol=1e-9)
    wider = found["stderr"].to_numpy() > without["stderr"].to_numpy() * (1.0 + 1e-9)
    assert set(found.loc[wider, "coefficient"]) == {"Y_uvw", "Z_uvw", "K_uvw", "M_uvw", "N_uvw"}
    assert found.loc[wider, "beta_deg"].ne(0.0).all()
