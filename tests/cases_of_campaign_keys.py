"""A case for every key of ``campaign.toml``: what is changed, and what that is to change."""

from __future__ import annotations

from typing import Any

from declared_campaigns import DRIFT, ROWS

YAW = {"pure_yaw": {"taken_off": 0.5, "sigma": 0.5, "source": "made"}}
GRID = {"shared_error": [{"name": "grid", "relative": 0.1, "source": "made"}]}
PRINTS = {"shared_error": [{"name": "prints", "tests": ["drift_horizontal"], "offset": {"Y": 1e-4}, "source": "made"}]}

INERTIA = {
    "inertia.model_inertia_in_loads": True,
    "inertia.mass_kg": 1e6,
    "inertia.centre_of_gravity_m": [1.0, 0.0, 0.5],
    "inertia.tensor_kgm2": [1e6, 1e8, 1e8],
}
TURN = ROWS.replace("rel_sigma,X", "r_radps,rel_sigma,X").replace(",25,0.05", ",25,0.01,0.05")
TURNING = {"source.0.constants": {**DRIFT["constants"], "test": "rotating_arm"}}
PIVOT = {"motion_point": {"x_m": 1.0, "y_m": 0.5, "z_m": 0.5, "about": "pivot"}}
PIVOTED = {**TURNING, **PIVOT}
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
    "PureYaw.source": (YAW, {**YAW, "pure_yaw.source": "other"}, {"words": True}),
    "CampaignFile.shared_error": ({}, GRID, {}),
    "SharedError.name": (GRID, {**GRID, "shared_error.0.name": "balance"}, {"words": True}),
    "SharedError.source": (GRID, {**GRID, "shared_error.0.source": "other"}, {"words": True}),
    "SharedError.relative": (GRID, {**GRID, "shared_error.0.relative": 0.2}, {}),
    "SharedError.offset": (PRINTS, {**PRINTS, "shared_error.0.offset": {"Y": 2e-4}}, {}),
    "SharedError.loads": (GRID, {**GRID, "shared_error.0.loads": ["Y"]}, {}),
    "SharedError.tests": (GRID, {**GRID, "shared_error.0.tests": ["towing"]}, {"said": "no run of towing"}),
    "SharedError.parts": (GRID, {**GRID, "shared_error.0.parts": ["propeller"]}, {"said": "no run of propeller"}),
    "CampaignFile.absent": ({}, {"absent": {"drift_horizontal.Y": "a balance of one component"}}, {}),
    "CampaignFile.complete_from": ({}, {"complete_from": "lines"}, {"words": True}),
    "CampaignFile.tables": ({}, {"tables.reference": "no.csv"}, {}),
    "CampaignFile.source": ({}, {"source.0.files": "none.csv"}, {}),
    "CampaignFrame.x": ({}, {"frame.x": "aft", "frame.z": "up"}, {}),
    "CampaignFrame.y": ({}, {"frame.y": "port", "frame.z": "up"}, {}),
    "CampaignFrame.z": ({}, {"frame.z": "up"}, {}),
    "CampaignFrame.angles": ({}, {"frame.angles": "ittc"}, {}),
    "CampaignFrame.axes": ({}, {"frame.axes": "flow"}, {}),
    "CampaignFrame.moment_axes": ({"frame.axes": "flow"}, {"frame.moment_axes": "body"}, {}),
    "CampaignFrame.rotations": (
        {"frame.z": "up", "frame.rotations": "left-hand"},
        {"frame.rotations": "right-hand"},
        {},
    ),
    "MomentPoint.x_m": ({}, {"moment_point.x_m": 1.0}, {}),
    "MomentPoint.y_m": ({}, {"moment_point.y_m": 1.0}, {}),
    "MomentPoint.z_m": ({}, {"moment_point.z_m": 1.0}, {}),
    "MomentPoint.about": ({}, {"moment_point.about": "other"}, {"words": True}),
    "CampaignFile.motion_point": (TURNING, PIVOT, {"files": TURN}),
    "MotionPoint.x_m": (PIVOTED, {"motion_point.x_m": 3.0}, {"files": TURN}),
    "MotionPoint.y_m": (PIVOTED, {"motion_point.y_m": 9.0}, {"files": TURN}),
    "MotionPoint.z_m": (PIVOTED, {"motion_point.z_m": 3.0}, {"files": TURN.replace("r_radps", "q_radps")}),
    "MotionPoint.about": (PIVOTED, {"motion_point.about": "other"}, {"files": TURN, "words": True}),
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
# Keys with a test of their own below: a draught counts by the normalisation that needs it, and the share of pure yaw
# where a boat's yaw is estimated from its pitch.
APART = {"Scale.draught_m", "PureYaw.taken_off", "PureYaw.sigma", "CampaignFile.pure_yaw"}
