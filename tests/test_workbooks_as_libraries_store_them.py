"""Workbooks of Excel and OpenDocument: the numbers that people see in them, whatever library stored them."""

from __future__ import annotations

import datetime
import gzip
import struct
import sys

import numpy as np
import pandas as pd
import pytest
from made_campaigns import (
    BETA,
    SERIES,
    TIME,
    VALUES,
    assert_means,
    assert_values,
    campaign,
    reduced,
    runs_of,
    tidy,
)

from ident.captive.campaign import read_campaign
from ident.captive.readers.stored_records import stored_records
from sim.files.errors import InputError

NAMES = ["beta_deg", "X_N", "Y_N", "N_Nm"]
RUNS = np.column_stack([BETA, VALUES])
CHANNELS = ["time_s", "X_N", "Y_N", "N_Nm"]


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


@pytest.mark.parametrize(("value", "words"), [(0, "a formula without its result"), (-1234.5, "")])
def test_a_zero_in_the_place_of_a_result_is_no_load(tmp_path, value, words):
    """xlsxwriter stores zero and that everything is to be calculated, unless it is told the result."""
    import xlsxwriter

    made = xlsxwriter.Workbook(str(tmp_path / "runs.xlsx"))
    sheet = made.add_worksheet("drift")
    for i, row in enumerate([NAMES, *RUNS.tolist()]):
        sheet.write_row(i, 0, row)
    sheet.write_formula("B2", "=-1000-234.5", None, value)
    made.close()
    if words:
        with pytest.raises(InputError, match=rf"row 2, column X_N: {words}"):
            runs_of(tmp_path, "runs.xlsx")
    else:
        assert_values(runs_of(tmp_path, "runs.xlsx"))


def changed_book(folder, change) -> None:
    """A workbook of the runs, changed by openpyxl before it is saved."""
    import openpyxl

    made = openpyxl.Workbook()
    for row in [NAMES, *RUNS.tolist()]:
        made.active.append(row)
    change(made)
    made.save(folder / "runs.xlsx")


def test_a_cell_that_shows_an_error_is_named_and_blank_once_stated(tmp_path):
    def change(made):
        made.active["C3"] = "#DIV/0!"
        made.active["C3"].data_type = "e"
        made.create_sheet("empty")

    changed_book(tmp_path, change)
    with pytest.raises(InputError, match=r"row 3, column Y_N: '#DIV/0!'.*missing = \['#DIV/0!'\]"):
        runs_of(tmp_path, "runs.xlsx")
    assert runs_of(tmp_path, "runs.xlsx", 'missing = ["#DIV/0!"]')["Y"].isna().tolist() == [False, True, False]


def test_what_another_worksheet_lacks_is_nothing_to_this_one(tmp_path):
    def change(made):
        made.active["C3"] = None
        made.create_sheet("other")["C3"] = "=1+1"

    changed_book(tmp_path, change)
    assert runs_of(tmp_path, "runs.xlsx")["Y"].isna().tolist() == [False, True, False]


@pytest.mark.parametrize("by", ["hand", "filter"])
def test_a_hidden_row_is_no_run(tmp_path, by):
    def change(made):
        made.active.append([20.0, 1.0, 2.0, 3.0])
        made.active.row_dimensions[5].hidden = True
        if by == "filter":
            made.active.auto_filter.ref = "A1:D5"

    changed_book(tmp_path, change)
    with pytest.raises(InputError, match=r"row 5: a hidden row"):
        runs_of(tmp_path, "runs.xlsx")
    assert_values(runs_of(tmp_path, "runs.xlsx", 'skip = "^20"'))


def test_a_column_without_a_name_is_left_out_by_its_place(tmp_path):
    """The index that pandas writes, and a note beside the table."""
    pd.DataFrame(RUNS, columns=NAMES).to_excel(tmp_path / "runs.xlsx")
    with pytest.raises(InputError, match=r"a column without a name \(column 1\).*ignore = \[.column 1.\]"):
        runs_of(tmp_path, "runs.xlsx")
    assert_values(runs_of(tmp_path, "runs.xlsx", 'ignore = ["column 1"]'))
    changed_book(tmp_path, lambda made: made.active.cell(3, 9, "calm"))
    assert_values(runs_of(tmp_path, "runs.xlsx", 'ignore = ["column 9"]'))


def test_numbers_stored_as_text_are_read_in_the_stated_mark(tmp_path):
    book(tmp_path, "runs.xlsx", [NAMES, *([repr(v).replace(".", ",") for v in row] for row in RUNS.tolist())])
    assert_values(runs_of(tmp_path, "runs.xlsx", 'decimal = ","'))
    with pytest.raises(InputError, match=r"row 2, column beta_deg: '2,0'.*decimal"):
        runs_of(tmp_path, "runs.xlsx")
    book(tmp_path, "runs.xlsx", [NAMES, *RUNS.tolist()])
    with pytest.raises(InputError, match="no number that is stored as text"):
        runs_of(tmp_path, "runs.xlsx", 'decimal = ","')


def test_worksheets_number_their_runs_by_themselves(tmp_path):
    def change(made):
        other = made.create_sheet("turned")
        for row in [NAMES, *RUNS.tolist()]:
            other.append(row)

    changed_book(tmp_path, change)
    campaign(tmp_path, "".join(tidy(f'table = "{t}"').replace("runs.*", "runs.xlsx") for t in ("Sheet", "turned")))
    assert read_campaign(tmp_path).runs["run_id"].tolist() == [
        f"{t}/runs-{i}" for t in ("Sheet", "turned") for i in (2, 3, 4)
    ]


def test_a_library_that_is_not_installed_is_named_with_its_extra(tmp_path, monkeypatch):
    book(tmp_path, "runs.xlsx", [NAMES, *RUNS.tolist()])
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(InputError, match=r"ident-submarine\[readers\]"):
        runs_of(tmp_path, "runs.xlsx")


def test_a_packed_workbook_is_refused_as_packed(tmp_path):
    book(tmp_path, "runs.xlsx", [NAMES, *RUNS.tolist()])
    (tmp_path / "runs.xlsx.gz").write_bytes(gzip.compress((tmp_path / "runs.xlsx").read_bytes()))
    with pytest.raises(InputError, match="packed, and for the reader workbook"):
        runs_of(tmp_path, "runs.xlsx.gz")


def document(folder, other) -> None:
    """An OpenDocument of the runs by odfpy; ``other`` gives a cell of its own for row and column, or None."""
    from odf.opendocument import OpenDocumentSpreadsheet
    from odf.table import Table, TableCell, TableRow
    from odf.text import P

    made, table = OpenDocumentSpreadsheet(), Table(name="drift")
    for i, row in enumerate([NAMES, *RUNS.tolist()]):
        line = TableRow()
        for k, value in enumerate(row):
            own = other(i, k, value)
            cell = TableCell(**own[0]) if own else TableCell(valuetype="float", value=value)
            if own or isinstance(value, str):
                cell = cell if own else TableCell(valuetype="string")
                cell.addElement(P(text=own[1] if own else value))
            line.addElement(cell)
        table.addElement(line)
    made.spreadsheet.addElement(table)
    made.save(str(folder / "runs.ods"))


@pytest.mark.parametrize(
    ("stored", "shown", "words"),
    [
        ({}, "", "row 3, column Y_N: a formula without its result"),
        ({"valuetype": "string", "stringvalue": ""}, "#DIV/0!", "row 3, column Y_N: '#DIV/0!'"),
        ({"valuetype": "float", "value": 0}, "Err:502", "row 3, column Y_N: 'Err:502'"),
        ({"valuetype": "float", "value": 5600.5}, "5600,5", ""),
    ],
)
def test_formulas_of_an_opendocument_without_a_result(tmp_path, stored, shown, words):
    document(tmp_path, lambda i, k, v: ({"formula": "of:=1/0", **stored}, shown) if (i, k) == (2, 2) else None)
    if words:
        with pytest.raises(InputError, match=words):
            runs_of(tmp_path, "runs.ods")
    else:
        assert_values(runs_of(tmp_path, "runs.ods"))


def compound_file(stream: bytes) -> bytes:
    """A compound file of sectors of 512 bytes: its table, its directory, the stream Workbook."""
    stream = stream.ljust(-(-max(len(stream), 4096) // 512) * 512, b"\0")
    count = len(stream) // 512
    head = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(16) + struct.pack("<5H6x", 0x3E, 3, 0xFFFE, 9, 6)
    head += struct.pack("<9I", 0, 1, 1, 0, 4096, 0xFFFFFFFE, 0, 0xFFFFFFFE, 0) + struct.pack(
        "<109I", 0, *[0xFFFFFFFF] * 108
    )
    table = [0xFFFFFFFD, 0xFFFFFFFE, *range(3, count + 2), 0xFFFFFFFE]
    name = "Workbook".encode("utf-16-le")
    entry = name.ljust(64, b"\0") + struct.pack("<H", len(name) + 2) + bytes(50) + struct.pack("<2I4x", 2, len(stream))
    return head + struct.pack(f"<{len(table)}I", *table).ljust(512, b"\xff") + entry.ljust(512, b"\0") + stream


def test_errors_bare_formulas_and_hidden_rows_of_an_xls(tmp_path):
    """Records of a worksheet as [MS-XLS] lays them out: BoolErr, Formula with an error and a blank result, Row."""

    def record(kind: int, body: bytes) -> bytes:
        return struct.pack("<2H", kind, len(body)) + body

    sheet = record(0x0809, bytes(16)) + record(0x0208, struct.pack("<6H2H", 4, 0, 4, 255, 0, 0, 0x20, 0))
    sheet += record(0x0205, struct.pack("<3H2B", 2, 1, 0, 0x2A, 1)) + record(
        0x0205, struct.pack("<3H2B", 2, 3, 0, 1, 0)
    )
    for column, kind, code in ((0, 2, 7), (1, 3, 0), (2, 0, 0)):
        sheet += record(0x0006, struct.pack("<3HBxBxxxH", 3, column, 0, kind, code, 0xFFFF) + bytes(6))
    sheet += record(0x0006, struct.pack("<3Hd", 3, 3, 0, 1.5) + bytes(6)) + record(0x000A, b"")
    begin = record(0x0809, bytes(16))
    at = len(begin) + 4 + 13 + 4
    stream = begin + record(0x0085, struct.pack("<I2B2B", at, 0, 0, 5, 0) + b"drift") + record(0x000A, b"") + sheet
    path = tmp_path / "runs.xls"
    path.write_bytes(compound_file(stream))
    errors, bare, hidden = stored_records(path, "drift")
    assert errors == {(3, 2): "#N/A", (4, 1): "#DIV/0!"}
    assert (bare, hidden) == ({(4, 2)}, {5})
    assert stored_records(path, "yaw") == ({}, set(), set())
    path.write_bytes(compound_file(stream)[:700])
    assert stored_records(path, "drift") == ({}, set(), set())


@pytest.mark.parametrize("damage", ["directory", "half", "part"])
def test_a_damaged_workbook_is_refused_as_one(tmp_path, damage):
    book(tmp_path, "runs.xlsx", [NAMES, *RUNS.tolist()])
    whole = (tmp_path / "runs.xlsx").read_bytes()
    wrong = {
        "directory": whole.replace(b"PK\x01\x02", b"PK\x01\x07"),
        "half": whole[: len(whole) // 2],
        "part": whole.replace(b"xl/workbook.xml", b"xl/workbook.xyz"),
    }
    (tmp_path / "runs.xlsx").write_bytes(wrong[damage])
    with pytest.raises(InputError, match=r"runs\.xlsx: (not a workbook|a zip archive|0 worksheets)"):
        runs_of(tmp_path, "runs.xlsx")
