"""A plan as a matrix of cases: which run is made how, on which mesh, and the campaign that reads it."""

from __future__ import annotations

import json
import math
import os
import shutil
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ident.captive.conversions import to_full_scale
from ident.captive.run_table import STATES
from ident.cfd import scripts
from ident.cfd.case import Case
from ident.cfd.cases import Body, Disc, PlannedCase, write_case, write_mesh
from ident.cfd.grids import GRIDS, wall_cell
from ident.cfd.motions import UNWRITTEN, Motion, motion_of
from ident.cfd.sources import write_campaign
from ident.cfd.surfaces import Lines, turned
from ident.cfd.template import Template
from ident.output import Tell, check_folder, is_begun, silent, whole, workshop
from sim.boat.vehicle import Vehicle
from sim.files.errors import InputError

Array = NDArray[np.float64]
MATRIX = "matrix.json"
# Largest difference of two depths that are one [of the length].
_SAME_DEPTH = 1e-6


@dataclass
class Matrix:
    """All cases of a folder.

    Attributes
    ----------
    folder : Where they are.
    cases : Those that are written, of earlier batches too.
    left_out : Run -> why no case can be written for it.
    new : Names of the cases of the last batch.
    """

    folder: Path
    cases: list[Case] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    new: list[str] = field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """For ``matrix.json`` and ``--json``."""
        return {"cases": [asdict(c) for c in self.cases], "left_out": self.left_out, "new": self.new}


def is_matrix(folder: Path) -> bool:
    """Whether a folder holds a matrix of cases."""
    return (folder / MATRIX).is_file()


def read_matrix(folder: Path) -> Matrix:
    """The matrix of a folder.

    Raises
    ------
    InputError
        For a file that is not one of this program's.
    """
    path = folder / MATRIX
    try:
        data = json.loads(path.read_text("utf-8"))
        return Matrix(folder, [Case(**c) for c in data["cases"]], data["left_out"], data["new"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        text = "as ident plan --cases wrote it"
        raise InputError(str(path), f"cannot be read: {error}"[:200], text) from error


@dataclass(frozen=True)
class MeshedBoat:
    """The boat of a matrix.

    Attributes
    ----------
    vehicle : Its geometry.
    file : Bundled name or path of its vehicle file, for the campaign.
    lines : Its surface, checked.
    """

    vehicle: Vehicle
    file: str
    lines: Lines


def write_matrix(
    runs: pd.DataFrame,
    boat: MeshedBoat,
    template: Template,
    out: Path,
    where: str,
    tell: Tell = silent,
) -> Matrix:
    """Write a case folder for every run, the meshes they share, scripts and ``campaign.toml``.

    Parameters
    ----------
    runs : Of a plan: program frame, SI, radians, full scale.
    boat : Of the runs.
    template : What all cases share.
    out : Folder to write to; a matrix that is there is added to.
    where : The template file, for messages.
    tell : Told of every case.

    Returns
    -------
    Matrix

    Raises
    ------
    InputError
        For a folder that holds something else, a part without patches, several depths in unbounded water, or a
        motion that a case cannot have. Nothing is written then.
    """
    check_folder(out)
    if out.is_dir() and any(out.iterdir()) and not is_matrix(out) and not is_begun(out):
        raise InputError(str(out), "a folder that is not empty", "a new folder, or one that ident plan --cases wrote")
    matrix = read_matrix(out) if is_matrix(out) else Matrix(out)
    planned = _prepared(runs, boat.vehicle, boat.lines, template, matrix, where)
    with workshop(out) as place:
        _write_folders(planned, template, out, place, tell)
        matrix.cases += [one.case for one in planned]
        matrix.new = [one.case.run_id for one in planned]
        _write_scripts(out, matrix, template)
        write_campaign(out, matrix.cases, boat.vehicle, boat.file, template)
        with whole(out / MATRIX) as part:
            part.write_text(json.dumps(matrix.to_dict(), indent=1) + "\n", encoding="utf-8")
    return matrix


def _write_folders(planned: list[PlannedCase], template: Template, out: Path, place: Path, tell: Tell) -> None:
    """A folder for each mesh that is not there yet, and one for every case and grid: whole, from ``place``."""
    meshes: dict[str, Body] = {}
    for one in planned:
        meshes.setdefault(one.case.mesh, one.body)
    names = GRIDS[: template.grid.number]
    for done, (name, body) in enumerate(meshes.items()):
        tell("writing meshes", done, len(meshes))
        for grid in names:
            below = Path("meshes") / name / grid
            if not (out / below / "Allmesh").is_file():
                write_mesh(place / below, body, template, grid)
                _moved(place / below, out / below)
    for done, one in enumerate(planned):
        tell("writing cases", done, len(planned))
        for grid in names:
            below, mesh = Path("cases") / one.case.run_id / grid, place / "meshes" / one.case.mesh / grid
            wall = wall_cell(template, one.body.length, grid)
            write_case(place / below, mesh, one, template, wall)
            _moved(place / below, out / below)
    tell("writing cases", len(planned), len(planned))


def _moved(made: Path, target: Path) -> None:
    """A finished folder takes its place, and that of one which a killed command left there: no matrix names it."""
    if target.exists():
        shutil.rmtree(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    made.rename(target)


def _prepared(
    runs: pd.DataFrame, vehicle: Vehicle, lines: Lines, template: Template, matrix: Matrix, where: str
) -> list[PlannedCase]:
    """Every run as a case, none written yet."""
    scaled = to_full_scale(runs, 1.0 / template.surface.ratio).reset_index(drop=True)
    start = max((int(c.run_id[1:]) for c in matrix.cases), default=0)
    matrix.left_out = {}
    _one_depth(scaled, matrix.cases, template, lines.length, where)
    planned: list[PlannedCase] = []
    for _, run in scaled.iterrows():
        name = f"P{start + len(planned) + 1:03d}"
        test, part = str(run["test"]), str(run["part"])
        if test in UNWRITTEN:
            matrix.left_out[f"{test}, {part}"] = f"it needs {UNWRITTEN[test]}"
            continue
        planned.append(_case(name, run, vehicle, lines, template, where))
    if template.disc:
        planned += _propelled(start + len(planned), vehicle, lines, template, where)
    if not planned:
        wrong = "; ".join(f"{k}: {v}" for k, v in matrix.left_out.items()) or "no run in the plan"
        raise InputError("plan", wrong, "runs that a case can be written for; another --target-rel, or a --facility")
    return planned


def _one_depth(runs: pd.DataFrame, cases: list[Case], template: Template, length: float, where: str) -> None:
    """Unbounded water is one depth."""
    if template.flow.free_surface != "none":
        return
    depths = sorted({*runs["D0"].dropna(), *(c.state["D0"] for c in cases if "D0" in c.state)})
    if len(depths) > 1 and depths[-1] - depths[0] > _SAME_DEPTH * length:
        wrong = f"runs at {len(depths)} depths, {depths[0]:g} to {depths[-1]:g} m, and free_surface = 'none'"
        text = "one depth_m in the --facility file, or free_surface = 'double_body'"
        raise InputError(f"{where}, key flow.free_surface", wrong, text)


def _case(name: str, run: pd.Series, vehicle: Vehicle, lines: Lines, template: Template, where: str) -> PlannedCase:
    """One run of the plan."""
    test, part = str(run["test"]), str(run["part"])
    place = f"run {name} ({test}, {part})"
    if part not in template.parts:
        text = f"[parts] {part} = [patches] in {where}; or a --facility file with exclude = [{test!r}]"
        raise InputError(place, f"no patches of part {part!r}", text)
    ratio, length = template.surface.ratio, lines.length
    motion = motion_of(run, template, length, place)
    plane = float(run["plane"]) if run["plane"] == run["plane"] else 0.0
    patches, mesh = lines.patches, "hull"
    if abs(plane) > 0.0:
        named = [p for p in vehicle.planes if p.name == part]
        if not named:
            raise InputError(place, f"{part} at {math.degrees(plane):g} deg", "a run of a plane")
        patches = turned(lines, template.parts[part], named[0], plane, ratio, where)
        mesh = f"{part}_{_word(math.degrees(plane))}"
    surface_z = None
    if template.flow.free_surface == "double_body":
        surface_z, mesh = _surface(run, vehicle, lines, ratio, mesh, place)
    if (motion.turn != np.eye(3)).any():
        mesh += f"_at_{_word(math.degrees(run['alpha']))}_{_word(math.degrees(run['beta'] or 0.0))}"
        patches = {n: type(p)(p.vertices @ motion.turn.T, p.triangles, p.part, p.names) for n, p in patches.items()}
        if surface_z is not None:
            # The sail top stays where the depth is measured from.
            top = np.array(vehicle.needed_sail_top("depth")) / ratio
            surface_z = float((motion.turn @ top)[2] - run["D0"])
    body = Body(patches, length, surface_z)
    case = Case(
        name,
        test,
        part,
        {k: float(run[k]) for k in STATES if k in run and run[k] == run[k]},
        motion.kind,
        mesh,
        list(GRIDS[: template.grid.number]),
        axes="tank" if (motion.turn != np.eye(3)).any() else "body",
        frequency_hz=motion.frequency,
        amplitude=motion.amplitude if motion.oscillates else 0.0,
        duration=motion.duration,
        iterations=template.steady.iterations if motion.steady else 0,
    )
    return PlannedCase(case, motion, body, np.zeros(3), _speed(run, motion, length))


def _surface(run: pd.Series, vehicle: Vehicle, lines: Lines, ratio: float, mesh: str, place: str) -> tuple[float, str]:
    """Where the water's surface is in mesh axes, and the name of the mesh."""
    if not run["D0"] == run["D0"]:
        raise InputError(place, "no depth, and free_surface = 'double_body'", "depth_m in the --facility file")
    top = vehicle.needed_sail_top("a depth below the surface")[2] / ratio
    z = top - float(run["D0"])
    highest = float(lines.body.vertices[:, 2].min())
    if z >= highest:
        raise InputError(place, f"a surface {z - highest:.4g} m below the boat's highest point", "a deeper D0")
    return z, f"{mesh}_depth_{_word(float(run['D0']))}"


def _word(value: float) -> str:
    """A number in a folder's name: ``m10``, ``2p5``."""
    return f"{value:.6g}".replace("-", "m").replace(".", "p").replace("+", "")


def _speed(run: pd.Series, motion: Motion, length: float) -> float:
    """A speed of the flow past the hull [m/s]."""
    rates = np.array([run[k] if run[k] == run[k] else 0.0 for k in "pqr"], dtype=float)
    name, value = motion.acceleration
    reached = abs(value) * motion.duration * (0.5 * length if name in ("pdot", "qdot", "rdot") else 1.0)
    if motion.oscillates:
        reached = 2.0 * math.pi * motion.frequency * motion.amplitude
    steady = float(run["U"]) if run["U"] == run["U"] else 0.0
    return max(steady, 0.5 * length * float(np.linalg.norm(rates)), reached)


def _propelled(start: int, vehicle: Vehicle, lines: Lines, template: Template, where: str) -> list[PlannedCase]:
    """Each self-propelled run with its towed twin."""
    propeller = vehicle.needed_propeller("an actuator disc")
    if propeller.position is None:
        raise InputError(f"vehicle {vehicle.name}, key propeller.position", "nothing", "where the disc is")
    ratio = template.surface.ratio
    out: list[PlannedCase] = []
    for disc_point in template.disc:
        speed, depth = disc_point.speed_mps / math.sqrt(ratio), disc_point.depth_m / ratio
        state = pd.Series({**dict.fromkeys(STATES, math.nan), "U": speed, "alpha": 0.0, "beta": 0.0, "D0": depth})
        run = pd.concat([state, pd.Series({"test": "towing", "part": "hull"})])
        towed = _case(f"P{start + len(out) + 1:03d}", run, vehicle, lines, template, where)
        diameter = propeller.diameter.value / ratio
        disc = Disc(np.array(propeller.position.value) / ratio, 0.5 * diameter, disc_point.thickness * diameter)
        thrust = disc_point.thrust_n / ratio**3
        motion = Motion("propelled", far=towed.motion.far, thrust=thrust / template.fluid.density_kgpm3)
        body = Body(towed.body.patches, towed.body.length, towed.body.surface_z, disc)
        case = Case(
            f"P{start + len(out) + 2:03d}",
            "self_propulsion",
            "hull",
            towed.case.state,
            "propelled",
            f"{towed.case.mesh}_disc_{_word(disc_point.thickness)}",
            towed.case.grids,
            iterations=template.steady.iterations,
            towed=towed.case.run_id,
            thrust_n=thrust,
            thrust_source=disc_point.source,
        )
        out += [towed, PlannedCase(case, motion, body, np.zeros(3), towed.speed)]
    return out


def _write_scripts(out: Path, matrix: Matrix, template: Template) -> None:
    """``cases.txt``, ``Allrun``, ``submit_dask.py``, and ``slurm.sh`` where the template names a cluster."""
    folders = [f"cases/{c.run_id}/{grid}" for c in matrix.cases for grid in c.grids]
    texts = {"cases.txt": "\n".join(folders) + "\n", "Allrun": scripts.matrix(), "submit_dask.py": scripts.dask()}
    if template.machine.slurm:
        texts["slurm.sh"] = scripts.array(template.machine.slurm, template.machine.cores, len(folders))
    for name, text in texts.items():
        with whole(out / name) as part:
            part.write_text(text, encoding="utf-8")
        if name in ("Allrun", "slurm.sh"):
            os.chmod(out / name, 0o755)
