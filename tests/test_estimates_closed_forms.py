"""Estimates of a prediction against closed forms: cross-flow integrals, Kirchhoff's equations, covariance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from ident.estimates.cross_flow import Strips, coupling, drift_drag, integrals, literature_drag, strips, weighted_mean
from ident.estimates.draft import Draft
from ident.estimates.extrapolation import reach, trend_error
from ident.estimates.facility import shared_errors
from ident.estimates.potential import impulse_loads, product_load
from ident.estimates.saturation import reached, saturation_angle
from ident.estimates.turning import Given, Shared
from sim.boat.row_codec import correlation_pairs
from sim.files.errors import InputError


def cylinder(half: float, width: float, n: int = 4000) -> Strips:
    edges = np.linspace(-half, half, n + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    return Strips(middle, np.full(n, width), float(edges[1] - edges[0]))


def test_cross_flow_of_a_cylinder_in_closed_form():
    half, width = 30.0, 4.0
    hull = cylinder(half, width)
    force, moment = integrals(hull, np.array([0.0, 10.0, 50.0]))
    # Turning on the spot; about a point inside; about a point outside.
    x = 10.0
    inside = width * ((half + x) ** 3 - (half - x) ** 3) / 3.0
    outside = width * ((50.0 + half) ** 3 - (50.0 - half) ** 3) / 3.0
    assert force == pytest.approx([0.0, inside, outside], rel=1e-6, abs=1e-6)
    assert moment[0] == pytest.approx(width * half**4 / 2.0, rel=1e-6)
    by_quadrature = quad(lambda s: width * s * (x + s) * abs(x + s), -half, half, points=[-x])[0]
    assert moment[1] == pytest.approx(by_quadrature, rel=1e-6)


def test_coupling_vanishes_alone_and_is_straight_beyond_the_hull():
    hull = cylinder(30.0, 4.0)
    assert coupling(hull, 0.0) == (pytest.approx([0.0]), pytest.approx([0.0]))
    force, moment = coupling(hull, np.array([-60.0, 30.0, 45.0, 60.0]))
    assert force[3] - force[2] == pytest.approx(force[2] - force[1], rel=1e-6, abs=1e-3)
    assert moment[3] - moment[2] == pytest.approx(moment[2] - moment[1], rel=1e-6)
    # Fore and aft alike: the force turns with v/r, the moment does not.
    assert force[0] == pytest.approx(-force[3])
    assert moment[0] == pytest.approx(moment[3])


def test_cross_flow_takes_energy_out_of_any_motion():
    hull = cylinder(30.0, 4.0)
    for pivot in np.linspace(-80.0, 80.0, 33):
        force, moment = integrals(hull, pivot)
        assert pivot * force[0] + moment[0] > 0.0


def test_second_order_part_of_a_load_in_drift_is_given_back():
    angle = np.radians([4.0, 8.0, 12.0, 16.0])
    value = -0.07 * np.sin(angle) * np.cos(angle) - 0.05 * np.sin(angle) ** 2
    found = drift_drag(angle, value, np.full(4, 1e-4))
    assert found is not None
    assert found[0] == pytest.approx(-0.05, rel=1e-9)
    assert drift_drag(angle, -0.07 * angle, np.full(4, 1e-4)) is None
    assert drift_drag(angle[:2], value[:2], np.full(2, 1e-4)) is None


def test_second_order_part_has_the_error_it_states():
    rng = np.random.default_rng(5)
    angle, sigma = np.radians([4.0, 8.0, 12.0]), np.array([4e-4, 5e-4, 7e-4])
    true = -0.07 * np.sin(angle) * np.cos(angle) - 0.05 * np.sin(angle) ** 2
    scores = []
    for _ in range(400):
        found = drift_drag(angle, true + sigma * rng.standard_normal(3), sigma)
        if found is not None:
            scores.append((found[0] + 0.05) / found[1])
    assert np.mean(np.abs(scores) < 1.96) == pytest.approx(0.95, abs=0.03)


def test_weighted_mean_widens_by_scatter_beyond_the_errors():
    assert weighted_mean([(1.0, 0.1), (1.0, 0.1)]) == (pytest.approx(1.0), pytest.approx(0.1 / np.sqrt(2.0)))
    assert weighted_mean([(0.0, 0.1), (1.0, 0.1)])[1] == pytest.approx(0.5)


def test_strips_of_bb2_have_its_volume_and_origin(campaign):
    hull = strips(campaign.vehicle)
    assert hull.x.max() == pytest.approx(32.33 - 0.0962, abs=0.2)
    # Published beam 9.6 m and length 70.2 m; a hull of this form fills 80 to 90 % of their rectangle.
    assert strips(campaign.vehicle, vertical=True).width.max() == pytest.approx(9.6, abs=0.1)
    assert 0.8 < strips(campaign.vehicle, vertical=True).moment_of_area(0) / (9.6 * 70.2) < 0.9
    mean, sigma = literature_drag(hull)
    assert 0.62 < mean / 0.7 < 0.68
    assert sigma / mean == pytest.approx(1.0 / 0.7 / np.sqrt(12.0))


def test_kirchhoffs_loads_do_no_work_and_are_those_of_the_textbook():
    rng = np.random.default_rng(2)
    a = rng.standard_normal((6, 6))
    added = a @ a.T
    for _ in range(20):
        motion = rng.standard_normal(6)
        assert motion @ impulse_loads(added, motion) == pytest.approx(0.0, abs=1e-10)
    # Port/starboard symmetric body: Fossen (2011), Handbook of Marine Craft, section 6.3 (Imlay 1961).
    added[0, 1::2] = added[1::2, 0] = added[2, 1::2] = added[1::2, 2] = added[4, 1::2] = added[1::2, 4] = 0.0
    y_v, z_w, y_r, z_q, k_p, m_q, n_r = -added[[1, 2, 1, 2, 3, 4, 5], [1, 2, 5, 4, 3, 4, 5]]
    k_r, y_p = -added[3, 5], -added[1, 3]
    assert product_load(added, "X", "v", "r") == pytest.approx(-y_v)
    assert product_load(added, "X", "w", "q") == pytest.approx(z_w)
    assert product_load(added, "Y", "w", "p") == pytest.approx(-z_w)
    assert product_load(added, "Z", "v", "p") == pytest.approx(y_v)
    assert product_load(added, "Z", "r", "p") == pytest.approx(y_r)
    assert product_load(added, "Y", "p", "q") == pytest.approx(-z_q)
    assert product_load(added, "K", "q", "r") == pytest.approx(-(m_q - n_r))
    assert product_load(added, "M", "r", "p") == pytest.approx(k_p - n_r)
    assert product_load(added, "N", "p", "q") == pytest.approx(-(k_p - m_q))
    assert product_load(added, "K", "v", "q") == pytest.approx(y_r + z_q)
    assert product_load(added, "K", "p", "q") == pytest.approx(k_r)
    assert product_load(added, "M", "v", "p") == pytest.approx(-y_r)
    assert product_load(added, "M", "v", "r") == pytest.approx(y_p)
    assert product_load(added, "N", "w", "p") == pytest.approx(z_q)


def test_lift_reached_is_the_expectation_of_a_saturating_line():
    mean, sigma = saturation_angle()
    for angle in (5.0, 18.0, 20.0, 30.0):
        expected = quad(lambda s, a=angle: min(a, s) * norm.pdf(s, mean, sigma), -40.0, 80.0, points=[angle])[0]
        assert reached(angle, mean, sigma) == pytest.approx(expected, rel=1e-6)


def test_an_offset_of_all_runs_moves_loads_by_itself_and_their_sum_by_both(campaign, rows):
    runs = frozenset(campaign.runs.loc[campaign.runs["test"] == "drift_vertical", "run_id"].astype(str))
    offset = {"Z": 1.5e-4, "M": -4e-5}
    given = Given(shared=(Shared("prints", None, runs, (), offset),))
    draft = Draft.of(campaign.vehicle, rows)
    assert shared_errors(draft, given) == "prints Z +1.5e-04 M -4.0e-05"
    (direction,) = draft.directions.values()
    for name, prime in offset.items():
        of_drift = draft.where([f"{name}_uvw"]) & (draft.axis("beta") == 0.0)
        assert of_drift.sum() == 84
        assert set(direction[of_drift]) == {prime}
    assert set(direction[draft.where(["X_uvw", "Y_uvw", "Z_uq", "M_d1"])]) == {0.0}
    none = Given(shared=(Shared("prints", None, runs, (), {"Y": 1e-4}),))
    with pytest.raises(InputError, match=r"shared_error\.offset of prints.* prime load Y"):
        shared_errors(Draft.of(campaign.vehicle, rows), none)


def test_shared_errors_of_a_draft_are_those_of_their_unknowns(campaign, rows):
    draft = Draft.of(campaign.vehicle, rows)
    lift = draft.where(["Y_d1"])
    draft.multiply(lift, 2.0, 0.3, "factor", "twice")
    new = draft.add("Y_wr", [{"wr": 0.0, "D0": 25.0}], [0.0], "nothing")
    draft.spread("factor", np.where(new, 7.0, 0.0))
    done = draft.finished()
    before = rows[rows["coefficient"] == "Y_d1"].reset_index(drop=True)
    after = done[done["coefficient"] == "Y_d1"].reset_index(drop=True)
    assert after["value"].to_numpy() == pytest.approx(2.0 * before["value"].to_numpy(), rel=1e-11)
    assert after["measured_value"].to_numpy() == pytest.approx(before["value"].to_numpy())
    expected = np.hypot(2.0 * before["stderr"], 0.3 * before["value"])
    assert after["stderr"].to_numpy() == pytest.approx(expected.to_numpy(), rel=1e-9)
    assert set(after["estimated_by"]) == {"twice"}
    added = done[done["coefficient"] == "Y_wr"].iloc[0]
    assert added["origin"] == "estimated"
    assert added["stderr"] == pytest.approx(7.0)
    assert np.isnan(added["measured_value"])
    one = after[after["value"] != 0.0].iloc[0]
    shared = 0.3 * before["value"][after["value"] != 0.0].iloc[0] * 7.0
    assert correlation_pairs(added["correlation"])[int(one["estimate"])] == pytest.approx(
        shared / (one["stderr"] * 7.0), rel=1e-5
    )
    others = ~done["coefficient"].isin(["Y_d1", "Y_d4", "Y_wr"])
    untouched = rows["coefficient"].isin(done["coefficient"][others])
    assert done["value"][others].to_numpy() == pytest.approx(rows["value"][untouched].to_numpy(), rel=0.0, abs=0.0)


def test_error_beyond_the_runs_is_their_trend_and_turns_no_sign():
    rate, value = np.array([0.001, 0.002, 0.004]), -1.0 + 0.01 * np.log([0.001, 0.002, 0.004])
    assert trend_error(rate, value, 0.04) == pytest.approx(0.01 * np.log(10.0))
    assert trend_error(rate, value, 0.004) == 0.0
    assert trend_error(rate, np.array([-9.0, -5.0, -1.0]), 0.04) == pytest.approx(0.5)
    # SUBOFF-like numbers: half a length per second of a boat of 70 m at 5 m/s.
    assert reach("r", 5.0, 70.0) == pytest.approx(0.0357, abs=1e-4)
    assert reach("wq", 5.0, 70.0) == pytest.approx(0.2 * reach("uq", 5.0, 70.0))
    assert reach("D0", 5.0, 70.0) is None
