"""Worksheets, groups, structs and zones of one file that are a run each, or a table of runs each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_campaigns import BETA, CONSTANTS, SERIES, TIME, VALUES, campaign, history, tidy

from ident.captive.campaign import read_campaign
from sim.files.errors import InputError

CHANNELS = ["time_s", "X_N", "Y_N", "N_Nm"]
NOISE = SERIES - SERIES.mean(axis=0)
RECORDS = {f"b_p0{b:.0f}": np.column_stack([TIME, NOISE + v]) for b, v in zip(BETA, VALUES, strict=True)}
KEYS = 'table = "b_*"\nmatch = "/b_(?P<beta_deg>[mp][0-9]+)$"\n'
OF_ALL = CONSTANTS.replace('beta = "5 deg"\n', "")


def written(folder: Path, ending: str) -> str:
    """A file of all records in tables of their own, and one that is no record."""
    path = folder / f"all.{ending}"
    if ending == "xlsx":
        import openpyxl

        book = openpyxl.Workbook()
        book.active.append(["a note", 1.0])
        for name, record in RECORDS.items():
            sheet = book.create_sheet(name)
            for row in [CHANNELS, *record.tolist()]:
                sheet.append(row)
        book.save(path)
    elif ending == "h5":
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as made:
            made["zero/X_N"] = np.zeros(4)
            for name, record in RECORDS.items():
                for channel, values in zip(CHANNELS, record.T, strict=True):
                    made[f"{name}/{channel}"] = values
    elif ending == "mat":
        from scipy.io import savemat

        savemat(path, {name: dict(zip(CHANNELS, record.T, strict=True)) for name, record in RECORDS.items()})
    elif ending == "tdms":
        nptdms = pytest.importorskip("nptdms")
        with nptdms.TdmsWriter(str(path)) as writer:
            for name, record in RECORDS.items():
                named = zip(CHANNELS, record.T, strict=True)
                writer.write_segment([nptdms.ChannelObject(name, c, np.array(v)) for c, v in named])
    else:
        lines = ['VARIABLES = "time [s]" "X [N]" "Y [N]" "N [N m]"']
        for name, record in RECORDS.items():
            lines += [f'ZONE T="{name}", I=400', *(" ".join(map(repr, row)) for row in record.tolist())]
        path.write_text("\n".join(lines), "utf-8")
    return path.name


@pytest.mark.parametrize("ending", ["xlsx", "h5", "mat", "tdms", "dat"])
def test_each_table_that_fits_is_a_run_with_its_name_behind_the_path(tmp_path, ending):
    name = written(tmp_path, ending)
    campaign(tmp_path, history(name, KEYS, OF_ALL))
    runs = read_campaign(tmp_path).runs
    assert runs["run_id"].tolist() == [f"all/{table}" for table in RECORDS]
    np.testing.assert_allclose(np.degrees(runs["beta"]), BETA)
    np.testing.assert_allclose(runs[["X", "Y", "N"]].to_numpy(), VALUES, rtol=1e-6)


def test_names_that_do_not_fit_are_refused(tmp_path):
    name = written(tmp_path, "xlsx")
    campaign(tmp_path, history(name, KEYS.replace('"b_*"', '"yaw_?"'), OF_ALL))
    with pytest.raises(InputError, match=r"no worksheet 'yaw_\?'.*'b_p02'"):
        read_campaign(tmp_path)
    campaign(tmp_path, history(name, KEYS.replace("/b_", "/yaw_"), OF_ALL))
    with pytest.raises(InputError, match=r"'all\.xlsx/b_p02' does not match"):
        read_campaign(tmp_path)


def test_tables_of_runs_are_read_one_after_the_other(tmp_path):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.title = "remarks"
    for k, (b, values) in enumerate(zip(BETA, VALUES.tolist(), strict=True)):
        sheet = book.create_sheet(f"day {k}")
        sheet.append(["run_id", "beta_deg", "X_N", "Y_N", "N_Nm"])
        sheet.append([1, b, *values])
    book.save(tmp_path / "runs.xlsx")
    campaign(tmp_path, tidy('table = "day *"').replace("runs.*", "runs.xlsx"))
    runs = read_campaign(tmp_path).runs
    assert runs["run_id"].tolist() == ["day 0/1", "day 1/1", "day 2/1"]
    np.testing.assert_allclose(runs["Y"], VALUES[:, 1])
