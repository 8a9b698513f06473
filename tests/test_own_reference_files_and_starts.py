"""A user's own reference file, path length as abscissa, and records with their own start."""

from __future__ import annotations

import json
import shutil
from importlib.resources import files

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from ident.cli import main
from ident.options import OwnReference
from ident.validation.band_summary import inside
from ident.validation.bands import fly_samples
from ident.validation.trial_reference import smoothed
from ident.validation.validate import validate
from sim.boat.coefficients import Coefficients
from sim.files.errors import InputError
from sim.files.record import Record
from sim.flight.case import load_case
from sim.flight.series import Series, load_reference
from sim.flight.simulate import simulate

DATA = files("sim") / "cases" / "data"


def _own(path, name="turn20_23.69m.csv", turn=None):
    table = pd.read_csv(DATA / name)
    if turn is not None:
        table = turn(table)
    table.to_csv(path, index=False)
    return path


def test_bundled_file_given_as_own_gives_the_bundled_errors(tmp_path, fitted_db):
    bundled = validate("turn20-23.69m", fitted_db).to_dict()
    own = validate("turn20-23.69m", fitted_db, reference=_own(tmp_path / "mine.csv")).to_dict()
    assert own["references"] == bundled["references"]
    assert own["metrics"] == bundled["metrics"]
    assert own["references"]["CFD"]["x"]["ratio"] > 0.0


def test_a_time_of_another_size_is_refused_with_its_channel(tmp_path, fitted_db):
    """A last sample after thirty years."""

    def late(table):
        rolled = (table["source"] == "EXP") & (table["channel"] == "phi")
        last = table.index == table[rolled].index[-1]
        return table.assign(t=table["t"].where(~last, 1e9))

    with pytest.raises(InputError) as refused:
        validate("roll-decay", fitted_db, reference=_own(tmp_path / "mine.csv", "roll_decay.csv", late))
    assert refused.value.where.endswith("mine.csv, row 240, EXP phi")
    assert "to 1e+09" in refused.value.found


def test_values_that_no_smooth_path_goes_through_are_refused_with_their_channel():
    t = np.concatenate([np.arange(60.0), [1e9]])
    series = Series({"TANK": {"theta": Record("theta", t, 0.1 * np.sin(t), "rad")}}, "t")
    with pytest.raises(InputError) as refused:
        smoothed(series, "mine.csv")
    assert refused.value.where.endswith("mine.csv, TANK theta")
    assert "to 1e+09 s" in refused.value.found


def test_frame_option_turns_the_file(tmp_path, fitted_db):
    """The same track written x forward, z down, with --frame program; x changes sign only."""

    def turn(table):
        return table.assign(value=table["value"].where(table["channel"] != "x", -table["value"]))

    path = _own(tmp_path / "mine.csv", turn=turn)
    bundled = validate("turn20-23.69m", fitted_db).to_dict()["references"]
    assert (
        validate("turn20-23.69m", fitted_db, reference=OwnReference(path, frame="program")).to_dict()["references"]
        == bundled
    )
    with pytest.raises(InputError, match="astern"):
        validate("turn20-23.69m", fitted_db, reference=OwnReference(path, frame="source"))


def test_every_channel_of_the_simulation_is_compared(tmp_path, fitted_db):
    """A case without a bundled reference: two sources, a channel nobody has, no sigma."""
    t = np.arange(0.0, 60.0, 1.0)
    rows = [
        ("TANK", c, x, 0.01 * (x if c != "q" else 1.0), u)
        for c, u in (("theta", "deg"), ("q", "deg/s"), ("mood", "-"))
        for x in t
    ]
    rows += [("HDM", "theta", x, 0.02 * x, "deg") for x in t]
    path = tmp_path / "mine.csv"
    pd.DataFrame(rows, columns=["source", "channel", "t", "value", "unit"]).to_csv(path, index=False)
    assert validate("vzz10-15kt", fitted_db).to_dict()["references"] == {}
    done = validate("vzz10-15kt", fitted_db, reference=path).to_dict()
    found = done["references"]
    assert "reference TANK: channel 'mood' is none of a simulation's and is not compared" in done["notes"]
    assert set(found) == {"TANK"}
    assert set(found["TANK"]) == {"theta", "q"}
    # 0.01 t against 0.02 t: root mean square of 0.01 t.
    assert found["TANK"]["theta"]["published_model_rmse"] == pytest.approx(0.01 * np.sqrt(np.mean(t**2)))
    assert found["TANK"]["q"]["ratio"] is None
    assert found["TANK"]["theta"]["reference_sigma"] is None


def test_command_line_takes_an_own_reference(tmp_path, fitted_db):
    path = _own(tmp_path / "mine.csv")
    common = ["validate", "--case", "turn20-4m", "--db", fitted_db, "--out", str(tmp_path / "out"), "--json", "-"]
    done = CliRunner().invoke(main, [*common, "--reference", str(path)])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout[done.stdout.index("{") :])
    assert found["references"]["CFD"]["y"]["ratio"] > 0.0
    assert (tmp_path / "out" / "turn20-4m_v0.png").stat().st_size > 10000
    assert CliRunner().invoke(main, [*common, "--frame", "program"]).exit_code == 2
    assert CliRunner().invoke(main, ["validate", "--all", "--vehicle", "bb2", "--db", fitted_db]).exit_code == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("source,channel,t,value\nA,x,0,1\n", ["mine.csv", "column unit missing"]),
        ("source,channel,t,value,unit\nA,mood,0,1,m\n", ["column channel", "mood"]),
        ("source,channel,t,value,unit\nA,x,0,1,m\nA,x,0,2,m\n", ["not increasing"]),
        ("source,channel,t,value,unit\nA,x,0,1,m\nA,x,1,2,ft\n", ["units", "ft"]),
        ("source,channel,t,value,unit\nA,x,0,1,ft\n", ["ft", "m"]),
        ("source,channel,t,value,unit\nA,x,0,one,m\n", ["row 2", "value", "one"]),
        ("source,channel,t,value,unit,sigma\nA,x,0,1,m,?\n", ["row 2", "sigma"]),
        ("source,channel,t,value,unit\nA,x,900,1,m\nA,x,901,1,m\n", ["begins", "900"]),
        (
            "source,channel,t,value,unit\nA,x,0,1,m\nA,x,1e9,1,m\n",
            ["A x", "row 3", "t goes to 1e+09", "to 50 times the run"],
        ),
        ("source,channel,t,value,unit\nA,x,0,1,m\n", ["A x", "one point", "two points or more"]),
        ("source,channel,t,value,unit,Sigma\nA,x,0,1,m,1\n", ["column Sigma", "sigma?"]),
        ("source,channel,t,value,unit\nA,Theta,0,1,rad\nA,x,0,1,m\n", ["column channel", "'Theta' of A", "theta?"]),
        ("source;channel;t;value;unit\nA;x;0;1;m\n", ["mine.csv", "without commas"]),
        ("", ["mine.csv", "not a table"]),
        ("source,channel,t,value,unit\nA,x,0,1,m\n,x,1,2,m\n", ["row 3", "column source", "nothing"]),
        ("source,channel,t,value,unit\nA,x,-2,1,m\nA,x,1,2,m\n", ["row 2", "column t", "-2", "zero or more"]),
        ("source,channel,t,value,unit,sigma\nA,x,0,1,m,-1\n", ["row 2", "column sigma", "-1", "zero or more"]),
        ("\xff\xfe", ["mine.csv", "not a table"]),
    ],
)
def test_mistake_in_an_own_reference_is_named(tmp_path, fitted_db, text, words):
    path = tmp_path / "mine.csv"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(InputError) as caught:
        validate("vzz10-15kt", fitted_db, reference=path)
    for word in words:
        assert word in str(caught.value)


def test_points_beyond_the_run_and_units_of_time_are_said(tmp_path, fitted_db):
    """vzz10-15kt: half of the points lie beyond the run; minutes for seconds end in its first twentieth."""
    end = load_case("vzz10-15kt")[0].run.duration_s
    t = np.linspace(0.0, 2.0 * end, 41)
    path = tmp_path / "mine.csv"
    for times, words in ((t, ["points of theta lie beyond", "not compared"]), (t / 120.0, ["is t in s?"])):
        rows = [("TANK", "theta", x, 1e-4 * x, "rad") for x in times]
        pd.DataFrame(rows, columns=["source", "channel", "t", "value", "unit"]).to_csv(path, index=False)
        (note,) = validate("vzz10-15kt", fitted_db, reference=path).notes
        assert all(word in note for word in words), note


def test_missing_own_reference_is_named(tmp_path, fitted_db):
    with pytest.raises(InputError, match="no such file"):
        validate("vzz10-15kt", fitted_db, reference=tmp_path / "none.csv")


def test_track_is_compared_at_equal_path_length(coefficients):
    """A reference made of the flight itself, over its path length, has no error."""
    from ident.validation.validate import rmse

    case, _ = load_case("turn20-23.69m")
    flown = simulate(case, coefficients)
    along = np.linspace(0.0, flown["s"][-1], 300)
    for channel in ("x", "y"):
        series = Record(channel, along, np.interp(along, flown["s"], flown[channel]), "m")
        assert rmse(flown, channel, series, "s") < 1e-9
        assert rmse(flown, channel, series, "t") > 1.0
    speed = np.hypot(np.gradient(flown["x"], flown["t"]), np.gradient(flown["y"], flown["t"]))
    assert flown["s"][-1] == pytest.approx(np.trapezoid(speed, flown["t"]), rel=1e-5)


def test_reading_error_is_reported_and_not_taken_off(fitted_db):
    """Root mean square of the sigma column, beside the same RMSE as without it."""
    found = validate("turn20-23.69m", fitted_db).to_dict()["references"]["CFD"]["x"]
    table = pd.read_csv(DATA / "turn20_23.69m.csv")
    sigma = table[(table["source"] == "CFD") & (table["channel"] == "x")]["sigma"]
    assert found["reference_sigma"] == pytest.approx(np.sqrt(np.mean(sigma**2)))


def _with_its_own_start(folder):
    """hzz20 as a case file of one's own, EXP compared from the speed its record starts at."""
    (folder / "data").mkdir()
    shutil.copy(DATA / "hzz20.csv", folder / "data" / "hzz20.csv")
    text = (DATA.parent / "hzz20.toml").read_text("utf-8").replace("upright = true", "upright = false")
    start = '[reference.initial.EXP]\nspeed_mps = 4.93\nsource = "first value"\n\n[reference.frame]'
    path = folder / "hzz20.toml"
    path.write_text(text.replace("[reference.frame]", start), encoding="utf-8")
    return str(path)


def test_source_with_its_own_start_is_held_against_a_flight_from_there(fitted_db, coefficients, tmp_path):
    """hzz20: EXP starts at 4.93 m/s, CFD at 5.14; each its own flight, the metrics of both."""
    case, where = load_case(_with_its_own_start(tmp_path))
    done = validate(where, fitted_db)
    own = case.started_as("EXP")
    assert own.initial.speed_mps == 4.93
    assert case.started_as("CFD") is None
    flights = {"EXP": simulate(own, coefficients), "CFD": simulate(case, coefficients)}
    assert flights["EXP"]["U"][0] == pytest.approx(4.93)
    reference = load_reference(case, where)
    for source, flight in flights.items():
        u = reference[source]["u"]
        expected = np.sqrt(np.mean((np.interp(u.abscissa, flight["t"], flight["u"]) - u.value) ** 2))
        assert done.to_dict()["references"][source]["u"]["rmse"] == pytest.approx(expected, rel=1e-9)
    assert done.to_dict()["metrics"]["execute_2_s"]["simulated_as_EXP"] == pytest.approx(flights["EXP"].executes[1, 0])


def test_bands_of_a_source_with_its_own_start_start_there(campaign, rows, tmp_path):
    """Without any error every band is the flight: u starts at 4.93 m/s for EXP, 5.14 for CFD."""
    case, where = load_case(_with_its_own_start(tmp_path))
    case = case.model_copy(deep=True)
    case.run.duration_s = 5.0
    exact = rows.assign(stderr=0.0)
    bands = fly_samples(case, campaign.vehicle, exact, 2)
    own = simulate(case.started_as("EXP"), Coefficients(campaign.vehicle, rows))
    assert bands.band("u", "95", "EXP")[0] == pytest.approx(own["u"], rel=1e-9)
    assert bands.band("U", "95", "CFD")[0][0] == pytest.approx(5.14444)
    reference = load_reference(case, where)
    reference.data["EXP"] = {"u": Record("u", own["t"], own["u"] + 1.0, "m/s")}
    assert inside(bands, case, reference)["EXP"]["u"] == {"50": 0.0, "95": 0.0}


def test_other_vehicle_by_option(fitted_db):
    """The standard maneuvers name bb2, and fly any vehicle of the database."""
    assert validate("meander", fitted_db, vehicle="bb2").to_dict()["vehicle"] == "bb2"
    with pytest.raises(InputError, match="no such file or bundled name"):
        validate("meander", fitted_db, vehicle="bb3")


def test_a_misprinted_point_of_a_reference_is_said(tmp_path):
    """A decimal point that was lost: no boat goes there and back between two samples."""
    from ident.validation.references import check_reference
    from ident.validation.trial_reference import referenced

    case, where = load_case("turn20-23.69m")
    assert check_reference(case, referenced(case, where).series, where) == []
    text = (files("sim") / "cases" / "data" / "turn20_23.69m.csv").read_text("utf-8")
    assert "CFD,x,780.0,-127.51," in text
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "turn20_23.69m.csv").write_text(text.replace("CFD,x,780.0,-127.51,", "CFD,x,780.0,-12751,"))
    beside = str(tmp_path / "turn.toml")
    (said,) = check_reference(case, referenced(case, beside).series, beside)
    assert "points of x are far from their neighbours" in said
    assert "1 of 227" in said
    assert "the first at s = 780" in said


def test_a_tolerance_in_another_unit_is_refused_before_anything_is_flown(tmp_path):
    """No database is there: the flight is not come to."""
    case = tmp_path / "own.toml"
    text = (files("sim") / "cases" / "hzz20.toml").read_text("utf-8").replace('unit = "rad"', 'unit = "deg"')
    data = DATA / "hzz20.csv"
    case.write_text(text.replace("data/hzz20.csv", str(data)))
    with pytest.raises(InputError) as caught:
        validate(case, tmp_path / "none")
    assert "tolerance on EXP psi" in caught.value.where
    assert "EXP psi [rad]" in caught.value.allowed


def test_a_bundled_name_with_an_ending_is_told_without_it(fitted_db):
    with pytest.raises(InputError, match=r"the bundled one is called remus100, without \.toml"):
        validate("meander", fitted_db, vehicle="remus100.toml")
