"""Monitors and plots of Fluent, CFX, Code_Saturne, STAR-CCM+, SU2 and Tecplot: the numbers that stand in them."""

from __future__ import annotations

import numpy as np
import pytest
from made_campaigns import (
    COLUMNS,
    MEANS,
    SERIES,
    STEADY,
    TIME,
    assert_means,
    campaign,
    history,
    reduced,
)

from ident.captive.campaign import read_campaign
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


def test_plots_that_are_cut_or_have_a_cell_too_many(tmp_path):
    head = '"Iteration","X Monitor: X (N)","Iteration","Y Monitor: Y (N)"\n'
    rows = [f"{i},{x!r},{i},{y!r}" for i, (x, y) in enumerate(SERIES[:, :2].tolist())]
    patterns = "[source.patterns]\n'^Iteration$' = \"time [s]\"\n'^X ' = \"X\"\n'^Y ' = \"Y\"\n"
    (tmp_path / "run.csv").write_text(head + "\n".join(rows) + "\n400,5.0,400,-1", "utf-8")
    run = reduced(tmp_path, "run.csv", patterns).iloc[0]
    np.testing.assert_allclose(run[["X", "Y"]].astype(float), MEANS[:2], rtol=1e-9)
    (tmp_path / "run.csv").write_text(head + "\n".join([*rows[:7], rows[7] + ",4", *rows[8:]]) + "\n", "utf-8")
    with pytest.raises(InputError, match="row 9: 5 cells"):
        reduced(tmp_path, "run.csv", patterns)


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


@pytest.mark.parametrize("clock", ["Cur_Time", "rate"])
def test_an_unsteady_su2_history_in_tecplot_form_is_its_last_iterations(tmp_path, clock):
    lines = [
        'TITLE = "SU2"',
        "VARIABLES = \\",
        '"Time_Iter","Outer_Iter","Inner_Iter","Cur_Time","CFx","CFy","CMz"',
        "ZONE",
    ]
    for step, (t, *row) in enumerate(RECORD.tolist()):
        lines += [", ".join(map(repr, [step, 0, k, t, *(v + 9.0 - 3 * k for v in row)])) for k in range(4)]
    (tmp_path / "history.dat").write_text("\n".join(lines), "utf-8")
    names = NAMED.format("Cur_Time", "CFx", "CFy", "CMz")
    ignored = ["Time_Iter", "Outer_Iter", "Inner_Iter"]
    if clock == "rate":
        names = names.replace('"Cur_Time" = "time [s]"\n', "") + "[source.reduction]\nrate_hz = 20.0\n"
        ignored.append("Cur_Time")
    keys = f"ignore = {ignored!r}\n".replace("'", '"') + names
    source = history("history.dat", keys, reduction="" if clock == "rate" else STEADY)
    campaign(tmp_path, source.replace("rate_hz", 'kind = "steady"\nrate_hz'))
    assert_means(read_campaign(tmp_path).runs)


def test_tecplot_repeats_notes_and_variables_of_other_zones(tmp_path):
    head = [
        'VARIABLES = "time [s]" "X [N]" "Y [N]" "N [N m]"',
        'ZONE T="run", I=400, DATAPACKING=BLOCK',
        'AUXDATA a="1"',
    ]
    block = [" ".join(map(repr, column)) for column in RECORD.T[:3].tolist()] + ["400*-7.5"]
    other = ['ZONE T="shares", VARSHARELIST=([1]=1)', *(" ".join(map(repr, row)) for row in RECORD[:, 1:].tolist())]
    (tmp_path / "run.dat").write_text("\n".join([*head, *block, *other]), "utf-8")
    run = reduced(tmp_path, "run.dat", 'table = "run"').iloc[0]
    np.testing.assert_allclose(run[COLUMNS].astype(float), [*MEANS[:2], -7.5], rtol=1e-6)
    with pytest.raises(InputError, match="zone 'shares' leaves variables out"):
        reduced(tmp_path, "run.dat", 'table = "shares"')


def test_xy_plots_of_fluent_are_joined_where_all_curves_have_a_value(tmp_path):
    lines = ['(title "Convergence history")', '(labels "Iteration" "force")', ""]
    for name, column in zip(("fx", "fy", "mz"), SERIES.T.tolist(), strict=True):
        lines += [f'((xy/key/label "{name}")', *(f"{i}\t{v!r}" for i, v in enumerate(column)), ")", ""]
    (tmp_path / "run.xy").write_text("\n".join(lines), "utf-8")
    assert_means(reduced(tmp_path, "run.xy", NAMED.format("Iteration", "fx", "fy", "mz")))
    (tmp_path / "run.xy").write_text("\n".join([*lines[:-2], "400\t-7"]), "utf-8")
    assert_means(reduced(tmp_path, "run.xy", NAMED.format("Iteration", "fx", "fy", "mz")))
    (tmp_path / "run.xy").write_text("\n".join(lines).replace("\t", "\tx", 1), "utf-8")
    with pytest.raises(InputError, match=r"row 5: '0\\tx"):
        reduced(tmp_path, "run.xy", NAMED.format("Iteration", "fx", "fy", "mz"))


@pytest.mark.parametrize("skip", ["", 'skip = "^ *-+ "\n'])
def test_names_of_two_words_above_a_line_of_dashes(tmp_path, skip):
    """The polar that XFLR5 exports."""
    head = "   time     Fx        Fy    Top Xtr Bot Xtr   Mz  \n ------- -------- --------- ------- ------- -------"
    rows = ["  ".join(map(repr, [t, x, y, 0.5, 0.5, n])) for t, x, y, n in RECORD.tolist()]
    (tmp_path / "run.txt").write_text("xflr5 v6.59\n\n" + "\n".join([head, *rows]), "utf-8")
    keys = f'header_pattern = "^ *time +Fx"\n{skip}ignore = ["Top Xtr", "Bot Xtr"]\n'
    assert_means(reduced(tmp_path, "run.txt", keys + NAMED.format("time", "Fx", "Fy", "Mz")))


def test_force_coefficients_of_openfoam_by_their_area(tmp_path):
    lines = ["# Force coefficients", "# Aref : 1", "#", "# Time \tCd \tCs \tCmYaw"]
    lines += ["\t".join(map(repr, row)) for row in RECORD.tolist()]
    (tmp_path / "coefficient.dat").write_text("\n".join(lines), "utf-8")
    declared = NAMED.format("Time", "Cd", "Cs", "CmYaw").replace("[N m]", "[-]").replace("[N]", "[-]")
    area = '[source.reference]\narea_m2 = 0.0005\nlength_m = 1.0\nsource = "Aref, lRef"\n'
    keys = 'header_pattern = "# Time"\nnormalisation = "half_rho_A"\n' + declared + area
    with pytest.raises(InputError, match=r"force coefficients of OpenFOAM.*reader = 'columns'"):
        reduced(tmp_path, "coefficient.dat", keys)
    assert_means(reduced(tmp_path, "coefficient.dat", 'reader = "columns"\n' + keys))


@pytest.mark.parametrize("keys", ["names", "header_pattern", "patterns"])
def test_an_su2_history_is_its_last_iterations_whatever_its_columns_are_called(tmp_path, keys):
    lines = ['"Time_Iter","Outer_Iter","Inner_Iter","CFx","CFy","CMz"']
    for step, row in enumerate(SERIES.tolist()):
        lines += [",".join(map(repr, [step, 0, k, *(v + 9.0 - 3 * k for v in row)])) for k in range(4)]
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n", "utf-8")
    names = [*("a", "b", "c"), "X [N]", "Y [N]", "N [N m]"]
    ignored = 'ignore = ["Time_Iter", "Outer_Iter", "Inner_Iter"]\n'
    declared = '[source.columns]\nCFx = "X [N]"\nCFy = "Y [N]"\nCMz = "N [N m]"\n'
    made = {
        "names": f'names = {names!r}\ndelimiter = ","\nignore = ["a", "b", "c"]\n'.replace("'", '"'),
        "header_pattern": f'header_pattern = "Inner_Iter"\ndelimiter = ","\n{ignored}{declared}',
        "patterns": "[source.patterns]\n'^CFx$' = \"X [N]\"\n'^CFy$' = \"Y [N]\"\n'^CMz$' = \"N [N m]\"\n",
    }
    rule = '[source.reduction]\nkind = "steady"\nrate_hz = 20.0\n'
    campaign(tmp_path, history("run.csv", made[keys], reduction=rule))
    assert_means(read_campaign(tmp_path).runs)


def test_a_title_alone_makes_no_tecplot_file(tmp_path):
    rows = ["  ".join(map(repr, row)) for row in RECORD.tolist()]
    (tmp_path / "run.txt").write_text("\n".join(["TITLE = run 7", "Time  Fx  Fy  Mz", *rows]), "utf-8")
    assert_means(reduced(tmp_path, "run.txt", 'header_pattern = "^Time"\n' + NAMED.format("Time", "Fx", "Fy", "Mz")))
