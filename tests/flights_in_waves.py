"""Made flights and seas with known answers."""

from __future__ import annotations

import numpy as np

from sim.flight.simulation import Simulation


def made_flight(time: np.ndarray, **columns: np.ndarray) -> Simulation:
    """A simulation whose record holds these columns; the rest is zero. Sail top 11 m above the origin."""
    names = ("t", "u", "v", "w", "p", "q", "r", "x", "y", "z", "phi", "theta", "psi", "n", "dV", "dH")
    record = np.zeros((len(time), len(names)))
    record[:, 0] = time
    for name, values in columns.items():
        record[:, names.index(name)] = values
    none = np.zeros((0, 3))
    return Simulation(names, record, none, None, -11.0, 70.0, none, record[-1, :13])


def gaussian(density, duration: float, step: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A Gaussian process of a one-sided spectrum S(omega): random amplitudes and phases."""
    n = round(duration / step)
    omega = 2.0 * np.pi * np.fft.rfftfreq(n, step)
    draw = np.random.default_rng(seed).standard_normal((2, omega.size))
    values = np.zeros(omega.size, dtype=complex)
    values[1:] = np.sqrt(density(omega[1:]) * omega[1]) * (draw[0, 1:] + 1j * draw[1, 1:])
    return np.arange(n) * step, np.fft.irfft(values, n) * n / 2.0
