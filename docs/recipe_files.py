"""Files of the recipes of docs/readers.md: by the libraries that people write them with, or after their formats."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

# A record of 20 s, made up: settled loads of a drift run with noise.
TIME = np.arange(400) * 0.05
LOADS = {"X": -1234.5, "Y": 2750.25, "N": 12500.0}
SERIES = np.column_stack([np.full(400, v) for v in LOADS.values()]) + np.random.default_rng(3).standard_normal((400, 3))
RECORD = np.column_stack([TIME, SERIES])
RUNS = np.array([[2.0, -1234.5, 2750.25, 12500.0], [4.0, -1180.0, 5600.5, 25250.0], [6.0, -1100.25, 8450.0, 38000.0]])


def text_file(name: str, lines: list[str]) -> Callable[[Path], None]:
    """Writes a text file of these lines into a folder."""
    return lambda folder: put(folder / name, "\n".join(lines) + "\n")


def put(path: Path, text: str) -> None:
    """A text file, its folder made where there is none."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")


def text_rows(mark: str, rows: np.ndarray, form: str = "") -> list[str]:
    """Rows of numbers as lines of text."""
    return [mark.join(format(v, form) if form else repr(v) for v in row) for row in rows.tolist()]


def excel(folder: Path) -> None:
    """A workbook of openpyxl: a title, a row of units, a mean below, a second sheet."""
    import openpyxl

    book = openpyxl.Workbook()
    book.active.title = "drift"
    for row in (["Tank 2, 2019"], [], ["beta", "X", "Y", "N"], ["deg", "N", "N", "N m"], *RUNS.tolist(), ["mean of 3"]):
        book.active.append(row)
    book.create_sheet("notes").append(["a note"])
    book.save(folder / "drift_2019.xlsx")


def ods(folder: Path) -> None:
    """A worksheet of OpenDocument by pandas and odfpy."""
    import pandas as pd

    names = ["beta_deg", "X_N", "Y_N", "N_Nm"]
    with pd.ExcelWriter(folder / "drift_2019.ods", engine="odf") as writer:
        pd.DataFrame(RUNS, columns=names).to_excel(writer, sheet_name="drift", index=False)


def matlab(folder: Path) -> None:
    """A struct in a MATLAB 5 file by scipy."""
    from scipy.io import savemat

    channels = dict(zip(("time_s", "Fx", "Y_N", "N_Nm"), RECORD.T, strict=True))
    savemat(folder / "run7.mat", {"run7": channels})


def matlab73(folder: Path) -> None:
    """A MATLAB 7.3 file: HDF5 behind a block of MATLAB's, by h5py."""
    import h5py

    with h5py.File(folder / "run7.mat", "w", userblock_size=512) as made:
        for name, values in zip(("time_s", "Fx", "Y_N", "N_Nm"), RECORD.T, strict=True):
            made.create_dataset(name, data=values[None, :])
    with (folder / "run7.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Mar 4 2019 HDF5 schema 1.00 .")


def hdf5(folder: Path) -> None:
    """A group with units as attributes, by h5py."""
    import h5py

    with h5py.File(folder / "run7.h5", "w") as made:
        group = made.create_group("run/7")
        for name, unit, values in zip(("time", "X", "Y", "N"), ("s", "N", "N", "N*m"), RECORD.T, strict=True):
            group.create_dataset(name, data=values, compression="gzip").attrs["units"] = unit


def netcdf(folder: Path) -> None:
    """A data set of xarray, netCDF 4."""
    import xarray

    units = {"X": "N", "Y": "N", "N": "N m"}
    data = {n: ("time", SERIES[:, i], {"units": u}) for i, (n, u) in enumerate(units.items())}
    made = xarray.Dataset(data, coords={"time": ("time", TIME, {"units": "s"})})
    made.to_netcdf(folder / "run7.nc", engine="h5netcdf")


def tdms(folder: Path) -> None:
    """Waveforms of two groups, by nptdms."""
    import nptdms

    wave = {"wf_increment": 0.05, "wf_start_offset": 0.0}
    made = [
        nptdms.ChannelObject("run", n, SERIES[:, i], properties={"unit_string": u, **wave})
        for i, (n, u) in enumerate({"X": "N", "Y": "N", "N": "N*m"}.items())
    ]
    with nptdms.TdmsWriter(str(folder / "run7.tdms")) as writer:
        writer.write_segment([*made, nptdms.ChannelObject("zero", "X", SERIES[:, 0])])


def packed(folder: Path) -> None:
    """A CSV file packed with gzip."""
    with gzip.open(folder / "run7.csv.gz", "wt", encoding="utf-8") as stream:
        stream.write("\n".join(["time_s,X_N,Y_N,N_Nm", *text_rows(",", RECORD)]))


def universal(folder: Path) -> None:
    """Dataset 58 for each channel, by pyuff."""
    import pyuff

    axes = ("abscissa", "ordinate", "orddenom", "z_axis")
    rest: dict[str, Any] = {f"{a}_{e}_unit_exp": 0 for a in axes for e in ("len", "force", "temp")}
    rest |= {f"{a}_spec_data_type": 0 for a in axes} | {"z_axis_value": 0.0, "ver_num": 0, "load_case_id": 0}
    rest |= {"abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 0.05, "abscissa_axis_units_lab": "s"}
    rest |= {
        "binary": 0,
        "func_type": 1,
        "rsp_node": 1,
        "ref_node": 1,
        "ref_dir": 1,
        "ord_data_type": 4,
        "id1": "run 7",
    }
    names = {"X": "N", "Y": "N", "Mz:bal": "N m"}
    made = [
        pyuff.prepare_58(
            rsp_ent_name=n, rsp_dir=i + 1, data=SERIES[:, i], x=TIME, ordinate_axis_units_lab=u, return_full_dict=True,
            **rest,
        )
        for i, (n, u) in enumerate(names.items())
    ]  # fmt: skip
    pyuff.UFF(str(folder / "run7.unv")).write_sets(made, mode="overwrite")


def lvm() -> list[str]:
    """A LabVIEW measurement, header as of version 2 of its specification."""
    head = ["LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", "Decimal_Separator\t."]
    head += ["Multi_Headings\tNo", "X_Columns\tOne", "Time_Pref\tRelative", "***End_of_Header***\t"]
    head += ["Channels\t3\t\t\t", "Samples\t400\t400\t400\t", "X0\t0.0\t0.0\t0.0\t", "Delta_X\t0.05\t0.05\t0.05\t"]
    head += ["***End_of_Header***\t\t\t\t", "X_Value\tFx\tFy\tMz\tComment"]
    return [*head, *(line + "\t" for line in text_rows("\t", RECORD))]


def counted(mark: str, form: str = "") -> list[str]:
    """The record's rows behind a count."""
    return [f"{i}{mark}{line}" for i, line in enumerate(text_rows(mark, RECORD, form))]


def su2() -> list[str]:
    """Coefficients of a steady SU2 history over its inner iterations."""
    pressure = 0.5 * 1000.0 * 2.0**2 * 2.1
    values = SERIES / (pressure * np.array([1.0, 1.0, 5.0]))
    lines = ['"Time_Iter","Outer_Iter","Inner_Iter",    "CFx"       ,   "CFy"  ,  "CMz"      ']
    return [*lines, *(f"0, 0, {i}, " + ", ".join(f"{v:.9f}" for v in row) for i, row in enumerate(values.tolist()))]


def plots() -> list[str]:
    """STAR-CCM+ plots side by side, one of them half as long."""
    head = '"Iteration","X Monitor: X (N)","Iteration","Y Monitor: Y (N)","Iteration","N Monitor: N (N-m)"'
    short = [f"{2 * i},{SERIES[2 * i, 2]:.6f}" if 2 * i < 400 else "," for i in range(400)]
    return [head, *(f"{i},{SERIES[i, 0]:.6f},{i},{SERIES[i, 1]:.6f},{short[i]}" for i in range(400))]


def monitors() -> list[str]:
    """STAR-CCM+ monitors over physical time."""
    head = '"Physical Time: Physical Time (s)","Drag Monitor: Force (N)","Side Monitor: Force (N)"'
    return [f'{head},"Yaw Moment Monitor: Moment"', *text_rows(",", RECORD)]


def tecplot() -> list[str]:
    """Two zones of points."""
    lines = ['TITLE = "drift 5"', 'VARIABLES = "time [s]" "X [N]"', '"Y [N]", "N [N m]"']
    return [*lines, 'ZONE T="start", I=1, F=POINT', "0 1 2 3", 'ZONE T="run", I=400, F=POINT', *text_rows(" ", RECORD)]


def polar() -> list[str]:
    """A section's polar as XFOIL prints it."""
    lines = [" XFOIL         Version 6.99", "  ", " Calculated polar for: NACA 0012", "  "]
    lines += ["   alpha    CL        CD       CDp       CM     Top_Xtr  Bot_Xtr"]
    lines += ["  ------ -------- --------- --------- -------- -------- --------"]
    alphas = np.arange(-8.0, 9.0, 2.0)
    return [*lines, *(f"{a:8.3f}{0.11 * a:9.4f}   0.00700   0.00120   0.0010   0.5000   0.5000" for a in alphas)]


def foam(cofr: str) -> list[str]:
    """forces.dat of the Foundation, with or without its moment point."""
    lines = [f"# CofR          : {cofr}"] if cofr else []
    lines = ["# Forces", *lines, "# Time forces(pressure viscous porous) moment(pressure viscous porous)"]
    zero = "(0 0 0)"
    # Kinematic, as a function object with rhoInf 1 has them.
    for t, x, y, n in (RECORD / [1.0, 1000.0, 1000.0, 1000.0]).tolist():
        force = f"(({0.8 * x:.9f} {0.98 * y:.9f} 0) ({0.2 * x:.9f} {0.02 * y:.9f} 0) {zero})"
        lines.append(f"{t:g}\t{force} ((0 0 {0.97 * n:.9f}) (0 0 {0.03 * n:.9f}) {zero})")
    return lines


def tank() -> list[str]:
    """A tank's text file below two lines of words."""
    return ["Tank 2, run 7", "drift 5 deg, 2 m/s", *text_rows("  ", np.column_stack([RECORD, 0.0 * TIME]), "12.5f")]
