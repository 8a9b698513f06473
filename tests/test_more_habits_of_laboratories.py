"""What other laboratories write beside the cases that are known: read as it is meant, or refused with what to state."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from made_campaigns import (
    BETA,
    CONSTANTS,
    RUNS,
    SERIES,
    TIME,
    VALUES,
    assert_means,
    assert_values,
    campaign,
    history,
    read,
    reduced,
    runs_of,
    tidy,
)

from ident.captive.campaign import read_campaign
from ident.captive.headers import column
from ident.captive.quantities import factor, powers_of, split
from ident.checks.check import check_campaign
from sim.files.errors import InputError

HEADER = "beta_deg,X_N,Y_N,N_Nm"


def table(header: str = HEADER, y=lambda v: v, more: str = "") -> str:
    rows = [f"{b:g},{x!r},{y(v)},{n!r}" for b, (x, v, n) in zip(BETA, VALUES.tolist(), strict=True)]
    return "\n".join([header, *rows]) + "\n" + more


# -- headers --------------------------------------------------------------------------------------


@pytest.mark.parametrize("factors", [{}, {"KQ": 0.1}, {"10Kq": 0.1}])
@pytest.mark.parametrize("declared", [None, "KQ"])
def test_a_factor_under_either_name_is_the_only_one(tmp_path, factors, declared):
    """Ten times KQ is divided once, whether its header, its quantity or nothing is named in [source.factor]."""
    keys = f'[source.columns]\n"10Kq" = "{declared}"\n' if declared else ""
    keys += "".join(f'[source.factor]\n"{k}" = {v}\n' for k, v in factors.items())
    constants = '[source.constants]\ntest = "open_water"\npart = "propeller"\nquality = "ok"\nrel_sigma = 0.02\n'
    campaign(tmp_path, f'[[source]]\nfiles = "runs.csv"\n{keys}{constants}')
    (tmp_path / "runs.csv").write_text("J,KT,10Kq\n0.1,0.276,0.317\n0.5,0.14,0.185\n", "utf-8")
    np.testing.assert_allclose(read_campaign(tmp_path).runs["KQ"], [0.0317, 0.0185], rtol=1e-12)


@pytest.mark.parametrize(
    ("header", "declared"),
    [
        *((h, "Y [N]") for h in ("Y in kN", "Fy_kN", "Y {kN}", "kN Fy", "Fy (kN) mean", "Fy: lbf", "Fy|KN", "Fy/kN")),
        *((h, "U [m/s]") for h in ("speed knots", "V_kn", "U_kts")),
        ("drift_rad", "beta [deg]"),
        ("M_kNm", "M [N m]"),
    ],
)
def test_a_unit_anywhere_in_a_header_is_held_against_the_declared_one(header, declared):
    with pytest.raises(InputError, match="declared as"):
        column(header, declared, "f")


@pytest.mark.parametrize("header", ["X_dyn", "Fy_N", "Side force N", "Fy Newton", "Y_p (port)", "X_h"])
def test_words_of_headers_that_are_no_other_unit_pass(header):
    assert column(header, "Y [N]", "f").factor == 1.0


@pytest.mark.parametrize("header", ["Y' (milli)", "Y' E-3", "Y' (multiplied by 1000)", "Y' (\u00d71,000)", "Y'10"])
def test_a_multiple_in_words_asks_for_the_factor(header):
    with pytest.raises(InputError, match="names a multiple"):
        column(header, "Y [-]", "f")


@pytest.mark.parametrize("header", ["D [m]", "Diameter [m]", "arm diam. [ft]", "dia [m]"])
def test_a_diameter_is_no_radius_of_an_arm(header):
    with pytest.raises(InputError, match=r"diameter.*0\.5"):
        column(header, header.replace(header.split(" [")[0], "R0"), "f")
    assert column(header, "R0", "f", ["R0"]).quantity == "R0"


@pytest.mark.parametrize("unit", ["/deg", "per deg", "1/Deg", "per degree", "deg^-1"])
def test_per_degree_in_any_spelling(unit):
    found = powers_of(unit)
    assert found is not None
    assert found[0] == pytest.approx(180.0 / np.pi)
    assert found[1:] == (0.0, 0.0, 0.0, -1)


@pytest.mark.parametrize("header", ["CT*", "C_T", "CQ*", "C_Th", "cq", "thrust loading"])
def test_thrust_by_the_speed_of_the_flow_is_no_kt(header):
    """C_T* of four quadrants is over advance and blade speed, C_Th over advance alone."""
    meant = "KQ" if "q" in header.lower() else "KT"
    with pytest.raises(InputError, match="by the speed of the flow"):
        column(header, meant, "f.csv, row 1")
    assert column(header, meant, "f.csv, row 1", factors=[header]).quantity == meant
    assert column("Kt", "KT", "f.csv, row 1").quantity == "KT"


@pytest.mark.parametrize(
    ("header", "quantity", "expected"),
    [
        ("回頭ﾓｰﾒﾝﾄ[kgf･m]", "N", 9.80665),
        ("横力（Ｎ）", "Y", 1.0),
        ("モーメント（ｋＮ・ｍ）", "N", 1000.0),
        ("速度［㎧］", "U", 1.0),
        ("漂角(度)", "beta", math.radians(1.0)),
        ("Mz, кгс·м", "N", 9.80665),
        ("n, об/мин", "n", 1.0 / 60.0),
        ("加速度 [m/s²]", "vdot", 1.0),
    ],
)
def test_units_in_letters_of_other_scripts(header, quantity, expected):
    """Wide letters and brackets, middle dots of Japanese text, Cyrillic."""
    assert factor(quantity, split(header)[1] or "") == pytest.approx(expected, rel=1e-12)


def test_a_radius_in_lengths_says_what_to_state():
    with pytest.raises(InputError, match="the length in"):
        column("R/L", None, "f")


# -- values that stand for nothing ----------------------------------------------------------------

WORDS = ["NaN", "nan", "#N/A", "-", "9.99e37", "OL", "", "-1.#IND"]


@pytest.mark.parametrize("word", WORDS)
def test_a_word_for_nothing_is_named_and_left_out_of_a_record_once_stated(tmp_path, word):
    rows = [",".join([f"{t:.2f}", *(f"{v:.9g}" for v in row)]) for t, row in zip(TIME, SERIES, strict=True)]
    for at in (100, 250):
        t, x, _, n = rows[at].split(",")
        rows[at] = f"{t},{x},{word},{n}"
    (tmp_path / "run.csv").write_text("\n".join(["time_s,X_N,Y_N,N_Nm", *rows]) + "\n", "utf-8")
    with pytest.raises(InputError, match=r"row 102.*missing = \['"):
        reduced(tmp_path, "run.csv")
    done = reduced(tmp_path, "run.csv", f'missing = ["{word}"]\n')
    assert "2 sentinel samples of Y left out" in done["reduction"].iloc[0]
    np.testing.assert_allclose(done["Y"], np.delete(SERIES[:, 1], [100, 250]).mean(), rtol=1e-7)


@pytest.mark.parametrize("word", ["NaN", "n/a", "--", "9.99e37"])
def test_a_word_for_nothing_is_a_blank_of_a_table_once_stated(tmp_path, word):
    text = table(y=lambda v: word if v > 8000.0 else v)
    with pytest.raises(InputError, match=r"missing = \['"):
        read(tmp_path, text, tidy())
    runs = read(tmp_path, text, tidy(f'missing = ["{word}"]'))
    np.testing.assert_array_equal(np.isnan(runs["Y"]), [False, False, True])


@pytest.mark.parametrize("value", [-999.25, -9999.0, 32767.0, 99999.0])
def test_what_loggers_write_for_nothing_is_no_load_of_a_table(tmp_path, value):
    """Loads of a few tens of newtons beside it."""
    rows = [f"{b},-30,{20 * b},{25 * b if b != 6 else value}" for b in (2, 4, 6, 8, 10)]
    text = "\n".join([HEADER, *rows]) + "\n"
    with pytest.raises(InputError, match=r"row 4, column N_Nm.*missing = \["):
        read(tmp_path, text, tidy())
    runs = read(tmp_path, text, tidy(f"missing = [{value}]"))
    assert np.isnan(runs["N"]).tolist() == [False, False, True, False, False]


@pytest.mark.parametrize("value", [-999.25, -32768.0, 0.0, -888.0])
@pytest.mark.parametrize("share", [0.03, 0.4])
def test_a_value_that_stands_often_and_far_away_is_left_out(tmp_path, value, share):
    series = SERIES.copy()
    chosen = np.random.default_rng(5).permutation(np.arange(20, 380))[: int(share * 400)]
    series[chosen, 0] = value
    frame = pd.DataFrame(np.column_stack([TIME, series]), columns=["time_s", "X_N", "Y_N", "N_Nm"])
    frame.to_csv(tmp_path / "run.csv", index=False)
    run = reduced(tmp_path, "run.csv").iloc[0]
    assert abs(run["X"] - VALUES[0, 0]) < 5.0 * run["s_X"] < 1.0
    assert "of X left out" in run["reduction"]
    assert "clipped" not in run["reduction"]


@pytest.mark.parametrize("spikes", [0, 1, 2])
@pytest.mark.parametrize("value", [-0.12, 123.456, 0.0])
def test_a_constant_channel_is_not_clipped_by_a_spike_in_it(tmp_path, spikes, value):
    constant = np.full(400, value)
    constant[[150, 320][:spikes]] = 5.0
    frame = pd.DataFrame(np.column_stack([TIME, SERIES, constant]), columns=["time_s", "X_N", "Y_N", "N_Nm", "Z_N"])
    frame.to_csv(tmp_path / "run.csv", index=False)
    words = reduced(tmp_path, "run.csv")["reduction"].iloc[0]
    assert "clipped" not in words
    assert "window 0-19.95 s" in words


@pytest.mark.parametrize("leap", [50.0, 1e5])
@pytest.mark.parametrize("at", [200, 399])
def test_the_sample_behind_a_gap_of_the_clock_does_not_stand_for_it(tmp_path, leap, at):
    time = TIME + np.where(np.arange(400) >= at, leap, 0.0)
    frame = pd.DataFrame(np.column_stack([time, SERIES]), columns=["time_s", "X_N", "Y_N", "N_Nm"])
    frame.to_csv(tmp_path / "run.csv", index=False)
    assert_means(reduced(tmp_path, "run.csv"))
    found = [f for f in check_campaign(read_campaign(tmp_path), tmp_path) if f.check == "time"]
    assert [f.rows for f in found] == [(at + 2,)]


# -- files of arrays --------------------------------------------------------------------------------

CHANNELS = {"time_s": TIME, "X_N": SERIES[:, 0], "Y_N": SERIES[:, 1], "N_Nm": SERIES[:, 2]}


def saved(path, columns, kind):
    if kind == "matlab":
        from scipy.io import savemat

        savemat(path, columns)
    elif kind == "hdf5":
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as made:
            for name, values in columns.items():
                made[name] = values
    else:
        nptdms = pytest.importorskip("nptdms")
        with nptdms.TdmsWriter(path) as made:
            made.write_segment([nptdms.ChannelObject("run", n, np.ravel(v)) for n, v in columns.items()])


KINDS = {"matlab": "run.mat", "hdf5": "run.h5", "tdms": "run.tdms"}


@pytest.mark.parametrize("kind", KINDS)
def test_a_quantity_of_another_length_is_not_passed_over(tmp_path, kind):
    name = KINDS[kind]
    saved(tmp_path / name, {**CHANNELS, "N_Nm": SERIES[::2, 2].copy()}, kind)
    with pytest.raises(InputError, match=r"N_Nm: 200 values, and others 400.*ignore"):
        reduced(tmp_path, name)
    assert reduced(tmp_path, name, 'ignore = ["N_Nm"]\n')["N"].isna().all()


@pytest.mark.parametrize("kind", ["matlab", "hdf5"])
def test_a_single_number_with_a_unit_holds_for_the_whole_record(tmp_path, kind):
    name = KINDS[kind]
    saved(tmp_path / name, {**CHANNELS, "U_mps": 2.0, "samples": 400.0}, kind)
    campaign(tmp_path, history(name, constants=CONSTANTS.replace('U = "2 m/s"\n', "")))
    assert read_campaign(tmp_path).runs["U"].iloc[0] == pytest.approx(2.0)
    with pytest.raises(InputError, match="U is measured and stands in"):
        reduced(tmp_path, name)


@pytest.mark.parametrize("kind", KINDS)
def test_nan_of_an_array_is_named_and_left_out_once_stated(tmp_path, kind):
    name, spoiled = KINDS[kind], SERIES[:, 1].copy()
    spoiled[100] = np.nan
    saved(tmp_path / name, {**CHANNELS, "Y_N": spoiled}, kind)
    with pytest.raises(InputError, match=r"missing = \['NaN'\]"):
        reduced(tmp_path, name)
    run = reduced(tmp_path, name, 'missing = ["NaN"]\n').iloc[0]
    assert run["Y"] == pytest.approx(np.delete(spoiled, 100).mean(), rel=1e-9)


def test_structs_in_structs_and_arrays_of_them_are_tables_by_their_path(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"run": {"data": CHANNELS, "info": "x"}})
    assert_means(reduced(tmp_path, "run.mat"))
    several = np.array([tuple(CHANNELS.values())] * 2, dtype=[(k, object) for k in CHANNELS])
    savemat(tmp_path / "run.mat", {"run": several})
    with pytest.raises(InputError, match=r"'run\(1\)', 'run\(2\)'"):
        reduced(tmp_path, "run.mat")
    assert_means(reduced(tmp_path, "run.mat", 'table = "run(2)"\n'))


def test_complex_numbers_are_real_or_refused(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {**CHANNELS, "Y_N": SERIES[:, 1] + 0j})
    assert_means(reduced(tmp_path, "run.mat"))
    savemat(tmp_path / "run.mat", {**CHANNELS, "Y_N": SERIES[:, 1] + 1j})
    with pytest.raises(InputError, match="complex"):
        reduced(tmp_path, "run.mat")


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_packed_variables_of_netcdf_are_unpacked(tmp_path, engine):
    """Integers times ``scale_factor`` plus ``add_offset``, as the CF conventions have it and xarray writes."""
    xarray = pytest.importorskip("xarray")
    made = xarray.Dataset(
        {
            k: ("time", SERIES[:, i].copy(), {"units": u})
            for i, (k, u) in enumerate((("X", "N"), ("Y", "N"), ("N", "N m")))
        },
        coords={"time": ("time", TIME, {"units": "s"})},
    )
    packed = {"dtype": "int32", "scale_factor": 0.001, "add_offset": 2750.0, "_FillValue": -(2**31)}
    made.to_netcdf(tmp_path / "run.nc", engine=engine, encoding={"Y": packed})
    assert_means(reduced(tmp_path, "run.nc"))
    made["Y"][7] = np.nan
    made.to_netcdf(tmp_path / "run.nc", engine=engine, encoding={"Y": packed})
    assert "1 sentinel samples of Y" in reduced(tmp_path, "run.nc", 'missing = ["NaN"]\n')["reduction"].iloc[0]


def test_a_zip_archive_is_called_one(tmp_path):
    import zipfile

    with zipfile.ZipFile(tmp_path / "runs.zip", "w") as made:
        made.writestr("runs.csv", table())
    with pytest.raises(InputError, match=r"a zip archive of runs\.csv"):
        runs_of(tmp_path, "runs.zip")


def test_a_tecplot_zone_holds_as_many_points_as_it_says(tmp_path):
    """Four variables named, three written: twelve hundred numbers would be three hundred points of another thing."""
    lines = ['TITLE = "x"', 'VARIABLES = "time [s]" "X [N]" "Y [N]" "N [N m]"', 'ZONE T="run", I=400, F=POINT']
    rows = [" ".join(map(repr, row)) for row in np.column_stack([TIME, SERIES]).tolist()]
    (tmp_path / "run.dat").write_text("\n".join([*lines, *rows]) + "\n", "utf-8")
    assert_means(reduced(tmp_path, "run.dat"))
    short = [row.rsplit(" ", 1)[0] for row in rows]
    (tmp_path / "run.dat").write_text("\n".join([*lines, *short]) + "\n", "utf-8")
    with pytest.raises(InputError, match="1200 numbers for 4 variables"):
        reduced(tmp_path, "run.dat")


@pytest.mark.parametrize(("unit", "factor"), [("Newtons", 1.0), ("kN", 1e3), ("a.u.", 1.0)])
def test_the_units_of_an_lvm_header_are_those_of_its_channels(tmp_path, unit, factor):
    head = ["LabVIEW Measurement", "Separator\tTab", "***End_of_Header***\t", "", "Channels\t3"]
    head += [f"Y_Unit_Label\t{unit}\t{unit}\tNm", "***End_of_Header***\t", "X_Value\tFx\tFy\tMz\tComment"]
    table = np.column_stack([TIME, SERIES[:, :2] / factor, SERIES[:, 2]]).tolist()
    lines = [*head, *("\t".join(map(repr, row)) + "\t" for row in table)]
    (tmp_path / "run.lvm").write_text("\n".join(lines) + "\n", "utf-8")
    names = 'ignore = ["Comment"]\n[source.columns]\nX_Value = "time [s]"\nMz = "N"\nFx = "X{0}"\nFy = "Y{0}"\n'
    assert_means(reduced(tmp_path, "run.lvm", names.format("" if unit != "a.u." else " [N]")))
    if unit == "kN":
        with pytest.raises(InputError, match="unit 'kN', declared as 'N'"):
            reduced(tmp_path, "run.lvm", names.format(" [N]"))


# -- names of files -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "expected"), [("neg4d5", -4.5), ("minus4", -4.0), ("plus4p5", 4.5), ("pos_4", 4.0), ("4d5", 4.5)]
)
def test_words_for_signs_and_a_d_for_the_point_in_file_names(tmp_path, written, expected):
    source = tidy("match = 'b_(?P<beta_deg>.+)[.]csv'", constants=RUNS).replace("runs.*", "b_*.csv")
    runs = read(tmp_path, "X_N,Y_N,N_Nm\n-1234.5,2750.25,12500\n", source, f"b_{written}.csv")
    assert np.degrees(runs["beta"].iloc[0]) == pytest.approx(expected)


def test_the_usual_table_is_read_as_it_was(tmp_path):
    assert_values(read(tmp_path, table(), tidy()))


def test_the_names_of_a_table_in_a_comment(tmp_path):
    text = "# Tank 2\n#beta_deg,X_N,Y_N,N_Nm\n# calm\n" + "".join(f"{b},1,2,3\n" for b in (2, 4))
    runs = read(tmp_path, text, tidy('header_pattern = "^#beta"\ndelimiter = ","'))
    assert np.degrees(runs["beta"]).tolist() == pytest.approx([2.0, 4.0])


@pytest.mark.parametrize(
    ("header", "declared", "words"),
    [
        ("Y p-p [N]", "Y_amp [N]", "another size"),
        ("Y peak to peak", "Y_amp [N]", "another size"),
        ("double amplitude [m]", "displacement [m]", "another size"),
        ("Y rms", "Y [N]", "another size"),
        ("Y phase lag [deg]", "Y_phase [deg]", "the opposite.*Y_lag"),
        ("Y lead [deg]", "Y_lag [deg]", "the opposite.*Y_phase"),
        ("Y phase (vel) [deg]", "Y_phase [deg]", "another reference"),
    ],
)
def test_a_size_or_phase_of_another_meaning_asks_for_a_factor(header, declared, words):
    with pytest.raises(InputError, match=words):
        column(header, declared, "f")
    assert column(header, declared, "f", [header]).quantity == split(declared)[0]


@pytest.mark.parametrize("header", ["Fx pressure", "Y peak", "s_X", "Y black", "lagoon Y"])
def test_words_that_are_like_these_pass(header):
    assert column(header, "Y_phase [deg]", "f").quantity == "Y_phase"


def test_a_factor_makes_newtons_of_volts(tmp_path):
    text = "beta_deg,bridge [mV],Y_N,N_Nm\n" + "".join(f"{b},-2,2,3\n" for b in (2, 4))
    named = 'bridge = "X [N]"'
    with pytest.raises(InputError, match="unit 'mV', declared as 'N'"):
        read(tmp_path, text, tidy("", named))
    runs = read(tmp_path, text, tidy("", named + "\n[source.factor]\nbridge = 50.0"))
    assert runs["X"].tolist() == pytest.approx([-100.0, -100.0])
    with pytest.raises(InputError, match="unit 'kN', declared as 'N'"):
        read(tmp_path, text.replace("mV", "kN"), tidy("", named + "\n[source.factor]\nbridge = 50.0"))


@pytest.mark.parametrize("unit", ["(deg)", "[°]", "deg"])
def test_a_row_of_units_that_is_not_declared_names_the_key(tmp_path, unit):
    text = f"beta,X_N,Y_N,N_Nm\n{unit},,,\n2,1,2,3\n"
    with pytest.raises(InputError, match="units_row = true"):
        read(tmp_path, text, tidy("", 'beta = "beta [deg]"'))


def test_columns_parted_by_another_mark_are_called_so(tmp_path):
    with pytest.raises(InputError, match=r"one column, and 3 times '\|'"):
        read(tmp_path, "beta_deg|X_N|Y_N|N_Nm\n2|1|2|3\n", tidy())


@pytest.mark.parametrize(("again", "words"), [(0.0, "one run a file"), (None, "rate_hz")])
def test_runs_below_each_other_are_not_asked_for_a_rate(tmp_path, again, words):
    """A second run steps back once; stamps of too few digits repeat."""
    time = np.concatenate([TIME, TIME]) if again is not None else np.floor(TIME)
    text = "time_s,X_N,Y_N,N_Nm\n" + "".join(f"{t!r},1.0,2.0,3.0\n" for t in time.tolist())
    (tmp_path / "run.csv").write_text(text, "utf-8")
    with pytest.raises(InputError, match=words):
        reduced(tmp_path, "run.csv")


@pytest.mark.parametrize("units_row", [False, True])
def test_names_that_a_spreadsheet_wrapped(tmp_path, units_row):
    names = [("beta", "deg"), ("X", "N"), ("Y", "N"), ("N", "N m")]
    header = ",".join(f'"{n}\nof the hull"' if units_row else f'"{n}\n[{u}]"' for n, u in names)
    text = table(header + ("\n" + ",".join(u for _, u in names) if units_row else ""))
    named = "\n".join(f'"{n} of the hull" = "{n}"' for n, _ in names) if units_row else ""
    assert_values(read(tmp_path, text, tidy("units_row = true" if units_row else "", named)))
