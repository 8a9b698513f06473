"""MATLAB, HDF5, netCDF, TDMS, LVM, gzip and clocks: the same numbers whatever wrote them."""

from __future__ import annotations

import bz2
import datetime
import gzip
import lzma

import numpy as np
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


def test_an_array_of_structs_is_a_table_of_runs(tmp_path):
    from scipy.io import savemat

    kinds = np.dtype([(n, object) for n in NAMES])
    made = np.array([tuple(row) for row in RUNS.tolist()], dtype=kinds)
    savemat(tmp_path / "runs.mat", {"runs": made})
    assert_values(runs_of(tmp_path, "runs.mat"))


@pytest.mark.parametrize("compressed", [False, True])
def test_a_matlab_file_whose_elements_do_not_fit_is_refused(tmp_path, compressed):
    """scipy takes the class of a variable as it stands: one that there is not ends the process."""
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", columns(), do_compression=compressed)
    assert_means(reduced(tmp_path, "run.mat"))
    whole = (tmp_path / "run.mat").read_bytes()
    for cut in (129, 137, 200, len(whole) - 3):
        (tmp_path / "run.mat").write_bytes(whole[:cut])
        with pytest.raises(InputError, match=r"run\.mat"):
            reduced(tmp_path, "run.mat")
    if not compressed:
        # Header, tag of the variable, tag of its flags, class.
        at = 128 + 8 + 8
        (tmp_path / "run.mat").write_bytes(whole[:at] + b"\x5d" + whole[at + 1 :])
        with pytest.raises(InputError, match="a variable of class 93 at byte 136"):
            reduced(tmp_path, "run.mat")


def test_a_matrix_with_a_channel_a_row(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"data": RECORD.T})
    assert_means(reduced(tmp_path, "run.mat", f"names = {CHANNELS!r}".replace("'", '"')))


def test_cells_of_matlab_7_3_are_tables_by_their_place(tmp_path):
    """A cell array holds references; its second cell is another run."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as made:
        for k, factor in (("a", 1.0), ("b", 2.0)):
            for name, values in columns().items():
                made.create_dataset(f"#refs#/{k}/{name}", data=values[None, :] * factor)
        made["runs"] = np.array([made["#refs#/a"].ref, made["#refs#/b"].ref], dtype=h5py.ref_dtype)
    assert_means(reduced(tmp_path, "run.h5", 'table = "runs(1)"'))
    with pytest.raises(InputError, match=r"'runs\(1\)', 'runs\(2\)'"):
        reduced(tmp_path, "run.h5")


@pytest.mark.parametrize(("kind", "words"), [("table", "table2struct"), ("datetime", r"seconds\(t - t\(1\)\)")])
def test_objects_of_matlab_are_refused_by_their_class(tmp_path, kind, words):
    """A table of version 7.3 is six numbers that lead to it: they are no column."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.mat", "w", userblock_size=512) as made:
        made["runs"] = np.zeros((1, 6), dtype=np.uint32)
        made["runs"].attrs.update({"MATLAB_class": np.bytes_(kind), "MATLAB_object_decode": 3})
    with (tmp_path / "run.mat").open("r+b") as stream:
        # The text before it is the writer's own; the version is told at byte 124.
        stream.write(b"MATLAB 5.0 MAT-file, written elsewhere".ljust(124) + b"\x00\x02IM")
    with pytest.raises(InputError, match=rf"variable runs: an object of MATLAB \({kind}\).*{words}"):
        reduced(tmp_path, "run.mat")


def test_a_link_that_leads_nowhere_and_a_time_called_t(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as made:
        made["lost"] = h5py.SoftLink("/nowhere")
        for name, unit, values in zip(["t", "X", "Y", "N"], ["s", "N", "N", "N*m"], RECORD.T, strict=True):
            made[name] = values
            made[name].attrs["unit"] = unit
    assert_means(reduced(tmp_path, "run.h5", '[source.columns]\nt = "time"\n'))
    with h5py.File(tmp_path / "run.h5", "a") as made:
        made["K_Nm"] = h5py.ExternalLink("gone.h5", "/K")
    with pytest.raises(InputError, match="K_Nm: a link that leads nowhere"):
        reduced(tmp_path, "run.h5", '[source.columns]\nt = "time"\n')
    assert_means(reduced(tmp_path, "run.h5", 'ignore = ["K_Nm"]\n[source.columns]\nt = "time"\n'))


@pytest.mark.parametrize("name", ["run.nc", "run.h5"])
def test_a_variable_of_two_dimensions_is_named(tmp_path, name):
    xarray = pytest.importorskip("xarray")
    made = xarray.Dataset({"X": (("run", "time"), np.zeros((3, 400)), {"units": "N"}), "time": ("time", TIME)})
    made.to_netcdf(tmp_path / name, engine="h5netcdf" if name.endswith("h5") else "scipy")
    with pytest.raises(InputError, match="X: an array of 3 x 400"):
        reduced(tmp_path, name, '[source.columns]\ntime = "time [s]"\nX = "X [N]"\n')


def test_nanoseconds_of_an_epoch_are_seconds(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as made:
        made["time_s"] = 1_588_334_400_000_000_000 + np.round(TIME * 1e9).astype(np.int64)
        for name, values in zip(CHANNELS[1:], SERIES.T, strict=True):
            made[name] = values
    assert_means(reduced(tmp_path, "run.h5"))


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


@pytest.mark.parametrize("clock", ["No", "Multi"])
def test_lvm_files_without_a_clock_or_with_one_a_channel(tmp_path, clock):
    """X_Columns No leaves X_Value empty, the header has its increment; Multi writes one before every channel."""
    lines = ["LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t,", f"X_Columns\t{clock}"]
    gap = "\t\t" if clock == "Multi" else "\t"
    lines += ["***End_of_Header***\t", "\t", gap.join(["Channels\t3", "", ""])]
    lines += [gap.join(["Y_Unit_Label\tNewtons", "N", "N*m"]), gap.join(["X0\t0,0", "0,0", "0,0"])]
    lines += [gap.join(["Delta_X\t5,0E-2", "5,0E-2", "5,0E-2"]), "***End_of_Header***\t\t\t\t"]
    names = ["X_Value", "Fx", "Fy", "Mz"] if clock == "No" else ["X_Value", "Fx", "X_Value", "Fy", "X_Value", "Mz"]
    lines += ["\t".join([*names, "Comment"])]
    for t, *row in RECORD.tolist():
        cells = ["", *map(repr, row)] if clock == "No" else [repr(v) for one in row for v in (t, one)]
        lines.append("\t".join(cells).replace(".", ",") + "\t")
    (tmp_path / "run.lvm").write_text("\r\n".join(lines) + "\r\n", "utf-8")
    named = 'ignore = ["Comment"]\n[source.columns]\nX_Value = "time [s]"\nFx = "X"\nFy = "Y"\nMz = "N"\n'
    assert_means(reduced(tmp_path, "run.lvm", named))


def test_a_tdms_file_damaged_anywhere_is_refused_or_read(tmp_path):
    """Whatever the library stumbles over, in its header above all."""
    nptdms = pytest.importorskip("nptdms")
    wave = {"unit_string": "N", "wf_increment": 0.05}
    with nptdms.TdmsWriter(str(tmp_path / "run.tdms")) as writer:
        writer.write_segment([nptdms.ChannelObject("run", "X", SERIES[:, 0], properties=wave)])
    whole = (tmp_path / "run.tdms").read_bytes()
    campaign(tmp_path, history("run.tdms"))
    refused = 0
    for cut in range(4, 200, 7):
        (tmp_path / "run.tdms").write_bytes(whole[:cut] + whole[cut + 3 :])
        try:
            read_campaign(tmp_path)
        except InputError:
            refused += 1
    assert refused > 20


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


@pytest.mark.parametrize("packer", [bz2, lzma])
def test_bzip2_and_xz_are_unpacked(tmp_path, packer):
    text = "\n".join([",".join(CHANNELS), *(",".join(map(repr, row)) for row in RECORD.tolist())])
    (tmp_path / "run.csv.packed").write_bytes(packer.compress(text.encode()))
    assert_means(reduced(tmp_path, "run.csv.packed"))
    (tmp_path / "run.csv.packed").write_bytes(packer.compress(text.encode())[:-900])
    with pytest.raises(InputError, match="cannot be read"):
        reduced(tmp_path, "run.csv.packed")


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
        (b"\x28\xb5\x2f\xfd", "Zstandard"),
        (b"\x93NUMPY\x01", "NumPy"),
        (b"\x80\x04\x95", "a pickle"),
        (b"ARROW1", "Feather"),
        (b"SQLite format 3\0", "SQLite"),
        (b"#!SZPLT", "Tecplot"),
        (b"#!TDV112", "Tecplot"),
        (b"\xef\xbb\xbf<?xml version", "XML"),
        (b"<html><table>", "HTML"),
        (b"Auto-Transcript Start Time:  02:25", "a transcript of Fluent"),
        (b'{"X": 1}', "JSON"),
        (b"runs.csv".ljust(257, b"\0") + b"ustar", "a tar archive"),
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


def stamps(kind: str) -> list[str]:
    start = datetime.datetime(2019, 3, 4, 23, 59, 55)
    at = [start + datetime.timedelta(seconds=float(t)) for t in TIME]
    forms = {
        "hh:mm:ss": lambda i: at[i].strftime("%H:%M:%S.%f")[:-3],
        "iso": lambda i: at[i].isoformat(timespec="milliseconds"),
        "iso zone": lambda i: at[i].isoformat(sep=" ", timespec="milliseconds") + "+01:00",
        "german": lambda i: at[i].strftime("%d.%m.%Y %H:%M:%S.%f")[:-3],
        "american": lambda i: at[i].strftime("%m/%d/%Y %I:%M:%S.%f")[:-3] + at[i].strftime(" %p"),
        "named month": lambda i: at[i].strftime("%d-%b-%Y %H:%M:%S.%f")[:-3],
        "iso basic": lambda i: at[i].strftime("%Y%m%dT%H%M%S.%f")[:-3],
        "epoch ns": lambda i: str(1551743995000000000 + round(1e9 * TIME[i])),
        "epoch us": lambda i: str(1551743995000000 + round(1e6 * TIME[i])),
        "mm:ss": lambda i: f"{int(TIME[i] // 60):02d}:{TIME[i] % 60:05.2f}",
        "epoch ms": lambda i: str(1551743995000 + round(1000 * TIME[i])),
        "serial days": lambda i: repr(43528.0 + (86395.0 + float(TIME[i])) / 86400.0),
    }
    return [forms[kind](i) for i in range(len(TIME))]


@pytest.mark.parametrize(
    "kind",
    [
        *("hh:mm:ss", "iso", "iso zone", "german", "american", "named month", "iso basic", "mm:ss"),
        *("epoch ms", "epoch us", "epoch ns", "serial days"),
    ],
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
