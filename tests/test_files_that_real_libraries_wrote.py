"""Workbooks, MATLAB, HDF5, netCDF, TDMS, LVM, gzip and clocks: the same numbers whatever wrote them."""

from __future__ import annotations

import datetime
import gzip
import sys

import numpy as np
import pandas as pd
import pytest
from made_campaigns import (
    BETA,
    CONSTANTS,
    SERIES,
    TIME,
    VALUES,
    assert_means,
    assert_values,
    campaign,
    history,
    reduced,
    runs_of,
    tidy,
)

from ident.captive.campaign import read_campaign
from ident.captive.readers.opening import reader_of
from ident.captive.source import Source
from sim.files.errors import InputError

NAMES = ["beta_deg", "X_N", "Y_N", "N_Nm"]
RUNS = np.column_stack([BETA, VALUES])
CHANNELS = ["time_s", "X_N", "Y_N", "N_Nm"]
RECORD = np.column_stack([TIME, SERIES])


# -- workbooks ------------------------------------------------------------------------------------


def book(folder, name: str, rows, sheet: str = "drift", more: str = "") -> None:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    if name.endswith(".ods"):
        with pd.ExcelWriter(path, engine="odf") as writer:
            pd.DataFrame(rows).to_excel(writer, sheet_name=sheet, header=False, index=False)
        return
    import openpyxl

    made = openpyxl.Workbook()
    made.active.title = sheet
    for row in rows:
        made.active.append(list(row))
    if more:
        made.create_sheet(more).append(["a note"])
    made.save(path)


@pytest.mark.parametrize("name", ["runs.xlsx", "runs.ods"])
def test_a_worksheet_is_a_table_of_runs(tmp_path, name):
    book(tmp_path, name, [NAMES, *RUNS.tolist()])
    assert_values(runs_of(tmp_path, name))


def test_a_workbook_of_several_sheets_with_titles_units_and_comments(tmp_path):
    rows = [["Tank 2, 2019"], [], ["beta", "X", "Y", "N"], ["deg", "kN", "N", "N m"]]
    rows += [[b, x / 1000.0, y, n] for b, (x, y, n) in zip(BETA, VALUES.tolist(), strict=True)]
    rows += [["mean of three"]]
    book(tmp_path, "runs.xlsx", rows, more="notes")
    keys = 'table = "drift"\nheader_pattern = "^beta"\nunits_row = true\nskip = "^mean"'
    assert_values(runs_of(tmp_path, "runs.xlsx", keys))
    with pytest.raises(InputError, match="2 worksheets"):
        runs_of(tmp_path, "runs.xlsx", keys.replace('table = "drift"\n', ""))
    with pytest.raises(InputError, match="no worksheet 'yaw'"):
        runs_of(tmp_path, "runs.xlsx", keys.replace('"drift"', '"yaw"'))


@pytest.mark.parametrize("kind", ["datetime", "time", "number"])
def test_a_workbook_is_a_history_with_dates_or_times_of_day(tmp_path, kind):
    start = datetime.datetime(2019, 3, 4, 23, 59, 55)
    steps = [start + datetime.timedelta(seconds=float(t)) for t in TIME]
    stamps = {"datetime": steps, "time": [s.time() for s in steps], "number": TIME.tolist()}[kind]
    rows = [CHANNELS, *([t, *row] for t, row in zip(stamps, SERIES.tolist(), strict=True))]
    book(tmp_path, "run.xlsx", rows)
    assert_means(reduced(tmp_path, "run.xlsx"))


def test_an_xlsx_of_another_writer(tmp_path):
    import xlsxwriter

    made = xlsxwriter.Workbook(str(tmp_path / "runs.xlsx"))
    sheet = made.add_worksheet("drift")
    for i, row in enumerate([NAMES, *RUNS.tolist()]):
        sheet.write_row(i, 0, row)
    made.close()
    assert_values(runs_of(tmp_path, "runs.xlsx"))


def test_a_formula_whose_result_was_never_stored_is_no_blank_cell(tmp_path):
    book(tmp_path, "runs.xlsx", [NAMES, [2, "=-1000-234.5", 2750.25, 12500.0]], more="notes")
    with pytest.raises(InputError, match=r"row 2, column X_N: a formula without its result"):
        runs_of(tmp_path, "runs.xlsx", 'table = "drift"')


def test_rows_of_a_worksheet_are_counted_with_its_empty_ones(tmp_path):
    book(tmp_path, "runs.xlsx", [NAMES, *RUNS.tolist(), [], ["average", -1, 2, 3]])
    with pytest.raises(InputError, match=r"row 6, column beta_deg"):
        runs_of(tmp_path, "runs.xlsx")


# -- MATLAB, HDF5, netCDF ----------------------------------------------------------------------------


def columns() -> dict[str, np.ndarray]:
    return dict(zip(CHANNELS, RECORD.T, strict=True))


@pytest.mark.parametrize(
    ("form", "kind"), [("5", "vectors"), ("5", "matrix"), ("5", "struct"), ("4", "vectors"), ("4", "matrix")]
)
def test_matlab_files_of_scipy(tmp_path, form, kind):
    from scipy.io import savemat

    content = {"vectors": columns(), "matrix": {"data": RECORD}, "struct": {"run7": columns()}}[kind]
    savemat(tmp_path / "run.mat", content, format=form)
    keys = {"vectors": "", "matrix": f"names = {CHANNELS!r}", "struct": 'table = "run7"'}[kind]
    assert_means(reduced(tmp_path, "run.mat", keys.replace("'", '"')))


def test_matlab_7_3_is_hdf5(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.mat", "w", userblock_size=512) as made:
        for name, values in columns().items():
            made.create_dataset(name, data=values[None, :])
    with (tmp_path / "run.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Mar 4 2019 HDF5 schema 1.00 .")
    assert_means(reduced(tmp_path, "run.mat"))


@pytest.mark.parametrize("kind", ["datasets", "group", "compound", "matrix"])
def test_hdf5_files_of_h5py(tmp_path, kind):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as made:
        if kind in ("datasets", "group"):
            at = made.create_group("run/7") if kind == "group" else made
            for name, unit, values in zip(["time", "X", "Y", "N"], ["s", "kN", "N", "N*m"], RECORD.T, strict=True):
                one = at.create_dataset(name, data=values / (1000.0 if unit == "kN" else 1.0), compression="gzip")
                one.attrs["units"] = unit
        elif kind == "compound":
            made["run"] = np.rec.fromarrays(RECORD.T, names=CHANNELS)
        else:
            made["run"] = RECORD
            made["run"].attrs["columns"] = CHANNELS
    assert_means(reduced(tmp_path, "run.h5", 'table = "run/7"' if kind == "group" else ""))


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_netcdf_files_of_xarray(tmp_path, engine):
    xarray = pytest.importorskip("xarray")
    units = {"X": "kN", "Y": "N", "N": "N m"}
    data = {
        n: ("time", SERIES[:, i] / (1000.0 if u == "kN" else 1.0), {"units": u})
        for i, (n, u) in enumerate(units.items())
    }
    made = xarray.Dataset(data, coords={"time": ("time", TIME, {"units": "s"})})
    made.to_netcdf(tmp_path / "run.nc", engine=engine)
    assert_means(reduced(tmp_path, "run.nc"))


# -- LabVIEW -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["time", "waveform", "two groups"])
def test_tdms_files_of_nptdms(tmp_path, kind):
    nptdms = pytest.importorskip("nptdms")
    wave = {"wf_increment": 0.05, "wf_start_offset": 0.0} if kind == "waveform" else {}
    made = [
        nptdms.ChannelObject("run", n, SERIES[:, i], properties={"unit_string": u, **wave})
        for i, (n, u) in enumerate({"X": "N", "Y": "N", "N": "N*m"}.items())
    ]
    if not wave:
        made.insert(0, nptdms.ChannelObject("run", "time", TIME, properties={"unit_string": "s"}))
    if kind == "two groups":
        made.append(nptdms.ChannelObject("zero", "X", SERIES[:, 0]))
    with nptdms.TdmsWriter(str(tmp_path / "run.tdms")) as writer:
        writer.write_segment(made)
    keys = 'table = "run"' if kind == "two groups" else ""
    assert_means(reduced(tmp_path, "run.tdms", keys))
    if keys:
        with pytest.raises(InputError, match="2 groups"):
            reduced(tmp_path, "run.tdms")


@pytest.mark.parametrize("separator", ["Tab", "Comma"])
def test_lvm_files(tmp_path, separator):
    """The header as LabVIEW 2012 on writes it (NI, Specification for the LabVIEW measurement file, 2023)."""
    mark = {"Tab": "\t", "Comma": ","}[separator]
    lines = ["LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", f"Separator\t{separator}"]
    lines += [
        "Decimal_Separator\t.",
        "Multi_Headings\tNo",
        "X_Columns\tOne",
        "Time_Pref\tRelative",
        "***End_of_Header***\t",
    ]
    lines += ["Channels\t3\t\t\t", "Samples\t400\t400\t400\t", "X0\t0.0\t0.0\t0.0\t", "Delta_X\t0.05\t0.05\t0.05\t"]
    lines += ["***End_of_Header***\t\t\t\t", mark.join(["X_Value", "Fx", "Fy", "Mz", "Comment"])]
    lines += [mark.join(map(repr, row)) + mark for row in RECORD.tolist()]
    (tmp_path / "run.lvm").write_text("\n".join(lines) + "\n", "utf-8")
    named = 'ignore = ["Comment"]\n[source.columns]\nX_Value = "time [s]"\nFx = "X [N]"\nFy = "Y [N]"\nMz = "N [N m]"\n'
    assert_means(reduced(tmp_path, "run.lvm", named))


# -- universal files ----------------------------------------------------------------------------------


AXES = ("abscissa", "ordinate", "orddenom", "z_axis")


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("named", ["rsp_ent_name", "id1"])
def test_universal_files_of_pyuff(tmp_path, binary, named):
    """Dataset 58 as analysers such as Simcenter Testlab export it, between datasets of other kinds."""
    pyuff = pytest.importorskip("pyuff")
    made = [
        pyuff.prepare_151(model_name="pmm", description="tank", db_app="made", program="made", return_full_dict=True)
    ]
    for i, (name, unit) in enumerate({"X": "kN", "Y": "N", "N": "N m"}.items()):
        own = {"rsp_ent_name": name} if named == "rsp_ent_name" else {"rsp_ent_name": "NONE"}
        one = pyuff.prepare_58(
            binary=binary,
            func_type=1,
            rsp_node=1,
            rsp_dir=i + 1,
            ref_node=1,
            ref_dir=1,
            data=SERIES[:, i] / (1000.0 if unit == "kN" else 1.0),
            x=TIME,
            id1=name if named == "id1" else "run 7",
            ordinate_axis_units_lab=unit,
            abscissa_axis_units_lab="s",
            abscissa_spacing=1,
            abscissa_min=0.0,
            abscissa_inc=0.05,
            ord_data_type=4,
            **own,
            **dict.fromkeys(("ver_num", "load_case_id", "abscissa_spec_data_type"), 0),
            z_axis_value=0.0,
            **{f"{a}_{e}_unit_exp": 0 for a in AXES for e in ("len", "force", "temp")},
            **{f"{a}_spec_data_type": 0 for a in AXES[1:]},
            return_full_dict=True,
        )
        made.append(one)
    pyuff.UFF(str(tmp_path / "run.unv")).write_sets(made, mode="overwrite")
    assert reader_of(tmp_path / "run.unv", Source(files="run.unv")) == "universal"
    assert_means(reduced(tmp_path, "run.unv"))
    whole = (tmp_path / "run.unv").read_bytes()
    (tmp_path / "run.unv").write_bytes(whole[: len(whole) // 3])
    with pytest.raises(InputError, match=r"run\.unv"):
        reduced(tmp_path, "run.unv")


# -- packed, unread, and clocks --------------------------------------------------------------------------


def test_gzip_is_unpacked(tmp_path):
    text = "\n".join([",".join(CHANNELS), *(",".join(map(repr, row)) for row in RECORD.tolist())])
    with gzip.open(tmp_path / "run.csv.gz", "wt", encoding="utf-8") as stream:
        stream.write(text)
    assert_means(reduced(tmp_path, "run.csv.gz"))
    (tmp_path / "run.csv.gz").write_bytes((tmp_path / "run.csv.gz").read_bytes()[:-900])
    with pytest.raises(InputError, match="cannot be read"):
        reduced(tmp_path, "run.csv.gz")


@pytest.mark.parametrize(
    ("start", "words"),
    [
        (b"%PDF-1.7\n", "a PDF"),
        (b"\x89PNG\r\n\x1a\n", "a PNG"),
        (b"\xff\xd8\xff\xe0", "JPEG"),
        (b"7z\xbc\xaf\x27\x1c", "7-Zip"),
    ],
)
def test_what_stays_unread_is_refused_by_its_name(tmp_path, start, words):
    campaign(tmp_path, tidy().replace("runs.*", "runs.csv"))
    (tmp_path / "runs.csv").write_bytes(start + b"\0" * 50)
    with pytest.raises(InputError, match=words):
        read_campaign(tmp_path)


@pytest.mark.parametrize("name", ["run.xlsx", "run.h5", "run.nc", "run.mat", "run.tdms"])
def test_a_binary_file_cut_short_is_refused(tmp_path, name):
    start = {"xlsx": b"PK\x03\x04", "h5": b"\x89HDF\r\n\x1a\n", "nc": b"CDF\x01", "mat": b"MATLAB 5.0", "tdms": b"TDSm"}
    campaign(tmp_path, history(name))
    (tmp_path / name).write_bytes(start[name.split(".")[1]] + b"\x07" * 300)
    with pytest.raises(InputError, match=r"not an? |no columns|0 "):
        read_campaign(tmp_path)


def test_a_library_that_is_not_installed_is_named_with_its_extra(tmp_path, monkeypatch):
    book(tmp_path, "runs.xlsx", [NAMES, *RUNS.tolist()])
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(InputError, match=r"ident-submarine\[readers\]"):
        runs_of(tmp_path, "runs.xlsx")


def stamps(kind: str) -> list[str]:
    start = datetime.datetime(2019, 3, 4, 23, 59, 55)
    at = [start + datetime.timedelta(seconds=float(t)) for t in TIME]
    forms = {
        "hh:mm:ss": lambda i: at[i].strftime("%H:%M:%S.%f")[:-3],
        "iso": lambda i: at[i].isoformat(timespec="milliseconds"),
        "iso zone": lambda i: at[i].isoformat(sep=" ", timespec="milliseconds") + "+01:00",
        "german": lambda i: at[i].strftime("%d.%m.%Y %H:%M:%S.%f")[:-3],
        "american": lambda i: at[i].strftime("%m/%d/%Y %I:%M:%S.%f")[:-3] + at[i].strftime(" %p"),
        "mm:ss": lambda i: f"{int(TIME[i] // 60):02d}:{TIME[i] % 60:05.2f}",
        "epoch ms": lambda i: str(1551743995000 + round(1000 * TIME[i])),
        "serial days": lambda i: repr(43528.0 + (86395.0 + float(TIME[i])) / 86400.0),
    }
    return [forms[kind](i) for i in range(len(TIME))]


@pytest.mark.parametrize(
    "kind", ["hh:mm:ss", "iso", "iso zone", "german", "american", "mm:ss", "epoch ms", "serial days"]
)
def test_every_clock_gives_the_frequency_of_the_motion(tmp_path, kind):
    """A sway at 0.25 Hz through midnight: the record's own frequency says what a second of the clock is."""
    w = 2.0 * np.pi * 0.25
    y = 700.0 * np.sin(w * TIME)
    lines = ["Time,X_N,Y_N,displacement_m"]
    lines += [
        f"{s},-30.0,{v!r},{float(0.3 * np.sin(w * t))!r}"
        for s, v, t in zip(stamps(kind), y.tolist(), TIME, strict=True)
    ]
    (tmp_path / "run.csv").write_text("\n".join(lines), "utf-8")
    constants = CONSTANTS.replace('test = "drift_horizontal"\n', "").replace("5 deg", "0 deg")
    reduction = '[source.reduction]\nkind = "oscillatory"\nmotion = "sway"\n'
    campaign(tmp_path, history("run.csv", '[source.columns]\nTime = "time [s]"\n', constants, reduction))
    done = read_campaign(tmp_path)
    assert done.reduced[0].line.frequency == pytest.approx(0.25, rel=1e-4)
    at = done.runs.set_index(done.runs["run_id"].str[-2:])
    assert at["Y"]["-a"] - at["Y"]["+a"] == pytest.approx(-1400.0, rel=1e-3)


def test_a_clock_that_cannot_be_read_names_the_key(tmp_path):
    (tmp_path / "run.csv").write_text("Time,X_N\nfive past,1\nsix past,2\n", "utf-8")
    campaign(tmp_path, history("run.csv", '[source.columns]\nTime = "time [s]"\n'))
    with pytest.raises(InputError, match="rate_hz"):
        read_campaign(tmp_path)


def test_formats_are_known_by_their_first_bytes(tmp_path):
    for start, reader in ((b"TDSm", "tdms"), (b"PK\x03\x04", "workbook"), (b"CDF\x02", "netcdf"), (b"PAR1", "parquet")):
        (tmp_path / "file.bin").write_bytes(start + b"\0" * 20)
        assert reader_of(tmp_path / "file.bin", Source(files="file.bin")) == reader
