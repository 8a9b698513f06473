"""Derivatives from lines alone, against SUBOFF's published ones and closed forms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import ident
from ident.analysis.stability import stability_at
from ident.estimates.predict import predicted
from ident.estimates.roll import edge_drag, natural_frequency
from ident.fitting.fit import given_of
from sim.boat.coefficients import Coefficients
from sim.boat.database import digest, read_rows
from sim.boat.mass import Environment
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.simulate import simulate
from sim.hull.derivatives import derivatives
from sim.hull.lattice import Fin
from sim.hull.slender import Lines, hull_added_mass, hull_derivatives, hull_prior, lines, spheroid

ROOT = Path(__file__).parents[1]
PUBLISHED = {
    "suboff": "published.csv",
    "suboff-hull": "configurations/hull/published.csv",
    "suboff-hull-sail": "configurations/hull-sail/published.csv",
    "suboff-hull-planes": "configurations/hull-planes/published.csv",
    "suboff-hull-ring-wing": "configurations/hull-ring-wing/published.csv",
}
# Gh of Roddy (1990), Table 4.
INDEX = {"hull": -20.38506, "hull-sail": -4.081818, "hull-planes": -3.152048, "hull-ring-wing": -12.43748}
NAMES = ("Y_v", "N_v", "Y_ur", "N_ur", "Z_w", "M_w", "Z_uq", "M_uq")


def _published(name):
    folder = ROOT / "raw_captive_data" / "suboff" / Path(PUBLISHED[name]).parent
    table = pd.concat([pd.read_csv(p) for p in sorted(folder.glob("*.csv"))])
    own = table[table["quality"].eq("published") & table["coefficient"].isin(NAMES)]
    return own.set_index("coefficient")


def test_published_derivatives_of_five_configurations_lie_within_the_stated_errors_at_the_stated_rate():
    scores = []
    for name in PUBLISHED:
        prior = derivatives(load_vehicle(name))
        for term, run in _published(name).iterrows():
            error = np.hypot(prior[term].sigma, run["rel_sigma"] * run["value"])
            scores.append((run["value"] - prior[term].value) / error)
    scores = np.abs(scores)
    assert len(scores) == 24
    # 24 derivatives, of which 68 and 95 % are expected inside; a binomial's two deviations below and above.
    assert 0.49 < np.mean(scores < 1.0) < 0.87
    assert np.mean(scores < 1.96) > 0.86
    assert scores.max() < 2.6


def _spheroid(a, b, n=4001):
    x = np.linspace(a, -a, n)
    area = np.pi * b**2 * (1.0 - (x / a) ** 2)
    return Lines(x, area, 2.0 * np.sqrt(np.pi * area), np.sqrt(area / np.pi))


def test_closed_hull_in_an_ideal_fluid_has_munks_moment_and_no_force():
    hull = _spheroid(10.0, 1.0)
    along, across, _ = spheroid(20.0, 2.0)
    force, moment, by_rotation, damping = hull_derivatives(hull, None)
    assert force == pytest.approx(0.0, abs=1e-9)
    assert moment == pytest.approx(-2.0 * (across - along) * hull.volume, rel=1e-4)
    assert by_rotation == pytest.approx(0.0, abs=1e-9)
    assert damping == pytest.approx(0.0, abs=1e-3)


def test_hull_cut_at_a_station_carries_what_jones_gives_it():
    # A body that ends in a base of area S has the lift of its base: -2 S k in v (Jones 1946, NACA Report 835).
    hull = _spheroid(10.0, 1.0)
    along, across, _ = spheroid(20.0, 2.0)
    at = -5.0
    left = float(np.interp(at, hull.x[::-1], hull.area[::-1]))
    force, _, by_rotation, damping = hull_derivatives(hull, at)
    assert force == pytest.approx(-2.0 * (across - along) * left, rel=2e-3)
    # The base at x moves across with v + x r.
    assert by_rotation == pytest.approx(at * force, rel=2e-3)
    assert damping < 0.0
    value, sigma = hull_prior(hull)
    assert abs(value[0]) < 2.0 * abs(sigma[0])


def test_added_mass_of_a_spheroid_is_lambs():
    # Lamb (1932), art. 114: length over diameter 6.01 has 0.045, 0.918 and 0.764.
    assert spheroid(6.01, 1.0) == pytest.approx((0.045, 0.918, 0.764), abs=2e-3)
    hull = _spheroid(6.01, 1.0)
    known = hull_added_mass(hull)
    along, across, turned = spheroid(12.02, 2.0)
    mass = 4.0 / 3.0 * np.pi * 6.01
    assert known["udot"] == pytest.approx(along * mass, rel=1e-4)
    assert known["vdot"] == pytest.approx(across * mass, rel=1e-4)
    # Sections alone have x^2, not x^2 + z^2, of their mass.
    assert known["rdot"] == pytest.approx(turned * mass * 6.01**2 / 5.0, rel=1e-3)
    assert known["vr"] == pytest.approx(0.0, abs=1e-6)


def test_lines_of_suboff_have_its_volume():
    # 0.718 m^3 with all appendages; the hull alone has 0.699 (Groves, Huang and Chang 1989).
    assert lines(load_vehicle("suboff-hull")).volume == pytest.approx(0.699, rel=0.01)


def _campaign(folder, vehicle):
    text = (ROOT / "raw_captive_data/suboff/configurations/hull/campaign.toml").read_text(encoding="utf-8")
    text = text.replace('vehicle = "suboff-hull"', f'vehicle = "{vehicle}"').replace('complete_from = "lines"', "")
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    return folder


def test_a_campaign_without_runs_starts_from_the_lines_and_a_run_takes_their_place(tmp_path):
    folder, db = _campaign(tmp_path, "suboff-hull"), str(tmp_path / "db")
    (done,) = ident.fit(folder, db=db)
    prior = derivatives(load_vehicle("suboff-hull"))
    rows = read_rows(db, None, "suboff-hull")[0].set_index("coefficient")
    assert set(rows["origin"]) == {"estimated"}
    for name in NAMES:
        assert rows.loc[name, "value"] == pytest.approx(prior[name].value, rel=1e-9)
        assert rows.loc[name, "stderr"] == pytest.approx(prior[name].sigma, rel=1e-6)
    assert done.estimates[0].applied
    header = "run_id,test,part,U_mps,alpha_deg,beta_deg,D0_m,Y_N,N_Nm,rel_sigma,quality,source\n"
    text = "".join(
        f"d{b},drift_horizontal,hull,3,0,{b},5,{-500.0 * np.sin(np.radians(b)):.6g},"
        f"{-3000.0 * np.sin(np.radians(b)):.6g},0.05,published,made\n"
        for b in (-8, -4, 0, 4, 8)
    )
    (folder / "drift.csv").write_text(header + text, encoding="utf-8")
    (again,) = ident.fit(folder, db=db)
    rows = read_rows(db, again.version, "suboff-hull")[0]
    assert set(rows.loc[rows["coefficient"].isin(["Y_v", "N_v"]), "origin"]) == {"measured"}
    assert set(rows.loc[rows["coefficient"].isin(["Z_w", "M_w", "N_ur"]), "origin"]) == {"estimated"}


def test_without_runs_and_without_lines_nothing_is_fitted(tmp_path):
    vehicle = (ROOT / "sim/vehicles/suboff-hull.toml").read_text(encoding="utf-8")
    (tmp_path / "boat.toml").write_text(re.sub(r"(?m)^geometry = .*$", "", vehicle), encoding="utf-8")
    with pytest.raises(InputError, match="geometry file"):
        ident.fit(_campaign(tmp_path, "boat.toml"), db=str(tmp_path / "db"))
    with pytest.raises(InputError, match="identify nothing"):
        ident.fit(_campaign(tmp_path, "suboff-hull"), db=str(tmp_path / "db"), measured_only=True)


@pytest.mark.parametrize("name", [n for n in PUBLISHED if n != "suboff"])
def test_a_configuration_that_is_completed_from_its_lines_is_stable_as_printed_and_flies(name, tmp_path):
    """Published values stay; the vertical plane of a body of revolution is its horizontal one, and it coasts."""
    configuration = name.removeprefix("suboff-")
    (done,) = ident.fit(ROOT / "raw_captive_data/suboff/configurations" / configuration, db=str(tmp_path / "db"))
    rows, printed = done.rows.set_index("coefficient"), _published(name)["value"]
    assert rows.loc[printed.index, "value"].tolist() == printed.tolist()
    assert {"Z_w", "M_w", "Z_uq", "M_uq", "Y_vdot", "N_rdot", "X_uu"} <= set(rows.index[rows["origin"].eq("estimated")])
    coefficients = Coefficients(load_vehicle(name), done.rows)
    case, _ = load_case(f"{name}-coast")
    found = stability_at(coefficients, Environment(1000.0, 9.81), case.initial.speed_mps, case.initial.depth_m)
    # Its mass follows from the printed index; what is estimated does not enter.
    assert found.g_horizontal == pytest.approx(INDEX[configuration], rel=5e-5)
    assert found.g_vertical < 0.0
    flight = simulate(case, coefficients)
    speed = np.sqrt(flight["u"] ** 2 + flight["v"] ** 2 + flight["w"] ** 2)
    assert np.isfinite(speed).all()
    # Nothing drives it; without fins at the stern it turns broadside.
    assert 0.0 < speed[-1] < case.initial.speed_mps
    assert (np.abs(np.arctan2(np.hypot(flight["v"], flight["w"]), flight["u"])).max() > 1.0) == ("planes" not in name)


def test_published_sets_stay_as_their_authors_give_them(tmp_path):
    folder = ROOT / "raw_captive_data/suboff"
    (done,) = ident.fit(folder, db=str(tmp_path / "db"))
    (bare,) = ident.fit(folder, db=str(tmp_path / "bare"), measured_only=True)
    assert digest(done.rows) == digest(bare.rows)


def test_speeds_in_knots_taken_for_metres_a_second_are_named(tmp_path):
    source = ROOT / "raw_captive_data/bb2"
    for path in source.iterdir():
        if path.suffix == ".csv" and path.name.startswith("drift"):
            table = pd.read_csv(path, dtype=str)
            table["U_mps"] = [repr(float(u) / (1852.0 / 3600.0)) for u in table["U_mps"]]
            table.to_csv(tmp_path / path.name, index=False)
    text = (source / "campaign.toml").read_text(encoding="utf-8")
    text = text.replace('parts = ["hull"]\n', "")
    (tmp_path / "campaign.toml").write_text(text, encoding="utf-8")
    (checked,) = ident.check(tmp_path)
    own = [f for f in checked.findings if f.check == "lines"]
    assert [f.severity for f in own] == ["error"]
    assert "knots" in own[0].what


def test_drag_of_edges_is_grahams_and_grows_as_the_square_root_of_small_swings():
    strip = Fin(((9.99, 0.0, 1.0), (10.0, 0.0, 1.0), (10.01, 0.0, 1.0)), 0.0)
    assert edge_drag([strip], 0.1) / 0.02 == pytest.approx(4.0 * (2.0 * np.pi) ** (-1.0 / 3.0) * 1000.0, rel=1e-3)
    assert edge_drag([strip], 0.0125) / edge_drag([strip], 0.1) == pytest.approx(2.0, rel=1e-9)


def test_roll_of_bb2_is_damped_more_in_oscillation_than_in_steady_runs(campaign, rows):
    from ident.estimates.draft import Draft

    # Measured roll period 12.7 s (Overpelt et al. 2015).
    assert 2.0 * np.pi / natural_frequency(Draft.of(campaign.vehicle, rows)) == pytest.approx(12.7, rel=0.05)
    found, _ = predicted(campaign.vehicle, rows, given_of(campaign))
    new = found[(found["coefficient"] == "K_p|p|") & (found["origin"] == "estimated")]
    steady = rows[(rows["coefficient"] == "K_p|p|")]
    last = steady.loc[steady["p_radps"].abs().idxmax(), "value"]
    assert (new["value"] < last).all()
    assert new["stderr"].gt(0.1 * new["value"].abs()).all()
