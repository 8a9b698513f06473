"""Authority: proportions that physics leaves to a boat. One load of one test in another unit, a published cross term
of the other sign, a propeller that gives more than an actuator disk, rows that lost what they exclude: each is named.

The bundled campaigns and the starter have none of it; the limits have their sources in the tables of ``ident/data``.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_copies import copied

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign, evidence_of
from ident.checks.findings import rules
from ident.checks.possible import point_beside_the_body
from ident.checks.propeller import ideal_efficiency
from ident.checks.ratios import Proportion, beyond, evaluated, proportions
from sim.boat.catalogue import SETS, terms
from sim.files.errors import InputError

ROOT = Path(__file__).parents[1]
CHECKS = ("proportion", "side_force", "rows", "open_water", "coefficient", "essential")


@pytest.fixture
def place(tmp_path):
    """Copies a campaign, by name."""
    return partial(copied, tmp_path)


def found(folder: Path) -> list[tuple[str, str, str]]:
    findings = check_campaign(read_campaign(folder), folder)
    return [(f.check, f.severity, f.what) for f in findings if f.check in CHECKS and f.severity != "info"]


@pytest.mark.parametrize(
    "boat",
    ["starter", "bb2", "suboff", "kvlcc2", "kvlcc2-mmg", "kvlcc2-ship", "remus100", "remus100-x", "lauv", "nps-auv2"],
)
def test_boats_as_they_are_have_none(place, boat):
    assert found(place(boat)) == []


def times(column: str, by: float, rows: slice = slice(None)):
    def change(table: pd.DataFrame) -> None:
        values = table.loc[table.index[rows], column]
        table.loc[table.index[rows], column] = [f"{by * float(x):.7g}" if x else x for x in values]

    return change


def value(name: str, by: float):
    def change(table: pd.DataFrame) -> None:
        is_it = table["coefficient"] == name
        assert is_it.any()
        table.loc[is_it, "value"] = [f"{by * float(x):.7g}" for x in table.loc[is_it, "value"]]

    return change


def renamed(old: str, new: str):
    def change(table: pd.DataFrame) -> None:
        assert old in table
        table.columns = [new if c == old else c for c in table.columns]

    return change


def emptied(column: str):
    def change(table: pd.DataFrame) -> None:
        table[column] = ""

    return change


def put(column: str, row: int, text: str):
    def change(table: pd.DataFrame) -> None:
        table.loc[table.index[row], column] = text

    return change


def sorted_alone(column: str):
    """Rows in no order, as of a sheet by run number, and one column in order all the same."""

    def change(table: pd.DataFrame) -> None:
        table[:] = table.sample(frac=1.0, random_state=3).to_numpy()
        table[column] = sorted(table[column], key=float)

    return change


def shifted(column: str):
    """A column that begins a row later, without a value in its last row's place."""

    def change(table: pd.DataFrame) -> None:
        table[column] = [*table[column][1:], "-0.08"]

    return change


SHIP = "propeller_and_rudder.csv"
SLIPS = {
    "roll damping in N mm": ("starter", "arm_p.csv", times("K_Nm", 1e3), "proportion", "error", "K_up"),
    "ten times the force by pitch": ("starter", "arm_q.csv", times("Z_N", 10.0), "proportion", "warning", "Z_uq"),
    "pounds in one load of a turn": ("starter", "arm_r.csv", times("N_Nm", 1 / 14.5), "proportion", "warning", "N_ur"),
    "kilograms in the moment of a table": (
        "bb2", "rotating_arm.csv", times("N_Nm", 1 / 9.80665), "proportion", "warning", "N_ur"),
    "foot-pounds in one load of a turn": (
        "starter", "arm_r.csv", times("N_Nm", 1 / 4.448), "proportion", "warning", "Y_ur"),
    "pounds in the moment by pitch": (
        "starter", "arm_q.csv", times("M_Nm", 1 / 4.448), "proportion", "error", "Z_uq"),
    "a torque rounded to nothing": ("starter", "open_water.csv", times("KQ", 0.0), "open_water", "error", "KQ = 0"),
    "degrees in a term of a turn": ("nps-auv2", "published.csv", value("X_rr", 57.3), "proportion", "error", "X_rr"),
    "roll inertia": ("starter", "acceleration_pdot.csv", times("K_Nm", 0.01), "proportion", "error", "K_pdot"),
    "a cross term turned": ("remus100", "published.csv", value("M_uwa", -1.0), "proportion", "error", "M_uwa"),
    "one of a table's sign": ("nps-auv2", "published.csv", value("X_vr", -1.0), "proportion", "error", "X_vr"),
    "another row's value": ("remus100", "published.csv", value("M_vp", 48.7), "proportion", "error", "M_vp"),
    "a lever of the other end": ("remus100", "published.csv", value("Z_uqf", -1.0), "proportion", "error", "Z_uqf"),
    "thrust over rpm": ("remus100", "published.csv", value("X_nn", 100.0), "proportion", "error", "X_nn"),
    "a rudder in degrees": ("kvlcc2", SHIP, value("f_alpha", 0.25), "proportion", "warning", "f_alpha"),
    "a polynomial's sign": ("kvlcc2", SHIP, value("k_2", -1.0), "open_water", "error", "no end"),
    "one J astern": ("starter", "open_water.csv", put("J", 1, "-0.2"), "open_water", "warning", "its sign"),
    "knots": ("starter", "stern_planes.csv", renamed("U_mps", "U_kts"), "proportion", "warning", "Z_deltas"),
    "a column sorted alone": ("starter", "arm_r.csv", sorted_alone("X_N"), "rows", "warning", "sorted by itself"),
    "pounds for a moment": ("suboff", "published.csv", value("N_v", 4.448), "proportion", "warning", "N_v"),
    "an estimate's sign": ("suboff", "estimates.csv", value("N_r|r|", -1.0), "proportion", "warning", "N_r|r|"),
    "a share of a tenth": ("kvlcc2", SHIP, value("gamma_R+", 0.1), "proportion", "warning", "gamma_R+"),
    "degrees for a rate": ("bb2", "estimates.csv", renamed("p_radps", "p_degps"), "proportion", "error", "K_up"),
    "a thrust deduction of the other sign": (
        "bb2", "self_propulsion.csv", times("t", -1.0, slice(3)), "coefficient", "error", "t (propeller)"),
    "revolutions lost": ("bb2", "self_propulsion.csv", emptied("n_rps"), "essential", "warning", "w_T"),
    "degrees for radians at the propeller": (
        "bb2", "propeller_side_force.csv", renamed("q_radps", "q_degps"), "side_force", "error", "Z of the propeller"),
    "a torque of half": ("starter", "open_water.csv", times("KQ", 0.514444), "open_water", "error", "actuator disk"),
    "a torque of twice": ("starter", "open_water.csv", times("KQ", 1.943844), "open_water", "warning", "actuator disk"),
    "thrust a row too low": ("starter", "open_water.csv", shifted("KT"), "open_water", "warning", ""),
    "advance in knots": ("starter", "open_water.csv", times("J", 1.943844), "open_water", "error", "actuator disk"),
    "advance of half": ("starter", "open_water.csv", times("J", 0.5), "open_water", "warning", "over a unit of J"),
    "no exclude": ("suboff", "stand_in_propeller.csv", emptied("exclude"), "rows", "warning", "exclude nothing"),
    "another part": ("starter", "drift_vertical.csv", put("part", 3, "rudders"), "rows", "warning", "rudders"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_in_one_load_is_named(place, slip):
    boat, name, change, check, severity, words = SLIPS[slip]
    path = place(boat) / name
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    change(table)
    table.to_csv(path, index=False)
    named = [(s, what) for c, s, what in found(path.parent) if c == check]
    assert any(s == severity and words in what for s, what in named), named


def test_a_row_cut_short_with_the_file_is_refused(place):
    path = place("suboff") / "by_axisymmetry.csv"
    text = path.read_text("utf-8").rstrip("\n")
    path.write_text(text, "utf-8")
    assert read_campaign(path.parent)
    path.write_text(text[: text.rindex(",")], "utf-8")
    with pytest.raises(InputError, match=r"by_axisymmetry\.csv, row 3: 7 cells and no line end.*cut short"):
        read_campaign(path.parent)


def test_the_rows_name_coefficients_that_are_there():
    known, own = {t.name for s in SETS for t in terms(s)}, {"mass", "diameter", "draught", "propeller", "rudder_aspect"}
    for row in proportions():
        assert set(row.names) <= known | own
        parts = {p for over in row.over for p in re.split(r"[+\-*]", over) if p}
        assert parts <= known | own
        assert set(row.sets) <= set(SETS)
        assert row.low < row.high
        assert row.severity in ("warning", "error")
        assert len(row.basis) > 10


def test_a_quotient_is_judged_beyond_its_errors():
    row = Proportion(("a",), ("b",), 0.1, 1.0, "warning", (), False, "made")
    limits = {"errors": 3.0, "gross": 3.0, "near": 1.35}
    strict = replace(row, severity="error")
    cases = ((1.0, ""), (1.3, "warning"), (1.4, "error"), (0.08, "warning"), (0.07, "error"), (-0.5, "error"))
    for value_, expected in cases:
        assert beyond(strict, (value_, 0.0), (1.0, 0.0), limits) == expected, value_
    for value_, expected in ((0.5, ""), (1.5, "warning"), (4.0, "error"), (-0.5, "warning"), (0.01, "error")):
        assert beyond(row, (value_, 0.0), (1.0, 0.0), limits) == expected, value_
    assert beyond(row, (1.5, 0.3), (1.0, 0.0), limits) == ""
    assert beyond(row, (1.5, 0.0), (1.0, 0.4), limits) == ""
    assert evaluated("a-b*c", {"a": (1.0, 0.3), "b": (2.0, 0.2), "c": (3.0, 0.0)}) == (
        pytest.approx(-5.0), pytest.approx(np.hypot(0.3, 0.6)))  # fmt: skip
    assert evaluated("a+d", {"a": (1.0, 0.0)}) is None


def test_an_actuator_disk_without_load_loses_nothing():
    """Momentum theory: eta = 1 without thrust, and the propulsive power 2/(1 + sqrt(1 + C_T)) of C_T = 8: one half."""
    advance = np.array([1.0, 1.0])
    assert ideal_efficiency(advance, np.array([0.0, np.pi])) == pytest.approx([1.0, 0.5])


def test_a_propeller_of_another_boat_is_named_where_it_stands(place):
    path = place("starter").parent / "my-boat.toml"
    text = path.read_text("utf-8")
    assert "value = 3.6, unit" in text
    path.write_text(text.replace("value = 3.6, unit", "value = 12.0, unit"), "utf-8")
    folder = path.parent / "captive"
    (one,) = [f for f in check_campaign(read_campaign(folder), folder) if "propeller = 0.2" in f.what]
    assert (one.check, one.severity, one.file) == ("proportion", "warning", "vehicle my-boat")


@pytest.mark.parametrize(("point", "named"), [({}, 0), ({"y_m": 20.0}, 1), ({"x_m": 3.0}, 0), ({"z_m": -30.0}, 1)])
def test_a_moment_point_beside_the_body_is_an_error(place, point, named):
    campaign = read_campaign(place("starter"))
    moved = campaign.header.moment_point.model_copy(update=point)
    evidence = evidence_of(replace(campaign, header=campaign.header.model_copy(update={"moment_point": moved})))
    found_ = list(point_beside_the_body(evidence, rules()["moment_point"]))
    assert [f.severity for f in found_] == ["error"] * named
