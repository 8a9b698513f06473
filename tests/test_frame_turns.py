"""Frame turns: a vehicle, a campaign or a reference means the same in every declared frame."""

from __future__ import annotations

import csv
import itertools
import re
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ident.captive.campaign import read_campaign
from ident.database.store import database_rows, digest
from ident.identification.identify import identify
from sim.boat.vehicle import load_vehicle
from sim.files.frames import DIRECTIONS, Frame, FrameError
from sim.flight.case import load_case
from sim.flight.series import load_reference

SOURCE = Frame("aft", "starboard", "up")
RIGHT_HANDED = [
    Frame("forward", "starboard", "down"),
    SOURCE,
    Frame("forward", "port", "up"),
    Frame("aft", "port", "down"),
]
BUNDLED = Path(__file__).parents[1] / "raw_captive_data" / "bb2"
# Which axis a campaign column belongs to, written out here and not read from the program.
AXIS_OF = {
    "x": ("X_N", "K_Nm", "p_radps", "udot_mps2", "pdot_radps2", "x_m"),
    "y": ("Y_N", "M_Nm", "q_radps", "vdot_mps2", "qdot_radps2", "y_m"),
    "z": ("Z_N", "N_Nm", "r_radps", "wdot_mps2", "rdot_radps2", "z_m"),
}


def test_frames_are_right_handed_or_refused():
    """Of eight sets of directions four are right-handed: an even number of axes reversed."""
    accepted = []
    for x, y, z in itertools.product(*(DIRECTIONS[a] for a in "xyz")):
        reversed_axes = [x == "aft", y == "port", z == "up"].count(True)
        if reversed_axes % 2:
            with pytest.raises(FrameError, match="left-handed"):
                Frame(x, y, z)
        else:
            accepted.append(Frame(x, y, z))
    assert len(accepted) == 4


@pytest.mark.parametrize("axes", [("ahead", "starboard", "down"), ("forward", "down", "starboard"), ("", "", "")])
def test_an_unknown_direction_is_refused_by_its_axis(axes):
    with pytest.raises(FrameError, match=r"frame axis (x|y)"):
        Frame(*axes)


def test_source_frame_turns_the_quantities_model_md_lists():
    """X Z K N u w p r x z phi psi change sign; Y M v q y theta and the flow angles do not."""
    turned = ("X", "Z", "K", "N", "u", "w", "p", "r", "x", "z", "phi", "psi", "udot", "wdot", "pdot", "rdot", "dz")
    kept = ("Y", "M", "v", "q", "y", "theta", "vdot", "qdot", "U", "alpha", "beta", "D0", "t", "n", "KT", "KQ")
    assert [SOURCE.sign(q) for q in turned] == [-1] * len(turned)
    assert [SOURCE.sign(q) for q in kept] == [1] * len(kept)


@pytest.mark.parametrize("frame", RIGHT_HANDED, ids=str)
def test_cross_product_turns_as_a_vector_in_every_frame(frame):
    """Moments are r x F: K M N must take the signs that the turned vectors give."""
    rng = np.random.default_rng(0)
    lever, force = rng.normal(size=3), rng.normal(size=3)
    moment = np.cross(frame.vector(list(lever)), frame.vector(list(force)))
    expected = np.cross(lever, force) * [frame.sign(k) for k in "KMN"]
    assert moment == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("frame", RIGHT_HANDED, ids=str)
def test_a_vehicle_turned_and_back_is_identical(frame):
    vehicle = load_vehicle("bb2")
    there = vehicle.turned(frame)
    assert there.frame.frame == frame
    assert there.turned(Frame()) == vehicle
    for here, turned in zip(vehicle.planes, there.planes, strict=True):
        # A right-handed turn carries b x p along as a vector.
        assert turned.lift_axis == pytest.approx(np.array(frame.vector(list(here.lift_axis))), abs=1e-15)


def test_program_frame_puts_the_sail_up_and_the_stern_planes_aft():
    vehicle = load_vehicle("bb2")
    sail = next(p for p in vehicle.planes if p.name == "sail_planes")
    assert sail.position == [10.2602, 0.0, -9.7261]
    assert {tuple(np.sign(p.position)) for p in vehicle.planes if p is not sail} == {
        (-1.0, y, z) for y in (1.0, -1.0) for z in (1.0, -1.0)
    }
    assert vehicle.particulars.centre_of_buoyancy.value[2] < vehicle.particulars.centre_of_gravity.value[2] < 0.0


# -- campaign ----------------------------------------------------------------------------


def _negated(text):
    """The same decimals with the other sign, so that no digit is lost."""
    if not text.strip() or float(text) == 0.0:
        return text
    return text[1:] if text.startswith("-") else f"-{text}"


def _turned_copy(folder, frame):
    """The bundled campaign written in another frame."""
    signs = {a: SOURCE.signs[a] * frame.signs[a] for a in "xyz"}
    flip = {column for axis, columns in AXIS_OF.items() if signs[axis] < 0 for column in columns}
    for path in BUNDLED.glob("*.csv"):
        with path.open(encoding="utf-8", newline="") as stream:
            runs = list(csv.DictReader(stream))
        with (folder / path.name).open("w", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, list(runs[0]), lineterminator="\n")
            writer.writeheader()
            for run in runs:
                writer.writerow({k: _negated(v) if k in flip else v for k, v in run.items()})
    header = (BUNDLED / "campaign.toml").read_text(encoding="utf-8")
    for axis in "xyz":
        header = re.sub(rf'(?m)^{axis} = "\w+"', f'{axis} = "{getattr(frame, axis)}"', header)
    (folder / "campaign.toml").write_text(header, encoding="utf-8")


@pytest.mark.parametrize("frame", [f for f in RIGHT_HANDED if f != SOURCE], ids=str)
def test_a_campaign_given_in_any_frame_gives_the_same_database(tmp_path, campaign, rows, frame):
    _turned_copy(tmp_path, frame)
    other = read_campaign(tmp_path)
    raw = pd.read_csv(tmp_path / "drift_horizontal.csv")["X_N"]
    bundled = pd.read_csv(BUNDLED / "drift_horizontal.csv")["X_N"]
    assert raw.tolist() == (bundled * frame.signs["x"] * SOURCE.signs["x"]).tolist()
    assert other.header.frame.x == frame.x
    numbers = campaign.runs.select_dtypes("number").columns
    pd.testing.assert_frame_equal(other.runs[numbers], campaign.runs[numbers], check_exact=True)
    found = database_rows(identify(other))
    assert found["value"].to_numpy() == pytest.approx(rows["value"].to_numpy(), rel=1e-12, abs=0.0)
    assert found["stderr"].to_numpy() == pytest.approx(rows["stderr"].to_numpy(), rel=1e-12, abs=0.0)
    assert digest(found) == digest(rows)


# -- reference ---------------------------------------------------------------------------


@pytest.mark.parametrize("frame", RIGHT_HANDED, ids=str)
def test_reference_series_mean_the_same_in_any_frame(tmp_path, frame):
    """The bundled zigzag written in another frame reads back as the bundled one."""
    case, where = load_case("hzz20")
    expected = load_reference(case, where)
    table = pd.read_csv(files("sim") / "cases" / "data" / "hzz20.csv")
    sign = table["channel"].map(lambda c: SOURCE.sign(c) * frame.sign(c))
    table["value"] = table["value"] * sign
    table.to_csv(tmp_path / "turned.csv", index=False)
    other = case.model_copy(deep=True)
    other.reference.file = "turned.csv"
    for axis in "xyz":
        setattr(other.reference.frame, axis, getattr(frame, axis))
    found = load_reference(other, str(tmp_path / "case.toml"))
    assert found.data.keys() == expected.data.keys()
    for source, channels in expected.data.items():
        assert found[source].keys() == channels.keys()
        for channel, record in channels.items():
            assert found[source][channel].abscissa.tolist() == record.abscissa.tolist()
            assert found[source][channel].value.tolist() == pytest.approx(record.value.tolist(), rel=1e-15)
            assert found[source][channel].unit == record.unit


def test_reference_zigzag_turns_to_port_first_in_the_program_frame():
    """Bow to port first is psi < 0 with z down, and the case's first command has that sign."""
    case, where = load_case("hzz20")
    record = load_reference(case, where)["EXP"]["psi"]
    time, heading = record.abscissa, record.value
    assert record.unit == "rad"
    assert heading[np.argmax(np.abs(heading) > np.radians(10.0))] < 0.0
    assert np.sign(case.command.dH.first_deg) < 0.0
    assert time[0] == 0.0
