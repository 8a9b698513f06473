"""Loops that are timed, compiled like those of a simulation: other threads go on beside them."""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.kernel.layout import Around, Stage
from sim.kernel.rhs import FROM_STATE, fill_rate, step
from sim.waves.surroundings import near_of, prepare


@njit(nogil=True)
def rates(
    m: np.ndarray, w: np.ndarray, states: np.ndarray, controls: np.ndarray, s: np.ndarray, k: np.ndarray, dy: np.ndarray
) -> None:
    """The right-hand side at each of (n, 12) states, in calm water."""
    for i in range(states.shape[0]):
        fill_rate(m, w, states[i], controls[i], (), s, k, dy)


@njit(nogil=True)
def steps(
    m: np.ndarray,
    w: np.ndarray,
    states: np.ndarray,
    controls: np.ndarray,
    rate: np.ndarray,
    h: float,
    around: Around,
    s: np.ndarray,
    k: np.ndarray,
    stage: Stage,
    out: np.ndarray,
) -> None:
    """A Runge-Kutta step from each of (n, 12) states, ``h`` apart, with the sums over the waves when they are due."""
    near = near_of(around)
    for i in range(states.shape[0]):
        prepare(around, states[i], i * h)
        step(m, w, states[i], controls[i], rate, h, near, s, k, stage, FROM_STATE, out)
