"""Error bands: draws with the stored covariance, flights that do not depend on workers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.validation.band_summary import inside, variance_shares
from ident.validation.bands import Bands, Execution, fly_samples
from ident.validation.draws import draw
from ident.validation.samples import batch_of
from sim.boat.coefficients import Coefficients
from sim.boat.row_codec import correlation_matrix
from sim.files.record import Record, Written
from sim.flight.case import load_case
from sim.flight.series import load_reference
from sim.flight.simulate import simulate
from sim.kernel.rhs import BEGUN, MIDPOINT


@pytest.fixture(scope="module")
def short_case():
    case, where = load_case("vzz10-10kt")
    return case.model_copy(update={"run": case.run.model_copy(update={"duration_s": 30.0})}), where


def test_draws_have_the_stored_covariance(rows):
    """Sample variances and the correlations of the database, to their sampling error."""
    estimates, correlation = correlation_matrix(rows)
    drawn = draw(correlation, 4000, seed=3)
    assert drawn.shape == (4000, len(estimates))
    assert np.abs(drawn.std(axis=0) - 1.0).max() < 0.06
    pairs = np.argwhere(np.triu(np.abs(correlation), 1) > 0.1)
    assert len(pairs) > 50
    found = np.array([np.corrcoef(drawn[:, i], drawn[:, j])[0, 1] for i, j in pairs])
    assert np.abs(found - correlation[pairs[:, 0], pairs[:, 1]]).max() < 6.0 / np.sqrt(4000)


def test_a_sample_does_not_depend_on_how_many_are_drawn(rows):
    _, correlation = correlation_matrix(rows)
    assert np.array_equal(draw(correlation, 5, seed=1), draw(correlation, 9, seed=1)[:5])
    assert not np.array_equal(draw(correlation, 5, seed=1), draw(correlation, 5, seed=2))


def test_bands_do_not_depend_on_the_number_of_workers(short_case, campaign, rows):
    one, two = (
        fly_samples(short_case[0], campaign.vehicle, rows, 6, seed=1, execution=Execution(workers=n)) for n in (1, 2)
    )
    for channel, values in one.channels.items():
        assert np.array_equal(values, two.channels[channel], equal_nan=True), channel


def test_without_errors_every_sample_is_the_single_run(short_case, campaign, rows):
    """By steps of four stages to the last digits, by those of two to what is stated of them."""
    single = simulate(short_case[0], Coefficients(campaign.vehicle, rows))
    batch = batch_of(short_case[0], campaign.vehicle, rows)
    exact = replace(batch, scheme=BEGUN).fly(rows["value"].to_numpy()[None])[0].records[""]
    bands = fly_samples(short_case[0], campaign.vehicle, rows.assign(stderr=0.0), 3)
    assert batch.scheme == MIDPOINT
    for channel in ("theta", "q", "u", "z"):
        assert exact[batch.channels.index(channel)] == pytest.approx(single[channel], rel=1e-12, abs=1e-12)
        apart = bands.channels[channel] - single[channel]
        assert 0.0 < np.sqrt(np.mean(apart**2)) < 1e-4 * np.ptp(single[channel])


def test_samples_take_four_stages_where_two_are_not_the_same_flight(short_case, campaign, rows):
    coarse = short_case[0].model_copy(
        update={"run": short_case[0].run.model_copy(update={"step_s": 1.0, "record_s": 1.0})}
    )
    assert batch_of(coarse, campaign.vehicle, rows).scheme == BEGUN


def test_a_drawn_boat_is_port_starboard_symmetric(campaign, rows):
    """Rows of one estimate move together: Y, K and N stay odd in beta."""
    estimates, correlation = correlation_matrix(rows)
    step = draw(correlation, 1, seed=5)[0]
    place = dict(zip(estimates["estimate"], range(len(estimates)), strict=True))
    base = Coefficients(campaign.vehicle, rows)
    from ident.validation.bands import _row_steps

    index, signed = _row_steps(rows, estimates)
    moved = rows["value"].to_numpy() + np.where(index >= 0, step[index] * signed, 0.0)
    assert len(place) == len(estimates)
    drawn = base.with_values(moved)
    for name in ("Y_uvw", "K_uvw", "N_uvw"):
        table = drawn.get(name)
        there, mirrored = (table.at([5.0, 0.0, side * 0.15, 10.0]) for side in (1.0, -1.0))
        assert there == pytest.approx(-mirrored, rel=1e-12)
        assert there != pytest.approx(base.get(name).at([5.0, 0.0, 0.15, 10.0]), rel=1e-6)


def test_variance_shares_name_the_only_uncertain_coefficient(short_case, campaign, rows):
    alone = rows.assign(stderr=rows["stderr"].where(rows["coefficient"] == "M_uq", 0.0))
    for seed in (0, 1, 2):
        bands = fly_samples(short_case[0], campaign.vehicle, alone, 60, seed=seed)
        first = variance_shares(bands, "theta")[0]
        assert first.coefficient == "M_uq"
        # Its values account for all there is, as nearly as so many samples tell.
        assert first.share > 1.0 - 5.0 * first.standard_error
        assert first.share > 5.0 * first.standard_error


def test_reference_made_of_the_middle_of_the_band_lies_inside(short_case, campaign, rows):
    case, where = short_case
    bands = fly_samples(case, campaign.vehicle, rows, 12)
    reference = load_reference(case, where)
    middle = np.degrees(np.median(bands.channels["theta"], axis=0))
    reference.data["CFD"]["theta"] = Record.read("theta", bands.time, Written(middle, "deg", None))
    reference.data["CFD"]["q"] = Record("q", bands.time, np.full(bands.time.size, 9.0), "rad/s")
    found = inside(bands, case, reference)["CFD"]
    assert found["theta"] == {"50": 1.0, "95": 1.0}
    assert found["q"] == {"50": 0.0, "95": 0.0}


def _assert_shares(found, expected):
    """Within five standard errors, which are what so many samples allow."""
    assert {s.coefficient for s in found} == set(expected)
    for one in found:
        assert abs(one.share - expected[one.coefficient]) < 5.0 * one.standard_error + 1e-3
        assert one.standard_error < 0.03


def test_shares_of_correlated_values_closed_form():
    """A has two values that move as one, B one of its own: y = 3 a + 4 b has shares 9/25 and 16/25."""
    samples, correlation = 4000, np.eye(3)
    correlation[0, 1] = correlation[1, 0] = 1.0
    drawn = draw(correlation, samples, seed=2)
    y = 1.5 * drawn[:, 0] + 1.5 * drawn[:, 1] + 4.0 * drawn[:, 2]
    channels = {"psi": y[:, None] * np.array([1.0, 2.0])}
    bands = Bands(np.arange(2.0), channels, {}, drawn, correlation, ["A", "A", "B"], 0, 2)
    _assert_shares(variance_shares(bands, "psi"), {"A": 9.0 / 25.0, "B": 16.0 / 25.0})


def test_share_of_correlated_coefficients_is_what_each_would_explain():
    """Two coefficients with correlation 0.6, y = a: A explains all, B 0.36 of it."""
    samples, correlation = 4000, np.array([[1.0, 0.6], [0.6, 1.0]])
    drawn = draw(correlation, samples, seed=6)
    bands = Bands(np.arange(1.0), {"psi": drawn[:, :1]}, {}, drawn, correlation, ["A", "B"], 0, 6)
    _assert_shares(variance_shares(bands, "psi"), {"A": 1.0, "B": 0.36})
