"""Authority: slips of a hand once accepted in silence; and statements on a trial that would change nothing."""

from __future__ import annotations

import shutil

import pytest
from sample_of_mutations import STARTER, TABLES
from trial_records import turn, write, zigzag

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from ident.trials.spec import TrialFile
from ident.trials.trial import measure_trial
from sim.files.errors import InputError

SPEED = "rudders-04,plane_deflection,rudders,"
SLIPS = {
    "sign of a rudder angle": ("rudders.csv", "rudders,1.5,-20,", "rudders,1.5,20,", "residuals", "rudders-01"),
    "speed of a run": ("rudders.csv", f"{SPEED}1.5", f"{SPEED}9.5", "residuals", "rudders-0"),
    "relative error": ("arm_r.csv", "-42.37,-167,202,0.02", "-42.37,-167,202,2e-05", "errors", "arm_r-05"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_found_with_its_run(tmp_path, slip):
    name, right, wrong, check, run = SLIPS[slip]
    shutil.copytree(STARTER, tmp_path / "boat")
    folder = tmp_path / "boat" / "captive"
    # The tables alone: histories take their time.
    shutil.rmtree(folder / "histories")
    header = folder / "campaign.toml"
    header.write_text(TABLES.match(header.read_text("utf-8"))[0], "utf-8")

    def found():
        return [f for f in check_campaign(read_campaign(folder), folder) if f.check in ("residuals", "errors")]

    assert not found()
    text = (folder / name).read_text("utf-8")
    assert right in text
    (folder / name).write_text(text.replace(right, wrong, 1), "utf-8")
    assert any(f.check == check and run in f.what and f.rows for f in found())


@pytest.mark.parametrize(
    ("stated", "key"),
    [
        ({"noise": {"depth_m": 0.1}}, "noise.depth_m"),
        ({"step_m": 3.0}, "step_m"),
        ({"released_s": 3.0}, "released_s"),
        ({"surface_point_m": (30.0, 0.0, 0.0)}, "surface_point_m"),
        ({"axes": {"x": "east", "y": "north"}}, "axes"),
        ({"initial": {"pitch_deg": 1.0}}, "initial.pitch_deg"),
    ],
)
def test_a_key_that_changes_nothing_on_a_record_is_refused(tmp_path, stated, key):
    one = zigzag()
    path = write(tmp_path / "zz.csv", {"t [s]": one["t"], "psi [deg]": one["psi"], "dH [deg]": one["dH"]})
    with pytest.raises(InputError, match=f"key {key}: stated, and changes nothing"):
        measure_trial(path, TrialFile.model_validate(stated), 4)


def test_distances_count_from_a_stated_place(tmp_path):
    one = turn()
    record = {"t [s]": one["t"], "x [m]": one["x"], "y [m]": one["y"], "psi [deg]": one["psi"]}
    path = write(tmp_path / "tc.csv", record)
    advance = "advance_90_heading_m"
    own = measure_trial(path, None, 4).metrics[advance].value
    spec = TrialFile.model_validate({"initial": {"x_m": -10.0, "y_m": 0.0}})
    assert measure_trial(path, spec, 4).metrics[advance].value == pytest.approx(own + 10.0, abs=0.05)


def test_what_is_only_quoted_stands_in_the_report(tmp_path):
    one = zigzag()
    path = write(tmp_path / "zz.csv", {"t [s]": one["t"], "psi [deg]": one["psi"]})
    spec = TrialFile(name="run 3", loading="submerged", density_kgpm3=1026.0, source="log book")
    stated = measure_trial(path, spec, 4).to_dict()["stated"]
    assert stated == {"name": "run 3", "loading": "submerged", "density_kgpm3": 1026.0, "source": "log book"}
