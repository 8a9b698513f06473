"""Loads of a flight by part and by term: they add up, and balance the inertia."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

from ident.cli import main
from ident.database.store import commit
from ident.validation.boats import Boat
from ident.validation.loads import ADDED_MASS, INERTIA, WEIGHT, loads_by_part
from sim.boat.coefficients import Coefficients
from sim.flight.case import Case, load_case
from sim.flight.simulate import fly

LOADS = ["X_N", "Y_N", "Z_N", "K_Nm", "M_Nm", "N_Nm"]


@pytest.fixture(scope="module")
def flown(campaign, rows):
    case, _ = load_case("hzz20")
    boat = Boat(campaign.vehicle, rows, None, Coefficients(campaign.vehicle, rows))
    return case, boat, fly(case, campaign.vehicle, boat.model(case), None)


def test_terms_of_a_part_add_up_to_it(flown):
    case, boat, flight = flown
    parts, terms = loads_by_part(case, boat, flight), loads_by_part(case, boat, flight, "coefficient")
    own = boat.rows.loc[boat.rows["part"] == "stern_plane_1", "coefficient"].unique()
    plane = parts[parts["source"] == "stern_plane_1"][LOADS].to_numpy()
    added = terms[terms["source"].isin(own)].groupby("t_s")[LOADS].sum().to_numpy()
    np.testing.assert_allclose(added, plane, rtol=1e-9, atol=1e-6 * np.abs(plane).max())
    assert {WEIGHT, ADDED_MASS, INERTIA} <= set(terms["source"])
    with pytest.raises(ValueError, match="part or coefficient"):
        loads_by_part(case, boat, flight, "plane")


def test_every_source_adds_up_to_nothing(flown):
    """Newton's second law: hydrodynamic loads, weight and inertia balance at every time of a flight in calm water."""
    case, boat, flight = flown
    table = loads_by_part(case, boat, flight)
    left = table.groupby("t_s")[LOADS].sum()
    largest = table.groupby("source")[LOADS].agg(lambda x: np.abs(x).max()).max()
    # Accelerations are differences of the record, so samples beside a reversal of the rudder are not held.
    share = (left.abs() / largest).quantile(0.9)
    assert (share < 0.01).all(), share


def test_they_balance_over_layers_and_in_a_pressed_hull(flown):
    """What is left of the sum of all sources, against the largest of them."""
    case, boat, _ = flown
    data = case.model_dump(exclude_none=True)
    layers = [{"depth_m": 20.0, "density_kgpm3": 960.0}, {"depth_m": 60.0, "density_kgpm3": 1010.0}]
    data["environment"] |= {"layer": layers, "hull_compressibility_perm": 1e-4}
    data["initial"] |= {"state": "as_given", "upright": False}
    data["run"]["duration_s"] = 15.0
    case = Case.model_validate(data)
    table = loads_by_part(case, boat, fly(case, boat.vehicle, boat.model(case), None))
    total = table.groupby("t_s")[LOADS].sum().to_numpy()[5:-5]
    largest = table[LOADS].abs().max().to_numpy()
    assert (np.abs(total).max(axis=0) < 0.02 * largest).all()


def test_a_boat_with_tanks_in_use_is_refused_before_anything_is_written(tmp_path, campaign, rows):
    commit(str(tmp_path / "db"), rows, {})
    asked = ["validate", "--case", "turn20-4m", "--loads", "part", "--history", "csv", "--db", str(tmp_path / "db")]
    done = CliRunner().invoke(main, [*asked, "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "ballast and trim tank" in done.output
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())
