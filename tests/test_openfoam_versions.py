"""Authority: the output formats of the ``forces`` function object, version by version, as its
source writes them (writeFileHeader, writeForces), and one real run of OpenFOAM v1912.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_campaigns import STEADY, campaign, history
from made_openfoam import COFR, FORCE, MOMENT, P2, P3, PARTS, REAL, SOURCE, STATE, TIMES, VERSIONS, grouped, single

from ident.captive.campaign import read_campaign
from ident.captive.readers import openfoam
from sim.files.errors import InputError


def written(folder: Path, files: dict[str, str], start: str = "0") -> Path:
    (folder / start).mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / start / name).write_text(text)
    return folder


def read(folder: Path):
    return np.vstack([values for values, _, _ in openfoam.loads(folder)])


@pytest.mark.parametrize("version", VERSIONS)
def test_every_version_gives_the_same_loads(tmp_path, version):
    found = read(written(tmp_path, VERSIONS[version]))
    np.testing.assert_allclose(found[:, 0], TIMES)
    np.testing.assert_allclose(found[:, 1:4], FORCE.sum(axis=1), atol=1e-5)
    np.testing.assert_allclose(found[:, 4:], MOMENT.sum(axis=1), atol=1e-4)


def test_moving_point_is_the_column(tmp_path):
    found = list(openfoam.loads(written(tmp_path, VERSIONS["Foundation 13, moving"])))
    np.testing.assert_allclose(np.vstack([c for _, c, _ in found])[:, 0], 0.1 * TIMES, rtol=1e-6)
    assert all(moving for _, _, moving in found)


def test_columns_are_found_by_header_not_by_position(tmp_path):
    """Porous before viscous in both header and rows: the sums stay."""
    text = grouped("forces(porous pressure viscous)\tmoments(porous pressure viscous)", 3)
    np.testing.assert_allclose(read(written(tmp_path, {"forces.dat": text}))[:, 1:4], FORCE.sum(axis=1), atol=1e-5)


@pytest.mark.parametrize("version", ["Foundation 11", "OpenCFD v1912", "OpenCFD v2212"])
def test_a_later_start_wins(tmp_path, version):
    """Run 0-2 s, restarted at 1 s with other loads: the first run counts to 1 s only."""
    later, brackets = slice(19, 40), version.endswith("1912")
    first = {
        "forces.dat": VERSIONS["Foundation 11"]["forces.dat"].replace("e+00", "e+01"),
        "force.dat": single("Force", 10.0 * FORCE, brackets, False),
        "moment.dat": single("Moment", 10.0 * MOMENT, brackets, False),
    }
    scaled = {
        "forces.dat": grouped(f"forces{P2}\tmoments{P2}", 2, rows=later),
        "force.dat": single("Force", FORCE, brackets, False, rows=later),
        "moment.dat": single("Moment", MOMENT, brackets, False, rows=later),
    }
    written(tmp_path, {k: first[k] for k in VERSIONS[version]}, "0")
    for name in VERSIONS[version]:
        written(tmp_path, {name: scaled[name]}, "1")
    found = read(tmp_path)
    np.testing.assert_allclose(found[:, 0], TIMES)
    np.testing.assert_allclose(found[19:, 1:4], FORCE[19:].sum(axis=1), atol=1e-5)
    assert np.abs(found[:19, 1] - FORCE[:19].sum(axis=1)[:, 0]).max() > 1.0


def test_repeated_times_and_steps_back_keep_the_last(tmp_path):
    first = grouped(f"forces{P2}\tmoments{P2}", 2, rows=slice(0, 30)).replace("e+00", "e+02")
    again = "".join(grouped("", 2, rows=slice(20, 40)).splitlines(keepends=True)[3:])
    twice = again.splitlines(keepends=True)[-1]
    found = read(written(tmp_path, {"forces.dat": first + again + twice}))
    np.testing.assert_allclose(found[:, 0], TIMES)
    np.testing.assert_allclose(found[20:, 1:4], FORCE[20:].sum(axis=1), atol=1e-5)


def test_a_restart_at_the_same_start_is_read_after_the_first(tmp_path):
    written(tmp_path, {"forces.dat": grouped(f"forces{P2}\tmoments{P2}", 2, rows=slice(0, 25))})
    written(tmp_path, {"forces_1.dat": grouped(f"forces{P2}\tmoments{P2}", 2, rows=slice(20, 40))})
    np.testing.assert_allclose(read(tmp_path)[:, 0], TIMES)


COEFFICIENTS = "# Force coefficients\n# liftDir : (0 1 0)\n# Time\tCd\tCs\tCl\n0.1\t1\t2\t3\n"


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("forces.dat", COEFFICIENTS, "force coefficients"),
        ("forces.dat", VERSIONS["Foundation 11"]["forces.dat"].replace("viscous", "turbulent"), "unknown header"),
        ("forces.dat", VERSIONS["Foundation 11"]["forces.dat"].replace("moments", "torques"), "unknown header"),
        ("forces.dat", grouped(f"forces{P3} moment{P3}\tlocalForces(pressure,viscous,porous) "
                               "localMoments(pressure,viscous,porous)", 3), "local system"),
        ("forces.dat", VERSIONS["Foundation 11"]["forces.dat"].replace("# Time", "# Iteration"), "no line '# Time"),
        ("forces.dat", VERSIONS["Foundation 11"]["forces.dat"].replace(COFR, ""), "CofR"),
        ("forces.dat", VERSIONS["Foundation 11"]["forces.dat"].replace("(5.0", "(5.0.0"), "CofR"),
        ("forces.dat", VERSIONS["Foundation 11"]["forces.dat"].replace(P2, P3), "cells"),
        ("forces.dat", VERSIONS["Foundation 11"]["forces.dat"].replace("))\n", "\n", 1), "cut short"),
        ("forces.dat", VERSIONS["Foundation 11"]["forces.dat"][:-20] + "\n", "cut short"),
        ("forces.dat", "", "no line '# Time"),
        ("forces.dat", "# Forces\n" + COFR + f"# Time forces{P2}\tmoments{P2}\n", "no rows"),
        ("force.dat", VERSIONS["OpenCFD v2212"]["force.dat"], "force.dat"),
    ],
)  # fmt: skip
def test_a_header_nobody_listed_is_refused_with_its_place(tmp_path, name, text, words):
    written(tmp_path, {name: text})
    with pytest.raises(InputError, match=r"dat|1 function") as caught:
        read(tmp_path)
    assert words in str(caught.value)
    assert caught.value.allowed


OPENCFD = ["OpenCFD v1912", "OpenCFD v2212, porous"]


@pytest.mark.parametrize("version", VERSIONS)
def test_line_ends_spacing_and_own_comments_change_nothing(tmp_path, version):
    """Copied by way of Windows, without the last line end, and with a line of one's own on top."""
    whole = read(written(tmp_path / "a", VERSIONS[version]))
    spaced = {
        k: "# copied from the cluster\n"
        + t.replace("# CofR          :", "#   CofR:").replace("# Time          ", "#Time ")
        for k, t in VERSIONS[version].items()
    }
    for k, change in enumerate(
        [lambda t: t.replace("\n", "\r\n"), lambda t: t.rstrip("\n"), lambda t: t.replace("\n", "\n\n# restarted\n", 5)]
    ):
        found = read(written(tmp_path / str(k), {n: change(t) for n, t in spaced.items()}))
        np.testing.assert_array_equal(found, whole)


@pytest.mark.parametrize("cut", [-3, -30, -75])
@pytest.mark.parametrize("version", VERSIONS)
def test_a_run_that_is_being_written_is_read_to_its_last_whole_row(tmp_path, version, cut):
    """Wherever the file breaks off, in the exponent of the last number too; the restart brings the row again."""
    whole = read(written(tmp_path / "a", VERSIONS[version]))
    files = {k: t[:cut] for k, t in VERSIONS[version].items()}
    np.testing.assert_array_equal(read(written(tmp_path / "b", files)), whole[: -1 if cut < -2 else None])
    later = {
        k: "".join(r for r in t.splitlines(True) if r[0] == "#" or float(r.split("(")[0].split()[0]) > 1.0)
        for k, t in VERSIONS[version].items()
    }
    np.testing.assert_array_equal(read(written(tmp_path / "b", later, "1")), whole)


@pytest.mark.parametrize("behind", ["force.dat", "moment.dat"])
@pytest.mark.parametrize("version", OPENCFD)
def test_one_of_two_files_a_row_behind(tmp_path, version, behind):
    whole = read(written(tmp_path / "a", VERSIONS[version]))
    files = {k: t if k != behind else t[: t.rindex("\n", 0, -1) + 1] for k, t in VERSIONS[version].items()}
    np.testing.assert_array_equal(read(written(tmp_path / "b", files)), whole[:-1])
    files[behind] = files[behind][: files[behind].rindex("\n", 0, -1) + 1]
    with pytest.raises(InputError, match="no row in the other file"):
        read(written(tmp_path / "b", files))


@pytest.mark.parametrize("version", ["Foundation 11", *OPENCFD])
def test_a_restart_that_ended_before_its_first_row_is_passed_over(tmp_path, version):
    whole = read(written(tmp_path, VERSIONS[version]))
    headers = {k: "".join(r for r in t.splitlines(True) if r[0] == "#") for k, t in VERSIONS[version].items()}
    written(tmp_path, headers, "1.5")
    written(tmp_path, dict.fromkeys(headers, ""), "1e-05")
    np.testing.assert_array_equal(read(tmp_path), whole)


def test_cases_with_dots_in_their_names_are_runs_of_their_own(tmp_path):
    for drift in ("2.0", "2.5"):
        for name in ("forces.hull", "forces.rudder"):
            written(tmp_path / f"drift_{drift}" / "postProcessing" / name, VERSIONS["Foundation 11"])
    keys = "rho_inf = 1.0\nmatch = 'drift_(?P<beta_deg>-?[0-9.]+)$'\n"
    parts = '[source.parts]\n"forces.hull" = "hull"\n"forces.rudder" = "stern_plane_1"\n'
    state = STATE.replace('beta = "-8 deg"\n', "")
    found = read_campaign(campaign(tmp_path, SOURCE.replace("run", "drift_*", 1) + keys + parts + state + STEADY)).runs
    assert found["run_id"].tolist() == [f"drift_{b}-{p}" for b in ("2.0", "2.5") for p in ("hull", "stern_plane_1")]
    np.testing.assert_allclose(np.degrees(found["beta"]), [2.0, 2.0, 2.5, 2.5])
    np.testing.assert_allclose(found["X"], 1000.0 * FORCE.sum(axis=1)[:, 0].mean(), rtol=0.2)
    twice = parts.replace("stern_plane_1", "hull")
    with pytest.raises(InputError, match="'hull' twice"):
        read_campaign(campaign(tmp_path, SOURCE.replace("run", "drift_*", 1) + keys + twice + state + STEADY))


def test_totals_that_are_not_their_shares_are_refused(tmp_path):
    swapped = VERSIONS["OpenCFD v1912"]["force.dat"].replace("pressure_", "@").replace("total_", "pressure_")
    for bad in (swapped.replace("@", "total_"), VERSIONS["OpenCFD v1912"]["force.dat"].replace("(6.", "(1.")):
        files = {"force.dat": bad, "moment.dat": VERSIONS["OpenCFD v1912"]["moment.dat"]}
        with pytest.raises(InputError, match=r"total|header"):
            read(written(tmp_path, files))


def test_force_and_moment_of_different_times_are_refused(tmp_path):
    files = dict(VERSIONS["OpenCFD v2212"])
    files["moment.dat"] = files["moment.dat"].replace("0.55 ", "0.56 ")
    with pytest.raises(InputError, match="same times"):
        read(written(tmp_path, files))


# -- the whole way, on the real run ----------------------------------------------------------

MESH = {"frame": 'x = "aft"\ny = "starboard"\nz = "up"\nangles = "flight"'}


@pytest.fixture
def run(tmp_path):
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "run").symlink_to(REAL)
    return tmp_path / "c"


def test_real_run_gives_a_row_a_part_in_the_program_frame(run):
    keys = "rho_inf = 1.0\nvehicle_origin = [0.5, 0.0, 0.0]\n"
    found = read_campaign(campaign(run, SOURCE + keys + PARTS + STATE + STEADY, **MESH)).runs
    assert found["part"].tolist() == ["hull", "stern_plane_1"]
    written_last = (REAL / "postProcessing" / "forcesPlate" / "1" / "force.dat").read_text().splitlines()[-1].split()
    # Kinematic loads times 1000 kg/m3; x aft and z up turn; close to the last step's total.
    assert found["X"][0] == pytest.approx(-1000.0 * float(written_last[1].strip("(")), rel=0.05)
    assert found["Y"][0] == pytest.approx(1000.0 * float(written_last[2]), rel=0.1)
    assert found["Y"][0] / -np.sin(np.radians(8.0)) < 0.0
    assert (found["s_Y"] > 0.0).all()
    assert found["reduction"].str.contains("effective samples").all()
    assert found["converged"].tolist() == [False, False]


def test_moments_are_moved_from_cofr_to_the_campaigns_point(run):
    """CofR at x = 0.5 m of the mesh: about the mesh origin N grows by 0.5 Y."""
    rows = []
    for origin in ("[0.5, 0.0, 0.0]", "[0.0, 0.0, 0.0]"):
        keys = f"rho_inf = 1000.0\nvehicle_origin = {origin}\n"
        rows.append(read_campaign(campaign(run, SOURCE + keys + PARTS + STATE + STEADY, **MESH)).runs.iloc[0])
    # In the program frame x points the other way, and so does N about z down.
    assert rows[1]["N"] == pytest.approx(rows[0]["N"] - 0.5 * rows[0]["Y"], rel=1e-6)


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (SOURCE + PARTS + STATE + STEADY, "rho_inf"),
        (SOURCE + "rho_inf = 1.0\n" + STATE + STEADY, "source.parts"),
        (SOURCE + "rho_inf = 1.0\n" + PARTS.replace("Rudder", "Sail") + STATE + STEADY, "forcesSail"),
        (SOURCE.replace('"run"', '"run/postProcessing/forcesPlate/0/force.dat"') + STATE + STEADY, "restarts"),
        (SOURCE.replace('"run"', '"run/case"') + "rho_inf = 1.0\n" + STATE + STEADY, "no output of forces"),
    ],
)
def test_what_the_campaign_does_not_say_is_asked_for(run, source, words):
    with pytest.raises(InputError) as caught:
        read_campaign(campaign(run, source, **MESH))
    assert words in str(caught.value)


def test_a_case_of_force_coefficients_alone_is_refused(tmp_path):
    written(tmp_path / "run" / "postProcessing" / "coeffs", {"coefficient.dat": COEFFICIENTS})
    with pytest.raises(InputError, match=r"coefficient\.dat \(allowed: .*coefficients are not read"):
        read_campaign(campaign(tmp_path, SOURCE + "rho_inf = 1.0\n" + STATE + STEADY, **MESH))


def test_one_function_object_needs_no_part_map(run):
    source = history("run/postProcessing/forcesPlate", 'reader = "openfoam"\nrho_inf = 1.0')
    found = read_campaign(campaign(run, source, **MESH)).runs
    assert found["run_id"].tolist() == ["forcesPlate"]
