"""Authority: potential flow about a spheroid (Lamb 1932, sections 114-115), held by OpenFOAM end to end.

Marked ``solver``: a quarter of an hour on one idle core. Matrix, cases, meshes, solver and fit are those of the
commands.
"""

from __future__ import annotations

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from made_lines import TEMPLATE, VEHICLE, facility, write_stl, write_texts

import ident
from ident.captive.campaign import read_campaign
from ident.cfd.matrix import read_matrix
from ident.identification.identify import identify


def lamb(a: float, b: float) -> tuple[float, float, float]:
    """k1, k2 and k' of a prolate spheroid of half length a and half width b."""
    e = math.sqrt(1.0 - (b / a) ** 2)
    log = math.log((1.0 + e) / (1.0 - e))
    alpha = 2.0 * (1.0 - e**2) / e**3 * (0.5 * log - e)
    beta = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * log
    turning = e**4 * (beta - alpha) / ((2.0 - e**2) * (2.0 * e**2 - (2.0 - e**2) * (beta - alpha)))
    return alpha / (2.0 - alpha), beta / (2.0 - beta), turning


def write_spheroid(folder: Path) -> None:
    """Four metres long, drawn in metres about its middle; no rudder, no propeller."""
    vehicle = VEHICLE.split("[propeller]")[0].replace("[0.2, 0.0", "[0.0, 0.0")
    template = TEMPLATE.split("[grid]")[0].replace('rudders = ["rudder"]\n', "")
    for old, new in (
        ('unit = "mm"\nratio = 2.0', 'unit = "m"'),
        ('x = "aft"', 'x = "forward"'),
        ('z = "up"', 'z = "down"'),
        ("[1100.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]"),
    ):
        assert old in template
        template = template.replace(old, new)
    template += (
        "[grid]\ncells_per_length = 90\nlevels = 4\nextent = 2.0\nrefinement = 1.25\n[steady]\niterations = 250\n"
    )
    rig = facility('["pure_rotation", "drift_vertical"]', 1.0, 0.5)
    write_texts(folder, vehicle, rig, template)
    hull = trimesh.creation.icosphere(subdivisions=4)
    hull.apply_scale([2.0, 0.4, 0.4])
    write_stl(folder / "hull.stl", {"hull": hull})


@pytest.mark.solver
def test_spheroid_from_lines_to_derivatives(tmp_path):
    write_spheroid(tmp_path)
    given = (tmp_path / name for name in ("captive", "hull.stl", "template.toml", "cases"))
    ident.plan_cases(*given, 0.1, tmp_path / "facility.toml")
    done = subprocess.run([str(tmp_path / "cases" / "Allrun")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    found = identify(read_campaign(tmp_path / "cases"))
    assert len(read_matrix(tmp_path / "cases").cases) == len(found.campaign.runs)
    values = {n.name: float(v) for n, v in zip(found.nodes, found.values, strict=True)}
    errors = {n.name: float(s) for n, s in zip(found.nodes, np.sqrt(np.diag(found.covariance)), strict=True)}
    k1, k2, turning = lamb(2.0, 0.4)
    volume = 4.0 / 3.0 * math.pi * 2.0 * 0.4**2
    inertia = volume * (2.0**2 + 0.4**2) / 5.0
    unit = {n: 0.5 * 4.0**n for n in (3, 5)}
    wanted = {
        "N_v": -(k2 - k1) * volume / unit[3],
        "Y_v": 0.0,
        "Y_ur": -k1 * volume / unit[3],
        "N_ur": 0.0,
        "X_udot": -k1 * volume / unit[3],
        "Y_vdot": -k2 * volume / unit[3],
        "N_rdot": -turning * inertia / unit[5],
    }
    for name, value in wanted.items():
        print(f"{name:8s} {values[name]:10.6f} +- {errors[name]:.6f}, potential {value:10.6f}")
    # N_v comes out of two angles beside N_v|v|, and its grids oscillate: half their span says less than is missing
    # (docs/lines-to-runs.md). It is held as the large loads are, to a tenth.
    for name in wanted.keys() - {"N_v"}:
        assert abs(values[name] - wanted[name]) < 3.0 * errors[name], name
    for name in ("N_v", "X_udot", "Y_vdot", "N_rdot"):
        assert values[name] == pytest.approx(wanted[name], rel=0.1), name
