"""Added mass and wave damping against depth by a panel method: ``capytaine``, an optional extra.

    pip install 'ident-submarine[panels]'
    python -m sim.hull.added_mass --vehicle bb2 --depth 2.5 --depth 25 --omega 0 --omega inf
    python -m sim.hull.added_mass --vehicle suboff --prime

Potential flow, zero speed, linear free surface, boat at rest and fully submerged: no
viscosity, no forward-speed terms, no emergence. Parts that overlap (sail on deck, roots on
hull) lose the panels that lie inside another part; the ragged rim costs about a per cent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click
import numpy as np
from numpy.typing import NDArray

from sim.files.errors import InputError
from sim.files.extras import library
from sim.hull.mesh import Mesh

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

# Loads and motions by their letters; panel sizes over that of the geometry file from which added mass is continued.
_LOADS, _MOTIONS = "XYZKMN", "uvwpqr"
_SYMMETRIC = [(i, j) for plane in ((0, 2, 4), (1, 3, 5)) for i in plane for j in plane]
SIZES = (2.0, 1.5)
# Horizontal derivative -> the vertical one that it is for a body alike in both planes, and its sign (a turn about x).
TURNED = {"Y_vdot": ("Z_wdot", 1.0), "N_rdot": ("M_qdot", 1.0), "Y_rdot": ("Z_qdot", -1.0), "N_vdot": ("M_wdot", -1.0)}

DOFS = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")
# Half a turn about x: z up for the panel method, and back.
_TURN = np.array([1.0, -1.0, -1.0])
_SIGNS = np.concatenate([_TURN, _TURN])


def solid_angle(mesh: Mesh, points: Array) -> Array:
    """Solid angle of a closed surface from points, over 4 pi: 1 inside, 0 outside.

    Van Oosterom and Strackee (1983).

    Parameters
    ----------
    mesh : Closed and outward.
    points : (n, 3) [m].
    """
    total = np.zeros(len(points))
    for k, point in enumerate(points):
        a, b, c = np.moveaxis(mesh.corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
        total[k] = 2.0 * np.arctan2(volume, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb).sum()
    return total / (4.0 * np.pi)


def wetted_panels(mesh: Mesh) -> Mesh:
    """The mesh without panels that face the inside of another of its parts.

    The result is not closed where parts meet; it is for panel methods alone.
    """
    keep = np.ones(len(mesh.triangles), dtype=bool)
    size = np.linalg.norm(mesh.areas, axis=1)
    # Just outside each panel, so that a cap lying on another part is found inside it.
    probe = mesh.corners.mean(axis=1) + 0.25 * mesh.areas / np.sqrt(size)[:, None]
    for k, name in enumerate(mesh.names):
        part = mesh.only(name)
        corners = part.corners.reshape(-1, 3)
        near = ((probe >= corners.min(axis=0)) & (probe <= corners.max(axis=0))).all(axis=1) & (mesh.part != k)
        rows = np.flatnonzero(near)
        keep[rows[solid_angle(part, probe[rows]) > 0.5]] = False
    return Mesh(mesh.vertices, mesh.triangles[keep], mesh.part[keep], mesh.names)


def panel_added_mass(
    mesh: Mesh, depth: float, omegas: Sequence[float], density: float, gravity: float
) -> tuple[Array, Array]:
    """Added mass and damping of a submerged body about its origin.

    Parameters
    ----------
    mesh : Outward, body frame [m].
    depth : Of the body origin below the free surface [m]; ``inf`` for unbounded water.
    omegas : Frequencies [rad/s]; 0 and ``inf`` are the rigid-wall and pressure-free limits.
    density, gravity : [kg/m^3], [m/s^2].

    Returns
    -------
    added, damping : (len(omegas), 6, 6) X Y Z K M N by u v w p q r, SI, program frame.

    Raises
    ------
    InputError
        When capytaine is not installed, or the body is not fully submerged.
    """
    cpt = library("capytaine", "panels", "panel method")
    top = -mesh.corners[:, :, 2].min()
    if depth <= top:
        raise InputError("depth of the origin", f"{depth} m", f"more than {top:.4g} m: fully submerged")
    deep = np.isinf(depth)
    vertices = mesh.vertices * _TURN - np.array([0.0, 0.0, 0.0 if deep else depth])
    faces = np.column_stack([mesh.triangles, mesh.triangles[:, 2]])
    centre = (0.0, 0.0, 0.0 if deep else -depth)
    body = cpt.FloatingBody(
        cpt.Mesh(vertices, faces), dofs=cpt.rigid_body_dofs(rotation_center=centre), center_of_mass=centre
    )
    surface = np.inf if deep else 0.0
    problems = [
        cpt.RadiationProblem(body=body, free_surface=surface, omega=w, radiating_dof=dof, rho=density, g=gravity)
        for w in omegas
        for dof in DOFS
    ]
    added, damping = (np.full((len(omegas), 6, 6), np.nan) for _ in range(2))
    place = {float(w): k for k, w in enumerate(omegas)}
    # The solver may return problems in another order.
    for result in cpt.BEMSolver().solve_all(problems, progress_bar=False):
        k, j = place[float(result.omega)], DOFS.index(result.radiating_dof)
        for i, dof in enumerate(DOFS):
            added[k, i, j], damping[k, i, j] = result.added_masses[dof], result.radiation_dampings[dof]
    turn = np.outer(_SIGNS, _SIGNS)
    return added * turn, damping * turn


def depth_table(
    mesh: Mesh, sail_top: float, depths: Sequence[float], omegas: Sequence[float], density: float, gravity: float
) -> pd.DataFrame:
    """Added mass against depth, a row a depth and frequency, with its ratio to deep water.

    Parameters
    ----------
    mesh : Outward, body frame [m].
    sail_top : Height of the sail top above the origin as the vehicle has it (z, negative) [m].
    depths : D0 of the sail top [m].
    omegas, density, gravity : As for ``panel_added_mass``.
    """
    import pandas as pd

    wet = wetted_panels(mesh)
    deep = panel_added_mass(wet, np.inf, [np.inf], density, gravity)[0][0]
    pairs = [(i, i) for i in range(6)] + [(1, 3), (1, 5), (2, 4), (0, 4)]
    rows = []
    for depth in depths:
        added, damping = panel_added_mass(wet, depth - sail_top, omegas, density, gravity)
        for w, a, b in zip(omegas, added, damping, strict=True):
            row = {"D0_m": depth, "omega_radps": w}
            row |= {f"A{i + 1}{j + 1}": a[i, j] for i, j in pairs}
            row |= {f"ratio{i + 1}{i + 1}": a[i, i] / deep[i, i] for i in range(6)}
            rows.append(row | {f"B{i + 1}{i + 1}": b[i, i] for i in range(6)})
    return pd.DataFrame(rows)


def prime_added_mass(meshes: Sequence[Mesh], length: float, sizes: Sequence[float] = SIZES) -> dict[str, Array]:
    """Added mass in unbounded water as derivatives, by two panel sizes and continued to panels of no size.

    Flat panels with a constant source lose a share of added mass that falls as their size: the two values are
    continued in a straight line. A spheroid of the proportions of a submarine and a thin ellipsoid come within 3 %
    of Lamb's closed form by ``SIZES``.

    Parameters
    ----------
    meshes : The surface by two panel sizes, about the body origin.
    length : L of the normalisation [m].
    sizes : The panel sizes over one another.

    Returns
    -------
    ``Y_vdot``, ... -> (3,) by the first, the second, and continued, in 1/2 rho L^n with n = 3, 4, 5: those of a body
    with port/starboard symmetry.

    References
    ----------
    .. [1] Hess, J. L., Smith, A. M. O., J. Ship Research 8(2), 1964.
    .. [2] Lamb, H., Hydrodynamics, 1932, arts. 114, 121.
    """
    by_size = []
    for mesh in meshes:
        added = panel_added_mass(wetted_panels(mesh), np.inf, [np.inf], 1.0, 1.0)[0][0]
        turns = np.arange(6) // 3
        power = 3.0 + np.add.outer(turns, turns)
        by_size.append(-2.0 * added / length**power)
    coarse, fine = by_size
    continued = fine - (coarse - fine) * sizes[1] / (sizes[0] - sizes[1])
    values = np.stack([coarse, fine, continued], axis=-1)
    return {f"{_LOADS[i]}_{_MOTIONS[j]}dot": values[i, j] for i, j in _SYMMETRIC}


def between_planes(derivatives: dict[str, Array]) -> dict[str, float]:
    """What the horizontal plane has more than the vertical one turned by 90 deg: a sail, or planes of one pair.

    Panels lose the same of both planes, so that the difference does not need to be continued: the finer size's.

    Parameters
    ----------
    derivatives : Of ``prime_added_mass``.
    """
    return {name: float(derivatives[name][1] - sign * derivatives[of][1]) for name, (of, sign) in TURNED.items()}


def _prime_table(path: str, length: float) -> pd.DataFrame:
    """Derivatives of a geometry file by both panel sizes, continued, and between the planes."""
    import pandas as pd

    from sim.hull.surface import read_geometry

    known = prime_added_mass([read_geometry(path, size) for size in SIZES], length)
    more = between_planes(known)
    sizes = [f"panels_{size:g}" for size in SIZES]
    table = pd.DataFrame(known, index=[*sizes, "continued"]).T.rename_axis("derivative").reset_index()
    return table.assign(over_the_other_plane=table["derivative"].map(more))


@click.command()
@click.option("--vehicle", "name", required=True, help="Bundled name or vehicle file.")
@click.option("--depth", "depths", multiple=True, type=float, default=(2.5, 25.0), show_default=True, help="D0 [m].")
@click.option("--omega", "omegas", multiple=True, type=float, default=(0.0, np.inf), show_default=True, help="[rad/s].")
@click.option("--prime", is_flag=True, help="Derivatives in deep water instead, in 1/2 rho L^n, by two panel sizes.")
@click.option("--coarser", default=2.0, show_default=True, help="Panel size over that of the geometry file.")
@click.option("--density", default=1025.0, show_default=True, help="[kg/m^3].")
@click.option("--gravity", default=9.81, show_default=True, help="[m/s^2].")
@click.option("--csv", "out", default="-", show_default=True, help="Where to write; - is the screen.")
def main(
    name: str,
    depths: tuple[float, ...],
    omegas: tuple[float, ...],
    prime: bool,
    coarser: float,
    density: float,
    gravity: float,
    out: str,
) -> None:
    """Added mass and wave damping of a vehicle against depth, by capytaine.

    Example: python -m sim.hull.added_mass --vehicle bb2 --depth 2.5 --omega 0.66 --csv -
    """
    from sim.boat.vehicle import load_vehicle
    from sim.hull.surface import read_geometry

    try:
        vehicle = load_vehicle(name)
        if vehicle.geometry is None:
            raise InputError(f"vehicle {vehicle.name}, key geometry", "nothing", "a geometry file")
        if prime:
            table = _prime_table(vehicle.geometry, vehicle.particulars.length.value)
        else:
            mesh = read_geometry(vehicle.geometry, coarser)
            top = vehicle.needed_sail_top("added mass near the surface")[2]
            table = depth_table(mesh, top, depths, omegas, density, gravity)
    except InputError as error:
        raise click.UsageError(str(error)) from error
    text = table.to_csv(index=False, float_format="%.6g")
    if out == "-":
        click.echo(text, nl=False)
    else:
        with open(out, "w", encoding="utf-8") as f:
            f.write(text)


if __name__ == "__main__":
    main()
