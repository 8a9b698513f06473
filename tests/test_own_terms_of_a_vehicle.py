"""A vehicle's own terms are identified, stored and flown as those of the table: recovery of made coefficients."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from small_campaign import HEADER

import sim
from ident.captive.campaign import read_campaign
from ident.database.store import commit, database_rows
from ident.identification.identify import identify
from sim.boat import catalogue, own_terms
from sim.boat.coefficients import Coefficients
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError

LENGTH, RHO = 4.2609, 1000.0
TERMS = """name,output,power,multiplier,part,test,note
Y_v|r|v,Y,3,v*|r|,hull,rotating_arm,made
N_qd,N,4,U*r*deflection,rudders,rotating_arm,rate x plane
"""
OWN = TERMS.splitlines()[0] + "\nY_r|r|,Y,4,r*|r|,hull,rotating_arm,made\n"


def boat(folder: Path, terms: str = OWN) -> Path:
    text = (Path(sim.__file__).parent / "vehicles" / "suboff.toml").read_text("utf-8")
    text = text.replace('term_set = "gertler_hagen"', 'term_set = "gertler_hagen"\nterms = "own.csv"', 1)
    (folder / "mine.toml").write_text(text, "utf-8")
    (folder / "own.csv").write_text(terms, "utf-8")
    return folder / "mine.toml"


def arm(folder: Path, y_ur: float, y_rr: float) -> Path:
    boat(folder)
    head = HEADER.replace('vehicle = "bb2"', 'vehicle = "mine.toml"').replace("length_m = 70.2", f"length_m = {LENGTH}")
    head = head.replace("1025.0", str(RHO)).replace('x = "aft"', 'x = "forward"').replace('z = "up"', 'z = "down"')
    (folder / "campaign.toml").write_text(head, "utf-8")
    lines = ["run_id,test,part,U_mps,alpha_deg,beta_deg,r_radps,Y_N,rel_sigma,quality,source"]
    for r in (-0.3, -0.2, -0.1, 0.1, 0.2, 0.3):
        load = 0.5 * RHO * (LENGTH**3 * y_ur * 2.0 * r + LENGTH**4 * y_rr * r * abs(r))
        lines.append(f"r{r},rotating_arm,hull,2,0,0,{r},{load!r},0.02,as_published,made")
    (folder / "runs.csv").write_text("\n".join(lines) + "\n", "utf-8")
    return folder


def test_an_own_term_is_identified_and_read_back(tmp_path):
    found = identify(read_campaign(arm(tmp_path, 0.0052, -0.0031)))
    values = {n.name: v for n, v in zip(found.nodes, found.values, strict=True)}
    assert values["Y_r|r|"] == pytest.approx(-0.0031, rel=1e-9)
    assert values["Y_ur"] == pytest.approx(0.0052, rel=1e-9)
    rows = database_rows(found)
    commit(str(tmp_path / "db"), rows, {})
    read = Coefficients(load_vehicle(tmp_path / "mine.toml"), rows)
    (own,) = [c for c in read if c.term.name == "Y_r|r|"]
    assert float(np.ravel(own.values)[0]) == pytest.approx(-0.0031, rel=1e-9)
    assert math.isclose(own.term.scale(RHO, LENGTH, 1.0), 0.5 * RHO * LENGTH**4)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("Y_v,Y,2,u*v,hull,drift_horizontal,x", "a name the set gertler_hagen does not have"),
        ("Y_zz,Y,2,u*foo,hull,drift_horizontal,x", "factor 'foo'"),
        ("Y_zz,Q,2,u*v,hull,drift_horizontal,x", "output Q"),
        ("Y_zz,Y,two,u*v,hull,drift_horizontal,x", "power two"),
        ("Y_zz,Y,2,,hull,drift_horizontal,x", "column multiplier"),
        ("Y_zz,Y,2,u*v,fin,drift_horizontal,x", "column part"),
        ("Y_zz,Y,2,u*v,hull,drift_horizontal,x", "which is Y_v's"),
        ("Y_zz,Y,2,v*u,hull,drift_horizontal,x", "which is Y_v's"),
        ("Y_zz,Y,3,ur,hull,rotating_arm,x", "which is Y_ur's"),
        ("Y_zz,Y,4,r*|r|,hull,turning_arm,x", "column test: 'turning_arm'"),
        ("Y_zz,Y,3,r*deflection,hull,rotating_arm,x", "column part: 'hull'"),
        ("Y_zz,Y,4,r*r,hull,rotating_arm,x", "r*|r|"),
        ("Z_zz,Z,2,v*w,hull,drift_horizontal,x", "an even number"),
        ("Y_zz,Y,2,r*|r|,hull,rotating_arm,x", "column power: 2 (allowed: 4"),
        ("Y_zz,Y,2,v*v*v,hull,drift_horizontal,x", "v*v*v/U"),
    ],
)
def test_a_row_that_cannot_be_one_is_refused_with_its_place(tmp_path, row, words):
    vehicle = load_vehicle(boat(tmp_path, TERMS.splitlines()[0] + "\n" + row + "\n"))
    with pytest.raises(InputError) as caught:
        vehicle_terms(vehicle)
    assert words in str(caught.value)
    assert "own.csv" in str(caught.value)


@pytest.mark.parametrize(
    "row",
    [
        "Y_zz,Y,2,v*v*v/U,hull,drift_horizontal,x",
        "Y_zz,Y,4,r*|r|,hull,rotating_arm acceleration,x",
        "X_zz,X,4,u*u*r/U*r/U,hull,rotating_arm,x",
        "N_zz,N,4,U*r*deflection,rudders,rotating_arm,x",
    ],
)
def test_products_that_the_set_does_not_have_are_taken(tmp_path, row):
    """The dimensions of every row are those of the table: power 4 - lengths of a force, 5 - lengths of a moment."""
    assert vehicle_terms(load_vehicle(boat(tmp_path, TERMS.splitlines()[0] + "\n" + row + "\n")))


def test_every_row_of_the_table_has_the_dimensions_that_own_rows_need():
    """The rule of the module holds for the table that it is taken from."""
    for term in (t for name in catalogue.SETS for t in catalogue.terms(name) if t.output):
        own_terms._dimensions(term, term.name)


def test_a_file_with_semicolons_is_told_its_columns(tmp_path):
    vehicle = load_vehicle(boat(tmp_path, OWN.replace(",", ";")))
    with pytest.raises(InputError, match="with commas between"):
        vehicle_terms(vehicle)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    path = boat(tmp_path)
    (tmp_path / "own.csv").unlink()
    with pytest.raises(InputError, match=r"own\.csv"):
        vehicle_terms(load_vehicle(path))
