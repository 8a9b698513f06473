"""Sources of constant strength on triangles in unbounded water (Hess and Smith 1964), symmetric about y = 0.

The exact linear answer of a boat that moves ahead in a wave: what wave and boat do to each other
without lift, friction or free surface.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lu_factor, lu_solve

_MIRROR = np.array([1.0, -1.0, 1.0])


def _influence(points: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocity (n, m, 3) and potential (n, m) at points of triangles with unit source density."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    r = [corners[None, :, i] - points[:, None, :] for i in range(3)]
    size = [np.linalg.norm(v, axis=2) for v in r]
    dot = [np.einsum("abk,abk->ab", r[i], r[(i + 1) % 3]) for i in range(3)]
    bottom = size[0] * size[1] * size[2] + dot[0] * size[2] + dot[1] * size[0] + dot[2] * size[1]
    angle = 2.0 * np.arctan2(np.einsum("abk,abk->ab", r[0], np.cross(r[1], r[2])), bottom)
    height = np.einsum("abk,bk->ab", r[0], normal)
    # Integral of 1/r and its gradient.
    potential = -np.abs(height) * np.abs(angle)
    gradient = (np.sign(height) * np.abs(angle))[..., None] * normal
    for i in range(3):
        edge = corners[:, (i + 1) % 3] - corners[:, i]
        length = np.linalg.norm(edge, axis=1)
        outward = np.cross(edge / length[:, None], normal)
        both = size[i] + size[(i + 1) % 3]
        logarithm = np.log((both + length) / np.maximum(both - length, 1e-12))
        potential += np.einsum("abk,bk->ab", r[i], outward) * logarithm
        gradient -= logarithm[..., None] * outward
    return -gradient / (4.0 * np.pi), -potential / (4.0 * np.pi)


class Panels:
    """The half of a surface at y > 0, with its mirror image.

    Parameters
    ----------
    corners : (n, 3, 3) triangles of the whole surface, counter-clockwise seen from outside [m].
    """

    def __init__(self, corners: np.ndarray) -> None:
        corners = corners[corners.mean(axis=1)[:, 1] > 1e-6]
        areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(areas, axis=1)
        corners, areas, size = (v[size > 1e-6] for v in (corners, areas, size))
        self.centre, self.areas, self.normal = corners.mean(axis=1), areas, areas / size[:, None]
        own, mirrored = _influence(self.centre, corners), _influence(self.centre, (corners * _MIRROR)[:, ::-1])
        k = np.arange(len(size))
        # Just outside a panel its own sources make half their strength normal to it.
        tangential = own[0][k, k] - np.einsum("ik,ik->i", own[0][k, k], self.normal)[:, None] * self.normal
        own[0][k, k] = tangential + 0.5 * self.normal
        self._velocity, self._potential = own[0] + mirrored[0], own[1] + mirrored[1]
        self._factors = lu_factor(np.einsum("ijk,ik->ij", self._velocity, self.normal))
        x, z = self.centre[:, 0], self.centre[:, 2]
        # Normal velocity by unit surge, heave and pitch.
        self.modes = np.stack([self.normal[:, 0], self.normal[:, 2], z * self.normal[:, 0] - x * self.normal[:, 2]])
        self.answers = [self.solve(mode) for mode in self.modes]

    def solve(self, normal_velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Potential and velocity on the panels that flow off with this normal velocity."""
        sources = lu_solve(self._factors, normal_velocity)
        return self._potential @ sources, np.einsum("ijk,j->ik", self._velocity, sources)

    def load(self, pressure: np.ndarray) -> np.ndarray:
        """X, Z, M of a pressure on the panels."""
        return -2.0 * self.modes @ (pressure * np.linalg.norm(self.areas, axis=1))

    def added_mass(self, density: float) -> np.ndarray:
        """(3, 3) of surge, heave, pitch."""
        return np.array([self.load(density * potential) for potential, _ in self.answers]).T

    def wave_load(self, density: float, speed: float, number: float, sense: float, frequency: float) -> np.ndarray:
        """X, Z, M of a wave of unit elevation at the origin's depth on the boat held at a speed ahead.

        Amplitudes of exp(i (frequency of encounter) t), with sense = 1 for head seas, -1 for
        following ones. Potential -i (omega / k) exp(-k z + i sense k x), elevation there 1.
        """
        wave = 1j * frequency / number * np.exp(-number * self.centre[:, 2] + 1j * sense * number * self.centre[:, 0])
        gradient = np.stack([1j * sense * number * wave, 0.0 * wave, -number * wave], axis=1)
        scattered, velocity = self.solve(-np.einsum("ik,ik->i", gradient, self.normal))
        past = speed * (self.answers[0][1] - np.array([1.0, 0.0, 0.0]))
        past -= np.einsum("ik,ik->i", past, self.normal)[:, None] * self.normal
        met = frequency + sense * number * speed
        return self.load(-density * (1j * met * (wave + scattered) + np.einsum("ik,ik->i", past, gradient + velocity)))
