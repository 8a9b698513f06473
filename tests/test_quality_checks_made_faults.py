"""Authority: faults made on purpose in the bundled campaign, and its true faults.

A fault put into one run must be named with its file, row and column; what the bundled
campaign shows without any must be true of its source, and nothing else.
"""

from __future__ import annotations

import html
import json
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from ident.checks.check import evidence_of, findings_of
from ident.checks.copies import digits
from ident.checks.findings import registered, rules, spans
from ident.checks.tables import vertical_partner
from ident.cli import main
from ident.database.store import commit
from ident.report.page import write_report
from sim.boat.catalogue import OUTPUTS
from sim.boat.database import versions

BB2 = Path(__file__).parents[1] / "raw_captive_data" / "bb2"


@pytest.fixture(scope="module")
def evidence(campaign):
    return evidence_of(campaign, BB2)


@pytest.fixture(scope="module")
def bundled(evidence):
    return findings_of(evidence)


def only(evidence, names, change):
    """Findings of some checks after ``change`` of a copy of the run table."""
    runs = evidence.runs.copy()
    change(runs)
    campaign = replace(evidence.campaign, runs=runs)
    altered = replace(evidence, runs=runs, campaign=campaign)
    return [f for name in names for function in registered()[name] for f in function(altered, rules()[name])]


def at(runs, run_id):
    return runs.index[runs["run_id"] == run_id][0]


# -- the bundled campaign ----------------------------------------------------------------


def test_every_check_of_the_list_has_a_function_and_every_rule_a_remedy():
    assert all(registered().values())
    assert all(r.remedy and r.finds and r.basis for r in rules().values())


def test_the_bundled_campaign_has_no_error_and_a_short_list(bundled):
    assert not [f for f in bundled if f.severity == "error"]
    assert len(bundled) < 20


def test_the_bundled_campaign_shows_its_true_faults(bundled):
    said = {(f.check, f.file): f for f in bundled if f.severity == "warning"}
    # The towing loads do not change with depth, in the source either (2.5 m, 10 kts apart).
    assert said["frozen_column", "towing.csv"].rows == tuple(range(2, 13))
    # Planes at zero angle: 7 m and 4 m carry the same numbers.
    assert "D0 = 4 and 7" in said["duplicates", "plane_deflection.csv"].what
    # 8 deg at 10 kts is out of line with 6 and 3 kts at the same depth.
    assert "HD-23.69-10-08" in said["outliers", "drift_horizontal.csv"].what
    missing = " ".join(f.what for f in bundled if f.check == "missing" and f.severity == "warning")
    for name in ("Y_qr", "X_rp", "Y_vq", "Z_vp", "Y_wr", "N_pq"):
        assert name in missing
    assert "N_ur" not in missing
    copies = " ".join(f.what for f in bundled if f.check == "missing" and f.severity == "info")
    assert "N_r|r|" in copies  # pure yaw is pitch, turned


def test_what_the_campaign_calls_suspect_is_information(bundled):
    known = [f for f in bundled if f.check == "outliers" and f.severity == "info"]
    assert any("HD-23.69-10-04" in f.what for f in known)
    assert any("stern_plane_1-4-10" in f.what for f in known)


# -- faults put in -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("run_id", "output", "factor"),
    [
        ("HD-7-06-08", "N", 10.0),
        ("HD-7-06-08", "N", 0.001),
        ("VD-4-06--08", "Z", 0.1),
        ("VD-4-10-+08", "M", 1000.0),
    ],
)
def test_a_slipped_decimal_point(evidence, run_id, output, factor):
    def slip(runs):
        runs.loc[at(runs, run_id), output] *= factor

    row = evidence.runs.loc[at(evidence.runs, run_id)]
    named = [f for f in only(evidence, ["factor"], slip) if row["row"] in f.rows and f.file == row["file"]]
    assert named
    assert named[0].severity == "error"
    assert output in named[0].columns
    assert f"is {factor:g} times" in named[0].what


def test_a_load_that_is_out_of_line(evidence):
    def lift(runs):
        runs.loc[at(runs, "HD-4-06-08"), "Y"] *= 1.8

    row = int(evidence.runs.loc[at(evidence.runs, "HD-4-06-08"), "row"])
    new = only(evidence, ["outliers"], lift)
    assert any(row in f.rows and "Y" in f.columns for f in new)


def test_newtons_under_a_header_of_kilonewtons(evidence):
    def scale(runs):
        runs.loc[runs["file"] == "drift_horizontal.csv", list(OUTPUTS)] *= 1000.0

    sizes = only(evidence, ["size"], scale)
    assert {f.columns[0] for f in sizes} == {"Y", "N"}
    assert all(re.search(r"\b1000\b.* times too large", f.what) for f in sizes)


def test_a_moment_in_the_wrong_unit_or_of_the_wrong_sign(evidence):
    def kilo(runs):
        runs.loc[at(runs, "PD-sail_planes-25-10-+10"), "M"] *= -1.0
        runs.loc[at(runs, "HD-7-10-12"), "N"] *= 10.0

    rows = {(f.file, r) for f in only(evidence, ["levers"], kilo) for r in f.rows}
    for run_id in ("PD-sail_planes-25-10-+10", "HD-7-10-12"):
        run_ = evidence.runs.loc[at(evidence.runs, run_id)]
        assert (run_["file"], run_["row"]) in rows
    assert not only(evidence, ["levers"], lambda runs: None)


def test_a_section_lever_that_is_not_the_vehicles(evidence):
    def shift(runs):
        runs.loc[at(runs, "AC-vdot-Sail"), "x"] += 1.0

    (found,) = only(evidence, ["levers"], shift)
    assert "lever of Sail" in found.what


def test_added_inertia_of_the_wrong_sign_and_mass_left_in(evidence):
    def flip(runs):
        runs.loc[runs["vdot"].notna(), "Y"] *= -1.0

    assert {f.columns for f in only(evidence, ["inertia_sign"], flip)} == {("Y", "vdot")}
    assert not only(evidence, ["inertia_sign"], lambda runs: None)
    mass = evidence.body.mass

    def heavy(runs):
        runs.loc[at(runs, "AC-vdot-Hull_5"), "Y"] -= mass * 0.1

    (found,) = only(evidence, ["inertia_left_in"], heavy)
    left = float(re.search(r"subtracted ([\d.]+) is left", found.what)[1])
    sections = evidence.runs["vdot"].notna() & (evidence.runs["part"] != "hull")
    sway = -evidence.runs.loc[sections, "Y"].sum() / 0.1
    assert left == pytest.approx(sway / mass, abs=0.006)


def test_repeated_runs_of_a_part_are_one_load_of_it(evidence):
    """Parts add up to the whole; runs of one part, a second time with another error, are averaged first."""
    mass = evidence.body.mass

    def repeat(runs):
        for place in runs.index[runs["vdot"].fillna(0.0) != 0.0]:
            again = runs.loc[place].copy()
            again["run_id"] += "#2"
            runs.loc[place, "Y"] *= 1.02
            again["Y"] *= 0.98
            runs.loc[len(runs)] = again

    assert not only(evidence, ["inertia_left_in", "inertia_sign"], repeat)

    def heavy(runs):
        runs.loc[at(runs, "AC-vdot-Hull_5"), "Y"] -= mass * 0.1
        repeat(runs)

    (found,) = only(evidence, ["inertia_left_in"], heavy)
    left = float(re.search(r"subtracted ([\d.]+) is left", found.what)[1])
    moving = (evidence.runs["vdot"].fillna(0.0) != 0.0) & (evidence.runs["part"] != "hull")
    assert left == pytest.approx(-evidence.runs.loc[moving, "Y"].sum() / 0.1 / mass, abs=0.006)


def test_side_force_without_drift_and_mirror_images(evidence):
    def offset(runs):
        own = (runs["test"] == "drift_horizontal") & (runs["beta"] == 0.0)
        runs.loc[own, "Y"] = 0.1 * runs.loc[runs["test"] == "drift_horizontal", "Y"].abs().max()

    (found,) = [f for f in only(evidence, ["symmetry"], offset) if f.file == "drift_horizontal.csv"]
    assert found.columns == ("Y",)

    def forget(runs):
        runs.loc[runs["quality"] == "mirrored", "copy_of"] = ""

    copies = only(evidence, ["mirrored_copies"], forget)
    assert {f.file for f in copies} >= {"rotating_arm.csv", "plane_deflection.csv"}
    assert not only(evidence, ["mirrored_copies"], lambda runs: None)


def test_a_campaign_of_another_length(evidence):
    other = replace(evidence, tested_length=evidence.tested_length * 1.02)
    (found,) = [f for function in registered()["scale"] for f in function(other, rules()["scale"])]
    assert found.severity == "error"


@settings(max_examples=8, deadline=None)
@given(st.data())
def test_no_number_stops_the_checks(evidence, data):
    """Whatever a file may hold, a check says what it sees and does not fail."""
    own = evidence.runs["file"].isin(["drift_horizontal.csv", "acceleration.csv", "open_water.csv"])
    runs = evidence.runs[own].iloc[::4].reset_index(drop=True)
    columns = [*OUTPUTS, "U", "beta", "D0", "vdot", "KT", "KQ", "J", "rel_sigma", "s_Y"]
    odd = st.sampled_from([0.0, -0.0, 1e15, -1e15, 1e-300, 5e-324, math.nan, 1.0])
    for _ in range(data.draw(st.integers(1, 12))):
        row = data.draw(st.integers(0, len(runs) - 1))
        runs.loc[row, data.draw(st.sampled_from(columns))] = data.draw(odd)
    altered = replace(evidence, runs=runs, campaign=replace(evidence.campaign, runs=runs))
    assert all(f.what and f.remedy and f.file for f in findings_of(altered))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(1, 400), min_size=1, max_size=60))
def test_spans_name_exactly_the_rows(rows):
    named = set()
    for part in spans(rows).split(", "):
        first, _, last = part.partition("-")
        named |= set(range(int(first), int(last or first) + 1))
    assert named == set(rows)


@pytest.mark.parametrize(
    ("number", "count"), [(0.0, 0), (12.5, 3), (-1.20e-7, 2), (5.61935e6, 6), (np.nan, 0), (1.0, 1)]
)
def test_digits(number, count):
    assert digits(np.array([number]))[0] == count


@pytest.mark.parametrize(
    ("horizontal", "vertical"),
    [
        ("Yv", ("Zw", 1)),
        ("Nv", ("Mw", -1)),
        ("Yr", ("Zq", -1)),
        ("Nr", ("Mq", 1)),
        ("Yrdot", ("Zqdot", -1)),
        ("Nrr", ("Mqq", 1)),
        ("Yrr", ("Zqq", -1)),
        ("Yuudr", None),
        ("Xuu", None),
    ],
)
def test_a_body_turned_by_a_quarter(horizontal, vertical):
    """SUBOFF's and REMUS's signs: Z_w as Y_v, M_w as -N_v, Z_q as -Y_r, M_q as N_r."""
    assert vertical_partner(horizontal) == vertical


# -- commands ----------------------------------------------------------------------------


@pytest.fixture
def spoiled(tmp_path):
    folder = tmp_path / "bb2"
    folder.mkdir()
    for name in ("campaign.toml", "towing.csv", "drift_vertical.csv", "drift_horizontal.csv"):
        shutil.copy(BB2 / name, folder / name)
    path = folder / "drift_horizontal.csv"
    text = path.read_text(encoding="utf-8")
    assert text.count(",691680,") == 1  # K of HD-7-06-08
    path.write_text(text.replace(",691680,", ",6916800,"), encoding="utf-8")
    return folder


def test_check_command_json_and_strict(spoiled):
    plain = CliRunner().invoke(main, ["check", str(spoiled), "--json", "-", "--strict"])
    assert plain.exit_code == 1
    findings = json.loads(plain.output)[0]["findings"]
    slip = next(f for f in findings if f["check"] == "factor")
    assert (slip["file"], slip["rows"], slip["columns"]) == ("drift_horizontal.csv", [20], ["K"])
    assert slip["remedy"]


def test_fit_with_an_error_commits_nothing_unless_a_reason_is_stored(spoiled, tmp_path):
    db = tmp_path / "db"
    refused = CliRunner().invoke(main, ["fit", str(spoiled), "--db", str(db)])
    assert refused.exit_code == 2
    assert "drift_horizontal.csv, row 20, column K" in refused.output
    assert not db.exists()
    done = CliRunner().invoke(main, ["fit", str(spoiled), "--db", str(db), "--force", "K is not used"])
    assert done.exit_code == 0
    assert "factor" in done.output
    metadata = versions(str(db))[-1].metadata
    assert metadata["forced"] == "K is not used"
    assert any(f["check"] == "factor" for f in json.loads(metadata["checks"]))


def test_a_reason_without_an_error_is_refused(tmp_path):
    sound = Path(__file__).parents[1] / "raw_captive_data" / "suboff"
    done = CliRunner().invoke(main, ["fit", str(sound), "--db", str(tmp_path / "db"), "--force", "to be sure"])
    assert done.exit_code == 2
    assert "no check finds an error" in done.output
    assert not (tmp_path / "db").exists()


def test_the_report_shows_the_findings_of_the_commit(rows, bundled, tmp_path):
    few = rows[rows["coefficient"].isin(["KT", "w_T"])]
    for number, metadata in enumerate(({"checks": json.dumps([f.as_json() for f in bundled])}, {})):
        commit(str(tmp_path / f"db{number}"), few, metadata)
        page = Path(write_report(str(tmp_path / f"db{number}"), 0, tmp_path / str(number), "bb2").file).read_text(
            "utf-8"
        )
        section = page.split('<section id="checks">')[1].split("</section>")[0]
        for finding in bundled:
            assert (html.escape(finding.file) in section) == (number == 0)
        assert ("HD-23.69-10-08" in section) == (number == 0)
        assert ("Not stored" in section) == (number == 1)


def test_the_documentation_lists_every_check():
    text = (Path(__file__).parents[1] / "docs" / "checks.md").read_text(encoding="utf-8").replace("\\|", "|")
    for rule in rules().values():
        assert f"| `{rule.name}` | {rule.severity} | {rule.finds} |" in text
        assert rule.remedy in text
