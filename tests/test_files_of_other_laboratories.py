"""Authority: the same numbers, written as tools of other countries and vendors write them, read the same.

Encodings, digits in groups, lines of spreadsheets, empty and nameless columns, free-text headers,
paged and fixed-width files, runs still being written, Parquet types and units in its metadata.
"""

from __future__ import annotations

from decimal import Decimal

import numpy as np
import pandas as pd
import pytest
from made_campaigns import (
    BETA,
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

from ident.captive.campaign import read_campaign
from ident.captive.quantities import factor
from sim.files.errors import InputError

HEADER = ["beta_deg", "X [N]", "Y [N]", "N [N m]"]


def rows(form, delimiter: str) -> str:
    table = zip(BETA, VALUES.tolist(), strict=True)
    return "".join(delimiter.join(form(v) for v in (b, *row)) + "\n" for b, row in table)


def comma(group: str = ""):
    """Numbers with a decimal comma and a mark between thousands."""
    return lambda v: f"{v:,.2f}".replace(",", "#").replace(".", ",").replace("#", group)


PLAIN = ",".join(HEADER) + "\n" + rows(repr, ",")
TABS = "\t".join(HEADER) + "\n" + rows(comma(), "\t")
SEMICOLONS = ";".join(HEADER) + "\n"


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        (TABS.encode("utf-16"), ""),
        (TABS.encode("utf-16-be"), 'encoding = "utf-16-be"'),
        (b"\xfe\xff" + TABS.encode("utf-16-be"), ""),
        (b"\xef\xbb\xbf" + PLAIN.encode(), 'encoding = "cp1252"'),
        ((";".join(["beta [\u00b0]", *HEADER[1:3], "N [N\u00b7m]"]) + "\n" + rows(comma(), ";")).encode("cp1252"),
         'encoding = "cp1252"'),
        ("sep=;\n" + SEMICOLONS + rows(comma(), ";"), ""),
        ('"sep=,"\r\n' + PLAIN, ""),
        (SEMICOLONS + rows(lambda v: f"{v:,.2f}".replace(",", "'"), ";"), ""),
        (SEMICOLONS + rows(lambda v: f"{v:,.2f}".replace(",", "\u2019"), ";"), ""),
        (SEMICOLONS + rows(comma("\u00a0"), ";"), ""),
        (SEMICOLONS + rows(comma("\u202f"), ";"), ""),
        (SEMICOLONS + rows(comma(" "), ";"), ""),
        (PLAIN.replace("-", "\u2212"), ""),
        (PLAIN + ",,,\n,,,\n\x1a", ""),
        (",,,\n" + PLAIN.replace("\n", ",,\n"), ""),
        (PLAIN.replace(",X", ",,X").replace(",-", ",,-"), ""),
        ("," + PLAIN.replace("\n", "\n7,", 3), 'ignore = ["column 1"]'),
        (PLAIN.replace("\n", ",a,b\n").replace(",a,b", ",Note,Note", 1), 'ignore = ["Note"]'),
        ("Drift tests; hall 3\n\n" + PLAIN, 'header_pattern = "^beta"\ndelimiter = ","'),
        ("; made by LabVIEW\n" + PLAIN, 'skip = "^;"'),
        (PLAIN.replace("[N m]", "[N-m]"), ""),
        (PLAIN.replace("beta_deg", "beta [\u00ba]"), ""),
    ],
    ids=["UTF-16", "UTF-16 stated", "UTF-16 BE", "mark before word", "cp1252", "sep", "sep quoted", "Swiss",
         "Swiss curly", "no-break", "narrow", "blank", "minus", "empty rows", "empty row first", "empty column",
         "index", "twice", "title", "skip", "N-m", "ordinal"],
)  # fmt: skip
def test_tidy_tables_of_the_world(tmp_path, text, keys):
    assert_values(read(tmp_path, text, tidy(keys)))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Drift tests\n" + PLAIN, "row 1 (header): 1 names above 4 cells (allowed: a name for every column; header_p"),
        ("," + PLAIN.replace("\n", "\n7,", 3), 'column 1) (allowed: a name for every column, or ignore = ["column 1"]'),
        (PLAIN.replace("beta_deg", "beta [Grad]"), "unit 'Grad' for beta"),
        (PLAIN.replace("beta_deg", "beta [\u00b0]").encode("latin-1"), "latin-1, cp1252, shift_jis"),
        (TABS.encode("utf-16-le"), 'encoding = "utf-16-le"'),
        (b"PK\x03\x04\x14\x00\x06\x00", "not a workbook"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "not a workbook"),
        (PLAIN.replace("2750.25", "NaN"), "row 2, column Y [N]: 'NaN'"),
        (PLAIN.replace("2750.25", "#N/A"), "row 2, column Y [N]: '#N/A'"),
        ("beta_deg;X [N];Note\n2;1,234;12 345\n", "row 2: '1,234' (allowed: decimal"),
        (SEMICOLONS + "2;1'2345;2;3\n", 'row 2, column X [N]: "1\'2345"'),
    ],
)
def test_what_could_be_read_two_ways_is_refused_with_its_place(tmp_path, text, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text, tidy())
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("quantity", "unit", "expected"),
    [
        ("N", "N-m", 1.0),
        ("N", "kN-m", 1e3),
        ("N", "ft-lbf", 1.3558179483314),
        ("N", "m s-2", None),
        ("vdot", "m s-2", 1.0),
        ("vdot", "m·s⁻²", 1.0),
        ("X", "t", None),
    ],
)
def test_hyphens_and_raised_digits_of_units(quantity, unit, expected):
    """A hyphen between two units multiplies, as STAR-CCM+ writes it; before a digit it is the exponent's sign."""
    assert factor(quantity, unit) == (pytest.approx(expected) if expected else None)


def test_words_in_brackets_are_no_unit_and_a_unit_is_no_word(tmp_path):
    text = PLAIN.replace("X [N]", "Drag (hull)")
    assert_values(read(tmp_path / "a", text, tidy("", '"Drag (hull)" = "X [N]"')))
    for unit in ("m", "Kn", "KN"):
        with pytest.raises(InputError, match=f"unit '{unit}', declared as 'N'"):
            read(tmp_path / "b", text.replace("hull", unit), tidy("", f'"Drag ({unit})" = "X [N]"'))
    with pytest.raises(InputError, match="unit 'hull', declared as 'N'"):
        read(tmp_path / "b", text.replace("(hull)", "[hull]"), tidy("", '"Drag [hull]" = "X [N]"'))


# -- Parquet ---------------------------------------------------------------------------------

FRAME = pd.DataFrame(np.column_stack([BETA, VALUES]), columns=HEADER)


@pytest.mark.parametrize(
    "frame",
    [
        FRAME.astype({"beta_deg": "Int8", "N [N m]": "int32", "X [N]": "float32"}),
        FRAME.assign(**{"X [N]": [Decimal(str(v)) for v in VALUES[:, 0]]}),
        FRAME.astype({"X [N]": str}).astype({"X [N]": "category"}).assign(source=pd.Categorical(["a", "b", "a"])),
        FRAME.set_axis(["r1", "r2", "r3"]),
        FRAME.set_axis(pd.Index(["r1", "r2", "r3"], name="run_id")),
        FRAME.assign(**{"Z [N]": pd.array([1, None, 3], "Int64")}),
    ],
    ids=["narrow", "decimal", "categories", "index", "named index", "nullable"],
)
def test_parquet_of_any_number_type(tmp_path, frame):
    campaign(tmp_path, tidy())
    frame.to_parquet(tmp_path / "runs.parquet")
    assert_values(read_campaign(tmp_path).runs)


def test_parquet_units_from_the_metadata(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    kilo = FRAME.set_axis(["beta", "X", "Y", "N"], axis=1).assign(X=VALUES[:, 0] / 1e3)
    units = {"beta": "deg", "X": "kN", "Y": "N", "N": "N m"}
    campaign(tmp_path, tidy())
    schema = pa.schema([pa.field(n, pa.float64(), metadata={"unit": u}) for n, u in units.items()])
    pq.write_table(pa.table(kilo, schema=schema), tmp_path / "runs.parquet")
    assert_values(read_campaign(tmp_path).runs)
    kilo.attrs["units"] = units
    kilo.to_parquet(tmp_path / "runs.parquet")
    assert_values(read_campaign(tmp_path).runs)
    # A unit in the name stands, and what is no quantity has none.
    named = kilo.rename(columns={"beta": "beta_deg"}).assign(source="tank")
    named.attrs["units"] = {**units, "beta_deg": "deg", "source": "-"}
    named.to_parquet(tmp_path / "runs.parquet")
    assert_values(read_campaign(tmp_path).runs)


@pytest.mark.parametrize(
    ("time", "words"),
    [
        (pd.to_timedelta(TIME, unit="s"), "column time [s]: a column of duration[ns]"),
        (pd.date_range("2020", periods=400, freq="50ms"), "a column of timestamp"),
        (TIME > 3.0, "a column of bool"),
    ],
)
def test_parquet_time_of_another_type_is_no_number(tmp_path, time, words):
    """Durations are stored as nanoseconds: read as numbers they would be a billion times too long."""
    campaign(tmp_path, history("runs.parquet"))
    pd.DataFrame({"time [s]": time, "X [N]": SERIES[:, 0]}).to_parquet(tmp_path / "runs.parquet")
    with pytest.raises(InputError) as caught:
        read_campaign(tmp_path)
    assert words in str(caught.value)


# -- STAR-CCM+ -------------------------------------------------------------------------------

STAR_HEADER = (
    '"Iteration","Physical Time: Physical Time (s)","Drag Monitor: Drag, hull (N)",'
    '"Side Monitor: Force (kN)","Yaw Monitor: Moment (N-m)"'
)
STAR = [f"{i},{t!r},{x!r},{y / 1e3!r},{n!r}" for i, (t, x, y, n) in enumerate(SAMPLES)]
PATTERNS = """[source.patterns]
'^Physical Time:' = "time"
'^Drag Monitor' = "X"
'^Side Monitor' = "Y"
'^Yaw Monitor' = "N"
"""
BLANK = STAR[-1].rsplit(",", 1)[0] + ","


def star(lines: list[str], end: str = "\n") -> str:
    return "\n".join([STAR_HEADER, *lines]) + end


@pytest.mark.parametrize(
    ("patterns", "reduction"),
    [
        (PATTERNS, STEADY),
        (PATTERNS.replace('"N"', '"N [N m]"').replace('"Y"', '"Y [kN]"'), STEADY),
        (PATTERNS.replace("^Physical Time:", "^Iteration$").replace('"time"', '"time [s]"'), STEADY),
        (PATTERNS.replace("'^Physical Time:' = \"time\"\n", ""), STEADY + "rate_hz = 20.0\n"),
    ],
    ids=["as exported", "units stated too", "iterations", "rate"],
)
def test_monitors_as_exported(tmp_path, patterns, reduction):
    assert_means(read(tmp_path, star(STAR), history("runs.csv", patterns, reduction=reduction)))


@pytest.mark.parametrize(
    ("text", "left"),
    [
        (star([*STAR[:-1], BLANK]), 399),
        (star([*STAR[:-2], BLANK, "399,19.95,,,"]), 398),
        (star(STAR)[:-20], 399),
        # The last number may be cut though it still is one.
        (star(STAR)[:-4], 399),
    ],
)
def test_a_simulation_that_is_still_running_is_read_to_its_last_whole_row(tmp_path, text, left):
    run = read(tmp_path, text, history("runs.csv", PATTERNS)).iloc[0]
    np.testing.assert_allclose(run[["X", "Y", "N"]].astype(float), SERIES[:left].mean(axis=0), rtol=1e-9)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([*STAR[:50], BLANK, *STAR[51:]], "row 52, column Yaw Monitor: Moment (N-m): nothing"),
        ([*STAR[:-11], *[BLANK] * 11], "row 391, column Yaw Monitor: Moment (N-m): nothing"),
        ([*STAR[:200], STAR_HEADER, *STAR[200:]], "row 202, column Physical Time"),
        ([*STAR[:-1], STAR[-1].rsplit(",", 1)[0] + ",NaN"], "row 401, column Yaw Monitor: Moment (N-m): 'NaN'"),
    ],
    ids=["gap", "monitor stopped", "header again", "NaN"],
)
def test_gaps_of_a_monitor_are_refused(tmp_path, lines, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, star(lines), history("runs.csv", PATTERNS))
    assert words in str(caught.value)


# -- tank files ------------------------------------------------------------------------------

NAMES = 'names = ["time [s]", "X [N]", "Y [N]", "N [N m]"]'
COLUMNS = [f"{t:8.3f}{x:14.5f}{y:14.5f}{n:14.5f}\n" for t, x, y, n in SAMPLES]
GERMAN = "Schleppversuch 17, Prüfer: Müller\nWasser 15,3 °C, Tiefe 2,5 m\n\nZeit  Längskraft  Querkraft  Giermoment\n"
FRENCH = "Essai n° 17 – opérateur: Hélène\nTemps   Fx  Fy  Mz\n"
JAPANESE = "曳航試験 第17回 水温 15.3 ℃\n時間   前後力   横力   モーメント\n"


@pytest.mark.parametrize(
    ("head", "encoding"),
    [(GERMAN, "latin-1"), (GERMAN, "cp1252"), (FRENCH, "cp1252"), (FRENCH, "utf-8"), (JAPANESE, "utf-8"),
     (JAPANESE, "cp932"), (JAPANESE.replace("℃", "C"), "shift_jis"), (JAPANESE, "euc_jp")],
)  # fmt: skip
@pytest.mark.parametrize("mark", [".", ","])
def test_free_text_of_any_language(tmp_path, head, encoding, mark):
    text = head + "".join(COLUMNS).replace(".", mark)
    source = history("runs.txt", f'{NAMES}\nencoding = "{encoding}"')
    assert_means(read(tmp_path / "a", text.encode(encoding), source, "runs.txt"))
    if encoding != "utf-8":
        with pytest.raises(InputError, match="not utf-8 text"):
            read(tmp_path / "b", text.encode(encoding), history("runs.txt", NAMES), "runs.txt")


PAGE = "\fSchleppversuch 17  Seite 2\nZeit Fx Fy Mz\n s N N Nm\n"
WIDE = [f"{t:8.3f}{x:10.3f}{y:9.3f}{n:9.2f}\n" for t, x, y, n in SAMPLES]
DELIMITED = "".join(";".join(line.split()).replace(".", ",") + "\n" for line in COLUMNS)
CHANNELS = '[source.columns]\nZeit = "time{}"\nFx = "X{}"\nFy = "Y{}"\nMz = "N{}"'


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("".join([*COLUMNS[:200], PAGE, *COLUMNS[200:], "Ende\n"]), NAMES + "\nskip = '^\\f?(Schlepp|Zeit| s |Ende)'"),
        ("".join(WIDE), NAMES + "\nwidths = [8, 10, 9, 9]"),
        ("".join(line.rstrip() + " 7 8\n" for line in COLUMNS), NAMES[:-1] + ', "-", "-"]\nignore = ["-"]'),
        ("Versuch 17; Halle 3\nZeit;Fx;Fy;Mz\n" + DELIMITED,
         'header_pattern = "^Zeit;"\ndelimiter = ";"\n' + CHANNELS.format(" [s]", " [N]", " [N]", " [N m]")),
        ("Versuch 17; Halle 3\nZeit;Fx;Fy;Mz\ns;N;N;Nm\n" + DELIMITED,
         'header_pattern = "^Zeit;"\ndelimiter = ";"\nunits_row = true\n' + CHANNELS.format("", "", "", "")),
        ("".join(COLUMNS) + "  20.000   -12", NAMES),
    ],
    ids=["pages", "widths", "columns left out", "title", "title and units", "being written"],
)  # fmt: skip
def test_tank_files_as_they_are_printed(tmp_path, text, keys):
    run = read(tmp_path, text, history("runs.txt", keys), "runs.txt").iloc[0]
    np.testing.assert_allclose(run[["X", "Y", "N"]].astype(float), MEANS, rtol=1e-6)


def test_fixed_widths_that_touch_are_set_apart(tmp_path):
    touching = "".join(f"{t:6.2f}{x:7.1f}{y:6.1f}{n:7.1f}\n" for t, x, y, n in SAMPLES)
    assert touching.splitlines()[0].split()[0].count(".") == 4
    with pytest.raises(InputError, match="widths"):
        read(tmp_path / "a", touching, history("runs.txt", NAMES), "runs.txt")
    run = read(tmp_path / "b", touching, history("runs.txt", NAMES + "\nwidths = [6, 7, 6, 7]"), "runs.txt").iloc[0]
    np.testing.assert_allclose(run[["X", "Y", "N"]].astype(float), np.round(SERIES, 1).mean(axis=0), rtol=1e-6)


@pytest.mark.parametrize(
    ("text", "keys", "words"),
    [
        ("".join(COLUMNS[:200]) + PAGE + "".join(COLUMNS[200:]), NAMES, "row 201, column time [s]: 'Schleppversuch'"),
        ("".join(COLUMNS) + "Ende der Messung\n", NAMES, "3 cells (allowed: 4 cells, as in the header; skip ="),
        ("".join(COLUMNS), NAMES + '\nskip = "["', "regular expression"),
        ("".join(COLUMNS).replace("  ", "  1", 1), NAMES + "\nwidths = [0]", "widths"),
    ],
)
def test_lines_that_are_no_data_are_refused_until_the_campaign_names_them(tmp_path, text, keys, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text, history("runs.txt", keys), "runs.txt")
    assert words in str(caught.value)
