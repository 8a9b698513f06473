"""Authority: the same numbers written as each laboratory's tool writes them read the same.

Tidy CSV in its dialects, Parquet, STAR-CCM+ monitor exports, white-space tank files; and
what they get wrong is refused with file, row, column, what was found, what is allowed.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from made_campaigns import (
    BETA,
    CONSTANTS,
    MEANS,
    SAMPLES,
    SERIES,
    STEADY,
    TIME,
    VALUES,
    assert_means,
    assert_values,
    campaign,
    history,
    read,
    tidy,
)
from made_files import MAP, PATTERNS, PLAIN, ROWS, STAR, body

from ident.captive.campaign import read_campaign
from ident.captive.quantities import factor, table
from ident.captive.source import Source
from ident.cli import main
from ident.database.store import database_rows
from ident.identification.identify import identify
from sim.files.errors import InputError


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        (PLAIN, ""),
        (b"\xef\xbb\xbf" + PLAIN.encode(), ""),
        (PLAIN.replace("\n", "\r\n"), ""),
        (PLAIN.replace("\n", "\r"), ""),
        ("# tank 3, 4 May\n% zero taken\n\n" + PLAIN + "# end\n", ""),
        ('"beta_deg","Fx [kN]","Y [N]","Mz (kN m)"\n' + body(lambda v: f'"{v!r}"'), ""),
        (PLAIN.replace(",", "\t"), ""),
        (PLAIN.replace(",", " ; "), ""),
        ("beta_deg;Fx [kN];Y [N];Mz (kN m)\n" + body(lambda v: repr(v).replace(".", ","), ";"), ""),
        ("beta_deg;Fx;Y;Mz\ndeg;kN;N;[kN m]\n" + body(repr, ";"), "units_row = true"),
        (PLAIN, "extra"),
        (PLAIN.replace("beta_deg", "beta [°]").encode("latin-1"), 'encoding = "latin-1"'),
    ],
    ids=["plain", "BOM", "CRLF", "CR", "comments", "quoted", "tabs", "blanks", "comma", "units", "extra", "latin"],
)  # fmt: skip
def test_dialects_of_a_tidy_table(tmp_path, text, keys):
    columns = MAP
    if keys == "extra":
        lines = [line.split(",") for line in PLAIN.splitlines()]
        text = "\n".join(
            ",".join([*a[:2], extra, *a[2:]]) for a, extra in zip(lines, ["note", "a", "", "c"], strict=True)
        )
        keys = 'ignore = ["not*"]'
    if "units_row" in keys:
        columns = 'beta_deg = "beta"\nFx = "X"\nMz = "N"'
    assert_values(read(tmp_path, text, tidy(keys, columns)))


def test_thousands_beside_a_decimal_comma(tmp_path):
    def german(v: float) -> str:
        return f"{v:,.3f}".replace(",", "'").replace(".", ",").replace("'", ".")

    rows = "".join(";".join(map(german, (b, *r))) + "\n" for b, r in zip(BETA, VALUES.tolist(), strict=True))
    assert_values(read(tmp_path, "beta_deg;X_N;Y_N;N_Nm\n" + rows, tidy()))


def test_a_comma_that_could_be_either_is_asked_about(tmp_path):
    text = "beta_deg;X_N\n2;1,234\n4;2,345\n"
    with pytest.raises(InputError, match=r"row 2: '1,234' \(allowed: decimal"):
        read(tmp_path, text, tidy())
    assert read(tmp_path, text, tidy('decimal = ","'))["X"].tolist() == [1.234, 2.345]
    assert read(tmp_path, text, tidy('thousands = ","'))["X"].tolist() == [1234.0, 2345.0]


def test_parquet_with_units_in_its_column_names(tmp_path):
    frame = pd.DataFrame(VALUES / [1e3, 1.0, 1e3], columns=["Fx [kN]", "Y [N]", "Mz (kN m)"]).assign(beta_deg=BETA)
    campaign(tmp_path, tidy("", MAP))
    frame.to_parquet(tmp_path / "runs.parquet")
    assert_values(read_campaign(tmp_path).runs)


def test_parquet_beside_the_header_needs_no_source(tmp_path):
    words = {"run_id": ["a", "b", "c"], "test": "drift_horizontal", "part": "hull", "quality": "ok", "source": "tank"}
    state = {"U_mps": 2.0, "alpha_deg": 0.0, "beta_deg": BETA, "D0_m": 25.0, "rel_sigma": 0.05}
    campaign(tmp_path)
    pd.DataFrame({**words, **state, "X_N": VALUES[:, 0], "Y_N": VALUES[:, 1], "N_Nm": VALUES[:, 2]}).to_parquet(
        tmp_path / "a.parquet"
    )
    assert_values(read_campaign(tmp_path).runs)


@pytest.mark.parametrize(
    ("header", "columns", "words"),
    [
        ("beta_deg,Fx,Y [N],N [N m]", 'Fx = "X"', "no unit for X"),
        ("beta_deg,X [m],Y [N],N [N m]", "", "unit 'm' for X"),
        ("beta_deg,X [N],Y [N],N [kN]", "", "unit 'kN' for N"),
        ("beta_deg,X [furlong],Y [N],N [N m]", "", "furlong"),
        ("beta [1/s],X [N],Y [N],N [N m]", "", "deg, rad"),
        ("beta_deg,Fx [kN],Y [N],N [N m]", 'Fx = "X [N]"', "declared as 'N'"),
        ("beta_deg,Fx [kN],Y [N],N [N m]", "", "unknown column or unit 'Fx [kN]'"),
        ("beta_deg,X [N],X [kN],N [N m]", "", "X stands twice"),
        ("beta_deg,X [N],X [N],N [N m]", "", "stands twice"),
        ("beta_deg,X [N],Y [N],", "", "4 cells"),
        ("beta_deg,X [N],Y [N],N [N m]", 'Fz = "Z"', "no column 'Fz'"),
        ("beta_deg,X [-],Y [N],N [N m]", "", "no normalisation"),
    ],
)
def test_a_wrong_or_missing_unit_is_refused_with_what_is_allowed(tmp_path, header, columns, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, header + "\n" + body(repr), tidy("", columns))
    assert words in str(caught.value)
    assert "runs.csv" in str(caught.value) or "source.normalisation" in str(caught.value)


@pytest.mark.parametrize(
    ("quantity", "unit", "expected"),
    [
        ("X", "lbf", 4.4482216152605),
        ("M", "lbf*ft", 1.3558179483314),
        ("U", "km/h", 1 / 3.6),
        ("r", "deg/s", np.pi / 180),
        ("D0", "ft", 0.3048),
        ("n", "1/min", 1 / 60),
        ("Y", "kgf", 9.80665),
        ("vdot", "m s-2", 1.0),
        ("K", "N.m", 1.0),
        ("alpha", "°", np.pi / 180),
        ("frequency", "rad/s", 0.5 / np.pi),
        ("n", "s⁻¹", 1.0),
        ("n", "min⁻¹", 1 / 60),
        ("n", "r.p.m.", 1 / 60),
        ("r", "dps", np.pi / 180),
        ("X", "kg-f", 9.80665),
        ("N", "N×m", 1.0),
        ("N", "mNm", 1e-3),
        ("N", "kgfcm", 0.0980665),
    ],
)
def test_units_of_the_trade(quantity, unit, expected):
    """International definitions of foot, pound, kilogram-force."""
    assert factor(quantity, unit) == pytest.approx(expected, rel=1e-12)


def test_the_table_of_quantities_agrees_with_pint():
    import pint

    registry = pint.UnitRegistry()
    spelled = table()[table()["spelled"] != ""]
    assert len(spelled) > 15
    for unit in spelled["spelled"]:
        base = registry.Quantity(1.0, str(unit)).to_base_units()
        assert base.magnitude == pytest.approx(1.0), unit


# -- time histories --------------------------------------------------------------------------


def test_star_ccm_monitors_by_pattern(tmp_path):
    text = STAR.replace("(N-m)", "")
    assert_means(read(tmp_path, text, history("runs.csv", PATTERNS)))


@pytest.mark.parametrize(
    ("patterns", "words"),
    [
        (PATTERNS.replace("Drag", "Lift"), "no column fits"),
        (PATTERNS.replace("^Yaw Monitor: ", "Monitor: "), "more than one fit"),
        (PATTERNS.replace("^Yaw Monitor: ", "(("), "regular expression"),
        ("", "source.patterns"),
    ],
)
def test_star_ccm_patterns_that_do_not_fit_are_refused(tmp_path, patterns, words):
    with pytest.raises(InputError, match=r"runs\.csv|campaign\.toml") as caught:
        read(tmp_path, STAR, history("runs.csv", patterns))
    assert words in str(caught.value)


NAMES = 'names = ["time [s]", "X [N]", "Y [N]", "N [N m]"]'


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("Tank 3   run 17, model 5471\noperator: M. Kim\n\n t      Fx     Fy    Mz\n  s   N N Nm\n" + ROWS, NAMES),
        (ROWS, NAMES),
        ("Run 17 of 20\n" + "Time [s]   Fx [N]   Fy [N]   Mz [N m]\n" + ROWS,
         'header_pattern = "^Time"\n[source.columns]\n"Time" = "time"\nFx = "X"\nFy = "Y"\nMz = "N"'),
        ("Run 17 of 20\n" + "# Time[s] Fx[N] Fy[N] Mz[Nm]\n" + ROWS,
         'header_pattern = "Time"\n[source.columns]\n"Time" = "time"\nFx = "X"\nFy = "Y"\nMz = "N"'),
        ("Fortran\n" + ROWS.replace("e+", "D+").replace("e-", "D-"), NAMES),
    ],
    ids=["free text", "bare", "header line", "single blanks", "Fortran"],
)  # fmt: skip
def test_white_space_tank_files(tmp_path, text, keys):
    assert_means(read(tmp_path, text, history("runs.txt", keys), "runs.txt"))


@pytest.mark.parametrize(
    ("text", "keys", "words"),
    [
        (ROWS, "", "names = "),
        ("only words\n", NAMES, "no line with 4 numbers"),
        (ROWS, NAMES.replace(', "N [N m]"', ""), "no line with 3 numbers"),
        (ROWS.replace("1.0000", "1.oooo", 1), NAMES, "row 21, column time"),
        (ROWS.replace("   1.0000", "  nan", 1), NAMES, "row 21, column time [s]: 'nan'"),
        (ROWS + "20.0 1.0 2.0\n", NAMES, "row 401: 3 cells"),
        (ROWS + "20.0 1.0 2.0 1e300\n", NAMES, "row 401, column N [N m]: '1e300'"),
        (ROWS + "3.0 1.0 2.0 3.0\n", NAMES, "data row 401, column time: 3 s after"),
        ("".join(ROWS.splitlines(keepends=True)[:5]), NAMES, "5 samples in 5 rows"),
        (ROWS, NAMES + '\nheader_pattern = "["', "regular expression"),
        (ROWS, 'header_pattern = "Time"', "no line in the first 200 fits"),
    ],
)
def test_a_bad_tank_file_is_refused_with_its_place(tmp_path, text, keys, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text, history("runs.txt", keys), "runs.txt")
    assert words in str(caught.value)


def test_stamps_with_too_few_digits_need_the_rate(tmp_path):
    """Time printed with three digits repeats above 1000 s (a trap of tank files)."""
    rows = "".join(f"{1000 + t:.4g} {x:.9g} {y:.9g} {n:.9g}\n" for t, x, y, n in SAMPLES)
    with pytest.raises(InputError, match="rate_hz"):
        read(tmp_path, rows, history("runs.txt", NAMES), "runs.txt")
    timed = STEADY + "rate_hz = 20.0\n"
    assert_means(read(tmp_path, rows, history("runs.txt", NAMES, reduction=timed), "runs.txt"))


def test_constants_from_the_file_name(tmp_path):
    """One file a run: run_id and drift angle stand in its name."""
    source = history(
        "drift/*.csv",
        "match = 'drift/(?P<run_id>[^_]+)_beta(?P<beta_deg>-?[0-9.]+)\\.csv'",
        CONSTANTS.replace('beta = "5 deg"\n', ""),
    )
    campaign(tmp_path, source)
    (tmp_path / "drift").mkdir()
    for k, beta in enumerate((-4, 2.5)):
        rows = "".join(f"{t!r},{x + beta!r}\n" for t, x in zip(TIME.tolist(), SERIES[:, 0].tolist(), strict=True))
        (tmp_path / "drift" / f"r{k}_beta{beta}.csv").write_text("time_s,X_N\n" + rows)
    runs = read_campaign(tmp_path).runs
    assert runs["run_id"].tolist() == ["r0", "r1"]
    np.testing.assert_allclose(np.degrees(runs["beta"]), [-4.0, 2.5])
    np.testing.assert_allclose(runs["X"], MEANS[0] + np.array([-4.0, 2.5]))
    (tmp_path / "drift" / "other.csv").write_text("time_s,X_N\n0,1\n")
    with pytest.raises(InputError, match=r"other\.csv' does not match"):
        read_campaign(tmp_path)


def test_files_that_are_not_there_are_named(tmp_path):
    with pytest.raises(InputError, match=r"no file 'runs\.csv'"):
        read_campaign(campaign(tmp_path, history("runs.csv")))


def test_runs_outside_a_stated_range_stay_in_the_table_and_are_not_used(tmp_path):
    within = "[source.within]\nbeta_deg = [-4.0, 4.0]\n"
    runs = read(tmp_path / "a", PLAIN, tidy("", MAP) + within)
    assert_values(runs)
    # 4 deg is written with other digits than the limit in radians; it is inside.
    assert runs["exclude"].map(bool).tolist() == [False, False, True]
    assert set("XYN") <= set(runs["exclude"].iloc[2].split())
    assert runs["reason"].iloc[2] == "beta_deg beyond -4 to 4"
    # The same numbers as from a file without that run: it is no measure of size either.
    found = identify(read_campaign(tmp_path / "a"))
    read(tmp_path / "b", PLAIN.rsplit("\n", 2)[0] + "\n", tidy("", MAP))
    without = identify(read_campaign(tmp_path / "b"))
    pd.testing.assert_frame_equal(database_rows(found), database_rows(without))
    assert {(one.run_id, one.reason) for one in found.unused} >= {("runs-4", "beta_deg beyond -4 to 4")}


@pytest.mark.parametrize(
    ("within", "words"),
    [
        ("beta_deg = [4.0, -4.0]", "first below the second"),
        ("beta_deg = [4.0]", "source.0.within.beta_deg"),
        ("beta = [-4.0, 4.0]", "no state of a run with its unit"),
        ("X_N = [-4.0, 4.0]", "no state of a run with its unit"),
        ("r_radps = [-4.0, 4.0]", "no r in the runs"),
    ],
)
def test_a_range_of_what_is_no_state_is_refused(tmp_path, within, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, PLAIN, tidy("", MAP) + f"[source.within]\n{within}\n")
    assert words in str(caught.value)
    assert "within" in str(caught.value)


def test_examples_of_the_documentation_fit_the_schema():
    """Every TOML block of docs/readers.md is a source that is accepted."""
    text = (Path(__file__).parents[1] / "docs" / "readers.md").read_text("utf-8")
    examples = [block.split("```")[0] for block in text.split("```toml\n")[1:]]
    assert len(examples) == 25
    for example in examples:
        data = tomllib.loads(example)["source"][0]
        history_ = data.get("rows") == "history" and "reduction" not in data
        Source.model_validate(data | ({"reduction": {"kind": "steady"}} if history_ else {}))


def test_ident_runs_lists_and_plots(tmp_path):
    source = history("runs.txt", NAMES)
    campaign(tmp_path / "c", source)
    (tmp_path / "c" / "runs.txt").write_text(ROWS)
    done = CliRunner().invoke(main, ["runs", str(tmp_path / "c"), "--out", str(tmp_path / "out"), "--json", "-"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    assert found[0]["run_id"] == "runs"
    assert found[0]["X"] == pytest.approx(MEANS[0], rel=1e-6)
    assert found[0]["Z"] is None
    assert (tmp_path / "out" / "history_runs.png").is_file()
    (tmp_path / "c" / "runs.txt").write_text(ROWS + "1 2\n")
    refused = CliRunner().invoke(main, ["runs", str(tmp_path / "c")])
    assert refused.exit_code == 2
    assert "row 401" in refused.output
