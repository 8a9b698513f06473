"""Authority: physics that every boat shares. One slip of a unit, a point or a size that was once accepted in silence is
a finding of the check named for it; the boats as they lie have none of them.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hmri import KVLCC2
from made_campaigns import campaign as made
from made_campaigns import history
from sample_of_mutations import STARTER, TABLES

from ident.captive.campaign import read_campaign
from ident.checks.check import evidence_of
from ident.checks.coefficients import constant_values
from ident.checks.findings import Evidence, registered, rules
from ident.checks.proportions import plane_areas
from sim.boat.vehicle import load_vehicle

KNOT = 1852.0 / 3600.0
POUND = 4.4482216152605
CHECKS = (
    *("added_lever", "added_mass", "area", "between_tests", "draught", "friction", "lift", "moment_point", "munk"),
    *("zero_reading", "open_water", "essential"),
)


@pytest.fixture(scope="module")
def starter(tmp_path_factory):
    """The starter's tables, in a folder to copy; their true boat is known, and nothing of the kind is found in them."""
    folder = tmp_path_factory.mktemp("starter") / "boat"
    shutil.copytree(STARTER, folder)
    shutil.rmtree(folder / "captive" / "histories")
    header = folder / "captive" / "campaign.toml"
    header.write_text(TABLES.match(header.read_text("utf-8"))[0], "utf-8")
    assert not seen(folder / "captive")
    return folder


def seen(folder: Path) -> set[str]:
    evidence = evidence_of(read_campaign(folder), folder)
    names = [n for n in CHECKS if n != "added_lever"]
    found = [f for n in names for one in registered()[n] for f in one(evidence, rules()[n])]
    return {f.check for f in found if f.severity != "info"}


def scaled(path: Path, column: str, factor: float = 1.0, more: float = 0.0) -> None:
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    table[column] = [repr(float(x) * factor + more) if x else x for x in table[column]]
    table.to_csv(path, index=False)


@pytest.mark.parametrize(
    ("name", "column", "factor", "more", "check"),
    [
        ("drift_horizontal", "U_mps", 1.0 / KNOT, 0.0, "between_tests"),
        ("drift_horizontal", "X_N", 1.0 / POUND, 0.0, "between_tests"),
        ("drift_horizontal", "Y_N", POUND, 0.0, "lift"),
        ("drift_vertical", "Z_N", POUND, 0.0, "lift"),
        ("acceleration_vdot", "Y_N", 1.0 / POUND, 0.0, "added_mass"),
        ("acceleration_wdot", "Z_N", 1.0 / POUND, 0.0, "added_mass"),
        ("towing", "X_N", 1.0, 8.0, "zero_reading"),
        ("drift_horizontal", "Y_N", 1.0, 15.0, "zero_reading"),
        ("drift_horizontal", "N_Nm", 1.0, 15.0, "zero_reading"),
    ],
)
def test_a_unit_or_a_zero_of_one_column_is_found(starter, tmp_path, name, column, factor, more, check):
    shutil.copytree(starter, tmp_path / "boat")
    scaled(tmp_path / "boat" / "captive" / f"{name}.csv", column, factor, more)
    assert check in seen(tmp_path / "boat" / "captive")


def test_a_value_typed_into_the_next_row_of_an_open_water_curve_is_found(starter, tmp_path):
    shutil.copytree(starter, tmp_path / "boat")
    path = tmp_path / "boat" / "captive" / "open_water.csv"
    text = path.read_text("utf-8")
    assert "0.6,0.21," in text
    path.write_text(text.replace("0.6,0.21,", "0.6,0.3,"), "utf-8")
    assert seen(tmp_path / "boat" / "captive") == {"open_water"}


def test_a_turn_without_the_moment_that_opposes_it_is_found(starter, tmp_path):
    shutil.copytree(starter, tmp_path / "boat")
    path = tmp_path / "boat" / "captive" / "arm_q.csv"
    pd.read_csv(path, dtype=str, keep_default_na=False).drop(columns="M_Nm").to_csv(path, index=False)
    assert seen(tmp_path / "boat" / "captive") == {"essential"}


@pytest.mark.parametrize("factor", [KNOT, 1.0 / KNOT])
def test_knots_for_metres_a_second_in_every_file_are_found_without_lines(starter, tmp_path, factor):
    shutil.copytree(starter, tmp_path / "boat")
    for path in (tmp_path / "boat" / "captive").glob("*.csv"):
        if "U_mps" in path.read_text("utf-8").split("\n")[0]:
            scaled(path, "U_mps", factor)
    assert seen(tmp_path / "boat" / "captive") & {"munk", "lift", "friction"}


@pytest.mark.parametrize(("share", "severity"), [(0.5, "error"), (-0.5, "error"), (0.2, "warning"), (0.0, None)])
def test_a_moment_point_off_by_a_part_of_the_length_is_found(campaign, identification, share, severity):
    """N = N + x Y about another point: N_vdot over Y_vdot is where the water is that is moved, whatever else acts."""
    values = constant_values(identification)
    of = values.set_index("coefficient")["value"]
    there = of["N_vdot"] + share * of["Y_vdot"]
    moved = values.assign(value=values["value"].mask(values["coefficient"] == "N_vdot", there))
    evidence = replace(evidence_of(campaign), constants=moved)
    (function,) = registered()["added_lever"]
    assert [f.severity for f in function(evidence, rules()["added_lever"])] == ([severity] if severity else [])


@pytest.mark.parametrize(("factor", "expected"), [(1.0, 0), (2.0, 1), (0.5, 1)])
def test_a_draught_of_twice_or_half_is_found_on_a_ship(factor, expected):
    assert KVLCC2.draught is not None
    evidence = Evidence(body=replace(KVLCC2, draught=factor * KVLCC2.draught), vehicle=load_vehicle("kvlcc2"))
    (function,) = registered()["draught"]
    assert len(list(function(evidence, rules()["draught"]))) == expected


# -- a plane's area --------------------------------------------------------------------------------


def test_the_area_of_a_rudder_is_that_of_its_vehicle(tmp_path):
    area = load_vehicle("kvlcc2-mmg").rudder.area.value
    columns = '[source.columns]\nCL = "Y [-]"\n[source.constants]\ntest = "plane_deflection"\npart = "rudder"\n'
    constants = 'quality = "ok"\nU = "1 m/s"\nalpha = "0 deg"\nbeta = "0 deg"\nD0 = "0 m"\nrel_sigma = 0.05\n'
    for factor, expected in ((1.0, 0), (2.0, 1), (0.5, 1)):
        folder = tmp_path / str(factor)
        source = f'[[source]]\nfiles = "rudder.csv"\nnormalisation = "half_rho_A"\n{columns}{constants}'
        source += f'[source.reference]\narea_m2 = {area * factor}\nsource = "drawing"\n'
        made(folder, source, scale="ratio = 1.0\nlength_m = 7.0")
        header = folder / "campaign.toml"
        header.write_text(header.read_text("utf-8").replace('"bb2"', '"kvlcc2-mmg"'), "utf-8")
        (folder / "rudder.csv").write_text("run_id,plane_deg,CL\na,-10,-0.4\nb,0,0.0\nc,10,0.4\n", "utf-8")
        evidence = evidence_of(read_campaign(folder))
        (function,) = registered()["area"]
        assert len(list(function(evidence, rules()["area"]))) == expected


def test_areas_of_bb2s_planes_are_those_of_its_offsets():
    """Sail planes: two of 2.9 m span; chords from 2.29 to 1.80 m (bb2/foils.csv)."""
    assert plane_areas(load_vehicle("bb2"))["sail_planes"] == pytest.approx(
        2 * 2.9079 * (2.2848 + 1.8031) / 2, rel=1e-3
    )


# -- a moment point that stays ------------------------------------------------------------------------


def heaving(folder: Path, stays: bool, drag_of_incidence: float, said: str = "") -> list[str]:
    """A body that heaves at 2 m/s: M = -Mw w - Mwdot wdot, about its own point or one that stays in the mesh."""
    omega, amplitude = 2.0 * np.pi * 0.25, 0.4
    time = np.arange(0.0, 80.0, 0.05)
    z, w, wdot = (amplitude * f for f in (np.sin(omega * time), omega * np.cos(omega * time),
                                          -(omega**2) * np.sin(omega * time)))  # fmt: skip
    noise = np.random.default_rng(5).standard_normal((3, time.size))
    x = -9000.0 - drag_of_incidence * w**2 + noise[0]
    m = 4.0e4 * w - 3.0e4 * wdot + noise[2] + (z * x if stays else 0.0)
    constants = '[source.constants]\npart = "hull"\nquality = "ok"\nU = "2 m/s"\nalpha = "0 deg"\nbeta = "0 deg"\n'
    reduction = '[source.reduction]\nkind = "oscillatory"\nmotion = "heave"\nfrequency_hz = 0.25\n'
    made(folder, history("heave.csv", said, constants + 'D0 = "25 m"\n', reduction))
    table = {"time_s": time, "X_N": x, "Z_N": -3.0e5 * wdot + noise[1], "M_Nm": m, "displacement_m": z}
    pd.DataFrame(table).to_csv(folder / "heave.csv", index=False)
    evidence = evidence_of(read_campaign(folder))
    functions = registered()["moment_point"]
    return [f.severity for function in functions for f in function(evidence, rules()["moment_point"])]


def test_a_moment_point_that_stays_shows_in_the_third_harmonic(tmp_path):
    assert heaving(tmp_path / "stays", True, 9000.0) == ["error"]
    assert heaving(tmp_path / "goes", False, 9000.0) == []
    # A resistance that does not change over the cycle tells nothing: asked for where it matters.
    assert heaving(tmp_path / "quiet", True, 0.0) in (["warning"], ["info"])
    assert heaving(tmp_path / "said", True, 9000.0, 'moments_about = "fixed"') == []
