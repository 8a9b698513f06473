"""Invariants of figures: the same whoever draws them; what is refused here is refused in another process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ident.drawing import ahead, beside, scientific
from ident.output import check_folder, whole
from ident.report.figures import draw_figures, quality_colours
from sim.boat.vehicle import load_vehicle
from sim.files import inputs
from sim.files.errors import InputError

JOBS = [("{:.3g}", x) for x in (1.0, 20.0, 3e5, 4e-7, 5.5, 6.0)]


def test_results_stand_in_the_order_of_the_jobs():
    assert beside(format, [(x, ".3g") for _, x in JOBS], workers=2) == ["1", "20", "3e+05", "4e-07", "5.5", "6"]


def test_few_figures_start_no_other_process():
    assert set(beside(os.getpid, [(), ()], workers=2)) == {os.getpid()}


def test_refusal_of_another_process_arrives_as_it_is(tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("", "utf-8")
    with pytest.raises(InputError) as refused:
        beside(check_folder, [(tmp_path,)] * 7 + [(taken,)], workers=2)
    assert (refused.value.where, refused.value.found) == (str(taken), "a file")


def dies_elsewhere(parent: int, number: int) -> int:
    if os.getpid() != parent:
        os._exit(1)
    return number


def test_what_a_process_that_ended_had_to_draw_is_drawn_here(caplog, capfd):
    """One line says so; nothing of the pool's own is printed."""
    jobs = [(os.getpid(), k) for k in range(8)]
    assert beside(dies_elsewhere, jobs, workers=3) == list(range(8))
    assert "a process that draws has ended" in caplog.text
    assert capfd.readouterr().err == ""


def test_a_process_made_ready_ahead_draws_and_refuses_as_this_one(tmp_path, monkeypatch):
    monkeypatch.setattr("ident.drawing.cores", lambda: 2)
    read = tmp_path / "input.png"
    read.write_text("", "utf-8")
    with ahead("json") as draw:
        inputs.begin([read])
        try:
            assert draw(os.getpid) != os.getpid()
            draw(whole_file, tmp_path / "figure.png")
            with pytest.raises(InputError, match="an input of this command"):
                draw(whole_file, read)
        finally:
            inputs._read.set(None)
    assert (tmp_path / "figure.png").read_text("utf-8") == "drawn"


def test_what_a_process_made_ready_ahead_did_not_draw_is_drawn_here(caplog, monkeypatch):
    monkeypatch.setattr("ident.drawing.cores", lambda: 2)
    with ahead() as draw:
        assert [draw(dies_elsewhere, os.getpid(), k) for k in range(3)] == [0, 1, 2]
    assert "the process that draws has ended" in caplog.text


def test_another_process_does_not_write_over_what_was_read_either(tmp_path):
    read = tmp_path / "input.png"
    read.write_text("", "utf-8")
    inputs.begin()
    inputs.note(read)
    try:
        with pytest.raises(InputError, match="an input of this command"):
            beside(whole_file, [(tmp_path / f"{k}.png",) for k in range(7)] + [(read,)], workers=2)
    finally:
        inputs._read.set(None)
    assert read.read_text("utf-8") == ""


def whole_file(path: Path) -> None:
    with whole(path) as part:
        part.write_text("drawn", "utf-8")


def test_pictures_of_a_report_do_not_depend_on_who_draws_them(rows):
    vehicle = load_vehicle("bb2")
    some = rows[rows["coefficient"].isin(["X_uvw", "K_uvw", "M_pure", "X_J0", "KT", "w_T", "Y_vdot", "Y_d1", "N_d1"])]
    some = some[some["part"].isin(["hull", "propeller", "stern_plane_1", "sail_plane_1"])]
    colours = quality_colours(sorted(set(some["quality"]) - {""}))
    alone = draw_figures(vehicle, some, colours, 0)
    assert len(alone) >= 4
    assert draw_figures(vehicle, some, colours, 0, workers=2) == alone


@pytest.mark.parametrize(
    ("values", "power", "first"),
    [((0.0, 4e-3), "×10⁻³", "0.0"), ((0.0, 25.0), "", "0"), ((-2e4, 0.0), "×10⁴", "−2.00")],
)
def test_axes_have_one_power_of_ten(values, power, first):
    from matplotlib.figure import Figure

    figure = Figure()
    axes = figure.subplots()
    axes.set_ylim(*values)
    scientific(axes.yaxis)
    figure.draw_without_rendering()
    assert axes.yaxis.get_offset_text().get_text() == power
    assert axes.yaxis.get_ticklabels()[0].get_text() == first


@pytest.mark.skipif(os.name != "posix", reason="the process that clears up is of POSIX")
def test_a_command_that_ends_in_the_middle_leaves_no_word(tmp_path):
    """What a signal ends has no time to give semaphores back: Python's own process does, without a warning."""
    script = (
        "import os, time\nfrom ident.drawing import beside\n"
        "def draw(k):\n    if k < 2:\n        time.sleep(0.5)\n        os._exit(143)\n    time.sleep(1.0)\n"
        "if __name__ == '__main__':\n    beside(draw, [(k,) for k in range(20)], 2)\n"
    )
    (tmp_path / "drawn.py").write_text(script)
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, tmp_path / "drawn.py"], env=env, capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (143, "")
