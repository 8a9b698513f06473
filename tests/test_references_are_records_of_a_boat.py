"""References held against what a boat does: other units, signs and clocks are refused, published records are not."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pandas as pd
import pytest

from ident.options import Conditions
from ident.validation.reference_limits import limits
from ident.validation.validate import _held_against, validate
from sim.files.errors import InputError
from sim.files.toml_files import bundled

DATA = files("sim") / "cases" / "data"
FILES = {
    "hzz20": "hzz20",
    "roll-decay": "roll_decay",
    "turn20-23.69m": "turn20_23.69m",
    "turn20-2.5m": "turn20_2.5m",
    "vzz10-06kt": "vzz10_06kt",
    "vzz10-10kt": "vzz10_10kt",
}
# Units that are taken for one another, and the sign.
SLIPS = {"degrees": 57.3, "radians": 1 / 57.3, "km": 1e-3, "mm": 1e3, "minutes": 60.0, "hours": 1 / 60.0, "sign": -1.0}
SLIPS |= {"1e9": 1e9}


def _held(path, case, table):
    table.to_csv(path, index=False)
    return _held_against(case, None, Conditions(), path)


@pytest.mark.parametrize("case", sorted(bundled("cases")))
def test_bundled_references_are_records_of_a_boat(case):
    *_, notes = _held_against(case, None, Conditions(), None)
    assert notes == []


@pytest.mark.parametrize("case", FILES)
def test_every_channel_in_another_unit_is_refused(tmp_path, case):
    """Of the eight slips none passes in silence: of values and of the time or path length, channel by channel."""
    table = pd.read_csv(DATA / f"{FILES[case]}.csv")
    along = "t" if "t" in table else "s"
    passed = []
    for channel in table["channel"].unique():
        for name, factor in SLIPS.items():
            value = table["value"].where(table["channel"] != channel, table["value"] * factor)
            try:
                _held(tmp_path / "mine.csv", case, table.assign(value=value))
            except InputError:
                continue
            passed.append((channel, name))
    for factor in SLIPS.values():
        if factor > 0.0:
            with pytest.raises(InputError):
                _held(tmp_path / "mine.csv", case, table.assign(**{along: table[along] * factor}))
    assert passed == []


@pytest.mark.parametrize(
    ("case", "change", "words"),
    [
        ("turn20-23.69m", {"x": 1e3}, ["row 3", "CFD x", "x changes by 4000 m in 4 m of path", "39"]),
        ("hzz20", {"psi": 57.3}, ["EXP psi", "psi turns by", "rad a length at most"]),
        ("hzz20", {"u": 1.944}, ["row 1451, EXP u", "u = 9.58645 m/s (as turned", "the case starts at 5.144 m/s"]),
        ("hzz20", {"u": 0.5144}, ["row 1451, EXP u", "u begins at 0.493 of the 5.144 m/s", "0.55 to 1.8"]),
        ("hzz20", {"r": -1.0}, ["EXP psi", "psi is -0.998 times what r leads to"]),
        ("hzz20", {"psi": -1.0, "r": -1.0, "y": -1.0}, ["goes to starboard first, the case to port"]),
        ("roll-decay", {"phi": 57.3}, ["row 2, EXP phi", "phi = 4.51604 rad (as turned", "turned over"]),
        ("roll-decay", {"phi": -1.0}, ["EXP phi", "phi begins at -4.5", "the case at 4.5"]),
        ("vzz10-10kt", {"u_over_U0": -1.0}, ["u_over_U0 begins at -1", "the sign"]),
    ],
)
def test_what_is_wrong_with_a_reference_is_named(tmp_path, case, change, words):
    table = pd.read_csv(DATA / f"{FILES[case]}.csv")
    factor = table["channel"].map(change).fillna(1.0)
    with pytest.raises(InputError) as refused:
        _held(tmp_path / "mine.csv", case, table.assign(value=table["value"] * factor))
    for word in ("mine.csv", *words):
        assert word in str(refused.value)


def _made(channel, unit, value, t=None):
    t = np.arange(0.0, 100.0, 1.0) if t is None else t
    value = np.broadcast_to(value, t.shape)
    return pd.DataFrame({"source": "TANK", "channel": channel, "t": t, "value": value, "unit": unit})


@pytest.mark.parametrize(
    ("channel", "unit", "value", "words"),
    [
        ("D0", "m", -23.69, ["D0 = -23.69 m", "positive down"]),
        ("D0", "m", 23690.0, ["D0 = 23690 m", "1.094e+04"]),
        ("n", "1/s", 90.0, ["n = 90 1/s", "the propeller's limits"]),
        ("ballast", "kg", 1e9, ["ballast = 1e+09 kg", "what the tank takes"]),
        ("q", "rad/s", 1.5, ["q = 1.5 rad/s", "U / L"]),
        ("p", "deg/s", 90.0, ["p = -90 deg/s", "no boat rolls faster"]),
        ("w", "m/s", 60.0, ["w = -60 m/s", "the case starts at"]),
        ("theta", "deg", 100.0, ["theta = 100 deg", "turned over"]),
        ("phi", "rad", np.sin(np.arange(0.0, 400.0, 4.0)) * 0.1, ["swings"]),
    ],
)
def test_values_that_no_boat_has_are_refused(tmp_path, channel, unit, value, words):
    t = np.arange(0.0, 10.0, 0.1) if words == ["swings"] else None
    with pytest.raises(InputError) as refused:
        _held(tmp_path / "mine.csv", "vzz10-15kt", _made(channel, unit, value, t))
    for word in ("mine.csv, row 2, TANK", *words):
        assert word in str(refused.value)


@pytest.mark.parametrize(
    ("channel", "unit", "value", "words"),
    [
        ("theta", "rad", 0.0, "theta is 0 at every point"),
        ("y", "m", 50.0 + 0.01 * np.arange(100.0), "y begins at 50 m"),
        ("psi", "deg", 45.0 + 0.01 * np.arange(100.0), "psi begins at -45 deg"),
        ("D0", "m", 200.0 + 0.01 * np.arange(100.0), "D0 begins at 200 m, the case at"),
        ("phi", "deg", 60.0 + 0.01 * np.arange(100.0), "phi of 60 deg"),
    ],
)
def test_what_may_be_right_is_said(tmp_path, channel, unit, value, words):
    *_, notes = _held(tmp_path / "mine.csv", "vzz10-15kt", _made(channel, unit, value))
    assert any(words in note for note in notes), notes


def test_sources_that_nothing_names_and_holes_are_said(tmp_path):
    """A case names its sources; a row of another is compared with nothing, forty missing rows are a hole."""
    table = pd.read_csv(DATA / "hzz20.csv")
    table.loc[table.index[20], "source"] = "EXPEXP"
    table = table.drop(table.index[30:70])
    case = (files("sim") / "cases" / "hzz20.toml").read_text("utf-8").replace("data/hzz20.csv", "mine.csv")
    (tmp_path / "case.toml").write_text(case, "utf-8")
    table.to_csv(tmp_path / "mine.csv", index=False)
    *_, notes = _held_against(tmp_path / "case.toml", None, Conditions(), None)
    assert any("source 'EXPEXP' with 1 rows is compared with nothing; is it 'EXP'?" in note for note in notes), notes
    assert any("a gap from t = " in note for note in notes), notes


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.drop(t.index[40]), "a gap from t = 39 to 41, usual steps are 1"),
        (lambda t: t.drop(t.index[141:161]), "psi at 140 end before the others, at t = 160"),
        (lambda t: t.drop(t.index[0:20]), "psi at 20 begin after the others, at t = 0"),
        (lambda t: t.assign(value=t["value"].where(t.index != 503, 0.0)), "1 of 161 points of y are far from"),
        (
            lambda t: t.assign(value=t["value"].where((t["channel"] != "p") | (t["t"] < 85.0), -t["value"])),
            "phi and what p leads to do not go together",
        ),
        (lambda t: t.assign(sigma=t["sigma"] * 20.0), "standard errors of p that are"),
    ],
)
def test_a_row_that_is_missing_or_misprinted_is_said(tmp_path, change, words):
    *_, notes = _held(tmp_path / "mine.csv", "hzz20", change(pd.read_csv(DATA / "hzz20.csv")))
    assert any(words in note for note in notes), notes


def test_a_source_of_one_point_is_refused_before_anything_is_flown(tmp_path):
    table = pd.read_csv(DATA / "hzz20.csv")
    with pytest.raises(InputError, match="row 42, EXPEXP psi: one point"):
        _held(tmp_path / "mine.csv", "hzz20", table.assign(source=table["source"].where(table.index != 40, "EXPEXP")))


def test_a_channel_as_flown_but_for_a_unit_is_said(tmp_path, fitted_db):
    """The flight's own heave velocity in thousandths, z up as the case states; nothing else in the file could tell."""
    flight = validate("vzz10-15kt", fitted_db).simulation
    every = slice(None, None, 10)
    table = _made("w", "m/s", flight["w"][every] * 1e-3, flight["t"][every])
    notes = validate("vzz10-15kt", fitted_db, reference=_written(tmp_path / "mine.csv", table)).notes
    assert any("w is -0.001 times what is flown" in note and "thousandths" in note for note in notes), notes
    table = _made("w", "m/s", flight["w"][every] * -1.3, flight["t"][every])
    assert validate("vzz10-15kt", fitted_db, reference=_written(tmp_path / "mine.csv", table)).notes == []


def _written(path, table):
    table.to_csv(path, index=False)
    return path


def test_every_limit_has_its_meaning_and_its_basis():
    table = pd.read_csv(files("ident") / "data" / "reference_limits.csv")
    assert table["limit"].is_unique
    assert not table[["meaning", "basis"]].isna().any().any()
    assert set(limits()) == set(table["limit"])
