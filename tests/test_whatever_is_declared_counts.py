"""Every key of every schema of captive input, and every column: changing it changes the result, or is refused.

The keys are taken from the schemas and the columns from the list of quantities, so a new one without
a case here fails.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from toml_text import toml

from ident.captive import campaign_file, source
from ident.captive.campaign import read_campaign
from ident.captive.quantities import table
from ident.captive.run_table import TEXT
from ident.checks.check import check_campaign
from ident.database.store import database_rows
from ident.estimates.predict import predicted
from ident.fitting.fit import given_of, metadata
from ident.identification.identify import identify
from sim.files.errors import InputError

HEAD: dict[str, Any] = {
    "name": "made",
    "vehicle": "bb2",
    "facility": "tank",
    "provenance": "made up",
    "frame": {"x": "forward", "y": "starboard", "z": "down", "angles": "flight"},
    "moment_point": {"x_m": 0.0, "y_m": 0.0, "z_m": 0.0, "about": "origin"},
    "scale": {"ratio": 1.0, "length_m": 70.2},
    "fluid": {"density_kgpm3": 1025.0, "source": "made up"},
    "inertia": {"model_inertia_in_loads": False},
    "uncertainty": {"floor": 0.1, "source": "made up"},
    "quality": {"ok": {"factor": 1.0, "meaning": "as measured"}, "poor": {"factor": 2.0, "meaning": "less"}},
}
DRIFT: dict[str, Any] = {
    "files": "drift.csv",
    "constants": {"test": "drift_horizontal", "part": "hull", "quality": "ok", "source": "s", "alpha": "0 deg"},
}
LOADS = "X_N,Y_N,Z_N,K_Nm,M_Nm,N_Nm"
ROWS = f"""run_id,U_mps,beta_deg,D0_m,rel_sigma,{LOADS}
a,5,0,25,0.05,-68000,0,-13000,0,-17000,0
b,5,4,25,0.05,-74000,-336000,-15000,-120000,-18000,-2260000
c,5,8,25,0.05,-40000,-629000,-30000,-240000,-19000,-4500000
"""
TIME = np.arange(0.0, 80.0, 0.1)
OMEGA = 2.0 * np.pi * 0.25


def sway(lag: float = 0.0, extra: str = "", start: float = 0.0) -> str:
    """A made sway history: Y of velocity and acceleration, a moment, a displacement on request."""
    time = TIME + start
    noise = np.random.default_rng(1).standard_normal((time.size, 3))
    late = time - lag
    y = -3e5 * np.cos(OMEGA * late) + 9e5 * np.sin(OMEGA * late)
    n = -2e6 * np.cos(OMEGA * late) + 1e5 * np.sin(OMEGA * late)
    table = pd.DataFrame({"time_s": time, "X_N": -4e4 + 10 * noise[:, 0], "Y_N": y + 10 * noise[:, 1]})
    table["N_Nm"] = n + 100 * noise[:, 2]
    if extra == "displacement":
        table["displacement_m"] = 0.3 * np.sin(OMEGA * time)
    return table.to_csv(index=False)


def made(folder: Path, head: dict[str, Any], files: dict[str, str]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "campaign.toml").write_text(toml(head), "utf-8")
    for name, text in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, "utf-8")
    return folder


def outcome(folder: Path, head: dict[str, Any], files: dict[str, str], estimated: bool = True) -> dict[str, Any]:
    """What a campaign leads to: coefficients with their errors, findings, what the version says; or a refusal."""
    made(folder, head, files)
    try:
        campaign = read_campaign(folder)
        found = identify(campaign)
        rows, estimates = database_rows(found), []
        if estimated:
            rows, estimates = predicted(campaign.vehicle, rows, given_of(campaign))
        findings = [f.as_json() for f in check_campaign(campaign, folder)]
    except InputError as error:
        return {"refused": str(error)}
    own = metadata(campaign, found, "", [], estimates)
    noted = [found.unused, found.warnings, found.covariance.round(15).tolist()]
    return {"rows": rows.round(12).to_csv(), "noted": noted, "findings": findings, "words": own}


def campaign(changed: dict[str, Any] | None = None, **source_keys: Any) -> dict[str, Any]:
    own = json.loads(json.dumps({**HEAD, "source": [{**DRIFT, **source_keys}]}))
    for path, value in (changed or {}).items():
        own = _set(own, path, value)
    return own


def differs(tmp_path, before, after, files=None, other=None, words=False) -> None:
    """The two campaigns lead to other coefficients or findings; of words, to another version's words."""
    files = files or {"drift.csv": ROWS}
    parts = ("words",) if words else ("rows", "noted", "findings")
    # Estimates take most of the time, and few keys change nothing but them.
    for estimated in (False, True):
        one = outcome(tmp_path / "one", before, files, estimated)
        two = outcome(tmp_path / "two", after, other or files, estimated)
        assert "refused" not in one, one
        if "refused" in two or any(one[k] != two[k] for k in parts):
            return
    raise AssertionError("declared, and nothing changed")


# -- the keys of campaign.toml --------------------------------------------------------------

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


def keys(module: Any, names: tuple[str, ...]) -> list[str]:
    return [f"{name}.{key}" for name in names for key in getattr(module, name).model_fields]


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
        after = _set(after, path, value)
    differs(tmp_path, campaign(base), after, files, words=how.get("words", False))


def schema_of(name: str) -> str:
    return {"frame": "CampaignFrame", "moment_point": "MomentPoint"}.get(name, name.capitalize())


def _set(own: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    at: Any = own
    value = json.loads(json.dumps(value))
    *parents, last = path.split(".")
    for key in parents:
        at = at[int(key)] if key.isdigit() else at.setdefault(key, {})
    at[last] = value
    return own


def primes(rows: str) -> str:
    return rows.replace(LOADS, "X',Y',Z',K',M',N'").replace("000", "")


# -- the keys of [[source]] -----------------------------------------------------------------

SWAY: dict[str, Any] = {
    "files": "sway.csv",
    "rows": "history",
    "constants": {"part": "hull", "quality": "ok", "U": "5 m/s", "alpha": "0 deg", "beta": "0 deg", "D0": "25 m"},
    "reduction": {"kind": "oscillatory", "motion": "sway", "frequency_hz": 0.25, "amplitude": 0.3},
}
STEADY = {**SWAY, "constants": {**SWAY["constants"], "test": "drift_horizontal", "beta": "4 deg"}}
STEADY["reduction"] = {"kind": "steady"}
GRIDS = {"finest": "fine", "coarser": ["mid", "low"], "refinement": 1.4}
RATES = {k: v for k, v in SWAY["reduction"].items() if k != "amplitude"}


def of(own: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {**HEAD, "source": [{**own, **more}]}


def reduced(own: dict[str, Any], **more: Any) -> dict[str, Any]:
    return of(own, reduction={**own["reduction"], **more})


SEMI = ROWS.replace(",", ";")
PART = ROWS.replace(LOADS, LOADS + ",RX [N],RY [N]").replace("\na", "\na").replace("-17000,0\n", "-17000,0,5,50\n")
PART = PART.replace("-2260000\n", "-2260000,6,60\n").replace("-4500000\n", "-4500000,7,70\n")
TAKEN = {"what": "rudder", "source": "stock", "columns": {"RX": "X", "RY": "Y"}, "at_m": [-30.0, 0.0, 0.0]}
SOURCE_CASES: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any]]] = {
    "Source.files": (of(DRIFT), of(DRIFT, files="none.csv"), {}),
    "Source.reader": (of(DRIFT), of(DRIFT, reader="columns"), {}),
    "Source.rows": (of(DRIFT), of(DRIFT, rows="history"), {}),
    "Source.columns": (of(DRIFT), of(DRIFT, columns={"X_N": "Y [N]"}), {}),
    "Source.patterns": (of(DRIFT), of(DRIFT, patterns={"^X": "X"}), {}),
    "Source.ignore": (of(DRIFT), of(DRIFT, ignore=["X*"]), {}),
    "Source.table": (of(DRIFT), of(DRIFT, table="drift"), {}),
    "Source.names": (of(DRIFT), of(DRIFT, names=["a", "b"]), {}),
    "Source.header_pattern": (of(DRIFT), of(DRIFT, header_pattern="^a", delimiter=","), {}),
    "Source.widths": (of(DRIFT), of(DRIFT, widths=[3, 3]), {}),
    "Source.units_row": (of(DRIFT), of(DRIFT, units_row=True), {}),
    "Source.delimiter": (of(DRIFT), of(DRIFT, delimiter=";"), {}),
    "Source.decimal": (of(DRIFT), of(DRIFT, decimal=","), {}),
    "Source.thousands": (of(DRIFT), of(DRIFT, thousands="."), {}),
    "Source.encoding": (of(DRIFT), of(DRIFT, encoding="utf-16-le"), {}),
    "Source.skip": (of(DRIFT), of(DRIFT, skip="^b"), {}),
    "Source.constants": (of(DRIFT), of(DRIFT, constants={**DRIFT["constants"], "quality": "poor"}), {}),
    "Source.within": (of(DRIFT), of(DRIFT, within={"beta_deg": [-5.0, 5.0]}), {}),
    "Source.match": (of(DRIFT), of(DRIFT, match="(?P<reason>x)"), {}),
    "Source.normalisation": (of(DRIFT), of(DRIFT, normalisation="half_rho_L2"), {}),
    "Source.parts": (of(DRIFT), of(DRIFT, parts={"a": "hull"}), {}),
    "Source.rho_inf": (of(DRIFT), of(DRIFT, rho_inf=1.0), {}),
    "Source.vehicle_origin": (of(DRIFT), of(DRIFT, vehicle_origin=[1.0, 0.0, 0.0]), {}),
    "Source.cofr": (of(DRIFT), of(DRIFT, cofr=[1.0, 0.0, 0.0]), {}),
    "Source.axes": (of(DRIFT), of(DRIFT, axes="flow"), {}),
    "Source.moments_about": (of(SWAY), of(SWAY, moments_about="fixed"), {"files": {"sway.csv": sway()}}),
    "Source.factor": (of(DRIFT), of(DRIFT, factor={"Y": -1.0}), {}),
    "Source.missing": (of(DRIFT), of(DRIFT, missing=[-629000.0]), {}),
    "Source.words": (of(DRIFT), of(DRIFT, words={"rudder": "towing"}), {}),
    "Source.plus_minus": (
        of(DRIFT),
        of(DRIFT, plus_minus=1.96),
        {"files": {"drift.csv": ROWS.replace("-336000,", "-336000 \u00b1 5000,")}},
    ),
    "Source.marks": (
        of(DRIFT),
        of(DRIFT, marks={"*": "poor"}),
        {"files": {"drift.csv": ROWS.replace("-336000,", "-336000*,")}},
    ),
    "Source.reference": (of(DRIFT), of(DRIFT, reference={"area_m2": 1.0, "source": "x"}), {}),
    "Source.reduction": (of(DRIFT), of(DRIFT, reduction={"kind": "steady"}), {}),
    "Source.subtract": (of(DRIFT, ignore=["R*"]), of(DRIFT, subtract=[TAKEN]), {"files": {"drift.csv": PART}}),
    "Subtract.what": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "what": "skeg"}]),
        {"files": {"drift.csv": PART}, "words": True},
    ),
    "Subtract.source": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "source": "other"}]),
        {"files": {"drift.csv": PART}, "words": True},
    ),
    "Subtract.columns": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "columns": {"RX": "Y", "RY": "X"}}]),
        {"files": {"drift.csv": PART}},
    ),
    "Subtract.at_m": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "at_m": [-10.0, 0.0, 0.0]}]),
        {"files": {"drift.csv": PART}},
    ),
    "Subtract.factor": (
        of(DRIFT, subtract=[TAKEN]),
        of(DRIFT, subtract=[{**TAKEN, "factor": 20.0}]),
        {"files": {"drift.csv": PART}},
    ),
    "Source.grids": (
        of({**STEADY, "files": "fine/sway.csv"}),
        of(
            {**STEADY, "files": "fine/sway.csv"}, grids={"finest": "fine", "coarser": ["mid", "low"], "refinement": 1.4}
        ),
        {"files": {f"{grid}/sway.csv": sway(lag) for grid, lag in (("fine", 0.0), ("mid", 0.05), ("low", 0.15))}},
    ),
    "Source.deduction": (
        of(STEADY),
        of(STEADY, deduction={"towed": "towed.csv", "thrust_n": 5e4, "source": "disc"}),
        {"files": {"sway.csv": sway(), "towed.csv": sway(0.1)}},
    ),
    # A file that is to come is waited for; without the key it is refused.
    "Source.awaited": (
        {**HEAD, "source": [DRIFT, {**DRIFT, "files": "late.csv", "awaited": True}]},
        {**HEAD, "source": [DRIFT, {**DRIFT, "files": "late.csv"}]},
        {},
    ),
    "Reduction.kind": (of(STEADY), reduced(STEADY, kind="acceleration"), {"files": {"sway.csv": sway()}}),
    "Reduction.start_s": (of(SWAY), reduced(SWAY, start_s=40.0), {"files": {"sway.csv": sway()}}),
    "Reduction.end_s": (of(SWAY), reduced(SWAY, end_s=50.0), {"files": {"sway.csv": sway()}}),
    "Reduction.rate_hz": (of(SWAY), reduced(SWAY, rate_hz=11.0), {"files": {"sway.csv": sway()}}),
    "Reduction.motion": (of(SWAY), reduced(SWAY, motion="heave"), {"files": {"sway.csv": sway()}}),
    "Reduction.frequency_hz": (of(SWAY), reduced(SWAY, frequency_hz=0.2), {"files": {"sway.csv": sway()}}),
    "Reduction.amplitude": (of(SWAY), reduced(SWAY, amplitude=0.4), {"files": {"sway.csv": sway()}}),
    "Reduction.phase_deg": (of(SWAY), reduced(SWAY, phase_deg=30.0), {"files": {"sway.csv": sway()}}),
    "Reduction.delay_s": (of(SWAY), reduced(SWAY, delay_s={"Y": 0.05}), {"files": {"sway.csv": sway()}}),
}
PRIMED = {"drift.csv": primes(ROWS)}
REFERENCE = {"area_m2": 40.0, "length_m": 4.0, "source": "setup"}
SOURCE_CASES |= {
    f"Reference.{k}": (
        of(DRIFT, normalisation="half_rho_A", reference=REFERENCE),
        of(DRIFT, normalisation="half_rho_A", reference={**REFERENCE, k: v}),
        {"files": PRIMED, "words": k == "source"},
    )
    for k, v in {"area_m2": 80.0, "length_m": 8.0, "source": "other"}.items()
}
SOURCE_KEYS = keys(source, ("Source", "Reduction", "Reference", "Subtract"))


@pytest.mark.parametrize("key", SOURCE_KEYS)
def test_every_key_of_a_source_counts(tmp_path, key):
    before, after, how = SOURCE_CASES[key]
    differs(tmp_path, before, after, how.get("files"), words=how.get("words", False))


# -- the columns ----------------------------------------------------------------------------

OPEN = "run_id,J,KT,KQ,rel_sigma\na,0,0.47,0.06,0.02\nb,0.5,0.28,0.04,0.02\nc,0.9,0.1,0.02,0.02\n"
PROPELLER = {
    "files": "drift.csv",
    "constants": {"test": "open_water", "part": "propeller", "quality": "ok", "source": "s"},
}
PUBLISHED = "run_id,coefficient,value,rel_sigma\na,Y_v,-0.02,0.05\n"
PRINTED = {
    "files": "drift.csv",
    "constants": {"test": "published_derivative", "part": "hull", "quality": "ok", "source": "s"},
}
SELF = "run_id,U_mps,D0_m,n_rps,t,rel_sigma\na,5,25,0.8,0.15,0.01\n"
POINT = {"files": "drift.csv", "constants": {**PROPELLER["constants"], "test": "self_propulsion"}}
# Quantity -> the campaign and file that may hold it, and the header vehicle.
COLUMN_CASES: dict[str, tuple[dict[str, Any], str, dict[str, Any]]] = {
    **dict.fromkeys(("J", "KT", "KQ"), (PROPELLER, OPEN, {})),
    "value": (PRINTED, PUBLISHED, {"vehicle": "suboff", "scale": {"ratio": 1.0, "length_m": 4.2609}}),
    **dict.fromkeys(("t",), (POINT, SELF, {})),
}


def changed(text: str, header: str, value: str) -> str:
    """The second data row with another value in a column, which is added where there is none."""
    lines = [line.split(",") for line in text.strip().splitlines()]
    if header not in lines[0]:
        lines = [[*lines[0], header]] + [[*line, "0" if i else value] for i, line in enumerate(lines[1:])]
        return "\n".join(",".join(line) for line in lines) + "\n"
    lines[min(2, len(lines) - 1)][lines[0].index(header)] = value
    return "\n".join(",".join(line) for line in lines) + "\n"


@pytest.mark.parametrize("quantity", list(dict.fromkeys(table()["quantity"])))
def test_every_quantity_a_column_may_hold_counts(tmp_path, quantity):
    own, text, head = COLUMN_CASES.get(quantity, (DRIFT, ROWS, {}))
    unit = str(table().loc[table()["quantity"] == quantity, "unit"].iloc[0])
    header = f"{quantity}_{unit}" if unit else quantity
    value = {"U": "6", "rel_sigma": "0.2", "t": "0.3", "n": "3", "J": "0.6"}.get(quantity, "0.5")
    other = changed(text, header, value)
    assert other != text
    differs(tmp_path, {**HEAD, **head, "source": [own]}, {**HEAD, **head, "source": [own]}, {"drift.csv": text},
            {"drift.csv": other})  # fmt: skip


TEXTS = {
    "run_id": "other",
    "test": "towing",
    "part": "propeller",
    "quality": "poor",
    "source": "book",
    "copy_of": "a",
    "exclude": "Y",
    "reason": "spoiled",
    "decoupled": "True",
    "coefficient": "Y_v",
    "unit": "kg/m",
}


@pytest.mark.parametrize("column", TEXT)
def test_every_text_column_counts(tmp_path, column):
    lines = [line.split(",") for line in ROWS.strip().splitlines()]
    constants = {k: v for k, v in DRIFT["constants"].items() if k != column}
    usual = DRIFT["constants"].get(column, "")

    def rows(value: str) -> str:
        at = lines[0].index(column) if column in lines[0] else -1
        out = []
        for i, line in enumerate(lines):
            cell = column if i == 0 else value if i == 2 else usual
            out.append(
                [*line[:at], cell, *line[at + 1 :]] if at == 0 and i in (0, 2) else line if at == 0 else [*line, cell]
            )
        return "\n".join(",".join(line) for line in out) + "\n"

    more: dict[str, Any] = {}
    if column == "reason":
        constants["exclude"] = "Y"
    if column == "decoupled":
        constants |= {"test": "rotating_arm"}
    own = {**HEAD, "source": [{**DRIFT, "constants": constants, **more}]}
    before = {"drift.csv": rows("b" if column == "run_id" else usual)}
    after = {"drift.csv": rows(TEXTS[column])}
    if column == "decoupled":
        extra = {"files": "arm.csv", "constants": DRIFT["constants"]}
        own = {**HEAD, "source": [own["source"][0], extra]}
        arm = {"arm.csv": ROWS.replace("\na,", "\nd,").replace("\nb,", "\ne,").replace("\nc,", "\nf,")}
        turn = {
            k: v.replace("rel_sigma,X", "r_radps,rel_sigma,X").replace(",25,0.05", ",25,0.01,0.05")
            for k, v in before.items()
        }
        turned = {
            k: v.replace("rel_sigma,X", "r_radps,rel_sigma,X").replace(",25,0.05", ",25,0.01,0.05")
            for k, v in after.items()
        }
        before, after = {**arm, **turn}, {**arm, **turned}
    differs(tmp_path, own, own, before, after, words=column == "source")


def test_what_is_declared_and_unused_names_file_key_and_reason(tmp_path):
    for own, words in (
        (of(DRIFT, normalisation="half_rho_L2"), ("campaign.toml", "source.normalisation", "nothing is made")),
        (of(DRIFT, ignore=["Cd"]), ("campaign.toml", "source.ignore", "no column of the files fits it")),
        (of(DRIFT, factor={"Q": 2.0}), ("campaign.toml", "source.factor", "has this name")),
        (of(DRIFT, words={"a b": "towing"}), ("campaign.toml", "source.words", "no text column")),
        (of(DRIFT, rho_inf=1.0), ("campaign.toml", "source.rho_inf", "does not look at it")),
    ):
        found = outcome(tmp_path, own, {"drift.csv": ROWS})
        assert all(w in found["refused"] for w in words), found
