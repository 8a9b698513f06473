"""Every key of ``campaign.toml``: changing it changes the result, or is refused.

That every key has a case is held by tests/test_every_key_of_a_campaign_has_a_case.py.
"""

from __future__ import annotations

from dataclasses import replace

import pytest
from cases_of_campaign_keys import HEADER_CASES, INERTIA, PIVOT, TARE, YAW
from declared_campaigns import ROWS, campaign, differs, outcome, primes, set_at
from rewritten_campaigns import BB2

from ident.captive.campaign import read_campaign
from ident.captive.campaign_file import PureYaw
from ident.estimates.predict import predicted
from ident.fitting.fit import given_of
from sim.boat.vehicle import load_vehicle


@pytest.mark.parametrize("key", HEADER_CASES)
def test_every_key_of_a_campaign_counts(tmp_path, key):
    base, change, how = HEADER_CASES[key]
    files = {"drift.csv": how["files"]} if "files" in how else None
    after = campaign({**base})
    for path, value in change.items():
        after = set_at(after, path, value)
    differs(
        tmp_path, campaign(base), after, files, words=how.get("words", False), named=key, elsewhere=how.get("said", "")
    )


# Statements on loads, which published coefficients are none.
OF_LOADS = {
    "half_model": {"half_model": {"plane": "port_starboard", "source": "wall"}},
    "hydrostatics": {
        "hydrostatics": {"force_n": 9.0, "centre_m": [0.0, 0.0, 0.0], "attitude": "level", "source": "volume"}
    },
    "inertia": {**INERTIA, "inertia.source": "weighed"},
    "frame.axes": {"frame.axes": "flow"},
    "frame.moment_axes": {"frame.moment_axes": "body"},
    "motion_point": PIVOT,
    "tare": TARE,
}


@pytest.mark.parametrize("key", OF_LOADS)
def test_what_is_said_of_loads_is_refused_where_there_are_none(tmp_path, key):
    """A campaign of published coefficients alone: it would change nothing."""
    files = {"drift.csv": "run_id,coefficient,value,rel_sigma\na,Y_v,-0.03,0.1\nb,N_v,-0.013,0.1\n"}
    constants = {"test": "published_derivative", "part": "hull", "quality": "ok", "source": "report"}
    before = campaign({"vehicle": "suboff", "scale.length_m": 4.356}, constants=constants)
    assert "refused" not in outcome(tmp_path / "before", before, files)
    after = before
    for path, value in OF_LOADS[key].items():
        after = set_at(after, path, value)
    assert f"key {key}" in outcome(tmp_path / "after", after, files)["refused"]


def test_a_draught_counts_by_its_normalisation(tmp_path):
    before = campaign({"scale.draught_m": 9.6}, normalisation="half_rho_Ld")
    after = campaign({"scale.draught_m": 5.0}, normalisation="half_rho_Ld")
    differs(tmp_path, before, after, {"drift.csv": primes(ROWS)}, named="Scale.draught_m")


@pytest.mark.parametrize("key", ["taken_off", "sigma", ""])
def test_the_share_of_pure_yaw_counts_in_estimates(pitch_turned, key):
    """Pure yaw that is pure pitch turned: BB2's, with the share and its deviation stated otherwise, or not at all."""
    found, usual = pitch_turned
    other = found({**YAW["pure_yaw"], key: 0.3} if key else None)
    assert not usual.equals(other)


@pytest.fixture(scope="module")
def pitch_turned(rows):
    """The predicted values and errors of BB2 by a statement on pure yaw, and those by the usual one."""
    vehicle = load_vehicle("bb2")
    whole = read_campaign(BB2)

    def found(stated):
        header = whole.header.model_copy(update={"pure_yaw": PureYaw(**stated) if stated else None})
        made, _ = predicted(vehicle, rows, given_of(replace(whole, header=header)))
        return made[["coefficient", "value", "stderr"]].reset_index(drop=True)

    return found, found(YAW["pure_yaw"])
