"""Authority: invariants. A campaign written in other units, another frame, about another
point or at model scale is the same campaign; and closed forms for the weighted mean.
"""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_campaigns import campaign
from rewritten_campaigns import BB2, assert_same, header, number, rewritten, text

from ident.captive.campaign import read_campaign
from ident.checks.check import check_campaign
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.boat.catalogue import term
from sim.files.errors import InputError

FORCES, MOMENTS = ("X", "Y", "Z"), ("K", "M", "N")


@pytest.fixture(scope="module")
def tables():
    """The run files as text, with every number read where a test asks for it."""
    return {p.name: pd.read_csv(p, dtype=str, keep_default_na=False) for p in sorted(BB2.glob("*.csv"))}


def test_other_units_give_the_same_database(tables, rows, tmp_path):
    other = {}
    factors = {"U_mps": ("U_kts", 0.514444), "n_rps": ("n_rpm", 1 / 60), "plane_deg": ("plane_rad", math.degrees(1))}
    for angle in ("alpha", "beta"):
        factors[f"{angle}_deg"] = (f"{angle}_rad", math.degrees(1))
    for rate in "pqr":
        factors[f"{rate}_radps"] = (f"{rate}_degps", math.radians(1))
    for force in FORCES:
        factors[f"{force}_N"] = (f"{force}_kN", 1e3)
    for moment in MOMENTS:
        factors[f"{moment}_Nm"] = (f"{moment}_kNm", 1e3)
    for name, table in tables.items():
        table = table.copy()
        for column in [c for c in table if c in factors]:
            new, factor = factors[column]
            table[column] = text(number(table[column]) / factor)
            table = table.rename(columns={column: new})
        other[name] = table
    # Rows carry twelve digits, and a small load left by a subtraction has two fewer.
    assert_same(rewritten(tmp_path / "c", other, header()), rows, 1e-10)


@pytest.mark.parametrize(("x", "y", "z"), [("forward", "starboard", "down"), ("forward", "port", "up")])
def test_another_frame_gives_the_same_database(tables, rows, tmp_path, x, y, z):
    """Vectors written in a frame turned by hand; speed and flow angles do not turn."""
    signs = {"x": -1 if x == "forward" else 1, "y": -1 if y == "port" else 1, "z": -1 if z == "down" else 1}
    owner = {
        "x": ("X_N", "K_Nm", "p_radps", "udot_mps2", "pdot_radps2", "x_m"),
        "y": ("Y_N", "M_Nm", "q_radps", "vdot_mps2", "qdot_radps2", "y_m"),
        "z": ("Z_N", "N_Nm", "r_radps", "wdot_mps2", "rdot_radps2", "z_m"),
    }
    other = {}
    for name, table in tables.items():
        other[name] = table.copy()
        for axis, columns in owner.items():
            for column in [c for c in columns if c in table]:
                other[name][column] = text(signs[axis] * number(table[column]))
    turned = header().replace('x = "aft"', f'x = "{x}"').replace('z = "up"', f'z = "{z}"')
    turned = turned.replace('y = "starboard"', f'y = "{y}"')
    assert_same(rewritten(tmp_path / "c", other, turned), rows, 1e-15)


@pytest.mark.parametrize("point", [(5.0, 0.0, 0.0), (-3.0, 2.0, 1.5)])
def test_moments_about_another_point_give_the_same_database(tables, rows, tmp_path, point):
    """M_P = M_O - r_P x F, by hand; a blank moment stays blank."""
    other = {}
    x, y, z = point
    for name, table in tables.items():
        table = table.copy()
        moments = [f"{m}_Nm" for m in MOMENTS if f"{m}_Nm" in table]
        given = (table[moments] != "").any(axis=1)
        for force in FORCES if moments else ():
            # Moments move with the forces: where a run leaves one out, it is said to be zero.
            column = table.get(f"{force}_N", pd.Series("", index=table.index))
            table[f"{force}_N"] = column.mask((column == "") & given, "0")
        zero = pd.Series(0.0, index=table.index)
        fx, fy, fz = (number(table[f"{o}_N"]) if moments else zero for o in FORCES)
        for moment, arm in (("K", y * fz - z * fy), ("M", z * fx - x * fz), ("N", x * fy - y * fx)):
            if f"{moment}_Nm" in table:
                table[f"{moment}_Nm"] = text(number(table[f"{moment}_Nm"]) - arm)
        other[name] = table
    moved = header()
    for axis, value in zip("xyz", point, strict=True):
        moved = moved.replace(f"{axis}_m = 0.0", f"{axis}_m = {value}")
    assert_same(rewritten(tmp_path / "c", other, moved), rows, 1e-9)


def test_model_scale_gives_the_same_database(tables, rows, tmp_path):
    """Froude scaling by hand: lengths 1/s, speeds 1/sqrt(s), forces 1/s^3, moments 1/s^4."""
    scale = 18.348
    powers = {"U_mps": -0.5, "n_rps": 0.5} | dict.fromkeys(("D0_m", "R0_m", "x_m", "y_m", "z_m"), -1)
    powers |= {f"{rate}_radps": 0.5 for rate in "pqr"} | {f"{rate}dot_radps2": 1 for rate in "pqr"}
    powers |= {f"{o}_N": -3 for o in FORCES} | {f"{o}_Nm": -4 for o in MOMENTS}
    other = {}
    for name, table in tables.items():
        other[name] = table.copy()
        for column in [c for c in table if c in powers]:
            other[name][column] = text(number(table[column]) * scale ** powers[column])
    model = header().replace("ratio = 1.0", f"ratio = {scale}").replace("length_m = 70.2", f"length_m = {70.2 / scale}")
    assert_same(rewritten(tmp_path / "c", other, model), rows, 1e-9)


def test_moment_point_is_scaled_with_the_model(tables, rows, tmp_path):
    """At model scale the moment point is a distance on the model."""
    scale, x = 18.348, 0.25
    powers = {"U_mps": -0.5, "n_rps": 0.5} | dict.fromkeys(("D0_m", "R0_m", "x_m", "y_m", "z_m"), -1)
    powers |= {f"{rate}_radps": 0.5 for rate in "pqr"} | {f"{rate}dot_radps2": 1 for rate in "pqr"}
    powers |= {f"{o}_N": -3 for o in FORCES} | {f"{o}_Nm": -4 for o in MOMENTS}
    other = {}
    for name, table in tables.items():
        table = table.copy()
        for column in [c for c in table if c in powers]:
            table[column] = text(number(table[column]) * scale ** powers[column])
        for moment, force, sign in (("M", "Z", -1.0), ("N", "Y", 1.0)):
            if f"{moment}_Nm" in table:
                arm = sign * x * number(table[f"{force}_N"]).fillna(0.0) if f"{force}_N" in table else 0.0
                table[f"{moment}_Nm"] = text(number(table[f"{moment}_Nm"]) - arm)
        other[name] = table
    model = header().replace("ratio = 1.0", f"ratio = {scale}").replace("length_m = 70.2", f"length_m = {70.2 / scale}")
    model = model.replace("x_m = 0.0", f"x_m = {x}")
    assert_same(rewritten(tmp_path / "c", other, model), rows, 1e-9)


@pytest.mark.parametrize("scale", [1.0, 18.348])
def test_motions_of_another_point_are_those_of_the_origin(tmp_path, scale):
    """v_P = v_O + omega x r_P by hand, on an arm and in yaw: the run table is that of a campaign about the origin."""
    point, speed, rate, turning = (1.2, -0.3, 0.4), 3.0, 0.1, 0.02
    own = {"U": speed, "alpha": 2.0, "beta": -4.0, "p": 0.0, "q": 0.03, "r": rate, "vdot": 0.05, "rdot": turning}
    a, b = math.radians(own["alpha"]), math.radians(own["beta"])
    velocity = speed * np.array([math.cos(a) * math.cos(b), math.sin(b), math.sin(a) * math.cos(b)])
    u, v, w = velocity + np.cross([own["p"], own["q"], own["r"]], point)
    along, across, down = np.array([0.0, own["vdot"], 0.0]) + np.cross([0.0, 0.0, turning], point)
    there = {"U": math.sqrt(u * u + v * v + w * w), "alpha": math.degrees(math.atan2(w, u))}
    there["beta"] = math.degrees(math.asin(v / there["U"]))
    states = {
        "arm": ("rotating_arm", ("U_mps", "alpha_deg", "beta_deg", "q_radps", "r_radps")),
        "yaw": ("acceleration", ("U_mps", "vdot_mps2", "rdot_radps2", "udot_mps2")),
    }
    point_table = f"x_m = {point[0]}\ny_m = {point[1]}\nz_m = {point[2]}\nabout = 'pivot'\n"
    lengths = f"ratio = {scale}\nlength_m = {70.2 / scale!r}"
    for name, (test, columns) in states.items():
        values = {c: {**own, "udot": 0.0}[c.split("_")[0]] for c in columns}
        moved = values | {c: there[c.split("_")[0]] for c in columns[:3] if name == "arm"}
        moved |= {"vdot_mps2": across, "udot_mps2": along} if name == "yaw" else {}
        read = []
        for kind, row in (("origin", values), ("point", moved)):
            extra = f"[motion_point]\n{point_table}" if kind == "point" else ""
            constants = f'[source.constants]\ntest = "{test}"\npart = "hull"\nquality = "ok"\nD0 = "25 m"\n'
            folder = tmp_path / name / kind
            campaign(folder, f'{extra}[[source]]\nfiles = "a.csv"\n{constants}rel_sigma = 0.02\n', scale=lengths)
            row = {"run_id": "a", **row, "X_N": -9e4, "Y_N": 2e5, "Z_N": 1e4, "K_Nm": 1e4, "M_Nm": 1e5, "N_Nm": 1e6}
            pd.DataFrame([row]).to_csv(folder / "a.csv", index=False)
            read.append(read_campaign(folder).runs.iloc[0])
        assert down == 0.0
        for quantity in ("U", "alpha", "beta", "p", "q", "r", "udot", "vdot", "wdot", "rdot", "Y", "N"):
            one, two = (0.0 if pd.isna(run[quantity]) else float(run[quantity]) for run in read)
            assert two == pytest.approx(one, rel=1e-12, abs=1e-12), quantity


def test_a_motion_point_is_asked_for_where_turning_runs_have_moments_elsewhere(tmp_path):
    """Moments half a metre ahead of the origin on an arm of 15 m: 2 deg of drift. All zero is an answer too."""
    point = "x_m = 0.5\ny_m = 0.0\nz_m = 0.0\nabout = 'balance'"
    constants = '[source.constants]\ntest = "rotating_arm"\npart = "hull"\nquality = "ok"\nD0 = "25 m"\n'
    runs = "run_id,U_mps,alpha_deg,beta_deg,r_radps,X_N,Y_N,N_Nm\na,3.0,0,2,0.2,-9e4,2e5,1e6\n"
    still = runs.replace(",r_radps", "").replace(",0.2,", ",")
    said = f"[motion_point]\n{point.replace('0.5', '0.0')}\n"
    source = f'[[source]]\nfiles = "a.csv"\n{constants}rel_sigma = 0.02\n'
    cases = {"silent": ("", source, runs), "said": (said, source, runs)}
    cases["straight"] = ("", source.replace("rotating_arm", "drift_horizontal"), still)
    asked = {}
    for name, (extra, text_, rows_) in cases.items():
        campaign(tmp_path / name, extra + text_, moment_point=point)
        (tmp_path / name / "a.csv").write_text(rows_, "utf-8")
        found = check_campaign(read_campaign(tmp_path / name), tmp_path / name)
        asked[name] = [f.columns for f in found if f.check == "moment_point"]
    assert asked == {"silent": [("motion_point",)], "said": [], "straight": []}
    campaign(tmp_path / "idle", said + cases["straight"][1], moment_point=point)
    (tmp_path / "idle" / "a.csv").write_text(still, "utf-8")
    with pytest.raises(InputError, match="key motion_point: declared, and no run turns"):
        read_campaign(tmp_path / "idle")


def test_order_of_files_and_rows_does_not_matter(rows, tables, tmp_path):
    shuffled = {f"z{9 - k}_{n}": t.sample(frac=1.0, random_state=k) for k, (n, t) in enumerate(tables.items())}
    got = rewritten(tmp_path / "c", shuffled, header())
    for table in (got, rows):
        assert table["value"].notna().all()
    assert got["coefficient"].tolist() == rows["coefficient"].tolist()
    largest = rows["value"].abs().groupby([rows["coefficient"], rows["part"]]).transform("max")
    assert ((got["value"] - rows["value"]).abs() / largest.where(largest > 0, 1.0)).max() < 1e-12


# -- port/starboard completion -------------------------------------------------------------


def values_at(rows: pd.DataFrame, name: str, part: str) -> dict[tuple[float, ...], tuple[float, float]]:
    chosen = rows[(rows["coefficient"] == name) & (rows["part"] == part)]
    columns = [c for c in rows.columns if c.endswith(("_deg", "_mps", "_mps2", "_radps")) or c == "depth_m"]
    points = chosen[columns].fillna(0.0).to_numpy()
    return {tuple(p): (v, s) for p, v, s in zip(points, chosen["value"], chosen["stderr"], strict=True)}


# Signs under the mirror y -> -y, by hand from the definition of each quantity.
TURNED = ["beta_deg", "p_radps", "r_radps", "up_mps2", "ur_mps2", "vq_mps2", "wp_mps2", "wr_mps2"]


@pytest.mark.parametrize(
    ("names", "sign"),
    [
        (["X_uvw", "Z_uvw", "M_uvw", "X_rr", "X_pp", "Z_pp", "M_pp", "X_u|r|", "Z_u|r|", "M_u|r|"], 1),
        (["Y_uvw", "K_uvw", "N_uvw"], -1),
        (["Y_r|r|", "N_r|r|", "Y_p|p|", "K_p|p|", "N_p|p|", "Y_ur", "K_ur", "N_ur", "Y_wp", "K_wp", "N_wp"], 1),
    ],
)
def test_every_hull_row_has_its_port_image_with_the_declared_sign(rows, names, sign):
    """Drift loads turn over with beta; coefficients of odd multipliers such as r|r| do not."""
    columns = [c for c in rows.columns if c.endswith(("_deg", "_mps", "_mps2", "_radps")) or c == "depth_m"]
    flip = np.array([-1.0 if c in TURNED else 1.0 for c in columns])
    for name in names:
        table = values_at(rows, name, "hull")
        assert table
        assert set(term(name, "reduced").parity.values()) == {sign}
        for point, (value, stderr) in table.items():
            image = tuple(flip * np.array(point) + 0.0)
            assert table[image] == (sign * value, stderr), (name, point)


@pytest.mark.parametrize(("starboard", "port"), [("1", "4"), ("2", "3")])
def test_every_stern_plane_row_has_its_port_image(rows, starboard, port):
    """Deflection is about the outward span axis, so it turns over with Y, K and N."""
    for output in "XYZKMN":
        here = values_at(rows, f"{output}_d{starboard}", f"stern_plane_{starboard}")
        there = values_at(rows, f"{output}_d{port}", f"stern_plane_{port}")
        assert len(here) == len(there) > 0
        columns = [c for c in rows.columns if c.endswith(("_deg", "_mps", "_mps2", "_radps")) or c == "depth_m"]
        flip = np.array([-1.0 if c == "delta_deg" else 1.0 for c in columns])
        for point, (value, stderr) in here.items():
            got, error = there[tuple(flip * np.array(point) + 0.0)]
            assert got == (-value if output in "YKN" else value)
            assert error == stderr


def test_mirror_rows_are_the_same_estimate_as_their_partner(rows):
    mirrored = rows[rows["origin"] == "mirror"]
    assert len(mirrored) > 100
    measured = rows[rows["origin"] == "measured"].set_index("estimate")
    partner = measured.loc[mirrored["estimate"]]
    np.testing.assert_array_equal(partner["value"].abs().to_numpy(), mirrored["value"].abs().to_numpy())
    assert partner["runs"].tolist() == mirrored["runs"].tolist()


def test_rows_zero_by_symmetry_are_exactly_zero_with_no_error(rows):
    symmetric = rows[rows["origin"] == "symmetry"]
    assert set(symmetric["coefficient"]) == {"Y_uvw", "K_uvw", "N_uvw"}
    assert (symmetric[["value", "stderr"]] == 0.0).all(axis=None)
    assert (symmetric["beta_deg"] == 0.0).all()


# -- duplicates ----------------------------------------------------------------------------


def small(folder: Path, lines: list[str], columns: str = "U_mps,alpha_deg,beta_deg,D0_m,Y_N,rel_sigma") -> Path:
    shutil.copy(BB2 / "campaign.toml", folder / "campaign.toml")
    head = f"run_id,test,part,quality,source,copy_of,{columns}"
    (folder / "runs.csv").write_text("\n".join([head, *lines]) + "\n")
    return folder


def at_8_deg(folder: Path) -> pd.Series:
    rows = database_rows(identify(read_campaign(folder)))
    return rows[np.isclose(rows["beta_deg"], 8.0)].iloc[0]


def test_two_runs_at_one_point_give_the_inverse_variance_mean(tmp_path):
    first, second = -300e3, -310e3
    lines = [
        f"a,drift_horizontal,hull,as_published,s,,5,0,8,25,{first},0.05",
        f"b,drift_horizontal,hull,as_published,s,,5,0,8,25,{second},0.02",
    ]
    row = at_8_deg(small(tmp_path, lines))
    s1, s2 = 0.05 * abs(first), 0.02 * abs(second)
    scale = 0.5 * 1025.0 * 70.2**2 * 25.0
    mean = (first / s1**2 + second / s2**2) / (1 / s1**2 + 1 / s2**2)
    assert row["value"] == pytest.approx(mean / scale, rel=1e-12)
    assert row["stderr"] == pytest.approx((1 / s1**2 + 1 / s2**2) ** -0.5 / scale, rel=1e-12)
    assert row["n_runs"] == 2


def test_starboard_and_port_run_are_two_runs_of_one_value(tmp_path):
    lines = [
        "a,drift_horizontal,hull,as_published,s,,5,0,8,25,-300000,0.04",
        "b,drift_horizontal,hull,as_published,s,,5,0,-8,25,300000,0.04",
    ]
    row = at_8_deg(small(tmp_path, lines))
    scale = 0.5 * 1025.0 * 70.2**2 * 25.0
    assert row["value"] == pytest.approx(-300e3 / scale, rel=1e-12)
    assert row["stderr"] == pytest.approx(0.04 * 300e3 / math.sqrt(2) / scale, rel=1e-12)


def test_a_copy_adds_no_information(tmp_path):
    """A mirrored copy shares the error of its original: the mean of the two is no better."""
    lines = [
        "a,drift_horizontal,hull,as_published,s,,5,0,8,25,-300000,0.04",
        "b,drift_horizontal,hull,mirrored,s,a,5,0,-8,25,300000,0.04",
    ]
    row = at_8_deg(small(tmp_path, lines))
    assert row["stderr"] == pytest.approx(0.04 * 300e3 / (0.5 * 1025.0 * 70.2**2 * 25.0), rel=1e-12)


def test_a_copy_of_a_copy_adds_no_information(tmp_path):
    lines = [
        "a,drift_horizontal,hull,as_published,s,,5,0,8,25,-300000,0.04",
        "b,drift_horizontal,hull,mirrored,s,a,5,0,-8,25,300000,0.04",
        "c,drift_horizontal,hull,mirrored,s,b,5,0,8,25,-300000,0.04",
    ]
    row = at_8_deg(small(tmp_path, lines))
    assert row["stderr"] == pytest.approx(0.04 * 300e3 / (0.5 * 1025.0 * 70.2**2 * 25.0), rel=1e-12)


def test_quality_word_widens_the_error_by_its_factor(tmp_path):
    lines = ["a,drift_horizontal,hull,suspect,s,,5,0,8,25,-300000,0.04"]
    row = at_8_deg(small(tmp_path, lines))
    assert row["stderr"] == pytest.approx(3.0 * 0.04 * 300e3 / (0.5 * 1025.0 * 70.2**2 * 25.0), rel=1e-12)


def test_stated_error_of_a_load_overrides_the_rule(tmp_path):
    lines = ["a,drift_horizontal,hull,suspect,s,,5,0,8,25,-300,0.04,7"]
    columns = "U_mps,alpha_deg,beta_deg,D0_m,Y_kN,rel_sigma,sigma_Y_kN"
    row = at_8_deg(small(tmp_path, lines, columns))
    assert row["stderr"] == pytest.approx(7e3 / (0.5 * 1025.0 * 70.2**2 * 25.0), rel=1e-12)


def test_disagreement_beyond_the_errors_is_a_warning_that_names_the_runs(tmp_path):
    """Two runs d apart with error s each stand d/(s sqrt 2) standard errors from agreement."""
    lines = [
        "a,drift_horizontal,hull,as_published,s,,5,0,8,25,-300000,,10000",
        "b,drift_horizontal,hull,as_published,s,,5,0,8,25,-350000,,10000",
        "c,drift_horizontal,hull,as_published,s,,5,0,4,25,-150000,,10000",
        "d,drift_horizontal,hull,as_published,s,,5,0,4,25,-155000,,10000",
    ]
    columns = "U_mps,alpha_deg,beta_deg,D0_m,Y_N,rel_sigma,sigma_Y_N"
    found = identify(read_campaign(small(tmp_path, lines, columns)))
    assert {one.subject for one in found.warnings} == {"a", "b"}
    assert all("Y_uvw" in one.message for one in found.warnings)
    worst = {n.runs[0]: n.worst for n in found.nodes}
    assert worst["a"] == pytest.approx(50e3 / (10e3 * math.sqrt(2)), rel=1e-9)
    assert worst["c"] == pytest.approx(5e3 / (10e3 * math.sqrt(2)), rel=1e-9)


def test_load_that_symmetry_forbids_is_a_warning(tmp_path):
    lines = ["a,drift_horizontal,hull,as_published,s,,5,0,0,25,-300000,0.04"]
    lines += ["b,drift_horizontal,hull,as_published,s,,5,0,8,25,-300000,0.04"]
    found = identify(read_campaign(small(tmp_path, lines)))
    assert [one.subject for one in found.warnings] == ["a"]


def test_angles_in_the_database_are_those_of_the_run_files(rows):
    """Runs stand at whole degrees; someone who asks for beta_deg == 8 has to find them."""
    drift = rows[rows["coefficient"].isin(["X_uvw", "Y_uvw", "Z_uvw"])]
    assert set(drift["beta_deg"]) == {-12.0, -8.0, -4.0, 0.0, 4.0, 8.0, 12.0}
    assert set(drift["alpha_deg"]) == {-12.0, -8.0, -4.0, 0.0, 4.0, 8.0, 12.0}
    planes = rows[rows["coefficient"] == "X_dB"]
    assert set(planes["delta_deg"]) == {-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0}


# -- nothing is lost ------------------------------------------------------------------------


def test_every_run_is_used_or_listed_with_a_reason(campaign, identification):
    used = {run for node in identification.nodes for run in node.runs}
    listed = {one.run_id for one in identification.unused}
    assert set(campaign.runs["run_id"]) == used | listed
    assert all(one.reason.strip() for one in identification.unused)


def test_every_load_is_used_listed_or_zero_by_symmetry(campaign, identification):
    outputs = {}
    for node in identification.nodes:
        for run in node.runs:
            outputs.setdefault(run, set()).add(term(node.name, "reduced").output)
    listed = {(one.run_id, one.output) for one in identification.unused}
    for run in campaign.runs.to_dict("records"):
        for output in (*FORCES, *MOMENTS):
            if pd.isna(run[output]) or output in outputs.get(run["run_id"], ()):
                continue
            if (run["run_id"], output) not in listed:
                assert run[output] == 0.0, (run["run_id"], output, run[output])


def test_unused_loads_name_the_row_of_their_file(campaign, identification):
    rows_of = {r["run_id"]: (r["file"], r["row"]) for r in campaign.runs.to_dict("records")}
    assert identification.unused
    for one in identification.unused:
        assert rows_of[one.run_id] == (one.file, one.row)
        line = (BB2 / one.file).read_text("utf-8").splitlines()[one.row - 1]
        assert line.startswith(one.run_id + ",")
