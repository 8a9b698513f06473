"""A record that does not show the maneuver it is measured as is refused: the definitions of ITTC 7.5-02-06-01."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from trial_records import turn, write, zigzag

from ident.cli import main
from ident.trials.spec import TrialFile
from ident.trials.trial import measure_trial
from sim.files.errors import InputError


def a_zigzag():
    one = zigzag()
    track = {"x_north [m]": one["x"], "y_east [m]": one["y"], "u [m/s]": one["u"]}
    return {"t [s]": one["t"], "psi [deg]": one["psi"], "rudder [deg]": one["dH"]} | track


def a_turn(until_deg=np.inf):
    one = turn()
    kept = one["psi"] < until_deg
    named = {"t [s]": "t", "x_north [m]": "x", "y_east [m]": "y", "psi [deg]": "psi"}
    return {header: one[name][kept] for header, name in named.items()}


def level(depths):
    t = np.linspace(0.0, 100.0, 201)
    return {"t [s]": t, "theta [deg]": np.zeros(201) + 0.1 * np.sin(t / 9.0), "depth [m]": depths(t)}


@pytest.mark.parametrize(
    ("columns", "maneuver", "shown"),
    [
        (a_zigzag, "turning circle", "at most; the first metrics of a turning circle are at 90 deg"),
        (a_zigzag, "direct spiral", "2 angles at which the rudder stays"),
        (a_zigzag, "pull out", "never left amidships"),
        (a_zigzag, "stopping", "never comes to rest"),
        (a_zigzag, "course keeping", "no course is kept"),
        (a_turn, "zigzag 20/20", "a zigzag that swings by"),
        (lambda: a_turn(60.0), "turning circle", "a turn by 59.7 deg at most"),
        (lambda: level(lambda t: 20.0 + 0.1 * t), "rise", "no rise"),
        (lambda: level(lambda t: 20.0 + 5.0 * np.sin(np.pi * t / 104.0)), "depth change", "state the order, step_m"),
    ],
)
def test_another_maneuver_than_was_made_is_refused_with_what_the_record_shows(tmp_path, columns, maneuver, shown):
    path = write(tmp_path / "record.csv", columns())
    with pytest.raises(InputError) as refused:
        measure_trial(path, TrialFile(maneuver=maneuver), 20)
    assert shown in refused.value.found
    assert maneuver.split()[0].replace("turning", "turning_circle") in refused.value.where


def test_a_zigzag_turned_back_from_beyond_90_deg_is_no_turning_circle(tmp_path):
    t = np.linspace(0.0, 200.0, 401)
    path = write(tmp_path / "record.csv", {"t [s]": t, "psi [deg]": 60.0 * (1.0 - np.cos(t / 15.0))})
    with pytest.raises(InputError) as refused:
        measure_trial(path, TrialFile(maneuver="turning circle"), 20)
    assert "turns back by 120" in refused.value.found


@pytest.mark.parametrize(
    "words", [["--maneuver", "zigzag", "20/20"], ["--maneuver=zigzag", "20/20"], ["--maneuver", "zigzag 20/20"]]
)
def test_words_of_a_maneuver_need_no_quotation_marks_and_leave_files_alone(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    one = zigzag()
    write(tmp_path / "20", {"t [s]": one["t"][::2], "psi [deg]": one["psi"][::2]})
    done = CliRunner().invoke(main, ["trial", *words, "20", "--json", "-"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["maneuver"] == "zigzag 20/20"
    wrong = CliRunner().invoke(main, ["trial", "20", "--maneuver", "turning", "circle"])
    assert wrong.exit_code == 2
    assert "turning circle" in wrong.output
    assert "Traceback" not in wrong.output
