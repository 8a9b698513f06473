"""`ident stability`: stability indices, eigenvalues and critical speeds from a version."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ident.derivatives import loads, prime_scale, slope
from sim import kernel
from sim.catalogue import OUTPUTS
from sim.coefficients import Coefficients
from sim.model import Environment, assemble
from sim.simulate import mixer_of, plane_limits
from sim.trim import NoEquilibrium, self_propulsion
from sim.vehicle import Vehicle

if TYPE_CHECKING:
    from rich.console import Console

Array = NDArray[np.float64]
# States of the linearised boat: positions x, y and heading are neutral and left out.
_VERTICAL = (0, 2, 4, 8, 10)
_HORIZONTAL = (1, 3, 5, 9)
_STEP = 1e-4
_DEFLECTION = math.radians(1.0)


@dataclass(frozen=True)
class Stability:
    """Stability of straight level motion at one speed and depth.

    Attributes
    ----------
    speed, depth : U [m/s], D0 [m].
    g_vertical, g_horizontal : Stability indices Gv, Gh; positive is stable.
    neutral_point_vertical, neutral_point_horizontal : Where a cross force gives no turn,
        x of the neutral point over L, positive ahead of the origin.
    critical_speed_stern, critical_speed_sail : Speed [m/s] at which the planes no longer
        change the depth (reversal speed), by group; None when there is none.
    vertical, horizontal : Eigenvalues [1/s] of the motion about self-propulsion, real and
        imaginary part, least stable first; empty when there is no self-propulsion state.
    """

    speed: float
    depth: float
    g_vertical: float
    g_horizontal: float
    neutral_point_vertical: float
    neutral_point_horizontal: float
    critical_speed_stern: float | None
    critical_speed_sail: float | None
    vertical: list[tuple[float, float]]
    horizontal: list[tuple[float, float]]


def stability_index(force: float, moment: float, force_rate: float, moment_rate: float, mass: float) -> float:
    """Stability index G of one plane of motion.

    Gv = 1 - M_w (Z_q + m') / (Z_w M_q), Gh = 1 - N_v (Y_r - m') / (Y_v N_r), Feldman
    (1987); straight motion is stable for G > 0.

    Parameters
    ----------
    force, moment : Z_w, M_w or Y_v, N_v in prime form.
    force_rate, moment_rate : Z_q, M_q or Y_r, N_r in prime form.
    mass : +m' for the vertical, -m' for the horizontal plane, m' = m / (1/2 rho L^3).

    Returns
    -------
    G; infinite when force or moment_rate vanish.
    """
    damping = force * moment_rate
    return 1.0 - moment * (force_rate + mass) / damping if damping else math.inf


def critical_speed(stiffness: float, z_w: float, m_w: float, z_d: float, m_d: float) -> float | None:
    """Reversal speed of a group of planes.

    In steady straight motion Z_w w + Z_d U delta = 0 and M_w w U + M_d U^2 delta =
    stiffness theta; the path angle theta - w/U vanishes at
    U^2 = stiffness / (M_w - M_d Z_w / Z_d).

    Parameters
    ----------
    stiffness : W BG / (1/2 rho L^3) [m^2/s^2].
    z_w, m_w, z_d, m_d : Prime derivatives by w/U and by the deflection.

    Returns
    -------
    Speed [m/s], None when the planes keep their sense at every speed.
    """
    if z_d == 0.0:
        return None
    square = stiffness / (m_w - m_d * z_w / z_d)
    return math.sqrt(square) if square > 0.0 else None


def _plane_slope(model: kernel.Model, vehicle: Vehicle, names: list[str], speed: float, depth: float) -> Array:
    """Loads by the vertical command on some planes [N, N m per rad]."""
    shares = np.array([p.mixer.dV if p.name in names else 0.0 for p in vehicle.planes])
    motion = np.array([speed, 0.0, 0.0, 0.0, 0.0, 0.0])
    up, down = (loads(model, motion, depth, np.append(s * _DEFLECTION * shares, 0.0)) for s in (1.0, -1.0))
    return (up - down) / (2.0 * _DEFLECTION)


def _eigenvalues(
    model: kernel.Model, state: Array, controls: Array, kept: tuple[int, ...]
) -> list[tuple[float, float]]:
    work = kernel.workspace(controls.size - 1)
    jacobian = np.zeros((12, 12))
    for j in kept:
        side = []
        for sign in (1.0, -1.0):
            moved, rate = state.copy(), np.zeros(12)
            moved[j] += sign * _STEP
            kernel.rhs(model, moved, controls, work, rate)
            side.append(rate)
        jacobian[:, j] = (side[0] - side[1]) / (2.0 * _STEP)
    values = np.linalg.eigvals(jacobian[np.ix_(kept, kept)])
    return [(float(v.real), float(v.imag)) for v in sorted(values, key=lambda v: (-v.real, v.imag))]


def stability(coefficients: Coefficients, environment: Environment, speed: float, depth: float) -> Stability:
    """Stability of straight level motion.

    Parameters
    ----------
    coefficients : Of one vehicle.
    environment : Water density and gravity.
    speed, depth : U [m/s], D0 [m].

    Returns
    -------
    Stability; derivatives of the whole boat with the steps of ``ident.derivatives``.
    """
    vehicle, model = coefficients.vehicle, assemble(coefficients, environment)
    particulars = vehicle.particulars
    length, density = particulars.length.value, environment.density
    slopes = {m: slope(model, vehicle, m, speed, depth, 0.0) for m in "vwqr"}

    def prime(symbol: str) -> float:
        output, motion = symbol.split("_")
        return float(slopes[motion][OUTPUTS.index(output)] / (prime_scale(output, motion, density, length) * speed))

    volume = 0.5 * density * length**3
    mass = particulars.mass.value / volume
    bg = particulars.centre_of_gravity.value[2] - particulars.centre_of_buoyancy.value[2]
    stiffness = model.weight * bg / volume
    dynamic = 0.5 * density * length**2 * speed**2
    reversal = {}
    for group in ("stern", "sail"):
        planes = [p.name for p in vehicle.planes if p.name.startswith(group)]
        by_command = _plane_slope(model, vehicle, planes, speed, depth)
        z_d, m_d = by_command[2] / dynamic, by_command[4] / (dynamic * length)
        reversal[group] = critical_speed(stiffness, prime("Z_w"), prime("M_w"), z_d, m_d)
    try:
        trim = self_propulsion(model, mixer_of(vehicle), speed, depth, plane_limits(vehicle)[0])
        values = [_eigenvalues(model, trim.state, trim.controls, kept) for kept in (_VERTICAL, _HORIZONTAL)]
    except NoEquilibrium:
        values = [[], []]
    return Stability(
        speed=speed,
        depth=depth,
        g_vertical=stability_index(prime("Z_w"), prime("M_w"), prime("Z_q"), prime("M_q"), mass),
        g_horizontal=stability_index(prime("Y_v"), prime("N_v"), prime("Y_r"), prime("N_r"), -mass),
        neutral_point_vertical=-prime("M_w") / prime("Z_w"),
        neutral_point_horizontal=prime("N_v") / prime("Y_v"),
        critical_speed_stern=reversal["stern"],
        critical_speed_sail=reversal["sail"],
        vertical=values[0],
        horizontal=values[1],
    )


def as_json(found: list[Stability]) -> list[dict[str, Any]]:
    """The results as plain data; eigenvalues as [real, imaginary]."""
    return [asdict(s) for s in found]


def show(found: list[Stability], title: str, console: Console) -> None:
    """Print the results as a table."""
    from rich.table import Table

    table = Table(
        *("U [m/s]", "D0 [m]", "Gv", "Gh", "neutral point v, h [L]", "critical speed stern, sail [m/s]"),
        *("vertical [1/s]", "horizontal [1/s]"),
        title=title,
    )

    def speed(value: float | None) -> str:
        return "none" if value is None else f"{value:.2f}"

    def root(values: list[tuple[float, float]]) -> str:
        if not values:
            return "no trim"
        real, imaginary = values[0]
        return f"{real:+.4f}" + (f" +-{abs(imaginary):.4f}i" if imaginary else "")

    for s in found:
        points = f"{s.neutral_point_vertical:+.3f}, {s.neutral_point_horizontal:+.3f}"
        critical = f"{speed(s.critical_speed_stern)}, {speed(s.critical_speed_sail)}"
        signs = [f"[{'green' if g > 0 else 'red'}]{g:+.3f}[/]" for g in (s.g_vertical, s.g_horizontal)]
        table.add_row(f"{s.speed:.3f}", f"{s.depth:g}", *signs, points, critical, root(s.vertical), root(s.horizontal))
    console.print(table)
    console.print("last two columns: least stable root about self-propulsion")
