"""A spheroid with a rudder as lines, and output of a solver as OpenFOAM v1912 writes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

VEHICLE = """
name = "spheroid"
title = "Spheroid of five diameters with a rudder"
source = "made"
term_set = "gertler_hagen"
added_mass = "derivatives"
[frame]
x = "forward"
y = "starboard"
z = "down"
origin = "0.2 m aft of the centre"
[particulars]
length = { value = 4.0, unit = "m", source = "made" }
mass = { value = 1340.4, unit = "kg", source = "made" }
displaced_mass = { value = 1340.4, unit = "kg", source = "4/3 pi a b b rho" }
radius_of_gyration = { value = [0.25, 0.9, 0.9], unit = "m", source = "made" }
centre_of_gravity = { value = [0.2, 0.0, 0.01], unit = "m", source = "made" }
centre_of_buoyancy = { value = [0.2, 0.0, 0.0], unit = "m", source = "made" }
sail_top = { value = [0.2, 0.0, -0.4], unit = "m", source = "highest point" }
[propeller]
name = "made"
limits = { value = [0.01, 60.0], unit = "rps", source = "made" }
rate = { value = 60.0, unit = "rps/s", source = "made" }
diameter = { value = 0.3, unit = "m", source = "made" }
position = { value = [-1.75, 0.0, 0.0], unit = "m", source = "made" }
[[planes]]
name = "rudders"
where = "stern"
position = [-1.4, 0.0, 0.0]
span_axis = [0.0, 0.0, 1.0]
leading_edge = [1.0, 0.0, 0.0]
mirror = "rudders"
mixer = { dV = 0.0, dH = -1.0 }
limit_deg = 30.0
rate_degps = 5.0
source = "made"
"""

CAMPAIGN = """
name = "spheroid"
vehicle = "../spheroid.toml"
facility = "none yet"
provenance = "a campaign whose runs are still to come"
frame = { x = "forward", y = "starboard", z = "down", angles = "flight" }
moment_point = { x_m = 0.0, y_m = 0.0, z_m = 0.0, about = "origin" }
scale = { ratio = 1.0, length_m = 4.0 }
fluid = { density_kgpm3 = 1000.0, source = "fresh water" }
inertia = { model_inertia_in_loads = false }
uncertainty = { floor = 0.02, source = "made" }
quality = { made = { factor = 1.0, meaning = "made" } }
"""

_TOWED = """
[towing]
speed_mps = [2.0]
depth_m = [40.0]
[drift_horizontal]
speed_mps = [2.0]
depth_m = [40.0]
beta_deg = [6.0]
[rotating_arm]
speed_mps = [2.0]
depth_m = [40.0]
r_radps = [0.15]
"""


def facility(exclude: str, linear: float, angular: float) -> str:
    """A facility file: towing, drift, rotation and accelerations [m/s^2, rad/s^2] at one speed and depth."""
    return f"""
name = "solver"
exclude = {exclude}
{_TOWED}
[acceleration]
depth_m = [40.0]
linear_mps2 = [{linear}]
angular_radps2 = [{angular}]
"""


FACILITY = (
    facility('["pure_rotation", "drift_vertical", "propeller_side_force"]', 0.5, 0.2).replace(
        "r_radps = [0.15]", "beta_deg = [6.0]\nr_radps = [0.15]"
    )
    + """
[plane_deflection]
speed_mps = [2.0]
depth_m = [40.0]
plane_deg = [10.0]
"""
)

# The surface is drawn in millimetres at a scale of 1:2, x aft from the nose, z up.
TEMPLATE = """
openfoam = "v1912"
[surface]
unit = "mm"
ratio = 2.0
x = "aft"
y = "starboard"
z = "up"
origin = [1100.0, 0.0, 0.0]
[parts]
hull = ["hull"]
rudders = ["rudder"]
[fluid]
density_kgpm3 = 1000.0
kinematic_viscosity_m2ps = 1.0e-6
source = "fresh water"
[uncertainty]
rel_sigma = 0.001
floor = 0.01
source = "made"
[grid]
cells_per_length = 40
levels = 3
extent = 2.0
refinement = 1.5
[steady]
iterations = 100
"""


def surfaces() -> dict[str, trimesh.Trimesh]:
    """Hull and rudder in the surface's own axes [mm]."""
    hull = trimesh.creation.icosphere(subdivisions=2)
    # As much volume as the spheroid that the triangles stand for.
    wider = float(np.sqrt(4.0 / 3.0 * np.pi / hull.volume))
    hull.apply_scale([1000.0, 200.0 * wider, 200.0 * wider])
    hull.apply_translation([1000.0, 0.0, 0.0])
    rudder = trimesh.creation.box(extents=[80.0, 10.0, 300.0])
    rudder.apply_translation([1800.0, 0.0, 0.0])
    return {"hull": hull, "rudder": rudder}


def write_stl(path: Path, parts: dict[str, trimesh.Trimesh]) -> None:
    """Text STL, a solid a patch."""
    lines = []
    for name, mesh in parts.items():
        lines.append(f"solid {name}")
        for corners in mesh.triangles:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += [f"vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
            lines += ["endloop", "endfacet"]
        lines.append(f"endsolid {name}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_texts(folder: Path, vehicle: str = VEHICLE, test_rig: str = FACILITY, template: str = TEMPLATE) -> None:
    """Vehicle, campaign without runs, facility and template."""
    (folder / "captive").mkdir(parents=True)
    for name, text in (
        ("spheroid.toml", vehicle),
        ("captive/campaign.toml", CAMPAIGN),
        ("facility.toml", test_rig),
        ("template.toml", template),
    ):
        (folder / name).write_text(text, encoding="utf-8")


def write_files(folder: Path) -> Path:
    """The texts and the surface."""
    write_texts(folder)
    write_stl(folder / "hull.stl", surfaces())
    return folder


def write_loads(folder: Path, part: str, times: np.ndarray, force: np.ndarray, moment: np.ndarray, centre) -> None:
    """``force.dat`` and ``moment.dat`` of a function object as OpenFOAM v1912 writes them, all of it pressure."""
    place = folder / "postProcessing" / f"forces_{part}" / "0"
    place.mkdir(parents=True, exist_ok=True)
    point = " ".join(f"{c:.10e}" for c in centre)
    for name, title, values in (("force", "Force", force), ("moment", "Moment", moment)):
        text = f"# {title:<16}\n# CofR            : ({point})\n#\n# Time            \t"
        text += "\t".join(f"({s}_x {s}_y {s}_z)" for s in ("total", "pressure", "viscous")) + "\n"
        for t, v in zip(times, np.broadcast_to(values, (len(times), 3)), strict=True):
            own = "(" + " ".join(f"{x:.10e}" for x in v) + ")"
            text += f"{t:<18.12g}\t{own}\t{own}\t(0.0000000000e+00 0.0000000000e+00 0.0000000000e+00)\n"
        (place / f"{name}.dat").write_text(text, encoding="utf-8")
