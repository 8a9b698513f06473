"""Every key of ``campaign.toml``: changing it changes the result, or is refused.

The keys are taken from the schemas, so a new one without a case here fails.
"""

from __future__ import annotations

from typing import Any

import pytest
from declared_campaigns import DRIFT, ROWS, campaign, differs, keys, primes, set_at

from ident.captive import campaign_file

YAW = {"pure_yaw": {"taken_off": 0.5, "sigma": 0.5, "source": "made"}}
GRID = {"shared_error": [{"name": "grid", "relative": 0.1, "source": "made"}]}

INERTIA = {
    "inertia.model_inertia_in_loads": True,
    "inertia.mass_kg": 1e6,
    "inertia.centre_of_gravity_m": [1.0, 0.0, 0.5],
    "inertia.tensor_kgm2": [1e6, 1e8, 1e8],
}
TURN = ROWS.replace("rel_sigma,X", "r_radps,rel_sigma,X").replace(",25,0.05", ",25,0.01,0.05")
TURNING = {"source.0.constants": {**DRIFT["constants"], "test": "rotating_arm"}}
TARE = {"tare": [{"what": "strut", "source": "towed alone", "loads": {"X": "90 N"}}]}
SQUARE = {"tare": [{"what": "strut", "source": "towed alone", "per_speed_squared": {"X": 30.0}}]}
HALF = {"half_model": {"plane": "port_starboard", "source": "wall"}}
HYDRO = {
    "hydrostatics": {"force_n": 100.0, "centre_m": [1.0, 0.0, 0.0], "attitude": "level", "source": "volume"},
}
STRAIGHT = ROWS.splitlines()[0] + "\n" + ROWS.splitlines()[1] + "\n"
CLIMB = STRAIGHT.replace("beta_deg", "alpha_deg").replace("a,5,0,", "a,5,4,") + STRAIGHT.splitlines()[1].replace(
    "a,", "z,"
)
CLIMBING = {
    "source.0.constants": {"test": "drift_vertical", "part": "hull", "quality": "ok", "source": "s", "beta": "0 deg"}
}

# Schema and key -> campaign before, what is changed, files; ``words`` for what people read in the version.
HEADER_CASES: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any]]] = {
    "CampaignFile.name": ({}, {"name": "other"}, {"words": True}),
    "CampaignFile.vehicle": ({}, {"vehicle": "suboff"}, {}),
    "CampaignFile.facility": ({}, {"facility": "basin"}, {"words": True}),
    "CampaignFile.provenance": ({}, {"provenance": "other"}, {"words": True}),
    "CampaignFile.tare": ({}, TARE, {}),
    "CampaignFile.half_model": ({}, HALF, {"files": STRAIGHT}),
    "CampaignFile.hydrostatics": ({}, HYDRO, {}),
    "CampaignFile.pure_yaw": ({}, YAW, {"words": True}),
    "PureYaw.taken_off": (YAW, {**YAW, "pure_yaw.taken_off": 0.7}, {"words": True}),
    "PureYaw.sigma": (YAW, {**YAW, "pure_yaw.sigma": 0.3}, {"words": True}),
    "CampaignFile.shared_error": ({}, GRID, {}),
    "SharedError.relative": (GRID, {**GRID, "shared_error.0.relative": 0.2}, {}),
    "SharedError.loads": (GRID, {**GRID, "shared_error.0.loads": ["Y"]}, {}),
    "SharedError.tests": (GRID, {**GRID, "shared_error.0.tests": ["towing"]}, {}),
    "SharedError.parts": (GRID, {**GRID, "shared_error.0.parts": ["propeller"]}, {}),
    "CampaignFile.absent": ({}, {"absent": {"drift_horizontal.Y": "a balance of one component"}}, {}),
    "CampaignFile.complete_from": ({}, {"complete_from": "lines"}, {"words": True}),
    "CampaignFile.tables": ({}, {"tables.reference": "no.csv"}, {}),
    "CampaignFile.source": ({}, {"source.0.files": "none.csv"}, {}),
    "CampaignFrame.x": ({}, {"frame.x": "aft", "frame.z": "up"}, {}),
    "CampaignFrame.y": ({}, {"frame.y": "port", "frame.z": "up"}, {}),
    "CampaignFrame.z": ({}, {"frame.z": "up"}, {}),
    "CampaignFrame.angles": ({}, {"frame.angles": "ittc"}, {}),
    "CampaignFrame.axes": ({}, {"frame.axes": "flow"}, {}),
    "CampaignFrame.rotations": (
        {"frame.z": "up", "frame.rotations": "left-hand"},
        {"frame.rotations": "right-hand"},
        {},
    ),
    "MomentPoint.x_m": ({}, {"moment_point.x_m": 1.0}, {}),
    "MomentPoint.y_m": ({}, {"moment_point.y_m": 1.0}, {}),
    "MomentPoint.z_m": ({}, {"moment_point.z_m": 1.0}, {}),
    "MomentPoint.about": ({}, {"moment_point.about": "other"}, {"words": True}),
    "Scale.ratio": ({}, {"scale.ratio": 2.0}, {}),
    "Scale.length_m": ({}, {"scale.length_m": 60.0}, {}),
    "Fluid.density_kgpm3": ({}, {"fluid.density_kgpm3": 1000.0}, {}),
    "Fluid.source": ({}, {"fluid.source": "other"}, {"words": True}),
    "Inertia.model_inertia_in_loads": (TURNING, INERTIA, {"files": TURN}),
    "Inertia.mass_kg": ({**TURNING, **INERTIA}, {"inertia.mass_kg": 2e6}, {"files": TURN}),
    "Inertia.centre_of_gravity_m": (
        {**TURNING, **INERTIA},
        {"inertia.centre_of_gravity_m": [3.0, 0.0, 0.5]},
        {"files": TURN},
    ),
    "Inertia.tensor_kgm2": (
        {**TURNING, **INERTIA},
        {"inertia.tensor_kgm2": [1e6, 1e8, 1e8, 0.0, 1e8, 0.0]},
        {"files": TURN},
    ),
    "Inertia.parts": ({**TURNING, **INERTIA}, {"inertia.parts": ["propeller"]}, {"files": TURN}),
    "Inertia.source": ({**TURNING, **INERTIA}, {"inertia.source": "weighed"}, {"files": TURN, "words": True}),
    "Uncertainty.floor": ({}, {"uncertainty.floor": 0.9}, {}),
    "Uncertainty.source": ({}, {"uncertainty.source": "other"}, {"words": True}),
    "Quality.factor": ({}, {"quality.ok.factor": 3.0}, {}),
    "Quality.meaning": ({}, {"quality.ok.meaning": "other"}, {"words": True}),
    "Tare.what": (TARE, {"tare.0.what": "wire"}, {"words": True}),
    "Tare.source": (TARE, {"tare.0.source": "other"}, {"words": True}),
    "Tare.loads": (TARE, {"tare.0.loads": {"X": "9000 N"}}, {}),
    "Tare.per_speed_squared": (SQUARE, {"tare.0.per_speed_squared": {"X": 300.0}}, {}),
    "Tare.tests": (TARE, {"tare.0.tests": ["towing"]}, {}),
    "Tare.parts": (TARE, {"tare.0.parts": ["propeller"]}, {}),
    "HalfModel.plane": (HALF, {"half_model.plane": "upper_lower"}, {"files": STRAIGHT}),
    "HalfModel.source": (HALF, {"half_model.source": "other"}, {"files": STRAIGHT, "words": True}),
    "Hydrostatics.force_n": (HYDRO, {"hydrostatics.force_n": 9000.0}, {}),
    "Hydrostatics.centre_m": (HYDRO, {"hydrostatics.centre_m": [30.0, 0.0, 0.0]}, {}),
    "Hydrostatics.attitude": (
        {**CLIMBING, **HYDRO, "hydrostatics.force_n": 1e6},
        {"hydrostatics.attitude": "pitched"},
        {"files": CLIMB},
    ),
    "Hydrostatics.parts": (HYDRO, {"hydrostatics.parts": ["propeller"]}, {}),
    "Hydrostatics.source": (HYDRO, {"hydrostatics.source": "other"}, {"words": True}),
    "Tables.configurations": ({}, {"tables.configurations": "no.csv"}, {}),
    "Tables.reference": ({}, {"tables.reference": "no.csv"}, {}),
}
# Tables of their own, whose keys stand above; a draught and a normalisation count together below.
_NESTED = {"frame", "moment_point", "scale", "fluid", "inertia", "uncertainty", "quality"}


HEADER_KEYS = keys(
    campaign_file,
    (
        *("CampaignFile", "CampaignFrame", "MomentPoint", "Scale", "Fluid", "Inertia", "Uncertainty", "Quality"),
        *("Tare", "HalfModel", "Hydrostatics", "Tables"),
    ),
)


@pytest.mark.parametrize("key", HEADER_KEYS)
def test_every_key_of_a_campaign_counts(tmp_path, key):
    schema, _, name = key.partition(".")
    if schema == "CampaignFile" and name in _NESTED:
        assert any(k.startswith(f"{schema_of(name)}.") for k in HEADER_CASES)
        return
    if key == "Scale.draught_m":
        before = campaign({"scale.draught_m": 9.6}, normalisation="half_rho_Ld")
        files = {"drift.csv": primes(ROWS)}
        differs(tmp_path, before, campaign({"scale.draught_m": 5.0}, normalisation="half_rho_Ld"), files)
        return
    base, change, how = HEADER_CASES[key]
    files = {"drift.csv": how["files"]} if "files" in how else None
    after = campaign({**base})
    for path, value in change.items():
        after = set_at(after, path, value)
    differs(tmp_path, campaign(base), after, files, words=how.get("words", False))


def schema_of(name: str) -> str:
    return {"frame": "CampaignFrame", "moment_point": "MomentPoint"}.get(name, name.capitalize())
