"""Ships in surge, sway and yaw: equations of Yasukawa and Yoshimura (2015) written down once more and integrated."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import ident
from ident.captive.campaign import read_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.boat.catalogue import held, terms
from sim.boat.coefficients import Coefficients
from sim.boat.mass import Environment
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.files.toml_files import bundled
from sim.flight.case import load_case
from sim.flight.simulate import simulate
from sim.kernel import layout, plain
from sim.kernel import rhs as kernel
from sim.kernel.assemble import Assembly, assemble

ROOT = Path(__file__).parents[1]
WATER = Environment(1000.0, 9.81)
# Tables 1 to 3 of the paper, forces over 1/2 rho L d U^2; resistance, place of the propeller and rounded particulars as
# in sim/vehicles/kvlcc2-mmg_errata.csv.
LENGTH, DRAUGHT, MASS, X_G, DIAMETER, HEIGHT, AREA = 7.0, 0.455, 3272.15, 0.245, 0.216, 0.345, 0.053833
HULL = {
    "X": ((0, 0, -0.0162), (2, 0, -0.040), (1, 1, 0.002), (0, 2, 0.011), (4, 0, 0.771)),
    "Y": ((1, 0, -0.315), (0, 1, 0.083), (3, 0, -1.607), (2, 1, 0.379), (1, 2, -0.391), (0, 3, 0.008)),
    "N": ((1, 0, -0.137), (0, 1, -0.049), (3, 0, -0.030), (2, 1, -0.294), (1, 2, 0.055), (0, 3, -0.013)),
}


def forces(u, v, r, delta, n):
    """X, Y, N of hull, propeller and rudder, Eqs. (9)-(24)."""
    speed = math.hypot(u, v)
    beta, sway, yaw = math.atan2(-v, u), v / speed, r * LENGTH / speed
    size = 500.0 * LENGTH * DRAUGHT * speed**2
    x, y, moment = (size * sum(c * sway**i * yaw**j for i, j, c in HULL[k]) for k in "XYN")
    moment *= LENGTH
    beta_p = beta + 0.480 * yaw
    c_2 = 1.6 if beta_p > 0.0 else 1.1
    wake = 1.0 - 0.60 * (1.0 + (1.0 - math.exp(-2.0 * abs(beta_p))) * (c_2 - 1.0))
    advance = u * (1.0 - wake) / (n * DIAMETER)
    k_t = 0.2931 - 0.2753 * advance - 0.1385 * advance**2
    x += (1.0 - 0.220) * 1000.0 * n**2 * DIAMETER**4 * k_t
    eta = DIAMETER / HEIGHT
    jet = 1.0 + 0.50 * (math.sqrt(1.0 + 8.0 * k_t / (math.pi * advance**2)) - 1.0)
    u_r = 1.09 * u * (1.0 - wake) * math.sqrt(eta * jet**2 + 1.0 - eta)
    beta_r = beta + 0.710 * yaw
    v_r = speed * (0.640 if beta_r > 0.0 else 0.395) * beta_r
    normal = 500.0 * AREA * (u_r**2 + v_r**2) * 2.747 * math.sin(delta - math.atan(v_r / u_r))
    x -= (1.0 - 0.387) * normal * math.sin(delta)
    y -= (1.0 + 0.312) * normal * math.cos(delta)
    moment -= (-0.5 + 0.312 * -0.464) * LENGTH * normal * math.cos(delta)
    return x, y, moment


def rate(state, delta, n):
    """Eq. (4): motions of midship."""
    u, v, r, _, _, psi = state
    x, y, moment = forces(u, v, r, delta, n)
    unit = 500.0 * LENGTH**2 * DRAUGHT
    m_x, m_y, j_z, i_z = 0.022 * unit, 0.223 * unit, 0.011 * unit * LENGTH**2, MASS * (0.25 * LENGTH) ** 2
    surge = (x + (MASS + m_y) * v * r + X_G * MASS * r**2) / (MASS + m_x)
    matrix = [[MASS + m_y, X_G * MASS], [X_G * MASS, i_z + X_G**2 * MASS + j_z]]
    sway, yaw = np.linalg.solve(matrix, [y - (MASS + m_x) * u * r, moment - X_G * MASS * u * r])
    return [surge, sway, yaw, u * math.cos(psi) - v * math.sin(psi), u * math.sin(psi) + v * math.cos(psi), r]


@pytest.fixture(scope="module")
def ship():
    rows = database_rows(identify(read_campaign(ROOT / "raw_captive_data" / "kvlcc2-mmg")))
    return Coefficients(load_vehicle("kvlcc2-mmg"), rows)


@pytest.fixture(scope="module")
def turn(ship):
    case, _ = load_case("kvlcc2-mmg-turn35-starboard")
    return case, simulate(case, ship)


def test_the_turning_circle_is_that_of_the_papers_equations(turn):
    """Advance and tactical diameter to 1e-3, whatever integrates them; revolutions of self-propulsion."""
    case, flight = turn
    n = float(flight["n"][0])
    assert forces(case.initial.speed_mps, 0.0, 0.0, 0.0, n)[0] == pytest.approx(0.0, abs=1e-6)
    limit, speed = math.radians(35.0), math.radians(15.8)
    found = solve_ivp(
        lambda t, y: rate(y, min(limit, speed * t), n),
        (0.0, 160.0),
        [case.initial.speed_mps, 0.0, 0.0, 0.0, 0.0, 0.0],
        "DOP853",
        np.linspace(0.0, 160.0, 1601),
        rtol=1e-10,
        atol=1e-12,
        max_step=0.5,
    )
    for angle, place, ours in ((90.0, 3, "x"), (180.0, 4, "y")):
        there = np.interp(np.radians(angle), found.y[5], found.y[place])
        here = np.interp(np.radians(angle), flight["psi"], flight[ours] - flight[ours][0])
        assert here == pytest.approx(there, rel=1e-3)
    assert 2.5 < np.interp(np.pi, flight["psi"], flight["y"]) / LENGTH < 4.0


def test_the_papers_own_turning_circles_and_overshoots_come_out(tmp_path):
    """Tables 4 and 5 of the paper, its calculation at model scale: within 3 %."""
    ident.fit(ROOT / "raw_captive_data" / "kvlcc2-mmg", db=tmp_path / "db")
    off = {}
    for name in sorted(n for n in bundled("cases") if n.startswith("kvlcc2-mmg-")):
        done = ident.validate(name, db=tmp_path / "db")
        for p in done.case.published:
            off[name, p.metric] = abs(done.metrics[p.metric].simulated / p.value - 1.0)
    assert len(off) == 10
    assert max(off.values()) <= 0.03, off


def test_heave_roll_and_pitch_are_held(turn):
    assert held("mmg") == ("Z", "K", "M")
    assert [held(s) for s in ("reduced", "gertler_hagen", "auv", "nps_auv")] == [()] * 4
    for name in ("w", "p", "q", "z", "phi", "theta"):
        assert not np.any(turn[1][name]), name


def test_the_kernel_is_the_plain_reading_of_the_equations(ship):
    model = assemble(ship, WATER)
    rng = np.random.default_rng(5)
    for _ in range(200):
        y, dy = np.zeros(12), np.zeros(12)
        y[:2], y[5] = (rng.uniform(0.3, 1.3), rng.normal() * 0.2), rng.normal() * 0.05
        c = np.array([rng.normal() * 0.3, rng.uniform(5.0, 14.0)])
        work = layout.workspace(model)
        kernel.rhs(model, y, c, work, dy)
        np.testing.assert_allclose(dy, plain.rhs(model, y, c), rtol=1e-10, atol=1e-13)
        expected = forces(y[0], y[1], y[5], c[0], c[1])
        # m_y v r and m_x u r stand on the side of the loads here.
        unit = 500.0 * LENGTH**2 * DRAUGHT
        added = (0.223 * unit * y[1] * y[5], -0.022 * unit * y[0] * y[5], 0.0)
        found = work.loads[[0, 1, 5]]
        np.testing.assert_allclose(found, np.add(expected, added), rtol=1e-9, atol=1e-9)


def test_samples_move_propeller_and_rudder(ship):
    """A draw of the values is the model assembled from them."""
    values = np.concatenate([c.values for c in ship])
    places = np.concatenate([ship.places[c.term.name, c.part] for c in ship])
    drawn = np.empty_like(values)
    drawn[places] = values * np.random.default_rng(1).normal(1.0, 0.05, values.size)
    from_map = Assembly(ship, WATER).model(drawn)
    whole = assemble(ship.with_values(drawn), WATER)
    np.testing.assert_allclose(from_map.ship, whole.ship, rtol=1e-14)
    np.testing.assert_allclose(from_map.inverse_mass, whole.inverse_mass, rtol=1e-12, atol=1e-18)
    own = slice(len(layout.SHIP_TERMS) - 1)
    assert np.all(whole.ship[own] != assemble(ship, WATER).ship[own])


def test_every_number_of_a_ship_in_the_kernel_is_a_row_of_the_term_table():
    rows = {t.name for s in ("mmg", "nps_auv") for t in terms(s) if not t.output}
    assert set(layout.SHIP_TERMS) | {"J_0"} == rows


def test_a_rudder_given_in_part_is_refused(tmp_path):
    folder = tmp_path / "part"
    shutil.copytree(ROOT / "raw_captive_data" / "kvlcc2-mmg", folder)
    table = folder / "propeller_and_rudder.csv"
    table.write_text("\n".join(r for r in table.read_text("utf-8").split("\n") if "kappa" not in r), "utf-8")
    ship = Coefficients(load_vehicle("kvlcc2-mmg"), database_rows(identify(read_campaign(folder))))
    with pytest.raises(InputError, match="kappa"):
        assemble(ship, WATER)


def test_a_ship_in_waves_or_with_heel_is_refused(ship):
    case, _ = load_case("kvlcc2-mmg-turn35-starboard")
    moved = case.model_copy(update={"initial": case.initial.model_copy(update={"heel_deg": 2.0})})
    with pytest.raises(InputError, match="held"):
        simulate(moved, ship)
