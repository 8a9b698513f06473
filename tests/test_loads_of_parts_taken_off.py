"""Authority: statics. The load of a part and its moment, taken off a total, leave the rest, in any axes."""

from __future__ import annotations

import json

import numpy as np
import pytest
from made_campaigns import CONSTANTS, STEADY, campaign, history

from ident.captive.campaign import read_campaign
from ident.database.provenance import conversions, steps
from sim.files.errors import InputError

AXES = {
    "program": 'x = "forward"\ny = "starboard"\nz = "down"\nangles = "flight"',
    "z up": 'x = "aft"\ny = "starboard"\nz = "up"\nangles = "flight"',
    "left": 'x = "forward"\ny = "starboard"\nz = "up"\nrotations = "left-hand"\nangles = "flight"',
}
# In the program frame, about the vehicle's origin: hull alone; rudder, its force and where it acts.
HULL = np.array([-900.0, 2000.0, 150.0, 80.0, -400.0, 9000.0])
FORCE, AT = np.array([-40.0, 310.0, 25.0]), np.array([-31.5, 0.0, 1.25])
BALANCE = np.array([2.0, 0.0, -0.5])
LOADS = ["X", "Y", "Z", "K", "M", "N"]


def turned(frame: str) -> tuple[np.ndarray, np.ndarray]:
    """Signs of forces and positions, and of moments, from the program frame to another."""
    axes = {"program": (1, 1, 1), "z up": (-1, 1, -1), "left": (1, 1, -1)}[frame]
    return np.array(axes), np.array(axes) * (-1 if frame == "left" else 1)


def measured(frame: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Total about the balance, rudder force, its position and the balance's, in a campaign's axes."""
    forces, moments = turned(frame)
    whole, about = HULL[:3] + FORCE, HULL[3:] + np.cross(AT, FORCE)
    about = about - np.cross(BALANCE, whole)
    return np.concatenate([forces * whole, moments * about]), forces * FORCE, forces * AT, forces * BALANCE


def point(at) -> str:
    return (
        "\n".join(f"{a}_m = {v!r}" for a, v in zip("xyz", np.asarray(at).tolist(), strict=True)) + '\nabout = "balance"'
    )


SUBTRACT = """[[source.subtract]]
what = "rudder"
source = "balance in the stock"
columns = {{ RX = "X", "RY [kN]" = "Y", RZ = "Z [N]" }}
at_m = {at}
{more}
"""
HEADER = "X [N],Y [N],Z [N],K [N m],M [N m],N [N m],RX [N],RY [kN],RZ"


def cells(total, force) -> str:
    return ",".join(repr(float(v)) for v in (*total, force[0], force[1] / 1e3, force[2]))


@pytest.mark.parametrize("frame", AXES)
def test_a_part_taken_off_a_table_leaves_the_rest_in_any_axes(tmp_path, frame):
    total, force, at, balance = measured(frame)
    source = f'[[source]]\nfiles = "runs.csv"\n{CONSTANTS}rel_sigma = 0.05\n'
    source += SUBTRACT.format(at=at.tolist(), more="")
    campaign(tmp_path, source, frame=AXES[frame], moment_point=point(balance))
    (tmp_path / "runs.csv").write_text(f"{HEADER}\n{cells(total, force)}\n{cells(total, 2.0 * force)}\n")
    runs = read_campaign(tmp_path).runs
    np.testing.assert_allclose(runs[LOADS].iloc[0].astype(float), HULL, rtol=1e-9, atol=1e-9)
    off = np.concatenate([FORCE, np.cross(AT, FORCE)])
    np.testing.assert_allclose(runs[LOADS].iloc[1].astype(float), HULL - off, rtol=1e-9, atol=1e-6)
    # Both balances read to 5 %: the errors of the total and of the part add in squares.
    assert runs["s_Y"][1] == pytest.approx(0.05 * np.hypot(HULL[1] + FORCE[1], 2.0 * FORCE[1]), rel=1e-9)


@pytest.mark.parametrize("frame", AXES)
def test_a_part_taken_off_a_history_sample_by_sample(tmp_path, frame):
    """Scatter that total and part share is not in the rest, and so not in its standard error."""
    total, force, at, balance = measured(frame)
    shared = np.random.default_rng(2).standard_normal(400)
    own = np.random.default_rng(3).standard_normal(400)
    forces, moments = turned(frame)
    rows = []
    for i in range(400):
        sway = np.array([0.0, 50.0 * shared[i], 0.0])
        more = np.concatenate([forces * sway, moments * np.cross(AT - BALANCE, sway)])
        more[1] += own[i]
        rows.append(f"{0.05 * i:.2f},{cells(total + more, force + forces * sway)}")
    source = history("runs.csv") + SUBTRACT.format(at=at.tolist(), more="")
    campaign(tmp_path, source, frame=AXES[frame], moment_point=point(balance))
    (tmp_path / "runs.csv").write_text(f"time_s,{HEADER}\n" + "\n".join(rows) + "\n")
    read = read_campaign(tmp_path)
    run = read.runs.iloc[0]
    assert 0.03 < run["s_Y"] < 0.1 < 50.0 / np.sqrt(400)
    assert abs(run["Y"] - HULL[1]) < 4.0 * run["s_Y"]
    np.testing.assert_allclose(run[["X", "Z", "M"]].astype(float), HULL[[0, 2, 4]], rtol=1e-6, atol=1e-3)
    said = dict(steps(json.loads(json.dumps(conversions(read)))))["Parts taken off"]
    assert "rudder, 1 times RX (X), RY [kN] (Y), RZ (Z [N]), at (" in said
    assert "balance in the stock" in said


def test_thrust_of_the_other_sign_through_the_moment_point(tmp_path):
    source = f'[[source]]\nfiles = "runs.csv"\n{CONSTANTS}rel_sigma = 0.05\n[[source.subtract]]\nwhat = "propeller"\n'
    source += 'source = "dynamometer, positive aft"\ncolumns = { T = "X" }\nat_m = [-30.0, 0.0, 0.0]\nfactor = -1.0\n'
    campaign(tmp_path, source)
    (tmp_path / "runs.csv").write_text("X_N,N_Nm,T [kN]\n-120,7000,-0.8\n-130,7000,-0.7\n")
    runs = read_campaign(tmp_path).runs
    np.testing.assert_allclose(runs["X"], [-920.0, -830.0])
    np.testing.assert_allclose(runs["N"], [7000.0, 7000.0])


def test_a_part_taken_off_an_oscillation_leaves_derivatives_of_the_rest(tmp_path):
    """Pure sway: hull -800 vdot - 150 v; a rudder of -20 vdot - 60 v, 31 m behind the moment point."""
    omega, swing = 2.0 * np.pi * 0.25, 0.2
    t = np.arange(0.0, 40.0, 0.02)
    v, vdot = swing * omega * np.cos(omega * t), -swing * omega**2 * np.sin(omega * t)
    rudder = -20.0 * vdot - 60.0 * v
    noise = np.random.default_rng(4).standard_normal((2, t.size))
    y, n = -800.0 * vdot - 150.0 * v + rudder + noise[0], -90.0 * v - 31.0 * rudder + noise[1]
    state = CONSTANTS.replace('beta = "5 deg"\n', "").replace('test = "drift_horizontal"\n', "") + "rel_sigma = 0.1\n"
    swayed = '[source.reduction]\nkind = "oscillatory"\nmotion = "sway"\nfrequency_hz = 0.25\namplitude = 0.2\n'
    campaign(tmp_path, history("pmm.csv", constants=state, reduction=swayed) + GOOD)
    rows = "".join(f"{a:.3f},{b!r},{c!r},{d!r}\n" for a, b, c, d in np.column_stack([t, y, n, rudder]).tolist())
    (tmp_path / "pmm.csv").write_text("time_s,Y_N,N_Nm,RY [N]\n" + rows)
    runs = read_campaign(tmp_path).runs.set_index("run_id")
    speed, acceleration = swing * omega, swing * omega**2
    assert runs["Y"]["pmm+v"] == pytest.approx(-150.0 * speed, abs=0.3)
    assert runs["Y"]["pmm-a"] == pytest.approx(-800.0 * acceleration, abs=0.3)
    assert runs["N"]["pmm+v"] == pytest.approx(-90.0 * speed, abs=0.3)
    # A tenth of total and of part, in squares, and what the noise leaves.
    assert runs["s_Y"]["pmm+v"] == pytest.approx(0.1 * np.hypot(210.0, 60.0) * speed, rel=0.01)


RUNS = f'[[source]]\nfiles = "runs.csv"\n{CONSTANTS}rel_sigma = 0.05\n'
GOOD = (
    '[[source.subtract]]\nwhat = "rudder"\nsource = "own balance"\ncolumns = { RY = "Y" }\nat_m = [-31.0, 0.0, 0.0]\n'
)
TABLE = "X_N,Y_N,N_Nm,RY [N]\n1,2,3,0.5\n"


@pytest.mark.parametrize(
    ("subtract", "table", "words"),
    [
        (GOOD.replace("RY =", "RZ ="), TABLE, "no column 'RZ', which [[source.subtract]] names"),
        (GOOD.replace('"Y"', '"U"'), TABLE, "unit 'N' for U"),
        (GOOD.replace('"Y"', '"Z"'), TABLE, "no Z of the total"),
        (GOOD.replace('"Y"', '"Y [kN]"'), TABLE, "declared as 'kN'"),
        (GOOD, TABLE.replace("RY [N]", "RY"), "no unit for Y"),
        (GOOD, TABLE.replace(",0.5", ","), "row 2, column RY [N]: nothing"),
        (GOOD.replace("at_m", "#"), TABLE, "moments about the moment point (N)"),
        (GOOD + 'factor = "all"\n', TABLE, "source.0.subtract.0.factor"),
        (GOOD.replace("what", "who"), TABLE, "source.0.subtract.0"),
        ('[source.columns]\nRY = "K [N m]"\n' + GOOD, TABLE, "in [[source.subtract]] and in [source.columns]"),
    ],
)
def test_what_a_subtraction_does_not_say_is_asked_for(tmp_path, subtract, table, words):
    campaign(tmp_path, RUNS + subtract)
    (tmp_path / "runs.csv").write_text(table)
    with pytest.raises(InputError) as caught:
        read_campaign(tmp_path)
    assert words in str(caught.value)


def test_an_openfoam_case_is_told_to_name_its_patches(tmp_path):
    (tmp_path / "case" / "postProcessing").mkdir(parents=True)
    source = history("case", "rho_inf = 1.0", reduction=STEADY) + GOOD
    with pytest.raises(InputError, match="function object of the patches"):
        read_campaign(campaign(tmp_path, source))
