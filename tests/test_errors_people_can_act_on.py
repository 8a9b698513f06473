"""Authority: the rule for bad input. One InputError that names file, row, column, found, allowed."""

from __future__ import annotations

import warnings

import pytest
from small_campaign import HEADER, RUNS, assert_refused, fitted, write

from ident.captive.campaign import find_campaigns, read_campaign
from sim.files.errors import InputError


def test_the_small_campaign_itself_is_accepted(tmp_path):
    rows = fitted(write(tmp_path))
    assert set(rows["coefficient"]) == {"X_uvw", "Y_uvw"}


# -- the folder and campaign.toml ---------------------------------------------------------


def test_missing_campaign_file_is_named(tmp_path):
    assert_refused(tmp_path, "campaign.toml", "missing")


def test_missing_run_file_is_named(tmp_path):
    (tmp_path / "campaign.toml").write_text(HEADER)
    assert_refused(tmp_path, str(tmp_path), "no CSV")


def test_folder_without_campaign_is_named(tmp_path):
    with pytest.raises(InputError, match=r"campaign\.toml"):
        find_campaigns(tmp_path)
    with pytest.raises(InputError, match="not a folder"):
        find_campaigns(tmp_path / "absent")


@pytest.mark.parametrize("key", ["[frame]", "[moment_point]", "[scale]", "[fluid]", "[uncertainty]", "[inertia]"])
def test_undeclared_section_is_named(tmp_path, key):
    head, rest = HEADER.split(key)
    following = rest[rest.index("\n[") + 1 :]
    assert_refused(write(tmp_path, head + following), "campaign.toml", key.strip("[]"), "nothing")


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_frame_axis_that_is_not_declared_is_named(tmp_path, axis):
    line = next(k for k in HEADER.splitlines() if k.startswith(f"{axis} = "))
    assert_refused(write(tmp_path, HEADER.replace(line + "\n", "")), "campaign.toml", f"frame.{axis}", "nothing")


def test_left_handed_frame_is_refused(tmp_path):
    assert_refused(write(tmp_path, HEADER.replace('"starboard"', '"port"')), "campaign.toml", "[frame]", "left-handed")


def test_unknown_frame_direction_lists_the_directions(tmp_path):
    assert_refused(write(tmp_path, HEADER.replace('"aft"', '"astern"')), "campaign.toml", "astern", "forward", "aft")


def test_unknown_angle_convention_is_refused(tmp_path):
    assert_refused(
        write(tmp_path, HEADER.replace('"flight"', '"compass"')), "campaign.toml", "frame.angles", "compass", "flight"
    )


def test_model_inertia_in_the_loads_is_refused(tmp_path):
    text = HEADER.replace("model_inertia_in_loads = false", "model_inertia_in_loads = true")
    assert_refused(write(tmp_path, text), "campaign.toml", "model_inertia_in_loads", "True")


def test_unknown_key_is_named(tmp_path):
    assert_refused(write(tmp_path, 'colour = "red"\n' + HEADER), "campaign.toml", "colour", "red")


@pytest.mark.parametrize("value", ["0.0", "-1.0", "inf", "nan", '"one"'])
def test_scale_ratio_out_of_range_is_refused(tmp_path, value):
    assert_refused(write(tmp_path, HEADER.replace("ratio = 1.0", f"ratio = {value}")), "campaign.toml", "scale.ratio")


def test_toml_syntax_error_names_the_line(tmp_path):
    assert_refused(write(tmp_path, HEADER.replace("[frame]", "[frame")), "campaign.toml", "not TOML", "line 5")


def test_campaign_file_in_another_encoding_is_refused(tmp_path):
    assert_refused(write(tmp_path, HEADER.replace("made up", "caf\xe9").encode("latin-1")), "campaign.toml", "UTF-8")


@pytest.mark.parametrize("name", ["nautilus", "absent.toml", "", "b" * 300 + ".toml"])
def test_unknown_vehicle_is_named(tmp_path, name):
    assert_refused(write(tmp_path, HEADER.replace('vehicle = "bb2"', f'vehicle = "{name}"')), name[:20], "bb2")


# -- the run files ------------------------------------------------------------------------


@pytest.mark.parametrize("column", ["run_id", "test", "part", "quality", "source"])
def test_missing_column_is_named(tmp_path, column):
    assert_refused(
        write(tmp_path, runs=RUNS.replace(column, "exclude_me", 1).replace("exclude_me,", "reason,")), column
    )


@pytest.mark.parametrize(("column", "wrong"), [("X_N", "X_lbf"), ("U_mps", "U_mph"), ("alpha_deg", "alpha_grad")])
def test_unknown_unit_lists_the_units(tmp_path, column, wrong):
    assert_refused(write(tmp_path, runs=RUNS.replace(column, wrong)), "drift.csv", "row 1", wrong, column)


def test_unknown_column_is_named(tmp_path):
    assert_refused(write(tmp_path, runs=RUNS.replace("source", "colour", 1)), "drift.csv", "source")
    assert_refused(write(tmp_path, runs=RUNS.replace("exclude", "colour", 1)), "drift.csv", "row 1", "colour")


def test_quantity_in_two_units_is_refused(tmp_path):
    text = RUNS.replace("copy_of", "U_kts")
    assert_refused(write(tmp_path, runs=text), "drift.csv", "row 1", "U stands twice")


@pytest.mark.parametrize("twin", ["U_mps", " U_mps", "source", " source"])
def test_column_that_stands_twice_is_refused(tmp_path, twin):
    assert_refused(write(tmp_path, runs=RUNS.replace("copy_of", twin)), "drift.csv", "row 1", twin.strip())


def test_unknown_test_lists_the_tests(tmp_path):
    text = RUNS.replace("h4,drift_horizontal", "h4,drift_sideways")
    assert_refused(
        write(tmp_path, runs=text), "drift.csv", "row 3", "column test", "drift_sideways", "drift_horizontal"
    )


def test_unknown_part_lists_the_parts(tmp_path):
    text = RUNS.replace("h8,drift_horizontal,hull", "h8,drift_horizontal,rudder")
    assert_refused(write(tmp_path, runs=text), "drift.csv", "row 4", "column part", "rudder", "stern_plane_1")


def test_unknown_quality_lists_the_words(tmp_path):
    text = RUNS.replace("as_published", "good", 1)
    assert_refused(write(tmp_path, runs=text), "drift.csv", "row 2", "column quality", "good", "as_published")


@pytest.mark.parametrize("wrong", ["abc", "nan", "inf", "-inf", "1,5", "1e999", "NA", "0x10", "5 m/s", "--5"])
def test_what_is_not_a_finite_number_is_named(tmp_path, wrong):
    text = RUNS.replace("74000", f'"{wrong}"')
    assert_refused(write(tmp_path, runs=text), "drift.csv", "row 3", "column X_N", wrong, "finite number")


@pytest.mark.parametrize("row", [2, 3, 4])
@pytest.mark.parametrize("column", ["U", "alpha", "beta", "D0"])
def test_blank_required_quantity_is_named(tmp_path, row, column):
    lines = RUNS.splitlines()
    cells = lines[row - 1].split(",")
    place = next(i for i, c in enumerate(lines[0].split(",")) if c.split("_")[0] == column)
    cells[place] = ""
    lines[row - 1] = ",".join(cells)
    assert_refused(write(tmp_path, runs="\n".join(lines)), "drift.csv", f"row {row}", f"column {column}", "nothing")


def test_run_without_any_load_is_named(tmp_path):
    assert_refused(write(tmp_path, runs=RUNS.replace("74000,-336000", ",")), "drift.csv", "row 3", "no load")


def test_run_without_any_error_is_named(tmp_path):
    text = RUNS.replace("-336000,0.05", "-336000,")
    assert_refused(write(tmp_path, runs=text), "drift.csv", "row 3", "rel_sigma", "sigma_X_")


def test_negative_rel_sigma_is_named(tmp_path):
    text = RUNS.replace("-336000,0.05", "-336000,-0.05")
    assert_refused(write(tmp_path, runs=text), "drift.csv", "row 3", "rel_sigma", "-0.05", "zero or more")


def test_negative_sigma_of_a_load_is_named(tmp_path):
    text = RUNS.replace("copy_of", "sigma_X_N").replace("book,,", "book,-100,")
    assert_refused(write(tmp_path, runs=text), "drift.csv", "row 2", "sigma_X_N", "-100")


def test_negative_speed_is_named(tmp_path):
    """U is a speed: a source frame with u < 0 ahead would turn the boat around in silence."""
    assert_refused(write(tmp_path, runs=RUNS.replace("5.0,0,4", "-5.0,0,4")), "drift.csv", "row 3", "column U", "-5")


def test_duplicate_run_is_named_within_a_file_and_known_by_its_file_across_files(tmp_path):
    assert_refused(write(tmp_path / "a", runs=RUNS.replace("h8", "h4")), "drift.csv", "row 4", "column run_id", "h4")
    folder = write(tmp_path / "b")
    (folder / "more.csv").write_text(RUNS)
    assert read_campaign(folder).runs["run_id"].is_unique


def test_blank_run_id_is_named(tmp_path):
    assert_refused(write(tmp_path, runs=RUNS.replace("\nh4,", "\n,")), "drift.csv", "row 3", "column run_id")


def test_copy_of_a_run_that_does_not_exist_is_named(tmp_path):
    text = RUNS.replace("-336000,0.05,as_published,book,,", "-336000,0.05,as_published,book,h9,")
    assert_refused(write(tmp_path, runs=text), "drift.csv", "row 3", "column copy_of", "h9")


def test_exclusion_of_an_unknown_load_is_named(tmp_path):
    text = RUNS.replace("-336000,0.05,as_published,book,,", "-336000,0.05,as_published,book,,X W")
    assert_refused(write(tmp_path, runs=text), "drift.csv", "row 3", "column exclude", "W", "X, Y")


@pytest.mark.parametrize("text", ["", "\n", RUNS.splitlines()[0] + "\n", "\ufeff"])
def test_empty_run_file_is_named(tmp_path, text):
    assert_refused(write(tmp_path, runs=text), "drift.csv")


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "latin-1", "cp932"])
def test_run_file_in_another_encoding_is_named(tmp_path, encoding):
    text = RUNS.replace("book", "\u00b1" if encoding == "cp932" else "caf\xe9")
    assert_refused(write(tmp_path, runs=text.encode(encoding)), "drift.csv", "encoding", "in [[source]]")


def test_spreadsheet_byte_order_mark_and_line_ends_are_accepted(tmp_path):
    plain = fitted(write(tmp_path / "plain"))
    excel = fitted(write(tmp_path / "excel", runs=b"\xef\xbb\xbf" + RUNS.replace("\n", "\r\n").encode()))
    assert excel.equals(plain)


@pytest.mark.parametrize("which", [slice(1, 2), slice(2, 3), slice(1, None)])
def test_row_with_a_cell_too_many_is_refused(tmp_path, which):
    """A stray comma would move every later cell one column on; nothing may be dropped in silence."""
    lines = RUNS.splitlines()
    lines[which] = [line + ",9" for line in lines[which]]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert_refused(write(tmp_path, runs="\n".join(lines)), "drift.csv")


def test_row_with_cells_missing_is_refused_or_read_as_blank(tmp_path):
    whole = fitted(write(tmp_path / "whole"))
    short = RUNS.replace("-629000,0.05,as_published,book,,", "-629000,0.05,as_published,book")
    assert fitted(write(tmp_path / "short", runs=short)).equals(whole)
    assert_refused(
        write(tmp_path / "cut", runs=RUNS.replace(",0.05,as_published,book,,\nh8", "\nh8")), "drift.csv", "row 3"
    )


def test_moment_that_cannot_be_moved_for_want_of_a_force_is_named(tmp_path):
    """M_O = M_P + r_P x F needs the forces; a blank one is not zero."""
    runs = RUNS.replace("Y_N", "N_Nm")
    assert len(fitted(write(tmp_path / "origin", runs=runs)))
    assert_refused(
        write(tmp_path / "moved", HEADER.replace("x_m = 0.0", "x_m = 2.0"), runs), "drift.csv", "row 2", "column Y"
    )


def test_runs_that_identify_nothing_are_refused(tmp_path):
    text = RUNS.replace("book,,", "book,,X Y")
    assert_refused(write(tmp_path, runs=text), "small", "identify nothing")


def test_a_single_angle_is_told_what_it_cannot_tell_apart(tmp_path):
    """Two unknowns of one load, one run: each is named, and what is missing."""
    header = HEADER.replace('vehicle = "bb2"', 'vehicle = "suboff"')
    assert header != HEADER
    words = ("1 run cannot tell", "Y_v Y_v|v|", "further angles")
    assert_refused(write(tmp_path, header, "\n".join(RUNS.splitlines()[:3:2]) + "\n"), *words)
