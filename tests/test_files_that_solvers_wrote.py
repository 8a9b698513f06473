"""Monitors and plots of Fluent, CFX, Code_Saturne, STAR-CCM+, SU2 and Tecplot: the numbers that stand in them."""

from __future__ import annotations

import numpy as np
import pytest
from made_campaigns import (
    COLUMNS,
    MEANS,
    SERIES,
    TIME,
    assert_means,
    reduced,
)

from sim.files.errors import InputError

RECORD = np.column_stack([TIME, SERIES])
NAMED = '[source.columns]\n"{0}" = "time [s]"\n"{1}" = "X [N]"\n"{2}" = "Y [N]"\n"{3}" = "N [N m]"\n'


def test_fluent_report_files_by_their_header(tmp_path):
    lines = [
        '"report-file-0"',
        '"Time Step" "force-x etc.."',
        '("Time Step" "flow-time" "force-x" "force-y" "moment-z")',
    ]
    lines += [" ".join(map(repr, (i, *row))) for i, row in enumerate(RECORD.tolist())]
    (tmp_path / "run.out").write_text("\n".join(lines), "utf-8")
    names = NAMED.format("flow-time", "force-x", "force-y", "moment-z")
    assert_means(reduced(tmp_path, "run.out", 'ignore = ["Time Step"]\n' + names))


@pytest.mark.parametrize("form", ["cfx5mondata", "workspace"])
def test_cfx_monitors_as_exported(tmp_path, form):
    """`cfx5mondata -out`: quoted names that hold commas; the workspace of the solver manager: a title above."""
    if form == "cfx5mondata":
        lines = ['"ACCUMULATED TIMESTEP","USER POINT,Physical Time","USER POINT,FX","USER POINT,FY","USER POINT,MZ"']
        names, keys = ("USER POINT,Physical Time", *(f"USER POINT,{c}" for c in ("FX", "FY", "MZ"))), ""
        ignored = "ACCUMULATED TIMESTEP"
    else:
        lines = ["[Name]", "hull_001", "", "[Data]", "Accumulated Time Step, Time [s], FX [N], FY [N], MZ [N m]"]
        names, keys = ("Time", "FX", "FY", "MZ"), 'header_pattern = "^Accumulated"\ndelimiter = ","\n'
        ignored = "Accumulated Time Step"
    lines += [",".join([str(i), *(f"{v:.12e}" for v in row)]) for i, row in enumerate(RECORD.tolist())]
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n", "utf-8")
    assert_means(reduced(tmp_path, "run.csv", f'{keys}ignore = ["{ignored}"]\n' + NAMED.format(*names)))


@pytest.mark.parametrize("mark", ["#", ""])
def test_columns_of_efforts_below_lines_of_comment(tmp_path, mark):
    """Text columns in exponents below comments, as FINE/Marine and other solvers write efforts."""
    lines = [f"{mark} Efforts on body 1", f"{mark} Time  Fx  Fy  Mz"]
    lines += ["  ".join(f"{v:16.9E}" for v in row) for row in RECORD.tolist()]
    (tmp_path / "run.dat").write_text("\n".join(lines) + "\n", "utf-8")
    keys = 'header_pattern = "Time +Fx"\n' + NAMED.format("Time", "Fx", "Fy", "Mz")
    assert_means(reduced(tmp_path, "run.dat", keys))


def test_plots_with_an_abscissa_each_are_joined_where_all_have_one(tmp_path):
    head = '"Iteration","X Monitor: X (N)","Iteration","Y Monitor: Y (N)","Iteration","N Monitor: N (N-m)"'
    rows = []
    for i in range(400):
        # The moment is written every second iteration, so its plot is half as long.
        moment = f"{2 * i},{float(SERIES[2 * i, 2])!r}" if 2 * i < 400 else ","
        rows.append(f"{i},{float(SERIES[i, 0])!r},{i},{float(SERIES[i, 1])!r},{moment}")
    (tmp_path / "run.csv").write_text("\n".join([head, *rows]), "utf-8")
    patterns = "[source.patterns]\n'^Iteration$' = \"time [s]\"\n'^X ' = \"X\"\n'^Y ' = \"Y\"\n'^N ' = \"N\"\n"
    run = reduced(tmp_path, "run.csv", patterns).iloc[0]
    np.testing.assert_allclose(run[COLUMNS].astype(float), SERIES[::2].mean(axis=0), rtol=1e-9)


def test_su2_histories_with_padded_quotes_and_inner_iterations(tmp_path):
    head = '"Time_Iter","Outer_Iter","Inner_Iter",    "CFx"       ,   "CFy"  ,  "CMz"      '
    rows = []
    for step, row in enumerate(SERIES.tolist()):
        rows += [
            f"{step:12d},           0,{inner:12d}, " + ", ".join(f"{v + 9.0 - inner:.9f}" for v in row)
            for inner in range(10)
        ]
    (tmp_path / "run.csv").write_text("\n".join([head, *rows]), "utf-8")
    names = NAMED.format("Time_Iter", "CFx", "CFy", "CMz")
    run = reduced(tmp_path, "run.csv", 'ignore = ["Outer_Iter", "Inner_Iter"]\n' + names).iloc[0]
    np.testing.assert_allclose(run[COLUMNS].astype(float), MEANS, rtol=1e-6)


@pytest.mark.parametrize("packing", ["POINT", "BLOCK"])
def test_tecplot_zones(tmp_path, packing):
    values = RECORD if packing == "POINT" else RECORD.T
    lines = ['TITLE = "drift 5"', 'VARIABLES = "time [s]" "X [N]"', '"Y [N]", "N [N m]"']
    lines += ['ZONE T="start"', "I=2", "F=POINT", "0 1 2 3", "1 1 2 3"]
    lines += [f'ZONE T="run", I={len(RECORD)}, DATAPACKING={packing}']
    lines += ["\n".join(" ".join(map(repr, row[k : k + 8])) for k in range(0, len(row), 8)) for row in values.tolist()]
    (tmp_path / "run.dat").write_text("\n".join(lines), "utf-8")
    assert_means(reduced(tmp_path, "run.dat", 'table = "run"'))
    with pytest.raises(InputError, match="2 zones"):
        reduced(tmp_path, "run.dat")
