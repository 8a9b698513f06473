"""The predicted version of BB2: what estimates add, and that the runs alone stay what they were."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ident.estimates.ablation import without
from ident.estimates.draft import measured_rows
from ident.estimates.predict import names, predicted
from ident.fitting.fit import given_of
from ident.validation.draws import draw
from sim.boat.coefficients import Coefficients
from sim.boat.database import digest
from sim.boat.delta_log import Version
from sim.boat.forces import body_velocity
from sim.boat.row_codec import correlation_matrix
from sim.files.errors import InputError
from sim.kernel import rhs as kernel
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace

MEASURED_ONLY = "3a58a8a6c322140b"


@pytest.fixture(scope="module")
def given(campaign):
    return given_of(campaign)


@pytest.fixture(scope="module")
def version(campaign, rows, given):
    return predicted(campaign.vehicle, rows, given)


def test_runs_alone_keep_their_digest_and_come_back_from_the_predicted_version(rows, version):
    assert digest(rows)[:16] == MEASURED_ONLY
    back = measured_rows(version[0])
    assert len(back) == len(rows)
    assert digest(back) == digest(rows)


def test_every_row_that_an_estimate_touched_says_so(rows, version):
    found, done = version
    assert [one.name for one in done] == names()
    assert [one.name for one in done if not one.applied] == ["lines"]
    changed = (found["measured_value"].isna() | (found["measured_value"] != found["value"])).to_numpy()
    assert np.array_equal(changed, found["estimated_by"].ne("").to_numpy() & changed)
    assert set(found.loc[found["origin"] == "estimated", "n_runs"]) == {0}
    assert found["stderr"].ge(0.0).all()
    assert np.isfinite(found[["value", "stderr"]].to_numpy()).all()


def test_shared_errors_make_a_covariance_that_can_be_drawn(version):
    estimates, matrix = correlation_matrix(version[0])
    # Six digits of a correlation are stored.
    assert np.linalg.eigvalsh(matrix).min() > -1e-3
    drawn = draw(matrix, 3, seed=1)
    assert drawn.shape == (3, len(estimates))
    # Planes are wrong by one factor: their errors go together.
    plane = estimates[(estimates["coefficient"] == "Y_d1") & (estimates["value"].abs() > 1e-3)].index
    assert np.abs(matrix[np.ix_(plane, plane)]).min() > 0.3


def test_what_a_plane_carries_undeflected_is_not_carried_over(rows, version):
    """By definition the load on root and hull that a deflection makes vanishes without one."""
    found = version[0].iloc[: len(rows)]
    planes = rows["coefficient"].str.match("[XYZKMN]_d[1-4B]").to_numpy()
    neutral = planes & rows["delta_deg"].eq(0.0).to_numpy()
    assert neutral.sum() > 50
    assert rows.loc[neutral, "value"].abs().max() > 1e-5
    np.testing.assert_allclose(found.loc[neutral, "value"], rows.loc[neutral, "value"], rtol=1e-9)

    def change(table):
        at = table[(table["coefficient"] == "Z_d1") & (table["speed_mps"] == 5.14444) & (table["depth_m"] == 25.0)]
        at = at.drop_duplicates("delta_deg").set_index("delta_deg")["value"]
        return (at[[-10.0, 10.0]] - at[0.0]).to_numpy()

    factor = change(found) / change(rows)
    # Lift slope and carry-over are one factor of what deflection changes, to either side.
    assert factor[0] == pytest.approx(factor[1], rel=1e-9)
    assert factor[0] == pytest.approx(2.0, abs=0.05)


def _loads(coefficients, environment, velocity, rates):
    model = assemble(coefficients, environment)
    work = workspace(model)
    state = np.concatenate([velocity, rates, [0.0, 0.0, 25.0], np.zeros(3)])
    controls = np.append(np.zeros(len(coefficients.vehicle.planes)), 1.0)
    kernel.features(model, state, controls, work)
    return kernel.loads(model, work)[:6].copy()


def test_predicted_boat_is_symmetric_and_damped(campaign, version, environment):
    coefficients = Coefficients(campaign.vehicle, version[0])
    turn = np.array([1.0, -1.0, 1.0])
    for beta, r in ((-0.1, 0.03), (0.15, 0.01), (-0.2, -0.02)):
        velocity, rates = np.array(body_velocity(5.0, 0.02, beta)), np.array([0.0, 0.0, r])
        there = _loads(coefficients, environment, velocity * turn, -rates * turn)
        here = _loads(coefficients, environment, velocity, rates)
        # The propeller turns one way: its torque alone is not mirrored.
        assert there[[0, 1, 2, 4, 5]] == pytest.approx(here[[0, 1, 2, 4, 5]] * [1, -1, 1, 1, -1], rel=1e-9, abs=1e-3)
    still, turning = ((np.array([5.0, -0.6, 0.0]), np.array([0.0, 0.0, r])) for r in (0.0, 0.03))
    assert _loads(coefficients, environment, *turning)[5] < _loads(coefficients, environment, *still)[5]


def test_cross_flow_acts_only_where_drift_and_yaw_come_together(campaign, version, environment):
    found = version[0]
    whole = Coefficients(campaign.vehicle, found)
    bare = Coefficients(campaign.vehicle, found[~found["coefficient"].isin(["Y_cross", "N_cross"])])

    def change(v, r):
        motion = np.array([5.0, v, 0.0]), np.array([0.0, 0.0, r])
        return _loads(whole, environment, *motion)[[1, 5]] - _loads(bare, environment, *motion)[[1, 5]]

    assert change(0.6, 0.0) == pytest.approx([0.0, 0.0], abs=1e-6)
    assert change(0.0, 0.03) == pytest.approx([0.0, 0.0], abs=1e-3)
    force, moment = change(-0.6, 0.03)
    # A boat that drifts outward in its turn meets more cross-flow aft: more side force inward, more damping.
    assert force > 1e4
    assert moment < -1e5
    # Twice the motion, four times the load.
    assert change(-1.2, 0.06) == pytest.approx([4.0 * force, 4.0 * moment], rel=1e-9)


def test_a_version_without_an_estimate_or_a_term(campaign, rows, version, given):
    found, _ = version
    commit = Version(0, "", {"given": json.dumps({"speed": given.speed, "pure_yaw": given.pure_yaw})})
    less = without(campaign.vehicle, found, commit, ["cross_flow", "X_vr"], "--without")
    assert not less["coefficient"].isin(["Y_cross", "N_cross", "X_vr"]).any()
    arm = less[less["coefficient"] == "N_ur"]
    measured = rows[rows["coefficient"] == "N_ur"]
    np.testing.assert_allclose(arm["value"], measured["value"], rtol=1e-9)
    with pytest.raises(InputError, match="estimate"):
        without(campaign.vehicle, found, commit, ["N_nothing"], "--without")
    with pytest.raises(InputError, match="runs alone"):
        without(campaign.vehicle, rows, commit, ["cross_flow"], "--without")


def test_the_reading_of_the_source_decides_the_damping_within_its_error(campaign, rows, given, version):
    """Pure yaw taken off by the source or not: the two readings lie about one standard error from their mean."""
    found = version[0]
    mean = found[(found["coefficient"] == "N_ur") & np.isclose(found["ur_mps2"], 0.16)].iloc[0]
    only = [n for n in names() if n != "cross_flow"]
    speed, (share, sigma) = given.speed, given.pure_yaw
    ends = []
    for taken in (0.0, 1.0):
        other = predicted(campaign.vehicle, rows, type(given)(speed, (taken, sigma)), only)[0]
        ends.append(other[(other["coefficient"] == "N_ur") & np.isclose(other["ur_mps2"], 0.16)].iloc[0]["value"])
    assert share == 0.5
    assert np.mean(ends) == pytest.approx(mean["value"], rel=1e-6)
    assert 0.5 * abs(ends[1] - ends[0]) < mean["stderr"]
    assert 0.5 * abs(ends[1] - ends[0]) > 0.4 * mean["stderr"]
