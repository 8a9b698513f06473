"""Coefficients of a sign or size that no boat has: a slip in a file is an error, and the files as they are have none.

Authority: physics. Water takes energy from what moves steadily in it, thrust falls with the advance, a share is
no more than all; the ranges have their sources in ``possible_coefficients.csv``.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from sample_of_mutations import STARTER, TABLES

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign

ROOT = Path(__file__).parents[1]
KEPT = ("drift_horizontal", "rotation_r", "arm_q", "open_water", "self_propulsion", "towing")


def errors(folder: Path) -> dict[str, str]:
    found = check_campaign(read_campaign(folder), folder)
    return {f.check: f.what for f in found if f.severity == "error"}


@pytest.fixture
def boat(tmp_path):
    """The starter's campaign with a file a kind of test."""
    folder = tmp_path / "boat"
    shutil.copytree(STARTER, folder)
    shutil.rmtree(folder / "captive" / "histories")
    for path in (folder / "captive").glob("*.csv"):
        if path.stem not in KEPT:
            path.unlink()
    header = folder / "captive" / "campaign.toml"
    header.write_text(TABLES.match(header.read_text("utf-8"))[0], "utf-8")
    return folder / "captive"


def turned(column: str):
    """The sign of a column turned."""

    def turn(text: str) -> str:
        rows = [line.split(",") for line in text.strip().split("\n")]
        at = rows[0].index(column)
        for row in rows[1:]:
            row[at] = repr(-float(row[at]))
        return "\n".join(",".join(row) for row in rows) + "\n"

    return turn


def put(old: str, new: str):
    def replace(text: str) -> str:
        assert old in text
        return text.replace(old, new, 1)

    return replace


SLIPS = {
    "damping that drives": ("rotation_r.csv", turned("N_Nm"), "coefficient", "N_r|r|"),
    "drift of the other sense": ("campaign.toml", put('angles = "flight"', 'angles = "ittc"'), "coefficient", "Y_v"),
    "a rate in degrees": ("arm_q.csv", put("q_radps", "q_degps"), "coefficient", "M_uq"),
    "resistance positive aft": ("towing.csv", turned("X_N"), "size", "pulls the body along"),
    "a density of nothing": ("campaign.toml", put("= 1000.0", "= 2000.0"), "fluid", "2000"),
    "a thrust of the other sign": ("open_water.csv", put("0.2,0.38", "0.2,-0.38"), "open_water", "more than at"),
    "thrust and advance swapped": ("open_water.csv", put("J,KT", "KT,J"), "open_water", ""),
    "torque of the other sign": ("open_water.csv", turned("KQ"), "open_water", "KQ = "),
    "revolutions astern": ("self_propulsion.csv", put("5.44", "(5.44)"), "coefficient", "w_T"),
}


def test_the_files_as_they_are_have_no_error(boat):
    assert errors(boat) == {}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_in_runs_is_an_error(boat, slip):
    name, change, check, words = SLIPS[slip]
    path = boat / name
    path.write_text(change(path.read_text("utf-8")), "utf-8")
    assert words in errors(boat)[check]


PUBLISHED = {
    "kvlcc2": [("x_H,-0.464", "x_H,0.464"), ("t_P,0.233", "t_P,-0.233"), ("k_0,0.31352", "k_0,2.747")],
    "suboff": [
        ("N_ur,-0.004444", "N_ur,0.004444"),
        ("N_ur,-0.004444", "N_ur,-0.000004444"),
        ("X_uu,-0.0012", "X_uu,0.0012"),
    ],
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_slip_in_published_values_is_an_error_with_its_row(tmp_path, name):
    folder = tmp_path / name
    shutil.copytree(ROOT / "raw_captive_data" / name, folder)
    assert errors(folder) == {}
    for old, new in PUBLISHED[name]:
        path = next(p for p in sorted(folder.glob("*.csv")) if old in p.read_text("utf-8"))
        text = path.read_text("utf-8")
        path.write_text(text.replace(old, new), "utf-8")
        row = text[: text.index(old)].count("\n") + 1
        found = [f for f in check_campaign(read_campaign(folder), folder) if f.check == "coefficient"]
        assert [(f.file, f.rows) for f in found] == [(path.name, (row,))], (old, found)
        path.write_text(text, "utf-8")
