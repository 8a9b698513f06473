"""SUBOFF through the whole chain, against Roddy (1990), DTRC/SHD-1298-08, Table 4."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from ident.analysis.derivatives import checks
from ident.analysis.stability import stability_at
from ident.captive.campaign import read_campaign
from ident.cli import main
from ident.database.store import commit, database_rows
from ident.fitting.fit import fit
from ident.identification.identify import identify
from ident.report.page import write_report
from sim.boat.coefficients import Coefficients
from sim.boat.database import own_version, read_rows
from sim.boat.mass import Environment
from sim.boat.vehicle import load_vehicle
from sim.files.errors import InputError
from sim.flight.case import load_case
from sim.flight.simulate import simulate

ROOT = Path(__file__).parents[1]
SUBOFF = ROOT / "raw_captive_data" / "suboff"
TABLE = Path(__file__).parent / "data" / "published" / "suboff_roddy1990_table4.csv"
WATER = Environment(1000.0, 9.81)
SPEED, DEPTH = 3.34389, 10.0
# Published indices; the project's data do not contain them.
GV, GH = -1.162874, -0.443297
CONFIGURATIONS = {"hull": -20.38506, "hull-sail": -4.081818, "hull-planes": -3.152048, "hull-ring-wing": -12.43748}
# Symbol of the table -> term.
TERMS = {"Yr": "Y_ur", "Nr": "N_ur", "Zq": "Z_uq", "Mq": "M_uq", "Zds": "Z_deltas", "Mds": "M_deltas"}


def _rows(folder):
    return database_rows(identify(read_campaign(folder)))


@pytest.fixture(scope="module")
def rows():
    return _rows(SUBOFF)


@pytest.fixture(scope="module")
def coefficients(rows):
    return Coefficients(load_vehicle("suboff"), rows)


@pytest.fixture(scope="module")
def printed():
    """The project's transcription: term -> value."""
    with (SUBOFF / "published.csv").open(encoding="utf-8") as stream:
        found = {r["coefficient"]: float(r["value"]) for r in csv.DictReader(stream)}
    for name in ("by_panels.csv", "by_axisymmetry.csv"):
        with (SUBOFF / name).open(encoding="utf-8") as stream:
            found |= {r["coefficient"]: float(r["value"]) for r in csv.DictReader(stream)}
    return found


# -- the numbers -----------------------------------------------------------------------------


@pytest.mark.parametrize("folder", ["", *CONFIGURATIONS])
def test_values_and_errors_are_those_of_the_table(folder):
    """Every published row of every configuration, against an independent transcription."""
    table = pd.read_csv(TABLE)
    appendages = {
        "": "hull+sail+4 stern planes+ring wing 1",
        "hull": "bare hull",
        "hull-sail": "hull+sail",
        "hull-planes": "hull+4 stern planes",
        "hull-ring-wing": "hull+ring wing 1",
    }[folder]
    wanted = table[(table["appendages"] == appendages) & (table["derivative"] != "G")]
    found = _rows(SUBOFF / "configurations" / folder if folder else SUBOFF)
    found = found[found["quality"].isin(["published", "no_error_quoted"])].set_index("coefficient")
    assert len(found) == len(wanted) >= 4
    for _, row in wanted.iterrows():
        name = TERMS.get(row["derivative"], row["derivative"][0] + "_" + row["derivative"][1:])
        assert found.loc[name, "value"] == row["value"], name
        if np.isfinite(row["quoted_rel_uncertainty"]):
            assert found.loc[name, "stderr"] == pytest.approx(row["quoted_rel_uncertainty"] * abs(row["value"]))
        assert found.loc[name, "origin"] == "published"


def test_rudders_are_the_stern_planes_turned(printed):
    # A turn about x: v, w -> -w, v. Rudders push to starboard where stern planes lift.
    for horizontal, vertical, sign in (("Y_deltar", "Z_deltas", -1), ("N_deltar", "M_deltas", 1)):
        assert printed[horizontal] == sign * printed[vertical], horizontal


def test_neighbour_in_the_sign_checks_is_this_boat(printed):
    compared = [one for one in checks() if one.suboff is not None]
    assert len(compared) >= 8
    for check in compared:
        output, motion = check.symbol.split("_")
        name = f"{output}_u{motion}" if motion in "qr" else check.symbol
        assert check.suboff == printed[name], name


def test_report_shows_the_published_derivatives_as_its_own(both, tmp_path):
    """Slopes of the assembled model, beside the print: the ratio is one."""
    page = Path(write_report(both, None, tmp_path, "suboff").file).read_text("utf-8")
    assert page.count("given by the source as a coefficient, not by runs") == 26
    assert page.count("\N{MINUS SIGN}0.027834") >= 3
    # The errata are of BB2's thesis: another boat's page has none.
    assert "Kim" not in page
    assert 'id="errata"' not in page


# -- stability -------------------------------------------------------------------------------


def test_indices_of_the_appended_model_through_the_chain(coefficients, printed):
    """Database to stability: the closed form to 4 digits, the print to its rounding."""
    found = stability_at(coefficients, WATER, SPEED, DEPTH)
    mass, k = 0.018333, printed
    vertical = 1.0 - k["M_w"] * (k["Z_uq"] + mass) / (k["Z_w"] * k["M_uq"])
    horizontal = 1.0 - k["N_v"] * (k["Y_ur"] - mass) / (k["Y_v"] * k["N_ur"])
    assert found.g_vertical == pytest.approx(vertical, rel=5e-5)
    assert found.g_horizontal == pytest.approx(horizontal, rel=5e-5)
    # Half a unit of the sixth decimal of each derivative.
    for value, published, row in (
        (found.g_vertical, GV, ("M_w", "Z_w", "M_uq")),
        (found.g_horizontal, GH, ("N_v", "Y_v", "N_ur")),
    ):
        rounding = abs(1.0 - published) * sum(0.5e-6 / abs(k[name]) for name in row)
        assert value == pytest.approx(published, abs=rounding)


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_index_of_each_configuration_through_the_chain(name):
    """The mass of these comes from the index itself, so this tests the chain, not the data."""
    vehicle = load_vehicle(f"suboff-{name}")
    found = stability_at(Coefficients(vehicle, _rows(SUBOFF / "configurations" / name)), WATER, SPEED, DEPTH)
    assert found.g_horizontal == pytest.approx(CONFIGURATIONS[name], rel=5e-5)
    # Nothing vertical and no added mass is published: no number is made up for them.
    assert found.g_vertical is None
    assert found.neutral_point_vertical is None
    assert found.vertical == found.horizontal == []
    json.dumps(found.g_vertical, allow_nan=False)


def _closed_form(printed, vehicle, speed):
    """Eigenvalues of the linear heave-pitch and sway-yaw motions, from the derivatives alone."""
    k, length = printed, vehicle.particulars.length.value
    mass = vehicle.particulars.mass.value / (500.0 * length**3)
    inertia = mass * (vehicle.particulars.radius_of_gyration.value[1] / length) ** 2
    bg = -vehicle.particulars.centre_of_buoyancy.value[2] / length
    stiffness = mass * 9.81 * length / speed**2 * bg
    heave = np.array([[mass - k["Z_wdot"], -k["Z_qdot"], 0.0], [-k["M_wdot"], inertia - k["M_qdot"], 0.0], [0, 0, 1]])
    slope = np.array([[k["Z_w"], k["Z_uq"] + mass, 0.0], [k["M_w"], k["M_uq"], -stiffness], [0.0, 1.0, 0.0]])
    sway = np.array([[mass - k["Y_vdot"], -k["Y_rdot"]], [-k["N_vdot"], inertia - k["N_rdot"]]])
    turn = np.array([[k["Y_v"], k["Y_ur"] - mass], [k["N_v"], k["N_ur"]]])
    vertical, horizontal = (np.linalg.eigvals(np.linalg.solve(a, b)) for a, b in ((heave, slope), (sway, turn)))
    return vertical * speed / length, horizontal * speed / length


@pytest.mark.parametrize("speed", [1.0, SPEED])
def test_eigenvalues_are_the_closed_form_to_four_digits(coefficients, printed, speed):
    found = stability_at(coefficients, WATER, speed, DEPTH)
    for values, wanted in zip((found.vertical, found.horizontal), _closed_form(printed, coefficients.vehicle, speed)):
        roots = np.array([complex(*v) for v in values])
        for root in wanted:
            assert np.abs(roots - root).min() < 1e-4 * abs(root), (root, roots)


def test_without_stand_ins_the_speed_is_held_and_the_roots_stay(tmp_path, coefficients):
    folder = tmp_path / "suboff"
    shutil.copytree(SUBOFF, folder, ignore=shutil.ignore_patterns("estimates.csv", "stand_in*", "configurations"))
    bare = stability_at(Coefficients(load_vehicle("suboff"), _rows(folder)), WATER, SPEED, DEPTH)
    full = stability_at(coefficients, WATER, SPEED, DEPTH)
    assert (bare.about, full.about) == ("speed held", "self-propulsion")
    assert bare.g_vertical == pytest.approx(full.g_vertical, rel=1e-4)
    assert bare.vertical[0] == pytest.approx(full.vertical[0], rel=1e-4)
    assert bare.horizontal[0] == pytest.approx(full.horizontal[0], rel=1e-4)


# -- maneuvers -------------------------------------------------------------------------------


@pytest.mark.parametrize(("case", "angle", "first"), [("suboff-hzz10", "psi", -1.0), ("suboff-vzz10", "theta", 1.0)])
def test_zigzags_reverse_at_the_check_angle_and_stay_in_their_plane(coefficients, case, angle, first):
    flown = simulate(load_case(case)[0], coefficients)
    assert len(flown.executes) >= 4
    assert np.sign(flown.executes[:4, 1]) == pytest.approx(first * np.array([1.0, -1.0, 1.0, -1.0]))
    for i, (time, _) in enumerate(flown.executes[1:4]):
        assert np.interp(time, flown["t"], flown[angle]) == pytest.approx(
            first * (-1) ** i * np.radians(10.0), abs=np.radians(0.3)
        )
    still = ("theta", "phi", "w", "q") if angle == "psi" else ("psi", "phi", "v", "r")
    assert max(np.abs(flown[name]).max() for name in still) < 1e-9
    assert flown["t"][-1] == pytest.approx(40.0)


def test_steady_turn_balances_sway_and_yaw(coefficients, printed):
    """At the end of the turn the published derivatives, drag and rudder cancel by hand."""
    flown = simulate(load_case("suboff-turn20")[0], coefficients)
    length, k = 4.2609, printed | {"Y_vv": -0.083, "N_rr": -0.0027}
    u, v, r = (flown[c][-1] for c in "uvr")
    assert r > 0.0
    # A controller holds the speed, through the water or ahead.
    assert min(abs(flown["U"][-1] - SPEED), abs(u - SPEED)) < 1e-3 * SPEED
    rudder = flown["rudders"][-1]
    assert rudder == pytest.approx(np.radians(-20.0))
    scale = 500.0 * length**2
    mass = coefficients.vehicle.particulars.mass.value
    side = [k["Y_v"] * u * v, k["Y_ur"] * length * u * r, k["Y_vv"] * v * abs(v), k["Y_deltar"] * u**2 * rudder]
    yaw = [k["N_v"] * u * v, k["N_ur"] * length * u * r, k["N_deltar"] * u**2 * rudder]
    yaw.append(k["N_rr"] * length**2 * r * abs(r))
    assert sum(side) * scale == pytest.approx(mass * u * r, rel=1e-4)
    assert abs(sum(yaw)) < 1e-4 * max(map(abs, yaw))


# -- beside another vehicle ------------------------------------------------------------------


@pytest.fixture(scope="module")
def both(tmp_path_factory, rows, identification):
    """A database with BB2 and then SUBOFF."""
    db = str(tmp_path_factory.mktemp("both") / "coeff_db")
    first, _ = commit(db, database_rows(identification), {"message": "bb2"})
    second, _ = commit(db, rows, {"message": "suboff"})
    assert (first, second) == (0, 1)
    return db


def test_a_version_of_one_vehicle_keeps_the_rows_of_the_other(both, identification, rows):
    for vehicle, wanted in (("bb2", database_rows(identification)), ("suboff", rows)):
        assert len(read_rows(both, 1, vehicle)[0]) == len(wanted)
    assert own_version(both, "bb2", 1).number == 0
    assert own_version(both, "suboff", 1).number == 1
    assert commit(both, database_rows(identification), {}) == (1, False)


def test_defaults_of_the_commands_still_find_bb2(both, tmp_path):
    run = CliRunner()
    found = run.invoke(main, ["stability", "--db", both, "--speed", "5", "--depth", "25", "--json", "-"])
    assert found.exit_code == 0, found.output
    assert json.loads(found.output)[0]["g_horizontal"] > 0.0
    options = ["validate", "--case", "roll-decay", "--db", both, "--out", str(tmp_path), "--json", "-"]
    result = json.loads(run.invoke(main, options).output)
    # BB2's rows are those of its own commit, whatever came after it.
    assert result["database"]["version"] == 0
    assert result["database"]["digest"] == own_version(both, "bb2", 1).digest


def test_stability_command_on_suboff(both):
    found = CliRunner().invoke(main, ["stability", "--db", both, "--case", "suboff-hzz10", "--json", "-"])
    assert found.exit_code == 0, found.output
    assert json.loads(found.output)[0]["g_horizontal"] == pytest.approx(GH, abs=2e-4)


# -- published derivatives as input ----------------------------------------------------------


def _campaign(tmp_path, edit=lambda text: text, table=lambda text: text):
    folder = tmp_path / "campaign"
    folder.mkdir()
    (folder / "campaign.toml").write_text(edit((SUBOFF / "campaign.toml").read_text("utf-8")), "utf-8")
    (folder / "rows.csv").write_text(table((SUBOFF / "published.csv").read_text("utf-8")), "utf-8")
    return folder


def test_another_frame_and_reference_length_give_the_same_coefficients(tmp_path):
    """y port, z up and primes on L = 4 m, against the original."""
    # Z and w change sign, M and w too; plane deflections are about the plane's own axis.
    turned = dict.fromkeys(("Z_w", "M_w", "Z_uq", "M_uq", "Z_wdot", "M_wdot", "Z_qdot", "M_qdot"), 1)
    turned |= {"Z_deltas": -1, "M_deltas": -1, "Y_v": 1, "N_v": 1, "Y_ur": 1, "N_ur": 1}
    power = {"Z_w": 2, "Y_v": 2, "Z_deltas": 2, "M_uq": 4, "N_ur": 4, "M_wdot": 4, "Z_qdot": 4, "M_qdot": 5}

    def rewrite(text):
        lines = list(csv.DictReader(text.splitlines()))
        for line in lines:
            name = line["coefficient"]
            value = float(line["value"]) * turned[name] * (4.2609 / 4.0) ** power.get(name, 3)
            line["value"] = repr(value)
        return pd.DataFrame(lines).to_csv(index=False)

    def edit(text):
        text = text.replace('y = "starboard"', 'y = "port"').replace('z = "down"', 'z = "up"')
        return text.replace("length_m = 4.2609", "length_m = 4.0")

    found = _rows(_campaign(tmp_path, edit, rewrite)).set_index("coefficient")["value"]
    wanted = _rows(SUBOFF).set_index("coefficient")["value"]
    assert len(found) == len(turned)
    for name in turned:
        assert found[name] == pytest.approx(wanted[name], rel=1e-9), name


def test_turned_signs_are_those_of_a_turned_load():
    """The load of a turned motion with the turned coefficient is the turned load."""
    from ident.captive.published import turn_sign
    from sim.boat.catalogue import PLANE_FEATURES, terms
    from sim.boat.forces import boat_features, multiplier
    from sim.files.frames import Frame

    frame, rng = Frame("forward", "port", "up"), np.random.default_rng(1)
    velocity, rates = rng.normal(size=3), rng.normal(size=3)
    here = boat_features(velocity, rates, 10.0)
    there = boat_features(
        [v * frame.sign(k) for k, v in zip("uvw", velocity)], [v * frame.sign(k) for k, v in zip("pqr", rates)], 10.0
    )
    rows = [t for t in terms("gertler_hagen") if not t.is_acceleration and t.norm == "rho/2 L"]
    rows = [t for t in rows if not set(t.factors) & set(PLANE_FEATURES)]
    assert len(rows) > 60
    for row in rows:
        load = multiplier(row, here)
        assert turn_sign(row, frame) * multiplier(row, there) == pytest.approx(frame.sign(row.output) * load), row.name


REFUSED = {
    "unknown coefficient": ("R90-Zw,published_derivative,hull,Z_w", "R90-Zw,published_derivative,hull,Z_q", "'Z_q'"),
    "wrong part": ("R90-Zw,published_derivative,hull", "R90-Zw,published_derivative,rudders", "'rudders'"),
    "no coefficient": ("hull,Z_w", "hull,", "column coefficient"),
    "not finite": ("-0.013910", "inf", "column value"),
    "no value": ("-0.013910", "", "column value"),
    "tabulated": ("R90-Zw,published_derivative,hull,Z_w", "R90-Zw,published_derivative,propeller,KT", "tabulated"),
    "a coefficient of a run": ("R90-Zw,published_derivative", "R90-Zw,towing", "row 2"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refusals_name_the_row(tmp_path, kind):
    old, new, place = REFUSED[kind]
    folder = _campaign(tmp_path, table=lambda text: text.replace(old, new, 1))
    with pytest.raises(InputError) as refused:
        fit(folder, str(tmp_path / "db"))
    assert "row 2" in refused.value.where
    assert place in f"{refused.value.where} {refused.value.found}"
    assert not (tmp_path / "db").exists()


def test_moments_about_another_point_are_refused(tmp_path):
    folder = _campaign(tmp_path, lambda text: text.replace("x_m = 0.0", "x_m = 0.1"))
    with pytest.raises(InputError, match=r"0\.1 m"):
        fit(folder, str(tmp_path / "db"))


def test_a_frame_with_x_aft_is_refused(tmp_path):
    folder = _campaign(tmp_path, lambda text: text.replace('x = "forward"', 'x = "aft"').replace('"down"', '"up"'))
    with pytest.raises(InputError, match="x forward"):
        fit(folder, str(tmp_path / "db"))


def test_what_symmetry_makes_zero_is_left_out_with_the_reason(tmp_path):
    folder = _campaign(tmp_path, table=lambda text: text.replace("hull,Z_w", "hull,Z_v", 1))
    found = identify(read_campaign(folder))
    assert [one.run_id for one in found.unused] == ["R90-Zw"]
    assert "symmetry" in found.unused[0].reason
