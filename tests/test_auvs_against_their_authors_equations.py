"""REMUS, NPS AUV II and LAUV: their authors' equations integrated by hand, their misprints, their fins in + and X."""

from __future__ import annotations

import csv
import math
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.boat.coefficients import Coefficients
from sim.boat.forces import slipstream
from sim.boat.mass import Environment
from sim.boat.vehicle import load_vehicle
from sim.flight.case import load_case
from sim.flight.simulate import simulate
from sim.kernel.assemble import assemble
from sim.kernel.layout import workspace
from sim.kernel.rhs import rhs

ROOT = Path(__file__).parents[1]
DATA = Path(__file__).parent / "data" / "published"
AUVS = ("remus100", "remus100-x", "lauv", "nps-auv2")


def coefficients(name: str) -> Coefficients:
    rows = database_rows(identify(read_campaign(ROOT / "raw_captive_data" / name)))
    return Coefficients(load_vehicle(name), rows)


@pytest.fixture(scope="module")
def boats():
    return {name: coefficients(name) for name in AUVS}


def printed(name: str, column: str) -> dict[str, float]:
    """An independent transcription of the source's table."""
    with (DATA / name).open(encoding="utf-8") as stream:
        return {r["coefficient"]: float(r[column]) for r in csv.DictReader(stream)}


def prestero(state, stern, rudder, c):
    """Time derivative of REMUS's state, the equations of Prestero (2001), section 4.6, term by term.

    ``c`` holds the printed coefficients, three corrected; z_g alone is not zero.
    """
    u, v, w, p, q, r, _, _, _, phi, theta, psi = state
    m, zg, weight, lift = c["W"] / 9.81, c["zg"], c["W"], c["B"]
    s, k = math.sin, math.cos
    x = -(weight - lift) * s(theta) + c["Xuu"] * u * abs(u) + (c["Xwq"] - m) * w * q + c["Xqq"] * q * q
    x += (c["Xvr"] + m) * v * r + c["Xrr"] * r * r - m * zg * p * r + c["Xprop"]
    y = (weight - lift) * k(theta) * s(phi) + c["Yvv"] * v * abs(v) + c["Yrr"] * r * abs(r)
    y += (c["Yuv_body"] + c["Yuvf"]) * u * v + (c["Ywp"] + m) * w * p + (c["Yura"] + c["Yurf"] - m) * u * r
    y += -m * zg * q * r + c["Ypq"] * p * q + c["Yuudr"] * u * u * rudder
    z = (weight - lift) * k(theta) * k(phi) + c["Zww"] * w * abs(w) + c["Zqq"] * q * abs(q)
    z += (c["Zuw_body"] + c["Zuwf"]) * u * w + (c["Zuqa"] + c["Zuqf"] + m) * u * q + (c["Zvp"] - m) * v * p
    z += m * zg * (p * p + q * q) + c["Zrp"] * r * p + c["Zuuds"] * u * u * stern
    roll = -zg * weight * k(theta) * s(phi) + c["Kpp"] * p * abs(p) - (c["Izz"] - c["Iyy"]) * q * r
    roll += -m * zg * (w * p - u * r) + c["Kprop"]
    pitch = -zg * weight * s(theta) + c["Mww"] * w * abs(w) + c["Mqq"] * q * abs(q)
    pitch += (c["Muw_body"] + c["Muwf"] + c["Muwa"]) * u * w + (c["Muqa"] + c["Muqf"]) * u * q + c["Mvp"] * v * p
    pitch += (c["Mrp"] - (c["Ixx"] - c["Izz"])) * r * p + m * zg * (v * r - w * q) + c["Muuds"] * u * u * stern
    yaw = c["Nvv"] * v * abs(v) + c["Nrr"] * r * abs(r) + (c["Nuv_body"] + c["Nuvf"] + c["Nuva"]) * u * v
    yaw += (c["Nura"] + c["Nurf"]) * u * r + c["Nwp"] * w * p + (c["Npq"] - (c["Iyy"] - c["Ixx"])) * p * q
    yaw += c["Nuudr"] * u * u * rudder
    mass = np.zeros((6, 6))
    mass[0, 0], mass[0, 4] = m - c["Xudot"], m * zg
    mass[1, 1], mass[1, 3], mass[1, 5] = m - c["Yvdot"], -m * zg, -c["Yrdot"]
    mass[2, 2], mass[2, 4] = m - c["Zwdot"], -c["Zqdot"]
    mass[3, 1], mass[3, 3] = -m * zg, c["Ixx"] - c["Kpdot"]
    mass[4, 0], mass[4, 2], mass[4, 4] = m * zg, -c["Mwdot"], c["Iyy"] - c["Mqdot"]
    mass[5, 1], mass[5, 5] = -c["Nvdot"], c["Izz"] - c["Nrdot"]
    turned = [
        k(psi) * k(theta) * u + (k(psi) * s(theta) * s(phi) - s(psi) * k(phi)) * v
        + (k(psi) * s(theta) * k(phi) + s(psi) * s(phi)) * w,
        s(psi) * k(theta) * u + (s(psi) * s(theta) * s(phi) + k(psi) * k(phi)) * v
        + (s(psi) * s(theta) * k(phi) - k(psi) * s(phi)) * w,
        -s(theta) * u + k(theta) * s(phi) * v + k(theta) * k(phi) * w,
        p + (s(phi) * q + k(phi) * r) * math.tan(theta),
        k(phi) * q - s(phi) * r,
        (s(phi) * q + k(phi) * r) / k(theta),
    ]  # fmt: skip
    return np.concatenate([np.linalg.solve(mass, [x, y, z, roll, pitch, yaw]), turned])


@pytest.mark.parametrize("case_name", ["remus-horizontal", "remus-vertical"])
def test_remus_flies_as_presteros_equations_integrated_by_hand(boats, case_name):
    """To 1e-6 of the largest value of each state; the printed table, read here once more, with three corrections."""
    c = printed("remus_prestero2001_appC.csv", "value_appC") | {"Yvv": -131.0, "Mqq": -94.0}
    case, _ = load_case(case_name)
    case = case.model_copy(update={"run": case.run.model_copy(update={"step_s": 0.0025, "record_s": 0.5})})
    flight = simulate(case, boats["remus100"])
    stern, rudder = -math.radians(case.command.dV.value_deg), -math.radians(case.command.dH.value_deg)
    # 1000 deg/s: 2.5 deg in the first control sample, the rest in the second.
    times, share = [0.0, 0.0025, 0.005], [0.0, 2.5 / 4.0, 1.0]

    def derivative(t, y):
        moved = np.interp(t, times, share)
        return prestero(y, moved * stern, moved * rudder, c)

    start = np.zeros(12)
    start[0], start[8] = 1.54, flight["z"][0]
    found = solve_ivp(
        derivative,
        (0.0, 20.0),
        start,
        "DOP853",
        flight["t"][flight["t"] <= 20.0],
        rtol=1e-11,
        atol=1e-12,
        max_step=0.02,
    )
    for k, name in enumerate(("u", "v", "w", "p", "q", "r", "x", "y", "z", "phi", "theta", "psi")):
        ours = flight[name][: found.t.size]
        scale = np.abs(found.y[k]).max()
        assert np.abs(ours - found.y[k]).max() <= 1e-6 * max(scale, 1e-3), name
    assert abs(found.y[11][-1] if rudder else found.y[10][-1]) > 0.05


def test_misprints_of_remus_are_found_by_the_check_and_stand_corrected(tmp_path):
    folder = tmp_path / "as-printed"
    shutil.copytree(ROOT / "raw_captive_data" / "remus100", folder)
    with (folder / "published.csv").open(encoding="utf-8") as stream:
        rows = [r for r in csv.DictReader(stream) if r["quality"] != "corrected"]
    for row in rows:
        row["exclude"] = row["reason"] = ""
    pd.DataFrame(rows).to_csv(folder / "published.csv", index=False)
    found = [f for f in check_campaign(read_campaign(folder)) if f.check == "revolution"]
    assert {f.columns for f in found} == {("Yv|v|", "Zw|w|"), ("Nr|r|", "Mq|q|")}
    assert not [
        f for f in check_campaign(read_campaign(ROOT / "raw_captive_data" / "remus100")) if f.check == "revolution"
    ]


def test_misprints_of_lauv_are_found_by_the_check_and_stand_corrected(tmp_path, boats):
    folder = tmp_path / "as-printed"
    shutil.copytree(ROOT / "raw_captive_data" / "lauv", folder)
    with (folder / "published.csv").open(encoding="utf-8") as stream:
        rows = [r for r in csv.DictReader(stream) if r["quality"] != "corrected"]
    for row in rows:
        row["exclude"] = row["reason"] = ""
    pd.DataFrame(rows).to_csv(folder / "published.csv", index=False)
    wrong = [f for f in check_campaign(read_campaign(folder)) if f.check == "inertia_sign"]
    assert {f.columns for f in wrong} == {("M_qdot",), ("N_rdot",)}
    value = boats["lauv"].get("M_qdot").values[0]
    assert value == pytest.approx(-0.758 / (0.5 * 1025.0 * 1.08**5), rel=1e-9)


def test_every_printed_coefficient_of_nps_auv_ii_is_a_row_of_its_set(boats):
    """All of the source's terms that symmetry does not make zero, bow planes by two."""
    table = printed("npsauv_healey1993.csv", "value")
    ours = {c.term.name: float(c.values[0]) for c in boats["nps-auv2"]}
    for name, value in table.items():
        if value == 0.0:
            continue
        twice = 2.0 if "db2" in name else 1.0
        assert ours[name[0] + "_" + name[1:].replace("db2", "db")] == pytest.approx(twice * value, rel=1e-9), name
    assert len(table) == 93


def test_propeller_interaction_of_nps_auv_ii(boats):
    """epsilon is zero in self-propulsion at 500 rev/min and 6 ft/s, and stern planes gain with revolutions."""
    assert slipstream(1.8288, 500.0 / 60.0, 1.8288 * 60.0 / 500.0, 1.2) == pytest.approx(0.0, abs=1e-12)
    model = assemble(boats["nps-auv2"], Environment(1025.0, 9.81))
    work = workspace(model)
    loads = []
    for n in (500.0 / 60.0, 1000.0 / 60.0):
        y, dy = np.zeros(12), np.zeros(12)
        y[0] = 1.8288
        rhs(model, y, np.array([0.1, 0.0, 0.0, n]), work, dy)
        loads.append(work.loads[:6].copy())
    ct = 0.008 * (5.3 / 0.3048) ** 2 / 2.0
    eps = -1.0 + (math.sqrt(4.0 * ct + 1.0) - 1.0) / (math.sqrt(ct + 1.0) - 1.0)
    size = 0.5 * 1025.0 * 5.3**2 * 1.8288**2
    assert loads[0][2] / size == pytest.approx(-7.3e-2 * 0.1, rel=1e-9)
    assert loads[1][2] / size == pytest.approx((-7.3e-2 - 1.0e-2 * eps) * 0.1, rel=1e-9)
    assert loads[1][0] / size == pytest.approx(0.00385 * 3.0 + (-1.0e-2 - 1.6e-3 * eps) * 0.01, rel=1e-6)


def test_fins_in_a_plus_and_in_an_x_steer_by_the_same_planes(boats):
    """Four fins at 45 deg deflected together turn sqrt(2) as much as a pair of the + at the same angle."""
    case, _ = load_case("remus-x-horizontal")
    command = case.command.model_copy(
        update={"dH": case.command.dH.model_copy(update={"value_deg": case.command.dH.value_deg / math.sqrt(2.0)})}
    )
    x = simulate(case.model_copy(update={"command": command}), boats["remus100-x"])
    plus = simulate(load_case("remus-horizontal")[0], boats["remus100"])
    # The planes' rates differ by the same factor for some hundredths of a second.
    assert x["psi"][-1] == pytest.approx(plus["psi"][-1], rel=1e-3)
    assert abs(plus["psi"][-1]) > 0.3


@pytest.mark.parametrize("case_name", ["lauv-hzz10", "nps-steer", "nps-dive", "remus-vertical"])
def test_standard_maneuvers_fly_to_their_sense(boats, case_name):
    case, _ = load_case(case_name)
    flight = simulate(case, boats[case.vehicle])
    assert flight["t"][-1] == pytest.approx(case.run.duration_s)
    assert np.isfinite(flight.record).all()
    if case_name == "lauv-hzz10":
        assert len(flight.executes) >= 3
    elif case_name == "nps-steer":
        assert flight["psi"][-1] > 0.5
    else:
        assert flight["z"][-1] > flight["z"][0] + 0.5


def test_hull_rows_of_the_x_are_those_of_the_plus(boats):
    plus = {c.term.name: c.values[0] for c in boats["remus100"] if c.part in ("hull", "propeller")}
    other = {c.term.name: c.values[0] for c in boats["remus100-x"] if c.part in ("hull", "propeller")}
    assert plus == other
