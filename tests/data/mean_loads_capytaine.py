"""Mean wave loads on submerged spheroids by a panel method: makes ``mean_loads_capytaine.csv``.

    pip install "capytaine>=3,<4"; python tests/data/mean_loads_capytaine.py

First-order potentials by capytaine (BEM, deep water); mean force and moment by the momentum
flux through a closed surface in the water round the body,

    F = rho int <|v|^2/2 n - v (v . n)> dS,    M = rho int r x <|v|^2/2 n - v (v . n)> dS,

which holds for fixed and for freely floating bodies (Lee 2006). The body is homogeneous,
neutrally buoyant, and does not roll. Unit amplitude; axes x ahead, y to port, z up, moments
about the centre; the heading is that the waves travel to, counter-clockwise.
"""

import csv
from pathlib import Path

import capytaine as cpt
import numpy as np
from capytaine.bem.airy_waves import airy_waves_velocity, froude_krylov_force

RHO, G = 1025.0, 9.81
COLUMNS = ["a_m", "b_m", "depth_m", "omega_radps", "heading_deg", "free", "X", "Y", "Z", "K", "M", "N"]


def spheroid(a, b, depth, along, around):
    """Quadrilateral panels, outward."""
    t, p = np.linspace(0.0, np.pi, along + 1), 2.0 * np.pi * np.arange(around) / around
    ring = [(-a * np.cos(s), b * np.sin(s) * np.cos(q), b * np.sin(s) * np.sin(q) - depth) for s in t for q in p]
    i, j = (k.ravel() for k in np.meshgrid(np.arange(along), np.arange(around), indexing="ij"))
    after = (j + 1) % around
    faces = np.stack([i * around + j, i * around + after, (i + 1) * around + after, (i + 1) * around + j], axis=1)
    mesh = cpt.Mesh(np.array(ring), faces)
    outward = np.einsum("ij,ij->i", mesh.faces_normals, mesh.faces_centers + np.array([0.0, 0.0, depth])).mean() > 0.0
    return mesh if outward else cpt.Mesh(np.array(ring), faces[:, ::-1])


def control_surface(a, b, depth, along, around):
    """Gauss points and outward area vectors of a spheroid in the water."""
    u, w = np.polynomial.legendre.leggauss(along)
    u, p = np.meshgrid(u, 2.0 * np.pi * (np.arange(around) + 0.5) / around, indexing="ij")
    s = np.sqrt(1.0 - u * u)
    points = np.stack([a * u, b * s * np.cos(p), b * s * np.sin(p) - depth], axis=-1)
    area = np.stack([b * b * u, a * b * s * np.cos(p), a * b * s * np.sin(p)], axis=-1)
    return points.reshape(-1, 3), (area * (w[:, None, None] * 2.0 * np.pi / around)).reshape(-1, 3)


def rows(a, b, depth, omegas, headings, mesh, gap, surface):
    """Mean loads on one spheroid, fixed and free, a row each."""
    body_mesh, centre = spheroid(a, b, depth, *mesh), (0.0, 0.0, -depth)
    body = cpt.FloatingBody(body_mesh, dofs=cpt.rigid_body_dofs(rotation_center=centre), center_of_mass=centre)
    dofs = ["Surge", "Sway", "Heave", "Pitch", "Yaw"] if a != b else ["Surge", "Sway", "Heave"]
    mass = RHO * body_mesh.volume
    inertia = np.diag([mass] * 3 + [mass * (a * a + b * b) / 5.0] * 2)[: len(dofs), : len(dofs)]
    points, area = control_surface(a + gap, b + gap, depth, *surface)
    solver = cpt.BEMSolver()
    for w in omegas:
        common = {"body": body, "omega": w, "rho": RHO, "g": G}
        moved = [solver.solve(cpt.RadiationProblem(radiating_dof=d, **common)) for d in dofs]
        added = np.array([[r.added_masses[i] for r in moved] for i in dofs])
        damping = np.array([[r.radiation_dampings[i] for r in moved] for i in dofs])
        flows = [solver.compute_velocity(points, r) for r in moved]
        for heading in headings:
            problem = cpt.DiffractionProblem(wave_direction=np.radians(heading), **common)
            result, incident = solver.solve(problem), froude_krylov_force(problem)
            load = np.array([result.forces[i] + incident[i] for i in dofs])
            held = solver.compute_velocity(points, result) + airy_waves_velocity(points, problem)
            response = np.linalg.solve(-w * w * (inertia + added) - 1j * w * damping, load)
            drifting = held + sum(x * flow for x, flow in zip(response, flows, strict=True))
            for free, v in ((0, held), (1, drifting)):
                through = (v.conj() * area).sum(axis=1)[:, None]
                force = RHO * (0.25 * (np.abs(v) ** 2).sum(axis=1)[:, None] * area - 0.5 * np.real(v * through))
                moment = np.cross(points - centre, force).sum(axis=0)
                numbers = (*force.sum(axis=0), *moment)
                yield [a, b, depth, w, heading, free, *(f"{x:.6g}" for x in numbers)]


def main():
    """Write the table beside this file."""
    with Path(__file__).with_suffix(".csv").open("w", encoding="utf-8", newline="") as f:
        writer = csv.writer(f)
        writer.writerow(COLUMNS)
        writer.writerows(rows(5.0, 5.0, 12.0, [0.6, 0.9, 1.2], [0.0], (32, 32), 2.0, (28, 28)))
        writer.writerows(rows(35.0, 4.8, 13.87, [0.661, 0.9], [0.0, 45.0, 90.0], (64, 32), 2.4, (56, 28)))


if __name__ == "__main__":
    main()
