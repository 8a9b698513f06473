"""Authority: the rule for bad input. One InputError that names file, row, column, found, allowed.

Any other exception, or a wrong database from a broken file, is a failure; hypothesis looks
for both.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ident.campaign import find_campaigns, read_campaign
from ident.identify import identify
from ident.store import commit, database_rows
from sim.database import read_rows, versions
from sim.errors import InputError

HEADER = """name = "small"
vehicle = "bb2"
facility = "none"
provenance = "made up"
[frame]
x = "aft"
y = "starboard"
z = "up"
angles = "flight"
[moment_point]
x_m = 0.0
y_m = 0.0
z_m = 0.0
about = "body origin"
[scale]
ratio = 1.0
length_m = 70.2
[fluid]
density_kgpm3 = 1025.0
source = "made up"
[inertia]
model_inertia_in_loads = false
[uncertainty]
floor = 0.1
source = "made up"
[quality]
as_published = { factor = 1.0, meaning = "as published" }
"""
RUNS = """run_id,test,part,U_mps,alpha_deg,beta_deg,D0_m,X_N,Y_N,rel_sigma,quality,source,copy_of,exclude
h0,drift_horizontal,hull,5.0,0,0,25,68000,0,0.05,as_published,book,,
h4,drift_horizontal,hull,5.0,0,4,25,74000,-336000,0.05,as_published,book,,
h8,drift_horizontal,hull,5.0,0,8,25,40000,-629000,0.05,as_published,book,,
"""


def write(folder: Path, header: str | bytes = HEADER, runs: str | bytes = RUNS) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("campaign.toml", header), ("drift.csv", runs)):
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


def fitted(folder: Path):
    return database_rows(identify(read_campaign(folder)))


def assert_refused(folder: Path, *words: str) -> InputError:
    """The InputError of reading and fitting ``folder``; its message holds every word."""
    with pytest.raises(InputError) as caught:
        fitted(folder)
    message = str(caught.value)
    for word in words:
        assert word in message, f"{word!r} is not in: {message}"
    assert caught.value.found
    assert caught.value.allowed
    return caught.value


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


def test_duplicate_run_is_named_within_and_across_files(tmp_path):
    assert_refused(write(tmp_path / "a", runs=RUNS.replace("h8", "h4")), "drift.csv", "row 4", "column run_id", "h4")
    folder = write(tmp_path / "b")
    (folder / "more.csv").write_text(RUNS)
    assert_refused(folder, "more.csv", "row 2", "column run_id", "h0")


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


# -- the database -------------------------------------------------------------------------


def test_database_path_that_is_a_file_is_refused(tmp_path):
    path = tmp_path / "db"
    path.write_text("not a folder")
    rows = fitted(write(tmp_path / "campaign"))
    with pytest.raises(InputError, match="a file"):
        commit(str(path), rows, {})
    with pytest.raises(InputError, match="a file"):
        read_rows(str(path))
    assert path.read_text() == "not a folder"


def test_absent_database_is_refused_and_not_created(tmp_path):
    with pytest.raises(InputError, match="no coefficient database"):
        read_rows(str(tmp_path / "absent"))
    assert not (tmp_path / "absent").exists()


@pytest.mark.parametrize("number", [-1, 1, 99])
def test_absent_version_is_refused_with_the_range(tmp_path, number):
    path = str(tmp_path / "db")
    commit(path, fitted(write(tmp_path / "campaign")), {})
    with pytest.raises(InputError, match=rf"version {number} does not exist.*0 to 0"):
        read_rows(path, number)


def test_absent_vehicle_lists_the_vehicles(tmp_path):
    path = str(tmp_path / "db")
    commit(path, fitted(write(tmp_path / "campaign")), {})
    with pytest.raises(InputError, match=r"nautilus.*bb2"):
        read_rows(path, vehicle="nautilus")


def test_vehicle_with_an_apostrophe_can_be_stored_twice(tmp_path):
    """The name stands in the predicate of the commit."""
    path = str(tmp_path / "db")
    rows = fitted(write(tmp_path / "campaign")).assign(vehicle="o'hara")
    assert commit(path, rows, {}) == (0, True)
    assert commit(path, rows.assign(value=rows["value"] * 2), {}) == (1, True)
    assert len(read_rows(path)[0]) == len(rows)


def test_damaged_database_is_refused(tmp_path):
    path = tmp_path / "db"
    commit(str(path), fitted(write(tmp_path / "campaign")), {})
    for log in (path / "_delta_log").iterdir():
        log.write_text("{ not json")
    with pytest.raises(InputError, match="db"):
        read_rows(str(path))
    with pytest.raises(InputError, match="db"):
        versions(str(path))


def test_database_without_its_data_files_is_refused(tmp_path):
    path = tmp_path / "db"
    commit(str(path), fitted(write(tmp_path / "campaign")), {})
    for data in path.rglob("*.parquet"):
        data.unlink()
    with pytest.raises(InputError, match="db"):
        read_rows(str(path))


# -- anything at all ----------------------------------------------------------------------


@st.composite
def mutations(draw, text: bytes):
    """The text with bytes flipped, cut, inserted or columns exchanged."""
    for _ in range(draw(st.integers(1, 4))):
        kind = draw(st.sampled_from(["flip", "cut", "insert", "swap", "repeat"]))
        at = draw(st.integers(0, max(len(text) - 1, 0)))
        if kind == "flip":
            text = text[:at] + bytes([draw(st.integers(0, 255))]) + text[at + 1 :]
        elif kind == "cut":
            text = text[:at] if draw(st.booleans()) else text[:at] + text[at + draw(st.integers(1, 40)) :]
        elif kind == "insert":
            pieces = st.sampled_from([b",", b'"', b"\n", b"\r", b"\x00", b"nan", b"1e308", b"-", b" ", b"]", b"="])
            text = text[:at] + draw(pieces | st.binary(max_size=6)) + text[at:]
        elif kind == "repeat":
            lines = text.split(b"\n")
            k = draw(st.integers(0, len(lines) - 1))
            text = b"\n".join([*lines[:k], lines[k], *lines[k:]])
        else:
            lines = [line.split(b",") for line in text.split(b"\n")]
            i, j = draw(st.integers(0, 13)), draw(st.integers(0, 13))
            for k, cells in enumerate(lines):
                whole = k > 0 or draw(st.booleans())  # with and without the header
                if whole and max(i, j) < len(cells):
                    cells[i], cells[j] = cells[j], cells[i]
            text = b"\n".join(b",".join(cells) for cells in lines)
    return text


def assert_accepted_or_refused(folder: Path) -> None:
    """The reader accepts or raises InputError; what it accepts gives a finite database."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            rows = fitted(folder)
        except InputError:
            return
    assert np.isfinite(rows[["value", "stderr", "worst_residual"]].to_numpy()).all()


EVERYTHING = settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@EVERYTHING
@given(runs=mutations(RUNS.encode()))
def test_any_mutation_of_a_run_file_is_accepted_or_refused(tmp_path, runs):
    assert_accepted_or_refused(write(tmp_path, runs=runs))


@EVERYTHING
@given(header=mutations(HEADER.encode()))
def test_any_mutation_of_the_campaign_file_is_accepted_or_refused(tmp_path, header):
    assert_accepted_or_refused(write(tmp_path, header=header))


HUGE = st.sampled_from(["1e300", "-1e300", "1e308", "1e-300", "1e-320", "1e155", "-1e155", "0", "1e16"])


@EVERYTHING
@given(
    columns=st.lists(st.sampled_from([3, 4, 5, 6, 7, 8, 9]), min_size=1, max_size=3), value=HUGE, row=st.integers(1, 3)
)
def test_huge_and_tiny_numbers_never_give_a_database_that_is_not_finite(tmp_path, columns, value, row):
    lines = [line.split(",") for line in RUNS.splitlines()]
    for column in columns:
        lines[row][column] = value
    assert_accepted_or_refused(write(tmp_path, runs="\n".join(",".join(c) for c in lines)))


@pytest.mark.parametrize("value", ["1e300", "1e-300", "1e200"])
@pytest.mark.parametrize("key", ["density_kgpm3 = 1025.0", "ratio = 1.0", "length_m = 70.2", "x_m = 0.0"])
def test_huge_and_tiny_header_numbers_never_give_a_database_that_is_not_finite(tmp_path, key, value):
    text = HEADER.replace(key, f"{key.split(' = ')[0]} = {value}")
    assert_accepted_or_refused(write(tmp_path, header=text))


# -- the command line ---------------------------------------------------------------------


def command(*arguments: str):
    from click.testing import CliRunner

    from ident.cli import main

    return CliRunner().invoke(main, list(arguments))


def test_command_line_shows_a_mistake_without_a_traceback(tmp_path):
    folder = write(tmp_path / "campaign", runs=RUNS.replace("74000", "abc"))
    result = command("fit", str(folder), "--db", str(tmp_path / "db"))
    assert result.exit_code == 2
    assert "Traceback" not in result.output
    for word in ("drift.csv", "row 3", "column X_N", "abc", "finite number"):
        assert word in result.output
    assert not (tmp_path / "db").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ("fit", "{here}/absent", "--db", "{here}/db"),
        ("fit", "{here}/campaign", "--db", "{here}/file"),
        ("versions", "--db", "{here}/absent"),
        ("diff", "0", "1", "--db", "{here}/absent"),
        ("diff", "0", "7", "--db", "{here}/good"),
        ("export", "{here}/out", "--version", "7", "--format", "csv", "--db", "{here}/good"),
        ("export", "{here}/file", "--version", "0", "--format", "csv", "--db", "{here}/good"),
        ("validate", "--case", "hzz20", "--db", "{here}/absent"),
        ("validate", "--case", "no-such-case", "--db", "{here}/good"),
        ("report", "--db", "{here}/absent", "--out", "{here}/out"),
        ("report", "--db", "{here}/good", "--out", "{here}/file"),
    ],
)
def test_every_command_ends_with_code_2_and_one_message(tmp_path, arguments):
    folder = write(tmp_path / "campaign")
    (tmp_path / "file").write_text("in the way")
    commit(str(tmp_path / "good"), fitted(folder), {})
    result = command(*[a.format(here=tmp_path) for a in arguments])
    assert result.exit_code == 2, (result.output, result.exception)
    assert "Traceback" not in result.output
    assert "Error" in result.output
    assert (tmp_path / "file").read_text() == "in the way"


def test_fit_by_command_line_says_the_version(tmp_path):
    folder, db = write(tmp_path / "campaign"), str(tmp_path / "db")
    assert command("fit", str(folder), "--db", db).exit_code == 0
    again = command("fit", str(folder), "--db", db)
    assert again.exit_code == 0
    assert [v.number for v in versions(db)] == [0]
    assert "0" in again.output
