"""Authority: closed forms. Loads of known derivatives, written as the solver writes them, are those of the fit.

The motion of the body is taken from the dictionaries that the solver would read (inflow, rotating frame, source term,
moving mesh), not from the campaign that is under test.
"""

from __future__ import annotations

import io
import json
import math
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from foamlib import FoamFieldFile, FoamFile
from made_lines import TEMPLATE, surfaces, write_files, write_loads, write_stl
from rich.console import Console

import ident
from ident.captive.campaign import Campaign, read_campaign
from ident.cfd.matrix import read_matrix
from ident.cfd.progress import progress
from ident.cfd.screen import show_progress
from ident.cli import main
from ident.identification.identify import identify
from sim.files.errors import InputError

# The model's, at a scale of 1:2.
LENGTH = 2.0
# Derivatives over rho/2 L^n about the vehicle's origin.
TRUE = {
    "X_uu": -0.002,
    "Y_v": -0.02,
    "N_v": -0.011,
    "Y_ur": 0.006,
    "N_ur": -0.004,
    "Y_deltar": 0.005,
    "N_deltar": -0.002,
}
ADDED = {"X_udot": -0.0005, "Y_vdot": -0.012, "Z_wdot": -0.012, "N_vdot": -0.0009}
ADDED |= {"K_pdot": -0.00002, "M_qdot": -0.0006, "N_rdot": -0.0006}
# Error of second order on the finest grid, as a part of a load.
GRID_ERROR = 0.01


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    folder = write_files(tmp_path_factory.mktemp("lines"))
    batch = ident.plan_cases(
        folder / "captive",
        folder / "hull.stl",
        folder / "template.toml",
        folder / "cases",
        0.1,
        folder / "facility.toml",
    )
    assert "new of" in repr(batch)
    assert len(repr(batch)) < 400
    return folder


def motion_in(case: Path) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and rate of the body that the dictionaries of a steady case say, along the axes of the mesh."""
    far = np.array(
        FoamFieldFile(case / "0.orig" / "U").boundary_field["far"].get("freestreamValue", np.zeros(3)), float
    )
    if not (case / "constant" / "MRFProperties").is_file():
        return -far, np.zeros(3)
    inner = np.array(FoamFieldFile(case / "0.orig" / "U").boundary_field["far"]["inletValue"], float)
    frame = FoamFile(case / "constant" / "MRFProperties")["frame"]
    rate = float(frame["omega"]) * np.array(frame["axis"], float)
    # Where the origin of the mesh is, the body has the velocity of the frame, and slides against the water.
    return -inner + np.cross(rate, -np.array(frame["origin"], float)), rate


def half(power: int) -> float:
    """1/2 L^n of the model; the solver's loads are over the density."""
    return 0.5 * LENGTH**power


def steady_loads(case: Path, deflection: float) -> tuple[np.ndarray, np.ndarray]:
    """Kinematic force and moment about the vehicle's origin of the known derivatives."""
    (u, v, _), (_, _, r) = motion_in(case)
    if deflection:
        y, n = TRUE["Y_deltar"] * half(2), TRUE["N_deltar"] * half(3)
        return np.array([0.0, y * u * u * deflection, 0.0]), np.array([0.0, 0.0, n * u * u * deflection])
    y = TRUE["Y_v"] * half(2) * u * v + TRUE["Y_ur"] * half(3) * u * r
    n = TRUE["N_v"] * half(3) * u * v + TRUE["N_ur"] * half(4) * u * r
    return np.array([TRUE["X_uu"] * half(2) * u * u, y, 0.0]), np.array([0.0, 0.0, n])


def accelerated_loads(name: str, value: float) -> tuple[np.ndarray, np.ndarray]:
    """Added-mass loads of one acceleration."""
    force, moment = np.zeros(3), np.zeros(3)
    for term, size in ADDED.items():
        output, motion = term.split("_")
        if motion == name:
            power = 3 if motion[0] in "uvw" else 4
            load = size * half(power + (output in "KMN")) * value
            (force if output in "XYZ" else moment)["XYZKMN".index(output) % 3] = load
    return force, moment


def answer(folder: Path, error: float = GRID_ERROR) -> None:
    """What the solver would have written into every case."""
    for case in read_matrix(folder).cases:
        for k, grid in enumerate(case.grids):
            place = folder / "cases" / case.run_id / grid
            control = FoamFile(place / "system" / "controlDict")
            times = np.arange(1.0, 101.0) if case.iterations else np.linspace(0.0, case.duration, 61)[1:]
            drift = 1.0 + error * 1.5 ** (2 * k)
            if case.iterations:
                force, moment = steady_loads(place, case.state.get("plane", 0.0))
                decay = 1.0 + np.exp(-times / 5.0)[:, None]
                force, moment = force * decay, moment * decay
            else:
                name = next(q for q in case.state if q.endswith("dot") and case.state[q])
                force, moment = accelerated_loads(name, case.state[name])
                if case.kind == "accelerated":
                    option = FoamFile(place / "constant" / "fvOptions")["acceleration"]
                    source = np.array(option["injectionRateSuSp"]["U"][0], float)
                    # The source term is minus the acceleration.
                    assert -source["uvw".index(name[0])] == pytest.approx(case.state[name])
                    force, moment = accelerated_loads(name, float(-source["uvw".index(name[0])]))
            assert control["functions"][f"forces_{case.part}"]["CofR"] is not None
            centre = np.array(control["functions"][f"forces_{case.part}"]["CofR"], float)
            write_loads(place, case.part, times, force * drift, moment * drift, centre)


@pytest.fixture(scope="module")
def answered(written, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("answered") / "lines"
    shutil.copytree(written, folder, symlinks=True)
    answer(folder / "cases")
    return folder


@pytest.fixture(scope="module")
def back(answered) -> Campaign:
    return read_campaign(answered / "cases")


def test_every_dictionary_is_one_that_foamlib_reads(written):
    found = [p for p in (written / "cases").rglob("*") if p.is_file() and p.parent.name in ("system", "constant")]
    assert len(found) > 100
    for path in found[::7]:
        assert FoamFile(path).as_dict()


def test_all_kinds_of_motion_are_written(written):
    kinds = {c.kind for c in read_matrix(written / "cases").cases}
    assert kinds == {"inflow", "rotating", "accelerated", "spun"}
    tests = {c.test for c in read_matrix(written / "cases").cases}
    assert {"drift_horizontal", "plane_deflection", "rotating_arm", "acceleration"} <= tests


def test_fit_gives_the_derivatives_back_without_editing(back):
    found = identify(back)
    values = {n.name: v for n, v in zip(found.nodes, found.values, strict=True)}
    for name, value in (TRUE | ADDED).items():
        assert values[name] == pytest.approx(value * (1.0 + GRID_ERROR), rel=2e-3), name


def test_error_of_three_grids_is_the_standard_error_of_a_run(back):
    runs = back.runs
    drift = runs[(runs["test"] == "drift_horizontal") & (runs["Y"].abs() > 1.0)]
    # Of second order the Richardson estimate is the error itself: U = 1.25 delta, two standard errors.
    wanted = 1.25 / 2.0 * GRID_ERROR / (1.0 + GRID_ERROR)
    ruled = math.hypot(wanted, 0.001)
    assert (drift["s_Y"] / drift["Y"].abs()).to_numpy() == pytest.approx(ruled, rel=1e-2)
    assert drift["reduction"].str.contains("grids: .*monotonic of order 2 ").all()


def test_fit_command_reads_the_folder_as_it_is(answered, tmp_path):
    done = CliRunner().invoke(main, ["fit", str(answered / "cases"), "--db", str(tmp_path / "db"), "--measured-only"])
    assert done.exit_code == 0, done.output
    assert "version 0" in done.output


def test_asked_again_the_plan_stops_when_the_errors_are_reached(answered):
    again = ident.plan_cases(
        answered / "captive",
        answered / "hull.stl",
        answered / "template.toml",
        answered / "cases",
        5.0,
        answered / "facility.toml",
    )
    assert again.matrix is None
    assert again.outstanding == ()


def test_runs_shows_what_came_back_and_the_log_of_a_dead_run(answered, tmp_path):
    folder = tmp_path / "cases"
    shutil.copytree(answered / "cases", folder, symlinks=True)
    shutil.copy(answered / "spheroid.toml", tmp_path / "spheroid.toml")
    (dead, unsettled, *_) = (c for c in read_matrix(folder).cases if c.iterations)
    place = folder / "cases" / dead.run_id / "fine"
    shutil.rmtree(place / "postProcessing")
    (place / "state").write_text("failed simpleFoam\n")
    log = (
        "Time = 40\n" + "x\n" * 50 + "--> FOAM FATAL ERROR :\n    Maximum number of iterations exceeded\nFOAM exiting\n"
    )
    (place / "log.simpleFoam").write_text(log)
    place = folder / "cases" / unsettled.run_id / "medium"
    times = np.arange(1.0, 101.0)
    rising = np.array([1.0, 1.0, 1.0]) * times[:, None]
    write_loads(place, unsettled.part, times, rising, rising, np.zeros(3))
    seen = progress(read_matrix(folder), read_campaign(folder))
    states = {(s.run_id, s.grid): s for s in seen.states}
    assert states[dead.run_id, "fine"].word == "died"
    assert states[dead.run_id, "fine"].share == pytest.approx(0.4)
    assert states[dead.run_id, "medium"].word == "done"
    assert list(seen.unconverged) == [unsettled.run_id]
    commands = [command for command, _ in seen.restart]
    assert any(f"{dead.run_id}/fine/Allrun" in c for c in commands)
    assert any(f"{unsettled.run_id}/medium/Allrun 50" in c for c in commands)
    console = Console(file=io.StringIO(), width=80)
    show_progress(seen, console)
    assert "Maximum number of iterations exceeded" in console.file.getvalue()
    assert json.loads(json.dumps(seen.to_dict()))["unconverged"] == seen.unconverged
    # The dead run is awaited, and the rest is fitted.
    assert not read_campaign(folder).runs["run_id"].str.startswith(dead.run_id).any()


def test_a_batch_that_is_not_back_is_not_planned_twice(written, tmp_path):
    folder = tmp_path / "lines"
    shutil.copytree(written, folder, symlinks=True)
    before = read_matrix(folder / "cases")
    given = (folder / name for name in ("captive", "hull.stl", "template.toml", "cases"))
    batch = ident.plan_cases(*given, 0.1, folder / "facility.toml")
    assert set(batch.outstanding) == {c.run_id for c in before.cases}
    cases = before.cases if batch.matrix is None else batch.matrix.cases
    states = [(c.test, c.part, *sorted(c.state.items())) for c in cases]
    assert len(set(states)) == len(states)


# -- oscillation -------------------------------------------------------------------------------------


def test_an_oscillating_mesh_gives_added_mass_about_the_moving_origin(tmp_path):
    folder = write_files(tmp_path)
    template = TEMPLATE.replace("[steady]", '[unsteady]\nkind = "oscillation"\nperiods = 4\n[steady]')
    (folder / "template.toml").write_text(template)
    (folder / "facility.toml").write_text(
        (folder / "facility.toml")
        .read_text()
        .replace("exclude = [", 'exclude = ["towing", "drift_horizontal", "plane_deflection", "rotating_arm", ')
    )
    out = folder / "cases"
    ident.plan_cases(
        folder / "captive", folder / "hull.stl", folder / "template.toml", out, 0.1, folder / "facility.toml"
    )
    for case in read_matrix(out).cases:
        place = out / "cases" / case.run_id
        name = next(q for q in case.state if q.endswith("dot") and case.state[q])
        times = np.linspace(0.0, case.duration, 161)
        axis = "uvw".find(name[0])
        # The grids of a case move alike.
        constant = place / case.grids[0] / "constant"
        if case.kind == "moving":
            given = FoamFile(constant / "dynamicMeshDict")["oscillatingLinearMotionCoeffs"]
            amplitude, omega = float(given["amplitude"][axis]), float(given["omega"])
        else:
            # A table of hundreds of rows takes a parser of everything long.
            text = (constant / "MRFProperties").read_text()
            omega = 2.0 * math.pi * case.frequency_hz
            amplitude = float(re.search(r"table\s*\(\s*\(\s*0(?:\.0)?\s+(\S+?)\s*\)", text)[1]) / omega
        at = amplitude * np.sin(omega * times)
        force, moment = accelerated_loads(name, 1.0)
        force, moment = (-(omega**2) * at[:, None] * one for one in (force, moment))
        if case.kind == "moving":
            # A steady side load whose arm about the fixed point of the file goes with the body.
            force = force + np.array([0.0, 0.0, 0.4])
            moment = moment + np.cross(at[:, None] * np.eye(3)[axis], force)
        for grid in case.grids:
            write_loads(place / grid, case.part, times, force, moment, np.zeros(3))
    found = identify(read_campaign(out))
    values = {n.name: v for n, v in zip(found.nodes, found.values, strict=True)}
    for name, value in ADDED.items():
        assert values[name] == pytest.approx(value, rel=2e-3), name


def test_a_matrix_that_a_killed_command_began_is_finished(tmp_path, monkeypatch):
    """Cases are whole folders; what says that the matrix was not finished goes with the command that finishes it."""
    folder = write_files(tmp_path / "lines")
    out = folder / "cases"
    given = (folder / "captive", folder / "hull.stl", folder / "template.toml", out, 0.1, folder / "facility.toml")

    def killed(*_: object) -> None:
        # As a kill does: nothing of this process is removed.
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("ident.cfd.matrix.write_campaign", killed)
        patch.setattr("ident.output.shutil.rmtree", lambda *_, **__: None)
        with pytest.raises(KeyboardInterrupt):
            ident.plan_cases(*given)
    (left,) = out.glob(".unfinished.*")
    with pytest.raises(ident.InputError, match="not empty"):
        ident.plan_cases(*given)
    left.rename(left.with_suffix(f".{2**22 + 1}"))
    next(out.glob("cases/*/*")).joinpath("half").write_text("half")
    made = ident.plan_cases(*given).matrix
    assert not list(out.glob(".*"))
    assert not list(out.rglob("half"))
    assert (out / "campaign.toml").is_file()
    for case in made.cases:
        for grid in case.grids:
            assert (out / "cases" / case.run_id / grid / "Allrun").is_file(), (case.run_id, grid)
            assert (out / "meshes" / case.mesh / grid / "Allmesh").is_file()


# -- what is said before a case is written -----------------------------------------------------------


def planned(folder: Path) -> tuple[str, bool]:
    """What the command says, and whether it wrote anything."""
    out = folder / "cases"
    command = ["plan", str(folder / "captive"), "--cases", "openfoam", "--surface", str(folder / "hull.stl")]
    command += ["--template", str(folder / "template.toml"), "--facility", str(folder / "facility.toml"), str(out)]
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 2, done.output
    return " ".join(done.output.split()), out.exists()


def changed(folder: Path, old: str, new: str) -> None:
    path = folder / "template.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('unit = "mm"', 'unit = "m"', "unit = 'mm'"),
        ("ratio = 2.0", "ratio = 1.0", "a ratio of 2"),
        ('hull = ["hull"]', 'hull = ["hull", "sail"]', "patch 'sail', which"),
        ('rudders = ["rudder"]\n', "", "patch 'rudder' that no part has"),
        ('rudders = ["rudder"]', 'rudder = ["rudder"]', "no part of the vehicle"),
        ("origin = [1100.0", "origin = [600.0", "centroid x"),
        ('y = "starboard"', 'y = "port"', "left-handed"),
        ("cells_per_length = 40", "cells_per_length = 40\nstretch = 1", "stretch"),
        ('openfoam = "v1912"', 'openfoam = "v1"', "v1912"),
    ],
)
def test_a_wrong_template_is_said_before_a_case_is_written(tmp_path, old, new, said):
    folder = write_files(tmp_path)
    changed(folder, old, new)
    text, wrote = planned(folder)
    assert said in text
    assert not wrote


@pytest.mark.parametrize("fault", ["open", "inverted", "one triangle turned", "twice as fat"])
def test_a_wrong_surface_is_said_before_a_case_is_written(tmp_path, fault):
    folder = write_files(tmp_path)
    parts = surfaces()
    hull = parts["hull"]
    if fault == "open":
        hull.update_faces(np.arange(len(hull.faces)) > 3)
    elif fault == "inverted":
        hull.invert()
    elif fault == "one triangle turned":
        faces = np.array(hull.faces)
        faces[7] = faces[7][::-1]
        hull.faces = faces
    else:
        hull.apply_scale([1.0, 1.5, 1.5])
    write_stl(folder / "hull.stl", parts)
    text, wrote = planned(folder)
    said = {"open": "edges are open", "inverted": "normals point inward", "twice as fat": "volume [m3]"}
    assert said.get(fault, "edges are open") in text
    assert not wrote


def test_a_plane_that_is_not_a_body_of_its_own_is_not_turned(tmp_path):
    folder = write_files(tmp_path)
    parts = surfaces()
    hull = parts["hull"]
    aft = hull.triangles_center[:, 0] > 1600.0
    stern = hull.submesh([np.flatnonzero(aft)], append=True)
    hull.update_faces(~aft)
    parts = {"hull": hull, "rudder": stern}
    write_stl(folder / "hull.stl", parts)
    changed(folder, "[fluid]", "[tolerances]\nvolume = 0.2\ncentroid = 0.2\n[fluid]")
    text, wrote = planned(folder)
    assert "share edges" in text
    assert not wrote


def test_depth_without_a_surface_is_refused(tmp_path):
    folder = write_files(tmp_path)
    path = folder / "facility.toml"
    path.write_text(
        path.read_text().replace(
            "[plane_deflection]\nspeed_mps = [2.0]\ndepth_m = [40.0]",
            "[plane_deflection]\nspeed_mps = [2.0]\ndepth_m = [3.0]",
        )
    )
    text, wrote = planned(folder)
    assert "depths" in text
    assert "double_body" in text
    assert not wrote


def test_coarser_grids_that_are_missing_are_named(answered, tmp_path):
    folder = tmp_path / "cases"
    shutil.copytree(answered / "cases", folder, symlinks=True)
    shutil.copy(answered / "spheroid.toml", tmp_path / "spheroid.toml")
    path = folder / "campaign.toml"
    path.write_text(path.read_text().replace("awaited = true", "awaited = false"))
    first = read_matrix(folder).cases[0].run_id
    shutil.rmtree(folder / "cases" / first / "coarse" / "postProcessing")
    with pytest.raises(InputError, match=r"source\.grids"):
        read_campaign(folder)
