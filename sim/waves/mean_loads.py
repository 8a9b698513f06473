"""Mean second-order loads on a submerged body in one regular wave, by Lagally's theorem.

The body is a set of dipoles D = (rho V + c m)(v - U): volume points and added-mass sections,
v the water's velocity there and U their own. The mean force on each is <(grad v) . D>
(Lagally 1922; Taylor 1928; Landweber and Yih 1956). v is that of the waves plus that of the
free surface's answer to the dipoles, from the deep-water source potential (Wehausen and
Laitone 1960, Eq. 13.17) less its 1/r, as a sum of plane waves f = exp(-m z + i m (x cos + y sin)):

    G + 1/(4 pi r) = -1/(8 pi^2) PV int int (m + k)/(m - k) f(x) conj f(xi) dm d(angle)
                     - i k/(4 pi) int f(x) conj f(xi) d(angle) at m = k.

The second line radiates, so that the horizontal force is Maruo's (1960) and the yaw moment,
with the Munk moment that the drift tables hold, Newman's (1967); the first is the image. What
the simulator has already, because it puts the first-order loads where the body is, is taken
off: see docs/waves.md for the derivation.

Zero mean speed but for the encounter frequency in the response; deep water. Complex amplitudes
go with exp(-i omega t), axes are level: x to the bow, y to starboard, z down.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.boat.mass import added_mass_matrix, cross_matrix, rigid_body_matrix
from sim.waves.points import section_masses, volume_points

if TYPE_CHECKING:
    from sim.boat.coefficients import Coefficients
    from sim.boat.mass import Environment

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ROLL = 3
# Least encounter frequency over the wave's: slower, a boat surfs and linear theory ends.
_SLOWEST = 0.5
# Gauss points in each half of the image's wave numbers.
_IMAGE = 8


@dataclass(frozen=True)
class DipoleBody:
    """A submerged body as dipoles, and what resists its motion.

    Attributes
    ----------
    points : (n, 3) volume points, then section centres, from the body origin [m].
    displaced : (n,) rho V, zero for sections [kg].
    added : (n, 3) c m in x, y, z, zero for volume points [kg].
    inertia : (6, 6) rigid body and added mass about the origin [kg, kg m, kg m^2].
    restoring : (6, 6) hydrostatic stiffness [N/m, N, N m].
    free : Which of surge, sway, heave, roll, pitch and yaw follow the waves; none: a fixed body.
    density, gravity : [kg/m^3], [m/s^2].
    """

    points: Array
    displaced: Array
    added: Array
    inertia: Array
    restoring: Array
    free: tuple[int, ...]
    density: float
    gravity: float

    @property
    def mass(self) -> Array:
        """(n, 3) rho V + c m: dipole moment over relative velocity [kg]."""
        return self.displaced[:, None] + self.added

    @property
    def motions(self) -> Array:
        """(n, 3, 6) velocity of each point by u v w p q r."""
        return np.stack([np.hstack([np.eye(3), -cross_matrix(r)]) for r in self.points])

    def gathered(self, forces: Array) -> Array:
        """(..., 6) load about the origin of forces (..., n, 3) at the points."""
        return np.concatenate([forces.sum(axis=-2), np.cross(self.points, forces).sum(axis=-2)], axis=-1)


@dataclass(frozen=True)
class MeanLoads:
    """Mean loads in a wave of unit amplitude, per heading, level axes about the origin [N/m^2, N/m].

    At a depth z of the origin the mean load is a^2 exp(-2 k z) (direct + answered).

    Attributes
    ----------
    direct : (s, m, 6) of the waves themselves, beyond what the simulator has, at each speed.
    simulated : (s, m, 6) what the simulator has: first-order loads where the body is.
    answered : (d, m, 6) of the free surface's answer, scattered and radiated waves, at each depth.
    """

    direct: Array
    simulated: Array
    answered: Array


def dipole_body(coefficients: Coefficients, environment: Environment, free: bool = True) -> DipoleBody:
    """A vehicle as dipoles: its volume points and its sections' added mass.

    Roll is held: a slender hull makes no waves by rolling, so that without viscosity its
    resonance has no bound.

    Parameters
    ----------
    coefficients : With acceleration terms.
    environment : Water density and gravity.
    free : Whether the boat follows the waves, or is held fixed.

    Raises
    ------
    InputError
        When the vehicle lacks what waves need.
    """
    vehicle = coefficients.vehicle
    p, g = vehicle.particulars, environment.gravity
    volume = volume_points(vehicle, environment)
    centres, masses = section_masses(coefficients, environment, volume)
    rigid, _ = rigid_body_matrix(vehicle)
    lever = p.mass.value * p.centre_of_gravity.value[2] - p.displaced_mass.value * p.centre_of_buoyancy.value[2]
    restoring = np.zeros((6, 6))
    restoring[3, 3] = restoring[4, 4] = g * lever
    return DipoleBody(
        np.concatenate([volume.points, centres]),
        np.concatenate([environment.density * volume.volumes, np.zeros(len(centres))]),
        np.concatenate([np.zeros((len(volume.volumes), 3)), masses]),
        rigid + added_mass_matrix(coefficients, environment),
        restoring,
        tuple(k for k in range(6) if k != ROLL) if free else (),
        environment.density,
        g,
    )


def plane_waves(body: DipoleBody, number: float, angles: Array) -> tuple[Complex, Complex]:
    """Gradients of f = exp(-k z + i k (x cos + y sin)) towards angles from the bow.

    Returns
    -------
    kappa : (m, 3) grad f / f [1/m]; fields : (m, n, 3) grad f at the points of the body [1/m].
    """
    towards = np.stack([1j * np.cos(angles), 1j * np.sin(angles), -np.ones_like(angles)], axis=-1)
    kappa = number * towards.astype(np.complex128)
    return kappa, np.exp(kappa @ body.points.T)[:, :, None] * kappa[:, None, :]


def rigid_response(body: DipoleBody, velocity: Complex, frequency: float, encounter: Array) -> Complex:
    """First-order motion u v w p q r of the body under the simulator's loads, no radiation.

    Parameters
    ----------
    velocity : (m, n, 3) of the water at the points [m/s].
    frequency : omega [rad/s]. encounter : (m,) omega_e [rad/s].

    Returns
    -------
    (m, 6) [m/s, rad/s]. Froude-Krylov has the wave's own frequency, impulses that of encounter.
    """
    out = np.zeros((len(velocity), 6), dtype=complex)
    free = list(body.free)
    if not free:
        return out
    j = body.motions[:, :, free]
    stiffness = body.inertia[np.ix_(free, free)] - body.restoring[np.ix_(free, free)] / encounter[:, None, None] ** 2
    ratio = (frequency / encounter)[:, None, None]
    push = np.einsum("nij,mni->mj", j, (body.displaced[:, None] * ratio + body.added) * velocity)
    out[:, free] = np.linalg.solve(stiffness, push[:, :, None])[:, :, 0]
    return out


def local_loads(body: DipoleBody, kappa: Complex, velocity: Complex, moment: Complex) -> Array:
    """Mean load <(grad v) . moment> of dipoles in plane waves, about the origin.

    Parameters
    ----------
    kappa, velocity : (m, 3), (m, n, 3) of the waves. moment : (m, n, 3) [kg m/s].
    """
    work = (velocity.conj() * moment).sum(axis=-1)
    return body.gathered(0.5 * np.real(kappa.conj()[:, None, :] * work[:, :, None]))


def _angles(body: DipoleBody, number: float) -> Array:
    """Enough directions for the waves of all dipoles: their harmonics end beyond k times the size."""
    count = 16 + 4 * int(np.ceil(number * np.linalg.norm(body.points[:, :2], axis=1).max()))
    return 2.0 * np.pi * np.arange(count) / count


def _paired(waves: Complex, kappa: Complex, share: Array) -> Array:
    """Sums over plane waves and their opposites, which conjugate them.

    Parameters
    ----------
    waves : (c, 3 n) gradients g at the dipoles. kappa : (c, 3). share : (c,) weights.

    Returns
    -------
    (4, 3 n, 3 n) sum of share g conj(g)^T, and with kappa of x, y and z as another factor.
    """
    real, imaginary = np.ascontiguousarray(waves.real), np.ascontiguousarray(waves.imag)
    both, twice = np.concatenate([real, imaginary]), 2.0 * np.concatenate([share, share])
    fall = np.concatenate([kappa[:, 2].real] * 2)
    across = [(imaginary.T * (-2.0 * share * kappa[:, k].imag)) @ real for k in range(2)]
    return np.stack([(both.T * twice) @ both, *(a - a.T for a in across), (both.T * (twice * fall)) @ both])


def _image_numbers(number: float, depth: float) -> tuple[Array, Array]:
    """Wave numbers and weights of PV int (m + k)/(m - k) ... dm.

    Even Gauss points on [0, 2k] are symmetric about the pole; beyond, down to exp(-10) at the depth.
    """
    x, w = np.polynomial.legendre.leggauss(_IMAGE)
    reach = 2.5 / depth
    m = np.concatenate([number * (1.0 + x), 2.0 * number + reach * (1.0 + x)])
    w = np.concatenate([number * w, reach * w])
    return m, w * (m + number) / (m - number)


def surface_answer(body: DipoleBody, number: float, depth: float) -> tuple[Complex, Complex]:
    """Water velocity at each dipole, and its gradient, that the free surface makes of the dipoles.

    Parameters
    ----------
    number : k of the waves [1/m]. depth : z of the origin, all points submerged [m].

    Returns
    -------
    velocity : (3 n, 3 n) by the dipoles [1/kg]; gradient : (3, 3 n, 3 n) its x, y, z derivatives.
    """

    def summed(numbers: Array, weights: Array) -> Array:
        waves, kappas, shares = [], [], []
        for m, weight in zip(numbers, weights, strict=True):
            angles = _angles(body, m)
            kappa, g = plane_waves(body, m, angles[: len(angles) // 2])
            waves.append(g.reshape(len(g), -1))
            kappas.append(kappa)
            share = 2.0 * np.pi / len(angles) * weight * np.exp(-2.0 * m * depth) / body.density
            shares.append(np.full(len(g), share))
        return _paired(np.concatenate(waves), np.concatenate(kappas), np.concatenate(shares))

    numbers, weights = _image_numbers(number, depth)
    image = summed(numbers, weights / (8.0 * np.pi**2))
    answer = image + 1j * summed(np.array([number]), np.array([number / (4.0 * np.pi)]))
    return answer[0], answer[1:]


@dataclass(frozen=True)
class Scattering:
    """First-order solution with the free surface, in waves of unit velocity scale at the origin.

    Attributes
    ----------
    dipoles : (m, n, 3) D [kg m/s]. motion : (m, 6) of the body [m/s, rad/s].
    water : (m, n, 3) velocity at the points, the dipoles' own 1/r left out [m/s].
    force : (m, 6) whole mean load <(grad v) . D> [N, N m].
    """

    dipoles: Complex
    motion: Complex
    water: Complex
    force: Array


def scattering(body: DipoleBody, number: float, kappa: Complex, velocity: Complex, depth: float) -> Scattering:
    """Dipoles in the waves and in the free surface's answer; energy is conserved.

    Parameters
    ----------
    kappa, velocity : (m, 3), (m, n, 3) of incident waves, as without decay down to the origin.
    depth : z of the origin [m].
    """
    n, free = len(body.points), list(body.free)
    mass, j = body.mass.reshape(-1, 1), body.motions.reshape(3 * n, 6)[:, free]
    v = velocity.reshape(len(velocity), 3 * n).T
    answer, gradient = surface_answer(body, number, depth)
    # D = mass (v + answer D - j U);  inertia U = j^T mass (v + answer D)
    inertia = body.inertia[np.ix_(free, free)] - body.restoring[np.ix_(free, free)] / (number * body.gravity)
    system = np.block([[np.eye(3 * n) - mass * answer, mass * j], [-j.T @ (mass * answer), inertia]])
    solution = np.linalg.solve(system, np.concatenate([mass * v, j.T @ (mass * v)]))
    d = solution[: 3 * n]
    motion = np.zeros((len(velocity), 6), dtype=complex)
    motion[:, free] = solution[3 * n :].T
    pulled = 0.5 * np.real((gradient @ d).conj() * d).reshape(3, n, 3, -1).sum(axis=2)
    dipoles = d.T.reshape(-1, n, 3)
    force = local_loads(body, kappa, velocity, dipoles) + body.gathered(pulled.transpose(2, 1, 0))
    return Scattering(dipoles, motion, velocity + (answer @ d).T.reshape(-1, n, 3), force)


def mean_loads(body: DipoleBody, frequency: float, headings: Array, speeds: Array, depths: Array) -> MeanLoads:
    """Mean loads in regular waves of unit amplitude.

    Parameters
    ----------
    frequency : omega [rad/s].
    headings : (m,) direction the waves travel to, from the bow to starboard [rad].
    speeds : (s,) ahead [m/s]; they act through the encounter frequency of the response alone,
        held at half the wave's frequency where it would be less.
    depths : (d,) of the origin, at which the free surface's answer is wanted [m].
    """
    number = frequency**2 / body.gravity
    kappa, fields = plane_waves(body, number, headings)
    velocity = frequency / (1j * number) * fields

    def followed(encounter: Array) -> Complex:
        return np.einsum("nij,mj->mni", body.motions, rigid_response(body, velocity, frequency, encounter))

    direct, simulated = [], []
    for speed in speeds:
        encounter = np.maximum(frequency - number * speed * np.cos(headings), _SLOWEST * frequency)
        water = followed(encounter)
        moment = body.displaced[:, None] * velocity + body.added * (velocity - water)
        direct.append(local_loads(body, kappa, velocity, moment))
        had = local_loads(body, kappa, velocity, body.displaced[:, None] * water)
        simulated.append(-(frequency / encounter)[:, None] * had)
    alone = body.mass * (velocity - followed(np.full(len(headings), frequency)))
    without = local_loads(body, kappa, velocity, alone)
    answered = [scattering(body, number, kappa, velocity, z).force - without for z in depths]
    return MeanLoads(np.array(direct), np.array(simulated), np.array(answered))
