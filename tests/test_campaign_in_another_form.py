"""Authority: invariants. The bundled campaign in another frame, hand, unit system, scale, moment
point, sign of drift and normalisation, all at once, gives the same coefficients; half models,
tare and model inertia by closed forms.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from made_campaigns import campaign
from rewritten_campaigns import (
    BB2,
    assert_same,
    frame_text,
    header,
    in_units,
    moved,
    number,
    rewritten,
    scaled,
    text,
    turned,
)

from ident.captive.campaign import read_campaign
from sim.files.errors import InputError
from sim.files.frames import Frame, FrameError


@pytest.fixture(scope="module")
def tables():
    return {p.name: pd.read_csv(p, dtype=str, keep_default_na=False) for p in sorted(BB2.glob("*.csv"))}


@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize(("x", "y", "z"), [("forward", "starboard", "up"), ("aft", "port", "up")])
def test_a_left_handed_frame_gives_the_same_coefficients(tables, rows, tmp_path, x, y, z, hand):
    signs = {"x": -1 if x == "forward" else 1, "y": -1 if y == "port" else 1, "z": -1 if z == "down" else 1}
    head = frame_text(x, y, z, "right-hand" if hand > 0 else "left-hand")
    assert_same(rewritten(tmp_path / "c", turned(tables, signs, hand), head), rows, 1e-12)


def test_the_ship_sign_of_drift_gives_the_same_coefficients(tables, rows, tmp_path):
    other = {n: t.copy() for n, t in tables.items()}
    for table in other.values():
        if "beta_deg" in table:
            table["beta_deg"] = text(-number(table["beta_deg"]))
    head = frame_text("aft", "starboard", "up", "right-hand", "ittc")
    assert_same(rewritten(tmp_path / "c", other, head), rows, 1e-12)


def test_everything_at_once_gives_the_same_coefficients_to_1e_9(tables, rows, tmp_path):
    """Model scale, a left-handed frame, another moment point, feet and pounds, ITTC drift."""
    ratio, point = 18.348, (0.21, -0.05, 0.13)
    signs = {"x": -1, "y": 1, "z": 1}
    other = moved(turned(scaled(tables, ratio), signs, -1), point, 1)
    for table in other.values():
        if "beta_deg" in table:
            table["beta_deg"] = text(-number(table["beta_deg"]))
    head = frame_text("forward", "starboard", "up", "left-hand", "ittc")
    head = head.replace("ratio = 1.0", f"ratio = {ratio}").replace("length_m = 70.2", f"length_m = {70.2 / ratio}")
    for axis, value in zip("xyz", point, strict=True):
        head = head.replace(f"{axis}_m = 0.0", f"{axis}_m = {value}")
    assert_same(rewritten(tmp_path / "c", in_units(other), head), rows, 1e-9)


@pytest.mark.parametrize("name", ["half_rho_L2", "half_rho_Ld"])
def test_dimensionless_loads_give_the_same_coefficients(tables, rows, tmp_path, name):
    """Primes by hand: forces by 1/2 rho U^2 L^2 or L d, moments by one length more."""
    length, depth = 70.2, 9.6
    area = length * (length if name == "half_rho_L2" else depth)
    other, primed = {}, []
    for file, table in tables.items():
        other[file] = table = table.copy()
        speed = number(table["U_mps"]) if "U_mps" in table else pd.Series(0.0, index=table.index)
        if not (speed > 0).all() or file == "acceleration.csv":
            continue
        names = {}
        for load in "XYZKMN":
            column = f"{load}_N" if load in "XYZ" else f"{load}_Nm"
            if column in table:
                scale = 0.5 * 1025.0 * speed**2 * area * (1.0 if load in "XYZ" else length)
                table[column] = text(number(table[column]) / scale)
                names[column] = f"{load}'"
        for rate in "pqr":
            if f"{rate}_radps" in table:
                table[f"{rate}_radps"] = text(number(table[f"{rate}_radps"]) * length / speed)
                names[f"{rate}_radps"] = f"{rate} [-]"
        other[file] = table.rename(columns=names)
        primed += [file] if names else []
    assert len(primed) > 4
    plain = [f for f in other if f not in primed]
    sources = "".join(f'[[source]]\nfiles = "{f}"\nnormalisation = "{name}"\n' for f in primed)
    sources += "".join(f'[[source]]\nfiles = "{f}"\n' for f in plain)
    head = header().replace("length_m = 70.2", f"length_m = 70.2\ndraught_m = {depth}") + sources
    got = rewritten(tmp_path / "c", other, head)
    key = ["coefficient", "part", "origin", "speed_mps", "alpha_deg", "beta_deg", "delta_deg", "depth_m", "q_radps"]
    assert_same(got.sort_values(key, ignore_index=True), rows.sort_values(key, ignore_index=True), 1e-9)


def test_left_handed_without_a_hand_is_refused():
    with pytest.raises(FrameError, match="by which hand"):
        Frame("forward", "starboard", "up")
    with pytest.raises(FrameError, match="left-hand"):
        Frame("forward", "starboard", "up", "both")
    assert Frame("forward", "starboard", "up", "left-hand").sign("N") == 1
    assert Frame("forward", "starboard", "up", "right-hand").sign("N") == -1
    assert Frame("forward", "starboard", "up", "left-hand").sign("Y") == 1


# -- closed forms ----------------------------------------------------------------------------

STATE = "run_id,test,part,quality,source,U_mps,alpha_deg,beta_deg,D0_m,rel_sigma"


def one(
    folder, columns: str, values: str, state: str = "a,rotating_arm,hull,ok,tank,2,0,0,25,0.1", sources="", **tables
):
    campaign(folder, sources, **tables)
    (folder / "runs.csv").write_text(f"{STATE},{columns}\n{state},{values}\n")
    return read_campaign(folder).runs.iloc[0]


def test_rotating_arm_of_a_model_in_air_measures_nothing(tmp_path):
    """Loads of a rigid body alone, by hand for u, q, r and G off the axis: all six become zero."""
    m, (x, z), (ixx, iyy, izz, izx) = 50.0, (0.3, 0.1), (2.0, 30.0, 31.0, 0.4)
    u, q, r = 2.0, 0.2, 0.3
    a = np.cross([0, q, r], [u, 0, 0]) + np.cross([0, q, r], np.cross([0, q, r], [x, 0, z]))
    tensor = np.array([[ixx, 0, -izx], [0, iyy, 0], [-izx, 0, izz]])
    force = -m * a
    moment = -(np.cross([0, q, r], tensor @ [0, q, r]) + np.cross([x, 0, z], m * a))
    inertia = (
        f"model_inertia_in_loads = true\nmass_kg = {m}\ncentre_of_gravity_m = [{x}, 0.0, {z}]\n"
        f'tensor_kgm2 = [{ixx}, {iyy}, {izz}, 0.0, 0.0, {izx}]\nsource = "weighed"'
    )
    values = ",".join(repr(float(v)) for v in (q, r, *force, *moment))
    run = one(tmp_path, "q_radps,r_radps,X_N,Y_N,Z_N,K_Nm,M_Nm,N_Nm", values, inertia=inertia)
    np.testing.assert_allclose(run[list("XYZKMN")].astype(float), 0.0, atol=1e-12)


def test_model_inertia_needs_all_its_numbers_and_only_where_it_is_in_the_loads(tmp_path):
    for text_, word in (
        ("model_inertia_in_loads = true\nmass_kg = 50.0", "tensor_kgm2"),
        ("model_inertia_in_loads = false\nmass_kg = 50.0", "nothing is taken off"),
    ):
        with pytest.raises(InputError, match=word):
            one(tmp_path, "X_N", "1", inertia=text_)


def test_tare_and_strut_are_taken_off_in_the_campaigns_frame(tmp_path):
    tare = (
        '[[tare]]\nwhat = "zero reading"\nsource = "log"\nloads = { X = "0.5 kN", N = "-20 N*m" }\n'
        '[[tare]]\nwhat = "strut"\nsource = "towed alone"\nper_speed_squared = { X = 30.0 }\n'
    )
    frame = 'x = "aft"\ny = "starboard"\nz = "up"\nangles = "flight"'
    run = one(tmp_path, "X_N,Y_N,N_Nm", "1000,5,100", sources=tare, frame=frame)
    assert run["X"] == pytest.approx(-(1000.0 - 500.0 - 30.0 * 4.0))
    assert run["Y"] == 5.0
    assert run["N"] == pytest.approx(-120.0)
    other = '[[tare]]\nwhat = "other"\nsource = "log"\nloads = { Y = "9 N" }\ntests = ["towing"]\n'
    with pytest.raises(InputError, match=r"tare\.0\.loads: no run it applies to measures Y"):
        one(tmp_path, "X_N,Y_N", "1000,5", sources=other)
    with pytest.raises(InputError, match=r"tare\.0\.tests: 'tow'"):
        one(tmp_path, "X_N", "1000", sources=other.replace('"towing"', '"tow"'))
    with pytest.raises(InputError, match=r"tare\.0\.loads"):
        one(tmp_path, "X_N", "1000", sources=tare.replace("0.5 kN", "0.5 m"))


def test_half_models_are_doubled(tmp_path):
    half = 'plane = "port_starboard"\nsource = "half body on the wall"'
    run = one(tmp_path, "X_N,Y_N,Z_N,K_Nm,M_Nm,N_Nm", "1,2,3,4,5,6", half_model=half)
    assert run[["X", "Z", "M"]].tolist() == [2.0, 6.0, 10.0]
    assert run[["Y", "K", "N"]].isna().all()
    assert run["s_Z"] == pytest.approx(2.0 * 0.1 * 3.0)
    with pytest.raises(InputError, match=r"column beta"):
        one(tmp_path, "X_N", "1", "a,rotating_arm,hull,ok,tank,2,0,3,25,0.1", half_model=half)
    upper = half.replace("port_starboard", "upper_lower")
    run = one(tmp_path, "X_N,Y_N,N_Nm", "1,2,6", "a,rotating_arm,hull,ok,tank,2,0,3,25,0.1", half_model=upper)
    assert run[["X", "Y", "N"]].tolist() == [2.0, 4.0, 12.0]


def test_dimensionless_input_needs_a_speed_and_a_draught(tmp_path):
    source = '[[source]]\nfiles = "runs.csv"\nnormalisation = "half_rho_Ld"\n'
    with pytest.raises(InputError, match="draught"):
        one(tmp_path, "X'", "1", sources=source)
    with pytest.raises(InputError, match="column U"):
        one(tmp_path, "X'", "1", "a,pure_rotation,hull,ok,tank,0,,,25,0.1", sources=source.replace("Ld", "L2"))
    with pytest.raises(InputError, match="half_rho_L2, half_rho_Ld"):
        one(tmp_path, "X'", "1", sources=source.replace("half_rho_Ld", "mine"))
